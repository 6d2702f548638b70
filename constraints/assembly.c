/* SPDX-License-Identifier: BSD-3-Clause */
/* What an assembly is to its caller: made, told about where it stays open, freed. */
#include "base/memory.h"
#include "constraints/assemble.h"
#include "constraints/tolerances.h"
#include "model/model_print.h"
#include <math.h>
#include <string.h>

enum { PUSHES = 4, MOST_NAMED = 5 };

static void put_open(kmp_text *text, const char *before, const char *name, double gap)
{
    kmp_text_printf(text, "%s'%s'", before, name);
    if (isfinite(gap))
        kmp_text_printf(text, " (%.3g m)", gap);
}

static kempe_status complain_open(const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    kmp_text held = {0}, others = {0}, best = {0};
    for (int k = 0; k < model->motion_count; k++)
        if (model->start.hold[k])
            kmp_text_printf(&held, "%s%s", held.length ? ", " : " while holding ", model->motions[k].name);
    for (int k = 1; k < a->culprit_count && k <= MOST_NAMED; k++)
        put_open(&others, k > 1 ? ", " : "; also open: ", model->closures[a->culprits[k]].name,
                 a->gaps[a->culprits[k]]);
    if (a->culprit_count > MOST_NAMED + 1)
        kmp_text_printf(&others, " and %d more", a->culprit_count - MOST_NAMED - 1);
    const kmp_closure *worst = &model->closures[a->culprits[0]];
    double gap = a->gaps[a->culprits[0]];
    if (isfinite(gap))
        kmp_text_printf(&best, "at best a gap of %.4g m remains%s; check its lengths, or start", gap,
                        others.s ? others.s : "");
    else
        kmp_text_put(&best, "its gap is not a number there; start");
    (void)kmp_complain(a->system->context, model->files[worst->place.file], worst->place.line, worst->place.column,
                       "loop '%s' cannot be closed%s: %s from a better guess", worst->name, held.s ? held.s : "",
                       best.s ? best.s : "");
    kmp_text_free(&best);
    kmp_text_free(&held);
    kmp_text_free(&others);
    return KEMPE_E_FAILED;
}

/* The goal that is farthest, by its part of the distance. */
static kempe_status complain_goals(const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    const kmp_goal *worst = NULL;
    double most = -1, off = 0;
    for (int k = 0, at = 0; k < model->start.goal_count; k++) {
        const kmp_goal *goal = &model->start.goals[k];
        double scale = goal->motion >= 0 ? a->system->scale[goal->motion] : a->system->length, sum = 0, part = 0;
        for (int i = 0; i < goal->width; i++, at++) {
            double left = a->goals.value[at] - goal->value[i].value;
            sum = hypot(sum, left);
            part = hypot(part, sqrt(goal->weight[i].value) * left / scale);
        }
        if (part > most) {
            most = part;
            worst = goal;
            off = sum;
        }
    }
    kmp_text name = {0};
    kmp_model_put_goal(&name, model, worst);
    (void)kmp_fail(a->system->context, KEMPE_E_FAILED,
                   "the loops are closed, but no nearest position to the goals is found: the way there ends after %d "
                   "steps, where the closures lose rank (slope %.2g); '%s' stays off by %.4g; start from another guess",
                   a->goals.steps, a->goals.slope, name.s ? name.s : "", off);
    kmp_text_free(&name);
    return KEMPE_E_FAILED;
}

kempe_assembly *kmp_assembly_new(const kempe_system *s)
{
    int closures = s->model->closure_count;
    kempe_assembly *a = KMP_NEW(kempe_assembly, 1);
    if (!a)
        return NULL;
    a->system = s;
    a->q = KMP_NEW(double, s->n);
    a->qd = KMP_NEW(double, s->n);
    a->moved = KMP_NEW(double, s->n);
    a->gaps = KMP_NEW(double, closures);
    a->culprits = KMP_NEW(int, closures);
    if (a->q && a->qd && a->moved && a->gaps && a->culprits && kmp_goals_init(&a->goals, s->model))
        return a;
    kempe_assembly_free(a);
    return NULL;
}

bool kmp_assembly_changed_rate(const kempe_assembly *a, int k)
{
    const kmp_start *start = &a->system->model->start;
    double given = start->qd[k].value, size = 0;
    for (int i = 0; i < a->system->n; i++)
        size = fmax(size, fabs(start->qd[i].value) / a->system->scale[i]);
    return a->rates_changed && start->qd_given[k] &&
           fabs(a->qd[k] - given) > KMP_CLOSED_RATES * size * a->system->scale[k];
}

void kmp_assembly_put_rates(kmp_text *text, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    for (int k = 0; k < a->system->n; k++)
        if (kmp_assembly_changed_rate(a, k))
            kmp_text_printf(
                text,
                "start: the rate of '%s' becomes %.6g %s, not the given %.6g: the given rates contradict the "
                "closures\n",
                model->motions[k].name, a->qd[k], model->motions[k].rotation ? "rad/s" : "m/s",
                model->start.qd[k].value);
}

/* Whatever is computed from this start says so. */
static kempe_status warn_of_rates(const kempe_assembly *a)
{
    kmp_text lines = {0};
    kmp_assembly_put_rates(&lines, a);
    for (const char *at = lines.s ? lines.s : ""; *at; at += strcspn(at, "\n") + 1)
        kmp_log(a->system->context, KEMPE_LOG_WARNING, "%.*s", (int)strcspn(at, "\n"), at);
    kempe_status status = lines.failed ? kmp_fail_memory(a->system->context) : KEMPE_OK;
    kmp_text_free(&lines);
    return status;
}

kempe_status kempe_assemble(const kempe_system *system, kempe_assembly **assembly)
{
    KMP_WANTED(NULL, system, "system");
    KMP_WANTED(system->context, assembly, "assembly");
    const kmp_start *start = &system->model->start;
    kempe_assembly *a = NULL;
    kmp_context_clear(system->context);
    double *q = KMP_NEW(double, system->n);
    for (int k = 0; q && k < system->n; k++)
        q[k] = start->q[k].value;
    kmp_guess guess = {q, start->hold, PUSHES, true};
    kempe_status status = q ? kmp_assemble_from(system, &guess, &a) : kmp_fail_memory(system->context);
    kmp_free(q);
    if (!a)
        return status;
    *assembly = a;
    if (!a->closed)
        return complain_open(a);
    status = warn_of_rates(a);
    if (status != KEMPE_OK)
        return status;
    return a->goals.end == KMP_GOALS_SINGULAR ? complain_goals(a) : KEMPE_OK;
}

void kempe_assembly_free(kempe_assembly *a)
{
    if (!a)
        return;
    kmp_free(a->q);
    kmp_free(a->qd);
    kmp_free(a->moved);
    kmp_free(a->inner_q);
    kmp_free(a->inner_qd);
    kmp_free(a->chart);
    kmp_free(a->gaps);
    kmp_free(a->culprits);
    kmp_goals_free(&a->goals);
    kmp_free(a);
}

const double *kempe_assembly_q(const kempe_assembly *assembly)
{
    KMP_GIVEN(assembly, NULL);
    return assembly->q;
}

const double *kempe_assembly_qd(const kempe_assembly *assembly)
{
    KMP_GIVEN(assembly, NULL);
    return assembly->qd;
}
