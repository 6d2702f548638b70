/* SPDX-License-Identifier: BSD-3-Clause */
/* The start of a run: independent rows and coordinates, consistent rates and accelerations, a formulation and an
 * integrator. */
#pragma once

#include "constraints/closing/saddle.h"
#include "integrators/formulations/formulation.h"
#include "integrators/run/run.h"

/** Makes everything that a run needs before its integrator starts. */
kempe_status kmp_runner_prepare(kmp_runner *run, const kempe_assembly *start);

/** Begins at spec.t_start: inputs, sampled states, conditions, rows, impacts and modes. The state is in
 * run->room.state, the rows in run->part. */
kempe_status kmp_runner_begin_at(kmp_runner *run, const kempe_assembly *start);

/** The line of the log when closures switch: the kinetic energy that is lost, and before. */
#define KMP_CLOSURES_SWITCH "closures switch and the velocities jump: the kinetic energy falls by %.4g J, from %.4g J"

/** Chooses rows and coordinates at (t, q); rank < 0: by the pivots. */
kempe_status kmp_runner_choose(kmp_runner *run, double t, const double *q, int rank, const int *wish, int wish_count);

/** Makes the margin of the chosen rows at (t, q), the distance from a change point, unless change points are ignored.
 */
kempe_status kmp_runner_compute_margin(kmp_runner *run, double t, const double *q);

/** True for rounded numbers if q is not closed on the rows kept now; kmp_runner_project closes q and qd on them. */
bool kmp_runner_is_off(kmp_runner *run, double t, const double *q);
kempe_status kmp_runner_project(kmp_runner *run, double t, double *q, double *qd);

/** Computes qdd and lambda of the chosen rows at the evaluator's last closure, which was at (t, q). */
kempe_status kmp_runner_accelerate(kmp_runner *run, double t, const double *q, const double *qd);

/** The saddle system of the chosen rows, which several computations of a decision share. `factored`: at the state of
 * the last one. It is the caller's to free, before other rows are chosen. */
typedef struct kmp_shared_saddle {
    kmp_saddle saddle;
    bool made, factored;
} kmp_shared_saddle;

/** Makes it unless it is made, with M in place of products. */
kempe_status kmp_shared_saddle_need(kmp_runner *run, kmp_shared_saddle *shared);
void kmp_shared_saddle_free(kmp_shared_saddle *shared);

/** The same as kmp_runner_project and kmp_runner_accelerate with such a system, which is made, and for accelerations
 * factored, if it is not. */
kempe_status kmp_runner_project_by(kmp_runner *run, double t, double *q, double *qd, kmp_shared_saddle *shared);
kempe_status kmp_runner_accelerate_by(kmp_runner *run, double t, const double *q, const double *qd,
                                      kmp_shared_saddle *shared);

/** Sets the evaluator to the dynamics of the next formulation: articulated bodies, products, or M and C. */
kempe_status kmp_runner_take_dynamics(kmp_runner *run);

/** The start of a formulation at a state, with the rows and the margin of the run. */
kmp_formulation_start kmp_runner_given(kmp_runner *run, double t, const double *q, const double *qd, double work);

/** Makes the formulation at a state, that across change points if the run is near one, and its integrator. */
kempe_status kmp_runner_make(kmp_runner *run, double t, const double *q, const double *qd, double work);

/** Starts the integrator at (t, y[, yp]), a one-step method with a step h (0: chosen by itself). */
kempe_status kmp_runner_start(kmp_runner *run, double t, const double *y, const double *yp, double h);

/** Keeps and gives back what evaluations for rows and polynomials leave as it was. */
void kmp_runner_keep_loads(const kmp_runner *run, kmp_kept_loads *kept);
void kmp_runner_give_loads(kmp_runner *run, const kmp_kept_loads *kept);

/** The integrator's unknowns at t within its last step, and their derivatives for a DAE, to the room of the run. The
 * polynomial is made when it is first asked for; then, too, the next evaluations begin where the step left them. */
kempe_status kmp_runner_dense(kmp_runner *run, double t);

/** A memory has the samples, modes and impacts of a run, which it needs to continue in addition to its state,
 * conditions and inputs: its size in bytes, and a copy. */
size_t kmp_runner_memory_size(const kempe_system *system);
void kmp_runner_keep_memory(kmp_runner *runner, void *memory);

/** Makes one with the evaluator of the caller, which has the numbers and conditions of the present motion. */
kempe_status kmp_runner_site_new(kmp_evaluator *eval, const kmp_run_spec *spec, kmp_runner **site);
void kmp_runner_site_free(kmp_runner *site);

/** Takes the memory of any run of the system; `elsewhere`: for another state, at which modes and impacts begin as at a
 * start. */
void kmp_runner_take_memory(kmp_runner *run, const void *memory, bool elsewhere);
