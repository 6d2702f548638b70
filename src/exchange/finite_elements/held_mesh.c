/* SPDX-License-Identifier: BSD-3-Clause */
/* Slowest modes by the block Lanczos method on K^-1 M, orthogonalised in full in the inner product of M (Parlett, The
 * Symmetric Eigenvalue Problem, 1998, chapter 13): the block is larger than the number of modes, so that none of
 * several equal ones is missed, however many there are. */
#include "exchange/finite_elements/held_mesh.h"
#include "base/memory.h"
#include "exchange/finite_elements/sparse_definite.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/lapack.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* Residual of a mode over its value of K^-1 M: values are then known to the square of this. */
static const double CONVERGED = 1e-10;

/* The energy of the slowest mode over the sum of its parts: below it the energy is rounding. Slender bodies of a
 * thousand elements' lengths have 1e-12. */
static const double SINGULAR = 1e-14;

/* A vector of which others leave less is made up by them, but for rounding. */
static const double DEPENDENT = 1e-10;

/* Vectors of the Lanczos basis: this number, and this number for each mode; the modes of solids take a third of them.
 */
enum { BASIS = 60, BASIS_EACH = 12, MORE_IN_BLOCK = 4 };

struct kmp_held_mesh {
    const kmp_finite_mesh *mesh;
    kmp_arena arena;
    int count;           /* of displacements that remain */
    int *free;           /* their places among all */
    int *at;             /* 3 node_count: the number among them, -1: held */
    double *own;         /* 3 node_count: work, zero at held nodes */
    double *load, *work; /* 3 node_count */
    kmp_sparse_definite *factors;
};

void kmp_mesh_load(const kmp_finite_mesh *mesh, const double *u, double *y)
{
    const kmp_mesh_rows *k = &mesh->stiffness;
    for (int i = 0; i < k->n; i++) {
        y[i] = 0;
        for (int e = k->start[i]; e < k->start[i + 1]; e++)
            y[i] += k->value[e] * u[k->col[e]];
    }
}

/* y = M x of the displacements that remain: nodes are held as wholes. */
static void apply_mass(const kmp_held_mesh *h, const double *x, double *y)
{
    const kmp_mesh_rows *m = &h->mesh->mass;
    for (int f = 0; f < h->count; f++)
        h->own[h->free[f]] = x[f];
    for (int f = 0; f < h->count; f += 3) {
        const int i = h->free[f] / 3;
        double sum[3] = {0};
        for (int e = m->start[i]; e < m->start[i + 1]; e++)
            for (int a = 0; a < 3; a++)
                sum[a] += m->value[e] * h->own[3 * (ptrdiff_t)m->col[e] + a];
        for (int a = 0; a < 3; a++)
            y[f + a] = sum[a];
    }
}

/* -- factors ----------------------------------------------------------------------------------------- */

static kempe_status factor(kmp_held_mesh *h)
{
    const kmp_mesh_rows *k = &h->mesh->stiffness;
    kmp_arena room = {0};
    int *row, *col, count = 0;
    double *value;
    const int most = k->start[k->n];
    kmp_sparse_outcome outcome = KMP_SPARSE_NO_MEMORY;
    if (KMP_ARENA_MAKE(&room, KMP_ROOM(int, most, &row, &col), KMP_ROOM(double, most, &value))) {
        for (int f = 0; f < h->count; f++)
            for (int e = k->start[h->free[f]]; e < k->start[h->free[f] + 1]; e++)
                if (h->at[k->col[e]] >= 0) {
                    row[count] = f;
                    col[count] = h->at[k->col[e]];
                    value[count++] = k->value[e];
                }
        outcome = kmp_sparse_definite_new(h->count, count, row, col, value, &h->factors);
    }
    kmp_arena_free(&room);
    if (outcome == KMP_SPARSE_NO_MEMORY)
        return kmp_fail_memory(h->mesh->context);
    return outcome == KMP_SPARSE_FACTORED
               ? KEMPE_OK
               : kmp_mesh_refuse(h->mesh, "with its interfaces held a part of the mesh moves without stiffness: the "
                                          "matrix is singular");
}

static kempe_status make(kmp_held_mesh *h, int count, const kmp_interface *interfaces)
{
    const kmp_finite_mesh *mesh = h->mesh;
    const int n = 3 * mesh->node_count;
    if (!KMP_ARENA_MAKE(&h->arena, KMP_ROOM(int, n, &h->free, &h->at),
                        KMP_ROOM(double, n, &h->own, &h->load, &h->work)))
        return kmp_fail_memory(mesh->context);
    for (int p = 0; p < count; p++)
        for (int k = 0; k < interfaces[p].count; k++)
            for (int a = 0; a < 3; a++)
                h->at[3 * interfaces[p].nodes[k] + a] = -1;
    for (int i = 0; i < n; i++)
        if (h->at[i] == 0) {
            h->at[i] = h->count;
            h->free[h->count++] = i;
        }
    if (h->count == 0)
        return kmp_mesh_refuse(mesh, "all its nodes are in interfaces, and none is left to deform");
    return factor(h);
}

kempe_status kmp_held_mesh_new(const kmp_finite_mesh *mesh, int count, const kmp_interface *interfaces,
                               kmp_held_mesh **held)
{
    KMP_MAKE(mesh->context, kmp_held_mesh, h);
    h->mesh = mesh;
    kempe_status status = make(h, count, interfaces);
    return KMP_GIVE_OR_FREE(status, held, h, kmp_held_mesh_free);
}

KMP_FREES(kmp_held_mesh, held, kmp_sparse_definite_free(held->factors), kmp_arena_free(&held->arena))

const char *kmp_held_mesh_library(const kmp_held_mesh *held)
{
    return kmp_sparse_definite_library(held->factors);
}

int kmp_held_mesh_count(const kmp_held_mesh *held)
{
    return held->count;
}

kempe_status kmp_held_mesh_settle(kmp_held_mesh *h, double *u)
{
    for (int f = 0; f < h->count; f++)
        u[h->free[f]] = 0;
    kmp_mesh_load(h->mesh, u, h->load);
    for (int f = 0; f < h->count; f++)
        h->work[f] = -h->load[h->free[f]];
    if (!kmp_sparse_definite_solve(h->factors, 1, h->work))
        return kmp_fail_memory(h->mesh->context);
    for (int f = 0; f < h->count; f++)
        u[h->free[f]] = h->work[f];
    return KEMPE_OK;
}

/* -- modes ------------------------------------------------------------------------------------------- */

/* A basis of the Krylov space, and K^-1 M in it. */
typedef struct krylov {
    kmp_held_mesh *h;
    kmp_arena arena;
    int most, count, applied; /* vectors; the vectors whose product with K^-1 M is known */
    int width;                /* of a block */
    double **v;
    double *product;  /* most x most: entry (i, j) of V' M K^-1 M V at i + most j */
    double *lost;     /* of each product, what had no room in the basis */
    double *w, *mass; /* work */
    double *block;    /* width vectors */
    uint64_t random;
} krylov;

/* Adds what is left of w without the basis, of unit mass, and its parts along the basis to `column` (NULL: nowhere);
 * *lost: what is left where the basis is full. False: no memory. */
static bool add_vector(krylov *k, double *column, double *lost)
{
    const int n = k->h->count;
    apply_mass(k->h, k->w, k->mass);
    const double before = sqrt(fmax(kmp_dot(n, k->w, k->mass), 0));
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < k->count; i++) {
            const double part = kmp_dot(n, k->v[i], k->mass);
            for (int f = 0; f < n; f++)
                k->w[f] -= part * k->v[i][f];
            if (column)
                column[i] += part;
        }
        apply_mass(k->h, k->w, k->mass);
    }
    const double left = sqrt(fmax(kmp_dot(n, k->w, k->mass), 0));
    if (!(left > DEPENDENT * before))
        return true;
    if (k->count == k->most) {
        *lost = left;
        return true;
    }
    double *own = kmp_arena_alloc(&k->arena, (size_t)n, sizeof *own);
    if (!own)
        return false;
    for (int f = 0; f < n; f++)
        own[f] = k->w[f] / left;
    if (column)
        column[k->count] = left;
    k->v[k->count++] = own;
    return true;
}

/* The block: K^-1 M of `count` vectors that are in it. */
static bool apply(krylov *k, int count)
{
    const ptrdiff_t n = k->h->count;
    for (int c = 0; c < count; c++) {
        apply_mass(k->h, k->block + n * c, k->mass);
        memcpy(k->block + n * c, k->mass, (size_t)n * sizeof *k->mass);
    }
    return kmp_sparse_definite_solve(k->h->factors, count, k->block);
}

static void take_of_block(krylov *k, int c)
{
    const ptrdiff_t n = k->h->count;
    memcpy(k->w, k->block + n * c, (size_t)n * sizeof *k->w);
}

/* `count` vectors of random displacements, as K^-1 M takes them. The same numbers at each call of the program. */
static bool add_random(krylov *k, int count)
{
    double lost; /* there is room, or the space is whole */
    for (ptrdiff_t f = 0; f < (ptrdiff_t)k->h->count * count; f++) {
        k->random = k->random * 6364136223846793005u + 1442695040888963407u; /* Knuth's MMIX generator */
        k->block[f] = (double)(k->random >> 11) / 9007199254740992.0 - 0.5;
    }
    bool good = apply(k, count);
    for (int c = 0; c < count && good; c++) {
        take_of_block(k, c);
        good = add_vector(k, NULL, &lost);
    }
    return good;
}

/* Products of the vectors that have none yet, a block at most, which add further ones. */
static kempe_status extend(krylov *k, int wanted)
{
    kempe_context *context = k->h->mesh->context;
    const ptrdiff_t n = k->h->count;
    const int new = k->count - k->applied, count = new < k->width ? new : k->width, end = k->count;
    if (kmp_interrupted(context))
        return KEMPE_STOPPED;
    kmp_progress(context, KMP_PROGRESS_STUDY, k->applied, 5.0 * (wanted + MORE_IN_BLOCK), "vectors");
    for (int c = 0; c < count; c++)
        memcpy(k->block + n * c, k->v[k->applied + c], (size_t)n * sizeof *k->block);
    bool good = apply(k, count);
    for (int c = 0; c < count && good; c++, k->applied++) {
        take_of_block(k, c);
        good = add_vector(k, k->product + (ptrdiff_t)k->most * k->applied, &k->lost[k->applied]);
    }
    if (!good)
        return kmp_fail_memory(context);
    for (int tries = 0; k->count == end && k->applied == end && k->count < k->most && tries < 3; tries++)
        if (!add_random(k, 1)) /* the space is closed under K^-1 M */
            return kmp_fail_memory(context);
    return KEMPE_OK;
}

/* Ritz values of K^-1 M, descending, with their vectors in the basis, column by column. *converged: the first `wanted`
 * ones are. False: no memory. */
static bool ritz(const krylov *k, int wanted, double *theta, double *y, bool *converged)
{
    const int m = k->applied;
    for (int j = 0; j < m; j++)
        for (int i = 0; i < m; i++)
            y[i + m * j] = -(k->product[i + (ptrdiff_t)k->most * j] + k->product[j + (ptrdiff_t)k->most * i]) / 2;
    if (kmp_symmetric_eigen(m, y, theta) != 0)
        return false;
    for (int j = 0; j < m; j++)
        theta[j] = -theta[j];
    *converged = m >= wanted;
    for (int j = 0; j < wanted && *converged; j++) {
        double residual = 0, lost = 0;
        for (int l = 0; l < m; l++)
            lost += fabs(k->lost[l] * y[l + m * j]);
        for (int i = m; i < k->count; i++) {
            double row = 0;
            for (int l = 0; l < m; l++)
                row += k->product[i + (ptrdiff_t)k->most * l] * y[l + m * j];
            residual += row * row;
        }
        *converged = sqrt(residual) + lost <= CONVERGED * fabs(theta[j]) + m * DBL_EPSILON * theta[0];
    }
    return true;
}

static kempe_status search(krylov *k, int wanted, double *theta, double *y)
{
    const kmp_held_mesh *h = k->h;
    if (!add_random(k, k->width))
        return kmp_fail_memory(h->mesh->context);
    for (;;) {
        KMP_TRY(extend(k, wanted));
        bool converged;
        if (!ritz(k, wanted, theta, y, &converged))
            return kmp_fail_memory(h->mesh->context);
        if (converged)
            return KEMPE_OK;
        if (k->applied == k->count)
            return kmp_fail(h->mesh->context, KEMPE_E_FAILED,
                            "%s: the %d slowest modes with held interfaces did not converge within %d vectors: take "
                            "fewer modes",
                            h->mesh->path, wanted, k->applied);
    }
}

/* The sum of the sizes of all terms of x'Kx. */
static double energy_parts(const kmp_finite_mesh *mesh, const double *x)
{
    const kmp_mesh_rows *k = &mesh->stiffness;
    double sum = 0;
    for (int i = 0; i < k->n; i++)
        for (int e = k->start[i]; e < k->start[i + 1]; e++)
            sum += fabs(x[i] * k->value[e] * x[k->col[e]]);
    return sum;
}

/* The modes from their parts in the basis, in all displacements. */
static kempe_status give(const krylov *k, int wanted, const double *theta, const double *y, double *values, double **x)
{
    const kmp_held_mesh *h = k->h;
    const kmp_finite_mesh *mesh = h->mesh;
    const ptrdiff_t all = 3 * (ptrdiff_t)mesh->node_count;
    *x = kmp_arena_alloc(mesh->arena, (size_t)all * (size_t)wanted, sizeof **x);
    if (!*x)
        return kmp_fail_memory(mesh->context);
    for (int j = 0; j < wanted; j++) {
        values[j] = 1 / theta[j];
        for (int l = 0; l < k->applied; l++)
            for (int f = 0; f < h->count; f++)
                (*x)[all * j + h->free[f]] += y[l + k->applied * j] * k->v[l][f];
    }
    if (theta[k->applied - 1] < -CONVERGED * theta[0])
        return kmp_mesh_refuse(mesh,
                               "its stiffness is negative: a displacement has the energy of %.3g 1/s^2 times its mass",
                               1 / theta[k->applied - 1]);
    if (!(values[0] > SINGULAR * energy_parts(mesh, *x)))
        return kmp_mesh_refuse(
            mesh, "with its interfaces held a part of the mesh moves without stiffness: join its elements, "
                  "or name an interface there");
    return KEMPE_OK;
}

kempe_status kmp_held_mesh_modes(kmp_held_mesh *h, int wanted, double *values, double **x)
{
    const long most = BASIS + (long)BASIS_EACH * wanted;
    krylov k = {.h = h, .most = h->count < most ? h->count : (int)most, .random = 1};
    k.width = wanted + MORE_IN_BLOCK < k.most ? wanted + MORE_IN_BLOCK : k.most;
    double *theta, *y;
    kempe_status status = KEMPE_E_MEMORY;
    if (KMP_ARENA_MAKE(&k.arena, KMP_ROOM(double *, k.most, &k.v),
                       KMP_ROOM(double, (ptrdiff_t)k.most *k.most, &k.product, &y),
                       KMP_ROOM(double, k.most, &theta, &k.lost), KMP_ROOM(double, h->count, &k.w, &k.mass),
                       KMP_ROOM(double, (ptrdiff_t)h->count *k.width, &k.block)))
        status = search(&k, wanted, theta, y);
    else
        kmp_fail_memory(h->mesh->context);
    if (status == KEMPE_OK)
        status = give(&k, wanted, theta, y, values, x);
    kmp_arena_free(&k.arena);
    return status;
}
