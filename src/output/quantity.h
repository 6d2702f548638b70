/* SPDX-License-Identifier: BSD-3-Clause */
/* The quantities of a state in tables, references and errors, and the names of their columns. */
#pragma once

#include "dynamics/system.h"

typedef enum kmp_quantity {
    KMP_QUANTITY_Q,
    KMP_QUANTITY_QD,
    KMP_QUANTITY_QDD,
    KMP_QUANTITY_LAMBDA,
    KMP_QUANTITIES,
    KMP_QUANTITY_STATE = KMP_QUANTITIES /* of the rates in a table: those of the motions of states */
} kmp_quantity;

/** "q", "qd", "qdd", "lambda", "state": the prefix of a column's name. */
const char *kmp_quantity_prefix(kmp_quantity quantity);

/** Number of entries; name and SI unit of entry k: a coordinate's, a closure row's or a state's. */
int kmp_quantity_size(const kempe_system *system, kmp_quantity quantity);
const char *kmp_quantity_name(const kempe_system *system, kmp_quantity quantity, int k);
const char *kmp_quantity_unit(const kempe_system *system, kmp_quantity quantity, int k);

/** SI unit of a value that is named as a column, q.NAME or qd.NAME; "": another name, a parameter. */
const char *kmp_quantity_unit_of(const kempe_system *system, const char *name);
