/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/locus.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "linalg/assign.h"
#include <math.h>
#include <string.h>

enum { MOST_HALVINGS = 6 };

/* A step is in doubt where a branch goes on with a shape less alike than this, or farther off than that. */
#define ALIKE 0.8
#define NEAR  0.25

/* How well a critical value is known, in parts of it, and its real part in parts of the largest eigenvalue. */
#define EXACT 1e-13

typedef struct station {
    double value;
    kmp_modes modes;
    int *at; /* count: where each branch stands in the spectrum */
} station;

typedef struct maker {
    kempe_context *context;
    kmp_locus_fn *at;
    void *user;
    kmp_locus *l;
    double *cost;
    int *column;
    int critical_room;
} maker;

static void leave(station *s)
{
    kmp_modes_free(&s->modes);
    kmp_free(s->at);
    *s = (station){0};
}

static kempe_status arrive(maker *m, double value, station *s)
{
    *s = (station){.value = value};
    kempe_status status = m->at(m->user, value, &s->modes);
    if (status != KEMPE_OK)
        return status;
    s->at = KMP_NEW(int, s->modes.count);
    if (s->at)
        return KEMPE_OK;
    leave(s);
    (void)kmp_fail_memory(m->context);
    return KEMPE_E_MEMORY;
}

/* -- which goes with which --------------------------------------------------------------------------- */

/* Distance of two eigenvalues in parts of their sizes, 0 to 1; what is small beside the largest counts less. */
static double distance(double a_re, double a_im, double b_re, double b_im, double size)
{
    double away = hypot(a_re - b_re, a_im - b_im), sum = hypot(a_re, a_im) + hypot(b_re, b_im) + 1e-6 * size;
    return sum > 0 ? away / sum : 0;
}

/* Branches of `from` go on in `to`. The largest doubt: 0 where all is clear. */
static double follow(maker *m, const station *from, station *to)
{
    int n = from->modes.count;
    const kmp_spectrum *a = &from->modes.spectrum, *b = &to->modes.spectrum;
    double size = fmax(kmp_modes_size(&from->modes), kmp_modes_size(&to->modes)), doubt = 0;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            int k = from->at[i];
            m->cost[i + (ptrdiff_t)j * n] = distance(a->re[k], a->im[k], b->re[j], b->im[j], size) + 1 -
                                            kmp_modes_likeness(&from->modes, k, &to->modes, j);
        }
    if (kmp_assign(n, m->cost, m->column))
        return -1;
    for (int i = 0; i < n; i++) {
        int k = from->at[i], j = m->column[i];
        double away = distance(a->re[k], a->im[k], b->re[j], b->im[j], size);
        double unlike = 1 - kmp_modes_likeness(&from->modes, k, &to->modes, j);
        to->at[i] = j;
        doubt = fmax(doubt, fmax(unlike / (1 - ALIKE), away / NEAR));
    }
    return doubt;
}

static kempe_status reach(maker *m, const station *from, double value, int halvings, station *to, double *doubt);

/* From one to the next, by values between where it must be. `doubt`: the largest that remains. */
static kempe_status advance(maker *m, const station *from, station *to, int halvings, double *doubt)
{
    station middle;
    double here = follow(m, from, to);
    if (here < 0)
        return kmp_fail_memory(m->context);
    kempe_status status = KEMPE_E_FAILED;
    if (here > 1 && halvings < MOST_HALVINGS && !kmp_interrupted(m->context))
        status = reach(m, from, (from->value + to->value) / 2, halvings + 1, &middle, doubt);
    if (status == KEMPE_OK) {
        status = advance(m, &middle, to, halvings + 1, doubt);
        leave(&middle);
        return status;
    }
    *doubt = fmax(*doubt, here); /* what is between cannot be reached: as good as it is */
    return status == KEMPE_E_MEMORY ? status : KEMPE_OK;
}

/* The station at a value, its branches those of `from`. */
static kempe_status reach(maker *m, const station *from, double value, int halvings, station *to, double *doubt)
{
    kempe_status status = arrive(m, value, to);
    if (status != KEMPE_OK)
        return status;
    if (to->modes.count == from->modes.count)
        status = advance(m, from, to, halvings, doubt);
    else
        status = kmp_fail(m->context, KEMPE_E_FAILED, "there are %d degrees of freedom at %g, and %d at %g",
                          from->modes.p, from->value, to->modes.p, value);
    if (status != KEMPE_OK)
        leave(to);
    return status;
}

/* -- critical values --------------------------------------------------------------------------------- */

static double growth(const station *s, int branch)
{
    return s->modes.spectrum.re[s->at[branch]];
}

static bool grows(const station *s, int branch)
{
    return growth(s, branch) > kmp_modes_noise(&s->modes);
}

/* The bracket of a critical value: f and g are the real parts at its ends. */
typedef struct bracket {
    station low, high;
    double f, g;
    int branch;
    bool crosses; /* the real part has both signs beyond rounding; otherwise it is zero on one side, and says nothing */
} bracket;

static void replace(bracket *b, kmp_bracket *search, station *middle)
{
    double value = growth(middle, b->branch);
    bool low = b->crosses ? (value > 0) == (b->f > 0) : grows(middle, b->branch) == grows(&b->low, b->branch);
    kmp_bracket_take(search, middle->value, b->crosses ? value : 0, !low);
    leave(low ? &b->low : &b->high);
    *(low ? &b->low : &b->high) = *middle;
}

static double exactly(const bracket *b)
{
    return EXACT * fmax(fabs(b->low.value), fabs(b->high.value));
}

static bool is_found(const bracket *b)
{
    double least = fmin(fabs(growth(&b->low, b->branch)), fabs(growth(&b->high, b->branch)));
    return fabs(b->high.value - b->low.value) <= exactly(b) ||
           (b->crosses && least <= EXACT * kmp_modes_size(&b->low.modes));
}

static kempe_status refine(maker *m, bracket *b)
{
    kmp_bracket search = b->crosses ? kmp_bracket_of(b->low.value, b->f, b->high.value, b->g)
                                    : kmp_bracket_of(b->low.value, 0, b->high.value, 0);
    double at, doubt = 0;
    while (!is_found(b) && !kmp_interrupted(m->context) && kmp_bracket_next(&search, exactly(b), &at)) {
        station middle;
        bool from_low = fabs(at - b->low.value) <= fabs(at - b->high.value);
        kempe_status status = reach(m, from_low ? &b->low : &b->high, at, MOST_HALVINGS, &middle, &doubt);
        if (status != KEMPE_OK)
            return status;
        replace(b, &search, &middle);
    }
    return KEMPE_OK;
}

static bool keep(maker *m, kmp_critical found)
{
    kmp_locus *l = m->l;
    if (l->critical_count == m->critical_room) {
        int room = 2 * m->critical_room + 8;
        kmp_critical *grown = kmp_realloc(l->critical, (size_t)room, sizeof *grown);
        if (!grown)
            return false;
        l->critical = grown;
        m->critical_room = room;
    }
    l->critical[l->critical_count++] = found;
    return true;
}

/* The same modes as a station of its own. */
static kempe_status visit(maker *m, const station *as, station *copy)
{
    kempe_status status = arrive(m, as->value, copy);
    if (status == KEMPE_OK)
        memcpy(copy->at, as->at, (size_t)as->modes.count * sizeof *copy->at);
    return status;
}

/* An end that lies within rounding of the axis may be one where the branch passes, or rest there (as before a
 * buckling load). Where it decays at the value beyond, it passes: that is the end then. */
static kempe_status step_back(maker *m, bracket *b, station *end, double *at_end, double beyond)
{
    double doubt = 0;
    station farther;
    kempe_status status = reach(m, end, beyond, 0, &farther, &doubt);
    if (status != KEMPE_OK) {
        if (status != KEMPE_E_MEMORY)
            kmp_context_clear(m->context);
        return status == KEMPE_E_MEMORY ? status : KEMPE_OK;
    }
    if (-growth(&farther, b->branch) <= kmp_modes_noise(&farther.modes)) {
        leave(&farther);
        return KEMPE_OK;
    }
    leave(end);
    *end = farther;
    *at_end = growth(end, b->branch);
    b->crosses = true;
    return KEMPE_OK;
}

/* Values on either side of an interval, NaN where there is none. */
typedef struct around {
    double before, behind;
} around;

static kempe_status look_beyond(maker *m, bracket *b, const around *values)
{
    bool low = !grows(&b->low, b->branch);
    double beyond = low ? values->before : values->behind;
    return isnan(beyond) ? KEMPE_OK : step_back(m, b, low ? &b->low : &b->high, low ? &b->f : &b->g, beyond);
}

static kempe_status find_critical(maker *m, const station *from, const station *to, const around *values, int branch)
{
    bracket b = {.f = growth(from, branch), .g = growth(to, branch), .branch = branch};
    b.crosses = b.f * b.g < 0 && fabs(b.f) > kmp_modes_noise(&from->modes) && fabs(b.g) > kmp_modes_noise(&to->modes);
    kempe_status status = visit(m, from, &b.low);
    if (status != KEMPE_OK)
        return status;
    status = visit(m, to, &b.high);
    if (status == KEMPE_OK) {
        if (!b.crosses)
            status = look_beyond(m, &b, values);
        if (status == KEMPE_OK)
            status = refine(m, &b);
        const station *best = fabs(growth(&b.low, branch)) < fabs(growth(&b.high, branch)) ? &b.low : &b.high;
        const kmp_spectrum *s = &best->modes.spectrum;
        kmp_critical found = {.value = best->value,
                              .re = s->re[best->at[branch]],
                              .im = fabs(s->im[best->at[branch]]),
                              .branch = branch,
                              .grows_above = grows(to, branch) == (to->value > from->value)};
        if (status == KEMPE_OK && !keep(m, found))
            status = kmp_fail_memory(m->context);
        leave(&b.high);
    }
    leave(&b.low);
    return status;
}

/* Of a pair the one above the axis is asked; of two that are real at one end and a pair at the other, the one that
 * grows. */
static kempe_status look_between(maker *m, const station *from, const station *to, const around *values)
{
    for (int b = 0; b < from->modes.count; b++) {
        bool before = grows(from, b), after = grows(to, b);
        const station *growing = before ? from : to;
        if (before == after || growing->modes.spectrum.im[growing->at[b]] < 0)
            continue;
        kempe_status status = find_critical(m, from, to, values, b);
        if (status != KEMPE_OK)
            return status;
    }
    return KEMPE_OK;
}

/* -- all values -------------------------------------------------------------------------------------- */

static bool make_room(maker *m, int count)
{
    kmp_locus *l = m->l;
    size_t all = (size_t)count * (size_t)l->values, square = (size_t)count * (size_t)count;
    l->count = count;
    l->re = KMP_NEW(double, all);
    l->im = KMP_NEW(double, all);
    m->cost = KMP_NEW(double, square);
    m->column = KMP_NEW(int, count);
    return l->re && l->im && m->cost && m->column;
}

static void note(kmp_locus *l, const station *s, double doubt)
{
    int k = l->reached++;
    for (int b = 0; b < l->count; b++) {
        l->re[b + (ptrdiff_t)k * l->count] = s->modes.spectrum.re[s->at[b]];
        l->im[b + (ptrdiff_t)k * l->count] = s->modes.spectrum.im[s->at[b]];
    }
    l->doubt[k] = doubt;
}

static kempe_status begin(maker *m, station *first)
{
    kempe_status status = arrive(m, m->l->value[0], first);
    if (status != KEMPE_OK)
        return status;
    if (!make_room(m, first->modes.count)) {
        leave(first);
        return kmp_fail_memory(m->context);
    }
    for (int b = 0; b < first->modes.count; b++)
        first->at[b] = b;
    note(m->l, first, 0);
    return KEMPE_OK;
}

/* The stations stay until their critical values are found. */
static kempe_status go(maker *m, station *here)
{
    kmp_locus *l = m->l;
    for (int k = 1; k < l->values; k++) {
        station next;
        double doubt = 0;
        if (kmp_interrupted(m->context))
            return KEMPE_STOPPED;
        kempe_status status = reach(m, here, l->value[k], 0, &next, &doubt);
        if (status != KEMPE_OK)
            return status;
        note(l, &next, doubt);
        const around values = {k > 1 ? l->value[k - 2] : NAN, k + 1 < l->values ? l->value[k + 1] : NAN};
        status = look_between(m, here, &next, &values);
        leave(here);
        *here = next;
        if (status != KEMPE_OK)
            return status;
    }
    return KEMPE_OK;
}

kempe_status kmp_locus_make(kempe_context *context, int count, const double *values, kmp_locus_fn *at, void *user,
                            kmp_locus *locus)
{
    kmp_locus l = {.values = count};
    maker m = {.context = context, .at = at, .user = user, .l = &l};
    station here = {0};
    l.value = KMP_NEW(double, count);
    l.doubt = KMP_NEW(double, count);
    kempe_status status = l.value && l.doubt ? KEMPE_OK : kmp_fail_memory(context);
    if (status == KEMPE_OK) {
        memcpy(l.value, values, (size_t)count * sizeof *values);
        status = begin(&m, &here);
    }
    if (status == KEMPE_OK) {
        status = go(&m, &here);
        if (status == KEMPE_E_FAILED)
            status = KEMPE_STOPPED;
        leave(&here);
    }
    kmp_free(m.cost);
    kmp_free(m.column);
    if (status == KEMPE_OK || status == KEMPE_STOPPED)
        *locus = l;
    else
        kmp_locus_free(&l);
    return status;
}

void kmp_locus_free(kmp_locus *locus)
{
    kmp_free(locus->value);
    kmp_free(locus->re);
    kmp_free(locus->im);
    kmp_free(locus->doubt);
    kmp_free(locus->critical);
    *locus = (kmp_locus){0};
}
