/* SPDX-License-Identifier: BSD-3-Clause */
/* Rigid contacts with restitution, against the digits of bench/machines/contact_digits.py. */
#include "ways.h"
#include <kempe/ensemble.h>
#include <kempe/inverse.h>
#include <kempe/kinematics.h>
#include <math.h>
#include <string.h>

static double time_of(const kempe_trajectory *run, const char *kind, int n)
{
    const kmp_log_entry *e = entry(run, kind, n);
    return e ? e->t : -1;
}

#define BALL(contact)                                                                                                  \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies: {ball: {joint: {name: z, prismatic: z, at: ground}, mass: 2, points: {C: [0, 0, 0]}}}\n"                  \
    "contacts: {floor: {" contact "}}\n"                                                                               \
    "start: {q: {z: 1}}\n"

/* C1: a ball whose impacts accumulate; 62 of them, then it rests. */
static void bouncing(loaded l, double height)
{
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 3), *whole = simulate(&l, &ways[k], 5);
        if (run) {
            CHECK_NEAR(time_of(run, "impact", 0), 0.45152364098573090445, e);
            CHECK_NEAR(time_of(run, "impact", 1), 1.1739614665629003516, e);
            CHECK_NEAR(time_of(run, "impact", 2), 1.7519117270246359093, e);
            CHECK(!entry(run, "impact", 6) && !entry(run, "accumulation", 0));
            CHECK_NEAR(last_q(run)[0] - height, 0.068707460965765722041, e);
            CHECK_NEAR(last_qd(run)[0], -0.01535413338474475932, e);
            CHECK(run->verdict.drift_rel < 100 * e);
            CHECK(run->report.impacts == 6 && run->report.changes == 0);
        }
        const kmp_log_entry *end = whole ? entry(whole, "accumulation", 0) : NULL;
        CHECK(end);
        if (end) {
            CHECK_NEAR(end->after, 4.0637127688715781401, 10 * e);
            CHECK(e > 1e-9 || fabs(time_of(whole, "impact", 61) - 4.063708340340593141) < 1e-11); /* the surface */
            CHECK(entry(whole, "impact", e > 1e-9 ? 50 : 61) && !entry(whole, "impact", 62));
            CHECK((e > 1e-9 || whole->report.impacts == 62) && whole->report.changes == 1);
            CHECK_TEXT(entry(whole, "contact", 0)->text, "'floor' closes");
            CHECK_NEAR(last_q(whole)[0], height, 1e-11);
            CHECK(last_qd(whole)[0] == 0);
            CHECK_NEAR(last_lambda(whole)[0], 2 * 9.81, 1e-11);
        }
        kempe_trajectory_free(run);
        kempe_trajectory_free(whole);
    }
    unload(&l);
}

/* C2: a sphere slips down an incline, then rolls. */
static void rolling(void)
{
    loaded l = load("tests/models/contact_rolling.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 2);
        if (run) {
            CHECK_NEAR(time_of(run, "friction", 1), 0.59373299851373425424, e);
            CHECK_TEXT(entry(run, "friction", 1)->text, "'floor_friction' sticks");
            CHECK_NEAR(last_q(run)[0], 5.4603360323076193901, 4 * e);
            CHECK_NEAR(last_lambda(run)[1], -0.4867110351178819, e);
            CHECK_NEAR(last_qd(run)[0] + 0.1 * last_qd(run)[2], 0, 1e-12);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* An impact within a closed loop changes all rates together, and loses the energy that Newton's law says. */
static void stopped_slider_crank(void)
{
    loaded l = load("tests/models/contact_slider_crank.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 1);
        const kmp_log_entry *first = run ? entry(run, "impact", 0) : NULL,
                            *second = run ? entry(run, "impact", 1) : NULL;
        CHECK(first && second);
        if (second) {
            CHECK_NEAR(first->t, 0.2203733629703244411726, e);
            CHECK_NEAR(first->before, 5.20439203350259605825, 10 * e);
            CHECK_NEAR(first->after, 1.301098008375649014562, 10 * e);
            CHECK_NEAR(second->t, 0.8391515889912118162059, e);
            CHECK_NEAR(second->before, 6.892313941370456898063, 100 * e);
            CHECK_NEAR(second->after, 6.892313941370456898063 / 4, 100 * e);
            CHECK(run->verdict.drift_rel < 100 * e && run->verdict.hdot_max < 10 * e);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

#define BOX(feet)                                                                                                      \
    "kempe: 1\n"                                                                                                       \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies:\n"                                                                                                        \
    "  box: {joint: {name: b, planar: z, at: ground}, mass: 1, inertia: {zz: 0.2}, points: {L: [-0.5, -0.2, 0], "      \
    "R: [0.5, -0.2, 0], M: [0.3, -0.2, 0], N: [-0.2, -0.2, 0]}}\n"                                                     \
    "contacts:\n" feet

#define FOOT(name, e, more)                                                                                            \
    "  " #name ": {point: box." #name ", on: {plane: ground.O, normal: y}, restitution: " #e more "}\n"

/* Two corners with different restitution strike at one instant. */
static void two_corners(void)
{
    loaded l = load("tests/models/contact_corners.yaml");
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 1.25);
        if (run) {
            CHECK_NEAR(time_of(run, "impact", 0), 1, ways[k].tolerance);
            CHECK(!entry(run, "impact", 1));
            CHECK_NEAR(last_qd(run)[1], 0.5, ways[k].tolerance);
            CHECK_NEAR(last_qd(run)[2], -0.6, ways[k].tolerance);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Four feet on a line, two more than the motion needs, with friction: nothing moves, and all feet push. */
static void four_feet(void)
{
    loaded l = load_text(BOX(FOOT(L, 0, ", friction: 0.5") FOOT(M, 0, ", friction: 0.5") FOOT(N, 0, ", friction: 0.5")
                                 FOOT(R, 0, ", friction: 0.5")) "gravity: [1, -9.81, 0]\nstart: {q: {b.2: 0.3}}\n");
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 1);
        if (run) {
            static const double place[4] = {-0.5, 0.3, -0.2, 0.5};
            double sum = 0, rub = 0, moment = 0;
            for (int i = 0; i < 4; i++) {
                double push = last_lambda(run)[2 * i], along = last_lambda(run)[2 * i + 1];
                CHECK(push >= 0 && fabs(along) <= 0.5 * push * (1 + 1e-9));
                sum += push;
                rub += along;
                moment += push * place[i] + along * 0.2;
            }
            CHECK_NEAR(sum, 9.81, 1e-9);
            CHECK_NEAR(rub, -1, 1e-9);
            CHECK_NEAR(moment, 0, 1e-9);
            CHECK_NEAR(last_q(run)[1], 0.2, 1e-9);
            for (int i = 0; i < 3; i++)
                CHECK_NEAR(last_qd(run)[i], 0, 1e-12);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

#define RUBS(name) FOOT(name, 0, ", friction: 0.3")
#define FEET(bodies, contacts)                                                                                         \
    "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"                                    \
    "  box: {joint: {name: b, planar: z, at: ground}, mass: 2, com: [0, 0.25, 0], inertia: {zz: 0.3}, points: {"       \
    "A: [-0.4, 0, 0], B: [0.4, 0, 0], C: [0.5, 0, 0], D: [-0.5, 0, 0], E: [0.05, 0, 0], F: [-0.05, 0, 0], "            \
    "T: [0, 0.4, 0]}}\n" bodies "contacts:\n" RUBS(A) RUBS(B) RUBS(C) RUBS(D) RUBS(E) RUBS(F) contacts

/* Six feet on a line slip, whose rows begin at `first`. The shown forces balance, friction is by the force of its foot,
 * and the motion is unique. */
static void check_feet(const char *text, int first)
{
    static const double place[6] = {-0.4, 0.4, 0.5, -0.5, 0.05, -0.05};
    loaded l = load_text(text);
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 0.1);
        double sum = 0, moment = 0;
        for (int i = 0; run && i < 6; i++) {
            const double push = last_lambda(run)[first + 2 * i], along = last_lambda(run)[first + 2 * i + 1];
            CHECK(push >= 0);
            CHECK_NEAR(along, -0.3 * push, 1e-9);
            sum += push;
            moment += push * place[i] + along * 0.25;
        }
        if (run) {
            CHECK_NEAR(sum, 2 * 9.81, 1e-9);
            CHECK_NEAR(moment, 0, 1e-9);
            CHECK_NEAR(last_qd(run)[0], 2 - 0.3 * 9.81 * 0.1, ways[k].tolerance);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Beside them a contact with friction is open, and a slide whose friction depends on its load. */
static void many_feet(void)
{
    check_feet(FEET("", RUBS(T)) "start: {qd: {b.1: 2}}\n", 0);
    check_feet(FEET("  slide: {joint: {name: s, prismatic: x, at: ground}, mass: 1}\n"
                    "forces: {rubs: {joint: s, friction: {mu: 0.2}}}\n",
                    "  far: {gap: q(s) - q(b.1) + 10, restitution: 0}\n") "start: {qd: {b.1: 2, s: 5}}\n",
               3);
}

/* A sphere strikes the floor obliquely, without weight: its tangential impulse is mu times the normal one, or what
 * stops the slip. */
static void oblique(const char *text, double along, double turn)
{
    loaded l = load_text(text);
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 0.2);
        if (run) {
            CHECK_NEAR(time_of(run, "impact", 0), 0.1, e);
            CHECK_NEAR(last_qd(run)[0], along, e);
            CHECK_NEAR(last_qd(run)[1], 1.5, e);
            CHECK_NEAR(last_qd(run)[2], turn, 10 * e);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

#define SPHERE(mu)                                                                                                     \
    "kempe: 1\n"                                                                                                       \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies: {ball: {joint: {name: b, planar: z, at: ground}, mass: 1, inertia: {zz: 0.004}, points: {C: [0, 0, "      \
    "0]}}}\n"                                                                                                          \
    "contacts: {floor: {sphere: ball.C, radius: 0.1, on: {plane: ground.O, normal: y}, restitution: 0.5, "             \
    "friction: " #mu "}}\n"                                                                                            \
    "start: {q: {b.2: 0.4}, qd: {b.1: 2, b.2: -3}}\n"

static void oblique_impacts(void)
{
    oblique(SPHERE(0.1), 2 - 0.1 * 4.5, -0.1 * 4.5 * 0.1 / 0.004);
    oblique(SPHERE(0.5), 2 - 2 / 3.5, -2 / 3.5 * 0.1 / 0.004);
}

/* A point slides on a smooth sphere, and leaves it where its force becomes zero. */
static void off_a_sphere(void)
{
    loaded l = load("tests/models/contact_sphere.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 1);
        if (run) {
            CHECK_NEAR(time_of(run, "contact", 1), 0.4113510976273412016277, 100 * e);
            CHECK_NEAR(last_q(run)[0], 1.636054344630346531234, 10 * e);
            CHECK_NEAR(last_q(run)[1], -2.25824992192749837202, 10 * e);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Distance from the parabola y = x^2/2, by its nearest point. */
static double above_parabola(double x, double y)
{
    double s = x;
    for (int k = 0; k < 50; k++)
        s -= (s - x + (s * s / 2 - y) * s) / (1 + 1.5 * s * s - y);
    return (y - s * s / 2 > 0 ? 1 : -1) * hypot(x - s, y - s * s / 2);
}

/* Spheres that come to rest against a hollow cylinder, a sphere and a profile slide on with their radius between them.
 */
static void round_surfaces(void)
{
    loaded l = load("tests/models/contact_round.yaml");
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 2.5);
        if (run) {
            const double *q = last_q(run), e = 10 * ways[k].tolerance;
            CHECK(entry(run, "contact", 1));
            CHECK_NEAR(hypot(q[0], q[1]), 0.9, e);
            CHECK(hypot(q[3], q[4]) > 1.1 - e);
            CHECK_NEAR(above_parabola(q[6], q[7]), 0.1, 1e-7);
            CHECK(run->verdict.drift_rel < 1000 * ways[k].tolerance);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* -- what is rejected ---------------------------------------------------------------------------------------- */

static void check_refused(const char *text, const char *words)
{
    loaded l = load_text(text);
    kempe_trajectory *run = NULL;
    kempe_run_options options = {.t_end = 2};
    CHECK(l.system);
    if (l.system)
        CHECK(kempe_simulate(l.system, &options, &run) == KEMPE_E_FAILED);
    if (run && !strstr(kempe_trajectory_reason(run), words))
        printf("%s\n", kempe_trajectory_reason(run));
    CHECK(run && strstr(kempe_trajectory_reason(run), words));
    kempe_trajectory_free(run);
    unload(&l);
}

static void refused_runs(void)
{
    check_refused(BALL("joint: z, lower: 1.5, restitution: 0"), "contact 'floor' overlaps by 0.5 m at the start");
    check_refused(
        BALL("joint: z, lower: 0, restitution: 0.5") "drives: {d: {joint: z, displacement: \"1 m - (1 m/s)*t\"}}\n",
        "'floor': the closures or drives press the surfaces into each other at t = 1");
}

/* The walker of the examples on rough ground: bounds of the impulses of friction that alternate, and an instant at
 * which no state of the feet agrees with Coulomb's law. Times of the reference program with this friction. */
static void rough_ground(void)
{
    static const double strikes[] = {0.0460251859854, 0.0571850491816, 0.0644651945559, 0.0664374669975};
    loaded l = load_text_as("kempe: 1\n"
                            "gravity: [0, -9.81, 0]\n"
                            "include: [{file: jansen_walker.yaml, set: {mu: 0.6}}]\n",
                            "examples/jansen_walker/rough.yaml");
    kempe_trajectory *run = NULL;
    kempe_run_options options = {.t_end = 3.3, .rtol = 1e-11, .no_convergence_check = 1};
    CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_E_FAILED);
    for (int k = 0; run && k < 4; k++)
        CHECK_NEAR(time_of(run, "impact", k), strikes[k], 1e-9);
    const char *reason = run ? kempe_trajectory_reason(run) : "";
    CHECK(strstr(reason, "'rear2_friction' can neither slip nor stick at t = 2.995705"));
    kempe_trajectory_free(run);
    unload(&l);
}

/* A wheel of eight spokes without a rim goes down a slope of 5 degrees, and its spokes do not slip: a pendulum about
 * the standing one, whose rate falls by (cos 45 deg m l^2 + I)/(m l^2 + I) at each impact (DOP853, rtol 1e-12). */
static void rimless_wheel(void)
{
    static const struct {
        int spokes;
        double inertia, friction, rate, end, th, last;
    } cases[] = {{8, 1e-3, 2, 1, 3, -2.9852506410477675, -0.694263386672768},
                 {8, 1e-6, 2, 1, 3, -2.9838094701260673, -0.6944446386229643},
                 {8, 1e-9, 2, 1, 3, -2.983808025532637, -0.6944448380007737},
                 {8, 1e-9, 0.8, 1, 3, -2.983808025532637, -0.6944448380007737},
                 {6, 1e-3, 0.8, 2, 1, -0.942927537774315, -0.19413509548246377},
                 {6, 1e-9, 0.8, 2, 1, -0.9399818813671841, -0.18454530071379857},
                 {6, 1e-9, 2, 2, 1, -0.9399818813671841, -0.18454530071379857}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const double pi = 3.14159265358979323846, slope = pi / 36;
        const int n = cases[k].spokes;
        kmp_text text = {0};
        kmp_text_printf(&text,
                        "kempe: 1\ngravity: [%.17g, %.17g, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                        "  hub: {joint: {name: P, planar: z, at: ground, coordinates: [x, y, th]}, mass: 1, "
                        "inertia: {zz: %g}, points: {",
                        9.81 * sin(slope), -9.81 * cos(slope), cases[k].inertia);
        for (int i = 0; i < n; i++)
            kmp_text_printf(&text, "%sP%d: [%.17g, %.17g, 0]", i ? ", " : "", i, sin(2 * i * pi / n),
                            -cos(2 * i * pi / n));
        kmp_text_put(&text, "}}\ncontacts:\n");
        for (int i = 0; i < n; i++)
            kmp_text_printf(&text,
                            "  c%d: {point: hub.P%d, on: {plane: ground.O, normal: y}, restitution: 0, friction: %g}\n",
                            i, i, cases[k].friction);
        kmp_text_printf(&text, "start: {q: {y: 1}, qd: {x: %g, th: %g}}\nrun: {rtol: 1e-10}\n", cases[k].rate,
                        -cases[k].rate);
        loaded l = load_text(text.s);
        kempe_trajectory *run = simulate(&l, &ways[0], cases[k].end);
        if (run) {
            CHECK_NEAR(last_q(run)[2], cases[k].th, 1e-7);
            CHECK_NEAR(last_qd(run)[2], cases[k].last, 1e-7);
        }
        kempe_trajectory_free(run);
        unload(&l);
        kmp_text_free(&text);
    }
}

/* The wheel of six spokes rocks between two feet, ever shorter, and comes to rest on both, with little inertia too. */
static void rimless_wheel_rests(void)
{
    for (int k = 0; k < 2; k++) {
        kmp_text text = {0};
        kmp_text_printf(&text,
                        "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                        "  hub: {joint: {name: P, planar: z, at: ground, coordinates: [x, y, th]}, mass: 1, "
                        "inertia: {zz: %g}, points: {",
                        k ? 1e-3 : 1e-6);
        for (int i = 0; i < 6; i++)
            kmp_text_printf(&text, "%sP%d: [%.17g, %.17g, 0]", i ? ", " : "", i, sin(i * acos(0.5)),
                            -cos(i * acos(0.5)));
        kmp_text_put(&text, "}}\ncontacts:\n");
        for (int i = 0; i < 6; i++)
            kmp_text_printf(
                &text, "  c%d: {point: hub.P%d, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.8}\n", i,
                i);
        kmp_text_put(&text, "start: {q: {y: 1}, qd: {x: 2, th: -2}}\n");
        loaded l = load_text(text.s);
        kempe_trajectory *run = simulate(&l, &ways[0], 2);
        CHECK(run && fabs(last_qd(run)[2]) < 1e-9);
        if (run) /* on two feet: the hub has the height of an equilateral triangle */
            CHECK_NEAR(last_q(run)[1], sqrt(0.75), 1e-7);
        kempe_trajectory_free(run);
        unload(&l);
        kmp_text_free(&text);
    }
}

/* A four-bar with stops on all joints, of which one is cut, falls against that of C, where the angle between coupler
 * and rocker is 1: the law of cosines gives the crank. */
static void stops_of_a_loop(void)
{
    const double square = 0.64 + 0.49 - 1.12 * cos(1), crank = acos((0.09 + 0.81 - square) / 0.54);
    static const char *const stops[] = {"{joint: C, lower: 1.0, restitution: 0}",
                                        "{gap: \"q(C) - 1\", restitution: 0}"};
    for (int k = 0; k < 10; k++) {
        const char *cut[5] = {"", "", "", "", ""};
        char text[2048];
        cut[k / 2] = ", cut: yes"; /* the last one: by choice */
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {A: [0, 0, 0], D: [0.9, 0, 0]}}\nbodies:\n"
            "  crank: {mass: 0.6, com: [0.15, 0, 0], inertia: {zz: 0.0045}, points: {A: [0, 0, 0], B: [0.3, 0, 0]}}\n"
            "  coupler: {mass: 1.6, com: [0.4, 0, 0], inertia: {zz: 0.085}, points: {B: [0, 0, 0], C: [0.8, 0, 0]}}\n"
            "  rocker: {mass: 1.4, com: [0.35, 0, 0], inertia: {zz: 0.057}, points: {D: [0, 0, 0], C: [0.7, 0, 0]}}\n"
            "joints:\n  A: {revolute: [ground.A, crank.A]%s}\n  B: {revolute: [crank.B, coupler.B]%s}\n"
            "  C: {revolute: [coupler.C, rocker.C]%s}\n  D: {revolute: [ground.D, rocker.D]%s}\n"
            "contacts:\n  a: {joint: A, upper: 170 deg, restitution: 0}\n  b: {joint: B, lower: -3, restitution: 0}\n"
            "  c: %s\n  d: {joint: D, upper: 3, restitution: 0}\n"
            "start: {q: {A: 60 deg, B: -40 deg, D: 100 deg}}\nrun: {outputs: [q, q(A)]}\n",
            cut[0], cut[1], cut[2], cut[3], stops[k % 2]);
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &ways[0], 1);
        kempe_table *rows = NULL;
        CHECK(run && kempe_trajectory_table(run, "rows", &rows) == KEMPE_OK);
        const int last = rows ? kempe_table_row_count(rows) - 1 : -1,
                  column = rows ? kempe_table_find(rows, "q.A") : -1;
        CHECK(column >= 0);
        if (column >= 0)
            CHECK_NEAR(kempe_table_number(rows, last, column), crank, 1e-7);
        kempe_table_free(rows);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

static void stop(void)
{
    bouncing(load("tests/models/contact_bounce.yaml"), 0);
}

static void point_on_plane(void)
{
    bouncing(load_text(BALL("point: ball.C, on: {plane: ground.O}, restitution: 0.8")), 0);
}

#define PUSHED_BLOCK                                                                                                   \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "bodies:\n"                                                                                                        \
    "  block: {joint: {name: x, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"                         \
    "  bob: {joint: {name: a, revolute: z, at: block.P}, mass: 2, com: [0.2, 0, 0]}\n"                                 \
    "forces: {push: {joint: x, force: 20}, rub: {joint: x, friction: {mu: 0.3}}}\n"                                    \
    "contacts: {stop: {joint: x, upper: 0.1, restitution: 0}}\n"                                                       \
    "start: {qd: {x: 1, a: -1}}\n"                                                                                     \
    "run: {outputs: [q, force(rub), force(stop)]}\n"

/* A block on a rail, pushed against its stop; a bob on it changes the load, and with it the friction of the rail. The
 * stop takes what it can, so that the friction is not at a level that falls: they part once, where both are used up. */
static void stop_before_friction(void)
{
    loaded l = load_text(PUSHED_BLOCK);
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = simulate(&l, &ways[k], 0.2), *whole = simulate(&l, &ways[k], 0.42576);
        if (run && whole) {
            double a = last_q(run)[2], ad = last_qd(run)[2]; /* x = 0.2 m (cos a), of the bob on a fixed pivot */
            double add = -9.81 / 0.2 * cos(a), wanted = 20 + 2 * 0.2 * (cos(a) * ad * ad + sin(a) * add);
            CHECK_NEAR(run->shown[0], 0, 1e-12);
            CHECK_NEAR(run->shown[1], wanted, 1e4 * e);
            CHECK_TEXT(entry(whole, "contact", 0)->text, "'stop' closes");
            CHECK_TEXT(entry(whole, "contact", 1)->text, "'stop' opens");
            if (e <= 1e-9) /* a multistep method opens it where its load is used up, with the friction holding on */
                CHECK_NEAR(time_of(whole, "contact", 1), time_of(whole, "friction", 2), 1e-12);
        }
        kempe_trajectory_free(run);
        kempe_trajectory_free(whole);
    }
    unload(&l);
}

/* The changes of modes of a run, in their order. */
static void list_modes(const kempe_trajectory *run, kmp_text *modes)
{
    for (int k = 0; k < run->log.kept; k++) {
        const kmp_log_entry *e = &run->log.entries[k];
        if (!strcmp(e->kind, "contact") || !strcmp(e->kind, "friction"))
            kmp_text_printf(modes, "%s; ", e->text);
    }
}

/* The located instant of an event, and the multipliers there, differ by roundings and by errors of steps. Modes do not:
 * where the load of the stop is used up, the friction holds the block, and the stop stays closed with it. */
static void modes_at_any_tolerance(void)
{
    static const double rtol[] = {1e-11, 2e-11, 3e-11, 7e-11, 1e-10, 3e-10, 1e-9, 2e-9, 1e-8, 1e-7};
    loaded l = load_text(PUSHED_BLOCK);
    for (int k = 0; k < WAYS && l.system; k++)
        for (size_t i = 0; i < sizeof rtol / sizeof *rtol; i++) {
            kempe_trajectory *run = NULL;
            kempe_run_options options = {.formulation = ways[k].formulation,
                                         .form = ways[k].form,
                                         .integrator = ways[k].integrator,
                                         .rtol = rtol[i],
                                         .t_end = 0.42576,
                                         .no_convergence_check = 1};
            kmp_text modes = {0};
            if (ways[k].tolerance > 1e-9 && rtol[i] > 1e-9)
                continue; /* errors of steps open it too early or late to leave */
            CHECK(kempe_simulate(l.system, &options, &run) == KEMPE_OK);
            if (run)
                list_modes(run, &modes);
            CHECK_TEXT(modes.s,
                       "'rub' slips forward; 'rub' sticks; 'stop' closes; 'rub' slips forward; 'stop' opens; ");
            kmp_text_free(&modes);
            kempe_trajectory_free(run);
        }
    unload(&l);
}

#define COLUMN(c)                                                                                                      \
    "  " c "0: {joint: {name: " c "0, prismatic: y, at: ground}, mass: 1}\n"                                           \
    "  " c "1: {joint: {name: " c "1, prismatic: y, at: ground}, mass: 1}\n"                                           \
    "  " c "2: {joint: {name: " c "2, prismatic: y, at: ground}, mass: 1}\n"
#define MEETS(c)                                                                                                       \
    "  f" c ": {gap: q(" c "0) - 0.1, restitution: 0.5}\n"                                                             \
    "  m" c ": {gap: q(" c "1) - q(" c "0) - 0.2, restitution: 0.5}\n"                                                 \
    "  t" c ": {gap: q(" c "2) - q(" c "1) - 0.2, restitution: 0.5}\n"
#define FALLS "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"

/* Two columns of three balls, one mechanism by a contact between them that never closes: an impact is of one column,
 * and each moves as by itself. */
static void columns_apart(void)
{
    loaded both = load_text(FALLS COLUMN("a") COLUMN("b") "contacts:\n" MEETS("a")
                                MEETS("b") "  far: {gap: q(a0) - q(b0) + 10, restitution: 0}\n"
                                           "start: {q: {a0: 0.12, a1: 0.34, a2: 0.56, b0: 0.15, b1: 0.38, b2: 0.6}}\n"),
           one = load_text(FALLS COLUMN("a") "contacts:\n" MEETS("a") "start: {q: {a0: 0.12, a1: 0.34, a2: 0.56}}\n");
    const kempe_run_options options = {.t_end = 1, .rtol = 1e-9, .no_convergence_check = 1};
    kempe_trajectory *run = NULL, *own = NULL;
    CHECK(both.system && kempe_simulate(both.system, &options, &run) == KEMPE_OK);
    CHECK(one.system && kempe_simulate(one.system, &options, &own) == KEMPE_OK);
    int impacts = 0;
    for (int k = 0; run && k < run->log.kept; k++) {
        const char *text = run->log.entries[k].text;
        const bool of_a = strstr(text, "a' struck at ") != NULL, of_b = strstr(text, "b' struck at ") != NULL;
        impacts += of_a || of_b;
        CHECK(!(of_a && of_b));
    }
    CHECK(impacts > 40);
    for (int r = 0; run && own && r < kempe_trajectory_row_count(own); r++)
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(kempe_trajectory_q(run, r)[i], kempe_trajectory_q(own, r)[i], 1e-13);
    kempe_trajectory_free(run);
    kempe_trajectory_free(own);
    unload(&both);
    unload(&one);
}

/* The fall of a unit mass by 1 m with a damper of 3 N s/m. */
static double fallen(double t)
{
    return 10.0 / 3 * t - 10.0 / 9 * (1 - exp(-3 * t));
}

/* A light ball rests on the ground, and a heavy ball falls, with a damper between both. At the rebound the damper lifts
 * the light ball, with 3 v > m g. No impulse connects both balls, and its contact opens all the same. */
static void opened_by_a_damper(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, -10, 0]\nbodies:\n"
                         "  a: {joint: {name: a, prismatic: y, at: ground}, mass: 1}\n"
                         "  b: {joint: {name: b, prismatic: y, at: ground}, mass: 0.2}\n"
                         "contacts:\n  fa: {gap: q(a), restitution: 1}\n  fb: {gap: q(b), restitution: 0}\n"
                         "forces:\n  da: {joint: a, force: \"-3*(qd(a) - qd(b))\"}\n"
                         "  db: {joint: b, force: \"3*(qd(a) - qd(b))\"}\n"
                         "start: {q: {a: 1}}\n");
    const kempe_run_options options = {.t_end = 0.7, .rtol = 1e-11, .no_convergence_check = 1};
    kempe_trajectory *run = NULL;
    double low = 0, high = 2;
    while (high - low > 1e-14) {
        const double middle = (low + high) / 2;
        *(fallen(middle) < 1 ? &low : &high) = middle;
    }
    CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_OK);
    kmp_text modes = {0};
    if (run)
        list_modes(run, &modes);
    CHECK_TEXT(modes.s, "'fb' closes; 'fb' opens; ");
    CHECK_NEAR(time_of(run, "impact", 0), low, 1e-9);
    CHECK(run && run->report.events == 1 && time_of(run, "contact", 1) == time_of(run, "impact", 0));
    kmp_text_free(&modes);
    kempe_trajectory_free(run);
    unload(&l);
}

/* Rounding of a singular matrix keeps the minimum from an end: the modes are tried. */
static void singular_decision(void)
{
    static const way fine = {"reduced", NULL, NULL, 1e-9, 1e-13};
    loaded l = load("tests/models/friction_five_bar.yaml");
    kempe_trajectory *run = simulate(&l, &fine, 0.6);
    CHECK(run && run->verdict.drift_rel < 1e-8);
    kempe_trajectory_free(run);
    unload(&l);
}

/* Discs in a row, far from each other: an elastic impact hands the rate on to the next one. Each may touch each other
 * one, and a wall beyond: most distances are not bounded in most steps, and none may be missed. */
static void handed_on(void)
{
    enum { DISCS = 9 };
    static const way ways_of_row[] = {{"reduced", NULL, "dop853", 1e-9, 0}, {"projected", NULL, "dopri5", 1e-9, 0}};
    FILE *file = fopen("handed_on.yaml", "w");
    CHECK(file != NULL);
    if (!file)
        return;
    fprintf(file, "kempe: 1\ngravity: [0, 0, 0]\nground: {points: {O: [0, 0, 0], W: [-11, 0, 0]}}\nbodies:\n");
    for (int i = 0; i < DISCS; i++)
        fprintf(file,
                "  s%d: {joint: {name: j%d, planar: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {C: [0, 0, "
                "0]}}\n",
                i, i);
    fprintf(file, "contacts:\n");
    for (int i = 0; i < DISCS; i++) {
        fprintf(file, "  w%d: {sphere: s%d.C, radius: 0.1, on: {plane: ground.W, normal: x}, restitution: 1}\n", i, i);
        for (int k = 0; k < i; k++)
            fprintf(file, "  c%d_%d: {sphere: s%d.C, radius: 0.1, on: {sphere: s%d.C, radius: 0.1}, restitution: 1}\n",
                    i, k, i, k);
    }
    fprintf(file, "start: {q: {");
    for (int i = 0; i < DISCS; i++)
        fprintf(file, "j%d.1: %d%s", i, i, i + 1 < DISCS ? ", " : "}, ");
    fprintf(file, "qd: {j%d.1: -4}}\n", DISCS - 1);
    fclose(file);
    loaded l = load("handed_on.yaml");
    for (int w = 0; w < 2; w++) {
        kempe_trajectory *run = simulate(&l, &ways_of_row[w], 9);
        double t = 0;
        for (int i = 0; run && i < DISCS; i++) {
            t += (i + 1 < DISCS ? 0.8 : 10.9) / 4;
            CHECK_NEAR(time_of(run, "impact", i), t, 1e-9);
        }
        CHECK(run && run->report.impacts == 2 * DISCS - 1);
        kempe_trajectory_free(run);
    }
    unload(&l);
    remove("handed_on.yaml");
}

/* A pulse drives a yoke onto a stop without restitution, where it is at rest for an instant. Its independent coordinate
 * then has no rate. The digits are those of SciPy's DOP853 on the equation of the one degree of freedom. */
static void at_rest_for_an_instant(void)
{
    loaded l = load_text("kempe: 1\n"
                         "gravity: [1.379, 0, 0]\n"
                         "bodies:\n"
                         "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.13}}\n"
                         "  s: {joint: {name: S, prismatic: x, at: ground}, mass: 0.889}\n"
                         "loops: {yoke: {constraint: \"q(S) - 0.379*sin(q(A))\"}}\n"
                         "forces:\n"
                         "  spring: {joint: A, torque: \"-27.383*q(A) - 0.379*qd(A)\"}\n"
                         "  pulse: {joint: A, torque: \"145.3*exp(-((t - 0.3344)/0.0051)^2)\"}\n"
                         "contacts: {end: {joint: A, upper: 32.43 deg, restitution: 0}}\n"
                         "start: {q: {A: 0.456, S: 0.16689657452725637}, qd: {A: -0.723}, hold: [A]}\n");
    const way adams = {"reduced", "newton", "adams", 1e-6, 0};
    for (int k = 0; k <= WAYS; k++) {
        const way *by = k < WAYS ? &ways[k] : &adams;
        kempe_trajectory *run = simulate(&l, by, 0.95);
        if (run) {
            CHECK_NEAR(time_of(run, "impact", 0), 0.47221890504419717, by->tolerance);
            CHECK(!entry(run, "impact", 1));
            CHECK_NEAR(last_q(run)[0], 0.11236527560171503, by->tolerance);
            CHECK_NEAR(last_qd(run)[0], 3.7524536992160185, 10 * by->tolerance);
            CHECK(run->report.steps < 10000);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* A block on three feet with different friction: only where it slides does its motion depend on how they share its
 * weight, in lanes, in the lane of one instance, and in separate runs. */
static void instances_with_shared_loads(void)
{
    static const char *const names[] = {"v"};
    static const double values[] = {0, 0, 3, 0, 2};
    for (int how = 0; how < 3; how++) {
        loaded l =
            load_text("kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {v: 3}\nground: {points: {O: [0, 0, 0]}}\n"
                      "bodies: {b: {joint: {name: j, planar: z, at: ground}, mass: 2, inertia: {zz: 0.1}, points: "
                      "{A: [-1, 0, 0], B: [0, 0, 0], C: [1, 0, 0]}}}\n"
                      "contacts:\n"
                      "  A: {point: b.A, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.1}\n"
                      "  B: {point: b.B, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.5}\n"
                      "  C: {point: b.C, on: {plane: ground.O, normal: y}, restitution: 0, friction: 0.1}\n"
                      "start: {qd: {j.1: v}}\nrun: {t_end: 0.2}\n");
        kempe_run_options run = {.integrator = how == 2 ? "radau" : NULL};
        kempe_values *set = NULL;
        kempe_ensemble *e = NULL;
        kempe_ensemble_result *batch = NULL;
        kempe_table *table = NULL;
        char *text = NULL;
        CHECK(l.model && kempe_values_new(l.model, 1, names, 5, values, &set) == KEMPE_OK &&
              kempe_ensemble_new(l.model, set, &e) == KEMPE_OK &&
              kempe_ensemble_run(e, &run, how == 1, &batch) == KEMPE_UNTRUSTED);
        CHECK(batch && kempe_ensemble_result_table(batch, "instances", &table) == KEMPE_OK);
        for (int k = 0; k < 5 && table; k++) {
            const bool slides = values[k] > 0;
            CHECK(kempe_ensemble_result_outcome(batch, k) ==
                  (slides ? KEMPE_OUTCOME_NOT_TRUSTWORTHY : KEMPE_OUTCOME_COMPLETE));
            CHECK_TEXT(kempe_table_word(table, k, kempe_table_find(table, "verdict")),
                       slides ? "loads not unique" : "converged");
        }
        CHECK(batch && kempe_ensemble_result_print(batch, KEMPE_TEXT, &text) == KEMPE_OK);
        CHECK(text && strstr(text, "do not trust 2 of 5 instances, the first is instance 3"));
        kempe_text_free(text);
        kempe_table_free(table);
        kempe_ensemble_result_free(batch);
        kempe_ensemble_free(e);
        kempe_values_free(set);
        unload(&l);
    }
}

int main(void)
{
    TEST(stop);
    TEST(singular_decision);
    TEST(instances_with_shared_loads);
    TEST(stop_before_friction);
    TEST(modes_at_any_tolerance);
    TEST(point_on_plane);
    TEST(rimless_wheel);
    TEST(rimless_wheel_rests);
    TEST(stops_of_a_loop);
    TEST(rolling);
    TEST(stopped_slider_crank);
    TEST(two_corners);
    TEST(four_feet);
    TEST(many_feet);
    TEST(oblique_impacts);
    TEST(off_a_sphere);
    TEST(round_surfaces);
    TEST(refused_runs);
    TEST(rough_ground);
    TEST(handed_on);
    TEST(columns_apart);
    TEST(opened_by_a_damper);
    TEST(at_rest_for_an_instant);
    return check_report();
}
