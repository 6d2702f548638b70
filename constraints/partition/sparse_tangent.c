/* SPDX-License-Identifier: BSD-3-Clause */
/* Sets of coordinates are rows of bits. The order of elimination is the order of least degree (Tinney and Walker 1967;
 * George and Liu, SIAM Review 31 (1989) 1). */
#include "constraints/partition/sparse_tangent.h"
#include "base/clones.h"
#include "constraints/partition/reduction.h"
#include "linalg/sparse.h"
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

/* Bounds on degrees of freedom: fewer gain nothing by indices, and more need too much memory for dense matrices. */
enum { LEAST = 8, MOST = 1024 };
/* Parts of X, and of the products of the factor, below which sparse operations cost less than dense ones. A larger X is
 * taken without zeros too: its rows are computed in fours. */
enum { LARGE_X = 1024 };
#define MOST_OF_X      0.5
#define MOST_OF_FACTOR 0.5

/* -- sets ---------------------------------------------------------------------------------------------- */

typedef struct sets {
    int words;
    uint64_t *bits;
} sets;

static sets sets_new(kmp_sparse_tangent *z, int count, int size)
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

/* The least member of a set beyond k, of sets as `s`; -1: none. */
static int next_member(sets s, const uint64_t *set, int k)
{
    for (int w = (k + 1) / 64, first = (k + 1) % 64; w < s.words; w++, first = 0) {
        const uint64_t left = set[w] >> first;
        if (left)
            return 64 * w + first + __builtin_ctzll(left);
    }
    return -1;
}

static int size_of(sets s, int k, int most)
{
    int size = 0;
    for (int i = 0; i < most; i++)
        size += has(s, k, i);
    return size;
}

/* The members 0 .. size - 1 of all sets; `runs`: of sets of fours, the runs of their positions. */
static bool list_all(kmp_sparse_tangent *z, sets s, int count, int size, bool runs, kmp_lists *out)
{
    int total = 0;
    for (int k = 0; k < count; k++)
        total += size_of(s, k, size);
    if (!KMP_ARENA_MAKE(z->arena, KMP_ROOM(int, count + 1, &out->start),
                        KMP_ROOM(int, (runs ? 2 : 1) * total + 1, &out->at)))
        return false;
    for (int k = 0; k < count; k++) {
        int *end = &out->start[k + 1];
        *end = out->start[k];
        for (int i = 0; i < size; i++) {
            if (!has(s, k, i))
                continue;
            if (!runs)
                out->at[(*end)++] = i;
            else if (i == 0 || !has(s, k, i - 1))
                out->at[2 * (*end)++] = KMP_FOUR * i;
            if (runs)
                out->at[2 * *end - 1] = KMP_FOUR * (i + 1);
        }
    }
    return true;
}

/* -- X ------------------------------------------------------------------------------------------------- */

/* Sets of u, then of positions. */
typedef struct finder {
    kmp_sparse_tangent *z;
    const kmp_reduction *red;
    sets reach;   /* of each block of Jv: the u that move its v */
    sets coupled; /* of each u: the coordinates that the reduced mass couples with it */
    sets factor;  /* of each position: the later ones in its column of the factor */
} finder;

/* The u of each block: the coordinates of its rows, and of later blocks in these rows. */
static bool find_reach(finder *f)
{
    kmp_sparse_tangent *z = f->z;
    const kmp_reduction *red = f->red;
    int *block_of_row, *block_of_entry, *start, *entry;
    f->reach = sets_new(z, z->blocks + 1, z->p);
    z->block_of = KMP_ARENA_NEW(z->arena, int, red->r + 1);
    if (!KMP_ARENA_MAKE(&z->scratch, KMP_ROOM(int, red->r + 1, &block_of_row),
                        KMP_ROOM(int, red->jv_count + 1, &block_of_entry, &entry),
                        KMP_ROOM(int, z->blocks + 1, &start)) ||
        !z->block_of)
        return false;
    for (int b = 0, count; b < z->blocks; b++) {
        const int *columns = kmp_block_columns(red->block, b, &count), *rows = kmp_block_rows(red->block, b);
        for (int i = 0; i < count; i++) {
            block_of_row[rows[i]] = b;
            z->block_of[columns[i]] = b;
        }
    }
    for (int k = 0; k < red->ju_count; k++)
        put(f->reach, block_of_row[red->ju_row[k]], red->ju_col[k]);
    for (int k = 0; k < red->jv_count; k++)
        block_of_entry[k] = block_of_row[red->jv_row[k]];
    kmp_sort_entries(z->blocks, red->jv_count, block_of_entry, start, entry);
    for (int b = z->blocks - 1; b >= 0; b--)
        for (int e = start[b]; e < start[b + 1]; e++) {
            const int other = z->block_of[red->jv_col[entry[e]]];
            if (other != b)
                join(f->reach, b, set_at(f->reach, other));
        }
    return true;
}

/* The independent coordinates that move coordinate i: itself, or the coordinates that move its block. `own` has room
 * for one. */
static const uint64_t *moved_by(const finder *f, sets own, int i)
{
    const int place = f->red->place[i];
    if (place >= 0)
        return set_at(f->reach, f->z->block_of[place]);
    memset(own.bits, 0, (size_t)own.words * sizeof *own.bits);
    put(own, 0, -1 - place);
    return own.bits;
}

/* Lists of columns of X: of coordinates, and of v. */
static bool list_x(finder *f)
{
    kmp_sparse_tangent *z = f->z;
    const kmp_partition *part = z->part;
    sets own = sets_new(z, 1, z->p);
    int *next = KMP_ARENA_NEW(&z->scratch, int, z->p);
    z->x_start = KMP_ARENA_NEW(z->arena, int, z->p + 1);
    if (z->scratch.failed || !z->x_start)
        return false;
    for (int i = 0; i < z->n; i++) {
        const uint64_t *by = moved_by(f, own, i);
        for (int k = -1; (k = next_member(own, by, k)) >= 0;)
            z->x_start[k + 1]++;
    }
    for (int k = 0; k < z->p; k++) {
        z->x_start[k + 1] += z->x_start[k];
        next[k] = z->x_start[k];
    }
    const int count = z->x_start[z->p];
    if ((z->n * z->p < LARGE_X && (double)count > MOST_OF_X * z->n * z->p) ||
        !KMP_ARENA_MAKE(z->arena, KMP_ROOM(int, count, &z->x_row), KMP_ROOM(int, count - z->p + 1, &z->b_row)))
        return false;
    for (int i = 0; i < z->n; i++) {
        const uint64_t *by = moved_by(f, own, i);
        for (int k = -1; (k = next_member(own, by, k)) >= 0;)
            z->x_row[next[k]++] = i;
    }
    for (int k = 0; k < z->p; k++)
        next[k] = z->x_start[k] - k;
    for (int i = 0; i < part->r; i++)
        for (int k = -1; (k = next_member(own, set_at(f->reach, z->block_of[i]), k)) >= 0;)
            z->b_row[next[k]++] = i;
    return true;
}

/* -- M and X' M X ---------------------------------------------------------------------------------------- */

/* Both triangles by rows, with the columns' coordinates as places for now. */
static bool list_mass(kmp_sparse_tangent *z, const kmp_pattern *m)
{
    z->m_start = KMP_ARENA_NEW(z->arena, int, z->n + 1);
    KMP_ARENA_EACH(z->arena, int, 2 * m->count, &z->m_place, &z->m_entry);
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
            z->m_place[at] = side ? m->col[k] : m->row[k];
            z->m_entry[at] = k;
        }
    return true;
}

/* Pairs of u that the reduced mass couples: the ones that move a coordinate, with the ones that move a row of M X. */
static bool find_coupled(finder *f)
{
    kmp_sparse_tangent *z = f->z;
    sets mx = sets_new(z, 1, z->p), own = sets_new(z, 1, z->p);
    f->coupled = sets_new(z, z->p, z->p);
    if (z->scratch.failed)
        return false;
    for (int k = 0; k < z->p; k++) {
        for (int e = z->x_start[k]; e < z->x_start[k + 1]; e++)
            z->mass_products += z->m_start[z->x_row[e] + 1] - z->m_start[z->x_row[e]];
        put(f->coupled, k, k);
    }
    for (int i = 0; i < z->n; i++) {
        memset(mx.bits, 0, (size_t)mx.words * sizeof *mx.bits);
        for (int e = z->m_start[i]; e < z->m_start[i + 1]; e++)
            join(mx, 0, moved_by(f, own, z->m_place[e]));
        const uint64_t *by = moved_by(f, own, i);
        for (int k = -1; (k = next_member(own, by, k)) >= 0;)
            join(f->coupled, k, mx.bits);
    }
    return true;
}

/* -- order and factor ------------------------------------------------------------------------------------ */

/* Eliminates the u of `graph` one after another, the one with the fewest neighbours first; `fill`: the columns of the
 * factor as sets of u. */
static bool eliminate(kmp_sparse_tangent *z, sets graph, sets fill)
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

static void count_factor(finder *f)
{
    kmp_sparse_tangent *z = f->z;
    z->factor_products = z->l_entries = 0;
    for (int c = 0; c < z->p; c++) {
        long below = size_of(f->factor, c, z->p);
        z->factor_products += below * (below + 1) / 2;
        z->l_entries += below;
    }
}

/* The columns of the factor, by an order of little fill or, if that saves little, in the order of u and full. */
static bool order_factor(finder *f)
{
    kmp_sparse_tangent *z = f->z;
    sets graph = sets_new(z, z->p, z->p), fill = sets_new(z, z->p, z->p);
    f->factor = sets_new(z, z->p, z->p);
    z->order = KMP_ARENA_NEW(z->arena, int, z->p);
    if (z->scratch.failed || !z->order)
        return false;
    memcpy(graph.bits, f->coupled.bits, (size_t)z->p * (size_t)graph.words * sizeof *graph.bits);
    if (!eliminate(z, graph, fill))
        return false;
    for (int c = 0; c < z->p; c++)
        for (int i = c + 1; i < z->p; i++)
            if (has(fill, c, z->order[i]))
                put(f->factor, c, i);
    count_factor(f);
    z->whole = (double)z->factor_products > MOST_OF_FACTOR * (double)kmp_cholesky_factor_flops(z->p).mul;
    for (int c = 0; z->whole && c < z->p; c++) {
        z->order[c] = c;
        for (int i = c + 1; i < z->p; i++)
            put(f->factor, c, i);
    }
    count_factor(f);
    for (int c = 0; c < z->p; c++)
        for (int i = c; i < z->p; i++)
            if (has(f->coupled, z->order[c], z->order[i]))
                z->x_products += z->x_start[z->order[i] + 1] - z->x_start[z->order[i]];
    return list_all(z, f->factor, z->p, z->p, false, &z->l);
}

/* -- fours ----------------------------------------------------------------------------------------------- */

static int fours_of(const kmp_sparse_tangent *z)
{
    return z->stride / KMP_FOUR;
}

static bool list_reach(finder *f, sets fours)
{
    kmp_sparse_tangent *z = f->z;
    sets positions = sets_new(z, z->blocks + 1, z->p);
    if (z->scratch.failed)
        return false;
    for (int b = 0; b < z->blocks; b++)
        for (int c = 0; c < z->p; c++)
            if (has(f->reach, b, z->order[c])) {
                put(positions, b, c);
                put(fours, b, c / KMP_FOUR);
            }
    return list_all(z, positions, z->blocks, z->p, false, &z->reach) &&
           list_all(z, fours, z->blocks, fours_of(z), true, &z->reach_runs);
}

static bool list_mass_times_x(kmp_sparse_tangent *z, sets reach_fours)
{
    sets fours = sets_new(z, z->n, fours_of(z));
    if (z->scratch.failed)
        return false;
    for (int i = 0; i < z->n; i++)
        for (int e = z->m_start[i]; e < z->m_start[i + 1]; e++) {
            int at = z->m_place[e];
            if (at >= 0)
                put(fours, i, at / KMP_FOUR);
            else
                join(fours, i, set_at(reach_fours, z->block_of[-1 - at]));
        }
    return list_all(z, fours, z->n, fours_of(z), true, &z->mx_runs);
}

/* Tiles of the factor, of four rows and columns, with the tiles that elimination by tiles fills. */
static bool list_tiles(finder *f)
{
    kmp_sparse_tangent *z = f->z;
    int count = fours_of(z);
    sets tiles = sets_new(z, count, count);
    if (z->scratch.failed)
        return false;
    for (int k = 0; k < count; k++)
        put(tiles, k, k);
    for (int c = 0; c < z->p; c++)
        for (int e = z->l.start[c]; e < z->l.start[c + 1]; e++)
            put(tiles, c / KMP_FOUR, z->l.at[e] / KMP_FOUR);
    for (int k = 0; k < count; k++)
        for (int i = k + 1; i < count; i++)
            for (int j = i; has(tiles, k, i) && j < count; j++)
                if (has(tiles, k, j))
                    put(tiles, i, j);
    return list_all(z, tiles, count, count, false, &z->tiles);
}

static bool place_fours(finder *f)
{
    kmp_sparse_tangent *z = f->z;
    int r = f->red->r, nonzeros = z->x_start[z->p] - z->p;
    size_t room = (size_t)r * (size_t)z->stride;
    sets reach_fours = sets_new(z, z->blocks + 1, fours_of(z));
    if (z->scratch.failed ||
        !KMP_ARENA_MAKE(z->arena, KMP_ROOM(int, z->n, &z->place), KMP_ROOM(int, f->red->ju_count + 1, &z->ju_place),
                        KMP_ROOM(int, nonzeros + 1, &z->in_b, &z->in_bvu, &z->in_x)))
        return false;
    z->right = kmp_arena_aligned(z->arena, room + 1);
    z->b = kmp_arena_aligned(z->arena, room + 1);
    z->row = kmp_arena_aligned(z->arena, (size_t)z->stride);
    z->packed = kmp_arena_aligned(z->arena, (size_t)z->stride);
    for (int c = 0; c < z->p; c++)
        z->place[z->part->u[z->order[c]]] = c;
    for (int i = 0; i < z->part->r; i++)
        z->place[z->part->v[i]] = -1 - i;
    for (int e = 0; e < z->m_start[z->n]; e++)
        z->m_place[e] = z->place[z->m_place[e]];
    if (z->arena->failed || !list_reach(f, reach_fours))
        return false;
    /* Places of Ju's entries in `right`, and of the nonzeros of Bvu wherever they are kept. */
    const kmp_reduction *red = f->red;
    int at = 0;
    for (int k = 0; k < red->ju_count; k++)
        z->ju_place[k] = red->ju_row[k] * z->stride + z->place[z->part->u[red->ju_col[k]]];
    for (int i = 0; i < red->r; i++)
        for (int e = z->reach.start[z->block_of[i]]; e < z->reach.start[z->block_of[i] + 1]; e++, at++) {
            int c = z->reach.at[e], k = z->order[c];
            z->in_b[at] = i * z->stride + c;
            z->in_bvu[at] = i + k * red->r;
            z->in_x[at] = z->part->v[i] + k * z->n;
        }
    return list_mass_times_x(z, reach_fours) && list_tiles(f);
}

/* -- all together ------------------------------------------------------------------------------------------ */

/* Operations of the solutions for Bvu. */
static bool count_solves(finder *f)
{
    kmp_sparse_tangent *z = f->z;
    char *used = KMP_ARENA_NEW(&z->scratch, char, z->blocks + 1);
    for (int k = 0; used && z->blocks > 0 && k < z->p; k++) {
        for (int b = 0; b < z->blocks; b++)
            used[b] = has(f->reach, b, k);
        kmp_flops_add(&z->solves, 1, kmp_block_solve_flops(f->red->block, used));
    }
    return used;
}

kmp_sparse_tangent *kmp_sparse_tangent_new(const kmp_reduction *red, kmp_arena *arena)
{
    const kmp_partition *part = red->part;
    kmp_sparse_tangent *z = part->p < LEAST || part->p > MOST ? NULL : KMP_ARENA_NEW(arena, kmp_sparse_tangent, 1);
    if (!z)
        return NULL;
    *z = (kmp_sparse_tangent){.part = part,
                              .arena = arena,
                              .n = part->n,
                              .p = part->p,
                              .blocks = kmp_block_count(red->block),
                              .stride = kmp_sparse_tangent_stride(part->p)};
    finder f = {.z = z, .red = red};
    bool some = find_reach(&f) && list_x(&f) && list_mass(z, &red->eval->system->mass) && find_coupled(&f) &&
                order_factor(&f) && (part->r > 0 || !z->whole) && place_fours(&f) && count_solves(&f);
    kmp_arena_free(&z->scratch);
    return some ? z : NULL;
}

/* Every element of a result is computed by the operations of a plain loop over its nonzeros, in the order of that loop;
 * zeros that pad a four change no bit. */

/* -- X ------------------------------------------------------------------------------------------------- */

void kmp_sparse_tangent_spread(const kmp_sparse_tangent *z, const double *bvu, const double *s, double *out)
{
    const int *row = z->b_row;
    for (int k = 0; k < z->p; k++, bvu += z->n - z->p)
        for (int e = z->x_start[k] - k; e < z->x_start[k + 1] - k - 1; e++)
            out[z->part->v[row[e]]] += bvu[row[e]] * s[k];
}

void kmp_sparse_tangent_project(const kmp_sparse_tangent *z, const double *x, const double *force, double *out)
{
    for (int k = 0; k < z->p; k++, x += z->n) {
        double sum = 0;
        for (int e = z->x_start[k]; e < z->x_start[k + 1]; e++)
            sum += x[z->x_row[e]] * force[z->x_row[e]];
        out[k] = -sum;
    }
}

void kmp_sparse_tangent_tangent(const kmp_sparse_tangent *z, const kmp_reduction *red, const double *jacobian)
{
    int count = z->x_start[z->p] - z->p;
    for (int k = 0; k < red->ju_count; k++)
        z->right[z->ju_place[k]] = -jacobian[red->ju_entry[k]];
    kmp_block_solve_rows(red->block, z->stride, z->reach_runs.start, z->reach_runs.at, z->right, z->b);
    for (int e = 0; e < count; e++)
        red->bvu[z->in_bvu[e]] = red->x[z->in_x[e]] = z->b[z->in_b[e]];
}

/* -- X' M X ---------------------------------------------------------------------------------------------- */

/* The transposed reduced mass is summed up row by row of M X, above the diagonal of mr; then tiles are transposed. */

static KMP_INTO_CLONES void clear_tiles(const kmp_sparse_tangent *z, double *mr)
{
    const kmp_lists *tiles = &z->tiles;
    for (int m = 0; m < z->stride / KMP_FOUR; m++)
        for (int e = tiles->start[m]; e < tiles->start[m + 1]; e++)
            for (int s = 0; s < KMP_FOUR; s++)
                KMP_FOUR_AT(mr + (ptrdiff_t)(KMP_FOUR * tiles->at[e] + s) * z->stride + KMP_FOUR * m) = (kmp_four){0};
}

/* to += by * from at runs of positions, as far as the four of `last`. */
static KMP_INTO_CLONES void add_runs(const int *run, const int *end, double by, const double *restrict from, int last,
                                     double *restrict to)
{
    for (; run < end && run[0] <= last; run += 2)
        for (int c = run[0], before = run[1] <= last ? run[1] : last + 1; c < before; c += KMP_FOUR)
            KMP_FOUR_AT(to + c) += KMP_FOUR_CONST(from + c) * by;
}

static KMP_INTO_CLONES const int *runs_at(const kmp_runs *runs, int k)
{
    return runs->at + (ptrdiff_t)2 * runs->start[k];
}

/* Row i of M X. */
static KMP_INTO_CLONES void multiply_row(const kmp_sparse_tangent *z, const double *mass, int i)
{
    double *row = z->row;
    const double *b = z->b;
    const int *place = z->m_place + z->m_start[i], *entry = z->m_entry + z->m_start[i], *block_of = z->block_of;
    const kmp_runs reach = z->reach_runs;
    int stride = z->stride, count = z->m_start[i + 1] - z->m_start[i];
    for (const int *run = runs_at(&z->mx_runs, i), *end = runs_at(&z->mx_runs, i + 1); run < end; run += 2)
        for (int c = run[0], before = run[1]; c < before; c += KMP_FOUR)
            KMP_FOUR_AT(row + c) = (kmp_four){0};
    for (int k = 0; k < count; k++) {
        int at = place[k];
        double by = mass[entry[k]];
        if (at >= 0)
            row[at] += by;
        else
            add_runs(runs_at(&reach, block_of[-1 - at]), runs_at(&reach, block_of[-1 - at] + 1), by,
                     b + (ptrdiff_t)(-1 - at) * stride, stride, row);
    }
}

static KMP_INTO_CLONES void transpose_tile(int stride, int k, int m, double *mr)
{
    const double *from = mr + (ptrdiff_t)(KMP_FOUR * k) * stride + KMP_FOUR * m;
    double *to = mr + (ptrdiff_t)(KMP_FOUR * m) * stride + KMP_FOUR * k;
    for (int s = 0; s < KMP_FOUR; s++)
        for (int t = 0; t < (k == m ? s : KMP_FOUR); t++)
            to[t * stride + s] = from[s * stride + t];
}

static KMP_CLONES void reduce(const kmp_sparse_tangent *z, const double *mass, double *mr)
{
    const kmp_lists *reach = &z->reach, *tiles = &z->tiles;
    int stride = z->stride;
    clear_tiles(z, mr);
    for (int i = 0; i < z->n; i++) {
        int at = z->place[i];
        const int *run = runs_at(&z->mx_runs, i), *end = runs_at(&z->mx_runs, i + 1);
        multiply_row(z, mass, i);
        if (at >= 0) {
            add_runs(run, end, 1.0, z->row, at, mr + (ptrdiff_t)at * stride);
            continue;
        }
        const double *b = z->b + (ptrdiff_t)(-1 - at) * stride;
        const int *c = reach->at + reach->start[z->block_of[-1 - at]],
                  *last = reach->at + reach->start[z->block_of[-1 - at] + 1];
        for (; c < last; c++)
            add_runs(run, end, b[*c], z->row, *c, mr + (ptrdiff_t)*c * stride);
    }
    for (int m = 0; m < z->stride / KMP_FOUR; m++)
        for (int e = tiles->start[m]; e < tiles->start[m + 1]; e++)
            transpose_tile(z->stride, tiles->at[e], m, mr);
}

void kmp_sparse_tangent_reduce(const kmp_sparse_tangent *z, const double *mass, double *mr)
{
    reduce(z, mass, mr);
}

/* -- factor ---------------------------------------------------------------------------------------------- */

/* Column c of four columns, with the tiles of their rows: its pivot, then its products from the next of the four. */
static KMP_INTO_CLONES bool finish_column(int stride, int last, int count, const int *tile, int c, double *mr)
{
    double *own = mr + (ptrdiff_t)c * stride;
    double pivot = own[c];
    if (!(pivot > 0.0 && pivot <= DBL_MAX))
        return false;
    pivot = sqrt(pivot);
    for (int e = 0; e < count; e++)
        KMP_FOUR_AT(own + KMP_FOUR * tile[e]) /= KMP_FOUR_ALL(pivot);
    own[c] = pivot;
    for (int next = c + 1; next < last; next++) {
        double *to = mr + (ptrdiff_t)next * stride, by = own[next];
        for (int e = 0; e < count; e++)
            KMP_FOUR_AT(to + KMP_FOUR * tile[e]) -= KMP_FOUR_CONST(own + KMP_FOUR * tile[e]) * by;
    }
    return true;
}

/* Subtracts the products of four finished columns from column c, at the tiles. */
static KMP_INTO_CLONES void subtract_four(int stride, int count, const int *tile, const double *four, double *to, int c)
{
    const double *second = four + stride, *third = second + stride, *fourth = third + stride;
    double by[KMP_FOUR] = {four[c], second[c], third[c], fourth[c]};
    for (int e = 0; e < count; e++) {
        int at = KMP_FOUR * tile[e];
        kmp_four sum = KMP_FOUR_AT(to + at);
        sum -= KMP_FOUR_CONST(four + at) * by[0];
        sum -= KMP_FOUR_CONST(second + at) * by[1];
        sum -= KMP_FOUR_CONST(third + at) * by[2];
        sum -= KMP_FOUR_CONST(fourth + at) * by[3];
        KMP_FOUR_AT(to + at) = sum;
    }
}

/* Returns 0, or 1 + the position of a pivot that is not positive. */
static KMP_CLONES int factor(const kmp_sparse_tangent *z, double *mr)
{
    const kmp_lists *tiles = &z->tiles;
    int stride = z->stride;
    for (int m = 0; m < stride / KMP_FOUR; m++) {
        int first = KMP_FOUR * m, last = first + KMP_FOUR < z->p ? first + KMP_FOUR : z->p;
        int count = tiles->start[m + 1] - tiles->start[m];
        const int *tile = tiles->at + tiles->start[m];
        for (int c = first; c < last; c++)
            if (!finish_column(stride, last, count, tile, c, mr))
                return 1 + c;
        for (int e = 1; e < count; e++)
            for (int c = KMP_FOUR * tile[e]; c < KMP_FOUR * tile[e] + KMP_FOUR; c++)
                subtract_four(stride, count - e, tile + e, mr + (ptrdiff_t)first * stride, mr + (ptrdiff_t)c * stride,
                              c);
    }
    return 0;
}

int kmp_sparse_tangent_factor(const kmp_sparse_tangent *z, double *mr)
{
    int fault = factor(z, mr);
    return fault ? 1 + z->order[fault - 1] : 0;
}

/* -- solutions ------------------------------------------------------------------------------------------- */

void kmp_sparse_tangent_solve(const kmp_sparse_tangent *z, const double *mr, double *b)
{
    const int *start = z->l.start, *row = z->l.at;
    double *x = z->packed;
    for (int c = 0; c < z->p; c++)
        x[c] = b[z->order[c]];
    for (int c = 0; c < z->p; c++) {
        const double *own = mr + (size_t)c * (size_t)z->stride;
        double by = x[c] /= own[c];
        for (int e = start[c]; e < start[c + 1]; e++)
            x[row[e]] -= own[row[e]] * by;
    }
    for (int c = z->p - 1; c >= 0; c--) {
        const double *own = mr + (size_t)c * (size_t)z->stride;
        double sum = x[c];
        for (int e = start[c]; e < start[c + 1]; e++)
            sum -= own[row[e]] * x[row[e]];
        x[c] = sum / own[c];
    }
    for (int c = 0; c < z->p; c++)
        b[z->order[c]] = x[c];
}

/* Four solutions, interleaved in x. */
static KMP_CLONES void solve_four(const kmp_sparse_tangent *z, const double *mr, double *x)
{
    const int *start = z->l.start, *row = z->l.at;
    ptrdiff_t stride = z->stride;
    for (int c = 0; c < z->p; c++) {
        const double *own = mr + c * stride;
        kmp_four by = KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * c) / KMP_FOUR_ALL(own[c]);
        KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * c) = by;
        for (int e = start[c]; e < start[c + 1]; e++)
            KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * row[e]) -= by * own[row[e]];
    }
    for (int c = z->p - 1; c >= 0; c--) {
        const double *own = mr + c * stride;
        kmp_four sum = KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * c);
        for (int e = start[c]; e < start[c + 1]; e++)
            sum -= KMP_FOUR_CONST(x + (ptrdiff_t)KMP_FOUR * row[e]) * own[row[e]];
        KMP_FOUR_AT(x + (ptrdiff_t)KMP_FOUR * c) = sum / KMP_FOUR_ALL(own[c]);
    }
}

void kmp_sparse_tangent_solve_four(const kmp_sparse_tangent *z, const double *mr, int count, double *b, int ld,
                                   double *room)
{
    for (int c = 0; c < z->p; c++)
        for (int k = 0; k < KMP_FOUR; k++)
            room[KMP_FOUR * c + k] = k < count ? b[z->order[c] + (ptrdiff_t)k * ld] : 0;
    solve_four(z, mr, room);
    for (int c = 0; c < z->p; c++)
        for (int k = 0; k < count; k++)
            b[z->order[c] + (ptrdiff_t)k * ld] = room[KMP_FOUR * c + k];
}
