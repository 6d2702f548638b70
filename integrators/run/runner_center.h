/* SPDX-License-Identifier: BSD-3-Clause */
/* Spherical joints between steps: centred before their angles become singular, and followed in the user's
 * coordinates, which are continuous across changes of charts. */
#pragma once

#include "integrators/run/run.h"

/** q at t within the last step, to the accuracy of the integration; kmp_runner_place: in run->room.state, with the
 * closures of the evaluator evaluated there. */
kempe_status kmp_runner_position(kmp_runner *run, double t, double *q);
kempe_status kmp_runner_place(kmp_runner *run, double t);

/** Sets q and qd of the start in run->room.state; spherical joints with nearly singular angles are centred. */
void kmp_runner_center_start(kmp_runner *run, const kempe_assembly *start);

/** Centres the spherical joints whose angles approached their singular position in the step that ended at t. */
kempe_status kmp_runner_center(kmp_runner *run, double t);

/** Follows the user's coordinates of centred joints up to t within the last step, not back. */
void kmp_runner_follow(kmp_runner *run, double t);

/** Converts a row to the user's coordinates, at the time to which these were followed. */
void kmp_runner_show(kmp_runner *run, double *q, double *qd, double *qdd);
