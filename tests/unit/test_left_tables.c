/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables that are used beyond their points: each study says so, also where that happens between the ends of a step. */
#include "base/context.h"
#include "base/memory.h"
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/equilibrium.h>
#include <kempe/generate.h>
#include <kempe/inverse.h>
#include <kempe/kinematics.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>
#include <kempe/stepper.h>
#include <kempe/workspace.h>
#include <string.h>

/* True if the status of a study is the expected one, with a warning of the table where it is left. */
static bool is_right(const loaded *l, kempe_status status, const char *table)
{
    char words[64], *said = kmp_context_warnings(l->context);
    (void)snprintf(words, sizeof words, "table '%s' ", table ? table : "");
    const bool warned = said && strstr(said, words),
               right = table ? status == KEMPE_UNTRUSTED && warned : status == KEMPE_OK && said && !said[0];
    if (!right)
        printf("status %d: %s\n", status, said ? said : "");
    kmp_free(said);
    return right;
}

/* q = a cos t + b sin t has the amplitude sqrt(a^2 + b^2): its turn, at 0.06 s, lies within a step. */
static void within_a_step(void)
{
    static const struct {
        const char *start;
        const char *left;
    } cases[] = {{"q: {S: 0.999}, qd: {S: 0.06}", "f"},  /* 1.0008 */
                 {"q: {S: 0.999}, qd: {S: 0.04}", NULL}, /* 0.9998 */
                 {"q: {S: 0.8}, qd: {S: 0.6}", NULL},    /* 1, the end of the table */
                 {"q: {S: -0.999}, qd: {S: -0.06}", "f"}};
    static const char *const formulations[] = {"reduced", "projected"};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        for (int f = 0; f < 2; f++) {
            char text[512];
            kempe_trajectory *t = NULL;
            (void)snprintf(text, sizeof text,
                           "kempe: 1\ntables: {f: {x: [-1, 0, 1], y: [-1, 0, 1], method: linear}}\n"
                           "bodies: {m: {joint: {name: S, prismatic: z, at: ground}, mass: 1}}\n"
                           "forces: {k: {joint: S, spring: {stiffness: 1}}, d: {joint: S, force: 1e-9*f(q(S))}}\n"
                           "start: {%s}\nrun: {t_end: 1, rtol: 1e-6, output_step: 0.5, outputs: [q]}\n",
                           cases[k].start);
            loaded l = load_text(text);
            const kempe_run_options run = {.formulation = formulations[f]};
            CHECK(is_right(&l, kempe_simulate(l.system, &run, &t), cases[k].left));
            kempe_trajectory_free(t);
            unload(&l);
        }
}

/* A weight of 20 N on a spring of 1000 N/m, by points to 10 N or to 30 N; rest is at -0.02 m. */
#define WEIGHT(points)                                                                                                 \
    "kempe: 1\ngravity: [0, 0, -10]\nparameters: {x0: -0.001}\ntables: {f: {" points ", method: linear}}\n"            \
    "bodies: {m: {joint: {name: S, prismatic: z, at: ground}, mass: 2}}\n"                                             \
    "forces: {k: {joint: S, force: -f(q(S))}, d: {joint: S, force: -qd(S)}}\n"                                         \
    "start: {q: {S: x0}}\nrun: {t_end: 0.1, outputs: [q]}\n"

static void in_laws(void)
{
    for (int k = 0; k < 2; k++) {
        loaded l = load_text(k ? WEIGHT("x: [-0.03, 0, 0.03], y: [-30, 0, 30]")
                               : WEIGHT("x: [-0.01, 0, 0.01], y: [-10, 0, 10]"));
        const char *left = k ? NULL : "f";
        const kempe_inverse_options inverse = {.actuators = "S"};
        const kempe_linearize_options linearize = {.inputs = "effort(S)", .outputs = "q(S)"};
        const kempe_sensitivity_options slopes = {.of = "equilibrium", .parameters = "x0"};
        kempe_equilibrium *e = NULL;
        kempe_inverse *i = NULL;
        kempe_modes *m = NULL;
        kempe_linearization *x = NULL;
        kempe_sensitivity *s = NULL;
        CHECK(is_right(&l, kempe_equilibrium_new(l.system, NULL, &e), left));
        CHECK(is_right(&l, kempe_modes_new(l.system, NULL, &m), left));
        CHECK(is_right(&l, kempe_linearization_new(l.system, &linearize, &x), left));
        CHECK(is_right(&l, kempe_sensitivity_new(l.model, &slopes, &s), left));
        CHECK(is_right(&l, kempe_inverse_new(l.system, &inverse, &i), NULL)); /* at the start */
        kempe_inverse_free(i);
        kempe_equilibrium_free(e);
        kempe_modes_free(m);
        kempe_linearization_free(x);
        kempe_sensitivity_free(s);
        unload(&l);
    }
}

static void in_inverse_dynamics(void)
{
    loaded l = load_text(WEIGHT("x: [-0.0005, 0, 0.01], y: [-0.5, 0, 10]"));
    const kempe_inverse_options ask = {.actuators = "S"};
    kempe_inverse *r = NULL;
    CHECK(is_right(&l, kempe_inverse_new(l.system, &ask, &r), "f"));
    kempe_inverse_free(r);
    unload(&l);
}

/* Tables of forces say nothing of positions, those of cams and of sensors do. */
static void in_kinematics(void)
{
    static const char *const points[] = {"[-1, 2]", "[-1, 0.5]"};
    for (int k = 0; k < 2; k++)
        for (int sensor = 0; sensor < 2; sensor++) {
            char text[1024];
            const kempe_kinematics_options ask = {.sweep = "A=0:1:5"};
            kempe_kinematics *r = NULL;
            (void)snprintf(text, sizeof text,
                           "kempe: 1\ntables: {lift: {x: %s, y: [0, 1], method: linear}, gauge: {x: %s, y: [0, 1], "
                           "method: linear}, force: {x: [0, 0.1], y: [0, 1], method: linear}}\n"
                           "bodies:\n  cam: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"
                           "  follower: {joint: {name: S, prismatic: y, at: ground}, mass: 1}\n"
                           "loops: {rise: {constraint: \"q(S) - lift(q(A))\"}}\n"
                           "forces: {f: {joint: S, force: force(q(A))}}\n"
                           "sensors: {g: gauge(q(A))}\nrun: {outputs: [q, g]}\n",
                           sensor ? points[0] : points[k], sensor ? points[k] : points[0]);
            loaded l = load_text(text);
            CHECK(is_right(&l, kempe_kinematics_new(l.system, &ask, &r), k == 0 ? NULL : sensor ? "gauge" : "lift"));
            kempe_kinematics_free(r);
            unload(&l);
        }
}

static void in_sensors(void)
{
    for (int k = 0; k < 2; k++) {
        char text[1024];
        kempe_trajectory *t = NULL;
        kempe_equilibrium *e = NULL;
        static const kempe_sensitivity_options ways[] = {
            {.parameters = "c", .outputs = "sensor(g)", .method = "forward"},
            {.parameters = "c", .outputs = "sensor(g)", .method = "adjoint"},
            {.parameters = "c", .outputs = "sensor(g)", .integral = 1}};
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, -10]\nparameters: {c: 1000}\ntables: {gauge: {x: [-%g, 1], y: [0, "
                       "1], method: linear}}\n"
                       "bodies: {m: {joint: {name: S, prismatic: z, at: ground}, mass: 2}}\n"
                       "forces: {k: {joint: S, spring: {stiffness: c}}}\nsensors: {g: gauge(q(S))}\n"
                       "run: {t_end: 0.14, outputs: [g]}\n",
                       k ? 0.041 : 0.015);
        loaded l = load_text(text);
        CHECK(is_right(&l, kempe_simulate(l.system, NULL, &t), k ? NULL : "gauge"));
        CHECK(is_right(&l, kempe_equilibrium_new(l.system, NULL, &e), k ? NULL : "gauge"));
        for (size_t n = 0; n < sizeof ways / sizeof *ways; n++) {
            kempe_sensitivity *s = NULL;
            CHECK(is_right(&l, kempe_sensitivity_new(l.model, &ways[n], &s), k ? NULL : "gauge"));
            kempe_sensitivity_free(s);
        }
        kempe_trajectory_free(t);
        kempe_equilibrium_free(e);
        unload(&l);
    }
}

/* A table whose end ends a run does so for forces; a sensor that leaves it is not trustworthy, and the advice fits. */
static void in_a_sensor_of_a_table_with_an_error(void)
{
    loaded l = load_text("kempe: 1\ntables: {gauge: {x: [-1, 1], y: [0, 1], method: linear, outside: error}}\n"
                         "bodies: {m: {joint: {name: S, prismatic: z, at: ground}, mass: 2}}\n"
                         "start: {qd: {S: 1}}\nsensors: {g: gauge(q(S))}\nrun: {t_end: 1.5, outputs: [g]}\n");
    kempe_trajectory *t = NULL;
    CHECK(kempe_simulate(l.system, NULL, &t) == KEMPE_UNTRUSTED);
    char *said = kmp_context_warnings(l.context);
    CHECK(said && strstr(said, "table 'gauge' is used at ") && strstr(said, "use the table, not sensors") &&
          !strstr(said, "say outside"));
    kmp_free(said);
    kempe_trajectory_free(t);
    unload(&l);
}

/* A generated simulator does not watch sensors, and says so when it is made. */
static void in_generated_simulators(void)
{
    loaded l = load_text("kempe: 1\ntables: {gauge: {x: [-1, 1], y: [0, 1], method: linear}}\n"
                         "bodies: {m: {joint: {name: S, prismatic: z, at: ground}, mass: 2}}\n"
                         "sensors: {g: gauge(q(S))}\nrun: {t_end: 1, outputs: [g]}\n");
    const kempe_generate_options g = {.simulator = 1, .language = "c"};
    kempe_code *code = NULL;
    CHECK(kempe_code_new(l.model, &g, &code) == KEMPE_OK);
    char *said = kmp_context_warnings(l.context);
    CHECK(said && strstr(said, "table 'gauge': a generated simulator does not say when a sensor uses it"));
    kmp_free(said);
    kempe_code_free(code);
    unload(&l);
}

/* A workspace says it by its message, the first of many states. */
static void in_workspaces(void)
{
    loaded l = load_text(WEIGHT("x: [-0.01, 0, 0.01], y: [-10, 0, 10]"));
    kempe_workspace *w = NULL;
    const double inside = 0.005, beyond = -0.02, rate = 0, t = 0, q[] = {0.005, -0.02, 0.03, 0};
    double qdd, bias[4], none[4] = {0};
    const kempe_workspace_rows rows = {.bias = bias};
    CHECK(kempe_workspace_new(l.system, &w) == KEMPE_OK);
    CHECK(kempe_workspace_evaluate(w, 0, &beyond, &rate) == KEMPE_OK);
    CHECK(strstr(kempe_workspace_message(w), "table 'f' is used at -0.02, beyond its points -0.01 .. 0.01"));
    CHECK(kempe_workspace_evaluate(w, 0, &inside, &rate) == KEMPE_OK);
    CHECK_TEXT(kempe_workspace_message(w), "");
    CHECK(kempe_workspace_forward_dynamics(w, 0, &beyond, &rate, NULL, &qdd, NULL) == KEMPE_OK);
    CHECK(strstr(kempe_workspace_message(w), "is used at -0.02"));
    CHECK(kempe_workspace_evaluate_states(w, 4, &t, 0, q, none, &rows, NULL) == KEMPE_OK);
    CHECK(strstr(kempe_workspace_message(w), "is used at -0.02"));
    kempe_workspace_free(w);
    unload(&l);
}

/* A mass at 1 m/s leaves the table at 1 s. A state of before is trusted again; a doubt goes with one of afterwards. */
static void in_steppers(void)
{
    loaded l = load_text("kempe: 1\ntables: {f: {x: [-1, 1], y: [0, 0.1], method: linear}}\n"
                         "bodies: {m: {joint: {name: S, prismatic: z, at: ground}, mass: 1}}\n"
                         "forces: {k: {joint: S, force: 1e-9*f(q(S))}}\nstart: {qd: {S: 1}}\n");
    const kempe_run_options run = {.t_end = 10, .max_step = 0.1}; /* a longer one ends beyond */
    kempe_stepper *s = NULL, *copy = NULL;
    kempe_stepper_state *before = NULL, *after = NULL;
    CHECK(kempe_stepper_new(l.system, &run, &s) == KEMPE_OK && kempe_stepper_advance(s, 0.5) == KEMPE_OK);
    CHECK(kempe_stepper_save(s, &before) == KEMPE_OK);
    CHECK(kempe_stepper_outcome(s) == KEMPE_OUTCOME_NOT_CHECKED);
    CHECK(kempe_stepper_advance(s, 2) == KEMPE_OK);
    CHECK(kempe_stepper_outcome(s) == KEMPE_OUTCOME_NOT_TRUSTWORTHY);
    CHECK(kempe_stepper_advance(s, 3) == KEMPE_OK);
    CHECK(kempe_stepper_outcome(s) == KEMPE_OUTCOME_NOT_TRUSTWORTHY);
    CHECK(kempe_stepper_save(s, &after) == KEMPE_OK && kempe_stepper_copy(s, &copy) == KEMPE_OK);
    CHECK(kempe_stepper_outcome(copy) == KEMPE_OUTCOME_NOT_TRUSTWORTHY);
    CHECK(kempe_stepper_restore(s, before) == KEMPE_OK);
    CHECK(kempe_stepper_outcome(s) == KEMPE_OUTCOME_NOT_CHECKED);
    CHECK(kempe_stepper_restore(s, after) == KEMPE_OK);
    CHECK(kempe_stepper_outcome(s) == KEMPE_OUTCOME_NOT_TRUSTWORTHY);
    CHECK(kempe_stepper_reset(s) == KEMPE_OK);
    CHECK(kempe_stepper_outcome(s) == KEMPE_OUTCOME_NOT_CHECKED);
    kempe_stepper_state_free(before);
    kempe_stepper_state_free(after);
    kempe_stepper_free(copy);
    kempe_stepper_free(s);
    unload(&l);
}

int main(void)
{
    TEST(within_a_step);
    TEST(in_laws);
    TEST(in_inverse_dynamics);
    TEST(in_kinematics);
    TEST(in_sensors);
    TEST(in_a_sensor_of_a_table_with_an_error);
    TEST(in_generated_simulators);
    TEST(in_workspaces);
    TEST(in_steppers);
    return check_report();
}
