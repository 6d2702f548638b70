/* SPDX-License-Identifier: BSD-3-Clause */
/* The dae formulation beside the same mechanism written by hand for IDA: Andrews, 0.03 s, the equations of
 * dae_by_hand.h with their exact sparse iteration matrices, KLU called with nothing between (one analysis, one
 * factorisation, refactorisations with its pivots, no watch over their growth), IDA set as in Kempe's adapter; with
 * SUNDIALS' own vectors and with Kempe's. Each form in these three ways in turn, at tolerances half a decade apart; the
 * processor's time is that of the integration, without what is made before it, the median of many runs. Ratios at equal
 * error are read off straight lines through the logarithms of the points within two decades of the error. The program
 * fails where Kempe takes more than 1.5 times the steps or the time of either at an error of 1e-6, or where a matrix by
 * hand is not the derivative of its residual. */
#include "bench.h"
#include "constraints/sundials_compat.h"
#include "dae_by_hand.h"
#include "integrators/sundials/sundials_host.h"
#include "judged.h"

#include <ida/ida.h>
#include <kempe/check.h>
#include <klu.h>
#include <sundials/sundials_linearsolver.h>
#include <sunmatrix/sunmatrix_sparse.h>

enum { TOLERANCES = 19, RUNS = 15, N = BY_HAND_N, M = BY_HAND_M };

static const char *const names[BY_HAND_FORMS] = {"stabilized1", "ggl", "index2", "index1"};

static void check(bool good, const char *what)
{
    if (good)
        return;
    fprintf(stderr, "%s\n", what);
    exit(1);
}

/* -- KLU ---------------------------------------------------------------------------------------------- */

typedef struct factors {
    long n;
    klu_l_common common;
    klu_l_symbolic *symbolic;
    klu_l_numeric *numeric;
} factors;

static SUNLinearSolver_Type type(SUNLinearSolver s)
{
    (void)s;
    return SUNLINEARSOLVER_DIRECT;
}

static SUNLinearSolver_ID id(SUNLinearSolver s)
{
    (void)s;
    return SUNLINEARSOLVER_CUSTOM;
}

static int setup(SUNLinearSolver s, SUNMatrix a)
{
    factors *f = s->content;
    long *start = SUNSparseMatrix_IndexPointers(a), *row = SUNSparseMatrix_IndexValues(a);
    double *value = SUNSparseMatrix_Data(a);
    if (f->numeric)
        return !klu_l_refactor(start, row, value, f->symbolic, f->numeric, &f->common);
    f->symbolic = klu_l_analyze(f->n, start, row, &f->common);
    f->numeric = klu_l_factor(start, row, value, f->symbolic, &f->common);
    return !f->numeric;
}

static int solve(SUNLinearSolver s, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance)
{
    factors *f = s->content;
    (void)a, (void)tolerance;
    memcpy(kmp_sun_data(x), kmp_sun_data(b), (size_t)f->n * sizeof(double));
    return !klu_l_solve(f->symbolic, f->numeric, f->n, 1, kmp_sun_data(x), &f->common);
}

static SUNLinearSolver solver_of(factors *f, SUNContext sun)
{
    SUNLinearSolver s = SUNLinSolNewEmpty(sun);
    klu_l_defaults(&f->common);
    s->content = f;
    s->ops->gettype = type;
    s->ops->getid = id;
    s->ops->setup = setup;
    s->ops->solve = solve;
    return s;
}

/* -- IDA ---------------------------------------------------------------------------------------------- */

static const double start_q[N] = {-0.0617138900142764496358948458001, 0,
                                  0.455279819163070380255912382449,   0.222668390165885884674473185609,
                                  0.487364979543842550225598953530,   -0.222668390165885884674473185609,
                                  1.23054744454982119249735015568};
static const double start_qdd[2] = {14222.4439199541138705911625887, -10666.8329399655854029433719415};
static const double start_lambda[2] = {98.5668703962410896057654982170, -6.12268834425566265503114393122};

/* At 0.03 s, recomputed in quadruple precision: the published digits are good to ten. */
static const double end_q[N] = {15.81077119515370709711, -15.75637105841183946971, 0.04082224011964580485815,
                                -0.53473011634207959377, 0.52440996587995406937,   0.53473011634207959377,
                                1.04808074104193787307};

static double error_of(const double *q)
{
    double worst = 0;
    for (int i = 0; i < N; i++)
        worst = fmax(worst, fabs(q[i] - end_q[i]) / fmax(fabs(end_q[i]), 1));
    return worst;
}

typedef struct hand {
    by_hand_form form;
    bool vectors; /* of Kempe */
    double rtol, rate_scale, gain;
    by_hand_matrix matrix;
    long steps, newton;
    double cpu;
} hand;

static int weights(N_Vector y, N_Vector w, void *user)
{
    const hand *h = user;
    const double *value = kmp_sun_data(y);
    double *weight = kmp_sun_data(w), rtol = h->rtol, rate = rtol * h->rate_scale;
    for (int i = 0; i < N; i++) {
        weight[i] = 1 / (rtol * fabs(value[i]) + rtol);
        weight[N + i] = 1 / (rtol * fabs(value[N + i]) + rate);
    }
    for (int i = 2 * N; i < h->matrix.size; i++)
        weight[i] = 1e-14 / (rtol * fabs(value[i]) + rtol);
    return 0;
}

#define FORM(name, which)                                                                                              \
    static int residual_##name(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *user)                         \
    {                                                                                                                  \
        (void)t;                                                                                                       \
        by_hand_residual(which, ((hand *)user)->gain, kmp_sun_data(y), kmp_sun_data(yp), kmp_sun_data(r));             \
        return 0;                                                                                                      \
    }                                                                                                                  \
    static int jacobian_##name(sunrealtype t, sunrealtype cj, N_Vector y, N_Vector yp, N_Vector r, SUNMatrix a,        \
                               void *user, N_Vector w1, N_Vector w2, N_Vector w3)                                      \
    {                                                                                                                  \
        hand *h = user;                                                                                                \
        (void)t, (void)r, (void)w1, (void)w2, (void)w3;                                                                \
        memcpy(SUNSparseMatrix_IndexPointers(a), h->matrix.start, sizeof(long) * ((size_t)h->matrix.size + 1));        \
        memcpy(SUNSparseMatrix_IndexValues(a), h->matrix.sorted, sizeof(long) * (size_t)h->matrix.count);              \
        h->matrix.value = SUNSparseMatrix_Data(a);                                                                     \
        by_hand_jacobian(which, h->gain, cj, kmp_sun_data(y), kmp_sun_data(yp), &h->matrix);                           \
        return 0;                                                                                                      \
    }

FORM(stabilized1, BY_HAND_STABILIZED1)
FORM(ggl, BY_HAND_GGL)
FORM(index2, BY_HAND_INDEX2)
FORM(index1, BY_HAND_INDEX1)

static const struct {
    IDAResFn residual;
    IDALsJacFn jacobian;
} forms[BY_HAND_FORMS] = {{residual_stabilized1, jacobian_stabilized1},
                          {residual_ggl, jacobian_ggl},
                          {residual_index2, jacobian_index2},
                          {residual_index1, jacobian_index1}};

static hand hand_of(by_hand_form form, double rtol, bool vectors)
{
    double nothing[BY_HAND_MOST] = {0};
    hand h = {.form = form, .vectors = vectors, .rtol = rtol, .rate_scale = sqrt(start_qdd[0])};
    h.gain = 10 * h.rate_scale;
    h.matrix.size = by_hand_size(form);
    by_hand_jacobian(form, h.gain, 1, nothing, nothing, &h.matrix);
    by_hand_compress(&h.matrix);
    return h;
}

static void begin(const hand *h, double *y, double *yp)
{
    memset(y, 0, (size_t)h->matrix.size * sizeof *y);
    memset(yp, 0, (size_t)h->matrix.size * sizeof *y);
    memcpy(y, start_q, sizeof start_q);
    memcpy(yp + N, start_qdd, sizeof start_qdd);
    memcpy((h->form == BY_HAND_STABILIZED1 ? yp : y) + 2 * N, start_lambda, sizeof start_lambda);
}

static void set(hand *h, void *ida, N_Vector y, N_Vector yp, N_Vector differential, SUNLinearSolver s, SUNMatrix a)
{
    for (int i = 0; i < h->matrix.size; i++)
        kmp_sun_data(differential)[i] = i < 2 * N || h->form == BY_HAND_STABILIZED1;
    KMP_SUN_QUIET(IDASetErrHandlerFn, ida);
    check(!IDAInit(ida, forms[h->form].residual, 0, y, yp) && !IDASetUserData(ida, h) &&
              !IDAWFtolerances(ida, weights) && !IDASetLinearSolver(ida, s, a) &&
              !IDASetJacFn(ida, forms[h->form].jacobian) && !IDASetId(ida, differential) &&
              !IDASetSuppressAlg(ida, h->form != BY_HAND_STABILIZED1) && !IDASetNonlinConvCoef(ida, 0.01) &&
              !IDASetInitStep(ida, 0.1 * sqrt(h->rtol) / h->rate_scale) && !IDASetStopTime(ida, 0.03) &&
              !IDASetMaxNumSteps(ida, -1),
          "IDA refused its settings");
}

static bool integrate(hand *h, double *q)
{
    SUNContext sun = kmp_sun_context();
    int size = h->matrix.size;
    N_Vector y = h->vectors ? kmp_vector_new(size, sun) : N_VNew_Serial(size, sun);
    N_Vector yp = N_VClone(y), differential = N_VClone(y);
    SUNMatrix a = SUNSparseMatrix(size, size, h->matrix.count, CSC_MAT, sun);
    factors f = {.n = size};
    SUNLinearSolver linear = solver_of(&f, sun);
    void *ida = IDACreate(sun);
    double t = 0;
    begin(h, kmp_sun_data(y), kmp_sun_data(yp));
    set(h, ida, y, yp, differential, linear, a);
    double from = bench_now();
    int flag = IDASolve(ida, 0.03, &t, y, yp, IDA_NORMAL);
    h->cpu = bench_now() - from;
    (void)IDAGetNumSteps(ida, &h->steps);
    (void)IDAGetNumNonlinSolvIters(ida, &h->newton);
    memcpy(q, kmp_sun_data(y), N * sizeof *q);
    IDAFree(&ida);
    klu_l_free_numeric(&f.numeric, &f.common);
    klu_l_free_symbolic(&f.symbolic, &f.common);
    SUNLinSolFreeEmpty(linear);
    SUNMatDestroy(a);
    N_VDestroy(y);
    N_VDestroy(yp);
    N_VDestroy(differential);
    SUNContext_Free(&sun);
    return flag >= 0;
}

/* -- the matrices by hand ----------------------------------------------------------------------------- */

/* Largest difference, of the largest entry of its column, to central differences of the residual. */
static double jacobian_error(by_hand_form form)
{
    hand h = hand_of(form, 1e-6, false);
    int size = h.matrix.size;
    double y[BY_HAND_MOST] = {0}, yp[BY_HAND_MOST] = {0}, value[BY_HAND_ENTRIES], r[2][BY_HAND_MOST];
    double cj = 3, worst = 0;
    for (int i = 0; i < size; i++) {
        y[i] = sin(1 + 3 * i);
        yp[i] = cos(2 + 5 * i);
    }
    h.matrix.value = value;
    by_hand_jacobian(form, 2, cj, y, yp, &h.matrix);
    for (int col = 0; col < size; col++) {
        double column[BY_HAND_MOST] = {0}, step = 1e-5, largest = 0, off = 0, y0 = y[col], yp0 = yp[col];
        for (long k = h.matrix.start[col]; k < h.matrix.start[col + 1]; k++)
            column[h.matrix.sorted[k]] = value[k];
        for (int side = 0; side < 2; side++) {
            y[col] = y0 + (side ? step : -step);
            yp[col] = yp0 + (side ? cj * step : -cj * step);
            by_hand_residual(form, 2, y, yp, r[side]);
        }
        y[col] = y0;
        yp[col] = yp0;
        for (int i = 0; i < size; i++) {
            largest = fmax(largest, fabs(column[i]));
            off = fmax(off, fabs((r[1][i] - r[0][i]) / (2 * step) - column[i]));
        }
        worst = fmax(worst, off / largest);
    }
    return worst;
}

/* -- side by side ------------------------------------------------------------------------------------- */

enum { HAND, HAND_VECTORS, KEMPE, WAYS };

/* log10 of each, by tolerance. */
typedef struct curve {
    double error[TOLERANCES], steps[TOLERANCES], cpu[TOLERANCES];
} curve;

/* Value of y at an error, on the line of least squares through the points within two decades of it. */
static double at_error(const curve *c, const double *value, double at)
{
    double x = 0, y = 0, xx = 0, xy = 0;
    int count = 0;
    for (int k = 0; k < TOLERANCES; k++) {
        double dx = c->error[k] - at;
        if (fabs(dx) > 2)
            continue;
        count++;
        x += dx;
        y += value[k];
        xx += dx * dx;
        xy += dx * value[k];
    }
    double slope = (count * xy - x * y) / (count * xx - x * x);
    return y / count - slope * x / count;
}

typedef struct scene {
    judged j;
    const kempe_assembly *start;
    curve of[BY_HAND_FORMS][WAYS];
} scene;

typedef struct result {
    double error, cpu;
    long steps, newton;
} result;

static result run_by_hand(by_hand_form form, double rtol, bool vectors)
{
    hand h = hand_of(form, rtol, vectors);
    double q[N];
    check(integrate(&h, q), "the model by hand failed");
    return (result){error_of(q), h.cpu, h.steps, h.newton};
}

static result run_kempe(scene *s, by_hand_form form, double rtol)
{
    double end = 0.03;
    kmp_run_spec spec = {.formulation = "dae",
                         .form = names[form],
                         .linear = "klu",
                         .rtol = rtol,
                         .t_end = end,
                         .time_count = 1,
                         .times = &end};
    check(judged_run(&s->j, &spec, s->start, 1), "Kempe's run failed");
    return (result){s->j.q, s->j.cpu, s->j.report.steps, s->j.report.newton};
}

static void measure(scene *s, by_hand_form form, int k)
{
    double rtol = pow(10, -4 - 0.5 * k), cpu[WAYS][RUNS];
    result r[WAYS];
    for (int run = 0; run < RUNS; run++) {
        r[HAND] = run_by_hand(form, rtol, false);
        r[HAND_VECTORS] = run_by_hand(form, rtol, true);
        r[KEMPE] = run_kempe(s, form, rtol);
        for (int way = 0; way < WAYS; way++)
            cpu[way][run] = r[way].cpu;
    }
    printf("%-7s %7.1e", names[form], rtol);
    for (int way = 0; way < WAYS; way++) {
        curve *c = &s->of[form][way];
        double median = bench_median(RUNS, cpu[way]);
        c->error[k] = log10(r[way].error);
        c->steps[k] = log10((double)r[way].steps);
        c->cpu[k] = log10(median);
        printf(" | %7.1e %5ld %6ld %7.3f %5.2f", r[way].error, r[way].steps, r[way].newton, 1e3 * median,
               1e6 * median / (double)r[way].newton);
    }
    printf("\n");
}

static double time_at(const scene *s, int form, int way, int at)
{
    return pow(10, at_error(&s->of[form][way], s->of[form][way].cpu, at));
}

static double steps_at(const scene *s, int form, int way, int at)
{
    return pow(10, at_error(&s->of[form][way], s->of[form][way].steps, at));
}

/* The worst ratio at 1e-6. */
static double compare(const scene *s)
{
    double worst = 0;
    printf("\nat equal error  | %-20s | %-27s | Kempe's steps by those by hand\n%-7s %7s | %6s %6s %6s | %13s %13s |\n",
           "ms", "Kempe's time by that by hand", "form", "error", "hand", "hand'", "Kempe", "hand", "hand'");
    for (int f = 0; f < BY_HAND_FORMS; f++)
        for (int at = -4; at >= -10; at -= 2) {
            double ms[WAYS], steps = steps_at(s, f, KEMPE, at) / steps_at(s, f, HAND, at);
            for (int way = 0; way < WAYS; way++)
                ms[way] = 1e3 * time_at(s, f, way, at);
            double plain = ms[KEMPE] / ms[HAND], alike = ms[KEMPE] / ms[HAND_VECTORS];
            if (at == -6)
                worst = fmax(worst, fmax(steps, fmax(plain, alike)));
            printf("%-7s %7.0e | %6.3f %6.3f %6.3f | %13.2f %13.2f | %6.2f\n", names[f], pow(10, at), ms[HAND],
                   ms[HAND_VECTORS], ms[KEMPE], plain, alike, steps);
        }
    return worst;
}

int bench_ida_by_hand(int argc, char **argv)
{
    (void)argc, (void)argv;
    static scene s;
    static const char *const title[WAYS] = {"by hand", "by hand, Kempe's vectors (hand')", "Kempe"};
    bench b = bench_load("examples/andrews/andrews.yaml");
    kempe_assembly *start = NULL;
    kmp_reference reference;
    check(!kempe_assembly_new(b.system, &start) &&
              !kmp_reference_read(b.system, "examples/andrews/reference.csv", &reference),
          kempe_context_message(b.context));
    s.j = (judged){.b = &b, .reference = &reference};
    s.start = start;
    for (int f = 0; f < BY_HAND_FORMS; f++)
        check(jacobian_error((by_hand_form)f) < 1e-8, "a matrix by hand is not the derivative of its residual");
    printf("%-15s", "");
    for (int way = 0; way < WAYS; way++)
        printf(" | %-34s", title[way]);
    printf("\n%-7s %7s", "form", "rtol");
    for (int way = 0; way < WAYS; way++)
        printf(" | %7s %5s %6s %7s %5s", "error q", "steps", "Newton", "ms", "us/it");
    printf("\n");
    for (int f = 0; f < BY_HAND_FORMS; f++)
        for (int k = 0; k < TOLERANCES; k++)
            measure(&s, (by_hand_form)f, k);
    double worst = compare(&s);
    printf("at an error of 1e-6 at most %.2f: %s 1.5\n", worst, worst <= 1.5 ? "within" : "NOT within");
    kmp_samples_free(&reference);
    kempe_assembly_free(start);
    bench_free(&b);
    return worst <= 1.5 ? 0 : 1;
}
