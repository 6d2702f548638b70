/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/formulations/stage_lanes.h"
#include "base/clones.h"
#include "base/memory.h"
#include <float.h>
#include <math.h>
#include <string.h>

int kmp_stage_lanes_width(void)
{
    return kmp_lanes_best();
}

static void set(kmp_stage_lanes *stages, kmp_input_kind kind, const double *values)
{
    for (int lane = 0; lane < stages->width; lane++)
        kmp_lanes_set_one(stages->lanes, kind, lane, values);
}

static void take_mode(kmp_stage_lanes *stages)
{
    memcpy(stages->mode, stages->eval->mode, (size_t)stages->eval->system->events.count * sizeof *stages->mode);
    set(stages, KMP_IN_MODE, stages->mode);
}

static void take_charts(kmp_stage_lanes *stages)
{
    stages->chart_version = stages->eval->chart_version;
    set(stages, KMP_IN_CHART, stages->eval->chart);
    (void)kmp_lanes_run(stages->lanes, KMP_STAGE_PARAMETERS);
}

bool kmp_stage_lanes_init(kmp_stage_lanes *stages, const kmp_program *program, const kmp_evaluator *eval)
{
    int conditions = eval->system->events.count;
    *stages = (kmp_stage_lanes){.eval = eval, .width = kmp_stage_lanes_width()};
    if (!program)
        return true;
    stages->lanes = kmp_lanes_new(program, stages->width, false);
    stages->mode = conditions > 0 ? KMP_NEW(double, conditions) : NULL;
    if (!stages->lanes || (conditions > 0 && !stages->mode)) {
        kmp_stage_lanes_free(stages);
        return false;
    }
    set(stages, KMP_IN_PARAMETER, eval->system->parameters);
    if (stages->mode)
        take_mode(stages);
    take_charts(stages);
    return true;
}

void kmp_stage_lanes_free(kmp_stage_lanes *stages)
{
    kmp_lanes_free(stages->lanes);
    kmp_free(stages->mode);
    stages->lanes = NULL;
    stages->mode = NULL;
}

void kmp_stage_lanes_renew(kmp_stage_lanes *stages)
{
    const kmp_evaluator *eval = stages->eval;
    if (stages->mode &&
        memcmp(stages->mode, eval->mode, (size_t)eval->system->events.count * sizeof *stages->mode) != 0)
        take_mode(stages);
    if (stages->chart_version != eval->chart_version)
        take_charts(stages);
}

/* Sums of magnitudes are finite if all values are. */
static KMP_CLONES double magnitude(size_t count, const double *values)
{
    double sum[KMP_LANES_MOST] = {0}, all = 0;
    for (size_t k = 0; k + KMP_LANES_MOST <= count; k += KMP_LANES_MOST)
        for (size_t l = 0; l < KMP_LANES_MOST; l++)
            sum[l] += fabs(values[k + l]);
    for (size_t k = count - count % KMP_LANES_MOST; k < count; k++)
        all += fabs(values[k]);
    for (size_t l = 0; l < KMP_LANES_MOST; l++)
        all += sum[l];
    return all;
}

static KMP_CLONES int failures(size_t count, const double *values, double part, const double *of)
{
    int bad = 0;
    for (size_t k = 0; k < count; k++)
        bad |= !(values[k] > part * of[k]);
    return bad;
}

bool kmp_stage_lanes_finite(const kmp_stage_lanes *stages, int count, const double *values)
{
    return magnitude((size_t)count * (size_t)stages->width, values) <= DBL_MAX;
}

bool kmp_stage_lanes_exceed(const kmp_stage_lanes *stages, int count, const double *values, double part,
                            const double *of)
{
    return !failures((size_t)count * (size_t)stages->width, values, of ? part : 0, of ? of : values);
}
