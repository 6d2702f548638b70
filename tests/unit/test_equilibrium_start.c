/* SPDX-License-Identifier: BSD-3-Clause */
/* Motions that begin at an equilibrium: they stay there, at closed forms where there are any; what of the given start
 * does not count is said; what cannot begin there is refused by name. */
/* wings: analyses ensemble */
#include "base/file.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "loaded.h"
#include "model/data/state.h"
#include "model/data/variant.h"
#include "studies/simulate/trajectory.h"
#include <kempe/check.h>
#include <kempe/ensemble.h>
#include <kempe/gradient.h>
#include <kempe/sensitivity.h>
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

#define HALF_TURN 3.14159265358979323846
#define WEIGHT    9.81

static const char pendulum[] = "kempe: 1\n"
                               "gravity: [0, -9.81, 0]\n"
                               "parameters: {k: 0, wind: 0}\n"
                               "bodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], "
                               "inertia: {zz: 0.08}}}\n"
                               "forces: {spring: {joint: A, torque: 'wind - k*q(A)'}}\n"
                               "start: {q: {A: -20 deg}, qd: {A: 3}, at: equilibrium}\n"
                               "run: {t_end: 2, output_step: 0.05, rtol: 1e-10}\n";

/* A block on a floor, which a spring presses down, too. It starts above the floor. */
static const char block[] = "kempe: 1\n"
                            "gravity: [0, -9.81, 0]\n"
                            "bodies: {block: {joint: {name: y, prismatic: y, at: ground}, mass: 2}}\n"
                            "forces: {press: {joint: y, force: '-(100 + 50*q(y))'}}\n"
                            "contacts: {floor: {joint: y, lower: 0.25, restitution: 0.5}}\n"
                            "start: {q: {y: 1}, at: equilibrium}\n"
                            "run: {t_end: 2, output_step: 0.05, outputs: [q, qd, force(floor)]}\n";

/* A model before the state at its start was set, which must outlive the other one. */
static kempe_model *given;

static loaded load_at(const char *path, const char *state)
{
    loaded l = load(path);
    given = l.model;
    l.model = NULL;
    kempe_system_free(l.system);
    l.system = NULL;
    CHECK(kempe_model_start_in(given, state, &l.model) == KEMPE_OK);
    return load_finish(l);
}

static void unload_at(loaded *l)
{
    kempe_system_free(l->system);
    kempe_model_free(l->model);
    kempe_model_free(given);
    given = NULL;
    kempe_context_free(l->context);
}

static kempe_trajectory *run_of(const loaded *l, const kempe_run_options *options)
{
    kempe_trajectory *t = NULL;
    const kempe_status status = kempe_simulate(l->system, options, &t);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(l->context));
    CHECK(status == KEMPE_OK && t);
    return t;
}

/* The largest distance of a coordinate from the first row, rad or m. */
static double farthest(const loaded *l, const kempe_trajectory *t)
{
    double most = 0;
    for (int row = 0; row < kempe_trajectory_row_count(t); row++)
        for (int k = 0; k < kmp_model_coordinates(l->model); k++)
            most = fmax(most, fabs(kempe_trajectory_q(t, row)[k] - kempe_trajectory_q(t, 0)[k]));
    return most;
}

static bool says(const kempe_trajectory *t, kempe_format format, const char *words)
{
    char *text = NULL;
    CHECK(kempe_trajectory_print(t, format, &text) == KEMPE_OK);
    const bool found = text && check_says(text, words);
    if (!found)
        printf("'%s' is missing in:\n%.1500s\n", words, text ? text : "");
    kempe_text_free(text);
    return found;
}

/* -- it stays ------------------------------------------------------------------------------------------- */

static void a_pendulum_hangs(void)
{
    loaded l = load_text(pendulum);
    kempe_trajectory *t = run_of(&l, NULL);
    CHECK_NEAR(kempe_trajectory_q(t, 0)[0], -HALF_TURN / 2, 1e-12);
    CHECK(kempe_trajectory_qd(t, 0)[0] == 0);
    CHECK(farthest(&l, t) <= 1e-12);
    CHECK(says(t, KEMPE_TEXT, "begins at the equilibrium that its start leads to, stable"));
    CHECK(says(t, KEMPE_TEXT, "equilibrium has others: 'A' 3 rad/s"));
    CHECK(says(t, KEMPE_TEXT, "the farthest from the given start: 'A', by -1.222 rad"));
    CHECK(says(t, KEMPE_JSON, "\"start_at\": \"equilibrium\""));
    CHECK(says(t, KEMPE_JSON, "\"stability\": \"stable\""));
    kempe_trajectory_free(t);
    unload_at(&l);
}

/* The contact has the weight and the spring, from the first row on; the run has no impact. */
static void a_contact_presses(void)
{
    loaded l = load_text(block);
    kempe_trajectory *t = run_of(&l, NULL);
    for (int row = 0; row < kempe_trajectory_row_count(t); row += 10) {
        CHECK_NEAR(kempe_trajectory_q(t, row)[0], 0.25, 1e-14);
        CHECK_NEAR(fabs(kempe_trajectory_lambda(t, row)[0]), 2 * WEIGHT + 100 + 50 * 0.25, 1e-9);
    }
    CHECK(t->report.impacts == 0 && farthest(&l, t) <= 1e-14);
    kempe_trajectory_free(t);
    unload_at(&l);
}

static void mechanisms_stay(void)
{
    static const struct {
        const char *path;
        double most; /* rad or m */
    } models[] = {{"examples/double_four_bar/double_four_bar.yaml", 1e-8},
                  {"examples/four_bar/four_bar.yaml", 1e-9},
                  {"examples/stewart/stewart.yaml", 1e-9},
                  {"examples/quarter_car/quarter_car.yaml", 1e-9},
                  {"examples/limousine/limousine.yaml", 1e-9},
                  {"tests/models/friction_guide.yaml", 1e-12},
                  {"tests/models/contact_slider_crank.yaml", 1e-12}};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        loaded l = load_at(models[k].path, "equilibrium");
        kempe_trajectory *t = run_of(&l, &(kempe_run_options){.t_end = 0.5, .no_convergence_check = 1});
        const double far = farthest(&l, t);
        if (!(far <= models[k].most))
            printf("%s: %.3g\n", models[k].path, far);
        CHECK(far <= models[k].most);
        kempe_trajectory_free(t);
        unload_at(&l);
    }
}

/* A vehicle on its springs rolls on: its wheels turn at the rates of the start, everything else is at rest. */
static void a_vehicle_rolls_on(void)
{
    loaded l = load_at("examples/suspension/suspension.yaml", "equilibrium");
    kempe_trajectory *t = run_of(&l, &(kempe_run_options){.t_end = 0.5, .no_convergence_check = 1});
    const int wheel = coordinate_named(&l, "left_wheel"), z = coordinate_named(&l, "z");
    const int last = kempe_trajectory_row_count(t) - 1;
    CHECK_NEAR(kempe_trajectory_qd(t, last)[wheel], 40, 1e-9);
    CHECK_NEAR(kempe_trajectory_q(t, last)[z], kempe_trajectory_q(t, 0)[z], 1e-10);
    CHECK(fabs(kempe_trajectory_qd(t, last)[z]) <= 1e-10);
    CHECK(says(t, KEMPE_TEXT, "begins at the steady motion that its start leads to"));
    kempe_trajectory_free(t);
    unload_at(&l);
}

static void rates_may_be_given(void)
{
    loaded l = load_at("examples/governor/governor.yaml", "equilibrium shaft=5.5");
    kempe_trajectory *t = run_of(&l, &(kempe_run_options){.t_end = 0.5, .rtol = 1e-11, .no_convergence_check = 1});
    const int shaft = coordinate_named(&l, "shaft"), slider = coordinate_named(&l, "slider");
    const int last = kempe_trajectory_row_count(t) - 1;
    CHECK_NEAR(kempe_trajectory_qd(t, 0)[shaft], 5.5, 1e-15);
    CHECK_NEAR(kempe_trajectory_q(t, last)[slider], kempe_trajectory_q(t, 0)[slider], 1e-8);
    kempe_trajectory_free(t);
    unload_at(&l);
}

/* -- states --------------------------------------------------------------------------------------------- */

/* The integral of a controller holds the rod horizontal: its torque is the moment of the weight. */
static void states_have_their_values(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\n"
                         "states: {sum: {rate: '20*(0 - q(A))'}, late: {sample: 10 ms, next: sum, start: 7}}\n"
                         "bodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0], "
                         "inertia: {zz: 0.08}}}\n"
                         "forces: {motor: {joint: A, torque: 'sum - 30*q(A) - 4*qd(A)'}}\n"
                         "start: {q: {A: -20 deg}, at: equilibrium}\n"
                         "run: {t_end: 2, output_step: 0.5}\n");
    kempe_trajectory *t = run_of(&l, NULL);
    const double *qd = kempe_trajectory_qd(t, 0), *end = kempe_trajectory_qd(t, kempe_trajectory_row_count(t) - 1);
    CHECK_NEAR(qd[1], WEIGHT / 2, 1e-10);
    CHECK_NEAR(qd[2], WEIGHT / 2, 1e-10);
    CHECK_NEAR(end[1], WEIGHT / 2, 1e-10);
    CHECK(fabs(kempe_trajectory_q(t, 0)[0]) <= 1e-11 && farthest(&l, t) <= 1e-10);
    kempe_trajectory_free(t);
    unload_at(&l);
}

#define DELAYED(more)                                                                                                  \
    "kempe: 1\nstates: {late: {delay: q(x), time: 0.2" more "}}\n"                                                     \
    "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"                                             \
    "forces: {f: {joint: x, force: '3 + 0.5*late - 2*q(x) - qd(x)'}}\n"                                                \
    "start: {q: {x: 0.3}, at: equilibrium}\n"                                                                          \
    "run: {t_end: 1, output_step: 0.25}\n"

/* The signal of a delay has always had its value of the equilibrium, x = 3/1.5, also where a start value is given. A
 * past of its own contradicts that. */
static void delays_have_always_been_there(void)
{
    static const char *const texts[] = {DELAYED(""), DELAYED(", start: 5")};
    for (int k = 0; k < 2; k++) {
        loaded l = load_text(texts[k]);
        kempe_trajectory *t = run_of(&l, NULL);
        CHECK_NEAR(kempe_trajectory_q(t, 0)[0], 2, 1e-10);
        CHECK(farthest(&l, t) <= 1e-9);
        kempe_trajectory_free(t);
        unload_at(&l);
    }
    loaded l = load_text(DELAYED(", before: 't'"));
    kempe_trajectory *t = NULL;
    CHECK(kempe_simulate(l.system, NULL, &t) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "contradicts the 'before' of 'late'"));
    kempe_trajectory_free(t);
    unload_at(&l);
}

/* -- what is said ------------------------------------------------------------------------------------------ */

static void an_unstable_one_is_said(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\n"
                         "bodies: {rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0, 0.5, 0], "
                         "inertia: {zz: 0.08}}}\n"
                         "start: {at: equilibrium}\nrun: {t_end: 0.5, output_step: 0.1}\n");
    kempe_trajectory *t = run_of(&l, NULL);
    /* exp(s t) with s^2 = m g c / (J + m c^2) */
    char words[80];
    (void)snprintf(words, sizeof words, "unstable: 1 motion grows, the fastest as exp(%.6g t)",
                   sqrt(WEIGHT * 0.5 / 0.33));
    char *text = NULL, *flat = NULL;
    CHECK(kempe_trajectory_print(t, KEMPE_JSON, &text) == KEMPE_OK);
    flat = text ? strstr(text, words) : NULL;
    CHECK(flat && strstr(text, "start: the equilibrium is unstable"));
    kempe_text_free(text);
    kempe_trajectory_free(t);
    unload_at(&l);
}

static void friction_is_named(void)
{
    loaded l = load_at("tests/models/friction_guide.yaml", "equilibrium");
    kempe_trajectory *t = run_of(&l, &(kempe_run_options){.t_end = 0.1, .no_convergence_check = 1});
    CHECK(says(t, KEMPE_TEXT, "friction that has no force there, and sticks: 'guide'"));
    CHECK(says(t, KEMPE_TEXT, "rates of the given start that do not count"));
    kempe_trajectory_free(t);
    unload_at(&l);
}

static void none_is_refused(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\n"
                         "bodies: {stone: {joint: {name: y, prismatic: y, at: ground}, mass: 1}}\n"
                         "start: {at: equilibrium}\nrun: {t_end: 1}\n");
    kempe_trajectory *t = NULL;
    kempe_assembly *a = NULL;
    CHECK(kempe_simulate(l.system, NULL, &t) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "no equilibrium: nothing restrains 'y'"));
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_E_FAILED && a);
    char *text = NULL;
    CHECK(kempe_assembly_print(a, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "failed, the loops are closed, but no equilibrium is found"));
    kempe_text_free(text);
    kempe_assembly_free(a);
    kempe_trajectory_free(t);
    unload_at(&l);
}

/* A torque that changes with time moves the rod away from its equilibrium, which the integral of a controller has. */
static const char driven[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {c: 0.5, load: 2, hill: 1}\n"
    "states: {sum: {rate: '20*(0.1 - q(A))'}}\n"
    "bodies:\n  rod: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [c, 0, 0], inertia: {zz: 0.08}}\n"
    "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
    "forces:\n  motor: {joint: A, torque: 'sum - 30*q(A) - 4*qd(A) - load + sin(5*t)'}\n"
    "start: {q: {A: -20 deg, x: 3*hill}, at: equilibrium}\nrun: {t_end: 0.5}\n";

/* The derivatives of the first row and of the last one, against central differences of runs of models with other
 * parameters, each of which begins at its own equilibrium. */
static void derivatives_are_differences(void)
{
    static const struct {
        const char *path, *text, *name, *output, *coordinate;
        bool rate;
        double value, step;
    } cases[] = {{NULL, pendulum, "k", "q(A)", "A", false, 5, 1e-4},
                 {NULL, driven, "c", "qd(A)", "A", true, 0.5, 1e-5},
                 {NULL, driven, "load", "state(sum)", "sum", true, 2, 1e-4},
                 {NULL, driven, "hill", "q(x)", "x", false, 1, 1e-4},
                 {"examples/double_four_bar/double_four_bar.yaml", NULL, "k", "q(lever)", "lever", false, 60, 1e-3},
                 {"examples/double_four_bar/double_four_bar.yaml", NULL, "rod", "q(crank)", "crank", false, 0.7, 1e-6},
                 {"examples/stewart/stewart.yaml", NULL, "k", "q(platform.3)", "platform.3", false, 2000, 0.1},
                 {"examples/quarter_car/quarter_car.yaml", NULL, "spring", "q(body)", "body", false, 18000, 1}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = cases[k].path ? load_at(cases[k].path, "equilibrium") : load_text(cases[k].text);
        const kempe_run_options run = {.t_end = 0.5, .rtol = 1e-11, .no_convergence_check = 1, .output_step = 0.5};
        kempe_model *base = NULL, *moved[2] = {NULL, NULL};
        CHECK(kmp_variant_instance(l.model, 1, &cases[k].name, &cases[k].value, &base) == KEMPE_OK);
        kempe_sensitivity *s = NULL;
        kempe_table *rows = NULL;
        const kempe_status status = kempe_sensitivity_new(
            base, &(kempe_sensitivity_options){.parameters = cases[k].name, .outputs = cases[k].output, .run = &run},
            &s);
        if (status != KEMPE_OK)
            printf("%s\n", kempe_context_message(l.context));
        CHECK(status == KEMPE_OK && kempe_sensitivity_table(s, "rows", &rows) == KEMPE_OK);
        double ends[2][2] = {{0}};
        for (int side = 0; side < 2; side++) {
            const double value = cases[k].value + (side ? cases[k].step : -cases[k].step);
            kempe_system *system = NULL;
            kempe_trajectory *t = NULL;
            CHECK(kmp_variant_instance(l.model, 1, &cases[k].name, &value, &moved[side]) == KEMPE_OK &&
                  kempe_system_new(moved[side], &system) == KEMPE_OK && kempe_simulate(system, &run, &t) == KEMPE_OK);
            for (int end = 0; t && end < 2; end++) {
                const int row = end ? kempe_trajectory_row_count(t) - 1 : 0;
                const double *x = cases[k].rate ? kempe_trajectory_qd(t, row) : kempe_trajectory_q(t, row);
                ends[side][end] = x[coordinate_named(&l, cases[k].coordinate)];
            }
            kempe_trajectory_free(t);
            kempe_system_free(system);
        }
        for (int end = 0; rows && end < 2; end++) {
            const int row = end ? kempe_table_row_count(rows) - 1 : 0;
            const double slope = kempe_table_number(rows, row, 2);
            const double difference = (ends[1][end] - ends[0][end]) / (2 * cases[k].step);
            if (!(fabs(slope - difference) <= 2e-6 * fmax(fabs(difference), 1e-3)))
                printf("%s by %s at row %d: %.12g, differences %.12g\n", cases[k].output, cases[k].name, row, slope,
                       difference);
            CHECK(fabs(slope - difference) <= 2e-6 * fmax(fabs(difference), 1e-3));
        }
        kempe_table_free(rows);
        kempe_sensitivity_free(s);
        kempe_model_free(base);
        kempe_model_free(moved[0]);
        kempe_model_free(moved[1]);
        unload_at(&l);
    }
}

static void derivatives_are_refused(void)
{
    static const struct {
        const char *path, *state, *parameter, *why;
    } cases[] = {{"examples/governor/governor.yaml", "equilibrium", "M", "it is a steady motion"},
                 {"tests/models/friction_guide.yaml", "equilibrium", "mu", "friction that sticks, and rigid contacts"},
                 {"tests/models/arm.yaml", "equilibrium", "x", "no force restrains 'A' there"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = load_at(cases[k].path, cases[k].state);
        kempe_sensitivity *s = NULL;
        CHECK(kempe_sensitivity_new(l.model,
                                    &(kempe_sensitivity_options){.parameters = cases[k].parameter, .outputs = "q"},
                                    &s) == KEMPE_E_FAILED);
        CHECK(strstr(kempe_context_message(l.context), cases[k].why));
        kempe_sensitivity_free(s);
        unload_at(&l);
    }
    loaded l = load_text("kempe: 1\nparameters: {k: 1}\nstates: {s: {rate: 'q(x) - s'}}\nbodies: {m: {joint: {name: x, "
                         "prismatic: x, at: ground}, mass: 1}}\nforces: {f: {joint: x, force: 's - 2*k*q(x)'}}\n"
                         "start: {at: equilibrium}\n");
    kempe_gradient *g = NULL;
    CHECK(kempe_gradient_new(l.model, &(kempe_gradient_options){.parameters = "k", .driven = "x"}, &g) ==
          KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "leave 'at' out"));
    kempe_gradient_free(g);
    unload(&l);
}

/* -- other starts --------------------------------------------------------------------------------------------- */

static void words_are_checked(void)
{
    loaded l = load_text(pendulum);
    kempe_model *started = NULL;
    CHECK(kempe_model_start_in(l.model, "rest", &started) == KEMPE_E_ARGUMENT && !started);
    CHECK(strstr(kempe_context_message(l.context), "unknown state 'rest'"));
    unload_at(&l);
    l = load_at("examples/governor/governor.yaml", "equilibrium shat=5");
    kempe_trajectory *t = NULL;
    CHECK(kempe_simulate(l.system, NULL, &t) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(l.context), "'shat'") && strstr(kempe_context_message(l.context), "shaft"));
    kempe_trajectory_free(t);
    unload_at(&l);
}

/* The position of a start that is given afterwards counts; the word "start" takes the model back. */
static void a_given_position_counts(void)
{
    const double q = 0.4;
    loaded l = load_text(pendulum);
    kempe_model *started[2] = {NULL, NULL};
    CHECK(kempe_model_start_at(l.model, &q, NULL, &started[0]) == KEMPE_OK);
    CHECK(kempe_model_start_in(l.model, "start", &started[1]) == KEMPE_OK);
    const double places[] = {q, -20 * HALF_TURN / 180};
    for (int k = 0; k < 2; k++) {
        kempe_system *s = NULL;
        kempe_assembly *a = NULL;
        CHECK(kempe_system_new(started[k], &s) == KEMPE_OK && kempe_assembly_new(s, &a) == KEMPE_OK);
        CHECK_NEAR(kempe_assembly_q(a)[0], places[k], 1e-15);
        CHECK_NEAR(kempe_assembly_qd(a)[0], 3, 1e-15);
        kempe_assembly_free(a);
        kempe_system_free(s);
        kempe_model_free(started[k]);
    }
    unload_at(&l);
}

/* Each instance has the equilibrium of its own parameters: the angle at which the spring carries the weight. */
static void instances_have_their_own(void)
{
    loaded l = load_text(pendulum);
    kempe_ensemble *e = NULL;
    kempe_ensemble_result *b = NULL;
    static const char *const names[] = {"k"};
    const double values[] = {0, 5, 20, 80};
    kempe_values *set = NULL;
    CHECK(kempe_values_new(l.model, 1, names, 4, values, &set) == KEMPE_OK);
    CHECK(kempe_ensemble_new(l.model, set, &e) == KEMPE_OK && kempe_ensemble_run(e, NULL, 0, &b) == KEMPE_OK);
    for (int k = 0; b && k < 4; k++) {
        const double q = kempe_ensemble_result_q(b, k)[0];
        CHECK(fabs(WEIGHT / 2 * cos(q) + values[k] * q) <= 1e-9);
        CHECK(fabs(kempe_ensemble_result_qd(b, k)[0]) <= 1e-9);
    }
    char *text = NULL;
    CHECK(b && kempe_ensemble_result_print(b, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "each instance begins at the equilibrium that its own start leads to"));
    kempe_text_free(text);
    kempe_ensemble_result_free(b);
    kempe_ensemble_free(e);
    kempe_values_free(set);
    unload_at(&l);
}

/* A run that continues has the state of its checkpoint, and the same start; another start is refused. */
static void a_run_continues(void)
{
    char path[] = "/tmp/kempe_equilibrium_XXXXXX";
    loaded l = load_text(pendulum);
    const int file = mkstemp(path);
    CHECK(file >= 0);
    kempe_trajectory *t = run_of(&l, &(kempe_run_options){.t_end = 1, .no_convergence_check = 1, .checkpoint = path});
    kempe_trajectory_free(t);
    t = run_of(&l, &(kempe_run_options){.t_end = 2, .no_convergence_check = 1, .resume = path});
    CHECK(says(t, KEMPE_JSON, "\"start_at\": \"equilibrium\"") && says(t, KEMPE_JSON, "\"stability\": \"stable\""));
    CHECK_NEAR(kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1)[0], -HALF_TURN / 2, 1e-12);
    kempe_trajectory_free(t);
    kempe_model *other = NULL;
    kempe_system *s = NULL;
    CHECK(kempe_model_start_in(l.model, "start", &other) == KEMPE_OK && kempe_system_new(other, &s) == KEMPE_OK);
    t = NULL;
    CHECK(kempe_simulate(s, &(kempe_run_options){.t_end = 2, .resume = path}, &t) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(l.context), "of this model from another start"));
    kempe_trajectory_free(t);
    kempe_system_free(s);
    kempe_model_free(other);
    close(file);
    unlink(path);
    unload_at(&l);
}

int main(void)
{
    TEST(a_pendulum_hangs);
    TEST(a_contact_presses);
    TEST(mechanisms_stay);
    TEST(a_vehicle_rolls_on);
    TEST(rates_may_be_given);
    TEST(states_have_their_values);
    TEST(delays_have_always_been_there);
    TEST(an_unstable_one_is_said);
    TEST(friction_is_named);
    TEST(none_is_refused);
    TEST(derivatives_are_differences);
    TEST(derivatives_are_refused);
    TEST(words_are_checked);
    TEST(a_given_position_counts);
    TEST(instances_have_their_own);
    TEST(a_run_continues);
    return check_report();
}
