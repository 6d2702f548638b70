/* SPDX-License-Identifier: BSD-3-Clause */
/* Andrews' squeezing mechanism on the reduced formulation beside the same algorithm written by hand
 * (andrews_by_hand.h), in one process, alternately: a right-hand side, whole runs to a given error, and the time of
 * building the model. Exit code 1: a bar is missed.
 *
 * The time to an error is read off a straight line through many tolerances, log of time over log of error, so that the
 * luck of one of them does not decide. Times are the processor's, of the integration alone; what precedes it is a line
 * of its own. */
#include "andrews_by_hand.h"
#include "at_end.h"
#include "bench.h"
#include "constraints/programs/reduced_program.h"
#include "integrators/formulations/formulation.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

enum { N = 7, STATES = 64, CALLS = 6400, ROUNDS = 41, RUNS = 11, DECADE = 12, TOLERANCES = 8 * DECADE, BUILDS = 41 };

static const char model_path[] = "examples/andrews/andrews.yaml";
static const char reference_path[] = "examples/andrews/reference.csv";
static const double t_end = 0.03;
static const double errors[] = {1e-8, 1e-10};

/* Bars: ms to each error with machine code, or times the driver by hand; ms of the tape to the last one; a right-hand
 * side against the one by hand; ms of building. */
static const double bar_native[] = {0.15, 0.20};
static const double bar_driver = 1.5, bar_tape = 0.5, bar_rhs = 1.3, bar_build = 5;

static bool missed;

static const char *judge(bool holds)
{
    missed = missed || !holds;
    return holds ? "held" : "MISSED";
}

/* -- one right-hand side ----------------------------------------------------------------------------- */

typedef struct stand {
    double q[STATES][N], qd[STATES][N]; /* states of the motion, in the order of rows */
    int count;
    double y[STATES][BY_HAND_SIZE], hand[STATES][BY_HAND_SIZE];
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_rank_margin margin;
    kmp_formulation *formulation;
    double sink;
} stand;

static int keep_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    stand *s = user;
    (void)t, (void)qdd, (void)lambda, (void)work;
    memcpy(s->q[s->count % STATES], q, sizeof *s->q);
    memcpy(s->qd[s->count++ % STATES], qd, sizeof *s->qd);
    return 0;
}

static kmp_run_spec spec_of(const char *backend, double tolerance, int count, const double *times)
{
    return (kmp_run_spec){.formulation = "reduced",
                          .form = "integrated",
                          .integrator = "dop853",
                          .backend = backend,
                          .rtol = tolerance,
                          .atol = tolerance,
                          .t_end = t_end,
                          .time_count = count,
                          .times = times};
}

static void run_once(const bench *b, const kempe_assembly *start, kmp_run_spec *spec, stand *rows,
                     kmp_run_report *report)
{
    rows->count = 0;
    if (kmp_run_resolve(b->system, spec) || kmp_run(b->system, spec, start, keep_row, rows, report)) {
        fprintf(stderr, "%s\n", kempe_context_message(b->context));
        exit(1);
    }
}

/* The states of a run as both take them; u must be the first coordinate, as it is by hand. */
static void gather_states(stand *s, const bench *b, const kempe_assembly *start)
{
    double times[STATES];
    kmp_run_report report;
    for (int k = 0; k < STATES; k++)
        times[k] = t_end * (k + 1) / STATES;
    kmp_run_spec spec = spec_of("native", 1e-10, STATES, times);
    run_once(b, start, &spec, s, &report);
    if (s->part.p != 1 || s->part.u[0] != 0)
        exit(1);
    for (int k = 0; k < STATES; k++) {
        s->y[k][0] = s->q[k][0];
        s->y[k][1] = s->qd[k][0];
        for (int i = 0; i < s->part.r; i++)
            s->y[k][2 + i] = s->q[k][s->part.v[i]];
        memcpy(s->hand[k], s->q[k], sizeof s->q[k]);
        s->hand[k][N] = s->qd[k][0];
    }
}

/* In a chain each state waits for the derivative before, as the stages of a step do. */
static const double *next_state(bool chain, const double *at, const double *dy, double *y)
{
    for (int i = 0; chain && i < BY_HAND_SIZE; i++)
        y[i] = at[i] + 0 * dy[i];
    return chain ? y : at;
}

/* ns of a call. */
static double call_formulation(stand *s, bool chain)
{
    double y[BY_HAND_SIZE], dy[BY_HAND_SIZE] = {0}, begin = bench_now();
    for (int k = 0; k < CALLS; k++) {
        (void)s->formulation->ode.rhs(s->formulation->ode.self, 0, next_state(chain, s->y[k % STATES], dy, y), dy);
        s->sink += dy[1];
    }
    return 1e9 * (bench_now() - begin) / CALLS;
}

static double call_hand(stand *s, bool chain)
{
    double y[BY_HAND_SIZE], dy[BY_HAND_SIZE] = {0}, begin = bench_now();
    for (int k = 0; k < CALLS; k++) {
        andrews_by_hand_rhs(next_state(chain, s->hand[k % STATES], dy, y), dy);
        s->sink += dy[N];
    }
    return 1e9 * (bench_now() - begin) / CALLS;
}

static double largest_difference(stand *s)
{
    double worst = 0;
    for (int k = 0; k < STATES; k++) {
        double dy[BY_HAND_SIZE], hand[BY_HAND_SIZE];
        (void)s->formulation->ode.rhs(s->formulation->ode.self, 0, s->y[k], dy);
        andrews_by_hand_rhs(s->hand[k], hand);
        worst = fmax(worst, fabs(dy[1] - hand[N]) / fmax(fabs(hand[N]), 1e4));
        for (int i = 0; i < s->part.r; i++)
            worst = fmax(worst, fabs(dy[2 + i] - hand[s->part.v[i]]) / fmax(fabs(hand[s->part.v[i]]), 1e3));
    }
    return worst;
}

static void one_right_hand_side(const bench *b, const kempe_assembly *start)
{
    static stand s;
    double zero[N] = {0}, mine[ROUNDS], hand[ROUNDS], ratio[ROUNDS];
    s.eval = kmp_eval_new(b->system, "native");
    kmp_eval_closure(s.eval, 0, start->q);
    if (kmp_partition_init(&s.part, b->system, s.eval->jacobian, NULL, 0) ||
        !kmp_rank_margin_init(&s.margin, b->system, &s.part))
        exit(1);
    kmp_formulation_start given = {.system = b->system,
                                   .eval = s.eval,
                                   .part = &s.part,
                                   .margin = &s.margin,
                                   .q = start->q,
                                   .qd = start->qd,
                                   .qdd = zero,
                                   .lambda = zero,
                                   .rtol = 1e-10,
                                   .atol = 1e-10,
                                   .rate_scale = 1};
    s.formulation = kmp_formulation_integrated.create(&kmp_formulation_integrated, &given);
    if (!s.formulation)
        exit(1);
    gather_states(&s, b, start);
    double off = largest_difference(&s);
    for (int chain = 1; chain >= 0; chain--) {
        for (int k = 0; k < ROUNDS; k++) {
            mine[k] = call_formulation(&s, chain);
            hand[k] = call_hand(&s, chain);
            ratio[k] = mine[k] / hand[k];
        }
        double times = bench_median(ROUNDS, ratio);
        bool holds = times <= bar_rhs && off < 1e-12 && isfinite(s.sink);
        printf("right-hand side, %s: %.1f ns, by hand %.1f ns, %.2f times",
               chain ? "each state from the derivative before" : "states apart", bench_median(ROUNDS, mine),
               bench_median(ROUNDS, hand), times);
        printf(chain ? " (at most %.1f): %s; difference %.1e\n" : "\n", bar_rhs, chain ? judge(holds) : "", off);
    }
    s.formulation->release(s.formulation);
    kmp_rank_margin_free(&s.margin);
    kmp_partition_free(&s.part);
    kmp_eval_free(s.eval);
}

/* -- whole runs -------------------------------------------------------------------------------------- */

enum { NATIVE, TAPE, HAND, WAYS };

static const char *const way_names[] = {"native", "tape", "by hand"};

typedef struct point {
    double error, cpu;
    long steps, rhs;
} point;

/* One run of each way at a tolerance. */
static void run_all(const bench *b, const kempe_assembly *start, const kmp_reference *reference, double tolerance,
                    point at[WAYS])
{
    static stand rows;
    by_hand_run run;
    kmp_run_report report = {.rate_scale = 1};
    for (int way = NATIVE; way <= TAPE; way++) {
        kmp_run_spec spec = spec_of(way_names[way], tolerance, 1, &t_end);
        run_once(b, start, &spec, &rows, &report);
        at[way] = (point){bench_error_at_end(reference, N, t_end, rows.q[0]), report.cpu_s, report.steps, report.rhs};
    }
    double begin = bench_now();
    if (andrews_by_hand_integrate(t_end, tolerance, report.rate_scale, &run))
        exit(1);
    at[HAND] = (point){bench_error_at_end(reference, N, t_end, run.y), bench_now() - begin, run.steps, run.rhs};
}

/* The straight line through the points within a decade and a half of the error, at it. */
static double time_to(const point (*at)[WAYS], int way, double error)
{
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int k = 0; k < TOLERANCES; k++) {
        double x = log10(at[k][way].error / error), y = log10(at[k][way].cpu);
        if (fabs(x) > 1.5)
            continue;
        n++;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    return pow(10, (sy - slope * sx) / n);
}

static void print_some(const point (*at)[WAYS], const double *tolerance)
{
    printf("\n%-8s | %-32s | %-32s | %s\n", "rtol", "native: error, steps, rhs, ms", "tape", "by hand");
    for (int k = 0; k < TOLERANCES; k += DECADE) {
        printf("%.0e   ", tolerance[k]);
        for (int way = 0; way < WAYS; way++)
            printf("| %.1e %5ld %6ld %8.4f   ", at[k][way].error, at[k][way].steps, at[k][way].rhs,
                   1e3 * at[k][way].cpu);
        printf("\n");
    }
    printf("\n");
}

static void whole_runs(const bench *b, const kempe_assembly *start, const kmp_reference *reference)
{
    static point at[TOLERANCES][WAYS];
    double tolerance[TOLERANCES], cpu[WAYS][RUNS];
    for (int k = 0; k < TOLERANCES; k++) {
        tolerance[k] = pow(10, -5 - (double)k / DECADE);
        for (int r = 0; r < RUNS; r++) {
            run_all(b, start, reference, tolerance[k], at[k]);
            for (int way = 0; way < WAYS; way++)
                cpu[way][r] = at[k][way].cpu;
        }
        for (int way = 0; way < WAYS; way++)
            at[k][way].cpu = bench_median(RUNS, cpu[way]);
    }
    print_some((const point(*)[WAYS])at, tolerance);
    for (int k = 0; k < 2; k++) {
        double ms[WAYS];
        for (int way = 0; way < WAYS; way++)
            ms[way] = 1e3 * time_to((const point(*)[WAYS])at, way, errors[k]);
        double times = ms[NATIVE] / ms[HAND];
        printf("error %.0e: native %.3f ms (at most %.2f) or %.2f times by hand, %.3f ms (at most %.1f): %s; tape "
               "%.3f ms",
               errors[k], ms[NATIVE], bar_native[k], times, ms[HAND], bar_driver,
               judge(ms[NATIVE] <= bar_native[k] || times <= bar_driver), ms[TAPE]);
        printf(k == 1 ? " (at most %.1f): %s\n" : "\n", bar_tape, k == 1 ? judge(ms[TAPE] <= bar_tape) : "");
    }
}

/* -- building ---------------------------------------------------------------------------------------- */

/* Reading, deriving, machine code of the motion's program and of the fused one at the start. */
static void build_once(const kempe_assembly *start, double part[3])
{
    bench b = {kempe_context_new(), NULL, NULL};
    kmp_partition u;
    kmp_reduction red;
    kmp_reduced_program *program = NULL;
    double begin = bench_now();
    bool ok = kempe_model_read(b.context, model_path, &b.model) == KEMPE_OK;
    part[0] = bench_now() - begin;
    ok = ok && kempe_system_new(b.model, &b.system) == KEMPE_OK;
    part[1] = bench_now() - begin - part[0];
    kmp_evaluator *eval = ok ? kmp_eval_new(b.system, "native") : NULL;
    if (!eval)
        exit(1);
    kmp_eval_closure(eval, 0, start->q);
    if (kmp_partition_init(&u, b.system, eval->jacobian, NULL, 0) || kmp_reduction_init(&red, eval, &u) ||
        kmp_reduction_factor(&red) || kmp_reduced_program_new(&program, &red, false))
        exit(1);
    part[2] = bench_now() - begin - part[0] - part[1];
    kmp_reduced_program_free(program);
    kmp_reduction_free(&red);
    kmp_partition_free(&u);
    kmp_eval_free(eval);
    bench_free(&b);
}

static void building(const kempe_assembly *start)
{
    double part[3], parts[3][BUILDS], whole[BUILDS];
    for (int k = 0; k < BUILDS; k++) {
        build_once(start, part);
        whole[k] = part[0] + part[1] + part[2];
        for (int i = 0; i < 3; i++)
            parts[i][k] = part[i];
    }
    double ms = 1e3 * bench_median(BUILDS, whole);
    printf("building: %.2f ms (read %.2f, derive %.2f, native %.2f; at most %.0f): %s\n", ms,
           1e3 * bench_median(BUILDS, parts[0]), 1e3 * bench_median(BUILDS, parts[1]),
           1e3 * bench_median(BUILDS, parts[2]), bar_build, judge(ms <= bar_build));
}

int bench_andrews(int argc, char **argv)
{
    (void)argc, (void)argv;
    bench b = bench_load(model_path);
    kempe_assembly *start = NULL;
    kmp_reference reference;
    if (kempe_assembly_new(b.system, &start) || kmp_reference_read(b.system, reference_path, &reference)) {
        fprintf(stderr, "%s\n", kempe_context_message(b.context));
        return 1;
    }
    building(start);
    one_right_hand_side(&b, start);
    whole_runs(&b, start, &reference);
    kmp_samples_free(&reference);
    kempe_assembly_free(start);
    bench_free(&b);
    return missed;
}
