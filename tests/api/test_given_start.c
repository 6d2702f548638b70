/* SPDX-License-Identifier: BSD-3-Clause */
/* Another start of a model, from C: values that are kept, that follow from the loops, and that are refused. Texts in
 * place of files: they are read, replaced and withdrawn. */
#include "testing.h"
#include <kempe/check.h>
#include <kempe/settings.h>
#include <stdlib.h>

static kempe_model *read(kempe_context *context, const char *name)
{
    char path[4096];
    kempe_model *model = NULL;
    snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", name, name);
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
    return model;
}

/* The assembled start. */
static void start_of(const kempe_model *model, double *q, double *qd)
{
    const int n = kempe_model_coordinate_count(model);
    kempe_system *system = NULL;
    kempe_assembly *a = NULL;
    CHECK(kempe_system_new(model, &system) == KEMPE_OK && kempe_assembly_new(system, &a) == KEMPE_OK);
    for (int i = 0; i < n; i++) {
        q[i] = kempe_assembly_q(a)[i];
        qd[i] = kempe_assembly_qd(a)[i];
    }
    kempe_assembly_free(a);
    kempe_system_free(system);
}

/* The distance between the ends of coupler and rocker. Angles count from the pose with the crank upright; the angle of
 * the coupler is relative to the crank. */
static double gap(const double *q)
{
    const double crank = 0.3, coupler = 0.8, rocker = 0.7, base = 0.9, diagonal = hypot(base, crank);
    const double along = (coupler * coupler - rocker * rocker + diagonal * diagonal) / (2 * diagonal);
    const double across = sqrt(coupler * coupler - along * along);
    const double x = (along * base + across * crank) / diagonal, y = crank + (across * base - along * crank) / diagonal;
    const double a = q[0], b = a + q[1], c = q[2];
    return hypot(-crank * sin(a) + x * cos(b) - (y - crank) * sin(b) - base - (x - base) * cos(c) + y * sin(c),
                 crank * cos(a) + x * sin(b) + (y - crank) * cos(b) - (x - base) * sin(c) - y * cos(c));
}

static void values_are_kept_or_follow(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = read(context, "four_bar"), *started = NULL, *again = NULL;
    double own[3], own_d[3], q[3], qd[3], twice[3], twice_d[3];
    start_of(model, own, own_d);
    CHECK(kempe_model_start_at(model, (const double[]){1.2, NAN, NAN}, (const double[]){2, NAN, NAN}, &started) ==
          KEMPE_OK);
    start_of(started, q, qd);
    CHECK(q[0] == 1.2 && qd[0] == 2);
    CHECK(gap(own) < 1e-12 && gap(q) < 1e-12);
    /* The whole of a closed state, from the first start. */
    CHECK(kempe_model_start_at(model, q, qd, &again) == KEMPE_OK);
    start_of(again, twice, twice_d);
    CHECK(check_apart(3, twice, q) < 1e-12 && check_apart(3, twice_d, qd) < 1e-12);
    kempe_model_free(again);
    again = NULL;
    /* Only rates: the position stays; only the position: it is kept. The model itself has its own start. */
    CHECK(kempe_model_start_at(model, NULL, (const double[]){NAN, NAN, 2}, &again) == KEMPE_OK);
    start_of(again, twice, twice_d);
    CHECK(memcmp(twice, own, sizeof own) == 0 && twice_d[2] == 2);
    start_of(model, twice, twice_d);
    CHECK(memcmp(twice, own, sizeof own) == 0 && memcmp(twice_d, own_d, sizeof own) == 0);
    kempe_model_free(again);
    kempe_model_free(started);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void refused(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = read(context, "four_bar"), *started = NULL;
    CHECK(kempe_model_start_at(NULL, NULL, NULL, &started) == KEMPE_E_ARGUMENT);
    CHECK(kempe_model_start_at(model, (const double[]){INFINITY, 0, 0}, NULL, &started) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_context_message(context), "crank") && !started);
    CHECK(kempe_model_start_at(model, (const double[]){0.3, 1, 1}, NULL, &started) == KEMPE_E_FAILED && !started);
    CHECK(check_says(kempe_context_message(context), "coupler"));
    CHECK(kempe_model_start_at(model, NULL, (const double[]){1, 1, 1}, &started) == KEMPE_E_FAILED && !started);
    CHECK(kempe_context_message(context)[0] != '\0');
    kempe_model_free(model);
    kempe_context_free(context);
}

/* -- texts in place of files --------------------------------------------------------------------------- */

#define SLIDER                                                                                                         \
    "kempe: 1\ninputs: {push: {unit: N}}\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 2}}\n"                 \
    "forces: {f: {joint: a, force: push}}\nrun: {t_end: 1}\n"

/* The place after a second under the samples of a file; NaN: they cannot be read. */
static double place(kempe_context *context)
{
    static const kempe_setting samples = {"push", "no_such_file.csv:push:linear"};
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *run = NULL;
    double at = NAN;
    if (kempe_model_read_text_set(context, SLIDER, "slider", &samples, 1, &model) == KEMPE_OK &&
        kempe_system_new(model, &system) == KEMPE_OK &&
        kempe_simulate(system, &(kempe_run_options){.rtol = 1e-10}, &run) == KEMPE_OK)
        at = kempe_trajectory_q(run, kempe_trajectory_row_count(run) - 1)[0];
    kempe_trajectory_free(run);
    kempe_system_free(system);
    kempe_model_free(model);
    return at;
}

static void texts(void)
{
    kempe_context *context = kempe_context_new();
    CHECK(isnan(place(context)) && check_says(kempe_context_message(context), "no_such_file.csv"));
    CHECK(kempe_context_set_text(context, "no_such_file.csv", "t,push\n0,4\n1,4\n") == KEMPE_OK);
    CHECK_NEAR(place(context), 1, 1e-9);
    CHECK(kempe_context_set_text(context, "another.csv", "t,x\n0,1\n") == KEMPE_OK);
    CHECK(kempe_context_set_text(context, "no_such_file.csv", "t,push\n0,0\n1,12\n") == KEMPE_OK);
    CHECK_NEAR(place(context), 1, 1e-9); /* 12 t / 2: t^3 */
    CHECK(kempe_context_set_text(context, "no_such_file.csv", "t,push\n0,one\n") == KEMPE_OK);
    CHECK(isnan(place(context)) && check_says(kempe_context_message(context), "no_such_file.csv:2:"));
    CHECK(kempe_context_set_text(context, "no_such_file.csv", NULL) == KEMPE_OK);
    CHECK(kempe_context_set_text(context, "no_such_file.csv", NULL) == KEMPE_OK);
    CHECK(isnan(place(context)) && check_says(kempe_context_message(context), "no_such_file.csv"));
    CHECK(kempe_context_set_text(NULL, "a", "b") == KEMPE_E_ARGUMENT);
    CHECK(kempe_context_set_text(context, NULL, "b") == KEMPE_E_ARGUMENT);
    kempe_context_free(context);
}

int main(void)
{
    TEST(values_are_kept_or_follow);
    TEST(refused);
    TEST(texts);
    return check_report();
}
