/* SPDX-License-Identifier: BSD-3-Clause */
/* Impacts of a run: the site of a runner, sentences and log. */
#include "integrators/run/impact.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/text.h"
#include "constraints/closing/saddle.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/shared_contacts.h"
#include "integrators/impact/impact_problem.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_start.h"
#include "model/data/force.h"
#include "model/data/outline.h"
#include "model/data/rope.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* -- the site -------------------------------------------------------------------------------------------- */

/* The first entry of a row of J, whose entries are by rows. */
static int first_entry(const kmp_pattern *pattern, int row)
{
    int low = 0, high = pattern->count;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (pattern->row[middle] < row)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void rows(void *self, double t, const double *q, int count, const int *row, double *g)
{
    kmp_runner *run = self;
    const kmp_pattern *pattern = &run->s->jacobian;
    const int n = run->s->n;
    kmp_friction_forget_rows(run);
    kmp_eval_closure(run->eval, t, q);
    memset(g, 0, (size_t)(count * n) * sizeof *g);
    for (int k = 0; k < count; k++)
        for (int e = first_entry(pattern, row[k]); e < pattern->count && pattern->row[e] == row[k]; e++)
            g[k * n + pattern->col[e]] = run->eval->jacobian[e];
}

static void weigh(void *self, double t, const double *q)
{
    const kmp_runner *run = self;
    kmp_eval_closure(run->eval, t, q);
    kmp_eval_mass(run->eval);
}

static int invert(void *self, double t, const double *q)
{
    kmp_runner *run = self;
    kmp_shared_saddle *shared = kmp_friction_saddle(run);
    weigh(self, t, q);
    KMP_TRY((int)kmp_shared_saddle_need(run, shared));
    shared->factored = !kmp_saddle_factor(&shared->saddle);
    return shared->factored
               ? KEMPE_OK
               : (int)kmp_fail(run->s->context, KEMPE_E_FAILED,
                               "impact at t = %.9g s in a singular position: the velocities after it are not unique",
                               t);
}

static int way(void *self, const double *g, double *to)
{
    kmp_runner *run = self;
    for (int i = 0; i < run->s->n; i++)
        run->balance.row[i] = -g[i];
    kmp_saddle_solve(&kmp_friction_saddle(run)->saddle, run->balance.row, NULL, to, NULL);
    return KEMPE_OK;
}

static double kinetic(const void *self, const double *qd)
{
    return kmp_eval_kinetic(((const kmp_runner *)self)->eval, qd);
}

/* -- sentences and log ------------------------------------------------------------------------------------- */

static const kmp_force *force_of(const kmp_runner *run, const kmp_friction_element *e)
{
    return run->s->events.condition[e->slot].of;
}

static int fail(void *self, kmp_impact_failure failure, double t, int count, const int *which)
{
    static const char *const reasons[] = {[KMP_IMPACT_FORCED] =
                                              "the closures or drives press the surfaces into each other",
                                          [KMP_IMPACT_UNDECIDED] = "the impulses cannot be found because of rounding",
                                          [KMP_IMPACT_ALTERNATES] = "the impulses of friction do not settle"};
    const kmp_runner *run = self;
    kmp_text text = {0};
    for (int k = 0; k < count; k++) {
        const kmp_friction_element *e = &run->sticking.friction->element[which[k]];
        if (e->contact)
            kmp_text_printf(&text, "%s'%s'", text.length ? ", " : "", force_of(run, e)->name);
    }
    kmp_text_printf(&text, ": %s at t = %.9g s", reasons[failure], t);
    kmp_friction_put_spread(&text, run->sticking.impacts->run.count, run->sticking.impacts->run.d);
    return (int)kmp_fail_text(run->s->context, KEMPE_E_FAILED, &text);
}

static void report_sequence(void *self, int element, double t, double since, double end)
{
    const kmp_runner *run = self;
    const char *name = force_of(run, &run->sticking.friction->element[element])->name;
    const kmp_contact_words words = kmp_contact_words_of(run->s->model, name);
    kmp_run_log_add(run->log, "accumulation", t, since, end, "%s '%s' %s at t = %.9g s after ever shorter rebounds",
                    words.noun, name, words.begins, end);
}

/* True if two contacts of one point are with both sides of a sharp corner. */
static bool are_at_corner(const kmp_contact_pair *a, const kmp_contact_pair *b)
{
    const kmp_touch_side *s = &a->side[0], *o = &b->side[0];
    if (!a->side[1].piece || !b->side[1].piece || a->side[1].point != b->side[1].point || s->point != o->point ||
        s->off != o->off || s->at[0] != o->at[0] || s->at[1] != o->at[1])
        return false;
    for (const kmp_outline_part *x = a->side[1].piece; x; x = x->next)
        for (const kmp_outline_part *y = b->side[1].piece; y; y = y->next)
            for (int end = 0; end < 2; end++)
                if (x->tip[end] == y->tip[1 - end] && (x->second == y->second ? x->tip[end] > 0 : x->tip[end] < 0))
                    return true;
    return false;
}

/* Points that strike a side so near to a sharp corner that rounding may decide which side they meet. */
static void report_corners(const kmp_runner *run, const kmp_impact_run *p, double t)
{
    const kmp_friction_run *x = p->friction;
    for (int k = 0; k < p->count; k++)
        for (int i = 0; i < x->count; i++) {
            const kmp_friction_element *struck = kmp_impact_element(p, k), *other = &x->element[i];
            if (p->f[k] == 0 || !struck->contact || !other->contact)
                continue;
            const kmp_contact_pair *a = &force_of(run, struck)->touch, *b = &force_of(run, other)->touch;
            if (are_at_corner(a, b) &&
                fabs(kmp_friction_at(x, other, KMP_ROLE_PLACE)) <= KMP_OUTLINE_CORNER * b->side[1].piece->away)
                kmp_run_log_add(run->log, "corner", t, NAN, NAN,
                                "'%s' struck a corner, where it depends on rounding whether '%s' does: 'round' makes "
                                "it smooth",
                                force_of(run, struck)->name, force_of(run, other)->name);
        }
}

static void report_impact(void *self, const kmp_impact_run *p, double t, double before, double gain)
{
    const kmp_runner *run = self;
    kmp_text names = {0};
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *e = kmp_impact_element(p, k);
        if (p->f[k] != 0 && e->contact)
            kmp_mark_contact(run->s, e->slot, KMP_ROLE_LEVEL);
        if (p->f[k] != 0 && e->contact)
            kmp_text_printf(&names, "%s'%s' struck at %.4g %s", names.length ? ", " : "", force_of(run, e)->name,
                            0 - p->v[k], force_of(run, e)->touch.turns ? "rad/s" : "m/s");
    }
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *e = kmp_impact_element(p, k);
        if (p->f[k] != 0 && e->unlimited != 0)
            kmp_text_printf(&names, ", '%s' held", force_of(run, e)->name);
    }
    kmp_run_log_add(run->log, "impact", t, before, before + gain, "%s: kinetic energy %s by %.4g of %.4g J",
                    names.s ? names.s : "impact", gain > 0 ? "grows" : "falls", fabs(gain), before);
    kmp_text_free(&names);
    report_corners(run, p, t);
}

static void report_plastic(void *self, double t, double gain)
{
    const kmp_runner *run = self;
    if (isnan(gain))
        kmp_run_log_add(run->log, "restitution", t, NAN, NAN,
                        "impact computed without restitution: friction that is unlimited holds what would rebound");
    else
        kmp_run_log_add(run->log, "restitution", t, NAN, NAN,
                        "impact computed without restitution: with it the kinetic energy would grow by %.4g J", gain);
}

/* -- making ---------------------------------------------------------------------------------------------- */

kmp_impacts *kmp_impact_new(kmp_runner *run, bool *none)
{
    kmp_arena *a = &run->arena;
    const int n = run->s->n, most = run->sticking.friction ? run->sticking.friction->count : 0;
    *none = true;
    for (int i = 0; i < most; i++)
        *none = *none && !run->sticking.friction->element[i].contact;
    kmp_impacts *x = *none ? NULL : KMP_ARENA_NEW(a, kmp_impacts, 1);
    kmp_impact_run *p = x ? &x->run : NULL;
    if (!p || !KMP_ARENA_MAKE(a, KMP_ROOM(int, most, &p->which, &p->side, &p->partner, &p->first, &p->last),
                              KMP_ROOM(bool, most, &p->held), KMP_ROOM(double, most *n, &p->row, &p->way),
                              KMP_ROOM(double, most *most, &p->d), KMP_ROOM(double, kmp_sharing_room(most), &p->room),
                              KMP_ROOM(double, most, &p->v, &p->a, &p->e, &p->lower, &p->upper, &p->f, &p->y, &p->tried,
                                       &p->most_friction, &p->deep),
                              KMP_ROOM(double, n, &p->before)))
        return NULL;
    x->site = (kmp_impact_site){.driven = run->s->rheonomic,
                                .rows = rows,
                                .invert = invert,
                                .way = way,
                                .weigh = weigh,
                                .kinetic = kinetic,
                                .fail = fail,
                                .report_sequence = report_sequence,
                                .report_impact = report_impact,
                                .report_plastic = report_plastic};
    p->site = &x->site;
    p->friction = run->sticking.friction;
    p->n = n;
    return x;
}

size_t kmp_impact_memory_size(const kmp_events *events)
{
    bool contacts = false;
    for (int k = 0; k < events->count; k++) {
        const kmp_force *force = events->condition[k].role == KMP_ROLE_SENSE ? events->condition[k].of : NULL;
        contacts = contacts || (force && force->kind == KMP_FORCE_TOUCH);
    }
    return contacts ? sizeof(long) : 0;
}

int kmp_impact_memory(kmp_impacts *impacts, kmp_memory_piece *piece)
{
    if (!impacts)
        return 0;
    piece[0] = (kmp_memory_piece){&impacts->run.total, sizeof impacts->run.total};
    return 1;
}

double kmp_impact_since(const kmp_impacts *impacts)
{
    return impacts && impacts->run.since > 0 ? impacts->run.since : INFINITY;
}

/* -- in a run ---------------------------------------------------------------------------------------------- */

kempe_status kmp_impact_check_start(kmp_runner *run, double t, const double *q, const double *qd)
{
    const int i = kmp_impact_overlap(&run->sticking.impacts->run, t, q, qd);
    if (i < 0)
        return KEMPE_OK;
    const kmp_friction_element *e = &run->sticking.friction->element[i];
    const kmp_force *contact = force_of(run, e);
    return kmp_fail(run->s->context, KEMPE_E_FAILED,
                    "contact '%s' overlaps by %.6g %s at the start; begin with its surfaces apart", contact->name,
                    -kmp_friction_at(run->sticking.friction, e, KMP_ROLE_PLACE), contact->turns ? "rad" : "m");
}
