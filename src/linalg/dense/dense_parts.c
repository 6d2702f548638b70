/* SPDX-License-Identifier: BSD-3-Clause */
#include "linalg/dense/dense_parts.h"
#include "base/union_find.h"
#include "linalg/dense/factors.h"
#include <string.h>

/* Joins the unknowns of each entry; the first unknown of a part is its root. `start` has the sizes then, by roots. */
static void find_parts(kmp_dense_parts *p, int *root, const int *row, const int *col)
{
    for (int i = 0; i < p->n; i++)
        root[i] = i;
    for (int k = 0; k < p->entries; k++) {
        const int a = kmp_root_of(root, row[k]), b = kmp_root_of(root, col[k]);
        root[a > b ? a : b] = a > b ? b : a;
    }
    for (int i = 0; i < p->n; i++)
        p->pivot[kmp_root_of(root, i)]++;
}

/* Places parts one after the other. part: of each unknown; first: of each part, its matrix. */
static void place_parts(kmp_dense_parts *p, int *root, int *part, size_t *first)
{
    int *sizes = p->pivot;
    for (int i = 0; i < p->n; i++)
        if (root[i] == i) {
            const size_t size = (size_t)sizes[i];
            part[i] = p->count;
            first[p->count] = p->numbers;
            p->numbers += size * size;
            p->start[p->count + 1] = p->start[p->count] + sizes[i];
            p->count++;
            sizes[i] = 0;
        }
    for (int i = 0; i < p->n; i++) {
        const int own = kmp_root_of(root, i);
        part[i] = part[own];
        p->place[i] = p->start[part[i]] + sizes[own]++;
    }
}

bool kmp_dense_parts_init(kmp_dense_parts *p, kmp_arena *arena, int n, int entries, const int *row, const int *col)
{
    kmp_arena_lent lent;
    kmp_arena room;
    int *root, *part;
    size_t *first;
    *p = (kmp_dense_parts){.n = n, .entries = entries};
    kmp_arena_lend(&room, &lent);
    bool made = KMP_ARENA_MAKE(arena, KMP_ROOM(int, n + 1, &p->start), KMP_ROOM(int, n, &p->place, &p->pivot),
                               KMP_ROOM(int, entries, &p->at), KMP_ROOM(double, n, &p->x)) &&
                KMP_ARENA_MAKE(&room, KMP_ROOM(int, n, &root, &part), KMP_ROOM(size_t, n, &first));
    if (made) {
        find_parts(p, root, row, col);
        place_parts(p, root, part, first);
        for (int k = 0; k < entries; k++) {
            const int own = part[row[k]], from = p->start[own], size = p->start[own + 1] - from;
            p->at[k] = (int)first[own] + p->place[row[k]] - from + (p->place[col[k]] - from) * size;
        }
        p->matrix = KMP_ARENA_NEW(arena, double, p->numbers);
    }
    kmp_arena_free(&room);
    return made && p->matrix;
}

void kmp_dense_parts_clear(kmp_dense_parts *p)
{
    memset(p->matrix, 0, p->numbers * sizeof *p->matrix);
}

int kmp_dense_parts_factor(kmp_dense_parts *p)
{
    double *matrix = p->matrix;
    for (int k = 0; k < p->count; k++) {
        const int from = p->start[k], size = p->start[k + 1] - from,
                  status = kmp_lu_factor(size, matrix, p->pivot + from);
        if (status != 0)
            return from + status;
        matrix += size * size;
    }
    return 0;
}

/* Without a right side the solution of a part is zero. */
static bool has_any(int n, const double *x)
{
    for (int i = 0; i < n; i++)
        if (x[i] != 0)
            return true;
    return false;
}

void kmp_dense_parts_solve(kmp_dense_parts *p, double *x)
{
    const double *matrix = p->matrix;
    for (int i = 0; i < p->n; i++)
        p->x[p->place[i]] = x[i];
    for (int k = 0; k < p->count; k++) {
        const int from = p->start[k], size = p->start[k + 1] - from;
        if (has_any(size, p->x + from))
            kmp_lu_solve(size, matrix, p->pivot + from, 1, p->x + from);
        matrix += size * size;
    }
    for (int i = 0; i < p->n; i++)
        x[i] = p->x[p->place[i]];
}

bool kmp_dense_groups_init(kmp_dense_groups *g, kmp_arena *arena, int n, int matrices, const double *const *matrix)
{
    int *up;
    *g = (kmp_dense_groups){0};
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(int, n, &up, &g->order, &g->of), KMP_ROOM(int, n + 1, &g->start)))
        return false;
    for (int i = 0; i < n; i++)
        up[i] = i;
    for (int m = 0; m < matrices; m++)
        for (int j = 0; matrix[m] && j < n; j++)
            for (int i = 0; i < n; i++)
                if (matrix[m][i + (ptrdiff_t)j * n] != 0) {
                    const int a = kmp_root_of(up, i), b = kmp_root_of(up, j);
                    up[a > b ? a : b] = a > b ? b : a;
                }
    for (int i = 0; i < n; i++) { /* a root is the first of its group */
        const int root = kmp_root_of(up, i);
        g->of[i] = root == i ? g->count++ : g->of[root];
        g->start[g->of[i] + 1]++;
    }
    for (int k = 0; k < g->count; k++)
        g->start[k + 1] += g->start[k];
    for (int i = n; i-- > 0;) /* each group from its end */
        g->order[--g->start[g->of[i] + 1]] = i;
    for (int k = 0; k < g->count; k++)
        g->start[k] = g->start[k + 1];
    g->start[g->count] = n;
    return true;
}
