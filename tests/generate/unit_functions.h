/* SPDX-License-Identifier: BSD-3-Clause */
/* The functions of units, which importers find by their names. */
#ifndef KEMPE_TESTS_UNIT_FUNCTIONS_H
#define KEMPE_TESTS_UNIT_FUNCTIONS_H

#include "exchange/simulator/kempe_fmi2.h"
#include "exchange/simulator/kempe_fmi3.h"

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

#endif
