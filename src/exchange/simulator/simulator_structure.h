/* SPDX-License-Identifier: BSD-3-Clause */
/* Entries of J and M that can be nonzero, and independent blocks of loops. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_memory.h"

static bool can_be_nonzero(const char *const *zeros, int row, int column)
{
    return !zeros || zeros[row][column] != '0';
}

static void list_mass(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int count = 0;
    for (int i = 0; i < e->coordinates; i++) {
        part->mass_begin[i] = count;
        for (int j = 0; j < e->coordinates; j++)
            if (can_be_nonzero(e->mass_zeros, i, j))
                part->mass_at[count++] = j;
    }
    part->mass_begin[e->coordinates] = count;
}

/* Marks rows and columns of Jv that are connected by entries with the least index of their rows. */
static void mark_loops(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int r = rank_of(s);
    for (int i = 0; i < r; i++) {
        part->row_mark[i] = i;
        part->column_mark[i] = r;
    }
    for (bool changed = true; changed;) {
        changed = false;
        for (int i = 0; i < r; i++)
            for (int k = 0; k < r; k++) {
                int *row = &part->row_mark[i], *column = &part->column_mark[k];
                if (*row == *column || !can_be_nonzero(e->jacobian_zeros, part->row[i], part->column[k]))
                    continue;
                *row = *column = *row < *column ? *row : *column;
                changed = true;
            }
    }
}

/* Sorts indices by their marks, equal ones in their order. */
static void sort_by_marks(int count, int *mark, int *index)
{
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0 && mark[j - 1] > mark[j]; j--) {
            kmp_swap_int(&mark[j - 1], &mark[j]);
            kmp_swap_int(&index[j - 1], &index[j]);
        }
}

/* Blocks of the sorted choice; 1 where rows and columns of a block differ in number. */
static int count_blocks(struct kempe_simulator_parts *part, int r)
{
    int blocks = 0;
    for (int i = 0; i < r; i++) {
        if (part->row_mark[i] != part->column_mark[i])
            return 1;
        if (i == 0 || part->row_mark[i] != part->row_mark[i - 1])
            part->block[blocks++] = i;
    }
    return blocks;
}

static bool contains(int count, const int *list, int entry)
{
    for (int i = 0; i < count; i++)
        if (list[i] == entry)
            return true;
    return false;
}

/* The slopes of the equations for the choice, which hold in the model's own angles; NULL: there are none. */
static const kempe_slopes *find_slopes(const kempe_simulator *s)
{
    const int r = rank_of(s);
    if (charts_have_moved(s))
        return NULL;
    for (int k = 0; r == least_rank(s->equations) && k < s->equations->slopes_count; k++) {
        const kempe_slopes *slopes = &s->equations->slopes[k];
        bool fits = true;
        for (int i = 0; i < r && fits; i++)
            fits = contains(r, slopes->dependent, s->part.column[i]) && contains(r, slopes->rows, s->part.row[i]);
        if (fits)
            return slopes;
    }
    return NULL;
}

/* Orders the choice by loops that have no coordinate in common: blocks of Jv, one after another. Lists the blocks that
 * move with each independent coordinate. The order depends on the choice alone. */
static void find_structure(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s), count = 0;
    mark_loops(s);
    sort_by_marks(r, part->row_mark, part->row);
    sort_by_marks(r, part->column_mark, part->column);
    part->block[0] = 0;
    part->blocks = count_blocks(part, r);
    part->block[part->blocks] = r;
    clear(r * (f + 1), part->tangent);
    for (int k = 0; k < f; k++) {
        part->touch_begin[k] = count;
        for (int b = 0; b < part->blocks; b++) {
            bool touches = false;
            for (int i = part->block[b]; i < part->block[b + 1]; i++)
                touches = touches || can_be_nonzero(e->jacobian_zeros, part->row[i], part->column[r + k]);
            if (touches)
                part->touch[count++] = b;
        }
    }
    part->touch_begin[f] = count;
    part->slopes = find_slopes(s);
}
