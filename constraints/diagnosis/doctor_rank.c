/* SPDX-License-Identifier: BSD-3-Clause */
/* Redundant everywhere or singular only here: compares the rank at random configurations, found by moving along random
 * tangents. The members of each dependent set come from an echelon basis of the left null space of the scaled J. Rows
 * that may be left out are found by the rank of the remaining ones. */
#include "base/memory.h"
#include "constraints/diagnosis/doctor.h"
#include "constraints/rounding/rounding.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

#define MOST_WORK 2e8 /* multiplications */

const double *kmp_doctor_jacobian(const kmp_examination *x, int k)
{
    return x->jacobians + (size_t)k * (size_t)(x->system->m * x->system->n);
}

/* -- random configurations --------------------------------------------------------------------------- */

/* Finds the largest rank, and the margin of the last row here. */
static void compare_ranks(kmp_examination *x)
{
    kmp_walk *w = x->walk;
    kmp_doctor *d = x->doctor;
    double most = 0;
    for (int k = 1; k <= x->point_count; k++) {
        memcpy(w->copy, kmp_doctor_jacobian(x, k), (size_t)(w->m * w->n) * sizeof *w->copy);
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

void kmp_doctor_points(kmp_examination *x)
{
    const kempe_system *s = x->system;
    size_t n = (size_t)s->n, size = (size_t)s->m * n;
    kmp_waypoint place[KMP_DOCTOR_POINTS + 1];
    double *q = KMP_ARENA_NEW(x->arena, double, s->n *(KMP_DOCTOR_POINTS + 2));
    x->jacobians = KMP_ARENA_NEW(x->arena, double, size *(KMP_DOCTOR_POINTS + 1));
    x->doctor->generic_rank = x->part->r;
    x->doctor->margin = 1;
    if (!q || !x->jacobians)
        return;
    memcpy(q, x->q, n * sizeof *q);
    int count = s->m > 0 ? kmp_rounding_waypoints(x->walk, NULL, KMP_DOCTOR_POINTS + 1, q, place) : 1;
    for (int k = 0; k < count; k++) {
        kmp_walk_evaluate(x->walk, q + (size_t)k * n);
        memcpy(x->jacobians + (size_t)k * size, x->walk->jacobian, size * sizeof *x->jacobians);
    }
    x->point_count = count - 1;
    compare_ranks(x);
}

/* -- dependent sets ---------------------------------------------------------------------------------- */

/* Rank of some rows of Jacobian k; with rows NULL the left null space of all rows in walk->basis. Rounding relative to
 * the largest entry of all rows counts as zero, so that a row of rounding alone has no rank. */
static int rank_of_rows(const kmp_examination *x, int k, const int *rows, int count, double tolerance)
{
    kmp_walk *w = x->walk;
    const double *jacobian = kmp_doctor_jacobian(x, k);
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

static void collect_shared(kmp_examination *x)
{
    kmp_doctor *d = x->doctor;
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

/* Adds up to `most` dependent sets of Jacobian k, from an echelon basis. */
static void add_sets(kmp_examination *x, int k, int most, double tolerance)
{
    kmp_doctor *d = x->doctor;
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

/* Sorts sets by first row; sets that are dependent everywhere are already first. */
static void sort_sets(kmp_dependent *sets, int count)
{
    for (int i = 1; i < count; i++) {
        kmp_dependent moved = sets[i];
        int k = i;
        for (; k > 0 && moved.always == sets[k - 1].always && moved.rows[0] < sets[k - 1].rows[0]; k--)
            sets[k] = sets[k - 1];
        sets[k] = moved;
    }
}

/* Sets that are dependent everywhere come from a random configuration: here coefficients may vanish by chance. */
void kmp_doctor_dependents(kmp_examination *x)
{
    kmp_doctor *d = x->doctor;
    int m = x->system->m, all = m - x->part->r, always = m - d->generic_rank;
    d->sets = KMP_ARENA_NEW(x->arena, kmp_dependent, all);
    if (all == 0 || !d->sets)
        return;
    if (x->point_count > 0)
        add_sets(x, x->point_count, always, kmp_rounding_zero(x->system, KMP_RANK));
    add_sets(x, 0, all - d->set_count, kmp_rounding_zero(x->system, KMP_RANK));
    if (x->arena->failed)
        return;
    sort_sets(d->sets, d->set_count);
    collect_shared(x);
}

/* -- repairs ----------------------------------------------------------------------------------------- */

/* True if the rank without the rows of `out` is that of all rows. Tested at two random configurations (here, if there
 * are none): a necessary row is necessary at almost every one. */
static bool rank_stays(const kmp_examination *x, const bool *out, int *rows)
{
    int count = 0, first = x->point_count > 0 ? x->point_count : 0, last = first > 1 ? first - 1 : first;
    for (int r = 0; r < x->system->m; r++)
        if (!out[r])
            rows[count++] = r;
    if (count < x->doctor->generic_rank)
        return false;
    for (int k = first; k >= last; k--)
        if (rank_of_rows(x, k, rows, count, kmp_rounding_zero(x->system, KMP_RANK)) < x->doctor->generic_rank)
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

void kmp_doctor_repairs(kmp_examination *x)
{
    kmp_doctor *d = x->doctor;
    int closures = x->system->model->closure_count;
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
