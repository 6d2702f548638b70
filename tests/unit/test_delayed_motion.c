/* SPDX-License-Identifier: BSD-3-Clause */
/* Small motions with delays: eigenvalues against branches of Lambert's W, limits of stability of an oscillator with
 * delayed feedback and roots that a search over the plane finds; state spaces against closed forms and responses. */
#include "known_matrices.h"
#include "loaded.h"
#include <complex.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>
#include <stdlib.h>

#define BODY "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"

/* x'' + c x' + x = g x(t - T) */
#define OSCILLATOR                                                                                                     \
    "kempe: 1\nparameters: {g: 0.3, T: 2, c: 0.1}\nstates: {late: {delay: q(x), time: T}}\n" BODY                      \
    "forces: {f: {joint: x, force: g*late - q(x) - c*qd(x)}}\n"

static const double turn = 6.28318530717958647692;

static double cell(const kempe_table *table, int row, const char *column)
{
    int k = table ? kempe_table_find(table, column) : -1;
    return k < 0 || row >= kempe_table_row_count(table) ? NAN : kempe_table_number(table, row, k);
}

static kempe_modes *modes_of(const loaded *l, const char *sweep, const char *name, kempe_table **table)
{
    kempe_modes *modes = NULL;
    const kempe_modes_options options = {.sweep = sweep};
    *table = NULL;
    kempe_status status = l->system ? kempe_modes_new(l->system, &options, &modes) : KEMPE_E_ARGUMENT;
    if (status != KEMPE_OK)
        printf("  %s\n", kempe_context_message(l->context));
    CHECK(status == KEMPE_OK);
    CHECK(modes && kempe_modes_table(modes, name, table) == KEMPE_OK);
    return modes;
}

/* The number of eigenvalues within `near` of s, relative. */
static int count_near(const kempe_table *table, double complex s, double near)
{
    int count = 0;
    for (int k = 0; table && k < kempe_table_row_count(table); k++)
        count += cabs(cell(table, k, "re") + I * cell(table, k, "im") - s) <= near * cabs(s);
    return count;
}

/* Branch k of W exp(W) = z (Corless et al. 1996: its asymptotic start, then Halley's method). */
static double complex lambert(double complex z, int k)
{
    double complex w = clog(z) + I * turn * k;
    w -= cabs(w) > 0.5 ? clog(w) : 0;
    for (int i = 0; i < 100; i++) {
        const double complex e = cexp(w), f = w * e - z;
        w -= f / (e * (w + 1) - (w + 2) * f / (2 * w + 2));
    }
    return w;
}

/* y' = -a y(t - T): s = W_k(-a T)/T; beside it an oscillator of its own. The four rightmost pairs are listed. */
static void branches_of_lambert(void)
{
    static const double cases[][2] = {{1.2, 1}, {0.2, 1}, {0.01, 3}, {5, 0.1}, {40, 0.2}, {2e3, 1e-4}, {-1, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double a = cases[i][0], T = cases[i][1];
        char text[600];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nstates: {late: {delay: y, time: %.17g}, y: {rate: -(%.17g)*late}}\n" BODY
                       "forces: {f: {joint: x, force: -25*q(x) - 0.01*qd(x)}}\n",
                       T, a);
        loaded l = load_text(text);
        kempe_table *table = NULL;
        kempe_modes *modes = modes_of(&l, NULL, "modes", &table);
        for (int k = -2; k < 2; k++) {
            const double complex s = lambert(-a * T, k) / T;
            CHECK_NEAR(cabs(s + a * cexp(-s * T)), 0, 1e-11 * cabs(s));
            CHECK(count_near(table, s, 1e-11) == 1);
            CHECK(count_near(table, conj(s), 1e-11) == 1);
        }
        CHECK(count_near(table, -0.005 + I * sqrt(25 - 0.005 * 0.005), 1e-12) == 1);
        kempe_table_free(table);
        kempe_modes_free(modes);
        unload(&l);
    }
}

/* On the axis g^2 = (1 - w^2)^2 + c^2 w^2 and g e^(-i w T) = 1 - w^2 + i c w: both frequencies and all their T. */
static void limits_of_an_oscillator(void)
{
    const double g = 0.3, c = 0.1, root = sqrt(g * g - c * c + 0.25 * c * c * c * c);
    double want[2][2]; /* by frequency: the first two times */
    for (int k = 0; k < 2; k++) {
        const double w = sqrt(1 - 0.5 * c * c + (k ? -root : root));
        double angle = -carg((1 - w * w) + I * c * w);
        angle += angle < 0 ? turn : 0;
        want[k][0] = angle / w;
        want[k][1] = (angle + turn) / w;
    }
    static const char *const sweeps[] = {"T=2:8.5:14", "T=11:6.9:30"};
    for (int i = 0; i < 2; i++) {
        loaded l = load_text(OSCILLATOR);
        kempe_table *table = NULL;
        kempe_modes *modes = modes_of(&l, sweeps[i], "critical", &table);
        CHECK(kempe_table_row_count(table) == 2);
        for (int k = 0; k < kempe_table_row_count(table); k++) {
            const double found = cell(table, k, "value"), w = turn * cell(table, k, "frequency");
            const int slow = w < 1;
            const double near =
                fabs(found - want[slow][0]) < fabs(found - want[slow][1]) ? want[slow][0] : want[slow][1];
            CHECK_NEAR(found, near, 1e-10 * near);
            CHECK_NEAR(w * w, 1 - 0.5 * c * c + (slow ? -root : root), 1e-10);
        }
        kempe_table_free(table);
        kempe_modes_free(modes);
        unload(&l);
    }
    loaded l = load_text(OSCILLATOR); /* s = 0 at g = 1 */
    kempe_table *table = NULL;
    kempe_modes *modes = modes_of(&l, "g=0.9:1.1:5", "critical", &table);
    int found = 0;
    for (int k = 0; k < kempe_table_row_count(table); k++)
        if (cell(table, k, "im") == 0) {
            CHECK_NEAR(cell(table, k, "value"), 1, 1e-10);
            found++;
        }
    CHECK(found == 1);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

static double complex oscillator(double complex s, double complex *slope)
{
    const double complex past = 0.3 * cexp(-2 * s);
    *slope = 2 * s + 0.1 + 2 * past;
    return s * s + 0.1 * s + 1 - past;
}

/* Roots that Newton's method finds from a grid over the plane: each one to the right of the bound is listed, and no
 * other. */
static void none_is_absent(void)
{
    loaded l = load_text(OSCILLATOR);
    kempe_table *table = NULL;
    kempe_modes *modes = modes_of(&l, NULL, "modes", &table);
    char *json = NULL;
    CHECK(modes && kempe_modes_print(modes, KEMPE_JSON, &json) == KEMPE_OK);
    const char *at = json ? strstr(json, "\"bound\": ") : NULL;
    const double bound = at ? strtod(at + 9, NULL) : NAN;
    double complex known[200];
    int count = 0;
    CHECK(bound < -2 && bound > -10);
    for (int i = 0; i < 60; i++)
        for (int j = 0; j < 200; j++) {
            double complex s = bound - 1 + 0.15 * i + 0.25 * j * I, slope;
            for (int step = 0; step < 40; step++) {
                const double complex f = oscillator(s, &slope);
                s -= f / slope;
            }
            if (!(cabs(oscillator(s, &slope)) < 1e-9) || creal(s) < bound || cimag(s) < -1e-9)
                continue;
            bool is_new = count < 200;
            for (int k = 0; k < count; k++)
                is_new = is_new && cabs(known[k] - s) > 1e-6;
            if (is_new)
                known[count++] = s;
        }
    int listed = 0;
    for (int k = 0; k < count; k++) {
        CHECK(count_near(table, known[k], 1e-11) == 1);
        listed += fabs(cimag(known[k])) > 1e-9 ? 2 : 1;
    }
    CHECK(count > 4 && listed == kempe_table_row_count(table));
    kempe_text_free(json);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* Two equal oscillators have each root twice, real ones too; a free mass has two zeros, and a held state none. */
static void repeated_and_zero(void)
{
    loaded l = load_text("kempe: 1\n"
                         "states:\n"
                         "  a: {delay: q(x), time: 1}\n"
                         "  b: {delay: q(y), time: 1}\n"
                         "  D: {start: 2, when: q(x) > 0.5, next: 9}\n"
                         "bodies:\n"
                         "  m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                         "  n: {joint: {name: y, prismatic: y, at: ground}, mass: 1}\n"
                         "  z: {joint: {name: z, prismatic: y, at: ground}, mass: 1}\n"
                         "forces:\n"
                         "  f: {joint: x, force: 0.1*D*a - 2*D*q(x) - 0.5*qd(x)}\n"
                         "  g: {joint: y, force: 0.2*b - 4*q(y) - 0.5*qd(y)}\n");
    kempe_table *table = NULL;
    kempe_modes *modes = modes_of(&l, NULL, "modes", &table);
    CHECK(modes && kempe_modes_zero_count(modes) == 2);
    for (int k = 2; table && k < kempe_table_row_count(table); k++) {
        const double complex s = cell(table, k, "re") + I * cell(table, k, "im");
        CHECK_NEAR(cabs(s * s + 0.5 * s + 4 - 0.2 * cexp(-s)), 0, 1e-10 * cabs(s * s));
        CHECK(count_near(table, s, 1e-9) == 2);
    }
    CHECK(table && kempe_table_row_count(table) >= 8);
    CHECK(modes && !kempe_modes_is_unstable(modes));
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* A light stiff part, of which a delay turns the phase a hundred times over: s^2 + 0.01 s + 4e4 = 3 e^(-s). */
static void fast_motion(void)
{
    loaded l = load_text("kempe: 1\nstates: {late: {delay: q(x), time: 1}}\n" BODY
                         "forces: {f: {joint: x, force: 3*late - 4e4*q(x) - 0.01*qd(x)}}\n");
    double complex s = 200 * I;
    for (int k = 0; k < 50; k++)
        s -= (s * s + 0.01 * s + 4e4 - 3 * cexp(-s)) / (2 * s + 0.01 + 3 * cexp(-s));
    kempe_table *table = NULL;
    kempe_modes *modes = modes_of(&l, NULL, "modes", &table);
    CHECK(count_near(table, s, 1e-12) == 1);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* -- state spaces ------------------------------------------------------------------------------------ */

/* x'' + c x' + x = u + g x(t - 2) + h v(t - 2.5), where v is the first signal again by 0.5 later; D = y0 is held. */
#define CHAIN                                                                                                          \
    "kempe: 1\nparameters: {g: 0.3, h: 0.2, T: 2, y0: 0.1}\ninputs: {u: {}}\n"                                         \
    "states:\n"                                                                                                        \
    "  late: {delay: q(x), time: T}\n"                                                                                 \
    "  D: {start: y0, when: q(x) > 9, next: 5}\n"                                                                      \
    "  later: {delay: late + 3*u, time: 0.5}\n" BODY "forces: {f: {joint: x, force: u + g*late + h*later - q(x) - "    \
    "D*qd(x)}}\n"

static void state_space(void)
{
    static const known_matrix cases[] = {{KEMPE_MATRIX_A, 2, 2, {0, -1, 1, -0.1}},
                                         {KEMPE_MATRIX_B, 2, 3, {0, 1, 0, 0.3, 0, 0.2}},
                                         {KEMPE_MATRIX_C, 3, 2, {1, 1, 0, 0, 0, 0}},
                                         {KEMPE_MATRIX_D, 3, 3, {0, 0, 3, 0, 0, 1, 0, 0, 0}},
                                         {KEMPE_MATRIX_M, 1, 1, {1}},
                                         {KEMPE_MATRIX_G, 1, 1, {0.1}},
                                         {KEMPE_MATRIX_K, 1, 1, {1}},
                                         {KEMPE_MATRIX_L, 1, 3, {-1, -0.3, -0.2}}};
    loaded l = load_text(CHAIN);
    const kempe_linearize_options options = {.inputs = "u", .outputs = "q(x)"};
    kempe_linearization *x = NULL;
    char *text = NULL;
    CHECK(l.system && kempe_linearization_new(l.system, &options, &x) == KEMPE_OK);
    check_matrices(x, sizeof cases / sizeof *cases, cases, 1e-14);
    CHECK(x && kempe_linearization_count(x, KEMPE_CHANNEL_DELAY) == 2);
    CHECK_TEXT(kempe_linearization_name(x, KEMPE_CHANNEL_DELAY, 0), "delay(late)");
    CHECK_TEXT(kempe_linearization_name(x, KEMPE_CHANNEL_INPUT, 1), "delay(late)");
    CHECK_TEXT(kempe_linearization_name(x, KEMPE_CHANNEL_OUTPUT, 2), "delay(later)");
    CHECK(kempe_linearization_delay(x, 0) == 2 && kempe_linearization_delay(x, 1) == 0.5);
    CHECK(kempe_linearization_delay(x, 2) == 0);
    CHECK(x && kempe_linearization_print(x, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"delays\":") && strstr(text, "\"time\": 0.5"));
    kempe_text_free(text);
    kempe_linearization_free(x);
    unload(&l);
}

/* With w = (u, e^(-s T) signals) the state space has the response of the closed form, and of `response`. */
static void response_of_a_state_space(void)
{
    loaded l = load_text(CHAIN);
    const kempe_response_options options = {.inputs = "u", .outputs = "q(x)", .frequencies = "0.02:2:30"};
    kempe_response *r = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_response_new(l.system, &options, &r) == KEMPE_OK);
    CHECK(r && kempe_response_table(r, "rows", &table) == KEMPE_OK);
    CHECK(table && kempe_table_row_count(table) == 30);
    for (int k = 0; table && k < kempe_table_row_count(table); k++) {
        const double complex s = I * turn * cell(table, k, "frequency"), late = cexp(-2 * s), later = cexp(-0.5 * s);
        const double complex want = (1 + 0.6 * later) / (s * s + 0.1 * s + 1 - 0.3 * late - 0.2 * late * later);
        const double angle = cell(table, k, "q.x/u.phase") * turn / 360;
        CHECK_NEAR(cabs(cell(table, k, "q.x/u.amplitude") * cexp(I * angle) - want), 0, 1e-12 * cabs(want));
    }
    kempe_table_free(table);
    kempe_response_free(r);
    unload(&l);
}

/* -- refusals ---------------------------------------------------------------------------------------- */

static void refused(void)
{
    kempe_modes *modes = NULL;
    kempe_linearization *x = NULL;
    kempe_sensitivity *s = NULL;
    loaded l = load_text("kempe: 1\nstates: {late: {delay: 0.5*late + q(x), time: 1}}\n" BODY
                         "forces: {f: {joint: x, force: 0.2*late - 4*q(x) - 0.5*qd(x)}}\n");
    CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "the delayed signal 'late' depends on itself at once"));
    unload(&l);
    l = load_text("kempe: 1\nstates: {late: {delay: q(x), time: 1}, s: {sample: 0.1, next: late}}\n" BODY
                  "forces: {f: {joint: x, force: 0.2*late - 4*q(x) - 0.5*s}}\n");
    CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "modes of models with samples: the state 'late'"));
    CHECK(l.system && kempe_linearization_new(l.system, NULL, &x) == KEMPE_E_ARGUMENT);
    unload(&l);
    l = load_text(OSCILLATOR "start: {q: {x: 0.3}}\n");
    const kempe_modes_options start = {.at = "start"};
    const kempe_linearize_options here = {.at = "start"};
    CHECK(l.system && kempe_modes_new(l.system, &start, &modes) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "take --at equilibrium"));
    CHECK(l.system && kempe_linearization_new(l.system, &here, &x) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "the start is not an equilibrium"));
    const kempe_sensitivity_options of = {.of = "modes"};
    CHECK(l.model && kempe_sensitivity_new(l.model, &of, &s) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "'late' is a delayed signal"));
    const kempe_modes_options negative = {.sweep = "T=1:-1:3"};
    CHECK(l.system && kempe_modes_new(l.system, &negative, &modes) == KEMPE_STOPPED);
    kempe_modes_free(modes);
    unload(&l);
}

int main(void)
{
    TEST(branches_of_lambert);
    TEST(limits_of_an_oscillator);
    TEST(none_is_absent);
    TEST(repeated_and_zero);
    TEST(fast_motion);
    TEST(state_space);
    TEST(response_of_a_state_space);
    TEST(refused);
    return check_report();
}
