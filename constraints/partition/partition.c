/* SPDX-License-Identifier: BSD-3-Clause */
/* The choice of independent coordinates and rows: columns that a user wants come first, then complete pivoting decides,
 * then exchanges of columns keep |Bvu| small. A choice of the user that is not possible is an error that names a
 * possible one. */
#include "constraints/partition/partition.h"
#include "base/memory.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/partition/pivot_columns.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

int kmp_partition_rank(const kempe_system *s, const double *pivots)
{
    const kmp_rounding *rounding = kmp_rounding_of(s);
    int r = 0, most = s->m < s->n ? s->m : s->n;
    double zero = kmp_rounding_zero(s, KMP_RANK);
    most = rounding && rounding->rank < most ? rounding->rank : most;
    while (r < most && pivots[0] > KMP_RANK_FIRST && pivots[r] > zero * pivots[0])
        r++;
    return r;
}

static int compare_ints(const void *a, const void *b)
{
    return *(const int *)a - *(const int *)b;
}

static void sort(int *x, int count)
{
    if (count > 1)
        qsort(x, (size_t)count, sizeof *x, compare_ints);
}

void kmp_partition_sort(kmp_partition *part)
{
    sort(part->v, part->r);
    sort(part->u, part->p);
    sort(part->rows, part->r);
    sort(part->redundant, part->m - part->r);
}

static bool choice_init(kmp_pick *c, kmp_arena_lent *room, const kempe_system *s, const double *jacobian)
{
    const kmp_pattern *j = &s->jacobian;
    if (!kmp_pick_init(c, s->m, s->n, j->count, room))
        return false;
    for (int e = 0; e < j->count; e++)
        kmp_pick_add(c, j->row[e], j->col[e], jacobian[e] * s->scale[j->col[e]] / s->row_scale[j->row[e]]);
    return true;
}

static const char *coordinate(const kempe_system *s, int k)
{
    return s->model->motions[k].name;
}

/* Reports that a user's choice is not possible, with p coordinates that are: Kempe's own choice. */
static kempe_status complain_wish(const kempe_system *s, int p, int r, const int *best, const int *wish, int count,
                                  const double *pivots)
{
    kmp_text names = {0};
    for (int k = 0; k < p; k++)
        kmp_text_printf(&names, "%s%s", k ? ", " : "", coordinate(s, best[k]));
    char *would = kmp_text_take(&names);
    KMP_TRY(kmp_made(s->context, would));
    if (count != p)
        (void)kmp_fail(
            s->context, KEMPE_E_FAILED,
            "the mechanism has %d degree%s of freedom, but %d independent coordinate%s given; possible choice: %s", p,
            p == 1 ? "" : "s", count, count == 1 ? " was" : "s were", p ? would : "none");
    else
        (void)kmp_fail(s->context, KEMPE_E_FAILED,
                       "'%s' cannot be independent here: the others do not follow from it (smallest pivot of Jv "
                       "%.2g of the largest); possible choice: %s",
                       coordinate(s, wish[0]), pivots[r - 1] / pivots[0], would);
    kmp_free(would);
    return KEMPE_E_FAILED;
}

static kempe_status follow_wish(kmp_pick *c, kmp_partition *part, const kempe_system *s, const int *wish, int count)
{
    double *pivots = KMP_ARENA_NEW(&c->arena, double, s->m + s->n);
    int *best = KMP_ARENA_NEW(&c->arena, int, s->n);
    KMP_TRY(kmp_made(s->context, !c->arena.failed));
    memcpy(best, c->col + part->r, (size_t)part->p * sizeof *best);
    sort(best, part->p);
    for (int k = 0; k < count; k++)
        c->fixed[wish[k]] = 1;
    for (int k = kmp_model_coordinates(s->model); k < s->n; k++) { /* states are independent in any case */
        count += !c->fixed[k];
        c->fixed[k] = 1;
    }
    part->user = true;
    KMP_TRY(kmp_made(s->context, kmp_pick_pivot(c, c->fixed, pivots)));
    /* One coordinate per degree of freedom, besides the states, which are the last ones, and Jv regular. */
    int p = part->p - s->model->state_count, r = part->r;
    count -= s->model->state_count;
    bool possible = count == p && (r == 0 || pivots[r - 1] * KMP_GROWTH_WISH > pivots[0]);
    return possible ? KEMPE_OK : complain_wish(s, p, r, best, wish, count, pivots);
}

/* Allocates the lists of coordinates and rows in one block. */
static bool allocate(kmp_partition *part, int n, int m)
{
    *part = (kmp_partition){.n = n, .m = m, .u = KMP_NEW(int, 2 * (n + m)), .pivots = KMP_NEW(double, m + n)};
    if (!part->u || !part->pivots)
        return false;
    part->v = part->u + n;
    part->rows = part->v + n;
    part->redundant = part->rows + m;
    return true;
}

/* Improves the first r rows and columns. KEMPE_E_FAILED without message: singular, part is untouched. */
static kempe_status improve(kmp_pick *c, kmp_partition *part, const kempe_system *s, bool fixed)
{
    int exchanges = 0;
    double max_b;
    kmp_pick_outcome outcome = kmp_pick_improve(c, part->r, fixed ? 0 : 4 * s->n, &exchanges, &max_b);
    if (outcome != KMP_PICK_MADE)
        return outcome == KMP_PICK_SINGULAR ? KEMPE_E_FAILED : kmp_fail_memory(s->context);
    part->exchanges += exchanges;
    part->max_b = max_b;
    /* The improved choice, in the order of coordinates. */
    int r = part->r;
    memcpy(part->v, c->col, (size_t)r * sizeof(int));
    memcpy(part->u, c->col + r, (size_t)part->p * sizeof(int));
    memcpy(part->rows, c->row, (size_t)r * sizeof(int));
    memcpy(part->redundant, c->row + r, (size_t)(part->m - r) * sizeof(int));
    kmp_partition_sort(part);
    return KEMPE_OK;
}

kempe_status kmp_partition_init(kmp_partition *part, const kempe_system *system, const double *jacobian,
                                const int *wish, int wish_count)
{
    return kmp_partition_of_rank(part, system, jacobian, -1, wish, wish_count);
}

kempe_status kmp_partition_of_rank(kmp_partition *part, const kempe_system *system, const double *jacobian, int rank,
                                   const int *wish, int wish_count)
{
    kmp_pick c;
    kmp_arena_lent room;
    bool made = allocate(part, system->n, system->m);
    made = choice_init(&c, &room, system, jacobian) && made;
    made = made && kmp_pick_pivot(&c, NULL, part->pivots);
    kempe_status status = made ? KEMPE_OK : kmp_fail_memory(system->context);
    if (made) {
        part->r = rank >= 0 ? rank : kmp_partition_rank(system, part->pivots);
        part->p = system->n - part->r;
        if (wish_count > 0)
            status = follow_wish(&c, part, system, wish, wish_count);
    }
    if (status == KEMPE_OK) {
        status = improve(&c, part, system, part->user);
        if (status == KEMPE_E_FAILED)
            (void)kmp_fail(system->context, status, "the closures are singular for every choice of coordinates");
    }
    kmp_pick_free(&c);
    if (status != KEMPE_OK)
        kmp_partition_free(part);
    return status;
}

int kmp_partition_prefer(const kempe_system *system, const double *jacobian, const bool *liked, int *u)
{
    kmp_pick c;
    kmp_arena_lent room;
    int count = -1;
    double *pivots =
        choice_init(&c, &room, system, jacobian) ? KMP_ARENA_NEW(&c.arena, double, system->m + system->n) : NULL;
    for (int k = 0; pivots && k < system->n; k++)
        c.fixed[k] = liked[k];
    if (pivots && kmp_pick_pivot(&c, c.fixed, pivots)) {
        int rank = kmp_partition_rank(system, pivots);
        count = system->n - rank;
        memcpy(u, c.col + rank, (size_t)count * sizeof *u);
    }
    kmp_pick_free(&c);
    return count;
}

bool kmp_partition_pivots(const kempe_system *system, const double *jacobian, double *pivots)
{
    kmp_pick c;
    kmp_arena_lent room;
    bool ok = choice_init(&c, &room, system, jacobian) && kmp_pick_pivot(&c, NULL, pivots);
    kmp_pick_free(&c);
    return ok;
}

void kmp_partition_take_rows(kmp_partition *part, const kmp_partition *from)
{
    memcpy(part->rows, from->rows, (size_t)from->r * sizeof *part->rows);
    memcpy(part->redundant, from->redundant, (size_t)(from->m - from->r) * sizeof *part->redundant);
}

bool kmp_partition_copy(kmp_partition *to, const kmp_partition *from)
{
    kmp_partition own;
    bool made = allocate(&own, from->n, from->m);
    *to = *from;
    to->u = own.u;
    to->v = own.v;
    to->rows = own.rows;
    to->redundant = own.redundant;
    to->pivots = own.pivots;
    if (!made) {
        kmp_partition_free(to);
        return false;
    }
    memcpy(to->u, from->u, 2 * (size_t)(from->n + from->m) * sizeof *to->u);
    memcpy(to->pivots, from->pivots, (size_t)(from->m + from->n) * sizeof *to->pivots);
    return true;
}

/* Orders rows and columns as a partition has them. */
static void begin_with(kmp_pick *c, const kmp_partition *part)
{
    memcpy(c->row, part->rows, (size_t)part->r * sizeof(int));
    memcpy(c->row + part->r, part->redundant, (size_t)(part->m - part->r) * sizeof(int));
    memcpy(c->col, part->v, (size_t)part->r * sizeof(int));
    memcpy(c->col + part->r, part->u, (size_t)part->p * sizeof(int));
}

kempe_status kmp_partition_condition(const kmp_partition *part, const kempe_system *system, const double *jacobian,
                                     double *cond)
{
    kmp_pick c;
    kmp_arena_lent room;
    kmp_pick_outcome outcome = KMP_PICK_NO_MEMORY;
    if (choice_init(&c, &room, system, jacobian)) {
        begin_with(&c, part);
        outcome = kmp_pick_condition(&c, part->r, cond);
    }
    kmp_pick_free(&c);
    if (outcome == KMP_PICK_SINGULAR)
        *cond = INFINITY;
    return kmp_made(system->context, outcome != KMP_PICK_NO_MEMORY);
}

kempe_status kmp_partition_exchange(kmp_partition *part, const kempe_system *system, const double *jacobian,
                                    double growth)
{
    kmp_pick c;
    kmp_arena_lent room;
    if (!choice_init(&c, &room, system, jacobian)) {
        kmp_pick_free(&c);
        return kmp_fail_memory(system->context);
    }
    c.growth = growth;
    begin_with(&c, part);
    kempe_status status = improve(&c, part, system, false);
    part->user = part->user && status != KEMPE_OK;
    kmp_pick_free(&c);
    return status;
}

void kmp_partition_free(kmp_partition *part)
{
    kmp_free(part->u); /* also frees the lists in its block */
    kmp_free(part->pivots);
    *part = (kmp_partition){0};
}
