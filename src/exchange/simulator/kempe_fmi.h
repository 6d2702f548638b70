/* SPDX-License-Identifier: BSD-3-Clause */
/* Functions that both versions of the FMI have alike: a part of kempe_fmi2.c and of kempe_fmi3.c, which define before
 *
 *     FMI(name), FMI_OF_STATE(verb, end)    a name of the version: fmi2Reset, fmi2GetFMUstate
 *     fmi_instance, fmi_state               its types
 *     unit                                  an instance; its numbers follow in the same memory
 *     take, give_back, report               its memory and its messages
 *     FMI_MORE, FMI_CHECK_MORE              what a function of values has after them: in version 3 their number
 */
#ifndef KEMPE_FMI_H
#define KEMPE_FMI_H

#include "kempe_fmu.h"
#include <string.h>

typedef FMI(Status) fmi_status;
typedef FMI(Boolean) fmi_boolean;
typedef FMI(String) fmi_string;
typedef FMI(Byte) fmi_byte;

#define SOME const FMI(ValueReference) references[], size_t count

#define ALLOWED(modes)                                                                                                 \
    kempe_fmu *fmu = c;                                                                                                \
    if (!kempe_fmu_allows(fmu, modes, __func__))                                                                       \
    return FMI(Error)
#define ANSWER(call) return (fmi_status)(call)
#define FAIL(...)    ANSWER(kempe_fmu_say(fmu, KEMPE_FMU_ERROR, KEMPE_FMU_LOG_ERROR, __VA_ARGS__))
#define SAME_KIND(wanted)                                                                                              \
    if (fmu->kind != (wanted))                                                                                         \
    FAIL("%s belongs to the other kind of unit than this instance.", __func__)
#define TEXT_OF(name)  #name
#define AS_TEXT(macro) TEXT_OF(macro)

enum {
    BEFORE_RUN = KEMPE_FMU_INSTANTIATED | KEMPE_FMU_INITIALIZATION,
    STANDING = KEMPE_FMU_ANY & ~KEMPE_FMU_INTERMEDIATE
};

/* -- instances --------------------------------------------------------------------------------------- */

static void send(kempe_fmu *fmu, kempe_fmu_status status, const char *category, const char *sentence)
{
    report((const unit *)(const void *)fmu, (fmi_status)status, category, sentence);
}

/* An instance like `asked`, with room for `more` bytes behind its numbers. NULL: there is none, and the reason is
 * reported. */
static unit *instantiate(const unit *asked, int kind, fmi_string name, fmi_string token, fmi_string resources,
                         fmi_boolean logs, size_t more)
{
    char sentence[KEMPE_FMU_SENTENCE];
    const kempe_fmu_model *model = kempe_fmu_open(name, token, kind, resources, sentence);
    unit *instance =
        model ? take(asked, sizeof *instance + (size_t)kempe_fmu_memory(model) * sizeof(double) + more) : NULL;
    if (!instance) {
        kempe_fmu_close(model);
        report(asked, FMI(Error), kempe_fmu_categories[KEMPE_FMU_LOG_ERROR],
               model ? "There is no memory for the instance." : sentence);
        return NULL;
    }
    *instance = *asked;
    instance->fmu.log = send;
    kempe_fmu_init(&instance->fmu, model, kind, (double *)(void *)(instance + 1));
    (void)kempe_fmu_choose_categories(&instance->fmu, logs, 0, NULL);
    return instance;
}

void FMI(FreeInstance)(fmi_instance c)
{
    unit *instance = c;
    if (instance) {
        kempe_fmu_close(instance->fmu.model);
        give_back(instance, instance);
    }
}

/* -- modes ------------------------------------------------------------------------------------------- */

fmi_status FMI(SetDebugLogging)(fmi_instance c, fmi_boolean on, size_t count, const fmi_string categories[])
{
    ALLOWED(KEMPE_FMU_ANY);
    ANSWER(kempe_fmu_choose_categories(fmu, on, count, categories));
}

fmi_status FMI(Terminate)(fmi_instance c)
{
    ALLOWED(KEMPE_FMU_RUNS);
    fmu->now.mode = KEMPE_FMU_TERMINATED;
    return FMI(OK);
}

fmi_status FMI(Reset)(fmi_instance c)
{
    ALLOWED(KEMPE_FMU_ANY);
    kempe_fmu_reset(fmu);
    return FMI(OK);
}

/* -- variables --------------------------------------------------------------------------------------- */

#define VALUES(name, type, modes, call)                                                                                \
    fmi_status name(fmi_instance c, SOME, type values[] FMI_MORE)                                                      \
    {                                                                                                                  \
        ALLOWED(modes);                                                                                                \
        FMI_CHECK_MORE;                                                                                                \
        ANSWER(call(fmu, references, count, values));                                                                  \
    }

/* -- states of the unit ------------------------------------------------------------------------------ */

static int make_room(kempe_fmu *fmu, fmi_state *state)
{
    if (state && !*state)
        *state = take((const unit *)(const void *)fmu, kempe_fmu_state_bytes(fmu));
    return state && *state;
}

fmi_status FMI_OF_STATE(Get, )(fmi_instance c, fmi_state *state)
{
    ALLOWED(STANDING);
    if (kempe_fmu_saves_states(fmu) != KEMPE_FMU_OK)
        return FMI(Error);
    if (!make_room(fmu, state))
        FAIL("There is no memory for the state.");
    kempe_fmu_save(fmu, *state);
    return FMI(OK);
}

fmi_status FMI_OF_STATE(Set, )(fmi_instance c, fmi_state state)
{
    ALLOWED(STANDING);
    if (!state)
        FAIL("The state is NULL.");
    ANSWER(kempe_fmu_restore(fmu, state));
}

fmi_status FMI_OF_STATE(Free, )(fmi_instance c, fmi_state *state)
{
    ALLOWED(KEMPE_FMU_ANY);
    if (state && *state) {
        give_back(c, *state);
        *state = NULL;
    }
    return FMI(OK);
}

fmi_status FMI_OF_STATE(Serialized, Size)(fmi_instance c, fmi_state state, size_t *size)
{
    ALLOWED(KEMPE_FMU_ANY);
    if (!state || !size)
        FAIL("The state is NULL.");
    *size = kempe_fmu_state_bytes(fmu);
    return FMI(OK);
}

fmi_status FMI_OF_STATE(Serialize, )(fmi_instance c, fmi_state state, fmi_byte bytes[], size_t size)
{
    ALLOWED(KEMPE_FMU_ANY);
    if (!state || !bytes || size < kempe_fmu_state_bytes(fmu))
        FAIL("The room for the bytes of the state is too small: %s gives their number.",
             AS_TEXT(FMI_OF_STATE(Serialized, Size)));
    memcpy(bytes, state, kempe_fmu_state_bytes(fmu));
    return FMI(OK);
}

fmi_status FMI_DESERIALIZE(fmi_instance c, const fmi_byte bytes[], size_t size, fmi_state *state)
{
    ALLOWED(KEMPE_FMU_ANY);
    kempe_fmu_status status = kempe_fmu_check_state(fmu, (const unsigned char *)bytes, size);
    if (status != KEMPE_FMU_OK)
        ANSWER(status);
    if (!make_room(fmu, state))
        FAIL("There is no memory for the state.");
    memcpy(*state, bytes, size);
    return FMI(OK);
}

/* -- model exchange ---------------------------------------------------------------------------------- */

fmi_status FMI(EnterContinuousTimeMode)(fmi_instance c)
{
    ALLOWED(KEMPE_FMU_EVENT);
    SAME_KIND(KEMPE_FMU_MODEL_EXCHANGE);
    fmu->now.mode = KEMPE_FMU_CONTINUOUS;
    return FMI(OK);
}

fmi_status FMI(CompletedIntegratorStep)(fmi_instance c, fmi_boolean no_return, fmi_boolean *event,
                                        fmi_boolean *terminate)
{
    ALLOWED(KEMPE_FMU_CONTINUOUS);
    int wants_event = 0, ended = 0;
    (void)no_return;
    if (!event || !terminate)
        FAIL("A place for the results of the step is NULL.");
    kempe_fmu_status status = kempe_fmu_completed_step(fmu, &wants_event, &ended);
    *event = wants_event;
    *terminate = ended;
    ANSWER(status);
}

fmi_status FMI(SetTime)(fmi_instance c, double t)
{
    ALLOWED(KEMPE_FMU_EVENT | KEMPE_FMU_CONTINUOUS);
    SAME_KIND(KEMPE_FMU_MODEL_EXCHANGE);
    ANSWER(kempe_fmu_set_time(fmu, t));
}

fmi_status FMI(SetContinuousStates)(fmi_instance c, const double x[], size_t count)
{
    ALLOWED(KEMPE_FMU_CONTINUOUS | KEMPE_FMU_EVENT);
    SAME_KIND(KEMPE_FMU_MODEL_EXCHANGE);
    ANSWER(kempe_fmu_set_states(fmu, x, count));
}

/* Arrays of the model that are read; of model exchange. */
#define ARRAY(name, call)                                                                                              \
    fmi_status name(fmi_instance c, double values[], size_t count)                                                     \
    {                                                                                                                  \
        ALLOWED(KEMPE_FMU_INITIALIZATION | KEMPE_FMU_EVENT | KEMPE_FMU_CONTINUOUS | KEMPE_FMU_TERMINATED);             \
        SAME_KIND(KEMPE_FMU_MODEL_EXCHANGE);                                                                           \
        ANSWER(call(fmu, values, count));                                                                              \
    }
ARRAY(FMI_DERIVATIVES, kempe_fmu_get_rates)
ARRAY(FMI(GetEventIndicators), kempe_fmu_get_indicators)
ARRAY(FMI(GetContinuousStates), kempe_fmu_get_states)
ARRAY(FMI(GetNominalsOfContinuousStates), kempe_fmu_get_nominals)

#endif
