/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows of J are matched with coordinates (by SuiteSparse BTF). A group's rows and coordinates are one node of a
 * compressed graph, which is ordered for little fill (AMD, by KLU's analysis), as Duff and Pralet (SIAM J. Matrix Anal.
 * Appl. 27 (2005) 313) do with single pairs. */
#include "linalg/saddle_order.h"
#include "base/arena.h"
#include "linalg/sparse.h"
#include <btf.h>
#include <klu.h>
#include <stdlib.h>

/* The coordinate of each row of J; -1: none. False: no memory. */
static bool match_rows(int n, int r, int nz, const int *row, const int *col, int *match)
{
    kmp_arena room = {0};
    int *start, *entry_row, *entry_col, *order, *scratch, count = 0;
    bool ok = KMP_ARENA_MAKE(&room, KMP_ROOM(int, n + 1, &start), KMP_ROOM(int, nz + 1, &entry_row, &entry_col, &order),
                             KMP_ROOM(int, 5 * (n > r ? n : r) + 1, &scratch));
    for (int k = 0; ok && k < nz; k++)
        if (row[k] >= n && col[k] < n) {
            entry_row[count] = row[k] - n;
            entry_col[count++] = col[k];
        }
    if (ok && r > 0) {
        double work;
        kmp_sort_entries(n, count, entry_col, start, order);
        for (int k = 0; k < count; k++)
            order[k] = entry_row[order[k]];
        (void)btf_maxtrans(r, n, start, order, 0.0, &work, match, scratch);
    }
    kmp_arena_free(&room);
    return ok;
}

/* Orders the nodes of the compressed graph. False: no memory. */
static bool order_nodes(int nodes, int nz, const int *row, const int *col, const int *node, int64_t *order)
{
    kmp_arena room = {0};
    int64_t *start, *entry;
    int *seen, *by_column, *column, *first;
    bool ok = KMP_ARENA_MAKE(&room, KMP_ROOM(int64_t, nodes + 1, &start), KMP_ROOM(int64_t, nz + nodes, &entry),
                             KMP_ROOM(int, nodes + 1, &seen, &first), KMP_ROOM(int, nz + 1, &by_column, &column));
    klu_l_common common;
    klu_l_defaults(&common);
    common.btf = 0;
    if (ok) {
        int64_t count = 0;
        for (int k = 0; k < nz; k++)
            column[k] = node[col[k]];
        kmp_sort_entries(nodes, nz, column, first, by_column);
        for (int c = 0; c < nodes; c++) {
            entry[count++] = c;
            seen[c] = c + 1;
            for (int e = first[c]; e < first[c + 1]; e++) {
                const int other = node[row[by_column[e]]];
                if (seen[other] != c + 1)
                    entry[count++] = other;
                seen[other] = c + 1;
            }
            start[c + 1] = count;
        }
        klu_l_symbolic *symbolic = klu_l_analyze(nodes, start, entry, &common);
        for (int c = 0; symbolic && c < nodes; c++)
            order[c] = symbolic->Q[c];
        ok = symbolic;
        klu_l_free_symbolic(&symbolic, &common);
    }
    kmp_arena_free(&room);
    return ok;
}

bool kmp_saddle_order(int n, int r, int nz, const int *row, const int *col, const int *group, int64_t *order)
{
    const int size = n + r;
    kmp_arena room = {0};
    int *match, *node, *first, *member, nodes = 0;
    int64_t *of_nodes;
    bool ok = KMP_ARENA_MAKE(&room, KMP_ROOM(int, r + 1, &match), KMP_ROOM(int, size, &node, &member),
                             KMP_ROOM(int, size + 1, &first), KMP_ROOM(int64_t, size, &of_nodes)) &&
              match_rows(n, r, nz, row, col, match);
    if (ok) {
        for (int k = 0; k < size; k++)
            node[k] = -1;
        for (int i = 0; i < r; i++) {
            nodes += i == 0 || group[i] != group[i - 1];
            node[n + i] = nodes - 1;
            if (match[i] >= 0)
                node[match[i]] = nodes - 1;
        }
        for (int k = 0; k < n; k++)
            node[k] = node[k] < 0 ? nodes++ : node[k];
        ok = order_nodes(nodes, nz, row, col, node, of_nodes);
    }
    if (ok) { /* members of a node: coordinates, then multipliers */
        kmp_sort_entries(nodes, size, node, first, member);
        for (int k = 0, at = 0; k < nodes; k++)
            for (int e = first[of_nodes[k]]; e < first[of_nodes[k] + 1]; e++)
                order[at++] = member[e];
    }
    kmp_arena_free(&room);
    return ok;
}
