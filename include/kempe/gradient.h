/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Outputs of a driven mechanism with their exact derivatives by named parameters, through the loops, for repeated
 * evaluation by an optimiser. The equations are derived once. Each evaluation takes one closure by Newton's method and
 * one pass of straight-line code.
 *
 *     kempe_gradient_options ask = {.parameters = "crank,rocker", .driven = "crank"};
 *     kempe_gradient *gradient;
 *     kempe_gradient_new(model, &ask, &gradient);
 *     kempe_gradient_set(gradient, lengths);
 *     for (int k = 0; k < 36; k++) {
 *         double angle = k * M_PI / 18;
 *         kempe_gradient_eval(gradient, &angle, NULL, NULL);
 *         add(kempe_gradient_values(gradient), kempe_gradient_jacobian(gradient));
 *     }
 *
 * The mechanism moves continuously from its last configuration to the requested one, coordinates and parameters
 * together, so that it stays in its assembly mode.
 */
#ifndef KEMPE_GRADIENT_H
#define KEMPE_GRADIENT_H

#include <kempe/kempe.h>

KEMPE_BEGIN

typedef struct kempe_gradient kempe_gradient;

typedef struct kempe_gradient_options {
    size_t size;            /* sizeof this struct; 0: its size in version 0.1 */
    const char *parameters; /* "crank,rocker": parameters of the model; NULL: none */
    const char *driven;     /* coordinates, comma-separated: one for each degree of freedom */
    const char *backend;    /* native | tape; NULL: the default */
} kempe_gradient_options;

/** Derives the equations of a model with the parameters kept symbolic, and assembles it at its start. The values are
 * the model's outputs (`run: outputs`) in addition to the table of every run. The model must outlive it.
 * KEMPE_E_ARGUMENT: a name does not exist or cannot vary. KEMPE_E_FAILED: the model does not assemble, or the
 * coordinates do not drive it; the message names some that would. */
KEMPE_API kempe_status kempe_gradient_new(const kempe_model *model, const kempe_gradient_options *options,
                                          kempe_gradient **gradient);
KEMPE_API void kempe_gradient_free(kempe_gradient *gradient);

/** The number of values, and the name of the k-th: `position.coupler.P.x`. */
KEMPE_API int kempe_gradient_count(const kempe_gradient *gradient);
KEMPE_API const char *kempe_gradient_name(const kempe_gradient *gradient, int k);

/** Sets the values of all parameters, effective from the next kempe_gradient_eval on. KEMPE_E_INPUT: the model cannot
 * have these values; the message has the reason, and the values before remain. */
KEMPE_API kempe_status kempe_gradient_set(kempe_gradient *gradient, const double *values);

/** Evaluates at the driven coordinates, with their rates and accelerations (NULL: zero), in the order of their names,
 * at t = 0. KEMPE_E_FAILED: the loops cannot be closed there; the message says up to which point they can, and
 * everything is unchanged. */
KEMPE_API kempe_status kempe_gradient_eval(kempe_gradient *gradient, const double *driven, const double *rates,
                                           const double *accelerations);

/** Results of the last kempe_gradient_eval, owned by the gradient: the values; their derivatives by the parameters
 * (row-major, a row per value) and by the driven coordinates. */
KEMPE_API const double *kempe_gradient_values(const kempe_gradient *gradient);
KEMPE_API const double *kempe_gradient_jacobian(const kempe_gradient *gradient);
KEMPE_API const double *kempe_gradient_by_driven(const kempe_gradient *gradient);

/** All coordinates at the last kempe_gradient_eval (n values) and their derivatives by the parameters (row-major, a row
 * per coordinate). */
KEMPE_API const double *kempe_gradient_q(const kempe_gradient *gradient);
KEMPE_API const double *kempe_gradient_q_jacobian(const kempe_gradient *gradient);

KEMPE_END
#endif
