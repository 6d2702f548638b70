/* SPDX-License-Identifier: BSD-3-Clause */
/* Eigenvalues are followed from value to value by an assignment of least cost, with halved
 * steps in cases of doubt. Critical values are bracketed and refined (base/bracket.h). */
#include "analyses/modes/locus.h"
#include "analyses/derivatives/switching_state.h"
#include "base/arena.h"
#include "base/bracket.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/close.h"
#include "constraints/inexact/nearest_exact.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* -- states along a varied parameter ------------------------------------------------------------------------ */

/* Each equilibrium begins at the last one, with the rates that the start has at the
 * new value. */

static kempe_status prepare(kmp_operating_family *s)
{
    const kmp_operating_family_options *options = &s->options;
    KMP_TRY(kmp_made(s->base->context, KMP_ARENA_MAKE(&s->arena, KMP_ROOM(kmp_steady, s->base->n, &s->rates),
                                                      KMP_ROOM(double, s->base->n, &s->begun))));
    s->rate_count = options->rate_count;
    if (options->rate_count > 0)
        memcpy(s->rates, options->rates, (size_t)options->rate_count * sizeof *s->rates);
    if (options->name) {
        KMP_TRY(kmp_variant_new(s->base->model, 1, &options->name, &s->variant));
        KMP_TRY(kmp_system_of_variant(s->variant, &s->own));
    }
    return kmp_linear_init(&s->linear, s->own ? s->own : s->base, kmp_backend_default());
}

kempe_status kmp_operating_family_new(const kempe_system *system, const kmp_operating_family_options *options,
                                      kmp_operating_family **family)
{
    KMP_MAKE(system->context, kmp_operating_family, s);
    *s = (kmp_operating_family){.base = system, .options = *options};
    kempe_status status = prepare(s);
    return KMP_GIVE_OR_FREE(status, family, s, kmp_operating_family_free);
}

KMP_FREES(kmp_operating_family, family, kmp_operating_free(family->state), kmp_linear_free(&family->linear),
          kempe_system_free(family->own), kmp_variant_free(family->variant), kmp_arena_free(&family->arena))

/* -- a state ----------------------------------------------------------------------------------------- */

/* `nearest`: any equilibrium nearby, so that one that is no longer stable is followed, too. */
static kempe_status settle(kmp_operating_family *s, bool nearest)
{
    kmp_search search = {
        .newton = nearest, .warned = s->options.warned, .rates = s->rates, .rate_count = s->rate_count};
    kempe_status status = kmp_operating_settle(s->state, &s->linear, &search);
    if (status == KEMPE_OK)
        s->rate_count = search.rate_count; /* of a steady motion that was found where there is no rest */
    return status;
}

static bool moves(const kmp_operating *o)
{
    for (int i = 0; i < o->system->n; i++)
        if (o->inner_qd[i] != 0)
            return true;
    return false;
}

/* Takes the rates of the start at the value that varies, if the rates of a steady motion are found from it. A rate that
 * forces determine changes as the rate of the start: otherwise wheels would slide at another speed. *anew: the last
 * state is at rest, but the start moves now, so that a steady motion may be found. */
static kempe_status follow_start(kmp_operating_family *s, bool *anew)
{
    const bool follows = s->rate_count > s->options.rate_count || (s->rate_count == 0 && !moves(s->state));
    *anew = false;
    if (!s->variant || !follows)
        return KEMPE_OK;
    kmp_operating *start;
    KMP_TRY(kmp_operating_new(s->linear.system, "start", NULL, &start));
    *anew = s->rate_count == 0 && moves(start);
    for (int i = s->options.rate_count; i < s->rate_count; i++) {
        kmp_steady *found = &s->rates[i];
        const double rate = start->inner_qd[found->coordinate], before = s->begun[found->coordinate];
        if (found->how != KMP_RATE_FREED)
            found->rate = rate;
        else if (before != 0)
            found->rate *= rate / before;
    }
    memcpy(s->begun, start->inner_qd, (size_t)s->base->n * sizeof *s->begun);
    kmp_operating_free(start);
    return KEMPE_OK;
}

static kempe_status find_state(kmp_operating_family *s)
{
    kempe_context *context = s->base->context;
    bool settles = !s->options.word || strcmp(s->options.word, "equilibrium") == 0;
    bool anew = false;
    if (settles && s->state && s->state->equilibrium)
        KMP_TRY(follow_start(s, &anew));
    if (s->state && s->state->equilibrium && !anew) {
        kempe_status status = settle(s, true);
        if (status == KEMPE_OK || status == KEMPE_STOPPED || status == KEMPE_E_MEMORY)
            return status;
        kmp_context_clear(context); /* the next search begins from the start and reports its own failure */
    }
    kmp_operating *fresh;
    KMP_TRY(kmp_operating_new(s->linear.system, settles ? "start" : s->options.word, NULL, &fresh));
    kmp_operating_free(s->state);
    s->state = fresh;
    s->rate_count = s->options.rate_count;
    memcpy(s->begun, fresh->inner_qd, (size_t)s->base->n * sizeof *s->begun);
    return settles ? settle(s, false) : KEMPE_OK; /* here, where the equations are derived already */
}

kempe_status kmp_operating_family_go(kmp_operating_family *s, double value, kmp_modes *modes)
{
    KMP_TRY(s->variant ? kmp_linear_vary(&s->linear, s->own, s->variant, &value) : KEMPE_OK);
    if (s->options.varies)
        s->rates[s->options.varies - s->options.rates].rate = value;
    KMP_TRY(find_state(s));
    s->state->slides = s->options.slides;
    KMP_TRY(kmp_operating_take(s->state, &s->linear, s->options.wish, s->options.wish_count));
    KMP_TRY(kmp_averaged_judge(s->options.averaged, &s->linear));
    kmp_linear_matrices(&s->linear);
    kmp_linear_doubt_state(&s->linear, true);
    KMP_TRY(kmp_linear_settle_switches(&s->linear, true, true));
    KMP_TRY(kmp_modes_init(modes, &s->linear, s->brief));
    if (!s->options.spare)
        modes->count = modes->spectrum.count = modes->shown;
    return KEMPE_OK;
}

/* -- pictures ---------------------------------------------------------------------------------------- */

int kmp_operating_family_move(kmp_operating_family *family, const kmp_modes *modes, int c, double amplitude,
                              double angle, double *q)
{
    const kmp_linear *l = &family->linear;
    const double *re = modes->re + (ptrdiff_t)c * l->n, *im = modes->im + (ptrdiff_t)c * l->n;
    for (int i = 0; i < l->n; i++)
        q[i] = l->q[i] + amplitude * (re[i] * cos(angle) - im[i] * sin(angle));
    return kmp_reduction_close(&family->linear.red, l->t, q, NULL, 0);
}

/* -- assignment --------------------------------------------------------------------------------------------- */

/* Prices of rows and columns keep every reduced cost at zero or more; owner[j] is the row that has column j. Entry n of
 * the columns' is where a path begins. */
typedef struct market {
    int n;
    const double *cost;
    double *row, *price, *least; /* n + 1 each */
    int *owner, *before;         /* n + 1 each */
    bool *seen;                  /* n + 1 */
} market;

/* From column `at`, whose owner looks for another column, to the column that is cheapest to reach. */
static int step(market *m, int at)
{
    int next = -1, i = m->owner[at];
    double shortest = INFINITY;
    m->seen[at] = true;
    for (int j = 0; j < m->n; j++) {
        if (m->seen[j])
            continue;
        double reduced = m->cost[i + (ptrdiff_t)j * m->n] - m->row[i] - m->price[j];
        if (reduced < m->least[j]) {
            m->least[j] = reduced;
            m->before[j] = at;
        }
        if (m->least[j] < shortest) {
            shortest = m->least[j];
            next = j;
        }
    }
    for (int j = 0; j <= m->n; j++)
        if (m->seen[j]) {
            m->row[m->owner[j]] += shortest;
            m->price[j] -= shortest;
        } else {
            m->least[j] -= shortest;
        }
    return next;
}

int kmp_assign(int n, const double *cost, int *column)
{
    market m = {.n = n, .cost = cost};
    kmp_arena arena = {0};
    m.seen = KMP_ARENA_NEW(&arena, bool, n + 1);
    bool ok = KMP_ARENA_EACH(&arena, double, n + 1, &m.row, &m.price, &m.least) &&
              KMP_ARENA_EACH(&arena, int, n + 1, &m.owner, &m.before);
    for (int j = 0; ok && j < n; j++)
        m.owner[j] = -1;
    for (int i = 0; ok && i < n; i++) {
        int at = m.n;
        m.owner[at] = i;
        for (int j = 0; j <= m.n; j++) {
            m.least[j] = INFINITY;
            m.seen[j] = false;
        }
        do
            at = step(&m, at);
        while (m.owner[at] >= 0);
        for (; at != m.n; at = m.before[at])
            m.owner[at] = m.owner[m.before[at]];
    }
    for (int j = 0; ok && j < n; j++)
        column[m.owner[j]] = j;
    kmp_arena_free(&arena);
    return ok ? 0 : -1;
}

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
