/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of trajectories through rigid contacts and friction that sticks: against closed forms of the motion,
 * differentiated in long double numbers (random mechanisms: tests/oracle/event_slopes); loads at
 * rest that vary; what has no derivative. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "sensitivity_of.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/sensitivity.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

typedef long double real;

enum { MOST = 4 };

/* -- closed forms -------------------------------------------------------------------------------------- */

/* Place and rate at the time `end` of a ball that falls from h, with restitution e and gravity g; p[3] is its rate
 * along the floor. */
static void ball(const real p[MOST], real end, real out[2])
{
    real e = p[0], h = p[1], g = p[2], t = sqrtl(2 * h / g), v = e * g * t;
    while (t + 2 * v / g < end) {
        t += 2 * v / g;
        v *= e;
    }
    t = end - t;
    out[0] = v * t - g * t * t / 2;
    out[1] = v - g * t;
}

/* Place and rate of a mass that slides with friction mu N from the rate v, and rests. Its mass p[2] does not count, its
 * load p[3] does. */
static void slide(const real p[MOST], real end, real out[2])
{
    real a = p[1] * p[3] / p[2], t = fminl(end, p[0] / a);
    out[0] = p[0] * t - a * t * t / 2;
    out[1] = p[0] - a * t;
}

/* Place and rate of a mass m that rests under a force r t until this exceeds the static friction s; it slips with l. */
static void pull(const real p[MOST], real end, real out[2])
{
    real r = p[0], s = p[1], l = p[2], m = p[3], t0 = s / r;
    out[0] =
        (r * (end * end * end - t0 * t0 * t0) / 6 - r * t0 * t0 / 2 * (end - t0) - l * (end - t0) * (end - t0) / 2) / m;
    out[1] = (r * (end * end - t0 * t0) / 2 - l * (end - t0)) / m;
}

/* A mass that is pushed by the force F from the time T on, until it strikes a stop: p[0] is T, p[1] is F. The stop is
 * at 1 with the restitution p[2]; m = p[3]. */
static void late_push(const real p[MOST], real end, real out[2])
{
    real a = p[1] / p[3], v = sqrtl(2 * a), t = end - p[0] - v / a;
    out[0] = 1 - p[2] * v * t + a * t * t / 2;
    out[1] = -p[2] * v + a * t;
}

/* A ball with the restitution p[0] that falls from h = p[1] with g = p[2]. At its impact a force n, of its mass, begins
 * with k times the time and the rate behind the impact: p[3] is k. */
static void latched(const real p[MOST], real end, real out[2])
{
    real t0 = sqrtl(2 * p[1] / p[2]), v = p[0] * p[2] * t0, n = p[3] * t0 * v, t = end - t0;
    out[0] = v * t + (n - p[2]) * t * t / 2;
    out[1] = v + (n - p[2]) * t;
}

/* The same where the force begins on the way, at half the height, with k times this time and the rate there; then it
 * strikes with the restitution p[0]. */
static void latched_before(const real p[MOST], real end, real out[2])
{
    real t0 = sqrtl(p[1] / p[2]), v0 = -p[2] * t0, n = p[3] * t0 * v0, a = n - p[2], h = p[1] / 2;
    real v = -sqrtl(v0 * v0 - 2 * a * h), t1 = (v - v0) / a, t = end - t0 - t1;
    out[0] = -p[0] * v * t + a * t * t / 2;
    out[1] = -p[0] * v + a * t;
}

/* A mass m = p[3] on friction mu = p[0] and a stop at 1, with the force of a relay that a sample switches on at 0.3:
 * p[1], and from then on p[2] times the place there too. */
static void sampled_latch(const real p[MOST], real end, real out[2])
{
    real a = (p[1] - p[0]) / p[3], x = a * 0.3L * 0.3L / 2, v = a * 0.3L, b = (p[1] + p[2] * x - p[0]) / p[3],
         t = end - 0.3L;
    out[0] = x + v * t + b * t * t / 2;
    out[1] = v + b * t;
}

typedef void motion(const real p[MOST], real end, real out[2]);

static void differentiate(motion *of, const double *value, int k, double end, double slope[2])
{
    static const real weight[] = {1, -8, 0, 8, -1};
    real sum[2] = {0}, step = 1e-4L * (real)value[k], p[MOST], out[2];
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < MOST; j++)
            p[j] = (real)value[j] + (j == k ? (i - 2) * step : 0);
        of(p, (real)end, out);
        for (int j = 0; j < 2; j++)
            sum[j] += weight[i] * out[j];
    }
    for (int j = 0; j < 2; j++)
        slope[j] = (double)(sum[j] / (12 * step));
}

static const char *const methods[] = {"forward", "adjoint"};

static void compare_by(const char *method, const char *text, const char *outputs, const char *integrator, motion *of,
                       const double value[MOST], double end, double within)
{
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of(method, c, text, outputs, integrator, end, 0);
    real p[MOST], x[2];
    for (int k = 0; k < MOST; k++)
        p[k] = (real)value[k];
    of(p, (real)end, x);
    for (int j = 0; s && j < 2; j++)
        CHECK_NEAR(kmp_sensitivity_value(s, s->rows - 1, j), (double)x[j], within * (1 + fabs((double)x[j])));
    for (int k = 0; s && k < MOST; k++) {
        double slope[2];
        differentiate(of, value, k, end, slope);
        for (int j = 0; j < 2; j++)
            CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, j, k), slope[j], within * (1 + fabs(slope[j])));
    }
    kempe_sensitivity_free(s);
    kempe_context_free(c);
}

/* By both methods; the adjoint method has no delayed signals. */
static void compare(const char *text, const char *integrator, motion *of, const double value[MOST], double end,
                    double within)
{
    for (int k = 0; k < (strstr(text, "delay") ? 1 : 2); k++)
        compare_by(methods[k], text, "q,qd", integrator, of, value, end, within);
}

#define MASS(m) "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: " m "}}\n"

static const char falling[] = "kempe: 1\nparameters: {e: 0.8, h: 1, g: 9.81, v: 1}\ngravity: [-g, 0, 0]\n" MASS(
    "1") "contacts: {floor: {joint: x, lower: 0, restitution: e}}\nstart: {q: {x: h}}\n";
static const char sliding[] = "kempe: 1\nparameters: {v: 2, mu: 0.3, m: 2, N: 10}\n" MASS(
    "m") "forces: {f: {joint: x, friction: {force: mu*N}}}\nstart: {qd: {x: v}}\n";
static const char pulled[] = "kempe: 1\nparameters: {r: 3, s: 6, l: 4, m: 2}\n" MASS(
    "m") "forces: {f: {joint: x, friction: {force: l, static: s}}, pull: {joint: x, force: r*t}}\n";

static const char late[] =
    "kempe: 1\nparameters: {T: 0.3, F: 5, e: 0.7, m: 2}\nstates: {y: {delay: F + 0*q(x), time: T, start: 0}}\n" MASS(
        "m") "contacts: {end: {joint: x, upper: 1, restitution: e}}\nforces: {f: {joint: x, force: y}}\n";
#define LATCH(when, next)                                                                                              \
    "kempe: 1\nparameters: {e: 0.8, h: 1, g: 9.81, k: 2}\ngravity: [-g, 0, 0]\nstates: {n: {when: \"" when             \
    "\", next: " next "}}\n" MASS("1") "contacts: {floor: {joint: x, lower: 0, restitution: e}}\n"                     \
                                       "forces: {f: {joint: x, force: n}}\nstart: {q: {x: h}}\n"
static const char latch[] = LATCH("qd(x) > 0", "k*t*qd(x)");
static const char latch_before[] = LATCH("q(x) < h/2", "k*t*qd(x)");
static const char by_sample[] =
    "kempe: 1\nparameters: {mu: 1, F: 5, k: 4, m: 2}\nstates: {u: {sample: 0.3, next: u + 1}, "
    "n: {when: u > 1.5, next: k*q(x)}}\n" MASS("m") "forces: {f: {joint: x, force: F + n}, g: {joint: x, friction: "
                                                    "{force: mu}}}\nstart: {qd: {x: 0}}\n";

/* Signals and states that change at events, between impacts and friction. */
static void signals_at_events(void)
{
    static const char *const integrators[] = {"dop853", "radau9", NULL};
    for (int k = 0; k < 3; k++) {
        compare(late, integrators[k], late_push, (const double[]){0.3, 5, 0.7, 2}, 1.4, 1e-9);
        compare(latch, integrators[k], latched, (const double[]){0.8, 1, 9.81, 2}, 0.7, 1e-9);
        compare(latch_before, integrators[k], latched_before, (const double[]){0.8, 1, 9.81, 2}, 0.7, 1e-9);
        compare(by_sample, integrators[k], sampled_latch, (const double[]){1, 5, 4, 2}, 0.7, 1e-9);
    }
}

/* Compares the derivatives of place and rate at a time with differences of runs at other values of parameter k. */
static void beside_runs(const char *method, const char *form, const double value[2], double end, double within)
{
    char text[2048];
    double slope[2][2], value_at[5][2];
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < 5; i++) {
            const double step = 2e-5 * (i - 2);
            (void)snprintf(text, sizeof text, form, value[0] + (k == 0 ? step : 0), value[1] + (k == 1 ? step : 0));
            kempe_context *c = kempe_context_new();
            kempe_sensitivity *s = sensitivity_of(method, c, text, "q,qd", "dop853", end, 0);
            for (int j = 0; j < 2; j++) {
                value_at[i][j] = s ? kmp_sensitivity_value(s, s->rows - 1, j) : NAN;
                slope[k][j] = s && i == 2 ? kmp_sensitivity_slope(s, s->rows - 1, j, k) : slope[k][j];
            }
            kempe_sensitivity_free(s);
            kempe_context_free(c);
        }
        for (int j = 0; j < 2; j++) {
            const double by = (8 * (value_at[3][j] - value_at[1][j]) - (value_at[4][j] - value_at[0][j])) / (12 * 2e-5);
            CHECK_NEAR(slope[k][j], by, within * (1 + fabs(by)));
        }
    }
}

/* A mass under a late signal of its own rate, which jumps at the impact, and by compliant and rigid contact with
 * friction. */
static void mixed(void)
{
    static const char seen[] =
        "kempe: 1\nparameters: {e: %.17g, T: %.17g}\nstates: {y: {delay: qd(x), time: T}}\n" MASS(
            "1") "forces: {f: {joint: x, force: 3 - 2*y}, g: {joint: x, friction: {force: 0.1}}}\n"
                 "contacts: {a: {joint: x, upper: 0.3, restitution: e}}\nstart: {qd: {x: 0.1}}\n";
    static const char soft[] =
        "kempe: 1\nparameters: {mu: %.17g, m: %.17g}\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: "
        "m}, k: {joint: {name: y, prismatic: x, at: m}, mass: 1}}\n"
        "forces: {f: {joint: x, force: 5*sin(3*t)}, g: {joint: x, friction: {force: mu}}, "
        "s: {joint: y, spring: {stiffness: 30}}}\n"
        "contacts: {c: {gap: 0.5 - q(x) - q(y), law: hunt_crossley, stiffness: 1e4, restitution: 0.5}, "
        "d: {joint: y, upper: 0.1, restitution: 0.4}}\n";
    beside_runs("forward", seen, (const double[]){0.6, 0.2}, 0.9, 1e-7);
    for (int k = 0; k < 2; k++)
        beside_runs(methods[k], soft, (const double[]){0.5, 2}, 1.5, 1e-6);
}

static void closed_forms(void)
{
    static const char *const integrators[] = {"dop853", "radau9", NULL};
    for (int k = 0; k < 3; k++) {
        compare(falling, integrators[k], ball, (const double[]){0.8, 1, 9.81, 1}, 0.7, 1e-10);
        compare(falling, integrators[k], ball, (const double[]){0.8, 1, 9.81, 1}, 2.5, 1e-9);
        compare(sliding, integrators[k], slide, (const double[]){2, 0.3, 2, 10}, 0.5, 1e-10);
        compare(sliding, integrators[k], slide, (const double[]){2, 0.3, 2, 10}, 3, 1e-10);
        compare(pulled, integrators[k], pull, (const double[]){3, 6, 4, 2}, 5, 1e-9);
    }
}

/* A box with two corners over a floor. */
#define BOX(mass, left, right, start)                                                                                  \
    "gravity: [0, -g, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies: {b: {joint: {name: j, planar: z, at: ground}, "    \
    "mass: " mass ", inertia: {zz: 0.01}, points: {L: [" left ", 0, 0], R: [" right ", 0, 0]}}}\ncontacts: {l: "       \
    "{point: b.L, on: {plane: ground.O, normal: y}, restitution: e}, r: {point: b.R, on: {plane: ground.O, normal: "   \
    "y}, restitution: e}}\nstart: {q: {j.2: h" start "}}\n"

/* A row of two masses on friction, whose pulls are the same but for the place of a third mass. */
#define ROW(start)                                                                                                     \
    "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: m}, n: {joint: {name: y, prismatic: x, at: "       \
    "ground}, mass: m}, o: {joint: {name: z, prismatic: y, at: ground}, mass: 1}}\nforces: {f: {joint: x, friction: "  \
    "{force: l, static: s}}, g: {joint: y, friction: {force: l, static: s}}, p: {joint: x, force: r*t}, q: {joint: "   \
    "y, force: r*t + q(z)}}\nstart: {q: {z: " start "}}\n"

/* Events of one time that depend on each other's conditions only by a state that no parameter moves: the corners of a
 * box strike together, and so they rebound, and two masses let go. */
static void together(void)
{
    static const char box[] = "kempe: 1\nparameters: {e: 0.8, h: 1, g: 9.81, m: 2}\n" BOX("m", "-0.1", "0.1", "");
    static const char wide[] = "kempe: 1\nparameters: {e: 0.8, h: 1, g: 9.81, w: 0.1}\n" BOX("2", "-w", "w", "");
    static const char row[] = "kempe: 1\nparameters: {r: 3, s: 6, l: 4, m: 2}\n" ROW("0");
    static const char *const integrators[] = {"dop853", "radau9", NULL};
    for (int k = 0; k < 3; k++)
        for (int by = 0; by < 2; by++) {
            const double value[] = {0.8, 1, 9.81, 2};
            compare_by(methods[by], box, "position(b.L).y,velocity(b.L).y", integrators[k], ball, value, 0.7, 1e-10);
            compare_by(methods[by], box, "position(b.L).y,velocity(b.L).y", integrators[k], ball, value, 2.5, 1e-9);
            compare_by(methods[by], wide, "position(b.L).y,velocity(b.L).y", integrators[k], ball,
                       (const double[]){0.8, 1, 9.81, 0.1}, 2.5, 1e-9);
            compare_by(methods[by], row, "q(x),qd(x)", integrators[k], pull, (const double[]){3, 6, 4, 2}, 5, 1e-9);
            compare_by(methods[by], row, "q(y),qd(y)", integrators[k], pull, (const double[]){3, 6, 4, 2}, 5, 1e-9);
        }
}

/* After all rebounds the ball rests: only the integral of its place depends on the parameters. */
static void a_sequence_ends_by(const char *method)
{
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of(method, c, falling, "q,qd,lambda(floor)", NULL, 6, 0);
    for (int k = 0; s && k < 4; k++) {
        CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, 0, k), 0, 1e-9);
        CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, 1, k), 0, 1e-9);
        CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, 2, k), k == 2, 1e-9);
    }
    kempe_sensitivity_free(s);
    /* h integrated: sum of flights of the rate v e^k, each v^3 e^3k 4/(6 g^2), after the first fall. */
    s = sensitivity_of(method, c, falling, "q(x)", NULL, 6, 1);
    const double e = 0.8, h = 1, g = 9.81, v = sqrt(2 * g * h), t = sqrt(2 * h / g);
    const double first = h * t - g * t * t * t / 6, all = 2 * v * v * v / (3 * g * g) * e * e * e / (1 - e * e * e);
    CHECK_NEAR(s ? kmp_sensitivity_value(s, 0, 0) : NAN, first + all, 1e-8);
    CHECK_NEAR(s ? kmp_sensitivity_slope(s, 0, 0, 0) : NAN,
               2 * v * v * v / (3 * g * g) * 3 * e * e / ((1 - e * e * e) * (1 - e * e * e)), 1e-7);
    CHECK_NEAR(s ? kmp_sensitivity_slope(s, 0, 0, 1) : NAN, 1.5 * (first + all) / h, 1e-7);
    CHECK_NEAR(s ? kmp_sensitivity_slope(s, 0, 0, 2) : NAN, -0.5 * (first + all) / g, 1e-7);
    kempe_sensitivity_free(s);
    kempe_context_free(c);
}

/* The level of a floor under the ball is the place where it rests; up to the end of the rebounds it is not. */
static void on_a_level(const char *method)
{
    static const char text[] = "kempe: 1\nparameters: {e: 0.8, h: 1, g: 9.81, level: 0.2}\ngravity: [-g, 0, 0]\n" MASS(
        "1") "contacts: {floor: {joint: x, lower: level, restitution: e}}\nstart: {q: {x: h + 0.2}}\n";
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of(method, c, text, "q,qd", NULL, 6, 0);
    for (int k = 0; s && k < 4; k++) {
        CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, 0, k), k == 3, 1e-9);
        CHECK_NEAR(kmp_sensitivity_slope(s, s->rows - 1, 1, k), 0, 1e-9);
    }
    CHECK(s);
    kempe_sensitivity_free(s);
    kempe_context_free(c);
}

static void a_sequence_ends(void)
{
    for (int k = 0; k < 2; k++) {
        a_sequence_ends_by(methods[k]);
        on_a_level(methods[k]);
    }
}

/* Both methods agree where a motor starts within milliseconds while its table sticks: the weights of the adjoint method
 * are smooth there, and the integrals over the motion are not. */
static void fast_at_rest(void)
{
    static const char drive[] =
        "kempe: 1\nparameters: {U: 1.2, R: 2, L: 5e-3, K: 0.1}\nstates: {i: {rate: (U - R*i - K*qd(screw))/L}}\n"
        "bodies: {s: {joint: {name: screw, revolute: x, at: ground}, mass: 1, inertia: {xx: 1e-3}}, t: {joint: {name: "
        "x, prismatic: x, at: ground}, mass: 5}}\n"
        "forces: {motor: {joint: screw, torque: K*i - 1e-3*(2e4*(1e-3*q(screw) - q(x)))}, nut: {joint: x, force: "
        "2e4*(1e-3*q(screw) - q(x))}, guide: {joint: x, friction: {force: 15, static: 30}}}\n";
    static const char *const integrators[] = {"dop853", "radau9", NULL};
    for (int k = 0; k < 3; k++) {
        kempe_context *c = kempe_context_new();
        kempe_sensitivity *one = sensitivity_of("forward", c, drive, "q,qd", integrators[k], 0.2, 0);
        kempe_sensitivity *other = sensitivity_of("adjoint", c, drive, "q,qd", integrators[k], 0.2, 0);
        for (int j = 0; one && other && j < 4; j++)
            for (int i = 0; i < 4; i++) {
                const double slope = kmp_sensitivity_slope(one, one->rows - 1, j, i);
                CHECK_NEAR(kmp_sensitivity_slope(other, 0, j, i), slope, 1e-7 * (1 + fabs(slope)));
            }
        kempe_sensitivity_free(one);
        kempe_sensitivity_free(other);
        kempe_context_free(c);
    }
}

/* The integral of a rate up to the rest of a pendulum on a floor, where the weights of the rate are rounding:
 * tolerances of their size have no end. Both methods agree on the place where it rests. */
static void rest_of_a_pendulum(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0,0,-9.81]\nparameters: {L: 0.6, e: 0.5, hgt: -0.35, w: 2.5}\n"
        "ground: {points: {O: [0,0,0], F: [0,0,hgt]}}\nbodies: {p: {joint: {spherical: x, name: s, at: ground.O}, "
        "mass: 1.2, com: [L,0,0], inertia: {xx: 0.01, yy: 0.05, zz: 0.06}, points: {T: [L,0,0]}}}\n"
        "contacts: {floor: {sphere: p.T, radius: 0.05, on: {plane: ground.F, normal: z}, restitution: e}}\n"
        "start: {qd: {s.1: 1, s.2: 0.2, s.3: w}}\n";
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *found[2] = {NULL, NULL};
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(c, text, "model.yaml", &model) == KEMPE_OK);
    for (int k = 0; model && k < 2; k++) {
        kempe_run_options run = {.rtol = 1e-10, .t_end = 2.5, .output_step = 2.5, .integrator = "radau9"};
        run.no_convergence_check = 1;
        run.max_steps = 100000;
        const kempe_sensitivity_options ask = {
            .outputs = "velocity(p.T)", .method = methods[k], .integral = 1, .run = &run};
        CHECK(kempe_sensitivity_new(model, &ask, &found[k]) == KEMPE_OK);
    }
    for (int j = 0; found[0] && found[1] && j < 3; j++)
        for (int i = 0; i < 4; i++)
            CHECK_NEAR(kmp_sensitivity_slope(found[1], 0, j, i), kmp_sensitivity_slope(found[0], 0, j, i), 1e-7);
    CHECK_NEAR(found[1] ? kmp_sensitivity_slope(found[1], 0, 2, 2) : NAN, 1, 1e-8); /* the height of the floor */
    for (int k = 0; k < 2; k++)
        kempe_sensitivity_free(found[k]);
    kempe_model_free(model);
    kempe_context_free(c);
}

/* -- forces by loads --------------------------------------------------------------------------------------- */

/* A five-bar linkage whose start gives the rate of one crank, with a force by the load of its loop: derivatives of the
 * other rates, of least norm, are those of J' mu alone. They do not depend on the coefficient of the force. */
static void corrected_rates(void)
{
    static const char text[] =
        "kempe: 1\nparameters: {mu: 0.2}\n"
        "ground: {points: {O: [0, 0, 0], D: [0.6, 0, 0]}}\nbodies:\n"
        "  a: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.3, 0, 0]}}\n"
        "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, inertia: {zz: 0.05}, points: {C: [0.5, 0, 0]}}\n"
        "  d: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 0.02}, points: {E: [0.3, 0, 0]}}\n"
        "  c: {joint: {name: E, revolute: z, at: d.E}, mass: 1, inertia: {zz: 0.04}, points: {C: [0.5, 0, 0]}}\n"
        "loops: {C: {ball: [b.C, c.C]}}\n"
        "forces: {f: {joint: B, torque: \"-mu*sqrt(lambda(C.1)^2 + lambda(C.2)^2)\"}}\n"
        "start: {q: {A: 100 deg, B: -60 deg, D: 80 deg, E: 60 deg}, qd: {A: 3}, hold: [A, D]}\n";
    kempe_context *c = kempe_context_new();
    kempe_sensitivity *s = sensitivity_of("forward", c, text, "qd", NULL, 0.1, 0);
    for (int j = 0; s && j < 4; j++)
        CHECK_NEAR(kmp_sensitivity_slope(s, 0, j, 0), 0, 1e-12);
    kempe_sensitivity_free(s);
    kempe_context_free(c);
}

/* -- loads of a mechanism at rest ------------------------------------------------------------------------- */

/* The time of the first event after the start; infinity: none. */
static double first_event(const char *text, const kempe_run_options *run, kempe_outcome *outcome)
{
    kempe_context *c = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_table *log = NULL;
    double first = INFINITY;
    CHECK(kempe_model_read_text(c, text, "model.yaml", &model) == KEMPE_OK &&
          kempe_system_new(model, &system) == KEMPE_OK);
    kempe_status status = kempe_simulate(system, run, &t);
    CHECK(status == KEMPE_OK);
    CHECK(t && kempe_trajectory_table(t, "log", &log) == KEMPE_OK);
    for (int row = 0; log && row < kempe_table_row_count(log); row++) {
        const double at = kempe_table_number(log, row, kempe_table_find(log, "t"));
        first = at > 0 ? fmin(first, at) : first;
    }
    *outcome = t ? kempe_trajectory_outcome(t) : KEMPE_OUTCOME_FAILED;
    if (isinf(first) && t)
        first = kempe_trajectory_time(t, kempe_trajectory_row_count(t) - 1);
    kempe_table_free(log);
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(c);
    return first;
}

/* A load a t sin(2 pi t) on friction of 4.905 N, and on a lock of which 40 N are the end. No error of a step shows the
 * load, because nothing moves. */
static void loads_at_rest(void)
{
    static const char *const ways[][2] = {
        {"reduced", "dop853"}, {"reduced", "radau"}, {"projected", "dop853"}, {"dae", "radau"}, {NULL, NULL}};
    static const char stuck[] =
        "kempe: 1\n" MASS("1") "forces: {load: {joint: x, force: \"0.9*t*sin(2*pi*max(t, 0.1))\"}, f: {joint: x, "
                               "friction: {force: 4.905}}}\n";
    static const char locked[] = "kempe: 1\n" MASS(
        "1") "forces: {load: {joint: x, force: \"5*t*sin(2*pi*t)\"}}\ndrives: {d: {joint: x, locked: yes}}\n"
             "run: {until: lambda(d) > 40}\n";
    for (int k = 0; k < 5; k++) {
        kempe_run_options run = {0};
        kempe_outcome outcome;
        run.formulation = ways[k][0];
        run.integrator = ways[k][1];
        run.t_end = 20;
        run.rtol = 1e-8;
        CHECK_NEAR(first_event(stuck, &run, &outcome), 5.70246436125, 1e-9);
        CHECK(outcome == KEMPE_OUTCOME_COMPLETE);
        CHECK_NEAR(first_event(locked, &run, &outcome), 8.68630884530, 1e-9);
        CHECK(outcome == KEMPE_OUTCOME_COMPLETE);
    }
}

/* -- what has no derivative -------------------------------------------------------------------------------- */

/* `word`: of the message; NULL: nothing is refused. */
static void refuse(const char *text, kempe_sensitivity_options options, const char *word)
{
    kempe_context *c = kempe_context_new();
    kempe_model *model = NULL;
    kempe_sensitivity *s = NULL;
    CHECK(kempe_model_read_text(c, text, "model.yaml", &model) == KEMPE_OK);
    const kempe_status status = model ? kempe_sensitivity_new(model, &options, &s) : KEMPE_OK;
    CHECK(word ? status == KEMPE_E_ARGUMENT || status == KEMPE_E_FAILED : status == KEMPE_OK);
    CHECK(!word || strstr(kempe_context_message(c), word));
    if (word ? !strstr(kempe_context_message(c), word) : status != KEMPE_OK)
        printf("%s\n", kempe_context_message(c));
    kempe_sensitivity_free(s);
    kempe_model_free(model);
    kempe_context_free(c);
}

/* A block slides from 3 m/s until it rests at 3/(mu g): while it slips its friction is -mu m g, and the impulse of the
 * friction up to its rest is -3 m. By a force, and by a contact. At rest there is nothing to integrate (erk). */
static void forces_of_slip(const char *method, const char *integrator)
{
    static const char *const laws[] = {"forces: {f: {joint: b, friction: {force: mu*m*9.81}}}\n",
                                       "forces: {f: {sliding: q(b) - 0*t, friction: {force: mu*m*9.81}}}\n",
                                       ("contacts: {n: {point: block.P, on: {plane: ground.O, normal: y}, "
                                        "restitution: 0, friction: mu}}\n")};
    const double mu = 0.4, m = 2, g = 9.81;
    for (int law = 0; law < 3; law++) {
        char text[800], outputs[80];
        const char *f = law == 2 ? "n_friction" : "f";
        (void)snprintf(text, sizeof text,
                       "kempe: 1\nparameters: {mu: 0.4, m: 2}\n"
                       "gravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\n"
                       "bodies: {block: {joint: {name: b, %s, at: ground}, mass: m, inertia: {zz: 1}, "
                       "points: {P: [0, 0, 0]}}}\n%ssensors: {s: lambda(%s.1)}\nstart: {qd: {%s: 3}}\n",
                       law == 2 ? "planar: z" : "prismatic: x", laws[law], f, law == 2 ? "b.1" : "b");
        (void)snprintf(outputs, sizeof outputs, "lambda(%s),force(%s),sensor(s)", f, f);
        kempe_context *c = kempe_context_new();
        kempe_sensitivity *early = sensitivity_of(method, c, text, outputs, integrator, 0.5, 0),
                          *whole = sensitivity_of(method, c, text, outputs, integrator, 1.5, 1);
        for (int k = 0; early && whole && k < 3; k++) {
            const int last = early->rows - 1;
            CHECK_NEAR(kmp_sensitivity_value(early, last, k), -mu * m * g, 1e-9);
            CHECK_NEAR(kmp_sensitivity_slope(early, last, k, 0), -m * g, 1e-9);
            CHECK_NEAR(kmp_sensitivity_slope(early, last, k, 1), -mu * g, 1e-9);
            CHECK_NEAR(kmp_sensitivity_value(whole, whole->rows - 1, k), -3 * m, 1e-9);
            CHECK_NEAR(kmp_sensitivity_slope(whole, whole->rows - 1, k, 0), 0, 1e-8);
            CHECK_NEAR(kmp_sensitivity_slope(whole, whole->rows - 1, k, 1), -3, 1e-8);
        }
        CHECK(early && whole);
        kempe_sensitivity_free(early);
        kempe_sensitivity_free(whole);
        kempe_context_free(c);
    }
}

static void loads_in_slip(void)
{
    static const char *const integrators[] = {"dop853", "erk", "radau", "radau9"};
    for (int k = 0; k < 4; k++) {
        forces_of_slip("forward", integrators[k]);
        forces_of_slip("adjoint", integrators[k]);
    }
}

static void what_is_refused(void)
{
    static const char plastic[] =
        "kempe: 1\nparameters: {e: 0}\ngravity: [-9.81, 0, 0]\n" MASS("1") "contacts: {floor: {joint: x, lower: 0, "
                                                                           "restitution: e}}\nstart: {q: {x: 0.1}}\n";
    static const char resting[] = "kempe: 1\nparameters: {level: 0}\ngravity: [-9.81, 0, 0]\n" MASS(
        "1") "contacts: {floor: {joint: x, lower: level, "
             "restitution: 0}}\n";
    static const char two[] =
        "kempe: 1\nparameters: {h: 0.1}\ngravity: [0, -9.81, 0]\n"
        "bodies: {b: {joint: {name: j, planar: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {L: [-0.1, 0, 0], "
        "R: [0.1, 0, 0]}}}\nground: {points: {O: [0, 0, 0], H: [0, h - 0.1, 0]}}\n"
        "contacts: {l: {point: b.L, on: {plane: ground.O, normal: y}, restitution: 0.5}, r: {point: b.R, on: {plane: "
        "ground.H, normal: y}, restitution: 0.5}}\nstart: {q: {j.2: 0.2}}\n";
    static const char shared[] = "kempe: 1\nparameters: {r: 3}\n" MASS(
        "1") "forces: {f: {joint: x, friction: {force: 4}}, g: {joint: x, friction: "
             "{force: 2}}, pull: {joint: x, force: r*t}}\nrun: {t_end: 3}\n";
    static const char meeting[] =
        "kempe: 1\nparameters: {h: 1}\ngravity: [-8, 0, 0]\ninputs: {u: {t: [0, 0.5], value: [0, 1], method: "
        "hold}}\n" MASS(
            "1") "forces: {f: {joint: x, force: \"u + if(q(x) < 0, 3, 0)\"}}\n%sstart: {q: {x: h}}\nrun: {t_end: 1}\n";
    static const char tilted[] = "kempe: 1\nparameters: {e: 0.5, h: 0.2, g: 9.81, tilt: 0}\n" BOX(
        "2", "-0.1", "0.1", ", j.3: tilt") "run: {t_end: 0.3}\n";
    static const char longer[] = "kempe: 1\nparameters: {e: 0.5, h: 0.2, g: 9.81, w: 0.1}\n" BOX(
        "2", "-w", "0.1", ", j.3: 0.01 - 0.1*w") "run: {t_end: 0.3}\n";
    static const char pushed[] = "kempe: 1\nparameters: {r: 3, s: 6, l: 4, m: 2, z: 0}\n" ROW("z") "run: {t_end: 5}\n";
    char text[512];
    for (int k = 0; k < 2; k++) {
        (void)snprintf(text, sizeof text, meeting, k ? "contacts: {a: {joint: x, lower: -3, restitution: 0.5}}\n" : "");
        refuse(text, (kempe_sensitivity_options){0}, "an input jumps at t = 0.5 together with the condition");
    }
    refuse(plastic, (kempe_sensitivity_options){0}, "with respect to a restitution of zero");
    refuse(resting, (kempe_sensitivity_options){0}, "its distance changes with a parameter");
    refuse(two, (kempe_sensitivity_options){0}, "strike together");
    refuse(shared, (kempe_sensitivity_options){0}, "share its load");
    for (int k = 0; k < 2; k++) { /* the same sentence, by both methods */
        const kempe_sensitivity_options by = {.method = methods[k]};
        refuse(two, by, "in different ways: the motion has no derivative there");
        refuse(tilted, by, "contacts strike together at t = 0.2019");
        refuse(longer, by, "contacts strike together at t = 0.2019");
        refuse(pushed, by, "the conditions friction 'f' and friction 'g' change together at t = 2");
        refuse(resting, by, "its distance changes with a parameter");
        refuse(tilted, (kempe_sensitivity_options){.method = methods[k], .parameters = "e,h,g"}, NULL);
    }
}

int main(void)
{
    TEST(closed_forms);
    TEST(signals_at_events);
    TEST(mixed);
    TEST(together);
    TEST(a_sequence_ends);
    TEST(fast_at_rest);
    TEST(rest_of_a_pendulum);
    TEST(corrected_rates);
    TEST(loads_at_rest);
    TEST(loads_in_slip);
    TEST(what_is_refused);
    return check_report();
}
