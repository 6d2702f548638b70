/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Frequency response near an equilibrium: the steady-state response of outputs to harmonic inputs, exact at each
 * frequency.
 *
 *     kempe_response_options options = {.inputs = "drive(road)", .outputs = "q(wheel)", .frequencies = "0.1:50"};
 *     kempe_response *response;
 *     kempe_response_new(system, &ask, &response);
 *     kempe_table *rows;
 *     kempe_response_table(response, "rows", &rows);
 *     for (int k = 0; k < kempe_table_row_count(rows); k++)
 *         show(kempe_table_number(rows, k, 0), kempe_table_number(rows, k, 1), kempe_table_number(rows, k, 2));
 */
#ifndef KEMPE_RESPONSE_H
#define KEMPE_RESPONSE_H

#include <kempe/table.h>

KEMPE_BEGIN

/** NULL and 0 take the default. Lists as in kempe/linearize.h, here with at least one input. */
typedef struct kempe_response_options {
    size_t size;             /* sizeof this struct; 0: its size in version 0.1 */
    const char *at;          /* the state, which must be an equilibrium: equilibrium (default), start */
    const char *inputs;      /* effort(JOINT), force(BODY.POINT.x), drive(DRIVE), names of inputs and parameters */
    const char *outputs;     /* default: the model's */
    const char *frequencies; /* "A:B" or "A:B:N", Hz or with units (rad/s, rpm); default: a decade around the natural
                                ones, 200 */
    int linear;              /* 1: evenly spaced from A to B; 0: in even ratios */
    const char *independent; /* independent coordinates; default: Kempe chooses */
    const char *backend;     /* as in kempe_run_options */
    int slide; /* 1: dry friction that sticks at the state has no force, and slides; 0: it keeps its places */
} kempe_response_options;

typedef struct kempe_response kempe_response;

/** Computes the response. KEMPE_E_ARGUMENT: a name or the frequencies are wrong. KEMPE_E_FAILED: there is no
 * equilibrium; the message has the reason. KEMPE_STOPPED: interrupted, without a response. */
KEMPE_API kempe_status kempe_response_new(const kempe_system *system, const kempe_response_options *options,
                                          kempe_response **response);
KEMPE_API void kempe_response_free(kempe_response *response);

KEMPE_API kempe_status kempe_response_print(const kempe_response *response, kempe_format format, char **text);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "rows": frequency, Hz; OUTPUT/INPUT.amplitude and OUTPUT/INPUT.phase, degrees, of each pair, unknown at an undamped
 * pole, which has no steady-state response.
 * "peaks", the maxima of amplitudes inside the range: input, output; frequency; amplitude, infinite at an undamped
 * pole; phase, degrees; gain, the amplitude over the static amplitude; unit of the amplitude. */
KEMPE_API kempe_status kempe_response_table(const kempe_response *response, const char *name, kempe_table **table);

/** Draws amplitudes and phases over the frequency, .svg or .png (table.h). */
KEMPE_API kempe_status kempe_response_write_picture(const kempe_response *response, const char *path);

/** Writes a self-contained HTML page: amplitudes and phases over the frequency. KEMPE_E_IO: the path
 * cannot be written. */
KEMPE_API kempe_status kempe_response_write_report(const kempe_response *response, const char *path);

KEMPE_END
#endif
