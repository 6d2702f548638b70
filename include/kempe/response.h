/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Frequency response near an equilibrium: the steady-state response of outputs to harmonic inputs, exact at each
 * frequency.
 *
 *     kempe_response_options ask = {.inputs = "drive(road)", .outputs = "q(wheel)", .frequencies = "0.1:50"};
 *     kempe_response *response;
 *     kempe_response_new(system, &ask, &response);
 *     for (int k = 0; k < kempe_response_count(response); k++) {
 *         double re, im;
 *         if (kempe_response_at(response, k, 0, 0, &re, &im))
 *             show(kempe_response_frequency(response, k), hypot(re, im), atan2(im, re));
 *     }
 */
#ifndef KEMPE_RESPONSE_H
#define KEMPE_RESPONSE_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** NULL and 0 take the default. Lists as in kempe/linearize.h, here with at least one input. */
typedef struct kempe_response_options {
    const char *at;          /* the state, which must be an equilibrium: equilibrium (default), start */
    const char *inputs;      /* effort(JOINT), force(BODY.POINT.x), drive(DRIVE), names of parameters */
    const char *outputs;     /* default: the model's */
    const char *frequencies; /* Hz, "A:B" or "A:B:N"; default: a decade around the natural frequencies, 200 of them */
    int linear;              /* 1: evenly spaced from A to B; 0: in even ratios */
    const char *independent; /* independent coordinates; default: Kempe chooses */
    const char *backend;
} kempe_response_options;

typedef struct kempe_response kempe_response;

/** Computes the response. KEMPE_E_ARGUMENT: a name or the frequencies are wrong. KEMPE_E_FAILED: there is no
 * equilibrium; the message has the reason. KEMPE_STOPPED: interrupted, without a response. */
KEMPE_API kempe_status kempe_response_new(const kempe_system *system, const kempe_response_options *ask,
                                          kempe_response **response);
KEMPE_API void kempe_response_free(kempe_response *response);

/** The number of frequencies; the k-th, Hz. */
KEMPE_API int kempe_response_count(const kempe_response *response);
KEMPE_API double kempe_response_frequency(const kempe_response *response, int k);

/** Inputs and outputs: their number, names and units (SI; "" if unknown). */
KEMPE_API int kempe_response_input_count(const kempe_response *response);
KEMPE_API int kempe_response_output_count(const kempe_response *response);
KEMPE_API const char *kempe_response_input_name(const kempe_response *response, int input);
KEMPE_API const char *kempe_response_output_name(const kempe_response *response, int output);
KEMPE_API const char *kempe_response_input_unit(const kempe_response *response, int input);
KEMPE_API const char *kempe_response_output_unit(const kempe_response *response, int output);

/** Transfer function output / input at frequency k, complex. Returns 0 at an undamped pole, which has no steady-state
 * response. */
KEMPE_API int kempe_response_at(const kempe_response *response, int k, int input, int output, double *re, double *im);

/** A maximum of an amplitude inside the range. */
typedef struct kempe_peak {
    int input, output;
    double frequency; /* Hz */
    double amplitude; /* infinite at an undamped pole */
    double phase;     /* rad; NaN at an undamped pole */
    double gain;      /* amplitude over that of the static response; NaN if it does not exist or is zero */
} kempe_peak;

KEMPE_API int kempe_response_peak_count(const kempe_response *response);
KEMPE_API kempe_peak kempe_response_peak(const kempe_response *response, int k);

KEMPE_API kempe_status kempe_response_print(const kempe_response *response, kempe_format format, char **text);

/** Writes a row per frequency: amplitude and phase (degrees) of each output to each input; empty at poles. */
KEMPE_API kempe_status kempe_response_write_csv(const kempe_response *response, const char *path);

/** Draws amplitudes and phases over the frequency (SVG). */
KEMPE_API kempe_status kempe_response_write_svg(const kempe_response *response, const char *path);

#ifdef __cplusplus
}
#endif
#endif
