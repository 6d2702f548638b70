/* SPDX-License-Identifier: BSD-3-Clause */
/* Andrews' squeezing mechanism over 0.03 s: every formulation and form at several tolerances, error of q at the end
 * against the digits of reference.csv, median CPU time of 15 runs, by machine code and by the tape; then one right-hand
 * side of the reduced formulation taken apart, each part run alone over states of the motion. */
#include "at_end.h"
#include "backend/sincos.h"
#include "bench.h"
#include "constraints/programs/reduced_program.h"
#include "integrators/formulations/formulation.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "integrators/steppers/solver.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

enum { RUNS = 15, STATES = 64, N = 7, REPEAT = 20000 };

static const char model_path[] = "examples/andrews/andrews.yaml";
static const char reference_path[] = "examples/andrews/reference.csv";

/* -- whole runs -------------------------------------------------------------------------------------- */

typedef struct rows {
    int count;
    double q[STATES][N], qd[STATES][N];
} rows;

static int keep_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    rows *r = user;
    (void)t, (void)qdd, (void)lambda, (void)work;
    memcpy(r->q[r->count], q, sizeof *r->q);
    memcpy(r->qd[r->count], qd, sizeof *r->qd);
    r->count = (r->count + 1) % STATES;
    return 0;
}

/* The median time of RUNS runs; false when one fails. */
static bool time_runs(const bench *b, kmp_run_spec *spec, const kempe_assembly *start, rows *last,
                      kmp_run_report *report, double *median)
{
    double cpu[RUNS];
    if (kmp_run_resolve(b->system, spec) != KEMPE_OK)
        return false;
    for (int k = 0; k < RUNS; k++) {
        last->count = 0;
        if (kmp_run(b->system, spec, start, keep_row, last, report) != KEMPE_OK)
            return false;
        cpu[k] = report->cpu_s;
    }
    *median = bench_median(RUNS, cpu);
    return true;
}

/* Returns the time, infinite when the error is above 1e-10. */
static double whole_run(const bench *b, const kempe_assembly *start, const kmp_reference *reference, kmp_method method,
                        const char *backend, double rtol)
{
    const double end = 0.03;
    rows last;
    kmp_run_report report;
    kmp_run_spec spec = {.formulation = method.formulation,
                         .form = method.form,
                         .integrator = method.integrator,
                         .backend = backend,
                         .rtol = rtol,
                         .t_end = end,
                         .time_count = 1,
                         .times = &end};
    double cpu, error;
    if (!time_runs(b, &spec, start, &last, &report, &cpu)) {
        printf("%-10s %-8s %-7s %.0e | failed\n", method.formulation, method.form, backend, rtol);
        return INFINITY;
    }
    error = bench_error_at_end(reference, N, end, last.q[0]);
    printf("%-10s %-8s %-7s %.0e   | %9.1e | %7ld %7ld | %9.3f %9.0f\n", method.formulation, method.form, backend, rtol,
           error, report.steps, report.rhs, 1e3 * cpu, 1e9 * cpu / (double)report.rhs);
    return error <= 1e-10 ? cpu : INFINITY;
}

static void whole_runs(const bench *b, const kempe_assembly *start, const kmp_reference *reference, const char *backend)
{
    static const double rtols[] = {1e-4, 1e-6, 1e-8, 1e-10, 3e-11, 1e-12};
    double best = INFINITY;
    printf("%-10s %-8s %-7s %-7s | %9s | %7s %7s | %9s %9s\n", "formulation", "form", "code", "rtol", "error q",
           "steps", "rhs", "cpu ms", "ns a rhs");
    kmp_method method;
    for (int w = 0; kmp_method_get(w, &method); w++) {
        if (!method.standard_form || !method.standard_integrator)
            continue;
        for (size_t k = 0; k < sizeof rtols / sizeof *rtols; k++) {
            double cpu = whole_run(b, start, reference, method, backend, rtols[k]);
            if (strcmp(method.form, "integrated") == 0)
                best = fmin(best, cpu);
        }
    }
    printf("reduced/integrated reaches error q <= 1e-10 in %.3f ms (%s)\n\n", 1e3 * best, backend);
}

/* -- one right-hand side ----------------------------------------------------------------------------- */

typedef struct stand {
    const bench *b;
    rows at; /* states of the motion */
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_reduction red;
    kmp_reduced_program *reduced;
    kmp_formulation *formulation;
    double y[STATES][2 * N];
    double sink;
} stand;

static void run_trig(stand *s, int k)
{
    static const uint32_t angle[8] = {0, 1, 2, 3, 4, 5, 6};
    double out[16]; /* eight sines, eight cosines */
    kmp_sincos_slots(N, angle, s->at.q[k], out);
    s->sink += out[0] + out[8 + N - 1];
}

static void run_program(stand *s, int k)
{
    kmp_eval_closure(s->eval, 0, s->at.q[k]);
    kmp_eval_mass(s->eval);
    kmp_eval_bias(s->eval, s->at.qd[k]);
    s->sink += s->eval->bias[0];
}

static void run_algebra(stand *s, int k)
{
    double qd[N], udd[N];
    (void)kmp_reduction_factor(&s->red);
    kmp_reduction_tangent(&s->red);
    kmp_reduction_rates(&s->red, &s->at.qd[k][s->part.u[0]], qd);
    (void)kmp_reduction_accelerate(&s->red, udd);
    s->sink += udd[0] + qd[N - 1];
}

static void run_whole(stand *s, int k)
{
    double dy[2 * N];
    (void)s->formulation->ode.rhs(s->formulation->ode.self, 0, s->y[k], dy);
    s->sink += dy[1];
}

static void run_fused(stand *s, int k)
{
    double dy[2 * N];
    if (kmp_reduced_program_run(s->reduced, 0, s->y[k], dy))
        s->sink += dy[1];
}

static int nothing(void *self, double t, const double *y, double *dy)
{
    (void)self, (void)t, (void)y, (void)dy;
    return KMP_GO;
}

/* A step of a system of this size whose right-hand side costs nothing, by call. */
static double time_integrator(int n)
{
    double y[2 * N] = {0}, atol[2 * N], cpu[RUNS];
    kmp_ode ode = {.n = n, .rhs = nothing};
    for (int i = 0; i < n; i++)
        atol[i] = y[i] = 1;
    const kmp_solver_kind *kind = &kmp_solver_dop853;
    kmp_solver *solver = kind->create(kind, &(kmp_solver_setup){.ode = &ode, .tolerance = {1e-10, atol}});
    for (int r = 0; solver && r < RUNS; r++) {
        long before = solver->work.rhs;
        (void)kind->start(solver, 0, y, NULL, 1e9, 1);
        double begin = bench_now();
        for (int k = 0; k < REPEAT / 10; k++) {
            (void)kind->step(solver);
            if (!(solver->t < 1e8))
                (void)kind->start(solver, 0, y, NULL, 1e9, 1);
        }
        cpu[r] = (bench_now() - begin) / (double)(solver->work.rhs - before);
    }
    if (!solver)
        return NAN;
    kind->release(solver);
    return 1e9 * bench_median(RUNS, cpu);
}

/* ns a call. */
static double time_part(stand *s, void part(stand *, int))
{
    double cpu[RUNS];
    for (int r = 0; r < RUNS; r++) {
        double begin = bench_now();
        for (int k = 0; k < REPEAT; k++)
            part(s, k % STATES);
        cpu[r] = (bench_now() - begin) / REPEAT;
    }
    return 1e9 * bench_median(RUNS, cpu);
}

static void gather_states(stand *s, const kempe_assembly *start)
{
    double times[STATES];
    kmp_run_report report;
    for (int k = 0; k < STATES; k++)
        times[k] = 0.03 * (k + 1) / STATES;
    kmp_run_spec spec = {.formulation = "reduced", .rtol = 1e-10, .t_end = 0.03, .time_count = STATES, .times = times};
    if (kmp_run_resolve(s->b->system, &spec) || kmp_run(s->b->system, &spec, start, keep_row, &s->at, &report))
        exit(1);
    for (int k = 0; k < STATES; k++) {
        s->y[k][0] = s->at.q[k][s->part.u[0]];
        s->y[k][1] = s->at.qd[k][s->part.u[0]];
        for (int i = 0; i < s->part.r; i++)
            s->y[k][2 + i] = s->at.q[k][s->part.v[i]];
    }
}

static void stand_init(stand *s, const bench *b, const kempe_assembly *start, const char *backend)
{
    double zero[N] = {0};
    *s = (stand){.b = b, .eval = kmp_eval_new(b->system, backend)};
    kmp_eval_closure(s->eval, 0, start->q);
    if (kmp_partition_init(&s->part, b->system, s->eval->jacobian, NULL, 0) || s->part.p != 1 ||
        kmp_reduction_init(&s->red, s->eval, &s->part))
        exit(1);
    kmp_formulation_start given = {.system = b->system,
                                   .eval = s->eval,
                                   .part = &s->part,
                                   .q = start->q,
                                   .qd = start->qd,
                                   .qdd = zero,
                                   .lambda = zero,
                                   .rtol = 1e-10,
                                   .atol = 1e-10,
                                   .rate_scale = 1};
    s->formulation = kmp_formulation_integrated.create(&kmp_formulation_integrated, &given);
    if (kmp_reduction_factor(&s->red) || kmp_reduced_program_new(&s->reduced, &s->red, false) || !s->reduced)
        exit(1);
    gather_states(s, start);
}

static void stand_free(stand *s)
{
    s->formulation->release(s->formulation);
    kmp_reduced_program_free(s->reduced);
    kmp_reduction_free(&s->red);
    kmp_partition_free(&s->part);
    kmp_eval_free(s->eval);
}

static void one_right_hand_side(const bench *b, const kempe_assembly *start, const char *backend)
{
    static stand s;
    stand_init(&s, b, start, backend);
    double trig = time_part(&s, run_trig), program = time_part(&s, run_program), algebra = time_part(&s, run_algebra);
    double reduced = time_part(&s, run_fused), whole = time_part(&s, run_whole),
           integrator = time_integrator(s.formulation->size);
    kmp_counts c = kmp_program_count(b->system->motion, 1, b->system->motion->stages - 1);
    printf("one right-hand side of reduced/integrated, ns, %s, each part alone over %d states of the motion\n", backend,
           STATES);
    printf("  %-46s %6.0f\n", "sines and cosines of 7 angles", trig);
    printf("  %-46s %6.0f\n", "the rest of the program", program - trig);
    printf("  %-46s %6.0f\n", "linear algebra: Jv, Bvu, gamma, Mr, Fr, udd", algebra);
    printf("  %-46s %6.0f\n", "all of it, as the integrator calls it", whole);
    printf("  %-46s %6.0f\n", "as one program with the linear algebra", reduced);
    printf("  %-46s %6.0f\n", "the integrator beside it, by call", integrator);
    printf("%s: %ld operations, %.2f ns each (sines and cosines apart)\n\n", backend, c.paper + c.other,
           (program - trig) / (double)(c.paper + c.other));
    kmp_counts all = kmp_program_count(kmp_reduced_program_code(s.reduced), KMP_REDUCED_PROGRAM_RATES,
                                       KMP_REDUCED_PROGRAM_ACCELERATIONS),
               algebra_count = kmp_reduction_count(&s.red);
    printf("operations: program %ld, linear algebra %ld; as one program %ld (%ld +, %ld *, %ld /, %ld sincos)\n\n",
           c.paper, algebra_count.paper, all.paper, all.add, all.mul, all.div, all.trig);
    if (!isfinite(s.sink))
        exit(1);
    stand_free(&s);
}

int bench_speed(int argc, char **argv)
{
    (void)argc, (void)argv;
    static const char *const backends[] = {"native", "tape"};
    bench b = bench_load(model_path);
    kempe_assembly *start = NULL;
    kmp_reference reference;
    if (kempe_assembly_new(b.system, &start) || kmp_reference_read(b.system, reference_path, &reference)) {
        fprintf(stderr, "%s\n", kempe_context_message(b.context));
        return 1;
    }
    for (int k = 0; k < 2; k++) {
        whole_runs(&b, start, &reference, backends[k]);
        one_right_hand_side(&b, start, backends[k]);
    }
    kmp_samples_free(&reference);
    kempe_assembly_free(start);
    bench_free(&b);
    return 0;
}
