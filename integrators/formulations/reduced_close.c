/* SPDX-License-Identifier: BSD-3-Clause */
/* An evaluation of the newton form by the fused or the solved program: corrections of the predicted v until the rest of
 * the program, which is evaluated at the corrected v, finds it closed. The correction that is left there tests that. */
#include "constraints/tolerances.h"
#include "integrators/decide/closing.h"
#include "integrators/formulations/reduced.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* The largest component of a correction of v, in scales and in error weights; infinite where one is not finite. */
typedef struct extent {
    double scaled, weighted;
} extent;

static extent measure(const kmp_reduced *d, const double *dv)
{
    extent e = {0};
    double sum = 0;
    for (int i = 0; i < d->r; i++) {
        double change = fabs(dv[i]), scaled = change * d->by_scale[i], part = change * d->by_weight[i];
        sum += change;
        e.scaled = scaled > e.scaled ? scaled : e.scaled;
        e.weighted = part > e.weighted ? part : e.weighted;
    }
    return sum <= DBL_MAX ? e : (extent){INFINITY, INFINITY};
}

static bool is_small(const kmp_reduced *d, extent e)
{
    return e.weighted <= KMP_CORRECTION_IN_STAGE || e.scaled <= d->noise;
}

static void add(kmp_reduced *d, const double *dv)
{
    for (int i = 0; i < d->r; i++)
        d->v[i] += dv[i];
}

/* Closes d->v and evaluates there. false: corrections do not contract, or pivots are bad. */
static bool close_and_finish(kmp_reduced *d, double t, double *dy)
{
    kmp_reduced_program *program = d->programs.fused;
    double last = INFINITY, *v = d->state + 2 * d->p;
    for (int k = 0; k < KMP_CLOSING_PASSES; k++) {
        memcpy(v, d->v, (size_t)d->r * sizeof *v);
        kmp_writer_correction c = kmp_reduced_program_close(program, t, d->state);
        extent e = measure(d, c.dv), next = {d->contraction * e.scaled * e.scaled, INFINITY};
        d->red.newton++;
        if (!is_small(d, e) && !kmp_closing_contracts(e.scaled, last))
            return false;
        add(d, c.dv);
        last = e.scaled;
        /* The next correction is about the square of this one, times a factor that the last corrections had: the rest
         * of the program follows once that is small. */
        next.weighted = e.scaled > 0 ? next.scaled * e.weighted / e.scaled : 0;
        if (c.turn > KMP_TURN_SMALL || !is_small(d, next))
            continue;
        bool regular = kmp_reduced_program_finish(program, t, d->state, dy);
        extent left = measure(d, kmp_reduced_program_left(program));
        if (left.scaled > d->noise)
            d->contraction = left.scaled / (e.scaled * e.scaled);
        if (!is_small(d, left) && !kmp_closing_contracts(left.scaled, last))
            return false;
        add(d, kmp_reduced_program_left(program));
        last = left.scaled;
        if (is_small(d, left))
            return regular;
    }
    return false;
}

bool kmp_reduced_evaluate_closing(kmp_reduced *d, double t, const double *y, double *dy)
{
    size_t p = (size_t)d->p, r = (size_t)d->r;
    double *slope = d->has_v ? dy : d->slope;
    if (d->has_v)
        memcpy(d->v, y + 2 * p, r * sizeof *y);
    else
        kmp_reduced_predict(d, t, y);
    memcpy(d->state, y, 2 * p * sizeof *y);
    bool closed = close_and_finish(d, t, slope);
    if (!d->has_v)
        memcpy(dy, slope, 2 * p * sizeof *dy);
    d->closed_fused = closed && !kmp_reduced_is_solved(d);
    return closed;
}
