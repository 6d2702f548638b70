/* SPDX-License-Identifier: BSD-3-Clause */
/* Beads on curves that are given by expressions, against closed forms, arc lengths and an equation of motion of the
 * test's own. A bead moves freely in its plane or in space; the curve is all that holds it. */
#include "constraints/closing/assemble.h"
#include "constraints/evaluation/evaluator.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/check.h>
#include <stdlib.h>

enum { MOST = 8 };

typedef struct end {
    int n, m;
    double q[MOST], qd[MOST], lambda[MOST], force[3];
} end;

/* `motions` of a bead of mass 2 on `closure`, with a start and a field of gravity; on one formulation. */
static end run(const char *motions, const char *closure, const char *start, const char *gravity,
               const char *formulation, double t_end)
{
    char text[1024];
    kempe_trajectory *t = NULL;
    kempe_run_options settings = {0};
    end e = {0};
    snprintf(text, sizeof text,
             "kempe: 1\ngravity: %s\nparameters: {a: 300 mm, b: 200 mm, x: 17}\nground: {points: {O: [0, 0, 0]}}\n"
             "bodies: {bead: {joint: {name: J, motions: [%s], at: ground}, mass: 2, points: {P: [0, 0, 0]}}}\n"
             "loops: {C: {point_on_curve: [ground.O, bead.P], %s}}\nstart: {%s}\n"
             "run: {outputs: [q, qd, lambda, reaction(C)]}\n",
             gravity, motions, closure, start);
    settings.formulation = formulation;
    settings.integrator = independent_integrator(formulation);
    settings.t_end = settings.output_step = t_end;
    settings.rtol = 1e-11;
    loaded l = load_text(text);
    if (l.system && kempe_simulate(l.system, &settings, &t) == KEMPE_OK) {
        int row = kempe_trajectory_row_count(t) - 1;
        e.n = l.system->n;
        e.m = l.system->m;
        memcpy(e.q, kempe_trajectory_q(t, row), (size_t)e.n * sizeof *e.q);
        memcpy(e.qd, kempe_trajectory_qd(t, row), (size_t)e.n * sizeof *e.qd);
        memcpy(e.lambda, kempe_trajectory_lambda(t, row), (size_t)e.m * sizeof *e.lambda);
        kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
        memcpy(e.force, kmp_eval_reactions(eval, t_end, e.q, e.lambda), sizeof e.force);
        kmp_eval_free(eval);
    } else {
        printf("%s\n%s\n", text, kempe_context_message(l.context));
        CHECK(e.n > 0);
    }
    kempe_trajectory_free(t);
    unload(&l);
    return e;
}

/* -- an ellipse -------------------------------------------------------------------------------------- */

/* Way along the ellipse (a cos s, b sin s) up to s: Simpson's rule, exact to rounding for a periodic integrand. */
static double ellipse_way(double s)
{
    enum { PARTS = 4000 };
    double sum = 0;
    for (int k = 0; k <= PARTS; k++) {
        double at = s * k / PARTS, weight = k == 0 || k == PARTS ? 1 : k % 2 ? 4 : 2;
        sum += weight * hypot(0.3 * sin(at), 0.2 * cos(at));
    }
    return sum * s / (3 * PARTS);
}

/* Without gravity the speed stays; more than two turns, through both upright tangents each. The force is m v^2/r. */
static void a_bead_goes_round_an_ellipse(void)
{
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    const double v = 0.7, t_end = 5.3, tolerance[] = {1e-9, 1e-9, 1e-6};
    double lo = 0, hi = 30;
    while (hi - lo > 1e-15 * hi) { /* the angle at which the way is v t */
        double mid = (lo + hi) / 2;
        if (mid == lo || mid == hi)
            break;
        *(ellipse_way(mid) < v * t_end ? &lo : &hi) = mid;
    }
    CHECK(lo > 4 * 3.1416);
    double x = 0.3 * cos(lo), y = 0.2 * sin(lo), slope[2] = {2 * x / 0.09, 2 * y / 0.04};
    double size = hypot(slope[0], slope[1]), bend = 0.3 * 0.2 / pow(hypot(0.3 * sin(lo), 0.2 * cos(lo)), 3);
    for (int k = 0; k < 3; k++) {
        end e = run("T1, T2", "curve: \"x^2/a^2 + y^2/b^2 - 1\", power: 0", "q: {J.1: 0.3}, qd: {J.2: 0.7}",
                    "[0, 0, 0]", formulations[k], t_end);
        CHECK(e.n == 2 && e.m == 1);
        CHECK_NEAR(e.q[0], x, tolerance[k]);
        CHECK_NEAR(e.q[1], y, tolerance[k]);
        CHECK_NEAR(hypot(e.qd[0], e.qd[1]), v, tolerance[k]);
        CHECK_NEAR(-e.lambda[0] * size, 2 * v * v * bend, 1e2 * tolerance[k]);
        CHECK_NEAR(e.force[0], e.lambda[0] * slope[0], 1e2 * tolerance[k]);
        CHECK_NEAR(e.force[1], e.lambda[0] * slope[1], 1e2 * tolerance[k]);
        CHECK(e.force[2] == 0);
    }
}

/* From its centre, where the expression has no slope, and from anywhere. */
static void a_bead_finds_its_ellipse(void)
{
    for (int k = 0; k < 40; k++) {
        char text[512];
        kempe_assembly *a = NULL;
        double x = k ? 0.5 * cos(k) : 0, y = k ? 0.1 * (k % 7) * sin(k) : 0;
        snprintf(text, sizeof text,
                 "kempe: 1\nground: {points: {O: [0, 0, 0]}}\n"
                 "bodies: {bead: {joint: {name: J, motions: [T1, T2], at: ground}, mass: 2, points: {P: [0, 0, 0]}}}\n"
                 "loops: {C: {point_on_curve: [ground.O, bead.P], curve: \"x^2/0.09 + y^2/0.04 - 1\", power: 0}}\n"
                 "start: {q: {J.1: %.17g, J.2: %.17g}}\n",
                 x, y);
        loaded l = load_text(text);
        CHECK(l.system && kempe_assembly_new(l.system, &a) == KEMPE_OK);
        if (a)
            CHECK_NEAR(pow(a->q[0] / 0.3, 2) + pow(a->q[1] / 0.2, 2), 1, 1e-14);
        kempe_assembly_free(a);
        unload(&l);
    }
}

/* -- graphs of functions ----------------------------------------------------------------------------- */

/* y = f(x), f = sin(x/0.2)/10: (1 + f'^2) x'' + f' f'' x'^2 + g f' = 0. */
static void wave(const double s[2], double rate[2])
{
    double f1 = 0.5 * cos(s[0] / 0.2), f2 = -2.5 * sin(s[0] / 0.2);
    rate[0] = s[1];
    rate[1] = -(f1 * f2 * s[1] * s[1] + 9.81 * f1) / (1 + f1 * f1);
}

static void runge_kutta(double s[2], double step)
{
    double k[4][2], at[2];
    static const double part[] = {0.5, 0.5, 1};
    wave(s, k[0]);
    for (int i = 0; i < 3; i++) {
        for (int c = 0; c < 2; c++)
            at[c] = s[c] + part[i] * step * k[i][c];
        wave(at, k[i + 1]);
    }
    for (int c = 0; c < 2; c++)
        s[c] += step * (k[0][c] + 2 * k[1][c] + 2 * k[2][c] + k[3][c]) / 6;
}

static void a_bead_rides_a_wave(void)
{
    double s[2] = {0, 2.5};
    for (int k = 0; k < 20000; k++)
        runge_kutta(s, 1e-4);
    CHECK(s[0] > 2); /* over some crests */
    for (int k = 0; k < 2; k++) {
        end e = run("T1, T2", k ? "curve: \"y - sin(x/0.2)/10\"" : "y: \"0.1*sin(x/0.2)\"",
                    "q: {J.1: 0}, hold: [J.1], qd: {J.1: 2.5}", "[0, -9.81, 0]", NULL, 2);
        double f1 = 0.5 * cos(e.q[0] / 0.2);
        CHECK_NEAR(e.q[0], s[0], 1e-8);
        CHECK_NEAR(e.qd[0], s[1], 1e-8);
        CHECK_NEAR(e.q[1], 0.1 * sin(e.q[0] / 0.2), 1e-13);
        CHECK_NEAR(e.force[0], -f1 * e.lambda[0], 1e-12);
        CHECK_NEAR(e.force[1], e.lambda[0], 1e-12);
    }
}

/* Down a helix about the axis x: the acceleration is constant, g/(1 + (r/c)^2). */
static void a_bead_slides_down_a_helix(void)
{
    end e = run("T1, T2, T3", "y: \"b*cos(x/0.1)\", z: \"b*sin(x/0.1)\"", "q: {J.1: 0, J.2: 0.2}", "[-9.81, 0, 0]",
                NULL, 1);
    double x = -9.81 / (1 + 4) / 2;
    CHECK(e.m == 2);
    CHECK_NEAR(e.q[0], x, 1e-9);
    CHECK_NEAR(e.q[1], 0.2 * cos(x / 0.1), 1e-8);
    CHECK_NEAR(e.q[2], 0.2 * sin(x / 0.1), 1e-8);
}

/* -- surfaces ---------------------------------------------------------------------------------------- */

/* A ball and a plane through its centre meet in a great circle; the ball alone holds as a spherical pendulum. */
static void two_surfaces_meet_in_a_curve(void)
{
    end e = run("T1, T2, T3", "curve: [\"(x^2 + y^2 + z^2 - 1)/2\", \"x + z\"], power: 1",
                "q: {J.2: 1}, qd: {J.1: 1, J.3: -1}", "[0, 0, 0]", NULL, 3);
    double turn = sqrt(2) * 3;
    CHECK(e.m == 2);
    CHECK_NEAR(e.q[0], sin(turn) / sqrt(2), 1e-9);
    CHECK_NEAR(e.q[1], cos(turn), 1e-9);
    CHECK_NEAR(e.q[2], -sin(turn) / sqrt(2), 1e-9);
    e = run("T1, T2, T3", "curve: \"x^2 + y^2 + z^2 - 1\", power: 2", "q: {J.3: -1}, qd: {J.1: 0.5}", "[0, 0, -9.81]",
            NULL, 1);
    end p = run("T1, T2, T3", "curve: [\"x^2 + y^2 + z^2 - 1\", y], power: 2", "q: {J.3: -1}, qd: {J.1: 0.5}",
                "[0, 0, -9.81]", NULL, 1);
    CHECK(e.m == 1);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(e.q[k], p.q[k], 1e-9);
}

/* A wave that travels under a follower; the x of the model's parameters is not that of the curve. */
static void a_curve_may_move(void)
{
    end e = run("T2", "y: \"a*sin(x/0.2 - 3*t)\"", "q: {J: 0}", "[0, -9.81, 0]", NULL, 1.5);
    CHECK_NEAR(e.q[0], 0.3 * sin(-4.5), 1e-12);
    CHECK_NEAR(e.qd[0], -0.9 * cos(-4.5), 1e-10);
    CHECK_NEAR(e.lambda[0], 2 * (9.81 - 2.7 * sin(-4.5)), 1e-8);
}

/* -- text -------------------------------------------------------------------------------------------- */

static void curves_are_printed(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    char *text = NULL;
    CHECK(kempe_model_read_text(context,
                                "kempe: 1\nground: {points: {O: [0, 0, 0]}}\n"
                                "bodies: {b: {joint: {free: x, at: ground}, mass: 2, points: {P: [0, 0, 0]}}}\n"
                                "loops:\n"
                                "  A: {point_on_curve: [ground.O, b.P], y: sin(x), z: 2*x}\n"
                                "  B: {point_on_curve: [ground.O, b.P], curve: [x - y*z, z]}\n",
                                "bead", &model) == KEMPE_OK);
    CHECK(kempe_model_print(model, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "A: point_on_curve ground.O - b.P, y = sin(x), z = 2*x\n"));
    CHECK(text && strstr(text, "B: point_on_curve ground.O - b.P, 0 = x - y*z, 0 = z\n"));
    kempe_text_free(text);
    CHECK(kempe_model_print(model, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"y\": \"sin(x)\", \"z\": \"2*x\"") &&
          strstr(text, "\"curve\": [\"x - y*z\", \"z\"], \"power\": 1"));
    kempe_text_free(text);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(a_bead_goes_round_an_ellipse);
    TEST(a_bead_finds_its_ellipse);
    TEST(a_bead_rides_a_wave);
    TEST(a_bead_slides_down_a_helix);
    TEST(two_surfaces_meet_in_a_curve);
    TEST(a_curve_may_move);
    TEST(curves_are_printed);
    return check_report();
}
