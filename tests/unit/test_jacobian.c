/* SPDX-License-Identifier: BSD-3-Clause */
/* The exact Jacobian of the reduced right-hand side (closed form), and the iteration matrix of the same equations as a
 * residual, against central differences, on the examples and on random mechanisms: trees and looped ones, with and
 * without forces and damping. */
#include "constraints/closing/assemble.h"
#include "integrators/formulations/formulation.h"
#include "random_model.h"
#include "testing.h"
#include <kempe/check.h>

enum { MOST = 64, MODELS = 120 };

typedef struct bench {
    kempe_system *system;
    kempe_assembly *assembly;
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_formulation *formulation;
} bench;

static void bench_close(bench *b)
{
    if (b->formulation)
        b->formulation->release(b->formulation);
    kmp_partition_free(&b->part);
    kmp_eval_free(b->eval);
    kempe_assembly_free(b->assembly);
    kempe_system_free(b->system);
}

/* The closed form at the assembled state, closing to rounding. */
static bool bench_open(bench *b, const kempe_model *model)
{
    double zero[MOST] = {0};
    *b = (bench){0};
    if (kempe_system_new(model, &b->system) != KEMPE_OK || kempe_assembly_new(b->system, &b->assembly) != KEMPE_OK)
        return false;
    b->eval = kmp_eval_new(b->system, "tape");
    kmp_eval_closure(b->eval, 0, b->assembly->q);
    if (kmp_partition_init(&b->part, b->system, b->eval->jacobian, NULL, 0) != KEMPE_OK || b->part.p == 0)
        return false;
    kmp_formulation_start start = {.system = b->system,
                                   .eval = b->eval,
                                   .part = &b->part,
                                   .q = b->assembly->q,
                                   .qd = b->assembly->qd,
                                   .qdd = zero,
                                   .lambda = zero,
                                   .rtol = 1e-14,
                                   .atol = 1e-14,
                                   .rate_scale = 1,
                                   .implicit = true,
                                   .dae = true};
    b->formulation = kmp_formulation_newton.create(&kmp_formulation_newton, &start);
    return b->formulation != NULL;
}

typedef struct along {
    const kmp_ode *ode;
    const kmp_dae *dae; /* the residual instead, y' moving along by cj; NULL: the right-hand side */
    const double *y, *yp;
    double cj;
    double t;
    int column;
    double step;
    bool failed;
} along;

/* Right-hand side some of s along a column. */
static void rhs_field(void *user, const double *s, double *out)
{
    along *a = user;
    double y[MOST], yp[MOST];
    memcpy(y, a->y, (size_t)a->ode->n * sizeof *y);
    y[a->column] += a->step * s[0];
    int said;
    if (a->dae) {
        memcpy(yp, a->yp, (size_t)a->ode->n * sizeof *yp);
        yp[a->column] += a->cj * a->step * s[0];
        said = a->dae->residual(a->dae->self, a->t, y, yp, out);
    } else
        said = a->ode->rhs(a->ode->self, a->t, y, out);
    a->failed = said != KMP_GO || a->failed;
}

/* The worst relative difference of one column; negative when the state cannot be evaluated nearby. */
static double column_off(along a, int column, double step, const double *j)
{
    double worst = 0, size = 1e-3, zero = 0, one = 1, expected[MOST];
    a.column = column;
    a.step = step;
    difference(rhs_field, &a, 1, &zero, &one, a.ode->n, expected);
    for (int i = 0; i < a.ode->n; i++)
        size = check_max(size, fabs(expected[i] / step));
    for (int i = 0; i < a.ode->n; i++)
        worst = check_max(worst, fabs(j[i] - expected[i] / step) / size);
    return a.failed ? -1 : worst;
}

/* Differences of all columns, each by the best of three steps: where little mass moves, rounding of the right-hand side
 * shows in the shortest one. */
static double worst_of(along a, const double *j)
{
    double worst = 0;
    for (int c = 0; c < a.ode->n; c++) {
        double off = column_off(a, c, 1e-2, j + c * a.ode->n);
        for (int k = 0; off >= 0 && k < 2; k++) {
            double other = column_off(a, c, k ? 1e-1 : 3e-2, j + c * a.ode->n);
            off = other >= 0 ? fmin(off, other) : off;
        }
        if (off < 0)
            return -1;
        worst = check_max(worst, off);
    }
    return worst;
}

static double worst_column(const kmp_ode *ode, double t, const double *y)
{
    static double j[MOST * MOST];
    memset(j, 0, sizeof j);
    if (ode->jacobian(ode->self, t, y, j) != KMP_GO)
        return -1;
    return worst_of((along){.ode = ode, .y = y, .t = t}, j);
}

/* Differences of the iteration matrix, where the residual vanishes. */
static double worst_of_matrix(const kmp_ode *ode, const kmp_dae *dae, double t, const double *y)
{
    static double j[MOST * MOST], values[MOST * MOST];
    double yp[MOST], cj = 7;
    memset(j, 0, sizeof j);
    CHECK(dae->n == ode->n && dae->nz <= MOST * MOST);
    if (ode->rhs(ode->self, t, y, yp) != KMP_GO || dae->matrix(dae->self, t, cj, y, yp, values) != KMP_GO)
        return -1;
    for (int c = 0; c < dae->n; c++)
        for (long k = dae->col_start[c]; k < dae->col_start[c + 1]; k++)
            j[dae->row[k] + (long)c * dae->n] = values[k];
    return worst_of((along){.ode = ode, .dae = dae, .y = y, .yp = yp, .t = t, .cj = cj}, j);
}

/* At the start, with rates of our own. */
static double check_bench(bench *b)
{
    double y[MOST];
    memcpy(y, b->formulation->y, (size_t)b->formulation->size * sizeof *y);
    for (int k = 0; k < b->part.p; k++)
        y[b->part.p + k] += between(-2, 2);
    double matrix = worst_of_matrix(&b->formulation->ode, &b->formulation->dae, 0, y);
    CHECK(matrix < 1e-6);
    return fmax(matrix, worst_column(&b->formulation->ode, 0, y));
}

static void test_examples(void)
{
    static const char *const files[] = {"examples/andrews/andrews.yaml",           "examples/four_bar/four_bar.yaml",
                                        "examples/slider_crank/slider_crank.yaml", "tests/models/fourbar2.yaml",
                                        "tests/models/bricard_balls.yaml",         "tests/models/pendulum.yaml"};
    for (size_t f = 0; f < sizeof files / sizeof *files; f++) {
        char path[512];
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        bench b;
        snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, files[f]);
        CHECK(kempe_model_read(context, path, &model) == KEMPE_OK && bench_open(&b, model));
        double worst = check_bench(&b);
        printf("  %-42s %.1e\n", files[f], worst);
        CHECK(worst >= 0 && worst < 1e-6);
        bench_close(&b);
        kempe_model_free(model);
        kempe_context_free(context);
    }
}

static void test_random_mechanisms(void)
{
    int trees = 0, looped = 0;
    double most = 0;
    for (int number = 0; number < MODELS; number++) {
        bench b;
        random_model r = random_model_new((uint64_t)(number + 301), 2 + number % 5, (unsigned)number % 8);
        CHECK(r.model != NULL);
        if (r.model && bench_open(&b, r.model)) {
            double worst = check_bench(&b);
            CHECK(worst < 1e-6);
            most = check_max(most, worst);
            trees += worst >= 0 && b.part.r == 0;
            looped += worst >= 0 && b.part.r > 0;
        }
        bench_close(&b);
        random_model_free(&r);
    }
    printf("  %d trees, %d looped: %.1e\n", trees, looped, most);
    CHECK(trees >= 10 && looped >= 10);
}

int main(void)
{
    TEST(test_examples);
    TEST(test_random_mechanisms);
    return check_report();
}
