/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts that the reports and tables of studies share. */
#pragma once

#include "base/json.h"
#include "output/result_table.h"

/** SI unit of a value that is named as a column, q.NAME or qd.NAME; "": another name, a parameter. */
const char *kmp_quantity_unit_of(const kempe_system *system, const char *name);

/** Appends `before` and the SI unit of a parameter of the model, or of a start value q.NAME, qd.NAME; nothing where the
 * unit is not known. */
void kmp_print_parameter_unit(kmp_text *text, const char *before, const kempe_system *system, const char *name);

/** For texts: the unit of such a name with a blank before it, of a parameter the unit of its dimension, nothing where
 * it is not known; and a value in it. */
void kmp_print_unit_of(kmp_text *text, const kempe_system *system, const char *name);
void kmp_print_value_of(kmp_text *text, const kempe_system *system, const char *name, double value);

/** An array of pairs [re, im]. */
void kmp_print_pairs(kmp_json *json, const char *key, int count, const double *re, const double *im);

/** The width of columns for these names, at least `least`. */
int kmp_print_widest(int count, char *const *names, int least);

/** Columns of a quantity, columns of rates with the states; values of a row for them (n or m). */
void kmp_tabulate_quantity(kempe_table *table, const kempe_system *system, kmp_quantity quantity);
void kmp_tabulate_values(kempe_table *table, const kempe_system *system, kmp_quantity quantity, const double *values);

/** A line, after `label`, with the states of an averaged system that change only at events, and their values in the
 * rates qd (n); the object `held` of them. Nothing without such states. */
void kmp_print_held(kmp_text *text, const char *label, const kempe_system *system, const double *qd);
void kmp_print_held_json(kmp_json *json, const kempe_system *system, const double *qd);

/** True if a drive, a closure or a force of the model is a function of time. */
bool kmp_model_has_time(const kempe_model *model);
