/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/diagnose.h"
#include "base/memory.h"
#include "constraints/plant.h"
#include "constraints/reduction.h"
#include <string.h>

/* Diagonal blocks of Jv, as coordinates. */
static kempe_status find_blocks(kempe_check *check, kmp_plant *plant)
{
    kmp_reduction red;
    kempe_status status = kmp_reduction_init(&red, plant, &check->part);
    if (status != KEMPE_OK)
        return status;
    check->block_start = KMP_NEW(int, check->part.r + 1);
    check->block_column = KMP_NEW(int, check->part.r);
    bool ok = check->block_start && check->block_column;
    check->block_count = ok && red.block ? kmp_block_count(red.block) : 0;
    for (int k = 0; k < check->block_count; k++) {
        int count, start = check->block_start[k];
        const int *column = kmp_block_columns(red.block, k, &count);
        for (int i = 0; i < count; i++)
            check->block_column[start + i] = check->part.v[column[i]];
        check->block_start[k + 1] = start + count;
    }
    kmp_reduction_free(&red);
    return ok ? KEMPE_OK : kmp_fail_memory(check->system->context);
}

static kempe_status diagnose(kempe_check *check)
{
    const kempe_system *s = check->system;
    kempe_status status = kempe_assemble(s, &check->assembly);
    if (status != KEMPE_OK)
        return status;
    kmp_plant *plant = kmp_plant_new(s, "tape");
    double *jacobian = KMP_NEW(double, s->m * s->n);
    if (!plant || !jacobian) {
        status = kmp_fail_memory(s->context);
    } else {
        kmp_plant_closure(plant, 0, check->assembly->q);
        kmp_plant_dense_jacobian(plant, jacobian);
        status = kmp_partition_init(&check->part, s, jacobian, s->model->run.u, s->model->run.u_count);
    }
    if (status == KEMPE_OK)
        status = find_blocks(check, plant);
    kmp_plant_free(plant);
    kmp_free(jacobian);
    return status;
}

kempe_status kempe_check_new(const kempe_system *system, kempe_check **check)
{
    kmp_context_clear(system->context);
    kempe_check *c = KMP_NEW(kempe_check, 1);
    if (!c)
        return kmp_fail_memory(system->context);
    c->system = system;
    c->body_count = system->model->body_count - 1;
    c->loop_count = system->model->closure_count;
    kempe_status status = diagnose(c);
    if (status != KEMPE_OK) {
        kempe_check_free(c);
        return status;
    }
    *check = c;
    return KEMPE_OK;
}

void kempe_check_free(kempe_check *check)
{
    if (!check)
        return;
    kempe_assembly_free(check->assembly);
    kmp_partition_free(&check->part);
    kmp_free(check->block_start);
    kmp_free(check->block_column);
    kmp_free(check);
}
