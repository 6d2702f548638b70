/* SPDX-License-Identifier: BSD-3-Clause */
/* The end of motions in closed form by one parameter: instances in lanes, and derivatives by both methods. */
#pragma once

#include "instances.h"
#include "sensitivity_of.h"
#include <math.h>

/** The coordinate and its rate at the end, by the parameter. */
typedef void closed_form(double parameter, double end[2]);

enum { CLOSED_FORMS = 5 };

/* Instances from 0.8 to 1.2 of the parameter's value, in lanes of four; k: the coordinate. */
static inline void instances_are(const char *text, const char *name, double value, int k, closed_form *of,
                                 double within)
{
    loaded l = load_text(text);
    double rows[CLOSED_FORMS], end[2];
    for (int i = 0; i < CLOSED_FORMS; i++)
        rows[i] = value * (0.8 + 0.1 * i);
    instances all = run_instances(&l, 4, 1, &name, CLOSED_FORMS, rows);
    for (int i = 0; i < CLOSED_FORMS; i++) {
        of(rows[i], end);
        CHECK_NEAR(end_position(&all, i, k), end[0], within);
        CHECK_NEAR(end_rate(&all, i, k), end[1], within);
    }
    free_instances(&all);
    unload(&l);
}

/* The model's only parameter is this one; outputs: the coordinate and its rate. */
static inline void slopes_are(const char *text, const char *method, const char *outputs, double value, double t_end,
                              closed_form *of, double within)
{
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of(method, c, text, outputs, NULL, t_end, 0);
    const double h = 1e-3 * value;
    double at[4][2];
    for (int i = 0; i < 4; i++)
        of(value + h * (double)(i < 2 ? i - 2 : i - 1), at[i]);
    for (int j = 0; s && j < 2; j++) {
        const double slope = (8 * (at[2][j] - at[1][j]) - (at[3][j] - at[0][j])) / (12 * h);
        CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, j, 0) / slope, 1, within);
    }
    kempe_sensitivity_free(s);
    kempe_context_free(c);
}
