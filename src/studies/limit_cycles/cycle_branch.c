/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/limit_cycles/cycle_branch.h"
#include "base/bracket.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "model/expressions/ranges.h"
#include <math.h>
#include <string.h>

enum { FEW_CORRECTIONS = 4, MOST_BISECTIONS = 40 };

typedef struct follower {
    kmp_shooting *s;
    const kmp_branch_options *options;
    kmp_cycle_branch *branch;
    kmp_arena arena;
    double *border, *guess; /* of the next cycle */
    double step;
    double range; /* size of the parameter */
} follower;

static kempe_context *context_of(const follower *f)
{
    return f->s->flow->context;
}

kempe_status kmp_branch_add(kempe_context *context, kmp_cycle_branch *branch, kmp_cycle *cycle)
{
    kmp_cycle **list = kmp_list_room(branch->cycle, (size_t)branch->count, sizeof(kmp_cycle *));
    KMP_TRY(kmp_made(context, list));
    branch->cycle = list;
    branch->cycle[branch->count++] = cycle;
    return KEMPE_OK;
}

/* -- a step --------------------------------------------------------------------------------------------- */

/* Sizes and phase of a cycle; `border` becomes its tangent, of length 1 over the spans. */
static void stand_at(follower *f, const kmp_cycle *c)
{
    kmp_shooting *s = f->s;
    double length = 0;
    kmp_shooting_weigh(s, c->x, c->reach, c->period, f->range);
    kmp_shooting_refer(s, c->x, c->rate);
    for (int j = 0; j < s->width; j++) {
        f->border[j] = c->tangent[j] / s->span[j];
        length += f->border[j] * f->border[j];
    }
    for (int j = 0; j < s->width; j++)
        f->border[j] /= sqrt(length);
}

static double part_of(const kmp_shooting *s, const kmp_cycle *c, int j)
{
    return j < s->size ? c->x[j] : j == s->size ? c->period : c->value;
}

/* The cycle at a distance of `step` from c, where the sizes are those of c. */
static kempe_status step_from(follower *f, const kmp_cycle *c, double step, kmp_cycle **next)
{
    kmp_shooting *s = f->s;
    for (int j = 0; j < s->width; j++)
        f->guess[j] = part_of(s, c, j) + step * f->border[j] * s->span[j];
    KMP_TRY(kmp_shooting_correct(s, f->guess, f->border));
    return kmp_shooting_finish(s, f->border, next);
}

/* The angle between the branch at the last cycle and at the next one. */
static double angle_to(const follower *f, const kmp_cycle *next)
{
    double along = 0, length = 0;
    for (int j = 0; j < f->s->width; j++) {
        double x = next->tangent[j] / f->s->span[j];
        along += x * f->border[j];
        length += x * x;
    }
    return acos(fmin(1, along / sqrt(length)));
}

/* The distance of a cycle from its prediction, over the step. */
static double miss_of(const follower *f, const kmp_cycle *next, double step)
{
    double square = 0;
    for (int j = 0; j < f->s->width; j++) {
        double x = (part_of(f->s, next, j) - f->guess[j]) / f->s->span[j];
        square += x * x;
    }
    return sqrt(square) / step;
}

/* A multiplier passes the unit circle, beyond errors at one end at least. */
static bool changes(const kmp_cycle *a, const kmp_cycle *b)
{
    bool known = a->stability != KMP_CYCLE_UNDECIDED || b->stability != KMP_CYCLE_UNDECIDED;
    return a->multipliers > 0 && a->growing != b->growing && known;
}

/* True if a step leads along the branch, not to another one nearby. Near a fold the other part of a branch is as near,
 * and its cycles have another number of growing multipliers. */
static bool is_along(const follower *f, const kmp_cycle *c, const kmp_cycle *next, double step)
{
    return step <= KMP_CYCLE_CORNER ||
           (angle_to(f, next) <= KMP_CYCLE_ANGLE && miss_of(f, next, step) <= KMP_CYCLE_ANGLE &&
            (!changes(c, next) || step <= KMP_CYCLE_SURE));
}

/* The next cycle, with a step that is shortened where needed. KEMPE_E_FAILED: there is none. */
static kempe_status advance(follower *f, const kmp_cycle *c, kmp_cycle **next)
{
    stand_at(f, c);
    for (;;) {
        kempe_status status = step_from(f, c, f->step, next);
        if (status == KEMPE_OK && is_along(f, c, *next, f->step))
            return KEMPE_OK;
        if (status != KEMPE_OK && status != KEMPE_E_FAILED)
            return status;
        if (f->step <= KMP_CYCLE_SHORTEST)
            return KEMPE_E_FAILED;
        kmp_context_clear(context_of(f));
        f->step = fmax(f->step / 2, KMP_CYCLE_SHORTEST);
    }
}

/* -- special cycles ------------------------------------------------------------------------------------- */

static double climb(const kmp_shooting *s, const kmp_cycle *c)
{
    return c->tangent[s->width - 1];
}

/* The fold within a step of length `whole` from a to b, NULL: the searches on the way fail. */
static kempe_status find_fold(follower *f, const kmp_cycle *a, const kmp_cycle *b, double whole, kmp_cycle **fold)
{
    kmp_bracket search = kmp_bracket_of(0, climb(f->s, a), whole, climb(f->s, b));
    double at;
    *fold = NULL;
    stand_at(f, a);
    while (!kmp_interrupted(context_of(f)) && kmp_bracket_next(&search, KMP_CYCLE_LOCATED * whole, &at)) {
        kmp_cycle *c;
        kempe_status status = step_from(f, a, at, &c);
        if (status == KEMPE_E_FAILED) {
            kmp_context_clear(context_of(f));
            break;
        }
        KMP_TRY(status);
        kmp_bracket_take(&search, at, climb(f->s, c), climb(f->s, c) * climb(f->s, a) < 0);
        *fold = c;
    }
    if (*fold)
        (*fold)->word = KMP_CYCLE_FOLD;
    return KEMPE_OK;
}

/* The kind of a change of stability, by the multiplier nearest to the unit circle. */
static kmp_cycle_word word_of(const kmp_cycle *c)
{
    double least = INFINITY;
    kmp_cycle_word word = KMP_CYCLE_BRANCHING;
    for (int k = 0; k < c->multipliers; k++) {
        double away = fabs(hypot(c->re[k], c->im[k]) - 1);
        if (away >= least)
            continue;
        least = away;
        word = c->im[k] != 0 ? KMP_CYCLE_TORUS : c->re[k] < 0 ? KMP_CYCLE_DOUBLING : KMP_CYCLE_BRANCHING;
    }
    return word;
}

/* The place of a change of stability within a step, by bisection. */
static kempe_status find_change(follower *f, const kmp_cycle *a, double whole, kmp_cycle **change)
{
    double low = 0, high = whole;
    *change = NULL;
    stand_at(f, a);
    for (int k = 0; k < MOST_BISECTIONS && high - low > KMP_CYCLE_CHANGED * whole; k++) {
        kmp_cycle *c;
        kempe_status status = step_from(f, a, (low + high) / 2, &c);
        if (status == KEMPE_E_FAILED) {
            kmp_context_clear(context_of(f));
            break;
        }
        KMP_TRY(status);
        if (c->growing == a->growing)
            low = (low + high) / 2;
        else
            high = (low + high) / 2;
        *change = c;
    }
    if (*change)
        (*change)->word = word_of(*change);
    return KEMPE_OK;
}

/* -- requested values ----------------------------------------------------------------------------------- */

/* The cycle at a value of the parameter between those of a and b. */
static kempe_status find_value(follower *f, const kmp_cycle *a, const kmp_cycle *b, double value, kmp_cycle **found)
{
    kmp_shooting *s = f->s;
    double part = (value - a->value) / (b->value - a->value);
    const kmp_cycle *nearest = part < 0.5 ? a : b;
    stand_at(f, nearest);
    for (int j = 0; j < s->width; j++) {
        f->guess[j] = part_of(s, a, j) + part * (part_of(s, b, j) - part_of(s, a, j));
        f->border[j] = j == s->width - 1;
    }
    KMP_TRY(kmp_shooting_correct(s, f->guess, f->border));
    KMP_TRY(kmp_shooting_finish(s, f->border, found));
    for (int j = 0; j < s->width && climb(s, a) < 0; j++)
        (*found)->tangent[j] = -(*found)->tangent[j];
    return KEMPE_OK;
}

/* Cycles at the requested values between a and b, where the parameter climbs or falls; a value without a cycle there
 * is left out. */
static kempe_status add_values(follower *f, const kmp_cycle *a, const kmp_cycle *b)
{
    bool along = (b->value > a->value) == (f->options->to > f->options->from);
    for (int i = 0; i < f->options->count; i++) {
        int k = along ? i : f->options->count - 1 - i;
        const kmp_range range = {.from = f->options->from, .to = f->options->to};
        double value = kmp_range_value(&range, k, f->options->count);
        kmp_cycle *found;
        if (!((value - a->value) * (value - b->value) < 0))
            continue;
        kempe_status status = find_value(f, a, b, value, &found);
        if (status == KEMPE_E_FAILED) {
            kmp_context_clear(context_of(f));
            continue;
        }
        KMP_TRY(status);
        KMP_TRY(kmp_branch_add(context_of(f), f->branch, found));
    }
    return KEMPE_OK;
}

static bool is_outside(const follower *f, double value)
{
    return (value - f->options->from) * (value - f->options->to) > 0;
}

/* A fold is one if the parameter differs from it on both sides: along cycles of a conservative motion it does not. */
static bool is_fold(const follower *f, const kmp_cycle *a, const kmp_cycle *fold, const kmp_cycle *b)
{
    double least = KMP_CYCLE_LEVEL * fabs(f->options->to - f->options->from);
    return fold && fabs(a->value - fold->value) > least && fabs(b->value - fold->value) > least;
}

/* -- the branch ------------------------------------------------------------------------------------------ */

/* True where the branch ends at b, after a. */
static bool ends(follower *f, const kmp_cycle *a, const kmp_cycle *b)
{
    kmp_cycle_branch *branch = f->branch;
    const kmp_cycle *first = branch->cycle[0];
    /* an error of the runs is one of growth over a period */
    double level = KMP_CYCLE_LEVEL * fabs(f->options->to - f->options->from) * fmax(1, first->period / b->period);
    branch->ends_at_hopf = b->amplitude < KMP_CYCLE_LAST * KMP_CYCLE_FIRST && b->amplitude < a->amplitude;
    if (is_outside(f, b->value))
        branch->end = kmp_arena_printf(f->s->cycles, "it reaches the end of the range");
    else if (branch->ends_at_hopf)
        branch->end = kmp_arena_printf(f->s->cycles, "its amplitude vanishes near %.9g", b->value);
    else if (first->word == KMP_CYCLE_HOPF && fabs(b->value - first->value) <= level &&
             b->amplitude > KMP_CYCLE_CENTRE * KMP_CYCLE_FIRST)
        branch->end = kmp_arena_printf(
            f->s->cycles,
            "all its cycles are at %.9g up to an amplitude of %.3g characteristic sizes, as those of a "
            "conservative motion",
            b->value, b->amplitude);
    else if (branch->count >= f->options->most)
        branch->end = kmp_arena_printf(f->s->cycles, "it has %d cycles", branch->count);
    return branch->end;
}

static kempe_status follow(follower *f, kmp_cycle *first)
{
    kmp_cycle *at = first, *next;
    KMP_TRY(kmp_branch_add(context_of(f), f->branch, first));
    for (;;) {
        if (kmp_interrupted(context_of(f)))
            return KEMPE_STOPPED;
        kempe_status status = advance(f, at, &next);
        if (status == KEMPE_E_FAILED) {
            const char *why = kempe_context_message(context_of(f));
            f->branch->end = kmp_arena_printf(f->s->cycles, "it cannot be followed beyond %.9g%s%s", at->value,
                                              *why ? ": " : "", why);
            kmp_context_clear(context_of(f));
            return KEMPE_OK;
        }
        KMP_TRY(status);
        double whole = f->step;
        bool easy = f->s->iterations <= FEW_CORRECTIONS && angle_to(f, next) < KMP_CYCLE_ANGLE / 2;
        f->step = fmin(easy ? 1.5 * f->step : f->step, KMP_CYCLE_LONGEST);
        /* All that lies between a and the next cycle b, and b itself, unless the range ends before it. */
        kmp_cycle *special = NULL;
        bool folds = climb(f->s, at) * climb(f->s, next) < 0;
        if (folds)
            KMP_TRY(find_fold(f, at, next, whole, &special));
        else if (changes(at, next))
            KMP_TRY(find_change(f, at, whole, &special));
        special = folds && !is_fold(f, at, special, next) ? NULL : special;
        KMP_TRY(add_values(f, at, special && folds ? special : next));
        if (special)
            KMP_TRY(kmp_branch_add(context_of(f), f->branch, special));
        if (special && folds)
            KMP_TRY(add_values(f, special, next));
        KMP_TRY(is_outside(f, next->value) ? KEMPE_OK : kmp_branch_add(context_of(f), f->branch, next));
        kmp_progress(context_of(f), KMP_PROGRESS_STUDY, f->branch->count, f->options->most, "cycles");
        if (ends(f, at, next))
            return KEMPE_OK;
        at = next;
    }
}

kempe_status kmp_branch_follow(kmp_shooting *shooting, const kmp_branch_options *options, kmp_cycle *first,
                               kmp_cycle_branch *branch)
{
    follower f = {.s = shooting, .options = options, .branch = branch, .step = KMP_CYCLE_BEGIN};
    f.range = KMP_CYCLE_RANGE * fabs(options->to - options->from);
    KMP_ARENA_EACH(&f.arena, double, shooting->width, &f.border, &f.guess);
    kempe_status status = kmp_made(context_of(&f), !f.arena.failed);
    if (status == KEMPE_OK)
        status = follow(&f, first);
    kmp_arena_free(&f.arena);
    return status;
}
