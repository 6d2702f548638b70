/* SPDX-License-Identifier: BSD-3-Clause */
/* Result folders while memory runs out: a run into one, its check with statistics, its table, an instance of it, values
 * from Parquet. */
#include "exhaust.h"
#include <kempe/ensemble.h>
#include <kempe/table.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { COUNT = 6, CHUNK = 4, PARTS = 2 };

static char folder[] = "/tmp/kempe_memory_folder_XXXXXX";
static char gathered[64], histories[64];
static kempe_ensemble *ensemble;

static void remove_files(void)
{
    static const char *const names[] = {"part-000000.parquet",
                                        "part-000001.parquet",
                                        "history/part-000000.parquet",
                                        "history/part-000001.parquet",
                                        "manifest.json",
                                        "all.parquet",
                                        "histories.csv"};
    char file[96];
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        (void)snprintf(file, sizeof file, "%s/%s", folder, names[k]);
        (void)unlink(file);
    }
    (void)snprintf(file, sizeof file, "%s/history", folder);
    (void)rmdir(file);
}

static kempe_status run_into(scene *s)
{
    kempe_folder *made = NULL;
    kempe_run_options run = {0};
    run.t_end = 1e-3;
    (void)s;
    remove_files();
    kempe_status status = kempe_ensemble_run_folder(
        ensemble, &run, 0, folder,
        &(kempe_folder_options){.size = sizeof(kempe_folder_options), .chunk = CHUNK, .history = "2,6"}, &made);
    untouched(status, made);
    CHECK(status != KEMPE_OK || kempe_folder_whole_count(made) == PARTS);
    kempe_folder_free(made);
    return status;
}

static kempe_status gather(scene *s)
{
    kempe_folder *opened = NULL;
    kempe_table *table = NULL;
    kempe_model *model = NULL;
    char *text = NULL;
    kempe_status status = kempe_folder_open(s->context, folder, &opened);
    untouched(status, opened);
    if (status == KEMPE_OK)
        status = kempe_folder_check(opened);
    if (status == KEMPE_OK)
        status = kempe_folder_write(opened, gathered, 0);
    if (status == KEMPE_OK)
        status = kempe_folder_write_history(opened, histories, 0);
    if (status == KEMPE_OK) {
        status = kempe_folder_part(opened, 1, &table);
        untouched(status, table);
    }
    CHECK(status != KEMPE_OK || kempe_table_row_count(table) == COUNT - CHUNK);
    if (status == KEMPE_OK) {
        status = kempe_folder_model(opened, s->model, COUNT - 1, &model);
        untouched(status, model);
    }
    if (status == KEMPE_OK)
        status = kempe_folder_print(opened, KEMPE_JSON, &text);
    CHECK(status != KEMPE_OK || strstr(text, "\"statistics\""));
    kempe_text_free(text);
    text = NULL;
    if (status == KEMPE_OK)
        status = kempe_folder_print(opened, KEMPE_TEXT, &text);
    CHECK(status != KEMPE_OK || strstr(text, "least     kempe simulate --from "));
    kempe_text_free(text);
    kempe_model_free(model);
    kempe_table_free(table);
    kempe_folder_free(opened);
    return status;
}

/* The columns of results are no values: the table is read whole before it is refused. */
static kempe_status read_values(scene *s)
{
    kempe_values *values = NULL;
    kempe_status status = kempe_values_read(s->model, gathered, &values);
    CHECK(!values);
    return status == KEMPE_E_INPUT ? KEMPE_OK : status;
}

static void every_allocation_fails(void)
{
    scene s = {.context = kempe_context_new()};
    kempe_values *values = NULL;
    CHECK(mkdtemp(folder) != NULL);
    (void)snprintf(gathered, sizeof gathered, "%s/all.parquet", folder);
    (void)snprintf(histories, sizeof histories, "%s/histories.csv", folder);
    CHECK(kempe_model_read(s.context, KEMPE_ROOT "/examples/four_bar/four_bar.yaml", &s.model) == KEMPE_OK);
    CHECK(kempe_values_sample(
              s.model,
              &(kempe_sample_options){sizeof(kempe_sample_options), "crank=IT9,q.crank=0:0.01", .count = COUNT},
              &values) == KEMPE_OK);
    CHECK(kempe_ensemble_new_with(s.model, values,
                                  &(kempe_ensemble_options){sizeof(kempe_ensemble_options), "swing = range(q(rocker))",
                                                            "max(q(crank)) < 9"},
                                  &ensemble) == KEMPE_OK);
    exhaust(&s, "run", run_into, 97);
    exhaust(&s, "gather", gather, 1);
    exhaust(&s, "values", read_values, 1);
    remove_files();
    CHECK(rmdir(folder) == 0); /* nothing else is left */
    kempe_ensemble_free(ensemble);
    kempe_values_free(values);
    kempe_model_free(s.model);
    kempe_context_free(s.context);
}

int main(void)
{
    TEST(every_allocation_fails);
    return check_report();
}
