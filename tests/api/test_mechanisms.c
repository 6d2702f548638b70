/* SPDX-License-Identifier: BSD-3-Clause */
/* Ensembles over parameters that shape the equations, against runs of models that are read with these values. */
#include "testing.h"
#include <kempe/ensemble.h>
#include <kempe/settings.h>
#include <kempe/table.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static const char path[] = KEMPE_ROOT "/tests/models/shaped.yaml";
static const char *const names[] = {"mass", "force", "q.x", "tilt"};
enum { COLUMNS = 4, COUNT = 9 };

/* Rows of three forces and two slopes in a mixed order. */
static void fill(double rows[COUNT][COLUMNS])
{
    for (int i = 0; i < COUNT; i++) {
        rows[i][0] = 2 + 0.1 * i;
        rows[i][1] = 80 + 20 * (i % 3);
        rows[i][2] = 0.3 + 0.02 * i;
        rows[i][3] = i % 2 ? 0.1 : 0.2;
    }
}

typedef struct study {
    kempe_context *context;
    kempe_model *model;
    kempe_values *values;
    kempe_ensemble *ensemble;
} study;

static study begin(const char *file, int columns, const char *const *columns_of, int count, const double *rows)
{
    study s = {.context = kempe_context_new()};
    const kempe_ensemble_options options = {sizeof options, "top = max(q(x)), at(qd(x), 0.25)", "top < 0.45"};
    CHECK(kempe_model_read(s.context, file, &s.model) == KEMPE_OK);
    CHECK(kempe_values_new(s.model, columns, columns_of, count, rows, &s.values) == KEMPE_OK);
    CHECK(kempe_ensemble_new_with(s.model, s.values, &options, &s.ensemble) == KEMPE_OK);
    return s;
}

static void end(study *s)
{
    kempe_ensemble_free(s->ensemble);
    kempe_values_free(s->values);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

/* The end of one run, with mass, force and tilt set as a user sets them, and the start as a number of the model. */
static void run_one(kempe_context *context, const double *row, double state[2])
{
    char text[3][32];
    kempe_setting settings[] = {{"mass", text[0]}, {"force", text[1]}, {"tilt", text[2]}};
    kempe_model *model = NULL;
    const kempe_run_options run = {.size = sizeof run, .rtol = 1e-10, .no_convergence_check = 1};
    snprintf(text[0], sizeof text[0], "%.17g", row[0]);
    snprintf(text[1], sizeof text[1], "%.17g", row[1]);
    snprintf(text[2], sizeof text[2], "%.17g", row[3]);
    CHECK(kempe_model_read_set(context, path, settings, 3, &model) == KEMPE_OK);
    kempe_values *values = NULL;
    kempe_ensemble *ensemble = NULL;
    kempe_ensemble_result *batch = NULL;
    CHECK(kempe_values_new(model, 1, names + 2, 1, row + 2, &values) == KEMPE_OK);
    CHECK(kempe_ensemble_new(model, values, &ensemble) == KEMPE_OK);
    CHECK(kempe_ensemble_run(ensemble, &run, -1, &batch) == KEMPE_OK);
    state[0] = kempe_ensemble_result_q(batch, 0)[0];
    state[1] = kempe_ensemble_result_qd(batch, 0)[0];
    kempe_ensemble_result_free(batch);
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    kempe_model_free(model);
}

static void same_as_models_of_their_own(void)
{
    double rows[COUNT][COLUMNS], state[2];
    fill(rows);
    study s = begin(path, COLUMNS, names, COUNT, rows[0]);
    kempe_run_options run = {.size = sizeof run, .rtol = 1e-10};
    kempe_ensemble_result *batch = NULL, *other = NULL;
    CHECK(kempe_ensemble_run(s.ensemble, &run, 0, &batch) == KEMPE_OK);
    run.threads = 1;
    CHECK(kempe_ensemble_run_range(s.ensemble, &run, 1, 2, 5, &other) == KEMPE_OK);
    for (int i = 0; i < COUNT; i++) {
        CHECK(kempe_ensemble_result_outcome(batch, i) == KEMPE_OUTCOME_COMPLETE);
        run_one(s.context, rows[i], state);
        CHECK_NEAR(kempe_ensemble_result_q(batch, i)[0], state[0], 1e-8);
        CHECK_NEAR(kempe_ensemble_result_qd(batch, i)[0], state[1], 1e-8);
        if (i >= 2 && i < 7) {
            CHECK(kempe_ensemble_result_q(batch, i)[0] == kempe_ensemble_result_q(other, i - 2)[0]);
            CHECK(kempe_ensemble_result_quantity(batch, i, 0) == kempe_ensemble_result_quantity(other, i - 2, 0));
        }
        CHECK(kempe_ensemble_result_quantity(batch, i, 0) >= rows[i][2]);
        CHECK_TEXT(kempe_ensemble_result_limits(batch, i),
                   kempe_ensemble_result_quantity(batch, i, 0) < 0.45 ? "pass" : "fail");
    }
    CHECK(fabs(kempe_ensemble_result_q(batch, 0)[0] - kempe_ensemble_result_q(batch, 1)[0]) > 1e-3);
    kempe_ensemble_result_free(batch);
    kempe_ensemble_result_free(other);
    end(&s);
}

/* Settings of the run are those of all instances. */
static void settings_of_the_run(void)
{
    static const char *const columns[] = {"force", "until"};
    const double rows[][2] = {{100, 0.5}, {90, 0.4}, {100, 0.5}};
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_values *values = NULL;
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
    CHECK(kempe_values_new(model, 2, columns, 3, rows[0], &values) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(context), "parameter 'until' cannot be a variable of the equations"));
    kempe_model_free(model);
    kempe_context_free(context);
}

static void text_models(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_values *values = NULL;
    const double angle = 0.1;
    static const char text[] =
        "kempe: 1\nparameters: {tilt: 0}\n"
        "bodies: {a: {joint: {name: x, prismatic: [cos(tilt), 0, sin(tilt)], at: ground}, mass: 1}}\n";
    CHECK(kempe_model_read_text(context, text, "text", &model) == KEMPE_OK);
    CHECK(kempe_values_new(model, 1, names + 3, 1, &angle, &values) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(context), "the model has no file that could be read again"));
    kempe_model_free(model);
    kempe_context_free(context);
}

static bool copy_model(const char *to, const char *more)
{
    char text[2000];
    FILE *from = fopen(path, "r"), *file = fopen(to, "w");
    size_t length = from ? fread(text, 1, sizeof text, from) : 0;
    bool good = file && length > 0 && fwrite(text, 1, length, file) == length && fputs(more, file) >= 0;
    if (from)
        fclose(from);
    return file && fclose(file) == 0 && good;
}

/* A file that changes between the reading of the model and the run; an instance with a wrong table. */
static void files(void)
{
    char file[] = "/tmp/kempe_shaped_XXXXXX.yaml";
    int opened = mkstemps(file, 5);
    double rows[COUNT][COLUMNS];
    kempe_ensemble_result *batch = NULL;
    kempe_run_options run = {.size = sizeof run};
    fill(rows);
    rows[4][0] = -1;
    CHECK(opened >= 0 && copy_model(file, ""));
    study s = begin(file, COLUMNS, names, COUNT, rows[0]);
    CHECK(kempe_ensemble_run(s.ensemble, &run, 0, &batch) == KEMPE_UNTRUSTED);
    CHECK(kempe_ensemble_result_outcome(batch, 4) == KEMPE_OUTCOME_FAILED);
    CHECK(strstr(kempe_ensemble_result_reason(batch, 4), "the mass of body 'slide' is negative"));
    CHECK(kempe_ensemble_result_outcome(batch, 3) == KEMPE_OUTCOME_COMPLETE);
    kempe_ensemble_result_free(batch);
    end(&s);
    s = begin(file, COLUMNS, names, COUNT, rows[0]);
    CHECK(copy_model(file, "# another one\n"));
    batch = NULL;
    CHECK(kempe_ensemble_run(s.ensemble, &run, 0, &batch) == KEMPE_E_INPUT && !batch);
    CHECK(strstr(kempe_context_message(s.context), "has changed since it was read"));
    end(&s);
    if (opened >= 0)
        close(opened);
    unlink(file);
}

/* Values with which the model cannot be read: the sentence has the place. */
static void unreadable(void)
{
    static const char *const columns[] = {"length"};
    static const char text[] = "kempe: 1\nparameters: {length: 1}\n"
                               "tables: {f: {x: [0, length], y: [0, 1]}}\n"
                               "bodies: {a: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                               "forces: {f: {joint: x, force: f(q(x))}}\n";
    const double rows[] = {1, -1, 2};
    char file[] = "/tmp/kempe_table_XXXXXX.yaml";
    int opened = mkstemps(file, 5);
    kempe_ensemble_result *batch = NULL;
    kempe_run_options run = {.size = sizeof run};
    FILE *out = fopen(file, "w");
    CHECK(opened >= 0 && out && fputs(text, out) >= 0 && fclose(out) == 0);
    study s = begin(file, 1, columns, 3, rows);
    CHECK(kempe_ensemble_run(s.ensemble, &run, 0, &batch) == KEMPE_UNTRUSTED);
    CHECK(kempe_ensemble_result_outcome(batch, 0) == KEMPE_OUTCOME_COMPLETE);
    CHECK(kempe_ensemble_result_outcome(batch, 1) == KEMPE_OUTCOME_FAILED);
    CHECK(strstr(kempe_ensemble_result_reason(batch, 1), ".yaml:3:"));
    CHECK(kempe_ensemble_result_outcome(batch, 2) == KEMPE_OUTCOME_COMPLETE);
    kempe_ensemble_result_free(batch);
    end(&s);
    if (opened >= 0)
        close(opened);
    unlink(file);
}

int main(void)
{
    TEST(same_as_models_of_their_own);
    TEST(settings_of_the_run);
    TEST(text_models);
    TEST(files);
    TEST(unreadable);
    return check_report();
}
