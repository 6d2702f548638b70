/* SPDX-License-Identifier: BSD-3-Clause */
/* Stages of runs, each repeated with its n-th allocation failing. */
#ifndef KEMPE_TESTS_EXHAUST_H
#define KEMPE_TESTS_EXHAUST_H

#include "base/memory.h"
#include "dynamics/program_cache.h"
#include "full.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/compare.h>
#include <kempe/kempe.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

/* Objects of earlier stages, and of the present stage. */
typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kempe_trajectory *trajectory;
    kempe_comparison *comparison;
    kempe_check *check;
    char csv[40], mat[40]; /* paths of files that stages write over each other */
} scene;

/* A stage: does one thing, frees what it made, and says KEMPE_OK, or why not. Outputs that were touched on failure are
 * complained of inside. */
typedef kempe_status stage_fn(scene *s);

static void untouched(kempe_status status, const void *output)
{
    bool may_stay = status == KEMPE_E_FAILED || status == KEMPE_STOPPED; /* some are given as far as they came */
    CHECK((status == KEMPE_OK) == (output != NULL) || may_stay);
}

/* Done, or no memory, said in words. */
static void judge(const scene *s, const char *name, unsigned long n, kempe_status status)
{
    const char *message = kempe_context_message(s->context);
    bool good = status == KEMPE_OK || (status == KEMPE_E_MEMORY && strstr(message, "out of memory"));
    CHECK(good);
    if (!good)
        printf("%s, allocation %lu: status %d: %s\n", name, n, status, message);
}

/* -- stages of many tests ----------------------------------------------------------------------------- */

/* Text that a stage read is dropped again. */
static inline kempe_status drop_model(kempe_status status, kempe_model *model)
{
    untouched(status, model);
    kempe_model_free(model);
    return status;
}

static inline kempe_status read_file(const scene *s, const char *path)
{
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read(s->context, path, &model);
    return drop_model(status, model);
}

static inline kempe_status print_model(scene *s)
{
    char *text = NULL;
    kempe_status status = kempe_model_print(s->model, KEMPE_JSON, &text);
    untouched(status, text);
    kempe_text_free(text);
    return status;
}

static inline kempe_status derive(scene *s)
{
    kempe_system *system = NULL;
    kempe_status status = kempe_system_new(s->model, &system);
    untouched(status, system);
    kempe_system_free(system);
    return status;
}

static inline kempe_status simulate_run(const scene *s, const kempe_run_options *run)
{
    kempe_trajectory *trajectory = NULL;
    kempe_status status = kempe_simulate(s->system, run, &trajectory);
    untouched(status, trajectory);
    kempe_trajectory_free(trajectory);
    return status;
}

/* Writes a table that was given with `status`, and frees it. */
static inline kempe_status write_table(const scene *s, kempe_status status, kempe_table **table)
{
    untouched(status, *table);
    if (status == KEMPE_OK)
        status = kempe_table_write(*table, s->csv);
    if (status == KEMPE_OK)
        status = kempe_table_write(*table, s->mat);
    kempe_table_free(*table);
    *table = NULL;
    return status;
}

/* The last table is left in the files. */
static inline kempe_status write_rows(scene *s)
{
    kempe_table *table = NULL;
    kempe_status status = write_table(s, kempe_trajectory_table(s->trajectory, "log", &table), &table);
    return status == KEMPE_OK ? write_table(s, kempe_trajectory_table(s->trajectory, "rows", &table), &table) : status;
}

/* -- the loop ------------------------------------------------------------------------------------------ */

/* Lets the stage derive again what an earlier one has left with the system. */
static kempe_status run_anew(scene *s, stage_fn *stage, unsigned long fail_at)
{
    if (s->system)
        kmp_program_cache_clear(s->system->kept);
    kmp_memory_fail_at(fail_at);
    kempe_status status = stage(s);
    kmp_memory_fail_at(0);
    return status;
}

/* Long stages do the same many times, and many begin alike: beyond the first 150 allocations (600 in ./check full) one
 * of `stride` fails. */
static void exhaust(scene *s, const char *name, stage_fn *stage, unsigned stride)
{
    unsigned long before = kmp_memory_count(), dense = check_full() ? 600 : 150, count, done = 0;
    CHECK(run_anew(s, stage, 0) == KEMPE_OK);
    count = kmp_memory_count() - before;
    for (unsigned long n = 1; n <= count; n += n > dense ? stride : 1) {
        kempe_status status = run_anew(s, stage, n);
        judge(s, name, n, status);
        done += status == KEMPE_OK;
    }
    CHECK(stage(s) == KEMPE_OK); /* nothing is left broken */
    printf("%-20s %5lu allocations failed, %lu of them were not needed\n", name, count, done);
}

typedef struct named_stage {
    const char *name;
    stage_fn *stage;
} named_stage;

/* Each stage of a list, with files for what it writes. */
static inline void exhaust_all(scene *s, const named_stage *stages, size_t count, unsigned stride)
{
    strcpy(s->csv, "/tmp/kempe_memory_XXXXXX.csv");
    strcpy(s->mat, "/tmp/kempe_memory_XXXXXX.mat");
    const int files[] = {mkstemps(s->csv, 4), mkstemps(s->mat, 4)};
    CHECK(files[0] >= 0 && files[1] >= 0);
    for (size_t k = 0; k < count; k++)
        exhaust(s, stages[k].name, stages[k].stage, stride);
    for (int k = 0; k < 2; k++)
        if (files[k] >= 0)
            close(files[k]);
    unlink(s->csv);
    unlink(s->mat);
}

/* Stages that need nothing from before, as a whole test program. */
static const named_stage *alone;
static size_t alone_count;
static unsigned alone_stride;

static inline void each_allocation_fails_alone(void)
{
    scene s = {.context = kempe_context_new()};
    exhaust_all(&s, alone, alone_count, alone_stride);
    kempe_context_free(s.context);
}

static inline int exhaust_alone(const named_stage *stages, size_t count, unsigned stride)
{
    alone = stages;
    alone_count = count;
    alone_stride = stride;
    TEST(each_allocation_fails_alone);
    return check_report();
}

#endif
