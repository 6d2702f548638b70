/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations of a tree at given states, as the programs of bench/peers have them: bench_forward MODEL STATES
 * SECONDS. STATES: a line a state, q, then qd. By the O(N) scheme (the set `qdd`) and by M, C and Cholesky factors,
 * each by machine code, by the tape, and as written C compiled with -O2. Prints a name, the accelerations of each state
 * in a line, ns a call. */
#include "backend/machine.h"
#include "bench.h"
#include "exchange/code/source.h"
#include "linalg/dense/dense.h"
#include "loaded_equations.h"
#include "model/data/model_context.h"
#include <kempe/generate.h>
#include <kempe/kempe.h>
#include <string.h>

enum { MOST = 128, MOST_STATES = 64, ROUNDS = 9 };

typedef struct stand {
    int n, states;
    double q[MOST_STATES][MOST], qd[MOST_STATES][MOST], qdd[MOST];
    double mass[MOST * MOST];
    kmp_code_source source;
    kmp_machine *machine;
    emitted code;
} stand;

static void read_states(stand *s, const char *path)
{
    FILE *file = fopen(path, "r");
    double x;
    for (int k = 0; file && s->states < MOST_STATES && fscanf(file, "%lf", &x) == 1; k++) {
        int i = k % (2 * s->n);
        (i < s->n ? s->q : s->qd)[s->states][i % s->n] = x;
        s->states += i == 2 * s->n - 1;
    }
    if (file)
        fclose(file);
    if (s->states == 0) {
        fprintf(stderr, "%s: no states of %d coordinates\n", path, s->n);
        exit(1);
    }
}

static const double *run_machine(stand *s, int k)
{
    kmp_machine_set(s->machine, KMP_IN_Q, s->q[k]);
    kmp_machine_set(s->machine, KMP_IN_QD, s->qd[k]);
    return kmp_machine_run(s->machine, 1);
}

/* -C in qdd, M below its diagonal. */
static void solve(stand *s)
{
    if (kmp_cholesky_factor(s->n, s->mass))
        exit(1);
    kmp_cholesky_solve(s->n, s->mass, s->qdd);
}

static void machine_qdd(stand *s, int k)
{
    memcpy(s->qdd, run_machine(s, k), (size_t)s->n * sizeof *s->qdd);
}

static void machine_mass(stand *s, int k)
{
    const double *x = run_machine(s, k);
    for (int i = 0; i < s->n; i++)
        for (int j = 0; j <= i; j++)
            s->mass[i + j * s->n] = *x++;
    for (int i = 0; i < s->n; i++)
        s->qdd[i] = -x[i];
    solve(s);
}

static void code_qdd(stand *s, int k)
{
    s->code.function.accelerations(0, s->q[k], s->qd[k], s->qdd);
}

static void code_mass(stand *s, int k)
{
    s->code.function.motion(0, s->q[k], s->qd[k], s->mass, s->qdd);
    for (int i = 0; i < s->n; i++)
        s->qdd[i] = -s->qdd[i];
    solve(s);
}

static void report(stand *s, const char *name, void evaluate(stand *, int), double seconds)
{
    double ns[ROUNDS], spent = 0;
    long count = 1;
    printf("%s\n", name);
    for (int k = 0; k < s->states; k++) {
        evaluate(s, k);
        for (int i = 0; i < s->n; i++)
            printf("%.17g ", s->qdd[i]);
        printf("\n");
    }
    for (; spent < seconds / 12; count *= 2) {
        double begin = bench_now();
        for (long k = 0; k < count; k++)
            evaluate(s, (int)(k % s->states));
        spent = bench_now() - begin;
    }
    for (int r = 0; r < ROUNDS; r++) {
        double begin = bench_now();
        for (long k = 0; k < count; k++)
            evaluate(s, (int)(k % s->states));
        ns[r] = 1e9 * (bench_now() - begin) / (double)count;
    }
    printf("%.6g\n", bench_median(ROUNDS, ns));
}

static void with_sets(stand *s, const kempe_model *model, const char *sets, const char *scheme,
                      void by_machine(stand *, int), void by_code(stand *, int), double seconds)
{
    static const char *const backends[] = {"native", "tape"};
    char name[80];
    if (kmp_source_init(&s->source, model, &(kempe_generate_options){.sets = sets, .form = "compact"})) {
        fprintf(stderr, "%s\n", kempe_context_message(kmp_model_context(model)));
        exit(1);
    }
    const kmp_program *program = s->source.routines[0].program;
    for (int b = 0; b < 2; b++) {
        const double time = 0;
        s->machine = kmp_machine_new(program, kmp_backend_find(backends[b]));
        if (!s->machine)
            exit(1);
        kmp_machine_set(s->machine, KMP_IN_TIME, &time);
        (void)kmp_machine_run(s->machine, 0);
        snprintf(name, sizeof name, "Kempe %s, %s", scheme, b ? "tape" : "machine code");
        report(s, name, by_machine, seconds);
        kmp_machine_free(s->machine);
    }
    if (emitted_init(&s->code, model, sets, NULL)) {
        snprintf(name, sizeof name, "Kempe %s, C -O2", scheme);
        report(s, name, by_code, seconds);
        emitted_free(&s->code);
    }
    kmp_source_free(&s->source);
}

int bench_forward(int argc, char **argv)
{
    static stand s;
    if (argc < 4) {
        fprintf(stderr, "usage: bench forward MODEL STATES SECONDS\n");
        return 2;
    }
    bench b = bench_load(argv[1]);
    double seconds = strtod(argv[3], NULL);
    s.n = b.system->n;
    if (s.n > MOST) {
        fprintf(stderr, "%d coordinates, at most %d\n", s.n, MOST);
        return 1;
    }
    read_states(&s, argv[2]);
    with_sets(&s, b.model, "qdd", "O(N)", machine_qdd, code_qdd, seconds);
    with_sets(&s, b.model, "M_C", "M, C, Cholesky", machine_mass, code_mass, seconds);
    bench_free(&b);
    return 0;
}
