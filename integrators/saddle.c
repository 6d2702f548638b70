/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/memory.h"
#include "constraints/pressing.h"
#include "integrators/road.h"
#include "linalg/dense.h"
#include <math.h>
#include <string.h>

/* Beyond this size, and with fewer than one in so many places taken, sparse. */
enum { SPARSE_FROM = 48, SPARSE_BELOW = 8 };

/* Entries of the sparse matrix: M with both its triangles, then J and -J' by turns, then 1 for each row that is out. */
static int list_entries(const kmp_saddle *saddle, int *row, int *col)
{
    const kmp_pattern *mass = &saddle->plant->system->mass, *jac = &saddle->plant->system->jacobian;
    int count = 0, n = saddle->n;
    for (int k = 0; k < mass->count; k++)
        for (int side = 0; side < (mass->row[k] == mass->col[k] ? 1 : 2); side++, count++) {
            row[count] = side ? mass->col[k] : mass->row[k];
            col[count] = side ? mass->row[k] : mass->col[k];
        }
    for (int k = 0; k < jac->count; k++) {
        int at = saddle->position[jac->row[k]];
        for (int side = 0; at >= 0 && side < 2; side++, count++) {
            row[count] = side ? jac->col[k] : n + at;
            col[count] = side ? n + at : jac->col[k];
        }
    }
    for (int k = 0; saddle->out && k < saddle->r; k++, count++)
        row[count] = col[count] = n + k;
    return count;
}

/* false: no memory; a pattern that is singular shows when factored. */
static bool make_sparse(kmp_saddle *saddle, int most)
{
    unsigned long failures = kmp_memory_failures();
    int *row = KMP_NEW(int, most), *col = KMP_NEW(int, most);
    if (row && col)
        saddle->sparse = kmp_sparse_new(saddle->n + saddle->r, list_entries(saddle, row, col), row, col, true);
    kmp_free(row);
    kmp_free(col);
    return kmp_memory_failures() == failures;
}

static bool init(kmp_saddle *saddle, kmp_plant *plant, const kmp_partition *part, bool with_out)
{
    int size = part->n + part->r, entries = 2 * (plant->system->mass.count + plant->system->jacobian.count);
    *saddle = (kmp_saddle){.plant = plant, .part = part, .n = part->n, .r = part->r, .by_bodies = plant->by_bodies};
    if (saddle->by_bodies)
        size = part->r;
    saddle->large =
        with_out || (!saddle->by_bodies && size > SPARSE_FROM && entries < (long)size * size / SPARSE_BELOW);
    if (with_out) {
        entries += part->r;
        saddle->out = KMP_NEW(bool, part->r);
        if (!saddle->out)
            return false;
    }
    saddle->matrix = KMP_NEW(double, saddle->large ? entries : size *size);
    saddle->x = KMP_NEW(double, size);
    saddle->pivot = KMP_NEW(int, size);
    saddle->position = KMP_NEW(int, part->m);
    if (!saddle->matrix || !saddle->x || !saddle->pivot || !saddle->position)
        return false;
    for (int k = 0; k < part->m; k++)
        saddle->position[k] = -1;
    for (int k = 0; k < part->r; k++)
        saddle->position[part->rows[k]] = k;
    kmp_plant_drop(plant, part->m - part->r, part->redundant);
    return !saddle->large || make_sparse(saddle, entries);
}

bool kmp_saddle_init(kmp_saddle *saddle, kmp_plant *plant, const kmp_partition *part)
{
    return init(saddle, plant, part, false);
}

bool kmp_saddle_init_with_out(kmp_saddle *saddle, kmp_plant *plant, const kmp_partition *part)
{
    return init(saddle, plant, part, true);
}

void kmp_saddle_free(kmp_saddle *saddle)
{
    kmp_sparse_free(saddle->sparse);
    kmp_free(saddle->matrix);
    kmp_free(saddle->x);
    kmp_free(saddle->pivot);
    kmp_free(saddle->position);
    kmp_free(saddle->out);
    *saddle = (kmp_saddle){0};
}

static int factor_dense(kmp_saddle *saddle)
{
    const kmp_plant *plant = saddle->plant;
    const kmp_pattern *mass = &plant->system->mass, *jac = &plant->system->jacobian;
    int n = saddle->n, size = n + saddle->r;
    memset(saddle->matrix, 0, (size_t)(size * size) * sizeof(double));
    for (int k = 0; k < mass->count; k++)
        saddle->matrix[mass->row[k] + mass->col[k] * size] = saddle->matrix[mass->col[k] + mass->row[k] * size] =
            plant->mass[k];
    for (int k = 0; k < jac->count; k++) {
        int at = saddle->position[jac->row[k]];
        if (at < 0)
            continue;
        saddle->matrix[n + at + jac->col[k] * size] = plant->jacobian[k];
        saddle->matrix[jac->col[k] + (n + at) * size] = -plant->jacobian[k];
    }
    return kmp_lu_factor(size, saddle->matrix, saddle->pivot);
}

static bool is_out(const kmp_saddle *saddle, int k)
{
    return saddle->out && saddle->out[k];
}

static int factor_sparse(kmp_saddle *saddle)
{
    const kmp_plant *plant = saddle->plant;
    const kmp_pattern *mass = &plant->system->mass, *jac = &plant->system->jacobian;
    double *value = saddle->matrix;
    if (!saddle->sparse)
        return 1;
    for (int k = 0; k < mass->count; k++) {
        *value++ = plant->mass[k];
        if (mass->row[k] != mass->col[k])
            *value++ = plant->mass[k];
    }
    for (int k = 0; k < jac->count; k++) {
        int at = saddle->position[jac->row[k]];
        if (at < 0)
            continue;
        double entry = is_out(saddle, at) ? 0 : plant->jacobian[k];
        *value++ = entry;
        *value++ = -entry;
    }
    for (int k = 0; saddle->out && k < saddle->r; k++)
        *value++ = saddle->out[k] ? 1 : 0;
    return kmp_sparse_factor(saddle->sparse, saddle->matrix);
}

/* -- by articulated bodies ---------------------------------------------------------------------------- */

static int factor_mobility(kmp_saddle *saddle)
{
    const kmp_pattern *mobility = &saddle->plant->system->mobility;
    int r = saddle->r;
    memset(saddle->matrix, 0, (size_t)(r * r) * sizeof(double));
    for (int k = 0; k < mobility->count; k++) {
        int a = saddle->position[mobility->row[k]], b = saddle->position[mobility->col[k]];
        if (a >= 0 && b >= 0)
            saddle->matrix[(a > b ? a : b) + (a > b ? b : a) * r] = saddle->plant->mobility[k];
    }
    return kmp_cholesky_factor(r, saddle->matrix);
}

/* out += M^-1 J' x for the multipliers x (r) of the independent rows. */
static void add_compliance(const kmp_saddle *saddle, const double *x, double *out)
{
    const kmp_pattern *compliance = &saddle->plant->system->compliance;
    for (int k = 0; k < compliance->count; k++) {
        int at = saddle->position[compliance->row[k]];
        if (at >= 0)
            out[compliance->col[k]] += saddle->plant->compliance[k] * x[at];
    }
}

/* x (r) from what the rows lack (m), and the change of the coordinates by it added to `out`. */
static void answer(kmp_saddle *saddle, const double *rows, double *out)
{
    for (int k = 0; k < saddle->r; k++)
        saddle->x[k] = -rows[saddle->part->rows[k]];
    kmp_cholesky_solve(saddle->r, saddle->matrix, saddle->x);
    add_compliance(saddle, saddle->x, out);
}

/* -- all together -------------------------------------------------------------------------------------- */

int kmp_saddle_factor(kmp_saddle *saddle)
{
    saddle->factorizations++;
    if (saddle->by_bodies)
        return factor_mobility(saddle);
    return saddle->large ? factor_sparse(saddle) : factor_dense(saddle);
}

double kmp_saddle_operations(const kmp_saddle *saddle)
{
    return saddle->sparse ? kmp_sparse_operations(saddle->sparse) : 0;
}

/* x <- its solution */
static void solve(kmp_saddle *saddle)
{
    if (saddle->large)
        kmp_sparse_solve(saddle->sparse, 1, saddle->x);
    else
        kmp_lu_solve(saddle->n + saddle->r, saddle->matrix, saddle->pivot, 1, saddle->x);
}

/* Multipliers of the independent rows among all. */
static void spread(const kmp_saddle *saddle, const double *x, double *lambda)
{
    memset(lambda, 0, (size_t)saddle->plant->m * sizeof *lambda);
    for (int k = 0; k < saddle->r; k++)
        lambda[saddle->part->rows[k]] = x[k];
}

/* With M, for forces that depend on multipliers. */
static void multipliers(void *self, const double *bias, bool change, double *lambda)
{
    kmp_saddle *saddle = self;
    int n = saddle->n;
    for (int i = 0; i < n; i++)
        saddle->x[i] = -bias[i];
    for (int k = 0; k < saddle->r; k++)
        saddle->x[n + k] = change || is_out(saddle, k) ? 0 : -saddle->plant->jdqd[saddle->part->rows[k]];
    solve(saddle);
    spread(saddle, saddle->x + n, lambda);
}

void kmp_saddle_accelerations(kmp_saddle *saddle, double *qdd, double *lambda)
{
    kmp_plant *plant = saddle->plant;
    int n = saddle->n, r = saddle->r;
    const kmp_answer pressed = {saddle, multipliers};
    if (!kmp_press(plant, &pressed)) {
        for (int i = 0; i < n; i++)
            qdd[i] = NAN;
        for (int k = 0; lambda && k < plant->m; k++)
            lambda[k] = NAN;
        return;
    }
    if (saddle->by_bodies) {
        memcpy(qdd, plant->free_qdd, (size_t)n * sizeof *qdd);
        answer(saddle, plant->drift, qdd);
    } else {
        for (int i = 0; i < n; i++)
            saddle->x[i] = -plant->bias[i];
        for (int k = 0; k < r; k++)
            saddle->x[n + k] = is_out(saddle, k) ? 0 : -plant->jdqd[saddle->part->rows[k]];
        solve(saddle);
        memcpy(qdd, saddle->x, (size_t)n * sizeof *qdd);
    }
    if (lambda)
        spread(saddle, saddle->x + (saddle->by_bodies ? 0 : n), lambda);
}

void kmp_saddle_correction(kmp_saddle *saddle, const double *violation, double *dx)
{
    int n = saddle->n, r = saddle->r;
    if (saddle->by_bodies) {
        memset(dx, 0, (size_t)n * sizeof *dx);
        answer(saddle, violation, dx);
        return;
    }
    memset(saddle->x, 0, (size_t)n * sizeof *saddle->x);
    for (int k = 0; k < r; k++)
        saddle->x[n + k] = is_out(saddle, k) ? 0 : -violation[saddle->part->rows[k]];
    solve(saddle);
    memcpy(dx, saddle->x, (size_t)n * sizeof *dx);
}
