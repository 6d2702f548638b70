/* SPDX-License-Identifier: BSD-3-Clause */
/* Balance of what is not held: a roller on an elastic floor, dropped from above it, against its closed form. */
#include "analyses/equilibrium/equilibrium_study.h"
#include "loaded.h"

/* A roller that is pushed along, presses the floor by its weight and is dragged round by it against a brake: the floor
 * gives K d^1.5, and a traction of f (slip). */
static const char roller[] = "kempe: 1\n"
                             "gravity: [0, 0, -10]\n"
                             "parameters: {K: 1e9, f: 2e4, b: 3}\n"
                             "bodies:\n"
                             "  roller:\n"
                             "    joint: {name: go, planar: y, at: ground}\n"
                             "    mass: 100\n"
                             "    inertia: {xx: 1, yy: 1, zz: 1}\n"
                             "forces:\n"
                             "  floor: {joint: go.1, force: \"K*max(0.5-q(go.1), 0)^1.5\"}\n"
                             "  drag: {joint: go.3, torque: \"-0.5*f*(0.5*qd(go.3)-qd(go.2)) - b*qd(go.3)\"}\n"
                             "  pull: {joint: go.2, force: \"f*(0.5*qd(go.3)-qd(go.2))\"}\n"
                             "start: {q: {go.1: 0.7}, qd: {go.2: 4, go.3: 1}}\n";

static void a_roller_sinks_in_and_turns(void)
{
    loaded l = load_text(roller);
    kmp_linear linear;
    int x = coordinate_named(&l, "go.2"), z = coordinate_named(&l, "go.1"), spin = coordinate_named(&l, "go.3");
    kmp_steady rates[] = {{x, 4, KMP_RATE_HELD, 0}, {spin, 1, KMP_RATE_FREED, 0}};
    kmp_search search = {.rates = rates, .rate_count = 2, .balanced = true};
    double q[3] = {0};
    q[x] = 2;
    q[z] = 0.7;
    CHECK(kmp_linear_init(&linear, l.system, "tape") == KEMPE_OK);
    CHECK(kmp_equilibrium_find(&linear, 0, q, &search) == KEMPE_OK);
    CHECK_NEAR(q[x], 2, 0);
    CHECK_NEAR(0.5 - q[z], pow(1000 / 1e9, 2.0 / 3), 1e-14);
    CHECK_NEAR(rates[1].rate, 4 * 0.5 * 2e4 / (0.25 * 2e4 + 3), 1e-13);
    CHECK_NEAR(rates[0].rate, 4, 0);
    CHECK_NEAR(linear.qd[spin], rates[1].rate, 0);
    CHECK(search.residual < 1e-10);
    CHECK(search.iterations < 60);
    kmp_linear_free(&linear);
    unload(&l);
}

/* A coordinate that nothing holds falls: a sentence with its name, and nothing is changed. */
static void what_nothing_carries_is_named(void)
{
    loaded l = load_text("kempe: 1\n"
                         "gravity: [0, 0, -10]\n"
                         "bodies:\n"
                         "  stone: {joint: {name: down, prismatic: z, at: ground}, mass: 1}\n");
    kmp_linear linear;
    kmp_search search = {.balanced = true};
    double q = 3;
    CHECK(kmp_linear_init(&linear, l.system, "tape") == KEMPE_OK);
    CHECK(kmp_equilibrium_find(&linear, 0, &q, &search) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "'down'") != NULL);
    CHECK_NEAR(q, 3, 0);
    kmp_linear_free(&linear);
    unload(&l);
}

int main(void)
{
    TEST(a_roller_sinks_in_and_turns);
    TEST(what_nothing_carries_is_named);
    return check_report();
}
