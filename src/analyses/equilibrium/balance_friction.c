/* SPDX-License-Identifier: BSD-3-Clause */
/* Dry friction that sticks at an equilibrium. */
#include "analyses/equilibrium/balance_friction.h"
#include "analyses/equilibrium/balances.h"
#include "analyses/equilibrium/equilibrium_study.h"
#include "analyses/equilibrium/friction_at_rest.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/state.h"
#include <math.h>
#include <string.h>

/* -- states of rest ---------------------------------------------------------------------------------- */

/* in characteristic sizes of the coordinate */
#define FIRST   0.02
#define LONGEST 0.1
#define FAR     10.0
#define TURN    6.283185307179586
#define LEAST   1e-6  /* of a step towards a limit */
#define WELL    0.3   /* of the largest change: a coordinate that moves so much is taken */
#define FINE    1e-13 /* of an end */

typedef struct walk {
    kmp_linear *l;
    kmp_friction_state *friction;
    double t;
    int coordinate, n;
    bool *which;         /* elements that stay */
    double *place;       /* where */
    double *distance;    /* of contacts */
    double *q, *tried;   /* n: the last state that is held; the one that is tried */
    kempe_status status; /* of errors */
} walk;

const char *kmp_rest_text(kmp_rest_word word)
{
    static const char *const words[] = {
        [KMP_REST_SLIPS] = "slips", [KMP_REST_LIMIT] = "limit", [KMP_REST_BEYOND] = "holds"};
    return words[word];
}

/* Takes w->tried, from w->q, to a value of the coordinate; *part: what friction needs there. False: impossible. */
static bool go(walk *w, double value, double *part)
{
    kmp_steady held = {.coordinate = w->coordinate, .how = KMP_RATE_HELD};
    kmp_search search = {.rates = &held, .rate_count = 1, .newton = true, .quiet = true, .keeps = true};
    memcpy(w->tried, w->q, (size_t)w->n * sizeof *w->q);
    kempe_status status = kmp_friction_state_lock(w->friction, w->t, w->tried, w->which, w->place);
    w->tried[w->coordinate] = value;
    if (status == KEMPE_OK)
        status = kmp_equilibrium_find(w->l, w->t, w->tried, &search);
    if (status == KEMPE_OK)
        status = kmp_friction_state_load(w->friction, w->t, w->tried);
    bool agrees = status == KEMPE_OK && kmp_friction_state_agrees(w->friction, w->t, w->tried, w->distance);
    *part = agrees ? w->friction->part : INFINITY;
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(w->l->system->context);
    else if (status != KEMPE_OK)
        w->status = status;
    return agrees;
}

static void accept(walk *w)
{
    memcpy(w->q, w->tried, (size_t)w->n * sizeof *w->q);
}

/* Negative where friction holds; finite. */
static double excess(double part)
{
    return part < INFINITY ? (part - 1) / (part + 1) : 1;
}

/* Goes in one direction as far as friction holds. */
static kmp_rest_word march(walk *w, double direction)
{
    const kempe_system *s = w->l->system;
    double size = s->scale[w->coordinate], begin = w->q[w->coordinate], step = FIRST * size, part = 0, now;
    double far = kmp_model_motion(s->model, w->coordinate)->rotation ? TURN : FAR * size;
    while (w->status == KEMPE_OK && fabs(w->q[w->coordinate] - begin) < far) {
        double next = w->q[w->coordinate] + direction * step;
        if (!go(w, next, &now)) {
            step /= 2;
            if (step < LEAST * size)
                return KMP_REST_LIMIT;
            continue;
        }
        if (!(now <= 1)) {
            /* The end between the last state and this one, where friction does not hold. */
            double x;
            kmp_bracket bracket = kmp_bracket_of(w->q[w->coordinate], excess(part), next, excess(now));
            while (w->status == KEMPE_OK && kmp_bracket_next(&bracket, FINE * size, &x)) {
                bool holds = go(w, x, &now) && now <= 1;
                if (holds)
                    accept(w);
                kmp_bracket_take(&bracket, x, excess(now), !holds);
            }
            return KMP_REST_SLIPS;
        }
        accept(w);
        part = now;
        step = fmin(1.5 * step, LONGEST * size);
    }
    return KMP_REST_BEYOND;
}

/* The place in u of the coordinate that is not among `others`; -1: there is none. */
static int find_free(const kmp_linear *l, int count, const int *others)
{
    for (int k = 0; k < l->p; k++) {
        bool other = false;
        for (int i = 0; i < count; i++)
            other = other || others[i] == l->part.u[k];
        if (!other)
            return k;
    }
    return -1;
}

/* The first coordinate of the model that moves well along the free direction becomes its coordinate. `others` has room
 * for it. -1: there is no free direction. */
static kempe_status choose_coordinate(walk *w, const double *q, int count, int *others, int *coordinate)
{
    kmp_linear *l = w->l;
    const double *scale = l->system->scale;
    double most = 0;
    KMP_TRY(kmp_linear_prefer(l, w->t, q, count, others));
    int k = find_free(l, count, others), i = 0;
    *coordinate = -1;
    if (k < 0)
        return KEMPE_OK;
    KMP_TRY(kmp_linear_at(l, w->t, q, NULL, NULL));
    const double *x = l->red.x + k * l->n;
    for (int j = 0; j < l->n; j++)
        most = fmax(most, fabs(x[j]) / scale[j]);
    while (fabs(x[i]) / scale[i] < WELL * most)
        i++;
    others[count] = *coordinate = i;
    return kmp_linear_prefer(l, w->t, q, count + 1, others);
}

static kempe_status find_sets(walk *w, const double *q, kmp_arena *arena, int *others, int *count, kmp_rest_set *sets)
{
    KMP_TRY(kmp_friction_state_lock(w->friction, w->t, q, NULL, NULL));
    KMP_TRY(kmp_linear_choose(w->l, w->t, q, NULL, 0));
    int p = w->l->p;
    memcpy(others, w->l->part.u, (size_t)p * sizeof *others);
    for (int i = 0; i < w->friction->count; i++)
        w->which[i] = w->friction->view[i].word == KMP_FRICTION_WORD_STICKS;
    kmp_friction_state_look(w->friction, w->t, q, NULL);
    for (int i = 0; i < w->friction->count; i++)
        w->place[i] = w->friction->view[i].place;
    for (int i = 0; i < w->friction->count; i++) {
        kmp_rest_set *set = &sets[*count];
        if (!w->which[i])
            continue;
        KMP_TRY(kmp_made(w->l->system->context, KMP_ARENA_EACH(arena, double, w->n, &set->end[0].q, &set->end[1].q)));
        /* Both ends of the set of element i; `others`: coordinates that are independent while it stays, too. */
        w->which[i] = false;
        KMP_TRY(kmp_friction_state_lock(w->friction, w->t, q, w->which, w->place));
        KMP_TRY(choose_coordinate(w, q, p, others, &set->coordinate));
        w->coordinate = set->coordinate;
        set->element = w->friction->view[i].element;
        for (int k = 0; w->coordinate >= 0 && k < 2; k++) {
            memcpy(w->q, q, (size_t)w->n * sizeof *q);
            set->end[k].word = march(w, k ? 1 : -1);
            memcpy(set->end[k].q, w->q, (size_t)w->n * sizeof *q);
        }
        w->which[i] = true;
        KMP_TRY(w->status);
        *count += set->coordinate >= 0;
    }
    return KEMPE_OK;
}

/* Finds the sets around q (n, at rest and held by friction), at t. `sets`: of `arena`, one for each independent
 * element. Changes the state of `linear` and its friction. Errors: KEMPE_E_MEMORY, KEMPE_E_FAILED. */
static kempe_status find_rest_sets(kmp_linear *linear, kmp_friction_state *friction, double t, const double *q,
                                   kmp_arena *arena, int *count, kmp_rest_set **sets)
{
    walk w = {.l = linear, .friction = friction, .t = t, .n = linear->n};
    double *start;
    int *others;
    *count = 0;
    bool made = KMP_ARENA_MAKE(arena, KMP_ROOM(double, w.n, &w.q, &w.tried, &start), KMP_ROOM(int, w.n + 1, &others),
                               KMP_ROOM(bool, friction->count, &w.which),
                               KMP_ROOM(double, friction->count, &w.place, &w.distance),
                               KMP_ROOM(kmp_rest_set, friction->count, sets));
    KMP_TRY(kmp_made(linear->system->context, made));
    memcpy(start, q, (size_t)w.n * sizeof *q);
    kempe_status status = find_sets(&w, start, arena, others, count, *sets);
    kmp_friction_state_release(linear->eval);
    return status;
}

/* -- friction at a balance ------------------------------------------------------------------------------ */

static const char *unit_of(const kempe_model *model, const kmp_friction_view *view)
{
    const kmp_force *element = view->element;
    bool turns = element->motion >= 0 ? kmp_model_motion(model, element->motion)->rotation
                                      : kmp_model_closure(model, element->closure)->power == 0;
    return turns ? "N m" : "N";
}

/* Names the elements at rest, all of them or the ones that need more than they have. Their number. */
static int name(const kempe_model *model, const kmp_friction_state *f, bool all, kmp_text *text)
{
    int count = 0;
    for (int i = 0; i < f->count; i++) {
        const kmp_friction_view *view = &f->view[i];
        bool takes_part = !view->contact && !view->off;
        bool named = takes_part && (all ? view->rate == 0 : view->needs > view->largest);
        if (named)
            kmp_text_printf(text, "%s'%s'", count++ ? ", " : "", view->element->name);
        if (named && !all)
            kmp_text_printf(text, " needs %.6g of at most %.6g %s", view->needs, view->largest, unit_of(model, view));
    }
    return count;
}

/* Forces of the elements that stick, also as multipliers of their rows. */
static kempe_status take_forces(kempe_equilibrium *e, const kmp_linear *l, kmp_balance *b)
{
    const kempe_system *s = e->system;
    kmp_friction_state *f = e->friction;
    KMP_TRY(kmp_friction_state_load(f, l->t, l->q));
    b->friction = KMP_ARENA_NEW(&e->arena, kmp_friction_view, f->count);
    KMP_TRY(kmp_made(s->context, b->friction));
    for (int i = 0; i < f->count; i++)
        if (!f->view[i].contact)
            b->friction[b->friction_count++] = f->view[i];
    memcpy(b->lambda, f->lambda, (size_t)s->m * sizeof *b->lambda);
    KMP_TRY(kmp_balance_add_loads(e, l, f->lambda, b));
    for (int r = 0; r < s->m; r++)
        for (int i = 0; i < f->count; i++)
            if (!f->view[i].contact && s->rows[r].closure == f->view[i].element->closure)
                b->lambda[r] = f->view[i].force;
    if (f->part > 1) {
        b->stability.word = KMP_NOT_HELD;
        /* Friction sticks only in this computation. */
        kmp_text names = {0};
        (void)name(s->model, f, false, &names);
        kmp_doubt(s->context,
                  "this state is not an equilibrium, because friction cannot hold it: %s; start where it can, or "
                  "compute without --stick",
                  names.s ? names.s : "it has no level");
        kmp_text_free(&names);
    }
    return KEMPE_OK;
}

kempe_status kmp_balance_name_resting(kempe_equilibrium *e, const kmp_linear *linear)
{
    kmp_text names = {0};
    if (!e->friction)
        return KEMPE_OK;
    kmp_friction_state_look(e->friction, linear->t, linear->q, linear->qd);
    if (name(e->system->model, e->friction, true, &names) > 0)
        e->resting = kmp_text_keep(&names, &e->arena);
    return kmp_made(e->system->context, !e->arena.failed);
}

kempe_status kmp_balance_add_friction(kempe_equilibrium *e, kmp_linear *linear, kmp_balance *balance)
{
    kmp_friction_state *f = e->friction;
    if (!f)
        return KEMPE_OK;
    kmp_friction_state_look(f, linear->t, linear->q, linear->qd);
    /* Friction at rest that has no force. */
    if (!e->stick && e->count == 0) {
        kmp_text names = {0};
        int count = name(e->system->model, f, true, &names);
        if (count > 0)
            kmp_log(
                e->system->context, KEMPE_LOG_WARNING,
                "friction %s is ignored here, for equilibrium and stability; --stick keeps its surfaces where they are",
                names.s);
        kmp_text_free(&names);
    }
    for (int k = 0; k < kmp_model_coordinates(e->system->model); k++)
        if (linear->qd[k] != 0)
            return KEMPE_OK;
    f->part = 0;
    KMP_TRY(e->stick ? take_forces(e, linear, balance) : KEMPE_OK);
    balance->friction_part = f->part;
    if (f->part > 1 || e->system->chart_count > 0)
        return KEMPE_OK;
    return find_rest_sets(linear, f, linear->t, linear->q, &e->arena, &balance->set_count, &balance->set);
}
