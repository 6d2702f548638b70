/* SPDX-License-Identifier: BSD-3-Clause */
/* The place of a motion with sensitivities (forward_place.h): from unknowns, to unknowns, and to other charts. */
#include "analyses/sensitivity/forward_place.h"
#include "analyses/sensitivity/forward_inside.h"
#include <string.h>

bool kmp_forward_place_make(kmp_forward_place *place, kmp_arena *arena, const kempe_system *system)
{
    return KMP_ARENA_MAKE(arena, KMP_ROOM(double, KMP_CHART_SIZE * system->chart_count, &place->chart),
                          KMP_ROOM(double, system->n, &place->q, &place->qd));
}

bool kmp_forward_place_widen(kmp_forward_place *place, kmp_arena *arena, int n, int columns)
{
    const double *tail = place->tail;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(double, n *columns, &place->dq, &place->dqd),
                        KMP_ROOM(double, 1 + columns, &place->tail)))
        return false;
    if (tail)
        place->tail[0] = tail[0];
    return true;
}

int kmp_forward_spread(kmp_forward_formulation *f, double t, const double *y)
{
    const kmp_linear *l = &f->v->linear;
    kmp_forward_place *place = &f->place;
    if (kmp_forward_stand_at(f, t, y, true) != KMP_GO)
        return KMP_HALT;
    place->t = t;
    memcpy(place->q, l->q, (size_t)f->n * sizeof *place->q);
    memcpy(place->qd, l->qd, (size_t)f->n * sizeof *place->qd);
    memcpy(place->chart, l->eval->chart, kmp_forward_chart_bytes(f));
    for (int k = 0; k < f->count; k++)
        kmp_forward_follow(f, y, k, place->dq + k * f->n, place->dqd + k * f->n, NULL, NULL);
    return KMP_GO;
}

void kmp_forward_pack(kmp_forward_formulation *f, double *y)
{
    const kmp_forward_place *place = &f->place;
    const int *of = kmp_forward_unknowns(f);
    int half = kmp_forward_blocks(f), w = f->width;
    for (int i = 0; i < w; i++) {
        y[i] = place->q[of[i]];
        y[half + i] = place->qd[of[i]];
        for (int k = 0; k < f->count; k++) {
            y[(k + 1) * w + i] = place->dq[k * f->n + of[i]];
            y[half + (k + 1) * w + i] = place->dqd[k * f->n + of[i]];
        }
    }
}

void kmp_forward_enter_charts(kmp_forward_formulation *f, const double *q, const double *qd)
{
    kmp_forward_place *place = &f->place;
    const kmp_chart_motion from = {place->chart, place->q, place->qd, NULL},
                           to = {kmp_forward_eval(f)->chart, q, qd, NULL};
    for (int c = 0; c < f->system->chart_count; c++)
        for (int k = 0; k < f->count && memcmp(from.chart + KMP_CHART_SIZE * c, to.chart + KMP_CHART_SIZE * c,
                                               KMP_CHART_SIZE * sizeof(double)) != 0;
             k++)
            kmp_chart_carry(f->system, c, &from, &to, place->dq + k * f->n, place->dqd + k * f->n, NULL);
    memcpy(place->chart, to.chart, kmp_forward_chart_bytes(f));
    memcpy(place->q, q, (size_t)f->n * sizeof *q);
    memcpy(place->qd, qd, (size_t)f->n * sizeof *qd);
}

bool kmp_forward_charts_differ(const kmp_forward_formulation *f)
{
    return memcmp(f->place.chart, kmp_forward_eval(f)->chart, kmp_forward_chart_bytes(f)) != 0;
}
