/* SPDX-License-Identifier: BSD-3-Clause */
/* The public workspace: microseconds of a call at closed states beside the start, each call at another state than the
 * one before; and of a state among many, in one call with M, C, h, J and jdqd as rows. */
#include "bench.h"
#include <kempe/check.h>
#include <kempe/workspace.h>
#include <math.h>
#include <string.h>

enum { STATES = 16, SAMPLES = 9, MANY = 512 };

typedef struct scene {
    bench b;
    kempe_workspace *ws;
    int n;
    double *q, *qd, *beside; /* STATES x n; q a little off the closures */
    double *qdd, *Q, *lambda, *x;
    double *many_q, *many_qd; /* MANY x n: the states in turn */
    kempe_workspace_rows rows;
} scene;

typedef void call_fn(scene *s, int k);

static void check(const scene *s, kempe_status status)
{
    if (status == KEMPE_OK)
        return;
    fprintf(stderr, "%s\n", kempe_workspace_message(s->ws));
    exit(1);
}

static void evaluate(scene *s, int k)
{
    check(s, kempe_workspace_evaluate(s->ws, 0, s->q + k * s->n, s->qd + k * s->n));
}

static void forward(scene *s, int k)
{
    check(s, kempe_workspace_forward_dynamics(s->ws, 0, s->q + k * s->n, s->qd + k * s->n, NULL, s->qdd, s->lambda));
}

static void inverse(scene *s, int k)
{
    check(s, kempe_workspace_inverse_dynamics(s->ws, 0, s->q + k * s->n, s->qd + k * s->n, s->qd, s->Q));
}

static void close_loops(scene *s, int k)
{
    memcpy(s->x, s->beside + k * s->n, (size_t)s->n * sizeof *s->x);
    check(s, kempe_workspace_close(s->ws, 0, s->x, NULL, NULL));
}

static void put(double *rows, int width, int row, const double *values)
{
    memcpy(rows + row * width, values, (size_t)width * sizeof *rows);
}

static void each(scene *s, int k)
{
    (void)k;
    for (int i = 0; i < MANY; i++) {
        check(s, kempe_workspace_evaluate(s->ws, 0, s->many_q + i * s->n, s->many_qd + i * s->n));
        put(s->rows.mass, s->n * s->n, i, kempe_workspace_mass(s->ws));
        put(s->rows.bias, s->n, i, kempe_workspace_bias(s->ws));
        put(s->rows.h, s->b.system->m, i, kempe_workspace_h(s->ws));
        put(s->rows.jacobian, s->b.system->m * s->n, i, kempe_workspace_jacobian(s->ws));
        put(s->rows.jdqd, s->b.system->m, i, kempe_workspace_jdqd(s->ws));
    }
}

static void together(scene *s, int k)
{
    static const double t = 0;
    (void)k;
    check(s, kempe_workspace_evaluate_states(s->ws, MANY, &t, 0, s->many_q, s->many_qd, &s->rows, NULL));
}

/* us of a call: the median of samples of some milliseconds. */
static double time_of(scene *s, call_fn *call)
{
    double sample[SAMPLES];
    int times = STATES;
    for (int i = 0; i < SAMPLES; i++) {
        double took = 0;
        for (int done = 0;; times *= 2) {
            double from = bench_now();
            for (done = 0; done < times; done++)
                call(s, done % STATES);
            took = bench_now() - from;
            if (took > 2e-3)
                break;
        }
        sample[i] = 1e6 * took / times;
    }
    return bench_median(SAMPLES, sample);
}

/* Closed states beside the start, with rates. */
static void find_states(scene *s)
{
    kempe_assembly *a = NULL;
    if (kempe_assembly_new(s->b.system, &a) != KEMPE_OK) {
        fprintf(stderr, "%s\n", kempe_context_message(s->b.context));
        exit(1);
    }
    for (int k = 0; k < STATES; k++) {
        double *q = s->q + k * s->n, *qd = s->qd + k * s->n;
        for (int i = 0; i < s->n; i++) {
            q[i] = kempe_assembly_q(a)[i] + 0.002 * sin(k + i) * s->b.system->scale[i];
            qd[i] = kempe_assembly_qd(a)[i] + 0.1 * cos(k + i) * s->b.system->scale[i];
        }
        check(s, kempe_workspace_close(s->ws, 0, q, qd, NULL));
        for (int i = 0; i < s->n; i++)
            s->beside[k * s->n + i] = q[i] + 1e-3 * cos(k - i) * s->b.system->scale[i];
    }
    for (int k = 0; k < MANY; k++) {
        put(s->many_q, s->n, k, s->q + k % STATES * s->n);
        put(s->many_qd, s->n, k, s->qd + k % STATES * s->n);
    }
    kempe_assembly_free(a);
}

static double *room(int count)
{
    double *x = calloc((size_t)count + 1, sizeof *x);
    if (!x)
        exit(1);
    return x;
}

static void show(const char *name)
{
    char path[200];
    (void)snprintf(path, sizeof path, "examples/%s.yaml", name);
    scene s = {.b = bench_load(path)};
    if (kempe_workspace_new(s.b.system, &s.ws) != KEMPE_OK)
        exit(1);
    s.n = s.b.system->n;
    double **all[] = {&s.q, &s.qd, &s.beside, &s.qdd, &s.Q, &s.x};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        *all[k] = room(STATES * s.n);
    int n = s.n, m = s.b.system->m;
    s.lambda = room(m);
    s.many_q = room(MANY * n);
    s.many_qd = room(MANY * n);
    s.rows =
        (kempe_workspace_rows){room(MANY * n * n), room(MANY * n), room(MANY * m), room(MANY * m * n), room(MANY * m)};
    double *many[] = {s.lambda, s.many_q, s.many_qd, s.rows.mass, s.rows.bias, s.rows.jacobian, s.rows.h, s.rows.jdqd};
    find_states(&s);
    printf("%-34s %4d %4d %12.3f %12.3f %12.3f %12.3f %12.3f %12.3f\n", name, n, m, time_of(&s, evaluate),
           time_of(&s, forward), time_of(&s, inverse), time_of(&s, close_loops), time_of(&s, each) / MANY,
           time_of(&s, together) / MANY);
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        free(*all[k]);
    for (size_t k = 0; k < sizeof many / sizeof *many; k++)
        free(many[k]);
    kempe_workspace_free(s.ws);
    bench_free(&s.b);
}

int bench_workspace(int argc, char **argv)
{
    (void)argc, (void)argv;
    printf("microseconds of a call, of a state\n%-34s %4s %4s %12s %12s %12s %12s %12s %12s\n", "model", "n", "m",
           "evaluation", "forward", "inverse", "closing", "rows, each", "together");
    show("four_bar/four_bar");
    show("andrews/andrews");
    show("bennett/bennett");
    show("stewart/stewart");
    show("double_wishbone/double_wishbone");
    show("limousine/limousine");
    show("n_four_bar/n_four_bar_40");
    return 0;
}
