/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints of the tree, then closures, in the order of the model. A joint whose reaction is not known, or is not the
 * whole load of its bearing, has a note. */
#include "output/reactions.h"
#include "base/memory.h"
#include "constraints/kinds/kind.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/data/tyre.h"
#include "model/language/expression_value.h"
#include "model/read/read_compliant.h"
#include "output/print.h"
#include "output/result_table.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Joints in a text; the second line of a sentence; columns of values and of times. */
enum { MOST_SHOWN = 12, INDENT = 4, VALUE = 14, TIME = 10 };

/* The most closures times bodies of models whose redundant constraints are searched for: the search takes a time of
 * this size, and of no less than half a second above it. */
enum { MOST_EXAMINED = 200000 };

static const char *const component_of[3] = {"x", "y", "z"};

/* -- the list ------------------------------------------------------------------------------------------- */

static kmp_reaction *add(kmp_reactions *r, const char *name, const char *kind)
{
    kmp_reaction *made = &r->of[r->count++];
    *made = (kmp_reaction){.name = name, .kind = kind, .body = -1, .closure = -1, .place = -1};
    for (int k = 0; k < 2; k++)
        made->peak[k] = (kmp_reaction_peak){NAN, NAN, {NAN, NAN, NAN}};
    return made;
}

/* True for a contact in the clearance of a joint, by its name: the name of the joint, or followed by what it is. */
static bool is_in_clearance(const kmp_force *force, const char *joint)
{
    const size_t length = strlen(joint);
    const char *rest = force->name + length;
    if (strncmp(force->name, joint, length) != 0)
        return false;
    if (force->kind != KMP_FORCE_COMPLIANT || !*rest)
        return force->kind == KMP_FORCE_COMPLIANT || (force->kind == KMP_FORCE_TOUCH && strcmp(rest, "_journal") == 0);
    for (int k = 0; *rest == '_' && kmp_guide_corner(k); k++)
        if (strcmp(rest + 1, kmp_guide_corner(k)) == 0)
            return true;
    return false;
}

/* These contacts carry what the joint leaves free. */
static const char *note_of_clearance(kmp_reactions *r, const char *joint)
{
    const kempe_model *model = r->system->model;
    for (int k = 0; k < model->force_count; k++)
        if (is_in_clearance(&model->forces[k], joint))
            return kmp_arena_printf(&r->arena, "without the contact in its clearance, force(%s)",
                                    model->forces[k].name);
    return NULL;
}

/* A joint of the tree that constrains something: whether it has a force, and a moment. False for one that is a closure,
 * or constrains nothing. */
static bool joint_has(const kempe_model *model, int body, bool has[2])
{
    const kmp_body *b = &model->bodies[body];
    int moving[2] = {0, 0}, first = kmp_joint_first_free(b);
    for (int k = first; k < first + kmp_joint_free_count(b); k++)
        moving[model->motions[k].rotation]++;
    for (int k = 0; k < 2; k++)
        has[k] = moving[k] < 3;
    return (has[0] || has[1]) && kmp_name_find(KMP_NAMED(model, closure), b->joint) < 0;
}

/* A closure that is in the table of reactions. */
static bool is_listed(const kmp_closure *closure)
{
    return !kmp_closure_is_of_modes(closure) && closure->kind != KMP_CLOSURE_lock;
}

int kmp_reactions_name(const kempe_model *model, bool moment, const char **names)
{
    int count = 0;
    bool has[2];
    for (int b = 1; b < model->body_count; b++)
        if (joint_has(model, b, has) && has[moment] && !kmp_joint_obstacle(model, b) && !model->bodies[b].coupling)
            names[count++] = model->bodies[b].joint;
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure_parts *kind = kmp_closure_parts_of(model->closures[c].kind);
        const int rows = (moment ? kind->moment : kind->force)->rows;
        if (is_listed(&model->closures[c]) && rows > 0 && kind->force->load != kmp_part_effort)
            names[count++] = model->closures[c].name;
    }
    return count;
}

/* Of a joint of the tree, unless it is a closure or constrains nothing; `place`: of its load, -1: it is not known. */
static void add_joint(kmp_reactions *r, int body, int place)
{
    const kempe_model *model = r->system->model;
    const kmp_body *b = &model->bodies[body];
    bool has[2];
    if (!joint_has(model, body, has))
        return;
    kmp_reaction *made = add(r, b->joint, "joint");
    made->body = body;
    made->place = place;
    memcpy(made->has, has, sizeof has);
    if (made->place < 0)
        made->note = kmp_joint_free_count(b) == 0
                         ? "not known, because bodies that are welded are one; 'cut: yes' gives it"
                         : "not known, because translations are before and after a rotation";
    else
        made->note = note_of_clearance(r, b->joint);
}

static bool is_of_motion(const kmp_expr *e, const void *user)
{
    return (e->kind == KMP_EXPR_Q || e->kind == KMP_EXPR_QD) && e->index == *(const int *)user;
}

static bool moves(const kmp_closure *closure, int motion)
{
    for (int k = 0; k < closure->term_count; k++)
        if (closure->terms[k].motion == motion)
            return true;
    return kmp_expr_find(closure->function, is_of_motion, &motion);
}

/* Notes that a coupling of coordinates acts on joints of several bodies without forces in space. */
static void note_coupling(kmp_reactions *r, const kmp_closure *closure)
{
    const kempe_model *model = r->system->model;
    int bodies = 0, last = -1;
    char *note = NULL;
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < model->motion_count; k++) {
            const int body = model->motions[k].body;
            if (model->motions[k].elastic || !moves(closure, k))
                continue;
            bodies += pass == 0 && body != last;
            last = body;
            for (int i = 0; pass == 1 && i < r->count; i++)
                if (r->of[i].body == body && !r->of[i].note)
                    r->of[i].note = note;
        }
        if (bodies < 2)
            return;
        if (pass == 0)
            note = kmp_arena_printf(&r->arena,
                                    "without the force between the bodies of '%s', which acts on coordinates only",
                                    closure->name);
    }
}

/* The efforts of drives, couplers and other rows on coordinates have the unit of their multiplier. */
static void add_closure(kmp_reactions *r, int c)
{
    const kmp_closure *closure = &r->system->model->closures[c];
    const kmp_closure_parts *kind = kmp_closure_parts_of(closure->kind);
    kmp_reaction *made = add(r, closure->name, kmp_closure_word(closure));
    made->closure = c;
    made->place = c;
    made->effort = kind->force->load == kmp_part_effort;
    made->has[0] = kind->force->rows > 0;
    made->has[1] = kind->moment->rows > 0;
    for (int k = 0; made->effort && k < r->system->m; k++)
        if (r->system->rows[k].closure == c) {
            const char *unit = kmp_quantity_unit(r->system, KMP_QUANTITY_LAMBDA, k);
            made->has[0] = strcmp(unit, "N") == 0;
            made->has[1] = strcmp(unit, "N m") == 0;
            made->note = made->has[0] || made->has[1] ? NULL : "its multiplier is neither a force nor a moment";
            made->place = made->note ? -1 : c;
        }
    made->note = made->note ? made->note : note_of_clearance(r, closure->name);
    if (!closure->gear)
        note_coupling(r, closure);
}

kempe_status kmp_reactions_init(kmp_reactions *r, const kempe_system *system, const kmp_all_loads *loads, bool drives)
{
    const kempe_model *model = system->model;
    *r = (kmp_reactions){.system = system, .loads = kmp_all_loads_count(loads, model), .not_unique = ""};
    r->of = KMP_ARENA_NEW(&r->arena, kmp_reaction, model->body_count + model->closure_count + model->tyre_count);
    r->last = KMP_ARENA_NEW(&r->arena, double, r->loads + 1);
    for (int b = 1, k = 0; r->of && b < model->body_count; b++) { /* loads->joint has increasing bodies */
        const bool known = k < loads->joints && loads->joint[k] == b;
        add_joint(r, b, known ? model->closure_count + k : -1);
        k += known;
    }
    for (int c = 0; r->of && c < model->closure_count; c++) {
        const kmp_closure *closure = &model->closures[c];
        if (is_listed(closure) && (drives || !kmp_closure_is_drive(closure)))
            add_closure(r, c);
    }
    for (int k = 0; r->of && k < loads->tyres; k++) {
        kmp_reaction *made = add(r, model->tyres[k].name, "tyre");
        made->place = model->closure_count + loads->joints + k;
        made->has[0] = made->has[1] = true;
        made->note = "force and moment on the wheel, along the axes of its contact";
    }
    return kmp_made(system->context, !r->arena.failed);
}

KMP_CLEARS(kmp_reactions, reactions, kmp_arena_free(&reactions->arena))

/* -- rows ----------------------------------------------------------------------------------------------- */

static const double *load_of(const kmp_reaction *of, int k, const double *loads)
{
    return loads + (ptrdiff_t)KMP_LOAD_VALUES * of->place + (of->effort ? 0 : 3 * k);
}

double kmp_reaction_size(const kmp_reaction *of, int k, const double *loads)
{
    const double *x = load_of(of, k, loads);
    return of->effort ? fabs(x[0]) : sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
}

void kmp_reaction_peak_take(kmp_reaction_peak *peak, double t, double size, const double *x, int count)
{
    if (!isfinite(size) || size <= peak->size * (1 + KMP_PRINT_NOISE))
        return;
    *peak = (kmp_reaction_peak){size, t, {x[0] + 0.0, count < 3 ? NAN : x[1] + 0.0, count < 3 ? NAN : x[2] + 0.0}};
}

void kmp_reactions_add(kmp_reactions *r, double t, const double *loads)
{
    memcpy(r->last, loads, (size_t)r->loads * sizeof *loads);
    if (r->kept)
        memcpy(r->kept + (ptrdiff_t)r->loads * r->rows, loads, (size_t)r->loads * sizeof *loads);
    r->rows++;
    kmp_reactions_meet(r, t, loads);
}

void kmp_reactions_meet(kmp_reactions *r, double t, const double *loads)
{
    for (kmp_reaction *of = r->of; of < r->of + r->count; of++)
        for (int k = 0; of->place >= 0 && k < 2; k++)
            if (of->has[k])
                kmp_reaction_peak_take(&of->peak[k], t, kmp_reaction_size(of, k, loads), load_of(of, k, loads),
                                       of->effort ? 1 : 3);
}

void kmp_reactions_take_whole(kmp_reactions *r, const kmp_reactions *whole)
{
    r->whole = whole->whole;
    r->from = whole->from;
    r->until = whole->until;
    for (int i = 0; r->whole && i < r->count; i++)
        memcpy(r->of[i].peak, whole->of[i].peak, sizeof r->of[i].peak);
}

kempe_status kmp_reactions_keep(kmp_reactions *r, int rows)
{
    r->kept = KMP_ARENA_NEW(&r->arena, double, (size_t)rows *(size_t)r->loads + 1);
    return kmp_made(r->system->context, r->kept);
}

kempe_status kmp_reactions_mark(kmp_reactions *r, const kmp_shared_loads *shared)
{
    kmp_text names = {0};
    for (kmp_reaction *of = r->of; shared->matters && of < r->of + r->count; of++)
        for (int i = 0; i < KMP_LOAD_SIZE && (of->body >= 0 || of->closure >= 0); i++)
            if ((of->body >= 0 ? shared->of_body[of->body] : shared->of_closure[of->closure])[i])
                of->shared |= 1u << i;
    if (shared->matters)
        (void)kmp_put_shared_loads(&names, r->system->model, shared);
    r->not_unique = names.failed ? NULL : kmp_arena_strdup(&r->arena, names.s ? names.s : "");
    kmp_text_free(&names);
    return kmp_made(r->system->context, r->not_unique);
}

kempe_status kmp_reactions_share(kmp_reactions *r, kmp_evaluator *eval, const kmp_all_loads *loads,
                                 const kmp_instant *at, double *values)
{
    const kempe_status status =
        r->least_norm ? kmp_least_norm_loads(eval, at->t, at->q, loads->joints, loads->joint, values) : KEMPE_OK;
    if (status != KEMPE_E_FAILED)
        return status;
    r->least_norm = false;
    r->instead = kmp_arena_strdup(&r->arena, kempe_context_message(r->system->context));
    kmp_context_clear(r->system->context);
    return kmp_made(r->system->context, r->instead);
}

static kempe_status take_rows(kmp_reactions *r, kmp_evaluator *eval, kmp_all_loads *loads, const kmp_samples *rows)
{
    kmp_present_inputs inputs;
    double *values = KMP_ARENA_NEW(&r->arena, double, r->loads + 1);
    KMP_TRY(kmp_made(r->system->context, values && kmp_present_inputs_init(&inputs, &r->arena, r->system->model)));
    inputs.before = true;
    for (int row = 0; r->loads > 0 && row < rows->rows; row++) {
        const kmp_instant at = {.t = kmp_samples_instant(rows, row),
                                .q = kmp_samples_get(rows, KMP_QUANTITY_Q, row),
                                .qd = kmp_samples_get(rows, KMP_QUANTITY_QD, row),
                                .qdd = kmp_samples_get(rows, KMP_QUANTITY_QDD, row),
                                .lambda = kmp_samples_get(rows, KMP_QUANTITY_LAMBDA, row),
                                .inputs = &inputs};
        memcpy(values, kmp_all_loads_at(loads, &at), (size_t)r->loads * sizeof *values);
        KMP_TRY(kmp_reactions_share(r, eval, loads, &at, values));
        kmp_reactions_add(r, at.t, values);
    }
    return KEMPE_OK;
}

static kempe_status find_shared(kmp_reactions *r, kmp_evaluator *eval, const kmp_all_loads *loads,
                                const kmp_samples *rows)
{
    const int last = rows->rows - 1;
    const kempe_model *model = r->system->model;
    if (!eval || last < 0)
        return KEMPE_OK;
    r->unexamined = (double)model->closure_count * model->body_count > MOST_EXAMINED;
    if (r->unexamined)
        return KEMPE_OK;
    const double t[2] = {kmp_samples_time(rows, 0), kmp_samples_time(rows, last)};
    const double *const q[2] = {kmp_samples_get(rows, KMP_QUANTITY_Q, 0), kmp_samples_get(rows, KMP_QUANTITY_Q, last)};
    kmp_shared_loads found;
    KMP_TRY(kmp_shared_loads_between(eval, t, q, loads->joints, loads->joint, r->last, &r->arena, &found));
    return kmp_reactions_mark(r, &found);
}

static kempe_status take_all(kmp_reactions *r, const kempe_system *system, const kmp_samples *rows, bool least_norm,
                             bool keep)
{
    kmp_all_loads loads;
    kmp_evaluator *eval = NULL;
    *r = (kmp_reactions){0};
    kempe_status status = kmp_all_loads_init(&loads, system);
    if (status == KEMPE_OK)
        status = kmp_reactions_init(r, system, &loads, true);
    if (status == KEMPE_OK && system->model->closure_count > 0) {
        eval = kmp_eval_new_of_closures(system);
        status = eval ? KEMPE_OK : KEMPE_E_MEMORY;
    }
    r->least_norm = least_norm && eval;
    if (status == KEMPE_OK && keep)
        status = kmp_reactions_keep(r, rows->rows);
    if (status == KEMPE_OK)
        status = take_rows(r, eval, &loads, rows);
    if (status == KEMPE_OK && !keep)
        status = find_shared(r, eval, &loads, rows);
    kmp_eval_free(eval);
    kmp_all_loads_free(&loads);
    return status;
}

kempe_status kmp_reactions_of_rows(kmp_reactions *r, const kempe_system *system, const kmp_samples *rows,
                                   bool least_norm)
{
    return take_all(r, system, rows, least_norm, false);
}

kempe_status kmp_reactions_keep_rows(kmp_reactions *r, const kempe_system *system, const kmp_samples *rows,
                                     bool least_norm)
{
    return take_all(r, system, rows, least_norm, true);
}

/* -- text ----------------------------------------------------------------------------------------------- */

/* A text under way: the joint with the least load of the joints that it has (NULL: it has all), the width of their
 * names, and the size of rounding of forces and of moments. */
typedef struct joint_lines {
    const kmp_reactions *r;
    const kmp_reaction *least;
    int width;
    double noise[2];
} joint_lines;

static void find_noise(joint_lines *t)
{
    const kmp_reactions *r = t->r;
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++)
        for (int k = 0; k < 2; k++)
            t->noise[k] = fmax(t->noise[k], KMP_PRINT_NOISE * (isnan(of->peak[k].size) ? 0 : of->peak[k].size));
    t->noise[1] = fmax(t->noise[1], t->noise[0] * r->system->length);
    t->noise[0] = fmax(t->noise[0], t->noise[1] / r->system->length);
}

static double weight_of(const kmp_reactions *r, const kmp_reaction *of)
{
    return fmax(of->peak[0].size, isnan(of->peak[1].size) ? 0 : of->peak[1].size / r->system->length);
}

/* True if joint a has a larger load than b, or the same and comes before it. */
static bool is_larger(const kmp_reactions *r, const kmp_reaction *a, const kmp_reaction *b)
{
    const double x = weight_of(r, a), y = weight_of(r, b);
    return x > y || (x == y && a < b);
}

static bool is_shown(const joint_lines *t, const kmp_reaction *of)
{
    return of->place >= 0 && (!t->least || !is_larger(t->r, t->least, of));
}

/* Finds the last one of the MOST_SHOWN largest loads; NULL: there are not more. */
static void find_least(joint_lines *t)
{
    const kmp_reaction *largest[MOST_SHOWN + 1];
    int count = 0, known = 0;
    for (const kmp_reaction *of = t->r->of; of < t->r->of + t->r->count; of++) {
        if (of->place < 0)
            continue;
        int at = count;
        for (; at > 0 && is_larger(t->r, of, largest[at - 1]); at--)
            largest[at] = largest[at - 1];
        largest[at] = of;
        count += count < MOST_SHOWN;
        known++;
    }
    t->least = known > MOST_SHOWN ? largest[MOST_SHOWN - 1] : NULL;
}

/* "A", "motor (drive)", with * where it is not unique. */
static void put_labelled(kmp_text *text, const kmp_reaction *of, int width)
{
    kmp_text label = {0};
    kmp_text_put(&label, of->name);
    if (of->effort)
        kmp_text_printf(&label, " (%s)", of->kind);
    kmp_text_put(&label, of->shared ? " *" : "");
    kmp_text_printf(text, "  %-*s", width, label.s ? label.s : "");
    kmp_text_free_part(text, &label);
}

/* "force, N" in the unit that texts have; returns its factor. */
static double unit_title(const kmp_reactions *r, int k, char title[40])
{
    const kmp_shown as = kmp_shown_as(r->system->context, k ? "N m" : "N");
    (void)snprintf(title, 40, "%s, %s", k ? "moment" : "force", as.unit);
    return as.factor;
}

static void show_peaks(kmp_text *text, const joint_lines *t)
{
    const kmp_reactions *r = t->r;
    char title[2][40];
    const double factor[2] = {unit_title(r, 0, title[0]), unit_title(r, 1, title[1])};
    kmp_text_printf(text, "  %-*s  %*s  %*s  %*s  %*s\n", t->width, "", VALUE, title[0], TIME, "at t, s", VALUE,
                    title[1], TIME, "at t, s");
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++) {
        if (!is_shown(t, of))
            continue;
        put_labelled(text, of, t->width);
        for (int k = 0; k < 2; k++) {
            const kmp_reaction_peak *peak = &of->peak[k];
            const bool zero = peak->size <= t->noise[k];
            kmp_print_cells(text, "  %*.6g", VALUE, zero ? 0.0 : factor[k] * peak->size);
            kmp_print_cells(text, "  %*.6g", TIME, zero ? NAN : peak->t);
        }
        kmp_text_put(text, "\n");
    }
}

/* The vectors of a single row; nothing where all moments are zero. */
static void show_vectors(kmp_text *text, const joint_lines *t, int k)
{
    const kmp_reactions *r = t->r;
    char title[40];
    const double factor = unit_title(r, k, title);
    bool any = k == 0;
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++)
        any = any || (is_shown(t, of) && of->peak[k].size > t->noise[k]);
    if (!any)
        return;
    kmp_text_printf(text, "  %-*s  %*s  %*s  %*s  %*s\n", t->width, "", VALUE, title, VALUE, "x", VALUE, "y", VALUE,
                    "z");
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++) {
        const kmp_reaction_peak *peak = &of->peak[k];
        if (!is_shown(t, of) || isnan(peak->size))
            continue;
        put_labelled(text, of, t->width);
        kmp_print_cells(text, "  %*.6g", VALUE, factor * kmp_print_clean(peak->size, t->noise[k]));
        for (int i = 0; i < 3; i++)
            kmp_print_cells(text, "  %*.6g", VALUE,
                            of->effort ? NAN : factor * kmp_print_clean(peak->x[i], t->noise[k]));
        kmp_text_put(text, "\n");
    }
}

/* Each note once, behind the names of its joints. */
static void show_notes(kmp_text *text, const kmp_reactions *r)
{
    for (int i = 0; i < r->count; i++) {
        const char *note = r->of[i].note;
        bool before = !note;
        for (int k = 0; k < i && !before; k++)
            before = r->of[k].note && strcmp(r->of[k].note, note) == 0;
        if (before)
            continue;
        kmp_text line = {0};
        for (int k = i; k < r->count; k++)
            if (r->of[k].note && strcmp(r->of[k].note, note) == 0)
                kmp_text_printf(&line, "%s%s", k > i ? ", " : "", r->of[k].name);
        kmp_text_printf(&line, ": %s", note);
        kmp_print_wrapped(text, "  ", INDENT, line.s ? line.s : "");
        kmp_text_free_part(text, &line);
    }
}

static void show_not_unique(kmp_text *text, const kmp_reactions *r)
{
    kmp_text line = {0};
    if (r->unexamined)
        kmp_print_wrapped(text, "  ", INDENT,
                          "it is not examined which of them are unique, because the model has many loops and bodies");
    if (!*r->not_unique)
        return;
    kmp_text_printf(&line, "* not unique, because redundant constraints share the load; these are %s",
                    r->least_norm ? "the loads of least norm"
                    : r->instead  ? "one solution"
                                  : "one solution, and --loads least-norm gives the solution of least norm");
    if (r->instead)
        kmp_text_printf(&line, ", because %s", r->instead);
    kmp_print_wrapped(text, "  ", INDENT, line.s ? line.s : "");
    kmp_text_free_part(text, &line);
}

static bool has_impacts(const kempe_model *model)
{
    bool any = false;
    for (int k = 0; k < model->force_count; k++)
        any = any || model->forces[k].kind == KMP_FORCE_TOUCH;
    return any;
}

void kmp_reactions_show(kmp_text *text, const kmp_reactions *r, const char *others)
{
    joint_lines t = {.r = r};
    int shown = 0, known = 0;
    if (others)
        find_least(&t);
    for (int i = 0; i < r->count; i++) {
        shown += is_shown(&t, &r->of[i]);
        known += r->of[i].place >= 0;
    }
    if (r->rows == 0 || r->count == 0)
        return;
    t.width = 4;
    for (const kmp_reaction *of = t.r->of; of < t.r->of + t.r->count; of++) {
        const int length = (int)strlen(of->name) + (of->effort ? (int)strlen(of->kind) + 3 : 0) + (of->shared ? 2 : 0);
        t.width = is_shown(&t, of) && length > t.width ? length : t.width;
    }
    find_noise(&t);
    kmp_text_put(text, "\njoint reactions, on the second body, in ground axes");
    const bool vectors = r->rows == 1 && !r->whole;
    if (r->whole)
        kmp_text_printf(text, ": the largest of the motion from %.6g to %.6g s%s", r->from, r->until,
                        has_impacts(r->system->model) ? ", without impacts" : "");
    else if (r->rows > 1)
        kmp_text_printf(text, ": the largest of %d rows", r->rows);
    kmp_text_put(text, "\n");
    if (shown > 0 && !vectors)
        show_peaks(text, &t);
    for (int k = 0; shown > 0 && vectors && k < 2; k++)
        show_vectors(text, &t, k);
    if (known > shown)
        kmp_text_printf(text, "  and %d smaller ones: %s\n", known - shown, others);
    show_not_unique(text, r);
    show_notes(text, r);
}

/* -- JSON and table ------------------------------------------------------------------------------------- */

static void json_peak(kmp_json *json, const char *key, const kmp_reaction *of, int k)
{
    const kmp_reaction_peak *peak = &of->peak[k];
    if (of->place < 0 || !of->has[k]) {
        kmp_json_string(json, key, NULL);
        return;
    }
    kmp_json_object(json, key);
    kmp_json_put(json, "peak %g t %g", peak->size, peak->t);
    kmp_json_numbers(json, "components", of->effort ? 1 : 3, peak->x);
    kmp_json_end(json);
}

void kmp_reactions_json(kmp_json *json, const kmp_reactions *r)
{
    if (r->whole)
        kmp_json_put(json, "reaction_peaks { of %s from %g until %g }",
                     kmp_reaction_peaks_word(KMP_REACTION_PEAKS_MOTION), r->from, r->until);
    kmp_json_array(json, "reactions");
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++) {
        kmp_json_put(json, "{ joint %s kind %s", of->name, of->kind);
        json_peak(json, "force", of, 0);
        json_peak(json, "moment", of, 1);
        if (r->unexamined)
            kmp_json_string(json, "unique", NULL);
        else
            kmp_json_boolean(json, "unique", of->shared == 0);
        kmp_json_put(json, "not_unique [");
        for (int i = 0; i < KMP_LOAD_SIZE; i++)
            if (of->shared >> i & 1)
                kmp_json_string(json, NULL, kmp_load_words[i]);
        kmp_json_put(json, "] note %s }", of->note);
    }
    kmp_json_end(json);
}

void kmp_reactions_columns(kempe_table *table)
{
    kmp_tabulate_columns(table, "joint[words] kind[words]");
    for (int k = 0; k < 2; k++) {
        const char *name = k ? "moment" : "force", *unit = k ? "N m" : "N";
        kmp_tabulate_column(table, unit, "%s", name);
        kmp_tabulate_column(table, "s", "%s.t", name);
        for (int i = 0; i < 3; i++)
            kmp_tabulate_column(table, unit, "%s.%s", name, component_of[i]);
    }
    kmp_tabulate_columns(table, "unique note[words]");
}

void kmp_reactions_tabulate(kempe_table *table, const kmp_reactions *r, int number)
{
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++) {
        kmp_tabulate_row(table);
        if (number >= 0)
            kmp_tabulate_cells(table, "%d", number);
        kmp_tabulate_cells(table, "%s %s", of->name, of->kind);
        for (int k = 0; k < 2; k++) {
            kmp_tabulate_cells(table, "%g %g", of->peak[k].size, of->peak[k].t);
            kmp_tabulate_numbers(table, 3, of->peak[k].x);
        }
        kmp_tabulate_cells(table, "%g %s", r->unexamined ? NAN : of->shared == 0, of->note ? of->note : "");
    }
}

/* Loads that are evaluated in two ways are the same up to rounding. */
#define SAME_LOAD 1e-9

bool kmp_loads_in_outputs(const kmp_all_loads *loads, const kempe_model *model, const double *before,
                          const double *values, const double *bearings, double *shown)
{
    double size = 0;
    for (int k = 0; k < KMP_LOAD_VALUES * (model->closure_count + loads->joints); k++)
        size = fmax(size, fabs(before[k]));
    for (int o = 0, at = 0; o < model->output_count; at += kmp_output_width(model, &model->outputs[o++])) {
        const kmp_output *output = &model->outputs[o];
        const bool joint = output->kind == KMP_OUTPUT_JOINT_REACTION || output->kind == KMP_OUTPUT_JOINT_MOMENT;
        const bool moment = output->kind == KMP_OUTPUT_MOMENT || output->kind == KMP_OUTPUT_JOINT_MOMENT;
        int place = output->index;
        if (bearings && output->kind == KMP_OUTPUT_BEARING)
            memcpy(shown + at, bearings + (ptrdiff_t)KMP_BEARING_VALUES * place, KMP_BEARING_VALUES * sizeof *shown);
        if (!joint && !moment && output->kind != KMP_OUTPUT_REACTION)
            continue;
        for (int k = 0; joint && k < loads->joints; k++)
            place = loads->joint[k] == output->index + 1 ? model->closure_count + k : place;
        for (int i = 0; i < 3; i++) {
            const int k = KMP_LOAD_VALUES * place + 3 * moment + i;
            if (!(fabs(shown[at + i] - before[k]) <= SAME_LOAD * size))
                return false;
            shown[at + i] = values[k];
        }
    }
    return true;
}
