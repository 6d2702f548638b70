/* SPDX-License-Identifier: BSD-3-Clause */
/* The integrator where the user chose none. On the reduced formulation it is chosen by counted work at the start, and
 * exchanged on trial during a run; lanes are made where they pay; the projected formulation where coordinates must be
 * exchanged; the same result each time, rows across an exchange, runs that keep theirs. On the others it is radau where
 * its stages have lanes; the reasons of another choice. */
#include "backend/encoders.h"
#include "base/memory.h"
#include "integrators/formulations/cost_model.h"
#include "integrators/formulations/reduced.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_change.h"
#include "loaded.h"
#include <math.h>
#include <string.h>

enum { MOST_ROWS = 200, MOST = 64 };

typedef struct rows {
    int n, m, count;
    double q[MOST_ROWS][MOST], lambda[MOST_ROWS][MOST];
} rows;

static int take(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                double work)
{
    rows *r = user;
    (void)t, (void)qd, (void)qdd, (void)work;
    for (int i = 0; i < r->n; i++)
        r->q[r->count][i] = q[i];
    for (int j = 0; j < r->m; j++)
        r->lambda[r->count][j] = lambda[j];
    r->count++;
    return 0;
}

static bool has_lanes(void)
{
    return kmp_code_form_of(8) != 0;
}

typedef struct result {
    rows rows;
    kmp_run_report report;
    long exchanges; /* of integrators */
    long left;      /* changes of formulation */
} result;

/* A run of an example, by its name or its folder and file, or of a model of tests; form, integrator and change_points
 * NULL: the default. */
static void run_on(const char *formulation, const char *form, const char *name, const char *integrator, double rtol,
                   double t_end, const char *change_points, result *r)
{
    char path[200];
    double times[MOST_ROWS];
    if (strncmp(name, "tests/", 6) == 0)
        (void)snprintf(path, sizeof path, "%s.yaml", name);
    else if (strchr(name, '/'))
        (void)snprintf(path, sizeof path, "examples/%s.yaml", name);
    else
        (void)snprintf(path, sizeof path, "examples/%s/%s.yaml", name, name);
    loaded l = load(path);
    kmp_run_log log = {.context = l.context};
    CHECK(l.system->n <= MOST);
    for (int k = 0; k < MOST_ROWS; k++)
        times[k] = t_end * (k + 1) / MOST_ROWS;
    times[MOST_ROWS - 1] = t_end;
    kmp_run_spec spec = {.formulation = formulation,
                         .form = form,
                         .integrator = integrator,
                         .change_points = change_points,
                         .rtol = rtol,
                         .t_end = t_end,
                         .time_count = MOST_ROWS,
                         .times = times,
                         .log = &log};
    *r = (result){.rows = {.n = l.system->n, .m = l.system->m}};
    CHECK(l.system->n <= MOST && l.system->m <= MOST);
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
    CHECK(kmp_run(l.system, &spec, NULL, take, &r->rows, &r->report) == KEMPE_OK && r->rows.count == MOST_ROWS);
    for (int k = 0; k < log.kept; k++)
        r->exchanges += strcmp(log.entries[k].kind, "integrator") == 0;
    for (int k = 0; k < log.kept; k++)
        r->left += strcmp(log.entries[k].kind, "formulation") == 0;
    kmp_free(r->report.reason);
    r->report.reason = NULL;
    kmp_run_log_free(&log);
    unload(&l);
}

static void run(const char *name, const char *integrator, double rtol, double t_end, const char *change_points,
                result *r)
{
    run_on("reduced", "integrated", name, integrator, rtol, t_end, change_points, r);
}

static double values_apart(int count, const double *a, const double *b)
{
    double worst = 0;
    for (int i = 0; i < count; i++)
        worst = check_max(worst, fabs(a[i] - b[i]) / fmax(fabs(b[i]), 1));
    return worst;
}

static double apart(const rows *a, const rows *b)
{
    double worst = 0;
    for (int k = 0; k < a->count; k++)
        worst = check_max(worst, values_apart(a->n, a->q[k], b->q[k]));
    return worst;
}

static double multipliers_apart(const rows *a, const rows *b)
{
    double worst = 0;
    for (int k = 0; k < a->count; k++)
        worst = check_max(worst, values_apart(a->m, a->lambda[k], b->lambda[k]));
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

/* Explicit steps are limited by stability: the first trial of radau comes early, because the rest would be long, and
 * succeeds, on machines without lanes too. Rows
 * before and after it are as exact as the tolerance demands, and nothing differs in a second run. */
static void on_trial(void)
{
    static result first, second, radau;
    run("governor", NULL, 1e-3, 10, NULL, &first);
    run("governor", NULL, 1e-3, 10, NULL, &second);
    run("governor", "radau", 1e-9, 10, NULL, &radau);
    CHECK(first.report.chosen_ratio >= KMP_RATIO_WORTH && first.exchanges == 1);
    CHECK_TEXT(first.report.integrator, "radau");
    CHECK(first.report.steps > 56 && first.report.steps < 300);
    CHECK(apart(&first.rows, &radau.rows) < 1e-2);
    CHECK(memcmp(&first.rows, &second.rows, sizeof first.rows) == 0 && first.report.rhs == second.report.rhs);
}

/* A trial without success leaves the run as it would have been, but for errors of steps. */
static void without_success(void)
{
    static result open, radau, brief, brief_radau;
    run("spatial_slider_crank", NULL, 1e-10, 10, NULL, &open);
    run("spatial_slider_crank", "radau", 1e-10, 10, NULL, &radau);
    CHECK_TEXT(open.report.integrator, has_lanes() ? "radau" : "dop853");
    CHECK(open.exchanges == 0);
    CHECK(apart(&open.rows, &radau.rows) < 1e-8);
    CHECK(!has_lanes() || open.report.steps > radau.report.steps); /* those of the trial are counted, too */
    /* The rest of a short run does not pay a trial. */
    run("spatial_slider_crank", NULL, 1e-10, 4, NULL, &brief);
    run("spatial_slider_crank", "radau", 1e-10, 4, NULL, &brief_radau);
    CHECK(!has_lanes() || (brief.report.steps > 240 && memcmp(&brief.rows, &brief_radau.rows, sizeof brief.rows) == 0));
}

/* True if the reduced formulation has lanes for its present unknowns. */
static bool keeps_lanes(const kmp_runner *runner)
{
    return ((const kmp_reduced *)runner->formulation)->programs.stages.lanes;
}

/* Steps in lanes and without; how often lanes were made after steps without them. */
typedef struct seen {
    int with, without, made;
} seen;

/* A new formulation after a single step. */
static void restart(kmp_runner *runner)
{
    double work;
    CHECK(kmp_runner_step(runner) == KEMPE_OK);
    double t = kmp_runner_t(runner), h = runner->solver->h;
    CHECK(kmp_runner_inner_row(runner, t, true, runner->room.state, &work) == KEMPE_OK);
    CHECK(kmp_runner_restart(runner, t, false, work, h) == KEMPE_OK);
    CHECK(!runner->kind->lanes);
}

/* Lanes are there for the integrator that uses them, and are not made for one that waits for them. `again`: with a new
 * formulation after a single step. */
static seen step_through(const char *path, double rtol, double t_end, bool again)
{
    loaded l = load(path);
    kmp_runner *runner = NULL;
    kmp_run_log log = {.context = l.context};
    kmp_run_spec spec = {.formulation = "reduced", .form = "integrated", .rtol = rtol, .t_end = t_end, .log = &log};
    seen count = {0};
    bool before = false;
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
    CHECK(kmp_runner_new(l.system, &spec, NULL, &runner) == KEMPE_OK);
    CHECK(runner->kind->lanes && keeps_lanes(runner));
    if (again)
        restart(runner);
    while (kmp_runner_t(runner) < t_end) {
        CHECK(kmp_runner_step(runner) == KEMPE_OK);
        bool waits = runner->choice.waits && !runner->kind->lanes;
        CHECK(!(waits && keeps_lanes(runner)) && !(runner->kind->lanes && !keeps_lanes(runner)));
        count.with += runner->kind->lanes;
        count.without += waits;
        count.made += before && runner->kind->lanes;
        before = waits;
    }
    kmp_runner_free(runner);
    kmp_run_log_free(&log);
    unload(&l);
    return count;
}

/* Choices of rows or coordinates that last for a few steps are worth no lanes; one that lasts is. */
static void lanes_once_they_pay(void)
{
    if (!has_lanes())
        return;
    seen of_rows = step_through("tests/models/two_armed_lamp.yaml", 1e-10, 3, false);
    seen of_coordinates = step_through("tests/models/closed_arm_own.yaml", 1e-8, 1, false);
    seen lasting = step_through("examples/spatial_slider_crank/spatial_slider_crank.yaml", 1e-10, 5, true);
    CHECK(of_rows.without > 5 * of_rows.with && of_coordinates.without > 5 * of_coordinates.with);
    CHECK(lasting.made == 1 && lasting.without > 10 && lasting.with > lasting.without);
}

/* The projected formulation continues to the end where coordinates must be exchanged, unless the user gave one, or the
 * coordinates. */
static void without_unknowns(void)
{
    static result open, again, given, other;
    if (!has_lanes())
        return;
    run_on(NULL, NULL, "four_bar", NULL, 1e-10, 3, NULL, &open);
    run_on(NULL, NULL, "four_bar", NULL, 1e-10, 3, NULL, &again);
    run_on("reduced", NULL, "four_bar", NULL, 1e-10, 3, NULL, &given);
    run_on("projected", NULL, "four_bar", "dop853", 1e-12, 3, NULL, &other);
    CHECK(open.left == 1 && open.report.exchanges == 0 && given.left == 0 && given.report.exchanges > 1);
    CHECK_TEXT(open.report.integrator, "radau");
    CHECK_TEXT(open.report.continued, "projected");
    CHECK(open.report.continued_t > 0 && open.report.continued_t < 1 && !given.report.continued);
    CHECK(memcmp(&open.rows, &again.rows, sizeof open.rows) == 0);
    CHECK(apart(&open.rows, &given.rows) < 1e-8 && apart(&open.rows, &other.rows) < 1e-8);
}

/* A light crank in line with the coupler costs the saddle system digits, and lanes do not serve there: the run returns
 * to independent coordinates for good. */
static void with_unknowns_again(void)
{
    static result open, given;
    if (!has_lanes())
        return;
    run_on(NULL, NULL, "four_bar/four_bar_ill", NULL, 1e-10, 1, NULL, &open);
    run_on("projected", NULL, "four_bar/four_bar_ill", "radau", 1e-12, 1, NULL, &given);
    CHECK(open.left == 2 && open.report.exchanges > 2 && !open.report.continued);
    CHECK_TEXT(open.report.integrator, "radau");
    CHECK(apart(&open.rows, &given.rows) < 1e-7);
}

/* Steps that are many more than the motion needs: radau is tried early. A change of modes interrupts the trial, whose
 * result is clear. Friction by loads has lanes, in which radau is taken at once. */
static void where_steps_are_many(void)
{
    static result electric, dome, exact;
    run_on(NULL, NULL, "stick_slip", NULL, 1e-10, 2, NULL, &electric);
    CHECK_TEXT(electric.report.integrator, has_lanes() ? "radau" : "dop853");
    CHECK(!has_lanes() || (electric.report.chosen_ratio > KMP_RATIO_WORTH && electric.exchanges == 1));
    run_on(NULL, NULL, "tests/models/contact_dome", NULL, 1e-11, 1.2, NULL, &dome);
    run_on(NULL, NULL, "tests/models/contact_dome", "dop853", 1e-12, 1.2, NULL, &exact);
    CHECK_TEXT(dome.report.integrator, "radau");
    CHECK(!has_lanes() || (dome.exchanges == 0 && dome.report.chosen_ratio > 0));
    CHECK(dome.report.steps < exact.report.steps / 2);
    CHECK(apart(&dome.rows, &exact.rows) < 1e-8);
}

/* With redundant rows those that are kept, and their multipliers, are the same as on the reduced formulation. */
static void with_the_same_rows(void)
{
    static result open, given;
    if (!has_lanes())
        return;
    run_on(NULL, NULL, "four_bar/four_bar_spatial", NULL, 1e-10, 3, NULL, &open);
    run_on("reduced", NULL, "four_bar/four_bar_spatial", NULL, 1e-10, 3, NULL, &given);
    CHECK(open.left == 1 && given.left == 0 && open.rows.m > 2);
    CHECK(apart(&open.rows, &given.rows) < 1e-8 && multipliers_apart(&open.rows, &given.rows) < 1e-6);
}

/* Places of contact of wheels are found by iteration: there are no lanes, and stages of radau one by one cost more than
 * steps of dop853. A shaft without inertia, which leaves no order of elimination for its saddle system, has the program
 * by the reduced mass. */
static void without_lanes(void)
{
    static result open, given;
    run("half_shaft", NULL, 1e-8, 1.5, NULL, &open);
    CHECK(!has_lanes() || open.report.chosen_ratio > 0);
    run("conicity", NULL, 1e-8, 1.5, NULL, &open);
    run("conicity", "dop853", 1e-8, 1.5, NULL, &given);
    CHECK_TEXT(open.report.integrator, "dop853");
    CHECK(open.report.steps == given.report.steps && open.report.chosen_ratio == 0);
    CHECK(memcmp(&open.rows, &given.rows, sizeof open.rows) == 0);
    /* A flexible body is stiff: stages one by one cost less than the many steps of dop853. */
    run("flexible_car/flexible_car_shaken", NULL, 1e-8, 0.1, NULL, &open);
    run("flexible_car/flexible_car_shaken", "radau", 1e-8, 0.1, NULL, &given);
    CHECK_TEXT(open.report.integrator, has_lanes() ? "radau" : "dop853");
    CHECK(!has_lanes() || memcmp(&open.rows, &given.rows, sizeof open.rows) == 0);
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

/* -- projected and dae --------------------------------------------------------------------------------- */

static const char WHEELSET[] = "examples/wheelset/wheelset.yaml";
static const char AT_ONCE[] = "the stages of its steps are evaluated at once, in vector registers";
static const char ONE_BY_ONE[] = "radau would evaluate the stages of a step one by one";

/* The names that are resolved, and the reason as far as machines with lanes tell it. */
static void resolves(const char *model, kmp_run_spec given, const char *form, const char *integrator,
                     const char *because, const char *obstacle)
{
    loaded l = load(model);
    kmp_run_spec spec = given;
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
    CHECK_TEXT(spec.form, form);
    CHECK_TEXT(spec.integrator, integrator);
    CHECK(!spec.open_integrator && !spec.reason.integrator == !because);
    if (because) {
        CHECK_TEXT(spec.reason.integrator, integrator);
        CHECK_TEXT(spec.reason.because, because);
    }
    CHECK(obstacle ? spec.reason.obstacle && strcmp(spec.reason.obstacle, obstacle) == 0 : !spec.reason.obstacle);
    unload(&l);
}

static void by_lanes(void)
{
    static const char model[] = "examples/andrews/andrews.yaml";
    static const char missing[] = "this machine has no vector registers of four or eight doubles";
    const char *because = has_lanes() ? AT_ONCE : ONE_BY_ONE, *obstacle = has_lanes() ? NULL : missing;
    resolves(model, (kmp_run_spec){.formulation = "dae"}, has_lanes() ? "index1" : "stabilized1",
             has_lanes() ? "radau" : "ida", because, obstacle);
    resolves(model, (kmp_run_spec){.formulation = "dae", .form = "index1"}, "index1", has_lanes() ? "radau" : "ida",
             because, obstacle);
    resolves(model, (kmp_run_spec){.formulation = "projected"}, "none", has_lanes() ? "radau" : "dop853", because,
             obstacle);
}

/* Names that are given are kept, and a form that radau does not fit is one of IDA. */
static void by_what_is_given(void)
{
    static const char model[] = "examples/andrews/andrews.yaml",
                      linear[] = "a linear solver is given, and radau uses none";
    resolves(model, (kmp_run_spec){.formulation = "dae", .integrator = "ida"}, "stabilized1", "ida", NULL, NULL);
    resolves(model, (kmp_run_spec){.formulation = "dae", .integrator = "radau"}, "index1", "radau", NULL, NULL);
    resolves(model, (kmp_run_spec){.formulation = "dae", .form = "ggl"}, "ggl", "ida", NULL, NULL);
    resolves(model, (kmp_run_spec){.formulation = "dae", .linear = "klu"}, "stabilized1", "ida", linear, NULL);
    resolves(model, (kmp_run_spec){.formulation = "dae", .linear = "auto"}, "stabilized1", "ida", linear, NULL);
    resolves(model, (kmp_run_spec){.formulation = "dae", .form = "index1", .linear = "klu"}, "index1", "ida", linear,
             NULL);
    resolves(WHEELSET, (kmp_run_spec){.formulation = "dae", .integrator = "radau"}, "index1", "radau", NULL, NULL);
}

/* Contacts of wheels with rails are found by iteration, which is an obstacle. Forces that depend on multipliers are
 * not. */
static void by_obstacles(void)
{
    static const char iterated[] = "the model has equations that are solved by iteration";
    static const char slipping[] = "tests/models/guide_friction.yaml";
    if (!has_lanes())
        return;
    resolves(WHEELSET, (kmp_run_spec){.formulation = "dae"}, "stabilized1", "ida", ONE_BY_ONE, iterated);
    resolves(WHEELSET, (kmp_run_spec){.formulation = "projected"}, "none", "dop853", ONE_BY_ONE, iterated);
    resolves(slipping, (kmp_run_spec){.formulation = "dae"}, "index1", "radau", AT_ONCE, NULL);
    resolves(slipping, (kmp_run_spec){.formulation = "projected"}, "none", "radau", AT_ONCE, NULL);
}

/* The default runs where a step of radau fails (a parallelogram that passes its change points). The tolerance is one at
 * which no step ends close to a change point: where one does, rounding decides whether the run goes on
 * (test_change_points.c). */
static void by_ignored_change_points(void)
{
    static const char because[] = "a step of radau cannot extend over a change point that is ignored";
    static const char model[] = "examples/n_four_bar/n_four_bar.yaml";
    static result direct, projected, crossed;
    resolves(model, (kmp_run_spec){.formulation = "dae", .change_points = "ignore"}, "stabilized1", "ida", because,
             NULL);
    resolves(model, (kmp_run_spec){.formulation = "projected", .change_points = "ignore"}, "none", "dop853", because,
             NULL);
    run_on("dae", NULL, "n_four_bar", NULL, 1e-8, 5, "ignore", &direct);
    run_on("projected", NULL, "n_four_bar", NULL, 1e-8, 5, "ignore", &projected);
    run_on("reduced", NULL, "n_four_bar", NULL, 1e-10, 5, "cross", &crossed);
    CHECK(apart(&direct.rows, &crossed.rows) < 1e-5 && apart(&projected.rows, &crossed.rows) < 1e-6);
}

/* The lists of linear solvers are of IDA: another integrator is not run with one in silence. */
static void no_linear_solver_in_silence(void)
{
    static const char said[] = "linear solver 'klu': integrator 'dop853' uses none of these, choose integrator 'ida'";
    loaded l = load("examples/andrews/andrews.yaml");
    kmp_run_spec reduced = {.formulation = "reduced", .linear = "klu"};
    kmp_run_spec radau = {.formulation = "dae", .integrator = "radau", .linear = "dense"};
    kmp_run_spec ida = {.formulation = "reduced", .integrator = "ida", .linear = "dense"};
    CHECK(kmp_run_resolve(l.system, &reduced) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(l.context), said);
    CHECK(kmp_run_resolve(l.system, &radau) == KEMPE_E_ARGUMENT);
    CHECK(kmp_run_resolve(l.system, &ida) == KEMPE_OK);
    unload(&l);
}

/* IDA shares no step and no evaluation with radau. */
static void radau_and_ida_agree(void)
{
    static const char *const models[] = {"andrews", "governor", "four_bar"};
    static const double t_end[] = {0.03, 1, 1};
    for (int k = 0; k < 3; k++) {
        static result radau, ida;
        run_on("dae", NULL, models[k], NULL, 1e-10, t_end[k], NULL, &radau);
        run_on("dae", NULL, models[k], "ida", 1e-10, t_end[k], NULL, &ida);
        CHECK_TEXT(radau.report.integrator, has_lanes() ? "radau" : "ida");
        CHECK_TEXT(ida.report.integrator, "ida");
        CHECK(apart(&radau.rows, &ida.rows) < 1e-6);
        CHECK(!has_lanes() || radau.report.steps < ida.report.steps / 4);
    }
}

/* Steps of a constant length are those of an explicit method, where one fits. */
static void by_constant_steps(void)
{
    static const char *const ways[][2] = {{NULL, NULL}, {"reduced", "newton"}, {"projected", NULL}, {"dae", NULL}};
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        loaded l = load("examples/four_bar/four_bar.yaml");
        kmp_run_spec spec = {.formulation = ways[k][0], .form = ways[k][1], .fixed_step = 1e-3};
        bool fits = !ways[k][0] || strcmp(ways[k][0], "dae") != 0;
        CHECK(kmp_run_resolve(l.system, &spec) == (fits ? KEMPE_OK : KEMPE_E_ARGUMENT));
        CHECK(!fits || strcmp(spec.integrator, "dop853") == 0);
        unload(&l);
    }
}

int main(void)
{
    TEST(at_the_start);
    TEST(on_trial);
    TEST(without_success);
    TEST(lanes_once_they_pay);
    TEST(without_unknowns);
    TEST(with_unknowns_again);
    TEST(where_steps_are_many);
    TEST(with_the_same_rows);
    TEST(without_lanes);
    TEST(that_is_kept);
    TEST(by_lanes);
    TEST(by_what_is_given);
    TEST(by_constant_steps);
    TEST(by_obstacles);
    TEST(by_ignored_change_points);
    TEST(no_linear_solver_in_silence);
    TEST(radau_and_ida_agree);
    return check_report();
}
