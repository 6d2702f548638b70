/* SPDX-License-Identifier: BSD-3-Clause */
/* The runtime of generated simulators, on equations written by hand whose motions have closed forms. */
#include "generate/simulator/kempe_simulator.h"
#include "testing.h"
#include "unit/simulated_mechanisms.h"

#include <stdbool.h>
#include <stdlib.h>

static double memory[4][8192];

static void begin_at(kempe_simulator *s, const kempe_equations *e, int place)
{
    CHECK(kempe_simulator_memory(e) <= 8192);
    kempe_simulator_init(s, e, memory[place]);
    s->settings.rtol = s->settings.atol = 1e-12;
}

#define GOES(call) CHECK_STATUS(s, call, KEMPE_SIMULATOR_GOES)
#define CHECK_STATUS(s, call, expected)                                                                                \
    do {                                                                                                               \
        kempe_simulator_status status = (call);                                                                        \
        CHECK(status == (expected));                                                                                   \
        if (status != (expected))                                                                                      \
            printf("  %s\n", (s)->message);                                                                            \
    } while (0)

/* -- periods ------------------------------------------------------------------------------------------- */

/* The complete elliptic integral K(k) by the arithmetic-geometric mean. */
static double elliptic(double k)
{
    double a = 1, b = sqrt(1 - k * k);
    for (int i = 0; i < 20; i++) {
        double mean = (a + b) / 2;
        b = sqrt(a * b);
        a = mean;
    }
    return acos(-1) / (2 * a);
}

static const kempe_simulator_method both[] = {KEMPE_METHOD_DOP853, KEMPE_METHOD_DOPRI5};

/* Swings from the horizontal: T = 4 sqrt(L/g) K(sin(45 degrees)). */
static void pendulum_has_its_period(void)
{
    for (int i = 0; i < 2; i++) {
        kempe_simulator simulator, *s = &simulator;
        begin_at(s, &pendulum, 0);
        s->settings.method = both[i];
        GOES(kempe_simulator_start(s, 0));
        double period = 4 * sqrt(PENDULUM_LENGTH / GRAVITY) * elliptic(sqrt(0.5));
        GOES(kempe_simulator_advance(s, 10 * period));
        CHECK_NEAR(s->q[0], PENDULUM_LENGTH, 1e-10);
        CHECK_NEAR(s->q[1], 0, 1e-10);
        CHECK(s->work.exchanges >= 30);
        CHECK_NEAR(hypot(s->q[0], s->q[1]), PENDULUM_LENGTH, 1e-15);
        GOES(kempe_simulator_advance(s, 10.25 * period));
        CHECK_NEAR(s->qd[0], -sqrt(2 * GRAVITY * PENDULUM_LENGTH), 1e-10);
        CHECK_NEAR(s->lambda[0] * 2 * -PENDULUM_LENGTH, 3 * PENDULUM_MASS * GRAVITY, 1e-10);
        printf("  %g steps, %g rejected, %g evaluations, %g closings, %g exchanges\n", s->work.steps, s->work.rejected,
               s->work.evaluations, s->work.closings, s->work.exchanges);
    }
}

int main(void)
{
    TEST(pendulum_has_its_period);
    return check_report();
}
