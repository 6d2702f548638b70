/* SPDX-License-Identifier: BSD-3-Clause */
/* The command `check` as a sequence: assemble, choose coordinates, find rank and redundant rows, then the parts of an
 * examination, each a function in one list; at last accelerations that a run could not evaluate. Models beyond a size
 * have rank and choice alone. */
#include "constraints/diagnosis/diagnose.h"
#include "base/memory.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/diagnosis/diagnosis_choice.h"
#include "constraints/diagnosis/diagnosis_limits.h"
#include "constraints/diagnosis/diagnosis_open.h"
#include "constraints/diagnosis/diagnosis_rank.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/kinds/kind.h"
#include "constraints/partition/singularity_causes.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include <kempe/check.h>
#include <string.h>

enum { MOST_COORDINATES = 100, MOST_ROWS = 200 };

/* Runs all parts of the examination. */
static kempe_status run_parts(kmp_examination *x, const kmp_evaluator *eval)
{
    void (*const parts[])(kmp_examination *) = {kmp_diagnosis_points,       kmp_diagnosis_dependents,
                                                kmp_diagnosis_second_order, kmp_diagnosis_repairs,
                                                kmp_diagnosis_alternatives, kmp_diagnosis_limits};
    x->walk = kmp_walk_new(x->system);
    KMP_TRY(kmp_made(x->system->context, x->walk));
    kmp_eval_set_charts(x->walk->eval, eval->chart);
    for (int k = 0; k < (int)(sizeof parts / sizeof *parts) && !x->arena->failed; k++)
        parts[k](x);
    kmp_walk_free(x->walk);
    return KEMPE_OK;
}

/* Runs the whole examination. Its cost grows with the cube of the coordinates, so that large models skip it. */
static kempe_status examine_closures(kempe_check *check, kmp_evaluator *eval, const double *q)
{
    const kempe_system *s = check->system;
    kmp_diagnosis *diagnosis = &check->diagnosis;
    kmp_examination x = {.system = s, .q = q, .part = &check->part, .arena = &check->arena, .diagnosis = diagnosis};
    kempe_status status = KEMPE_OK;
    diagnosis->declared = kmp_closure_all_rows(s->model);
    diagnosis->generic_rank = check->part.r;
    diagnosis->margin = 1;
    diagnosis->block_count = kmp_loop_blocks(eval, &check->part, &check->arena, &diagnosis->blocks);
    diagnosis->ran = s->n <= MOST_COORDINATES && s->m <= MOST_ROWS;
    if (!diagnosis->ran) {
        diagnosis->why_not =
            "more than 100 coordinates or 200 rows: only rank, choice of coordinates and blocks were examined";
        diagnosis->limits.why_not = diagnosis->why_not;
    } else if (diagnosis->block_count >= 0) {
        status = run_parts(&x, eval);
    }
    if (diagnosis->block_count < 0 && !check->arena.failed)
        return KEMPE_E_FAILED; /* the reduction has set the message */
    return check->arena.failed ? kmp_fail_memory(s->context) : status;
}

/* Rank without the rows of drives that move. */
static kempe_status count_driven(kempe_check *check, const kmp_evaluator *eval)
{
    const kempe_system *s = check->system;
    kmp_partition free;
    double *j = KMP_ARENA_NEW(&check->arena, double, s->jacobian.count);
    bool any = false;
    for (int e = 0; j && e < s->jacobian.count; e++) {
        const kmp_closure *closure = &s->model->closures[s->rows[s->jacobian.row[e]].closure];
        bool drives = kmp_closure_is_drive(closure) && closure->function;
        any = any || drives;
        j[e] = drives ? 0 : eval->jacobian[e];
    }
    if (!any)
        return j ? KEMPE_OK : kmp_fail_memory(s->context);
    KMP_TRY(kmp_partition_init(&free, s, j, NULL, 0));
    check->driven = check->part.r - free.r;
    kmp_partition_free(&free);
    return KEMPE_OK;
}

/* Appends a sentence about a value of the caller's system at the start that is not finite, with its states and forces.
 */
static kempe_status foresee_values(const kempe_check *check, const double *q, const double *qd, const double *chart,
                                   kmp_text *why)
{
    const kempe_system *s = check->given;
    int own = check->system->n;
    kmp_evaluator *eval = kmp_eval_new(s, "tape");
    double *state = eval ? KMP_ARENA_NEW(&eval->arena, double, 2 * s->n) : NULL;
    for (int k = 0; state && k < s->n; k++) {
        state[k] = k < own ? q[k] : 0;
        state[s->n + k] = k < own ? qd[k] : s->model->start.qd[k].value;
    }
    if (state && chart)
        kmp_eval_set_charts(eval, chart);
    if (state)
        (void)kmp_put_not_finite(eval, 0, state, state + s->n, why);
    kmp_eval_free(eval);
    return state ? KEMPE_OK : kmp_fail_memory(s->context);
}

/* Reports accelerations that are undetermined or not finite, with which every run would end. */
static kempe_status foresee(kempe_check *check, kmp_evaluator *eval, const double *q)
{
    const kempe_assembly *a = check->assembly;
    kmp_text why = {0};
    kempe_status status = kmp_foresee_massless(eval, &check->part, 0, q, &why);
    if (status == KEMPE_OK && !why.s)
        status = foresee_values(check, q, a->inner_q ? a->inner_qd : a->qd, a->chart, &why);
    if (why.s) {
        check->undetermined = kmp_arena_strdup(&check->arena, why.s);
        kmp_log(check->system->context, KEMPE_LOG_WARNING, "%s", why.s);
        status = check->undetermined ? status : kmp_fail_memory(check->system->context);
    }
    kmp_text_free(&why);
    kmp_eval_closure(eval, 0, q);
    return status;
}

/* Computes rank and choice at the assembled configuration, then examines them. */
static kempe_status examine_at(kempe_check *check, kmp_evaluator *eval, const double *q)
{
    const kmp_run_settings *run = &check->system->model->run;
    kmp_eval_closure(eval, 0, q);
    KMP_TRY(kmp_partition_init(&check->part, check->system, eval->jacobian, run->independent, run->independent_count));
    KMP_TRY(kmp_partition_condition(&check->part, check->system, eval->jacobian, &check->condition));
    KMP_TRY(count_driven(check, eval));
    KMP_TRY(foresee(check, eval, q));
    return examine_closures(check, eval, q);
}

static kempe_status examine(kempe_check *check)
{
    const kempe_assembly *a = check->assembly;
    kmp_evaluator *eval = kmp_eval_new(check->system, "tape");
    KMP_TRY(kmp_made(check->system->context, eval));
    if (a->chart)
        kmp_eval_set_charts(eval, a->chart);
    kempe_status status = examine_at(check, eval, a->inner_q ? a->inner_q : a->q);
    kmp_eval_free(eval);
    return status;
}

/* Keeps the message of the assembly; later trial assemblies add their own to the context. */
static kempe_status explain(kempe_check *check)
{
    kempe_context *context = check->system->context;
    check->reason = kmp_arena_strdup(&check->arena, kempe_context_message(context));
    if (!check->reason || kmp_obstacle_find(&check->obstacle, check->assembly, &check->arena) != KEMPE_OK)
        return kmp_fail_memory(context);
    kmp_context_clear(context);
    for (const char *s = check->reason; *s; s += s[0] == '\n') {
        int length = (int)strcspn(s, "\n");
        (void)kmp_fail(context, KEMPE_E_FAILED, "%.*s", length, s);
        s += length;
    }
    return KEMPE_E_FAILED;
}

static kempe_status find_loads(kempe_check *check)
{
    kmp_evaluator *eval = kmp_eval_new_of_closures(check->system);
    kempe_status status = kmp_made(check->system->context, eval);
    if (status == KEMPE_OK)
        status = kmp_find_shared_loads(eval, 0, check->assembly->q, &check->arena, &check->diagnosis.loads);
    kmp_eval_free(eval);
    return status;
}

static kempe_status diagnose(kempe_check *check)
{
    kempe_status status = kempe_assembly_new(check->system, &check->assembly);
    check->assembled = check->assembly && check->assembly->closed; /* also with goals that were not reached */
    if (check->assembled)
        status = (kmp_context_clear(check->system->context), examine(check));
    if (check->assembled)
        return status == KEMPE_OK ? find_loads(check) : status;
    return status == KEMPE_E_FAILED && check->assembly ? explain(check) : status;
}

/* Without the states, on which neither closures nor masses depend, and without forces, which may; and without the rows
 * of friction, the last closures, which are redundant unless a run holds them. */
static kempe_status leave_out_forces(kempe_check *c, const kempe_model *model)
{
    c->mechanism = KMP_NEW(kempe_model, 1);
    KMP_TRY(kmp_made(model->context, c->mechanism));
    *c->mechanism = *model;
    c->mechanism->motion_count = kmp_model_coordinates(model);
    c->mechanism->has_digest = false;
    c->mechanism->state_count = c->mechanism->force_count = c->mechanism->sensor_count = 0;
    c->mechanism->closure_count -= kmp_model_friction_count(model);
    c->mechanism->output_count = c->mechanism->run.until_count = 0;
    KMP_TRY(kmp_system_new(c->mechanism, NULL, &c->own));
    c->system = c->own;
    return KEMPE_OK;
}

kempe_status kmp_check(const kempe_system *system, kempe_check **check)
{
    KMP_MAKE(system->context, kempe_check, c);
    c->given = c->system = system;
    c->body_count = system->model->body_count - 1;
    c->loop_count = system->model->closure_count - kmp_model_friction_count(system->model);
    unsigned long failures = kmp_memory_failures();
    kmp_warn_of_implicit_kinks(system->model);
    bool leaves_out = system->model->state_count > 0 || kmp_model_friction_count(system->model) > 0;
    kempe_status status = leaves_out ? leave_out_forces(c, system->model) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = diagnose(c);
    c->warnings = kmp_context_warnings(system->context);
    if (status == KEMPE_E_FAILED && kmp_memory_failures() != failures)
        status = KEMPE_E_MEMORY; /* the messages of earlier trials are dropped */
    c->status = status = kmp_context_verdict(system->context, status);
    if (!kmp_is_complete(status) && !(status == KEMPE_E_FAILED && !c->assembled)) {
        kempe_check_free(c);
        return status;
    }
    *check = c;
    return status;
}

void kempe_check_free(kempe_check *check)
{
    if (!check)
        return;
    kempe_assembly_free(check->assembly);
    kmp_partition_free(&check->part);
    kempe_system_free(check->own);
    kmp_free(check->mechanism);
    kmp_arena_free(&check->arena);
    kmp_free(check->warnings);
    kmp_free(check);
}
