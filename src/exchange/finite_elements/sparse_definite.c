/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides CHOLMOD (Chen, Davis, Hager, Rajamanickam, ACM TOMS 35 (2008) 22). As UMFPACK, it is loaded at its first use.
 */
#include "exchange/finite_elements/sparse_definite.h"
#include "base/arena.h"
#include "base/loaded_library.h"
#include "base/memory.h"
#include <string.h>

#if defined KEMPE_UMFPACK && defined KEMPE_CHOLMOD_LIBRARY
#define WITH_CHOLMOD
#endif

#ifdef WITH_CHOLMOD
#include <cholmod.h>

#define FUNCTIONS(ONE) ONE(start) ONE(finish) ONE(analyze) ONE(factorize) ONE(solve) ONE(free_factor) ONE(free_dense)

/* The library's functions by their names without cholmod_l_. */
static struct functions {
#define ONE(name) __typeof__(&cholmod_l_##name) name;
    FUNCTIONS(ONE)
#undef ONE
} library;

static bool is_there(void)
{
#define ONE(name) "cholmod_l_" #name,
    static const char *const names[] = {FUNCTIONS(ONE)};
#undef ONE
    static kmp_loaded_library loaded = KMP_LOADED_LIBRARY(KEMPE_CHOLMOD_LIBRARY, names, &library);
    return !kmp_library_missing(&loaded);
}
#endif

struct kmp_sparse_definite {
    int n;
    kmp_sparse *klu; /* NULL: CHOLMOD */
#ifdef WITH_CHOLMOD
    cholmod_common common;
    cholmod_factor *factor;
#endif
};

void kmp_sparse_definite_free(kmp_sparse_definite *f)
{
    if (!f)
        return;
#ifdef WITH_CHOLMOD
    if (!f->klu && f->n > 0) {
        library.free_factor(&f->factor, &f->common);
        library.finish(&f->common);
    }
#endif
    kmp_sparse_free(f->klu);
    kmp_free(f);
}

#ifdef WITH_CHOLMOD
/* The rows equal the columns, by symmetry; only their lower part is read. */
static kmp_sparse_outcome factor_by_cholmod(kmp_sparse_definite *f, int n, int nz, const int *row, const int *col,
                                            const double *value)
{
    kmp_arena room = {0};
    SuiteSparse_long *start, *place;
    double *copy;
    kmp_sparse_outcome outcome = KMP_SPARSE_NO_MEMORY;
    if (KMP_ARENA_MAKE(&room, KMP_ROOM(SuiteSparse_long, n + 1, &start), KMP_ROOM(SuiteSparse_long, nz, &place),
                       KMP_ROOM(double, nz, &copy))) {
        for (int k = 0; k < nz; k++) {
            start[row[k] + 1]++;
            place[k] = col[k];
            copy[k] = value[k];
        }
        for (int i = 0; i < n; i++)
            start[i + 1] += start[i];
        cholmod_sparse a = {.nrow = (size_t)n,
                            .ncol = (size_t)n,
                            .nzmax = (size_t)nz,
                            .p = start,
                            .i = place,
                            .x = copy,
                            .stype = -1,
                            .itype = CHOLMOD_LONG,
                            .xtype = CHOLMOD_REAL,
                            .dtype = CHOLMOD_DOUBLE,
                            .sorted = 1,
                            .packed = 1};
        library.start(&f->common);
        f->n = n;
        f->common.print = 0;
        f->factor = library.analyze(&a, &f->common);
        if (f->factor)
            (void)library.factorize(&a, f->factor, &f->common);
        const int status = f->common.status;
        outcome = status == CHOLMOD_OK || status == CHOLMOD_DSMALL ? KMP_SPARSE_FACTORED
                  : status == CHOLMOD_NOT_POSDEF                   ? KMP_SPARSE_SINGULAR
                  : status == CHOLMOD_OUT_OF_MEMORY                ? KMP_SPARSE_NO_MEMORY
                                                                   : KMP_SPARSE_FAILED;
    }
    kmp_arena_free(&room);
    return outcome;
}
#endif

static kmp_sparse_outcome factor(kmp_sparse_definite *f, int n, int nz, const int *row, const int *col,
                                 const double *value)
{
#ifdef WITH_CHOLMOD
    if (is_there())
        return factor_by_cholmod(f, n, nz, row, col, value);
#endif
    f->n = n;
    f->klu = kmp_sparse_new(n, nz, row, col, true);
    return f->klu ? kmp_sparse_factor(f->klu, value) : KMP_SPARSE_NO_MEMORY;
}

kmp_sparse_outcome kmp_sparse_definite_new(int n, int nz, const int *row, const int *col, const double *value,
                                           kmp_sparse_definite **factors)
{
    kmp_sparse_definite *f = KMP_NEW(kmp_sparse_definite, 1);
    kmp_sparse_outcome outcome = f ? factor(f, n, nz, row, col, value) : KMP_SPARSE_NO_MEMORY;
    if (outcome == KMP_SPARSE_FACTORED)
        *factors = f;
    else
        kmp_sparse_definite_free(f);
    return outcome;
}

bool kmp_sparse_definite_solve(kmp_sparse_definite *f, int m, double *x)
{
    if (f->klu)
        return kmp_sparse_solve(f->klu, m, x);
#ifdef WITH_CHOLMOD
    const size_t n = (size_t)f->n, count = (size_t)m;
    cholmod_dense b = {
        .nrow = n, .ncol = count, .nzmax = n * count, .d = n, .x = x, .xtype = CHOLMOD_REAL, .dtype = CHOLMOD_DOUBLE};
    cholmod_dense *solution = library.solve(CHOLMOD_A, f->factor, &b, &f->common);
    if (solution)
        memcpy(x, solution->x, n * count * sizeof *x);
    const bool good = solution;
    library.free_dense(&solution, &f->common);
    return good;
#else
    return false;
#endif
}

const char *kmp_sparse_definite_library(const kmp_sparse_definite *f)
{
    return f->klu ? "KLU" : "CHOLMOD";
}
