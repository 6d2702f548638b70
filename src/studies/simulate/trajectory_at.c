/* SPDX-License-Identifier: BSD-3-Clause */
/* States and outputs of a finished run between its rows. */
#include "integrators/steppers/sample_times.h"
#include "studies/simulate/trajectory.h"
#include <kempe/output_handles.h>
#include <string.h>

/* A time that is equal to the end up to rounding, as that of a last row, is the end. */
static kempe_status check_time(const kempe_trajectory *trajectory, double *at)
{
    const double t = *at;
    kempe_context *context = trajectory->system->context;
    double from, until;
    if (!trajectory->recording)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "the run has rows only: set keep_dense for states at any other time");
    if (!kmp_recording_ends(trajectory->recording, &from, &until))
        return kmp_fail(context, KEMPE_E_ARGUMENT, "t = %.9g s: the run has no state", t);
    if (t >= from && t <= kmp_last_equal(until)) {
        *at = t < until ? t : until;
        return KEMPE_OK;
    }
    return kmp_fail(context, KEMPE_E_ARGUMENT, "t = %.9g s is not within the run, from %.9g to %.9g s", t, from, until);
}

static double *take(double *to, double *from, int count)
{
    if (to)
        memcpy(to, from, (size_t)count * sizeof *to);
    return from + count;
}

kempe_status kempe_trajectory_at(kempe_trajectory *trajectory, double t, double *q, double *qd, double *qdd,
                                 double *lambda)
{
    KMP_WANTED(NULL, trajectory, "trajectory");
    int n = trajectory->system->n;
    double *row = trajectory->at;
    kmp_model_begin(trajectory->system->model);
    KMP_TRY(check_time(trajectory, &t));
    KMP_TRY(kmp_recording_row(trajectory->recording, t, row));
    (void)take(lambda, take(qdd, take(qd, take(q, row, n), n), n), trajectory->system->m);
    return KEMPE_OK;
}

kempe_status kempe_outputs_at_time(kempe_outputs *outputs, kempe_trajectory *trajectory, double t, double *values)
{
    KMP_WANTED(NULL, outputs, "outputs");
    KMP_WANTED(NULL, trajectory, "trajectory");
    const double *row = trajectory->at;
    int n = trajectory->system->n;
    KMP_TRY(kempe_trajectory_at(trajectory, t, NULL, NULL, NULL, NULL));
    return kempe_outputs_at(outputs, t, row, row + n, row + 2 * n, row + 3 * n, values);
}
