/* SPDX-License-Identifier: BSD-3-Clause */
/* The types and functions of the Functional Mock-up Interface 2.0, as far as a unit has them. */
#ifndef KEMPE_FMI2_H
#define KEMPE_FMI2_H

#include "kempe_fmu.h"

typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef struct {
    void (*logger)(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
                   fmi2String format, ...);
    void *(*allocateMemory)(size_t count, size_t size);
    void (*freeMemory)(void *memory);
    void (*stepFinished)(fmi2ComponentEnvironment environment, fmi2Status status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation;
    fmi2Boolean nominalsOfContinuousStatesChanged, valuesOfContinuousStatesChanged;
    fmi2Boolean nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

/* A function of the unit, with the prefix where there is one. */
#define FMI2(type, name, ...) KEMPE_FMU_EXPORT type KEMPE_FMU_NAME(name)(__VA_ARGS__)
#define FMI2_SOME             const fmi2ValueReference references[], size_t count

#ifdef __cplusplus
extern "C" {
#endif

FMI2(const char *, fmi2GetTypesPlatform, void);
FMI2(const char *, fmi2GetVersion, void);
FMI2(fmi2Status, fmi2SetDebugLogging, fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[]);
FMI2(fmi2Component, fmi2Instantiate, fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
     const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logs);
FMI2(void, fmi2FreeInstance, fmi2Component c);
FMI2(fmi2Status, fmi2SetupExperiment, fmi2Component c, fmi2Boolean tolerance_given, fmi2Real tolerance, fmi2Real start,
     fmi2Boolean stop_given, fmi2Real stop);
FMI2(fmi2Status, fmi2EnterInitializationMode, fmi2Component c);
FMI2(fmi2Status, fmi2ExitInitializationMode, fmi2Component c);
FMI2(fmi2Status, fmi2Terminate, fmi2Component c);
FMI2(fmi2Status, fmi2Reset, fmi2Component c);
FMI2(fmi2Status, fmi2GetReal, fmi2Component c, FMI2_SOME, fmi2Real values[]);
FMI2(fmi2Status, fmi2GetInteger, fmi2Component c, FMI2_SOME, fmi2Integer values[]);
FMI2(fmi2Status, fmi2GetBoolean, fmi2Component c, FMI2_SOME, fmi2Boolean values[]);
FMI2(fmi2Status, fmi2GetString, fmi2Component c, FMI2_SOME, fmi2String values[]);
FMI2(fmi2Status, fmi2SetReal, fmi2Component c, FMI2_SOME, const fmi2Real values[]);
FMI2(fmi2Status, fmi2SetInteger, fmi2Component c, FMI2_SOME, const fmi2Integer values[]);
FMI2(fmi2Status, fmi2SetBoolean, fmi2Component c, FMI2_SOME, const fmi2Boolean values[]);
FMI2(fmi2Status, fmi2SetString, fmi2Component c, FMI2_SOME, const fmi2String values[]);
FMI2(fmi2Status, fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *state);
FMI2(fmi2Status, fmi2SetFMUstate, fmi2Component c, fmi2FMUstate state);
FMI2(fmi2Status, fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *state);
FMI2(fmi2Status, fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate state, size_t *size);
FMI2(fmi2Status, fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size);
FMI2(fmi2Status, fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state);
FMI2(fmi2Status, fmi2GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference unknowns[],
     size_t unknown_count, const fmi2ValueReference knowns[], size_t known_count, const fmi2Real seed[],
     fmi2Real sensitivity[]);
FMI2(fmi2Status, fmi2EnterEventMode, fmi2Component c);
FMI2(fmi2Status, fmi2NewDiscreteStates, fmi2Component c, fmi2EventInfo *info);
FMI2(fmi2Status, fmi2EnterContinuousTimeMode, fmi2Component c);
FMI2(fmi2Status, fmi2CompletedIntegratorStep, fmi2Component c, fmi2Boolean no_return, fmi2Boolean *event,
     fmi2Boolean *terminate);
FMI2(fmi2Status, fmi2SetTime, fmi2Component c, fmi2Real t);
FMI2(fmi2Status, fmi2SetContinuousStates, fmi2Component c, const fmi2Real x[], size_t count);
FMI2(fmi2Status, fmi2GetDerivatives, fmi2Component c, fmi2Real dx[], size_t count);
FMI2(fmi2Status, fmi2GetEventIndicators, fmi2Component c, fmi2Real value[], size_t count);
FMI2(fmi2Status, fmi2GetContinuousStates, fmi2Component c, fmi2Real x[], size_t count);
FMI2(fmi2Status, fmi2GetNominalsOfContinuousStates, fmi2Component c, fmi2Real nominal[], size_t count);
FMI2(fmi2Status, fmi2SetRealInputDerivatives, fmi2Component c, FMI2_SOME, const fmi2Integer orders[],
     const fmi2Real values[]);
FMI2(fmi2Status, fmi2GetRealOutputDerivatives, fmi2Component c, FMI2_SOME, const fmi2Integer orders[],
     fmi2Real values[]);
FMI2(fmi2Status, fmi2DoStep, fmi2Component c, fmi2Real from, fmi2Real step, fmi2Boolean no_return);
FMI2(fmi2Status, fmi2CancelStep, fmi2Component c);
FMI2(fmi2Status, fmi2GetStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Status *value);
FMI2(fmi2Status, fmi2GetRealStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Real *value);
FMI2(fmi2Status, fmi2GetIntegerStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value);
FMI2(fmi2Status, fmi2GetBooleanStatus, fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value);
FMI2(fmi2Status, fmi2GetStringStatus, fmi2Component c, const fmi2StatusKind kind, fmi2String *value);

#ifdef __cplusplus
}
#endif
#endif
