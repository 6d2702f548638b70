/* SPDX-License-Identifier: BSD-3-Clause */
/* Every allocation fails once (test_memory.c), of what is done with wheels on rails, unknowns, and forces that depend
 * on multipliers. */
#include "exhaust.h"
#include <stdlib.h>
#include <unistd.h>

static char file[] = "/tmp/kempe_memory_XXXXXX";

/* An axle with a rigid and an elastic wheel in a curve, unknowns, forces that go with a load, an end. */
static const char text_of_wheels[] =
    "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {b: 0.75, V: 20}\n"
    "profiles:\n"
    "  tread: {y: [-0.03, -0.02, -0.01, 0, 0.01, 0.02, 0.03], z: [-1.5 mm, -1 mm, -0.5 mm, 0, 0.5 mm, 1 mm, 1.5 mm]}\n"
    "  head: {y: [-0.03, -0.02, -0.01, 0, 0.01, 0.02, 0.03], z: [-1.50375 mm, -0.667 mm, -0.1667 mm, 0, -0.1667 mm, "
    "-0.667 mm, -1.50375 mm]}\n"
    "tracks:\n"
    "  line: {at: ground.O, rail: head, gauge: 1450 mm, gauge_depth: 1 mm, course: [{straight: 5}, {transition: 5}, "
    "{left: 9, radius: 90}]}\n"
    "ground: {points: {O: [0, 0, 0]}}\n"
    "unknowns: {root: {of: {X: 1}, zero: [\"X^3 + X - 2 - q(y)\"]}, load: X*lambda(L)}\n"
    "bodies:\n"
    "  axle:\n"
    "    joint: {motions: [T1, T2, T3, R3, R1, R2], coordinates: [x, y, z, yaw, roll, spin], at: ground.O}\n"
    "    mass: 1200\n"
    "    inertia: {xx: 600, yy: 100, zz: 600}\n"
    "    points: {L: [0, b, 0], R: [0, -b, 0]}\n"
    "wheels:\n"
    "  L: {on: line.left, at: axle.L, profile: tread, radius: 0.46, contact: rigid, creep: linear}\n"
    "  R: {on: line.right, at: axle.R, profile: tread, radius: 0.46, contact: elastic, creep: polach}\n"
    "forces: {drag: {joint: spin, torque: -1e-3*load}}\n"
    "start: {q: {y: 3 mm, z: 460.6 mm}, qd: {x: V, spin: V/0.46}}\n"
    "run: {t_end: 1e-3, outputs: [q, lambda(L), contact(R), force(L)], until: [\"q(x) < -1\"]}\n";

static kempe_status read_wheels(scene *s)
{
    kempe_model *model = NULL;
    char *text = NULL;
    kempe_status status = kempe_model_read_text(s->context, text_of_wheels, "wheels.yaml", &model);
    untouched(status, model);
    if (status == KEMPE_OK) {
        status = kempe_model_print(model, KEMPE_JSON, &text);
        untouched(status, text);
    }
    kempe_text_free(text);
    kempe_model_free(model);
    return status;
}

static kempe_status derive_wheels(scene *s)
{
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_status status = kempe_model_read_text(s->context, text_of_wheels, "wheels.yaml", &model);
    if (status == KEMPE_OK)
        status = kempe_system_new(model, &system);
    untouched(status, system);
    kempe_system_free(system);
    kempe_model_free(model);
    return status;
}

static kempe_status roll(scene *s, const char *road, int threads)
{
    kempe_trajectory *trajectory = NULL;
    kempe_run run = kempe_run_default();
    run.road = road;
    run.rtol = 1e-4;
    run.threads = threads;
    kempe_status status = kempe_simulate(s->system, &run, &trajectory);
    untouched(status, trajectory);
    kempe_trajectory_free(trajectory);
    return status;
}

static kempe_status roll_reduced(scene *s)
{
    return roll(s, "reduced", 1);
}

static kempe_status roll_dae(scene *s)
{
    return roll(s, "dae", 1);
}

static kempe_status roll_shared(scene *s)
{
    return roll(s, "dae", 2);
}

/* Where wheels touch over a shift, told in all ways. */
static kempe_status shift_wheels(scene *s)
{
    const kempe_contact_ask ask = {.over = "y=-0.001:0.001:2", .law = "fastsim"};
    kempe_contact_table *table = NULL;
    kempe_status status = kempe_contact_table_new(s->system, &ask, &table);
    untouched(status, table);
    for (int format = KEMPE_TEXT; format <= KEMPE_JSON && status == KEMPE_OK; format++) {
        char *text = NULL;
        status = kempe_contact_table_print(table, (kempe_format)format, &text);
        untouched(status, text);
        kempe_text_free(text);
    }
    if (status == KEMPE_OK)
        status = kempe_contact_table_write_csv(table, file);
    if (status == KEMPE_OK)
        status = kempe_contact_table_write_svg(table, file);
    kempe_contact_table_free(table);
    return status;
}

static const struct {
    const char *name;
    stage_fn *stage;
} stages[] = {{"read", read_wheels}, {"derive", derive_wheels}, {"reduced", roll_reduced},
              {"dae", roll_dae},     {"shared", roll_shared},   {"shift", shift_wheels}};

static void every_allocation_fails(void)
{
    scene s = {.context = kempe_context_new()};
    int opened = mkstemp(file);
    CHECK(opened >= 0);
    CHECK(kempe_model_read_text(s.context, text_of_wheels, "wheels.yaml", &s.model) == KEMPE_OK);
    CHECK(kempe_system_new(s.model, &s.system) == KEMPE_OK);
    for (size_t k = 0; k < sizeof stages / sizeof *stages; k++)
        exhaust(&s, stages[k].name, stages[k].stage, 199);
    kempe_system_free(s.system);
    kempe_model_free(s.model);
    kempe_context_free(s.context);
    if (opened >= 0)
        close(opened);
    unlink(file);
}

int main(void)
{
    TEST(every_allocation_fails);
    return check_report();
}
