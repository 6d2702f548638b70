/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow sanitized_only 7 */
/* Every allocation fails once (test_memory.c), of what is done with wheels on rails, unknowns, and forces that depend
 * on multipliers. */
#include "exhaust.h"
#include <kempe/vehicle.h>

/* An axle with a rigid and an elastic wheel in a curve, unknowns, a force that goes with a load. */
#define CORPUS KEMPE_ROOT "/tests/fuzz/corpus/model/"

/* The wheels' model for a shorter time, with a force among its outputs and an end. */
static const char text_of_wheels[] =
    "kempe: 1\ngravity: [0, 0, -9.81]\ninclude: [{file: wheels.yaml}]\n"
    "run: {t_end: 1e-3, outputs: [q, lambda(L), contact(R), force(L)], until: [\"q(x) < -1\"]}\n";

static kempe_status read_wheels(scene *s)
{
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read_text(s->context, text_of_wheels, CORPUS "shorter.yaml", &model);
    return drop_model(status, model);
}

static kempe_status roll(scene *s, const char *formulation, int threads)
{
    kempe_run_options run = {0};
    run.formulation = formulation;
    run.integrator = strcmp(formulation, "dae") == 0 ? "ida" : NULL;
    run.rtol = 1e-4;
    run.threads = threads;
    return simulate_run(s, &run);
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

/* The contacts of wheels over a shift, printed in all ways. */
static kempe_status shift_by(scene *s, const char *law)
{
    const kempe_contact_options options = {.sweep = "y=-0.001:0.001:4", .law = law, .conicity = "0.9 mm:1 mm:2"};
    kempe_contacts *table = NULL;
    kempe_status status = kempe_contacts_new(s->system, &options, &table);
    untouched(status, table);
    for (int format = KEMPE_TEXT; format <= KEMPE_FULL_TEXT && status == KEMPE_OK; format++) {
        char *text = NULL;
        status = kempe_contacts_print(table, (kempe_format)format, &text);
        untouched(status, text);
        kempe_text_free(text);
    }
    kempe_table *rows = NULL;
    if (status == KEMPE_OK)
        status = write_table(s, kempe_contacts_table(table, "rows", &rows), &rows);
    if (status == KEMPE_OK)
        status = kempe_contacts_write_picture(table, s->csv);
    kempe_contacts_free(table);
    return status;
}

static kempe_status shift_wheels(scene *s)
{
    return shift_by(s, "fastsim");
}

static kempe_status shift_pressures(scene *s)
{
    return shift_by(s, "half-space");
}

static const named_stage stages[] = {
    {"read", read_wheels}, {"print model", print_model}, {"derive", derive},      {"reduced", roll_reduced},
    {"dae", roll_dae},     {"shared", roll_shared},      {"shift", shift_wheels}, {"pressures", shift_pressures}};

static void every_allocation_fails(void)
{
    scene s = {.context = kempe_context_new()};
    CHECK(kempe_model_read_text(s.context, text_of_wheels, CORPUS "shorter.yaml", &s.model) == KEMPE_OK);
    CHECK(kempe_system_new(s.model, &s.system) == KEMPE_OK);
    exhaust_all(&s, stages, sizeof stages / sizeof *stages, 199);
    kempe_system_free(s.system);
    kempe_model_free(s.model);
    kempe_context_free(s.context);
}

int main(void)
{
    TEST(every_allocation_fails);
    return check_report();
}
