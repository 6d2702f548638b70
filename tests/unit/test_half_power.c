/* SPDX-License-Identifier: BSD-3-Clause */
/* A force of Hertz's kind, max(q, 0)^1.5: its derivative is finite where the power begins, so that implicit integrators
 * run there. */
#include "loaded.h"
#include "studies/simulate/trajectory.h"
#include <kempe/kempe.h>
#include <math.h>

#define RTOL 1e-8

/* q and its rate at the end. */
static void run(const loaded *l, const char *integrator, double end[2])
{
    kempe_run_options settings = {0};
    kempe_trajectory *t = NULL;
    settings.integrator = integrator;
    settings.rtol = settings.atol = RTOL;
    settings.t_end = 1;
    settings.output_step = 0.1;
    settings.no_convergence_check = true;
    CHECK(kempe_simulate(l->system, &settings, &t) == KEMPE_OK);
    const int last = t ? t->table.rows - 1 : -1;
    end[0] = last >= 0 ? kempe_trajectory_q(t, last)[0] : NAN;
    end[1] = last >= 0 ? kempe_trajectory_qd(t, last)[0] : NAN;
    kempe_trajectory_free(t);
}

/* A body comes from -0.1 m: the power begins at 0.1 s, and brakes it. */
static void agree(const char *force)
{
    char text[512];
    double implicit[2], explicit[2];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n"
                   "forces: {F: {joint: a, force: \"%s\"}}\nstart: {q: {a: -0.1}, qd: {a: 1}}\n",
                   force);
    loaded l = load_text(text);
    run(&l, "radau5", implicit);
    run(&l, "dop853", explicit);
    for (int k = 0; k < 2; k++)
        CHECK_NEAR(implicit[k], explicit[k], 100 * RTOL);
    CHECK(explicit[0] > 0 && explicit[1] < 0.95);
    unload(&l);
}

static void implicit_integrators_meet_the_start_of_a_power(void)
{
    agree("-5*pow(max(q(a), 0), 1.5)");
    agree("-5*max(q(a), 0)^1.5");
    agree("-5*max(q(a), 0)*max(q(a), 0)^2.5");
}

int main(void)
{
    TEST(implicit_integrators_meet_the_start_of_a_power);
    return check_report();
}
