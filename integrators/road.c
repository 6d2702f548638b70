/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/road.h"
#include "base/memory.h"
#include <string.h>

void *kmp_road_new(const kmp_road_start *start, size_t bytes)
{
    kmp_road *road = kmp_calloc(1, bytes);
    if (!road) {
        (void)kmp_fail_memory(start->system->context);
        return NULL;
    }
    road->n = start->part->n;
    road->release = kmp_road_free;
    return road;
}

void kmp_road_free(kmp_road *road)
{
    kmp_text_free(&road->reason);
    kmp_arena_free(&road->arena);
    kmp_free(road);
}

void kmp_road_make_unknowns(kmp_road *road, int size, bool slopes)
{
    road->size = size;
    road->y = KMP_ARENA_NEW(&road->arena, double, size);
    road->atol = KMP_ARENA_NEW(&road->arena, double, size);
    road->yp = slopes ? KMP_ARENA_NEW(&road->arena, double, size) : NULL;
}

void kmp_road_begin_with_state(kmp_road *road, const kmp_road_start *start)
{
    int n = road->n;
    for (int i = 0; i < n; i++) {
        road->y[i] = start->q[i];
        road->y[n + i] = start->qd[i];
        road->atol[i] = start->atol * start->system->scale[i];
        road->atol[n + i] = road->atol[i] * start->rate_scale;
    }
}

void kmp_road_position_of_state(kmp_road *road, double t, const double *y, double *q)
{
    (void)t;
    memcpy(q, y, (size_t)road->n * sizeof *q);
}
