/* SPDX-License-Identifier: BSD-3-Clause */
/* Four variants of radau's iteration on the projected formulation, run alternately: every sweep solves the equations in
 * each lane; later sweeps use the residual and the factors of the step's first sweep in each lane; later sweeps use one
 * factor for all lanes, that of the middle stage; four stages in four lanes replace seven in eight. The table has the
 * CPU time of a run at equal error of q, which is the largest at ROWS times over max(|q|, 1), against dop853 at rtol
 * 1e-13. All programs are made before the run. The table also has the time of their making, and the number of sweeps
 * that saves it.
 *
 *     bench sweeps [-v] [MODEL.yaml T_END | "windows N" T_END] ..
 */
#include "base/memory.h"
#include "bench.h"
#include "chain.h"
#include "constraints/programs/saddle_program.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include "integrators/steppers/collocation.h"
#include "output/samples.h"
#include "tests/solved_lanes.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { W = KMP_COLLOCATION_LANES, MIDDLE = 3, ROWS = 240, TURNS = 5, TARGETS = 3, POINTS = 8, CALLS = 100 };
typedef enum way { WHOLE, NEARBY, ONE_FACTOR, FOUR_STAGES, WAYS } way;

static const char *const names[WAYS] = {"whole", "nearby", "one factor", "four stages"};
static const double target[TARGETS] = {1e-6, 1e-8, 1e-10};

static void fail(const bench *b)
{
    fprintf(stderr, "%s\n", kempe_context_message(b->context));
    exit(1);
}

/* -- sweeps -------------------------------------------------------------------------------------------- */

typedef struct programs {
    way way;
    int width; /* of `all` */
    kmp_evaluator *eval;
    kmp_saddle_program *solved;
    const kmp_saddle_program_layout *layout;
    kmp_program *nearby;
    kmp_lanes *all, *near, *one; /* eight lanes each; one lane */
    double *wide, *times, cycles, made;
    const double *of_run; /* of the last run; NULL: the factors have been taken */
} programs;

static programs *present; /* of the run: the callbacks have the formulation */

static void make(programs *p, kmp_runner *run, const bench *b, way how)
{
    *p = (programs){.eval = run->eval, .cycles = 1, .way = how, .width = how == FOUR_STAGES ? 4 : W};
    kmp_eval_closure(run->eval, 0, run->room.state);
    if (kmp_saddle_program_new(&p->solved, run->eval, &run->part) != KEMPE_OK || !p->solved)
        fail(b);
    p->layout = kmp_saddle_program_layout_of(p->solved);
    double from = bench_now();
    if (!kmp_saddle_program_write_near(run->eval, &run->part, INFINITY, &p->nearby) || !p->nearby ||
        !p->layout->factors)
        fail(b);
    p->near = kmp_lanes_new(p->nearby, W, false);
    p->made = bench_now() - from;
    p->all = solved_lanes(p->solved, p->eval, p->width);
    p->one = solved_lanes(p->solved, p->eval, 1);
    renew_solved_lanes(p->eval, W, p->near);
    p->wide = aligned_alloc(64, (size_t)p->layout->factors * W * sizeof *p->wide);
    p->times = calloc((size_t)kmp_present_inputs_size(&run->eval->inputs) * W, sizeof *p->times);
}

static void drop(programs *p)
{
    kmp_lanes_free(p->all);
    kmp_lanes_free(p->near);
    kmp_lanes_free(p->one);
    kmp_saddle_program_free(p->solved);
    kmp_program_free(p->nearby);
    free(p->wide);
    free(p->times);
}

static void place(programs *p, kmp_lanes *lanes, const double *t, const double *y)
{
    kmp_present_inputs_lanes(&p->eval->inputs, p->width, t, p->times);
    kmp_lanes_set(lanes, KMP_IN_TIME, p->times);
    kmp_lanes_set(lanes, KMP_IN_Q, y);
    kmp_lanes_set(lanes, KMP_IN_QD, y + p->layout->n * p->width);
}

static void give(const programs *p, const double *qdd, const double *power, double *dy)
{
    size_t w = (size_t)p->width, n = (size_t)p->layout->n;
    memcpy(dy + n * w, qdd, n * w * sizeof *dy);
    if (p->layout->power >= 0)
        memcpy(dy + 2 * n * w, power, w * sizeof *dy);
}

static int evaluate(void *self, const double *t, const double *y, double *dy)
{
    programs *p = present;
    (void)self;
    place(p, p->all, t, y);
    p->of_run = kmp_lanes_run(p->all, KMP_SADDLE_PROGRAM_RUN);
    give(p, p->of_run + p->layout->qdd * p->width, p->of_run + p->layout->power * p->width, dy);
    return KMP_GO;
}

/* Factors at the middle stage, for all lanes. `y`: a sweep later, which makes no difference to the time. */
static const double *factor_once(programs *p, const double *t, const double *y)
{
    int n = p->layout->n;
    double state[2][256];
    for (int k = 0; k < n; k++) {
        state[0][k] = y[k * W + MIDDLE];
        state[1][k] = y[(n + k) * W + MIDDLE];
    }
    kmp_lanes_set(p->one, KMP_IN_TIME, kmp_present_inputs_at(&p->eval->inputs, t[MIDDLE]));
    kmp_lanes_set(p->one, KMP_IN_Q, state[0]);
    kmp_lanes_set(p->one, KMP_IN_QD, state[1]);
    (void)kmp_lanes_run(p->one, KMP_SADDLE_PROGRAM_RUN);
    const double *factors = kmp_lanes_run(p->one, KMP_SADDLE_PROGRAM_FACTORS);
    for (int k = 0; k < p->layout->factors * W; k++)
        p->wide[k] = factors[k / W];
    return p->wide;
}

static int improve(void *self, const double *t, const double *y, double *dy)
{
    programs *p = present;
    int n = p->layout->n;
    (void)self;
    if (p->of_run) {
        bool own = p->way == NEARBY;
        kmp_lanes_set(p->near, KMP_IN_MU,
                      own ? kmp_lanes_run(p->all, KMP_SADDLE_PROGRAM_FACTORS) : factor_once(p, t, y));
        kmp_lanes_set(p->near, KMP_IN_LAMBDA, p->of_run + p->layout->lambda * W);
    }
    p->of_run = NULL;
    place(p, p->near, t, y);
    kmp_lanes_set(p->near, KMP_IN_QDD, dy + n * W);
    const double *out = kmp_lanes_run(p->near, 1), *lambda = out + n * W;
    kmp_lanes_set(p->near, KMP_IN_LAMBDA, lambda);
    give(p, out, lambda + p->layout->r * W, dy);
    return KMP_GO;
}

static double time_of(kmp_lanes *lanes, int stage)
{
    double least = INFINITY;
    for (int turn = 0; turn < CALLS; turn++) {
        double from = bench_now();
        for (int k = 0; k < CALLS; k++)
            (void)kmp_lanes_run(lanes, stage);
        least = fmin(least, bench_now() - from);
    }
    return 1e9 * least / CALLS;
}

/* -- runs ---------------------------------------------------------------------------------------------- */

typedef struct problem {
    bench b;
    kempe_assembly *start;
    double t_end;
    kmp_samples reference;
} problem;

typedef struct point {
    double rtol, error[WAYS], ms[WAYS];
    kmp_run_report report[WAYS];
} point;

static kmp_run_spec spec_of(const problem *p, const char *integrator, double rtol)
{
    return (kmp_run_spec){.formulation = "projected", .integrator = integrator, .rtol = rtol, .t_end = p->t_end};
}

static double error_at(const kmp_samples *reference, int row, const double *q)
{
    double worst = 0;
    const double *ref = reference->value[KMP_QUANTITY_Q] + row * reference->n;
    for (int k = 0; k < reference->n; k++)
        worst = fmax(worst, fabs(q[k] - ref[k]) / fmax(fabs(ref[k]), 1));
    return worst;
}

/* Returns seconds, without rows; INFINITY: the run failed. error (NULL: no rows): the largest. */
static double run(const problem *p, way how, double rtol, double *error, kmp_run_report *report)
{
    kmp_run_spec spec = spec_of(p, "radau", rtol);
    kmp_runner *runner = NULL;
    programs made;
    int next = 0;
    double row[1024], work;
    if (kmp_run_resolve(p->b.system, &spec) || kmp_runner_new(p->b.system, &spec, p->start, &runner))
        fail(&p->b);
    make(&made, runner, &p->b, how);
    present = &made;
    kmp_ode ode = runner->solver->ode;
    ode.lanes = evaluate;
    ode.width = made.width;
    ode.improve = how == NEARBY || how == ONE_FACTOR ? improve : NULL;
    ode.cycles_of_improve = &made.cycles;
    const kmp_solver_kind *kind = runner->kind;
    const kmp_solver_setup setup = {.context = p->b.context, .ode = &ode, .tolerance = runner->solver->tolerance};
    kind->release(runner->solver);
    runner->solver = kind->create(kind, &setup);
    if (!runner->solver || kind->start(runner->solver, 0, runner->formulation->y, NULL, p->t_end, 0) != KEMPE_OK)
        fail(&p->b);
    const void *solver = runner->solver;
    double from = bench_now();
    kempe_status status = KEMPE_OK;
    while (status == KEMPE_OK && kmp_runner_t(runner) < p->t_end) {
        status = kmp_runner_step(runner);
        for (; error && status == KEMPE_OK && next < ROWS && p->reference.t[next] <= kmp_runner_t(runner); next++) {
            status = kmp_runner_row(runner, p->reference.t[next], row, &work);
            *error = fmax(*error, error_at(&p->reference, next, row));
        }
    }
    double took = status == KEMPE_OK && runner->solver == solver ? bench_now() - from : INFINITY;
    kmp_runner_count(runner, report);
    kmp_runner_free(runner);
    drop(&made);
    return took;
}

static double time_to(int count, const point *p, way how, double wanted)
{
    double best = INFINITY;
    for (int k = 0; k < count; k++) {
        const point *a = &p[k], *next = a + 1;
        if (a->error[how] <= wanted)
            best = fmin(best, a->ms[how]);
        if (k + 1 < count && a->error[how] > wanted && next->error[how] <= wanted) {
            double part = log(wanted / a->error[how]) / log(next->error[how] / a->error[how]);
            best = fmin(best, exp((1 - part) * log(a->ms[how]) + part * log(next->ms[how])));
        }
    }
    return best;
}

/* Prints the time of an evaluation, and the number of sweeps that saves the making of the program of places nearby. */
static void print_costs(const problem *p)
{
    kmp_run_spec spec = spec_of(p, "radau", 1e-8);
    kmp_runner *runner = NULL;
    programs made;
    if (kmp_run_resolve(p->b.system, &spec) || kmp_runner_new(p->b.system, &spec, p->start, &runner))
        fail(&p->b);
    make(&made, runner, &p->b, WHOLE);
    kmp_lanes *four = solved_lanes(made.solved, made.eval, 4);
    double in_four = time_of(four, KMP_SADDLE_PROGRAM_RUN), all = time_of(made.all, KMP_SADDLE_PROGRAM_RUN),
           near = time_of(made.near, 1), one = time_of(made.one, KMP_SADDLE_PROGRAM_RUN);
    printf("  operations %ld, nearby %ld; ns in four lanes %.0f, in eight %.0f, nearby %.0f, of one state %.0f; %.2f "
           "ms to make: "
           "%.0f sweeps\n",
           kmp_saddle_program_count(made.solved).paper, kmp_program_count(made.nearby, 1, 1).paper, in_four, all, near,
           one, 1e3 * made.made, 1e9 * made.made / fmax(all - near, 1e-9));
    kmp_lanes_free(four);
    drop(&made);
    kmp_runner_free(runner);
}

static void print_point(const point *p)
{
    for (int how = 0; how < WAYS; how++) {
        const kmp_run_report *r = &p->report[how];
        printf("    rtol %.0e %-11s error %8.1e, %4ld steps, %3ld refused, %5ld sweeps, %2ld Jacobians, %8.4f ms\n",
               p->rtol, names[how], p->error[how], r->steps, r->refused, r->newton, r->jacobians, p->ms[how]);
    }
}

static void measure(const problem *p, bool verbose)
{
    point points[POINTS];
    kmp_run_report report;
    for (int k = 0; k < POINTS; k++) {
        points[k] = (point){.rtol = pow(10, -4 - k)};
        for (way how = 0; how < WAYS; how++) {
            points[k].ms[how] = INFINITY;
            if (!isfinite(run(p, how, points[k].rtol, &points[k].error[how], &points[k].report[how])))
                points[k].error[how] = INFINITY;
        }
    }
    for (int turn = 0; turn < TURNS; turn++)
        for (int k = 0; k < POINTS; k++)
            for (way how = 0; how < WAYS; how++)
                points[k].ms[how] = fmin(points[k].ms[how], 1e3 * run(p, how, points[k].rtol, NULL, &report));
    for (int k = 0; k < POINTS && verbose; k++)
        print_point(&points[k]);
    printf("  ms to an error of 1e-6, 1e-8, 1e-10");
    for (way how = 0; how < WAYS; how++) {
        printf("; %s", names[how]);
        for (int k = 0; k < TARGETS; k++) {
            double ms = time_to(POINTS, points, how, target[k]);
            printf(how == WHOLE ? " %.4g" : " %.4g (%.2f)", ms, ms / time_to(POINTS, points, WHOLE, target[k]));
        }
    }
    printf("\n");
    fflush(stdout);
}

static int add_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                   double work)
{
    return kmp_samples_add(user, t, q, qd, qdd, lambda, work);
}

static void solve(const char *name, double t_end, bool verbose)
{
    problem p = {.b = {.context = kempe_context_new()}, .t_end = t_end};
    char *text = strncmp(name, "windows ", 8) == 0 ? chain_hanging(atoi(name + 8)) : NULL;
    kempe_context *c = p.b.context;
    if ((text ? kempe_model_read_text(c, text, name, &p.b.model) : kempe_model_read(c, name, &p.b.model)) ||
        kempe_system_new(p.b.model, &p.b.system) || kempe_assembly_new(p.b.system, &p.start))
        fail(&p.b);
    printf("%s, %g s: n %d, m %d\n", name, t_end, p.b.system->n, p.b.system->m);
    double times[ROWS];
    for (int k = 0; k < ROWS; k++)
        times[k] = k + 1 == ROWS ? t_end : t_end * (k + 1) / ROWS;
    kmp_run_spec spec = spec_of(&p, "dop853", 1e-13);
    spec.time_count = ROWS;
    spec.times = times;
    kmp_samples_init(&p.reference, p.b.system->n, p.b.system->m);
    kmp_run_report report = {0};
    if (kmp_run_resolve(p.b.system, &spec) || kmp_run(p.b.system, &spec, p.start, add_row, &p.reference, &report))
        fail(&p.b);
    print_costs(&p);
    measure(&p, verbose);
    kmp_samples_free(&p.reference);
    kempe_assembly_free(p.start);
    bench_free(&p.b);
    kmp_free(text);
}

int bench_sweeps(int argc, char **argv)
{
    bool verbose = argc > 1 && strcmp(argv[1], "-v") == 0;
    for (int k = 1 + verbose; k + 1 < argc; k += 2)
        solve(argv[k], atof(argv[k + 1]), verbose);
    return 0;
}
