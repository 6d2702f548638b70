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

/* A part of the last step in which conditions are sampled: by estimates, or exactly. */
typedef struct window {
    double from, to;
    bool exact;
} window;

/* The values at part x of the step. */
static outcome sample(kempe_simulator *s, const window *in, double x, double *value)
{
    const double *state = s->part.state;
    if (in->exact)
        return look_at(s, x < 1 ? state[AT_BEGIN] + x * state[AT_TAKEN] : state[AT_END], value);
    estimate_changes(s, x, value);
    return GOOD;
}

static double sample_place(const window *in, int at)
{
    return in->from + (in->to - in->from) * at / SAMPLES;
}

typedef struct glance {
    kempe_simulator *s;
    const window *in;
    int condition;
} glance;

static double distance_before(void *self, double x)
{
    const glance *g = self;
    double *value = g->s->part.changes + (ptrdiff_t)(SAMPLES + 1) * g->s->equations->conditions;
    return sample(g->s, g->in, x, value) == GOOD ? -beyond(g->s, g->condition, value[g->condition]) : INFINITY;
}

/* A part of the step within a sample length of sample `at` where a condition changes for a short time alone; 0: none.
 * The top of a parabola through three samples tells where to look closer. */
static double find_peak(kempe_simulator *s, const window *in, int at)
{
    int count = s->equations->conditions;
    const double *value = s->part.changes + (ptrdiff_t)at * count;
    for (int k = 0; k < count; k++) {
        double before = beyond(s, k, value[k - count]), here = beyond(s, k, value[k]);
        double after = beyond(s, k, value[k + count]), bend = before - 2 * here + after, rise = 0.5 * (after - before);
        bool none = !(fmax(here, fmax(before, after)) <= 0) || !(bend < 0 && fabs(rise) <= -bend);
        if (none || here - 0.5 * rise * rise / bend - 0.25 * bend <= 0)
            continue;
        glance g = {s, in, k};
        double x = kmp_bracket_least(distance_before, &g, sample_place(in, at - 1), sample_place(in, at + 1),
                                     1e-4 * (in->to - in->from));
        if (distance_before(&g, x) < 0)
            return x;
    }
    return 0;
}

/* True where the sample in the middle shows that events of friction change too much between samples: it is far from the
 * cubic polynomial through the others. */
static bool is_coarse(const kempe_simulator *s)
{
    const int count = s->equations->conditions;
    const double *value = s->part.changes;
    for (int k = 0; k < count; k++) {
        const double *f = value + k;
        double size = 0;
        if (s->equations->condition_kind[k] != KEMPE_CONDITION_PASSES)
            continue;
        for (int j = 0; j <= SAMPLES; j++)
            size = fmax(size, fabs(f[(ptrdiff_t)j * count]));
        const double middle = (4 * (f[count] + f[3 * (ptrdiff_t)count]) - f[0] - f[4 * (ptrdiff_t)count]) / 6;
        if (fabs(f[2 * (ptrdiff_t)count] - middle) > RESOLVED * size)
            return true;
    }
    return false;
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

/* Finds the first change of a condition in a part of the step, which is halved as long as samples are too coarse. */
static outcome search_window(kempe_simulator *s, const window *in, bool *found)
{
    struct kempe_simulator_parts *part = &s->part;
    const int count = s->equations->conditions;
    outcome said = GOOD;
    for (int j = 0; j <= SAMPLES && said == GOOD; j++)
        said = sample(s, in, sample_place(in, j), part->changes + (ptrdiff_t)j * count);
    if (said == GOOD && in->exact && in->to - in->from > SHORTEST_WINDOW && is_coarse(s)) {
        const double middle = 0.5 * (in->from + in->to);
        const window first = {in->from, middle, true}, second = {middle, in->to, true};
        said = search_window(s, &first, found);
        return said == GOOD && !*found ? search_window(s, &second, found) : said;
    }
    for (int j = 1; j <= SAMPLES && !*found && said == GOOD; j++) {
        double peak = j < SAMPLES ? find_peak(s, in, j) : 0, here = sample_place(in, j), from = sample_place(in, j - 1);
        bool changed = most_beyond(s, part->changes + (ptrdiff_t)j * count) > 0;
        if (peak > 0)
            said = try_window(s, fmin(from, 0.5 * (in->from + peak)), peak, found);
        if (changed && !*found && said == GOOD)
            said = try_window(s, from, here, found);
        if (!*found)
            note_sizes(s, part->changes + (ptrdiff_t)j * count);
    }
    return said;
}

/* Finds the first change of a condition within the last step, whose ends are complete. Friction at rest follows
 * multipliers, whose course does not bound the step: its conditions are evaluated, not estimated. */
static outcome find_event(kempe_simulator *s)
{
    const window whole = {0, 1, friction_rests(s)};
    bool found = false;
    outcome said = search_window(s, &whole, &found);
    if (!found && said == GOOD)
        note_branches(s, s->part.changes + (ptrdiff_t)SAMPLES * s->equations->conditions);
    return said;
}

#endif
