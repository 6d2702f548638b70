/* SPDX-License-Identifier: BSD-3-Clause */
/* An evaluator's constants in the lanes of a program: modes and charts are compared before each run, and set in all
 * lanes where they differ. The tests of pivots and values run over all lanes at once, as compilers vectorise them. */
#include "constraints/evaluation/stage_lanes.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "linalg/wide_rows.h"
#include <float.h>
#include <math.h>
#include <string.h>

static void set_all_lanes(kmp_stage_lanes *stages, kmp_input_kind kind, const double *values)
{
    for (int lane = 0; lane < KMP_STAGE_LANES; lane++)
        kmp_lanes_set_one(stages->lanes, kind, lane, values);
}

static void set_modes(kmp_stage_lanes *stages)
{
    memcpy(stages->mode, stages->eval->conditions.mode,
           (size_t)stages->eval->system->events.count * sizeof *stages->mode);
    set_all_lanes(stages, KMP_IN_MODE, stages->mode);
}

static void set_charts(kmp_stage_lanes *stages)
{
    stages->chart_version = stages->eval->chart_version;
    set_all_lanes(stages, KMP_IN_CHART, stages->eval->chart);
    (void)kmp_lanes_run(stages->lanes, KMP_STAGE_PARAMETERS);
}

bool kmp_stage_lanes_init(kmp_stage_lanes *stages, const kmp_program *program, const kmp_evaluator *eval)
{
    return kmp_stage_lanes_init_varied(stages, program, eval, NULL);
}

bool kmp_stage_lanes_init_varied(kmp_stage_lanes *stages, const kmp_program *program, const kmp_evaluator *eval,
                                 const double *parameters)
{
    int conditions = eval->system->events.count;
    *stages = (kmp_stage_lanes){.eval = eval, .parameters = parameters};
    if (!program)
        return true;
    stages->lanes = kmp_lanes_new(program, KMP_STAGE_LANES, false);
    stages->mode = conditions > 0 ? KMP_NEW(double, conditions) : NULL;
    stages->times = KMP_NEW(double, KMP_STAGE_LANES *kmp_present_inputs_size(&eval->inputs));
    if (!stages->lanes || !stages->times || (conditions > 0 && !stages->mode)) {
        kmp_stage_lanes_free(stages);
        return false;
    }
    kmp_stage_lanes_take(stages, eval);
    return true;
}

void kmp_stage_lanes_take(kmp_stage_lanes *stages, const kmp_evaluator *eval)
{
    stages->eval = eval;
    if (!stages->lanes)
        return;
    set_all_lanes(stages, KMP_IN_PARAMETER, stages->parameters ? stages->parameters : eval->system->parameters);
    if (stages->mode)
        set_modes(stages);
    set_charts(stages);
}

KMP_CLEARS(kmp_stage_lanes, stages, kmp_lanes_free(stages->lanes), kmp_free(stages->mode), kmp_free(stages->times))

void kmp_stage_lanes_place(kmp_stage_lanes *stages, const double *t, const double *q, const double *qd)
{
    /* Parameters and charts that the evaluator has now. */
    const kmp_evaluator *eval = stages->eval;
    if (stages->mode &&
        memcmp(stages->mode, eval->conditions.mode, (size_t)eval->system->events.count * sizeof *stages->mode) != 0)
        set_modes(stages);
    if (stages->chart_version != eval->chart_version)
        set_charts(stages);
    kmp_present_inputs_lanes(&stages->eval->inputs, KMP_STAGE_LANES, t, stages->times);
    kmp_lanes_set(stages->lanes, KMP_IN_TIME, stages->times);
    kmp_lanes_set(stages->lanes, KMP_IN_Q, q);
    if (qd)
        kmp_lanes_set(stages->lanes, KMP_IN_QD, qd);
}

const double *kmp_stage_lanes_run(kmp_stage_lanes *stages, int stage, const double *t, const double *q,
                                  const double *qd)
{
    kmp_stage_lanes_place(stages, t, q, qd);
    return kmp_lanes_run(stages->lanes, stage);
}

/* By tiles of four values of four lanes. */
static KMP_CLONES void copy_rows(int count, const double *values, double *rows)
{
    enum { W = KMP_STAGE_LANES };
    int k = 0;
    for (; k + KMP_FOUR <= count; k += KMP_FOUR)
        for (int l = 0; l < W; l += KMP_FOUR) {
            const double *from = values + (ptrdiff_t)k * W + l;
            kmp_wide_transpose((const double *[]){from, from + W, from + 2 * W, from + 3 * W}, count,
                               rows + (ptrdiff_t)l * count + k);
        }
    for (; k < count; k++)
        for (int l = 0; l < W; l++)
            rows[(ptrdiff_t)l * count + k] = values[(ptrdiff_t)k * W + l];
}

void kmp_stage_lanes_rows(int count, const double *values, double *rows)
{
    copy_rows(count, values, rows);
}

/* Sums of magnitudes are finite if all values are. For registers of one type: compilers take comparisons of eight apart
 * where there are none of eight. */
#define CHECKS(lanes, type, mask)                                                                                      \
    static KMP_CLONES double magnitude_in_##lanes(int count, const double *values)                                     \
    {                                                                                                                  \
        enum { W = sizeof(type) / sizeof(double) };                                                                    \
        type sum = {0};                                                                                                \
        double all = 0;                                                                                                \
        for (int k = 0; k < count; k += W)                                                                             \
            sum += (type)(*(const mask *)(values + k) & INT64_MAX);                                                    \
        for (int l = 0; l < W; l++)                                                                                    \
            all += sum[l];                                                                                             \
        return all;                                                                                                    \
    }                                                                                                                  \
    static KMP_CLONES bool exceed_in_##lanes(int count, const double *values, double part, const double *of)           \
    {                                                                                                                  \
        enum { W = sizeof(type) / sizeof(double) };                                                                    \
        mask bad = {0};                                                                                                \
        int64_t any = 0;                                                                                               \
        for (int k = 0; k < count; k += W)                                                                             \
            bad |= ~(*(const type *)(values + k) > part * *(const type *)(of + k));                                    \
        for (int l = 0; l < W; l++)                                                                                    \
            any |= bad[l];                                                                                             \
        return !any;                                                                                                   \
    }

CHECKS(fours, kmp_four, kmp_four_mask)
CHECKS(eights, kmp_eight, kmp_eight_mask)

bool kmp_stage_lanes_finite(int count, const double *values)
{
    int all = count * KMP_STAGE_LANES;
    return (kmp_has_eight() ? magnitude_in_eights : magnitude_in_fours)(all, values) <= DBL_MAX;
}

bool kmp_stage_lanes_exceed(int count, const double *values, double part, const double *of)
{
    int all = count * KMP_STAGE_LANES;
    return (kmp_has_eight() ? exceed_in_eights : exceed_in_fours)(all, values, of ? part : 0, of ? of : values);
}
