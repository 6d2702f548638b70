/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Results: the JSON writer, tables, output times, reference files good and bad, verdicts on tables made by hand,
 * reports of what failed. */
#include "base/context.h"
#include "base/json.h"
#include "base/memory.h"
#include "base/text.h"
#include "loaded.h"
#include "output/reference.h"
#include "output/verdict.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/compare.h>
#include <kempe/kempe.h>
#include <stdlib.h>
#include <unistd.h>

static const char slider_crank[] =
    "kempe: 1\nname: slider-crank\nground: {points: {O: [0, 0, 0], S: [0.7, 0, 0]}}\nbodies:\n"
    "  crank: {joint: {name: crank, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.01},\n"
    "          points: {A: [0.2, 0, 0]}}\n"
    "  rod: {joint: {name: rod, revolute: z, at: crank.A}, mass: 2, inertia: {zz: 0.02}, points: {P: [0.5, 0, 0]}}\n"
    "  slider: {joint: {name: slider, prismatic: x, at: ground.S}, mass: 3, points: {P: [0, 0, 0]}}\n"
    "loops: {P: {ball: [rod.P, slider.P]}}\n";

/* A mass of 2 kg that falls along y: T = qd^2, V = 20 q. */
static const char falling[] =
    "kempe: 1\nname: falling\ngravity: [0, -10, 0]\nground: {points: {O: [0, 0, 0]}}\n"
    "bodies: {stone: {joint: {name: y, prismatic: y, at: ground.O}, mass: 2}}\nrun: {t_end: 1}\n";

/* Two bars of 1 m that are to reach a point 3 m away. */
static const char too_far[] =
    "kempe: 1\nname: too far\nground: {points: {O: [0, 0, 0], F: [3, 0, 0]}}\nbodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {B: [1, 0, 0]}}\n"
    "  b: {joint: {name: b, revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, points: {C: [1, 0, 0]}}\n"
    "loops: {reach: {ball: [b.C, ground.F]}}\nrun: {t_end: 1, outputs: [q, position(b.C)]}\n";

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kmp_evaluator *eval;
} scene;

static scene open_scene(const char *text)
{
    loaded l = load_text(text);
    scene s = {l.context, l.model, l.system, kmp_eval_new(l.system, "tape")};
    CHECK(s.eval != NULL);
    return s;
}

static void close_scene(scene *s)
{
    loaded l = {s->context, s->model, s->system};
    kmp_eval_free(s->eval);
    unload(&l);
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void test_json(void)
{
    kmp_text text = {0};
    kmp_json json = kmp_json_begin(&text);
    const double numbers[] = {1, NAN, 1.0 / 3};
    kmp_json_object(&json, NULL);
    kmp_json_string(&json, "a \"key\"", "tab\t, quote \", slash \\");
    kmp_json_string(&json, "none", NULL);
    kmp_json_number(&json, "tenth", 0.1);
    kmp_json_number(&json, "infinite", INFINITY);
    kmp_json_whole(&json, "whole", -7);
    kmp_json_boolean(&json, "true", true);
    kmp_json_numbers(&json, "numbers", 3, numbers);
    kmp_json_array(&json, "empty");
    kmp_json_end(&json);
    kmp_json_array(&json, "list");
    kmp_json_object(&json, NULL);
    kmp_json_end(&json);
    kmp_json_string(&json, NULL, "x");
    kmp_json_end(&json);
    kmp_json_end(&json);
    char *s = kmp_text_take(&text);
    CHECK_TEXT(
        s,
        "{\n  \"a \\\"key\\\"\": \"tab\\u0009, quote \\\", slash \\\\\",\n  \"none\": null,\n"
        "  \"tenth\": 0.1,\n  \"infinite\": null,\n  \"whole\": -7,\n  \"true\": true,\n"
        "  \"numbers\": [1, null, 0.3333333333333333],\n  \"empty\": [],\n  \"list\": [\n    {},\n    \"x\"\n  ]\n}\n");
    kmp_free(s);
}

/* A template writes what its members do one by one. */
static void test_json_template(void)
{
    kmp_text text = {0};
    kmp_json json = kmp_json_begin_as(&text, KMP_JSON_COMPACT);
    const char *volatile none = NULL;
    kmp_json_put(&json, "{ tenth %g none %s long %ld list [ { third %.3g } { no %i yes %i } ]", 0.1, none, -7L, 1.0 / 3,
                 false, true);
    kmp_json_put(&json, "empty { } whole %d %s { low %d } %s [ %s %d ] }", 3, "by name", 1, "listed", "word", 2);
    CHECK_TEXT(text.s,
               "{\"tenth\":0.1,\"none\":null,\"long\":-7,\"list\":[{\"third\":0.333},{\"no\":false,\"yes\":true}],"
               "\"empty\":{},\"whole\":3,\"by name\":{\"low\":1},\"listed\":[\"word\",2]}");
    kmp_text_free(&text);
}

/* -- table and times --------------------------------------------------------------------------------- */

static void test_table(void)
{
    kmp_samples table;
    kmp_samples_init(&table, 2, 1);
    for (int r = 0; r < 300; r++) {
        double x = r, q[] = {x, x + 0.25}, qd[] = {-x, 2 * x}, qdd[] = {3 * x, 4 * x}, lambda[] = {5 * x};
        CHECK(kmp_samples_add(&table, 0.5 * x, q, qd, qdd, lambda, 7 * x) == 0);
    }
    CHECK(table.rows == 300);
    CHECK_NEAR(kmp_samples_time(&table, 299), 149.5, 0);
    CHECK_NEAR(kmp_samples_work(&table, 299), 2093, 0);
    CHECK_NEAR(kmp_samples_get(&table, KMP_QUANTITY_Q, 10)[1], 10.25, 0);
    CHECK_NEAR(kmp_samples_get(&table, KMP_QUANTITY_QD, 10)[0], -10, 0);
    CHECK_NEAR(kmp_samples_get(&table, KMP_QUANTITY_QDD, 10)[1], 40, 0);
    CHECK_NEAR(kmp_samples_get(&table, KMP_QUANTITY_LAMBDA, 10)[0], 50, 0);
    kmp_samples_free(&table);
}

static void test_table_without_closures(void)
{
    kmp_samples table;
    const double one[] = {1};
    kmp_samples_init(&table, 1, 0);
    CHECK(kmp_samples_add(&table, 0, one, one, one, NULL, 0) == 0);
    CHECK(table.rows == 1);
    kmp_samples_free(&table);
}

static void expect_times(double every, double t_end, const kmp_reference *reference, int count, const double *t)
{
    kmp_times times;
    CHECK(kmp_times_init(&times, every, t_end, reference));
    CHECK(times.count == count);
    for (int k = 0; k < times.count && k < count; k++)
        CHECK_NEAR(times.t[k], t[k], 0);
    kmp_times_free(&times);
}

static void test_times(void)
{
    double given[] = {0.25, 0.3, 0.45};
    kmp_reference reference = {.rows = 3, .t = given};
    const double plain[] = {0, 0.1, 0.2, 0.3, 0.4}, united[] = {0, 0.1, 0.2, 0.25, 0.3, 0.4, 0.45, 0.5};
    const double odd[] = {0, 0.3, 0.6, 0.7}, ends[] = {0, 0.25, 0.3, 0.45, 2};
    expect_times(0.1, 0.4, NULL, 5, plain);
    expect_times(0.1, 0.5, &reference, 8, united);
    expect_times(0.3, 0.7, NULL, 4, odd);
    expect_times(2, 2, &reference, 5, ends);
}

/* -- references -------------------------------------------------------------------------------------- */

/* Reads `text` as a reference file. */
static kempe_status read_reference(const scene *s, const char *text, kmp_reference *reference)
{
    char path[] = "/tmp/kempe_results_XXXXXX";
    int file = mkstemp(path);
    CHECK(file >= 0);
    if (file < 0)
        return KEMPE_E_IO;
    close(file);
    CHECK(kempe_write_file(s->context, path, text) == KEMPE_OK);
    kempe_status status = kmp_reference_read(s->system, path, reference);
    unlink(path);
    return status;
}

static void test_reference(void)
{
    scene s = open_scene(slider_crank);
    kmp_reference reference = {0};
    CHECK(read_reference(&s,
                         "\xef\xbb\xbf# made by hand\r\nt, q.rod,lambda.P.2,position.rod.P.x,tau.crank,energy.total\r\n"
                         "0,1.5,,9,3,4\n\n# between\n0.5 , -2e-1,+7,,,\n 2,,8,1,2,3\n",
                         &reference) == KEMPE_OK);
    CHECK(reference.rows == 3);
    CHECK_NEAR(reference.t[1], 0.5, 0);
    CHECK_NEAR(reference.value[KMP_QUANTITY_Q][3 * 1 + 1], -0.2, 0);
    CHECK(isnan(reference.value[KMP_QUANTITY_Q][0]));
    CHECK(isnan(reference.value[KMP_QUANTITY_Q][3 * 2 + 1]));
    CHECK(isnan(reference.value[KMP_QUANTITY_LAMBDA][1]));
    CHECK_NEAR(reference.value[KMP_QUANTITY_LAMBDA][2 * 1 + 1], 7, 0);
    kmp_samples_limit(&reference, 1.9);
    CHECK(reference.rows == 2);
    kmp_samples_free(&reference);
    close_scene(&s);
}

/* Room for rows grows with them. */
static void test_long_reference(void)
{
    enum { ROWS = 1000 };
    scene s = open_scene(slider_crank);
    kmp_reference reference = {0};
    kmp_text text = {0};
    kmp_text_put(&text, "t,q.rod\n");
    for (int k = 0; k < ROWS; k++)
        kmp_text_printf(&text, "%d,%d.5\n", k, -k);
    CHECK(!text.failed && read_reference(&s, text.s, &reference) == KEMPE_OK);
    CHECK(reference.rows == ROWS);
    for (int k = 0; k < reference.rows; k++) {
        CHECK_NEAR(reference.t[k], k, 0);
        CHECK_NEAR(reference.value[KMP_QUANTITY_Q][3 * k + 1], k > 0 ? -k - 0.5 : 0.5, 0);
        CHECK(isnan(reference.value[KMP_QUANTITY_Q][3 * k + 2]) && isnan(reference.value[KMP_QUANTITY_QD][3 * k]));
    }
    kmp_samples_free(&reference);
    kmp_text_free(&text);
    close_scene(&s);
}

/* Twenty complaints are enough: the rest is not looked at. */
static void test_hopeless_reference(void)
{
    scene s = open_scene(slider_crank);
    kmp_reference reference = {0};
    kmp_text text = {0};
    int lines = 1;
    kmp_text_put(&text, "t");
    for (int k = 0; k < 200000; k++)
        kmp_text_put(&text, ",u");
    CHECK(!text.failed && read_reference(&s, text.s, &reference) == KEMPE_E_INPUT);
    for (const char *c = kempe_context_message(s.context); *c; c++)
        lines += *c == '\n';
    CHECK(lines == 20);
    kmp_text_free(&text);
    close_scene(&s);
}

static void expect_complaint(const scene *s, const char *text, const char *place, const char *words)
{
    kmp_reference reference = {0};
    kmp_context_clear(s->context);
    CHECK(read_reference(s, text, &reference) == KEMPE_E_INPUT);
    const char *message = kempe_context_message(s->context);
    if (!strstr(message, place) || !strstr(message, words)) {
        printf("wanted '%s' and '%s' in: %s\n", place, words, message);
        check_failures++;
    }
    CHECK(reference.t == NULL);
}

static void test_bad_references(void)
{
    scene s = open_scene(slider_crank);
    expect_complaint(&s, "t,q.crnk\n0,1\n", ":1:3: ", "did you mean 'q.crank'?");
    expect_complaint(&s, "t,lambda.P.3\n0,1\n", ":1:3: ", "'lambda.P.");
    expect_complaint(&s, "t,velocity\n", ":1:3: ", "unknown column 'velocity'");
    expect_complaint(&s, "t,whatever_is_this\n", ":1:3: ", "lambda.CLOSURE.k");
    expect_complaint(&s, "t,q.rod,q.rod\n", ":1:9: ", "duplicate");
    expect_complaint(&s, "q.rod\n1\n", ":1:1: ", "column t is missing");
    expect_complaint(&s, "", ":1:1: ", "header");
    expect_complaint(&s, "t,q.rod\n0,1x\n", ":2:3: ", "not a number");
    expect_complaint(&s, "t,q.rod\n0,nan\n", ":2:3: ", "not a number");
    expect_complaint(&s, "t,q.rod\n0,1e999\n", ":2:3: ", "not a number");
    expect_complaint(&s, "t,q.rod\n,1\n", ":2:1: ", "time");
    expect_complaint(&s, "t,q.rod\n-1,1\n", ":2:1: ", "begin at 0");
    expect_complaint(&s, "t,q.rod\n1,1\n1,2\n", ":3:1: ", "increase");
    expect_complaint(&s, "t,q.rod\n1\n", ":2:1: ", "1 field where the header has 2");
    expect_complaint(&s, "t,q.rod\n1,2,3\n", ":2:1: ", "3 fields");
    kmp_reference reference = {0};
    CHECK(kmp_reference_read(s.system, "no/such/file.csv", &reference) == KEMPE_E_IO);
    close_scene(&s);
}

/* -- verdicts ---------------------------------------------------------------------------------------- */

static void test_residual(void)
{
    scene s = open_scene(slider_crank);
    kmp_samples table;
    const double closed[] = {0, 0, 0}, open[] = {0, 0, 1e-3}, rest[] = {0, 0, 0}, moving[] = {0, 0, -2e-3};
    const double lambda[] = {0, 0};
    kmp_samples_init(&table, 3, 2);
    kmp_verdict verdict = kmp_verdict_of(&table, s.eval, NULL);
    CHECK(isnan(verdict.h_max) && isnan(verdict.drift_rel));
    kmp_samples_add(&table, 0, closed, moving, rest, lambda, 0);
    kmp_samples_add(&table, 1, open, rest, rest, lambda, 0);
    verdict = kmp_verdict_of(&table, s.eval, NULL);
    CHECK_NEAR(s.system->length, 0.5, 0);
    CHECK_NEAR(verdict.h_max, 2e-3, 1e-15); /* 1 mm of 0.5 m */
    CHECK_NEAR(verdict.hdot_max, 4e-3, 1e-15);
    CHECK(isnan(verdict.error[KMP_QUANTITY_Q]));
    kmp_samples_free(&table);
    close_scene(&s);
}

static void add_fall(kmp_samples *table, double t, double q, double qd, double work)
{
    const double qdd[] = {-10};
    CHECK(kmp_samples_add(table, t, &q, &qd, qdd, NULL, work) == 0);
}

static void test_energy(void)
{
    scene s = open_scene(falling);
    kmp_samples table;
    kmp_samples_init(&table, 1, 0);
    add_fall(&table, 0, 0, 0, 0);
    add_fall(&table, 1, -5, -10, 0);
    CHECK_NEAR(kmp_verdict_of(&table, s.eval, NULL).drift_rel, 0, 1e-15);
    add_fall(&table, 2, -20, -21, 0); /* T = 441 where 400 is right */
    CHECK_NEAR(kmp_verdict_of(&table, s.eval, NULL).drift_rel, 41.0 / 441, 1e-14);
    table.rows = 2;
    add_fall(&table, 2, -20, -21, 41); /* and something pushed */
    CHECK_NEAR(kmp_verdict_of(&table, s.eval, NULL).drift_rel, 0, 1e-14);
    table.rows = 1;
    CHECK_NEAR(kmp_verdict_of(&table, s.eval, NULL).drift_rel, 0, 0);
    kmp_samples_free(&table);
    close_scene(&s);
}

static void test_error(void)
{
    scene s = open_scene(falling);
    kmp_samples table;
    kmp_reference reference = {0};
    CHECK(read_reference(&s, "t,q.y,qd.y\n0.5,100,\n1,-4,\n2,-10,\n", &reference) == KEMPE_OK);
    kmp_samples_init(&table, 1, 0);
    add_fall(&table, 0, 0, 0, 0);
    add_fall(&table, 1, -5, -10, 0);
    add_fall(&table, 2, -20, -20, 0);
    kmp_verdict verdict = kmp_verdict_of(&table, s.eval, &reference);
    CHECK_NEAR(verdict.error[KMP_QUANTITY_Q], 1, 1e-15); /* max(1 / 4, 10 / 10) */
    CHECK(isnan(verdict.error[KMP_QUANTITY_QD]));
    CHECK(isnan(verdict.error[KMP_QUANTITY_LAMBDA]));
    kmp_samples_free(&reference);
    CHECK_NEAR(kmp_verdict_of(&table, s.eval, &table).error[KMP_QUANTITY_QDD], 0, 0);
    kmp_samples_free(&table);
    close_scene(&s);
}

/* -- whole runs -------------------------------------------------------------------------------------- */

static void test_fall_simulated(void)
{
    scene s = open_scene(falling);
    kempe_run_options run = {0};
    kempe_trajectory *trajectory = NULL;
    run.output_step = 0.5;
    CHECK(kempe_simulate(s.system, &run, &trajectory) == KEMPE_OK);
    CHECK(kempe_trajectory_row_count(trajectory) == 3);
    CHECK_NEAR(kempe_trajectory_q(trajectory, 2)[0], -5, 1e-12);
    CHECK_NEAR(kempe_trajectory_qdd(trajectory, 1)[0], -10, 1e-12);
    CHECK(kempe_trajectory_q(trajectory, 3) == NULL);
    CHECK(kempe_trajectory_outcome(trajectory) == KEMPE_OUTCOME_COMPLETE);
    CHECK_TEXT(kempe_trajectory_reason(trajectory), "");
    kempe_trajectory_free(trajectory);
    close_scene(&s);
}

static void test_options_refused(void)
{
    scene s = open_scene(slider_crank);
    kempe_trajectory *trajectory = NULL;
    kempe_run_options runs[4] = {
        {.independent = "rd"}, {.independent = "rod,rod"}, {.rtol = -1}, {.output_step = 1e-9, .t_end = 1}};
    for (int k = 0; k < 4; k++)
        CHECK(kempe_simulate(s.system, &runs[k], &trajectory) == KEMPE_E_ARGUMENT);
    kempe_compare_options compares[4] = {
        {.formulations = "reduced,rode"}, {.rtols = "1e-6,x"}, {.rtols = ""}, {.forms = "shut"}};
    kempe_comparison *comparison = NULL;
    for (int k = 0; k < 4; k++)
        CHECK(kempe_comparison_new(s.system, &compares[k], &comparison) == KEMPE_E_ARGUMENT);
    CHECK(trajectory == NULL && comparison == NULL);
    CHECK(strstr(kempe_context_message(s.context), "unknown form 'shut'") != NULL);
    close_scene(&s);
}

/* Prints both ways and looks for words in each. */
#define CHECK_REPORT(print, object, words)                                                                             \
    do {                                                                                                               \
        for (int check_k = 0; check_k < 2; check_k++) {                                                                \
            char *check_text = NULL;                                                                                   \
            CHECK(print(object, check_k ? KEMPE_JSON : KEMPE_TEXT, &check_text) == KEMPE_OK);                          \
            CHECK(check_text &&strstr(check_text, words));                                                             \
            CHECK(check_text && !strstr(check_text, "nan") && !strstr(check_text, "inf"));                             \
            kempe_text_free(check_text);                                                                               \
        }                                                                                                              \
    } while (0)

static void test_reports_of_failure(void)
{
    scene s = open_scene(too_far);
    kempe_assembly *assembly = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_comparison *comparison = NULL;
    kempe_run_options run = {0};
    kempe_compare_options compare = {0};
    CHECK(kempe_assembly_new(s.system, &assembly) == KEMPE_E_FAILED);
    CHECK_REPORT(kempe_assembly_print, assembly, "reach");
    CHECK(kempe_simulate(s.system, &run, &trajectory) == KEMPE_E_FAILED);
    CHECK(kempe_trajectory_outcome(trajectory) == KEMPE_OUTCOME_FAILED);
    CHECK(strstr(kempe_context_message(s.context), "reach") != NULL);
    CHECK_REPORT(kempe_trajectory_print, trajectory, "reach");
    CHECK(kempe_comparison_new(s.system, &compare, &comparison) == KEMPE_E_FAILED);
    CHECK_REPORT(kempe_comparison_print, comparison, "reach");
    kempe_assembly_free(assembly);
    kempe_trajectory_free(trajectory);
    kempe_comparison_free(comparison);
    close_scene(&s);
}

static void test_equations_shown(void)
{
    scene s = open_scene(falling);
    char *text = NULL;
    CHECK(kempe_system_print(s.system, KEMPE_VIEW_EQUATIONS, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\nM[1,1] = 2\n"));
    CHECK(text && strstr(text, "\nC[1] = 20\n"));
    kempe_text_free(text);
    close_scene(&s);
}

int main(void)
{
    TEST(test_json);
    TEST(test_json_template);
    TEST(test_table);
    TEST(test_table_without_closures);
    TEST(test_times);
    TEST(test_reference);
    TEST(test_long_reference);
    TEST(test_hopeless_reference);
    TEST(test_bad_references);
    TEST(test_residual);
    TEST(test_energy);
    TEST(test_error);
    TEST(test_fall_simulated);
    TEST(test_options_refused);
    TEST(test_reports_of_failure);
    TEST(test_equations_shown);
    return check_report();
}
