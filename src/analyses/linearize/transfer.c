/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/linearize/transfer.h"
#include "analyses/derivatives/sampled_motion.h"
#include "base/memory.h"
#include "linalg/dense/dense.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "output/print.h"
#include <math.h>
#include <string.h>

/* -- construction ------------------------------------------------------------------------------------ */

int kmp_transfer_orders(const kempe_model *model, const kmp_requested_input *input)
{
    bool moves = input->kind == KMP_REQUESTED_INPUT && kmp_model_moved_by(model, input->index);
    return moves || input->kind == KMP_REQUESTED_DRIVE ? 3 : 1;
}

kempe_status kmp_transfer_init(kmp_transfer *t, kmp_linear *linear, kmp_slopes *slopes,
                               const kmp_requested_inputs *inputs, const int *place, int outputs,
                               const kmp_output_source *source)
{
    ptrdiff_t n = linear->n, m = linear->m, p = linear->p, columns = 0;
    for (int i = 0; i < inputs->count; i++)
        columns += kmp_transfer_orders(linear->system->model, &inputs->input[i]);
    *t = (kmp_transfer){.linear = linear,
                        .slopes = slopes,
                        .n = linear->n,
                        .m = linear->m,
                        .p = linear->p,
                        .inputs = inputs,
                        .outputs = outputs,
                        .columns = (int)columns};
    t->source = KMP_ARENA_NEW(&t->arena, kmp_output_source, outputs);
    t->load = KMP_ARENA_NEW(&t->arena, kmp_load, columns);
    KMP_TRY(
        kmp_made(linear->system->context,
                 KMP_ARENA_MAKE(&t->arena, KMP_ROOM(double, n *p, &t->map, &t->map_rate),
                                KMP_ROOM(double, p *columns, &t->loads),
                                KMP_ROOM(double, outputs *p, &t->by_u, &t->by_ud, &t->by_udd),
                                KMP_ROOM(double, outputs *columns, &t->direct), KMP_ROOM(double, outputs, &t->value),
                                KMP_ROOM(double, 3 * m + n, &t->side), KMP_ROOM(double, 3 * n + m, &t->moved),
                                KMP_ROOM(double, p, &t->unit), KMP_ROOM(double, slopes->shown, &t->shown))));
    memcpy(t->source, source, (size_t)outputs * sizeof *source);
    int at = 0;
    for (int i = 0; i < t->inputs->count; i++) {
        const kmp_requested_input *input = &t->inputs->input[i];
        for (int order = 0; order < kmp_transfer_orders(t->linear->system->model, input); order++)
            t->load[at++] =
                (kmp_load){.input = i,
                           .order = order,
                           .parameter = (input->kind == KMP_REQUESTED_PARAMETER || input->kind == KMP_REQUESTED_INPUT)
                                            ? place[i] + order
                                            : -1,
                           .place = input->kind == KMP_REQUESTED_FORCE ? place[i] : -1};
    }
    return KEMPE_OK;
}

KMP_CLEARS(kmp_transfer, transfer, kmp_arena_free(&transfer->arena))

/* -- at a state -------------------------------------------------------------------------------------- */

static void see(const kmp_transfer *t, const double *q, const double *qd, const double *qdd, const double *lambda,
                const double *shown, double *out)
{
    const double *in[] = {q, qd, qdd, lambda, shown};
    for (int k = 0; k < t->outputs; k++)
        out[k] = in[t->source[k].in][t->source[k].index];
}

/* The response to a change, including parameter k (-1: none): dR, and the outputs into out. */
static void follow(kmp_transfer *t, const kmp_change *change, int k, double *residual, double *out)
{
    double *q = t->moved, *qd = q + t->n, *qdd = qd + t->n, *lambda = qdd + t->n;
    kmp_linear_follow(t->linear, change, &(kmp_response){q, qd, qdd, lambda, residual});
    kmp_slopes_along(t->slopes, &t->slopes->outputs, &(kmp_direction){NULL, q, qd, qdd, lambda, NULL}, k, t->shown);
    see(t, q, qd, qdd, lambda, t->shown, out);
}

static void follow_load(kmp_transfer *t, const kmp_load *load, double *residual, double *out)
{
    int m = t->m;
    const kmp_requested_input *input = &t->inputs->input[load->input];
    double *h = t->side, *force = h + 3 * m;
    memset(h, 0, (size_t)(3 * m + t->n) * sizeof *h);
    switch (input->kind) {
    case KMP_REQUESTED_EFFORT:
        force[input->index] = -1;
        break;
    case KMP_REQUESTED_FORCE: /* to R: d(position of the point)/dq along the axis, negative */
        memset(t->shown, 0, (size_t)t->slopes->shown * sizeof *t->shown);
        t->shown[load->place + input->axis] = -1;
        kmp_slopes_gradient(t->slopes, &t->slopes->outputs, t->shown, &(kmp_direction){.q = force});
        break;
    case KMP_REQUESTED_DRIVE: /* h = q - f(t), f with a little more */
        for (int r = 0; r < m; r++)
            if (t->linear->system->rows[r].closure == input->index)
                h[load->order * m + r] = -1;
        break;
    case KMP_REQUESTED_INPUT:
    case KMP_REQUESTED_PARAMETER:
        (void)kmp_slopes_change(t->slopes, load->parameter, h);
        break;
    }
    follow(t, &(kmp_change){.h = h, .rate = h + m, .curve = h + 2 * m, .force = force}, load->parameter, residual, out);
}

/* A held state y follows a parameter of its start value at once: from its row g y + l w = 0 into the other rows. */
static void follow_held(const kmp_transfer *t, double *load, double *direct)
{
    const kmp_linear *l = t->linear;
    const int p = t->p;
    for (int k = 0; k < p; k++) {
        const kmp_state *state = kmp_state_of(l->system->model, l->part.u[k]);
        if (!state || !state->held || load[k] == 0)
            continue;
        const double y = -load[k] / l->damping[k + k * p];
        load[k] = 0;
        for (int i = 0; i < p; i++)
            load[i] += i == k ? 0 : l->damping[i + k * p] * y;
        for (int i = 0; i < t->outputs; i++)
            direct[i] += t->by_ud[i + k * t->outputs] * y;
    }
}

void kmp_transfer_eval(kmp_transfer *t)
{
    int n = t->n, p = t->p, outputs = t->outputs;
    double *unit = t->unit;
    const kmp_linear *l = t->linear;
    kmp_instant at = kmp_linear_instant(l);
    kmp_slopes_at(t->slopes, &at);
    see(t, l->q, l->qd, l->qdd, l->lambda, kmp_slopes_values(&t->slopes->outputs, &at), t->value);
    for (int k = 0; k < p; k++) {
        unit[k] = 1;
        follow(t, &(kmp_change){.u = unit}, -1, t->linear->stiffness + k * p, t->by_u + k * outputs);
        memcpy(t->map + k * n, t->moved, (size_t)n * sizeof *unit);
        memcpy(t->map_rate + k * n, t->moved + n, (size_t)n * sizeof *unit);
        follow(t, &(kmp_change){.ud = unit}, -1, t->linear->damping + k * p, t->by_ud + k * outputs);
        follow(t, &(kmp_change){.udd = unit}, -1, t->linear->mass + k * p, t->by_udd + k * outputs);
        unit[k] = 0;
    }
    kmp_linear_inertia(t->linear);
    for (int k = 0; k < t->columns; k++) {
        follow_load(t, &t->load[k], t->loads + k * p, t->direct + k * outputs);
        follow_held(t, t->loads + k * p, t->direct + k * outputs);
    }
}

bool kmp_transfer_moves_closures(const kmp_transfer *transfer, int input)
{
    const kmp_slope_matrix *x = &transfer->slopes->equations;
    for (int c = 0; c < transfer->columns; c++) {
        const kmp_load *load = &transfer->load[c];
        if (load->input != input || transfer->inputs->input[input].kind != KMP_REQUESTED_PARAMETER)
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

/* LU of Mr, where N' M N is positive. */
static int factor_mass(const kmp_linear *l, double *factor, int *pivot)
{
    size_t size = (size_t)l->p * (size_t)l->p * sizeof *factor;
    int failed = kmp_cholesky_factor(l->p, memcpy(factor, l->inertia ? l->inertia : l->mass, size));
    return failed ? failed : kmp_lu_factor(l->p, memcpy(factor, l->mass, size), pivot) ? -2 : 0;
}

/* The lower half of a column: -Mr^-1 of the column of a p x count matrix. */
static void put_accelerations(int p, const double *factor, const int *pivot, int count, const double *from, double *to)
{
    for (int j = 0; j < count; j++) {
        double *column = to + j * 2 * p + p;
        for (int i = 0; i < p; i++)
            column[i] = -from[i + j * p];
        kmp_lu_solve(p, factor, pivot, 1, column);
    }
}

/* Number k of u is one of those of x in the half of positions, or in that of rates and values of states. */
static bool is_in(const kmp_linear *l, int k, int half)
{
    const kmp_state *state = kmp_state_of(l->system->model, l->part.u[k]);
    return !state || (half == 1 && !state->held);
}

int kmp_transfer_width(const kmp_transfer *transfer)
{
    int width = 0;
    for (int k = 0; k < 2 * transfer->p; k++)
        width += is_in(transfer->linear, k % transfer->p, k / transfer->p);
    return width;
}

int kmp_transfer_state(const kmp_transfer *transfer, int k)
{
    const int p = transfer->p;
    int from = 0;
    while (!is_in(transfer->linear, from % p, from / p) || k-- > 0)
        from++;
    return from;
}

int kmp_transfer_first_order(const kmp_transfer *t, double *a, double *b, double *c, double *d)
{
    size_t p = (size_t)t->p, outputs = (size_t)t->outputs, columns = (size_t)t->columns;
    const int width = kmp_transfer_width(t);
    double *mass = KMP_NEW(double, p *p);
    int *pivot = KMP_NEW(int, p), *place = KMP_NEW(int, width);
    int failed = mass && pivot && place ? factor_mass(t->linear, mass, pivot) : -1;
    if (failed == 0) {
        memset(a, 0, 4 * p * p * sizeof *a);
        memset(b, 0, 2 * p * columns * sizeof *b);
        for (size_t k = 0; k < p; k++)
            a[k + (p + k) * 2 * p] = 1;
        put_accelerations(t->p, mass, pivot, t->p, t->linear->stiffness, a);
        put_accelerations(t->p, mass, pivot, t->p, t->linear->damping, a + 2 * p * p);
        put_accelerations(t->p, mass, pivot, t->columns, t->loads, b);
        memcpy(c, t->by_u, outputs * p * sizeof *c);
        memcpy(c + outputs * p, t->by_ud, outputs * p * sizeof *c);
        memcpy(d, t->direct, outputs * columns * sizeof *d);
        add_product(t->outputs, t->p, 2 * t->p, t->by_udd, a + p, 2 * t->p, c);
        add_product(t->outputs, t->p, t->columns, t->by_udd, b + p, 2 * t->p, d);
        for (int k = 0; k < width; k++)
            place[k] = kmp_transfer_state(t, k);
        kmp_linear_squeeze(2 * t->p, width, place, width, place, a, a);
        kmp_linear_squeeze(2 * t->p, width, place, t->columns, NULL, b, b);
        kmp_linear_squeeze(t->outputs, t->outputs, NULL, width, place, c, c);
    }
    kmp_free(mass);
    kmp_free(pivot);
    kmp_free(place);
    return failed;
}

int kmp_transfer_sample(const kmp_transfer *t, double *a, double *b, double *period)
{
    const kmp_linear *l = t->linear;
    int width = kmp_transfer_width(t);
    double *every = KMP_NEW(double, width);
    for (int i = 0; every && i < width; i++) {
        int place = kmp_transfer_state(t, i) - t->p;
        const kmp_state *state = place >= 0 ? kmp_state_of(l->system->model, l->part.u[place]) : NULL;
        every[i] = state && kmp_state_is_sampled(state) ? state->period : INFINITY;
    }
    int failed = every ? kmp_sampled_map(width, t->columns, a, b, every, period, a, b) : -1;
    kmp_free(every);
    return failed;
}
