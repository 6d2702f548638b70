/* SPDX-License-Identifier: BSD-3-Clause */
/* Every row of statuses.def is provoked by a real call: a row more does not compile without its provoke_NAME here. A
 * defect is made by what a forgotten row would be: a kind of closure that models know and constraints/kinds does not.
 */
#include "base/memory.h"
#include "model/data/model.h"
#include "testing.h"

/* Undamped, about 30 swings; an error of a percent of their range amplifies none, and every step may have it. */
static const char swing[] = "kempe: 1\n"
                            "gravity: [0, -9.81, 0]\n"
                            "bodies: {a: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 0, 0]}}\n"
                            "run: {t_end: 60, rtol: 0.1, integrator: dopri5}\n";

static const char loop[] =
    "kempe: 1\n"
    "ground: {points: {D: [%s, 0, 0]}}\n"
    "bodies:\n"
    "  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {B: [1, 0, 0]}}\n"
    "  b: {joint: {revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, points: {C: [1, 0, 0]}}\n"
    "loops: {C: {ball: [ground.D, b.C]}}\n"
    "start: {q: {a: 1, b: -2}}\n"
    "run: {t_end: 0.1}\n";

static kempe_context *context;
static kempe_model *model;
static kempe_system *derived;

/* The loop, whose end is `reach` from the ground's origin: it closes within 2 m. */
static void derive(const char *reach)
{
    char text[sizeof loop + 16];
    snprintf(text, sizeof text, loop, reach);
    CHECK(kempe_model_read_text(context, text, "loop", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &derived) == KEMPE_OK);
}

static kempe_status simulate(const char *formulation)
{
    kempe_run_options run = {0};
    kempe_trajectory *trajectory = NULL;
    run.formulation = formulation;
    kempe_status status = kempe_simulate(derived, &run, &trajectory);
    kempe_trajectory_free(trajectory);
    return status;
}

static kempe_status provoke_OK(void)
{
    derive("1.2");
    return simulate(NULL);
}

static kempe_status provoke_STOPPED(void)
{
    derive("1.2");
    kempe_context_interrupt(context);
    return simulate(NULL);
}

static kempe_status provoke_UNTRUSTED(void)
{
    CHECK(kempe_model_read_text(context, swing, "swing", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &derived) == KEMPE_OK);
    return simulate(NULL);
}

static kempe_status provoke_E_MEMORY(void)
{
    derive("1.2");
    kmp_memory_fail_at(1);
    kempe_status status = simulate(NULL);
    kmp_memory_fail_at(0);
    return status;
}

static kempe_status provoke_E_INPUT(void)
{
    return kempe_model_read_text(context, "kempe: 2", "text", &model);
}

static kempe_status provoke_E_FAILED(void)
{
    derive("2.5");
    return simulate(NULL);
}

static kempe_status provoke_E_IO(void)
{
    return kempe_model_read(context, "no such folder/model.yaml", &model);
}

static kempe_status provoke_E_ARGUMENT(void)
{
    derive("1.2");
    return simulate("high");
}

static kempe_status provoke_E_BUG(void)
{
    derive("1.2");
    kempe_system_free(derived);
    derived = NULL;
    model->closures[0].kind = KMP_CLOSURE_NONE;
    return kempe_system_new(model, &derived);
}

static const struct row {
    kempe_status status;
    const char *name, *words;
    kempe_status (*provoke)(void);
} rows[] = {
#define KMP_STATUS(name, value, words, exit_code, advice) {KEMPE_##name, #name, words, provoke_##name},
#include "base/statuses.def"
#undef KMP_STATUS
};

static void provoke(const struct row *row)
{
    context = kempe_context_new();
    kempe_status status = row->provoke();
    bool said = kempe_context_message(context)[0] != '\0';
    if (status != row->status)
        printf("%s: the call returned %d\n%s\n", row->name, (int)status, kempe_context_message(context));
    CHECK(status == row->status);
    CHECK(said || row->status >= 0 || row->status == KEMPE_E_FAILED);
    kempe_system_free(derived);
    kempe_model_free(model);
    kempe_context_free(context);
    derived = NULL;
    model = NULL;
}

static void every_row_is_provoked(void)
{
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        provoke(&rows[k]);
}

static void every_row_has_words(void)
{
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        CHECK_TEXT(kempe_status_text(rows[k].status), rows[k].words);
    CHECK_TEXT(kempe_status_text((kempe_status)99), kempe_status_text(KEMPE_E_BUG));
}

int main(void)
{
    TEST(every_row_is_provoked);
    TEST(every_row_has_words);
    return check_report();
}
