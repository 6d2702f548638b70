/* SPDX-License-Identifier: BSD-3-Clause */
/* The functions of the Functional Mock-up Interface 3.0. Functions of clocks, of structural parameters and of scheduled
 * execution are present, because importers look for all, and answer with an error. */
#include "fmi3Functions.h"
#include "kempe_fmu.h"
#include <math.h>

#define FMI(name)               fmi3##name
#define FMI_OF_STATE(verb, end) fmi3##verb##FMUState##end
#define FMI_DESERIALIZE         fmi3DeserializeFMUState
#define FMI_DERIVATIVES         fmi3GetContinuousStateDerivatives
#define FMI_MORE                , size_t value_count
#define FMI_CHECK_MORE          COUNTS(value_count, count)
typedef fmi3Instance fmi_instance;
typedef fmi3FMUState fmi_state;

typedef struct unit {
    kempe_fmu fmu;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    fmi3IntermediateUpdateCallback update;
    int has_events, returns_early;
} unit;

static void *take(const unit *instance, size_t bytes)
{
    (void)instance;
    return malloc(bytes);
}

static void give_back(const unit *instance, void *memory)
{
    (void)instance;
    free(memory);
}

static void report(const unit *instance, fmi3Status status, const char *category, const char *sentence)
{
    if (instance->log)
        instance->log(instance->environment, status, category, sentence);
}

#include "kempe_fmi.h"

#define COUNTS(given, expected)                                                                                        \
    if ((given) != (expected))                                                                                         \
    FAIL("%s needs as many values as value references: all variables are scalars. Given are %lu and %lu.", __func__,   \
         (unsigned long)(given), (unsigned long)(expected))

/* -- instances --------------------------------------------------------------------------------------- */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logs, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    const unit asked = {.environment = environment, .log = log};
    (void)visible;
    return instantiate(&asked, KEMPE_FMU_MODEL_EXCHANGE, name, token, resources, logs, 0);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logs, fmi3Boolean has_events, fmi3Boolean returns_early,
                                         const fmi3ValueReference intermediate[], size_t intermediate_count,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    const unit asked = {.environment = environment,
                        .log = log,
                        .update = update,
                        .has_events = has_events,
                        .returns_early = returns_early};
    (void)visible, (void)intermediate, (void)intermediate_count;
    return instantiate(&asked, KEMPE_FMU_CO_SIMULATION, name, token, resources, logs, 0);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logs,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logs, (void)clock, (void)lock, (void)unlock;
    const unit asked = {.environment = environment, .log = log};
    report(&asked, fmi3Error, kempe_fmu_categories[KEMPE_FMU_LOG_ERROR],
           "The unit has no scheduled execution: use model exchange or co-simulation.");
    return NULL;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_given, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_given, fmi3Float64 stop)
{
    ALLOWED(KEMPE_FMU_INSTANTIATED);
    kempe_fmu_status status = kempe_fmu_set_up(fmu, tolerance_given, tolerance, start, stop_given, stop);
    ANSWER(status == KEMPE_FMU_OK ? kempe_fmu_enter_initialization(fmu) : status);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    ALLOWED(KEMPE_FMU_INITIALIZATION);
    const int events = fmu->kind == KEMPE_FMU_MODEL_EXCHANGE || ((unit *)c)->has_events;
    ANSWER(kempe_fmu_exit_initialization(fmu, events ? KEMPE_FMU_EVENT : KEMPE_FMU_STEP));
}

/* -- variables --------------------------------------------------------------------------------------- */

VALUES(fmi3GetFloat64, fmi3Float64, KEMPE_FMU_ANY, kempe_fmu_get)
VALUES(fmi3SetFloat64, const fmi3Float64, BEFORE_RUN | KEMPE_FMU_RUNS, kempe_fmu_set)
VALUES(fmi3GetInt32, fmi3Int32, KEMPE_FMU_ANY, kempe_fmu_get_integers)

/* Types without variables. */
#define KEMPE_FMI3_LIST(...) __VA_ARGS__
#define NONE(name, type, arguments, unused)                                                                            \
    fmi3Status name(fmi3Instance c, SOME, KEMPE_FMI3_LIST arguments)                                                   \
    {                                                                                                                  \
        ALLOWED(KEMPE_FMU_ANY);                                                                                        \
        KEMPE_FMI3_LIST unused;                                                                                        \
        ANSWER(kempe_fmu_no_variables(fmu, count, references, type));                                                  \
    }
#define NO_NUMBERS(type)                                                                                               \
    NONE(fmi3Get##type, #type, (fmi3##type values[], size_t value_count), ((void)values, (void)value_count))           \
    NONE(fmi3Set##type, #type, (const fmi3##type values[], size_t value_count), ((void)values, (void)value_count))
NO_NUMBERS(Float32)
NO_NUMBERS(Int8)
NO_NUMBERS(UInt8)
NO_NUMBERS(Int16)
NO_NUMBERS(UInt16)
NO_NUMBERS(UInt32)
NO_NUMBERS(Int64)
NO_NUMBERS(UInt64)
NO_NUMBERS(Boolean)
NO_NUMBERS(String)
NONE(fmi3SetInt32, "Int32 that can be set", (const fmi3Int32 values[], size_t value_count),
     ((void)values, (void)value_count))
NONE(fmi3GetBinary, "Binary", (size_t sizes[], fmi3Binary values[], size_t value_count),
     ((void)sizes, (void)values, (void)value_count))
NONE(fmi3SetBinary, "Binary", (const size_t sizes[], const fmi3Binary values[], size_t value_count),
     ((void)sizes, (void)values, (void)value_count))
NONE(fmi3GetClock, "Clock", (fmi3Clock values[]), ((void)values))
NONE(fmi3SetClock, "Clock", (const fmi3Clock values[]), ((void)values))

/* -- derivatives ------------------------------------------------------------------------------------- */

/* Seeds of knowns give sensitivities of unknowns, or the other way round. */
#define DERIVATIVE(name, call, word, seeds, sensitivities)                                                             \
    fmi3Status name(fmi3Instance c, const fmi3ValueReference unknowns[], size_t unknown_count,                         \
                    const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],                   \
                    size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count)                            \
    {                                                                                                                  \
        ALLOWED(KEMPE_FMU_INITIALIZATION | KEMPE_FMU_RUNS | KEMPE_FMU_TERMINATED);                                     \
        if (!unknowns || !knowns || !seed || !sensitivity)                                                             \
            FAIL("An array of the " word " derivative is NULL.");                                                      \
        COUNTS(seed_count, seeds);                                                                                     \
        COUNTS(sensitivity_count, sensitivities);                                                                      \
        ANSWER(call(fmu, unknowns, unknown_count, knowns, known_count, seed, sensitivity));                            \
    }
DERIVATIVE(fmi3GetDirectionalDerivative, kempe_fmu_directional, "directional", known_count, unknown_count)
DERIVATIVE(fmi3GetAdjointDerivative, kempe_fmu_adjoint, "adjoint", unknown_count, known_count)

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, SOME, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t value_count)
{
    ALLOWED(KEMPE_FMU_STEP | KEMPE_FMU_INTERMEDIATE | KEMPE_FMU_TERMINATED);
    COUNTS(value_count, count);
    ANSWER(kempe_fmu_output_rates(fmu, references, count, orders, values));
}

/* -- functions that the unit does without ------------------------------------------------------------ */

#define WITHOUT(name, arguments, unused, sentence)                                                                     \
    fmi3Status name(fmi3Instance c KEMPE_FMI3_LIST arguments)                                                          \
    {                                                                                                                  \
        ALLOWED(KEMPE_FMU_ANY);                                                                                        \
        KEMPE_FMI3_LIST unused;                                                                                        \
        FAIL(sentence);                                                                                                \
    }
#define NO_CLOCKS    "The unit has no clocks."
#define NO_STRUCTURE "The unit has no structural parameters, and so no Configuration Mode."
#define NO_ELEMENTS  "Dependencies are in modelDescription.xml: the unit does not list them by elements."

WITHOUT(fmi3GetNumberOfVariableDependencies, (, fmi3ValueReference reference, size_t *count),
        ((void)reference, (void)count), NO_ELEMENTS)
WITHOUT(fmi3GetVariableDependencies,
        (, fmi3ValueReference dependent, size_t dependent_elements[], fmi3ValueReference independents[],
         size_t independent_elements[], fmi3DependencyKind kinds[], size_t count),
        ((void)dependent, (void)dependent_elements, (void)independents, (void)independent_elements, (void)kinds,
         (void)count),
        NO_ELEMENTS)
WITHOUT(fmi3EnterConfigurationMode, (), ((void)0), NO_STRUCTURE)
WITHOUT(fmi3ExitConfigurationMode, (), ((void)0), NO_STRUCTURE)
WITHOUT(fmi3GetIntervalDecimal, (, SOME, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]),
        ((void)references, (void)count, (void)intervals, (void)qualifiers), NO_CLOCKS)
WITHOUT(fmi3GetIntervalFraction,
        (, SOME, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]),
        ((void)references, (void)count, (void)counters, (void)resolutions, (void)qualifiers), NO_CLOCKS)
WITHOUT(fmi3GetShiftDecimal, (, SOME, fmi3Float64 shifts[]), ((void)references, (void)count, (void)shifts), NO_CLOCKS)
WITHOUT(fmi3GetShiftFraction, (, SOME, fmi3UInt64 counters[], fmi3UInt64 resolutions[]),
        ((void)references, (void)count, (void)counters, (void)resolutions), NO_CLOCKS)
WITHOUT(fmi3SetIntervalDecimal, (, SOME, const fmi3Float64 intervals[]),
        ((void)references, (void)count, (void)intervals), NO_CLOCKS)
WITHOUT(fmi3SetIntervalFraction, (, SOME, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
        ((void)references, (void)count, (void)counters, (void)resolutions), NO_CLOCKS)
WITHOUT(fmi3SetShiftDecimal, (, SOME, const fmi3Float64 shifts[]), ((void)references, (void)count, (void)shifts),
        NO_CLOCKS)
WITHOUT(fmi3SetShiftFraction, (, SOME, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
        ((void)references, (void)count, (void)counters, (void)resolutions), NO_CLOCKS)
WITHOUT(fmi3ActivateModelPartition, (, fmi3ValueReference clock, fmi3Float64 t), ((void)clock, (void)t),
        "The unit has no scheduled execution: use model exchange or co-simulation.")

/* -- events ------------------------------------------------------------------------------------------ */

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    ALLOWED(KEMPE_FMU_EVENT | KEMPE_FMU_CONTINUOUS | KEMPE_FMU_STEP);
    if (fmu->kind == KEMPE_FMU_CO_SIMULATION && !((unit *)c)->has_events)
        FAIL("Event Mode needs an instance that was made with eventModeUsed.");
    fmu->now.mode = KEMPE_FMU_EVENT;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c)
{
    ALLOWED(KEMPE_FMU_INITIALIZATION | KEMPE_FMU_EVENT);
    ANSWER(kempe_fmu_refresh(fmu));
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals_changed, fmi3Boolean *values_changed, fmi3Boolean *next_given,
                                    fmi3Float64 *next)
{
    ALLOWED(KEMPE_FMU_EVENT);
    int changed = 0, exchanged = 0, ended = fmu->now.ended;
    double time = INFINITY;
    if (!again || !terminate || !nominals_changed || !values_changed || !next_given || !next)
        FAIL("A place for the results of the event is NULL.");
    kempe_fmu_status status = fmu->kind == KEMPE_FMU_MODEL_EXCHANGE || fmu->now.event
                                  ? kempe_fmu_update(fmu, &changed, &exchanged, &ended, &time)
                                  : kempe_fmu_refresh(fmu); /* without a break of the integration */
    *again = false;
    *next_given = time < INFINITY && fmu->kind == KEMPE_FMU_MODEL_EXCHANGE;
    *terminate = ended;
    *nominals_changed = exchanged;
    *values_changed = changed;
    *next = *next_given ? time : 0;
    ANSWER(status);
}

/* -- model exchange ---------------------------------------------------------------------------------- */

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *count)
{
    ALLOWED(KEMPE_FMU_ANY);
    if (!count)
        FAIL("The place for the number of event indicators is NULL.");
    *count = (size_t)kempe_fmu_indicators(fmu);
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *count)
{
    ALLOWED(KEMPE_FMU_ANY);
    if (!count)
        FAIL("The place for the number of continuous states is NULL.");
    *count = 2 * (size_t)fmu->model->equations->freedom;
    return fmi3OK;
}

/* -- co-simulation ----------------------------------------------------------------------------------- */

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    ALLOWED(KEMPE_FMU_EVENT);
    SAME_KIND(KEMPE_FMU_CO_SIMULATION);
    fmu->now.mode = KEMPE_FMU_STEP;
    return fmi3OK;
}

static int observe(kempe_fmu *fmu, double t, double *until)
{
    const unit *instance = (const unit *)(const void *)fmu;
    fmi3Boolean wanted = false;
    instance->update(instance->environment, t, false, true, true, instance->returns_early, &wanted, until);
    return wanted && instance->returns_early;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 from, fmi3Float64 step, fmi3Boolean no_return, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)
{
    ALLOWED(KEMPE_FMU_STEP);
    const unit *instance = c;
    kempe_fmu_stride stride;
    (void)no_return;
    if (!event || !terminate || !early || !reached)
        FAIL("A place for the results of the step is NULL.");
    memset(&stride, 0, sizeof stride);
    stride.stops_at_events = instance->has_events && instance->returns_early;
    stride.observer = instance->update ? observe : NULL;
    kempe_fmu_status status = kempe_fmu_do_step(fmu, from, step, &stride);
    *event = stride.event;
    *terminate = stride.ended;
    *early = stride.early;
    *reached = stride.reached;
    ANSWER(status);
}
