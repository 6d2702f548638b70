/* SPDX-License-Identifier: BSD-3-Clause */
/* Ranges of named quantities as users write them: "crank=0.28:0.32", "A=-30 deg:30 deg:61", "k=2 kN/m". */
#pragma once

#include "base/context.h"
#include "model/language/dimension.h"

typedef struct kmp_range {
    char *name;
    double from, to;         /* in SI; equal for a single value */
    int count;               /* number of values, ends included; 1 for a single one, 0: not given */
    kmp_dimension dimension; /* of the units; bare without units */
    int angle[2];            /* power of the angle in the units of either end */
    bool expression;         /* an end is an expression, as 2*pi */
    bool column;             /* of a table, where units are behind the name */
} kmp_range;

typedef struct kmp_ranges {
    int count;
    kmp_range *range;
} kmp_ranges;

/** Reads NAME=A, NAME=A:B or NAME=A:B:N, several separated by commas. A number may have a sign and a unit ("N/m",
 * "m/s^2"), at both ends of a range or none but for 0, or it is an expression without units, as "2*pi". Names are not
 * looked up. KEMPE_E_ARGUMENT: invalid text. */
kempe_status kmp_ranges_read(kempe_context *context, const char *text, kmp_ranges *ranges);
void kmp_ranges_free(kmp_ranges *ranges);

/** Reads one number, with or without a unit that fits this one of SI. Errors and warnings as kmp_range_fits_unit; they
 * say "NAME=TEXT". */
kempe_status kmp_range_of_unit(const kempe_model *model, const char *what, const char *name, const char *text,
                               const char *unit, double *value);

/** The same of a parameter, q.NAME or qd.NAME, from the first `length` characters. */
kempe_status kmp_range_of_variable(const kempe_model *model, const char *what, const char *name, const char *text,
                                   size_t length, double *value);

/** Checks that the units fit the quantity's dimension. KEMPE_E_ARGUMENT, with a sentence that begins with `what`.
 */
kempe_status kmp_range_fits(kempe_context *context, const char *what, const kmp_range *range, kmp_dimension wanted);

/** Checks the units of a coordinate's range, an angle or a length (order 0), or of its rate (1). Errors as
 * kmp_range_fits. Warns of an angle without a unit of more than a turn where angles are thought of in degrees. */
kempe_status kmp_range_fits_motion(const kempe_model *model, const char *what, const kmp_range *range, int coordinate,
                                   int order);

/** Checks the units of a range against a unit of SI, "N m"; "": any. Errors and warnings likewise. */
kempe_status kmp_range_fits_unit(const kempe_model *model, const char *what, const kmp_range *range, const char *unit);

/** Checks the units of a range whose name is a parameter, q.NAME or qd.NAME. Errors and warnings likewise. */
kempe_status kmp_range_fits_variable(const kempe_model *model, const char *what, const kmp_range *range);

/** Checks that it is one value. KEMPE_E_ARGUMENT, with a sentence that begins with `what`. */
kempe_status kmp_range_is_value(kempe_context *context, const char *what, const kmp_range *range);

/** Value k of `count`, evenly spaced from one end to the other. */
double kmp_range_value(const kmp_range *range, int k, int count);
