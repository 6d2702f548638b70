/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's loop for all closings. It ends where a correction is below the requested part of the error weights, or below
 * rounding. From afar it descends: each correction is bounded, and the bound adapts to how well the last one predicted
 * |h| (a trust region). */
#include "constraints/closing/close.h"
#include "constraints/evaluation/evaluator.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST_FROM_AFAR = 200, MOST_DAMPINGS = 60, MOST_OF_RATES = 10 };
#define MORE_DAMPING 3.0

/* Returns max |dx| in scales, and in error weights. */
static double measure(const kmp_closer *c, const kmp_close_rule *rule, double *weighted)
{
    double size = 0, within = 0, zero = 0; /* NaN when a component is not finite */
    for (int i = 0; i < c->count; i++) {
        int k = c->at ? c->at[i] : i;
        double d = fabs(c->dx[i]), scaled = d / c->scale[k], of = rule->w ? d / rule->w[k] : 0;
        zero += 0 * d;
        size = scaled > size ? scaled : size;
        within = of > within ? of : within;
    }
    *weighted = rule->w ? within : INFINITY;
    return isnan(zero) ? INFINITY : size;
}

static double residual(const kmp_closer *c)
{
    double worst = 0;
    for (int k = 0; c->rows && k < c->row_count; k++) {
        double open = kmp_eval_opening(c->eval, c->rows[k]);
        worst = open <= worst ? worst : open;
    }
    return c->rows ? worst : kmp_eval_residual(c->eval);
}

double kmp_close_rounding(const kempe_system *system)
{
    return fmax(KMP_CLOSED_STALLED, KMP_CLOSED_AFAR * system->reach / system->length);
}

static void add(const kmp_closer *c, double factor, double *x)
{
    for (int i = 0; i < c->count; i++)
        x[c->at ? c->at[i] : i] += factor * c->dx[i];
}

kmp_closed kmp_close(const kmp_closer *c, const kmp_close_rule *rule, double t, double *x)
{
    kmp_closed out = {0};
    double last = INFINITY, weighted, part, noise = kmp_close_noise(c->eval->n, c->scale, x);
    while (out.corrections < rule->most && c->place(c->self, t, x) == 0 && c->correct(c->self, c->eval->h, c->dx)) {
        double size = measure(c, rule, &weighted);
        kmp_closing_move move = kmp_closing_judge(&out, rule, noise, size, weighted, residual(c), &last, &part);
        if (move == KMP_CLOSING_STOPS)
            return out;
        add(c, part, x);
        if (move == KMP_CLOSING_ENDS)
            return out;
    }
    return out;
}

/* -- from a distant guess ------------------------------------------------------------------------------ */

double kmp_close_length(const kmp_evaluator *eval)
{
    double sum = 0;
    for (int r = 0; r < eval->m; r++)
        if (kmp_eval_counts(eval, r))
            sum += kmp_eval_opening(eval, r) * kmp_eval_opening(eval, r);
    return isnan(sum) ? INFINITY : sqrt(sum);
}

static void evaluate(const kmp_closer *c, double t, const double *x)
{
    if (c->evaluate)
        c->evaluate(c->self, t, x);
    else
        kmp_eval_closure(c->eval, t, x);
}

/* Computes a correction no longer than `bound`; returns the |h| that it predicts, infinite if there is none. */
static double bounded_correction(const kmp_closer *c, double h, double bound)
{
    const kmp_close_rule rule = {0};
    double damping = fmax(h, DBL_MIN), weighted;
    for (int k = 0; k < MOST_DAMPINGS; k++, damping *= MORE_DAMPING) {
        if ((k > 0 && c->damp(c->self, damping)) || !c->correct(c->self, c->eval->h, c->dx))
            return INFINITY;
        if (measure(c, &rule, &weighted) <= bound)
            return c->promise(c->self);
    }
    return INFINITY;
}

/* Takes one descent step and returns the decrease of |h|; 0: stationary. `bound` shrinks after steps that miss their
 * prediction and grows after steps that meet it. */
static double step_down(const kmp_closer *c, double t, double *x, double *trial, double *bound)
{
    size_t bytes = (size_t)c->eval->n * sizeof *x;
    for (; *bound > KMP_SHORTEST_CORRECTION; *bound *= 0.4) {
        if (c->place(c->self, t, x))
            return 0;
        double before = kmp_close_length(c->eval), promised = before - bounded_correction(c, before, *bound);
        if (!(promised > 0)) /* zero gradient */
            return 0;
        memcpy(trial, x, bytes);
        add(c, 1, trial);
        evaluate(c, t, trial);
        double gained = before - kmp_close_length(c->eval);
        if (gained > 0.1 * promised) {
            memcpy(x, trial, bytes);
            *bound = gained > 0.6 * promised ? fmin(2 * *bound, KMP_LONGEST_CORRECTION) : *bound;
            return gained;
        }
    }
    return 0;
}

int kmp_close_from_afar(const kmp_closer *c, double near, double worth, double t, double *x, double *trial)
{
    double bound = KMP_LONGEST_CORRECTION;
    int steps = 0;
    bool worthwhile = true;
    evaluate(c, t, x);
    while (worthwhile && steps < MOST_FROM_AFAR && !(kmp_eval_residual(c->eval) <= near)) {
        double gained = step_down(c, t, x, trial, &bound);
        evaluate(c, t, x);
        worthwhile = gained > worth * kmp_close_length(c->eval);
        steps++;
    }
    return steps;
}

/* -- rates ------------------------------------------------------------------------------------------- */

void kmp_close_rates(const kmp_closer *c, double *room, double *qd)
{
    double last = INFINITY;
    for (int pass = 0; pass < (c->damp ? MOST_OF_RATES : 2); pass++) {
        double left = c->damp ? kmp_eval_rate_residual(c->eval, qd) : 0;
        if (pass > 1 && !(left < 0.5 * last))
            return;
        last = left;
        kmp_eval_rates(c->eval, qd, room);
        if (c->correct(c->self, room, c->dx))
            add(c, 1, qd);
    }
}

bool kmp_close_state(const kmp_closer *c, double *room, double t, double *q, double *qd)
{
    const kmp_close_rule rule = {.most = KMP_CLOSING_PASSES, .enough = KMP_CLOSED_ENOUGH};
    bool closed = kmp_close(c, &rule, t, q).closed;
    if (closed)
        kmp_close_rates(c, room, qd);
    return closed;
}

/* The correction dv = -Jv^-1 h for given u as a kmp_closer, with the blocks of a reduction. */

static int place(void *self, double t, const double *q)
{
    kmp_reduction *red = self;
    kmp_eval_closure(red->eval, t, q);
    return kmp_reduction_factor(red);
}

static bool correct(void *self, const double *violation, double *dv)
{
    kmp_reduction *red = self;
    (void)violation, (void)dv; /* h, in place */
    kmp_reduction_correction(red);
    red->newton++;
    return true;
}

kmp_close_rule kmp_reduction_close_rule(const kmp_reduction *red)
{
    return (kmp_close_rule){
        .most = KMP_CLOSING_PASSES, .contracting = true, .enough = kmp_close_rounding(red->eval->system)};
}

int kmp_reduction_close(kmp_reduction *red, double t, double *q, const double *w, double fraction)
{
    const kempe_system *s = red->eval->system;
    const kmp_closer closer = {.self = red,
                               .eval = red->eval,
                               .scale = s->scale,
                               .count = red->r,
                               .at = red->part->v,
                               .dx = red->dv,
                               .rows = red->part->rows,
                               .row_count = red->r,
                               .place = place,
                               .correct = correct};
    kmp_close_rule rule = kmp_reduction_close_rule(red);
    rule.w = w;
    rule.fraction = fraction;
    return !kmp_close(&closer, &rule, t, q).closed;
}
