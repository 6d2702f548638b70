/* SPDX-License-Identifier: BSD-3-Clause */
/* Convergence of results by repeat runs: a coarser run first, a finer one in doubt, and for long runs parts at equal
 * distances of steps. Differences are compared with what a user would see and with the tolerance; words for the outcome
 * are at the end. */
#include "output/convergence.h"
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "constraints/evaluation/charts.h"
#include "integrators/steppers/solver.h"
#include "model/data/body.h"
#include "model/data/state.h"
#include "model/data/wheels.h"
#include <math.h>
#include <string.h>

/* The first repeat run is coarser by this factor, and cheaper; a run with a coarse tolerance is compared with a finer
 * one. */
#define OTHER  100.0
#define COARSE 2e-6
/* Differences to a coarser run in units of its tolerance. Below CLEAR the run is accepted, since an error falls by five
 * and more from one run to the other; above LOST it is rejected. Between them a finer run decides, and ORDERLY where
 * there is none.
 */
#define CLEAR   1e2
#define LOST    1e4
#define ORDERLY 1e3
/* Differences to a finer run in units of the tolerance: the sum of the errors of steps where the motion does not
 * amplify them. */
#define PROMISED 2e3
/* Times the absolute tolerance: differences that a run in good order may have, at most NEAREST of the size; and a range
 * whose thousandth is the tolerance itself. */
#define NEAR    1e2
#define NEAREST 1e-4
#define REST    1e3
/* A range that may be rounding of coordinates of the size 1. */
#define ROUNDED 1e-14
/* Differences to a finer run where conditions change during it. An integrator restarts after each, a multistep method
 * at order one, and grazing a condition amplifies errors. More than a hundred is reported; the difference lacks the
 * finer run's own error, which is larger with a multistep method. */
#define AT_EVENTS        7e1
#define AT_EVENTS_UNEVEN 5e1
/* An error falls by five and more from the coarser run, which differs then by this many errors at least. */
#define APART 4.0
/* rad; angles of a spherical joint that are further apart may be another form of the same rotation. */
#define FORMS 1.5
/* No run is made finer than this, nor one that is not finer by FINER. */
#define FINEST 1e-13
#define FINER  5.0

/* Relative to the size of the first one; equal if both are not defined. */
static double difference_of(double first, double other, double size)
{
    bool neither = isnan(first) && isnan(other);
    return neither ? 0 : fabs(other - first) / fmax(fabs(first), size);
}

/* `apart` is |x - x'|, e its relative size. */
static void take_difference(kmp_convergence *found, double t, int k, double e, double apart)
{
    double seen = found->visible && e > 0 ? apart / found->visible[k] : 0;
    bool larger = !(e <= found->difference);
    found->difference = isnan(e) ? INFINITY : fmax(e, found->difference);
    if (found->visible ? seen <= found->seen : !larger)
        return;
    found->seen = isnan(seen) ? INFINITY : seen;
    found->apart = apart;
    found->index = k;
    found->t = t;
}

static bool accepts(const kmp_convergence *found)
{
    return found->difference <= found->limit && found->seen <= 1;
}

/* `at`: the index of the first one. */
static void take_numbers(kmp_convergence *found, double t, int at, int count, const double *first, const double *other,
                         const double *size)
{
    for (int k = 0; k < count; k++)
        take_difference(found, t, at + k, difference_of(first[k], other[k], size[k]), fabs(other[k] - first[k]));
}

/* The angles of a spherical joint have another form for the same rotation, (a + pi, pi - b, c + pi), and full turns:
 * runs that pass the singular position on either side continue in different forms. The form nearest to the first run's
 * is compared. */
static void take_coordinates(kmp_convergence *found, double t, const kempe_system *system, const double *first,
                             const double *other)
{
    int count = kmp_model_coordinates(system->model), k = 0;
    for (int c = 0; c < system->chart_count; c++) {
        int at = system->chart_first[c];
        double angles[3], apart = 0;
        for (int i = 0; i < 3; i++) {
            angles[i] = other[at + i];
            apart = fmax(apart, fabs(angles[i] - first[at + i]));
        }
        if (apart > FORMS)
            kmp_chart_nearest(system, c, first + at, angles);
        if (apart > FORMS && found->form == 0)
            found->form = at + 1, found->form_t = t;
        take_numbers(found, t, k, at - k, first + k, other + k, system->scale + k);
        take_numbers(found, t, at, 3, first + at, angles, system->scale + at);
        k = at + 3;
    }
    take_numbers(found, t, k, count - k, first + k, other + k, system->scale + k);
}

static void end_row(kmp_convergence *found, double t)
{
    if (accepts(found))
        found->until = t;
}

void kmp_convergence_row(kmp_convergence *found, double t, int count, const double *first, const double *other,
                         const double *size)
{
    take_numbers(found, t, 0, count, first, other, size);
    end_row(found, t);
}

/* A difference of a state that changes at events, in doubt until the next row. */
typedef struct doubt {
    double t, difference, apart; /* difference 0: there is none */
} doubt;

/* Near an event of a state both runs have values from before and after it, since its times differ. The runs agree at
 * the rows before and after. True for a difference of this kind, until the next row shows whether it stays. */
static bool may_be_of_time(const kmp_convergence *found, const kmp_state *state, double t, double e, double apart,
                           doubt *before)
{
    bool off = !(e <= found->limit), first = before->difference == 0;
    if (!off || !state->next || state->period < INFINITY)
        before->difference = 0;
    else if (first)
        *before = (doubt){t, isnan(e) ? INFINITY : e, apart};
    return before->difference > 0 && first;
}

/* The state of a contact, which has the rate at its beginning, acts by the contact's force only: it is judged by the
 * motion. `doubts`: of each state; NULL: there are no other rows. */
static void take_states(kmp_convergence *found, double t, const kempe_system *system, const double *qd,
                        const double *other_qd, doubt *doubts)
{
    const kempe_model *model = system->model;
    int first = kmp_model_coordinates(model);
    bool in_doubt = false;
    for (int k = 0; k < kmp_model_state_count(model); k++) {
        const kmp_state *state = kmp_model_state(model, k);
        int i = first + k;
        double e = state->contact > 0 ? 0 : difference_of(qd[i], other_qd[i], system->scale[i]);
        double apart = fabs(other_qd[i] - qd[i]);
        if (doubts && may_be_of_time(found, state, t, e, apart, &doubts[k])) {
            in_doubt = true;
            continue;
        }
        if (doubts && doubts[k].difference > 0)
            take_difference(found, doubts[k].t, i, doubts[k].difference, doubts[k].apart);
        take_difference(found, t, i, e, apart);
    }
    if (!in_doubt)
        end_row(found, t);
}

void kmp_convergence_state(kmp_convergence *found, double t, const kempe_system *system, const double *q,
                           const double *qd, const double *other_q, const double *other_qd)
{
    take_coordinates(found, t, system, q, other_q);
    take_states(found, t, system, qd, other_qd, NULL);
}

/* -- cases ------------------------------------------------------------------------------------------- */

/* Cases which[0 .. count-1], at a tolerance. */
static kempe_status run_beside(const kmp_repeat *r, double rtol, double limit, double reported, const double *visible,
                               int count, const int *which, kmp_convergence *convergence)
{
    kmp_convergence *found = KMP_NEW(kmp_convergence, count);
    KMP_TRY(kmp_made(r->context, found));
    for (int k = 0; k < count; k++)
        found[k] = (kmp_convergence){.known = true,
                                     .rtol = rtol,
                                     .limit = limit,
                                     .reported = reported,
                                     .visible = visible ? visible + which[k] * r->numbers : NULL,
                                     .t = r->t_start,
                                     .until = r->t_start,
                                     .stopped = NAN};
    const bool quiet = kmp_context_quiet(r->context, true);
    kempe_status status = r->run(r->user, rtol, count, which, found);
    (void)kmp_context_quiet(r->context, quiet);
    if (status != KEMPE_E_MEMORY)
        kmp_context_clear(r->context); /* errors of the repeat run */
    for (int k = 0; status == KEMPE_OK && k < count; k++)
        convergence[which[k]] = found[k];
    kmp_free(found);
    return status == KEMPE_E_MEMORY ? status : KEMPE_OK;
}

/* Lists the cases that a finer run has to decide in `which`; returns their number. */
static int find_doubtful(int cases, const kmp_convergence *convergence, double clear, int *which)
{
    int count = 0;
    for (int k = 0; k < cases; k++) {
        const kmp_convergence *c = &convergence[k];
        bool clearly = c->difference > c->limit || (c->difference <= clear && c->seen <= 1 && isnan(c->stopped));
        if (c->known && !clearly)
            which[count++] = k;
    }
    return count;
}

kempe_status kmp_convergence_of(const kmp_repeat *repeat, int cases, kmp_convergence *convergence)
{
    double rtol = repeat->rtol, finer = fmax(rtol / OTHER, FINEST), coarser = OTHER * rtol;
    double reported = repeat->promised * rtol,
           clear = reported > 0 ? (repeat->uneven ? 0 : APART * reported) : CLEAR * coarser;
    bool can_be_finer = FINER * finer < rtol;
    bool seen = !repeat->visible && !(reported > 0); /* neither ranges nor the size of the error are reported */
    clear = seen ? fmin(clear, KMP_VISIBLE) : clear;
    int *which = KMP_NEW(int, cases);
    kempe_status status = which ? KEMPE_OK : kmp_fail_memory(repeat->context);
    for (int k = 0; which && k < cases; k++) {
        convergence[k] = (kmp_convergence){0};
        which[k] = k;
    }
    int count = cases;
    if (status == KEMPE_OK && rtol <= COARSE) {
        double limit = (can_be_finer ? LOST : ORDERLY) * coarser;
        status =
            run_beside(repeat, coarser, limit, 0, can_be_finer ? repeat->visible : NULL, cases, which, convergence);
        count = status == KEMPE_OK && can_be_finer ? find_doubtful(cases, convergence, clear, which) : 0;
    }
    if (status == KEMPE_OK && count > 0)
        status = run_beside(repeat, finer, seen ? fmin(PROMISED * rtol, KMP_VISIBLE) : PROMISED * rtol, reported,
                            repeat->visible, count, which, convergence);
    kmp_free(which);
    return status;
}

/* -- parts of a run ----------------------------------------------------------------------------------- */

/* The convergence check of a run by parts of it. Each begins at a row of the run and ends at a later one, at a finer
 * tolerance: the difference is the error of the steps between. Parts are taken at equal distances of the steps made,
 * not of time: difficult passages are among them in proportion to their steps. */

/* PARTS: of a run, in addition to its beginning, whose transient and first steps are not like the others. A part is
 * extended over rows while it has no more than STEPS of all steps, and ROWS of all rows. */
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

static bool has_parts(const kempe_system *system, const kmp_step_counts *counts)
{
    long all = 0;
    for (int k = 0; k + 1 < counts->rows; k++)
        all += counts->steps[k];
    return kmp_model_wheel_count(system->model) > 0 && kmp_model_state_count(system->model) == 0 && !counts->changes &&
           counts->rows > 2 && all >= FEWEST_STEPS;
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

static int take_part_row(void *user, double t, const double *q, const double *qd, const double *qdd,
                         const double *lambda, double work)
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

/* Runs a part, whose rows are the rows of the table from `offset` on. *good: it has come to its end. */
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
    kempe_status status = kmp_run(p->system, &other, &start, take_part_row, p, &report);
    kmp_free(report.reason);
    *good = status == KEMPE_OK && p->row == p->last + 1;
    return status == KEMPE_E_MEMORY || (status == KEMPE_STOPPED && !report.ended) ? status : KEMPE_OK;
}

static kempe_status check_parts(const kempe_system *system, const kmp_run_spec *spec, const kmp_samples *table,
                                const kmp_step_counts *counts, kmp_convergence *all, bool *decided)
{
    long steps = 0, made = 0, steps_begin = 0;
    double sum = 0, seen = 0, sum_begin = 0, seen_begin = 0;
    int end = 0, offset = table->rows - spec->time_count;
    bool good = true;
    kempe_status status = KEMPE_OK;
    for (int k = 0; k + 1 < counts->rows; k++)
        steps += counts->steps[k];
    for (int k = -1; k < PARTS && status == KEMPE_OK && good; k++) {
        const bool begins = k < 0;
        part p = part_at(counts, steps, begins ? -1 : (double)steps * (k + 0.5) / PARTS);
        if (p.first < end)
            continue;
        end = p.last;
        p.system = system;
        p.table = table;
        kmp_convergence found = *all;
        found.difference = found.seen = 0;
        status = run_part(spec, &p, offset, &found, &good);
        *(begins ? &sum_begin : &sum) += found.difference;
        *(begins ? &seen_begin : &seen) += found.seen;
        *(begins ? &steps_begin : &made) += p.steps;
        all->parts++;
        all->checked += kmp_samples_time(table, p.last) - kmp_samples_time(table, offset + p.first);
        all->difference = fmax(all->difference, found.difference);
        if (found.seen > all->seen) {
            all->seen = found.seen;
            all->apart = found.apart;
            all->index = found.index;
            all->t = found.t;
        }
    }
    if (status != KEMPE_OK || !good || made == 0)
        return status;
    const double others = (double)(steps - steps_begin) / (double)made;
    all->total = sum_begin + sum * others;
    all->until = spec->t_end;
    /* The sum of the differences of all steps, without signs, is a bound of what is seen. */
    *decided = all->total <= CLEARLY * all->limit && seen_begin + seen * others <= 1;
    return KEMPE_OK;
}

/* -- a run ------------------------------------------------------------------------------------------- */

typedef struct beside {
    const kempe_system *system;
    const kmp_run_spec *spec;
    const kempe_assembly *start;
    const kmp_samples *table;
    int first, row; /* of the rows that the run has made, and the next */
    bool ended;     /* the run has ended where the model requests it */
    doubt *doubts;  /* of each state */
    kmp_convergence *found;
} beside;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    beside *b = user;
    (void)qdd, (void)lambda, (void)work;
    if (b->row == b->table->rows || t != kmp_samples_time(b->table, b->row))
        return 0; /* where a condition ends it */
    take_coordinates(b->found, t, b->system, kmp_samples_get(b->table, KMP_QUANTITY_Q, b->row), q);
    take_states(b->found, t, b->system, kmp_samples_get(b->table, KMP_QUANTITY_QD, b->row), qd, b->doubts);
    b->row++;
    return 0;
}

/* Both runs end where the model requests it: their difference there is one of time. */
static void take_end(const beside *b, double t)
{
    int last = b->table->rows - 1;
    double late = fabs(t - kmp_samples_time(b->table, last));
    const double *q = kmp_samples_get(b->table, KMP_QUANTITY_Q, last),
                 *qd = kmp_samples_get(b->table, KMP_QUANTITY_QD, last);
    for (int k = 0; k < kmp_model_coordinates(b->system->model); k++) {
        double apart = fabs(qd[k]) * late;
        take_difference(b->found, t, k, apart / fmax(fabs(q[k]), b->system->scale[k]), apart);
    }
}

static kempe_status run_again(void *user, double rtol, int count, const int *which, kmp_convergence *found)
{
    beside *b = user;
    kmp_run_spec other = *b->spec;
    kmp_run_report report = {0};
    (void)count, (void)which;
    other.log = NULL;     /* the first run's */
    other.closely = true; /* so that both runs do not miss an event for the same reason */
    other.rtol = rtol;
    other.atol *= rtol / b->spec->rtol;
    b->row = b->first;
    b->found = found;
    memset(b->doubts, 0, (size_t)kmp_model_state_count(b->system->model) * sizeof *b->doubts);
    kempe_status status = kmp_run(b->system, &other, b->start, take_row, b, &report);
    /* Differences that are in doubt at the last row count. */
    int first = kmp_model_coordinates(b->system->model);
    for (int k = 0; k < kmp_model_state_count(b->system->model); k++)
        if (b->doubts[k].difference > 0)
            take_difference(b->found, b->doubts[k].t, first + k, b->doubts[k].difference, b->doubts[k].apart);
    kmp_free(report.reason);
    if (status == KEMPE_E_MEMORY || (status == KEMPE_STOPPED && !report.ended))
        return status;
    if (report.requested && b->ended)
        take_end(b, report.t);
    else if (status != KEMPE_OK || b->ended)
        found->stopped = report.t;
    return KEMPE_OK;
}

/* Parts of the run at the finer tolerance. */
static kempe_status try_parts(const kempe_system *system, const kmp_run_spec *spec, const kmp_samples *table,
                              const kmp_step_counts *counts, const double *visible, kmp_convergence *convergence,
                              bool *decided)
{
    kmp_run_spec other = *spec;
    other.log = NULL;
    other.rtol = fmax(spec->rtol / OTHER, FINEST);
    other.atol *= other.rtol / spec->rtol;
    kmp_convergence found = {.known = true,
                             .rtol = other.rtol,
                             .limit = PROMISED * spec->rtol,
                             .visible = visible,
                             .t = spec->t_start,
                             .stopped = NAN};
    *decided = false;
    if (!counts || !(FINER * other.rtol < spec->rtol) || !has_parts(system, counts))
        return KEMPE_OK;
    const bool quiet = kmp_context_quiet(system->context, true);
    kempe_status status = check_parts(system, &other, table, counts, &found, decided);
    (void)kmp_context_quiet(system->context, quiet);
    if (status != KEMPE_E_MEMORY)
        kmp_context_clear(system->context);
    if (*decided)
        *convergence = found;
    return status;
}

/* A difference that is seen: a part of the range of the run, where an angle is seen within its turn. The tolerances
 * promise no less than NEAR, nor a motion that is no longer than REST, which is judged by its size. `known`
 * false: the model has no size, and any motion beyond rounding is judged by its range, for which a tolerance of
 * nanometres may be coarse. */
static double visible_of(double range, double size, bool known, const kmp_run_spec *spec)
{
    if (!known && range > ROUNDED * size)
        return KMP_VISIBLE * range;
    if (range <= fmin(REST * spec->atol, KMP_VISIBLE) * size)
        return fmin(PROMISED * spec->rtol, KMP_VISIBLE) * size;
    return fmax(KMP_VISIBLE * range, fmin(NEAR * spec->atol, NEAREST) * size);
}

double kmp_visible_difference(const kempe_system *system, const kmp_run_spec *spec, bool lengths, int k, double range)
{
    const bool state = k >= kmp_model_coordinates(system->model),
               angle = !state && kmp_model_motion(system->model, k)->rotation;
    return visible_of(angle ? fmin(range, 2 * acos(-1)) : range, system->scale[k], lengths || angle || state, spec);
}

static void find_visible(const kempe_system *system, const kmp_run_spec *spec, const kmp_samples *table,
                         double *visible)
{
    const bool lengths = kmp_system_length_scale(system->model).length > 0;
    for (int k = 0; k < system->n; k++) {
        const bool state = k >= kmp_model_coordinates(system->model);
        double low = INFINITY, high = -INFINITY;
        for (int row = 0; row < table->rows; row++) {
            double x = kmp_samples_get(table, state ? KMP_QUANTITY_QD : KMP_QUANTITY_Q, row)[k];
            low = fmin(low, x);
            high = fmax(high, x);
        }
        visible[k] = kmp_visible_difference(system, spec, lengths, k, high - low);
    }
}

static kempe_status check_run(beside *b, const kmp_step_counts *counts, const double *visible,
                              kmp_convergence *convergence)
{
    const kempe_system *system = b->system;
    const kmp_run_spec *spec = b->spec;
    bool decided;
    kempe_status in_parts = try_parts(system, spec, b->table, b->ended ? NULL : counts, visible, convergence, &decided);
    if (in_parts == KEMPE_E_MEMORY || decided)
        return in_parts;
    bool uneven = !kmp_solver_find(spec->integrator)->corrects;
    const kmp_repeat repeat = {.context = system->context,
                               .rtol = spec->rtol,
                               .t_start = spec->t_start,
                               .promised = !system->changes ? 0
                                           : uneven         ? AT_EVENTS_UNEVEN
                                                            : AT_EVENTS,
                               .uneven = uneven,
                               .visible = visible,
                               .user = b,
                               .run = run_again};
    return kmp_convergence_of(&repeat, 1, convergence);
}

kempe_status kmp_convergence_of_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                                    const kmp_samples *table, bool ended, const kmp_step_counts *counts,
                                    kmp_convergence *convergence)
{
    beside b = {.system = system, .spec = spec, .start = start, .table = table, .ended = ended};
    b.first = ended ? 0 : table->rows - spec->time_count; /* the rows before are of a run that this one continues */
    while (ended && spec->time_count > 0 && b.first < table->rows && kmp_samples_time(table, b.first) < spec->times[0])
        b.first++;
    double *visible = KMP_NEW(double, system->n);
    b.doubts = KMP_NEW(doubt, kmp_model_state_count(system->model) + 1);
    kempe_status status = kmp_made(system->context, b.doubts && visible);
    if (status == KEMPE_OK) {
        find_visible(system, spec, table, visible);
        status = check_run(&b, counts, visible, convergence);
    }
    convergence->visible = NULL;
    kmp_free(visible);
    kmp_free(b.doubts);
    return status;
}

/* -- messages ---------------------------------------------------------------------------------------- */

bool kmp_convergence_holds(const kmp_convergence *c)
{
    return !c->known || (accepts(c) && isnan(c->stopped));
}

const char *kmp_convergence_word(const kmp_convergence *c)
{
    const char *failing = !accepts(c) ? "not converged" : "the other run did not reach its end";
    return !c->known ? "" : kmp_convergence_holds(c) ? "converged" : failing;
}

const char *kmp_accuracy_remedy(double rtol)
{
    return rtol > OTHER * FINEST ? "use a smaller rtol, or compare formulations"
                                 : "errors of rounding count here, which do not fall with rtol: compare formulations "
                                   "for the digits that they share";
}

void kmp_convergence_put_apart(kmp_text *text, const kempe_context *context, const kmp_convergence *c, const char *unit)
{
    if (!unit)
        kmp_text_printf(text, "%.2g", c->difference);
    else
        kmp_text_printf(text, "%.2g%s%s", kmp_shown_as(context, unit).factor * c->apart, *unit ? " " : "",
                        kmp_shown_as(context, unit).unit);
}

void kmp_convergence_put_error(kmp_text *text, const kempe_context *context, const kmp_convergence *c, const char *unit)
{
    if (c->parts > 0)
        kmp_text_printf(text, "%.1e (relative)", c->total);
    else
        kmp_convergence_put_apart(text, context, c, unit);
}

void kmp_convergence_warn(kempe_context *context, const kmp_convergence *c, const char *name, const char *unit,
                          const char *advice)
{
    kmp_text apart = {0};
    kmp_convergence_put_apart(&apart, context, c, unit);
    const char *by = apart.s ? apart.s : "", *stop = *advice ? "; " : "";
    if (kmp_convergence_holds(c)) {
        if (c->reported > 0 && c->difference > c->reported)
            kmp_log(context, KEMPE_LOG_WARNING,
                    "'%s' has %serror of %s at t = %.6g s, estimated by a run at rtol %.3g%s%s", name,
                    unit ? "an " : "a relative ", by, c->t, c->rtol, stop, advice);
    } else if (!accepts(c)) {
        kmp_doubt(context,
                  "do not trust the motion beyond t = %.6g s: at rtol %.3g '%s' differs by %s at t = %.6g s, by "
                  "amplified errors or another branch%s%s",
                  c->until, c->rtol, name, by, c->t, stop, advice);
    } else {
        kmp_doubt(context,
                  "the accuracy of this run could not be checked: the second run, at rtol %.3g, ends at t = %.6g s%s%s",
                  c->rtol, c->stopped, stop, advice);
    }
    kmp_text_free(&apart);
}

void kmp_convergence_put(kmp_text *text, const kempe_context *context, const kmp_convergence *c, const char *name,
                         const char *unit)
{
    const bool holds = kmp_convergence_holds(c);
    if (!c->known)
        return;
    if (c->parts > 0) {
        kmp_text_printf(
            text,
            "estimated error %.1e (relative), the sum of the errors of all steps, unless the motion amplifies "
            "them; by second runs of %d parts, together %.2g s, at rtol %.3g",
            c->total, c->parts, c->checked, c->rtol);
        if (c->difference > 0) {
            kmp_text_put(text, ", which differ by at most ");
            kmp_convergence_put_apart(text, context, c, unit);
            kmp_text_printf(text, " of '%s'", name);
        }
        return;
    }
    if (!holds && c->difference > 0)
        kmp_text_printf(text, "in a second run '%s' differs by ", name);
    else
        kmp_text_put(text, holds ? "estimated error " : "a second run differs by ");
    kmp_convergence_put_apart(text, context, c, unit);
    if (!unit)
        kmp_text_put(text, " (relative)");
    if (holds && c->difference > 0)
        kmp_text_printf(text, " of '%s'", name);
    if (c->difference > 0)
        kmp_text_printf(text, " at t = %.6g s", c->t);
    kmp_text_printf(text, "%s rtol %.3g", holds ? ", by a second run at" : ", at", c->rtol);
    if (!isnan(c->stopped))
        kmp_text_printf(text, "; the second run ended at t = %.6g s", c->stopped);
}

void kmp_convergence_json(kmp_json *json, const kmp_convergence *c, const char *name)
{
    if (!c->known) {
        kmp_json_string(json, "convergence", NULL);
        return;
    }
    kmp_json_put(json, "convergence { rtol %g difference %g limit %g coordinate %s t %g trusted_until %g result %s",
                 c->rtol, c->difference, c->limit, name, c->t, c->until, kmp_convergence_word(c));
    if (c->seen > 0)
        kmp_json_put(json, "apart %g seen %g", c->apart, c->seen);
    if (c->parts > 0)
        kmp_json_put(json, "parts %d checked %g total %g", c->parts, c->checked, c->total);
    kmp_json_end(json);
}
