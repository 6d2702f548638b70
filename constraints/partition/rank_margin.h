/* SPDX-License-Identifier: BSD-3-Clause */
/* Distance of the closures from a loss of rank, and prediction of a motion that leads to it. z is the combination of
 * the rows of the scaled J, |z| = 1, with the least w = J'z, other than combinations that vanish everywhere. |w| is the
 * least singular value of J apart from the values that redundant rows make zero. At a change point, where branches of
 * the mechanism meet, w goes straight through zero; elsewhere it passes zero, however small it becomes. A small Jv by
 * itself is a dead centre of a choice of u; nearly dependent kept rows are a dead centre of a choice of rows.
 *
 * With redundant rows: T expresses the dropped rows by the kept ones, J_dropped = T J_kept. As an entry of T goes to
 * infinity the kept rows lose their rank and the dropped one is needed. The workspace is allocated once. */
#pragma once

#include "base/arena.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "linalg/block.h"

/** A measurement. Dropped rows are combinations of the kept ones, T: row d has coefficient t[e] of kept row kept[e], e
 * from start[d] on. */
typedef struct kmp_rank_margin_view {
    double *jacobian;  /* weighted */
    double *z, *w;     /* m, n */
    int *start, *kept; /* m - r + 1, (m - r) r */
    double *t;
} kmp_rank_margin_view;

typedef struct kmp_rank_margin {
    const kempe_system *system;
    kmp_arena arena;
    kmp_partition part; /* its rows, with separate columns */
    int r;              /* rank at the start */
    double usual;       /* the largest margin seen, scaled |w| */
    double last;        /* last margin */
    double rows;        /* the largest |T| of the last margin, of dropped row rows_d and kept row rows_k */
    int rows_d, rows_k;
    bool near;    /* close to a change point at the start */
    bool ignored; /* change points are ignored: no step is shortened for one, and only rows are examined */
    bool refused; /* the last step from the present place passed a singular place */
    bool stands;  /* members named stood belong to the last accepted step's end, with the present rows and columns */
    bool seen;    /* so do w and z: a full measurement was made there */
    bool quick;   /* the last margin had only the quick test: no singularity */
    double pivot; /* the largest minimum pivot of the block so far */
    int *signs_stood; /* of the block's diagonal blocks */
    int *taken;       /* r: kept rows already exchanged */
    double step_t;    /* time of the last step examined */
    double tried;     /* margin at which no step across was found, until the motion has left it; 0: none was tried */
    double clear_t;   /* no change point was found up to this time */
    double *weight;   /* of each entry of J */
    int *row_start;   /* m + 1: first entry of each row of J */
    int *place;       /* m: position of a row among the independent ones, -1: dropped */
    int *column;      /* n: position of a coordinate among the columns, -1: none */
    kmp_block *block;
    int count, *entry, *entry_row, *entry_column; /* entries of J in the block */
    double *value, *u;                            /* r */
    double *begin;                                /* m: initial vector of inverse iteration */
    double *room;                                 /* 4 r: work space */
    double *along, *other;                        /* r, n: work space of the start */
    kmp_rank_margin_view now, stood;
    int *drop_column; /* r: entries of a dropped row in the columns of the block */
    double *drop_value;
} kmp_rank_margin;

/** Allocates for the partition's rows. false: no memory. */
bool kmp_rank_margin_init(kmp_rank_margin *margin, const kempe_system *system, const kmp_partition *part);
void kmp_rank_margin_free(kmp_rank_margin *margin);

/** Takes other rows; earlier measurements are forgotten. false: no memory. */
bool kmp_rank_margin_choose(kmp_rank_margin *margin, const kmp_partition *part);

/** Measures at the start, (t, q), the place of the evaluator's last closure, and sets the usual values. Sets `near` if
 * a motion along the closures reaches a change point in some thousandths of a radian. Restores the evaluator's last
 * closure. */
void kmp_rank_margin_begin(kmp_rank_margin *margin, kmp_evaluator *eval, double t, const double *q);

/** |w| at the evaluator's last closure over its usual size; 1 without closures, 0 where they are singular. */
double kmp_rank_margin_at(kmp_rank_margin *margin, const kmp_evaluator *eval);

/** Ignores change points from here on. */
void kmp_rank_margin_ignore(kmp_rank_margin *margin);

/** True if there is nothing to watch: change points are ignored, and there are no dropped rows. */
bool kmp_rank_margin_unwatched(const kmp_rank_margin *margin);

/** True if a step that ends at t, at the evaluator's last closure, must be shortened. It has passed a singular place,
 * or it ends deep in the surroundings of a change point, where a formulation that keeps all rows loses digits. Or the
 * independent rows have nearly lost their rank at its end. */
bool kmp_rank_margin_refuses(kmp_rank_margin *margin, const kmp_evaluator *eval, double t);

/** As kmp_rank_margin_at; results of kmp_rank_margin_refuses for the same t are reused, and the evaluator's closure is
 * then not needed. */
double kmp_rank_margin_after_step(kmp_rank_margin *margin, const kmp_evaluator *eval, double t);

/** True if a motion that continues as in the last step seems to reach a change point soon; *when in lengths of that
 * step. */
bool kmp_rank_margin_leads_on(const kmp_rank_margin *margin, double *when);

/** Point where the line from the last step's end to the last margin's place comes nearest to zero: counted from that
 * place, in lengths of that line. */
double kmp_rank_margin_when(const kmp_rank_margin *margin);

/** Marks the last margin as the margin of an accepted step's end. */
void kmp_rank_margin_stand(kmp_rank_margin *margin);

/** Repeats kmp_rank_margin_stand for the evaluator's last closure after a change of coordinates. */
void kmp_rank_margin_stand_anew(kmp_rank_margin *margin, const kmp_evaluator *eval);

/** Exchanges rows at the evaluator's last closure until no coefficient |T| exceeds KMP_ROWS_OUT: margin->part has the
 * new rows, and the margin belongs to them. false: no memory. */
bool kmp_rank_margin_exchange_rows(kmp_rank_margin *margin, const kmp_evaluator *eval);

/** A row that moves with time and without which J, at the evaluator's last closure, has all its rank but one: a closure
 * that demands a motion which the others do not allow. `been`: J had lost a row shortly before. -1: none. */
int kmp_rank_margin_lock(kmp_rank_margin *margin, const kmp_evaluator *eval, bool been);
