/* SPDX-License-Identifier: BSD-3-Clause */
/* The types and the 75 functions of the Functional Mock-up Interface 3.0. */
#ifndef KEMPE_FMI3_H
#define KEMPE_FMI3_H

#include "kempe_fmu.h"
#include <stdbool.h>
#include <stdint.h>

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                                       fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment environment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment environment, fmi3Float64 t,
                                               fmi3Boolean set_requested, fmi3Boolean get_allowed,
                                               fmi3Boolean step_finished, fmi3Boolean can_return_early,
                                               fmi3Boolean *return_requested, fmi3Float64 *return_time);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

/* A function of the unit, with the prefix where there is one. */
#define FMI3_RESULT(type, name, ...) KEMPE_FMU_EXPORT type KEMPE_FMU_NAME(name)(__VA_ARGS__)
#define FMI3(name, ...)              FMI3_RESULT(fmi3Status, name, fmi3Instance c, __VA_ARGS__)
#define FMI3_ALONE(name)             FMI3_RESULT(fmi3Status, name, fmi3Instance c)
#define FMI3_SOME                    const fmi3ValueReference references[], size_t count
#define FMI3_GET(type)               FMI3(fmi3Get##type, FMI3_SOME, fmi3##type values[], size_t value_count)
#define FMI3_SET(type)               FMI3(fmi3Set##type, FMI3_SOME, const fmi3##type values[], size_t value_count)
/* Of each type of numbers without variables. */
#define FMI3_TYPES(of)                                                                                                 \
    of(Float32) of(Int8) of(UInt8) of(Int16) of(UInt16) of(UInt32) of(Int64) of(UInt64) of(Boolean) of(String)

#endif
