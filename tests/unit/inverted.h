/* SPDX-License-Identifier: BSD-3-Clause */
/* Shared by tests of inverse dynamics: parts of a result, tables written, a four-bar, the parallel robot. */
#ifndef KEMPE_TESTS_INVERTED_H
#define KEMPE_TESTS_INVERTED_H

#include "analyses/inverse/inverse_study.h"
#include "dynamics/system.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/extend.h>
#include <kempe/inverse.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

enum { MOST = 64 };

/* One row of the result: a part of it. */
#define PART(name)                                                                                                     \
    static inline const double *name##_at(const kempe_inverse *r, int row)                                             \
    {                                                                                                                  \
        return kmp_inverse_part(r, row, r->at.name);                                                                   \
    }
PART(q)
PART(qd)
PART(qdd)
PART(tau)
PART(power)
PART(lambda)
#undef PART

static inline kempe_inverse *invert(const loaded *m, const kempe_inverse_options *options, kempe_status wanted)
{
    kempe_inverse *r = NULL;
    kempe_status status = kempe_inverse_new(m->system, options, &r);
    if (status != wanted)
        printf("status %d: %s\n", status, kempe_context_message(m->context));
    CHECK(status == wanted);
    return r;
}

static inline kempe_trajectory *simulate(const loaded *m, double t_end, double every, double rtol)
{
    kempe_trajectory *t = NULL;
    kempe_run_options run = {.t_end = t_end, .output_step = every, .rtol = rtol, .no_convergence_check = 1};
    kempe_status status = kempe_simulate(m->system, &run, &t);
    if (status != KEMPE_OK)
        printf("status %d: %s\n", status, kempe_context_message(m->context));
    CHECK(status == KEMPE_OK);
    return t;
}

/* A file of its own with this text; to be unlinked. */
static inline void write_text(const loaded *m, char *path, const char *text)
{
    int file = mkstemp(path);
    CHECK(file >= 0);
    close(file);
    CHECK(kempe_write_file(m->context, path, text) == KEMPE_OK);
}

static const char four_bar[] =
    "kempe: 1\nname: four-bar\ngravity: [0, -9.81, 0]\nground: {points: {D: [0.9, 0, 0]}}\n"
    "bodies:\n"
    "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.01}, points: {B: [0.3, 0, "
    "0]}}\n"
    "  b: {joint: {revolute: z, at: a.B}, mass: 1, com: [0.4, 0, 0], inertia: {zz: 0.05}, points: {C: [0.8, 0, 0]}}\n"
    "  c: {joint: {revolute: z, at: ground.D}, mass: 1, com: [0.35, 0, 0], inertia: {zz: 0.04}, points: {C: [0.7, 0, "
    "0]}}\n"
    "loops: {C: {ball: [b.C, c.C]}}\n"
    "forces: {k: {joint: c, spring: {stiffness: 3, rest: 1}}}\n"
    "start: {q: {a: 90 deg, b: -62 deg, c: 106 deg}}\n"
    "run: {t_end: 1, output_step: 1 ms}\n";

static inline loaded load_four_bar(const char *more)
{
    char text[2048];
    (void)snprintf(text, sizeof text, "%s%s", four_bar, more);
    return load_text(text);
}

static const char driven[] = "drives: {m: {joint: a, angle: \"pi/2 + 5*t + 2*sin(3*t)\"}}\n";

/* 7 sin 4t on the first, 3 - 2 qd on the second. */
static inline int known(void *user, double t, const double *q, const double *qd, double *effort)
{
    const int *at = user;
    (void)q;
    effort[at[0]] += 7 * sin(4 * t);
    if (at[1] >= 0)
        effort[at[1]] += 3 - 2 * qd[at[1]];
    return 0;
}

static const char in_plane[] = "kempe: 1\ngravity: [0, -g, 0]\n"
                               "include: [{file: examples/parallel_robot/parallel_robot.yaml}]\n"
                               "run: {t_end: 2, output_step: 20 ms}\n";
static const char in_space[] = "kempe: 1\ngravity: [2*g/3, -g/3, -2*g/3]\n"
                               "include: [{file: examples/parallel_robot/parallel_robot_spatial.yaml}]\n"
                               "run: {t_end: 2, output_step: 20 ms}\n";

static inline loaded load_here(const char *text)
{
    CHECK(chdir(KEMPE_ROOT) == 0); /* what it includes is found from there */
    return load_text(text);
}

/* The table of a run of the robot under known efforts at a1, and at b1 too, which are then taken away. */
static inline void write_robot(loaded *m, bool both, char *path)
{
    int at[2] = {0, both ? 6 : -1};
    CHECK_TEXT(kempe_model_coordinate_name(m->model, 0), "a1");
    CHECK_TEXT(kempe_model_coordinate_name(m->model, 6), "b1");
    kempe_system_set_force(m->system, known, at);
    kempe_trajectory *t = simulate(m, 2, 0.02, 1e-9);
    kempe_system_set_force(m->system, NULL, NULL);
    int file = mkstemp(path);
    CHECK(file >= 0);
    close(file);
    kempe_table *rows = NULL;
    CHECK(t && kempe_trajectory_table(t, "rows", &rows) == KEMPE_OK && kempe_table_write(rows, path) == KEMPE_OK);
    kempe_table_free(rows);
    kempe_trajectory_free(t);
}

#endif
