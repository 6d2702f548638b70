/* SPDX-License-Identifier: BSD-3-Clause */
#include "results/convergence.h"
#include "base/memory.h"
#include <math.h>

/* The first other run is coarser by this factor, and cheaper; one that is coarse itself is held against a finer one. */
#define OTHER  100.0
#define COARSE 2e-6
/* Differences to a coarser run in units of its tolerance: below CLEAR all is well, since an error falls by five and
 * more from one to the other; above LOST nothing is. Between them a finer run decides, and ORDERLY where there is none.
 */
#define CLEAR   1e2
#define LOST    1e4
#define ORDERLY 1e3
/* Differences to a finer run in units of the tolerance: what errors of steps add up to where nothing amplifies them. */
#define PROMISED 2e3
/* No run is made finer than this, nor one that is not finer by FINER. */
#define FINEST 1e-13
#define FINER  5.0

/* The other run's rows as they come, and what they are compared with. */
typedef struct beside {
    const kempe_system *system;
    const kmp_samples *table;
    int row;
    kmp_convergence *found;
} beside;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    beside *b = user;
    kmp_convergence *c = b->found;
    double worst = 0;
    (void)qd, (void)qdd, (void)lambda, (void)work;
    if (t != kmp_samples_time(b->table, b->row))
        return 0; /* where a condition ends it */
    const double *first = kmp_samples_get(b->table, KMP_QUANTITY_Q, b->row++);
    for (int k = 0; k < b->system->n; k++) {
        double e = fabs(q[k] - first[k]) / fmax(fabs(first[k]), b->system->scale[k]);
        worst = fmax(worst, e);
        if (!(e > c->difference))
            continue;
        c->difference = e;
        c->coordinate = k;
        c->t = t;
    }
    if (!(c->difference > c->limit))
        c->until = t;
    return 0;
}

/* One other run, atol in proportion. */
static kempe_status run_beside(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                               const kmp_samples *table, double rtol, double limit, kmp_convergence *convergence)
{
    kmp_run_spec other = *spec;
    kmp_run_report report = {0};
    other.journal = NULL; /* the first run's */
    other.closely = true; /* no event is missed by both for the same reason */
    other.rtol = rtol;
    other.atol *= rtol / spec->rtol;
    kmp_convergence found = {
        .known = true, .rtol = other.rtol, .limit = limit, .t = spec->t_start, .until = spec->t_start, .stopped = NAN};
    beside b = {.system = system, .table = table, .row = table->rows - spec->time_count, .found = &found};
    kmp_context_quiet(system->context, true);
    kempe_status status = kmp_run(system, &other, start, take_row, &b, &report);
    kmp_context_quiet(system->context, false);
    kmp_free(report.reason);
    if (status == KEMPE_E_MEMORY)
        return status;
    kmp_context_clear(system->context); /* of what the other run complained */
    if (status == KEMPE_STOPPED && !report.ended)
        return KEMPE_OK; /* the user has had enough: nothing more is known */
    if (status != KEMPE_OK)
        found.stopped = report.t;
    *convergence = found;
    return KEMPE_OK;
}

kempe_status kmp_convergence_of(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                                const kmp_samples *table, kmp_convergence *convergence)
{
    double finer = fmax(spec->rtol / OTHER, FINEST), coarser = OTHER * spec->rtol;
    bool can_be_finer = FINER * finer < spec->rtol;
    *convergence = (kmp_convergence){0};
    if (spec->rtol > COARSE)
        return run_beside(system, spec, start, table, finer, PROMISED * spec->rtol, convergence);
    kempe_status status =
        run_beside(system, spec, start, table, coarser, (can_be_finer ? LOST : ORDERLY) * coarser, convergence);
    if (status != KEMPE_OK || !convergence->known || !can_be_finer || convergence->difference > convergence->limit ||
        (convergence->difference <= CLEAR * coarser && isnan(convergence->stopped)))
        return status;
    return run_beside(system, spec, start, table, finer, PROMISED * spec->rtol, convergence);
}

static bool has_converged(const kmp_convergence *c)
{
    return !(c->difference > c->limit) && isnan(c->stopped);
}

void kmp_convergence_warn(const kempe_system *system, const kmp_convergence *c)
{
    if (!c->known || has_converged(c))
        return;
    if (c->difference > c->limit)
        kmp_log(system->context, KEMPE_LOG_WARNING,
                "do not trust this run beyond t = %.6g s: at rtol %.3g '%s' comes out otherwise by %.2g at t = %.6g s, "
                "so the motion amplifies errors or takes another branch; take a smaller rtol, or compare roads",
                c->until, c->rtol, system->model->motions[c->coordinate].name, c->difference, c->t);
    else
        kmp_log(system->context, KEMPE_LOG_WARNING,
                "this run could not be checked: at rtol %.3g it ends at t = %.6g s; compare roads", c->rtol,
                c->stopped);
}

void kmp_convergence_show(kmp_text *text, const kempe_system *system, const kmp_convergence *c)
{
    if (!c->known)
        return;
    kmp_text_printf(text, "again     at rtol %.3g q %s by %.2e", c->rtol,
                    has_converged(c) ? "differs at most" : "DIFFERS", c->difference);
    if (c->difference > 0)
        kmp_text_printf(text, ", '%s' at t = %.6g s", system->model->motions[c->coordinate].name, c->t);
    if (!isnan(c->stopped))
        kmp_text_printf(text, "; it ended at t = %.6g s", c->stopped);
    kmp_text_put(text, "\n");
}

void kmp_convergence_json(kmp_json *json, const kempe_system *system, const kmp_convergence *c)
{
    if (!c->known) {
        kmp_json_string(json, "again", NULL);
        return;
    }
    kmp_json_object(json, "again");
    kmp_json_number(json, "rtol", c->rtol);
    kmp_json_number(json, "difference", c->difference);
    kmp_json_number(json, "limit", c->limit);
    kmp_json_string(json, "coordinate", system->n > 0 ? system->model->motions[c->coordinate].name : NULL);
    kmp_json_number(json, "t", c->t);
    kmp_json_number(json, "trusted_until", c->until);
    kmp_json_string(json, "verdict",
                    has_converged(c)           ? "converged"
                    : c->difference > c->limit ? "not converged"
                                               : "the other run did not come to its end");
    kmp_json_end(json);
}
