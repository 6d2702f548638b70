/* SPDX-License-Identifier: BSD-3-Clause */
/* Ropes over sheaves and from drums: paths, tensions and motions by closed forms. */
#include "compared_runs.h"
#include "linalg/dense/dot.h"
#include "sensitivity_of.h"
#include "ways.h"
#include <kempe/ensemble.h>
#include <kempe/equilibrium.h>
#include <kempe/table.h>
#include <math.h>

static const double pi = 3.14159265358979323846;

/* An axis into the picture plane x, z, about which positive rotations turn x to z. */
#define SEEN "axes: {z: -y, x: x}"

/* The first `count` values of an output at the first row, or at the last one. */
static void show(const kempe_trajectory *run, const char *output, bool last, int count, double *x)
{
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, output, &table) == KEMPE_OK);
    const int row = table && last ? kempe_table_row_count(table) - 1 : 0;
    for (int k = 0; k < count; k++)
        x[k] = table ? kempe_table_number(table, row, 1 + k) : NAN;
    kempe_table_free(table);
}

static double at_start(const kempe_trajectory *run, const char *output)
{
    double x;
    show(run, output, false, 1, &x);
    return x;
}

/* -- paths --------------------------------------------------------------------------------------------- */

/* Length, wrap and gradient of a path with one sheave, for both turns: the gradient by rates of the end. */
static void a_path_has_its_length(void)
{
    static const struct {
        const char *turn;
        double wrap, length, slope[2];
    } cases[] = {{"right", 1.47505773636124, 2.65992261133960, {0.673726258577653, -0.738981006862123}},
                 {"left", 5.48146594109211, 3.46120425228577, {0.868848209797166, -0.495078567837733}}};
    for (int c = 0; c < 2; c++)
        for (int i = 0; i < 2; i++) {
            char model[1024];
            (void)snprintf(model, sizeof model,
                           "kempe: 1\nground: {points: {A: [0, 0, 0], C: [1, 0.5, 0]}}\nbodies:\n"
                           "  b: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: {P: "
                           "[0, 0, 0]}}\n"
                           "ropes: {r: {along: [ground.A, {round: ground.C, radius: 0.2, turn: %s}, b.P], stiffness: "
                           "1 N/m, length: 9}}\n"
                           "sensors: {rate: rate(length(r)), free: free_length(r)}\n"
                           "start: {q: {x: 2, y: -0.3}, qd: {%s: 1}}\n",
                           cases[c].turn, i ? "y" : "x");
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[3], 0.01);
            CHECK_NEAR(at_start(run, "length(r)"), cases[c].length, 1e-14);
            CHECK_NEAR(at_start(run, "wrap(r.2)"), cases[c].wrap, 1e-14);
            CHECK_NEAR(at_start(run, "rate"), cases[c].slope[i], 1e-14);
            CHECK_NEAR(at_start(run, "free"), 9, 1e-14);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* Two full turns add 2 (2 pi r); an offset z along the axis makes spans sqrt(l^2 + z^2). */
static void turns_and_offsets_count(void)
{
    loaded l = load_text(
        "kempe: 1\nground: {points: {A: [0, 0, 0], C: [1, 0.5, 0], D: [1, 0.5, 0.3]}}\nbodies:\n"
        "  b: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
        "ropes:\n"
        "  r: {along: [ground.A, {round: ground.C, radius: 0.2, turn: right, turns: 2}, b.P], stiffness: 1 N/m}\n"
        "  s: {along: [ground.A, {round: ground.D, radius: 0.2, turn: right}, b.P], stiffness: 1 N/m}\n"
        "  t: {along: [ground.A, ground.D, b.P], stiffness: 1 N/m}\n"
        "start: {q: {x: 2, y: -0.3}}\n");
    kempe_trajectory *run = simulate(&l, &ways[3], 0.01);
    CHECK_NEAR(at_start(run, "length(r)"), 2.65992261133960 + 4 * pi * 0.2, 1e-14);
    CHECK_NEAR(at_start(run, "wrap(r.2)"), 1.47505773636124 + 4 * pi, 1e-14);
    CHECK_NEAR(at_start(run, "length(s)"), hypot(1.1, 0.3) + hypot(1.26491106406735, 0.3) + 0.2 * 1.47505773636124,
               1e-14);
    CHECK_NEAR(at_start(run, "length(t)"), sqrt(1.34) + sqrt(1.73), 1e-14);
    kempe_trajectory_free(run);
    unload(&l);
}

/* Round a quarter of a cylinder with a rise of 0.4 m, and by 30 deg over a sphere in a plane that is turned by 30 deg
 * about x: spans of 0.3 (0.1) and 0.5 m, r = 0.1 m. On a cylinder that is unrolled the rope is a straight line. The
 * rates of the end are the direction of the last span. Beside the sphere the rope is straight. */
static void smooth_bodies_have_the_shortest_way(void)
{
    const double across = 0.8 + 0.05 * pi, whole = hypot(across, 0.4), c = sqrt(0.75), s = 0.5;
    const double x = 0.05 + 0.5 * c, y = 0.1 * c - 0.25;
    const struct {
        const char *place;
        double end[3], length, slope[3];
    } cases[] = {{"round: ground.C, radius: 0.1, turn: right, may_leave: yes, helix: yes",
                  {0.1, -0.5, 0.4},
                  whole,
                  {0, -across / whole, 0.4 / whole}},
                 {"sphere: ground.C, radius: 0.1", {x, y * c, y * s}, 0.6 + pi / 60, {c, -s * c, -s * s}},
                 {"sphere: ground.C, radius: 0.1", {-0.1, 0.1 * c + 0.4, 0.1 * s + 0.3}, 0.5, {0, 0.8, 0.6}},
                 {"sphere: ground.C, radius: 0.1", {0.7, 0.1 * c, 0.1 * s + 0.6}, 1, {0.8, 0, 0.6}}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        for (int i = 0; i < 3; i++) {
            char model[1024];
            const double *end = cases[k].end;
            (void)snprintf(model, sizeof model,
                           "kempe: 1\nground: {points: {A: [%.17g, %.17g, %.17g], C: [0, 0, 0]}}\nbodies:\n"
                           "  b: {joint: {motions: [T1, T2, T3], coordinates: [x, y, z], at: ground}, mass: 1, points: "
                           "{P: [0, 0, 0]}}\n"
                           "ropes: {r: {along: [ground.A, {%s}, b.P], force: 0}}\nsensors: {rate: rate(length(r))}\n"
                           "start: {q: {x: %.17g, y: %.17g, z: %.17g}, qd: {%c: 1}}\n",
                           k == 0 ? -0.3 : -0.1, k == 0 ? 0.1 : 0.1 * c, k == 0 ? 0 : 0.1 * s, cases[k].place, end[0],
                           end[1], end[2], 'x' + i);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[3], 0.001);
            CHECK_NEAR(at_start(run, "length(r)"), cases[k].length, 1e-14);
            CHECK_NEAR(at_start(run, "rate"), cases[k].slope[i], 1e-14);
            CHECK_NEAR(at_start(run, "wrap(r.2)"), k == 0 ? pi / 2 : k == 1 ? pi / 6 : 0, 1e-14);
            CHECK_NEAR(at_start(run, "tension(r)"), 0, 1e-14);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* -- motions --------------------------------------------------------------------------------------------- */

/* Without gravity a mass at 2 m/s unwinds its string from a drum that does not turn: l^2 = l0^2 + 2 R v t. A string
 * may unwind by half a turn; the run ends there with its name. */
static void a_string_unwinds(void)
{
    static const char *const kinds[] = {"", ", slack: no"};
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(model, sizeof model,
                           "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                           "  m: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: {P: "
                           "[0, 0, 0]}}\n"
                           "ropes: {s: {along: [{drum: ground.O, radius: 0.1, turn: right}, m.P]%s}}\n"
                           "start: {q: {x: 0.1, y: -0.5}, qd: {x: 2, y: 0}}\n",
                           kinds[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.5);
            CHECK_NEAR(at_end(run, "length(s)"), 0.670820393249937, ways[k].tolerance);
            CHECK_NEAR(at_end(run, "tension(s)"), 5.96284793999944, 100 * ways[k].tolerance);
            kempe_trajectory_free(run);
            if (k % 3 == 0) {
                kempe_status status;
                run = simulate(&l, &ways[k], 1);
                CHECK_NEAR(at_end(run, "length(s)"), 0.806225774829855, ways[k].tolerance);
                CHECK_NEAR(at_end(run, "tension(s)"), 4.96138938356834, 100 * ways[k].tolerance);
                kempe_trajectory_free(run);
                run = simulate_any(&l, &ways[k], 1.2, &status);
                CHECK(run && strstr(kempe_trajectory_reason(run),
                                    "rope 's' has turned by 3.1 rad about 'ground.O' since the start"));
                kempe_trajectory_free(run);
            }
            unload(&l);
        }
}

/* Both ends of a rope come opposite each other on a sphere, where the shorter way would jump to the other side: a heavy
 * body moves by 4 m/s. */
static void a_rope_over_the_middle_of_a_sphere_ends_the_run(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, 0, 0]\nground: {points: {A: [-1, 0.05, 0], C: [0, 0, 0]}}\n"
                         "bodies: {m: {joint: {prismatic: y, at: ground}, mass: 1e12, points: {E: [1, 0, 0]}}}\n"
                         "ropes: {r: {along: [ground.A, {sphere: ground.C, radius: 0.2}, m.E], force: 50}}\n"
                         "start: {q: {m: 0.3}, qd: {m: -4}}\n");
    for (int w = 0; w < WAYS; w++) {
        kempe_status status;
        kempe_trajectory *run = simulate_any(&l, &ways[w], 1, &status);
        CHECK(run && strstr(kempe_trajectory_reason(run), "rope 'r' lies over the middle of the sphere at 'ground.C'"));
        const int last = run ? kempe_trajectory_row_count(run) - 1 : 0;
        CHECK_NEAR(run ? kempe_trajectory_time(run, last) : NAN, (0.3 + tan(atan(0.05) - acos(0.99985))) / 4, 1e-8);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* A bungee of 12 m and 500 N/m catches 70 kg: after it is taut, an oscillation about its static extension. The elastic
 * energy is potential. */
static void a_bungee_catches(void)
{
    const double g = 9.81, w = sqrt(500.0 / 70), static_extension = 70 * g / 500, speed = sqrt(2 * g * 12);
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(
            "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\n"
            "bodies: {m: {joint: {name: z, prismatic: z, at: ground}, mass: 70, points: {P: [0, 0, 0]}}}\n"
            "ropes: {bungee: {along: [ground.O, m.P], length: 12 m, stiffness: 500 N/m}}\nstart: {q: {z: -1e-9}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 2.5);
        const double tau = 2.5 - 1.56412377401155;
        const double extension = static_extension * (1 - cos(w * tau)) + speed / w * sin(w * tau);
        CHECK_NEAR(at_end(run, "tension(bungee)"), 500 * extension, 1e4 * ways[k].tolerance);
        CHECK_NEAR(last_q(run)[0], -12 - extension, 100 * ways[k].tolerance);
        kempe_trajectory_free(run);
        run = simulate(&l, &ways[k], 3);
        const kmp_log_entry *taut = entry(run, "event", 0), *slack = entry(run, "event", 1);
        CHECK(taut && slack);
        if (taut && slack) {
            CHECK_NEAR(taut->t, 1.56412377401155, 100 * ways[k].tolerance);
            CHECK_NEAR(slack->t, 2.91531203927732, 100 * ways[k].tolerance);
            CHECK_TEXT(taut->text, "rope 'bungee' becomes taut");
            CHECK_TEXT(slack->text, "rope 'bungee' becomes slack");
        }
        CHECK_NEAR(at_end(run, "tension(bungee)"), 0, 0);
        double energy[3];
        show(run, "energy", true, 3, energy);
        CHECK_NEAR(energy[2], 0, 1e5 * ways[k].tolerance);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* An inextensible rope becomes taut with the restitution 0.3: the mass rebounds to 0.09 of its fall. */
static void a_rope_becomes_taut_with_an_impact(void)
{
    for (int k = 0; k < WAYS; k += 3) {
        loaded l = load_text(
            "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\n"
            "bodies: {m: {joint: {name: z, prismatic: z, at: ground}, mass: 70, points: {P: [0, 0, 0]}}}\n"
            "ropes: {rope: {along: [ground.O, m.P], length: 12 m, restitution: 0.3}}\nstart: {q: {z: -1e-9}}\n");
        const double top = 1.56412377401155 + 0.3 * 15.3440542230533 / 9.81;
        kempe_trajectory *run = simulate(&l, &ways[k], top);
        CHECK_NEAR(last_q(run)[0], -12 + 1.08, 100 * ways[k].tolerance);
        CHECK_NEAR(at_end(run, "tension(rope)"), 0, 0);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* -- friction ------------------------------------------------------------------------------------------ */

/* Two masses over a post, half a turn: slip by Eytelwein beyond exp(0.2 pi) and its inverse, otherwise it holds. A
 * V groove divides the coefficient by sin(b/2). */
static void a_capstan_holds_and_slips(void)
{
    static const char *const posts[] = {
        "{round: ground.O, radius: 0.1, turn: right, friction: 0.2}",
        "{round: ground.O, radius: 0.1, turn: right, friction: 0.2*sin(19 deg), groove: 38 deg}"};
    static const struct {
        double mass, acceleration; /* of the second mass upwards */
    } cases[] = {{3, 2.26519340463635}, {0.4, -1.4028225813498}, {1.874456, 0}, {0.533489, 0}, {1, 0}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++)
        for (int post = 0; post < 2; post++)
            for (int k = post; k < WAYS; k += 2) {
                char model[2048];
                (void)snprintf(model, sizeof model,
                               "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN
                               "}}}\nbodies:\n"
                               "  a: {joint: {prismatic: z, at: ground}, mass: %.9g, points: {P: [-0.1, 0, -1]}}\n"
                               "  b: {joint: {prismatic: z, at: ground}, mass: 1, points: {P: [0.1, 0, -1]}}\n"
                               "ropes: {rope: {along: [a.P, %s, b.P], slack: no}}\n",
                               cases[c].mass, posts[post]);
                loaded l = load_text(model);
                kempe_trajectory *run = simulate(&l, &ways[k], 0.05);
                CHECK_NEAR(at_end(run, "qdd(b)"), cases[c].acceleration, 1e-10);
                CHECK_NEAR(at_end(run, "tension(rope)"), 9.81 + cases[c].acceleration, 1e-9);
                kempe_trajectory_free(run);
                unload(&l);
            }
    for (int side = 0; side < 2; side++) { /* just beyond the thresholds it slips */
        char model[1024];
        (void)snprintf(model, sizeof model,
                       "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN "}}}\nbodies:\n"
                       "  a: {joint: {prismatic: z, at: ground}, mass: %.12g, points: {P: [-0.1, 0, -1]}}\n"
                       "  b: {joint: {prismatic: z, at: ground}, mass: 1, points: {P: [0.1, 0, -1]}}\n"
                       "ropes: {rope: {along: [a.P, {round: ground.O, radius: 0.1, turn: right, friction: 0.2}, b.P], "
                       "slack: no}}\n",
                       side ? 0.533488 : 1.874457);
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &ways[0], 0.05);
        CHECK(side ? at_end(run, "qdd(b)") < -1e-7 : at_end(run, "qdd(b)") > 1e-7);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A rope three half turns around a post, that would push the lifted mass if it stuck: it slips with T1 = exp(0.9 pi)
 * T2, in a run of a microsecond as in a longer one. */
static void a_short_run_decides_as_a_long_one(void)
{
    const double factor = exp(0.9 * pi), up = (2 * 9.81 + factor * (15 - 9.81)) / (2 + factor);
    for (int k = 0; k < WAYS; k++)
        for (int is_short = 0; is_short < 2; is_short++) {
            loaded l = load_text(
                "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN "}}}\nbodies:\n"
                "  a: {joint: {prismatic: z, at: ground}, mass: 2, points: {P: [-0.1, 0, -1]}}\n"
                "  b: {joint: {prismatic: z, at: ground}, mass: 1, points: {P: [0.1, 0, -1]}}\n"
                "ropes: {rope: {along: [a.P, {round: ground.O, radius: 0.1, turn: right, friction: 0.3, turns: 1}, "
                "b.P], slack: no}}\nforces: {lift: {joint: b, force: 15}}\n");
            kempe_trajectory *run = simulate(&l, &ways[k], is_short ? 1e-6 : 0.05);
            CHECK_NEAR(at_end(run, "qdd(b)"), up, 1e-9);
            CHECK_NEAR(at_end(run, "tension(rope)"), up + 9.81 - 15, 1e-9);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A sheave with friction that turns freely turns with its rope: T1 - T2 = J a/r^2. An elastic rope has the same. */
static void friction_turns_a_sheave(void)
{
    static const char *const kinds[] = {"slack: no", "axial_stiffness: 1e9 N, damping: 1e-3, preload: 20 N"};
    const double a = 9.81 * (1.2 - 1) / (1.2 + 1 + 0.002 / 0.01);
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < (c ? 1 : WAYS); k++) {
            char model[1024];
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN "}}}\n"
                "bodies:\n"
                "  s: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.002}, points: {C: [0, 0, 0]}}\n"
                "  a: {joint: {prismatic: z, at: ground}, mass: 1.2, points: {P: [-0.1, 0, -1]}}\n"
                "  b: {joint: {prismatic: z, at: ground}, mass: 1, points: {P: [0.1, 0, -1]}}\n"
                "ropes: {rope: {along: [a.P, {round: s.C, radius: 0.1, turn: right, friction: 0.2}, b.P], %s}}\n",
                kinds[c]);
            loaded l = load_text(model);
            const way elastic = {"dae", NULL, "radau", 1e-6, 0};
            kempe_trajectory *run = simulate(&l, c ? &elastic : &ways[k], 0.1);
            double force[3];
            CHECK_NEAR(at_end(run, "qd(b)"), 0.1 * a, c ? 2e-4 : 1e-8);
            CHECK_NEAR(at_end(run, "qd(s)"), a, c ? 2e-3 : 1e-7);
            if (!c) { /* both tensions hang on the sheave's bearing */
                show(run, "reaction(s)", true, 3, force);
                CHECK_NEAR(force[0], 0, 1e-9);
                CHECK_NEAR(force[2], 9.81 + 1.2 * (9.81 - a) + 9.81 + a, 1e-8);
            }
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* Two posts, a quarter of a turn and a quarter back to vertical: the tensions slip beyond exp(mu1 w1 + mu2 w2) and its
 * inverse. Each post has its part. */
static void capstans_act_one_after_another(void)
{
    static const double angle = 0.3 * pi / 2 + 0.15 * pi / 2; /* mu1 w1 + mu2 w2 */
    const double E = exp(angle),
                 masses[] = {2.5, E * (1 + 1e-6), E * (1 - 1e-6), 1.3, 1, (1 + 1e-6) / E, (1 - 1e-6) / E, 0.3};
    for (int c = 0; c < 8; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[2048];
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN
                "}, U: {at: [1, 0, 0], " SEEN "}}}\nbodies:\n"
                "  a: {joint: {prismatic: z, at: ground}, mass: %.17g, points: {P: [-0.1, 0, -1]}}\n"
                "  b: {joint: {prismatic: z, at: ground}, mass: 1, points: {P: [1.1, 0, -1]}}\n"
                "ropes: {rope: {along: [a.P, {round: ground.O, radius: 0.1, turn: right, friction: 0.3}, {round: "
                "ground.U, radius: 0.1, turn: right, friction: 0.15}, b.P], slack: no}}\n",
                masses[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.05);
            const double m = masses[c], a = m > E       ? 9.81 * (m - E) / (m + E)
                                            : m < 1 / E ? -9.81 * (1 - m * E) / (1 + m * E)
                                                        : 0;
            CHECK_NEAR(at_end(run, "qdd(b)"), a, 1e-10);
            CHECK_NEAR(at_end(run, "tension(rope)"), 9.81 + a, 1e-9);
            const double one = at_end(run, "lambda(rope_friction_2)"), two = at_end(run, "lambda(rope_friction_3)");
            CHECK_NEAR(9.81 + a - one - two, m * (9.81 - a), 1e-8); /* the tension before both */
            if (m > E || m < 1 / E) {                               /* each by its own factor */
                CHECK_NEAR(9.81 + a - two, (9.81 + a) * exp((m > E ? 1 : -1) * 0.15 * pi / 2), 1e-8);
            }
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A slide that slips presses another one: the level of that one is a tenth of the force there, not zero. */
static void a_level_has_friction_that_slips(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l =
            load_text("kempe: 1\nbodies:\n  a: {joint: {prismatic: z, at: ground}, mass: 4}\n"
                      "  b: {joint: {prismatic: x, at: ground}, mass: 2}\n"
                      "forces:\n  f: {joint: a, friction: {force: 20}}\n"
                      "  g: {joint: b, friction: {force: \"0.1*abs(lambda(f))\"}}\nstart: {qd: {a: 100, b: 5}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.5);
        CHECK_NEAR(at_end(run, "qdd(a)"), -5, 1e-10);
        CHECK_NEAR(at_end(run, "qdd(b)"), -1, 1e-10);
        CHECK_NEAR(at_end(run, "qd(b)"), 4.5, 1e-9);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A peg that the rope is off changes nothing at a sheave with friction behind it: the mass moves across the span. */
static void a_peg_that_is_off_has_no_friction(void)
{
    static const char *const pegs[] = {"", "{round: ground.C, radius: 0.1, turn: right, may_leave: yes}, "};
    double x[2][3];
    for (int k = 0; k < WAYS; k++) {
        for (int c = 0; c < 2; c++) {
            char model[1024];
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0], C: [-0.6, -0.3, 0]}}\n"
                "bodies:\n"
                "  a: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1.5, points: {P: [0, "
                "0, 0]}}\n"
                "  b: {joint: {name: z, prismatic: y, at: ground}, mass: 2, points: {P: [0.1, 0, 0]}}\n"
                "ropes: {r: {along: [a.P, %s{round: ground.O, radius: 0.1, turn: right, friction: 0.2}, b.P], "
                "slack: no}}\nstart: {q: {x: -1, y: 0, z: -1}, qd: {x: 0, y: -1}, hold: [x, y]}\n",
                pegs[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.1);
            x[c][0] = at_start(run, "tension(r)");
            x[c][1] = at_end(run, "q(x)");
            x[c][2] = at_end(run, "q(z)");
            CHECK(c == 0 || at_start(run, "wrap(r.2)") == 0);
            kempe_trajectory_free(run);
            unload(&l);
        }
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(x[1][i], x[0][i], 10 * ways[k].tolerance);
    }
}

/* -- machines ------------------------------------------------------------------------------------------ */

/* Four falls without friction: a = (4 m - M) g/(M + 16 m), and four tensions carry the load. */
static void a_tackle_has_four_falls(void)
{
    const double g = 9.81, a = (4 * 60.0 - 200) * g / (200 + 16 * 60.0);
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(
            "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {E: [-0.16, 0, 0], C: {at: [0.08, 0, 0], " SEEN "}, "
            "D: {at: [0.4, 0, 0], " SEEN "}}}\nbodies:\n"
            "  block: {joint: {name: z, prismatic: z, at: ground}, mass: 200, points: {A: {at: [-0.08, 0, -2], " SEEN
            "}, B: {at: [0.24, 0, -2], " SEEN "}}}\n"
            "  weight: {joint: {name: w, prismatic: z, at: ground}, mass: 60, points: {P: [0.48, 0, -1]}}\n"
            "ropes:\n  fall:\n    along:\n      - ground.E\n      - {round: block.A, radius: 80 mm, turn: left}\n"
            "      - {round: ground.C, radius: 80 mm, turn: right}\n"
            "      - {round: block.B, radius: 80 mm, turn: left}\n"
            "      - {round: ground.D, radius: 80 mm, turn: right}\n      - weight.P\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.2);
        CHECK_NEAR(at_end(run, "tension(fall)"), 60 * (g - 4 * a), 1e-8);
        CHECK_NEAR(at_end(run, "qdd(z)"), a, 1e-9);
        CHECK_NEAR(last_q(run)[0], a * 0.02, 1e-10);
        CHECK_NEAR(at_end(run, "wrap(fall.3)"), pi, 1e-12);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A load turns a drum, to the left or to the right, beyond a turn; the bearing carries the tension. */
static void a_load_turns_a_drum(void)
{
    for (int left = 0; left < 2; left++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN "}}}\nbodies:\n"
                "  drum: {joint: {revolute: z, at: ground.O}, mass: 10, inertia: {zz: 2}, points: {C: [0, 0, 0]}}\n"
                "  load: {joint: {name: z, prismatic: z, at: ground}, mass: 100, points: {P: [%g, 0, -1]}}\n"
                "ropes: {hoist: {along: [%s{drum: drum.C, radius: 150 mm, turn: %s}%s]}}\n",
                left ? 0.15 : -0.15, left ? "load.P, " : "", left ? "left" : "left", left ? "" : ", load.P");
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 1);
            double force[3], moment[3];
            const kmp_log_entry *taut = entry(run, "contact", 0);
            CHECK(taut && strcmp(taut->text, "rope 'hoist' becomes taut") == 0);
            CHECK_NEAR(at_end(run, "tension(hoist)"), 461.647058823529, 1e-8);
            CHECK_NEAR(at_end(run, "qdd(z)"), -5.19352941176471, 1e-9);
            CHECK_NEAR(fabs(last_q(run)[0]), 5.19352941176471 / 2 / 0.15, 1e-8);
            CHECK_NEAR(at_end(run, "length(hoist)"), 1 + 5.19352941176471 / 2, 1e-9);
            show(run, "reaction(drum)", true, 3, force);
            show(run, "moment(drum)", true, 3, moment);
            CHECK_NEAR(force[2], 98.1 + 461.647058823529, 1e-8);
            CHECK_NEAR(hypot(force[0], force[1]) + hypot(moment[0], moment[1]), 0, 1e-9);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A drum on a carriage that is held: the carriage hangs on its joint by the tension at the rim, less what turns the
 * drum, so that its joint has no moment. Without it only the drum itself had it. */
static void a_carriage_feels_the_rim(void)
{
    static const char *const kinds[] = {"", ", slack: no", ", stiffness: 1e5 N/m, preload: 461.647058823529 N"};
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN "}}}\nbodies:\n"
                "  car: {joint: {prismatic: x, at: ground.O}, mass: 5}\n"
                "  drum: {joint: {revolute: z, at: car}, mass: 10, inertia: {zz: 2}, points: {C: [0, 0, 0]}}\n"
                "  load: {joint: {name: z, prismatic: z, at: ground}, mass: 100, points: {P: [-0.15, 0, -1]}}\n"
                "drives: {hold: {joint: car, locked: yes}}\n"
                "ropes: {hoist: {along: [{drum: drum.C, radius: 150 mm, turn: left}, load.P]%s}}\n",
                kinds[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.1);
            double force[3], moment[3];
            CHECK_NEAR(at_start(run, "tension(hoist)"), 461.647058823529, 1e-8);
            CHECK_NEAR(at_start(run, "qdd(drum)"), 461.647058823529 * 0.15 / 2, 1e-9);
            show(run, "reaction(car)", false, 3, force);
            show(run, "moment(car)", false, 3, moment);
            CHECK_NEAR(hypot(force[1], force[2]), 15 * 9.81 + 461.647058823529, 1e-8);
            for (int i = 0; i < 3; i++)
                CHECK_NEAR(moment[i], 0, 1e-9);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A drum winds three turns of rope whose radius grows by 20 mm each turn; its span stays along one line. The length on
 * it is R w + d w^2/(4 pi). */
static void layers_have_their_length(void)
{
    char model[1024];
    (void)snprintf(model, sizeof model,
                   "kempe: 1\nground: {points: {O: [0, 0, 0]}}\n"
                   "tables: {layers: {x: [-1, 7, 40], y: [%.17g, %.17g, %.17g], method: linear}}\nbodies:\n"
                   "  drum: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {C: [0, 0, 0]}}\n"
                   "  end: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: {P: [0, 0, "
                   "0]}}\n"
                   "ropes: {r: {along: [{drum: drum.C, radius: layers, turn: right}, end.P], stiffness: 1 N/m}}\n"
                   "drives: {a: {joint: drum, angle: 6*pi*t}, b: {joint: x, displacement: 30}, c: {joint: y, "
                   "displacement: 0.15 + 0.06*t}}\nsensors: {free: free_length(r)}\nstart: {q: {x: 30, y: 0.15}}\n",
                   0.15 - 0.02 / (2 * pi), 0.15 + 0.02 * 7 / (2 * pi), 0.15 + 0.02 * 40 / (2 * pi));
    loaded l = load_text(model);
    kempe_trajectory *run = simulate(&l, &ways[3], 1);
    CHECK_NEAR(at_start(run, "free") - at_end(run, "free"), 3.39292006587698, 1e-10);
    kempe_trajectory_free(run);
    unload(&l);
}

/* A load turns a drum with two slopes of its radius: at first, where the radius is 150 mm, as a drum of this radius.
 * Later the rope that has
 * left the drum is the integral of the radius. */
static void a_load_unwinds_layers(void)
{
    static const char *const text =
        "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN "}}}\n"
        "tables: {layers: {x: [0, 9, 30], y: [0.105, 0.141, 0.204], method: linear}}\nbodies:\n"
        "  drum: {joint: {revolute: z, at: ground.O}, mass: 40, inertia: {zz: 2}, points: {C: [0, 0, 0]}}\n"
        "  load: {joint: {motions: [T1, T3], coordinates: [x, z], at: ground}, mass: 100, points: {P: [0, 0, 0]}}\n"
        "ropes: {r: {along: [{drum: drum.C, radius: layers, wound: 12, turn: right}, load.P]}}\n"
        "start: {q: {x: 0.15, z: -1}}\n";
    double q[3] = {0};
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[k], 0.7);
        CHECK_NEAR(at_start(run, "tension(r)"), 461.647058823529, 1e-9);
        for (int i = 0; run && i < 3; i++) {
            q[i] = k == 0 ? last_q(run)[i] : q[i];
            CHECK_NEAR(last_q(run)[i], q[i], 10 * ways[k].tolerance);
        }
        /* The wound angle of the span, by iteration. */
        double wound = 12, radius = 0.15, length = 0;
        for (int i = 0; i < 30; i++) {
            radius = wound > 9 ? 0.141 + 0.003 * (wound - 9) : 0.105 + 0.004 * wound;
            const double far = hypot(q[1], q[2]);
            length = sqrt(far * far - radius * radius);
            /* Direction of the span below the horizontal, which is half pi at the start. */
            const double turned = atan2(-q[2], q[1]) + asin(radius / far);
            wound = 12 + q[0] + turned - pi / 2;
        }
        const double left =
            0.105 * wound + 0.002 * wound * wound - (wound > 9 ? 0.0005 * (wound - 9) * (wound - 9) : 0);
        const double begun = 0.105 * 12 + 0.002 * 144 - 0.0005 * 9;
        CHECK(wound < 8.5);
        CHECK_NEAR(length - 1, begun - left, 1e-7);
        CHECK(run && run->verdict.left < 1e-8);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A winch by law on an elastic rope does work: with it the energies are balanced. */
static void a_winch_does_work(void)
{
    static const char *const kinds[] = {"stiffness: 4 kN/m", "stiffness: 4 kN/m, damping: 2e-3",
                                        "axial_stiffness: 4 kN"};
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(model, sizeof model,
                           "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                           "  load: {joint: {name: z, prismatic: z, at: ground}, mass: 50, points: {P: [0, 0, -2]}}\n"
                           "ropes: {hoist: {along: [ground.O, load.P], length: \"1.9 - 0.5*t\", %s}}\n",
                           kinds[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.5);
            CHECK(run && run->verdict.drift_rel < 1e3 * ways[k].tolerance);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* The length by a function of time lifts a load over a sheave on a boom whose root carries both tensions. */
static void a_winch_by_law_lifts(void)
{
    static const char *const kinds[] = {"", ", slack: no"};
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {r: 0.2}\n"
                "ground: {points: {O: {at: [0, 0, 0], " SEEN "}, W: [0, 0, -1]}}\nbodies:\n"
                "  boom: {joint: {revolute: z, at: ground.O}, mass: 0, points: {tip: [3, 0, 0]}}\n"
                "  load: {joint: {name: z, prismatic: z, at: ground}, mass: 50, points: {P: [3.2, 0, -2]}}\n"
                "drives: {hold: {joint: boom, locked: yes}}\n"
                "ropes: {hoist: {along: [ground.W, {round: boom.tip, radius: r, turn: right}, load.P], length: "
                "\"%.17g - 0.5*t^2\"%s}}\n",
                sqrt(10 - 0.04) + 2 + 0.2 * (atan2(1, 3) + asin(0.2 / sqrt(10)) + pi / 2), kinds[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 1);
            const double tension = 50 * 10.81, angle = atan2(1, 3) + asin(0.2 / sqrt(10));
            double force[3];
            CHECK_NEAR(last_q(run)[1], 0.5, 10 * ways[k].tolerance);
            CHECK_NEAR(at_end(run, "tension(hoist)"), tension, 1e4 * ways[k].tolerance);
            show(run, "reaction(boom)", true, 3, force);
            CHECK_NEAR(force[0], tension * cos(angle), 1e4 * ways[k].tolerance);
            CHECK_NEAR(force[2], tension * (1 + sin(angle)), 1e4 * ways[k].tolerance);
            /* the drive holds the moment about the root: 3.2 down at the tip, the other one with its arm */
            CHECK_NEAR(fabs(at_end(run, "lambda(hold)")), tension * (3.2 + 3 * sin(angle) - 0.2),
                       1e4 * ways[k].tolerance);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A drum on a carriage that turns is the same as one whose own rotation is what both turn: only the rotation against
 * the span counts. */
static void a_carrier_may_turn(void)
{
    static const char *const drums[] = {
        "  c: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.3}}\n"
        "  d: {joint: {revolute: z, at: c}, mass: 1, inertia: {zz: 0.2}, points: {C: [0, 0, 0]}}\n",
        "  d: {joint: {revolute: z, at: ground.O}, mass: 2, inertia: {zz: 0.5}, points: {C: [0, 0, 0]}}\n"};
    double q[2][2];
    for (int c = 0; c < 2; c++) {
        char model[1024];
        (void)snprintf(model, sizeof model,
                       "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN "}}}\nbodies:\n%s"
                       "  m: {joint: {motions: [T1, T3], coordinates: [x, z], at: ground}, mass: 3, points: {P: [0, 0, "
                       "0]}}\n"
                       "%sropes: {s: {along: [{drum: d.C, radius: 0.1, turn: left}, m.P]}}\n"
                       "start: {q: {x: -0.1, z: -1}, qd: {x: 0.7}}\n",
                       drums[c], c ? "" : "drives: {hold: {joint: d, locked: yes}}\n");
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &ways[0], 3);
        q[c][0] = at_end(run, "q(x)");
        q[c][1] = at_end(run, "q(z)");
        CHECK(fabs(at_end(run, c ? "q(d)" : "q(c)")) > 6.5);
        kempe_trajectory_free(run);
        unload(&l);
    }
    CHECK_NEAR(q[0][0], q[1][0], 1e-8);
    CHECK_NEAR(q[0][1], q[1][1], 1e-8);
    CHECK(fabs(q[0][0] + 0.1) > 0.01);
}

/* -- belts and grip -------------------------------------------------------------------------------------- */

#define WHEELS                                                                                                         \
    "kempe: 1\nground: {points: {A: [0, 0, 0], B: [0.4, 0, 0]}}\nbodies:\n"                                            \
    "  a: {joint: {revolute: z, at: ground.A}, mass: 1, inertia: {zz: 2e-4}, points: {C: [0, 0, 0]}}\n"                \
    "  b: {joint: {revolute: z, at: ground.B}, mass: 1, inertia: {zz: 5e-3}, points: {C: [0, 0, 0]}}\n"

/* Open and crossed belts that slide: lengths and wraps. */
static void belts_have_their_lengths(void)
{
    loaded l = load_text(
        WHEELS "ropes:\n"
               "  open: {around: [{round: a.C, radius: 50 mm, turn: left}, {round: b.C, radius: 120 mm, turn: "
               "left}], stiffness: 1000}\n"
               "  crossed: {around: [{round: a.C, radius: 50 mm, turn: left}, {round: b.C, radius: 120 mm, "
               "turn: right}], stiffness: 1000}\n");
    kempe_trajectory *run = simulate(&l, &ways[3], 0.01);
    CHECK_NEAR(at_start(run, "length(open)"), 1.34635230535379, 1e-14);
    CHECK_NEAR(at_start(run, "wrap(open.1)"), 2.78978111726236, 1e-14);
    CHECK_NEAR(at_start(run, "wrap(open.2)"), 3.49340418991723, 1e-14);
    CHECK_NEAR(at_start(run, "length(crossed)"), 1.40747247182685, 1e-14);
    CHECK_NEAR(at_start(run, "wrap(crossed.1)"), 4.01951642480931, 1e-14);
    CHECK_NEAR(at_start(run, "wrap(crossed.2)"), 4.01951642480931, 1e-14);
    kempe_trajectory_free(run);
    unload(&l);
}

/* A roller chain of 12.7 mm pitch on 17 and 38 teeth: the ratio is 17 to 38, and its speed at 100 rad/s is between the
 * least and the largest speed of its links on the polygon, 3.39694996599871 and 3.4557913813624 m/s. */
static void a_chain_has_teeth(void)
{
    static const double r = 17 * 12.7e-3 / (2 * pi);
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(
            "kempe: 1\nparameters: {p: 12.7 mm}\nground: {points: {A: [0, 0, 0], B: [0.4, 0, 0]}}\nbodies:\n"
            "  a: {joint: {revolute: z, at: ground.A}, mass: 1, inertia: {zz: 2e-4}, points: {C: [0, 0, 0]}}\n"
            "  b: {joint: {revolute: z, at: ground.B}, mass: 1, inertia: {zz: 5e-3}, points: {C: [0, 0, 0]}}\n"
            "ropes: {chain: {around: [{round: a.C, teeth: 17, pitch: p, turn: left, grip: yes}, {round: b.C, teeth: "
            "38, pitch: p, turn: left, grip: yes}], axial_stiffness: 1e9 N, damping: 1e-3, preload: 300 N}}\n"
            "start: {qd: {a: 100, b: 44.73684210526316}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.01);
        CHECK_NEAR(at_start(run, "length(chain_1)"), sqrt(0.16 - 21 * 21 / (17.0 * 17) * r * r), 1e-13);
        CHECK_NEAR(at_end(run, "tension(chain_1)"), 300, 1e-4); /* no part becomes longer */
        CHECK_NEAR(at_end(run, "tension(chain_2)"), 300, 1e-4);
        CHECK_NEAR(at_end(run, "qd(b)"), 100 * 17 / 38.0, 1e-8);
        kempe_trajectory_free(run);
        unload(&l);
    }
    CHECK(100 * r > 3.39694996599871 && 100 * r < 3.4557913813624);
}

/* A timing belt of 60 kN under 300 N, 4 N m on the small wheel: the oscillation of both wheels, its largest and least
 * tension, and the loads of both bearings. */
static void a_timing_belt_oscillates(void)
{
    const double period = 2 * pi / 2164.79034004367, cosine = 0.393827373350304 / 0.4, sine = 0.07 / 0.4;
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(
            WHEELS "ropes: {timing: {around: [{round: a.C, radius: 50 mm, turn: left, grip: yes}, {round: b.C, "
                   "radius: 120 mm, turn: left, grip: yes}], axial_stiffness: 60 kN, preload: 300 N}}\n"
                   "forces: {motor: {joint: a, torque: 4}}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.01);
        CHECK_NEAR(last_q(run)[0], 0.19399101010332, 100 * ways[k].tolerance);
        kempe_trajectory_free(run);
        run = simulate(&l, &ways[k], period / 2);
        double one[3], two[3];
        CHECK_NEAR(at_start(run, "tension(timing_1)"), 300, 1e-9);
        CHECK_NEAR(at_end(run, "tension(timing_1)"), 234.980494148244, 1e4 * ways[k].tolerance);
        CHECK_NEAR(at_end(run, "tension(timing_2)"), 365.019505851756, 1e4 * ways[k].tolerance);
        show(run, "reaction(a)", true, 3, one);
        show(run, "reaction(b)", true, 3, two);
        CHECK_NEAR(two[0], 600 * cosine, 1e4 * ways[k].tolerance);
        CHECK_NEAR(two[1], (365.019505851756 - 234.980494148244) * sine, 1e4 * ways[k].tolerance);
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(one[i], -two[i], 1e-9);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Four falls over four sheaves with grip and J = 0.02 kg m^2: the tension of each part. */
static void a_tackle_turns_its_sheaves(void)
{
    static const double tensions[] = {503.703888334995, 504.681954137587, 506.638085742772, 509.572283150548,
                                      513.484546360917};
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[4096];
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {r: 80 mm, J: 0.02}\nground: {points: {E: [-r, 0, 0], "
                "C: "
                "{at: [2*r, 0, 0], " SEEN "}, D: {at: [6*r, 0, 0], " SEEN "}}}\nbodies:\n"
                "  block: {joint: {name: z, prismatic: z, at: ground}, mass: 200, points: {A: {at: [0, 0, -2], " SEEN
                "}, B: {at: [4*r, 0, -2], " SEEN "}}}\n"
                "  weight: {joint: {name: w, prismatic: z, at: ground}, mass: 60, points: {P: [7*r, 0, -1]}}\n"
                "  a: {joint: {revolute: z, at: block.A}, mass: 0, inertia: {zz: J}, points: {C: [0, 0, 0]}}\n"
                "  b: {joint: {revolute: z, at: block.B}, mass: 0, inertia: {zz: J}, points: {C: [0, 0, 0]}}\n"
                "  c: {joint: {revolute: z, at: ground.C}, mass: 0, inertia: {zz: J}, points: {C: [0, 0, 0]}}\n"
                "  d: {joint: {revolute: z, at: ground.D}, mass: 0, inertia: {zz: J}, points: {C: [0, 0, 0]}}\n"
                "ropes:\n  fall:\n    along:\n      - ground.E\n"
                "      - {round: a.C, radius: r, turn: left, grip: yes}\n"
                "      - {round: c.C, radius: r, turn: right, grip: yes}\n"
                "      - {round: b.C, radius: r, turn: left, grip: yes}\n"
                "      - {round: d.C, radius: r, turn: right, grip: yes}\n      - weight.P\n%s",
                c ? "    slack: no\n" : "");
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.2);
            for (int i = 0; i < 5; i++) {
                char output[32];
                (void)snprintf(output, sizeof output, "tension(fall_%d)", i + 1);
                CHECK_NEAR(at_end(run, output), tensions[i], 1e-7);
            }
            CHECK_NEAR(at_end(run, "qdd(z)"), 0.312981056829511, 1e-9);
            CHECK_NEAR(at_end(run, "q(d)"), -4 * 0.02 * 0.312981056829511 / 0.08, 1e-8);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A pendulum of 1 m meets a peg: the free part is then half as long, and the tension changes from 2 g to 3 g. It swings
 * back and leaves the peg. */
static void a_pendulum_meets_a_peg(void)
{
    static const char *const kinds[] = {"", ", slack: no"};
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(model, sizeof model,
                           "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0], C: [0.05, -0.5, 0]}}\n"
                           "bodies: {m: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: "
                           "{P: [0, 0, 0]}}}\n"
                           "ropes: {rope: {along: [ground.O, {round: ground.C, radius: 50 mm, turn: left, may_leave: "
                           "yes}, m.P]%s}}\n"
                           "start: {q: {x: -0.866025403784439, y: -0.5}, hold: [x]}\n",
                           kinds[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.738218666720129);
            CHECK_NEAR(at_end(run, "wrap(rope.2)"), 1.17039370030793, 10 * ways[k].tolerance);
            CHECK_NEAR(at_end(run, "tension(rope)"), 13.5178079079757, 100 * ways[k].tolerance);
            CHECK_NEAR(at_start(run, "wrap(rope.2)"), 0, 0);
            CHECK_NEAR(at_end(run, "length(rope)"), 1, 10 * ways[k].tolerance);
            const kmp_log_entry *meets = entry(run, "event", 0);
            CHECK(meets && strstr(meets->text, "rope 'rope' is off 'ground.C' became false"));
            if (meets)
                CHECK_NEAR(meets->t, 0.538218666720129, 10 * ways[k].tolerance);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A closed rope that may leave its first place is the one that may leave it in another place of the list. */
static void a_closed_rope_leaves_its_first_place(void)
{
    static const char *const lists[] = {
        "%s, {round: ground.A, radius: 0.1, turn: left}, {round: b.C, radius: 0.1, turn: left}",
        "{round: b.C, radius: 0.1, turn: left}, %s, {round: ground.A, radius: 0.1, turn: left}"};
    static const double at[] = {-0.2, 0.2}; /* inside the rope it is off, outside it presses */
    for (int c = 0; c < 4; c++) {
        char model[1024], list[256];
        (void)snprintf(list, sizeof list, lists[c % 2], "{round: ground.B, radius: 0.1, turn: left, may_leave: yes}");
        (void)snprintf(model, sizeof model,
                       "kempe: 1\nground: {points: {A: [0, 0, 0], B: [0.5, %g, 0]}}\nbodies:\n"
                       "  b: {joint: {prismatic: x, at: ground}, mass: 1, points: {C: [1, 0, 0]}}\n"
                       "ropes: {r: {around: [%s], stiffness: 1000}}\n",
                       at[c / 2], list);
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &ways[3], 0.01);
        const double straight = 2 + 2 * pi * 0.1, over = 1 + 2 * hypot(0.5, at[1]) + 2 * pi * 0.1;
        CHECK_NEAR(at_start(run, "length(r)"), c < 2 ? straight : over, 1e-13);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Off a peg the rope is wound on the next sheave as it lies there: by its path over the peg it would be a turn more. */
static void a_peg_that_is_off_adds_no_turn(void)
{
    loaded l = load_text(
        "kempe: 1\nground: {points: {A: [0, 0, 0], B: [0.5, 0.6, 0], C: [1, 0.1, 0]}}\nbodies:\n"
        "  b: {joint: {prismatic: x, at: ground}, mass: 1, points: {P: [2, 0, 0]}}\n"
        "ropes: {r: {along: [ground.A, {round: ground.B, radius: 0.1, turn: left, may_leave: yes}, {round: ground.C, "
        "radius: 0.1, turn: right}, b.P], stiffness: 1000}}\n");
    kempe_trajectory *run = simulate(&l, &ways[3], 0.01);
    const double wrap = at_start(run, "wrap(r.3)");
    CHECK_NEAR(at_start(run, "wrap(r.2)"), 0, 0);
    CHECK_NEAR(wrap, 2 * (atan2(0.1, 1) + asin(0.1 / hypot(1, 0.1))), 1e-13);
    CHECK_NEAR(at_start(run, "length(r)"), 2 + 0.1 * wrap, 1e-13);
    kempe_trajectory_free(run);
    unload(&l);
}

/* A driven arm stands up at the start: a rope without a length has the length there, in all formulations. */
static void a_start_is_as_driven(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l =
            load_text("kempe: 1\nground: {points: {O: {at: [0, 0, 0], " SEEN "}, E: [0, 0, -1]}}\nbodies:\n"
                      "  arm: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {P: [1, 0, "
                      "0]}}\n"
                      "drives: {turn: {joint: arm, angle: pi/2 + t^2}}\n"
                      "ropes: {r: {along: [ground.E, arm.P], stiffness: 1 kN/m, preload: 3 N}}\n"
                      "sensors: {free: free_length(r)}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.1);
        CHECK_NEAR(at_start(run, "length(r)"), 2, 1e-12);
        CHECK_NEAR(at_end(run, "free"), 2 - 3e-3, 1e-12);
        CHECK_NEAR(at_start(run, "tension(r)"), 3, 1e-9);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A carriage that begins to move at 50 ms pulls a load. A rope without a length keeps its length of the start where the
 * law of the drive switches: its elongation is 2 a m/K (1 - cos(w t)) from there on. */
static void a_start_keeps_its_conditions(void)
{
    static const char *const laws[] = {"max(0, t - 0.05)^2", "if(t < 0.05, 0, (t - 0.05)^2)",
                                       "0.5*(t - 0.05)*(abs(t - 0.05) + t - 0.05)"};
    for (int c = 0; c < (int)(sizeof laws / sizeof *laws); c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(model, sizeof model,
                           "kempe: 1\nbodies:\n"
                           "  carriage: {joint: {prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
                           "  load: {joint: {prismatic: x, at: ground}, mass: 2, points: {P: [0, 0, 0]}}\n"
                           "drives: {pull: {joint: carriage, displacement: \"%s\"}}\n"
                           "ropes: {r: {along: [carriage.P, load.P], stiffness: 1 kN/m}}\nstart: {q: {load: -1}}\n",
                           laws[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.15);
            const double stretch = 2 * 2e-3 * (1 - cos(sqrt(500) * 0.1));
            CHECK_NEAR(at_end(run, "q(load)"), 0.01 - 1 - stretch, 1e-6);
            CHECK_NEAR(at_end(run, "tension(r)"), 1e3 * stretch, 1e-4);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* -- with other studies ---------------------------------------------------------------------------------- */

#define FALLS                                                                                                          \
    "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {r: 0.1, load: 12, p: 0.3}\n"                                       \
    "ground: {points: {C: {at: [0, 0, 0], " SEEN "}, E: [-p, 0, 0]}}\nbodies:\n"                                       \
    "  hook: {joint: {motions: [T1, T3], coordinates: [hx, hz], at: ground}, mass: 20, points: {S: {at: [0, 0, "       \
    "0], " SEEN "}}}\n"                                                                                                \
    "  w: {joint: {motions: [T1, T3], coordinates: [x, z], at: ground}, mass: load, points: {P: [0, 0, 0]}}\n"         \
    "ropes: {fall: {along: [ground.E, {round: hook.S, radius: r, turn: left}, {round: ground.C, radius: 0.1, turn: "   \
    "right}, w.P], %s}}\nstart: {q: {hx: -0.15, hz: -1, x: 0.1, z: -0.8}}\n"

static const char *const falls[] = {"slack: no", "stiffness: 20 kN/m, damping: 1e-3, preload: 90 N"};

/* The length at the start follows parameters: derivatives against differences of runs. */
static void derivatives_follow_parameters(void)
{
    static const char *const outputs[] = {"q(hx)", "q(hz)", "q(z)", "tension(fall)", "length(fall)"};
    for (int c = 0; c < 2; c++) {
        char model[2048];
        kempe_context *context = kempe_context_new();
        (void)snprintf(model, sizeof model, FALLS, falls[c]);
        kempe_sensitivity *s = sensitivity_of("forward", context, model,
                                              "q(hx), q(hz), q(z), tension(fall), length(fall)", "radau", 0.3, 0);
        CHECK(s && s->count == 3 && s->columns == 5 && s->rows == 2);
        for (int p = 0; s && p < s->count; p++) {
            double slope[5];
            slopes_of_runs(s, p, model, 0.3, 5, outputs, slope);
            for (int o = 0; o < 5; o++)
                CHECK_NEAR(last_slope(s, p, o), slope[o], 1e-5 * (1 + fabs(slope[o])));
            CHECK(fabs(slope[0]) > 1e-5);
        }
        kempe_sensitivity_free(s);
        kempe_context_free(context);
    }
}

/* Past the change of slope of a drum with layers accelerations jump, at a time that depends on the parameters. */
static void derivatives_pass_layers(void)
{
    static const char *const text =
        "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {J: 2, m: 100}\nground: {points: {O: {at: [0, 0, 0], " SEEN
        "}}}\ntables: {layers: {x: [0, 3, 30], y: [0.1, 0.15, 0.3], method: linear}}\nbodies:\n"
        "  drum: {joint: {revolute: z, at: ground.O}, mass: 40, inertia: {zz: J}, points: {C: [0, 0, 0]}}\n"
        "  load: {joint: {motions: [T1, T3], coordinates: [x, z], at: ground}, mass: m, points: {P: [0, 0, 0]}}\n"
        "ropes: {r: {along: [{drum: drum.C, radius: layers, wound: 12, turn: right}, load.P]}}\n"
        "start: {q: {x: 0.2, z: -1}}\n";
    kempe_context *context = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of("forward", context, text, "q(drum)", "radau", 0.8, 0);
    CHECK(s && s->count == 2 && s->columns == 1 && s->rows == 2);
    for (int p = 0; s && p < s->count; p++) {
        static const char *const output = "q(drum)";
        double slope;
        slopes_of_runs(s, p, text, 0.8, 1, &output, &slope);
        CHECK_NEAR(last_slope(s, p, 0), slope, 1e-6 * fabs(slope));
    }
    CHECK(s && s->cell[(s->rows - 1) * s->columns * (1 + s->count)] < -9.5);
    kempe_sensitivity_free(s);
    kempe_context_free(context);
}

/* Instances of an ensemble are runs of models with these numbers, lanes of one program together. */
static void instances_are_runs(void)
{
    static const char *const names[] = {"r", "load"};
    static const double values[] = {0.08, 11, 0.09, 12, 0.1, 13, 0.11, 9, 0.12, 10};
    for (int c = 0; c < 2; c++) {
        char model[2048];
        (void)snprintf(model, sizeof model, FALLS, falls[c]);
        instances_are_runs_of(model, names, values, 4);
    }
}

/* A ring of 10 kg hangs in an elastic rope over a sheave: its elongation is m g/k. */
static void a_load_hangs_in_balance(void)
{
    loaded l = load_text(
        "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], " SEEN "}, E: [-0.1, 0, -0.5]}}\n"
        "bodies: {m: {joint: {motions: [T1, T3], coordinates: [x, z], at: ground}, mass: 10, points: {P: [0, 0, 0]}}}\n"
        "ropes: {r: {along: [ground.E, {round: ground.O, radius: 0.1, turn: right}, m.P], stiffness: 4 kN/m, length: "
        "\"1.5 m + 0.1*pi\"}}\nstart: {q: {x: 0.12, z: -1.01}}\n");
    kempe_equilibrium *e = NULL;
    CHECK(kempe_equilibrium_new(l.system, &(kempe_equilibrium_options){0}, &e) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    if (table) {
        CHECK_NEAR(kempe_table_number(table, 0, kempe_table_find(table, "q.x")), 0.1, 1e-9);
        CHECK_NEAR(kempe_table_number(table, 0, kempe_table_find(table, "q.z")), -1 - 98.1 / 4000, 1e-9);
    }
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* A rope of an included file with a prefix: its texts name it as the file does. */
static void an_included_rope_has_its_prefix(void)
{
    FILE *file = fopen("winch_part.yaml", "w");
    CHECK(file != NULL);
    if (!file)
        return;
    (void)fputs(
        "kempe: 1\nparameters: {mu: 0.2}\nbodies:\n"
        "  a: {joint: {prismatic: z, at: ground}, mass: 3, points: {P: [-0.1, 0, -1]}}\n"
        "  b: {joint: {prismatic: z, at: ground}, mass: 1, points: {P: [0.1, 0, -1]}}\n"
        "  post: {joint: {weld: yes, at: ground}, mass: 1, points: {C: {at: [0, 0, 0], " SEEN "}}}\n"
        "ropes: {rope: {along: [a.P, {round: post.C, radius: 0.1, turn: right, friction: mu}, b.P], slack: no}}\n",
        file);
    (void)fclose(file);
    loaded l = load_text("kempe: 1\ngravity: [0, 0, -9.81]\ninclude: [{file: winch_part.yaml, prefix: one_}, {file: "
                         "winch_part.yaml, prefix: two_, set: {mu: 0.1}}]\n");
    kempe_trajectory *run = simulate(&l, &ways[0], 0.05);
    const double e = exp(0.1 * pi);
    CHECK_NEAR(at_end(run, "qdd(one_b)"), 2.26519340463635, 1e-10);
    CHECK_NEAR(at_end(run, "qdd(two_b)"), 9.81 * (3 - e) / (3 + e), 1e-10);
    CHECK_NEAR(at_end(run, "tension(one_rope)"), 12.0751934046364, 1e-10);
    CHECK_NEAR(at_end(run, "wrap(two_rope.2)"), pi, 1e-13);
    kempe_trajectory_free(run);
    unload(&l);
    (void)remove("winch_part.yaml");
}

/* -- what is wrong in a model ------------------------------------------------------------------------------ */

static void refused(void)
{
    static const struct {
        const char *rope, *words;
    } cases[] = {
        {"along: [ground.E, {round: ground.C, radius: 0.6, turn: left}, b.P]",
         "model.yaml:9:12: rope 'r': at the start point 'ground.E' is 100 mm inside the sheave at 'ground.C' (radius "
         "600 mm)"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: up}, b.P]",
         "model.yaml:9:68: rope 'r': the turn is left or right, not 'up'"},
        {"along: [ground.E, {round: ground.C, radius: 0.1}, b.P]", "model.yaml:9:31: rope 'r' has no key 'turn'"},
        {"along: [ground.E, {round: ground.C, turn: left}, b.P]", "rope 'r' has no key 'radius'"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left}, {round: ground.X, radius: 0.1, turn: left}, "
         "b.P]",
         "the axes of 'ground.C' and 'ground.X' are not parallel"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left}, {round: s.P, radius: 0.1, turn: left}, b.P]",
         "the axes of 'ground.C' and 's.P' do not stay parallel, because joint 's' turns about another axis"},
        {"along: [ground.E, b.P], length: 0.4", "its path is 1.5 m long and its length is 0.4 m: it is too short"},
        {"along: [ground.E]", "a path has two places or more"},
        {"along: [ground.E, {drum: ground.C, radius: 0.1, turn: left}, b.P]", "a drum is its first or its last place"},
        {"along: [{round: ground.C, radius: 0.1, turn: left}, b.P]", "a sheave lies between two other places"},
        {"along: [{drum: ground.C, radius: 0.1, turn: left, friction: 0.1}, b.P]",
         "a drum, or a wheel with grip, has no friction"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, friction: 0.1}, b.P]",
         "friction on a sheave is for an elastic rope, or for an inextensible one with 'slack: no'"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, groove: 0.5}, b.P]",
         "groove belongs to friction"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, friction: 0.1, groove: 200 deg}, b.P], slack: "
         "no",
         "is 200 deg: it is at most 180 deg, a flat rim"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, turns: 0.5}, b.P]", "turns of rope 'r' is 0.5"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, turns: 1e9}, b.P]",
         "model.yaml:9:81: turns of rope 'r' is 1e+09: a whole number from 0 to 1000 is expected"},
        {"along: [ground.E, {round: ground.C, radius: layers, turn: left}, b.P]",
         "a sheave has one radius: the table 'layers' is for a drum"},
        {"along: [{drum: ground.C, radius: layers, wound: 7, turn: left}, b.P]",
         "wound of rope 'r' is 7 rad: the table 'layers' has the radius from 0 to 6 rad"},
        {"along: [{drum: ground.C, radius: 0.1, wound: 7, turn: left}, b.P]",
         "wound belongs to a drum whose radius is a table"},
        {"along: [{drum: ground.C, radius: curve, turn: left}, b.P]",
         "the table 'curve' of its radius has the method spline and 3 points: it is 'method: linear'"},
        {"along: [{drum: ground.C, radius: thin, turn: left}, b.P]",
         "has the radius 0 m at 6 rad: it must be positive"},
        {"along: [{drum: ground.C, radius: layers, turn: left}, {round: ground.D, radius: 0.1, turn: left, may_leave: "
         "yes}, b.P]",
         "a rope with a drum whose radius is a table has no sheave with may_leave"},
        {"along: [ground.E, b.P], preload: 10", "preload belongs to a rope with 'stiffness' or 'axial_stiffness'"},
        {"along: [ground.E, b.P], stiffness: 10, preload: 10, length: 2", "the preload follows from 'length'"},
        {"along: [ground.E, b.P], stiffness: 10, slack: no", "an elastic rope only pulls"},
        {"along: [ground.E, b.P], stiffness: 10, axial_stiffness: 10", "exclude each other"},
        {"along: [ground.E, b.P], stiffness: 10, restitution: 0", "restitution belongs to an inextensible rope"},
        {"along: [ground.E, b.P], slack: maybe", "slack is yes or no"},
        {"along: [ground.E, {round: ground.C, teeth: 20, turn: left, grip: yes}, b.P]",
         "a wheel has a radius, or teeth and pitch"},
        {"along: [ground.E, {round: ground.C, teeth: 20, pitch: 8 mm, radius: 0.1, turn: left, grip: yes}, b.P]",
         "a wheel has a radius, or teeth and pitch"},
        {"along: [ground.E, {round: ground.C, teeth: 20, pitch: 8 mm, turn: left}, b.P]",
         "teeth belong to a drum, or to a wheel with 'grip: yes'"},
        {"along: [ground.E, {round: ground.C, teeth: 20.5, pitch: 8 mm, turn: left, grip: yes}, b.P]",
         "is 20.5: a whole number of at least 1 is expected"},
        {"along: [b.P, {round: ground.C, teeth: 20, pitch: 8 mm, turn: left, grip: yes}, {round: ground.D, teeth: "
         "20, pitch: 5 mm, turn: left, grip: yes}, b.P]",
         "is 5 mm, and on another wheel it is 8 mm: a belt or chain has one pitch"},
        {"along: [s.P, s.P]", "all places of its path are fixed to body 's', so that no motion changes its length"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left}, ground.D], stiffness: 10, damping: 0.1",
         "all places of its path are fixed to body 'ground'"},
        {"along: [b.P, q.P]", "are at one place at the start"},
        {"along: [ground.E, b.Q]", "'b' has no point 'Q'"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, grip: yes}, b.P], length: 3",
         "has the length at the start"},
        {"along: [{round: ground.C, radius: 0.1, turn: left, grip: yes}, b.P]",
         "a rope ends on a drum, not on a wheel"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, grip: no}, b.P]", "grip is 'yes' or absent"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, grip: yes, friction: 0.1}, b.P]",
         "a drum, or a wheel with grip, has no friction"},
        {"around: [{round: ground.C, radius: 0.1, turn: left}, {round: ground.D, radius: 0.1, turn: left, may_leave: "
         "yes}]",
         "a closed rope leaves a sheave only if two others remain"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, may_leave: yes}, {round: ground.D, radius: 0.1, "
         "turn: left, may_leave: yes}, b.P]",
         "a rope may leave one of its sheaves"},
        {"around: [{round: ground.C, radius: 0.1, turn: left, grip: yes}, b.P], slack: no",
         "the tensions of a closed belt without slack are not unique"},
        {"along: [ground.E, b.P], around: [ground.E, b.P]", "along, around"},
        {"along: [ground.E, {sphere: ground.C, radius: 0.1, turn: left}, b.P]", "a sphere has a radius and no turn"},
        {"along: [ground.E, {sphere: ground.C}, b.P]", "radius"},
        {"along: [ground.E, {sphere: ground.C, radius: 0.1}, b.P]", "'ground.E', 'ground.C' and 'b.P' are in one line"},
        {"along: [ground.E, {sphere: ground.C, radius: 0.1}, {sphere: ground.D, radius: 0.1}, b.P]",
         "a sphere, or a cylinder with a helix, lies between two points"},
        {"along: [ground.E, {round: ground.C, radius: 0.1, turn: left, helix: yes}, {round: ground.D, radius: 0.1, "
         "turn: left}, b.P]",
         "a sphere, or a cylinder with a helix, lies between two points"},
        {"around: [ground.E, {sphere: ground.C, radius: 0.1}, b.P]",
         "a sphere, or a cylinder with a helix, lies between two points"},
        {"along: [{drum: ground.E, radius: 0.1, turn: left}, ground.X, {sphere: ground.D, radius: 0.1}, b.P], slack: "
         "no",
         "a rope over spheres or helices, or that may leave several sheaves, is open"},
        {"along: [ground.E, b.P], force: 3, length: 2", "a rope with a 'force' has no length"},
        {"along: [ground.E, b.P], force: 3*depth", "depth"},
        {"along: [{drum: ground.E, radius: 0.1, turn: left}, b.P], force: 3*distance",
         "a rope with a 'force' has neither drums nor friction"},
        {"along: [ground.E, b.P], force: tension(r)", "tension of rope 'r' is its 'force'"},
        {"around: [{drum: ground.C, radius: 0.1, turn: left}, b.P]", "a drum is its first or its last place"},
        {"along: [ground.E, b.P]}, f: {along: [ground.E, b.P]", "the section contacts has 'f', the name of its own"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[2048];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\nground: {points: {E: [0, 0, 0], C: [0.5, 0, 0], D: [0.8, 0, 0], X: {at: [1, 0, 0], "
            "axes: {z: x}}}}\ntables: {layers: {x: [0, 6], y: [0.1, 0.2], method: linear}, thin: {x: [0, 6], "
            "y: [0.1, 0], method: linear}, curve: {x: [0, 3, 6], y: [0.1, 0.1, 0.2]}}\n"
            "bodies:\n"
            "  b: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: {P: [1.5, "
            "0, 0]}}\n"
            "  s: {joint: {revolute: x, at: ground}, mass: 1, inertia: {xx: 1}, points: {P: [1, 0, 0]}}\n"
            "  q: {joint: {name: q, prismatic: x, at: ground}, mass: 1, points: {P: [1.5, 0, 0]}}\n"
            "contacts: {f: {joint: x, lower: -9, restitution: 0}}\nropes: {r: {%s}}\n",
            cases[k].rope);
        load_rejected(text, cases[k].words);
    }
}

/* A mass of 2 kg on a rope that pulls and pushes with 200 N/m round a sheave: x = 1 + 0.2 cos(10 t) from its end. An
 * equal force along an expression is the same one. */
static void a_rope_may_push(void)
{
    static const char *const kinds[] = {
        "ropes: {r: {along: [ground.A, {round: ground.C, radius: 0.1, turn: right}, b.P], force: \"200*(distance - 1.3 "
        "- "
        "0.05*pi) + (0 s)*rate\"}}\nforces: {f: {joint: x, force: 0}}\n",
        "ropes: {r: {along: [ground.A, {round: ground.C, radius: 0.1, turn: right}, b.P], force: 0}}\n"
        "forces: {f: {sliding: length(r) - q(x)/4, force: -800/3*(distance + q(x)/4 - 1.3 - 0.05*pi)}}\n"};
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(model, sizeof model,
                           "kempe: 1\nground: {points: {A: [-0.3, 0.1, 0], C: [0, 0, 0], S: [0.1, 0, 0]}}\nbodies:\n"
                           "  b: {joint: {name: x, prismatic: -y, at: ground.S}, mass: 2, points: {P: [0, 0, 0]}}\n"
                           "%sstart: {q: {x: 1.2}}\n",
                           kinds[c]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.25);
            CHECK_NEAR(at_end(run, "q"), 1 + 0.2 * cos(2.5), ways[k].tolerance);
            CHECK_NEAR(at_end(run, c == 0 ? "tension(r)" : "force(f)"), c == 0 ? 40 * cos(2.5) : -40 * cos(2.5) / 0.75,
                       300 * ways[k].tolerance);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* The way over a peg of r = 0.1 m whose top is the first end's height, to an end that is h below it 1 m further. */
static double over_peg(double h, double *wrap)
{
    const double far = hypot(0.5, 0.1 - h);
    *wrap = h > 0 ? pi / 2 - atan2(0.1 - h, 0.5) - acos(0.1 / far) : 0;
    return h > 0 ? 0.5 + 0.1 * *wrap + sqrt(far * far - 0.01) : hypot(1, h);
}

/* A rope over two pegs with points between them meets one while it leaves the other. */
static void two_pegs_may_be_left(void)
{
    loaded l = load_text(
        "kempe: 1\nground: {points: {A: [-0.5, 0, 0], B: [0, -0.1, 0], M: [1, 0, 0], C: [1.5, -0.1, 0]}}\nbodies:\n"
        "  a: {joint: {name: x, prismatic: -y, at: ground}, mass: 1, points: {P: [0.5, 0, 0]}}\n"
        "  b: {joint: {name: y, prismatic: -y, at: ground}, mass: 1, points: {P: [2, 0, 0]}}\n"
        "ropes: {r: {along: [ground.A, {round: ground.B, radius: 0.1, turn: right, may_leave: yes}, a.P, ground.M, "
        "{round: ground.C, radius: 0.1, turn: right, may_leave: yes}, b.P], force: 0}}\n"
        "start: {q: {x: -0.2, y: 0.3}, qd: {x: 1, y: -1}}\n");
    kempe_trajectory *run = simulate(&l, &ways[0], 0.5);
    for (int last = 0; last < 2; last++) {
        double x, wrap[2];
        const double h = last ? 0.3 : -0.2, length = over_peg(h, &wrap[0]) + over_peg(0.1 - h, &wrap[1]);
        show(run, "length(r)", last, 1, &x);
        CHECK_NEAR(x, length + hypot(0.5, h), 1e-9);
        show(run, "wrap(r.2)", last, 1, &x);
        CHECK_NEAR(x, wrap[0], 1e-9);
        show(run, "wrap(r.5)", last, 1, &x);
        CHECK_NEAR(x, wrap[1], 1e-9);
    }
    kempe_trajectory_free(run);
    unload(&l);
}

/* Runs end where a rope leaves its sheave, or has no free part left. */
static void runs_end_with_a_name(void)
{
    static const struct {
        const char *start, *words;
    } cases[] = {{"q: {x: 2, y: -0.3}, qd: {x: 0, y: 10}", "rope 'r' leaves the sheave at 'ground.C'"},
                 {"q: {x: 1.6, y: 0.4}, qd: {x: -10, y: 0}", "rope 'r': 'ground.C' and 'b.P' touch"}};
    for (int c = 0; c < 2; c++) {
        char model[1024];
        (void)snprintf(model, sizeof model,
                       "kempe: 1\nground: {points: {A: [0, 0, 0], C: [1, 0.5, 0]}}\nbodies:\n"
                       "  b: {joint: {motions: [T1, T2], coordinates: [x, y], at: ground}, mass: 1, points: {P: [0, 0, "
                       "0]}}\n"
                       "ropes: {r: {along: [ground.A, {round: ground.C, radius: 0.2, turn: right}, b.P], stiffness: 1 "
                       "N/m, length: 9}}\nstart: {%s}\n",
                       cases[c].start);
        loaded l = load_text(model);
        for (int k = 0; k < 6; k += 3) {
            kempe_status status;
            kempe_trajectory *run = simulate_any(&l, &ways[k], 1, &status);
            CHECK(status != KEMPE_OK);
            if (run && !strstr(kempe_trajectory_reason(run), cases[c].words))
                CHECK_TEXT(kempe_trajectory_reason(run), cases[c].words);
            kempe_trajectory_free(run);
        }
        unload(&l);
    }
}

int main(void)
{
    TEST(a_path_has_its_length);
    TEST(a_rope_over_the_middle_of_a_sphere_ends_the_run);
    TEST(turns_and_offsets_count);
    TEST(smooth_bodies_have_the_shortest_way);
    TEST(a_string_unwinds);
    TEST(a_bungee_catches);
    TEST(a_rope_becomes_taut_with_an_impact);
    TEST(a_capstan_holds_and_slips);
    TEST(a_short_run_decides_as_a_long_one);
    TEST(friction_turns_a_sheave);
    TEST(capstans_act_one_after_another);
    TEST(a_level_has_friction_that_slips);
    TEST(a_peg_that_is_off_has_no_friction);
    TEST(a_tackle_has_four_falls);
    TEST(a_load_turns_a_drum);
    TEST(a_carriage_feels_the_rim);
    TEST(layers_have_their_length);
    TEST(a_load_unwinds_layers);
    TEST(a_winch_does_work);
    TEST(a_winch_by_law_lifts);
    TEST(a_carrier_may_turn);
    TEST(a_closed_rope_leaves_its_first_place);
    TEST(a_peg_that_is_off_adds_no_turn);
    TEST(a_start_is_as_driven);
    TEST(a_start_keeps_its_conditions);
    TEST(belts_have_their_lengths);
    TEST(a_chain_has_teeth);
    TEST(a_timing_belt_oscillates);
    TEST(a_tackle_turns_its_sheaves);
    TEST(a_pendulum_meets_a_peg);
    TEST(derivatives_follow_parameters);
    TEST(derivatives_pass_layers);
    TEST(instances_are_runs);
    TEST(a_load_hangs_in_balance);
    TEST(an_included_rope_has_its_prefix);
    TEST(a_rope_may_push);
    TEST(two_pegs_may_be_left);
    TEST(refused);
    TEST(runs_end_with_a_name);
    return check_report();
}
