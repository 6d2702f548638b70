/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of rows and columns of a scaled J: complete pivoting, then exchanges until no |Bvu| exceeds 1.5. A
 * large J is pivoted on its non-zeros alone, with the same pivots, and its Jv is factored sparse. */
#pragma once

#include "base/arena.h"
#include <stdbool.h>

typedef struct kmp_pick {
    kmp_arena arena;
    int m, n;
    bool dense;     /* unless it is large and sparse */
    double growth;  /* |Bvu| above which columns are exchanged */
    int *row, *col; /* permutations of the rows and columns: the first r of each are chosen */
    int *fixed;     /* n: columns to be chosen last */

    int nz; /* number of entries */
    int *entry_row, *entry_col;
    double *value;
} kmp_pick;

/** Allocates for up to nz entries, initially none, in `room` as far as it suffices (NULL: none). false: no memory; it
 * must be freed also then. */
bool kmp_pick_init(kmp_pick *c, int m, int n, int nz, kmp_arena_lent *room);
void kmp_pick_free(kmp_pick *c);
void kmp_pick_add(kmp_pick *c, int row, int col, double value);

/** Orders rows and columns by complete pivoting, fixed columns (NULL: none) last; pivots: min(m, n). false: no
 * memory. */
bool kmp_pick_pivot(kmp_pick *c, const int *fixed, double *pivots);

typedef enum kmp_pick_outcome { KMP_PICK_MADE, KMP_PICK_SINGULAR, KMP_PICK_NO_MEMORY } kmp_pick_outcome;

/** Makes at most `most` exchanges between the first r columns and the others. Returns their number and max |Bvu|. */
kmp_pick_outcome kmp_pick_improve(kmp_pick *c, int r, int most, int *exchanges, double *max_b);

/** The 1-norm condition number of Jv, the first r rows and columns; for a large one a lower estimate. */
kmp_pick_outcome kmp_pick_condition(kmp_pick *c, int r, double *cond);
