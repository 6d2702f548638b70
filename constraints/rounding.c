/* SPDX-License-Identifier: BSD-3-Clause */
/* Told apart by finite motions. Where a direction of the rows is dropped that only rounding makes, the mechanism gains
 * a motion along which the dropped rows stay open by the rounding, however far it goes. Where a small pivot is real, as
 * next to a change point, the motion gained is one that the mechanism does not have: the dropped rows open with the
 * square of the way and exceed the tolerance soon. A small loop in a large mechanism cannot open far: its own size
 * measures it. */
#include "constraints/rounding.h"
#include "base/memory.h"
#include "constraints/doctor.h"
#include "constraints/pick.h"
#include "constraints/tolerances.h"
#include <math.h>
#include <string.h>

enum { POINTS = 8, SEED = 7 };
/* A way is finite from here on, rad or characteristic lengths: its square is far above any tolerance. */
#define FAR 0.25

const kmp_rounding *kmp_rounding_of(const kempe_system *system)
{
    return atomic_load(&system->rounding->state) == 2 ? system->rounding : NULL;
}

double kmp_rounding_zero(const kempe_system *system, double strict)
{
    const kmp_rounding *rounding = kmp_rounding_of(system);
    return rounding ? fmax(strict, rounding->zero) : strict;
}

int kmp_rounding_rank(const kempe_system *system, const double *pivots)
{
    const kmp_rounding *rounding = kmp_rounding_of(system);
    int most = system->m < system->n ? system->m : system->n;
    most = rounding && rounding->rank < most ? rounding->rank : most;
    return kmp_pick_rank(pivots, most, kmp_rounding_zero(system, KMP_RANK));
}

void kmp_rounding_keep(const kempe_system *system, const kmp_rounding_trial *trial)
{
    kmp_rounding *r = system->rounding;
    int none = 0;
    if (atomic_compare_exchange_strong(&r->state, &none, 1)) {
        r->rank = trial->rank;
        r->zero = trial->zero;
        r->tolerance = trial->tolerance;
        atomic_store(&r->state, 2);
    }
    while (atomic_load(&r->state) != 2) /* another thread is at it, with the same numbers */
        ;
}

/* -- a trial ----------------------------------------------------------------------------------------- */

typedef struct trial {
    kmp_rounding_trial *t;
    kmp_walk *walk;
    int rank;     /* without the rows of drives */
    bool *driven; /* m: these */
    double *part; /* m: of the tolerance that a row has: positions in a loop smaller than the mechanism have less */
    double *pivots;
    double weak;   /* the largest pivot that is dropped, over the first */
    double strong; /* the smallest that is kept, at the state */
} trial;

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

static void set_parts(trial *x)
{
    const kempe_system *s = x->walk->system;
    for (int r = 0; r < s->m; r++) {
        double size = s->rows[r].length_power > 0 ? kmp_loop_longest_side(s->model, s->rows[r].closure) : 0;
        x->part[r] = size > 0 ? fmin(1, size / s->length) : 1;
    }
}

/* At the walk's last state. */
static void look(trial *x)
{
    kmp_walk *w = x->walk;
    int count = w->m < w->n ? w->m : w->n;
    for (int r = 0; r < w->m; r++)
        x->t->most = fmax(x->t->most, fabs(w->h[r]) / x->part[r]);
    kmp_walk_pivots(w, x->pivots);
    if (x->rank < count)
        x->weak = fmax(x->weak, x->pivots[x->rank] / x->pivots[0]);
}

/* false: it cannot move as far, or has opened. */
static bool wander(trial *x, const double *q, double *way, double *from, double *to)
{
    size_t size = (size_t)x->walk->n * sizeof *q;
    unsigned state = SEED;
    double farthest = 0;
    memcpy(from, q, size);
    for (int k = 0; k < POINTS && kmp_walk_wander(x->walk, from, &state, way, to); k++) {
        look(x);
        if (!(x->t->most <= x->t->tolerance))
            return false;
        memcpy(from, to, size);
        farthest = fmax(farthest, kmp_walk_distance(x->walk, q, to));
    }
    return farthest >= FAR || x->walk->n == x->rank;
}

static void judge(trial *x, const double *q, double *way)
{
    kmp_rounding_trial *t = x->t;
    int n = x->walk->n;
    set_parts(x);
    kmp_walk_evaluate(x->walk, q);
    t->most = 0;
    look(x);
    x->strong = x->rank > 0 ? x->pivots[x->rank - 1] / x->pivots[0] : 1;
    t->here = t->most;
    t->holds = t->here <= t->tolerance && wander(x, q, way, way + n, way + 2 * n);
    t->zero = sqrt(fmax(fmax(x->weak, t->most), KMP_RANK) * x->strong);
}

bool kmp_rounding_try(kmp_rounding_trial *t, const kempe_system *system, const double *q, const double *chart)
{
    int n = system->n, m = system->m;
    trial x = {.t = t,
               .walk = kmp_walk_new(system),
               .part = KMP_NEW(double, m),
               .pivots = KMP_NEW(double, m + n),
               .driven = KMP_NEW(bool, m)};
    double *way = KMP_NEW(double, 3 * n);
    bool made = x.walk && x.part && x.pivots && x.driven && way;
    if (made) {
        x.walk->rank = x.rank = t->rank - kmp_rounding_drives(system, t->dropped, x.driven);
        x.walk->excluded = x.driven;
        if (chart)
            kmp_plant_set_charts(x.walk->plant, chart);
        judge(&x, q, way);
    }
    kmp_walk_free(x.walk);
    kmp_free(x.part);
    kmp_free(x.pivots);
    kmp_free(x.driven);
    kmp_free(way);
    return made;
}
