/* SPDX-License-Identifier: BSD-3-Clause */
/* The rank of the closures is one number, whoever asks: `check`, a run in each formulation, a state near equilibrium,
 * the public workspace, also a little beside the closed state, where redundant rows look weakly independent. */
#include "analyses/derivatives/linearized.h"
#include "base/memory.h"
#include "constraints/closing/saddle.h"
#include "constraints/diagnosis/diagnosis.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/workspace.h>
#include <math.h>

static const char *const models[] = {"examples/andrews/andrews.yaml",
                                     "examples/bennett/bennett.yaml",
                                     "examples/bricard/bricard.yaml",
                                     "examples/double_four_bar/double_four_bar.yaml",
                                     "examples/jansen_leg/jansen_leg.yaml",
                                     "examples/n_four_bar/n_four_bar_40.yaml",
                                     "examples/n_four_bar_spatial/n_four_bar_spatial.yaml",
                                     "examples/parallel_robot/parallel_robot.yaml",
                                     "examples/peaucellier/peaucellier.yaml",
                                     "examples/stewart/stewart.yaml",
                                     "tests/models/bennett_hinge.yaml",
                                     "tests/models/bricard_hinge.yaml",
                                     "tests/models/levers.yaml",
                                     "tests/models/near_parallelogram.yaml",
                                     "tests/models/parallelogram.yaml",
                                     "tests/models/piston4.yaml",
                                     "tests/models/spatial_slider_crank_hung.yaml",

                                     "tests/models/triple_rocker.yaml",
                                     "tests/models/two_armed_lamp.yaml"};
enum { MODELS = sizeof models / sizeof *models };

/* The assembled position, moved by up to `aside`, scaled. */
static double *state_of(const loaded *l, double aside)
{
    kempe_assembly *a = NULL;
    double *q = KMP_NEW(double, l->system->n);
    CHECK(kempe_assembly_new(l->system, &a) == KEMPE_OK && !a->inner_q);
    for (int k = 0; k < l->system->n; k++)
        q[k] = a->q[k] + aside * sin(3 * k + 1) * l->system->scale[k];
    kempe_assembly_free(a);
    return q;
}

static int rank_of_check(const loaded *l)
{
    kempe_check *check = NULL;
    CHECK(kempe_check_new(l->system, &check) == KEMPE_OK);
    int rank = check->part.r;
    kempe_check_free(check);
    return rank;
}

static int rank_of_run(const loaded *l, const char *formulation)
{
    kmp_run_spec spec = {
        .formulation = formulation, .integrator = independent_integrator(formulation), .rtol = 1e-6, .t_end = 1e-3};
    kmp_runner *runner = NULL;
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    CHECK(kmp_runner_new(l->system, &spec, NULL, &runner) == KEMPE_OK);
    int rank = runner ? runner->part.r : -1;
    kmp_runner_free(runner);
    return rank;
}

static int rank_near_state(const loaded *l)
{
    kmp_linear linear;
    double *q = state_of(l, 0);
    CHECK(kmp_linear_init(&linear, l->system, "tape") == KEMPE_OK);
    CHECK(kmp_linear_choose(&linear, 0, q, NULL, 0) == KEMPE_OK);
    int rank = linear.part.r;
    kmp_linear_free(&linear);
    kmp_free(q);
    return rank;
}

/* Rank of the rows that the workspace's saddle system takes. */
static int rank_anywhere(const loaded *l, int known, double aside)
{
    kmp_saddle saddle;
    kmp_evaluator *eval = kmp_eval_new(l->system, "tape");
    double *q = state_of(l, aside);
    int rank = 0;
    CHECK(kmp_saddle_init_anywhere(&saddle, eval, known));
    kmp_eval_closure(eval, 0, q);
    kmp_eval_mass(eval);
    CHECK(kmp_saddle_factor(&saddle) == 0);
    for (int r = 0; r < l->system->m; r++)
        rank += kmp_saddle_has_row(&saddle, r);
    kmp_saddle_free(&saddle);
    kmp_eval_free(eval);
    kmp_free(q);
    return rank;
}

static void everyone_says_the_same_rank(void)
{
    for (int k = 0; k < MODELS; k++) {
        loaded l = load(models[k]);
        int rank = rank_of_check(&l), before = check_failures;
        CHECK(rank_of_run(&l, "reduced") == rank);
        CHECK(rank_of_run(&l, "projected") == rank);
        CHECK(rank_of_run(&l, "dae") == rank);
        CHECK(rank_near_state(&l) == rank);
        CHECK(rank_anywhere(&l, -1, 0) == rank);
        for (double aside = 1e-12; aside < 1e-4; aside *= 10)
            CHECK(rank_anywhere(&l, rank, aside) == rank);
        if (check_failures != before)
            printf("%s: rank %d\n", models[k], rank);
        unload(&l);
    }
}

/* Accelerations a little beside a closed state are those of the closed state, but for as little. */
static void accelerations_go_on_beside_closed_states(void)
{
    for (int k = 0; k < MODELS; k++) {
        loaded l = load(models[k]);
        kempe_workspace *ws = NULL;
        int n = l.system->n;
        double *q = state_of(&l, 0), *qd = KMP_NEW(double, n), *there = KMP_NEW(double, n),
               *beside = KMP_NEW(double, n);
        double size = 1, off = 0; /* rad/s^2 */
        CHECK(kempe_workspace_new(l.system, &ws) == KEMPE_OK);
        CHECK(kempe_workspace_forward_dynamics(ws, 0, q, qd, NULL, there, NULL) == KEMPE_OK);
        for (double aside = 1e-11; aside < 1e-7; aside *= 10) {
            double *moved = state_of(&l, aside);
            CHECK(kempe_workspace_forward_dynamics(ws, 0, moved, qd, NULL, beside, NULL) == KEMPE_OK);
            for (int i = 0; i < n; i++) {
                size = fmax(size, fabs(there[i]) / l.system->scale[i]);
                off = fmax(off, fabs(beside[i] - there[i]) / l.system->scale[i]);
            }
            CHECK(off <= 1e5 * aside * size);
            kmp_free(moved);
        }
        if (!(off <= 1e-3 * size))
            printf("%s: off by %.3g of %.3g\n", models[k], off, size);
        kempe_workspace_free(ws);
        kmp_free(q);
        kmp_free(qd);
        kmp_free(there);
        kmp_free(beside);
        unload(&l);
    }
}

int main(void)
{
    TEST(everyone_says_the_same_rank);
    TEST(accelerations_go_on_beside_closed_states);
    return check_report();
}
