/* SPDX-License-Identifier: BSD-3-Clause */
/* The convergence check of a run by parts of it. Each begins at a row of the run and ends at a later one, at a finer
 * tolerance: the difference is the error of the steps between. Parts are taken at equal distances of the steps made,
 * not of time: difficult passages are among them in proportion to their steps. */
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "output/convergence.h"
#include <math.h>
#include <string.h>

/* PARTS: of a run. A part is extended over rows while it has no more than STEPS of all steps, and ROWS of all rows. */
enum { PARTS = 6 };
static const double STEPS = 0.01, ROWS = 0.02;
/* A run with fewer steps is repeated as a whole: a part needs some steps to begin. */
enum { FEWEST_STEPS = 50 };
/* Parts decide where all errors together are this much below the limit. Their sum, without signs, is above the error.
 */
static const double CLEARLY = 0.3;

/* A part from row `first` to row `last`, with the steps of the run between. */
typedef struct part {
    int first, last;
    long steps;
    const kempe_system *system;
    const kmp_samples *table;
    kmp_convergence *found;
    int row;
} part;

void kmp_step_counts_add(kmp_step_counts *counts, double from, double to)
{
    double middle = from + (to - from) / 2;
    while (counts->row < counts->rows && counts->time[counts->row] < middle)
        counts->row++;
    if (counts->row > 0 && counts->row < counts->rows)
        counts->steps[counts->row - 1]++;
}

bool kmp_convergence_has_parts(const kempe_system *system, const kmp_step_counts *counts)
{
    long all = 0;
    for (int k = 0; k + 1 < counts->rows; k++)
        all += counts->steps[k];
    return system->model->wheel_count > 0 && system->model->state_count == 0 && !counts->changes && counts->rows > 2 &&
           all >= FEWEST_STEPS;
}

/* The part around the steps that come after `before` of all. */
static part part_at(const kmp_step_counts *counts, long all, double before)
{
    int first = 0;
    double sum = (double)counts->steps[0];
    while (sum <= before && first + 2 < counts->rows)
        sum += (double)counts->steps[++first];
    part p = {.first = first, .last = first + 1, .steps = counts->steps[first]};
    while (p.last + 1 < counts->rows && (double)(p.steps + counts->steps[p.last]) <= STEPS * (double)all &&
           p.last - p.first < ROWS * counts->rows)
        p.steps += counts->steps[p.last++];
    return p;
}

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    part *p = user;
    (void)qdd, (void)lambda, (void)work;
    if (p->row <= p->last && t == kmp_samples_time(p->table, p->row)) {
        kmp_convergence_state(p->found, t, p->system, kmp_samples_get(p->table, KMP_QUANTITY_Q, p->row),
                              kmp_samples_get(p->table, KMP_QUANTITY_QD, p->row), q, qd);
        p->row++;
    }
    return 0;
}

/* Runs a part, whose rows are those of the table from `offset` on. *good: it has come to its end. */
static kempe_status run_part(const kmp_run_spec *spec, part *p, int offset, kmp_convergence *found, bool *good)
{
    const kempe_assembly start = {.system = p->system,
                                  .q = (double *)kmp_samples_get(p->table, KMP_QUANTITY_Q, offset + p->first),
                                  .qd = (double *)kmp_samples_get(p->table, KMP_QUANTITY_QD, offset + p->first),
                                  .closed = true};
    kmp_run_spec other = *spec;
    kmp_run_report report = {0};
    other.t_start = kmp_samples_time(p->table, offset + p->first);
    other.t_end = kmp_samples_time(p->table, offset + p->last);
    other.work_start = kmp_samples_work(p->table, offset + p->first);
    other.times = spec->times + p->first + 1;
    other.time_count = p->last - p->first;
    p->row = offset + p->first + 1;
    p->last += offset;
    p->found = found;
    kempe_status status = kmp_run(p->system, &other, &start, take_row, p, &report);
    kmp_free(report.reason);
    *good = status == KEMPE_OK && p->row == p->last + 1;
    return status == KEMPE_E_MEMORY || (status == KEMPE_STOPPED && !report.ended) ? status : KEMPE_OK;
}

kempe_status kmp_convergence_in_parts(const kempe_system *system, const kmp_run_spec *spec, const kmp_samples *table,
                                      const kmp_step_counts *counts, kmp_convergence *convergence, bool *decided)
{
    kmp_convergence all = *convergence;
    long steps = 0, made = 0;
    double sum = 0, seen = 0;
    int end = 0, offset = table->rows - spec->time_count;
    bool good = true;
    kempe_status status = KEMPE_OK;
    *decided = false;
    for (int k = 0; k + 1 < counts->rows; k++)
        steps += counts->steps[k];
    for (int k = 0; k < PARTS && status == KEMPE_OK && good; k++) {
        part p = part_at(counts, steps, (double)steps * (k + 0.5) / PARTS);
        if (k > 0 && p.first < end)
            continue;
        end = p.last;
        p.system = system;
        p.table = table;
        kmp_convergence found = all;
        found.difference = found.seen = 0;
        status = run_part(spec, &p, offset, &found, &good);
        sum += found.difference;
        seen += found.seen;
        made += p.steps;
        all.parts++;
        all.checked += kmp_samples_time(table, p.last) - kmp_samples_time(table, offset + p.first);
        all.difference = fmax(all.difference, found.difference);
        if (found.seen > all.seen) {
            all.seen = found.seen;
            all.apart = found.apart;
            all.index = found.index;
            all.t = found.t;
        }
    }
    if (status != KEMPE_OK || !good || made == 0)
        return status;
    all.total = sum * (double)steps / (double)made;
    all.until = spec->t_end;
    /* The sum of the differences of all steps, without signs, is a bound of what is seen. */
    *decided = all.total <= CLEARLY * all.limit && seen * (double)steps / (double)made <= 1;
    if (*decided)
        *convergence = all;
    return KEMPE_OK;
}
