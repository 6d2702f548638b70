/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 4 */
/* Good models: every part of the language, as the reader understands it. */
#include "base/memory.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "testing.h"
#include <kempe/settings.h>
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

static kempe_context *context;

static const char four_bar[] =
    "kempe: 1\n"
    "name: four-bar\n"
    "gravity: [0, -9.81, 0]\n"
    "parameters: {crank: 0.3, half: crank/2, later: 2*after, after: 1.5, rho: 1/0.3}\n"
    "ground: {points: {O: [0, 0, 0], D: [0.9, 0, 0]}}\n"
    "bodies:\n"
    "  coupler:\n" /* before its parent */
    "    joint: {name: B, revolute: -z, at: crank.B}\n"
    "    mass: 1\n"
    "    points: {C: [0.8, 0, 0]}\n"
    "  crank:\n"
    "    joint: {name: A, revolute: z, at: ground.O}\n"
    "    mass: rho*crank\n"
    "    com: [half, 0, 0]\n"
    "    inertia: {zz: rho*crank^3/12}\n"
    "    points: {B: [crank, 0, 0]}\n"
    "  rocker:\n"
    "    joint: {motions: [R3, T1, -R2, {R: [0, 3, 4]}, {T: -y}], at: ground.D}\n"
    "    inertia: {xx: 1, yy: 2, zz: 3, xy: 0.1}\n"
    "    points:\n"
    "      C: [0.7, 0, 0]\n"
    "  slider: {joint: {cylindrical: [1, 0, 0], at: ground}}\n"
    "  tip: {joint: {prismatic: y, at: crank}}\n"
    "loops:\n"
    "  C: {ball: [coupler.C, rocker.C]}\n"
    "  R: {rod: [crank.B, ground.D], length: 2*crank}\n"
    "forces:\n"
    "  motor: {joint: A, torque: \"0.2 - 0.01*qd(A)*rho\"}\n"
    "  push: {joint: slider.1, force: 10*sin(t)}\n"
    "  s1: {spring: [crank.B, ground.O], stiffness: 4530, free_length: 0.07785}\n"
    "start: {q: {A: 0.1, rocker.2: crank}, qd: {A: -20}, hold: [A, slider.2]}\n"
    "run: {t_end: 5, rtol: 1e-9, atol: 1e-8, output_step: 1/100, formulation: reduced, form: integrated, integrator: "
    "dop853,\n"
    "      independent: [tip, A], outputs: [q, qdd, lambda, lambda(R), position(coupler.C)]}\n";

static kempe_model *read_good(const char *text)
{
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read_text(context, text, "text.yaml", &model);
    CHECK(status == KEMPE_OK);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK((status == KEMPE_OK) == (model != NULL));
    return model;
}

static const kmp_body *find_body(const kempe_model *model, const char *name)
{
    for (int i = 0; i < model->body_count; i++)
        if (strcmp(model->bodies[i].name, name) == 0)
            return &model->bodies[i];
    printf("no body '%s'\n", name);
    check_failures++;
    return &model->bodies[0];
}

static void head(void)
{
    kempe_model *m = read_good(four_bar);
    if (!m)
        return;
    CHECK_TEXT(kempe_model_name(m), "four-bar");
    CHECK(m->gravity[1].value == -9.81 && m->gravity[1].expr == NULL);
    CHECK(m->parameter_count == 5);
    CHECK_NEAR(m->parameters[1].number.value, 0.15, 0);
    CHECK(m->parameters[1].number.expr && m->parameters[1].number.expr->kind == KMP_EXPR_DIV);
    CHECK_NEAR(m->parameters[2].number.value, 3, 0);
    CHECK(m->parameters[0].number.expr == NULL);
    kempe_model_free(m);
}

static void bodies(void)
{
    static const char *const names[] = {"ground", "crank", "coupler", "rocker", "slider", "tip"};
    kempe_model *m = read_good(four_bar);
    if (!m)
        return;
    CHECK(m->body_count == 6);
    for (int i = 0; i < 6; i++)
        CHECK_TEXT(m->bodies[i].name, names[i]);
    for (int i = 1; i < 6; i++)
        CHECK(m->bodies[i].parent >= 0 && m->bodies[i].parent < i);
    const kmp_body *coupler = find_body(m, "coupler"), *crank = find_body(m, "crank"), *tip = find_body(m, "tip");
    CHECK(coupler->parent == 1 && coupler->at >= 0);
    CHECK_TEXT(m->points[coupler->at].name, "B");
    CHECK(m->points[coupler->at].body == 1);
    CHECK_NEAR(m->points[coupler->at].at[0].value, 0.3, 0);
    CHECK(tip->parent == 1 && tip->at == -1);
    CHECK_TEXT(tip->joint, "tip");
    CHECK_NEAR(crank->mass.value, 1, 1e-15);
    CHECK_NEAR(crank->com[0].value, 0.15, 0);
    CHECK_NEAR(crank->inertia[2].value, 0.0075, 1e-15);
    CHECK_NEAR(find_body(m, "rocker")->inertia[3].value, 0.1, 0);
    CHECK(crank->place.line == 11 && crank->place.column == 3);
    kempe_model_free(m);
}

static void motions(void)
{
    static const char *const names[] = {"A",        "B",        "rocker.1", "rocker.2", "rocker.3",
                                        "rocker.4", "rocker.5", "slider.1", "slider.2", "tip"};
    static const double axes[][3] = {{0, 0, 1},     {0, 0, -1}, {0, 0, 1}, {1, 0, 0}, {0, -1, 0},
                                     {0, 0.6, 0.8}, {0, -1, 0}, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    static const bool rotation[] = {true, true, true, false, true, true, false, false, true, false};
    kempe_model *m = read_good(four_bar);
    if (!m)
        return;
    CHECK(kempe_model_coordinate_count(m) == 10);
    for (int i = 0; i < 10; i++) {
        CHECK_TEXT(kempe_model_coordinate_name(m, i), names[i]);
        CHECK(m->motions[i].rotation == rotation[i]);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(m->motions[i].axis[k], axes[i][k], 1e-15);
    }
    CHECK(find_body(m, "rocker")->first_motion == 2 && find_body(m, "rocker")->motion_count == 5);
    kempe_model_free(m);
}

/* Coordinates with names of their own are still the k-th of their joint; of one motion, the joint's. */
static void coordinate_names(void)
{
    static const char text[] = "kempe: 1\nbodies:\n"
                               "  a: {joint: {name: J, motions: [T1, T2, R3], coordinates: [x, ~, yaw], at: ground}, "
                               "mass: 1, inertia: {zz: 1}}\n"
                               "  b: {joint: {revolute: z, coordinates: [turn], at: a}, inertia: {zz: 1}}\n"
                               "  c: {joint: {name: K, motions: [T1, R2], coordinates: [s, ~], at: a, reversed: yes}, "
                               "mass: 1, inertia: {yy: 1}}\n"
                               "start: {q: {x: 1, J.2: 2, J.3: 3, b: 4, K.2: 5, s: 6}, qd: {J.1: 5, yaw: 7, b.1: 9, "
                               "K.1: 8}}\n";
    static const char *const names[] = {"x", "J.2", "yaw", "turn", "K.2", "s"}; /* K's are turned round */
    static const double q[] = {1, 2, 3, 4, 5, 6}, qd[] = {5, 0, 7, 9, 0, 8};
    kempe_model *m = read_good(text);
    for (int i = 0; m && i < 6; i++) {
        CHECK_TEXT(kempe_model_coordinate_name(m, i), names[i]);
        CHECK_NEAR(m->start.q[i].value, q[i], 0);
        CHECK_NEAR(m->start.qd[i].value, qd[i], 0);
    }
    kempe_model_free(m);
}

static void closures_and_forces(void)
{
    kempe_model *m = read_good(four_bar);
    if (!m)
        return;
    CHECK(m->closure_count == 2 && m->force_count == 3);
    CHECK(m->closures[0].kind == KMP_CLOSURE_ball);
    CHECK(m->closures[1].kind == KMP_CLOSURE_rod);
    CHECK_NEAR(m->closures[1].number.value, 0.6, 0);
    CHECK_TEXT(m->bodies[m->points[m->closures[0].point[1]].body].name, "rocker");
    CHECK(m->forces[0].kind == KMP_FORCE_JOINT && m->forces[0].motion == 0);
    CHECK(m->forces[0].effort && !kmp_expr_is_constant(m->forces[0].effort));
    CHECK(m->forces[1].motion == 7);
    CHECK(m->forces[2].kind == KMP_FORCE_SPRING);
    CHECK_NEAR(m->forces[2].free_length.value, 0.07785, 0);
    CHECK(m->forces[2].damping.value == 0);
    kempe_model_free(m);
}

static void start_and_run(void)
{
    kempe_model *m = read_good(four_bar);
    if (!m)
        return;
    CHECK_NEAR(m->start.q[0].value, 0.1, 0);
    CHECK_NEAR(m->start.q[3].value, 0.3, 0);
    CHECK(m->start.q_given[3] && !m->start.q_given[4] && m->start.qd_given[0] && !m->start.qd_given[3]);
    CHECK(m->start.hold[0] && m->start.hold[8] && !m->start.hold[1]);
    CHECK(m->run.t_end == 5 && m->run.rtol == 1e-9 && m->run.atol == 1e-8 && m->run.output_step == 0.01);
    CHECK_TEXT(m->run.integrator, "dop853");
    CHECK(m->run.independent_count == 2 && m->run.independent[0] == 9 && m->run.independent[1] == 0);
    CHECK(m->output_count == 5);
    CHECK(m->outputs[2].kind == KMP_OUTPUT_LAMBDA && m->outputs[2].index == -1);
    CHECK(m->outputs[3].kind == KMP_OUTPUT_LAMBDA && m->outputs[3].index == 1);
    CHECK(m->outputs[4].kind == KMP_OUTPUT_POSITION && strcmp(m->points[m->outputs[4].index].name, "C") == 0);
    kempe_model_free(m);
}

static void defaults(void)
{
    kempe_model *m = read_good("kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}}}\n");
    if (!m)
        return;
    CHECK_TEXT(kempe_model_name(m), "text");
    CHECK(m->gravity[1].value == 0 && m->bodies[1].mass.value == 0 && m->run.t_end == 0 && m->run.formulation == NULL);
    CHECK(m->output_count == 4 && m->closure_count == 0 && m->start.q[0].value == 0);
    kempe_model_free(m);
    m = read_good("kempe: 1\nparameters:\nforces:\nbodies: {a: {joint: {name: ä, revolute: z, at: ground}}}");
    CHECK(m && strcmp(kempe_model_coordinate_name(m, 0), "ä") == 0);
    kempe_model_free(m);
}

/* A flat plate, as its maker rounded it, and a point mass away from its axes. */
static void possible_inertias(void)
{
    static const char *const entries[] = {"{xx: 0.333, yy: 0.667, zz: 1.00003}",
                                          "{}",
                                          "{xx: 0, yy: 0, zz: 0}",
                                          "{xx: 2, yy: 2, zz: 2, xy: -1, xz: -1, yz: -1}",
                                          "{zz: 1, xy: 5}",
                                          "{xx: 0, yy: 1e-12, zz: 1e-12}"};
    for (size_t i = 0; i < sizeof entries / sizeof entries[0]; i++) {
        char text[256];
        snprintf(text, sizeof text, "kempe: 1\nbodies:\n  a: {joint: {revolute: z, at: ground}, inertia: %s}\n",
                 entries[i]);
        kempe_model_free(read_good(text));
    }
}

static void printing(void)
{
    kempe_model *m = read_good(four_bar);
    char *text = NULL;
    if (!m)
        return;
    CHECK(kempe_model_print(m, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(strstr(text, "  3 rocker: joint rocker at ground.D: R3 T1 -R2 R[0, 0.6, 0.8] -T2\n") != NULL);
    CHECK(strstr(text, "  half = 0.15  (crank/2)\n") != NULL);
    CHECK(strstr(text, "  motor: torque on A = 0.2 - 0.01*qd(A)*rho\n") != NULL);
    CHECK(strstr(text, "  R: rod crank.B - ground.D, length 0.6\n") != NULL);
    if (getenv("KEMPE_SHOW"))
        puts(text);
    kempe_text_free(text);
    CHECK(kempe_model_print(m, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text[0] == '{' && strstr(text, "\"effort\": \"0.2 - 0.01*qd(A)*rho\"") != NULL);
    CHECK(strstr(text, "\"coordinates\": [\"A\", \"B\", \"rocker.1\"") != NULL);
    if (getenv("KEMPE_SHOW"))
        puts(text);
    kempe_text_free(text);
    kempe_model_free(m);
}

/* The value of a model's only parameter `x`, which is written so; NaN when the model is refused. */
static double parameter(const char *expression)
{
    char text[512];
    kempe_model *m = NULL;
    snprintf(text, sizeof text, "kempe: 1\nparameters: {x: \"%s\"}\nbodies: {a: {joint: {revolute: z, at: ground}}}\n",
             expression);
    if (kempe_model_read_text(context, text, "text", &m) != KEMPE_OK)
        return NAN;
    double value = m->parameters[0].number.value;
    kempe_model_free(m);
    return value;
}

static void units(void)
{
    const double pi = 3.14159265358979323846;
    CHECK(parameter("300 mm") == 0.3);
    CHECK(parameter("4.5 N/mm") == 4500);
    CHECK(parameter("4.5 N / mm") == 4500);
    CHECK(parameter("2*(300 mm) + 0.1 m") == 0.7);
    CHECK_NEAR(parameter("20 rpm"), 20 * 2 * pi / 60, 1e-15);
    CHECK_NEAR(parameter("90 deg"), pi / 2, 1e-15);
    CHECK_NEAR(parameter("10 ms"), 0.01, 0);
    CHECK(parameter("2 kN") == 2000 && parameter("1 bar") == 1e5);
    CHECK(parameter("7.8 g/cm^3") == 7800);
    CHECK(parameter("3 kg*m^2/s^2") == 3 && parameter("2 m^-1") == 2 && parameter("5 N*m/rad") == 5);
    CHECK(parameter("2 N*m*3") == 6 && parameter("6 m/2/3") == 1);
    CHECK(parameter("sqrt(9 m^2) + 1 m") == 4 && parameter("(4 m^2)^(1/2) - 1 m") == 1);
    CHECK(parameter("1 kN*m + 5 J") == 1005);
    CHECK(parameter("sin(90 deg)/(1 s) + 1 Hz") == 2);
    CHECK(parameter("1 + 2 m") == 3);             /* a bare number fits */
    CHECK(parameter("3*sign(-1 s) + 2 m") == -1); /* so does a sign times one */
    CHECK(isnan(parameter("1 m + 2 s")) && isnan(parameter("2*(1 m) + 2 s")) && isnan(parameter("sin(1 m)")));
    CHECK(isnan(parameter("log(1 kg/m)")) && isnan(parameter("2^(3 m)")) && isnan(parameter("sqrt(4 m) + 1 m")));
    CHECK(isnan(parameter("2 m^10")) && isnan(parameter("2 m^1.5")) && isnan(parameter("2 m^(2)")));
}

/* Every key takes its own dimension; parameters carry theirs, those without unit none. */
static void dimensioned(void)
{
    kempe_model *m = read_good(
        "kempe: 1\ngravity: [0, -981 cm/s^2, 0]\n"
        "parameters: {l: 300 mm, rho: 1/0.3, mu: 7 kg/m, k: 3 kN/m, later: 2*l + 1 cm}\n"
        "bodies:\n  a: {joint: {revolute: z, at: ground}, mass: rho*l, com: [l/2, 0, 0],\n"
        "    inertia: {zz: mu*l^3/12}, points: {P: [later, 5 cm, 0]}}\n"
        "  b: {joint: {prismatic: x, at: a.P}, mass: mu*l}\n"
        "forces: {m: {joint: a, torque: \"k*l^2*sin(q(a)) - 0.1*qd(a)\"}, f: {joint: b, force: 2 kN}}\n"
        "start: {q: {a: 90 deg, b: 3 mm}, qd: {a: 20 rpm, b: 1 m/s}}\nrun: {t_end: 2 min, output_step: 10 ms}\n");
    if (!m)
        return;
    CHECK(m->gravity[1].value == -9.81 && m->run.t_end == 120 && m->run.output_step == 0.01);
    CHECK_NEAR(m->bodies[1].inertia[2].value, 7 * 0.027 / 12, 1e-15);
    kempe_model_free(m);
}

static void settings(void)
{
    static const char text[] = "kempe: 1\nparameters: {l: 0.5, m: 2*l}\n"
                               "bodies: {a: {joint: {revolute: z, at: ground}, mass: m, com: [l, 0, 0]}}\n";
    const kempe_setting good[] = {{"l", "9"}, {"l", "200 mm"}, {"m", "3*l/(1 m)*(1 kg)"}};
    const kempe_setting bad[] = {{"L", "1"}, {"m", "2*x"}, {"l", "3 kg"}};
    kempe_model *m = NULL;
    CHECK(kempe_model_read_text_set(context, text, "text", good, 3, &m) == KEMPE_OK);
    if (m) {
        CHECK_NEAR(m->bodies[1].com[0].value, 0.2, 0);
        CHECK_NEAR(m->bodies[1].mass.value, 0.6, 1e-15);
    }
    kempe_model_free(m);
    m = NULL;
    CHECK(kempe_model_read_text_set(context, text, "text", bad, 3, &m) == KEMPE_E_INPUT && !m);
    const char *said = kempe_context_message(context);
    CHECK(strstr(said, "text:3:63: component 1 of the com of body 'a': expected m, got kg\n") == said);
    CHECK(strstr(said, "--set L:1:1: the model has no parameter 'L'; did you mean 'l'?") != NULL);
    CHECK(strstr(said, "--set m:1:3: unknown parameter 'x'") != NULL);
    CHECK(kempe_model_read_text_set(context, "kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}}}\n", "text", bad,
                                    1, &m) == KEMPE_E_INPUT);
}

static bool is_whole(kempe_status status, const kempe_model *model)
{
    if (status == KEMPE_OK)
        return model != NULL;
    return status == KEMPE_E_INPUT && model == NULL && kempe_context_message(context)[0] != '\0';
}

/* Cut anywhere, a file gives a model or a complaint. */
static void truncations(void)
{
    size_t size = sizeof four_bar;
    char *text = kmp_calloc(size, 1);
    for (size_t length = 0; length < size; length++) {
        kempe_model *model = NULL;
        memcpy(text, four_bar, length);
        text[length] = '\0';
        kempe_status status = kempe_model_read_text(context, text, "cut", &model);
        CHECK(is_whole(status, model));
        kempe_model_free(model);
    }
    kmp_free(text);
}

/* Any one character replaced by another that means something to the language. */
static void mutations(void)
{
    static const char others[] = "{}[]:,'\"-#&*0x.( \n\t?^";
    char *text = kmp_strdup(four_bar);
    for (size_t i = 0; text && four_bar[i]; i++)
        for (size_t k = i % 3; k < sizeof others - 1; k += 3) {
            kempe_model *model = NULL;
            text[i] = others[k];
            kempe_status status = kempe_model_read_text(context, text, "changed", &model);
            CHECK(is_whole(status, model));
            kempe_model_free(model);
            text[i] = four_bar[i];
        }
    kmp_free(text);
}

static void files(void)
{
    char path[64], *text = NULL;
    kempe_model *model = NULL;
    snprintf(path, sizeof path, "/tmp/kempe_test_reader_%ld.yaml", (long)getpid());
    CHECK(kempe_write_file(context, path, "old") == KEMPE_OK);
    CHECK(kempe_write_file(context, path, four_bar) == KEMPE_OK);
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
    CHECK(model && kempe_model_print(model, KEMPE_TEXT, &text) == KEMPE_OK);
    kempe_text_free(text);
    kempe_model_free(model);
    unlink(path);
    CHECK(kempe_write_file(context, "/tmp", "x") == KEMPE_E_IO);
    CHECK(kempe_write_file(context, "/no/such/folder/file", "x") == KEMPE_E_IO);
    CHECK(strstr(kempe_context_message(context), "/no/such/folder/file") != NULL);
    if (access("/dev/null", W_OK) == 0) { /* a device is written to, and stays one */
        CHECK(kempe_write_file(context, "/dev/null", "x") == KEMPE_OK);
        CHECK(access("/dev/null", W_OK) == 0);
    }
}

int main(void)
{
    context = kempe_context_new();
    TEST(head);
    TEST(bodies);
    TEST(motions);
    TEST(coordinate_names);
    TEST(closures_and_forces);
    TEST(start_and_run);
    TEST(defaults);
    TEST(possible_inertias);
    TEST(units);
    TEST(dimensioned);
    TEST(settings);
    TEST(printing);
    TEST(truncations);
    TEST(mutations);
    TEST(files);
    kempe_context_free(context);
    return check_report();
}
