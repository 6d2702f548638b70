/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures that move: a driven slider-crank against its closed form and its power balance, a rod whose length is a
 * function of time, and structures without any freedom, on all formulations. */
#include "loaded.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <math.h>

#define EXAMPLE "examples/driven_slider_crank/driven_slider_crank.yaml"

static const char *const formulations[][3] = {{"reduced", "integrated", NULL},
                                              {"reduced", "newton", NULL},
                                              {"reduced", "newton", "bdf"},
                                              {"reduced", "newton", "adams"},
                                              {"reduced", "newton", "dirk"},
                                              {"reduced", "newton", "radau9"},
                                              {"reduced", "integrated", "erk"},
                                              {"projected", NULL, "dop853"},
                                              {"projected", NULL, "radau"},
                                              {"reduced", "integrated", "radau"},
                                              {"dae", "stabilized1", NULL},
                                              {"dae", "ggl", NULL},
                                              {"dae", "index2", NULL},
                                              {"dae", "index1", "ida"},
                                              {"dae", NULL, NULL}};

enum { FORMULATIONS = sizeof formulations / sizeof *formulations };

typedef void judge_fn(const kempe_system *system, const kempe_trajectory *t);

static void run_all(const char *path, const char *text, double t_end, judge_fn *judge)
{
    loaded l = path ? load(path) : load_text(text);
    for (int k = 0; l.system && k < FORMULATIONS; k++) {
        kempe_run_options run = {0};
        kempe_trajectory *t = NULL;
        run.formulation = formulations[k][0];
        run.form = formulations[k][1];
        run.integrator = formulations[k][2];
        run.rtol = 1e-9;
        run.t_end = t_end;
        CHECK(kempe_simulate(l.system, &run, &t) == KEMPE_OK);
        if (t)
            judge(l.system, t);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* -- the driven slider-crank ----------------------------------------------------------------------------- */

static const double r = 0.2, l = 0.5, rho = 5, pull = 40, friction = 6, creep = 0.01, w = 6.283185307179586;

static double slider(double t)
{
    double y = r * sin(w * t);
    return r * cos(w * t) + sqrt(l * l - y * y) - r - l;
}

static double slider_speed(double t)
{
    double s = sin(w * t), c = cos(w * t);
    return -w * r * s - w * r * r * s * c / sqrt(l * l - r * r * s * s);
}

/* Energy of all bodies, from positions: the rod's centre is midway between its ends. */
static double energy(double t)
{
    double s = sin(w * t), c = cos(w * t), v = slider_speed(t), lean = asin(-r * s / l),
           turn = -w * r * c / (l * cos(lean));
    double vx = (-w * r * s + v) / 2, vy = w * r * c / 2;
    double kinetic = rho * r * r * r / 6 * w * w + rho * l / 2 * (vx * vx + vy * vy) +
                     rho * l * l * l / 24 * turn * turn + 1.5 * v * v;
    return kinetic + 9.81 * (rho * r * r * s / 2 + rho * l * r * s / 2);
}

static void judge_slider_crank(const kempe_system *system, const kempe_trajectory *trajectory)
{
    const double h = 1e-4;
    int motor = -1;
    for (int k = 0; k < kempe_system_row_count(system); k++)
        if (strcmp(kempe_system_row_name(system, k), "motor.1") == 0)
            motor = k;
    CHECK(motor == 2);
    for (int row = 0; motor >= 0 && row < kempe_trajectory_row_count(trajectory); row++) {
        double t = kempe_trajectory_time(trajectory, row), v = slider_speed(t);
        double rate = (8 * (energy(t + h) - energy(t - h)) - (energy(t + 2 * h) - energy(t - 2 * h))) / (12 * h);
        double lost = pull * v * v + friction * v * v / sqrt(v * v + creep * creep);
        CHECK_NEAR(kempe_trajectory_q(trajectory, row)[0], w * t, 1e-7);
        CHECK_NEAR(kempe_trajectory_q(trajectory, row)[2], slider(t), 1e-7);
        CHECK_NEAR(kempe_trajectory_qd(trajectory, row)[2], v, 1e-6);
        CHECK_NEAR(w * kempe_trajectory_lambda(trajectory, row)[motor], rate + lost, 2e-4);
    }
}

static void driven_slider_crank(void)
{
    run_all(EXAMPLE, NULL, 1, judge_slider_crank);
}

/* -- a rod that grows ------------------------------------------------------------------------------------ */

static void judge_jack(const kempe_system *system, const kempe_trajectory *trajectory)
{
    (void)system;
    for (int row = 0; row < kempe_trajectory_row_count(trajectory); row++) {
        double t = kempe_trajectory_time(trajectory, row), length = 1.25 + 0.1 * sin(3 * t);
        double x = sqrt(length * length - 1), xd = length * 0.3 * cos(3 * t) / x;
        CHECK_NEAR(kempe_trajectory_q(trajectory, row)[0], x, 1e-7);
        CHECK_NEAR(kempe_trajectory_qd(trajectory, row)[0], xd, 1e-6);
    }
}

static void jack(void)
{
    run_all(NULL,
            "kempe: 1\nground: {points: {O: [0, 1, 0]}}\nbodies:\n"
            "  a: {joint: {prismatic: x, at: ground}, mass: 2, points: {P: [0, 0, 0]}}\n"
            "loops: {R: {rod: [ground.O, a.P], length: \"1.25 m + 0.1*sin(3*t)\"}}\nstart: {q: {a: 1}}\n",
            3, judge_jack);
}

/* -- nothing moves --------------------------------------------------------------------------------------- */

static void judge_truss(const kempe_system *system, const kempe_trajectory *trajectory)
{
    (void)system;
    int last = kempe_trajectory_row_count(trajectory) - 1;
    CHECK(last > 0);
    for (int k = 0; k < 2; k++)
        CHECK_NEAR(kempe_trajectory_q(trajectory, last)[k], kempe_trajectory_q(trajectory, 0)[k], 1e-9);
}

static void truss(void)
{
    run_all(NULL,
            "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {D: [1, 0, 0]}}\nbodies:\n"
            "  a: {joint: {revolute: z, at: ground}, mass: 2, com: [0.5, 0, 0], points: {P: [1, 0, 0]}}\n"
            "  b: {joint: {revolute: z, at: ground.D}, mass: 2, com: [0.5, 0, 0], points: {P: [1, 0, 0]}}\n"
            "loops: {C: {ball: [a.P, b.P]}}\nstart: {q: {a: 60 deg, b: 120 deg}}\n",
            1, judge_truss);
}

/* -- redundant rows -------------------------------------------------------------------------------------- */

/* Bennett's driven linkage: every choice of independent rows fails twice a turn. Others are taken in time, wherever a
 * tolerance lets steps end; j2 is known: tan(j1/2) tan(j2/2) stays. */
static void rows_are_exchanged_in_time(void)
{
    loaded bennett = load("examples/bennett/bennett.yaml");
    const double product = tan(0.5) * tan(2.756848761676969 / 2);
    for (int k = 0; bennett.system && k < 97; k++) {
        kempe_run_options run = {0};
        kempe_trajectory *t = NULL;
        run.rtol = pow(10, -4 - k / 12.0);
        run.output_step = 0.5;
        CHECK(kempe_simulate(bennett.system, &run, &t) == KEMPE_OK);
        if (t) {
            int last = kempe_trajectory_row_count(t) - 1;
            const double *q = kempe_trajectory_q(t, last);
            double j2 = 2 * atan(product / tan(0.5 + kempe_trajectory_time(t, last)));
            CHECK(fabs(sin((q[1] - j2) / 2)) < 1e-10); /* no freedom: the closures alone say it */
        }
        kempe_trajectory_free(t);
    }
    unload(&bennett);
}

/* A name of a function of time stands for it in a drive, to the last bit, also with kinks. */
static void named_functions_of_time(void)
{
    static const char *const laws[][2] = {{"0.1*sin(w)", "0.1*sin(2*pi*t)"},
                                          {"0.1*sin(w) + tb(t)*u", "0.1*sin(2*pi*t) + tb(t)*u"},
                                          {"max(0, w - 6)/10", "max(0, 2*pi*t - 6)/10"},
                                          {"if(w < 6, 0, w - 6)", "if(2*pi*t < 6, 0, 2*pi*t - 6)"}};
    for (size_t k = 0; k < sizeof laws / sizeof *laws; k++) {
        double end[2][2] = {{0}};
        for (int named = 0; named < 2; named++) {
            static char text[1024];
            (void)snprintf(text, sizeof text,
                           "kempe: 1\n"
                           "gravity: [0, -9.81, 0]\n"
                           "inputs: {u: {default: 0.5}}\n"
                           "tables: {tb: {x: [0, 1, 2], y: [0, 1, 3]}}\n"
                           "algebraic: {w: 2*pi*t, z: '%s'}\n"
                           "bodies:\n"
                           "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
                           "  rod: {joint: {name: A, revolute: z, at: cart.P}, mass: 1, com: [0, -0.5, 0], inertia: "
                           "{zz: 0.1}}\n"
                           "drives: {d: {joint: x, displacement: '%s'}}\n",
                           laws[k][0], named ? "z" : laws[k][1]);
            loaded own = load_text(text);
            kempe_run_options run = {.t_end = 1.5};
            kempe_trajectory *t = NULL;
            CHECK(own.system && kempe_simulate(own.system, &run, &t) == KEMPE_OK);
            const double *q = t ? kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1) : NULL;
            for (int i = 0; q && i < 2; i++)
                end[named][i] = q[i];
            kempe_trajectory_free(t);
            unload(&own);
        }
        CHECK(end[0][0] == end[1][0] && end[0][1] == end[1][1] && fabs(end[0][1]) > 1e-3);
    }
}

int main(void)
{
    TEST(driven_slider_crank);
    TEST(jack);
    TEST(truss);
    TEST(rows_are_exchanged_in_time);
    TEST(named_functions_of_time);
    return check_report();
}
