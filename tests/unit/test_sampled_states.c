/* SPDX-License-Identifier: BSD-3-Clause */
/* Sampled states: each sample is taken once, at its time and from the state before it, on every method; controllers
 * against the exact solution of their difference equations. */
#include "instances.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include <kempe/sensitivity.h>
#include <kempe/stepper.h>

/* A rotor under a sampled controller of angle and rate. */
#define ROTOR                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "parameters: {Kp: 2, Kd: 0.1}\n"                                                                                   \
    "states: {u: {sample: 10 ms, next: Kp*(1 - q(A)) - Kd*qd(A)}}\n"                                                   \
    "bodies: {rotor: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}}}\n"                     \
    "forces: {motor: {joint: A, torque: u}}\n"                                                                         \
    "run: {t_end: 1, output_step: 10 ms, rtol: 1e-9}\n"

/* A cart on a spring. */
#define CART                                                                                                           \
    "kempe: 1\n"                                                                                                       \
    "states: {u: {sample: 20 ms, next: 200*(0.3 - q(x)) - 40*qd(x)}}\n"                                                \
    "bodies: {cart: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"                                          \
    "forces: {spring: {joint: x, spring: {stiffness: 50}}, drive: {joint: x, force: u}}\n"                             \
    "run: {t_end: 1, output_step: 20 ms, rtol: 1e-11, atol: 1e-11}\n"

/* Samples of rotor and cart, by the exact exponentials of a sample. */
static const struct {
    int sample;
    double q, qd;
} rotor[] = {{1, 0.01, 2},
             {10, 0.66437559880955713109, 9.386935983810433818},
             {50, 0.90262617105456687393, 0.78044281202685437788},
             {100, 0.99341151960501635369, 0.1245803155319941961}},
  cart[] = {{1, 0.0059950016663690806853, NAN}, {10, 0.17659213606985413806, NAN}, {50, 0.24000461674317132114, NAN}};

static kempe_trajectory *run_by(const kempe_system *system, const kmp_method *method)
{
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {.no_convergence_check = 1};
    if (method) {
        run.formulation = method->formulation;
        run.form = method->form;
        run.integrator = method->integrator;
    }
    CHECK(system && kempe_simulate(system, &run, &trajectory) == KEMPE_OK);
    return trajectory;
}

/* All samples by all methods; one-step methods to rounding. */
static void controller(void)
{
    loaded l = load_text(ROTOR);
    kmp_method method;
    int count = 0;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++, count++) {
        kempe_trajectory *t = run_by(l.system, &method);
        bool exact = strcmp(method.integrator, "dop853") == 0 || strcmp(method.integrator, "radau") == 0;
        for (int i = 0; i < 4; i++) {
            CHECK_NEAR(kempe_trajectory_q(t, rotor[i].sample)[0], rotor[i].q, exact ? 1e-14 : 1e-7);
            CHECK_NEAR(kempe_trajectory_qd(t, rotor[i].sample)[0], rotor[i].qd, exact ? 1e-13 : 1e-7);
        }
        kempe_trajectory_free(t);
    }
    CHECK(count > 20);
    unload(&l);
}

static void on_a_spring(void)
{
    loaded l = load_text(CART);
    kempe_trajectory *t = run_by(l.system, NULL);
    for (int i = 0; i < 3; i++)
        CHECK_NEAR(kempe_trajectory_q(t, cart[i].sample)[0], cart[i].q, 1e-10);
    kempe_trajectory_free(t);
    unload(&l);
}

/* Samples of one time see the values before any of them: b is a one sample earlier. Rows have the values before. */
static void together(void)
{
    loaded l = load_text("kempe: 1\nstates:\n  a: {start: -1, sample: 0.1, next: a + 1}\n"
                         "  b: {start: -7, sample: 0.1, next: a}\n  c: {sample: 0.25, next: t}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "run: {t_end: 1.02, output_step: 0.01}\n");
    kempe_trajectory *t = run_by(l.system, NULL);
    for (int row = 0; row < kempe_trajectory_row_count(t); row++) {
        const double *qd = kempe_trajectory_qd(t, row);
        int tenths = row > 0 ? (row - 1) / 10 : 0, quarters = row > 0 ? (row - 1) / 25 : 0;
        CHECK(qd[1] == tenths && qd[2] == tenths - 1 && qd[3] == 0.25 * quarters);
    }
    CHECK(kempe_trajectory_row_count(t) == 103);
    kempe_trajectory_free(t);
    unload(&l);
}

/* Multiples of decimal sample times differ by rounding where they meet, from each other, from rows and from the end:
 * they are one time, a row of which has the values before. */
static void equal_times(void)
{
    loaded l = load_text("kempe: 1\nstates:\n  a: {sample: 1 ms, next: a + 1}\n  b: {sample: 0.1, next: a}\n"
                         "  c: {sample: 0.01, next: b}\n  d: {sample: 0.7, next: t}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "run: {t_end: 2.1, output_step: 0.1}\n");
    kmp_method method;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++) {
        kempe_trajectory *t = run_by(l.system, &method);
        CHECK(kempe_trajectory_row_count(t) == 22);
        for (int row = 1; row < kempe_trajectory_row_count(t); row++) {
            const double *qd = kempe_trajectory_qd(t, row);
            CHECK(qd[1] == 100 * row && qd[2] == 100 * (row - 1));
        }
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* A force is switched by a sampled state: from the first sample after 0.35 s on. */
static void condition(void)
{
    loaded l = load_text("kempe: 1\nstates: {seen: {sample: 0.1, next: t}}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: x, force: \"if(seen > 0.35, 1, 0)\"}}\nrun: {t_end: 1, rtol: 1e-9}\n");
    kmp_method method;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++) {
        kempe_trajectory *t = run_by(l.system, &method);
        int last = kempe_trajectory_row_count(t) - 1;
        CHECK_NEAR(last >= 0 ? kempe_trajectory_qd(t, last)[0] : NAN, 0.6, 1e-7);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* A stepper that stops at samples, and between them, takes each once: before it where it stands, after it where it goes
 * on. Saved and restored there it makes the same bits. */
static void stepper(void)
{
    loaded l = load_text(ROTOR);
    kempe_stepper *s = NULL;
    kempe_stepper_state *kept = NULL;
    CHECK(l.system && kempe_stepper_new(l.system, NULL, &s) == KEMPE_OK);
    CHECK(kempe_stepper_qd(s)[1] == 2);
    for (int k = 1; k <= 100; k++) {
        CHECK(kempe_stepper_advance(s, 0.01 * k - 0.004) == KEMPE_OK);
        CHECK(kempe_stepper_advance(s, 0.01 * k) == KEMPE_OK);
        if (k == 50)
            CHECK(kempe_stepper_save(s, &kept) == KEMPE_OK);
        if (k == 1 || k == 10 || k == 50 || k == 100)
            CHECK_NEAR(kempe_stepper_q(s)[0], rotor[k == 1 ? 0 : k == 10 ? 1 : k == 50 ? 2 : 3].q, 1e-12);
    }
    double end[2] = {kempe_stepper_q(s)[0], kempe_stepper_qd(s)[0]};
    CHECK(kempe_stepper_restore(s, kept) == KEMPE_OK);
    for (int k = 51; k <= 100; k++) {
        CHECK(kempe_stepper_advance(s, 0.01 * k - 0.004) == KEMPE_OK);
        CHECK(kempe_stepper_advance(s, 0.01 * k) == KEMPE_OK);
    }
    CHECK(kempe_stepper_q(s)[0] == end[0] && kempe_stepper_qd(s)[0] == end[1]);
    kempe_stepper_state_free(kept);
    kempe_stepper_free(s);
    unload(&l);
}

/* Sampled blocks begin where continuous ones do: a controller by its integral, a transfer function by its first state,
 * which is the first output: w_k = 3 * 0.9^k. */
static void starts_of_blocks(void)
{
    loaded l = load_text("kempe: 1\nbodies: {b: {joint: {name: z, prismatic: z, at: ground}, mass: 1}}\nstates:\n"
                         "  u: {pid: \"0\", proportional: 2, integral: 0.5, start: 3, sample: 10 ms}\n"
                         "  w: {transfer: \"0\", numerator: [1], denominator: [1, -0.9], sample: 10 ms, start: 3}\n"
                         "run: {t_end: 0.05, output_step: 0.05}\n");
    kempe_trajectory *t = run_by(l.system, NULL);
    const double *qd = kempe_trajectory_qd(t, 1);
    CHECK_NEAR(qd ? qd[1] : NAN, 3, 1e-15);
    CHECK_NEAR(qd ? qd[3] : NAN, 3 * pow(0.9, 4), 1e-15); /* the row at a sample has the values before it */
    kempe_trajectory_free(t);
    unload(&l);
}

/* Every instance has its own run. */
static void ensemble(void)
{
    static const char *const names[] = {"Kp"};
    static const double rows[] = {2, 3};
    loaded l = load_text(ROTOR);
    instances all = run_instances(&l, 0, 1, names, 2, rows);
    CHECK_NEAR(end_position(&all, 0, 0), rotor[3].q, 1e-12);
    CHECK(fabs(end_position(&all, 1, 0) - rotor[3].q) > 1e-4);
    free_instances(&all);
    unload(&l);
}

/* -- events ------------------------------------------------------------------------------------------- */

/* A relay with hysteresis drives a mass to and fro: the force is -1 from x = 1 on, 1 from x = -1 on. By hand: events at
 * sqrt 2 and 2 sqrt 2 + sqrt 6, where the rate is -sqrt 6. A second state counts the changes, a third follows the first
 * at once. */
static void relay(void)
{
    loaded l = load_text("kempe: 1\nstates:\n"
                         "  way: {start: 1, when: (q(x) - 1)*(q(x) + 1) > 0, next: \"if(q(x) > 0, -1, 1)\"}\n"
                         "  count: {when: (q(x) - 1)*(q(x) + 1) > 0, next: count + 1}\n"
                         "  back: {when: way <= 0, next: t}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: x, force: way}}\nrun: {t_end: 10, output_step: 10, rtol: 1e-9}\n");
    kmp_method method;
    int count = 0;
    double s = 10 - 2 * sqrt(2) - sqrt(6);
    for (int k = 0; l.system && kmp_method_get(k, &method); k++, count++) {
        kempe_trajectory *t = run_by(l.system, &method);
        const double *q = kempe_trajectory_q(t, 1), *qd = kempe_trajectory_qd(t, 1);
        CHECK_NEAR(q ? q[0] : NAN, -1 - sqrt(6) * s + s * s / 2, 1e-6);
        CHECK_NEAR(qd ? qd[0] : NAN, s - sqrt(6), 1e-6);
        CHECK(qd && qd[1] == 1 && qd[2] == 2);
        CHECK_NEAR(qd ? qd[3] : NAN, sqrt(2), 1e-7);
        kempe_trajectory_free(t);
    }
    CHECK(count > 20);
    unload(&l);
}

/* A comparison that holds at the start does not become true there. */
static void at_the_start(void)
{
    loaded l =
        load_text("kempe: 1\nstates: {y: {start: 5, when: t < 0.5, next: 7}, z: {start: 5, when: t >= 0.5, next: t}}\n"
                  "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                  "run: {t_end: 1, output_step: 1}\n");
    kempe_trajectory *t = run_by(l.system, NULL);
    CHECK(kempe_trajectory_qd(t, 1)[1] == 5);
    CHECK_NEAR(kempe_trajectory_qd(t, 1)[2], 0.5, 1e-12);
    kempe_trajectory_free(t);
    unload(&l);
}

/* -- what is refused ----------------------------------------------------------------------------------- */

static void check_said(kempe_context *context, const char *sentence)
{
    if (!strstr(kempe_context_message(context), sentence))
        CHECK_TEXT(kempe_context_message(context), sentence);
}

static void studies(void)
{
    loaded l = load_text(ROTOR);
    kempe_sensitivity *s = NULL;
    const kempe_sensitivity_options at_start = {.of = "reactions", .at = "start"};
    CHECK(l.model && kempe_sensitivity_new(l.model, &at_start, &s) == KEMPE_E_ARGUMENT);
    check_said(l.context, "sensitivities: the state 'u' is sampled");
    unload(&l);
}

static void refused(const char *state, const char *sentence)
{
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nstates: {u: {%s}}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n",
                   state);
    load_rejected(text, sentence);
}

static void mistakes(void)
{
    refused("next: q(x)", "state 'u'");
    refused("when: q(x) > 0", "state 'u' has no key 'next'");
    refused("when: q(x), next: 1", "an operator, '<', '<=', '>' or '>='");
    refused("when: q(x) > 0, sample: 0.1, next: 1", "exactly one of");
    refused("sample: 0.1", "state 'u' has no key 'next'");
    refused("next: 1, sample: 0", "sample of state 'u' is 0: it must be positive");
    refused("next: 1, sample: 2 m", "expected s, got m");
    refused("next: 1, sample: 0.1, rate: 2", "exactly one of");
    refused("next: lambda(c), sample: 0.1", "lambda is not allowed here");
}

int main(void)
{
    TEST(controller);
    TEST(on_a_spring);
    TEST(together);
    TEST(equal_times);
    TEST(condition);
    TEST(stepper);
    TEST(starts_of_blocks);
    TEST(ensemble);
    TEST(relay);
    TEST(at_the_start);
    TEST(studies);
    TEST(mistakes);
    return check_report();
}
