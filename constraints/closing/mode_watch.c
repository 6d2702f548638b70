/* SPDX-License-Identifier: BSD-3-Clause */
/* Signs of the determinants of Jv's blocks, each factored densely from its entries in J, so that a state costs what its
 * loops cost. */
#include "constraints/closing/mode_watch.h"
#include "base/memory.h"
#include "constraints/closing/random_walk.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

/* -- signs --------------------------------------------------------------------------------------------- */

/* For independent coordinates u. */
static void find_centred(kmp_mode_signs *s, int count, const int *u)
{
    for (int c = 0; c < kmp_charts_count(s->system); c++)
        s->centred[c] = true;
    for (int k = 0; k < count; k++) {
        const int chart = kmp_chart_of(s->system, u[k]);
        if (chart >= 0)
            s->centred[chart] = false;
    }
}

/* Lists the kept coordinates in `order`; returns their number. */
static int list_kept(kmp_mode_signs *s, const bool *kept)
{
    int count = 0;
    for (int k = 0; k < s->system->n; k++)
        if (kept[k])
            s->order[count++] = k;
    return count;
}

bool kmp_mode_signs_init(kmp_mode_signs *s, kmp_evaluator *eval, const bool *kept)
{
    const kempe_system *system = eval->system;
    const int n = system->n, charts = system->chart_count;
    *s = (kmp_mode_signs){.system = system, .eval = eval};
    if (!KMP_ARENA_MAKE(&s->arena, KMP_ROOM(int, n, &s->level, &s->column, &s->order),
                        KMP_ROOM(int, system->m, &s->row), KMP_ROOM(int, system->jacobian.count, &s->entry),
                        KMP_ROOM(double, n, &s->unit, &s->place), KMP_ROOM(bool, charts, &s->centred),
                        KMP_ROOM(double, KMP_CHART_SIZE *charts, &s->chart)))
        return false;
    for (int k = 0; k < n; k++)
        s->unit[k] = kmp_walk_unit(system, k);
    find_centred(s, list_kept(s, kept), s->order);
    return true;
}

void kmp_mode_signs_free(kmp_mode_signs *s)
{
    kmp_partition_free(&s->part);
    kmp_arena_free(&s->arena);
}

/* The places of rows, columns and entries of J in the blocks. */
static bool find_places(kmp_mode_signs *s)
{
    const kmp_pattern *j = &s->system->jacobian;
    int largest = 0;
    for (int k = 0; k < s->system->n; k++)
        s->level[k] = s->block_count;
    for (int r = 0; r < s->system->m; r++)
        s->row[r] = -1;
    for (int b = 0; b < s->block_count; b++) {
        const kmp_loop_block *block = &s->blocks[b];
        for (int k = 0; k < block->size; k++) {
            s->level[block->columns[k]] = b;
            s->column[block->columns[k]] = s->row[block->rows[k]] = k;
        }
        largest = block->size > largest ? block->size : largest;
    }
    s->first = KMP_ARENA_NEW(&s->arena, int, s->block_count + 2);
    s->matrix = KMP_ARENA_NEW(&s->arena, double, largest *largest);
    if (s->arena.failed)
        return false;
    for (int e = 0; e < j->count; e++)
        s->first[s->level[j->col[e]] + 1]++;
    for (int b = 0; b <= s->block_count; b++)
        s->first[b + 1] += s->first[b];
    for (int e = 0; e < j->count; e++)
        s->entry[s->first[s->level[j->col[e]]]++] = e;
    for (int b = s->block_count; b > 0; b--)
        s->first[b] = s->first[b - 1];
    s->first[0] = 0;
    return true;
}

bool kmp_mode_signs_choose(kmp_mode_signs *s, const bool *kept, const double *jacobian)
{
    const int count = list_kept(s, kept);
    if (count == 0 || kmp_partition_init(&s->part, s->system, jacobian, s->order, count) != KEMPE_OK)
        (void)kmp_partition_init(&s->part, s->system, jacobian, NULL, 0);
    const int blocks = s->part.r > 0 ? kmp_loop_blocks(s->eval, &s->part, &s->arena, &s->blocks) : 0;
    s->block_count = blocks > 0 ? blocks : 0;
    kmp_context_clear(s->system->context);
    find_centred(s, s->part.p, s->part.u);
    return find_places(s);
}

void kmp_mode_signs_evaluate(kmp_mode_signs *s, double t, const double *q)
{
    memcpy(s->place, q, (size_t)s->system->n * sizeof *q);
    kmp_charts_reset(s->system, s->chart);
    for (int c = 0; c < kmp_charts_count(s->system); c++)
        if (s->centred[c])
            kmp_chart_center(s->system, c, s->chart, s->place, NULL, NULL);
    if (s->system->chart_count > 0)
        kmp_eval_set_charts(s->eval, s->chart);
    kmp_eval_closure(s->eval, t, s->place);
}

/* An entry of J, scaled. */
static double entry_at(const kmp_mode_signs *s, int e)
{
    const kmp_pattern *j = &s->system->jacobian;
    return s->eval->jacobian[e] * s->unit[j->col[e]] / s->system->row_scale[j->row[e]];
}

char kmp_mode_sign(const kmp_mode_signs *s, int b)
{
    const kmp_pattern *j = &s->system->jacobian;
    const int size = s->blocks[b].size;
    int sign = 1;
    double least = INFINITY, most = 0;
    memset(s->matrix, 0, (size_t)(size * size) * sizeof *s->matrix);
    for (int at = s->first[b]; at < s->first[b + 1]; at++) {
        const int e = s->entry[at], row = s->row[j->row[e]];
        if (row >= 0 && s->blocks[b].rows[row] == j->row[e])
            s->matrix[row + s->column[j->col[e]] * size] = entry_at(s, e);
    }
    if (kmp_lu_factor(size, s->matrix, s->order) != 0)
        return '0';
    for (int i = 0; i < size; i++) {
        double u = s->matrix[i + i * size];
        sign = (u < 0) != (s->order[i] != i) ? -sign : sign;
        least = fmin(least, fabs(u));
        most = fmax(most, fabs(u));
    }
    return least < KMP_RANK_SIGN * most ? '0' : sign > 0 ? '+' : '-';
}

/* -- changes ------------------------------------------------------------------------------------------- */

enum { MOST_TOGETHER = 60 }; /* a block of this size is factored in 0.05 ms */

struct kmp_mode_watch {
    kmp_evaluator *eval;
    kmp_mode_signs signs;
    kmp_arena arena;
    const bool *released; /* m, or NULL; not owned */
    int *reaches;         /* m: the last block that a row has had entries in; -1: none */
    int *candidates;      /* m: rows that can determine a block, block after block */
    int *begins, *of;     /* block_count + 1: the first of each block there; m: the place of a row in its block */
    double *rest;         /* of the candidates, eliminated */
    char *sign;           /* of each block at the last state where it was known */
};

/* Finds the last block whose coordinates each row contains, and the rows of each block. */
static void find_reaches(kmp_mode_watch *w)
{
    const kmp_mode_signs *s = &w->signs;
    const kmp_pattern *j = &s->system->jacobian;
    for (int e = 0; e < j->count; e++) {
        const int b = s->level[j->col[e]], row = j->row[e];
        if (b < s->block_count && b > w->reaches[row] && s->eval->jacobian[e] != 0 &&
            !(w->released && w->released[row]))
            w->reaches[row] = b;
    }
    /* The rows that can determine each block: they contain its coordinates, and otherwise coordinates of blocks solved
     * before it. */
    const int m = s->system->m, blocks = s->block_count;
    memset(w->begins, 0, (size_t)(blocks + 1) * sizeof *w->begins);
    for (int i = 0; i < m; i++)
        if (w->reaches[i] >= 0)
            w->of[i] = w->begins[w->reaches[i] + 1]++;
    for (int b = 0; b < blocks; b++)
        w->begins[b + 1] += w->begins[b];
    for (int i = 0; i < m; i++)
        if (w->reaches[i] >= 0)
            w->candidates[w->begins[w->reaches[i]] + w->of[i]] = i;
}

/* True if the kept coordinates are independent ones and determine the others, in blocks that are not too large. */
static bool choose_signs(kmp_mode_watch *w, const bool *kept, double t, const double *q)
{
    kmp_mode_signs *s = &w->signs;
    const kempe_system *system = s->system;
    double *held = KMP_ARENA_NEW(&w->arena, double, system->jacobian.count + 1);
    int count = 0, largest = 0;
    if (!held)
        return false;
    kmp_mode_signs_evaluate(s, t, q);
    for (int e = 0; e < system->jacobian.count; e++)
        held[e] = w->released && w->released[system->jacobian.row[e]] ? 0 : s->eval->jacobian[e];
    if (!kmp_mode_signs_choose(s, kept, held))
        return false;
    for (int k = 0; k < system->n; k++)
        count += kept[k];
    for (int b = 0; b < s->block_count; b++)
        largest = s->blocks[b].size > largest ? s->blocks[b].size : largest;
    bool fits = s->part.p == count && (s->block_count > 0) == (s->part.r > 0) && largest <= MOST_TOGETHER;
    for (int k = 0; fits && k < count; k++)
        fits = kept[s->part.u[k]];
    return fits &&
           KMP_ARENA_MAKE(&w->arena, KMP_ROOM(int, system->m, &w->reaches, &w->candidates, &w->of),
                          KMP_ROOM(int, s->block_count + 1, &w->begins),
                          KMP_ROOM(double, largest * system->m, &w->rest), KMP_ROOM(char, s->block_count, &w->sign));
}

kmp_mode_watch *kmp_mode_watch_new(const kempe_system *system, const bool *kept, double t, const double *q,
                                   const bool *released)
{
    kmp_mode_watch *w = KMP_NEW(kmp_mode_watch, 1);
    if (!w)
        return NULL;
    w->released = released;
    w->eval = kmp_eval_new_of_closures(system);
    if (!w->eval || !kmp_mode_signs_init(&w->signs, w->eval, kept) || !choose_signs(w, kept, t, q)) {
        kmp_mode_watch_free(w);
        return NULL;
    }
    memset(w->sign, '0', (size_t)w->signs.block_count);
    for (int r = 0; r < system->m; r++)
        w->reaches[r] = -1;
    return w;
}

void kmp_mode_watch_free(kmp_mode_watch *w)
{
    if (!w)
        return;
    kmp_mode_signs_free(&w->signs);
    kmp_eval_free(w->eval);
    kmp_arena_free(&w->arena);
    kmp_free(w);
}

/* The rows of block b with the largest pivots at the current state, in ascending order: where rows are redundant, the
 * determinant of fixed ones changes its sign also where the closures lose no rank. */
static void choose_rows(kmp_mode_watch *w, int b)
{
    kmp_mode_signs *s = &w->signs;
    const kmp_pattern *j = &s->system->jacobian;
    kmp_loop_block *block = &s->blocks[b];
    int *candidate = w->candidates + w->begins[b];
    const int size = block->size, count = w->begins[b + 1] - w->begins[b];
    if (count <= size)
        return;
    memset(w->rest, 0, (size_t)(size * count) * sizeof *w->rest);
    for (int at = s->first[b]; at < s->first[b + 1]; at++) {
        const int e = s->entry[at];
        if (w->reaches[j->row[e]] == b)
            w->rest[w->of[j->row[e]] + s->column[j->col[e]] * count] = entry_at(s, e);
    }
    for (int done = 0; done < size; done++) {
        int row = done, column = 0;
        for (int k = 0; k < size; k++)
            for (int i = done; i < count; i++)
                if (fabs(w->rest[i + k * count]) > fabs(w->rest[row + column * count])) {
                    row = i;
                    column = k;
                }
        kmp_swap_int(&candidate[done], &candidate[row]);
        for (int k = 0; k < size; k++) {
            double value = w->rest[done + k * count];
            w->rest[done + k * count] = w->rest[row + k * count];
            w->rest[row + k * count] = value;
        }
        double pivot = w->rest[done + column * count];
        if (pivot == 0)
            return;
        for (int k = 0; k < size; k++)
            for (int i = done + 1; k != column && i < count; i++)
                w->rest[i + k * count] -= w->rest[i + column * count] / pivot * w->rest[done + k * count];
        for (int i = done + 1; i < count; i++)
            w->rest[i + column * count] = 0;
    }
    for (int k = 0; k < size; k++)
        s->row[block->rows[k]] = -1;
    for (int k = 0; k < size; k++) {
        int i = k;
        for (; i > 0 && block->rows[i - 1] > candidate[k]; i--)
            block->rows[i] = block->rows[i - 1];
        block->rows[i] = candidate[k];
    }
    for (int k = 0; k < size; k++)
        s->row[block->rows[k]] = k;
}

const kmp_loop_block *kmp_mode_watch_next(kmp_mode_watch *w, double t, const double *q)
{
    const kmp_loop_block *changed = NULL;
    kmp_mode_signs_evaluate(&w->signs, t, q);
    find_reaches(w);
    for (int b = 0; b < w->signs.block_count; b++) {
        const char sign = kmp_mode_sign(&w->signs, b);
        if (sign != '0') {
            if (w->sign[b] != '0' && w->sign[b] != sign && !changed)
                changed = &w->signs.blocks[b];
            choose_rows(w, b);
            w->sign[b] = kmp_mode_sign(&w->signs, b);
        }
    }
    return changed;
}
