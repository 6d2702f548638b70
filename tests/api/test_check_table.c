/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of `check` and `compare` as tables, without any JSON. */
#include "testing.h"
#include <kempe/check.h>
#include <kempe/compare.h>
#include <kempe/table.h>
#include <math.h>
#include <string.h>

static kempe_context *context;

typedef struct checked {
    kempe_model *model;
    kempe_system *system;
    kempe_check *check;
    kempe_table *mobility;
} checked;

static checked open_model(const char *path)
{
    checked c = {NULL, NULL, NULL, NULL};
    CHECK(kempe_model_read(context, path, &c.model) == KEMPE_OK);
    CHECK(kempe_system_new(c.model, &c.system) == KEMPE_OK);
    return c;
}

static void close_model(checked *c)
{
    kempe_table_free(c->mobility);
    kempe_check_free(c->check);
    kempe_system_free(c->system);
    kempe_model_free(c->model);
}

static double number(const kempe_table *table, int row, const char *column)
{
    return kempe_table_number(table, row, kempe_table_find(table, column));
}

static const char *word(const kempe_table *table, int row, const char *column)
{
    return kempe_table_word(table, row, kempe_table_find(table, column));
}

static kempe_table *table_of(const kempe_check *check, const char *name)
{
    kempe_table *table = NULL;
    CHECK(kempe_check_table(check, name, &table) == KEMPE_OK);
    return table;
}

static checked check_model(const char *path, kempe_status status)
{
    checked c = open_model(path);
    CHECK(kempe_check_new(c.system, &c.check) == status && c.check);
    c.mobility = table_of(c.check, "mobility");
    return c;
}

static void four_bar(void)
{
    checked c = check_model(KEMPE_ROOT "/examples/four_bar/four_bar.yaml", KEMPE_OK);
    kempe_table *all = table_of(c.check, "coordinates"), *none = NULL;
    CHECK(kempe_table_row_count(c.mobility) == 1 && number(c.mobility, 0, "dof") == 1 &&
          number(c.mobility, 0, "rank") == 2);
    CHECK(number(c.mobility, 0, "coordinates") == 3 && number(c.mobility, 0, "generic_dof") == 1);
    int independent = 0;
    for (int k = 0; k < kempe_table_row_count(all); k++) {
        CHECK_TEXT(word(all, k, "coordinate"), kempe_model_coordinate_name(c.model, k));
        CHECK_TEXT(word(all, k, "unit"), "rad");
        independent += strcmp(word(all, k, "role"), "independent") == 0;
    }
    CHECK(independent == 1 && number(all, 0, "low") <= number(all, 0, "high"));
    CHECK(kempe_check_table(c.check, "limits", &none) == KEMPE_E_ARGUMENT && !none);
    CHECK(strstr(kempe_context_message(context), "mobility, coordinates, closures"));
    kempe_table_free(all);
    close_model(&c);
}

/* A Bennett linkage has one degree of freedom more than its rows count. */
static void redundant_rows(void)
{
    checked c = check_model(KEMPE_ROOT "/examples/bennett/bennett.yaml", KEMPE_OK);
    double redundant = 0, rows = 0;
    kempe_table *closures = table_of(c.check, "closures");
    for (int row = 0; row < kempe_table_row_count(closures); row++) {
        redundant += number(closures, row, "redundant");
        rows += number(closures, row, "rows");
        CHECK(number(closures, row, "gap") < 1e-9);
    }
    CHECK(rows == number(c.mobility, 0, "rows") && rows - redundant == number(c.mobility, 0, "rank") && redundant > 0);
    kempe_table_free(closures);
    close_model(&c);
}

static void without_assembly(void)
{
    checked c = check_model(KEMPE_ROOT "/tests/models/robotran.yaml", KEMPE_E_FAILED);
    kempe_table *closures = table_of(c.check, "closures");
    CHECK(isnan(number(c.mobility, 0, "dof")) && number(c.mobility, 0, "closures") == kempe_table_row_count(closures));
    kempe_table_free(closures);
    close_model(&c);
}

static void compared(void)
{
    checked c = open_model(KEMPE_ROOT "/examples/four_bar/four_bar.yaml");
    kempe_comparison *comparison = NULL;
    kempe_table *runs = NULL, *levels = NULL;
    const kempe_compare_options options = {.rtols = "1e-5,1e-7",
                                           .formulations = "reduced",
                                           .forms = "integrated",
                                           .integrators = "dop853,dopri5",
                                           .t_end = 0.05};
    CHECK(kempe_comparison_new(c.system, &options, &comparison) == KEMPE_OK);
    CHECK(kempe_comparison_table(comparison, "runs", &runs) == KEMPE_OK);
    CHECK(kempe_comparison_table(comparison, "levels", &levels) == KEMPE_OK);
    CHECK(kempe_table_row_count(runs) == 4 && kempe_table_row_count(levels) > 0);
    for (int k = 0; k < 4; k++) {
        CHECK_TEXT(word(runs, k, "formulation"), "reduced");
        CHECK_TEXT(word(runs, k, "status"), "complete");
        CHECK(number(runs, k, "error_q") < 1e-3 && number(runs, k, "steps") > 0 && number(runs, k, "cpu_s") > 0);
    }
    for (int k = 0; k < kempe_table_row_count(levels); k++)
        CHECK(!(number(levels, k, "ratio") < 1));
    CHECK(kempe_comparison_table(comparison, "all", &runs) == KEMPE_E_ARGUMENT);
    kempe_table_free(runs);
    kempe_table_free(levels);
    kempe_comparison_free(comparison);
    close_model(&c);
}

int main(void)
{
    context = kempe_context_new();
    TEST(four_bar);
    TEST(redundant_rows);
    TEST(without_assembly);
    TEST(compared);
    kempe_context_free(context);
    return check_report();
}
