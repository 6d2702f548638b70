/* SPDX-License-Identifier: BSD-3-Clause */
/* Equilibria against closed forms and against scalar equations solved beside them: a hanging mass, pendulums from rough
 * guesses, the double four-bar's potential, the governor's heights; how fast the end converges; loads that only the
 * multipliers' stiffness tells to fall; unknowns exchanged; what is said where there is none. */
#include "analyses/equilibrium/balances.h"
#include "analyses/equilibrium/operating.h"
#include "backend/machine.h"
#include "constraints/evaluation/evaluator.h"
#include "loaded.h"
#include <complex.h>
#include <kempe/equilibrium.h>
#include <kempe/settings.h>

/* One coordinate: its value at the equilibrium, NaN when there is none. */
static double rest_of(const char *text)
{
    loaded m = load_text(text);
    kmp_operating *o = NULL;
    double q = NAN;
    if (kmp_operating_new(m.system, NULL, NULL, &o) == KEMPE_OK) {
        q = o->q[0];
        CHECK(o->equilibrium && o->residual <= 1e-10);
        CHECK(o->qd[0] == 0);
    }
    kmp_operating_free(o);
    unload(&m);
    return q;
}

static void a_hanging_mass_stretches_its_spring(void)
{
    CHECK_NEAR(rest_of("kempe: 1\ngravity: [0, 0, -9.81]\n"
                       "bodies: {a: {joint: {name: S, prismatic: z, at: ground}, mass: 3}}\n"
                       "forces: {k: {joint: S, spring: {stiffness: 2, rest: 1}}}\n"),
               1 - 3 * 9.81 / 2, 1e-14);
}

/* m g l sin q = k (q - rest): solved beside it by bisection. */
static void a_pendulum_is_found_from_anywhere(void)
{
    const char *const from[] = {"3", "3.14", "-1.5", "1.57", "0.1"};
    double low = 0, high = 1.5;
    for (int k = 0; k < 100; k++) {
        double q = (low + high) / 2;
        if (2 * 9.81 * 0.5 * sin(q) + 3 * (q - 1) < 0)
            low = q;
        else
            high = q;
    }
    for (size_t k = 0; k < sizeof from / sizeof *from; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, -9.81]\n"
                       "bodies: {a: {joint: {name: A, revolute: y, at: ground}, mass: 2, com: [0, 0, -0.5], "
                       "inertia: {yy: 0.1}}}\n"
                       "forces: {k: {joint: A, spring: {stiffness: 3, rest: 1}}}\n"
                       "start: {q: {A: %s}}\n",
                       from[k]);
        CHECK_NEAR(rest_of(text), low, 1e-14);
    }
}

static void what_nothing_holds_is_reported(void)
{
    loaded m = load_text("kempe: 1\ngravity: [0, 0, -9.81]\n"
                         "bodies: {a: {joint: {name: S, prismatic: z, at: ground}, mass: 1}}\n");
    kmp_operating *o = NULL;
    CHECK(kmp_operating_new(m.system, "equilibrium", NULL, &o) == KEMPE_E_FAILED && !o);
    CHECK(strstr(kempe_context_message(m.context), "nothing restrains 'S'"));
    CHECK(kmp_operating_new(m.system, "rest", NULL, &o) == KEMPE_E_ARGUMENT && !o);
    unload(&m);
}

/* The linear equations at the start go with the motion, at the equilibrium they stand still. */
static void a_state_to_look_from(void)
{
    loaded m = load("examples/four_bar/four_bar.yaml");
    const char *const words[] = {"start", "equilibrium"};
    for (int k = 0; k < 2; k++) {
        kmp_operating *o = NULL;
        kmp_linear l;
        CHECK(kmp_operating_new(m.system, words[k], NULL, &o) == KEMPE_OK);
        CHECK(kmp_linear_init(&l, m.system, kmp_backend_default()) == KEMPE_OK);
        CHECK(kmp_operating_take(o, &l, NULL, 0) == KEMPE_OK);
        kmp_linear_matrices(&l);
        CHECK(o->equilibrium == (k == 1));
        for (int i = 0; i < l.n; i++) {
            CHECK_NEAR(l.q[i], o->q[i], 1e-14);
            CHECK_NEAR(l.qd[i], o->qd[i], 1e-12);
            CHECK(k == 1 ? fabs(l.qdd[i]) < 1e-12 : l.qdd[i] != 0);
        }
        CHECK(k == 0 || (kmp_equilibrium_residual(&l) <= 1e-12 && l.stiffness[0] > 0));
        kmp_linear_free(&l);
        kmp_operating_free(o);
    }
    unload(&m);
}

/* A stone in thick oil has no rest, but a speed, from whichever it starts: m g = c v + d v^3. */
static void what_is_slowed_falls_steadily(void)
{
    static const char *const starts[] = {"0", "-1", "7"};
    double low = 0, high = 30;
    for (int k = 0; k < 100; k++) {
        double v = (low + high) / 2;
        if (0.5 * v + 0.01 * v * v * v < 3 * 9.81)
            low = v;
        else
            high = v;
    }
    for (size_t k = 0; k < sizeof starts / sizeof *starts; k++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {c: 0.5, d: 0.01}\n"
                       "bodies: {a: {joint: {name: S, prismatic: z, at: ground}, mass: 3}}\n"
                       "forces: {oil: {joint: S, force: \"-c*qd(S) - d*qd(S)^3\"}}\nstart: {qd: {S: %s}}\n",
                       starts[k]);
        loaded m = load_text(text);
        kempe_equilibrium *e = NULL;
        CHECK(kempe_equilibrium_new(m.system, NULL, &e) == KEMPE_OK);
        CHECK(e->freed_count == 1);
        CHECK_TEXT(e->freed_name[0], "qd(S)");
        CHECK_NEAR(e->balance[0].freed[0], -low, 1e-12);
        CHECK_NEAR(e->balance[0].qd[0], -low, 1e-12);
        CHECK(e->balance[0].q[0] == 0 && e->balance[0].residual < 1e-14);
        kempe_equilibrium_free(e);
        unload(&m);
    }
}

/* -- the double four-bar from its potential ------------------------------------------------------------ */

/* The point at which circles meet, left of the way from p to q, in complex numbers so that a small imaginary part of
 * the crank's angle carries the derivative. */
typedef struct place {
    double complex x, y;
} place;

static place circles(place p, double r, place q, double s)
{
    double complex dx = q.x - p.x, dy = q.y - p.y, square = dx * dx + dy * dy;
    double complex along = (square + r * r - s * s) / (2 * square), across = csqrt(r * r / square - along * along);
    return (place){p.x + along * dx - across * dy, p.y + along * dy + across * dx};
}

static double complex potential(double complex angle)
{
    place d = {0.8, 0}, e = {1.5, 0.05}, b = {0.35 * ccos(angle), 0.35 * csin(angle)}, c = circles(b, 0.75, d, 0.45);
    double complex x = (c.x - d.x) / 0.45, y = (c.y - d.y) / 0.45;
    place f = {d.x + 0.4 * x - 0.15 * y, d.y + 0.15 * x + 0.4 * y}, g = circles(f, 0.7, e, 0.5);
    double complex height = 0.35 * b.y + 0.75 * (b.y + c.y) + 1.2 * (0.28 * y + 0.05 * x) + 0.7 * (f.y + g.y) +
                            0.5 * (g.y + e.y) + 1.5 * g.y;
    double complex sx = g.x - 1.7, sy = g.y - 0.9, stretch = csqrt(sx * sx + sy * sy) - 0.6;
    return 9.81 * height + 30 * stretch * stretch;
}

static double slope(double angle)
{
    return cimag(potential(angle + 1e-30 * I)) / 1e-30;
}

/* The zero of the slope in between. */
static double stationary(double low, double high)
{
    double at_low = slope(low);
    for (int k = 0; k < 100; k++) {
        double middle = (low + high) / 2;
        if (slope(middle) * at_low > 0)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static bool has_crank_at(const kempe_equilibrium *e, double angle, int stable)
{
    for (int k = 0; k < kempe_equilibrium_count(e); k++) {
        const double *q = e->balance[k].q;
        if (fabs(remainder(q[0] - angle, 2 * M_PI)) < 1e-11 && kempe_equilibrium_is_stable(e, k) == stable)
            return true;
    }
    return false;
}

static void a_double_four_bar_against_its_potential(void)
{
    loaded m = load("examples/double_four_bar/double_four_bar.yaml");
    double low = stationary(3.9, 4.2), high = stationary(0.9, 1.2);
    kempe_equilibrium *e = NULL;
    CHECK(kempe_equilibrium_new(m.system, NULL, &e) == KEMPE_OK);
    CHECK_NEAR(e->balance[0].q[0], low, 1e-14);
    CHECK(kempe_equilibrium_is_stable(e, 0) == 1 && e->balance[0].residual < 1e-14);
    kempe_equilibrium_free(e);
    e = NULL;
    CHECK(kempe_equilibrium_new(m.system, &(kempe_equilibrium_options){.global = 1, .seed = 3}, &e) == KEMPE_OK);
    CHECK(has_crank_at(e, low, 1) && has_crank_at(e, high, 0));
    CHECK(kempe_equilibrium_count(e) >= 6);
    kempe_table *table = NULL;
    CHECK(kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    CHECK(kempe_table_row_count(table) == e->count &&
          kempe_table_number(table, 5, kempe_table_find(table, "hits")) > 0);
    CHECK_TEXT(kempe_table_word(table, 0, kempe_table_find(table, "stability")), kempe_equilibrium_stability(e, 0));
    kempe_table_free(table);
    CHECK(kempe_equilibrium_table(e, "history", &table) == KEMPE_OK);
    CHECK(kempe_table_number(table, e->balance[0].iterations - 1, 2) < 1e-10);
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    unload(&m);
}

/* The run begins at 80 degrees; a damper at the crank ends it. */
static void a_damped_run_comes_to_rest_there(void)
{
    loaded m = load("examples/double_four_bar/double_four_bar.yaml");
    kempe_equilibrium *e = NULL;
    kempe_trajectory *t = NULL;
    kempe_run_options run = {0};
    run.no_convergence_check = 1;
    CHECK(kempe_equilibrium_new(m.system, NULL, &e) == KEMPE_OK);
    CHECK(kempe_simulate(m.system, &run, &t) == KEMPE_OK);
    const double *q = kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1);
    const double *lambda = kempe_trajectory_lambda(t, kempe_trajectory_row_count(t) - 1);
    for (int k = 0; k < m.system->n; k++)
        CHECK_NEAR(q[k], e->balance[0].q[k], 1e-10);
    for (int k = 0; k < m.system->m; k++)
        CHECK_NEAR(lambda[k], e->balance[0].lambda[k], 1e-8);
    kempe_trajectory_free(t);
    kempe_equilibrium_free(e);
    unload(&m);
}

/* -- the governor (A05) -------------------------------------------------------------------------------- */

/* Square of the speed at which the arms stand by `fall` below the horizontal, and the slider's height then: a rod of
 * 0.3 kg with 5 kg at its end, hinged 0.05 m off the axis at 1 m, a spring of 8e5 N/m and 0.5 m from its middle to the
 * slider of 3 kg. The spring carries half the slider; the moments about the hinge balance. */
static double governor(double fall, double *height)
{
    double m = 0.3, tip = 5, b = 0.05, g = 9.81, w = 0.01, stiffness = 8e5, c = cos(fall), s = sin(fall);
    double low = 0, high = 1; /* how far the slider hangs below the middle of the rod */
    for (int k = 0; k < 100; k++) {
        double down = (low + high) / 2, length = hypot(0.5 * c, down);
        if (2 * stiffness * (length - 0.5) * down / length < 3 * g)
            low = down;
        else
            high = down;
    }
    double length = hypot(0.5 * c, low), tension = stiffness * (length - 0.5);
    *height = 1 - 0.5 * s - low;
    double weight = -(m / 2 + tip) * g * c;
    double pull = tension * (-0.25 * c * s - 0.5 * c * low) / length; /* dlength/dfall */
    double spread = m * (-b * s - 2.0 / 3 * c * s) + m * w * w / 6 * s * c - 2 * tip * (b + c) * s;
    return 2 * (weight + pull) / spread;
}

static void a_governor_stands_at_its_height(void)
{
    loaded m = load("examples/governor/governor.yaml");
    const double speeds[] = {4.5, 5.5, 2 * M_PI, 9};
    for (int k = 0; k < 4; k++) {
        double low = 0.01, high = 1.5, height;
        char rates[64];
        kempe_equilibrium *e = NULL;
        for (int i = 0; i < 100; i++) {
            double fall = (low + high) / 2;
            if (governor(fall, &height) > speeds[k] * speeds[k])
                low = fall;
            else
                high = fall;
        }
        (void)snprintf(rates, sizeof rates, "shaft=%.17g", speeds[k]);
        CHECK(kempe_equilibrium_new(m.system, &(kempe_equilibrium_options){.rates = rates}, &e) == KEMPE_OK);
        const double *q = e->balance[0].q;
        CHECK_NEAR(q[1], height, 1e-11);
        CHECK_NEAR(q[2], low, 1e-11);
        CHECK_NEAR(q[3], low, 1e-11);
        CHECK(e->balance[0].qd[0] == speeds[k] && kempe_equilibrium_is_stable(e, 0) == 1);
        CHECK_TEXT(kempe_equilibrium_stability(e, 0), "neutral"); /* along the shaft */
        kempe_equilibrium_free(e);
    }
    unload(&m);
}

/* The others look from a steady motion as well. */
static void a_steady_motion_to_look_from(void)
{
    loaded m = load("examples/governor/governor.yaml");
    kmp_operating *o = NULL;
    kmp_linear l;
    double height, square = governor(0.5, &height);
    char word[64];
    (void)snprintf(word, sizeof word, "equilibrium shaft=%.17g", sqrt(square));
    CHECK(kmp_operating_new(m.system, word, NULL, &o) == KEMPE_OK);
    CHECK_NEAR(o->q[2], 0.5, 1e-11);
    CHECK(kmp_linear_init(&l, m.system, "tape") == KEMPE_OK);
    CHECK(kmp_operating_take(o, &l, NULL, 0) == KEMPE_OK);
    kmp_linear_matrices(&l);
    CHECK(kmp_equilibrium_residual(&l) < 1e-13 && l.qd[0] == o->qd[0] && fabs(l.qd[0] - sqrt(square)) < 1e-15);
    kmp_linear_free(&l);
    kmp_operating_free(o);
    o = NULL;
    CHECK(kmp_operating_new(m.system, "equilibrium slider=1", NULL, &o) == KEMPE_E_FAILED && !o);
    CHECK(kmp_operating_new(m.system, "equilibrium slide=1", NULL, &o) == KEMPE_E_ARGUMENT && !o);
    CHECK(kmp_operating_new(m.system, "equilibria", NULL, &o) == KEMPE_E_ARGUMENT && !o);
    unload(&m);
}

/* The speed for a height, from both sides. */
static void a_speed_is_found_for_a_height(void)
{
    loaded m = load("examples/governor/governor.yaml");
    const double falls[] = {0.2, 0.5, 0.9};
    for (int k = 0; k < 3; k++) {
        double height, speed = sqrt(governor(falls[k], &height));
        char fix[64];
        kempe_equilibrium *e = NULL;
        (void)snprintf(fix, sizeof fix, "slider=%.17g", height);
        kempe_equilibrium_options options = {.rates = "shaft=5", .hold = fix, .solve_for = "qd(shaft)"};
        CHECK(kempe_equilibrium_new(m.system, &options, &e) == KEMPE_OK);
        if (e) {
            CHECK(e->freed_count == 1);
            CHECK_TEXT(e->freed_name[0], "qd(shaft)");
            CHECK_NEAR(fabs(e->balance[0].freed[0]), speed, 1e-9);
            CHECK_NEAR(e->balance[0].q[2], falls[k], 1e-11);
        }
        kempe_equilibrium_free(e);
    }
    unload(&m);
}

/* -- geometric stiffness ------------------------------------------------------------------------------- */

/* A mass of 2 kg at the end of a rod of 0.5 m, above or below its hinge, with a weak spring across. All of gravity's
 * stiffness comes from the rod's multiplier: without it both would be stable, by the spring. */
static const char on_a_rod[] = "kempe: 1\ngravity: [0, 0, -9.81]\n"
                               "ground: {points: {O: [0, 0, 0]}}\n"
                               "bodies:\n"
                               "  a: {joint: {name: x, prismatic: x, at: ground}, mass: 0.5}\n"
                               "  b: {joint: {name: z, prismatic: z, at: a}, mass: 1.5, points: {P: [0, 0, 0]}}\n"
                               "loops: {r: {rod: [ground.O, b.P], length: 0.5}}\n"
                               "forces: {k: {joint: x, spring: {stiffness: 3}}}\n"
                               "start: {q: {x: 0, z: %s}}\n";

/* The largest real and the imaginary part there of the eigenvalues. */
static void eigenvalue(kempe_system *system, double *re, double *im)
{
    kmp_operating *o = NULL;
    kmp_linear l;
    int along[4];
    kmp_stability s = {.along = along};
    CHECK(kmp_operating_new(system, NULL, NULL, &o) == KEMPE_OK);
    CHECK(kmp_linear_init(&l, system, "tape") == KEMPE_OK);
    CHECK(kmp_operating_take(o, &l, NULL, 0) == KEMPE_OK);
    kmp_linear_matrices(&l);
    CHECK(kmp_stability_judge(&l, &s) == KEMPE_OK);
    *re = s.re;
    *im = fabs(s.im);
    kmp_linear_free(&l);
    kmp_operating_free(o);
}

static void a_load_on_a_rod_falls(void)
{
    char text[1024];
    double re, im, g = 1.5 * 9.81 / 0.5; /* the rod carries b; a hangs on it sideways alone */
    (void)snprintf(text, sizeof text, on_a_rod, "0.5");
    loaded up = load_text(text);
    kempe_equilibrium *e = NULL;
    CHECK(kempe_equilibrium_new(up.system, NULL, &e) == KEMPE_OK);
    CHECK(kempe_equilibrium_is_stable(e, 0) == 0);
    kempe_equilibrium_free(e);
    eigenvalue(up.system, &re, &im);
    CHECK_NEAR(re, sqrt((g - 3) / 2), 1e-12);
    unload(&up);
    (void)snprintf(text, sizeof text, on_a_rod, "-0.5");
    loaded down = load_text(text);
    eigenvalue(down.system, &re, &im);
    CHECK(fabs(re) < 1e-12);
    CHECK_NEAR(im, sqrt((g + 3) / 2), 1e-12);
    unload(&down);
}

/* A platform of 4 kg on two upright rods of 0.8 m, held sideways by a spring: it buckles below W / l. */
static void a_loaded_parallelogram_buckles(void)
{
    static const char text[] =
        "kempe: 1\nparameters: {k: 40}\ngravity: [0, 0, -9.81]\n"
        "ground: {points: {O: [0, 0, 0], D: [1, 0, 0]}}\n"
        "bodies:\n"
        "  p: {joint: {planar: y, at: ground, coordinates: [z, x, turn]}, mass: 4, "
        "com: [0.5, 0, 0], inertia: {yy: 0.3}, points: {A: [0, 0, 0], B: [1, 0, 0]}}\n"
        "loops: {r: {rod: [ground.O, p.A], length: 0.8}, s: {rod: [ground.D, p.B], length: 0.8}}\n"
        "forces: {k: {joint: x, spring: {stiffness: k}}}\nstart: {q: {z: 0.8}}\n";
    const char *const stiffness[] = {"48", "50"};
    for (int k = 0; k < 2; k++) {
        kempe_context *context = kempe_context_new();
        kempe_model *m = NULL;
        kempe_system *s = NULL;
        kempe_equilibrium *e = NULL;
        kempe_setting set = {"k", stiffness[k]};
        CHECK(kempe_model_read_text_set(context, text, "buckling", &set, 1, &m) == KEMPE_OK);
        if (!m)
            printf("%s\n", kempe_context_message(context));
        CHECK(kempe_system_new(m, &s) == KEMPE_OK);
        CHECK(kempe_equilibrium_new(s, NULL, &e) == KEMPE_OK);
        CHECK(kempe_equilibrium_is_stable(e, 0) == k); /* W / l = 49.05 */
        kempe_equilibrium_free(e);
        kempe_system_free(s);
        kempe_model_free(m);
        kempe_context_free(context);
    }
}

/* -- convergence --------------------------------------------------------------------------------------- */

/* The exponent between the last three residuals above rounding; NaN where there are none in Newton's reach. */
static double exponent(const kempe_equilibrium *e)
{
    const double *r = e->balance[0].residuals;
    int k = e->balance[0].iterations - 1;
    while (k > 0 && r[k] < 1e-14)
        k--;
    return k < 2 ? NAN : log(r[k] / r[k - 1]) / log(r[k - 1] / r[k - 2]);
}

static void convergence_is_quadratic(void)
{
    const char *const models[] = {"four_bar",       "andrews",      "double_four_bar",
                                  "parallel_robot", "slider_crank", "stephenson"};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        char path[128];
        (void)snprintf(path, sizeof path, "examples/%s/%s.yaml", models[k], models[k]);
        loaded m = load(path);
        kempe_equilibrium *e = NULL;
        CHECK(kempe_equilibrium_new(m.system, NULL, &e) == KEMPE_OK);
        CHECK(exponent(e) > 1.8);
        printf("   %-16s exponent %.2f\n", models[k], exponent(e));
        kempe_equilibrium_free(e);
        unload(&m);
    }
}

/* -- rough guesses ------------------------------------------------------------------------------------- */

/* All examples that something holds, from the starts of their runs. */
static void examples_settle(void)
{
    static const char *const models[] = {"andrews/andrews",
                                         "bricard/bricard",
                                         "car_axis/car_axis",
                                         "double_four_bar/double_four_bar",
                                         "four_bar/four_bar",
                                         "four_bar/four_bar_ill",
                                         "four_bar/four_bar_spatial",
                                         "governor/governor",
                                         "parallel_robot/parallel_robot",
                                         "parallel_robot/parallel_robot_spatial",
                                         "slider_crank/slider_crank",
                                         "slider_crank_spatial/slider_crank_spatial",
                                         "stephenson/stephenson",
                                         "stewart/stewart",
                                         "suspension/suspension_corner",
                                         "suspension/suspension"};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        char path[128];
        (void)snprintf(path, sizeof path, "examples/%s.yaml", models[k]);
        loaded m = load(path);
        kempe_equilibrium *e = NULL;
        CHECK(kempe_equilibrium_new(m.system, NULL, &e) == KEMPE_OK);
        bool good = e && e->balance[0].residual < 1e-12 && kempe_equilibrium_is_stable(e, 0) == 1;
        CHECK(good);
        if (!good)
            printf("   %s: %s\n", models[k], e ? kempe_equilibrium_stability(e, 0) : kempe_context_message(m.context));
        kempe_equilibrium_free(e);
        unload(&m);
    }
}

/* Rows that were dropped as redundant close too: a long step on the others may lead to another branch of theirs, on
 * which the mechanism is none. */
static void every_row_is_closed_at_the_end(void)
{
    static const char *const models[] = {"exact_bennett", "exact_sarrus", "bennett_balls"};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        char path[128];
        (void)snprintf(path, sizeof path, "tests/models/%s.yaml", models[k]);
        loaded m = load(path);
        kempe_equilibrium *e = NULL;
        kmp_evaluator *eval = kmp_eval_new(m.system, "tape");
        CHECK(kempe_equilibrium_new(m.system, NULL, &e) == KEMPE_OK);
        CHECK(eval && e->balance[0].residual < 1e-10);
        kmp_eval_closure(eval, 0, e->balance[0].q);
        for (int r = 0; r < eval->m; r++)
            CHECK(kmp_eval_opening(eval, r) < 1e-9);
        kmp_eval_free(eval);
        kempe_equilibrium_free(e);
        unload(&m);
    }
}

/* A hinge on stiff springs makes every residual small; it ends where the hinge does, but for what they yield. */
static void stiff_springs_do_not_hide_the_rest(void)
{
    loaded stiff = load("tests/models/four_bar_bushing.yaml"), hinge = load("examples/four_bar/four_bar.yaml");
    kempe_equilibrium *e = NULL, *f = NULL;
    CHECK(kempe_equilibrium_new(stiff.system, NULL, &e) == KEMPE_OK);
    CHECK(kempe_equilibrium_new(hinge.system, NULL, &f) == KEMPE_OK);
    CHECK_NEAR(e->balance[0].q[0], f->balance[0].q[0], 1e-5);
    CHECK(e->balance[0].residual < 1e-14 && kempe_equilibrium_is_stable(e, 0) == 1);
    kempe_equilibrium_free(e);
    kempe_equilibrium_free(f);
    unload(&stiff);
    unload(&hinge);
}

/* Newton's method alone goes elsewhere from the same starts. */
static void downhill_leads_where_newton_does_not(void)
{
    loaded m = load("examples/four_bar/four_bar.yaml");
    kempe_equilibrium *down = NULL, *nearest = NULL;
    CHECK(kempe_equilibrium_new(m.system, NULL, &down) == KEMPE_OK);
    CHECK(kempe_equilibrium_new(m.system, &(kempe_equilibrium_options){.newton = 1}, &nearest) != KEMPE_OK ||
          kempe_equilibrium_is_stable(nearest, 0) == 0);
    CHECK(kempe_equilibrium_is_stable(down, 0) == 1);
    kempe_equilibrium_free(down);
    kempe_equilibrium_free(nearest);
    unload(&m);
}

/* A force that is nearly constant but next to the equilibrium: Newton's steps go far beyond it. */
static void steps_beyond_are_taken_back(void)
{
    CHECK_NEAR(rest_of("kempe: 1\nparameters: {F: 1 N, s: 5 mm}\n"
                       "bodies: {a: {joint: {name: S, prismatic: z, at: ground}, mass: 3}}\n"
                       "forces: {k: {joint: S, force: \"-F*atan((q(S) - 0.15)/s)\"}}\nstart: {q: {S: 4}}\n"),
               0.15, 1e-12);
}

/* A spherical pendulum whose angles are singular where it hangs. */
static void a_spherical_pendulum_hangs(void)
{
    loaded m = load_text("kempe: 1\ngravity: [9.81, 0, 0]\n"
                         "bodies: {a: {joint: {name: S, spherical: x, at: ground}, mass: 1, com: [0, 0, 0.4], "
                         "inertia: {xx: 0.1, yy: 0.1, zz: 0.02}, points: {P: [0, 0, 1]}}}\n"
                         "start: {q: {S.1: 0.3, S.2: 0.2}}\n"
                         "run: {t_end: 1, outputs: [position(a.P)]}\n");
    kempe_equilibrium *e = NULL;
    CHECK(kempe_equilibrium_new(m.system, NULL, &e) == KEMPE_OK);
    if (e) {
        kmp_evaluator *eval = kmp_eval_new(m.system, "tape");
        kmp_eval_closure(eval, 0, e->balance[0].q);
        const double rest[3] = {0}, *p = kmp_eval_shown(eval, 0, e->balance[0].q, rest, rest, NULL);
        CHECK_NEAR(p[0], 1, 1e-14);
        CHECK(fabs(p[1]) < 1e-10 && fabs(p[2]) < 1e-10);
        CHECK_TEXT(kempe_equilibrium_stability(e, 0), "neutral"); /* about its own axis */
        kmp_eval_free(eval);
    }
    kempe_equilibrium_free(e);
    unload(&m);
}

/* -- exchanged ----------------------------------------------------------------------------------------- */

/* A length of the second loop for a position of the lever: with it put into the model, the model stands there. */
static void a_length_of_a_loop_is_found(void)
{
    loaded m = load("examples/double_four_bar/double_four_bar.yaml");
    kempe_equilibrium *e = NULL, *again = NULL;
    kempe_equilibrium_options options = {.target = "position(lever.G).y=0.30", .solve_for = "rod"};
    CHECK(kempe_equilibrium_new(m.system, &options, &e) == KEMPE_OK);
    if (!e)
        printf("%s\n", kempe_context_message(m.context));
    if (e) {
        char value[64];
        kempe_model *changed = NULL;
        kempe_system *system = NULL;
        (void)snprintf(value, sizeof value, "%.17g", e->balance[0].freed[0]);
        kempe_setting set = {"rod", value};
        CHECK(kempe_model_read_set(m.context, KEMPE_ROOT "/examples/double_four_bar/double_four_bar.yaml", &set, 1,
                                   &changed) == KEMPE_OK);
        CHECK(kempe_system_new(changed, &system) == KEMPE_OK);
        CHECK(kempe_equilibrium_new(system, NULL, &again) == KEMPE_OK);
        for (int k = 0; k < 5; k++)
            CHECK_NEAR(again->balance[0].q[k], e->balance[0].q[k], 1e-10);
        CHECK_NEAR(0.05 + 0.5 * sin(again->balance[0].q[4]), 0.30, 1e-11);
        CHECK(fabs(e->balance[0].freed[0] - 0.7) > 1e-3);
        kempe_equilibrium_free(again);
        kempe_system_free(system);
        kempe_model_free(changed);
    }
    kempe_equilibrium_free(e);
    unload(&m);
}

/* A shaft that friction holds back, turned at a rate: its motor is what friction takes. */
static void a_motor_is_found_for_a_rate(void)
{
    loaded m = load_text("kempe: 1\nparameters: {motor: 0}\n"
                         "bodies: {a: {joint: {name: A, revolute: z, at: ground}, inertia: {zz: 1}}}\n"
                         "forces: {m: {joint: A, torque: motor}, f: {joint: A, friction: {torque: 3, speed: 0.5}}}\n");
    kempe_equilibrium *e = NULL;
    kempe_equilibrium_options options = {.rates = "A=2", .solve_for = "motor"};
    CHECK(kempe_equilibrium_new(m.system, &options, &e) == KEMPE_OK);
    if (e) {
        CHECK_NEAR(e->balance[0].freed[0], 3 * 2 / sqrt(4.25), 1e-13);
        CHECK(kempe_equilibrium_is_stable(e, 0) == 1);
    } else {
        printf("%s\n", kempe_context_message(m.context));
    }
    kempe_equilibrium_free(e);
    unload(&m);
}

/* The moment of a spring, a sensor that the parameter is in itself: k q = 6 where 2 g sin q = k q. */
static void a_sensor_that_knows_the_parameter(void)
{
    loaded m = load_text("kempe: 1\nparameters: {k: 5}\ngravity: [0, 0, -9.81]\n"
                         "bodies: {a: {joint: {name: A, revolute: y, at: ground}, mass: 2, com: [0, 0, 1], "
                         "inertia: {yy: 0.1}}}\n"
                         "forces: {s: {joint: A, spring: {stiffness: k, rest: 0}}}\n"
                         "sensors: {moment: k*q(A)}\nstart: {q: {A: 1}}\n");
    kempe_equilibrium *e = NULL;
    kempe_equilibrium_options options = {.target = "sensor(moment)=6", .solve_for = "k"};
    CHECK(kempe_equilibrium_new(m.system, &options, &e) == KEMPE_OK);
    if (e) {
        double q = e->balance[0].q[0];
        CHECK_NEAR(fabs(2 * 9.81 * sin(q)), 6, 1e-12);
        CHECK_NEAR(e->balance[0].freed[0] * q, 6, 1e-12);
        CHECK(exponent(e) > 1.8);
    } else {
        printf("%s\n", kempe_context_message(m.context));
    }
    kempe_equilibrium_free(e);
    unload(&m);
}

/* -- none, and mistakes -------------------------------------------------------------------------------- */

static void expect(kempe_system *system, const kempe_equilibrium_options *options, kempe_status status,
                   const char *words)
{
    kempe_equilibrium *e = NULL;
    CHECK(kempe_equilibrium_new(system, options, &e) == status && !e);
    const char *said = kempe_context_message(system->context);
    if (!strstr(said, words))
        printf("   expected '%s', said '%s'\n", words, said);
    CHECK(strstr(said, words));
    kempe_equilibrium_free(e);
}

static void who_pulls_is_reported(void)
{
    loaded m = load_text("kempe: 1\nparameters: {T: 20, w: 5}\ngravity: [0, 0, -9.81]\n"
                         "bodies:\n"
                         "  a: {joint: {name: A, revolute: y, at: ground}, mass: 2, com: [0, 0, -0.5]}\n"
                         "  s: {joint: {name: S, prismatic: z, at: ground}, mass: 3}\n"
                         "forces: {motor: {joint: A, torque: T}, hold: {joint: S, force: 4}, "
                         "weak: {joint: S, force: 0.5*w}}\n");
    expect(m.system, NULL, KEMPE_E_FAILED, "nothing restrains 'S'");
    expect(m.system, NULL, KEMPE_E_FAILED, "gravity -29.43 N, 'hold' 4 N, 'weak' 2.5 N, together -22.93 N");
    expect(m.system, &(kempe_equilibrium_options){.hold = "S=0", .solve_for = "w"}, KEMPE_E_FAILED, "'A'");
    unload(&m);
}

static void mistakes_are_reported(void)
{
    loaded m = load("examples/governor/governor.yaml");
    kempe_equilibrium_options options = {.rates = "shat=3"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "rates: unknown coordinate 'shat'; did you mean 'shaft'?");
    options = (kempe_equilibrium_options){.rates = "shaft=3:4"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "rates: 'shaft' takes one value, not a range");
    options = (kempe_equilibrium_options){.rates = "shaft=3,shaft=4"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "rates: 'shaft' is given twice");
    options = (kempe_equilibrium_options){.rates = "slider=1"};
    expect(m.system, &options, KEMPE_E_FAILED,
           "no steady motion: the forces change along 'slider', which moves at 1 m/s");
    loaded cubic = load_text("kempe: 1\nparameters: {F: 1 N, s: 1 m}\n"
                             "bodies: {a: {joint: {name: S, prismatic: z, at: ground}, mass: 3}}\n"
                             "forces: {k: {joint: S, force: \"-F*(q(S)/s)^3\"}}\n");
    options = (kempe_equilibrium_options){.rates = "S=1"}; /* here to first order nothing depends on it */
    expect(cubic.system, &options, KEMPE_E_FAILED,
           "no steady motion: the forces change along 'S', which moves at 1 m/s");
    kmp_operating *o = NULL; /* nor is it one to look from */
    CHECK(kmp_operating_new(cubic.system, "equilibrium S=1", NULL, &o) == KEMPE_E_FAILED && !o);
    unload(&cubic);
    options = (kempe_equilibrium_options){.solve_for = "qd(shaft)", .hold = "slider=0.5"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "give it (--rates shaft=..)");
    options = (kempe_equilibrium_options){.rates = "shaft=5", .solve_for = "K,M,m", .hold = "slider=0.5"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "3 additional unknowns, but 2 additional equations");
    options = (kempe_equilibrium_options){.solve_for = "KK", .hold = "slider=0.5"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "KK");
    options = (kempe_equilibrium_options){.solve_for = "K", .target = "position(right.middle)=1"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "'position(right.middle)' has 3 components: name one");
    options = (kempe_equilibrium_options){.solve_for = "K", .target = "q(slider)=1"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "hold coordinates by --hold");
    options = (kempe_equilibrium_options){.solve_for = "K", .target = "position(right.end).x=1"};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "end");
    options = (kempe_equilibrium_options){.solve_for = "K", .hold = "slider=0.5", .global = 1};
    expect(m.system, &options, KEMPE_E_ARGUMENT, "--global cannot be combined");
    options = (kempe_equilibrium_options){.rates = "shaft=5", .solve_for = "c", .hold = "slider=0.6"};
    expect(m.system, &options, KEMPE_E_FAILED, "no equilibrium is found: after");
    unload(&m);
}

int main(void)
{
    TEST(a_hanging_mass_stretches_its_spring);
    TEST(a_pendulum_is_found_from_anywhere);
    TEST(what_nothing_holds_is_reported);
    TEST(what_is_slowed_falls_steadily);
    TEST(a_state_to_look_from);
    TEST(a_double_four_bar_against_its_potential);
    TEST(a_damped_run_comes_to_rest_there);
    TEST(a_governor_stands_at_its_height);
    TEST(a_steady_motion_to_look_from);
    TEST(a_speed_is_found_for_a_height);
    TEST(a_load_on_a_rod_falls);
    TEST(a_loaded_parallelogram_buckles);
    TEST(convergence_is_quadratic);
    TEST(examples_settle);
    TEST(every_row_is_closed_at_the_end);
    TEST(stiff_springs_do_not_hide_the_rest);
    TEST(downhill_leads_where_newton_does_not);
    TEST(steps_beyond_are_taken_back);
    TEST(a_spherical_pendulum_hangs);
    TEST(a_length_of_a_loop_is_found);
    TEST(a_motor_is_found_for_a_rate);
    TEST(a_sensor_that_knows_the_parameter);
    TEST(who_pulls_is_reported);
    TEST(mistakes_are_reported);
    return check_report();
}
