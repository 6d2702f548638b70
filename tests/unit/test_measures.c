/* SPDX-License-Identifier: BSD-3-Clause */
/* Points and axes in expressions: measures by their definitions from positions, velocities and axes of outputs, rates
 * by differences, forces and constraints by measures as those of elements. */
#include "loaded.h"
#include <kempe/output_handles.h>
#include <kempe/table.h>
#include <stdlib.h>

enum { N = 9, MOST = 40 };

/* Values of outputs, `words`, at a state. */
static void at_state(const loaded *l, const char *words, double t, const double *q, const double *qd, double *values)
{
    kempe_outputs *o = NULL;
    if (kempe_outputs_new(l->system, words, &o) != KEMPE_OK)
        printf("%s: %s\n", words, kempe_context_message(l->context));
    CHECK(o && kempe_outputs_count(o) <= MOST);
    if (o)
        CHECK(kempe_outputs_at(o, t, q, qd, NULL, NULL, values) == KEMPE_OK);
    kempe_outputs_free(o);
}

/* State number k. */
static void any_state(int k, double *q, double *qd)
{
    for (int i = 0; i < N; i++) {
        q[i] = 0.9 * sin(1.0 + 2.3 * i + 0.7 * k);
        qd[i] = 1.4 * cos(0.4 + 1.7 * i - 0.3 * k);
    }
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double *a, const double *b, double *out)
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* In the axes of ship.H: of the position, velocity and angular velocity of arm.T relative to it. */
static void relative_vectors(void)
{
    loaded l = load("tests/models/measures.yaml");
    for (int s = 0; s < 5; s++) {
        double q[N], qd[N], seen[MOST] = {0}, x[MOST] = {0}, d[3], v[3], w[3], carried[3];
        any_state(s, q, qd);
        at_state(&l, "px, py, pz, vx, vy, vz, wx, wy, wz, gap, closing", 0, q, qd, seen);
        at_state(&l,
                 "position(arm.T), position(ship.H), velocity(arm.T), velocity(ship.H), angular_velocity(arm.T), "
                 "angular_velocity(ship.H), axes(ship.H)",
                 0, q, qd, x);
        for (int k = 0; k < 3; k++) {
            d[k] = x[k] - x[3 + k];
            v[k] = x[6 + k] - x[9 + k];
            w[k] = x[12 + k] - x[15 + k];
        }
        CHECK_NEAR(seen[9], sqrt(dot(d, d)), 1e-14);
        CHECK_NEAR(seen[10], dot(d, v) / sqrt(dot(d, d)), 1e-13);
        cross(x + 15, d, carried);
        for (int k = 0; k < 3; k++) {
            const double *e = x + 18 + 3 * k;
            CHECK_NEAR(seen[k], dot(e, d), 1e-14);
            CHECK_NEAR(seen[3 + k], dot(e, v) - dot(e, carried), 1e-13);
            CHECK_NEAR(seen[6 + k], dot(e, w), 1e-13);
        }
    }
    unload(&l);
}

static void ground_words(void)
{
    loaded l = load("tests/models/measures.yaml");
    double q[N], qd[N], seen[MOST] = {0}, x[MOST] = {0};
    any_state(1, q, qd);
    at_state(&l, "ground_x, ground_v, ground_w, own, axis, tension", 0, q, qd, seen);
    at_state(&l, "position(arm.T), velocity(arm.T), angular_velocity(arm.T), axes(arm.T), axes(ship.H), force(s)", 0, q,
             qd, x);
    CHECK_NEAR(seen[0], x[0], 0);
    CHECK_NEAR(seen[1], x[4], 0);
    CHECK_NEAR(seen[2], x[8], 0);
    CHECK_NEAR(seen[3], x[9 + 7], 0);
    CHECK_NEAR(seen[4], dot(x + 9 + 6, x + 18 + 3), 1e-14);
    CHECK_NEAR(seen[5], x[27], 1e-13);
    unload(&l);
}

static void angles(void)
{
    loaded l = load("tests/models/measures.yaml");
    for (int s = 0; s < 5; s++) {
        double q[N], qd[N], seen[MOST] = {0}, x[MOST] = {0}, u[3], v[3], c[3];
        any_state(s, q, qd);
        at_state(&l, "between, about", 0, q, qd, seen);
        at_state(&l, "axes(arm.T), axes(ship.H), axes(post.F)", 0, q, qd, x);
        const double *z = x + 6, *hx = x + 9, *fx = x + 18, *fy = x + 21;
        CHECK_NEAR(seen[0], acos(dot(z, hx)), 1e-13);
        for (int k = 0; k < 3; k++) { /* across fy */
            u[k] = fx[k] - dot(fy, fx) * fy[k];
            v[k] = z[k] - dot(fy, z) * fy[k];
        }
        cross(u, v, c);
        double size = sqrt(dot(u, u) * dot(v, v));
        CHECK_NEAR(sin(seen[1]), dot(fy, c) / size, 1e-13);
        CHECK_NEAR(cos(seen[1]), dot(u, v) / size, 1e-13);
    }
    unload(&l);
}

/* By central differences along q(t) = q + qd s, of order h^2. */
static void rates(void)
{
    const double h = 1e-4;
    loaded l = load("tests/models/measures.yaml");
    double q[N], qd[N], before[N], after[N], seen[MOST] = {0}, low[MOST] = {0}, high[MOST] = {0};
    any_state(2, q, qd);
    for (int k = 0; k < N; k++) {
        before[k] = q[k] - h * qd[k];
        after[k] = q[k] + h * qd[k];
    }
    at_state(&l, "turning, closing, vx, work", 0.4, q, qd, seen);
    at_state(&l, "about, gap, px, ground_x", 0.4 - h, before, qd, low);
    at_state(&l, "about, gap, px, ground_x", 0.4 + h, after, qd, high);
    low[3] = low[3] * low[3] * sin(0.4 - h);
    high[3] = high[3] * high[3] * sin(0.4 + h);
    for (int k = 0; k < 4; k++)
        CHECK_NEAR(seen[k], (high[k] - low[k]) / (2 * h), 1e-6);
    unload(&l);
}

#define CHAIN                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "parameters: {k: 60, c: 4, rest: 0.2}\n"                                                                           \
    "ground: {points: {mast: [0.1, 0.5, 0.2]}}\n"                                                                      \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.3, 0, 0],\n"                                    \
    "      inertia: {xx: 0.01, yy: 0.02, zz: 0.02}, points: {E: [0.4, 0, 0]}}\n"                                       \
    "  b: {joint: {name: B, revolute: [0, 1, 1], at: a.E}, mass: 1, com: [0.2, 0, 0],\n"                               \
    "      inertia: {xx: 0.01, yy: 0.02, zz: 0.02}, points: {T: [0.4, 0.1, 0]}}\n"                                     \
    "start: {q: {A: 0.3, B: %s}}\n"                                                                                    \
    "run: {t_end: 1, rtol: 1e-11}\n"

/* The coordinates at the end of a run of the chain with other parts. */
static void run_chain(const char *start, const char *parts, const char *formulation, double q[2])
{
    char text[4096];
    kempe_trajectory *run = NULL;
    (void)snprintf(text, sizeof text, CHAIN "%s", start, parts);
    loaded l = load_text(text);
    const kempe_run_options options = {
        .formulation = formulation, .integrator = independent_integrator(formulation), .no_convergence_check = 1};
    q[0] = q[1] = NAN;
    if (l.system && kempe_simulate(l.system, &options, &run) == KEMPE_OK)
        memcpy(q, kempe_trajectory_q(run, kempe_trajectory_row_count(run) - 1), 2 * sizeof *q);
    else
        printf("%s\n", kempe_context_message(l.context));
    kempe_trajectory_free(run);
    unload(&l);
}

static void force_by_positions(void)
{
    double q[2], p[2];
    run_chain("0", "forces: {s: {spring: [ground.mast, b.T], stiffness: k, damping: c, free_length: rest}}\n", NULL, q);
    run_chain("0",
              "algebraic: {l: 'distance(ground.mast, b.T)', f: '(k*(l - rest) + c*rate(l))/l'}\n"
              "forces: {s: {at: b.T, force: ['f*(0.1 - position(b.T).x)', 'f*(0.5 - position(b.T).y)', "
              "'f*(0.2 - position(b.T).z)']}}\n",
              NULL, p);
    CHECK_NEAR(p[0], q[0], 1e-9);
    CHECK_NEAR(p[1], q[1], 1e-9);
}

/* A rod, and the same by an expression: h differs by a factor, the motion does not. */
static void constraint_by_distance(void)
{
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    double q[2], p[2];
    for (int f = 0; f < 3; f++) {
        double tolerance = f == 2 ? 1e-6 : 1e-9;
        run_chain("-1", "loops: {R: {rod: [ground.mast, b.T], length: 0.75}}\n", formulations[f], q);
        run_chain("-1", "loops: {R: {constraint: 'distance(ground.mast, b.T) - 0.75'}}\n", formulations[f], p);
        CHECK_NEAR(p[0], q[0], tolerance);
        CHECK_NEAR(p[1], q[1], tolerance);
    }
}

/* The model's text has the words as they can be read again. */
static void printed(void)
{
    static const char *const words[] = {"closing = rate(distance(arm.T, ship.H))", "axis = axes(arm.T, ship.H).z.y",
                                        "about = angle(post.F.x, arm.T.z, post.F.y)", "vx = velocity(arm.T, ship.H).x",
                                        "work = rate(position(arm.T).x^2*sin(t))"};
    loaded l = load("tests/models/measures.yaml");
    char *text = NULL;
    CHECK(kempe_model_print(l.model, KEMPE_TEXT, &text) == KEMPE_OK);
    for (size_t k = 0; text && k < sizeof words / sizeof *words; k++)
        CHECK(strstr(text, words[k]) != NULL);
    kempe_text_free(text);
    unload(&l);
}

int main(void)
{
    TEST(relative_vectors);
    TEST(ground_words);
    TEST(angles);
    TEST(rates);
    TEST(force_by_positions);
    TEST(constraint_by_distance);
    TEST(printed);
    return check_report();
}
