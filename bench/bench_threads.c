/* SPDX-License-Identifier: BSD-3-Clause */
/* Gain by threads that share each evaluation: microseconds of calling a team for nothing, of C and jdqd, of the power
 * of forces, of a right-hand side and a Jacobian of the reduced formulation, and seconds of a run on each formulation.
 *
 *     bench threads [MODEL [T_END [RUNS [INTEGRATOR]]]]
 *
 * By the clock on the wall, all numbers of threads in turn: an evaluation's time is the least median of many rounds, a
 * run's the least of a few. */
#include "bench.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

enum { MOST = 4, ROUNDS = 60, SAMPLES = 40, MATRICES = 8, PIECES = 3 };

static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Microseconds. */
static void lower(double *least, int count, double *sample)
{
    *least = fmin(*least, 1e6 * bench_median(count, sample));
}

static void do_nothing(void *self, int piece)
{
    (void)self, (void)piece;
}

static void call(kmp_team *team, double *least)
{
    double sample[SAMPLES];
    for (int k = 0; team && k < SAMPLES; k++) {
        double from = now();
        kmp_team_run(team, PIECES, do_nothing, NULL);
        sample[k] = now() - from;
    }
    if (team)
        lower(least, SAMPLES, sample);
}

/* -- evaluations ------------------------------------------------------------------------------------- */

typedef enum what { CALL, BIAS, POWER, RIGHT_SIDE, JACOBIAN, WHATS } what;

static void near(const kmp_runner *run, int k, double *y)
{
    for (int i = 0; i < run->formulation->ode.n; i++)
        y[i] = run->formulation->y[i] + 1e-7 * sin(0.01 * k + i);
}

/* Right-hand sides and Jacobians at states that follow each other. */
static void evaluate_formulation(const kmp_runner *run, double *time)
{
    double sample[SAMPLES], other[MATRICES];
    const kmp_ode *ode = &run->formulation->ode;
    size_t n = (size_t)ode->n;
    double *y = malloc(n * sizeof *y), *dy = malloc(n * sizeof *dy), *j = malloc(n * n * sizeof *j);
    if (!y || !dy || !j)
        exit(1);
    for (int k = 0; k < SAMPLES; k++) {
        near(run, k, y);
        double from = now();
        (void)ode->rhs(ode->self, 0, y, dy);
        sample[k] = now() - from;
        if (k >= MATRICES)
            continue;
        memset(j, 0, n * n * sizeof *j);
        from = now();
        (void)ode->jacobian(ode->self, 0, y, j);
        other[k] = now() - from;
    }
    lower(&time[RIGHT_SIDE], SAMPLES, sample);
    lower(&time[JACOBIAN], MATRICES, other);
    free(y);
    free(dy);
    free(j);
}

static void evaluate_all(const kmp_runner *run, double *time)
{
    double sample[SAMPLES], other[SAMPLES];
    kmp_evaluator *eval = run->eval;
    size_t n = (size_t)eval->n;
    double *q = malloc(n * sizeof *q), *qd = malloc(n * sizeof *qd);
    if (!q || !qd)
        exit(1);
    for (int k = 0; k < SAMPLES; k++) {
        for (int i = 0; i < eval->n; i++) {
            q[i] = run->room.state[i] + 1e-6 * sin(0.01 * k + i);
            qd[i] = run->room.state[eval->n + i] + 1e-5 * cos(0.01 * k + i);
        }
        kmp_eval_closure(eval, 0, q);
        kmp_eval_mass(eval);
        double from = now();
        kmp_eval_bias(eval, qd);
        sample[k] = now() - from;
        from = now();
        (void)kmp_eval_power(eval, 0, q, qd);
        other[k] = now() - from;
    }
    lower(&time[BIAS], SAMPLES, sample);
    lower(&time[POWER], SAMPLES, other);
    free(q);
    free(qd);
}

static kmp_runner *runner_of(const bench *b, const kempe_assembly *start, const kmp_run_spec *spec)
{
    kmp_runner *run = NULL;
    if (kmp_runner_new(b->system, spec, start, &run)) {
        fprintf(stderr, "%s\n", kempe_context_message(b->context));
        exit(1);
    }
    return run;
}

static void put_evaluations(const bench *b, const kempe_assembly *start)
{
    kmp_run_spec spec[MOST];
    kmp_runner *run[MOST];
    double time[MOST][WHATS];
    for (int t = 0; t < MOST; t++) {
        spec[t] = (kmp_run_spec){
            .formulation = "reduced", .integrator = "radau5", .rtol = 1e-6, .t_end = 1, .threads = t + 1};
        if (kmp_run_resolve(b->system, &spec[t]))
            exit(1);
        run[t] = runner_of(b, start, &spec[t]);
        for (int k = 0; k < WHATS; k++)
            time[t][k] = INFINITY;
    }
    for (int round = 0; round < ROUNDS; round++)
        for (int t = 0; t < MOST; t++) {
            call(run[t]->team, &time[t][CALL]);
            evaluate_formulation(run[t], time[t]);
            evaluate_all(run[t], time[t]);
        }
    printf("%7s | %6s %8s %8s %8s %8s\n", "threads", "call", "C, jdqd", "power", "rhs", "Jacobian");
    for (int t = 0; t < MOST; t++) {
        time[t][CALL] = t > 0 ? time[t][CALL] : 0;
        printf("%7d | %6.1f %8.1f %8.1f %8.1f %8.1f\n", t + 1, time[t][CALL], time[t][BIAS], time[t][POWER],
               time[t][RIGHT_SIDE], time[t][JACOBIAN]);
        kmp_runner_free(run[t]);
    }
    fflush(stdout);
}

/* -- runs -------------------------------------------------------------------------------------------- */

static const struct {
    const char *formulation, *integrator;
} methods[] = {{"reduced", "radau5"}, {"reduced", "dop853"}, {"dae", "ida"}};
enum { METHODS = sizeof methods / sizeof *methods };

/* Seconds of the integration alone; the sum of the last state says whether it was the same. */
static double time_of_run(const bench *b, const kempe_assembly *start, int method, int threads, double t_end,
                          double *sum)
{
    kmp_run_spec spec = {.formulation = methods[method].formulation,
                         .integrator = methods[method].integrator,
                         .rtol = 1e-6,
                         .t_end = t_end,
                         .threads = threads};
    kmp_runner *run = NULL;
    kempe_status status = kmp_run_resolve(b->system, &spec);
    if (status == KEMPE_OK)
        run = runner_of(b, start, &spec);
    double from = now();
    while (status == KEMPE_OK && kmp_runner_t(run) < t_end && !kmp_runner_ended(run))
        status = kmp_runner_step(run);
    double time = now() - from;
    *sum = 0;
    for (int i = 0; status == KEMPE_OK && i < b->system->n; i++)
        *sum += run->eval->q[i];
    kmp_runner_free(run);
    return status == KEMPE_OK ? time : NAN;
}

static void put_runs(const bench *b, const kempe_assembly *start, int method, double t_end, int runs)
{
    double least[MOST], sum[MOST];
    bool same = true;
    for (int k = 0; k < runs; k++)
        for (int t = 0; t < MOST; t++) {
            double time = time_of_run(b, start, method, t + 1, t_end, &sum[t]);
            least[t] = k == 0 || time < least[t] ? time : least[t];
            same = same && sum[t] == sum[0];
        }
    printf("%-8s %-7s |", methods[method].formulation, methods[method].integrator);
    for (int t = 0; t < MOST; t++)
        printf(" %7.3f", least[t]);
    printf(" |");
    for (int t = 1; t < MOST; t++)
        printf(" %5.2f", least[0] / least[t]);
    printf(" | %s\n", same ? "the same" : "DIFFERENT");
    fflush(stdout);
}

static bool takes_part(const char *integrator)
{
    for (int method = 0; method < METHODS; method++)
        if (strcmp(integrator, methods[method].integrator) == 0)
            return true;
    return false;
}

int bench_threads(int argc, char **argv)
{
    const char *model = argc > 1 ? argv[1] : "tests/models/three_bogies.yaml";
    double t_end = argc > 2 ? atof(argv[2]) : 0.1;
    int runs = argc > 3 ? atoi(argv[3]) : 5;
    if (argc > 4 && !takes_part(argv[4])) {
        fprintf(stderr, "no run by '%s': radau5, dop853 or ida\n", argv[4]);
        return 2;
    }
    bench b = bench_load(model);
    kempe_assembly *start = NULL;
    if (kempe_assembly_new(b.system, &start)) {
        fprintf(stderr, "%s\n", kempe_context_message(b.context));
        return 1;
    }
    printf("%s: %d coordinates, %d rows\n\n", model, b.system->n, b.system->m);
    put_evaluations(&b, start);
    printf("\n%-16s | s of %g s by 1, 2, 3, 4 threads | gain by 2, 3, 4 | end\n", "run", t_end);
    for (int method = 0; method < METHODS; method++)
        if (argc <= 4 || strcmp(argv[4], methods[method].integrator) == 0)
            put_runs(&b, start, method, t_end, runs);
    kempe_assembly_free(start);
    bench_free(&b);
    return 0;
}
