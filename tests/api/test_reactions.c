/* SPDX-License-Identifier: BSD-3-Clause */
/* The reactions of all joints: against closed forms of mechanisms worked out by hand, and against the outputs
 * reaction(JOINT) and moment(JOINT) at each row, of all formulations. */
/* wings: analyses rail */
#include "loaded.h"
#include <kempe/equilibrium.h>
#include <kempe/inverse.h>
#include <kempe/table.h>
#include <math.h>
#include <string.h>

static const double g = 9.81;

static kempe_trajectory *simulate(const loaded *l, const kempe_run_options *run)
{
    kempe_trajectory *t = NULL;
    if (!l->system || kempe_simulate(l->system, run, &t) != KEMPE_OK)
        printf("%s\n", kempe_context_message(l->context));
    CHECK(t != NULL);
    return t;
}

static kempe_table *reactions_of(const kempe_trajectory *t)
{
    kempe_table *table = NULL;
    CHECK(kempe_trajectory_table(t, "reactions", &table) == KEMPE_OK);
    return table;
}

static int row_of(const kempe_table *table, const char *joint)
{
    const int column = kempe_table_find(table, "joint");
    for (int k = 0; k < kempe_table_row_count(table); k++)
        if (strcmp(kempe_table_word(table, k, column), joint) == 0)
            return k;
    printf("no row of '%s'\n", joint);
    return -1;
}

static double number_of(const kempe_table *table, const char *joint, const char *column)
{
    return kempe_table_number(table, row_of(table, joint), kempe_table_find(table, column));
}

static const char *word_of(const kempe_table *table, const char *joint, const char *column)
{
    return kempe_table_word(table, row_of(table, joint), kempe_table_find(table, column));
}

/* -- closed forms --------------------------------------------------------------------------------------- */

/* A rod of length L on a pin: along it m (g cos a + L w^2/2), across it m g sin a / 4. */
static void a_pendulum_has_its_closed_form(void)
{
    loaded l = load_text("kempe: 1\nname: rod\ngravity: [0, -9.81, 0]\n"
                         "ground: {points: {O: [0, 0, 0]}}\n"
                         "bodies:\n  rod: {joint: {name: A, revolute: z, at: ground.O}, mass: 3, com: [0, -0.5, 0], "
                         "inertia: {zz: 0.25}}\n"
                         "start: {q: {A: 80 deg}}\nrun: {t_end: 1.7, rtol: 1e-11, output_step: 0.01}\n");
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *table = reactions_of(t);
    double most = 0, at = 0;
    for (int k = 0; k < kempe_trajectory_row_count(t); k++) {
        const double a = *kempe_trajectory_q(t, k), w = *kempe_trajectory_qd(t, k);
        const double force = 3 * hypot(g * cos(a) + w * w / 2, g * sin(a) / 4);
        at = force > most ? kempe_trajectory_time(t, k) : at;
        most = fmax(most, force);
    }
    CHECK(kempe_table_row_count(table) == 1);
    CHECK(strcmp(word_of(table, "A", "kind"), "joint") == 0);
    CHECK_NEAR(number_of(table, "A", "force"), most, 1e-8);
    CHECK(number_of(table, "A", "force.t") == at);
    CHECK_NEAR(number_of(table, "A", "force.y"), most, 0.01 * most); /* at the lowest place it carries upwards */
    CHECK_NEAR(number_of(table, "A", "moment"), 0, 1e-12);
    CHECK(number_of(table, "A", "unique") == 1);
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* With a spring and a damper along its motion, whose torque is no part of the reaction: across the rod it has
 * m (g sin a + L/2 dw/dt). */
static void springs_of_a_joint_are_no_part_of_its_reaction(void)
{
    loaded l = load_text("kempe: 1\nname: rod\ngravity: [0, -9.81, 0]\n"
                         "bodies:\n  rod: {joint: {name: A, revolute: z, at: ground}, mass: 3, com: [0, -0.5, 0], "
                         "inertia: {zz: 0.25}}\n"
                         "forces: {spring: {joint: A, torque: -40*q(A) - 2*qd(A)}}\n"
                         "start: {q: {A: 80 deg}}\nrun: {t_end: 1, rtol: 1e-11, output_step: 0.01}\n");
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *table = reactions_of(t);
    double most = 0;
    for (int k = 0; k < kempe_trajectory_row_count(t); k++) {
        const double a = *kempe_trajectory_q(t, k), w = *kempe_trajectory_qd(t, k);
        const double rate = (-40 * a - 2 * w - 3 * g * sin(a) / 2) / (0.25 + 0.75);
        most = fmax(most, 3 * hypot(g * cos(a) + w * w / 2, g * sin(a) + rate / 2));
    }
    CHECK_NEAR(number_of(table, "A", "force"), most, 1e-8);
    CHECK_NEAR(number_of(table, "A", "moment"), 0, 1e-12);
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* A bar on a pin, whose end rests on the floor: each carries half its weight. */
static void a_contact_carries_its_part(void)
{
    loaded l = load_text("kempe: 1\nname: bar\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\n"
                         "bodies:\n  bar: {joint: {name: A, revolute: y, at: ground}, mass: 4, com: [0.5, 0, 0], "
                         "inertia: {yy: 0.3}, points: {T: [1, 0, 0]}}\n"
                         "contacts: {floor: {point: bar.T, on: {plane: ground.O}, restitution: 0}}\n"
                         "run: {t_end: 0.2, output_step: 0.1}\n");
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *table = reactions_of(t);
    kempe_equilibrium *e = NULL;
    CHECK_NEAR(number_of(table, "A", "force.z"), 2 * g, 1e-9);
    CHECK_NEAR(number_of(table, "A", "force"), 2 * g, 1e-9);
    CHECK(kempe_table_row_count(table) == 1); /* contacts are no joints */
    kempe_table_free(table);
    table = NULL;
    CHECK(kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
    CHECK(kempe_equilibrium_table(e, "reactions", &table) == KEMPE_OK);
    CHECK_NEAR(number_of(table, "A", "force.z"), 2 * g, 1e-9);
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    kempe_trajectory_free(t);
    unload(&l);
}

/* A slider of mass m on a crank and a rod without mass: m a is in the rod over cos b, the guide carries m a tan b, the
 * drive has the power of the slider. */
static void a_slider_crank_has_its_closed_form(void)
{
    const double r = 0.2, length = 0.5, speed = 6, mass = 3;
    loaded l = load_text("kempe: 1\nname: slider\n"
                         "ground: {points: {O: [0, 0, 0], S: [0.7, 0, 0]}}\n"
                         "bodies:\n"
                         "  crank: {joint: {name: A, revolute: z, at: ground.O}, mass: 0, points: {P: [0.2, 0, 0]}}\n"
                         "  rod: {joint: {name: B, revolute: z, at: crank.P}, mass: 0, points: {Q: [0.5, 0, 0]}}\n"
                         "  slider: {joint: {name: S, prismatic: x, at: ground.S}, mass: 3, points: {Q: [0, 0, 0]}}\n"
                         "loops: {C: {ball: [rod.Q, slider.Q]}}\n"
                         "drives: {motor: {joint: A, angle: 6*t}}\n"
                         "run: {t_end: 1, rtol: 1e-10, output_step: 0.005}\n");
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *table = reactions_of(t);
    double rod = 0, guide = 0, torque = 0, pushing = 0;
    for (int k = 0; k < kempe_trajectory_row_count(t); k++) {
        const double a = speed * kempe_trajectory_time(t, k), s = r * sin(a) / length, c = sqrt(1 - s * s);
        const double b1 = r * cos(a) * speed / (length * c); /* db/dt, of sin b = r sin a / l */
        const double b2 = (-r * sin(a) * speed * speed + length * s * b1 * b1) / (length * c);
        const double rate = -r * sin(a) * speed - length * s * b1;
        const double force = mass * (-r * cos(a) * speed * speed - length * c * b1 * b1 - length * s * b2);
        pushing = fabs(force / c) > rod ? force : pushing;
        rod = fmax(rod, fabs(force / c));
        guide = fmax(guide, fabs(force * s / c));
        torque = fmax(torque, fabs(force * rate / speed));
    }
    CHECK_NEAR(number_of(table, "A", "force"), rod, 1e-7 * rod);
    CHECK_NEAR(number_of(table, "B", "force"), rod, 1e-7 * rod);
    CHECK_NEAR(number_of(table, "C", "force"), rod, 1e-7 * rod);
    CHECK_NEAR(number_of(table, "C", "force.x"), pushing, 1e-7 * rod); /* on the slider */
    CHECK_NEAR(number_of(table, "S", "force"), guide, 1e-7 * rod);
    CHECK_NEAR(number_of(table, "S", "force.x"), 0, 1e-12);
    CHECK_NEAR(number_of(table, "motor", "moment"), torque, 1e-7 * torque);
    CHECK(strcmp(word_of(table, "motor", "kind"), "drive") == 0 && strcmp(word_of(table, "C", "kind"), "ball") == 0);
    CHECK(isnan(number_of(table, "motor", "force")) && isnan(number_of(table, "C", "moment")));
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* A mass m at (a, 0, h) of an arm that turns about the vertical: force m (w^2 a, g), moment m a (g + h w^2) about the
 * pin, across its axis; at the end of a wrist that is driven against it, the same force and no moment of its own. */
static void a_turning_arm_has_its_closed_form(void)
{
    loaded l = load_text("kempe: 1\nname: arm\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\n"
                         "bodies:\n  arm: {joint: {name: A, revolute: z, at: ground.O}, mass: 0, "
                         "points: {W: [0.4, 0, 0.3]}}\n"
                         "  hand: {joint: {name: W, revolute: x, at: arm.W}, mass: 2}\n"
                         "drives: {turn: {joint: A, angle: 5*t}, wrist: {joint: W, angle: 0*t}}\n"
                         "run: {t_end: 1, output_step: 0.1}\n");
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *table = reactions_of(t);
    const double force = 2 * hypot(25 * 0.4, g), moment = 2 * 0.4 * (g + 0.3 * 25);
    CHECK_NEAR(number_of(table, "A", "force"), force, 1e-9);
    CHECK_NEAR(number_of(table, "W", "force"), force, 1e-9);
    CHECK_NEAR(number_of(table, "A", "moment"), moment, 1e-9);
    CHECK_NEAR(number_of(table, "A", "moment.z"), 0, 1e-12);
    CHECK_NEAR(number_of(table, "W", "moment"), 0, 1e-12);
    CHECK_NEAR(number_of(table, "A", "force.z"), 2 * g, 1e-9);
    CHECK(number_of(table, "A", "force.t") == 0); /* the first of equal ones */
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* -- loads that are not unique -------------------------------------------------------------------------- */

static const char door[] =
    "kempe: 1\nname: door\ngravity: [0, 0, -9.81]\n"
    "ground: {points: {L: [0, 0, 0], U: [0, 0, 2]}}\n"
    "bodies:\n  door: {joint: {name: lower, revolute: z, at: ground.L}, mass: 20, com: [0.4, 0, 1], "
    "inertia: {zz: 1}, points: {U: [0, 0, 2]}}\n"
    "loops: {upper: {revolute: [ground.U, door.U], axis: z}}\nrun: {t_end: 0.1, output_step: 0.1}\n";

/* Two hinges carry a door. Of least norm each has half its weight; pushing and pulling they carry its moment. */
static void hinges_of_a_door_share_its_weight(void)
{
    loaded l = load_text(door);
    kempe_trajectory *one = simulate(&l, NULL), *least = simulate(&l, &(kempe_run_options){.loads = "least-norm"});
    kempe_table *given = reactions_of(one), *table = reactions_of(least);
    char *text = NULL;
    CHECK(number_of(given, "lower", "unique") == 0 && number_of(given, "upper", "unique") == 0);
    CHECK(number_of(table, "lower", "unique") == 0);
    CHECK_NEAR(number_of(given, "lower", "force.z") + number_of(given, "upper", "force.z"), 20 * g, 1e-9);
    CHECK_NEAR(number_of(table, "lower", "force.z"), 10 * g, 1e-9);
    CHECK_NEAR(number_of(table, "upper", "force.z"), 10 * g, 1e-9);
    CHECK_NEAR(number_of(table, "upper", "force.x"), -number_of(table, "lower", "force.x"), 1e-9);
    CHECK(number_of(table, "upper", "force.x") < 0); /* it pulls the door back */
    CHECK(kempe_trajectory_print(one, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\n  lower *  ") && strstr(text, "\n  * not unique, "));
    kempe_text_free(text);
    CHECK(kempe_trajectory_print(one, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"reactions\": [") && strstr(text, "\"unique\": false"));
    kempe_text_free(text);
    kempe_table_free(given);
    kempe_table_free(table);
    kempe_trajectory_free(one);
    kempe_trajectory_free(least);
    unload(&l);
}

/* -- the outputs of the same names ---------------------------------------------------------------------- */

static double size_of(const double x[3])
{
    return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
}

/* The largest force or moment of an output over the rows, against the table. */
static void has_outputs(const kempe_trajectory *t, const kempe_table *table, int row, const char *what,
                        const char *output, double unit)
{
    char name[200];
    kempe_table *values = NULL;
    const char *joint = kempe_table_word(table, row, kempe_table_find(table, "joint"));
    const int at = kempe_table_find(table, what);
    const double peak = kempe_table_number(table, row, at);
    double most = -1, here[3] = {0};
    if (isnan(peak))
        return;
    (void)snprintf(name, sizeof name, "%s(%s)", output, joint);
    CHECK(kempe_trajectory_outputs(t, name, &values) == KEMPE_OK);
    for (int k = 0; values && k < kempe_table_row_count(values); k++) {
        const double x[3] = {kempe_table_number(values, k, 1), kempe_table_number(values, k, 2),
                             kempe_table_number(values, k, 3)};
        most = fmax(most, size_of(x));
        if (kempe_table_number(values, k, 0) == kempe_table_number(table, row, at + 1))
            memcpy(here, x, sizeof here);
    }
    if (!(fabs(most - peak) <= 1e-9 * unit))
        printf("%s\n", name);
    CHECK_NEAR(peak, most, 1e-9 * unit);
    for (int i = 0; i < 3; i++)
        CHECK_NEAR(kempe_table_number(table, row, at + 2 + i), here[i], 1e-9 * unit);
    kempe_table_free(values);
}

static int compare_with_outputs(const char *path, const char *formulation, double t_end)
{
    loaded l = load(path);
    kempe_trajectory *t = simulate(
        &l, &(kempe_run_options){
                .t_end = t_end, .output_step = t_end / 20, .formulation = formulation, .no_convergence_check = 1});
    kempe_table *table = t ? reactions_of(t) : NULL;
    const int force = kempe_table_find(table, "force"), kind = kempe_table_find(table, "kind");
    double unit = 1e-3;
    int compared = 0;
    for (int k = 0; k < kempe_table_row_count(table); k++)
        unit = fmax(unit, kempe_table_number(table, k, force));
    for (int k = 0; k < kempe_table_row_count(table); k++) {
        const char *word = kempe_table_word(table, k, kind);
        if (strcmp(word, "drive") == 0 || strcmp(word, "coupler") == 0 || strcmp(word, "wheel") == 0)
            continue;
        has_outputs(t, table, k, "force", "reaction", unit);
        has_outputs(t, table, k, "moment", "moment", unit);
        compared++;
    }
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
    return compared;
}

static void reactions_are_the_largest_outputs(void)
{
    static const struct {
        const char *path;
        double t_end;
        int joints;
    } cases[] = {{"examples/four_bar/four_bar.yaml", 0.5, 4},
                 {"examples/slider_crank_spatial/slider_crank_spatial.yaml", 0.2, 4},
                 {"examples/bricard/bricard.yaml", 0.3, 7},
                 {"examples/governor/governor.yaml", 0.3, 4},
                 {"examples/flexible_robot/flexible_robot.yaml", 0.02, 6},
                 {"tests/models/friction_pin.yaml", 0.3, 1},
                 {"tests/models/contact_slider_crank.yaml", 0.3, 3},
                 {"tests/models/compliant_pin.yaml", 0.02, 1},
                 {"examples/rolling_wheel/rolling_wheel.yaml", 0.02, 2},
                 {"examples/loose_pin/loose_pin.yaml", 0.02, 3},
                 {"tests/models/two_armed_lamp.yaml", 0.1, 16},
                 {"tests/models/long_slider.yaml", 0.1, 15}};
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        for (size_t i = 0; i < sizeof formulations / sizeof *formulations; i++) {
            const int compared = compare_with_outputs(cases[k].path, formulations[i], cases[k].t_end);
            if (compared < cases[k].joints)
                printf("%s: %d joints\n", cases[k].path, compared);
            CHECK(compared >= cases[k].joints);
        }
}

/* -- other studies -------------------------------------------------------------------------------------- */

/* inverse and simulate of a driven mechanism have the same reactions, and those of the rows of inverse. */
static void inverse_dynamics_has_the_reactions_of_the_run(void)
{
    loaded l = load("examples/driven_slider_crank/driven_slider_crank.yaml");
    kempe_inverse *inverse = NULL;
    kempe_table *found = NULL;
    kempe_trajectory *t = simulate(&l, &(kempe_run_options){.rtol = 1e-10});
    CHECK(kempe_inverse_new(l.system, NULL, &inverse) == KEMPE_OK);
    CHECK(kempe_inverse_table(inverse, "reactions", &found) == KEMPE_OK);
    kempe_table *table = reactions_of(t);
    CHECK(kempe_table_row_count(found) == 4 && kempe_table_row_count(table) == 5);
    for (int k = 0; k < kempe_table_row_count(found); k++) {
        const char *joint = kempe_table_word(found, k, 0);
        CHECK_NEAR(number_of(found, joint, "force"), number_of(table, joint, "force"), 1e-6);
        CHECK_NEAR(number_of(found, joint, "force.t"), number_of(table, joint, "force.t"), 1e-12);
    }
    kempe_table_free(found);
    kempe_table_free(table);
    kempe_inverse_free(inverse);
    kempe_trajectory_free(t);
    unload(&l);
}

/* A beam of weight m g on a pin, held up by a rod at a right angle from its middle; then the mass that stretches it so
 * is searched. */
static void equilibria_have_reactions_where_values_are_found(void)
{
    loaded l = load_text("kempe: 1\nname: lever\ngravity: [0, -9.81, 0]\nparameters: {m: 4, pull: 10}\n"
                         "ground: {points: {O: [0, 0, 0]}}\n"
                         "bodies:\n  bar: {joint: {name: A, revolute: z, at: ground.O}, mass: m, com: [1, 0, 0], "
                         "inertia: {zz: 1}}\n"
                         "forces: {hand: {joint: A, torque: pull}}\nrun: {t_end: 1}\n");
    const kempe_equilibrium_options options = {.hold = "A=0", .solve_for = "pull"};
    kempe_equilibrium *e = NULL;
    kempe_table *table = NULL;
    CHECK(kempe_equilibrium_new(l.system, &options, &e) == KEMPE_OK);
    CHECK(kempe_equilibrium_table(e, "reactions", &table) == KEMPE_OK);
    CHECK_NEAR(number_of(table, "A", "force.y"), 4 * g, 1e-9);
    CHECK_NEAR(number_of(table, "A", "moment"), 0, 1e-12);
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    const kempe_equilibrium_options mass = {.hold = "A=0", .solve_for = "m"};
    CHECK(kempe_equilibrium_new(l.system, &mass, &e) == KEMPE_OK);
    CHECK(kempe_equilibrium_table(e, "reactions", &table) == KEMPE_OK);
    CHECK_NEAR(number_of(table, "A", "force.y"), 10, 1e-9); /* m g at 1 m balances 10 N m */
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* -- what is not known ---------------------------------------------------------------------------------- */

static void joints_without_a_known_reaction_say_why(void)
{
    loaded l =
        load_text("kempe: 1\nname: notes\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0], P: [1, 0, 0]}}\n"
                  "bodies:\n"
                  "  a: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, "
                  "points: {W: [1, 0, 0]}}\n"
                  "  b: {joint: {name: B, revolute: z, at: ground.P}, mass: 1, inertia: {zz: 1}}\n"
                  "  plate: {joint: {name: W, weld: yes, at: a.W}, mass: 1}\n"
                  "loops: {gear: {coupler: {A: 1, B: -2}}}\nrun: {t_end: 0.1}\n");
    if (!l.system)
        return;
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *table = reactions_of(t);
    char *text = NULL;
    CHECK(isnan(number_of(table, "W", "force")) && strstr(word_of(table, "W", "note"), "welded"));
    CHECK(strstr(word_of(table, "A", "note"), "'gear'") && strstr(word_of(table, "B", "note"), "'gear'"));
    CHECK(number_of(table, "gear", "moment") > 0 && isnan(number_of(table, "gear", "force")));
    CHECK(kempe_trajectory_print(t, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\n  A, B: without the force") && strstr(text, "\n  W: not known"));
    kempe_text_free(text);
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* A pin with clearance carries nothing in its plane: the contact does. */
static void a_pin_with_clearance_names_its_contact(void)
{
    static const struct {
        const char *path, *joint, *contact;
    } cases[] = {{"examples/loose_pin/loose_pin.yaml", "pin", "force(pin)"},
                 {"examples/loose_slider/loose_slider.yaml", "guide", "force(guide_"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = load(cases[k].path);
        kempe_trajectory *t = simulate(&l, &(kempe_run_options){.t_end = 1e-3, .no_convergence_check = 1});
        kempe_table *table = reactions_of(t);
        CHECK(strstr(word_of(table, cases[k].joint, "note"), cases[k].contact));
        CHECK(*word_of(table, "A", "note") == '\0');
        kempe_table_free(table);
        kempe_trajectory_free(t);
        unload(&l);
    }
}

/* Of a chain of many links a text has the twelve largest: those at its upper end. */
static void a_text_has_the_largest_of_many_joints(void)
{
    enum { LINKS = 15 };
    char model[4000], *text = NULL;
    int length = snprintf(model, sizeof model,
                          "kempe: 1\nname: chain\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n");
    for (int k = 0; k < LINKS; k++) {
        char at[20] = "ground.O";
        if (k > 0)
            (void)snprintf(at, sizeof at, "b%d.P", k - 1);
        length += snprintf(model + length, sizeof model - (size_t)length,
                           "  b%d: {joint: {name: j%d, revolute: z, at: %s}, mass: 1, com: [0, -0.05, 0], "
                           "inertia: {zz: 1e-3}, points: {P: [0, -0.1, 0]}}\n",
                           k, k, at);
    }
    (void)snprintf(model + length, sizeof model - (size_t)length, "run: {t_end: 0.05, output_step: 0.01}\n");
    loaded l = load_text(model);
    kempe_trajectory *t = simulate(&l, NULL);
    CHECK(kempe_trajectory_print(t, KEMPE_TEXT, &text) == KEMPE_OK);
    const char *begin = text ? strstr(text, "\njoint reactions") : NULL;
    CHECK(begin && strstr(begin, "\n  and 3 smaller ones: --all\n"));
    CHECK(begin && strstr(begin, "\n  j11 ") && !strstr(begin, "\n  j12 "));
    CHECK(begin && strstr(begin, " 147.15 ")); /* the weight of all links */
    kempe_text_free(text);
    CHECK(kempe_trajectory_print(t, KEMPE_FULL_TEXT, &text) == KEMPE_OK);
    begin = text ? strstr(text, "\njoint reactions") : NULL;
    CHECK(begin && strstr(begin, "\n  j14 ") && !strstr(begin, " smaller ones"));
    kempe_text_free(text);
    kempe_trajectory_free(t);
    unload(&l);
}

int main(void)
{
    TEST(a_pendulum_has_its_closed_form);
    TEST(springs_of_a_joint_are_no_part_of_its_reaction);
    TEST(a_contact_carries_its_part);
    TEST(a_slider_crank_has_its_closed_form);
    TEST(a_turning_arm_has_its_closed_form);
    TEST(hinges_of_a_door_share_its_weight);
    TEST(reactions_are_the_largest_outputs);
    TEST(inverse_dynamics_has_the_reactions_of_the_run);
    TEST(equilibria_have_reactions_where_values_are_found);
    TEST(joints_without_a_known_reaction_say_why);
    TEST(a_pin_with_clearance_names_its_contact);
    TEST(a_text_has_the_largest_of_many_joints);
    return check_report();
}
