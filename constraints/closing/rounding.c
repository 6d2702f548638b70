/* SPDX-License-Identifier: BSD-3-Clause */
/* Finite motions distinguish rounding from real pivots. If a direction of the rows is dropped that only rounding makes,
 * the mechanism gains a motion along which the dropped rows stay open by the rounding, however far it goes. If a small
 * pivot is real, as near a change point, the mechanism does not have the motion gained: the dropped rows open with the
 * square of the distance and soon exceed the tolerance. A small loop in a large mechanism cannot open far: its own size
 * is the measure. */
#include "constraints/closing/rounding.h"
#include "constraints/closing/random_walk.h"
#include "constraints/tolerances.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* The sides of a loop: on each body from its joint to the next, up to the common ancestor on both branches. A body that
 * slides or deforms can change its side, and excludes the test. */

static void position(const kempe_model *model, int point, double at[3])
{
    for (int k = 0; k < 3; k++)
        at[k] = point < 0 ? 0 : model->points[point].at[k].value;
}

static void add_side(kmp_loop_polygon *p, int body, int from, int to)
{
    double a[3], b[3];
    position(p->model, from, a);
    position(p->model, to, b);
    double length = hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
    p->sum += length;
    if (length > p->longest) {
        p->longest = length;
        p->body = body;
        p->from = from;
        p->to = to;
    }
}

/* Adds the sides on the bodies from point `at` of `body` up to `top`. *at is then a point of `top`. */
static void climb(kmp_loop_polygon *p, int body, int top, int *at)
{
    for (; body != top; body = p->model->bodies[body].parent) {
        const kmp_body *b = &p->model->bodies[body];
        p->slides = p->slides || b->flexible > 0;
        for (int k = 0; k < b->motion_count; k++)
            p->slides = p->slides || !p->model->motions[b->first_motion + k].rotation;
        add_side(p, body, b->to, *at);
        *at = b->at;
    }
}

kmp_loop_polygon kmp_loop_polygon_of(const kempe_model *model, const kmp_closure *c)
{
    kmp_loop_polygon p = {.model = model, .from = -1, .to = -1};
    int at = c->point[0], bt = c->point[1];
    int a = model->points[at].body, b = model->points[bt].body, top = kmp_model_common_body(model, a, b);
    climb(&p, a, top, &at);
    climb(&p, b, top, &bt);
    add_side(&p, top, at, bt);
    return p;
}

/* The longest distance of two joints or closure points on one body around a loop, m; 0 if no body has two. */
static double loop_longest_side(const kempe_model *model, int closure)
{
    const kmp_closure *c = &model->closures[closure];
    return c->point[0] >= 0 && c->point[1] >= 0 ? kmp_loop_polygon_of(model, c).longest : 0;
}

enum { SEED = 7, PLACES = 24, TRIES = 3, ON = 6, LEAST_FAR = 4 };

void kmp_rounding_keep(const kempe_system *system, const kmp_rounding_trial *trial)
{
    kmp_rounding *r = system->rounding;
    int none = KMP_ROUNDING_UNKNOWN;
    if (atomic_compare_exchange_strong(&r->state, &none, KMP_ROUNDING_WRITING)) {
        r->rank = trial->rank;
        r->zero = trial->zero;
        r->tolerance = trial->tolerance;
        r->misfit = trial->most;
        atomic_store(&r->state, KMP_ROUNDING_PRESENT);
    }
    while (atomic_load(&r->state) == KMP_ROUNDING_WRITING) /* another thread computes the same numbers */
        ;
}

/* -- a trial ----------------------------------------------------------------------------------------- */

int kmp_rounding_drives(const kempe_system *s, const bool *dropped, bool *driven)
{
    int kept = 0;
    for (int r = 0; r < s->m; r++) {
        const kmp_closure *closure = &s->model->closures[s->rows[r].closure];
        driven[r] = kmp_closure_is_drive(closure) || closure->function;
        kept += driven[r] && !dropped[r];
    }
    return kept;
}

double kmp_rounding_opening(const kmp_walk *w, const double *part)
{
    double widest = 0;
    for (int r = 0; r < w->m; r++)
        widest = fmax(widest, fabs(w->h[r]) / (part ? part[r] : 1));
    return widest;
}

/* True if the places cannot hold whatever `left` more of them are: too many of the distant ones are open, or the first.
 */
static bool is_hopeless(const kmp_waypoint *place, int count, int left, double tolerance)
{
    int far = 0, closed = 0;
    for (int k = 1; k < count; k++)
        if (place[k].distance >= KMP_ROUNDING_FAR) {
            far++;
            closed += place[k].open <= tolerance;
        }
    return place[0].open > tolerance || closed + left < KMP_ROUNDING_MOST_OF * (far + left);
}

int kmp_rounding_waypoints(kmp_walk *w, const double *part, int wanted, double tolerance, double *q,
                           kmp_waypoint *place)
{
    size_t n = (size_t)w->n;
    double usual = 0, *direction = q + n * (size_t)wanted;
    unsigned state = SEED;
    int count = 0;
    for (int tries = 0, on = 0; count < wanted && tries < TRIES * wanted; tries++) {
        double *to = q + (size_t)count * n;
        on = on < ON ? on : 0;
        if (count > 0 && !kmp_walk_wander(w, on > 0 ? to - n : q, &state, direction, to)) {
            on = 0;
            continue;
        }
        kmp_walk_evaluate(w, to);
        kmp_walk_pivots(w, w->pivots);
        double margin = w->rank > 0 ? w->pivots[w->rank - 1] : 1;
        usual = count == 0 ? margin : usual;
        on = margin < KMP_ROUNDING_BESIDE * usual ? 0 : on + 1;
        if (on == 0)
            continue;
        double weak = w->rank >= 0 && w->rank < w->m && w->rank < w->n ? w->pivots[w->rank] / w->pivots[0] : 0;
        place[count++] = (kmp_waypoint){kmp_rounding_opening(w, part), kmp_walk_distance(w, q, to), weak,
                                        margin / fmax(w->pivots[0], DBL_MIN)};
        if (w->n > w->rank && is_hopeless(place, count, wanted - count, tolerance))
            break;
    }
    return count;
}

/* True if a row of a moving closure or a drive is among the others. Without these rows, motions cannot show whether it
 * stays closed. */
static bool drops_drive(const kempe_system *s, const bool *dropped, const bool *driven)
{
    for (int r = 0; r < s->m; r++)
        if (dropped[r] && driven[r])
            return true;
    return false;
}

bool kmp_rounding_try(kmp_rounding_trial *t, const kempe_system *system, const double *from, const double *chart)
{
    kmp_waypoint place[PLACES];
    int n = system->n, m = system->m;
    kmp_arena arena = {0};
    kmp_walk *walk = kmp_walk_new_of_closures(system);
    bool *driven = KMP_ARENA_NEW(&arena, bool, m);
    double *part = KMP_ARENA_NEW(&arena, double, m), *q = KMP_ARENA_NEW(&arena, double, (PLACES + 1) * n);
    bool made = walk && !arena.failed;
    if (made) {
        walk->rank = t->rank - kmp_rounding_drives(system, t->dropped, driven);
        walk->excluded = driven;
    }
    if (made && !drops_drive(system, t->dropped, driven)) {
        if (chart)
            kmp_eval_set_charts(walk->eval, chart);
        /* The tolerance of each row, relative: positions in a loop smaller than the mechanism have less. */
        for (int r = 0; r < system->m; r++) {
            double size =
                system->rows[r].length_power > 0 ? loop_longest_side(system->model, system->rows[r].closure) : 0;
            part[r] = size > 0 ? fmin(1, size / system->length) : 1;
        }
        memcpy(q, from, (size_t)n * sizeof *q);
        /* Most of the places that are far from the state must stay closed: some are on other branches. */
        int count = kmp_rounding_waypoints(walk, part, PLACES, t->tolerance, q, place);
        double weak = place[0].weak;
        int far = 0, closed = 0;
        t->here = t->most = place[0].open;
        for (int k = 1; k < count; k++) {
            bool holds = place[k].open <= t->tolerance;
            far += place[k].distance >= KMP_ROUNDING_FAR;
            closed += place[k].distance >= KMP_ROUNDING_FAR && holds;
            t->most = holds ? fmax(t->most, place[k].open) : t->most;
            weak = holds ? fmax(weak, place[k].weak) : weak;
        }
        t->refuted =
            t->here <= t->tolerance && closed == 0 && PLACES - count < KMP_ROUNDING_MOST_OF * (far + PLACES - count);
        t->holds = t->here <= t->tolerance &&
                   ((far >= LEAST_FAR && closed >= KMP_ROUNDING_MOST_OF * far) || walk->n == walk->rank);
        t->zero = sqrt(fmax(fmax(weak, t->most), KMP_RANK) * place[0].strong);
    }
    kmp_walk_free(walk);
    kmp_arena_free(&arena);
    return made;
}
