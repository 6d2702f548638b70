/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/processes/shard.h"
#include <stdlib.h>
#include <string.h>

/* Variables of launchers, in the order in which they count: mpirun in an allocation of Slurm has its own. */
static const struct {
    const char *engine, *number, *count; /* number: from 0 on */
} launchers[] = {{"Open MPI", "OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"},
                 {"PMI", "PMI_RANK", "PMI_SIZE"},
                 {"srun", "SLURM_PROCID", "SLURM_STEP_NUM_TASKS"},
                 {"Slurm", "SLURM_PROCID", "SLURM_NTASKS"}};

static bool to_whole(const char *text, int *value)
{
    char *end;
    long x = text && *text >= '0' && *text <= '9' ? strtol(text, &end, 10) : -1;
    if (x < 0 || x > 1000000 || *end)
        return false;
    *value = (int)x;
    return true;
}

/* The process within its launcher; none: 0 of 1. */
static kempe_status find_rank(kempe_context *context, int *index, int *count, bool *found)
{
    *index = 0;
    *count = 1;
    for (size_t k = 0; k < sizeof launchers / sizeof *launchers; k++)
        if (to_whole(getenv(launchers[k].number), index) && to_whole(getenv(launchers[k].count), count)) {
            *found = true;
            return *index < *count
                       ? KEMPE_OK
                       : kmp_fail(context, KEMPE_E_ARGUMENT, "shard auto: the variables of %s say process %d of %d",
                                  launchers[k].engine, *index, *count);
        }
    *index = 0;
    *count = 1;
    return KEMPE_OK;
}

/* The task within a job array of Slurm, with its smallest number and step; none: 0 of 1. */
static kempe_status find_task(kempe_context *context, int *index, int *count, bool *found)
{
    int task, least = 0, step = 1;
    *index = 0;
    *count = 1;
    if (!to_whole(getenv("SLURM_ARRAY_TASK_ID"), &task) || !to_whole(getenv("SLURM_ARRAY_TASK_COUNT"), count)) {
        *count = 1;
        return KEMPE_OK;
    }
    (void)to_whole(getenv("SLURM_ARRAY_TASK_MIN"), &least);
    (void)to_whole(getenv("SLURM_ARRAY_TASK_STEP"), &step);
    *found = true;
    if (task < least || step < 1 || (task - least) % step != 0 || (task - least) / step >= *count)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "shard auto: task %d of the job array is none of %d from %d on in steps of %d; give the array "
                        "as FIRST-LAST, or --shard I/N",
                        task, *count, least, step);
    *index = (task - least) / step;
    return KEMPE_OK;
}

/* The tasks of an array, each with the processes of its launcher. GNU parallel does not give the number of its jobs:
 * they share all parts by claims. */
static kempe_status find_auto(kempe_context *context, kmp_shard *shard)
{
    int task, tasks, rank, ranks, job;
    bool found = false;
    KMP_TRY(find_task(context, &task, &tasks, &found));
    KMP_TRY(find_rank(context, &rank, &ranks, &found));
    if (!found && !to_whole(getenv("PARALLEL_SEQ"), &job))
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "shard auto: no variables of Slurm, Open MPI, PMI or GNU parallel are set; give I/N");
    *shard = (kmp_shard){task * ranks + rank + 1, tasks * ranks};
    return KEMPE_OK;
}

kempe_status kmp_shard_read(kempe_context *context, const char *word, kmp_shard *shard)
{
    char number[12] = "";
    *shard = (kmp_shard){1, 1};
    if (!word)
        return KEMPE_OK;
    if (strcmp(word, "auto") == 0)
        return find_auto(context, shard);
    size_t length = strcspn(word, "/");
    if (length < sizeof number)
        memcpy(number, word, length);
    if (word[length] && to_whole(number, &shard->number) && to_whole(word + length + 1, &shard->count) &&
        shard->number >= 1 && shard->number <= shard->count)
        return KEMPE_OK;
    return kmp_fail(context, KEMPE_E_ARGUMENT, "shard '%s' is not I/N with 1 <= I <= N, as 2/7, or auto", word);
}
