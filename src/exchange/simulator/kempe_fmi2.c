/* SPDX-License-Identifier: BSD-3-Clause */
/* The functions of the Functional Mock-up Interface 2.0. */
#include "fmi2Functions.h"
#include "kempe_fmu.h"
#include <math.h>
#include <stdlib.h>

#define FMI(name)               fmi2##name
#define FMI_OF_STATE(verb, end) fmi2##verb##FMUstate##end
#define FMI_DESERIALIZE         fmi2DeSerializeFMUstate
#define FMI_DERIVATIVES         fmi2GetDerivatives
#define FMI_MORE
#define FMI_CHECK_MORE
typedef fmi2Component fmi_instance;
typedef fmi2FMUstate fmi_state;

/* Behind its numbers, an instance has its name. */
typedef struct unit {
    kempe_fmu fmu;
    fmi2CallbackFunctions functions;
    const char *name;
    kempe_fmu_stride last; /* communication step */
} unit;

static void *take(const unit *instance, size_t bytes)
{
    return instance->functions.allocateMemory ? instance->functions.allocateMemory(1, bytes) : malloc(bytes);
}

static void give_back(const unit *instance, void *memory)
{
    void (*release)(void *) = instance->functions.freeMemory;
    if (release)
        release(memory);
    else
        free(memory);
}

/* The sentence as the format, because some importers show only that. */
static void report(const unit *instance, fmi2Status status, const char *category, const char *sentence)
{
    const fmi2CallbackFunctions *functions = &instance->functions;
    char format[1300];
    size_t used = 0;
    for (; *sentence && used + 3 < sizeof format; sentence++) {
        if (*sentence == '%')
            format[used++] = '%';
        format[used++] = *sentence;
    }
    format[used] = 0;
    if (functions->logger)
        functions->logger(functions->componentEnvironment, instance->name, status, category, format);
}

#include "kempe_fmi.h"

/* -- instances --------------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logs)
{
    const int kind = type == fmi2ModelExchange ? KEMPE_FMU_MODEL_EXCHANGE : KEMPE_FMU_CO_SIMULATION;
    const char *own = name ? name : "";
    const size_t letters = strlen(own) + 1;
    unit asked = {.name = own};
    (void)visible;
    if (!functions)
        return NULL;
    asked.functions = *functions;
    unit *instance = instantiate(&asked, kind, name, guid, resources, logs, letters);
    if (instance)
        instance->name = memcpy((double *)(void *)(instance + 1) + kempe_fmu_memory(instance->fmu.model), own, letters);
    return instance;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_given, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_given, fmi2Real stop)
{
    ALLOWED(KEMPE_FMU_INSTANTIATED);
    ANSWER(kempe_fmu_set_up(fmu, tolerance_given, tolerance, start, stop_given, stop));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    ALLOWED(KEMPE_FMU_INSTANTIATED);
    ANSWER(kempe_fmu_enter_initialization(fmu));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    ALLOWED(KEMPE_FMU_INITIALIZATION);
    ANSWER(
        kempe_fmu_exit_initialization(fmu, fmu->kind == KEMPE_FMU_MODEL_EXCHANGE ? KEMPE_FMU_EVENT : KEMPE_FMU_STEP));
}

/* -- variables --------------------------------------------------------------------------------------- */

VALUES(fmi2GetReal, fmi2Real, KEMPE_FMU_ANY, kempe_fmu_get)
VALUES(fmi2SetReal, const fmi2Real, BEFORE_RUN | KEMPE_FMU_RUNS, kempe_fmu_set)
VALUES(fmi2GetInteger, fmi2Integer, KEMPE_FMU_ANY, kempe_fmu_get_integers)

/* Types without variables that can be read or set. */
#define NONE(name, values_type, type)                                                                                  \
    fmi2Status name(fmi2Component c, SOME, values_type values[])                                                       \
    {                                                                                                                  \
        ALLOWED(KEMPE_FMU_ANY);                                                                                        \
        (void)values;                                                                                                  \
        ANSWER(kempe_fmu_no_variables(fmu, count, references, type));                                                  \
    }
NONE(fmi2GetBoolean, fmi2Boolean, "Boolean")
NONE(fmi2GetString, fmi2String, "String")
NONE(fmi2SetInteger, const fmi2Integer, "Integer that can be set")
NONE(fmi2SetBoolean, const fmi2Boolean, "Boolean")
NONE(fmi2SetString, const fmi2String, "String")

/* -- derivatives ------------------------------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t unknown_count,
                                        const fmi2ValueReference knowns[], size_t known_count, const fmi2Real seed[],
                                        fmi2Real sensitivity[])
{
    ALLOWED(KEMPE_FMU_INITIALIZATION | KEMPE_FMU_RUNS | KEMPE_FMU_TERMINATED);
    if (!unknowns || !knowns || !seed || !sensitivity)
        FAIL("An array of the directional derivative is NULL.");
    ANSWER(kempe_fmu_directional(fmu, unknowns, unknown_count, knowns, known_count, seed, sensitivity));
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, SOME, const fmi2Integer orders[], fmi2Real values[])
{
    ALLOWED(KEMPE_FMU_STEP | KEMPE_FMU_TERMINATED);
    ANSWER(kempe_fmu_output_rates(fmu, references, count, orders, values));
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, SOME, const fmi2Integer orders[], const fmi2Real values[])
{
    ALLOWED(BEFORE_RUN | KEMPE_FMU_STEP);
    (void)orders, (void)values;
    if (count)
        FAIL("Inputs are constant during a communication step: the value reference %u takes no derivatives. The "
             "derivatives that drives read are inputs of their own, with the endings .d and .dd.",
             references ? references[0] : 0);
    return fmi2OK;
}

/* -- model exchange ---------------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    ALLOWED(KEMPE_FMU_EVENT | KEMPE_FMU_CONTINUOUS);
    fmu->now.mode = KEMPE_FMU_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    ALLOWED(KEMPE_FMU_EVENT);
    int changed = 0, exchanged = 0, ended = 0;
    double next = INFINITY;
    if (!info)
        FAIL("The place for the results of the event is NULL.");
    kempe_fmu_status status = kempe_fmu_update(fmu, &changed, &exchanged, &ended, &next);
    memset(info, 0, sizeof *info);
    info->terminateSimulation = ended;
    info->valuesOfContinuousStatesChanged = changed;
    info->nominalsOfContinuousStatesChanged = exchanged;
    info->nextEventTimeDefined = next < INFINITY;
    info->nextEventTime = next < INFINITY ? next : 0;
    ANSWER(status);
}

/* -- co-simulation ----------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real from, fmi2Real step, fmi2Boolean no_return)
{
    ALLOWED(KEMPE_FMU_STEP);
    kempe_fmu_stride *last = &((unit *)c)->last;
    (void)no_return;
    memset(last, 0, sizeof *last);
    kempe_fmu_status status = kempe_fmu_do_step(fmu, from, step, last);
    return status == KEMPE_FMU_OK && last->ended ? fmi2Discard : (fmi2Status)status;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    ALLOWED(KEMPE_FMU_ANY);
    FAIL("Communication steps are made at once: there is none to be cancelled.");
}

static fmi2Status no_status(kempe_fmu *fmu)
{
    ANSWER(kempe_fmu_say(fmu, KEMPE_FMU_DISCARD, KEMPE_FMU_LOG_DISCARD,
                         "The unit has no such status: communication steps are made at once."));
}

#define NO_STATUS(name, type)                                                                                          \
    fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value)                                           \
    {                                                                                                                  \
        ALLOWED(KEMPE_FMU_ANY);                                                                                        \
        (void)kind, (void)value;                                                                                       \
        return no_status(fmu);                                                                                         \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetStringStatus, fmi2String)

#define STATUS(name, type, what, known)                                                                                \
    fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value)                                           \
    {                                                                                                                  \
        ALLOWED(KEMPE_FMU_ANY);                                                                                        \
        if (kind != (what) || !value)                                                                                  \
            return no_status(fmu);                                                                                     \
        *value = (known);                                                                                              \
        return fmi2OK;                                                                                                 \
    }
STATUS(fmi2GetRealStatus, fmi2Real, fmi2LastSuccessfulTime, fmu->simulator.t)
STATUS(fmi2GetBooleanStatus, fmi2Boolean, fmi2Terminated, fmu->now.ended)
