/* SPDX-License-Identifier: BSD-3-Clause */
/* Elements of friction that sticks: their inputs and values in a run. */
#include "constraints/tolerances.h"
#include "dynamics/kinematics/friction_modes.h"
#include "integrators/friction/friction_inside.h"
#include "linalg/dense/disc_minimum.h"
#include <math.h>
#include <string.h>

/* A rate that is never reached, m/s. */
#define FAR 1e200

/* -- making -------------------------------------------------------------------------------------------- */

/* The element of the contact whose surfaces rub; -1: none. */
static int base_of(const kmp_runner *run, const kmp_friction_run *x, const kmp_force *force)
{
    for (int i = 0; i < x->count; i++)
        if (force->contact > 0 && x->element[i].force == &run->s->model->forces[force->contact - 1])
            return i;
    return -1;
}

/* The element of the other component of slip in two directions; -1: it has one. */
static int twin_of(const kmp_friction_run *x, const kmp_force *force)
{
    for (int i = 0; i < x->count; i++)
        if (force->across > 0 && x->element[i].force == kmp_friction_twin(force))
            return i;
    return -1;
}

static kmp_friction_element element_of(const kmp_runner *run, int slot)
{
    const kmp_force *force = run->s->events.condition[slot].of;
    return (kmp_friction_element){.slot = slot,
                                  .name = force->name,
                                  .force = force,
                                  .contact = force->kind == KMP_FORCE_TOUCH,
                                  .loaded = kmp_force_lambda(force)};
}

kmp_friction_run *kmp_friction_new(kmp_runner *run, bool *none)
{
    const kmp_events *events = &run->s->events;
    kmp_arena *a = &run->arena;
    kmp_friction_run *x = KMP_ARENA_NEW(a, kmp_friction_run, 1);
    int count = 0;
    for (int k = 0; k < events->count; k++)
        count += events->condition[k].role == KMP_ROLE_SENSE;
    *none = count == 0;
    if (!x || *none)
        return NULL;
    x->past.t = x->past.since = -INFINITY;
    if (!KMP_ARENA_MAKE(
            a, KMP_ROOM(kmp_friction_element, count, &x->element),
            KMP_ROOM(int, count, &x->which, &x->side, &x->partner), KMP_ROOM(double, events->count, &x->change),
            KMP_ROOM(double, count *count, &x->d), KMP_ROOM(double, kmp_disc_room(count), &x->room),
            KMP_ROOM(double, count, &x->a, &x->lower, &x->upper, &x->f, &x->y, &x->tried, &x->aside, &x->found)))
        return NULL;
    for (int k = 0; k < events->count; k++)
        if (events->condition[k].role == KMP_ROLE_SENSE)
            x->element[x->count++] = element_of(run, k);
    for (int i = 0; i < x->count; i++) {
        x->element[i].base = base_of(run, x, x->element[i].force);
        x->element[i].twin = twin_of(x, x->element[i].force);
    }
    return x;
}

int kmp_friction_memory(kmp_friction_run *x, kmp_memory_piece *piece)
{
    if (!x)
        return 0;
    piece[0] = (kmp_memory_piece){x->element, (size_t)x->count * sizeof *x->element};
    piece[1] = (kmp_memory_piece){&x->past, sizeof x->past};
    return 2;
}

bool kmp_friction_is_loaded(const kempe_model *model)
{
    bool loaded = false;
    for (int k = 0; k < model->force_count; k++)
        loaded = loaded || model->forces[k].contact > 0 ||
                 (kmp_force_sticks(&model->forces[k]) && kmp_force_lambda(&model->forces[k]));
    return loaded;
}

/* -- inputs and values of an element ------------------------------------------------------------------- */

double kmp_friction_at(const kmp_friction_run *x, const kmp_friction_element *e, kmp_role role)
{
    return x->change[e->slot + (int)role - KMP_ROLE_SENSE];
}

void kmp_friction_put(kmp_runner *run, const kmp_friction_element *e, kmp_role role, double input)
{
    kmp_eval_set_kink(run->eval, e->slot + (int)role - KMP_ROLE_SENSE, input);
}

double kmp_friction_scale(const kmp_runner *run, const kmp_friction_element *e)
{
    const kmp_force *force = run->s->events.condition[e->slot].of;
    for (int r = 0; r < run->s->m; r++)
        if (run->s->rows[r].closure == force->closure)
            return run->s->row_scale[r];
    return 1;
}

/* A dae meets rates, also those of rows, within the tolerance of its steps alone. */
double kmp_friction_still(const kmp_runner *run)
{
    return fmax(KMP_FRICTION_STILL, run->method && run->method->dae ? KMP_FRICTION_DRIFT * run->spec.rtol : 0);
}

void kmp_friction_set_slip(kmp_runner *run, kmp_friction_element *e, double sense, double none)
{
    e->stance = KMP_FRICTION_SLIPS;
    e->sense = sense;
    kmp_friction_put(run, e, KMP_ROLE_SENSE, sense);
    kmp_friction_put(run, e, KMP_ROLE_HELD, 0);
    kmp_friction_put(run, e, KMP_ROLE_GIVEN, 0);
    kmp_friction_put(run, e, KMP_ROLE_PLACE, none);
    if (e->twin >= 0)
        kmp_friction_put(run, e, KMP_ROLE_RATE, 0);
}

void kmp_friction_set_off(kmp_runner *run, kmp_friction_element *e)
{
    kmp_friction_set_slip(run, e, 0, FAR);
}

double kmp_friction_halt(const kmp_runner *run, const kmp_friction_element *e, double rate)
{
    double none = fmax(KMP_FRICTION_STILL, KMP_FRICTION_DRIFT * run->spec.rtol);
    return none * kmp_friction_scale(run, e) * rate;
}

double kmp_friction_size(const kmp_friction_run *x, int i)
{
    return x->partner[i] < 0 ? fabs(x->f[i]) : hypot(x->f[i], x->f[x->partner[i]]);
}

kmp_box_outcome kmp_friction_minimum(kmp_friction_run *x, const double *lower, const double *upper)
{
    const kmp_box box = {x->rest, x->d, x->a, lower, upper};
    return kmp_disc_minimum(&box, x->partner, x->f, x->y, x->side, x->room);
}

/* Slip in two directions follows its own direction. From rest it has none yet: a rate in that of its acceleration is
 * added until it has begun. If the reserve is used up gradually, the direction of small rates is stiff; so this rate
 * is larger than what counts as none. */
static void set_across(kmp_runner *run, kmp_friction_element *e, double along, double rate)
{
    double size = kmp_friction_scale(run, e) * rate;
    e->back = kmp_friction_halt(run, e, rate);
    kmp_friction_set_slip(run, e, 1, e->back);
    kmp_friction_put(run, e, KMP_ROLE_RATE, e->rubs ? 0 : fmax(KMP_FRICTION_BEGIN * size, 10 * e->back) * along);
}

/* A contact that opens is open from where it is, and slip begins with the rate that it has: what rounding leaves of an
 * overlap, or of a rate against the slip, is none. Decisions about others before its surfaces are apart leave the
 * overlap that it was given. */
void kmp_friction_set_moving(kmp_runner *run, kmp_friction_element *e, double sense, double rate)
{
    if (e->twin >= 0) {
        set_across(run, e, sense, rate);
        return;
    }
    double size = kmp_friction_scale(run, e), gap = kmp_friction_at(run->friction, e, KMP_ROLE_PLACE);
    bool rebounds = kmp_friction_at(run->friction, e, KMP_ROLE_RATE) > KMP_FRICTION_STILL * size * rate;
    bool leaves = e->lift > 0 && !e->struck && gap < 0;
    bool again = leaves && gap < -e->lift; /* the error of steps holds it back */
    double lift = (rebounds ? KMP_TOUCH_LIFT : KMP_TOUCH_LIFTED) * size + fmax(-gap, 0);
    e->lift = again ? 4 * e->lift : leaves ? fmax(e->lift, lift) : lift;
    double none = kmp_friction_still(run) > KMP_FRICTION_STILL ? kmp_friction_still(run) / 2 : KMP_FRICTION_NONE;
    e->back = none * size * rate + fmax(-sense * kmp_friction_at(run->friction, e, KMP_ROLE_RATE), 0);
    kmp_friction_set_slip(run, e, sense, e->contact ? e->lift : e->back);
}

void kmp_friction_set_given(kmp_runner *run, kmp_friction_element *e, double force, double none)
{
    kmp_friction_set_slip(run, e, 0, none);
    kmp_friction_put(run, e, KMP_ROLE_GIVEN, force);
}

void kmp_friction_set_held(kmp_runner *run, kmp_friction_element *e, double place)
{
    kmp_friction_set_slip(run, e, 0, place);
    e->stance = KMP_FRICTION_HELD;
    kmp_friction_put(run, e, KMP_ROLE_HELD, 1);
}

/* The rate at which an element that is regularised has left. */
static double rate_left(const kmp_friction_element *e)
{
    return KMP_FRICTION_LEFT * e->force->regularise.value;
}

void kmp_friction_set_smooth(kmp_runner *run, kmp_friction_element *e)
{
    kmp_friction_set_slip(run, e, 0, rate_left(e));
    e->stance = KMP_FRICTION_SMOOTH;
    kmp_friction_put(run, e, KMP_ROLE_SENSE, KMP_FRICTION_REGULARISED);
}

bool kmp_friction_stays_smooth(const kmp_friction_run *x, const kmp_friction_element *e)
{
    return e->smooth && fabs(kmp_friction_at(x, e, KMP_ROLE_RATE)) < (1 - KMP_FRICTION_TIE) * rate_left(e);
}

bool kmp_friction_is_smooth(const kmp_friction_run *x)
{
    bool any = false;
    for (int i = 0; x && i < x->count; i++)
        any = any || x->element[i].smooth;
    return any;
}

/* -- evaluation ---------------------------------------------------------------------------------------- */

kempe_status kmp_friction_choose(kmp_runner *run, double t, const double *q)
{
    kmp_partition_free(&run->part);
    return kmp_runner_choose(run, t, q, -1, NULL, 0);
}

kempe_status kmp_friction_measure(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_friction_run *x = run->friction;
    kmp_eval_closure(run->eval, t, q);
    KMP_TRY(kmp_runner_accelerate(run, t, q, qd));
    kmp_eval_all_changes(run->eval, t, q, qd, run->qdd, run->lambda, x->change);
    return KEMPE_OK;
}

void kmp_friction_note(kmp_runner *run)
{
    kmp_friction_run *x = run->friction;
    memcpy(x->change, run->crossing->change, (size_t)run->s->events.count * sizeof(double));
    for (int i = 0; i < x->count; i++) {
        kmp_friction_element *e = &x->element[i];
        bool keeps = e->stance == KMP_FRICTION_HELD || e->stance == KMP_FRICTION_CARRIED;
        const kmp_friction_element *twin = e->twin < 0 ? e : &x->element[e->twin];
        keeps = keeps || twin->stance == KMP_FRICTION_HELD || twin->stance == KMP_FRICTION_CARRIED;
        e->fired = keeps && kmp_friction_at(x, e, KMP_ROLE_HELD) < 0;
        e->before = kmp_friction_at(x, e, KMP_ROLE_GIVEN);
    }
}

void kmp_friction_release(kmp_runner *run)
{
    for (int i = 0; i < run->friction->count; i++)
        kmp_friction_put(run, &run->friction->element[i], KMP_ROLE_HELD, 0);
}

void kmp_friction_show(kmp_runner *run, double t, double *row)
{
    const kempe_system *s = run->s;
    kmp_friction_run *x = run->friction;
    double *lambda = row + 3 * s->n;
    kmp_eval_all_changes(run->eval, t, row, row + s->n, row + 2 * s->n, lambda, x->change);
    for (int r = 0; r < s->m; r++) {
        const kmp_closure *closure = &s->model->closures[s->rows[r].closure];
        for (int i = 0; i < x->count && kmp_closure_is_friction(closure); i++)
            if (s->events.condition[x->element[i].slot].of == &s->model->forces[closure->force])
                lambda[r] = kmp_friction_at(x, &x->element[i], KMP_ROLE_GIVEN);
    }
}

kempe_status kmp_friction_is_independent(kmp_runner *run, kmp_friction_element *e, double t, const double *q,
                                         bool *adds)
{
    int rank = run->part.r;
    kmp_partition with;
    kmp_friction_set_held(run, e, kmp_friction_at(run->friction, e, KMP_ROLE_PLACE));
    kmp_eval_closure(run->eval, t, q);
    KMP_TRY(kmp_partition_init(&with, run->s, run->eval->jacobian, NULL, 0));
    double before = rank > 0 ? run->part.pivots[rank - 1] : with.pivots[0];
    *adds = with.r > rank && with.pivots[with.r - 1] > KMP_FRICTION_RANK * before;
    kmp_partition_free(&with);
    return KEMPE_OK;
}

kempe_status kmp_friction_adds_row(kmp_runner *run, kmp_friction_element *e, double t, const double *q, bool *adds)
{
    KMP_TRY(kmp_friction_is_independent(run, e, t, q, adds));
    return *adds ? kmp_friction_choose(run, t, q) : KEMPE_OK;
}
