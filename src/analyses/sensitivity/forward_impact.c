/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of the rates behind an impact. With the impulses F of all rows that act, the rates v before and v+ after
 * it satisfy
 *
 *     M (v+ - v) = G' F,      G v+ + h_t + e (G v + h_t) = 0      in each row with a restitution e (closures: 0),
 *
 * and where friction slips, its impulse is mu times the impulse of its contact, against the slip behind the impact.
 * These equations are differentiated along the event, where q, v and t change with parameters. The decision on impulses
 * (integrators/impact) has found the rows that act. They may depend on each other; the change of the rates is unique
 * where the rates are. This is the saltation matrix of a mechanism with closures (Leine and Nijmeijer, Dynamics and
 * Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7). */
#include "analyses/sensitivity/forward_impact.h"
#include "analyses/sensitivity/forward_changes.h"
#include "analyses/sensitivity/forward_requirements.h"
#include "base/arena.h"
#include "constraints/tolerances.h"
#include "integrators/impact/impact_inside.h"
#include "integrators/impact/impact_problem.h"
#include "linalg/dense/lapack.h"
#include <math.h>
#include <string.h>

/* The law that determines the impulse of a row. */
typedef enum law {
    LAW_RATE,  /* by the rate behind the impact */
    LAW_SLIP,  /* friction that slips: by the impulse of its contact */
    LAW_ACROSS /* the same in two directions, along the slip behind the impact */
} law;

/* A row that acts. */
typedef struct acting {
    int row;     /* of J */
    bool struck; /* of a contact or friction, with a known impulse */
    law law;
    double e, v;     /* restitution; the rate before */
    double f;        /* the impulse */
    double mu;       /* of friction that slips */
    int base, twin;  /* of friction that slips: its contact, and the other component, among the rows that act */
    int restitution; /* the condition whose value is e; -1: e is constant */
    int distance;    /* the condition whose value is its distance; -1: it has none */
    int friction;    /* the condition whose value is mu */
} acting;

typedef struct impact {
    kmp_forward_formulation *f;
    kmp_arena arena;
    double t;
    const double *after; /* n: the rates behind it */
    acting *act;
    int count;
    int n, m, size;         /* size: n and the rows that act */
    double *mode;           /* of the conditions: friction acts only by rows */
    double *pulled;         /* parameters x n: changes of G'F */
    double *zero, *jump;    /* n + m; n: the change of the rates */
    double *lambda;         /* m: impulses */
    double *mass, *rows;    /* n x n, count x n */
    double *force, *rate;   /* parameters x n, parameters x m: changes of M jump - G'F, and of the rows' equations */
    double *slip;           /* parameters x m: changes of the rates behind the impact at constant rates */
    double *matrix, *right; /* size x size; size x parameters */
    double *solution;
    double *change;              /* conditions: derivatives of their values */
    bool begins;                 /* a restitution is zero, and depends on a parameter */
    kmp_forward_check *one_time; /* of the rows that act: contacts strike at one time */
} impact;

/* -- rows that act --------------------------------------------------------------------------------------- */

static acting *add_row(impact *x, int row)
{
    x->act[x->count] = (acting){.row = row, .base = -1, .twin = -1, .restitution = -1, .distance = -1, .friction = -1};
    return &x->act[x->count++];
}

static int find_row(const impact *x, int row)
{
    for (int k = 0; k < x->count; k++)
        if (x->act[k].row == row)
            return k;
    return -1;
}

/* All rows of closures. */
static void add_closures(impact *x, const kmp_friction_run *friction)
{
    for (int r = 0; r < x->m; r++) {
        bool of_element = false;
        for (int i = 0; friction && i < friction->count; i++)
            of_element = of_element || friction->element[i].row == r;
        if (!of_element)
            (void)add_row(x, r);
    }
}

/* Contacts and friction that act: their impulse is not zero, or need not be. */
static void add_struck(impact *x, const kmp_impact_run *p)
{
    for (int k = 0; p && k < p->count; k++) {
        const kmp_friction_element *e = kmp_impact_element(p, k);
        if (p->f[k] == 0 && (p->side[k] != 0 || p->upper[k] <= p->lower[k]))
            continue;
        acting *a = add_row(x, e->row);
        a->struck = true;
        a->distance = e->contact ? e->slot + KMP_ROLE_PLACE - KMP_ROLE_SENSE : -1;
        a->e = p->e[k];
        a->v = p->v[k];
        a->f = p->f[k];
        const int level = e->slot + KMP_ROLE_LEVEL - KMP_ROLE_SENSE;
        a->restitution = e->contact && (p->e[k] > 0 || p->friction->change[level] == 0) ? level : -1;
        if (e->base < 0 || p->side[k] == 0)
            continue;
        a->law = p->partner[k] >= 0 ? LAW_ACROSS : LAW_SLIP;
        a->friction = p->friction->element[e->base].slot + KMP_ROLE_STATIC - KMP_ROLE_SENSE;
    }
    for (int k = 0; p && k < p->count; k++) {
        const kmp_friction_element *e = kmp_impact_element(p, k);
        const int at = find_row(x, e->row);
        if (at < 0 || x->act[at].law == LAW_RATE)
            continue;
        acting *a = &x->act[at];
        a->base = find_row(x, p->friction->element[e->base].row);
        a->twin = e->twin >= 0 ? find_row(x, p->friction->element[e->twin].row) : -1;
        const double across = a->twin >= 0 ? x->act[a->twin].f : 0;
        a->mu = a->base >= 0 ? hypot(a->f, across) / fabs(x->act[a->base].f) : 0;
    }
}

/* -- the equations there --------------------------------------------------------------------------------- */

/* Adds the changes of the equations at rates qd with accelerations, without multipliers: of M qdd + C, times `force`,
 * and of J qd + h_t, times the restitution of each row if `before`. */
static const double *add_changes(impact *x, const double *qd, const double *qdd, double force, bool before, bool rates)
{
    kmp_forward_formulation *f = x->f;
    kmp_sensitivity_equations *v = f->v;
    kmp_linear *l = &v->linear;
    kmp_instant at = kmp_instant_of(l->eval, x->t, f->place.q, qd, qdd, x->zero);
    at.mode = x->mode;
    const double *d = kmp_tangents_derivatives(&l->tangents, &at);
    kmp_slopes_at(v->slopes, &at);
    const double *swing = kmp_forward_event_swing(&f->event);
    const int n = x->n, m = x->m;
    for (int k = 0; k < f->count; k++) {
        const double *dq = f->place.dq + k * n;
        double *to = x->force + k * n, *by = f->event.rows;
        memset(by, 0, (size_t)m * sizeof *by);
        kmp_tangents_add(&l->tangents, KMP_RATE_Q, d, 1, dq, by);
        if (force != 0) /* forces may have no derivative there */
            kmp_tangents_add(&l->tangents, KMP_R_Q, d, force, dq, to);
        for (int time = 0; time < 2; time++) {
            const double factor = !time ? 1 : swing ? swing[k] : 0;
            const kmp_change change = kmp_sensitivity_equations_change(v, time ? KMP_COLUMN_OF_TIME : k);
            for (int r = 0; factor != 0 && r < m; r++)
                by[r] += factor * change.rate[r];
            for (int i = 0; factor != 0 && force != 0 && i < n; i++)
                to[i] += force * factor * change.force[i];
        }
        for (int j = 0; rates && j < x->count; j++) {
            const int r = x->act[j].row;
            x->rate[k * m + r] += before ? x->act[j].e * by[r] : by[r];
            x->slip[k * m + r] += before ? 0 : by[r];
        }
    }
    return d;
}

/* M, and the rows that act. */
static void take_matrices(impact *x, const double *d)
{
    const kmp_tangents *tangents = &x->f->v->linear.tangents;
    for (int k = tangents->start[KMP_M]; k < tangents->start[KMP_M + 1]; k++) {
        const kmp_tangent *e = &tangents->entry[k];
        x->mass[e->row + e->col * x->n] = d[e->source];
    }
    for (int k = tangents->start[KMP_J]; k < tangents->start[KMP_J + 1]; k++) {
        const kmp_tangent *e = &tangents->entry[k];
        const int at = find_row(x, e->row);
        if (at >= 0)
            x->rows[at + e->col * x->count] = d[e->source];
    }
}

/* The impulses of closures, from the impulses of contacts: G' F = M (v+ - v). False: they do not explain the jump. */
static bool find_impulses(impact *x)
{
    const int n = x->n;
    const double *scale = x->f->system->scale;
    int closures = 0, most = 0;
    double *a = x->matrix, *b = x->right, size = 0, left = 0, rounding = 0;
    for (int k = 0; k < x->count; k++)
        most += !x->act[k].struck;
    for (int i = 0; i < n; i++) {
        b[i] = 0;
        for (int j = 0; j < n; j++)
            b[i] += x->mass[i + j * n] * x->jump[j];
        size += fabs(b[i]) * scale[i];
        for (int j = 0; j < n; j++)
            rounding += fabs(x->mass[i + j * n]) * (fabs(x->after[j]) + fabs(x->f->place.qd[j])) * scale[i];
        for (int k = 0; k < x->count; k++)
            b[i] -= x->rows[k + i * x->count] * x->act[k].f;
        b[i] *= scale[i];
        closures = 0;
        for (int k = 0; k < x->count; k++)
            if (!x->act[k].struck)
                a[i + closures++ * n] = x->rows[k + i * x->count] * scale[i];
    }
    if (most > 0 && kmp_least_squares(n, most, a, b, KMP_IMPACT_DEPENDENT, x->solution) < 0)
        return false;
    for (int i = 0; i < n; i++) {
        double rest = b[i];
        for (int k = 0; k < most; k++)
            rest -= a[i + k * n] * x->solution[k];
        left += fabs(rest);
    }
    closures = 0;
    for (int k = 0; k < x->count; k++)
        x->lambda[x->act[k].row] = x->act[k].struck ? x->act[k].f : x->solution[closures++];
    return left <= KMP_IMPACT_UNEXPLAINED * size + KMP_IMPACT_RATES * rounding;
}

/* -- the derivative -------------------------------------------------------------------------------------- */

/* The rate of a row behind the impact. */
static double rate_after(const impact *x, int k)
{
    double sum = 0;
    for (int i = 0; i < x->n; i++)
        sum += x->rows[k + i * x->count] * x->after[i];
    return sum;
}

/* The equation of row k, on its impulse and the rates; `right` of parameter i. */
static void put_row(impact *x, int k)
{
    const acting *a = &x->act[k];
    const int n = x->n, size = x->size, at = n + k, parameters = x->f->count;
    if (a->law == LAW_RATE) {
        for (int i = 0; i < n; i++)
            x->matrix[at + i * size] = x->rows[k + i * x->count];
        return;
    }
    const double sign = x->act[a->base].f > 0 ? 1 : -1, mu = a->mu;
    x->matrix[at + at * size] = 1;
    if (a->law == LAW_SLIP) {
        x->matrix[at + (n + a->base) * size] = a->f > 0 ? -mu * sign : mu * sign;
        return;
    }
    /* f_i = -mu |f_n| s_i / |s| with the slip s behind the impact. */
    const int twin = a->twin;
    const double s[2] = {rate_after(x, k), twin >= 0 ? rate_after(x, twin) : 0}, speed = hypot(s[0], s[1]);
    const double load = fabs(x->act[a->base].f), along = s[0] / speed, across = s[1] / speed;
    x->matrix[at + (n + a->base) * size] = mu * sign * along;
    const double by[2] = {mu * load * (1 - along * along) / speed, -mu * load * along * across / speed};
    for (int c = 0; c < 2 && (c == 0 || twin >= 0); c++) {
        const int other = c ? twin : k;
        for (int i = 0; i < n; i++)
            x->matrix[at + i * size] += by[c] * x->rows[other + i * x->count];
        for (int p = 0; p < parameters; p++)
            x->right[at + p * size] -= by[c] * x->slip[p * x->m + x->act[other].row];
    }
}

/* Notes why a contact has no derivative by a parameter: it strikes at another time than the event, or its restitution
 * begins at zero. */
static void note_obstacles(impact *x, int k, int parameter)
{
    const acting *a = &x->act[k];
    kmp_forward_check *check = &x->one_time[k];
    double span = 0;
    for (int i = 0; i < x->n; i++)
        span += fabs(x->rows[k + i * x->count]) * x->f->terms.span[parameter * x->n + i];
    check->off[parameter] = a->distance >= 0 ? x->change[a->distance] : 0;
    check->fails = check->fails || fabs(check->off[parameter]) > kmp_forward_part(check) * span;
    x->begins = x->begins || (a->e == 0 && a->restitution >= 0 && x->change[a->restitution] != 0);
}

/* Changes of restitution and of the coefficient of friction. */
static void put_laws(impact *x, int parameter)
{
    kmp_forward_formulation *f = x->f;
    const double *swing = kmp_forward_event_swing(&f->event);
    double *right = x->right + parameter * x->size + x->n, time = swing ? swing[parameter] : 0;
    const kmp_direction direction = {
        .t = &time, .q = f->place.dq + parameter * x->n, .qd = f->place.dqd + parameter * x->n};
    kmp_slopes_along(f->v->slopes, &f->v->slopes->events, &direction, parameter, x->change);
    for (int k = 0; k < x->count; k++) {
        const acting *a = &x->act[k];
        note_obstacles(x, k, parameter);
        if (a->law == LAW_RATE) {
            double old = 0;
            for (int i = 0; i < x->n; i++)
                old += x->rows[k + i * x->count] * f->place.dqd[parameter * x->n + i];
            right[k] = -x->rate[parameter * x->m + a->row] - a->e * old;
            const double change = a->restitution >= 0 ? x->change[a->restitution] : 0;
            right[k] -= change * a->v;
        } else {
            right[k] += x->change[a->friction] * a->f / a->mu;
        }
    }
}

static int solve(impact *x)
{
    const int n = x->n, size = x->size, parameters = x->f->count;
    const double *scale = x->f->system->scale, *row_scale = x->f->system->row_scale;
    memset(x->matrix, 0, (size_t)(size * size) * sizeof *x->matrix);
    memset(x->right, 0, (size_t)(size * parameters) * sizeof *x->right);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            x->matrix[i + j * size] = x->mass[i + j * n];
        for (int k = 0; k < x->count; k++)
            x->matrix[i + (n + k) * size] = -x->rows[k + i * x->count];
    }
    for (int k = 0; k < x->count; k++)
        put_row(x, k);
    for (int p = 0; p < parameters; p++) {
        put_laws(x, p);
        for (int i = 0; i < n; i++) { /* M dv+ = M dv - change */
            double *to = &x->right[i + p * size];
            *to = -x->force[p * n + i];
            for (int j = 0; j < n; j++)
                *to += x->mass[i + j * n] * x->f->place.dqd[p * n + j];
        }
    }
    /* Scaled: coordinates by their scales, rows by the scales of rows over the size of M. */
    double weight = 0;
    for (int i = 0; i < n; i++)
        weight = fmax(weight, x->mass[i + i * n] * scale[i] * scale[i]);
    const double to_row = weight > 0 ? weight : 1;
    for (int j = 0; j < size; j++)
        for (int i = 0; i < size; i++)
            x->matrix[i + j * size] *= (j < n ? scale[j] : to_row / row_scale[x->act[j - n].row]) *
                                       (i < n                           ? scale[i] / to_row
                                        : x->act[i - n].law == LAW_RATE ? 1 / row_scale[x->act[i - n].row]
                                                                        : row_scale[x->act[i - n].row] / to_row);
    for (int p = 0; p < parameters; p++)
        for (int i = 0; i < size; i++)
            x->right[i + p * size] *= i < n                           ? scale[i] / to_row
                                      : x->act[i - n].law == LAW_RATE ? 1 / row_scale[x->act[i - n].row]
                                                                      : row_scale[x->act[i - n].row] / to_row;
    if (kmp_least_squares_of(size, size, x->matrix, parameters, x->right, KMP_IMPACT_DEPENDENT, x->solution) < 0)
        return -1;
    for (int p = 0; p < parameters; p++)
        for (int i = 0; i < n; i++)
            x->f->place.dqd[p * n + i] = x->solution[i + p * size] * scale[i];
    return 0;
}

/* -- the whole ------------------------------------------------------------------------------------------- */

static bool make_room(impact *x)
{
    const int n = x->n, m = x->m, parameters = x->f->count, conditions = x->f->system->events.count;
    x->act = KMP_ARENA_NEW(&x->arena, acting, m > 0 ? m : 1);
    return KMP_ARENA_MAKE(&x->arena, KMP_ROOM(double, n + m, &x->zero), KMP_ROOM(double, n, &x->jump),
                          KMP_ROOM(double, m, &x->lambda), KMP_ROOM(double, n *n, &x->mass),
                          KMP_ROOM(double, n *m, &x->rows), KMP_ROOM(double, parameters *n, &x->force, &x->pulled),
                          KMP_ROOM(double, parameters *m, &x->rate, &x->slip),
                          KMP_ROOM(double, (n + m) * (n + m), &x->matrix),
                          KMP_ROOM(double, (n + m) * (parameters + 1), &x->right, &x->solution),
                          KMP_ROOM(double, conditions, &x->change, &x->mode)) &&
           x->act;
}

/* Conditions in which friction and contacts act only by rows. */
static void set_modes(impact *x, const kmp_friction_run *friction)
{
    memcpy(x->mode, x->f->v->linear.eval->conditions.mode, (size_t)x->f->system->events.count * sizeof *x->mode);
    for (int i = 0; friction && i < friction->count; i++) {
        const kmp_friction_element *e = &friction->element[i];
        double *mode = x->mode + e->slot;
        mode[0] = 0;
        mode[KMP_ROLE_GIVEN - KMP_ROLE_SENSE] = mode[KMP_ROLE_RATE - KMP_ROLE_SENSE] = 0;
        mode[KMP_ROLE_PLACE - KMP_ROLE_SENSE] = friction->change[e->slot + KMP_ROLE_PLACE - KMP_ROLE_SENSE];
        mode[KMP_ROLE_HELD - KMP_ROLE_SENSE] = find_row(x, e->row) >= 0;
    }
}

/* Takes the jump of the rates; false: it is one of rounding, and no contact strikes. */
static bool take_jump(impact *x, bool strikes)
{
    const kmp_forward_formulation *f = x->f;
    bool jumps = strikes;
    for (int i = 0; i < x->n; i++) {
        const double before = f->place.qd[i], usual = f->system->scale[i] * f->start.rate_scale;
        x->jump[i] = x->after[i] - before;
        jumps = jumps || fabs(x->jump[i]) > KMP_IMPACT_RATES * (fabs(x->after[i]) + fabs(before) + usual);
    }
    return jumps;
}

/* Changes of M times the jump less G'F. Only M and G change it: other terms of the same rates are taken away by the
 * changes at them without the jump, which x->force has. */
static int add_jump(impact *x)
{
    kmp_forward_formulation *f = x->f;
    if (!find_impulses(x))
        return kmp_forward_halt(f, "the jump of the rates at t = %.9g has no derivative with respect to parameters",
                                x->t);
    (void)add_changes(x, x->after, x->jump, 1, false, false);
    kmp_instant there = kmp_instant_of(f->v->linear.eval, x->t, f->place.q, x->zero, x->zero, x->zero);
    there.mode = x->mode;
    kmp_sensitivity_equations_pull(f->v, &there, x->lambda, f->place.dq, kmp_forward_event_swing(&f->event), x->pulled);
    for (int i = 0; i < f->count * x->n; i++)
        x->force[i] -= x->pulled[i];
    return KMP_GO;
}

/* Contacts strike at one time, whatever the parameters. */
static int judge_times(impact *x)
{
    kmp_forward_formulation *f = x->f;
    for (int k = 0; k < x->count; k++) {
        if (!x->one_time[k].fails)
            continue;
        for (int i = 0; i < x->n; i++)
            f->event.row[i] = x->rows[k + i * x->count];
        const char *reason = kmp_arena_printf(&f->arena,
                                              "contacts strike together at t = %.9g s, at times that depend on "
                                              "parameters in different ways: the motion has no derivative there",
                                              x->t);
        if (kmp_forward_require(f, &x->one_time[k], f->event.row, reason) != KMP_GO)
            return KMP_HALT;
    }
    return KMP_GO;
}

static int strike(impact *x, const kmp_passed_event *event)
{
    kmp_forward_formulation *f = x->f;
    if (!make_room(x)) {
        (void)kmp_fail_memory(f->system->context);
        return KMP_HALT;
    }
    add_closures(x, event->friction);
    add_struck(x, event->impact);
    x->size = x->n + x->count;
    set_modes(x, event->friction);
    if (!kmp_forward_make_checks(f, &x->arena, x->count, &x->one_time)) {
        (void)kmp_fail_memory(f->system->context);
        return KMP_HALT;
    }
    const bool jumps = take_jump(x, event->impact != NULL);
    take_matrices(x, add_changes(x, x->after, x->zero, jumps ? -1 : 0, false, true));
    (void)add_changes(x, f->place.qd, x->zero, 0, true, true);
    if (jumps && add_jump(x) != KMP_GO)
        return KMP_HALT;
    const kmp_instant at = kmp_instant_of(f->v->linear.eval, x->t, f->place.q, f->place.qd, x->zero, x->zero);
    (void)kmp_slopes_values(&f->v->slopes->events, &at);
    if (solve(x)) {
        (void)kmp_fail_memory(f->system->context);
        return KMP_HALT;
    }
    if (judge_times(x) != KMP_GO)
        return KMP_HALT;
    if (x->begins)
        return kmp_forward_halt(
            f,
            "a contact without restitution strikes at t = %.9g s: the motion has no derivative with "
            "respect to a restitution of zero",
            x->t);
    return KMP_GO;
}

int kmp_forward_strike(kmp_forward_formulation *f, const kmp_formulation_start *start)
{
    impact x = {.f = f, .t = start->t, .after = start->qd, .n = f->n, .m = f->m};
    const int said = strike(&x, start->passed);
    kmp_arena_free(&x.arena);
    return said;
}
