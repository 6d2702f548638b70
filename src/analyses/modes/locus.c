/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues are followed from value to value by an assignment of least cost (analyses/modes/assign.h), with halved
 * steps in cases of doubt. Critical values are bracketed and refined (base/bracket.h). */
#include "analyses/modes/locus.h"
#include "analyses/modes/assign.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "output/print.h"
#include <math.h>
#include <string.h>

enum { MOST_HALVINGS = 6 };

/* A step is uncertain where the shape of a branch has a lower assurance criterion than ALIKE, or the distance exceeds
 * NEAR. */
#define ALIKE 0.8
#define NEAR  0.25

/* Relative accuracy of a critical value, and of its real part relative to the largest eigenvalue. */
#define EXACT 1e-13

typedef struct family {
    double value;
    kmp_modes modes;
    int *at;      /* of the locus: the index of each branch in the spectrum; of the modes' arena, like q */
    double *q;    /* n: the state */
    double *load; /* n: that holds a rate; NaN: none */
} family;

typedef struct maker {
    kempe_context *context;
    kmp_operating_family *visited; /* where all modes are computed */
    kmp_locus *l;
    kmp_arena arena; /* of the arrays below */
    double *cost;    /* room x room */
    int *column, room;
} maker;

static kempe_status arrive(maker *m, double value, family *s)
{
    *s = (family){.value = value};
    KMP_TRY(kmp_operating_family_go(m->visited, value, &s->modes));
    size_t n = (size_t)m->visited->base->n;
    s->at = KMP_ARENA_NEW(&s->modes.arena, int, s->modes.count);
    s->q = KMP_ARENA_NEW(&s->modes.arena, double, n);
    s->load = KMP_ARENA_NEW(&s->modes.arena, double, n);
    if (s->at && s->q && s->load) {
        memcpy(s->q, m->visited->state->q, n * sizeof *s->q);
        for (int i = 0; i < m->visited->base->n; i++)
            s->load[i] = NAN;
        for (int k = 0; k < m->visited->rate_count; k++)
            if (m->visited->rates[k].how == KMP_RATE_HELD)
                s->load[m->visited->rates[k].coordinate] = m->visited->rates[k].load;
        return KEMPE_OK;
    }
    kmp_modes_free(&s->modes);
    return kmp_fail_memory(m->context);
}

/* -- assignment -------------------------------------------------------------------------------------- */

/* Relative distance of two eigenvalues, 0 to 1; values small against the largest count less. */
static double distance(double a_re, double a_im, double b_re, double b_im, double size)
{
    double away = hypot(a_re - b_re, a_im - b_im), sum = hypot(a_re, a_im) + hypot(b_re, b_im) + 1e-6 * size;
    return sum > 0 ? away / sum : 0;
}

static bool make_costs(maker *m, int n)
{
    if (n > m->room) {
        m->room = n;
        (void)KMP_ARENA_MAKE(&m->arena, KMP_ROOM(double, (size_t)n *(size_t)n, &m->cost), KMP_ROOM(int, n, &m->column));
    }
    return !m->arena.failed;
}

/* Assigns branches of `from` to eigenvalues of `to`, of which none remain but with delays. Returns the largest doubt: 0
 * where all are certain; -1: no memory. */
static double follow(maker *m, const family *from, family *to)
{
    int n = to->modes.count, branches = m->l->count;
    const kmp_spectrum *a = &from->modes.spectrum, *b = &to->modes.spectrum;
    double size = fmax(kmp_modes_size(&from->modes), kmp_modes_size(&to->modes)), doubt = 0;
    if (!make_costs(m, n))
        return -1;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            if (i >= branches) {
                m->cost[i + (ptrdiff_t)j * n] = 0;
                continue;
            }
            int k = from->at[i];
            m->cost[i + (ptrdiff_t)j * n] = distance(a->re[k], a->im[k], b->re[j], b->im[j], size) + 1 -
                                            kmp_modes_likeness(&from->modes, k, &to->modes, j);
            if (n > branches && size > 0) /* relative distances from zero are all equal, and some eigenvalues remain */
                m->cost[i + (ptrdiff_t)j * n] += hypot(a->re[k] - b->re[j], a->im[k] - b->im[j]) / size;
        }
    if (kmp_assign(n, m->cost, m->column))
        return -1;
    for (int i = 0; i < branches; i++) {
        int k = from->at[i], j = m->column[i];
        double away = distance(a->re[k], a->im[k], b->re[j], b->im[j], size);
        double unlike = 1 - kmp_modes_likeness(&from->modes, k, &to->modes, j);
        to->at[i] = j;
        doubt = fmax(doubt, fmax(unlike / (1 - ALIKE), away / NEAR));
    }
    return doubt;
}

static kempe_status reach(maker *m, const family *from, double value, int halvings, family *to, double *doubt);

/* Advances from one station to the next, by intermediate values where needed. `doubt`: the largest that remains. */
static kempe_status advance(maker *m, const family *from, family *to, int halvings, double *doubt)
{
    family middle;
    double here = follow(m, from, to);
    KMP_TRY(kmp_made(m->context, here >= 0));
    kempe_status status = KEMPE_E_FAILED;
    if (here > 1 && halvings < MOST_HALVINGS && !kmp_interrupted(m->context))
        status = reach(m, from, (from->value + to->value) / 2, halvings + 1, &middle, doubt);
    if (status == KEMPE_OK) {
        status = advance(m, &middle, to, halvings + 1, doubt);
        kmp_modes_free(&middle.modes);
        return status;
    }
    *doubt = fmax(*doubt, here); /* intermediate values cannot be reached: the result is accepted */
    return status == KEMPE_E_MEMORY ? status : KEMPE_OK;
}

/* Computes the station at a value, with the branches of `from`. */
static kempe_status reach(maker *m, const family *from, double value, int halvings, family *to, double *doubt)
{
    m->visited->brief = halvings > 0;
    KMP_TRY(arrive(m, value, to));
    kempe_status status =
        (to->modes.endless ? to->modes.count >= m->l->count : to->modes.count == from->modes.count)
            ? advance(m, from, to, halvings, doubt)
        : to->modes.endless
            ? kmp_fail(m->context, KEMPE_E_FAILED, "only %d eigenvalues with delays were found at %g, and %d before",
                       to->modes.count, value, m->l->count)
            : kmp_fail(m->context, KEMPE_E_FAILED, "there are %d degrees of freedom at %g, and %d at %g",
                       from->modes.moving, from->value, to->modes.moving, value);
    if (status != KEMPE_OK)
        kmp_modes_free(&to->modes);
    return status;
}

/* -- critical values --------------------------------------------------------------------------------- */

/* The eigenvalue of a branch at a value. */
typedef struct place {
    double value, re, im;
    double size, noise; /* of the largest eigenvalue there, and of its rounding */
} place;

static place place_at(const family *s, int branch)
{
    const kmp_spectrum *x = &s->modes.spectrum;
    int k = s->at[branch];
    return (place){s->value, x->re[k], x->im[k], kmp_modes_size(&s->modes), kmp_modes_noise(&s->modes)};
}

static bool grows(const place *at)
{
    return at->re > at->noise;
}

/* One end of the bracket of a critical value. */
typedef struct end {
    place there;
    const family *at;
    family own; /* when it has been replaced */
} end;

typedef struct bracket {
    int branch;
    end low, high;
    bool crosses; /* the real part has both signs beyond rounding; otherwise it is zero on one side, without information
                   */
} bracket;

static end end_of(const family *at, int branch)
{
    return (end){.there = place_at(at, branch), .at = at};
}

static void replace(end *e, const family *by, int branch)
{
    kmp_modes_free(&e->own.modes);
    *e = (end){place_at(by, branch), &e->own, *by};
}

static double exactly(const bracket *b)
{
    return EXACT * fmax(fabs(b->low.there.value), fabs(b->high.there.value));
}

static bool is_found(const bracket *b)
{
    const place *low = &b->low.there, *high = &b->high.there;
    return fabs(high->value - low->value) <= exactly(b) ||
           (b->crosses && fmin(fabs(low->re), fabs(high->re)) <= EXACT * low->size);
}

static kempe_status refine(maker *m, bracket *b)
{
    const place *low = &b->low.there, *high = &b->high.there;
    kmp_bracket search = kmp_bracket_of(low->value, b->crosses ? low->re : 0, high->value, b->crosses ? high->re : 0);
    double at, doubt = 0;
    while (!is_found(b) && !kmp_interrupted(m->context) && kmp_bracket_next(&search, exactly(b), &at)) {
        family middle;
        const end *nearest = fabs(at - low->value) <= fabs(at - high->value) ? &b->low : &b->high;
        KMP_TRY(reach(m, nearest->at, at, MOST_HALVINGS, &middle, &doubt));
        place there = place_at(&middle, b->branch);
        bool is_low = b->crosses ? (there.re > 0) == (low->re > 0) : grows(&there) == grows(low);
        kmp_bracket_take(&search, at, b->crosses ? there.re : 0, !is_low);
        replace(is_low ? &b->low : &b->high, &middle, b->branch);
    }
    return KEMPE_OK;
}

/* Values on either side of an interval, NaN where there is none. */
typedef struct around {
    double before, behind;
} around;

/* Checks an end that lies within rounding of the axis: the branch may pass the axis there, or rest on it (as before a
 * buckling load). If it decays at the value beyond, it passes: this value becomes the end. */
static kempe_status look_beyond(maker *m, bracket *b, const around *values)
{
    end *still = grows(&b->low.there) ? &b->high : &b->low;
    double beyond = still == &b->low ? values->before : values->behind, doubt = 0;
    family farther;
    if (isnan(beyond))
        return KEMPE_OK;
    kempe_status status = reach(m, still->at, beyond, 0, &farther, &doubt);
    if (status == KEMPE_E_MEMORY)
        return status;
    if (status != KEMPE_OK) {
        kmp_context_clear(m->context);
        return KEMPE_OK;
    }
    place there = place_at(&farther, b->branch);
    b->crosses = -there.re > there.noise;
    if (b->crosses)
        replace(still, &farther, b->branch);
    else
        kmp_modes_free(&farther.modes);
    return KEMPE_OK;
}

static kempe_status keep(maker *m, kmp_critical found)
{
    kmp_locus *l = m->l;
    kmp_critical *grown = kmp_realloc(l->critical, (size_t)l->critical_count + 1, sizeof *grown);
    KMP_TRY(kmp_made(m->context, grown));
    l->critical = grown;
    l->critical[l->critical_count++] = found;
    return KEMPE_OK;
}

static kempe_status find_critical(maker *m, const family *from, const family *to, const around *values, int branch)
{
    bracket b = {.branch = branch, .low = end_of(from, branch), .high = end_of(to, branch)};
    const place *low = &b.low.there, *high = &b.high.there;
    bool up = grows(high) == (to->value > from->value);
    b.crosses = low->re * high->re < 0 && fabs(low->re) > low->noise && fabs(high->re) > high->noise;
    kempe_status status = b.crosses ? KEMPE_OK : look_beyond(m, &b, values);
    if (status == KEMPE_OK)
        status = refine(m, &b);
    const place *best = fabs(low->re) < fabs(high->re) ? low : high;
    if (status == KEMPE_OK)
        status = keep(m, (kmp_critical){best->value, best->re, fabs(best->im), branch, up});
    kmp_modes_free(&b.low.own.modes);
    kmp_modes_free(&b.high.own.modes);
    return status;
}

/* Searches critical values between two stations. Of a pair the eigenvalue above the axis counts; of two that are real
 * at one end and a pair at the other, the growing one. */
static kempe_status look_between(maker *m, const family *from, const family *to, const around *values)
{
    for (int b = 0; b < m->l->count; b++) {
        place before = place_at(from, b), after = place_at(to, b);
        if (grows(&before) == grows(&after) || (grows(&before) ? before.im : after.im) < 0)
            continue;
        KMP_TRY(find_critical(m, from, to, values, b));
    }
    return KEMPE_OK;
}

/* -- all values -------------------------------------------------------------------------------------- */

static void note(maker *m, const family *s, double doubt)
{
    kmp_locus *l = m->l;
    int n = m->visited->base->n, k = l->reached++;
    memcpy(l->q + (ptrdiff_t)k * n, s->q, (size_t)n * sizeof *s->q);
    memcpy(l->load + (ptrdiff_t)k * n, s->load, (size_t)n * sizeof *s->load);
    for (int b = 0; b < l->count; b++) {
        l->re[b + (ptrdiff_t)k * l->count] = s->modes.spectrum.re[s->at[b]];
        l->im[b + (ptrdiff_t)k * l->count] = s->modes.spectrum.im[s->at[b]];
    }
    l->doubt[k] = doubt;
}

/* With delays one of the eigenvalues without end, which are not followed, may begin to grow. */
static kempe_status check_others(maker *m, const family *s)
{
    const kmp_modes *x = &s->modes;
    if (!x->endless)
        return KEMPE_OK;
    if (isnan(x->bound))
        return kmp_fail(m->context, KEMPE_E_FAILED, "it is not known whether all growing eigenvalues were found at %g",
                        s->value);
    for (int c = 0; c < x->shown; c++) {
        bool followed = false;
        for (int b = 0; b < m->l->count; b++)
            followed = followed || s->at[b] == c;
        if (x->spectrum.re[c] > kmp_modes_noise(x) && !followed)
            return kmp_fail(m->context, KEMPE_E_FAILED,
                            "at %g an eigenvalue of %.6g rad/s grows that is not among the %d followed ones: begin "
                            "another sweep there",
                            s->value, fabs(x->spectrum.im[c]), m->l->count);
    }
    return KEMPE_OK;
}

static kempe_status begin(maker *m, const double *values, family *first)
{
    kmp_locus *l = m->l;
    KMP_TRY(kmp_made(m->context, KMP_ARENA_MAKE(&l->arena, KMP_ROOM(double, l->values, &l->value, &l->doubt),
                                                KMP_ROOM(double, l->values * m->visited->base->n, &l->q, &l->load))));
    memcpy(l->value, values, (size_t)l->values * sizeof *values);
    KMP_TRY(arrive(m, l->value[0], first));
    l->count = first->modes.shown;
    if (!KMP_ARENA_EACH(&l->arena, double, (ptrdiff_t)l->count * l->values, &l->re, &l->im) ||
        !make_costs(m, l->count)) {
        kmp_modes_free(&first->modes);
        return kmp_fail_memory(m->context);
    }
    for (int b = 0; b < m->l->count; b++)
        first->at[b] = b;
    note(m, first, 0);
    return KEMPE_OK;
}

/* Stations are kept until their critical values are found. */
static kempe_status go(maker *m, family *here)
{
    kmp_locus *l = m->l;
    for (int k = 1; k < l->values; k++) {
        family next;
        double doubt = 0;
        if (kmp_interrupted(m->context))
            return KEMPE_STOPPED;
        KMP_TRY(reach(m, here, l->value[k], 0, &next, &doubt));
        kempe_status status = check_others(m, &next);
        if (status != KEMPE_OK) {
            kmp_modes_free(&next.modes);
            return status;
        }
        note(m, &next, doubt);
        kmp_progress(m->context, KMP_PROGRESS_STUDY, k + 1, l->values, "values");
        const around values = {k > 1 ? l->value[k - 2] : NAN, k + 1 < l->values ? l->value[k + 1] : NAN};
        status = look_between(m, here, &next, &values);
        kmp_modes_free(&here->modes);
        *here = next;
        if (status != KEMPE_OK)
            return status;
    }
    return KEMPE_OK;
}

kempe_status kmp_locus_make(kmp_operating_family *visited, int count, const double *values, kmp_locus *locus)
{
    kempe_context *context = visited->base->context;
    kmp_locus l = {.values = count};
    maker m = {.context = context, .visited = visited, .l = &l};
    family here = {0};
    kempe_status status = begin(&m, values, &here);
    if (status == KEMPE_OK) {
        status = go(&m, &here);
        if (status == KEMPE_E_FAILED)
            status = KEMPE_STOPPED;
        kmp_modes_free(&here.modes);
    }
    kmp_arena_free(&m.arena);
    if (status == KEMPE_OK || status == KEMPE_STOPPED)
        *locus = l;
    else
        kmp_locus_free(&l);
    return status;
}

bool kmp_locus_has_load(const kmp_locus *locus, int n, int i)
{
    for (int k = 0; k < locus->reached; k++)
        if (!isnan(locus->load[i + (ptrdiff_t)k * n]))
            return true;
    return false;
}

KMP_CLEARS(kmp_locus, locus, kmp_arena_free(&locus->arena), kmp_free(locus->critical))
