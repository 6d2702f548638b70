/* SPDX-License-Identifier: BSD-3-Clause */
/* How far the closures are from losing a row, and whether a motion leads there: z is the combination of the rows of the
 * scaled J, |z| = 1, that is nearest to nothing without being so everywhere, w = J'z what is left of it. |w| is the
 * least singular value of J but for those that redundant rows make zero; at a change point, where branches of the
 * mechanism meet, w goes straight through zero, and elsewhere past it, however small it becomes. Jv small alone is a
 * dead centre of a choice of u, kept rows that are nearly dependent are one of a choice of rows.
 *
 * Of redundant rows: what the dropped ones need of the kept ones, T with J_dropped = T J_kept. Where an entry of T goes
 * to infinity the kept rows lose their rank and the dropped one is wanted. Workspace made once. */
#ifndef KMP_CONSTRAINTS_PARTITION_MARGIN_H
#define KMP_CONSTRAINTS_PARTITION_MARGIN_H

#include "base/arena.h"
#include "constraints/evaluation/plant.h"
#include "constraints/partition/partition.h"
#include "linalg/block.h"

/** Dropped rows as combinations of the kept ones, T: row d takes t[e] of kept row kept[e], e from start[d] on. */
typedef struct kmp_margin_rows {
    int *start, *kept; /* m - r + 1, (m - r) r */
    double *t;
} kmp_margin_rows;

typedef struct kmp_margin {
    const kempe_system *system;
    kmp_arena arena;
    kmp_partition part; /* its rows, and columns of its own */
    int r;              /* rank at the start */
    double usual;       /* the largest margin seen, scaled |w| */
    double last;        /* the last one */
    double rows;        /* the largest |T| there, of dropped row rows_d and kept row rows_k */
    int rows_d, rows_k;
    bool near;    /* to a change point at the start */
    bool ignored; /* nobody asks for change points: no step is shorter for one, nothing looked at but rows */
    bool refused; /* a step from where it stands passed a singular place */
    bool stands;  /* what is called so is of the last accepted step's end, where rows and columns were these */
    bool seen;    /* w and z are, too: more than a quick look was taken there */
    bool quick;   /* nothing else was taken for the last margin: all is well */
    double pivot; /* the largest of the block's least ones seen */
    int *signs, *signs_stood; /* of its blocks */
    double step_t;            /* of the last step asked about */
    double tried;   /* margin from which no step across was found, until the motion has left it; 0: none was tried */
    double clear_t; /* up to which somebody has looked and found no change point */
    double *weight; /* of each entry of J */
    int *place;     /* m: of a row among the independent ones; -1 - place of a dropped one */
    int *column;    /* n: of a coordinate among the columns, -1 when it is none */
    kmp_block *block;
    int count, *entry;                 /* its entries of J */
    double *value, *u;                 /* r */
    double *begin;                     /* m: what inverse iteration begins with */
    double *room;                      /* 4 r */
    double *jacobian, *jacobian_stood; /* weighted */
    double *z, *z_stood;               /* m */
    double *w, *w_stood;               /* n */
    kmp_margin_rows need, need_stood;
    int *drop_start, *drop_entry, *drop_column; /* entries of J of each dropped row in the columns of the block */
    double *drop_value;                         /* r */
} kmp_margin;

/** Of the partition's rows. false: no memory. */
bool kmp_margin_init(kmp_margin *margin, const kempe_system *system, const kmp_partition *part);
void kmp_margin_free(kmp_margin *margin);

/** Takes other rows; what was seen of the last ones is forgotten. false: no memory. */
bool kmp_margin_choose(kmp_margin *margin, const kmp_partition *part);

/** At the start, (t, q), where the plant's last closure is: whether it is `near` a change point, which a motion along
 * the closures reaches in some thousandths of a radian, and what is usual about it. The plant's last closure is there
 * afterwards, too. false: no memory. */
bool kmp_margin_begin(kmp_margin *margin, kmp_plant *plant, double t, const double *q);

/** |w| at the plant's last closure over its usual size; 1 when there are no closures, 0 where they are singular. */
double kmp_margin_at(kmp_margin *margin, const kmp_plant *plant);

/** From here on change points are ignored. */
void kmp_margin_ignore(kmp_margin *margin);

/** Whether nobody asks for anything: all is ignored, and there are no dropped rows. */
bool kmp_margin_unwatched(const kmp_margin *margin);

/** Whether a step that ends at t, at the plant's last closure, is to be made shorter: it has passed a singular place,
 * it ends deep in the surroundings of a change point, where a formulation that keeps all rows loses its digits, or at
 * one where the independent rows have all but lost their rank. */
bool kmp_margin_refuses(kmp_margin *margin, const kmp_plant *plant, double t);

/** As kmp_margin_at; what kmp_margin_refuses has found for the same t is not computed again, nor is the plant's
 * closure wanted then. */
double kmp_margin_after_step(kmp_margin *margin, const kmp_plant *plant, double t);
bool kmp_margin_knows(const kmp_margin *margin, double t);

/** Whether a motion that goes on from the last step's end as it came seems to lead to a change point soon: when, in
 * lengths of that step. */
bool kmp_margin_leads_on(const kmp_margin *margin, double *when);

/** Where the line from where it stands to the last margin's place comes nearest to zero: counted from that place, in
 * lengths of the way to it. */
double kmp_margin_when(const kmp_margin *margin);

/** The last margin is that of an accepted step's end. */
void kmp_margin_stand(kmp_margin *margin);

/** Repeats kmp_margin_stand for the plant's last closure after a change of coordinates. */
void kmp_margin_stand_anew(kmp_margin *margin, const kmp_plant *plant);

/** Exchanges rows at the plant's last closure until none of the dropped ones needs more than KMP_ROWS_OUT of a kept
 * one: margin->part has them then, and the margin is that of these. false: no memory. */
bool kmp_margin_exchange_rows(kmp_margin *margin, const kmp_plant *plant);

/** A row that moves with time and without which J, at the plant's last closure, has all its rank but one: the closure
 * that asks for a motion the others do not allow. `been`: J had lost a row shortly before. -1: there is none. */
int kmp_margin_lock(kmp_margin *margin, const kmp_plant *plant, bool been);

#endif
