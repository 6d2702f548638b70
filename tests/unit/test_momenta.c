/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Momenta: p.v + L.w of all bodies is twice the kinetic energy, on examples with every kind of link; sums of bodies and
 * other points by their definitions; conserved without external forces, else changed as these say. */
#include "loaded.h"
#include "model/data/model.h"
#include <kempe/output_handles.h>
#include <kempe/table.h>
#include <stdlib.h>

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The values of words at a state; the caller frees them. */
static double *values_of(const loaded *l, const char *words, const double *q, const double *qd, const double *qdd)
{
    kempe_outputs *o = NULL;
    if (kempe_outputs_new(l->system, words, &o) != KEMPE_OK)
        printf("%s: %s\n", words, kempe_context_message(l->context));
    CHECK(o != NULL);
    double *values = calloc((size_t)kempe_outputs_count(o) + 1, sizeof *values);
    CHECK(kempe_outputs_at_state(o, 0.25, q, qd, qdd, NULL, values) == KEMPE_OK);
    kempe_outputs_free(o);
    return values;
}

/* Any state: the loops need not be closed. */
static void any_state(int n, double *q, double *qd)
{
    for (int k = 0; k < n; k++) {
        q[k] = 0.3 * sin(1.0 + 2.3 * k);
        qd[k] = 0.8 * cos(0.4 + 1.7 * k);
    }
}

/* A point of a body; NULL: it has none. */
static const char *point_of(const kempe_model *model, int body)
{
    for (int k = 0; k < model->point_count; k++)
        if (model->points[k].body == body)
            return model->points[k].name;
    return NULL;
}

/* p.p / m + L.w over bodies, which are all that have a mass and a point to see their angular velocity by. */
static double twice_kinetic(const loaded *l, const double *q, const double *qd, double *momentum)
{
    double sum = 0;
    for (int b = 1; b < l->model->body_count; b++) {
        const char *name = l->model->bodies[b].name, *point = point_of(l->model, b);
        double mass = l->model->bodies[b].mass.value;
        char words[256];
        (void)snprintf(words, sizeof words, "momentum(%s), angular_momentum(%s)%s%s%s%s%s", name, name,
                       point ? ", angular_velocity(" : "", point ? name : "", point ? "." : "", point ? point : "",
                       point ? ")" : "");
        double *x = values_of(l, words, q, qd, NULL);
        sum += mass > 0 ? dot(x, x) / mass : 0;
        if (point)
            sum += dot(x + 3, x + 6);
        else
            CHECK(dot(x + 3, x + 3) <= 0);
        for (int k = 0; k < 3; k++)
            momentum[k] += x[k];
        free(x);
    }
    return sum;
}

static const char *const examples[] = {"andrews/andrews",
                                       "stewart/stewart",
                                       "rolling_wheel/rolling_wheel",
                                       "bogie/bogie",
                                       "delta_robot/delta_robot",
                                       "robot_leg/robot_leg", /* its trunk is fixed */
                                       "governor/governor",
                                       "bricard/bricard",
                                       "driven_slider_crank/driven_slider_crank",
                                       "parallel_robot/parallel_robot_spatial",
                                       "four_bar/four_bar"};

static void energies_agree(void)
{
    for (size_t e = 0; e < sizeof examples / sizeof *examples; e++) {
        char path[256];
        (void)snprintf(path, sizeof path, "examples/%s.yaml", examples[e]);
        loaded l = load(path);
        int n = kempe_model_coordinate_count(l.model);
        double *q = calloc((size_t)n, sizeof *q), *qd = calloc((size_t)n, sizeof *qd), sum[3] = {0};
        any_state(n, q, qd);
        double twice = twice_kinetic(&l, q, qd, sum);
        double *x = values_of(&l, "energy.kinetic, momentum", q, qd, NULL);
        CHECK_NEAR(twice / (2 * x[0]), 1, 1e-12);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(x[1 + k], sum[k], 1e-12 * (1 + fabs(sum[k])));
        free(x), free(q), free(qd);
        unload(&l);
    }
}

/* Two bodies in space with a spring and a rotor inside, a welded part, and a centre of mass off the joint. */
static const char pair[] =
    "kempe: 1\n"
    "gravity: %s\n"
    "ground: {points: {O: [0, 0, 0]}}\n"
    "bodies:\n"
    "  hull: {joint: {name: H, free: x, at: ground}, mass: 3, com: [0.1, -0.2, 0.05],\n"
    "         inertia: {xx: 0.3, yy: 0.5, zz: 0.4, xy: 0.02, xz: -0.03}, points: {C: [0.1, -0.2, 0.05], A: [0.5, 0.1, "
    "0]}}\n"
    "  part: {joint: {name: W, weld: yes, at: hull.A}, mass: 0.7, com: [0, 0.3, 0.1],\n"
    "         inertia: {xx: 0.02, yy: 0.03, zz: 0.01}, points: {C: [0, 0.3, 0.1]}}\n"
    "  rotor: {joint: {name: R, revolute: [1, 2, 2], at: hull.A}, mass: 0.4, com: [0.05, 0.1, 0],\n"
    "          inertia: {xx: 0.05, yy: 0.03, zz: 0.04, yz: 0.01}, points: {C: [0.05, 0.1, 0]}}\n"
    "  other: {joint: {name: O, free: x, at: ground}, mass: 2, inertia: {xx: 0.1, yy: 0.2, zz: 0.15},\n"
    "          points: {C: [0, 0, 0], P: [0.2, 0.1, -0.1]}}\n"
    "forces:\n"
    "  link: {spring: [hull.A, other.P], stiffness: 40, damping: 2, free_length: 0.5}\n"
    "  motor: {joint: R, torque: '0.3*sin(5*t)'}\n"
    "%s"
    "start: {q: {O.1: 1.2, O.2: 0.3, O.3: -0.4}, qd: {H.1: 0.2, H.4: 0.7, H.5: -0.4, H.6: 0.3, O.2: 0.5, O.4: 1.1, R: "
    "9}}\n"
    "run: {t_end: 2, rtol: 1e-12, outputs: [momentum, angular_momentum(rotor about hull.A), 'momentum(rotor)']}\n";

static loaded load_pair(const char *gravity, const char *force)
{
    char text[4096];
    (void)snprintf(text, sizeof text, pair, gravity, force);
    return load_text(text);
}

enum { MOMENTUM = 0, SPIN = 3, ABOUT_ORIGIN = 6, ROTOR = 9, VALUES = 12 };

/* Nothing acts from outside: a spring, a damper, a motor and a rotor inside change nothing. */
static void conserved(void)
{
    loaded l = load_pair("[0, 0, 0]", "");
    kempe_trajectory *t = NULL;
    kempe_outputs *o = NULL;
    double first[VALUES], now[VALUES], change[VALUES] = {0};
    CHECK(kempe_simulate(l.system, NULL, &t) == KEMPE_OK);
    CHECK(kempe_outputs_new(
              l.system,
              "momentum, angular_momentum, angular_momentum(about ground.O), angular_momentum(rotor about hull.A)",
              &o) == KEMPE_OK);
    CHECK(kempe_outputs_count(o) == VALUES);
    CHECK_TEXT(kempe_outputs_name(o, ROTOR), "angular_momentum.rotor.about.hull.A.x");
    CHECK_TEXT(kempe_outputs_name(o, ABOUT_ORIGIN), "angular_momentum.about.ground.O.x");
    CHECK_TEXT(kempe_outputs_name(o, 0), "momentum.x");
    CHECK_TEXT(kempe_outputs_unit(o, SPIN), "N m s");
    CHECK(kempe_outputs_at_row(o, t, 0, first) == KEMPE_OK);
    for (int row = 0; row < kempe_trajectory_row_count(t); row++) {
        CHECK(kempe_outputs_at_row(o, t, row, now) == KEMPE_OK);
        for (int k = 0; k < VALUES; k++)
            change[k] = check_max(change[k], fabs(now[k] - first[k]));
    }
    for (int k = 0; k < ROTOR; k++)
        CHECK_NEAR(change[k], 0, 1e-9);
    CHECK(change[ROTOR] > 0.01 && dot(first, first) > 0.1 && dot(first + SPIN, first + SPIN) > 0.01);
    kempe_outputs_free(o);
    kempe_trajectory_free(t);
    unload(&l);
}

static void add_cross(double *to, const double *a, const double *b)
{
    for (int k = 0; k < 3; k++)
        to[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* Rates of the momentum P, and of L about the origin and about the centre of mass, by gravity and the force at other.P;
 * `centre` is sum m c / sum m. */
static void loads_of(const double *place, double *rate)
{
    static const double mass[] = {3, 0.7, 0.4, 2}, push[3] = {1.5, -2, 4};
    double total = 0, centre[3] = {0};
    for (int b = 0; b < 4; b++) {
        const double weight[3] = {0.5 * mass[b], 0, -9.81 * mass[b]};
        for (int k = 0; k < 3; k++) {
            rate[MOMENTUM + k] += weight[k];
            centre[k] += mass[b] * place[3 * b + k];
        }
        add_cross(rate + ABOUT_ORIGIN, place + 3 * b, weight);
        total += mass[b];
    }
    double arm[3];
    for (int k = 0; k < 3; k++) {
        rate[MOMENTUM + k] += push[k];
        arm[k] = place[12 + k] - centre[k] / total;
    }
    add_cross(rate + SPIN, arm, push);
    add_cross(rate + ABOUT_ORIGIN, place + 12, push);
}

/* Rates by Jacobians at a state and its accelerations are the forces from outside and their moments; so are differences
 * of the values of a run. */
static void driven(void)
{
    static const char words[] = "momentum, angular_momentum, angular_momentum(about ground.O)",
                      places[] =
                          "position(hull.C), position(part.C), position(rotor.C), position(other.C), position(other.P)";
    loaded l = load_pair("[0.5, 0, -9.81]", "  push: {at: other.P, force: [1.5, -2, 4]}\n");
    int n = kempe_model_coordinate_count(l.model);
    const kempe_run_options run = {.output_step = 1e-3, .t_end = 0.01};
    kempe_trajectory *t = NULL;
    kempe_outputs *o = NULL;
    double *j = calloc(9 * (size_t)n, sizeof *j), jdqd[9], rate[9] = {0}, near[5][9];
    CHECK(kempe_simulate(l.system, &run, &t) == KEMPE_OK);
    CHECK(kempe_outputs_new(l.system, words, &o) == KEMPE_OK);
    const double *q = kempe_trajectory_q(t, 5), *qd = kempe_trajectory_qd(t, 5), *qdd = kempe_trajectory_qdd(t, 5);
    double *place = values_of(&l, places, q, NULL, NULL);
    loads_of(place, rate);
    CHECK(kempe_outputs_jacobian(o, kempe_trajectory_time(t, 5), q, qd, j, jdqd) == KEMPE_OK);
    for (int i = 0; i < 5; i++)
        CHECK(kempe_outputs_at_row(o, t, 3 + i, near[i]) == KEMPE_OK);
    for (int i = 0; i < 9; i++) {
        double by_state = jdqd[i];
        for (int k = 0; k < n; k++)
            by_state += j[9 * k + i] * qdd[k];
        CHECK_NEAR(by_state, rate[i], 1e-12);
        CHECK_NEAR((near[0][i] - 8 * near[1][i] + 8 * near[3][i] - near[4][i]) / 12e-3, rate[i], 1e-6);
    }
    free(j), free(place);
    kempe_outputs_free(o);
    kempe_trajectory_free(t);
    unload(&l);
}

/* About another point: L + (c - x) cross p. */
static void about_points(void)
{
    loaded l = load_pair("[0, 0, 0]", "");
    int n = kempe_model_coordinate_count(l.model);
    double *q = calloc((size_t)n, sizeof *q), *qd = calloc((size_t)n, sizeof *qd);
    any_state(n, q, qd);
    double *x = values_of(&l,
                          "angular_momentum(part about other.P), angular_momentum(part), momentum(part), "
                          "position(part.C), position(other.P), velocity(part.C)",
                          q, qd, NULL);
    double arm[3] = {x[9] - x[12], x[10] - x[13], x[11] - x[14]}, moved[3] = {x[3], x[4], x[5]};
    add_cross(moved, arm, x + 6);
    for (int k = 0; k < 3; k++) {
        CHECK_NEAR(x[k], moved[k], 1e-13);
        CHECK_NEAR(x[6 + k], 0.7 * x[15 + k], 1e-13);
    }
    free(x), free(q), free(qd);
    unload(&l);
}

static void refused(void)
{
    loaded l = load_pair("[0, 0, 0]", "");
    kempe_outputs *o = NULL;
    const char *const wrong[][2] = {
        {"momentum(ground)", "the ground does not move"},         {"momentum(hul)", "did you mean 'hull'"},
        {"momentum(hull about ground.O)", "hull about ground.O"}, {"angular_momentum(hull about ground.X)", "'X'"},
        {"angular_momentum(hull about rotor)", "BODY.POINT"},     {"angular_momentum(about)", "about"}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        CHECK(kempe_outputs_new(l.system, wrong[k][0], &o) == KEMPE_E_ARGUMENT && !o);
        if (!strstr(kempe_context_message(l.context), wrong[k][1]))
            printf("%s: %s\n", wrong[k][0], kempe_context_message(l.context));
        CHECK(strstr(kempe_context_message(l.context), wrong[k][1]));
    }
    CHECK(kempe_outputs_new(l.system, "momentum.x, angular_momentum(hull about other.P).z", &o) == KEMPE_OK);
    CHECK(kempe_outputs_count(o) == 2);
    kempe_outputs_free(o);
    unload(&l);
}

int main(void)
{
    TEST(energies_agree);
    TEST(conserved);
    TEST(driven);
    TEST(about_points);
    TEST(refused);
    return check_report();
}
