/* SPDX-License-Identifier: BSD-3-Clause */
/* L D L' over expressions: the order by least degree on the pattern, then columns of L from those before. Entries that
 * are zero by the pattern are never made. */
#include "constraints/programs/writer_ldl.h"

/* -- order --------------------------------------------------------------------------------------------- */

/* State of the search for an order. */
typedef struct search {
    kmp_writer_ldl *ldl;
    unsigned char *pattern;
    int *degree; /* of each unknown: neighbours that are not eliminated yet */
    int *waits;  /* of a trailing unknown: leading ones among them */
    int *list;
} search;

static const unsigned char *row_of(const search *s, int i)
{
    return s->pattern + (size_t)i * (size_t)s->ldl->size;
}

static void count_neighbours(const search *s, int i)
{
    const kmp_writer_ldl *ldl = s->ldl;
    const unsigned char *row = row_of(s, i);
    s->degree[i] = s->waits[i] = 0;
    for (int j = 0; j < ldl->size; j++) {
        bool coupled = row[j] && j != i && ldl->step[j] < 0;
        s->degree[i] += coupled;
        s->waits[i] += coupled && i >= ldl->leading && j < ldl->leading;
    }
}

/* The unknown of least degree, the last one of several: in a tree of bodies leaves come first. */
static int choose(const search *s)
{
    int best = -1;
    for (int i = s->ldl->size; i-- > 0;)
        if (s->ldl->step[i] < 0 && s->waits[i] == 0 && (best < 0 || s->degree[i] < s->degree[best]))
            best = i;
    return best;
}

/* Eliminates an unknown, which couples its neighbours with each other. Returns their number. */
static long eliminate(const search *s, int i, int step)
{
    /* Lists the neighbours of an unknown that are not eliminated. */
    const unsigned char *row = row_of(s, i);
    int count = 0;
    for (int j = 0; j < s->ldl->size; j++)
        if (row[j] && j != i && s->ldl->step[j] < 0)
            s->list[count++] = j;
    size_t size = (size_t)s->ldl->size;
    s->ldl->order[step] = i;
    s->ldl->step[i] = step;
    for (int a = 0; a < count; a++)
        for (int b = 0; b < count; b++)
            s->pattern[(size_t)s->list[a] * size + (size_t)s->list[b]] = 1;
    for (int a = 0; a < count; a++)
        count_neighbours(s, s->list[a]);
    return count;
}

/* Returns the entries of L. */
static int find_order(const search *s)
{
    kmp_writer_ldl *ldl = s->ldl;
    int entries = 0;
    for (int i = 0; i < ldl->size; i++)
        ldl->step[i] = -1;
    for (int i = 0; i < ldl->size; i++)
        count_neighbours(s, i);
    for (int k = 0; k < ldl->size; k++) {
        long degree = eliminate(s, choose(s), k);
        entries += (int)degree;
        ldl->operations += 2 + degree * (degree + 6);
    }
    return entries;
}

/* Lists the entries of L by columns, in the order of elimination; counts them by rows. */
static void list_columns(kmp_writer_ldl *ldl, const unsigned char *pattern)
{
    size_t size = (size_t)ldl->size;
    int entries = 0;
    for (int k = 0; k < ldl->size; k++) {
        const unsigned char *row = pattern + (size_t)ldl->order[k] * size;
        for (int later = k + 1; later < ldl->size; later++)
            if (row[ldl->order[later]]) {
                ldl->row[entries++] = ldl->order[later];
                ldl->row_start[ldl->order[later] + 1]++;
            }
        ldl->start[k + 1] = entries;
    }
}

bool kmp_writer_ldl_analyse(kmp_writer_ldl *ldl, kmp_arena *arena, int size, int leading, unsigned char *pattern)
{
    *ldl = (kmp_writer_ldl){.size = size, .leading = leading};
    search s = {.ldl = ldl, .pattern = pattern};
    KMP_ARENA_EACH(arena, int, size, &ldl->order, &ldl->step, &s.degree, &s.waits, &s.list);
    if (!KMP_ARENA_EACH(arena, int, size + 1, &ldl->start, &ldl->row_start))
        return false;
    int entries = find_order(&s);
    if (!KMP_ARENA_EACH(arena, int, entries, &ldl->row, &ldl->col, &ldl->at))
        return false;
    list_columns(ldl, pattern);
    /* Lists them by rows. `next`: room for `size`. */
    for (int i = 0; i < ldl->size; i++) {
        ldl->row_start[i + 1] += ldl->row_start[i];
        s.list[i] = ldl->row_start[i];
    }
    for (int k = 0; k < ldl->size; k++)
        for (int e = ldl->start[k]; e < ldl->start[k + 1]; e++) {
            int to = s.list[ldl->row[e]]++;
            ldl->col[to] = k;
            ldl->at[to] = e;
        }
    return true;
}

/* -- factors ------------------------------------------------------------------------------------------- */

/* x minus the products of earlier steps for an entry of L D. */
static kmp_ref reduce(const kmp_writer_ldl *ldl, kmp_graph *g, int i, int j, kmp_ref x)
{
    int a = ldl->row_start[i], b = ldl->row_start[j];
    while (a < ldl->row_start[i + 1] && b < ldl->row_start[j + 1]) {
        if (ldl->col[a] == ldl->col[b])
            x = kmp_sub(g, x, kmp_mul(g, ldl->l[ldl->at[a]], ldl->scaled[ldl->at[b]]));
        int step = ldl->col[a];
        a += step <= ldl->col[b];
        b += step >= ldl->col[b];
    }
    return x;
}

/* x minus the products of earlier steps of leading or of trailing unknowns for the diagonal. */
static kmp_ref reduce_diagonal(const kmp_writer_ldl *ldl, kmp_graph *g, int i, bool leading, kmp_ref x)
{
    for (int a = ldl->row_start[i]; a < ldl->row_start[i + 1]; a++)
        if ((ldl->order[ldl->col[a]] < ldl->leading) == leading)
            x = kmp_sub(g, x, kmp_mul(g, ldl->l[ldl->at[a]], ldl->scaled[ldl->at[a]]));
    return x;
}

/* Column k of L, from the columns before it. A trailing unknown's diagonal is that of the Schur complement. */
static bool factor_column(kmp_writer_ldl *ldl, kmp_graph *g, int k, const kmp_ref *matrix)
{
    int i = ldl->order[k], size = ldl->size;
    kmp_ref diagonal = matrix[i * size + i], reduced = reduce_diagonal(ldl, g, i, true, diagonal);
    ldl->diagonal[i] = i < ldl->leading ? diagonal : reduced;
    ldl->pivot[i] = reduce_diagonal(ldl, g, i, false, reduced);
    if (ldl->pivot[i] == KMP_ZERO)
        return false;
    ldl->inverse[i] = kmp_div(g, KMP_ONE, ldl->pivot[i]);
    for (int e = ldl->start[k]; e < ldl->start[k + 1]; e++) {
        ldl->scaled[e] = reduce(ldl, g, ldl->row[e], i, matrix[ldl->row[e] * size + i]);
        ldl->l[e] = kmp_mul(g, ldl->scaled[e], ldl->inverse[i]);
    }
    return true;
}

bool kmp_writer_ldl_factor(kmp_writer_ldl *ldl, kmp_arena *arena, kmp_graph *g, const kmp_ref *matrix)
{
    int entries = ldl->start[ldl->size];
    KMP_ARENA_EACH(arena, kmp_ref, entries, &ldl->l, &ldl->scaled);
    if (!KMP_ARENA_EACH(arena, kmp_ref, ldl->size, &ldl->diagonal, &ldl->pivot, &ldl->inverse))
        return false;
    for (int k = 0; k < ldl->size; k++)
        if (!factor_column(ldl, g, k, matrix))
            return false;
    return true;
}

void kmp_writer_ldl_solve(const kmp_writer_ldl *ldl, kmp_graph *g, int unknowns, kmp_ref *x)
{
    for (int k = 0; k < ldl->size; k++) {
        int i = ldl->order[k];
        for (int a = ldl->row_start[i]; i < unknowns && a < ldl->row_start[i + 1]; a++)
            x[i] = kmp_sub(g, x[i], kmp_mul(g, ldl->l[ldl->at[a]], x[ldl->order[ldl->col[a]]]));
    }
    for (int k = ldl->size; k-- > 0;) {
        int i = ldl->order[k];
        if (i >= unknowns)
            continue;
        x[i] = kmp_mul(g, x[i], ldl->inverse[i]);
        for (int e = ldl->start[k]; e < ldl->start[k + 1]; e++)
            if (ldl->row[e] < unknowns)
                x[i] = kmp_sub(g, x[i], kmp_mul(g, ldl->l[e], x[ldl->row[e]]));
    }
}
