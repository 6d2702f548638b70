/* SPDX-License-Identifier: BSD-3-Clause */
/* Instances of a loaded model with values of some of its parameters. */
#ifndef KEMPE_TESTS_INSTANCES_H
#define KEMPE_TESTS_INSTANCES_H

#include "loaded.h"
#include <kempe/ensemble.h>

typedef struct instances {
    kempe_values *values;
    kempe_ensemble *ensemble;
    kempe_ensemble_result *batch; /* NULL: it failed */
} instances;

/** Runs `count` instances, `lanes` at a time; `rows` has `columns` values of each. Failure is a failed check. */
static inline instances run_instances(const loaded *l, int lanes, int columns, const char *const *names, int count,
                                      const double *rows)
{
    instances all = {0};
    CHECK(l->model && kempe_values_new(l->model, columns, names, count, rows, &all.values) == KEMPE_OK);
    CHECK(all.values && kempe_ensemble_new(l->model, all.values, &all.ensemble) == KEMPE_OK);
    kempe_status status = all.ensemble ? kempe_ensemble_run(all.ensemble, NULL, lanes, &all.batch) : KEMPE_E_INPUT;
    int whole = 0;
    for (int k = 0; k < kempe_ensemble_result_count(all.batch); k++)
        whole += kempe_ensemble_result_reason(all.batch, k)[0] == '\0';
    CHECK(status == (whole == count ? KEMPE_OK : KEMPE_UNTRUSTED));
    return all;
}

/** Position and rate of the coordinate k of an instance at its end. NaN: there is none. */
static inline double end_position(const instances *all, int instance, int k)
{
    const double *q = kempe_ensemble_result_q(all->batch, instance);
    return q ? q[k] : NAN;
}

static inline double end_rate(const instances *all, int instance, int k)
{
    const double *qd = kempe_ensemble_result_qd(all->batch, instance);
    return qd ? qd[k] : NAN;
}

static inline void free_instances(instances *all)
{
    kempe_ensemble_result_free(all->batch);
    kempe_ensemble_free(all->ensemble);
    kempe_values_free(all->values);
}

#endif
