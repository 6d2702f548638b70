/* SPDX-License-Identifier: BSD-3-Clause */
/* A piece of the path is halved until the bounds of each rate are within its limit, or outside. */
#include "analyses/kinematics/path_bounds.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/events/event_pieces.h"
#include <math.h>
#include <string.h>

/* Pieces of a step that bounds look at. */
enum { MOST_PIECES = 512 };

double kmp_stretch_x(const kmp_stretch *e, int i, double part, int order)
{
    double a = e->a->x[i], b = e->b->x[i], l = e->length, d0 = e->a->dx[i] * l, d1 = e->b->dx[i] / e->slant * l,
           c2 = 3 * (b - a) - 2 * d0 - d1, c3 = 2 * (a - b) + d0 + d1;
    if (order == 0)
        return a + part * (d0 + part * (c2 + part * c3));
    return order == 1 ? (d0 + part * (2 * c2 + 3 * part * c3)) / l : (2 * c2 + 6 * part * c3) / (l * l);
}

kmp_path_bounds *kmp_path_bounds_new(kmp_sweep *w)
{
    const kempe_system *s = w->system;
    kmp_arena *arena = &w->arena;
    kmp_path_bounds *p = KMP_ARENA_NEW(arena, kmp_path_bounds, 1);
    if (!p || !(p->bounds = kmp_bounds_new(s->closing, arena)) ||
        !KMP_ARENA_MAKE(arena, KMP_ROOM(int, s->m, &p->output), KMP_ROOM(bool, s->m, &p->wanted),
                        KMP_ROOM(double, s->m, &p->limit, &p->from, &p->to), KMP_ROOM(double, s->n + 1, &p->x)))
        return NULL;
    p->charts = -1;
    for (int r = 0; r < s->m; r++)
        p->output[r] = s->closing->outputs[KMP_STAGE_CLOSURE] + r;
    return p;
}

/* -- bounds ------------------------------------------------------------------------------------------ */

static const kmp_bound anything = {-INFINITY, INFINITY, -INFINITY, INFINITY};

/* x_i between two parts of the path. */
static kmp_bound x_over(const kmp_stretch *e, int i, double from, double to)
{
    return kmp_bound_over((to - from) * e->length, kmp_stretch_x(e, i, from, 0), kmp_stretch_x(e, i, from, 1),
                          kmp_stretch_x(e, i, to, 0), kmp_stretch_x(e, i, to, 1));
}

/* The time, which is linear in s. Samples of inputs have no bounds over a time. */
static kmp_bound time_over(const kmp_sweep *w, const kmp_stretch *e, uint32_t index, double from, double to)
{
    if (w->time < 0)
        return kmp_bound_still(kmp_present_inputs_at(&w->eval->inputs, 0)[index]);
    if (index != 0)
        return anything;
    const kmp_sweep_parameter *time = &w->parameter[w->time];
    const double by = time->to - time->from;
    const kmp_bound s = x_over(e, w->n, from, to);
    const double a = time->from + by * s.low, b = time->from + by * s.high, c = by * s.down, d = by * s.up;
    return (kmp_bound){fmin(a, b), fmax(a, b), fmin(c, d), fmax(c, d)};
}

static bool is_still(kmp_input_kind kind)
{
    return kind != KMP_IN_Q && kind != KMP_IN_TIME;
}

static kmp_bound still_input(const kmp_sweep *w, const kmp_program_input *in)
{
    switch (in->kind) {
    case KMP_IN_MODE:
        return kmp_bound_still(w->eval->conditions.mode[in->index]);
    case KMP_IN_CHART:
        return kmp_bound_still(w->eval->chart[in->index]);
    case KMP_IN_PARAMETER:
        return kmp_bound_still(w->system->parameters[in->index]);
    default: /* an input that moves, or one that the program of closures does not have */
        return anything;
    }
}

/* The rows that count, and the operations that they need under the present conditions. */
static void begin(kmp_sweep *w)
{
    kmp_path_bounds *p = w->path;
    const kmp_pattern *j = &w->system->jacobian;
    const kmp_program *program = w->system->closing;
    memset(p->wanted, 0, (size_t)w->system->m * sizeof *p->wanted);
    memset(p->limit, 0, (size_t)w->system->m * sizeof *p->limit);
    for (int k = 0; k < w->part.r; k++)
        p->wanted[w->part.rows[k]] = true;
    for (int k = 0; k < w->moving_count; k++)
        p->wanted[w->moving[k]] = true;
    for (int e = 0; e < j->count; e++)
        p->limit[j->row[e]] =
            fmax(p->limit[j->row[e]], KMP_SWEEP_TURN * fabs(w->eval->jacobian[e]) * w->unit[j->col[e]]);
    for (int k = 0; k < program->input_count; k++)
        kmp_bounds_set(p->bounds, k, still_input(w, &program->input[k]));
    if (p->charts != w->eval->chart_version)
        kmp_bounds_run(p->bounds, true);
    p->charts = w->eval->chart_version;
    kmp_bounds_want(p->bounds, w->system->m, p->output, p->wanted);
}

static void bind(kmp_sweep *w, const kmp_stretch *e, double from, double to)
{
    const kmp_program *program = w->system->closing;
    for (int k = 0; k < program->input_count; k++)
        if (!is_still(program->input[k].kind))
            kmp_bounds_set(w->path->bounds, k,
                           program->input[k].kind == KMP_IN_TIME ? time_over(w, e, program->input[k].index, from, to)
                                                                 : x_over(e, (int)program->input[k].index, from, to));
    kmp_bounds_run_wanted(w->path->bounds);
}

/* -- pieces ------------------------------------------------------------------------------------------ */

static void look(kmp_sweep *w, const kmp_stretch *e, double part, double *h)
{
    double *x = w->path->x;
    for (int i = 0; i <= w->n; i++)
        x[i] = kmp_stretch_x(e, i, part, 0);
    kmp_eval_closure(w->eval, w->time < 0 ? 0 : kmp_sweep_parameter_value(&w->parameter[w->time], x[w->n]), x);
    memcpy(h, w->eval->h, (size_t)w->system->m * sizeof *h);
}

/* The mean rates of a piece. */
static bool ends_agree(kmp_sweep *w, const kmp_stretch *e, double from, double to)
{
    kmp_path_bounds *p = w->path;
    look(w, e, from, p->from);
    look(w, e, to, p->to);
    for (int r = 0; r < w->system->m; r++)
        if (p->wanted[r] && !(fabs(p->to[r] - p->from[r]) <= p->limit[r] * (to - from) * e->length))
            return false;
    return true;
}

typedef enum followed { FOLLOWED, OPEN, UNKNOWN, LEFT } followed;

/* The bounds of a piece decide for all rows together. */
static followed judge(const kmp_sweep *w)
{
    const kmp_path_bounds *p = w->path;
    followed all = FOLLOWED;
    for (int r = 0; r < w->system->m; r++) {
        if (!p->wanted[r])
            continue;
        const kmp_bound rate = kmp_bounds_get(p->bounds, p->output[r]);
        if (rate.down > p->limit[r] || rate.up < -p->limit[r])
            return LEFT;
        if (!(rate.down > -INFINITY && rate.up < INFINITY))
            all = UNKNOWN;
        else if (all == FOLLOWED && !(rate.down >= -p->limit[r] && rate.up <= p->limit[r]))
            all = OPEN;
    }
    return all;
}

bool kmp_path_is_followed(kmp_sweep *w, const kmp_stretch *e, double finest)
{
    enum { DEEPEST = 40 };
    const double least = finest / fabs(e->length);
    int left = MOST_PIECES, depth = 0;
    double from = 0;
    begin(w);
    while (from < 1) { /* the piece of this depth that begins here */
        const double to = from + ldexp(1, -depth);
        followed piece = UNKNOWN;
        if (left > 0) {
            left--;
            bind(w, e, from, to);
            piece = judge(w);
        }
        if (piece == LEFT)
            return false;
        if (piece != FOLLOWED && depth < DEEPEST && (piece == OPEN || to - from > least)) {
            depth++;
            continue;
        }
        if (piece != FOLLOWED && !ends_agree(w, e, from, to))
            return false;
        from = to;
        while (depth > 0 && fmod(from, ldexp(1, 1 - depth)) == 0)
            depth--;
    }
    return true;
}
