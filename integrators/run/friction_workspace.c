/* SPDX-License-Identifier: BSD-3-Clause */
/* Workspaces of models with dry friction that sticks, or with rigid contacts. The modes at a state are the modes of a
 * run that starts there. */
#include "constraints/workspace/state_workspace.h"
#include "integrators/run/friction_state.h"
#include "model/data/model.h"
#include "model/data/state.h"
#include <kempe/workspace.h>
#include <string.h>

static kempe_status decide(void *self, double t, const double *q, const double *qd)
{
    return kmp_friction_state_decide(self, t, q, qd);
}

static void let_go(void *self)
{
    kmp_friction_state_free(self);
}

static void release(kmp_evaluator *eval)
{
    kmp_friction_state_release(eval);
    kmp_friction_state_open(eval);
}

/* -- the modes ----------------------------------------------------------------------------------------- */

static const kmp_friction_view *view_of(const kempe_workspace *ws, int k)
{
    const kmp_friction_state *state = ws ? ws->friction.self : NULL;
    return state && k >= 0 && k < state->count ? &state->view[k] : NULL;
}

int kempe_workspace_mode_count(const kempe_workspace *ws)
{
    const kmp_friction_state *state = ws ? ws->friction.self : NULL;
    return state ? state->count : 0;
}

const char *kempe_workspace_mode_name(const kempe_workspace *ws, int k)
{
    const kmp_friction_view *view = view_of(ws, k);
    return view ? view->element->name : NULL;
}

const char *kempe_workspace_mode(const kempe_workspace *ws, int k)
{
    static const char *const friction[] = {[KMP_FRICTION_WORD_SLIPS] = "slips",
                                           [KMP_FRICTION_WORD_STICKS] = "sticks",
                                           [KMP_FRICTION_WORD_SHARES] = "shares",
                                           [KMP_FRICTION_WORD_OPEN] = "undetermined"},
                             *const contact[] = {[KMP_FRICTION_WORD_SLIPS] = "open",
                                                 [KMP_FRICTION_WORD_STICKS] = "closed",
                                                 [KMP_FRICTION_WORD_SHARES] = "shares",
                                                 [KMP_FRICTION_WORD_OPEN] = "shares"};
    const kmp_friction_view *view = view_of(ws, k);
    if (!view || !ws->friction.decided)
        return NULL;
    return view->off ? "open" : (view->contact ? contact : friction)[view->word];
}

/* -- new ----------------------------------------------------------------------------------------------- */

/* A state has no past: the rate of a delayed signal is not the rate in a run. */
static void tell_of_delays(const kempe_system *system)
{
    const kempe_model *model = system->model;
    for (int k = 0; k < kmp_model_state_count(model); k++)
        if (kmp_model_state(model, k)->delayed) {
            kmp_log(system->context, KEMPE_LOG_WARNING,
                    "the state '%s' is a delayed signal, whose past a workspace does not have: qd has its value, and "
                    "its rate differs from a run",
                    kmp_model_state(model, k)->name);
            return;
        }
}

kempe_status kempe_workspace_new(const kempe_system *system, kempe_workspace **workspace)
{
    KMP_WANTED_BOTH(system, workspace);
    KMP_TRY(kmp_workspace_new(system, workspace));
    tell_of_delays(system);
    const kmp_force *force = system->model->forces, *end = force + system->model->force_count;
    while (force < end && !kmp_force_sticks(force))
        force++;
    if (force < end)
        kmp_log(system->context, KEMPE_LOG_WARNING,
                "friction '%s' sticks in runs, but in this workspace it slips and has no force at rest: choose one of "
                "slip, stick and none for the friction of the workspace",
                force->name);
    return KEMPE_OK;
}

kempe_status kempe_workspace_new_with_friction(const kempe_system *system, const char *friction,
                                               kempe_workspace **workspace)
{
    KMP_WANTED_BOTH(system, workspace);
    KMP_WANTED(system->context, friction, "friction");
    kmp_context_clear(system->context);
    bool sticks = strcmp(friction, "stick") == 0, none = strcmp(friction, "none") == 0;
    if (!sticks && !none && strcmp(friction, "slip") != 0)
        return kmp_fail(system->context, KEMPE_E_ARGUMENT,
                        "unknown friction of a workspace '%s'; choose slip, stick or none", friction);
    kempe_workspace *ws = NULL;
    KMP_TRY(kmp_workspace_new(system, &ws));
    tell_of_delays(system);
    ws->eval->conditions.holds_friction = none; /* its inputs are zero */
    kmp_friction_state *state = NULL;
    bool slips = true;
    kempe_status status = sticks ? kmp_friction_state_new(ws->eval, &state, &slips) : KEMPE_OK;
    if (status == KEMPE_OK && !slips) {
        const kmp_workspace_friction modes = {.self = state, .decide = decide, .release = release, .free = let_go};
        status = kmp_workspace_take_friction(ws, modes);
        if (status != KEMPE_OK)
            kmp_friction_state_free(state);
    }
    return KMP_GIVE_OR_FREE(status, workspace, ws, kempe_workspace_free);
}
