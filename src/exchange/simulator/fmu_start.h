/* SPDX-License-Identifier: BSD-3-Clause */
/* Start of a motion, and the simulator with all that was set. A part of kempe_fmu.c. */
#pragma once

#include "exchange/simulator/fmu_memory.h"

kempe_fmu_status kempe_fmu_set_up(kempe_fmu *fmu, int tolerance_given, double tolerance, double start, int stop_given,
                                  double stop)
{
    if (!isfinite(start) || (stop_given && !(stop >= start)))
        return FAIL("The start time %g s and the stop time %g s are not an interval of time.", start,
                    stop_given ? stop : INFINITY);
    if (tolerance_given && !(tolerance > 0 && tolerance < 1))
        return FAIL("The tolerance %g is not between 0 and 1.", tolerance);
    fmu->now.t = start;
    fmu->now.stop = stop_given ? stop : INFINITY;
    fmu->now.started = 0;
    if (tolerance_given) {
        fmu->simulator.settings.rtol = tolerance;
        fmu->simulator.settings.atol = tolerance;
    }
    return KEMPE_FMU_OK;
}

/* Computes the start anew, with the parameters, inputs and settings as they are. */
static kempe_fmu_status start(kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_simulator *s = &fmu->simulator;
    const kempe_simulator_settings settings = s->settings;
    copy(fmu->part.along_p, s->p, e->parameters);
    copy(fmu->part.along_u, s->u, 3 * e->inputs);
    kempe_simulator_init(s, e, s->memory);
    copy(s->p, fmu->part.along_p, e->parameters);
    copy(s->u, fmu->part.along_u, 3 * e->inputs);
    s->settings = settings;
    s->settings.end = fmu->now.stop;
    kempe_simulator_status status = kempe_simulator_set_parameters(s);
    if (status == KEMPE_SIMULATOR_GOES)
        status = kempe_simulator_set_inputs(s);
    if (status == KEMPE_SIMULATOR_GOES)
        status = fmu->now.placed
                     ? kempe_simulator_start_from(s, fmu->now.t, fmu->part.start, fmu->part.start + e->coordinates)
                     : kempe_simulator_start(s, fmu->now.t);
    if (status == KEMPE_SIMULATOR_FAILED)
        return FAIL("%s", s->message);
    fmu->now.ended = status == KEMPE_SIMULATOR_ENDED;
    if (fmu->now.ended)
        (void)kempe_fmu_say(fmu, KEMPE_FMU_WARNING, KEMPE_FMU_LOG_WARNING, "%s", s->message);
    fmu->now.started = 1;
    fmu->now.moved = fmu->now.pressed = fmu->now.tuned = 0;
    kempe_simulator_get_states(s, fmu->part.x);
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_enter_initialization(kempe_fmu *fmu)
{
    fmu->now.mode = KEMPE_FMU_INITIALIZATION;
    fmu->now.started = 0;
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_exit_initialization(kempe_fmu *fmu, int mode)
{
    kempe_fmu_status status = kempe_fmu_refresh(fmu);
    if (status == KEMPE_FMU_OK)
        fmu->now.mode = mode;
    return status;
}

kempe_fmu_status kempe_fmu_refresh(kempe_fmu *fmu)
{
    kempe_simulator *s = &fmu->simulator;
    if (!fmu->now.started)
        return start(fmu);
    if (fmu->now.tuned && kempe_simulator_set_parameters(s) == KEMPE_SIMULATOR_FAILED)
        return DISCARD("%s", s->message);
    if (fmu->kind == KEMPE_FMU_CO_SIMULATION) {
        if (fmu->now.pressed && kempe_simulator_set_inputs(s) == KEMPE_SIMULATOR_FAILED)
            return DISCARD("%s", s->message);
    } else if (fmu->now.moved || fmu->now.pressed || fmu->now.tuned) {
        if (kempe_simulator_set_states(s, fmu->now.t, fmu->part.x) == KEMPE_SIMULATOR_FAILED)
            return DISCARD("%s", s->message);
    }
    fmu->now.moved = fmu->now.pressed = fmu->now.tuned = 0;
    return KEMPE_FMU_OK;
}
