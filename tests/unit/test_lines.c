/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces along lines, cylinders, torsions: closed forms of oscillators, springs and joint torques by the same law,
 * balance of energy, linearised equations. */
#include "loaded.h"
#include <kempe/table.h>
#include <stdlib.h>

enum { MOST = 16 };

/* The last row of a run: q, then qd, then the outputs of the model; the drift of its energy. */
typedef struct result {
    double q[MOST], qd[MOST];
    double drift;
} result;

static double number_after(const char *text, const char *word)
{
    const char *at = text ? strstr(text, word) : NULL;
    return at ? strtod(at + strlen(word), NULL) : NAN;
}

static result run_text(const char *text, const char *formulation, double rtol, double t_end)
{
    result r = {.drift = NAN};
    kempe_trajectory *run = NULL;
    char *json = NULL;
    loaded l = load_text(text);
    const kempe_run_options options = {.formulation = formulation,
                                       .integrator = independent_integrator(formulation),
                                       .no_convergence_check = 1,
                                       .rtol = rtol,
                                       .t_end = t_end};
    for (int k = 0; k < MOST; k++)
        r.q[k] = r.qd[k] = NAN;
    if (!l.system || kempe_simulate(l.system, &options, &run) != KEMPE_OK) {
        printf("%s\n", kempe_context_message(l.context));
    } else {
        int n = kempe_model_coordinate_count(l.model), last = kempe_trajectory_row_count(run) - 1;
        memcpy(r.q, kempe_trajectory_q(run, last), (size_t)n * sizeof *r.q);
        memcpy(r.qd, kempe_trajectory_qd(run, last), (size_t)n * sizeof *r.qd);
        CHECK(kempe_trajectory_print(run, KEMPE_JSON, &json) == KEMPE_OK);
        r.drift = number_after(json, "\"drift_rel\":");
    }
    kempe_text_free(json);
    kempe_trajectory_free(run);
    unload(&l);
    return r;
}

#define MASS                                                                                                           \
    "kempe: 1\n"                                                                                                       \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies: {mass: {joint: {name: S, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}}\n"

/* Duffing's oscillator x'' + x + x^3 = 0 from x = 1: x(10) and v(10) by Jacobi's functions (friction.md, U1). The
 * distance is x + 5. */
static void duffing(void)
{
    result r = run_text(MASS "forces: {s: {line: [ground.O, mass.P], force: '(distance - 5) + (distance - 5)^3'}}\n"
                             "start: {q: {S: 6}}\n",
                        NULL, 1e-12, 10);
    CHECK_NEAR(r.q[0] - 5, 0.79887476899741432621, 2e-11);
    CHECK_NEAR(r.qd[0], -0.81126377416376961914, 2e-11);
}

/* x'' + x'|x'| + x = 0 from x = 1 (friction.md, U2): the kinks of |rate| are located. */
static void quadratic_damper(void)
{
    result r = run_text(MASS "forces: {s: {line: [ground.O, mass.P], force: 'distance - 5 + rate*abs(rate)'}}\n"
                             "start: {q: {S: 6}}\n",
                        NULL, 1e-12, 20);
    CHECK_NEAR(r.q[0] - 5, 0.0770774434165933541, 2e-11);
}

/* A damper by a table of straight lines, with knees (friction.md, U3). */
static void tabulated_damper(void)
{
    result r =
        run_text("kempe: 1\n"
                 "ground: {points: {O: [0, 0, 0]}}\n"
                 "tables: {damper: {x: [-1, -0.2, 0, 0.2, 1], y: [-680, -360, 0, 120, 280], method: linear}}\n"
                 "bodies: {mass: {joint: {name: S, prismatic: x, at: ground}, mass: 300, points: {P: [0, 0, 0]}}}\n"
                 "forces: {s: {line: [ground.O, mass.P], force: '20000*(distance - 5) + damper(rate)'}}\n"
                 "start: {q: {S: 5.1}}\n",
                 NULL, 1e-11, 2);
    CHECK_NEAR(r.q[0] - 5, -0.00222959180030157054, 1e-10);
    CHECK_NEAR(r.qd[0], 0.00152165830052926945, 1e-9);
}

/* A spring in space and the same by an expression. */
#define SPACE                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "parameters: {k: 90 N/m, c: 2, rest: 0.3}\n"                                                                       \
    "ground: {points: {O: [0.2, 0.1, 1]}}\n"                                                                           \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {name: A, universal: [x, y], at: ground}, mass: 2, com: [0, 0, -0.4],\n"                             \
    "      inertia: {xx: 0.1, yy: 0.1, zz: 0.01}, points: {P: [0.1, 0, -0.5]}}\n"                                      \
    "  b: {joint: {name: B, free: x, at: ground}, mass: 1, inertia: {xx: 0.01, yy: 0.02, zz: 0.03},\n"                 \
    "      points: {Q: [0.1, 0, 0.2]}}\n"                                                                              \
    "start: {q: {A.1: 0.4, B.1: 0.5, B.3: -0.3}, qd: {B.4: 2, A.2: -1}}\n"

static void like_a_spring(void)
{
    result s = run_text(SPACE "forces:\n"
                              "  u: {spring: [ground.O, a.P], stiffness: k, damping: c, free_length: rest}\n"
                              "  v: {spring: [a.P, b.Q], stiffness: k, damping: c, free_length: rest}\n",
                        NULL, 1e-11, 1);
    result l = run_text(SPACE "forces:\n"
                              "  u: {line: [ground.O, a.P], force: 'k*(distance - rest) + c*rate'}\n"
                              "  v: {line: [a.P, b.Q], force: 'k*(distance - rest) + c*rate'}\n",
                        NULL, 1e-11, 1);
    for (int k = 0; k < 8; k++) {
        CHECK_NEAR(l.q[k], s.q[k], 1e-9);
        CHECK_NEAR(l.qd[k], s.qd[k], 1e-8);
    }
    CHECK(l.drift < 1e-9);
}

/* A constant tension has the potential T |d|. */
static void constant_tension(void)
{
    result r =
        run_text(SPACE "forces: {u: {line: [ground.O, a.P], force: 12 N}, v: {line: [a.P, b.Q], force: k*rest}}\n",
                 NULL, 1e-11, 1);
    CHECK(r.drift < 1e-9);
}

/* Two masses on a rope without mass. It runs from the ceiling through the eye of the first mass and over a fixed pulley
 * to the second mass. The tension T acts twice on the first mass, 1 kg, and once on the second, 3 kg. The rope is
 * elastic: T = k (2 x + y - rest), x'' = g - 2 T, y'' = g - T/3, where x and y point downwards. */
static void pulleys(void)
{
    static const char model[] =
        "kempe: 1\n"
        "gravity: [0, -9.81, 0]\n"
        "ground: {points: {A: [0, 2, 0], B: [0, 2, 0], C: [1, 2, 0], D: [1, 2, 0]}}\n"
        "bodies:\n"
        "  a: {joint: {name: x, prismatic: -y, at: ground.B}, mass: 1, points: {P: [0, 0, 0]}}\n"
        "  b: {joint: {name: y, prismatic: -y, at: ground.D}, mass: 3, points: {Q: [0, 0, 0]}}\n"
        "forces: {rope: {line: [ground.A, a.P, ground.B, ground.C, b.Q], force: %s}}\n"
        "start: {q: {x: 1, y: 1.2}}\n";
    const double g = 9.81, k = 200, w = sqrt(k * (4 + 1. / 3)), mean = g * (2 + 1) / (w * w);
    char text[1024];
    double t = 0.3, s0 = 0.2, s = mean + (s0 - mean) * cos(w * t);
    (void)snprintf(text, sizeof text, model, "200*(distance - 4)");
    result r = run_text(text, NULL, 1e-11, t);
    CHECK_NEAR(2 * r.q[0] + r.q[1] - 3, s, 1e-9);
    CHECK(r.drift < 1e-7); /* its work has no error control */
    /* 2 y'' - x''/3 is free of T */
    CHECK_NEAR(r.q[0] - 6 * r.q[1], 1 - 6 * 1.2 - 5 * g * t * t / 2, 1e-10);
    (void)snprintf(text, sizeof text, model, "12 N"); /* a constant tension has a potential */
    r = run_text(text, NULL, 1e-11, t);
    CHECK_NEAR(r.q[0], 1 + (g - 24) * t * t / 2, 1e-12);
    CHECK_NEAR(r.q[1], 1.2 + (g - 4) * t * t / 2, 1e-12);
    CHECK(r.drift < 1e-10);
}

static void refused(const char *points, const char *sentence)
{
    char text[512];
    (void)snprintf(text, sizeof text, MASS "forces: {f: {line: [%s], force: 1}}\n", points);
    load_rejected(text, sentence);
}

static void mistakes_of_ropes(void)
{
    refused("ground.O", "2 items");
    refused("ground.O, mass.P, mass.P", "point 'mass.P' follows itself");
    refused("mass.P, mass.P, mass.P", "follows itself");
    refused("ground.O, mass.X, mass.P", "no point 'X'");
}

/* Constant pressures on both sides: the thrust of both areas moves the mass with x = F t^2 / (2 m). */
static void thrust(void)
{
    const double pi = 3.14159265358979323846,
                 force = pi / 4 * (30e5 * 0.08 * 0.08 - 2e5 * (0.08 * 0.08 - 0.045 * 0.045));
    result r =
        run_text("kempe: 1\n"
                 "parameters: {D: 80 mm}\n"
                 "ground: {points: {O: [0, 0, 0]}}\n"
                 "bodies: {mass: {joint: {name: S, prismatic: x, at: ground}, mass: 400, points: {P: [0, 0, 0]}}}\n"
                 "forces: {c: {cylinder: [ground.O, mass.P], bore: D, rod: 45 mm, pressure: 30 bar, "
                 "rod_pressure: 2 bar}}\n"
                 "start: {q: {S: 1}}\n",
                 NULL, 1e-11, 0.5);
    CHECK_NEAR(r.q[0], 1 + force * 0.25 / 800, 1e-11);
    CHECK_NEAR(r.qd[0], force * 0.5 / 400, 1e-11);
    CHECK(r.drift < 1e-10);
}

/* An oil spring: the pressure falls linearly with the stroke, and a throttle damps it. x = stroke - 1:
 * m x'' = A (p0 - s x - r x'), an oscillator about p0/s. */
static void oil_spring(void)
{
    const double A = 3.14159265358979323846 / 4 * 0.05 * 0.05, m = 20, s = 8e6, r = 4e4, p0 = 4e5, t = 0.7;
    double w2 = A * s / m, d = A * r / (2 * m), w = sqrt(w2 - d * d), mid = p0 / s, e = exp(-d * t);
    double x = mid - mid * e * (cos(w * t) + d / w * sin(w * t)), v = mid * e * w2 / w * sin(w * t);
    result got =
        run_text("kempe: 1\n"
                 "ground: {points: {O: [0, 0, 0]}}\n"
                 "bodies: {mass: {joint: {name: S, prismatic: x, at: ground}, mass: 20, points: {P: [0, 0, 0]}}}\n"
                 "forces: {c: {cylinder: [ground.O, mass.P], bore: 50 mm, pressure: '4 bar - 80 bar/m*(distance - "
                 "1) - 0.4 bar*s/m*rate'}}\n"
                 "start: {q: {S: 1}}\n",
                 NULL, 1e-12, t);
    CHECK_NEAR(got.q[0], 1 + x, 1e-10);
    CHECK_NEAR(got.qd[0], v, 1e-9);
    CHECK(got.drift < 1e-8);
}

#define ROTORS                                                                                                         \
    "kempe: 1\n"                                                                                                       \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {name: A, revolute: %s, at: ground}, mass: 1, inertia: {xx: 0.02, yy: 0.02, zz: 0.02}, points: {P: " \
    "[0, 0, 0]}}\n"                                                                                                    \
    "  b: {joint: {name: B, revolute: %s, at: ground}, mass: 1, inertia: {xx: 0.03, yy: 0.03, zz: 0.03}, points: {P: " \
    "[0, 0, 0]}}\n"                                                                                                    \
    "forces: {shaft: {torsion: [a.P, b.P], axis: %s, torque: '0.6*angle + 0.01*rate'}}\n"                              \
    "start: {q: {A: 0.5, B: 9.5}, qd: {A: 3, B: -1}}\n"

/* Two rotors with a torsion: the angle d = B - A, more than a turn, is a damped oscillator of the reduced inertia;
 * their angular momentum is conserved. */
static void two_rotors(void)
{
    static const char *const axes[] = {"x", "y", "z"};
    const double I = 0.02 * 0.03 / 0.05, k = 0.6, c = 0.01, t = 1.3;
    double w2 = k / I, d = c / (2 * I), w = sqrt(w2 - d * d), e = exp(-d * t), x0 = 9, v0 = -4;
    double x = e * (x0 * cos(w * t) + (v0 + d * x0) / w * sin(w * t));
    double mean = (0.02 * 0.5 + 0.03 * 9.5) / 0.05 + (0.02 * 3 - 0.03) / 0.05 * t;
    for (int a = 0; a < 3; a++) {
        char text[2048];
        (void)snprintf(text, sizeof text, ROTORS, axes[a], axes[a], axes[a]);
        result r = run_text(text, NULL, 1e-12, t);
        CHECK_NEAR(r.q[1] - r.q[0], x, 1e-9);
        CHECK_NEAR((0.02 * r.q[0] + 0.03 * r.q[1]) / 0.05, mean, 1e-10);
        CHECK(r.drift < 1e-9);
    }
}

/* The words of a joint's torque are its coordinate and rate; a parameter of the same name has priority. */
static void words_of_joints(void)
{
    result a = run_text("kempe: 1\n"
                        "bodies: {r: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.02}}}\n"
                        "forces: {k: {joint: A, torque: '-0.6*angle - 0.01*rate'}}\n"
                        "start: {q: {A: 1}}\n",
                        NULL, 1e-11, 1);
    result b = run_text("kempe: 1\n"
                        "parameters: {rate: 0.01}\n"
                        "bodies: {r: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.02}}}\n"
                        "forces: {k: {joint: A, torque: '-0.6*angle - rate*qd(A)'}}\n"
                        "start: {q: {A: 1}}\n",
                        NULL, 1e-11, 1);
    result c = run_text("kempe: 1\n"
                        "bodies: {r: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.02}}}\n"
                        "forces: {k: {joint: A, spring: {stiffness: 0.6, damping: 0.01}}}\n"
                        "start: {q: {A: 1}}\n",
                        NULL, 1e-11, 1);
    CHECK_NEAR(a.q[0], c.q[0], 1e-10);
    CHECK_NEAR(b.q[0], c.q[0], 1e-10);
}

/* A torsion along a hinge in space that is tilted and carried by another body is the torque of the hinge. */
static void like_a_hinge(void)
{
#define HINGED                                                                                                         \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {name: A, universal: [x, y], at: ground}, mass: 2, com: [0, 0.1, -0.4], inertia: {xx: 0.1, yy: "     \
    "0.1, zz: 0.01}, points: {H: {at: [0, 0.2, -0.5], axes: {z: [1, 2, 2]}}}}\n"                                       \
    "  b: {joint: {name: B, revolute: z, at: a.H}, mass: 1, com: [0.2, 0, 0.1], inertia: {xx: 0.01, yy: 0.02, zz: "    \
    "0.03}, points: {H: [0, 0, 0]}}\n"                                                                                 \
    "start: {q: {A.1: 0.4, B: -0.3}, qd: {A.2: 2, B: 5}}\n"
    result t = run_text(HINGED "forces: {k: {torsion: [a.H, b.H], torque: '3*angle + 0.2*angle^3 + 0.05*rate'}}\n",
                        NULL, 1e-11, 1);
    result j =
        run_text(HINGED "forces: {k: {joint: B, torque: '-3*angle - 0.2*angle^3 - 0.05*rate'}}\n", NULL, 1e-11, 1);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(t.q[k], j.q[k], 1e-9);
    CHECK(t.drift < 1e-9);
}

/* In a closed loop, by all formulations. */
static void in_a_loop(void)
{
#define LOOP                                                                                                           \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "ground: {points: {O: [0, 0, 0], D: [0.9, 0, 0]}}\n"                                                               \
    "bodies:\n"                                                                                                        \
    "  crank: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.3, 0, 0]}}\n" \
    "  coupler: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.05}, points: {C: [0.8, 0, 0], "  \
    "M: [0.4, 0.1, 0]}}\n"                                                                                             \
    "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 0.04}, points: {C: [0.7, 0, "      \
    "0]}}\n"                                                                                                           \
    "loops: {C: {ball: [coupler.C, rocker.C]}}\n"                                                                      \
    "start: {q: {A: 60 deg, B: -40 deg, D: 100 deg}, hold: [A]}\n"
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    result first = {.drift = 0};
    for (int f = 0; f < 3; f++) {
        result r = run_text(LOOP "forces:\n"
                                 "  s: {line: [ground.D, coupler.M], force: '80*(distance - 0.4)^3 + 2*rate'}\n"
                                 "  c: {cylinder: [ground.O, rocker.C], bore: 30 mm, pressure: '0.4 bar - 0.2 "
                                 "bar*s/m*rate'}\n"
                                 "  t: {torsion: [coupler.C, rocker.C], torque: '0.5*angle + 0.1*rate'}\n",
                            formulations[f], 1e-10, 1);
        first = f == 0 ? r : first;
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(r.q[k], first.q[k], f == 2 ? 1e-6 : 1e-8);
        CHECK(r.drift < (f == 2 ? 1e-5 : 1e-8));
    }
}

int main(void)
{
    TEST(duffing);
    TEST(quadratic_damper);
    TEST(tabulated_damper);
    TEST(like_a_spring);
    TEST(constant_tension);
    TEST(pulleys);
    TEST(mistakes_of_ropes);
    TEST(thrust);
    TEST(oil_spring);
    TEST(two_rotors);
    TEST(words_of_joints);
    TEST(like_a_hinge);
    TEST(in_a_loop);
    return check_report();
}
