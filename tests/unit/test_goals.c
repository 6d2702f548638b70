/* SPDX-License-Identifier: BSD-3-Clause */
/* Goals of the start: the nearest closed position against searches of the test's own over positions written down in
 * closed form, against plane geometry, and against what scipy finds. */
#include "constraints/closing/assemble.h"
#include "constraints/closing/goals.h"
#include "loaded.h"
#include "model/data/model.h"
#include "random.h"
#include "testing.h"
#include <kempe/build.h>
#include <kempe/check.h>
#include <stdlib.h>

/* Closed, and at a minimum. */
static kempe_assembly *assembled(const loaded *l)
{
    kempe_assembly *a = NULL;
    CHECK(kempe_assembly_new(l->system, &a) == KEMPE_OK);
    CHECK_TEXT(kempe_context_message(l->context), "");
    CHECK(a && a->closed && a->goals.end == KMP_GOALS_MINIMUM);
    CHECK(a && a->residual < 1e-14 && a->goals.slope < 1e-10);
    return a;
}

/* The least f over lo .. hi, where f falls and then rises. */
static double golden(double (*f)(double x, const void *user), const void *user, double lo, double hi)
{
    const double ratio = (sqrt(5) - 1) / 2;
    double a = hi - ratio * (hi - lo), b = lo + ratio * (hi - lo), fa = f(a, user), fb = f(b, user);
    for (int k = 0; k < 60; k++) {
        if (fa < fb) {
            hi = b;
            b = a;
            fb = fa;
            fa = f(a = hi - ratio * (hi - lo), user);
        } else {
            lo = a;
            a = b;
            fa = fb;
            fb = f(b = lo + ratio * (hi - lo), user);
        }
    }
    return (lo + hi) / 2;
}

/* -- a four-bar -------------------------------------------------------------------------------------- */

static const char four_bar[] =
    "kempe: 1\n"
    "ground: {points: {D: [0.9, 0, 0]}}\n"
    "bodies:\n"
    "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {B: [0.3, 0, 0]}}\n"
    "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, points: {C: [0.8, 0, 0], P: [0.4, 0.2, "
    "0]}}\n"
    "  c: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, points: {C: [0.7, 0, 0]}}\n"
    "loops: {C: {ball: [b.C, c.C]}}\n"
    "start: {q: {A: 1, B: -0.7, D: 1.9}%s}\n";

/* Goals of B, of D and of the point P; the characteristic length is the coupler's. */
typedef struct wanted {
    double b, d, p[3], weight[3];
} wanted;

/* The joints above the line from the crank's tip to D, at a crank angle. */
static void four_bar_at(double a, double q[3])
{
    double bx = 0.3 * cos(a), by = 0.3 * sin(a), x = 0.9 - bx, y = -by, far = hypot(x, y);
    double along = (0.64 - 0.49 + far * far) / (2 * far), across = sqrt(0.64 - along * along);
    double cx = bx + (along * x - across * y) / far, cy = by + (along * y + across * x) / far;
    q[0] = a;
    q[1] = remainder(atan2(cy - by, cx - bx) - a, 2 * acos(-1));
    q[2] = atan2(cy, cx - 0.9);
}

static double four_bar_cost(double a, const void *user)
{
    const wanted *w = user;
    double q[3], e[3];
    four_bar_at(a, q);
    double turn = a + q[1], px = 0.3 * cos(a) + 0.4 * cos(turn) - 0.2 * sin(turn),
           py = 0.3 * sin(a) + 0.4 * sin(turn) + 0.2 * cos(turn);
    e[0] = q[1] - w->b;
    e[1] = q[2] - w->d;
    e[2] = hypot(hypot(px - w->p[0], py - w->p[1]), w->p[2]) / 0.8;
    return w->weight[0] * e[0] * e[0] + w->weight[1] * e[1] * e[1] + w->weight[2] * e[2] * e[2];
}

/* From crank angles of half a turn around the start the valley that leads down from there is the one that is found. */
static void a_four_bar_comes_nearest(void)
{
    double worst = 0;
    int most = 0;
    random_seed(21);
    for (int trial = 0; trial < 60; trial++) {
        wanted w = {between(-1.5, -0.2),
                    between(0.8, 2.2),
                    {between(0, 0.6), between(0, 0.6), between(-0.1, 0.1)},
                    {between(0, 2), between(0, 2), trial % 3 ? between(0, 5) : 0}};
        char goals[512], text[2048];
        snprintf(goals, sizeof goals,
                 ", goals: {B: {value: %.17g, weight: %.17g}, D: {value: %.17g, weight: %.17g}, "
                 "position(b.P): {value: [%.17g, %.17g, %.17g], weight: %.17g}}",
                 w.b, w.weight[0], w.d, w.weight[1], w.p[0], w.p[1], w.p[2], w.weight[2]);
        snprintf(text, sizeof text, four_bar, goals);
        loaded l = load_text(text);
        CHECK(l.system->length == 0.8);
        kempe_assembly *a = assembled(&l);
        double exact[3], a0 = a->q[0], best = golden(four_bar_cost, &w, a0 - 0.05, a0 + 0.05);
        four_bar_at(a0, exact);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(a->q[k], exact[k], 1e-13); /* the branch of the start */
        CHECK(fabs(best - a0) < 2e-7);            /* a golden section sees no more than the root of rounding */
        CHECK_NEAR(a->goals.distance * a->goals.distance, four_bar_cost(a0, &w), 1e-13);
        CHECK_NEAR(a->goals.distance * a->goals.distance, four_bar_cost(best, &w), 1e-13);
        worst = check_max(worst, fabs(best - a0));
        most = a->goals.steps > most ? a->goals.steps : most;
        kempe_assembly_free(a);
        unload(&l);
    }
    printf("  60 four-bars: within %.1e, at most %d steps\n", worst, most);
    CHECK(most <= 30);
}

static void what_can_be_reached_is_reached(void)
{
    double q[3];
    char text[2048], goals[256];
    four_bar_at(2, q);
    snprintf(goals, sizeof goals, ", goals: {B: {value: %.17g, weight: 1e-3}, D: {value: %.17g, weight: 1e6}}", q[1],
             q[2]);
    snprintf(text, sizeof text, four_bar, goals);
    loaded l = load_text(text);
    kempe_assembly *a = assembled(&l);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(a->q[k], q[k], 1e-10);
    CHECK(a->goals.distance < 1e-10);
    kempe_assembly_free(a);
    unload(&l);
}

/* With the crank held nothing is left to choose: what remains is told. */
static void what_is_held_stays(void)
{
    const wanted w = {0, 0, {1, 1, 0}, {1, 0, 1}};
    double q[3];
    char text[2048], *out = NULL;
    four_bar_at(1, q);
    snprintf(text, sizeof text, four_bar, ", hold: [A], goals: {B: 0, position(b.P): [1, 1, 0]}");
    loaded l = load_text(text);
    kempe_assembly *a = assembled(&l);
    CHECK(a->moved[0] == 0 && a->q[0] == 1 && a->goals.steps == 0);
    CHECK_NEAR(a->goals.value[0], q[1], 1e-13);
    CHECK_NEAR(a->goals.distance, sqrt(four_bar_cost(1, &w)), 1e-13);
    CHECK(kempe_assembly_print(a, KEMPE_JSON, &out) == KEMPE_OK);
    CHECK(out && strstr(out, "\"goals\"") && strstr(out, "\"end\": \"minimum\"") && strstr(out, "\"remains\": -0."));
    kempe_text_free(out);
    CHECK(kempe_assembly_print(a, KEMPE_TEXT, &out) == KEMPE_OK);
    CHECK(out && strstr(out, "remains") && strstr(out, "a minimum after 0 steps"));
    kempe_text_free(out);
    kempe_assembly_free(a);
    unload(&l);
}

/* -- more than one degree of freedom ----------------------------------------------------------------- */

/* A five-bar: pivots (0, 0) and (1, 0), cranks 0.5 and 0.4, bars 0.7 and 0.8. */
static const char five_bar[] =
    "kempe: 1\n"
    "ground: {points: {E: [1, 0, 0]}}\n"
    "bodies:\n"
    "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {B: [0.5, 0, 0]}}\n"
    "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, points: {C: [0.7, 0, 0]}}\n"
    "  e: {joint: {name: E, revolute: z, at: ground.E}, mass: 1, inertia: {zz: 1}, points: {D: [0.4, 0, 0]}}\n"
    "  d: {joint: {name: D, revolute: z, at: e.D}, mass: 1, inertia: {zz: 1}, points: {C: [0.8, 0, 0]}}\n"
    "loops:\n  C: {ball: [b.C, d.C]}\n%s"
    "start: {q: {A: 1.2, B: -0.9, E: 1.5, D: 1}, goals: {A: 0.7, B: {value: -1.4, weight: 3}, D: 0.2,\n"
    "  position(b.C): {value: [0.2, 1.4, 0], weight: 2}}}\n";

typedef struct pair {
    double a;
} pair;

static double five_bar_cost(double e, const void *user)
{
    double a = ((const pair *)user)->a, bx = 0.5 * cos(a), by = 0.5 * sin(a);
    double dx = 1 + 0.4 * cos(e), dy = 0.4 * sin(e), x = dx - bx, y = dy - by, far = hypot(x, y);
    double along = (0.49 - 0.64 + far * far) / (2 * far), across = sqrt(0.49 - along * along);
    double cx = bx + (along * x - across * y) / far, cy = by + (along * y + across * x) / far;
    double b = remainder(atan2(cy - by, cx - bx) - a, 2 * acos(-1));
    double d = remainder(atan2(cy - dy, cx - dx) - e, 2 * acos(-1));
    return pow(a - 0.7, 2) + 3 * pow(b + 1.4, 2) + pow(d - 0.2, 2) + 2 * (pow(cx - 0.2, 2) + pow(cy - 1.4, 2)) / 0.64;
}

static double best_e(double a)
{
    pair p = {a};
    return golden(five_bar_cost, &p, 0.5, 2.5);
}

static double inner_best(double a, const void *user)
{
    (void)user;
    pair p = {a};
    return five_bar_cost(best_e(a), &p);
}

/* One search within the other; and scipy 1.17.1: SLSQP with ftol 1e-16, the four coordinates and the two closures as
 * they stand above, from the same guess, gives A 1.85925243, E 2.01327886, distance 1.5213194902766485. */
static void a_five_bar_comes_nearest(void)
{
    char text[2048];
    double a0 = golden(inner_best, NULL, 0.5, 2), e0 = best_e(a0);
    snprintf(text, sizeof text, five_bar, "");
    loaded l = load_text(text);
    CHECK(l.system->length == 0.8);
    kempe_assembly *a = assembled(&l);
    printf("  five-bar: A %.12f, E %.12f, distance %.12f after %d steps\n", a->q[0], a->q[2], a->goals.distance,
           a->goals.steps);
    CHECK(a->goals.steps <= 12); /* the second derivatives are right: convergence is quadratic */
    CHECK_NEAR(a->q[0], a0, 1e-6);
    CHECK_NEAR(a->q[2], e0, 1e-6);
    CHECK_NEAR(a->goals.distance * a->goals.distance, inner_best(a0, NULL), 1e-12);
    kempe_assembly_free(a);
    unload(&l);
}

/* Closures that move are taken as they are at t = 0, whatever their rates. */
static void moving_closures_stand_still(void)
{
    static const char *const closures[] = {"  K: {constraint: \"q(A) + q(B) - 0.3\", power: 0}\n",
                                           "  K: {constraint: \"q(A)*exp(9*t) + q(B) - 0.3 + 20*t^2\", power: 0}\n"};
    double q[2][4];
    int steps[2];
    for (int k = 0; k < 2; k++) {
        char text[2048];
        snprintf(text, sizeof text, five_bar, closures[k]);
        loaded l = load_text(text);
        kempe_assembly *a = assembled(&l);
        memcpy(q[k], a->q, sizeof q[k]);
        steps[k] = a->goals.steps;
        kempe_assembly_free(a);
        unload(&l);
    }
    CHECK(steps[0] == steps[1] && steps[0] <= 12);
    for (int k = 0; k < 4; k++)
        CHECK_NEAR(q[0][k], q[1][k], 1e-12);
}

/* -- geometry ---------------------------------------------------------------------------------------- */

/* Without closures: within reach the tip gets there; beyond it the arm is stretched towards it. */
static void an_arm_reaches(void)
{
    loaded l = load("tests/models/arm.yaml");
    kempe_assembly *a = assembled(&l);
    CHECK(a->goals.distance < 1e-12);
    CHECK_NEAR(a->goals.value[0], 0.5, 1e-12);
    CHECK_NEAR(a->goals.value[1], 0.3, 1e-12);
    kempe_assembly_free(a);
    l.model->start.goals[0].value[0].value = 3;
    l.model->start.goals[0].value[1].value = 4;
    a = assembled(&l);
    CHECK_NEAR(a->q[0], atan2(4, 3), 1e-10);
    CHECK_NEAR(a->q[1], 0, 1e-10);
    CHECK_NEAR(a->goals.distance, (5 - 0.7) / 0.4, 1e-13);
    kempe_assembly_free(a);
    l.model->start.q[0].value = atan2(4, 3) - acos(-1); /* as far away as can be: no slope, but no minimum */
    l.model->start.q[1].value = 0;
    a = assembled(&l);
    CHECK_NEAR(a->goals.distance, (5 - 0.7) / 0.4, 1e-13);
    kempe_assembly_free(a);
    unload(&l);
}

static void included_goals_keep_their_names(void)
{
    loaded l = load("tests/models/two_arms.yaml");
    kempe_assembly *a = assembled(&l);
    CHECK(a->goals.count == 7 && a->goals.distance < 1e-10);
    CHECK_NEAR(a->goals.value[0], 0.7, 1e-10);
    CHECK_NEAR(a->goals.value[1], 0.2, 1e-10);
    CHECK_NEAR(a->goals.value[4], 0.5, 1e-10); /* in ground axes, though the arm rides on the base */
    kempe_assembly_free(a);
    unload(&l);
}

/* -- redundant closures ------------------------------------------------------------------------------ */

static double distance_at(const loaded *l, int held, double value, const double *q)
{
    kempe_assembly *a = NULL;
    bool hold[16] = {false};
    double from[16], distance = NAN;
    memcpy(from, q, (size_t)l->system->n * sizeof *from);
    from[held] = value;
    hold[held] = true;
    kmp_guess guess = {from, hold, 0, false, 0};
    if (kmp_assemble_from(l->system, &guess, &a) == KEMPE_OK && a->closed &&
        kmp_goals_measure(l->system, a->q, &a->goals))
        distance = a->goals.distance;
    kempe_assembly_free(a);
    return distance;
}

/* Bricard's six-bar, six rows of rank four: to either side of what is found it is farther, by the square of the way. */
static void redundant_closures_have_a_nearest_position(void)
{
    static kmp_goal goals[3];
    loaded l = load("tests/models/bricard_balls.yaml");
    const int n = l.system->n;
    for (int k = 0; k < 3; k++) {
        goals[k] = (kmp_goal){.motion = k, .point = -1, .width = 1};
        goals[k].value[0].value = 0.6 - 0.5 * k;
        goals[k].weight[0].value = 1 + k;
        CHECK(!l.model->start.hold[k]);
    }
    l.model->start.goals = goals;
    l.model->start.goal_count = 3;
    kempe_assembly *a = assembled(&l);
    double at = a->goals.distance;
    printf("  Bricard: distance %.6f after %d steps, q1 %.6f\n", at, a->goals.steps, a->q[0]);
    CHECK(n == 5 && a->goals.steps <= 12);
    for (int side = -1; side <= 1; side += 2) {
        double small = distance_at(&l, 0, a->q[0] + side * 1e-3, a->q) - at;
        double large = distance_at(&l, 0, a->q[0] + side * 2e-3, a->q) - at;
        CHECK(small > 0 && fabs(large / small - 4) < 0.05);
    }
    kempe_assembly_free(a);
    unload(&l);
}

/* -- what goes wrong --------------------------------------------------------------------------------- */

/* x^2 = y^3 ends in a cusp, where h has no slope: y cannot come below 0. */
static void a_way_that_ends_is_reported(void)
{
    loaded l = load_text("kempe: 1\n"
                         "bodies:\n"
                         "  a: {joint: {name: X, prismatic: x, at: ground}, mass: 1}\n"
                         "  b: {joint: {name: Y, prismatic: y, at: ground}, mass: 1}\n"
                         "loops: {K: {constraint: \"q(X)^2 - q(Y)^3\", power: 2}}\n"
                         "start: {q: {X: 1, Y: 1}, goals: {Y: -1}}\n");
    kempe_assembly *a = NULL;
    char *out = NULL;
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED);
    const char *message = kempe_context_message(l.context);
    printf("  %s\n", message);
    CHECK(strstr(message, "the loops are closed, but the goals are not reached") && strstr(message, "'Y' differs by "));
    CHECK(a && a->closed && a->goals.end == KMP_GOALS_SINGULAR && fabs(a->q[1]) < 1e-2);
    CHECK(kempe_assembly_print(a, KEMPE_JSON, &out) == KEMPE_OK);
    CHECK(out && strstr(out, "\"status\": \"failed\"") && strstr(out, "\"end\": \"singular\""));
    kempe_text_free(out);
    kempe_assembly_free(a);
    kempe_check *check = NULL;
    CHECK(kempe_check_new(l.system, &check) == KEMPE_OK); /* it is a mechanism all the same */
    kempe_check_free(check);
    unload(&l);
}

/* The message on loops that cannot be closed comes first; the goals are measured at the best position. */
static void an_open_loop_goes_first(void)
{
    char text[2048];
    snprintf(text, sizeof text, four_bar, ", hold: [A, D], goals: {B: 3}");
    loaded l = load_text(text);
    kempe_assembly *a = NULL;
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "loop 'C' cannot be closed"));
    CHECK(a && a->goals.end == KMP_GOALS_NONE && a->goals.value[0] == a->q[1]);
    CHECK_NEAR(a->goals.distance, fabs(a->q[1] - 3), 1e-15);
    kempe_assembly_free(a);
    unload(&l);
}

/* A graph of joints: the one with a goal has a coordinate; without it C, which has no start value, is cut. */
static void a_joint_with_a_goal_is_not_cut(void)
{
    static const char text[] = "kempe: 1\nground: {points: {O: [0, 0, 0], D: [0.9, 0, 0]}}\n"
                               "bodies:\n"
                               "  a: {mass: 1, inertia: {zz: 1}, points: {O: [0, 0, 0], B: [0.3, 0, 0]}}\n"
                               "  b: {mass: 1, inertia: {zz: 1}, points: {B: [0, 0, 0], C: [0.8, 0, 0]}}\n"
                               "  c: {mass: 1, inertia: {zz: 1}, points: {D: [0, 0, 0], C: [0.7, 0, 0]}}\n"
                               "joints:\n"
                               "  A: {revolute: [ground.O, a.O]}\n"
                               "  B: {revolute: [a.B, b.B]}\n"
                               "  C: {revolute: [b.C, c.C]}\n"
                               "  D: {revolute: [ground.D, c.D]}\n"
                               "start: {q: {A: 1, B: -0.7, D: 1.9}%s}\n";
    for (int goal = 0; goal < 2; goal++) {
        char whole[2048];
        int count = 0;
        snprintf(whole, sizeof whole, text, goal ? ", goals: {C: 1.5}" : "");
        loaded l = load_text(whole);
        for (int k = 0; l.model && k < l.model->motion_count; k++)
            count += strcmp(l.model->motions[k].name, "C") == 0;
        CHECK(l.model && l.model->motion_count == 3 && count == goal);
        kempe_assembly *a = NULL;
        CHECK(kempe_assembly_new(l.system, &a) == KEMPE_OK);
        if (goal && a)
            CHECK_NEAR(a->goals.value[0], 1.5, 1e-10);
        kempe_assembly_free(a);
        unload(&l);
    }
}

/* In code a goal is text of the section `start`, as in a file. */
static void a_built_model_has_goals(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_body_def arm = kempe_body_default("arm");
    char *text = NULL;
    arm.mass = kempe_value(1);
    arm.inertia[2] = kempe_value(1);
    CHECK(kempe_model_new(context, "built", &model) == KEMPE_OK);
    CHECK(kempe_model_add_body(model, &arm) == KEMPE_OK);
    CHECK(kempe_model_add_text(model, "start", "goals", "{arm: {value: 30 deg, weight: 2}}") == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_OK);
    CHECK(kempe_model_print(model, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "goals: value, weight\n  arm: 0.5235987755982988"));
    kempe_text_free(text);
    loaded l = load_finish((loaded){context, model, NULL});
    kempe_assembly *a = assembled(&l);
    CHECK_NEAR(a->q[0], acos(-1) / 6, 1e-15);
    kempe_assembly_free(a);
    unload(&l);
}

int main(void)
{
    TEST(a_four_bar_comes_nearest);
    TEST(what_can_be_reached_is_reached);
    TEST(what_is_held_stays);
    TEST(a_five_bar_comes_nearest);
    TEST(moving_closures_stand_still);
    TEST(an_arm_reaches);
    TEST(included_goals_keep_their_names);
    TEST(redundant_closures_have_a_nearest_position);
    TEST(a_way_that_ends_is_reported);
    TEST(an_open_loop_goes_first);
    TEST(a_joint_with_a_goal_is_not_cut);
    TEST(a_built_model_has_goals);
    return check_report();
}
