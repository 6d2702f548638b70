/* SPDX-License-Identifier: BSD-3-Clause */
/* Generated C beside the library at states of the motion: h, J, M, C and jdqd by the equations of a simulator, compiled
 * with -O2 and -O3, and by the programs of the library as machine code. The largest difference of an entry beside the
 * largest one of its array, and the least time of an evaluation. The exit code is 1 where a difference is above 1e-12.
 */
#include "bench.h"
#include "constraints/evaluation/evaluator.h"
#include "exchange/simulator/kempe_simulator.h"
#include "followed_motion.h"
#include <dlfcn.h>
#include <kempe/generate.h>
#include <kempe/kempe.h>
#include <stdbool.h>
#include <unistd.h>

/* Largest difference of an entry, as a part of the largest entry of its array. Generated C and the library differ by
 * rounding alone, since they add and multiply in different orders. */
#define ALLOWED 1e-12

typedef struct values {
    double *h, *jacobian, *h_t, *mass, *bias, *jdqd;
} values;

typedef struct generated {
    const kempe_equations *e;
    const motion *m;
    kmp_evaluator *eval;
    double *modes, *lambda, *k, *zero; /* STATES x conditions, STATES x rows */
    values out, own;
} generated;

static double *room(size_t count)
{
    double *x = calloc(count + 1, sizeof *x);
    if (!x)
        exit(1);
    return x;
}

static values values_of(int n, int m)
{
    const size_t rows = (size_t)m, size = (size_t)n;
    return (values){room(rows), room(rows * size), room(rows), room(size * size), room(size), room(rows)};
}

/* -- generated C ----------------------------------------------------------------------------------------- */

/* The equations of the model in a shared library of the folder; *seconds: time to compile. */
static const kempe_equations *compile(const bench *b, const char *path, const char *folder, const char *level,
                                      double *seconds)
{
    static int number;
    const kempe_generate_options options = {.simulator = 1, .language = "c"};
    kempe_code *code = NULL;
    char command[2048], name[256], symbol[300], library[512];
    struct timespec from, to;
    if (kempe_code_new(b->model, &options, &code) != KEMPE_OK || kempe_code_write(code, folder) != KEMPE_OK)
        bench_fail(b, path);
    snprintf(name, sizeof name, "%.*s", (int)strcspn(kempe_code_file_name(code, 0), "."),
             kempe_code_file_name(code, 0));
    kempe_code_free(code);
    snprintf(library, sizeof library, "%s/generated%d.so", folder, number++);
    snprintf(command, sizeof command,
             "cd %s && %s -std=c99 %s -ffp-contract=off -fPIC -shared -o %s %s.c %s_simulator.c $(ls kempe_charts.c "
             "2>/dev/null) -lm",
             folder, KEMPE_CC, level, library, name, name); /* the charts of spherical joints, where a model has some */
    (void)clock_gettime(CLOCK_MONOTONIC, &from);
    void *handle = system(command) == 0 ? dlopen(library, RTLD_NOW) : NULL;
    (void)clock_gettime(CLOCK_MONOTONIC, &to);
    *seconds = (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
    snprintf(symbol, sizeof symbol, "%s_equations", name);
    const kempe_equations *found = handle ? dlsym(handle, symbol) : NULL;
    if (!found) {
        const char *why = dlerror();
        fprintf(stderr, "%s: %s: %s\n", path, command, why ? why : "the compiler failed");
        exit(1);
    }
    return found;
}

static kempe_arguments arguments_at(const generated *g, int state)
{
    const kempe_equations *e = g->e;
    const motion *m = g->m;
    return (kempe_arguments){.t = m->t[state],
                             .k = g->k,
                             .q = m->q + (ptrdiff_t)state * m->n,
                             .qd = m->qd + (ptrdiff_t)state * m->n,
                             .qdd = g->zero,
                             .lambda = g->lambda + (ptrdiff_t)state * e->rows,
                             .modes = g->modes + (ptrdiff_t)state * e->conditions,
                             .u = e->input_values,
                             .chart = g->eval->chart};
}

static void run_generated(void *self, int k)
{
    const generated *g = self;
    const kempe_arguments at = arguments_at(g, k % g->m->count);
    if (g->e->rows > 0)
        g->e->closures(&at, g->out.h, g->out.jacobian, g->out.h_t);
    g->e->motion(&at, g->out.mass, g->out.bias, g->out.jdqd);
}

/* Conditions hold where their values are negative; kinks follow by themselves. */
static void find_modes(const generated *g, int state)
{
    const kempe_equations *e = g->e;
    const kempe_arguments at = arguments_at(g, state);
    double *modes = g->modes + (ptrdiff_t)state * e->conditions, *value = room((size_t)e->conditions);
    for (int pass = 0; pass < 2 && e->conditions > 0; pass++) { /* those that read others */
        e->changes(&at, value);
        for (int k = 0; k < e->conditions; k++)
            modes[k] = e->condition_kind[k] == KEMPE_CONDITION_KINK ? 0 : value[k] < 0;
    }
    free(value);
}

/* -- the library ------------------------------------------------------------------------------------------ */

static void run_library(void *self, int k)
{
    const generated *g = self;
    const motion *m = g->m;
    const int state = k % m->count;
    kmp_eval_closure(g->eval, m->t[state], m->q + (ptrdiff_t)state * m->n);
    kmp_eval_mass(g->eval);
    kmp_eval_bias(g->eval, m->qd + (ptrdiff_t)state * m->n);
}

/* The values of a state, with C at the multipliers that the library settles on. */
static void take_library(const generated *g, int state)
{
    const kempe_system *s = g->eval->system;
    const values *own = &g->own;
    run_library((void *)(uintptr_t)g, state);
    memset(own->jacobian, 0, (size_t)s->m * (size_t)s->n * sizeof *own->jacobian);
    for (int k = 0; k < s->jacobian.count; k++)
        own->jacobian[s->jacobian.row[k] * s->n + s->jacobian.col[k]] = g->eval->jacobian[k];
    if (s->m > 0) {
        memcpy(own->h, g->eval->h, (size_t)s->m * sizeof *own->h);
        memcpy(own->jdqd, g->eval->jdqd, (size_t)s->m * sizeof *own->jdqd);
    }
    kmp_eval_dense_mass(g->eval, own->mass);
    memcpy(own->bias, g->eval->bias, (size_t)s->n * sizeof *own->bias);
    for (int r = 0; g->eval->nu && r < s->m; r++)
        g->lambda[state * s->m + r] = g->eval->nu[r];
}

/* The largest difference, beside the largest entry or a size that rounding is beside. */
static double distance(int count, const double *a, const double *b, double least)
{
    double size = least, most = 0;
    for (int k = 0; k < count; k++)
        size = fmax(size, fabs(b[k]));
    for (int k = 0; k < count; k++)
        most = fmax(most, isfinite(a[k]) ? fabs(a[k] - b[k]) : INFINITY);
    return size > 0 ? most / size : most;
}

static double compare(const generated *g)
{
    const int n = g->m->n, m = g->e->rows;
    double most = 0, length = 0; /* of rows, which closed loops leave at zero */
    for (int r = 0; r < m; r++)
        length = fmax(length, g->e->row_scale[r]);
    for (int state = 0; state < g->m->count; state++) {
        find_modes(g, state);
        take_library(g, state);
        run_generated((void *)(uintptr_t)g, state);
        most = fmax(most, distance(m, g->out.h, g->own.h, length));
        most = fmax(most, distance(m * n, g->out.jacobian, g->own.jacobian, 0));
        most = fmax(most, distance(n * n, g->out.mass, g->own.mass, 0));
        most = fmax(most, distance(n, g->out.bias, g->own.bias, 0));
        most = fmax(most, distance(m, g->out.jdqd, g->own.jdqd, 0));
    }
    return most;
}

/* Prints the row of a model. Returns the largest difference. */
static double measure(const bench *b, const char *path, const char *folder)
{
    static const char *const levels[] = {"-O2", "-O3"};
    motion m = motion_follow(b, path);
    double off = 0, seconds[2], ns[3] = {INFINITY, INFINITY, INFINITY};
    generated g[2];
    for (int k = 0; k < 2; k++) {
        const kempe_equations *e = compile(b, path, folder, levels[k], &seconds[k]);
        g[k] = (generated){.e = e,
                           .m = &m,
                           .eval = kmp_eval_new(b->system, "native"),
                           .modes = room(STATES * (size_t)e->conditions),
                           .lambda = room(STATES * (size_t)e->rows),
                           .k = room((size_t)e->kept),
                           .zero = room((size_t)(m.n + e->rows)),
                           .out = values_of(m.n, e->rows),
                           .own = values_of(m.n, e->rows)};
        if (e->prepare)
            e->prepare(e->parameter_values, g[k].k);
        off = fmax(off, compare(&g[k]));
    }
    for (int round = 0; round < 3; round++) {
        ns[0] = fmin(ns[0], least_time(run_library, &g[0]));
        for (int k = 0; k < 2; k++)
            ns[1 + k] = fmin(ns[1 + k], least_time(run_generated, &g[k]));
    }
    printf("%-24s %4d %4d  %8.1e %10.2f %10.2f %10.2f %7.2f %7.2f %7.1f %6.1f\n", kempe_model_name(b->model), m.n,
           g[0].e->rows, off, ns[0] / 1e3, ns[1] / 1e3, ns[2] / 1e3, ns[1] / ns[0], ns[2] / ns[0], seconds[0],
           seconds[1]);
    (void)fflush(stdout);
    return off;
}

int bench_generated(int count, char **paths)
{
    static const char *const usual[] = {"examples/tram/tram.yaml",
                                        "examples/bogie_track/bogie_track.yaml",
                                        "examples/bogie_track/bogie_on_rails.yaml",
                                        "examples/curving/curving.yaml",
                                        "examples/manchester/manchester.yaml",
                                        "examples/rolling_wheel/rolling_wheel.yaml",
                                        "examples/wheelset/wheelset.yaml",
                                        "examples/limousine/limousine.yaml",
                                        "examples/suspension/suspension.yaml",
                                        "examples/four_bar/four_bar.yaml"};
    const int models = count > 1 ? count - 1 : (int)(sizeof usual / sizeof *usual);
    char folder[] = "/tmp/kempe-generated-XXXXXX", command[128];
    bool same = true;
    if (!mkdtemp(folder))
        return 1;
    printf("h, J, M, C, jdqd            n    m       off    library, us     C -O2      C -O3   ratio   ratio  cc, s  "
           "-O3\n");
    for (int k = 0; k < models; k++) {
        const char *path = count > 1 ? paths[k + 1] : usual[k];
        bench b = bench_load(path);
        same = measure(&b, path, folder) <= ALLOWED && same;
        bench_free(&b);
    }
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (!same)
        fprintf(stderr, "bench_generated: a difference above %.0e\n", ALLOWED);
    return system(command) == 0 && same ? 0 : 1;
}
