/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 2 */
/* The wheelset of the Test Set for IVP Solvers, as expressions, at t = 10 s: each position and rate within 1e-5 of the
 * published digits, on both formulations. */
#include "loaded.h"
#include <math.h>
#include <string.h>

enum { WANTED = 5 };
static const double q[WANTED] = {0.86355386965811e-2, 0.13038281022727e-4, -0.93635784016818e-4, -0.13642299804033e-1,
                                 0.15292895005422e-2};
static const double qd[WANTED] = {-0.76985374142666e-1, -0.25151106429207e-3, 0.20541188079539e-2, -0.23904837703692,
                                  -0.13633468454173e-1};
static const double lambda[2] = {-101.24044903201, -56.285630573753};

static void compare(const char *formulation, double rtol, double atol)
{
    loaded l = load("examples/wheelset/wheelset.yaml");
    kempe_trajectory *t = NULL;
    kempe_run_options settings = {0};
    settings.formulation = formulation;
    settings.integrator = independent_integrator(formulation);
    settings.rtol = rtol;
    settings.atol = atol;
    settings.output_step = 10;
    settings.no_convergence_check = 1;
    kempe_status status = l.system ? kempe_simulate(l.system, &settings, &t) : KEMPE_E_INPUT;
    CHECK(status == KEMPE_OK);
    if (status == KEMPE_OK) {
        int row = kempe_trajectory_row_count(t) - 1;
        for (int k = 0; k < WANTED; k++) {
            CHECK_NEAR(kempe_trajectory_q(t, row)[k] / q[k], 1, 1e-5);
            CHECK_NEAR(kempe_trajectory_qd(t, row)[k] / qd[k], 1, 1e-5);
        }
        CHECK_NEAR(kempe_trajectory_qd(t, row)[WANTED], 300 - 0.24421377661131, 1e-7);
        for (int r = 0; r < 2; r++)
            CHECK_NEAR(kempe_trajectory_lambda(t, row)[r] / lambda[r], 1, 1e-5);
    } else {
        printf("%s\n", kempe_context_message(l.context));
    }
    kempe_trajectory_free(t);
    unload(&l);
}

static void test_reduced(void)
{
    compare("reduced", 1e-9, 1e-13);
}

static void test_dae(void)
{
    compare("dae", 1e-9, 1e-13);
}

int main(void)
{
    TEST(test_reduced);
    TEST(test_dae);
    return check_report();
}
