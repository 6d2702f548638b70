/* SPDX-License-Identifier: BSD-3-Clause */
/* Co-simulation: the unit integrates. A part of kempe_fmu.c. */
#pragma once

#include "constraints/tolerances.h"
#include "exchange/simulator/fmu_exchange.h"

/* A step of the integrator at a time. The simulator changes its conditions at the beginning of the step after an event:
 * where it does so later than at the beginning, the event is at that time, and the step is undone. */
static kempe_simulator_status step_by_step(kempe_fmu *fmu, double until, kempe_fmu_stride *stride)
{
    kempe_simulator *s = &fmu->simulator;
    kempe_simulator_status status = KEMPE_SIMULATOR_GOES;
    const double from = s->t;
    double back = until;
    while (status == KEMPE_SIMULATOR_GOES && s->t < back) {
        const double events = s->work.events, begin = s->t;
        kempe_simulator_save(s, fmu->part.kept);
        status = kempe_simulator_step(s);
        if (status == KEMPE_SIMULATOR_FAILED || s->t > back) {
            kempe_simulator_restore(s, fmu->part.kept);
            status = kempe_simulator_advance(s, back);
        }
        if (stride->stops_at_events && s->work.events > events && begin > from) {
            kempe_simulator_restore(s, fmu->part.kept);
            stride->event = fmu->now.event = 1;
            status = KEMPE_SIMULATOR_GOES;
            break;
        }
        if (status == KEMPE_SIMULATOR_GOES && stride->observer) {
            double wanted = until;
            const int mode = fmu->now.mode;
            fmu->now.mode = KEMPE_FMU_INTERMEDIATE;
            const int early = stride->observer(fmu, s->t, &wanted);
            fmu->now.mode = mode;
            if (early && wanted < back)
                back = wanted > s->t ? wanted : s->t;
        }
    }
    stride->early = s->t < until;
    return status;
}

kempe_fmu_status kempe_fmu_do_step(kempe_fmu *fmu, double from, double step, kempe_fmu_stride *stride)
{
    kempe_simulator *s = &fmu->simulator;
    const double near = KMP_SAME_COMMUNICATION * (1 + fabs(s->t));
    const double events = s->work.events, exchanges = s->work.exchanges, began = s->t;
    double until = from + step;
    stride->reached = s->t;
    stride->event = stride->early = stride->ended = 0;
    if (!(fabs(from - s->t) <= near))
        return FAIL("The communication step begins at %.17g s, but the unit is at %.17g s.", from, s->t);
    if (!(step > 0) || !isfinite(step))
        return FAIL("The communication step of %g s is not positive and finite.", step);
    if (until > fmu->now.stop + near)
        return FAIL("The communication step ends at %.9g s, which is after the stop time %.9g s.", until,
                    fmu->now.stop);
    if (until > fmu->now.stop)
        until = fmu->now.stop;
    kempe_fmu_status refreshed = kempe_fmu_refresh(fmu);
    if (refreshed != KEMPE_FMU_OK)
        return refreshed;
    if (fmu->now.ended) {
        stride->ended = 1;
        return DISCARD("The motion has ended at t = %.9g s.", s->t);
    }
    const kempe_simulator_status status = stride->stops_at_events || stride->observer
                                              ? step_by_step(fmu, until, stride)
                                              : kempe_simulator_advance(s, until);
    stride->reached = fmu->now.t = s->t;
    (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_STEPS,
                        "The communication step ends at t = %.9g s, after %.0f steps and %.0f evaluations in all.",
                        s->t, s->work.steps, s->work.evaluations);
    if (s->work.events > events || s->work.exchanges > exchanges)
        (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_EVENTS,
                            "Between t = %.9g s and t = %.9g s were %.0f events and %.0f exchanges of states.", began,
                            s->t, s->work.events - events, s->work.exchanges - exchanges);
    if (status == KEMPE_SIMULATOR_FAILED)
        return DISCARD("%s", s->message);
    if (status == KEMPE_SIMULATOR_ENDED)
        stride->ended = fmu->now.ended = 1;
    if (s->message[0]) /* the end, or a table that was left */
        (void)kempe_fmu_say(fmu, KEMPE_FMU_WARNING, KEMPE_FMU_LOG_WARNING, "%s", s->message);
    return KEMPE_FMU_OK;
}
