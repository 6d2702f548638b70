/* SPDX-License-Identifier: BSD-3-Clause */
/* Inputs act from the time at which they are set, on every method and at times of any kind. */
#include "sampled.h"
#include <stdlib.h>

static const char rotor[] = "kempe: 1\ninputs: {u: {unit: N*m}}\n"
                            "bodies: {wheel: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                            "forces: {motor: {joint: A, torque: u}}\n";

/* 1 N m from 1 s to 2 s on 1 kg m2: 1 rad/s from there on, at every sampling rate. */
static void one_radian_a_second(void)
{
    static const double rates[] = {4, 20, 100, 1000};
    loaded s = load_text(rotor);
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
    unload(&s);
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
    loaded s = load_text(p->text);
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
    unload(&s);
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

/* -- a nonlinear system, against digits of a program of its own ------------------------------------------ */

/* Rows of examples/cart_pole/controlled.csv: t, x, phi, their rates, u. */
enum { SAMPLES = 151, COLUMNS = 6 };

static void read_controlled(double row[SAMPLES][COLUMNS])
{
    FILE *file = fopen(KEMPE_ROOT "/examples/cart_pole/controlled.csv", "r");
    char line[512];
    int rows = 0;
    CHECK(file != NULL);
    while (file && fgets(line, sizeof line, file)) {
        const char *at = line;
        char *end = line;
        bool number = *at >= '0' && *at <= '9';
        for (int k = 0; number && k < COLUMNS && rows < SAMPLES; k++, at = end + 1)
            row[rows][k] = strtod(at, &end);
        rows += number;
    }
    CHECK(rows == SAMPLES);
    if (file)
        (void)fclose(file);
}

/* The law of reference_cart_pole.c. */
static double balance(const double *q, const double *qd, const int at[2])
{
    return 4 * q[at[0]] - 70 * q[at[1]] + 8 * qd[at[0]] - 16 * qd[at[1]];
}

/* The model's motion under control against the digits, with coordinates `phi` and `x` at these places. */
static void balanced(loaded *s, const int at[2])
{
    static double row[SAMPLES][COLUMNS];
    read_controlled(row);
    for (int m = 0; m < METHODS; m++)
        for (int fine = 0; fine < 2; fine++) {
            const double rtol = fine ? 1e-9 : 1e-6;
            kempe_stepper *stepper = NULL;
            kempe_run_options run = options(&methods[m], 4, rtol);
            double error = 0;
            CHECK(kempe_stepper_new(s->system, &run, &stepper) == KEMPE_OK);
            for (int k = 1; k < SAMPLES && stepper; k++) {
                const double *q = kempe_stepper_q(stepper), *qd = kempe_stepper_qd(stepper);
                CHECK(kempe_stepper_set_input(stepper, 0, balance(q, qd, at)) == KEMPE_OK);
                CHECK(kempe_stepper_advance(stepper, row[k][0]) == KEMPE_OK);
                for (int i = 0; i < 2; i++)
                    error = check_max(error, fabs(kempe_stepper_q(stepper)[at[i]] - row[k][1 + i]));
            }
            if (!(error < 10 * rtol))
                printf("  %s %s %s: error %.2g rtol at %g\n", methods[m].formulation,
                       methods[m].form ? methods[m].form : "", methods[m].integrator, error / rtol, rtol);
            CHECK(error < 10 * rtol);
            kempe_stepper_free(stepper);
        }
}

static void pole_on_a_cart(void)
{
    loaded s = load("examples/cart_pole/cart_pole.yaml");
    balanced(&s, (const int[]){0, 1});
    unload(&s);
}

/* The same pole moves by itself in the plane, and a closed loop holds its foot on the cart. */
static void pole_in_a_closed_loop(void)
{
    loaded s = load_text("kempe: 1\ngravity: [0, -9.81, 0]\ninputs: {u: {unit: N}}\nbodies:\n"
                         "  pole: {joint: {name: P, motions: [T1, T2, R3], at: ground}, mass: 0.3, com: [0, 0.4, 0], "
                         "inertia: {zz: 0.016}, points: {foot: [0, 0, 0]}}\n"
                         "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 1.5, points: {pin: [0, 0, 0]}}\n"
                         "loops: {pin: {ball: [cart.pin, pole.foot]}}\n"
                         "forces: {push: {joint: x, force: u}}\nstart: {q: {P.3: 0.6}, hold: [P.3, x]}\n");
    balanced(&s, (const int[]){3, 2});
    unload(&s);
}

/* A multistep method returns when its input has stopped to jump, and ends with its own steps. */
static void multistep_methods_return(void)
{
    static const method multistep[] = {
        {"reduced", "newton", "adams"}, {"reduced", "newton", "bdf"}, {"dae", "stabilized1", "ida"}};
    loaded s = load_text("kempe: 1\ngravity: [0, -9.81, 0]\ninputs: {u: {unit: N*m}}\n"
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
    unload(&s);
}

/* -- drives, mistakes --------------------------------------------------------------------------- */

/* A driven cart is accelerated by pieces: 0.5 a s^2 + v s in each. A jump of value or rate is refused. */
static void driven(void)
{
    loaded s = load_text("kempe: 1\ninputs: {x: {unit: m}}\n"
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
    unload(&s);
}

static void mistakes(void)
{
    loaded s = load_text(rotor);
    kempe_stepper *a = NULL;
    kempe_run_options run = options(&methods[0], 1, 1e-8);
    CHECK(kempe_model_input_find(s.model, "u") == 0 && kempe_model_input_find(s.model, "v") == -1);
    CHECK(kempe_model_input_count(s.model) == 1 && strcmp(kempe_model_input_unit(s.model, 0), "N*m") == 0);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(kempe_stepper_set_input(a, 1, 0) == KEMPE_E_ARGUMENT && kempe_stepper_set_input(a, -1, 0) != KEMPE_OK);
    CHECK(kempe_stepper_set_input(a, 0, NAN) == KEMPE_E_ARGUMENT);
    CHECK(isnan(kempe_stepper_input(a, 1)) && kempe_stepper_input(a, 0) == 0);
    kempe_stepper_free(a);
    unload(&s);
}

/* An input that does not change costs no restart: the steps end at the samples, and no more evaluations are made. */
static void equal_values_need_no_restart(void)
{
    loaded s = load_text(rotor);
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
    unload(&s);
}

int main(void)
{
    TEST(one_radian_a_second);
    TEST(rotor_under_control);
    TEST(two_masses_under_control);
    TEST(cart_pole_under_control);
    TEST(pole_on_a_cart);
    TEST(pole_in_a_closed_loop);
    TEST(multistep_methods_return);
    TEST(driven);
    TEST(mistakes);
    TEST(equal_values_need_no_restart);
    return check_report();
}
