/* SPDX-License-Identifier: BSD-3-Clause */
/* Directional, adjoint and time derivatives. A part of kempe_fmu.c. */
#pragma once

#include "exchange/simulator/fmu_saved.h"

static void clear(double *array, int count)
{
    for (int i = 0; i < count; i++)
        array[i] = 0;
}

/* A direction without any change, and the places of what changes along it. */
static kempe_simulator_change no_change(kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_simulator_change change;
    memset(&change, 0, sizeof change);
    clear(fmu->part.along_x, 2 * e->freedom);
    clear(fmu->part.along_p, e->parameters);
    clear(fmu->part.along_u, 3 * e->inputs);
    change.t = 0;
    if (fmu->now.mode == KEMPE_FMU_INITIALIZATION) /* the start follows from what the importer sets */
        change.start = fmu->now.placed ? KEMPE_CHANGE_START_FROM : KEMPE_CHANGE_START;
    change.x = fmu->part.along_x;
    change.p = fmu->part.along_p;
    change.u = fmu->part.along_u;
    change.dx = fmu->part.dx;
    change.states = fmu->part.states;
    change.q = fmu->part.q;
    change.qd = fmu->part.qd;
    change.qdd = fmu->part.qdd;
    change.lambda = fmu->part.lambda;
    change.y = fmu->part.y;
    change.value = fmu->part.dvalue;
    return change;
}

static kempe_fmu_status add_known(kempe_fmu *fmu, kempe_simulator_change *change, unsigned reference, double by)
{
    double *const knowns[KEMPE_FMU_BLOCKS] = {[KEMPE_FMU_TIME] = &change->t,
                                              [KEMPE_FMU_STATES] = fmu->part.along_x,
                                              [KEMPE_FMU_PARAMETERS] = fmu->part.along_p,
                                              [KEMPE_FMU_INPUTS] = fmu->part.along_u};
    int at = 0;
    const int block = block_of(fmu, reference, &at);
    if (block < 0 || !knowns[block])
        return FAIL("The value reference %u is not one of time, a state, an input or a parameter: no derivatives with "
                    "respect to it are defined.",
                    reference);
    knowns[block][at] += by;
    return KEMPE_FMU_OK;
}

/* The place of the change of an unknown; NULL after a sentence: none. */
static const double *change_of(kempe_fmu *fmu, const kempe_simulator_change *change, unsigned reference)
{
    const double *const unknowns[KEMPE_FMU_BLOCKS] = {
        [KEMPE_FMU_STATES] = change->states, [KEMPE_FMU_RATES] = change->dx,        [KEMPE_FMU_Q] = change->q,
        [KEMPE_FMU_QD] = change->qd,         [KEMPE_FMU_QDD] = change->qdd,         [KEMPE_FMU_LAMBDA] = change->lambda,
        [KEMPE_FMU_OUTPUTS] = change->y,     [KEMPE_FMU_CONDITIONS] = change->value};
    int at = 0;
    const int block = block_of(fmu, reference, &at);
    if (block >= 0 && unknowns[block])
        return unknowns[block] + at;
    (void)FAIL("The value reference %u is not one of a computed variable of type Real or Float64: it has no "
               "derivatives.",
               reference);
    return NULL;
}

static kempe_fmu_status pass(kempe_fmu *fmu, const kempe_simulator_change *change)
{
    return kempe_simulator_along(&fmu->simulator, change) == KEMPE_SIMULATOR_GOES ? KEMPE_FMU_OK
                                                                                  : FAIL("%s", fmu->simulator.message);
}

/* Present values, and all references known. */
static kempe_fmu_status begin_derivatives(kempe_fmu *fmu, const unsigned *unknowns, size_t unknown_count,
                                          const unsigned *knowns, size_t known_count)
{
    kempe_fmu_status status = kempe_fmu_refresh(fmu);
    kempe_simulator_change change = no_change(fmu);
    kempe_simulator_get_choice(&fmu->simulator, fmu->part.choice);
    for (size_t i = 0; i < known_count && status == KEMPE_FMU_OK; i++)
        status = add_known(fmu, &change, knowns[i], 0);
    for (size_t i = 0; i < unknown_count && status == KEMPE_FMU_OK; i++)
        status = change_of(fmu, &change, unknowns[i]) ? KEMPE_FMU_OK : KEMPE_FMU_ERROR;
    return status;
}

kempe_fmu_status kempe_fmu_directional(kempe_fmu *fmu, const unsigned *unknowns, size_t unknown_count,
                                       const unsigned *knowns, size_t known_count, const double *seed,
                                       double *sensitivity)
{
    kempe_fmu_status status = begin_derivatives(fmu, unknowns, unknown_count, knowns, known_count);
    if (status != KEMPE_FMU_OK)
        return status;
    kempe_simulator_change change = no_change(fmu);
    for (size_t i = 0; i < known_count; i++)
        (void)add_known(fmu, &change, knowns[i], seed[i]);
    status = pass(fmu, &change);
    for (size_t i = 0; i < unknown_count && status == KEMPE_FMU_OK; i++)
        sensitivity[i] = *change_of(fmu, &change, unknowns[i]);
    return status;
}

kempe_fmu_status kempe_fmu_adjoint(kempe_fmu *fmu, const unsigned *unknowns, size_t unknown_count,
                                   const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity)
{
    kempe_fmu_status status = begin_derivatives(fmu, unknowns, unknown_count, knowns, known_count);
    for (size_t k = 0; k < known_count && status == KEMPE_FMU_OK; k++) {
        kempe_simulator_change change = no_change(fmu);
        double sum = 0;
        (void)add_known(fmu, &change, knowns[k], 1);
        status = pass(fmu, &change);
        for (size_t i = 0; i < unknown_count && status == KEMPE_FMU_OK; i++)
            sum += seed[i] * *change_of(fmu, &change, unknowns[i]);
        if (status == KEMPE_FMU_OK)
            sensitivity[k] = sum;
    }
    return status;
}

kempe_fmu_status kempe_fmu_output_rates(kempe_fmu *fmu, const unsigned *references, size_t count, const int *orders,
                                        double *values)
{
    for (size_t i = 0; i < count; i++)
        if (!references || !orders || !values || orders[i] != 1)
            return FAIL("Derivatives of outputs with respect to time are available for order 1, not %d.",
                        orders ? orders[i] : 0);
    kempe_fmu_status status = begin_derivatives(fmu, references, count, NULL, 0);
    if (status != KEMPE_FMU_OK || !count)
        return status;
    kempe_simulator_change change = no_change(fmu);
    change.t = 1;
    kempe_simulator_get_rates(&fmu->simulator, fmu->part.along_x);
    status = pass(fmu, &change);
    for (size_t i = 0; i < count && status == KEMPE_FMU_OK; i++)
        values[i] = *change_of(fmu, &change, references[i]);
    return status;
}
