/* SPDX-License-Identifier: BSD-3-Clause */
/* Kinds of linear solvers behind a SUNLinearSolver. */
#include "integrators/sundials/linear.h"
#include "base/memory.h"
#include "linalg/sparse.h"

#include <string.h>

/* Below this size a dense factorisation is the cheapest (bench/results/linear_solvers.txt). */
enum { DENSE_BELOW = 10 };

/* An operation of KLU takes up to this many times as long as one of the dense factorisation: it was slower at 1.5 times
 * as few operations and faster at 3 times as few. Only a matrix with this part of its entries can be that full. */
#define SPARSE_COST 2.0
#define NEARLY_FULL 0.25

static const kmp_linear_kind *const kinds[] = {
#define KMP_LINEAR(name) &kmp_linear_##name,
#include "integrators/sundials/linear.def"
#undef KMP_LINEAR
};

static const kmp_linear_kind *find(const char *name)
{
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i]->name, name) == 0)
            return kinds[i];
    return NULL;
}

const char *kmp_linear_name(int k)
{
    return k >= 0 && k < (int)(sizeof kinds / sizeof *kinds) ? kinds[k]->name : NULL;
}

const char *kmp_linear_find(const char *name)
{
    const kmp_linear_kind *kind = find(name);
    return kind ? kind->name : strcmp(name, "auto") == 0 ? "auto" : NULL;
}

const char *kmp_linear_missing(const char *name)
{
    const kmp_linear_kind *kind = find(name);
    return kind && kind->missing ? kind->missing() : NULL;
}

const char *kmp_linear_names(void)
{
    return "auto"
#define KMP_LINEAR(name) ", " #name
#include "integrators/sundials/linear.def"
#undef KMP_LINEAR
        ;
}

/* -- a SUNLinearSolver -------------------------------------------------------------------------------- */

typedef struct content {
    const kmp_linear_kind *kind;
    kmp_arena arena;
    void *self; /* the kind's */
} content;

static SUNLinearSolver_Type type(SUNLinearSolver s)
{
    (void)s;
    return SUNLINEARSOLVER_DIRECT;
}

static int setup(SUNLinearSolver s, SUNMatrix a)
{
    content *c = s->content;
    return c->kind->factor(c->self, a);
}

static int solve(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance)
{
    (void)tolerance;
    content *c = s->content;
    return c->kind->solve(c->self, a, kmp_sun_data(x), kmp_sun_data(b));
}

static int release(SUNLinearSolver s)
{
    content *c = s->content;
    if (c && c->self && c->kind->release)
        c->kind->release(c->self);
    if (c)
        kmp_arena_free(&c->arena);
    kmp_free(c);
    s->content = NULL;
    SUNLinSolFreeEmpty(s);
    return 0;
}

int64_t kmp_linear_fill(SUNLinearSolver s)
{
    content *c = s->content;
    return c->kind->fill(c->self);
}

/* True if the factors are so full that the dense factorisation is faster: estimated from the pattern, which the matrix
 * has, or no entries yet. */
static bool is_full(SUNMatrix a)
{
    double n = (double)SUNSparseMatrix_Columns(a), nz = (double)SUNSparseMatrix_IndexPointers(a)[(long)n];
    bool full = n < DENSE_BELOW;
    if (full || nz < NEARLY_FULL * n * n)
        return full;
    kmp_sparse *sparse = kmp_sparse_new_columns((int)n, (int)nz);
    if (sparse && kmp_sparse_take_columns(sparse, SUNSparseMatrix_IndexPointers(a), SUNSparseMatrix_IndexValues(a)))
        full = n * n * (2 * n / 3 + 2) < SPARSE_COST * kmp_sparse_operations(sparse);
    kmp_sparse_free(sparse);
    return full;
}

SUNLinearSolver kmp_linear_new(const char *name, SUNMatrix a, SUNContext context)
{
    const kmp_linear_kind *kind = find(strcmp(name, "auto") != 0 ? name : is_full(a) ? "dense" : "klu");
    SUNLinearSolver s = kind ? SUNLinSolNewEmpty(context) : NULL;
    if (!s)
        return NULL;
    s->ops->gettype = type;
    s->ops->setup = setup;
    s->ops->solve = solve;
    s->ops->free = release;
    content *c = s->content = KMP_NEW(content, 1);
    if (c) {
        c->kind = kind;
        c->self = kind->create(a, &c->arena);
    }
    if (c && c->self)
        return s;
    release(s);
    return NULL;
}
