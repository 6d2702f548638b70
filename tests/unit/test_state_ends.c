/* SPDX-License-Identifier: BSD-3-Clause */
/* States at which a run would end, by a condition of the model: each study says so by name. */
#include "base/context.h"
#include "base/memory.h"
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/equilibrium.h>
#include <kempe/inverse.h>
#include <kempe/kinematics.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>
#include <kempe/workspace.h>
#include <string.h>

/* True if the status of a study is the expected one, and the condition is named where it is broken; NULL: it is not. */
static bool is_right(const loaded *l, kempe_status status, const char *broken)
{
    char *said = kmp_context_warnings(l->context);
    const bool right = broken ? status == KEMPE_UNTRUSTED && said && strstr(said, "a run would end at this state") &&
                                    strstr(said, broken)
                              : status == KEMPE_OK && said && !said[0];
    if (!right)
        printf("status %d: %s\n", status, said ? said : "");
    kmp_free(said);
    return right;
}

/* A weight m g on a spring of 100 N/m by a table to 0.1 m, which is at rest at -m g/100. */
#define SPRING(m, start)                                                                                               \
    "kempe: 1\ngravity: [0, 0, -10]\nparameters: {m: " m "}\n"                                                         \
    "tables: {spring: {x: [-0.1, 0, 0.1], y: [10, 0, -10], method: linear, outside: error}}\n"                         \
    "bodies: {b: {joint: {name: z, prismatic: z, at: ground}, mass: m}}\n"                                             \
    "forces: {f: {joint: z, force: spring(q(z)) - qd(z)}}\nstart: {q: {z: " start "}}\nrun: {t_end: 0.1}\n"

#define BEYOND "'f': spring(q(z)) beyond the points -0.1 .. 0.1"

static void at_rest(void)
{
    for (int k = 0; k < 2; k++) {
        loaded l = load_text(k ? SPRING("0.9", "0") : SPRING("1.1", "0"));
        const char *broken = k ? NULL : BEYOND;
        const kempe_linearize_options linearize = {.inputs = "effort(z)", .outputs = "q(z)"};
        const kempe_response_options response = {.inputs = "effort(z)", .frequencies = "0.1:0.2:2", .linear = true};
        const kempe_sensitivity_options slopes = {.of = "equilibrium", .parameters = "m"};
        kempe_equilibrium *e = NULL;
        kempe_modes *m = NULL;
        kempe_linearization *x = NULL;
        kempe_response *r = NULL;
        kempe_sensitivity *s = NULL;
        CHECK(is_right(&l, kempe_equilibrium_new(l.system, NULL, &e), broken));
        CHECK(is_right(&l, kempe_modes_new(l.system, NULL, &m), broken));
        CHECK(is_right(&l, kempe_linearization_new(l.system, &linearize, &x), broken));
        CHECK(is_right(&l, kempe_response_new(l.system, &response, &r), broken));
        CHECK(is_right(&l, kempe_sensitivity_new(l.model, &slopes, &s), broken));
        kempe_equilibrium_free(e);
        kempe_modes_free(m);
        kempe_linearization_free(x);
        kempe_response_free(r);
        kempe_sensitivity_free(s);
        unload(&l);
    }
}

/* Followed over a parameter: with 1 kg the equilibrium is at the end of the table. */
static void over_a_parameter(void)
{
    for (int k = 0; k < 2; k++) {
        loaded l = load_text(SPRING("0.5", "0"));
        const kempe_modes_options sweep = {.sweep = k ? "m=0.5:0.99:5" : "m=0.5:1.01:5"};
        kempe_modes *m = NULL;
        CHECK(is_right(&l, kempe_modes_new(l.system, &sweep, &m), k ? NULL : BEYOND));
        kempe_modes_free(m);
        unload(&l);
    }
}

static void at_the_start(void)
{
    for (int k = 0; k < 2; k++) {
        loaded l = load_text(k ? SPRING("1", "0.09") : SPRING("1", "0.11"));
        const char *broken = k ? NULL : BEYOND;
        const kempe_inverse_options inverse = {.actuators = "z"};
        const kempe_linearize_options linearize = {.inputs = "effort(z)", .outputs = "q(z)", .at = "start"};
        kempe_check *c = NULL;
        kempe_assembly *a = NULL;
        kempe_inverse *i = NULL;
        kempe_linearization *x = NULL;
        kempe_workspace *w = NULL;
        char *text = NULL;
        const double q = k ? 0.09 : 0.11, qd = 0;
        CHECK(is_right(&l, kempe_check_new(l.system, &c), broken));
        CHECK(kempe_check_print(c, KEMPE_TEXT, &text) == KEMPE_OK);
        CHECK(text && !strstr(text, "cannot be simulated from its start") == !broken);
        kempe_text_free(text);
        CHECK(is_right(&l, kempe_assembly_new(l.system, &a), broken));
        CHECK(kempe_assembly_print(a, KEMPE_TEXT, &text) == KEMPE_OK);
        CHECK(text && !strstr(text, "'f': spring(q(z))") == !broken && !strstr(text, "not trustworthy") == !broken);
        kempe_text_free(text);
        CHECK(is_right(&l, kempe_inverse_new(l.system, &inverse, &i), broken));
        CHECK(is_right(&l, kempe_linearization_new(l.system, &linearize, &x), broken));
        CHECK(kempe_workspace_new(l.system, &w) == KEMPE_OK && kempe_workspace_evaluate(w, 0, &q, &qd) == KEMPE_OK);
        CHECK(!strstr(kempe_workspace_message(w), BEYOND) == !broken);
        kempe_check_free(c);
        kempe_assembly_free(a);
        kempe_inverse_free(i);
        kempe_linearization_free(x);
        kempe_workspace_free(w);
        unload(&l);
    }
}

/* Also in a model with friction, whose diagnosis is made without forces. */
static void at_the_start_with_friction(void)
{
    loaded l = load_text("kempe: 1\ntables: {spring: {x: [-0.1, 0.1], y: [10, -10], method: linear, outside: error}}\n"
                         "bodies: {b: {joint: {name: z, prismatic: z, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: z, force: spring(q(z))}, rub: {joint: z, friction: {force: 1}}}\n"
                         "start: {q: {z: 0.11}}\n");
    kempe_check *c = NULL;
    CHECK(is_right(&l, kempe_check_new(l.system, &c), BEYOND));
    kempe_check_free(c);
    unload(&l);
}

/* Conditions of elements, at an equilibrium with and without them. */
static void of_elements(void)
{
    static const struct {
        const char *name, *text, *within, *beyond, *broken;
    } cases[] = {
        /* A string of a drum that is turned by 3.12 rad. */
        {"rope",
         "ground: {points: {O: [0, 0, 0]}}\nbodies:\n"
         "  arm: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.1}, points: {P: [0.3, 0, 0]}}\n"
         "ropes: {s: {along: [{drum: ground.O, radius: 0.05, turn: right}, arm.P], stiffness: 1e-3}}\n"
         "forces: {motor: {joint: A, torque: 100*(T - q(A)) - 2*qd(A)}}\n",
         "3.08", "3.12", "rope 's' has turned by 3.1 rad about 'ground.O' since the start"},
        /* A journal of 1 kg in a bearing of 1 mm clearance and 1 kN/m: ten clearances are 9 mm of depth. */
        {"journal",
         "gravity: [0, -10, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
         "  shaft: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: T, points: {C: [0, 0, 0]}}\n"
         "contacts: {b: {journal: [ground.O, shaft.C], clearance: 1 mm, law: kelvin_voigt, stiffness: 1000, damping: "
         "1}}\nforces: {f: {joint: x, force: -qd(x) - q(x)}}\n",
         "0.89", "0.91", "the journal of 'b' is not in its bearing"},
        /* A disc of 20 mm on a bar of 100 mm: 0.45 of the solid behind its centre is 63 mm of depth, by 1 kg on 159
         * N/m.
         */
        {"outline",
         "gravity: [0, -10, 0]\nground: {points: {O: [0, 0, 0]}}\noutlines: {bar: {rectangle: [1, 0.1]}}\nbodies:\n"
         "  disc: {joint: {name: y, prismatic: y, at: ground.O}, mass: 1, points: {C: [0, 0, 0]}}\n"
         "contacts: {foot: {cylinder: disc.C, radius: 20 mm, on: {outline: bar, at: ground.O}, law: kelvin_voigt, "
         "stiffness: T, damping: 10}}\nstart: {q: {y: 0.0705}}\n",
         "160", "150", "is inside the solid by half of its thickness"}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++)
        for (int k = 0; k < 2; k++) {
            char text[1024];
            (void)snprintf(text, sizeof text, "kempe: 1\nparameters: {T: %s}\n%s",
                           k ? cases[c].beyond : cases[c].within, cases[c].text);
            loaded l = load_text(text);
            kempe_equilibrium *e = NULL;
            kempe_modes *m = NULL;
            CHECK(is_right(&l, kempe_equilibrium_new(l.system, NULL, &e), k ? cases[c].broken : NULL));
            CHECK(is_right(&l, kempe_modes_new(l.system, NULL, &m), k ? cases[c].broken : NULL));
            kempe_equilibrium_free(e);
            kempe_modes_free(m);
            unload(&l);
        }
}

/* Positions need conditions of closures and of paths, not those of forces. */
static void in_kinematics(void)
{
    static const struct {
        const char *sweep, *broken;
    } cases[] = {{"A=0:0.9:4", NULL}, {"A=0:1.1:4", "lift(q(A)) beyond the points -1 .. 1"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = load_text(
            "kempe: 1\ntables: {lift: {x: [-1, 1], y: [0, 1], method: linear, outside: error}, force: {x: [0, 0.1], y: "
            "[0, 1], method: linear, outside: error}}\n"
            "bodies:\n  cam: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"
            "  follower: {joint: {name: S, prismatic: y, at: ground}, mass: 1}\n"
            "loops: {rise: {constraint: \"q(S) - lift(q(A))\"}}\nforces: {f: {joint: S, force: force(q(A))}}\n");
        const kempe_kinematics_options ask = {.sweep = cases[k].sweep};
        kempe_kinematics *r = NULL;
        CHECK(is_right(&l, kempe_kinematics_new(l.system, &ask, &r), cases[k].broken));
        kempe_kinematics_free(r);
        unload(&l);
    }
}

/* A condition by which the user ends runs is not a fault of a state. */
static void until_is_not_a_fault(void)
{
    loaded l =
        load_text("kempe: 1\ngravity: [0, 0, -10]\nbodies: {b: {joint: {name: z, prismatic: z, at: ground}, mass: "
                  "1}}\nforces: {k: {joint: z, spring: {stiffness: 100}}}\nrun: {until: \"q(z) < 0.5\"}\n");
    kempe_equilibrium *e = NULL;
    kempe_check *c = NULL;
    CHECK(is_right(&l, kempe_equilibrium_new(l.system, NULL, &e), NULL));
    CHECK(is_right(&l, kempe_check_new(l.system, &c), NULL));
    kempe_equilibrium_free(e);
    kempe_check_free(c);
    unload(&l);
}

/* The force is zero at 0, and beyond the table at 0.3: a search from random starts has only the first. */
static void from_random_starts(void)
{
    loaded l = load_text("kempe: 1\ntables: {f: {x: [-0.1, 0, 0.1, 0.2], y: [1, 0, -1, -0.5], method: linear, outside: "
                         "error}}\nbodies: {b: {joint: {name: z, prismatic: z, at: ground}, mass: 1}}\n"
                         "forces: {f: {joint: z, force: f(q(z)) - qd(z)}}\n");
    const kempe_equilibrium_options ask = {.global = 1};
    kempe_equilibrium *e = NULL;
    char *text = NULL;
    CHECK(is_right(&l, kempe_equilibrium_new(l.system, &ask, &e), NULL));
    CHECK(kempe_equilibrium_count(e) == 1);
    CHECK(kempe_equilibrium_print(e, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "left out, because a run ends at such states"));
    kempe_text_free(text);
    kempe_equilibrium_free(e);
    unload(&l);
}

int main(void)
{
    TEST(at_rest);
    TEST(over_a_parameter);
    TEST(at_the_start);
    TEST(at_the_start_with_friction);
    TEST(of_elements);
    TEST(in_kinematics);
    TEST(until_is_not_a_fault);
    TEST(from_random_starts);
    return check_report();
}
