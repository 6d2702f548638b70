/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/limit_cycles/shooting.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/lapack.h"
#include <math.h>
#include <string.h>

enum { MOST_CORRECTIONS = 10 };

/* A correction of so many sizes leads to another cycle, or nowhere. */
#define FAR 1.0
/* Corrections that grow by more do not converge. */
#define GROWS 2.0

const char *kmp_cycle_stability_text(const kmp_cycle *cycle)
{
    static const char *const words[] = {"stable", "unstable", "undecided"};
    return words[cycle->stability];
}

const char *kmp_cycle_text(const kmp_cycle *cycle)
{
    static const char *const words[] = {"", "Hopf", "fold", "doubling", "torus", "branching", "rest"};
    return words[cycle->word];
}

kempe_status kmp_shooting_init(kmp_shooting *shooting, kmp_flow *flow, int loads, const int *load, kmp_arena *cycles)
{
    kmp_shooting *s = shooting;
    int n = flow->size, w = n + 2;
    *s = (kmp_shooting){.flow = flow, .cycles = cycles, .size = n, .width = w, .loads = loads, .load = load};
    KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, w, &s->z, &s->scale, &s->span, &s->whole, &s->right),
                   KMP_ROOM(double, n, &s->reference, &s->direction, &s->re, &s->im),
                   KMP_ROOM(double, w *w, &s->matrix), KMP_ROOM(double, n *n, &s->copy),
                   KMP_ROOM(double, 4 * n * n, &s->vectors), KMP_ROOM(int, w, &s->pivot, &s->order));
    return kmp_made(flow->context, !s->arena.failed);
}

void kmp_shooting_free(kmp_shooting *shooting)
{
    kmp_arena_free(&shooting->arena);
}

/* -- sizes -------------------------------------------------------------------------------------------- */

void kmp_shooting_weigh(kmp_shooting *shooting, const double *x, const double *reach, double period, double parameter)
{
    kmp_shooting *s = shooting;
    double largest[3], motion;
    for (kmp_flow_kind kind = KMP_FLOW_POSITION; kind <= KMP_FLOW_STATE; kind++)
        largest[kind] = kmp_flow_largest(s->flow, reach, kind);
    motion = fmax(largest[KMP_FLOW_POSITION], largest[KMP_FLOW_STATE]);
    for (int i = 0; i < s->size; i++) {
        const kmp_flow_entry *e = &s->flow->entry[i];
        double usual = e->kind == KMP_FLOW_RATE ? motion * 2 * acos(-1) / period : motion;
        double largest_here = fmax(largest[e->kind], usual) * s->flow->system->scale[e->motion], mean = fabs(x[i]);
        s->scale[i] = fmax(fmax(reach[i], KMP_CYCLE_STILL * largest_here), s->flow->rtol / KMP_CYCLE_CORRECTED * mean);
        s->span[i] = fmax(s->scale[i], KMP_CYCLE_RANGE * mean);
        s->whole[i] = fmax(s->span[i], largest_here);
    }
    s->scale[s->size] = s->span[s->size] = s->whole[s->size] = period;
    s->scale[s->size + 1] = s->span[s->size + 1] = s->whole[s->size + 1] = parameter;
    kmp_flow_weigh(s->flow, s->scale, parameter);
}

void kmp_shooting_refer(kmp_shooting *shooting, const double *x, const double *rate)
{
    memcpy(shooting->reference, x, (size_t)shooting->size * sizeof *x);
    memcpy(shooting->direction, rate, (size_t)shooting->size * sizeof *rate);
}

/* -- Newton's method ------------------------------------------------------------------------------------ */

/* The derivatives of all conditions, over the sizes, at the last run. */
static void fill_matrix(kmp_shooting *s, const double *border)
{
    const kmp_flow *f = s->flow;
    int n = s->size, w = s->width;
    for (int j = 0; j < w; j++) {
        double *column = s->matrix + (ptrdiff_t)j * w;
        for (int i = 0; i < n; i++)
            column[i] = (j == n  ? f->end_rate[i]
                         : j < n ? f->slope[i + (ptrdiff_t)j * n]
                                 : f->slope[i + (ptrdiff_t)n * n]) *
                        s->scale[j] / s->scale[i];
        column[n] = j < n ? s->direction[j] * s->scale[n] / s->scale[j] : 0;
        column[n + 1] = border[j] * s->scale[j] / s->span[j];
    }
}

static kempe_status fail_newton(const kmp_shooting *s, const char *why)
{
    return kmp_fail(s->flow->context, KEMPE_E_FAILED, "Newton's method finds no limit cycle near %.9g: %s",
                    s->z[s->width - 1], why);
}

/* A correction; *size: the largest part of it, *far: over the largest motions. */
static kempe_status correct_once(kmp_shooting *s, const double *guess, const double *border, double *size, double *far)
{
    KMP_TRY(kmp_flow_run(s->flow, s->z, s->z[s->size], s->z[s->size + 1], 1));
    fill_matrix(s, border);
    const kmp_flow *f = s->flow;
    int n = s->size;
    double phase = 0, beside = 0;
    for (int i = 0; i < n; i++) {
        s->right[i] = (f->begin[i] - f->end[i]) / s->scale[i];
        phase += s->direction[i] * s->scale[n] / s->scale[i] * (s->reference[i] - s->z[i]) / s->scale[i];
    }
    for (int j = 0; j < s->width; j++)
        beside += border[j] * (guess[j] - s->z[j]) / s->span[j];
    s->right[n] = phase;
    s->right[n + 1] = beside;
    if (kmp_lu_factor(s->width, s->matrix, s->pivot) != 0)
        return fail_newton(s, "its equations are singular");
    kmp_lu_solve(s->width, s->matrix, s->pivot, 1, s->right);
    *size = *far = 0;
    for (int j = 0; j < s->width; j++) {
        *size = fmax(*size, fabs(s->right[j]));
        *far = fmax(*far, fabs(s->right[j]) * s->scale[j] / s->whole[j]);
    }
    return isfinite(*size) ? KEMPE_OK : fail_newton(s, "a correction is not finite");
}

kempe_status kmp_shooting_correct(kmp_shooting *shooting, const double *guess, const double *border)
{
    kmp_shooting *s = shooting;
    double last = FAR, size = 0, far = 0;
    memcpy(s->z, guess, (size_t)s->width * sizeof *guess);
    for (s->iterations = 1; s->iterations <= MOST_CORRECTIONS; s->iterations++) {
        KMP_TRY(correct_once(s, guess, border, &size, &far));
        if (far > GROWS * last || far > FAR || s->right[s->size] < -0.5)
            return fail_newton(s, "its corrections grow");
        for (int j = 0; j < s->width; j++)
            s->z[j] += s->right[j] * s->scale[j];
        if (size <= KMP_CYCLE_CORRECTED)
            return KEMPE_OK;
        last = fmax(far, KMP_CYCLE_CORRECTED);
    }
    return fail_newton(s, "its corrections do not become small");
}

/* -- a cycle ------------------------------------------------------------------------------------------- */

kmp_cycle *kmp_shooting_room(kmp_shooting *shooting)
{
    kmp_shooting *s = shooting;
    int n = s->size, outputs = s->flow->rows->columns;
    kmp_cycle *c = KMP_ARENA_NEW(s->cycles, kmp_cycle, 1);
    return c && KMP_ARENA_MAKE(s->cycles, KMP_ROOM(double, n, &c->x, &c->rate, &c->re, &c->im, &c->reach),
                               KMP_ROOM(double, n + 2, &c->tangent), KMP_ROOM(double, outputs, &c->high, &c->low),
                               KMP_ROOM(double, s->loads, &c->load))
               ? c
               : NULL;
}

/* Means over the period; NaN where every other value has another mean, as with a motion faster than the values. */
static void take_loads(const kmp_shooting *s, kmp_cycle *c)
{
    const kempe_sensitivity *rows = s->flow->rows;
    int pieces = s->flow->pieces;
    for (int k = 0; k < s->loads; k++) {
        double even = 0, odd = 0;
        for (int row = 0; row + 1 < pieces; row += 2) {
            even += 2 * kmp_sensitivity_value(rows, row, s->load[k]) / pieces;
            odd += 2 * kmp_sensitivity_value(rows, row + 1, s->load[k]) / pieces;
        }
        c->load[k] = (even + odd) / 2;
        if (fabs(even - odd) > KMP_CYCLE_MEAN * (fabs(even) + fabs(odd)) + s->flow->rtol * c->high[s->load[k]])
            c->load[k] = NAN;
    }
}

/* Multipliers by their size, without the one nearest to 1; of a pair the one above the axis comes first. */
static kempe_status take_multipliers(kmp_shooting *s, kmp_cycle *c)
{
    int n = s->size, nearest = 0, taken = 0;
    double *v = s->vectors;
    memcpy(s->copy, s->flow->monodromy, (size_t)(n * n) * sizeof *s->copy);
    if (kmp_eigen_general(n, s->copy, s->re, s->im, v, v + n * n, v + 2 * n * n, v + 3 * n * n) != 0)
        return kmp_fail(s->flow->context, KEMPE_E_FAILED, "the multipliers of the cycle at %.9g are not found",
                        c->value);
    for (int i = 0; i < n; i++)
        if (hypot(s->re[i] - 1, s->im[i]) < hypot(s->re[nearest] - 1, s->im[nearest]))
            nearest = i;
    c->along = hypot(s->re[nearest] - 1, s->im[nearest]);
    for (int i = 0; i < n; i++) {
        int at = taken;
        if (i == nearest)
            continue;
        for (; at > 0 && hypot(s->re[i], s->im[i]) > hypot(c->re[at - 1], c->im[at - 1]); at--) {
            c->re[at] = c->re[at - 1];
            c->im[at] = c->im[at - 1];
        }
        c->re[at] = s->re[i];
        c->im[at] = s->im[i];
        taken++;
    }
    c->multipliers = taken;
    return KEMPE_OK;
}

/* The direction of the branch: along the conditions of a cycle, with `border` . tangent = 1 over the spans. */
static kempe_status take_tangent(kmp_shooting *s, const double *border, kmp_cycle *c)
{
    fill_matrix(s, border);
    if (kmp_lu_factor(s->width, s->matrix, s->pivot) != 0)
        return fail_newton(s, "the branch has no direction there");
    memset(s->right, 0, (size_t)s->width * sizeof *s->right);
    s->right[s->width - 1] = 1;
    kmp_lu_solve(s->width, s->matrix, s->pivot, 1, s->right);
    for (int j = 0; j < s->width; j++)
        c->tangent[j] = s->right[j] * s->scale[j];
    return KEMPE_OK;
}

kempe_status kmp_shooting_finish(kmp_shooting *shooting, const double *border, kmp_cycle **cycle)
{
    kmp_shooting *s = shooting;
    kmp_cycle *c = kmp_shooting_room(s);
    KMP_TRY(kmp_made(s->flow->context, c));
    KMP_TRY(kmp_flow_run(s->flow, s->z, s->z[s->size], s->z[s->size + 1], KMP_FLOW_PIECES));
    const kmp_flow *f = s->flow;
    int n = s->size;
    c->period = s->z[n];
    c->value = s->z[n + 1];
    for (int i = 0; i < n; i++) {
        double high = -INFINITY, low = INFINITY;
        for (int k = 0; k < f->pieces; k++) {
            high = fmax(high, f->history[i + (ptrdiff_t)k * n]);
            low = fmin(low, f->history[i + (ptrdiff_t)k * n]);
        }
        c->x[i] = f->begin[i];
        c->rate[i] = f->begin_rate[i];
        c->reach[i] = (high - low) / 2;
        c->residual = fmax(c->residual, fabs(f->end[i] - f->begin[i]) / s->scale[i]);
    }
    c->amplitude =
        fmax(kmp_flow_largest(f, c->reach, KMP_FLOW_POSITION), kmp_flow_largest(f, c->reach, KMP_FLOW_STATE));
    /* Extremes of the outputs; one that advances from period to period has none. */
    const kempe_sensitivity *rows = s->flow->rows;
    int pieces = s->flow->pieces;
    for (int k = 0; k < rows->columns; k++) {
        kmp_flow_extremes(pieces, rows->cell + k, (ptrdiff_t)kmp_sensitivity_width(rows), &c->high[k], &c->low[k]);
        double change = kmp_sensitivity_value(rows, pieces, k) - kmp_sensitivity_value(rows, 0, k);
        if (fabs(change) > KMP_CYCLE_ADVANCES * (c->high[k] - c->low[k]))
            c->high[k] = c->low[k] = NAN;
    }
    take_loads(s, c);
    KMP_TRY(take_multipliers(s, c));
    /* Multipliers on the circle, as far as they are known, decide nothing. */
    double noise = fmax(KMP_CYCLE_ON_CIRCLE, KMP_CYCLE_ERRORS * c->along);
    bool on_circle = false;
    for (int k = 0; k < c->multipliers; k++) {
        double size = hypot(c->re[k], c->im[k]);
        c->growing += size > 1;
        on_circle = on_circle || fabs(size - 1) <= noise;
    }
    bool grows = c->multipliers > 0 && hypot(c->re[0], c->im[0]) > 1 + noise;
    c->stability = grows ? KMP_CYCLE_UNSTABLE : on_circle ? KMP_CYCLE_UNDECIDED : KMP_CYCLE_STABLE;
    KMP_TRY(take_tangent(s, border, c));
    *cycle = c;
    return KEMPE_OK;
}
