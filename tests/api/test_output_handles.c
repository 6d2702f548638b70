/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs by handle are the columns of a result; their Jacobians agree with differences, with open and with closed
 * loops, on examples; at dead centres they are refused by name. */
#include "four_bar_text.h"
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/output_handles.h>
#include <kempe/settings.h>
#include <kempe/table.h>
#include <kempe/workspace.h>
#include <stdbool.h>
#include <stdlib.h>

static loaded load_example(const char *example)
{
    char path[512];
    (void)snprintf(path, sizeof path, "examples/%s.yaml", example);
    return load(path);
}

typedef struct example {
    const char *name, *words;
} example;

static const example examples[] = {
    {"four_bar/four_bar", "position(coupler.C), velocity(coupler.C)"},
    {"andrews/andrews", "position(K3.D), velocity(K5.G)"},
    {"stewart/stewart", "position(upper1.P), axes(upper1.P), angular_velocity(upper1.P)"},
    {"parallel_robot/parallel_robot", "position(rod_l.P), velocity(crank_l.E)"},
    {"slider_crank/slider_crank", "position(rod.P), velocity(slider.P)"},
    {"spatial_slider_crank/spatial_slider_crank", "position(rod.P), velocity(crank.P)"},
    {"double_wishbone/double_wishbone",
     "position(upright.T), velocity(upright.U), axes(upright.T), angular_velocity(upright.T)"},
    {"bricard/bricard", "position(r3.E), velocity(r4.E), axes(r3.E), angular_velocity(r2.E)"},
    {"stephenson/stephenson", "position(coupler.P)"},
    {"double_four_bar/double_four_bar", "position(rocker.F)"},
    {"delta_robot/delta_robot", "position(platform.C1), velocity(arm1.E1)"},
};

static bool is_rate(const char *name)
{
    return strncmp(name, "velocity", 8) == 0 || strncmp(name, "angular", 7) == 0;
}

/* The largest difference of J from central differences of the values. */
static double by_differences(kempe_outputs *o, int n, double t, double *q, double *qd)
{
    int count = kempe_outputs_count(o);
    size_t size = (size_t)count * sizeof(double);
    double *j = malloc(size * (size_t)n), *a = malloc(size), *b = malloc(size), *c = malloc(size), *d = malloc(size);
    double most = 0;
    CHECK(kempe_outputs_jacobian(o, t, q, qd, j, NULL) == KEMPE_OK);
    for (int k = 0; k < n; k++)
        for (int rate = 0; rate < 2; rate++) {
            double *x = rate ? qd : q, before = x[k], h = 1e-3;
            double *to[] = {a, b, c, d};
            const double at[] = {-2, -1, 1, 2};
            for (int i = 0; i < 4; i++) {
                x[k] = before + at[i] * h;
                CHECK(kempe_outputs_at_state(o, t, q, qd, NULL, NULL, to[i]) == KEMPE_OK);
            }
            x[k] = before;
            for (int i = 0; i < count; i++) {
                bool of_rates = is_rate(kempe_outputs_name(o, i));
                double slope = (a[i] - 8 * b[i] + 8 * c[i] - d[i]) / (12 * h);
                if (of_rates == (rate == 1))
                    most = check_max(most, fabs(slope - j[k * count + i]) / fmax(1, fabs(slope)));
            }
        }
    free(j), free(a), free(b), free(c), free(d);
    return most;
}

/* Closed states at u +- h: the change of positions is the closed-chain Jacobian. */
static double closed_by_differences(const loaded *s, kempe_outputs *o, int n, const double *q)
{
    int count = kempe_outputs_count(o), p = kempe_outputs_independent_count(o);
    const int *u = kempe_outputs_independent(o);
    kempe_workspace *ws = NULL;
    size_t size = (size_t)count * sizeof(double);
    double *j = malloc(size * (size_t)(p + 1)), *v[4], *x = malloc((size_t)n * sizeof *x), most = 0;
    int *hold = calloc((size_t)n, sizeof *hold);
    for (int i = 0; i < 4; i++)
        v[i] = malloc(size);
    CHECK(kempe_workspace_new(s->system, &ws) == KEMPE_OK);
    CHECK(kempe_outputs_closed_jacobian(o, 0, q, NULL, j, NULL) == KEMPE_OK);
    for (int k = 0; k < p; k++)
        hold[u[k]] = 1;
    for (int k = 0; k < p; k++) {
        const double h = 1e-3, at[] = {-2, -1, 1, 2};
        for (int i = 0; i < 4; i++) {
            memcpy(x, q, (size_t)n * sizeof *x);
            x[u[k]] += at[i] * h;
            CHECK(kempe_workspace_close(ws, 0, x, NULL, hold) == KEMPE_OK);
            CHECK(kempe_outputs_at_state(o, 0, x, NULL, NULL, NULL, v[i]) == KEMPE_OK);
        }
        for (int i = 0; i < count; i++) {
            double slope = (v[0][i] - 8 * v[1][i] + 8 * v[2][i] - v[3][i]) / (12 * h);
            if (!is_rate(kempe_outputs_name(o, i)))
                most = check_max(most, fabs(slope - j[k * count + i]) / fmax(1, fabs(slope)));
        }
    }
    for (int i = 0; i < 4; i++)
        free(v[i]);
    free(j), free(x), free(hold);
    kempe_workspace_free(ws);
    return most;
}

static void jacobians(void)
{
    for (size_t e = 0; e < sizeof examples / sizeof *examples; e++) {
        loaded s = load_example(examples[e].name);
        kempe_outputs *o = NULL;
        kempe_assembly *a = NULL;
        int n = kempe_model_coordinate_count(s.model);
        if (kempe_outputs_new(s.system, examples[e].words, &o) != KEMPE_OK)
            printf("  %s: %s\n", examples[e].name, kempe_context_message(s.context));
        CHECK(o && kempe_assembly_new(s.system, &a) == KEMPE_OK);
        if (o && a) {
            double *q = malloc((size_t)n * sizeof *q), *qd = malloc((size_t)n * sizeof *qd);
            memcpy(q, kempe_assembly_q(a), (size_t)n * sizeof *q);
            for (int k = 0; k < n; k++)
                qd[k] = sin(k + 1);
            double open = by_differences(o, n, 0, q, qd), closed = closed_by_differences(&s, o, n, q);
            printf("  %-42s n %2d, p %d: J off by %.1e, closed chain by %.1e\n", examples[e].name, n,
                   kempe_outputs_independent_count(o), open, closed);
            CHECK(open < 1e-8 && closed < 1e-8);
            free(q), free(qd);
        }
        kempe_assembly_free(a);
        kempe_outputs_free(o);
        unload(&s);
    }
}

/* Along a run the accelerations of outputs are J qdd + jdqd, and J X udd + drift. */
static void accelerations(void)
{
    loaded s = load_example("four_bar/four_bar");
    kempe_outputs *o = NULL, *all = NULL;
    kempe_stepper *stepper = NULL;
    kempe_run_options run = {.rtol = 1e-11, .t_end = 2};
    double j[9], jdqd[3], closed[3], drift[3], values[3];
    CHECK(kempe_outputs_new(s.system, "position(coupler.C)", &o) == KEMPE_OK);
    CHECK(kempe_outputs_new(s.system, "acceleration(coupler.C)", &all) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    for (int k = 1; k <= 20 && o && all && stepper; k++) {
        CHECK(kempe_stepper_advance(stepper, 0.05 * k) == KEMPE_OK);
        const double *q = kempe_stepper_q(stepper), *qd = kempe_stepper_qd(stepper), *qdd = kempe_stepper_qdd(stepper);
        double t = kempe_stepper_time(stepper), udd = qdd[kempe_outputs_independent(o)[0]];
        CHECK(kempe_outputs_at_stepper(all, stepper, values) == KEMPE_OK);
        CHECK(kempe_outputs_jacobian(o, t, q, qd, j, jdqd) == KEMPE_OK);
        CHECK(kempe_outputs_closed_jacobian(o, t, q, qd, closed, drift) == KEMPE_OK);
        for (int i = 0; i < 3; i++) {
            CHECK_NEAR(jdqd[i] + j[i] * qdd[0] + j[3 + i] * qdd[1] + j[6 + i] * qdd[2], values[i], 1e-10);
            CHECK_NEAR(drift[i] + closed[i] * udd, values[i], 1e-8);
        }
    }
    kempe_stepper_free(stepper);
    kempe_outputs_free(o);
    kempe_outputs_free(all);
    unload(&s);
}

/* Axes are right-handed unit vectors, and turn with the angular velocity: e' = w x e. */
static void axes_turn(void)
{
    loaded s = load_example("double_wishbone/double_wishbone");
    kempe_outputs *axes = NULL, *turns = NULL;
    kempe_assembly *a = NULL;
    int n = kempe_model_coordinate_count(s.model);
    double e[9], w[3], *j = malloc(9 * (size_t)n * sizeof *j), *qd = malloc((size_t)n * sizeof *qd);
    CHECK(kempe_outputs_new(s.system, "axes(upright.T)", &axes) == KEMPE_OK);
    CHECK(kempe_outputs_new(s.system, "angular_velocity(upright.T)", &turns) == KEMPE_OK);
    CHECK(kempe_assembly_new(s.system, &a) == KEMPE_OK);
    for (int k = 0; k < n; k++)
        qd[k] = cos(3 * k);
    CHECK(kempe_outputs_at_state(axes, 0, kempe_assembly_q(a), NULL, NULL, NULL, e) == KEMPE_OK);
    CHECK(kempe_outputs_at_state(turns, 0, kempe_assembly_q(a), qd, NULL, NULL, w) == KEMPE_OK);
    CHECK(kempe_outputs_jacobian(axes, 0, kempe_assembly_q(a), NULL, j, NULL) == KEMPE_OK);
    for (int i = 0; i < 3; i++) {
        const double *x = e + 3 * i, *y = e + 3 * ((i + 1) % 3), *z = e + 3 * ((i + 2) % 3);
        for (int k = 0; k < 3; k++) {
            int l = (k + 1) % 3, m = (k + 2) % 3;
            double rate = 0;
            for (int c = 0; c < n; c++)
                rate += j[9 * c + 3 * i + k] * qd[c];
            CHECK_NEAR(rate, w[l] * x[m] - w[m] * x[l], 1e-13);
            CHECK_NEAR(z[k], x[l] * y[m] - x[m] * y[l], 1e-14);
        }
    }
    CHECK_TEXT(kempe_outputs_name(axes, 5), "axes.upright.T.y.z");
    kempe_assembly_free(a);
    kempe_outputs_free(axes);
    kempe_outputs_free(turns);
    free(j), free(qd);
    unload(&s);
}

/* Values at the rows of a trajectory, and at a stepper, are the columns of its table: every kind of output. */
static void columns(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\n"
        "inputs: {u: {unit: N*m, t: [0, 0.3, 0.6], value: [0.2, 3, -1], method: hold}}\n" FOUR_BAR_TEXT
        "forces: {motor: {joint: A, torque: u - 0.3*qd(A)}, spring: {spring: [ground.B, crank.P], stiffness: 20, "
        "free_length: 0.5}}\n"
        "sensors: {power: \"u*qd(A)\"}\n"
        "start: {q: {A: 0.5, C: 0.5, R: 1.5}, qd: {A: 6}}\n"
        "run: {t_end: 1, output_step: 0.1, outputs: [position(coupler.Q), velocity(coupler.Q), "
        "acceleration(coupler.Q), "
        "reaction(q), force(motor), force(spring), energy, power]}\n";
    static const char words[] = "position(coupler.Q), velocity(coupler.Q), acceleration(coupler.Q), reaction(q), "
                                "force(motor), force(spring), energy, power";
    loaded s = load_text(text);
    kempe_trajectory *trajectory = NULL;
    kempe_stepper *stepper = NULL;
    kempe_table *table = NULL;
    kempe_outputs *o = NULL;
    double values[32];
    int found = 0;
    CHECK(kempe_simulate(s.system, NULL, &trajectory) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, NULL, &stepper) == KEMPE_OK);
    CHECK(kempe_trajectory_table(trajectory, "rows", &table) == KEMPE_OK);
    if (kempe_outputs_new(s.system, words, &o) != KEMPE_OK)
        printf("%s\n", kempe_context_message(s.context));
    for (int row = 0; o && row < 2 * kempe_table_row_count(table); row++) {
        int at = row / 2;
        if (row % 2)
            CHECK(kempe_stepper_advance(stepper, kempe_trajectory_time(trajectory, at)) == KEMPE_OK);
        CHECK((row % 2 ? kempe_outputs_at_stepper(o, stepper, values)
                       : kempe_outputs_at_row(o, trajectory, at, values)) == KEMPE_OK);
        for (int k = 0; k < kempe_outputs_count(o); k++, found++) {
            int column = kempe_table_find(table, kempe_outputs_name(o, k));
            CHECK(column >= 0);
            CHECK_NEAR(values[k], kempe_table_number(table, at, column), 1e-9);
            CHECK_TEXT(kempe_outputs_unit(o, k), kempe_table_unit(table, column));
        }
    }
    CHECK(found == 2 * 11 * 18);
    kempe_outputs_free(o);
    kempe_table_free(table);
    kempe_stepper_free(stepper);
    kempe_trajectory_free(trajectory);
    unload(&s);
}

/* The slider of a slider-crank stops where crank and rod are in line: it is no independent coordinate there. */
static void dead_centres(void)
{
    static const char text[] =
        "kempe: 1\nground: {points: {S: [0, 0, 0]}}\nbodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, "
        "points: {P: [1, 0, 0]}}\n"
        "  slider: {joint: {name: S, prismatic: x, at: ground}, mass: 1, points: {Q: [0, 0, 0]}}\n"
        "loops: {r: {rod: [crank.P, slider.Q], length: 2}}\n"
        "start: {q: {A: 0.5, S: 2.8}, hold: [A]}\n";
    loaded s = load_text(text);
    kempe_outputs *o = NULL;
    double j[3], moving[2] = {0.7, cos(0.7) + sqrt(4 - sin(0.7) * sin(0.7))}, dead[2] = {0, 3};
    CHECK(kempe_outputs_new(s.system, "position(crank.P)", &o) == KEMPE_OK);
    CHECK(kempe_outputs_choose(o, "S") == KEMPE_OK && kempe_outputs_independent(o)[0] == 1);
    CHECK(kempe_outputs_closed_jacobian(o, 0, moving, NULL, j, NULL) == KEMPE_OK);
    double slope = -sin(0.7) - sin(0.7) * cos(0.7) / sqrt(4 - sin(0.7) * sin(0.7)); /* dS/dA */
    CHECK_NEAR(j[0], -sin(0.7) / slope, 1e-12);
    CHECK_NEAR(j[1], cos(0.7) / slope, 1e-12);
    CHECK(kempe_outputs_closed_jacobian(o, 0, dead, NULL, j, NULL) == KEMPE_E_FAILED);
    const char *said = kempe_context_message(s.context);
    CHECK(strstr(said, "dead centre") != NULL && strstr(said, "'A'") != NULL);
    CHECK(kempe_outputs_choose(o, "A") == KEMPE_OK);
    CHECK(kempe_outputs_closed_jacobian(o, 0, dead, NULL, j, NULL) == KEMPE_OK);
    CHECK_NEAR(j[1], 1, 1e-12);
    CHECK(kempe_outputs_choose(o, "B") == KEMPE_E_ARGUMENT);
    kempe_outputs_free(o);
    unload(&s);
}

/* Coordinates, rates, accelerations and multipliers are outputs like others. */
static void arrays_of_the_state(void)
{
    loaded s = load_example("four_bar/four_bar");
    kempe_outputs *o = NULL;
    const double q[] = {0.1, 0.2, 0.3}, qd[] = {4, 5, 6}, qdd[] = {7, 8, 9}, lambda[] = {10, 11};
    double values[11], j[33], jdqd[11];
    CHECK(kempe_outputs_new(s.system, "q, qd(rocker), qdd, lambda(C), position(coupler.C).x, q(crank)", &o) ==
          KEMPE_OK);
    CHECK(kempe_outputs_count(o) == 10 && kempe_outputs_find(o, "lambda.C.2") == 8);
    CHECK_TEXT(kempe_outputs_name(o, 3), "qd.rocker");
    CHECK_TEXT(kempe_outputs_unit(o, 4), "rad/s^2");
    CHECK(kempe_outputs_at_state(o, 0, q, qd, qdd, lambda, values) == KEMPE_OK);
    const double expected[] = {0.1, 0.2, 0.3, qd[coordinate_named(&s, "rocker")], 7, 8, 9, 10, 11};
    CHECK(memcmp(values, expected, sizeof expected) == 0);
    CHECK(kempe_outputs_jacobian(o, 0, q, qd, j, jdqd) == KEMPE_OK);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 9; i++) {
            double unit = i < 3 ? k == i : k == coordinate_named(&s, "rocker");
            CHECK(i < 4 ? j[10 * k + i] == unit && jdqd[i] == 0 : isnan(j[10 * k + i]));
        }
    kempe_outputs_free(o);
    unload(&s);
}

static void mistakes(void)
{
    loaded s = load_example("four_bar/four_bar");
    kempe_outputs *o = NULL;
    CHECK(kempe_outputs_new(s.system, "position(coupler.X)", &o) == KEMPE_E_ARGUMENT && !o);
    CHECK(kempe_outputs_new(s.system, "q(X)", &o) == KEMPE_E_ARGUMENT && !o);
    CHECK(kempe_outputs_new(s.system, "position(coupler.C).y", &o) == KEMPE_OK);
    CHECK(kempe_outputs_count(o) == 1 && kempe_outputs_find(o, "position.coupler.C.y") == 0);
    CHECK(kempe_outputs_find(o, "x") == -1 && !kempe_outputs_name(o, 1));
    kempe_outputs_free(o);
    unload(&s);
}

int main(void)
{
    TEST(jacobians);
    TEST(accelerations);
    TEST(axes_turn);
    TEST(columns);
    TEST(dead_centres);
    TEST(arrays_of_the_state);
    TEST(mistakes);
    return check_report();
}
