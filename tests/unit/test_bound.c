/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 4 */
/* The bound on work: hopeless runs end soon and say why, long ones that get on do not, and none is called singular for
 * its length. */
#include "integrators/decide/endless_growth.h"
#include "integrators/decide/step_control.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "testing.h"
#include <float.h>
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <math.h>

/* Steps of 1e-9 s towards 1 s, then of 1e-4 s. */
static void progress_decides(void)
{
    kmp_work_bound slow = {0}, fast = {0}, none = {.most = -1};
    kmp_text why = {0};
    long at = 0, ended = 0;
    for (at = 1; !ended && at <= 1000000; at++) {
        ended = kmp_work_bound_passed(&slow, at, 1e-9 * (double)at, 1, &why) ? at : 0;
        CHECK(!kmp_work_bound_passed(&fast, at, 1e-4 * (double)at, 1e3, NULL));
        CHECK(!kmp_work_bound_passed(&none, at, 0, 1, NULL));
    }
    CHECK(ended > 0 && ended <= 200001);
    CHECK(why.s && strstr(why.s, "too much work") && strstr(why.s, "max_steps"));
    kmp_text_free(&why);
}

/* A phase that is as slow, but shorter than a window. */
static void short_phases_pass(void)
{
    kmp_work_bound bound = {0};
    double t = 0;
    for (long at = 1; at <= 500000; at++) {
        t += at % 100000 < 90000 ? 1e-9 : 1e-4;
        CHECK(!kmp_work_bound_passed(&bound, at, t, 100, NULL));
    }
}

static void a_number_asked_for_is_kept(void)
{
    kmp_work_bound bound = {.most = 10};
    kmp_text why = {0};
    CHECK(!kmp_work_bound_passed(&bound, 9, 0.5, 1, &why));
    CHECK(!kmp_work_bound_passed(&bound, 10, 1, 1, &why));
    CHECK(kmp_work_bound_passed(&bound, 10, 0.5, 1, &why));
    CHECK(why.s && strstr(why.s, "the limit of 10 steps"));
    kmp_text_free(&why);
}

/* The least step goes by the time, whatever the end. */
static void collapse_goes_by_rounding(void)
{
    int hopeless = 0;
    bool collapsed = false;
    for (int k = 0; k < 1000; k++)
        collapsed = collapsed || kmp_step_collapsed(&hopeless, 1e-11, 10);
    CHECK(!collapsed);
    for (int k = 0; k < 1000; k++)
        collapsed = collapsed || kmp_step_collapsed(&hopeless, 20 * DBL_EPSILON * 10, 10);
    CHECK(collapsed);
    CHECK(kmp_step_least(0) == 0 && kmp_step_least(1) > 1e-15 && kmp_step_least(-1) < 1e-14);
}

static void simulate(const char *path, kempe_setting set, const char *integrator, kempe_run_options run,
                     const char *reason)
{
    loaded l = load_set(path, &set, set.name ? 1 : 0);
    kempe_trajectory *t = NULL;
    run.integrator = integrator;
    run.no_convergence_check = 1;
    kempe_status status = kempe_simulate(l.system, &run, &t);
    CHECK(status == (*reason ? KEMPE_E_FAILED : KEMPE_OK));
    CHECK(t && strstr(kempe_trajectory_reason(t), reason));
    if (t && (*reason == 0) != (*kempe_trajectory_reason(t) == 0))
        printf("%s, rtol %g: %s\n", integrator, run.rtol, kempe_trajectory_reason(t));
    kempe_trajectory_free(t);
    unload(&l);
}

/* Swings of microseconds in a run of 20 s. */
static void short_swings_are_no_singularity(void)
{
    static const char *const integrators[] = {"dop853", "dopri5", "erk", "bdf",  "adams",
                                              "radau5", "radau9", "ida", "radau"};
    for (size_t k = 0; k < sizeof integrators / sizeof *integrators; k++)
        for (double rtol = 1e-6; rtol > 5e-12; rtol *= 1e-5)
            simulate("tests/models/light_carriage.yaml", (kempe_setting){0}, integrators[k],
                     (kempe_run_options){.rtol = rtol, .t_end = 20}, "");
}

static void absurd_forces_end_soon(void)
{
    simulate("tests/models/light_carriage.yaml", (kempe_setting){"l", "1e-18"}, "dop853",
             (kempe_run_options){.t_end = 20}, "too much work");
    simulate("tests/models/light_carriage.yaml", (kempe_setting){"l", "1e-18"}, "bdf", (kempe_run_options){.t_end = 20},
             "too much work");
}

/* A stepper whose caller asks for a time that is out of reach, and then for one that is not. */
static void an_advance_ends_soon(void)
{
    kempe_setting set = {"l", "1e-18"};
    loaded l = load_set("tests/models/light_carriage.yaml", &set, 1);
    kempe_stepper *stepper = NULL;
    CHECK(kempe_stepper_new(l.system, &(kempe_run_options){.integrator = "dop853", .t_end = 1000}, &stepper) ==
          KEMPE_OK);
    CHECK(kempe_stepper_advance(stepper, 20) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_stepper_reason(stepper), "too much work") &&
          strstr(kempe_stepper_reason(stepper), "t = 20 s needs"));
    const kempe_work work = kempe_stepper_work(stepper);
    const long tried = work.steps + work.rejected + work.refused;
    CHECK(tried >= 100000 && tried < 300000 && kempe_stepper_time(stepper) == 0);
    CHECK(kempe_stepper_step(stepper) == KEMPE_OK);
    kempe_stepper_free(stepper);
    unload(&l);
}

static void steps_may_be_bounded(void)
{
    simulate("tests/models/light_carriage.yaml", (kempe_setting){0}, "dop853",
             (kempe_run_options){.t_end = 20, .max_steps = 100}, "the limit of 100 steps");
    simulate("tests/models/light_carriage.yaml", (kempe_setting){0}, "dop853",
             (kempe_run_options){.t_end = 20, .max_steps = 1000000}, "");
}

/* Looks at size(t) in a hundred thousand steps up to t = 20; true if its growth counts as endless. */
static bool grows(double (*size)(double))
{
    kmp_growth growth = {0};
    bool endless = false;
    for (long k = 1; k <= 100000; k++)
        if ((double)k >= growth.next)
            endless = kmp_growth_is_endless(&growth, (double)k, 20e-5 * (double)k, size(20e-5 * (double)k)) || endless;
    return endless;
}

static double overflows(double t)
{
    return t < 15 ? exp(40 * t) : (double)INFINITY;
}

static double exponential(double t)
{
    return exp(t);
}

static double faster(double t)
{
    return exp(0.05 * t * t);
}

static double power(double t)
{
    return pow(t, 8);
}

static double late(double t)
{
    return t < 10 ? 0 : 1e9 * (t - 10);
}

static double jump(double t)
{
    return t < 10 ? 1 : 1e12;
}

static double saturated(double t)
{
    return 3e3 * exp(t - 8) / (3e3 + exp(t - 8));
}

static void growth_without_end(void)
{
    CHECK(grows(exponential) && grows(faster));
    CHECK(!grows(power) && !grows(late) && !grows(jump));
    CHECK(!grows(saturated));
    CHECK(grows(overflows)); /* and looks end */
}

int main(void)
{
    TEST(progress_decides);
    TEST(short_phases_pass);
    TEST(a_number_asked_for_is_kept);
    TEST(collapse_goes_by_rounding);
    TEST(short_swings_are_no_singularity);
    TEST(absurd_forces_end_soon);
    TEST(an_advance_ends_soon);
    TEST(steps_may_be_bounded);
    TEST(growth_without_end);
    return check_report();
}
