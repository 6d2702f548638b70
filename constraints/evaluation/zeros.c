/* SPDX-License-Identifier: BSD-3-Clause */
/* Sets of coordinates are rows of bits. The order of elimination is that of least degree (Tinney and Walker 1967;
 * George and Liu, SIAM Review 31 (1989) 1). */
#include "constraints/evaluation/zeros.h"
#include "constraints/partition/reduction.h"
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

/* Bounds on degrees of freedom: fewer gain nothing by indices, and more need too much memory for dense matrices. */
enum { LEAST = 8, MOST = 1024 };
/* Parts of X, and of the products of the factor, below which sparse operations cost less than dense ones. */
#define MOST_OF_X      0.5
#define MOST_OF_FACTOR 0.5

/* -- sets ---------------------------------------------------------------------------------------------- */

typedef struct sets {
    int words;
    uint64_t *bits;
} sets;

static sets sets_new(kmp_zeros *z, int count, int size)
{
    int words = (size + 63) / 64;
    return (sets){words, KMP_ARENA_NEW(&z->scratch, uint64_t, (size_t)count * (size_t)words)};
}

static uint64_t *set_at(sets s, int k)
{
    return s.bits + (size_t)k * (size_t)s.words;
}

static void put(sets s, int k, int i)
{
    set_at(s, k)[i / 64] |= (uint64_t)1 << ((unsigned)i % 64);
}

static void take_out(sets s, int k, int i)
{
    set_at(s, k)[i / 64] &= ~((uint64_t)1 << ((unsigned)i % 64));
}

static bool has(sets s, int k, int i)
{
    return (set_at(s, k)[i / 64] >> ((unsigned)i % 64) & 1u) != 0;
}

static void join(sets s, int k, const uint64_t *other)
{
    uint64_t *own = set_at(s, k);
    for (int w = 0; w < s.words; w++)
        own[w] |= other[w];
}

static bool meet(sets s, int k, const uint64_t *other)
{
    const uint64_t *own = set_at(s, k);
    for (int w = 0; w < s.words; w++)
        if (own[w] & other[w])
            return true;
    return false;
}

static int size_of(sets s, int k, int most)
{
    int size = 0;
    for (int i = 0; i < most; i++)
        size += has(s, k, i);
    return size;
}

/* -- X ------------------------------------------------------------------------------------------------- */

/* For each v, the u that move it: those of its block's rows, and of later blocks in these rows. */
static bool find_reach(kmp_zeros *z, const kmp_reduction *red, sets reach, int *block_of_column)
{
    sets of_block = sets_new(z, z->blocks + 1, z->p);
    int *block_of_row = KMP_ARENA_NEW(&z->scratch, int, red->r + 1);
    if (z->scratch.failed)
        return false;
    for (int b = 0, count; b < z->blocks; b++) {
        const int *columns = kmp_block_columns(red->block, b, &count), *rows = kmp_block_rows(red->block, b);
        for (int i = 0; i < count; i++) {
            block_of_row[rows[i]] = b;
            block_of_column[columns[i]] = b;
        }
    }
    for (int k = 0; k < red->ju_count; k++)
        put(of_block, block_of_row[red->ju_row[k]], red->ju_col[k]);
    for (int b = z->blocks - 1; b >= 0; b--)
        for (int k = 0; k < red->jv_count; k++)
            if (block_of_row[red->jv_row[k]] == b && block_of_column[red->jv_col[k]] != b)
                join(of_block, b, set_at(of_block, block_of_column[red->jv_col[k]]));
    for (int i = 0; i < red->r; i++)
        join(reach, i, set_at(of_block, block_of_column[i]));
    return true;
}

/* Columns of X as sets of coordinates, and lists of them; the blocks that each pair of columns reaches. */
static bool list_x(kmp_zeros *z, const kmp_reduction *red, sets reach, const int *block_of_column, sets x)
{
    const kmp_partition *part = red->part;
    long count = z->p;
    for (int i = 0; i < part->r; i++)
        count += size_of(reach, i, z->p);
    if ((double)count > MOST_OF_X * z->n * z->p)
        return false;
    if (!KMP_ARENA_MAKE(z->arena, KMP_ROOM(int, z->p + 1, &z->x_start), KMP_ROOM(int, count, &z->x_row),
                        KMP_ROOM(int, count - z->p + 1, &z->b_row),
                        KMP_ROOM(char, (size_t)(z->p + 1) / 2 * (size_t)(z->blocks + 1), &z->used)))
        return false;
    int *b = z->b_row;
    for (int k = 0; k < z->p; k++) {
        put(x, k, part->u[k]);
        for (int i = 0; i < part->r; i++)
            if (has(reach, i, k)) {
                put(x, k, part->v[i]);
                *b++ = i;
                z->used[k / 2 * z->blocks + block_of_column[i]] = 1;
            }
        z->x_start[k + 1] = z->x_start[k];
        for (int i = 0; i < z->n; i++)
            if (has(x, k, i))
                z->x_row[z->x_start[k + 1]++] = i;
    }
    return true;
}

static bool find_x(kmp_zeros *z, const kmp_reduction *red, sets x)
{
    sets reach = sets_new(z, red->r + 1, z->p);
    int *block_of_column = KMP_ARENA_NEW(&z->scratch, int, red->r + 1);
    return find_reach(z, red, reach, block_of_column) && list_x(z, red, reach, block_of_column, x);
}

/* -- M and X' M X ---------------------------------------------------------------------------------------- */

static bool list_mass(kmp_zeros *z, const kmp_pattern *m)
{
    z->m_start = KMP_ARENA_NEW(z->arena, int, z->n + 1);
    KMP_ARENA_EACH(z->arena, int, 2 * m->count, &z->m_row, &z->m_entry);
    int *next = KMP_ARENA_NEW(&z->scratch, int, z->n);
    if (z->arena->failed || z->scratch.failed)
        return false;
    for (int k = 0; k < m->count; k++) {
        z->m_start[m->col[k] + 1]++;
        z->m_start[m->row[k] + 1] += m->row[k] != m->col[k];
    }
    for (int i = 0; i < z->n; i++) {
        z->m_start[i + 1] += z->m_start[i];
        next[i] = z->m_start[i];
    }
    for (int k = 0; k < m->count; k++)
        for (int side = 0; side < (m->row[k] == m->col[k] ? 1 : 2); side++) {
            int at = next[side ? m->row[k] : m->col[k]]++;
            z->m_row[at] = side ? m->col[k] : m->row[k];
            z->m_entry[at] = k;
        }
    return true;
}

/* Pairs of u that the reduced mass couples. */
static bool find_coupled(kmp_zeros *z, sets x, sets coupled)
{
    sets mx = sets_new(z, 1, z->n);
    if (z->scratch.failed)
        return false;
    for (int k = 0; k < z->p; k++) {
        memset(mx.bits, 0, (size_t)mx.words * sizeof *mx.bits);
        for (int e = z->x_start[k]; e < z->x_start[k + 1]; e++)
            for (int i = z->m_start[z->x_row[e]]; i < z->m_start[z->x_row[e] + 1]; i++) {
                put(mx, 0, z->m_row[i]);
                z->mass_products++;
            }
        put(coupled, k, k);
        for (int i = 0; i < z->p; i++)
            if (meet(x, i, mx.bits)) {
                put(coupled, k, i);
                put(coupled, i, k);
            }
    }
    return true;
}

/* -- order and factor ------------------------------------------------------------------------------------ */

/* Eliminates the u of `graph` one after another, the one with the fewest neighbours first; `fill`: the rows of L as
 * sets. */
static bool eliminate(kmp_zeros *z, sets graph, sets fill)
{
    int *degree = KMP_ARENA_NEW(&z->scratch, int, z->p);
    if (!degree)
        return false;
    for (int k = 0; k < z->p; k++)
        degree[k] = size_of(graph, k, z->p);
    for (int c = 0; c < z->p; c++) {
        int least = -1;
        for (int k = 0; k < z->p; k++)
            if (degree[k] >= 0 && (least < 0 || degree[k] < degree[least]))
                least = k;
        z->order[c] = least;
        degree[least] = -1;
        take_out(graph, least, least);
        join(fill, c, set_at(graph, least));
        for (int k = 0; k < z->p; k++)
            if (has(graph, least, k)) {
                join(graph, k, set_at(graph, least));
                take_out(graph, k, least);
                degree[k] = size_of(graph, k, z->p);
            }
    }
    return true;
}

/* Lists sets of u in the order of elimination. */
static bool list_columns(kmp_zeros *z, sets of, bool by_u, int from, int **start, int **row)
{
    long count = 0;
    for (int c = 0; c < z->p; c++)
        count += size_of(of, c, z->p);
    *start = KMP_ARENA_NEW(z->arena, int, z->p + 1);
    *row = KMP_ARENA_NEW(z->arena, int, count + z->p);
    if (!*start || !*row)
        return false;
    for (int c = 0; c < z->p; c++) {
        (*start)[c + 1] = (*start)[c];
        for (int i = c + from; i < z->p; i++)
            if (has(of, by_u ? z->order[c] : c, z->order[i]))
                (*row)[(*start)[c + 1]++] = i;
    }
    return true;
}

static void count_factor(kmp_zeros *z)
{
    for (int c = 0; c < z->p; c++) {
        long below = z->l_start[c + 1] - z->l_start[c];
        z->factor_products += below * (below + 1) / 2;
    }
    z->l_entries = z->l_start[z->p];
}

static void count_x(kmp_zeros *z)
{
    for (int e = 0; e < z->mr_start[z->p]; e++)
        z->x_products += z->x_start[z->order[z->mr_row[e]] + 1] - z->x_start[z->order[z->mr_row[e]]];
}

static bool order_factor(kmp_zeros *z, sets coupled)
{
    sets graph = sets_new(z, z->p, z->p), fill = sets_new(z, z->p, z->p);
    z->order = KMP_ARENA_NEW(z->arena, int, z->p);
    if (z->scratch.failed || !z->order)
        return false;
    memcpy(graph.bits, coupled.bits, (size_t)z->p * (size_t)graph.words * sizeof *graph.bits);
    if (!eliminate(z, graph, fill) || !list_columns(z, fill, false, 1, &z->l_start, &z->l_row))
        return false;
    count_factor(z);
    z->whole = (double)z->factor_products > MOST_OF_FACTOR * (double)kmp_cholesky_factor_flops(z->p).mul;
    for (int k = 0; z->whole && k < z->p; k++)
        z->order[k] = k;
    if (!list_columns(z, coupled, true, 0, &z->mr_start, &z->mr_row))
        return false;
    count_x(z);
    return true;
}

/* -- all together ------------------------------------------------------------------------------------------ */

static void count_solves(kmp_zeros *z, const kmp_reduction *red)
{
    for (int k = 0; k < z->p; k++)
        kmp_flops_add(&z->solves, 1, kmp_block_solve_flops_some(red->block, z->used + k / 2 * z->blocks));
}

kmp_zeros *kmp_zeros_new(const kmp_reduction *red, kmp_arena *arena)
{
    const kmp_partition *part = red->part;
    kmp_zeros *z = part->p < LEAST || part->p > MOST ? NULL : KMP_ARENA_NEW(arena, kmp_zeros, 1);
    if (!z)
        return NULL;
    *z = (kmp_zeros){.part = part, .arena = arena, .n = part->n, .p = part->p, .blocks = kmp_block_count(red->block)};
    z->column = KMP_ARENA_NEW(z->arena, double, z->n);
    z->packed = KMP_ARENA_NEW(z->arena, double, z->p);
    sets x = sets_new(z, z->p, z->n), coupled = sets_new(z, z->p, z->p);
    bool some = !z->arena->failed && !z->scratch.failed && find_x(z, red, x) &&
                list_mass(z, &red->eval->system->mass) && find_coupled(z, x, coupled) && order_factor(z, coupled) &&
                (part->r > 0 || !z->whole);
    kmp_arena_free(&z->scratch);
    if (some && red->block)
        count_solves(z, red);
    return some ? z : NULL;
}

/* -- numbers ------------------------------------------------------------------------------------------------ */

void kmp_zeros_spread(const kmp_zeros *z, const double *bvu, const double *s, double *out)
{
    const int *row = z->b_row;
    for (int k = 0; k < z->p; k++, bvu += z->n - z->p)
        for (int e = z->x_start[k] - k; e < z->x_start[k + 1] - k - 1; e++)
            out[z->part->v[row[e]]] += bvu[row[e]] * s[k];
}

void kmp_zeros_project(const kmp_zeros *z, const double *x, const double *force, double *out)
{
    for (int k = 0; k < z->p; k++, x += z->n) {
        double sum = 0;
        for (int e = z->x_start[k]; e < z->x_start[k + 1]; e++)
            sum += x[z->x_row[e]] * force[z->x_row[e]];
        out[k] = -sum;
    }
}

/* column = M x */
static void mass_times(const kmp_zeros *z, const double *x, int k, const double *mass)
{
    double *column = z->column;
    memset(column, 0, (size_t)z->n * sizeof *column);
    for (int e = z->x_start[k]; e < z->x_start[k + 1]; e++) {
        int j = z->x_row[e];
        double by = x[j];
        for (int i = z->m_start[j]; i < z->m_start[j + 1]; i++)
            column[z->m_row[i]] += mass[z->m_entry[i]] * by;
    }
}

void kmp_zeros_reduce(const kmp_zeros *z, const double *x, const double *mass, double *mr)
{
    for (int c = 0; c < z->p; c++) {
        int k = z->order[c];
        double *to = mr + (size_t)c * (size_t)z->p;
        mass_times(z, x + (size_t)k * (size_t)z->n, k, mass);
        if (z->whole)
            memset(to + c, 0, (size_t)(z->p - c) * sizeof *to);
        else
            for (int e = z->l_start[c]; e < z->l_start[c + 1]; e++)
                to[z->l_row[e]] = 0;
        for (int e = z->mr_start[c]; e < z->mr_start[c + 1]; e++) {
            int i = z->order[z->mr_row[e]];
            const double *other = x + (size_t)i * (size_t)z->n;
            double sum = 0;
            for (int f = z->x_start[i]; f < z->x_start[i + 1]; f++)
                sum += other[z->x_row[f]] * z->column[z->x_row[f]];
            to[z->mr_row[e]] = sum;
        }
    }
}

int kmp_zeros_factor(const kmp_zeros *z, double *mr)
{
    if (z->whole)
        return kmp_cholesky_factor(z->p, mr);
    for (int c = 0; c < z->p; c++) {
        const int *row = z->l_row + z->l_start[c];
        int count = z->l_start[c + 1] - z->l_start[c];
        double *own = mr + (size_t)c * (size_t)z->p;
        if (!(own[c] > 0.0 && own[c] <= DBL_MAX))
            return 1 + z->order[c];
        own[c] = sqrt(own[c]);
        for (int e = 0; e < count; e++)
            z->packed[e] = own[row[e]] /= own[c];
        for (int e = 0; e < count; e++) {
            double *to = mr + (size_t)row[e] * (size_t)z->p, by = z->packed[e];
            for (int f = e; f < count; f++)
                to[row[f]] -= z->packed[f] * by;
        }
    }
    return 0;
}

void kmp_zeros_solve(const kmp_zeros *z, const double *mr, double *b)
{
    if (z->whole) {
        kmp_cholesky_solve(z->p, mr, b);
        return;
    }
    double *x = z->packed;
    for (int c = 0; c < z->p; c++)
        x[c] = b[z->order[c]];
    for (int c = 0; c < z->p; c++) {
        const double *own = mr + (size_t)c * (size_t)z->p;
        double by = x[c] /= own[c];
        for (int e = z->l_start[c]; e < z->l_start[c + 1]; e++)
            x[z->l_row[e]] -= own[z->l_row[e]] * by;
    }
    for (int c = z->p - 1; c >= 0; c--) {
        const double *own = mr + (size_t)c * (size_t)z->p;
        double sum = x[c];
        for (int e = z->l_start[c]; e < z->l_start[c + 1]; e++)
            sum -= own[z->l_row[e]] * x[z->l_row[e]];
        x[c] = sum / own[c];
    }
    for (int c = 0; c < z->p; c++)
        b[z->order[c]] = x[c];
}
