/* SPDX-License-Identifier: BSD-3-Clause */
/* Making and freeing an assembly, and messages about the closures that stay open. */
#include "constraints/closing/assembly.h"
#include "base/arena.h"
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "base/wings.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/cut_start.h"
#include "constraints/closing/rounding.h"
#include "constraints/closing/shaft_angles.h"
#include "constraints/closing/start_gaps.h"
#include "constraints/closing/static_start.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/tolerances.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/start.h"
#include "model/write/model_print.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { PUSHES = 4, MOST_NAMED = 5 };
#define SMALL_PART 1e-3 /* of an opening: not printed */

/* -- open loops -------------------------------------------------------------------------------------- */

double kmp_assembly_extent(const kempe_assembly *a, int c)
{
    return hypot(a->gaps[c], a->turns[c] * a->system->length);
}

/* "0.01 m and 3 deg"; a part that is small compared with the other is left out. */
static void put_opening(kmp_text *text, const kempe_assembly *a, int c)
{
    double arc = a->turns[c] * a->system->length;
    bool gap = !(a->gaps[c] < SMALL_PART * arc), turn = arc > 0 && !(arc < SMALL_PART * a->gaps[c]);
    if (gap)
        kmp_text_printf(text, "%.4g m", a->gaps[c]);
    if (turn)
        kmp_text_printf(text, "%s%.4g deg", gap ? " and " : "", a->turns[c] * 180 / acos(-1));
}

void kmp_assembly_put_open(kmp_text *text, const kempe_assembly *a, int c)
{
    kmp_text_printf(text, "'%s'", a->system->model->closures[c].name);
    if (isfinite(kmp_assembly_extent(a, c))) {
        kmp_text_put(text, " by ");
        put_opening(text, a, c);
    }
}

/* Appends the closure tolerance to the message about a closure, if it was set or could be the cause. */
static void put_tolerance(kmp_text *text, const kempe_assembly *a, int c)
{
    const kempe_system *s = a->system;
    double extent = kmp_assembly_extent(a, c);
    if (!s->model->closure_tolerance_given && !(extent <= KMP_ROUNDING_WIDEST * s->closure_tolerance))
        return;
    if (a->turns[c] * s->length > SMALL_PART * a->gaps[c])
        kmp_text_printf(text, ", with its arc %.4g m", extent);
    if (extent > s->closure_tolerance)
        kmp_text_printf(text, ", more than the closure_tolerance of %.3g m", s->closure_tolerance);
    else
        kmp_text_printf(text, ", within the closure_tolerance of %.3g m, but %s", s->closure_tolerance,
                        s->strict ? "rounding of the last digit of the model's numbers does not explain it (give a "
                                    "closure_tolerance to let it stay open)"
                                  : "no other closure implies it");
}

/* More drives than degrees of freedom, by name. */
static kempe_status complain_drives(const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    const kmp_closure *last = model->closures;
    kmp_text names = {0};
    for (int c = 0, count = 0; c < model->closure_count; c++)
        if (kmp_closure_is_drive(&model->closures[c])) {
            last = &model->closures[c];
            kmp_text_printf(&names, "%s'%s'", count++ ? ", " : "", last->name);
        }
    (void)kmp_complain(
        a->system->context, model->source.files[last->place.file], last->place.line, last->place.column,
        "the drives %s prescribe %d motions, but the mechanism has %d degree%s of freedom: leave out the "
        "drives that follow from the others",
        names.s ? names.s : "", a->drives, a->freedoms, a->freedoms == 1 ? "" : "s");
    kmp_text_free(&names);
    return KEMPE_E_FAILED;
}

/* A drive that the start contradicts, since it holds the coordinate elsewhere; -1: there is none. */
static int contradicted_drive(const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    for (int k = 0; k < a->culprit_count; k++) {
        const kmp_closure *c = &model->closures[a->culprits[k]];
        if (kmp_closure_is_drive(c) && c->function && c->motion >= 0 && model->start.hold[c->motion] &&
            isfinite(kmp_assembly_extent(a, a->culprits[k])))
            return a->culprits[k];
    }
    return -1;
}

static kempe_status complain_contradicted(const kempe_assembly *a, int drive)
{
    const kempe_model *model = a->system->model;
    const kmp_closure *c = &model->closures[drive];
    const char *name = model->motions[c->motion].name;
    kmp_text why = {0};
    kmp_text_printf(&why, "drive '%s' begins ", c->name);
    put_opening(&why, a, drive);
    kmp_text_printf(&why,
                    " away from the start of '%s', which is held there: give both one value at t = 0, or withdraw the "
                    "start of an included file (%s: null)",
                    name, name);
    (void)kmp_complain(a->system->context, model->source.files[c->place.file], c->place.line, c->place.column, "%s",
                       why.s ? why.s : "");
    kmp_text_free(&why);
    return KEMPE_E_FAILED;
}

static kempe_status complain_open(const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    const int drive = contradicted_drive(a);
    if (drive >= 0)
        return complain_contradicted(a, drive);
    if (a->culprit_count == 0)
        return kmp_fail(a->system->context, KEMPE_E_FAILED,
                        "the start cannot be computed: numbers of the model are too large, and their squares overflow");
    int first = a->culprits[0], held = 0;
    const kmp_closure *worst = &model->closures[first];
    bool turned = a->turned && a->turns[first] > acos(0), measured = isfinite(kmp_assembly_extent(a, first));
    kmp_text why = {0};
    kmp_text_printf(&why, "loop '%s' cannot be closed", worst->name);
    for (int k = 0; k < model->motion_count; k++)
        if (model->start.hold[k])
            kmp_text_printf(&why, "%s%s", held++ ? ", " : " while holding ", model->motions[k].name);
    if (turned)
        kmp_text_printf(&why, ": the axes of its points are %.4g deg from parallel", a->turns[first] * 180 / acos(-1));
    else if (measured) {
        kmp_text_put(&why, ": the smallest gap found is ");
        put_opening(&why, a, first);
    }
    for (int k = 1; measured && k < a->culprit_count && k <= MOST_NAMED; k++) {
        kmp_text_put(&why, k > 1 ? ", " : "; other open loops: ");
        kmp_assembly_put_open(&why, a, a->culprits[k]);
    }
    if (measured && a->culprit_count > MOST_NAMED + 1)
        kmp_text_printf(&why, " and %d more", a->culprit_count - MOST_NAMED - 1);
    if (measured && !turned)
        put_tolerance(&why, a, first);
    kmp_text_printf(&why, "%s from a better guess",
                    turned     ? "; turn the axes of one of them, or start"
                    : measured ? "; check its lengths, or start"
                               : ": its gap is not a number there; start");
    (void)kmp_complain(a->system->context, model->source.files[worst->place.file], worst->place.line,
                       worst->place.column, "%s", why.s ? why.s : "");
    kmp_text_free(&why);
    return KEMPE_E_FAILED;
}

/* Reports the goal that is farthest, by its part of the distance. */
static kempe_status complain_goals(const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    const kmp_goal *worst = NULL;
    double most = -1, off = 0;
    for (int k = 0, at = 0; k < model->start.goal_count; k++) {
        const kmp_goal *goal = &model->start.goals[k];
        double scale = goal->motion >= 0 ? a->system->scale[goal->motion] : a->system->length, sum = 0, part = 0;
        for (int i = 0; i < goal->width; i++, at++) {
            double left = a->goals.value[at] - goal->value[i].value;
            sum = hypot(sum, left);
            part = hypot(part, sqrt(goal->weight[i].value) * left / scale);
        }
        if (part > most) {
            most = part;
            worst = goal;
            off = sum;
        }
    }
    kmp_text name = {0};
    kmp_model_put_goal(&name, model, worst);
    (void)kmp_fail(a->system->context, KEMPE_E_FAILED,
                   "the loops are closed, but the goals are not reached: the search stopped after %d steps at a "
                   "singular position (%.2g), where '%s' differs by %.4g; use another guess",
                   a->goals.steps, a->goals.slope, name.s ? name.s : "", off);
    kmp_text_free(&name);
    return KEMPE_E_FAILED;
}

/* Least difference of an entry of a rotation by a quarter turn about any axis. */
#define QUARTER_TURN 0.91

kempe_assembly *kmp_assembly_new(const kempe_system *s)
{
    int closures = s->model->closure_count;
    kempe_assembly *a = KMP_NEW(kempe_assembly, 1);
    if (!a)
        return NULL;
    a->system = s;
    KMP_ARENA_MAKE(&a->arena, KMP_ROOM(double, closures, &a->gaps, &a->turns), KMP_ROOM(double, s->m, &a->open),
                   KMP_ROOM(double, s->m + s->n, &a->pivots), KMP_ROOM(int, closures, &a->culprits),
                   KMP_ROOM(bool, s->m, &a->dropped), KMP_ROOM(kmp_loose_start, s->model->force_count, &a->loose));
    for (int k = 0; k < s->model->start.goal_count; k++)
        a->goals.count += s->model->start.goals[k].width;
    a->goals.value = KMP_ARENA_NEW(&a->arena, double, a->goals.count);
    if (KMP_ARENA_EACH(&a->arena, double, s->n, &a->q, &a->qd, &a->moved))
        return a;
    kempe_assembly_free(a);
    return NULL;
}

/* -- rounded numbers --------------------------------------------------------------------------------- */

/* Number of pivots of J above `part` of the first. Pivots between rounding and the pivots of an ordinary mechanism
 * are doubtful. */
static int count_pivots(const kempe_assembly *a, double part)
{
    int m = a->system->m, n = a->system->n, count = 0;
    while (count < m && count < n && a->pivots[count] > part * a->pivots[0])
        count++;
    return count;
}

/* True if the loops do not close as given, or close with pivots that may be due to rounding. */
static bool is_doubtful(const kempe_assembly *a)
{
    const kempe_system *s = a->system;
    /* Deformations are small, and so are pivots that are due to them. */
    if (s->model->flexible_count > 0)
        return false;
    if (s->m == 0 || s->strict || !(s->closure_tolerance > 0) || !(a->pivots[0] > KMP_RANK_FIRST))
        return false;
    if (a->closed)
        return count_pivots(a, KMP_ROUNDING_WEAK) < count_pivots(a, KMP_ROUNDING_NOTHING);
    return a->residual * s->length <= KMP_ROUNDING_WIDEST * s->closure_tolerance;
}

/* Assembles with a given rank, and tries whether its open rows stay within the tolerance. *as: the assembly; NULL:
 * there is none, or it is the strict one. */
static kempe_status try_rank(const kempe_assembly *strict, const kmp_guess *guess, int rank, kmp_rounding_trial *trial,
                             kempe_assembly **as)
{
    const kempe_system *s = strict->system;
    kmp_guess given = {guess->q, guess->hold, guess->pushes, false, rank};
    kempe_assembly *a = NULL;
    *as = NULL;
    *trial = (kmp_rounding_trial){.rank = rank, .tolerance = s->closure_tolerance / s->length};
    kempe_status status = kmp_assemble_from(s, &given, &a);
    if (status != KEMPE_OK || !a)
        return status;
    bool same = strict->closed && rank == count_pivots(strict, KMP_RANK) && a->misfit <= KMP_CLOSED_ENOUGH;
    trial->dropped = a->dropped;
    if (a->closed && !same && !kmp_rounding_try(trial, s, a->inner_q ? a->inner_q : a->q, a->chart))
        status = kmp_fail_memory(s->context);
    return KMP_GIVE_IF(status == KEMPE_OK && a->closed && !same, status, as, a, kempe_assembly_free);
}

/* Tries the largest rank above `least`, up to `most`, that differs from the rank of the strict assembly. If its other
 * rows open, no smaller rank can hold: its configurations are among the configurations of smaller ranks, whose other
 * rows include its own. */
static kempe_status try_largest(const kempe_assembly *strict, const kmp_guess *guess, int least, int most,
                                bool *refuted)
{
    kempe_status status = KEMPE_OK;
    kempe_assembly *a = NULL;
    kmp_rounding_trial trial;
    *refuted = false;
    for (int rank = most; status == KEMPE_OK && !a && rank > least; rank--) {
        status = try_rank(strict, guess, rank, &trial, &a);
        *refuted = a && trial.refuted;
    }
    kempe_assembly_free(a);
    return status;
}

/* Finds the smallest rank whose other rows stay within the tolerance in all configurations, if there is one: *a is then
 * the state with these rows open. */
static kempe_status look_for_rounding(const kempe_system *s, const kmp_guess *guess, kempe_assembly **a)
{
    kempe_assembly *found = NULL;
    if (!is_doubtful(*a))
        return KEMPE_OK;
    int least = count_pivots(*a, KMP_ROUNDING_WEAK), most = count_pivots(*a, KMP_ROUNDING_NOTHING);
    bool refuted;
    most = most < s->m ? most : s->m - 1;
    kempe_status status = try_largest(*a, guess, least, most, &refuted);
    for (int rank = least; !found && !refuted && status == KEMPE_OK && rank <= most; rank++) {
        kmp_rounding_trial trial;
        status = try_rank(*a, guess, rank, &trial, &found);
        if (found && trial.holds)
            kmp_rounding_keep(s, &trial);
        if (found && !trial.holds) {
            kempe_assembly_free(found);
            found = NULL;
        }
    }
    if (!found || status != KEMPE_OK)
        return status;
    kempe_assembly_free(*a);
    *a = found;
    if (s->model->start.goal_count == 0)
        return KEMPE_OK;
    *a = NULL;
    kempe_assembly_free(found);
    return kmp_assemble_from(s, guess, a);
}

bool kmp_assembly_changed_rate(const kempe_assembly *a, int k)
{
    const kmp_start *start = &a->system->model->start;
    double given = start->qd[k].value, size = 0;
    for (int i = 0; i < a->system->n; i++)
        size = fmax(size, fabs(start->qd[i].value) / a->system->scale[i]);
    return a->rates_changed && start->qd_given[k] &&
           fabs(a->qd[k] - given) > KMP_CLOSED_RATES * size * a->system->scale[k];
}

void kmp_assembly_put_rates(kmp_text *text, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    for (int k = 0; k < a->system->n; k++) {
        kmp_shown as = kmp_shown_as(a->system->context, model->motions[k].rotation ? "rad/s" : "m/s");
        if (kmp_assembly_changed_rate(a, k))
            kmp_text_printf(
                text, "start: the rate of '%s' is adjusted to %.6g %s (given: %.6g) to satisfy the closures\n",
                model->motions[k].name, as.factor * a->qd[k], as.unit, as.factor * model->start.qd[k].value);
    }
}

int kmp_assembly_put_loose(kmp_text *text, const kempe_assembly *a, kmp_loose_start start)
{
    const kempe_model *model = a->system->model;
    int count = 0;
    for (int k = 0; k < model->force_count; k++)
        if (model->forces[k].centred[0] && a->loose[k] == start)
            kmp_text_printf(text, "%s'%s'", count++ ? ", " : "", model->forces[k].name);
    return count;
}

/* By how much a coordinate with a given start has moved: of an angle in quarter turns, of a translation in
 * characteristic lengths, of the first angle of a spherical joint of its rotation, as its matrix shows it. */
static double given_move(const kempe_assembly *a, int k, const double *given)
{
    const kempe_system *s = a->system;
    const bool *is_given = s->model->start.q_given;
    const int chart = kmp_chart_of(s, k);
    if (chart >= 0 && s->chart_first[chart] == k && (is_given[k] || is_given[k + 1] || is_given[k + 2]))
        return kmp_chart_apart(s, chart, given, a->q) / QUARTER_TURN;
    if (chart >= 0 || !is_given[k])
        return 0;
    return s->model->motions[k].rotation ? fabs(remainder(a->moved[k], 4 * acos(0))) / acos(0)
                                         : fabs(a->moved[k]) / s->length;
}

void kmp_assembly_put_moves(kmp_text *text, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    double most = 1, *given = KMP_NEW(double, a->system->n);
    int worst = -1;
    for (int k = 0; given && k < a->system->n; k++)
        given[k] = model->start.q[k].value;
    for (int k = 0; given && k < kmp_model_coordinates(model); k++) {
        const double moved = given_move(a, k, given);
        worst = moved > most ? k : worst;
        most = fmax(most, moved);
    }
    kmp_free(given);
    if (!a->closed || a->goals.end != KMP_GOALS_NONE)
        return;
    if (a->searched > 0)
        kmp_text_printf(
            text,
            "start: the loop of '%s' has no start value, and is closed by search: give start values if another "
            "assembly mode is meant\n",
            model->motions[a->searched - 1].name);
    if (worst < 0)
        return;
    const bool ball = kmp_chart_of(a->system, worst) >= 0, turns = model->motions[worst].rotation;
    kmp_text_printf(
        text,
        "start: closing the loops moves '%s' by %s%.4g %s from its guess: check that this is the assembly mode that "
        "you want, or give a better guess\n",
        model->motions[worst].name, ball ? "more than " : "",
        ball    ? 90
        : turns ? 90 * most
                : most * a->system->length,
        turns ? "deg" : "m");
}

/* Warns of changed rates and far moves, in every computation from this start. */
static kempe_status warn_of_changes(const kempe_assembly *a)
{
    kmp_text lines = {0};
    kmp_assembly_put_moves(&lines, a);
    kmp_assembly_put_rates(&lines, a);
    const bool known = kmp_context_is_quiet(a->system->context) || kmp_put_start_gaps(&lines, a->system, a->q);
    for (const char *at = lines.s ? lines.s : ""; *at; at += strcspn(at, "\n") + 1)
        kmp_log(a->system->context, KEMPE_LOG_WARNING, "%.*s", (int)strcspn(at, "\n"), at);
    kempe_status status = lines.failed || !known ? kmp_fail_memory(a->system->context) : KEMPE_OK;
    kmp_text_free(&lines);
    return status;
}

/* Warns where a start value of a cut joint is far from what closed loops allow. */
static kempe_status warn_of_cut(const kempe_assembly *a)
{
    bool rate;
    double value;
    int k = kmp_cut_start_missed(a->system, a->q, a->qd, &rate, &value);
    if (k == -2)
        return kmp_fail_memory(a->system->context);
    if (k < 0)
        return KEMPE_OK;
    const kmp_cut_coordinate *c = &a->system->model->cut_coordinates[k];
    kmp_shown as = kmp_shown_as(a->system->context, c->rotation ? (rate ? "rad/s" : "rad") : rate ? "m/s" : "m");
    kmp_log(a->system->context, KEMPE_LOG_WARNING,
            "start: %s of the cut joint '%s' is %.6g %s where the loops are closed (given: %.6g); %s",
            rate ? "the rate" : "the coordinate", c->name, as.factor * value, as.unit,
            as.factor * (rate ? c->qd : c->q).value,
            rate ? "give the rates that you want of other joints, or 'cut: no'"
                 : "check that this is the assembly mode that you want, or give a better guess");
    return KEMPE_OK;
}

/* Once more with deformations that were held, where joints cannot close the loops. `hold`: room for n. */
static kempe_status free_deformation(const kempe_system *system, kmp_guess *guess, bool *hold, kempe_assembly **a)
{
    const kmp_start *start = &system->model->start;
    if (!start->undeformed || (*a)->closed)
        return KEMPE_OK;
    kempe_assembly_free(*a);
    *a = NULL;
    for (int k = 0; k < system->n; k++)
        hold[k] = start->hold[k] && !start->undeformed[k];
    guess->hold = hold;
    KMP_TRY(kmp_assemble_from(system, guess, a));
    if (*a)
        (*a)->deformed = (*a)->closed;
    return KEMPE_OK;
}

kempe_status kmp_assemble_start(const kempe_system *system, kempe_assembly **assembly)
{
    const kmp_start *start = &system->model->start;
    kempe_assembly *a = NULL;
    double *q = KMP_NEW(double, system->n);
    bool *hold = KMP_NEW(bool, system->n);
    for (int k = 0; q && k < system->n; k++)
        q[k] = start->q[k].value;
    if (q && !kmp_cut_start_guess(system, start->hold, q)) {
        kmp_free(q);
        q = NULL;
    }
    kmp_guess guess = {q, start->hold, PUSHES, true, 0};
    kempe_status status = q && hold ? kmp_assemble_from(system, &guess, &a) : kmp_fail_memory(system->context);
    if (status == KEMPE_OK && a)
        status = free_deformation(system, &guess, hold, &a);
    if (status == KEMPE_OK && a && !kmp_rounding_is_known(system)) {
        status = look_for_rounding(system, &guess, &a);
        if (status == KEMPE_OK && !kmp_rounding_of(system))
            kmp_rounding_keep_none(system);
    }
    for (int k = 0; a && k < system->n; k++)
        a->moved[k] = a->q[k] - start->q[k].value;
    kmp_free(q);
    kmp_free(hold);
    return KMP_GIVE_OR_FREE(status, assembly, a, kempe_assembly_free);
}

/* Warns of the row with the largest remaining gap, if the numbers were set after the system was made. */
static void report_misfit(const kempe_assembly *a)
{
    const kempe_system *s = a->system;
    int worst = -1;
    for (int r = 0; r < s->m; r++)
        if (a->dropped[r] && a->open[r] > (worst < 0 ? KMP_CLOSED_ENOUGH : a->open[worst]))
            worst = r;
    if (worst >= 0)
        kmp_log(s->context, KEMPE_LOG_WARNING,
                "constraint equation %s is open by %.2g m, accepted as rounding of the model's numbers "
                "(closure_tolerance %.2g m)",
                s->row_names[worst], a->open[worst] * s->length, s->closure_tolerance);
}

/* Names the deformation that moved most. */
static void warn_of_deformation(const kempe_assembly *a)
{
    const kempe_system *s = a->system;
    const kmp_start *start = &s->model->start;
    int most = -1;
    for (int k = 0; a->deformed && k < s->n; k++)
        if (start->undeformed[k] &&
            (most < 0 || fabs(a->moved[k] / s->scale[k]) > fabs(a->moved[most] / s->scale[most])))
            most = k;
    if (most >= 0)
        kmp_log(s->context, KEMPE_LOG_WARNING,
                "start: the joints cannot close the loops, so that deformations take part, '%s' by %.2g %s; give "
                "better guesses of joints, or 'elastic: free' if this is meant",
                s->model->motions[most].name, a->moved[most], s->model->motions[most].rotation ? "rad" : "m");
}

kempe_status kmp_assembly_as_given(const kempe_system *system, kempe_assembly **assembly)
{
    kempe_assembly *a = NULL;
    bool known = kmp_rounding_of(system);
    kmp_context_clear(system->context);
    kempe_status status = kmp_assemble_start(system, &a);
    if (status != KEMPE_OK || !a)
        return status;
    *assembly = a;
    if (!a->closed && !isfinite(a->residual))
        KMP_TRY(kmp_shafts_refuse(system, a->q));
    if (!a->closed)
        return a->drives > a->freedoms && a->freedoms > 0 ? complain_drives(a) : complain_open(a);
    KMP_TRY(kmp_shafts_refuse(system, a->q));
    if (!system->model->start.at) /* deformations are part of an equilibrium */
        KMP_TRY(kmp_static_start(system, a));
    if (!known)
        report_misfit(a);
    warn_of_deformation(a);
    KMP_TRY(warn_of_changes(a));
    KMP_TRY(warn_of_cut(a));
    return a->goals.end == KMP_GOALS_SINGULAR ? complain_goals(a) : KEMPE_OK;
}

kempe_status kmp_assembly_at_start(const kempe_system *system, kempe_assembly **assembly)
{
    KMP_TRY(kmp_assembly_as_given(system, assembly));
    for (const kmp_wing *const *wing = kmp_wings; *assembly && system->model->start.at && *wing; wing++)
        if ((*wing)->balance)
            return (*wing)->balance(system, *assembly);
    return KEMPE_OK;
}

/* Notes the first condition by which a run would end at its start. */
static kempe_status judge_ends(kempe_assembly *a)
{
    const kempe_system *s = a->system;
    kmp_evaluator *eval = kmp_eval_new_for(s, "tape", NULL, KMP_EVAL_WEIGHS);
    KMP_TRY(kmp_made(s->context, eval));
    int from = 0;
    const int k = kmp_eval_next_end(eval, KMP_ENDS_OF_MODEL, 0, a->q, a->qd, NULL, NULL, &from);
    kmp_text text = {0};
    if (k >= 0)
        kmp_put_end(&text, s, k, 0);
    a->ended = k < 0 ? NULL : kmp_arena_printf(&a->arena, KMP_RUN_WOULD_END, text.s ? text.s : "");
    kmp_text_free(&text);
    kmp_eval_doubt_ends(eval, KMP_ENDS_OF_MODEL, 0, a->q, a->qd, NULL, NULL);
    kmp_eval_free(eval);
    return a->arena.failed ? kmp_fail_memory(s->context) : a->ended ? KEMPE_UNTRUSTED : KEMPE_OK;
}

kempe_status kempe_assembly_new(const kempe_system *system, kempe_assembly **assembly)
{
    KMP_WANTED_BOTH(system, assembly);
    KMP_TRY(kmp_assembly_at_start(system, assembly));
    return *assembly && system->events.count > 0 ? judge_ends(*assembly) : KEMPE_OK;
}

void kempe_assembly_free(kempe_assembly *a)
{
    if (!a)
        return;
    kmp_arena_free(&a->arena);
    kmp_free(a);
}

KMP_GETTER(const double *kempe_assembly_q(const kempe_assembly *assembly), assembly, assembly->q, NULL)
KMP_GETTER(const double *kempe_assembly_qd(const kempe_assembly *assembly), assembly, assembly->qd, NULL)
