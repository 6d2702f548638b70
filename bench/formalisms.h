/* SPDX-License-Identifier: BSD-3-Clause */
/* Cost of the accelerations of a tree by each formalism, by the paper's rule, + - * /: numbers of the model are
 * symbols, and what depends on them alone is done once and not counted. */
#ifndef KEMPE_BENCH_FORMALISMS_H
#define KEMPE_BENCH_FORMALISMS_H

#include "bench/classical.h"
#include "bench/plain_articulated.h"
#include "bench/trees.h"
#include "dynamics/equations.h"
#include "dynamics/forces/forces.h"
#include "model/data/force.h"
#include "studies/show/sets.h"
#include "symbolic/program.h"

typedef enum formalism {
    FORMALISM_NER,       /* M and C, M column by column */
    FORMALISM_COMPOSITE, /* M and C, M by composite bodies */
    FORMALISM_CLASSICAL, /* M and C by virtual power */
    FORMALISM_ORDER_N,   /* accelerations, articulated bodies */
    FORMALISM_PLAIN_N,   /* likewise, as textbooks have them */
    FORMALISMS
} formalism;

static const char *const formalism_names[FORMALISMS] = {"ner", "composite", "classical", "O(N)", "O(N) 6x6"};

static inline bool formalism_solves(formalism f)
{
    return f == FORMALISM_NER || f == FORMALISM_COMPOSITE || f == FORMALISM_CLASSICAL;
}

static inline kempe_status formalism_derive_plain(kmp_equations *eq, formalism f)
{
    kmp_forces forces;
    kmp_forces_init(&forces, &eq->tree, false, NULL);
    if (kmp_graph_failed(eq->graph))
        return KEMPE_E_MEMORY;
    bool ok = f == FORMALISM_CLASSICAL
                  ? classical_derive(&eq->tree, forces.applied, eq->dynamics.mass, eq->dynamics.bias)
                  : plain_articulated(&eq->tree, forces.applied, forces.effort, eq->articulated.accelerations);
    for (int k = 0; f == FORMALISM_CLASSICAL && k < eq->n; k++)
        eq->dynamics.bias[k] = kmp_sub(eq->graph, eq->dynamics.bias[k], forces.effort[k]);
    return ok ? KEMPE_OK : KEMPE_E_MEMORY;
}

/* The equations as the formalism says, in the axes of the bodies. */
static inline kempe_status formalism_derive(kmp_equations *eq, const kempe_model *model, formalism f)
{
    static const unsigned sets[FORMALISMS] = {[FORMALISM_NER] = KMP_SET_MASS | KMP_SET_BIAS,
                                              [FORMALISM_COMPOSITE] = KMP_SET_MASS | KMP_SET_BIAS,
                                              [FORMALISM_ORDER_N] = KMP_SET_ACCELERATION};
    kmp_derivation_request scene = {.sets = sets[f],
                                    .scheme = f == FORMALISM_NER ? KMP_SCHEME_NER : KMP_SCHEME_COMPOSITE,
                                    .keep = KMP_KEEP_NUMBERS};
    kempe_status status = kmp_equations_derive_once(eq, model, &scene);
    if (status == KEMPE_OK && !sets[f])
        status = formalism_derive_plain(eq, f);
    return status;
}

static inline unsigned formalism_sets(formalism f)
{
    return formalism_solves(f) ? 1u << KMP_EQ_M | 1u << KMP_EQ_C : 1u << KMP_EQ_QDD;
}

/* Operations of the formalism as it is written down; -1: no memory. */
static inline long formalism_count(const kempe_model *model, formalism f)
{
    kmp_equations eq;
    long count = -1;
    if (formalism_derive(&eq, model, f) != KEMPE_OK)
        return count;
    int size = kmp_sets_size(&eq, formalism_sets(f));
    kmp_assignment *entry = KMP_NEW(kmp_assignment, size);
    kmp_ref *output = KMP_NEW(kmp_ref, size);
    if (entry && output) {
        kmp_sets_put(&eq, formalism_sets(f), entry);
        for (int k = 0; k < size; k++)
            output[k] = entry[k].value;
        const kmp_ref *group = output;
        kmp_program *p = kmp_program_new(eq.graph, 1, &size, &group);
        count = p ? kmp_program_count(p, 1, 1).paper : -1;
        kmp_program_free(p);
    }
    kmp_free(entry);
    kmp_free(output);
    kmp_equations_free(&eq);
    return count;
}

/* Operations of one of the first two or O(N) as Kempe generates it: the shortest way to write it, and all passes. */
static inline long formalism_generated(const kempe_model *model, formalism f)
{
    const kmp_derivation_request scene = {.scheme = f == FORMALISM_NER ? KMP_SCHEME_NER : KMP_SCHEME_COMPOSITE,
                                          .keep = KMP_KEEP_NUMBERS};
    kmp_tally tally;
    return kmp_tally_sets(model, &scene, formalism_sets(f), &tally) == KEMPE_OK ? tally.runtime.paper : -1;
}

/* L L' by Cholesky, and M x = - C by it, x and right-hand side in one array: n (n^2 - 1) / 3 products and differences,
 * n (n - 1) / 2 quotients, n square roots that are not counted, and 2 n^2 for the two triangles. */
static inline long formalism_dense_solve(int n)
{
    long k = n;
    return k * (k * k - 1) / 3 + k * (k - 1) / 2 + 2 * k * k;
}

/* Cost of the accelerations by M = L' D L from the leaves inwards (Featherstone 2005), which fills nothing where bodies
 * are on different branches: d quotients and d (d + 1) products and differences a body with d others on its way to the
 * ground, and 4 d and one quotient to solve. */
static inline long formalism_sparse_solve(tree_shape shape, int n)
{
    long count = 0;
    for (int b = 1; b <= n; b++) {
        long d = tree_depth(shape, b);
        count += d + d * (d + 1) + 4 * d + 1;
    }
    return count;
}

/* N*: from where on O(N) takes fewer operations than M, C and the solve, up to `most`; most + 1: nowhere. By N. */
static inline int formalism_break_even(int most, const long *matrix, const long *solve, const long *order_n)
{
    int from = most + 1;
    while (from > 1 && order_n[from - 1] < matrix[from - 1] + solve[from - 1])
        from--;
    return from;
}

#endif
