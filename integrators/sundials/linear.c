/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/sundials/linear.h"
#include "integrators/steppers/solver.h"

#include <string.h>

/* Below this size a dense factorisation is the cheapest. */
enum { DENSE_BELOW = 10 };

static const struct {
    const char *name;
    SUNLinearSolver (*make)(SUNMatrix a, SUNContext context);
} kinds[] = {
#define KMP_LINEAR(name) {#name, kmp_linear_##name},
#include "integrators/sundials/linear.def"
#undef KMP_LINEAR
};

bool kmp_linear_known(const char *name)
{
    bool known = strcmp(name, "auto") == 0;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        known = known || strcmp(kinds[i].name, name) == 0;
    return known;
}

const char *kmp_linear_names(void)
{
    return "auto"
#define KMP_LINEAR(name) ", " #name
#include "integrators/sundials/linear.def"
#undef KMP_LINEAR
        ;
}

SUNLinearSolver kmp_linear_new(const char *name, SUNMatrix a, SUNContext context)
{
    if (strcmp(name, "auto") == 0)
        name = SUNSparseMatrix_Columns(a) < DENSE_BELOW ? "dense" : "klu";
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i].name, name) == 0)
            return kinds[i].make(a, context);
    return NULL;
}

/* -- common part -------------------------------------------------------------------------------------- */

static SUNLinearSolver_Type type(SUNLinearSolver s)
{
    (void)s;
    return SUNLINEARSOLVER_DIRECT;
}

static SUNLinearSolver_ID id(SUNLinearSolver s)
{
    (void)s;
    return SUNLINEARSOLVER_CUSTOM;
}

static int initialize(SUNLinearSolver s)
{
    kmp_linear_head *head = s->content;
    return head->last = 0;
}

static sunindextype last_flag(SUNLinearSolver s)
{
    const kmp_linear_head *head = s->content;
    return head->last;
}

static int release(SUNLinearSolver s)
{
    kmp_linear_head *head = s->content;
    if (head)
        head->ops->release(head);
    s->content = NULL;
    SUNLinSolFreeEmpty(s);
    return 0;
}

SUNLinearSolver kmp_linear_wrap(kmp_linear_head *content, const kmp_linear_ops *ops, SUNContext context)
{
    SUNLinearSolver s = SUNLinSolNewEmpty(context);
    if (!s) {
        ops->release(content);
        return NULL;
    }
    content->ops = ops;
    s->content = content;
    s->ops->gettype = type;
    s->ops->getid = id;
    s->ops->initialize = initialize;
    s->ops->setup = ops->setup;
    s->ops->solve = ops->solve;
    s->ops->lastflag = last_flag;
    s->ops->free = release;
    return s;
}
