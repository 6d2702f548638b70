/* SPDX-License-Identifier: BSD-3-Clause */
/* Pools are found by the inputs of their program, so that an instance runs in the same pool whatever the other
 * instances are. */
#include "base/memory.h"
#include "integrators/lanes/ensemble_inside.h"
#include <string.h>

void kmp_pool_free(kmp_pool *pool)
{
    if (!pool)
        return;
    kmp_lanes_free(pool->lanes);
    kmp_program_free(pool->program);
    kmp_reduction_free(&pool->red);
    kmp_partition_free(&pool->part);
    kmp_free(pool->order);
    kmp_free(pool->layout.factor);
    kmp_free(pool);
}

void kmp_pool_put(kmp_ensemble *e, kmp_pool *pool, int i)
{
    e->instances[i].next = -1;
    if (pool->tail >= 0)
        e->instances[pool->tail].next = i;
    else
        pool->head = i;
    pool->tail = i;
    pool->waiting++;
}

int kmp_pool_take(kmp_ensemble *e, kmp_pool *pool)
{
    int i = pool->head;
    if (i < 0)
        return -1;
    pool->head = e->instances[i].next;
    pool->tail = pool->head < 0 ? -1 : pool->tail;
    pool->waiting--;
    return i;
}

static bool same_choice(const kmp_pool *pool, const kmp_partition *part)
{
    return memcmp(pool->part.u, part->u, (size_t)part->p * sizeof *part->u) == 0;
}

/* Makes a pool. KEMPE_E_FAILED: its program cannot be written. */
static kempe_status make(kmp_ensemble *e, const kmp_partition *part, kmp_pool *pool)
{
    unsigned long failures = kmp_memory_failures();
    pool->head = pool->tail = -1;
    pool->order = KMP_NEW(int, part->r);
    KMP_TRY(kmp_made(e->context, pool->order && kmp_partition_copy(&pool->part, part)));
    KMP_TRY(kmp_reduction_init(&pool->red, e->eval, &pool->part));
    if (!kmp_written_blocks_fit(&pool->red))
        return KEMPE_E_FAILED;
    kmp_written_order(&pool->red, pool->order);
    const kmp_fused_plan plan = {pool->order, e->unit_row_scale, true, false};
    pool->program = kmp_fused_write(&pool->red, &plan, &pool->layout);
    if (pool->program)
        pool->lanes = kmp_lanes_new(pool->program, (int)e->room.w, e->execution.plain);
    if (pool->lanes)
        return KEMPE_OK;
    return kmp_memory_failures() != failures ? kmp_fail_memory(e->context) : KEMPE_E_FAILED;
}

kempe_status kmp_pool_find(kmp_ensemble *e, const kmp_partition *part, kmp_pool **found)
{
    int *order = KMP_NEW(int, part->r);
    *found = NULL;
    KMP_TRY(kmp_made(e->context, order));
    for (int k = 0; k < e->pool_count && !*found; k++) {
        kmp_pool *pool = e->pools[k];
        if (!same_choice(pool, part))
            continue;
        kmp_written_order(&pool->red, order);
        if (memcmp(pool->order, order, (size_t)part->r * sizeof *order) == 0)
            *found = pool;
    }
    kmp_free(order);
    if (*found || e->pool_count == KMP_POOLS_MOST)
        return KEMPE_OK;
    kmp_pool *pool = KMP_NEW(kmp_pool, 1);
    kempe_status status = pool ? make(e, part, pool) : kmp_fail_memory(e->context);
    if (status == KEMPE_OK)
        *found = e->pools[e->pool_count++] = pool;
    else
        kmp_pool_free(pool);
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}
