/* SPDX-License-Identifier: BSD-3-Clause */
/* Mechanisms with redundant closures: two-armed lamps, which come by change points again and again without meeting one,
 * and Bennett's four-bar cut at one hinge. The margin is held against singular values, rows that a formulation cannot
 * complete against its own. */
#include "base/memory.h"
#include "integrators/formulations/reduced.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/check.h>
#include <stdlib.h>

enum { MOST = 128, TIMES = 100, OF_STEP = 3 };

typedef struct table {
    int n, count;
    double q[TIMES + 1][16];
} table;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    table *rows = user;
    (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    memcpy(rows->q[rows->count++], q, (size_t)rows->n * sizeof *q);
    return 0;
}

static double difference(const table *a, const table *b)
{
    double worst = a->count == b->count ? 0 : INFINITY;
    for (int k = 0; k < a->count && k < b->count; k++)
        for (int i = 0; i < a->n; i++)
            worst = check_max(worst, fabs(a->q[k][i] - b->q[k][i]) / fmax(1, fabs(b->q[k][i])));
    return worst;
}

/* Rows at even times; the report and the log are the caller's to free. */
static kempe_status run(const loaded *l, kmp_run_spec spec, table *rows, kmp_run_report *report, kmp_run_log *log)
{
    double times[TIMES + 1];
    for (int k = 0; k <= TIMES; k++)
        times[k] = spec.t_end * k / TIMES;
    *rows = (table){.n = l->system->n};
    *log = (kmp_run_log){.context = l->context};
    spec.times = times;
    spec.time_count = TIMES + 1;
    spec.log = log;
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    kempe_status status = kmp_run(l->system, &spec, NULL, take_row, rows, report);
    if (status != KEMPE_OK)
        printf("  %s\n", report->reason ? report->reason : "");
    return status;
}

static int notes_of(const kmp_run_log *log, const char *kind)
{
    int count = 0;
    for (int k = 0; k < log->kept; k++)
        count += strcmp(log->entries[k].kind, kind) == 0;
    return count;
}

/* Its ninth singular value stays above an eighth of the largest: nothing is named, and the search costs next to
 * nothing.
 */
static void no_false_alarms(void)
{
    static const double tolerances[] = {1e-6, 1e-8, 1e-10};
    loaded l = load("tests/models/two_armed_lamp_16.yaml");
    for (size_t k = 0; k < sizeof tolerances / sizeof *tolerances; k++) {
        table led, ignored;
        kmp_run_report a, b;
        kmp_run_log notes, none;
        kmp_run_spec spec = {.integrator = "dop853", .t_end = 3, .rtol = tolerances[k]};
        CHECK(run(&l, spec, &led, &a, &notes) == KEMPE_OK);
        spec.change_points = "ignore";
        CHECK(run(&l, spec, &ignored, &b, &none) == KEMPE_OK);
        printf("  rtol %.0e: %ld evaluations, %ld with change points ignored\n", tolerances[k], a.rhs, b.rhs);
        CHECK(notes_of(&notes, "change point") == 0);
        CHECK(10 * a.rhs <= 12 * b.rhs);
        CHECK(difference(&led, &ignored) < 1e3 * tolerances[k]);
        kmp_free(a.reason);
        kmp_free(b.reason);
        kmp_run_log_free(&notes);
        kmp_run_log_free(&none);
    }
    unload(&l);
}

/* Kept rows lose their rank inside a step, which all together do not; beside a change point IDA stops, and so do the
 * steps that lead on from there. IDA makes thousands of short steps, each with an error up to rtol, and errors add up:
 * the motion of lamp 99 enlarges a change of its start 27 times until the end, that of lamp 28 six times, later ones
 * less. For lamp 99 at tolerances from 0.7e-10 to 1.5e-10 results are 300 to 4400 rtol off, with some 3500 steps. */
static void runs_reach_their_end(void)
{
    static const struct {
        const char *model, *change_points;
        double rtol;
        const char *formulation;
    } all[] = {{"6", "cross", 1e-8, NULL},   {"20", "ignore", 1e-8, NULL},  {"28", "cross", 1e-8, NULL},
               {"28", "cross", 1e-10, NULL}, {"28", "cross", 1e-10, "dae"}, {"99", "cross", 1e-10, "dae"}};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        char path[64];
        (void)snprintf(path, sizeof path, "tests/models/two_armed_lamp_%s.yaml", all[k].model);
        loaded l = load(path);
        table rows, reference;
        kmp_run_report a, b;
        kmp_run_log notes, none;
        kmp_run_spec spec = {.t_end = 3,
                             .rtol = all[k].rtol,
                             .change_points = all[k].change_points,
                             .formulation = all[k].formulation,
                             .integrator = independent_integrator(all[k].formulation)};
        CHECK(run(&l, spec, &rows, &a, &notes) == KEMPE_OK);
        spec = (kmp_run_spec){.t_end = 3, .rtol = 1e-12, .formulation = "projected", .change_points = "ignore"};
        CHECK(run(&l, spec, &reference, &b, &none) == KEMPE_OK);
        double off = difference(&rows, &reference), bound = all[k].formulation ? OF_STEP * (double)a.steps : 1e3;
        CHECK(off < bound * all[k].rtol);
        printf("  lamp %s, rtol %.0e: %.0f rtol off, %ld steps\n", all[k].model, all[k].rtol, off / all[k].rtol,
               a.steps);
        kmp_free(a.reason);
        kmp_free(b.reason);
        kmp_run_log_free(&notes);
        kmp_run_log_free(&none);
        unload(&l);
    }
}

/* Corrections of v that rounding makes refuse no step: those below KMP_CORRECTION_ROUNDING, and those that a shorter
 * step from the same place does not reduce. */
static void rounding_refuses_no_step(void)
{
    static const struct {
        const char *model;
        double rtol, t_end;
    } all[] = {{"bricard_hinge", 1e-12, 10}, {"rounded_lamp", 1e-10, 3}, {"rounded_lamp", 1e-11, 3}};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        char path[64];
        (void)snprintf(path, sizeof path, "tests/models/%s.yaml", all[k].model);
        loaded l = load(path);
        table rows;
        kmp_run_report report;
        kmp_run_log notes;
        kmp_run_spec spec = {.form = "integrated", .t_end = all[k].t_end, .rtol = all[k].rtol};
        CHECK(run(&l, spec, &rows, &report, &notes) == KEMPE_OK);
        printf("  %s, rtol %.0e: %ld steps, %ld refused\n", all[k].model, all[k].rtol, report.steps, report.refused);
        CHECK(10 * report.refused < report.steps);
        kmp_free(report.reason);
        kmp_run_log_free(&notes);
        unload(&l);
    }
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Median over starts of the error over rtol of a form. */
static double median_error(const loaded *l, const table *reference, int starts, const char *formulation,
                           const char *form, kempe_assembly *const *start, double rtol)
{
    double error[32];
    for (int k = 0; k < starts; k++) {
        double times[TIMES + 1];
        table rows = {.n = l->system->n};
        kmp_run_report report;
        for (int i = 0; i <= TIMES; i++)
            times[i] = 0.1 * i;
        kmp_run_spec spec = {.formulation = formulation,
                             .form = form,
                             .integrator = "dop853",
                             .rtol = rtol,
                             .t_end = 10,
                             .times = times,
                             .time_count = TIMES + 1};
        CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
        CHECK(kmp_run(l->system, &spec, start[k], take_row, &rows, &report) == KEMPE_OK);
        kmp_free(report.reason);
        error[k] = difference(&rows, &reference[k]) / rtol;
    }
    qsort(error, (size_t)starts, sizeof *error, compare);
    return 0.5 * (error[(starts - 1) / 2] + error[starts / 2]);
}

/* Bennett's four-bar at one of its positions, by its closed form. */
static void place(kempe_assembly *start, double j1, double rate)
{
    double ratio = tan(0.5) * tan(0.5 * 2.7568487616769688), t1 = tan(0.5 * j1), t2 = ratio / t1;
    start->q[0] = j1;
    start->q[1] = 2 * atan(t2);
    start->q[2] = -j1;
    start->qd[0] = rate;
    start->qd[1] = -rate * t2 * (1 + t1 * t1) / (t1 * (1 + t2 * t2));
    start->qd[2] = -rate;
}

/* Five rows of rank two. */
static void redundant_rows_cost_no_digits(void)
{
    enum { STARTS = 21 };
    loaded l = load("tests/models/bennett_hinge.yaml");
    table *reference = KMP_NEW(table, STARTS);
    kempe_assembly *start[STARTS] = {NULL};
    for (int k = 0; k < STARTS; k++) {
        double times[TIMES + 1];
        kmp_run_report report;
        for (int i = 0; i <= TIMES; i++)
            times[i] = 0.1 * i;
        kmp_run_spec spec = {
            .formulation = "projected", .rtol = 1e-13, .t_end = 10, .times = times, .time_count = TIMES + 1};
        CHECK(kempe_assembly_new(l.system, &start[k]) == KEMPE_OK);
        place(start[k], 0.5 + 0.1 * k, 0.15 * k);
        reference[k].n = l.system->n;
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(l.system, &spec, start[k], take_row, &reference[k], &report) == KEMPE_OK);
        kmp_free(report.reason);
    }
    for (double rtol = 1e-6; rtol > 1e-9; rtol *= 1e-2) {
        double carried = median_error(&l, reference, STARTS, "reduced", "integrated", start, rtol);
        double projected = median_error(&l, reference, STARTS, "projected", "none", start, rtol);
        printf("  rtol %.0e: error over rtol %.3g carried, %.3g projected\n", rtol, carried, projected);
        CHECK(carried <= 3 * projected);
    }
    for (int k = 0; k < STARTS; k++)
        kempe_assembly_free(start[k]);
    kmp_free(reference);
    unload(&l);
}

/* Dense output of a step and the step repeated give the same motion. */
static void a_row_by_another_way(void)
{
    static const char *const ways[][2] = {
        {"reduced", "integrated"}, {"reduced", "newton"}, {"projected", "none"}, {"dae", "stabilized1"}};
    loaded l = load("tests/models/two_armed_lamp_16.yaml");
    int n = l.system->n, m = l.system->m;
    for (size_t way = 0; way < sizeof ways / sizeof *ways; way++) {
        double row[2][MOST], work;
        kmp_run_log notes = {.context = l.context};
        kmp_runner *runner = NULL;
        kmp_run_spec spec = {
            .formulation = ways[way][0], .form = ways[way][1], .rtol = 1e-9, .t_end = 1, .log = &notes};
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
        CHECK(kmp_runner_new(l.system, &spec, NULL, &runner) == KEMPE_OK && 3 * n + m < MOST);
        while (kmp_runner_t(runner) < spec.t_end) {
            CHECK(kmp_runner_step(runner) == KEMPE_OK);
            double t = 0.5 * (kmp_runner_t_old(runner) + kmp_runner_t(runner));
            double *a = row[0], *b = row[1];
            CHECK(kmp_runner_row(runner, t, a, &work) == KEMPE_OK);
            CHECK(kmp_runner_bridge(runner, t, b, &work));
            for (int i = 0; i < 3 * n; i++)
                CHECK_NEAR(b[i], a[i], i < n ? 1e-7 : i < 2 * n ? 1e-5 : 1e-4);
        }
        CHECK(notes_of(&notes, "row") > 0);
        kmp_runner_free(runner);
        kmp_run_log_free(&notes);
    }
    unload(&l);
}

/* True with a program by the reduced mass. */
static bool is_fused(const kmp_runner *runner)
{
    const kmp_reduced *d = (const kmp_reduced *)runner->formulation;
    return d->programs.scalar && !kmp_reduced_has_saddle_program(d);
}

/* After a formulation of few steps the next one begins without a fused program, and makes it once it lasts. */
static void a_formulation_that_lasts_is_fused(void)
{
    loaded l = load("examples/parallel_robot/parallel_robot.yaml");
    kmp_run_log notes = {.context = l.context};
    kmp_run_spec spec = {.formulation = "reduced", .rtol = 1e-8, .t_end = 1, .log = &notes};
    kmp_runner *runner = NULL;
    double work;
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
    CHECK(kmp_runner_new(l.system, &spec, NULL, &runner) == KEMPE_OK);
    CHECK(is_fused(runner));
    CHECK(kmp_runner_step(runner) == KEMPE_OK);
    double t = kmp_runner_t(runner), h = runner->solver->h;
    CHECK(kmp_runner_inner_row(runner, t, true, runner->room.state, &work) == KEMPE_OK);
    CHECK(kmp_runner_restart(runner, t, false, work, h) == KEMPE_OK);
    for (int k = 0; k <= KMP_FORMULATION_BRIEF; k++) {
        CHECK(!is_fused(runner));
        CHECK(kmp_runner_step(runner) == KEMPE_OK);
    }
    CHECK(kmp_runner_step(runner) == KEMPE_OK);
    CHECK(is_fused(runner) && notes_of(&notes, "row") == 0);
    kmp_runner_free(runner);
    kmp_run_log_free(&notes);
    unload(&l);
}

/* Rows that the formulation cannot complete, as where a step is good at both ends and has no closed state between them,
 * come from the step repeated. Rows at the start of that come from the formulation. */
static int (*true_row)(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
                       double *lambda, double *work);

static int half_failing_row(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
                            double *lambda, double *work)
{
    return qdd ? KMP_HALT : true_row(formulation, t, y, q, qd, qdd, lambda, work);
}

static void rows_that_a_formulation_cannot_complete(void)
{
    loaded l = load("tests/models/long_whip.yaml");
    int n = l.system->n, m = l.system->m;
    double row[2][MOST], work;
    kmp_runner *runner = NULL;
    kmp_run_log notes = {.context = l.context};
    kmp_run_spec spec = {.form = "newton", .rtol = 1e-6, .t_end = 0.02, .log = &notes};
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK && 3 * n + m < MOST);
    CHECK(kmp_runner_new(l.system, &spec, NULL, &runner) == KEMPE_OK);
    true_row = runner->formulation->row;
    while (kmp_runner_t(runner) < spec.t_end) {
        CHECK(kmp_runner_step(runner) == KEMPE_OK);
        double t = 0.5 * (kmp_runner_t_old(runner) + kmp_runner_t(runner));
        CHECK(kmp_runner_row(runner, t, row[0], &work) == KEMPE_OK);
        runner->formulation->row = half_failing_row;
        CHECK(kmp_runner_row(runner, t, row[1], &work) == KEMPE_OK);
        runner->formulation->row = true_row;
        for (int i = 0; i < n; i++)
            CHECK_NEAR(row[1][i], row[0][i], 1e-4); /* 100 rtol */
    }
    CHECK(notes_of(&notes, "row") > 10);
    kmp_runner_free(runner);
    kmp_run_log_free(&notes);
    unload(&l);
}

/* A choice of u that returns finds its program again. */
static void programs_return_with_their_choice(void)
{
    static const char *const forms[] = {"integrated", "newton"};
    loaded l = load("tests/models/triple_rocker.yaml");
    for (size_t k = 0; k < sizeof forms / sizeof *forms; k++) {
        const kmp_reduced_program *program[8] = {NULL}; /* by u */
        int returns = 0, u = -1;
        kmp_run_spec spec = {.form = forms[k], .rtol = 1e-8, .t_end = 10};
        kmp_runner *runner = NULL;
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK && l.system->n <= 8);
        CHECK(kmp_runner_new(l.system, &spec, NULL, &runner) == KEMPE_OK);
        while (kmp_runner_t(runner) < spec.t_end && kmp_runner_step(runner) == KEMPE_OK) {
            const kmp_reduced *d = (const kmp_reduced *)runner->formulation;
            const kmp_reduced_program *before = program[d->part.u[0]];
            returns += d->part.u[0] != u && before && d->programs.scalar == before;
            u = d->part.u[0];
            program[u] = d->programs.scalar ? d->programs.scalar : program[u];
        }
        CHECK(kmp_runner_t(runner) >= spec.t_end && returns > 3);
        kmp_runner_free(runner);
    }
    unload(&l);
}

int main(void)
{
    TEST(no_false_alarms);
    TEST(runs_reach_their_end);
    TEST(rounding_refuses_no_step);
    TEST(redundant_rows_cost_no_digits);
    TEST(a_row_by_another_way);
    TEST(rows_that_a_formulation_cannot_complete);
    TEST(programs_return_with_their_choice);
    TEST(a_formulation_that_lasts_is_fused);
    return check_report();
}
