/* SPDX-License-Identifier: BSD-3-Clause */
/* The largest reactions of the whole motion, and the loads of bearings: against a slider-crank worked out in 30 digits,
 * a helical gear on its shaft, statics of pins in any position, and forces that jump. */
#include "loaded.h"
#include <kempe/table.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static kempe_trajectory *simulate(const loaded *l, const kempe_run_options *run)
{
    kempe_trajectory *t = NULL;
    if (!l->system || kempe_simulate(l->system, run, &t) != KEMPE_OK)
        printf("%s\n", kempe_context_message(l->context));
    CHECK(t != NULL);
    return t;
}

static kempe_table *table_of(const kempe_trajectory *t, const char *name)
{
    kempe_table *table = NULL;
    CHECK(kempe_trajectory_table(t, name, &table) == KEMPE_OK);
    return table;
}

static double at(const kempe_table *table, int row, const char *column)
{
    return kempe_table_number(table, row, kempe_table_find(table, column));
}

static double of_joint(const kempe_table *table, const char *joint, const char *column)
{
    for (int k = 0; k < kempe_table_row_count(table); k++)
        if (strcmp(kempe_table_word(table, k, kempe_table_find(table, "joint")), joint) == 0)
            return at(table, k, column);
    printf("no row of '%s'\n", joint);
    return NAN;
}

/* -- the slider-crank ----------------------------------------------------------------------------------- */

/* Crank 2 kg, rod 0.5 kg, piston 0.4 kg, gravity, a gas force; 300 rpm. */
#define SLIDER_CRANK                                                                                                   \
    "kempe: 1\nname: engine\ngravity: [0, -9.81, 0]\nparameters: {r: 50 mm, l: 150 mm}\n"                              \
    "bodies:\n"                                                                                                        \
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 2, inertia: {zz: 0.004}, points: {pin: [r, 0, 0]}}\n"  \
    "  rod: {joint: {name: B, revolute: z, at: crank.pin}, mass: 0.5, com: [l/2, 0, 0], inertia: {zz: 0.001}, "        \
    "points: {end: [l, 0, 0]}}\n"                                                                                      \
    "  piston: {joint: {name: S, prismatic: x, at: ground}, mass: 0.4, points: {pin: [0, 0, 0]}}\n"                    \
    "loops: {W: {ball: [rod.end, piston.pin]}}\ndrives: {motor: {joint: A, angle: \"300 rpm*t\"}}\n"                   \
    "forces: {gas: {joint: S, force: \"-500*max(0, cos(q(A)))\"}}\nstart: {q: {S: 0.2}}\n"

static const char *const formulations[] = {"reduced", "projected", "dae"};

/* The largest forces and efforts of a turn; those of A and B are between its last rows of 10 ms. */
static void largest_reactions_are_between_rows(void)
{
    loaded l = load_text(SLIDER_CRANK "run: {t_end: 0.2, output_step: 0.01}\n");
    for (size_t k = 0; k < sizeof formulations / sizeof *formulations; k++) {
        kempe_trajectory *t = simulate(
            &l, &(kempe_run_options){.formulation = formulations[k], .rtol = 1e-9, .reaction_peaks = "motion"});
        kempe_table *table = table_of(t, "reactions");
        CHECK_NEAR(of_joint(table, "A", "force"), 445.531107166, 1e-9);
        CHECK_NEAR(of_joint(table, "A", "force.t"), 0.2 - 0.0007107483, 1e-7);
        CHECK_NEAR(of_joint(table, "B", "force"), 444.902571599, 1e-9);
        CHECK_NEAR(of_joint(table, "B", "force.t"), 0.2 - 7.902443e-5, 1e-7);
        CHECK_NEAR(of_joint(table, "W", "force"), 473.688129571, 1e-9);
        CHECK_NEAR(of_joint(table, "W", "force.t"), 5.99392e-5, 1e-7);
        CHECK_NEAR(of_joint(table, "S", "force"), 83.81389669758, 1e-9);
        CHECK_NEAR(of_joint(table, "motor", "moment"), 14.53687435117, 1e-9);
        CHECK_NEAR(hypot(of_joint(table, "A", "force.x"), of_joint(table, "A", "force.y")), 445.531107166, 1e-9);
        kempe_table_free(table);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

static int differing(const kempe_table *a, const kempe_table *b)
{
    int count = kempe_table_row_count(a) != kempe_table_row_count(b);
    for (int row = 0; row < kempe_table_row_count(a) && count == 0; row++)
        for (int c = 0; c < kempe_table_column_count(a); c++)
            count += kempe_table_number(a, row, c) != kempe_table_number(b, row, c);
    return count;
}

/* The rows, among them the work of a damper, have the same bits with and without a look between them. */
static void rows_are_the_same(void)
{
    loaded l = load_text(
        "kempe: 1\nname: swing\ngravity: [0, -9.81, 0]\n"
        "bodies:\n  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}, "
        "points: {P: [1, 0, 0]}}\n  b: {joint: {name: B, revolute: z, at: a.P}, mass: 1, com: [0.5, 0, 0], "
        "inertia: {zz: 0.1}}\n"
        "forces: {brake: {joint: B, torque: -0.3*qd(B)}}\nrun: {t_end: 2, output_step: 0.05, outputs: [q, qd, qdd, "
        "energy, reaction(A)]}\n");
    for (size_t k = 0; k < sizeof formulations / sizeof *formulations; k++) {
        kempe_trajectory *t[2];
        kempe_table *rows[2];
        char *text[2] = {NULL, NULL};
        for (int i = 0; i < 2; i++) {
            t[i] = simulate(&l, &(kempe_run_options){.formulation = formulations[k],
                                                     .no_convergence_check = 1,
                                                     .reaction_peaks = i ? "motion" : "rows"});
            rows[i] = table_of(t[i], "rows");
            CHECK(kempe_trajectory_print(t[i], KEMPE_JSON, &text[i]) == KEMPE_OK);
        }
        CHECK(differing(rows[0], rows[1]) == 0);
        const char *drift[2] = {strstr(text[0], "\"drift_rel\""), strstr(text[1], "\"drift_rel\"")};
        CHECK(drift[0] && drift[1] && strncmp(drift[0], drift[1], strcspn(drift[0], "\n")) == 0);
        CHECK(!strstr(text[0], "reaction_peaks") && strstr(text[1], "\"reaction_peaks\": {"));
        for (int i = 0; i < 2; i++) {
            kempe_text_free(text[i]);
            kempe_table_free(rows[i]);
            kempe_trajectory_free(t[i]);
        }
    }
    unload(&l);
}

/* -- bearings ------------------------------------------------------------------------------------------- */

/* Of the main bearings at -60 and 40 mm each has a constant part of the force; the big end's first one has all of it.
 * Equivalent loads are means of powers over a turn, whose gas force has kinks. */
static void bearings_share_the_load_of_a_pin(void)
{
    loaded l = load_text(SLIDER_CRANK "bearings:\n  main: {joint: A, at: [-60 mm, 40 mm]}\n"
                                      "  big_end: {joint: B, at: [0, 100 mm], life: [3, 10/3], thrust: 2}\n"
                                      "  other_end: {joint: B, at: [80 mm, 0 mm], life: 10/3}\n"
                                      "run: {t_end: 0.2, output_step: 0.05}\n");
    for (size_t k = 0; k < sizeof formulations / sizeof *formulations; k++) {
        kempe_trajectory *t = simulate(&l, &(kempe_run_options){.formulation = formulations[k]});
        kempe_table *table = table_of(t, "bearings");
        CHECK(kempe_table_row_count(table) == 6);
        CHECK_NEAR(at(table, 0, "radial"), 0.4 * 445.531107166, 1e-9);
        CHECK_NEAR(at(table, 1, "radial"), 0.6 * 445.531107166, 1e-9);
        CHECK_NEAR(at(table, 1, "radial.t"), 0.2 - 0.0007107483, 1e-7);
        CHECK_NEAR(at(table, 0, "equivalent"), 0.4 * 272.593464596, 1e-9);
        CHECK_NEAR(at(table, 2, "radial"), 444.902571599, 1e-9);
        CHECK_NEAR(at(table, 2, "equivalent"), 272.02500597, 1e-9);
        CHECK_NEAR(at(table, 3, "radial"), 0, 1e-9);
        CHECK_NEAR(at(table, 5, "equivalent"), 282.083123124, 1e-9);
        CHECK(at(table, 3, "life") == 10.0 / 3 && at(table, 3, "at") == 0.1);
        CHECK(isnan(at(table, 2, "axial")) && at(table, 3, "axial") == 0); /* thrust on the second one */
        CHECK(at(table, 0, "unique") == 1);
        kempe_table_free(table);
        table = table_of(t, "reactions"); /* bearings need those of the motion */
        CHECK_NEAR(of_joint(table, "A", "force"), 445.531107166, 1e-9);
        kempe_table_free(table);
        kempe_trajectory_free(t);
    }
    unload(&l);
}

/* The forces of the teeth of a helical pair on its pinion, 20 teeth of 3 mm, 15 deg, 100 N m. */
static void a_helical_gear_loads_its_bearings(void)
{
    loaded l = load_text("kempe: 1\nname: pinion\nparameters: {Ft: 3219.75275429689, Fr: 1213.23411422067, "
                         "Fa: 862.730150341736, r: 31.0582854123025 mm}\n"
                         "bodies:\n  shaft: {joint: {name: J, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, "
                         "points: {mesh: [r, 0, 0]}}\n"
                         "drives: {turn: {joint: J, locked: yes}}\n"
                         "forces: {tooth: {at: shaft.mesh, force: [-Fr, -Ft, Fa]}}\n"
                         "bearings: {main: {joint: J, at: [-60 mm, 40 mm]}, other: {joint: J, at: [40 mm, -60 mm], "
                         "thrust: 2}}\nrun: {t_end: 0.1, output_step: 0.1, outputs: [bearing(main)]}\n");
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *rows = table_of(t, "rows"), *table = table_of(t, "bearings");
    static const struct {
        const char *column;
        double value;
    } expected[] = {
        {"bearing.main.1.x", 217.344453257147},   {"bearing.main.1.y", 1287.90110171876}, {"bearing.main.1.z", 0},
        {"bearing.main.2.x", 995.889660963527},   {"bearing.main.2.y", 1931.85165257814}, {"bearing.main.2.z", 0},
        {"bearing.main.axial", -862.730150341736}};
    for (size_t k = 0; k < sizeof expected / sizeof *expected; k++)
        CHECK_NEAR(at(rows, 1, expected[k].column), expected[k].value, 1e-11);
    CHECK_NEAR(at(table, 0, "radial"), 1306.11173303437, 1e-12);
    CHECK_NEAR(at(table, 1, "radial"), 2173.44128615956, 1e-12);
    CHECK_NEAR(at(table, 1, "equivalent"), 2173.44128615956, 1e-12);
    CHECK_NEAR(at(table, 0, "axial"), -862.730150341736, 1e-12);
    CHECK_NEAR(at(table, 2, "radial"), 2173.44128615956, 1e-12); /* the same ones in the other order */
    CHECK_NEAR(at(table, 3, "radial"), 1306.11173303437, 1e-12);
    CHECK_NEAR(at(table, 3, "axial"), -862.730150341736, 1e-12);
    CHECK(at(table, 0, "radial.t") == 0); /* the first of equal ones */
    kempe_table_free(rows);
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* A disc beyond the second bearing: levers 5/12 and 17/12 of weight and centrifugal force; means of a turn in 40
 * digits. */
static void an_unbalanced_shaft_has_its_closed_form(void)
{
    loaded l = load("examples/unbalanced_shaft/unbalanced_shaft.yaml");
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *table = table_of(t, "bearings");
    const double speed = 50 * 3.14159265358979323846, most = 5 * 9.81 + 5 * 0.2e-3 * speed * speed;
    CHECK_NEAR(at(table, 0, "radial"), 5.0 / 12 * most, 1e-10);
    CHECK_NEAR(at(table, 1, "radial"), 17.0 / 12 * most, 1e-10);
    CHECK_NEAR(at(table, 0, "radial.z"), -5.0 / 12 * most, 1e-10);
    CHECK_NEAR(at(table, 1, "radial.z"), 17.0 / 12 * most, 1e-10);
    CHECK_NEAR(at(table, 1, "radial.t"), 0.03, 1e-6);
    CHECK_NEAR(at(table, 0, "equivalent"), 24.0598746241680449, 1e-9);
    CHECK_NEAR(at(table, 1, "equivalent"), 80.9061380242405037, 1e-9);
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
    l = load_set("examples/unbalanced_shaft/unbalanced_shaft.yaml", &(kempe_setting){.name = "e", .value = "0 mm"}, 1);
    t = simulate(&l, NULL);
    table = table_of(t, "bearings"); /* balanced: a constant load, from the start */
    CHECK_NEAR(at(table, 1, "radial"), 17.0 / 12 * 5 * 9.81, 1e-10);
    CHECK_NEAR(at(table, 1, "equivalent"), 17.0 / 12 * 5 * 9.81, 1e-10);
    CHECK(at(table, 1, "radial.t") == 0 && at(table, 0, "radial.t") == 0);
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* -- pins in any position ------------------------------------------------------------------------------- */

/* A shaft on a pin J, which a force pulls while it turns: the joint of its body, further sections, the driven
 * coordinate, its angle, the outputs. */
static void put_shaft(char *text, size_t size, const char *joint, const char *more, const char *drive,
                      const char *angle, const char *outputs)
{
    (void)snprintf(
        text, size,
        "kempe: 1\nname: shaft\ngravity: [1, -2, -9.81]\n"
        "ground: {points: {O: {at: [0.1, 0.2, 0.3], axes: {x: [1, 0.3, 0.2], z: [0.1, -0.2, 1]}}}}\n"
        "bodies:\n  shaft: {%smass: 3, com: [0.05, 0.02, 0.2], inertia: {xx: 0.1, yy: 0.2, zz: 0.15, xy: 0.01}, "
        "points: {O: {at: [0.03, -0.02, 0.1], axes: {x: [1, -0.2, 0.1], z: [0, 0.2, 1]}}, P: [0.1, 0, 0.25]}}\n%s"
        "drives: {turn: {joint: %s, angle: \"%s\"}}\n"
        "forces: {pull: {at: shaft.P, force: [\"100 + 20*t\", -50, \"70*cos(t)\"]}}\n"
        "bearings: {main: {joint: J, at: [-0.06, 0.04]}}\n"
        "run: {t_end: 1, output_step: 0.1, outputs: [%s]}\n",
        joint, more, drive, angle, outputs);
}

static const char turn[] = "2*t + sin(3*t)", back[] = "-2*t - sin(3*t)";
static const char all[] = "bearing(main), reaction(J), moment(J), axes(ground.O)";

static void take_vector(const kempe_table *rows, int row, const char *word, double x[3])
{
    char column[64];
    for (int k = 0; k < 3; k++) {
        (void)snprintf(column, sizeof column, "%s.%c", word, "xyz"[k]);
        x[k] = at(rows, row, column);
    }
}

static double cross(const double a[3], const double b[3], int k)
{
    return a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* Both forces at their places, with the axial one, have the force and the moment of the joint, and are across the axis
 * (in the axes of the ground's point). */
static void is_in_balance(const kempe_table *rows, int row, const double own[3])
{
    double a[3], b[3], force[3], moment[3], axes[3][3], axis[3], along[2] = {0, 0};
    take_vector(rows, row, "bearing.main.1", a);
    take_vector(rows, row, "bearing.main.2", b);
    take_vector(rows, row, "reaction.J", force);
    take_vector(rows, row, "moment.J", moment);
    take_vector(rows, row, "axes.ground.O.x", axes[0]);
    take_vector(rows, row, "axes.ground.O.y", axes[1]);
    take_vector(rows, row, "axes.ground.O.z", axes[2]);
    const double size = sqrt(own[0] * own[0] + own[1] * own[1] + own[2] * own[2]);
    for (int k = 0; k < 3; k++)
        axis[k] = (own[0] * axes[0][k] + own[1] * axes[1][k] + own[2] * axes[2][k]) / size;
    for (int k = 0; k < 3; k++) {
        CHECK_NEAR(a[k] + b[k] + at(rows, row, "bearing.main.axial") * axis[k], force[k], 1e-10);
        CHECK_NEAR(-0.06 * cross(axis, a, k) + 0.04 * cross(axis, b, k), moment[k], 1e-10);
        along[0] += a[k] * axis[k];
        along[1] += b[k] * axis[k];
    }
    CHECK_NEAR(along[0], 0, 1e-10);
    CHECK_NEAR(along[1], 0, 1e-10);
    CHECK(hypot(a[0], a[1]) > 10 && hypot(b[0], b[1]) > 10);
}

static void bearings_are_in_balance_with_the_joint(void)
{
    static const struct {
        const char *joint, *more, *drive;
        double axis[3];
    } pins[] = {{"joint: {name: J, revolute: z, at: ground.O, to: O}, ", "", "J", {0, 0, 1}},
                {"joint: {name: J, revolute: -z, at: ground.O, to: O}, ", "", "J", {0, 0, -1}},
                {"joint: {name: J, revolute: [1, 2, 2], at: ground.O, to: O}, ", "", "J", {1, 2, 2}},
                {"joint: {name: J, revolute: -y, at: ground.O, to: O, reversed: yes}, ", "", "J", {0, -1, 0}},
                {"joint: {name: J, cylindrical: z, at: ground.O, to: O}, ",
                 "start: {q: {J.1: 0.1}, qd: {J.1: 0.2}}\n",
                 "J.2",
                 {0, 0, 1}},
                {"", "joints: {J: {revolute: [ground.O, shaft.O], axis: -x}}\n", "J", {-1, 0, 0}}};
    char text[2048];
    for (size_t k = 0; k < sizeof pins / sizeof *pins; k++) {
        put_shaft(text, sizeof text, pins[k].joint, pins[k].more, pins[k].drive, turn, all);
        loaded l = load_text(text);
        kempe_trajectory *t = simulate(&l, NULL);
        kempe_table *rows = table_of(t, "rows"), *table = table_of(t, "bearings");
        for (int row = 1; row < kempe_table_row_count(rows); row += 3)
            is_in_balance(rows, row, pins[k].axis);
        CHECK((isnan(at(table, 0, "axial")) != 0) ==
              (strchr(pins[k].drive, '.') != NULL)); /* a cylindrical joint has none */
        kempe_table_free(rows);
        kempe_table_free(table);
        kempe_trajectory_free(t);
        unload(&l);
    }
}

/* The same pin with the ground as its second body: the opposite loads at the same places. */
static void the_second_body_is_loaded(void)
{
    char text[2048];
    kempe_table *rows[2];
    for (int i = 0; i < 2; i++) {
        put_shaft(text, sizeof text, "",
                  i ? "joints: {J: {revolute: [shaft.O, ground.O], axis: z}}\n"
                    : "joints: {J: {revolute: [ground.O, shaft.O], axis: z}}\n",
                  "J", i ? back : turn, all);
        loaded l = load_text(text);
        kempe_trajectory *t = simulate(&l, NULL);
        rows[i] = table_of(t, "rows");
        kempe_trajectory_free(t);
        unload(&l);
    }
    for (int c = 1; c < 8; c++)
        CHECK_NEAR(kempe_table_number(rows[0], 4, c), -kempe_table_number(rows[1], 4, c), 1e-9);
    kempe_table_free(rows[0]);
    kempe_table_free(rows[1]);
}

/* A pin of a loop that is cut, and the same in the tree. */
static void cut_joints_have_bearings(void)
{
    static const char *const ways[] = {"cut: no", "cut: yes"};
    kempe_table *table[2];
    char text[1024];
    for (int i = 0; i < 2; i++) {
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nname: door\ngravity: [0, 0, -9.81]\nground: {points: {L: [0, 0, 0], U: [0, 0, 2]}}\n"
                       "bodies:\n  door: {mass: 20, com: [0.4, 0, 1], inertia: {zz: 1}, points: {L: [0, 0, 0], "
                       "U: [0, 0, 2]}}\n"
                       "joints: {lower: {revolute: [ground.L, door.L], axis: z, %s}, upper: {cylindrical: [ground.U, "
                       "door.U], axis: z, %s}}\n"
                       "bearings: {low: {joint: lower, at: [0, 0.1]}}\n"
                       "start: {qd: {lower: 3}}\nrun: {t_end: 0.1, output_step: 0.05}\n",
                       ways[i], ways[1 - i]);
        loaded l = load_text(text);
        kempe_trajectory *t = simulate(&l, &(kempe_run_options){.loads = "least-norm"});
        table[i] = table_of(t, "bearings");
        kempe_trajectory_free(t);
        unload(&l);
    }
    for (int k = 0; k < 2; k++) {
        CHECK_NEAR(at(table[0], k, "radial"), at(table[1], k, "radial"), 1e-9);
        CHECK_NEAR(at(table[0], k, "equivalent"), at(table[1], k, "equivalent"), 1e-9);
        CHECK(at(table[k], k, "radial") > 10 && at(table[k], k, "unique") == 0);
    }
    CHECK_NEAR(at(table[0], 0, "axial"), 20 * 9.81, 1e-10); /* the upper one slides */
    kempe_table_free(table[0]);
    kempe_table_free(table[1]);
}

/* -- events --------------------------------------------------------------------------------------------- */

/* A rod of 3 kg, 1 kg m^2 about its pin, on which a force F in the middle ends: until then 3/4 F of its 1 F goes into
 * the mass. By time, and by an angle that is reached at a time between rows. */
static void a_force_that_ends_is_no_load_afterwards(void)
{
    static const char *const conditions[] = {"t < 0.05", "q(A) < 0.02"};
    char text[1024];
    for (int i = 0; i < 2; i++) {
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nname: rod\nbodies:\n  rod: {joint: {name: A, revolute: z, at: ground}, mass: 3, "
                       "com: [0.5, 0, 0], inertia: {zz: 0.25}}\n"
                       "forces: {push: {joint: A, torque: \"if(%s, 500*t, 0)\"}}\n"
                       "bearings: {main: {joint: A, at: [0, 1]}}\nrun: {t_end: 0.1, output_step: 0.03, rtol: 1e-11}\n",
                       conditions[i]);
        loaded l = load_text(text);
        kempe_trajectory *t = simulate(&l, &(kempe_run_options){.reaction_peaks = "motion"});
        kempe_table *table = table_of(t, "reactions"), *bearings = table_of(t, "bearings");
        /* q = 500 t^3/6 until T; tangential force 3*0.5*500 T, radial 3*0.5*(250 T^2)^2 */
        const double until = i ? cbrt(6 * 0.02 / 500) : 0.05;
        const double most = 1.5 * hypot(500 * until, 62500 * pow(until, 4));
        CHECK_NEAR(of_joint(table, "A", "force"), most, 1e-9);
        CHECK_NEAR(of_joint(table, "A", "force.t"), until, 1e-8);
        /* (mean |F|^3)^(1/3) of 750 t to first order; with the radial part by 5 points in each of 200 parts */
        double sum = 0;
        static const double node[] = {-0.906179845938664, -0.538469310105683, 0, 0.538469310105683, 0.906179845938664};
        static const double weight[] = {0.236926885056189, 0.478628670499366, 0.568888888888889, 0.478628670499366,
                                        0.236926885056189};
        for (int k = 0; k < 1000; k++) {
            const double s = until * (k / 5 + 0.5 * (1 + node[k % 5])) / 200;
            sum += weight[k % 5] / 400 * until * pow(1.5 * hypot(500 * s, 62500 * pow(s, 4)), 3);
        }
        sum += (0.1 - until) * pow(1.5 * 62500 * pow(until, 4), 3);
        CHECK_NEAR(at(bearings, 0, "equivalent"), cbrt(sum / 0.1), 1e-8);
        kempe_table_free(table);
        kempe_table_free(bearings);
        kempe_trajectory_free(t);
        unload(&l);
    }
}

/* A run that continues from a checkpoint has the largest values of its part. */
static void a_continued_run_has_its_part(void)
{
    const char *path = "test_bearings.checkpoint";
    loaded l = load_text(SLIDER_CRANK "run: {t_end: 0.2, output_step: 0.01, reaction_peaks: motion}\n");
    kempe_trajectory *t = simulate(&l, &(kempe_run_options){.t_end = 0.1, .checkpoint = path});
    kempe_table *table = table_of(t, "reactions");
    CHECK_NEAR(of_joint(table, "W", "force"), 473.688129571, 1e-9);
    kempe_table_free(table);
    kempe_trajectory_free(t);
    t = simulate(&l, &(kempe_run_options){.resume = path});
    table = table_of(t, "reactions");
    CHECK_NEAR(of_joint(table, "motor", "moment"), 14.53687435117, 1e-9); /* at 0.176 s */
    CHECK(of_joint(table, "W", "force.t") > 0.1);
    kempe_table_free(table);
    char *text = NULL;
    CHECK(kempe_trajectory_print(t, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "the largest of the motion from 0.1 to 0.2 s\n"));
    kempe_text_free(text);
    kempe_trajectory_free(t);
    unload(&l);
    (void)remove(path);
}

/* -- expressions and mistakes --------------------------------------------------------------------------- */

/* Sizes of vectors in expressions: roots of the sums of squares. */
static void sizes_are_measures(void)
{
    char text[4096];
    put_shaft(text, sizeof text, "joint: {name: J, revolute: z, at: ground.O, to: O}, ",
              "sensors: {f: reaction(J).size, m: moment(J).size, v: velocity(shaft.P).size, one: bearing(main).1.size, "
              "two: bearing(main).2.size, along: bearing(main).axial, part: bearing(main).2.y}\n",
              "J", turn, "f, m, v, one, two, along, part, velocity(shaft.P), bearing(main), reaction(J), moment(J)");
    loaded l = load_text(text);
    kempe_trajectory *t = simulate(&l, NULL);
    kempe_table *rows = table_of(t, "rows");
    static const char *const sizes[][2] = {{"sensor.f", "reaction.J"},
                                           {"sensor.m", "moment.J"},
                                           {"sensor.v", "velocity.shaft.P"},
                                           {"sensor.one", "bearing.main.1"},
                                           {"sensor.two", "bearing.main.2"}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        double x[3];
        take_vector(rows, 7, sizes[k][1], x);
        CHECK(x[0] != 0);
        CHECK_NEAR(at(rows, 7, sizes[k][0]), sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), 1e-13);
    }
    CHECK(at(rows, 7, "sensor.along") == at(rows, 7, "bearing.main.axial"));
    CHECK(at(rows, 7, "sensor.part") == at(rows, 7, "bearing.main.2.y"));
    kempe_table_free(rows);
    kempe_trajectory_free(t);
    unload(&l);
}

static void mistakes_are_named(void)
{
    static const char *const wrong[][2] = {
        {"{joint: S, at: [0, 1]}", "'S' is not a pin: the joint of two bearings is revolute or cylindrical"},
        {"{joint: W, at: [0, 1]}", "'W' is not a pin"},
        {"{joint: C, at: [0, 1]}", "unknown joint 'C'"},
        {"{joint: A, at: [1 mm, 0.001]}", "both bearings are at 0.001 m: their places must differ"},
        {"{joint: A, at: [0, 1, 2]}", "2"},
        {"{joint: A, at: [0, 1 N]}", "expected m, got N"},
        {"{joint: A}", "'at'"},
        {"{joint: A, at: [0, 1], thrust: 3}", "thrust is 1 or 2, not '3'"},
        {"{joint: A, at: [0, 1], life: 0.5}", "is 0.5: it must be at least 1"},
        {"{joint: A, at: [0, 1], roller: yes}", "unknown key 'roller'"}};
    char text[2048];
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        (void)snprintf(text, sizeof text, "%sbearings: {main: %s}\n", SLIDER_CRANK, wrong[k][0]);
        load_rejected(text, wrong[k][1]);
    }
    load_rejected(SLIDER_CRANK "run: {reaction_peaks: all}\n", "available: rows, motion");
    load_rejected(SLIDER_CRANK "run: {outputs: [bearing(main)]}\n", "unknown bearings 'main'");
    load_rejected(SLIDER_CRANK "sensors: {f: bearing(main).axial}\n", "the model has no bearings 'main'");
    load_rejected(SLIDER_CRANK "sensors: {f: reaction(A)}\n", "a component is expected here: reaction(..).x");
    loaded l = load_text(SLIDER_CRANK);
    kempe_trajectory *t = NULL;
    CHECK(kempe_simulate(l.system, &(kempe_run_options){.t_end = 1, .reaction_peaks = "all"}, &t) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "unknown value of reaction_peaks 'all'"));
    unload(&l);
}

int main(void)
{
    TEST(largest_reactions_are_between_rows);
    TEST(rows_are_the_same);
    TEST(bearings_share_the_load_of_a_pin);
    TEST(a_helical_gear_loads_its_bearings);
    TEST(an_unbalanced_shaft_has_its_closed_form);
    TEST(bearings_are_in_balance_with_the_joint);
    TEST(the_second_body_is_loaded);
    TEST(cut_joints_have_bearings);
    TEST(a_force_that_ends_is_no_load_afterwards);
    TEST(a_continued_run_has_its_part);
    TEST(sizes_are_measures);
    TEST(mistakes_are_named);
    return check_report();
}
