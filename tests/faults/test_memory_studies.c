/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow once 7 */
/* Every allocation fails once (test_memory.c), of the studies of a system. */
#include "exhaust.h"
#include <kempe/check.h>
#include <kempe/comfort.h>
#include <kempe/ensemble.h>
#include <kempe/equilibrium.h>
#include <kempe/gradient.h>
#include <kempe/inverse.h>
#include <kempe/kinematics.h>
#include <kempe/limit_cycles.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>

/* A rocker that comes to both dead centres, told in all ways. */
static kempe_status lead_rocker(scene *s)
{
    kempe_kinematics *kinematics = NULL;
    kempe_kinematics_options options = {.sweep = "rocker=-1:1:21"};
    kempe_table *table = NULL;
    char *report = NULL;
    kempe_status status = kempe_kinematics_new(s->system, &options, &kinematics);
    untouched(status, kinematics);
    if (status == KEMPE_STOPPED)
        status = kempe_kinematics_print(kinematics, KEMPE_JSON, &report);
    kempe_text_free(report);
    report = NULL;
    if (status == KEMPE_OK)
        status = kempe_kinematics_print(kinematics, KEMPE_TEXT, &report);
    if (status == KEMPE_OK)
        status = write_table(s, kempe_kinematics_table(kinematics, "rows", &table), &table);
    if (status == KEMPE_OK)
        status = write_table(s, kempe_kinematics_table(kinematics, "dead_centres", &table), &table);
    kempe_text_free(report);
    kempe_kinematics_free(kinematics);
    return status;
}

/* A run and an assembly at an equilibrium, told. */
static kempe_status begin_at_equilibrium(scene *s)
{
    kempe_model *started = NULL;
    kempe_system *system = NULL;
    kempe_assembly *assembly = NULL;
    kempe_trajectory *trajectory = NULL;
    char *report = NULL;
    const kempe_run_options run = {.t_end = 0.01, .no_convergence_check = 1};
    kempe_status status = kempe_model_start_in(s->model, "equilibrium", &started);
    untouched(status, started);
    if (status == KEMPE_OK)
        status = kempe_system_new(started, &system);
    if (status == KEMPE_OK)
        status = kempe_assembly_new(system, &assembly);
    if (status == KEMPE_OK)
        status = kempe_assembly_print(assembly, KEMPE_JSON, &report);
    kempe_text_free(report);
    report = NULL;
    if (status == KEMPE_OK)
        status = kempe_simulate(system, &run, &trajectory);
    if (status == KEMPE_OK)
        status = kempe_trajectory_print(trajectory, KEMPE_TEXT, &report);
    kempe_text_free(report);
    kempe_trajectory_free(trajectory);
    kempe_assembly_free(assembly);
    kempe_system_free(system);
    kempe_model_free(started);
    return status;
}

/* A rod on a crank: a sweep in balance with its loads, and the sensitivities of a start in balance. */
static kempe_status balance(scene *s)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {E: 1e9}\nbodies:\n  crank: {joint: {name: A, revolute: z, at: "
        "ground}, mass: 1, inertia: {zz: 0.1}, points: {E: [0.2, 0, 0]}}\n  a:\n    joint: {name: B, revolute: z, at: "
        "crank.E}\n    flexible: {beam: {length: 1, young: E, density: 1000, section: {circle: 20 mm}}, shapes: {y: "
        "2}, "
        "frame: chord, raw: yes}\n    points: {P: {station: 1}}\n  slide: {joint: {name: X, prismatic: x, at: ground}, "
        "mass: 1, points: {P: [0, 0, 0]}}\nloops: {C: {ball: [a.P, slide.P]}}\n"
        "start: {elastic: static, q: {A: 1, B: -1.17, X: 1.09}, hold: [A]}\n";
    const kempe_kinematics_options how = {.sweep = "A=1:1.1:2", .elastic = "static"};
    const kempe_sensitivity_options by = {.of = "reactions", .at = "start", .parameters = "E"};
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_kinematics *sweep = NULL;
    kempe_sensitivity *slopes = NULL;
    kempe_status status = kempe_model_read_text(s->context, text, "balance.yaml", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    if (status == KEMPE_OK)
        status = kempe_kinematics_new(system, &how, &sweep);
    if (status == KEMPE_OK)
        status = kempe_sensitivity_new(model, &by, &slopes);
    kempe_sensitivity_free(slopes);
    kempe_kinematics_free(sweep);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

static kempe_status equilibrium_of(const scene *s, kempe_system *system, const kempe_equilibrium_options *options)
{
    kempe_equilibrium *e = NULL;
    char *text = NULL;
    kempe_status status = kempe_equilibrium_new(system, options, &e);
    CHECK((status == KEMPE_OK) == (e != NULL));
    if (status == KEMPE_OK)
        status = kempe_equilibrium_print(e, KEMPE_TEXT, &text);
    kempe_text_free(text);
    text = NULL;
    if (status == KEMPE_OK)
        status = kempe_equilibrium_print(e, KEMPE_JSON, &text);
    kempe_table *table = NULL;
    if (status == KEMPE_OK)
        status = write_table(s, kempe_equilibrium_table(e, "equilibria", &table), &table);
    kempe_text_free(text);
    kempe_equilibrium_free(e);
    return status;
}

static kempe_status find_equilibria(scene *s)
{
    return equilibrium_of(s, s->system, NULL);
}

static kempe_status exchange_unknowns(scene *s)
{
    const kempe_equilibrium_options options = {.target = "position(coupler.C).y=0.4", .solve_for = "rocker"};
    return equilibrium_of(s, s->system, &options);
}

/* A model that falls: KEMPE_E_FAILED is what it should say. */
static kempe_status find_none(scene *s)
{
    static const char text[] = "kempe: 1\ngravity: [0, 0, -9.81]\n"
                               "bodies: {a: {joint: {prismatic: z, at: ground}, mass: 1}}\n"
                               "forces: {f: {joint: a, force: 2}}\n";
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_status status = kempe_model_read_text(s->context, text, "falling", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    if (status == KEMPE_OK)
        status = equilibrium_of(s, system, NULL);
    kempe_system_free(system);
    kempe_model_free(model);
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

/* Sensitivities of a motion with an exchange of u; rows, and one scalar backwards. */
static kempe_status differentiate(scene *s, const char *method)
{
    kempe_sensitivity *slopes = NULL;
    kempe_run_options run = {0};
    kempe_sensitivity_options options = {
        .parameters = "crank,qd.crank", .outputs = "q(rocker),position(coupler.C).x", .method = method, .run = &run};
    run.rtol = 1e-4;
    run.t_end = run.output_step = 0.12;
    kempe_status status = kempe_sensitivity_new(s->model, &options, &slopes);
    kempe_table *table = NULL;
    char *text = NULL;
    untouched(status, slopes);
    if (status == KEMPE_OK)
        status = kempe_sensitivity_print(slopes, KEMPE_JSON, &text);
    if (status == KEMPE_OK)
        status = write_table(s, kempe_sensitivity_table(slopes, "rows", &table), &table);
    kempe_text_free(text);
    kempe_sensitivity_free(slopes);
    return status;
}

static kempe_status differentiate_forward(scene *s)
{
    return differentiate(s, "forward");
}

static kempe_status differentiate_backwards(scene *s)
{
    return differentiate(s, "adjoint");
}

/* At one state, as JSON. */
static kempe_status differentiate_state(scene *s, const char *of, const char *at)
{
    kempe_sensitivity *slopes = NULL;
    kempe_sensitivity_options options = {.of = of, .at = at, .parameters = "crank,base"};
    kempe_status status = kempe_sensitivity_new(s->model, &options, &slopes);
    char *text = NULL;
    untouched(status, slopes);
    if (status == KEMPE_OK)
        status = kempe_sensitivity_print(slopes, KEMPE_JSON, &text);
    kempe_text_free(text);
    kempe_sensitivity_free(slopes);
    return status;
}

static kempe_status differentiate_equilibrium(scene *s)
{
    return differentiate_state(s, "equilibrium", NULL);
}

static kempe_status differentiate_reactions(scene *s)
{
    return differentiate_state(s, "reactions", "start");
}

static kempe_status differentiate_modes(scene *s)
{
    return differentiate_state(s, "modes", NULL);
}

/* Position analysis of a driven mechanism with other lengths; a sweep that ends early. */
static kempe_status drive(scene *s)
{
    const double longer[] = {0.35, 0.9}, too_long[] = {0.8, 0.9}, angle = 0.4, across = 1.5;
    kempe_gradient_options options = {.parameters = "crank,base", .driven = "crank"};
    kempe_gradient *gradient = NULL;
    kempe_status status = kempe_gradient_new(s->model, &options, &gradient);
    untouched(status, gradient);
    if (status == KEMPE_OK)
        status = kempe_gradient_set(gradient, longer);
    if (status == KEMPE_OK)
        status = kempe_gradient_eval(gradient, &angle, NULL, NULL);
    if (status == KEMPE_OK)
        status = kempe_gradient_set(gradient, too_long);
    if (status == KEMPE_OK)
        status = kempe_gradient_eval(gradient, &across, NULL, NULL);
    kempe_gradient_free(gradient);
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

/* A pendulum on a driven slide: every kind of input. */
static kempe_status read_pendulum(scene *s, kempe_model **model, kempe_system **system)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {k: 2}\nground: {points: {O: [0, 0, 0]}}\n"
        "bodies:\n"
        "  a: {joint: {prismatic: x, at: ground.O}, mass: 1, points: {P: [0, 0, 0]}}\n"
        "  b: {joint: {revolute: z, at: a.P}, mass: 1, com: [0, -1, 0], inertia: {zz: 1}, points: {P: [0, -1, 0]}}\n"
        "drives: {a: {joint: a, displacement: 0*t}}\n"
        "forces: {f: {joint: b, torque: -k*qd(b)}}\n";
    kempe_status status = kempe_model_read_text(s->context, text, "pendulum", model);
    return status == KEMPE_OK ? kempe_system_new(*model, system) : status;
}

static const char every_input[] = "effort(b),force(b.P.x),drive(a),k";

static kempe_status linearize(scene *s)
{
    const kempe_linearize_options options = {
        .inputs = every_input, .outputs = "position(b.P).x,qdd,lambda", .independent = "b"};
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_linearization *l = NULL;
    char *text = NULL;
    kempe_status status = read_pendulum(s, &model, &system);
    if (status == KEMPE_OK) {
        status = kempe_linearization_new(system, &options, &l);
        untouched(status, l);
    }
    if (status == KEMPE_OK)
        status = kempe_linearization_print(l, KEMPE_JSON, &text);
    if (status == KEMPE_OK)
        status = kempe_linearization_write(l, s->mat);
    kempe_text_free(text);
    kempe_linearization_free(l);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

static kempe_status respond(scene *s)
{
    const kempe_response_options options = {.inputs = every_input, .outputs = "q(b),energy.total"};
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_table *table = NULL;
    kempe_response *r = NULL;
    char *text = NULL;
    kempe_status status = read_pendulum(s, &model, &system);
    if (status == KEMPE_OK) {
        status = kempe_response_new(system, &options, &r);
        untouched(status, r);
    }
    if (status == KEMPE_OK)
        status = kempe_response_print(r, KEMPE_JSON, &text);
    if (status == KEMPE_OK)
        status = write_table(s, kempe_response_table(r, "rows", &table), &table);
    if (status == KEMPE_OK)
        status = write_table(s, kempe_response_table(r, "peaks", &table), &table);
    if (status == KEMPE_OK)
        status = kempe_response_write_picture(r, s->csv);
    kempe_text_free(text);
    kempe_response_free(r);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

static kempe_status ride(scene *s)
{
    const kempe_run_options run = {.t_end = 5, .output_step = 5, .rtol = 1e-3, .no_convergence_check = 1};
    const kempe_comfort_options options = {
        .lateral = "acceleration(b.P).x", .vertical = "qdd(a)", .rate = 400, .run = &run};
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_table *table = NULL;
    kempe_comfort *c = NULL;
    char *text = NULL;
    kempe_status status = read_pendulum(s, &model, &system);
    if (status == KEMPE_OK) {
        status = kempe_comfort_new(system, &options, &c);
        untouched(status, c);
    }
    if (status == KEMPE_OK)
        status = kempe_comfort_print(c, KEMPE_JSON, &text);
    if (status == KEMPE_OK)
        status = write_table(s, kempe_comfort_table(c, "signals", &table), &table);
    if (status == KEMPE_OK)
        status = write_table(s, kempe_comfort_table(c, "windows", &table), &table);
    kempe_text_free(text);
    kempe_comfort_free(c);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

/* Values, instances in lanes and by themselves, the table that comes out. */
static kempe_status run_ensemble(scene *s)
{
    kempe_values *values = NULL;
    kempe_ensemble *ensemble = NULL;
    kempe_ensemble_result *batch = NULL;
    char *text = NULL;
    kempe_run_options run = {0};
    run.t_end = 1e-3;
    kempe_status status = kempe_values_sample(s->model,
                                              &(kempe_sample_options){.ranges = "crank=IT9,q.crank=normal(0, 0.01)",
                                                                      .correlations = "crank:q.crank=0.5",
                                                                      .count = 3},
                                              &values);
    untouched(status, values);
    if (status == KEMPE_OK)
        status = kempe_ensemble_new(s->model, values, &ensemble);
    for (int lanes = -1; status == KEMPE_OK && lanes < 2; lanes += 2) {
        kempe_ensemble_result_free(batch);
        batch = NULL;
        status = kempe_ensemble_run(ensemble, &run, lanes, &batch);
        untouched(status, batch);
    }
    if (status == KEMPE_OK)
        status = kempe_ensemble_result_print(batch, KEMPE_JSON, &text);
    kempe_table *instances = NULL;
    if (status == KEMPE_OK)
        status = write_table(s, kempe_ensemble_result_table(batch, "instances", &instances), &instances);
    kempe_text_free(text);
    kempe_ensemble_result_free(batch);
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    return status;
}

/* Of two mechanisms, each from the file read again. */
static kempe_status run_mechanisms(scene *s)
{
    static const char *const names[] = {"force", "mass"};
    static const double rows[][2] = {{90, 2}, {80, 2}, {90, 3}};
    kempe_values *values = NULL;
    kempe_ensemble *ensemble = NULL;
    kempe_ensemble_result *batch = NULL;
    kempe_model *model = NULL;
    const kempe_run_options run = {.t_end = 1e-3, .no_convergence_check = 1};
    kempe_status status = kempe_model_read(s->context, KEMPE_ROOT "/tests/models/shaped.yaml", &model);
    if (status == KEMPE_OK)
        status = kempe_values_new(model, 2, names, 3, rows[0], &values);
    if (status == KEMPE_OK)
        status = kempe_ensemble_new_with(
            model, values, &(kempe_ensemble_options){sizeof(kempe_ensemble_options), "q(x)", NULL}, &ensemble);
    if (status == KEMPE_OK)
        status = kempe_ensemble_run(ensemble, &run, 0, &batch);
    untouched(status, batch);
    kempe_ensemble_result_free(batch);
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    kempe_model_free(model);
    return status;
}

/* Along the table of a run with more actuators than freedoms, what came out, and at the start. */
static kempe_status invert(scene *s)
{
    const kempe_inverse_options requests[] = {{.actuators = "crank,rocker", .weights = "crank=2", .motion = s->csv},
                                              {.actuators = "rocker", .independent = "crank"}};
    kempe_status status = write_rows(s);
    for (int k = 0; k < 2 && status == KEMPE_OK; k++) {
        kempe_inverse *inverse = NULL;
        char *text = NULL;
        status = kempe_inverse_new(s->system, &requests[k], &inverse);
        untouched(status, inverse);
        for (int format = KEMPE_TEXT; format <= KEMPE_FULL_TEXT && status == KEMPE_OK; format++) {
            status = kempe_inverse_print(inverse, (kempe_format)format, &text);
            untouched(status, text);
            kempe_text_free(text);
            text = NULL;
        }
        kempe_table *rows = NULL;
        if (status == KEMPE_OK)
            status = write_table(s, kempe_inverse_table(inverse, "rows", &rows), &rows);
        kempe_inverse_free(inverse);
    }
    return status;
}

/* Without actuators it says which would do. */
static kempe_status invert_nothing(scene *s)
{
    kempe_inverse *inverse = NULL;
    kempe_status status = kempe_inverse_new(s->system, NULL, &inverse);
    CHECK(!inverse);
    return status == KEMPE_E_ARGUMENT ? KEMPE_OK : status;
}

/* A few limit cycles of a model of its own, by Newton's method or by simulations of a length. */
static kempe_status find_cycles_within(scene *s, double settle)
{
    kempe_limit_cycles *cycles = NULL;
    kempe_table *table = NULL;
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    const kempe_limit_cycles_options ask = {.size = sizeof ask, .sweep = "mu=-0.1:0.1:2", .most = 2, .settle = settle};
    kempe_status status = kempe_model_read(s->context, KEMPE_ROOT "/tests/models/bautin.yaml", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    if (status == KEMPE_OK)
        status = kempe_limit_cycles_new(system, &ask, &cycles);
    untouched(status, cycles);
    for (int format = KEMPE_TEXT; format <= KEMPE_FULL_TEXT && status == KEMPE_OK; format++) {
        char *text = NULL;
        status = kempe_limit_cycles_print(cycles, (kempe_format)format, &text);
        untouched(status, text);
        kempe_text_free(text);
    }
    if (status == KEMPE_OK)
        status = write_table(s, kempe_limit_cycles_table(cycles, "rows", &table), &table);
    if (status == KEMPE_OK)
        status = kempe_limit_cycles_write_picture(cycles, s->csv);
    kempe_limit_cycles_free(cycles);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

static kempe_status find_limit_cycles(scene *s)
{
    return find_cycles_within(s, 0);
}

static kempe_status find_settled_cycles(scene *s)
{
    return find_cycles_within(s, 0.1);
}

/* Modes over a parameter, with all that is written of them; the page with libraries of a line each. */
static kempe_status find_modes(scene *s)
{
    kempe_modes *modes = NULL;
    kempe_table *table = NULL;
    kempe_status status = kempe_modes_new(
        s->system, &(kempe_modes_options){.at = "start", .independent = "rocker", .sweep = "crank=0.3:0.31:2"}, &modes);
    untouched(status, modes);
    for (int format = KEMPE_TEXT; format <= KEMPE_FULL_TEXT && status == KEMPE_OK; format++) {
        char *text = NULL;
        status = kempe_modes_print(modes, (kempe_format)format, &text);
        untouched(status, text);
        kempe_text_free(text);
    }
    if (status == KEMPE_OK)
        status = write_table(s, kempe_modes_table(modes, "rows", &table), &table);
    if (status == KEMPE_OK)
        status = write_table(s, kempe_modes_table(modes, "critical", &table), &table);
    if (status == KEMPE_OK)
        status = kempe_modes_write_picture(modes, s->csv);
    if (status == KEMPE_OK)
        status = kempe_modes_write_report(modes, s->csv);
    kempe_modes_free(modes);
    return status;
}

static kempe_status settle_modes(scene *s)
{
    kempe_modes *modes = NULL;
    kempe_status status = kempe_modes_new(s->system, NULL, &modes);
    untouched(status, modes);
    kempe_modes_free(modes);
    return status;
}

/* A door whose hinges share its load: its bearings, told in all ways, and a quantity of all joints. */
static kempe_status carry(scene *s)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {a: 0.4}\nground: {points: {L: [0, 0, 0], U: [0, 0, 2]}}\n"
        "bodies:\n  door: {joint: {name: low, revolute: z, at: ground.L}, mass: 20, com: [a, 0, 1], inertia: {zz: 1}, "
        "points: {U: [0, 0, 2]}}\nloops: {high: {revolute: [ground.U, door.U], axis: z}}\n"
        "bearings: {main: {joint: low, at: [0, 0.1]}, other: {joint: high, at: [0, 0.1]}}\n"
        "run: {t_end: 0.02, outputs: [bearing(main)]}\n";
    const kempe_run_options run = {.loads = "least-norm", .no_convergence_check = 1};
    const kempe_ensemble_options ask = {.quantities = "max(reaction(low).size), max(bearing(main).1.size)"},
                                 all = {.quantities = "max(reactions)", .limits = "rms(moments) < 1"};
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_values *values = NULL;
    kempe_ensemble *ensemble = NULL;
    kempe_table *table = NULL;
    kempe_status status = kempe_model_read_text(s->context, text, "door.yaml", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    if (status == KEMPE_OK)
        status = kempe_simulate(system, &run, &t);
    for (int format = KEMPE_TEXT; format <= KEMPE_JSON && status == KEMPE_OK; format++) {
        char *told = NULL;
        status = kempe_trajectory_print(t, (kempe_format)format, &told);
        untouched(status, told);
        kempe_text_free(told);
    }
    if (status == KEMPE_OK)
        status = write_table(s, kempe_trajectory_table(t, "bearings", &table), &table);
    if (status == KEMPE_OK)
        status = kempe_values_new(model, 1, (const char *const[]){"a"}, 1, (const double[]){0.3}, &values);
    if (status == KEMPE_OK)
        status = kempe_ensemble_new_with(model, values, &ask, &ensemble);
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    values = NULL;
    ensemble = NULL;
    if (status == KEMPE_OK)
        status = kempe_values_new(s->model, 1, (const char *const[]){"crank"}, 1, (const double[]){0.3}, &values);
    if (status == KEMPE_OK)
        status = kempe_ensemble_new_with(s->model, values, &all, &ensemble);
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

static const named_stage stages[] = {{"equilibria", find_equilibria},
                                     {"begin at an equilibrium", begin_at_equilibrium},
                                     {"exchanged", exchange_unknowns},
                                     {"no equilibrium", find_none},
                                     {"kinematics", lead_rocker},
                                     {"balance", balance},
                                     {"bearings", carry},
                                     {"ensemble", run_ensemble},
                                     {"mechanisms", run_mechanisms},
                                     {"modes", find_modes},
                                     {"limit cycles", find_limit_cycles},
                                     {"settled cycles", find_settled_cycles},
                                     {"modes at rest", settle_modes},
                                     {"forward sensitivities", differentiate_forward},
                                     {"adjoint sensitivities", differentiate_backwards},
                                     {"sensitivities of an equilibrium", differentiate_equilibrium},
                                     {"sensitivities of reactions", differentiate_reactions},
                                     {"sensitivities of modes", differentiate_modes},
                                     {"gradient", drive},
                                     {"linearize", linearize},
                                     {"response", respond},
                                     {"comfort", ride},
                                     {"inverse dynamics", invert},
                                     {"without actuators", invert_nothing}};

static void every_allocation_fails(void)
{
    scene s = {.context = kempe_context_new()};
    kempe_run_options run = {.t_end = 0.05};
    CHECK(kempe_model_read(s.context, KEMPE_ROOT "/examples/four_bar/four_bar.yaml", &s.model) == KEMPE_OK);
    CHECK(kempe_system_new(s.model, &s.system) == KEMPE_OK);
    CHECK(kempe_simulate(s.system, &run, &s.trajectory) == KEMPE_OK);
    exhaust_all(&s, stages, sizeof stages / sizeof *stages, 13);
    kempe_trajectory_free(s.trajectory);
    kempe_system_free(s.system);
    kempe_model_free(s.model);
    kempe_context_free(s.context);
}

int main(void)
{
    TEST(every_allocation_fails);
    return check_report();
}
