/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of the end of a run of a model given as text. */
#pragma once

#include "analyses/sensitivity/sensitivity_study.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/sensitivity.h>
#include <stdio.h>

/** Derivatives at the start and at the time `end` by all parameters, at rtol 1e-12; NULL after a message where there
 * are none. `method`: forward or adjoint; `integral`: of the integrals of the outputs. */
static inline kempe_sensitivity *sensitivity_of(const char *method, kempe_context *c, const char *text,
                                                const char *outputs, const char *integrator, double end, int integral)
{
    kempe_model *model = NULL;
    kempe_sensitivity *s = NULL;
    kempe_run_options run = {0};
    const kempe_sensitivity_options options = {.outputs = outputs, .method = method, .integral = integral, .run = &run};
    run.rtol = 1e-12;
    run.t_end = end;
    run.output_step = end;
    run.integrator = integrator;
    CHECK(kempe_model_read_text(c, text, "model.yaml", &model) == KEMPE_OK);
    CHECK(model && kempe_sensitivity_new(model, &options, &s) == KEMPE_OK);
    if (!s)
        printf("%s\n", kempe_context_message(c));
    kempe_model_free(model);
    return s;
}
