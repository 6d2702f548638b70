/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: ensemble */
/* ctest: 3 */
/* Many instances advanced by the caller (kempe/ensemble_stepper.h): they agree with steppers that get the same inputs,
 * and have the same bits for any number of lanes, threads and other instances. Starts between steps, conditions, events
 * that steppers take, motions that fail or end, and what cannot be done. */
#include "loaded.h"
#include <kempe/ensemble_stepper.h>
#include <kempe/output_handles.h>
#include <kempe/stepper.h>
#include <stdlib.h>

enum { MOST = 40, STEPS = 60, WIDTH = 16 };

/* A model and its run: the scattered coordinate begins within `start` of the model's own value. */
typedef struct plan {
    const char *text, *path;
    const char *outputs;
    double step, force, start, rtol;
    int scattered; /* the coordinate */
    int restarts;  /* 1: some instances begin again between steps */
} plan;

/* Outputs of all steps and instances. */
typedef struct record {
    int values;
    double *x; /* STEPS x MOST x values */
    int single, ended;
    char reason[256];
} record;

static double number(int step, int k)
{
    return sin(12.9898 * step + 78.233 * k + 1) * cos(4.1414 * k * k + step);
}

static loaded load_plan(const plan *p)
{
    return p->text ? load_text(p->text) : load(p->path);
}

/* The start of instance k at a step. */
static void start_of(const loaded *l, const plan *p, int step, int k, const double *own, double *q, double *qd)
{
    const int n = kempe_model_coordinate_count(l->model);
    memcpy(q, own, (size_t)n * sizeof *q);
    memcpy(qd, own + n, (size_t)n * sizeof *qd);
    q[p->scattered] += p->start * number(step, k);
}

static bool begins_again(const plan *p, int step, int k)
{
    return p->restarts && step > 0 && (7 * step + k) % 31 == 0;
}

/* The model's start: q, then qd. */
static void own_start(const loaded *l, double t_end, double own[64])
{
    const kempe_run_options run = {.t_end = t_end};
    const int n = kempe_model_coordinate_count(l->model);
    kempe_stepper *stepper = NULL;
    CHECK(kempe_stepper_new(l->system, &run, &stepper) == KEMPE_OK);
    memcpy(own, kempe_stepper_q(stepper), (size_t)n * sizeof *own);
    memcpy(own + n, kempe_stepper_qd(stepper), (size_t)n * sizeof *own);
    kempe_stepper_free(stepper);
}

static record new_record(int values)
{
    record r = {.values = values, .x = calloc((size_t)STEPS * MOST * (size_t)values, sizeof(double))};
    CHECK(r.x != NULL);
    return r;
}

static double *place(const record *r, int step, int k)
{
    return r->x + ((size_t)step * MOST + (size_t)k) * (size_t)r->values;
}

/* Runs instances first .. first + count - 1. Those that have ended stay. */
static record run(const plan *p, int first, int count, int lanes, int threads)
{
    loaded l = load_plan(p);
    const kempe_run_options options = {.t_end = 1000, .rtol = p->rtol, .threads = threads};
    double own[64], q[32], qd[32], t[MOST], began[MOST] = {0}, force[MOST];
    bool over[MOST] = {false};
    int ended = 0;
    kempe_ensemble_stepper *s = NULL;
    own_start(&l, 1000, own);
    CHECK(kempe_ensemble_stepper_new(l.model, &options, count, lanes, p->outputs, &s) == KEMPE_OK);
    CHECK(kempe_ensemble_stepper_count(s) == count);
    CHECK((lanes >= 0) == (*kempe_ensemble_stepper_no_lanes(s) == '\0'));
    record r = new_record(kempe_ensemble_stepper_value_count(s));
    double *values = calloc((size_t)count * (size_t)r.values, sizeof *values);
    for (int step = 0; step < STEPS; step++) {
        for (int k = 0; k < count; k++) {
            if (step == 0 || begins_again(p, step, first + k)) {
                start_of(&l, p, step, first + k, own, q, qd);
                CHECK(kempe_ensemble_stepper_begin(s, k, q, qd) == KEMPE_OK);
                CHECK(kempe_ensemble_stepper_time(s, k) == 0);
                began[k] = step;
                ended -= over[k];
                over[k] = false;
            }
            t[k] = over[k] ? NAN : p->step * (step + 1 - began[k]);
            force[k] = p->force * number(step, first + k);
        }
        const int input = 0;
        CHECK(kempe_ensemble_stepper_advance(s, t, 1, &input, force, values) == KEMPE_OK);
        for (int k = 0; k < count; k++) {
            memcpy(place(&r, step, first + k), values + k * r.values, (size_t)r.values * sizeof *values);
            r.single += *kempe_ensemble_stepper_single(s, k) != '\0';
            if (over[k])
                continue;
            over[k] = kempe_ensemble_stepper_outcome(s, k) != KEMPE_OUTCOME_NOT_CHECKED;
            CHECK(over[k] || kempe_ensemble_stepper_time(s, k) == t[k]);
            CHECK(over[k] == (*kempe_ensemble_stepper_reason(s, k) != '\0'));
            if (over[k])
                (void)snprintf(r.reason, sizeof r.reason, "%s", kempe_ensemble_stepper_reason(s, k));
            r.ended += over[k];
            ended += over[k];
        }
        CHECK(kempe_ensemble_stepper_ended_count(s) == ended);
    }
    free(values);
    kempe_ensemble_stepper_free(s);
    unload(&l);
    return r;
}

/* The same by steppers of the public interface. */
static record run_steppers(const plan *p, int count)
{
    loaded l = load_plan(p);
    const kempe_run_options options = {.t_end = 1000, .rtol = p->rtol};
    double own[64], q[32], qd[32];
    kempe_outputs *outputs = NULL;
    own_start(&l, 1000, own);
    CHECK(kempe_outputs_new(l.system, p->outputs, &outputs) == KEMPE_OK);
    record r = new_record(kempe_outputs_count(outputs));
    for (int k = 0; k < count; k++) {
        kempe_stepper *stepper = NULL;
        int began = 0;
        bool over = false;
        CHECK(kempe_stepper_new(l.system, &options, &stepper) == KEMPE_OK);
        for (int step = 0; step < STEPS; step++) {
            if (step == 0 || begins_again(p, step, k)) {
                start_of(&l, p, step, k, own, q, qd);
                CHECK(kempe_stepper_reset(stepper) == KEMPE_OK);
                CHECK(kempe_stepper_set_state(stepper, q, qd, NULL) == KEMPE_OK);
                began = step;
                over = false;
            }
            if (!over) {
                CHECK(kempe_stepper_set_input(stepper, 0, p->force * number(step, k)) == KEMPE_OK);
                over = kempe_stepper_advance(stepper, p->step * (step + 1 - began)) != KEMPE_OK;
                r.ended += over;
            }
            if (over)
                (void)snprintf(r.reason, sizeof r.reason, "%s", kempe_stepper_reason(stepper));
            CHECK(kempe_outputs_at_stepper(outputs, stepper, place(&r, step, k)) == KEMPE_OK);
        }
        kempe_stepper_free(stepper);
    }
    kempe_outputs_free(outputs);
    unload(&l);
    return r;
}

static bool same(const record *a, const record *b, int first, int count)
{
    for (int step = 0; step < STEPS; step++)
        if (memcmp(place(a, step, first), place(b, step, first), (size_t)(count * a->values) * sizeof(double)) != 0)
            return false;
    return true;
}

/* The largest difference over the largest value of its output. */
static double apart(const record *a, const record *b, int count)
{
    double worst = 0;
    for (int v = 0; v < a->values; v++) {
        double off = 0, size = 1e-3;
        for (int step = 0; step < STEPS; step++)
            for (int k = 0; k < count; k++) {
                off = check_max(off, fabs(place(a, step, k)[v] - place(b, step, k)[v]));
                size = check_max(size, fabs(place(b, step, k)[v]));
            }
        worst = check_max(worst, off / size);
    }
    return worst;
}

/* All ways to run a plan have the same bits, which agree with steppers up to `near`. */
static record compare(const plan *p, double near)
{
    record first = run(p, 0, MOST, 0, 1), single = run_steppers(p, MOST);
    const double off = apart(&first, &single, MOST);
    CHECK(off < near);
    if (!(off < near))
        printf("off by %.3g\n", off);
    CHECK(first.ended == single.ended);
    static const int ways[][4] = {{0, MOST, 1, 1},     {0, MOST, WIDTH, 2}, {0, MOST, 3, 3}, {0, MOST, 8, 1},
                                  {5, MOST - 9, 4, 1}, {17, 1, 0, 1},       {3, 20, 0, 2}};
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        record other = run(p, ways[k][0], ways[k][1], ways[k][2], ways[k][3]);
        CHECK(same(&first, &other, ways[k][0], ways[k][1]));
        free(other.x);
    }
    record steppers = run(p, 0, MOST, -1, 2);
    CHECK(same(&steppers, &single, 0, MOST));
    free(steppers.x);
    free(single.x);
    return first;
}

/* -- motions ----------------------------------------------------------------------------------------- */

static void a_cart_with_a_linkage(void)
{
    const plan p = {.path = "tests/models/cart_and_linkage.yaml",
                    .outputs = "q, qd, qdd, lambda, position(bar.end)",
                    .step = 0.005,
                    .force = 15,
                    .start = 0.2,
                    .rtol = 1e-9,
                    .scattered = 1,
                    .restarts = 1};
    record r = compare(&p, 1e-6);
    CHECK(r.single == 0 && r.ended == 0);
    free(r.x);
}

/* The linkage falls through its change point, where all bars are in line: lanes leave these steps to steppers, and take
 * the instances back. Its multipliers are not determined there. */
static void a_linkage_that_falls(void)
{
    const plan p = {.path = "tests/models/cart_and_linkage.yaml",
                    .outputs = "q, qd, position(bar.end)",
                    .step = 0.02,
                    .force = 15,
                    .start = 0.2,
                    .rtol = 1e-9,
                    .scattered = 1,
                    .restarts = 1};
    record r = compare(&p, 1e-6);
    CHECK(r.single > 0 && r.single < STEPS * MOST / 4 && r.ended == 0);
    free(r.x);
}

static const char *const CRANK =
    "kempe: 1\n"
    "name: crank with a motor\n"
    "gravity: [0, -9.81, 0]\n"
    "inputs: {u: {unit: N*m}}\n"
    "bodies:\n"
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.1, 0, 0], inertia: {zz: 0.01}, points: {B: "
    "[0.2, 0, 0]}}\n"
    "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 0.5, com: [0.3, 0, 0], inertia: {zz: 0.02}, points: {C: "
    "[0.6, 0, 0]}}\n"
    "  slider: {joint: {name: S, prismatic: x, at: ground}, mass: 1, points: {C: [0, 0, 0]}}\n"
    "loops: {C: {ball: [rod.C, slider.C]}}\n"
    "forces:\n"
    "  motor: {joint: A, torque: u}\n"
    "  buffer: {joint: S, force: \"if(q(S) > 0.7, -3000*(q(S) - 0.7), 0)\"}\n"
    "start: {q: {A: 60 deg, B: -77 deg, S: 0.68}, hold: [A], qd: {A: 12}}\n"
    "run: {t_end: 2}\n";

/* Each instance turns through exchanges of coordinates, and meets the spring. */
static void a_crank_that_turns_to_a_spring(void)
{
    const plan p = {
        .text = CRANK, .outputs = "q, qd", .step = 0.05, .force = 5, .start = 0.5, .rtol = 1e-10, .restarts = 1};
    record r = compare(&p, 1e-5);
    CHECK(r.ended == 0);
    free(r.x);
}

/* The condition of a force depends on the input, which jumps at the beginning of each step. */
static void a_condition_of_an_input(void)
{
    const plan p = {.text = "kempe: 1\n"
                            "name: clutch\n"
                            "inputs: {u: {unit: N}}\n"
                            "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                            "forces:\n"
                            "  drive: {joint: x, force: \"if(u > 0.3, 4*u, -20*q(x) - u)\"}\n"
                            "  stop: {joint: x, force: \"if(q(x) > 0.4, -900*(q(x) - 0.4), 0)\"}\n"
                            "run: {t_end: 2}\n",
                    .outputs = "q, qd, qdd",
                    .step = 0.1,
                    .force = 2,
                    .start = 0.3,
                    .rtol = 1e-10};
    record r = compare(&p, 1e-6);
    CHECK(r.ended == 0);
    free(r.x);
}

/* A motion that ends by a condition, and others that go on. */
static void an_end_by_a_condition(void)
{
    const plan p = {.text = "kempe: 1\n"
                            "name: limited\n"
                            "inputs: {u: {unit: N}}\n"
                            "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                            "forces: {drive: {joint: x, force: u - q(x)}}\n"
                            "run: {t_end: 2, until: q(x) > 0.4}\n",
                    .outputs = "q, qd",
                    .step = 0.1,
                    .force = 3,
                    .start = 0.5,
                    .rtol = 1e-9};
    record r = compare(&p, 1e-6);
    CHECK(r.ended > 0 && r.ended < MOST && strstr(r.reason, "q(x) > 0.4"));
    free(r.x);
}

/* A motion that fails in the middle of a step stays where the step began. */
static void a_failure_of_some(void)
{
    const plan p = {.text = "kempe: 1\n"
                            "name: root\n"
                            "inputs: {u: {unit: N}}\n"
                            "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                            "forces: {drive: {joint: x, force: \"2*u*sqrt(1.2 - q(x))\"}}\n"
                            "run: {t_end: 2}\n",
                    .outputs = "q, qd",
                    .step = 0.1,
                    .force = 3,
                    .start = 1,
                    .rtol = 1e-9};
    record r = compare(&p, 1e-5);
    CHECK(r.ended > 0 && r.ended < MOST && *r.reason);
    free(r.x);
}

/* -- compliant contacts ------------------------------------------------------------------------------ */

/* Balls that bounce on a compliant floor, some thrown by the input. */
static void a_compliant_contact(void)
{
    const plan p = {.text = "kempe: 1\n"
                            "name: ball\n"
                            "gravity: [0, 0, -9.81]\n"
                            "inputs: {u: {unit: N}}\n"
                            "bodies: {ball: {joint: {name: z, prismatic: z, at: ground}, mass: 1}}\n"
                            "forces: {throw: {joint: z, force: u}}\n"
                            "contacts: {floor: {gap: q(z), law: hunt_crossley, stiffness: 1e5, damping: 0.2}}\n"
                            "start: {q: {z: 0.2}}\n"
                            "run: {t_end: 2}\n",
                    .outputs = "q, qd",
                    .step = 0.02,
                    .force = 3,
                    .start = 0.1,
                    .rtol = 1e-10};
    record r = compare(&p, 1e-5);
    CHECK(r.ended == 0);
    free(r.x);
}

/* -- events that change modes ----------------------------------------------------------------------------- */

/* A ball with impacts. */
static void a_rigid_contact(void)
{
    const plan p = {.text = "kempe: 1\n"
                            "name: ball\n"
                            "gravity: [0, 0, -9.81]\n"
                            "inputs: {u: {unit: N}}\n"
                            "bodies: {ball: {joint: {name: z, prismatic: z, at: ground}, mass: 2}}\n"
                            "forces: {throw: {joint: z, force: u}}\n"
                            "contacts: {floor: {joint: z, lower: 0, restitution: 0.7}}\n"
                            "start: {q: {z: 0.4}}\n"
                            "run: {t_end: 2}\n",
                    .outputs = "q, qd, qdd",
                    .step = 0.02,
                    .force = 12,
                    .start = 0.3,
                    .rtol = 1e-10,
                    .restarts = 1};
    record r = compare(&p, 1e-5);
    CHECK(r.ended == 0 && r.single == 0);
    free(r.x);
}

/* A block on a spring that sticks and slips. */
static void friction_that_sticks(void)
{
    const plan p = {.text = "kempe: 1\n"
                            "name: block\n"
                            "inputs: {u: {unit: N}}\n"
                            "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                            "forces:\n"
                            "  spring: {joint: x, spring: {stiffness: 100}}\n"
                            "  push: {joint: x, force: u}\n"
                            "  rub: {joint: x, friction: {force: 3, static: 4}}\n"
                            "start: {q: {x: 0.1}}\n"
                            "run: {t_end: 2}\n",
                    .outputs = "q, qd, qdd, force(rub)",
                    .step = 0.03,
                    .force = 9,
                    .start = 0.1,
                    .rtol = 1e-10,
                    .restarts = 1};
    record r = compare(&p, 1e-5);
    CHECK(r.ended == 0);
    free(r.x);
}

/* A sampled controller, whose samples are at ends of steps and between them, and a force that depends on the load. */
static void samples_and_loads(void)
{
    const plan slide = {.text = "kempe: 1\n"
                                "name: slide\n"
                                "inputs: {wish: {}}\n"
                                "states:\n"
                                "  u: {sample: 0.05, next: \"-30*(q(x) - wish) - 4*qd(x)\"}\n"
                                "  passes: {when: q(x) > 0.2, next: passes + 1}\n"
                                "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                                "forces: {motor: {joint: x, force: \"u - 0.2*qd(x)\"}}\n"
                                "start: {q: {x: 0.1}}\n"
                                "run: {t_end: 2}\n",
                        .outputs = "q, qd, qdd, state",
                        .step = 0.025,
                        .force = 1,
                        .start = 0.1,
                        .rtol = 1e-10,
                        .restarts = 1};
    record r = compare(&slide, 1e-6);
    CHECK(r.ended == 0 && r.single == 0);
    free(r.x);
}

/* -- calls ------------------------------------------------------------------------------------------- */

/* Models that steppers run alone say why, and have their bits. */
static void models_without_lanes(void)
{
    loaded l = load("tests/models/contact_bounce.yaml");
    const kempe_run_options run_options = {.t_end = 1, .integrator = "radau"}, fixed = {.t_end = 1, .fixed_step = 0.01};
    kempe_ensemble_stepper *s = NULL;
    kempe_stepper *stepper = NULL;
    const double t[2] = {0.7, 0.3};
    double values[16];
    CHECK(kempe_ensemble_stepper_new(l.model, &run_options, 2, 0, "q, qd", &s) == KEMPE_OK);
    CHECK_TEXT(kempe_ensemble_stepper_no_lanes(s), "another integrator");
    CHECK(kempe_stepper_new(l.system, &run_options, &stepper) == KEMPE_OK);
    for (int k = 0; k < 2; k++)
        CHECK(kempe_ensemble_stepper_begin(s, k, NULL, NULL) == KEMPE_OK);
    CHECK(kempe_ensemble_stepper_advance(s, t, 0, NULL, NULL, values) == KEMPE_OK);
    CHECK(*kempe_ensemble_stepper_single(s, 0) && kempe_ensemble_stepper_time(s, 1) == 0.3);
    CHECK(kempe_stepper_advance(stepper, 0.7) == KEMPE_OK);
    const int n = kempe_model_coordinate_count(l.model);
    CHECK(memcmp(kempe_ensemble_stepper_q(s, 0), kempe_stepper_q(stepper), (size_t)n * sizeof(double)) == 0);
    CHECK(memcmp(kempe_ensemble_stepper_qd(s, 0), kempe_stepper_qd(stepper), (size_t)n * sizeof(double)) == 0);
    kempe_stepper_free(stepper);
    kempe_ensemble_stepper_free(s);
    CHECK(kempe_ensemble_stepper_new(l.model, &fixed, 2, 0, "q", &s) == KEMPE_OK);
    CHECK_TEXT(kempe_ensemble_stepper_no_lanes(s), "steps of constant length");
    kempe_ensemble_stepper_free(s);
    unload(&l);
}

/* Stability limits the steps of lanes: the stepper of the next step may choose another integrator, unless the user has
 * chosen this one. */
static void a_stiff_motion(void)
{
    loaded l = load_text("kempe: 1\n"
                         "name: stiff\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {spring: {joint: x, force: \"-1e4*q(x) - 2e4*qd(x) + sin(t)\"}}\n"
                         "run: {t_end: 2}\n");
    const kempe_run_options open = {.t_end = 1, .rtol = 1e-8},
                            chosen = {.t_end = 1, .rtol = 1e-8, .integrator = "dop853"};
    double q[2];
    for (int k = 0; k < 2; k++) {
        kempe_ensemble_stepper *s = NULL;
        CHECK(kempe_ensemble_stepper_new(l.model, k ? &chosen : &open, 1, 0, "q", &s) == KEMPE_OK);
        for (int episode = 0; episode < 2; episode++) {
            CHECK(kempe_ensemble_stepper_begin(s, 0, NULL, NULL) == KEMPE_OK);
            CHECK(kempe_ensemble_stepper_advance(s, (const double[1]){0.2}, 0, NULL, NULL, NULL) == KEMPE_OK);
            CHECK(k == 0 || *kempe_ensemble_stepper_single(s, 0) == '\0');
            for (int step = 2; step <= 4; step++)
                CHECK(kempe_ensemble_stepper_advance(s, (const double[1]){0.2 * step}, 0, NULL, NULL, NULL) ==
                      KEMPE_OK);
            CHECK((strstr(kempe_ensemble_stepper_single(s, 0), "many steps") != NULL) == (k == 0));
            q[k] = kempe_ensemble_stepper_q(s, 0)[0];
            CHECK(kempe_ensemble_stepper_outcome(s, 0) == KEMPE_OUTCOME_NOT_CHECKED);
        }
        kempe_ensemble_stepper_free(s);
    }
    CHECK(fabs(q[0] - q[1]) < 1e-9);
    unload(&l);
}

/* Instances begin and stay at their own times. An interrupted step leaves them where they were, and then has the same
 * bits. */
static void times_and_interrupts(void)
{
    loaded l = load("tests/models/cart_and_linkage.yaml");
    const kempe_run_options run_options = {.t_end = 1, .rtol = 1e-9, .threads = 1};
    kempe_ensemble_stepper *s = NULL;
    const int input = 0, n = kempe_model_coordinate_count(l.model);
    const double values[3] = {1, 2, 3}, infinite[3] = {1, INFINITY, 3};
    double first[3] = {0.01, NAN, 0.02}, t[3] = {0.05, 0.03, NAN}, before[4], after[4], outputs[24] = {0};
    CHECK(kempe_ensemble_stepper_new(l.model, &run_options, 3, 0, "q, qd", &s) == KEMPE_OK);
    CHECK(kempe_ensemble_stepper_new(l.model, &run_options, 0, 0, "q", &s) == KEMPE_E_ARGUMENT);
    CHECK(kempe_ensemble_stepper_new(l.model, &run_options, 1, 99, "q", &s) == KEMPE_E_ARGUMENT);
    CHECK(kempe_ensemble_stepper_new(l.model, &run_options, 1, 0, "q, nothing", &s) == KEMPE_E_ARGUMENT);
    CHECK(kempe_ensemble_stepper_value_count(s) == 2 * n);
    CHECK_TEXT(kempe_ensemble_stepper_value_name(s, 1), "q.phi");
    CHECK(!kempe_ensemble_stepper_value_name(s, 2 * n));
    CHECK(kempe_ensemble_stepper_advance(s, first, 0, NULL, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_context_message(l.context), "instance 0 has not begun"));
    CHECK(kempe_ensemble_stepper_begin(s, 3, NULL, NULL) == KEMPE_E_ARGUMENT);
    for (int k = 0; k < 3; k++)
        CHECK(kempe_ensemble_stepper_begin(s, k, NULL, NULL) == KEMPE_OK);
    const double open[4] = {0, 0.1, 2.5, 9};
    double moved[4];
    memcpy(before, kempe_ensemble_stepper_q(s, 0), sizeof before);
    memcpy(moved, before, sizeof moved);
    moved[1] += 0.05;
    CHECK(kempe_ensemble_stepper_begin(s, 0, open, NULL) == KEMPE_OK ||
          memcmp(before, kempe_ensemble_stepper_q(s, 0), sizeof before) == 0);
    CHECK(kempe_ensemble_stepper_begin(s, 0, moved, NULL) == KEMPE_OK);
    CHECK_NEAR(kempe_ensemble_stepper_q(s, 0)[2], moved[1], 0.1);
    CHECK(kempe_ensemble_stepper_advance(s, first, 1, &input, values, outputs) == KEMPE_OK);
    CHECK(outputs[1] != 0 && outputs[2 * n + 1] == 0 && kempe_ensemble_stepper_time(s, 1) == 0);
    CHECK(kempe_ensemble_stepper_advance(s, t, 1, &input, infinite, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_ensemble_stepper_advance(s, t, 1, (const int[1]){5}, values, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_ensemble_stepper_advance(s, (const double[3]){0.5, 0.5, 0.01}, 0, NULL, NULL, NULL) ==
          KEMPE_E_ARGUMENT);
    CHECK(kempe_ensemble_stepper_advance(s, (const double[3]){0.5, 0.5, 1.1}, 0, NULL, NULL, NULL) == KEMPE_E_ARGUMENT);
    memcpy(before, kempe_ensemble_stepper_q(s, 0), sizeof before);
    kempe_context_interrupt(l.context);
    CHECK(kempe_ensemble_stepper_advance(s, t, 1, &input, values, NULL) == KEMPE_STOPPED);
    CHECK(kempe_ensemble_stepper_time(s, 0) == 0.01 && kempe_ensemble_stepper_time(s, 1) == 0);
    CHECK(kempe_ensemble_stepper_outcome(s, 0) == KEMPE_OUTCOME_STOPPED);
    CHECK(memcmp(before, kempe_ensemble_stepper_q(s, 0), sizeof before) == 0);
    CHECK(kempe_ensemble_stepper_advance(s, t, 1, &input, values, NULL) == KEMPE_OK);
    memcpy(after, kempe_ensemble_stepper_q(s, 0), sizeof after);
    CHECK(kempe_ensemble_stepper_time(s, 0) == 0.05 && kempe_ensemble_stepper_time(s, 2) == 0.02);
    CHECK(kempe_ensemble_stepper_begin(s, 0, moved, NULL) == KEMPE_OK);
    CHECK(kempe_ensemble_stepper_advance(s, (const double[3]){0.01, NAN, NAN}, 1, &input, values, NULL) == KEMPE_OK);
    CHECK(kempe_ensemble_stepper_advance(s, (const double[3]){0.05, NAN, NAN}, 1, &input, values, NULL) == KEMPE_OK);
    CHECK_NEAR(kempe_ensemble_stepper_q(s, 0)[0], after[0], 1e-9);
    kempe_ensemble_stepper_free(s);
    unload(&l);
}

/* Outputs at a state have the model's inputs, also after outputs at a stepper with others. */
static void outputs_after_a_stepper(void)
{
    loaded l = load_text("kempe: 1\n"
                         "name: driven\n"
                         "inputs: {u: {unit: N}}\n"
                         "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {drive: {joint: x, force: u}}\n"
                         "run: {t_end: 2}\n");
    const kempe_run_options run_options = {.t_end = 1};
    kempe_stepper *stepper = NULL;
    kempe_outputs *outputs = NULL;
    const double q = 0, qd = 0;
    double value = NAN;
    CHECK(kempe_outputs_new(l.system, "force(drive)", &outputs) == KEMPE_OK);
    CHECK(kempe_stepper_new(l.system, &run_options, &stepper) == KEMPE_OK);
    CHECK(kempe_stepper_set_input(stepper, 0, 7) == KEMPE_OK);
    CHECK(kempe_stepper_advance(stepper, 0.5) == KEMPE_OK);
    CHECK(kempe_outputs_at_stepper(outputs, stepper, &value) == KEMPE_OK);
    CHECK(value == 7);
    CHECK(kempe_outputs_at_state(outputs, 0.5, &q, &qd, NULL, NULL, &value) == KEMPE_OK);
    CHECK(value == 0);
    kempe_outputs_free(outputs);
    kempe_stepper_free(stepper);
    unload(&l);
}

int main(void)
{
    TEST(a_cart_with_a_linkage);
    TEST(a_linkage_that_falls);
    TEST(a_crank_that_turns_to_a_spring);
    TEST(a_condition_of_an_input);
    TEST(an_end_by_a_condition);
    TEST(a_failure_of_some);
    TEST(a_compliant_contact);
    TEST(a_rigid_contact);
    TEST(friction_that_sticks);
    TEST(samples_and_loads);
    TEST(models_without_lanes);
    TEST(a_stiff_motion);
    TEST(times_and_interrupts);
    TEST(outputs_after_a_stepper);
    return check_report();
}
