/* SPDX-License-Identifier: BSD-3-Clause */
/* Points and axes in expressions: measures by their definitions from positions, velocities and axes of outputs, rates
 * by differences, forces and constraints by measures as those of elements; accelerations and reactions by closed forms.
 */
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
        CHECK(kempe_outputs_at_state(o, t, q, qd, NULL, NULL, values) == KEMPE_OK);
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

/* -- accelerations and reactions --------------------------------------------------------------------- */

static bool is_near(double x, double want, double tolerance)
{
    return fabs(x - want) <= tolerance * fmax(1, fabs(want));
}

/* A point at the radius r on a turntable at (1, 0, 0) turned by q: a = r (-cos q qd^2 - sin q qdd, -sin q qd^2 +
 * cos q qdd). From a point of the ground whose axes are turned by a quarter, x is along the ground's y. */
static void accelerations(void)
{
    loaded l = load_text("kempe: 1\n"
                         "ground: {points: {F: {at: [3, 1, 0], axes: {x: y, z: z}}}}\n"
                         "bodies:\n"
                         "  table:\n"
                         "    joint: {name: A, revolute: z, at: ground}\n"
                         "    mass: 1\n"
                         "    inertia: {zz: 1}\n"
                         "    points: {P: [0.5, 0, 0]}\n"
                         "sensors:\n"
                         "  ax: acceleration(table.P).x\n"
                         "  ay: acceleration(table.P).y\n"
                         "  across: \"acceleration(table.P, ground.F).x\"\n"
                         "  spin: angular_acceleration(table.P).z\n");
    const double q = 0.7, qd = 1.3, qdd = -2.1, r = 0.5;
    double ax = r * (-cos(q) * qd * qd - sin(q) * qdd), ay = r * (-sin(q) * qd * qd + cos(q) * qdd), seen[4] = {0};
    kempe_outputs *o = NULL;
    CHECK(l.system && kempe_outputs_new(l.system, "ax, ay, across, spin", &o) == KEMPE_OK);
    CHECK(o && kempe_outputs_at_state(o, 0, &q, &qd, &qdd, NULL, seen) == KEMPE_OK);
    CHECK_NEAR(seen[0], ax, 1e-15);
    CHECK_NEAR(seen[1], ay, 1e-15);
    CHECK_NEAR(seen[2], ay, 1e-15);
    CHECK_NEAR(seen[3], qdd, 1e-15);
    kempe_outputs_free(o);
    unload(&l);
}

/* A bob of 2 kg in the plane, which a pin at 0.5 m holds: a pendulum by a loop. */
#define PENDULUM                                                                                                       \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies:\n"                                                                                                        \
    "  carrier: {joint: {name: x, prismatic: x, at: ground}, mass: 0}\n"                                               \
    "  slide: {joint: {name: y, prismatic: y, at: carrier}, mass: 0}\n"                                                \
    "  bob:\n"                                                                                                         \
    "    joint: {name: A, revolute: z, at: slide}\n"                                                                   \
    "    mass: 2\n"                                                                                                    \
    "    inertia: {zz: 0.1}\n"                                                                                         \
    "    points: {P: [0, 0.5, 0], C: [0, 0, 0]}\n"                                                                     \
    "loops: {pin: {ball: [ground.O, bob.P]}}\n"                                                                        \
    "start: {q: {x: 0.4, y: -0.3, A: 0.93}}\n"

static kempe_table *run_of(const loaded *l, const kempe_run_options *options)
{
    kempe_trajectory *run = NULL;
    kempe_table *table = NULL;
    kempe_status status = l->system ? kempe_simulate(l->system, options, &run) : KEMPE_E_ARGUMENT;
    if (status < 0)
        printf("  %s\n", kempe_context_message(l->context));
    CHECK(status >= 0);
    CHECK(run && kempe_trajectory_table(run, "rows", &table) == KEMPE_OK);
    kempe_trajectory_free(run);
    return table;
}

static double at(const kempe_table *table, int row, const char *column)
{
    int k = table ? kempe_table_find(table, column) : -1;
    CHECK(k >= 0);
    return k < 0 ? NAN : kempe_table_number(table, row, k);
}

/* The force on the bob is m (a - g), with a by the table of accelerations. The pin has no moment. */
static void reactions(void)
{
    loaded l = load_text(PENDULUM "algebraic: {up: reaction(pin).y}\n"
                                  "sensors: {fx: reaction(pin).x, fy: reaction(pin).y, m: moment(pin).z,\n"
                                  "          ax: acceleration(bob.C).x, twice: 2*up}\n"
                                  "run: {t_end: 0.5, output_step: 0.1, rtol: 1e-10, atol: 1e-10,\n"
                                  "      outputs: [q, qdd, reaction(pin), fx, fy, m, ax, twice]}\n");
    kempe_table *table = run_of(&l, NULL);
    for (int k = 0; table && k < 6; k++) {
        double fx = 2 * at(table, k, "qdd.x"), fy = 2 * (at(table, k, "qdd.y") + 9.81);
        CHECK(is_near(at(table, k, "sensor.fx"), fx, 1e-11) && is_near(at(table, k, "sensor.fy"), fy, 1e-11));
        CHECK(at(table, k, "sensor.twice") == 2 * at(table, k, "sensor.fy"));
        CHECK(at(table, k, "sensor.fx") == at(table, k, "reaction.pin.x"));
        CHECK(at(table, k, "sensor.m") == 0);
        CHECK(is_near(at(table, k, "sensor.ax"), at(table, k, "qdd.x"), 1e-12));
    }
    kempe_table_free(table);
    unload(&l);
}

/* A block that a floor holds, with a force against its motion in proportion to the reaction, in every formulation:
 * qdd = -0.3 g 2/3 for 3 kg of which 2 rest on the floor. */
static void force_by_reaction(void)
{
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    for (size_t k = 0; k < sizeof formulations / sizeof *formulations; k++) {
        loaded l = load_text("kempe: 1\n"
                             "gravity: [0, -9.81, 0]\n"
                             "ground: {points: {O: [0, 0, 0]}}\n"
                             "bodies:\n"
                             "  slide: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                             "  block: {joint: {name: y, prismatic: y, at: slide}, mass: 2, points: {P: [0, 0, 0]}}\n"
                             "loops: {floor: {point_on_plane: [ground.O, block.P], axis: y}}\n"
                             "forces: {rub: {joint: x, force: -0.3*reaction(floor).y}}\n"
                             "start: {qd: {x: 3}}\n"
                             "run: {t_end: 1, output_step: 1, rtol: 1e-9, atol: 1e-9, outputs: [q]}\n");
        kempe_table *table = run_of(&l, &(kempe_run_options){.formulation = formulations[k]});
        CHECK_NEAR(at(table, 1, "q.x"), 3 - 0.3 * 9.81 * 2 / 3 / 2, 1e-7);
        kempe_table_free(table);
        unload(&l);
    }
}

/* x = cos 3t: x'' = -9 cos 3t passes 4.5 upwards at 3t = 2 pi/3, and the reaction of a wall 2 x'' passes -9 upwards at
 * 3t = pi/3. */
static void conditions(void)
{
    static const struct {
        const char *until;
        double phase;
    } cases[] = {{"acceleration(car.P).x > 4.5", 2.0 / 3}, {"reaction(wall).x > -9", 1.0 / 3}};
    for (int k = 0; k < 2; k++) {
        char text[1024];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\n"
                       "ground: {points: {O: [0, 0, 0]}}\n"
                       "bodies:\n"
                       "  car: {joint: {name: x, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
                       "  load: {joint: {name: y, prismatic: x, at: ground}, mass: 2, points: {L: [0, 0, 0]}}\n"
                       "loops: {wall: {point_on_plane: [car.P, load.L], axis: x}}\n"
                       "forces: {spring: {joint: x, force: -27*q(x)}}\n"
                       "start: {q: {x: 1, y: 1}}\n"
                       "run: {t_end: 2, rtol: 1e-12, atol: 1e-12, outputs: [q], until: \"%s\"}\n",
                       cases[k].until);
        loaded l = load_text(text);
        kempe_table *table = run_of(&l, NULL);
        int last = table ? kempe_table_row_count(table) - 1 : 0;
        CHECK_NEAR(at(table, last, "t"), cases[k].phase * acos(-1) / 3, 1e-10);
        kempe_table_free(table);
        unload(&l);
    }
}

static void refused(const char *forces, const char *sentence)
{
    char text[2048];
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    (void)snprintf(text, sizeof text, PENDULUM "%s\n", forces);
    CHECK(kempe_model_read_text(context, text, "model.yaml", &model) == KEMPE_E_INPUT);
    if (!strstr(kempe_context_message(context), sentence))
        CHECK_TEXT(kempe_context_message(context), sentence);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void mistakes(void)
{
    refused("forces: {f: {joint: x, force: acceleration(bob.C).x}}", "model.yaml:14:31: acceleration is not allowed");
    refused("states: {s: {rate: angular_acceleration(bob.C).z}}", "angular_acceleration is not allowed here");
    refused("algebraic: {a: acceleration(bob.C).x}", "acceleration is not allowed here");
    refused("sensors: {f: lambda(A)}", "joint 'A' is in the tree and has no multipliers");
    refused("sensors: {f: reaction(pin)}", "a component is expected here");
    refused("sensors: {f: rate(reaction(pin).x)}", "depends on accelerations");
    refused("drives: {d: {joint: A, angle: reaction(pin).x}}", "reaction is not allowed here");
    refused("states: {s: {when: acceleration(bob.C).x > 1, next: 1}}", "changes of accelerations are not located");
}

int main(void)
{
    TEST(accelerations);
    TEST(reactions);
    TEST(force_by_reaction);
    TEST(conditions);
    TEST(mistakes);
    TEST(relative_vectors);
    TEST(ground_words);
    TEST(angles);
    TEST(rates);
    TEST(force_by_positions);
    TEST(constraint_by_distance);
    TEST(printed);
    return check_report();
}
