/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides LAPACK's Fortran binding and its workspace. The lengths of character arguments are left out, as all of them are
 * one letter. */
#include "linalg/dense/lapack.h"
#include "linalg/dense/dense_parts.h"
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

extern void dgelsy_(const int *m, const int *n, const int *nrhs, double *a, const int *lda, double *b, const int *ldb,
                    int *jpvt, const double *rcond, int *rank, double *work, const int *lwork, int *info);
extern void dsyev_(const char *jobz, const char *uplo, const int *n, double *a, const int *lda, double *w, double *work,
                   const int *lwork, int *info);
extern void dsyevd_(const char *jobz, const char *uplo, const int *n, double *a, const int *lda, double *w,
                    double *work, const int *lwork, int *iwork, const int *liwork, int *info);

static int imax(int a, int b)
{
    return a > b ? a : b;
}

static int solve_symmetric(int n, double *a, double *values)
{
    const bool divides = n >= KMP_EIGEN_DIVIDED;
    int lwork = divides ? 1 + 6 * n + 2 * n * n : 3 * n, liwork = 3 + 5 * n, info = 0;
    kmp_arena room = {0};
    double *work = KMP_ARENA_NEW(&room, double, lwork);
    int *iwork = KMP_ARENA_NEW(&room, int, liwork);
    bool made = work && iwork;
    if (made && divides)
        dsyevd_("V", "L", &n, a, &n, values, work, &lwork, iwork, &liwork, &info);
    else if (made && n > 0)
        dsyev_("V", "L", &n, a, &n, values, work, &lwork, &info);
    kmp_arena_free(&room);
    return made && info == 0 ? 0 : -1;
}

/* An eigenvalue with its vector, among the vectors of its group. */
typedef struct eigen_place {
    double value;
    const double *vector;
    int group, number;
} eigen_place;

static int by_value(const void *a, const void *b)
{
    const eigen_place *x = a, *y = b;
    return x->value != y->value ? (x->value < y->value ? -1 : 1) : x->number - y->number;
}

/* Group by group: the matrix has no entries between them. */
static int solve_groups(int n, double *a, double *values, const kmp_dense_groups *groups, kmp_arena *room)
{
    eigen_place *places = KMP_ARENA_NEW(room, eigen_place, n);
    for (int g = 0; places && g < groups->count; g++) {
        const int from = groups->start[g], size = groups->start[g + 1] - from, *order = groups->order + from;
        double *own = KMP_ARENA_NEW(room, double, (ptrdiff_t)size *size);
        for (int j = 0; own && j < size; j++)
            for (int i = j; i < size; i++)
                own[i + j * size] = a[order[i] + (ptrdiff_t)order[j] * n];
        if (!own || solve_symmetric(size, own, values + from) != 0)
            return -1;
        for (int k = 0; k < size; k++)
            places[from + k] = (eigen_place){values[from + k], own + k * size, g, from + k};
    }
    if (!places)
        return -1;
    qsort(places, (size_t)n, sizeof *places, by_value);
    memset(a, 0, (size_t)n * (size_t)n * sizeof *a);
    for (int k = 0; k < n; k++) {
        const int from = groups->start[places[k].group], size = groups->start[places[k].group + 1] - from;
        values[k] = places[k].value;
        for (int i = 0; i < size; i++)
            a[groups->order[from + i] + (ptrdiff_t)k * n] = places[k].vector[i];
    }
    return 0;
}

int kmp_symmetric_eigen(int n, double *a, double *values)
{
    if (n < KMP_EIGEN_DIVIDED)
        return solve_symmetric(n, a, values);
    kmp_arena room = {0};
    kmp_dense_groups groups;
    int failed = -1;
    for (int j = 0; j < n; j++) /* the upper triangle is not the matrix's */
        memset(a + (ptrdiff_t)j * n, 0, (size_t)j * sizeof *a);
    if (kmp_dense_groups_init(&groups, &room, n, 1, &(const double *){a}))
        failed = groups.count > 1 ? solve_groups(n, a, values, &groups, &room) : solve_symmetric(n, a, values);
    kmp_arena_free(&room);
    return failed;
}

static int least_squares(int m, int n, const double *a, int count, const double *b, double rcond, double *x)
{
    int rank = 0, info = 0, rows = imax(m, 1), ldb = imax(rows, n), small = m < n ? m : n;
    int lwork = imax(small + 3 * n + 1, 2 * small + count) * 4;
    kmp_arena room = {0};
    double *copy = KMP_ARENA_NEW(&room, double, m *n), *rhs = KMP_ARENA_NEW(&room, double, (size_t)ldb *(size_t)count),
           *work = KMP_ARENA_NEW(&room, double, lwork);
    int *pivot = KMP_ARENA_NEW(&room, int, n);
    bool made = !room.failed;
    if (made && m > 0 && n > 0) {
        memcpy(copy, a, (size_t)(m * n) * sizeof *copy);
        for (int k = 0; k < count; k++)
            memcpy(rhs + (ptrdiff_t)k * ldb, b + (ptrdiff_t)k * m, (size_t)m * sizeof *rhs);
        dgelsy_(&m, &n, &count, copy, &rows, rhs, &ldb, pivot, &rcond, &rank, work, &lwork, &info);
    }
    for (int k = 0; made && n > 0 && k < count; k++) /* without rows, the solution is zero */
        memcpy(x + (ptrdiff_t)k * n, rhs + (ptrdiff_t)k * ldb, (size_t)n * sizeof *x);
    kmp_arena_free(&room);
    return made ? rank : -1;
}

static double longest_column(int m, int n, const double *a)
{
    double most = 0;
    for (int j = 0; j < n; j++) {
        double sum = 0;
        for (int i = 0; i < m; i++)
            sum += a[i + (ptrdiff_t)j * m] * a[i + (ptrdiff_t)j * m];
        most = sum > most ? sum : most;
    }
    return sqrt(most);
}

/* Group by group of columns that share no row; owner (m): a column of each row. Pivots count as zero relative to the
 * largest of all groups. */
static int least_squares_by_groups(int m, int n, const double *a, int count, const double *b, double rcond, double *x,
                                   const kmp_dense_groups *groups, const int *owner, kmp_arena *room)
{
    const double most = longest_column(m, n, a);
    int *row = KMP_ARENA_NEW(room, int, m), rank = 0;
    double *own = KMP_ARENA_NEW(room, double, (ptrdiff_t)m *n),
           *right = KMP_ARENA_NEW(room, double, (ptrdiff_t)m *count),
           *part = KMP_ARENA_NEW(room, double, (ptrdiff_t)n *count);
    for (int g = 0; !room->failed && g < groups->count; g++) {
        const int *order = groups->order + groups->start[g], size = groups->start[g + 1] - groups->start[g];
        int rows = 0;
        for (int i = 0; i < m; i++)
            if (owner[i] >= 0 && groups->of[owner[i]] == g)
                row[rows++] = i;
        for (int j = 0; j < size; j++)
            for (int i = 0; i < rows; i++)
                own[i + (ptrdiff_t)j * rows] = a[row[i] + (ptrdiff_t)order[j] * m];
        for (int k = 0; k < count; k++)
            for (int i = 0; i < rows; i++)
                right[i + (ptrdiff_t)k * rows] = b[row[i] + (ptrdiff_t)k * m];
        const double longest = longest_column(rows, size, own), nothing = longest > 0 ? rcond * most / longest : 2;
        const int found = nothing < 1 ? least_squares(rows, size, own, count, right, nothing, part) : 0;
        if (found < 0)
            return -1;
        rank += found;
        for (int k = 0; k < count; k++)
            for (int j = 0; j < size; j++)
                x[order[j] + (ptrdiff_t)k * n] = nothing < 1 ? part[j + (ptrdiff_t)k * size] : 0;
    }
    return room->failed ? -1 : rank;
}

/* Groups of columns, of which each row has one; owner (m): a column of each row, -1: it has none. */
static bool find_column_groups(int m, int n, const double *a, int *owner, kmp_dense_groups *groups, kmp_arena *room)
{
    double *links = KMP_ARENA_NEW(room, double, (ptrdiff_t)n *n);
    for (int i = 0; i < m; i++)
        owner[i] = -1;
    for (int j = 0; links && j < n; j++)
        for (int i = 0; i < m; i++)
            if (a[i + (ptrdiff_t)j * m] != 0) {
                if (owner[i] >= 0)
                    links[j + (ptrdiff_t)owner[i] * n] = 1;
                owner[i] = owner[i] >= 0 ? owner[i] : j;
            }
    return links && kmp_dense_groups_init(groups, room, n, 1, &(const double *){links});
}

int kmp_least_squares_of(int m, int n, const double *a, int count, const double *b, double rcond, double *x)
{
    if (n < KMP_EIGEN_DIVIDED || m == 0)
        return least_squares(m, n, a, count, b, rcond, x);
    kmp_arena room = {0};
    kmp_dense_groups groups;
    int *owner = KMP_ARENA_NEW(&room, int, m), rank = -1;
    if (owner && find_column_groups(m, n, a, owner, &groups, &room))
        rank = groups.count > 1 ? least_squares_by_groups(m, n, a, count, b, rcond, x, &groups, owner, &room)
                                : least_squares(m, n, a, count, b, rcond, x);
    kmp_arena_free(&room);
    return rank;
}

int kmp_least_squares(int m, int n, const double *a, const double *b, double rcond, double *x)
{
    return kmp_least_squares_of(m, n, a, 1, b, rcond, x);
}
