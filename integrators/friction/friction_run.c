/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/friction/friction_run.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_inside.h"
#include <math.h>
#include <string.h>

enum { MOST_REPEATS = 20 }; /* decisions without time between them */

double kmp_friction_pace(const kmp_runner *run, const double *qd)
{
    double rate = fmax(run->rate_scale, 1 / (run->spec.t_end - run->spec.t_start));
    for (int i = 0; i < run->s->n; i++)
        rate = fmax(rate, fabs(qd[i]) / run->s->scale[i]);
    return rate;
}

/* That of a contact is its force, by which it can be relieved. */
static double reserve(const kmp_friction_run *x, int i)
{
    return x->element[x->which[i]].contact ? x->f[i] : x->upper[i] - kmp_friction_size(x, i);
}

/* True for a contact with a force. One without would open at once by rounding where friction can hold its place. */
static bool pushes(const kmp_friction_run *x, int i)
{
    const kmp_friction_element *e = &x->element[x->which[i]];
    return e->contact && x->f[i] * x->d[i + i * x->rest] > e->still;
}

/* True if the row of element j comes before that of i: contacts that push first, then by their reserve. */
static bool is_before(const kmp_friction_run *x, int j, int i)
{
    bool first = pushes(x, j), second = pushes(x, i);
    double a = reserve(x, j), b = reserve(x, i);
    return first != second ? first : a > b || (a == b && j < i);
}

/* The element at rest with the k-th largest reserve; of equal ones the first. */
static int with_reserve(const kmp_friction_run *x, int k)
{
    for (int i = 0; i < x->rest; i++) {
        int above = 0;
        for (int j = 0; j < x->rest; j++)
            above += is_before(x, j, i);
        if (above == k)
            return i;
    }
    return 0;
}

/* Friction of contacts that open in this decision. */
static void set_off(kmp_runner *run)
{
    const kmp_friction_run *x = run->friction;
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        if (e->base >= 0 && x->element[e->base].broken)
            kmp_friction_set_off(run, e);
    }
}

/* The force that element i keeps: rounding of all accelerations would exceed a level that is rounding as well. */
static double kept_force(const kmp_friction_run *x, int i)
{
    const kmp_friction_element *e = &x->element[x->which[i]];
    bool none = e->implied || fabs(x->d[i + i * x->rest] * x->f[i]) <= kmp_friction_rounding(x, i);
    return none ? 0 : x->f[i];
}

/* Sets the modes of the elements at rest. Rows that others imply are not added: those of the elements with the largest
 * reserve come first. */
static kempe_status set_modes(kmp_runner *run, double t, const double *q, double rate)
{
    kmp_friction_run *x = run->friction;
    if (run->loaded_friction) /* levels may fall below forces that are given */
        kmp_friction_share(x);
    for (int k = 0; k < x->rest; k++) {
        kmp_friction_element *e = &x->element[x->which[k]];
        if (e->broken)
            kmp_friction_set_moving(run, e, e->sense, rate);
        else
            kmp_friction_set_given(run, e, 0, 0);
    }
    set_off(run);
    KMP_TRY(kmp_friction_choose(run, t, q));
    for (int k = 0; k < x->rest; k++) {
        int i = with_reserve(x, k);
        kmp_friction_element *e = &x->element[x->which[i]];
        bool adds = false;
        if (e->broken || (e->base >= 0 && x->element[e->base].broken))
            continue;
        if (!e->implied)
            KMP_TRY(kmp_friction_adds_row(run, e, t, q, &adds));
        if (adds)
            continue;
        kmp_friction_set_given(run, e, kept_force(x, i), kmp_friction_still(run) * kmp_friction_scale(run, e) * rate);
        e->stance = e->implied ? KMP_FRICTION_IDLE : KMP_FRICTION_CARRIED;
        KMP_TRY(kmp_friction_choose(run, t, q));
    }
    return KEMPE_OK;
}

/* -- the log --------------------------------------------------------------------------------------------- */

static const char *words_of(const kmp_friction_element *e)
{
    switch (e->stance) {
    case KMP_FRICTION_SLIPS:
        if (e->contact)
            return "opens";
        if (e->twin >= 0)
            return "slips";
        return e->sense > 0 ? "slips forward" : "slips backward";
    case KMP_FRICTION_SMOOTH:
        return "is regularised: no combination of modes is possible, or several are";
    case KMP_FRICTION_IDLE:
        return "rests by other closures: its force is not determined, and taken as zero";
    default:
        return e->contact ? "closes" : "sticks";
    }
}

static bool is_as_before(const kmp_friction_element *e)
{
    bool rests = e->stance == KMP_FRICTION_HELD || e->stance == KMP_FRICTION_CARRIED,
         rested = e->was == KMP_FRICTION_HELD || e->was == KMP_FRICTION_CARRIED;
    if (e->force->across == 2) /* the first component tells of both */
        return true;
    bool off = e->stance == KMP_FRICTION_SLIPS && (e->contact ? !e->known : e->sense == 0);
    return off || (e->known && (rests ? rested : e->stance == e->was && e->sense == e->before_sense));
}

/* Tells that an element is no longer regularised. */
static void tell_left(kmp_runner *run, kmp_friction_element *e, double t)
{
    if (!e->smooth || e->stance == KMP_FRICTION_SMOOTH)
        return;
    e->smooth = false;
    kmp_run_log_add(run->log, "regularised", t, e->smooth_t, e->force->regularise.value,
                    "'%s' was regularised from t = %.9g to %.9g", e->name, e->smooth_t, t);
}

static kempe_status settle(kmp_runner *run, double t, double *q, double *qd)
{
    kmp_friction_run *x = run->friction;
    double rate = kmp_friction_pace(run, qd);
    const double *now = kmp_eval_changes(run->eval, t, q, qd);
    memcpy(x->change, now, (size_t)run->s->events.count * sizeof *now);
    KMP_TRY(kmp_friction_decide(run, t, q, qd, rate));
    if (x->rest > 0)
        KMP_TRY(set_modes(run, t, q, rate));
    KMP_TRY(kmp_runner_project(run, t, q, qd));
    return kmp_runner_accelerate(run, t, q, qd);
}

/* Notes which elements change in this decision, or have used up their reserve. True: any does. */
static bool count_changes(kmp_friction_run *x)
{
    bool any = false;
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        bool changes = e->fired || !is_as_before(e);
        e->changes += changes;
        any = any || changes;
    }
    return any;
}

static void begin_count(kmp_friction_run *x, double t)
{
    x->past.since = t;
    x->past.changes = 0;
    for (int i = 0; i < x->count; i++)
        x->element[i].changes = 0;
}

static kempe_status complain_of_changes(const kmp_runner *run, double t)
{
    const kmp_friction_run *x = run->friction;
    const kmp_friction_element *most = x->element;
    for (int i = 0; i < x->count; i++)
        most = x->element[i].changes > most->changes ? &x->element[i] : most;
    const kmp_friction_element *contact = most->base >= 0 ? &x->element[most->base] : most;
    const char *help = contact->contact ? "A 'law' makes this contact compliant, and its forces unique"
                                        : "Regularise this friction with a 'speed'";
    bool at_once = x->past.repeats >= MOST_REPEATS;
    return kmp_fail(run->s->context, KEMPE_E_FAILED,
                    "modes are decided %d times between t = %.9g and %.9g without an end, most often by '%s'. %s",
                    at_once ? x->past.repeats : x->past.changes, at_once ? t : x->past.since, t, most->name, help);
}

/* Fails where modes change without progress of time: at one instant, or too often within a short part of the motion. */
static kempe_status watch(kmp_runner *run, double t, double rate)
{
    kmp_friction_run *x = run->friction;
    x->past.repeats =
        t - x->past.t <= KMP_FRICTION_INSTANT * (run->spec.t_end - run->spec.t_start) ? x->past.repeats + 1 : 0;
    x->past.t = t;
    if (!((t - x->past.since) * rate <= KMP_FRICTION_CROWD))
        begin_count(x, t);
    x->past.changes += count_changes(x);
    bool goes_on = x->past.repeats < MOST_REPEATS && x->past.changes < KMP_FRICTION_CROWDED;
    return goes_on ? KEMPE_OK : complain_of_changes(run, t);
}

/* Tells at the start of levels that grow so much with the friction that there may be several solutions or none. */
static kempe_status tell_growth(kmp_runner *run, double t, const double *q, const double *qd)
{
    double growth;
    int most;
    kempe_status status = kmp_friction_grow(run, t, q, qd, &growth, &most);
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(run->s->context);
    else
        KMP_TRY(status);
    if (status == KEMPE_OK && growth >= 1)
        kmp_run_log_add(run->log, "growth", t, NAN, growth,
                        "the level of '%s' grows by %.4g for each unit of friction: from 1 on there may be several "
                        "solutions, or none",
                        run->friction->element[most].name, growth);
    return KEMPE_OK;
}

long kmp_friction_count(const kmp_friction_run *x)
{
    return x->past.total;
}

kempe_status kmp_friction_settle(kmp_runner *run, double t, double *q, double *qd)
{
    kmp_friction_run *x = run->friction;
    for (int i = 0; i < x->count; i++) {
        x->element[i].was = x->element[i].stance;
        x->element[i].before_sense = x->element[i].sense;
    }
    KMP_TRY(x->past.known || !run->loaded_friction ? KEMPE_OK : tell_growth(run, t, q, qd));
    kempe_status status = settle(run, t, q, qd);
    if (status == KEMPE_E_FAILED && kmp_is_unsettled(run->eval))
        return kmp_friction_complain(run, t, q, qd);
    KMP_TRY(status);
    x->past.known = true;
    status = watch(run, t, kmp_friction_pace(run, qd));
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        x->past.total += !is_as_before(e);
        tell_left(run, e, t);
        if (!is_as_before(e))
            kmp_run_log_add(run->log, e->contact ? "contact" : "friction", t, e->before_sense, e->sense, "'%s%s' %s",
                            e->twin < 0 ? e->name : x->element[e->base].name, e->twin < 0 ? "" : "_friction",
                            words_of(e));
        e->known = true;
        e->struck = false;
        e->fired = false;
    }
    return status;
}
