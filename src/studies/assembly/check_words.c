/* SPDX-License-Identifier: BSD-3-Clause */
/* The sentences of `check`. */
#include "studies/assembly/check_print.h"
#include <kempe/check.h>
#include <math.h>

enum { MOST_LISTED = 24 };

static const char *ending(int count)
{
    return count == 1 ? "" : "s";
}

static const char *is_or_are(int count)
{
    return count == 1 ? "is" : "are";
}

void kmp_list_rows(kmp_text *text, const kempe_system *system, int count, const int *rows)
{
    kmp_list_names(text, system, kmp_name_of_row, count < MOST_LISTED ? count : MOST_LISTED, rows);
    if (count > MOST_LISTED)
        kmp_text_printf(text, " and %d more", count - MOST_LISTED);
}

void kmp_check_verdict(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    const char *reason = !check->assembled     ? "does not assemble"
                         : check->undetermined ? "no run is possible"
                         : part->p == 0        ? (check->system->rheonomic ? "all motion is prescribed" : "cannot move")
                                               : NULL;
    kmp_text_put(text, reason ? reason : "can be simulated");
    if (!check->assembled)
        return;
    if (check->diagnosis.second == KMP_SECOND_NONE)
        kmp_text_put(text, ", but is infinitesimally mobile");
    if (check->diagnosis.second == KMP_SECOND_BRANCHES || check->diagnosis.second == KMP_SECOND_CONDITIONS)
        kmp_text_put(text, "; the start is a change point (bifurcation)");
    if (check->diagnosis.shared_count > 0 || check->diagnosis.loads.loaded)
        kmp_text_put(text, "; some reactions are not unique");
}

void kmp_check_mobility(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    int all = part->m - part->r, always = part->m - check->diagnosis.generic_rank, here = all - always;
    kmp_text_put(text, "");
    if (all == 0)
        return;
    kmp_text_printf(text, "coordinates - rows = %d - %d = %d: ", part->n, part->m, part->n - part->m);
    if (!check->diagnosis.moved) {
        kmp_text_printf(text, "%d row%s %s redundant", all, ending(all), is_or_are(all));
        return;
    }
    if (always > 0)
        kmp_text_printf(text, "%d row%s %s redundant in every configuration", always, ending(always),
                        is_or_are(always));
    if (here > 0)
        kmp_text_printf(text, "%s%d row%s %s%s only in this position", always > 0 ? ", and " : "", here, ending(here),
                        always > 0 ? "" : is_or_are(here), always > 0 ? "more" : " redundant");
}

void kmp_check_second(kmp_text *text, const kempe_check *check)
{
    const kmp_diagnosis *d = &check->diagnosis;
    int p = check->part.p, general = check->part.n - d->generic_rank;
    kmp_text_put(text, "");
    switch (d->second) {
    case KMP_SECOND_UNTRIED:
        return;
    case KMP_SECOND_REAL:
        kmp_text_put(text, "second-order test: the motion continues in every direction");
        break;
    case KMP_SECOND_BRANCHES:
        kmp_text_printf(
            text,
            "a change point (bifurcation): first order permits a plane of directions, second order %d branch%s in it",
            d->branches, d->branches == 1 ? "" : "es");
        break;
    case KMP_SECOND_NONE:
        kmp_text_put(text, "infinitesimally mobile: first order permits a motion, second order excludes it");
        break;
    case KMP_SECOND_CONDITIONS:
        kmp_text_printf(
            text, "a change point (bifurcation): second order imposes %d condition%s on %d first-order directions",
            d->conditions, ending(d->conditions), p);
        break;
    }
    if (d->moved && general < p)
        kmp_text_printf(text, "; elsewhere the mechanism has %d degree%s of freedom", general, ending(general));
}

void kmp_check_repair(kmp_text *text, const kempe_check *check, const kmp_repair *repair)
{
    const char *name = kmp_name_of_closure(check->system, repair->closure),
               *kind = check->system->model->closures[repair->closure].kind;
    if (repair->count == repair->of) {
        kmp_text_printf(text, "remove %s '%s': the other closures imply it", kind, name);
        return;
    }
    kmp_text_printf(text, "release %s '%s' in %d of its %d directions (", kind, name, repair->count, repair->of);
    kmp_list_rows(text, check->system, repair->count, repair->rows);
    kmp_text_put(text, ")");
}

void kmp_check_reach(kmp_text *text, const kempe_check *check, const kmp_reach *reach)
{
    const char *name = kmp_name_of_closure(check->system, reach->closure);
    if (!reach->body)
        kmp_text_printf(text,
                        "loop '%s' can never close: its rod is %.6g m long, but the points are at most %.6g m apart",
                        name, reach->longest, reach->others);
    else
        kmp_text_printf(text,
                        "loop '%s' can never close: body '%s' spans %.6g m from %s to %s, the other links at most %.6g "
                        "m: %.4g m are missing",
                        name, reach->body, reach->longest, reach->from, reach->to, reach->others,
                        reach->longest - reach->others);
}

void kmp_check_release(kmp_text *text, const kempe_check *check, const kmp_release *release)
{
    if (release->coordinate < 0) {
        kmp_text_put(text, release->closes ? "it closes if several held coordinates are released"
                                           : "it does not close even if all held coordinates are released");
        return;
    }
    const kmp_motion *motion = &check->system->model->motions[release->coordinate];
    if (release->closes)
        kmp_text_printf(text, "it closes if '%s' is released; its value is then %.6g %s", motion->name,
                        kmp_print_value(check->system, release->coordinate, release->to),
                        kmp_print_unit(check->system, release->coordinate));
    else
        kmp_text_printf(text, "it does not close if only '%s' is released", motion->name);
}

/* Zero but for rounding, of lengths and angles that matter, reads as zero. */
static double clean(double x)
{
    return fabs(x) < 1e-12 ? 0 : x;
}

void kmp_check_swing(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_limits *l = &check->diagnosis.limits;
    const kmp_swing *s = &l->swing[k];
    const char *unit = kmp_print_unit(check->system, k);
    double low = kmp_print_value(check->system, k, clean(s->low)),
           high = kmp_print_value(check->system, k, clean(s->high));
    int dead = 0;
    for (int i = 0; i < l->landmark_count; i++)
        dead += l->landmark[i].coordinate == k;
    if (!s->moves) {
        kmp_text_put(text, "does not move");
        return;
    }
    if (s->unseen) {
        kmp_text_put(text, "moves; its range is found from a start where the angles of the joint are not singular");
        return;
    }
    if (s->turns != 0) {
        int times = s->turns < 0 ? -s->turns : s->turns;
        kmp_text_put(text, "rotates fully");
        if (times > 1)
            kmp_text_printf(text, ", %d times in a cycle", times);
        if (dead > 0)
            kmp_text_printf(text, ", with %d reversals", dead);
        return;
    }
    if (!l->cycle && !s->low_dead && !s->high_dead) {
        kmp_text_printf(text, "followed from %.6g to %.6g %s", low, high, unit);
        return;
    }
    kmp_text_printf(text, "oscillates between %.6g and %.6g %s (", low, high, unit);
    if (s->low_dead && s->high_dead)
        kmp_text_printf(text, "dead centres%s)", dead > 2 ? ", and others between" : "");
    else if (s->low_dead || s->high_dead)
        kmp_text_printf(text, "the %s a dead centre)", s->low_dead ? "first" : "second");
    else
        kmp_text_put(text, "no dead centre)");
}
