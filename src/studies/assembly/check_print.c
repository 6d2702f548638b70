/* SPDX-License-Identifier: BSD-3-Clause */
/* `check` for a person: a short form with the verdict, or one paragraph a question. */
#include "studies/assembly/check_print.h"
#include "model/print/model_print.h"
#include <math.h>
#include <stdarg.h>

enum { MOST_LISTED = 12, MOST_RANGES = 4 };
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

static void line(kmp_text *text, const char *word, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* A line after its label. */
static void line(kmp_text *text, const char *word, const char *format, ...)
{
    label(text, word);
    KMP_TEXT_ARGUMENTS(text, format);
    kmp_text_put(text, "\n");
}

/* A line of its own when `write` gives a sentence. */
static void sentence(kmp_text *text, const kempe_check *check, const char *word,
                     void (*write)(kmp_text *, const kempe_check *))
{
    kmp_text s = {0};
    write(&s, check);
    if (s.s && s.length > 0)
        line(text, word, "%s", s.s);
    kmp_text_free_part(text, &s);
}

/* Item k of a list, without the end of its line. */
typedef void item(kmp_text *text, const kempe_check *check, int k);

/* A line for each item, the first ones of many; `next` labels all but the first. */
static void list(kmp_text *text, const kempe_check *check, const char *first, const char *next, int count, item *put)
{
    for (int k = 0; k < count && k < MOST_LISTED; k++) {
        label(text, k ? next : first);
        put(text, check, k);
        kmp_text_put(text, "\n");
    }
    if (count > MOST_LISTED)
        line(text, "", "and %d more", count - MOST_LISTED);
}

static void write_unused(kmp_text *text, const kempe_check *check)
{
    kmp_print_unused(text, check->system->model);
}

static void show_mobility(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    int vanished = check->diagnosis.declared - part->m;
    line(text, "bodies", "%d", check->body_count);
    line(text, "coordinates", "%d", part->n);
    line(text, "closures", "%d with %d row%s, of rank %d", check->loop_count, part->m, part->m == 1 ? "" : "s",
         part->r);
    if (vanished > 0)
        line(text, "", "(%d more vanish identically, as out-of-plane rows do)", vanished);
    if (check->driven > 0)
        line(text, "degrees of freedom", "%d remaining, %d driven", part->p, check->driven);
    else
        line(text, "degrees of freedom", "%d", part->p);
    if (part->p == 0)
        line(text, "", check->system->rheonomic ? "all motion is prescribed" : "the mechanism cannot move");
    if (check->undetermined)
        line(text, "no run is possible", "%s", check->undetermined);
    sentence(text, check, "", kmp_check_mobility);
    sentence(text, check, "", kmp_check_second);
    if (check->diagnosis.ran && check->diagnosis.margin > 0 && check->diagnosis.margin < 1e-4)
        line(text, "", "a change point (bifurcation) is near: the last pivot is %.2g of its usual size",
             check->diagnosis.margin);
    label(text, "redundant rows");
    kmp_list_rows(text, check->system, part->m - part->r, part->redundant);
    kmp_text_put(text, "\n");
    kmp_print_rounding(text, check->system, "  rounded drawing      ", "                       ");
}

static void put_cut(kmp_text *text, const kempe_check *check, int k)
{
    kmp_cut_print(text, &check->system->model->cuts[k]);
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

static void put_shaped(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_body *body = shaped(check, k);
    const kmp_number *com = body->com;
    kmp_text_printf(text, "%s: %.6g kg, centre [%.6g, %.6g, %.6g] m, inertia", body->name, body->mass.value,
                    com[0].value, com[1].value, com[2].value);
    for (int i = 0; i < 6; i++)
        if (i < 3 || body->inertia[i].value != 0)
            kmp_text_printf(text, " %s %.6g", kmp_inertia_names[i], body->inertia[i].value);
    kmp_text_put(text, " kg m^2");
}

/* Bodies with mass or without it (`heavy`), whose inertia is zero. */
static void show_bare(kmp_text *text, const kempe_check *check, const char *word, bool heavy)
{
    const kempe_model *model = check->given->model;
    int listed = 0;
    for (int b = 1; b < model->body_count; b++)
        if (kmp_body_is_bare(&model->bodies[b]) && (model->bodies[b].mass.value != 0) == heavy) {
            if (listed == 0)
                label(text, word);
            kmp_text_printf(text, "%s%s", listed++ ? ", " : "", model->bodies[b].name);
        }
    kmp_text_put(text, listed ? "\n" : "");
}

/* -- redundancy -------------------------------------------------------------------------------------- */

static void put_set(kmp_text *text, const kempe_check *check, int k)
{
    const kmp_diagnosis *d = &check->diagnosis;
    kmp_list_rows(text, check->system, d->sets[k].count, d->sets[k].rows);
    if (d->sets[k].count == 1)
        kmp_text_put(text, " constrains nothing");
    if (d->moved)
        kmp_text_put(text, d->sets[k].always ? ": always" : ": only in this position");
}

static void put_repair(kmp_text *text, const kempe_check *check, int k)
{
    kmp_check_repair(text, check, &check->diagnosis.repairs[k]);
}

static void show_shared(kmp_text *text, const kempe_check *check)
{
    const kmp_diagnosis *d = &check->diagnosis;
    if (d->loads.loaded) {
        label(text, "loads not unique");
        (void)kmp_put_shared_loads(text, check->system->model, &d->loads);
        kmp_text_put(text, "\n");
    }
    if (d->shared_count == 0)
        return;
    label(text, "reactions not unique");
    kmp_list_rows(text, check->system, d->shared_count, d->shared_rows);
    kmp_text_put(text, "\n");
}

/* -- choice ------------------------------------------------------------------------------------------ */

/* The dependent coordinates that could, or could not, be independent instead. */
static void show_alternatives(kmp_text *text, const kempe_check *check, bool usable, const char *word)
{
    const kmp_diagnosis *d = &check->diagnosis;
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

/* At most so many names. */
static void show_independent(kmp_text *text, const kempe_check *check, int most)
{
    const kmp_partition *part = &check->part;
    label(text, "independent, u");
    kmp_list_names(text, check->system, kmp_name_of_coordinate, part->p < most ? part->p : most, part->u);
    if (part->p > most)
        kmp_text_printf(text, " and %d more", part->p - most);
    kmp_text_put(text, "\n");
}

/* States, on which no closure depends. */
static void show_states(kmp_text *text, const kempe_check *check)
{
    const kempe_model *model = check->given->model;
    if (model->state_count == 0)
        return;
    label(text, "states");
    for (int k = 0; k < model->state_count; k++)
        kmp_text_printf(text, "%s%s", k ? ", " : "", model->states[k].name);
    kmp_text_put(text, "\n");
}

static void show_choice(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    kmp_text_put(text, "\n");
    show_independent(text, check, part->p);
    show_states(text, check);
    label(text, "dependent, v");
    kmp_list_names(text, check->system, kmp_name_of_coordinate, part->r, part->v);
    kmp_text_put(text, "\n");
    label(text, "why");
    kmp_text_put(text, part->user     ? "requested"
                       : part->r == 0 ? "there are no loops: all coordinates are independent"
                                      : "v has the largest pivots of the scaled J, so that v depends least on u");
    if (part->exchanges > 0)
        kmp_text_printf(text, ";\n%23sthen %d exchange%s between u and v where |Bvu| was above 2", "", part->exchanges,
                        part->exchanges == 1 ? "" : "s");
    kmp_text_put(text, "\n");
    int count = part->m < part->n ? part->m : part->n;
    label(text, "pivots");
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%.3g",
                        k == 0         ? ""
                        : k == part->r ? " | "
                                       : " ",
                        part->pivots[k] > ROUNDING * part->pivots[0] ? part->pivots[k] : 0);
    kmp_text_put(text, count ? "\n" : "none\n");
    line(text, "condition of Jv", "%.3g", check->condition);
    line(text, "max |Bvu|", "%.3g", part->max_b);
    show_alternatives(text, check, true, "alternatives (|Bvu|)");
    show_alternatives(text, check, false, "cannot be u here");
}

/* -- limits of motion -------------------------------------------------------------------------------- */

/* The ranges of at most so many coordinates, or none. */
static void show_limits(kmp_text *text, const kempe_check *check, int most)
{
    const kmp_limits *l = &check->diagnosis.limits;
    line(text, "limits of motion", "%s",
         !l->walked ? (l->why_not ? l->why_not : "not followed")
         : l->cycle ? "the motion is a closed cycle"
                    : l->ended);
    if (!l->walked)
        return;
    int width = kmp_print_width(check->system, KMP_QUANTITY_Q);
    for (int k = 0; check->system->n <= most && k < check->system->n; k++) {
        label(text, "");
        kmp_text_printf(text, "%-*s  ", width, name_of(check, k));
        kmp_check_swing(text, check, k);
        kmp_text_put(text, "\n");
    }
    int u = check->part.u[0];
    for (int i = 0; i < l->landmark_count; i++) {
        const kmp_landmark *mark = &l->landmark[i];
        if (mark->coordinate >= 0)
            continue;
        const char *name = name_of(check, u), *unit = kmp_print_unit(check->system, u);
        double at = kmp_print_value(check->system, u, mark->q[u]);
        if (mark->margin > 0)
            line(text, "near change point", "at %s = %.6g %s: the last pivot falls to %.2g of its usual size", name, at,
                 unit, mark->margin);
        else
            line(text, "change point", "at %s = %.6g %s: a bifurcation, branches meet there", name, at, unit);
    }
}

/* -- failed assembly --------------------------------------------------------------------------------- */

static void put_culprit(kmp_text *text, const kempe_check *check, int k)
{
    kmp_assembly_put_open(text, check->assembly, check->assembly->culprits[k]);
}

static void put_reach(kmp_text *text, const kempe_check *check, int k)
{
    kmp_check_reach(text, check, &check->obstacle.reaches[k]);
}

static void put_release(kmp_text *text, const kempe_check *check, int k)
{
    kmp_check_release(text, check, &check->obstacle.releases[k]);
}

/* The parts that both forms begin with. False: there is no more to say. */
static bool show_begin(kmp_text *text, const kempe_check *check)
{
    kmp_text_printf(text, "%s%s%s\n", check->system->model->name, check->status == KEMPE_UNTRUSTED ? ": " : "",
                    check->status == KEMPE_UNTRUSTED ? kmp_status_word(check->status) : "");
    label(text, "verdict");
    kmp_check_verdict(text, check);
    kmp_text_put(text, "\n");
    sentence(text, check, "unused parameters", write_unused);
    if (check->assembled)
        show_mobility(text, check);
    list(text, check, "cut joints", "", check->system->model->cut_count, put_cut);
    int count = 0;
    while (shaped(check, count))
        count++;
    list(text, check, "mass by shapes", "", count, put_shaped);
    show_bare(text, check, "without inertia", true);
    show_bare(text, check, "without mass", false);
    if (!check->assembled) {
        if (check->assembly->turned)
            line(text, "does not assemble", "axes that should be parallel are turned by more than a right angle");
        else if (check->assembly->gap > 0)
            line(text, "does not assemble", "the smallest gap found is %.6g m", check->assembly->gap);
        else
            line(text, "does not assemble", "the smallest angle found is %.4g deg",
                 check->assembly->turn * 180 / acos(-1));
        list(text, check, "open loops", "", check->assembly->culprit_count, put_culprit);
        list(text, check, "lengths", "", check->obstacle.reach_count, put_reach);
        list(text, check, "held coordinates", "", check->obstacle.release_count, put_release);
    }
    return check->assembled;
}

static void show_short(kmp_text *text, const void *result)
{
    const kempe_check *check = result;
    if (!show_begin(text, check))
        return;
    show_shared(text, check);
    show_independent(text, check, MOST_LISTED);
    show_states(text, check);
    show_limits(text, check, MOST_RANGES);
    line(text, "details", "with --all");
}

static void show_all(kmp_text *text, const void *result)
{
    const kempe_check *check = result;
    if (!show_begin(text, check))
        return;
    const kmp_diagnosis *d = &check->diagnosis;
    if (!d->ran)
        line(text, "not examined", "%s", d->why_not);
    list(text, check, "dependent sets", "", d->set_count, put_set);
    show_shared(text, check);
    if (d->repairs_skipped)
        line(text, "removable closures", "not examined: too many rows");
    list(text, check, "removable closures", "or", d->repair_count, put_repair);
    show_choice(text, check);
    label(text, "blocks of Jv");
    for (int b = 0; b < d->block_count; b++) {
        const kmp_loop_block *block = &d->blocks[b];
        kmp_text_put(text, b ? " -> {" : "{");
        kmp_list_names(text, check->system, kmp_name_of_coordinate, block->size, block->columns);
        kmp_text_put(text, "} by ");
        kmp_list_names(text, check->system, kmp_name_of_closure, block->closure_count, block->closures);
    }
    kmp_text_put(text, d->block_count > 0 ? "\n" : "none\n");
    kmp_text_put(text, "\n");
    show_limits(text, check, check->system->n);
}

kempe_status kempe_check_print(const kempe_check *check, kempe_format format, char **text)
{
    KMP_WANTED(NULL, check, "check");
    kmp_put_fn *put = format == KEMPE_JSON ? kmp_check_json : format == KEMPE_FULL_TEXT ? show_all : show_short;
    return kmp_print_result(check->system->context, put, check, text);
}
