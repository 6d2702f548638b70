/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* A finished run gives the rows that a second run has at other times: with every method, across events, exchanges of
 * coordinates, samples of inputs, centrings and change points; and every kind of output there. */
#include "api/sampled.h"
#include "four_bar_text.h"
#include "loaded.h"
#include "model/data/output.h"
#include "model/data/output_table.h"
#include <kempe/kempe.h>
#include <kempe/output_handles.h>
#include <kempe/table.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

/* Differences between a run with its own rows and a run with few, at these rows. */
typedef struct off {
    double most;
    int rows, equal;
} off;

static void compare(off *o, int count, const double *a, const double *b)
{
    double size = 0;
    for (int i = 0; i < count; i++)
        size = fmax(size, fabs(b[i]));
    for (int i = 0; i < count; i++)
        o->most = check_max(o->most, fabs(a[i] - b[i]) / fmax(size, 1));
    o->rows++;
    o->equal += memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

/* Runs with rows at every `step`, and with dense output and few rows; the differences of q, qd, qdd and lambda. */
typedef struct pair {
    kempe_trajectory *many, *few;
} pair;

static pair run_both(const kempe_system *system, kempe_run_options run, double step, kempe_status expected)
{
    pair p = {0};
    run.no_convergence_check = 1;
    run.output_step = step;
    CHECK(kempe_simulate(system, &run, &p.many) == expected);
    run.output_step = 0.37;
    run.keep_dense = 1;
    CHECK(kempe_simulate(system, &run, &p.few) == expected);
    CHECK(p.many && p.few);
    return p;
}

static void free_both(pair *p)
{
    kempe_trajectory_free(p->few);
    kempe_trajectory_free(p->many);
}

/* In an order that goes to and fro. */
static void compare_rows(const pair *p, const kempe_model *model, const kempe_system *system, off found[4])
{
    enum { STRIDE = 37 };
    int n = kempe_model_coordinate_count(model), m = kempe_system_row_count(system);
    int rows = kempe_trajectory_row_count(p->many);
    double *row = malloc((size_t)(3 * n + m) * sizeof *row);
    CHECK(rows % STRIDE != 0);
    for (int i = 0; p->few && i < rows; i++) {
        int k = i * STRIDE % rows;
        double t = kempe_trajectory_time(p->many, k);
        CHECK(kempe_trajectory_at_time(p->few, t, row, row + n, row + 2 * n, row + 3 * n) == KEMPE_OK);
        compare(&found[0], n, row, kempe_trajectory_q(p->many, k));
        compare(&found[1], n, row + n, kempe_trajectory_qd(p->many, k));
        compare(&found[2], n, row + 2 * n, kempe_trajectory_qdd(p->many, k));
        compare(&found[3], m, row + 3 * n, kempe_trajectory_lambda(p->many, k));
    }
    free(row);
}

static void print(const char *name, const off found[4])
{
    printf("  %-32s", name);
    for (int i = 0; i < 4; i++)
        printf("  %.1e (%d of %d equal)", found[i].most, found[i].equal, found[i].rows);
    printf("\n");
}

/* Number of events of a kind in the log. */
static int count_in_log(const kempe_trajectory *t, const char *kind)
{
    kempe_table *log = NULL;
    int count = 0;
    CHECK(t && kempe_trajectory_table(t, "log", &log) == KEMPE_OK);
    for (int row = 0; log && row < kempe_table_row_count(log); row++)
        count += strcmp(kempe_table_word(log, row, kempe_table_find(log, "kind")), kind) == 0;
    kempe_table_free(log);
    return count;
}

/* The formulations close rows from the polynomial alone where v is among the unknowns, and their integrators' own
 * polynomials are kept: then rows are equal to the bit. */
static bool is_exact(const method *m)
{
    return strcmp(m->formulation, "reduced") == 0 &&
           (strncmp(m->integrator, "dop", 3) == 0 || strcmp(m->integrator, "radau") == 0);
}

static const char switching[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\n"
    "inputs: {u: {unit: N*m, t: [0, 0.3, 0.61, 1.5], value: [0.2, 3, -1, 0.5], method: hold}}\n" FOUR_BAR_TEXT
    "forces: {motor: {joint: A, torque: \"if(sin(q(A)) > 0, 3 + u, u - 1) - 0.3*qd(A)\"}, "
    "spring: {spring: [ground.B, crank.P], stiffness: 20, free_length: 0.5}}\n"
    "sensors: {power: \"u*qd(A)\"}\n"
    "start: {q: {A: 0.5, C: 0.5, R: 1.5}, qd: {A: 6}}\n";

/* Samples are among the times of the rows. */
static void every_method(void)
{
    loaded s = load_text(switching);
    for (int k = 0; k < METHODS; k++) {
        const method *m = &methods[k];
        off found[4] = {{0}};
        char name[64];
        bool reduced = strcmp(m->formulation, "reduced") == 0;
        kempe_run_options run = options(m, 3, 1e-7);
        run.independent = reduced ? "R" : NULL; /* the rocker stops at its dead centres */
        pair p = run_both(s.system, run, 0.01, KEMPE_OK);
        compare_rows(&p, s.model, s.system, found);
        (void)snprintf(name, sizeof name, "%s %s %s", m->formulation, m->form ? m->form : "", m->integrator);
        print(name, found);
        CHECK(count_in_log(p.few, "event") > 0 && (!reduced || count_in_log(p.few, "exchange") > 0));
        for (int i = 0; i < 4; i++)
            CHECK(found[i].rows == 301 && found[i].most < (is_exact(m) ? 1e-300 : 1e-12));
        free_both(&p);
    }
    unload(&s);
}

/* Through centrings of a spherical joint, change points, friction that sticks, samples of states, the end by a
 * condition, stiff contact, articulated bodies. */
static void further_models(void)
{
    static const char tumbling[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\nbodies: {top: {joint: {name: S, spherical: x, at: ground}, mass: 1, com: "
        "[0, 0, 0.3], inertia: {xx: 0.02, yy: 0.03, zz: 0.05}}}\nstart: {q: {S.1: 0.2}, qd: {S.1: 3, S.2: -5, S.3: "
        "4}}\n";
    static const char sticking[] =
        "kempe: 1\nbodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\nforces: {k: {joint: x, "
        "spring: {stiffness: 100}}, f: {joint: x, friction: {force: 3, static: 8}}}\nstart: {q: {x: 0.25}}\n";
    static const char controlled[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nstates: {low: {rate: 5*(q(A) - low)}, u: {sample: 0.05, next: "
        "\"-20*low - 2*qd(A)\"}}\nbodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0, -1, "
        "0]}}\n"
        "forces: {motor: {joint: A, torque: u}}\nstart: {q: {A: 1}}\n";
    static const struct {
        const char *model, *formulation, *kind;
        double t_end, step, allowed;
        kempe_status status;
    } cases[] = {{sticking, NULL, "friction", 2, 0.01, 1e-300, KEMPE_OK},
                 {controlled, NULL, NULL, 2, 0.01, 1e-300, KEMPE_OK},
                 {tumbling, "reduced", "centring", 4, 0.01, 1e-300, KEMPE_OK},
                 {"tests/models/antiparallelogram.yaml", "reduced", "change point", 5, 0.01, 1e-11, KEMPE_OK},
                 {"tests/models/antiparallelogram.yaml", "projected", "change point", 5, 0.01, 1e-11, KEMPE_OK},
                 {"tests/models/locked_slider_crank.yaml", NULL, NULL, 3, 0.01, 1e-300, KEMPE_STOPPED},
                 {"tests/models/pendulum_stops.yaml", NULL, NULL, 3, 0.01, 1e-300, KEMPE_OK},
                 {"tests/models/guide_friction.yaml", NULL, NULL, 1, 0.01, 1e-12, KEMPE_OK},
                 /* further steps are made within a step, where its polynomial is coarse */
                 {"tests/models/full_film_rotor.yaml", "reduced", NULL, 0.05, 0.0005, 1e-12, KEMPE_OK},
                 {"tests/models/friction_incline.yaml", NULL, NULL, 1, 0.0005, 1e-12, KEMPE_OK},
                 {"examples/stewart/stewart.yaml", NULL, NULL, 0.5, 0.003, 1e-300, KEMPE_OK},
                 {"examples/suspension/suspension.yaml", NULL, NULL, 0.5, 0.003, 1e-300, KEMPE_OK},
                 /* its contact turns the last digit of a position into the eleventh of an acceleration */
                 {"examples/rolling_wheel/rolling_wheel.yaml", NULL, NULL, 0.5, 0.003, 1e-10, KEMPE_OK}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        off found[4] = {{0}};
        loaded s = strchr(cases[k].model, '\n') ? load_text(cases[k].model) : load(cases[k].model);
        kempe_run_options run = {.t_end = cases[k].t_end, .formulation = cases[k].formulation};
        pair p = run_both(s.system, run, cases[k].step, cases[k].status);
        compare_rows(&p, s.model, s.system, found);
        print(strchr(cases[k].model, '\n') ? "a text" : strrchr(cases[k].model, '/') + 1, found);
        CHECK(!cases[k].kind || count_in_log(p.few, cases[k].kind) > 0);
        for (int i = 0; i < 4; i++)
            CHECK(found[i].rows > 20 && found[i].most < cases[k].allowed);
        free_both(&p);
        unload(&s);
    }
}

/* No digit of a motion whose forces depend on multipliers depends on the rows that are read: multipliers begin where
 * the integrator left them, and evaluations for rows do not count when programs are made. */
static void same_motion(void)
{
    static const char *const models[] = {"friction_five_bar", "friction_pin", "rubbing_pin", "guide_friction_carrier",
                                         "friction_delayed"};
    static const method by[] = {{"projected", NULL, "dop853"},
                                {"projected", NULL, "radau"},
                                {"reduced", "integrated", "dop853"},
                                {"reduced", "integrated", "radau"}};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        char path[64];
        (void)snprintf(path, sizeof path, "tests/models/%s.yaml", models[k]);
        loaded s = load(path);
        for (size_t w = 0; w < sizeof by / sizeof *by; w++) {
            const kempe_run_options run = {
                .formulation = by[w].formulation, .form = by[w].form, .integrator = by[w].integrator, .t_end = 0.6};
            pair p = run_both(s.system, run, 0.6 / 1733, KEMPE_OK);
            const int n = kempe_model_coordinate_count(s.model);
            const double *many = kempe_trajectory_q(p.many, kempe_trajectory_row_count(p.many) - 1);
            const double *few = kempe_trajectory_q(p.few, kempe_trajectory_row_count(p.few) - 1);
            CHECK(memcmp(many, few, (size_t)n * sizeof *many) == 0);
            free_both(&p);
        }
        unload(&s);
    }
}

/* -- outputs ------------------------------------------------------------------------------------------- */

static const struct {
    const char *model, *words;
} observed[] = {
    {switching,
     "q, qd, qdd, lambda, position(coupler.Q), velocity(coupler.Q), acceleration(coupler.Q), axes(coupler.Q), "
     "angular_velocity(coupler.Q), reaction(q), moment(q), force(motor), force(spring), energy, "
     "momentum, momentum(crank), angular_momentum(crank about ground.B), power, sensor(power)"},
    {"tests/models/one_wheel.yaml", "force(L), contact(L), guidance(L), pose(L), axes(wheel.C), energy"},
    {"kempe: 1\nstates: {y: {start: 1, rate: -y}}\nbodies: {m: {joint: {prismatic: x, at: ground}, mass: 1}}\n"
     "forces: {f: {joint: m, force: y}}\n",
     "state, q, qd, qdd, energy, momentum, momentum(m)"},
    {"kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\n"
     "bodies: {ball: {joint: {name: z, prismatic: z, at: ground}, mass: 1, points: {C: [0, 0, 0]}}}\n"
     "contacts: {floor: {sphere: ball.C, radius: 0.1, on: {plane: ground.O}, restitution: 0.8}}\n"
     "start: {q: {z: 1.1}}\n",
     "gap(floor), force(floor), lambda, q, qd, qdd, energy, momentum, momentum(ball)"},
    {"kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: {at: [0, 0, 0], axes: {z: -y, x: x}}, E: [-0.1, 0, -1]}}\n"
     "bodies: {m: {joint: {motions: [T1, T3], coordinates: [x, z], at: ground}, mass: 10, points: {P: [0, 0, 0]}}}\n"
     "ropes: {r: {along: [ground.E, {round: ground.O, radius: 0.1, turn: right}, m.P], stiffness: 4 kN/m}}\n"
     "start: {q: {x: 0.15, z: -1}}\n",
     "tension(r), length(r), wrap(r.2), force(r), q, qd, qdd, energy"},
    {"kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
     "    flexible: {beam: {length: 1, young: 70 GPa, density: 2700, section: {rectangle: [4 mm, 20 mm]}}, shapes: {y: "
     "2}}\n"
     "    points: {tip: {station: 1}, mid: {station: 0.5, offset: [0, 2 mm, 0]}}\n"
     "bearings: {main: {joint: A, at: [-10 mm, 20 mm]}}\n",
     "bearing(main), deflection(rod.tip), section(rod.mid), section_by_shapes(rod.mid), stress(rod.mid), q, qd, qdd, "
     "energy"},
    {"kempe: 1\noutlines: {c: {law: [{to: 180 deg, rise: 10 mm, by: polynomial_4567}, {to: 360 deg, rise: -10 mm, by: "
     "cycloidal}], base: 40 mm, follower: {roller: 8 mm}}}\nbodies:\n"
     "  s: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {C: [0, 0, 0]}}\n"
     "  v: {joint: {prismatic: y, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
     "  w: {joint: {prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
     "loops: {cam: {follower: v.P, roller: 8 mm, on: {outline: c, at: s.C}}}\n"
     "contacts: {tappet: {sphere: w.P, radius: 8 mm, on: {outline: c, at: s.C}, restitution: 0}}\n"
     "forces: {f: {joint: v, force: \"-100*q(v)\"}, g: {joint: w, force: \"-100*q(w)\"}}\n"
     "start: {q: {v: 0.05, w: 0.06}, qd: {s: 3}}\n",
     "force(cam), pressure_angle(cam), curvature(cam), force(tappet), pressure_angle(tappet), curvature(tappet), "
     "gap(tappet), q, qd, energy"}};

static void every_output(void)
{
    for (size_t k = 0; k < sizeof observed / sizeof *observed; k++) {
        loaded s = strchr(observed[k].model, '\n') ? load_text(observed[k].model) : load(observed[k].model);
        kempe_outputs *o = NULL;
        double a[64], b[64];
        kempe_run_options run = {.t_end = 1, .formulation = "reduced", .integrator = "dop853"};
        pair p = run_both(s.system, run, 0.01, KEMPE_OK);
        CHECK(kempe_outputs_new(s.system, observed[k].words, &o) == KEMPE_OK);
        int count = kempe_outputs_count(o);
        CHECK(count > 10 && count <= 64);
        for (int row = 0; o && row < kempe_trajectory_row_count(p.many); row++) {
            CHECK(kempe_outputs_at_row(o, p.many, row, a) == KEMPE_OK);
            CHECK(kempe_outputs_at_time(o, p.few, kempe_trajectory_time(p.many, row), b) == KEMPE_OK);
            CHECK(memcmp(a, b, (size_t)count * sizeof *a) == 0);
        }
        kempe_outputs_free(o);
        free_both(&p);
        unload(&s);
    }
}

/* No kind is left out above. */
static void no_output_is_left_out(void)
{
    for (int kind = 0; kind < KMP_OUTPUT_KINDS; kind++) {
        bool found = false;
        for (size_t k = 0; k < sizeof observed / sizeof *observed; k++) {
            char word[64];
            (void)snprintf(word, sizeof word, "%s", kmp_output_rows[kind].word);
            found = found || strncmp(observed[k].words, word, strlen(word)) == 0;
            (void)snprintf(word, sizeof word, ", %s", kmp_output_rows[kind].word);
            found = found || strstr(observed[k].words, word);
        }
        if (!found)
            printf("  %s\n", kmp_output_rows[kind].word);
        CHECK(found);
    }
}

/* -- limits -------------------------------------------------------------------------------------------- */

static bool refuses(const kempe_context *context, kempe_status status, const char *words)
{
    if (!strstr(kempe_context_message(context), words))
        printf("  %s\n", kempe_context_message(context));
    return status == KEMPE_E_ARGUMENT && strstr(kempe_context_message(context), words);
}

static void times_outside(void)
{
    loaded s = load_text(switching);
    kempe_outputs *o = NULL;
    double q[3] = {7, 7, 7}, value = 7;
    pair p = run_both(s.system, (kempe_run_options){.t_end = 1}, 0.01, KEMPE_OK);
    CHECK(kempe_outputs_new(s.system, "power", &o) == KEMPE_OK);
    CHECK(refuses(s.context, kempe_trajectory_at_time(p.few, -1e-9, q, NULL, NULL, NULL), "not within the run"));
    CHECK(refuses(s.context, kempe_trajectory_at_time(p.few, 1 + 1e-9, q, NULL, NULL, NULL), "from 0 to 1 s"));
    CHECK(refuses(s.context, kempe_trajectory_at_time(p.few, NAN, q, NULL, NULL, NULL), "not within the run"));
    CHECK(refuses(s.context, kempe_trajectory_at_time(p.many, 0.5, q, NULL, NULL, NULL), "keep_dense"));
    CHECK(refuses(s.context, kempe_outputs_at_time(o, p.many, 0.5, &value), "keep_dense"));
    CHECK(refuses(s.context, kempe_outputs_at_time(o, p.few, 2, &value), "not within the run"));
    CHECK(refuses(s.context, kempe_outputs_at_time(o, p.few, 0.5, NULL), "values"));
    CHECK(kempe_trajectory_at_time(NULL, 0.5, q, NULL, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_outputs_at_time(NULL, p.few, 0.5, &value) == KEMPE_E_ARGUMENT);
    CHECK(kempe_outputs_at_time(o, NULL, 0.5, &value) == KEMPE_E_ARGUMENT);
    CHECK(q[0] == 7 && q[2] == 7 && value == 7);
    CHECK(kempe_trajectory_at_time(p.few, 0.5, NULL, NULL, NULL, NULL) == KEMPE_OK);
    kempe_outputs_free(o);
    free_both(&p);
    unload(&s);
}

/* A run that continues from a checkpoint has the states from there on. */
static void resumed(void)
{
    char path[] = "/tmp/kempe_between_rows_XXXXXX";
    loaded s = load_text(switching);
    double q[3];
    kempe_trajectory *t = NULL;
    CHECK(close(mkstemp(path)) == 0);
    kempe_run_options run = {.t_end = 0.5, .output_step = 0.1, .no_convergence_check = 1, .checkpoint = path};
    CHECK(kempe_simulate(s.system, &run, &t) == KEMPE_OK);
    kempe_trajectory_free(t);
    t = NULL;
    run =
        (kempe_run_options){.t_end = 1, .output_step = 0.1, .no_convergence_check = 1, .resume = path, .keep_dense = 1};
    CHECK(kempe_simulate(s.system, &run, &t) == KEMPE_OK);
    CHECK(refuses(s.context, kempe_trajectory_at_time(t, 0.4, q, NULL, NULL, NULL), "from 0.5 to 1 s"));
    CHECK(kempe_trajectory_at_time(t, 0.8, q, NULL, NULL, NULL) == KEMPE_OK);
    CHECK(memcmp(q, kempe_trajectory_q(t, 8), sizeof q) == 0);
    kempe_trajectory_free(t);
    unload(&s);
    (void)remove(path);
}

int main(void)
{
    TEST(every_method);
    TEST(further_models);
    TEST(same_motion);
    TEST(every_output);
    TEST(no_output_is_left_out);
    TEST(times_outside);
    TEST(resumed);
    return check_report();
}
