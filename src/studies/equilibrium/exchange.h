/* SPDX-License-Identifier: BSD-3-Clause */
/* Unknowns exchanged: coordinates that stay at values, outputs that shall have values, and as many parameters or rates
 * that become unknown instead. The equations are those of a variant whose released parameters stay open, and their
 * derivatives are exact (analysis/slopes.h). */
#ifndef KMP_STUDIES_EQUILIBRIUM_EXCHANGE_H
#define KMP_STUDIES_EQUILIBRIUM_EXCHANGE_H

#include "derivatives/parameter_slopes.h"
#include "model/variant.h"
#include "studies/equilibrium/equilibrium.h"

/** One equation more. */
typedef struct kmp_exchange_target {
    int coordinate; /* -1: an output */
    int shown;      /* its number among the values that outputs show */
    double value;
    const char *name;
} kmp_exchange_target;

typedef struct kmp_exchange {
    kmp_variant *variant;
    kempe_system *system; /* of the variant */
    kmp_slopes *slopes;
    int free_count; /* parameters first, then rates */
    int parameter_count;
    const char **name; /* free_count: as they were asked for */
    double *value;     /* free_count */
    int *rate;         /* free_count - parameter_count: which of the steady coordinates */
    kmp_exchange_target *target;
    int target_count;
    double *trial, *given; /* free_count: the latter as the model, and who asks, have them */
    kmp_text why;          /* values last refused: a sentence, empty when they were not */
    kmp_arena arena;
} kmp_exchange;

/** From the words of a user (kempe/equilibrium.h), NULL where there are none; `rates`: of the coordinates that move
 *  steadily. KEMPE_E_ARGUMENT: which word, and what there is. Other errors as kmp_variant_new and kempe_system_new. */
kempe_status kmp_exchange_new(const kempe_system *system, const char *fix, const char *require, const char *release,
                              const kmp_steady *rates, int rate_count, kmp_exchange **exchange);
void kmp_exchange_free(kmp_exchange *exchange);

/** Back to the values that were given. */
void kmp_exchange_begin(kmp_exchange *exchange, kmp_linear *linear, kmp_steady *rates);

/** Gives all that is free these values (free_count): the system, `linear` and the rates follow. false: the model cannot
 *  have them. */
bool kmp_exchange_set(kmp_exchange *exchange, const double *values, kmp_linear *linear, kmp_steady *rates);

#endif
