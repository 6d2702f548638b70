/* SPDX-License-Identifier: BSD-3-Clause */
/* Kinks of abs, min, max and straight lines in closures and drives: rates jump there by a plastic impact, on every
 * formulation and integrator, as in closed form. At the ends of a smooth step nothing jumps: the motion is that of
 * pieces, and it has derivatives by parameters. */
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include <kempe/sensitivity.h>
#include <kempe/table.h>
#include <math.h>
#include <string.h>

typedef struct way {
    const char *formulation, *form, *integrator;
} way;

static const way ways[] = {
    {"reduced", "integrated", "dop853"}, {"reduced", "integrated", "dopri5"}, {"reduced", "newton", "radau"},
    {"reduced", "newton", "radau5"},     {"reduced", "newton", "bdf"},        {"reduced", "newton", "adams"},
    {"reduced", "newton", "erk"},        {"reduced", "newton", "dirk"},       {"projected", NULL, "dop853"},
    {"projected", NULL, "radau"},        {"dae", "stabilized1", "ida"},       {"dae", "ggl", "ida"},
    {"dae", "index1", "radau"}};
enum { WAYS = sizeof ways / sizeof *ways };

static double last[8];

static int take_last(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                     double work)
{
    const int n = *(const int *)user;
    (void)t, (void)qdd, (void)lambda, (void)work;
    for (int i = 0; i < n; i++) {
        last[i] = q[i];
        last[n + i] = qd[i];
    }
    return 0;
}

/* The last q and qd into `last`. */
static void run(loaded *l, const way *w, double t_end, int n)
{
    kmp_run_report report = {0};
    kmp_run_spec spec = {.formulation = w->formulation,
                         .form = w->form,
                         .integrator = w->integrator,
                         .rtol = 1e-10,
                         .atol = 1e-10,
                         .t_end = t_end,
                         .time_count = 1,
                         .times = &t_end};
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    CHECK(kmp_run(l->system, &spec, NULL, take_last, &n, &report) == KEMPE_OK);
    if (report.reason)
        printf("  %s %s: %s\n", w->formulation, w->integrator, report.reason);
    kmp_free(report.reason);
}

/* -- a constraint with a kink -------------------------------------------------------------------------- */

enum { M_Y = 4 };

/* y = f(x) with masses 1 and M_Y, whose slope is 0 up to x = 0.3 and 0.5 from there. */
typedef struct bent {
    const char *more, *constraint;
} bent;

static const bent laws[] = {{"", "max(0.5*(q(x) - 0.3), 0)"},
                            {"", "-min(0, 0.5*(0.3 - q(x)))"},
                            {"", "0.25*(q(x) - 0.3) + 0.25*abs(q(x) - 0.3)"},
                            {"", "0.5*dead_zone(q(x), -1, 0.3)"},
                            {"", "1.5*ramp(q(x), 0.3, 3.3)"},
                            {"", "max(max(0.5*(q(x) - 0.3), 0), min(q(x) - 1, 0))"},
                            {"tables: {f: {x: [0, 0.3, 1.3, 2.3], y: [0, 0, 0.5, 1], method: linear}}\n", "f(q(x))"},
                            {"algebraic: {s: \"max(0.5*(q(x) - 0.3), 0)\"}\n", "s"},
                            {"algebraic: {w: {of: {s: 0}, zero: \"s - max(0.5*(q(x) - 0.3), 0)\"}}\n", "s"}};

/* The impact keeps the momentum along the path: v (1 + 0.5^2 M_Y) = 1. */
static void a_constraint_bends(void)
{
    for (size_t k = 0; k < sizeof laws / sizeof *laws; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\n%sbodies:\n  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                       "  b: {joint: {name: y, prismatic: y, at: ground}, mass: %d}\n"
                       "loops: {L: {constraint: \"q(y) - (%s)\"}}\nstart: {qd: {x: 1}, hold: [x]}\n",
                       laws[k].more, M_Y, laws[k].constraint);
        loaded l = load_text(text);
        for (int i = 0; l.system && i < WAYS; i++) {
            run(&l, &ways[i], 1.3, 2);
            CHECK_NEAR(last[0], 0.8, 1e-7);
            CHECK_NEAR(last[2], 0.5, 1e-7);
            CHECK_NEAR(last[3], 0.25, 1e-7);
        }
        unload(&l);
    }
}

/* A function whose argument has a kink: from the impact on, the kinetic energy is kept. */
static void a_function_bends(void)
{
    static const struct {
        const char *of;
        double at; /* the slope behind the kink */
    } functions[] = {{"sqrt(1 + max(q(x) - 0.3, 0))", 0.5},
                     {"-0.5/(1 + max(q(x) - 0.3, 0))", 0.5},
                     {"log(max(q(x) + 0.7, 1))", 1},
                     {"max(q(x) - 0.3, 0)^3", 0}}; /* nothing jumps */
    for (size_t k = 0; k < sizeof functions / sizeof *functions; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nbodies:\n  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                       "  b: {joint: {name: y, prismatic: y, at: ground}, mass: %d}\n"
                       "loops: {L: {constraint: \"q(y) - (%s)\"}}\nstart: {qd: {x: 1}, hold: [x]}\n",
                       M_Y, functions[k].of);
        loaded l = load_text(text);
        for (int i = 0; l.system && i < WAYS; i++) {
            double rest = 1 + M_Y * functions[k].at * functions[k].at;
            run(&l, &ways[i], 1.3, 2);
            CHECK_NEAR(last[2] * last[2] + M_Y * last[3] * last[3], 1 / rest, 1e-6);
        }
        unload(&l);
    }
}

/* A point of a body that slides on another one: 5 vx^2 + 4 vy^2. */
static void a_curve_bends(void)
{
    loaded l = load_text("kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                         "  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                         "  b: {joint: {name: y, prismatic: y, at: a}, mass: 4, points: {P: [0, 0, 0]}}\n"
                         "loops: {L: {point_on_curve: [ground.O, b.P], y: \"0.5*max(x - 0.3, 0)\"}}\n"
                         "start: {qd: {x: 1}, hold: [x]}\n");
    for (int i = 0; l.system && i < WAYS; i++) {
        run(&l, &ways[i], 1.3, 2);
        CHECK_NEAR(last[2], 5.0 / 6, 1e-7);
        CHECK_NEAR(last[3], 5.0 / 12, 1e-7);
    }
    unload(&l);
}

/* A cubic table whose third derivative jumps by 120 at its middle knot, the only one of five: not-a-knot. */
static double knotted(double x)
{
    return 0.3 * x - 0.2 * x * x + 0.1 * x * x * x + (x > 1 ? 20 * pow(x - 1, 3) : 0);
}

/* The time from a to b with the kinetic energy of a rate 1 at x = 0.2, by Simpson's rule; `ratio` of the masses that
 * move along y and x. */
static double time_along(double ratio, double a, double b)
{
    enum { PIECES = 2000 };
    double sum = 0, h = (b - a) / PIECES, slope = 0.3 - 0.4 * 0.2 + 0.3 * 0.2 * 0.2, energy = 1 + ratio * slope * slope;
    for (int k = 0; k <= PIECES; k++) {
        double x = a + h * k, beyond = x > 1 ? x - 1 : 0, at = 0.3 - 0.4 * x + 0.3 * x * x + 60 * beyond * beyond;
        sum += sqrt((1 + ratio * at * at) / energy) * (k == 0 || k == PIECES ? 1 : k % 2 ? 4 : 2);
    }
    return sum * h / 3;
}

/* One-step methods end a step at the knot, and keep their order. */
static void a_curve_has_knots(void)
{
    static const char *const uses[] = {"loops: {L: {constraint: \"q(y) - f(q(x))\"}}\n",
                                       "loops: {L: {point_on_curve: [ground.O, b.P], table: f}}\n"};
    for (int use = 0; use < 2; use++) {
        char text[1024];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ntables: {f: {x: [0, 0.5, 1, 1.5, 2], y: [%.17g, %.17g, %.17g, %.17g, %.17g]}}\n"
                       "ground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                       "  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                       "  b: {joint: {name: y, prismatic: y, at: %s}, mass: %d, points: {P: [0, 0, 0]}}\n%s"
                       "start: {q: {x: 0.2, y: %.17g}, qd: {x: 1}, hold: [x]}\n",
                       knotted(0), knotted(0.5), knotted(1), knotted(1.5), knotted(2), use ? "a" : "ground", M_Y,
                       uses[use], knotted(0.2));
        loaded l = load_text(text);
        for (int i = 0; l.system && i < WAYS; i++) {
            const double t_end = 1.1, ratio = use ? M_Y / (1.0 + M_Y) : M_Y;
            const bool locates = strchr("der", ways[i].integrator[0]) != NULL; /* not bdf, adams, ida */
            run(&l, &ways[i], t_end, 2);
            double t = time_along(ratio, 0.2, 1) + time_along(ratio, 1, last[0]);
            printf("  %-9s %-8s %.1e\n", ways[i].formulation, ways[i].integrator, t - t_end);
            CHECK(fabs(t - t_end) < (locates ? 6e-10 : 1e-7));
        }
        unload(&l);
    }
}

/* A plane with a corner strikes the body on it: the gap closes at 0.5 m/s, and half of that is its rate afterwards. */
static void a_contact_bends(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                         "  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                         "  b: {joint: {name: y, prismatic: y, at: a}, mass: 4}\n"
                         "contacts: {c: {gap: \"q(y) - max(0.5*(q(x) - 0.3), 0)\", restitution: 0.5}}\n"
                         "start: {qd: {x: 1}}\n");
    if (l.system)
        run(&l, &ways[0], 0.35, 2);
    CHECK_NEAR(last[2], 1 - 0.5 * (1.5 * 0.5 / 0.3) / 5, 1e-9);
    CHECK_NEAR(last[3], 1.5 * 0.5 / 0.3 / 4 - 9.81 * 0.05, 1e-9);
    unload(&l);
}

/* The lines of a table of two variables are not located. */
static void two_variables_are_refused(void)
{
    loaded l = {.context = kempe_context_new()};
    CHECK(kempe_model_read_text(l.context,
                                "kempe: 1\ntables: {f: {x: [0, 1, 2], y: [0, 1], z: [[0, 0], [0, 1], [1, 2]], method: "
                                "linear}}\nbodies:\n  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                                "  b: {joint: {name: y, prismatic: y, at: ground}, mass: 4}\n"
                                "algebraic: {s: \"f(q(x), 0.5)\"}\nloops: {L: {constraint: \"q(y) - s\"}}\n",
                                "model.yaml", &l.model) == KEMPE_OK);
    CHECK(l.model && kempe_system_new(l.model, &l.system) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(l.context), "model.yaml:7:9: 'L' depends on a table of two variables"));
    unload(&l);
}

/* -- a cart that is driven, with a pendulum ------------------------------------------------------------ */

static const double gravity = 9.81, length = 0.5;

/* A pendulum under a cart with the acceleration a + b t, by the classical Runge-Kutta method. */
static void swing(double from, double to, double a, double b, double *angle, double *rate)
{
    enum { STEPS = 20000 };
    double h = (to - from) / STEPS;
    for (int k = 0; k < STEPS; k++) {
        const double part[] = {0, 0.5, 0.5, 1};
        double x[5] = {0}, v[5] = {0};
        for (int i = 0; i < 4; i++) {
            double q = *angle + part[i] * h * x[i], qd = *rate + part[i] * h * v[i];
            double t = from + h * (k + part[i]);
            x[i + 1] = qd;
            v[i + 1] = -(gravity * sin(q) + (a + b * t) * cos(q)) / length;
        }
        *angle += h / 6 * (x[1] + 2 * x[2] + 2 * x[3] + x[4]);
        *rate += h / 6 * (v[1] + 2 * v[2] + 2 * v[3] + v[4]);
    }
}

#define CART(drive) CART_BY("drives: {d: {joint: x, displacement: \"" drive "\"}}")
#define CART_BY(way)                                                                                                   \
    "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {begin: 0.3, time: 0.8}\nground: {points: {O: [0, 0, 0]}}\n"        \
    "tables: {f: {x: [0, 1, 3, 4], y: [0, 0, 2, 2], method: linear}}\nbodies:\n"                                       \
    "  c: {joint: {name: x, prismatic: x, at: ground}, mass: 1, points: {P: [1, 0, 0]}}\n"                             \
    "  p: {joint: {name: A, revolute: z, at: c}, mass: 1, com: [0, -0.5, 0]}\n" way                                    \
    "\nrun: {t_end: 2, rtol: 1e-10, outputs: [q]}\n"

/* The cart gets 1 m/s at t = 1 s; the mass of the pendulum stays at rest. */
static void a_drive_bends(void)
{
    static const char *const texts[] = {CART("2*ramp(t, 1, 3)"), CART("max(t - 1, 0)"), CART("f(t)"),
                                        CART("0.5*(t - 1 + abs(t - 1))"),
                                        CART_BY("loops: {R: {rod: [ground.O, c.P], length: \"1 + max(t - 1, 0)\"}}")};
    double angle = 0, rate = -1 / length;
    swing(1, 2, 0, 0, &angle, &rate);
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        loaded l = load_text(texts[k]);
        for (int i = 0; l.system && i < WAYS; i++) {
            run(&l, &ways[i], 2, 2);
            CHECK_NEAR(last[1], angle, 1e-6);
            CHECK_NEAR(last[3], rate, 1e-6);
        }
        unload(&l);
    }
}

/* The cubic step of 0.5 m from `begin` on. */
static double angle_after_step(double begin, double time)
{
    double angle = 0, rate = 0, most = 6 * 0.5 / (time * time), slope = -2 * most / time;
    swing(begin, begin + time, most - slope * begin, slope, &angle, &rate);
    swing(begin + time, 2, 0, 0, &angle, &rate);
    return angle;
}

static void a_smooth_step_has_derivatives(void)
{
    static const char text[] = CART("step(t, begin, 0, begin + time, 0.5)");
    const double d = 1e-4, angle = angle_after_step(0.3, 0.8);
    const double by_begin = (angle_after_step(0.3 + d, 0.8) - angle_after_step(0.3 - d, 0.8)) / (2 * d);
    const double by_time = (angle_after_step(0.3, 0.8 + d) - angle_after_step(0.3, 0.8 - d)) / (2 * d);
    loaded l = load_text(text);
    for (int i = 0; l.system && i < WAYS; i++) {
        run(&l, &ways[i], 2, 2);
        CHECK_NEAR(last[1], angle, 1e-6);
    }
    kempe_sensitivity_options options = {.parameters = "begin,time"};
    kempe_sensitivity *slopes = NULL;
    kempe_table *table = NULL;
    CHECK(kempe_sensitivity_new(l.model, &options, &slopes) == KEMPE_OK);
    CHECK(kempe_sensitivity_table(slopes, "rows", &table) == KEMPE_OK);
    if (table) {
        int row = kempe_table_row_count(table) - 1;
        CHECK_NEAR(kempe_table_number(table, row, kempe_table_find(table, "q.A/begin")), by_begin, 1e-6);
        CHECK_NEAR(kempe_table_number(table, row, kempe_table_find(table, "q.A/time")), by_time, 1e-6);
    }
    kempe_table_free(table);
    kempe_sensitivity_free(slopes);
    unload(&l);
}

/* y = max(x, 0)^1.5 with masses 1: the energy gives dx/dt = (1 + 2.25 x)^-1/2 for x > 0. The derivatives of a power
 * that is not whole are infinite at 0, those of this one zero before it. */
static void a_power_begins(void)
{
    static const double from[] = {0, -0.5};
    for (int k = 0; k < 2; k++)
        for (int w = 0; w < WAYS; w++) {
            char text[512];
            if (strcmp(ways[w].formulation, "reduced") != 0 || strcmp(ways[w].form, "integrated") != 0)
                continue;
            (void)snprintf(text, sizeof text,
                           "kempe: 1\nbodies:\n  a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                           "  b: {joint: {name: y, prismatic: y, at: ground}, mass: 1}\n"
                           "loops: {c: {constraint: \"q(y) - max(q(x), 0)^1.5\"}}\n"
                           "start: {q: {x: %g}, qd: {x: 1}}\n",
                           from[k]);
            loaded l = load_text(text);
            run(&l, &ways[w], 1, 2);
            const double x = (pow(1 + 3.375 * (1 + from[k]), 2.0 / 3) - 1) / 2.25;
            CHECK_NEAR(last[0], x, 1e-7);
            CHECK_NEAR(last[2], 1 / sqrt(1 + 2.25 * x), 1e-7);
            unload(&l);
        }
}

int main(void)
{
    TEST(a_constraint_bends);
    TEST(a_function_bends);
    TEST(a_curve_bends);
    TEST(a_curve_has_knots);
    TEST(a_contact_bends);
    TEST(two_variables_are_refused);
    TEST(a_drive_bends);
    TEST(a_smooth_step_has_derivatives);
    TEST(a_power_begins);
    return check_report();
}
