/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows between steps, of every formulation, form and integrator: a mass on a spring, whose q, qd and energy are known
 * at any time, at many more rows than there are steps. */
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "testing.h"
#include <math.h>

static const char text[] = "kempe: 1\n"
                           "parameters: {w: 40}\n"
                           "bodies: {mass: {joint: {name: S, prismatic: x, at: ground}, mass: 2}}\n"
                           "forces: {k: {joint: S, spring: {stiffness: 2*w^2}}}\n"
                           "start: {q: {S: 0.5}}\n";
static const double w = 40, amplitude = 0.5;

enum { ROWS = 2001 };

typedef struct judge {
    double error, drift;
    int rows;
} judge;

static int take(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                double work)
{
    judge *j = user;
    double rate = qd[0] / w, energy = (q[0] * q[0] + rate * rate) / (amplitude * amplitude);
    (void)qdd, (void)lambda, (void)work;
    j->error = fmax(j->error, fabs(q[0] - amplitude * cos(w * t)) / amplitude);
    j->error = fmax(j->error, fabs(rate + amplitude * sin(w * t)) / amplitude);
    j->drift = fmax(j->drift, fabs(energy - 1));
    j->rows++;
    return 0;
}

static void run(const kempe_system *system, const kmp_method *method)
{
    static double times[ROWS];
    judge j = {0};
    kmp_run_report report = {0};
    kmp_run_spec spec = {.formulation = method->formulation,
                         .form = method->form,
                         .integrator = method->integrator,
                         .rtol = 1e-8,
                         .t_end = 0.5,
                         .times = times,
                         .time_count = ROWS};
    for (int k = 0; k < ROWS; k++)
        times[k] = 0.5 * k / (ROWS - 1);
    CHECK(kmp_run_resolve(system, &spec) == KEMPE_OK);
    CHECK(kmp_run(system, &spec, NULL, take, &j, &report) == KEMPE_OK);
    printf("  %-9s %-8s %-8s error %.1e energy %.1e steps %ld\n", method->formulation, method->form, method->integrator,
           j.error, j.drift, report.steps);
    CHECK(j.rows == ROWS && report.steps < ROWS / 2);
    CHECK(j.error < 1e-5 && j.drift < 1e-5);
    kmp_free(report.reason);
}

static void rows_between_steps_are_right(void)
{
    loaded l = load_text(text);
    kmp_method each;
    for (int k = 0; l.system && kmp_method_get(k, &each); k++)
        if (strcmp(each.form, "index3") != 0)
            run(l.system, &each);
    unload(&l);
}

int main(void)
{
    TEST(rows_between_steps_are_right);
    return check_report();
}
