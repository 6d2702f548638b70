/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of the shorter derivation of the same matrices. */
#include "base/memory.h"
#include "dynamics/formalisms/tangents.h"
#include "symbolic/program/cost.h"

/* An entry that is zero has a twin that is. */
static void pair_zeros(int n, kmp_ref *m)
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k < i; k++)
            if (m[i * n + k] == KMP_ZERO || m[k * n + i] == KMP_ZERO)
                m[i * n + k] = m[k * n + i] = KMP_ZERO;
}

static void mirror(int n, const kmp_ref *from, bool upper, kmp_ref *to)
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k <= i; k++)
            to[i * n + k] = to[k * n + i] = from[upper ? k * n + i : i * n + k];
}

/* Common operations of the lists, in addition to the present outputs; -1: no memory. */
static long operations(kmp_cost *cost, int count, const kmp_ref *a, const kmp_ref *b)
{
    const kmp_ref *const list[2] = {a, b};
    for (int k = 0; k < 2; k++)
        if (list[k])
            kmp_cost_add(cost, count, list[k]);
    long sum = cost->failed ? -1 : cost->operations;
    for (int k = 0; k < 2 && sum >= 0; k++)
        if (list[k])
            kmp_cost_remove(cost, count, list[k]);
    return sum;
}

/* The first of the lists with the fewest operations. false: no memory. */
static bool find_shortest(const kmp_graph *g, int count, const kmp_ref *const *list, int lists, int *best)
{
    kmp_cost cost = {0};
    long least = -1;
    bool ok = kmp_cost_init(&cost, g, KMP_COST_ADDITION);
    for (int k = 0; ok && k < lists; k++) {
        long sum = operations(&cost, count, list[k], NULL);
        ok = sum >= 0;
        if (least < 0 || sum < least) {
            least = sum;
            *best = k;
        }
    }
    kmp_cost_free(&cost);
    return ok;
}

bool kmp_tangents_mirror(const kmp_graph *g, int n, kmp_ref *matrix)
{
    kmp_ref *lower = KMP_NEW(kmp_ref, n * n), *upper = KMP_NEW(kmp_ref, n * n);
    const kmp_ref *const savings[3] = {matrix, lower, upper};
    bool ok = lower && upper;
    if (ok) {
        int best = 0;
        pair_zeros(n, matrix);
        mirror(n, matrix, false, lower);
        mirror(n, matrix, true, upper);
        ok = find_shortest(g, n * n, savings, 3, &best);
        for (int k = 0; ok && k < n * n; k++)
            matrix[k] = savings[best][k];
    }
    kmp_free(lower);
    kmp_free(upper);
    return ok;
}

static void share_zeros(int count, kmp_ref *const of[2])
{
    for (int k = 0; of[0] && k < count; k++)
        if (of[0][k] == KMP_ZERO || of[1][k] == KMP_ZERO)
            of[0][k] = of[1][k] = KMP_ZERO;
}

bool kmp_tangents_choose(const kmp_graph *g, int others, const kmp_ref *other, int count, kmp_ref *const by_q[2],
                         kmp_ref *const by_qd[2], kmp_tangent_choice *choice)
{
    kmp_cost cost = {0};
    bool ok = kmp_cost_init(&cost, g, KMP_COST_ADDITION);
    share_zeros(count, by_q);
    share_zeros(count, by_qd);
    *choice = (kmp_tangent_choice){.operations = -1};
    if (ok)
        kmp_cost_add(&cost, others, other);
    for (int pair = 0; ok && pair < 4; pair++) {
        if ((pair & 1 && !by_q[1]) || (pair & 2 && !by_qd[1]))
            continue;
        long sum = operations(&cost, count, by_q[pair & 1], by_qd[pair >> 1]);
        ok = sum >= 0;
        if (choice->operations < 0 || sum < choice->operations)
            *choice = (kmp_tangent_choice){pair & 1, pair >> 1, sum, 0};
        choice->second = sum; /* of the last choice */
    }
    kmp_cost_free(&cost);
    return ok;
}
