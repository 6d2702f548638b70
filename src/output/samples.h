/* SPDX-License-Identifier: BSD-3-Clause */
/* The quantities of a state in tables, references and errors. The rows of a run or of a reference: time, q, qd, qdd,
 * lambda, and the work of non-conservative forces so far. Grows as rows come. The loads of all joints and loops of a
 * mechanism at an instant. */
#pragma once

#include "constraints/evaluation/evaluation_point.h"
#include "dynamics/system.h"

typedef enum kmp_quantity {
    KMP_QUANTITY_Q,
    KMP_QUANTITY_QD,
    KMP_QUANTITY_QDD,
    KMP_QUANTITY_LAMBDA,
    KMP_QUANTITIES,
    KMP_QUANTITY_STATE = KMP_QUANTITIES /* of the rates in a table: the coordinates of the motions of states */
} kmp_quantity;

/** "q", "qd", "qdd", "lambda", "state": the prefix of a column's name. */
const char *kmp_quantity_prefix(kmp_quantity quantity);

/** Number of entries; name and SI unit of entry k: a coordinate's, a closure row's or a state's. */
int kmp_quantity_size(const kempe_system *system, kmp_quantity quantity);
const char *kmp_quantity_name(const kempe_system *system, kmp_quantity quantity, int k);
const char *kmp_quantity_unit(const kempe_system *system, kmp_quantity quantity, int k);

typedef struct kmp_samples {
    int n, m;
    int rows;
    double *t, *work;              /* of each row */
    double *from;                  /* of each row, the time at which expressions have its side of an event; NULL: t */
    double *value[KMP_QUANTITIES]; /* rows x n (or m); in references NaN where not given */
    const bool *shared; /* m, of references, not their own: multipliers that redundant rows leave open, which are not
                         * judged; NULL: none */
    const char *cut;    /* of references, a joint whose coordinates are among the columns, but not of the system: it is
                         * cut; NULL: none */
    double
        *shown; /* rows x the width of outputs, where loads are shared as requested; NULL: as the equations have it */
} kmp_samples;

void kmp_samples_init(kmp_samples *table, int n, int m);
void kmp_samples_free(kmp_samples *table);

/** A kmp_row_fn whose user is the table: appends a copy. Nonzero when there is no memory. */
int kmp_samples_add(void *table, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work);

/** A row more, all unknown (NaN); false: no memory. */
bool kmp_samples_extend(kmp_samples *table);

double kmp_samples_time(const kmp_samples *table, int row);
/** The time at which the expressions of a row are evaluated: at an event just before it, as the row is. */
double kmp_samples_instant(const kmp_samples *table, int row);
double kmp_samples_work(const kmp_samples *table, int row);

/** n or m values, owned by the table and valid until a row is added. */
const double *kmp_samples_get(const kmp_samples *table, kmp_quantity quantity, int row);

/** Forgets the rows after t_end. */
void kmp_samples_limit(kmp_samples *table, double t_end);

enum { KMP_LOAD_VALUES = 6 }; /* a force, and a moment about the point of the second body, in ground axes */

typedef struct kmp_all_loads {
    int joints, *joint; /* bodies whose joints have a separate load, in the order of the model */
    int tyres;          /* tyres of the model, whose forces and moments are along the axes of their contacts */
    kmp_formulas formulas;
    int bearing_count;     /* pairs of bearings of the model */
    int *bearing;          /* of each, the place of the load of its joint; -1: it is not known */
    kmp_formulas bearings; /* of all, by the loads of their joints */
    double *carried;       /* these loads */
    kmp_arena arena;
} kmp_all_loads;

/** Derives them, of all joints of the tree whose load is known. KEMPE_E_MEMORY. */
kempe_status kmp_all_loads_init(kmp_all_loads *loads, const kempe_system *system);
void kmp_all_loads_free(kmp_all_loads *loads);

/** KMP_LOAD_VALUES of each closure, then of each of `joint`, then of each tyre; qd and qdd count where there are
 * joints.
 */
const double *kmp_all_loads_at(kmp_all_loads *loads, const kmp_instant *at);

/** The number of values of kmp_all_loads_at. */
int kmp_all_loads_count(const kmp_all_loads *loads, const kempe_model *model);

/** KMP_BEARING_VALUES of each pair of bearings at an instant, by all loads there (`values`, as kmp_all_loads_at gives
 * them, or shared otherwise). Valid until the next call. */
const double *kmp_all_loads_bearings(kmp_all_loads *loads, const kmp_instant *at, const double *values);
