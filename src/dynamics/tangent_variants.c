/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of the shorter derivation of the same matrices. */
#include "dynamics/tangent_variants.h"
#include "base/memory.h"
#include "dynamics/tangents.h"
#include "symbolic/cost.h"

static void mirror(int n, const kmp_ref *from, bool upper, kmp_ref *to)
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k <= i; k++)
            to[i * n + k] = to[k * n + i] = from[upper ? k * n + i : i * n + k];
}

/* The first of the lists with the fewest operations. false: no memory. */
static bool find_shortest(const kmp_graph *g, int count, const kmp_ref *const *list, int lists, int *best)
{
    kmp_cost cost = {0};
    long least = -1;
    bool ok = kmp_cost_init(&cost, g, KMP_COST_ADDITION);
    for (int k = 0; ok && k < lists; k++) {
        kmp_cost_add(&cost, count, list[k]);
        if (k > 0)
            kmp_cost_remove(&cost, count, list[k - 1]);
        ok = !cost.failed;
        if (least < 0 || cost.operations < least) {
            least = cost.operations;
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
        /* An entry that is zero has a twin that is. */
        for (int i = 0; i < n; i++)
            for (int k = 0; k < i; k++)
                if (matrix[i * n + k] == KMP_ZERO || matrix[k * n + i] == KMP_ZERO)
                    matrix[i * n + k] = matrix[k * n + i] = KMP_ZERO;
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

/* Exchanges a list that is counted for another one, if that exists. Adding first leaves common operations in use. */
static void turn_to(kmp_cost *cost, int count, kmp_ref *const list[2], int to, int *now)
{
    if (*now == to || !list[to])
        return;
    kmp_cost_add(cost, count, list[to]);
    if (*now >= 0)
        kmp_cost_remove(cost, count, list[*now]);
    *now = to;
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
    long sum[4] = {-1, -1, -1, -1};
    if (ok) {
        /* Operations of the present outputs with each pair of lists; -1: there is no such pair. From one pair to the
         * next, one list changes. */
        static const int order[] = {0, 1, 3, 2};
        int now[2] = {-1, -1};
        for (int k = 0; k < 4; k++) {
            int q = order[k] & 1, qd = order[k] >> 1;
            bool absent = (q && !by_q[1]) || (qd && !by_qd[1]);
            if (!absent) {
                turn_to(&cost, count, by_q, q, &now[0]);
                turn_to(&cost, count, by_qd, qd, &now[1]);
            }
            sum[order[k]] = absent ? -1 : cost.operations;
        }
    }
    ok = ok && !cost.failed;
    for (int pair = 0; ok && pair < 4; pair++) {
        if (sum[pair] < 0)
            continue;
        if (choice->operations < 0 || sum[pair] < choice->operations)
            *choice = (kmp_tangent_choice){pair & 1, pair >> 1, sum[pair], 0};
        choice->second = sum[pair]; /* of the last choice */
    }
    kmp_cost_free(&cost);
    return ok;
}
