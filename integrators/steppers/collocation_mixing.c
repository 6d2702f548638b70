/* SPDX-License-Identifier: BSD-3-Clause */
/* Anderson's mixing of the corrections of Newton's method (J. ACM 12 (1965) 547; Walker and Ni, SIAM J. Numer. Anal. 49
 * (2011) 1715). One Jacobian for all stages is wrong by a few forces: a contact that begins between two stages, a
 * damper that turns along the step. The difference has a low rank, which the last corrections span. The next place is
 * that of their combination with the least weighted square; on a linear system these are the places of GMRES. */
#include "integrators/steppers/collocation_mixing.h"
#include "integrators/steppers/collocation.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Corrections are combined from this quotient of two on. */
static const double SLOWLY = 0.1;
/* The part of a difference that must be left beside the others: less is rounding. */
static const double INDEPENDENT = 1e-6;

static size_t size_of(const kmp_collocation *s)
{
    return (size_t)s->inner * (size_t)s->w;
}

static double product(const kmp_collocation *s, const double *x, const double *y)
{
    double sum = 0;
    for (int k = 0; k < s->inner; k++)
        for (int j = 0; j < s->s; j++) {
            int i = k * s->w + j;
            sum += (s->weight[k] * x[i]) * (s->weight[k] * y[i]);
        }
    return sum;
}

double kmp_collocation_square(const kmp_collocation *s, const double *x)
{
    return product(s, x, x);
}

static void subtract(const kmp_collocation *s, double factor, const double *of, double *from)
{
    for (size_t k = 0; k < size_of(s); k++)
        from[k] -= factor * of[k];
}

static void scale(const kmp_collocation *s, double factor, double *x)
{
    for (size_t k = 0; k < size_of(s); k++)
        x[k] *= factor;
}

/* Adds the differences from the sweep before, made orthogonal to the others; where there is no room, all are forgotten
 * first. */
static void add_difference(kmp_collocation *s)
{
    kmp_mixing *m = &s->mixing;
    m->count = m->count < KMP_COLLOCATION_MIXED ? m->count : 0;
    double *by = m->by[m->count], *to = m->to[m->count];
    for (size_t k = 0; k < size_of(s); k++) {
        by[k] = s->change[k] - m->change[k];
        to[k] = s->g[k] + s->change[k] - m->place[k];
    }
    double whole = kmp_collocation_square(s, by);
    for (int j = 0; j < m->count; j++) {
        double part = product(s, m->by[j], by);
        subtract(s, part, m->by[j], by);
        subtract(s, part, m->to[j], to);
    }
    double left = kmp_collocation_square(s, by);
    if (!(left > INDEPENDENT * INDEPENDENT * whole && left <= DBL_MAX))
        return;
    scale(s, 1 / sqrt(left), by);
    scale(s, 1 / sqrt(left), to);
    m->count++;
}

static void combine(kmp_collocation *s)
{
    kmp_mixing *m = &s->mixing;
    memcpy(m->open, s->change, size_of(s) * sizeof *s->change);
    for (int j = 0; j < m->count; j++) {
        double part = product(s, m->by[j], m->open);
        subtract(s, part, m->by[j], m->open);
        subtract(s, part, m->to[j], s->change);
    }
}

double kmp_collocation_mix(kmp_collocation *s, bool first)
{
    kmp_mixing *m = &s->mixing;
    double size = kmp_collocation_square(s, s->change);
    if (!first)
        add_difference(s);
    memcpy(m->change, s->change, size_of(s) * sizeof *s->change);
    for (size_t k = 0; k < size_of(s); k++)
        m->place[k] = s->g[k] + s->change[k];
    m->on = m->on || (!first && size > SLOWLY * SLOWLY * m->size);
    m->size = size;
    if (!m->on)
        return size;
    combine(s);
    return fmax(size, kmp_collocation_square(s, s->change));
}
