/* SPDX-License-Identifier: BSD-3-Clause */
/* One model with several models of its flexible bodies. */
#pragma once

#include "base/arena.h"
#include "base/json.h"
#include "base/text.h"
#include <kempe/kempe.h>

/** The model with one of them. Unknown numbers are NaN. */
typedef struct kmp_compared_bodies {
    const char *word;
    kempe_outcome outcome;
    const char *reason; /* "" when it is complete; the first doubt of a run that cannot be trusted */
    int coordinates;
    long steps;
    double cpu_s, build_s; /* of the integration, and of the preparation of the equations */
    double *error;         /* of each output: the largest difference from the reference */
    int worst;             /* the output with the largest error over the range of its unit; -1: unknown */
    double part;           /* that */
} kmp_compared_bodies;

typedef struct kmp_bodies_table {
    int count, output_count;
    kmp_compared_bodies *rows;  /* in the order of the request; the last one is the reference */
    const char **names, **unit; /* of outputs */
    double *range;              /* the largest range of an output with that unit */
    double rtol;
} kmp_bodies_table;

/** Reads the words of a list, and the model with each: the arguments are judged before anything is computed. NULL: no
 * rows. */
kempe_status kmp_compare_bodies_begin(const kempe_model *model, const char *list, kmp_arena *arena,
                                      kmp_bodies_table *table);

/** Runs them all to t_end. */
kempe_status kmp_compare_bodies(const kempe_model *model, double t_end, kmp_arena *arena, kmp_bodies_table *table);

/** Why the run that the others are compared with cannot be trusted; nothing where it can. */
void kmp_compare_bodies_put_doubt(kmp_text *text, const kmp_bodies_table *table);

void kmp_compare_bodies_show(kmp_text *text, const kempe_context *context, const kmp_bodies_table *table);
void kmp_compare_bodies_json(kmp_json *json, const kempe_context *context, const kmp_bodies_table *table);
