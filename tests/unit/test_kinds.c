/* SPDX-License-Identifier: BSD-3-Clause */
/* Mechanisms with every joint and closure against closed forms, published digits and each other. */
#include "base/text.h"
#include "constraints/diagnosis/diagnosis.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/kempe.h>

enum { MOST = 32 };

/* A state that a run came to. */
typedef struct end {
    int n, m, rank;
    double q[MOST], qd[MOST], lambda[MOST];
} end;

static end take(const kempe_system *system, const kempe_trajectory *t, int row)
{
    end e = {.n = system->n, .m = system->m};
    memcpy(e.q, kempe_trajectory_q(t, row), (size_t)e.n * sizeof *e.q);
    memcpy(e.qd, kempe_trajectory_qd(t, row), (size_t)e.n * sizeof *e.qd);
    if (e.m > 0)
        memcpy(e.lambda, kempe_trajectory_lambda(t, row), (size_t)e.m * sizeof *e.lambda);
    return e;
}

/* The state at t_end and, when wanted, at the start, of a file of tests/models or of a text (which has a line break).
 */
static end run(const char *model_text, const char *formulation, double t_end, double rtol, end *start)
{
    kempe_check *check = NULL;
    kempe_trajectory *t = NULL;
    kempe_run_options settings = {0};
    end e = {0};
    char path[512];
    snprintf(path, sizeof path, "tests/models/%s.yaml", model_text);
    loaded l = strchr(model_text, '\n') ? load_text(model_text) : load(path);
    kempe_status status = l.system ? KEMPE_OK : KEMPE_E_INPUT;
    settings.formulation = formulation;
    settings.integrator = independent_integrator(formulation);
    settings.t_end = settings.output_step = t_end;
    settings.rtol = rtol;
    if (status == KEMPE_OK)
        status = kempe_check_new(l.system, &check);
    if (status == KEMPE_OK)
        status = kempe_simulate(l.system, &settings, &t);
    CHECK(status == KEMPE_OK);
    if (status == KEMPE_OK) {
        e = take(l.system, t, kempe_trajectory_row_count(t) - 1);
        e.rank = check->part.r;
        if (start)
            *start = take(l.system, t, 0);
    } else {
        printf("%s\n", kempe_context_message(l.context));
    }
    kempe_trajectory_free(t);
    kempe_check_free(check);
    unload(&l);
    return e;
}

static void check_same(int n, const double *a, const double *b, double tolerance)
{
    for (int k = 0; k < n; k++)
        CHECK_NEAR(a[k], b[k], tolerance);
}

/* -- published and quadruple-precision references --------------------------------------------------------- */

/* Parallel recomputation of the IVP test set's "Car axis" in quadruple precision: left x, y, right x, y at t = 3. */
static void test_car_axis(void)
{
    static const double q[] = {0.049345578427524092, 0.49698946023000811, 1.0417425248854261, 0.37391102726536582};
    static const double qd[] = {-0.077058368403592084, 0.0074468665920684165, 0.017556815753541737,
                                0.77034104377960106};
    static const double lambda[] = {-0.0047368865908533265, -0.0011046803312595658};
    static const struct {
        const char *formulation;
        double rtol, near, rate;
    } formulations[] = {
        {"reduced", 1e-13, 1e-11, 1e-10}, {"projected", 1e-13, 1e-11, 1e-10}, {"dae", 1e-9, 1e-6, 2e-5}};
    for (size_t k = 0; k < sizeof formulations / sizeof *formulations; k++) {
        end e = run("car_axis_compact", formulations[k].formulation, 3, formulations[k].rtol, NULL);
        check_same(4, e.q, q, formulations[k].near);
        check_same(4, e.qd, qd, formulations[k].rate);
        check_same(2, e.lambda, lambda, formulations[k].rate);
    }
}

/* A mass on a spring, k = 100, L0 = 0.8, m = 1, g = 10: by a spring between points, by expressions in x and y, by an
 * angle and a length. Hanging straight down it is a harmonic oscillator about -(L0 + m g / k) = -0.9. */
static const char spring_pendulum[] =
    "kempe: 1\n"
    "name: spring_pendulum\n"
    "gravity: [0, -10, 0]\n"
    "parameters: {k: 100, L0: 0.8}\n"
    "ground: {points: {O: [0, 0, 0]}}\n"
    "bodies: {m: {joint: {motions: [T1, T2], at: ground}, mass: 1, points: {P: [0, 0, 0]}}}\n";
static const char by_points[] = "forces: {s: {spring: [ground.O, m.P], stiffness: k, free_length: L0}}\n";
static const char by_expressions[] = "forces:\n"
                                     "  x: {joint: m.1, force: \"k*(L0/sqrt(q(m.1)^2 + q(m.2)^2) - 1)*q(m.1)\"}\n"
                                     "  y: {joint: m.2, force: \"k*(L0/sqrt(q(m.1)^2 + q(m.2)^2) - 1)*q(m.2)\"}\n";
static const char polar[] = "kempe: 1\n"
                            "name: spring_pendulum\n"
                            "gravity: [0, -10, 0]\n"
                            "parameters: {k: 100, L0: 0.8}\n"
                            "bodies: {m: {joint: {motions: [R3, T1], at: ground}, mass: 1}}\n"
                            "forces: {s: {joint: m.2, force: \"-k*(q(m.2) - L0)\"}}\n"
                            "start: {q: {m.1: 0, m.2: 1}}\n"
                            "run: {t_end: 3}\n";

static void test_spring_pendulum(void)
{
    const char *const laws[] = {by_points, by_expressions};
    char text[2048];
    end r = run(polar, NULL, 3, 1e-12, NULL);
    for (int k = 0; k < 2; k++) {
        snprintf(text, sizeof text, "%s%sstart: {q: {m.1: 0, m.2: -1}}\nrun: {t_end: 3}\n", spring_pendulum, laws[k]);
        end e = run(text, NULL, 3, 1e-12, NULL);
        CHECK_NEAR(e.q[0], 0, 1e-12);
        CHECK_NEAR(e.q[1], -0.9 - 0.1 * cos(10 * 3.0), 1e-10);
        snprintf(text, sizeof text, "%s%sstart: {q: {m.1: 1, m.2: 0}}\nrun: {t_end: 3}\n", spring_pendulum, laws[k]);
        e = run(text, NULL, 3, 1e-12, NULL);
        CHECK_NEAR(e.q[0], r.q[1] * cos(r.q[0]), 1e-9);
        CHECK_NEAR(e.q[1], r.q[1] * sin(r.q[0]), 1e-9);
    }
}

/* Six legs with universal, prismatic and ball joints: the platform against quadruple precision. */
static void test_stewart(void)
{
    static const double half[] = {-0.0257986730053515, 0.00102286181918672, -0.00974092985486678,
                                  0.00363008127117684, 0.0169378911112010,  -0.0232104567492020};
    static const double one[] = {-0.0321326300284273,   0.00148593609150708, -0.0140969988747868,
                                 -0.000468991901972122, 0.0188465551438251,  0.0114330935154515};
    end e = run("stewart_tree", NULL, 0.5, 1e-12, NULL);
    CHECK(e.n == 24 && e.rank == 18);
    check_same(6, e.q, half, 1e-12);
    e = run("stewart_tree", "projected", 1, 1e-12, NULL);
    check_same(6, e.q, one, 1e-12);
}

/* Cut at the ball and cut at the universal joint. */
static void test_spatial_slider_crank(void)
{
    static const char *const models[] = {"spatial_slider_crank_hung", "spatial_slider_crank_ball"};
    for (int k = 0; k < 2; k++) {
        end e = run(models[k], NULL, 2, 1e-13, NULL);
        CHECK_NEAR(e.q[0], 20.1566346080908167, 1e-10);
        CHECK_NEAR(e.qd[0], 9.39187990729243264, 1e-10);
        CHECK_NEAR(0.2 + e.q[1], 0.263897611064486434, 1e-10);
        e = run(models[k], k ? "projected" : NULL, 5, 1e-13, NULL);
        CHECK_NEAR(e.q[0], 51.7104255500431729, 1e-9);
        CHECK_NEAR(0.2 + e.q[1], 0.269561582173336600, 1e-9);
    }
}

/* Five rows of rank four, and closed forms: q1 = q3 = q5, sin q1 + sin q2 + sin q1 sin q2 = 0. */
static void test_bricard(void)
{
    static const char *const formulations[] = {"reduced", "projected"};
    for (int k = 0; k < 2; k++) {
        end e = run("bricard_hinge", formulations[k], 2, 1e-12, NULL);
        CHECK(e.m == 5 && e.rank == 4);
        CHECK_NEAR(cos(e.q[0]) * (1 + sin(e.q[1])), -0.778135373033290889, 1e-9);
        CHECK_NEAR(e.q[2], e.q[0], 1e-10);
        CHECK_NEAR(e.q[4], e.q[0], 1e-10);
        CHECK_NEAR(sin(e.q[0]) + sin(e.q[1]) + sin(e.q[0]) * sin(e.q[1]), 0, 1e-10);
    }
}

/* Five rows of rank two; the same motion as with two balls on the axis, and the closed form. */
static void test_bennett(void)
{
    end e = run("bennett_hinge", NULL, 1.5, 1e-12, NULL), balls = run("bennett_balls", NULL, 1.5, 1e-12, NULL);
    const double rad = atan(1) / 45, a = 40 * rad, b = 75 * rad;
    CHECK(e.m == 5 && e.rank == 2);
    check_same(3, e.q, balls.q, 1e-9);
    CHECK_NEAR(e.q[2], -e.q[0], 1e-10);
    CHECK_NEAR(fabs(tan(e.q[0] / 2) * tan(e.q[1] / 2)), fabs(sin((b + a) / 2) / sin((b - a) / 2)), 1e-8);
}

/* -- closed forms ----------------------------------------------------------------------------------------- */

/* Wheel A drives wheel B (three teeth on B for one on A, outside), and B a rack; all accelerations are constant. */
static void test_gears(void)
{
    static const char text[] =
        "kempe: 1\n"
        "ground: {points: {B: [1, 0, 0], R: [0, 2, 0]}}\n"
        "bodies:\n"
        "  a: {joint: {name: A, revolute: z, at: ground}, inertia: {xx: 0.4, yy: 0.4, zz: 0.5}}\n"
        "  b: {joint: {name: B, revolute: z, at: ground.B}, inertia: {xx: 2, yy: 2, zz: 2}}\n"
        "  r: {joint: {name: R, prismatic: x, at: ground.R}, mass: 3}\n"
        "loops:\n"
        "  G: {coupler: {A: 1, B: 3}}\n"
        "  K: {coupler: {R: 1, B: -200 mm}, equals: 0.03}\n"
        "forces: {m: {joint: A, torque: 4}, f: {joint: R, force: -5}}\n"
        "start: {q: {A: 0.2, B: 0.1}, hold: [A, B]}\n";
    const double mass = 9 * 0.5 + 2 + 0.04 * 3, accel = (-3 * 4 - 0.2 * 5) / mass, t = 0.8;
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    for (int k = 0; k < 3; k++) {
        end e = run(text, formulations[k], t, 1e-9, NULL);
        double b = 0.1 + accel * t * t / 2;
        CHECK_NEAR(e.q[1], b, 1e-7);
        CHECK_NEAR(e.q[0], 0.2 - 3 * (b - 0.1), 1e-7);
        CHECK_NEAR(e.q[2], 0.03 + 0.2 * b, 1e-7);
        CHECK_NEAR(e.lambda[0], -3 * 0.5 * accel - 4, 1e-6); /* J A'' = 4 + lambda */
        CHECK_NEAR(e.lambda[1], 3 * 0.2 * accel + 5, 1e-6);
    }
}

/* A nut that falls along its screw: (m + J (2 pi/p)^2) s'' = -m g. */
static void test_screw(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\n"
        "bodies:\n"
        "  nut: {joint: {name: S, screw: z, pitch: 20 mm, at: ground}, mass: 2, inertia: {xx: 1, "
        "yy: 1, zz: 1e-5}}\n";
    const double w = 8 * atan(1) / 0.02, accel = -2 * 9.81 / (2 + 1e-5 * w * w);
    end e = run(text, NULL, 0.5, 1e-10, NULL);
    CHECK(e.n == 2 && e.m == 1);
    CHECK_NEAR(e.q[0], accel / 8, 1e-12);
    CHECK_NEAR(e.q[1], w * accel / 8, 1e-12);
}

/* A locked elbow: two links as one pendulum, and what the lock must hold. */
static void test_lock(void)
{
    static const char links[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\n"
        "bodies:\n"
        "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], points: {E: [1, 0, 0]}}\n"
        "  b: {joint: {revolute: z, at: a.E}, mass: 2, com: [0.3, 0, 0]}\n"
        "drives: {elbow: {joint: b, locked: yes}}\n"
        "start: {q: {b: pi/2}}\n";
    static const char one[] = "kempe: 1\ngravity: [0, -9.81, 0]\n"
                              "bodies:\n"
                              "  a: {joint: {revolute: z, at: ground}, mass: 3, com: [2.5/3, 0.2, 0],\n"
                              "      inertia: {zz: 1*2/3*(0.25 + 0.09)}}\n";
    end start, e = run(links, NULL, 1, 1e-11, &start), same = run(one, NULL, 1, 1e-11, NULL);
    double inertia = 0.25 + 2 * (1 + 0.09), turn = -9.81 * 2.5 / inertia;
    CHECK_NEAR(e.q[0], same.q[0], 1e-9);
    CHECK_NEAR(e.q[1], 2 * atan(1), 1e-12);
    CHECK_NEAR(start.lambda[0], 2 * 0.09 * turn, 1e-9); /* on b about its joint, below which the weight has no lever */
}

/* Bars welded to each other are one bar. */
static void test_weld(void)
{
    static const char parts[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {m: 2, d: 0.3}\n"
        "bodies:\n"
        "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}, "
        "points: {E: [1, 0, 0]}}\n"
        "  base: {joint: {weld: yes, at: ground}, mass: 7, points: {F: [0.4, 0, 0]}}\n"
        "  c: {joint: {weld: yes, at: a.E, frame: {x: y, z: z}}, mass: m, com: [d, 0, 0], inertia: {zz: "
        "0.05}, points: {T: [0.6, 0, 0]}}\n"
        "  b: {joint: {revolute: z, at: c.T, frame: {x: -y}}, mass: 1, com: [0.4, 0, 0], inertia: {zz: "
        "0.02}}\n"
        "forces: {s: {spring: [base.F, c.T], stiffness: 30}}\n"
        "start: {qd: {b: 1}}\n";
    static const char one[] = "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {F: [0.4, 0, 0]}}\n"
                              "bodies:\n"
                              "  a: {joint: {revolute: z, at: ground}, mass: 3, com: [2.5/3, 0.2, 0],\n"
                              "      inertia: {zz: 0.15 + 1*2/3*(0.25 + 0.09)}, points: {T: [1, 0.6, 0]}}\n"
                              "  b: {joint: {revolute: z, at: a.T}, mass: 1, com: [0.4, 0, 0], inertia: {zz: 0.02}}\n"
                              "forces: {s: {spring: [ground.F, a.T], stiffness: 30}}\n"
                              "start: {qd: {b: 1}}\n";
    end e = run(parts, NULL, 2, 1e-12, NULL), same = run(one, NULL, 2, 1e-12, NULL);
    CHECK(e.n == 2);
    check_same(2, e.q, same.q, 1e-8);
    check_same(2, e.qd, same.qd, 1e-8);
}

/* -- a planar loop in space --------------------------------------------------------------------------------- */

/* A four-bar in the plane whose axes are the columns of the text's `axes`; the loop is closed by `closure`. */
static end four_bar(const char *axes, const char *gravity, const char *closure, const char *formulation)
{
    kmp_text text = {0};
    kmp_text_printf(
        &text,
        "kempe: 1\ngravity: %s\n"
        "ground: {points: {G: {at: [0, 0, 0], axes: %s}}}\n"
        "bodies:\n"
        "  base: {joint: {weld: yes, at: ground.G}, points: {D: [0.9, 0, 0]}}\n"
        "  crank: {joint: {name: A, revolute: z, at: base}, mass: 1, com: [0.15, 0, 0], inertia: {xx: 0.01, yy: "
        "0.01, zz: 0.0075}, points: {E: [0.3, 0, 0]}}\n"
        "  coupler: {joint: {name: B, revolute: z, at: crank.E}, mass: 1, com: [0.4, 0, 0], inertia: {xx: 0.05, "
        "yy: 0.06, zz: 0.05333}, points: {E: [0.8, 0, 0]}}\n"
        "  rocker: {joint: {name: C, revolute: z, at: base.D}, mass: 1, com: [0.35, 0, 0], inertia: {xx: 0.04, "
        "yy: 0.04, zz: 0.0408}, points: {E: [0.7, 0, 0]}}\n"
        "loops: {L: {%s: [coupler.E, rocker.E]}}\n"
        "start: {q: {A: pi/2, B: -1, C: 1.8}, qd: {A: 5}, hold: [A]}\n",
        gravity, axes, closure);
    end e = run(text.s, formulation, 2, 1e-12, NULL);
    kmp_text_free(&text);
    return e;
}

/* Three redundant rows: the axis and the two directions of the hinge. */
static void test_planar_loop_in_space(void)
{
    static const char tilted[] = "{x: [2, 1, 2], y: [-2, 2, 1]}", down[] = "[6.54, -6.54, -3.27]";
    static const char *const formulations[] = {"reduced", "projected"};
    end plane = four_bar("{x: x}", "[0, -9.81, 0]", "ball", NULL);
    CHECK(plane.rank == 2);
    for (int k = 0; k < 2; k++) {
        end e = four_bar(tilted, down, "revolute", formulations[k]);
        printf("  %s: %d rows of rank %d\n", formulations[k], e.m, e.rank);
        CHECK(e.rank == 2);
        check_same(3, e.q, plane.q, 1e-9);
        check_same(3, e.qd, plane.qd, 1e-8);
    }
}

/* -- a free body -------------------------------------------------------------------------------------------- */

/* Euler's equations and the rate of a quaternion, p = (w, x, y, z), body axes. */
static void top_rates(const double inertia[3], const double *y, double *rate)
{
    const double *w = y, *p = y + 3;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        rate[i] = (inertia[j] - inertia[k]) * w[j] * w[k] / inertia[i];
    }
    rate[3] = -(p[1] * w[0] + p[2] * w[1] + p[3] * w[2]) / 2;
    rate[4] = (p[0] * w[0] + p[2] * w[2] - p[3] * w[1]) / 2;
    rate[5] = (p[0] * w[1] + p[3] * w[0] - p[1] * w[2]) / 2;
    rate[6] = (p[0] * w[2] + p[1] * w[1] - p[2] * w[0]) / 2;
}

/* The classical Runge-Kutta method. */
static void top_integrate(const double inertia[3], double *y, double t_end, int steps)
{
    double h = t_end / steps, k[4][7], x[7];
    static const double share[] = {0, 0.5, 0.5, 1};
    for (int s = 0; s < steps; s++) {
        for (int stage = 0; stage < 4; stage++) {
            for (int i = 0; i < 7; i++)
                x[i] = y[i] + (stage ? share[stage] * h * k[stage - 1][i] : 0);
            top_rates(inertia, x, k[stage]);
        }
        for (int i = 0; i < 7; i++)
            y[i] += h * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]) / 6;
    }
}

static void of_quaternion(const double *p, double r[3][3])
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        r[i][i] = 1 - 2 * (p[1 + j] * p[1 + j] + p[1 + k] * p[1 + k]);
        r[i][j] = 2 * (p[1 + i] * p[1 + j] - p[0] * p[1 + k]);
        r[j][i] = 2 * (p[1 + i] * p[1 + j] + p[0] * p[1 + k]);
    }
}

/* Rx(a) Ry(b) Rz(c) */
static void of_angles(const double *q, double r[3][3])
{
    double sa = sin(q[0]), ca = cos(q[0]), sb = sin(q[1]), cb = cos(q[1]), sc = sin(q[2]), cc = cos(q[2]);
    double m[3][3] = {{cb * cc, -cb * sc, sb},
                      {ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb},
                      {sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb}};
    memcpy(r, m, sizeof m);
}

/* Rates of the angles to the angular velocity in body axes. */
static void spin_of(const double *q, const double *qd, double w[3])
{
    double sb = sin(q[1]), cb = cos(q[1]), sc = sin(q[2]), cc = cos(q[2]);
    w[0] = cb * cc * qd[0] + sc * qd[1];
    w[1] = -cb * sc * qd[0] + cc * qd[1];
    w[2] = sb * qd[0] + qd[2];
}

static void test_free_body(void)
{
    static const char text[] = "kempe: 1\n"
                               "bodies:\n"
                               "  top: {joint: {free: x, at: ground}, mass: 2, inertia: {xx: 1, yy: 2, zz: 2.5}}\n"
                               "start: {qd: {top.1: 0.1, top.2: -0.2, top.3: 0.3, top.4: 3, top.5: 0.5, top.6: 0.8}}\n";
    static const double inertia[3] = {1, 2, 2.5}, w0[3] = {3, 0.5, 0.8};
    double y[7] = {3, 0.5, 0.8, 1, 0, 0, 0}, r[3][3], expected[3][3], w[3], energy = 0, energy0 = 0;
    end e = run(text, NULL, 5, 1e-12, NULL);
    top_integrate(inertia, y, 5, 20000);
    of_quaternion(y + 3, expected);
    of_angles(e.q + 3, r);
    check_same(9, &r[0][0], &expected[0][0], 1e-9);
    spin_of(e.q + 3, e.qd + 3, w);
    check_same(3, w, y, 1e-9);
    for (int i = 0; i < 3; i++) {
        double momentum = 0;
        for (int k = 0; k < 3; k++)
            momentum += r[i][k] * inertia[k] * w[k];
        CHECK_NEAR(momentum, inertia[i] * w0[i], 1e-9);
        energy += inertia[i] * w[i] * w[i] / 2;
        energy0 += inertia[i] * w0[i] * w0[i] / 2;
    }
    CHECK_NEAR(energy, energy0, 1e-10);
    CHECK_NEAR(e.q[2], 1.5, 1e-12);
}

/* -- a cam ------------------------------------------------------------------------------------------------- */

/* A follower on a curve that turns: y = f(x) in the cam's axes, f a parabola. */
static void test_curve(void)
{
    static const char text[] =
        "kempe: 1\ntables: {f: {x: [-2, 0, 2], y: [2, 1, 2]}}\n"
        "bodies:\n"
        "  cam: {joint: {name: A, revolute: z, at: ground}, inertia: {zz: 1}, points: {C: [0, 0, 0]}}\n"
        "  follower: {joint: {name: S, prismatic: y, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
        "loops: {C: {point_on_curve: [cam.C, follower.P], table: f}}\n"
        "drives: {m: {joint: A, angle: 0.5*t}}\n"
        "start: {q: {S: 1}}\n";
    end e = run(text, NULL, 1, 1e-10, NULL);
    double x = e.q[1] * sin(0.5), y = e.q[1] * cos(0.5);
    CHECK_NEAR(y, 1 + x * x / 4, 1e-12);
}

/* -- a joint and its cut ----------------------------------------------------------------------------------- */

/* The second body hangs on the first by `joint`, or is free and held by `closure`. */
static end hung(const char *joint, const char *closure, const char *formulation)
{
    kmp_text text = {0};
    kmp_text_printf(
        &text,
        "kempe: 1\ngravity: [1, 2, -9.81]\nground: {points: {E: {at: [0.3, 1, 0.2], axes: {z: [1, 2, 2], x: [2, 1, "
        "-2]}}}}\n"
        "bodies:\n"
        "  a: {joint: {revolute: x, at: ground}, mass: 1, com: [0.1, 0.5, 0.2], inertia: {xx: 0.2, yy: 0.1, zz: "
        "0.15}, points: {E: {at: [0.3, 1, 0.2], axes: {z: [1, 2, 2], x: [2, 1, -2]}}}}\n"
        "  b: {joint: {%s}, mass: 2, com: [0.3, -0.2, 0.4], inertia: {xx: 0.3, yy: 0.2, zz: 0.25, xy: 0.02}, "
        "points: {O: [0, 0, 0]}}\n",
        closure ? "free: x, at: ground.E" : joint);
    if (closure)
        kmp_text_printf(&text, "loops: {C: {%s}}\n", closure);
    end e = run(text.s, formulation, 0.4, 1e-11, NULL);
    kmp_text_free(&text);
    return e;
}

/* The rows that a cut adds leave what the joint leaves, and the first body moves alike. */
static void test_cut_joints(void)
{
    static const struct {
        const char *joint, *closure;
        int rows;
    } pairs[] = {{"revolute: z, at: a.E", "revolute: [a.E, b.O]", 5},
                 {"universal: x, at: a.E", "universal: [a.E, b.O], axes: [x, y]", 4},
                 {"cylindrical: [0, 1, 1], at: a.E", "cylindrical: [a.E, b.O], axis: [0, 1, 1]", 4},
                 {"prismatic: [1, 0, 2], at: a.E", "prismatic: [a.E, b.O], axis: [1, 0, 2]", 5},
                 {"spherical: y, at: a.E", "ball: [a.E, b.O]", 3},
                 {"motions: [T1, T3, R1, R2, R3], at: a.E", "point_on_plane: [a.E, b.O], axis: y", 1},
                 {"motions: [T1, R1, R2, R3], at: a.E", "point_on_line: [a.E, b.O], axis: x", 2},
                 {"planar: [2, 0, 1], at: a.E", "planar: [a.E, b.O], axis: [2, 0, 1]", 3},
                 {"weld: yes, at: a.E", "weld: [a.E, b.O]", 6}};
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
        end tree = hung(pairs[k].joint, NULL, NULL);
        end cut = hung(pairs[k].joint, pairs[k].closure, k % 2 ? "projected" : "reduced");
        CHECK(cut.m == pairs[k].rows && cut.rank == cut.m);
        CHECK_NEAR(cut.q[0], tree.q[0], 1e-9);
        CHECK_NEAR(cut.qd[0], tree.qd[0], 1e-9);
    }
}

/* -- angles ------------------------------------------------------------------------------------------------- */

/* A ball whose second angle goes to 90 degrees. If something requires its angles, the reason names it, on every
 * formulation, and nothing ends well by chance; otherwise it moves on. */
static void singular_start(const char *start, const char *formulation, const char *more, const char *expected)
{
    kmp_text text = {0};
    kmp_text_printf(&text,
                    "kempe: 1\ngravity: [0, 0, -9.81]\n"
                    "bodies:\n"
                    "  a: {joint: {name: ball, spherical: z, at: ground}, mass: 1, com: [0, 0, -0.5], "
                    "inertia: {xx: 0.1, yy: 0.1, zz: 0.05}}\n"
                    "start: {q: {ball.2: %s}, qd: {ball.1: 1e-6, ball.2: 9}}\n%s",
                    start, more);
    loaded l = load_text(text.s);
    kempe_trajectory *t = NULL;
    kempe_run_options settings = {0};
    settings.formulation = formulation;
    settings.integrator = independent_integrator(formulation);
    settings.t_end = 1;
    CHECK(kempe_simulate(l.system, &settings, &t) == (expected ? KEMPE_E_FAILED : KEMPE_OK));
    CHECK(!expected || strstr(kempe_context_message(l.context), expected) != NULL);
    kempe_trajectory_free(t);
    unload(&l);
    kmp_text_free(&text);
}

static void test_singular_angles(void)
{
    static const char said[] = "joint 'ball' reaches the singular position of its angles, ball.2 = 1.5";
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    for (int k = 0; k < 3; k++) {
        singular_start("1", formulations[k], "sensors: {s: q(ball.2)}\n", said);
        singular_start("pi/2", formulations[k], "sensors: {s: q(ball.2)}\n", said);
        singular_start("1", formulations[k], "", NULL);
        singular_start("pi/2", formulations[k], "", NULL);
    }
}

int main(void)
{
    TEST(test_car_axis);
    TEST(test_spring_pendulum);
    TEST(test_stewart);
    TEST(test_spatial_slider_crank);
    TEST(test_bricard);
    TEST(test_bennett);
    TEST(test_gears);
    TEST(test_screw);
    TEST(test_lock);
    TEST(test_weld);
    TEST(test_planar_loop_in_space);
    TEST(test_free_body);
    TEST(test_curve);
    TEST(test_cut_joints);
    TEST(test_singular_angles);
    return check_report();
}
