/* SPDX-License-Identifier: BSD-3-Clause */
/* Inverse equilibrium: coordinates with fixed values, prescribed output values, and as many parameters or rates that
 * become unknown instead. The equations are those of a variant whose released parameters are variable. Their
 * derivatives are exact (analyses/derivatives/parameter_slopes.h). */
#pragma once

#include "analyses/derivatives/parameter_slopes.h"
#include "analyses/equilibrium/equilibrium_study.h"
#include "model/data/variant.h"

/** One additional equation. */
typedef struct kmp_exchange_target {
    int coordinate; /* -1: an output */
    int shown;      /* its index among the values of outputs */
    double value;
    const char *name;
} kmp_exchange_target;

typedef struct kmp_exchange {
    kmp_variant *variant;
    kempe_system *system; /* of the variant */
    kmp_slopes *slopes;
    int free_count; /* parameters first, then rates */
    int parameter_count;
    const char **name; /* free_count: in the order of the request */
    double *value;     /* free_count */
    int *rate;         /* free_count - parameter_count: which of the steady coordinates */
    kmp_exchange_target *target;
    int target_count;
    double *trial, *given; /* free_count: trial values; values in the model and for the caller */
    kmp_text why;          /* reason of the last rejected values, empty when they were accepted */
    kmp_arena arena;
} kmp_exchange;

/** An exchange from the user's words (kempe/equilibrium.h), NULL where there are none; `rates`: of the coordinates that
 * move steadily. KEMPE_E_ARGUMENT: the invalid word, and the valid ones. Other errors as kmp_variant_new and
 * kempe_system_new. */
kempe_status kmp_exchange_new(const kempe_system *system, const char *fix, const char *require, const char *release,
                              const kmp_steady *rates, int rate_count, kmp_exchange **exchange);
void kmp_exchange_free(kmp_exchange *exchange);

/** Back to the values that were given. */
void kmp_exchange_begin(kmp_exchange *exchange, kmp_linear *linear, kmp_steady *rates);

/** Gives all that is free these values (free_count): the system, `linear` and the rates follow. false: the model cannot
 *  have them. */
bool kmp_exchange_set(kmp_exchange *exchange, const double *values, kmp_linear *linear, kmp_steady *rates);
