/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/equilibrium/rest_set.h"
#include "base/bracket.h"
#include "base/context.h"
#include "studies/equilibrium/equilibrium_study.h"
#include <math.h>
#include <string.h>

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

/* The end between the last state and `far`, where friction does not hold. */
static void narrow(walk *w, double part, double far, double beyond, double size)
{
    double x, now;
    kmp_bracket bracket = kmp_bracket_of(w->q[w->coordinate], excess(part), far, excess(beyond));
    while (w->status == KEMPE_OK && kmp_bracket_next(&bracket, FINE * size, &x)) {
        bool holds = go(w, x, &now) && now <= 1;
        if (holds)
            accept(w);
        kmp_bracket_take(&bracket, x, excess(now), !holds);
    }
}

/* Goes in one direction as far as friction holds. */
static kmp_rest_word march(walk *w, double direction)
{
    const kempe_system *s = w->l->system;
    double size = s->scale[w->coordinate], begin = w->q[w->coordinate], step = FIRST * size, part = 0, now;
    double far = s->model->motions[w->coordinate].rotation ? TURN : FAR * size;
    while (w->status == KEMPE_OK && fabs(w->q[w->coordinate] - begin) < far) {
        double next = w->q[w->coordinate] + direction * step;
        if (!go(w, next, &now)) {
            step /= 2;
            if (step < LEAST * size)
                return KMP_REST_LIMIT;
            continue;
        }
        if (!(now <= 1)) {
            narrow(w, part, next, now, size);
            return KMP_REST_SLIPS;
        }
        accept(w);
        part = now;
        step = fmin(1.5 * step, LONGEST * size);
    }
    return KMP_REST_BEYOND;
}

/* The place in u of the coordinate beside those of `others`; -1: there is none. */
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

kempe_status kmp_rest_sets_find(kmp_linear *linear, kmp_friction_state *friction, double t, const double *q,
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
