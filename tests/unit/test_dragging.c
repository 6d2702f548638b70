/* SPDX-License-Identifier: BSD-3-Clause */
/* Mechanisms that follow a dragged point: their loops stay closed, no frame jumps to another assembly mode, the point
 * comes as near to its target as geometry allows, and a frame takes less than a display shows one. */
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "loaded.h"
#include "model/data/body.h"
#include "platform/platform.h"
#include "sanitized.h"
#include "workbench/dragging.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* wings: analyses rail road exchange */

static const char *const mechanisms[] = {
    "examples/four_bar/four_bar.yaml",       "examples/slider_crank/slider_crank.yaml",
    "examples/andrews/andrews.yaml",         "examples/stewart/stewart.yaml",
    "examples/chebyshev/chebyshev.yaml",     "examples/parallel_robot/parallel_robot.yaml",
    "examples/excavator/excavator.yaml",     "examples/bricard/bricard.yaml",
    "examples/suspension/suspension.yaml",   "examples/delta_robot/delta_robot.yaml",
    "examples/peaucellier/peaucellier.yaml", "examples/scissor_lift/scissor_lift.yaml",
};

enum { DRAGS = 100, FRAMES = 12 };

static double largest_change(const kempe_system *s, const double *a, const double *b)
{
    double most = 0;
    for (int k = 0; k < s->n; k++)
        most = fmax(most, fabs(a[k] - b[k]) / s->scale[k]);
    return most;
}

/* A hundred drags of random points of random bodies to random targets near to them, some of them out of reach. */
static void drag_at_random(const char *path)
{
    loaded l = load(path);
    kmp_dragging *d = NULL;
    CHECK(l.system && kmp_dragging_new(l.system, &d) == KEMPE_OK);
    if (!d) {
        printf("  %s: %s\n", path, kempe_context_message(l.context));
        unload(&l);
        return;
    }
    const kempe_system *s = l.system;
    double *before = calloc((size_t)s->n, sizeof *before), slowest = 0, whole = 0, worst = 0;
    unsigned state = 7;
    int frames = 0, marks = 0, moved = 0;
    for (int k = 0; k < DRAGS; k++) {
        const int body = 1 + (int)((kmp_walk_random(&state) + 1) / 2 * (kmp_model_body_count(s->model) - 1)) %
                                 (kmp_model_body_count(s->model) - 1);
        double point[3], target[3];
        kmp_drag_report report, last = {.distance = INFINITY};
        for (int i = 0; i < 3; i++)
            point[i] = 0.3 * s->length * kmp_walk_random(&state);
        for (int i = 0; i < 3; i++)
            target[i] = d->poses[body].p[i] + kmp_dot(3, d->poses[body].r[i], point) +
                        0.8 * s->length * kmp_walk_random(&state);
        for (int f = 0; f < FRAMES; f++, last = report) {
            memcpy(before, d->q, (size_t)s->n * sizeof *before);
            const double began = kmp_cpu_now();
            kmp_dragging_move(d, body, point, target, &report);
            const double took = kmp_cpu_now() - began;
            slowest = fmax(slowest, took);
            whole += took;
            worst = fmax(worst, report.closure);
            marks += report.mode > 0;
            moved += largest_change(s, before, d->q) > 1e-6;
            frames++;
            CHECK(report.closure <= 1e-10);
            CHECK(report.distance <= last.distance * (1 + 1e-12));
            /* a jump would be longer than the steps of a frame with what closing adds to them */
            CHECK(largest_change(s, before, d->q) <= 1.5 * KMP_LONGEST_CORRECTION);
        }
    }
    CHECK(moved > frames / 10);
    CHECK(d->watch);
    printf("  %-42s %3d coordinates, %2d freedoms: %4d frames, mean %5.2f ms, longest %6.2f ms, closed to %.1e, %d "
           "marks\n",
           path, s->n, d->freedoms, frames, 1e3 * whole / frames, 1e3 * slowest, worst, marks);
    free(before);
    kmp_dragging_free(d);
    unload(&l);
}

static void loops_stay_closed(void)
{
    for (size_t k = 0; k < sizeof mechanisms / sizeof *mechanisms; k++)
        drag_at_random(mechanisms[k]);
}

/* Drags in some frames until the point rests; the last report. */
static kmp_drag_report drag_to(kmp_dragging *d, const char *body, const double point[3], const double target[3])
{
    kmp_drag_report report = {0};
    int b = kmp_model_body_count(d->system->model) - 1;
    while (b > 0 && strcmp(kmp_model_body(d->system->model, b)->name, body) != 0)
        b--;
    for (int f = 0; f < 60; f++)
        kmp_dragging_move(d, b, point, target, &report);
    return report;
}

/* The tip of a crank of 0.2 m is drawn to a place out of its reach: it stops on the line from its hinge to there. */
static void point_rests_nearest_to_its_target(void)
{
    static const double tip[3] = {0.2, 0, 0};
    loaded l = load("examples/slider_crank/slider_crank.yaml");
    kmp_dragging *d = NULL;
    CHECK(kmp_dragging_new(l.system, &d) == KEMPE_OK);
    for (int k = 0; d && k < 8; k++) {
        const double angle = 0.4 + 1.1 * k, far = k % 2 ? 0.9 : 0.05;
        const double target[3] = {far * cos(angle), far * sin(angle), 0.1 * k};
        const kmp_drag_report report = drag_to(d, "crank", tip, target);
        CHECK_NEAR(report.distance, hypot(fabs(far - 0.2), 0.1 * k), 1e-9);
        CHECK_NEAR(remainder(d->q[0] - angle, 2 * acos(-1)), 0, 1e-4);
    }
    kmp_dragging_free(d);
    unload(&l);
}

/* Six legs reach a place in their range. */
static void reachable_targets_are_reached(void)
{
    static const double point[3] = {0.1, 0.05, 0};
    loaded l = load("examples/stewart/stewart.yaml");
    kmp_dragging *d = NULL;
    CHECK(kmp_dragging_new(l.system, &d) == KEMPE_OK);
    for (int k = 0; d && k < 8; k++) {
        int platform = 1;
        while (strcmp(kmp_model_body(d->system->model, platform)->name, "platform") != 0)
            platform++;
        double target[3];
        for (int i = 0; i < 3; i++)
            target[i] = d->poses[platform].p[i] + kmp_dot(3, d->poses[platform].r[i], point) + 0.03 * ((k + i) % 3 - 1);
        CHECK_NEAR(drag_to(d, "platform", point, target).distance, 0, 1e-10);
    }
    kmp_dragging_free(d);
    unload(&l);
}

/* A four-bar linkage none of whose bars turns fully: the angle between coupler and rocker tells which of the two ways
 * of assembling it for a place of the crank is present. */
#define SWINGING                                                                                                       \
    "kempe: 1\nname: swinging\nground: {points: {D: [1, 0, 0]}}\nbodies:\n"                                            \
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.6, 0, 0]}}\n"   \
    "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.05}, points: {C: [0.5, 0, 0]}}\n"    \
    "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 0.04}, "                           \
    "points: {C: [0.55, 0, 0]}}\n"                                                                                     \
    "loops: {C: {ball: [rod.C, rocker.C]}}\n"                                                                          \
    "start: {q: {A: 60 deg, B: -40 deg, D: 110 deg}, hold: [A]}\n"

/* The same linkage in the plane of x and z. The rod turns in a spherical joint whose second angle passes its singular
 * positions, and a revolute joint closes the loop, so that rows are redundant. */
#define SPHERICAL                                                                                                      \
    "kempe: 1\nname: spherical\nground: {points: {D: [1, 0, 0]}}\nbodies:\n"                                           \
    "  crank: {joint: {name: A, revolute: y, at: ground}, mass: 1, inertia: {yy: 0.01}, points: {B: [0.6, 0, 0]}}\n"   \
    "  rod: {joint: {name: B, motions: [R1, R2, R3], at: crank.B}, mass: 1, inertia: {xx: 0.01, yy: 0.05, zz: 0.05}, " \
    "points: {C: [0.5, 0, 0]}}\n"                                                                                      \
    "  rocker: {joint: {name: D, revolute: y, at: ground.D}, mass: 1, inertia: {yy: 0.04}, "                           \
    "points: {C: [0.55, 0, 0]}}\n"                                                                                     \
    "loops: {C: {revolute: [rod.C, rocker.C], axis: y}}\n"                                                             \
    "start: {q: {A: -60 deg, B.2: 40 deg, D: -110 deg}, hold: [A]}\n"

/* By the two points of the linkage's plane. */
static void check_marks(const char *text, int up)
{
    enum { MOVES = 400 };
    const double tip[3] = {0.25, up == 1 ? 0.1 : 0, up == 1 ? 0 : 0.1};
    loaded l = load_text(text);
    kmp_dragging *d = NULL;
    CHECK(kmp_dragging_new(l.system, &d) == KEMPE_OK && d->watch && d->freedoms == 1);
    unsigned state = 3;
    int marks = 0, changes = 0;
    double last = 0;
    for (int k = 0; d && d->watch && k < MOVES; k++) {
        double target[3] = {0.5 + kmp_walk_random(&state)};
        target[up] = kmp_walk_random(&state);
        for (int f = 0; f < 6; f++) {
            kmp_drag_report report;
            kmp_dragging_move(d, 2, tip, target, &report);
            /* the sine of the angle between rod and rocker, which lie along their x */
            const kmp_pose *rod = &d->poses[2], *rocker = &d->poses[3];
            const double mode = rod->r[0][0] * rocker->r[up][0] - rod->r[up][0] * rocker->r[0][0];
            CHECK(report.mode >= 0);
            marks += report.mode;
            if (fabs(mode) < 0.02) /* the two ways meet here */
                continue;
            CHECK((marks % 2 == 1) == (last * mode < 0));
            changes += last * mode < 0;
            marks = 0;
            last = mode;
        }
    }
    CHECK(changes > 10);
    kmp_dragging_free(d);
    unload(&l);
}

static void each_change_of_the_assembly_mode_is_marked(void)
{
    check_marks(SWINGING, 1);
}

/* A drive does not hold while one drags: the same ways of assembling are told apart. */
static void changes_are_marked_where_a_drive_is_released(void)
{
    check_marks(SWINGING "drives: {motor: {joint: A, angle: 60 deg + 10 rpm*t}}\n", 1);
}

/* Marks do not depend on the angles that describe a rotation. */
static void changes_are_marked_with_spherical_joints(void)
{
    check_marks(SPHERICAL, 2);
}

/* Of a leg on a universal joint with angles a and b about x and y, which extends along e: det Jv with the platform kept
 * is the square of its length times (R_y(b) e)_z. */
static double leg_side(const kmp_dragging *d, int leg)
{
    const int second = 7 + 3 * leg;
    const double *e = kmp_model_motion(d->system->model, second + 1)->axis, b = d->q[second];
    return e[2] * cos(b) - e[0] * sin(b);
}

static void changes_of_each_leg_are_marked(void)
{
    enum { LEGS = 6, MOVES = 300, FRAMES_EACH = 4 };
    loaded l = load("examples/stewart/stewart.yaml");
    kmp_dragging *d = NULL;
    CHECK(kmp_dragging_new(l.system, &d) == KEMPE_OK && d->watch);
    int changes = 0, before[LEGS] = {0};
    unsigned state = 11;
    for (int k = 0; d && d->watch && k < MOVES; k++) {
        double point[3], target[3];
        for (int i = 0; i < 3; i++) {
            point[i] = 0.5 * kmp_walk_random(&state);
            target[i] = 3 * kmp_walk_random(&state);
        }
        for (int f = 0; f < FRAMES_EACH; f++) {
            kmp_drag_report report;
            kmp_dragging_move(d, 1, point, target, &report);
            bool changed = false;
            for (int leg = 0; leg < LEGS; leg++) {
                const int sign = leg_side(d, leg) > 0 ? 1 : -1;
                changed = changed || sign * before[leg] < 0;
                before[leg] = sign;
            }
            CHECK(report.mode == changed);
            changes += changed;
        }
    }
    CHECK(changes > 10);
    kmp_dragging_free(d);
    unload(&l);
}

/* Drives are released, locks are not: of two equal bars one turns. */
static void drives_are_released_and_locks_hold(void)
{
    static const double tip[3] = {1, 0, 0}, up[3] = {0, 2, 0};
    loaded l = load_text("kempe: 1\nname: two\nbodies:\n"
                         "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"
                         "  b: {joint: {name: B, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"
                         "drives: {m: {joint: A, angle: 0.2 + t}, brake: {joint: B, locked: yes}}\n");
    kmp_dragging *d = NULL;
    CHECK(kmp_dragging_new(l.system, &d) == KEMPE_OK && d->freedoms == 1);
    if (d) {
        CHECK_NEAR(d->q[0], 0.2, 1e-14);
        const kmp_drag_report drawn = drag_to(d, "a", tip, up);
        CHECK_NEAR(drawn.distance, 1, 1e-10);
        CHECK(drawn.mode == 0); /* without loops there is one */
        CHECK_NEAR(drag_to(d, "b", tip, up).distance, sqrt(5), 1e-14);
    }
    kmp_dragging_free(d);
    unload(&l);
}

/* A state is placed by all coordinates; one that cannot be closed leaves the present one. */
static void states_are_placed(void)
{
    static const double tip[3] = {0.25, 0, 0}, target[3] = {0.2, 0.8, 0}, afar[3] = {0, 0, 1e300};
    loaded l = load_text(SWINGING);
    kmp_dragging *d = NULL;
    kmp_drag_report report;
    CHECK(kmp_dragging_new(l.system, &d) == KEMPE_OK);
    if (d) {
        double moved[3];
        (void)drag_to(d, "rod", tip, target);
        memcpy(moved, d->q, sizeof moved);
        CHECK(kmp_dragging_place(d, d->start, &report));
        CHECK_NEAR(largest_change(d->system, d->q, d->start), 0, 1e-12);
        CHECK(kmp_dragging_place(d, moved, &report));
        CHECK_NEAR(largest_change(d->system, d->q, moved), 0, 1e-12);
        CHECK(!kmp_dragging_place(d, afar, &report) && report.closure <= 1e-10);
        CHECK_NEAR(largest_change(d->system, d->q, moved), 0, 1e-12);
    }
    kmp_dragging_free(d);
    unload(&l);
}

/* Eighty-one bodies, more than twice as many as a frame of 16 ms must allow. */
static void frames_are_short(void)
{
    enum { MOVES = 40 };
    static const double tip[3] = {0.5, 0, 0};
    loaded l = load("examples/n_four_bar/n_four_bar_40.yaml");
    kmp_dragging *d = NULL;
    CHECK(kmp_dragging_new(l.system, &d) == KEMPE_OK && d->watch);
    double whole = 0;
    for (int k = 0; d && k < MOVES; k++) {
        const int body = kmp_model_body_count(d->system->model) - 1;
        const double target[3] = {40 + cos(0.3 * k), sin(0.3 * k), 0};
        kmp_drag_report report;
        const double began = kmp_cpu_now();
        kmp_dragging_move(d, body, tip, target, &report);
        whole += kmp_cpu_now() - began;
        CHECK(report.closure <= 1e-10);
    }
    if (d)
        printf("  %d bodies, %d coordinates: mean frame %.2f ms\n", kmp_model_body_count(d->system->model) - 1,
               d->system->n, 1e3 * whole / MOVES);
#ifndef SANITIZED
    CHECK(whole / MOVES < 16e-3);
#endif
    kmp_dragging_free(d);
    unload(&l);
}

int main(void)
{
    TEST(loops_stay_closed);
    TEST(point_rests_nearest_to_its_target);
    TEST(reachable_targets_are_reached);
    TEST(each_change_of_the_assembly_mode_is_marked);
    TEST(changes_are_marked_where_a_drive_is_released);
    TEST(changes_are_marked_with_spherical_joints);
    TEST(changes_of_each_leg_are_marked);
    TEST(drives_are_released_and_locks_hold);
    TEST(states_are_placed);
    TEST(frames_are_short);
    return check_report();
}
