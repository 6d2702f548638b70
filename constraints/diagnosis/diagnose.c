/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/diagnosis/diagnose.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/massless.h"
#include <kempe/check.h>
#include <string.h>

/* Rank without the rows of drives that move. */
static kempe_status count_driven(kempe_check *check, const kmp_evaluator *eval)
{
    const kempe_system *s = check->system;
    kmp_partition free = {0};
    double *j = KMP_NEW(double, s->jacobian.count);
    kempe_status status = j ? KEMPE_OK : kmp_fail_memory(s->context);
    bool any = false;
    for (int e = 0; j && e < s->jacobian.count; e++) {
        const kmp_closure *closure = &s->model->closures[s->rows[s->jacobian.row[e]].closure];
        bool drives = kmp_closure_is_drive(closure) && closure->function;
        any = any || drives;
        j[e] = drives ? 0 : eval->jacobian[e];
    }
    if (status == KEMPE_OK && any) {
        status = kmp_partition_init(&free, s, j, NULL, 0);
        check->driven = status == KEMPE_OK ? check->part.r - free.r : 0;
        kmp_partition_free(&free);
    }
    kmp_free(j);
    return status;
}

/* Reports undetermined accelerations, with which every run would end. */
static kempe_status foresee(kempe_check *check, kmp_evaluator *eval, const double *q)
{
    kmp_text why = {0};
    kempe_status status = kmp_foresee_massless(eval, &check->part, 0, q, &why);
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
static kempe_status examine(kempe_check *check)
{
    const kempe_system *s = check->system;
    const kempe_assembly *a = check->assembly;
    const double *q = a->inner_q ? a->inner_q : a->q;
    kmp_evaluator *eval = kmp_eval_new(s, "tape");
    if (!eval)
        return kmp_fail_memory(s->context);
    if (a->chart)
        kmp_eval_set_charts(eval, a->chart);
    kmp_eval_closure(eval, 0, q);
    kempe_status status =
        kmp_partition_init(&check->part, s, eval->jacobian, s->model->run.independent, s->model->run.independent_count);
    if (status == KEMPE_OK)
        status = count_driven(check, eval);
    if (status == KEMPE_OK)
        status = foresee(check, eval, q);
    if (status == KEMPE_OK)
        status = kmp_doctor_examine(&check->doctor, eval, q, &check->part, &check->arena);
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

static kempe_status diagnose(kempe_check *check)
{
    kempe_status status = kempe_assembly_new(check->system, &check->assembly);
    check->assembled = check->assembly && check->assembly->closed; /* also with goals that were not reached */
    if (check->assembled)
        return kmp_context_clear(check->system->context), examine(check);
    return status == KEMPE_E_FAILED && check->assembly ? explain(check) : status;
}

kempe_status kempe_check_new(const kempe_system *system, kempe_check **check)
{
    KMP_WANTED(NULL, system, "system");
    KMP_WANTED(system->context, check, "check");
    kmp_context_begin(system->context);
    kempe_check *c = KMP_NEW(kempe_check, 1);
    if (!c)
        return kmp_fail_memory(system->context);
    c->system = system;
    c->body_count = system->model->body_count - 1;
    c->loop_count = system->model->closure_count;
    unsigned long failures = kmp_memory_failures();
    kempe_status status = diagnose(c);
    c->warnings = kmp_context_warnings(system->context);
    if (status == KEMPE_E_FAILED && kmp_memory_failures() != failures)
        status = KEMPE_E_MEMORY; /* the messages of earlier trials are dropped */
    if (status != KEMPE_OK && !(status == KEMPE_E_FAILED && !c->assembled)) {
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
    kmp_arena_free(&check->arena);
    kmp_free(check->warnings);
    kmp_free(check);
}
