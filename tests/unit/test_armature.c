/* SPDX-License-Identifier: BSD-3-Clause */
/* Armatures of joints: beside a gear train of bodies, on the diagonal of M alone, in inverse dynamics and in the
 * energy; what is refused. Runs by all algorithms: test_articulated.c, test_formalisms.c. */
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <kempe/workspace.h>
#include <math.h>
#include <string.h>

enum { MOST = 8 };

typedef struct scene {
    kempe_model *model;
    kempe_system *system;
    kempe_workspace *work;
} scene;

static kempe_context *context;

static scene by(const char *text, const char *algorithm)
{
    scene s = {.model = NULL};
    CHECK(kempe_model_read_text(context, text, "text.yaml", &s.model) == KEMPE_OK);
    CHECK(s.model && kempe_system_new_with_algorithm(s.model, algorithm, &s.system) == KEMPE_OK);
    CHECK(s.system && kempe_workspace_new(s.system, &s.work) == KEMPE_OK);
    return s;
}

static scene with(const char *text)
{
    return by(text, "auto");
}

static void unload(scene *s)
{
    kempe_workspace_free(s->work);
    kempe_system_free(s->system);
    kempe_model_free(s->model);
}

#define ARM "mass: 2, com: [0.3, 0, 0], inertia: {xx: 0.1, yy: 0.2, zz: 0.2}"

/* A rotor of inertia 2e-4 that turns 50 times as fast as the arm, with an axis in the ground. */
static void like_a_gear_train(void)
{
    scene own = with("kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                     "  arm: {joint: {revolute: z, at: ground, armature: 0.5}, " ARM "}\n"
                     "forces: {motor: {joint: arm, torque: 50*0.03}}\n"),
          bodies = with("kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                        "  arm: {joint: {revolute: z, at: ground}, " ARM "}\n"
                        "  rotor: {joint: {revolute: z, at: ground}, mass: 0.1, inertia: {zz: 2e-4}}\n"
                        "loops: {gear: {coupler: {rotor: 1, arm: -50}, equals: 0}}\n"
                        "forces: {motor: {joint: rotor, torque: 0.03}}\n");
    const double q[2] = {0.4, 20}, qd[2] = {-0.3, -15};
    double first[2], second[2];
    CHECK(kempe_workspace_forward_dynamics(own.work, 0, q, qd, NULL, first, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_forward_dynamics(bodies.work, 0, q, qd, NULL, second, NULL) == KEMPE_OK);
    CHECK_NEAR(first[0], second[0], 1e-12);
    CHECK_NEAR(first[0], (1.5 - 2 * 9.81 * 0.3 * cos(q[0])) / (0.2 + 2 * 0.09 + 0.5), 1e-12);
    unload(&own);
    unload(&bodies);
}

#define CHAIN(first, second, third)                                                                                    \
    "kempe: 1\ngravity: [1, -9.81, 3]\nbodies:\n"                                                                      \
    "  a: {joint: {revolute: [1, 2, 2], at: ground" first "}, " ARM ", points: {P: [0.5, 0, 0.1]}}\n"                  \
    "  b: {joint: {prismatic: -y, at: a.P" second "}, " ARM ", points: {P: [0, 0.4, 0]}}\n"                            \
    "  c: {joint: {revolute: -x, at: b.P, reversed: yes" third "}, " ARM ", points: {P: [0, 0, 0.3]}}\n"               \
    "  d: {joint: {spherical: x, at: c.P}, " ARM "}\n"

/* M grows by the armatures on its diagonal, C not; inverse dynamics and the kinetic energy follow. */
static void on_the_diagonal_by(const char *algorithm)
{
    static const double armature[MOST] = {0.3, 0.7, 0.05};
    scene s[2] = {by(CHAIN("", "", ""), algorithm),
                  by(CHAIN(", armature: 0.3", ", armature: 700 g", ", armature: 0.05"), algorithm)};
    const double q[MOST] = {0.3, -0.2, 0.7, 0.4, 0.2, -0.6}, qd[MOST] = {1, -2, 0.5, 0.3, -1, 2},
                 qdd[MOST] = {2, 1, -3, 0.4, 1, -1};
    double effort[2][MOST];
    const int n = 6;
    for (int k = 0; k < 2; k++) {
        CHECK(kempe_workspace_evaluate(s[k].work, 0, q, qd) == KEMPE_OK);
        CHECK(kempe_workspace_inverse_dynamics(s[k].work, 0, q, qd, qdd, effort[k]) == KEMPE_OK);
    }
    CHECK(kempe_workspace_evaluate(s[0].work, 0, q, qd) == KEMPE_OK);
    CHECK(kempe_workspace_evaluate(s[1].work, 0, q, qd) == KEMPE_OK);
    double energy = kempe_workspace_kinetic(s[0].work);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++)
            CHECK_NEAR(kempe_workspace_mass(s[1].work)[i * n + k] - kempe_workspace_mass(s[0].work)[i * n + k],
                       i == k ? armature[i] : 0, 1e-14);
        CHECK_NEAR(kempe_workspace_bias(s[1].work)[i], kempe_workspace_bias(s[0].work)[i], 1e-13);
        CHECK_NEAR(effort[1][i] - effort[0][i], armature[i] * qdd[i], 1e-12);
        energy += 0.5 * armature[i] * qd[i] * qd[i];
    }
    CHECK_NEAR(kempe_workspace_kinetic(s[1].work), energy, 1e-13);
    unload(&s[0]);
    unload(&s[1]);
}

static void on_the_diagonal(void)
{
    static const char *const algorithms[] = {"composite", "plain", "ner", "articulated"};
    for (size_t k = 0; k < sizeof algorithms / sizeof *algorithms; k++)
        on_the_diagonal_by(algorithms[k]);
}

/* A joint without a mass behind it moves by its armature. */
static void without_bodies(void)
{
    scene s = with("kempe: 1\nbodies: {rotor: {joint: {revolute: z, at: ground, armature: 0.02}}}\n"
                   "forces: {motor: {joint: rotor, torque: 0.1}}\n");
    const double q = 0, qd = 0;
    double qdd = 0;
    CHECK(kempe_workspace_forward_dynamics(s.work, 0, &q, &qd, NULL, &qdd, NULL) == KEMPE_OK);
    CHECK_NEAR(qdd, 5, 1e-14);
    unload(&s);
}

static void refuse(const char *text, const char *sentence)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "text.yaml", &model) == KEMPE_E_INPUT);
    CHECK_TEXT(kempe_context_message(context), sentence);
    kempe_model_free(model);
}

static void what_is_refused(void)
{
    refuse("kempe: 1\nbodies:\n  a: {joint: {spherical: z, at: ground, armature: 0.3}, " ARM "}\n",
           "text.yaml:3:51: the joint of body 'a': only a joint with one coordinate has an armature");
    refuse("kempe: 1\nbodies:\n  a: {joint: {revolute: z, at: ground, armature: -0.3}, " ARM "}\n",
           "text.yaml:3:50: the armature of the joint of body 'a' is -0.3: it must not be negative");
    refuse("kempe: 1\nbodies:\n  a: {joint: {prismatic: z, at: ground, armature: 3 kg*m^2}, " ARM "}\n",
           "text.yaml:3:51: the armature of the joint of body 'a': expected kg, got kg*m^2");
}

int main(void)
{
    context = kempe_context_new();
    TEST(like_a_gear_train);
    TEST(on_the_diagonal);
    TEST(without_bodies);
    TEST(what_is_refused);
    kempe_context_free(context);
    return check_report();
}
