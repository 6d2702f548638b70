/* SPDX-License-Identifier: BSD-3-Clause */
/* Instances of one mechanism for tests of ensembles: their values, runs, and comparisons of results. */
#pragma once

#include "base/memory.h"
#include "ensemble/lanes/ensemble_inside.h"
#include "loaded.h"
#include "model/data/body.h"
#include "model/data/parameter.h"
#include "model/data/start.h"
#include "random.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { COUNT = 19, MOST = 8 };

typedef struct outcome {
    kmp_ensemble_result result[COUNT];
    double q[COUNT * 100], qd[COUNT * 100];
    kmp_ensemble_work work;
} outcome;

typedef struct many {
    kempe_context *context;
    kempe_model *model;
    kmp_ensemble *ensemble;
    int n, columns;
    double values[COUNT * MOST];
} many;

static inline double value_in_model(const kempe_model *m, const char *name)
{
    for (int k = 0; k < kmp_model_parameter_count(m); k++)
        if (strcmp(kmp_model_parameter(m, k)->name, name) == 0)
            return kmp_model_parameter(m, k)->number.value;
    for (int k = 0; k < kmp_model_motion_count(m); k++) {
        if (strncmp(name, "q.", 2) == 0 && strcmp(kmp_model_motion(m, k)->name, name + 2) == 0)
            return kmp_model_start(m)->q[k].value;
        if (strncmp(name, "qd.", 3) == 0 && strcmp(kmp_model_motion(m, k)->name, name + 3) == 0)
            return kmp_model_start(m)->qd[k].value;
    }
    return NAN;
}

/* Values about those of the model, by up to `spread` of them. */
static inline many gather_from(kempe_context *context, kempe_model *model, const char *const *names, double spread)
{
    many x = {.context = context, .model = model};
    CHECK(model != NULL);
    if (!model) {
        printf("%s\n", kempe_context_message(context));
        return x;
    }
    while (names[x.columns])
        x.columns++;
    x.n = kmp_model_motion_count(model);
    CHECK(x.n <= 100);
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < x.columns; k++)
            x.values[i * x.columns + k] = value_in_model(model, names[k]) * (1 + between(-spread, spread));
    if (kmp_ensemble_new(model, x.columns, names, &x.ensemble) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(x.ensemble != NULL);
    return x;
}

static inline many gather(const char *example, const char *const *names, double spread)
{
    char path[1024];
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    (void)snprintf(path, sizeof path, "%s/examples/%s.yaml", KEMPE_ROOT, example);
    (void)kempe_model_read(context, path, &model);
    return gather_from(context, model, names, spread);
}

static inline many gather_text(const char *text, const char *const *names, double spread)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    (void)kempe_model_read_text(context, text, "model.yaml", &model);
    return gather_from(context, model, names, spread);
}

static inline void scatter(many *x)
{
    kmp_ensemble_free(x->ensemble);
    kempe_model_free(x->model);
    kempe_context_free(x->context);
}

static inline void run(many *x, const kmp_run_spec *spec, kmp_ensemble_execution execution, outcome *out)
{
    *out = (outcome){0};
    CHECK(kmp_ensemble_run(x->ensemble, spec, &execution, COUNT, x->values, out->result, out->q, out->qd) == KEMPE_OK);
    out->work = kmp_ensemble_get_work(x->ensemble);
}

static inline void drop(outcome *out)
{
    for (int i = 0; i < COUNT; i++)
        kmp_free(out->result[i].reason);
}

static inline bool same_result(const kmp_ensemble_result *a, const kmp_ensemble_result *b)
{
    return a->status == b->status && a->alone == b->alone && a->t == b->t && a->steps == b->steps &&
           a->rejected == b->rejected && a->refused == b->refused && a->rhs == b->rhs && a->exchanges == b->exchanges &&
           a->parts == b->parts && memcmp(&a->h, &b->h, sizeof a->h) == 0 &&
           memcmp(&a->drift, &b->drift, sizeof a->drift) == 0 &&
           strcmp(a->reason ? a->reason : "", b->reason ? b->reason : "") == 0;
}

static inline int differ(const many *x, const outcome *a, const outcome *b)
{
    size_t size = (size_t)(COUNT * x->n) * sizeof(double);
    int count = memcmp(a->q, b->q, size) != 0 || memcmp(a->qd, b->qd, size) != 0;
    for (int i = 0; i < COUNT; i++)
        count += !same_result(&a->result[i], &b->result[i]);
    return count;
}

/* Largest distance of coordinates from those of runs of their own, beside their size. */
static inline double distance(const many *x, const outcome *a, const outcome *b)
{
    double worst = 0;
    for (int k = 0; k < COUNT * x->n; k++)
        worst = check_max(worst, fabs(a->q[k] - b->q[k]) / fmax(1, fabs(b->q[k])));
    return worst;
}
