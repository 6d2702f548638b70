/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/parts/unsupported.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

kempe_status kmp_refuse_samples(const kempe_model *model, const char *what, bool held)
{
    for (int k = 0; k < model->state_count; k++) {
        const kmp_state *state = &model->states[k];
        if (!state->next || (held && isinf(state->period)))
            continue;
        if (isinf(state->period))
            return kmp_fail(
                model->context, KEMPE_E_ARGUMENT,
                "%s: the state '%s' changes at events, which is not supported there; write its value in the "
                "expressions that have it",
                what, state->name);
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "%s: the state '%s' is sampled, which is not supported there; give it a "
                        "rate, or write its value in the expressions that have it",
                        what, state->name);
    }
    return KEMPE_OK;
}

kempe_status kmp_refuse_load_dependent(const kempe_system *s, const char *what)
{
    if (s->load_row_count == 0)
        return KEMPE_OK;
    const char *force = kmp_load_dependent_force(s, s->load_rows[0]);
    return kmp_fail(
        s->context, KEMPE_E_ARGUMENT,
        "%s: force '%s' depends on the multiplier of constraint equation '%s', which is not supported there; %s", what,
        force, s->row_names[s->load_rows[0]],
        kmp_name_find(KMP_NAMED(s->model, wheel), force) >= 0 ? "use elastic contact" : "give it a law without lambda");
}

kempe_status kmp_refuse_friction(const kempe_model *model, const char *what)
{
    for (int k = 0; k < model->force_count; k++)
        if (kmp_force_sticks(&model->forces[k]))
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "%s: friction '%s' changes between stick and slip, which is not supported there; give it a "
                            "'speed' to regularise it",
                            what, model->forces[k].name);
    return KEMPE_OK;
}
