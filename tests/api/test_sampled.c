/* SPDX-License-Identifier: BSD-3-Clause */
/* A stepper obeys: inputs act from the time at which they are set, on every method and at times of any kind; states are
 * set, saved, restored and copied to the bit. */
#include "testing.h"
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <stdbool.h>

typedef struct method {
    const char *formulation, *form, *integrator;
} method;

static const method methods[] = {
    {"reduced", "integrated", "dop853"},
    {"reduced", "integrated", "dopri5"},
    {"reduced", "integrated", "erk"},
    {"reduced", "integrated", "radau"},
    {"reduced", "newton", "dop853"},
    {"reduced", "newton", "adams"},
    {"reduced", "newton", "bdf"},
    {"reduced", "newton", "dirk"},
    {"reduced", "newton", "radau5"},
    {"reduced", "newton", "radau9"},
    {"reduced", "newton", "ida"},
    {"projected", NULL, "dop853"},
    {"projected", NULL, "dopri5"},
    {"projected", NULL, "erk"},
    {"projected", NULL, "radau"},
    {"dae", "stabilized1", "ida"},
    {"dae", "ggl", "ida"},
    {"dae", "index2", "ida"},
    {"dae", "index1", "ida"},
    {"dae", "index1", "radau"},
};
enum { METHODS = sizeof methods / sizeof *methods };

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
} scene;

static scene scene_of(const char *text)
{
    scene s = {.context = kempe_context_new()};
    if (kempe_model_read_text(s.context, text, "model.yaml", &s.model) != KEMPE_OK ||
        kempe_system_new(s.model, &s.system) != KEMPE_OK)
        printf("%s\n", kempe_context_message(s.context));
    CHECK(s.system != NULL);
    return s;
}

static void scene_free(scene *s)
{
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

static kempe_run_options options(const method *m, double t_end, double rtol)
{
    return (kempe_run_options){
        .formulation = m->formulation, .form = m->form, .integrator = m->integrator, .t_end = t_end, .rtol = rtol};
}

static const char rotor[] = "kempe: 1\ninputs: {u: {unit: N*m}}\n"
                            "bodies: {wheel: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                            "forces: {motor: {joint: A, torque: u}}\n";

/* 1 N m from 1 s to 2 s on 1 kg m2: 1 rad/s from there on, at every sampling rate. */
static void one_radian_a_second(void)
{
    static const double rates[] = {4, 20, 100, 1000};
    scene s = scene_of(rotor);
    for (int m = 0; m < METHODS; m++)
        for (int r = 0; r < 4; r++) {
            kempe_stepper *stepper = NULL;
            kempe_run_options run = options(&methods[m], 4, 1e-8);
            double step = 1 / rates[r], error = 0;
            CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
            for (int k = 1; k <= 4 * rates[r] && stepper; k++) {
                double t = step * k;
                CHECK(kempe_stepper_set_input(stepper, 0, t > 1 + step / 2 && t < 2 + step / 2) == KEMPE_OK);
                CHECK(kempe_stepper_advance(stepper, t) == KEMPE_OK);
                error = check_max(error, fabs(kempe_stepper_qd(stepper)[0] - fmin(fmax(t - 1, 0), 1)));
            }
            if (!(error < 5e-7))
                printf("  %s %s at %g Hz: error %.2g\n", methods[m].formulation, methods[m].integrator, rates[r],
                       error);
            CHECK(error < 5e-7);
            kempe_stepper_free(stepper);
        }
    scene_free(&s);
}

/* -- linear systems under sampled control ------------------------------------------------------------- */

/* x' = A x + b u, with u constant between samples: [x; u] over a time by the exponential of a matrix of `size` rows. */
enum { MOST = 6 };

static void multiply(int n, double a[MOST][MOST], double b[MOST][MOST], double out[MOST][MOST])
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            out[i][j] = 0;
            for (int k = 0; k < n; k++)
                out[i][j] += a[i][k] * b[k][j];
        }
}

/* By Taylor's series of a part of the time, squared. */
static void exponential(int n, double a[MOST][MOST], double time, double out[MOST][MOST])
{
    double term[MOST][MOST] = {{0}}, next[MOST][MOST], part = time / 1024;
    memset(out, 0, sizeof(double[MOST][MOST]));
    for (int i = 0; i < n; i++)
        out[i][i] = term[i][i] = 1;
    for (int k = 1; k < 16; k++) {
        multiply(n, term, a, next);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                out[i][j] += term[i][j] = next[i][j] * part / k;
    }
    for (int k = 0; k < 10; k++) {
        multiply(n, out, out, next);
        memcpy(out, next, sizeof next);
    }
}

typedef struct plant {
    const char *text;
    int n;                /* coordinates */
    double a[MOST][MOST]; /* of q and qd; the last column is b, the last row zero */
    double gain[2];       /* u = -gain[0] q[0] - gain[1] qd[0] */
} plant;

/* Samples at times that are no multiples of anything. */
static double sample_time(int k)
{
    return 0.05 * k + 0.013 * sin(1.7 * k);
}

static void closed_loop(const plant *p, double q0)
{
    scene s = scene_of(p->text);
    for (int m = 0; m < METHODS; m++) {
        kempe_stepper *stepper = NULL;
        const double rtol = 1e-9;
        kempe_run_options run = options(&methods[m], 4, rtol);
        double x[MOST] = {0}, a[MOST][MOST], e[MOST][MOST], error = 0, size = 1;
        int n = 2 * p->n + 1;
        memcpy(a, p->a, sizeof a);
        x[0] = q0;
        CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
        for (int k = 1; k <= 60 && stepper; k++) {
            double t = kempe_stepper_time(stepper), to = sample_time(k), y[MOST] = {0};
            double u = -p->gain[0] * kempe_stepper_q(stepper)[0] - p->gain[1] * kempe_stepper_qd(stepper)[0];
            x[n - 1] = -p->gain[0] * x[0] - p->gain[1] * x[p->n];
            exponential(n, a, to - t, e);
            for (int i = 0; i < n; i++)
                for (int j = 0; j < n; j++)
                    y[i] += e[i][j] * x[j];
            memcpy(x, y, sizeof x);
            CHECK(kempe_stepper_set_input(stepper, 0, u) == KEMPE_OK);
            CHECK(kempe_stepper_advance(stepper, to) == KEMPE_OK);
            for (int i = 0; i < p->n; i++)
                error = check_max(error, fabs(kempe_stepper_q(stepper)[i] - x[i]));
            size = fmax(size, fabs(x[0]));
        }
        if (!(error < 10 * rtol * size))
            printf("  %s %s: error %.2g rtol\n", methods[m].formulation, methods[m].integrator, error / rtol / size);
        CHECK(error < 10 * rtol * size);
        kempe_stepper_free(stepper);
    }
    scene_free(&s);
}

static void rotor_under_control(void)
{
    const plant p = {rotor, 1, {{0, 1, 0}, {0, 0, 1}, {0}}, {20, 6}};
    char text[512];
    plant started = p;
    (void)snprintf(text, sizeof text, "%sstart: {q: {A: 0.5}, hold: [A]}\n", rotor);
    started.text = text;
    closed_loop(&started, 0.5);
}

static void two_masses_under_control(void)
{
    /* m1 = 1, m2 = 2 kg, k = 50 N/m, d = 0.5 N s/m between them */
    const plant p = {"kempe: 1\ninputs: {u: {unit: N}}\nbodies:\n"
                     "  a: {joint: {name: A, prismatic: x, at: ground}, mass: 1}\n"
                     "  b: {joint: {name: B, prismatic: x, at: ground}, mass: 2}\n"
                     "forces:\n  drive: {joint: A, force: u - 50*(q(A) - q(B)) - 0.5*(qd(A) - qd(B))}\n"
                     "  spring: {joint: B, force: 50*(q(A) - q(B)) + 0.5*(qd(A) - qd(B))}\n"
                     "start: {q: {A: 0.3}, hold: [A, B]}\n",
                     2,
                     {{0, 0, 1, 0, 0}, {0, 0, 0, 1, 0}, {-50, 50, -0.5, 0.5, 1}, {25, -25, 0.25, -0.25, 0}, {0}},
                     {8, 3}};
    closed_loop(&p, 0.3);
}

/* A cart-pole about its upright position, its equations made linear: the pole is a second translation. */
static void cart_pole_under_control(void)
{
    /* M = 2, m = 0.5 kg, l = 0.7 m: x'' = (u - m g phi) / M, phi'' = ((M + m) g phi - u) / (M l) */
    const double M = 2, m = 0.5, l = 0.7, g = 9.81;
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ninputs: {u: {unit: N}}\nbodies:\n"
                   "  pole: {joint: {name: phi, prismatic: x, at: ground}, mass: 1}\n"
                   "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                   "forces:\n  a: {joint: phi, force: \"(%g*q(phi) - u)/%g\"}\n"
                   "  b: {joint: x, force: \"(u - %g*q(phi))/%g\"}\n"
                   "start: {q: {phi: 0.1}, hold: [phi, x]}\n",
                   (M + m) * g, M * l, m * g, M);
    const plant p = {text,
                     2,
                     {{0, 0, 1, 0, 0},
                      {0, 0, 0, 1, 0},
                      {(M + m) * g / (M * l), 0, 0, 0, -1 / (M * l)},
                      {-m * g / M, 0, 0, 0, 1 / M},
                      {0}},
                     {-60, -14}};
    closed_loop(&p, 0.1);
}

/* A multistep method returns when its input has stopped to jump, and ends with its own steps. */
static void multistep_methods_return(void)
{
    static const method multistep[] = {
        {"reduced", "newton", "adams"}, {"reduced", "newton", "bdf"}, {"dae", "stabilized1", "ida"}};
    scene s = scene_of("kempe: 1\ngravity: [0, -9.81, 0]\ninputs: {u: {unit: N*m}}\n"
                       "bodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0, -1, 0]}}\n"
                       "forces: {motor: {joint: A, torque: u}}\nstart: {q: {A: 1}}\n");
    for (int m = 0; m < 3; m++) {
        kempe_stepper *jumps = NULL, *alone = NULL;
        kempe_run_options run = options(&multistep[m], 100, 1e-8);
        CHECK(kempe_stepper_new(s.system, &run, &jumps) == KEMPE_OK);
        for (int k = 1; k <= 100; k++)
            CHECK(kempe_stepper_set_input(jumps, 0, k % 2) == KEMPE_OK && kempe_stepper_advance(jumps, 0.01 * k) == 0);
        CHECK(kempe_stepper_work(jumps).steps < 300);
        CHECK(kempe_stepper_set_input(jumps, 0, 0) == KEMPE_OK && kempe_stepper_advance(jumps, 50) == KEMPE_OK);
        long before = kempe_stepper_work(jumps).steps;
        CHECK(kempe_stepper_advance(jumps, 100) == KEMPE_OK);
        long steps = kempe_stepper_work(jumps).steps - before;
        CHECK(kempe_stepper_new(s.system, &run, &alone) == KEMPE_OK && kempe_stepper_advance(alone, 50) == KEMPE_OK);
        before = kempe_stepper_work(alone).steps;
        CHECK(kempe_stepper_advance(alone, 100) == KEMPE_OK);
        CHECK_NEAR((double)steps / (double)(kempe_stepper_work(alone).steps - before), 1,
                   0.5); /* one-step methods: 0.2 at most */
        kempe_stepper_free(jumps);
        kempe_stepper_free(alone);
    }
    scene_free(&s);
}

/* -- states ------------------------------------------------------------------------------------------ */

static void check_equal(const kempe_stepper *a, const kempe_stepper *b, int n)
{
    CHECK(kempe_stepper_time(a) == kempe_stepper_time(b));
    CHECK(memcmp(kempe_stepper_q(a), kempe_stepper_q(b), (size_t)n * sizeof(double)) == 0);
    CHECK(memcmp(kempe_stepper_qd(a), kempe_stepper_qd(b), (size_t)n * sizeof(double)) == 0);
    CHECK(memcmp(kempe_stepper_qdd(a), kempe_stepper_qdd(b), (size_t)n * sizeof(double)) == 0);
}

/* A four-bar whose coordinates are exchanged as it turns, with a torque that switches. */
static const char switching[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\ninputs: {u: {default: 0.2, unit: N*m}}\n"
    "ground: {points: {B: [1, 0, 0]}}\nbodies:\n"
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.01}, "
    "points: {P: [0.3, 0, 0]}}\n"
    "  coupler: {joint: {name: C, revolute: z, at: crank.P}, mass: 1, com: [0.45, 0, 0], inertia: {zz: 0.1}, "
    "points: {Q: [0.9, 0, 0]}}\n"
    "  rocker: {joint: {name: R, revolute: z, at: ground.B}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.05}, "
    "points: {Q: [0.6, 0, 0]}}\n"
    "loops: {q: {ball: [coupler.Q, rocker.Q]}}\n"
    "forces: {motor: {joint: A, torque: \"if(sin(q(A)) > 0, 3 + u, u - 1) - 0.3*qd(A)\"}}\n"
    "start: {q: {A: 0.5, C: 0.5, R: 1.5}, qd: {A: 6}}\n";

static void restored(const method *m)
{
    scene s = scene_of(switching);
    int n = kempe_model_coordinate_count(s.model);
    kempe_stepper *a = NULL, *b = NULL;
    kempe_stepper_state *state = NULL;
    kempe_run_options run = options(m, 10, 1e-7);
    double end[2][3];
    run.independent = strcmp(m->formulation, "reduced") == 0 ? "R" : NULL; /* the rocker stops at its dead centres */
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(a && kempe_stepper_advance(a, 0.3) == KEMPE_OK);
    CHECK(kempe_stepper_save(a, &state) == KEMPE_OK);
    kempe_work before = kempe_stepper_work(a);
    CHECK(kempe_stepper_advance(a, 0.61) == KEMPE_OK);
    CHECK(kempe_stepper_set_input(a, 0, 3) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 4) == KEMPE_OK);
    if (strcmp(m->formulation, "reduced") == 0)
        CHECK(kempe_stepper_work(a).exchanges > before.exchanges);
    memcpy(end[0], kempe_stepper_q(a), sizeof end[0]);
    CHECK(kempe_stepper_restore(a, state) == KEMPE_OK);
    CHECK(kempe_stepper_time(a) == 0.3);
    CHECK(kempe_stepper_copy(a, &b) == KEMPE_OK);
    CHECK(kempe_stepper_restore(a, state) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 0.61) == KEMPE_OK);
    CHECK(kempe_stepper_set_input(a, 0, 3) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 4) == KEMPE_OK);
    memcpy(end[1], kempe_stepper_q(a), sizeof end[1]);
    CHECK(memcmp(end[0], end[1], sizeof end[0]) == 0);
    CHECK(kempe_stepper_reset(a) == KEMPE_OK && kempe_stepper_time(a) == 0);
    kempe_stepper_free(b);
    b = NULL;
    CHECK(kempe_stepper_new(s.system, &run, &b) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 2) == KEMPE_OK && kempe_stepper_advance(b, 2) == KEMPE_OK);
    check_equal(a, b, n);
    kempe_stepper_state_free(state);
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    scene_free(&s);
}

static void saved_and_restored(void)
{
    for (int m = 0; m < METHODS; m++)
        restored(&methods[m]);
}

/* Two copies that are given equal inputs stay equal; with another input they differ. */
static void copies(void)
{
    scene s = scene_of(switching);
    kempe_stepper *a = NULL, *b = NULL;
    kempe_run_options run = options(&methods[0], 10, 1e-8);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 0.77) == KEMPE_OK && kempe_stepper_copy(a, &b) == KEMPE_OK);
    for (int k = 1; k <= 50; k++) {
        CHECK(kempe_stepper_set_input(a, 0, k % 7) == KEMPE_OK && kempe_stepper_set_input(b, 0, k % 7) == KEMPE_OK);
        CHECK(kempe_stepper_advance(a, 0.77 + 0.03 * k) == KEMPE_OK);
        CHECK(kempe_stepper_advance(b, 0.77 + 0.03 * k) == KEMPE_OK);
        check_equal(a, b, 3);
    }
    CHECK(kempe_stepper_set_input(b, 0, 9) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 3) == KEMPE_OK && kempe_stepper_advance(b, 3) == KEMPE_OK);
    CHECK(kempe_stepper_q(a)[0] != kempe_stepper_q(b)[0]);
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    scene_free(&s);
}

/* Another state is closed, and the change is said; one that cannot be closed leaves the stepper as it was. */
static void another_state(void)
{
    scene s = scene_of(switching);
    kempe_stepper *a = NULL;
    kempe_run_options run = options(&methods[0], 10, 1e-8);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK && kempe_stepper_advance(a, 0.4) == KEMPE_OK);
    double q[3], moved = -1;
    memcpy(q, kempe_stepper_q(a), sizeof q);
    CHECK(kempe_stepper_set_state(a, q, NULL, &moved) == KEMPE_OK && moved < 1e-9 && moved >= 0);
    for (int i = 0; i < 3; i++)
        CHECK(kempe_stepper_qd(a)[i] == 0);
    q[0] += 0.1;
    CHECK(kempe_stepper_set_state(a, q, NULL, &moved) == KEMPE_OK && moved > 1e-3 && moved < 0.2);
    CHECK(kempe_stepper_time(a) == 0.4);
    CHECK(kempe_stepper_advance(a, 0.5) == KEMPE_OK);
    q[0] = NAN;
    double before = kempe_stepper_q(a)[0];
    CHECK(kempe_stepper_set_state(a, q, NULL, &moved) == KEMPE_E_FAILED);
    CHECK(kempe_stepper_q(a)[0] == before && kempe_stepper_advance(a, 0.6) == KEMPE_OK);
    kempe_stepper_free(a);
    scene_free(&s);
}

/* A pendulum whose length doubles at its lowest point; the motion after that is that of a model with the other length
 * from the same state. */
static void other_parameters(void)
{
    static const char text[] = "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {L: 1, m: 2}\nbodies:\n"
                               "  rod: {joint: {name: A, revolute: z, at: ground}, mass: m, com: [0, -L, 0]}\n"
                               "start: {q: {A: 1}}\n";
    scene s = scene_of(text);
    kempe_stepper *a = NULL, *b = NULL;
    kempe_model *longer = NULL;
    kempe_system *other = NULL;
    kempe_run_options run = options(&methods[0], 10, 1e-10);
    const char *const names[] = {"L", "m"}, *const wrong[] = {"K"};
    const double values[] = {2, 5};
    const kempe_setting set[] = {{"L", "2"}, {"m", "5"}};
    double moved = -1;
    CHECK(kempe_model_read_text_set(s.context, text, "model.yaml", set, 2, &longer) == KEMPE_OK);
    CHECK(kempe_system_new(longer, &other) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK && kempe_stepper_new(other, &run, &b) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 0.5) == KEMPE_OK && kempe_stepper_advance(b, 0.5) == KEMPE_OK);
    CHECK(kempe_stepper_set_parameters(a, 1, wrong, values, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_set_parameters(a, 1, names, values, &moved) == KEMPE_OK && moved == 0);
    CHECK(kempe_stepper_set_parameters(a, 1, names + 1, values + 1, NULL) == KEMPE_OK);
    CHECK(kempe_stepper_set_state(b, kempe_stepper_q(a), kempe_stepper_qd(a), NULL) == KEMPE_OK);
    for (int k = 1; k <= 10; k++) {
        CHECK(kempe_stepper_advance(a, 0.5 + 0.2 * k) == KEMPE_OK);
        CHECK(kempe_stepper_advance(b, 0.5 + 0.2 * k) == KEMPE_OK);
        CHECK_NEAR(kempe_stepper_q(a)[0], kempe_stepper_q(b)[0], 1e-9);
    }
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    kempe_system_free(other);
    kempe_model_free(longer);
    scene_free(&s);
}

/* -- stops, drives, mistakes --------------------------------------------------------------------------- */

static void stops(void)
{
    scene s = scene_of(switching);
    kempe_stepper *a = NULL;
    kempe_run_options run = options(&methods[0], 10, 1e-8);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(kempe_stepper_set_stop(a, 0.123456) == KEMPE_OK);
    bool met = false;
    for (int k = 0; k < 10000 && kempe_stepper_time(a) < 1; k++) {
        CHECK(kempe_stepper_step(a) == KEMPE_OK);
        met = met || kempe_stepper_time(a) == 0.123456;
    }
    CHECK(met);
    CHECK(kempe_stepper_set_stop(a, 0.5) == KEMPE_E_ARGUMENT);
    kempe_stepper_free(a);
    scene_free(&s);
}

/* A driven cart is accelerated by pieces: 0.5 a s^2 + v s in each. A jump of value or rate is refused. */
static void driven(void)
{
    scene s = scene_of("kempe: 1\ninputs: {x: {unit: m}}\n"
                       "bodies:\n  cart: {joint: {name: X, prismatic: x, at: ground}, mass: 1, inertia: {zz: 1}, "
                       "points: {P: [0, 0, 0]}}\n"
                       "  load: {joint: {name: A, revolute: z, at: cart.P}, mass: 1, com: [0, -1, 0]}\n"
                       "gravity: [0, -9.81, 0]\ndrives: {d: {joint: X, displacement: x}}\n");
    for (int m = 0; m < METHODS; m++) {
        kempe_stepper *a = NULL;
        kempe_run_options run = options(&methods[m], 10, 1e-8);
        double x = 0, v = 0, h = 0.037;
        CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
        CHECK(kempe_stepper_set_input(a, 0, 1) == KEMPE_E_ARGUMENT);
        CHECK(strstr(kempe_context_message(s.context), "input 'x' moves closure 'd'") != NULL);
        for (int k = 1; k <= 40; k++) {
            double acceleration = sin(k);
            CHECK(kempe_stepper_set_input_rates(a, 0, x, v, acceleration) == KEMPE_OK);
            CHECK(kempe_stepper_advance(a, h * k) == KEMPE_OK);
            x += h * (v + 0.5 * h * acceleration);
            v += h * acceleration;
            CHECK_NEAR(kempe_stepper_q(a)[0], x, 1e-7);
            CHECK_NEAR(kempe_stepper_qd(a)[0], v, 1e-6);
            CHECK_NEAR(kempe_stepper_input(a, 0), x, 1e-12);
        }
        kempe_stepper_free(a);
    }
    scene_free(&s);
}

static void mistakes(void)
{
    scene s = scene_of(rotor);
    kempe_stepper *a = NULL;
    kempe_run_options run = options(&methods[0], 1, 1e-8);
    CHECK(kempe_model_input_find(s.model, "u") == 0 && kempe_model_input_find(s.model, "v") == -1);
    CHECK(kempe_model_input_count(s.model) == 1 && strcmp(kempe_model_input_unit(s.model, 0), "N*m") == 0);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(kempe_stepper_set_input(a, 1, 0) == KEMPE_E_ARGUMENT && kempe_stepper_set_input(a, -1, 0) != KEMPE_OK);
    CHECK(kempe_stepper_set_input(a, 0, NAN) == KEMPE_E_ARGUMENT);
    CHECK(isnan(kempe_stepper_input(a, 1)) && kempe_stepper_input(a, 0) == 0);
    kempe_stepper_free(a);
    scene_free(&s);
}

/* An input that does not change costs no restart: the steps end at the samples, and no more evaluations are made. */
static void equal_values_need_no_restart(void)
{
    scene s = scene_of(rotor);
    kempe_stepper *a = NULL, *b = NULL;
    kempe_run_options run = options(&methods[0], 2, 1e-8);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK && kempe_stepper_new(s.system, &run, &b) == KEMPE_OK);
    for (int k = 1; k <= 100; k++) {
        CHECK(kempe_stepper_set_input(a, 0, 1) == KEMPE_OK && kempe_stepper_set_input(b, 0, 1 + k % 2) == KEMPE_OK);
        CHECK(kempe_stepper_advance(a, 0.02 * k) == KEMPE_OK && kempe_stepper_advance(b, 0.02 * k) == KEMPE_OK);
    }
    CHECK(kempe_stepper_work(a).rhs + 98 <= kempe_stepper_work(b).rhs);
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    scene_free(&s);
}

int main(void)
{
    TEST(one_radian_a_second);
    TEST(rotor_under_control);
    TEST(two_masses_under_control);
    TEST(cart_pole_under_control);
    TEST(multistep_methods_return);
    TEST(saved_and_restored);
    TEST(copies);
    TEST(another_state);
    TEST(other_parameters);
    TEST(stops);
    TEST(driven);
    TEST(mistakes);
    TEST(equal_values_need_no_restart);
    return check_report();
}
