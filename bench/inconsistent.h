/* SPDX-License-Identifier: BSD-3-Clause */
/* Starts that do not close: coordinates and rates of closed ones, pushed off by known amounts, against what a Newton's
 * method of least norm of the bench's own makes of them, in long double and with a Gram-Schmidt of its own. */
#ifndef KEMPE_BENCH_INCONSISTENT_H
#define KEMPE_BENCH_INCONSISTENT_H

#include "bench/battery.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "model/data/start.h"
#include <kempe/check.h>

typedef struct push_case {
    const char *name, *model;
} push_case;

static const push_case push_cases[] = {
    {"four-bar", "examples/four_bar/four_bar.yaml"},
    {"spatial slider-crank", "examples/spatial_slider_crank/spatial_slider_crank.yaml"},
    {"Stewart", "examples/stewart/stewart.yaml"},
    {"Bricard, a row redundant", "examples/bricard/bricard.yaml"},
    {"Bennett, three redundant", "tests/models/bennett_balls.yaml"}};
enum { PUSH_CASES = sizeof push_cases / sizeof *push_cases };

static const double push_sizes[] = {1e-3, 1e-2, 0.1};
enum { PUSH_SIZES = 3 };

typedef struct push_scene {
    hard_scene s;
    kmp_evaluator *eval;
    kmp_partition part;
    double *q, *qd; /* closed */
    double *given;  /* pushed off */
    double *own;    /* made good by the bench */
    unsigned random;
} push_scene;

static double push_random(push_scene *p)
{
    p->random = p->random * 1664525u + 1013904223u;
    return (double)(p->random >> 8) / (1 << 23) - 1;
}

/* x of least scaled norm with J x = -b on `rank` rows, the largest of what is left first; J at the evaluator's closure.
 */
static void push_least(const push_scene *p, int rank, const double *b, double *x)
{
    const kempe_system *s = p->s.system;
    int n = s->n, m = s->m;
    double *jac = KMP_NEW(double, m *n);
    long double *a = KMP_NEW(long double, (size_t)m *(size_t)n), *beta = KMP_NEW(long double, m);
    kmp_eval_dense_jacobian(p->eval, jac);
    for (int r = 0; r < m; r++) {
        beta[r] = -(long double)b[r] / s->row_scale[r];
        for (int k = 0; k < n; k++)
            a[r * n + k] = (long double)jac[r + k * m] * s->scale[k] / s->row_scale[r];
    }
    for (int k = 0; k < n; k++)
        x[k] = 0;
    for (int step = 0; step < rank; step++) {
        int best = 0;
        long double most = 0;
        for (int r = 0; r < m; r++) {
            long double size = 0;
            for (int k = 0; k < n; k++)
                size += a[r * n + k] * a[r * n + k];
            best = size > most ? r : best;
            most = size > most ? size : most;
        }
        long double *q = a + best * n, length = sqrtl(most), part = beta[best] / length;
        for (int k = 0; k < n; k++) {
            q[k] /= length;
            x[k] += (double)(part * q[k]) * s->scale[k];
        }
        for (int r = 0; r < m; r++) {
            long double along = 0;
            for (int k = 0; k < n && r != best; k++)
                along += a[r * n + k] * q[k];
            for (int k = 0; k < n && r != best; k++)
                a[r * n + k] -= along * q[k];
            beta[r] -= along * part;
        }
        for (int k = 0; k < n; k++)
            q[k] = 0;
    }
    kmp_free(jac);
    kmp_free(a);
    kmp_free(beta);
}

/* Largest difference, scaled. */
static double push_apart(const push_scene *p, const double *a, const double *b)
{
    double most = 0;
    for (int k = 0; k < p->s.system->n; k++) {
        double off = fabs(a[k] - b[k]) / p->s.system->scale[k];
        most = isfinite(off) ? fmax(most, off) : INFINITY;
    }
    return most;
}

/* The start that the model gives from now on. */
static void push_start(const push_scene *p, const double *q, const double *qd, bool hold_u)
{
    const kmp_start *start = kmp_model_start(p->s.model);
    for (int k = 0; k < p->s.system->n; k++) {
        start->q[k].value = q[k];
        start->qd[k].value = qd[k];
        start->hold[k] = false;
        start->qd_given[k] = true;
    }
    for (int k = 0; hold_u && k < p->part.p; k++)
        start->hold[p->part.u[k]] = true;
}

static bool push_load(push_scene *p, const char *root, const push_case *c)
{
    const hard_case scene = {.name = c->name, .model = c->model};
    kempe_assembly *assembly = NULL;
    *p = (push_scene){.random = 7};
    if (!hard_load(&p->s, root, &scene) || kempe_assembly_new(p->s.system, &assembly) != KEMPE_OK)
        return false;
    size_t n = (size_t)p->s.system->n;
    p->q = KMP_NEW(double, 4 * n);
    p->qd = p->q + n;
    p->given = p->q + 2 * n;
    p->own = p->q + 3 * n;
    memcpy(p->q, kempe_assembly_q(assembly), n * sizeof *p->q);
    memcpy(p->qd, kempe_assembly_qd(assembly), n * sizeof *p->qd);
    kempe_assembly_free(assembly);
    p->eval = kmp_eval_new(p->s.system, "tape");
    kmp_eval_closure(p->eval, 0, p->q);
    return kmp_partition_init(&p->part, p->s.system, p->eval->jacobian, NULL, 0) == KEMPE_OK;
}

static void push_unload(push_scene *p)
{
    kmp_partition_free(&p->part);
    kmp_eval_free(p->eval);
    kmp_free(p->q);
    hard_unload(&p->s);
}

/* With u held and v pushed off there is one closed state near: the one pushed off. */
static double push_held(push_scene *p, double size)
{
    kempe_assembly *assembly = NULL;
    double off = INFINITY;
    memcpy(p->given, p->q, (size_t)p->s.system->n * sizeof *p->given);
    for (int i = 0; i < p->part.r; i++)
        p->given[p->part.v[i]] += size * push_random(p) * p->s.system->scale[p->part.v[i]];
    push_start(p, p->given, p->qd, true);
    if (kempe_assembly_new(p->s.system, &assembly) == KEMPE_OK)
        off = push_apart(p, kempe_assembly_q(assembly), p->q);
    kempe_assembly_free(assembly);
    return off;
}

/* All pushed off, nothing held: as near as Newton's method of least norm comes, `distances` their distances from the
 * start.
 */
static double push_free(push_scene *p, double size, double distances[2])
{
    kempe_assembly *assembly = NULL;
    int n = p->s.system->n;
    double off = INFINITY, *x = KMP_NEW(double, n);
    for (int k = 0; k < n; k++)
        p->own[k] = p->given[k] = p->q[k] + size * push_random(p) * p->s.system->scale[k];
    for (int pass = 0; pass < 12; pass++) {
        kmp_eval_closure(p->eval, 0, p->own);
        push_least(p, p->part.r, p->eval->h, x);
        for (int k = 0; k < n; k++)
            p->own[k] += x[k];
    }
    kmp_free(x);
    push_start(p, p->given, p->qd, false);
    if (kempe_assembly_new(p->s.system, &assembly) == KEMPE_OK) {
        distances[0] = push_apart(p, kempe_assembly_q(assembly), p->given);
        distances[1] = push_apart(p, p->own, p->given);
        off = push_apart(p, kempe_assembly_q(assembly), p->own);
    }
    kempe_assembly_free(assembly);
    return off;
}

/* q closed, all rates given and none of them fitting: the least change that makes them fit, which is one alone. */
static double push_rates(push_scene *p, double size)
{
    kempe_assembly *assembly = NULL;
    const kempe_system *s = p->s.system;
    double off = INFINITY, fastest = 1, *x = KMP_NEW(double, s->n), *rate = KMP_NEW(double, s->m);
    for (int k = 0; k < s->n; k++)
        fastest = fmax(fastest, fabs(p->qd[k]) / s->scale[k]);
    for (int k = 0; k < s->n; k++)
        p->own[k] = p->given[k] = p->qd[k] + size * fastest * push_random(p) * s->scale[k];
    kmp_eval_closure(p->eval, 0, p->q);
    kmp_eval_rates(p->eval, p->given, rate);
    push_least(p, p->part.r, rate, x);
    for (int k = 0; k < s->n; k++)
        p->own[k] += x[k];
    push_start(p, p->q, p->given, true);
    if (kempe_assembly_new(p->s.system, &assembly) == KEMPE_OK)
        off = push_apart(p, kempe_assembly_qd(assembly), p->own) / fastest;
    kempe_assembly_free(assembly);
    kmp_free(x);
    kmp_free(rate);
    return off;
}

/* Both states near the start are closed ones, as near to it; the last steps of an assembly move v alone, so that they
 * may differ by a part of the way. */
static bool push_well(double size, double held, double loose, const double distances[2], double rates)
{
    return held < 1e-11 && loose <= 0.15 * size && distances[0] <= 1.2 * distances[1] && rates < 1e-12;
}

static bool push_run(const char *root, const push_case *c)
{
    push_scene p;
    bool well = push_load(&p, root, c);
    for (int k = 0; k < PUSH_SIZES; k++) {
        double size = push_sizes[k], distances[2] = {INFINITY, 0}, held = push_held(&p, size);
        double loose = push_free(&p, size, distances), rates = push_rates(&p, size);
        bool good = push_well(size, held, loose, distances, rates);
        printf("%-28s %s, off by %.0e: %.1e from the closed state with u held; %.1e from the nearest; rates %.1e  %s\n",
               "inconsistent start", c->name, size, held, loose, rates, good ? "pass" : "FAIL");
        well = well && good;
    }
    push_unload(&p);
    return well;
}

#endif
