/* SPDX-License-Identifier: BSD-3-Clause */
/* `check` for a person: one paragraph a question. */
#include "studies/assembly/check_print.h"
#include "model/print/model_print.h"
#include <kempe/check.h>
#include <math.h>

enum { MOST_LISTED = 12 };
#define ROUNDING 1e-13 /* relative to the first pivot: zero */
#define USABLE   1e3   /* max |Bvu| of a coordinate that could be independent */

static const char *name_of(const kempe_check *check, int coordinate)
{
    return check->system->model->motions[coordinate].name;
}

/* "  label                " in front of a line; an empty label for the next ones. */
static void label(kmp_text *text, const char *word)
{
    kmp_text_printf(text, "  %-21s", word);
}

/* A line of its own when `write` gives a sentence. */
static void sentence(kmp_text *text, const kempe_check *check, const char *word,
                     void (*write)(kmp_text *, const kempe_check *))
{
    kmp_text line = {0};
    write(&line, check);
    if (line.s && line.length > 0) {
        label(text, word);
        kmp_text_printf(text, "%s\n", line.s);
    }
    text->failed = text->failed || line.failed;
    kmp_text_free(&line);
}

static void write_unused(kmp_text *text, const kempe_check *check)
{
    kmp_print_unused(text, check->system->model);
}

static void show_mobility(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    int vanished = check->doctor.declared - part->m;
    kmp_text_printf(text, "  bodies               %d\n", check->body_count);
    kmp_text_printf(text, "  coordinates          %d\n", part->n);
    kmp_text_printf(text, "  closures             %d with %d row%s, of rank %d\n", check->loop_count, part->m,
                    part->m == 1 ? "" : "s", part->r);
    if (vanished > 0)
        kmp_text_printf(text, "  %-21s(%d more vanish identically, as out-of-plane rows do)\n", "", vanished);
    kmp_text_printf(
        text, check->driven > 0 ? "  degrees of freedom   %d remaining, %d driven\n" : "  degrees of freedom   %d\n",
        part->p, check->driven);
    if (part->p == 0) {
        label(text, "");
        kmp_text_put(text, check->system->rheonomic ? "all motion is prescribed\n" : "the mechanism cannot move\n");
    }
    if (check->undetermined)
        kmp_text_printf(text, "  %-21s%s\n", "no run is possible", check->undetermined);
    sentence(text, check, "", kmp_check_mobility);
    sentence(text, check, "", kmp_check_second);
    if (check->doctor.ran && check->doctor.margin > 0 && check->doctor.margin < 1e-4) {
        label(text, "");
        kmp_text_printf(text, "a change point (bifurcation) is near: the last pivot is %.2g of its usual size\n",
                        check->doctor.margin);
    }
    label(text, "redundant rows");
    kmp_list_rows(text, check->system, part->m - part->r, part->redundant);
    kmp_text_put(text, "\n");
    kmp_print_rounding(text, check->system, "  rounded drawing      ", "                       ");
}

/* -- cut joints -------------------------------------------------------------------------------------- */

static void show_cuts(kmp_text *text, const kempe_check *check)
{
    const kempe_model *model = check->system->model;
    for (int k = 0; k < model->cut_count && k < MOST_LISTED; k++) {
        label(text, k ? "" : "cut joints");
        kmp_cut_print(text, &model->cuts[k]);
        kmp_text_put(text, "\n");
    }
    if (model->cut_count > MOST_LISTED) {
        label(text, "");
        kmp_text_printf(text, "and %d more\n", model->cut_count - MOST_LISTED);
    }
}

/* -- redundancy -------------------------------------------------------------------------------------- */

static void show_sets(kmp_text *text, const kempe_check *check)
{
    const kmp_doctor *d = &check->doctor;
    for (int k = 0; k < d->set_count && k < MOST_LISTED; k++) {
        label(text, k ? "" : "dependent sets");
        kmp_list_rows(text, check->system, d->sets[k].count, d->sets[k].rows);
        if (d->sets[k].count == 1)
            kmp_text_put(text, " constrains nothing");
        if (d->moved)
            kmp_text_put(text, d->sets[k].always ? ": always" : ": only in this position");
        kmp_text_put(text, "\n");
    }
    if (d->set_count > MOST_LISTED) {
        label(text, "");
        kmp_text_printf(text, "and %d more\n", d->set_count - MOST_LISTED);
    }
    if (d->shared_count > 0) {
        label(text, "reactions not unique");
        kmp_list_rows(text, check->system, d->shared_count, d->shared_rows);
        kmp_text_put(text, "\n");
    }
}

static void show_repairs(kmp_text *text, const kempe_check *check)
{
    const kmp_doctor *d = &check->doctor;
    if (d->repairs_skipped) {
        label(text, "removable closures");
        kmp_text_put(text, "not examined: too many rows\n");
    }
    for (int k = 0; k < d->repair_count && k < MOST_LISTED; k++) {
        label(text, k ? "or" : "removable closures");
        kmp_check_repair(text, check, &d->repairs[k]);
        kmp_text_put(text, "\n");
    }
}

/* -- choice ------------------------------------------------------------------------------------------ */

static void show_pivots(kmp_text *text, const kmp_partition *part)
{
    int count = part->m < part->n ? part->m : part->n;
    label(text, "pivots");
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%.3g",
                        k == 0         ? ""
                        : k == part->r ? " | "
                                       : " ",
                        part->pivots[k] > ROUNDING * part->pivots[0] ? part->pivots[k] : 0);
    kmp_text_put(text, count ? "\n" : "none\n");
}

static void show_why(kmp_text *text, const kmp_partition *part)
{
    label(text, "why");
    kmp_text_put(text, part->user     ? "requested"
                       : part->r == 0 ? "there are no loops: all coordinates are independent"
                                      : "v has the largest pivots of the scaled J, so that v depends least on u");
    if (part->exchanges > 0)
        kmp_text_printf(text, ";\n%23sthen %d exchange%s between u and v where |Bvu| was above 2", "", part->exchanges,
                        part->exchanges == 1 ? "" : "s");
    kmp_text_put(text, "\n");
}

/* The dependent coordinates that could, or could not, be independent instead. */
static void show_alternatives(kmp_text *text, const kempe_check *check, bool usable, const char *word)
{
    const kmp_doctor *d = &check->doctor;
    int listed = 0, left = 0;
    for (int k = 0; k < d->alternative_count; k++) {
        const kmp_alternative *a = &d->alternatives[k];
        if (a->independent || (a->max_b < USABLE) != usable)
            continue;
        if (listed == MOST_LISTED) {
            left++;
            continue;
        }
        if (listed++ == 0)
            label(text, word);
        else
            kmp_text_put(text, ", ");
        kmp_text_printf(text, "%s", name_of(check, a->coordinate));
        if (usable && check->part.p > 1)
            kmp_text_printf(text, " for %s", name_of(check, a->instead));
        if (a->max_b < INFINITY)
            kmp_text_printf(text, " (%.3g)", a->max_b);
    }
    if (left > 0)
        kmp_text_printf(text, " and %d more", left);
    kmp_text_put(text, listed ? "\n" : "");
}

static void show_choice(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    kmp_text_put(text, "\n  independent, u       ");
    kmp_list_coordinates(text, check->system, part->p, part->u);
    kmp_text_put(text, "\n  dependent, v         ");
    kmp_list_coordinates(text, check->system, part->r, part->v);
    kmp_text_put(text, "\n");
    show_why(text, part);
    show_pivots(text, part);
    kmp_text_printf(text, "  condition of Jv      %.3g\n", part->cond);
    kmp_text_printf(text, "  max |Bvu|            %.3g\n", part->max_b);
    show_alternatives(text, check, true, "alternatives (|Bvu|)");
    show_alternatives(text, check, false, "cannot be u here");
}

static void show_blocks(kmp_text *text, const kempe_check *check)
{
    const kmp_doctor *d = &check->doctor;
    label(text, "blocks of Jv");
    for (int b = 0; b < d->block_count; b++) {
        const kmp_loop_block *block = &d->blocks[b];
        kmp_text_put(text, b ? " -> {" : "{");
        kmp_list_coordinates(text, check->system, block->size, block->columns);
        kmp_text_put(text, "} by ");
        kmp_list_closures(text, check->system, block->closure_count, block->closures);
    }
    kmp_text_put(text, d->block_count > 0 ? "\n" : "none\n");
}

/* -- limits of motion -------------------------------------------------------------------------------- */

static void show_landmarks(kmp_text *text, const kempe_check *check)
{
    const kmp_limits *l = &check->doctor.limits;
    int u = check->part.u[0];
    for (int i = 0; i < l->landmark_count; i++) {
        const kmp_landmark *mark = &l->landmark[i];
        if (mark->coordinate >= 0)
            continue;
        label(text, mark->margin > 0 ? "near change point" : "change point");
        kmp_text_printf(text, "at %s = %.6g %s", name_of(check, u), mark->q[u], kmp_print_unit(check->system, u));
        if (mark->margin > 0)
            kmp_text_printf(text, ": the last pivot falls to %.2g of its usual size", mark->margin);
        else
            kmp_text_put(text, ": a bifurcation, branches meet there");
        kmp_text_put(text, "\n");
    }
}

static void show_limits(kmp_text *text, const kempe_check *check)
{
    const kmp_limits *l = &check->doctor.limits;
    kmp_text_put(text, "\n");
    label(text, "limits of motion");
    if (!l->walked) {
        kmp_text_printf(text, "%s\n", l->why_not ? l->why_not : "not followed");
        return;
    }
    kmp_text_put(text, l->cycle ? "the motion is a closed cycle\n" : l->ended);
    kmp_text_put(text, l->cycle ? "" : "\n");
    int width = kmp_print_width(check->system, KMP_QUANTITY_Q);
    for (int k = 0; k < check->system->n; k++) {
        label(text, "");
        kmp_text_printf(text, "%-*s  ", width, name_of(check, k));
        kmp_check_swing(text, check, k);
        kmp_text_put(text, "\n");
    }
    show_landmarks(text, check);
}

/* -- failed assembly --------------------------------------------------------------------------------- */

static void show_obstacle(kmp_text *text, const kempe_check *check)
{
    const kempe_assembly *a = check->assembly;
    const kmp_obstacle *o = &check->obstacle;
    label(text, "does not assemble");
    kmp_text_printf(text, "the smallest gap found is %.6g m\n", a->gap);
    for (int k = 0; k < a->culprit_count && k < MOST_LISTED; k++) {
        label(text, k ? "" : "open loops");
        kmp_text_printf(text, "'%s' by %.6g m\n", check->system->model->closures[a->culprits[k]].name,
                        a->gaps[a->culprits[k]]);
    }
    if (a->culprit_count > MOST_LISTED) {
        label(text, "");
        kmp_text_printf(text, "and %d more\n", a->culprit_count - MOST_LISTED);
    }
    for (int k = 0; k < o->reach_count && k < MOST_LISTED; k++) {
        label(text, k ? "" : "lengths");
        kmp_check_reach(text, check, &o->reaches[k]);
        kmp_text_put(text, "\n");
    }
    for (int k = 0; k < o->release_count; k++) {
        label(text, k ? "" : "held coordinates");
        kmp_check_release(text, check, &o->releases[k]);
        kmp_text_put(text, "\n");
    }
}

void kmp_check_text(kmp_text *text, const kempe_check *check)
{
    kmp_text_printf(text, "%s\n", check->system->model->name);
    sentence(text, check, "unused parameters", write_unused);
    if (!check->assembled) {
        show_cuts(text, check);
        show_obstacle(text, check);
        return;
    }
    show_mobility(text, check);
    show_cuts(text, check);
    if (!check->doctor.ran) {
        label(text, "not examined");
        kmp_text_printf(text, "%s\n", check->doctor.why_not);
    }
    show_sets(text, check);
    show_repairs(text, check);
    show_choice(text, check);
    show_blocks(text, check);
    show_limits(text, check);
}

kempe_status kempe_check_print(const kempe_check *check, kempe_format format, char **text)
{
    KMP_WANTED(NULL, check, "check");
    KMP_WANTED(check->system->context, text, "text");
    kmp_text out = {0};
    kmp_context_clear(check->system->context);
    if (format == KEMPE_JSON)
        kmp_check_json(&out, check);
    else
        kmp_check_text(&out, check);
    return kmp_print_finish(check->system->context, &out, text);
}
