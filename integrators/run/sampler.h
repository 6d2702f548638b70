/* SPDX-License-Identifier: BSD-3-Clause */
/* Sampled states of the model during a run. Each takes its next value at a sample or an event, from the state of the
 * motion before any of them has changed. */
#pragma once

#include "integrators/run/run.h"

/** Makes the sampler of a run that starts at t, if the model has sampled states. */
kempe_status kmp_runner_make_sampler(kmp_runner *run, double t);
void kmp_runner_free_sampler(kmp_runner *run);

/** Lists what the sampler knows of its past; returns the number of pieces. Their size in all. */
int kmp_runner_sampler_memory(kmp_runner *run, kmp_memory_piece *piece);
size_t kmp_sampler_memory_size(const kempe_model *model);

/** The end of the integrator's steps: the caller's, or the next sample of an input or a state. Times that are equal up
 * to rounding are one. */
double kmp_runner_pause(const kmp_runner *run);

/** The end of the step that begins at t: the end of the integrator's steps, or t and the longest step that is allowed.
 */
double kmp_runner_limit(const kmp_runner *run, double t);

/** The last time whose row belongs to a step that ends at t: beyond t by rounding where a sample of a state or an input
 * is due, so that the row has the values before it. */
double kmp_runner_reach(const kmp_runner *run, double t);

/** The time of the next sample that has not been taken; INFINITY: there is none. */
double kmp_runner_next_sample(const kmp_runner *run);

/** True if a sample is due at t. */
bool kmp_runner_sample_is_due(const kmp_runner *run, double t);

/** Notes which comparisons of states that change at events are true. Returns true if one has become true since the
 * last call, and its state is due. */
void kmp_runner_note_events(kmp_runner *run);
bool kmp_runner_meets_events(kmp_runner *run);

/** At the start: true if the comparison of a state holds that changes then too, and the state is due. */
bool kmp_runner_settles(kmp_runner *run);

/** Takes the samples that are due at t: sets sampled states in run->room.state, whose inputs apply from t on. */
void kmp_runner_take_samples(kmp_runner *run, double t);
