/* SPDX-License-Identifier: BSD-3-Clause */
/* Progress of long computations: counts rise to their totals, results do not depend on them, and the function may end
 * the computation. */
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/compare.h>
#include <kempe/kempe.h>
#include <kempe/kinematics.h>
#include <string.h>

typedef struct seen {
    const char *unit; /* the unit that is counted */
    int calls, restarts;
    double last, total;
    kempe_context *end; /* the context to interrupt; NULL: none */
} seen;

static void count(void *user, const kempe_progress *p)
{
    seen *all = user;
    CHECK(p->done >= 0 && p->done <= p->total * (1 + 1e-12) && p->elapsed_s >= 0 && p->left_s >= -1);
    if (strcmp(p->unit, all->unit) != 0)
        return;
    all->restarts += p->done < all->last;
    all->calls++;
    all->last = p->done;
    all->total = p->total;
    if (all->end)
        kempe_context_interrupt(all->end);
}

static double last_angle(const loaded *s, const kempe_run_options *run, kempe_status expected)
{
    kempe_trajectory *t = NULL;
    CHECK(kempe_simulate(s->system, run, &t) == expected);
    double q = kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1)[0];
    kempe_trajectory_free(t);
    return q;
}

static void of_a_run(void)
{
    loaded s = load("examples/four_bar/four_bar.yaml");
    seen all = {.unit = "s"};
    const kempe_run_options once = {.t_end = 0.5, .no_convergence_check = 1}, twice = {.t_end = 0.5};
    double expected = last_angle(&s, &once, KEMPE_OK);
    kempe_context_set_progress(s.context, 0, count, &all);
    CHECK(last_angle(&s, &once, KEMPE_OK) == expected);
    CHECK(all.calls > 5 && all.restarts == 0 && all.last == 0.5 && all.total == 0.5);
    last_angle(&s, &twice, KEMPE_OK); /* a run of its own, and one at another tolerance */
    CHECK(all.restarts == 2);
    kempe_context_set_progress(s.context, 3600, count, &all);
    all.calls = 0;
    last_angle(&s, &once, KEMPE_OK);
    kempe_context_set_progress(s.context, 0, NULL, NULL);
    last_angle(&s, &once, KEMPE_OK);
    CHECK(all.calls == 0);
    unload(&s);
}

static void of_studies(void)
{
    loaded s = load("examples/four_bar/four_bar.yaml");
    seen rows = {.unit = "rows"}, runs = {.unit = "runs"}, starts = {.unit = "starts"};
    kempe_kinematics *k = NULL;
    kempe_comparison *c = NULL;
    kempe_branches *b = NULL;
    kempe_context_set_progress(s.context, 0, count, &rows);
    CHECK(kempe_kinematics_new(s.system, &(kempe_kinematics_options){.sweep = "crank=0:1", .points = 20}, &k) ==
          KEMPE_OK);
    CHECK(rows.calls == 20 && rows.last == 20 && rows.total == 20);
    kempe_context_set_progress(s.context, 0, count, &runs);
    CHECK(kempe_comparison_new(s.system,
                               &(kempe_compare_options){.t_end = 0.05, .formulations = "reduced", .rtols = "1e-6,1e-8"},
                               &c) == KEMPE_OK);
    CHECK(runs.calls > 1 && runs.last == runs.total && runs.restarts == 0);
    kempe_context_set_progress(s.context, 0, count, &starts);
    CHECK(kempe_branches_new(s.system, 1, &b) == KEMPE_OK);
    CHECK(starts.calls > 1 && starts.restarts == 0);
    kempe_kinematics_free(k);
    kempe_comparison_free(c);
    kempe_branches_free(b);
    unload(&s);
}

static void ends_the_computation(void)
{
    loaded s = load("examples/four_bar/four_bar.yaml");
    seen all = {.unit = "s", .end = s.context};
    kempe_context_set_progress(s.context, 0, count, &all);
    last_angle(&s, &(kempe_run_options){.t_end = 0.5}, KEMPE_STOPPED);
    CHECK(all.calls == 1);
    unload(&s);
}

int main(void)
{
    TEST(of_a_run);
    TEST(of_studies);
    TEST(ends_the_computation);
    return check_report();
}
