/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 6 */
/* Friction of rigid contacts whose slip is the rate of no function of the coordinates: spheres that roll in space, and
 * profiles, against the digits of bench/machines/contact_digits.py and closed forms; what is refused. */
#include "ways.h"
#include <kempe/modes.h>
#include <math.h>
#include <string.h>

#define G 9.81

/* True for a method that follows rolling in space; the others refuse it by name at the start. */
static bool follows(const loaded *l, const way *by)
{
    kempe_status status = KEMPE_OK;
    bool refuses = by->form && strcmp(by->form, "newton") == 0 && strcmp(by->integrator, "dop853") != 0;
    if (!refuses)
        return true;
    kempe_trajectory *run = simulate_any(l, by, 1, &status);
    CHECK(run && strstr(kempe_trajectory_reason(run), "is a nonholonomic constraint"));
    kempe_trajectory_free(run);
    return false;
}

#define BALL                                                                                                           \
    "joint: {name: b, free: x, at: ground}, mass: 2, inertia: {xx: 8e-3, yy: 8e-3, zz: 8e-3}, points: {C: [0, 0, 0]}"

/* Thrown with spin about two axes: a parabola, then a straight line. */
static void a_ball_is_bowled(void)
{
    loaded l = load("tests/models/contact_bowling.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 2) : NULL;
        const kmp_log_entry *rolls = run ? entry(run, "friction", 1) : NULL;
        CHECK(!run || rolls);
        if (rolls) {
            CHECK_TEXT(rolls->text, "'floor_friction' sticks");
            CHECK_NEAR(rolls->t, 0.5686798948526761609, e);
            CHECK_NEAR(last_q(run)[0], 4.774528533875955772, 10 * e);
            CHECK_NEAR(last_q(run)[1], -0.4705657593488530739, 10 * e);
            CHECK_NEAR(last_qd(run)[0], 16. / 7, 10 * e);
            CHECK_NEAR(last_qd(run)[1], -5. / 14, 10 * e);
            CHECK(run->verdict.drift_rel < 100 * e && !entry(run, "friction", 2));
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Inside an upright cylinder: its height oscillates. */
static void a_ball_rolls_along_a_wall(void)
{
    loaded l = load("tests/models/contact_wall.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 3) : NULL;
        if (run) {
            CHECK_NEAR(last_q(run)[0], 0.4219269793662460523, e);
            CHECK_NEAR(last_q(run)[2], 0.02642595859990680709, e);
            CHECK_NEAR(last_lambda(run)[0], 8, 100 * e);
            CHECK_NEAR(last_lambda(run)[1], 0.9677670464004260247, 100 * e);
            CHECK(run->verdict.drift_rel < 100 * e && !entry(run, "friction", 1));
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* On a table that turns: a circle in space, with 2/7 of the rate of the table. */
static void a_ball_rolls_on_a_turntable(void)
{
    loaded l = load("tests/models/contact_turntable.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance, w = 6. / 7;
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 5) : NULL;
        if (run) {
            CHECK_NEAR(last_q(run)[1], 1 + 0.3 / w * sin(5 * w), 2 * e);
            CHECK_NEAR(last_q(run)[2], 0.3 / w * (1 - cos(5 * w)), 2 * e);
            CHECK(!entry(run, "friction", 1));
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Along a parabola until it stays. */
static void a_bead_slides_in_a_valley(void)
{
    static const double turn[] = {1.113382931362762079, 2.166945916105256259, 3.186801061799427575, 4.1948918856228317};
    loaded l = load("tests/models/contact_valley.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 5) : NULL;
        for (int i = 0; run && i < 4; i++) {
            const kmp_log_entry *at = entry(run, "friction", 1 + i);
            CHECK(at);
            if (at)
                CHECK_NEAR(at->t, turn[i], e);
        }
        if (run) {
            CHECK_NEAR(last_q(run)[0], 0.08524397116355657402, e);
            CHECK(run->verdict.drift_rel < 100 * e && !entry(run, "friction", 5));
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Off a fixed ball: it sticks, slips and leaves. Its normal turns in space. */
static void a_ball_leaves_a_dome(void)
{
    loaded l = load("tests/models/contact_dome.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 1.2) : NULL;
        const kmp_log_entry *slips = run ? entry(run, "friction", 1) : NULL,
                            *off = run ? entry(run, "contact", 1) : NULL;
        CHECK(!run || (slips && off));
        if (slips && off) {
            CHECK_TEXT(slips->text, "'on_friction' slips");
            CHECK_TEXT(off->text, "'on' opens");
            CHECK_NEAR(slips->t, 0.6632693496326497691, e);
            CHECK_NEAR(off->t, 0.7648850295737862024, e);
            CHECK_NEAR(last_q(run)[0], 1.251690805394522675, 10 * e);
            CHECK_NEAR(last_q(run)[1], 1.054284621316280052, 10 * e);
            CHECK_NEAR(last_qd(run)[2], -6.397081138375204568, 10 * e);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Around a great circle inside a sphere: at both poles directions of slip would be singular, and change before. */
static void a_ball_rolls_through_the_poles(void)
{
    loaded l = load("tests/models/contact_loop.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 1.5) : NULL;
        if (run) {
            CHECK_NEAR(last_q(run)[0], 0.8218263316915058363, 10 * e);
            CHECK_NEAR(last_q(run)[1], 0.2542206752758846659, 10 * e);
            CHECK_NEAR(last_q(run)[2], -0.2645247224755301259, 10 * e);
            CHECK_NEAR(last_lambda(run)[0], 92.12774412178478716, 1000 * e);
            CHECK(entry(run, "event", 2) && !entry(run, "friction", 1) && run->verdict.drift_rel < 100 * e);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* A disc rolls on its rim with a constant lean. */
static void a_coin_rolls_in_a_circle(void)
{
    loaded l = load("tests/models/contact_coin.yaml");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 1) : NULL;
        if (run) {
            CHECK_NEAR(last_q(run)[0], -0.1156956918729520462, e);
            CHECK_NEAR(last_q(run)[1], 0.09992534567871277508, e);
            CHECK_NEAR(last_q(run)[2], 0.09320390859672263497, e);
            CHECK_NEAR(last_lambda(run)[1], 1.851131069967232739, 100 * e);
            CHECK_NEAR(last_lambda(run)[2], -1.598805530859404401, 100 * e);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

#define LONG_VALLEY                                                                                                    \
    "tables: {valley: {x: [-1, -0.75, -0.5, -0.25, 0, 0.25, 0.5, 0.75, 1], y: [0.5, 0.28125, 0.125, 0.03125, 0, "      \
    "0.03125, 0.125, 0.28125, 0.5]}}\n"

/* A roller in a parabola: it keeps its energy, and turns by the length of its centre's curve. With a centre at x = s -
 * r s/w, w = sqrt(1 + s^2), that length is the one of the parabola less r atan(s). */
static void a_roller_in_a_valley(void)
{
    loaded l = load_text(
        "kempe: 1\n"
        "gravity: [0, -9.81, 0]\n"
        "ground: {points: {O: [0, 0, 0]}}\n" LONG_VALLEY
        "bodies: {c: {joint: {name: c, planar: z, at: ground}, mass: 2, inertia: {zz: 0.01}, points: {C: [0, 0, 0]}}}\n"
        "contacts: {on: {cylinder: c.C, radius: 0.1, on: {profile: valley, at: ground.O}, restitution: 0, friction: "
        "0.9}}\n"
        "start: {q: {c.1: -0.4552786404500042, c.2: 0.2144427190999916}}\n");
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 2) : NULL;
        if (run) {
            const double *q = last_q(run), *qd = last_qd(run), e = 1e-7; /* splines through the centre's curve */
            double s = q[0], length[2];
            for (int i = 0; i < 50; i++)
                s = q[0] + 0.1 * s / sqrt(1 + s * s);
            const double at[] = {-0.5, s};
            for (int i = 0; i < 2; i++)
                length[i] = (at[i] * sqrt(1 + at[i] * at[i]) + asinh(at[i])) / 2 - 0.1 * atan(at[i]);
            CHECK_NEAR(q[1], s * s / 2 + 0.1 / sqrt(1 + s * s), e);
            CHECK_NEAR(q[2], -(length[1] - length[0]) / 0.1, 100 * e);
            CHECK_NEAR(qd[0] * qd[0] + qd[1] * qd[1] + 0.005 * qd[2] * qd[2], 2 * G * (0.2144427190999916 - q[1]),
                       1e-6);
            CHECK(!entry(run, "friction", 1) && run->verdict.drift_rel < 1e-6);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* A ball that spins bounces: with little friction the impulse is at its bound, against the slip; otherwise the slip
 * ends. Its rate changes by 2/7 of the slip then. */
static void a_spinning_ball_bounces(void)
{
    static const double mu[] = {0.1, 0.9};
    const double down = sqrt(2 * G * 0.5), u[2] = {1 - 0.1 * 20, 0.5 + 0.1 * -30}, size = hypot(u[0], u[1]);
    for (int k = 0; k < 2; k++) {
        char text[1024];
        const double part = k == 0 ? mu[k] * 1.5 * down / size : 2. / 7;
        snprintf(text, sizeof text,
                 "kempe: 1\n"
                 "gravity: [0, 0, -9.81]\n"
                 "ground: {points: {O: [0, 0, 0]}}\n"
                 "bodies: {ball: {" BALL "}}\n"
                 "contacts: {f: {sphere: ball.C, radius: 0.1, on: {plane: ground.O}, restitution: 0.5, friction: %g}}\n"
                 "start: {q: {b.3: 0.6}, qd: {b.1: 1, b.2: 0.5, b.4: -30, b.5: 20}}\n",
                 mu[k]);
        loaded l = load_text(text);
        for (int i = 0; i < WAYS; i++) {
            kempe_trajectory *run = follows(&l, &ways[i]) ? simulate(&l, &ways[i], 0.5) : NULL;
            if (run) {
                CHECK(entry(run, "impact", 0) && !entry(run, "impact", 1));
                CHECK_NEAR(last_qd(run)[0], 1 - part * u[0], ways[i].tolerance);
                CHECK_NEAR(last_qd(run)[1], 0.5 - part * u[1], ways[i].tolerance);
            }
            kempe_trajectory_free(run);
        }
        unload(&l);
    }
}

/* Between a floor and a plate that is moved: the ball has half of the plate's rate, and the plate is pushed back by
 * 0.35 of its mass times the acceleration. */
static void a_ball_under_a_plate(void)
{
    loaded l = load_text(
        "kempe: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "ground: {points: {O: [0, 0, 0]}}\n"
        "bodies:\n"
        "  ball: {" BALL "}\n"
        "  slide: {joint: {name: x, prismatic: x, at: ground}}\n"
        "  across: {joint: {name: y, prismatic: y, at: slide}}\n"
        "  plate: {joint: {name: z, prismatic: z, at: across}, mass: 3, points: {P: {at: [0, 0, 0], axes: {x: x, z: "
        "-z}}}}\n"
        "drives: {dx: {joint: x, displacement: \"0.3*(1 - cos(2*t))\"}, dy: {joint: y, displacement: \"0.2*t^2\"}}\n"
        "contacts:\n"
        "  floor: {sphere: ball.C, radius: 0.1, on: {plane: ground.O}, restitution: 0, friction: 0.5}\n"
        "  top: {sphere: ball.C, radius: 0.1, on: {plane: plate.P}, restitution: 0, friction: 0.5}\n"
        "start: {q: {b.3: 0.1, z: 0.2}}\n");
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance, t = 1.5;
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], t) : NULL;
        if (run) {
            CHECK_NEAR(last_q(run)[0], 0.15 * (1 - cos(2 * t)), e);
            CHECK_NEAR(last_q(run)[1], 0.1 * t * t, e);
            CHECK_NEAR(last_lambda(run)[3], 0.15 * 2 * 1.2 * cos(2 * t), 100 * e);
            CHECK_NEAR(last_lambda(run)[4], 0.15 * 2 * 0.4, 100 * e);
            CHECK_NEAR(last_lambda(run)[6], 0.35 * 2 * 1.2 * cos(2 * t), 100 * e);
            CHECK_NEAR(last_lambda(run)[7], -0.35 * 2 * 0.4, 100 * e);
            CHECK(run->verdict.drift_rel < 100 * e);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Small motions of a sphere at the bottom of a bowl: it rolls in both directions. */
static void small_motions(void)
{
    loaded l = load_text("kempe: 1\n"
                         "gravity: [0, 0, -9.81]\n"
                         "ground: {points: {O: [0, 0, 0]}}\n"
                         "bodies: {ball: {" BALL "}}\n"
                         "contacts: {in: {sphere: ball.C, radius: 0.1, on: {sphere: ground.O, radius: 1, inside: yes}, "
                         "restitution: 0, friction: 0.3}}\n"
                         "start: {q: {b.3: -0.9}}\n");
    kempe_modes *modes = NULL;
    kempe_table *table = NULL;
    int swings = 0;
    CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK);
    CHECK(modes && kempe_modes_table(modes, "modes", &table) == KEMPE_OK);
    for (int i = 0; table && i < kempe_table_row_count(table); i++)
        swings +=
            fabs(fabs(kempe_table_number(table, i, kempe_table_find(table, "im"))) - sqrt(5 * G / (7 * 0.9))) < 1e-9;
    CHECK(swings == 2 || swings == 4);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* A ball that slides one way and turns about the normal: nothing moves its slip across. */
static void one_of_two_directions(void)
{
    loaded l =
        load_text("kempe: 1\n"
                  "gravity: [0, 0, -9.81]\n"
                  "ground: {points: {O: [0, 0, 0]}}\n"
                  "bodies:\n"
                  "  a: {joint: {name: x, prismatic: x, at: ground}}\n"
                  "  b: {joint: {name: z, cylindrical: z, at: a}, mass: 1, inertia: {zz: 1}, points: {C: [0, 0, 0]}}\n"
                  "contacts: {f: {sphere: b.C, radius: 0.1, on: {plane: ground.O}, restitution: 0, friction: 0.3}}\n"
                  "start: {q: {z.1: 0.1}, qd: {x: 3, z.2: 1}}\n");
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = follows(&l, &ways[k]) ? simulate(&l, &ways[k], 2) : NULL;
        const kmp_log_entry *stops = run ? entry(run, "friction", 1) : NULL;
        CHECK(!run || stops);
        if (stops) {
            CHECK_NEAR(stops->t, 3 / (0.3 * G), ways[k].tolerance);
            CHECK_NEAR(last_q(run)[0], 4.5 / (0.3 * G), ways[k].tolerance);
            CHECK_NEAR(last_q(run)[2], 2, ways[k].tolerance);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Friction that nothing slides against. */
static void friction_without_slip_is_refused(void)
{
    static const char text[] =
        "kempe: 1\n"
        "ground: {points: {O: [0, 0, 0]}}\n"
        "bodies: {b: {joint: {name: z, cylindrical: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {C: [0, 0, "
        "0]}}}\n"
        "contacts: {f: {sphere: b.C, radius: 0.1, on: {plane: ground.O}, restitution: 0, friction: 0.3}}\n";
    kempe_context *context = kempe_context_new();
    kempe_model *read = NULL;
    kempe_system *system = NULL;
    CHECK(kempe_model_read_text(context, text, "press.yaml", &read) == KEMPE_OK);
    CHECK(read && kempe_system_new(read, &system) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context),
                 "contact 'f': no coordinate slides or rolls its surfaces along 'f_friction1'"));
    kempe_system_free(system);
    kempe_model_free(read);
    kempe_context_free(context);
}

/* The positions of a DAE by h alone do not hold rates. */
static void index_3_is_refused(void)
{
    const way by = {"dae", "index3", "ida", 0, 0};
    loaded l = load("tests/models/contact_bowling.yaml");
    kempe_status status = KEMPE_OK;
    kempe_trajectory *run = simulate_any(&l, &by, 1, &status);
    CHECK(run && strstr(kempe_trajectory_reason(run), "'floor_friction1' is a nonholonomic constraint"));
    kempe_trajectory_free(run);
    unload(&l);
}

/* Small motions about a ball that rolls on have states beyond the independent coordinates. */
static void small_motions_of_rolling_are_refused(void)
{
    loaded l = load("tests/models/contact_wall.yaml");
    kempe_modes *modes = NULL;
    kempe_modes_options options = {.at = "start"};
    CHECK(l.system && kempe_modes_new(l.system, &options, &modes) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "'wall_friction1' is a nonholonomic constraint"));
    kempe_modes_free(modes);
    unload(&l);
}

int main(void)
{
    TEST(a_ball_is_bowled);
    TEST(a_ball_rolls_along_a_wall);
    TEST(a_ball_rolls_on_a_turntable);
    TEST(a_bead_slides_in_a_valley);
    TEST(a_ball_leaves_a_dome);
    TEST(a_ball_rolls_through_the_poles);
    TEST(a_coin_rolls_in_a_circle);
    TEST(a_roller_in_a_valley);
    TEST(a_spinning_ball_bounces);
    TEST(a_ball_under_a_plate);
    TEST(small_motions);
    TEST(small_motions_of_rolling_are_refused);
    TEST(one_of_two_directions);
    TEST(friction_without_slip_is_refused);
    TEST(index_3_is_refused);
    return check_report();
}
