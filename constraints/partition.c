/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/partition.h"
#include "base/memory.h"
#include "linalg/dense.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A pivot below this fraction of the first is a zero: kept pivots of closed mechanisms are above 1e-2, dropped ones
 * below 1e-13 once h is closed to round-off. */
#define RANK_TOLERANCE 1e-10
/* Exchange v_i and u_k while |B_ik| exceeds this (a volume-maximising pivot rule; every exchange multiplies |det Jv| by
 * it). */
#define GROWTH 1.5
/* A wish is refused when its |B| would exceed this. */
#define WORST_WISH 1e4

static void scaled_jacobian(const kempe_system *s, const double *jacobian, double *a)
{
    for (int k = 0; k < s->n; k++)
        for (int r = 0; r < s->m; r++)
            a[r + k * s->m] = jacobian[r + k * s->m] * s->scale[k] / s->row_scale[r];
}

static int rank_of(const double *pivots, int count)
{
    int r = 0;
    while (r < count && pivots[r] > RANK_TOLERANCE * pivots[0])
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

/* Work arrays of one choice. */
typedef struct choice {
    const kempe_system *s;
    double *a, *lu, *jv, *b;
    int *row, *col, *fixed, *pivot;
} choice;

static bool choice_init(choice *c, const kempe_system *s)
{
    int n = s->n, m = s->m;
    *c = (choice){.s = s};
    c->a = KMP_NEW(double, m *n);
    c->lu = KMP_NEW(double, m *n);
    c->jv = KMP_NEW(double, m *m);
    c->b = KMP_NEW(double, m *n);
    c->row = KMP_NEW(int, m);
    c->col = KMP_NEW(int, n);
    c->fixed = KMP_NEW(int, n);
    c->pivot = KMP_NEW(int, m);
    return c->a && c->lu && c->jv && c->b && c->row && c->col && c->fixed && c->pivot;
}

static void choice_free(choice *c)
{
    kmp_free(c->a);
    kmp_free(c->lu);
    kmp_free(c->jv);
    kmp_free(c->b);
    kmp_free(c->row);
    kmp_free(c->col);
    kmp_free(c->fixed);
    kmp_free(c->pivot);
}

/* Scaled Jv of columns col[0..r) and rows row[0..r), factored; false when singular. */
static bool factor_jv(choice *c, int r)
{
    for (int k = 0; k < r; k++)
        for (int i = 0; i < r; i++)
            c->jv[i + k * r] = c->a[c->row[i] + c->col[k] * c->s->m];
    return kmp_lu_factor(r, c->jv, c->pivot) == 0;
}

/* b (r x p) = Bvu = -Jv^-1 Ju, scaled. */
static bool compute_b(choice *c, int r)
{
    int p = c->s->n - r;
    if (!factor_jv(c, r))
        return false;
    for (int k = 0; k < p; k++)
        for (int i = 0; i < r; i++)
            c->b[i + k * r] = -c->a[c->row[i] + c->col[r + k] * c->s->m];
    kmp_lu_solve(r, c->jv, c->pivot, p, c->b);
    return true;
}

static double largest(const double *b, int count, int *at)
{
    double worst = 0;
    *at = 0;
    for (int k = 0; k < count; k++)
        if (fabs(b[k]) > worst) {
            worst = fabs(b[k]);
            *at = k;
        }
    return worst;
}

/* Exchanges columns until no |B| exceeds the growth bound. */
static bool improve(choice *c, int r, kmp_partition *part, bool fixed)
{
    int p = c->s->n - r, at, most = part->exchanges + 4 * c->s->n;
    for (;;) {
        if (!compute_b(c, r))
            return false;
        part->max_b = largest(c->b, r * p, &at);
        if (r == 0 || part->max_b <= GROWTH || fixed || part->exchanges >= most)
            return true;
        int i = at % r, k = r + at / r, swap = c->col[i];
        c->col[i] = c->col[k];
        c->col[k] = swap;
        part->exchanges++;
    }
}

/* ||Jv||_1 ||Jv^-1||_1. */
static double condition(choice *c, int r)
{
    double norm = 0, inverse = 0;
    for (int k = 0; k < r; k++) {
        double sum = 0, sum_inverse = 0;
        for (int i = 0; i < r; i++) {
            sum += fabs(c->a[c->row[i] + c->col[k] * c->s->m]);
            c->b[i] = i == k;
        }
        kmp_lu_solve(r, c->jv, c->pivot, 1, c->b);
        for (int i = 0; i < r; i++)
            sum_inverse += fabs(c->b[i]);
        norm = fmax(norm, sum);
        inverse = fmax(inverse, sum_inverse);
    }
    return r > 0 ? norm * inverse : 1;
}

static const char *coordinate(const kempe_system *s, int k)
{
    return s->model->motions[k].name;
}

/* The wish, checked: as many as there are degrees of freedom, and Jv regular without them. `best` is what Kempe would
 * take. */
static kempe_status check_wish(const kempe_system *s, int p, int r, const int *best, const int *wish, int count,
                               const double *pivots)
{
    kmp_text names = {0};
    for (int k = 0; k < p; k++)
        kmp_text_printf(&names, "%s%s", k ? ", " : "", coordinate(s, best[k]));
    char *would = kmp_text_take(&names);
    kempe_status status = KEMPE_OK;
    if (!would)
        return kmp_fail_memory(s->context);
    if (count != p)
        status = kmp_fail(s->context, KEMPE_E_FAILED,
                          "the mechanism has %d degree%s of freedom, but %d independent coordinate%s asked for; "
                          "Kempe would take: %s",
                          p, p == 1 ? "" : "s", count, count == 1 ? " was" : "s were", p ? would : "none");
    else if (r > 0 && !(pivots[r - 1] * WORST_WISH > pivots[0]))
        status = kmp_fail(s->context, KEMPE_E_FAILED,
                          "'%s' cannot be independent here: the others do not follow from it (smallest pivot of "
                          "Jv %.2g of the largest); take: %s",
                          coordinate(s, wish[0]), pivots[r - 1] / pivots[0], would);
    kmp_free(would);
    return status;
}

static kempe_status follow_wish(choice *c, kmp_partition *part, const int *wish, int count)
{
    const kempe_system *s = c->s;
    double *pivots = KMP_NEW(double, s->m + s->n);
    int *best = KMP_NEW(int, s->n);
    kempe_status status = pivots && best ? KEMPE_OK : kmp_fail_memory(s->context);
    if (status == KEMPE_OK) {
        memcpy(best, c->col + part->r, (size_t)part->p * sizeof *best);
        sort(best, part->p);
        for (int k = 0; k < count; k++)
            c->fixed[wish[k]] = 1;
        memcpy(c->lu, c->a, (size_t)(s->m * s->n) * sizeof *c->lu);
        kmp_lu_complete(s->m, s->n, c->lu, c->fixed, c->row, c->col, pivots);
        status = check_wish(s, part->p, part->r, best, wish, count, pivots);
        part->user = true;
    }
    kmp_free(pivots);
    kmp_free(best);
    return status;
}

static bool allocate(kmp_partition *part, const kempe_system *s)
{
    *part = (kmp_partition){.n = s->n, .m = s->m, .cond = 1};
    part->u = KMP_NEW(int, s->n);
    part->v = KMP_NEW(int, s->n);
    part->rows = KMP_NEW(int, s->m);
    part->redundant = KMP_NEW(int, s->m);
    part->pivots = KMP_NEW(double, s->m + s->n);
    return part->u && part->v && part->rows && part->redundant && part->pivots;
}

static void keep(const choice *c, kmp_partition *part)
{
    int r = part->r;
    memcpy(part->v, c->col, (size_t)r * sizeof(int));
    memcpy(part->u, c->col + r, (size_t)part->p * sizeof(int));
    memcpy(part->rows, c->row, (size_t)r * sizeof(int));
    memcpy(part->redundant, c->row + r, (size_t)(part->m - r) * sizeof(int));
    sort(part->v, r);
    sort(part->u, part->p);
    sort(part->rows, r);
    sort(part->redundant, part->m - r);
}

/* rank < 0: by the pivots. */
static kempe_status choose(choice *c, kmp_partition *part, const double *jacobian, int rank, const int *wish,
                           int wish_count)
{
    const kempe_system *s = c->s;
    kempe_status status = KEMPE_OK;
    scaled_jacobian(s, jacobian, c->a);
    memcpy(c->lu, c->a, (size_t)(s->m * s->n) * sizeof *c->lu);
    kmp_lu_complete(s->m, s->n, c->lu, NULL, c->row, c->col, part->pivots);
    part->r = rank >= 0 ? rank : rank_of(part->pivots, s->m < s->n ? s->m : s->n);
    part->p = s->n - part->r;
    if (wish_count > 0)
        status = follow_wish(c, part, wish, wish_count);
    if (status != KEMPE_OK)
        return status;
    if (!improve(c, part->r, part, part->user))
        return kmp_fail(s->context, KEMPE_E_FAILED, "the closures are singular for every choice of coordinates");
    part->cond = condition(c, part->r);
    keep(c, part);
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
    choice c;
    kempe_status status;
    bool ok = choice_init(&c, system);
    ok = allocate(part, system) && ok;
    if (!ok)
        status = kmp_fail_memory(system->context);
    else
        status = choose(&c, part, jacobian, rank, wish, wish_count);
    choice_free(&c);
    if (status != KEMPE_OK)
        kmp_partition_free(part);
    return status;
}

bool kmp_partition_copy(kmp_partition *to, const kmp_partition *from)
{
    size_t n = (size_t)from->n, m = (size_t)from->m;
    *to = *from;
    to->u = KMP_NEW(int, n);
    to->v = KMP_NEW(int, n);
    to->rows = KMP_NEW(int, m);
    to->redundant = KMP_NEW(int, m);
    to->pivots = KMP_NEW(double, m + n);
    if (!to->u || !to->v || !to->rows || !to->redundant || !to->pivots) {
        kmp_partition_free(to);
        return false;
    }
    memcpy(to->u, from->u, n * sizeof *to->u);
    memcpy(to->v, from->v, n * sizeof *to->v);
    memcpy(to->rows, from->rows, m * sizeof *to->rows);
    memcpy(to->redundant, from->redundant, m * sizeof *to->redundant);
    memcpy(to->pivots, from->pivots, (m + n) * sizeof *to->pivots);
    return true;
}

kempe_status kmp_partition_exchange(kmp_partition *part, const kempe_system *system, const double *jacobian)
{
    choice c;
    kempe_status status = KEMPE_E_FAILED;
    kmp_partition trial = *part;
    if (!choice_init(&c, system)) {
        choice_free(&c);
        return kmp_fail_memory(system->context);
    }
    scaled_jacobian(system, jacobian, c.a);
    memcpy(c.row, part->rows, (size_t)part->r * sizeof(int));
    memcpy(c.row + part->r, part->redundant, (size_t)(part->m - part->r) * sizeof(int));
    memcpy(c.col, part->v, (size_t)part->r * sizeof(int));
    memcpy(c.col + part->r, part->u, (size_t)part->p * sizeof(int));
    if (improve(&c, part->r, &trial, false)) {
        part->exchanges = trial.exchanges;
        part->max_b = trial.max_b;
        part->cond = condition(&c, part->r);
        part->user = false;
        keep(&c, part);
        status = KEMPE_OK;
    }
    choice_free(&c);
    return status;
}

void kmp_partition_free(kmp_partition *part)
{
    kmp_free(part->u);
    kmp_free(part->v);
    kmp_free(part->rows);
    kmp_free(part->redundant);
    kmp_free(part->pivots);
    *part = (kmp_partition){0};
}
