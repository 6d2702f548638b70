/* SPDX-License-Identifier: BSD-3-Clause */
/* `check` for a person: a short form with the verdict, or one paragraph a question; and as one object. */
#include "base/context.h"
#include "base/text.h"
#include "constraints/closing/assembly.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/tolerances.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/gear.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/data/tyre.h"
#include "model/write/model_json.h"
#include "model/write/model_print.h"
#include "output/print.h"
#include "output/result_table.h"
#include "studies/assembly/flexible_check.h"
#include "studies/assembly/flexible_loads.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>

enum { MOST_LISTED = 12, MOST_RANGES = 4 };
#define ROUNDING 1e-13 /* relative to the first pivot: zero */
#define USABLE   1e3   /* max |Bvu| of a coordinate that could be independent */

/* NULL: of no coordinate. */
static const char *name_of(const kempe_check *check, int coordinate)
{
    return coordinate < 0 ? NULL : check->system->model->motions[coordinate].name;
}

/* -- sentences ---------------------------------------------------------------------------------------- */

enum { MOST_NAMED = 24, FEW_NAMED = 4 };

static const char *ending(int count)
{
    return count == 1 ? "" : "s";
}

static const char *is_or_are(int count)
{
    return count == 1 ? "is" : "are";
}

static void list_rows(kmp_text *text, const kempe_system *system, int count, const int *rows)
{
    kmp_list_names(text, system, kmp_name_of_row, count < MOST_NAMED ? count : MOST_NAMED, rows);
    if (count > MOST_NAMED)
        kmp_text_printf(text, " and %d more", count - MOST_NAMED);
}

/* The answer in a few words: "can be simulated", or the reason why not. */
static const char *answer_of(const kempe_check *check)
{
    return !check->assembled                               ? "does not assemble"
           : check->undetermined                           ? "no run is possible"
           : check->ended                                  ? "cannot be simulated from its start"
           : check->part.p > 0                             ? "can be simulated"
           : check->driven > 0 || check->system->rheonomic ? "all motion is prescribed"
                                                           : "cannot move";
}

/* Reservations of the answer. */
static void put_reservations(kmp_text *text, const kempe_check *check)
{
    if (!check->assembled)
        return;
    if (check->diagnosis.second == KMP_SECOND_NONE)
        kmp_text_put(text, ", but is infinitesimally mobile");
    if (check->diagnosis.second == KMP_SECOND_BRANCHES || check->diagnosis.second == KMP_SECOND_CONDITIONS)
        kmp_text_put(text, "; the start is a change point (bifurcation)");
    if (check->diagnosis.shared_count > 0 || check->diagnosis.loads.loaded)
        kmp_text_put(text, "; some reactions are not unique");
}

static void check_verdict(kmp_text *text, const kempe_check *check)
{
    kmp_text_put(text, answer_of(check));
    put_reservations(text, check);
}

/* "2 degrees of freedom, 1 of them driven by 'motor'". */
static void put_freedom(kmp_text *text, const kempe_check *check)
{
    const kempe_model *model = check->system->model;
    const int all = check->part.p + check->driven;
    kmp_text_printf(text, "%d degree%s of freedom", all, ending(all));
    if (check->driven == 0)
        return;
    kmp_text_put(text, ", ");
    if (check->part.p > 0)
        kmp_text_printf(text, "%d of them ", check->driven);
    kmp_text_put(text, "driven by ");
    int drives = 0;
    for (int c = 0; c < model->closure_count; c++)
        if (kmp_closure_is_drive(&model->closures[c]) && !kmp_motion_is_for_load(model, model->closures[c].motion) &&
            ++drives <= FEW_NAMED)
            kmp_text_printf(text, "%s'%s'", drives > 1 ? ", " : "", model->closures[c].name);
    if (drives > FEW_NAMED)
        kmp_text_printf(text, " and %d more", drives - FEW_NAMED);
    if (drives == 0)
        kmp_text_put(text, "constraints that depend on time");
}

/* The explanation of degrees of freedom that differ from the count; "" when they agree. */
static void check_mobility(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    int all = part->m - part->r, always = part->m - check->diagnosis.generic_rank, here = all - always;
    kmp_text_put(text, "");
    if (all == 0)
        return;
    kmp_text_printf(text, "%d - %d = %d by counting: ", part->n, part->m, part->n - part->m);
    if (!check->diagnosis.moved) {
        kmp_text_printf(text, "%d equation%s %s redundant", all, ending(all), is_or_are(all));
        return;
    }
    if (always > 0)
        kmp_text_printf(text, "%d equation%s %s redundant in every position", always, ending(always),
                        is_or_are(always));
    if (here > 0)
        kmp_text_printf(text, "%s%d equation%s %s%s only in this position", always > 0 ? ", and " : "", here,
                        ending(here), always > 0 ? "" : is_or_are(here), always > 0 ? "more" : " redundant");
}

static void put_second(kmp_text *text, const kempe_check *check)
{
    const kmp_diagnosis *d = &check->diagnosis;
    int p = check->part.p, general = check->part.n - d->generic_rank;
    kmp_text_put(text, "");
    switch (d->second) {
    case KMP_SECOND_UNTRIED:
        return;
    case KMP_SECOND_REAL:
        kmp_text_put(text, "the motion continues in every direction (second-order test)");
        break;
    case KMP_SECOND_BRANCHES:
        kmp_text_printf(text, "change point (bifurcation): %d branch%s of the motion leave%s this position",
                        d->branches, d->branches == 1 ? "" : "es", d->branches == 1 ? "s" : "");
        break;
    case KMP_SECOND_NONE:
        kmp_text_put(text, "infinitesimally mobile: a small displacement is possible, but no finite motion");
        break;
    case KMP_SECOND_CONDITIONS:
        kmp_text_printf(
            text,
            "change point (bifurcation): there are %d directions of motion, and %d condition%s of second order on them",
            p, d->conditions, ending(d->conditions));
        break;
    }
    if (d->moved && general < p)
        kmp_text_printf(text, "; elsewhere the mechanism has %d degree%s of freedom", general, ending(general));
}

static void put_repair(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_repair *repair = &check->diagnosis.repairs[k];
    const char *name = kmp_name_of_closure(check->system, repair->closure),
               *kind = kmp_closure_word(&check->system->model->closures[repair->closure]);
    if (repair->count == repair->of) {
        kmp_text_printf(text, "remove %s '%s': the other closures imply it", kind, name);
        return;
    }
    kmp_text_printf(text, "release %s '%s' in %d of its %d directions (", kind, name, repair->count, repair->of);
    list_rows(text, check->system, repair->count, repair->rows);
    kmp_text_put(text, ")");
}

static void put_reach(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_short_links *reach = &check->obstacle.reaches[k];
    const char *name = kmp_name_of_closure(check->system, reach->closure);
    const kmp_shown as = kmp_shown_as(check->system->context, "m");
    const double longest = as.factor * reach->longest, others = as.factor * reach->others;
    if (!reach->body)
        kmp_text_printf(text,
                        "loop '%s' can never close: its rod is %.6g %s long, but the points are at most %.6g %s apart",
                        name, longest, as.unit, others, as.unit);
    else
        kmp_text_printf(text,
                        "loop '%s' can never close: body '%s' spans %.6g %s from %s to %s, the other links at most "
                        "%.6g %s: %.4g %s are missing",
                        name, reach->body, longest, as.unit, reach->from, reach->to, others, as.unit, longest - others,
                        as.unit);
}

static void put_release(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_release *release = &check->obstacle.releases[k];
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

static void put_swing(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_limits *l = &check->diagnosis.limits;
    const kmp_coordinate_range *s = &l->range[k];
    const char *unit = kmp_print_unit(check->system, k);
    double low = kmp_print_value(check->system, k, clean(s->low)),
           high = kmp_print_value(check->system, k, clean(s->high));
    int dead = 0;
    for (int i = 0; i < l->limit_position_count; i++)
        dead += l->limit_position[i].coordinate == k;
    if (!s->moves) {
        kmp_text_put(text, "does not move");
        return;
    }
    if (s->unseen) {
        kmp_text_put(text, "moves; its range is not known, because the angles of the joint are singular at this start");
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
    const bool one = s->low_dead != s->high_dead, both = s->low_dead && s->high_dead;
    const char *which = s->low_dead ? "first" : "second";
    if (!l->cycle && !both) { /* the search ended on the way to the other end */
        kmp_text_printf(text, "followed from %.6g to %.6g %s", low, high, unit);
        if (one)
            kmp_text_printf(text, ", the %s a dead centre", which);
        return;
    }
    kmp_text_printf(text, "oscillates between %.6g and %.6g %s (", low, high, unit);
    if (both)
        kmp_text_printf(text, "dead centres%s)", dead > 2 ? ", and others between" : "");
    else if (one)
        kmp_text_printf(text, "the %s a dead centre)", which);
    else
        kmp_text_put(text, "no dead centre)");
}

/* Column of the text of a line, after its label. */
enum { TEXT_COLUMN = 26 };

/* Words after their label. */
static void put_line(kmp_text *text, const char *word, const char *words)
{
    char first[TEXT_COLUMN + 1];
    (void)snprintf(first, sizeof first, "  %-*s", TEXT_COLUMN - 2, word);
    kmp_print_wrapped(text, first, TEXT_COLUMN, words);
}

/* The same of a text, which is freed. */
static void put_words(kmp_text *text, const char *word, kmp_text *words)
{
    put_line(text, word, words->s ? words->s : "");
    kmp_text_free_part(text, words);
}

static void line(kmp_text *text, const char *word, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* A line after its label. */
static void line(kmp_text *text, const char *word, const char *format, ...)
{
    kmp_text words = {0};
    KMP_TEXT_ARGUMENTS(&words, format);
    put_words(text, word, &words);
}

/* A separate line when `write` gives a sentence. */
static void sentence(kmp_text *text, const kempe_check *check, const char *word,
                     void (*write)(kmp_text *, const kempe_check *))
{
    kmp_text words = {0};
    write(&words, check);
    if (words.length > 0)
        put_line(text, word, words.s);
    kmp_text_free_part(text, &words);
}

/* Item k of a list, without the end of its line. */
typedef void item(kmp_text *text, const kempe_check *check, int k);

/* A line for each item, the first ones of many; `next` labels all but the first. */
static void list(kmp_text *text, const kempe_check *check, const char *first, const char *next, int count, item *put)
{
    for (int k = 0; k < count && k < MOST_LISTED; k++) {
        kmp_text words = {0};
        put(&words, check, k);
        put_words(text, k ? next : first, &words);
    }
    if (count > MOST_LISTED)
        line(text, "", "and %d more", count - MOST_LISTED);
}

static void write_unused(kmp_text *text, const kempe_check *check)
{
    kmp_print_unused(text, check->system->model);
}

/* 'rod', 'arm': the ones that move closures. */
static void list_loaded(kmp_text *text, const kempe_check *check, const kmp_rigid_mobility *rigid)
{
    const kempe_model *model = check->system->model;
    const char *before = "";
    for (int k = 0; k < model->flexible_count; k++)
        if (rigid->loads[k]) {
            kmp_text_printf(text, "%s'%s'", before, model->bodies[model->flexibles[k].body].name);
            before = ", ";
        }
}

/* The changes by elasticity: the rank of J, and whether the loops move. */
static void put_elastic_mobility(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    kmp_rigid_mobility rigid;
    kmp_text_put(text, "");
    if (check->system->model->flexible_count == 0 || part->m == 0)
        return;
    if (!kmp_rigid_mobility_find(check->system, check->assembly->q, &rigid)) {
        text->failed = true;
        return;
    }
    const int more = part->r - rigid.rank;
    if (more > 0) {
        kmp_text_printf(text, "%d equation%s that would be redundant between rigid bodies load%s ", more, ending(more),
                        more == 1 ? "s" : "");
        list_loaded(text, check, &rigid);
    }
    if (rigid.freedom == 0 && part->p > 0) {
        kmp_text_put(text, more > 0 ? "; " : "");
        kmp_text_put(text, check->driven > 0 ? "in addition to its drives it moves by the elasticity of "
                                             : "it is mobile only by the elasticity of ");
        list_loaded(text, check, &rigid);
    }
    kmp_rigid_mobility_free(&rigid);
}

/* The first line. */
static void show_title(kmp_text *text, const kempe_check *check)
{
    kmp_text words = {0};
    kmp_text_printf(&words, "%s: %s%s%s", check->system->model->name,
                    check->status == KEMPE_UNTRUSTED ? kempe_outcome_text(KEMPE_OUTCOME_NOT_TRUSTWORTHY) : "",
                    check->status == KEMPE_UNTRUSTED ? ", " : "", answer_of(check));
    if (check->assembled) {
        kmp_text_put(&words, ", ");
        put_freedom(&words, check);
    }
    put_reservations(&words, check);
    kmp_print_wrapped(text, "", 4, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
}

/* "6 equations in 2 closures (B, X), 4 of them independent". */
static void put_constraints(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    if (check->loop_count == 0) {
        kmp_text_put(text, "none: the joints form a tree");
        return;
    }
    kmp_text_printf(text, "%d equation%s in %d closure%s", part->m, ending(part->m), check->loop_count,
                    ending(check->loop_count));
    for (int c = 0; c < check->loop_count && check->loop_count <= MOST_LISTED; c++)
        kmp_text_printf(text, "%s%s", c ? ", " : " (", kmp_name_of_closure(check->system, c));
    kmp_text_put(text, check->loop_count > 0 && check->loop_count <= MOST_LISTED ? ")" : "");
    if (part->m > 0)
        kmp_text_printf(text, part->r == part->m ? ", all independent" : ", %d of them independent", part->r);
}

static void show_mobility(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    line(text, "bodies", "%d, with %d coordinate%s", check->body_count, part->n, ending(part->n));
    sentence(text, check, "loop constraints", put_constraints);
    if (check->undetermined)
        line(text, "no run is possible", "%s", check->undetermined);
    sentence(text, check, "degrees of freedom", check_mobility);
    sentence(text, check, "", put_elastic_mobility);
    sentence(text, check, "", put_second);
    if (check->diagnosis.ran && check->diagnosis.margin > 0 && check->diagnosis.margin < 1e-4)
        line(text, "",
             "close to a change point (bifurcation): the constraints are nearly dependent, by %.2g of their usual "
             "independence",
             check->diagnosis.margin);
    if (part->m > part->r) {
        kmp_text rows = {0};
        list_rows(&rows, check->system, part->m - part->r, part->redundant);
        put_words(text, "redundant constraints", &rows);
    }
    char first[TEXT_COLUMN + 1];
    (void)snprintf(first, sizeof first, "  %-*s", TEXT_COLUMN - 2, "rounded lengths");
    kmp_print_rounding(text, check->system, first);
}

static void put_cut(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_cut *cut = &check->system->model->cuts[k];
    kmp_text_printf(text, "joint %s (%s), in the loop %s", cut->joint, cut->kind, cut->loop);
    if (cut->start_given)
        kmp_text_put(text, "; its start value is part of the guess");
}

static void put_cut_with_reason(kmp_text *text, const kempe_check *check, int k)
{
    put_cut(text, check, k);
    kmp_text_printf(text, "; closure %s with %d equations; %s", check->system->model->cuts[k].closure,
                    check->system->model->cuts[k].rows, check->system->model->cuts[k].why);
}

/* -- masses of shapes -------------------------------------------------------------------------------- */

/* The k-th body whose mass follows from its shapes; NULL: there are fewer. */
static const kmp_body *shaped(const kempe_check *check, int k)
{
    const kempe_model *model = check->system->model;
    for (int b = 1; b < model->body_count; b++)
        if (model->bodies[b].by_shape && k-- == 0)
            return &model->bodies[b];
    return NULL;
}

/* Products of inertia are left out where they are zero. */
static void put_mass(kmp_text *text, const kempe_check *check, const kmp_body *body)
{
    const kempe_context *context = check->system->context;
    const kmp_shown length = kmp_shown_as(context, "m"), inertia = kmp_shown_as(context, "kg m^2");
    kmp_print_quantity(text, context, 6, body->mass.value, "kg");
    kmp_text_printf(text, ", centre [%.6g, %.6g, %.6g] %s, inertia", length.factor * body->com[0].value,
                    length.factor * body->com[1].value, length.factor * body->com[2].value, length.unit);
    for (int i = 0; i < 6; i++)
        if (i < 3 || body->inertia[i].value != 0)
            kmp_text_printf(text, " %s %.6g", kmp_inertia_names[i], inertia.factor * body->inertia[i].value);
    kmp_text_printf(text, " %s", inertia.unit);
}

static void put_shaped(kmp_text *text, const kempe_check *check, int k)
{
    kmp_text_printf(text, "%s: ", shaped(check, k)->name);
    put_mass(text, check, shaped(check, k));
}

/* -- threads ------------------------------------------------------------------------------------------ */

/* The k-th friction in a thread whose load turns it, or does not; the model as it was given has the forces. */
static const kmp_force *threaded(const kempe_check *check, int k, bool locks)
{
    const kempe_model *model = check->given->model;
    for (int f = 0; f < model->force_count; f++) {
        const kmp_force *force = &model->forces[f];
        if (force->thread && (force->friction_angle >= force->lead_angle) == locks && k-- == 0)
            return force;
    }
    return NULL;
}

static void put_thread(kmp_text *text, const kempe_check *check, const kmp_force *force)
{
    const double degrees = 90 / acos(0);
    const char *joint = check->given->model->motions[force->motion].name;
    kmp_text_printf(text, "'%s' on '%s': lead angle %.4g deg, ", force->name, joint, force->lead_angle * degrees);
    if (isnan(force->friction_angle))
        kmp_text_put(text, "an angle of friction that varies");
    else
        kmp_text_printf(text, "angle of friction %.4g deg", force->friction_angle * degrees);
}

static void put_locking(kmp_text *text, const kempe_check *check, int k)
{
    put_thread(text, check, threaded(check, k, true));
}

static void put_running(kmp_text *text, const kempe_check *check, int k)
{
    put_thread(text, check, threaded(check, k, false));
}

static void show_threads(kmp_text *text, const kempe_check *check)
{
    for (int locks = 1; locks >= 0; locks--) {
        int count = 0;
        while (threaded(check, count, locks))
            count++;
        list(text, check, locks ? "self-locking" : "not self-locking", "", count, locks ? put_locking : put_running);
    }
}

static void json_threads(kmp_json *json, const kempe_check *check)
{
    const kempe_model *model = check->given->model;
    if (!threaded(check, 0, true) && !threaded(check, 0, false))
        return;
    kmp_json_array(json, "threads");
    for (int f = 0; f < model->force_count; f++) {
        const kmp_force *force = &model->forces[f];
        if (!force->thread)
            continue;
        kmp_json_put(json, "{ friction %s coordinate %s", force->name, model->motions[force->motion].name);
        kmp_json_put(json, "lead_angle %g friction_angle %g self_locking %i }", force->lead_angle,
                     force->friction_angle, force->friction_angle >= force->lead_angle);
    }
    kmp_json_end(json);
}

/* -- flexible bodies --------------------------------------------------------------------------------- */

static void put_frequencies(kmp_text *text, int count, const double *w)
{
    const double turn = 2 * acos(-1);
    for (int k = 0; k < count; k++)
        if (isfinite(w[k]))
            kmp_text_printf(text, "%s%.5g", k ? ", " : "", w[k] / turn);
    kmp_text_put(text, " Hz");
}

/* The largest rate about an axis that the start gives or a drive prescribes, of the joint of a body and of the joints
 * that carry it. */
static double start_rate(const kempe_check *check, int body)
{
    const kempe_model *model = check->given->model;
    double rate = 0;
    for (int b = body; b > 0; b = model->bodies[b].parent)
        for (int k = model->bodies[b].first_motion; k < model->bodies[b].first_motion + model->bodies[b].motion_count;
             k++)
            rate = model->motions[k].rotation ? fmax(rate, fabs(model->start.qd[k].value)) : rate;
    return rate;
}

static void put_undeformed(kmp_text *text, const kempe_check *check, const kmp_body *body)
{
    kmp_text words = {0};
    kmp_text_put(&words, "without deformation it has ");
    put_mass(&words, check, body);
    put_words(text, "", &words);
}

/* The motions of the sections without shapes. */
static void put_rigid_directions(kmp_text *text, const kmp_flexible *f)
{
    static const char *const words[3] = {"torsion", "bending along z", "bending along y"};
    kmp_text none = {0};
    for (int c = 3; c-- > 0;)
        if (!kmp_flexible_bends(f, c))
            kmp_text_printf(&none, "%s%s", none.length > 0 ? " and " : "", words[c]);
    if (none.length > 0)
        line(text, "", "it is rigid in %s: loads there do not deform it", none.s);
    kmp_text_free_part(text, &none);
}

/* The sentence on buckling of a body by its part. */
static void put_buckling(kmp_text *text, const kmp_flexible_loads *loads, double taken)
{
    const char *near = taken > 1 / KMP_BUCKLING_NEAR ? "warning: " : "";
    if (loads->creep)
        line(text, "", "its buckling is not examined, because wheels creep on their rails");
    if (!(taken > KMP_BUCKLING_NONE))
        return;
    if (taken >= 1)
        line(text, "", "%sit buckles under the loads of the start, at %.3g times these", near, 1 / taken);
    else if (loads->springs)
        line(text, "", "%sthe forces of the start, with springs, take %.3g %% of its stiffness; at 100 %% it buckles",
             near, 100 * taken);
    else
        line(text, "", "%sit buckles at %.4g times the loads of the start", near, 1 / taken);
}

/* Joints and closures that load a body where it has no shapes. */
static void put_unshaped(kmp_text *text, const kmp_flexible_loads *loads, int which)
{
    static const char *const words[] = {"in torsion", "along z", "along y"};
    for (int k = 0; k < loads->count; k++) {
        const kmp_unshaped_load *load = &loads->list[k];
        kmp_text in = {0};
        for (int c = KMP_UNSHAPED_DIRECTIONS; c-- > 0;)
            if (load->in[c])
                kmp_text_printf(&in, "%s%s", in.length > 0 ? " and " : "", words[c]);
        if (load->flexible == which)
            line(text, "", "%s '%s' loads it %s, where it has no shape", load->kind, load->name, in.s ? in.s : "");
        kmp_text_free_part(text, &in);
    }
}

/* Closures with redundant rows at a body without some shapes, which would share their loads. */
static void put_stiff_loops(kmp_text *text, const kempe_check *check, const kmp_flexible *f)
{
    const kempe_system *s = check->system;
    const int redundant = check->part.m - check->part.r;
    int last = -1;
    for (int k = 0; k < redundant && !f->file; k++) {
        const int c = s->rows[check->part.redundant[k]].closure;
        bool own = false;
        for (int side = 0; side < 2; side++)
            own = own || (s->model->closures[c].point[side] >= 0 &&
                          s->model->points[s->model->closures[c].point[side]].body == f->body);
        if (own && c != last && !(kmp_flexible_bends(f, 0) && kmp_flexible_bends(f, 1) && kmp_flexible_bends(f, 2)))
            line(text, "",
                 "loop '%s' has redundant constraints: with shapes in its rigid directions their loads would be unique",
                 s->model->closures[c].name);
        last = own ? c : last;
    }
}

static void show_flexible(kmp_text *text, const kempe_check *check)
{
    const kempe_model *model = check->given->model;
    kmp_flexible_loads loads;
    text->failed = !kmp_flexible_loads_find(&loads, check) || text->failed;
    for (int k = 0; k < model->flexible_count; k++) {
        const kmp_flexible *f = &model->flexibles[k];
        const kmp_body body = kmp_body_undeformed(model, f->body);
        kmp_flexible_spectrum s;
        kmp_text own = {0};
        if (f->count == 0) {
            line(text, "flexible body", "%s: rigid, because its parameters leave it no shapes", body.name);
            continue;
        }
        for (int i = f->first; i < f->first + f->count; i++)
            kmp_text_printf(&own, "%s%s", i > f->first ? ", " : "", model->motions[i].name);
        line(text, "flexible body", "%s: stiffening %s, frame %s, coordinates %s", body.name,
             kmp_stiffening_words[f->stiffening], kmp_flexible_frame_words[f->frame], own.s ? own.s : "");
        kmp_text_free_part(text, &own);
        own = (kmp_text){0};
        if (f->turned)
            line(text, "", "its beam has the axes x [%.6g, %.6g, %.6g], y [%.6g, %.6g, %.6g] of the body",
                 f->axes[0][0], f->axes[1][0], f->axes[2][0], f->axes[0][1], f->axes[1][1], f->axes[2][1]);
        if (!kmp_flexible_spectrum_find(f, &s)) {
            text->failed = true;
            break;
        }
        kmp_text_put(&own, "in its frame it vibrates at ");
        put_frequencies(&own, s.count, s.fixed);
        kmp_text_put(&own, ", free at ");
        put_frequencies(&own, s.count, s.free);
        put_words(text, "", &own);
        line(text, "",
             "its fastest vibration has %.4g rad/s: explicit integrators need steps below %.2g s; radau does "
             "not",
             s.highest, KMP_EXPLICIT_REACH / s.highest);
        put_undeformed(text, check, &body);
        if (f->frame == KMP_FRAME_MEAN)
            line(text, "", "its shapes have %.2g of the momentum of rigid motions, and its axes are the mean ones",
                 kmp_flexible_rigid_part(f));
        put_rigid_directions(text, f);
        put_unshaped(text, &loads, k);
        put_stiff_loops(text, check, f);
        put_buckling(text, &loads, loads.taken ? loads.taken[k] : NAN);
        const double rate = start_rate(check, f->body);
        if (f->averaged)
            line(text, "",
                 "warning: %s; the body is right where it turns with less than %.1f of its first frequency, %.4g rad/s",
                 f->doubt, KMP_ROTATION_AVERAGED, KMP_ROTATION_AVERAGED * s.fixed[0]);
        else if (f->doubt)
            line(text, "", "warning: %s", f->doubt);
        if (f->stiffening == KMP_STIFFENING_NONE && rate > KMP_ROTATION_SLOW * s.fixed[0])
            line(text, "",
                 "warning: it starts with %.4g rad/s, more than %.1f of its first frequency, without terms of "
                 "second order: %s",
                 rate, KMP_ROTATION_SLOW, f->file ? "write them into its file" : "take stiffening 'first' or 'full'");
    }
    kmp_flexible_loads_free(&loads);
}

static void json_unshaped(kmp_json *json, const kmp_flexible_loads *loads, int which)
{
    static const char *const words[] = {"torsion", "z", "y"};
    kmp_json_array(json, "loads_without_shape");
    for (int k = 0; k < loads->count; k++)
        for (int c = 0; c < KMP_UNSHAPED_DIRECTIONS; c++)
            if (loads->list[k].flexible == which && loads->list[k].in[c])
                kmp_json_put(json, "{ by %s direction %s }", loads->list[k].name, words[c]);
    kmp_json_end(json);
}

static void json_flexible(kmp_json *json, const kempe_check *check)
{
    const kempe_model *model = check->given->model;
    if (model->flexible_count == 0)
        return;
    kmp_flexible_loads loads;
    const bool found = kmp_flexible_loads_find(&loads, check);
    kmp_json_array(json, "flexible_bodies");
    for (int k = 0; k < model->flexible_count; k++) {
        const kmp_flexible *f = &model->flexibles[k];
        kmp_flexible_spectrum s;
        if (!kmp_flexible_spectrum_find(f, &s))
            s = (kmp_flexible_spectrum){0};
        kmp_json_put(json, "{ body %s", model->bodies[f->body].name);
        if (f->doubt)
            kmp_json_put(json, "doubt %s", f->doubt);
        kmp_json_numbers(json, "fixed", s.count, s.fixed);
        kmp_json_numbers(json, "free", s.count, s.free);
        if (f->count > 0)
            kmp_json_put(json, "highest %g explicit_step %g", s.highest, KMP_EXPLICIT_REACH / s.highest);
        if (found && loads.taken[k] > KMP_BUCKLING_NONE)
            kmp_json_put(json, loads.springs ? "loads_take %g" : "loads_take %g buckles_at %g", loads.taken[k],
                         1 / loads.taken[k]);
        json_unshaped(json, &loads, k);
        kmp_json_put(json, "}");
    }
    kmp_flexible_loads_free(&loads);
    kmp_json_end(json);
}

/* A rotation, or a deformation, between the ground and the body. */
static bool rotates(const kempe_model *model, int body)
{
    for (int b = body; b > 0; b = model->bodies[b].parent)
        for (int k = 0; k < model->bodies[b].motion_count; k++) {
            const kmp_motion *motion = &model->motions[model->bodies[b].first_motion + k];
            if (motion->rotation || motion->elastic)
                return true;
        }
    return false;
}

/* Bodies without inertia: bodies with mass (`heavy`) that rotate, or bodies without mass. */
static void show_bare(kmp_text *text, const kempe_check *check, const char *word, bool heavy)
{
    const kempe_model *model = check->given->model;
    kmp_text names = {0};
    for (int b = 1; b < model->body_count; b++)
        if (kmp_body_is_bare(&model->bodies[b]) && (model->bodies[b].mass.value != 0) == heavy &&
            (!heavy || rotates(model, b)))
            kmp_text_printf(&names, "%s%s", names.length > 0 ? ", " : "", model->bodies[b].name);
    if (names.length > 0)
        put_line(text, word, names.s);
    kmp_text_free_part(text, &names);
}

/* -- redundancy -------------------------------------------------------------------------------------- */

static void put_set(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_diagnosis *d = &check->diagnosis;
    list_rows(text, check->system, d->sets[k].count, d->sets[k].rows);
    if (d->sets[k].count == 1)
        kmp_text_put(text, " constrains nothing");
    if (d->moved)
        kmp_text_put(text, d->sets[k].always ? ": always" : ": only in this position");
}

static void show_shared(kmp_text *text, const kempe_check *check)
{
    const kmp_diagnosis *d = &check->diagnosis;
    kmp_text words = {0};
    if (d->loads.loaded) {
        (void)kmp_put_shared_loads(&words, check->system->model, &d->loads);
        put_words(text, "loads not unique", &words);
        words = (kmp_text){0};
    }
    if (d->shared_count == 0)
        return;
    list_rows(&words, check->system, d->shared_count, d->shared_rows);
    put_words(text, "reactions not unique", &words);
}

/* -- choice ------------------------------------------------------------------------------------------ */

/* The dependent coordinates that could, or could not, be independent instead. */
static void show_alternatives(kmp_text *text, const kempe_check *check, bool usable, const char *word)
{
    const kmp_diagnosis *d = &check->diagnosis;
    int listed = 0, left = 0;
    kmp_text words = {0};
    for (int k = 0; k < d->alternative_count; k++) {
        const kmp_alternative *a = &d->alternatives[k];
        if (a->independent || (a->max_b < USABLE) != usable)
            continue;
        if (listed == MOST_LISTED) {
            left++;
            continue;
        }
        kmp_text_printf(&words, "%s%s", listed++ ? ", " : "", name_of(check, a->coordinate));
        if (usable && check->part.p > 1)
            kmp_text_printf(&words, " for %s", name_of(check, a->instead));
        if (a->max_b < INFINITY)
            kmp_text_printf(&words, " (%.3g)", a->max_b);
    }
    if (left > 0)
        kmp_text_printf(&words, " and %d more", left);
    if (listed > 0)
        put_line(text, word, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
}

/* At most this number of names; nothing where no coordinate is independent. */
static void show_independent(kmp_text *text, const kempe_check *check, int most)
{
    const kmp_partition *part = &check->part;
    kmp_text names = {0};
    kmp_list_names(&names, check->system, kmp_name_of_coordinate, part->p < most ? part->p : most, part->u);
    if (part->p > most)
        kmp_text_printf(&names, " and %d more", part->p - most);
    if (part->p > 0)
        put_line(text, part->p == 1 ? "independent coordinate" : "independent coordinates", names.s ? names.s : "");
    kmp_text_free_part(text, &names);
}

/* States, on which no closure depends. */
static void show_states(kmp_text *text, const kempe_check *check)
{
    const kempe_model *model = check->given->model;
    kmp_text names = {0};
    for (int k = 0; k < model->state_count; k++)
        kmp_text_printf(&names, "%s%s", k ? ", " : "", model->states[k].name);
    if (model->state_count > 0)
        put_line(text, "states", names.s ? names.s : "");
    kmp_text_free_part(text, &names);
}

/* The equations of tyres by files. */
static void show_tyres(kmp_text *text, const kempe_check *check)
{
    for (int next = 0;;) {
        kmp_text form = {0};
        const bool found = kmp_tyres_put_forms(&form, check->given->model, &next);
        if (found)
            put_line(text, "tyres", form.s ? form.s : "");
        kmp_text_free_part(text, &form);
        if (!found)
            return;
    }
}

static void show_pivots(kmp_text *text, const kmp_partition *part)
{
    const int count = part->m < part->n ? part->m : part->n;
    kmp_text words = {0};
    for (int k = 0; k < count; k++)
        kmp_text_printf(&words, "%s%.3g",
                        k == 0         ? ""
                        : k == part->r ? " | "
                                       : " ",
                        part->pivots[k] > ROUNDING * part->pivots[0] ? part->pivots[k] : 0);
    if (count > 0)
        put_words(text, "pivots of scaled J", &words);
}

static void show_choice(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    kmp_text names = {0};
    kmp_text_put(text, "\n");
    show_independent(text, check, part->p);
    show_states(text, check);
    show_tyres(text, check);
    kmp_list_names(&names, check->system, kmp_name_of_coordinate, part->r, part->v);
    put_words(text, "dependent coordinates", &names);
    line(text, "reason", "%s",
         part->user     ? "these independent coordinates were requested"
         : part->r == 0 ? "the model has no loops: all coordinates are independent"
                        : "the other coordinates depend least on these");
    if (part->exchanges > 0)
        line(text, "", "after %d exchange%s of a pair whose |dv/du| was above 2", part->exchanges,
             ending(part->exchanges));
    show_pivots(text, part);
    line(text, "condition number of Jv", "%.3g", check->condition);
    line(text, "largest |dv/du|", "%.3g", part->max_b);
    show_alternatives(text, check, true, "alternatives (|dv/du|)");
    show_alternatives(text, check, false, "cannot be independent");
}

/* The coordinates in the order in which their positions are found, with the closures that determine them. */
static void show_blocks(kmp_text *text, const kempe_check *check)
{
    const kmp_diagnosis *d = &check->diagnosis;
    kmp_text words = {0};
    for (int b = 0; b < d->block_count; b++) {
        const kmp_loop_block *block = &d->blocks[b];
        kmp_text_put(&words, b ? "; " : "");
        kmp_list_names(&words, check->system, kmp_name_of_coordinate, block->size, block->columns);
        kmp_text_put(&words, " by ");
        kmp_list_names(&words, check->system, kmp_name_of_closure, block->closure_count, block->closures);
    }
    if (d->block_count > 0)
        put_line(text, "solved in this order", words.s ? words.s : "");
    kmp_text_free_part(text, &words);
}

/* -- limits of motion -------------------------------------------------------------------------------- */

/* The kinds of motions of coordinates in a cycle. */
enum { ROTATES, OSCILLATES, RESTS, SWINGS };

static int swing_of(const kempe_check *check, int k)
{
    const kmp_coordinate_range *s = &check->diagnosis.limits.range[k];
    return !s->moves ? RESTS : s->turns != 0 ? ROTATES : OSCILLATES;
}

/* ": O, A rotate fully; C, D oscillate": names of few coordinates, numbers of many. */
static void put_swings(kmp_text *text, const kempe_check *check)
{
    static const char *const words[SWINGS][2] = {
        {"rotates fully", "rotate fully"}, {"oscillates", "oscillate"}, {"does not move", "do not move"}};
    const int n = check->system->n;
    const char *before = ": ";
    for (int kind = 0; kind < SWINGS; kind++) {
        int count = 0;
        for (int k = 0; k < n; k++)
            count += swing_of(check, k) == kind;
        for (int k = 0, listed = 0; k < n && n <= MOST_LISTED; k++)
            if (swing_of(check, k) == kind)
                kmp_text_printf(text, "%s%s", listed++ > 0 ? ", " : before, name_of(check, k));
        if (n > MOST_LISTED && count > 0)
            kmp_text_printf(text, "%s%d", before, count);
        before = count > 0 ? "; " : before;
        if (count > 0)
            kmp_text_printf(text, " %s", words[kind][count > 1]);
    }
}

/* The ranges of at most this number of coordinates, or none. */
static void show_limits(kmp_text *text, const kempe_check *check, int most)
{
    const kmp_limits *l = &check->diagnosis.limits;
    kmp_text words = {0};
    kmp_text_put(&words, !l->walked ? (l->why_not ? l->why_not : "not followed")
                         : l->cycle ? "closed cycle"
                                    : l->ended);
    if (l->walked && l->cycle && check->system->n > most)
        put_swings(&words, check);
    if (l->walked && check->system->n > most)
        kmp_text_put(&words, "; ranges: --all");
    put_words(text, "range of motion", &words);
    if (!l->walked)
        return;
    int width = kmp_print_width(check->system, KMP_QUANTITY_Q);
    for (int k = 0; check->system->n <= most && k < check->system->n; k++) {
        kmp_text_printf(text, "%*s%-*s  ", TEXT_COLUMN, "", width, name_of(check, k));
        put_swing(text, check, k);
        kmp_text_put(text, "\n");
    }
    int u = check->part.u[0];
    for (int i = 0; i < l->limit_position_count; i++) {
        const kmp_limit_position *mark = &l->limit_position[i];
        if (mark->coordinate >= 0)
            continue;
        const char *name = name_of(check, u), *unit = kmp_print_unit(check->system, u);
        double at = kmp_print_value(check->system, u, mark->q[u]);
        if (mark->margin > 0)
            line(text, "near a change point", "at %s = %.6g %s (bifurcation)", name, at, unit);
        else
            line(text, "change point", "at %s = %.6g %s: branches of the motion meet (bifurcation)", name, at, unit);
    }
}

/* -- failed assembly --------------------------------------------------------------------------------- */

static void put_culprit(kmp_text *text, const kempe_check *check, int k)
{
    kmp_assembly_put_open(text, check->assembly, check->assembly->culprits[k]);
}

/* The parts that both forms begin with. False: there is no more to say. */
static bool show_begin(kmp_text *text, const kempe_check *check, item *cut)
{
    show_title(text, check);
    kmp_print_doubts(text, kmp_outcome_of(check->status), check->warnings);
    sentence(text, check, "unused parameters", write_unused);
    if (check->assembled)
        show_mobility(text, check);
    list(text, check, "loops closed at", "", check->system->model->cut_count, cut);
    int count = 0;
    while (shaped(check, count))
        count++;
    list(text, check, "mass by shapes", "", count, put_shaped);
    show_flexible(text, check);
    show_bare(text, check, "without inertia", true);
    show_bare(text, check, "without mass", false);
    show_threads(text, check);
    if (!check->assembled) {
        const kmp_shown gap = kmp_shown_as(check->system->context, "m");
        if (check->assembly->turned)
            line(text, "gap", "axes that should be parallel are turned by more than a right angle");
        else if (check->assembly->gap > 0)
            line(text, "gap", "the smallest gap found is %.6g %s", gap.factor * check->assembly->gap, gap.unit);
        else
            line(text, "gap", "the smallest angle found is %.4g deg", check->assembly->turn * 180 / acos(-1));
        list(text, check, "open loops", "", check->assembly->culprit_count, put_culprit);
        list(text, check, "lengths", "", check->obstacle.reach_count, put_reach);
        list(text, check, "held coordinates", "", check->obstacle.release_count, put_release);
    }
    return check->assembled;
}

/* Efficiencies of gears, and whether one holds its load. */
static void show_losses(kmp_text *text, const kempe_check *check)
{
    const kempe_model *model = check->system->model;
    for (const kmp_closure *c = model->closures; c < model->closures + model->closure_count; c++) {
        const double *e = c->gear ? c->gear->efficiency : NULL;
        if (e && (e[0] < 1 || e[1] < 1))
            line(text, "losses", "%s: efficiency %.4g, and %.4g where the second wheel drives%s", c->name, e[0], e[1],
                 e[1] > 0 ? "" : ": self-locking, the second wheel cannot drive");
    }
}

static void show_short(kmp_text *text, const kempe_check *check)
{
    show_losses(text, check);
    show_shared(text, check);
    show_independent(text, check, MOST_LISTED);
    show_states(text, check);
    show_tyres(text, check);
    show_limits(text, check, MOST_RANGES);
    line(text, "more", "removable constraints, alternatives, condition numbers: --all");
}

static void show_all(kmp_text *text, const kempe_check *check)
{
    show_losses(text, check);
    const kmp_diagnosis *d = &check->diagnosis;
    if (!d->ran)
        line(text, "not examined", "%s", d->why_not);
    list(text, check, "dependent sets", "", d->set_count, put_set);
    show_shared(text, check);
    if (d->repairs_skipped)
        line(text, "removable closures", "not examined: too many rows");
    list(text, check, "removable closures", "or", d->repair_count, put_repair);
    show_choice(text, check);
    show_blocks(text, check);
    kmp_text_put(text, "\n");
    show_limits(text, check, check->system->n);
}

static void show_parts(kmp_text *text, const kempe_check *check, bool all)
{
    if (show_begin(text, check, all ? put_cut_with_reason : put_cut))
        (all ? show_all : show_short)(text, check);
}

/* -- JSON ------------------------------------------------------------------------------------------------ */

/* Keys of the contract first; unknown numbers are null. */

static void json_rows(kmp_json *json, const char *key, const kempe_check *check, int count, const int *rows)
{
    kmp_print_names(json, key, check->system, kmp_name_of_row, count, rows);
}

/* A sentence as text, null when it is empty. */
static void json_sentence(kmp_json *json, const char *key, const kempe_check *check,
                          void (*write)(kmp_text *, const kempe_check *))
{
    kmp_text line = {0};
    write(&line, check);
    kmp_json_string(json, key, line.s && line.length > 0 ? line.s : NULL);
    kmp_text_free_part(json->text, &line);
}

static void json_redundancy(kmp_json *json, const kempe_check *check)
{
    const kmp_diagnosis *d = &check->diagnosis;
    kmp_json_array(json, "dependent");
    for (int k = 0; k < d->set_count; k++) {
        kmp_json_object(json, NULL);
        json_rows(json, "rows", check, d->sets[k].count, d->sets[k].rows);
        kmp_json_put(json, "when %s }", !d->moved ? NULL : d->sets[k].always ? "always" : "here");
    }
    kmp_json_end(json);
    json_rows(json, "reactions_not_unique", check, d->shared_count, d->shared_rows);
    /* Components of loads that are not unique, by joint and loop; none where they are zero in all joints. */
    kmp_text text = {0};
    if (check->diagnosis.loads.loaded)
        (void)kmp_put_shared_loads(&text, check->system->model, &check->diagnosis.loads);
    kmp_json_string(json, "loads_not_unique", text.s ? text.s : "");
    kmp_text_free_part(json->text, &text);
    kmp_json_array(json, "repairs");
    for (int k = 0; k < d->repair_count; k++) {
        kmp_json_put(json, "{ closure %s may_lose %d of %d", kmp_name_of_closure(check->system, d->repairs[k].closure),
                     d->repairs[k].count, d->repairs[k].of);
        json_rows(json, "rows", check, d->repairs[k].count, d->repairs[k].rows);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void json_assembled(kmp_json *json, const kempe_check *check)
{
    kmp_json_put(json, "nbody %d nq %d nh %d", check->body_count, check->part.n, check->part.m);
    const kmp_partition *part = &check->part;
    kmp_json_put(json, "rank %d dof %d driven %d undetermined %s", part->r, part->p, check->driven,
                 check->undetermined);
    json_rows(json, "redundant", check, part->m - part->r, part->redundant);
    kmp_print_names(json, "u", check->system, kmp_name_of_coordinate, part->p, part->u);
    kmp_print_names(json, "v", check->system, kmp_name_of_coordinate, part->r, part->v);
    kmp_json_put(json, "cond_Jv %g max_B %g exchanges %d", check->condition, part->max_b, part->exchanges);
    kmp_json_numbers(json, "pivots", part->m < part->n ? part->m : part->n, part->pivots);
    const kmp_diagnosis *d = &check->diagnosis;
    kmp_json_array(json, "blocks");
    for (int b = 0; b < d->block_count; b++)
        kmp_print_names(json, NULL, check->system, kmp_name_of_coordinate, d->blocks[b].size, d->blocks[b].columns);
    kmp_json_put(json, "] block_closures [");
    for (int b = 0; b < d->block_count; b++)
        kmp_print_names(json, NULL, check->system, kmp_name_of_closure, d->blocks[b].closure_count,
                        d->blocks[b].closures);
    kmp_json_end(json);
    kmp_json_whole(json, "loops", check->loop_count);
    static const char *const words[] = {NULL, "real", "branches", "shaky", "conditions"};
    kmp_json_put(json, "mobility { dof %d driven %d counted %d generic_dof %g declared_rows %d margin %g",
                 check->part.p, check->driven, check->part.n - check->part.m,
                 d->moved || check->part.p == 0 ? (double)(check->part.n - d->generic_rank) : (double)NAN, d->declared,
                 d->margin);
    json_sentence(json, "explanation", check, check_mobility);
    if (check->system->model->flexible_count > 0)
        json_sentence(json, "by_elasticity", check, put_elastic_mobility);
    kmp_json_put(json, "second_order %s branches %g }", words[d->second],
                 d->second == KMP_SECOND_BRANCHES ? (double)d->branches : (double)NAN);
    json_redundancy(json, check);
    kmp_json_array(json, "alternatives");
    for (int k = 0; k < check->diagnosis.alternative_count; k++) {
        const kmp_alternative *a = &check->diagnosis.alternatives[k];
        kmp_json_put(json, "{ coordinate %s instead_of %s max_B %g }", name_of(check, a->coordinate),
                     name_of(check, a->instead), a->max_b);
    }
    kmp_json_end(json);
    const kmp_limits *l = &check->diagnosis.limits;
    kmp_json_put(json, "limits { walked %d cycle %d reason %s range {", l->walked, l->cycle,
                 l->walked ? l->ended : l->why_not);
    for (int k = 0; l->walked && k < check->system->n; k++) {
        const kmp_coordinate_range *range = &l->range[k];
        kmp_json_put(json, "%s { low %g high %g turns %d low_dead_centre %d high_dead_centre %d }", name_of(check, k),
                     range->low, range->high, range->turns, range->low_dead, range->high_dead);
    }
    kmp_json_put(json, "} met [");
    for (int i = 0; i < l->limit_position_count; i++) {
        const kmp_limit_position *mark = &l->limit_position[i];
        kmp_json_put(json, "{ what %s coordinate %s margin %g", mark->coordinate >= 0 ? "dead centre" : "change point",
                     name_of(check, mark->coordinate), mark->margin);
        kmp_print_entries(json, "q", check->system, KMP_QUANTITY_Q, mark->q);
        kmp_json_end(json);
    }
    kmp_json_put(json, "] }");
}

static void json_obstacle(kmp_json *json, const kempe_check *check)
{
    const kempe_assembly *a = check->assembly;
    kmp_json_put(json, "nbody %d nq %d nh %d loops %d", check->body_count, check->system->n, check->system->m,
                 check->loop_count);
    kmp_json_put(json, "rank %g dof %g cond_Jv %g max_B %g redundant [ ] u [ ] v [ ] blocks [ ] gap %g turn %g", NAN,
                 NAN, NAN, NAN, a->gap, a->turn);
    kmp_print_names(json, "culprits", check->system, kmp_name_of_closure, a->culprit_count, a->culprits);
    const kmp_obstacle *o = &check->obstacle;
    kmp_json_array(json, "releases");
    for (int k = 0; k < o->release_count; k++) {
        const kmp_release *release = &o->releases[k];
        kmp_json_put(json, "{ coordinate %s closes %d to %g }", name_of(check, release->coordinate), release->closes,
                     release->closes ? release->to : NAN);
    }
    kmp_json_put(json, "] too_short [");
    for (int k = 0; k < check->obstacle.reach_count; k++) {
        const kmp_short_links *reach = &check->obstacle.reaches[k];
        kmp_json_put(json, "{ closure %s longest %g others %g }", kmp_name_of_closure(check->system, reach->closure),
                     reach->longest, reach->others);
    }
    kmp_json_end(json);
}

static void show_json(kmp_text *text, const void *result)
{
    const kempe_check *check = result;
    kmp_json j = kmp_print_head(text, check->system, kmp_outcome_of(check->status), check->reason,
                                check->system->build_s, check->warnings);
    json_sentence(&j, "verdict", check, check_verdict);
    if (check->assembled)
        json_assembled(&j, check);
    else
        json_obstacle(&j, check);
    const kempe_model *model = check->system->model;
    kmp_json_array(&j, "cuts");
    for (int k = 0; k < model->cut_count; k++) {
        const kmp_cut *cut = &model->cuts[k];
        kmp_json_object(&j, NULL);
        kmp_model_json_cut(&j, cut);
        kmp_json_end(&j);
    }
    kmp_json_end(&j);
    /* Bodies whose mass follows from their shapes, where there are any. */
    int count = 0;
    for (int b = 1; b < model->body_count; b++) {
        if (!model->bodies[b].by_shape)
            continue;
        if (count++ == 0)
            kmp_json_array(&j, "mass_by_shapes");
        kmp_json_put(&j, "{ body %s", model->bodies[b].name);
        kmp_model_json_mass(&j, model, b);
        kmp_json_end(&j);
    }
    if (count > 0)
        kmp_json_end(&j);
    json_flexible(&j, check);
    json_threads(&j, check);
    kmp_print_unused_json(&j, check->system->model);
    kmp_json_end(&j);
}

KMP_PRINT_FULL(kempe_check, check, check->system->context, show_json, show_parts)

/* -- tables ------------------------------------------------------------------------------------------- */

static void fill_mobility(kempe_table *table, const void *result)
{
    const kempe_check *check = result;
    const kmp_partition *part = &check->part;
    const kmp_diagnosis *d = &check->diagnosis;
    bool generic = d->moved || part->p == 0;
    kmp_tabulate_columns(table, "bodies coordinates closures rows rank dof driven generic_dof cond_Jv max_B margin");
    KMP_TABULATE(table, "%d %d %d %d", check->body_count, check->system->n, check->loop_count, check->system->m);
    if (check->assembled)
        kmp_tabulate_cells(table, "%d %d %d %g %g %g %g", part->r, part->p, check->driven,
                           generic ? (double)(part->n - d->generic_rank) : (double)NAN, check->condition, part->max_b,
                           d->margin);
}

static const kmp_alternative *alternative_of(const kempe_check *check, int coordinate)
{
    for (int k = 0; k < check->diagnosis.alternative_count; k++)
        if (check->diagnosis.alternatives[k].coordinate == coordinate)
            return &check->diagnosis.alternatives[k];
    return NULL;
}

static const char *role_of(const kmp_partition *part, int coordinate)
{
    for (int k = 0; k < part->p; k++)
        if (part->u[k] == coordinate)
            return "independent";
    return "dependent";
}

static void fill_coordinates(kempe_table *table, const void *result)
{
    const kempe_check *check = result;
    const kmp_limits *l = &check->diagnosis.limits;
    kmp_tabulate_columns(table, "coordinate[words] unit[words] role[words] instead_of[words] max_B low high turns "
                                "low_dead_centre high_dead_centre");
    for (int k = 0; k < check->system->n; k++) {
        const kmp_alternative *a = alternative_of(check, k);
        KMP_TABULATE(table, "%s %s %s %s %g", kmp_name_of_coordinate(check->system, k),
                     kmp_print_unit(check->system, k), check->assembled ? role_of(&check->part, k) : "",
                     a && a->instead >= 0 ? kmp_name_of_coordinate(check->system, a->instead) : "", a ? a->max_b : NAN);
        if (!check->assembled || !l->walked)
            continue;
        const kmp_coordinate_range *s = &l->range[k];
        kmp_tabulate_cells(table, "%g %g %d %d %d", kmp_print_value(check->system, k, s->low),
                           kmp_print_value(check->system, k, s->high), s->turns, s->low_dead, s->high_dead);
    }
}

/* The number of rows of a closure, of all or of the redundant ones. */
static int count_rows(const kempe_check *check, int closure, bool redundant)
{
    const kmp_partition *part = &check->part;
    int count = 0;
    for (int k = 0; k < (redundant ? part->m - part->r : check->system->m); k++)
        count += check->system->rows[redundant ? part->redundant[k] : k].closure == closure;
    return count;
}

static void fill_closures(kempe_table *table, const void *result)
{
    const kempe_check *check = result;
    kmp_tabulate_columns(table, "closure[words] kind[words] rows redundant may_lose gap turn");
    for (int c = 0; c < check->loop_count; c++) {
        const kmp_diagnosis *d = &check->diagnosis;
        int may_lose = 0;
        for (int k = 0; check->assembled && k < d->repair_count; k++)
            may_lose = d->repairs[k].closure == c ? d->repairs[k].count : may_lose;
        KMP_TABULATE(table, "%s %s %d %g %g %g %g", kmp_name_of_closure(check->system, c),
                     kmp_closure_word(&check->system->model->closures[c]), count_rows(check, c, false),
                     check->assembled ? (double)count_rows(check, c, true) : (double)NAN,
                     check->assembled ? (double)may_lose : (double)NAN, check->assembly->gaps[c],
                     check->assembly->turns[c]);
    }
}

KMP_TABLES(kempe_check, check, check->system->context, {"mobility", fill_mobility}, {"coordinates", fill_coordinates},
           {"closures", fill_closures})
