/* SPDX-License-Identifier: BSD-3-Clause */
/* Small motions of models with sampled states: the map from one sample to the next against closed forms and against
 * runs of linear models, limits of stability, equilibria, modes, frequency responses. */
#include "analyses/dense/exponential.h"
#include "loaded.h"
#include <complex.h>
#include <kempe/equilibrium.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>

/* A rotor under a sampled controller of angle and rate. */
#define ROTOR                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "parameters: {Kp: 2, Kd: 0.1, J: 0.01, target: 1}\n"                                                               \
    "states: {u: {sample: %.17g, next: Kp*(target - q(A)) - Kd*qd(A)}}\n"                                              \
    "bodies: {rotor: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: J}}}\n"                        \
    "forces: {motor: {joint: A, torque: u}}\n"

static kempe_linearization *linearize(const loaded *l, const char *inputs, const char *outputs)
{
    kempe_linearization *x = NULL;
    const kempe_linearize_options options = {.inputs = inputs, .outputs = outputs};
    kempe_status status = l->system ? kempe_linearization_new(l->system, &options, &x) : KEMPE_E_ARGUMENT;
    if (status != KEMPE_OK)
        printf("  %s\n", kempe_context_message(l->context));
    CHECK(status == KEMPE_OK);
    return x;
}

static const double *matrix_of(const kempe_linearization *x, kempe_matrix matrix, int rows, int columns)
{
    int found_rows = 0, found_columns = 0;
    const double *values = kempe_linearization_matrix(x, matrix, &found_rows, &found_columns);
    CHECK(values && found_rows == rows && found_columns == columns);
    return found_rows == rows && found_columns == columns ? values : NULL;
}

static double largest(const kempe_linearization *x, int count)
{
    const double *z = matrix_of(x, KEMPE_MATRIX_Z, count, 2);
    double most = 0;
    for (int k = 0; z && k < count; k++)
        most = fmax(most, hypot(z[k], z[k + count]));
    return z ? most : NAN;
}

/* Between samples the torque is constant: q + T qd + T^2/(2 J) u, qd + T/J u, with u = -Kp q - Kd qd. */
static void map_of_a_rotor(void)
{
    const double T = 0.01, Kp = 2, Kd = 0.1, J = 0.01;
    const double want[9] = {
        1 - Kp * T * T / (2 * J), -Kp * T / J, -Kp, T - Kd * T * T / (2 * J), 1 - Kd * T / J, -Kd, 0, 0, 0};
    char text[1024];
    (void)snprintf(text, sizeof text, ROTOR, T);
    loaded l = load_text(text);
    kempe_linearization *x = linearize(&l, "target", "q(A)");
    CHECK(kempe_linearization_sample_time(x) == T);
    const double *a = matrix_of(x, KEMPE_MATRIX_A, 3, 3), *b = matrix_of(x, KEMPE_MATRIX_B, 3, 1);
    const double input[3] = {Kp * T * T / (2 * J), Kp * T / J, Kp};
    for (int k = 0; a && k < 9; k++)
        CHECK(fabs(a[k] - want[k]) <= 1e-14);
    for (int k = 0; b && k < 3; k++)
        CHECK(fabs(b[k] - input[k]) <= 1e-14);
    const double *c = matrix_of(x, KEMPE_MATRIX_C, 1, 3);
    CHECK(c && c[0] == 1 && c[1] == 0 && c[2] == 0);
    matrix_of(x, KEMPE_MATRIX_M, 0, 0);
    kempe_linearization_free(x);
    unload(&l);
}

/* The rotor is stable for T < min(2 J/Kd, 2 Kd/Kp) = 0.1: the map's determinant is 1 - T Kd/J + T^2 Kp/(2 J), and at z
 * = -1 its polynomial is 4 - 2 T Kd/J. Both limits are met at once here, with other gains one after the other. */
static void limit_of_stability(void)
{
    static const struct {
        double Kp, Kd, limit;
    } gains[] = {{2, 0.1, 0.1}, {0.5, 0.1, 0.2}, {8, 0.1, 0.025}, {2, 0.4, 0.05}};
    for (int k = 0; k < 4; k++)
        for (int side = -1; side <= 1; side += 2) {
            char text[1024], set[64];
            double limit = fmin(2 * 0.01 / gains[k].Kd, 2 * gains[k].Kd / gains[k].Kp), T = limit * (1 + side * 1e-6);
            (void)snprintf(set, sizeof set, "{Kp: %g, Kd: %g,", gains[k].Kp, gains[k].Kd);
            (void)snprintf(text, sizeof text, ROTOR, T);
            char *from = strstr(text, "{Kp: 2, Kd: 0.1,"), rest[1024];
            (void)snprintf(rest, sizeof rest, "%s", from + strlen("{Kp: 2, Kd: 0.1,"));
            (void)snprintf(from, sizeof text - (size_t)(from - text), "%s%s", set, rest);
            loaded l = load_text(text);
            kempe_linearization *x = linearize(&l, NULL, NULL);
            CHECK(side < 0 ? largest(x, 3) < 1 : largest(x, 3) > 1);
            CHECK_NEAR(largest(x, 3), 1, k == 0 ? 3e-3 : 1e-4); /* a double z = -1: the root of 1e-6 */
            kempe_equilibrium *e = NULL;
            CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
            CHECK_TEXT(kempe_equilibrium_stability(e, 0), side < 0 ? "stable" : "unstable");
            kempe_equilibrium_free(e);
            kempe_linearization_free(x);
            unload(&l);
        }
}

/* A cart on a spring under a sampled controller rests where both balance: 50 x = 200 (0.3 - x). */
static void equilibrium_of_a_cart(void)
{
    loaded l = load_text("kempe: 1\n"
                         "states: {u: {sample: 20 ms, next: 200*(0.3 - q(x)) - 40*qd(x)}}\n"
                         "bodies: {cart: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                         "forces: {spring: {joint: x, spring: {stiffness: 50}}, drive: {joint: x, force: u}}\n");
    kempe_equilibrium *e = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
    CHECK_TEXT(kempe_equilibrium_stability(e, 0), "stable");
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    CHECK_NEAR(table ? kempe_table_number(table, 0, kempe_table_find(table, "q.x")) : NAN, 0.24, 1e-13);
    CHECK_NEAR(table ? kempe_table_number(table, 0, kempe_table_find(table, "state.u")) : NAN, 12, 1e-12);
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    /* x'' + 25 x = u/2 in closed form */
    kempe_linearization *x = linearize(&l, NULL, NULL);
    const double w = 5, T = 0.02, c = cos(w * T), s = sin(w * T), by_u = (1 - c) / 50, rate_by_u = s / 10;
    const double want[6] = {c - 200 * by_u, -w * s - 200 * rate_by_u, -200, s / w - 40 * by_u, c - 40 * rate_by_u, -40};
    const double *a = matrix_of(x, KEMPE_MATRIX_A, 3, 3);
    for (int k = 0; a && k < 6; k++)
        CHECK(fabs(a[k] - want[k]) <= 1e-12 * fmax(1, fabs(want[k])));
    kempe_linearization_free(x);
    unload(&l);
}

/* Two sample times, a filter, a delay: a linear model, whose run over the common period of 60 ms is the map times its
 * start. An input moves it from rest by B. */
#define RATES                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "parameters: {r: %g}\n"                                                                                            \
    "states:\n"                                                                                                        \
    "  f: {start: %g, rate: (q(x) - f)/0.05, scale: 1}\n"                                                              \
    "  u: {start: %g, sample: 20 ms, next: 30*(r - w) - 2*qd(x)}\n"                                                    \
    "  w: {start: %g, sample: 30 ms, next: f}\n"                                                                       \
    "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"                                             \
    "forces: {s: {joint: x, spring: {stiffness: 40, damping: 1}}, d: {joint: x, force: u}}\n"                          \
    "start: {q: {x: %g}, qd: {x: %g}}\n"                                                                               \
    "run: {t_end: 0.06, output_step: 0.06, rtol: 1e-12, atol: 1e-12, integrator: dop853}\n"

static void end_of_run(double r, const double start[5], double end[5])
{
    char text[1024];
    kempe_trajectory *t = NULL;
    const kempe_run_options options = {.no_convergence_check = 1};
    (void)snprintf(text, sizeof text, RATES, r, start[2], start[3], start[4], start[0], start[1]);
    loaded l = load_text(text);
    CHECK(l.system && kempe_simulate(l.system, &options, &t) == KEMPE_OK);
    for (int k = 0; k < 5; k++)
        end[k] = t ? k == 0 ? kempe_trajectory_q(t, 1)[0] : kempe_trajectory_qd(t, 1)[k - 1] : NAN;
    kempe_trajectory_free(t);
    unload(&l);
}

static void several_rates(void)
{
    static const double rest[5];
    char text[1024];
    double end[5];
    (void)snprintf(text, sizeof text, RATES, 0., 0., 0., 0., 0., 0.);
    loaded l = load_text(text);
    kempe_linearization *x = linearize(&l, "r", NULL);
    CHECK_NEAR(kempe_linearization_sample_time(x), 0.06, 1e-14);
    const double *a = matrix_of(x, KEMPE_MATRIX_A, 5, 5), *b = matrix_of(x, KEMPE_MATRIX_B, 5, 1);
    for (int j = 0; a && j < 5; j++) {
        double start[5] = {0};
        start[j] = 1;
        end_of_run(0, start, end);
        for (int i = 0; i < 5; i++)
            CHECK(fabs(a[i + 5 * j] - end[i]) <= 1e-10 * fmax(1, fabs(end[i])));
    }
    end_of_run(1, rest, end);
    for (int i = 0; b && i < 5; i++)
        CHECK(fabs(b[i] - end[i]) <= 1e-10 * fmax(1, fabs(end[i])));
    kempe_linearization_free(x);
    unload(&l);
}

/* exp of a rotation, of a nilpotent matrix and of one of very different sizes. */
static void exponential(void)
{
    double e[9];
    CHECK(kmp_exponential(2, (const double[]){0, 1, -1, 0}, 30, e) == 0);
    CHECK_NEAR(e[0], cos(30), 1e-13);
    CHECK_NEAR(e[1], sin(30), 1e-13);
    CHECK(kmp_exponential(3, (const double[]){0, 0, 0, 1e6, 0, 0, 0, 1e-3, 0}, 2, e) == 0);
    CHECK_NEAR(e[3], 2e6, 1e-15);
    CHECK_NEAR(e[6], 2e3, 1e-15);
    CHECK(kmp_exponential(2, (const double[]){-3, 0, 1e9, -5}, 1, e) == 0);
    CHECK_NEAR(e[0], exp(-3), 1e-14);
    CHECK_NEAR(e[2], 1e9 * (exp(-3) - exp(-5)) / 2, 1e-13);
    CHECK(kmp_exponential(1, (const double[]){INFINITY}, 1, e) == -1);
}

/* At an equilibrium a state of events keeps its start value: x = y/k, unless the event is there, or hysteresis has
 * another value. */
static void at_events(void)
{
    static const struct {
        const char *state, *word;
        double x; /* NAN: refused */
    } cases[] = {{"start: 3, when: q(x) > 0.5, next: 9", "", 0.3},
                 {"start: 5, when: q(x) > 0.5, next: 9", "the state 'y' switches exactly at this point", NAN},
                 {"start: 7, when: q(x) > 0.5, next: 9", "", 0.7},
                 {"start: 3, when: \"1e-9 + q(x) >= 0.3\", next: 9", "exactly at this point", NAN},
                 {"start: 4, hysteresis: q(x), limits: [0.1, 0.2], values: [2, 4]", "", 0.4},
                 {"start: 2, hysteresis: q(x), limits: [0.1, 0.3], values: [2, 4]", "", 0.2},
                 {"start: 2, hysteresis: q(x), limits: [0.1, 0.15], values: [2, 4]",
                  "'y' begins with 2, but its input requires 4 there: give it 'start: 4'", NAN}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[600];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nstates: {y: {%s}}\n"
                       "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                       "forces: {f: {joint: x, force: y - 10*q(x) - 0.5*qd(x)}}\n",
                       cases[k].state);
        loaded l = load_text(text);
        kempe_equilibrium *e = NULL;
        kempe_table *table = NULL;
        kempe_status status = l.system ? kempe_equilibrium_new(l.system, NULL, &e) : KEMPE_E_MEMORY;
        CHECK(status == (isnan(cases[k].x) ? KEMPE_E_FAILED : KEMPE_OK));
        if (status == KEMPE_OK) {
            CHECK(kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
            CHECK_NEAR(kempe_table_number(table, 0, kempe_table_find(table, "q.x")), cases[k].x, 1e-12);
            CHECK_TEXT(kempe_equilibrium_stability(e, 0), "stable");
        } else {
            CHECK(strstr(kempe_context_message(l.context), cases[k].word) != NULL);
        }
        kempe_table_free(table);
        kempe_equilibrium_free(e);
        unload(&l);
    }
}

static void rejected(void)
{
    kempe_linearization *x = NULL;
    loaded l = load_text("kempe: 1\nstates: {y: {start: 0.5, when: q(x) > 0.5, next: 2}}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: x, force: y - q(x)}}\n");
    CHECK(l.system && kempe_linearization_new(l.system, NULL, &x) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "the state 'y' switches exactly at this point") != NULL);
    unload(&l);
    l = load_text("kempe: 1\nstates: {y: {sample: 0.1, next: q(x)}, z: {sample: 0.07071067811865, next: y}}\n"
                  "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                  "forces: {s: {joint: x, spring: {stiffness: 40, damping: 1}}}\n");
    CHECK(l.system && kempe_linearization_new(l.system, NULL, &x) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "no common multiple") != NULL);
    unload(&l);
}

/* -- modes ------------------------------------------------------------------------------------------- */

static double cell(const kempe_table *table, int row, const char *column)
{
    int k = table ? kempe_table_find(table, column) : -1;
    return k < 0 || row >= kempe_table_row_count(table) ? NAN : kempe_table_number(table, row, k);
}

static kempe_table *modes_of(const loaded *l, const kempe_modes_options *options, const char *name, kempe_modes **modes)
{
    kempe_table *table = NULL;
    *modes = NULL;
    kempe_status status = l->system ? kempe_modes_new(l->system, options, modes) : KEMPE_E_ARGUMENT;
    if (status != KEMPE_OK)
        printf("  %s\n", kempe_context_message(l->context));
    CHECK(status == KEMPE_OK);
    CHECK(*modes && kempe_modes_table(*modes, name, &table) == KEMPE_OK);
    return table;
}

/* z^2 - (2 - T Kd/J - T^2 Kp/(2 J)) z + (1 - T Kd/J + T^2 Kp/(2 J)) = 0, and z = 0 of the value before the sample,
 * which the sample replaces. Of an eigenvector z u = -Kp q - Kd qd, z q = q + T qd + T^2/(2 J) z u. */
static void modes_of_a_rotor(void)
{
    const double T = 0.01, Kp = 2, Kd = 0.1, J = 0.01;
    char text[1024];
    (void)snprintf(text, sizeof text, ROTOR, T);
    loaded l = load_text(text);
    kempe_modes *modes;
    kempe_table *table = modes_of(&l, NULL, "modes", &modes);
    double half = 1 - T * Kd / (2 * J) - T * T * Kp / (4 * J), product = 1 - T * Kd / J + T * T * Kp / (2 * J);
    double complex z = half + csqrt(half * half - product), s = clog(z) / T;
    CHECK(table && kempe_table_row_count(table) == 3);
    CHECK(kempe_modes_zero_count(modes) == 0 && !kempe_modes_is_unstable(modes));
    CHECK_NEAR(cell(table, 0, "z.re"), creal(z), 1e-13);
    CHECK_NEAR(cell(table, 0, "z.im"), cimag(z), 1e-13);
    CHECK_NEAR(cell(table, 1, "z.im"), -cimag(z), 1e-13);
    CHECK_NEAR(cell(table, 0, "re"), creal(s), 1e-11);
    CHECK_NEAR(cell(table, 0, "frequency"), cimag(s) / (2 * acos(-1)), 1e-12);
    CHECK_NEAR(cell(table, 0, "damping"), -creal(s) / cabs(s), 1e-12);
    CHECK_NEAR(cell(table, 2, "z.re"), 0, 1e-15);
    double complex q = cell(table, 0, "re.A") + I * cell(table, 0, "im.A");
    double complex u = cell(table, 0, "re.u") + I * cell(table, 0, "im.u");
    double complex qd = (z * q - q - T * T / (2 * J) * z * u) / T;
    CHECK(cabs(q) > 0.1 && cabs(z * u + Kp * q + Kd * qd) <= 1e-12);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* Over the gain of the rate the rotor is stable between Kp T/2, where |z| = 1, and 2 J/T, where z = -1: the frequency
 * there is half of that of the samples. */
static void critical_gains(void)
{
    const double T = 0.01, Kp = 2, J = 0.01;
    char text[1024];
    (void)snprintf(text, sizeof text, ROTOR, T);
    loaded l = load_text(text);
    kempe_modes *modes;
    kempe_table *table = modes_of(&l, &(kempe_modes_options){.sweep = "Kd=0:3:31"}, "critical", &modes);
    CHECK(table && kempe_table_row_count(table) == 2);
    CHECK_NEAR(cell(table, 0, "value"), Kp * T / 2, 1e-11);
    CHECK_NEAR(cell(table, 0, "frequency"), acos(1 - T * T * Kp / (2 * J)) / T / (2 * acos(-1)), 1e-9);
    CHECK_NEAR(cell(table, 1, "value"), 2 * J / T, 1e-11);
    CHECK_NEAR(cell(table, 1, "frequency"), 0.5 / T, 1e-9);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* A cart whose speed is controlled, and a free one: z = 1 of the place of the first, twice of the second, exactly; the
 * speed is multiplied by 1 - Kd T/m = 0.6. */
static void free_motion(void)
{
    loaded l = load_text("kempe: 1\n"
                         "states: {u: {sample: 20 ms, next: -40*qd(x)}}\n"
                         "bodies:\n"
                         "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 2}\n"
                         "  free: {joint: {name: y, prismatic: x, at: ground}, mass: 2}\n"
                         "forces: {drive: {joint: x, force: u}}\n");
    kempe_modes *modes;
    kempe_table *table = modes_of(&l, NULL, "modes", &modes);
    CHECK(kempe_modes_zero_count(modes) == 3);
    for (int k = 0; k < 3; k++)
        CHECK(cell(table, k, "z.re") == 1 && cell(table, k, "z.im") == 0 && cell(table, k, "re") == 0);
    CHECK_NEAR(cell(table, 3, "z.re"), 0.6, 1e-12);
    CHECK_NEAR(cell(table, 3, "re"), log(0.6) / 0.02, 1e-9);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* A cart on a spring under a sampled controller, x = K r/(k + K), u = k x: derivatives of its rest by the gain. Runs
 * are refused. */
static void sensitivity_of_rest(void)
{
    loaded l = load_text("kempe: 1\n"
                         "parameters: {K: 200, k: 50, r: 0.3}\n"
                         "states: {u: {sample: 20 ms, next: K*(r - q(x)) - 40*qd(x)}}\n"
                         "bodies: {cart: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                         "forces: {spring: {joint: x, spring: {stiffness: k}}, drive: {joint: x, force: u}}\n");
    const double K = 200, k = 50, r = 0.3, sum = K + k;
    kempe_sensitivity_options asked = {.of = "equilibrium", .parameters = "K,k", .outputs = "q(x),u"};
    kempe_sensitivity *s = NULL;
    kempe_table *table = NULL;
    CHECK(l.model && kempe_sensitivity_new(l.model, &asked, &s) == KEMPE_OK);
    CHECK(s && kempe_sensitivity_table(s, "rows", &table) == KEMPE_OK);
    CHECK_NEAR(cell(table, 0, "q.x"), K * r / sum, 1e-13);
    CHECK_NEAR(cell(table, 0, "q.x/K"), k * r / (sum * sum), 1e-12);
    CHECK_NEAR(cell(table, 0, "q.x/k"), -K * r / (sum * sum), 1e-12);
    CHECK_NEAR(cell(table, 0, "state.u/K"), k * k * r / (sum * sum), 1e-12);
    kempe_table_free(table);
    kempe_sensitivity_free(s);
    s = NULL;
    asked.of = "modes";
    CHECK(l.model && kempe_sensitivity_new(l.model, &asked, &s) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "state 'u' is sampled"));
    unload(&l);
}

/* -- frequency response ------------------------------------------------------------------------------ */

/* x(k+1) = A x + b r of the rotor with x = (q, qd), and q = (1, 0) (z - A)^-1 b r; before the next sample its torque is
 * u = z^-1 (-Kp q - Kd qd + Kp r). */
static void rotor_response(double hz, double complex *q, double complex *u)
{
    const double T = 0.01, Kp = 2, Kd = 0.1, J = 0.01, place = T * T / (2 * J), speed = T / J;
    double complex z = cexp(2 * acos(-1) * hz * T * I);
    double complex a = z - 1 + place * Kp, b = place * Kd - T, c = speed * Kp, d = z - 1 + speed * Kd;
    double complex det = a * d - b * c, qd = (a * speed * Kp - c * place * Kp) / det;
    *q = (d * place * Kp - b * speed * Kp) / det;
    *u = (Kp - Kp * *q - Kd * qd) / z;
}

static void check_answer(const kempe_table *table, int row, const char *of, double complex want)
{
    char column[64];
    (void)snprintf(column, sizeof column, "%s/target.amplitude", of);
    CHECK_NEAR(cell(table, row, column), cabs(want), 1e-11 * fmax(1, cabs(want)));
    (void)snprintf(column, sizeof column, "%s/target.phase", of);
    double turn = cell(table, row, column) - carg(want) * 180 / acos(-1);
    CHECK(cabs(want) < 1e-9 || fabs(remainder(turn, 360)) <= 1e-8);
}

static void response_of_a_rotor(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text, ROTOR, 0.01);
    loaded l = load_text(text);
    kempe_response *r = NULL;
    kempe_response_options asked = {.inputs = "target", .outputs = "q(A),u", .frequencies = "0:50:26", .linear = 1};
    CHECK(l.system && kempe_response_new(l.system, &asked, &r) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(r && kempe_response_table(r, "rows", &table) == KEMPE_OK);
    CHECK(table && kempe_table_row_count(table) == 26);
    for (int k = 0; k < 26; k++) {
        double complex q, u;
        rotor_response(2 * k, &q, &u);
        check_answer(table, k, "q.A", q);
        check_answer(table, k, "state.u", u);
    }
    kempe_table_free(table);
    table = NULL;
    CHECK(r && kempe_response_table(r, "peaks", &table) == KEMPE_OK);
    double best = cell(table, 0, "frequency");
    double complex q, aside, u;
    rotor_response(best, &q, &u);
    CHECK(cell(table, 0, "amplitude") > 1.5 && fabs(cell(table, 0, "amplitude") - cabs(q)) <= 1e-11);
    for (int side = -1; side <= 1; side += 2) {
        rotor_response(best * (1 + side * 1e-4), &aside, &u);
        CHECK(cabs(aside) < cabs(q));
    }
    kempe_table_free(table);
    kempe_response_free(r);
    r = NULL;
    asked.frequencies = "0:50.1:26";
    CHECK(l.system && kempe_response_new(l.system, &asked, &r) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "below half the sampling frequency, 50 Hz"));
    unload(&l);
}

int main(void)
{
    TEST(map_of_a_rotor);
    TEST(limit_of_stability);
    TEST(equilibrium_of_a_cart);
    TEST(several_rates);
    TEST(exponential);
    TEST(at_events);
    TEST(rejected);
    TEST(modes_of_a_rotor);
    TEST(critical_gains);
    TEST(free_motion);
    TEST(sensitivity_of_rest);
    TEST(response_of_a_rotor);
    return check_report();
}
