/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Assembly from near and from afar, against states known beforehand; what cannot be assembled says which loop and how
 * far, against plane geometry. */
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/least_change.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "loaded.h"
#include "model/data/model.h"
#include "random.h"
#include "testing.h"
#include <kempe/check.h>
#include <stdlib.h>

static kempe_assembly *assembled(const loaded *l)
{
    kempe_assembly *a = NULL;
    CHECK(kempe_assembly_new(l->system, &a) == KEMPE_OK);
    CHECK_TEXT(kempe_context_message(l->context), "");
    CHECK(a && a->closed && a->culprit_count == 0);
    CHECK(a && a->residual < 1e-14);
    return a;
}

/* -- back to a known state --------------------------------------------------------------------------- */

/* Perturbs what is not held by up to `size` (scaled), assembles, and expects the state of the file. */
static void returns_from(const char *path, double size, int trials)
{
    loaded l = load(path);
    double q[16], worst = 0;
    int n = l.system->n;
    kempe_assembly *a = assembled(&l);
    for (int k = 0; k < n; k++) {
        q[k] = l.model->start.q[k].value;
        CHECK_NEAR(a->q[k], q[k], 1e-14); /* the file's start is closed */
    }
    kempe_assembly_free(a);
    for (int trial = 0; trial < trials; trial++) {
        for (int k = 0; k < n; k++)
            if (!l.model->start.hold[k])
                l.model->start.q[k].value = q[k] + between(-size, size) * l.system->scale[k];
        a = assembled(&l);
        for (int k = 0; k < n; k++) {
            CHECK(!l.model->start.hold[k] || a->q[k] == q[k]);
            CHECK_NEAR(a->q[k], q[k], 1e-12);
            CHECK(a->moved[k] == a->q[k] - l.model->start.q[k].value);
            worst = check_max(worst, fabs(a->q[k] - q[k]));
        }
        kempe_assembly_free(a);
    }
    printf("  %s from %g: within %.1e\n", path, size, worst);
    unload(&l);
}

static void returns_to_the_printed_state(void)
{
    static const char *const paths[] = {"examples/andrews/andrews.yaml", "examples/four_bar/four_bar.yaml"};
    random_seed(7);
    for (int k = 0; k < 2; k++) {
        returns_from(paths[k], 1e-3, 50);
        returns_from(paths[k], 0.2, 50);
    }
}

/* The start is the outer dead centre: crank and rod in line. */
static void returns_to_the_slider_crank(void)
{
    random_seed(8);
    returns_from("examples/slider_crank/slider_crank.yaml", 1e-3, 50);
    returns_from("examples/slider_crank/slider_crank.yaml", 0.2, 50);
}

static void assembles_from_a_rough_guess(void)
{
    loaded l = load("examples/four_bar/four_bar.yaml");
    int upper = 0;
    random_seed(9);
    for (int trial = 0; trial < 200; trial++) {
        l.model->start.q[1].value = between(-3, 3);
        l.model->start.q[2].value = between(-3, 3);
        kempe_assembly *a = assembled(&l);
        CHECK(a->q[0] == 0);
        upper += fabs(remainder(a->q[2], 2 * acos(-1))) < 1e-9;
        kempe_assembly_free(a);
    }
    printf("  200 rough guesses: all closed, %d on the branch of the file\n", upper);
    CHECK(upper > 20 && upper < 180);
    unload(&l);
}

/* Rests with open loops, where every step along the slope of |h| ends. */
static void wheels_close_from_anywhere(void)
{
    enum { STARTS = 40 };
    loaded l = load("tests/models/wheels.yaml");
    int n = l.system->n, closed = 0;
    double *q = KMP_NEW(double, n);
    random_seed(10);
    for (int start = 0; start < STARTS; start++) {
        kempe_assembly *a = NULL;
        for (int k = 0; k < n; k++)
            q[k] = l.model->start.q[k].value + (l.model->start.hold[k] ? 0 : between(-3, 3) * l.system->scale[k]);
        kmp_guess guess = {q, l.model->start.hold, 0, false, 0};
        CHECK(kmp_assemble_from(l.system, &guess, &a) == KEMPE_OK);
        closed += a && a->closed;
        kempe_assembly_free(a);
    }
    printf("  wheels: %d of %d random starts close\n", closed, STARTS);
    CHECK(closed > 0.9 * STARTS);
    kmp_free(q);
    unload(&l);
}

/* -- what cannot be closed --------------------------------------------------------------------------- */

static const char short_bar[] = "kempe: 1\n"
                                "name: short\n"
                                "ground: {points: {O: [0, 0, 0], D: [2, 0, 0]}}\n"
                                "bodies:\n"
                                "  a: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, com: [0.2, 0, 0], "
                                "inertia: {zz: 1}, points: {B: [0.3, 0, 0]}}\n"
                                "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, com: [0.2, 0, 0], "
                                "inertia: {zz: 1}, points: {C: [%s, 0, 0]}}\n"
                                "  c: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, com: [0.2, 0, 0], "
                                "inertia: {zz: 1}, points: {C: [0.7, 0, 0]}}\n"
                                "loops:\n"
                                "  meet: {ball: [b.C, c.C]}\n"
                                "start: {q: {A: 40 deg, B: -20 deg, D: 150 deg}%s}\n";

static void fails_with(const char *coupler, const char *hold, double gap)
{
    char text[2048], expected[64];
    snprintf(text, sizeof text, short_bar, coupler, hold);
    loaded l = load_text(text);
    kempe_assembly *a = NULL;
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED);
    CHECK(a && !a->closed && a->culprit_count == 1 && a->culprits[0] == 0);
    CHECK(a && fabs(a->gap - gap) < 1e-3 * gap && a->gap == a->gaps[0]);
    const char *message = kempe_context_message(l.context);
    CHECK(strncmp(message, "model.yaml:9:3: ", 16) == 0);
    CHECK(strstr(message, "loop 'meet' cannot be closed"));
    snprintf(expected, sizeof expected, "gap found is %.4g m", a ? a->gap : 0);
    CHECK(strstr(message, expected));
    CHECK(!*hold == !strstr(message, "while holding A"));
    printf("  %s\n", message);
    kempe_assembly_free(a);
    unload(&l);
}

/* Stretched out from both sides the bars reach 0.3 + l + 0.7 of 2 m. With the crank held at 40 degrees its tip is
 * sqrt((2 - 0.3 cos)^2 + (0.3 sin)^2) from D. */
static void a_coupler_too_short_tells_the_gap(void)
{
    double angle = acos(-1) * 40 / 180, reach = hypot(2 - 0.3 * cos(angle), 0.3 * sin(angle));
    fails_with("0.8", "", 0.2);
    fails_with("0.4", "", 0.6);
    fails_with("0.8", ", hold: [A]", reach - 1.5);
}

/* All angles zero: a saddle of |h|, where no direction leads down. */
static void a_straight_guess_is_left(void)
{
    char text[2048];
    snprintf(text, sizeof text, short_bar, "1.2", "");
    loaded l = load_text(text);
    for (int k = 0; k < 3; k++)
        l.model->start.q[k].value = 0;
    kempe_assembly_free(assembled(&l));
    unload(&l);
}

/* Held coordinates that contradict the closures stay where they are. */
static void held_coordinates_that_cannot_be_kept(void)
{
    char text[2048];
    snprintf(text, sizeof text, short_bar, "1.2", ", hold: [A, B, D]");
    loaded l = load_text(text);
    kempe_assembly *a = NULL;
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED);
    for (int k = 0; a && k < 3; k++)
        CHECK(a->moved[k] == 0);
    CHECK(strstr(kempe_context_message(l.context), "while holding A, B, D"));
    kempe_assembly_free(a);
    unload(&l);
    snprintf(text, sizeof text, short_bar, "1.2", ", hold: [A, D]"); /* two held, one degree of freedom */
    l = load_text(text);
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "while holding A, D"));
    CHECK(a && a->moved[0] == 0 && a->moved[2] == 0);
    kempe_assembly_free(a);
    unload(&l);
}

/* A drive that begins elsewhere than the start holds its coordinate is named, and no loop. */
static void a_drive_contradicts_a_held_coordinate(void)
{
    char text[2048];
    snprintf(text, sizeof text, short_bar, "1.8", ", hold: [A]");
    strcat(text, "drives: {turn: {joint: A, angle: 70 deg + 3*t}}\n");
    loaded l = load_text(text);
    kempe_assembly *a = NULL;
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "drive 'turn' begins 30 deg away from the start of 'A'"));
    kempe_assembly_free(a);
    unload(&l);
}

/* -- redundant closures ------------------------------------------------------------------------------ */

/* Six rows of rank four: one degree of freedom. Away from closed states their rank is five. */
static void redundant_closures_assemble(void)
{
    loaded l = load("tests/models/bricard_balls.yaml");
    random_seed(10);
    for (int trial = 0; trial < 50; trial++) {
        double size = trial < 25 ? 1e-3 : 0.2;
        for (int k = 0; k < l.system->n; k++)
            l.model->start.q[k].value = between(-size, size);
        kempe_assembly *a = assembled(&l);
        kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
        kmp_partition part;
        kmp_eval_closure(eval, 0, a->q);
        CHECK(kmp_partition_init(&part, l.system, eval->jacobian, NULL, 0) == KEMPE_OK);
        CHECK(part.r == 4 && part.p == 1);
        for (int k = 0; k < l.system->n; k++)
            CHECK(fabs(a->moved[k]) < 3 * size);
        kmp_partition_free(&part);
        kmp_eval_free(eval);
        kempe_assembly_free(a);
    }
    unload(&l);
}

/* -- rates ------------------------------------------------------------------------------------------- */

static double rate_residual(const loaded *l, const kempe_assembly *a)
{
    kmp_evaluator *eval = kmp_eval_new(l->system, "tape");
    kmp_eval_closure(eval, 0, a->q);
    double worst = kmp_eval_rate_residual(eval, a->qd);
    kmp_eval_free(eval);
    return worst;
}

static void rates_are_made_consistent(void)
{
    loaded l = load("examples/four_bar/four_bar.yaml");
    kempe_assembly *a = assembled(&l);
    CHECK(!a->rates_changed && a->qd[0] == 20 && rate_residual(&l, a) < 1e-13);
    kempe_assembly_free(a);
    l.model->start.qd[1].value = 3; /* contradicts the crank's 20 rad/s */
    l.model->start.qd_given[1] = true;
    l.model->start.qd[2].value = -4;
    l.model->start.qd_given[2] = true;
    a = assembled(&l);
    char *text = NULL;
    CHECK(a->rates_changed && rate_residual(&l, a) < 1e-13);
    CHECK(kempe_assembly_print(a, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "to satisfy the closures"));
    kempe_text_free(text);
    kempe_assembly_free(a);
    unload(&l);
}

/* A plane closure between bodies that move in its plane alone: in axes that lean its rows are rounding, and so is J. */
static const char *const in_a_leaning_plane =
    "kempe: 1\n"
    "ground:\n"
    "  points: {O: {at: [0.2411, 0.0128, 0.0528], axes: {z: [-0.122, -1.138, -0.339], x: [0.9, -0.14, 0.1]}},\n"
    "           D: {at: [-0.2254, 0.3866, -0.2962], axes: {z: [-0.122, -1.138, -0.339], x: [0.9, -0.14, 0.1]}}}\n"
    "bodies:\n"
    "  a: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1},\n"
    "      points: {P: [-0.171, -0.1872, 0.0894]}}\n"
    "  b: {joint: {name: B, revolute: z, at: ground.D}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1},\n"
    "      points: {Q: [-0.4361, -0.2241, 0.3311]}}\n"
    "  c: {joint: {name: C, revolute: z, at: b.Q}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1},\n"
    "      points: {R: [0.8918, -0.0318, h]}}\n"
    "parameters: {h: %s}\n"
    "loops: {N: {planar: [a.P, c.R], axis: z}}\n"
    "start: {q: {A: %g, B: -0.1686, C: 0.615}, qd: {A: -0.7, B: 0.4, C: 1.1}}\n";

static double farthest(const double *x, double a, double b, double c)
{
    return fmax(fabs(x[0] - a), fmax(fabs(x[1] - b), fabs(x[2] - c)));
}

static void rows_of_rounding_alone_move_nothing(void)
{
    char text[2000];
    /* the height of R over D's plane that puts it into that of P, from the two points of the ground */
    const char *height =
        "0.0894 - 0.3311 + (-0.4665*0.122 + 0.3738*1.138 - 0.349*0.339)/sqrt(0.122^2 + 1.138^2 + 0.339^2)";
    for (int k = 0; k < 40; k++) {
        double angle = -1 + 0.05 * k;
        (void)snprintf(text, sizeof text, in_a_leaning_plane, height, angle);
        loaded l = load_text(text);
        kempe_assembly *a = assembled(&l);
        CHECK(a->closed && farthest(a->q, angle, -0.1686, 0.615) < 1e-12);
        CHECK(farthest(a->qd, -0.7, 0.4, 1.1) < 1e-12);
        kempe_assembly_free(a);
        unload(&l);
    }
}

/* The rows of a weld are zero at half a turn too, where they have lower rank: that is no closed position. The position
 * is found, unless a coordinate that turns the axes is held. */
static void a_weld_by_half_a_turn(void)
{
    static const char *const starts[] = {"J.4: 180 deg}, hold: [J.4, J.6",
                                         "J.5: 180 deg}, hold: [J.5, J.6",
                                         "J.4: 170 deg, J.6: 30 deg",
                                         "J.4: 60 deg",
                                         "J.4: 180 deg",
                                         "J.5: 180 deg",
                                         "J.5: 90 deg, J.4: 120 deg",
                                         "J.4: 180 deg, J.5: 90 deg",
                                         "J.4: 100 deg, J.6: 2"};
    for (int k = 0; k < 9; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nbodies: {b: {joint: {name: J, free: x, at: ground}, mass: 1,\n"
                       "  inertia: {xx: 1, yy: 1, zz: 1}, points: {Q: [0.1, 0, 0]}}}\n"
                       "ground: {points: {P: [0, 0.2, 0]}}\nloops: {W: {weld: [ground.P, b.Q]}}\nstart: {q: {%s%s\n",
                       starts[k], k < 2 ? "]}" : "}}");
        loaded l = load_text(text);
        kempe_assembly *a = NULL;
        CHECK(kmp_assemble_start(l.system, &a) == KEMPE_OK);
        if (a && a->closed) { /* the third columns of the axes, and the first ones */
            CHECK(fabs(sin(a->q[4])) < 1e-10 && fabs(sin(a->q[3])) < 1e-10 && fabs(sin(a->q[5])) < 1e-10);
            CHECK(cos(a->q[3]) * cos(a->q[4]) > 0.9 && cos(a->q[4]) * cos(a->q[5]) > 0.9);
            CHECK(a->turn < 1e-10 && a->gap < 1e-12);
        }
        if (k < 2) {
            CHECK(a && !a->closed && a->turned && a->culprit_count == 1 && a->turns[0] > 3 && a->gaps[0] < 1e-12);
            kmp_text said = {0};
            kmp_assembly_put_open(&said, a, 0);
            CHECK_TEXT(said.s, "'W' by 180 deg");
            kmp_text_free(&said);
            kempe_assembly_free(a);
            a = NULL;
            CHECK(kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED);
            CHECK_TEXT(kempe_context_message(l.context),
                       k == 0 ? "model.yaml:5:9: loop 'W' cannot be closed while holding J.4, J.6: the axes of its "
                                "points are 180 deg from parallel; turn the axes of one of them, or start from a "
                                "better guess"
                              : "model.yaml:5:9: loop 'W' cannot be closed while holding J.5, J.6: the axes of its "
                                "points are 180 deg from parallel; turn the axes of one of them, or start from a "
                                "better guess");
        }
        CHECK(k < 2 || (a && a->closed));
        kempe_assembly_free(a);
        unload(&l);
    }
}

/* The curve's value is constant where the joint keeps x: it merges with the place of the ground's point. */
/* Two spherical joints with a slide between their bodies, welded: in charts of their own, where the second is singular
 * at the start. */
static const char turned_chain[] =
    "kempe: 1\nbodies:\n"
    "  a: {joint: {name: A, spherical: x, at: ground}, mass: 1, inertia: {xx: 1, yy: 2, zz: 3},\n"
    "    points: {P: {at: [0.3, 0.1, 0.2], axes: {x: [0, 1, 0], y: [0, 0, 1]}}}}\n"
    "  b: {joint: {name: B, prismatic: [0.6, 0, 0.8], at: a.P}, mass: 1}\n"
    "  c: {joint: {name: C, spherical: x, at: b}, mass: 1, inertia: {xx: 1, yy: 2, zz: 3},\n"
    "    points: {Q: {at: [0.2, 0.1, 0], axes: {x: [0, 0, 1], y: [1, 0, 0]}}}}\n"
    "ground: {points: {R: {at: [0.1, 0.4, 0.3], axes: {x: [0.6, 0.8, 0], y: [-0.8, 0.6, 0]}}}}\n"
    "loops: {W: {weld: [c.Q, ground.R]}%s}\n"
    "start: {q: {A.1: %g, A.2: 1.570796326794896, A.3: 0.3, C.1: %g, C.2: 1.4}}\n";

/* The rows of rotation vectors: their derivatives are differences of the rows, and they differ from the closures' own
 * by the angle over its sine. */
static void rows_of_rotation_vectors(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text, turned_chain, ", S: {prismatic: [a.P, c.Q], axis: [1, 0, 0]}", 0.2, 0.4);
    loaded l = load_text(text);
    CHECK_TEXT(kempe_context_message(l.context), "");
    const kempe_system *s = l.system;
    kmp_evaluator *eval = kmp_eval_new_of_closures(s);
    kmp_arena arena = {0};
    kmp_rotation_vectors v;
    double q[16], trial[16], jacobian[256], h[2][32], own[32], worst = 0;
    random_seed(11);
    CHECK(eval && kmp_rotation_vectors_init(&v, s, &arena) && v.count == 2 && s->n <= 16 && s->m <= 32);
    for (int k = 0; k < s->chart_count; k++) {
        double from[16];
        for (int i = 0; i < s->n; i++)
            from[i] = between(-3, 3);
        kmp_chart_center(s, k, eval->chart, from, NULL, NULL);
    }
    kmp_eval_set_charts(eval, eval->chart);
    for (int trials = 0; trials < 20; trials++) {
        for (int k = 0; k < s->n; k++)
            q[k] = between(-3, 3);
        kmp_eval_closure(eval, 0, q);
        memcpy(own, eval->h, (size_t)s->m * sizeof *own);
        kmp_rotation_vectors_lend(&v, eval);
        kmp_eval_dense_jacobian(eval, jacobian);
        for (int r = 0; r < s->m; r++)
            if (v.component[r] >= 0)
                CHECK_NEAR(eval->h[r] * sin(v.angle[v.at[r]]) / v.angle[v.at[r]], own[r], 1e-14);
            else
                CHECK(eval->h[r] == own[r]);
        for (int k = 0; k < s->n; k++) {
            for (int side = 0; side < 2; side++) {
                memcpy(trial, q, sizeof trial);
                trial[k] += side ? 1e-6 : -1e-6;
                kmp_eval_closure(eval, 0, trial);
                kmp_rotation_vectors_lend(&v, eval);
                memcpy(h[side], eval->h, (size_t)s->m * sizeof *own);
            }
            for (int r = 0; r < s->m; r++)
                worst = check_max(worst, fabs((h[1][r] - h[0][r]) / 2e-6 - jacobian[r + k * s->m]));
        }
    }
    printf("  derivatives of rotation vectors: within %.1e of differences\n", worst);
    CHECK(worst < 1e-7);
    kmp_arena_free(&arena);
    kmp_eval_free(eval);
    unload(&l);
}

/* From many turned starts the rows of the closures alone find half a turn; the position found has the axes as they must
 * be, here by the poses of both points. */
static void turned_starts_close(void)
{
    int closed = 0;
    random_seed(3);
    for (int k = 0; k < 40; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text, turned_chain, "", between(-3, 3), between(-3, 3));
        loaded l = load_text(text);
        kempe_assembly *a = NULL;
        kmp_pose poses[8], at[2];
        double worst = 0;
        CHECK(kmp_assemble_start(l.system, &a) == KEMPE_OK && l.model->body_count <= 8);
        closed += a && a->closed;
        if (a && a->closed) {
            kmp_pose_all(l.model, a->q, poses);
            for (int end = 0; end < 2; end++)
                kmp_pose_of_point(l.model, poses, a->q, l.model->closures[0].point[end], &at[end]);
            for (int i = 0; i < 9; i++)
                worst = check_max(worst, fabs(at[0].r[i / 3][i % 3] - at[1].r[i / 3][i % 3]));
            CHECK(worst < 1e-11);
        }
        kempe_assembly_free(a);
        unload(&l);
    }
    printf("  %d of 40 turned starts close\n", closed);
    CHECK(closed == 40);
}

static void a_curve_whose_value_is_constant(void)
{
    loaded l = load_text("kempe: 1\nground: {points: {O: [0.1, 0.5312, 0.5]}}\nbodies:\n"
                         "  b: {joint: {name: A, motions: [T3, -T2, R1], at: ground.O}, mass: 1,\n"
                         "      inertia: {xx: 1, yy: 1, zz: 1}, points: {L: [0.3, 0.2, 0.1]}}\n"
                         "tables: {f: {x: [-1, 0, 1, 2], y: [0, 0.2, 0.1, 0.4]}}\n"
                         "loops: {K: {point_on_curve: [ground.O, b.L], table: f}}\n");
    kempe_assembly_free(assembled(&l));
    unload(&l);
}

int main(void)
{
    TEST(returns_to_the_printed_state);
    TEST(returns_to_the_slider_crank);
    TEST(assembles_from_a_rough_guess);
    TEST(wheels_close_from_anywhere);
    TEST(a_coupler_too_short_tells_the_gap);
    TEST(a_weld_by_half_a_turn);
    TEST(rows_of_rotation_vectors);
    TEST(turned_starts_close);
    TEST(a_straight_guess_is_left);
    TEST(held_coordinates_that_cannot_be_kept);
    TEST(a_drive_contradicts_a_held_coordinate);
    TEST(redundant_closures_assemble);
    TEST(rates_are_made_consistent);
    TEST(rows_of_rounding_alone_move_nothing);
    TEST(a_curve_whose_value_is_constant);
    return check_report();
}
