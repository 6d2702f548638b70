/* SPDX-License-Identifier: BSD-3-Clause */
/* A program that is written from the outputs of a motion program: linear algebra as expressions of them, then all in
 * stages. Common part of reduced_program.c and saddle_program.c, which write and run such programs. */
#pragma once

#include "base/arena.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/reduction.h"
#include "symbolic/graph.h"

enum { KMP_WRITER_STAGES = 6 }; /* bound, without stage 0 */

/* State of a writer. Arrays are in `arena`. */
typedef struct kmp_program_writer {
    const kempe_system *s;
    const kmp_program *source; /* the motion program, or the program by articulated bodies */
    kmp_graph *g;
    kmp_arena arena;
    kmp_ref *input, *by; /* inputs of the source, and their replacements */
    kmp_ref *at; /* replacements at a place nearby, from which sines and cosines are turned; NULL: there is none */
    kmp_angle_updates turns; /* by these angles */
    int inputs, named;       /* number; the first input of kmp_writer_take_state */
    int accelerations;       /* the first input of kmp_writer_product */
    kmp_ref *product;        /* outputs of the source at those; NULL: the source has no products */
    bool by_coordinate;      /* states are given as q and qd of the coordinates, not in the order (u, ud, v) */
    kmp_ref *out;            /* outputs of the source */
    /* in `out`: */
    const kmp_ref *closure;            /* h, J and h_t, one after the other */
    const kmp_ref *h, *jacobian, *h_t; /* m, jacobian.count, m; h_t is NULL if there is none */
    const kmp_ref *mass;               /* mass.count; NULL: the source has products, or articulated bodies */
    const kmp_ref *pivots, *diagonals; /* m: of articulated bodies, instead of the mass */
    const kmp_ref *open, *correction;  /* n: likewise (KMP_STAGE_OPEN, KMP_STAGE_CORRECT) */
    kmp_ref *bias;                     /* n: C; of articulated bodies: accelerations */
    const kmp_ref *jdqd;               /* m; of articulated bodies: multipliers */
    const kmp_ref *load;               /* load_jacobian.count: dC/dlambda; NULL: C does not depend on it */
    kmp_ref power;                     /* of the non-conservative forces in the source */
    kmp_ref *all, *to;                 /* outputs of the new program */
    int exact;                         /* the first of `closure` in `all` */
    const kmp_ref *group[KMP_WRITER_STAGES];
    int stages, count[KMP_WRITER_STAGES];
} kmp_program_writer;

/** Begins with the motion program (NULL: the program of the evaluator, by M or by products), or articulated bodies, of
 * an evaluator, and room for this number of replaced inputs. Charts that are C = 1, as they are until a joint comes
 * near a singular position of its angles, are numbers: that saves up to two fifths of the operations of a vehicle.
 * False: no memory; kmp_writer_free in any case. */
bool kmp_writer_init(kmp_program_writer *w, const kmp_evaluator *eval, const kmp_program *motion, bool by_bodies,
                     int inputs);
void kmp_writer_free(kmp_program_writer *w);

/** Lists the charts that are numbers, and these; returns how many. Room for all entries. */
int kmp_writer_plain_charts(const kmp_evaluator *eval, kmp_graph *g, kmp_ref *input, kmp_ref *by);

/** Replaces an input of the source. */
void kmp_writer_replace(kmp_program_writer *w, kmp_input_kind kind, int index, kmp_ref by);

/** Brings the outputs of the source into the graph, with the present replacements, and sorts them. False: no memory, or
 * implicit blocks. */
bool kmp_writer_import(kmp_program_writer *w);

/** Replaces q and qd by positions in the state (u, ud, v) of a partition, given as q, and in the rates of v, which
 * follow it, given as qd. Then, where rates of v are expressions (r), imports again with these. */
void kmp_writer_take_state(kmp_program_writer *w, const kmp_partition *part);
bool kmp_writer_take_rates(kmp_program_writer *w, const kmp_partition *part, const kmp_ref *rate);

/** The rate of a coordinate: of such a state, before its rates are expressions, or among qd where part is NULL. */
kmp_ref kmp_writer_rate(const kmp_program_writer *w, const kmp_partition *part, int coordinate);

/** About the operations of an evaluation of the source, with charts as numbers. -1: no memory. */
double kmp_writer_operations(const kmp_evaluator *eval, bool by_bodies);

/** out = M x (n), where the source has products, which bring their operations into the graph. After
 * kmp_writer_import. False: no memory. */
bool kmp_writer_product(kmp_program_writer *w, const kmp_ref *x, kmp_ref *out);

/** Takes the user-defined forces, which are inputs, into C. Articulated bodies have them. */
void kmp_writer_add_efforts(kmp_program_writer *w);

/** sum += a b */
static inline void kmp_writer_add_product(kmp_graph *g, kmp_ref *sum, kmp_ref a, kmp_ref b)
{
    *sum = kmp_add(g, *sum, kmp_mul(g, a, b));
}

/** Room for all outputs of the new program; begins a stage; appends outputs to it. */
bool kmp_writer_room(kmp_program_writer *w, int outputs);
void kmp_writer_stage(kmp_program_writer *w);
void kmp_writer_put(kmp_program_writer *w, int count, const kmp_ref *of);

/** h, J and h_t. */
int kmp_writer_closure_count(const kempe_system *s);

/** The program; NULL: no memory. */
kmp_program *kmp_writer_program(kmp_program_writer *w);

/* A written program, ready to run with the charts and conditions of an evaluator. */
typedef struct kmp_writer_machine {
    const kmp_evaluator *eval;
    kmp_program *program; /* owned */
    kmp_machine *machine;
    bool reads[KMP_IN_COUNT]; /* inputs that the program has */
    long chart_version;       /* version of the charts in the constants */
    double *chart;            /* the charts when the program was written */
    bool stale;               /* a chart has changed that is a number in the program */
} kmp_writer_machine;

/** Takes the program (NULL: there is none), which it frees in any case. False: no memory. */
bool kmp_writer_machine_init(kmp_writer_machine *w, const kmp_evaluator *eval, kmp_program *program);
void kmp_writer_machine_free(kmp_writer_machine *w);

/** Sets t and q, and the conditions. */
void kmp_writer_machine_place(kmp_writer_machine *w, double t, const double *q);

/** Correction of v at a state, dv (r), owned by the program, and the largest angle by which it turns a sine or cosine.
 */
typedef struct kmp_writer_correction {
    const double *dv;
    double turn;
} kmp_writer_correction;

/** Runs the stage of the correction, whose outputs are dv and this number of angles, at (t, y). */
kmp_writer_correction kmp_writer_machine_close(kmp_writer_machine *w, int stage, int r, int turns, double t,
                                               const double *y);

/** Room for the user-defined forces at states (u, ud, v). */
typedef struct kmp_writer_efforts {
    double *effort; /* n; NULL: there are none */
    double *q, *qd; /* n */
    double *state;  /* 2 n: a state and the rates of v */
} kmp_writer_efforts;

/** Takes the forces at y as inputs of the program, with the correction of v (NULL: none) and the rates of v. */
void kmp_writer_put_efforts(kmp_writer_machine *w, const kmp_writer_efforts *room, const kmp_partition *part, double t,
                            const double *y, const double *dv, const double *rate);

/** True if the program must be written again: a chart has changed that is a number in it. Otherwise it takes charts
 * that have changed. */
bool kmp_writer_machine_is_stale(kmp_writer_machine *w);

/** True if the program is not stale, and the model has no conditions or they are frozen (kmp_eval_freeze): the program
 * does not look for their changes. */
bool kmp_writer_machine_applies(kmp_writer_machine *w);

/* Jv of a reduction factored block by block, written out as expressions. Blocks of one and two rows are solved by their
 * determinant, larger ones by elimination in a given order. */

enum { KMP_WRITER_BLOCK = 32 }; /* bound: rows of a block */

/** Rows of h that a multiplier of the elimination belongs to: the one that it changes, and the one that it takes. */
typedef struct kmp_eliminated {
    int row, by;
} kmp_eliminated;

/** True if the order of the elimination is good: no multiplier is large when rows are scaled. Multiplier k is at k
 * stride, the scale of row r (m of them) at r stride. */
bool kmp_writer_order_is_good(int count, const kmp_eliminated *rows, const double *multiplier, const double *row_scale,
                              size_t stride);

typedef struct kmp_writer_blocks {
    const kmp_reduction *red; /* the first two are set by the caller */
    const int *order;         /* of rows in the elimination: r positions among the independent rows, block by block */
    kmp_graph *g;
    struct kmp_writer_block *block;
    kmp_ref *jv, *ju;    /* r x r and r x p, row by row */
    int *block_of;       /* by column */
    kmp_ref *multiplier; /* of all blocks */
    kmp_eliminated *row; /* of each multiplier */
    int multipliers;
    kmp_ref *pivot; /* factors of det Jv, but for the sign of a permutation */
    int pivots;
} kmp_writer_blocks;

/** True if no block is too large. */
bool kmp_writer_blocks_fit(const kmp_reduction *red);

/** The order in which partial pivoting takes the rows at the evaluator's last closure. */
void kmp_writer_order(const kmp_reduction *red, int *order);

/** Takes the entries of J, in an arena. False: no memory. */
bool kmp_writer_blocks_init(kmp_writer_blocks *k, kmp_arena *arena, kmp_graph *g, const kmp_ref *jacobian);

/** Factors a block; solves its part of x = Jv^-1 rhs for every column (r x columns, row by row) after later blocks. The
 * last block comes first. */
void kmp_writer_blocks_factor(kmp_writer_blocks *k, int number);
void kmp_writer_blocks_solve(const kmp_writer_blocks *k, int number, int columns, const kmp_ref *rhs, kmp_ref *x);

/** Solves Jv' x = rhs, r values by rows of Jv and by its columns, of factored blocks. */
void kmp_writer_blocks_solve_transposed(const kmp_writer_blocks *k, const kmp_ref *rhs, kmp_ref *x);

/** x = -Jv^-1 of all rows (m) of h, in the order of the partition; `room`: r. */
void kmp_writer_blocks_correct(const kmp_writer_blocks *k, const kmp_ref *h, kmp_ref *room, kmp_ref *x);

/** The largest multiplier over its bound: the order of the elimination is good where it is at most 1. */
kmp_ref kmp_writer_blocks_excess(const kmp_writer_blocks *k);

/** A copy of `row`, which the caller frees; NULL: no memory. */
kmp_eliminated *kmp_writer_rows(const kmp_writer_blocks *k);

/** Writes the correction dv (r) of v of a state (kmp_writer_take_state), and adds it: later imports take the
 * corrected state. `k` has what the caller sets. False: no memory. */
bool kmp_writer_close(kmp_program_writer *w, kmp_writer_blocks k, kmp_ref *dv);

/* L D L' of a sparse symmetric matrix of expressions, written out without zeros. The order of elimination is the order
 * of least degree (Tinney and Walker, Proc. IEEE 55 (1967) 1801), its fill is known before.
 *
 * Trailing unknowns may have a zero diagonal, as the multipliers of [M J'; J 0]. Each is eliminated after the leading
 * ones that it is coupled with, so that its pivot comes from the Schur complement -J M^-1 J'. */

typedef struct kmp_writer_ldl {
    int size, leading;
    int *order, *step;         /* unknown of each step, and the reverse */
    int *start, *row;          /* L by columns, which are steps: unknowns of later steps, in their order */
    int *row_start, *col, *at; /* L by rows, which are unknowns: earlier steps, ascending, and their entry in `row` */
    long operations;           /* of the factors and one solution */
    kmp_ref *l, *scaled;       /* L, L D, as `row` */
    kmp_ref *diagonal, *pivot; /* by unknowns: of the matrix or its Schur complement; D */
    kmp_ref *inverse;          /* of D */
} kmp_writer_ldl;

/** Finds the order and the fill from a pattern (size x size, nonzero where an entry is), which is destroyed. False: no
 * memory. */
bool kmp_writer_ldl_analyse(kmp_writer_ldl *ldl, kmp_arena *arena, int size, int leading, unsigned char *pattern);

/** Writes the factors of a matrix (size x size, symmetric) of that pattern. False: no memory, or a pivot is zero. */
bool kmp_writer_ldl_factor(kmp_writer_ldl *ldl, kmp_arena *arena, kmp_graph *g, const kmp_ref *matrix);

/** x <- A^-1 x, with all unknowns; or with the leading part of A, which no trailing unknown changes. */
void kmp_writer_ldl_solve(const kmp_writer_ldl *ldl, kmp_graph *g, int unknowns, kmp_ref *x);
