/* SPDX-License-Identifier: BSD-3-Clause */
/* How far the closures are from losing a row: the last kept pivot of the scaled J over all columns, against its value
 * at the start. Small Jv alone is a dead centre of a choice of u; this small is a change point of the mechanism, where
 * branches meet. Workspace made once. */
#ifndef KMP_CONSTRAINTS_MARGIN_H
#define KMP_CONSTRAINTS_MARGIN_H

#include "constraints/partition.h"
#include "constraints/plant.h"
#include "linalg/block.h"
#include "linalg/sparse.h"

/** A last pivot below this fraction of the first at the start is near a change point. */
#define KMP_MARGIN_NEAR 1e-2
/** No step of an ordinary road ends below this margin. */
#define KMP_MARGIN_DEEP 0.1

typedef struct kmp_margin {
    const kempe_system *system;
    int r;                      /* rank at the start */
    double usual;               /* the largest r-th pivot seen */
    double last;                /* the last one */
    bool near;                  /* to a change point at the start */
    bool ignored;               /* nobody asks for change points: no step is shorter, nothing looked at but rows */
    double *a;                  /* m x n; NULL when J is large */
    double *pivots, *largest;   /* m + n; n, scratch of finding them */
    int *entry_row, *entry_col; /* of a large one's entries, with `value` */
    kmp_order *order;           /* of all its rows */
    kmp_order *row_order;       /* of some */
    int *row, *col;             /* of the pivots */
    kmp_block *block;           /* many rows: J on those pivots, whose own pivots are quickly had */
    int count, *entry;          /* its entries of J */
    double *value;              /* scaled */
    double quick_usual;         /* the largest of its smallest pivots seen since it was made */
    bool quick;                 /* the last margin came from it: all is well */
    double step_margin;         /* at the end of the last step asked about, at step_t */
    double step_t;
} kmp_margin;

/** At the partition's configuration. false: no memory. */
bool kmp_margin_init(kmp_margin *margin, const kempe_system *system, const kmp_partition *part);
/** Whether a start that looks near a change point, at (t, q), is: `near` and `usual` by what they are at configurations
 * about it. The plant's last closure is at (t, q) afterwards. false: no memory. */
bool kmp_margin_confirm(kmp_margin *margin, kmp_plant *plant, double t, const double *q);
void kmp_margin_free(kmp_margin *margin);

/** The r-th pivot of J at the plant's last closure over its usual size; 1 when there are no closures. With many rows
 * the dense decomposition is put off while a sparse one of the rows and columns of the last says that all is well. */
double kmp_margin_at(kmp_margin *margin, const kmp_plant *plant);

/** From here on change points are ignored. */
void kmp_margin_ignore(kmp_margin *margin);

/** Whether a step that ends at t, at the plant's last closure, runs too deep into the surroundings of a change point,
 * where a road that keeps all rows loses its digits: it is then to be made shorter. */
bool kmp_margin_too_deep(kmp_margin *margin, const kmp_plant *plant, double t);

/** As kmp_margin_at; what kmp_margin_too_deep has found for the same t is not computed again, nor is the plant's
 * closure wanted then. */
double kmp_margin_after_step(kmp_margin *margin, const kmp_plant *plant, double t);

bool kmp_margin_knows(const kmp_margin *margin, double t);

/** After kmp_margin_at: how good the independent rows of `part` still are, their last pivot over that of all rows. 1
 * when no row is redundant. */
double kmp_margin_of_rows(kmp_margin *margin, const kmp_plant *plant, const kmp_partition *part);

/** A row that moves with time and without which J, at the plant's last closure, has all its rank but one: the closure
 * that asks for a motion the others do not allow. -1: there is none. */
int kmp_margin_lock(kmp_margin *margin, const kmp_plant *plant);

#endif
