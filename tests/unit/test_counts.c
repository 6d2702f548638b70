/* SPDX-License-Identifier: BSD-3-Clause */
/* Counting operations: signs, numbers kept as symbols, the steps of a vectorised program, forces and torques on bodies
 * as inputs. */
#include "backend/machine.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "studies/show/sets.h"
#include "symbolic/function_table.h"
#include "testing.h"

static kempe_context *context;

static kempe_model *model_of(const char *text)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "text", &model) == KEMPE_OK);
    if (!model)
        printf("%s\n", kempe_context_message(context));
    return model;
}

static kmp_program *program_of(kmp_graph *g, int count, const kmp_ref *outputs)
{
    kmp_program *p = kmp_program_new(g, 1, &count, &outputs);
    CHECK(p != NULL);
    return p;
}

/* -- programs ---------------------------------------------------------------------------------------- */

static void signs(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), y = kmp_input(g, KMP_IN_Q, 1), tau = kmp_input(g, KMP_IN_PARAMETER, 0);
    const kmp_ref free_ones[3] = {kmp_neg(kmp_mul(g, x, y)), kmp_sub(g, x, y), kmp_sin(g, kmp_neg(x))};
    const kmp_ref paid[2] = {kmp_unary(g, KMP_OP_EXP, kmp_neg(x)), kmp_mul(g, tau, tau)};
    kmp_program *p = program_of(g, 3, free_ones), *r = program_of(g, 2, paid);
    kmp_counts c = kmp_program_count(p, 0, 1), d = kmp_program_count(r, 0, 1), e = kmp_program_count(r, 1, 1);
    CHECK(c.add == 1 && c.mul == 1 && c.trig == 1 && c.neg == 0 && c.paper == 2 && c.robotran == 3);
    CHECK(d.neg == 1 && d.other == 1 && d.mul == 1 && d.paper == 1 && d.robotran == 3);
    CHECK(e.paper == 0 && e.robotran == 2);
    kmp_program_free(p);
    kmp_program_free(r);
    kmp_graph_free(g);
}

static void steps(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), y = kmp_input(g, KMP_IN_Q, 1), p = kmp_input(g, KMP_IN_PARAMETER, 0);
    kmp_ref constant = kmp_mul(g, p, p);                                    /* 0 */
    kmp_ref twice = kmp_mul(g, x, y);                                       /* 1 */
    kmp_ref once = kmp_mul(g, twice, constant);                             /* in its user */
    kmp_ref turn = kmp_mul(g, kmp_sin(g, kmp_add(g, x, y)), kmp_cos(g, x)); /* 1: sines come before */
    const kmp_ref outputs[3] = {kmp_add(g, once, x), kmp_add(g, twice, kmp_mul(g, y, y)), turn}; /* 2, 2, 1 */
    kmp_program *all = program_of(g, 3, outputs), *last = program_of(g, 1, outputs + 2), *none = program_of(g, 1, &x);
    CHECK(kmp_program_steps(all).vector == 2 && kmp_program_steps(all).serial == 4);
    CHECK(kmp_program_steps(last).vector == 1 && kmp_program_steps(last).serial == 1);
    CHECK(kmp_program_steps(none).vector == 0 && kmp_program_steps(none).serial == 0);
    kmp_program_free(all);
    kmp_program_free(last);
    kmp_program_free(none);
    kmp_graph_free(g);
}

/* -- scenes ------------------------------------------------------------------------------------------ */

static const char pendulum[] = "kempe: 1\nparameters: {l: 0.5}\ngravity: [0, -9.81, 0]\n"
                               "bodies: {a: {joint: {revolute: z, at: ground}, mass: 2, com: [l, 0, 0], inertia: {zz: "
                               "0.1}}}\n";

static kmp_tally tally(const char *text, unsigned sets, kmp_keep keep)
{
    kempe_model *model = model_of(text);
    const kmp_derivation_request scene = {.keep = keep};
    kmp_tally t = {0};
    CHECK(model && kmp_tally_sets(model, &scene, sets, &t) == KEMPE_OK);
    kempe_model_free(model);
    return t;
}

/* M = zz + mass l^2, C = mass l g cos q */
static void kept_numbers(void)
{
    const unsigned m = 1u << KMP_EQ_M, c = 1u << KMP_EQ_C;
    CHECK(tally(pendulum, m, KMP_KEEP_NOTHING).counts.paper == 0);
    CHECK(tally(pendulum, m, KMP_KEEP_PARAMETERS).counts.paper == 3);
    CHECK(tally(pendulum, m, KMP_KEEP_NUMBERS).counts.paper == 3);
    CHECK(tally(pendulum, m, KMP_KEEP_NUMBERS).runtime.paper == 0);
    CHECK(tally(pendulum, c, KMP_KEEP_NOTHING).counts.paper < tally(pendulum, c, KMP_KEEP_NUMBERS).counts.paper);
    CHECK(tally(pendulum, m | c, KMP_KEEP_NUMBERS).runtime.trig >= 1);
    CHECK(tally(pendulum, m | c, KMP_KEEP_NUMBERS).steps.vector == 1);
}

/* Zeros and ones vanish in any case, and what is not read from the model is no symbol. */
static void zeros_stay_zeros(void)
{
    static const char text[] = "kempe: 1\nbodies: {a: {joint: {prismatic: z, at: ground}, mass: 2, com: [0, 0, 0]}}\n";
    kmp_tally t = tally(text, 1u << KMP_EQ_M | 1u << KMP_EQ_C, KMP_KEEP_NUMBERS);
    CHECK(t.counts.robotran == 0 && t.operations == 0);
}

/* -- body inputs ------------------------------------------------------------------------------------- */

/* Two bars without mass in a plane: what the joints feel of a force and a torque on the second one. */
static void forces_and_torques(void)
{
    kempe_model *model = model_of("kempe: 1\nbodies:\n"
                                  "  a: {joint: {revolute: z, at: ground}, points: {P: [0.7, 0, 0]}}\n"
                                  "  w: {joint: {weld: yes, at: a}}\n"
                                  "  b: {joint: {revolute: -z, at: a.P}, com: [0.3, 0.1, 0]}\n");
    const kmp_derivation_request scene = {.sets = kmp_sets_derive(1u << KMP_EQ_C), .body_inputs = true};
    const double q[2] = {0.4, -0.9}, rest[2] = {0}, force[9] = {0, 0, 0, 0, 0, 0, 3, 5, 7}, torque[9] = {[8] = 11};
    kmp_equations eq;
    if (!model || kmp_equations_derive(&eq, model, &scene) != KEMPE_OK) {
        CHECK(false);
        return;
    }
    kmp_program *p = kmp_sets_program(&eq, 1u << KMP_EQ_C);
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
    kmp_machine_set(machine, KMP_IN_Q, q);
    kmp_machine_set(machine, KMP_IN_QD, rest);
    kmp_machine_set(machine, KMP_IN_FORCE, force);
    kmp_machine_set(machine, KMP_IN_TORQUE, torque);
    (void)kmp_machine_run(machine, 0);
    const double *c = kmp_machine_run(machine, 1);
    double own = 0.3 * 5 - 0.1 * 3 + 11, angle = -q[1];
    CHECK_NEAR(c[1], own, 1e-14); /* its axis is -z */
    CHECK_NEAR(c[0], -(own + 0.7 * (sin(angle) * 3 + cos(angle) * 5)), 1e-14);
    kmp_machine_free(machine);
    kmp_program_free(p);
    kmp_equations_free(&eq);
    kempe_model_free(model);
}

int main(void)
{
    context = kempe_context_new();
    TEST(signs);
    TEST(steps);
    TEST(kept_numbers);
    TEST(zeros_stay_zeros);
    TEST(forces_and_torques);
    kempe_context_free(context);
    return check_report();
}
