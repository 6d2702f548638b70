/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense output of a whole run: of each step, what its rows depend on. The runner of the run stays, and makes a row at
 * any time as it made rows during the run: it is given the formulation, the coordinates, the conditions and the inputs
 * of that step, and the polynomial of its integrator. */
#pragma once

#include "integrators/run/run.h"

typedef struct kmp_recording kmp_recording;

/** Once its numbers take more than `most` bytes (0: any), it ends, and forgets all steps: kmp_recording_ends is then
 * false, and kmp_recording_is_over true. NULL: no memory. */
kmp_recording *kmp_recording_new(double most);
void kmp_recording_free(kmp_recording *recording);
bool kmp_recording_is_over(const kmp_recording *recording);

/** Records the last step of a run, initially its start. KEMPE_E_MEMORY. */
kempe_status kmp_recording_add(kmp_recording *recording, kmp_runner *runner);

/** Takes the runner at the end of its run (NULL: there is none). */
void kmp_recording_take(kmp_recording *recording, kmp_runner *runner);

/** Gives the runner the strings and lists of its run in a place that lasts as long as the recording. */
void kmp_recording_keep_spec(kmp_recording *recording, const kmp_run_spec *spec);

/** The recorded times; false: there are none. */
bool kmp_recording_ends(const kmp_recording *recording, double *from, double *until);

/** The number of recorded steps, and the end of step k. */
int kmp_recording_steps(const kmp_recording *recording);
double kmp_recording_step_end(const kmp_recording *recording, int k);

/** Row at a recorded time: q, qd, qdd (n each), lambda (m); where it is not `whole`, the last two have no meaning.
 * KEMPE_E_FAILED: it cannot be completed, as in the run. */
kempe_status kmp_recording_row(kmp_recording *recording, double t, bool whole, double *row);
