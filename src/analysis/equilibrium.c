/* SPDX-License-Identifier: BSD-3-Clause */
/* From afar: Newton's direction with the symmetric part of Kr made positive, its eigenvalues taken by their size (as by
 * Dauphin et al., NIPS 27 (2014) 2933), so that s'R < 0: of a conservative mechanism the way down its potential, of any
 * other that of a heavily damped motion. A step is bounded, and as long as the work s'R along it has fallen to half at
 * its end or still goes down (Matthies and Strang, IJNME 14 (1979) 1613): no potential has to be known. Where R = 0 and
 * Kr still falls in some direction the state is pushed aside along it. Newton's steps by least squares end it. */
#include "analysis/load_path.h"
#include "analysis/way.h"
#include "base/memory.h"
#include "constraints/charts.h"
#include "linalg/dot.h"
#include <math.h>
#include <string.h>

enum { MOST_HALVINGS = 40, MOST_PUSHES = 12, MOST_DOWN = KMP_MOST_ITERATIONS - 40 };

#define NOTHING 1e-9 /* a column of Kr, in parts of its largest entry: of what nothing depends on */
enum { MOST_TOLD = 12 };
#define NEAR          0.003 /* Newton's step at a stable equilibrium, rad or characteristic lengths */
#define STILL         1e-6  /* at any other */
#define FIRST_BOUND   0.3   /* rad, or characteristic lengths */
#define SHORT_BOUND   1e-3
#define LONGEST       0.3
#define PUSH          0.05
#define FARTHEST      1e4  /* what moves as far never stops */
#define RUNAWAY_TURNS 20.0 /* rad: what went as far without an end runs away */

/* -- steps ----------------------------------------------------------------------------------------------- */

static void shorten(kmp_way *w, double factor)
{
    for (int i = 0; i < w->n; i++)
        w->move[i] *= factor;
    for (int k = 0; k < w->count; k++)
        w->step[k] *= factor;
}

/* s'R of the step, of some R. */
static double work_along(const kmp_way *w, const double *residual)
{
    double sum = 0;
    for (int k = 0; k < w->count; k++)
        sum += w->step[k] * residual[w->place[k]];
    return sum;
}

/* So far along the step that the work has fallen to half or goes on down. 0: nowhere. */
static double search_line(kmp_way *w)
{
    double first = work_along(w, w->force), part = 1;
    for (int k = 0; k < MOST_HALVINGS; k++) {
        if (!kmp_way_try(w, part)) {
            part /= 2;
            continue;
        }
        double last = work_along(w, w->l->residual);
        if (last <= 0.5 * fabs(first))
            return part;
        part *= fmax(0.1, fmin(0.8, first / (first - last)));
    }
    return 0;
}

/* -- from afar --------------------------------------------------------------------------------------- */

/* The coordinate that went farthest, and how far. */
static int farthest(const kmp_way *w, double *far)
{
    int best = 0;
    *far = 0;
    for (int k = 0; k < w->l->p; k++) {
        int c = w->l->part.u[k];
        double size = fabs(w->q[c] - w->begin[c]) / w->l->system->scale[c];
        if (size > *far) {
            *far = size;
            best = k;
        }
    }
    return best;
}

static int place_in_u(const kmp_linear *l, int coordinate)
{
    for (int k = 0; k < l->p; k++)
        if (l->part.u[k] == coordinate)
            return k;
    return -1;
}

/* Whether nothing depends on where u[k] is, and some force on its rate: it may go on steadily. After
 * kmp_linear_matrices. */
static bool may_go_on(const kmp_linear *l, int k)
{
    double most = 0, own = 0;
    for (int column = 0; column < l->p; column++)
        for (int row = 0; row < l->p; row++) {
            double size = fabs(l->stiffness[row + column * l->p]) * l->system->scale[l->part.u[row]] *
                          l->system->scale[l->part.u[column]];
            most = fmax(most, size);
            own = column == k ? fmax(own, size) : own;
        }
    return own <= NOTHING * most && l->damping[k + k * l->p] > 0;
}

/* Which coordinates may, all of them: where one runs away the others do. */
static void tell_steady(const kmp_linear *l, kmp_text *text)
{
    int count = 0;
    for (int k = 0; k < l->p; k++)
        if (may_go_on(l, k) && count++ < MOST_TOLD)
            kmp_text_printf(text, "%s%s", count > 1 ? ", " : ". Forces depend on the rates, and not on the places, of ",
                            l->system->model->motions[l->part.u[k]].name);
    if (count > MOST_TOLD)
        kmp_text_printf(text, " and %d more", count - MOST_TOLD);
    if (count > 0)
        kmp_text_put(text,
                     ": they may go on steadily. Give their rates (--rates 'NAME=RATE,..'), and let them be unknown "
                     "where nothing fixes them (--free 'qd(NAME),..')");
}

/* Who pulls at the start along the coordinate u[k], which has gone so far since. */
static kempe_status complain_runaway(kmp_way *w, int k, double far)
{
    kmp_linear *l = w->l;
    int coordinate = l->part.u[k], place = -1;
    const kmp_motion *motion = &l->system->model->motions[coordinate];
    kmp_load_path path = {0};
    kmp_text pulls = {0}, steady = {0};
    if (!w->search->quiet && kmp_way_at(w, w->begin))
        place = place_in_u(l, coordinate);
    kempe_status status = place >= 0 ? kmp_load_path_find(l, place, &path) : KEMPE_OK;
    if (status != KEMPE_OK)
        return status;
    if (place >= 0 && path.count > 0)
        kmp_text_put(&pulls, "; along it pull, at the start: ");
    kmp_load_path_tell(&pulls, l, place, &path);
    if (place >= 0) {
        kmp_linear_matrices(l);
        if (may_go_on(l, place))
            tell_steady(l, &steady);
    }
    (void)kmp_fail(l->system->context, KEMPE_E_FAILED,
                   "no equilibrium: nothing holds '%s', which runs away by %.3g %s%s; no spring, stop or closure "
                   "answers: add one, start nearer to an equilibrium, or fix it and let a load be unknown instead%s",
                   motion->name, far * l->system->scale[coordinate], motion->rotation ? "rad" : "m",
                   pulls.s ? pulls.s : "", steady.s ? steady.s : "");
    kmp_text_free(&steady);
    kmp_load_path_free(&path);
    kmp_text_free(&pulls);
    return KEMPE_E_FAILED;
}

/* Aside along the direction in which Kr falls most. */
static bool push_aside(kmp_way *w)
{
    int largest = 0;
    for (int k = 0; k < w->count; k++) {
        w->step[k] = w->vectors[k] * w->size[k];
        if (fabs(w->vectors[k]) > fabs(w->vectors[largest]))
            largest = k;
    }
    double far = kmp_way_spread(w);
    shorten(w, (w->vectors[largest] < 0 ? -PUSH : PUSH) / far);
    for (int k = 0; k < MOST_HALVINGS; k++)
        if (kmp_way_try(w, ldexp(1, -k)))
            return kmp_way_arrive(w);
    return false;
}

/* The direction at hand leads so far. */
static bool step_down(kmp_way *w, double far)
{
    double wanted = far;
    if (!(far < HUGE_VAL))
        return false;
    if (far > w->bound) {
        shorten(w, w->bound / far);
        far = w->bound;
    }
    double part = search_line(w);
    if (part == 0) {
        (void)kmp_way_back(w);
        return false;
    }
    if (part == 1 && wanted > w->bound)
        w->bound = w->search->balanced ? fmin(2 * w->bound, LONGEST) : 2 * w->bound;
    else if (part < 1)
        w->bound = fmax(0.5 * w->bound, part * far);
    kmp_way_note_step(w, part * far);
    return kmp_way_arrive(w);
}

/* Whether it has come to its end. Springs that are stiff beside others make every residual small: the step is what
 * tells how far it is. A start that is balanced already is told about, whatever it is. */
static bool is_there(const kmp_way *w, double far)
{
    if (w->residual > KMP_WAY_BALANCED)
        return false;
    if (w->search->balanced)
        return true;
    bool stable = w->least >= -KMP_WAY_FLAT;
    return stable ? far <= (w->flat ? STILL : NEAR) : far <= STILL && w->search->iterations == 1;
}

static kempe_status descend(kmp_way *w)
{
    int pushes = 0;
    double far;
    while (w->search->iterations < MOST_DOWN) {
        if (kmp_interrupted(w->l->system->context))
            return kmp_way_complain(w, "interrupted");
        if (!kmp_way_decompose(w))
            return w->status;
        kmp_way_note(w, w->residual);
        far = kmp_way_direction(w) ? kmp_way_spread(w) : HUGE_VAL;
        if (is_there(w, far))
            return KEMPE_OK;
        bool balanced = w->residual <= KMP_WAY_BALANCED && far <= STILL;
        bool gone = balanced && pushes < MOST_PUSHES ? push_aside(w) : step_down(w, far);
        pushes += balanced;
        if (!gone)
            return w->status != KEMPE_OK ? w->status : kmp_way_complain(w, "no step leads further down");
        int k = farthest(w, &far);
        if (far > FARTHEST)
            return complain_runaway(w, k, far);
    }
    int k = farthest(w, &far);
    return far > RUNAWAY_TURNS ? complain_runaway(w, k, far) : kmp_way_complain(w, "too many iterations");
}

static kempe_status find(kmp_way *w)
{
    kempe_status status = KEMPE_OK;
    memcpy(w->begin, w->q, (size_t)w->n * sizeof *w->q);
    (void)kmp_way_center(w);
    status = kmp_way_choose(w);
    if (status != KEMPE_OK)
        return status;
    if (!kmp_way_at(w, w->q) || !kmp_way_arrive(w))
        return w->status != KEMPE_OK ? w->status
                                     : kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                                                "the equations cannot be evaluated at the start: loops that do not "
                                                "close, or numbers that are not finite");
    if (!w->search->nearest && !w->search->exchange)
        status = descend(w);
    return status == KEMPE_OK ? kmp_way_least(w) : status;
}

kempe_status kmp_equilibrium_find(kmp_linear *linear, double t, double *q, kmp_search *search)
{
    kmp_way w = {.l = linear, .search = search, .t = t, .n = linear->n, .told = NAN};
    w.bound = search->balanced ? SHORT_BOUND : FIRST_BOUND;
    search->iterations = search->exchanges = 0;
    kempe_status status = kmp_way_init(&w) ? KEMPE_OK : kmp_fail_memory(linear->system->context);
    if (status == KEMPE_OK) {
        memcpy(w.q, q, (size_t)w.n * sizeof *q);
        status = find(&w);
        if (status == KEMPE_E_FAILED && kmp_interrupted(linear->system->context))
            status = KEMPE_STOPPED;
        search->residual = w.residual;
    }
    if (status == KEMPE_OK)
        memcpy(q, w.q, (size_t)w.n * sizeof *q);
    for (int k = 0; status != KEMPE_OK && w.given && k < search->rate_count; k++)
        search->rates[k].rate = w.given[k];
    kmp_arena_free(&w.arena);
    return status;
}
