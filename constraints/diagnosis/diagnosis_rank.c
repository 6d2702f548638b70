/* SPDX-License-Identifier: BSD-3-Clause */
/* Redundant everywhere or singular only here: compares the rank at random configurations, found by moving along random
 * tangents. The members of each dependent set come from an echelon basis of the left null space of the scaled J. Rows
 * that may be left out are found by the rank of the remaining ones. */
#include "constraints/diagnosis/diagnosis_rank.h"
#include "constraints/closing/rounding.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/tolerances.h"
#include "model/data/closure.h"
#include <math.h>
#include <string.h>

#define MOST_WORK 2e8 /* multiplications */

const double *kmp_diagnosis_jacobian(const kmp_examination *x, int k)
{
    return x->jacobians + (size_t)k * (size_t)(x->system->m * x->system->n);
}

/* -- random configurations --------------------------------------------------------------------------- */

void kmp_diagnosis_points(kmp_examination *x)
{
    const kempe_system *s = x->system;
    size_t n = (size_t)s->n, size = (size_t)s->m * n;
    kmp_waypoint place[KMP_DOCTOR_POINTS + 1];
    double *q = KMP_ARENA_NEW(x->arena, double, s->n *(KMP_DOCTOR_POINTS + 2));
    x->jacobians = KMP_ARENA_NEW(x->arena, double, size *(KMP_DOCTOR_POINTS + 1));
    x->diagnosis->generic_rank = x->part->r;
    x->diagnosis->margin = 1;
    if (!q || !x->jacobians)
        return;
    memcpy(q, x->q, n * sizeof *q);
    int count = s->m > 0 ? kmp_rounding_waypoints(x->walk, NULL, KMP_DOCTOR_POINTS + 1, INFINITY, q, place) : 1;
    for (int k = 0; k < count; k++) {
        kmp_walk_evaluate(x->walk, q + (size_t)k * n);
        memcpy(x->jacobians + (size_t)k * size, x->walk->jacobian, size * sizeof *x->jacobians);
    }
    x->point_count = count - 1;
    /* The largest rank, and the margin of the last row here. */
    kmp_walk *w = x->walk;
    kmp_diagnosis *d = x->diagnosis;
    double most = 0;
    for (int k = 1; k <= x->point_count; k++) {
        memcpy(w->copy, kmp_diagnosis_jacobian(x, k), (size_t)(w->m * w->n) * sizeof *w->copy);
        int rank = kmp_walk_null_space(w, w->m, w->n, kmp_rounding_zero(x->system, KMP_RANK), w->n);
        most = rank > d->generic_rank ? w->last : rank == d->generic_rank ? fmax(most, w->last) : most;
        d->generic_rank = rank > d->generic_rank ? rank : d->generic_rank;
    }
    d->moved = x->point_count > 0;
    if (d->generic_rank > x->part->r)
        d->margin = 0;
    else if (most > 0)
        d->margin = fmin(1, x->part->pivots[x->part->r - 1] / most);
}

/* -- dependent sets ---------------------------------------------------------------------------------- */

/* Rank of some rows of Jacobian k; with rows NULL the left null space of all rows in walk->basis. Rounding relative to
 * the largest entry of all rows counts as zero, so that a row of only rounding has no rank. */
static int rank_of_rows(const kmp_examination *x, int k, const int *rows, int count, double tolerance)
{
    kmp_walk *w = x->walk;
    const double *jacobian = kmp_diagnosis_jacobian(x, k);
    double whole = 0;
    for (int e = 0; e < w->m * w->n; e++)
        whole = fmax(whole, fabs(jacobian[e]));
    for (int r = 0; r < count; r++)
        for (int c = 0; c < w->n; c++) {
            double entry = jacobian[(rows ? rows[r] : r) + c * w->m];
            w->copy[c + r * w->n] = fabs(entry) > tolerance * whole ? entry : 0;
        }
    return kmp_walk_null_space(w, w->n, count, tolerance, count);
}

static bool dependent_everywhere(const kmp_examination *x, const int *rows, int count)
{
    for (int k = 1; k <= x->point_count; k++)
        if (rank_of_rows(x, k, rows, count, kmp_rounding_zero(x->system, KMP_RANK)) == count)
            return false;
    return true;
}

static void keep_set(kmp_examination *x, const double *member, kmp_dependent *set)
{
    int m = x->system->m;
    double most = 0;
    set->rows = KMP_ARENA_NEW(x->arena, int, m);
    for (int r = 0; r < m; r++)
        most = fmax(most, fabs(member[r]));
    for (int r = 0; set->rows && r < m; r++)
        if (fabs(member[r]) > kmp_rounding_zero(x->system, KMP_RANK_MEMBER) * most)
            set->rows[set->count++] = r;
}

/* Adds up to `most` dependent sets of Jacobian k, from an echelon basis. */
static void add_sets(kmp_examination *x, int k, int most, double tolerance)
{
    kmp_diagnosis *d = x->diagnosis;
    int m = x->system->m, count = m - rank_of_rows(x, k, NULL, m, tolerance);
    kmp_dependent *found = KMP_ARENA_NEW(x->arena, kmp_dependent, count);
    for (int i = 0; found && i < count; i++)
        keep_set(x, x->walk->basis + i * m, &found[i]);
    for (int i = 0; found && !x->arena->failed && i < count && most > 0; i++) {
        found[i].always = dependent_everywhere(x, found[i].rows, found[i].count);
        if (k == 0 && x->point_count > 0 && found[i].always)
            continue; /* already listed */
        d->sets[d->set_count++] = found[i];
        most--;
    }
}

/* Sets that are dependent everywhere come from a random configuration: here coefficients may vanish by chance. */
void kmp_diagnosis_dependents(kmp_examination *x)
{
    kmp_diagnosis *d = x->diagnosis;
    int m = x->system->m, all = m - x->part->r, always = m - d->generic_rank;
    d->sets = KMP_ARENA_NEW(x->arena, kmp_dependent, all);
    if (all == 0 || !d->sets)
        return;
    if (x->point_count > 0)
        add_sets(x, x->point_count, always, kmp_rounding_zero(x->system, KMP_RANK));
    add_sets(x, 0, all - d->set_count, kmp_rounding_zero(x->system, KMP_RANK));
    if (x->arena->failed)
        return;
    /* Sorts sets by first row; sets that are dependent everywhere are already first. */
    kmp_dependent *sets = d->sets;
    for (int i = 1; i < d->set_count; i++) {
        kmp_dependent moved = sets[i];
        int k = i;
        for (; k > 0 && moved.always == sets[k - 1].always && moved.rows[0] < sets[k - 1].rows[0]; k--)
            sets[k] = sets[k - 1];
        sets[k] = moved;
    }
    /* The rows of all sets. */
    d->shared_rows = KMP_ARENA_NEW(x->arena, int, x->system->m);
    for (int r = 0; d->shared_rows && r < x->system->m; r++) {
        bool shared = false;
        for (int k = 0; k < d->set_count; k++)
            for (int i = 0; i < d->sets[k].count; i++)
                shared = shared || d->sets[k].rows[i] == r;
        if (shared)
            d->shared_rows[d->shared_count++] = r;
    }
}

/* -- repairs ----------------------------------------------------------------------------------------- */

/* True if the rank without the rows of `out` equals the rank of all rows. Tested at two random configurations (here, if
 * there are none): a necessary row is necessary at almost every one. */
static bool rank_stays(const kmp_examination *x, const bool *out, int *rows)
{
    int count = 0, first = x->point_count > 0 ? x->point_count : 0, last = first > 1 ? first - 1 : first;
    for (int r = 0; r < x->system->m; r++)
        if (!out[r])
            rows[count++] = r;
    if (count < x->diagnosis->generic_rank)
        return false;
    for (int k = first; k >= last; k--)
        if (rank_of_rows(x, k, rows, count, kmp_rounding_zero(x->system, KMP_RANK)) < x->diagnosis->generic_rank)
            return false;
    return true;
}

/* Leaves out the rows of a closure one after the other while the others determine them. Rows form a matroid: any order
 * finds the same number. */
static void try_closure(kmp_examination *x, int closure, bool *out, int *rows, kmp_repair *repair)
{
    int m = x->system->m;
    *repair = (kmp_repair){.closure = closure, .rows = KMP_ARENA_NEW(x->arena, int, m)};
    memset(out, 0, (size_t)m * sizeof *out);
    for (int r = m - 1; repair->rows && r >= 0; r--) {
        if (x->system->rows[r].closure != closure)
            continue;
        repair->of++;
        out[r] = true;
        out[r] = rank_stays(x, out, rows);
    }
    for (int r = 0; repair->rows && r < m; r++)
        if (out[r])
            repair->rows[repair->count++] = r;
}

void kmp_diagnosis_repairs(kmp_examination *x)
{
    kmp_diagnosis *d = x->diagnosis;
    int closures = kmp_model_closure_count(x->system->model);
    double m = x->system->m, cost = 2 * d->shared_count * m * x->system->n * d->generic_rank;
    if (d->generic_rank == x->system->m)
        return;
    d->repairs_skipped = cost > MOST_WORK;
    if (d->repairs_skipped)
        return;
    d->repairs = KMP_ARENA_NEW(x->arena, kmp_repair, closures);
    bool *out = KMP_ARENA_NEW(x->arena, bool, x->system->m);
    int *rows = KMP_ARENA_NEW(x->arena, int, x->system->m);
    for (int c = 0; c < closures && d->repairs && out && rows; c++) {
        bool member = false;
        for (int k = 0; k < d->shared_count; k++)
            member = member || x->system->rows[d->shared_rows[k]].closure == c;
        if (!member)
            continue;
        try_closure(x, c, out, rows, &d->repairs[d->repair_count]);
        d->repair_count += d->repairs[d->repair_count].count > 0;
    }
}

/* -- the second order ---------------------------------------------------------------------------------- */

/* The second-order test. A first-order motion qd continues only if J qdd + gamma(qd) = 0 has a solution qdd. This
 * requires w' gamma(qd) = 0 for every w of the left null space of J: quadratic conditions on the tangent space. Without
 * a binding condition the motion is finite. Without a common zero the mechanism is infinitesimally mobile. For two
 * directions the common zeros are the branches that cross here. */

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

static bool prepare(kmp_examination *x, int rank, quadratic *f)
{
    kmp_walk *w = x->walk;
    int n = w->n, m = w->m;
    kmp_walk_evaluate(w, x->q);
    f->d = n - kmp_walk_tangents(w, rank);
    f->pairs = f->d * (f->d + 1) / 2;
    if (!KMP_ARENA_MAKE(x->arena, KMP_ROOM(double, n * f->d, &f->tangent), KMP_ROOM(double, n, &f->qd),
                        KMP_ROOM(double, m, &f->gamma0), KMP_ROOM(double, m * f->pairs, &f->gamma)))
        return false;
    memcpy(f->tangent, w->basis, (size_t)(n * f->d) * sizeof *f->tangent);
    f->l = m - kmp_walk_left(w, kmp_rounding_zero(x->system, KMP_RANK), rank);
    f->left = KMP_ARENA_NEW(x->arena, double, m * f->l);
    f->form = KMP_ARENA_NEW(x->arena, double, f->l * f->pairs);
    if (!x->arena->failed)
        memcpy(f->left, w->basis, (size_t)(m * f->l) * sizeof *f->left);
    return !x->arena->failed;
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

void kmp_diagnosis_second_order(kmp_examination *x)
{
    quadratic f = {0};
    kmp_diagnosis *d = x->diagnosis;
    /* Rank of J here. For a mechanism that does not move, pivots due only to rounding do not count: closing an
     * infinitesimally mobile one reaches only the root of rounding. */
    int rank = x->part->r;
    while (!d->moved && rank > 0 && x->part->pivots[rank - 1] < KMP_RANK_SHAKY * x->part->pivots[0])
        rank--;
    bool extra = rank < d->generic_rank, stuck = !d->moved && rank < x->part->n;
    if (x->part->m == rank || !(extra || stuck) || !prepare(x, rank, &f))
        return;
    kmp_eval_mass(x->walk->eval);
    gamma_of(x, f.qd, NULL, &f, f.gamma0); /* d and gamma0 are both zero here */
    polarise(x, &f);
    contract(x, &f);
    int first = -1; /* of the conditions that bind */
    for (int l = f.l - 1; l >= 0; l--)
        if (binds(&f, l)) {
            first = l;
            d->conditions++;
        }
    if (first < 0)
        d->second = KMP_SECOND_REAL;
    else if (f.d == 1)
        d->second = KMP_SECOND_NONE;
    else if (f.d > 2)
        d->second = KMP_SECOND_CONDITIONS;
    else {
        d->branches = common_zeros(&f, first);
        d->second = d->branches ? KMP_SECOND_BRANCHES : KMP_SECOND_NONE;
    }
}
