/* SPDX-License-Identifier: BSD-3-Clause */
/* Rigid contacts at rest: forces and distances of equilibria against statics, the contacts that press among several,
 * states that friction of contacts holds, small motions with closed contacts, and what is refused. */
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/equilibrium.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define G 9.81

static char said[2048]; /* the warnings */

static void listen(void *user, kempe_level level, const char *line)
{
    (void)user;
    size_t length = strlen(said);
    if (level == KEMPE_LOG_WARNING)
        (void)snprintf(said + length, sizeof said - length, "%s\n", line);
}

static kempe_equilibrium *find(const loaded *l, kempe_equilibrium_options options)
{
    kempe_equilibrium *e = NULL;
    said[0] = 0;
    kempe_context_set_log(l->context, listen, NULL);
    CHECK(l->system && kempe_equilibrium_new(l->system, &options, &e) == KEMPE_OK);
    if (!e)
        printf("%s\n", kempe_context_message(l->context));
    return e;
}

/* The value of a column of a table of the result, in a row. */
static double value_at(const kempe_equilibrium *e, const char *table_name, const char *column, int row)
{
    kempe_table *table = NULL;
    double value = NAN;
    if (e && kempe_equilibrium_table(e, table_name, &table) == KEMPE_OK && kempe_table_find(table, column) >= 0 &&
        row < kempe_table_row_count(table))
        value = kempe_table_number(table, row, kempe_table_find(table, column));
    kempe_table_free(table);
    return value;
}

static void check_contact(const kempe_equilibrium *e, int row, double gap, double force, const char *word)
{
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "contacts", &table) == KEMPE_OK);
    if (table && row < kempe_table_row_count(table))
        CHECK_TEXT(kempe_table_word(table, row, kempe_table_find(table, "word")), word);
    kempe_table_free(table);
    CHECK_NEAR(value_at(e, "contacts", "gap", row), gap, 1e-11);
    CHECK_NEAR(value_at(e, "contacts", "force", row), force, 1e-10);
}

#define PLANE "ground: {points: {O: [0, 0, 0]}}\n"
#define DOWN  "kempe: 1\ngravity: [0, -9.81, 0]\n"

/* A ball falls on the floor; it is held there by its weight and a load, whose size follows from a force of the floor.
 */
static void a_ball_comes_to_rest(void)
{
    loaded l = load_text(DOWN PLANE "parameters: {F: 1}\n"
                                    "bodies: {ball: {joint: {name: y, prismatic: y, at: ground}, mass: 2, points: {C: "
                                    "[0, 0, 0]}}}\n"
                                    "forces: {load: {joint: y, force: \"-(1 N)*F\"}}\n"
                                    "contacts: {floor: {sphere: ball.C, radius: 0.1, on: {plane: ground.O, normal: y}, "
                                    "restitution: 0.8}}\n"
                                    "start: {q: {y: 3}}\n");
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){0});
    check_contact(e, 0, 0, 2 * G + 1, "presses");
    CHECK_NEAR(value_at(e, "equilibria", "q.y", 0), 0.1, 1e-14);
    CHECK(e && strcmp(kempe_equilibrium_stability(e, 0), "stable") == 0);
    kempe_equilibrium_free(e);
    e = find(&l, (kempe_equilibrium_options){.target = "force(floor)=30", .solve_for = "F"});
    CHECK_NEAR(value_at(e, "equilibria", "F", 0), 30 - 2 * G, 1e-10);
    kempe_equilibrium_free(e);
    unload(&l);
}

#define BOX(com, feet, start)                                                                                          \
    DOWN PLANE "bodies:\n"                                                                                             \
               "  box: {joint: {name: b, planar: z, at: ground}, mass: 3, com: [" com ", 0, 0], inertia: {zz: 0.2}, "  \
               "points: {L: [-0.5, -0.2, 0], M: [0.1, -0.2, 0], R: [0.5, -0.2, 0]}}\n"                                 \
               "contacts:\n" feet "start: {q: {" start "}}\n"

#define FOOT(name, more)                                                                                               \
    "  " #name ": {point: box." #name ", on: {plane: ground.O, normal: y}, restitution: 0" more "}\n"

/* A box falls with a slope on two feet, one of them rough, and a spring holds it along the floor. */
static void a_box_on_two_feet(void)
{
    loaded l = load_text(BOX("0.1", FOOT(L, ", friction: 0.4") FOOT(R, ""),
                             "b.1: 0.05, b.2: 1, b.3: 0.3") "forces: {k: {joint: b.1, spring: {stiffness: 100}}}\n");
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){0});
    check_contact(e, 0, 0, 3 * G * 0.4, "presses");
    check_contact(e, 1, 0, 3 * G * 0.6, "presses");
    CHECK(strstr(said, "'L_friction' is ignored here"));
    /* the spring pulls above the floor: the rough foot carries 11.772 N + (20 N/m) x */
    CHECK_NEAR(value_at(e, "rest", "value", 0), -4.7088 / 108, 1e-11);
    CHECK_NEAR(value_at(e, "rest", "value", 1), 4.7088 / 92, 1e-11);
    kempe_equilibrium_free(e);
    unload(&l);
    l = load_text(BOX("0.1", FOOT(L, ", friction: 0.4") FOOT(R, ""),
                      "b.1: 0.05, b.2: 0.2") "forces: {k: {joint: b.1, spring: {stiffness: 100}}}\n");
    e = find(&l, (kempe_equilibrium_options){.stick = 1});
    check_contact(e, 0, 0, 12.772, "presses");
    check_contact(e, 1, 0, 3 * G - 12.772, "presses");
    CHECK_NEAR(value_at(e, "friction", "force", 0), 5, 1e-10);
    CHECK_NEAR(value_at(e, "friction", "largest", 0), 0.4 * 12.772, 1e-10);
    CHECK_NEAR(value_at(e, "rest", "value", 0), -4.7088 / 108, 1e-11);
    kempe_equilibrium_free(e);
    e = find(&l, (kempe_equilibrium_options){.global = 1});
    CHECK(e && kempe_equilibrium_count(e) == 4); /* on both feet, on its head, on each of the two corners */
    kempe_equilibrium_free(e);
    unload(&l);
}

/* Three feet in a line: the forces are not unique, but hold the box. Beyond the last foot it tips over. */
static void a_box_on_three_feet(void)
{
    loaded l = load_text(BOX("0.4", FOOT(L, "") FOOT(M, "") FOOT(R, ""), "b.2: 0.2"));
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){0});
    double f[3], moment = 0, sum = 0;
    static const double at[3] = {-0.5, 0.1, 0.5};
    for (int k = 0; k < 3; k++) {
        f[k] = value_at(e, "contacts", "force", k);
        CHECK(f[k] >= 0);
        sum += f[k];
        moment += f[k] * (at[k] - 0.4);
    }
    CHECK_NEAR(sum, 3 * G, 1e-11);
    CHECK_NEAR(moment, 0, 1e-11);
    CHECK(strstr(said, "contact forces are not unique, because the contacts are redundant"));
    kempe_equilibrium_free(e);
    unload(&l);
    l = load_text(BOX("0.6", FOOT(L, "") FOOT(M, "") FOOT(R, ""), "b.2: 0.2"));
    e = find(&l, (kempe_equilibrium_options){0});
    check_contact(e, 2, 0, 3 * G, "presses");
    CHECK(value_at(e, "contacts", "gap", 0) > 0.4); /* it hangs from its corner, which alone meets the floor */
    kempe_equilibrium_free(e);
    unload(&l);
}

/* A slider-crank that falls on a stop of its slider: the force of the stop by virtual work. */
static void a_loop_on_a_stop(void)
{
    static const char text[] = DOWN "ground: {points: {O: [0, 0, 0]}}\n"
                                    "bodies:\n"
                                    "  crank: {joint: {name: th, revolute: z, at: ground}, mass: 1, com: [0.05, 0, 0], "
                                    "inertia: {zz: 0.001}, points: {B: [0.1, 0, 0]}}\n"
                                    "  rod: {joint: {name: ps, revolute: z, at: crank.B}, mass: 0.6, com: [0.15, 0, "
                                    "0], inertia: {zz: 0.002}, points: {C: [0.3, 0, 0]}}\n"
                                    "  slider: {joint: {name: x, prismatic: x, at: ground}, mass: 0.8, points: {P: [0, "
                                    "0, 0]}}\n"
                                    "loops: {C: {ball: [rod.C, slider.P]}}\n"
                                    "contacts: {stop: {joint: x, lower: 0.33, restitution: 0.2}}\n"
                                    "start: {q: {th: 0.3, ps: -0.4, x: 0.39}}\n";
    loaded l = load_text(text);
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){0});
    double th = -acos((0.33 * 0.33 + 0.1 * 0.1 - 0.3 * 0.3) / (2 * 0.1 * 0.33)); /* below the line of the slider */
    double c = -0.1 * sin(th) / 0.3, rod = asin(c), drod = -0.1 * cos(th) / (0.3 * cos(rod));
    double fall = G * (1 * 0.05 * cos(th) + 0.6 * (0.1 * cos(th) + 0.15 * cos(rod) * drod));
    double dx = -0.1 * sin(th) - 0.3 * sin(rod) * drod;
    check_contact(e, 0, 0, fall / dx, "presses");
    CHECK(fall / dx > 0);
    CHECK_NEAR(value_at(e, "equilibria", "q.th", 0), th, 1e-12);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* -- small motions ------------------------------------------------------------------------------------------- */

/* The eigenvalue with the largest modulus, real and imaginary parts. */
static void check_modes(const char *text, const char *at, double re, double im, const char *warning)
{
    loaded l = load_text(text);
    kempe_modes *modes = NULL;
    kempe_table *table = NULL;
    double most = -1, found[2] = {0};
    kempe_modes_options options = {.at = at};
    said[0] = 0;
    kempe_context_set_log(l.context, listen, NULL);
    CHECK(l.system && kempe_modes_new(l.system, &options, &modes) == KEMPE_OK);
    CHECK(modes && kempe_modes_table(modes, "modes", &table) == KEMPE_OK);
    for (int k = 0; table && k < kempe_table_row_count(table); k++) {
        double a = kempe_table_number(table, k, kempe_table_find(table, "re")),
               b = kempe_table_number(table, k, kempe_table_find(table, "im"));
        if (hypot(a, b) > most) {
            most = hypot(a, b);
            found[0] = fabs(a);
            found[1] = fabs(b);
        }
    }
    CHECK_NEAR(found[0], re, 1e-10);
    CHECK_NEAR(found[1], im, 1e-10);
    CHECK(strstr(said, warning));
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

#define POINT(surface, start)                                                                                          \
    DOWN PLANE "bodies: {p: {joint: {name: p, planar: z, at: ground}, mass: 3, inertia: {zz: 1}, points: {C: [0, 0, "  \
               "0]}}}\n"                                                                                               \
               "contacts: {c: {point: p.C, on: {cylinder: ground.O, radius: 0.5" surface "}, restitution: 0}}\n"       \
               "start: {q: {" start "}}\n"

/* A point in a hollow swings with sqrt(g/R); on the crest of a cylinder it leaves as exp(sqrt(g/R) t). */
static void small_motions_stay_on_the_surface(void)
{
    check_modes(POINT(", inside: yes", "p.1: 0.1, p.2: 0.2"), NULL, 0, sqrt(G / 0.5),
                "contact 'c' presses at the state");
    check_modes(POINT("", "p.2: 0.5"), NULL, sqrt(G / 0.5), 0, "contact 'c' presses at the state");
}

static const char *const rail =
    "kempe: 1\n"
    "bodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: 1}, c: {joint: {name: y, prismatic: x, at: "
    "ground}, "
    "mass: 2}}\n"
    "forces: {k: {joint: x, spring: {stiffness: 100}}, l: {joint: y, spring: {stiffness: 72}}}\n"
    "contacts: {s: {joint: x, lower: %s, restitution: 0}}\n"
    "start: {q: {x: %s}, qd: {x: %s}}\n";

static void refused(const char *lower, const char *x, const char *rate, const char *at, const char *words)
{
    char text[1024];
    kempe_linearization *linear = NULL;
    kempe_linearize_options options = {.at = at};
    (void)snprintf(text, sizeof text, rail, lower, x, rate);
    loaded l = load_text(text);
    CHECK(l.system && kempe_linearization_new(l.system, &options, &linear) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), words));
    kempe_linearization_free(linear);
    unload(&l);
}

/* A stop that presses leaves the other freedom; one that touches without a force is refused by name, as are states
 * before an impact. */
static void stops(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text, rail, "0.02", "0.1", "0");
    check_modes(text, NULL, 0, 6, "contact 's' presses at the state");
    (void)snprintf(text, sizeof text, rail, "-0.02", "0.1", "0");
    check_modes(text, NULL, 0, 10, "");
    loaded l = load_text(text);
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){0});
    check_contact(e, 0, 0.02, 0, "open");
    CHECK(!said[0]);
    kempe_equilibrium_free(e);
    unload(&l);
    (void)snprintf(text, sizeof text, rail, "0", "0.1", "0");
    l = load_text(text);
    e = find(&l, (kempe_equilibrium_options){0});
    check_contact(e, 0, 0, 0, "touches");
    CHECK(strstr(said, "contact 's': surfaces touch here without a force"));
    kempe_equilibrium_free(e);
    unload(&l);
    refused("0", "0.1", "0", NULL, "contact 's' just touches");
    refused("0.1", "0.1", "-2", "start", "contact 's' strikes with 2 m/s at t = 0");
    refused("0.2", "0.1", "0", "start", "contact 's' overlaps by 0.1 m at t = 0");
}

/* Off the crest of a cylinder there is nothing to rest on. */
static void nothing_to_rest_on(void)
{
    loaded l = load_text(POINT("", "p.1: 0.1, p.2: 0.7"));
    kempe_equilibrium *e = NULL;
    kempe_equilibrium_options options = {0};
    CHECK(l.system && kempe_equilibrium_new(l.system, &options, &e) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "nothing restrains 'p.2'"));
    kempe_equilibrium_free(e);
    unload(&l);
}

/* Rest of friction beside another freedom: a pendulum on a cart with a spring. */
static void other_freedoms_stay_in_balance(void)
{
    loaded l = load_text(DOWN "bodies:\n"
                              "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 2}\n"
                              "  bob: {joint: {name: th, revolute: z, at: cart}, mass: 1, com: [0, -0.5, 0]}\n"
                              "forces: {rub: {joint: x, friction: {force: 3}}, k: {joint: x, spring: {stiffness: "
                              "100}}}\n");
    kempe_equilibrium *e = find(&l, (kempe_equilibrium_options){0});
    CHECK_NEAR(value_at(e, "rest", "value", 0), -0.03, 1e-12);
    CHECK_NEAR(value_at(e, "rest", "value", 1), 0.03, 1e-12);
    kempe_equilibrium_free(e);
    unload(&l);
}

int main(void)
{
    TEST(a_ball_comes_to_rest);
    TEST(a_box_on_two_feet);
    TEST(a_box_on_three_feet);
    TEST(a_loop_on_a_stop);
    TEST(small_motions_stay_on_the_surface);
    TEST(stops);
    TEST(nothing_to_rest_on);
    TEST(other_freedoms_stay_in_balance);
    return check_report();
}
