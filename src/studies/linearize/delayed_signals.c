/* SPDX-License-Identifier: BSD-3-Clause */
/* A state space with delays: the state y of each, whose averaged equation is y' = (u - y)/T, becomes an additional
 * input delay(NAME), and its signal u an additional output of that name, which is this input by T later. */
#include "base/memory.h"
#include "derivatives/delayed_motion.h"
#include "derivatives/sampled_motion.h"
#include "dynamics/load_dependent.h"
#include "studies/linearize/linearize_study.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* The delay of entry i of x; 0: it is none. */
static double delay_of(const kempe_linearization *l, int i)
{
    const kmp_transfer *t = &l->channels.transfer;
    const int k = kmp_transfer_state(t, i) - t->p;
    return k < 0 ? 0 : kmp_delay_of(t->linear, k);
}

kempe_status kmp_linearization_check_delays(const kempe_linearization *l)
{
    const kempe_model *model = l->channels.system->model;
    if (model->delay_count == 0 || l->channels.rests)
        return KEMPE_OK;
    return kmp_fail(l->channels.system->context, KEMPE_E_ARGUMENT,
                    "the start is no equilibrium, and linear equations with delays need a past at rest: take the state "
                    "'equilibrium'");
}

/* -- channels ---------------------------------------------------------------------------------------- */

static bool name_delays(kempe_linearization *l, const int *delay)
{
    kmp_arena *arena = &l->channels.arena;
    const kmp_transfer *t = &l->channels.transfer;
    const kempe_model *model = l->channels.system->model;
    kmp_names *d = &l->delays;
    d->name = KMP_ARENA_NEW(arena, char *, d->count);
    d->unit = KMP_ARENA_NEW(arena, char *, d->count);
    for (int k = 0; !arena->failed && k < d->count; k++) {
        const int motion = t->linear->part.u[kmp_transfer_state(t, delay[k]) - t->p];
        d->name[k] = kmp_arena_printf(arena, "delay(%s)", model->motions[motion].name);
        d->unit[k] = kmp_arena_strdup(arena, "");
        l->delay[k] = delay_of(l, delay[k]);
    }
    return !arena->failed;
}

/* The entries `kept` (NULL: all) of names, and the delays behind them. */
static bool extend(kempe_linearization *l, kmp_names *names, int count, const int *kept, bool delays)
{
    kmp_arena *arena = &l->channels.arena;
    const kmp_names from = *names;
    const int more = delays ? l->delays.count : 0;
    *names = (kmp_names){count + more, KMP_ARENA_NEW(arena, char *, count + more),
                         KMP_ARENA_NEW(arena, char *, count + more)};
    for (int k = 0; !arena->failed && k < count + more; k++) {
        const kmp_names *of = k < count ? &from : &l->delays;
        const int at = k >= count ? k - count : kept ? kept[k] : k;
        names->name[k] = of->name[at];
        names->unit[k] = of->unit[at];
    }
    return !arena->failed;
}

/* -- matrices ---------------------------------------------------------------------------------------- */

/* A signal before its delay T is y + T y', where y' is the rate of the averaged equations. So a quantity on which y'
 * depends by `rate` has the factor T rate in the signal, and y itself (`own`: 1) has one more. If both cancel, their
 * sum is rounding, and zero is returned. */
static double signal_of(double T, double rate, bool own)
{
    const double sum = T * rate + own;
    return fabs(sum) <= 4 * DBL_EPSILON * own ? 0 : sum;
}

kempe_status kmp_linearization_open_delays(kempe_linearization *l)
{
    kempe_context *context = l->channels.system->context;
    const kmp_transfer *t = &l->channels.transfer;
    const int width = kmp_transfer_width(t);
    kmp_arena *arena = &l->channels.arena;
    int *kept, *delay, stay = 0; /* entries of x that stay, or are delays */
    double *a, *b, *c, *d, *y;
    l->y = t->value;
    l->width = width;
    if (l->channels.system->model->delay_count == 0)
        return KEMPE_OK;
    KMP_TRY(kmp_made(context,
                     KMP_ARENA_MAKE(arena, KMP_ROOM(int, width, &kept, &delay), KMP_ROOM(double, width, &l->delay))));
    for (int i = 0; i < width; i++)
        if (delay_of(l, i) > 0)
            delay[l->delays.count++] = i;
        else
            kept[stay++] = i;
    l->width = stay;
    const int outputs = t->outputs, delays = l->delays.count;
    const ptrdiff_t inputs = t->columns + delays, all = outputs + delays, n = stay;
    KMP_TRY(kmp_made(context, KMP_ARENA_MAKE(arena, KMP_ROOM(double, n *n, &a), KMP_ROOM(double, n *inputs, &b),
                                             KMP_ROOM(double, n *all, &c), KMP_ROOM(double, inputs *all, &d),
                                             KMP_ROOM(double, all, &y)) &&
                                  name_delays(l, delay) && extend(l, &l->channels.states, stay, kept, false) &&
                                  extend(l, &l->channels.loads, t->columns, NULL, true) &&
                                  extend(l, &l->channels.outputs, outputs, NULL, true)));
    /* The values of the outputs, and of the signals: at rest those of the delays. */
    memcpy(y, t->value, (size_t)outputs * sizeof *y);
    for (int k = 0; k < delays; k++)
        y[outputs + k] = t->linear->qd[t->linear->part.u[kmp_transfer_state(t, delay[k]) - t->p]];
    /* All four with the rows of signals behind those of x, or of the outputs, and the columns of delays behind those of
     * inputs. */
    for (int j = 0; j < stay + inputs; j++) {
        const bool input = j >= stay && j < stay + t->columns;
        const int x = j < stay ? kept[j] : input ? -1 : delay[j - stay - t->columns], w = j - stay;
        const double *rates = input ? l->b + (ptrdiff_t)w * width : l->a + (ptrdiff_t)x * width;
        const double *seen = input ? l->d + (ptrdiff_t)w * outputs : l->c + (ptrdiff_t)x * outputs;
        double *to_rates = j < stay ? a + j * n : b + w * n, *to_seen = j < stay ? c + j * all : d + w * all;
        for (int i = 0; i < stay; i++)
            to_rates[i] = rates[kept[i]];
        memcpy(to_seen, seen, (size_t)outputs * sizeof *seen);
        for (int i = 0; i < delays; i++)
            to_seen[outputs + i] = signal_of(l->delay[i], rates[delay[i]], delay[i] == x);
    }
    l->y = y;
    l->a = a, l->b = b, l->c = c, l->d = d;
    return KEMPE_OK;
}
