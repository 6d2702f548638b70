/* SPDX-License-Identifier: BSD-3-Clause */
/* The second-order test. A first-order motion qd continues only if J qdd + gamma(qd) = 0 has a solution qdd. This
 * requires w' gamma(qd) = 0 for every w of the left null space of J: quadratic conditions on the tangent space. Without
 * a binding condition the motion is finite. Without a common zero the mechanism is infinitesimally mobile. For two
 * directions the common zeros are the branches that cross here. */
#include "base/memory.h"
#include "constraints/diagnosis/doctor.h"
#include "constraints/rounding/rounding.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

typedef struct quadratic {
    double *tangent; /* n x d */
    double *left;    /* m x l */
    double *qd;      /* n */
    double *gamma0;  /* m: gamma at rest */
    double *gamma;   /* m x d(d+1)/2, polarised: for the pairs (i, k), k <= i */
    double *form;    /* l x d(d+1)/2 */
    int d, l, pairs;
} quadratic;

static void gamma_of(const kmp_examination *x, const double *a, const double *b, quadratic *f, double *out)
{
    const kempe_system *s = x->system;
    for (int k = 0; k < s->n; k++)
        f->qd[k] = (a[k] + (b ? b[k] : 0)) * s->scale[k];
    kmp_eval_bias(x->walk->eval, f->qd);
    for (int r = 0; r < s->m; r++)
        out[r] = x->walk->eval->jdqd[r] / s->row_scale[r] - f->gamma0[r];
}

/* gamma(e_i, e_k) = (gamma(e_i + e_k) - gamma(e_i) - gamma(e_k)) / 2. */
static void polarise(const kmp_examination *x, quadratic *f)
{
    int m = x->system->m, n = x->system->n;
    for (int i = 0, at = 0; i < f->d; i++)
        for (int k = 0; k <= i; k++, at++)
            gamma_of(x, f->tangent + i * n, i == k ? NULL : f->tangent + k * n, f, f->gamma + at * m);
    for (int i = f->d - 1; i >= 0; i--)
        for (int k = 0; k < i; k++) {
            double *mixed = f->gamma + (i * (i + 1) / 2 + k) * m;
            const double *one = f->gamma + (i * (i + 1) / 2 + i) * m, *two = f->gamma + (k * (k + 1) / 2 + k) * m;
            for (int r = 0; r < m; r++)
                mixed[r] = (mixed[r] - one[r] - two[r]) / 2;
        }
}

static void contract(const kmp_examination *x, quadratic *f)
{
    int m = x->system->m;
    for (int p = 0; p < f->pairs; p++)
        for (int l = 0; l < f->l; l++) {
            double sum = 0, size = 0;
            for (int r = 0; r < m; r++) {
                sum += f->left[r + l * m] * f->gamma[r + p * m];
                size += f->left[r + l * m] * f->left[r + l * m];
            }
            f->form[l + p * f->l] = sum / sqrt(size);
        }
}

static bool binds(const quadratic *f, int l)
{
    for (int p = 0; p < f->pairs; p++)
        if (fabs(f->form[l + p * f->l]) > KMP_RANK_SECOND)
            return true;
    return false;
}

static double value(const quadratic *f, int l, double c, double s)
{
    const double *form = f->form + l;
    return form[0] * c * c + 2 * form[f->l] * c * s + form[2 * f->l] * s * s;
}

/* Common zeros of all conditions over the directions cos a e_1 + sin a e_2: zeros of the first condition, tested in the
 * others. a c^2 + 2 b c s + d s^2 = m + r cos(2 angle - phase). */
static int common_zeros(const quadratic *f, int first)
{
    double a = f->form[first], b = f->form[first + f->l], d = f->form[first + 2 * f->l];
    double mean = (a + d) / 2, radius = hypot((a - d) / 2, b), phase = atan2(b, (a - d) / 2);
    int found = 0;
    if (fabs(mean) > radius + KMP_RANK_SECOND)
        return 0;
    double half = acos(fmax(-1, fmin(1, -mean / radius)));
    for (int sign = -1; sign <= 1; sign += 2) {
        double angle = (phase + sign * half) / 2;
        bool all = true;
        for (int l = 0; l < f->l; l++)
            all = all && fabs(value(f, l, cos(angle), sin(angle))) <= sqrt(KMP_RANK_SECOND);
        found += all && (sign < 0 || half > sqrt(KMP_RANK_SECOND)); /* a double zero counts once */
    }
    return found;
}

static void judge(kmp_doctor *doctor, const quadratic *f)
{
    int first = -1;
    for (int l = f->l - 1; l >= 0; l--)
        if (binds(f, l)) {
            first = l;
            doctor->conditions++;
        }
    if (first < 0)
        doctor->second = KMP_SECOND_REAL;
    else if (f->d == 1)
        doctor->second = KMP_SECOND_NONE;
    else if (f->d > 2)
        doctor->second = KMP_SECOND_CONDITIONS;
    else {
        doctor->branches = common_zeros(f, first);
        doctor->second = doctor->branches ? KMP_SECOND_BRANCHES : KMP_SECOND_NONE;
    }
}

/* Rank of J here. For a mechanism that does not move, pivots due to rounding alone do not count: closing an
 * infinitesimally mobile one reaches only the root of rounding. */
static int rank_here(const kmp_examination *x)
{
    const kmp_partition *part = x->part;
    int r = part->r;
    while (!x->doctor->moved && r > 0 && part->pivots[r - 1] < KMP_RANK_SHAKY * part->pivots[0])
        r--;
    return r;
}

static bool prepare(kmp_examination *x, int rank, quadratic *f)
{
    kmp_walk *w = x->walk;
    int n = w->n, m = w->m;
    kmp_walk_evaluate(w, x->q);
    f->d = n - kmp_walk_tangents(w, rank);
    f->pairs = f->d * (f->d + 1) / 2;
    f->tangent = KMP_ARENA_NEW(x->arena, double, n * f->d);
    f->qd = KMP_ARENA_NEW(x->arena, double, n);
    f->gamma0 = KMP_ARENA_NEW(x->arena, double, m);
    f->gamma = KMP_ARENA_NEW(x->arena, double, m * f->pairs);
    if (x->arena->failed)
        return false;
    memcpy(f->tangent, w->basis, (size_t)(n * f->d) * sizeof *f->tangent);
    f->l = m - kmp_walk_left(w, kmp_rounding_zero(x->system, KMP_RANK), rank);
    f->left = KMP_ARENA_NEW(x->arena, double, m * f->l);
    f->form = KMP_ARENA_NEW(x->arena, double, f->l * f->pairs);
    if (!x->arena->failed)
        memcpy(f->left, w->basis, (size_t)(m * f->l) * sizeof *f->left);
    return !x->arena->failed;
}

void kmp_doctor_second_order(kmp_examination *x)
{
    quadratic f = {0};
    const kmp_doctor *d = x->doctor;
    int rank = rank_here(x);
    bool extra = rank < d->generic_rank, stuck = !d->moved && rank < x->part->n;
    if (x->part->m == rank || !(extra || stuck) || !prepare(x, rank, &f))
        return;
    kmp_eval_mass(x->walk->eval);
    gamma_of(x, f.qd, NULL, &f, f.gamma0); /* d and gamma0 are both zero here */
    polarise(x, &f);
    contract(x, &f);
    judge(x->doctor, &f);
}
