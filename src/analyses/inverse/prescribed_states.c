/* SPDX-License-Identifier: BSD-3-Clause */
/* States along a prescribed motion (prescribed_states.h). */
#include "analyses/inverse/prescribed_states.h"
#include "base/context.h"
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "model/data/model.h"
#include "output/print.h"
#include <math.h>
#include <string.h>

void kmp_prescribed_states_free(kmp_prescribed_states *states)
{
    kmp_prescribed_free(&states->table);
}

/* Makes room for the values. */
static kempe_status make_room(kmp_prescribed_states *states, kmp_arena *arena, const kempe_system *system)
{
    states->now = KMP_ARENA_NEW(arena, double, 3 * system->model->state_count);
    return kmp_made(system->context, states->now);
}

kempe_status kmp_prescribed_states_read(kmp_prescribed_states *states, kmp_arena *arena, const kempe_system *system,
                                        const kmp_reference *reference, const char *path)
{
    const kempe_model *model = system->model;
    const kmp_reference *x = reference;
    const int count = model->state_count, n = system->n;
    double *value, *none;
    kmp_gap_in_table gap;
    KMP_TRY(make_room(states, arena, system));
    KMP_TRY(kmp_made(system->context, KMP_ARENA_EACH(arena, double, x->rows *count, &value, &none)));
    for (int r = 0; r < x->rows; r++)
        for (int i = 0; i < count; i++) {
            none[r * count + i] = NAN;
            value[r * count + i] = x->value[KMP_QUANTITY_QD][r * n + n - count + i];
            if (!isfinite(value[r * count + i]))
                return kmp_complain(system->context, path, 0, 0,
                                    "column state.%s has no value at t = %.9g s: the motion needs the values of all "
                                    "states; simulate it with 'state' among the outputs",
                                    model->states[i].name, x->t[r]);
        }
    return kmp_made(system->context,
                    kmp_prescribed_init(&states->table, x->rows, x->t, count, value, none, none, &gap));
}

/* A run, as its rows are kept. */
typedef struct run {
    const kempe_system *system;
    kmp_prescribed_states *states;
    int most;
} run;

static int keep_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    const run *x = user;
    const int count = x->system->model->state_count;
    (void)t, (void)q, (void)qdd, (void)lambda, (void)work;
    if (x->states->rows < x->most)
        memcpy(x->states->run + (ptrdiff_t)x->states->rows++ * count, qd + kmp_model_coordinates(x->system->model),
               (size_t)count * sizeof *qd);
    return 0;
}

kempe_status kmp_prescribed_states_run(kmp_prescribed_states *states, kmp_arena *arena, const kempe_system *system,
                                       const kmp_times *times, const char *backend)
{
    const int rows = times->count;
    kmp_run_report report = {0};
    kmp_run_spec spec = {.backend = backend, .t_end = times->t[rows - 1], .times = times->t, .time_count = rows};
    KMP_TRY(make_room(states, arena, system));
    states->run = KMP_ARENA_NEW(arena, double, (size_t)rows *(size_t)system->model->state_count);
    KMP_TRY(kmp_made(system->context, states->run));
    KMP_TRY(kmp_run_resolve(system, &spec));
    kempe_status status = kmp_run(system, &spec, NULL, keep_row, &(run){system, states, rows}, &report);
    status = report.ended ? KEMPE_E_FAILED : status; /* by a condition: not an interrupt */
    if ((status == KEMPE_E_FAILED || status == KEMPE_STOPPED) && report.reason)
        (void)kmp_fail(system->context, status, "the states along the drives: %s%s", report.reason,
                       report.ended ? ", before the end of the motion: choose an earlier t_end" : "");
    kmp_free(report.reason);
    return status;
}

const double *kmp_prescribed_states_at(kmp_prescribed_states *states, const kempe_model *model, int k, double t)
{
    const kmp_prescribed *x = &states->table;
    const int count = model->state_count;
    if (states->run)
        memcpy(states->now, states->run + (ptrdiff_t)k * count, (size_t)count * sizeof *states->now);
    if (x->count == 0)
        return states->now;
    int row = 0;
    while (row + 1 < x->rows && x->t[row + 1] <= t)
        row++;
    kmp_prescribed_at(x, t, states->now, states->now + count, states->now + 2 * count);
    for (int i = 0; i < count; i++)
        if (model->states[i].next)
            states->now[i] = x->value[0][row * count + i];
    return states->now;
}
