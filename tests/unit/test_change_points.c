/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 2 */
/* Positions where branches of a mechanism meet and J loses a row: the IFToMM windows A02, whose exact motion is a
 * pendulum's, and an antiparallelogram. In every run of a sweep over 61 tolerances the right branch, on every
 * formulation. */
#include "base/memory.h"
#include "bench/chain.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "testing.h"

typedef struct last_row {
    int n;
    double q[32];
} last_row;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    last_row *r = user;
    (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    memcpy(r->q, q, (size_t)r->n * sizeof *q);
    return 0;
}

/* N square windows: vertical links on the ground, horizontal ones on top, started upright at -1 rad/s. */
static loaded windows(int n)
{
    char *text = chain_text(n, false, 0);
    loaded s = load_text(text);
    kmp_free(text);
    return s;
}

static kempe_status run(const loaded *s, const char *formulation, const char *form, double rtol, last_row *row)
{
    const double end = 10;
    kmp_run_report report;
    kmp_run_spec spec = {.formulation = formulation,
                         .form = form,
                         .integrator = independent_integrator(formulation),
                         .rtol = rtol,
                         .t_end = end,
                         .time_count = 1,
                         .times = &end};
    row->n = s->system->n;
    CHECK(kmp_run_resolve(s->system, &spec) == KEMPE_OK);
    kempe_status status = kmp_run(s->system, &spec, NULL, take_row, row, &report);
    if (status != KEMPE_OK)
        printf("  %s %s rtol %.2g: %s\n", formulation, form, rtol, report.reason ? report.reason : "");
    kmp_free(report.reason);
    return status;
}

static const char *const ways[3][2] = {{"reduced", "integrated"}, {"reduced", "newton"}, {"projected", "none"}};

/* x and y of the first link's tip at 10 s, by the exact reduction. */
static void sweep_windows(int n, double x, double y, int tolerances)
{
    loaded s = windows(n);
    for (int way = 0; way < 3; way++) {
        double worst = 0;
        for (int k = 0; k < tolerances; k++) {
            last_row row = {0};
            CHECK(run(&s, ways[way][0], ways[way][1], pow(10, -6 - 0.1 * k), &row) == KEMPE_OK);
            worst = check_max(worst, hypot(cos(row.q[0]) - x, sin(row.q[0]) - y));
            for (int i = 1; i <= n; i++)
                CHECK_NEAR(row.q[i], row.q[0], 1e-3); /* the other branch is radians away */
        }
        printf("  N = %d %s/%s: %d tolerances, worst error %.1e\n", n, ways[way][0], ways[way][1], tolerances, worst);
        CHECK(worst < 2e-3); /* at rtol 1e-6 */
    }
    unload(&s);
}

static void windows_keep_their_branch(void)
{
    sweep_windows(1, 0.478385057760970559, 0.878150178791209301, 61);
    sweep_windows(2, 0.328458111540815379, 0.944518538178600962, 61);
    sweep_windows(10, cos(-30.050933492), sin(-30.050933492), 5);
}

static void windows_reach_their_digits(void)
{
    loaded s = windows(2);
    for (int way = 0; way < 3; way++) {
        last_row row = {0};
        CHECK(run(&s, ways[way][0], ways[way][1], 1e-11, &row) == KEMPE_OK);
        CHECK_NEAR(cos(row.q[0]), 0.328458111540815379, 1e-6); /* seven passages, 1e-7 each */
        CHECK_NEAR(sin(row.q[0]), 0.944518538178600962, 1e-6);
    }
    unload(&s);
}

/* After 10 s theta has changed by -20.4780898115, phi and the coupler's relative angle by 22.7229215014 (independent
 * one-degree-of- freedom form). */
static void the_antiparallelogram_keeps_its_branch(void)
{
    loaded s = load("tests/models/antiparallelogram.yaml");
    for (int way = 0; way < 3; way++)
        for (int k = 0; k <= 60; k++) {
            double rtol = pow(10, -6 - 0.1 * k), allowed = fmax(1e3 * rtol, 1e-6);
            last_row row = {0};
            CHECK(run(&s, ways[way][0], ways[way][1], rtol, &row) == KEMPE_OK);
            CHECK_NEAR(row.q[0], 1.2 - 20.4780898115, allowed);
            CHECK_NEAR(row.q[1], -2.44089476166473 + 22.7229215014, allowed);
            CHECK_NEAR(row.q[2], -2.44089476166473 + 22.7229215014, allowed);
        }
    unload(&s);
}

/* Begun with all bars in line the closures have lost a row, and which branch is meant nobody can know: the run stops
 * and says so on every formulation and form, whether it moves at once or is drawn out of it. */
static void a_start_on_a_change_point_is_refused(void)
{
    static const char *const all[][2] = {{"reduced", "integrated"}, {"reduced", "newton"}, {"projected", "none"},
                                         {"dae", "stabilized1"},    {"dae", "ggl"},        {"dae", "index2"},
                                         {"dae", "index1"},         {"dae", "index3"}};
    static const char *const ends[] = {"gravity: [0, -9.81, 0]\n", "start: {qd: {A: 1}}\n",
                                       "start: {qd: {A: 1, B: -1, D: 1}}\n"};
    for (size_t e = 0; e < sizeof ends / sizeof *ends; e++)
        for (size_t way = 0; way < sizeof all / sizeof *all; way++) {
            char text[1024] = "";
            double end = 1;
            kmp_run_report report;
            kmp_run_spec spec = {.formulation = all[way][0],
                                 .form = all[way][1],
                                 .integrator = independent_integrator(all[way][0]),
                                 .rtol = 1e-8,
                                 .t_end = end,
                                 .time_count = 1,
                                 .times = &end};
            last_row row = {0};
            FILE *file = fopen(KEMPE_ROOT "/tests/models/parallelogram_flat.yaml", "r");
            CHECK(file && fread(text, 1, sizeof text - 80, file) > 0);
            if (file)
                fclose(file);
            strcat(text, ends[e]);
            loaded s = load_text(text);
            row.n = s.system->n;
            CHECK(kmp_run_resolve(s.system, &spec) == KEMPE_OK);
            CHECK(kmp_run(s.system, &spec, NULL, take_row, &row, &report) == KEMPE_E_FAILED);
            CHECK(report.reason && strstr(report.reason, "'C.1'") && strstr(report.reason, "at a change point"));
            kmp_free(report.reason);
            unload(&s);
        }
}

/* A step that ends close to a change point may leave the branch where these are ignored, and rounding decides. A motion
 * that is reported as complete is the right one, at every tolerance. Of most tolerances it is, and there nothing
 * but right-hand sides and one factorisation a step was done. The numbers of windows are odd and even: det Jv does and
 * does not change its sign. */
static void change_points_are_ignored(void)
{
    for (int n = 1; n <= 12; n += n < 3 ? 1 : 9) {
        loaded s = windows(n);
        last_row exact = {0};
        int right = 0, told = 0;
        CHECK(run(&s, "reduced", "integrated", 1e-11, &exact) == KEMPE_OK);
        for (int k = 0; k < 31; k++) {
            kempe_run_options options = {
                .t_end = 10, .rtol = pow(10, -7 - 0.1 * k), .integrator = "dop853", .change_points = "ignore"};
            kempe_trajectory *t = NULL;
            kempe_status status = kempe_simulate(s.system, &options, &t);
            CHECK(t);
            if (status == KEMPE_OK && kempe_trajectory_outcome(t) == KEMPE_OUTCOME_COMPLETE) {
                const double *q = kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1);
                for (int i = 0; i <= n; i++)
                    CHECK_NEAR(q[i], exact.q[i], 1e-3); /* the other branch is radians away */
                right++;
            } else {
                told++;
            }
            kempe_trajectory_free(t);
        }
        printf("  N = %d: %d motions are complete, of %d it is said that they are not trustworthy\n", n, right, told);
        CHECK(right >= 2 * told);
        unload(&s);
    }
}

static void ignored_change_points_cost_nothing(void)
{
    for (int n = 2; n <= 12; n += 10) {
        const double end = 10;
        loaded s = windows(n);
        kmp_run_report report;
        kmp_run_log log = {.context = s.context};
        last_row row = {.n = s.system->n};
        kmp_run_spec spec = {
            .rtol = 1e-8, .t_end = end, .time_count = 1, .times = &end, .change_points = "ignore", .log = &log};
        CHECK(kmp_run_resolve(s.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(s.system, &spec, NULL, take_row, &row, &report) == KEMPE_OK);
        printf("  N = %d: %ld steps, %ld factorisations\n", n, report.steps, report.factorizations);
        CHECK(log.count == 0 && report.refused == 0);
        CHECK(report.factorizations < report.steps + report.rejected + 10);
        kmp_free(report.reason);
        kmp_run_log_free(&log);
        unload(&s);
    }
}

/* |Bvu| tells a dead centre of u from a change point: at no tolerance may a fixed u pass one. */
static void a_dead_centre_is_not_ignored(void)
{
    loaded s = load("tests/models/triple_rocker.yaml");
    const double end = 10;
    for (int u = 0; u < s.system->n; u++)
        for (int k = 0; k <= 16; k++) {
            kmp_run_report report;
            last_row row = {.n = s.system->n};
            kmp_run_spec spec = {.rtol = pow(10, -4 - 0.5 * k),
                                 .t_end = end,
                                 .time_count = 1,
                                 .times = &end,
                                 .u = &u,
                                 .u_count = 1,
                                 .keep_independent = true,
                                 .change_points = "ignore"};
            CHECK(kmp_run_resolve(s.system, &spec) == KEMPE_OK);
            CHECK(kmp_run(s.system, &spec, NULL, take_row, &row, &report) == KEMPE_E_FAILED);
            CHECK(report.reason && strstr(report.reason, "dead centre"));
            kmp_free(report.reason);
        }
    unload(&s);
}

int main(void)
{
    TEST(change_points_are_ignored);
    TEST(ignored_change_points_cost_nothing);
    TEST(a_dead_centre_is_not_ignored);
    TEST(a_start_on_a_change_point_is_refused);
    TEST(windows_keep_their_branch);
    TEST(windows_reach_their_digits);
    TEST(the_antiparallelogram_keeps_its_branch);
    return check_report();
}
