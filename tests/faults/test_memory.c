/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow sanitized_only 16 */
/* Every allocation fails once. Each stage of a whole small run is repeated with its n-th allocation failing, for n = 1
 * until none is left: nothing crashes or leaks (under the address sanitizer), the stage says that there is no memory,
 * and leaves its outputs untouched. A stage may also do without what it did not get, and then it is done. */
#include "exhaust.h"
#include <kempe/build.h>
#include <kempe/check.h>
#include <kempe/compare.h>
#include <kempe/equilibrium.h>
#include <kempe/generate.h>
#include <kempe/output_handles.h>
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <kempe/workspace.h>

static const char path[] = KEMPE_ROOT "/examples/four_bar/four_bar.yaml";

static kempe_status read_model(scene *s)
{
    return read_file(s, path);
}

static kempe_status read_text(scene *s, const char *text, const char *label)
{
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read_text(s->context, text, label, &model);
    return drop_model(status, model);
}

/* A model with mistakes: KEMPE_E_INPUT is what it should say. */
static kempe_status reject_text(scene *s, const char *text, const char *label)
{
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read_text(s->context, text, label, &model);
    CHECK(!model);
    return status == KEMPE_E_INPUT ? KEMPE_OK : status;
}

static kempe_status read_wrong_model(scene *s)
{
    static const char text[] =
        "kempe: 1\nbodies:\n  a: {joint: {revolut: z, at: gruond}, mass: m, masss: 1, inertia: {zz: -1}}\n"
        "forces: {f: {joint: b, torque: q(c) + (}}\n";
    return reject_text(s, text, "wrong");
}

static kempe_status read_robotran(scene *s)
{
    kempe_status status = kempe_context_set_left_out(s->context, "extforce,colour,link,weather");
    return status == KEMPE_OK ? read_file(s, KEMPE_ROOT "/tests/models/robotran.mbs") : status;
}

/* Joints between bodies, of which some are cut. */
static kempe_status read_graph(scene *s)
{
    return read_file(s, KEMPE_ROOT "/tests/models/two_bars.yaml");
}

/* Ports of included files, and of files that these include; copies; parts that may be absent. */
static kempe_status read_ports(scene *s)
{
    return read_file(s, KEMPE_ROOT "/tests/models/strut_machine.yaml");
}

static kempe_status read_element(scene *s)
{
    char *text = NULL;
    kempe_status status = kempe_element_text(s->context, "kempe:gas_spring.yaml", &text);
    untouched(status, text);
    kempe_text_free(text);
    return status;
}

static kempe_status read_shapes(scene *s)
{
    return read_file(s, KEMPE_ROOT "/tests/models/shapes.yaml");
}

/* Beams, with a number of a parameter and with none; joints between bodies. */
static kempe_status read_flexible(scene *s)
{
    static const char text[] = "kempe: 1\nparameters: {E: 70 GPa}\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                               "  a:\n    flexible: {beam: {length: 1, rhoA: 1, EIz: 6}, shapes: {y: 2}, frame: chord, "
                               "damping: {ratio: 0.1}}\n"
                               "    points: {A: {station: 0}, B: {station: 1}}\n"
                               "  b:\n    flexible:\n      beam: {length: 1, young: E, poisson: 0.3, density: 1, "
                               "section: {rectangle: [1, 2]}}\n"
                               "      shapes: {y: 1, torsion: 1}\n      raw: yes\n      damping: {ratio: 0.1}\n"
                               "    points: {A: {station: 0}, B: {station: 0.5, offset: [0, 1, 0]}}\n"
                               "joints: {A: {revolute: [ground.O, a.A]}, B: {revolute: [a.B, b.A]}}\n";
    return read_text(s, text, "beams.yaml");
}

/* Joints of constant velocity, one in a graph; friction in a thread; a bushing with matrices. */
static kempe_status read_elements(scene *s)
{
    static const char text[] =
        "kempe: 1\nparameters: {k: 5, mu: 0.1}\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
        "  a: {mass: 1, inertia: {zz: 1}, points: {P: [0, 0, 0]}}\n"
        "  b: {joint: {free: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [0, 0, 0], Q: [0, 0, 1]}}\n"
        "  c: {joint: {screw: z, pitch: 0.01, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [0, 0, 0]}}\n"
        "joints: {A: {revolute: [ground.O, a.P]}, J: {constant_velocity: [a.P, b.P], plunging: yes}}\n"
        "loops: {V: {constant_velocity: [b.Q, c.P], plunging: free}}\n"
        "forces:\n"
        "  t: {joint: c.2, friction: {mu: mu, mu_static: 0.2, radius: 0.02, flank: 0.2}}\n"
        "  u: {bushing: [ground.O, b.P], damping_matrix: [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], "
        "[0, "
        "0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]], matrix: [[k, 0, 0, 0, 1, 0], [0, k, 0, 0, 0, 0], [0, "
        "0, "
        "k, 0, 0, 0], [0, 0, 0, k, 0, 0], [1, 0, 0, 0, k, 0], [0, 0, 0, 0, 0, k]]}\n";
    return read_text(s, text, "elements.yaml");
}

/* Outlines of every shape, with copies, and their contacts. */
static kempe_status read_outlines(scene *s)
{
    static const char text[] =
        "kempe: 1\nground: {points: {O: [0, 0, 0]}}\noutlines:\n"
        "  box: {rectangle: [0.2, 0.1], round: 1 mm}\n  disc: {circle: 0.1}\n  edge: {segment: [[1, 0], [0, 0]]}\n"
        "  groove: {slot: 1, width: 0.5}\n  block: {polygon: [[-1, -1], [1, -1], [0, 0]], hollow: yes}\n"
        "  teeth: {closed: yes, copies: 4, path: [[0.1, 0], {arc: [0.1, 0.02], through: [0.09, 0.01]}]}\n"
        "bodies:\n  a: {joint: {name: x, prismatic: x, at: ground}}\n"
        "  b: {joint: {name: y, prismatic: y, at: a}, mass: 1, points: {P: [0, 9, 0]}}\n"
        "contacts:\n  p: {sphere: b.P, radius: 1 mm, on: {outline: teeth, at: ground.O}, restitution: 0, friction: 1}\n"
        "  q: {outline: box, at: b.P, on: {plane: ground.O, normal: y}, restitution: 0}\n"
        "run: {outputs: [force(p), gap(q)]}\n";
    return read_text(s, text, "outlines.yaml");
}

/* A track with a course and waves. */
static kempe_status read_track(scene *s)
{
    static const char text[] =
        "kempe: 1\nprofiles: {head: {y: [-36 mm, -30 mm, -20 mm, 0, 20 mm, 30 mm], z: [-28 mm, -9 mm, -1 mm, 0, -1 mm, "
        "-9 mm]}}\ntracks: {line: {at: ground.O, rail: head, gauge: 1, course: [{transition: 5}, {left: 9, radius: 90, "
        "cant: 0.1}, {transition: 5}], irregularities: {spectrum: low, seed: 1, to: 20, wavelengths: [5, 9]}}}\n"
        "ground: {points: {O: [0, 0, 0]}}\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n";
    return read_text(s, text, "track.yaml");
}

static kempe_status read_wrong_robotran(scene *s)
{
    static const char text[] = "<mbsDescR7><bodytree><body/><body><bodyname>a b</bodyname><parent/></body></bodytree>"
                               "<cuts><ball/></cuts><rain/></mbsDescR7>";
    return reject_text(s, text, "wrong.mbs");
}

/* And with mistakes. */
static kempe_status read_wrong_graph(scene *s)
{
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read(s->context, KEMPE_ROOT "/tests/malformed/joints_loop.yaml", &model);
    CHECK(!model);
    return status == KEMPE_E_INPUT ? KEMPE_OK : status;
}

static kempe_status build_model(scene *s)
{
    kempe_model *model = NULL;
    kempe_body_def arm = kempe_body_default("arm");
    kempe_force_def motor = kempe_force_default("motor");
    arm.mass = kempe_value(1);
    arm.com[0] = kempe_expression("L/2");
    motor.joint = "arm";
    motor.torque = "0.1*sin(t)";
    kempe_status status = kempe_model_new(s->context, "built", &model);
    untouched(status, model);
    if (status == KEMPE_OK)
        status = kempe_model_add_parameter(model, "L", kempe_value(2));
    if (status == KEMPE_OK)
        status = kempe_model_add_body(model, &arm);
    if (status == KEMPE_OK)
        status = kempe_model_add_point(model, "arm", "P", kempe_expression("L"), kempe_value(0), kempe_value(0));
    if (status == KEMPE_OK)
        status = kempe_model_add_force(model, &motor);
    if (status == KEMPE_OK)
        status = kempe_model_add_text(model, "forces", "brake", "{joint: arm, torque: -qd(arm)}");
    if (status == KEMPE_OK)
        status = kempe_model_set_q(model, "arm", kempe_value(1), 1);
    if (status == KEMPE_OK)
        status = kempe_model_finish(model);
    kempe_model_free(model);
    return status;
}

/* A position near goals, from the text to the report. */
static kempe_status seek_goals(scene *s)
{
    static const char text[] =
        "kempe: 1\nground: {points: {D: [0.9, 0, 0]}}\n"
        "bodies:\n"
        "  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {B: [0.3, 0, 0]}}\n"
        "  b: {joint: {revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, points: {C: [0.8, 0, 0]}}\n"
        "  c: {joint: {revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, points: {C: [0.7, 0, 0]}}\n"
        "loops: {C: {ball: [b.C, c.C]}}\n"
        "start: {q: {a: 1, b: -0.7, c: 1.9}, goals: {b: -1, position(b.C): {value: [1, 1, 0], weight: 2}}}\n";
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_assembly *assembly = NULL;
    char *report = NULL;
    kempe_status status = kempe_model_read_text(s->context, text, "goals", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    if (status == KEMPE_OK)
        status = kempe_assembly_new(system, &assembly);
    untouched(status, assembly);
    if (status == KEMPE_OK)
        status = kempe_assembly_print(assembly, KEMPE_JSON, &report);
    kempe_text_free(report);
    kempe_assembly_free(assembly);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

/* Joints and closures of many kinds, from the text to the programs. */
static kempe_status derive_kinds(scene *s)
{
    static const char text[] =
        "kempe: 1\ntables: {f: {x: [0, 1, 3], y: [0, 1, 2]}}\n"
        "outlines:\n"
        "  c: {law: [{to: 3, rise: 1 mm, by: cycloidal}, {to: 360 deg, rise: -1 mm, by: harmonic}], base: 1, "
        "follower: {knife: yes}}\n"
        "  d: {points: [[1, 0], [0, 1], [-1, 0], [0, -1]]}\n"
        "ground: {points: {O: {at: [0, 0, 0], axes: {z: [0, 1, 1]}}}}\n"
        "bodies:\n"
        "  a: {joint: {screw: z, pitch: 1 mm, at: ground.O}, mass: 1, points: {P: [1, 0, 0]}}\n"
        "  w: {joint: {weld: yes, at: a.P, frame: {x: y}}, mass: 1, points: {P: [1, 0, 0]}}\n"
        "  b: {joint: {free: x, at: w}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}, points: {P: [0, 0, 0]}}\n"
        "loops:\n"
        "  W: {weld: [ground.O, b.P]}\n"
        "  F: {point_on_curve: [ground.O, w.P], table: f}\n"
        "  G: {point_on_curve: [ground.O, b.P], curve: [x - y*z, z + sin(x)]}\n"
        "  K: {coupler: {a.1: 1, b.2: 2}, equals: 1}\n"
        "  L: {follower: b.P, knife: yes, on: {outline: c, at: w.P}}\n"
        "contacts: {M: {sphere: b.P, radius: 0.1, on: {outline: d, at: w.P}, restitution: 0}}\n"
        "drives: {l: {joint: b.1, locked: yes}}\n"
        "run: {outputs: [reaction(W), moment(W), reaction(b), force(L), curvature(M)]}\n";
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_status status = kempe_model_read_text(s->context, text, "kinds", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    untouched(status, system);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

static kempe_status count_operations(scene *s)
{
    kempe_count *count = NULL;
    char *text = NULL;
    const kempe_generate_options generation = {
        .sets = "M_C,h_J,jdqd,R+R_tangents", .keep_parameters = 1, .body_inputs = 1};
    kempe_status status = kempe_count_new(s->model, &generation, &count);
    untouched(status, count);
    if (status == KEMPE_OK)
        status = kempe_count_print(count, KEMPE_JSON, &text);
    if (status == KEMPE_OK)
        untouched(status, text);
    kempe_text_free(text);
    kempe_count_free(count);
    return status;
}

static kempe_status write_language(const scene *s, const char *language, int vectorised)
{
    kempe_code *code = NULL;
    const kempe_generate_options generation = {
        .sets = "M_C,h_J,jdqd", .keep_parameters = 1, .language = language, .vectorised = vectorised};
    kempe_status status = kempe_code_new(s->model, &generation, &code);
    untouched(status, code);
    kempe_code_free(code);
    return status;
}

static kempe_status write_c(scene *s)
{
    return write_language(s, "c", 0);
}

static kempe_status write_octave(scene *s)
{
    return write_language(s, "octave", 1);
}

static kempe_status write_python(scene *s)
{
    return write_language(s, "python", 0);
}

static kempe_status write_jax(scene *s)
{
    return write_language(s, "jax", 0);
}

static kempe_status write_unit(scene *s)
{
    kempe_fmu_export *made = NULL;
    const kempe_fmu_options sources = {.no_binary = 1};
    kempe_status status = kempe_fmu_export_new(s->model, &sources, &made);
    untouched(status, made);
    kempe_fmu_export_free(made);
    return status;
}

static kempe_status print_system(scene *s)
{
    kempe_status status = KEMPE_OK;
    for (int view = KEMPE_VIEW_EQUATIONS; view <= KEMPE_VIEW_STATS && status == KEMPE_OK; view++) {
        char *text = NULL;
        status = kempe_system_print(s->system, (kempe_view)view, KEMPE_TEXT, &text);
        untouched(status, text);
        kempe_text_free(text);
    }
    return status;
}

static kempe_status check_model(scene *s)
{
    kempe_check *check = NULL;
    char *text = NULL;
    kempe_status status = kempe_check_new(s->system, &check);
    untouched(status, check);
    if (status == KEMPE_OK) {
        status = kempe_check_print(check, KEMPE_FULL_TEXT, &text);
        untouched(status, text);
    }
    kempe_check_free(check);
    kempe_text_free(text);
    return status;
}

static kempe_status assemble(scene *s)
{
    kempe_assembly *assembly = NULL;
    char *text = NULL;
    kempe_status status = kempe_assembly_new(s->system, &assembly);
    untouched(status, assembly);
    if (status == KEMPE_OK) {
        CHECK_NEAR(kempe_assembly_qd(assembly)[0], 20, 1e-12); /* as given: never changed for want of memory */
        status = kempe_assembly_print(assembly, KEMPE_JSON, &text);
        untouched(status, text);
    }
    kempe_assembly_free(assembly);
    kempe_text_free(text);
    return status;
}

static kempe_status evaluate(scene *s)
{
    kempe_workspace *ws = NULL;
    kempe_status status = kempe_workspace_new(s->system, &ws);
    untouched(status, ws);
    kempe_workspace_free(ws);
    return status;
}

static kempe_status simulate(scene *s, const char *formulation, const char *form, const char *integrator)
{
    kempe_run_options run = {0};
    run.formulation = formulation;
    run.form = form;
    run.integrator = integrator;
    run.rtol = 1e-6;
    run.t_end = 0.05;
    run.output_step = 0.025;
    run.independent = strcmp(formulation, "reduced") == 0 ? "crank" : NULL;
    return simulate_run(s, &run);
}

static kempe_status simulate_integrated(scene *s)
{
    return simulate(s, "reduced", "integrated", "dop853");
}

static kempe_status simulate_newton(scene *s)
{
    return simulate(s, "reduced", "newton", "dopri5");
}

static kempe_status simulate_bdf(scene *s)
{
    return simulate(s, "reduced", "newton", "bdf");
}

static kempe_status simulate_radau(scene *s)
{
    return simulate(s, "reduced", "newton", "radau9");
}

static kempe_status simulate_reduced_ida(scene *s)
{
    return simulate(s, "reduced", "newton", "ida");
}

static kempe_status simulate_projected(scene *s)
{
    return simulate(s, "projected", NULL, NULL);
}

static kempe_status simulate_bodies(scene *s)
{
    scene by = {.context = s->context, .model = s->model};
    kempe_status status = kempe_system_new_with_algorithm(s->model, "articulated", &by.system);
    untouched(status, by.system);
    if (status == KEMPE_OK)
        status = simulate_integrated(&by);
    kempe_system_free(by.system);
    return status;
}

/* Two balls that share nothing: parts, their systems, rows and logs. */
static kempe_status simulate_parts(scene *s)
{
    static const char text[] = "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\n"
                               "bodies:\n"
                               "  a: {joint: {prismatic: y, at: ground}, mass: 1, points: {C: [0, 0, 0]}}\n"
                               "  b: {joint: {prismatic: y, at: ground}, mass: 1, points: {C: [0, 0, 0]}}\n"
                               "contacts:\n"
                               "  k: {point: a.C, on: {plane: ground.O, normal: y}, restitution: 0.5}\n"
                               "  l: {point: b.C, on: {plane: ground.O, normal: y}, restitution: 0.5}\n"
                               "start: {q: {a: 0.1, b: 0.12}}\n";
    kempe_run_options run = {.rtol = 1e-4, .t_end = 0.2, .output_step = 0.1, .no_convergence_check = 1};
    scene by = {.context = s->context};
    kempe_status status = kempe_model_read_text(s->context, text, "parts.yaml", &by.model);
    if (status == KEMPE_OK)
        status = kempe_system_new(by.model, &by.system);
    if (status == KEMPE_OK)
        status = simulate_run(&by, &run);
    kempe_system_free(by.system);
    kempe_model_free(by.model);
    return status;
}

/* A tapered beam that begins in balance, and what check says of its loads. */
static kempe_status start_in_balance(scene *s)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n  a:\n    joint: {weld: yes, at: ground}\n    flexible:\n"
        "      beam: {length: 1, along: y, young: 1e9, density: 1000,\n"
        "        taper: {at: [0, 0.5, 1], section: [{circle: 20 mm}, {circle: 18 mm}, {circle: 10 mm}]}}\n"
        "      shapes: {y: 2}\n    points: {P: {station: 1}}\nforces: {f: {at: a.P, force: [0, -1, 1]}}\n"
        "start: {elastic: static}\n";
    kempe_run_options run = {.rtol = 1e-4, .t_end = 0.01, .output_step = 0.01, .no_convergence_check = 1};
    scene by = {.context = s->context};
    kempe_check *check = NULL;
    char *said = NULL;
    kempe_status status = kempe_model_read_text(s->context, text, "balance.yaml", &by.model);
    if (status == KEMPE_OK)
        status = kempe_system_new(by.model, &by.system);
    if (status == KEMPE_OK)
        status = kempe_check_new(by.system, &check);
    if (status == KEMPE_OK)
        status = kempe_check_print(check, KEMPE_TEXT, &said);
    if (status == KEMPE_OK)
        status = simulate_run(&by, &run);
    free(said);
    kempe_check_free(check);
    kempe_system_free(by.system);
    kempe_model_free(by.model);
    return status;
}

/* A block on a belt, whose formulations rest and return. */
static kempe_status simulate_visits(scene *s)
{
    kempe_run_options run = {.rtol = 1e-4, .t_end = 20, .output_step = 20, .no_convergence_check = 1};
    scene by = {.context = s->context};
    kempe_status status = kempe_model_read(s->context, KEMPE_ROOT "/tests/models/friction_belt.yaml", &by.model);
    if (status == KEMPE_OK)
        status = kempe_system_new(by.model, &by.system);
    if (status == KEMPE_OK)
        status = simulate_run(&by, &run);
    kempe_system_free(by.system);
    kempe_model_free(by.model);
    return status;
}

static kempe_status simulate_stabilized1(scene *s)
{
    return simulate(s, "dae", "stabilized1", "ida");
}

/* States at two times of a run, to and fro across an exchange of u. */
static kempe_status simulate_kept(scene *s)
{
    kempe_run_options run = {.rtol = 1e-4, .t_end = 0.12, .no_convergence_check = 1, .keep_dense = 1};
    kempe_trajectory *trajectory = NULL;
    kempe_status status = kempe_simulate(s->system, &run, &trajectory);
    double q[3];
    untouched(status, trajectory);
    for (int k = 0; status == KEMPE_OK && k < 3; k++)
        status = kempe_trajectory_at_time(trajectory, k % 2 ? 0.115 : 0.001, q, NULL, NULL, NULL);
    kempe_trajectory_free(trajectory);
    return status;
}

static kempe_status simulate_index1(scene *s)
{
    return simulate(s, "dae", "index1", "ida");
}

static kempe_status step(scene *s)
{
    kempe_stepper *stepper = NULL;
    kempe_run_options run = {0};
    run.t_end = 0.05;
    kempe_status status = kempe_stepper_new(s->system, &run, &stepper);
    untouched(status, stepper);
    if (status == KEMPE_OK)
        status = kempe_stepper_step(stepper);
    if (status == KEMPE_OK)
        status = kempe_stepper_advance(stepper, 0.05);
    kempe_stepper_free(stepper);
    return status;
}

static kempe_status print_trajectory(scene *s)
{
    kempe_status status = KEMPE_OK;
    for (int format = KEMPE_TEXT; format <= KEMPE_FULL_TEXT && status == KEMPE_OK; format++) {
        char *text = NULL;
        status = kempe_trajectory_print(s->trajectory, (kempe_format)format, &text);
        untouched(status, text);
        kempe_text_free(text);
    }
    return status;
}

static kempe_compare_options small_comparison(void)
{
    kempe_compare_options run = {0};
    run.rtols = "1e-4";
    run.formulations = "reduced,dae";
    run.forms = "integrated,stabilized1";
    run.integrators = "dop853,ida";
    run.t_end = 0.02;
    return run;
}

static kempe_status compare(scene *s)
{
    kempe_comparison *comparison = NULL;
    kempe_compare_options run = small_comparison();
    kempe_status status = kempe_comparison_new(s->system, &run, &comparison);
    untouched(status, comparison);
    kempe_comparison_free(comparison);
    return status;
}

static kempe_status print_comparison(scene *s)
{
    kempe_status status = KEMPE_OK;
    for (int format = KEMPE_TEXT; format <= KEMPE_FULL_TEXT && status == KEMPE_OK; format++) {
        char *text = NULL;
        status = kempe_comparison_print(s->comparison, (kempe_format)format, &text);
        untouched(status, text);
        kempe_text_free(text);
    }
    static const char *const names[] = {"runs", "levels"};
    for (int k = 0; k < 2 && status == KEMPE_OK; k++) {
        kempe_table *table = NULL;
        status = write_table(s, kempe_comparison_table(s->comparison, names[k], &table), &table);
    }
    return status;
}

static kempe_status write_report(scene *s)
{
    return kempe_comparison_write_report(s->comparison, s->csv);
}

static kempe_status write_animation(scene *s)
{
    static const char file[] = "/tmp/kempe_memory_scene.glb";
    const kempe_status status = kempe_trajectory_write_animation(s->trajectory, file);
    (void)remove(file);
    return status;
}

/* -- the loop -------------------------------------------------------------------------------------- */

static const named_stage stages[] = {{"read", read_model},
                                     {"read a track", read_track},
                                     {"read mistakes", read_wrong_model},
                                     {"read ROBOTRAN", read_robotran},
                                     {"read its mistakes", read_wrong_robotran},
                                     {"read shapes", read_shapes},
                                     {"read flexible bodies", read_flexible},
                                     {"read elements", read_elements},
                                     {"read outlines", read_outlines},
                                     {"read a graph of joints", read_graph},
                                     {"read ports", read_ports},
                                     {"read an element", read_element},
                                     {"read its mistakes", read_wrong_graph},
                                     {"build", build_model},
                                     {"print model", print_model},
                                     {"derive", derive},
                                     {"derive kinds", derive_kinds},
                                     {"goals", seek_goals},
                                     {"print system", print_system},
                                     {"count", count_operations},
                                     {"C", write_c},
                                     {"Octave", write_octave},
                                     {"JAX", write_jax},
                                     {"Python", write_python},
                                     {"unit", write_unit},
                                     {"check", check_model},
                                     {"assemble", assemble},
                                     {"workspace", evaluate},
                                     {"integrated", simulate_integrated},
                                     {"newton", simulate_newton},
                                     {"bdf", simulate_bdf},
                                     {"radau9", simulate_radau},
                                     {"reduced ida", simulate_reduced_ida},
                                     {"projected", simulate_projected},
                                     {"articulated bodies", simulate_bodies},
                                     {"parts", simulate_parts},
                                     {"visits", simulate_visits},
                                     {"start in balance", start_in_balance},
                                     {"stabilized1", simulate_stabilized1},
                                     {"kept", simulate_kept},
                                     {"index1", simulate_index1},
                                     {"step", step},
                                     {"print trajectory", print_trajectory},
                                     {"write tables", write_rows},
                                     {"compare", compare},
                                     {"print comparison", print_comparison},
                                     {"write report", write_report},
                                     {"write animation", write_animation}};

static void every_allocation_fails(void)
{
    scene s = {.context = kempe_context_new()};
    kempe_run_options run = {0};
    kempe_compare_options comparison = small_comparison();
    run.t_end = 0.05;
    CHECK(kempe_model_read(s.context, path, &s.model) == KEMPE_OK);
    CHECK(kempe_system_new(s.model, &s.system) == KEMPE_OK);
    CHECK(kempe_simulate(s.system, &run, &s.trajectory) == KEMPE_OK);
    CHECK(kempe_comparison_new(s.system, &comparison, &s.comparison) == KEMPE_OK);
    exhaust_all(&s, stages, sizeof stages / sizeof *stages, 13);
    kempe_comparison_free(s.comparison);
    kempe_trajectory_free(s.trajectory);
    kempe_system_free(s.system);
    kempe_model_free(s.model);
    kempe_context_free(s.context);
}

static void no_context(void)
{
    kmp_memory_fail_at(1);
    CHECK(!kempe_context_new());
    kmp_memory_fail_at(0);
}

int main(void)
{
    TEST(no_context);
    TEST(every_allocation_fails);
    return check_report();
}
