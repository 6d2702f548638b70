/* SPDX-License-Identifier: BSD-3-Clause */
/* A spring that is stiffer in one direction, or a damper with two constants, has no linear equations where it rests.
 * The conditions are taken at places next to the state, in some directions and back. If they differ the matrices are
 * compared: flanks of teeth without play change together, and are one spring. */
#include "analyses/derivatives/switching_state.h"
#include "analyses/derivatives/sampled_motion.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "model/data/parameter.h"
#include <math.h>
#include <string.h>

enum { PLACES = 12 }; /* two of each direction */
#define SQRT2 1.4142135623730951

typedef struct sides {
    kmp_linear *l;
    kmp_arena arena;
    double *q, *qd, *qdd, *ud, *udd, *residual, *mode; /* of the state */
    double *mass, *damping, *stiffness, *force;        /* at the first place; the last one is the residual */
    double *near, *near_ud, *way;                      /* 2 n, p: a place; 2 n: a direction */
    double *x;                                         /* n x p: dq/du at the state */
    signed char *sign;                                 /* of each condition, place after place: -1, 0 and 1 */
} sides;

/* A condition with two sides that belong to the motion. */
static bool has_sides(const kmp_condition *c)
{
    return !c->ends && !c->late && !c->rough && c->validity == KMP_VALIDITY_NONE && c->role == KMP_ROLE_NONE;
}

static bool any_has_sides(const kmp_events *events)
{
    for (int k = 0; k < events->count; k++)
        if (has_sides(&events->condition[k]))
            return true;
    return false;
}

/* A part of the direction of a place, -1 to 1, by a sequence without periods. */
static double direction(int place, int part)
{
    const double golden = 0.61803398874989484820;
    const int pair = place / 2;
    const double x = (part + 1) * golden + (pair + 1) * golden * golden * (part + 2);
    return (place % 2 ? -1 : 1) * (2 * (x - floor(x)) - 1);
}

/* A place: independent coordinates and rates differ by a part of their sizes, the others follow. */
static void go_near(sides *s, int place)
{
    const kmp_linear *l = s->l;
    memcpy(s->near, s->q, (size_t)l->n * sizeof *s->near);
    memcpy(s->near + l->n, s->qd, (size_t)l->n * sizeof *s->near);
    for (int k = 0; k < 2 * l->p; k++) {
        const int u = k % l->p;
        const double change = KMP_EVENT_HERE * l->system->scale[l->part.u[u]] * direction(place, k);
        double *x = s->near + (k < l->p ? 0 : l->n);
        for (int i = 0; i < l->n; i++)
            x[i] += change * s->x[i + u * l->n];
    }
}

/* Takes the signs at all places; true if some condition has another one than at the first place. */
static bool find_signs(sides *s)
{
    const kmp_linear *l = s->l;
    const kmp_events *events = &l->system->events;
    bool differ = false;
    for (int place = 0; place < PLACES; place++) {
        go_near(s, place);
        const double *change = kmp_eval_changes(l->eval, l->t, s->near, s->near + l->n);
        signed char *sign = s->sign + place * events->count;
        for (int k = 0; change && k < events->count; k++) {
            sign[k] = has_sides(&events->condition[k]) ? (signed char)(change[k] < 0 ? -1 : 1) : 0;
            differ = differ || sign[k] != s->sign[k];
        }
    }
    (void)kmp_eval_changes(l->eval, l->t, s->q, s->qd);
    return differ;
}

/* True if a condition has another sign at some place. */
static bool is_near(const sides *s, int condition)
{
    const int count = s->l->system->events.count;
    bool differs = false;
    for (int place = 1; place < PLACES; place++)
        differs = differs || s->sign[place * count + condition] != s->sign[condition];
    return differs;
}

/* True if an earlier place has the same conditions. */
static bool is_known(const sides *s, int place)
{
    const size_t count = (size_t)s->l->system->events.count;
    for (int earlier = 0; earlier < place; earlier++)
        if (memcmp(s->sign + (size_t)earlier * count, s->sign + (size_t)place * count, count) == 0)
            return true;
    return false;
}

/* A state and its matrices with the present conditions. False: there are none. */
static bool take(kmp_linear *l, const double *q, const double *ud, const double *udd)
{
    const bool held = l->held;
    l->held = true;
    const kempe_status status = kmp_linear_at(l, l->t, q, ud, udd);
    l->held = held;
    if (status == KEMPE_OK)
        kmp_linear_matrices(l);
    return status == KEMPE_OK;
}

/* A place with its conditions. */
static bool take_place(sides *s, int place)
{
    kmp_linear *l = s->l;
    const kmp_events *events = &l->system->events;
    kmp_eval_set_modes(l->eval, s->mode);
    for (int k = 0; k < events->count; k++) {
        const int sign = is_near(s, k) ? s->sign[place * events->count + k] : 0;
        if (sign != 0 && events->condition[k].kink)
            kmp_eval_set_kink(l->eval, k, -sign);
        else if (sign != 0)
            kmp_eval_set_mode(l->eval, k, sign < 0);
    }
    go_near(s, place);
    for (int k = 0; k < l->p; k++)
        s->near_ud[k] = s->near[l->n + l->part.u[k]];
    return take(l, s->near, s->near_ud, s->udd);
}

static bool take_state(sides *s)
{
    kmp_eval_set_modes(s->l->eval, s->mode);
    return take(s->l, s->q, s->ud, s->udd);
}

/* The largest rate of the diagonals of both sides: a size for entries that are zero but for rounding. */
static double rate_of(const sides *s)
{
    const kmp_linear *l = s->l;
    double rate = 0;
    for (int i = 0; i < l->p; i++) {
        const int at = i * (l->p + 1);
        const double mass = fabs(l->mass[at]);
        if (mass > 0)
            rate = fmax(rate, fmax(fmax(fabs(l->damping[at]), fabs(s->damping[at])) / mass,
                                   sqrt(fmax(fabs(l->stiffness[at]), fabs(s->stiffness[at])) / mass)));
    }
    return rate;
}

/* True if an entry differs by more than a part of the largest of its row; `size`: of masses as entries. */
static bool entries_differ(const kmp_linear *l, const double *a, const double *b, double size)
{
    const int p = l->p;
    for (int i = 0; i < p; i++) {
        double largest = 0;
        for (int j = 0; j < p; j++)
            largest = fmax(largest, fmax(fabs(a[i + j * p]), fabs(b[i + j * p])));
        for (int j = 0; j < p; j++) {
            const double rounding = size * sqrt(fabs(l->mass[i * (p + 1)] * l->mass[j * (p + 1)]));
            if (fabs(a[i + j * p] - b[i + j * p]) > fmax(KMP_SIDES_DIFFER * largest, KMP_SIDES_ROUNDING * rounding))
                return true;
        }
    }
    return false;
}

/* True if the residual jumps by more than a small displacement changes it. */
static bool forces_differ(const sides *s)
{
    const kmp_linear *l = s->l;
    for (int i = 0; i < l->p; i++) {
        double least = KMP_SIDES_ROUNDING * (fabs(s->force[i]) + fabs(l->residual[i]));
        for (int j = 0; j < l->p; j++)
            least = fmax(least, KMP_SIDES_DIFFER * l->system->scale[l->part.u[j]] *
                                    fmax(fabs(s->stiffness[i + j * l->p]), fabs(l->stiffness[i + j * l->p])));
        if (fabs(s->force[i] - l->residual[i]) > least)
            return true;
    }
    return false;
}

/* True if the present matrices, with `damping` all of them, or forces differ from the first place. */
static bool are_others(const sides *s, bool damping)
{
    const kmp_linear *l = s->l;
    const double rate = rate_of(s);
    return forces_differ(s) || entries_differ(l, s->stiffness, l->stiffness, rate * rate) ||
           (damping && (entries_differ(l, s->damping, l->damping, rate) || entries_differ(l, s->mass, l->mass, 1)));
}

/* The first place whose matrices differ from place 0; -1: there is none. */
static int find_other(sides *s, bool damping)
{
    const kmp_linear *l = s->l;
    const size_t size = (size_t)(l->p * l->p) * sizeof(double);
    const bool first = take_place(s, 0);
    memcpy(s->mass, l->mass, size);
    memcpy(s->damping, l->damping, size);
    memcpy(s->stiffness, l->stiffness, size);
    memcpy(s->force, l->residual, (size_t)l->p * sizeof *s->force);
    for (int place = 1; place < PLACES; place++) {
        const bool taken = is_known(s, place) ? first : take_place(s, place);
        if (taken != first || (taken && are_others(s, damping)))
            return place;
    }
    return -1;
}

static bool make_sides(sides *s, kmp_linear *l)
{
    const int p = l->p, count = l->system->events.count;
    *s = (sides){.l = l};
    if (!KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double, l->n, &s->q, &s->qd, &s->qdd),
                        KMP_ROOM(double, 2 * l->n, &s->near, &s->way), KMP_ROOM(double, l->n *p, &s->x),
                        KMP_ROOM(double, p, &s->ud, &s->udd, &s->near_ud, &s->residual, &s->force),
                        KMP_ROOM(double, count, &s->mode), KMP_ROOM(signed char, PLACES *count, &s->sign),
                        KMP_ROOM(double, p *p, &s->mass, &s->damping, &s->stiffness)))
        return false;
    memcpy(s->q, l->q, (size_t)l->n * sizeof *s->q);
    memcpy(s->qd, l->qd, (size_t)l->n * sizeof *s->qd);
    memcpy(s->qdd, l->qdd, (size_t)l->n * sizeof *s->qdd);
    memcpy(s->x, l->red.x, (size_t)(l->n * p) * sizeof *s->x);
    for (int k = 0; k < p; k++) {
        s->ud[k] = l->qd[l->part.u[k]];
        s->udd[k] = l->qdd[l->part.u[k]];
    }
    memcpy(s->residual, l->residual, (size_t)p * sizeof *s->residual);
    memcpy(s->mode, l->eval->conditions.mode, (size_t)count * sizeof *s->mode);
    return true;
}

/* The first condition with another side at this place than at place 0; NULL: none. */
static const char *find_condition(const sides *s, int place)
{
    const int count = s->l->system->events.count;
    for (int k = 0; k < count; k++)
        if (s->sign[place * count + k] != s->sign[k])
            return s->l->system->event_text[k];
    return NULL;
}

/* True if the state, changed by this much of the directions of all coordinates and rates, has the conditions of the
 * place. The larger of the parts of coordinates is the distance of places. */
static bool stays(sides *s, int place, const double *dq, const double *dqd, double square)
{
    const kmp_linear *l = s->l;
    const int count = l->system->events.count, n = l->n;
    double largest = 0;
    for (int i = 0; i < n; i++)
        largest = fmax(largest, fabs(dq[i]) / l->system->scale[i]);
    if (!(largest > 0))
        return false;
    const double size = KMP_EVENT_HERE / largest;
    for (int i = 0; i < n; i++) {
        s->near[i] = s->q[i] + size * dq[i];
        s->near[n + i] = s->qd[i] + (square > 0 ? square * sqrt(size) : size) * dqd[i];
    }
    const double *change = kmp_eval_changes(l->eval, l->t, s->near, s->near + n);
    bool same = change != NULL;
    for (int k = 0; same && k < count; k++)
        same = !is_near(s, k) || (change[k] < 0 ? -1 : 1) == s->sign[place * count + k];
    return same;
}

/* A force of this side accelerates the state; true: into the side. */
static bool is_pushed_in(sides *s, int place)
{
    kmp_linear *l = s->l;
    const bool held = l->held;
    l->held = true;
    const bool known = kmp_linear_at_motion(l, l->t, s->near, s->near_ud) == KEMPE_OK;
    l->held = held;
    for (int i = 0; known && i < l->n; i++)
        s->way[i] = l->qdd[i] - s->qdd[i];
    return known && stays(s, place, s->way, s->way, SQRT2); /* a t^2 / 2 and a t */
}

/* The largest real rate by which a motion of this side grows and stays there; 0: none. The matrices of the place are
 * present. */
static kempe_status find_escape(sides *s, int place, double *rate)
{
    const kmp_linear *l = s->l;
    const kempe_model *model = l->system->model;
    kmp_spectrum spectrum;
    *rate = 0;
    if (kmp_model_delay_count(model) > 0 || kmp_samples_in(model))
        return KEMPE_OK;
    const kempe_status status = kmp_linear_spectrum(l, &spectrum);
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(l->system->context);
    if (status != KEMPE_OK)
        return status == KEMPE_E_FAILED ? KEMPE_OK : status;
    for (int k = spectrum.zeros; k < spectrum.count; k++) {
        const double re = spectrum.re[k];
        if (spectrum.im[k] != 0 || !(re > *rate))
            continue;
        for (int sign = -1; sign <= 1; sign += 2) {
            memset(s->way, 0, (size_t)(2 * l->n) * sizeof *s->way);
            for (int u = 0; u < l->p; u++)
                for (int i = 0; i < l->n; i++)
                    s->way[i] += sign * s->x[i + u * l->n] * spectrum.x_re[u + k * l->p];
            for (int i = 0; i < l->n; i++)
                s->way[l->n + i] = re * s->way[i];
            if (stays(s, place, s->way, s->way + l->n, 0))
                *rate = re;
        }
    }
    kmp_spectrum_free(&spectrum);
    return KEMPE_OK;
}

/* Visits a side with its equations in the linearisation; `other`: a place of another side. */
static kempe_status visit_side(sides *s, int place, int other, kmp_side_fn *visit, void *user)
{
    const kmp_linear *l = s->l;
    kmp_side side = {.condition = find_condition(s, place == 0 ? other : place)};
    if (!take_place(s, place))
        return KEMPE_OK;
    memcpy(s->stiffness, l->stiffness, (size_t)(l->p * l->p) * sizeof *s->stiffness);
    memcpy(s->force, s->residual, (size_t)l->p * sizeof *s->force);
    side.balanced = !forces_differ(s);
    if (side.balanced) {
        KMP_TRY(find_escape(s, place, &side.rate));
        side.leaves = side.rate > 0;
    } else {
        side.leaves = is_pushed_in(s, place);
    }
    return take_place(s, place) ? visit(user, l, &side) : KEMPE_OK;
}

kempe_status kmp_linear_each_side(kmp_linear *l, kmp_side_fn *visit, void *user)
{
    sides s;
    if (l->p == 0 || !any_has_sides(&l->system->events))
        return KEMPE_OK;
    kempe_status status = kmp_made(l->system->context, make_sides(&s, l));
    if (status == KEMPE_OK && find_signs(&s)) {
        const int other = find_other(&s, true);
        for (int place = 0; other > 0 && place < PLACES && status == KEMPE_OK; place++)
            if (place == 0 || !is_known(&s, place))
                status = visit_side(&s, place, other, visit, user);
        (void)take_state(&s);
        memcpy(l->residual, s.residual, (size_t)l->p * sizeof *s.residual);
    }
    kmp_arena_free(&s.arena);
    return status;
}

kempe_status kmp_linear_settle_switches(kmp_linear *l, bool damping, bool doubts)
{
    sides s;
    if (l->p == 0 || !any_has_sides(&l->system->events))
        return KEMPE_OK;
    kempe_status status = kmp_made(l->system->context, make_sides(&s, l));
    if (status == KEMPE_OK && find_signs(&s)) {
        const int other = find_other(&s, damping);
        const bool taken = take_state(&s);
        if (other > 0 && doubts && !l->switches) {
            l->switches = true;
            kmp_doubt(l->system->context,
                      "small motions have other equations on the other side of a condition that changes at this state, "
                      "and the result is of one side: %s",
                      find_condition(&s, other));
        } else if (other < 0 && taken && are_others(&s, damping))
            (void)take_place(&s, 0);
        memcpy(l->residual, s.residual, (size_t)l->p * sizeof *s.residual);
    }
    kmp_arena_free(&s.arena);
    return status;
}
