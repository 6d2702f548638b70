/* SPDX-License-Identifier: BSD-3-Clause */
/* The processor's time of a run by parts: the model's programs, linear algebra, and the rest, which is the integrator
 * with the formulation around it: bench_split MODEL T_END FORMULATION FORM INTEGRATOR RTOL [SECONDS], one line of JSON.
 *
 * The linker leads the calls of what evaluates programs and of what factors and solves through the functions below
 * (--wrap, bench/CMakeLists.txt). They note which part runs, and a timer, at times that follow no pattern, counts the
 * part that it finds. `total` is the median time of a run without the timer, `sampled` with it: the two should be near
 * each other. The parts share out the total as they were found; with `samples` in all, a share p is known to sqrt(p (1
 * - p) / samples).
 *
 * If equations and linear algebra are one program (constraints/programs/reduced_program.h), its time is shared out as
 * the two have it when they run apart, in runs of their own. */
#include "bench.h"
#include "constraints/programs/reduced_program.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "integrators/sundials/linear.h"
#include "linalg/sparse.h"
#include "wrapped.h"
#include <kempe/check.h>
#include <signal.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>

typedef enum part { REST, MODEL, ALGEBRA, FUSED, PARTS, OUTSIDE = PARTS } part; /* OUTSIDE: of the steps */

/* -- samples ----------------------------------------------------------------------------------------------- */

static struct {
    bool apart; /* no program has linear algebra in it */
    volatile sig_atomic_t current;
    volatile long found[PARTS + 1];
    timer_t timer;
    uint64_t random;
} at;

static int enter(part to)
{
    int from = (int)at.current;
    at.current = (sig_atomic_t)to;
    return from;
}

static void leave(int from)
{
    at.current = (sig_atomic_t)from;
}

/* Once, in 250 to 650 us from now. */
static void arm(void)
{
    at.random = at.random * 6364136223846793005U + 1442695040888963407U;
    struct itimerspec next = {.it_value.tv_nsec = 250000 + (long)(at.random >> 40) % 400000};
    (void)timer_settime(at.timer, 0, &next, NULL);
}

static void sample(int signal)
{
    (void)signal;
    at.found[at.current] = at.found[at.current] + 1;
    arm();
}

static void disarm(void)
{
    struct itimerspec never = {.it_value.tv_nsec = 0};
    (void)timer_settime(at.timer, 0, &never, NULL);
}

/* -- programs that are timed ----------------------------------------------------------------------------- */

TIMED(at.current == FUSED ? FUSED : MODEL, const double *, kmp_machine_run, (kmp_machine * machine, int stage),
      (machine, stage))
TIMED(FUSED, bool, kmp_reduced_program_run, (kmp_reduced_program * program, double t, const double *y, double *dy),
      (program, t, y, dy))
TIMED(FUSED, kmp_reduced_program_end, kmp_reduced_program_at_end, (kmp_reduced_program * program), (program))

TIMED(ALGEBRA, int, kmp_lu_factor, (int n, double *a, int *pivot), (n, a, pivot))
TIMED_VOID(ALGEBRA, kmp_lu_solve, (int n, const double *lu, const int *pivot, int m, double *b), (n, lu, pivot, m, b))
TIMED(ALGEBRA, int, kmp_cholesky_factor, (int n, double *a), (n, a))
TIMED_VOID(ALGEBRA, kmp_cholesky_solve, (int n, const double *l, double *b), (n, l, b))
TIMED_VOID(ALGEBRA, kmp_lu_complete, (int m, int n, double *a, const int *fixed, int *r, int *c, double *pivots),
           (m, n, a, fixed, r, c, pivots))
TIMED_VOID(ALGEBRA, kmp_pivots_complete, (int m, int n, double *a, double *largest, int *r, int *c, double *pivots),
           (m, n, a, largest, r, c, pivots))
TIMED(ALGEBRA, int, kmp_block_factor, (kmp_program_block * b, const double *values), (b, values))
TIMED_VOID(ALGEBRA, kmp_block_solve, (const kmp_program_block *b, int m, double *x), (b, m, x))
TIMED_VOID(ALGEBRA, kmp_block_solve_transposed, (const kmp_program_block *b, double *x), (b, x))
TIMED(ALGEBRA, int, kmp_sparse_factor, (kmp_sparse * s, const double *values), (s, values))
TIMED_VOID(ALGEBRA, kmp_sparse_solve, (kmp_sparse * s, int m, double *x), (s, m, x))
TIMED(ALGEBRA, int, kmp_reduction_factor, (kmp_reduction * red), (red))
TIMED_VOID(ALGEBRA, kmp_reduction_tangent, (kmp_reduction * red), (red))
TIMED_VOID(ALGEBRA, kmp_reduction_rates, (const kmp_reduction *red, const double *ud, double *qd), (red, ud, qd))
TIMED_VOID(ALGEBRA, kmp_reduction_rates_alone, (kmp_reduction * red, const double *ud, double *qd), (red, ud, qd))
TIMED(ALGEBRA, int, kmp_reduction_accelerate, (kmp_reduction * red, double *udd), (red, udd))
TIMED_VOID(ALGEBRA, kmp_reduction_accelerations, (const kmp_reduction *red, const double *udd, double *qdd),
           (red, udd, qdd))
TIMED_VOID(ALGEBRA, kmp_reduction_multipliers, (kmp_reduction * red, const double *qdd, double *lambda),
           (red, qdd, lambda))
TIMED_VOID(ALGEBRA, kmp_reduction_correction, (kmp_reduction * red), (red))
TIMED(ALGEBRA, int, kmp_saddle_factor, (kmp_saddle * saddle), (saddle))
TIMED_VOID(ALGEBRA, kmp_saddle_accelerations, (kmp_saddle * saddle, double *qdd, double *lambda), (saddle, qdd, lambda))
TIMED_VOID(ALGEBRA, kmp_saddle_solve, (kmp_saddle * saddle, const double *f, const double *b, double *x, double *a),
           (saddle, f, b, x, a))

kempe_status REAL(kmp_reduced_program_new)(kmp_reduced_program **program, const kmp_reduction *red, bool closes);
kempe_status OURS(kmp_reduced_program_new)(kmp_reduced_program **program, const kmp_reduction *red, bool closes);
kempe_status OURS(kmp_reduced_program_new)(kmp_reduced_program **program, const kmp_reduction *red, bool closes)
{
    if (!at.apart)
        return REAL(kmp_reduced_program_new)(program, red, closes);
    *program = NULL;
    return KEMPE_OK;
}

/* SUNDIALS calls its solvers by pointers: those of the last one made are kept, and ours put there. */
static int (*setup)(SUNLinearSolver, SUNMatrix);
static int (*solve)(SUNLinearSolver, SUNMatrix, N_Vector, N_Vector, sunrealtype);

static int timed_setup(SUNLinearSolver s, SUNMatrix a)
{
    int from = enter(ALGEBRA);
    int result = setup(s, a);
    leave(from);
    return result;
}

static int timed_solve(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance)
{
    int from = enter(ALGEBRA);
    int result = solve(s, a, x, b, tolerance);
    leave(from);
    return result;
}

static SUNLinearSolver take_over(SUNLinearSolver s)
{
    if (!s || !s->ops->setup || s->ops->setup == timed_setup)
        return s;
    setup = s->ops->setup;
    solve = s->ops->solve;
    s->ops->setup = timed_setup;
    s->ops->solve = timed_solve;
    return s;
}

SUNLinearSolver REAL(kmp_linear_new)(const char *name, SUNMatrix a, SUNContext context);
SUNLinearSolver OURS(kmp_linear_new)(const char *name, SUNMatrix a, SUNContext context);
SUNLinearSolver OURS(kmp_linear_new)(const char *name, SUNMatrix a, SUNContext context)
{
    return take_over(REAL(kmp_linear_new)(name, a, context));
}

SUNLinearSolver REAL(SUNLinSol_Dense)(N_Vector y, SUNMatrix a, SUNContext context);
SUNLinearSolver OURS(SUNLinSol_Dense)(N_Vector y, SUNMatrix a, SUNContext context);
SUNLinearSolver OURS(SUNLinSol_Dense)(N_Vector y, SUNMatrix a, SUNContext context)
{
    return take_over(REAL(SUNLinSol_Dense)(y, a, context));
}

/* -- runs -------------------------------------------------------------------------------------------------- */

enum { MOST_RUNS = 1001 };

typedef struct taken {
    double cpu; /* s, the median */
    double found[PARTS], samples;
    kmp_run_report report;
} taken;

/* Advances to the end; samples of the steps alone count. */
static void run_once(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, taken *out,
                     double *cpu)
{
    kmp_runner *runner = NULL;
    kempe_status status = kmp_runner_new(system, spec, start, &runner);
    at.current = REST;
    double begin = bench_now();
    while (!status && kmp_runner_t(runner) < spec->t_end)
        status = kmp_runner_step(runner);
    *cpu = bench_now() - begin;
    at.current = OUTSIDE;
    if (runner)
        kmp_runner_report(runner, &out->report);
    if (status) {
        fprintf(stderr, "%s\n", out->report.reason ? out->report.reason : "failed");
        exit(1);
    }
    kmp_runner_free(runner);
}

/* Again and again for so many seconds. */
static taken run_many(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, double seconds,
                      bool sampled)
{
    static double cpu[MOST_RUNS];
    taken out = {.cpu = 0};
    double begin = bench_now();
    int count = 0;
    memset((void *)at.found, 0, sizeof at.found);
    at.current = OUTSIDE;
    if (sampled)
        arm();
    while (count < 3 || (count < MOST_RUNS && bench_now() - begin < seconds))
        run_once(system, spec, start, &out, &cpu[count++]);
    disarm();
    out.cpu = bench_median(count, cpu);
    for (int k = 0; k < PARTS; k++)
        out.samples += out.found[k] = (double)at.found[k];
    return out;
}

int main(int argc, char **argv)
{
    if (argc < 7) {
        fprintf(stderr, "usage: bench_split MODEL T_END FORMULATION FORM INTEGRATOR RTOL [SECONDS]\n");
        return 2;
    }
    double seconds = argc > 7 ? strtod(argv[7], NULL) : 0.5;
    struct sigaction action = {.sa_handler = sample, .sa_flags = SA_RESTART};
    bench b = bench_load(argv[1]);
    kmp_run_spec spec = {.formulation = argv[3],
                         .form = argv[4],
                         .integrator = argv[5],
                         .rtol = strtod(argv[6], NULL),
                         .t_end = strtod(argv[2], NULL)};
    kempe_assembly *start = NULL;
    if (kmp_run_resolve(b.system, &spec) || kempe_assembly_new(b.system, &start)) {
        fprintf(stderr, "%s\n", kempe_context_message(b.context));
        return 1;
    }
    if (sigaction(SIGALRM, &action, NULL) || timer_create(CLOCK_MONOTONIC, NULL, &at.timer)) {
        fprintf(stderr, "no timer\n");
        return 1;
    }
    taken plain = run_many(b.system, &spec, start, seconds / 2, false);
    taken timed = run_many(b.system, &spec, start, seconds, true);
    double model = timed.found[MODEL], algebra = timed.found[ALGEBRA], program = timed.found[FUSED];
    if (program > 0) {
        at.apart = true;
        taken apart = run_many(b.system, &spec, start, seconds, true);
        double share = apart.found[MODEL] / (apart.found[MODEL] + apart.found[ALGEBRA]);
        model += program * share;
        algebra += program * (1 - share);
    }
    double scale = plain.cpu / timed.samples;
    printf("{\"total\": %.6g, \"sampled\": %.6g, \"samples\": %.0f, \"model\": %.6g, \"algebra\": %.6g, "
           "\"integrator\": %.6g, \"fused\": %s, \"steps\": %ld, \"rhs\": %ld, \"factorizations\": %ld}\n",
           plain.cpu, timed.cpu, timed.samples, scale * model, scale * algebra, scale * timed.found[REST],
           program > 0 ? "true" : "false", plain.report.steps, plain.report.rhs, plain.report.factorizations);
    (void)timer_delete(at.timer);
    kempe_assembly_free(start);
    bench_free(&b);
    return 0;
}
