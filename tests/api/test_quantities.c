/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of instances against closed forms: an oscillator whose mass varies, a pendulum from various angles (by the
 * arithmetic-geometric mean), kinks, limits, instances that cannot run; in lanes, by themselves, on several threads. */
#include "testing.h"
#include <kempe/ensemble.h>
#include <kempe/table.h>
#include <stdbool.h>

enum { COUNT = 9 };

static const double PI = 3.14159265358979323846;

static const char *const OSCILLATOR = "kempe: 1\n"
                                      "gravity: [0, 0, 0]\n"
                                      "parameters: {k: 100, m: 2, a: 0.1}\n"
                                      "bodies:\n"
                                      "  block: {joint: {name: x, prismatic: x, at: ground}, mass: m}\n"
                                      "forces: {spring: {joint: x, force: \"-k*q(x)\"}}\n"
                                      "start: {q: {x: a}}\n"
                                      "run: {t_end: 1}\n";

static const char *const PENDULUM = "kempe: 1\n"
                                    "gravity: [0, -9.81, 0]\n"
                                    "parameters: {l: 0.7, m: 1}\n"
                                    "bodies:\n"
                                    "  bob:\n"
                                    "    joint: {name: A, revolute: z, at: ground}\n"
                                    "    mass: m\n"
                                    "    com: [0, -l, 0]\n"
                                    "    points: {end: [0, -l, 0]}\n"
                                    "start: {q: {A: 0.5}}\n"
                                    "run: {t_end: 3}\n";

typedef struct study {
    kempe_context *context;
    kempe_model *model;
    kempe_values *values;
    kempe_ensemble *ensemble;
    kempe_status status;
} study;

static study begin(const char *text, int columns, const char *const *names, int count, const double *rows,
                   const char *quantities, const char *limits)
{
    study s = {.context = kempe_context_new()};
    const kempe_ensemble_options options = {.size = sizeof options, .quantities = quantities, .limits = limits};
    if (kempe_model_read_text(s.context, text, "model.yaml", &s.model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(s.context));
    CHECK(kempe_values_new(s.model, columns, names, count, rows, &s.values) == KEMPE_OK);
    s.status = kempe_ensemble_new_with(s.model, s.values, &options, &s.ensemble);
    return s;
}

static void end(study *s)
{
    kempe_ensemble_free(s->ensemble);
    kempe_values_free(s->values);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

static kempe_ensemble_result *run_with(const study *s, const kempe_run_options *options, int lanes)
{
    kempe_ensemble_result *batch = NULL;
    if (kempe_ensemble_run(s->ensemble, options, lanes, &batch) != KEMPE_OK)
        printf("%s\n", kempe_context_message(s->context));
    CHECK(batch != NULL);
    return batch;
}

static kempe_ensemble_result *run_once(const study *s, double t_end, int lanes, int threads, int once)
{
    const kempe_run_options options = {.size = sizeof options,
                                       .t_end = t_end,
                                       .rtol = 1e-10,
                                       .atol = 1e-12,
                                       .no_convergence_check = once,
                                       .threads = threads};
    return run_with(s, &options, lanes);
}

static kempe_ensemble_result *run(const study *s, double t_end, int lanes, int threads)
{
    return run_once(s, t_end, lanes, threads, 1);
}

static double value(const kempe_ensemble_result *batch, int k, const char *name)
{
    for (int i = 0; i < kempe_ensemble_result_quantity_count(batch); i++)
        if (strcmp(kempe_ensemble_result_quantity_name(batch, i), name) == 0)
            return kempe_ensemble_result_quantity(batch, k, i);
    printf("no quantity %s\n", name);
    return NAN;
}

static const char *unit(const kempe_ensemble_result *batch, const char *name)
{
    for (int i = 0; i < kempe_ensemble_result_quantity_count(batch); i++)
        if (strcmp(kempe_ensemble_result_quantity_name(batch, i), name) == 0)
            return kempe_ensemble_result_quantity_unit(batch, i);
    return "none";
}

/* -- oscillator: x = a cos(w t), w = sqrt(k/m) --------------------------------------------------------- */

static const char *const all = "max(q(x)), low = min(q(x)); v = max(qd(x)), range(q(x)), mean(q(x)),\n"
                               "square = rms(q(x)), area = integral(q(x)), half = at(q(x), 0.5 s), q(x),\n"
                               "down = first(q(x) < 0), count(q(x) <= 0), duration(q(x) < 0), energy.total,\n"
                               "late = max(qdd(x)), size = mean(abs(q(x))), P = max(-k*q(x)*qd(x))";

static void check_oscillator(const kempe_ensemble_result *b, int i, double mass, double a, double tolerance)
{
    double w = sqrt(100 / mass), T = 1, turn = 2 * PI / w;
    double below = 0, absolute = 0;
    for (int k = 0; k < 10; k++) { /* x < 0 between (1/4 + k) and (3/4 + k) turns */
        double from = fmin((0.25 + k) * turn, T), to = fmin((0.75 + k) * turn, T);
        below += to - from;
        absolute += -a / w * (sin(w * to) - sin(w * from));
    }
    absolute += a / w * sin(w * T) + absolute; /* the positive part is the whole less the negative one */
    CHECK_NEAR(value(b, i, "max(q(x))"), a, tolerance);
    CHECK_NEAR(value(b, i, "low"), -a, tolerance);
    CHECK_NEAR(value(b, i, "low.time") * w, round(value(b, i, "low.time") * w / PI) * PI, 100 * sqrt(tolerance));
    CHECK_NEAR(value(b, i, "v"), a * w, tolerance);
    CHECK_NEAR(fmod(value(b, i, "v.time"), turn), 0.75 * turn, 100 * sqrt(tolerance));
    CHECK_NEAR(value(b, i, "range(q(x))"), 2 * a, tolerance);
    CHECK_NEAR(value(b, i, "mean(q(x))"), a * sin(w * T) / w / T, tolerance);
    CHECK_NEAR(value(b, i, "square"), a * sqrt(0.5 + sin(2 * w * T) / (4 * w * T)), tolerance);
    CHECK_NEAR(value(b, i, "area"), a * sin(w * T) / w, tolerance);
    CHECK_NEAR(value(b, i, "half"), a * cos(w / 2), tolerance);
    CHECK_NEAR(value(b, i, "q(x)"), a * cos(w * T), tolerance);
    CHECK_NEAR(value(b, i, "down"), turn / 4, tolerance);
    CHECK(value(b, i, "count(q(x) <= 0)") == floor(T / turn + 0.75));
    CHECK_NEAR(value(b, i, "duration(q(x) < 0)"), below, 10 * tolerance);
    CHECK_NEAR(value(b, i, "energy.total"), mass * pow(a * w * sin(w * T), 2) / 2, tolerance);
    CHECK_NEAR(value(b, i, "late"), a * w * w, 10 * tolerance);
    CHECK_NEAR(value(b, i, "size"), absolute / T, 1e-7); /* kinks */
    CHECK_NEAR(value(b, i, "P"), 0.5 * 100 * a * a * w, 10 * tolerance);
}

static void test_oscillator(void)
{
    static const char *const names[] = {"m", "a"};
    double rows[COUNT][2];
    for (int i = 0; i < COUNT; i++) {
        rows[i][0] = 0.3 + 0.2 * i;
        rows[i][1] = 0.1 + 0.01 * i;
    }
    study s = begin(OSCILLATOR, 2, names, COUNT, rows[0], all, NULL);
    CHECK(s.status == KEMPE_OK);
    if (s.status != KEMPE_OK)
        printf("%s\n", kempe_context_message(s.context));
    kempe_ensemble_result *lanes = run(&s, 1, 0, 2), *alone = run(&s, 1, -1, 1);
    for (int i = 0; i < COUNT; i++) {
        CHECK_TEXT(kempe_ensemble_result_limits(lanes, i), "");
        check_oscillator(lanes, i, rows[i][0], rows[i][1], 2e-8);
        check_oscillator(alone, i, rows[i][0], rows[i][1], 2e-8);
    }
    CHECK_TEXT(unit(lanes, "max(q(x))"), "m");
    CHECK_TEXT(unit(lanes, "low.time"), "s");
    CHECK_TEXT(unit(lanes, "late"), "m/s^2");
    CHECK_TEXT(unit(lanes, "area"), "m s");
    CHECK_TEXT(unit(lanes, "count(q(x) <= 0)"), "");
    CHECK_TEXT(unit(lanes, "energy.total"), "J");
    kempe_ensemble_result_free(lanes);
    kempe_ensemble_result_free(alone);
    end(&s);
}

/* -- pendulum: qd_max = 2 w sin(a/2), quarter of the period pi/(2 w agm(1, cos(a/2))) -------------------- */

static double quarter(double w, double angle)
{
    double a = 1, b = cos(angle / 2);
    while (fabs(a - b) > 1e-15 * a) {
        double mean = (a + b) / 2;
        b = sqrt(a * b);
        a = mean;
    }
    return PI / (2 * w * a);
}

/* The difference at another tolerance bounds the error of a quantity, beyond rounding, and is not far above it: the
 * coarser run has a tolerance that is 100 times as large. */
static void check_differences(const kempe_ensemble_result *b, double rows[][2])
{
    kempe_table *table = NULL;
    CHECK(kempe_ensemble_result_table(b, "instances", &table) == KEMPE_OK);
    for (int i = 0; i < COUNT; i++) {
        double w = sqrt(9.81 / rows[i][1]), angle = rows[i][0], T = quarter(w, angle);
        double off[] = {fabs(value(b, i, "top") - 2 * w * sin(angle / 2)), fabs(value(b, i, "down") - T),
                        fabs(value(b, i, "turn") - 2 * T)};
        static const char *const names[] = {"top.difference", "down.difference", "turn.difference"};
        for (int k = 0; k < 3; k++) {
            double difference = kempe_table_number(table, i, kempe_table_find(table, names[k]));
            CHECK(difference > 0 && difference < 1e-6);
            CHECK(off[k] <= difference + 1e-13);
        }
    }
    CHECK_TEXT(kempe_table_unit(table, kempe_table_find(table, "down.difference")), "s");
    kempe_table_free(table);
}

/* The same bits for any lanes and threads; unknown without the check. */
static void check_same_differences(const kempe_ensemble_result *a, const kempe_ensemble_result *b,
                                   const kempe_ensemble_result *once)
{
    const kempe_ensemble_result *batches[] = {a, b, once};
    kempe_table *tables[3] = {NULL};
    for (int k = 0; k < 3; k++)
        CHECK(kempe_ensemble_result_table(batches[k], "instances", &tables[k]) == KEMPE_OK);
    int column = kempe_table_find(tables[0], "top.time.difference");
    for (int i = 0; i < COUNT; i++) {
        CHECK(kempe_table_number(tables[0], i, column) == kempe_table_number(tables[1], i, column));
        CHECK(isnan(kempe_table_number(tables[2], i, column)));
    }
    for (int k = 0; k < 3; k++)
        kempe_table_free(tables[k]);
}

static void test_pendulum(void)
{
    static const char *const names[] = {"q.A", "l"};
    static const char *const words = "top = max(qd(A)), down = first(q(A) < 0), high = max(position(bob.end).y), "
                                     "turn = first(qd(A) > 0)";
    double rows[COUNT][2];
    for (int i = 0; i < COUNT; i++) {
        rows[i][0] = 0.3 + 0.3 * i;
        rows[i][1] = 0.5 + 0.05 * i;
    }
    study s = begin(PENDULUM, 2, names, COUNT, rows[0], words, NULL);
    CHECK(s.status == KEMPE_OK);
    kempe_ensemble_result *b[] = {run(&s, 4, 0, 1), run(&s, 4, 4, 2), run(&s, 4, 1, 3), run(&s, 4, -1, 1)};
    kempe_ensemble_result *checked[] = {run_once(&s, 4, 0, 1, 0), run_once(&s, 4, 3, 2, 0)};
    for (int k = 0; k < 2; k++)
        check_differences(checked[k], rows);
    check_same_differences(checked[0], checked[1], b[0]);
    for (int k = 0; k < 2; k++)
        kempe_ensemble_result_free(checked[k]);
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < COUNT; i++) {
            double w = sqrt(9.81 / rows[i][1]), angle = rows[i][0], T = quarter(w, angle);
            CHECK_NEAR(value(b[k], i, "top"), 2 * w * sin(angle / 2), 3e-9);
            CHECK_NEAR(fmod(value(b[k], i, "top.time"), 4 * T), 3 * T, 1e-7);
            CHECK_NEAR(value(b[k], i, "down"), T, 3e-9);
            CHECK_NEAR(value(b[k], i, "turn"), 2 * T, 3e-9);
            CHECK_NEAR(value(b[k], i, "high"), -rows[i][1] * cos(angle), 3e-9);
            for (int v = 0; v < kempe_ensemble_result_quantity_count(b[0]); v++) { /* the same bits in lanes */
                double first = kempe_ensemble_result_quantity(b[0], i, v),
                       other = kempe_ensemble_result_quantity(b[k], i, v);
                CHECK(k == 3 || memcmp(&first, &other, sizeof first) == 0);
            }
        }
    for (int k = 0; k < 4; k++)
        kempe_ensemble_result_free(b[k]);
    end(&s);
}

/* -- limits, failures, the state ------------------------------------------------------------------------ */

static void test_limits(void)
{
    static const char *const names[] = {"m", "a"};
    const double rows[][2] = {{2, 0.1}, {2, 0.2}, {-1, 0.1}, {0.5, 0.1}};
    study s = begin(OSCILLATOR, 2, names, 4, rows[0], "top = max(q(x))", "top < 15 cm, max(qd(x)) <= 1 m/s");
    CHECK(s.status == KEMPE_OK);
    kempe_ensemble_result *b = run(&s, 1, 0, 1);
    kempe_table *table = NULL;
    CHECK(kempe_ensemble_result_table(b, "instances", &table) == KEMPE_OK);
    CHECK_TEXT(kempe_ensemble_result_limits(b, 0), "pass");
    CHECK_TEXT(kempe_ensemble_result_limits(b, 1), "fail");
    CHECK_TEXT(kempe_ensemble_result_limits(b, 2), "");
    CHECK(kempe_ensemble_result_outcome(b, 2) == KEMPE_OUTCOME_FAILED);
    CHECK(isnan(value(b, 2, "top")) && isnan(value(b, 2, "max(qd(x))")));
    CHECK_TEXT(kempe_ensemble_result_limits(b, 3), "fail");
    int broken = kempe_table_find(table, "broken");
    CHECK_TEXT(kempe_table_word(table, 0, broken), "");
    CHECK_TEXT(kempe_table_word(table, 1, broken), "top < 15 cm; max(qd(x)) <= 1 m/s");
    CHECK_TEXT(kempe_table_word(table, 3, broken), "max(qd(x)) <= 1 m/s");
    CHECK_NEAR(kempe_table_number(table, 3, kempe_table_find(table, "max(qd(x))")), 0.1 * sqrt(200), 1e-8);
    CHECK_TEXT(kempe_table_unit(table, kempe_table_find(table, "max(qd(x)).time")), "s");
    kempe_table_free(table);
    kempe_ensemble_result_free(b);
    end(&s);
}

/* Measuring does not change the motion. */
static void test_motion(void)
{
    static const char *const names[] = {"q.A"};
    const double rows[] = {0.4, 1.2, 2.9};
    study measured = begin(PENDULUM, 1, names, 3, rows, "max(position(bob.end).x), energy.total", NULL);
    study plain = begin(PENDULUM, 1, names, 3, rows, NULL, NULL);
    kempe_ensemble_result *a = run(&measured, 2, 0, 1), *b = run(&plain, 2, 0, 1);
    CHECK(kempe_ensemble_result_quantity_count(b) == 0);
    for (int i = 0; i < 3; i++)
        CHECK(memcmp(kempe_ensemble_result_q(a, i), kempe_ensemble_result_q(b, i), sizeof(double)) == 0 &&
              memcmp(kempe_ensemble_result_qd(a, i), kempe_ensemble_result_qd(b, i), sizeof(double)) == 0);
    kempe_ensemble_result_free(a);
    kempe_ensemble_result_free(b);
    end(&measured);
    end(&plain);
}

/* -- conditions: a ball that falls onto a spring -------------------------------------------------------- */

static void test_bounces(void)
{
    static const char *const names[] = {"k", "m"};
    const double rows[] = {4000, 2, 3000, 2, 4000, 1.5, 5000, 2.5}, g = 9.81, height = 0.5, T = 3;
    study s = begin("kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {k: 4000, m: 2}\n"
                    "bodies: {ball: {joint: {name: S, prismatic: y, at: ground}, mass: m}}\n"
                    "forces: {stop: {joint: S, force: \"if(q(S) < 0, -k*q(S), 0)\"}}\nstart: {q: {S: 0.5}}\n",
                    2, names, 4, rows,
                    "low = min(q(S)), begin = first(q(S) < 0), hits = count(q(S) < 0), inside = duration(q(S) < 0), "
                    "push = max(if(q(S) < 0, -k*q(S), 0)), impulse = integral(if(q(S) < 0, -k*q(S), 0))",
                    NULL);
    for (int lanes = 0; lanes <= 1; lanes++) {
        kempe_ensemble_result *b = run(&s, T, lanes, 1);
        for (int i = 0; b && i < 4; i++) {
            double k = rows[2 * i], m = rows[2 * i + 1], w = sqrt(k / m), v = sqrt(2 * g * height), fall = v / g;
            double sag = g / (w * w), depth = sag + hypot(sag, v / w), contact = 2 * (PI - atan(v * w / g)) / w;
            double period = contact + 2 * fall, rest = fmod(T - fall, period), whole = floor((T - fall) / period);
            CHECK(rest > contact); /* the run ends in a flight */
            CHECK_NEAR(value(b, i, "low"), -depth, 1e-8);
            CHECK_NEAR(value(b, i, "begin"), fall, 1e-8);
            CHECK(value(b, i, "hits") == whole + 1);
            CHECK_NEAR(value(b, i, "inside"), (whole + 1) * contact, 1e-7);
            CHECK_NEAR(value(b, i, "push"), k * depth, 1e-4);
            CHECK_NEAR(value(b, i, "impulse"), (whole + 1) * 2 * m * v + (whole + 1) * m * g * contact, 1e-5);
        }
        kempe_ensemble_result_free(b);
    }
    end(&s);
}

/* -- spans of time: of the oscillator, with all that begins and ends within steps ------------------------- */

static const char *const spanned =
    "top = max(q(x)) from 0.31 s to 0.35 s, low = min(q(x)) from 0.3 to 0.7, wide = range(q(x)) from 100 ms to 150 ms, "
    "middle = mean(q(x)) from 0.25 s, size = rms(q(x)) from 0.2 s to 0.6 s, area = integral(q(x)) from 0 to 0.4 s, "
    "early = mean(q(x)) to 0.4 s, "
    "down = first(q(x) < 0) from 0.5 s, already = first(q(x) < 0) from 0.32 s, "
    "often = count(q(x) < 0) from 0.32 s to 0.9 s, below = duration(q(x) < 0) from 0.3 s to 0.8 s, "
    "sign = max(if(q(x) < 0, -1, 1)), other = min(if(q(x) < 0, -1, 1)) from 0.1 s, "
    "turns = count(if(q(x) < 0, -1, 0.01) < 0), negative = mean(if(q(x) < 0, -1, 1))";

/* w = 10/s: x falls to a cos(3.5) from 0.31 s to 0.35 s, is negative from pi/20 s to 3 pi/20 s and from pi/4 s
 * on. */
static void check_spans(const kempe_ensemble_result *b, int i, double a)
{
    double w = 10, root = a * a / 2 + a * a * (sin(2 * w * 0.6) - sin(2 * w * 0.2)) / (4 * w * 0.4);
    CHECK_NEAR(value(b, i, "top"), a * cos(3.5), 1e-8);
    CHECK_NEAR(value(b, i, "top.time"), 0.35, 1e-12);
    CHECK_NEAR(value(b, i, "low"), -a, 1e-8);
    CHECK_NEAR(value(b, i, "low.time"), PI / 10, 1e-5);
    CHECK_NEAR(value(b, i, "wide"), a * (cos(1) - cos(1.5)), 1e-8);
    CHECK_NEAR(value(b, i, "middle"), a * (sin(10) - sin(2.5)) / w / 0.75, 1e-8);
    CHECK_NEAR(value(b, i, "size"), sqrt(root), 1e-8);
    CHECK_NEAR(value(b, i, "area"), a * sin(4) / w, 1e-8);
    CHECK_NEAR(value(b, i, "early"), a * sin(4) / w / 0.4, 1e-8);
    CHECK_NEAR(value(b, i, "down"), PI / 4, 1e-8);
    CHECK_NEAR(value(b, i, "already"), 0.32, 1e-12);
    CHECK(value(b, i, "often") == 1);
    CHECK_NEAR(value(b, i, "below"), 3 * PI / 20 - 0.3 + 0.8 - PI / 4, 1e-8);
    CHECK(value(b, i, "sign") == 1 && value(b, i, "other") == -1 && value(b, i, "turns") == 2);
    CHECK_NEAR(value(b, i, "negative"), 1 - 2 * (PI / 10 + 1 - PI / 4), 1e-4);
}

static void test_spans(void)
{
    static const char *const names[] = {"m", "a"};
    const double rows[][2] = {{1, 0.1}, {1, 0.15}, {1, 0.12}, {1, 0.2}, {1, 0.05}};
    study s = begin(OSCILLATOR, 2, names, 5, rows[0], spanned, NULL);
    if (s.status != KEMPE_OK)
        printf("%s\n", kempe_context_message(s.context));
    CHECK(s.status == KEMPE_OK);
    kempe_ensemble_result *b[] = {run(&s, 1, 0, 1), run(&s, 1, 1, 2), run(&s, 1, -1, 1)};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 5; i++) {
            check_spans(b[k], i, rows[i][1]);
            for (int v = 0; v < kempe_ensemble_result_quantity_count(b[0]); v++) { /* the same bits in lanes */
                double first = kempe_ensemble_result_quantity(b[0], i, v),
                       other = kempe_ensemble_result_quantity(b[k], i, v);
                CHECK(k == 2 || memcmp(&first, &other, sizeof first) == 0);
            }
        }
    }
    for (int k = 0; k < 3; k++)
        kempe_ensemble_result_free(b[k]);
    end(&s);
}

/* -- mistakes ------------------------------------------------------------------------------------------- */

static void refuse(const char *quantities, const char *limits, const char *message)
{
    static const char *const names[] = {"m"};
    const double row[] = {1};
    study s = begin(OSCILLATOR, 1, names, 1, row, quantities, limits);
    CHECK(s.status == KEMPE_E_INPUT);
    CHECK_TEXT(kempe_context_message(s.context), message);
    end(&s);
}

static void test_mistakes(void)
{
    refuse("max(q(y))", NULL, "quantity:1:7: unknown coordinate 'y'");
    refuse("q(x), first(q(x))", NULL,
           "quantity:1:17: an operator, '<', '<=', '>' or '>=' is expected, but the expression ends");
    refuse("energy", NULL, "quantity:1:1: 'energy' is not one number: give one component of it");
    refuse("1 + q(x), energy.totl", NULL,
           "quantity:1:11: 'energy.totl': unknown component of energy 'totl'; available: kinetic, potential, total; "
           "did you mean 'total'?");
    refuse("at(q(x))", NULL, "quantity:1:1: 'at(q(x))': at(EXPRESSION, TIME) is expected");
    refuse("at(q(x), 2 m)", NULL, "quantity:1:10: the time: expected s, got m");
    refuse("at(q(x), -2 s)", NULL, "quantity:1:10: '-2 s': the time must not be negative");
    refuse("a = q(x), a = qd(x)", NULL, "quantity:1:11: 'a = qd(x)': a quantity of this name is there already");
    refuse("max(q(x)) from 2 s to 1 s", NULL,
           "quantity:1:1: 'max(q(x)) from 2 s to 1 s': the span ends before it begins");
    refuse("max(q(x)) to 0 s", NULL, "quantity:1:1: 'max(q(x)) to 0 s': the span ends before it begins");
    refuse("a = q(x) from 1 s", NULL,
           "quantity:1:5: 'q(x) from 1 s': a span of time is for max(..), min(..), range(..), mean(..), rms(..), "
           "integral(..), first(..), count(..) or duration(..)");
    refuse("max(q(x)) from 1 m", NULL, "quantity:1:16: the time: expected s, got m");
    refuse("max(q(x)) from 1 s to two", NULL, "quantity:1:23: unknown parameter 'two'");
    refuse("a = ", NULL, "quantity:1:4: '': an expression is missing");
    refuse("q(x), 1 m + 1 s", NULL, "quantity:1:11: a quantity: s cannot be added to m");
    refuse(NULL, "max(q(x))", "limit:1:1: 'max(q(x))': QUANTITY < VALUE is expected, or one of <=, >, >=");
    refuse("top = max(q(x))", "top < two", "limit:1:7: unknown parameter 'two'");
}

static void test_late(void)
{
    static const char *const names[] = {"m"};
    const double row[] = {1};
    study s = begin(OSCILLATOR, 1, names, 1, row, "at(q(x), 2 s)", NULL);
    const kempe_run_options options = {.size = sizeof options, .t_end = 1};
    kempe_ensemble_result *batch = NULL;
    CHECK(kempe_ensemble_run(s.ensemble, &options, 0, &batch) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(s.context),
               "a quantity is requested at t = 2 s, after the end of the runs at 1 s");
    CHECK(!batch);
    end(&s);
}

/* -- steps that change no quantity are passed over ------------------------------------------------------ */

#define PASSED                                                                                                         \
    "top = max(qd(A)), low = min(q(A)), swing = range(q(A)), kink = max(abs(q(A) - 0.1)), fast = max(qdd(A)), "        \
    "down = first(q(A) < -0.2), often = count(q(A) < 0.1), below = duration(q(A) < 0.1)"

/* Extremes have the same bits with a mean beside them, for which no step is passed over. */
static void test_passed(void)
{
    static const char *const names[] = {"q.A", "l"}, *const quantities[] = {PASSED, PASSED ", mean(q(A))"};
    double rows[COUNT][2];
    kempe_ensemble_result *batches[2];
    kempe_table *tables[2] = {NULL};
    study studies[2];
    for (int i = 0; i < COUNT; i++) {
        rows[i][0] = 0.3 + 0.25 * i;
        rows[i][1] = 0.4 + 0.1 * i;
    }
    for (int k = 0; k < 2; k++) {
        studies[k] = begin(PENDULUM, 2, names, COUNT, rows[0], quantities[k], NULL);
        if (studies[k].status != KEMPE_OK)
            printf("%s\n", kempe_context_message(studies[k].context));
        batches[k] = run(&studies[k], 8, 0, 1);
        CHECK(kempe_ensemble_result_table(batches[k], "instances", &tables[k]) == KEMPE_OK);
    }
    for (int i = 0; i < COUNT; i++) {
        static const char *const same[] = {"top",       "top.time", "low",       "low.time", "swing", "kink",
                                           "kink.time", "fast",     "fast.time", "down",     "often"};
        for (size_t k = 0; k < sizeof same / sizeof *same; k++)
            CHECK(value(batches[0], i, same[k]) == value(batches[1], i, same[k]));
        CHECK_NEAR(value(batches[0], i, "below"), value(batches[1], i, "below"), 1e-13);
        int passed = (int)kempe_table_number(tables[0], i, kempe_table_find(tables[0], "rhs")),
            whole = (int)kempe_table_number(tables[1], i, kempe_table_find(tables[1], "rhs"));
        CHECK(passed < whole);
    }
    for (int k = 0; k < 2; k++) {
        kempe_table_free(tables[k]);
        kempe_ensemble_result_free(batches[k]);
        end(&studies[k]);
    }
}

static study begin_four_bar(void)
{
    study s = {.context = kempe_context_new()};
    CHECK(kempe_model_read(s.context, KEMPE_ROOT "/examples/four_bar/four_bar.yaml", &s.model) == KEMPE_OK);
    return s;
}

static void derive(study *s, const char *quantities)
{
    const kempe_ensemble_options options = {.size = sizeof options, .quantities = quantities};
    CHECK(kempe_ensemble_new_with(s->model, s->values, &options, &s->ensemble) == KEMPE_OK);
}

/* Multipliers of lanes, which have a program for them, beside those of separate runs, by the parts of the equations. */
static void test_multipliers(void)
{
    static const char *const names[] = {"crank", "coupler"}, *const same[] = {"pin", "pin.time", "whole",
                                                                              "a",   "down",     "often"};
    static const char *const quantities =
        "pin = max(abs(lambda(C.1))), whole = rms(lambda(C.2)), a = max(qdd(rocker)), "
        "down = first(lambda(C.1) < -50), often = count(lambda(C.1) < -50)";
    double rows[COUNT][2];
    for (int i = 0; i < COUNT; i++) {
        rows[i][0] = 0.28 + 0.004 * i;
        rows[i][1] = 0.81 - 0.003 * i;
    }
    study s = begin_four_bar();
    CHECK(kempe_values_new(s.model, 2, names, COUNT, rows[0], &s.values) == KEMPE_OK);
    derive(&s, quantities);
    kempe_ensemble_result *lanes = run(&s, 0.5, 0, 2), *one = run(&s, 0.5, 1, 1), *alone = run(&s, 0.5, -1, 1);
    for (int i = 0; i < COUNT; i++)
        for (size_t k = 0; k < sizeof same / sizeof *same; k++) {
            CHECK_NEAR(value(lanes, i, same[k]), value(alone, i, same[k]), 1e-8);
            CHECK(value(lanes, i, same[k]) == value(one, i, same[k]));
        }
    CHECK(value(lanes, 0, "pin") > 50 && value(lanes, 0, "often") > 0);
    kempe_ensemble_result_free(lanes);
    kempe_ensemble_result_free(one);
    kempe_ensemble_result_free(alone);
    end(&s);
}

/* Steps whose dense output is less exact than they are: an instance leaves its lane for them alone, and comes back. */
static void test_coarse_steps(void)
{
    const kempe_sample_options sample = {
        .size = sizeof sample, .ranges = "crank=IT7,coupler=0.98:1.02,rocker=0.698:0.702,base=0.88:0.92", .count = 200};
    static const char *const same[] = {"m", "swing"};
    const kempe_run_options options = {
        .size = sizeof options, .t_end = 1, .rtol = 1e-10, .atol = 1e-10, .no_convergence_check = 1, .threads = 1};
    study s = begin_four_bar();
    kempe_table *table = NULL;
    char *text = NULL;
    CHECK(kempe_values_sample(s.model, &sample, &s.values) == KEMPE_OK);
    derive(&s, "m = mean(q(rocker)), swing = max(q(rocker))");
    kempe_ensemble_result *lanes = run_with(&s, &options, 0), *one = run_with(&s, &options, 1),
                          *alone = run_with(&s, &options, -1);
    CHECK(kempe_ensemble_result_table(lanes, "instances", &table) == KEMPE_OK);
    CHECK(kempe_ensemble_result_print(lanes, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "in part") && strstr(text, "states between steps"));
    for (int i = 0; i < sample.count; i++) {
        CHECK_TEXT(kempe_table_word(table, i, kempe_table_find(table, "single_run")), "");
        for (size_t k = 0; k < sizeof same / sizeof *same; k++) {
            CHECK_NEAR(value(lanes, i, same[k]), value(alone, i, same[k]), 1e-7);
            CHECK(value(lanes, i, same[k]) == value(one, i, same[k]));
        }
    }
    kempe_text_free(text);
    kempe_table_free(table);
    kempe_ensemble_result_free(lanes);
    kempe_ensemble_result_free(one);
    kempe_ensemble_result_free(alone);
    end(&s);
}

/* A sledge that friction brings to rest, where it sticks: the friction takes the place of the multiplier of its row. */
static void test_friction(void)
{
    static const char *const text = "kempe: 1\nparameters: {m: 2, v: 3, f: 4}\n"
                                    "bodies: {sledge: {joint: {name: x, prismatic: x, at: ground}, mass: m}}\n"
                                    "forces: {rub: {joint: x, friction: {force: f, static: 2*f}}}\n"
                                    "start: {qd: {x: v}}\n";
    static const char *const names[] = {"m", "v"},
                             *const words = "way = max(q(x)), stop = duration(qd(x) > 1e-9), turn = integral(qdd(x)), "
                                            "push = integral(abs(lambda(rub)))";
    double rows[COUNT][2];
    for (int i = 0; i < COUNT; i++) {
        rows[i][0] = 1 + 0.2 * i;
        rows[i][1] = 2 + 0.1 * i;
    }
    study s = begin(text, 2, names, COUNT, rows[0], words, NULL);
    kempe_ensemble_result *lanes = run(&s, 4, 0, 2), *one = run(&s, 4, 1, 1), *alone = run(&s, 4, -1, 1);
    for (int i = 0; i < COUNT; i++) {
        double m = rows[i][0], v = rows[i][1], stop = m * v / 4;
        for (int k = 0; k < 2; k++) {
            const kempe_ensemble_result *batch = k == 0 ? lanes : alone;
            CHECK_NEAR(value(batch, i, "way"), 0.5 * v * stop, 1e-9);
            CHECK_NEAR(value(batch, i, "stop"), stop, 1e-8);
            CHECK_NEAR(value(batch, i, "turn"), -v, 1e-8);
            CHECK_NEAR(value(batch, i, "push"), m * v, 1e-8);
        }
        CHECK(value(lanes, i, "push") == value(one, i, "push") && value(lanes, i, "stop") == value(one, i, "stop"));
    }
    kempe_ensemble_result_free(lanes);
    kempe_ensemble_result_free(one);
    kempe_ensemble_result_free(alone);
    end(&s);
}

int main(void)
{
    TEST(test_oscillator);
    TEST(test_pendulum);
    TEST(test_limits);
    TEST(test_motion);
    TEST(test_bounces);
    TEST(test_spans);
    TEST(test_mistakes);
    TEST(test_late);
    TEST(test_passed);
    TEST(test_multipliers);
    TEST(test_coarse_steps);
    TEST(test_friction);
    return check_report();
}
