/* SPDX-License-Identifier: BSD-3-Clause */
/* The integrator of the reduced formulation where the user chose none: by counted work at the start, exchanged on
 * trial during a run; the same result each time, rows across an exchange, runs that keep theirs. */
#include "backend/x86/x86.h"
#include "base/memory.h"
#include "integrators/formulations/cycles.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include <math.h>
#include <string.h>

enum { MOST_ROWS = 200, MOST = 8 };

typedef struct rows {
    int n, count;
    double q[MOST_ROWS][MOST];
} rows;

static int take(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                double work)
{
    rows *r = user;
    (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    for (int i = 0; i < r->n; i++)
        r->q[r->count][i] = q[i];
    r->count++;
    return 0;
}

static bool has_lanes(void)
{
    return kmp_x86_runs(KMP_X86_FOUR) || kmp_x86_runs(KMP_X86_EIGHT);
}

typedef struct result {
    rows rows;
    kmp_run_report report;
    long exchanges; /* of integrators */
} result;

/* A run of an example in the integrated form; change_points NULL: the default. */
static void run(const char *name, const char *integrator, double rtol, double t_end, const char *change_points,
                result *r)
{
    char path[200];
    double times[MOST_ROWS];
    (void)snprintf(path, sizeof path, "examples/%s/%s.yaml", name, name);
    loaded l = load(path);
    kmp_run_log log = {.context = l.context};
    for (int k = 0; k < MOST_ROWS; k++)
        times[k] = t_end * (k + 1) / MOST_ROWS;
    times[MOST_ROWS - 1] = t_end;
    kmp_run_spec spec = {.formulation = "reduced",
                         .form = "integrated",
                         .integrator = integrator,
                         .change_points = change_points,
                         .rtol = rtol,
                         .t_end = t_end,
                         .time_count = MOST_ROWS,
                         .times = times,
                         .log = &log};
    *r = (result){.rows = {.n = l.system->n}};
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
    CHECK(kmp_run(l.system, &spec, NULL, take, &r->rows, &r->report) == KEMPE_OK && r->rows.count == MOST_ROWS);
    for (int k = 0; k < log.kept; k++)
        r->exchanges += strcmp(log.entries[k].kind, "integrator") == 0;
    kmp_free(r->report.reason);
    r->report.reason = NULL;
    kmp_run_log_free(&log);
    unload(&l);
}

static double apart(const rows *a, const rows *b)
{
    double worst = 0;
    for (int k = 0; k < a->count; k++)
        for (int i = 0; i < a->n; i++)
            worst = check_max(worst, fabs(a->q[k][i] - b->q[k][i]) / fmax(fabs(b->q[k][i]), 1));
    return worst;
}

/* The tighter the tolerance, the less radau takes: dop853 at a coarse one, radau at a tight one, as expected. */
static void at_the_start(void)
{
    static result loose, tight;
    run("andrews", NULL, 1e-3, 0.03, NULL, &loose);
    run("andrews", NULL, 1e-12, 0.03, NULL, &tight);
    CHECK(loose.report.chosen_ratio > tight.report.chosen_ratio && tight.report.chosen_ratio > 0);
    CHECK_TEXT(loose.report.integrator, "dop853");
    CHECK_TEXT(tight.report.integrator, has_lanes() ? "radau" : "dop853");
    CHECK(has_lanes() == (tight.report.chosen_ratio < KMP_RATIO_WORTH));
}

/* Explicit steps are limited by stability: the first trial of radau succeeds, on machines without lanes too. Rows
 * before and after it are as exact as the tolerance demands, and nothing differs in a second run. */
static void on_trial(void)
{
    static result first, second, radau;
    run("governor", NULL, 1e-3, 10, NULL, &first);
    run("governor", NULL, 1e-3, 10, NULL, &second);
    run("governor", "radau", 1e-9, 10, NULL, &radau);
    CHECK(first.report.chosen_ratio >= KMP_RATIO_WORTH && first.exchanges == 1);
    CHECK_TEXT(first.report.integrator, "radau");
    CHECK(first.report.steps > 200 && first.report.steps < 1000);
    CHECK(apart(&first.rows, &radau.rows) < 1e-2);
    CHECK(memcmp(&first.rows, &second.rows, sizeof first.rows) == 0 && first.report.rhs == second.report.rhs);
}

/* A trial without success leaves the run as it would have been, but for errors of steps. */
static void without_success(void)
{
    static result open, radau;
    run("spatial_slider_crank", NULL, 1e-10, 5, NULL, &open);
    run("spatial_slider_crank", "radau", 1e-10, 5, NULL, &radau);
    CHECK_TEXT(open.report.integrator, has_lanes() ? "radau" : "dop853");
    CHECK(open.exchanges == 0);
    CHECK(apart(&open.rows, &radau.rows) < 1e-8);
    CHECK(!has_lanes() || open.report.steps > radau.report.steps); /* those of the trial are counted, too */
}

/* An integrator that the user gave, and dop853 where change points are ignored. */
static void that_is_kept(void)
{
    static result given, ignored;
    run("governor", "dop853", 1e-3, 1, NULL, &given);
    run("andrews", NULL, 1e-12, 0.03, "ignore", &ignored);
    CHECK_TEXT(given.report.integrator, "dop853");
    CHECK_TEXT(ignored.report.integrator, "dop853");
    CHECK(given.exchanges == 0 && given.report.chosen_ratio == 0 && ignored.report.chosen_ratio == 0);
}

int main(void)
{
    TEST(at_the_start);
    TEST(on_trial);
    TEST(without_success);
    TEST(that_is_kept);
    return check_report();
}
