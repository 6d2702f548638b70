/* SPDX-License-Identifier: BSD-3-Clause */
/* Values of variables: getting and setting. A part of kempe_fmu.c. */
#pragma once

#include "exchange/simulator/fmu_start.h"

/* Variables of one block: their numbers at the present state, and their names as a person reads them. */
typedef struct kempe_fmu_variables {
    int size;
    const double *values;
    const char *const *names;
} kempe_fmu_variables;

static kempe_fmu_variables variables_of(kempe_fmu *fmu, int block)
{
    static const char *const settings[KEMPE_FMU_SETTINGS_COUNT] = {"solver.rtol", "solver.atol", "solver.fixed_step",
                                                                   "solver.longest_step"};
    static const char *const time[] = {"time"};
    const kempe_equations *e = fmu->model->equations;
    const kempe_simulator *s = &fmu->simulator;
    const int n = e->coordinates, f = e->freedom;
    const kempe_fmu_variables blocks[KEMPE_FMU_BLOCKS] = {
        [KEMPE_FMU_TIME] = {1, fmu->kind == KEMPE_FMU_CO_SIMULATION && fmu->now.started ? &s->t : &fmu->now.t, time},
        [KEMPE_FMU_STATES] = {2 * f, s->part.x, NULL},
        [KEMPE_FMU_RATES] = {2 * f, s->part.rates, NULL},
        [KEMPE_FMU_Q] = {n, s->q, e->coordinate_names},
        [KEMPE_FMU_QD] = {n, s->qd, e->coordinate_names},
        [KEMPE_FMU_QDD] = {n, s->qdd, e->coordinate_names},
        [KEMPE_FMU_LAMBDA] = {e->rows, s->lambda, e->row_names},
        [KEMPE_FMU_OUTPUTS] = {e->outputs, s->y, e->output_names},
        [KEMPE_FMU_INPUTS] = {3 * e->inputs, s->u, e->input_names},
        [KEMPE_FMU_PARAMETERS] = {e->parameters, s->p, e->parameter_names},
        [KEMPE_FMU_CONDITIONS] = {e->conditions, fmu->part.value, e->condition_names},
        [KEMPE_FMU_SETTINGS] = {KEMPE_FMU_SETTINGS_COUNT, NULL, settings},
        [KEMPE_FMU_CHOICE] = {f, NULL, NULL},
        [KEMPE_FMU_WORK] = {KEMPE_FMU_WORK_COUNT, NULL, NULL}};
    return blocks[block];
}

/* The block of a value reference and the place in it; -1: none. */
static int block_of(kempe_fmu *fmu, unsigned reference, int *at)
{
    const unsigned block = reference / KEMPE_FMU_BLOCK;
    *at = (int)(reference % KEMPE_FMU_BLOCK);
    return block < KEMPE_FMU_BLOCKS && *at < variables_of(fmu, (int)block).size ? (int)block : -1;
}

static kempe_fmu_status unknown(kempe_fmu *fmu, unsigned reference, const char *type)
{
    return FAIL("The value reference %u is not one of a variable of type %s: modelDescription.xml lists them.",
                reference, type);
}

static double *setting(kempe_fmu *fmu, int at)
{
    kempe_simulator_settings *settings = &fmu->simulator.settings;
    double *all[KEMPE_FMU_SETTINGS_COUNT] = {&settings->rtol, &settings->atol, &settings->fixed_step,
                                             &settings->longest};
    return all[at];
}

static const char *name_of(kempe_fmu *fmu, int block, int at)
{
    const char *const *names = variables_of(fmu, block).names;
    return names ? names[block == KEMPE_FMU_INPUTS ? at / 3 : at] : "x";
}

/* The block as numbers at the present state. */
static const double *values_of(kempe_fmu *fmu, int block)
{
    if (block == KEMPE_FMU_CONDITIONS)
        kempe_simulator_get_changes(&fmu->simulator, fmu->part.value);
    return variables_of(fmu, block).values;
}

kempe_fmu_status kempe_fmu_get(kempe_fmu *fmu, const unsigned *references, size_t count, double *values)
{
    const double *array = NULL;
    int current = -1;
    for (size_t i = 0; i < count; i++) {
        int at = 0;
        const int block = references && values ? block_of(fmu, references[i], &at) : -1;
        if (block < 0 || block >= KEMPE_FMU_CHOICE)
            return unknown(fmu, references ? references[i] : 0, "Real or Float64");
        const int given = block == KEMPE_FMU_TIME || block == KEMPE_FMU_INPUTS || block == KEMPE_FMU_PARAMETERS;
        if (block == KEMPE_FMU_SETTINGS) {
            values[i] = *setting(fmu, at);
            continue;
        }
        if (fmu->now.mode == KEMPE_FMU_INSTANTIATED && (block == KEMPE_FMU_Q || block == KEMPE_FMU_QD)) {
            values[i] = fmu->part.start[at + (block == KEMPE_FMU_QD ? fmu->model->equations->coordinates : 0)];
            continue;
        }
        if (!given) {
            if (fmu->now.mode == KEMPE_FMU_INSTANTIATED)
                return FAIL("The variable '%s' has no value yet: enter Initialization Mode first.",
                            name_of(fmu, block, at));
            kempe_fmu_status status = kempe_fmu_refresh(fmu);
            if (status != KEMPE_FMU_OK)
                return status;
        }
        if (block != current)
            array = values_of(fmu, current = block);
        values[i] = array[at];
    }
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_get_integers(kempe_fmu *fmu, const unsigned *references, size_t count, int *values)
{
    const kempe_simulator *s = &fmu->simulator;
    const double work[KEMPE_FMU_WORK_COUNT] = {s->work.exchanges, s->work.events, s->work.steps, s->work.evaluations};
    for (size_t i = 0; i < count; i++) {
        int at = 0;
        const int block = references && values ? block_of(fmu, references[i], &at) : -1;
        if (block < KEMPE_FMU_CHOICE)
            return unknown(fmu, references ? references[i] : 0, "Integer or Int32");
        if (block == KEMPE_FMU_WORK) {
            values[i] = work[at] < 2147483647.0 ? (int)work[at] : 2147483647;
            continue;
        }
        if (fmu->now.mode == KEMPE_FMU_INSTANTIATED)
            return FAIL("The independent coordinates are not chosen yet: enter Initialization Mode first.");
        kempe_fmu_status status = kempe_fmu_refresh(fmu);
        if (status != KEMPE_FMU_OK)
            return status;
        kempe_simulator_get_choice(s, fmu->part.choice);
        values[i] = fmu->part.choice[at] + 1;
    }
    return KEMPE_FMU_OK;
}

kempe_fmu_status kempe_fmu_no_variables(kempe_fmu *fmu, size_t count, const unsigned *references, const char *type)
{
    return count ? unknown(fmu, references ? references[0] : 0, type) : KEMPE_FMU_OK;
}

static int same_bits(double a, double b)
{
    return !memcmp(&a, &b, sizeof a);
}

/* Checks that a variable may be set in the present mode. */
static kempe_fmu_status check_set(kempe_fmu *fmu, int block, int at, double value)
{
    const int early = fmu->now.mode & (KEMPE_FMU_INSTANTIATED | KEMPE_FMU_INITIALIZATION);
    const char *name = name_of(fmu, block, at);
    switch (block) {
    case KEMPE_FMU_INPUTS:
        if (fmu->now.mode == KEMPE_FMU_INTERMEDIATE)
            return FAIL("The input '%s' cannot be set during an intermediate update.", name);
        break;
    case KEMPE_FMU_PARAMETERS:
        if (!early && fmu->model->equations->parameter_fixed[at])
            return FAIL("The parameter '%s' is fixed, because the loops depend on it: set it before the end of "
                        "initialisation.",
                        name);
        if (!early && !(fmu->now.mode & (KEMPE_FMU_EVENT | KEMPE_FMU_STEP)))
            return FAIL("The parameter '%s' can be set in Event Mode and Step Mode, not in the state '%s'.", name,
                        mode_name(fmu->now.mode));
        break;
    case KEMPE_FMU_SETTINGS:
        if (!early)
            return FAIL("The setting '%s' is fixed: set it before the end of initialisation.", name);
        if (!(value > 0 || (value == 0 && at > 1)))
            return FAIL("The setting '%s' cannot be %g: it has a positive value.", name, value);
        break;
    case KEMPE_FMU_Q:
    case KEMPE_FMU_QD:
        if (!early)
            return FAIL("The start value of the coordinate '%s' can only be set before the end of initialisation.",
                        name);
        break;
    default:
        return FAIL("The variable '%s' is computed: it cannot be set.", name);
    }
    return isfinite(value) ? KEMPE_FMU_OK
                           : FAIL("The value %g of the variable '%s' is not a finite number.", value, name);
}

kempe_fmu_status kempe_fmu_set(kempe_fmu *fmu, const unsigned *references, size_t count, const double *values)
{
    kempe_simulator *s = &fmu->simulator;
    for (size_t i = 0; i < count; i++) { /* all or none */
        int at = 0;
        const int block = references && values ? block_of(fmu, references[i], &at) : -1;
        if (block < 0 || block >= KEMPE_FMU_CHOICE)
            return unknown(fmu, references ? references[i] : 0, "Real or Float64");
        kempe_fmu_status status = check_set(fmu, block, at, values[i]);
        if (status != KEMPE_FMU_OK)
            return status;
    }
    for (size_t i = 0; i < count; i++) {
        int at = 0;
        const int block = block_of(fmu, references[i], &at), n = fmu->model->equations->coordinates;
        double *place = block == KEMPE_FMU_INPUTS       ? s->u + at
                        : block == KEMPE_FMU_PARAMETERS ? s->p + at
                        : block == KEMPE_FMU_SETTINGS   ? setting(fmu, at)
                                                        : fmu->part.start + at + (block == KEMPE_FMU_QD ? n : 0);
        if (block == KEMPE_FMU_Q || block == KEMPE_FMU_QD)
            fmu->now.placed = 1;
        else if (same_bits(*place, values[i]))
            continue;
        *place = values[i];
        fmu->now.pressed |= block == KEMPE_FMU_INPUTS;
        fmu->now.tuned |= block == KEMPE_FMU_PARAMETERS;
        if (fmu->now.mode & (KEMPE_FMU_INSTANTIATED | KEMPE_FMU_INITIALIZATION))
            fmu->now.started = 0;
    }
    return KEMPE_FMU_OK;
}
