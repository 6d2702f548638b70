/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Linearisation of a mechanism about a state: state space for chosen inputs and outputs, with exact derivatives.
 *
 *     kempe_linearize_options ask = {.inputs = "effort(A)", .outputs = "position(coupler.P)"};
 *     kempe_linearization *linear;
 *     kempe_linearization_new(system, &ask, &linear);
 *     int rows, columns;
 *     const double *a = kempe_linearization_matrix(linear, KEMPE_MATRIX_A, &rows, &columns);
 *
 * With x = (du, dud), changes of the independent coordinates and of their rates, w the inputs and y the outputs
 * (docs/linearize.md):
 *
 *     xd = A x + B w,   dy = C x + D w          M dudd + G dud + K du + L w = 0,   dq = N du,   dqd = N dud + Nd du
 */
#ifndef KEMPE_LINEARIZE_H
#define KEMPE_LINEARIZE_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** NULL takes the default. Lists are comma-separated. */
typedef struct kempe_linearize_options {
    size_t size;    /* sizeof this struct; 0: its size in version 0.1 */
    const char *at; /* the state: equilibrium (default), start */
    const char
        *inputs; /* effort(JOINT), force(BODY.POINT.x), drive(DRIVE), names of inputs and parameters; default: none */
    const char *outputs; /* as the model's outputs, or a component: "position(b.P).x"; default: the model's if there are
                          * inputs */
    const char *independent; /* independent coordinates; default: Kempe chooses */
    const char *backend;     /* as in kempe_run_options */
    int slide; /* 1: dry friction that sticks at the state has no force, and slides; 0: it keeps its places */
} kempe_linearize_options;

typedef struct kempe_linearization kempe_linearization;

/** Linearises about the state in the options. KEMPE_E_ARGUMENT: a name is wrong; KEMPE_E_FAILED: the state does not
 * exist; the message has the reason. */
KEMPE_API kempe_status kempe_linearization_new(const kempe_system *system, const kempe_linearize_options *options,
                                               kempe_linearization **linearization);
KEMPE_API void kempe_linearization_free(kempe_linearization *linearization);

typedef enum kempe_matrix {
    KEMPE_MATRIX_A,
    KEMPE_MATRIX_B,
    KEMPE_MATRIX_C,
    KEMPE_MATRIX_D,
    KEMPE_MATRIX_M,
    KEMPE_MATRIX_G,
    KEMPE_MATRIX_K,
    KEMPE_MATRIX_L,
    KEMPE_MATRIX_N,
    KEMPE_MATRIX_ND,
    KEMPE_MATRIX_Z /* of a model with sampled states: eigenvalues of A, real and imaginary parts as columns */
} kempe_matrix;

/** One matrix, column-major: element (i, k) at [i + k rows]; owned by the linearization. */
KEMPE_API const double *kempe_linearization_matrix(const kempe_linearization *linearization, kempe_matrix matrix,
                                                   int *rows, int *columns);

typedef enum kempe_channel {
    KEMPE_CHANNEL_STATE, /* q.NAME of the independent coordinates, then qd.NAME */
    KEMPE_CHANNEL_INPUT, /* drive(m) is three: drive(m), its first and its second time derivative drive(m).d and .dd */
    KEMPE_CHANNEL_OUTPUT,
    KEMPE_CHANNEL_DELAY /* delay(NAME): the last inputs and outputs are the delayed signals, in this order */
} kempe_channel;

/** The number of channels; name and unit (SI, "" if unknown) of the k-th. */
KEMPE_API int kempe_linearization_count(const kempe_linearization *linearization, kempe_channel channel);
KEMPE_API const char *kempe_linearization_name(const kempe_linearization *linearization, kempe_channel channel, int k);
KEMPE_API const char *kempe_linearization_unit(const kempe_linearization *linearization, kempe_channel channel, int k);

/** The state: q and qd (n values), and the outputs at it. */
KEMPE_API const double *kempe_linearization_q(const kempe_linearization *linearization);
KEMPE_API const double *kempe_linearization_qd(const kempe_linearization *linearization);
KEMPE_API const double *kempe_linearization_y(const kempe_linearization *linearization);

/** The time of delay k: the last inputs and outputs belong to the delays of the model. Such an input is the output of
 * that name, as it was this time before: w(t) = y(t - T). 0: there is no such delay. */
KEMPE_API double kempe_linearization_delay(const kempe_linearization *linearization, int k);

/** The time T in which all samples of the model's sampled states repeat; 0: it has none. The matrices belong to the
 * steps of T: x(k+1) = A x(k) + B w(k), y(k) = C x(k) + D w(k). In this form x(k) is the state before the samples.
 * Inputs are constant in between. */
KEMPE_API double kempe_linearization_sample_time(const kempe_linearization *linearization);

/** 1: an equilibrium, or a motion that changes no force; 0: the matrices are valid at that instant only. */
KEMPE_API int kempe_linearization_is_equilibrium(const kempe_linearization *linearization);

KEMPE_API kempe_status kempe_linearization_print(const kempe_linearization *linearization, kempe_format format,
                                                 char **text);

/** Writes all matrices and names, whole or not at all: .npz for NumPy, .mat for MATLAB and Octave. KEMPE_E_ARGUMENT:
 * another ending. */
KEMPE_API kempe_status kempe_linearization_write(const kempe_linearization *linearization, const char *path);

KEMPE_END
#endif
