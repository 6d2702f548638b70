/* SPDX-License-Identifier: BSD-3-Clause */
/* Limits of motion: a mechanism of one degree of freedom moves by arc length in the scaled coordinates. Each step goes
 * along the tangent and is closed again; the turn of the tangent controls its length. A coordinate turns back where its
 * rate changes sign (its dead centre). Branches meet where the last pivot of J nearly vanishes (a change point). Both
 * are found to round-off. The motion ends when it returns to its start, angles modulo full turns with which the
 * closures hold at places on the way, too; otherwise it is followed in both directions. */
#include "constraints/diagnosis/diagnosis_limits.h"
#include "base/bracket.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/row_residuals.h"
#include "constraints/tolerances.h"
#include "linalg/dense/dot.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 3000, MOST_COORDINATES = 40, MOST_SAMPLES = 12 /* step 2^11 is the last one before MOST_STEPS */ };
#define FIRST_STEP 0.05
#define LONGEST    0.1
#define APPROACH   0.5  /* largest step over the last pivot, near other branches */
#define CROSSING   2e-4 /* smallest such step, with which an exact change point is crossed */
#define SHORTEST   1e-5
#define LEAST_DOT  0.985 /* of successive unit tangents */
#define FARTHEST   120.0 /* scaled */
#define SIDEWAYS   0.1   /* largest displacement by closing, over the step */
#define NEAR       1e-2
#define STANDS     1e-8 /* a coordinate with a smaller change does not move */
#define RETURNED   1e-7 /* scaled |h| after full turns: above errors of closed places times some turns */
#define TWO_PI     6.283185307179586

/* A configuration of the motion. */
typedef struct place {
    double *q, *tangent; /* n; tangent scaled, of unit length */
    double arc, pivot;
} place;

typedef struct trace {
    kmp_examination *x;
    kmp_limits *limits;
    int n;
    double usual;   /* the largest last pivot so far */
    double *sample; /* MOST_SAMPLES x n: configurations after steps 1, 2, 4, .. */
    int sample_count;
    bool aperiodic; /* angles have come back without the closures */
    place before, here, next, trial, least, start;
} trace;

/* The tangent at p->q, from the last J, on the side of `like`. */
static void tangent_at(trace *w, place *p, const double *like)
{
    kmp_walk *walk = w->x->walk;
    kmp_walk_tangents(walk, w->n - 1);
    p->pivot = walk->last;
    bool other = kmp_dot(w->n, walk->basis, like) < 0;
    for (int k = 0; k < w->n; k++)
        p->tangent[k] = other ? -walk->basis[k] : walk->basis[k];
}

/* Steps from `from` to `to` by h along the tangent; false if no closed state is close by. */
static bool stride(trace *w, const place *from, double h, place *to)
{
    const double *scale = w->x->system->scale;
    double sideways = 0;
    for (int k = 0; k < w->n; k++)
        to->q[k] = from->q[k] + h * from->tangent[k] * scale[k];
    if (!kmp_walk_close(w->x->walk, to->q))
        return false;
    for (int k = 0; k < w->n; k++) {
        double off = (to->q[k] - from->q[k]) / scale[k] - h * from->tangent[k];
        sideways += off * off;
    }
    if (sqrt(sideways) > SIDEWAYS * fabs(h) + 1e-9)
        return false;
    tangent_at(w, to, from->tangent);
    to->arc = from->arc + h;
    return kmp_dot(w->n, from->tangent, to->tangent) > LEAST_DOT;
}

static void copy(const trace *w, const place *from, place *to)
{
    memcpy(to->q, from->q, (size_t)w->n * sizeof *to->q);
    memcpy(to->tangent, from->tangent, (size_t)w->n * sizeof *to->tangent);
    to->arc = from->arc;
    to->pivot = from->pivot;
}

/* Extends the range of a coordinate. The start may be a dead centre. */
static void extend(kmp_coordinate_range *range, double q, bool dead, double scale)
{
    double same = dead ? STANDS * scale : 0;
    if (q > range->high - same) {
        range->high = fmax(q, range->high);
        range->high_dead = dead;
    }
    if (q < range->low + same) {
        range->low = fmin(q, range->low);
        range->low_dead = dead;
    }
}

/* True for an angle of a spherical joint that is singular at the start: the motion is followed in other angles. */
static bool is_unseen(const trace *w, int k)
{
    int c = kmp_chart_of(w->x->system, k);
    return c >= 0 && !kmp_chart_is_own(w->x->walk->eval->chart, c);
}

static void remember(trace *w, int coordinate, const double *q, double margin)
{
    kmp_limits *l = w->limits;
    if (l->limit_position_count == KMP_MOST_LIMIT_POSITIONS)
        return;
    double *copy_q = KMP_ARENA_NEW(w->x->arena, double, w->n);
    if (!copy_q)
        return;
    memcpy(copy_q, q, (size_t)w->n * sizeof *copy_q);
    kmp_charts_show(w->x->system, w->x->walk->eval->chart, q, copy_q, NULL);
    l->limit_position[l->limit_position_count++] = (kmp_limit_position){coordinate, copy_q, margin};
}

/* Finds the dead centre of coordinate k between here and next, by the sign of its tangent component. */
static void dead_centre(trace *w, int k)
{
    double b = w->next.arc - w->here.arc, fa = w->here.tangent[k], fb = w->next.tangent[k], x;
    for (int i = 0; i < 3; i++, b *= 1.02) { /* at the return to the start its arc length is inexact */
        if (!stride(w, &w->here, b, &w->trial))
            return;
        fb = w->trial.tangent[k];
        if ((fa > 0) != (fb > 0))
            break;
    }
    kmp_bracket bracket = kmp_bracket_of(0, fa, b, fb);
    while (fb != 0 && kmp_bracket_next(&bracket, 1e-14, &x)) {
        if (!stride(w, &w->here, x, &w->trial))
            return;
        double f = w->trial.tangent[k];
        if (fabs(f) < 1e-13)
            break;
        kmp_bracket_take(&bracket, x, f, (f > 0) == (fb > 0));
    }
    extend(&w->limits->range[k], w->trial.q[k], true, w->x->system->scale[k]);
    remember(w, k, w->trial.q, 1);
}

/* The last pivot at `h` from here; zero if closing fails, as near an exact change point. Keeps the best place. */
static double probe(void *self, double h)
{
    trace *w = self;
    if (!stride(w, &w->here, h, &w->trial))
        return 0;
    if (w->trial.pivot < w->least.pivot)
        copy(w, &w->trial, &w->least);
    return w->trial.pivot;
}

/* Finds the minimum of the last pivot between `before` and `next`. */
static void change_point(trace *w)
{
    copy(w, &w->here, &w->least);
    (void)kmp_bracket_least(probe, w, w->before.arc - w->here.arc, w->next.arc - w->here.arc, 1e-8);
    double margin = w->least.pivot / w->usual;
    if (margin < NEAR)
        remember(w, -1, w->least.q, margin < KMP_MARGIN_EXACT ? 0 : margin);
}

/* -- one direction ------------------------------------------------------------------------------------- */

static void notice(trace *w)
{
    for (int k = 0; k < w->n; k++) {
        double one = w->here.tangent[k], two = w->next.tangent[k];
        if ((one > 0) != (two > 0) && fmax(fabs(one), fabs(two)) > 1e-9 && !is_unseen(w, k))
            dead_centre(w, k);
        extend(&w->limits->range[k], w->next.q[k], false, 1);
    }
    if (w->here.pivot < 0.5 * w->usual && w->here.pivot < w->before.pivot && w->here.pivot <= w->next.pivot &&
        w->before.arc < w->here.arc)
        change_point(w);
    w->usual = fmax(w->usual, w->next.pivot);
}

/* True if full turns that bring `at` to the start keep the closures at the places on the way: angles may enter them
 * otherwise than by sine and cosine. */
static bool turns_are_free(trace *w, const double *at)
{
    kmp_walk *walk = w->x->walk;
    double *turned = w->least.q, most = 0;
    bool turns = false;
    for (int i = 0; i < w->sample_count; i++) {
        for (int k = 0; k < w->n; k++) {
            double turn = w->x->system->model->motions[k].rotation ? at[k] - w->start.q[k] : 0;
            turns = turns || fabs(turn) > 1;
            turned[k] = w->sample[i * w->n + k] + TWO_PI * round(turn / TWO_PI);
        }
        kmp_walk_evaluate(walk, turned);
        most = fmax(most, kmp_eval_residual(walk->eval));
    }
    return !turns || most <= RETURNED;
}

/* True if the step from here to next has passed the start, modulo full turns: next is then the start. */
static bool came_back(trace *w)
{
    const kempe_system *s = w->x->system;
    double along = 0, square = 0, h = w->next.arc - w->here.arc;
    if (kmp_dot(w->n, w->start.tangent, w->next.tangent) < LEAST_DOT || w->here.arc < 2 * LONGEST)
        return false;
    for (int k = 0; k < w->n; k++) {
        double off = w->start.q[k] - w->here.q[k];
        if (s->model->motions[k].rotation)
            off = remainder(off, TWO_PI);
        w->trial.q[k] = w->here.q[k] + off;
        off /= s->scale[k];
        along += off * w->here.tangent[k];
        square += off * off;
    }
    if (along < -1e-12 || along > h + 1e-12 || square - along * along > 0.02 * h * h + 1e-16)
        return false;
    if (!turns_are_free(w, w->trial.q)) {
        w->aperiodic = true;
        return false;
    }
    memcpy(w->next.q, w->trial.q, (size_t)w->n * sizeof *w->next.q);
    memcpy(w->next.tangent, w->start.tangent, (size_t)w->n * sizeof *w->next.tangent);
    w->next.arc = w->here.arc + along;
    w->next.pivot = w->start.pivot;
    return true;
}

static const char *end_of_search(const trace *w)
{
    return w->aperiodic
               ? "the motion is not periodic: angles return, but the closures are others after full turns; the "
                 "search was ended there"
               : "the motion continues: the search was ended there";
}

/* Follows the motion from the start along its tangent. Returns the reason of its end; NULL: it returned to the
 * start. */
static const char *trace_one_side(trace *w)
{
    double h = FIRST_STEP;
    w->sample_count = 0;
    copy(w, &w->start, &w->here);
    copy(w, &w->start, &w->before);
    for (int k = 0; k < MOST_STEPS; k++) {
        while (!stride(w, &w->here, h, &w->next))
            if ((h *= 0.5) < SHORTEST)
                return "the motion could not be followed further";
        bool back = came_back(w);
        notice(w);
        w->limits->length = fmax(w->limits->length, w->next.arc);
        if (back)
            return NULL;
        if (w->next.arc > FARTHEST)
            return end_of_search(w);
        h = fmin(fmin(1.3 * h, LONGEST), fmax(APPROACH * w->next.pivot / w->usual, CROSSING));
        if ((k & (k + 1)) == 0 && w->sample_count < MOST_SAMPLES)
            memcpy(w->sample + w->n * w->sample_count++, w->next.q, (size_t)w->n * sizeof *w->next.q);
        place old = w->before;
        w->before = w->here;
        w->here = w->next;
        w->next = old;
    }
    return end_of_search(w);
}

static const char *why_not(const kmp_examination *x)
{
    const kmp_diagnosis *d = x->diagnosis;
    if (x->system->rheonomic)
        return "a closure depends on time and determines the motion";
    if (x->part->n - d->generic_rank != 1)
        return "examined for one degree of freedom only";
    if (x->part->m == 0)
        return "no closures: nothing limits the motion";
    if (x->part->r < d->generic_rank)
        return "the start is a change point (bifurcation): use another start to see the limits of a branch";
    if (!d->moved)
        return "no motion was found from the start";
    if (x->part->n > MOST_COORDINATES)
        return "examined for up to 40 coordinates only";
    return NULL;
}

void kmp_diagnosis_limits(kmp_examination *x)
{
    kmp_limits *l = &x->diagnosis->limits;
    trace w = {.x = x, .limits = l, .n = x->system->n};
    l->why_not = why_not(x);
    if (l->why_not)
        return;
    l->range = KMP_ARENA_NEW(x->arena, kmp_coordinate_range, w.n);
    KMP_ARENA_EACH(x->arena, double, w.n, &w.start.q, &w.before.q, &w.here.q, &w.next.q, &w.trial.q, &w.least.q);
    w.sample = KMP_ARENA_NEW(x->arena, double, MOST_SAMPLES *w.n);
    if (!KMP_ARENA_EACH(x->arena, double, w.n, &w.start.tangent, &w.before.tangent, &w.here.tangent, &w.next.tangent,
                        &w.trial.tangent, &w.least.tangent))
        return;
    /* The start: the independent coordinate increases first. */
    memcpy(w.start.q, x->q, (size_t)w.n * sizeof *w.start.q);
    kmp_walk_evaluate(x->walk, x->q);
    tangent_at(&w, &w.start, w.start.tangent);
    if (w.start.tangent[x->part->u[0]] < 0)
        for (int k = 0; k < w.n; k++)
            w.start.tangent[k] = -w.start.tangent[k];
    w.usual = fmax(w.start.pivot, x->diagnosis->margin > 0 ? w.start.pivot / x->diagnosis->margin : 0);
    for (int k = 0; k < w.n; k++)
        l->range[k] = (kmp_coordinate_range){.low = x->q[k], .high = x->q[k]};
    l->walked = true;
    l->ended = trace_one_side(&w);
    l->cycle = !l->ended;
    if (l->ended) {
        for (int k = 0; k < w.n; k++)
            w.start.tangent[k] = -w.start.tangent[k];
        (void)trace_one_side(&w);
    }
    /* The coordinates that move, and the full turns of a cycle. */
    for (int k = 0; k < w.n; k++) {
        kmp_coordinate_range *s = &l->range[k];
        s->moves = s->high - s->low > STANDS * x->system->scale[k];
        if (l->cycle)
            s->turns = (int)lround((w.next.q[k] - w.start.q[k]) / TWO_PI);
        if (l->cycle && !x->system->model->motions[k].rotation)
            s->turns = 0;
        if (is_unseen(&w, k))
            *s = (kmp_coordinate_range){.low = NAN, .high = NAN, .moves = s->moves, .unseen = true};
    }
}
