/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts that the reports and tables of studies share. */
#pragma once

#include "base/json.h"
#include "output/result_table.h"

/** SI unit of a value that may vary: a start value, q.NAME or qd.NAME, or a parameter by its dimension; "": unknown. */
const char *kmp_quantity_unit_of(const kempe_system *system, const char *name);

/** That unit as results show it: "" where it is unknown in SI, "SI" in another system. */
kmp_shown kmp_shown_of(const kempe_system *system, const char *name);

/** For texts: `before` and that unit, nothing where it is ""; and a value with it. */
void kmp_print_unit_of(kmp_text *text, const char *before, const kempe_system *system, const char *name);
void kmp_print_value_of(kmp_text *text, const kempe_system *system, const char *name, double value);

/** A column of such values, named by `before` and the name. */
void kmp_tabulate_value(kempe_table *table, const kempe_system *system, const char *before, const char *name);

/** An array of pairs [re, im]. */
void kmp_print_pairs(kmp_json *json, const char *key, int count, const double *re, const double *im);

/** The width of columns for these names, at least `least`. */
int kmp_print_widest(int count, char *const *names, int least);

/** Columns of a quantity, columns of rates with the states; values of a row for them (n or m). */
void kmp_tabulate_quantity(kempe_table *table, const kempe_system *system, kmp_quantity quantity);

/** The columns of a model's computed outputs (NULL), or their values in a row. */
void kmp_tabulate_outputs(kempe_table *table, const kempe_model *model, const double *values);
void kmp_tabulate_values(kempe_table *table, const kempe_system *system, kmp_quantity quantity, const double *values);

/** A line, after `label`, with the states of an averaged system that change only at events, and their values in the
 * rates qd (n); the object `held` of them. Nothing without such states. */
void kmp_print_held(kmp_text *text, const char *label, const kempe_system *system, const double *qd);
void kmp_print_held_json(kmp_json *json, const kempe_system *system, const double *qd);

/** True if a drive, a closure or a force of the model is a function of time. */
bool kmp_model_has_time(const kempe_model *model);
