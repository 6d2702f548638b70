/* SPDX-License-Identifier: BSD-3-Clause */
/* A recorded motion (recorded_motion.h). Steps have values of u and ud at Chebyshev's points, in the arena one after
 * the other; maps are copied. */
#include "analyses/sensitivity/recorded_motion.h"
#include "base/arena.h"
#include "constraints/evaluation/charts.h"
#include <math.h>
#include <string.h>

/* The polynomial of the values at these points is the polynomial of the integrators' dense outputs, none of which has
 * a higher degree. */
enum { NODES = 8 };

bool kmp_recorded_motion_init(kmp_recorded_motion *motion, kmp_sensitivity_equations *varied,
                              const kmp_forward_target *target)
{
    *motion = (kmp_recorded_motion){.v = varied, .target = target};
    if (!KMP_ARENA_MAKE(&motion->arena,
                        KMP_ROOM(double, varied->n, &motion->q, &motion->own_q, &motion->own_qd, &motion->own_qdd),
                        KMP_ROOM(double, KMP_CHART_SIZE * varied->system->chart_count, &motion->own_chart)))
        return false;
    kmp_charts_reset(varied->system, motion->own_chart);
    return true;
}

void kmp_recorded_motion_free(kmp_recorded_motion *motion)
{
    for (kmp_recorded_map *map = motion->map; map; map = map->before)
        kmp_partition_free(&map->part);
    kmp_arena_free(&motion->arena);
}

/* -- recording ----------------------------------------------------------------------------------------- */

static double node(int j)
{
    static const double pi = 3.14159265358979323846;
    return 0.5 * (1 - cos(pi * j / (NODES - 1)));
}

static int take_step(void *user, kmp_runner *runner, double from, double to)
{
    kmp_recorded_motion *motion = user;
    const kmp_linear *l = &motion->v->linear;
    const size_t width = 2 * (size_t)l->p;
    kmp_recorded_step *step = kmp_arena_alloc(&motion->arena, 1, sizeof *step + NODES * width * sizeof *step->values);
    if (!step)
        return 1;
    motion->bytes += NODES * width * sizeof *step->values;
    for (int j = 0; j < NODES; j++) {
        const double *y = kmp_runner_unknowns(runner, j == NODES - 1 ? to : from + node(j) * (to - from));
        if (!y)
            return 1;
        memcpy(step->values + (size_t)j * width, y, width * sizeof *y);
    }
    step->p = l->p;
    step->from = from;
    step->to = to;
    step->before = motion->end;
    if (motion->end)
        motion->end->behind = step;
    motion->end = step;
    memcpy(motion->q, l->q, (size_t)l->n * sizeof *l->q);
    return 0;
}

/* Copies the requirements of a map, the last one first. False: no memory. */
static bool keep_requirements(kmp_recorded_motion *motion, const kmp_forward_map *map,
                              const kmp_forward_requirement **to)
{
    kmp_arena *arena = &motion->arena;
    for (; *to; *to = (*to)->before)
        motion->requirements--;
    for (const kmp_forward_requirement *from = map->requirement; from; from = from->before) {
        kmp_forward_requirement *copy = kmp_arena_copy(arena, from, 1, sizeof *from);
        if (!copy)
            return false;
        copy->off = kmp_arena_copy(arena, from->off, map->columns, sizeof(double));
        copy->term = kmp_arena_copy(arena, from->term, from->terms * map->columns, sizeof(double));
        copy->reason = kmp_arena_strdup(arena, from->reason);
        copy->before = NULL;
        *to = copy;
        to = &copy->before;
        motion->requirements++;
    }
    return true;
}

static int take_map(void *user, const kmp_forward_map *map, bool again)
{
    kmp_recorded_motion *motion = user;
    kmp_arena *arena = &motion->arena;
    const kempe_system *s = motion->v->system;
    kmp_recorded_map *to = again ? motion->map : KMP_ARENA_NEW(arena, kmp_recorded_map, 1);
    if (!to)
        return 1;
    if (!again) {
        *to = (kmp_recorded_map){motion->map, *map, {0}, motion->end};
        to->of.requirement = NULL;
        to->of.row = kmp_arena_copy(arena, map->row, map->held, sizeof(int));
        to->of.q = kmp_arena_copy(arena, map->q, s->n, sizeof(double));
        to->of.mode = kmp_arena_copy(arena, map->mode, s->events.count, sizeof(double));
        to->of.chart = kmp_arena_copy(arena, map->chart, KMP_CHART_SIZE * s->chart_count, sizeof(double));
        motion->map = to;
    }
    const int columns = map->columns, p = map->p_after, held = map->held;
    to->of.p_after = p;
    kmp_partition_free(&to->part);
    if (!kmp_partition_copy(&to->part, map->part))
        return 1;
    to->of.u_after = kmp_arena_copy(arena, map->u_after, columns * p, sizeof(double));
    to->of.ud_after = kmp_arena_copy(arena, map->ud_after, columns * p, sizeof(double));
    to->of.held_after = kmp_arena_copy(arena, map->held_after, columns * held, sizeof(double));
    to->of.integral_after =
        map->integral_after ? kmp_arena_copy(arena, map->integral_after, columns, sizeof(double)) : NULL;
    if (!keep_requirements(motion, map, &to->of.requirement))
        return 1;
    motion->bytes += (size_t)(columns * (2 * p + held + 1)) * sizeof(double);
    motion->held = held;
    motion->row = to->of.row;
    return arena->failed;
}

/* Stores the end in the user's coordinates. */
static int take_end(void *user, const kmp_sensitivity_equations_row *row)
{
    kmp_recorded_motion *motion = user;
    size_t bytes = (size_t)motion->v->n * sizeof(double);
    memcpy(motion->own_q, row->q, bytes);
    memcpy(motion->own_qd, row->qd, bytes);
    memcpy(motion->own_qdd, row->qdd, bytes);
    motion->value = kmp_target_of_row(motion->target, motion->v, row);
    return 0;
}

kmp_sensitivity_equations_watch kmp_recorded_motion_watch(kmp_recorded_motion *motion)
{
    return (kmp_sensitivity_equations_watch){.user = motion, .row = take_end, .step = take_step, .map = take_map};
}

/* -- reading ------------------------------------------------------------------------------------------- */

/* By the barycentric formula. */
void kmp_recorded_step_at(const kmp_recorded_step *step, double t, double *y)
{
    const double *values = step->values;
    const int p = step->p;
    double x = (t - step->from) / (step->to - step->from), sum = 0;
    memset(y, 0, (size_t)(2 * p) * sizeof *y);
    for (int j = 0; j < NODES; j++) {
        double off = x - node(j), weight = (j % 2 ? -1 : 1) * (j == 0 || j == NODES - 1 ? 0.5 : 1);
        if (off == 0) {
            memcpy(y, values + 2 * p * j, (size_t)(2 * p) * sizeof *y);
            return;
        }
        weight /= off;
        sum += weight;
        for (int i = 0; i < 2 * p; i++)
            y[i] += weight * values[2 * p * j + i];
    }
    for (int i = 0; i < 2 * p; i++)
        y[i] /= sum;
}

void kmp_recorded_motion_take(kmp_recorded_motion *motion, const kmp_recorded_step *before,
                              const kmp_recorded_step *last, double since)
{
    motion->first = motion->last = motion->at = last;
    while (motion->first->before != before && motion->first->before->from >= since)
        motion->first = motion->first->before;
}

double kmp_recorded_motion_time(const kmp_recorded_motion *motion, double t)
{
    return fmin(fmax(t, motion->first->from), motion->last->to);
}

void kmp_recorded_motion_at(kmp_recorded_motion *motion, double t, double *y)
{
    while (motion->at != motion->first && t < motion->at->from)
        motion->at = motion->at->before;
    while (motion->at != motion->last && t > motion->at->to)
        motion->at = motion->at->behind;
    kmp_recorded_step_at(motion->at, t, y);
}

bool kmp_recorded_map_follows_steps(const kmp_recorded_map *map)
{
    return map->last && map->last != (map->before ? map->before->last : NULL);
}
