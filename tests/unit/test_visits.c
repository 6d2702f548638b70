/* SPDX-License-Identifier: BSD-3-Clause */
/* Formulations that a run has left and returns to, where friction sticks and slips in turn and contacts open and close:
 * none is made twice while it rests, at most KMP_MOST_VISITS rest, the motion is that of formulations made anew, and
 * all work is counted once. */
#include "base/text.h"
#include "integrators/formulations/formulation.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "loaded.h"
#include <math.h>

enum { MOST = 32, MOST_STEPS = 20000 };

typedef struct motion {
    int changes;       /* of the formulation */
    int returns;       /* to one that rested */
    int late;          /* changes after the second one that were none */
    int most;          /* formulations that rested */
    long most_counted; /* attempted steps that a step has added */
    double row[MOST];
} motion;

static bool is_at_rest(const kmp_runner *runner, const kmp_formulation *formulation)
{
    for (int k = 0; k < runner->resting.count; k++)
        if (runner->resting.visit[k].formulation == formulation)
            return true;
    return false;
}

/* Follows a run to its end. `anew`: no formulation rests. */
static motion follow(const loaded *l, const char *formulation, const char *integrator, double rtol, double t_end,
                     bool anew)
{
    motion m = {0};
    double work;
    kmp_runner *runner = NULL;
    kmp_run_log log = {.context = l->context};
    kmp_run_spec spec = {
        .formulation = formulation, .integrator = integrator, .rtol = rtol, .t_end = t_end, .log = &log};
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK && 3 * l->system->n + l->system->m < MOST);
    CHECK(kmp_runner_new(l->system, &spec, NULL, &runner) == KEMPE_OK);
    for (int k = 0; runner && kmp_runner_t(runner) < t_end && k < MOST_STEPS; k++) {
        kmp_formulation *resting[KMP_MOST_VISITS], *before = runner->formulation;
        const int visits = runner->resting.count;
        const long tried = kmp_runner_tried(runner);
        for (int i = 0; i < visits; i++)
            resting[i] = runner->resting.visit[i].formulation;
        runner->formulation->rests = runner->formulation->rests && !anew;
        if (kmp_runner_step(runner) != KEMPE_OK) {
            CHECK_TEXT(runner->reason ? runner->reason : kempe_context_message(l->context), "");
            break;
        }
        const long counted = kmp_runner_tried(runner) - tried;
        CHECK(counted > 0);
        m.most_counted = counted > m.most_counted ? counted : m.most_counted;
        m.most = runner->resting.count > m.most ? runner->resting.count : m.most;
        CHECK(!is_at_rest(runner, runner->formulation));
        if (runner->formulation == before)
            continue;
        bool returned = false;
        for (int i = 0; i < visits; i++)
            returned = returned || resting[i] == runner->formulation;
        m.changes++;
        m.returns += returned;
        m.late += m.changes > 2 && !returned;
    }
    CHECK(kmp_runner_row(runner, t_end, m.row, &work) == KEMPE_OK);
    kmp_runner_free(runner);
    kmp_run_log_free(&log);
    return m;
}

static double apart(const motion *a, const motion *b, int n)
{
    double worst = 0;
    for (int i = 0; i < 2 * n; i++)
        worst = check_max(worst, fabs(a->row[i] - b->row[i]) / fmax(1, fabs(b->row[i])));
    return worst;
}

/* A block on a belt sticks and slips: two formulations, each made once. */
static void each_is_made_once(void)
{
    static const char *const ways[][2] = {
        {"reduced", NULL}, {"reduced", "dop853"}, {"reduced", "radau"}, {"projected", NULL}, {"projected", "dop853"}};
    loaded l = load("tests/models/friction_belt.yaml");
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        motion kept = follow(&l, ways[k][0], ways[k][1], 1e-10, 50, false);
        motion anew = follow(&l, ways[k][0], ways[k][1], 1e-10, 50, true);
        CHECK(kept.changes > 10 && kept.returns == kept.changes - 1 && kept.late == 0 && kept.most == 1);
        CHECK(anew.returns == 0 && anew.most == 0);
        CHECK(apart(&kept, &anew, l.system->n) < 1e-8 && kept.most_counted < 50);
    }
    unload(&l);
}

/* Four blocks that are pushed to and fro with friction have 16 sets of those that stick, of which each returns. */
static void few_rest(void)
{
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n");
    for (int k = 0; k < 4; k++)
        kmp_text_printf(
            &text, "  b%d: {joint: {name: x%d, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n", k, k);
    kmp_text_put(&text, "forces:\n");
    for (int k = 0; k < 4; k++)
        kmp_text_printf(&text,
                        "  push%d: {at: b%d.P, force: [\"%g*sin(%g*t)\", 0, 0]}\n"
                        "  rub%d: {joint: x%d, friction: {force: 1, static: 1.1}}\n",
                        k, k, 1.2 + 0.05 * k, 2 + 0.7 * k, k, k);
    loaded l = load_text(text.s);
    kmp_text_free(&text);
    const motion kept = follow(&l, "reduced", "dop853", 1e-9, 30, false);
    const motion anew = follow(&l, "reduced", "dop853", 1e-9, 30, true);
    CHECK(kept.returns > 40 && kept.late > KMP_MOST_VISITS && kept.most == KMP_MOST_VISITS);
    CHECK(anew.most == 0 && apart(&kept, &anew, l.system->n) < 1e-8 && kept.most_counted < 50);
    unload(&l);
}

int main(void)
{
    TEST(each_is_made_once);
    TEST(few_rest);
    return check_report();
}
