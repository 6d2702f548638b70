/* SPDX-License-Identifier: BSD-3-Clause */
/* Result folders from a program: parts of the same bytes for any number of threads and processes, what joins a folder
 * and what is refused. */
#include "four_bar.h"
#include <dirent.h>
#include <kempe/ensemble.h>
#include <kempe/table.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

enum { COUNT = 50, CHUNK = 8, PARTS = 7, MOST_BYTES = 1 << 16 };

typedef struct study {
    kempe_context *context;
    kempe_model *model;
    kempe_values *values;
    kempe_ensemble *ensemble;
    char place[64]; /* of the folders */
    char path[128];
} study;

static study begin(const char *ranges)
{
    study s = {.context = kempe_context_new(), .place = "/tmp/kempe-folder-XXXXXX"};
    s.model = four_bar_new(s.context, FOUR_BAR_TORQUE);
    CHECK(mkdtemp(s.place) != NULL);
    CHECK(kempe_values_sample(s.model, &(kempe_sample_options){sizeof(kempe_sample_options), ranges, .count = COUNT},
                              &s.values) == KEMPE_OK);
    CHECK(kempe_ensemble_new(s.model, s.values, &s.ensemble) == KEMPE_OK);
    return s;
}

static const char *path_of(study *s, const char *name)
{
    (void)snprintf(s->path, sizeof s->path, "%s/%s", s->place, name);
    return s->path;
}

static void end(study *s)
{
    char command[160];
    (void)snprintf(command, sizeof command, "rm -rf '%s'", s->place);
    CHECK(system(command) == 0);
    kempe_ensemble_free(s->ensemble);
    kempe_values_free(s->values);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

static kempe_run_options run_of(int threads)
{
    kempe_run_options run = {0};
    run.size = sizeof run;
    run.t_end = 0.2;
    run.rtol = 1e-8;
    run.threads = threads;
    return run;
}

/* Runs into the folder `name`; the number of its whole parts, -1: an error. */
static int run_into(study *s, const char *name, int threads, const char *shard, int resume)
{
    kempe_run_options run = run_of(threads);
    kempe_folder_options options = {.size = sizeof options, .chunk = CHUNK, .resume = resume, .shard = shard};
    kempe_folder *folder = NULL;
    kempe_status status = kempe_ensemble_run_folder(s->ensemble, &run, 0, path_of(s, name), &options, &folder);
    int whole = status == KEMPE_OK ? kempe_folder_whole_count(folder) : -1;
    kempe_folder_free(folder);
    return whole;
}

static size_t read_file(const char *path, char *bytes)
{
    FILE *file = fopen(path, "rb");
    size_t size = file ? fread(bytes, 1, MOST_BYTES, file) : 0;
    if (file)
        fclose(file);
    return size;
}

/* True if two folders have the same files with the same bytes, and no others than parts and the manifest. */
static bool are_equal(const study *s, const char *one, const char *other)
{
    static char a[MOST_BYTES], b[MOST_BYTES];
    char path[256];
    int files = 0, equal = 0;
    (void)snprintf(path, sizeof path, "%s/%s", s->place, one);
    DIR *folder = opendir(path);
    for (const struct dirent *d = folder ? readdir(folder) : NULL; d; d = readdir(folder)) {
        if (d->d_name[0] == '.')
            continue;
        (void)snprintf(path, sizeof path, "%s/%s/%.40s", s->place, one, d->d_name);
        size_t size = read_file(path, a);
        (void)snprintf(path, sizeof path, "%s/%s/%.40s", s->place, other, d->d_name);
        files++;
        equal += size > 0 && size < MOST_BYTES && read_file(path, b) == size && memcmp(a, b, size) == 0;
    }
    if (folder)
        closedir(folder);
    return files == PARTS + 1 && equal == files;
}

static void test_ranges(void)
{
    study s = begin("crank=0.29:0.31,qd.A=1:3");
    kempe_run_options run = run_of(1);
    kempe_ensemble_result *all = NULL, *some = NULL;
    kempe_table *a = NULL, *b = NULL;
    enum { FIRST = 13, SOME = 20 };
    CHECK(kempe_ensemble_run(s.ensemble, &run, 0, &all) == KEMPE_OK && kempe_ensemble_result_count(all) == COUNT);
    CHECK(kempe_ensemble_run_range(s.ensemble, &run, 0, FIRST, SOME, &some) == KEMPE_OK);
    CHECK(kempe_ensemble_result_count(some) == SOME);
    CHECK(kempe_ensemble_result_table(all, "instances", &a) == KEMPE_OK &&
          kempe_ensemble_result_table(some, "instances", &b) == KEMPE_OK);
    int differ = 0, columns = kempe_table_column_count(a);
    CHECK(columns > 10 && kempe_table_column_count(b) == columns);
    for (int k = 0; k < SOME; k++)
        for (int c = 0; c < columns; c++) {
            double x = kempe_table_number(a, FIRST + k, c), y = kempe_table_number(b, k, c);
            differ += memcmp(&x, &y, sizeof x) != 0;
            differ += strcmp(kempe_table_word(a, FIRST + k, c), kempe_table_word(b, k, c)) != 0;
        }
    CHECK(differ == 0);
    CHECK(kempe_table_number(b, 0, 0) == kempe_values_row(s.values, FIRST)[0]);
    kempe_ensemble_result_free(some);
    some = NULL;
    CHECK(kempe_ensemble_run_range(s.ensemble, &run, 0, COUNT - 1, 2, &some) == KEMPE_E_ARGUMENT && !some);
    CHECK_TEXT(kempe_context_message(s.context), "there are no 2 instances from 49: there are 50");
    CHECK(kempe_ensemble_run_range(s.ensemble, &run, 0, -1, 2, &some) == KEMPE_E_ARGUMENT && !some);
    kempe_table_free(a);
    kempe_table_free(b);
    kempe_ensemble_result_free(all);
    end(&s);
}

/* Rows that are given when the equations exist: the results of a table that has them from the beginning. */
static void test_rows(void)
{
    study s = begin("crank=0.29:0.31,qd.A=1:3");
    kempe_run_options run = run_of(1);
    const char *const names[] = {"crank", "qd.A"};
    kempe_values *empty = NULL;
    kempe_ensemble *equations = NULL;
    kempe_ensemble_result *all = NULL, *rows = NULL;
    double given[COUNT][2];
    for (int k = 0; k < COUNT; k++)
        memcpy(given[k], kempe_values_row(s.values, k), sizeof given[k]);
    CHECK(kempe_values_new(s.model, 2, names, 0, NULL, &empty) == KEMPE_OK);
    CHECK(kempe_ensemble_new(s.model, empty, &equations) == KEMPE_OK);
    CHECK(kempe_ensemble_run(s.ensemble, &run, 0, &all) == KEMPE_OK);
    for (int again = 0; again < 2; again++) {
        CHECK(kempe_ensemble_run_rows(equations, &run, 0, COUNT, given[0], &rows) == KEMPE_OK);
        CHECK(kempe_ensemble_result_count(rows) == COUNT);
        int differ = 0;
        for (int k = 0; k < COUNT; k++)
            differ +=
                memcmp(kempe_ensemble_result_q(all, k), kempe_ensemble_result_q(rows, k), 3 * sizeof(double)) != 0;
        CHECK(differ == 0);
        kempe_ensemble_result_free(rows);
        rows = NULL;
    }
    given[3][0] = 7; /* a crank that is too long to close the loop */
    CHECK(kempe_ensemble_run_rows(equations, &run, 0, 5, given[0], &rows) == KEMPE_UNTRUSTED);
    CHECK(kempe_ensemble_result_outcome(rows, 3) == KEMPE_OUTCOME_FAILED);
    CHECK(kempe_ensemble_result_reason(rows, 3)[0] && kempe_ensemble_result_outcome(rows, 4) == KEMPE_OUTCOME_COMPLETE);
    CHECK(memcmp(kempe_ensemble_result_q(all, 4), kempe_ensemble_result_q(rows, 4), 3 * sizeof(double)) == 0);
    kempe_ensemble_result_free(rows);
    rows = NULL;
    CHECK(kempe_ensemble_run_rows(equations, &run, 0, -1, given[0], &rows) == KEMPE_E_ARGUMENT && !rows);
    CHECK_TEXT(kempe_context_message(s.context), "the number of rows is -1; it cannot be negative");
    CHECK(kempe_ensemble_run_rows(equations, &run, 0, 1, NULL, &rows) == KEMPE_E_ARGUMENT && !rows);
    CHECK(kempe_ensemble_run_rows(equations, &run, 0, 0, NULL, &rows) == KEMPE_OK &&
          kempe_ensemble_result_count(rows) == 0);
    kempe_ensemble_result_free(rows);
    kempe_ensemble_result_free(all);
    kempe_ensemble_free(equations);
    kempe_values_free(empty);
    end(&s);
}

static void test_shares(void)
{
    study s = begin("crank=0.29:0.31,qd.A=1:3");
    CHECK(run_into(&s, "whole", 1, NULL, 0) == PARTS);
    CHECK(run_into(&s, "threads", 3, NULL, 0) == PARTS && are_equal(&s, "whole", "threads"));
    CHECK(run_into(&s, "two", 1, "2/2", 0) == PARTS / 2);
    CHECK(!are_equal(&s, "whole", "two"));
    CHECK(run_into(&s, "two", 2, "1/2", 0) == PARTS && are_equal(&s, "whole", "two"));
    for (int k = 7; k > 0; k--) {
        char shard[8];
        (void)snprintf(shard, sizeof shard, "%d/7", k);
        CHECK(run_into(&s, "seven", 1, shard, 0) == PARTS + 1 - k);
    }
    CHECK(are_equal(&s, "whole", "seven"));
    CHECK(unlink(path_of(&s, "seven/part-000004.parquet")) == 0);
    CHECK(run_into(&s, "seven", 1, NULL, 1) == PARTS && are_equal(&s, "whole", "seven"));
    CHECK(run_into(&s, "whole", 1, "8/7", 0) == -1);
    CHECK_TEXT(kempe_context_message(s.context), "shard '8/7' is not I/N with 1 <= I <= N, as 2/7, or auto");
    CHECK(run_into(&s, "whole", 1, "x", 0) == -1 && run_into(&s, "whole", 1, "0/2", 0) == -1);
    end(&s);
}

static void set(const char *name, const char *value)
{
    CHECK((value ? setenv(name, value, 1) : unsetenv(name)) == 0);
}

/* Process 1 of 3 of task 7 of an array 3, 5, 7: part 7 of 9 parts. */
static void test_engines(void)
{
    static const char *const variables[][2] = {{"SLURM_ARRAY_TASK_ID", "7"},   {"SLURM_ARRAY_TASK_MIN", "3"},
                                               {"SLURM_ARRAY_TASK_STEP", "2"}, {"SLURM_ARRAY_TASK_COUNT", "3"},
                                               {"SLURM_PROCID", "0"},          {"SLURM_NTASKS", "3"}};
    enum { VARIABLES = sizeof variables / sizeof *variables };
    study s = begin("crank=0.29:0.31");
    for (int k = 0; k < VARIABLES; k++)
        set(variables[k][0], NULL);
    CHECK(run_into(&s, "auto", 1, "auto", 0) == -1);
    CHECK_TEXT(kempe_context_message(s.context),
               "shard auto: no variables of Slurm, Open MPI, PMI or GNU parallel are set; give I/N");
    for (int k = 0; k < VARIABLES; k++)
        set(variables[k][0], variables[k][1]);
    CHECK(run_into(&s, "auto", 1, "auto", 0) == 1);
    CHECK(access(path_of(&s, "auto/part-000006.parquet"), F_OK) == 0);
    set("SLURM_ARRAY_TASK_ID", "8");
    CHECK(run_into(&s, "auto", 1, "auto", 0) == -1);
    for (int k = 0; k < VARIABLES; k++)
        set(variables[k][0], NULL);
    set("OMPI_COMM_WORLD_RANK", "1");
    set("OMPI_COMM_WORLD_SIZE", "2");
    CHECK(run_into(&s, "mpi", 1, "auto", 0) == PARTS / 2);
    set("OMPI_COMM_WORLD_RANK", "2");
    CHECK(run_into(&s, "mpi", 1, "auto", 0) == -1);
    CHECK_TEXT(kempe_context_message(s.context), "shard auto: the variables of Open MPI say process 2 of 2");
    set("OMPI_COMM_WORLD_RANK", NULL);
    set("OMPI_COMM_WORLD_SIZE", NULL);
    set("PARALLEL_SEQ", "3");
    CHECK(run_into(&s, "jobs", 1, "auto", 0) == PARTS);
    set("PARALLEL_SEQ", NULL);
    end(&s);
}

/* Rows of chosen instances are those of a run of the model with their values; angles in degrees if these are
 * chosen. */
static void test_histories(void)
{
    study s = begin("crank=0.29:0.31,qd.A=1:3");
    kempe_run_options run = run_of(1);
    kempe_table *table = NULL, *rows = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_system *system = NULL;
    kempe_model *model = NULL;
    kempe_folder *folder = NULL;
    kempe_folder_options options = {.size = sizeof options, .chunk = CHUNK, .history = "7"};
    run.output_step = 0.1;
    CHECK(kempe_ensemble_run_folder(s.ensemble, &run, 0, path_of(&s, "a"), &options, &folder) == KEMPE_OK);
    CHECK(kempe_context_set_angle_unit(s.context, "deg") == KEMPE_OK);
    CHECK(kempe_ensemble_history(s.ensemble, &run, "7, 12:13", &table) == KEMPE_OK);
    CHECK(kempe_table_row_count(table) == 9);
    CHECK(kempe_folder_model(folder, s.model, 6, &model) == KEMPE_OK);
    run.formulation = "reduced";
    run.integrator = "dop853";
    CHECK(kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &trajectory) == KEMPE_OK);
    CHECK(kempe_trajectory_table(trajectory, "rows", &rows) == KEMPE_OK);
    CHECK(kempe_table_column_count(table) == 1 + kempe_table_column_count(rows));
    CHECK_TEXT(kempe_table_unit(table, kempe_table_find(table, "q.A")), "deg");
    for (int row = 0; row < 9; row++) {
        CHECK(kempe_table_number(table, row, 0) == (row < 3 ? 7 : 11 + row / 3));
        CHECK(kempe_table_number(table, row, 1) == (row % 3) * 0.1);
        for (int c = 0; row < 3 && c < kempe_table_column_count(rows); c++)
            CHECK(kempe_table_number(table, row, c + 1) == kempe_table_number(rows, row, c));
    }
    kempe_table_free(rows);
    kempe_table_free(table);
    table = NULL;
    CHECK(kempe_ensemble_history(s.ensemble, &run, "51", &table) == KEMPE_E_ARGUMENT && !table);
    CHECK_TEXT(kempe_context_message(s.context), "history:1:1: there are no instances 51 to 51: there are 1 to 50");
    CHECK(kempe_ensemble_history(s.ensemble, &run, "5:", &table) == KEMPE_E_ARGUMENT);
    CHECK(kempe_ensemble_history(s.ensemble, &run, "99999999999", &table) == KEMPE_E_ARGUMENT);
    kempe_folder_free(folder);
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    kempe_model_free(model);
    end(&s);
}

static void test_refusals(void)
{
    study s = begin("crank=0.29:0.31,qd.A=1:3");
    kempe_folder *folder = NULL;
    kempe_folder_options options = {.size = sizeof options, .chunk = CHUNK, .resume = 1};
    kempe_run_options run = run_of(1);
    CHECK(run_into(&s, "a", 1, "1/2", 0) == PARTS - PARTS / 2);
    CHECK(run_into(&s, "a", 1, NULL, 0) == -1);
    CHECK(strstr(kempe_context_message(s.context), "the folder has results: --resume runs what is missing"));
    run.rtol = 1e-7;
    CHECK(kempe_ensemble_run_folder(s.ensemble, &run, 0, path_of(&s, "a"), &options, &folder) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(s.context), "rtol is 1e-08 in the folder and 1e-07 in this run"));
    run.rtol = 1e-8;
    run.max_step = 0.01;
    CHECK(kempe_ensemble_run_folder(s.ensemble, &run, 0, path_of(&s, "a"), &options, &folder) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(s.context), "max_step is 0 in the folder and 0.01 in this run"));
    run.max_step = 0;
    options.chunk = CHUNK + 1;
    CHECK(kempe_ensemble_run_folder(s.ensemble, &run, 0, path_of(&s, "a"), &options, &folder) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(s.context), "the number of instances of a part is 8 in the folder and 9 in"));
    options.chunk = 0;
    CHECK(kempe_ensemble_run_folder(s.ensemble, &run, 0, path_of(&s, "a"), &options, &folder) == KEMPE_OK);
    CHECK(kempe_folder_part_count(folder) == PARTS && kempe_folder_instance_count(folder) == COUNT);
    kempe_folder_free(folder);
    folder = NULL;
    CHECK(kempe_ensemble_run_folder(s.ensemble, &run, 17, path_of(&s, "b"), &options, &folder) == KEMPE_E_ARGUMENT);
    CHECK(kempe_ensemble_run_folder(s.ensemble, &run, 0, path_of(&s, "b/c"), &options, &folder) == KEMPE_E_IO);
    CHECK(kempe_folder_open(s.context, path_of(&s, "b"), &folder) == KEMPE_E_INPUT && !folder);
    CHECK(kempe_write_file(s.context, path_of(&s, "a/manifest.json"), "{}\n") == KEMPE_OK);
    CHECK(kempe_folder_open(s.context, path_of(&s, "a"), &folder) == KEMPE_E_INPUT && !folder);
    CHECK(strstr(kempe_context_message(s.context), "it is damaged"));
    end(&s);
}

int main(void)
{
    TEST(test_ranges);
    TEST(test_rows);
    TEST(test_shares);
    TEST(test_engines);
    TEST(test_histories);
    TEST(test_refusals);
    return check_report();
}
