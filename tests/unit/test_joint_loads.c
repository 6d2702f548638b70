/* SPDX-License-Identifier: BSD-3-Clause */
/* Loads of joints of the tree. They are compared with the balance of the body that the joint carries, with the same
 * mechanism where another joint is cut, and with the multipliers of locks. Loads that are not known are refused. */
#include "analyses/equilibrium/balances.h"
#include "analyses/inverse/inverse_study.h"
#include "balance_of_body.h"
#include "base/arena.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/diagnosis/shared_loads.h"
#include "output/samples.h"
#include "studies/simulate/trajectory.h"
#include "ways.h"
#include <kempe/check.h>
#include <kempe/inverse.h>
#include <kempe/kempe.h>
#include <kempe/table.h>
#include <math.h>
#include <stdbool.h>

/* -- balance of a body ------------------------------------------------------------------------------- */

/* Body a moves on the ground and carries body b alone. Accelerations of points of b give its angular acceleration. */
#define SCENE                                                                                                          \
    "kempe: 1\ngravity: [1, 2, -10]\n"                                                                                 \
    "ground: {points: {G: {at: [0.1, 0.2, 0.3], axes: {x: [1, 2, -2], y: [0, 1, 1]}}}}\nbodies:\n"                     \
    "  a: {joint: {%s, at: ground.G}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: {\n"                            \
    "    O: [0, 0, 0], X: [1, 0, 0], Y: [0, 1, 0], Z: [0, 0, 1], T: {at: [0.3, -0.2, 0.1], axes: {z: [1, 2, -3]}},\n"  \
    "    P: {at: [0.2, 0.1, -0.4], axes: {y: [1, -1, 2], z: [0.5, 0, 1]}}}}\n"                                         \
    "  b: {joint: {name: W, %s, at: a.P, to: Q}, mass: 1.5, com: [0.2, 0.1, -0.3], "                                   \
    "inertia: {xx: 1, yy: 1, zz: 1}, points: {\n"                                                                      \
    "    Q: {at: [0.1, -0.2, 0.3], axes: {x: [3, 1, 1]}}, C: [0.2, 0.1, -0.3], X: [1.2, 0.1, -0.3], "                  \
    "Y: [0.2, 1.1, -0.3], Z: [0.2, 0.1, 0.7]}}\n"                                                                      \
    "start: {q: {%s}}\n"                                                                                               \
    "run: {t_end: 0.01, output_step: 0.01, outputs: [" BALANCE_OF_B

static void loads_balance_a_body(void)
{
    static const struct {
        const char *joint, *start;
    } below[] = {{"name: J, revolute: z", "J: 0.4"},
                 {"name: J, prismatic: z, to: T", "J: 0.4"},
                 {"name: J, revolute: [2, 1, 0], to: T, reversed: yes, frame: {x: [-1, 1, 3]}", "J: 0.4"},
                 {"name: J, spherical: x", "J.1: 0.4, J.2: -0.7, J.3: 0.3"}},
      hung[] = {{"revolute: z", "W: 0.3"},
                {"revolute: [1, -2, 2]", "W: 0.3"},
                {"revolute: [1, -2, 2], reversed: yes", "W: 0.3"},
                {"planar: x, reversed: yes, frame: {z: [1, 2, 3], x: [3, 0, -1]}", "W.1: 0.3, W.2: -0.6, W.3: 0.2"},
                {"prismatic: [1, -2, 2]", "W: 0.3"},
                {"cylindrical: y", "W.1: 0.3, W.2: -0.6"},
                {"universal: [1, 1, 0]", "W.1: 0.3, W.2: -0.6"},
                {"spherical: x", "W.1: 0.3, W.2: -0.6, W.3: 0.2"},
                {"planar: x", "W.1: 0.3, W.2: -0.6, W.3: 0.2"},
                {"motions: [R3, T1]", "W.1: 0.3, W.2: -0.6"},
                {"motions: [T1, T3, R2, {R: [1, 0, 2]}]", "W.1: 0.3, W.2: -0.6, W.3: 0.2, W.4: 0.5"}};
    for (size_t j = 0; j < sizeof below / sizeof *below; j++)
        for (size_t h = 0; h < sizeof hung / sizeof *hung; h++) {
            char text[4096], start[128];
            (void)snprintf(start, sizeof start, "%s, %s", below[j].start, hung[h].start);
            (void)snprintf(text, sizeof text, SCENE, below[j].joint, hung[h].joint, start);
            check_balance(text, true, 1e-12);
        }
}

/* -- the same mechanism with another joint cut --------------------------------------------------------- */

enum { JOINTS_MOST = 4, VALUES = 6 * JOINTS_MOST };

/* A spatial loop without redundant rows, closed where all coordinates are zero, with friction. Loads have ground axes
 * and are those on the second body whichever joint is cut. */
typedef struct mechanism {
    const char *bodies, *joint[JOINTS_MOST], *spec[JOINTS_MOST];
} mechanism;

#define CRANK                                                                                                          \
    "kempe: 1\ngravity: [0.5, -1, -9.81]\nground: {points: {O: [0, 0, 0], G: [0.9, 0.1, -0.05]}}\nbodies:\n"           \
    "  crank: {mass: 1, com: [0.1, 0.01, 0.02], inertia: {xx: 0.003, yy: 0.01, zz: 0.011}, points: {O: [0, 0, 0], B: " \
    "[0.25, 0, 0.03]}}\n"                                                                                              \
    "  rod: {mass: 0.8, com: [0.35, 0.02, 0], inertia: {xx: 0.002, yy: 0.034, zz: 0.035}, points: {B: [0, 0, 0], C: "  \
    "[0.65, 0.05, -0.1], E: [0.65, 0.1, -0.08]}}\n"
#define SLIDE                                                                                                          \
    "  slide: {mass: 1.5, com: [0.01, 0.03, 0.02], inertia: {xx: 0.004, yy: 0.005, zz: 0.006}, points: {C: [0, 0, "    \
    "0], G: "                                                                                                          \
    "[0, 0.05, 0.02]}}\n"

static const mechanism mechanisms[] = {
    {CRANK SLIDE,
     {"S", "U", "R", "P"},
     {"spherical: [crank.B, rod.B]", "universal: [rod.C, slide.C], axes: [y, z]", "revolute: [ground.O, crank.O]",
      "prismatic: [ground.G, slide.G], axis: x"}},
    {CRANK SLIDE,
     {"S", "U", "R", "P"},
     {"spherical: [rod.B, crank.B]", "universal: [slide.C, rod.C], axes: [y, z]", "revolute: [crank.O, ground.O]",
      "prismatic: [slide.G, ground.G], axis: [1, 0.2, 0]"}},
    {CRANK SLIDE,
     {"S", "C", "H", "R"},
     {"spherical: [rod.B, crank.B]", "cylindrical: [slide.C, rod.C], axis: x", "revolute: [slide.G, ground.G], axis: y",
      "revolute: [ground.O, crank.O]"}},
    {CRANK,
     {"S", "E", "R"},
     {"spherical: [rod.B, crank.B]", "planar: [rod.E, ground.G], axis: [0.3, 1, 0]", "revolute: [ground.O, crank.O]"}},
};

static loaded load_cut(const mechanism *m, int cut, const char *rub)
{
    char text[4096], outputs[256] = "";
    int used = snprintf(text, sizeof text, "%sjoints:\n", m->bodies);
    for (int k = 0; k < JOINTS_MOST && m->joint[k]; k++) {
        const char *name = m->joint[k];
        used += snprintf(text + used, sizeof text - (size_t)used, "  %s: {%s, cut: %s}\n", name, m->spec[k],
                         k == cut ? "yes" : "no");
        size_t length = strlen(outputs);
        (void)snprintf(outputs + length, sizeof outputs - length, "%sreaction(%s), moment(%s)", k ? ", " : "", name,
                       name);
    }
    (void)snprintf(text + used, sizeof text - (size_t)used,
                   "forces:\n  push: {at: rod.C, force: [1, \"2*sin(3*t)\", 0.3]}\n"
                   "  spring: {spring: [ground.G, crank.B], stiffness: 20, free_length: 0.3}\n"
                   "  rub: {sliding: %s}\n"
                   "run: {t_end: 1, output_step: 0.1, outputs: [%s]}\n",
                   rub, outputs);
    return load_text(text);
}

enum { ROWS = 11, MODES = 8 };

typedef struct followed {
    double value[ROWS][VALUES], time[MODES];
    char text[MODES][64];
} followed;

/* Changes of modes: as `value` above. */
static void follow_modes(const kempe_trajectory *run, bool first, followed *f)
{
    CHECK(entry(run, "friction", 1) && !entry(run, "friction", MODES));
    for (int k = 0; k < MODES; k++) {
        const kmp_log_entry *at = entry(run, "friction", k);
        const char *text = at ? at->text : "";
        if (first) {
            f->time[k] = at ? at->t : 0;
            (void)snprintf(f->text[k], sizeof f->text[k], "%s", text);
        }
        CHECK_NEAR(at ? at->t : 0, f->time[k], 1e-9);
        CHECK_TEXT(text, f->text[k]);
    }
}

/* A run with one joint cut: the first cut fills `f`, others are compared with it. */
static void follow(const mechanism *m, int joints, int cut, const char *rub, followed *f)
{
    loaded l = load_cut(m, cut, rub);
    const kempe_run_options options = {
        .formulation = cut % 2 ? "projected" : "reduced", .rtol = 1e-13, .t_end = 1, .no_convergence_check = 1};
    evaluated e = evaluate(&l, &options, KEMPE_OK);
    CHECK(e.rows == ROWS);
    if (e.rows == ROWS) {
        if (!strstr(rub, "contacts")) /* which may prevent a change, or make many */
            follow_modes(e.run, cut == 0, f);
        for (int row = 0; row < ROWS; row++) {
            const double *other = shown_at(&e, row);
            const int count = 6 * joints;
            if (cut == 0)
                memcpy(f->value[row], other, (size_t)count * sizeof *other);
            for (int k = 0; k < count; k++)
                CHECK_NEAR(other[k], f->value[row][k], 1e-9);
        }
        CHECK(sqrt(kmp_dot(3, f->value[0], f->value[0])) > 1);
    }
    release(&e);
    unload(&l);
}

static void follow_all(const mechanism *m, const char *rub)
{
    followed f = {0};
    int joints = m->joint[3] ? 4 : 3;
    for (int cut = 0; cut < joints; cut++)
        follow(m, joints, cut, rub, &f);
}

static void loads_of_cut_joints(void)
{
    for (size_t k = 0; k < sizeof mechanisms / sizeof *mechanisms; k++)
        follow_all(&mechanisms[k], "\"distance(ground.O, rod.C)\", friction: {force: 0.7}");
}

/* A sphere that is pressed into a plane and slides on it, turning; a law on a length. */
static void compliant_contacts(void)
{
    for (size_t k = 0; k < sizeof mechanisms / sizeof *mechanisms; k++)
        follow_all(
            &mechanisms[k],
            "\"distance(ground.O, rod.C)\", friction: {force: 0.7}}\ncontacts:\n"
            "  pull: {gap: \"distance(ground.O, rod.C) - 2\", law: kelvin_voigt, stiffness: 6, damping: 0.5}\n"
            "  floor: {sphere: rod.E, radius: 0.6, on: {plane: ground.G, normal: z}, law: kelvin_voigt, stiffness: 8, "
            "damping: 1, friction: {coefficient: 0.5, speed: 0.5}");
    loaded l =
        load_text("kempe: 1\ngravity: [0, -10, 0]\nground: {points: {O: [0, 0, 0], W: [0, -0.01, 0]}}\nbodies:\n"
                  "  bar: {joint: {name: A, revolute: z, at: ground.O}, mass: 2, com: [0.5, 0, 0], inertia: {zz: "
                  "0.2}, points: {T: [1, 0, 0]}}\n"
                  "contacts: {stop: {point: bar.T, on: {plane: ground.W, normal: y}, law: kelvin_voigt, stiffness: "
                  "1e5, damping: 1e3}}\nstart: {q: {A: -0.0101001717}}\n"
                  "run: {t_end: 3, output_step: 3, outputs: [reaction(A)]}\n");
    evaluated e = evaluate(&l, NULL, KEMPE_OK);
    CHECK(e.rows == 2);
    CHECK_NEAR(e.rows == 2 ? shown_at(&e, 1)[1] : 0, 10, 1e-6); /* half of the weight */
    release(&e);
    unload(&l);
}

/* The level is that of a joint: of the tree, or of the loop that it closes. */
static void friction_by_a_joint(void)
{
    static const struct {
        int mechanism;
        const char *rub;
    } cases[] = {{0, "\"axes(rod.B, crank.B).x.y\", friction: {mu: 0.1, radius: 20 mm, reaction: S}"},
                 {0, "\"axes(rod.C, slide.C).x.y\", friction: {mu: 0.2, radius: 20 mm, reaction: U}"},
                 {0, "\"angle(ground.O.x, crank.O.x, ground.O.z)\", friction: {mu: 0.3, mu_static: 0.4, radius: 20 mm, "
                     "reaction: R}"},
                 {0, "position(slide.C).x, friction: {mu: 0.05, mu_static: 0.2, reaction: P}"},
                 {1, "\"angle(ground.O.x, crank.O.x, ground.O.z)\", friction: {mu: 0.3, radius: 20 mm, reaction: R}"},
                 {1, "position(slide.C).x, friction: {mu: 0.05, reaction: P}"},
                 {2, "\"position(slide.C, rod.C).x\", friction: {mu: 0.05, reaction: C}"},
                 {2, "\"angle(ground.G.x, slide.G.x, ground.G.y)\", friction: {mu: 0.1, radius: 0.02, reaction: H}"},
                 {3, "position(rod.E).x, friction: {mu: 0.1, reaction: E}"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        follow_all(&mechanisms[cases[k].mechanism], cases[k].rub);
}

/* -- closed forms ------------------------------------------------------------------------------------ */

static evaluated evaluate_to(const loaded *l, double t_end, kempe_status end)
{
    const kempe_run_options options = {
        .formulation = "reduced", .rtol = 1e-11, .t_end = t_end, .no_convergence_check = 1};
    return evaluate(l, &options, end);
}

/* A pendulum from rest at 90 deg: across the pin m g cos + m l w^2 along it, with w^2 = 2 m g l cos/J, and a fourth
 * part of that law across it. Its run ends where the pin carries 30 N, and not where the multiplier of a lock does. */
static void a_pendulum(void)
{
    const double m = 2, r = 0.6, j = 2 * 0.6 * 0.6 + 0.1, g = 9.81;
    loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\n"
                         "bodies: {bob: {joint: {name: A, revolute: z, at: ground}, mass: 2, com: [0, -0.6, 0], "
                         "inertia: {zz: 0.1}}}\n"
                         "sensors: {load: \"sqrt(reaction(A).x^2 + reaction(A).y^2)\"}\n"
                         "start: {q: {A: 90 deg}}\n"
                         "run: {t_end: 10, outputs: [reaction(A), moment(A), load], "
                         "until: \"reaction(A).x^2 + reaction(A).y^2 > (30 N)^2\"}\n");
    evaluated e = evaluate_to(&l, 10, KEMPE_OK);
    for (int row = 0; row < e.rows; row++) {
        const double q = kempe_trajectory_q(e.run, row)[0], along = m * g * cos(q) + m * r * 2 * m * g * r * cos(q) / j;
        const double across = m * g * sin(q) - m * r * m * g * r * sin(q) / j;
        const double *shown = shown_at(&e, row);
        CHECK_NEAR(shown[0], across * cos(q) - along * sin(q), 1e-8);
        CHECK_NEAR(shown[1], across * sin(q) + along * cos(q), 1e-8);
        for (int k = 2; k < 6; k++)
            CHECK_NEAR(shown[k], 0, 1e-12);
        CHECK_NEAR(shown[6], hypot(along, across), 1e-8);
        if (row == e.rows - 1)
            CHECK_NEAR(shown[6], 30, 1e-8);
    }
    release(&e);
    unload(&l);
}

/* A bob on a hinge across the gravity: the hinge carries it, whichever of the bodies its coordinate counts from. By
 * hand: 2 kg at 0.1 m across and 0.3 m below the axis, J = 0.1 + 2 (0.1^2 + 0.3^2) about it, with the acceleration
 * alpha = -2*9.81*0.1/J. */
static void a_reversed_hinge(void)
{
    for (int k = 0; k < 2; k++) {
        char text[512];
        const double alpha = -2 * 9.81 * 0.1 / 0.3;
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, -9.81]\nbodies: {a: {joint: {name: A, revolute: x, at: ground%s}, "
                       "mass: 2, com: [0, 0.1, -0.3], inertia: {xx: 0.1, yy: 0.1, zz: 0.1}}}\n"
                       "run: {t_end: 1e-9, outputs: [reaction(A), moment(A), qdd(A)]}\n",
                       k ? ", reversed: yes" : "");
        loaded l = load_text(text);
        evaluated e = evaluate_to(&l, 1e-9, KEMPE_OK);
        if (e.rows > 0) {
            const double *shown = shown_at(&e, 0);
            CHECK_NEAR(shown[1], 2 * 0.3 * alpha, 1e-12);
            CHECK_NEAR(shown[2], 2 * (9.81 + 0.1 * alpha), 1e-12);
            CHECK_NEAR(shown[2], 18.312, 1e-12);
        }
        release(&e);
        unload(&l);
    }
}

/* Friction of a joint of the tree adds locks: their multipliers are the reaction, which remains one of the joint. */
static void multipliers_of_locks(void)
{
    loaded l = load_text("kempe: 1\ngravity: [1, -9.81, 2]\nbodies:\n"
                         "  arm: {joint: {name: A, revolute: [1, 2, 2], at: ground}, mass: 2, com: [0, -1, 0.2], "
                         "inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, points: {Q: [0, -1, 0.3]}}\n"
                         "  tip: {joint: {name: B, prismatic: y, at: arm.Q}, mass: 1, com: [0.2, 0, 0.1], inertia: "
                         "{xx: 0.1, yy: 0.1, zz: 0.1}}\n"
                         "forces:\n  rub: {joint: A, friction: {mu: 0.3, radius: 0.2}}\n"
                         "  slide: {joint: B, friction: {mu: 0.3}}\n"
                         "  spring: {joint: B, spring: {stiffness: 300}}\n"
                         "sensors:\n"
                         "  a: \"sqrt(lambda(A_load1)^2 + lambda(A_load2)^2 - (reaction(A).x^2 + reaction(A).y^2 + "
                         "reaction(A).z^2) + ((reaction(A).x + 2*reaction(A).y + 2*reaction(A).z)/3)^2 + 1)\"\n"
                         "  b: \"lambda(B_load1)^2 + lambda(B_load2)^2 - reaction(B).x^2 - reaction(B).y^2 - "
                         "reaction(B).z^2\"\n"
                         "  c: \"reaction(B).x*axes(arm.Q).y.x + reaction(B).y*axes(arm.Q).y.y + "
                         "reaction(B).z*axes(arm.Q).y.z\"\n"
                         "start: {q: {A: 1}, qd: {B: 0.5}}\n"
                         "run: {t_end: 1, outputs: [a, b, c]}\n");
    evaluated e = evaluate_to(&l, 1, KEMPE_OK);
    CHECK(e.run && entry(e.run, "friction", 1));
    for (int row = 0; row < e.rows; row += 20) {
        const double *shown = shown_at(&e, row);
        CHECK_NEAR(shown[0], 1, 1e-10);
        CHECK_NEAR(shown[1], 0, 1e-10);
        CHECK_NEAR(shown[2], 0, 1e-12);
    }
    release(&e);
    unload(&l);
}

/* A bar on a hinge at one end whose other end rests on the floor by a rigid contact: half its weight. */
static void rigid_contact(void)
{
    loaded l =
        load_text("kempe: 1\ngravity: [0, 0, -10]\nground: {points: {F: [0, 0, -0.1]}}\n"
                  "bodies: {bar: {joint: {name: A, revolute: y, at: ground}, mass: 3, com: [0.5, 0, 0], inertia: "
                  "{xx: 0.1, yy: 0.25, zz: 0.25}, points: {T: [1, 0, 0]}}}\n"
                  "contacts: {floor: {sphere: bar.T, radius: 0.1, on: {plane: ground.F}, restitution: 0}}\n"
                  "run: {t_end: 0.1, outputs: [reaction(A), moment(A)]}\n");
    evaluated e = evaluate_to(&l, 0.1, KEMPE_OK);
    if (e.rows > 0) {
        const double *shown = shown_at(&e, e.rows - 1);
        CHECK_NEAR(shown[0], 0, 1e-9);
        CHECK_NEAR(shown[2], 15, 1e-9);
        CHECK_NEAR(shown[4], 0, 1e-9);
    }
    release(&e);
    unload(&l);
}

/* -- loads that are not unique ----------------------------------------------------------------------- */

/* A four-bar with hinges about z. By hand: forces along z and moments across it balance themselves around the loop. */
#define FLAT(gravity, com)                                                                                             \
    "kempe: 1\ngravity: " gravity "\nground: {points: {A: [0, 0, 0], D: [0.9, 0, 0]}}\nbodies:\n"                      \
    "  crank: {mass: 0.6, com: " com ", inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, points: {A: [0, 0, 0], "              \
    "B: [0.3, 0, 0]}}\n"                                                                                               \
    "  coupler: {mass: 1.6, com: [0.4, 0, 0], inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, points: {B: [0, 0, 0], "        \
    "C: [0.8, 0, 0]}}\n"                                                                                               \
    "  rocker: {mass: 1.4, com: [0.35, 0, 0], inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, points: {D: [0, 0, 0], "        \
    "C: [0.7, 0, 0]}}\n"                                                                                               \
    "joints:\n  A: {revolute: [ground.A, crank.A]}\n  B: {revolute: [crank.B, coupler.B]}\n"                           \
    "  C: {revolute: [coupler.C, rocker.C]}\n  D: {revolute: [ground.D, rocker.D]}\n"                                  \
    "start: {q: {A: 60 deg, B: -40 deg, D: 100 deg}, hold: [A]}\nrun: {outputs: [reaction(C)], t_end: 0.01}\n"

static void shared_loads(void)
{
    static const char two[] = "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}\n"
                              "bodies: {b: {mass: 4, com: [0.1, 0, -0.3], inertia: {xx: 0.2, yy: 0.6, zz: 0.5}, "
                              "points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}}\n"
                              "joints:\n  A: {revolute: [ground.L, b.L], axis: x}\n  C: {%s: [ground.R, b.R]%s}\n"
                              "run: {outputs: [reaction(C)], t_end: 0.01}\n";
    char hinges[512], ball[512], slider[512];
    (void)snprintf(hinges, sizeof hinges, two, "revolute", ", axis: x");
    (void)snprintf(ball, sizeof ball, two, "spherical", ", cut: yes");
    (void)snprintf(slider, sizeof slider, two, "cylindrical", ", axis: x, cut: yes");
    /* Two hinges on one axis: all but the moment about it. With a ball only forces along the axis are shared; a
     * slider on the axis shares all but these. */
    const struct {
        const char *text, *shared;
        bool loaded;
    } cases[] = {{FLAT("[0, 0, -9.81]", "[0.15, 0, 0]"), "A, B, D, C: z, mx, my", true},
                 {FLAT("[0, -9.81, 0]", "[0.15, 0, 0]"), "A, B, D, C: z, mx, my", false},
                 {FLAT("[0, -9.81, 0]", "[0.15, 0, 0.1]"), "A, B, D, C: z, mx, my", true},
                 {hinges, "A, C: x, y, z, my, mz", true},
                 {ball, "A: x, y, z, my, mz; C: x, y, z", true},
                 {slider, "A, C: y, z, my, mz", true}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = load_text(cases[k].text);
        kmp_evaluator *eval = l.system ? kmp_eval_new(l.system, "tape") : NULL;
        kempe_assembly *start = NULL;
        kmp_arena arena = {0};
        kmp_shared_loads found;
        kmp_text text = {0};
        CHECK(eval && kempe_assembly_new(l.system, &start) == KEMPE_OK);
        CHECK(start && kmp_find_shared_loads(eval, 0, kempe_assembly_q(start), &arena, &found) == KEMPE_OK);
        if (start) {
            (void)kmp_put_shared_loads(&text, l.model, &found);
            CHECK_TEXT(text.s ? text.s : "", cases[k].shared);
            CHECK(found.loaded == cases[k].loaded);
        }
        kmp_text_free(&text);
        kmp_arena_free(&arena);
        kempe_assembly_free(start);
        kmp_eval_free(eval);
        unload(&l);
    }
    for (size_t k = 0; k < sizeof mechanisms / sizeof *mechanisms; k++) { /* without redundant rows */
        loaded l = load_cut(&mechanisms[k], 0, "position(rod.C).x, friction: {force: 1, speed: 1}");
        kmp_evaluator *eval = l.system ? kmp_eval_new(l.system, "tape") : NULL;
        double q[16] = {0};
        kmp_arena arena = {0};
        kmp_shared_loads found;
        kmp_text text = {0};
        CHECK(eval && kmp_find_shared_loads(eval, 0, q, &arena, &found) == KEMPE_OK);
        CHECK(eval && kmp_put_shared_loads(&text, l.model, &found) == 0);
        kmp_text_free(&text);
        kmp_arena_free(&arena);
        kmp_eval_free(eval);
        unload(&l);
    }
}

/* -- refused ----------------------------------------------------------------------------------------- */

/* A frame on two hinges, 1 m apart, with all its mass 0.1 m from their middle: by Lagrange's multipliers the least sum
 * of squares has forces with the difference d and moments L^2 d, where d/2 + 2 L^2 d is the moment of the weight. */
static void loads_of_least_norm(void)
{
    loaded l =
        load_text("kempe: 1\ngravity: [0, 0, -10]\nground: {points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}\n"
                  "bodies: {b: {mass: 7, com: [0.1, 0, -0.3], inertia: {xx: 0.2, yy: 0.6, zz: 0.5}, "
                  "points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}}\n"
                  "joints: {hL: {revolute: [ground.L, b.L], axis: x}, hR: {revolute: [ground.R, b.R], axis: x}}\n"
                  "run: {t_end: 0.1, output_step: 0.05, outputs: [reaction(hL), moment(hR), reaction(hR)]}\n");
    const double square = l.system->length * l.system->length, d = 7 / (0.5 + 2 * square);
    const kempe_run_options run = {.loads = "least-norm"}, other = {.loads = "even"};
    const kempe_inverse_options ask = {.actuators = "hL", .loads = "least-norm"}, plain = {.actuators = "hL"};
    const kempe_equilibrium_options options = {.loads = "least-norm"}, solved = {.loads = "least-norm", .hold = "hL=0"};
    static const char *const names = "hL, hR: x, y, z, my, mz";
    kempe_trajectory *t = NULL;
    kempe_inverse *r = NULL;
    kempe_equilibrium *e = NULL;
    kempe_table *rows = NULL;
    CHECK(kempe_simulate(l.system, &run, &t) == KEMPE_OK && kempe_trajectory_table(t, "rows", &rows) == KEMPE_OK);
    CHECK(t && !strstr(t->warnings, "not unique"));
    for (int row = 0; rows && row < 3; row++) {
        CHECK_NEAR(kempe_table_number(rows, row, kempe_table_find(rows, "reaction.hL.z")), 35 - d / 2, 1e-12);
        CHECK_NEAR(kempe_table_number(rows, row, kempe_table_find(rows, "reaction.hR.z")), 35 + d / 2, 1e-12);
        CHECK_NEAR(kempe_table_number(rows, row, kempe_table_find(rows, "moment.hR.y")), -square * d, 1e-12);
    }
    kempe_table_free(rows);
    kempe_trajectory_free(t);
    CHECK(kempe_simulate(l.system, &other, &t) == KEMPE_E_ARGUMENT);
    CHECK(kempe_inverse_new(l.system, &ask, &r) == KEMPE_OK && kempe_inverse_table(r, "rows", &rows) == KEMPE_OK);
    CHECK_NEAR(kempe_table_number(rows, 0, kempe_table_find(rows, "reaction.hR.z")), 35 + d / 2, 1e-12);
    CHECK_NEAR(kempe_table_number(rows, 0, kempe_table_find(rows, "moment.hL.y")), -square * d, 1e-12);
    CHECK_TEXT(kempe_inverse_loads_not_unique(r), names);
    kempe_table_free(rows);
    kempe_inverse_free(r);
    CHECK(kempe_inverse_new(l.system, &plain, &r) == KEMPE_OK);
    CHECK(r && strstr(r->warnings, "loads that are not unique: hL, hR: x, y, z, my, mz"));
    kempe_inverse_free(r);
    CHECK(kempe_equilibrium_new(l.system, &options, &e) == KEMPE_OK && e->loads.joints == 1);
    CHECK_TEXT(kempe_equilibrium_loads_not_unique(e, 0), names);
    for (int k = 0; e && k < 2; k++) { /* the closure, then the joint of the tree */
        CHECK_NEAR(e->balance[0].reaction[6 * k + 2], 35 + (k ? -d / 2 : d / 2), 1e-12);
        CHECK_NEAR(e->balance[0].reaction[6 * k + 4], -square * d, 1e-12);
    }
    kempe_equilibrium_free(e);
    CHECK(kempe_equilibrium_new(l.system, &solved, &e) == KEMPE_E_ARGUMENT);
    unload(&l);
}

/* The level of friction on one of the two hinges is arbitrary. In a flat four-bar forces across its plane are shared,
 * which its weight does not load: those in the plane press. */
static void friction_on_shared_loads(void)
{
    static const char *const texts[] = {
        "ground: {points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}\n"
        "bodies: {b: {mass: 7, com: [0.1, 0, -0.3], inertia: {xx: 0.2, yy: 0.6, zz: 0.5}, "
        "points: {L: [-0.5, 0, 0], R: [0.5, 0, 0]}}}\n"
        "joints: {hL: {revolute: [ground.L, b.L], axis: x}, hR: {revolute: [ground.R, b.R], axis: x}}\n"
        "start: {q: {hL: 1}}\n",
        "ground: {points: {O: [0, 0, 0], D: [0.9, 0, 0]}}\nbodies:\n"
        "  crank: {mass: 1, inertia: {yy: 0.01}, points: {O: [0, 0, 0], B: [0, 0, 0.3]}}\n"
        "  coupler: {mass: 2, inertia: {yy: 0.1}, points: {B: [0, 0, 0.3], C: [0.8, 0, 0.6]}}\n"
        "  rocker: {mass: 2, inertia: {yy: 0.1}, points: {D: [0.9, 0, 0], C: [0.8, 0, 0.6]}}\n"
        "joints: {hL: {revolute: [ground.O, crank.O], axis: y}, B: {revolute: [crank.B, coupler.B], axis: y}, "
        "C: {revolute: [coupler.C, rocker.C], axis: y}, D: {revolute: [ground.D, rocker.D], axis: y}}\n"};
    for (int k = 0; k < 2; k++) {
        char text[2048];
        kempe_trajectory *t = NULL;
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, -10]\n%sforces: {f: {joint: hL, friction: {mu: 0.3, radius: 0.02}}}\n"
                       "run: {t_end: 0.1, outputs: [q]}\n",
                       texts[k]);
        loaded l = load_text(text);
        CHECK(kempe_simulate(l.system, NULL, &t) == (k ? KEMPE_OK : KEMPE_UNTRUSTED));
        CHECK(k || (t && strstr(t->warnings, "friction 'f' depends on a load that redundant constraints share")));
        kempe_trajectory_free(t);
        unload(&l);
    }
}

static void refused(void)
{
    load_rejected("kempe: 1\nbodies:\n"
                  "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"
                  "  b: {joint: {name: W, weld: yes, at: a}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n"
                  "sensors: {s: reaction(W).x}\nrun: {outputs: [moment(W)]}\n",
                  "reaction: the load of joint 'W' is not known: it is a weld");
    load_rejected("kempe: 1\nbodies:\n"
                  "  b: {joint: {name: W, motions: [T1, R3, T1], at: ground}, mass: 1, inertia: {zz: 1}}\n"
                  "run: {outputs: [moment(W)]}\n",
                  "output moment: the load of joint 'W' is not known: it has translations before and after a rotation");
    load_rejected("kempe: 1\nbodies: {a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                  "forces: {f: {joint: A, torque: reaction(A).x}}\n",
                  "reaction of a joint of the tree is not allowed here, because it depends on the accelerations");
}

/* A ball on a turning table, rolling or slipping: its slip is the rate of no length. The table's joint carries both
 * weights and what accelerates the ball, at the place of contact. */
static void rolling(void)
{
    static const char *const friction[] = {"2", "0.05"};
    for (int k = 0; k < 2; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                       "  table: {joint: {name: w, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {T: "
                       "[0, 0, 0]}}\n"
                       "  ball: {joint: {name: b, free: x, at: ground}, mass: 1, inertia: {xx: 0.004, yy: 0.004, zz: "
                       "0.004}, points: {C: [0, 0, 0]}}\n"
                       "contacts: {on: {sphere: ball.C, radius: 0.1, on: {plane: table.T}, restitution: 0, friction: "
                       "%s}}\n"
                       "start: {q: {b.1: 1, b.2: 0.3, b.3: 0.1}, qd: {w: 2, b.1: 0.5, b.2: 2, b.4: 3}}\n"
                       "run: {t_end: 0.2, output_step: 0.2, rtol: 1e-11, outputs: [reaction(w), moment(w), "
                       "acceleration(ball.C), position(ball.C)]}\n",
                       friction[k]);
        loaded l = load_text(text);
        evaluated e = evaluate(&l, NULL, KEMPE_OK);
        CHECK(e.rows == 2);
        const double *row = e.rows == 2 ? shown_at(&e, 1) : NULL;
        if (row) {
            const double force[3] = {-row[6], -row[7], -row[8] - 9.81}; /* on the table */
            const double at[3] = {row[9], row[10], row[11] - 0.1};
            double moment[3];
            kmp_cross3(at, force, moment);
            CHECK(hypot(force[0], force[1]) > 0.1);
            for (int i = 0; i < 3; i++)
                CHECK_NEAR(row[i], -force[i] + (i == 2 ? 9.81 : 0), 1e-9);
            for (int i = 0; i < 2; i++)
                CHECK_NEAR(row[3 + i], -moment[i], 1e-9);
        }
        release(&e);
        unload(&l);
    }
}

/* A disc of radius 0.1 that does not turn slides along a floor or an outline, the normal force 10 N and the friction 5
 * N: its guide carries 0.5 N m, which the friction has about the centre. With a law it is 1 mm deep. */
static void sliding_discs(void)
{
    static const char *const surface[] = {"plane: ground.O, normal: y", "outline: table, at: ground.O",
                                          "outline: block, at: ground.O"};
    static const struct {
        const char *law;
        double height;
    } kind[] = {{"restitution: 0, friction: 0.5", 0.1},
                {"law: hertz, exponent: 1, stiffness: 1e4, friction: {coefficient: 0.5, speed: 1e-6}", 0.099}};
    for (int k = 0; k < 6; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, -10, 0]\nground: {points: {O: [0, 0, 0]}}\n"
                       "outlines:\n  table: {segment: [[5, 0], [-5, 0]]}\n"
                       "  block: {rectangle: [2, 2], at: [0, -1], round: 0.3}\nbodies:\n"
                       "  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
                       "  disc: {joint: {name: y, prismatic: y, at: slide}, mass: 1, points: {C: [0, 0, 0]}}\n"
                       "contacts: {c: {cylinder: disc.C, radius: 0.1, on: {%s}, %s}}\n"
                       "start: {q: {y: %g}, qd: {x: 1}}\n"
                       "run: {t_end: 0.01, output_step: 0.01, rtol: 1e-11, outputs: [moment(y)]}\n",
                       surface[k % 3], kind[k / 3].law, kind[k / 3].height);
        loaded l = load_text(text);
        evaluated e = evaluate(&l, NULL, KEMPE_OK);
        CHECK(e.rows == 2);
        CHECK_NEAR(e.rows == 2 ? shown_at(&e, 1)[2] : 0, 0.5, 1e-9);
        release(&e);
        unload(&l);
    }
}

/* A force ends at the time of a row. The row is before that, with accelerations and forces of one side. */
static void rows_at_events(void)
{
    static const char *const formulation[] = {"reduced", "projected", "dae"};
    for (int k = 0; k < 3; k++) {
        loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                             "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: "
                             "{zz: 0.1}, points: {P: [1, "
                             "0, 0]}}\nforces: {f: {at: a.P, force: [0, \"if(t < 0.05, 1000*t, 0)\", 0]}}\n"
                             "sensors: {s: \"if(t < 0.05, 1, 2)\"}\n"
                             "run: {t_end: 0.1, output_step: 0.01, outputs: [reaction(A), s, q, qd, qdd]}\n");
        const kempe_run_options options = {.formulation = formulation[k], .rtol = 1e-10};
        evaluated e = evaluate(&l, &options, KEMPE_OK);
        CHECK(e.rows == 11);
        for (int row = 4; e.rows == 11 && row < 7; row++) {
            const double *at = shown_at(&e, row), q = *kempe_trajectory_q(e.run, row),
                         qd = *kempe_trajectory_qd(e.run, row);
            const double qdd = *kempe_trajectory_qdd(e.run, row), force = row < 6 ? 10 * row : 0;
            CHECK_NEAR(at[1], 0.5 * (qdd * cos(q) - qd * qd * sin(q)) + 9.81 - force, 1e-9);
            CHECK(at[3] == (row < 6 ? 1 : 2));
        }
        kempe_table *reactions = NULL;
        CHECK(e.run && kempe_trajectory_table(e.run, "reactions", &reactions) == KEMPE_OK);
        const double largest = hypot(shown_at(&e, 5)[0], shown_at(&e, 5)[1]);
        CHECK_NEAR(reactions ? kempe_table_number(reactions, 0, kempe_table_find(reactions, "force")) : 0, largest,
                   1e-12);
        kempe_table_free(reactions);
        release(&e);
        unload(&l);
    }
}

/* A chain in space, whose hinges have three directions in turn; the operations of the loads of all its joints. */
static double operations_of_chain(int bodies)
{
    kmp_text text = {0};
    kmp_all_loads loads = {0};
    kmp_text_put(&text, "kempe: 1\ngravity: [0, 0, -9.81]\nbodies:\n  b0: {joint: {revolute: x, at: ground}, mass: 1, "
                        "inertia: {xx: 1, yy: 2, zz: 2}, points: {P: [1, 0.1, 0.2]}}\n");
    for (int k = 1; k < bodies; k++)
        kmp_text_printf(&text,
                        "  b%d: {joint: {revolute: %c, at: b%d.P}, mass: 1, inertia: {xx: 1, yy: 2, zz: 2}, points: "
                        "{P: [1, 0.1, 0.2]}}\n",
                        k, "xyz"[k % 3], k - 1);
    loaded l = load_text(text.s);
    CHECK(l.system && kmp_all_loads_init(&loads, l.system) == KEMPE_OK && loads.joints == bodies);
    const kmp_program *program = loads.formulas.program;
    const double operations = program->code[program->stages];
    kmp_all_loads_free(&loads);
    unload(&l);
    kmp_text_free(&text);
    return operations;
}

static void operations_grow_with_the_joints(void)
{
    const double ten = operations_of_chain(10), twenty = operations_of_chain(20), forty = operations_of_chain(40);
    CHECK_NEAR((forty - twenty) / (twenty - ten), 2, 0.02);
}

/* Pendulums beside each other, each with an elastic rope over a sheave, a spring of its own law against a stop and a
 * pair of elastic gear wheels; bytes that the loads of all joints take. */
static double bytes_of_elements(int count)
{
    kmp_text text = {0};
    kmp_all_loads loads = {0};
    kmp_text_put(&text, "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]");
    for (int k = 0; k < count; k++)
        kmp_text_printf(&text, ", A%d: [%d, 0, 0], C%d: [%g, -0.3, 0], E%d: [%d, 1, 0], F%d: [%g, 1, 0]", k, k, k,
                        k + 0.2, k, k, k, k + 0.1);
    kmp_text_put(&text, "}}\nbodies:\n");
    for (int k = 0; k < count; k++)
        kmp_text_printf(&text,
                        "  b%d: {joint: {revolute: z, at: ground.A%d}, mass: 1, inertia: {zz: 0.1}, com: [0.5, 0, 0], "
                        "points: {P: [0.6, 0, 0]}}\n"
                        "  e%d: {joint: {revolute: z, at: ground.E%d}, mass: 1, inertia: {zz: 0.1}}\n"
                        "  f%d: {joint: {revolute: z, at: ground.F%d}, mass: 1, inertia: {zz: 0.1}}\n",
                        k, k, k, k, k, k);
    kmp_text_put(&text, "ropes:\n");
    for (int k = 0; k < count; k++)
        kmp_text_printf(&text,
                        "  r%d: {along: [ground.A%d, {round: ground.C%d, radius: 0.05, turn: left, may_leave: yes}, "
                        "b%d.P], stiffness: 1000 N/m, preload: 3 N}\n",
                        k, k, k, k);
    kmp_text_put(&text, "gears:\n");
    for (int k = 0; k < count; k++)
        kmp_text_printf(&text, "  g%d: {between: [e%d, f%d], teeth: [20, 20], stiffness: 1e5}\n", k, k, k);
    kmp_text_put(&text, "contacts:\n");
    for (int k = 0; k < count; k++)
        kmp_text_printf(
            &text, "  c%d: {gap: \"1 + position(b%d.P).y\", law: kelvin_voigt, stiffness: 1e4, damping: 10}\n", k, k);
    loaded l = load_text(text.s);
    const unsigned long before = kmp_memory_bytes();
    CHECK(l.system && kmp_all_loads_init(&loads, l.system) == KEMPE_OK && loads.joints == 3 * count);
    const unsigned long bytes = kmp_memory_bytes() - before;
    kmp_all_loads_free(&loads);
    unload(&l);
    kmp_text_free(&text);
    return (double)bytes;
}

/* Elements are looked at across the joints between their bodies only. */
static void elements_count_where_they_act(void)
{
    const double few = bytes_of_elements(8), many = bytes_of_elements(16);
    printf("  loads of all joints: %.0f and %.0f bytes\n", few, many);
    CHECK(many < 3 * few);
}

int main(void)
{
    TEST(loads_balance_a_body);
    TEST(loads_of_cut_joints);
    TEST(compliant_contacts);
    TEST(friction_by_a_joint);
    TEST(a_pendulum);
    TEST(a_reversed_hinge);
    TEST(multipliers_of_locks);
    TEST(rigid_contact);
    TEST(shared_loads);
    TEST(loads_of_least_norm);
    TEST(friction_on_shared_loads);
    TEST(refused);
    TEST(rolling);
    TEST(sliding_discs);
    TEST(rows_at_events);
    TEST(operations_grow_with_the_joints);
    TEST(elements_count_where_they_act);
    return check_report();
}
