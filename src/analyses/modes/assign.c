/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/modes/assign.h"
#include "base/arena.h"
#include <math.h>

/* Prices of rows and columns keep every reduced cost at zero or more; owner[j] is the row that has column j. Entry n of
 * the columns' is where a path begins. */
typedef struct market {
    int n;
    const double *cost;
    double *row, *price, *least; /* n + 1 each */
    int *owner, *before;         /* n + 1 each */
    bool *seen;                  /* n + 1 */
} market;

/* From column `at`, whose owner looks for another column, to the column that is cheapest to reach. */
static int step(market *m, int at)
{
    int next = -1, i = m->owner[at];
    double shortest = INFINITY;
    m->seen[at] = true;
    for (int j = 0; j < m->n; j++) {
        if (m->seen[j])
            continue;
        double reduced = m->cost[i + (ptrdiff_t)j * m->n] - m->row[i] - m->price[j];
        if (reduced < m->least[j]) {
            m->least[j] = reduced;
            m->before[j] = at;
        }
        if (m->least[j] < shortest) {
            shortest = m->least[j];
            next = j;
        }
    }
    for (int j = 0; j <= m->n; j++)
        if (m->seen[j]) {
            m->row[m->owner[j]] += shortest;
            m->price[j] -= shortest;
        } else {
            m->least[j] -= shortest;
        }
    return next;
}

int kmp_assign(int n, const double *cost, int *column)
{
    market m = {.n = n, .cost = cost};
    kmp_arena arena = {0};
    m.seen = KMP_ARENA_NEW(&arena, bool, n + 1);
    bool ok = KMP_ARENA_EACH(&arena, double, n + 1, &m.row, &m.price, &m.least) &&
              KMP_ARENA_EACH(&arena, int, n + 1, &m.owner, &m.before);
    for (int j = 0; ok && j < n; j++)
        m.owner[j] = -1;
    for (int i = 0; ok && i < n; i++) {
        int at = m.n;
        m.owner[at] = i;
        for (int j = 0; j <= m.n; j++) {
            m.least[j] = INFINITY;
            m.seen[j] = false;
        }
        do
            at = step(&m, at);
        while (m.owner[at] >= 0);
        for (; at != m.n; at = m.before[at])
            m.owner[at] = m.owner[m.before[at]];
    }
    for (int j = 0; ok && j < n; j++)
        column[m.owner[j]] = j;
    kmp_arena_free(&arena);
    return ok ? 0 : -1;
}
