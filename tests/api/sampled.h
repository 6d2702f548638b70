/* SPDX-License-Identifier: BSD-3-Clause */
/* Methods and models for tests of steppers. */
#ifndef KEMPE_TESTS_SAMPLED_H
#define KEMPE_TESTS_SAMPLED_H

#include "testing.h"
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <stdbool.h>

typedef struct method {
    const char *formulation, *form, *integrator;
} method;

static const method methods[] = {
    {"reduced", "integrated", "dop853"},
    {"reduced", "integrated", "dopri5"},
    {"reduced", "integrated", "erk"},
    {"reduced", "integrated", "radau"},
    {"reduced", "newton", "dop853"},
    {"reduced", "newton", "adams"},
    {"reduced", "newton", "bdf"},
    {"reduced", "newton", "dirk"},
    {"reduced", "newton", "radau5"},
    {"reduced", "newton", "radau9"},
    {"reduced", "newton", "ida"},
    {"projected", NULL, "dop853"},
    {"projected", NULL, "dopri5"},
    {"projected", NULL, "erk"},
    {"projected", NULL, "radau"},
    {"dae", "stabilized1", "ida"},
    {"dae", "ggl", "ida"},
    {"dae", "index2", "ida"},
    {"dae", "index1", "ida"},
    {"dae", "index1", "radau"},
    {"dae", "index3", "ida"},
};
enum { METHODS = sizeof methods / sizeof *methods };

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
} scene;

static inline scene scene_of(const char *text)
{
    scene s = {.context = kempe_context_new()};
    if (kempe_model_read_text(s.context, text, "model.yaml", &s.model) != KEMPE_OK ||
        kempe_system_new(s.model, &s.system) != KEMPE_OK)
        printf("%s\n", kempe_context_message(s.context));
    CHECK(s.system != NULL);
    return s;
}

static inline void scene_free(scene *s)
{
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

static inline kempe_run_options options(const method *m, double t_end, double rtol)
{
    return (kempe_run_options){
        .formulation = m->formulation, .form = m->form, .integrator = m->integrator, .t_end = t_end, .rtol = rtol};
}

#endif
