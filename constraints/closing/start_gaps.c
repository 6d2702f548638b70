/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/closing/start_gaps.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/language/expression_value.h"
#include <math.h>
#include <string.h>

/* A measure that is zero, or a length, at the start as it is written. */
static bool counts_from_start(const kmp_expr *e, const void *user)
{
    const kempe_model *model = user;
    const bool length = e->measure && e->measure->kind == KMP_MEASURE_FREE_LENGTH;
    return (length && !model->ropes[e->measure->argument[0].closure].length) ||
           (e->measure && e->measure->kind == KMP_MEASURE_TRANSMISSION_ERROR);
}

/* The condition whose value is the gap of a contact; -1: it has none. */
static int gap_of(const kempe_system *s, const kmp_force *force)
{
    const kmp_expr *gap = force->touch.gap;
    if (!gap || !kmp_expr_find(gap, counts_from_start, s->model))
        return -1;
    return kmp_events_find(&s->events, force, force->kind == KMP_FORCE_TOUCH ? (int)KMP_ROLE_PLACE : (int)KMP_PRESSING);
}

/* The start as it is written, where drives have theirs. */
static void write_start(const kempe_system *s, const double *q, double *written)
{
    const kempe_model *model = s->model;
    for (int k = 0; k < s->n; k++)
        written[k] = model->start.q[k].value;
    for (int c = 0; c < model->closure_count; c++)
        if (model->closures[c].kind == KMP_CLOSURE_drive)
            written[model->closures[c].motion] = q[model->closures[c].motion];
}

bool kmp_has_start_gaps(const kempe_system *s)
{
    bool any = false;
    for (int k = 0; k < s->model->force_count && !any; k++)
        any = gap_of(s, &s->model->forces[k]) >= 0;
    return any;
}

int kmp_count_start_gaps(kmp_evaluator *eval, const double *q, kmp_text *text)
{
    const kempe_system *s = eval->system;
    const size_t size = (size_t)s->events.count * sizeof(double);
    double *written = KMP_NEW(double, s->n), *rest = KMP_NEW(double, s->n), *gap = KMP_NEW(double, s->events.count);
    int count = written && rest && gap ? 0 : -1;
    const double *closed = NULL;
    if (count == 0) {
        write_start(s, q, written);
        memcpy(gap, kmp_eval_changes(eval, 0, written, rest), size);
        closed = kmp_eval_changes(eval, 0, q, rest);
    }
    for (int k = 0; closed && k < s->model->force_count; k++) {
        const int c = gap_of(s, &s->model->forces[k]);
        if (c < 0 || !(fabs(closed[c] - gap[c]) > KMP_START_CLOSED * s->length))
            continue;
        count++;
        if (text)
            kmp_text_printf(text,
                            "start: '%s' counts from the start as it is written, and closing the loops changes its "
                            "gap by %.4g m: write the closed start ('kempe assemble' has it)\n",
                            s->model->forces[k].name, closed[c] - gap[c]);
    }
    kmp_free(written);
    kmp_free(rest);
    kmp_free(gap);
    return count;
}

bool kmp_put_start_gaps(kmp_text *text, const kempe_system *s, const double *q)
{
    if (!kmp_has_start_gaps(s))
        return true;
    kmp_evaluator *eval = kmp_eval_new_for(s, "tape", NULL, KMP_EVAL_WEIGHS);
    const bool known = eval && kmp_count_start_gaps(eval, q, text) >= 0;
    kmp_eval_free(eval);
    return known;
}
