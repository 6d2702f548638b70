/* SPDX-License-Identifier: BSD-3-Clause */
/* Sentences about flexible bodies: their own frequencies and rigid body, loops that elasticity makes mobile, doubts
 * about large deflections, few shapes and fast rotation, parts of elastic energy in modes, the words of a model in
 * results. */
#include "loaded.h"
#include "model/data/flexible.h"
#include "studies/assembly/flexible_check.h"
#include "studies/simulate/trajectory.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/equilibrium.h>
#include <kempe/modes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ROD(joint, EI, flexible)                                                                                       \
    "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n  rod:\n    joint: {" joint ", at: ground}\n    flexible: {beam: "     \
    "{length: 2, rhoA: 3, EIz: " EI "}, " flexible "}\n    points: {mid: {station: 1}, tip: {station: 2}}\n"

static void has(const char *text, const char *words)
{
    CHECK(check_says(text, words));
    if (!check_says(text, words))
        printf("without '%s':\n%s\n", words, text);
}

/* beta^2 sqrt(EI/rho A)/L^2: beta 1.875104, 4.694091 clamped, pi, 2 pi pinned, 4.730041, 7.853205 free. */
static void own_frequencies(void)
{
    static const struct {
        const char *text;
        double fixed[2], free[2];
    } list[] = {{ROD("weld: yes", "7", "shapes: {y: 8}"), {1.8751040687, 4.6940911330}, {4.7300407449, 7.8532046241}},
                {ROD("name: A, revolute: z", "7", "shapes: {y: 8}, frame: chord"),
                 {3.1415926536, 6.2831853072},
                 {4.7300407449, 7.8532046241}}};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
        loaded l = load_text(list[k].text);
        kmp_flexible_spectrum s;
        CHECK(l.model && kmp_flexible_spectrum_find(kmp_model_flexible(l.model, 0), &s));
        for (int i = 0; i < 2; i++) {
            const double unit = sqrt(7 / 3.0) / 4, *fixed = list[k].fixed, *free = list[k].free;
            CHECK_NEAR(s.fixed[i], fixed[i] * fixed[i] * unit, 1e-6 * s.fixed[i]);
            CHECK_NEAR(s.free[i], free[i] * free[i] * unit, 1e-4 * s.free[i]);
        }
        CHECK(s.count == 3 && s.highest > s.free[2]);
        unload(&l);
    }
}

static char *checked(const char *model, kempe_format format)
{
    loaded l = load_text(model);
    kempe_check *check = NULL;
    char *text = NULL;
    CHECK(l.system && kempe_check_new(l.system, &check) == KEMPE_OK);
    CHECK(check && kempe_check_print(check, format, &text) == KEMPE_OK);
    kempe_check_free(check);
    unload(&l);
    return text;
}

static void check_describes_a_body(void)
{
    char *text = checked(ROD("name: A, revolute: z", "7", "shapes: {y: 2}, frame: chord, stiffening: none") "start: "
                                                                                                            "{qd: {A: "
                                                                                                            "3}}\n",
                         KEMPE_TEXT);
    has(text, "rod: stiffening none, frame chord, coordinates rod.y1, rod.y2");
    has(text, "in its frame it vibrates at 0.6");
    has(text, "explicit integrators need steps below");
    has(text, "it has 6 kg, centre [1, 0, 0] m, inertia xx 0 yy 2 zz 2 kg m^2");
    has(text, "it is rigid in bending along z and torsion");
    has(text, "warning: it starts with 3 rad/s");
    free(text);
    text = checked(ROD("name: A, revolute: z", "7", "shapes: {y: 2}, frame: chord"), KEMPE_TEXT);
    CHECK(text && !strstr(text, "warning"));
    free(text);
    text = checked(ROD("name: A, revolute: z", "7", "shapes: {y: 2}, frame: chord"), KEMPE_JSON);
    has(text, "\"flexible_bodies\"");
    has(text, "\"explicit_step\"");
    has(text, "\"stiffening\": \"first\"");
    free(text);
}

/* Numbers of shapes by parameters may be zero: then it is the rigid rod, a pendulum of sqrt(3 g/2 L). */
static void no_shapes_by_parameters(void)
{
    static const char model[] = ROD("name: A, revolute: z", "7", "shapes: {y: n}") "parameters: {n: 0}\n";
    char *text = checked(model, KEMPE_TEXT);
    has(text, "rod: rigid, because its parameters leave it no shapes");
    free(text);
    text = NULL;
    loaded l = load_text(model);
    kempe_modes *modes = NULL;
    CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK);
    CHECK(modes && kempe_modes_print(modes, KEMPE_TEXT, &text) == KEMPE_OK);
    has(text, "0.431703");
    free(text);
    kempe_modes_free(modes);
    unload(&l);
}

/* Two parallel cranks, a coupler, and a third support in its middle. */
#define PARALLEL(third, point, loop)                                                                                   \
    "kempe: 1\nground: {points: {O: [0, 0, 0], P: [0, 1, 0], Q: " point "}}\nbodies:\n"                                \
    "  a: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.1}, points: {T: [1, 0, 0]}}\n"        \
    "  b: {joint: {name: B, revolute: z, at: ground.P}, mass: 1, inertia: {zz: 0.1}, points: {T: [1, 0, 0]}}\n" third  \
    "  rod:\n    joint: {name: C, revolute: z, at: a.T}\n"                                                             \
    "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 3}, frame: chord}\n"                              \
    "    points: {mid: {station: 0.5}, tip: {station: 1}}\n"                                                           \
    "loops: {L: {ball: [rod.tip, b.T]}, K: {ball: [rod.mid, " loop "]}}\nstart: {q: {C: 90 deg, A: 0, B: 0}}\n"

static void elasticity_makes_loops_mobile(void)
{
    char *text = checked(PARALLEL("  m: {joint: {name: M, revolute: z, at: ground.Q}, mass: 1, inertia: {zz: 0.1}, "
                                  "points: {T: [1, 0, 0]}}\n",
                                  "[0, 0.5, 0]", "m.T"),
                         KEMPE_TEXT);
    has(text, "1 equation that would be redundant between rigid bodies loads 'rod'");
    CHECK(text && !strstr(text, "mobile only"));
    free(text);
    text = checked(PARALLEL("", "[1, 0.5, 0]", "ground.Q"), KEMPE_TEXT);
    has(text, "mobile only by the elasticity of 'rod'");
    free(text);
}

/* The warnings and the text of a run. */
static kempe_status run_text(const char *model, char **text, char *messages, size_t room)
{
    loaded l = load_text(model);
    kempe_trajectory *t = NULL;
    kempe_run_options run = {.t_end = 0.3, .rtol = 1e-8, .no_convergence_check = 1};
    *text = NULL;
    kempe_status status = kempe_simulate(l.system, &run, &t);
    (void)snprintf(messages, room, "%s", t && t->warnings ? t->warnings : "");
    CHECK(t && kempe_trajectory_print(t, KEMPE_TEXT, text) == KEMPE_OK);
    kempe_trajectory_free(t);
    unload(&l);
    return status;
}

static void runs_doubt_themselves(void)
{
    char *text, said[4000];
    CHECK(run_text(ROD("weld: yes", "7", "shapes: {y: 3}"), &text, said, sizeof said) == KEMPE_UNTRUSTED);
    has(said, "flexible body 'rod' deflects by");
    has(text, "not trustworthy");
    free(text);
    CHECK(run_text(ROD("weld: yes", "7000", "shapes: {y: 3}"), &text, said, sizeof said) == KEMPE_OK);
    CHECK(!strstr(said, "deflects"));
    has(text, "flexible  rod: stiffening first, frame clamped, 3 coordinates");
    free(text);
    CHECK(run_text(ROD("weld: yes", "7000", "shapes: {y: 1}") "run: {outputs: [section(rod.mid)]}\n", &text, said,
                   sizeof said) == KEMPE_OK);
    has(said, "section 'rod.mid': its moments by loads and by strain of the shapes differ");
    free(text);
    /* Its first frequency is 42.5 rad/s. */
    CHECK(run_text(ROD("name: A, revolute: z", "7000", "shapes: {y: 2}, stiffening: none") "start: {qd: {A: 30}}\n",
                   &text, said, sizeof said) == KEMPE_OK);
    has(said, "of its first frequency, without terms of second order, which stiffen it: take stiffening 'first'");
    free(text);
    CHECK(run_text(ROD("name: A, revolute: z", "7000", "shapes: {y: 2}, stiffening: none") "start: {qd: {A: 60}}\n",
                   &text, said, sizeof said) == KEMPE_UNTRUSTED);
    has(said, "without terms of second order its stiffness is lost at this speed; take stiffening 'first' or 'full'");
    free(text);
}

/* A rod that bends along y alone, beside a plane mechanism and one in space with all shapes. */
static void loads_without_a_shape(void)
{
    static const char rod[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {R: [1, 1, 1]}}\nbodies:\n  rod:\n"
        "    joint: {name: A, revolute: z, at: ground}\n"
        "    flexible: {beam: {length: 1, rhoA: 1, EIz: 1000, EIy: 1000, GJ: 1000, rhoI: 0.1}, shapes: {%s}}\n"
        "    points: {tip: {station: 1}}\n"
        "  bob: {joint: {name: B, universal: [z, y], at: rod.tip}, mass: 1, com: [0, -0.1, %s], inertia: {xx: 0.1, yy: "
        "0.1, zz: 0.1}}\n%s";
    static const char loop[] = "loops: {C: {rod: [ground.R, rod.tip], length: 'sqrt(2)*1 m'}}\n";
    static const struct {
        const char *shapes, *off, *loop;
        int joint, closure; /* which of the sentences are expected */
    } list[] = {{"y: 2", "0", "", 0, 0},
                {"y: 2", "0.3", "", 1, 0},
                {"y: 2", "0", loop, 0, 1},
                {"y: 2, z: 2, torsion: 1", "0.3", loop, 0, 0}};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
        char text[1500];
        (void)snprintf(text, sizeof text, rod, list[k].shapes, list[k].off, list[k].loop);
        char *said = checked(text, KEMPE_TEXT), *json = checked(text, KEMPE_JSON);
        CHECK(said && check_says(said, "joint 'B' loads it in torsion, where it has no shape") == list[k].joint);
        CHECK(said && check_says(said, "loop 'C' loads it along z, where it has no shape") == list[k].closure);
        CHECK(said && check_says(said, "where it has no shape") == (list[k].joint || list[k].closure));
        CHECK(json && (strstr(json, "\"direction\": \"torsion\"") != NULL) == list[k].joint);
        free(said);
        free(json);
    }
    char *said = checked("kempe: 1\ngravity: [0, -10, 0]\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
                         "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 2}}\n"
                         "    points: {tip: {station: 1, offset: [0, 0, 0.1]}}\n"
                         "forces: {push: {at: rod.tip, force: [0, 1, 0]}}\n",
                         KEMPE_TEXT);
    has(said, "force 'push' loads it in torsion, where it has no shape");
    free(said);
}

static void segments_have_no_deflection(void)
{
    load_rejected(ROD("weld: yes", "7000", "segments: 4, shapes: {y: 1}") "run: {outputs: [deflection(rod.tip)]}\n",
                  "output deflection: body 'rod' is divided into rigid segments, which have none");
}

static void modes_name_the_strained_body(void)
{
    loaded l = load_text(ROD("weld: yes", "7000", "shapes: {y: 3}"));
    kempe_modes *modes = NULL;
    kempe_equilibrium *e = NULL;
    char *text = NULL;
    CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK);
    CHECK(modes && kempe_modes_print(modes, KEMPE_TEXT, &text) == KEMPE_OK);
    has(text, "elastic energy: rod 100 %");
    has(text, "Flexible rod: stiffening first, frame clamped");
    free(text);
    text = NULL;
    CHECK(modes && kempe_modes_print(modes, KEMPE_JSON, &text) == KEMPE_OK);
    has(text, "\"strain\"");
    free(text);
    text = NULL;
    CHECK(kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
    CHECK(e && kempe_equilibrium_print(e, KEMPE_TEXT, &text) == KEMPE_OK);
    has(text, "flexible  rod: stiffening first, frame clamped");
    free(text);
    kempe_equilibrium_free(e);
    kempe_modes_free(modes);
    unload(&l);
}

/* A thin beam between two balls turns about its axis by its deflection alone. */
static void thin_beams_are_named(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
        "  rod: {flexible: {shapes: {y: 1, z: 1}, frame: chord, stiffening: first, beam: {length: 1, rhoA: 1, EIy: 20, "
        "EIz: 20}},\n    joint: {spherical: [x, y], at: ground}, points: {P: {station: 1}}}\n"
        "  load: {mass: 1, com: [0.1, 0, 0], inertia: {xx: 0.01, yy: 0.01, zz: 0.01}, joint: {spherical: [x, y], at: "
        "rod.P}}\nstart: {q: {rod.1: 0.2, rod.y1: 0.02, rod.z1: -0.01}}\n";
    static const char *const algorithms[] = {"composite", "articulated"}, *const formulations[] = {"reduced",
                                                                                                   "projected", "dae"};
    for (int way = 0; way < 6; way++) {
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        kempe_system *system = NULL;
        kempe_trajectory *t = NULL;
        const kempe_run_options how = {
            .t_end = 0.5, .formulation = formulations[way / 2], .max_steps = 500, .no_convergence_check = 1};
        CHECK(kempe_model_read_text(context, text, "thin", &model) == KEMPE_OK &&
              kempe_system_new_with_algorithm(model, algorithms[way % 2], &system) == KEMPE_OK);
        CHECK(kempe_simulate(system, &how, &t) == KEMPE_E_FAILED);
        has(t ? kempe_trajectory_reason(t) : NULL, "moves no mass; give body 'rod'");
        kempe_trajectory_free(t);
        kempe_system_free(system);
        kempe_model_free(model);
        kempe_context_free(context);
    }
}

/* A row that articulated bodies cannot close is closed by M. Model 989 of tests/oracle/beam_mechanisms. */
static void rows_are_closed_by_mass(void)
{
    static const char text[] =
        "kempe: 1\nname: rows\ngravity: [0.8736, -4.3799, 3.8173]\n"
        "ground: {points: {O0: [-0.167, -0.235, 0], L20: {at: [0.8686897750060045, -0.36405019910440806, "
        "-0.5301202825347278], axes: {x: [-0.6632829623080181, -0.027142843761577173, 0.7478763119289413], y: "
        "[-0.1591957409245815, 0.9815869667184306, -0.10556392774041845]}}, L31: {at: [0.6333126146465964, "
        "-0.1791093857800688, -0.5228359824335083], axes: {x: [0.9729687480531853, -0.1986848389078785, "
        "0.11771214933033752], y: [0.04199302474702593, 0.653432046493435, 0.75581951978498]}}}}\n"
        "bodies:\n"
        "  b0: {flexible: {shapes: {y: 1, z: 2, axial: 1}, frame: mean, damping: {ratio: 0.0195}, beam: {length: "
        "0.6724, "
        "young: 4.85e7, density: 954.7078, shear: 2.267e7, section: {rectangle: [0.037, 0.046]}}}, points: {P0: "
        "{station: 0.6724}, P1: {station: 0.6724, offset: [0.1136, 0.1321, 0.0883], axes: {x: [-1.092, -0.871, 0.54], "
        "y: "
        "[-0.927, 2.445, -0.546]}}}, joint: {name: j0, motions: [T3, T1, T2, R1, R2, R3], at: ground.O0}}\n"
        "  b1: {mass: 0.7269, com: [-0.2115, -0.0538, 0.0954], inertia: {xx: 0.258369, yy: 0.234235, zz: 0.126426, xy: "
        "0.006816, xz: 0.041914, yz: 0.017358}, points: {P1: {at: [-0.1577, -0.0915, 0.156]}}, joint: {name: j1, "
        "spherical: [[-0.14850130034364906, 0.8693678889635612, -0.47132455636778187], [-0.46978683608401156, "
        "0.35737709878305324, 0.8072062548739212]], at: b0.P0, frame: {y: [0.654, 0.15, 0.402]}}}\n"
        "loops:\n  c0: {cylindrical: [b0.P1, ground.L20], axis: x}\n"
        "  c1: {universal: [b1.P1, ground.L31], axes: [x, x]}\n"
        "forces:\n  f0: {spring: [ground.L20, b1.P1], stiffness: 40, damping: 0.5, free_length: 0.3}\n"
        "start: {q: {j0.1: -0.28377, j0.2: 0.29459, j0.3: 0.13852, j0.4: -0.10484, j0.5: 0.4685, j0.6: -0.41539, j1.1: "
        "-0.84053, j1.2: -0.1305, j1.3: -0.3297, b0.y1: -0.01659, b0.z1: 0.00661, b0.z2: 0.00365, b0.x1: -0.01316}}\n";
    static const char *const algorithms[] = {"composite", "articulated"};
    const kempe_run_options how = {
        .t_end = 0.05, .output_step = 0.01, .rtol = 1e-10, .formulation = "dae", .no_convergence_check = 1};
    double end[2][13] = {{0}};
    for (int way = 0; way < 2; way++) {
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        kempe_system *system = NULL;
        kempe_trajectory *t = NULL;
        CHECK(kempe_model_read_text(context, text, "rows", &model) == KEMPE_OK &&
              kempe_system_new_with_algorithm(model, algorithms[way], &system) == KEMPE_OK && system->n == 13);
        CHECK(kempe_simulate(system, &how, &t) == KEMPE_OK);
        if (t)
            memcpy(end[way], kempe_trajectory_q(t, kempe_trajectory_row_count(t) - 1), sizeof end[way]);
        kempe_trajectory_free(t);
        kempe_system_free(system);
        kempe_model_free(model);
        kempe_context_free(context);
    }
    for (int k = 0; k < 13; k++)
        CHECK_NEAR(end[1][k], end[0][k], 1e-10);
}

int main(void)
{
    TEST(own_frequencies);
    TEST(check_describes_a_body);
    TEST(no_shapes_by_parameters);
    TEST(elasticity_makes_loops_mobile);
    TEST(runs_doubt_themselves);
    TEST(thin_beams_are_named);
    TEST(rows_are_closed_by_mass);
    TEST(loads_without_a_shape);
    TEST(segments_have_no_deflection);
    TEST(modes_name_the_strained_body);
    return check_report();
}
