/* SPDX-License-Identifier: BSD-3-Clause */
/* Multistep methods under inputs that jump. Each restart is at order one, in many short steps whose errors are near the
 * tolerance and add up: with samples every 1 to 50 ms they were 10 to 500 times the tolerance, in two to five times the
 * evaluations of a one-step method, which keeps order and step size. Gear (ACM TOMS 6 (1980) 263) starts multistep
 * methods by Runge-Kutta steps; a history cannot be given to SUNDIALS, so a one-step method stands in until restarts
 * have become rare: an explicit one for Adams, a stiffly accurate one for BDF. */
#include "integrators/run/runner_stand_in.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "integrators/run/sampler.h"

#include <math.h>

/* A restart is frequent after fewer steps of the multistep method: its start at order one takes 20 to 35 of them. The
 * multistep method returns after so many steps of the one-step method, which simulate some 100 of its own, and twice as
 * many after each return. */
enum { FREQUENT = 100, QUIET = 24, MOST_DOUBLED = 16 };

kmp_stand_in kmp_runner_stand_in(const kmp_runner *run)
{
    return run->stand_in;
}

bool kmp_runner_relieve(kmp_runner *run, double t)
{
    long tried = kmp_runner_tried(run), steps = tried - run->restarted;
    const kmp_solver_kind *own = run->kind;
    run->restarted = tried;
    /* At the start of a run, a limit of steps before its end announces the first restart. */
    const bool frequent = steps > 0 ? steps < FREQUENT : kmp_runner_pause(run) < run->spec.t_end;
    if (!own->stand_in || !frequent)
        return false;
    run->stand_in.active = true;
    run->choice.kind = own->stand_in;
    kmp_run_log_add(run->log, "integrator", t, (double)steps, FREQUENT,
                    "%s continues in place of %s: inputs jump, and each start at order one would add its errors",
                    own->stand_in->name, own->name);
    return true;
}

kempe_status kmp_runner_return(kmp_runner *run, double t)
{
    long returns = run->stand_in.returns < MOST_DOUBLED ? run->stand_in.returns : MOST_DOUBLED;
    if (!run->stand_in.active || run->anew || run->near_singular ||
        kmp_runner_tried(run) - run->restarted < (long)QUIET << returns)
        return KEMPE_OK;
    run->stand_in.active = false;
    run->stand_in.returns++;
    run->restarted = kmp_runner_tried(run);
    run->choice.kind = NULL;
    kmp_run_log_add(run->log, "integrator", t, NAN, NAN, "%s continues: inputs have not jumped for %ld steps",
                    run->spec.integrator, (long)QUIET << returns);
    return kmp_runner_change_formulation(run, t, false, 0);
}
