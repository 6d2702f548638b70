/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of a run as users write them, and limits on them (docs/ensemble.md). */
#pragma once

#include "model/data/variant.h"
#include "output/quantities/run_quantities.h"

/** A limit on a value: it passes where sign (value - bound) < 0, or is 0 where `or_equal`. */
typedef struct kmp_quantity_limit {
    const char *text;
    int value; /* its number among the values */
    double sign, bound;
    bool or_equal;
    bool whole; /* of a count */
} kmp_quantity_limit;

typedef struct kmp_quantity_list {
    kmp_arena arena;
    kmp_variant *variant; /* a copy of the model whose outputs are the channels; NULL without quantities */
    int requested;        /* quantities that are not only of limits: the first ones */
    kmp_run_quantities run;
    const char *words, *limit_words; /* as they were given, "" without */
    const char **name, **unit;       /* of each value */
    double last_time;                /* the largest time of a value; 0: none */
    int argument_outputs;            /* the last outputs of the variant, which are arguments of the others */
    int limit_count;
    kmp_quantity_limit *limit;
} kmp_quantity_list;

/** Reads quantities and limits, each a list separated by commas or semicolons (NULL:
 * none), for a model, which must outlive them.
 * KEMPE_E_INPUT: sentences with the column. */
kempe_status kmp_quantity_list_init(kmp_quantity_list *list, const kempe_model *model, const char *quantities,
                                    const char *limits);
void kmp_quantity_list_free(kmp_quantity_list *list);

/** True if a value is within a limit. */
bool kmp_limit_holds(const kmp_quantity_limit *limit, double value);

/** The size of a limit, its bound or 1 where that is 0; and the part of it by which a value is beyond the limit, not
 * positive within it. The bound itself counts as within, but for a count, which is then the next whole number. */
double kmp_limit_size(const kmp_quantity_limit *limit);
double kmp_limit_excess(const kmp_quantity_limit *limit, double value);
