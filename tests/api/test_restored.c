/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 8 */
/* States of a stepper are set, saved, restored and copied to the bit; parameters change, and stops are met. */
#include "four_bar_text.h"
#include "sampled.h"
#include "sanitized.h"

static void check_equal(const kempe_stepper *a, const kempe_stepper *b, int n)
{
    CHECK(kempe_stepper_time(a) == kempe_stepper_time(b));
    CHECK(memcmp(kempe_stepper_q(a), kempe_stepper_q(b), (size_t)n * sizeof(double)) == 0);
    CHECK(memcmp(kempe_stepper_qd(a), kempe_stepper_qd(b), (size_t)n * sizeof(double)) == 0);
    CHECK(memcmp(kempe_stepper_qdd(a), kempe_stepper_qdd(b), (size_t)n * sizeof(double)) == 0);
}

/* A four-bar whose coordinates are exchanged as it turns, with a torque that switches. */
static const char switching[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\ninputs: {u: {default: 0.2, unit: N*m}}\n" FOUR_BAR_TEXT
    "forces: {motor: {joint: A, torque: \"if(sin(q(A)) > 0, 3 + u, u - 1) - 0.3*qd(A)\"}}\n"
    "start: {q: {A: 0.5, C: 0.5, R: 1.5}, qd: {A: 6}}\n";

/* `samples`: inputs jump before the state is saved, so that another method stands in for a multistep method. */
static void restored(const method *m, int samples)
{
    loaded s = load_text(switching);
    int n = kempe_model_coordinate_count(s.model);
    kempe_stepper *a = NULL, *b = NULL;
    kempe_stepper_state *state = NULL;
    kempe_run_options run = options(m, 10, 1e-7);
    double end[2][3];
    run.independent = strcmp(m->formulation, "reduced") == 0 ? "R" : NULL; /* the rocker stops at its dead centres */
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    for (int k = 1; k <= samples; k++)
        CHECK(kempe_stepper_set_input(a, 0, 0.1 * (k % 3)) == KEMPE_OK && kempe_stepper_advance(a, 0.02 * k) == 0);
    CHECK(a && kempe_stepper_advance(a, 0.3) == KEMPE_OK);
    CHECK(kempe_stepper_save(a, &state) == KEMPE_OK);
    kempe_work before = kempe_stepper_work(a);
    CHECK(kempe_stepper_advance(a, 0.61) == KEMPE_OK);
    CHECK(kempe_stepper_set_input(a, 0, 3) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 2) == KEMPE_OK);
    if (strcmp(m->formulation, "reduced") == 0)
        CHECK(kempe_stepper_work(a).exchanges > before.exchanges);
    memcpy(end[0], kempe_stepper_q(a), sizeof end[0]);
    CHECK(kempe_stepper_restore(a, state) == KEMPE_OK);
    CHECK(kempe_stepper_time(a) == 0.3);
    CHECK(kempe_stepper_copy(a, &b) == KEMPE_OK);
    CHECK(kempe_stepper_restore(a, state) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 0.61) == KEMPE_OK);
    CHECK(kempe_stepper_set_input(a, 0, 3) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 2) == KEMPE_OK);
    memcpy(end[1], kempe_stepper_q(a), sizeof end[1]);
    CHECK(memcmp(end[0], end[1], sizeof end[0]) == 0);
    CHECK(kempe_stepper_reset(a) == KEMPE_OK && kempe_stepper_time(a) == 0);
    kempe_stepper_free(b);
    b = NULL;
    CHECK(kempe_stepper_new(s.system, &run, &b) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 1) == KEMPE_OK && kempe_stepper_advance(b, 1) == KEMPE_OK);
    check_equal(a, b, n);
    kempe_stepper_state_free(state);
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    unload(&s);
}

static void saved_and_restored(void)
{
    for (int m = 0; m < METHODS; m++)
        for (int samples = 0; samples <= 10; samples += 10)
            restored(&methods[m], samples);
}

/* States that are saved one after another at one time are one state: each is followed by the same bits, and the row
 * stays what it was. */
static void saved_twice(void)
{
    loaded s = load_text(switching);
    int n = kempe_model_coordinate_count(s.model);
    size_t size = (size_t)n * sizeof(double);
    for (int m = 0; m < METHODS; m++)
        for (int samples = 0; samples <= 10; samples += 10) {
            kempe_stepper *a = NULL, *b = NULL;
            kempe_stepper_state *state[3] = {NULL};
            kempe_run_options run = options(&methods[m], 10, 1e-7);
            double end[4][3], q[3];
            CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
            for (int k = 1; k <= samples; k++)
                CHECK(kempe_stepper_set_input(a, 0, 0.1 * (k % 3)) == 0 && kempe_stepper_advance(a, 0.02 * k) == 0);
            CHECK(kempe_stepper_advance(a, 0.3) == KEMPE_OK);
            memcpy(q, kempe_stepper_q(a), size);
            for (int k = 0; k < 3; k++)
                CHECK(kempe_stepper_save(a, &state[k]) == KEMPE_OK);
            CHECK(memcmp(q, kempe_stepper_q(a), size) == 0);
            for (int k = 0; k < 4; k++) {
                CHECK(k == 0 || kempe_stepper_restore(a, state[k - 1]) == KEMPE_OK);
                CHECK(memcmp(q, kempe_stepper_q(a), size) == 0);
                CHECK(kempe_stepper_advance(a, 0.8) == KEMPE_OK);
                memcpy(end[k], kempe_stepper_q(a), size);
                CHECK(memcmp(end[k], end[0], size) == 0);
            }
            CHECK(kempe_stepper_restore(a, state[0]) == KEMPE_OK && kempe_stepper_copy(a, &b) == KEMPE_OK);
            CHECK(kempe_stepper_advance(b, 0.8) == KEMPE_OK && memcmp(end[0], kempe_stepper_q(b), size) == 0);
            for (int k = 0; k < 3; k++)
                kempe_stepper_state_free(state[k]);
            kempe_stepper_free(a);
            kempe_stepper_free(b);
        }
    unload(&s);
}

/* The coordinate at the end of 2 s; a step ends at the stop. */
static double finish(kempe_stepper *stepper)
{
    bool met = false;
    for (int k = 0; k < 10000 && kempe_stepper_time(stepper) < 1.5; k++) {
        CHECK(kempe_stepper_step(stepper) == KEMPE_OK);
        met = met || kempe_stepper_time(stepper) == 0.7654321;
    }
    CHECK(met);
    CHECK(kempe_stepper_advance(stepper, 2) == KEMPE_OK);
    return kempe_stepper_q(stepper)[0];
}

/* Samples of three methods, steps of one length or by the error, and a stop: what follows a restored state, in the
 * stepper itself and in another one, is to the bit what followed the saved one. */
static void samples_and_stops_restored(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\ninputs:\n"
        "  held: {t: [0, 0.31, 0.47, 0.9, 1.3], value: [0, 2, -1, 3, 0], method: hold, unit: N*m}\n"
        "  bent: {t: [0.2, 0.5, 1.1], value: [0, 1, -1], method: linear, unit: N*m}\n"
        "  smooth: {t: [0, 0.4, 0.8, 1.2, 1.6], value: [0, 1, 0, -1, 0], method: cubic, unit: N*m}\n"
        "  free: {unit: N*m}\n"
        "bodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0, -1, 0]}}\n"
        "forces: {motor: {joint: A, torque: held + bent + smooth + free}}\nstart: {q: {A: 1}}\n";
    loaded s = load_text(text);
    for (int m = 0; m < METHODS; m++)
        for (int fixed = 0; fixed < 2; fixed++) {
            kempe_stepper *a = NULL, *b = NULL;
            kempe_stepper_state *state = NULL;
            kempe_run_options run = options(&methods[m], 2, 1e-7);
            double end[2];
            run.fixed_step = fixed ? 0.01 : 0;
            if (fixed && strncmp(methods[m].integrator, "dop", 3) != 0)
                continue;
            CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK && kempe_stepper_new(s.system, &run, &b) == 0);
            CHECK(kempe_stepper_set_input(a, 3, 0.5) == KEMPE_OK && kempe_stepper_advance(a, 0.333) == KEMPE_OK);
            CHECK(kempe_stepper_set_stop(a, 0.7654321) == KEMPE_OK && kempe_stepper_save(a, &state) == KEMPE_OK);
            end[0] = finish(a);
            CHECK(kempe_stepper_restore(a, state) == KEMPE_OK && kempe_stepper_restore(b, state) == KEMPE_OK);
            CHECK(kempe_stepper_input(b, 3) == 0.5);
            end[1] = finish(a);
            CHECK(memcmp(&end[0], &end[1], sizeof end[0]) == 0);
            end[1] = finish(b);
            CHECK(memcmp(&end[0], &end[1], sizeof end[0]) == 0);
            kempe_stepper_state_free(state);
            kempe_stepper_free(a);
            kempe_stepper_free(b);
        }
    unload(&s);
}

/* Two copies that are given equal inputs stay equal; with another input they differ. */
static void copies(void)
{
    loaded s = load_text(switching);
    kempe_stepper *a = NULL, *b = NULL;
    kempe_run_options run = options(&methods[0], 10, 1e-8);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 0.77) == KEMPE_OK && kempe_stepper_copy(a, &b) == KEMPE_OK);
    for (int k = 1; k <= 50; k++) {
        CHECK(kempe_stepper_set_input(a, 0, k % 7) == KEMPE_OK && kempe_stepper_set_input(b, 0, k % 7) == KEMPE_OK);
        CHECK(kempe_stepper_advance(a, 0.77 + 0.03 * k) == KEMPE_OK);
        CHECK(kempe_stepper_advance(b, 0.77 + 0.03 * k) == KEMPE_OK);
        check_equal(a, b, 3);
    }
    CHECK(kempe_stepper_set_input(b, 0, 9) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 3) == KEMPE_OK && kempe_stepper_advance(b, 3) == KEMPE_OK);
    CHECK(kempe_stepper_q(a)[0] != kempe_stepper_q(b)[0]);
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    unload(&s);
}

/* Another state is closed, and the change is said; one that cannot be closed leaves the stepper as it was. */
static void another_state(void)
{
    loaded s = load_text(switching);
    kempe_stepper *a = NULL;
    kempe_run_options run = options(&methods[0], 10, 1e-8);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK && kempe_stepper_advance(a, 0.4) == KEMPE_OK);
    double q[3], moved = -1;
    memcpy(q, kempe_stepper_q(a), sizeof q);
    CHECK(kempe_stepper_set_state(a, q, NULL, &moved) == KEMPE_OK && moved < 1e-9 && moved >= 0);
    for (int i = 0; i < 3; i++)
        CHECK(kempe_stepper_qd(a)[i] == 0);
    q[0] += 0.1;
    CHECK(kempe_stepper_set_state(a, q, NULL, &moved) == KEMPE_OK && moved > 1e-3 && moved < 0.2);
    CHECK(kempe_stepper_time(a) == 0.4);
    CHECK(kempe_stepper_advance(a, 0.5) == KEMPE_OK);
    q[0] = NAN;
    double before = kempe_stepper_q(a)[0];
    CHECK(kempe_stepper_set_state(a, q, NULL, &moved) == KEMPE_E_FAILED);
    CHECK(kempe_stepper_q(a)[0] == before && kempe_stepper_advance(a, 0.6) == KEMPE_OK);
    kempe_stepper_free(a);
    unload(&s);
}

/* A pendulum whose length doubles at its lowest point; the motion after that is that of a model with the other length
 * from the same state. */
static void other_parameters(void)
{
    static const char text[] = "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {L: 1, m: 2}\nbodies:\n"
                               "  rod: {joint: {name: A, revolute: z, at: ground}, mass: m, com: [0, -L, 0]}\n"
                               "start: {q: {A: 1}}\n";
    loaded s = load_text(text);
    kempe_stepper *a = NULL, *b = NULL;
    kempe_model *longer = NULL;
    kempe_system *other = NULL;
    kempe_run_options run = options(&methods[0], 10, 1e-10);
    const char *const names[] = {"L", "m"}, *const wrong[] = {"K"};
    const double values[] = {2, 5};
    const kempe_setting set[] = {{"L", "2"}, {"m", "5"}};
    double moved = -1;
    CHECK(kempe_model_read_text_set(s.context, text, "model.yaml", set, 2, &longer) == KEMPE_OK);
    CHECK(kempe_system_new(longer, &other) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK && kempe_stepper_new(other, &run, &b) == KEMPE_OK);
    CHECK(kempe_stepper_advance(a, 0.5) == KEMPE_OK && kempe_stepper_advance(b, 0.5) == KEMPE_OK);
    CHECK(kempe_stepper_set_parameters(a, 1, wrong, values, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_set_parameters(a, 1, names, values, &moved) == KEMPE_OK && moved == 0);
    CHECK(kempe_stepper_set_parameters(a, 1, names + 1, values + 1, NULL) == KEMPE_OK);
    CHECK(kempe_stepper_set_state(b, kempe_stepper_q(a), kempe_stepper_qd(a), NULL) == KEMPE_OK);
    for (int k = 1; k <= 10; k++) {
        CHECK(kempe_stepper_advance(a, 0.5 + 0.2 * k) == KEMPE_OK);
        CHECK(kempe_stepper_advance(b, 0.5 + 0.2 * k) == KEMPE_OK);
        CHECK_NEAR(kempe_stepper_q(a)[0], kempe_stepper_q(b)[0], 1e-9);
    }
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    kempe_system_free(other);
    kempe_model_free(longer);
    unload(&s);
}

static void stops(void)
{
    loaded s = load_text(switching);
    kempe_stepper *a = NULL;
    kempe_run_options run = options(&methods[0], 10, 1e-8);
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(kempe_stepper_set_stop(a, 0.123456) == KEMPE_OK);
    bool met = false;
    for (int k = 0; k < 10000 && kempe_stepper_time(a) < 1; k++) {
        CHECK(kempe_stepper_step(a) == KEMPE_OK);
        met = met || kempe_stepper_time(a) == 0.123456;
    }
    CHECK(met);
    CHECK(kempe_stepper_set_stop(a, 0.5) == KEMPE_E_ARGUMENT);
    kempe_stepper_free(a);
    unload(&s);
}

/* -- what is done at an instant -------------------------------------------------------------------------- */

/* Goes to the time in steps of h, whose sums are off the instants by rounding. Before every few steps the state is
 * saved, another motion is made from it, and it is restored; `input` (-1: none) is set to itself. */
static void go(kempe_stepper *stepper, double h, double to, int every, int input)
{
    double t = 0;
    for (int k = 1; k * h < to + 1e-9; k++) {
        kempe_stepper_state *state = NULL;
        t += h;
        if (every > 0 && k % every == 0) {
            CHECK(kempe_stepper_save(stepper, &state) == KEMPE_OK);
            CHECK(kempe_stepper_advance(stepper, t + 0.31 * every) == KEMPE_OK);
            CHECK(kempe_stepper_restore(stepper, state) == KEMPE_OK);
        }
        if (input >= 0)
            CHECK(kempe_stepper_set_input(stepper, input, 0) == KEMPE_OK);
        CHECK(kempe_stepper_advance(stepper, t) == KEMPE_OK);
        CHECK(kempe_stepper_time(stepper) == t);
        kempe_stepper_state_free(state);
    }
}

/* The first coordinate at a time, by every way of going there. */
static void check_ways(const char *text, double to, double expected, double tolerance, int input)
{
    static const double steps[] = {0.1, 0.05, 0.025, 0.01};
    loaded s = load_text(text);
    for (int m = 0; m < METHODS; m++)
        for (int h = 0; h < 4; h++)
            for (int every = 0; every <= 3; every++) {
                kempe_stepper *stepper = NULL;
                kempe_run_options run = options(&methods[m], 4, 1e-8);
                bool exact = strncmp(methods[m].integrator, "dop", 3) == 0;
                CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
                go(stepper, steps[h], to, every, input);
                CHECK_NEAR(kempe_stepper_q(stepper)[0], expected, exact ? tolerance : 1e-4);
                kempe_stepper_free(stepper);
            }
    unload(&s);
}

/* Samples of a state and of an input, and a condition on the time, all at multiples of 0.1 s: each is taken once. From
 * one to the next the acceleration is a constant a, so that x and x' follow from sums. */
static void instants_are_taken_once(void)
{
    static const char text[] =
        "kempe: 1\n"
        "inputs: {u: {t: [0, 0.3, 0.7, 1.1], value: [0, 1, -1, 2], method: hold}, free: {unit: N}}\n"
        "states: {z: {next: 0.5*z + q(x), sample: 0.1}}\n"
        "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
        "forces: {f: {joint: x, force: \"1 + u - z + if(t > 0.7, 1, 0) + free\"}}\n";
    double x = 0, v = 0, z = 0;
    for (int k = 0; k < 20; k++) {
        double u = k < 3 ? 0 : k < 7 ? 1 : k < 11 ? -1 : 2;
        z = 0.5 * z + x;
        double a = 1 + u - z + (k < 7 ? 0 : 1);
        x += 0.1 * v + 0.005 * a;
        v += 0.1 * a;
    }
    check_ways(text, 2, x, 1e-11, 1);
#ifndef SANITIZED /* the calls of the ways above but for the one that sets the input */
    check_ways(text, 2, x, 1e-11, -1);
#endif
}

/* A state that counts how often a falling mass on a spring passes a place, x = cos(2 t): 0 at t = pi/4 + k pi/2. The
 * force is that of the spring alone, so that the count shows. */
static void events_are_taken_once(void)
{
    static const char text[] = "kempe: 1\n"
                               "states: {n: {next: n + 1, when: \"q(x) < 0\"}}\n"
                               "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                               "forces: {f: {joint: x, force: -4*q(x)}}\nstart: {q: {x: 1}}\n";
    loaded s = load_text(text);
    kempe_stepper *stepper = NULL;
    kempe_run_options run = options(&methods[0], 20, 1e-9);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    for (int k = 0; stepper && kempe_stepper_time(stepper) < 20; k++) {
        kempe_stepper_state *state = NULL;
        if (k % 3 < 2) { /* also where a step has ended at the event */
            CHECK(kempe_stepper_save(stepper, &state) == KEMPE_OK);
            CHECK(kempe_stepper_restore(stepper, state) == KEMPE_OK);
        }
        CHECK(kempe_stepper_step(stepper) == KEMPE_OK);
        kempe_stepper_state_free(state);
    }
    CHECK(kempe_stepper_qd(stepper)[1] == 7); /* before 20 s: pi/4 + k pi, k = 0 .. 6 */
    CHECK_NEAR(kempe_stepper_q(stepper)[0], cos(40), 1e-6);
    kempe_stepper_free(stepper);
    unload(&s);
}

/* Static friction of 1 N under a force 2 t: the mass breaks away at 0.5 s, and slips against 0.5 N. By hand, with s
 * since then: x = s^3/3 + s^2/4. The instant itself is saved. */
static void friction_breaks_away_once(void)
{
    static const char text[] =
        "kempe: 1\n"
        "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
        "forces: {f: {joint: x, force: 2*t}, rub: {joint: x, friction: {force: 0.5, static: 1}}}\n";
    loaded s = load_text(text);
    kempe_stepper *stepper = NULL;
    kempe_run_options run = options(&methods[0], 1, 1e-9);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    while (stepper && kempe_stepper_time(stepper) < 1) {
        kempe_stepper_state *state = NULL;
        CHECK(kempe_stepper_save(stepper, &state) == KEMPE_OK);
        CHECK(kempe_stepper_restore(stepper, state) == KEMPE_OK);
        kempe_stepper_state_free(state);
        if (kempe_stepper_step(stepper) != KEMPE_OK)
            break;
    }
    CHECK(kempe_stepper_time(stepper) == 1);
    CHECK_NEAR(kempe_stepper_q(stepper)[0], 1.0 / 24 + 1.0 / 16, 1e-10);
    kempe_stepper_free(stepper);
    unload(&s);
}

int main(void)
{
    TEST(saved_and_restored);
    TEST(saved_twice);
    TEST(samples_and_stops_restored);
    TEST(instants_are_taken_once);
    TEST(events_are_taken_once);
    TEST(friction_breaks_away_once);
    TEST(copies);
    TEST(another_state);
    TEST(other_parameters);
    TEST(stops);
    return check_report();
}
