/* SPDX-License-Identifier: BSD-3-Clause */
/* Output of `assemble`, as text and as JSON. */
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/assembly_modes.h"
#include "constraints/closing/start_gaps.h"
#include "model/data/model.h"
#include "model/data/start.h"
#include "model/write/model_print.h"
#include "output/print.h"
#include "output/start_balance.h"
#include <kempe/check.h>
#include <kempe/kempe.h>
#include <stdbool.h>
#include <string.h>

static bool lacks_equilibrium(const kempe_assembly *a)
{
    return a->closed && a->system->model->start.at && !a->balance;
}

static bool is_done(const kempe_assembly *a)
{
    return a->closed && a->goals.end != KMP_GOALS_SINGULAR && !lacks_equilibrium(a);
}

static kempe_outcome outcome_of(const kempe_assembly *a)
{
    return !is_done(a) ? KEMPE_OUTCOME_FAILED : a->ended ? KEMPE_OUTCOME_NOT_TRUSTWORTHY : KEMPE_OUTCOME_COMPLETE;
}

/* "" when it is done; else e.g. the loops that stay open, widest first. */
static void put_reason(kmp_text *text, const kempe_assembly *a)
{
    kmp_text_put(text, "");
    for (int k = 0; !a->closed && k < a->culprit_count; k++) {
        kmp_text_put(text, k ? ", " : "loops remain open: ");
        kmp_assembly_put_open(text, a, a->culprits[k]);
    }
    if (lacks_equilibrium(a))
        kmp_text_put(text, "the loops are closed, but no equilibrium is found that the start leads to");
    if (!a->closed && a->culprit_count == 0)
        kmp_text_printf(text, "the loops do not close to the required precision: |h| = %.3g", a->residual);
    if (a->closed && a->goals.end == KMP_GOALS_SINGULAR)
        kmp_text_printf(text,
                        "the search for the goals stopped after %d steps at a singular position (slope %.2g): no "
                        "nearest position was found",
                        a->goals.steps, a->goals.slope);
}

/* "B", "position(coupler.P).x" */
static void put_goal(kmp_text *text, const kempe_model *model, const kmp_goal *goal, int i)
{
    kmp_model_put_goal(text, model, goal);
    if (goal->width == 3)
        kmp_text_printf(text, ".%c", "xyz"[i]);
}

static int goal_width(const kempe_model *model)
{
    size_t width = 4;
    for (int k = 0; k < model->start.goal_count; k++) {
        kmp_text name = {0};
        put_goal(&name, model, &model->start.goals[k], 0);
        width = name.s && name.length > width ? name.length : width;
        kmp_text_free(&name);
    }
    return (int)width;
}

static void show_goals(kmp_text *text, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    int width = goal_width(model);
    if (model->start.goal_count == 0)
        return;
    kmp_text_printf(text, "\n  %-*s  unit  %10s  %12s  %12s  %12s\n", width, "", "weight", "goal", "reached",
                    "remains");
    for (int k = 0, at = 0; k < model->start.goal_count; k++) {
        const kmp_goal *goal = &model->start.goals[k];
        for (int i = 0; i < goal->width; i++, at++) {
            kmp_text name = {0};
            put_goal(&name, model, goal, i);
            kmp_shown shown =
                kmp_shown_as(a->system->context,
                             goal->motion < 0 ? "m" : kmp_quantity_unit(a->system, KMP_QUANTITY_Q, goal->motion));
            double wanted = shown.factor * goal->value[i].value, reached = shown.factor * a->goals.value[at];
            kmp_text_printf(text, "  %-*s  %-4s  %10.6g  %12.6g  %12.6g  %12.6g\n", width, name.s ? name.s : "",
                            shown.unit, goal->weight[i].value, wanted, reached, reached - wanted);
            kmp_text_free_part(text, &name);
        }
    }
}

/* "held", "static", or nothing, of a coordinate. */
static const char *kept_as(const void *self, int k)
{
    const kmp_start *start = self;
    if (!start->hold || !start->hold[k])
        return "";
    return start->statics && start->undeformed[k] ? "static" : "held";
}

/* Start values and what they have become; NULL: there is no room for the first ones. */
static void show_values(kmp_text *text, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    double *guess = KMP_NEW(double, a->system->n);
    const kmp_coordinate_column columns[] = {{"start value", KMP_QUANTITY_Q, guess},
                                             {"position", KMP_QUANTITY_Q, a->q},
                                             {"velocity", KMP_QUANTITY_QD, a->qd}};
    text->failed = text->failed || !guess;
    for (int k = 0; guess && k < kmp_model_coordinates(model); k++)
        guess[k] = model->start.q[k].value;
    if (guess)
        kmp_print_coordinates(text, a->system, sizeof columns / sizeof *columns, columns, kept_as, &model->start);
    kmp_free(guess);
    kmp_print_states(text, a->system, a->qd, NULL);
}

static void show_assembly(kmp_text *text, const void *result)
{
    const kempe_assembly *a = result;
    const kempe_model *model = a->system->model;
    const kmp_shown turn = kmp_shown_as(a->system->context, "rad"), gap = kmp_shown_as(a->system->context, "m");
    kmp_text title = {0};
    kmp_print_title(&title, model, outcome_of(a));
    if (is_done(a))
        kmp_text_put(&title, a->system->m > 0 ? "all loops are closed" : "the model has no loops");
    else
        put_reason(&title, a);
    kmp_print_answer(text, &title, outcome_of(a), a->ended ? a->ended : "", "", NULL);
    kmp_start_balance_show(text, a->balance);
    kmp_text_put(text, "\n");
    show_values(text, a);
    show_goals(text, a);
    if (a->system->m > 0)
        kmp_print_cells(text, "\naccuracy  largest gap %.2g %s, largest angle %.2g %s, after %d iteration%s\n",
                        a->gap * gap.factor, gap.unit, a->turn * turn.factor, turn.unit, a->iterations,
                        a->iterations == 1 ? "" : "s");
    if (a->goals.end != KMP_GOALS_NONE) {
        kmp_print_cells(text, "goals     distance %.6e, %s after %d step%s, slope %.2e\n", a->goals.distance,
                        a->goals.end == KMP_GOALS_MINIMUM ? "a minimum" : "no minimum", a->goals.steps,
                        a->goals.steps == 1 ? "" : "s", a->goals.slope);
    }
    /* Joints with clearance. */
    static const char *const ways[] = {[KMP_LOOSE_OWN] = "with a rate of its own", [KMP_LOOSE_REST] = "as without it"};
    const kmp_loose_start starts[] = {KMP_LOOSE_REST, KMP_LOOSE_OWN};
    for (int k = 0; k < 2; k++) {
        kmp_text words = {0};
        const int count = kmp_assembly_put_loose(&words, a, starts[k]);
        kmp_text_printf(&words, " start%s %s%s", count == 1 ? "s" : "", ways[starts[k]],
                        a->centred ? "; the journal is centred, because its start value was outside the bearing" : "");
        if (count > 0)
            kmp_print_wrapped(text, "clearance ", 10, words.s ? words.s : "");
        kmp_text_free_part(text, &words);
    }
    kmp_print_rounding(text, a->system, "rounding  ");
    kmp_text changed = {0};
    kmp_assembly_put_rates(&changed, a);
    for (const char *at = changed.s ? changed.s : ""; *at; at += strcspn(at, "\n") + 1)
        kmp_text_printf(text, "note      %.*s\n", (int)strcspn(at, "\n"), at);
    kmp_text_free_part(text, &changed);
    if (a->rates_left > 0)
        kmp_text_printf(text,
                        "note      the velocities of the drives contradict the loops here: a misfit of %.2g remains\n",
                        a->rates_left);
}

static void json_goals(kmp_json *j, const kempe_assembly *a)
{
    static const char *const ends[] = {
        [KMP_GOALS_NONE] = "open", [KMP_GOALS_MINIMUM] = "minimum", [KMP_GOALS_SINGULAR] = "singular"};
    const kempe_model *model = a->system->model;
    kmp_json_put(j, "goals { end %s distance %g slope %g steps %d values {", ends[a->goals.end], a->goals.distance,
                 a->goals.slope, a->goals.steps);
    for (int k = 0, at = 0; k < model->start.goal_count; k++) {
        const kmp_goal *goal = &model->start.goals[k];
        for (int i = 0; i < goal->width; i++, at++) {
            kmp_text name = {0};
            put_goal(&name, model, goal, i);
            kmp_json_object(j, name.s ? name.s : "");
            kmp_text_free_part(j->text, &name);
            kmp_json_put(j, "goal %g weight %g reached %g remains %g }", goal->value[i].value, goal->weight[i].value,
                         a->goals.value[at], a->goals.value[at] - goal->value[i].value);
        }
    }
    kmp_json_put(j, "} }");
}

static void json_loose(kmp_json *j, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    bool any = false;
    for (int k = 0; k < model->force_count; k++)
        any = any || model->forces[k].centred[0];
    if (!any)
        return;
    kmp_json_object(j, "clearance");
    for (int k = 0; k < model->force_count; k++)
        if (model->forces[k].centred[0])
            kmp_json_put(j, "%s %s", model->forces[k].name, a->loose[k] == KMP_LOOSE_REST ? "as_without" : "own");
    kmp_json_put(j, "} centred %i", a->centred);
}

static void json_assembly(kmp_text *text, const void *result)
{
    const kempe_assembly *a = result;
    const kempe_model *model = a->system->model;
    kmp_text warnings = {0}, reason = {0};
    put_reason(&reason, a);
    kmp_text_put(&warnings, "");
    kmp_assembly_put_moves(&warnings, a);
    kmp_assembly_put_rates(&warnings, a);
    warnings.failed = !kmp_put_start_gaps(&warnings, a->system, a->q) || warnings.failed;
    if (a->ended)
        kmp_text_printf(&warnings, "%s\n", a->ended);
    kmp_json j = kmp_print_head(text, a->system, outcome_of(a), reason.s, a->system->build_s, warnings.s);
    kmp_text_free_part(text, &warnings);
    kmp_text_free_part(text, &reason);
    kmp_print_entries(&j, "q", a->system, KMP_QUANTITY_Q, a->q);
    kmp_print_entries(&j, "qd", a->system, KMP_QUANTITY_QD, a->qd);
    kmp_start_balance_json(&j, a->balance);
    /* Rates that were given and could not be kept. */
    kmp_json_object(&j, "rates_changed");
    for (int k = 0; k < a->system->n; k++)
        if (kmp_assembly_changed_rate(a, k))
            kmp_json_put(&j, "%s { given %g taken %g }", model->motions[k].name, model->start.qd[k].value, a->qd[k]);
    kmp_json_put(&j, "} rates_left %g", a->rates_left);
    json_loose(&j, a);
    kmp_json_put(&j, "residual %g gap %g turn %g", a->residual, a->gap, a->turn);
    kmp_print_names(&j, "culprits", a->system, kmp_name_of_closure, a->culprit_count, a->culprits);
    kmp_json_whole(&j, "iterations", a->iterations);
    if (model->start.goal_count > 0)
        json_goals(&j, a);
    kmp_json_end(&j);
}

KMP_PRINT(kempe_assembly, assembly, assembly->system->context, json_assembly, show_assembly)

/* -- assembly modes -------------------------------------------------------------------------------------- */

/* Output of `assemble --branches`: each assembly mode, and the start values that select it. */

static void list_kept(kmp_text *text, const kempe_branches *b)
{
    int listed = 0;
    for (int k = 0; k < b->system->n; k++)
        if (b->kept[k])
            kmp_text_printf(text, "%s%s", listed++ ? ", " : "", b->system->model->motions[k].name);
    kmp_text_put(text, listed ? "" : "nothing");
}

/* The lines to write into the model, numbers in rad and m, nine digits: enough to assemble there. */
static void show_start(kmp_text *text, const kempe_branches *b, const kmp_branch *branch)
{
    kmp_text_put(text, "  start: {q: {");
    for (int k = 0; k < b->system->n; k++)
        kmp_text_printf(text, "%s%s: %.9g", k ? ", " : "", b->system->model->motions[k].name, branch->q[k]);
    bool held = false;
    for (int k = 0; k < b->system->n; k++)
        held = held || b->kept[k];
    kmp_text_put(text, held ? "}, hold: [" : "}");
    if (held) {
        list_kept(text, b);
        kmp_text_put(text, "]");
    }
    kmp_text_put(text, "}\n");
}

static void show_branches(kmp_text *text, const void *result)
{
    const kempe_branches *b = result;
    kmp_print_title(text, b->system->model, kmp_outcome_of(b->status));
    kmp_text_printf(text, "%s%d assembly mode%s found, holding ", b->many ? "more than " : "", b->count,
                    b->count == 1 ? "" : "s");
    list_kept(text, b);
    kmp_text_printf(text, "\n%d random starts, %d of them assembled; sampling may miss some modes\n", b->starts,
                    b->closed);
    for (int k = 0; k < b->count; k++) {
        const kmp_branch *branch = &b->branch[k];
        int width = kmp_print_width(b->system, KMP_QUANTITY_Q);
        kmp_text_printf(text, "\nbranch %d%s", k + 1, k ? "" : " (of the model)");
        if (branch->sign[0])
            kmp_text_printf(text, "  sign %s", branch->sign);
        kmp_text_printf(text, "  |h| %.2e\n", branch->residual);
        for (int c = 0; c < b->system->n; c++)
            kmp_text_printf(
                text, "  %-*s  %12.6g  %s%s\n", width, b->system->model->motions[c].name,
                kmp_print_value(b->system, c, kmp_print_clean(branch->q[c], KMP_PRINT_NOISE * b->system->scale[c])),
                kmp_print_unit(b->system, c), b->kept[c] ? "  kept" : "");
        show_start(text, b, branch);
    }
    if (b->many)
        kmp_text_put(text,
                     "\nnote  such a large number suggests that the held coordinates leave a degree of freedom\n");
}

static void json_branches(kmp_text *text, const void *result)
{
    const kempe_branches *b = result;
    kmp_json j = kmp_print_head(text, b->system, kmp_outcome_of(b->status), "", b->system->build_s, b->warnings);
    kmp_json_array(&j, "kept");
    for (int k = 0; k < b->system->n; k++)
        if (b->kept[k])
            kmp_json_string(&j, NULL, b->system->model->motions[k].name);
    kmp_json_put(&j, "} starts %d closed %d more %d branches [", b->starts, b->closed, b->many);
    for (int k = 0; k < b->count; k++) {
        kmp_json_object(&j, NULL);
        kmp_print_entries(&j, "q", b->system, KMP_QUANTITY_Q, b->branch[k].q);
        kmp_json_put(&j, "residual %g sign %s hits %d }", b->branch[k].residual, b->branch[k].sign, b->branch[k].hits);
    }
    kmp_json_put(&j, "] }");
}

KMP_PRINT(kempe_branches, branches, branches->system->context, json_branches, show_branches)
