/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/transfer.h"
#include "base/memory.h"
#include "linalg/dense.h"
#include <string.h>

/* -- making one -------------------------------------------------------------------------------------- */

/* A drive's function acts with its rates; everything else as it is. */
static int orders(kmp_asked_kind kind)
{
    return kind == KMP_ASKED_DRIVE ? 3 : 1;
}

static void list_loads(kmp_transfer *t, const int *place)
{
    int at = 0;
    for (int i = 0; i < t->inputs->count; i++) {
        kmp_asked_kind kind = t->inputs->input[i].kind;
        for (int order = 0; order < orders(kind); order++)
            t->load[at++] = (kmp_load){.input = i,
                                       .order = order,
                                       .parameter = kind == KMP_ASKED_PARAMETER ? place[i] : -1,
                                       .place = kind == KMP_ASKED_FORCE ? place[i] : -1};
    }
}

kempe_status kmp_transfer_init(kmp_transfer *transfer, kmp_linear *linear, kmp_slopes *slopes,
                               const kmp_asked_inputs *inputs, const int *place, int outputs, const kmp_seen *seen)
{
    int n = linear->n, m = linear->m, p = linear->p, columns = 0;
    for (int i = 0; i < inputs->count; i++)
        columns += orders(inputs->input[i].kind);
    kmp_transfer *t = transfer;
    kmp_arena a = {0};
    *t = (kmp_transfer){.linear = linear,
                        .slopes = slopes,
                        .n = n,
                        .m = m,
                        .p = p,
                        .inputs = inputs,
                        .outputs = outputs,
                        .columns = columns,
                        .seen = KMP_ARENA_NEW(&a, kmp_seen, outputs),
                        .load = KMP_ARENA_NEW(&a, kmp_load, columns),
                        .map = KMP_ARENA_NEW(&a, double, n *p),
                        .map_rate = KMP_ARENA_NEW(&a, double, n *p),
                        .loads = KMP_ARENA_NEW(&a, double, p *columns),
                        .by_u = KMP_ARENA_NEW(&a, double, outputs *p),
                        .by_ud = KMP_ARENA_NEW(&a, double, outputs *p),
                        .by_udd = KMP_ARENA_NEW(&a, double, outputs *p),
                        .direct = KMP_ARENA_NEW(&a, double, outputs *columns),
                        .value = KMP_ARENA_NEW(&a, double, outputs),
                        .change = KMP_ARENA_NEW(&a, double, 3 * m + 2 * n + 3 * p + slopes->count),
                        .moved = KMP_ARENA_NEW(&a, double, 3 * n + m + p),
                        .shown = KMP_ARENA_NEW(&a, double, slopes->shown)};
    t->arena = a;
    if (a.failed)
        return kmp_fail_memory(linear->system->context);
    memcpy(t->seen, seen, (size_t)outputs * sizeof *seen);
    list_loads(t, place);
    return KEMPE_OK;
}

void kmp_transfer_free(kmp_transfer *transfer)
{
    kmp_arena_free(&transfer->arena);
    *transfer = (kmp_transfer){0};
}

/* -- at a state -------------------------------------------------------------------------------------- */

/* The parts of the room for a change and for what follows of it. */
typedef struct parts {
    double *h, *rate, *curve, *force, *u, *ud, *udd, *parameters;
    double *q, *qd, *qdd, *lambda, *residual;
} parts;

static parts parts_of(const kmp_transfer *t)
{
    int n = t->n, m = t->m, p = t->p;
    double *c = t->change, *r = t->moved;
    return (parts){.h = c,
                   .rate = c + m,
                   .curve = c + 2 * m,
                   .force = c + 3 * m,
                   .u = c + 3 * m + n,
                   .ud = c + 3 * m + n + p,
                   .udd = c + 3 * m + n + 2 * p,
                   .parameters = c + 3 * m + n + 3 * p,
                   .q = r,
                   .qd = r + n,
                   .qdd = r + 2 * n,
                   .lambda = r + 3 * n,
                   .residual = r + 3 * n + m};
}

static void clear(kmp_transfer *t)
{
    memset(t->change, 0, (size_t)(3 * t->m + t->n + 3 * t->p + t->slopes->count) * sizeof *t->change);
}

/* What follows of the change at hand: dR, and the outputs into out. */
static void follow(kmp_transfer *t, double *residual, double *out)
{
    parts x = parts_of(t);
    kmp_linear_follow(t->linear, &(kmp_change){x.u, x.ud, x.udd, x.h, x.rate, x.curve, x.force},
                      &(kmp_response){x.q, x.qd, x.qdd, x.lambda, x.residual});
    if (residual)
        memcpy(residual, x.residual, (size_t)t->p * sizeof *residual);
    kmp_direction along = {.q = x.q, .qd = x.qd, .qdd = x.qdd, .lambda = x.lambda, .parameters = x.parameters};
    kmp_slopes_outputs_along(t->slopes, &along, t->shown);
    const double *in[] = {x.q, x.qd, x.qdd, x.lambda, t->shown};
    for (int k = 0; k < t->outputs; k++)
        out[k] = in[t->seen[k].in][t->seen[k].index];
}

/* d(position of the point)/dq along the axis, less: what the force takes from R. */
static void push(kmp_transfer *t, const kmp_load *load, double *force)
{
    kmp_direction by = {.q = force};
    memset(t->shown, 0, (size_t)t->slopes->shown * sizeof *t->shown);
    t->shown[load->place + t->inputs->input[load->input].axis] = -1;
    kmp_slopes_outputs_gradient(t->slopes, t->shown, &by);
}

/* h = q - f(t) of a drive, f with a little more. */
static void drive(const kmp_transfer *t, const kmp_load *load, double *rows)
{
    for (int r = 0; r < t->m; r++)
        if (t->linear->system->rows[r].closure == t->inputs->input[load->input].index)
            rows[r] = -1;
}

static void set_load(kmp_transfer *t, const kmp_load *load)
{
    parts x = parts_of(t);
    clear(t);
    switch (t->inputs->input[load->input].kind) {
    case KMP_ASKED_EFFORT:
        x.force[t->inputs->input[load->input].index] = -1;
        return;
    case KMP_ASKED_FORCE:
        push(t, load, x.force);
        return;
    case KMP_ASKED_DRIVE:
        drive(t, load, x.h + load->order * t->m);
        return;
    case KMP_ASKED_PARAMETER:
        kmp_slopes_of_parameter(t->slopes, load->parameter, x.h, x.rate, x.curve, x.force);
        x.parameters[load->parameter] = 1;
        return;
    }
}

static void take_values(kmp_transfer *t)
{
    const kmp_linear *l = t->linear;
    kmp_instant at = kmp_linear_instant(l);
    kmp_slopes_at(t->slopes, &at);
    const double *shown = kmp_slopes_outputs(t->slopes, &at);
    const double *in[] = {l->q, l->qd, l->qdd, l->lambda, shown};
    for (int k = 0; k < t->outputs; k++)
        t->value[k] = in[t->seen[k].in][t->seen[k].index];
}

void kmp_transfer_eval(kmp_transfer *transfer)
{
    kmp_transfer *t = transfer;
    parts x = parts_of(t);
    int n = t->n, p = t->p, outputs = t->outputs;
    take_values(t);
    for (int k = 0; k < p; k++) {
        clear(t);
        x.u[k] = 1;
        follow(t, t->linear->stiffness + k * p, t->by_u + k * outputs);
        memcpy(t->map + k * n, x.q, (size_t)n * sizeof *x.q);
        memcpy(t->map_rate + k * n, x.qd, (size_t)n * sizeof *x.qd);
        clear(t);
        x.ud[k] = 1;
        follow(t, t->linear->damping + k * p, t->by_ud + k * outputs);
        clear(t);
        x.udd[k] = 1;
        follow(t, t->linear->mass + k * p, t->by_udd + k * outputs);
    }
    kmp_linear_inertia(t->linear);
    for (int k = 0; k < t->columns; k++) {
        set_load(t, &t->load[k]);
        follow(t, t->loads + k * p, t->direct + k * outputs);
    }
}

bool kmp_transfer_moves_closures(const kmp_transfer *transfer, int input)
{
    const kmp_slope_matrix *x = &transfer->slopes->equations;
    for (int c = 0; c < transfer->columns; c++) {
        const kmp_load *load = &transfer->load[c];
        if (load->input != input || load->parameter < 0)
            continue;
        for (int e = x->start[load->parameter]; e < x->start[load->parameter + 1]; e++)
            if (x->entry[e].row < transfer->m)
                return true;
    }
    return false;
}

/* -- first order ------------------------------------------------------------------------------------- */

/* to (rows x count) += left (rows x p) right (p x count, leading dimension ld). */
static void add_product(int rows, int p, int count, const double *left, const double *right, int ld, double *to)
{
    for (int j = 0; j < count; j++)
        for (int k = 0; k < p; k++)
            for (int i = 0; i < rows; i++)
                to[i + j * rows] += left[i + k * rows] * right[k + j * ld];
}

/* Mr^-1, by Cholesky where no force depends on multipliers and by LU otherwise: then Mr is not symmetric. */
typedef struct divisor {
    double *factor;
    int *pivot; /* of LU; NULL */
} divisor;

static int factor_mass(const kmp_linear *l, divisor *d)
{
    size_t size = (size_t)l->p * (size_t)l->p * sizeof(double);
    if (!d->pivot)
        return kmp_cholesky_factor(l->p, memcpy(d->factor, l->mass, size));
    int failed = kmp_cholesky_factor(l->p, memcpy(d->factor, l->inertia, size));
    return failed ? failed : kmp_lu_factor(l->p, memcpy(d->factor, l->mass, size), d->pivot) ? -2 : 0;
}

/* The lower half of a column: -Mr^-1 of the column of a p x count matrix. */
static void put_accelerations(int p, const divisor *mass, int count, const double *from, double *to)
{
    for (int j = 0; j < count; j++) {
        double *column = to + j * 2 * p + p;
        for (int i = 0; i < p; i++)
            column[i] = -from[i + j * p];
        if (mass->pivot)
            kmp_lu_solve(p, mass->factor, mass->pivot, 1, column);
        else
            kmp_cholesky_solve(p, mass->factor, column);
    }
}

int kmp_transfer_first_order(const kmp_transfer *transfer, double *a, double *b, double *c, double *d)
{
    const kmp_transfer *t = transfer;
    size_t p = (size_t)t->p, outputs = (size_t)t->outputs, columns = (size_t)t->columns;
    bool pressed = t->linear->inertia;
    divisor mass = {KMP_NEW(double, p *p), pressed ? KMP_NEW(int, p) : NULL};
    int failed = mass.factor && (mass.pivot || !pressed) ? factor_mass(t->linear, &mass) : -1;
    if (failed == 0) {
        memset(a, 0, 4 * p * p * sizeof *a);
        memset(b, 0, 2 * p * columns * sizeof *b);
        for (size_t k = 0; k < p; k++)
            a[k + (p + k) * 2 * p] = 1;
        put_accelerations(t->p, &mass, t->p, t->linear->stiffness, a);
        put_accelerations(t->p, &mass, t->p, t->linear->damping, a + 2 * p * p);
        put_accelerations(t->p, &mass, t->columns, t->loads, b);
        memcpy(c, t->by_u, outputs * p * sizeof *c);
        memcpy(c + outputs * p, t->by_ud, outputs * p * sizeof *c);
        memcpy(d, t->direct, outputs * columns * sizeof *d);
        add_product(t->outputs, t->p, 2 * t->p, t->by_udd, a + p, 2 * t->p, c);
        add_product(t->outputs, t->p, t->columns, t->by_udd, b + p, 2 * t->p, d);
    }
    kmp_free(mass.factor);
    kmp_free(mass.pivot);
    return failed;
}
