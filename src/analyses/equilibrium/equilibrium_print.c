/* SPDX-License-Identifier: BSD-3-Clause */
/* Output of `equilibrium`, as text and as JSON. */
#include "analyses/equilibrium/balance_friction.h"
#include "analyses/equilibrium/balances.h"
#include "analyses/parts/study_print.h"
#include "base/memory.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/reactions.h"
#include "output/result_table.h"
#include <kempe/equilibrium.h>
#include <math.h>
#include <string.h>

static void list(kmp_text *text, const kempe_system *system, int count, const int *coordinates)
{
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s'%s'", k ? ", " : "", system->model->motions[coordinates[k]].name);
}

static void show_coordinates(kmp_text *text, const kempe_equilibrium *e, const kmp_balance *b)
{
    const kempe_model *model = e->system->model;
    const kmp_coordinate_column columns[] = {{"position", KMP_QUANTITY_Q, b->q}, {"velocity", KMP_QUANTITY_QD, b->qd}};
    bool rates = false;
    for (int k = 0; k < kmp_model_coordinates(model); k++)
        rates = rates || b->qd[k] != 0;
    kmp_print_coordinates(text, e->system, rates ? 2 : 1, columns, NULL, NULL);
    kmp_print_states(text, e->system, b->qd, NULL);
}

/* Of a closure, or of a joint of the tree after these. */
static const char *name_of_load(const kempe_equilibrium *e, int k)
{
    const kempe_model *model = e->system->model;
    return k < model->closure_count ? model->closures[k].name
                                    : model->bodies[e->loads.joint[k - model->closure_count]].joint;
}

/* The reactions of a balance, to be freed; false: no memory. */
static bool reactions_of(const kempe_equilibrium *e, const kmp_balance *b, kmp_reactions *r)
{
    if (kmp_reactions_init(r, e->system, &e->loads, true) != KEMPE_OK)
        return false;
    r->least_norm = e->least_norm;
    kmp_reactions_add(r, 0, b->reaction);
    return !b->shared.matters || kmp_reactions_mark(r, &b->shared) == KEMPE_OK;
}

static void put_reactions(kmp_text *text, kmp_json *json, const kempe_equilibrium *e, const kmp_balance *b)
{
    kmp_reactions reactions;
    if (!reactions_of(e, b, &reactions))
        text->failed = true;
    else if (json)
        kmp_reactions_json(json, &reactions);
    else
        kmp_reactions_show(text, &reactions, "--json");
    kmp_reactions_free(&reactions);
}

static void show_end(kmp_text *text, const kempe_equilibrium *e, int coordinate, const kmp_rest_end *end)
{
    kmp_text_printf(text, "%.6g", kmp_print_value(e->system, coordinate, end->q[coordinate]));
    if (end->word != KMP_REST_SLIPS)
        kmp_text_put(text, end->word == KMP_REST_LIMIT ? " (limit of the motion)" : " (and beyond)");
}

/* Column of the text of a line, after its label. */
enum { TEXT_COLUMN = 11 };

void kmp_balance_put_growth(kmp_text *text, const kmp_stability *s)
{
    if (s->growing > 0 && isnan(s->re))
        kmp_text_printf(text, ": %d root%s of the characteristic equation %s a positive real part", s->growing,
                        s->growing == 1 ? "" : "s", s->growing == 1 ? "has" : "have");
    else if (s->growing > 0)
        kmp_text_printf(text, ": %d motion%s, the fastest as exp(%.6g t)%s", s->growing,
                        s->growing == 1 ? " grows" : "s grow", s->re, s->im != 0 ? ", oscillating" : "");
    else if (s->word == KMP_UNSTABLE && s->change)
        kmp_text_printf(text, ": a force pushes away from it on one side of %s", s->change);
    else if (s->secular)
        kmp_text_put(text, s->im != 0
                               ? ": an oscillation grows in proportion to time, since eigenvalues coincide and have "
                                 "one shape"
                               : ": a displacement grows as a power of time without a force that restores it");
}

/* The stability, and what moves or does not. */
static void put_stability(kmp_text *text, const kempe_equilibrium *e, const kmp_balance *b)
{
    const kmp_stability *s = &b->stability;
    kmp_text_put(text, kmp_stability_text(s->word));
    if (s->word == KMP_NOT_HELD) {
        kmp_text_printf(text, ": no equilibrium, because friction would need %.4g times its static levels",
                        b->friction_part);
        return;
    }
    if (s->still > 0) {
        kmp_text_put(text, s->word == KMP_NEUTRAL ? " along " : ", and neutral along ");
        list(text, e->system, s->still, s->along);
    }
    kmp_balance_put_growth(text, s);
    if (s->word == KMP_UNSTABLE)
        return;
    if (s->word == KMP_UNDECIDED && s->change)
        kmp_text_printf(text, ": motions grow on some sides of %s", s->change);
    else if (s->word == KMP_UNDECIDED)
        kmp_text_put(text, e->system->model->delay_count > 0
                               ? ": delays with a root close to zero growth, or together with samples"
                               : ": the reduced mass is not positive");
    else if (isfinite(s->re))
        kmp_text_printf(text, ": %s",
                        s->re < 0 ? "every perturbation decays or stays constant" : "perturbations oscillate undamped");
}

static void show_stability(kmp_text *text, const kempe_equilibrium *e, const kmp_balance *b)
{
    kmp_text words = {0}, idle = {0};
    put_stability(&words, e, b);
    kmp_text_put(text, "\n");
    kmp_print_wrapped(text, "stability  ", TEXT_COLUMN, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
    if (b->idle_count == 0 || b->stability.word == KMP_NOT_HELD)
        return;
    list(&idle, e->system, b->idle_count, b->idle);
    kmp_text_put(&idle, b->idle_count == 1 ? ": nothing depends on it" : ": nothing depends on them");
    kmp_print_wrapped(text, "excluded   ", TEXT_COLUMN, idle.s ? idle.s : "");
    kmp_text_free_part(text, &idle);
}

bool kmp_balance_is_cyclic(const kmp_balance *b, int coordinate)
{
    for (int k = 0; k < b->idle_count; k++)
        if (b->idle[k] == coordinate)
            return b->qd[coordinate] != 0;
    return false;
}

int kmp_balance_put_cyclic(kmp_text *text, const kempe_equilibrium *e, const kmp_balance *b, bool *kept, bool *held)
{
    kmp_steady *found = KMP_NEW(kmp_steady, e->rate_count);
    int count = 0;
    *kept = *held = false;
    for (const kmp_steady *r = e->rates; found && r < e->rates + e->rate_count; r++)
        if (kmp_balance_is_cyclic(b, r->coordinate)) {
            found[count++] = *r;
            *kept = *kept || r->how == KMP_RATE_KEPT;
            *held = *held || r->how == KMP_RATE_HELD;
        }
    if (found)
        kmp_steady_list(text, e->system->model, count, found, b->qd);
    text->failed = text->failed || !found;
    kmp_free(found);
    return text->failed ? -1 : count;
}

static void show_cyclic(kmp_text *text, const kempe_equilibrium *e, const kmp_balance *b)
{
    bool kept, held;
    kmp_text list = {0};
    if (kmp_balance_put_cyclic(&list, e, b, &kept, &held) > 0) {
        kmp_text_put(text, "\n");
        kmp_print_wrapped(text, "steady     ", TEXT_COLUMN, list.s ? list.s : "");
        kmp_text_put(text, "           at constant speed: no force, closure or mass depends on these positions\n");
        if (kept)
            kmp_text_put(text, "           the speeds are as at the start, because no force fixes them\n");
        if (held)
            kmp_text_put(text, "           resistances would slow the motion down: the named additional load, which\n"
                               "           is not in the model, keeps the speed\n");
    }
    kmp_text_free_part(text, &list);
}

/* "  12.5 N": a force of an element, or a moment. */
static void put_effort(kmp_text *text, const kempe_equilibrium *e, const kmp_force *element, double x, double noise)
{
    const kempe_model *model = e->system->model;
    const bool turns =
        element->motion >= 0 ? model->motions[element->motion].rotation : element->turns || element->touch.turns;
    const kmp_shown as = kmp_shown_as(model->context, turns ? "N m" : "N");
    if (isinf(x))
        kmp_text_printf(text, "  %12s %-6s", "unlimited", "");
    else
        kmp_text_printf(text, "  %12.6g %-6s", as.factor * kmp_print_clean(x, noise), as.unit);
}

/* Contacts and friction. */
static void show_elements(kmp_text *text, const kempe_equilibrium *e, const kmp_balance *b)
{
    double noise = 0;
    for (int i = 0; i < b->contact_count; i++)
        noise = fmax(noise, KMP_PRINT_NOISE * fabs(b->contact[i].force));
    if (b->contact_count > 0)
        kmp_text_printf(text, "\ncontacts   %-16s  %12s      %12s\n", "", "distance", "force");
    for (int i = 0; i < b->contact_count; i++) {
        const kmp_balance_contact *c = &b->contact[i];
        const kmp_shown as = kmp_shown_as(e->system->context, c->element->touch.turns ? "rad" : "m");
        kmp_text_printf(text, "           %-16s  %12.6g %-3s", c->element->name,
                        as.factor * kmp_print_clean(c->gap, KMP_PRINT_NOISE * e->system->length), as.unit);
        put_effort(text, e, c->element, c->force, noise);
        kmp_text_printf(text, "  %s\n", kmp_contact_text(c->word));
    }
    for (int i = 0; i < b->friction_count; i++)
        noise = fmax(noise, KMP_PRINT_NOISE *
                                (isinf(b->friction[i].largest) ? fabs(b->friction[i].force) : b->friction[i].largest));
    if (b->friction_count > 0)
        kmp_text_printf(text, "\nfriction   %-16s  %12s         %12s         %8s\n", "", "force", "largest", "part");
    for (int i = 0; i < b->friction_count; i++) {
        const kmp_friction_view *view = &b->friction[i];
        kmp_text_printf(text, "           %-16s", view->element->name);
        put_effort(text, e, view->element, view->force, noise);
        put_effort(text, e, view->element, view->largest, noise);
        kmp_text_printf(text, "  %8.3g%s\n", view->largest > 0 ? view->needs / view->largest : 0,
                        view->word == KMP_FRICTION_WORD_OPEN ? "  not determined: other closures keep its place" : "");
    }
}

static void show_balance(kmp_text *text, const kempe_equilibrium *e, int k)
{
    const kmp_balance *b = &e->balance[k];
    if (e->all)
        kmp_text_printf(text, "\nequilibrium %d%s: %s, found from %d start%s\n", k + 1,
                        k == 0 && e->from_start ? " (from the model's start)" : "",
                        kmp_stability_text(b->stability.word), b->hits, b->hits == 1 ? "" : "s");
    else
        kmp_text_put(text, "\n");
    show_coordinates(text, e, b);
    for (int i = 0; i < e->freed_count; i++) {
        kmp_shown as = kmp_shown_as(e->system->context, e->freed_unit[i]);
        const char *unit = kmp_print_unknown(e->system->context, as.unit);
        kmp_text_printf(text, "%s%s = %.6g%s%s\n", i ? "           " : "\nfound      ", e->freed_name[i],
                        as.factor * b->freed[i], *unit ? " " : "", unit);
    }
    show_cyclic(text, e, b);
    if (b->shown)
        kmp_print_outputs(text, e->system->model, b->shown);
    put_reactions(text, NULL, e, b);
    show_elements(text, e, b);
    for (int i = 0; i < b->set_count; i++) {
        const kmp_rest_set *set = &b->set[i];
        kmp_text_printf(text, "%s'%s' holds %s from ", i ? "           " : "\nrest       ", set->element->name,
                        e->system->model->motions[set->coordinate].name);
        show_end(text, e, set->coordinate, &set->end[0]);
        kmp_text_put(text, " to ");
        show_end(text, e, set->coordinate, &set->end[1]);
        kmp_text_printf(text, " %s\n", kmp_print_unit(e->system, set->coordinate));
    }
    show_stability(text, e, b);
    kmp_print_cells(text, "residual   %.2e relative, after %d iteration%s", b->residual, b->iterations,
                    b->iterations == 1 ? "" : "s");
    if (b->exchanges > 0)
        kmp_text_printf(text, ", independent coordinates changed %d time%s", b->exchanges,
                        b->exchanges == 1 ? "" : "s");
    kmp_text_put(text, "\npotential  ");
    kmp_print_quantity(text, e->system->context, 6, b->potential, "J");
    kmp_text_put(text, "\n");
}

static void show_equilibrium(kmp_text *text, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_print_title(text, e->system->model, kmp_outcome_of(e->status));
    kmp_text_printf(text, "%s%d %s found%s", e->many ? "more than " : "", e->count,
                    e->count == 1 ? "equilibrium" : "equilibria",
                    kmp_model_has_time(e->system->model) ? " at t = 0" : "");
    if (!e->all && e->count == 1 && e->balance[0].stability.word == KMP_NOT_HELD)
        kmp_text_put(text, ", which friction does not hold");
    else if (!e->all && e->count == 1)
        kmp_text_printf(text, ", %s", kmp_stability_text(e->balance[0].stability.word));
    kmp_text_put(text, "\n");
    kmp_print_doubts(text, kmp_outcome_of(e->status), e->warnings);
    if (e->all)
        kmp_text_printf(text,
                        "%d random starts: %d assembled, %d converged to an equilibrium; sampling may miss some%s\n",
                        e->starts, e->closed, e->found, e->from_start ? "" : "; none is found from the model's start");
    if (e->ended > 0)
        kmp_text_printf(text, "%d of them left out, because a run ends at %s\n", e->ended,
                        e->ended == 1 ? "such a state" : "such states");
    kmp_averaged_put(text, "tracks    ", e->averaged);
    kmp_print_flexible(text, e->system->model, "flexible  ");
    for (int k = 0; k < e->count; k++)
        show_balance(text, e, k);
}

static void json_balance(kmp_json *j, const kempe_equilibrium *e, const kmp_balance *b)
{
    const kempe_model *model = e->system->model;
    kmp_print_entries(j, "q", e->system, KMP_QUANTITY_Q, b->q);
    kmp_print_entries(j, "qd", e->system, KMP_QUANTITY_QD, b->qd);
    kmp_print_entries(j, "lambda", e->system, KMP_QUANTITY_LAMBDA, b->lambda);
    kmp_json_number(j, "residual", b->residual);
    if (b->stability.word == KMP_UNDECIDED)
        kmp_json_string(j, "stable", NULL);
    else
        kmp_json_boolean(j, "stable", b->stability.word < KMP_UNSTABLE);
    kmp_json_put(j, "stability %s growing %d", kmp_stability_text(b->stability.word), b->stability.growing);
    kmp_print_names(j, "neutral", e->system, kmp_name_of_coordinate, b->stability.still, b->stability.along);
    kmp_print_names(j, "left_out", e->system, kmp_name_of_coordinate, b->idle_count, b->idle);
    kmp_json_object(j, "cyclic");
    for (int i = 0; i < e->rate_count; i++)
        if (kmp_balance_is_cyclic(b, e->rates[i].coordinate))
            kmp_json_number(j, e->system->model->motions[e->rates[i].coordinate].name, b->qd[e->rates[i].coordinate]);
    kmp_json_put(j, "} loads {");
    for (int i = 0; i < e->rate_count; i++)
        if (e->rates[i].how == KMP_RATE_HELD)
            kmp_json_number(j, e->system->model->motions[e->rates[i].coordinate].name, e->rates[i].load);
    kmp_json_put(j, "} free {");
    for (int i = 0; i < e->freed_count; i++)
        kmp_json_number(j, e->freed_name[i], b->freed[i]);
    for (int part = 0; part < 2; part++) {
        kmp_json_put(j, part ? "} moment {" : "} reaction {");
        for (int k = 0; k < model->closure_count + e->loads.joints; k++)
            if (k >= model->closure_count || !kmp_closure_is_of_modes(&model->closures[k]))
                kmp_json_numbers(j, name_of_load(e, k), 3, b->reaction + KMP_LOAD_VALUES * k + 3 * part);
    }
    kmp_json_end(j);
    put_reactions(j->text, j, e, b);
    if (b->shown)
        kmp_print_outputs_json(j, model, b->shown, false);
    kmp_json_put(j, "loads_not_unique %s load_share %s", b->not_unique, e->least_norm ? "least-norm" : NULL);
    kmp_json_put(j, "potential %g iterations %d exchanges %d", b->potential, b->iterations, b->exchanges);
    kmp_json_numbers(j, "history", b->iterations, b->residuals);
    kmp_json_whole(j, "hits", b->hits);
    if (kmp_model_friction_count(model) > 0) {
        kmp_json_array(j, "friction");
        for (int i = 0; i < b->friction_count; i++) {
            const kmp_friction_view *view = &b->friction[i];
            kmp_json_put(j, "{ name %s force %g largest %g determined %i }", view->element->name, view->force,
                         view->largest, view->word != KMP_FRICTION_WORD_OPEN);
        }
        kmp_json_put(j, "] rest [");
        for (int i = 0; i < b->set_count; i++) {
            const kmp_rest_set *set = &b->set[i];
            kmp_json_put(j, "{ name %s coordinate %s", set->element->name,
                         e->system->model->motions[set->coordinate].name);
            for (int k = 0; k < 2; k++) {
                kmp_json_put(j, k ? "to { word %s" : "from { word %s", kmp_rest_text(set->end[k].word));
                kmp_print_entries(j, "q", e->system, KMP_QUANTITY_Q, set->end[k].q);
                kmp_json_end(j);
            }
            kmp_json_end(j);
        }
        kmp_json_end(j);
    }
    if (b->contact_count > 0) {
        kmp_json_array(j, "contacts");
        for (int i = 0; i < b->contact_count; i++) {
            const kmp_balance_contact *c = &b->contact[i];
            kmp_json_put(j, "{ name %s gap %g force %g word %s }", c->element->name, c->gap, c->force,
                         kmp_contact_text(c->word));
        }
        kmp_json_end(j);
    }
}

static void json_equilibrium(kmp_text *text, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_json j = kmp_print_head(text, e->system, kmp_outcome_of(e->status), "", e->system->build_s, e->warnings);
    json_balance(&j, e, &e->balance[0]);
    kmp_json_put(&j, "count %d starts %d others [", e->count, e->starts);
    for (int k = 1; k < e->count; k++) {
        kmp_json_object(&j, NULL);
        json_balance(&j, e, &e->balance[k]);
        kmp_json_end(&j);
    }
    kmp_json_put(&j, "] }");
}

KMP_PRINT(kempe_equilibrium, equilibrium, equilibrium->system->context, json_equilibrium, show_equilibrium)

static void fill_equilibria(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    const kempe_system *s = e->system;
    kmp_tabulate_outcome(table, kmp_outcome_of(e->status));
    kmp_tabulate_columns(table, "stability[words] residual potential[J] hits");
    for (int k = 0; k < e->freed_count; k++)
        kmp_tabulate_column(table, kmp_print_unknown(s->context, e->freed_unit[k]), "%s", e->freed_name[k]);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_Q);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_QD);
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_LAMBDA);
    kmp_tabulate_outputs(table, e->requested->model, NULL);
    for (int i = 0; i < e->rate_count; i++)
        if (e->rates[i].how == KMP_RATE_HELD)
            kmp_tabulate_column(table, s->model->motions[e->rates[i].coordinate].rotation ? "N m" : "N", "load.%s",
                                s->model->motions[e->rates[i].coordinate].name);
    for (const kmp_balance *b = e->balance; b < e->balance + e->count; b++) {
        KMP_TABULATE(table, "%s %g %g %d", kmp_stability_text(b->stability.word), b->residual, b->potential, b->hits);
        kmp_tabulate_numbers(table, e->freed_count, b->freed);
        kmp_tabulate_values(table, s, KMP_QUANTITY_Q, b->q);
        kmp_tabulate_values(table, s, KMP_QUANTITY_QD, b->qd);
        kmp_tabulate_numbers(table, s->m, b->lambda);
        if (b->shown)
            kmp_tabulate_outputs(table, e->requested->model, b->shown);
        for (int i = 0; i < e->rate_count; i++)
            if (e->rates[i].how == KMP_RATE_HELD)
                kmp_tabulate_number(table, e->rates[i].load);
    }
}

static void fill_reactions(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_tabulate_columns(table, "equilibrium");
    kmp_reactions_columns(table);
    for (int k = 0; k < e->count; k++) {
        kmp_reactions reactions;
        if (reactions_of(e, &e->balance[k], &reactions))
            kmp_reactions_tabulate(table, &reactions, k);
        else
            kmp_tabulate_fail(table);
        kmp_reactions_free(&reactions);
    }
}

static void fill_history(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_tabulate_columns(table, "equilibrium iteration residual step");
    for (int k = 0; k < e->count; k++)
        for (int i = 0; i < e->balance[k].iterations; i++)
            KMP_TABULATE(table, "%d %d %g %g", k, i, e->balance[k].residuals[i], e->balance[k].steps[i]);
}

static void fill_friction(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_tabulate_columns(table, "equilibrium element[words] force largest part");
    for (int k = 0; k < e->count; k++)
        for (int i = 0; i < e->balance[k].friction_count; i++) {
            const kmp_friction_view *view = &e->balance[k].friction[i];
            KMP_TABULATE(table, "%d %s %g %g %g", k, view->element->name, view->force, view->largest,
                         view->largest > 0 ? view->needs / view->largest : NAN);
        }
}

static void fill_contacts(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    kmp_tabulate_columns(table, "equilibrium contact[words] gap force word[words]");
    for (int k = 0; k < e->count; k++)
        for (int i = 0; i < e->balance[k].contact_count; i++) {
            const kmp_balance_contact *c = &e->balance[k].contact[i];
            KMP_TABULATE(table, "%d %s %g %g %s", k, c->element->name, c->gap, c->force, kmp_contact_text(c->word));
        }
}

static void fill_rest(kempe_table *table, const void *result)
{
    const kempe_equilibrium *e = result;
    const kempe_system *s = e->system;
    kmp_tabulate_columns(table, "equilibrium element[words] coordinate[words] value end[words]");
    kmp_tabulate_quantity(table, s, KMP_QUANTITY_Q);
    for (int k = 0; k < e->count; k++)
        for (int i = 0; i < 2 * e->balance[k].set_count; i++) {
            const kmp_rest_set *set = &e->balance[k].set[i / 2];
            const kmp_rest_end *end = &set->end[i % 2];
            KMP_TABULATE(table, "%d %s %s %g %s", k, set->element->name, s->model->motions[set->coordinate].name,
                         end->q[set->coordinate], kmp_rest_text(end->word));
            kmp_tabulate_values(table, s, KMP_QUANTITY_Q, end->q);
        }
}

KMP_TABLES(kempe_equilibrium, equilibrium, equilibrium->requested->context, {"equilibria", fill_equilibria},
           {"contacts", fill_contacts}, {"friction", fill_friction}, {"rest", fill_rest}, {"history", fill_history},
           {"reactions", fill_reactions})
