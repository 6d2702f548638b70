/* SPDX-License-Identifier: BSD-3-Clause */
/* The partition of coordinates and rows: q = (u, v), independent and dependent (Wehage and Haug 1982; Fisette and Samin
 * 1996, eq. 42), and the r rows of h that are solved for v. Chosen at a closed configuration by complete pivoting of
 * the geometrically scaled J: rotations 1, translations and rows by powers of the characteristic length. */
#pragma once

#include "base/arena.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/system.h"
#include <stdbool.h>

typedef struct kmp_partition {
    int n, m;
    int p, r;       /* independent coordinates (degrees of freedom), rank of J: p + r = n */
    int *u, *v;     /* coordinates, ascending: p and r of them */
    int *rows;      /* r independent rows, ascending */
    int *redundant; /* m - r dropped rows, ascending */
    double *pivots; /* min(m, n): absolute pivots of the scaled J, in order */
    double max_b;   /* max |Bvu|, scaled */
    int exchanges;  /* number of exchanges that reduced max_b to 1.5 */
    bool user;      /* u is the user's choice */
} kmp_partition;

/** Chooses from J at a closed configuration, given by its non-zeros (the pattern of system->jacobian). wish:
 * coordinates that the user wants independent (count 0: none). KEMPE_E_FAILED: the choice is impossible; the message
 * has the reason and a possible one. */
kempe_status kmp_partition_init(kmp_partition *part, const kempe_system *system, const double *jacobian,
                                const int *wish, int wish_count);

/** Chooses with a given rank: off the closed configuration, as between the steps of an integrator, redundant rows
 * appear weakly independent. */
kempe_status kmp_partition_of_rank(kmp_partition *part, const kempe_system *system, const double *jacobian, int rank,
                                   const int *wish, int wish_count);

/** Chooses independent coordinates into `u` (room for n), with as many of those `liked` (n) as possible. Returns
 * their number, -1: no memory. */
int kmp_partition_prefer(const kempe_system *system, const double *jacobian, const bool *liked, int *u);

/** Computes only the min(m, n) pivots. false: no memory. */
bool kmp_partition_pivots(const kempe_system *system, const double *jacobian, double *pivots);

/** The 1-norm condition number of the scaled Jv at J; for a large one a lower estimate; infinite if it is singular. */
kempe_status kmp_partition_condition(const kmp_partition *part, const kempe_system *system, const double *jacobian,
                                     double *cond);

void kmp_partition_free(kmp_partition *part);

/** Puts the lists of coordinates and rows in ascending order. */
void kmp_partition_sort(kmp_partition *part);

/** Takes other independent rows, the same number, from a partition of the same system. */
void kmp_partition_take_rows(kmp_partition *part, const kmp_partition *from);

/** The rank by the min(m, n) pivots of complete pivoting of the scaled J, at a closed configuration: the one decision
 * for all computations. */
int kmp_partition_rank(const kempe_system *system, const double *pivots);

/** The places of J's non-zeros by rows and by columns. */
typedef struct kmp_row_links {
    int *row_start;          /* m + 1: the non-zeros of a row, which are in row-major order */
    int *col_start, *in_col; /* n + 1; the non-zeros of a column */
    int *row, *col;          /* m, n: members of a group of rows and columns, and whether one is in it */
    int *row_at, *col_at;
    int *shared; /* n: rows of the group that have a column, without rows that are set aside */
} kmp_row_links;

/** Makes them in an arena. false: no memory. */
bool kmp_row_links_init(kmp_row_links *links, const kempe_system *system, kmp_arena *arena);

/** True if a row of J is independent of the other rows, of which some may be left `out` (m; NULL: none). The row and
 * the rows that share coordinates with it, directly or through others, are eliminated; the row is independent if its
 * pivot exceeds `least` times the last pivot of the others. */
kempe_status kmp_partition_adds(const kempe_system *system, const double *jacobian, kmp_row_links *links,
                                const bool *out, int row, double least, bool *adds);

/** Makes an independent copy. false: no memory. */
bool kmp_partition_copy(kmp_partition *to, const kmp_partition *from);

/** Exchanges u and v of a partition until no scaled |Bvu| of J (its non-zeros) exceeds `growth`. Each exchange takes
 * the largest and multiplies |det Jv| by it, so that they end. Rows are unchanged. Sets max_b of the new choice.
 * KEMPE_E_FAILED without message when Jv is singular; part is then untouched. */
kempe_status kmp_partition_exchange(kmp_partition *part, const kempe_system *system, const double *jacobian,
                                    double growth);

/* The choice of rows and columns of a scaled J: complete pivoting, then exchanges until no |Bvu| exceeds 1.5. A
 * large J is pivoted only on its non-zeros, with the same pivots, and its Jv is factored sparse. */

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

/* Loops that are solved one after the other: the diagonal blocks of Jv. */

/** One diagonal block of Jv, in order of solution. */
typedef struct kmp_loop_block {
    int size, *columns, *rows;
    int *closures, closure_count;
} kmp_loop_block;

/** Lists the blocks of Jv with their rows and closures in `blocks` (arena); returns their number. -1: no memory or
 * singular. */
int kmp_loop_blocks(kmp_evaluator *eval, const kmp_partition *part, kmp_arena *arena, kmp_loop_block **blocks);
