/* SPDX-License-Identifier: BSD-3-Clause */
/* The adjoint equations in lanes (adjoint_stages.h): the motion at the times of the stages is closed once, and each
 * sweep is a product with the transposed matrices. */
#include "analyses/sensitivity/adjoint_stages.h"
#include "base/clones.h"
#include "base/simd4.h"
#include <string.h>

enum { W = KMP_STAGE_LANES };

bool kmp_adjoint_stages_begin(kmp_adjoint_stages *stages, kmp_arena *arena, int p, int moving)
{
    kmp_varied_lanes_begin(stages->lanes);
    stages->p = p;
    stages->moving = moving;
    return KMP_ARENA_MAKE(arena, KMP_ROOM(double, 2 * p, &stages->y), KMP_ROOM(double, 2 * p * W, &stages->state),
                          KMP_ROOM(double, p *W, &stages->udd), KMP_ROOM(double, 2 * p * p * W, &stages->of_state),
                          KMP_ROOM(double, moving *W, &stages->slope));
}

/* Takes the motion and its matrices at the times, unless they are there. */
static int place(kmp_adjoint_stages *stages, const double *back)
{
    double t[W];
    const size_t p = (size_t)stages->p;
    for (int l = 0; l < W; l++)
        t[l] = kmp_recorded_motion_time(stages->motion, stages->t_end - back[l]);
    if (stages->known && memcmp(t, stages->t, sizeof t) == 0)
        return KMP_GO;
    stages->known = stages->weighed = false;
    for (size_t l = 0; l < W; l++) {
        kmp_recorded_motion_at(stages->motion, t[l], stages->y);
        for (size_t i = 0; i < 2 * p; i++)
            stages->state[i * W + l] = stages->y[i];
    }
    int said = kmp_varied_lanes_run(stages->lanes, true, t, stages->state, stages->state + p * W, stages->udd);
    if (said == KMP_GO)
        said = kmp_varied_lanes_matrices(stages->lanes, stages->of_state, NULL);
    if (said != KMP_GO)
        return said;
    memcpy(stages->t, t, sizeof t);
    stages->known = true;
    return KMP_GO;
}

/* out (columns) = matrix' x for a matrix of p rows, in lanes. */
static KMP_CLONES void multiply_transposed(int p, int columns, const double *matrix, const double *x, double *out)
{
    for (int c = 0; c < columns; c++) {
        kmp_eight sum = {0};
        for (int k = 0; k < p; k++)
            sum += KMP_EIGHT_CONST(matrix + (ptrdiff_t)(c * p + k) * W) * KMP_EIGHT_CONST(x + (ptrdiff_t)k * W);
        KMP_EIGHT_AT(out + (ptrdiff_t)c * W) = sum;
    }
}

int kmp_adjoint_stages_rates(kmp_adjoint_stages *stages, const double *back, const double *y, double *dy)
{
    const int p = stages->p, rates = p * W, said = place(stages, back);
    if (said != KMP_GO)
        return said;
    multiply_transposed(p, 2 * p, stages->of_state, y + rates, dy);
    for (int k = 0; k < rates; k++)
        dy[rates + k] += y[k];
    return KMP_GO;
}

/* Keeps the slopes of the quadratures in the last lane: their first numbers may be in the same place. */
static void keep_slopes(kmp_adjoint_stages *stages, const double *in_lanes)
{
    int last = W - 1; /* the first lane there is a stage */
    while (last > 0 && !(stages->t[last - 1] > stages->t[W - 1]))
        last--;
    for (int c = 0; c < stages->moving; c++)
        stages->slope[c] = in_lanes[c * W + last];
}

int kmp_adjoint_stages_integrands(kmp_adjoint_stages *stages, const double *back, const double *y, double *dy)
{
    const int rates = stages->p * W, said = place(stages, back);
    if (said != KMP_GO)
        return said;
    kmp_varied_lanes_weigh(stages->lanes, y + rates, dy + 2 * rates);
    keep_slopes(stages, dy + 2 * rates);
    stages->weighed = true;
    return KMP_GO;
}

bool kmp_adjoint_stages_end_at(const kmp_adjoint_stages *stages, double back)
{
    const double t = stages->t_end - back;
    return stages->known && t <= stages->t[W - 1] && t >= stages->t[W - 1];
}

void kmp_adjoint_stages_last(kmp_adjoint_stages *stages, const double *y, double *dy)
{
    const int p = stages->p;
    if (!stages->weighed) {
        for (int k = 0; k < p * W; k++)
            stages->udd[k] = y[p + k / W];
        kmp_varied_lanes_weigh(stages->lanes, stages->udd, stages->slope);
        keep_slopes(stages, stages->slope);
    }
    for (int c = 0; c < 2 * p; c++) {
        const double *of = stages->of_state + (ptrdiff_t)(c * p) * W;
        dy[c] = c < p ? 0 : y[c - p];
        for (int k = 0; k < p; k++)
            dy[c] += of[k * W + W - 1] * y[p + k];
    }
    memcpy(dy + 2 * p, stages->slope, (size_t)stages->moving * sizeof *dy);
}

bool kmp_adjoint_stages_matrix(const kmp_adjoint_stages *stages, double back, double *matrix)
{
    const double t = stages->t_end - back;
    for (int l = 0; stages->known && l < W; l++) {
        if (t < stages->t[l] || t > stages->t[l])
            continue;
        for (int k = 0; k < 2 * stages->p * stages->p; k++)
            matrix[k] = stages->of_state[k * W + l];
        return true;
    }
    return false;
}
