/* SPDX-License-Identifier: BSD-3-Clause */
/* Statistics of ensembles against closed forms: Sobol's indices of Ishigami's function, moments, quantiles and
 * regression of a linear chain of tolerances, all within three standard errors; shares of distributions. */
#include "ensemble/sampling/sampling.h"
#include "ensemble/statistics/statistics.h"
#include "testing.h"
#include <kempe/ensemble.h>
#include <kempe/table.h>
#include <stdbool.h>

static const double PI = 3.14159265358979323846;

/* -- shares -------------------------------------------------------------------------------------------- */

static void test_beta(void)
{
    for (double x = 0.05; x < 1; x += 0.1) {
        CHECK_NEAR(kmp_beta_share(x, 1, 1), x, 1e-14);
        CHECK_NEAR(kmp_beta_share(x, 3, 1), x * x * x, 1e-14);
        CHECK_NEAR(kmp_beta_share(x, 1, 5), 1 - pow(1 - x, 5), 1e-14);
        CHECK_NEAR(kmp_beta_share(x, 0.5, 0.5), 2 / PI * asin(sqrt(x)), 1e-14); /* arcsine law */
        CHECK_NEAR(kmp_beta_quantile(kmp_beta_share(x, 7, 3), 7, 3), x, 1e-12);
    }
}

static void test_student(void)
{
    const double parts[] = {0.01, 0.2, 0.5, 0.9, 0.975};
    for (int k = 0; k < 5; k++) {
        double p = parts[k];
        CHECK_NEAR(kmp_student_quantile(p, 1), tan(PI * (p - 0.5)), 1e-11); /* Cauchy */
        CHECK_NEAR(kmp_student_quantile(p, 2), (2 * p - 1) / sqrt(2 * p * (1 - p)), 1e-11);
        CHECK_NEAR(kmp_student_quantile(p, 1e7), kmp_normal_quantile(p), 1e-5);
    }
}

/* Sum of the terms of the binomial distribution. */
static double binomial(int k, int n, double p)
{
    double term = pow(1 - p, n), sum = term;
    for (int i = 0; i < k; i++) {
        term *= (double)(n - i) / (i + 1) * p / (1 - p);
        sum += term;
    }
    return k < 0 ? 0 : sum;
}

static void test_binomial(void)
{
    double low, high;
    int from, to;
    for (int k = 0; k < 30; k++)
        CHECK_NEAR(kmp_binomial_share(k, 30, 0.3), binomial(k, 30, 0.3), 1e-13);
    kmp_chance_interval(0, 10, 0.95, &low, &high);
    CHECK(low == 0);
    CHECK_NEAR(high, 1 - pow(0.025, 0.1), 1e-13);
    kmp_chance_interval(10, 10, 0.95, &low, &high);
    CHECK(high == 1);
    CHECK_NEAR(low, pow(0.025, 0.1), 1e-13);
    kmp_chance_interval(7, 40, 0.9, &low, &high);
    CHECK_NEAR(1 - binomial(6, 40, low), 0.05, 1e-12);
    CHECK_NEAR(binomial(7, 40, high), 0.05, 1e-12);
    kmp_quantile_places(100, 0.5, 0.95, &from, &to);
    CHECK(from == 40 && to == 61); /* Conover, Practical nonparametric statistics: the 40th and 61st of 100 */
    CHECK(binomial(from - 1, 100, 0.5) <= 0.025 && binomial(from, 100, 0.5) > 0.025);
    CHECK(1 - binomial(to - 1, 100, 0.5) <= 0.025 && 1 - binomial(to - 2, 100, 0.5) > 0.025);
    kmp_quantile_places(20, 0.99, 0.95, &from, &to);
    CHECK(to == 21);
}

/* -- regression ---------------------------------------------------------------------------------------- */

static void test_regression(void)
{
    double rows[40][2], y[40], b[2], explained;
    for (int k = 0; k < 40; k++) {
        rows[k][0] = 5 + sin(k);
        rows[k][1] = -3 + 10 * cos(7 * k);
        y[k] = 4 * rows[k][0] - 0.1 * rows[k][1] + 9;
    }
    CHECK(kmp_regression(40, 2, rows[0], y, b, &explained));
    CHECK_NEAR(explained, 1, 1e-12);
    CHECK(b[0] > 0.9 && b[1] < -0.2);
    for (int k = 0; k < 40; k++)
        rows[k][1] = 2 * rows[k][0] + 1;
    CHECK(!kmp_regression(40, 2, rows[0], y, b, &explained)); /* they depend on each other */
}

/* -- models whose quantities are functions of parameters alone ------------------------------------------- */

typedef struct study {
    kempe_context *context;
    kempe_model *model;
    kempe_values *values;
    kempe_ensemble *ensemble;
    kempe_ensemble_result *batch;
    kempe_table *table;
    kempe_statistics *statistics;
} study;

static void need(study *s, kempe_status status)
{
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(s->context));
    CHECK(status == KEMPE_OK);
}

static study begin(const char *text, const kempe_sample_options *sample, const kempe_ensemble_options *measured)
{
    study s = {.context = kempe_context_new()};
    const kempe_run_options run = {.size = sizeof run, .t_end = 1e-3, .no_convergence_check = 1};
    need(&s, kempe_model_read_text(s.context, text, "model.yaml", &s.model));
    need(&s, kempe_values_sample(s.model, sample, &s.values));
    need(&s, kempe_ensemble_new_with(s.model, s.values, measured, &s.ensemble));
    need(&s, kempe_ensemble_run(s.ensemble, &run, 0, &s.batch));
    need(&s, kempe_ensemble_result_table(s.batch, "instances", &s.table));
    need(&s, kempe_statistics_new(s.table, 0, &s.statistics));
    return s;
}

static void end(study *s)
{
    kempe_statistics_free(s->statistics);
    kempe_table_free(s->table);
    kempe_ensemble_result_free(s->batch);
    kempe_ensemble_free(s->ensemble);
    kempe_values_free(s->values);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

static double cell(const kempe_table *table, int row, const char *column)
{
    return kempe_table_number(table, row, kempe_table_find(table, column));
}

static const char *const MODEL = "kempe: 1\n"
                                 "parameters: {x1: 0, x2: 0, x3: 0, a: 7, b: 0.1}\n"
                                 "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                                 "states: {y: {start: \"sin(x1) + a*sin(x2)^2 + b*x3^4*sin(x1)\", rate: 0}}\n";

/* Ishigami and Homma (1990), a = 7, b = 0.1: the parts of the variance in closed form. */
static void test_ishigami(void)
{
    enum { GROUPS = 3000 };
    const kempe_sample_options sample = {.size = sizeof sample,
                                         .ranges = "x1=-3.14159265358979324:3.14159265358979324,"
                                                   "x2=-3.14159265358979324:3.14159265358979324,"
                                                   "x3=-3.14159265358979324:3.14159265358979324",
                                         .design = "saltelli",
                                         .count = 5 * GROUPS - 2};
    const kempe_ensemble_options measured = {.size = sizeof measured, .quantities = "f = y"};
    study s = begin(MODEL, &sample, &measured);
    kempe_table *t = NULL;
    const double a = 7, b = 0.1, p4 = pow(PI, 4), p8 = p4 * p4;
    const double v1 = 0.5 * pow(1 + b * p4 / 5, 2), v2 = a * a / 8, v13 = 8 * b * b * p8 / 225, v = v1 + v2 + v13;
    const double first[] = {v1 / v, v2 / v, 0}, total[] = {(v1 + v13) / v, v2 / v, v13 / v};
    CHECK(kempe_values_count(s.values) == 5 * GROUPS);
    need(&s, kempe_statistics_table(s.statistics, "contributions", &t));
    CHECK(kempe_table_row_count(t) == 3);
    for (int i = 0; i < 3; i++) {
        double first_error = cell(t, i, "first_error"), total_error = cell(t, i, "total_error");
        CHECK(fabs(cell(t, i, "first") - first[i]) < 3 * first_error + 1e-12 && first_error < 0.05);
        CHECK(fabs(cell(t, i, "total") - total[i]) < 3 * total_error + 1e-12 && total_error < 0.05);
        CHECK(i == 2 || first_error > 1e-3);
    }
    kempe_table_free(t);
    need(&s, kempe_statistics_table(s.statistics, "moments", &t)); /* of the independent rows alone */
    CHECK(cell(t, 0, "count") == 2 * GROUPS);
    CHECK(fabs(cell(t, 0, "mean") - a / 2) < 3 * sqrt(v / (2 * GROUPS)));
    CHECK(fabs(pow(cell(t, 0, "deviation"), 2) / v - 1) < 0.1);
    kempe_table_free(t);
    end(&s);
}

/* The standard errors are those of repeated studies: of 60 studies, about as many lie within one as of a normal
 * distribution, 68 %. */
static void test_errors(void)
{
    enum { STUDIES = 60, GROUPS = 200, SIZE = 4 };
    double rows[GROUPS * SIZE][2], y[GROUPS * SIZE];
    kmp_sobol_index found[2];
    int within = 0;
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, MODEL, "model.yaml", &model) == KEMPE_OK);
    for (int number = 0; number < STUDIES; number++) {
        const kempe_sample_options sample = {.size = sizeof sample,
                                             .ranges = "x1=0:1,x2=0:1",
                                             .design = "saltelli",
                                             .count = GROUPS * SIZE,
                                             .seed = number + 1};
        kempe_values *values = NULL;
        CHECK(kempe_values_sample(model, &sample, &values) == KEMPE_OK);
        for (int k = 0; k < GROUPS * SIZE; k++) {
            const double *x = kempe_values_row(values, k);
            rows[k][0] = x[0];
            rows[k][1] = x[1];
            y[k] = 3 * x[0] + 4 * x[1]; /* the parts 9/25 and 16/25 */
        }
        CHECK(kmp_is_saltelli(GROUPS * SIZE, 2, rows[0]));
        CHECK(kmp_sobol_indices(GROUPS * SIZE, 2, y, found) == GROUPS);
        within += fabs(found[0].first - 9.0 / 25) < found[0].first_error;
        within += fabs(found[1].total - 16.0 / 25) < found[1].total_error;
        CHECK(fabs(found[0].total - 9.0 / 25) < 4 * found[0].total_error);
        kempe_values_free(values);
    }
    CHECK(within > 2 * STUDIES * 0.55 && within < 2 * STUDIES * 0.81);
    rows[7][1] += 1e-9;
    CHECK(!kmp_is_saltelli(GROUPS * SIZE, 2, rows[0]));
    kempe_model_free(model);
    kempe_context_free(context);
}

/* A chain of normal lengths: a = x1 + 2 x2 - x3 is normal, too. */
static void test_chain(void)
{
    enum { COUNT = 4000 };
    const kempe_sample_options sample = {.size = sizeof sample,
                                         .ranges = "x1=normal(1, 0.1),x2=normal(2, 0.2),x3=normal(3, 0.5)",
                                         .count = COUNT,
                                         .seed = 11};
    const kempe_ensemble_options measured = {
        .size = sizeof measured, .quantities = "gap = x1 + 2*x2 - x3", .limits = "gap > 1"};
    study s = begin(MODEL, &sample, &measured);
    const double mean = 2, deviation = sqrt(0.01 + 0.16 + 0.25);
    const double part[] = {0.1 / deviation, 0.4 / deviation, -0.5 / deviation};
    kempe_table *moments = NULL, *quantiles = NULL, *yield = NULL, *contributions = NULL, *extremes = NULL;
    need(&s, kempe_statistics_table(s.statistics, "moments", &moments));
    need(&s, kempe_statistics_table(s.statistics, "quantiles", &quantiles));
    need(&s, kempe_statistics_table(s.statistics, "within", &yield));
    need(&s, kempe_statistics_table(s.statistics, "contributions", &contributions));
    need(&s, kempe_statistics_table(s.statistics, "extremes", &extremes));
    CHECK(cell(moments, 0, "count") == COUNT);
    CHECK(fabs(cell(moments, 0, "mean") - mean) < 3 * deviation / sqrt(COUNT));
    CHECK(fabs(cell(moments, 0, "deviation") - deviation) < 3 * deviation / sqrt(2.0 * COUNT));
    CHECK_NEAR(cell(moments, 0, "mean_high") - cell(moments, 0, "mean_low"), 2 * 1.96 * deviation / sqrt(COUNT), 2e-3);
    CHECK_NEAR(cell(moments, 0, "deviation_high") - cell(moments, 0, "deviation_low"),
               2 * 1.96 * deviation / sqrt(2.0 * COUNT), 2e-3);
    for (int k = 0; k < kempe_table_row_count(quantiles); k++) {
        double p = cell(quantiles, k, "part"), z = kmp_normal_quantile(p), density = exp(-z * z / 2) / sqrt(2 * PI);
        double error = sqrt(p * (1 - p) / COUNT) / density * deviation, exact = mean + z * deviation;
        CHECK(fabs(cell(quantiles, k, "value") - exact) < 3.5 * error);
        CHECK(cell(quantiles, k, "low") <= cell(quantiles, k, "value") &&
              cell(quantiles, k, "value") <= cell(quantiles, k, "high"));
    }
    double passes = kmp_normal_share((mean - 1) / deviation), error = sqrt(passes * (1 - passes) / COUNT);
    CHECK(fabs(cell(yield, 0, "yield") - passes) < 3 * error && cell(yield, 0, "judged") == COUNT);
    CHECK_NEAR((cell(yield, 0, "high") - cell(yield, 0, "low")) / (2 * 1.96 * error), 1, 0.1);
    for (int i = 0; i < 3; i++) {
        CHECK(fabs(cell(contributions, i, "regression") - part[i]) < 3 / sqrt(COUNT));
        CHECK(isnan(cell(contributions, i, "first")));
    }
    CHECK_NEAR(cell(contributions, 0, "explained"), 1, 1e-9);
    int least = (int)cell(extremes, 0, "instance") - 1;
    CHECK(cell(extremes, 0, "value") == kempe_ensemble_result_quantity(s.batch, least, 0));
    CHECK(strncmp(kempe_table_word(extremes, 0, kempe_table_find(extremes, "settings")), "--set x1=", 9) == 0);
    kempe_table *tables[] = {moments, quantiles, yield, contributions, extremes};
    for (int k = 0; k < 5; k++)
        kempe_table_free(tables[k]);
    end(&s);
}

/* A grid is not a sample: its statistics have no intervals. */
static void test_grid(void)
{
    const double one[] = {1, 2, 3, 4}, uneven[] = {1, 2, 3, 4.1}, again[] = {1, 2, 1, 2},
                 two[] = {1, 10, 1, 20, 1, 30, 2, 10, 2, 20, 2, 30},
                 other[] = {1, 10, 2, 10, 1, 20, 2, 20, 1, 30, 2, 30},
                 mixed[] = {1, 10, 2, 10, 1, 20, 2, 20, 1, 30, 2, 31};
    CHECK(kmp_is_grid(4, 1, one) && kmp_is_grid(6, 2, two) && kmp_is_grid(6, 2, other));
    CHECK(!kmp_is_grid(4, 1, uneven) && !kmp_is_grid(4, 1, again) && !kmp_is_grid(6, 2, mixed) &&
          !kmp_is_grid(2, 1, one));
    const kempe_sample_options sample = {.size = sizeof sample, .ranges = "x1=1:3:3,x2=0:1:4", .design = "grid"};
    const kempe_ensemble_options measured = {
        .size = sizeof measured, .quantities = "gap = x1 + 2*x2 - x3", .limits = "gap > 1"};
    study s = begin(MODEL, &sample, &measured);
    kempe_table *moments = NULL;
    char *text = NULL;
    need(&s, kempe_statistics_table(s.statistics, "moments", &moments));
    CHECK(isfinite(cell(moments, 0, "mean")) && isnan(cell(moments, 0, "mean_low")));
    CHECK(kempe_statistics_print(s.statistics, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text &&
          strstr(text, "statistics of 12 of 12 instances of a grid, without intervals, which belong to samples\n") &&
          !strstr(text, "), standard deviation"));
    kempe_text_free(text);
    kempe_table_free(moments);
    end(&s);
}

static void test_mistakes(void)
{
    const kempe_sample_options sample = {.size = sizeof sample, .ranges = "x1=0:1", .count = 3};
    const kempe_ensemble_options none = {.size = sizeof none};
    study s = begin(MODEL, &sample, &none);
    kempe_table *moments = NULL;
    kempe_statistics *wrong = NULL;
    CHECK(kempe_statistics_table(s.statistics, "moments", &moments) == KEMPE_OK);
    CHECK_TEXT(kempe_table_word(moments, 0, 0), "q.x"); /* without quantities: the state at the end */
    CHECK(kempe_statistics_new(moments, 0, &wrong) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(s.context), "statistics need a table of instances, not 'moments'");
    CHECK(kempe_statistics_new(s.table, 2, &wrong) == KEMPE_E_ARGUMENT);
    CHECK(!wrong);
    kempe_table_free(moments);
    end(&s);
}

int main(void)
{
    TEST(test_beta);
    TEST(test_student);
    TEST(test_binomial);
    TEST(test_regression);
    TEST(test_ishigami);
    TEST(test_errors);
    TEST(test_chain);
    TEST(test_grid);
    TEST(test_mistakes);
    return check_report();
}
