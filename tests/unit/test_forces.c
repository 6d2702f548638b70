/* SPDX-License-Identifier: BSD-3-Clause */
/* Force elements: their efforts against formulas written out, and their bookkeeping: what they do to the motion is what
 * their potential and their power say. */
#include "derived.h"
#include "dynamics/equations.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>

enum { SETS = KMP_SET_BIAS | KMP_SET_ENERGY };

static const char form[] = "kempe: 1\nparameters: {k: 30 N*m, c: 0.4}\nground: {points: {G: [0.3, 1, -0.2]}}\nbodies:\n"
                           "  a: {joint: {revolute: [1, 2, 0.5], at: ground}, mass: 1, com: [0.2, 0, 0],\n"
                           "      inertia: {xx: 1, yy: 1, zz: 1}, points: {P: [1, 0.2, 0.1]}}\n"
                           "  b: {joint: {motions: [T1, -R2], at: a.P}, mass: 2, inertia: {xx: 1, yy: 1, zz: 1},\n"
                           "      points: {Q: [0.1, 0.5, -0.3]}}\n"
                           "forces: {%s}\n";

typedef struct element {
    kempe_context *context;
    kempe_model *model;
    derived d;
} element;

static bool open_element(element *e, const char *forces)
{
    char text[2048];
    *e = (element){.context = kempe_context_new()};
    (void)snprintf(text, sizeof text, form, forces);
    bool ok = kempe_model_read_text(e->context, text, "text", &e->model) == KEMPE_OK &&
              derived_init(&e->d, e->model, SETS, KMP_SCHEME_COMPOSITE, false);
    if (!ok)
        printf("%s\n", kempe_context_message(e->context));
    CHECK(ok);
    return ok;
}

static void close_element(element *e)
{
    derived_free(&e->d);
    kempe_model_free(e->model);
    kempe_context_free(e->context);
}

/* Efforts on the three coordinates: the bias without the element less that with it. */
static void efforts(const char *forces, const state *s, double out[3])
{
    element with, without;
    if (!open_element(&with, forces) || !open_element(&without, ""))
        return;
    derived_eval(&with.d, s);
    derived_eval(&without.d, s);
    for (int k = 0; k < 3; k++)
        out[k] = without.d.bias[k] - with.d.bias[k];
    close_element(&with);
    close_element(&without);
}

/* Q.qd = power - dV/dt at random states. */
static void balance(const char *forces)
{
    const double h = 1e-5;
    element e;
    double q[3] = {0};
    if (!open_element(&e, forces))
        return;
    for (int k = 0; k < 5; k++) {
        state s = random_state_vectors(), up = s, down = s;
        double work = 0, rate = 0;
        efforts(forces, &s, q);
        for (int i = 0; i < 3; i++) {
            work += q[i] * s.qd[i];
            up.q[i] += h * s.qd[i];
            down.q[i] -= h * s.qd[i];
        }
        derived_eval(&e.d, &up);
        rate = *e.d.potential;
        derived_eval(&e.d, &down);
        rate = (rate - *e.d.potential) / (2 * h);
        derived_eval(&e.d, &s);
        double power = *e.d.power;
        CHECK_NEAR(work, power - rate, 1e-6 * (1 + fabs(work) + fabs(power) + fabs(rate)));
    }
    close_element(&e);
}

static void balances(void)
{
    random_seed(11);
    balance("f: {joint: a, spring: {stiffness: k, damping: c, rest: 20 deg}}");
    balance("f: {joint: b.1, spring: {stiffness: 3 N/mm, rest: 0.1}}");
    balance("f: {joint: a, stops: {lower: -1, upper: 0.5, stiffness: 300, damping: 7, width: 0.05}}");
    balance("f: {joint: b.1, stops: {upper: 5 cm, stiffness: 2 kN/m, width: 1 cm}}");
    balance(
        "f: {joint: b.2, friction: {torque: 3, speed: 0.2}}, g: {joint: b.1, friction: {force: 3 N, speed: 1 mm/s}}");
    balance("f: {at: b.Q, force: [1, -2 N, 3]}");
    balance("f: {at: b.Q, force: [sin(t), \"q(a)*qd(b.1)\", 2]}");
    balance("f: {on: b, torque: [1, \"-2*q(b.2)\", 3 N*m]}");
    balance("f: {spring: [b.Q, ground.G], stiffness: 10, damping: 2, free_length: 0.3}");
}

static void joint_laws(void)
{
    double q[3] = {0};
    state s = {.q = {0.7, -0.2, 0.3}, .qd = {1.5, 0.25, -2}};
    efforts("f: {joint: a, spring: {stiffness: 30, damping: 0.4, rest: 0.2}}", &s, q);
    CHECK_NEAR(q[0], -30 * 0.5 - 0.4 * 1.5, 1e-13);
    CHECK_NEAR(q[1], 0, 0);
    efforts("f: {joint: b.2, friction: {torque: 3, speed: 1e-9}}", &s, q);
    CHECK_NEAR(q[2], 3, 1e-13);
    efforts("f: {joint: b.2, friction: {torque: 3, speed: 1.5}}", &s, q);
    CHECK_NEAR(q[2], 3 * 2 / 2.5, 1e-13);
}

/* Deep in, on and before a stop; both ends push inwards. */
static void stop_law(void)
{
    double q[3] = {0};
    state s = {.q = {1.5, 0.1, 0}, .qd = {0.5, 0, 0}};
    efforts("f: {joint: a, stops: {upper: 0.5, stiffness: 200, damping: 3, width: 1e-6}}", &s, q);
    CHECK_NEAR(q[0], -200 - 1.5, 1e-9);
    efforts("f: {joint: a, stops: {lower: 2.5, stiffness: 200, damping: 3, width: 1e-6}}", &s, q);
    CHECK_NEAR(q[0], 200 - 1.5, 1e-9);
    efforts("f: {joint: a, stops: {upper: 1.5, stiffness: 200, damping: 4, width: 0.1}}", &s, q);
    CHECK_NEAR(q[0], -200 * 0.1 / 4 - 4 * 0.5 / 4, 1e-12);
    efforts("f: {joint: a, stops: {lower: -10, upper: 2.5, stiffness: 200, width: 0.1}}", &s, q);
    CHECK(q[0] < 0 && q[0] > -1.01 * 200 * 1e-4 / 16);
}

/* Q_i = F.dx/dq_i with x of the point by differences of the constant force's potential, -F.x. */
static void point_force(void)
{
    element e;
    double q[3] = {0};
    const double h = 1e-5;
    state s = {.q = {0.7, -0.2, 0.3}, .qd = {1.5, 0.25, -2}};
    if (!open_element(&e, "f: {at: b.Q, force: [1, -2, 3]}"))
        return;
    efforts("f: {at: b.Q, force: [1 + 0*t, -2, 3]}", &s, q);
    for (int i = 0; i < 3; i++) {
        state up = s, down = s;
        up.q[i] += h;
        down.q[i] -= h;
        derived_eval(&e.d, &up);
        double v = *e.d.potential;
        derived_eval(&e.d, &down);
        CHECK_NEAR(q[i], -(v - *e.d.potential) / (2 * h), 1e-8);
    }
    close_element(&e);
}

/* On a body that turns about a fixed axis, the component along it. */
static void body_torque(void)
{
    double q[3] = {0}, length = sqrt(1 + 4 + 0.25);
    state s = {.q = {0.7, -0.2, 0.3}};
    efforts("f: {on: a, torque: [3, 1, 4]}", &s, q);
    CHECK_NEAR(q[0], (3 + 2 + 2) / length, 1e-13);
    CHECK_NEAR(q[1], 0, 0);
    CHECK_NEAR(q[2], 0, 0);
}

int main(void)
{
    TEST(balances);
    TEST(joint_laws);
    TEST(stop_law);
    TEST(point_force);
    TEST(body_torque);
    return check_report();
}
