/* SPDX-License-Identifier: BSD-3-Clause */
/* Ensembles from a program: a model built in code, values from memory, what comes out against a run of its own. */
#include "four_bar.h"
#include <kempe/ensemble.h>
#include <kempe/table.h>

enum { N = 3, COUNT = 11 };

static const char *const names[] = {"q.A", "qd.A"};

static double number(const kempe_table *table, int row, const char *name)
{
    return kempe_table_number(table, row, kempe_table_find(table, name));
}

static void test_batch(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = four_bar_new(context, FOUR_BAR_TORQUE);
    kempe_values *values = NULL;
    kempe_ensemble *ensemble = NULL;
    kempe_ensemble_result *batch = NULL, *alone = NULL;
    kempe_table *a = NULL, *b = NULL;
    kempe_run_options run = {0};
    double rows[COUNT][2];
    run.t_end = 1;
    run.rtol = 1e-8;
    for (int i = 0; i < COUNT; i++) {
        rows[i][0] = 1.5 + 0.01 * i;
        rows[i][1] = 0.1 * i;
    }
    CHECK(kempe_values_new(model, 2, names, COUNT, rows[0], &values) == KEMPE_OK);
    CHECK(kempe_values_count(values) == COUNT && kempe_values_column_count(values) == 2);
    CHECK_TEXT(kempe_values_name(values, 1), "qd.A");
    CHECK_TEXT(kempe_values_name(values, 2), "");
    CHECK(kempe_values_row(values, 3)[1] == rows[3][1] && !kempe_values_row(values, COUNT));
    CHECK(kempe_ensemble_new(model, values, &ensemble) == KEMPE_OK);
    CHECK(kempe_ensemble_run(ensemble, &run, 0, &batch) == KEMPE_OK);
    CHECK(kempe_ensemble_run(ensemble, &run, -1, &alone) == KEMPE_OK);
    CHECK(kempe_ensemble_result_count(batch) == COUNT);
    CHECK(kempe_ensemble_result_table(batch, "instances", &a) == KEMPE_OK && kempe_table_row_count(a) == COUNT);
    CHECK(kempe_ensemble_result_table(alone, "instances", &b) == KEMPE_OK);
    int why = kempe_table_find(a, "single_run");
    for (int i = 0; i < COUNT; i++) {
        CHECK(kempe_ensemble_result_outcome(batch, i) == KEMPE_OUTCOME_COMPLETE);
        CHECK_TEXT(kempe_ensemble_result_reason(batch, i), "");
        CHECK_TEXT(kempe_table_word(a, i, why), "");
        CHECK_TEXT(kempe_table_word(b, i, why), "a request for separate runs");
        CHECK(number(a, i, "t") == 1 && number(a, i, "steps") > 5 && number(a, i, "rhs") > 60);
        CHECK(number(a, i, "value.q.A") == rows[i][0] && number(a, i, "value.qd.A") == rows[i][1]);
        CHECK(number(a, i, "q.A") == kempe_ensemble_result_q(batch, i)[0] &&
              number(a, i, "qd.A") == kempe_ensemble_result_qd(batch, i)[0]);
        CHECK(number(a, i, "h") < 1e-12 && number(a, i, "drift") < 1e-6);
        for (int k = 0; k < N; k++) {
            CHECK_NEAR(kempe_ensemble_result_q(batch, i)[k], kempe_ensemble_result_q(alone, i)[k], 1e-9);
            CHECK_NEAR(kempe_ensemble_result_qd(batch, i)[k], kempe_ensemble_result_qd(alone, i)[k], 1e-9);
        }
    }
    CHECK(!kempe_ensemble_result_q(batch, COUNT));
    for (int c = 0; c < kempe_table_column_count(a); c++)
        CHECK(kempe_table_find(a, kempe_table_column_name(a, c)) == c);
    kempe_table_free(a);
    kempe_table_free(b);
    kempe_ensemble_result_free(batch);
    kempe_ensemble_result_free(alone);
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void test_mistakes(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = four_bar_new(context, FOUR_BAR_TORQUE);
    kempe_values *values = NULL;
    kempe_ensemble *ensemble = NULL;
    kempe_ensemble_result *batch = NULL;
    kempe_run_options run = {0};
    const char *const wrong[] = {"q.A", "q.E"}, *const twice[] = {"q.A", "q.A"};
    const double row[] = {1.5, 0};
    CHECK(kempe_values_new(model, 2, wrong, 1, row, &values) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(context), "the model has no coordinate 'E'");
    CHECK(kempe_values_new(model, 2, twice, 1, row, &values) == KEMPE_E_ARGUMENT);
    CHECK(kempe_values_new(model, 2, names, -1, row, &values) == KEMPE_E_ARGUMENT);
    CHECK(kempe_values_sample(model, &(kempe_sample_options){.ranges = "q.A=1:2", .count = -1}, &values) ==
          KEMPE_E_ARGUMENT);
    CHECK(kempe_values_read(model, "/nowhere/values.csv", &values) == KEMPE_E_IO && !values);
    CHECK(kempe_values_new(model, 2, names, 1, row, &values) == KEMPE_OK);
    CHECK(kempe_ensemble_new(model, values, &ensemble) == KEMPE_OK);
    CHECK(kempe_ensemble_run(ensemble, &run, 17, &batch) == KEMPE_E_ARGUMENT);
    for (int k = 0; k < 4; k++) {
        static const char *const quantities[] = {"steps = max(q(A))", "x = q(A); q.A = qd(A)", "value.q.A = q(A)", "t"};
        const kempe_ensemble_options measured = {.quantities = quantities[k]};
        kempe_ensemble *refused = NULL;
        CHECK(kempe_ensemble_new_with(model, values, &measured, &refused) == KEMPE_E_ARGUMENT && !refused);
        CHECK(strstr(kempe_context_message(context), "the results have another column of this name"));
    }
    run.formulation = "fast";
    CHECK(kempe_ensemble_run(ensemble, &run, 0, &batch) == KEMPE_E_ARGUMENT && !batch);
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(test_batch);
    TEST(test_mistakes);
    return check_report();
}
