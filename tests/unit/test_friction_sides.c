/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction whose levels depend on the direction, and friction without a limit in one direction: closed forms on every
 * formulation, derivatives, and what is refused. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "ways.h"
#include <kempe/sensitivity.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A block on a spring, pulled by 20 N to one side. Each swing ends at the other side of the point where the spring has
 * the force of its level: from 1 m by 2 N to -0.8, by 0.5 N to 0.75, by 2 N to -0.55. It takes pi/sqrt(k/m). */
static void test_swings(void)
{
    loaded l =
        load_text("kempe: 1\ngravity: [0, 0, 0]\n"
                  "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 2}}\n"
                  "forces: {k: {joint: a, spring: {stiffness: 20}}, f: {joint: a, friction: {force: [0.5, 2]}}}\n"
                  "start: {q: {a: 1}}\nrun: {t_end: 5}\n");
    const double swing = acos(-1) / sqrt(10), ends[] = {-0.8, 0.75, -0.55};
    for (int k = 0; k < WAYS; k++)
        for (int n = 0; n < 3; n++) {
            kempe_trajectory *run = simulate(&l, &ways[k], (n + 1) * swing);
            if (!run)
                continue;
            const kmp_log_entry *turn = entry(run, "friction", n);
            CHECK_NEAR(last_q(run)[0], ends[n], ways[k].tolerance);
            CHECK(turn != NULL);
            if (turn)
                CHECK_NEAR(turn->t, n * swing, 10 * ways[k].tolerance);
            CHECK(run->verdict.drift_rel < 1e-5);
            kempe_trajectory_free(run);
        }
    unload(&l);
}

/* A rope over a post that does not turn: both of its ends carry a mass, and the tension on one side is at most exp(mu
 * angle) times the tension on the other one. Eytelwein's factor is 1.874456 here. */
static void rope(const char *mass, double expected, const char *said)
{
    char text[700];
    (void)snprintf(
        text, sizeof text,
        "kempe: 1\ngravity: [9.81, 0, 0]\nparameters: {m: %s, E: exp(0.2*pi)}\n"
        "bodies:\n  a: {joint: {prismatic: x, at: ground}, mass: m}\n"
        "  b: {joint: {prismatic: x, at: ground}, mass: 1}\n"
        "loops: {rope: {coupler: {a: 1, b: 1}}}\n"
        "forces: {post: {joint: a, friction: {force: [\"abs(lambda(rope))*(E - 1)\", \"abs(lambda(rope))*(1 - "
        "1/E)\"]}}}\n"
        "start: {q: {a: 0}, qd: {a: 0}}\nrun: {t_end: 1}\n",
        mass);
    loaded l = load_text(text);
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 1);
        if (!run)
            continue;
        CHECK_NEAR(last_q(run)[0], expected / 2, ways[k].tolerance);
        CHECK_TEXT(entry(run, "friction", 0) ? entry(run, "friction", 0)->text : "none", said);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

static void test_ropes_on_posts(void)
{
    const double e = exp(0.2 * acos(-1));
    CHECK_NEAR(e, 1.874456, 1e-6);
    rope("1.8744", 0, "'post' sticks");
    rope("1.8745", 9.81 * (1.8745 - e) / (1.8745 + e), "'post' slips forward");
    rope("2.5", 9.81 * (2.5 - e) / (2.5 + e), "'post' slips forward");
    rope("0.5335", 0, "'post' sticks");
    rope("0.4", -9.81 * (1 - 0.4 * e) / (1 + 0.4 * e), "'post' slips backward");
}

/* A wheel drives another one by a one-way clutch that drags with 0.2 N m. While its torque 5 sin(t) accelerates both
 * they turn as one; then the second wheel runs on, slowed down by the drag alone. */
static void clutch(const char *sliding, const char *levels, double side)
{
    char text[500];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ngravity: [0, 0, 0]\n"
                   "bodies:\n  in: {joint: {name: a, revolute: z, at: ground}, mass: 1, inertia: {zz: 2}}\n"
                   "  out: {joint: {name: b, revolute: z, at: ground}, mass: 1, inertia: {zz: 3}}\n"
                   "forces:\n  w: {sliding: %s, friction: {torque: %s}}\n  m: {joint: a, torque: 5*sin(t)}\n"
                   "run: {t_end: 5, outputs: [force(w)]}\n",
                   sliding, levels);
    loaded l = load_text(text);
    const double off = acos(-1) + asin(0.2 / 3), since = 5 - off;
    const double fast = 1 - cos(off), a = fast + 0.1 * since + 2.5 * (cos(off) - cos(5)), b = fast - 0.2 / 3 * since;
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 5);
        if (!run)
            continue;
        CHECK_NEAR(last_qd(run)[0], a, ways[k].tolerance);
        CHECK_NEAR(last_qd(run)[1], b, ways[k].tolerance);
        const kmp_log_entry *lets = entry(run, "friction", 1);
        CHECK(lets != NULL);
        if (lets)
            CHECK_NEAR(lets->t, off, 10 * ways[k].tolerance);
        if (lets)
            CHECK_TEXT(lets->text, side > 0 ? "'w' slips forward" : "'w' slips backward");
        kempe_trajectory_free(run);
    }
    unload(&l);
}

static void test_one_way_clutches(void)
{
    clutch("q(b) - q(a)", "[0.2, unlimited]", 1);
    clutch("q(a) - q(b)", "[unlimited, 0.2]", -1);
    clutch("q(b) - q(a)", "[0.2, unlimited], static: 0.2", 1);
}

/* A sledge of 1 kg strikes another one of 3 kg, or a stop, at 2 m/s with restitution 0.5. The second one is free, or a
 * pawl holds it; or the first one has a pawl, which does not let it rebound. Against the stop the impact is then
 * plastic. */
static void rack(const char *friction, const char *contact, double first, double second, const char *said)
{
    char text[700];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ngravity: [0, 0, 0]\n"
                   "bodies:\n  a: {joint: {prismatic: x, at: ground}, mass: 1}\n"
                   "  b: {joint: {prismatic: x, at: ground}, mass: 3}\n"
                   "forces: {pawl: {joint: %s}}\ncontacts: {c: {%s, restitution: 0.5}}\n"
                   "start: {q: {a: 0, b: 1}, qd: {a: 2, b: 0}}\nrun: {t_end: 1.5}\n",
                   friction, contact);
    loaded l = load_text(text);
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 1.5);
        if (!run)
            continue;
        CHECK_NEAR(last_q(run)[0], 1 + first, ways[k].tolerance);
        CHECK_NEAR(last_qd(run)[0], first, ways[k].tolerance);
        CHECK_NEAR(last_q(run)[1], 1 + second, ways[k].tolerance);
        CHECK_NEAR(last_qd(run)[1], second, ways[k].tolerance);
        CHECK((entry(run, "restitution", 0) != NULL) == (strstr(contact, "upper") != NULL));
        CHECK_TEXT(entry(run, "impact", 0) ? entry(run, "impact", 0)->text : "none", said);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

static void test_impacts(void)
{
    const char *pair = "gap: q(b) - q(a)", *stop = "joint: a, upper: 1";
    rack("b, friction: {force: [0, unlimited]}", pair, -0.25, 0.75,
         "'c' struck at 2 m/s: kinetic energy falls by 1.125 of 2 J");
    rack("b, friction: {force: [unlimited, 0]}", pair, -1, 0,
         "'c' struck at 2 m/s, 'pawl' held: kinetic energy falls by 1.5 of 2 J");
    rack("a, friction: {force: [0, unlimited]}", pair, 0, 1,
         "'c' struck at 2 m/s, 'pawl' held: kinetic energy falls by 0.5 of 2 J");
    rack("a, friction: {force: [0, unlimited]}", stop, 0, 0, "'c' struck at 2 m/s: kinetic energy falls by 2 of 2 J");
}

/* The sledge that leaves an impact with a pawl has moved by e (V t - 1). */
static void derivatives_of_rack(const char *friction, const char *output, double sign, const char *method)
{
    char text[700];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ngravity: [0, 0, 0]\nparameters: {e: 0.5, V: 2, m: 1}\n"
                   "bodies:\n  a: {joint: {prismatic: x, at: ground}, mass: m}\n"
                   "  b: {joint: {prismatic: x, at: ground}, mass: 3}\n"
                   "forces: {pawl: {joint: %s}}\ncontacts: {c: {gap: q(b) - q(a), restitution: e}}\n"
                   "start: {q: {a: 0, b: 1}, qd: {a: V, b: 0}}\nrun: {t_end: 1.5}\n",
                   friction);
    loaded l = load_text(text);
    kempe_run_options run = {.t_end = 1.5, .rtol = 1e-10, .no_convergence_check = 1};
    const kempe_sensitivity_options options = {.outputs = output, .parameters = "e,V,m", .method = method, .run = &run};
    kempe_sensitivity *s = NULL;
    CHECK(kempe_sensitivity_new(l.model, &options, &s) == KEMPE_OK);
    if (!s)
        printf("%s\n", kempe_context_message(l.context));
    const double expected[] = {2, 0.75, 0};
    for (int k = 0; s && k < 3; k++)
        CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, 0, k), sign * expected[k], 1e-8);
    kempe_sensitivity_free(s);
    unload(&l);
}

static void test_derivatives_of_impacts(void)
{
    const char *methods[] = {"forward", "adjoint"};
    for (int k = 0; k < 2; k++) {
        derivatives_of_rack("a, friction: {force: [0, unlimited]}", "q(b)", 1, methods[k]);
        derivatives_of_rack("b, friction: {force: [unlimited, 0]}", "q(a)", -1, methods[k]);
    }
}

/* A linkage whose friction has two equal levels moves as with one. */
static void test_equal_levels(void)
{
    double end[2][2];
    for (int n = 0; n < 2; n++) {
        char text[600];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\nparameters: {T: 0.3}\nground: {points: {O: [0, 0, 0], P: [1, 0, 0]}}\n"
            "bodies:\n  a: {joint: {revolute: z, at: ground.O}, mass: 1, com: [0.2, 0, 0], points: {E: [0.4, 0, 0]}}\n"
            "  b: {joint: {revolute: z, at: a.E}, mass: 1, com: [0.4, 0, 0], points: {E: [0.9, 0, 0]}}\n"
            "  c: {joint: {revolute: z, at: ground.P}, mass: 1, com: [0.3, 0, 0], points: {E: [0.7, 0, 0]}}\n"
            "loops: {C: {ball: [b.E, c.E]}}\n"
            "forces: {f: {joint: a, friction: {torque: %s}}}\nstart: {q: {a: 1}, qd: {a: 3}}\nrun: {t_end: 3}\n",
            n ? "[T, T], static: [0.4, 0.4]" : "T, static: 0.4");
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[1], 3);
        for (int k = 0; run && k < 2; k++)
            end[n][k] = last_q(run)[k];
        kempe_trajectory_free(run);
        unload(&l);
    }
    CHECK_NEAR(end[0][0], end[1][0], 1e-13);
    CHECK_NEAR(end[0][1], end[1][1], 1e-13);
}

/* Swings end at -1 + 2 B/k, 1 - 2 B/k - 2 A/k .. */
static void derivatives(const char *method)
{
    const double swing = acos(-1) / sqrt(10);
    loaded l = load_text("kempe: 1\ngravity: [0, 0, 0]\nparameters: {A: 0.5, B: 2}\n"
                         "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 2}}\n"
                         "forces: {k: {joint: a, spring: {stiffness: 20}}, f: {joint: a, friction: {force: [A, B]}}}\n"
                         "start: {q: {a: 1}}\nrun: {t_end: 5}\n");
    kempe_run_options run = {.t_end = 2.5 * swing, .rtol = 1e-10, .no_convergence_check = 1};
    const kempe_sensitivity_options options = {.outputs = "q(a)", .parameters = "A,B", .method = method, .run = &run};
    kempe_sensitivity *s = NULL;
    CHECK(kempe_sensitivity_new(l.model, &options, &s) == KEMPE_OK);
    if (!s)
        printf("%s\n", kempe_context_message(l.context));
    const int row = s ? s->rows - 1 : -1;
    if (row >= 0) { /* half a swing after 0.75 = 1 - (2 A + 2 B)/k: at B/k */
        CHECK_NEAR(kmp_sensitivity_value(s, row, 0), 0.1, 1e-8);
        CHECK_NEAR(kmp_sensitivity_slope(s, row, 0, 0), 0, 1e-7);
        CHECK_NEAR(kmp_sensitivity_slope(s, row, 0, 1), 0.05, 1e-7);
    }
    kempe_sensitivity_free(s);
    unload(&l);
}

static void test_derivatives(void)
{
    derivatives("forward");
    derivatives("adjoint");
}

static void refused(const char *friction, const char *expected)
{
    char text[400];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 2}}\n"
                   "forces: {f: {joint: a, friction: {%s}}}\nstart: {qd: {a: -1}}\nrun: {t_end: 1}\n",
                   friction);
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *run = NULL;
    kempe_status status = kempe_model_read_text(context, text, "model.yaml", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    if (status == KEMPE_OK)
        status = kempe_simulate(system, NULL, &run);
    CHECK(status == KEMPE_E_INPUT || status == KEMPE_E_FAILED);
    const char *said = run ? kempe_trajectory_reason(run) : kempe_context_message(context);
    if (!strstr(said, expected))
        printf("%s\n", said);
    CHECK(strstr(said, expected));
    kempe_trajectory_free(run);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void test_refusals(void)
{
    refused("force: [1, 2, 3]", "a list has two levels: against positive rates, and against negative ones");
    refused("force: [unlimited, unlimited]", "only one direction may be unlimited; use a lock");
    refused("force: [1, -2]", "is -2: it must not be negative");
    refused("force: [1, 2 N*m]", "expected N, got N*m");
    refused("force: [1, 2], static: [unlimited, 3]", "a static level has a limit");
    refused("force: [1, 2], speed: 0.1", "has one level for both directions, because it does not stick");
    refused("force: [1, unlimited], regularise: 0.1", "unlimited friction cannot be regularised");
    refused("force: [1, unlimited]", "friction 'f' is unlimited against negative rates, but its rate is -1 at t = 0 s");
}

int main(void)
{
    TEST(test_swings);
    TEST(test_ropes_on_posts);
    TEST(test_one_way_clutches);
    TEST(test_impacts);
    TEST(test_derivatives_of_impacts);
    TEST(test_equal_levels);
    TEST(test_derivatives);
    TEST(test_refusals);
    return check_report();
}
