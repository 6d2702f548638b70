/* SPDX-License-Identifier: BSD-3-Clause */
/* Gear wheels by their teeth: motions, forces of the teeth and loads of the joints by closed forms, and by the balance
 * of each wheel in a housing that turns. */
#include "compared_runs.h"
#include "linalg/dense/dot.h"
#include "ways.h"
#include <kempe/gradient.h>
#include <kempe/table.h>
#include <math.h>

static const double degree = 0.017453292519943295;

/* The first `count` values of an output at the first row. */
static void show(const kempe_trajectory *run, const char *output, int count, double *x)
{
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, output, &table) == KEMPE_OK);
    for (int k = 0; k < count; k++)
        x[k] = table ? kempe_table_number(table, 0, 1 + k) : NAN;
    kempe_table_free(table);
}

static double shown(const kempe_trajectory *run, const char *output)
{
    double x;
    show(run, output, 1, &x);
    return x;
}

static void show_of(const kempe_trajectory *run, const char *what, const char *of, double x[3])
{
    char output[64];
    (void)snprintf(output, sizeof output, "%s(%s)", what, of);
    show(run, output, 3, x);
}

/* -- closed forms ---------------------------------------------------------------------------------------- */

/* A helical pair at rest under 100 N m. The bearings of the pinion at -60 mm and 40 mm follow from the load of its
 * joint: B from the moment about A. */
static void a_helical_pair_loads_its_bearings(void)
{
    static const char *const text =
        "kempe: 1\nparameters: {a: \"3 mm*73/(2*cos(15 deg))\"}\nground: {points: {O: [0, 0, 0], P: [0, a, 0]}}\n"
        "bodies:\n  pinion: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1e-3}}\n"
        "  wheel: {joint: {revolute: x, at: ground.P}, mass: 1, inertia: {xx: 4e-3}}\n"
        "gears: {mesh: {between: [pinion, wheel], teeth: [20, 53], module: 3 mm, helix: 15 deg, hand: %s}}\n"
        "forces: {motor: {joint: pinion, torque: 100}}\ndrives: {w: {joint: wheel, locked: yes}}\n"
        "run: {t_end: 0.1}\n";
    for (int left = 0; left < 2; left++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(model, sizeof model, text, left ? "left" : "right");
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.01);
            double mesh[3], joint[3], moment[3], other[3];
            show_of(run, "reaction", "mesh", mesh);
            show_of(run, "reaction", "pinion", joint);
            show_of(run, "moment", "pinion", moment);
            show_of(run, "reaction", "wheel", other);
            CHECK_NEAR(shown(run, "lambda(mesh)"), 3219.75275429689, 1e-10);
            CHECK_NEAR(mesh[0], left ? 862.730150341736 : -862.730150341736, 1e-11);
            CHECK_NEAR(mesh[1], 1213.23411422067, 1e-10);
            CHECK_NEAR(mesh[2], 3219.75275429689, 1e-10);
            CHECK_NEAR(sqrt(kmp_dot(3, mesh, mesh)), 3547.25924158637, 1e-10);
            for (int i = 0; i < 3; i++) {
                CHECK_NEAR(joint[i], mesh[i], 1e-10);
                CHECK_NEAR(other[i], -mesh[i], 1e-10);
            }
            const double z1 = -0.06, z2 = 0.04, r1 = 0.0310582854123025,
                         axial = left ? -862.730150341736 : 862.730150341736;
            const double by = (moment[2] - z1 * joint[1]) / (z2 - z1), bz = (-moment[1] - z1 * joint[2]) / (z2 - z1);
            const double wanted[2] = {(-z1 * 1213.23411422067 + r1 * axial) / (z2 - z1), 1931.85165257814};
            CHECK_NEAR(by, wanted[0], 1e-10);
            CHECK_NEAR(bz, wanted[1], 1e-10);
            if (!left) {
                CHECK_NEAR(hypot(by, bz), 2173.44128615956, 1e-10);
                CHECK_NEAR(hypot(joint[1] - by, joint[2] - bz), 1306.11173303437, 1e-10);
            }
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A differential of bevel gears, with one of two pinions too many: both side gears by their equations of motion. */
static void a_bevel_differential_turns(void)
{
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(
            "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
            "  cage: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 0.05, yy: 1, zz: 1}, points: {P: [0, "
            "0, "
            "40 mm], Q: [0, 0, -40 mm]}}\n"
            "  p: {joint: {revolute: z, at: cage.P}, mass: 0.2, inertia: {xx: 1e-4, yy: 1e-4, zz: 1e-4}}\n"
            "  q: {joint: {revolute: z, at: cage.Q}, mass: 0.2, inertia: {xx: 1e-4, yy: 1e-4, zz: 1e-4}}\n"
            "  left: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 0.3}, points: {C: [-25 mm, 0, 0]}}\n"
            "  right: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 0.5}, points: {C: [25 mm, 0, 0]}}\n"
            "gears:\n  lp: {between: [left.C, p], teeth: [16, 10]}\n  rp: {between: [right.C, p], teeth: [16, 10]}\n"
            "  lq: {between: [left.C, q], teeth: [16, 10]}\n  rq: {between: [right.C, q], teeth: [16, 10]}\n"
            "forces: {motor: {joint: cage, torque: 40}, brake: {joint: left, torque: -10}}\n"
            "run: {t_end: 0.1}\n");
        kempe_trajectory *run = simulate(&l, &ways[k], 0.1);
        CHECK_NEAR(shown(run, "qdd(left)"), 30.4269659020683, 1e-9);
        CHECK_NEAR(shown(run, "qdd(right)"), 38.2521730351888, 1e-9);
        CHECK_NEAR(shown(run, "qdd(cage)"), (30.4269659020683 + 38.2521730351888) / 2, 1e-9);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Bevel gears at an angle of the axes of 70 degrees, held by a drive: the cones by sin(d1)/sin(d2) = z1/z2. */
static void bevel_gears_push_along_their_axes(void)
{
    loaded l = load_text(
        "kempe: 1\nground: {points: {O: [0, 0, 0], P: {at: [0, 0, 0], axes: {z: [\"sin(70 deg)\", 0, \"cos(70 "
        "deg)\"]}}}}\n"
        "bodies:\n  a: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1e-3}, points: {C: [0, 0, 80 mm]}}\n"
        "  b: {joint: {revolute: z, at: ground.P}, mass: 1, inertia: {zz: 1e-3}, points: {C: [0, 0, 50 mm]}}\n"
        "gears: {mesh: {between: [a.C, b.C], teeth: [18, 31]}}\n"
        "forces: {motor: {joint: a, torque: 60}}\ndrives: {w: {joint: b, locked: yes}}\n"
        "run: {t_end: 0.1}\n");
    kempe_trajectory *run = simulate(&l, &ways[0], 0.1);
    const double angle = 70 * degree, d1 = atan2(18 * sin(angle), 31 + 18 * cos(angle)), r1 = 0.08 * tan(d1);
    const double force = 60 / r1, apart = force * tan(20 * degree), r2 = r1 * 31 / 18;
    double joint[3], moment[3];
    show_of(run, "reaction", "a", joint);
    show_of(run, "moment", "a", moment);
    CHECK_NEAR(shown(run, "lambda(mesh)"), force, 1e-9);
    CHECK_NEAR(fabs(shown(run, "lambda(w)")), force * r2, 1e-9);
    /* The joint carries the teeth: the pitch point is beside the first axis in the plane of both. */
    CHECK_NEAR(joint[0], apart * cos(d1), 1e-9);
    CHECK_NEAR(joint[1], force, 1e-9);
    CHECK_NEAR(joint[2], -apart * sin(d1), 1e-9);
    CHECK_NEAR(moment[0], -0.08 * force, 1e-9);
    CHECK_NEAR(moment[1], 0.08 * joint[0] - r1 * joint[2], 1e-9);
    kempe_trajectory_free(run);
    unload(&l);
}

/* A worm at rest: F = T/(r tan(lead)), apart F tan(alpha)/cos(lead), around the worm F tan(lead). */
static void a_worm_pushes_along_its_axis(void)
{
    static const char *const by[] = {"module: 4 mm", "lead_angle: \"asin(0.004/sqrt(0.004^2 + 0.04^2))\""};
    for (int left = 0; left < 2; left++)
        for (size_t k = 0; k < 2; k++) {
            char model[1024];
            (void)snprintf(model, sizeof model,
                           "kempe: 1\nground: {points: {O: [0, 0, 0], P: [30 mm, 7 mm, 100 mm]}}\nbodies:\n"
                           "  worm: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1e-3}}\n"
                           "  wheel: {joint: {revolute: y, at: ground.P}, mass: 1, inertia: {yy: 4e-3}}\n"
                           "gears: {mesh: {between: [worm, wheel], starts: 1, teeth: 40, %s, hand: %s}}\n"
                           "forces: {motor: {joint: worm, torque: 1}}\ndrives: {w: {joint: wheel, locked: yes}}\n"
                           "run: {t_end: 0.1}\n",
                           by[k], left ? "left" : "right");
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[0], 0.1);
            const double lead = atan(0.1), force = 1 / (0.02 * 0.1), side = left ? -1 : 1;
            double joint[3], moment[3], other[3];
            show_of(run, "reaction", "worm", joint);
            show_of(run, "moment", "worm", moment);
            show_of(run, "moment", "wheel", other);
            CHECK_NEAR(shown(run, "lambda(mesh)"), force, 1e-9);
            CHECK_NEAR(shown(run, "lambda(w)"), -side * 0.08 * force, 1e-9);
            CHECK_NEAR(joint[0], -side * force, 1e-9);
            CHECK_NEAR(joint[1], -0.1 * force, 1e-9);
            CHECK_NEAR(joint[2], force * tan(20 * degree) / cos(lead), 1e-9);
            /* about the joint's point of the worm, which is 30 mm from the pitch point along its axis */
            CHECK_NEAR(moment[1], 0.02 * joint[0] - 0.03 * joint[2], 1e-9);
            CHECK_NEAR(moment[2], 0.03 * joint[1], 1e-9);
            CHECK_NEAR(other[0], 0.007 * joint[2] - 0.08 * joint[1], 1e-9);
            CHECK_NEAR(other[2], -0.007 * joint[0], 1e-9);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A rack of 2 kg by a wheel: a = T/r/(m + J/r^2). */
static void a_rack_follows_its_wheel(void)
{
    static const char *const size[] = {"radius: 30 mm", "teeth: 20, module: 3 mm"};
    for (int k = 0; k < WAYS; k++) {
        char model[1024];
        (void)snprintf(model, sizeof model,
                       "kempe: 1\nground: {points: {O: [0, 0, 0], P: [0, -30 mm, 0]}}\nbodies:\n"
                       "  pinion: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 9e-4}}\n"
                       "  rack: {joint: {prismatic: x, at: ground.P}, mass: 2}\n"
                       "gears: {mesh: {between: [pinion, rack], %s}}\nforces: {motor: {joint: pinion, torque: 9}}\n"
                       "run: {t_end: 0.1}\n",
                       size[k % 2]);
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &ways[k], 0.1);
        double joint[3];
        show_of(run, "reaction", "pinion", joint);
        CHECK_NEAR(shown(run, "qdd(rack)"), 100, 1e-9);
        CHECK_NEAR(shown(run, "qdd(pinion)"), 100 / 0.03, 1e-9);
        CHECK_NEAR(shown(run, "lambda(mesh)"), 200, 1e-9);
        CHECK_NEAR(joint[0], 200, 1e-9);
        CHECK_NEAR(joint[1], -200 * tan(20 * degree), 1e-9);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Willis: (sun - arm)/(ring - arm) = -68/20 with speeds against the ground, also in a housing that turns. */
static void planets_turn_as_willis_says(void)
{
    loaded l = load_text(
        "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
        "  housing: {joint: {name: H, revolute: z, at: ground.O}, mass: 5, inertia: {zz: 0.1}, points: {O: [0, 0, "
        "0]}}\n"
        "  sun: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1e-3}}\n"
        "  arm: {joint: {revolute: -z, at: housing.O}, mass: 1, inertia: {zz: 5e-3}, points: {A: [66 mm, 0, 0]}}\n"
        "  planet: {joint: {revolute: -z, at: arm.A}, mass: 0.3, inertia: {zz: 1e-4}}\n"
        "  ring: {joint: {revolute: z, at: housing.O}, mass: 0.5, inertia: {zz: 3e-3}}\n"
        "gears:\n  inner: {between: [sun, planet], teeth: [20, 24]}\n"
        "  outer: {between: [ring, planet], teeth: [68, 24], internal: yes}\n"
        "start: {qd: {sun: 100, H: 3, arm: 0}}\nrun: {t_end: 0.1}\n");
    kempe_trajectory *run = simulate(&l, &ways[0], 0.1);
    CHECK_NEAR(shown(run, "qd(ring)"), -20.0 / 68 * 97, 1e-12);
    CHECK_NEAR(shown(run, "qd(planet)"), 20.0 / 24 * 97, 1e-12);
    kempe_trajectory_free(run);
    unload(&l);
    l = load_text(
        "kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
        "  sun: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1e-3}}\n"
        "  arm: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 5e-3}, points: {A: [66 mm, 0, 0]}}\n"
        "  planet: {joint: {revolute: z, at: arm.A}, mass: 0.3, inertia: {zz: 1e-4}}\n"
        "gears:\n  inner: {between: [sun, planet], teeth: [20, 24]}\n"
        "  outer: {between: [planet, ground.O], teeth: [24, 68], internal: yes}\n"
        "start: {qd: {sun: 100}}\nrun: {t_end: 0.1}\n");
    run = simulate(&l, &ways[0], 0.1);
    CHECK_NEAR(shown(run, "qd(arm)"), 100 * 20.0 / 88, 1e-12);
    kempe_trajectory_free(run);
    unload(&l);
}

/* -- balance ----------------------------------------------------------------------------------------------- */

#define POINTS "points: {C: [0, 0, 0], X: [1, 0, 0], Y: [0, 1, 0], Z: [0, 0, 1]}"

/* m a = sum of forces, J alpha = sum of moments about the centre, for a wheel with equal moments of inertia. Points of
 * the wheel are accelerated by alpha x r at rest, so that alpha = sum r x a/2. */
static void check_wheel(const kempe_trajectory *run, const char *wheel, double mass, double inertia, double side,
                        const double pitch[3])
{
    static const double gravity[3] = {1, 2, -10};
    double c[3], at[3], force[3], moment[3], teeth[3], alpha[3] = {0}, arm[3], product[3];
    char name[64];
    (void)snprintf(name, sizeof name, "%s.C", wheel);
    show_of(run, "acceleration", name, c);
    show_of(run, "position", name, at);
    show_of(run, "reaction", wheel, force);
    show_of(run, "moment", wheel, moment);
    show_of(run, "reaction", "mesh", teeth);
    for (int k = 0; k < 3; k++) {
        double a[3], x[3];
        (void)snprintf(name, sizeof name, "%s.%c", wheel, "XYZ"[k]);
        show_of(run, "acceleration", name, a);
        show_of(run, "position", name, x);
        for (int i = 0; i < 3; i++) {
            a[i] -= c[i];
            x[i] -= at[i];
        }
        kmp_cross3(x, a, product);
        for (int i = 0; i < 3; i++)
            alpha[i] += product[i] / 2;
    }
    for (int i = 0; i < 3; i++)
        arm[i] = pitch[i] - at[i];
    kmp_cross3(arm, teeth, product);
    for (int i = 0; i < 3; i++)
        CHECK_NEAR(force[i] + side * teeth[i] + mass * gravity[i], mass * c[i], 1e-11);
    /* the motor acts along the axis, which moment(..) has not: across it all must balance */
    double left[3], axis[3], of_axis[3];
    (void)snprintf(name, sizeof name, "%s.Z", wheel);
    show_of(run, "position", name, axis);
    for (int i = 0; i < 3; i++) {
        axis[i] -= at[i];
        left[i] = moment[i] + side * product[i] - inertia * alpha[i];
    }
    const double along = kmp_dot(3, left, axis);
    for (int i = 0; i < 3; i++) {
        of_axis[i] = along * axis[i];
        CHECK_NEAR(left[i] - of_axis[i], 0, 1e-11);
    }
    CHECK(sqrt(kmp_dot(3, product, product)) > 1e-3);
    CHECK(strcmp(wheel, "wheel") != 0 || fabs(along) < 1e-11); /* without a motor */
}

/* In a housing on a ball, whose joints are oblique: pitch points by the geometry of each pair. */
static void wheels_are_balanced_in_a_housing(void)
{
    static const struct {
        const char *pair, *place;
        double pitch[3]; /* in the axes of point A of the housing */
    } cases[] = {{"teeth: [20, 30], helix: 20 deg", "[0.1, 0, 0.02]", {0.04, 0, 0}},
                 {"teeth: [20, 60], internal: yes, helix: 20 deg, hand: left", "[0.1, 0, 0]", {-0.05, 0, 0}},
                 {"teeth: [60, 20], internal: yes", "[0.1, 0, 0]", {0.15, 0, 0}},
                 {"radius: [45 mm, 55 mm], pressure_angle: 25 deg", "[0, 0.1, 0]", {0, 0.045, 0}},
                 {"teeth: [20, 30], module: 3.9 mm, helix: 10 deg", "[0.1, 0, 0]", {0.04, 0, 0}}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char model[4096];
        (void)snprintf(model, sizeof model,
                       "kempe: 1\ngravity: [1, 2, -10]\nground: {points: {O: [0.1, 0.2, 0.3]}}\nbodies:\n"
                       "  housing: {joint: {name: H, spherical: x, at: ground.O}, mass: 2, com: [0.1, 0.2, 0.1], "
                       "inertia: {xx: 0.1, "
                       "yy: 0.2, zz: 0.15}, points: {A: {at: [0.3, 0.1, 0], axes: {z: [1, 2, 3], x: [3, 0, -1]}}}}\n"
                       "  base: {joint: {weld: yes, at: housing.A}, points: {B: %s}}\n"
                       "  pinion: {joint: {revolute: z, at: housing.A, to: C}, mass: 1.5, inertia: {xx: 0.01, yy: "
                       "0.01, zz: 0.01}, " POINTS "}\n"
                       "  wheel: {joint: {revolute: -z, at: base.B, to: C}, mass: 2.5, inertia: {xx: 0.02, yy: 0.02, "
                       "zz: 0.02}, " POINTS "}\n"
                       "  mark: {joint: {weld: yes, at: housing.A}, points: {P: [%g, %g, %g]}}\n"
                       "gears: {mesh: {between: [pinion, wheel], %s}}\nforces: {motor: {joint: pinion, torque: 7}}\n"
                       "start: {q: {H.1: 0.4, H.2: -0.7, H.3: 0.3, pinion: 0.6}}\n"
                       "run: {t_end: 0.01}\n",
                       cases[k].place, cases[k].pitch[0], cases[k].pitch[1], cases[k].pitch[2], cases[k].pair);
        loaded l = load_text(model);
        for (int w = 0; w < 6; w += 3) {
            kempe_trajectory *run = simulate(&l, &ways[w], 0.01);
            double pitch[3];
            show_of(run, "position", "mark.P", pitch);
            check_wheel(run, "pinion", 1.5, 0.01, -1, pitch);
            check_wheel(run, "wheel", 2.5, 0.02, 1, pitch);
            kempe_trajectory_free(run);
        }
        unload(&l);
    }
}

/* The ratio is that of the teeth. Forces follow the distance of the axes, a parameter: F = T/(0.6 a). */
static void forces_follow_a_parameter(void)
{
    loaded l = load_text(
        "kempe: 1\nparameters: {a: 100 mm}\nground: {points: {O: [0, 0, 0], P: [0, a, 0]}}\nbodies:\n"
        "  pinion: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1e-3}}\n"
        "  wheel: {joint: {revolute: x, at: ground.P}, mass: 1, inertia: {xx: 4e-3}}\n"
        "gears: {mesh: {between: [pinion, wheel], teeth: [20, 30]}}\nforces: {load: {joint: wheel, torque: 6}}\n"
        "run: {outputs: [reaction(pinion)]}\n");
    const kempe_gradient_options options = {.parameters = "a", .driven = "pinion"};
    kempe_gradient *g = NULL;
    CHECK(kempe_gradient_new(l.model, &options, &g) == KEMPE_OK);
    for (int k = 0; g && k < 2; k++) {
        const double a = k ? 0.2 : 0.1, angle = 0.3, force = 6 / (0.6 * a);
        const double *value = kempe_gradient_values(g), *slope = kempe_gradient_jacobian(g);
        CHECK(kempe_gradient_set(g, &a) == KEMPE_OK && kempe_gradient_eval(g, &angle, NULL, NULL) == KEMPE_OK);
        CHECK_NEAR(kempe_gradient_q(g)[1], -0.2, 1e-12);
        CHECK_NEAR(value[2], force, 1e-11);
        CHECK_NEAR(value[1], force * tan(20 * degree), 1e-11);
        CHECK_NEAR(kempe_gradient_q_jacobian(g)[1], 0, 1e-12);
        CHECK_NEAR(slope[2], -force / a, 1e-11);
        CHECK_NEAR(slope[1], -force / a * tan(20 * degree), 1e-11);
    }
    kempe_gradient_free(g);
    unload(&l);
}

/* -- a gearbox ------------------------------------------------------------------------------------------ */

/* A force at a place of a shaft along x. */
typedef struct acting_force {
    double at[3], force[3];
} acting_force;

/* Radial forces of bearings at x = 0 and x = 0.14 m, and the axial one, of a shaft at constant speed. */
static void check_shaft(const kempe_table *bearings, int row, int count, const acting_force *f)
{
    double sum[3] = {0}, moment[3] = {0}, product[3];
    for (int k = 0; k < count; k++) {
        kmp_cross3(f[k].at, f[k].force, product);
        for (int i = 0; i < 3; i++) {
            sum[i] += f[k].force[i];
            moment[i] += product[i];
        }
    }
    const double second[2] = {-moment[2] / 0.14, moment[1] / 0.14};
    const double radial[2] = {hypot(sum[1] + second[0], sum[2] + second[1]), hypot(second[0], second[1])};
    const int shown = kempe_table_find(bearings, "radial"), mean = kempe_table_find(bearings, "equivalent");
    for (int k = 0; k < 2; k++) {
        CHECK_NEAR(kempe_table_number(bearings, row + k, shown), radial[k], 1e-10);
        CHECK_NEAR(kempe_table_number(bearings, row + k, mean), radial[k], 1e-10);
    }
    const double axial = kempe_table_number(bearings, row + (row == 4), kempe_table_find(bearings, "axial"));
    CHECK_NEAR(fabs(axial), fabs(sum[0]), 1e-10);
}

/* Two helical stages: the forces of the teeth by the torques, the loads of all bearings by statics. */
static void a_gearbox_loads_its_bearings(void)
{
    const double b1 = 15 * degree, b2 = 12 * degree, a = 20 * degree, weight = -9.81;
    const double r[4] = {0.0015 * 20 / cos(b1), 0.0015 * 53 / cos(b1), 0.002 * 18 / cos(b2), 0.002 * 58 / cos(b2)};
    const double f2 = 1200 / r[3], f1 = f2 * r[2] / r[1];
    const double first[3] = {-f1 * tan(b1), f1 * tan(a) / cos(b1), f1};
    const double second[3] = {-f2 * tan(b2), f2 * tan(a) / cos(b2), -f2};
    const acting_force input[] = {{{0.04, r[0], 0}, {-first[0], -first[1], -first[2]}},
                                  {{0.05, 0, 0}, {0, 0, 2 * weight}}};
    const acting_force middle[] = {{{0.04, -r[1], 0}, {first[0], first[1], first[2]}},
                                   {{0.1, r[2], 0}, {-second[0], -second[1], -second[2]}},
                                   {{0.06, 0, 0}, {0, 0, 9 * weight}}};
    const acting_force output[] = {{{0.1, -r[3], 0}, {second[0], second[1], second[2]}},
                                   {{0.09, 0, 0}, {0, 0, 16 * weight}}};
    loaded l = load("examples/gearbox/gearbox.yaml");
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 0.1);
        kempe_table *bearings = NULL;
        CHECK_NEAR(shown(run, "lambda(first)"), f1, 1e-10);
        CHECK_NEAR(shown(run, "lambda(second)"), -f2, 1e-10);
        CHECK_NEAR(shown(run, "lambda(motor)"), f1 * r[0], 1e-10);
        CHECK(run && kempe_trajectory_table(run, "bearings", &bearings) == KEMPE_OK);
        if (bearings) {
            check_shaft(bearings, 0, 2, input);
            check_shaft(bearings, 2, 3, middle);
            check_shaft(bearings, 4, 2, output);
        }
        kempe_table_free(bearings);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* -- losses ------------------------------------------------------------------------------------------------ */

/* Efficiency 0.8 in both directions, J 1 and 1.5 kg m^2, ratio 2: accelerations of the second wheel, by the torques of
 * both. At rest it sticks while the load is between 16 and 25 N m. */
static void losses_stick_and_slow_down(void)
{
    static const struct {
        double one, two, rate, acceleration;
    } cases[] = {{10, -5, 0, 2.34042553191489},   {10, -5, 2, 2.34042553191489}, {2, -30, 2, -5.70212765957447},
                 {10, -15.999999, 0, 1e-6 / 4.7}, {10, -16.000001, 0, 0},        {10, -24.999999, 0, 0},
                 {10, -25.000001, 0, -1e-6 / 6.5}};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\nparameters: {e: 0.8}\nground: {points: {O: [0, 0, 0], P: [0, 150 mm, 0]}}\nbodies:\n"
                "  one: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1}}\n"
                "  two: {joint: {revolute: -x, at: ground.P}, mass: 1, inertia: {xx: 1.5}}\n"
                "gears: {mesh: {between: [one, two], teeth: [20, 40], efficiency: %s}}\n"
                "forces: {a: {joint: one, torque: %.9g}, b: {joint: two, torque: %.9g}}\n"
                "start: {qd: {one: %g}}\n",
                k % 2 ? "e" : "[0.8, e]", cases[c].one, cases[c].two, cases[c].rate);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[k], 0.01);
            CHECK_NEAR(shown(run, "qdd(two)"), cases[c].acceleration, fabs(cases[c].acceleration) < 1 ? 1e-13 : 1e-11);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* The thread of a worm, mu = 0.12: the torques that raise and lower 50 N m, between which it holds. */
static void a_worm_holds_its_load(void)
{
    static const double raise = 2.88308402595306, lower = -0.341900543212064, torques[] = {1e-7, -1e-7};
    for (int up = 0; up < 2; up++)
        for (int beyond = 0; beyond < 2; beyond++)
            for (int k = 0; k < WAYS; k += 3) {
                char model[1024];
                const double torque = (up ? raise : lower) + torques[up ? !beyond : beyond];
                (void)snprintf(model, sizeof model,
                               "kempe: 1\nground: {points: {O: [0, 0, 0], P: [0, 0, 100 mm]}}\nbodies:\n"
                               "  worm: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 0.1}}\n"
                               "  wheel: {joint: {revolute: y, at: ground.P}, mass: 1, inertia: {yy: 4e-3}}\n"
                               "gears: {mesh: {between: [worm, wheel], starts: 1, teeth: 40, lead_angle: atan(0.1), "
                               "friction: 0.12}}\n"
                               "forces: {a: {joint: worm, torque: %.15g}, b: {joint: wheel, torque: -50}}\n",
                               torque);
                loaded l = load_text(model);
                kempe_trajectory *run = simulate(&l, &ways[k], 0.01);
                const double rate = shown(run, "qdd(worm)");
                CHECK(beyond ? (up ? rate > 1e-7 : rate < -1e-7) : rate == 0);
                kempe_trajectory_free(run);
                unload(&l);
            }
}

/* -- play -------------------------------------------------------------------------------------------------- */

static double time_of(const kempe_trajectory *run, const char *words)
{
    double t = NAN;
    for (int k = 0; entry(run, "event", k); k++)
        if (strcmp(entry(run, "event", k)->text, words) == 0)
            t = entry(run, "event", k)->t;
    return t;
}

#define PLAY                                                                                                           \
    "kempe: 1\nground: {points: {O: [0, 0, 0], P: [0, 80 mm, 0]}}\nbodies:\n"                                          \
    "  one: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1e-4}}\n"                                      \
    "  two: {joint: {revolute: x, at: ground.P}, mass: 1, inertia: {xx: 8e-4}}\n"                                      \
    "gears: {mesh: {between: [one, two], radius: [30 mm, 50 mm], backlash: 80 um, %s}}\n"                              \
    "start: {qd: {one: 0.2/0.03}}\nrun: {t_end: 1e-3, output_step: 1e-3}\n"

/* Wheels meet at 0.2 m/s in a play of 80 um: the contact is half a period of the masses on the stiffness of the teeth.
 */
static void elastic_teeth_strike_and_leave(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text, PLAY, "stiffness: 2e8");
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[k], 1e-3);
        const double tolerance = 1e-2 * ways[k].tolerance;
        CHECK_NEAR(time_of(run, "contact 'mesh_front' closes"), 0.0002, tolerance);
        CHECK_NEAR(time_of(run, "contact 'mesh_front' opens"), 0.000263796081064687, tolerance);
        CHECK_NEAR(time_of(run, "contact 'mesh_back' closes"), 0.000663796081064687, tolerance);
        kempe_trajectory_free(run);
        /* the largest force, in the middle of the contact, with its separating part */
        run = simulate(&l, &ways[k], 0.0002318980405323435);
        kempe_table *table = NULL;
        CHECK(run && kempe_trajectory_outputs(run, "reaction(mesh), reaction(one)", &table) == KEMPE_OK);
        const int last = table ? kempe_table_row_count(table) - 1 : 0;
        CHECK_NEAR(table ? kempe_table_number(table, last, 3) : 0, 812.276932106895, 100 * ways[k].tolerance);
        CHECK_NEAR(table ? kempe_table_number(table, last, 2) : 0, 812.276932106895 * tan(20 * degree),
                   100 * ways[k].tolerance);
        for (int i = 1; table && i < 4; i++)
            CHECK_NEAR(kempe_table_number(table, last, i), kempe_table_number(table, last, 3 + i), 1e-9);
        kempe_table_free(table);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Rigid teeth that rebound with half of their speed meet the other flank after twice the time of the play. */
static void rigid_teeth_rebound(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text, PLAY, "restitution: 0.5");
    for (int k = 0; k < WAYS; k++) {
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[k], 1.2e-3);
        CHECK_NEAR(entry(run, "impact", 0) ? entry(run, "impact", 0)->t : 0, 0.0002, 1e-12);
        CHECK_NEAR(entry(run, "impact", 1) ? entry(run, "impact", 1)->t : 0, 0.001, 1e-12);
        const kmp_log_entry *second = entry(run, "impact", 1);
        CHECK_NEAR(second ? 1e4 * (second->before - second->after) : 0, 1e4 * 0.5 * 0.0824742268041237 * 0.01 * 0.75,
                   1e-9);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* The first wheel is at half a radian from the start on, and turns 50 ms later: elastic teeth have no force before, and
 * e'' = r a - K r2^2/J e from there on. */
static void elastic_teeth_count_from_the_driven_start(void)
{
    static const char *const laws[] = {"0.5 + 100*max(0, t - 0.05)^2", "0.5 + if(t < 0.05, 0, 100*(t - 0.05)^2)"};
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < WAYS; k++) {
            char model[1024];
            (void)snprintf(model, sizeof model,
                           "kempe: 1\nground: {points: {O: [0, 0, 0], P: [0.15, 0, 0]}}\nbodies:\n"
                           "  a: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.001}}\n"
                           "  b: {joint: {revolute: z, at: ground.P}, mass: 1, inertia: {zz: 0.01}}\n"
                           "gears: {m: {between: [a, b], teeth: [20, 40], module: 5 mm, stiffness: 10 kN/m}}\n"
                           "drives: {d: {joint: a, angle: \"%s\"}}\nsensors: {e: transmission_error(m)}\n"
                           "run: {t_end: 0.1, outputs: [q, e]}\n",
                           laws[c]);
            loaded l = load_text(model);
            kempe_trajectory *early = simulate(&l, &ways[k], 0.05), *run = simulate(&l, &ways[k], 0.1);
            CHECK(fabs(at_end(early, "q(b)")) < 1e-7 && fabs(at_end(early, "e")) < 1e-8);
            CHECK_NEAR(at_end(run, "e"), 0.05 * 200 / 1e4 * (1 - cos(5)), 1e-3);
            kempe_trajectory_free(early);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* -- what is wrong in a model ------------------------------------------------------------------------------ */

static void refused(void)
{
    static const struct {
        const char *gear, *words;
    } cases[] = {
        {"between: [a, b], teeth: [20, 30.5]", "model.yaml:14:42: gear 'g': teeth is 30.5: a whole number"},
        {"between: [a, b]", "exactly one of the keys teeth, radius is expected"},
        {"between: [a, b], teeth: [20, 20], internal: yes", "the ring of an internal pair is larger"},
        {"between: [a, same], teeth: [20, 30]", "both wheels turn about the same axis"},
        {"between: [a, a], teeth: [20, 30]", "both wheels are the same body"},
        {"between: [a, ground.O], teeth: [20, 30]", "there is only one joint"},
        {"between: [a, sleeve], teeth: [20, 30]", "joint 'sleeve' between the wheels has several coordinates"},
        {"between: [a, far], teeth: [20, 30]", "no body carries both axes"},
        {"between: [a, c], teeth: [20, 30]", "the axes of 'a' and 'c' pass each other at 50 mm"},
        {"between: [a, m], teeth: [20, 30]", "the axes of bevel gears meet at the point of 'a'"},
        {"between: [wide.C, slant.C], teeth: [30, 15]",
         "the pitch cone of 'wide' would open by 90 deg or more: the axes "
         "are at 130 deg"},
        {"between: [a, b], teeth: [20, 30], starts: 1", "wheels with parallel axes have no starts"},
        {"between: [a, b], teeth: [20, 30], carrier: b", "the axes of both wheels rest in 'ground', not in 'b'"},
        {"between: [a, c], starts: 1, teeth: 40", "exactly one of the keys module, lead_angle is expected for a worm"},
        {"between: [a, c], starts: 1, teeth: 40, module: 4 mm", "the pitch radius of the wheel, 80 mm, is not less"},
        {"between: [rack, a], radius: 30 mm", "the first wheel of 'between' turns"},
        {"between: [a, rack], radius: 30 mm", "the rack's point is as high as the axis"},
        {"between: [a, b], teeth: [20, 30], helix: 90 deg", "helix is 90 deg: it must be less than 90 deg"},
        {"between: [a, b], teeth: [20, 30], hand: up", "hand is right or left, not 'up'"},
        {"between: [a, b], teeth: [20, 30], efficiency: 1.1", "efficiency is 1.1: it is at most 1"},
        {"between: [a, b], teeth: [20, 30], efficiency: [0, 0.5]", "positive where the first wheel drives"},
        {"between: [a, b], teeth: [20, 30], friction: 0.1", "friction is for a worm with lead_angle"},
        {"between: [a, b], teeth: [20, 30], backlash: 80 um, efficiency: 0.9",
         "losses are for teeth that are always in"},
        {"between: [a, b], teeth: [20, 30], damping: 3", "damping belongs to stiffness"},
        {"between: [a, b], teeth: [20, 30], restitution: 0.3", "restitution belongs to backlash of rigid teeth"},
        {"between: [a, nobody], teeth: [20, 30]", "unknown body 'nobody'"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[2048];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\nground: {points: {O: [0, 0, 0], P: [0, 0.1, 0], C: [0, 0, 50 mm]}}\nbodies:\n"
            "  a: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1}}\n"
            "  b: {joint: {revolute: x, at: ground.P}, mass: 1, inertia: {xx: 1}}\n"
            "  c: {joint: {revolute: y, at: ground.C}, mass: 1, inertia: {yy: 1}}\n"
            "  m: {joint: {revolute: y, at: ground.P}, mass: 1, inertia: {yy: 1}}\n"
            "  same: {joint: {revolute: x, at: ground.O}, mass: 1, inertia: {xx: 1}}\n"
            "  far: {joint: {revolute: x, at: m}, mass: 1, inertia: {xx: 1}}\n"
            "  sleeve: {joint: {cylindrical: x, at: ground.P}, mass: 1, inertia: {xx: 1}}\n"
            "  wide: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {C: [0, 0, 1]}}\n"
            "  slant: {joint: {revolute: [\"sin(130 deg)\", 0, \"cos(130 deg)\"], at: ground.O}, mass: 1, "
            "inertia: {zz: 1, xx: 1, yy: 1}, points: {C: [1 m*sin(130 deg), 0, 1 m*cos(130 deg)]}}\n"
            "  rack: {joint: {prismatic: y, at: ground.O}, mass: 1}\n"
            "gears: {g: {%s}}\n",
            cases[k].gear);
        load_rejected(text, cases[k].words);
    }
}

int main(void)
{
    TEST(a_helical_pair_loads_its_bearings);
    TEST(a_bevel_differential_turns);
    TEST(bevel_gears_push_along_their_axes);
    TEST(a_worm_pushes_along_its_axis);
    TEST(a_rack_follows_its_wheel);
    TEST(planets_turn_as_willis_says);
    TEST(wheels_are_balanced_in_a_housing);
    TEST(forces_follow_a_parameter);
    TEST(a_gearbox_loads_its_bearings);
    TEST(losses_stick_and_slow_down);
    TEST(a_worm_holds_its_load);
    TEST(elastic_teeth_strike_and_leave);
    TEST(rigid_teeth_rebound);
    TEST(elastic_teeth_count_from_the_driven_start);
    TEST(refused);
    return check_report();
}
