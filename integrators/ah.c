/* SPDX-License-Identifier: BSD-3-Clause */
/* The dae road in the AH form: the stabilised index-2 system of Gear, Gupta and Leimkuhler with its multipliers written
 * as derivatives of states (Hiller and Anantharaman), which lowers the index by one. Unknowns y = (q, v, L, N), lambda
 * = L', mu = N':
 *
 *     q' - v + J' mu = 0        Newton/Euler(q, v, v') - J' lambda = 0        h(q, t) = 0        J v + h_t = 0
 *
 * on the independent rows. The residual is the implicit recursion (Fisette and Samin 1996, eqs. 11-14, 25, 27) as one
 * program; its exact tangents, multiplier terms included, are another, in compressed columns. L and N are kept out of
 * every error norm by weights: their corrections never fall below rounding times the condition of the iteration matrix.
 */
#include "backend/machine.h"
#include "base/memory.h"
#include "integrators/effort.h"
#include "integrators/road.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Multiplies the error weights of L and N. */
#define OUT_OF_NORM 1e8

/* Sources of terms that are no tangent output: 1, and from FORCE downwards the tangents of the user's force. */
enum { ONE = -1, FORCE = -2 };

/* One term of the iteration matrix: entry `at` gets factor * (cj or 1) * its source. */
typedef struct term {
    long row, col;
    int at, source;
    bool cj;
    double factor;
} term;

typedef struct ah {
    kmp_road road; /* first */
    const kempe_system *s;
    kmp_plant *plant;
    const kmp_partition *part;
    kmp_saddle saddle;
    kmp_effort effort;
    kmp_program *residual_program, *tangent_program;
    kmp_machine *residual, *tangent;
    int n, m, r;
    long *col_start, *row;
    double *differential, *factor;
    term *terms;
    int term_count, term_capacity;
    double *lambda, *mu; /* m: spread over all rows */
} ah;

/* Unknowns by group. */
static int at_v(const ah *d)
{
    return d->n;
}
static int at_l(const ah *d)
{
    return 2 * d->n;
}
static int at_mu(const ah *d)
{
    return 2 * d->n + d->r;
}

/* -- programs ---------------------------------------------------------------------------------------- */

/* Tangent outputs gathered while the pattern of the matrix is built. */
typedef struct gather {
    ah *d;
    kmp_equations *eq;
    kmp_ref *outputs;
    int count, capacity;
    bool failed;
} gather;

static void add_term(gather *g, long row, long col, int source, bool cj, double factor)
{
    ah *d = g->d;
    if (d->term_count == d->term_capacity) {
        int capacity = d->term_capacity ? 2 * d->term_capacity : 256;
        term *terms = kmp_realloc(d->terms, (size_t)capacity, sizeof *terms);
        if (!terms) {
            g->failed = true;
            return;
        }
        d->terms = terms;
        d->term_capacity = capacity;
    }
    d->terms[d->term_count++] = (term){row, col, 0, source, cj, factor};
}

/* An expression as tangent output; its number, -1 when it is zero. */
static int output_of(gather *g, kmp_ref r)
{
    if (r == KMP_ZERO)
        return -1;
    if (g->count == g->capacity) {
        int capacity = g->capacity ? 2 * g->capacity : 256;
        kmp_ref *outputs = kmp_realloc(g->outputs, (size_t)capacity, sizeof *outputs);
        if (!outputs) {
            g->failed = true;
            return -1;
        }
        g->outputs = outputs;
        g->capacity = capacity;
    }
    g->outputs[g->count] = r;
    return g->count++;
}

static void add_entry(gather *g, long row, long col, kmp_ref r, bool cj, double factor)
{
    int source = output_of(g, r);
    if (source >= 0)
        add_term(g, row, col, source, cj, factor);
}

/* Derivatives of the n + n + 2 r equations by q[k] and qd[k]. */
static kempe_status add_partials(gather *g, int k, kmp_ref *column)
{
    ah *d = g->d;
    kmp_equations *eq = g->eq;
    kempe_status status = kmp_equations_partial(eq, KMP_IN_Q, k, d->n, eq->jt_mu, column);
    for (int i = 0; status == KEMPE_OK && i < d->n; i++)
        add_entry(g, i, k, column[i], false, 1);
    if (status == KEMPE_OK)
        status = kmp_equations_partial(eq, KMP_IN_Q, k, d->n, eq->residual, column);
    for (int i = 0; status == KEMPE_OK && i < d->n; i++)
        add_entry(g, d->n + i, k, column[i], false, 1);
    if (status == KEMPE_OK)
        status = kmp_equations_partial(eq, KMP_IN_QD, k, d->n, eq->residual, column);
    for (int i = 0; status == KEMPE_OK && i < d->n; i++)
        add_entry(g, d->n + i, at_v(d) + k, column[i], false, 1);
    if (status == KEMPE_OK)
        status = kmp_equations_partial(eq, KMP_IN_Q, k, d->m, eq->hdot, column);
    for (int i = 0; status == KEMPE_OK && i < d->r; i++)
        add_entry(g, 2 * d->n + d->r + i, k, column[d->part->rows[i]], false, 1);
    return status;
}

static void add_jacobian(gather *g)
{
    ah *d = g->d;
    for (int i = 0; i < d->r; i++)
        for (int k = 0; k < d->n; k++) {
            int source = output_of(g, g->eq->jacobian[d->part->rows[i] * d->n + k]);
            if (source < 0)
                continue;
            add_term(g, 2 * d->n + i, k, source, false, 1);                  /* h by q */
            add_term(g, 2 * d->n + d->r + i, at_v(d) + k, source, false, 1); /* J v by v */
            add_term(g, k, at_mu(d) + i, source, true, 1);                   /* J' mu by N' */
            add_term(g, d->n + k, at_l(d) + i, source, true, -1);            /* -J' lambda by L' */
        }
}

static void add_mass(gather *g)
{
    ah *d = g->d;
    for (int i = 0; i < d->n; i++)
        for (int k = 0; k <= i; k++) {
            int source = output_of(g, g->eq->mass[i * d->n + k]);
            if (source < 0)
                continue;
            add_term(g, d->n + i, at_v(d) + k, source, true, 1);
            if (i != k)
                add_term(g, d->n + k, at_v(d) + i, source, true, 1);
        }
}

static void add_force(gather *g)
{
    ah *d = g->d;
    int n = d->n;
    for (int k = 0; k < 2 * n && d->effort.plant; k++)
        for (int i = 0; i < n; i++)
            add_term(g, n + i, k < n ? k : at_v(d) + k - n, FORCE - (i + k * n), false, -1);
}

static kempe_status gather_tangents(gather *g)
{
    ah *d = g->d;
    kempe_status status = KEMPE_OK;
    kmp_ref *column = KMP_NEW(kmp_ref, d->n + d->m);
    if (!column)
        return kmp_fail_memory(d->s->context);
    for (int k = 0; k < d->n && status == KEMPE_OK; k++) {
        add_term(g, k, k, ONE, true, 1);
        add_term(g, k, at_v(d) + k, ONE, false, -1);
        status = add_partials(g, k, column);
    }
    kmp_free(column);
    add_jacobian(g);
    add_mass(g);
    add_force(g);
    return g->failed ? kmp_fail_memory(d->s->context) : status;
}

static int by_column(const void *a, const void *b)
{
    const term *x = a, *y = b;
    if (x->col != y->col)
        return x->col < y->col ? -1 : 1;
    if (x->row != y->row)
        return x->row < y->row ? -1 : 1;
    return x->source - y->source;
}

/* Compressed columns of the union of all terms. */
static bool compress(ah *d)
{
    int size = d->road.size, nz = 0;
    d->col_start = KMP_NEW(long, size + 1);
    d->row = KMP_NEW(long, d->term_count);
    if (!d->col_start || !d->row)
        return false;
    qsort(d->terms, (size_t)d->term_count, sizeof *d->terms, by_column);
    for (int k = 0; k < d->term_count; k++) {
        term *t = &d->terms[k];
        bool again = k > 0 && t[-1].col == t->col && t[-1].row == t->row;
        t->at = again ? nz - 1 : nz++;
        d->row[t->at] = t->row;
        d->col_start[t->col + 1] = nz;
    }
    for (int c = 1; c <= size; c++)
        if (d->col_start[c] == 0)
            d->col_start[c] = d->col_start[c - 1];
    d->road.dae.nz = nz;
    return true;
}

static bool residual_program(ah *d, kmp_equations *eq)
{
    int count = 2 * d->n + 2 * d->m;
    kmp_ref *out = KMP_NEW(kmp_ref, count);
    if (!out)
        return false;
    memcpy(out, eq->jt_mu, (size_t)d->n * sizeof *out);
    memcpy(out + d->n, eq->residual, (size_t)d->n * sizeof *out);
    memcpy(out + 2 * d->n, eq->h, (size_t)d->m * sizeof *out);
    memcpy(out + 2 * d->n + d->m, eq->hdot, (size_t)d->m * sizeof *out);
    const kmp_ref *group = out;
    d->residual_program = kmp_program_new(eq->graph, 1, &count, &group);
    kmp_free(out);
    return d->residual_program;
}

static kempe_status make_programs(ah *d)
{
    kmp_equations eq;
    kempe_status status = kmp_equations_init(&eq, d->s->model, KMP_SET_MASS | KMP_SET_CLOSURE | KMP_SET_RESIDUAL,
                                             KMP_SCHEME_COMPOSITE, false);
    if (status != KEMPE_OK)
        return status;
    gather g = {.d = d, .eq = &eq};
    bool ok = residual_program(d, &eq);
    status = ok ? gather_tangents(&g) : KEMPE_OK;
    if (ok && status == KEMPE_OK) {
        const kmp_ref *group = g.outputs;
        d->tangent_program = kmp_program_new(eq.graph, 1, &g.count, &group);
        ok = d->tangent_program && compress(d);
    }
    kmp_free(g.outputs);
    kmp_equations_free(&eq);
    return ok ? status : kmp_fail_memory(d->s->context);
}

static bool make_machines(ah *d)
{
    const kmp_backend *backend = kmp_backend_find("tape");
    d->residual = kmp_machine_new(d->residual_program, backend);
    d->tangent = kmp_machine_new(d->tangent_program, backend);
    if (!d->residual || !d->tangent)
        return false;
    kmp_machine_set(d->residual, KMP_IN_PARAMETER, d->s->parameters);
    kmp_machine_set(d->tangent, KMP_IN_PARAMETER, d->s->parameters);
    (void)kmp_machine_run(d->residual, 0);
    (void)kmp_machine_run(d->tangent, 0);
    return true;
}

/* -- the DAE ----------------------------------------------------------------------------------------- */

static void set_inputs(ah *d, kmp_machine *machine, double t, const double *y, const double *yp)
{
    for (int i = 0; i < d->r; i++) {
        d->lambda[d->part->rows[i]] = yp[at_l(d) + i];
        d->mu[d->part->rows[i]] = yp[at_mu(d) + i];
    }
    kmp_machine_set(machine, KMP_IN_TIME, &t);
    kmp_machine_set(machine, KMP_IN_Q, y);
    kmp_machine_set(machine, KMP_IN_QD, y + at_v(d));
    kmp_machine_set(machine, KMP_IN_QDD, yp + at_v(d));
    kmp_machine_set(machine, KMP_IN_LAMBDA, d->lambda);
    kmp_machine_set(machine, KMP_IN_MU, d->mu);
}

static int residual(void *self, double t, const double *y, const double *yp, double *r)
{
    ah *d = self;
    int n = d->n;
    set_inputs(d, d->residual, t, y, yp);
    const double *out = kmp_machine_run(d->residual, 1);
    for (int i = 0; i < n; i++) {
        r[i] = yp[i] - y[n + i] + out[i];
        r[n + i] = out[n + i];
    }
    kmp_effort_subtract(&d->effort, t, y, y + n, r + n);
    for (int i = 0; i < d->r; i++) {
        r[2 * n + i] = out[2 * n + d->part->rows[i]];
        r[2 * n + d->r + i] = out[2 * n + d->m + d->part->rows[i]];
    }
    for (int i = 0; i < d->road.size; i++)
        if (!isfinite(r[i]))
            return KMP_RETRY;
    return KMP_GO;
}

static double value_of(const ah *d, int source, const double *out)
{
    if (source >= 0)
        return out[source];
    return source == ONE ? 1 : d->effort.tangent[FORCE - source];
}

static int matrix(void *self, double t, double cj, const double *y, const double *yp, double *values)
{
    ah *d = self;
    set_inputs(d, d->tangent, t, y, yp);
    const double *out = kmp_machine_run(d->tangent, 1);
    kmp_effort_differentiate(&d->effort, t, y, y + d->n);
    memset(values, 0, (size_t)d->road.dae.nz * sizeof *values);
    for (int k = 0; k < d->term_count; k++) {
        const term *e = &d->terms[k];
        values[e->at] += e->factor * (e->cj ? cj : 1) * value_of(d, e->source, out);
    }
    return KMP_GO;
}

static void position(kmp_road *road, double t, const double *y, double *q)
{
    (void)t;
    memcpy(q, y, (size_t)((ah *)road)->n * sizeof *q);
}

/* Rows are what the integrator holds; accelerations and multipliers come from the saddle system there. */
static int row(kmp_road *road, double t, const double *y, const double *yp, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    ah *d = (ah *)road;
    (void)yp;
    memcpy(q, y, (size_t)d->n * sizeof *q);
    memcpy(qd, y + d->n, (size_t)d->n * sizeof *qd);
    kmp_plant_closure(d->plant, t, q);
    kmp_plant_mass(d->plant);
    kmp_plant_bias(d->plant, qd);
    if (kmp_saddle_factor(&d->saddle)) {
        kmp_text_printf(&road->reason, "accelerations and multipliers are not determined at the output time t = %.9g",
                        t);
        return KMP_HALT;
    }
    kmp_saddle_accelerations(&d->saddle, qdd, lambda);
    *work = 0;
    return KMP_GO;
}

/* -- making one -------------------------------------------------------------------------------------- */

static void release(kmp_road *road)
{
    ah *d = (ah *)road;
    kmp_saddle_free(&d->saddle);
    kmp_effort_free(&d->effort);
    kmp_machine_free(d->residual);
    kmp_machine_free(d->tangent);
    kmp_program_free(d->residual_program);
    kmp_program_free(d->tangent_program);
    kmp_text_free(&road->reason);
    kmp_free(road->y);
    kmp_free(road->yp);
    kmp_free(road->atol);
    kmp_free(d->col_start);
    kmp_free(d->row);
    kmp_free(d->differential);
    kmp_free(d->factor);
    kmp_free(d->terms);
    kmp_free(d->lambda);
    kmp_free(d->mu);
    kmp_free(d);
}

static bool allocate(ah *d)
{
    int size = d->road.size;
    d->road.y = KMP_NEW(double, size);
    d->road.yp = KMP_NEW(double, size);
    d->road.atol = KMP_NEW(double, size);
    d->differential = KMP_NEW(double, size);
    d->factor = KMP_NEW(double, size);
    d->lambda = KMP_NEW(double, d->m);
    d->mu = KMP_NEW(double, d->m);
    return d->road.y && d->road.yp && d->road.atol && d->differential && d->factor && d->lambda && d->mu &&
           kmp_effort_init(&d->effort, d->plant) && kmp_saddle_init(&d->saddle, d->plant, d->part);
}

static void begin(ah *d, const kmp_road_start *start)
{
    int n = d->n;
    for (int i = 0; i < n; i++) {
        d->road.y[i] = start->q[i];
        d->road.y[n + i] = d->road.yp[i] = start->qd[i];
        d->road.yp[n + i] = start->qdd[i];
        d->road.atol[i] = start->atol * d->s->scale[i];
        d->road.atol[n + i] = d->road.atol[i] * start->rate_scale;
    }
    for (int i = 0; i < d->r; i++)
        d->road.yp[at_l(d) + i] = start->lambda[d->part->rows[i]];
    for (int i = 0; i < d->road.size; i++) {
        d->differential[i] = 1;
        d->factor[i] = i < 2 * n ? 1 : OUT_OF_NORM;
        if (i >= 2 * n)
            d->road.atol[i] = start->atol;
    }
}

static kmp_road *create(const kmp_road_start *start)
{
    ah *d = KMP_NEW(ah, 1);
    if (!d) {
        (void)kmp_fail_memory(start->system->context);
        return NULL;
    }
    d->s = start->system;
    d->plant = start->plant;
    d->part = start->part;
    d->n = start->part->n;
    d->m = start->part->m;
    d->r = start->part->r;
    d->road.release = release;
    d->road.row = row;
    d->road.position = position;
    d->road.size = 2 * d->n + 2 * d->r;
    if (!allocate(d)) {
        (void)kmp_fail_memory(d->s->context);
    } else if (make_programs(d) == KEMPE_OK) {
        if (make_machines(d)) {
            begin(d, start);
            d->road.dae = (kmp_dae){.n = d->road.size,
                                    .nz = d->road.dae.nz,
                                    .col_start = d->col_start,
                                    .row = d->row,
                                    .differential = d->differential,
                                    .factor = d->factor,
                                    .self = d,
                                    .residual = residual,
                                    .matrix = matrix};
            return &d->road;
        }
        (void)kmp_fail_memory(d->s->context);
    }
    release(&d->road);
    return NULL;
}

const kmp_road_kind kmp_road_ah = {.road = "dae", .form = "ah", .dae = true, .standard = true, .create = create};
