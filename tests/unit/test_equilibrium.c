/* SPDX-License-Identifier: BSD-3-Clause */
/* Equilibria against closed forms: of a hanging mass, of pendulums from rough guesses; the state that analyses work
 * at. */
#include "analysis/operating.h"
#include "backend/machine.h"
#include "loaded.h"

/* One coordinate: its value at the equilibrium, NaN when there is none. */
static double rest_of(const char *text)
{
    loaded m = load_text(text);
    kmp_operating *o = NULL;
    double q = NAN;
    if (kmp_operating_new(m.system, NULL, &o) == KEMPE_OK) {
        q = o->q[0];
        CHECK(o->equilibrium && o->residual <= 1e-10);
        CHECK(o->qd[0] == 0);
    }
    kmp_operating_free(o);
    unload(&m);
    return q;
}

static void a_hanging_mass_stretches_its_spring(void)
{
    CHECK_NEAR(rest_of("kempe: 1\ngravity: [0, 0, -9.81]\n"
                       "bodies: {a: {joint: {name: S, prismatic: z, at: ground}, mass: 3}}\n"
                       "forces: {k: {joint: S, spring: {stiffness: 2, rest: 1}}}\n"),
               1 - 3 * 9.81 / 2, 1e-14);
}

/* m g l sin q = k (q - rest): solved beside it by bisection. */
static void a_pendulum_is_found_from_anywhere(void)
{
    const char *const from[] = {"3", "3.14", "-1.5", "1.57", "0.1"};
    double low = 0, high = 1.5;
    for (int k = 0; k < 100; k++) {
        double q = (low + high) / 2;
        if (2 * 9.81 * 0.5 * sin(q) + 3 * (q - 1) < 0)
            low = q;
        else
            high = q;
    }
    for (size_t k = 0; k < sizeof from / sizeof *from; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, -9.81]\n"
                       "bodies: {a: {joint: {name: A, revolute: y, at: ground}, mass: 2, com: [0, 0, -0.5], "
                       "inertia: {yy: 0.1}}}\n"
                       "forces: {k: {joint: A, spring: {stiffness: 3, rest: 1}}}\n"
                       "start: {q: {A: %s}}\n",
                       from[k]);
        CHECK_NEAR(rest_of(text), low, 1e-14);
    }
}

static void what_nothing_holds_is_told(void)
{
    loaded m = load_text("kempe: 1\ngravity: [0, 0, -9.81]\n"
                         "bodies: {a: {joint: {name: S, prismatic: z, at: ground}, mass: 1}}\n");
    kmp_operating *o = NULL;
    CHECK(kmp_operating_new(m.system, "equilibrium", &o) == KEMPE_E_FAILED && !o);
    CHECK(strstr(kempe_context_message(m.context), "nothing holds 'S'"));
    CHECK(kmp_operating_new(m.system, "rest", &o) == KEMPE_E_ARGUMENT && !o);
    unload(&m);
}

/* The linear equations at the start go with the motion, at the equilibrium they stand still. */
static void a_state_to_look_from(void)
{
    loaded m = load("examples/four_bar/four_bar.yaml");
    const char *const words[] = {"start", "equilibrium"};
    for (int k = 0; k < 2; k++) {
        kmp_operating *o = NULL;
        kmp_linear l;
        CHECK(kmp_operating_new(m.system, words[k], &o) == KEMPE_OK);
        CHECK(kmp_linear_init(&l, m.system, kmp_backend_default()) == KEMPE_OK);
        CHECK(kmp_operating_take(o, &l, NULL, 0) == KEMPE_OK);
        kmp_linear_matrices(&l);
        CHECK(o->equilibrium == (k == 1));
        for (int i = 0; i < l.n; i++) {
            CHECK_NEAR(l.q[i], o->q[i], 1e-14);
            CHECK_NEAR(l.qd[i], o->qd[i], 1e-12);
            CHECK(k == 1 ? fabs(l.qdd[i]) < 1e-12 : l.qdd[i] != 0);
        }
        CHECK(k == 0 || (kmp_equilibrium_residual(&l) <= 1e-12 && l.stiffness[0] > 0));
        kmp_linear_free(&l);
        kmp_operating_free(o);
    }
    unload(&m);
}

int main(void)
{
    TEST(a_hanging_mass_stretches_its_spring);
    TEST(a_pendulum_is_found_from_anywhere);
    TEST(what_nothing_holds_is_told);
    TEST(a_state_to_look_from);
    return check_report();
}
