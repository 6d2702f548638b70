/* SPDX-License-Identifier: BSD-3-Clause */
/* A table of models: how many of the instances of an ensemble run in lanes, and why the others do not. The first
 * parameter that may vary differs among the instances by up to 0.1 %; models without one have equal instances. The
 * distance is the largest of coordinates and rates at the end from those of a separate run, beside their size. It
 * counts the instances of which both runs come to the end.
 *
 *     bench lanes PART MODEL..      PART: of the time of each model's run */
#include "base/memory.h"
#include "bench.h"
#include "ensemble/lanes/ensemble_run.h"
#include "model/data/parameter.h"
#include "model/data/run_settings.h"
#include "model/data/variant.h"
#include <math.h>
#include <string.h>

enum { COUNT = 16, MOST_REASONS = 8 };

/* Reasons, with the number of instances of each. */
typedef struct tally {
    const char *why[MOST_REASONS];
    int count[MOST_REASONS], reasons;
} tally;

static void add(tally *t, const char *why)
{
    int k = 0;
    while (k < t->reasons && strcmp(t->why[k], why) != 0)
        k++;
    if (k == MOST_REASONS)
        return;
    t->why[k] = why;
    t->count[k]++;
    t->reasons += k == t->reasons;
}

/* The first parameter that may vary and has a value; NULL: there is none. */
static const char *vary(const kempe_model *model, double *value)
{
    for (int k = 0; k < kmp_model_parameter_count(model); k++) {
        kmp_text why = {0};
        bool may = kmp_variant_may(model, kmp_model_parameter(model, k)->name, &why);
        kmp_text_free(&why);
        *value = kmp_model_parameter(model, k)->number.value;
        if (may && *value != 0)
            return kmp_model_parameter(model, k)->name;
    }
    return NULL;
}

/* Largest distance of numbers at the end, beside their size, of instances whose results are both good. */
static double distance(int n, const kmp_ensemble_result *results, const double *a, const kmp_ensemble_result *others,
                       const double *b)
{
    double worst = 0;
    for (int k = 0; k < COUNT * n; k++)
        if (results[k / n].status == KEMPE_OK && others[k / n].status == KEMPE_OK &&
            !(fabs(a[k] - b[k]) / fmax(1, fabs(b[k])) <= worst))
            worst = fabs(a[k] - b[k]) / fmax(1, fabs(b[k]));
    return worst;
}

static void report(const char *name, int n, const kmp_ensemble_result *results, double apart)
{
    tally t = {0};
    int lanes = 0, failed = 0, parts = 0;
    for (int i = 0; i < COUNT; i++) {
        lanes += !results[i].alone && results[i].status != KEMPE_E_INPUT;
        failed += results[i].status != KEMPE_OK;
        parts += results[i].parts;
        if (results[i].why)
            add(&t, results[i].why);
    }
    printf("%-28s %4d %6d %6d %6d %8.1e  ", name, n, lanes, parts, failed, apart);
    for (int k = 0; k < t.reasons; k++)
        printf("%s%d: %s", k > 0 ? "; " : "", t.count[k], t.why[k]);
    printf("\n");
    (void)fflush(stdout);
}

static void run(const char *path, double part)
{
    static kmp_ensemble_result results[COUNT], compared[COUNT];
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kmp_ensemble *e = NULL;
    const char *base = strrchr(path, '/'), *name = base ? base + 1 : path, *column = NULL;
    double value = 1, values[COUNT];
    if (kempe_model_read(context, path, &model) == KEMPE_OK)
        column = vary(model, &value);
    if (model && kmp_ensemble_new(model, column ? 1 : 0, &column, &e) == KEMPE_OK) {
        const kempe_system *s = kmp_ensemble_system(e);
        int size = 2 * COUNT * s->n;
        double *q = calloc((size_t)(2 * size + 1), sizeof *q), *other = q ? q + size : NULL;
        const kmp_run_spec spec = {.t_end = part * kmp_model_run(s->model)->t_end};
        const kmp_ensemble_execution how = {.threads = 1};
        for (int i = 0; i < COUNT; i++)
            values[i] = value * (1 + 1e-3 * (i - COUNT / 2) / COUNT);
        if (q && kmp_ensemble_run(e, &spec, &how, COUNT, values, results, q, q + COUNT * s->n) == KEMPE_OK) {
            const kmp_ensemble_execution alone = {.threads = 1, .alone = true};
            (void)kmp_ensemble_run(e, &spec, &alone, COUNT, values, compared, other, other + COUNT * s->n);
            int half = COUNT * s->n;
            report(name, s->n, results,
                   fmax(distance(s->n, results, q, compared, other),
                        distance(s->n, results, q + half, compared, other + half)));
            for (int i = 0; i < COUNT; i++) {
                kmp_free(results[i].reason);
                kmp_free(compared[i].reason);
            }
        } else {
            printf("%-28s %s\n", name, kempe_context_message(context));
        }
        free(q);
    } else {
        printf("%-28s %s\n", name, kempe_context_message(context));
    }
    kmp_ensemble_free(e);
    kempe_model_free(model);
    kempe_context_free(context);
}

int bench_lanes(int argc, char **argv)
{
    double part = argc > 1 ? strtod(argv[1], NULL) : 0;
    if (!(part > 0) || argc < 3) {
        fprintf(stderr, "bench_lanes PART MODEL..\n");
        return 2;
    }
    printf("%-28s %4s %6s %6s %6s %8s  %s\n", "model", "n", "lanes", "parts", "failed", "distance", "separate runs");
    for (int k = 2; k < argc; k++)
        run(argv[k], part);
    return 0;
}
