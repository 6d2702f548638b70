/* SPDX-License-Identifier: BSD-3-Clause */
/* Model exchange: the importer integrates. A part of kempe_fmu.c. */
#pragma once

#include "exchange/simulator/fmu_derivatives.h"

kempe_fmu_status kempe_fmu_set_time(kempe_fmu *fmu, double t)
{
    if (!isfinite(t))
        return FAIL("The time %g is not a finite number.", t);
    fmu->now.moved |= !same_bits(fmu->now.t, t);
    fmu->now.t = t;
    return KEMPE_FMU_OK;
}

static kempe_fmu_status check_count(kempe_fmu *fmu, const void *array, size_t count, int expected, const char *what)
{
    return count == (size_t)expected && (array || !count)
               ? KEMPE_FMU_OK
               : FAIL("The model has %d %s, and %lu are given.", expected, what, array ? (unsigned long)count : 0ul);
}

kempe_fmu_status kempe_fmu_set_states(kempe_fmu *fmu, const double *x, size_t count)
{
    kempe_fmu_status status = check_count(fmu, x, count, 2 * fmu->model->equations->freedom, "continuous states");
    for (size_t i = 0; i < count && status == KEMPE_FMU_OK; i++)
        if (!isfinite(x[i]))
            status =
                DISCARD("The continuous state %lu is not a finite number: take a smaller step.", (unsigned long)i + 1);
    for (size_t i = 0; i < count && status == KEMPE_FMU_OK; i++) {
        fmu->now.moved |= !same_bits(fmu->part.x[i], x[i]);
        fmu->part.x[i] = x[i];
    }
    return status;
}

/* Copies an array of the present state. */
static kempe_fmu_status give(kempe_fmu *fmu, int block, double *to, size_t count, const char *what)
{
    kempe_fmu_status status = check_count(fmu, to, count, variables_of(fmu, block).size, what);
    if (status == KEMPE_FMU_OK)
        status = kempe_fmu_refresh(fmu);
    if (status == KEMPE_FMU_OK && count)
        memcpy(to, values_of(fmu, block), count * sizeof(double));
    return status;
}

kempe_fmu_status kempe_fmu_get_states(kempe_fmu *fmu, double *x, size_t count)
{
    return give(fmu, KEMPE_FMU_STATES, x, count, "continuous states");
}

kempe_fmu_status kempe_fmu_get_rates(kempe_fmu *fmu, double *dx, size_t count)
{
    return give(fmu, KEMPE_FMU_RATES, dx, count, "derivatives of states");
}

int kempe_fmu_indicators(const kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    int count = 0;
    for (int i = 0; i < e->conditions; i++)
        count += KEMPE_CONDITION_IS_EVENT(e->condition_kind[i]);
    return count;
}

kempe_fmu_status kempe_fmu_get_indicators(kempe_fmu *fmu, double *value, size_t count)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_fmu_status status = check_count(fmu, value, count, kempe_fmu_indicators(fmu), "event indicators");
    if (status == KEMPE_FMU_OK)
        status = kempe_fmu_refresh(fmu);
    if (status != KEMPE_FMU_OK)
        return status;
    const double *all = values_of(fmu, KEMPE_FMU_CONDITIONS);
    for (int i = 0; i < e->conditions; i++)
        if (KEMPE_CONDITION_IS_EVENT(e->condition_kind[i]))
            *value++ = all[i];
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_get_nominals(kempe_fmu *fmu, double *nominal, size_t count)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_fmu_status status = check_count(fmu, nominal, count, 2 * e->freedom, "continuous states");
    if (status == KEMPE_FMU_OK)
        status = kempe_fmu_refresh(fmu);
    if (status != KEMPE_FMU_OK)
        return status;
    kempe_simulator_get_choice(&fmu->simulator, fmu->part.choice);
    for (int i = 0; i < e->freedom; i++)
        nominal[i] = nominal[e->freedom + i] = e->scale[fmu->part.choice[i]];
    return KEMPE_FMU_OK;
}

/* Sentences on what an event changed. */
static void tell_events(kempe_fmu *fmu, int exchanged)
{
    const kempe_equations *e = fmu->model->equations;
    const kempe_simulator *s = &fmu->simulator;
    for (int i = 0; i < e->conditions; i++)
        if (e->condition_kind[i] <= KEMPE_CONDITION_ENDS && (s->part.modes[i] > 0.5) != (fmu->part.held[i] > 0.5))
            (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_EVENTS, "The condition '%s' %s at t = %.9g s.",
                                e->condition_names[i], s->part.modes[i] > 0.5 ? "holds" : "ends", s->t);
    for (int i = 0; e->friction && i < e->friction->elements; i++) {
        const int slot = e->friction->slot[i]; /* its second number is 1 where it is held; the name of the third */
        if ((s->part.modes[slot + 1] > 0.5) != (fmu->part.held[slot + 1] > 0.5))
            (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_EVENTS, "The %s %s at t = %.9g s.",
                                e->condition_names[slot + 2], s->part.modes[slot + 1] > 0.5 ? "sticks" : "slips", s->t);
    }
    kempe_simulator_get_choice(s, fmu->part.choice);
    for (int i = 0; i < e->freedom && exchanged; i++)
        (void)kempe_fmu_say(fmu, KEMPE_FMU_OK, KEMPE_FMU_LOG_EVENTS,
                            "The states x[%d] and x[%d] belong to the coordinate '%s' from t = %.9g s on.", i + 1,
                            e->freedom + i + 1, e->coordinate_names[fmu->part.choice[i]], s->t);
}

kempe_fmu_status kempe_fmu_update(kempe_fmu *fmu, int *changed, int *exchanged, int *ended, double *next)
{
    kempe_simulator *s = &fmu->simulator;
    kempe_fmu_status status = kempe_fmu_refresh(fmu);
    const double exchanges = s->work.exchanges;
    *changed = *exchanged = *ended = 0;
    *next = kempe_simulator_next_time(s);
    if (status != KEMPE_FMU_OK)
        return status;
    if (fmu->model->equations->conditions)
        memcpy(fmu->part.held, s->part.modes, (size_t)fmu->model->equations->conditions * sizeof(double));
    kempe_simulator_status result = kempe_simulator_update(s, changed);
    if (result == KEMPE_SIMULATOR_FAILED)
        return FAIL("%s", s->message);
    *exchanged = s->work.exchanges > exchanges;
    if (result == KEMPE_SIMULATOR_ENDED) {
        fmu->now.ended = 1;
        (void)kempe_fmu_say(fmu, KEMPE_FMU_WARNING, KEMPE_FMU_LOG_WARNING, "%s", s->message);
    }
    *ended = fmu->now.ended;
    *next = kempe_simulator_next_time(s);
    fmu->now.event = 0;
    kempe_simulator_get_states(s, fmu->part.x);
    tell_events(fmu, *exchanged);
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_completed_step(kempe_fmu *fmu, int *wants_event, int *ended)
{
    kempe_fmu_status status = kempe_fmu_refresh(fmu);
    *wants_event = status == KEMPE_FMU_OK && kempe_simulator_wants_exchange(&fmu->simulator);
    *ended = fmu->now.ended;
    return status;
}
