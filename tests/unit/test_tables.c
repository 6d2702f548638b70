/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of the model language: from lists and from a CSV file, as numbers and in equations. */
#include "base/context.h"
#include "base/memory.h"
#include "derived.h"
#include "dynamics/equations.h"
#include "loaded.h"
#include "model/data/model.h"
#include "symbolic/table_function.h"
#include "testing.h"
#include <kempe/kempe.h>

static kempe_context *context;

static const char head[] =
    "kempe: 1\nparameters: {half: 0.5}\ntables:\n"
    "  cube: {csv: lift.csv, x: angle, y: lift}\n"
    "  speed: {csv: lift.csv, x: angle, y: speed, method: linear}\n"
    "  line: {x: [0, half, 100 cm], y: [0, 1, 4], method: linear}\n"
    "bodies: {a: {joint: {prismatic: x, at: ground}, mass: line(0.75), com: [cube(1.5), 0, 0]}}\n";

static kempe_model *read_with(const char *rest)
{
    char text[2048];
    kempe_model *model = NULL;
    (void)snprintf(text, sizeof text, "%s%s", head, rest);
    if (kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/label.yaml", &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    return model;
}

static void constants(void)
{
    kempe_model *m = read_with("");
    if (!m)
        return;
    CHECK_NEAR(m->bodies[1].mass.value, 2.5, 1e-15);
    CHECK_NEAR(m->bodies[1].com[0].value, 3.375, 1e-14); /* the spline of a cubic is that cubic */
    CHECK(m->table_count == 3 && m->tables[1].table->count == 4 && m->tables[1].table->y[2] == -3);
    char *text = NULL;
    CHECK(kempe_model_print(m, KEMPE_TEXT, &text) == KEMPE_OK &&
          strstr(text, "  cube: spline, 4 points, x from 0 to 2\n") != NULL);
    kempe_text_free(text);
    CHECK(kempe_model_print(m, KEMPE_JSON, &text) == KEMPE_OK && strstr(text, "\"y\": [0, 1, 4]") != NULL);
    kempe_text_free(text);
    kempe_model_free(m);
}

/* The end of a run of 3 s with x = t: a force on 1 kg, whose impulse is the integral of the table. */
static void run_of(const char *table, double *qd, kempe_status wanted, const char *warning)
{
    char text[1000];
    kempe_model *m = NULL;
    kempe_system *s = NULL;
    kempe_trajectory *run = NULL;
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ntables: {f: {%s}}\n"
                   "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n"
                   "forces: {f: {joint: a, force: f(t)}}\n",
                   table);
    CHECK(kempe_model_read_text(context, text, "m.yaml", &m) == KEMPE_OK);
    CHECK(m && kempe_system_new(m, &s) == KEMPE_OK);
    kempe_status status = kempe_simulate(s, &(kempe_run_options){.t_end = 3, .rtol = 1e-10}, &run);
    CHECK(status == wanted);
    *qd = run ? *kempe_trajectory_qd(run, kempe_trajectory_row_count(run) - 1) : NAN;
    if (wanted == KEMPE_STOPPED)
        CHECK(run && strstr(kempe_trajectory_reason(run), "f(t) beyond the points 0 .. 2 at t = 2 s: ") != NULL);
    char *said = kmp_context_warnings(context);
    CHECK(said && (warning ? strstr(said, warning) != NULL : !said[0]));
    if (said && !warning && said[0])
        printf("%s\n", said);
    kmp_free(said);
    kempe_trajectory_free(run);
    kempe_system_free(s);
    kempe_model_free(m);
}

/* Areas by hand: of triangles and rectangles. */
static void beyond_the_points(void)
{
    double qd;
    run_of("x: [0, 1, 2], y: [0, 1, 3], method: linear", &qd, KEMPE_UNTRUSTED, "table 'f' is used at ");
    CHECK_NEAR(qd, 0.5 + 2 + 4, 1e-9);
    run_of("x: [0, 1, 2], y: [0, 1, 3], method: linear, outside: linear", &qd, KEMPE_OK, NULL);
    CHECK_NEAR(qd, 0.5 + 2 + 4, 1e-9);
    run_of("x: [0, 1, 2], y: [0, 1, 3], method: linear, outside: hold", &qd, KEMPE_OK, NULL);
    CHECK_NEAR(qd, 0.5 + 2 + 3, 1e-9);
    run_of("x: [0.5, 1, 2], y: [2, 1, 3], method: linear, outside: hold", &qd, KEMPE_OK, NULL);
    CHECK_NEAR(qd, 1 + 0.75 + 2 + 3, 1e-9);
    run_of("x: [0, 1, 2], y: [0, 1, 0], method: linear, periodic: yes", &qd, KEMPE_OK, NULL);
    CHECK_NEAR(qd, 1.5, 1e-9);
    run_of("x: [0, 1], y: [1, 3], method: linear, periodic: 2", &qd, KEMPE_OK, NULL);
    CHECK_NEAR(qd, 2 + 4 + 6, 1e-9);
    /* T3 of SciPy's PCHIP with a period, shifted; the integral of a symmetric step over whole periods */
    run_of("x: [0, 0.25, 0.5, 0.75, 1], y: [0, 0.1, 0.5, 0.9, 1], method: monotone, periodic: 1", &qd, KEMPE_OK, NULL);
    CHECK_NEAR(qd, 0.5 + 1.5 + 2.5, 1e-9);
    run_of("x: [0, 1, 2], y: [0, 1, 3], outside: error", &qd, KEMPE_STOPPED, NULL);
}

/* A ramp of slope 1/2 between two masses of 1 kg that holds at both ends. The plastic impact at its beginning leaves
 * 1/(1 + 1/4) of the rate, the follower stops at its end: 1 s, 1/0.8 s, and 0.75 s at 0.8 m/s. */
/* Cubes that begin at points of a table from the third to the last but two: a spline through their values has them. */
static double cubes(double x, int power)
{
    static const double begins[] = {2, 3, 4, 5, 6, 7, 8, 9}, factor[] = {0.3, -1.1, 1.7, -1.9, 2.1, -2.6, 3.3, -4.1};
    double sum = 0;
    for (int k = 0; k < 8; k++)
        sum += factor[k] * pow(fmax(x - begins[k], 0), power) / (power > 3 ? 4 : 1);
    return sum;
}

/* Steps of high order end at the points of a table, also of one with a period: the impulse of a table of time is the
 * integral, work of one of a coordinate the change of energy. */
static void points_of_curves(void)
{
    static const char *const integrators[] = {"dop853", "dopri5", "radau", "radau5", "radau9", "erk", "dirk"};
    char text[2000];
    size_t length = (size_t)snprintf(text, sizeof text,
                                     "kempe: 1\ntables:\n  zigzag: {x: [0, 0.31, 0.42, 1.1], y: [0, 1, -0.5, 0], "
                                     "method: linear, periodic: yes}\n  cubes: {x: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, "
                                     "10, 11], y: [");
    for (int k = 0; k < 12; k++)
        length += (size_t)snprintf(text + length, sizeof text - length, "%s%.17g", k > 0 ? ", " : "", cubes(k, 3));
    (void)snprintf(text + length, sizeof text - length,
                   "]}\nbodies:\n  a: {joint: {name: a, prismatic: x, at: ground}, mass: 1}\n"
                   "  b: {joint: {name: b, prismatic: x, at: ground}, mass: 1}\n"
                   "  c: {joint: {name: c, prismatic: x, at: ground}, mass: 1}\n"
                   "forces:\n  a: {joint: a, force: zigzag(t)}\n  b: {joint: b, force: cubes(t)}\n"
                   "  c: {joint: c, force: cubes(q(c))}\nstart: {qd: {c: 2}}\n");
    loaded l = load_text(text);
    for (size_t k = 0; l.system && k < sizeof integrators / sizeof *integrators; k++) {
        kempe_trajectory *run = NULL;
        kempe_run_options options = {
            .t_end = 5.5, .rtol = 1e-9, .integrator = integrators[k], .no_convergence_check = 1};
        CHECK(kempe_simulate(l.system, &options, &run) == KEMPE_OK);
        int last = run ? kempe_trajectory_row_count(run) - 1 : -1;
        const double *q = kempe_trajectory_q(run, last), *qd = kempe_trajectory_qd(run, last);
        CHECK_NEAR(qd ? qd[0] : NAN, 5 * (0.31 / 2 + 0.5 * 0.11 * 0.5 - 0.5 * 0.68 / 2), 5e-8);
        CHECK_NEAR(qd ? qd[1] : NAN, cubes(5.5, 4), 1e-9);
        CHECK_NEAR(qd ? qd[2] * qd[2] / 2 : NAN, 2 + cubes(q ? q[2] : NAN, 4), 2e-7);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

static void ramp_that_holds(void)
{
    static const char text[] = "kempe: 1\ntables: {lift: {x: [0, 1], y: [0, 0.5], outside: hold, method: linear}}\n"
                               "bodies:\n  cam: {joint: {prismatic: x, at: ground}, mass: 1}\n"
                               "  follower: {joint: {prismatic: y, at: ground}, mass: 1}\n"
                               "loops: {cam: {constraint: \"q(follower) - lift(q(cam))\"}}\n"
                               "start: {q: {cam: -1}, qd: {cam: 1}}\n";
    kempe_model *m = NULL;
    kempe_system *s = NULL;
    kempe_trajectory *run = NULL;
    CHECK(kempe_model_read_text(context, text, "m.yaml", &m) == KEMPE_OK);
    CHECK(m && kempe_system_new(m, &s) == KEMPE_OK);
    CHECK(s && kempe_simulate(s, &(kempe_run_options){.t_end = 3}, &run) == KEMPE_OK);
    if (run) {
        int last = kempe_trajectory_row_count(run) - 1;
        CHECK_NEAR(kempe_trajectory_q(run, last)[0], 1.6, 1e-9);
        CHECK_NEAR(kempe_trajectory_q(run, last)[1], 0.5, 1e-9);
        CHECK_NEAR(kempe_trajectory_qd(run, last)[0], 0.8, 1e-9);
    }
    kempe_trajectory_free(run);
    kempe_system_free(s);
    kempe_model_free(m);
}

/* In constants: wrapped and held as in equations. */
static void constants_beyond_the_points(void)
{
    kempe_model *m = NULL;
    CHECK(kempe_model_read_text(context,
                                "kempe: 1\ntables:\n"
                                "  turn: {x: [0, 0.25, 0.5, 0.75, 1], y: [0, 0.1, 0.5, 0.9, 1], periodic: 1}\n"
                                "  hold: {x: [0, 1], y: [1, 2], outside: hold}\n"
                                "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 3 + turn(-2.2), com: "
                                "[turn(1.3), turn(17.05), hold(7)]}}\n",
                                "m.yaml", &m) == KEMPE_OK);
    if (!m)
        return;
    CHECK_NEAR(m->bodies[1].mass.value, 3 - 2.0584, 1e-13);
    CHECK_NEAR(m->bodies[1].com[0].value, 1.1584, 1e-13);
    CHECK_NEAR(m->bodies[1].com[1].value, 17.0056, 1e-12);
    CHECK_NEAR(m->bodies[1].com[2].value, 2, 1e-15);
    kempe_model_free(m);
}

/* In a force and in a drive: value, and through h_t and gamma its first two derivatives. */
static void equations(void)
{
    derived d;
    kempe_model *m =
        read_with("forces: {f: {joint: a, force: \"cube(q(a))\"}}\ndrives: {m: {joint: a, displacement: cube(t)}}\n");
    if (!m)
        return;
    CHECK(derived_init(&d, m, KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD, KMP_SCHEME_COMPOSITE, false));
    state s = {.t = 1.25, .q = {0.75}, .qd = {2}};
    derived_eval(&d, &s);
    CHECK_NEAR(d.bias[0], -0.75 * 0.75 * 0.75, 1e-14);
    CHECK_NEAR(d.h[0], 0.75 - 1.25 * 1.25 * 1.25, 1e-14);
    CHECK_NEAR(d.h_t[0], -3 * 1.25 * 1.25, 1e-13);
    CHECK_NEAR(d.jdqd[0], -6 * 1.25, 1e-12);
    derived_free(&d);
    kempe_model_free(m);
}

/* Units of columns, in their names or in a line above them; `unit` is for a column without one. */
static void units_of_columns(void)
{
    static const char text[] =
        "kempe: 1\ntables:\n"
        "  torque: {csv: heads.csv, x: speed, y: torque, method: linear}\n"
        "  moment: {csv: heads.csv, x: 'speed [rpm]', y: moment, unit: N*cm, method: linear}\n"
        "inputs: {lift: {csv: above.csv, value: travel, method: linear}}\n"
        "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\nforces: {f: {joint: a, force: lift*(1 N/m)}}\n";
    kempe_model *m = NULL;
    CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/label.yaml", &m) == KEMPE_OK);
    if (!m) {
        printf("%s\n", kempe_context_message(context));
        return;
    }
    CHECK_NEAR(m->tables[0].table->x[1], 100 * acos(-1), 1e-12);
    CHECK_NEAR(m->tables[0].table->y[0], 2, 1e-15);
    CHECK_NEAR(m->tables[1].table->x[1], 100 * acos(-1), 1e-12);
    CHECK_NEAR(m->tables[1].table->y[0], 0.02, 1e-15);
    CHECK_NEAR(kmp_signal_value(&m->inputs[0].signal, 0.25), 0.01, 1e-15);
    kempe_model_free(m);
}

static void bad_sheets(void)
{
    static const char text[] =
        "kempe: 1\ntables: {b: {csv: bad.csv, x: x, y: y}, f: {csv: flat.csv, x: x, y: y},\n"
        "  s: {csv: semicolons.csv, x: speed, y: torque}, h: {csv: heads.csv, x: speed, y: heat},\n"
        "  n: {csv: heads.csv, x: speed, y: power}}\n"
        "bodies: {a: {joint: {revolute: z, at: ground}}}\n";
    kempe_model *m = NULL;
    CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/malformed/label", &m) == KEMPE_E_INPUT && !m);
    const char *said = kempe_context_message(context);
    CHECK(strstr(said, "/bad.csv:3:3: a number is expected here, not 'two'\n") != NULL);
    CHECK(strstr(said, "/bad.csv:4:1: column 2 is missing in this line\n") != NULL);
    CHECK(strstr(said, "/flat.csv:4:1: table 'f': x must increase: 1 comes after 1") != NULL);
    CHECK(strstr(said, "/semicolons.csv:1:6: a semicolon stands between the columns: a comma is expected") != NULL);
    CHECK(strstr(said, "/heads.csv:1:38: column 4: unknown unit 'degC'") != NULL);
    CHECK(strstr(said, "/heads.csv' has no column 'power': its columns are t, speed, torque, heat") != NULL);
}

int main(void)
{
    context = kempe_context_new();
    TEST(constants);
    TEST(equations);
    TEST(beyond_the_points);
    TEST(points_of_curves);
    TEST(ramp_that_holds);
    TEST(constants_beyond_the_points);
    TEST(units_of_columns);
    TEST(bad_sheets);
    kempe_context_free(context);
    return check_report();
}
