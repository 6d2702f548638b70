/* SPDX-License-Identifier: BSD-3-Clause */
/* Search of events in a step. A part of kempe_simulator.c. */
#ifndef SIMULATOR_EVENTS_H
#define SIMULATOR_EVENTS_H

#include "generate/runtime/simulator_dense.h"

/* The values of conditions at part x of the last step by polynomials through both ends with their accelerations: a few
 * roundings of a step's error away, without evaluations. */
static void estimate_changes(kempe_simulator *s, double x, double *value)
{
    struct kempe_simulator_parts *part = &s->part;
    int n = s->equations->coordinates, m = s->equations->rows;
    const double *begin = part->begin, *end = part->end;
    double h = part->state[AT_TAKEN];
    for (int i = 0; i < n; i++) {
        double p0 = begin[i], p1 = h * begin[n + i], p2 = 0.5 * h * h * begin[2 * n + i];
        double a = end[i] - p0 - p1 - p2, b = h * end[n + i] - p1 - 2 * p2, c = 0.5 * (h * h * end[2 * n + i] - 2 * p2);
        double p3 = 10 * a - 4 * b + c, p4 = -15 * a + 7 * b - 2 * c, p5 = 6 * a - 3 * b + c;
        part->q[i] = p0 + x * (p1 + x * (p2 + x * (p3 + x * (p4 + x * p5))));
        part->qd[i] = (p1 + x * (2 * p2 + x * (3 * p3 + x * (4 * p4 + x * 5 * p5)))) / h;
        part->qdd[i] = (2 * p2 + x * (6 * p3 + x * (12 * p4 + x * 20 * p5))) / (h * h);
    }
    for (int i = 0; i < m; i++)
        part->lambda[i] = begin[3 * n + i] + x * (end[3 * n + i] - begin[3 * n + i]);
    evaluate_changes(s, part->state[AT_BEGIN] + x * h, value);
}

/* The values of conditions at t within the last step, which is placed. */
static outcome look_at(kempe_simulator *s, double t, double *value)
{
    struct kempe_simulator_parts *part = &s->part;
    outcome said = interpolate(s, t, part->probe);
    if (said != GOOD)
        return said;
    place_y(s, part->probe);
    said = close_loops(s, t, NULL);
    if (said != GOOD)
        return said;
    evaluate_rates(s);
    if (!s->equations->early) {
        said = accelerate(s, t);
        if (said != GOOD)
            return said;
        complete(s);
    }
    evaluate_changes(s, t, value);
    return GOOD;
}

typedef struct glance {
    kempe_simulator *s;
    int condition;
} glance;

static double estimated_distance(void *self, double x)
{
    const glance *g = self;
    double *value = g->s->part.changes + (ptrdiff_t)(SAMPLES + 1) * g->s->equations->conditions;
    estimate_changes(g->s, x, value);
    return -beyond(g->s, g->condition, value[g->condition]);
}

/* A part of the step within a sample length of sample `at` where a condition changes for a short time alone; 0: none.
 * The top of a parabola through three samples tells where to look closer. */
static double find_peak(kempe_simulator *s, int at)
{
    int count = s->equations->conditions;
    const double *value = s->part.changes + (ptrdiff_t)at * count, step = 1.0 / SAMPLES;
    for (int k = 0; k < count; k++) {
        double before = beyond(s, k, value[k - count]), here = beyond(s, k, value[k]);
        double after = beyond(s, k, value[k + count]), bend = before - 2 * here + after, rise = 0.5 * (after - before);
        bool none = !(fmax(here, fmax(before, after)) <= 0) || !(bend < 0 && fabs(rise) <= -bend);
        if (none || here - 0.5 * rise * rise / bend - 0.25 * bend <= 0)
            continue;
        glance g = {s, k};
        double x = kmp_bracket_least(estimated_distance, &g, (at - 1) * step, (at + 1) * step, 1e-4);
        if (estimated_distance(&g, x) < 0)
            return x;
    }
    return 0;
}

/* Narrows the first change between parts `near` and `far` of the step to *t, where it has happened, with the values
 * there. */
static outcome narrow(kempe_simulator *s, double near, double f_near, double far, double f_far, double *t)
{
    struct kempe_simulator_parts *part = &s->part;
    double begin = part->state[AT_BEGIN], *value = part->changes + (ptrdiff_t)(SAMPLES + 2) * s->equations->conditions;
    double tolerance = fmax(4 * DBL_EPSILON * fmax(fabs(near), fabs(far)), 1e-14 * (far - near)), x;
    kmp_bracket b = kmp_bracket_of(near - begin, f_near, far - begin, f_far);
    while (kmp_bracket_next(&b, tolerance, &x)) {
        outcome said = look_at(s, begin + x, value);
        if (said != GOOD)
            return said;
        double f = most_beyond(s, value);
        kmp_bracket_take(&b, x, f, f > 0);
    }
    *t = begin + b.far;
    return look_at(s, *t, value);
}

/* Cuts the step at t, where the values have changed. */
static void cut_step(kempe_simulator *s, double t, const double *value)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    for (int k = 0; k < e->conditions; k++) {
        bool changes = beyond(s, k, value[k]) > 0;
        part->flip[k] = changes && e->condition_kind[k] != KEMPE_CONDITION_ENDS;
        if (changes && e->condition_kind[k] == KEMPE_CONDITION_ENDS && !(part->state[AT_ENDED] > 0))
            part->state[AT_ENDED] = k + 1;
    }
    pack_y(s, part->q, part->qd, part->y_new);
    part->state[AT_END] = t;
    part->state[AT_EVENT] = part->state[AT_FRESH] = 1;
    part->state[AT_EXCHANGE] = is_choice_bad(s, GROWTH);
}

/* Looks at the window up to part x of the step; *found: an event lies there, at which the step now ends. */
static outcome try_window(kempe_simulator *s, double from, double x, bool *found)
{
    struct kempe_simulator_parts *part = &s->part;
    int count = s->equations->conditions;
    double *value = part->changes + (ptrdiff_t)(SAMPLES + 2) * count, t = 0, begin = part->state[AT_BEGIN];
    double h = part->state[AT_TAKEN], far = x < 1 ? begin + x * h : part->state[AT_END], near = begin + from * h;
    outcome said = prepare_dense(s);
    if (said == GOOD)
        said = look_at(s, far, value);
    double f_far = said == GOOD ? most_beyond(s, value) : 0;
    if (said != GOOD || !(f_far > 0))
        return said;
    said = look_at(s, near, value);
    double f_near = said == GOOD ? most_beyond(s, value) : 0;
    if (f_near > 0 && near > begin) {
        far = near;
        f_far = f_near;
        near = begin;
        f_near = 0;
    }
    if (said == GOOD)
        said = narrow(s, near, f_near, far, f_far, &t);
    if (said == GOOD) {
        cut_step(s, t, value);
        *found = true;
    }
    return said;
}

/* Finds the first change of a condition within the last step, whose ends are complete. */
static outcome find_event(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int count = s->equations->conditions;
    bool found = false;
    outcome said = GOOD;
    for (int j = 0; j <= SAMPLES; j++)
        estimate_changes(s, (double)j / SAMPLES, part->changes + (ptrdiff_t)j * count);
    for (int j = 1; j <= SAMPLES && !found && said == GOOD; j++) {
        double peak = j < SAMPLES ? find_peak(s, j) : 0, here = (double)j / SAMPLES, from = here - 1.0 / SAMPLES;
        bool changed = most_beyond(s, part->changes + (ptrdiff_t)j * count) > 0;
        if (peak > 0)
            said = try_window(s, fmin(from, 0.5 * peak), peak, &found);
        if (changed && !found && said == GOOD)
            said = try_window(s, from, here, &found);
        if (!found)
            note_sizes(s, part->changes + (ptrdiff_t)j * count);
    }
    if (!found && said == GOOD)
        note_branches(s, part->changes + (ptrdiff_t)SAMPLES * count);
    return said;
}

#endif
