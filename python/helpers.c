/* SPDX-License-Identifier: BSD-3-Clause */
/* A guard installs a handler of SIGINT that calls the handler before it, Python's, and then interrupts the context. So
 * a long computation ends at its next step, and KeyboardInterrupt is raised as soon as the interpreter continues. The
 * order matters: the handler may run in another thread, and Python must know of the signal before the computation ends.
 * No Python code runs between installing and restoring except of callbacks. On Windows, guards do nothing. */
#include "helpers.h"
#include "base/context.h"
#include "base/json.h"
#include "constraints/workspace/state_workspace.h"
#include "ensemble/manifest.h"
#include "model/data/model.h"
#include "model/data/start.h"
#include "model/files/yaml.h"
#include "model/write/model_print.h"
#include "platform/platform.h"
#include <math.h>
#include <stdatomic.h>
#include <string.h>

static kempe_context *volatile guarded;

static void interrupt(void)
{
    kempe_context_interrupt(guarded);
}

void python_guard_begin(python_guard *guard, kempe_context *context)
{
    *guard = (python_guard){context, guarded};
    if (!context)
        return;
    guarded = context;
    if (!guard->outer)
        kmp_interrupt_guard(interrupt);
}

kempe_status python_guard_end(python_guard *guard, kempe_status status)
{
    if (!guard->context)
        return status;
    guarded = guard->outer;
    if (!guard->outer)
        kmp_interrupt_guard_end();
    kempe_context_clear_interrupt(guard->context);
    return status;
}

void python_log(void *user, kempe_level level, const char *line); /* Python's */
static atomic_int notes_wanted;

static void pass_on(void *user, kempe_level level, const char *line)
{
    if (level != KEMPE_LOG_INFO || atomic_load_explicit(&notes_wanted, memory_order_relaxed))
        python_log(user, level, line);
}

void python_listen(kempe_context *context, void *user)
{
    kempe_context_set_log(context, pass_on, user);
}

void python_want_notes(int wanted)
{
    atomic_store_explicit(&notes_wanted, wanted, memory_order_relaxed);
}

static void copy(double *to, int width, int row, const double *from)
{
    if (to && width > 0)
        memcpy(to + (size_t)row * (size_t)width, from, (size_t)width * sizeof *to);
}

static const double *row_of(const double *rows, int width, int row)
{
    return rows ? rows + (size_t)row * (size_t)width : NULL;
}

static kempe_status failed_at(python_states *s, int row, kempe_status status)
{
    s->failed = status == KEMPE_OK ? -1 : row;
    return status;
}

kempe_status python_evaluate_states(kempe_workspace *w, python_states *s)
{
    const kempe_workspace_rows rows = {s->mass, s->bias, s->h, s->jacobian, s->jdqd};
    python_guard guard;
    python_guard_begin(&guard, s->guarded);
    return python_guard_end(
        &guard, kempe_workspace_evaluate_states(w, s->count, s->t, s->t_step, s->q, s->qd, &rows, &s->failed));
}

kempe_status python_evaluate_each(kempe_workspace *w, python_states *s)
{
    kempe_status status = KEMPE_OK;
    int k = 0;
    for (; k < s->count && status == KEMPE_OK; k++) {
        status = kempe_workspace_evaluate(w, s->t[k * s->t_step], row_of(s->q, s->n, k), row_of(s->qd, s->n, k));
        if (status != KEMPE_OK)
            break;
        copy(s->mass, s->n * s->n, k, kempe_workspace_mass(w));
        copy(s->bias, s->n, k, kempe_workspace_bias(w));
        copy(s->h, s->m, k, kempe_workspace_h(w));
        copy(s->jacobian, s->m * s->n, k, kempe_workspace_jacobian(w));
        copy(s->jdqd, s->m, k, kempe_workspace_jdqd(w));
    }
    return failed_at(s, k, status);
}

kempe_status python_forward_states(kempe_workspace *w, python_states *s)
{
    python_guard guard;
    python_guard_begin(&guard, s->guarded);
    return python_guard_end(&guard, kempe_workspace_forward_states(w, s->count, s->t, s->t_step, s->q, s->qd, s->Q,
                                                                   s->accelerations, s->multipliers, &s->failed));
}

kempe_status python_derivative_states(kempe_workspace *w, python_states *s)
{
    const kempe_workspace_derivatives rows = {s->qdd_q,    s->qdd_qd, s->qdd_Q, s->lambda_q, s->lambda_qd, s->lambda_Q,
                                              s->udd_u,    s->udd_ud, s->udd_Q, s->q_u,      s->qd_u,      s->qdd_p,
                                              s->lambda_p, s->udd_p,  s->q_p,   s->qd_p,     s->y,         s->y_q,
                                              s->y_qd,     s->y_Q,    s->y_p,   s->y_u,      s->y_ud,      s->y_up};
    python_guard guard;
    python_guard_begin(&guard, s->guarded);
    return python_guard_end(&guard,
                            kempe_workspace_derivative_states(w, s->count, s->t, s->t_step, s->q, s->qd, s->Q,
                                                              s->accelerations, s->multipliers, &rows, &s->failed));
}

kempe_status python_hessian_states(kempe_workspace *w, python_states *s)
{
    /* The calls only read weights. */
    const kempe_forward_values weights = {(double *)s->by_qdd, (double *)s->by_lambda, (double *)s->by_y,
                                          (double *)s->by_q, (double *)s->by_qd};
    python_guard guard;
    python_guard_begin(&guard, s->guarded);
    return python_guard_end(&guard,
                            kempe_workspace_hessian_states(w, s->count, s->t, s->t_step, s->q, s->qd, s->Q, &weights,
                                                           s->direction_count, s->directions, s->hessians, &s->failed));
}

kempe_status python_determinant_states(kempe_workspace *w, python_states *s)
{
    python_guard guard;
    python_guard_begin(&guard, s->guarded);
    return python_guard_end(&guard, kempe_workspace_determinant_states(w, s->count, s->t, s->t_step, s->q, s->logarithm,
                                                                       s->by_u, s->by_uu, &s->failed));
}

kempe_status python_forward_each(kempe_workspace *w, python_states *s)
{
    kempe_status status = KEMPE_OK;
    int k = 0;
    for (; k < s->count && status == KEMPE_OK; k++)
        status = kempe_workspace_forward_dynamics(w, s->t[k * s->t_step], row_of(s->q, s->n, k), row_of(s->qd, s->n, k),
                                                  row_of(s->Q, s->n, k), s->accelerations + (size_t)k * (size_t)s->n,
                                                  s->multipliers ? s->multipliers + (size_t)k * (size_t)s->m : NULL);
    return failed_at(s, k - 1, status);
}

kempe_status python_inverse_states(kempe_workspace *w, python_states *s)
{
    kempe_status status = KEMPE_OK;
    int k = 0;
    python_guard guard;
    python_guard_begin(&guard, s->guarded);
    const bool ended = kmp_interrupt_taken(w->system->context);
    for (; k < s->count && status == KEMPE_OK; k++)
        status = kmp_workspace_interrupted(w, ended, k, s->count, "states")
                     ? KEMPE_STOPPED
                     : kempe_workspace_inverse_dynamics(w, s->t[k * s->t_step], row_of(s->q, s->n, k),
                                                        row_of(s->qd, s->n, k), row_of(s->qdd, s->n, k),
                                                        s->forces + (size_t)k * (size_t)s->n);
    return python_guard_end(&guard, failed_at(s, k - 1, status));
}

kempe_status python_model_hash(const kempe_model *model, char *hash)
{
    return kmp_manifest_hash_model(model, hash);
}

/* Moves stepper k, and reads its outputs where it is then: where a failing advance has left it, too. */
static kempe_status advance_one(const python_steppers *s, int k)
{
    kempe_stepper *stepper = s->steppers[k];
    kempe_status status = KEMPE_OK;
    for (int j = 0; j < s->input_count && s->actions && status == KEMPE_OK; j++)
        status =
            kempe_stepper_set_input(stepper, s->inputs[j], s->actions[(size_t)k * (size_t)s->input_count + (size_t)j]);
    if (status == KEMPE_OK)
        status = kempe_stepper_advance(stepper, s->t[k]);
    const kempe_status read =
        kempe_outputs_at_stepper(s->outputs, stepper, s->values + (size_t)k * (size_t)s->value_count);
    return status == KEMPE_OK ? read : status;
}

kempe_status python_advance_steppers(const python_steppers *s)
{
    kempe_status status = KEMPE_OK;
    python_guard guard;
    python_guard_begin(&guard, s->guarded);
    for (int k = 0; k < s->count && status == KEMPE_OK; k++) {
        s->statuses[k] = isnan(s->t[k]) ? KEMPE_OK : advance_one(s, k);
        const bool mistake = s->statuses[k] < 0 && s->statuses[k] != KEMPE_E_FAILED;
        if (mistake || (s->statuses[k] == KEMPE_STOPPED && kmp_interrupt_taken(s->context)))
            status = (kempe_status)s->statuses[k];
    }
    return python_guard_end(&guard, status);
}

static void put_node(kmp_json *json, const char *key, const kmp_yaml *node)
{
    if (node->kind == KMP_YAML_SCALAR) {
        kmp_json_string(json, key, node->empty ? NULL : node->text);
        return;
    }
    const bool list = node->kind == KMP_YAML_LIST;
    (list ? kmp_json_array : kmp_json_object)(json, key);
    for (int k = 0; k < node->count; k++)
        put_node(json, list ? NULL : node->keys[k]->text, node->items[k]);
    kmp_json_end(json);
}

/* Values of the coordinates that have one. */
static void put_given(kmp_json *json, const char *key, const kempe_model *model, const kmp_number *values,
                      const bool *given)
{
    kmp_json_object(json, key);
    for (int k = 0; k < kmp_model_coordinates(model); k++)
        if (given[k])
            kmp_json_number(json, model->motions[k].name, values[k].value);
    kmp_json_end(json);
}

kempe_status python_start(const kempe_model *model, char **json)
{
    const kmp_start *start = &model->start;
    kmp_text out = {0};
    kmp_json writer = kmp_json_begin(&out);
    kmp_json_object(&writer, NULL);
    put_given(&writer, "q", model, start->q, start->q_given);
    put_given(&writer, "qd", model, start->qd, start->qd_given);
    kmp_json_array(&writer, "hold");
    for (int k = 0; k < kmp_model_coordinates(model); k++)
        if (start->hold[k] && !(start->undeformed && start->undeformed[k]))
            kmp_json_string(&writer, NULL, model->motions[k].name);
    kmp_json_end(&writer);
    kmp_json_array(&writer, "goals");
    for (int k = 0; k < start->goal_count; k++) {
        kmp_text name = {0};
        kmp_model_put_goal(&name, model, &start->goals[k]);
        kmp_json_text(&writer, NULL, &name);
    }
    kmp_json_end(&writer);
    kmp_json_boolean(&writer, "statics", start->statics);
    kmp_json_string(&writer, "at", start->at ? start->at : "start");
    kmp_json_object(&writer, "states");
    for (int k = 0; k < model->state_count; k++)
        kmp_json_number(&writer, model->states[k].name, model->states[k].start.value);
    kmp_json_end(&writer);
    kmp_json_end(&writer);
    *json = kmp_text_take(&out);
    kmp_text_free(&out);
    return kmp_made(model->context, *json);
}

kempe_status python_document(kempe_context *context, const char *text, const char *label, char **json)
{
    kmp_arena arena = {0};
    kmp_text out = {0};
    const kmp_yaml *root = NULL;
    kempe_status status = kmp_yaml_load(context, &arena, label, 0, text, strlen(text), &root);
    if (status == KEMPE_OK && root) {
        kmp_json writer = kmp_json_begin(&out);
        put_node(&writer, NULL, root);
        *json = kmp_text_take(&out);
        status = kmp_made(context, *json);
    }
    kmp_text_free(&out);
    kmp_arena_free(&arena);
    return status;
}
