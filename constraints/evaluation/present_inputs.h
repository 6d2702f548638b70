/* SPDX-License-Identifier: BSD-3-Clause */
/* The inputs of a model at an evaluation: the vector KMP_IN_TIME of all programs. During a step of a run every input is
 * one polynomial, so that the step is smooth; otherwise inputs follow their samples. */
#pragma once

#include "constraints/tolerances.h"
#include "model/data/past_signals.h"
#include "model/data/signal.h"
#include "symbolic/graph.h"
#include <math.h>

typedef struct kmp_present_inputs {
    const kempe_model *model;
    int count;
    kmp_signal_piece *piece; /* of each input */
    bool *replaced;          /* the piece is a caller's: samples of the model are ignored */
    kmp_signal_piece *given; /* of each input: the piece that a caller has given for the next call of enter */
    bool *waits, waiting;    /* there is one; for any input */
    double *vector;          /* t, then the value of each input and two derivatives */
    const kmp_past *past;    /* of delayed signals: gives the last inputs in a run; NULL: they are zero */
    bool held;               /* pieces are constant between calls of kmp_present_inputs_enter */
    bool before;             /* at a sample after t = 0 the piece that ends there, as rows of runs have it */
} kmp_present_inputs;

/** True for times that are one up to rounding. */
static inline bool kmp_same_time(double a, double b)
{
    return fabs(a - b) <= KMP_SAME_TIME * fmin(fabs(a), fabs(b));
}

/** False: no memory. */
bool kmp_present_inputs_init(kmp_present_inputs *inputs, kmp_arena *arena, const kempe_model *model);

/** The vector at t, valid until the next call. */
const double *kmp_present_inputs_at(const kmp_present_inputs *inputs, double t);

/** Takes the vectors of several lanes: t of each in, number k of lane l at k width + l out. */
void kmp_present_inputs_lanes(const kmp_present_inputs *inputs, int width, const double *t, double *vectors);

/** The numbers in the vector. */
static inline int kmp_present_inputs_size(const kmp_present_inputs *inputs)
{
    return 1 + KMP_TIME_NUMBERS * inputs->count;
}

/** Gives an input the polynomial u + rate (t - from) + acceleration (t - from)^2 / 2 in place of its samples, from the
 * next kmp_present_inputs_enter on. */
void kmp_present_inputs_give(kmp_present_inputs *inputs, int input, double from, const double values[3]);

/** Reads delayed signals from a past that begins at its first pieces (NULL: from none). */
void kmp_present_inputs_recall(kmp_present_inputs *inputs, const kmp_past *past);

/** Takes what the past has more now; true if pieces that begin at t, or given ones, have not been entered yet. */
void kmp_present_inputs_renew(kmp_present_inputs *inputs);
bool kmp_present_inputs_are_due(const kmp_present_inputs *inputs, double t);

/** The order of the derivative of a delayed signal that jumps at t, where its present part begins; KMP_PAST_SMOOTH:
 * none does. The signal itself at t, and three derivatives. */
int kmp_present_inputs_past_jump(const kmp_present_inputs *inputs, int input, double t);
void kmp_present_inputs_delayed(const kmp_present_inputs *inputs, int input, double t, double u[4]);

/** The times of a delayed signal from which its present part comes: the ends of polynomials of its past. */
void kmp_present_inputs_source(const kmp_present_inputs *inputs, int input, double *from, double *to);

/** Takes pieces, also given ones, whether samples are replaced, and the past from other inputs of the same model, which
 * must outlive their use. kmp_present_inputs_forget: the model's own samples again, and no past. */
void kmp_present_inputs_copy(kmp_present_inputs *to, const kmp_present_inputs *from);
void kmp_present_inputs_forget(kmp_present_inputs *inputs);

/** Takes the model's own samples in place of given pieces. */
void kmp_present_inputs_take_samples(kmp_present_inputs *inputs);

/** The first time after the present pieces began at which one of them ends; INFINITY: never. */
double kmp_present_inputs_until(const kmp_present_inputs *inputs);

/** Takes the given pieces, and the pieces of samples that begin at t or contain it. The least order of a derivative
 * that jumps there, KMP_SIGNAL_SMOOTH without a jump; *input: the one that jumps. */
int kmp_present_inputs_enter(kmp_present_inputs *inputs, double t, int *input);

/** Takes the pieces of samples that contain t, at a sample the one that begins there; also back in time. */
void kmp_present_inputs_stand(kmp_present_inputs *inputs, double t);

struct kempe_workspace;
