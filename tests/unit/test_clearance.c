/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints with clearance beyond the compliant journal: a rigid journal against the digits of
 * examples/loose_pin/reference_loose_pin.py, sliders in guides against closed forms, a ball in its socket against the
 * closed form of an elastic impact. That of examples/loose_slider has equations of its own. */
#include "model/data/body.h"
#include "ways.h"
#include <kempe/check.h>
#include <kempe/sensitivity.h>
#include <kempe/table.h>
#include <math.h>
#include <stdlib.h>

static const way precise[] = {{"reduced", NULL, "dop853", 1e-9, 1e-14}, {"projected", NULL, "dop853", 1e-9, 1e-14}};

/* -- rigid journals --------------------------------------------------------------------------------------- */

/* Time and rate of an impact; rate 0: a sliding journal leaves. */
typedef struct impact {
    double t, rate;
} impact;

static const impact rebounds[] = {
    {0.00022728603203979, 4.38578314528}, {0.00060095269456266, 3.03511717704}, {0.00070371236213869, 2.88563480406},
    {0.00095167513884802, 1.36469396245}, {0.0011068647774629, 1.83396554582},  {0.001169376872725, 1.71683712483},
    {0.0012410863925808, 1.48141059037},  {0.0013793036653466, 1.01005244496},  {0.0016195552931149, 1.06404062795},
    {0.0017264201263325, 1.02317343433},  {0.0017875260246018, 0.893523123088}, {0.0018396835949129, 0.74971737039}};
static const impact slides[] = {{0.00022728603203979, 4.38578314528},
                                {0.0033986120938193, 0},
                                {0.0035866243961908, 0.15599102917},
                                {0.0083598038237808, 0},
                                {0.0084499674213406, 0.0178184948464}};

/* Impacts and openings of the log, in order; further ones may follow. */
static void check_impacts(const kempe_trajectory *run, int count, const impact *expected, double tolerance)
{
    int found = 0;
    for (int k = 0; k < run->log.kept && found < count; k++) {
        const kmp_log_entry *entry = &run->log.entries[k];
        bool strikes = strcmp(entry->kind, "impact") == 0;
        if (!strikes && !strstr(entry->text, "opens"))
            continue;
        const char *at = strstr(entry->text, " at ");
        CHECK_NEAR(entry->t, expected[found].t, tolerance * expected[found].t);
        CHECK(strikes == (expected[found].rate > 0));
        if (strikes && at)
            CHECK_NEAR(atof(at + 4), expected[found].rate, 1e-3 * expected[found].rate); /* four digits are printed */
        found++;
    }
    CHECK(found == count);
}

static loaded slider_crank(const char *form, double restitution)
{
    static const char loop[] =
        "kempe: 1\n"
        "parameters: {w: 523.598775598298873}\n"
        "bodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 0.3, inertia: {zz: 1e-4}, points: {B: [0.05, 0, "
        "0]}}\n"
        "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 0.21, com: [0.06, 0, 0], inertia: {zz: 2.5e-4}, "
        "points: {P: [0.12, 0, 0]}}\n"
        "  slider: {joint: {name: S, prismatic: x, at: ground}, mass: 0.14, points: {P: [0, 0, 0]}}\n"
        "drives: {motor: {joint: A, angle: w*t}}\n"
        "loops: {pin: {revolute: [slider.P, rod.P], clearance: 0.5 mm, contact: {restitution: %g}}}\n"
        "start: {q: {S: 0.17}, qd: {A: w, B: -17/12*w}}\n"
        "run: {outputs: [q, force(pin_journal)]}\n";
    static const char tree[] =
        "kempe: 1\n"
        "parameters: {w: 523.598775598298873}\n"
        "bodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 0.3, inertia: {zz: 1e-4}, points: {B: [0.05, 0, "
        "0]}}\n"
        "  slider: {joint: {name: S, prismatic: x, at: ground}, mass: 0.14}\n"
        "  rod: {joint: {name: pin, revolute: z, at: slider, clearance: 0.5 mm, contact: {restitution: %g}}, mass: "
        "0.21, com: [-0.06, 0, 0], inertia: {zz: 2.5e-4}, points: {B: [-0.12, 0, 0]}}\n"
        "drives: {motor: {joint: A, angle: w*t}}\n"
        "loops: {B: {ball: [crank.B, rod.B]}}\n"
        "start: {q: {S: 0.17}, qd: {A: w, pin: -5/12*w}}\n"
        "run: {outputs: [q, force(pin_journal)]}\n";
    char text[2000];
    (void)snprintf(text, sizeof text, strcmp(form, "loop") == 0 ? loop : tree, restitution);
    return load_text(text);
}

/* Errors grow from impact to impact; the last of twelve is right to 1e-8, one in five with sliding pieces to 1e-9. */
static void rigid_pin(void)
{
    static const char *const forms[] = {"loop", "tree"};
    for (int k = 0; k < 4; k++) {
        loaded l = slider_crank(forms[k / 2], 0.9), sliding = slider_crank(forms[k / 2], 0);
        kempe_trajectory *run = simulate(&l, &precise[k % 2], 0.002);
        if (run) {
            check_impacts(run, sizeof rebounds / sizeof *rebounds, rebounds, 1e-8);
            CHECK(run->verdict.drift_rel < 1e-9);
        }
        kempe_trajectory_free(run);
        if ((run = simulate(&sliding, &precise[k % 2], 0.009))) {
            check_impacts(run, sizeof slides / sizeof *slides, slides, 1e-9);
            CHECK(run->verdict.drift_rel < 1e-9);
        }
        kempe_trajectory_free(run);
        unload(&l);
        unload(&sliding);
    }
}

/* A joint of the tree starts as the one without clearance where its coordinates are held and at rest. */
static void ideal_start(void)
{
    static const char text[] =
        "kempe: 1\n"
        "parameters: {w: 500}\n"
        "bodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 0.3, inertia: {zz: 1e-4}, points: {B: [0.05, 0, "
        "0]}}\n"
        "  slider: {joint: {name: S, prismatic: x, at: ground}, mass: 0.14}\n"
        "  rod: {joint: {name: pin, revolute: z, at: slider, clearance: 0.5 mm, contact: {law: hertz, stiffness: "
        "1e9}}, mass: 0.21, com: [-0.06, 0, 0], inertia: {zz: 2.5e-4}, points: {B: [-0.12, 0, 0]}}\n"
        "drives: {motor: {joint: A, angle: 40 deg + w*t}}\n"
        "loops: {B: {ball: [crank.B, rod.B]}}\n"
        "start: {q: {A: 40 deg, S: 0.15, pin: -20 deg}, hold: [A, pin_x, pin_y], qd: {A: w, pin_x: 0, pin_y: 0}}\n";
    const double angle = 40 * 3.14159265358979323846 / 180, r = 0.05, l = 0.12, w = 500;
    const double rod = -asin(r * sin(angle) / l), turning = -r * w * cos(angle) / (l * cos(rod));
    loaded model = load_text(text);
    kempe_trajectory *run = simulate(&model, &precise[0], 1e-9);
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, "q,qd", &table) == KEMPE_OK);
    const char *const names[] = {"q.S", "q.pin", "q.pin_x", "qd.S", "qd.pin", "qd.pin_x", "qd.pin_y"};
    const double expected[] = {
        r * cos(angle) + l * cos(rod), rod, 0, -r * w * sin(angle) - l * sin(rod) * turning, turning, 0, 0};
    for (int k = 0; table && k < 7; k++)
        CHECK_NEAR(kempe_table_number(table, 0, kempe_table_find(table, names[k])), expected[k], 1e-11 * w);
    kempe_table_free(table);
    kempe_trajectory_free(run);
    unload(&model);
}

/* -- starts without clearance -------------------------------------------------------------------------------- */

/* Positions and rates of the start by name, against those of the mechanism without clearance. */
static void check_start(const char *text, int count, const char *const *names, const double *q, const double *qd)
{
    loaded model = load_text(text);
    kempe_assembly *a = NULL;
    char *said = NULL;
    CHECK(kempe_assembly_new(model.system, &a) == KEMPE_OK);
    for (int k = 0; a && k < count; k++) {
        int at = 0;
        while (at < kmp_model_motion_count(model.model) &&
               strcmp(kmp_model_motion(model.model, at)->name, names[k]) != 0)
            at++;
        CHECK_NEAR(kempe_assembly_q(a)[at], q[k], 1e-12);
        CHECK_NEAR(kempe_assembly_qd(a)[at], qd[k], 1e-11 * 500);
    }
    CHECK(a && kempe_assembly_print(a, KEMPE_TEXT, &said) == KEMPE_OK && check_says(said, " as without it"));
    kempe_text_free(said);
    kempe_assembly_free(a);
    unload(&model);
}

/* A slider-crank with a loose pin, compliant or rigid, as a closure or in the tree, at 40 degrees of the crank. Its
 * start has no rates, and a guess of its positions that is not closed without clearance. */
static void starts_of_pins(void)
{
    static const char *const contacts[] = {"law: hertz, stiffness: 1e9", "restitution: 0.5"};
    static const char *const names[] = {"A", "B", "S"}, *const of_tree[] = {"A", "pin", "S", "pin_x", "pin_y"};
    static const char head[] = "kempe: 1\n"
                               "drives: {motor: {joint: A, angle: 40 deg + 500*t}}\n"
                               "bodies:\n"
                               "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 0.3, inertia: {zz: 1e-4}, "
                               "points: {B: [0.05, 0, 0]}}\n"
                               "  slider: {joint: {name: S, prismatic: x, at: ground}, mass: 0.14, points: {P: [0, 0, "
                               "0]}}\n";
    static const char *const forms[] = {
        "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 0.21, inertia: {zz: 2.5e-4}, points: {P: [0.12, 0, "
        "0]}}\n"
        "loops: {pin: {revolute: [slider.P, rod.P], clearance: 0.5 mm, contact: {%s}}}\n"
        "start: {q: {A: 0.6981317007977318, B: -55 deg, S: 0.15}, hold: [A]}\n",
        "  rod: {joint: {name: pin, revolute: z, at: slider, clearance: 0.5 mm, contact: {%s}}, mass: 0.21, com: "
        "[-0.06, 0, 0], inertia: {zz: 2.5e-4}, points: {B: [-0.12, 0, 0]}}\n"
        "loops: {B: {ball: [crank.B, rod.B]}}\n"
        "start: {q: {A: 0.6981317007977318, pin: -15 deg, S: 0.15}, hold: [A]}\n"};
    const double angle = 40 * 3.14159265358979323846 / 180, r = 0.05, l = 0.12, w = 500;
    const double rod = -asin(r * sin(angle) / l), turning = -r * w * cos(angle) / (l * cos(rod));
    const double place = r * cos(angle) + l * cos(rod), rate = -r * w * sin(angle) - l * sin(rod) * turning;
    for (int k = 0; k < 4; k++) {
        const bool tree = k / 2;
        const double q[] = {angle, tree ? rod : rod - angle, place, 0, 0};
        const double qd[] = {w, tree ? turning : turning - w, rate, 0, 0};
        char text[1500], rest[700];
        (void)snprintf(rest, sizeof rest, forms[k / 2], contacts[k % 2]);
        (void)snprintf(text, sizeof text, "%s%s", head, rest);
        check_start(text, tree ? 5 : 3, tree ? of_tree : names, q, qd);
    }
}

/* A slider of a slider-crank in its guide; a ball on a crank in the socket of a slider with two coordinates. */
static void starts_of_guides_and_balls(void)
{
    static const char guide[] =
        "kempe: 1\n"
        "ground: {points: {O: [0, 0, 0]}}\n"
        "drives: {motor: {joint: A, angle: 40 deg + 500*t}}\n"
        "bodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 0.3, inertia: {zz: 1e-4}, points: {B: [0.05, 0, "
        "0]}}\n"
        "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 0.21, inertia: {zz: 2.5e-4}, points: {P: [0.12, 0, "
        "0]}}\n"
        "  slider: {joint: {name: P, revolute: z, at: rod.P}, mass: 0.14, inertia: {zz: 5e-5}, points: {P: [0, 0, "
        "0]}}\n"
        "loops: {guide: {prismatic: [ground.O, slider.P], axis: x, clearance: 0.2 mm, contact: {length: 60 mm, height: "
        "30 mm, restitution: 0.2}}}\n"
        "start: {q: {A: 0.6981317007977318, B: -55 deg, P: 15 deg}, hold: [A]}\n";
    static const char ball[] =
        "kempe: 1\n"
        "drives: {motor: {joint: A, angle: 40 deg + 500*t}}\n"
        "bodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 0.3, inertia: {zz: 1e-4}, points: {B: [0.05, 0, "
        "0]}}\n"
        "  cross: {joint: {name: X, prismatic: x, at: ground}, mass: 0.1}\n"
        "  slide: {joint: {name: Y, prismatic: y, at: cross}, mass: 0.1}\n"
        "  lift: {joint: {name: Z, prismatic: z, at: slide}, mass: 0.1, points: {C: [0, 0, -0.01]}}\n"
        "loops: {S: {ball: [lift.C, crank.B], clearance: 0.1 mm, contact: {law: hertz, stiffness: 1e8}}}\n"
        "start: {q: {A: 0.6981317007977318}, hold: [A]}\n";
    static const char *const of_guide[] = {"A", "B", "P"}, *const of_ball[] = {"A", "X", "Y", "Z"};
    const double angle = 40 * 3.14159265358979323846 / 180, r = 0.05, l = 0.12, w = 500;
    const double rod = -asin(r * sin(angle) / l), turning = -r * w * cos(angle) / (l * cos(rod));
    check_start(guide, 3, of_guide, (const double[]){angle, rod - angle, -rod},
                (const double[]){w, turning - w, -turning});
    check_start(ball, 4, of_ball, (const double[]){angle, r * cos(angle), r * sin(angle), 0.01},
                (const double[]){w, -r * w * sin(angle), r * w * cos(angle), 0});
}

/* Given rates are kept. A journal that they move keeps its rate, and those of other joints follow: the end of the
 * second arm moves with 3 (0.3 + 0.3) + 1 0.3 + 0.2, and so does the bob. Rates that follow from joints with clearance
 * have no derivative by parameters. */
static void given_rates(void)
{
    static const char text[] =
        "kempe: 1\n"
        "parameters: {w: 3}\n"
        "bodies:\n"
        "  one: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {P: [0.3, 0, 0]}}\n"
        "  two: {joint: {name: B, revolute: z, at: one.P, clearance: 1 mm, contact: {law: hertz, stiffness: 1e9}}, "
        "mass: "
        "1, inertia: {zz: 0.1}, points: {P: [0.3, 0, 0]}}\n"
        "  bob: {joint: {name: Y, prismatic: y, at: ground}, mass: 1, points: {Q: [0.6, 0, 0]}}\n"
        "loops: {pin: {revolute: [two.P, bob.Q], clearance: 1 mm, contact: {law: hertz, stiffness: 1e9}}}\n"
        "start: {qd: {A: w, B: 1, B_y: 0.2}}\n";
    static const double expected[] = {3, 0, 0.2, 1, 2.3};
    loaded model = load_text(text);
    kempe_assembly *a = NULL;
    kempe_sensitivity *slopes = NULL;
    const kempe_sensitivity_options options = {
        .parameters = "w", .outputs = "q(A)", .run = &(kempe_run_options){.t_end = 1e-6}};
    char *said = NULL;
    CHECK(kempe_assembly_new(model.system, &a) == KEMPE_OK);
    for (int k = 0; a && k < 5; k++)
        CHECK_NEAR(kempe_assembly_qd(a)[k], expected[k], 1e-12);
    CHECK(a && kempe_assembly_print(a, KEMPE_TEXT, &said) == KEMPE_OK &&
          strstr(said, "'pin' starts as without it\nclearance 'B' starts with a rate of its own\n"));
    CHECK(kempe_sensitivity_new(model.model, &options, &slopes) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(model.context), "give the rates of all coordinates"));
    kempe_text_free(said);
    kempe_sensitivity_free(slopes);
    kempe_assembly_free(a);
    unload(&model);
}

/* -- guides ------------------------------------------------------------------------------------------------ */

static double last_of(const kempe_trajectory *run, const char *names, const char *column)
{
    kempe_table *table = NULL;
    double value = NAN;
    if (run && kempe_trajectory_outputs(run, names, &table) == KEMPE_OK)
        value = kempe_table_number(table, kempe_table_row_count(table) - 1, kempe_table_find(table, column));
    kempe_table_free(table);
    return value;
}

/* The depths of a slider of the length l and the height h, whose centre of mass is 10 mm before its middle, that lies
 * on its lower corners: K d^1.5 of each is the share of its weight by the levers. With the sine s of its angle, where
 * l s = d_r - d_f, the rear one is at -c l/2 + s h/2. */
static void resting_depths(double *front, double *rear)
{
    const double l = 0.04, h = 0.02, weight = 2 * 9.81;
    double s = 0;
    for (int k = 0; k < 100; k++) {
        double c = sqrt(1 - s * s), share = (0.01 * c + c * l / 2 - s * h / 2) / (c * l);
        *front = pow(weight * share / 1e8, 2.0 / 3);
        *rear = pow(weight * (1 - share) / 1e8, 2.0 / 3);
        s = (*rear - *front) / l;
    }
}

/* The joint in the tree, and as a closure. */
static void resting_slider(void)
{
    static const char *const forms[] = {
        "  s: {joint: {name: S, prismatic: x, at: ground, %s}, mass: 2, com: [10 mm, 0, 0], inertia: {zz: 1e-3}}\n",
        "  s: {joint: {name: F, planar: z, at: ground, coordinates: [a, b, c]}, mass: 2, com: [10 mm, 0, 0], inertia: "
        "{zz: 1e-3}, "
        "points: {P: [0, 0, 0]}}\n"
        "loops: {S: {prismatic: [ground.O, s.P], axis: x, %s}}\n"};
    double front, rear;
    resting_depths(&front, &rear);
    for (int k = 0; k < 2; k++) {
        char joint[300], body[700], text[1200];
        (void)snprintf(joint, sizeof joint,
                       "clearance: 0.1 mm, contact: {length: 40 mm, height: 20 mm, law: hunt_crossley, stiffness: 1e8, "
                       "damping: 100}");
        (void)snprintf(body, sizeof body, forms[k], joint);
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n%s"
                       "run: {outputs: [q, force(S_front_lower), force(S_rear_lower)]}\n",
                       body);
        loaded l = load_text(text);
        kempe_trajectory *run = simulate(&l, &precise[0], 0.3);
        CHECK_NEAR(last_of(run, "force(S_front_lower)", "force.S_front_lower.depth"), front, 1e-9 * front);
        CHECK_NEAR(last_of(run, "force(S_rear_lower)", "force.S_rear_lower.depth"), rear, 1e-9 * rear);
        CHECK(last_of(run, "force(S_front_upper)", "force.S_front_upper.normal") == 0);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A rigid slider that falls on its lower side, both corners at once: it strikes at sqrt(2 c/g) and slides on with the
 * rate along its guide, without tilting. The corners carry its weight. */
static void rigid_slider(void)
{
    static const char text[] = "kempe: 1\n"
                               "gravity: [0, 0, -9.81]\n"
                               "bodies:\n"
                               "  s:\n"
                               "    joint: {name: S, prismatic: x, at: ground, clearance: 1 mm, contact: {axis: y, "
                               "length: 40 mm, height: 20 mm, restitution: 0}}\n"
                               "    mass: 2\n"
                               "    inertia: {yy: 1e-3}\n"
                               "start: {qd: {S: 0.3}}\n"
                               "run: {outputs: [q, force(S_front_lower)]}\n";
    const double t = sqrt(2 * 1e-3 / 9.81);
    loaded l = load_text(text);
    kempe_trajectory *run = simulate(&l, &precise[0], 0.1);
    int struck = 0;
    for (int k = 0; run && k < run->log.kept; k++)
        if (strcmp(run->log.entries[k].kind, "impact") == 0) {
            CHECK_NEAR(run->log.entries[k].t, t, 1e-12);
            struck++;
        }
    CHECK(struck > 0);
    CHECK_NEAR(last_of(run, "q(S)", "q.S"), 0.03, 1e-12);
    CHECK_NEAR(fabs(last_of(run, "q(S_across)", "q.S_across")), 1e-3, 1e-12);
    CHECK_NEAR(last_of(run, "q(S_angle)", "q.S_angle"), 0, 1e-12);
    CHECK_NEAR(last_of(run, "force(S_front_lower),force(S_rear_lower),force(S_front_upper),force(S_rear_upper)",
                       "force.S_front_lower") +
                   last_of(run, "force(S_rear_lower)", "force.S_rear_lower") +
                   last_of(run, "force(S_front_upper)", "force.S_front_upper") +
                   last_of(run, "force(S_rear_upper)", "force.S_rear_upper"),
               2 * 9.81, 1e-9);
    kempe_trajectory_free(run);
    unload(&l);
}

/* -- balls ------------------------------------------------------------------------------------------------- */

/* A ball flies from the centre of its socket along a direction in space, and returns from it as from a wall: contact
 * lasts 2.94327518432470466 d/v with the largest depth d = (5 m v^2/(4 K))^(2/5) of Hertz. */
static void ball_in_socket(void)
{
    static const char text[] =
        "kempe: 1\n"
        "ground: {points: {O: [0, 0, 0]}}\n"
        "bodies:\n"
        "  b: {joint: {free: x, at: ground, coordinates: [x, y, z, a, b, c]}, mass: 0.5, inertia: {xx: 1e-4, yy: 1e-4, "
        "zz: 1e-4}, points: {C: [0, 0, 0]}}\n"
        "loops: {S: {ball: [ground.O, b.C], clearance: 1 mm, contact: {%s}}}\n"
        "start: {qd: {x: 0.1, y: 0.2, z: 0.2}}\n"
        "run: {outputs: [q, qd, force(%s)]}\n";
    static const char *const laws[] = {"law: hertz, stiffness: 1e8", "restitution: 0.5"};
    const double v = 0.3, d = pow(1.25 * 0.5 * v * v / 1e8, 0.4), on = 1e-3 / v, off = on + 2.94327518432470466 * d / v;
    for (int k = 0; k < 2; k++) {
        char model[1000];
        (void)snprintf(model, sizeof model, text, laws[k], k ? "S_journal" : "S");
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &precise[0], 0.006);
        const kmp_run_log *log = &run->log;
        CHECK(run && log->kept == (k ? 1 : 2));
        if (run && log->kept > 0)
            CHECK_NEAR(log->entries[0].t, on, 1e-11);
        if (run && k == 0 && log->kept > 1)
            CHECK_NEAR(log->entries[1].t, off, 1e-11);
        CHECK_NEAR(last_of(run, "qd(y)", "qd.y"), k ? -0.1 : -0.2, 1e-9);
        const double place = k ? 1e-3 - 0.5 * v * (0.006 - on) : 1e-3 - v * (0.006 - off);
        CHECK_NEAR(last_of(run, k ? "force(S_journal)" : "force(S)",
                           k ? "force.S_journal.eccentricity" : "force.S.eccentricity"),
                   fabs(place), 1e-10);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* -- friction of rigid contacts ------------------------------------------------------------------------------ */

/* A journal of 0.5 kg with its centre 10 mm from that of its bearing of 30 mm, in the tree or as a closure. */
static loaded rubbing_journal(bool tree, const char *gravity, const char *contact, const char *rest)
{
    static const char *const forms[] = {
        "  j: {joint: {name: F, planar: z, at: ground, coordinates: [J_x, J_y, J]}, mass: 0.5, inertia: {zz: 4e-5}, "
        "points: {P: [0, 0, 0]}}\n"
        "loops: {J: {revolute: [ground.O, j.P], %s}}\n",
        "  j: {joint: {name: J, revolute: z, at: ground, %s}, mass: 0.5, inertia: {zz: 4e-5}}\n"};
    char joint[300], body[600], text[1500];
    (void)snprintf(joint, sizeof joint, "clearance: 10 mm, contact: {radius: 30 mm, %s}", contact);
    (void)snprintf(body, sizeof body, forms[tree], joint);
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ngravity: [%s]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n%s%s"
                   "run: {outputs: [q, qd, force(J_journal_friction), force(J_journal)]}\n",
                   gravity, body, rest);
    return load_text(text);
}

static double at(const kempe_table *table, int row, const char *name)
{
    return kempe_table_number(table, row, kempe_table_find(table, name));
}

/* A shaft with a given spin drags its journal up the bearing, against the rate of its lowest surface: with the angle a
 * from the lowest place, c a'' = -g sin a
 * + mu (g cos a + c a'^2). From rest at the lowest place a'^2 = A cos a + B sin a - A exp(2 mu a). */
static void dragged_journal(void)
{
    const double mu = 0.3, c = 0.01, k = 9.81 / c, pi = 3.14159265358979323846;
    const double a_part = 2 * k * (1 - 2 * mu * mu) / (1 + 4 * mu * mu), b_part = 6 * mu * k / (1 + 4 * mu * mu);
    for (int trial = 0; trial < 4; trial++) {
        loaded l = rubbing_journal(trial / 2, "0, -9.81, 0", "restitution: 0, friction: 0.3",
                                   "drives: {motor: {joint: J, angle: 100*t}}\n"
                                   "start: {q: {J_y: -10 mm}, qd: {J_x: 0, J_y: 0}}\n");
        kempe_trajectory *run = simulate(&l, &precise[trial % 2], 0.09);
        kempe_table *table = NULL;
        double largest = 0;
        CHECK(run && kempe_trajectory_outputs(run, "q,qd,force(J_journal),force(J_journal_friction)", &table) == 0);
        for (int row = 0; table && row < kempe_table_row_count(table); row++) {
            double x = at(table, row, "q.J_x"), y = at(table, row, "q.J_y"), angle = atan2(-x, -y);
            double rate = hypot(at(table, row, "qd.J_x"), at(table, row, "qd.J_y")) / c;
            double square = a_part * (cos(angle) - exp(2 * mu * angle)) + b_part * sin(angle);
            double normal = 0.5 * (9.81 * cos(angle) + c * rate * rate);
            CHECK_NEAR(hypot(x, y), c, 1e-11);
            CHECK_NEAR(rate * rate, square, 1e-8 * k);
            CHECK_NEAR(at(table, row, "force.J_journal.normal"), normal, 1e-7);
            CHECK_NEAR(at(table, row, "force.J_journal_friction"), -mu * normal, 1e-7);
            largest = fmax(largest, angle);
        }
        CHECK(largest > 20 * pi / 180);
        kempe_table_free(table);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Without a drive it rolls: with its radius r the inertia is that of m c^2 + I (c/r)^2, the friction that of I c/r^2.
 */
static void rolling_journal(void)
{
    const double c = 0.01, r = 0.02, m = 0.5, inertia = 4e-5, first = 0.5, g = 9.81;
    const double all = m * c * c + inertia * c * c / (r * r);
    char start[200];
    (void)snprintf(start, sizeof start, "start: {q: {J_x: %.17g, J_y: %.17g}, qd: {J: 0, J_x: 0, J_y: 0}}\n",
                   c * sin(first), -c * cos(first));
    for (int trial = 0; trial < 4; trial++) {
        loaded l = rubbing_journal(trial / 2, "0, -9.81, 0", "restitution: 0, friction: 0.6", start);
        kempe_trajectory *run = simulate(&l, &precise[trial % 2], 0.3);
        kempe_table *table = NULL;
        double least = 1;
        CHECK(run && kempe_trajectory_outputs(run, "q,qd,force(J_journal),force(J_journal_friction)", &table) == 0);
        for (int row = 0; table && row < kempe_table_row_count(table); row++) {
            double x = at(table, row, "q.J_x"), y = at(table, row, "q.J_y"), angle = atan2(x, -y);
            double rate = (at(table, row, "qd.J_x") * -y + at(table, row, "qd.J_y") * x) / (c * c);
            CHECK_NEAR(0.5 * all * rate * rate, m * g * c * (cos(angle) - cos(first)), 1e-9 * m * g * c);
            CHECK_NEAR(at(table, row, "qd.J"), -rate * c / r, 1e-8 * sqrt(g / c));
            CHECK_NEAR(at(table, row, "q.J"), -(angle - first) * c / r, 1e-8);
            CHECK_NEAR(at(table, row, "force.J_journal_friction"), inertia * c / (r * r) * m * g * c * sin(angle) / all,
                       1e-7);
            least = fmin(least, angle);
        }
        CHECK(least < -0.4);
        kempe_table_free(table);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A journal that turns strikes its bearing with the rate v: the impulse along it is the friction times (1 + e) m v
 * against the slip, but no more than stops the slip, which 1/m + r^2/I takes. */
static void rubbing_impact(void)
{
    const double v = 0.5, r = 0.02, m = 0.5, inertia = 4e-5, spin = 40, e = 0.6;
    for (int trial = 0; trial < 4; trial++) {
        const double mu = trial % 2 ? 0.9 : 0.1, stop = r * spin / (1 / m + r * r / inertia);
        const double impulse = fmin(mu * (1 + e) * m * v, stop);
        char contact[100];
        (void)snprintf(contact, sizeof contact, "restitution: 0.6, friction: %g", mu);
        loaded l = rubbing_journal(trial / 2, "0, 0, 0", contact, "start: {qd: {J: 40, J_x: 0, J_y: -0.5}}\n");
        kempe_trajectory *run = simulate(&l, &precise[0], 0.021);
        CHECK((impulse < stop) == (trial % 2 == 0));
        CHECK_NEAR(last_of(run, "qd(J_x)", "qd.J_x"), -impulse / m, 1e-10);
        CHECK_NEAR(last_of(run, "qd(J_y)", "qd.J_y"), e * v, 1e-10);
        CHECK_NEAR(last_of(run, "qd(J)", "qd.J"), spin - r * impulse / inertia, 1e-8);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A ball that turns flies along n to its socket and strikes it with the rate 0.3. It returns with `back` along n, and
 * with `across` against its slip spin x r n, which has components along both directions across n. */
static void check_ball(const char *contact, double t_end, double back, double across, double tolerance)
{
    static const char text[] =
        "kempe: 1\n"
        "ground: {points: {O: [0, 0, 0]}}\n"
        "bodies:\n"
        "  b: {joint: {free: x, at: ground, coordinates: [x, y, z, a, b, c]}, mass: 0.5, inertia: {xx: 1e-5, yy: 1e-5, "
        "zz: 1e-5}, points: {C: [0, 0, 0]}}\n"
        "loops: {S: {ball: [ground.O, b.C], clearance: 1 mm, contact: {radius: 9 mm, %s}}}\n"
        "start: {qd: {x: 0.1, y: 0.2, z: 0.2, a: 20, b: 0, c: 0}}\n"
        "run: {outputs: [q, qd]}\n";
    const double n[] = {1.0 / 3, 2.0 / 3, 2.0 / 3}, size = hypot(n[1], n[2]), slip[] = {0, -n[2] / size, n[1] / size};
    static const char *const names[] = {"qd.x", "qd.y", "qd.z"};
    char model[1000];
    (void)snprintf(model, sizeof model, text, contact);
    loaded l = load_text(model);
    kempe_trajectory *run = simulate(&l, &precise[0], t_end);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(last_of(run, "qd", names[k]), -back * n[k] - across * slip[k], tolerance);
    CHECK(run && run->verdict.drift_rel < 1e-8);
    kempe_trajectory_free(run);
    unload(&l);
}

static void rubbing_ball(void)
{
    const double v = 0.3, r = 0.008, m = 0.5, inertia = 1e-5, e = 0.5, slip = 20 * r * sqrt(8.0) / 3;
    for (int trial = 0; trial < 2; trial++) {
        const double mu = trial ? 0.5 : 0.05, stop = slip / (1 / m + r * r / inertia);
        const double impulse = fmin(mu * (1 + e) * m * v, stop);
        char contact[100];
        (void)snprintf(contact, sizeof contact, "restitution: 0.5, friction: %g", mu);
        CHECK((impulse < stop) == (trial == 0));
        check_ball(contact, 0.0045, e * v, impulse / m, 1e-9);
    }
}

/* An elastic ball whose contact is short is nearly a rigid one: its friction has the friction times the impulse 2 m v.
 */
static void rubbing_elastic_ball(void)
{
    check_ball("law: hertz, stiffness: 1e13, friction: {coefficient: 0.05, speed: 10 um/s}", 0.0035, 0.3,
               0.05 * 2 * 0.3, 1e-3 * 0.3);
}

/* A slider falls on its lower side with both corners and rubs there until it rests: the impact takes mu sqrt(2 g c)
 * from its rate, and the way that remains is its square over 2 mu g. */
static void rubbing_slider(void)
{
    static const char text[] =
        "kempe: 1\n"
        "gravity: [0, -9.81, 0]\n"
        "bodies:\n"
        "  s:\n"
        "    joint: {name: S, prismatic: x, at: ground, clearance: 1 mm, contact: {length: 40 mm, "
        "height: 20 mm, restitution: 0, friction: 0.2}}\n"
        "    mass: 2\n"
        "    inertia: {zz: 1e-3}\n"
        "start: {qd: {S: 0.3}}\n"
        "run: {outputs: [q, qd]}\n";
    const double fall = sqrt(2 * 1e-3 / 9.81), left = 0.3 - 0.2 * 9.81 * fall;
    loaded l = load_text(text);
    kempe_trajectory *run = simulate(&l, &precise[0], 0.5);
    CHECK_NEAR(last_of(run, "q(S)", "q.S"), 0.3 * fall + left * left / (2 * 0.2 * 9.81), 1e-11);
    CHECK_NEAR(last_of(run, "qd(S)", "qd.S"), 0, 1e-12);
    CHECK_NEAR(last_of(run, "q(S_angle)", "q.S_angle"), 0, 1e-12);
    kempe_trajectory_free(run);
    unload(&l);
}

int main(void)
{
    TEST(rigid_pin);
    TEST(ideal_start);
    TEST(starts_of_pins);
    TEST(starts_of_guides_and_balls);
    TEST(given_rates);
    TEST(resting_slider);
    TEST(rigid_slider);
    TEST(ball_in_socket);
    TEST(dragged_journal);
    TEST(rolling_journal);
    TEST(rubbing_impact);
    TEST(rubbing_ball);
    TEST(rubbing_elastic_ball);
    TEST(rubbing_slider);
    return check_report();
}
