/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides UMFPACK (Davis, ACM TOMS 30 (2004) 196): one symbolic analysis, one numeric factorisation per setup, and solves
 * without iterative refinement in a separate workspace. Its libraries are loaded at its first use: they would
 * be a third of the time that every process takes to begin. */
#include "base/loaded_library.h"
#include "integrators/sundials/linear.h"

#include <string.h>
#include <umfpack.h>

_Static_assert(sizeof(SuiteSparse_long) == sizeof(sunindextype), "SuiteSparse and SUNDIALS must agree on indices");

#define FUNCTIONS(ONE)                                                                                                 \
    ONE(defaults) ONE(symbolic) ONE(numeric) ONE(wsolve) ONE(free_symbolic) ONE(free_numeric) ONE(get_lunz)

/* The library's functions by their names without umfpack_dl_. */
static struct functions {
#define ONE(name) __typeof__(&umfpack_dl_##name) name;
    FUNCTIONS(ONE)
#undef ONE
} library;

static const char *missing(void)
{
#define ONE(name) "umfpack_dl_" #name,
    static const char *const names[] = {FUNCTIONS(ONE)};
#undef ONE
    static kmp_loaded_library loaded = KMP_LOADED_LIBRARY(KEMPE_UMFPACK_LIBRARY, names, &library);
    return kmp_library_missing(&loaded);
}

typedef struct umfpack {
    SuiteSparse_long n, *wi;
    void *symbolic, *numeric;
    double *w, *b;
    double control[UMFPACK_CONTROL];
} umfpack;

static SuiteSparse_long *columns(SUNMatrix a)
{
    return (SuiteSparse_long *)SUNSparseMatrix_IndexPointers(a);
}

static SuiteSparse_long *rows(SUNMatrix a)
{
    return (SuiteSparse_long *)SUNSparseMatrix_IndexValues(a);
}

static int meaning(SuiteSparse_long status)
{
    if (status == UMFPACK_OK)
        return 0;
    if (status == UMFPACK_WARNING_singular_matrix)
        return SUNLS_LUFACT_FAIL;
    return status == UMFPACK_ERROR_out_of_memory ? KMP_SUN_NO_MEMORY : KMP_SUN_PACKAGE_FAILED;
}

static void *create(SUNMatrix a, kmp_arena *arena)
{
    umfpack *u = missing() ? NULL : KMP_ARENA_NEW(arena, umfpack, 1);
    if (!u)
        return NULL;
    u->n = SUNSparseMatrix_Columns(a);
    KMP_ARENA_MAKE(arena, KMP_ROOM(SuiteSparse_long, u->n, &u->wi), KMP_ROOM(double, u->n, &u->w, &u->b));
    library.defaults(u->control);
    u->control[UMFPACK_IRSTEP] = 0;
    return arena->failed ? NULL : u;
}

static int factor(void *self, SUNMatrix a)
{
    umfpack *u = self;
    SuiteSparse_long status = UMFPACK_OK;
    if (!u->symbolic)
        status = library.symbolic(u->n, u->n, columns(a), rows(a), NULL, &u->symbolic, u->control, NULL);
    library.free_numeric(&u->numeric);
    if (status == UMFPACK_OK)
        status =
            library.numeric(columns(a), rows(a), SUNSparseMatrix_Data(a), u->symbolic, &u->numeric, u->control, NULL);
    return meaning(status);
}

/* UMFPACK needs separate x and b. */
static int solve(void *self, SUNMatrix a, double *x, const double *b)
{
    umfpack *u = self;
    if (!u->numeric)
        return KMP_SUN_PACKAGE_FAILED;
    if (b == x)
        b = memcpy(u->b, b, (size_t)u->n * sizeof *b);
    return meaning(library.wsolve(UMFPACK_A, columns(a), rows(a), SUNSparseMatrix_Data(a), x, b, u->numeric, u->control,
                                  NULL, u->wi, u->w));
}

static void release(void *self)
{
    umfpack *u = self;
    library.free_numeric(&u->numeric);
    library.free_symbolic(&u->symbolic);
}

static int64_t fill(void *self)
{
    SuiteSparse_long lower = 0, upper = 0, rows, columns, diagonal;
    (void)library.get_lunz(&lower, &upper, &rows, &columns, &diagonal, ((umfpack *)self)->numeric);
    return lower + upper;
}

const kmp_linear_kind kmp_linear_umfpack = {"umfpack", missing, create, factor, solve, release, fill};
