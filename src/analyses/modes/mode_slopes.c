/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of eigenvalues by parameters: of simple ones by left and right vectors, of equal ones by a small
 * eigenvalue problem in their eigenspace (Lancaster 1964; Mills-Curran 1988). */
#include "analyses/modes/mode_slopes.h"
#include "base/memory.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/lapack.h"
#include "output/print.h"
#include <complex.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Eigenvalues nearer than this, relative to the largest modulus, count as equal: the matrices' rounding separates an
 * equal pair with a single vector by its root. */
#define NEAR 1e-7

typedef double complex number;

/* A mode's real or imaginary part as a motion of the whole system. */
typedef struct part {
    double *u, *ud, *udd, *q, *qd, *qdd, *lambda;
} part;

typedef struct work {
    kmp_linear *linear;
    kmp_second_derivatives *second;
    const kmp_state_sensitivity *shift;
    const kmp_spectrum *spectrum;
    kmp_mode_slopes *out;
    int p, n, m;
    kmp_arena arena;
    part part[2];
    double *rest[2];          /* p: dP x */
    double *unit;             /* a parameter each */
    number *left, *moved, *s; /* of a group of equal ones: Y^H (2 s M + G) X, Y^H dP X; values */
    int *group;
    number *room; /* factors of the small matrix */
    int *pivot;
    bool *done; /* of the spectrum */
} work;

static number value_of(const kmp_spectrum *s, int i)
{
    return s->re[i] + s->im[i] * I;
}

/* -- room -------------------------------------------------------------------------------------------- */

static bool make_room(work *w)
{
    kmp_arena *a = &w->arena;
    int n = w->n, count = w->spectrum->count;
    KMP_ARENA_MAKE(a, KMP_ROOM(number, count * count, &w->left, &w->moved), KMP_ROOM(number, count, &w->s),
                   KMP_ROOM(int, count, &w->group, &w->pivot), KMP_ROOM(bool, count, &w->done));
    part *x = w->part;
    return KMP_ARENA_MAKE(a,
                          KMP_ROOM(double, n, &x[0].u, &x[0].ud, &x[0].udd, &x[0].q, &x[0].qd, &x[0].qdd, &w->rest[0],
                                   &x[1].u, &x[1].ud, &x[1].udd, &x[1].q, &x[1].qd, &x[1].qdd, &w->rest[1]),
                          KMP_ROOM(double, w->m, &x[0].lambda, &x[1].lambda), KMP_ROOM(double, w->out->count, &w->unit),
                          KMP_ROOM(number, count * count, &w->room));
}

/* -- one mode ---------------------------------------------------------------------------------------- */

/* The mode of vector i at the value s as a motion. */
static void lay_out(work *w, int i, number s)
{
    const kmp_spectrum *sp = w->spectrum;
    for (int k = 0; k < w->p; k++) {
        number x = sp->x_re[k + i * w->p] + sp->x_im[k + i * w->p] * I;
        w->part[0].u[k] = creal(x), w->part[1].u[k] = cimag(x);
        w->part[0].ud[k] = creal(s * x), w->part[1].ud[k] = cimag(s * x);
        w->part[0].udd[k] = creal(s * s * x), w->part[1].udd[k] = cimag(s * s * x);
    }
    for (int k = 0; k < 2; k++) {
        const part *x = &w->part[k];
        kmp_linear_follow(w->linear, &(kmp_change){.u = x->u, .ud = x->ud, .udd = x->udd},
                          &(kmp_response){x->q, x->qd, x->qdd, x->lambda, NULL});
    }
}

/* dP x of that mode by parameter k. */
static void disturb(work *w, int k)
{
    const kmp_state_sensitivity *sh = w->shift;
    kmp_variation state = {sh->q + k * w->n, sh->qd + k * w->n, sh->qdd + k * w->n, sh->lambda + k * w->m};
    for (int i = 0; i < 2; i++) {
        const part *x = &w->part[i];
        w->unit[k] = 1;
        kmp_second_values bent =
            kmp_second_derivatives_along(w->second, &(kmp_variation){x->q, x->qd, x->qdd, x->lambda}, &state, w->unit);
        w->unit[k] = 0;
        kmp_linear_follow(w->linear,
                          &(kmp_change){.h = bent.h, .rate = bent.rate, .curve = bent.curve, .force = bent.force},
                          &(kmp_response){.residual = w->rest[i]});
    }
}

/* y^H of vector i times the array `rest`. */
static number weigh(const work *w, int i)
{
    const kmp_spectrum *sp = w->spectrum;
    number sum = 0;
    for (int k = 0; k < w->p; k++)
        sum += (sp->y_re[k + i * w->p] - sp->y_im[k + i * w->p] * I) * (w->rest[0][k] + w->rest[1][k] * I);
    return sum;
}

/* y^H (2 s M + G) x. */
static number product(const work *w, int i, int j, number s)
{
    const kmp_spectrum *sp = w->spectrum;
    const kmp_linear *l = w->linear;
    number sum = 0;
    for (int a = 0; a < w->p; a++)
        for (int b = 0; b < w->p; b++) {
            number x = sp->x_re[b + j * w->p] + sp->x_im[b + j * w->p] * I;
            number y = sp->y_re[a + i * w->p] - sp->y_im[a + i * w->p] * I;
            sum += y * (2 * s * l->mass[a + b * w->p] + l->damping[a + b * w->p]) * x;
        }
    return sum;
}

/* -- equal ones -------------------------------------------------------------------------------------- */

static void set(kmp_mode_slopes *out, int i, int k, number x)
{
    out->re[i * out->count + k] = creal(x);
    out->im[i * out->count + k] = cimag(x);
}

/* Compares by real part, then by imaginary part. */
static int compare(const void *a, const void *b)
{
    number x = *(const number *)a, y = *(const number *)b;
    if (creal(x) != creal(y))
        return creal(x) < creal(y) ? -1 : 1;
    return (cimag(x) > cimag(y)) - (cimag(x) < cimag(y));
}

/* v^H M v of vector i of a list. */
static double size_of(const work *w, const double *re, const double *im, int i)
{
    const double *mass = w->linear->mass;
    double sum = 0;
    for (int a = 0; a < w->p; a++)
        for (int b = 0; b < w->p; b++)
            sum += mass[a + b * w->p] * (re[a + i * w->p] * re[b + i * w->p] + im[a + i * w->p] * im[b + i * w->p]);
    return sqrt(sum);
}

/* -left^-1 moved, in `moved`, both g x g by columns, with vectors normalised by the mass. False: left is singular up to
 * rounding, relative to 2 s. */
static bool divide(int g, const number *left, number *moved, double size, int *pivot, number *room)
{
    double most = 0;
    memcpy(room, left, (size_t)(g * g) * sizeof *room);
    if (kmp_lu_complex_factor(g, room, pivot))
        return false;
    for (int k = 0; k < g; k++)
        most = fmax(most, cabs(room[k + k * g])); /* the factors have the entries divided by the pivots */
    for (int j = 0; j < g; j++) {
        for (int i = 0; i < g; i++)
            moved[i + j * g] = -moved[i + j * g];
        kmp_lu_complex_solve(g, room, pivot, moved + j * g);
    }
    return most * NEAR * size < 1;
}

/* The derivatives of a group by parameter k, into w->s. KEMPE_STOPPED: there are none. */
static kempe_status move_group(work *w, int g, number s, int k)
{
    const kmp_spectrum *sp = w->spectrum;
    for (int j = 0; j < g; j++) {
        double x = size_of(w, sp->x_re, sp->x_im, w->group[j]);
        lay_out(w, w->group[j], s);
        disturb(w, k);
        for (int i = 0; i < g; i++) {
            double y = size_of(w, sp->y_re, sp->y_im, w->group[i]);
            w->moved[i + j * g] = weigh(w, w->group[i]) / (x * y);
            w->left[i + j * g] = product(w, w->group[i], w->group[j], s) / (x * y);
        }
    }
    if (!divide(g, w->left, w->moved, 2 * cabs(s), w->pivot, w->room))
        return KEMPE_STOPPED;
    return kmp_eigen_complex(g, (double *)w->moved, (double *)w->s) ? KEMPE_E_MEMORY : KEMPE_OK;
}

/* The derivatives of a group, and of their conjugates. */
static void share(work *w, int g, int k, kempe_status status)
{
    kmp_mode_slopes *out = w->out;
    if (status == KEMPE_OK)
        qsort(w->s, (size_t)g, sizeof *w->s, compare);
    for (int j = 0; j < g; j++) {
        int i = w->group[j], other = kmp_spectrum_conjugate(w->spectrum, i);
        number x = status == KEMPE_OK ? w->s[j] : NAN + NAN * I;
        kmp_mode_kind kind = status != KEMPE_OK ? KMP_MODE_DEFECTIVE : g > 1 ? KMP_MODE_REPEATED : KMP_MODE_SIMPLE;
        out->kind[i] = out->kind[other] = kind;
        set(out, other, k, conj(x));
        set(out, i, k, w->spectrum->im[i] == 0 && g == 1 ? creal(x) : x);
    }
}

static kempe_status follow_all(work *w)
{
    const kmp_spectrum *sp = w->spectrum;
    for (int i = sp->zeros; i < sp->count; i++) {
        if (w->done[i] || sp->im[i] < 0)
            continue;
        /* Collects in `group` eigenvalue i and those equal to it up to the rounding of the solver. */
        double largest = 0;
        int g = 0;
        for (int k = 0; k < sp->count; k++)
            largest = fmax(largest, cabs(value_of(sp, k)));
        double near = NEAR * cabs(value_of(sp, i)) + 64 * sp->count * DBL_EPSILON * largest;
        for (int k = sp->zeros; k < sp->count; k++)
            if (cabs(value_of(sp, k) - value_of(sp, i)) <= near)
                w->group[g++] = k;
        number mean = 0;
        for (int j = 0; j < g; j++) {
            mean += value_of(sp, w->group[j]) / g;
            w->done[w->group[j]] = true;
        }
        for (int k = 0; k < w->out->count; k++) {
            kempe_status moved = move_group(w, g, mean, k);
            if (moved < 0)
                return moved;
            share(w, g, k, moved);
        }
    }
    return KEMPE_OK;
}

/* -- all eigenvalues --------------------------------------------------------------------------------- */

kempe_status kmp_mode_slopes_init(kmp_mode_slopes *slopes, kmp_linear *linear, kmp_second_derivatives *second,
                                  const kmp_state_sensitivity *shift, const kmp_spectrum *spectrum)
{
    int modes = spectrum->count, count = shift->count;
    *slopes = (kmp_mode_slopes){.modes = modes, .count = count};
    work w = {.linear = linear,
              .second = second,
              .shift = shift,
              .spectrum = spectrum,
              .out = slopes,
              .p = linear->p,
              .n = linear->n,
              .m = linear->m};
    bool ok = KMP_ARENA_MAKE(&slopes->arena, KMP_ROOM(double, modes *count, &slopes->re, &slopes->im),
                             KMP_ROOM(kmp_mode_kind, modes, &slopes->kind)) &&
              make_room(&w);
    for (int i = 0; ok && i < spectrum->zeros; i++) {
        slopes->kind[i] = KMP_MODE_ZERO;
        for (int k = 0; k < count; k++)
            set(slopes, i, k, NAN + NAN * I);
    }
    if (ok) {
        kmp_instant at = kmp_linear_instant(linear);
        kmp_formulas_place(&second->bent, &at);
        ok = follow_all(&w) == KEMPE_OK;
    }
    kmp_arena_free(&w.arena);
    if (ok)
        return KEMPE_OK;
    kmp_mode_slopes_free(slopes);
    return kmp_fail_memory(linear->system->context);
}

KMP_CLEARS(kmp_mode_slopes, slopes, kmp_arena_free(&slopes->arena))
