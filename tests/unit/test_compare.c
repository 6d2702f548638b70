/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 4 */
/* Comparisons: which runs count at equal error, what is advised and why, how far the own reference may be off, stiff
 * models, motions that amplify all errors, and what there is no time for. */
#include "base/arena.h"
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "loaded.h"
#include "studies/compare/compare_advice.h"
#include "studies/compare/compare_runs.h"
#include "studies/compare/compare_study.h"
#include "testing.h"
#include <kempe/compare.h>
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdbool.h>
#include <stdlib.h>

/* -- made by hand ------------------------------------------------------------------------------------ */

enum { TOLERANCES = 4, WAYS = 3 };

static const double rtols[TOLERANCES] = {1e-3, 1e-5, 1e-7, 1e-9};

typedef struct table {
    loaded l;
    kempe_comparison c;
    kmp_method methods[WAYS];
    kmp_compared runs[WAYS * TOLERANCES];
} table;

/* Errors and times of three ways; an error of 0 is a run that failed. */
static table *make(const double error[WAYS][TOLERANCES], const double cpu_s[WAYS][TOLERANCES])
{
    static table t;
    t = (table){.l = load("tests/models/pendulum.yaml"),
                .methods = {{"reduced", "integrated", "dop853", true, true, NULL},
                            {"reduced", "newton", "bdf", true, true, NULL},
                            {"dae", "stabilized1", "ida", true, true, NULL}}};
    t.c = (kempe_comparison){.system = t.l.system,
                             .source = "none",
                             .reason = "",
                             .has_reference = true,
                             .uncertainty = {1e-11, 1e-11, NAN, NAN},
                             .method_count = WAYS,
                             .rtol_count = TOLERANCES,
                             .methods = t.methods,
                             .count = WAYS * TOLERANCES,
                             .runs = t.runs};
    for (int k = 0; k < WAYS * TOLERANCES; k++) {
        double e = error[k / TOLERANCES][k % TOLERANCES];
        t.runs[k] = (kmp_compared){.method = &t.methods[k / TOLERANCES],
                                   .rtol = rtols[k % TOLERANCES],
                                   .status = e > 0 ? KEMPE_OK : KEMPE_E_FAILED,
                                   .reason = "the reason",
                                   .verdict = kmp_verdict_none(),
                                   .cpu_s = cpu_s[k / TOLERANCES][k % TOLERANCES],
                                   .apart = NAN};
        t.runs[k].verdict.error[KMP_QUANTITY_Q] = e > 0 ? e : NAN;
        t.runs[k].report.steps = 10 + k % TOLERANCES * 30;
        t.runs[k].report.rhs = t.runs[k].report.steps * (k / TOLERANCES + 1);
    }
    kmp_compare_levels(&t.c);
    kmp_compare_tables(&t.c);
    kmp_compare_remark(&t.c);
    kmp_compare_advise(&t.c);
    CHECK(!t.c.arena.failed);
    return &t;
}

static void drop(table *t)
{
    kmp_arena_free(&t->c.arena);
    unload(&t->l);
}

static int level_of(const table *t, double level)
{
    for (int l = 0; l < t->c.levels.count; l++)
        if (fabs(t->c.levels.level[l] - level) < 0.01 * level)
            return l;
    return -1;
}

static int reached(const table *t, int method, double level)
{
    return t->c.levels.run[method * t->c.levels.count + level_of(t, level)];
}

static bool is_said(const kmp_sentences *list, const char *words)
{
    for (int k = 0; k < list->count; k++)
        if (strstr(list->s[k], words))
            return true;
    return false;
}

static const double steady_time[WAYS][TOLERANCES] = {{1, 2, 3, 4}, {2, 4, 6, 8}, {10, 20, 30, 40}};

static void runs_count_when_tighter_ones_agree(void)
{
    /* The second way is lucky at 1e-3, the third fails at its tightest, which is no disagreement. */
    const double error[WAYS][TOLERANCES] = {{2e-4, 2e-6, 2e-8, 1e-12}, {1e-7, 3e-4, 3e-6, 3e-9}, {1e-3, 1e-5, 1e-7, 0}};
    table *t = make(error, steady_time);
    CHECK(reached(t, 0, 1e-3) == 0 && reached(t, 0, 1e-4) == 1 && reached(t, 0, 1e-7) == 2 && reached(t, 0, 1e-8) == 3);
    CHECK(reached(t, 1, 1e-3) == 4 && reached(t, 1, 1e-4) == 6 && reached(t, 1, 1e-8) == 7);
    CHECK(reached(t, 2, 1e-3) == 8 && reached(t, 2, 1e-7) == 10 && reached(t, 2, 1e-8) == -1);
    CHECK(t->c.levels.best[level_of(t, 1e-3)] == 0 && t->c.levels.best[level_of(t, 1e-8)] == 3);
    /* ten times the uncertainty is 1e-10 */
    CHECK(!t->c.levels.blank[level_of(t, 1e-10)] && reached(t, 0, 1e-10) == 3);
    CHECK(t->c.levels.blank[level_of(t, 1e-11)] && reached(t, 0, 1e-11) == -1);
    CHECK(is_said(&t->c.failures, "dae stabilized1 ida at rtol 1e-09 failed: the reason"));
    drop(t);
}

static void the_cheapest_is_advised(void)
{
    const double error[WAYS][TOLERANCES] = {
        {2e-4, 5e-7, 2e-8, 2e-10}, {1e-3, 1e-5, 1e-7, 1e-9}, {1e-3, 1e-5, 1e-7, 1e-9}};
    table *t = make(error, steady_time);
    CHECK(t->c.advice.run == 1);
    CHECK_NEAR(t->c.advice.level, 1e-6, 1e-12);
    CHECK(!t->c.advice.stiff);
    CHECK(is_said(&t->c.advice.because, "Error of q at most 1e-06, in "));
    CHECK(is_said(&t->c.advice.because, "Next: reduced newton bdf, 2.7 and 2.2 times as long"));
    CHECK(is_said(&t->c.advice.because, "for 1e-08 use --rtol 1e-09"));
    CHECK(is_said(&t->c.advice.because, "All 4 runs of it"));
    CHECK(is_said(&t->c.advice.because,
                  "An independent check, without a choice of coordinates: dae stabilized1 ida, 13 and "
                  "11 times as long"));
    drop(t);
}

/* A combination that failed somewhere is advised only where it is more than twice as fast. */
static void failures_count_against_a_way(void)
{
    const double error[WAYS][TOLERANCES] = {{0, 5e-7, 2e-8, 2e-10}, {1e-3, 1e-5, 1e-7, 1e-9}, {1e-3, 1e-5, 1e-7, 1e-9}};
    const double near[WAYS][TOLERANCES] = {{1, 2, 3, 4}, {1, 2, 3, 7}, {10, 20, 30, 40}};
    table *t = make(error, near);
    CHECK(t->c.advice.run == 6); /* 3 to 2 at 1e-6, 7 to 4 at 1e-8 */
    drop(t);
    t = make(error, steady_time);
    CHECK(t->c.advice.run == 1);
    CHECK(is_said(&t->c.advice.because, "1 of its 4 runs failed"));
    drop(t);
}

/* The way that is never far behind is better than one that is the cheapest at one error alone. */
static void both_errors_count(void)
{
    const double error[WAYS][TOLERANCES] = {
        {2e-4, 5e-7, 2e-7, 9e-9}, {1e-4, 9e-7, 1e-7, 1e-9}, {1e-3, 1e-5, 1e-7, 1e-9}};
    const double cpu_s[WAYS][TOLERANCES] = {{1, 2, 3, 40}, {1, 3, 4, 5}, {10, 20, 30, 40}};
    table *t = make(error, cpu_s);
    CHECK(t->c.advice.run == 5);
    drop(t);
}

/* Half-way between errors of 1e-5 and 1e-7 on logarithmic scales, everything is the geometric mean; where the coarser
 * run is dearer the finer one counts. */
static void costs_are_those_of_the_error_itself(void)
{
    const double error[WAYS][TOLERANCES] = {
        {2e-4, 2e-6, 2e-8, 2e-10}, {1e-3, 1e-5, 1e-7, 1e-9}, {1e-3, 1e-5, 1e-7, 1e-9}};
    const double cpu_s[WAYS][TOLERANCES] = {{1, 2, 3, 4}, {2, 4, 6, 8}, {10, 90, 30, 40}};
    table *t = make(error, cpu_s);
    kmp_method_cost cost = kmp_compare_cost(&t->c, 1, level_of(t, 1e-6));
    CHECK_NEAR(cost.cpu_s, sqrt(4.0 * 6), 1e-12);
    CHECK_NEAR(cost.steps, sqrt(40.0 * 70), 1e-12);
    CHECK_NEAR(cost.rhs, 2 * sqrt(40.0 * 70), 1e-12);
    CHECK_NEAR(kmp_compare_cost(&t->c, 2, level_of(t, 1e-6)).cpu_s, 30, 1e-12);
    CHECK(isnan(kmp_compare_cost(&t->c, 0, level_of(t, 1e-11)).cpu_s));
    drop(t);
}

/* BDF and IDA are one family; DOP853 is on one formulation only. The best of each formulation are in order. */
static void tables_are_by_integrator_and_by_formulation(void)
{
    const double error[WAYS][TOLERANCES] = {
        {2e-4, 5e-7, 2e-8, 2e-10}, {1e-3, 1e-5, 1e-7, 1e-9}, {1e-3, 1e-5, 1e-7, 1e-9}};
    const double cpu_s[WAYS][TOLERANCES] = {{10, 20, 30, 40}, {2, 4, 6, 8}, {1, 2, 3, 4}};
    table *t = make(error, cpu_s);
    const kmp_tables *both = &t->c.tables;
    int level = level_of(t, 1e-6);
    CHECK(both->aims.count == 2 && both->same_count == 2 && both->same[0] == 1 && both->same[1] == 2);
    CHECK(kmp_compare_base(&t->c, 2, level) == 1);
    CHECK(both->best_count == 2 && both->best[0] == 2 && both->best[1] == 1 && kmp_compare_best(&t->c, level) == 2);
    CHECK(t->c.advice.run == 2 * TOLERANCES + 2);
    char *text = NULL;
    CHECK(kempe_comparison_print(&t->c, KEMPE_FULL_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\ndae stabilized1 ida          |    2449 x0.50  x1.00 x1.50 x0.33 |"));
    CHECK(text && strstr(text, "\nreduced newton bdf           |    4899 x2.00  x1.00 x0.67 x3.00 |"));
    kmp_free(text);
    drop(t);
}

/* If preparation is longer than the integration, the advice says so, and names the method that is ready first. */
static void preparation_is_reported(void)
{
    const double error[WAYS][TOLERANCES] = {
        {2e-4, 5e-7, 2e-8, 2e-10}, {1e-3, 1e-5, 1e-7, 1e-9}, {1e-3, 1e-5, 1e-7, 1e-9}};
    table *t = make(error, steady_time);
    CHECK(!is_said(&t->c.advice.because, "A first run takes"));
    for (int k = 0; k < 2 * TOLERANCES; k++)
        t->runs[k].build_s = 100;
    t->c.advice = (kmp_advice){0};
    kmp_compare_advise(&t->c);
    CHECK(is_said(&t->c.advice.because, "A first run takes 1.02e+05 ms, of which 1e+05 ms prepare the equations; "
                                        "with dae stabilized1 ida it takes 3e+04 ms"));
    drop(t);
}

static void nothing_is_advised_without_errors(void)
{
    const double error[WAYS][TOLERANCES] = {{1, 1, 1, 1}, {1, 1, 1, 1}, {1, 1, 1, 1}};
    table *t = make(error, steady_time);
    CHECK(t->c.advice.run == -1 && t->c.advice.because.count == 1);
    CHECK(is_said(&t->c.advice.because, "No run attains an error of q of 0.001"));
    drop(t);
}

static void steps_tell_stiffness(void)
{
    CHECK(kmp_steps_are_stiff(7595, 7589, 3, 500));
    CHECK(!kmp_steps_are_stiff(7595, 7589, 3, 5000)); /* nothing gained by implicit steps */
    CHECK(!kmp_steps_are_stiff(1000, 2370, 3, 300));  /* accuracy rules, at order 8 */
    CHECK(!kmp_steps_are_stiff(12, 12, 3, 5));        /* nothing moves */
}

/* -- whole comparisons ------------------------------------------------------------------------------- */

static kempe_comparison *compare(const loaded *l, kempe_compare_options run)
{
    kempe_comparison *c = NULL;
    kempe_status status = kempe_comparison_new(l->system, &run, &c);
    CHECK(c != NULL);
    if (!c)
        printf("%d: %s\n", status, kempe_context_message(l->context));
    return c;
}

/* The true error of the run that is the reference, at the times of digits that Kempe did not make. */
static void true_error(const loaded *l, const kempe_comparison *c, const char *file, double error[KMP_QUANTITIES])
{
    char path[512];
    kmp_reference digits = {0};
    kmp_samples rows;
    kmp_times times = {0};
    kmp_run_report report = {0};
    const kmp_source *s = c->sources;
    (void)snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, file);
    while (s->distance > 0)
        s++;
    CHECK(kmp_reference_read(l->system, path, &digits) == KEMPE_OK);
    kmp_samples_limit(&digits, c->t_end);
    CHECK(kmp_times_init(&times, c->t_end, c->t_end, &digits));
    kmp_samples_init(&rows, l->system->n, l->system->m);
    kmp_run_spec spec = {.formulation = s->method.formulation,
                         .form = s->method.form,
                         .integrator = s->method.integrator,
                         .rtol = s->rtol,
                         .atol = s->rtol,
                         .t_end = c->t_end,
                         .time_count = times.count,
                         .times = times.t};
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    CHECK(kmp_run(l->system, &spec, NULL, kmp_samples_add, &rows, &report) == KEMPE_OK);
    kmp_verdict_errors(&rows, l->system, &digits, INFINITY, error);
    kmp_free(report.reason);
    kmp_samples_free(&rows);
    kmp_times_free(&times);
    kmp_samples_free(&digits);
}

/* The uncertainty that a reference states bounds its error, and is not far above it. */
static void the_own_reference_is_honest(void)
{
    static const struct {
        const char *model, *digits;
        double t_end, most; /* of the uncertainty of q */
    } cases[] = {{"examples/andrews/andrews.yaml", "examples/andrews/reference.csv", 0.03, 2e-12},
                 {"examples/stewart/stewart.yaml", "examples/stewart/reference.csv", 1, 1e-12},
                 {"examples/slider_crank/slider_crank.yaml", "examples/slider_crank/reference.csv", 2, 1e-11},
                 {"examples/parallel_robot/parallel_robot.yaml", "examples/parallel_robot/reference.csv", 0.25, 2e-12},
                 {"examples/driven_slider_crank/driven_slider_crank.yaml", "examples/driven_slider_crank/reference.csv",
                  2, 1e-12}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = load(cases[k].model);
        kempe_comparison *c = compare(&l, (kempe_compare_options){.rtols = "1e-4",
                                                                  .formulations = "reduced",
                                                                  .forms = "integrated",
                                                                  .integrators = "dop853",
                                                                  .t_end = cases[k].t_end});
        double error[KMP_QUANTITIES];
        CHECK(c && c->has_reference && c->source_count >= 3);
        if (c && c->has_reference) {
            true_error(&l, c, cases[k].digits, error);
            for (int i = KMP_QUANTITY_Q; i <= KMP_QUANTITY_QD; i++)
                CHECK(!(error[i] > c->uncertainty[i]));
            CHECK(error[KMP_QUANTITY_Q] >= 0 && c->uncertainty[KMP_QUANTITY_Q] < cases[k].most);
            CHECK(c->until >= c->t_end);
        }
        kempe_comparison_free(c);
        unload(&l);
    }
}

static loaded load_governor(const char *stiffness, const char *damping)
{
    loaded l = {.context = kempe_context_new()};
    kempe_setting settings[2] = {{"K", stiffness}, {"c", damping}};
    CHECK(kempe_model_read_set(l.context, KEMPE_ROOT "/examples/governor/governor.yaml", settings, 2, &l.model) ==
          KEMPE_OK);
    return load_finish(l);
}

static bool has_way(const kempe_comparison *c, const char *integrator)
{
    for (int w = 0; w < c->method_count; w++)
        if (strcmp(c->methods[w].integrator, integrator) == 0)
            return true;
    return false;
}

/* Implicit integrators join where the model is stiff, and one of them is advised. */
static void stiff_models_are_seen(void)
{
    loaded l = load_governor("8e6", "4e5");
    kempe_comparison *c = compare(
        &l, (kempe_compare_options){.rtols = "1e-3,1e-6,1e-8,1e-10", .formulations = "reduced,dae", .t_end = 0.1});
    CHECK(c && has_way(c, "bdf") && has_way(c, "ida") && c->advice.stiff && c->advice.run >= 0);
    if (c && c->advice.run >= 0) {
        CHECK(kmp_is_implicit(c->runs[c->advice.run].method));
        CHECK(is_said(&c->advice.because, "Stiff: dop853 takes"));
    }
    kempe_comparison_free(c);
    unload(&l);
    l = load("examples/andrews/andrews.yaml");
    c = compare(&l, (kempe_compare_options){.rtols = "1e-4,1e-6"});
    CHECK(c && !has_way(c, "bdf") && !c->advice.stiff && is_said(&c->advice.because, "Not stiff"));
    kempe_comparison_free(c);
    unload(&l);
}

/* Decay a hundred times as fast, and explicit runs that there is no time for: implicit ones make the reference. */
static void very_stiff_models_have_a_reference(void)
{
    loaded l = load_governor("8e9", "4e8");
    kempe_comparison *c = compare(&l, (kempe_compare_options){.rtols = "1e-4", .t_end = 0.5, .budget_s = 1});
    CHECK(c && c->has_reference && c->source_count >= 2 && c->uncertainty[KMP_QUANTITY_Q] > 0 &&
          c->uncertainty[KMP_QUANTITY_Q] < 1e-5 && strstr(c->source, "ida"));
    CHECK(c && is_said(&c->failures, "omitted: at rtol 0.0001 it is not finished after"));
    kempe_comparison_free(c);
    unload(&l);
}

static const char pendulums[] = "kempe: 1\n"
                                "name: double pendulum\n"
                                "gravity: [0, -9.81, 0]\n"
                                "bodies:\n"
                                "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [1, 0, 0], inertia: "
                                "{zz: 0.01}, points: {e: [1, 0, 0]}}\n"
                                "  b: {joint: {name: B, revolute: z, at: a.e}, mass: 1, com: [1, 0, 0], inertia: {zz: "
                                "0.01}}\n"
                                "start: {q: {A: 170 deg, B: 10 deg}}\n";

/* A motion that amplifies errors has a reference for as long as it can have one, and none where that is nothing. */
static void errors_that_grow_are_said(void)
{
    loaded l = load_text(pendulums);
    kempe_compare_options run = {
        .rtols = "1e-6,1e-8", .formulations = "reduced", .integrators = "dop853", .forms = "integrated"};
    run.budget_s = 5;
    run.t_end = 40;
    kempe_comparison *c = compare(&l, run);
    CHECK(c && c->has_reference && c->until > 5 && c->until < 40 && c->uncertainty[KMP_QUANTITY_Q] <= 1e-8);
    CHECK(c && c->amplification > 1e3 && is_said(&c->warnings, "errors are evaluated up to that time"));
    kempe_comparison_free(c);
    run.t_end = 400;
    c = compare(&l, run);
    CHECK(c && !c->has_reference && strstr(c->source, "none: the runs at the tightest tolerances differ by"));
    CHECK(c && c->levels.count == 0 && c->advice.run == -1 && is_said(&c->advice.because, "Without a reference"));
    kempe_comparison_free(c);
    unload(&l);
}

static void a_lock_is_said_once(void)
{
    loaded l = load("tests/models/locked_slider_crank.yaml");
    kempe_comparison *c = compare(&l, (kempe_compare_options){.rtols = "1e-4,1e-6", .t_end = 3});
    CHECK(c && c->status == KEMPE_STOPPED && !c->has_reference && c->failures.count == 1);
    CHECK(c &&
          is_said(&c->failures, "every run stopped: the mechanism reaches a limit position (dead centre) at t = 1.5"));
    CHECK(c && strstr(c->source, "dead centre"));
    kempe_comparison_free(c);
    unload(&l);
}

static void time_is_bounded(void)
{
    loaded l = load_text(pendulums);
    kempe_comparison *c = compare(&l, (kempe_compare_options){.rtols = "1e-4,1e-8", .t_end = 2000, .budget_s = 0.05});
    CHECK(c && c->count == c->method_count * 2 && !c->has_reference);
    CHECK(c && is_said(&c->failures, "increase --budget"));
    for (int k = 0; c && k < c->count; k++)
        CHECK(c->runs[k].status == KEMPE_OK || (c->runs[k].left_out && c->runs[k].reason[0]));
    kempe_comparison_free(c);
    c = NULL;
    kempe_compare_options wrong = {.budget_s = -1};
    CHECK(kempe_comparison_new(l.system, &wrong, &c) == KEMPE_E_ARGUMENT && !c);
    CHECK(strstr(kempe_context_message(l.context), "budget_s = -1"));
    unload(&l);
}

/* The order in which tolerances are asked for is that of the runs, not that in which they are run. */
static void runs_stand_as_asked(void)
{
    loaded l = load("examples/slider_crank/slider_crank.yaml");
    kempe_comparison *c =
        compare(&l, (kempe_compare_options){
                        .rtols = "1e-8,1e-4,1e-6", .formulations = "reduced", .integrators = "dop853", .t_end = 0.2});
    CHECK(c && c->rtol_count == 3 && c->method_count == 2);
    for (int k = 0; c && k < c->count; k++) {
        const kmp_compared *run = &c->runs[k];
        CHECK(run->method == &c->methods[k / 3] && run->status == KEMPE_OK);
        CHECK(k % 3 == 0 ? isnan(run->apart) : run->apart >= 0); /* 1e-8 is the tightest */
    }
    CHECK(c && c->runs[1].apart > c->runs[2].apart);
    kempe_comparison_free(c);
    unload(&l);
}

int main(void)
{
    TEST(runs_count_when_tighter_ones_agree);
    TEST(the_cheapest_is_advised);
    TEST(failures_count_against_a_way);
    TEST(both_errors_count);
    TEST(costs_are_those_of_the_error_itself);
    TEST(tables_are_by_integrator_and_by_formulation);
    TEST(preparation_is_reported);
    TEST(nothing_is_advised_without_errors);
    TEST(steps_tell_stiffness);
    TEST(the_own_reference_is_honest);
    TEST(stiff_models_are_seen);
    TEST(very_stiff_models_have_a_reference);
    TEST(errors_that_grow_are_said);
    TEST(a_lock_is_said_once);
    TEST(time_is_bounded);
    TEST(runs_stand_as_asked);
    return check_report();
}
