/* SPDX-License-Identifier: BSD-3-Clause */
/* Dry friction that sticks at an equilibrium. */
#include "analyses/equilibrium/balance_friction.h"
#include "analyses/equilibrium/balances.h"
#include "analyses/equilibrium/equilibrium_study.h"
#include "analyses/equilibrium/friction_at_rest.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "integrators/run/island_runs.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/model.h"
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
    kmp_linear *l; /* of the whole, or of a part that nothing connects with the rest */
    kmp_friction_state *friction;
    double t;
    int coordinate, n;
    bool *which;         /* elements that stay */
    double *place;       /* where */
    double *distance;    /* of contacts */
    double *q, *tried;   /* n: the last state that is held; the one that is tried */
    double *start;       /* n: around which the sets lie */
    int *others;         /* n + 1: coordinates that are independent while all elements stay, and one more */
    kempe_status status; /* of errors */
    /* As parts of the whole: */
    const int *motion; /* by coordinates; NULL: it is the whole */
    const int *view;   /* by elements; NULL */
    const double *all; /* a state of the whole; how many coordinates it has */
    int all_count;
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

/* A state of the whole at an end. */
static kempe_status keep_end(const walk *w, kmp_arena *arena, kmp_rest_end *end)
{
    end->q = KMP_ARENA_NEW(arena, double, w->all_count);
    KMP_TRY(kmp_made(w->l->system->context, end->q));
    memcpy(end->q, w->all, (size_t)w->all_count * sizeof *end->q);
    for (int k = 0; k < w->n; k++)
        end->q[w->motion ? w->motion[k] : k] = w->q[k];
    return KEMPE_OK;
}

/* Both ends of the set of element i; `p`: coordinates that are independent while it stays, too. */
static kempe_status find_set(walk *w, int i, int p, kmp_arena *arena, kmp_rest_set *set)
{
    w->which[i] = false;
    KMP_TRY(kmp_friction_state_lock(w->friction, w->t, w->start, w->which, w->place));
    KMP_TRY(choose_coordinate(w, w->start, p, w->others, &w->coordinate));
    for (int k = 0; w->coordinate >= 0 && k < 2; k++) {
        memcpy(w->q, w->start, (size_t)w->n * sizeof *w->q);
        set->end[k].word = march(w, k ? 1 : -1);
        KMP_TRY(keep_end(w, arena, &set->end[k]));
    }
    set->coordinate = w->coordinate >= 0 && w->motion ? w->motion[w->coordinate] : w->coordinate;
    w->which[i] = true;
    return w->status;
}

/* The sets of a walk's elements, in their places among `sets`, with elements and coordinates of the whole. */
static kempe_status find_sets(walk *w, const kmp_friction_state *whole, kmp_arena *arena, kmp_rest_set *sets)
{
    KMP_TRY(kmp_friction_state_lock(w->friction, w->t, w->start, NULL, NULL));
    KMP_TRY(kmp_linear_choose(w->l, w->t, w->start, NULL, 0));
    const int p = w->l->p;
    memcpy(w->others, w->l->part.u, (size_t)p * sizeof *w->others);
    for (int i = 0; i < w->friction->count; i++)
        w->which[i] = w->friction->view[i].word == KMP_FRICTION_WORD_STICKS;
    kmp_friction_state_look(w->friction, w->t, w->start, NULL);
    for (int i = 0; i < w->friction->count; i++)
        w->place[i] = w->friction->view[i].place;
    for (int i = 0; i < w->friction->count; i++) {
        const int place = w->view ? w->view[i] : i;
        if (!w->which[i])
            continue;
        KMP_TRY(find_set(w, i, p, arena, &sets[place]));
        sets[place].element = sets[place].coordinate >= 0 ? whole->view[place].element : NULL;
    }
    return KEMPE_OK;
}

static kempe_status walk_init(walk *w, kmp_arena *arena)
{
    const int count = w->friction->count;
    return kmp_made(w->l->system->context,
                    KMP_ARENA_MAKE(arena, KMP_ROOM(double, w->n, &w->q, &w->tried, &w->start),
                                   KMP_ROOM(int, w->n + 1, &w->others), KMP_ROOM(bool, count, &w->which),
                                   KMP_ROOM(double, count, &w->place, &w->distance)));
}

/* The number of each element of a part among the elements of the whole, both by their closures. `of` (closures of the
 * whole): the element of each. */
static int *number_views(const kmp_friction_state *part, const int *closure, const int *of, kmp_arena *arena)
{
    int *view = KMP_ARENA_NEW(arena, int, part->count);
    for (int i = 0; view && i < part->count; i++)
        view[i] = of[closure[part->view[i].element->closure]];
    return view;
}

/* The sets of elements of part i. */
static kempe_status find_sets_of_part(const walk *whole, const struct kmp_island_systems *parts, int i, const int *of,
                                      kmp_arena *arena, kmp_rest_set *sets)
{
    kmp_linear linear = {0};
    kmp_arena own = {0};
    walk w = {.l = &linear, .t = whole->t, .all = whole->all, .all_count = whole->all_count};
    const kempe_system *s = kmp_island_system(parts, i, &w.motion);
    bool none = true;
    KMP_TRY(kmp_linear_init(&linear, s, kmp_backend_default()));
    kempe_status status = kmp_friction_state_new(linear.eval, &w.friction, &none);
    if (status == KEMPE_OK && !none) {
        w.n = s->n;
        int *view = number_views(w.friction, kmp_island_closures(parts, i), of, &own);
        status = walk_init(&w, &own);
        if (status == KEMPE_OK) {
            w.view = view;
            for (int k = 0; k < s->n; k++)
                w.start[k] = whole->all[w.motion[k]];
            kmp_friction_state_take_contacts(w.friction, whole->friction, view);
            status = find_sets(&w, whole->friction, arena, sets);
        }
    }
    kmp_friction_state_free(w.friction);
    kmp_arena_free(&own);
    kmp_linear_free(&linear);
    return status;
}

/* An element moves only with what is connected with it: the sets of each part are found apart. */
static kempe_status find_sets_by_parts(const walk *w, const struct kmp_island_systems *parts, kmp_arena *arena,
                                       kmp_rest_set *sets)
{
    int *of = KMP_NEW(int, w->l->system->model->closure_count);
    kempe_status status = kmp_made(w->l->system->context, of);
    for (int i = 0; of && i < w->friction->count; i++)
        of[w->friction->view[i].element->closure] = i;
    for (int i = 0; status == KEMPE_OK && i < kmp_island_systems_count(parts); i++)
        status = find_sets_of_part(w, parts, i, of, arena, sets);
    kmp_free(of);
    return status;
}

/* Finds the sets around the last state of `linear`, at rest and held by friction: one for each independent element.
 * Changes the state of `linear` and its friction. Errors: KEMPE_E_MEMORY, KEMPE_E_FAILED. */
static kempe_status find_rest_sets(kempe_equilibrium *e, kmp_linear *linear, kmp_balance *balance)
{
    const struct kmp_island_systems *parts = NULL;
    walk w = {.l = linear, .friction = e->friction, .t = linear->t, .n = linear->n, .all_count = linear->n};
    kmp_rest_set *sets = KMP_ARENA_NEW(&e->arena, kmp_rest_set, e->friction->count);
    KMP_TRY(kmp_made(linear->system->context, sets));
    KMP_TRY(walk_init(&w, &e->arena));
    memcpy(w.start, linear->q, (size_t)w.n * sizeof *w.start);
    w.all = w.start;
    if (!e->exchange && !e->averaged && e->friction->count > 1)
        KMP_TRY(kmp_island_systems_of_states(e->system, &parts));
    kempe_status status =
        parts ? find_sets_by_parts(&w, parts, &e->arena, sets) : find_sets(&w, e->friction, &e->arena, sets);
    kmp_friction_state_release(linear->eval);
    for (int i = 0; i < e->friction->count; i++)
        if (sets[i].element)
            sets[balance->set_count++] = sets[i];
    balance->set = sets;
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
    for (int r = 0; r < s->m; r++)
        for (int i = 0; i < f->count; i++)
            if (!f->view[i].contact && s->rows[r].closure == f->view[i].element->closure)
                b->lambda[r] = f->view[i].force;
    KMP_TRY(kmp_balance_add_loads(e, l, b->lambda, b));
    KMP_TRY(kmp_balance_add_outputs(e, l, b));
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
    return find_rest_sets(e, linear, balance);
}
