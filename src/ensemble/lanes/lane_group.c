/* SPDX-License-Identifier: BSD-3-Clause */
/* Pools are found by the inputs of their program, so that an instance runs in the same pool whatever the other
 * instances are. */
#include "ensemble/lanes/lane_group.h"
#include "base/memory.h"
#include "constraints/programs/reduced_program.h"
#include "ensemble/lanes/ensemble_conditions.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "ensemble/lanes/ensemble_measure.h"
#include <string.h>

void kmp_lane_group_free(kmp_lane_group *pool)
{
    if (!pool)
        return;
    kmp_lanes_free(pool->lanes);
    kmp_lanes_free(pool->complete_lanes);
    kmp_program_free(pool->complete);
    kmp_program_free(pool->program);
    kmp_reduction_free(&pool->red);
    kmp_partition_free(&pool->part);
    kmp_free(pool->order);
    kmp_free(pool->pivot_block);
    kmp_free(pool->row);
    kmp_free(pool->load_row);
    kmp_free(pool->output);
    kmp_free(pool->place);
    kmp_free(pool);
}

void kmp_lane_group_put(kmp_engine *e, kmp_lane_group *pool, int i)
{
    e->instances[i].next = -1;
    if (pool->tail >= 0)
        e->instances[pool->tail].next = i;
    else
        pool->head = i;
    pool->tail = i;
    pool->waiting++;
}

int kmp_lane_group_take(kmp_engine *e, kmp_lane_group *pool)
{
    int i = pool->head;
    if (i < 0)
        return -1;
    pool->head = e->instances[i].next;
    pool->tail = pool->head < 0 ? -1 : pool->tail;
    pool->waiting--;
    return i;
}

static bool same_choice(const kmp_lane_group *pool, const kmp_partition *part)
{
    return pool->part.p == part->p && memcmp(pool->part.u, part->u, (size_t)part->p * sizeof *part->u) == 0 &&
           memcmp(pool->part.rows, part->rows, (size_t)part->r * sizeof *part->rows) == 0;
}

/* The load rows of the partition, in their order (take_loads of reduced_program.c). NULL: no memory. */
static int *load_rows_of(const kmp_engine *e, const kmp_lane_group *pool)
{
    const kmp_partition *part = &pool->part;
    int *row = KMP_NEW(int, e->s->load_row_count + 1), count = 0;
    for (int j = 0; row && j < e->s->load_row_count; j++)
        for (int i = 0; i < part->r; i++)
            if (part->rows[i] == e->s->load_rows[j])
                row[count++] = part->rows[i];
    return row;
}

/* Makes the lanes of the program, and finds where it takes the unknowns and leaves their slopes. false: no memory. */
static bool prepare(const kmp_engine *e, kmp_lane_group *pool)
{
    const kmp_program *program = pool->program;
    int size = kmp_lane_most(e),
        stage = e->s->load_row_count > 0 ? KMP_REDUCED_PROGRAM_ACCELERATIONS : KMP_REDUCED_PROGRAM_RATES;
    pool->slopes = stage;
    pool->lanes = kmp_lanes_new(program, (int)e->room.w, e->execution.plain);
    pool->output = KMP_NEW(kmp_lanes_output, program->outputs[stage + 1] - program->outputs[stage] + 1);
    pool->place = KMP_NEW(double *, size);
    if (!pool->lanes || !pool->output || !pool->place)
        return false;
    kmp_lanes_fuse_sines(pool->lanes);
    pool->timed = kmp_lanes_takes(pool->lanes, KMP_IN_TIME);
    kmp_lanes_outputs(pool->lanes, stage, pool->output);
    kmp_lanes_places(pool->lanes, KMP_IN_Q, size, pool->place);
    return true;
}

/* Makes a pool. KEMPE_E_FAILED: its program cannot be written. */
static kempe_status make(kmp_engine *e, const kmp_partition *part, kmp_lane_group *pool)
{
    unsigned long failures = kmp_memory_failures();
    pool->head = pool->tail = -1;
    pool->order = KMP_NEW(int, part->r);
    KMP_TRY(kmp_made(e->context, pool->order && kmp_partition_copy(&pool->part, part)));
    KMP_TRY(kmp_reduction_init(&pool->red, e->eval, &pool->part));
    if (!kmp_writer_blocks_fit(&pool->red))
        return KEMPE_E_FAILED;
    kmp_writer_order(&pool->red, pool->order);
    const kmp_reduced_program_plan plan = {.order = pool->order,
                                           .power = true,
                                           .drives = true,
                                           .curvature = e->s->changes_by_rates,
                                           .forces = kmp_has_late_conditions(e->s)};
    const kmp_reduced_program_written written = kmp_reduced_program_write(&pool->red, &plan);
    pool->program = written.program;
    pool->layout = written.layout;
    pool->row = written.row;
    /* The block of each pivot; pivots are written from the last block to the first. */
    unsigned char *block = KMP_NEW(unsigned char, pool->layout.pivots + 1);
    int count = 0, size;
    for (int b = pool->part.r > 0 ? kmp_block_count(pool->red.block) : 0; block && b-- > 0;) {
        (void)kmp_block_columns(pool->red.block, b, &size);
        for (int k = size == 2 ? 1 : size; k-- > 0;)
            block[count++] = (unsigned char)b;
    }
    pool->pivot_block = block;
    pool->load_row = load_rows_of(e, pool);
    bool made = pool->program && pool->pivot_block && pool->load_row && prepare(e, pool);
    if (made && kmp_lane_group_complete(e, pool))
        return KEMPE_OK;
    return kmp_memory_failures() != failures ? kmp_fail_memory(e->context) : KEMPE_E_FAILED;
}

bool kmp_lane_group_among(const kmp_engine *e, const kmp_lane_group *pool)
{
    for (int k = 0; k < e->pool_count; k++)
        if (same_choice(e->pools[k], &pool->part) &&
            memcmp(e->pools[k]->order, pool->order, (size_t)pool->part.r * sizeof *pool->order) == 0)
            return true;
    return false;
}

/* Room for a pool: after the others, or where the one was that has been idle for the longest time. NULL: no memory. */
static kmp_lane_group **place_of(kmp_engine *e)
{
    int place = -1, kept = e->execution.pools > 0 ? e->execution.pools : KMP_POOLS_KEPT;
    for (int k = 0; k < e->pool_count && e->pool_count >= kept; k++)
        if (e->pools[k] != e->running && e->pools[k]->waiting == 0 &&
            (place < 0 || e->pools[k]->used < e->pools[place]->used))
            place = k;
    if (place >= 0) {
        kmp_lane_group_free(e->pools[place]);
        e->pools[place] = NULL;
        return &e->pools[place];
    }
    kmp_lane_group **pools = kmp_list_room(e->pools, (size_t)e->pool_count, sizeof *pools);
    if (!pools)
        return NULL;
    e->pools = pools;
    return &e->pools[e->pool_count++];
}

/* Makes a pool and puts it into the list. */
static kempe_status add(kmp_engine *e, const kmp_partition *part, kmp_lane_group **added)
{
    kmp_lane_group *pool = KMP_NEW(kmp_lane_group, 1);
    KMP_TRY(kmp_made(e->context, pool));
    kempe_status status = make(e, part, pool);
    kmp_lane_group **place = status == KEMPE_OK ? place_of(e) : NULL;
    if (status == KEMPE_OK)
        status = kmp_made(e->context, place);
    if (status == KEMPE_OK)
        *place = *added = pool;
    else
        kmp_lane_group_free(pool);
    return status;
}

kmp_lane_group *kmp_lane_group_of_choice(kmp_engine *e, const kmp_partition *part)
{
    for (int k = 0; k < e->pool_count; k++)
        if (same_choice(e->pools[k], part)) {
            e->pools[k]->used = ++e->finds;
            return e->pools[k];
        }
    return NULL;
}

/* Blocks of one row and of two rows are solved by their determinants (kmp_writer_order). */
bool kmp_lane_group_is_ordered(const kmp_lane_group *pool)
{
    return kmp_block_largest(pool->red.block) <= 2;
}

kempe_status kmp_lane_group_find(kmp_engine *e, const kmp_partition *part, kmp_lane_group **found)
{
    int order[KMP_LANE_ROWS];
    *found = NULL;
    for (int k = 0; k < e->pool_count && !*found; k++) {
        kmp_lane_group *pool = e->pools[k];
        if (!same_choice(pool, part))
            continue;
        kmp_writer_order(&pool->red, order);
        if (memcmp(pool->order, order, (size_t)part->r * sizeof *order) == 0)
            *found = pool;
    }
    kempe_status status = *found ? KEMPE_OK : add(e, part, found);
    if (*found)
        (*found)->used = ++e->finds;
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}
