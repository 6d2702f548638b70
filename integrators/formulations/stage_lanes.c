/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/formulations/stage_lanes.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include <float.h>
#include <math.h>
#include <string.h>

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

/* Room to repack inputs and outputs for registers of four. false: no memory. */
static bool add_halves(kmp_stage_lanes *stages)
{
    int most = 0;
    for (int k = 1; k < stages->program->stages; k++) {
        int count = stages->program->outputs[k + 1] - stages->program->outputs[k];
        most = count > most ? count : most;
    }
    int times = kmp_present_inputs_size(&stages->eval->inputs);
    stages->half = KMP_NEW(double, stages->width *(stages->inputs > times ? stages->inputs : times));
    stages->outputs = KMP_NEW(double, KMP_STAGE_LANES *(most > 0 ? most : 1));
    return stages->half && stages->outputs;
}

bool kmp_stage_lanes_init(kmp_stage_lanes *stages, const kmp_program *program, const kmp_evaluator *eval, int inputs,
                          int width)
{
    int conditions = eval->system->events.count;
    *stages = (kmp_stage_lanes){.program = program, .eval = eval, .width = width, .inputs = inputs};
    if (!program)
        return true;
    stages->lanes = kmp_lanes_new(program, width, false);
    stages->mode = conditions > 0 ? KMP_NEW(double, conditions) : NULL;
    stages->times = KMP_NEW(double, KMP_STAGE_LANES *kmp_present_inputs_size(&eval->inputs));
    if (!stages->lanes || !stages->times || (conditions > 0 && !stages->mode) ||
        (width < KMP_STAGE_LANES && !add_halves(stages))) {
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
    kmp_free(stages->times);
    kmp_free(stages->half);
    kmp_free(stages->outputs);
    *stages = (kmp_stage_lanes){0};
}

static void renew(kmp_stage_lanes *stages)
{
    const kmp_evaluator *eval = stages->eval;
    if (stages->mode &&
        memcmp(stages->mode, eval->mode, (size_t)eval->system->events.count * sizeof *stages->mode) != 0)
        take_mode(stages);
    if (stages->chart_version != eval->chart_version)
        take_charts(stages);
}

/* Gives the inputs of the lanes from `first` on. */
static void set_half(kmp_stage_lanes *stages, kmp_input_kind kind, int count, int first, const double *values)
{
    for (int k = 0; k < count; k++)
        memcpy(stages->half + k * stages->width, values + k * KMP_STAGE_LANES + first,
               (size_t)stages->width * sizeof *values);
    kmp_lanes_set(stages->lanes, kind, stages->half);
}

static const double *run_halves(kmp_stage_lanes *stages, int stage, const double *q, const double *qd)
{
    int count = stages->program->outputs[stage + 1] - stages->program->outputs[stage];
    for (int first = 0; first < KMP_STAGE_LANES; first += stages->width) {
        set_half(stages, KMP_IN_TIME, kmp_present_inputs_size(&stages->eval->inputs), first, stages->times);
        set_half(stages, KMP_IN_Q, stages->inputs, first, q);
        if (qd)
            set_half(stages, KMP_IN_QD, stages->inputs, first, qd);
        const double *out = kmp_lanes_run(stages->lanes, stage);
        for (int k = 0; k < count; k++)
            memcpy(stages->outputs + k * KMP_STAGE_LANES + first, out + k * stages->width,
                   (size_t)stages->width * sizeof *out);
    }
    return stages->outputs;
}

const double *kmp_stage_lanes_run(kmp_stage_lanes *stages, int stage, const double *t, const double *q,
                                  const double *qd)
{
    renew(stages);
    kmp_present_inputs_lanes(&stages->eval->inputs, KMP_STAGE_LANES, t, stages->times);
    if (stages->width < KMP_STAGE_LANES)
        return run_halves(stages, stage, q, qd);
    kmp_lanes_set(stages->lanes, KMP_IN_TIME, stages->times);
    kmp_lanes_set(stages->lanes, KMP_IN_Q, q);
    if (qd)
        kmp_lanes_set(stages->lanes, KMP_IN_QD, qd);
    return kmp_lanes_run(stages->lanes, stage);
}

/* Sums of magnitudes are finite if all values are. */
static KMP_CLONES double magnitude(int count, const double *values)
{
    kmp_eight sum = {0};
    double all = 0;
    for (int k = 0; k < count * KMP_STAGE_LANES; k += KMP_STAGE_LANES)
        sum += (kmp_eight)((kmp_eight_mask)KMP_EIGHT_CONST(values + k) & INT64_MAX);
    for (int l = 0; l < KMP_STAGE_LANES; l++)
        all += sum[l];
    return all;
}

static KMP_CLONES bool exceed(int count, const double *values, double part, const double *of)
{
    kmp_eight_mask bad = {0};
    int64_t any = 0;
    for (int k = 0; k < count * KMP_STAGE_LANES; k += KMP_STAGE_LANES)
        bad |= ~(KMP_EIGHT_CONST(values + k) > part * KMP_EIGHT_CONST(of + k));
    for (int l = 0; l < KMP_STAGE_LANES; l++)
        any |= bad[l];
    return !any;
}

bool kmp_stage_lanes_finite(int count, const double *values)
{
    return magnitude(count, values) <= DBL_MAX;
}

bool kmp_stage_lanes_exceed(int count, const double *values, double part, const double *of)
{
    return exceed(count, values, of ? part : 0, of ? of : values);
}
