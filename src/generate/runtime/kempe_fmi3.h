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

#ifdef __cplusplus
extern "C" {
#endif

FMI3_RESULT(const char *, fmi3GetVersion, void);
FMI3(fmi3SetDebugLogging, fmi3Boolean on, size_t count, const fmi3String categories[]);
FMI3_RESULT(fmi3Instance, fmi3InstantiateModelExchange, fmi3String name, fmi3String token, fmi3String resources,
            fmi3Boolean visible, fmi3Boolean logs, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log);
FMI3_RESULT(fmi3Instance, fmi3InstantiateCoSimulation, fmi3String name, fmi3String token, fmi3String resources,
            fmi3Boolean visible, fmi3Boolean logs, fmi3Boolean has_events, fmi3Boolean returns_early,
            const fmi3ValueReference intermediate[], size_t intermediate_count, fmi3InstanceEnvironment environment,
            fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update);
FMI3_RESULT(fmi3Instance, fmi3InstantiateScheduledExecution, fmi3String name, fmi3String token, fmi3String resources,
            fmi3Boolean visible, fmi3Boolean logs, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
            fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock);
FMI3_RESULT(void, fmi3FreeInstance, fmi3Instance c);
FMI3(fmi3EnterInitializationMode, fmi3Boolean tolerance_given, fmi3Float64 tolerance, fmi3Float64 start,
     fmi3Boolean stop_given, fmi3Float64 stop);
FMI3_ALONE(fmi3ExitInitializationMode);
FMI3_ALONE(fmi3EnterEventMode);
FMI3_ALONE(fmi3Terminate);
FMI3_ALONE(fmi3Reset);

#define DECLARE(type)                                                                                                  \
    FMI3_GET(type);                                                                                                    \
    FMI3_SET(type);
DECLARE(Float64)
DECLARE(Int32)
FMI3_TYPES(DECLARE)
#undef DECLARE
FMI3(fmi3GetBinary, FMI3_SOME, size_t sizes[], fmi3Binary values[], size_t value_count);
FMI3(fmi3SetBinary, FMI3_SOME, const size_t sizes[], const fmi3Binary values[], size_t value_count);
FMI3(fmi3GetClock, FMI3_SOME, fmi3Clock values[]);
FMI3(fmi3SetClock, FMI3_SOME, const fmi3Clock values[]);
FMI3(fmi3GetNumberOfVariableDependencies, fmi3ValueReference reference, size_t *count);
FMI3(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t dependent_elements[],
     fmi3ValueReference independents[], size_t independent_elements[], fmi3DependencyKind kinds[], size_t count);

FMI3(fmi3GetFMUState, fmi3FMUState *state);
FMI3(fmi3SetFMUState, fmi3FMUState state);
FMI3(fmi3FreeFMUState, fmi3FMUState *state);
FMI3(fmi3SerializedFMUStateSize, fmi3FMUState state, size_t *size);
FMI3(fmi3SerializeFMUState, fmi3FMUState state, fmi3Byte bytes[], size_t size);
FMI3(fmi3DeserializeFMUState, const fmi3Byte bytes[], size_t size, fmi3FMUState *state);
FMI3(fmi3GetDirectionalDerivative, const fmi3ValueReference unknowns[], size_t unknown_count,
     const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[], size_t seed_count,
     fmi3Float64 sensitivity[], size_t sensitivity_count);
FMI3(fmi3GetAdjointDerivative, const fmi3ValueReference unknowns[], size_t unknown_count,
     const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[], size_t seed_count,
     fmi3Float64 sensitivity[], size_t sensitivity_count);

FMI3_ALONE(fmi3EnterConfigurationMode);
FMI3_ALONE(fmi3ExitConfigurationMode);
FMI3(fmi3GetIntervalDecimal, FMI3_SOME, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]);
FMI3(fmi3GetIntervalFraction, FMI3_SOME, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
     fmi3IntervalQualifier qualifiers[]);
FMI3(fmi3GetShiftDecimal, FMI3_SOME, fmi3Float64 shifts[]);
FMI3(fmi3GetShiftFraction, FMI3_SOME, fmi3UInt64 counters[], fmi3UInt64 resolutions[]);
FMI3(fmi3SetIntervalDecimal, FMI3_SOME, const fmi3Float64 intervals[]);
FMI3(fmi3SetIntervalFraction, FMI3_SOME, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
FMI3(fmi3SetShiftDecimal, FMI3_SOME, const fmi3Float64 shifts[]);
FMI3(fmi3SetShiftFraction, FMI3_SOME, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]);
FMI3_ALONE(fmi3EvaluateDiscreteStates);
FMI3(fmi3UpdateDiscreteStates, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals_changed,
     fmi3Boolean *values_changed, fmi3Boolean *next_given, fmi3Float64 *next);

FMI3_ALONE(fmi3EnterContinuousTimeMode);
FMI3(fmi3CompletedIntegratorStep, fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate);
FMI3(fmi3SetTime, fmi3Float64 t);
FMI3(fmi3SetContinuousStates, const fmi3Float64 x[], size_t count);
FMI3(fmi3GetContinuousStateDerivatives, fmi3Float64 dx[], size_t count);
FMI3(fmi3GetEventIndicators, fmi3Float64 value[], size_t count);
FMI3(fmi3GetContinuousStates, fmi3Float64 x[], size_t count);
FMI3(fmi3GetNominalsOfContinuousStates, fmi3Float64 nominal[], size_t count);
FMI3(fmi3GetNumberOfEventIndicators, size_t *count);
FMI3(fmi3GetNumberOfContinuousStates, size_t *count);

FMI3_ALONE(fmi3EnterStepMode);
FMI3(fmi3GetOutputDerivatives, FMI3_SOME, const fmi3Int32 orders[], fmi3Float64 values[], size_t value_count);
FMI3(fmi3DoStep, fmi3Float64 from, fmi3Float64 step, fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate,
     fmi3Boolean *early, fmi3Float64 *reached);
FMI3(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 t);

#ifdef __cplusplus
}
#endif
#endif
