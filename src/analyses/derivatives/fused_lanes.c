/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/derivatives/fused_lanes.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/steppers/ode.h"
#include <math.h>
#include <string.h>

enum { W = KMP_STAGE_LANES };

#define AT(p, k) KMP_EIGHT_AT((p) + (ptrdiff_t)(k)*W)
#define OF(p, k) KMP_EIGHT_CONST((p) + (ptrdiff_t)(k)*W)

static size_t chart_bytes(const kempe_system *s)
{
    return (size_t)(KMP_CHART_SIZE * s->chart_count) * sizeof(double);
}

static kempe_status write_program(kmp_fused_lanes *x)
{
    const kmp_reduction *red = x->red;
    const kempe_system *s = red->eval->system;
    int *order = KMP_ARENA_NEW(&x->arena, int, red->r);
    KMP_TRY(kmp_made(s->context, order));
    kmp_writer_order(red, order);
    kmp_reduced_program_written written =
        kmp_reduced_program_write(red, &(kmp_reduced_program_plan){.order = order, .curvature = true});
    const kmp_reduced_program_layout *l = &written.layout;
    KMP_TRY(kmp_made(s->context, written.program));
    x->program = written.program;
    x->cycles =
        kmp_cycles_of_lanes(kmp_program_count(x->program, KMP_REDUCED_PROGRAM_RATES, KMP_REDUCED_PROGRAM_END), false);
    x->multipliers = l->multipliers;
    x->tangent = l->multipliers + l->pivots + kmp_writer_closure_count(s);
    bool made = kmp_stage_lanes_init(&x->stages, x->program, red->eval) &&
                KMP_ARENA_MAKE(&x->arena, KMP_ROOM(double, x->multipliers, &x->bound),
                               KMP_ROOM(double, W *(2 * red->p + red->r), &x->state),
                               KMP_ROOM(double, KMP_CHART_SIZE * s->chart_count, &x->chart));
    for (int k = 0; made && k < x->multipliers; k++)
        x->bound[k] = KMP_ELIMINATION * s->row_scale[written.row[k].row] / s->row_scale[written.row[k].by];
    if (made)
        memcpy(x->chart, red->eval->chart, chart_bytes(s));
    kmp_free(written.row);
    return kmp_made(s->context, made);
}

kempe_status kmp_fused_lanes_init(kmp_fused_lanes *fused, const kmp_reduction *red)
{
    *fused = (kmp_fused_lanes){.red = red};
    bool fits = red->p > 0 && red->p <= KMP_REDUCED_PROGRAM_FREEDOMS &&
                kmp_eval_program(red->eval, false)->block_count == 0 && kmp_writer_blocks_fit(red);
    kempe_status status = fits ? write_program(fused) : KEMPE_OK;
    if (status != KEMPE_OK)
        kmp_fused_lanes_free(fused);
    return status;
}

KMP_CLEARS(kmp_fused_lanes, fused, kmp_stage_lanes_free(&fused->stages), kmp_program_free(fused->program),
           kmp_arena_free(&fused->arena))

bool kmp_fused_lanes_applies(const kmp_fused_lanes *fused)
{
    return fused->program && memcmp(fused->chart, fused->red->eval->chart, chart_bytes(fused->red->eval->system)) == 0;
}

/* -- closing ------------------------------------------------------------------------------------------- */

/* The largest of count changes in all lanes, over the scales of these coordinates. */
static KMP_CLONES double size_of(int count, const double *change, const int *coordinate, const double *scale)
{
    double most = 0;
    for (int k = 0; k < count; k++) {
        double size = 0, by = 1 / scale[coordinate[k]];
        for (int l = 0; l < W; l++) {
            double of = fabs(change[k * W + l]);
            size = of > size ? of : size;
        }
        most = by * size > most ? by * size : most;
    }
    return most;
}

kmp_closing_move kmp_fused_lanes_correct(int count, const double *change, const int *coordinate, const double *scale,
                                         double enough, double *last, double *q)
{
    if (!kmp_stage_lanes_finite(count, change))
        return KMP_CLOSING_STOPS;
    const double size = size_of(count, change, coordinate, scale);
    const bool done = size <= enough, stalled = !done && !kmp_closing_contracts(size, *last);
    if (stalled && size > KMP_CLOSED_ENOUGH)
        return KMP_CLOSING_STOPS;
    for (int i = 0; i < count; i++)
        AT(q, coordinate[i]) += OF(change, i);
    *last = size;
    return done || stalled ? KMP_CLOSING_ENDS : KMP_CLOSING_GOES;
}

double kmp_fused_lanes_move(const kmp_fused_lanes *fused, const double *u, double *q)
{
    const kmp_partition *part = fused->red->part;
    double most = 0;
    for (int c = 0; c < part->p; c++) {
        double change[W];
        const kmp_eight du = OF(u, c) - OF(q, part->u[c]);
        const double *tangent = fused->end + (ptrdiff_t)(c * part->r) * W;
        KMP_EIGHT_AT(change) = du;
        for (int i = 0; i < part->r; i++)
            AT(q, part->v[i]) += OF(tangent, i) * du;
        most = fmax(most, size_of(1, change, &part->u[c], fused->red->eval->system->scale));
    }
    return most;
}

void kmp_fused_lanes_place(const kmp_fused_lanes *fused, int lane, double *drift, double *curve, double *tangent)
{
    const kmp_partition *part = fused->red->part;
    const int n = fused->red->n, p = part->p, r = part->r;
    memset(drift, 0, (size_t)n * sizeof *drift);
    memset(curve, 0, (size_t)n * sizeof *curve);
    memset(tangent, 0, (size_t)(n * p) * sizeof *tangent);
    for (int i = 0; i < r; i++) {
        drift[part->v[i]] = fused->rates[i * W + lane];
        curve[part->v[i]] = fused->end[(r * (p + 1) + i) * W + lane];
    }
    for (int c = 0; c < p; c++) {
        tangent[part->u[c] + c * n] = 1;
        for (int i = 0; i < r; i++) {
            const double by = fused->end[(c * r + i) * W + lane];
            tangent[part->v[i] + c * n] = by;
            drift[part->v[i]] -= by * fused->state[(p + c) * W + lane];
        }
    }
}

/* True if no multiplier of the elimination exceeds its bound. */
static KMP_CLONES bool order_is_good(int count, const double *multiplier, const double *bound)
{
    bool good = true;
    for (int k = 0; k < count; k++)
        for (int l = 0; l < W; l++)
            good = good && fabs(multiplier[k * W + l]) <= bound[k];
    return good;
}

/* Accelerations at v in q, and what kmp_fused_lanes.end has. KMP_GO, KMP_RETRY or KMP_APART. */
static int pass(kmp_fused_lanes *x, const double *t, const double *q, double *udd)
{
    const kmp_partition *part = x->red->part;
    kmp_lanes *lanes = x->stages.lanes;
    const int p = part->p, r = part->r;
    for (int i = 0; i < r; i++)
        AT(x->state, 2 * p + i) = OF(q, part->v[i]);
    const double *out = kmp_stage_lanes_run(&x->stages, KMP_REDUCED_PROGRAM_RATES, t, x->state, NULL);
    memcpy(udd, out, (size_t)(p * W) * sizeof *udd);
    x->rates = out + (ptrdiff_t)p * W;
    if (!kmp_stage_lanes_exceed(p, out + (ptrdiff_t)(p + r) * W, 0, NULL) || !kmp_stage_lanes_finite(p, udd))
        return KMP_RETRY;
    kmp_lanes_run_in_place(lanes, KMP_REDUCED_PROGRAM_END);
    kmp_lanes_gather(lanes, KMP_REDUCED_PROGRAM_END, 0, x->multipliers);
    kmp_lanes_gather(lanes, KMP_REDUCED_PROGRAM_END, x->tangent, x->tangent + r * (p + 2));
    const double *end = kmp_lanes_values(lanes, KMP_REDUCED_PROGRAM_END);
    x->end = end + (ptrdiff_t)x->tangent * W;
    return order_is_good(x->multipliers, end, x->bound) ? KMP_GO : KMP_APART;
}

int kmp_fused_lanes_run(kmp_fused_lanes *fused, double enough, const double *t, const double *u, const double *ud,
                        double *q, double *udd)
{
    const kmp_partition *part = fused->red->part;
    size_t half = (size_t)part->p * W;
    double last = INFINITY;
    memcpy(fused->state, u, half * sizeof *u);
    memcpy(fused->state + half, ud, half * sizeof *ud);
    for (int k = 0; k < part->p; k++)
        AT(q, part->u[k]) = OF(u, k);
    for (int k = 0; k < KMP_CLOSING_PASSES; k++) {
        int said = pass(fused, t, q, udd);
        if (said != KMP_GO || part->r == 0)
            return said;
        const double *dv = fused->end + (ptrdiff_t)(part->r * part->p) * W;
        const kmp_closing_move move =
            kmp_fused_lanes_correct(part->r, dv, part->v, fused->red->eval->system->scale, enough, &last, q);
        if (move != KMP_CLOSING_GOES)
            return move == KMP_CLOSING_ENDS ? KMP_GO : KMP_RETRY;
    }
    return KMP_RETRY;
}
