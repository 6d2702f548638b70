/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/optimize/constrained_minimum.h"
#include "base/arena.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

#ifdef KEMPE_NLOPT
#include <nlopt.h>

/* The first step of a search without slopes, in sides of the cube. */
#define FIRST_STEP 0.1

typedef struct search {
    const kmp_minimum *minimum;
    kmp_minimum_report report;
    nlopt_opt opt;
    bool known, ended, exists;
    double *x, *slope, *limit, *limit_slope; /* of the last evaluation */
    double value, worst, size;               /* its value; the largest so far; of the first value */
    double *best;
} search;

static double broken(const search *s)
{
    double most = 0;
    for (int k = 0; k < s->minimum->limits; k++)
        most = fmax(most, s->limit[k]);
    return most;
}

static bool is_better(const search *s)
{
    const kmp_minimum_report *r = &s->report;
    double now = broken(s), kept = s->minimum->kept;
    if (r->outcome == KMP_SQUARES_NO_START)
        return true;
    return now <= kept && r->broken <= kept ? s->value < r->value : now < r->broken;
}

/* Slopes and inequalities remain the ones of the last place if the function does not exist here. */
static void evaluate(search *s, const double *x)
{
    const kmp_minimum *m = s->minimum;
    size_t bytes = (size_t)m->count * sizeof *x;
    if (s->ended || (s->known && memcmp(x, s->x, bytes) == 0))
        return;
    s->known = true;
    memcpy(s->x, x, bytes);
    s->report.evaluations++;
    kmp_lm_message said = m->at(m->user, x, &s->value, s->slope, s->limit, s->limit_slope);
    s->exists = said == KMP_SQUARES_GO && isfinite(s->value);
    s->ended = said == KMP_SQUARES_END || (!s->exists && s->report.outcome == KMP_SQUARES_NO_START);
    if (s->ended) {
        nlopt_force_stop(s->opt);
    } else if (!s->exists) {
        s->report.refused++;
        s->value = s->worst + s->size;
    } else {
        s->size = s->size > 0 ? s->size : fmax(fabs(s->value), 1e-300);
        s->worst = s->report.outcome == KMP_SQUARES_NO_START ? s->value : fmax(s->worst, s->value);
        if (is_better(s)) {
            s->report.value = s->value;
            s->report.broken = broken(s);
            memcpy(s->best, x, bytes);
        }
        s->report.outcome = KMP_SQUARES_ENDED;
    }
}

static double give_value(unsigned count, const double *x, double *slope, void *user)
{
    search *s = user;
    evaluate(s, x);
    for (unsigned k = 0; slope && k < count; k++)
        slope[k] = s->slope[k] / s->size;
    return s->value / s->size;
}

static void give_limits(unsigned limits, double *value, unsigned count, const double *x, double *slope, void *user)
{
    search *s = user;
    evaluate(s, x);
    memcpy(value, s->limit, limits * sizeof *value);
    if (slope)
        memcpy(slope, s->limit_slope, (size_t)limits * count * sizeof *slope);
}

static bool set_up(search *s, double *room)
{
    const kmp_minimum *m = s->minimum;
    bool good = nlopt_set_min_objective(s->opt, give_value, s) > 0 && nlopt_set_lower_bounds1(s->opt, 0) > 0 &&
                nlopt_set_upper_bounds1(s->opt, 1) > 0 && nlopt_set_xtol_rel(s->opt, m->tolerance) > 0 &&
                nlopt_set_ftol_rel(s->opt, m->tolerance) > 0 && nlopt_set_maxeval(s->opt, m->most) > 0;
    for (int k = 0; k < m->limits; k++)
        room[k] = m->kept;
    if (good && m->limits > 0)
        good = nlopt_add_inequality_mconstraint(s->opt, (unsigned)m->limits, give_limits, s, room) > 0;
    return good && (m->slopes || nlopt_set_initial_step1(s->opt, FIRST_STEP) > 0);
}

const bool kmp_minimum_available = true;

bool kmp_minimum_find(const kmp_minimum *minimum, double *x, kmp_minimum_report *report)
{
    int count = minimum->count, limits = minimum->limits;
    double *room, last;
    kmp_arena arena = {0};
    search s = {.minimum = minimum, .report = {.outcome = KMP_SQUARES_NO_START, .value = INFINITY, .broken = INFINITY}};
    bool ok = KMP_ARENA_MAKE(&arena, KMP_ROOM(double, count, &s.x, &s.slope, &s.best),
                             KMP_ROOM(double, limits, &s.limit, &room),
                             KMP_ROOM(double, (ptrdiff_t)limits *count, &s.limit_slope));
    s.opt = ok ? nlopt_create(minimum->slopes ? NLOPT_LD_SLSQP : NLOPT_LN_COBYLA, (unsigned)count) : NULL;
    ok = s.opt && set_up(&s, room);
    if (ok) {
        nlopt_result result = nlopt_optimize(s.opt, x, &last);
        bool most = result == NLOPT_MAXEVAL_REACHED;
        if (s.report.outcome != KMP_SQUARES_NO_START) {
            memcpy(x, s.best, (size_t)count * sizeof *x);
            s.report.outcome = s.ended ? KMP_SQUARES_ENDED : most ? KMP_SQUARES_MOST : KMP_SQUARES_FOUND;
        }
        *report = s.report;
        ok = result != NLOPT_OUT_OF_MEMORY;
    }
    nlopt_destroy(s.opt);
    kmp_arena_free(&arena);
    return ok;
}

#else

const bool kmp_minimum_available = false;

bool kmp_minimum_find(const kmp_minimum *minimum, double *x, kmp_minimum_report *report)
{
    (void)minimum, (void)x, (void)report;
    return false;
}

#endif
