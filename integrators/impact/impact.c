/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/impact/impact.h"
#include "constraints/closing/saddle.h"
#include "constraints/tolerances.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/run/runner.h"
#include "linalg/dense/disc_minimum.h"
#include <math.h>
#include <string.h>

enum {
    MOST_PASSES = 600, /* of the iteration for bounds of friction */
    PATIENCE = 60      /* passes after which bounds that alternate follow by half as much */
};

struct kmp_impact_run {
    int most, count;  /* elements at most, and those that take part */
    int *which;       /* their numbers among the elements */
    int *partner;     /* most: the other component of friction in two directions; -1: none */
    double *row;      /* most x n: their rows of J */
    double *way;      /* most x n: changes of the rates by unit impulses */
    double *jacobian; /* m x n */
    double *d, *v, *a, *e, *lower, *upper, *f, *y, *tried, *room;
    double *most_friction; /* most: bound of the impulse of friction, in this pass */
    int *side;
    bool *held;     /* most: it takes its rate away, in both directions */
    double *last;   /* most: time of the last impact of an element; -INFINITY: none yet */
    double *deep;   /* most: overlap of an element at this impact, which the located time leaves */
    double *before; /* n: rates before the impact */
    double since;   /* of the present impact: the shortest time since the one before of the same contact */
    long total;
};

kmp_impact_run *kmp_impact_new(kmp_runner *run, bool *none)
{
    const kmp_friction_run *x = run->friction;
    kmp_arena *a = &run->arena;
    int contacts = 0, n = run->s->n, most = x ? x->count : 0;
    for (int i = 0; i < most; i++)
        contacts += x->element[i].contact;
    *none = contacts == 0;
    kmp_impact_run *p = *none ? NULL : KMP_ARENA_NEW(a, kmp_impact_run, 1);
    if (!p || !KMP_ARENA_MAKE(a, KMP_ROOM(int, most, &p->which, &p->side, &p->partner), KMP_ROOM(bool, most, &p->held),
                              KMP_ROOM(double, most *n, &p->row, &p->way), KMP_ROOM(double, run->s->m *n, &p->jacobian),
                              KMP_ROOM(double, most *most, &p->d), KMP_ROOM(double, kmp_disc_room(most), &p->room),
                              KMP_ROOM(double, most, &p->v, &p->a, &p->e, &p->lower, &p->upper, &p->f, &p->y, &p->tried,
                                       &p->most_friction, &p->last, &p->deep),
                              KMP_ROOM(double, n, &p->before)))
        return NULL;
    p->most = most;
    for (int i = 0; i < most; i++)
        p->last[i] = -INFINITY;
    return p;
}

int kmp_impact_memory(kmp_impact_run *p, kmp_memory_piece *piece)
{
    if (!p)
        return 0;
    piece[0] = (kmp_memory_piece){p->last, (size_t)p->most * sizeof *p->last};
    piece[1] = (kmp_memory_piece){&p->total, sizeof p->total};
    return 2;
}

double kmp_impact_since(const kmp_impact_run *impacts)
{
    return impacts && impacts->since > 0 ? impacts->since : INFINITY;
}

long kmp_impact_count(const kmp_impact_run *impacts)
{
    return impacts->total;
}

static kmp_friction_element *element_of(const kmp_runner *run, int k)
{
    return &run->friction->element[run->impacts->which[k]];
}

static const char *name_of(const kmp_runner *run, const kmp_friction_element *e)
{
    return ((const kmp_force *)run->s->events.condition[e->slot].of)->name;
}

/* -- who takes part -------------------------------------------------------------------------------------- */

static bool touches(const kmp_runner *run, const kmp_friction_element *e)
{
    return e->contact && kmp_friction_at(run->friction, e, KMP_ROLE_PLACE) <= KMP_TOUCH_NEAR * e->size;
}

/* The places of both components of friction in two directions. */
static void find_partners(kmp_runner *run)
{
    kmp_impact_run *p = run->impacts;
    for (int k = 0; k < p->count; k++) {
        p->partner[k] = -1;
        for (int i = 0; i < p->count; i++)
            if (element_of(run, k)->twin == p->which[i])
                p->partner[k] = i;
    }
}

/* Contacts whose surfaces touch, and their friction. True: one of them strikes. */
static bool list_touching(kmp_runner *run, double rate)
{
    const kmp_friction_run *x = run->friction;
    kmp_impact_run *p = run->impacts;
    bool strikes = false;
    p->count = 0;
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &x->element[i], *base = e->base >= 0 ? &x->element[e->base] : e;
        double v = kmp_friction_at(x, e, KMP_ROLE_RATE), still = KMP_FRICTION_STILL * e->size * rate;
        if (!touches(run, base))
            continue;
        bool hits = e->contact && v < -still;
        p->v[p->count] = v;
        p->e[p->count] = hits ? e->restitution : 0;
        p->which[p->count++] = i;
        strikes = strikes || hits;
    }
    find_partners(run);
    return strikes;
}

/* -- the impulses ------------------------------------------------------------------------------------------ */

/* The rows of all that take part. */
static void find_rows(kmp_runner *run, double t, const double *q)
{
    const kempe_system *s = run->s;
    kmp_impact_run *p = run->impacts;
    for (int k = 0; k < p->count; k++)
        kmp_friction_put(run->friction, element_of(run, k), KMP_ROLE_HELD, 1);
    kmp_eval_closure(run->eval, t, q);
    kmp_eval_dense_jacobian(run->eval, p->jacobian);
    for (int k = 0; k < p->count; k++) {
        int r = element_of(run, k)->row;
        for (int i = 0; i < s->n; i++)
            p->row[k * s->n + i] = p->jacobian[r + i * s->m];
        kmp_friction_put(run->friction, element_of(run, k), KMP_ROLE_HELD, 0);
    }
}

/* True if the closures imply the row of element k: no impulse changes its rate. */
static kempe_status find_implied(kmp_runner *run, int k, double t, const double *q, bool *implied)
{
    kmp_partition with;
    kmp_friction_put(run->friction, element_of(run, k), KMP_ROLE_HELD, 1);
    kmp_eval_closure(run->eval, t, q);
    kempe_status status = kmp_partition_init(&with, run->s, run->eval->jacobian, NULL, 0);
    *implied = status == KEMPE_OK && with.r <= run->part.r;
    if (status == KEMPE_OK)
        kmp_partition_free(&with);
    kmp_friction_put(run->friction, element_of(run, k), KMP_ROLE_HELD, 0);
    return status;
}

static double product(int n, const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Changes of the rates by unit impulses: P G'. */
static kempe_status find_ways(kmp_runner *run, double t, const double *q)
{
    kmp_impact_run *p = run->impacts;
    kmp_saddle saddle;
    int n = run->s->n;
    kmp_eval_closure(run->eval, t, q);
    kmp_eval_mass(run->eval);
    bool made = kmp_saddle_init(&saddle, run->eval, &run->part);
    bool singular = made && kmp_saddle_factor(&saddle);
    for (int k = 0; made && !singular && k < p->count; k++) {
        for (int i = 0; i < n; i++)
            run->moved[i] = -p->row[k * n + i];
        kmp_saddle_solve(&saddle, run->moved, NULL, p->way + k * n, NULL);
    }
    kmp_saddle_free(&saddle);
    KMP_TRY(kmp_made(run->s->context, made));
    return singular ? kmp_fail(run->s->context, KEMPE_E_FAILED, "an impact at t = %.9g meets a singular mechanism", t)
                    : KEMPE_OK;
}

static kempe_status find_matrix(kmp_runner *run, double t, const double *q)
{
    kmp_impact_run *p = run->impacts;
    int n = run->s->n;
    bool implied;
    find_rows(run, t, q);
    for (int k = 0; k < p->count; k++) {
        KMP_TRY(find_implied(run, k, t, q, &implied));
        if (implied)
            memset(p->row + k * n, 0, (size_t)n * sizeof *p->row);
    }
    KMP_TRY(find_ways(run, t, q));
    for (int i = 0; i < p->count; i++)
        for (int j = 0; j <= i; j++)
            p->d[i + j * p->count] = p->d[j + i * p->count] =
                (product(n, p->row + i * n, p->way + j * n) + product(n, p->row + j * n, p->way + i * n)) / 2;
    return KEMPE_OK;
}

/* The number among those that take part of the contact under element k of friction. */
static int under(const kmp_runner *run, int k)
{
    int i = 0;
    while (run->impacts->which[i] != element_of(run, k)->base)
        i++;
    return i;
}

/* Bounds by the impulses of the last pass, which those of friction follow by a part. */
static void set_bounds(kmp_runner *run, double part)
{
    kmp_impact_run *p = run->impacts;
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *e = element_of(run, k);
        bool rubs = e->base >= 0;
        if (rubs) { /* a contact that is held may pull */
            double next = e->ratio * fmax(p->f[under(run, k)], 0);
            p->most_friction[k] += part * (next - p->most_friction[k]);
        }
        double most = rubs ? p->most_friction[k] : INFINITY;
        p->a[k] = p->v[k] + p->e[k] * p->v[k];
        p->lower[k] = rubs || p->held[k] ? -most : 0;
        p->upper[k] = most;
    }
}

static kempe_status complain(const kmp_runner *run, double t, const char *what)
{
    const kmp_impact_run *p = run->impacts;
    kmp_text text = {0};
    for (int k = 0; k < p->count; k++)
        if (element_of(run, k)->contact)
            kmp_text_printf(&text, "%s'%s'", text.length ? ", " : "", name_of(run, element_of(run, k)));
    kmp_text_printf(&text, ": %s at t = %.9g", what, t);
    return kmp_fail_text(run->s->context, KEMPE_E_FAILED, &text);
}

/* One minimum; *changed: by how much impulses differ from the last ones, relative to the largest. */
static kempe_status solve_once(kmp_runner *run, double t, double part, double *changed)
{
    kmp_impact_run *p = run->impacts;
    double most = 0, size = 0;
    set_bounds(run, part);
    memcpy(p->tried, p->f, (size_t)p->count * sizeof *p->f);
    const kmp_box box = {p->count, p->d, p->a, p->lower, p->upper};
    kmp_box_outcome outcome = kmp_disc_minimum(&box, p->partner, p->f, p->y, p->side, p->room);
    for (int k = 0; k < p->count; k++) {
        most = fmax(most, fabs(p->f[k] - p->tried[k]));
        size = fmax(size, fmax(fabs(p->f[k]), fabs(p->tried[k])));
    }
    *changed = size > 0 ? most / size / part : 0;
    return outcome == KMP_BOX_FOUND       ? KEMPE_OK
           : outcome == KMP_BOX_UNBOUNDED ? complain(run, t, "closures or drives force the surfaces into each other")
                                          : complain(run, t, "the impulses are not determined");
}

static kempe_status solve(kmp_runner *run, double t)
{
    kmp_impact_run *p = run->impacts;
    double changed = 1;
    bool rubs = false;
    for (int k = 0; k < p->count; k++)
        rubs = rubs || element_of(run, k)->base >= 0;
    memset(p->f, 0, (size_t)p->count * sizeof *p->f);
    memset(p->most_friction, 0, (size_t)p->count * sizeof *p->f);
    KMP_TRY(solve_once(run, t, 1, &changed));
    for (int pass = 1; rubs && pass < MOST_PASSES && changed > KMP_FRICTION_SETTLED; pass++)
        KMP_TRY(solve_once(run, t, ldexp(1, -(pass / PATIENCE)), &changed));
    return rubs && changed > KMP_FRICTION_TIE ? complain(run, t, "the impulses of friction are not determined")
                                              : KEMPE_OK;
}

/* -- after it ------------------------------------------------------------------------------------------------ */

/* Sets the rates, and returns the change of the kinetic energy. */
static double apply(const kmp_runner *run, double *qd)
{
    const kmp_impact_run *p = run->impacts;
    int n = run->s->n;
    double before = kmp_eval_kinetic(run->eval, p->before);
    memcpy(qd, p->before, (size_t)n * sizeof *qd);
    for (int k = 0; k < p->count; k++)
        for (int i = 0; i < n; i++)
            qd[i] += p->f[k] * p->way[k * n + i];
    return kmp_eval_kinetic(run->eval, qd) - before;
}

/* Moves the surfaces apart by what the located time of the impact lies behind it, in the inverse inertia: the next
 * flight begins at the surface. Returns the largest overlap, in sizes. */
static double part_surfaces(kmp_runner *run, double t, double *q)
{
    kmp_impact_run *p = run->impacts;
    int n = run->s->n;
    double most = 0;
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *e = element_of(run, k);
        p->f[k] = 0;
        p->a[k] = e->contact ? kmp_friction_at(run->friction, e, KMP_ROLE_PLACE) : 0;
        p->lower[k] = 0;
        p->upper[k] = e->contact ? INFINITY : 0;
        p->deep[p->which[k]] = fmax(-p->a[k], 0);
        most = fmax(most, -p->a[k] / e->size);
    }
    const kmp_box box = {p->count, p->d, p->a, p->lower, p->upper};
    if (kmp_disc_minimum(&box, p->partner, p->f, p->y, p->side, p->room) != KMP_BOX_FOUND)
        return 0; /* they stay as they are */
    for (int k = 0; k < p->count; k++)
        for (int i = 0; i < n; i++)
            q[i] += p->f[k] * p->way[k * n + i];
    kmp_eval_closure(run->eval, t, q);
    kmp_eval_mass(run->eval);
    return most;
}

/* True if the next impact of element k with restitution e < 1 would follow at once, or if the height that this one
 * takes from its flight is not larger than the overlap, by which surfaces are parted: then the rebounds would not
 * become lower. A flight of the time T that ends with the rate v has the height v T / 4. */
static bool is_last(const kmp_impact_run *p, int k, double since, double least)
{
    double e = p->e[k], lost = (1 - e * e) * fabs(p->v[k]) * since / 4;
    return e > 0 && (e * since < least || (e < 1 && lost < KMP_IMPACT_DEEP * p->deep[p->which[k]]));
}

/* Ends sequences of impacts whose next one would follow at once. A contact that rebounds takes its rate away. When
 * contacts strike in turn, each throws the others off by a rate that is no more than that of a fall in this time: they
 * stay. */
static void end_sequences(kmp_runner *run, double t, double rate)
{
    kmp_impact_run *p = run->impacts;
    double least = KMP_IMPACT_SPACING * (run->spec.t_end - run->spec.t_start);
    for (int k = 0; k < p->count; k++) {
        const kmp_friction_element *element = element_of(run, k);
        double e = p->e[k], since = t - p->last[p->which[k]];
        p->held[k] = element->contact && since < least && fabs(p->v[k]) < least * element->size * rate * rate;
        if (!is_last(p, k, since, least))
            continue;
        double end = e < 1 ? t + e * since / (1 - e) : t;
        kmp_run_log_add(run->log, "accumulation", t, since, end,
                        "impacts of '%s' accumulate at t = %.9g; the contact closes", name_of(run, element), end);
        p->e[k] = 0;
    }
}

static void note_impacts(kmp_runner *run, double t, double gain)
{
    kmp_impact_run *p = run->impacts;
    double before = kmp_eval_kinetic(run->eval, p->before);
    kmp_text names = {0};
    for (int k = 0; k < p->count; k++) {
        if (p->f[k] == 0 || !element_of(run, k)->contact)
            continue;
        kmp_text_printf(&names, "%s'%s' at %.4g", names.length ? ", " : "", name_of(run, element_of(run, k)), -p->v[k]);
        p->since = fmin(p->since, t - p->last[p->which[k]]);
        p->last[p->which[k]] = t;
        element_of(run, k)->struck = true;
    }
    p->total++;
    kmp_run_log_add(run->log, "impact", t, before, before + gain, "%s: %.4g of %.4g J of kinetic energy are lost",
                    names.s ? names.s : "", -gain, before);
    kmp_text_free(&names);
}

/* Newton's law may gain energy where friction and several contacts take part: such an impact is plastic. */
static kempe_status keep_from_gaining(kmp_runner *run, double t, double *qd, double *gain)
{
    kmp_impact_run *p = run->impacts;
    if (run->s->rheonomic || *gain <= KMP_IMPACT_GAIN * kmp_eval_kinetic(run->eval, p->before))
        return KEMPE_OK;
    kmp_run_log_add(run->log, "restitution", t, NAN, NAN,
                    "with its restitution an impact would gain %.4g J: it is taken without", *gain);
    memset(p->e, 0, (size_t)p->count * sizeof *p->e);
    KMP_TRY(solve(run, t));
    *gain = apply(run, qd);
    return KEMPE_OK;
}

static void evaluate(kmp_runner *run, double t, const double *q, const double *qd)
{
    const double *now = kmp_eval_changes(run->eval, t, q, qd);
    memcpy(run->friction->change, now, (size_t)run->s->events.count * sizeof *now);
}

kempe_status kmp_impact_pass(kmp_runner *run, double t, double *q, double *qd, double *gain)
{
    kmp_impact_run *p = run->impacts;
    *gain = 0;
    p->since = INFINITY;
    evaluate(run, t, q, qd);
    double rate = kmp_friction_pace(run, qd);
    if (!list_touching(run, rate))
        return KEMPE_OK;
    memcpy(p->before, qd, (size_t)run->s->n * sizeof *qd);
    KMP_TRY(find_matrix(run, t, q));
    if (part_surfaces(run, t, q) > KMP_TOUCH_LIFT) { /* otherwise rows and rates are the same but for rounding */
        evaluate(run, t, q, qd);
        (void)list_touching(run, rate);
        KMP_TRY(find_matrix(run, t, q));
    }
    end_sequences(run, t, rate);
    KMP_TRY(solve(run, t));
    *gain = apply(run, qd);
    KMP_TRY(keep_from_gaining(run, t, qd, gain));
    note_impacts(run, t, *gain);
    return KEMPE_OK;
}

kempe_status kmp_impact_check_start(kmp_runner *run, double t, const double *q, const double *qd)
{
    const kmp_friction_run *x = run->friction;
    evaluate(run, t, q, qd);
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &x->element[i];
        double gap = kmp_friction_at(x, e, KMP_ROLE_PLACE);
        if (e->contact && gap < -KMP_TOUCH_NEAR * e->size)
            return kmp_fail(run->s->context, KEMPE_E_FAILED,
                            "contact '%s' overlaps by %.6g %s at the start; begin with its surfaces apart",
                            name_of(run, e), -gap,
                            ((const kmp_force *)run->s->events.condition[e->slot].of)->turns ? "rad" : "m");
    }
    return KEMPE_OK;
}
