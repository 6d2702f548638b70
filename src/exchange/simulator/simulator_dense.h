/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense output of a step. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_samples.h"

static void list_stages(const kempe_simulator *s, double **k)
{
    for (int i = 0; i < KMP_RK_MAX_STAGES; i++)
        k[i + 1] = s->part.stages + (ptrdiff_t)i * size_of_y(s);
    k[0] = NULL;
}

static void list_vectors(const kempe_simulator *s, double **r)
{
    for (int i = 0; i < KMP_RK_MAX_INTERPOLANTS; i++)
        r[i] = s->part.vectors + (ptrdiff_t)i * size_of_y(s);
}

/* k[number] = f(t + c h, y + h sum a k), within a function that has s, size, y, h, t, k and C. */
#define STAGE(number, a, ...)                                                                                          \
    do {                                                                                                               \
        kmp_rk_combine(size, y, h, KMP_TERMS(a), a, (const double *const[]){__VA_ARGS__}, s->part.stage);              \
        outcome at_stage = slopes_alone(s, t + C[number] * h, s->part.stage, k[number]);                               \
        if (at_stage != GOOD)                                                                                          \
            return at_stage;                                                                                           \
    } while (0)

/* The vectors of the dense output of the last step. */
static outcome prepare_dense(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int size = size_of_y(s);
    double *state = part->state, *k[KMP_RK_MAX_STAGES + 1], *r[KMP_RK_MAX_INTERPOLANTS];
    double t = state[AT_BEGIN], h = state[AT_TAKEN];
    const double *y = part->y_old, *const C = kmp_dop853_c;
    bool long_one = state[AT_METHOD_TAKEN] == (double)KEMPE_METHOD_DOP853;
    if (state[AT_DENSE] > 0)
        return GOOD;
    list_stages(s, k);
    list_vectors(s, r);
    if (long_one)
        KMP_DOP853_DENSE_STAGES(STAGE, k);
    const kmp_rk_numbers *method = &methods[(int)state[AT_METHOD_TAKEN]];
    const double *last = r[method->interpolants - 1];
    kmp_rk_cubics(size, 1, h, y, part->y_new, k[1], k[method->end], r);
    if (long_one)
        kmp_dop853_dense_all(size, 0, 1, h, k, r);
    for (int i = 0; i < size && !long_one; i++)
        r[4][i] = kmp_dopri5_dense(h, k, i);
    state[AT_DENSE] = 1;
    state[AT_COARSE] =
        !(s->settings.fixed_step > 0) && kmp_rk_is_coarse(size, method->interpolants, last, 1, part->weight, 1);
    return GOOD;
}

static bool step_within(kempe_simulator *s, double t, double *y);

/* y at t within the last step. */
static outcome interpolate(kempe_simulator *s, double t, double *y)
{
    struct kempe_simulator_parts *part = &s->part;
    const double *state = part->state;
    int size = size_of_y(s);
    double *r[KMP_RK_MAX_INTERPOLANTS];
    bool ends = !(t < state[AT_END]) || !(state[AT_TAKEN] > 0);
    if (ends || !(t > state[AT_BEGIN])) {
        copy(size, ends ? part->y_new : part->y_old, y);
        return GOOD;
    }
    outcome said = prepare_dense(s);
    list_vectors(s, r);
    if (said == GOOD && state[AT_COARSE] > 0 && step_within(s, t, y))
        return GOOD;
    if (said == GOOD)
        kmp_rk_interpolate(size, methods[(int)state[AT_METHOD_TAKEN]].interpolants, r,
                           (t - state[AT_BEGIN]) / state[AT_TAKEN], y);
    return said;
}
