/* SPDX-License-Identifier: BSD-3-Clause */
/* Common parts of all reports: the head of a JSON object, numbers in columns, and the transfer of the text. */
#pragma once

#include "base/context.h"
#include "base/json.h"
#include "integrators/run/run.h"
#include "output/verdict.h"

/** True if a status comes with a result: complete, stopped or failed with a reason. */
bool kmp_has_result(kempe_status status);

/** The outcome of a result with this status; the same where a check may be absent. */
kempe_outcome kmp_outcome_of(kempe_status status);
kempe_outcome kmp_outcome_checked(kempe_status status, bool checked);

/** The outcome that kempe_outcome_text writes so; KEMPE_OUTCOME_NONE: none of them. */
kempe_outcome kmp_outcome_read(const char *word);

/** True if the whole result is there, also where it cannot be trusted. */
bool kmp_outcome_is_complete(kempe_outcome outcome);

/** Begins the first line of a result: "MODEL: OUTCOME, ". */
void kmp_print_title(kmp_text *text, const kempe_model *model, kempe_outcome outcome);

/** A list of strings in JSON: the lines of a text. */
void kmp_print_lines(kmp_json *json, const char *key, const char *lines);

/** Begins the outermost object: model, status, reason, build_s, and the warnings, one a line (kmp_context_warnings);
 * NULL: the object has them elsewhere. */
kmp_json kmp_print_head(kmp_text *text, const kempe_system *system, kempe_outcome outcome, const char *reason,
                        double build_s, const char *warnings);

/** A line for each flexible body, after a label: the words of its terms of second order and of its frame. The head of a
 * JSON object has them as `flexible`. */
void kmp_print_flexible(kmp_text *text, const kempe_model *model, const char *label);

/** Names of the parameters that nothing uses: "a, b" (nothing when there are none), and the array unused_parameters. */
void kmp_print_unused(kmp_text *text, const kempe_model *model);
void kmp_print_unused_json(kmp_json *json, const kempe_model *model);

/** An object of named numbers: entries of `quantity`. */
void kmp_print_entries(kmp_json *json, const char *key, const kempe_system *system, kmp_quantity quantity,
                       const double *values);

/** Names of coordinates, closure rows and closures. */
typedef const char *kmp_name_fn(const kempe_system *system, int k);
kmp_name_fn kmp_name_of_coordinate, kmp_name_of_row, kmp_name_of_closure;

/** An array of the names of which[0 .. count - 1]; the same as text, with commas between, "none" without any. */
void kmp_print_names(kmp_json *json, const char *key, const kempe_system *system, kmp_name_fn *name, int count,
                     const int *which);
void kmp_list_names(kmp_text *text, const kempe_system *system, kmp_name_fn *name, int count, const int *which);

/** residual{} and energy{} of a verdict. */
void kmp_print_verdict(kmp_json *json, const kmp_verdict *verdict);

/** error{} of a verdict. */
void kmp_print_errors(kmp_json *json, const kmp_verdict *verdict);

/** work{} of a run with all counts. */
void kmp_print_work(kmp_json *json, const kmp_run_report *report);

/** Like kmp_text_printf (%e, %f, %g, %d, %ld, %s), but with "-" in the width of a number that is not finite. */
void kmp_print_cells(kmp_text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** The width of columns for the names of a quantity's entries. */
int kmp_print_width(const kempe_system *system, kmp_quantity quantity);

/** Rounding in texts: values up to this part of their size are printed as 0. */
#define KMP_PRINT_NOISE 1e-12

/** A number for a text: 0 up to a size of noise, never -0. */
double kmp_print_clean(double x, double noise);

/** A column of a table of coordinates: positions, rates or accelerations (n). */
typedef struct kmp_coordinate_column {
    const char *title;
    kmp_quantity quantity;
    const double *value;
} kmp_coordinate_column;

/** The most columns of such a table. */
enum { KMP_PRINT_COLUMNS = 4 };

/** Lines of the coordinates with six digits and their units. `mark`: what ends a line, e.g. "held"; NULL: nothing. */
typedef const char *kmp_mark_fn(const void *self, int coordinate);
void kmp_print_coordinates(kmp_text *text, const kempe_system *system, int count, const kmp_coordinate_column *columns,
                           kmp_mark_fn *mark, const void *self);

/** Lines of the states of a model with their values, from the rates qd (n), and with their rates from qdd, NULL: none;
 * nothing without states. */
void kmp_print_states(kmp_text *text, const kempe_system *system, const double *qd, const double *qdd);

/** Lines of the multipliers of all rows, forces or moments with their units. */
void kmp_print_multipliers(kmp_text *text, const kempe_system *system, const double *lambda);

/** Lines of the outputs of a model from their values, without the quantities of every run; each component with the end
 * of its column's name. */
void kmp_print_outputs(kmp_text *text, const kempe_model *model, const double *values);

/** The object `outputs` of their values by their words, or `position` of the positions by their points. */
void kmp_print_outputs_json(kmp_json *json, const kempe_model *model, const double *values, bool positions);

/** Unit of a coordinate, "rad", "deg" or "m", and a value in it from SI: of the coordinate, its rate or acceleration.
 */
const char *kmp_print_unit(const kempe_system *system, int coordinate);
double kmp_print_value(const kempe_system *system, int coordinate, double x);

/** The unit of a column or line, which is "SI" in place of "" where an unknown unit could be taken for one of another
 * system: of a sensor, a state or a parameter. */
const char *kmp_print_unknown(const kempe_context *context, const char *unit);

/** A quantity of SI, unit included, in the unit that texts show: "0.3 m" or "300 mm". A number that is not finite: "-".
 */
void kmp_print_quantity(kmp_text *text, const kempe_context *context, int digits, double x, const char *unit);

/** A unit of SI as texts show it; in `customary` where the chosen system leaves it as it is: mm for m in texts of SI.
 */
kmp_shown kmp_print_customary(const kempe_context *context, const char *unit, kmp_shown customary);

/** A public print function: the text of `result` that `put` makes, given to the caller; an object is in SI, whatever
 * units are chosen. KEMPE_E_MEMORY. */
typedef void kmp_put_fn(kmp_text *text, const void *result);
kempe_status kmp_print_result(kempe_context *context, kempe_format format, kmp_put_fn *put, const void *result,
                              char **text);

/** The public function TYPE_print of a result, with its functions for JSON and text. */
#define KMP_PRINT(type, result, context, json, show)                                                                   \
    kempe_status type##_print(const type *result, kempe_format format, char **text)                                    \
    {                                                                                                                  \
        KMP_WANTED(NULL, result, #result);                                                                             \
        return kmp_print_result((context), format, format == KEMPE_JSON ? (json) : (show), result, text);              \
    }

/** The same of a result with a short text and a full one, KEMPE_FULL_TEXT: show(text, result, full). */
#define KMP_PRINT_FULL(type, result, context, json, show)                                                              \
    static void type##_short(kmp_text *text, const void *result)                                                       \
    {                                                                                                                  \
        show(text, result, false);                                                                                     \
    }                                                                                                                  \
    static void type##_full(kmp_text *text, const void *result)                                                        \
    {                                                                                                                  \
        show(text, result, true);                                                                                      \
    }                                                                                                                  \
    KMP_PRINT(type, result, context, json, format == KEMPE_FULL_TEXT ? type##_full : type##_short)

/** The longest line of a text, in characters. */
enum { KMP_PRINT_LINE = 100 };

/** A line of what `first` begins, broken between words; the lines after the first one are indented by `indent`. */
void kmp_print_wrapped(kmp_text *text, const char *first, int indent, const char *words);

/** Lines below a title, each indented. */
void kmp_print_below(kmp_text *text, const char *lines);

/** Lines with the reasons why a result is not trustworthy, for below its first line; nothing of another outcome.
 * `warnings`: one per line; NULL: none. */
void kmp_print_doubts(kmp_text *text, kempe_outcome outcome, const char *warnings);

/** The first lines of a study: its title, which is freed; why it is not trustworthy, from its warnings; and why it
 * ended early, behind `label`, where it has a reason. */
void kmp_print_answer(kmp_text *text, kmp_text *title, kempe_outcome outcome, const char *warnings, const char *label,
                      const char *reason);

/** Ends a print function: gives the text to the caller, or KEMPE_E_MEMORY. */
kempe_status kmp_print_finish(kempe_context *context, kmp_text *text, char **out);

/** Closures that remain open as drawn, a line each, the first one after `label`. Nothing where all close. */
void kmp_print_rounding(kmp_text *text, const kempe_system *system, const char *label);
