/* SPDX-License-Identifier: BSD-3-Clause */
/* Loads of sections of beams: closed forms of cantilevers and spinning bars, digits of another program, loads of
 * joints, closures beyond a section, and what is refused. */
#include "loaded.h"
#include "testing.h"
#include <kempe/table.h>
#include <math.h>
#include <string.h>

/* The columns of outputs at the row of a run of `t_end` seconds: its first (row 0) or last one (row 1). */
static void take(const char *text, const kempe_run_options *how, const char *outputs, int row, int count,
                 double *values)
{
    loaded l = load_text(text);
    kempe_run_options run = *how;
    kempe_trajectory *t = NULL;
    kempe_table *table = NULL;
    run.output_step = run.t_end;
    run.no_convergence_check = 1;
    CHECK(l.system && kempe_simulate(l.system, &run, &t) == KEMPE_OK);
    CHECK(t && kempe_trajectory_outputs(t, outputs, &table) == KEMPE_OK);
    if (!table)
        printf("%s\n", kempe_context_message(l.context));
    for (int k = 0; k < count; k++)
        values[k] = table ? kempe_table_number(table, row, 1 + k) : NAN;
    kempe_table_free(table);
    kempe_trajectory_free(t);
    unload(&l);
}

/* A cantilever under its weight and a force at its end, which begins in the static deflection. */
static void cantilever_has_its_closed_form(void)
{
    const double area = 0.02, about_z = 0.1 * 0.008 / 12, about_y = 0.2 * 0.001 / 12;
    const double line = 2700 * area * 10, length = 2, x = 1, young = 70e9;
    char text[2000];
    double load[6], shapes[3], stress;
    /* v = line x^2 (-6 L^2 + 4 L x - x^2)/24 E Iz + 10 x^2 (3 L - x)/6 E Iz, and so on, in powers of x/L */
    const double bend = young * about_z, y[3] = {(-line * 6 * pow(length, 4) / 24 + 10 * 3 * pow(length, 3) / 6) / bend,
                                                 (line * 4 * pow(length, 4) / 24 - 10 * pow(length, 3) / 6) / bend,
                                                 -line * pow(length, 4) / 24 / bend};
    const double z[2] = {20 * 3 * pow(length, 3) / 6 / (young * about_y), -20 * pow(length, 3) / 6 / (young * about_y)};
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ngravity: [0, -10, 0]\nparameters: {L: 2}\nbodies:\n  rod:\n"
                   "    joint: {weld: yes, at: ground}\n    flexible:\n"
                   "      beam: {length: L, young: 70 GPa, density: 2700, section: {rectangle: [0.2, 0.1]}}\n"
                   "      shapes: {y: 3, z: 3, axial: 1}\n      raw: yes\n"
                   "    points: {mid: {station: L/2, offset: [0, 0.1, 0.05]}, tip: {station: L}}\n"
                   "forces: {end: {at: rod.tip, force: [5000, 10, 20]}}\n"
                   "start: {q: {rod.y1: %.17g, rod.y2: %.17g, rod.y3: %.17g, rod.z1: %.17g, rod.z2: %.17g, rod.x1: "
                   "%.17g}}\n",
                   y[0], y[1], y[2], z[0], z[1], 5000 * length / (young * area));
    const kempe_run_options run = {.t_end = 1e-6, .rtol = 1e-9};
    take(text, &run, "section(rod.mid)", 0, 6, load);
    take(text, &run, "section_by_shapes(rod.mid)", 0, 3, shapes);
    take(text, &run, "stress(rod.mid)", 0, 1, &stress);
    const double rest = length - x;
    const double expected[6] = {5000, 10 - line * rest, 20, 0, -20 * rest, 10 * rest - line * rest * rest / 2};
    for (int k = 0; k < 6; k++)
        CHECK_NEAR(load[k], expected[k], 1.0); /* of second order: 5000 N times deflections of 1e-4 m */
    for (int k = 1; k < 3; k++)
        CHECK_NEAR(shapes[k], expected[3 + k], 1e-9);
    CHECK_NEAR(stress, load[0] / area - load[5] * 0.1 / about_z + load[4] * 0.05 / about_y, 1e-6 * fabs(stress));
}

#define PENDULUM(n, more)                                                                                              \
    "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"               \
    "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: " #n "}, frame: chord, stiffening: first}\n"      \
    "    points: {root: {station: 0}, mid: {station: 0.5}, tip: {station: 1}}\n" more

/* Half of a falling pendulum, by the wrench of its part in NumPy (check_section_loads.py). */
static void pendulum_has_the_digits_of_another_program(void)
{
    static const struct {
        const char *text;
        double shapes, moment, normal;
    } list[] = {{PENDULUM(1, ""), 0.19578391, 0.29650174, 7.010439},
                {PENDULUM(2, ""), 0.14308321, 0.21540246, 7.024293},
                {PENDULUM(3, ""), -0.06065420, -0.09508574, 7.022529}};
    const kempe_run_options run = {.t_end = 0.25, .rtol = 1e-11, .integrator = "radau"};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
        double load[6], shapes[3], root[6], joint[3], tip[6];
        take(list[k].text, &run, "section(rod.mid)", 1, 6, load);
        take(list[k].text, &run, "section_by_shapes(rod.mid)", 1, 3, shapes);
        take(list[k].text, &run, "section(rod.root)", 1, 6, root);
        take(list[k].text, &run, "section(rod.tip)", 1, 6, tip);
        take(list[k].text, &run, "reaction(A)", 1, 3, joint);
        CHECK_NEAR(load[5], list[k].moment, 1e-8);
        CHECK_NEAR(shapes[2], list[k].shapes, 1e-8);
        CHECK_NEAR(load[0], list[k].normal, 5e-4); /* that program's is in the axes of the body */
        CHECK_NEAR(root[0] * root[0] + root[1] * root[1], joint[0] * joint[0] + joint[1] * joint[1], 1e-9);
        for (int i = 0; i < 6; i++)
            CHECK(fabs(tip[i]) < 1e-12 && (i < 2 || fabs(root[i]) < 1e-9));
    }
}

/* N = rho A Omega^2 (L^2 - x^2)/2, and the mass at the end. */
static void spinning_bar_pulls(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, 0]\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
        "    flexible: {beam: {length: 1, rhoA: 2, EIz: 10}, shapes: {y: 2}, stiffening: full}\n"
        "    points: {root: {station: 0}, mid: {station: 0.4}, tip: {station: 1}}\n"
        "  end: {joint: {name: B, revolute: z, at: rod.tip}, mass: 3, inertia: {zz: 1}}\n"
        "start: {qd: {A: 7}}\n";
    const kempe_run_options run = {.t_end = 1e-3, .rtol = 1e-10};
    double load[6];
    take(text, &run, "section(rod.mid)", 0, 6, load);
    CHECK_NEAR(load[0], 49 * (2 * (1 - 0.16) / 2 + 3), 1e-10);
    take(text, &run, "section(rod.root)", 0, 6, load);
    CHECK_NEAR(load[0], 49 * (1 + 3), 1e-10);
    take(text, &run, "section(rod.tip)", 0, 6, load);
    CHECK_NEAR(load[0], 49 * 3, 1e-10);
}

/* A rod that a closure holds at its far end. */
static void closures_beyond_load_a_section(void)
{
    static const char by_distance[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0], P: [1, 1, 0]}}\nbodies:\n"
        "  rod:\n    joint: {name: A, revolute: z, at: ground.O}\n"
        "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 3}, frame: chord}\n"
        "    points: {mid: {station: 0.5}, root: {station: 0}, tip: {station: 1}}\n"
        "loops: {C: {rod: [rod.tip, ground.P], length: 1}}\n";
    const kempe_run_options run = {.t_end = 0.05, .rtol = 1e-10};
    double tip[6], reaction[3], root[6], joint[3];
    take(by_distance, &run, "section(rod.tip)", 1, 6, tip);
    take(by_distance, &run, "reaction(C)", 1, 3, reaction);
    take(by_distance, &run, "section(rod.root)", 1, 6, root);
    take(by_distance, &run, "reaction(A)", 1, 3, joint);
    CHECK(fabs(reaction[1]) > 1);
    CHECK_NEAR(tip[0] * tip[0] + tip[1] * tip[1], reaction[0] * reaction[0] + reaction[1] * reaction[1], 1e-9);
    CHECK_NEAR(root[0] * root[0] + root[1] * root[1], joint[0] * joint[0] + joint[1] * joint[1], 1e-9);
    CHECK(tip[1] > 0 && fabs(root[5]) < 1e-9);
}

/* The rod of a spatial slider-crank bends in both planes and twists, with all terms of second order: its ends have the
 * loads of its joint and its closure, a station next to the joint those of the joint. */
static void ends_of_a_twisted_rod(void)
{
    static const char text[] =
        "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0], S: [0, 0.02, -0.03]}}\nbodies:\n"
        "  crank: {joint: {name: A, revolute: x, at: ground.O}, mass: 0.1, inertia: {xx: 0.001}, points: {P: [0, 0.1, "
        "0]}}\n"
        "  rod:\n    joint: {name: B, motions: [R3, R2], coordinates: [B1, B2], at: crank.P}\n    flexible:\n"
        "      beam: {length: 0.4, young: 7 GPa, shear: 2.6 GPa, density: 1500, section: {numbers: {A: 9.6e-05, Iy: "
        "5.12e-10, Iz: 1.152e-09, J: 1.2e-9}}}\n"
        "      shapes: {y: 2, z: 2, torsion: 1}\n      raw: yes\n"
        "    points: {root: {station: 0}, near: {station: 1e-10}, E: {station: 0.4, offset: [0, 0.02, 0]}}\n"
        "  slider: {joint: {name: X, prismatic: x, at: ground.S}, mass: 0.4, points: {C: [0, 0, 0]}}\n"
        "loops: {L: {ball: [slider.C, rod.E]}}\ndrives: {d: {joint: A, angle: 50*t}}\n"
        "start: {q: {B1: -0.2517768967649, B2: 0.0750705111, X: 0.39127995}}\n";
    const kempe_run_options run = {.t_end = 0.02, .rtol = 1e-11};
    double root[6], near[6], end[6], joint[3], closure[3], size[4] = {0};
    take(text, &run, "section(rod.root)", 1, 6, root);
    take(text, &run, "section(rod.near)", 1, 6, near);
    take(text, &run, "section(rod.E)", 1, 6, end);
    take(text, &run, "reaction(B)", 1, 3, joint);
    take(text, &run, "reaction(L)", 1, 3, closure);
    for (int k = 0; k < 3; k++) {
        size[0] += root[k] * root[k];
        size[1] += joint[k] * joint[k];
        size[2] += end[k] * end[k];
        size[3] += closure[k] * closure[k];
    }
    CHECK_NEAR(size[0], size[1], 1e-8);
    CHECK_NEAR(size[2], size[3], 1e-8);
    for (int k = 0; k < 6; k++)
        CHECK_NEAR(near[k], root[k], 1e-8);
    CHECK_NEAR(hypot(end[3], end[5]), 0.02 * hypot(end[0], end[2]), 1e-8); /* about the axis of the rod */
    CHECK(fabs(root[3]) > 1e-3);
}

static void refused(const char *text, const char *reason)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "rod.yaml", &model) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), reason));
    if (!strstr(kempe_context_message(context), reason))
        printf("%s\n", kempe_context_message(context));
    kempe_model_free(model);
    kempe_context_free(context);
}

static void refuses_what_is_not_known(void)
{
    refused(PENDULUM(1, "run: {outputs: [stress(rod.mid)]}\n"), "stresses need A, Iy and Iz");
    refused("kempe: 1\nbodies: {a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [1, 0, "
            "0]}}}\nrun: {outputs: [section(a.P)]}\n",
            "body 'a' is rigid");
    refused("kempe: 1\nparameters: {x: 0.3}\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
            "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: 1}}\n    points: {P: {station: x}}\n"
            "run: {outputs: [section(rod.P)]}\n",
            "write the station as a fixed part");
}

int main(void)
{
    TEST(cantilever_has_its_closed_form);
    TEST(pendulum_has_the_digits_of_another_program);
    TEST(spinning_bar_pulls);
    TEST(closures_beyond_load_a_section);
    TEST(ends_of_a_twisted_rod);
    TEST(refuses_what_is_not_known);
    return check_report();
}
