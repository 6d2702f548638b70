/* SPDX-License-Identifier: BSD-3-Clause */
/* IDA with every linear solver on Robertson's reaction as a DAE, its dense output and refusals; KINSOL on a 2 x 2
 * system. */
#include "constraints/closing/kinsol.h"
#include "integrators/steppers/solver.h"
#include "integrators/sundials/linear.h"
#include "testing.h"

static const kmp_solver_kind *const ida = &kmp_solver_ida;

/* -- Robertson's reaction: two rates and a balance (Hairer, Wanner, Solving ODEs II, IV.1) ----- */

typedef struct reaction {
    int accepted, halt_after, refuse_at, refused, retry_at, calls, give_up_at, matrices;
} reaction;

static int rates(void *self, double t, const double *y, const double *yp, double *r)
{
    (void)t;
    reaction *s = self;
    s->calls++;
    if (s->calls == s->retry_at)
        return KMP_RETRY;
    if (s->calls == s->give_up_at)
        return KMP_HALT;
    r[0] = -0.04 * y[0] + 1e4 * y[1] * y[2] - yp[0];
    r[1] = 0.04 * y[0] - 1e4 * y[1] * y[2] - 3e7 * y[1] * y[1] - yp[1];
    r[2] = y[0] + y[1] + y[2] - 1;
    return KMP_GO;
}

static int rates_matrix(void *self, double t, double cj, const double *y, const double *yp, double *a)
{
    (void)self;
    (void)t;
    (void)yp;
    double columns[9] = {-0.04 - cj, 0.04, 1, 1e4 * y[2], -1e4 * y[2] - 6e7 * y[1] - cj, 1, 1e4 * y[1], -1e4 * y[1], 1};
    memcpy(a, columns, sizeof columns);
    return KMP_GO;
}

static int count_step(void *self, double t, const double *y, const double *yp)
{
    (void)t;
    (void)yp;
    reaction *s = self;
    CHECK(fabs(y[0] + y[1] + y[2] - 1) < 1e-8);
    if (s->accepted + 1 == s->refuse_at && s->refused++ < 2)
        return KMP_RETRY;
    return ++s->accepted == s->halt_after ? KMP_HALT : KMP_GO;
}

static const int64_t col_start[] = {0, 3, 6, 9}, row[] = {0, 1, 2, 0, 1, 2, 0, 1, 2};
static const double differential[] = {1, 1, 0}, factor[] = {1, 1, 1e8}, absolute[] = {1e-12, 1e-16, 1e-12};
static const double start_y[] = {1, 0, 0}, start_yp[] = {-0.04, 0.04, 0};

static kmp_dae robertson(reaction *s)
{
    return (kmp_dae){.n = 3,
                     .nz = 9,
                     .col_start = col_start,
                     .row = row,
                     .differential = differential,
                     .factor = factor,
                     .self = s,
                     .residual = rates,
                     .matrix = rates_matrix,
                     .accept = count_step};
}

static const char *linear = "auto"; /* of the tests that run */

static void *start_robertson(kempe_context *context, reaction *r)
{
    kmp_dae dae = robertson(r);
    kmp_solver *s = ida->create(
        ida, &(kmp_solver_setup){
                 .context = context, .dae = &dae, .tolerance = (kmp_tolerance){1e-10, absolute}, .linear = linear});
    CHECK(s != NULL);
    CHECK(ida->start(s, 0, start_y, start_yp, 40, 1e-7) == KEMPE_OK);
    return s;
}

static kempe_status run_to(kmp_solver *s, double t_end)
{
    kempe_status status = KEMPE_OK;
    while (status == KEMPE_OK && s->t < t_end)
        status = ida->step(s);
    return status;
}

static void check_at_40(kmp_solver *s)
{
    double y[3], yp[3];
    CHECK(s->t == 40);
    CHECK(ida->dense(s, 40, y, yp) == KEMPE_OK);
    CHECK_NEAR(y[0], 0.7158270687193941, 1e-8);
    CHECK(fabs(y[1] - 0.9185534764557338e-5) < 1e-12);
    CHECK_NEAR(y[2], 0.2841637457458413, 1e-8);
    CHECK_NEAR(yp[0], -0.04 * y[0] + 1e4 * y[1] * y[2], 1e-7);
}

static void test_robertson(void)
{
    kempe_context *context = kempe_context_new();
    reaction r = {0};
    kmp_solver *s = start_robertson(context, &r);
    CHECK(run_to(s, 40) == KEMPE_OK);
    check_at_40(s);
    kmp_solver_work w = s->work;
    CHECK(w.steps == r.accepted && w.steps > 50 && w.factorizations > 0 && w.rhs == r.calls);
    CHECK(ida->start(s, 0, start_y, start_yp, 40, 1e-7) == KEMPE_OK);
    CHECK(run_to(s, 40) == KEMPE_OK);
    check_at_40(s);
    CHECK(s->work.steps == 2 * w.steps); /* the counters go on */
    CHECK(ida->step(s) == KEMPE_OK && s->t == 40);
    ida->release(s);
    kempe_context_free(context);
}

static void test_dense_output(void)
{
    kempe_context *context = kempe_context_new();
    reaction r = {0};
    kmp_solver *s = start_robertson(context, &r);
    double y[3], yp[3], last[3] = {1, 0, 0};
    CHECK(ida->dense(s, 0, y, yp) == KEMPE_OK && y[0] == 1 && yp[1] == 0.04);
    while (s->t < 0.4) {
        CHECK(ida->step(s) == KEMPE_OK);
        double t0 = s->t_old, t1 = s->t, after[3];
        CHECK(ida->dense(s, t0, y, yp) == KEMPE_OK);
        CHECK_NEAR(y[0], last[0], 1e-9);
        CHECK(ida->dense(s, 0.5 * (t0 + t1), y, yp) == KEMPE_OK);
        CHECK(ida->dense(s, t1, last, yp) == KEMPE_OK);
        CHECK(y[0] < t0 + 1 && last[0] <= y[0]);
        CHECK(ida->dense(s, t1, after, yp) == KEMPE_OK && memcmp(after, last, sizeof last) == 0);
    }
    CHECK(ida->dense(s, 1e9, y, yp) == KEMPE_E_BUG);
    ida->release(s);
    kempe_context_free(context);
}

static void test_retry_halt_and_giving_up(void)
{
    kempe_context *context = kempe_context_new();
    reaction retry = {.retry_at = 30}, halt = {.halt_after = 7}, give_up = {.give_up_at = 40};
    kmp_solver *s = start_robertson(context, &retry);
    CHECK(run_to(s, 40) == KEMPE_OK && s->work.refused > 0);
    check_at_40(s);
    ida->release(s);
    s = start_robertson(context, &halt);
    CHECK(run_to(s, 40) == KEMPE_E_FAILED && halt.accepted == 7);
    ida->release(s);
    s = start_robertson(context, &give_up);
    CHECK(run_to(s, 40) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(context), "the equations failed") != NULL);
    ida->release(s);
    kempe_context_free(context);
}

static int singular_matrix(void *self, double t, double cj, const double *y, const double *yp, double *a)
{
    rates_matrix(self, t, cj, y, yp, a);
    a[2] = a[5] = a[8] = 0;
    return KMP_GO;
}

/* Singular at one call alone: the step is tried again. */
static int singular_once(void *self, double t, double cj, const double *y, const double *yp, double *a)
{
    reaction *r = self;
    bool now = ++r->matrices == 4;
    return now ? singular_matrix(self, t, cj, y, yp, a) : rates_matrix(self, t, cj, y, yp, a);
}

/* A step that is refused is made shorter, from where it began. */
static void test_refused(void)
{
    kempe_context *context = kempe_context_new();
    reaction r = {.refuse_at = 30};
    kmp_solver *s = start_robertson(context, &r);
    double t = 0, tried = 0;
    for (int k = 0; k < 30; k++) {
        tried = s->t - t;
        t = s->t;
        CHECK(ida->step(s) == KEMPE_OK && s->t_old == t);
    }
    CHECK(r.refused == 3 && s->t - t < 0.6 * tried);
    CHECK(run_to(s, 40) == KEMPE_OK);
    check_at_40(s);
    kmp_solver_work w = s->work;
    CHECK(w.steps == r.accepted && w.refused >= 2);
    ida->release(s);
    kempe_context_free(context);
}

static void test_singular_matrix_is_reported(void)
{
    kempe_context *context = kempe_context_new();
    reaction r = {0};
    kmp_dae dae = robertson(&r);
    dae.matrix = singular_matrix;
    kmp_solver *s = ida->create(
        ida, &(kmp_solver_setup){
                 .context = context, .dae = &dae, .tolerance = (kmp_tolerance){1e-8, absolute}, .linear = linear});
    CHECK(ida->start(s, 0, start_y, start_yp, 40, 1e-7) == KEMPE_OK);
    CHECK(run_to(s, 40) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(context), "singular") != NULL);
    printf("  %s\n", kempe_context_message(context));
    ida->release(s);
    dae.matrix = singular_once;
    s = ida->create(
        ida, &(kmp_solver_setup){
                 .context = context, .dae = &dae, .tolerance = (kmp_tolerance){1e-10, absolute}, .linear = linear});
    CHECK(ida->start(s, 0, start_y, start_yp, 40, 1e-7) == KEMPE_OK);
    CHECK(run_to(s, 40) == KEMPE_OK && r.matrices > 4);
    check_at_40(s);
    ida->release(s);
    CHECK(ida->create(ida, &(kmp_solver_setup){.context = context,
                                               .dae = &dae,
                                               .tolerance = (kmp_tolerance){1e-8, absolute},
                                               .linear = "abacus"}) == NULL);
    CHECK(strstr(kempe_context_message(context), "abacus") != NULL);
    kempe_context_free(context);
}

/* -- linear solvers on their own ---------------------------------------------------------------------- */

/* Values of one pattern whose good pivots move to other places from matrix to matrix: 1 on the diagonal of some, 1e-9
 * on that of others, and a solution that must come out whatever the factorisation before was. */
static void fill(SUNMatrix a, int n, int k)
{
    sunindextype *start = SUNSparseMatrix_IndexPointers(a), *place = SUNSparseMatrix_IndexValues(a);
    double *value = SUNSparseMatrix_Data(a);
    for (int c = 0, at = 0; c < n; c++) {
        start[c] = at;
        for (int r = c > 0 ? c - 1 : 0; r <= c + 1 && r < n; r++, at++) {
            place[at] = r;
            value[at] = r != c ? 1 + 0.1 * r + 0.03 * c : k % 3 == 1 ? 1e-9 : k % 3 == 2 ? -1e-13 : 4.0 + k;
        }
        start[c + 1] = at;
    }
}

static double miss(SUNMatrix a, int n, const double *x, const double *b)
{
    const sunindextype *start = SUNSparseMatrix_IndexPointers(a), *place = SUNSparseMatrix_IndexValues(a);
    double r[40] = {0}, worst = 0;
    for (int c = 0; c < n; c++)
        for (sunindextype k = start[c]; k < start[c + 1]; k++)
            r[place[k]] += SUNSparseMatrix_Data(a)[k] * x[c];
    for (int i = 0; i < n; i++)
        worst = check_max(worst, fabs(r[i] - b[i]));
    return worst;
}

static void check_solves(const char *name, int n)
{
    SUNContext sun = kmp_sun_context();
    SUNMatrix a = SUNSparseMatrix(n, n, 3 * n, CSC_MAT, sun);
    SUNLinearSolver s = kmp_linear_new(name, a, sun);
    N_Vector x = N_VNew_Serial(n, sun), b = N_VNew_Serial(n, sun);
    CHECK(s && SUNLinSolInitialize(s) == 0);
    for (int k = 0; k < 12; k++) {
        fill(a, n, k);
        for (int i = 0; i < n; i++)
            kmp_sun_data(b)[i] = kmp_sun_data(x)[i] = sin(i + k);
        bool singular = k == 7;
        if (singular)
            memset(SUNSparseMatrix_Data(a), 0, (size_t)(3 * n - 2) * sizeof(double));
        int flag = SUNLinSolSetup(s, a);
        CHECK(singular ? flag > 0 : flag == 0);
        if (singular)
            continue;
        CHECK(SUNLinSolSolve(s, a, x, k % 2 ? x : b, 0) == 0); /* in place, and apart */
        CHECK(miss(a, n, kmp_sun_data(x), kmp_sun_data(b)) < 1e-11);
    }
    N_VDestroy(x);
    N_VDestroy(b);
    SUNLinSolFree(s);
    SUNMatDestroy(a);
    SUNContext_Free(&sun);
}

/* Entries of the factors that the choice makes for a matrix with `band` full diagonals on each side. */
static int64_t fill_of_choice(int n, int band)
{
    SUNContext sun = kmp_sun_context();
    SUNMatrix a = SUNSparseMatrix(n, n, n * n, CSC_MAT, sun);
    sunindextype *start = SUNSparseMatrix_IndexPointers(a), *index = SUNSparseMatrix_IndexValues(a), nz = 0;
    for (int c = 0; c < n; c++) {
        start[c] = nz;
        for (int r = c > band ? c - band : 0; r < n && r <= c + band; r++) {
            SUNSparseMatrix_Data(a)[nz] = r == c ? 2.0 * n : sin(r + 3.0 * c);
            index[nz++] = r;
        }
    }
    start[n] = nz;
    SUNLinearSolver s = kmp_linear_new("auto", a, sun);
    CHECK(s && SUNLinSolSetup(s, a) == 0);
    int64_t entries = kmp_linear_fill(s);
    SUNLinSolFree(s);
    SUNMatDestroy(a);
    SUNContext_Free(&sun);
    return entries;
}

/* Small and nearly full matrices are factored as dense ones. */
static void test_the_choice_is_by_size_and_fill(void)
{
    CHECK(fill_of_choice(9, 1) == 81);
    CHECK(fill_of_choice(40, 39) == 1600);
    CHECK(fill_of_choice(40, 30) == 1600);
    CHECK(fill_of_choice(40, 1) < 160);
    CHECK(fill_of_choice(40, 5) < 1000);
}

/* Every linear solver, then their choice. */
static const char *name_of(int k)
{
    return k > 0 && !kmp_linear_name(k) && kmp_linear_name(k - 1) ? "auto" : kmp_linear_name(k);
}

static void test_linear_solvers_solve(void)
{
    for (int k = 0; name_of(k); k++) {
        check_solves(name_of(k), 6);
        check_solves(name_of(k), 34);
    }
    SUNContext sun = kmp_sun_context();
    SUNMatrix a = SUNSparseMatrix(3, 3, 3, CSC_MAT, sun);
    CHECK(kmp_linear_new("abacus", a, sun) == NULL);
    SUNMatDestroy(a);
    SUNContext_Free(&sun);
}

/* -- KINSOL: a circle and a hyperbola ----------------------------------------------------------------- */

static int curves(void *self, const double *x, double *r)
{
    (void)self;
    r[0] = x[0] * x[0] + x[1] * x[1] - 5;
    r[1] = x[0] * x[1] - 2;
    return KMP_GO;
}

static int curves_jacobian(void *self, const double *x, double *a)
{
    (void)self;
    a[0] = 2 * x[0];
    a[1] = x[1];
    a[2] = 2 * x[1];
    a[3] = x[0];
    return KMP_GO;
}

/* x^2 + 1 has no root; its Jacobian vanishes at 0. */
static int rootless(void *self, const double *x, double *r)
{
    (void)self;
    r[0] = x[0] * x[0] + 1;
    return KMP_GO;
}

static int rootless_jacobian(void *self, const double *x, double *a)
{
    (void)self;
    a[0] = 2 * x[0];
    return KMP_GO;
}

static void test_kinsol(void)
{
    const double one[2] = {1, 1};
    const kmp_kinsol_problem two = {NULL, 2, one, one, curves, curves_jacobian};
    const kmp_kinsol_problem none = {NULL, 1, one, one, rootless, rootless_jacobian};
    double x[2] = {30, 1};
    int iterations = 0;
    CHECK(kmp_kinsol_solve(&two, 1e-13, x, &iterations));
    CHECK_NEAR(x[0], 2, 1e-12);
    CHECK_NEAR(x[1], 1, 1e-12);
    CHECK(iterations > 2 && iterations < 20);
    x[0] = x[1] = 0; /* the Jacobian is singular */
    CHECK(!kmp_kinsol_solve(&two, 1e-13, x, &iterations) && x[0] == 0 && x[1] == 0);
    x[0] = 3;
    CHECK(!kmp_kinsol_solve(&none, 1e-13, x, &iterations) && x[0] == 3);
}

int main(void)
{
    for (int k = 0; name_of(k); k++) {
        linear = name_of(k);
        printf("%s\n", linear);
        CHECK(kmp_linear_find(linear) && strstr(kmp_linear_names(), linear));
        TEST(test_robertson);
        TEST(test_dense_output);
        TEST(test_retry_halt_and_giving_up);
        TEST(test_refused);
        TEST(test_singular_matrix_is_reported);
    }
    TEST(test_linear_solvers_solve);
    TEST(test_the_choice_is_by_size_and_fill);
    TEST(test_kinsol);
    return check_report();
}
