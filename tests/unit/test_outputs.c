/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs and sensors against differences and formulas, and that those not asked for cost nothing. */
#include "base/text.h"
#include "constraints/evaluation/evaluator.h"
#include "derived.h"
#include "loaded.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <math.h>

static const char form[] = "kempe: 1\ngravity: [0, -9.81, 0.5]\nparameters: {gain: 3, k: 20 N/m}\n"
                           "ground: {points: {G: [0.3, 1, -0.2]}}\nbodies:\n"
                           "  a: {joint: {revolute: [1, 2, 0.5], at: ground}, mass: 1, com: [0.2, 0, 0],\n"
                           "      inertia: {xx: 1, yy: 1, zz: 1}, points: {P: [1, 0.2, 0.1]}}\n"
                           "  b: {joint: {motions: [T1, -R2], at: a.P}, mass: 2, inertia: {xx: 1, yy: 1, zz: 1},\n"
                           "      points: {Q: [0.1, 0.5, -0.3]}}\n"
                           "loops: {R: {rod: [b.Q, ground.G], length: 1}}\n"
                           "forces:\n  s: {spring: [b.Q, ground.G], stiffness: k, free_length: 0.3}\n"
                           "  m: {joint: a, torque: \"2 - 0.1*qd(a)\"}\n"
                           "sensors: {speed: \"gain*qd(b.1)*sin(t)\", lift: \"q(b.1)\"}\nrun: {outputs: [%s]}\n";

static const char all[] = "q, position(b.Q), velocity(b.Q), acceleration(b.Q), energy, force(s), force(m), "
                          "reaction(R), sensor(speed), lift, angle(a)";

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kmp_evaluator *eval;
} scene;

static scene open_scene(const char *outputs)
{
    char text[2048];
    (void)snprintf(text, sizeof text, form, outputs);
    loaded l = load_text(text);
    return (scene){l.context, l.model, l.system, l.system ? kmp_eval_new(l.system, "tape") : NULL};
}

static void close_scene(scene *s)
{
    loaded l = {s->context, s->model, s->system};
    kmp_eval_free(s->eval);
    unload(&l);
}

/* Position and velocity after a time h at constant acceleration. */
static void moved(scene *s, const state *at, double h, double out[6])
{
    state n = *at;
    for (int k = 0; k < 3; k++) {
        n.q[k] += h * at->qd[k] + h * h / 2 * at->qdd[k];
        n.qd[k] += h * at->qdd[k];
    }
    memcpy(out, kmp_eval_shown(s->eval, at->t + h, n.q, n.qd, n.qdd, n.lambda), 6 * sizeof *out);
}

static void rates(void)
{
    const double h = 1e-4;
    scene s = open_scene(all);
    random_seed(3);
    for (int round = 0; s.eval && round < 5; round++) {
        state at = random_state_vectors();
        double up[6], down[6];
        moved(&s, &at, h, up);
        moved(&s, &at, -h, down);
        const double *x = kmp_eval_shown(s.eval, at.t, at.q, at.qd, at.qdd, at.lambda);
        for (int k = 0; k < 6; k++)
            CHECK_NEAR(x[3 + k], (up[k] - down[k]) / (2 * h), 1e-5);
    }
    close_scene(&s);
}

static void values(void)
{
    scene s = open_scene(all);
    state at = random_state_vectors();
    double x[21], length = 0;
    CHECK(kmp_outputs_width(s.model) == 19);
    memcpy(x, kmp_eval_shown(s.eval, at.t, at.q, at.qd, at.qdd, at.lambda), 19 * sizeof *x);
    kmp_eval_closure(s.eval, at.t, at.q);
    kmp_eval_mass(s.eval);
    CHECK_NEAR(x[9], kmp_eval_kinetic(s.eval, at.qd), 1e-12);
    CHECK_NEAR(x[10], kmp_eval_potential(s.eval, at.t, at.q), 1e-12);
    CHECK_NEAR(x[11], x[9] + x[10], 1e-12);
    static const double ground[3] = {0.3, 1, -0.2};
    for (int k = 0; k < 3; k++)
        length += (x[k] - ground[k]) * (x[k] - ground[k]);
    CHECK_NEAR(x[12], 20 * (sqrt(length) - 0.3), 1e-12);
    CHECK_NEAR(x[13], 2 - 0.1 * at.qd[0], 1e-15);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(x[14 + k], at.lambda[0] * (ground[k] - x[k]), 1e-12);
    CHECK_NEAR(x[17], 3 * at.qd[1] * sin(at.t), 1e-13);
    CHECK_NEAR(x[18], at.q[1], 0);
    close_scene(&s);
}

/* A spring between points that are one has no direction; its tension is that of its length all the same. */
static void tension_of_a_spring_without_length(void)
{
    loaded l = load_text(
        "kempe: 1\nground: {points: {G: [0, 0, 0]}}\nbodies:\n"
        "  b: {joint: {name: A, revolute: z, at: ground.G}, mass: 1, inertia: {zz: 1}, points: {P: [0, 0, 0]}}\n"
        "forces: {s: {spring: [ground.G, b.P], stiffness: 4, free_length: 0.2, damping: 3}}\n"
        "run: {outputs: [force(s)]}\n");
    kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
    const double q = 0.3, qd = 1, qdd = 0;
    CHECK(fabs(kmp_eval_shown(eval, 0, &q, &qd, &qdd, NULL)[0] + 0.8) < 1e-15);
    kmp_eval_free(eval);
    unload(&l);
}

static int judge_length(const char *outputs)
{
    scene s = open_scene(outputs);
    const kmp_program *judge = s.system->judge;
    int length = judge->code[KMP_STAGE_SHOWN + 1] - judge->code[KMP_STAGE_POSITION];
    close_scene(&s);
    return length;
}

static void nothing_unasked(void)
{
    int position = judge_length("position(b.Q)"), velocity = judge_length("velocity(b.Q)"),
        acceleration = judge_length("acceleration(b.Q)"), sensor = judge_length("speed");
    printf("  instructions: position %d, velocity %d, acceleration %d, sensor %d, all %d\n", position, velocity,
           acceleration, sensor, judge_length(all));
    CHECK(judge_length("q, qd, lambda(R)") == 0 && judge_length("q(a), qdd(b.2), lift") == 0);
    /* the spring has computed the place of its point */
    CHECK(position == 0 && position < velocity && velocity < acceleration && acceleration < judge_length(all));
    CHECK(sensor == 3);
}

static void columns(void)
{
    static const char *const names[] = {"position.b.Q.z", "velocity.b.Q.z", "acceleration.b.Q.z",
                                        "energy.total",   "force.s",        "force.m",
                                        "reaction.R.z",   "sensor.speed",   "sensor.lift"};
    scene s = open_scene(all);
    for (int o = 1, k = 0; o < s.model->output_count - 1; o++) {
        kmp_text text = {0};
        kmp_output_column(&text, s.model, &s.model->outputs[o], kmp_output_width(s.model, &s.model->outputs[o]) - 1);
        CHECK_TEXT(text.s, names[k++]);
        kmp_text_free(&text);
    }
    close_scene(&s);
}

int main(void)
{
    TEST(rates);
    TEST(values);
    TEST(tension_of_a_spring_without_length);
    TEST(nothing_unasked);
    TEST(columns);
    return check_report();
}
