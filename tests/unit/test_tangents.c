/* SPDX-License-Identifier: BSD-3-Clause */
/* The iteration matrix of every form of the dae formulation against differences of its residual, column by column,
 * multipliers included. */
#include "integrators/formulations/formulation.h"
#include "integrators/run/methods.h"
#include "loaded.h"
#include "random_model.h"
#include "testing.h"

enum { SIZE = 64, DOF = 32, MODELS = 40 };

typedef struct bench {
    kempe_system *system;
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_formulation *formulation;
} bench;

/* At random coordinates: nothing has to be closed for a residual. */
static bool bench_open(bench *b, const random_model *r, const kmp_formulation_kind *kind)
{
    double q[DOF] = {0}, zero[DOF] = {0};
    *b = (bench){0};
    if (kempe_system_new(r->model, &b->system) != KEMPE_OK)
        return false;
    b->eval = kmp_eval_new(b->system, "tape");
    for (int k = 0; k < b->system->n; k++)
        q[k] = between(-1, 1);
    kmp_eval_closure(b->eval, 0, q);
    if (kmp_partition_init(&b->part, b->system, b->eval->jacobian, NULL, 0) != KEMPE_OK)
        return false;
    kmp_formulation_start start = {.system = b->system,
                                   .eval = b->eval,
                                   .part = &b->part,
                                   .q = q,
                                   .qd = zero,
                                   .qdd = zero,
                                   .lambda = zero,
                                   .rtol = 1e-6,
                                   .atol = 1e-6,
                                   .rate_scale = 0.2,
                                   .dae = true};
    b->formulation = kind->create(kind, &start);
    return b->formulation != NULL;
}

static void bench_close(bench *b)
{
    if (b->formulation)
        b->formulation->release(b->formulation);
    kmp_partition_free(&b->part);
    kmp_eval_free(b->eval);
    kempe_system_free(b->system);
}

/* F along (dy, dyp) = e_c (1, cj). */
typedef struct along {
    const kmp_dae *dae;
    double t, cj;
    const double *y, *yp;
    int column;
} along;

static void residual_field(void *user, const double *s, double *out)
{
    const along *a = user;
    double y[SIZE], yp[SIZE];
    memcpy(y, a->y, sizeof y);
    memcpy(yp, a->yp, sizeof yp);
    y[a->column] += s[0];
    yp[a->column] += a->cj * s[0];
    CHECK(a->dae->residual(a->dae->self, a->t, y, yp, out) == KMP_GO);
}

/* The column of compressed values, spread. */
static void spread(const kmp_dae *dae, const double *values, int column, double *out)
{
    for (int i = 0; i < dae->n; i++)
        out[i] = 0;
    for (long k = dae->col_start[column]; k < dae->col_start[column + 1]; k++) {
        CHECK(dae->row[k] >= 0 && dae->row[k] < dae->n);
        CHECK(k == dae->col_start[column] || dae->row[k] > dae->row[k - 1]);
        out[dae->row[k]] += values[k];
    }
}

static void check_column(int number, along *a, const double *values)
{
    double zero = 0, one = 1, expected[SIZE], column[SIZE], size = 1;
    difference(residual_field, a, 1, &zero, &one, a->dae->n, expected);
    spread(a->dae, values, a->column, column);
    for (int i = 0; i < a->dae->n; i++)
        size = check_max(size, fabs(expected[i]));
    for (int i = 0; i < a->dae->n; i++)
        if (!(fabs(column[i] - expected[i]) <= 1e-7 * size)) {
            check_failures++;
            printf("model %d: entry (%d, %d) of %d is %.12g, by differences %.12g\n", number, i, a->column, a->dae->n,
                   column[i], expected[i]);
        }
}

static void check_matrix(int number, const kmp_dae *dae, double cj)
{
    double y[SIZE], yp[SIZE], *values = KMP_NEW(double, dae->nz);
    for (int k = 0; k < SIZE; k++) {
        y[k] = between(-1.5, 1.5);
        yp[k] = between(-3, 3);
    }
    along a = {dae, 0.4, cj, y, yp, 0};
    CHECK(dae->col_start[0] == 0 && dae->col_start[dae->n] == dae->nz);
    CHECK(dae->matrix(dae->self, a.t, cj, y, yp, values) == KMP_GO);
    for (; a.column < dae->n; a.column++)
        check_column(number, &a, values);
    kmp_free(values);
}

static void check_form(const kmp_formulation_kind *kind)
{
    int used = 0;
    for (int number = 0; number < MODELS; number++) {
        bench b;
        random_model r = random_model_new((uint64_t)(number + 101), 1 + number % 4, (unsigned)number * 7 % 16);
        CHECK(r.model != NULL);
        if (r.model && bench_open(&b, &r, kind)) {
            int multipliers = b.formulation->size - 2 * b.part.n;
            CHECK(multipliers == b.part.r || multipliers == 2 * b.part.r);
            CHECK(b.formulation->dae.n == b.formulation->size && b.formulation->size <= SIZE);
            check_matrix(number, &b.formulation->dae, 0.7);
            check_matrix(number, &b.formulation->dae, 1);
            used++;
        }
        bench_close(&b);
        random_model_free(&r);
    }
    CHECK(4 * used >= 3 * MODELS);
}

static void test_tangents(void)
{
    int forms = 0;
    for (int k = 0; kmp_formulation_get(k); k++)
        if (kmp_formulation_get(k)->dae) {
            int before = check_failures;
            check_form(kmp_formulation_get(k));
            printf("  %s%s\n", kmp_formulation_get(k)->form, check_failures > before ? ": wrong" : "");
            forms++;
        }
    CHECK(forms >= 5);
}

/* C by the multipliers that forces depend on. */
static void test_loads(void)
{
    loaded s = load("tests/models/guide_friction_carrier.yaml");
    random_model r = {.model = s.model};
    for (int k = 0; kmp_formulation_get(k); k++) {
        bench b;
        if (!kmp_formulation_get(k)->dae)
            continue;
        CHECK(bench_open(&b, &r, kmp_formulation_get(k)));
        CHECK(b.system->load_row_count == 3);
        for (int n = 0; n < 5; n++)
            check_matrix(n, &b.formulation->dae, 0.7);
        bench_close(&b);
    }
    unload(&s);
}

int main(void)
{
    TEST(test_tangents);
    TEST(test_loads);
    return check_report();
}
