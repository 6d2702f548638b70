/* SPDX-License-Identifier: BSD-3-Clause */
/* Ports of included files: the models are those that are written out, name for name. `when` and `repeat` decide which
 * parts there are, and no study may vary their parameters. */
#include "model/data/model.h"
#include "ways.h"
#include <kempe/sensitivity.h>
#include <math.h>

#define FOLDER "tests/models/model.yaml"

static const char frame[] = "gravity: [0, -9.81, 0]\nparameters: {more: 1}\ninputs: {u: {default: 2}}\n"
                            "tables: {f: {x: [-2, 0, 2], y: [1, 2, 1]}}\nground: {points: {O: [0, -0.3, 0]}}\n"
                            "algebraic: {double: 2*u}\ndrives: {D: {joint: frame, displacement: \"0.1*t^2\"}}\n"
                            "run: {t_end: 0.5, outputs: [q, s_load, s_far]}\n";

static const char bodies[] =
    "bodies:\n  frame: {joint: {prismatic: x, at: ground}, mass: 5, points: {T: [0, 0.2, 0]}}\n"
    "  arm: {joint: {revolute: z, at: ground}, mass: 1, com: [0.2, 0, 0], inertia: {zz: 0.02}, points: {Q: [0.3, 0, "
    "0]}}\n";

static const char included[] =
    "include: [{file: parts/strut.yaml, prefix: s_, ports: {P: ground.O, Q: arm.Q, J: arm, B: arm, "
    "f: f, u: double, L: D}, set: {extra: more, gas_F1: 100 N}}]\n";

static const char written[] =
    "  s_flag: {joint: {revolute: z, at: arm}, mass: 0.1, com: [0.1, 0, 0], inertia: {zz: 1e-3}}\n"
    "forces:\n  s_push: {joint: arm, torque: \"double*f(q(arm)) - 20*qd(arm)\"}\n"
    "  s_more: {spring: [ground.O, arm.Q], stiffness: 100, free_length: 0.2}\n"
    "  s_gas_force: {line: [ground.O, arm.Q], force: \"-100*pow(40e-6/(40e-6 - pi/4*(0.008)^2*(0.5 - distance)), "
    "1.2)\"}\n"
    "sensors: {s_load: lambda(D), s_far: \"distance(ground.O, arm.Q)\", s_doubled: \"2*distance(ground.O, arm.Q)\"}\n";

/* By text: the model and its file, whose folder has the others. */
static loaded read_as(const char *parts[3])
{
    char text[4096];
    (void)snprintf(text, sizeof text, "kempe: 1\n%s%s%s", parts[0], parts[1], parts[2]);
    return load_text_as(text, KEMPE_ROOT "/" FOLDER);
}

/* Nested ports too: the gas spring of the strut is bound to ports of the strut. */
static void a_part_moves_as_its_text(void)
{
    const char *by_ports[] = {frame, included, bodies}, *by_text[] = {frame, bodies, written};
    for (int k = 0; k < WAYS; k++) {
        loaded a = read_as(by_ports), b = read_as(by_text);
        kempe_trajectory *one = simulate(&a, &ways[k], 0.5), *other = simulate(&b, &ways[k], 0.5);
        for (int i = 0; one && other && i < 3; i++) {
            CHECK_NEAR(last_q(one)[i], last_q(other)[i], 10 * ways[k].tolerance);
            CHECK_NEAR(last_qd(one)[i], last_qd(other)[i], 100 * ways[k].tolerance);
        }
        kempe_trajectory_free(one);
        kempe_trajectory_free(other);
        unload(&a);
        unload(&b);
    }
}

static int find(const char *const *names, int count, const char *name)
{
    for (int k = 0; k < count; k++)
        if (strcmp(names[k], name) == 0)
            return k;
    return -1;
}

/* The force with `when` is there by the parameter after all settings, also of the command. */
static void parts_are_present_by_a_parameter(void)
{
    static const struct {
        const char *value;
        int forces, sensors;
    } rows[] = {{"1", 3, 5}, {"0", 2, 4}, {"-0.5", 3, 5}, {"2 - 2", 2, 4}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        const kempe_setting setting = {"more", rows[k].value};
        const char *parts[] = {frame, included, bodies};
        char text[4096];
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        (void)snprintf(text, sizeof text, "kempe: 1\n%s%s%s", parts[0], parts[1], parts[2]);
        CHECK(kempe_model_read_text_set(context, text, KEMPE_ROOT "/" FOLDER, &setting, 1, &model) == KEMPE_OK);
        if (model)
            CHECK(model->force_count == rows[k].forces && model->sensor_count == rows[k].sensors);
        kempe_model_free(model);
        kempe_context_free(context);
    }
}

/* Entries of every section that may have `when`, of the model itself, and an include: with 0 all of them are absent. */
static void entries_of_all_sections_may_be_absent(void)
{
    static const char text[] =
        "kempe: 1\nparameters: {w: %d}\ninclude: [{file: kempe:gas_spring.yaml, prefix: g_, when: w, ports: {P: "
        "ground.O, Q: a.P}}]\nground: {points: {O: [0, -1, 0], Q: [1, 0, 0]}}\nbodies:\n"
        "  a: {joint: {revolute: z, at: ground}, inertia: {zz: 1}, points: {P: [1, 0, 0]}}\n"
        "  c: {joint: {revolute: z, at: ground.Q}, inertia: {zz: 1}}\n"
        "  b: {joint: {revolute: z, at: a.P}, inertia: {zz: 1}, points: {P: [1, 0, 0]}, when: w}\n"
        "loops: {l: {coupler: {a: 1, c: 1}, when: w}}\n"
        "gears: {g: {between: [a, c], radius: [0.5, 0.5], stiffness: 1e6, backlash: 1 mm, when: w}}\n"
        "ropes: {r: {along: [ground.O, a.P], stiffness: 100, when: w}}\n"
        "drives: {d: {joint: b, locked: yes, when: w}}\nforces: {f: {joint: a, torque: 1, when: w}}\n"
        "contacts: {k: {joint: a, lower: -1, restitution: 0, when: w}}\n"
        "bearings: {p: {joint: a, at: [0, 1], when: w}}\n"
        "algebraic: {u: {value: 2*q(a), when: w}}\nsensors: {s: {value: 2*q(a), when: w}}\n";
    for (int present = 0; present < 2; present++) {
        char made[2048];
        (void)snprintf(made, sizeof made, text, present);
        loaded l = load_text(made);
        const kempe_model *m = l.model;
        if (m) {
            CHECK(m->body_count == (present ? 4 : 3) && m->rope_count == present && m->bearing_count == present);
            CHECK((m->closure_count > 0) == present && (m->force_count > 0) == present);
            CHECK(m->unknowns_count == (present ? 2 : 0) && m->sensor_count == (present ? 3 : 0));
        }
        unload(&l);
    }
}

/* Copies have their own names, numbers and bindings. */
static void copies_are_around_a_wheel(void)
{
    loaded l = load("tests/models/strut_machine.yaml");
    if (!l.model)
        return;
    for (int k = 1; k <= 3; k++) {
        char name[32];
        (void)snprintf(name, sizeof name, "w_%d_weight", k);
        const int body = kmp_name_find(KMP_BODY_NAMES(l.model), name);
        CHECK(body > 0);
        CHECK_NEAR(body > 0 ? l.model->bodies[body].mass.value : 0, 0.1 * k, 1e-15);
        (void)snprintf(name, sizeof name, "w_%d_place", k);
        for (int p = 0; p < l.model->point_count; p++)
            if (strcmp(l.model->points[p].name, name) == 0) {
                CHECK_NEAR(l.model->points[p].at[0].value, 0.1 * cos(2 * 3.14159265358979 * k / 3), 1e-14);
                CHECK_NEAR(l.model->points[p].at[1].value, 0.1 * sin(2 * 3.14159265358979 * k / 3), 1e-14);
            }
    }
    static const char *const away[] = {"w_1_away", "w_2_away", "w_3_away"};
    for (int k = 0; k < l.model->sensor_count; k++)
        CHECK(strncmp(l.model->sensors[k].name, "w_", 2) != 0 || find(away, 3, l.model->sensors[k].name) >= 0);
    unload(&l);
}

/* No study may vary what decides which parts there are; what a part depends on otherwise, it may. */
static void deciding_parameters_are_fixed(void)
{
    loaded l = load("tests/models/strut_machine.yaml");
    static const struct {
        const char *parameter;
        bool varies;
    } rows[] = {{"more", false}, {"n", false}, {"s_extra", false}, {"s_gas_F1", true}, {"s_c", true}};
    for (size_t k = 0; l.model && k < sizeof rows / sizeof *rows; k++) {
        kempe_sensitivity *made = NULL;
        const kempe_sensitivity_options options = {.parameters = rows[k].parameter,
                                                   .run = &(kempe_run_options){.t_end = 0.01}};
        const kempe_status status = kempe_sensitivity_new(l.model, &options, &made);
        CHECK((status >= 0) == rows[k].varies);
        if (!rows[k].varies)
            CHECK(strstr(kempe_context_message(l.context), "cannot be a variable of the equations") != NULL);
        kempe_sensitivity_free(made);
    }
    unload(&l);
}

/* A name `port` means nothing in files without ports. */
static void port_may_be_a_body(void)
{
    loaded l =
        load_text("kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n  port: {joint: {revolute: z, at: ground}, "
                  "inertia: {zz: 1}, points: {P: [1, 0, 0], port: [0, 1, 0]}}\n"
                  "forces: {f: {joint: port, torque: \"distance(port.P, ground.O) + distance(port.port, "
                  "ground.O) - qd(port)\"}}\nrun: {t_end: 30}\n");
    kempe_trajectory *run = simulate(&l, &ways[0], 30);
    CHECK_NEAR(run ? last_qd(run)[0] : 0, 2, 1e-8);
    kempe_trajectory_free(run);
    unload(&l);
}

int main(void)
{
    TEST(a_part_moves_as_its_text);
    TEST(parts_are_present_by_a_parameter);
    TEST(entries_of_all_sections_may_be_absent);
    TEST(copies_are_around_a_wheel);
    TEST(deciding_parameters_are_fixed);
    TEST(port_may_be_a_body);
    return check_report();
}
