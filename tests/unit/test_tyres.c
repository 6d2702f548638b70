/* SPDX-License-Identifier: BSD-3-Clause */
/* Tyres on roads: forces against digits of the Magic Formula and of the brush model that were computed elsewhere,
 * transient slip and steady cornering against closed forms, roads that move or rise, and what is wrong in a model or a
 * file. */
/* wings: road analyses ensemble */
#include "base/context.h"
#include "base/memory.h"
#include "compared_runs.h"
#include "sensitivity_of.h"
#include "ways.h"
#include <kempe/ensemble.h>
#include <kempe/equilibrium.h>
#include <kempe/table.h>
#include <math.h>
#include <stdlib.h>

#define HERE KEMPE_ROOT "/examples/quarter_car_on_tyre/model.yaml"

enum { ALONG, ACROSS, UP, MX, MY, MZ };

/* Values of an output at the first row, or at the last one. */
static void show(const kempe_trajectory *run, const char *output, int count, bool last, double *x)
{
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, output, &table) == KEMPE_OK);
    const int row = run && last ? kempe_trajectory_row_count(run) - 1 : 0;
    for (int k = 0; k < count; k++)
        x[k] = table ? kempe_table_number(table, row, 1 + k) : NAN;
    kempe_table_free(table);
}

/* A wheel of five coordinates over a plane, at a vertical force and slips. */
typedef struct state {
    double load, kappa, alpha, gamma;
} state;

static const double radius = 0.313, stiffness = 2e5, speed = 20;

static void write_wheel(char *text, size_t size, const state *s, const char *tyre)
{
    const double depth = s->load / stiffness;
    (void)snprintf(
        text, size,
        "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nroads: {street: {flat: ground.O}}\n"
        "tyres: {T: {on: street, at: wheel.C, low_speed: 1e-9, %s}}\nbodies:\n"
        "  wheel: {joint: {motions: [T1, T2, T3, R1, R2], coordinates: [x, y, z, lean, spin], at: ground.O}, "
        "mass: 10, inertia: {xx: 1, yy: 1, zz: 1}, points: {C: [0, 0, 0]}}\n"
        "start: {q: {z: %.17g, lean: %.17g}, qd: {x: %.17g, y: %.17g, spin: %.17g}}\n",
        tyre, (radius - depth) * cos(s->gamma), s->gamma, speed, speed * tan(s->alpha),
        (1 + s->kappa) * speed / (radius - depth / 3));
}

static void force_of(const state *s, const char *tyre, double force[6])
{
    char text[2048];
    write_wheel(text, sizeof text, s, tyre);
    loaded l = load_text_as(text, HERE);
    kempe_trajectory *run = simulate(&l, &ways[0], 1e-9);
    show(run, "force(T)", 6, false, force);
    kempe_trajectory_free(run);
    unload(&l);
}

#define CAR "file: passenger_car_tyre.tir, vertical_damping: 0"
#define BRUSH                                                                                                          \
    "model: brush, radius: 0.313, vertical_stiffness: 2e5, tread_stiffness: 12e6, half_length: 60 mm, friction: 0.9"

/* -- digits ---------------------------------------------------------------------------------------------- */

static void the_magic_formula_has_its_digits(void)
{
    static const struct {
        state at;
        double along, across, by_angle, moment;
    } cases[] = {{{4000, 0.1, 0, 0}, 4642.1344163127, 243.0452381432, 243.0452381432, 59.64403457473},
                 {{4000, 0, -0.1, 0}, -102.6000852289, 3523.9268014936, 3518.6662563846, -69.83375798196},
                 {{4000, -0.1, 0.07, 0.05}, -3796.1032247413, -2622.9904866382, -2620.3811024286, -94.72023637022},
                 {{2500, 0.03, -0.04, -0.03}, 1166.9371056278, 1338.7910293018, 1338.2162112523, -12.21589892136},
                 {{7000, -0.2, 0.15, 0}, -5774.0744017950, -3718.7868044598, -3712.1406925189, -114.36103039317}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double force[6];
        force_of(&cases[k].at, CAR, force);
        CHECK_NEAR(force[ALONG], cases[k].along, 1e-12);
        CHECK_NEAR(force[ACROSS], cases[k].across, 1e-12);
        CHECK_NEAR(force[UP], cases[k].at.load, 1e-12);
        CHECK_NEAR(force[MZ], cases[k].moment, 1e-11);
        CHECK_NEAR(force[MY], -0.01 * cases[k].at.load * radius, 1e-12);
        force_of(&cases[k].at, CAR ", slip_angle: angle", force);
        CHECK_NEAR(force[ACROSS], cases[k].by_angle, 1e-12);
    }
}

/* Forces of another implementation, with ten digits, whose pure lateral force is over alpha. */
static void another_implementation_agrees(void)
{
    static const double g = 0.06981317008;
    static const struct {
        state at;
        double along, across;
    } cases[] = {{{4000, -.25, -.17, -g}, -3563.509474, 2426.077379},
                 {{4000, -.25, -.17, g}, -3563.509474, 2171.18107},
                 {{4000, .1, .068, -g}, 3799.959267, -1925.658286},
                 {{2000, 0, .105, g}, -58.87689376, -1981.821918},
                 {{2000, 0, -.105, -g}, -65.662769, 2147.5905},
                 {{4000, 0, -.0105, 0}, -172.5827279, 524.5801337},
                 {{4000, -.05, .102, g}, -2069.06822, -3638.035533},
                 {{6000, .06, 0, 0}, 6020.91493, NAN},
                 {{8000, -.12, 0, 0}, -9380.671988, NAN},
                 {{2000, .03, 0, 0}, 977.4660065, NAN}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double force[6];
        force_of(&cases[k].at, CAR ", slip_angle: angle", force);
        CHECK_NEAR(force[ALONG], cases[k].along, 2e-10);
        if (!isnan(cases[k].across))
            CHECK_NEAR(force[ACROSS], cases[k].across, 4e-10);
    }
}

static void the_brush_has_its_digits(void)
{
    static const struct {
        double alpha, across, moment;
    } cases[] = {{0.02, 1466.42819212540, 20.485020764537},
                 {0.05, 2823.69657600431, 18.646823786172},
                 {0.12, 3599.84076643245, 0.009216133458}};
    double force[6];
    for (int k = 0; k < 3; k++) {
        force_of(&(state){4000, 0, cases[k].alpha, 0}, BRUSH, force);
        CHECK_NEAR(force[ACROSS], -cases[k].across, 1e-12);
        CHECK_NEAR(force[MZ], cases[k].moment, 1e-11);
    }
    /* sigma = (-0.04, tan 0.03) = (kappa, tan alpha)/(1 + kappa) */
    const double rolls = 1 / 1.04;
    force_of(&(state){4000, rolls - 1, atan(tan(0.03) * rolls), 0}, BRUSH, force);
    CHECK_NEAR(hypot(force[ALONG], force[ACROSS]), 2822.56802611842, 1e-12);
    CHECK_NEAR(force[ALONG], -2257.81046612542, 1e-12);
    /* It slides as a whole: mu F_z against the slip; a locked wheel too. */
    force_of(&(state){4000, 0, -0.3, 0}, BRUSH, force);
    CHECK_NEAR(force[ACROSS], 3600, 1e-12);
    CHECK_NEAR(force[MZ], 0, 1e-12);
    force_of(&(state){4000, -1, 0, 0}, BRUSH, force);
    CHECK_NEAR(force[ALONG], -3600, 1e-12);
}

/* The same tyre on the other side has the mirrored forces. */
static void a_mirrored_tyre(void)
{
    double left[6], right[6];
    force_of(&(state){4000, -0.1, 0.07, 0.05}, CAR, left);
    force_of(&(state){4000, -0.1, -0.07, -0.05}, CAR ", side: right", right);
    for (int k = 0; k < 6; k++)
        CHECK_NEAR(right[k], k == ACROSS || k == MX || k == MZ ? -left[k] : left[k], 1e-12);
}

/* Modes leave out forces, and the weights of combined slip. */
static void modes_of_a_file(void)
{
    const state at = {4000, 0.1, 0.05, 0};
    double all[6], alone[6], along[6], across[6], none[6];
    force_of(&at, CAR, all);
    force_of(&at, CAR ", mode: 3", alone);
    force_of(&at, CAR ", mode: 1", along);
    force_of(&at, CAR ", mode: 2", across);
    force_of(&at, CAR ", mode: 0", none);
    CHECK(fabs(all[ALONG]) < 0.98 * fabs(alone[ALONG]) && fabs(all[ACROSS]) < 0.9 * fabs(alone[ACROSS]));
    CHECK(along[ALONG] == alone[ALONG] && along[ACROSS] == 0 && along[MY] < 0);
    CHECK(across[ACROSS] == alone[ACROSS] && across[ALONG] == 0 && across[MZ] == alone[MZ]);
    CHECK(none[ALONG] == 0 && none[ACROSS] == 0 && none[MY] == 0);
    CHECK_NEAR(none[UP], 4000, 1e-12);
}

/* -- motions --------------------------------------------------------------------------------------------- */

/* At 15 m/s the slip angle steps to 0.03: tan(alpha') = tan(0.03)(1 - exp(-V t/sigma)). */
static void transient_slip_follows(void)
{
    for (int k = 0; k < WAYS; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nroads: {street: {flat: ground.O}}\n"
                       "tyres: {T: {on: street, at: wheel.C, low_speed: 1e-9, transient: yes, longitudinal_relaxation: "
                       "0.2, lateral_relaxation: 0.4, " BRUSH "}}\nbodies: {wheel: {joint: {motions: [T1, T2, R2], "
                       "coordinates: [x, y, spin], at: ground.P}, mass: 1, inertia: {yy: 1}, points: {C: [0, 0, 0]}}}\n"
                       "ground: {points: {O: [0, 0, 0], P: [0, 0, 0.293]}}\n"
                       "drives: {a: {joint: x, displacement: \"15*t\"}, b: {joint: y, displacement: \"%.17g*t\"}, c: "
                       "{joint: spin, angle: \"15/(%.17g)*t\"}}\nrun: {t_end: 0.02}\n",
                       15 * tan(0.03), radius - 0.02 / 3);
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[k], 0.02);
        CHECK_NEAR(at_end(run, "state(T.alpha)") / tan(0.03), 0.527633447259, 1e-9 + ways[k].tolerance);
        CHECK_NEAR(at_end(run, "state(T.kappa)"), 0, 1e-9);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A torque M against the drag D v^2: the force of the tyre is M over the height of the axle. Slip as a state hides from
 * the spin what resists it. */
static void a_driven_wheel_rolls_steadily(void)
{
    static const char *const slips[] = {"", ", transient: yes, longitudinal_relaxation: 0.2, lateral_relaxation: 0.4"};
    for (int k = 0; k < 2; k++) {
        char text[1024];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\ngravity: [0, 0, -9.81]\nroads: {street: {flat: ground.O}}\n"
            "tyres: {T: {on: street, at: wheel.C, " BRUSH "%s}}\n"
            "bodies: {wheel: {joint: {motions: [T1, T3, R2], coordinates: [x, z, spin], at: ground.O}, mass: "
            "160, inertia: {yy: 2}, points: {C: [0, 0, 0]}}}\nground: {points: {O: [0, 0, 0]}}\n"
            "forces: {motor: {joint: spin, torque: 20}, air: {joint: x, force: -0.6*qd(x)^2}}\n"
            "start: {q: {z: 0.3}, qd: {x: 9, spin: 30}}\n",
            slips[k]);
        loaded l = load_text(text);
        kempe_equilibrium *e = NULL;
        kempe_table *table = NULL;
        CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
        CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
        const double height = radius - 160 * 9.81 / stiffness;
        CHECK_NEAR(table ? kempe_table_number(table, 0, kempe_table_find(table, "qd.x")) : NAN, sqrt(20 / height / 0.6),
                   1e-9);
        kempe_table_free(table);
        kempe_equilibrium_free(e);
        unload(&l);
    }
}

/* A single track with the steer angle d at the forward velocity u: its lateral velocity v and its yaw rate w solve the
 * balance of lateral forces and of moments, with the brush in closed form. */
typedef struct single_track {
    double u, a, b, steer, mass, low;
} single_track;

static void balance(const single_track *c, const double x[2], double out[2])
{
    const double theta = 2 * 12e6 * 0.06 * 0.06 / (3 * 0.9 * 4000);
    out[0] = -c->mass * c->u * x[1];
    out[1] = 0;
    for (int k = 0; k < 2; k++) {
        const double arm = k ? -c->b : c->a, turned = k ? 0 : c->steer, side = x[0] + arm * x[1];
        const double along = c->u * cos(turned) + side * sin(turned), across = side * cos(turned) - c->u * sin(turned);
        const double s = across / hypot(along, c->low), u = theta * fabs(s);
        const double size = 0.9 * 4000 * (3 * u - 3 * u * u + u * u * u), force = s > 0 ? -size : size;
        const double trail = 0.06 * pow(1 - u, 3) / (3 - 3 * u + u * u);
        out[0] += force * cos(turned);
        out[1] += arm * force * cos(turned) - trail * force;
    }
}

static void a_single_track_turns_steadily(void)
{
    single_track c = {0, 1.2, 1.4, 0.05, 815.494, 1};
    char text[3072];
    (void)snprintf(
        text, sizeof text,
        "kempe: 1\nparameters: {P: 2e4 N*s/m, V: 15 m/s}\n"
        "ground: {points: {O: [0, 0, 0], P: [0, 0, 0.293]}}\nroads: {street: {flat: ground.O}}\n"
        "tyres: {F: {on: street, at: front.C, low_speed: 1, " BRUSH
        "}, R: {on: street, at: rear.C, low_speed: 1, " BRUSH "}}\nbodies:\n"
        "  car: {joint: {motions: [T1, T2, R3], coordinates: [x, y, yaw], at: ground.P}, mass: %.17g, inertia: {zz: "
        "1500}, "
        "points: {G: [0, 0, 0], F: {at: [%.17g, 0, 0], axes: {x: [%.17g, %.17g, 0], z: z}}, R: [%.17g, 0, 0]}}\n"
        "  front: {joint: {revolute: y, at: car.F}, mass: 1e-9, inertia: {yy: 1}, points: {C: [0, 0, 0]}}\n"
        "  rear: {joint: {revolute: y, at: car.R}, mass: 1e-9, inertia: {yy: 1}, points: {C: [0, 0, 0]}}\n"
        "sensors: {u: \"qd(x)*cos(q(yaw)) + qd(y)*sin(q(yaw))\", v: \"qd(y)*cos(q(yaw)) - qd(x)*sin(q(yaw))\"}\n"
        "forces: {push: {at: car.G, force: [\"P*(V - qd(x)*cos(q(yaw)) - qd(y)*sin(q(yaw)))*cos(q(yaw))\", \"P*(V - "
        "qd(x)*cos(q(yaw)) - "
        "qd(y)*sin(q(yaw)))*sin(q(yaw))\", 0]}}\n"
        "start: {qd: {x: 15, front: 49, rear: 49}}\n",
        c.mass, c.a, cos(c.steer), sin(c.steer), -c.b);
    loaded l = load_text(text);
    kempe_trajectory *run = simulate(&l, &ways[1], 30);
    double x[2] = {0, 0.2}, front[6];
    c.u = at_end(run, "sensor(u)");
    for (int step = 0; step < 40; step++) {
        double at[2], by[2][2];
        balance(&c, x, at);
        balance(&c, (const double[]){x[0] + 1e-7, x[1]}, by[0]);
        balance(&c, (const double[]){x[0], x[1] + 1e-7}, by[1]);
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < 2; i++)
                by[k][i] = (by[k][i] - at[i]) / 1e-7;
        const double det = by[0][0] * by[1][1] - by[1][0] * by[0][1];
        x[0] -= (at[0] * by[1][1] - by[1][0] * at[1]) / det;
        x[1] -= (by[0][0] * at[1] - by[0][1] * at[0]) / det;
    }
    CHECK(c.u > 14 && c.u < 15 && x[1] > 0.1 && x[1] < 0.5);
    CHECK_NEAR(at_end(run, "qd(yaw)"), x[1], 1e-8);
    CHECK_NEAR(at_end(run, "sensor(v)"), x[0], 1e-8);
    show(run, "force(F)", 6, true, front);
    CHECK_NEAR(front[ALONG], 0, 1e-4);
    CHECK(front[ACROSS] > 1000);
    kempe_trajectory_free(run);
    unload(&l);
}

/* A road on a body that moves: force and moment on it are opposite, so that momentum and its moment are constant. */
static void a_road_that_moves(void)
{
    static const char *const tyres[] = {CAR, BRUSH};
    for (int k = 0; k < 2; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nroads: {belt: {flat: slab.S, friction: 0.8}}\n"
                       "tyres: {T: {on: belt, at: wheel.C, %s}}\nbodies:\n"
                       "  slab: {joint: {motions: [T1, T2, T3, R1, R2, R3], coordinates: [x, y, z, a, b, c], at: "
                       "ground.O}, mass: 50, inertia: "
                       "{xx: 5, yy: 6, "
                       "zz: 7}, points: {S: [0.1, 0.05, 0.2]}}\n"
                       "  wheel: {joint: {motions: [T1, T2, T3, R3, R1, R2], coordinates: [u, v, w, d, e, f], at: "
                       "ground.O}, mass: 10, "
                       "inertia: {xx: 0.5, yy: 0.9, zz: 0.5}, points: {C: [0, 0, 0]}}\n"
                       "start: {q: {w: 0.495, d: 0.1, e: 0.05}, qd: {u: 10, v: 0.3, f: 35, x: -2, a: 0.1, c: 0.2}}\n",
                       tyres[k]);
        loaded l = load_text_as(text, HERE);
        kempe_trajectory *run = simulate(&l, &ways[1], 5e-3);
        double first[3], last[3], energy;
        show(run, "momentum", 3, false, first);
        show(run, "momentum", 3, true, last);
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(last[i], first[i], 1e-9);
        show(run, "angular_momentum(about ground.O)", 3, false, first);
        show(run, "angular_momentum(about ground.O)", 3, true, last);
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(last[i], first[i], 1e-9);
        show(run, "force(T)", 1, true, &energy);
        CHECK(fabs(energy) > 1);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A height that rises at 1 : 10 is a plane whose axes are turned. */
static void a_height_is_a_plane(void)
{
    static const char *const roads[] = {"{at: ground.O, height: \"0.1*x\"}", "{at: ground.O, height: line}",
                                        "{flat: ground.P}"};
    double force[3][6];
    for (int k = 0; k < 3; k++) {
        char text[2048];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\ntables: {line: {x: [-10, 10], y: [-1, 1], method: linear}}\n"
            "ground: {points: {O: [0, 0, 0], P: {at: [0, 0, 0], axes: {x: [1, 0, 0.1], z: [-0.1, 0, 1]}}}}\nroads: "
            "{street: "
            "%s}\n"
            "tyres: {T: {on: street, at: wheel.C, file: passenger_car_tyre.tir}}\nbodies: {wheel: {joint: {motions: "
            "[T1, "
            "T2, T3, R3, R2], coordinates: [x, y, z, yaw, spin], at: ground.O}, mass: 10, inertia: {xx: 1, yy: 1, zz: "
            "1}, "
            "points: {C: [0, 0, 0]}}}\nstart: {q: {x: 1, z: 0.395, yaw: 0.1}, qd: {x: 10, z: 0.5, spin: 33}}\n",
            roads[k]);
        loaded l = load_text_as(text, HERE);
        kempe_trajectory *run = simulate(&l, &ways[0], 2e-3);
        show(run, "force(T)", 6, true, force[k]);
        kempe_trajectory_free(run);
        unload(&l);
    }
    for (int i = 0; i < 6; i++) {
        CHECK_NEAR(force[0][i], force[2][i], 1e-9);
        CHECK_NEAR(force[1][i], force[2][i], 1e-9);
    }
    CHECK(force[2][UP] > 1000);
}

#define CORNER                                                                                                         \
    "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {k: 2e4, Cz: 2e5, mu: 0.9}\nground: {points: {O: [0, 0, 0]}}\n"     \
    "roads: {street: {at: ground.O, height: \"0.01*sin(3*x)\", friction: mu}}\ntyres: {T: {on: street, at: wheel.C, "  \
    "model: brush, radius: 0.313, vertical_stiffness: Cz, vertical_damping: 100, tread_stiffness: 12e6, half_length: " \
    "60 mm, friction: 1, rolling_resistance: 0.01}}\nbodies:\n"                                                        \
    "  body: {joint: {motions: [T1, T3], coordinates: [x, z], at: ground.O}, mass: 350, points: {S: [0, 0, 0]}}\n"     \
    "  carrier: {joint: {motions: [T3], coordinates: [u], at: body.S}, mass: 30, points: {A: [0, 0, 0]}}\n"            \
    "  wheel: {joint: {motions: [R2], coordinates: [spin], at: carrier.A}, mass: 15, inertia: {yy: 0.9}, points: {C: " \
    "[0, 0, 0]}}\nforces: {s: {joint: u, spring: {stiffness: k, damping: 1500, rest: -0.37}}}\n"                       \
    "start: {q: {z: 0.493, u: -0.2}, qd: {x: 10, spin: 31}}\n"

static void all_formulations_agree(void)
{
    double x[4] = {0};
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(CORNER);
        kempe_trajectory *run = simulate(&l, &ways[k], 0.3);
        for (int i = 0; run && i < 4; i++) {
            x[i] = k == 0 ? last_q(run)[i] : x[i];
            CHECK_NEAR(last_q(run)[i], x[i], 10 * ways[k].tolerance);
        }
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Derivatives against differences of runs, of x, z and spin at an end. */
static void differences_agree(const char *text, double t_end)
{
    static const char *const outputs[] = {"q(x)", "q(z)", "q(spin)"};
    kempe_context *context = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of("forward", context, text, "q(x), q(z), q(spin)", "radau", t_end, 0);
    CHECK(s && s->count == 3 && s->columns == 3 && s->rows == 2);
    for (int p = 0; s && p < s->count; p++) {
        double slope[3];
        slopes_of_runs(s, p, text, t_end, 3, outputs, slope);
        for (int o = 0; o < 3; o++)
            CHECK_NEAR(last_slope(s, p, o) * s->parameter[p], slope[o] * s->parameter[p], 1e-5);
        CHECK(fabs(slope[2] * s->parameter[p]) > 1e-6);
    }
    kempe_sensitivity_free(s);
    kempe_context_free(context);
}

static void derivatives_follow_parameters(void)
{
    differences_agree(CORNER, 0.3);
}

/* Tangential forces jump where a road has a kink: at the time of it, which depends on parameters. */
static void derivatives_pass_kinks(void)
{
    static const char *const heights[] = {"0.05*max(x - 1, 0)", "0.02*abs(x - 1) + 0.01*min(x, 1.2)", "hump", "held",
                                          "curve"};
    for (size_t k = 0; k < sizeof heights / sizeof *heights; k++) {
        char text[2048];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\nparameters: {Cz: 2e5, mu: 0.9, v: "
            "5}\ntables:\n"
            "  hump: {x: [-10, 1, 1.5, 2, 50], y: [0, 0, 0.02, 0.01, 0], method: linear}\n"
            "  held: {x: [-1, 1, 1.05], y: [0, 0, 0.002], method: linear, outside: hold}\n"
            "  curve: {x: [-1, 0, 0.5, 1, 1.05], y: [0, 0, 0.001, 0, 0.002], outside: hold}\n"
            "roads: {street: {at: ground.O, height: \"%s\"}}\n"
            "tyres: {T: {on: street, at: wheel.C, model: brush, radius: 0.3, vertical_stiffness: Cz, "
            "vertical_damping: 2000, tread_stiffness: 1e7, half_length: 0.06, friction: mu}}\n"
            "bodies: {wheel: {joint: {motions: [T1, T3, R2], coordinates: [x, z, spin], at: ground.O}, mass: 100, "
            "inertia: {yy: 2}, points: {C: [0, 0, 0.295]}}}\nstart: {qd: {x: v, spin: 16.5}}\n",
            k < 2    ? heights[k]
            : k == 2 ? "hump(x)"
            : k == 3 ? "held(x)"
                     : "curve(x)");
        /* the curve ends with a curvature, at a place that rounding may put on either side */
        differences_agree(text, k < 4 ? 0.4 : 0.36);
    }
}

/* Instances of an ensemble, lanes of one program together, are runs of models with these numbers. */
static void instances_are_runs(void)
{
    static const char *const names[] = {"Cz", "mu"};
    static const double values[] = {2e5, 0.9, 1.8e5, 0.8, 2.2e5, 0.7, 1.9e5, 1, 2.1e5, 0.6};
    instances_are_runs_of(CORNER, names, values, 4);
}

/* A wheel of 100 kg stands: its deflection is m g/C. */
static void a_wheel_stands(void)
{
    loaded l =
        load_text_as("kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\nroads: {street: {flat: "
                     "ground.O}}\ntyres: {T: {on: street, at: wheel.C, file: passenger_car_tyre.tir}}\nbodies: "
                     "{wheel: {joint: {prismatic: z, at: ground.O}, mass: 100, points: {C: [0, 0, 0]}}}\n"
                     "start: {q: {wheel: 0.3}}\n",
                     HERE);
    kempe_equilibrium *e = NULL;
    CHECK(kempe_equilibrium_new(l.system, &(kempe_equilibrium_options){0}, &e) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    if (table)
        CHECK_NEAR(kempe_table_number(table, 0, kempe_table_find(table, "q.wheel")), 0.313 - 981 / 2e5, 1e-12);
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* A wheel that only moves upwards: its joint carries the other forces and moments of the tyre, which are in the table
 * of reactions as well. */
static void joints_carry_tyres(void)
{
    loaded l = load_text_as(
        "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nroads: {street: {flat: ground.O}}\ntyres: {T: {on: "
        "street, at: wheel.C, file: passenger_car_tyre.tir, vertical_damping: 0}}\nbodies: {wheel: {joint: "
        "{prismatic: z, at: ground.O}, mass: 100, points: {C: [0, 0, 0]}}}\nstart: {q: {wheel: 0.293}}\n",
        HERE);
    kempe_trajectory *run = simulate(&l, &ways[0], 1e-6);
    double force[6], reaction[3], moment[3];
    show(run, "force(T)", 6, false, force);
    show(run, "reaction(wheel)", 3, false, reaction);
    show(run, "moment(wheel)", 3, false, moment);
    CHECK_NEAR(force[UP], 4000, 1e-12);
    CHECK(fabs(force[ALONG]) > 10 && fabs(force[ACROSS]) > 10 && fabs(force[MZ]) > 1);
    CHECK_NEAR(reaction[0], -force[ALONG], 1e-12);
    CHECK_NEAR(reaction[1], -force[ACROSS], 1e-12);
    CHECK_NEAR(moment[0], -0.293 * force[ACROSS] - force[MX], 1e-12);
    CHECK_NEAR(moment[1], 0.293 * force[ALONG] - force[MY], 1e-12);
    CHECK_NEAR(moment[2], -force[MZ], 1e-12);
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_table(run, "reactions", &table) == KEMPE_OK);
    bool found = false;
    for (int k = 0; table && k < kempe_table_row_count(table); k++)
        if (strcmp(kempe_table_word(table, k, 0), "T") == 0) {
            CHECK_NEAR(kempe_table_number(table, k, kempe_table_find(table, "force")),
                       sqrt(force[0] * force[0] + force[1] * force[1] + 16e6), 1e-6);
            found = true;
        }
    CHECK(found);
    kempe_table_free(table);
    kempe_trajectory_free(run);
    unload(&l);
}

/* The log has what is outside the range of a file, from the start on. */
static void the_log_names_ranges(void)
{
    static const struct {
        state at;
        const char *tyre, *words;
    } cases[] = {{{100, 0, 0, 0}, CAR, "tyre 'T' is outside FZMIN .. FZMAX of its file, at the start"},
                 {{4000, 0, 0, 0}, CAR, NULL}};
    for (int k = 0; k < 2; k++) {
        char text[2048];
        write_wheel(text, sizeof text, &cases[k].at, cases[k].tyre);
        loaded l = load_text_as(text, HERE);
        kempe_trajectory *run = simulate(&l, &ways[0], 1e-6);
        const kmp_log_entry *first = run ? entry(run, "event", 0) : NULL;
        CHECK(cases[k].words ? first != NULL : first == NULL);
        if (first && cases[k].words)
            CHECK_TEXT(first->text, cases[k].words);
        CHECK(run &&
              !cases[k].words == !strstr(run->warnings, "tyre 'T' is outside FZMIN .. FZMAX of its file, at t = 0 s"));
        CHECK(run && !cases[k].words == (run->remarks.length == 0));
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* The same of instances, in lanes and by themselves: of five loads none, the last one, or the last one later, below its
 * range. */
static void an_ensemble_names_ranges(void)
{
    static const struct {
        double load, rise;
        bool warns;
    } cases[] = {{4000, 0, false}, {100, 0, true}, {4000, 9.7, true}};
    for (int k = 0; k < 6; k++) {
        char text[2048], *start;
        const state at = {4000, 0, 0, 0};
        write_wheel(text, sizeof text, &at, CAR);
        start = strstr(text, "start:");
        (void)snprintf(start, (size_t)(text + sizeof text - start),
                       "parameters: {z0: 0.3, w0: 0}\nstart: {q: {z: z0}, qd: {x: 20, z: w0, spin: 66}}\n");
        loaded l = load_text_as(text, HERE);
        static const char *const names[] = {"z0", "w0"};
        double values[10] = {0};
        for (int i = 0; i < 5; i++) {
            const bool last = i == 4;
            values[2 * i] = radius - (last ? cases[k / 2].load : 4000 + 10 * i) / stiffness;
            values[2 * i + 1] = last ? cases[k / 2].rise : 0;
        }
        const kempe_run_options options = {.t_end = 0.002};
        kempe_values *set = NULL;
        kempe_ensemble *e = NULL;
        kempe_ensemble_result *batch = NULL;
        CHECK(l.model && kempe_values_new(l.model, 2, names, 5, values, &set) == KEMPE_OK &&
              kempe_ensemble_new(l.model, set, &e) == KEMPE_OK &&
              kempe_ensemble_run(e, &options, k % 2 ? 1 : 4, &batch) == KEMPE_OK);
        char *said = kmp_context_warnings(l.context);
        CHECK(said && cases[k / 2].warns ==
                          (strstr(said, "in instances: tyre 'T' is outside FZMIN .. FZMAX of its file") != NULL));
        kmp_free(said);
        kempe_ensemble_result_free(batch);
        kempe_ensemble_free(e);
        kempe_values_free(set);
        unload(&l);
    }
}

/* -- files ------------------------------------------------------------------------------------------------ */

static void write_file(const char *name, const char *text)
{
    FILE *file = fopen(name, "w");
    CHECK(file != NULL);
    if (file) {
        (void)fputs(text, file);
        (void)fclose(file);
    }
}

#define LEAST "PCX1 = 1.6\nPDX1 = 1.2\nPKX1 = 21\nPCY1 = 1.2\nPDY1 = -1\nPKY1 = -15\nPKY2 = 2\n"

/* The same tyre in other units. */
/* In the air, where the rate of the lean is constant. Without slips that are states the run goes on. */
static void a_wheel_that_falls_on_its_side_ends_the_run(void)
{
    static const char *const tyres[] = {BRUSH, BRUSH
                                        ", transient: yes, longitudinal_relaxation: 0.3, lateral_relaxation: 0.5"};
    for (int slips = 0; slips < 2; slips++) {
        char text[2048];
        write_wheel(text, sizeof text, &(state){-2e6, 0, 0, 0}, tyres[slips]);
        char *spin = strstr(text, ", spin: ");
        CHECK(spin != NULL);
        if (spin)
            (void)snprintf(spin, sizeof text - (size_t)(spin - text), ", lean: 2, spin: 0}}\n");
        loaded l = load_text_as(text, HERE);
        for (int w = 0; w < WAYS; w++) {
            kempe_status status;
            kempe_trajectory *run = simulate_any(&l, &ways[w], 1, &status);
            const char *reason = run ? kempe_trajectory_reason(run) : "";
            CHECK((slips > 0) == (strstr(reason, "tyre 'T' has fallen on its side") != NULL));
            const int last = run ? kempe_trajectory_row_count(run) - 1 : 0;
            CHECK_NEAR(run ? kempe_trajectory_time(run, last) : NAN, slips ? acos(0.1) / 2 : 1, 1e-9);
            kempe_trajectory_free(run);
        }
        unload(&l);
    }
}

static void units_of_a_file(void)
{
    static const char *const heads[] = {
        "$ comment\n[UNITS]\nLENGTH = 'mm'\nFORCE = 'kN'\nANGLE = 'deg'\nTIME = 's'\n[MODEL]\nPROPERTY_FILE_FORMAT = "
        "'PAC2002'\nVXLOW = 2000\n[DIMENSION]\nUNLOADED_RADIUS = 313\n[V]\nFNOMIN = 4 ! load\nVERTICAL_STIFFNESS = "
        "0.2\n",
        "[MODEL]\nFITTYP = 52\nVXLOW = 2\n[D]\nUNLOADED_RADIUS = 0.313\nFNOMIN = 4000\nVERTICAL_STIFFNESS = 2e5\n"};
    double force[2][6];
    for (int k = 0; k < 2; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text, "%s" LEAST "%s", heads[k], k == 0 ? "QA = 1\nQB = 2\n" : "");
        write_file("units.tir", text);
        char model[2048];
        write_wheel(model, sizeof model, &(state){4000, 0.05, 0.04, 0.02}, "file: units.tir");
        char *low = strstr(model, "low_speed: 1e-9, ");
        memmove(low, low + 17, strlen(low + 17) + 1);
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &ways[0], 1e-9);
        show(run, "force(T)", 6, false, force[k]);
        const char *unused = "the equations do not use 2 keys of 'units.tir': QA, QB";
        CHECK(run && (k == 0) == (strstr(run->warnings, unused) != NULL));
        kempe_trajectory_free(run);
        unload(&l);
    }
    for (int i = 0; i < 6; i++)
        CHECK_NEAR(force[0][i], force[1][i], 1e-12);
    CHECK_NEAR(force[0][UP], 4000, 1e-12);
    (void)remove("units.tir");
}

static void refused_files(void)
{
    static const struct {
        const char *file, *words;
    } cases[] = {{"[MODEL]\nFITTYP = 62\n", "FITTYP = 62 is MF 6.2, which is not read"},
                 {"[MODEL]\nFITTYP = 7\n", "FITTYP = 7 is a form of the Magic Formula, which is not read"},
                 {"[MODEL]\nPROPERTY_FILE_FORMAT = 'FTIRE'\n", "PROPERTY_FILE_FORMAT = 'FTIRE' is not read"},
                 {"[MODEL]\nVXLOW = 1\n", "the file has neither FITTYP nor PROPERTY_FILE_FORMAT"},
                 {"[MODEL]\nFITTYP = 61\nUNLOADED_RADIUS = 0.3\nPCX1 = 1.6\n",
                  "bad.tir:1:1: tyre 'T': the file lacks FNOMIN, PDX1, PKX1, PCY1, PDY1, PKY1, PKY2"},
                 {"[MODEL]\nFITTYP = 61\nUNLOADED_RADIUS = 0.3\nFNOMIN = 4000\n" LEAST,
                  "the file has no positive VERTICAL_STIFFNESS: give 'vertical_stiffness'"},
                 {"[MODEL]\nFITTYP = 61\nUNLOADED_RADIUS = 0.3\nFNOMIN = -4000\nVERTICAL_STIFFNESS = 2e5\n" LEAST,
                  "FNOMIN must be positive, not -4000"},
                 {"[MODEL]\nFITTYP = 61\nUNLOADED_RADIUS = wide\n",
                  "bad.tir:3:1: tyre 'T': UNLOADED_RADIUS is not a number: 'wide'"},
                 {"[MODEL]\nFITTYP = 61\nFNOMIN = 1\nFNOMIN = 2\n",
                  "bad.tir:4:1: tyre 'T': the file has two values of 'FNOMIN'"},
                 {"[UNITS]\nLENGTH = 'parsec'\n", "bad.tir:2:1: tyre 'T': unknown unit 'parsec'"},
                 {"[MODEL]\nFITTYP = 61\nUNLOADED_RADIUS = 0.3\nFNOMIN = 4000\nVERTICAL_STIFFNESS = 2e5\nINFLPRES = "
                  "2e5\nNOMPRES "
                  "= 2.2e5\nPPX1 = 0.1\n" LEAST,
                  "INFLPRES = 200000 differs from NOMPRES = 220000"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char model[2048];
        write_file("bad.tir", cases[k].file);
        write_wheel(model, sizeof model, &(state){4000, 0, 0, 0}, "file: bad.tir");
        load_rejected(model, cases[k].words);
    }
    (void)remove("bad.tir");
}

static void refused_models(void)
{
    static const struct {
        const char *road, *tyre, *words;
    } cases[] = {{"{flat: ground.O}", "{on: lane, at: wheel.C, " BRUSH "}", "tyre 'T': unknown road 'lane'"},
                 {"{flat: ground.O}", "{on: street, at: ground.O, " BRUSH "}",
                  "tyre 'T': a tyre is at a point of a body that rotates with it, not of the ground"},
                 {"{flat: ground.O}", "{on: street, at: wheel.C}", "tyre 'T' has a 'file' (.tir), or 'model: brush'"},
                 {"{flat: ground.O}", "{on: street, at: wheel.C, model: brush, radius: 0.3}",
                  "tyre 'T' has no key 'vertical_stiffness'"},
                 {"{flat: ground.O}", "{on: street, at: wheel.C, side: left, " BRUSH "}",
                  "the key 'side' belongs to a tyre with a file"},
                 {"{flat: ground.O}", "{on: street, at: wheel.C, transient: yes, " BRUSH "}",
                  "tyre 'T': transient slip needs 'longitudinal_relaxation'"},
                 {"{flat: ground.O}", "{on: street, at: wheel.C, mode: 5, " BRUSH "}",
                  "the mode is 0 to 4, or 10 to 14 with transient slip, not 5; turn slip is not known"},
                 {"{flat: ground.O}", "{on: street, at: wheel.C, mode: 2, " BRUSH "}",
                  "a brush model has the modes 0, 4, 10 and 14"},
                 {"{flat: ground.O, height: 1}", "{on: street, at: wheel.C, " BRUSH "}",
                  "road 'street' has 'flat', the point of a plane, or 'at' with a 'height'"},
                 {"{at: ground.O, height: 0.1, along: z}", "{on: street, at: wheel.C, " BRUSH "}",
                  "road 'street': its height cannot change along z, its normal"},
                 {"{flat: ground.O, friction: 0}", "{on: street, at: wheel.C, " BRUSH "}",
                  "friction of road 'street' is 0: it must be positive"},
                 {"{at: ground.O, height: \"0.1*q\"}", "{on: street, at: wheel.C, " BRUSH "}",
                  "model.yaml:3:45: q is not allowed here: a function of x and t is expected"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nroads: {street: %s}\ntyres: {T: %s}\n"
                       "bodies: {wheel: {joint: {prismatic: z, at: ground.O}, mass: 1, points: {C: [0, 0, 0]}}}\n",
                       cases[k].road, cases[k].tyre);
        load_rejected(text, cases[k].words);
    }
}

int main(void)
{
    TEST(the_magic_formula_has_its_digits);
    TEST(another_implementation_agrees);
    TEST(the_brush_has_its_digits);
    TEST(a_mirrored_tyre);
    TEST(modes_of_a_file);
    TEST(transient_slip_follows);
    TEST(a_driven_wheel_rolls_steadily);
    TEST(a_single_track_turns_steadily);
    TEST(a_road_that_moves);
    TEST(a_height_is_a_plane);
    TEST(all_formulations_agree);
    TEST(derivatives_follow_parameters);
    TEST(derivatives_pass_kinks);
    TEST(instances_are_runs);
    TEST(a_wheel_stands);
    TEST(joints_carry_tyres);
    TEST(the_log_names_ranges);
    TEST(a_wheel_that_falls_on_its_side_ends_the_run);
    TEST(an_ensemble_names_ranges);
    TEST(units_of_a_file);
    TEST(refused_files);
    TEST(refused_models);
    return check_report();
}
