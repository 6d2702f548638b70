/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * What the equations of a model cost: sets of them derived one by one, and how many operations each takes.
 */
#ifndef KEMPE_GENERATE_H
#define KEMPE_GENERATE_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** What to derive, and how. NULL and 0 take the default. */
typedef struct kempe_generation {
    const char *sets;    /* comma-separated: M_C, invdyn, h_J, jdqd (the default is all four), M, C, h, J,
                          * qdd: the accelerations without closure forces, in O(N) */
    const char *scheme;  /* how M is made: composite (default), ner */
    int keep_parameters; /* every number of the model that is not zero stays a symbol, instead of being folded in */
    int body_inputs;     /* three forces and three torques on every body are inputs */
    int optimize;        /* look for the fewest operations joint by joint, not among some patterns alone: slower */
} kempe_generation;

typedef struct kempe_count kempe_count;

/** Derives each of the asked sets alone, and all of them as one program. KEMPE_E_ARGUMENT: a set or scheme that does
 *  not exist; KEMPE_E_INPUT: a closure that can never be met. */
KEMPE_API kempe_status kempe_count_new(const kempe_model *model, const kempe_generation *generation,
                                       kempe_count **count);
KEMPE_API void kempe_count_free(kempe_count *count);

/** Operations by two rules: `paper` + - * /, `robotran` those, unary minus, and one for each sine, cosine or other
 *  function. */
KEMPE_API kempe_status kempe_count_print(const kempe_count *count, kempe_format format, char **text);

#ifdef __cplusplus
}
#endif
#endif
