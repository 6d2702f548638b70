/* SPDX-License-Identifier: BSD-3-Clause */
/* Methods and models for tests of steppers. */
#ifndef KEMPE_TESTS_SAMPLED_H
#define KEMPE_TESTS_SAMPLED_H

#include "loaded.h"
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

static inline kempe_run_options options(const method *m, double t_end, double rtol)
{
    return (kempe_run_options){
        .formulation = m->formulation, .form = m->form, .integrator = m->integrator, .t_end = t_end, .rtol = rtol};
}

#endif
