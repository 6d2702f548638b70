/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow 22 */
/* Parameters from measured motions, against the normal equations of a linear fit, motions in closed form, and exact
 * combinations that a motion does not determine. */
#include "ensemble/fit/nonlinear_squares.h"
#include "loaded.h"
#include "random.h"
#include "sanitized.h"
#include <kempe/fit.h>
#include <stdlib.h>

static const char *const data_file = "test_fit.csv", *const second_file = "test_fit_2.csv";

static void write_to(const char *path, const char *head, int rows, int columns, const double *cells)
{
    FILE *file = fopen(path, "w");
    CHECK(file != NULL);
    if (!file)
        return;
    fprintf(file, "%s\n", head);
    for (int row = 0; row < rows; row++)
        for (int c = 0; c < columns; c++)
            fprintf(file, "%.17g%s", cells[row * columns + c], c + 1 < columns ? "," : "\n");
    CHECK(fclose(file) == 0);
}

static void write_data(const char *head, int rows, int columns, const double *cells)
{
    write_to(data_file, head, rows, columns, cells);
}

static kempe_status fit_with(const loaded *l, kempe_fit_options ask, kempe_fit **fit)
{
    const kempe_run_options run = {.rtol = 1e-10};
    ask.data = data_file;
    ask.run = &run;
    *fit = NULL;
    kempe_status status = kempe_fit_new(l->model, &ask, fit);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(l->context));
    return status;
}

static double cell(const kempe_fit *fit, const char *table, int row, const char *column)
{
    kempe_table *t = NULL;
    CHECK(kempe_fit_table(fit, table, &t) == KEMPE_OK);
    double x = kempe_table_number(t, row, kempe_table_find(t, column));
    kempe_table_free(t);
    return x;
}

static bool has_state(const kempe_fit *fit, int row, const char *word)
{
    kempe_table *t = NULL;
    CHECK(kempe_fit_table(fit, "parameters", &t) == KEMPE_OK);
    bool same = strcmp(kempe_table_word(t, row, kempe_table_find(t, "state")), word) == 0;
    kempe_table_free(t);
    return same;
}

/* -- a linear fit ------------------------------------------------------------------------------------ */

static const char *const thrown = "kempe: 1\n"
                                  "parameters: {a: 1}\n"
                                  "bodies: {ball: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                                  "forces: {push: {joint: x, force: 2*a}}\n"
                                  "start: {q: {x: 0}, qd: {x: 1}}\n";

static const char *const pushed_twice = "kempe: 1\n"
                                        "parameters: {a: 1, b: 0}\n"
                                        "bodies: {ball: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                                        "forces: {push: {joint: x, force: 2*(a + b)}}\n"
                                        "start: {q: {x: 0}, qd: {x: 1}}\n";

enum { THROWS = 10 };

/* x = v t + a t^2 / 2 with fixed noise: v and a by the 2 x 2 normal equations. */
static void agrees_with_normal_equations(void)
{
    static const double noise[THROWS] = {0.3, -0.2, 0.5, -0.4, 0.1, -0.6, 0.2, 0.4, -0.3, 0.1};
    double cells[THROWS][2], m11 = 0, m12 = 0, m22 = 0, b1 = 0, b2 = 0, sum = 0;
    for (int k = 0; k < THROWS; k++) {
        double t = 0.3 * (k + 1), x = 2.5 * t - 0.7 * t * t + noise[k];
        cells[k][0] = t;
        cells[k][1] = x;
        m11 += t * t;
        m12 += t * t * t / 2;
        m22 += t * t * t * t / 4;
        b1 += t * x;
        b2 += t * t / 2 * x;
    }
    double det = m11 * m22 - m12 * m12, v = (m22 * b1 - m12 * b2) / det, a = (m11 * b2 - m12 * b1) / det;
    for (int k = 0; k < THROWS; k++) {
        double away = cells[k][1] - v * cells[k][0] - a * cells[k][0] * cells[k][0] / 2;
        sum += away * away;
    }
    double s2 = sum / (THROWS - 2), student = 2.306004135204166; /* 97.5 % at 8 degrees of freedom */
    loaded l = load_text(thrown);
    kempe_fit *fit = NULL;
    write_data("t,q.x", THROWS, 2, &cells[0][0]);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "qd.x,a:-100:100"}, &fit) == KEMPE_OK);
    CHECK(kempe_fit_count(fit) == 2 && kempe_fit_rank(fit) == 2);
    CHECK_NEAR(kempe_fit_value(fit, 0), v, 1e-7);
    CHECK_NEAR(kempe_fit_value(fit, 1), a, 1e-7);
    CHECK_NEAR(kempe_fit_error(fit, 0), sqrt(s2 * m22 / det), 1e-7);
    CHECK_NEAR(kempe_fit_error(fit, 1), sqrt(s2 * m11 / det), 1e-7);
    CHECK_NEAR(kempe_fit_high(fit, 1) - kempe_fit_value(fit, 1), student * sqrt(s2 * m11 / det), 1e-7);
    CHECK_NEAR(kempe_fit_value(fit, 1) - kempe_fit_low(fit, 1), student * sqrt(s2 * m11 / det), 1e-7);
    CHECK_NEAR(cell(fit, "correlation", 0, "a"), -m12 / sqrt(m11 * m22), 1e-7);
    CHECK_NEAR(cell(fit, "columns", 0, "rms"), sqrt(sum / THROWS), 1e-8);
    CHECK_NEAR(cell(fit, "rows", 3, "q.x.residual"), cells[3][1] - v * cells[3][0] - a * cells[3][0] * cells[3][0] / 2,
               1e-7);
    kempe_fit_free(fit);
    unload(&l);

    /* Two parameters that the data determines together are one combination: the error of v remains. */
    l = load_text(pushed_twice);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "qd.x,a:-100:100,b:-100:100"}, &fit) == KEMPE_OK);
    CHECK(kempe_fit_rank(fit) == 2 && has_state(fit, 1, "open") && has_state(fit, 2, "open"));
    CHECK_NEAR(kempe_fit_value(fit, 0), v, 1e-7);
    CHECK_NEAR(kempe_fit_error(fit, 0), sqrt(s2 * m22 / det), 1e-7);
    CHECK_NEAR(kempe_fit_high(fit, 0) - kempe_fit_value(fit, 0), student * sqrt(s2 * m22 / det), 1e-7);
    kempe_fit_free(fit);
    unload(&l);
}

/* Two throws with one acceleration: x = 2 t + a t^2/2 and x = 5 + v t + a t^2/2, with fixed noise. Each has values of
 * its own, and v is found for the second alone; the normal equations of both together. */
static void shares_parameters_of_two_files(void)
{
    static const double noise[2][THROWS] = {{0.3, -0.2, 0.5, -0.4, 0.1, -0.6, 0.2, 0.4, -0.3, 0.1},
                                            {-0.1, 0.6, 0.2, -0.5, 0.3, 0.1, -0.4, 0.2, -0.2, 0.3}};
    double cells[2][THROWS][2], m11 = 0, m12 = 0, m22 = 0, b1 = 0, b2 = 0, sum = 0;
    for (int k = 0; k < 2 * THROWS; k++) {
        int f = k / THROWS, i = k % THROWS;
        double t = 0.3 * (i + 1), known = f ? 5 : 2 * t, slope = f ? t : 0;
        double x = known - 1.5 * slope - 0.7 * t * t + noise[f][i];
        cells[f][i][0] = t;
        cells[f][i][1] = x;
        m11 += slope * slope;
        m12 += slope * t * t / 2;
        m22 += t * t * t * t / 4;
        b1 += slope * (x - known);
        b2 += t * t / 2 * (x - known);
    }
    double det = m11 * m22 - m12 * m12, v = (m22 * b1 - m12 * b2) / det, a = (m11 * b2 - m12 * b1) / det;
    for (int k = 0; k < 2 * THROWS; k++) {
        int f = k / THROWS;
        double t = cells[f][k % THROWS][0];
        double away = cells[f][k % THROWS][1] - (f ? 5 + v * t : 2 * t) - a * t * t / 2;
        sum += away * away;
    }
    double s2 = sum / (2 * THROWS - 2);
    loaded l = load_text(thrown);
    kempe_fit *fit = NULL;
    write_data("t,q.x", THROWS, 2, &cells[0][0][0]);
    write_to(second_file, "t,q.x", THROWS, 2, &cells[1][0][0]);
    kempe_fit_options ask = {
        .parameters = "qd.x@2,a:-100:100", .files = &second_file, .file_count = 1, .own = "qd.x@1=2, q.x@2=5"};
    CHECK(fit_with(&l, ask, &fit) == KEMPE_OK);
    CHECK_NEAR(kempe_fit_value(fit, 0), v, 1e-7);
    CHECK_NEAR(kempe_fit_value(fit, 1), a, 1e-7);
    CHECK_NEAR(kempe_fit_error(fit, 0), sqrt(s2 * m22 / det), 1e-7);
    CHECK_NEAR(kempe_fit_error(fit, 1), sqrt(s2 * m11 / det), 1e-7);
    CHECK_NEAR(cell(fit, "columns", 0, "count"), 2 * THROWS, 0);
    CHECK_NEAR(cell(fit, "columns", 0, "rms"), sqrt(sum / (2 * THROWS)), 1e-8);
    CHECK_NEAR(cell(fit, "rows", THROWS + 2, "file"), 2, 0);
    CHECK_NEAR(cell(fit, "rows", THROWS + 2, "q.x.measured"), cells[1][2][1], 1e-12);
    CHECK_NEAR(cell(fit, "first", 2, "q.x"), 2 * 0.9 + a * 0.405, 1e-7);
    kempe_fit_free(fit);
    static const struct {
        const char *parameters, *own, *words;
    } refused[] = {{"qd.x,a", "qd.x@2=3", "parameter 'qd.x' is to be found for all runs"},
                   {"qd.x@3", NULL, "'qd.x@3': NAME@K is of the K-th data file, and there are 2"},
                   {"qd.x@1", NULL, "the run of 'test_fit_2.csv' has none of the parameters"},
                   {"a", "q.x=3", "'q.x=3': NAME@K=VALUE is expected"},
                   {"a", "q.y@1=3", "no coordinate 'y'"},
                   {"a", "a@2=3", "is to be found for all runs"}};
    for (size_t k = 0; k < sizeof refused / sizeof *refused; k++) {
        ask.parameters = refused[k].parameters;
        ask.own = refused[k].own;
        CHECK(fit_with(&l, ask, &fit) == KEMPE_E_ARGUMENT);
        if (!strstr(kempe_context_message(l.context), refused[k].words))
            CHECK_TEXT(kempe_context_message(l.context), refused[k].words);
    }
    (void)remove(second_file);
    unload(&l);
}

/* The best acceleration is beyond its bound: the estimate is at the bound, and v that of x - a t^2/2. */
static void ends_at_a_bound(void)
{
    double cells[THROWS][2], tt = 0, tx = 0;
    for (int k = 0; k < THROWS; k++) {
        double t = 0.3 * (k + 1);
        cells[k][0] = t;
        cells[k][1] = 2.5 * t - 0.7 * t * t + (k % 2 ? 0.01 : -0.01);
        tt += t * t;
        tx += t * (cells[k][1] + 0.5 * t * t);
    }
    loaded l = load_text(thrown);
    kempe_fit *fit = NULL;
    write_data("t,q.x", THROWS, 2, &cells[0][0]);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "qd.x,a:-1:3"}, &fit) == KEMPE_OK);
    CHECK_NEAR(kempe_fit_value(fit, 1), -1, 1e-4);
    CHECK_NEAR(kempe_fit_value(fit, 0), tx / tt, 1e-4);
    CHECK(has_state(fit, 0, "") && has_state(fit, 1, "lower"));
    CHECK(isnan(kempe_fit_error(fit, 1)) && kempe_fit_error(fit, 0) > 0);
    kempe_fit_free(fit);
    unload(&l);
}

/* -- a motion in closed form ------------------------------------------------------------------------- */

static const char *const swinging = "kempe: 1\n"
                                    "parameters: {k: 30, c: 0.1, unused: 1}\n"
                                    "bodies: {ball: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                                    "forces: {spring: {joint: x, force: -k*q(x) - c*qd(x) + 0*unused}}\n"
                                    "start: {q: {x: 0.1}}\n";

enum { SWINGS = 40 };

/* x = x0 e^(-d t) (cos w t + d/w sin w t), in mm, with empty cells of the rate. */
static void finds_a_damped_spring(void)
{
    const double k = 50, c = 0.8, m = 2, d = c / (2 * m), w = sqrt(k / m - d * d), x0 = 0.1;
    loaded l = load_text(swinging);
    kempe_fit *fit = NULL;
    FILE *file = fopen(data_file, "w");
    CHECK(file != NULL);
    fprintf(file, "t [ms],other,qd.x,q.x [mm]\n");
    for (int i = 0; i < SWINGS; i++) {
        double t = 0.05 * (i + 1), e = x0 * exp(-d * t);
        fprintf(file, "%.17g,7,", 1000 * t);
        if (i % 3 == 0)
            fprintf(file, "%.17g", -e * (d * d / w + w) * sin(w * t));
        fprintf(file, ",%.17g\n", 1000 * e * (cos(w * t) + d / w * sin(w * t)));
    }
    CHECK(fclose(file) == 0);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "k:1:200,c:0:", .columns = "q.x, qd.x"}, &fit) == KEMPE_OK);
    CHECK_NEAR(kempe_fit_value(fit, 0), k, 1e-7);
    CHECK_NEAR(kempe_fit_value(fit, 1), c, 1e-7);
    CHECK(cell(fit, "columns", 0, "count") == 14 && cell(fit, "columns", 1, "count") == SWINGS);
    kempe_fit_free(fit);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "k,c,unused", .columns = "q.x"}, &fit) == KEMPE_OK);
    CHECK(kempe_fit_rank(fit) == 2 && has_state(fit, 2, "open") && has_state(fit, 0, ""));
    CHECK(isnan(kempe_fit_error(fit, 2)) && kempe_fit_error(fit, 0) >= 0);
    CHECK_NEAR(kempe_fit_value(fit, 0), k, 1e-7);
    kempe_fit_free(fit);
    unload(&l);
}

/* -- a closed loop ----------------------------------------------------------------------------------- */

/* Motion of the model with its own values, as data with noise. */
static void measure(const loaded *l, double noise)
{
    const kempe_run_options run = {.rtol = 1e-10, .output_step = 0.05, .no_convergence_check = 1};
    kempe_trajectory *motion = NULL;
    static double cells[100][3];
    CHECK(kempe_simulate(l->system, &run, &motion) == KEMPE_OK);
    int rows = kempe_trajectory_row_count(motion);
    random_seed(7);
    for (int k = 0; k < rows && k < 100; k++) {
        cells[k][0] = kempe_trajectory_time(motion, k);
        cells[k][1] = kempe_trajectory_q(motion, k)[0] + noise * between(-1, 1);
        cells[k][2] = kempe_trajectory_q(motion, k)[2] + 0.1 * noise * between(-1, 1);
    }
    write_data("t,q.crank,q.slider", rows, 3, &cells[0][0]);
    kempe_trajectory_free(motion);
}

static const char *const crank = "tests/models/measured_crank.yaml";

/* Without a known mass or force all masses and forces are known up to a factor, and the crank's mass and the rod's act
 * together in other ways, too. */
static void names_the_undetermined(void)
{
    const kempe_setting far[] = {{"slider_mass", "6"}, {"guide", "0.3"}};
    loaded l = load(crank), other = load_set(crank, far, 2);
    kempe_fit *fit = NULL;
    measure(&l, 0);
    CHECK(fit_with(&other, (kempe_fit_options){.parameters = "slider_mass:0:20,guide:0:10,bearing:0:"}, &fit) ==
          KEMPE_OK);
    CHECK(kempe_fit_rank(fit) == 3);
    CHECK_NEAR(kempe_fit_value(fit, 0), 3, 1e-6);
    CHECK_NEAR(kempe_fit_value(fit, 1), 1.5, 1e-6);
    CHECK_NEAR(kempe_fit_value(fit, 2), 0.05, 1e-6);
    kempe_fit_free(fit);
    measure(&l, 1e-3);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "crank_mass,rod_mass,slider_mass,guide,bearing,stiffness"},
                   &fit) == KEMPE_OK);
    CHECK(kempe_fit_rank(fit) == 5);
    for (int k = 0; k < 6; k++)
        CHECK(has_state(fit, k, "open"));
    kempe_fit_free(fit);
    unload(&l);
    unload(&other);
}

/* The number of shortened steps, as the JSON has it. */
static int shortened(const kempe_fit *fit)
{
    char *text = NULL;
    CHECK(kempe_fit_print(fit, KEMPE_JSON, &text) == KEMPE_OK);
    const char *at = text ? strstr(text, "\"shortened\": ") : NULL;
    int count = at ? atoi(at + strlen("\"shortened\": ")) : -1;
    kempe_text_free(text);
    return count;
}

/* x = F t^2 / (2 m) with m = 1: from 10 a step of Gauss and Newton leads to 2 m - m^2 = -80. */
static void shortens_where_a_mass_is_negative(void)
{
    double cells[THROWS][2];
    for (int k = 0; k < THROWS; k++) {
        cells[k][0] = 0.3 * (k + 1);
        cells[k][1] = 4 * cells[k][0] * cells[k][0] / 2;
    }
    loaded l = load_text("kempe: 1\n"
                         "parameters: {m: 10}\n"
                         "bodies: {ball: {joint: {name: x, prismatic: x, at: ground}, mass: m}}\n"
                         "forces: {push: {joint: x, force: 4}}\n");
    kempe_fit *fit = NULL;
    write_data("t,q.x", THROWS, 2, &cells[0][0]);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "m"}, &fit) == KEMPE_OK);
    CHECK_NEAR(kempe_fit_value(fit, 0), 1, 1e-8);
    CHECK(shortened(fit) > 0);
    kempe_fit_free(fit);
    unload(&l);
}

/* With rods that are too short the loop does not close. */
static void shortens_where_the_loop_opens(void)
{
    const kempe_setting near[] = {{"l", "0.25"}}, open[] = {{"l", "0.1"}};
    loaded l = load(crank), other = load_set(crank, near, 1), none = load_set(crank, open, 1);
    kempe_fit *fit = NULL;
    measure(&l, 0);
    CHECK(fit_with(&other, (kempe_fit_options){.parameters = "l"}, &fit) == KEMPE_UNTRUSTED); /* a local minimum */
    CHECK(shortened(fit) > 0);
    kempe_fit_free(fit);
    CHECK(fit_with(&none, (kempe_fit_options){.parameters = "l"}, &fit) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(none.context), "does not run with the values of the start") != NULL);
    CHECK(strstr(kempe_context_message(none.context), "loop 'P' cannot be closed") != NULL);
    unload(&l);
    unload(&other);
    unload(&none);
}

/* From a rod of 0.3 m one search ends at a local minimum, several, which are usual, find the rod of 0.5 m. */
static void searches_from_several_starts(void)
{
    const kempe_setting near[] = {{"l", "0.3"}};
    loaded l = load(crank), other = load_set(crank, near, 1);
    kempe_fit *fit = NULL;
    measure(&l, 1e-3);
    CHECK(fit_with(&other, (kempe_fit_options){.parameters = "l:0.1:1", .starts = 1}, &fit) >= KEMPE_OK);
    CHECK(fabs(kempe_fit_value(fit, 0) - 0.5) > 0.1);
    kempe_fit_free(fit);
    for (int starts = 0; starts <= 4; starts += 4) {
        CHECK(fit_with(&other, (kempe_fit_options){.parameters = "l:0.1:1", .starts = starts}, &fit) == KEMPE_OK);
        CHECK_NEAR(kempe_fit_value(fit, 0), 0.5, 1e-3);
        kempe_fit_free(fit);
    }
    CHECK(fit_with(&other, (kempe_fit_options){.parameters = "l:0.1:", .starts = 4}, &fit) == KEMPE_E_ARGUMENT);
    unload(&l);
    unload(&other);
}

/* -- friction that sticks ------------------------------------------------------------------------------ */

/* A block on the floor slides to rest, x = v t - mu g t^2 / 2 up to v / (mu g), and sticks there until a force of c t
 * has grown to its friction: t = mu m g / c. Then x'' = c t / m - mu g. In closed form, with sticking and release at
 * times that depend on the parameters. */
static double block_at(double t, double v, double mu, double m, double c)
{
    const double g = 9.81, stop = v / (mu * g), go = mu * m * g / c;
    double slid = fmin(t, stop), x = v * slid - mu * g * slid * slid / 2;
    if (t > go)
        x += c / m * (t * t * t - go * go * go) / 6 - mu * g * (t - go) * (t - go) / 2 - c / m * go * go / 2 * (t - go);
    return x;
}

static void finds_friction_that_sticks(void)
{
    enum { ROWS = 60 };
    static double cells[ROWS][2];
    const double v = 2, mu = 0.3, c = 4;
    for (int k = 0; k < ROWS; k++) {
        cells[k][0] = 0.05 * (k + 1);
        cells[k][1] = block_at(cells[k][0], v, mu, 2, c);
    }
    loaded l = load_text("kempe: 1\n"
                         "gravity: [0, 0, 0]\n"
                         "parameters: {mu: 0.4, c: 5, v: 2.2}\n"
                         "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                         "forces:\n"
                         "  floor: {joint: x, friction: {force: 'mu*2*9.81'}}\n"
                         "  pull: {joint: x, force: 'if(t > 1, c*t, 0)'}\n"
                         "start: {q: {x: 0}, qd: {x: v}}\n");
    kempe_fit *fit = NULL;
    write_data("t,q.x", ROWS, 2, &cells[0][0]);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "mu:0.1:1,c:1:20,v:1:4"}, &fit) == KEMPE_OK);
    if (fit) {
        CHECK(kempe_fit_rank(fit) == 3);
        CHECK_NEAR(kempe_fit_value(fit, 0), mu, 1e-6);
        CHECK_NEAR(kempe_fit_value(fit, 1), c, 1e-6);
        CHECK_NEAR(kempe_fit_value(fit, 2), v, 1e-6);
    }
    kempe_fit_free(fit);
    unload(&l);
}

/* -- threads ------------------------------------------------------------------------------------------ */

/* The printed result without its times, with all digits of the numbers. */
static void take_result(const kempe_fit *fit, char **text)
{
    char *from, *to;
    CHECK(kempe_fit_print(fit, KEMPE_JSON, text) == KEMPE_OK);
    const char *const times[] = {"\"build_s\"", "\"cpu_s\""};
    for (int k = 0; k < 2; k++)
        if ((from = strstr(*text, times[k])) && (to = strchr(from, '\n')))
            memmove(from, to, strlen(to) + 1);
}

/* Under sanitizers one search by 1 and 2 threads: the others lead through the same lines. */
#ifdef SANITIZED
enum { SEARCHES = 1, TEAMS = 2 };
#else
enum { SEARCHES = 2, TEAMS = 3 };
#endif

/* Searches by 1, 2 and 3 threads: two data files, starts at which the loop does not close. `rod`: its length at the
 * first start. */
static void search_by_threads(const char *rod, int starts)
{
    const kempe_setting near[] = {{"l", rod}};
    loaded l = load(crank), other = load_set(crank, near, 1);
    kempe_fit *fit[TEAMS] = {NULL};
    char *text[TEAMS] = {NULL};
    measure(&l, 1e-3);
    const char *const again[] = {data_file};
    for (int k = 0; k < TEAMS; k++) {
        const kempe_run_options run = {.threads = k + 1};
        CHECK(kempe_fit_new(other.model,
                            &(kempe_fit_options){.data = data_file,
                                                 .files = again,
                                                 .file_count = 1,
                                                 .own = "guide@2=1.6",
                                                 .parameters = "l:0.1:1,slider_mass:1:6",
                                                 .starts = starts,
                                                 .run = &run},
                            &fit[k]) == KEMPE_OK);
        take_result(fit[k], &text[k]);
    }
    CHECK(shortened(fit[0]) > 0);
    for (int k = 1; k < TEAMS; k++)
        CHECK(strcmp(text[0], text[k]) == 0);
    for (int k = 0; k < TEAMS; k++) {
        kempe_text_free(text[k]);
        kempe_fit_free(fit[k]);
    }
    unload(&l);
    unload(&other);
}

static void threads_change_nothing(void)
{
    static const char *const rods[] = {"0.11", "0.3"}; /* the model does not run at the first start of the first one */
    for (int k = 0; k < SEARCHES; k++)
        search_by_threads(rods[k], 8);
}

/* -- interrupts -------------------------------------------------------------------------------------- */

static int countdown;

/* x'' = cos w t. Other searches begin where a run would take some 100,000 steps, and are given up. */
static void gives_up_long_trials(void)
{
    double cells[THROWS][2];
    for (int k = 0; k < THROWS; k++) {
        cells[k][0] = 0.3 * (k + 1);
        cells[k][1] = (1 - cos(2 * cells[k][0])) / 4;
    }
    loaded l = load_text("kempe: 1\nparameters: {w: 2.1}\n"
                         "bodies: {ball: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                         "forces: {push: {joint: x, force: 2*cos(w*t)}}\n");
    kempe_fit *fit = NULL;
    char *json = NULL;
    write_data("t,q.x", THROWS, 2, &cells[0][0]);
    CHECK(fit_with(&l, (kempe_fit_options){.parameters = "w:-100000:100000", .starts = 3}, &fit) == KEMPE_OK);
    CHECK_NEAR(kempe_fit_value(fit, 0), 2, 1e-7);
    CHECK(kempe_fit_print(fit, KEMPE_JSON, &json) == KEMPE_OK);
    CHECK(json && strstr(json, "the limit of 10000 steps (max_steps)"));
    kempe_text_free(json);
    kempe_fit_free(fit);
    unload(&l);
}

static void interrupt_late(void *user, const kempe_progress *progress)
{
    if (strcmp(progress->unit, "runs") == 0 && --countdown == 0)
        kempe_context_interrupt(user);
}

static void keeps_the_best(void)
{
    const kempe_setting far[] = {{"slider_mass", "6"}, {"guide", "0.3"}};
    loaded l = load(crank), other = load_set(crank, far, 2);
    kempe_fit *fit = NULL;
    measure(&l, 1e-3);
    countdown = 5;
    kempe_context_set_progress(other.context, 0, interrupt_late, other.context);
    CHECK(fit_with(&other, (kempe_fit_options){.parameters = "slider_mass,guide"}, &fit) == KEMPE_STOPPED);
    CHECK(fit != NULL && fabs(kempe_fit_value(fit, 0) - 3) < 3 && kempe_fit_error(fit, 0) > 0);
    CHECK(strstr(kempe_context_message(other.context), "the best values so far are given") != NULL);
    kempe_fit_free(fit);
    unload(&l);
    unload(&other);
}

int main(void)
{
    if (kmp_squares_available) {
        TEST(agrees_with_normal_equations);
        TEST(shares_parameters_of_two_files);
        TEST(ends_at_a_bound);
        TEST(finds_a_damped_spring);
        TEST(names_the_undetermined);
        TEST(shortens_where_a_mass_is_negative);
        TEST(shortens_where_the_loop_opens);
        TEST(searches_from_several_starts);
        TEST(gives_up_long_trials);
        TEST(finds_friction_that_sticks);
        TEST(threads_change_nothing);
        TEST(keeps_the_best);
    }
    (void)remove(data_file);
    return kmp_squares_available ? check_report() : 0;
}
