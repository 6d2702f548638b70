/* SPDX-License-Identifier: BSD-3-Clause */
/* Dry friction at rest: the states that it holds against closed forms, forces of elements that stick and their part of
 * the largest ones, small motions with places that friction keeps, and what is said where it takes no part. */
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/equilibrium.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static char said[1024]; /* the last warning */

static void listen(void *user, kempe_level level, const char *line)
{
    (void)user;
    if (level == KEMPE_LOG_WARNING)
        (void)snprintf(said, sizeof said, "%s", line);
}

static void expect_warnings(const loaded *l)
{
    said[0] = 0;
    kempe_context_set_log(l->context, listen, NULL);
}

static kempe_equilibrium *find(const loaded *l, kempe_equilibrium_options options)
{
    kempe_equilibrium *e = NULL;
    expect_warnings(l);
    kempe_status status = l->system ? kempe_equilibrium_new(l->system, &options, &e) : KEMPE_E_INPUT;
    CHECK(status == (strstr(said, "cannot hold") ? KEMPE_UNTRUSTED : KEMPE_OK));
    if (!e)
        printf("%s\n", kempe_context_message(l->context));
    return e;
}

/* The ends of a set, and why the set ends there. */
static void check_set(const kempe_equilibrium *e, int set, const char *element, const char *coordinate, double from,
                      double to, const char *word)
{
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "rest", &table) == KEMPE_OK);
    if (table && kempe_table_row_count(table) > 2 * set + 1) {
        int value = kempe_table_find(table, "value"), name = kempe_table_find(table, "element");
        CHECK_NEAR(kempe_table_number(table, 2 * set, value), from, 1e-11);
        CHECK_NEAR(kempe_table_number(table, 2 * set + 1, value), to, 1e-11);
        CHECK_TEXT(kempe_table_word(table, 2 * set, name), element);
        CHECK_TEXT(kempe_table_word(table, 2 * set, kempe_table_find(table, "coordinate")), coordinate);
        CHECK_TEXT(kempe_table_word(table, 2 * set, kempe_table_find(table, "end")), word);
    } else {
        CHECK(table && "the set is missing");
    }
    kempe_table_free(table);
}

static void check_force(const kempe_equilibrium *e, int element, double force, double largest)
{
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "friction", &table) == KEMPE_OK);
    CHECK(kempe_table_row_count(table) > element);
    CHECK_NEAR(kempe_table_number(table, element, kempe_table_find(table, "force")), force, 1e-11);
    CHECK_NEAR(kempe_table_number(table, element, kempe_table_find(table, "largest")), largest, 1e-11);
    CHECK_NEAR(kempe_table_number(table, element, kempe_table_find(table, "part")), fabs(force) / largest, 1e-11);
    kempe_table_free(table);
}

/* A slider-crank whose guide has friction by its load: rest sets around both equilibria. */
static void a_guide_holds_by_its_load(void)
{
    const double turn = 6.283185307179586, low = 0.92948255262117621, high = 1.96919572962099662;
    loaded l = load("tests/models/friction_guide.yaml");
    kempe_equilibrium *below = find(&l, (kempe_equilibrium_options){0});
    CHECK(strstr(said, "friction 'guide' is ignored here"));
    kempe_equilibrium *above = find(&l, (kempe_equilibrium_options){.newton = 1});
    check_set(above, 0, "guide", "th", low, high, "slips");
    check_set(below, 0, "guide", "th", 4.31398957755858986 - turn, 5.35370275455841027 - turn, "slips");
    kempe_equilibrium_free(above);
    kempe_equilibrium_free(below);
    unload(&l);
    l = load_set("tests/models/friction_guide.yaml", (const kempe_setting[]){{"th0", "7.667684321805424"}}, 1);
    kempe_equilibrium *stuck = find(&l, (kempe_equilibrium_options){.stick = 1});
    check_force(stuck, 0, -1.3884824831, 0.4 * 11.2723774361);
    check_set(stuck, 0, "guide", "th", low + turn, high + turn, "slips");
    CHECK(strstr(said, "friction") == NULL);
    kempe_equilibrium_free(stuck);
    unload(&l);
}

/* Two frictions on one freedom: held where 0.7848 |cos th| <= T + F |dx/dth|, whatever the split. */
static void two_frictions_hold_together(void)
{
    const double pi = 3.14159265358979323846, low = 0.50326835719772865888;
    loaded l = load("tests/models/friction_pair.yaml");
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){0});
    check_set(e, 0, "pivot", "th", -pi + 0.638825884256493717, -low, "slips");
    kempe_equilibrium_free(e);
    e = find(&l, (kempe_equilibrium_options){.stick = 1});
    CHECK(strstr(said, "this state is not an equilibrium, because friction cannot hold it: 'pivot' needs 0.730895 of"));
    CHECK(e && kempe_equilibrium_is_stable(e, 0) == 0);
    CHECK_TEXT(e ? kempe_equilibrium_stability(e, 0) : "", "not held");
    kempe_equilibrium_free(e);
    unload(&l);
}

/* A mass on a spring, and one without: its set has no ends. */
static void springs_are_held(void)
{
    loaded l = load("tests/models/friction_spring.yaml");
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){0});
    check_set(e, 0, "rub", "x", -0.03, 0.03, "slips");
    kempe_equilibrium_free(e);
    unload(&l);
    l = load_text("kempe: 1\n"
                  "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                  "forces: {pull: {joint: x, force: 2}, rub: {joint: x, friction: {force: 2.5, static: 4}}}\n");
    e = find(&l, (kempe_equilibrium_options){.stick = 1});
    check_force(e, 0, -2, 4);
    char *text = NULL;
    CHECK(e && kempe_equilibrium_print(e, KEMPE_TEXT, &text) == KEMPE_OK);
    const char *reactions = text ? strstr(text, "reaction") : NULL,
               *friction = text ? strstr(text, "\nfriction") : NULL;
    CHECK(text && strstr(text, "(and beyond)"));
    CHECK(reactions && friction && strstr(reactions, "rub") > friction); /* those of joints: friction has none */
    kempe_text_free(text);
    kempe_equilibrium_free(e);
    unload(&l);
}

static const char *const cart = "kempe: 1\n"
                                "gravity: [0, -9.81, 0]\n"
                                "parameters: {F: 3}\n"
                                "bodies:\n"
                                "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 2}\n"
                                "  bob: {joint: {name: th, revolute: z, at: cart}, mass: 1, com: [0, -0.5, 0]}\n"
                                "forces: {rub: {joint: x, friction: {force: F}}}\n";

/* The frequency of a pendulum on a cart that friction keeps at its place, and on one that is free. */
static void small_motions_leave_stuck_places(void)
{
    const struct {
        const char *level;
        double w;
    } at[] = {{"3", sqrt(9.81 / 0.5)}, {"0", sqrt(9.81 * 3 / (0.5 * 2))}};
    for (int k = 0; k < 2; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text, "%s", cart);
        memcpy(strstr(text, "F: 3") + 3, at[k].level, 1);
        loaded l = load_text(text);
        kempe_modes *modes = NULL;
        kempe_table *table = NULL;
        expect_warnings(&l);
        CHECK(kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK);
        CHECK(!strstr(said, "'rub' sticks at the state") == (k == 1));
        CHECK(modes && kempe_modes_table(modes, "modes", &table) == KEMPE_OK);
        int last = kempe_table_row_count(table) - 1;
        CHECK_NEAR(fabs(kempe_table_number(table, last, kempe_table_find(table, "im"))), at[k].w, 1e-12);
        kempe_table_free(table);
        kempe_modes_free(modes);
        unload(&l);
    }
}

/* A state that slips has its force, and the stiffness of a level that depends on the state. */
static void slip_counts_at_its_state(void)
{
    loaded l = load_text("kempe: 1\n"
                         "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {rub: {joint: x, friction: {force: 2 + 5*q(x)}}}\n"
                         "start: {qd: {x: 1}}\n");
    kempe_modes *modes = NULL;
    kempe_table *table = NULL;
    CHECK(kempe_modes_new(l.system, &(kempe_modes_options){.at = "start"}, &modes) == KEMPE_OK);
    CHECK(modes && kempe_modes_table(modes, "modes", &table) == KEMPE_OK);
    CHECK_NEAR(fabs(kempe_table_number(table, 0, kempe_table_find(table, "im"))), sqrt(5), 1e-14);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* `check` sees forces that are not finite at the start, also where it examines a model without its forces. */
#define ARM                                                                                                            \
    "kempe: 1\ngravity: [0, -10, 0]\nground: {points: {W: [0.5, 0.4, 0], V: [0.5, -0.9, 0]}}\n"                        \
    "bodies: {arm: {joint: {name: A, revolute: z, at: ground}, mass: 2, com: [0.3, 0, 0], inertia: {zz: 0.1}, "        \
    "points: {S: [0.4, 0.1, 0], T: [0.2, -0.1, 0]}}}\n"

static double of_table(const kempe_equilibrium *e, const char *name, const char *column)
{
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, name, &table) == KEMPE_OK);
    double value = kempe_table_number(table, 0, kempe_table_find(table, column));
    kempe_table_free(table);
    return value;
}

/* The reaction of the hinge of an arm, whose weight is 20 N, with forces along lines from W to S and from V to T. */
static void check_hinge(const kempe_equilibrium *e, double first, double second)
{
    const double angle = of_table(e, "equilibria", "q.A"), c = cos(angle), s = sin(angle);
    const double a[2] = {0.4 * c - 0.1 * s - 0.5, 0.4 * s + 0.1 * c - 0.4};
    const double b[2] = {0.2 * c + 0.1 * s - 0.5, 0.2 * s - 0.1 * c + 0.9};
    const char *const columns[] = {"force.x", "force.y"};
    for (int k = 0; k < 2; k++) {
        double force = first * a[k] / hypot(a[0], a[1]) + second * b[k] / hypot(b[0], b[1]);
        CHECK_NEAR(of_table(e, "reactions", columns[k]), (k ? 20 : 0) - force, 1e-11);
    }
}

/* Joints carry friction: of elements that share a load at rest, and of one whose surfaces slide as time passes, which
 * holds no set of states. */
static void joints_carry_friction(void)
{
    loaded l = load_text(ARM "forces:\n"
                             "  one: {sliding: 'distance(arm.S, ground.W)', friction: {force: 50}}\n"
                             "  two: {sliding: 'distance(arm.T, ground.V)', friction: {force: 30}}\n");
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){.stick = 1});
    const double one = of_table(e, "equilibria", "lambda.one.1"), two = of_table(e, "equilibria", "lambda.two.1");
    CHECK(one < -1 && two > 1);
    check_force(e, 0, one, 50);
    check_force(e, 1, two, 30);
    check_hinge(e, one, two);
    kempe_equilibrium_free(e);
    unload(&l);
    l = load_text(ARM "forces:\n"
                      "  one: {sliding: 'distance(arm.S, ground.W) + 0.5*t', friction: {force: 5}}\n"
                      "  spring: {joint: A, torque: -20*q(A)}\n");
    for (int stick = 0; stick < 2; stick++) {
        kempe_table *rest = NULL;
        e = find(&l, (kempe_equilibrium_options){.stick = stick});
        CHECK_NEAR(of_table(e, "equilibria", "q.A"), -0.19518783339026627, 1e-12); /* by SciPy */
        CHECK_NEAR(of_table(e, "equilibria", "lambda.one.1"), -5, 1e-14);
        check_hinge(e, -5, 0);
        CHECK(kempe_equilibrium_table(e, "rest", &rest) == KEMPE_OK && kempe_table_row_count(rest) == 0);
        kempe_table_free(rest);
        kempe_equilibrium_free(e);
    }
    unload(&l);
}

static void check_sees_forces(void)
{
    const char *const also[] = {"", "  rub: {joint: x, friction: {force: 3}}\n"};
    for (int k = 0; k < 2; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\n"
                       "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                       "forces:\n  pull: {joint: x, force: \"sqrt(-1 - q(x)^2)*(1 N)\"}\n%s",
                       also[k]);
        loaded l = load_text(text);
        kempe_check *check = NULL;
        expect_warnings(&l);
        CHECK(kempe_check_new(l.system, &check) == KEMPE_OK);
        CHECK(strstr(said, "the forces on 'x' are not a finite number"));
        kempe_check_free(check);
        unload(&l);
    }
}

int main(void)
{
    TEST(a_guide_holds_by_its_load);
    TEST(two_frictions_hold_together);
    TEST(springs_are_held);
    TEST(small_motions_leave_stuck_places);
    TEST(slip_counts_at_its_state);
    TEST(joints_carry_friction);
    TEST(check_sees_forces);
    return check_report();
}
