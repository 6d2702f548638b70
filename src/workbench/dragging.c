/* SPDX-License-Identifier: BSD-3-Clause */
#include "workbench/dragging.h"
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/three.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 8, MOST_TRIES = 12 };
#define LONGEST       0.2   /* largest component of a step: rad, or characteristic lengths */
#define MOST_CLOSING  0.3   /* largest motion by closing, over the step */
#define LEAST_ALIGNED 0.9   /* least part of a step along the new tangents */
#define NEGLIGIBLE    1e-10 /* a shorter step is the last one */
#define FIRST_DAMPING 1e-4
#define LEAST_DAMPING 1e-9
#define MORE_DAMPING  8.0
#define LESS_DAMPING  0.2
#define POOR          0.1 /* parts of the promised gain: with less a step is not taken, */
#define FAIR          0.4 /* less has more damping, */
#define GOOD          0.8 /* more has less */

/* -- new and free ------------------------------------------------------------------------------------ */

KMP_FREES(kmp_dragging, d, kmp_mode_watch_free(d->watch), kmp_walk_free(d->walk), kmp_arena_free(&d->arena))

/* Counts the degrees of freedom at the start, and watches the assembly modes by independent coordinates: as many of the
 * model's choice as can be. False: no memory. */
static bool choose_watched(kmp_dragging *d)
{
    const kempe_model *model = d->system->model;
    const int n = d->system->n;
    bool *liked = KMP_ARENA_NEW(&d->arena, bool, n + 1);
    int *u = KMP_ARENA_NEW(&d->arena, int, n + 1);
    double *jacobian = KMP_ARENA_NEW(&d->arena, double, d->system->jacobian.count + 1);
    if (!liked || !u || !jacobian)
        return false;
    for (int k = 0; k < n; k++)
        liked[k] = model->start.hold[k] || d->hold[k];
    for (int k = 0; k < model->run.independent_count; k++)
        liked[model->run.independent[k]] = true;
    kmp_walk_evaluate(d->walk, d->q);
    for (int e = 0; e < d->system->jacobian.count; e++)
        jacobian[e] = d->released[d->system->jacobian.row[e]] ? 0 : d->walk->eval->jacobian[e];
    const int count = kmp_partition_prefer(d->system, jacobian, liked, u);
    if (count < 0)
        return false;
    memset(liked, 0, (size_t)n * sizeof *liked);
    for (int k = 0; k < count; k++) {
        liked[u[k]] = true;
        d->freedoms += !d->hold[u[k]];
    }
    d->watch = kmp_mode_watch_new(d->system, liked, 0, d->q, d->released);
    return true;
}

/* Closes q by least changes; the rows that these leave out stay so for what follows. */
static bool close_loops(kmp_dragging *d, double *q)
{
    const bool closed = kmp_walk_close(d->walk, q);
    d->walk->eval->unmet.left_out = d->walk->rank >= 0 || d->walk->excluded ? d->walk->dropped : NULL;
    return closed;
}

static kempe_status prepare(kmp_dragging *d)
{
    const kempe_system *s = d->system;
    kempe_assembly *assembly = NULL;
    const size_t n = (size_t)s->n, three = sizeof(double[3]);
    d->walk = kmp_walk_new_of_closures(s);
    d->axes = kmp_arena_alloc(&d->arena, n + 1, three);
    d->places = kmp_arena_alloc(&d->arena, n + 1, three);
    const bool made = d->walk && d->axes && d->places &&
                      KMP_ARENA_MAKE(&d->arena, KMP_ROOM(bool, n, &d->hold), KMP_ROOM(bool, s->m, &d->released),
                                     KMP_ROOM(kmp_pose, s->model->body_count, &d->poses),
                                     KMP_ROOM(double, n, &d->start, &d->q, &d->trial, &d->step),
                                     KMP_ROOM(double, 3 * n, &d->slope, &d->free));
    KMP_TRY(kmp_made(s->context, made));
    KMP_TRY(kmp_assembly_at_start(s, &assembly));
    memcpy(d->q, assembly->q, n * sizeof *d->q);
    memcpy(d->start, assembly->q, n * sizeof *d->q);
    kempe_assembly_free(assembly);
    for (int k = 0; k < s->n; k++)
        d->hold[k] = s->model->motions[k].elastic;
    d->walk->hold = d->hold;
    d->damping = FIRST_DAMPING;
    /* Releases drives, but not locks. */
    int count = 0;
    for (int r = 0; r < s->m; r++) {
        d->released[r] = s->model->closures[s->rows[r].closure].kind == KMP_CLOSURE_drive;
        count += d->released[r];
    }
    if (count > 0)
        d->walk->excluded = d->released;
    if (d->walk->rank >= 0)
        d->walk->rank -= count;
    KMP_TRY(kmp_made(s->context, choose_watched(d)));
    if (!close_loops(d, d->q))
        memcpy(d->q, d->start, n * sizeof *d->q);
    return KEMPE_OK;
}

kempe_status kmp_dragging_new(const kempe_system *system, kmp_dragging **dragging)
{
    KMP_MAKE(system->context, kmp_dragging, d);
    d->system = system;
    const kempe_status status = prepare(d);
    return KMP_GIVE_OR_FREE(status, dragging, d, kmp_dragging_free);
}

/* -- closed states ----------------------------------------------------------------------------------- */

/* The factors of least changes at q. False: there are none. */
static bool factor(kmp_dragging *d, const double *q)
{
    const kmp_closer closer = kmp_least_change_closer(&d->walk->least);
    d->walk->least.hold = d->hold;
    return closer.place(closer.self, 0, q) == 0;
}

/* x (n, scaled) becomes its part along the tangents of the closed positions, at the last factors. */
static void project(kmp_dragging *d, double *x)
{
    const kempe_system *s = d->system;
    const kmp_closer closer = kmp_least_change_closer(&d->walk->least);
    double *rows = d->walk->h;
    memset(rows, 0, (size_t)s->m * sizeof *rows);
    for (int e = 0; e < s->jacobian.count; e++)
        rows[s->jacobian.row[e]] += d->walk->eval->jacobian[e] * x[s->jacobian.col[e]] * s->scale[s->jacobian.col[e]];
    if (s->m > 0 && closer.correct(closer.self, rows, closer.dx))
        for (int k = 0; k < s->n; k++)
            x[k] += closer.dx[k] / s->scale[k];
}

void kmp_dragging_look(kmp_dragging *d, kmp_drag_report *report)
{
    *report = (kmp_drag_report){0};
    kmp_eval_closure(d->walk->eval, 0, d->q);
    report->closure = d->system->m > 0 ? kmp_eval_residual(d->walk->eval) : 0;
    report->mode = d->watch ? kmp_mode_watch_next(d->watch, 0, d->q) != NULL : -1;
    kmp_pose_all(d->system->model, d->q, d->poses);
}

bool kmp_dragging_place(kmp_dragging *d, const double *q, kmp_drag_report *report)
{
    const size_t bytes = (size_t)d->system->n * sizeof *q;
    for (int k = 0; k < d->system->n; k++)
        d->trial[k] = d->hold[k] ? d->start[k] : q[k];
    const bool closed = close_loops(d, d->trial);
    if (closed)
        memcpy(d->q, d->trial, bytes);
    d->damping = FIRST_DAMPING;
    kmp_dragging_look(d, report);
    return closed;
}

/* -- the point --------------------------------------------------------------------------------------- */

/* The point at the poses, minus the target. */
static double find_distance(const kmp_dragging *d, int body, const double point[3], const double target[3], double r[3])
{
    const kmp_pose *pose = &d->poses[body];
    for (int i = 0; i < 3; i++)
        r[i] = pose->p[i] + kmp_dot(3, pose->r[i], point) - target[i];
    return sqrt(kmp_dot(3, r, r));
}

/* G at q, scaled: rotations about the axes of the motions that carry the body, translations along them. */
static void find_slope(kmp_dragging *d, int body, const double point[3])
{
    const kempe_system *s = d->system;
    const kempe_model *model = s->model;
    const int n = s->n;
    double p[3], zero[3] = {0, 0, 0};
    kmp_pose_motions(model, d->q, d->poses, d->axes, d->places);
    (void)find_distance(d, body, point, zero, p);
    memset(d->slope, 0, 3 * (size_t)n * sizeof *d->slope);
    for (int b = body; b > 0; b = model->bodies[b].parent)
        for (int k = model->bodies[b].first_motion; k < model->bodies[b].first_motion + model->bodies[b].motion_count;
             k++) {
            double arm[3], turned[3];
            for (int i = 0; i < 3; i++)
                arm[i] = p[i] - d->places[k][i];
            kmp_cross3(d->axes[k], arm, turned);
            for (int i = 0; i < 3 && !d->hold[k]; i++)
                d->slope[i * n + k] = (model->motions[k].rotation ? turned[i] : d->axes[k][i]) * s->scale[k];
        }
}

/* -- steps ------------------------------------------------------------------------------------------- */

/* Chooses the step by the present damping, no component longer than `bound`; returns its largest component. */
static double choose_step(kmp_dragging *d, const double r[3], double bound)
{
    const int n = d->system->n;
    double matrix[9], y[3], top = 0, size = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            matrix[i + 3 * j] = kmp_dot(n, d->slope + i * n, d->free + j * n);
        top = fmax(top, matrix[4 * i]);
        y[i] = -r[i];
    }
    for (int i = 0; i < 3; i++)
        matrix[4 * i] += d->damping * top;
    if (!(top > 0) || kmp_cholesky_factor(3, matrix) != 0)
        return 0;
    kmp_cholesky_solve(3, matrix, y);
    for (int k = 0; k < n; k++) {
        d->step[k] = y[0] * d->free[k] + y[1] * d->free[n + k] + y[2] * d->free[2 * n + k];
        size = fmax(size, fabs(d->step[k]));
    }
    const double part = size > bound ? bound / size : 1;
    for (int k = 0; k < n; k++)
        d->step[k] *= part;
    return part * size;
}

/* The distance that the step leaves by the slope. */
static double find_promise(const kmp_dragging *d, const double r[3])
{
    double left[3];
    for (int i = 0; i < 3; i++)
        left[i] = r[i] + kmp_dot(d->system->n, d->slope + i * d->system->n, d->step);
    return sqrt(kmp_dot(3, left, left));
}

/* Makes `trial`, closed after the step. False: it is not on the same branch. */
static bool make_step(kmp_dragging *d)
{
    const kempe_system *s = d->system;
    double size = sqrt(kmp_dot(s->n, d->step, d->step)), closing = 0;
    for (int k = 0; k < s->n; k++)
        d->trial[k] = d->q[k] + d->step[k] * s->scale[k];
    if (!close_loops(d, d->trial))
        return false;
    for (int k = 0; k < s->n; k++)
        closing = hypot(closing, (d->trial[k] - d->q[k]) / s->scale[k] - d->step[k]);
    if (!(closing <= MOST_CLOSING * size + NEGLIGIBLE) || !factor(d, d->trial))
        return false;
    project(d, d->step);
    return sqrt(kmp_dot(s->n, d->step, d->step)) >= LEAST_ALIGNED * size;
}

/* Takes a step by which the distance falls, with components up to `bound`; returns the largest one, 0: there is none.
 */
static double step_nearer(kmp_dragging *d, int body, const double point[3], const double target[3], double bound)
{
    const int n = d->system->n;
    double r[3], there[3];
    find_slope(d, body, point);
    const double distance = find_distance(d, body, point, target, r);
    if (!factor(d, d->q))
        return 0;
    memcpy(d->free, d->slope, 3 * (size_t)n * sizeof *d->free);
    for (int i = 0; i < 3; i++)
        project(d, d->free + i * n);
    for (int k = 0; k < MOST_TRIES; k++, bound *= 0.5) {
        const double size = choose_step(d, r, bound), promised = distance - find_promise(d, r);
        if (!(size > 0))
            return 0;
        if (make_step(d)) {
            kmp_pose_all(d->system->model, d->trial, d->poses);
            const double gained = distance - find_distance(d, body, point, target, there);
            if (gained > POOR * promised && gained > 0) {
                memcpy(d->q, d->trial, (size_t)n * sizeof *d->q);
                d->damping *= gained > GOOD * promised ? LESS_DAMPING : gained < FAIR * promised ? MORE_DAMPING : 1;
                d->damping = fmax(d->damping, LEAST_DAMPING);
                return size;
            }
        }
        d->damping *= MORE_DAMPING;
    }
    d->damping = FIRST_DAMPING;
    return 0;
}

void kmp_dragging_move(kmp_dragging *d, int body, const double point[3], const double target[3],
                       kmp_drag_report *report)
{
    double left = KMP_LONGEST_CORRECTION, size = 1, r[3];
    for (int k = 0; k < MOST_STEPS && left > NEGLIGIBLE && size > NEGLIGIBLE; k++, left -= size)
        size = step_nearer(d, body, point, target, fmin(left, LONGEST));
    kmp_dragging_look(d, report);
    report->distance = find_distance(d, body, point, target, r);
}
