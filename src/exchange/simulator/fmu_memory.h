/* SPDX-License-Identifier: BSD-3-Clause */
/* Places of the arrays of an instance. A part of kempe_fmu.c. */
#pragma once

#include "exchange/simulator/fmu_messages.h"

/* Places the arrays one after the other; returns their number of doubles. `fmu` NULL: counts alone. */
static int place(kempe_fmu *fmu, const kempe_equations *e, double *memory)
{
    struct kempe_fmu_numbers unused, *part = fmu ? &fmu->part : &unused;
    const int n = e->coordinates, f = e->freedom, c = e->conditions;
    double *choice = NULL;
    struct {
        double **array;
        int count;
    } arrays[] = {{&part->x, 2 * f},
                  {&part->start, 2 * n},
                  {&part->held, c},
                  {&part->value, c},
                  {&part->kept, kempe_simulator_memory(e)},
                  {&part->along_x, 2 * f},
                  {&part->along_p, e->parameters},
                  {&part->along_u, 3 * e->inputs},
                  {&part->dx, 2 * f},
                  {&part->states, 2 * f},
                  {&part->q, n},
                  {&part->qd, n},
                  {&part->qdd, n},
                  {&part->lambda, e->rows},
                  {&part->y, e->outputs},
                  {&part->dvalue, c},
                  {&choice, f}};
    int used = 0;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        if (memory)
            *arrays[i].array = memory + used;
        used += arrays[i].count;
    }
    part->choice = (int *)(void *)choice;
    return used;
}

void kempe_fmu_close(const kempe_fmu_model *model)
{
    if (model && kempe_fmu_exported.close)
        kempe_fmu_exported.close(model);
}

const kempe_fmu_model *kempe_fmu_open(const char *name, const char *token, int kind, const char *resources,
                                      char sentence[KEMPE_FMU_SENTENCE])
{
    const kempe_fmu_model *model = &kempe_fmu_exported;
    const char *missing = NULL;
    sentence[0] = 0;
    if (!name || !name[0])
        missing = "The name of the instance is missing.";
    else if (model->open)
        model = model->open(resources, sentence, KEMPE_FMU_SENTENCE);
    if (!model)
        return NULL;
    if (!missing && (!token || strcmp(token, model->token) != 0))
        missing = "The guid or instantiation token is not that of this unit: it differs from modelDescription.xml.";
    else if (!missing && !(model->kinds & (unsigned)kind))
        missing = "The unit was exported without this kind of simulation.";
    if (!missing)
        return model;
    if (model != &kempe_fmu_exported)
        kempe_fmu_close(model);
    snprintf(sentence, KEMPE_FMU_SENTENCE, "%s", missing);
    return NULL;
}

int kempe_fmu_memory(const kempe_fmu_model *model)
{
    return kempe_simulator_memory(model->equations) + place(NULL, model->equations, NULL);
}

void kempe_fmu_reset(kempe_fmu *fmu)
{
    const kempe_equations *e = fmu->model->equations;
    kempe_simulator *s = &fmu->simulator;
    const size_t n = (size_t)e->coordinates;
    kempe_simulator_init(s, e, s->memory);
    s->settings.rtol = fmu->model->rtol;
    s->settings.atol = fmu->model->atol;
    s->settings.longest = fmu->model->longest;
    memset(&fmu->now, 0, sizeof fmu->now);
    fmu->now.mode = KEMPE_FMU_INSTANTIATED;
    fmu->now.stop = INFINITY;
    memcpy(fmu->part.start, e->start_q, n * sizeof(double));
    memcpy(fmu->part.start + n, e->start_qd, n * sizeof(double));
}

void kempe_fmu_init(kempe_fmu *fmu, const kempe_fmu_model *model, int kind, double *memory)
{
    const int numbers = kempe_fmu_memory(model);
    for (int i = 0; i < numbers; i++)
        memory[i] = 0;
    fmu->model = model;
    fmu->kind = kind;
    memset(&fmu->simulator, 0, sizeof fmu->simulator);
    fmu->simulator.memory = memory;
    (void)place(fmu, model->equations, memory + kempe_simulator_memory(model->equations));
    kempe_fmu_reset(fmu);
}

static void copy(double *to, const double *from, int count)
{
    for (int i = 0; i < count; i++)
        to[i] = from[i];
}
