/* SPDX-License-Identifier: BSD-3-Clause */
/* A model built in code is the model that the same words in a file give, and its mistakes are said in the same
 * sentences. */
#include "four_bar.h"
#include <kempe/build.h>
#include <kempe/check.h>
#include <stdlib.h>

static const char file[] = "kempe: 1\n"
                           "name: four_bar\n"
                           "gravity: [0, -9.81, 0]\n"
                           "parameters: {crank: 0.3, coupler: 0.8, rocker: 0.7, base: 3*crank}\n"
                           "ground: {points: {D: [base, 0, 0]}}\n"
                           "bodies:\n"
                           "  crank:\n"
                           "    joint: {name: A, revolute: z, at: ground}\n"
                           "    mass: 1\n"
                           "    com: [crank/2, 0, 0]\n"
                           "    inertia: {zz: crank^2/12}\n"
                           "    points: {B: [crank, 0, 0]}\n"
                           "  coupler:\n"
                           "    joint: {name: B, revolute: z, at: crank.B}\n"
                           "    mass: 1\n"
                           "    com: [coupler/2, 0, 0]\n"
                           "    inertia: {zz: coupler^2/12}\n"
                           "    points: {C: [coupler, 0, 0]}\n"
                           "  rocker:\n"
                           "    joint: {name: D, revolute: z, at: ground.D}\n"
                           "    mass: 1\n"
                           "    com: [rocker/2, 0, 0]\n"
                           "    inertia: {zz: rocker^2/12}\n"
                           "    points: {C: [rocker, 0, 0]}\n"
                           "loops: {C: {ball: [coupler.C, rocker.C]}}\n"
                           "forces: {motor: {joint: A, torque: \"" FOUR_BAR_TORQUE "\"}}\n"
                           "start: {q: {A: pi/2, B: -1.08, D: 1.85}, hold: [A], qd: {A: 20}}\n";

static char *print_of(const kempe_model *model)
{
    char *text = NULL;
    CHECK(kempe_model_print(model, KEMPE_TEXT, &text) == KEMPE_OK);
    return text;
}

/* The last value of q of a short run. */
static double run(const kempe_model *model)
{
    kempe_system *system = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_run_options settings = {0};
    double last = NAN;
    settings.t_end = 0.3;
    settings.rtol = 1e-9;
    if (kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &settings, &trajectory) == KEMPE_OK)
        last = kempe_trajectory_q(trajectory, kempe_trajectory_row_count(trajectory) - 1)[0];
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    return last;
}

static void same_as_file(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *built = four_bar_new(context, FOUR_BAR_TORQUE), *read = NULL;
    CHECK(kempe_model_read_text(context, file, "four_bar", &read) == KEMPE_OK);
    char *a = print_of(built), *b = print_of(read);
    CHECK_TEXT(a, b);
    double x = run(built), y = run(read);
    CHECK(isfinite(x) && x == y);
    kempe_text_free(a);
    kempe_text_free(b);
    kempe_model_free(built);
    kempe_model_free(read);
    kempe_context_free(context);
}

/* Motions written out, a rod, a spring, a translation with a force. */
static void other_kinds(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    const kempe_number zero = kempe_value(0), one = kempe_value(1);
    CHECK(kempe_model_new(context, NULL, &model) == KEMPE_OK);
    kempe_body_def body = kempe_body_default("body");
    body.kind = NULL;
    body.motions = "T1 T2, -R3";
    body.mass = body.inertia[2] = one;
    CHECK(kempe_model_add_body(model, &body) == KEMPE_OK);
    body = kempe_body_default("slider");
    body.kind = "prismatic";
    body.axis[0] = 2;
    body.axis[2] = 0;
    body.mass = one;
    CHECK(kempe_model_add_body(model, &body) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "body", "P", one, zero, zero) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "slider", "P", zero, one, zero) == KEMPE_OK);
    kempe_closure_def rod = kempe_closure_default("rod");
    rod.kind = "rod";
    rod.point[0] = "body.P";
    rod.point[1] = "slider.P";
    rod.length = kempe_expression("sqrt(2)");
    CHECK(kempe_model_add_closure(model, &rod) == KEMPE_OK);
    kempe_force_def spring = kempe_force_default("spring");
    spring.spring[0] = "slider.P";
    spring.spring[1] = "body.P";
    spring.stiffness = kempe_value(10);
    CHECK(kempe_model_add_force(model, &spring) == KEMPE_OK);
    kempe_force_def push = kempe_force_default("push");
    push.joint = "slider";
    push.force = "sin(t)";
    CHECK(kempe_model_add_force(model, &push) == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_OK);
    CHECK_TEXT(kempe_context_message(context), "");
    CHECK(kempe_model_coordinate_count(model) == 4);
    CHECK_TEXT(kempe_model_coordinate_name(model, 2), "body.3");
    CHECK(isfinite(run(model)));
    kempe_model_free(model);
    kempe_context_free(context);
}

/* Joints between bodies, one of which Kempe cuts: as from a file. */
static void graph(void)
{
    static const char text[] = "kempe: 1\nname: graph\n"
                               "bodies:\n"
                               "  arm: {mass: 1, com: [0, 0, 0], points: {P: [0, 0, 0], Q: [1, 0, 0]}}\n"
                               "  nut: {mass: 2, com: [0, 0, 0], inertia: {xx: 1}, points: {P: [0, 0, 0]}}\n"
                               "ground: {points: {O: [0, 0, 0], D: [1, 0, 0]}}\n"
                               "joints:\n"
                               "  A: {revolute: [ground.O, arm.P], axis: [1, 0, 0]}\n"
                               "  S: {screw: [arm.Q, nut.P], axis: [1, 0, 0], pitch: 0.5}\n"
                               "  B: {revolute: [nut.P, ground.D], axis: [1, 0, 0], cut: yes}\n"
                               "  W: {weld: [ground.D, arm.Q]}\n";
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL, *read = NULL;
    const kempe_number zero = kempe_value(0), one = kempe_value(1);
    const char *const points[4][2] = {
        {"ground.O", "arm.P"}, {"arm.Q", "nut.P"}, {"nut.P", "ground.D"}, {"ground.D", "arm.Q"}};
    const char *const names[4] = {"A", "S", "B", "W"}, *const kinds[4] = {"revolute", "screw", "revolute", "weld"};
    CHECK(kempe_model_new(context, "graph", &model) == KEMPE_OK);
    kempe_body_def body = kempe_body_default("arm");
    body.at = NULL;
    body.mass = one;
    CHECK(kempe_model_add_body(model, &body) == KEMPE_OK);
    body.name = "nut";
    body.mass = kempe_value(2);
    body.inertia[0] = one;
    CHECK(kempe_model_add_body(model, &body) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "arm", "P", zero, zero, zero) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "arm", "Q", one, zero, zero) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "nut", "P", zero, zero, zero) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "ground", "O", zero, zero, zero) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "ground", "D", one, zero, zero) == KEMPE_OK);
    for (int k = 0; k < 4; k++) {
        kempe_joint_def joint = kempe_joint_default(names[k]);
        joint.kind = kinds[k];
        joint.point[0] = points[k][0];
        joint.point[1] = points[k][1];
        joint.axis[0] = 1;
        joint.axis[2] = 0;
        joint.pitch = k == 1 ? kempe_value(0.5) : zero;
        joint.cut = k == 2 ? 1 : 0;
        CHECK(kempe_model_add_joint(model, &joint) == KEMPE_OK);
    }
    CHECK(kempe_model_finish(model) == KEMPE_OK);
    CHECK_TEXT(kempe_context_message(context), "");
    CHECK(kempe_model_read_text(context, text, "graph", &read) == KEMPE_OK);
    char *a = print_of(model), *b = print_of(read);
    CHECK_TEXT(a, b);
    CHECK(a && strstr(a, "joint B (revolute) is cut") != NULL);
    kempe_text_free(a);
    kempe_text_free(b);
    kempe_model_free(read);
    kempe_model_free(model);

    kempe_joint_def joint = kempe_joint_default("A");
    CHECK(kempe_model_new(context, "graph", &model) == KEMPE_OK);
    body = kempe_body_default("arm");
    body.at = NULL;
    CHECK(kempe_model_add_body(model, &body) == KEMPE_OK);
    joint.point[0] = "ground.O";
    joint.point[1] = "arm.P";
    CHECK(kempe_model_add_joint(model, &joint) == KEMPE_OK);
    CHECK(kempe_model_add_joint(model, &joint) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "joint 'A' exists already in the model");
    CHECK(kempe_model_finish(model) == KEMPE_E_INPUT);
    CHECK_TEXT(kempe_context_message(context),
               "joint 'A': body 'ground' has no point 'O'\njoint 'A': body 'arm' has no point 'P'");
    kempe_model_free(model);
    kempe_context_free(context);
}

/* All mistakes at once, in the order of the calls; then they are put right and the model is finished. */
static void mistakes(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    const kempe_number zero = kempe_value(0);
    CHECK(kempe_model_new(context, "wrong", &model) == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_E_INPUT);
    CHECK_TEXT(kempe_context_message(context), "wrong: the model has no key 'bodies'");
    kempe_body_def arm = kempe_body_default("arm");
    arm.mass = kempe_expression("2*m");
    CHECK(kempe_model_add_body(model, &arm) == KEMPE_OK);
    kempe_force_def spring = kempe_force_default("spring");
    spring.spring[0] = "arm.P";
    spring.spring[1] = "ground.O";
    spring.stiffness = kempe_value(10);
    CHECK(kempe_model_add_force(model, &spring) == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_E_INPUT);
    CHECK_TEXT(kempe_context_message(context), "body 'arm': unknown parameter 'm'\n"
                                               "force 'spring': body 'arm' has no point 'P'\n"
                                               "force 'spring': body 'ground' has no point 'O'");
    CHECK(kempe_system_new(model, &system) == KEMPE_E_ARGUMENT && !system);
    CHECK(kempe_model_add_point(model, "arm", "P", kempe_value(1), zero, zero) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "ground", "O", zero, kempe_value(2), zero) == KEMPE_OK);
    CHECK(kempe_model_add_parameter(model, "m", kempe_value(1)) == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_OK);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void refused_calls(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = four_bar_begin(context, NULL);
    const kempe_number zero = kempe_value(0);
    kempe_body_def body = kempe_body_default("crank");
    CHECK(kempe_model_add_body(model, &body) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "body 'crank' exists already in the model");
    body.name = NULL;
    CHECK(kempe_model_add_body(model, &body) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "a body needs a name");
    CHECK(kempe_model_add_point(model, "wheel", "P", zero, zero, zero) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "point 'P': body 'wheel' does not exist yet");
    CHECK(kempe_model_add_point(model, "crank", "B", zero, zero, zero) == KEMPE_E_ARGUMENT);
    CHECK(kempe_model_set_q(model, "A", zero, 0) == KEMPE_E_ARGUMENT);
    CHECK(kempe_model_set_gravity(model, zero, zero, zero) == KEMPE_E_ARGUMENT);
    CHECK(kempe_model_finish(model) == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_E_ARGUMENT);
    CHECK(kempe_model_add_parameter(model, "p", zero) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "parameter 'p': the model 'four_bar' is finished and cannot be changed");
    kempe_model_free(model);
    kempe_context_free(context);
}

/* A number that is not finite is reported as in a file. */
static void not_finite(void)
{
    const double values[2] = {NAN, -INFINITY};
    for (int k = 0; k < 2; k++) {
        kempe_context *context = kempe_context_new();
        kempe_model *model = four_bar_begin(context, NULL);
        CHECK(kempe_model_add_parameter(model, "p", kempe_value(values[k])) == KEMPE_OK);
        CHECK(kempe_model_finish(model) == KEMPE_E_INPUT);
        CHECK_TEXT(kempe_context_message(context),
                   k == 0 ? "parameter 'p' is '0/0', which is not a number: a finite number is expected"
                          : "parameter 'p' is '-1/0', which is infinite: a finite number is expected");
        kempe_model_free(model);
        kempe_context_free(context);
    }
}

/* A loop that cannot close is named without a place. */
static void open_loop(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = four_bar_begin(context, NULL);
    kempe_system *system = NULL;
    kempe_assembly *assembly = NULL;
    const kempe_number zero = kempe_value(0);
    CHECK(kempe_model_add_point(model, "ground", "far", kempe_value(9), zero, zero) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "rocker", "tip", kempe_value(1), zero, zero) == KEMPE_OK);
    kempe_closure_def loop = kempe_closure_default("far");
    loop.point[0] = "ground.far";
    loop.point[1] = "rocker.tip";
    CHECK(kempe_model_add_closure(model, &loop) == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_assembly_new(system, &assembly) == KEMPE_E_FAILED);
    CHECK(strncmp(kempe_context_message(context), "four_bar: loop 'far' cannot be closed", 37) == 0);
    kempe_assembly_free(assembly);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* Parts without an adder of their own are written as in a file; errors then have line and column inside that text. */
static void as_text(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = four_bar_begin(context, NULL);
    CHECK(kempe_model_add_text(model, "drives", "motor", "{joint: A, angle: [}") == KEMPE_E_INPUT);
    CHECK(strncmp(kempe_context_message(context), "drive 'motor':1:", 16) == 0);
    CHECK(kempe_model_add_text(model, "drives", "motor", "{joint: A, angl: pi/2 + 20*t}") == KEMPE_OK);
    CHECK(kempe_model_add_text(model, "drives", "motor", "{}") == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "drive 'motor' exists already in the model");
    CHECK(kempe_model_finish(model) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "drive 'motor':1:12: unknown key 'angl'"));
    kempe_model_free(model);

    model = four_bar_begin(context, NULL);
    CHECK(kempe_model_add_text(model, "drives", "motor", "{joint: A, angle: pi/2 + 20*t}") == KEMPE_OK);
    CHECK(kempe_model_add_text(model, "run", "t_end", "0.1") == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_OK);
    CHECK_TEXT(kempe_context_message(context), "");
    kempe_system *system = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_run_options settings = {0};
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_simulate(system, &settings, &trajectory) == KEMPE_OK);
    if (trajectory)
        CHECK_NEAR(kempe_trajectory_q(trajectory, kempe_trajectory_row_count(trajectory) - 1)[0], acos(-1) / 2 + 2,
                   1e-12);
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* A body of every kind of shape, whose mass follows from them, and a shape of the ground. */
static kempe_model *build_shapes(kempe_context *context)
{
    const kempe_number zero = kempe_value(0), aluminium = kempe_value(2700);
    kempe_model *model = NULL;
    CHECK(kempe_model_new(context, "shapes", &model) == KEMPE_OK);
    CHECK(kempe_model_add_parameter(model, "length", kempe_value(0.4)) == KEMPE_OK);
    kempe_body_def arm = kempe_body_default("arm");
    CHECK(kempe_model_add_body(model, &arm) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "arm", "O", zero, zero, zero) == KEMPE_OK);
    CHECK(kempe_model_add_point(model, "arm", "E", kempe_expression("length"), zero, zero) == KEMPE_OK);
    kempe_shape_def capsule = kempe_shape_default("arm"), bore = capsule, ball = capsule, block = capsule,
                    box = capsule, mesh = capsule, line = capsule;
    capsule.kind = "capsule";
    capsule.between[0] = "O";
    capsule.between[1] = "E";
    capsule.radius = kempe_value(0.02);
    capsule.density = aluminium;
    bore.kind = "cylinder";
    bore.dimensions[0] = kempe_value(0.06);
    bore.radius = kempe_value(0.008);
    bore.axis[1] = 1;
    bore.density = aluminium;
    bore.hole = 1;
    ball.kind = "sphere";
    ball.dimensions[0] = kempe_expression("length/10");
    ball.point = "E";
    ball.mass = kempe_value(2);
    ball.colour = "steel";
    box.dimensions[0] = box.dimensions[1] = box.dimensions[2] = kempe_value(0.1);
    box.at[1] = kempe_value(0.2);
    box.opacity = 0.5;
    mesh.kind = "mesh";
    mesh.file = KEMPE_ROOT "/tests/models/block.stl";
    mesh.scale = kempe_value(0.001);
    line.text = "{line: [O, [0.1, 0, 0], E], radius: 0.005, colour: \"#ff0000\"}";
    block.body = "ground";
    block.dimensions[0] = block.dimensions[1] = kempe_value(0.2);
    block.dimensions[2] = kempe_value(0.02);
    const kempe_shape_def *const all[] = {&capsule, &bore, &ball, &box, &mesh, &line, &block};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        CHECK(kempe_model_add_shape(model, all[k]) == KEMPE_OK);
    return model;
}

static void shapes(void)
{
    static const char text[] =
        "kempe: 1\nname: shapes\nparameters: {length: 0.4}\n"
        "ground: {shape: {box: [0.2, 0.2, 0.02]}}\nbodies:\n  arm:\n"
        "    joint: {revolute: z, at: ground}\n    points: {O: [0, 0, 0], E: [length, 0, 0]}\n    shape:\n"
        "      - {capsule: [O, E], radius: 0.02, density: 2700}\n"
        "      - {cylinder: 0.06, radius: 0.008, axis: y, density: 2700, hole: yes}\n"
        "      - {sphere: length/10, at: E, mass: 2, colour: steel}\n"
        "      - {box: [0.1, 0.1, 0.1], at: [0, 0.2, 0], opacity: 0.5}\n"
        "      - {mesh: " KEMPE_ROOT "/tests/models/block.stl, scale: 0.001}\n"
        "      - {line: [O, [0.1, 0, 0], E], radius: 0.005, colour: \"#ff0000\"}\n";
    kempe_context *context = kempe_context_new();
    kempe_model *built = build_shapes(context), *read = NULL;
    char *a = NULL, *b = NULL;
    CHECK(kempe_model_finish(built) == KEMPE_OK);
    CHECK(kempe_model_read_text(context, text, "shapes", &read) == KEMPE_OK);
    CHECK(kempe_model_print(built, KEMPE_JSON, &a) == KEMPE_OK && kempe_model_print(read, KEMPE_JSON, &b) == KEMPE_OK);
    CHECK(a && b && strstr(a, "\"capsule\"") && strstr(a, "\"mesh\""));
    CHECK_TEXT(a, b);
    CHECK(isfinite(run(built)) && run(built) == run(read));
    kempe_text_free(a);
    kempe_text_free(b);
    kempe_model_free(built);
    kempe_model_free(read);
    kempe_context_free(context);
}

/* Mistakes of shapes name the body. */
static void wrong_shapes(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = build_shapes(context);
    kempe_shape_def none = kempe_shape_default("leg"), wrong = kempe_shape_default("arm");
    CHECK(kempe_model_add_shape(model, &none) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "shape 'box': body 'leg' does not exist yet");
    wrong.text = "{box: [1, 1";
    CHECK(kempe_model_add_shape(model, &wrong) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "shape of 'arm'") != NULL);
    wrong.text = NULL;
    wrong.kind = NULL;
    CHECK(kempe_model_add_shape(model, &wrong) == KEMPE_E_ARGUMENT);
    CHECK(kempe_model_add_shape(model, NULL) == KEMPE_E_ARGUMENT && kempe_model_add_shape(NULL, &wrong) < 0);
    wrong.kind = "cone";
    CHECK(kempe_model_add_shape(model, &wrong) == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_E_INPUT);
    if (!strstr(kempe_context_message(context), "shape 7 of body 'arm'"))
        printf("%s\n", kempe_context_message(context));
    CHECK(strstr(kempe_context_message(context), "shape of 'arm'") && strstr(kempe_context_message(context), "cone"));
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(same_as_file);
    TEST(other_kinds);
    TEST(graph);
    TEST(mistakes);
    TEST(refused_calls);
    TEST(not_finite);
    TEST(open_loop);
    TEST(as_text);
    TEST(shapes);
    TEST(wrong_shapes);
    return check_report();
}
