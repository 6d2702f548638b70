/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as a summary to read. */
#include "model/write/model_show.h"
#include "base/memory.h"
#include "base/text.h"
#include "model/data/body.h"
#include "model/data/cam.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/compliant.h"
#include "model/data/force.h"
#include "model/data/gear.h"
#include "model/data/joint_table.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/data/outline.h"
#include "model/data/output_table.h"
#include "model/data/parameter.h"
#include "model/data/rope.h"
#include "model/data/run_settings.h"
#include "model/data/shape.h"
#include "model/data/signal.h"
#include "model/data/start.h"
#include "model/data/state.h"
#include "model/language/expression.h"
#include "model/language/nearest.h"
#include "model/read/loads.h"
#include "model/write/model_json.h"
#include "model/write/model_print.h"
#include "symbolic/table_function.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <string.h>

/* -- pieces, each after some words ----------------------------------------------------------------- */

static void put_number(kmp_text *text, const char *words, double x)
{
    kmp_text_put(text, words);
    kmp_text_number(text, x);
}

static void put_axis(kmp_text *text, const char *words, const double axis[3])
{
    kmp_text_put(text, words);
    for (int i = 0; i < 3; i++)
        put_number(text, i > 0 ? ", " : "[", axis[i]);
    kmp_text_put(text, "]");
}

static void put_vector(kmp_text *text, const char *words, const kmp_number v[3])
{
    put_axis(text, words, (const double[]){v[0].value, v[1].value, v[2].value});
}

/* x [..], z [..] */
static void put_axes(kmp_text *text, const char *words, double m[3][3])
{
    kmp_text_put(text, words);
    put_axis(text, "x ", (const double[]){m[0][0], m[1][0], m[2][0]});
    put_axis(text, ", z ", (const double[]){m[0][2], m[1][2], m[2][2]});
}

static void put_point(kmp_text *text, const char *words, const kempe_model *model, int point)
{
    kmp_text_put(text, words);
    kmp_model_put_point(text, model, point);
}

static void put_expr(kmp_text *text, const char *words, const kempe_model *model, const kmp_expr *expr)
{
    kmp_text_put(text, words);
    kmp_model_put_expr(text, model, expr);
}

/* The headline of a part of the model that is not empty. */
static void begin(kmp_text *text, const char *title, int count)
{
    if (count > 0)
        kmp_text_printf(text, "%s\n", title);
}

/* -- names and their values ------------------------------------------------------------------------ */

static void show_states(kmp_text *text, const kempe_model *model)
{
    begin(text, "states", model->state_count);
    for (int i = 0; i < model->state_count; i++) {
        const kmp_state *state = &model->states[i];
        kmp_text_printf(text, "  %s", state->name);
        put_number(text, ": start ", model->start.qd[kmp_model_coordinates(model) + i].value);
        put_number(text, ", scale ", state->scale);
        const kmp_expr *rate = kmp_state_rate(model, i);
        if (state->next && rate->a)
            put_expr(text, ", when ", model, rate->a);
        else if (state->next)
            put_number(text, ", sampled at multiples of ", state->period);
        if (state->delayed) {
            put_number(text, ", by ", state->delay.value);
            put_expr(text, " after ", model, state->delayed);
        } else {
            put_expr(text, state->next ? ", next " : ", rate ", model, state->next ? state->next : rate);
        }
        kmp_text_put(text, "\n");
    }
}

static void show_tables(kmp_text *text, const kempe_model *model)
{
    begin(text, "tables", model->table_count);
    for (int i = 0; i < model->table_count; i++) {
        const kmp_table *table = model->tables[i].table;
        const kmp_surface *s = model->tables[i].surface;
        if (s) {
            kmp_text_printf(text, "  %s: %s, %d x %d points, x from %.9g to %.9g, y from %.9g to %.9g\n",
                            model->tables[i].name, kmp_table_method_word(s->one[0]->method), s->count[0], s->count[1],
                            s->knot[0][0], s->knot[0][s->count[0] - 1], s->knot[1][0], s->knot[1][s->count[1] - 1]);
            continue;
        }
        kmp_text_printf(text, "  %s: %s, %d points, x from %.9g to %.9g", model->tables[i].name,
                        kmp_table_method_word(table->method), table->count, table->x[0], table->x[table->count - 1]);
        if (model->tables[i].periodic)
            kmp_text_printf(text, ", periodic, rise %.9g", model->tables[i].rise);
        if (model->tables[i].outside != KMP_OUTSIDE_NOT_SAID)
            kmp_text_printf(text, ", outside %s", kmp_outside_word(model->tables[i].outside));
        kmp_text_put(text, "\n");
    }
}

/* -- bodies ---------------------------------------------------------------------------------------- */

/* R3, -T1, or R[0, 0.6, 0.8] */
static void show_motion(kmp_text *text, const kmp_motion *motion)
{
    const char *letter = motion->rotation ? "R" : "T";
    for (int i = 0; i < 3; i++)
        if (motion->axis[i] == 1 || motion->axis[i] == -1) {
            kmp_text_printf(text, " %s%s%d", motion->axis[i] < 0 ? "-" : "", letter, i + 1);
            return;
        }
    put_axis(text, motion->rotation ? " R" : " T", motion->axis);
}

/* Objects by their bodies, in order: the first one of each body, and the one after each; -1: none. */
typedef struct by_body {
    int *first, *next;
} by_body;

/* `body`: the member of the first object, of `size` bytes each. False: no memory. */
static bool sort_by_body(by_body *sorted, const kempe_model *model, int count, const int *body, size_t size)
{
    *sorted = (by_body){KMP_NEW(int, model->body_count), KMP_NEW(int, count)};
    for (int b = 0; sorted->first && b < model->body_count; b++)
        sorted->first[b] = -1;
    for (int k = count - 1; body && sorted->first && sorted->next && k >= 0; k--) {
        int own = *(const int *)(const void *)((const char *)body + (size_t)k * size);
        sorted->next[k] = sorted->first[own];
        sorted->first[own] = k;
    }
    return sorted->first && sorted->next;
}

static void free_sorted(by_body *sorted)
{
    kmp_free(sorted->first);
    kmp_free(sorted->next);
}

static void show_points(kmp_text *text, const kempe_model *model, const by_body *points, int body)
{
    for (int i = points->first[body]; i >= 0; i = points->next[i]) {
        kmp_point *point = &model->points[i];
        kmp_text_printf(text, "    point %s", point->name);
        put_vector(text, " ", point->at);
        const kmp_flexible *flexible = point->station > 0 ? &model->flexibles[model->bodies[body].flexible - 1] : NULL;
        if (flexible && flexible->file)
            kmp_text_put(text, ", moves with the modes there");
        else if (flexible)
            put_number(text, ", moves with the section at ", flexible->stations[point->station - 1].at[0].value);
        if (point->turned)
            put_axes(text, ", axes ", point->axes);
        kmp_text_put(text, "\n");
    }
}

static void show_flexible(kmp_text *text, const kempe_model *model, kmp_flexible *flexible)
{
    if (flexible->file)
        kmp_text_printf(text, "    flexible: modes of '%s'", flexible->file);
    else
        put_number(text, "    flexible: beam of length ", flexible->length->value);
    if (flexible->turned)
        put_axes(text, ", axes ", flexible->axes);
    kmp_text_printf(text, ", frame %s, stiffening %s, coordinates", kmp_flexible_frame_words[flexible->frame],
                    kmp_stiffening_words[flexible->stiffening]);
    for (int k = flexible->first; k < flexible->first + flexible->count; k++)
        kmp_text_printf(text, " %s", model->motions[k].name);
    kmp_text_put(text, "\n");
}

static void show_body(kmp_text *text, const kempe_model *model, int i)
{
    kmp_body *body = &model->bodies[i];
    kmp_text_printf(text, "  %d %s: joint %s at ", i, body->name, body->joint);
    if (body->at >= 0)
        kmp_model_put_point(text, model, body->at);
    else
        kmp_text_put(text, model->bodies[body->parent].name);
    if (body->to >= 0)
        kmp_text_printf(text, " to %s", model->points[body->to].name);
    kmp_text_put(text, body->reversed ? ", reversed:" : ":");
    for (int k = 0; k < body->motion_count; k++)
        show_motion(text, &model->motions[body->first_motion + k]);
    kmp_text_put(text, body->motion_count ? "" : " weld");
    if (body->coupling) {
        kmp_text_printf(text, ", %s", kmp_joint_key(body->coupling));
        put_number(text, " ", body->number.value);
    }
    if (kmp_body_has_armature(body)) {
        kmp_text_put(text, ", armature");
        put_number(text, " ", body->armature.value);
    }
    if (body->turned)
        put_axes(text, ", frame ", body->frame);
    kmp_text_put(text, "\n");
    const kmp_body rigid = kmp_body_undeformed(model, i);
    put_number(text, "    mass ", rigid.mass.value);
    put_vector(text, ", com ", rigid.com);
    kmp_text_put(text, ", inertia");
    for (int k = 0; k < 6; k++)
        if (k < 3 || rigid.inertia[k].value != 0) {
            kmp_text_printf(text, " %s", kmp_inertia_names[k]);
            put_number(text, " ", rigid.inertia[k].value);
        }
    kmp_text_put(text, "\n");
    if (body->flexible > 0)
        show_flexible(text, model, &model->flexibles[body->flexible - 1]);
}

static void show_bodies(kmp_text *text, const kempe_model *model)
{
    by_body points, shapes;
    const kmp_point *point = model->points;
    const kmp_shape *shape = model->shapes;
    bool sorted = sort_by_body(&points, model, model->point_count, point ? &point->body : NULL, sizeof *point);
    sorted = sort_by_body(&shapes, model, model->shape_count, shape ? &shape->body : NULL, sizeof *shape) && sorted;
    kmp_text_put(text, "bodies\n  0 ground\n");
    for (int i = 0; sorted && i < model->body_count; i++) {
        if (i > 0)
            show_body(text, model, i);
        show_points(text, model, &points, i);
        for (int k = shapes.first[i]; k >= 0; k = shapes.next[k])
            kmp_model_show_shape(text, &model->shapes[k]);
    }
    text->failed = text->failed || !sorted;
    free_sorted(&points);
    free_sorted(&shapes);
}

/* -- closures -------------------------------------------------------------------------------------- */

static void show_gear(kmp_text *text, const kempe_model *model, const kmp_gear *gear)
{
    kmp_text_printf(text, "%s and %s, ", model->bodies[gear->wheel[0]].name, model->bodies[gear->wheel[1]].name);
    if (gear->teeth[0] == 0)
        kmp_text_printf(text, "radius %.6g and %.6g m", gear->number[KMP_GEAR_RADIUS_1].value,
                        gear->number[KMP_GEAR_RADIUS_2].value);
    else
        kmp_text_printf(text, "teeth %.0f and %.0f", gear->teeth[0], gear->teeth[1]);
    kmp_text_printf(text, ", axes in %s", model->bodies[gear->carrier].name);
}

/* A closure that is not between points. */
static void show_relation(kmp_text *text, const kempe_model *model, const kmp_closure *closure)
{
    if (closure->gear) {
        show_gear(text, model, closure->gear);
        return;
    }
    for (int k = 0; k < closure->term_count; k++) {
        put_number(text, k > 0 ? " + " : "", closure->terms[k].factor.value);
        kmp_text_printf(text, " %s", model->motions[closure->terms[k].motion].name);
    }
    if (closure->term_count == 0 && closure->motion >= 0)
        kmp_text_put(text, model->motions[closure->motion].name);
    if (closure->function)
        put_expr(text, closure->motion >= 0 ? " = " : "0 = ", model, closure->function);
}

static void show_between(kmp_text *text, const kempe_model *model, const kmp_closure *closure)
{
    put_point(text, "", model, closure->point[0]);
    put_point(text, " - ", model, closure->point[1]);
    const kmp_closure_number *own = kmp_closure_number_of(closure->kind);
    if (own)
        kmp_text_printf(text, ", %s ", own->key);
    if (closure->function)
        put_expr(text, "", model, closure->function);
    else if (own)
        put_number(text, "", closure->number.value);
    if (kmp_closure_has_axes(closure)) {
        put_axis(text, ", axes ", closure->axis[0]);
        put_axis(text, " and ", closure->axis[1]);
    }
    if (closure->cam) {
        kmp_text_put(text, closure->cam->form == KMP_FOLLOWER_KNIFE ? ", knife" : "");
        if (closure->cam->form == KMP_FOLLOWER_ROLLER)
            put_number(text, ", roller ", closure->cam->radius);
        if (closure->cam->form == KMP_FOLLOWER_FLAT)
            put_axis(text, ", flat ", closure->axis[1]);
        kmp_text_printf(text, ", on %s", closure->cam->outline->name);
    }
    if (closure->table)
        kmp_text_printf(text, ", table %s", closure->table->name);
    for (int k = 0; k < closure->curve_count && !closure->table; k++) {
        kmp_text_printf(text, ", %c", "0yz"[closure->curve_side[k]]);
        put_expr(text, " = ", model, closure->curve[k]);
    }
}

/* -- forces and sensors ---------------------------------------------------------------------------- */

static void show_force(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    const kmp_force_row *row = &kmp_force_rows[force->kind];
    kmp_json fields = kmp_json_begin_as(text, KMP_JSON_WORDS);
    kmp_text_printf(text, "  %s: ", force->name);
    if (force->kind == KMP_FORCE_WHEEL) {
        kmp_text_put(text, "wheel");
    } else if (force->kind == KMP_FORCE_TYRE) {
        kmp_text_put(text, "tyre");
    } else if (force->kind == KMP_FORCE_TOUCH) {
        kmp_pair_show(text, model, &force->touch);
    } else if (force->contact > 0) {
        kmp_text_printf(text, "friction of contact '%s'", model->forces[force->contact - 1].name);
    } else if (force->kind == KMP_FORCE_COMPLIANT) {
        const struct kmp_compliant *contact = force->compliant;
        if (contact->form == KMP_COMPLIANT_GAP)
            kmp_text_put(text, "contact");
        else
            put_expr(text, "contact of a journal, clearance ", model, contact->clearance);
        kmp_text_printf(text, ", %s", contact->law ? contact->law : "force");
        if (!contact->limited)
            put_expr(text, " = ", model, force->effort);
        if (force->holding_effort)
            put_expr(text, ", friction ", model, force->holding_effort);
        if (contact->film)
            kmp_text_printf(text, ", film %s", contact->film->law);
        kmp_text_put(text, "\n");
        return;
    } else if (kmp_force_is_between(force->kind)) {
        kmp_text_put(text, row->place);
        for (int k = 0; k < force->through_count + 2; k++)
            put_point(text, k > 0 ? " - " : " ", model, kmp_force_point(force, k));
        if (force->kind == KMP_FORCE_TORSION)
            kmp_text_printf(text, " about %s", kmp_axis_names[force->axis]);
    } else if (force->motion >= 0) {
        kmp_text_printf(text, "%s on %s", kmp_force_key(model, force, row->word), model->motions[force->motion].name);
    } else if (force->sliding) {
        put_expr(text, force->kind == KMP_FORCE_ALONG ? "force along " : "friction against the rate of ", model,
                 force->sliding);
    } else if (force->kind == KMP_FORCE_BODY) {
        kmp_text_printf(text, "torque on %s", model->bodies[force->body].name);
    } else {
        put_point(text, "force at ", model, force->point[0]);
    }
    fields.filled = true; /* by these words */
    kmp_model_json_fields(&fields, model, force);
    if (force->effort)
        put_expr(text, " = ", model, force->effort);
    if (force->holding_effort)
        put_expr(text, ", static ", model, force->holding_effort);
    const bool shown = force->kind != KMP_FORCE_TOUCH && force->kind != KMP_FORCE_TYRE && force->vector[0];
    for (int k = 0; k < 3 && shown && force->vector[k]; k++)
        put_expr(text, k > 0 ? ", " : " = [", model, force->vector[k]);
    kmp_text_put(text, shown ? "]\n" : "\n");
}

static void show_ropes(kmp_text *text, const kempe_model *model)
{
    static const char *const ways[] = {" right", "", " left"};
    if (model->rope_count == 0)
        return;
    begin(text, "ropes", model->rope_count);
    for (const kmp_rope *rope = model->ropes; rope < model->ropes + model->rope_count; rope++) {
        kmp_text_printf(text, "  %s: ", rope->name);
        for (int k = 0; k < rope->count; k++) {
            const kmp_rope_place *place = &rope->places[k];
            const kmp_point *point = &model->points[place->point];
            kmp_text_printf(text, "%s%s%s.%s%s", k ? ", " : "",
                            place->drum   ? "drum "
                            : place->ball ? "sphere "
                                          : "",
                            model->bodies[point->body].name, point->name, place->ball ? "" : ways[place->turn + 1]);
            if (place->turn != 0)
                kmp_text_printf(text, " %.6g m", place->radius.value);
            if (place->layers)
                kmp_text_printf(text, " by %s, %.6g rad wound", place->layers->name, place->wound);
        }
        kmp_text_put(text, rope->closed ? ", closed\n" : "\n");
    }
}

static void show_forces(kmp_text *text, const kempe_model *model)
{
    int forces = model->force_count - model->state_count; /* those after them are rates of states */
    begin(text, "forces", forces);
    for (int i = 0; i < forces; i++)
        show_force(text, model, &model->forces[i]);
    begin(text, "bearings", model->bearing_count);
    for (int i = 0; i < model->bearing_count; i++) {
        const kmp_bearing_pair *pair = &model->bearings[i];
        kmp_text_printf(text, "  %s: joint %s", pair->name, pair->joint);
        put_number(text, ", at ", pair->at[0].value);
        put_number(text, " and ", pair->at[1].value);
        put_number(text, ", life ", pair->life[0]);
        put_number(text, " and ", pair->life[1]);
        if (pair->thrust > 0)
            kmp_text_printf(text, ", thrust on %d", pair->thrust);
        kmp_text_put(text, "\n");
    }
    begin(text, "sensors", model->sensor_count);
    for (int i = 0; i < model->sensor_count; i++) {
        kmp_text_printf(text, "  %s", model->sensors[i].name);
        put_expr(text, " = ", model, model->sensors[i].expr);
        kmp_text_put(text, "\n");
    }
}

/* -- start and run --------------------------------------------------------------------------------- */

static void show_start(kmp_text *text, const kempe_model *model)
{
    const kmp_start *start = &model->start;
    kmp_text_printf(text, "coordinates (%d): start q, qd\n", kmp_model_coordinates(model));
    for (int i = 0; i < kmp_model_coordinates(model); i++) {
        kmp_text_printf(text, "  %s", model->motions[i].name);
        put_number(text, ": ", start->q[i].value);
        put_number(text, ", ", start->qd[i].value);
        kmp_text_put(text, start->hold[i] ? ", held\n" : "\n");
    }
    if (start->at)
        kmp_text_printf(text, "motions begin at: %s\n", start->at);
    begin(text, "goals: value, weight", start->goal_count);
    for (int i = 0; i < start->goal_count; i++) {
        const kmp_goal *goal = &start->goals[i];
        kmp_text_put(text, "  ");
        kmp_model_put_goal(text, model, goal);
        if (goal->width == 3) {
            put_vector(text, ": ", goal->value);
            put_vector(text, ", ", goal->weight);
        } else {
            put_number(text, ": ", goal->value[0].value);
            put_number(text, ", ", goal->weight[0].value);
        }
        kmp_text_put(text, "\n");
    }
}

static void show_run(kmp_text *text, const kempe_model *model)
{
    const kmp_run_settings *run = &model->run;
    kmp_shown_setting list[KMP_SETTINGS];
    kmp_model_settings(run, list);
    kmp_text_put(text, "run:");
    for (int k = 0; k < KMP_SETTINGS; k++) {
        if (!list[k].word && !(list[k].number > 0))
            continue;
        kmp_text_printf(text, " %s", strcmp(list[k].key, "algorithm") == 0 ? "dynamics" : list[k].key);
        if (list[k].word)
            kmp_text_printf(text, " %s", list[k].word);
        else
            put_number(text, " ", list[k].number);
    }
    for (int i = 0; i < run->independent_count; i++)
        kmp_text_printf(text, "%s%s", i == 0 ? " u " : ", ", model->motions[run->independent[i]].name);
    for (int i = 0; i < run->until_count; i++)
        put_expr(text, i == 0 ? " until " : ", ", model, run->until[i]);
    kmp_text_put(text, "\noutputs:");
    for (int i = 0; i < model->output_count; i++) {
        kmp_text_put(text, " ");
        kmp_output_print(text, model, &model->outputs[i]);
    }
    kmp_text_put(text, "\n");
}

void kmp_model_show(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, model->name);
    put_vector(text, "\ngravity ", model->gravity);
    kmp_text_put(text, "\n");
    begin(text, "parameters", model->parameter_count);
    for (int i = 0; i < model->parameter_count; i++) {
        const kmp_number *number = &model->parameters[i].number;
        kmp_text_printf(text, "  %s", model->parameters[i].name);
        put_number(text, " = ", number->value);
        if (number->expr)
            put_expr(text, "  (", model, number->expr);
        kmp_text_put(text, number->expr ? ")\n" : "\n");
    }
    begin(text, "inputs", kmp_model_given_inputs(model));
    for (int i = 0; i < kmp_model_given_inputs(model); i++) {
        const kmp_model_input *input = &model->inputs[i];
        const kmp_signal *s = &input->signal;
        kmp_text_printf(text, "  %s", input->name);
        if (s->count == 1)
            put_number(text, " = ", s->u[0]);
        else
            kmp_text_printf(text, ": %s, %d samples, t from %.9g to %.9g s",
                            kmp_name_at(kmp_signal_words, (int)s->method), s->count, s->t[0], s->t[s->count - 1]);
        kmp_text_put(text, "\n");
    }
    show_states(text, model);
    show_tables(text, model);
    kmp_json words = kmp_json_begin_as(text, KMP_JSON_WORDS);
    kmp_model_put_wings(&words, model, false);
    begin(text, "unknowns", model->unknowns_count);
    for (int i = 0; i < model->unknowns_count; i++) {
        const kmp_unknowns *u = &model->unknowns[i];
        kmp_text_printf(text, "  %s%s", u->name, u->count ? ":" : "");
        for (int k = 0; k < u->count; k++)
            kmp_text_printf(text, "%s %s from %.9g", k ? "," : "", u->unknown[k], u->guess[k].value);
        for (int k = 0; k < (u->count ? u->count : 1); k++)
            put_expr(text, u->count ? "\n    0 = " : " = ", model, u->zero[k]);
        kmp_text_put(text, "\n");
    }
    show_bodies(text, model);
    kmp_model_put_wings(&words, model, true);
    int count = model->closure_count - kmp_model_friction_count(model); /* without the rows of forces */
    begin(text, "loops", count);
    for (int i = 0; i < count; i++) {
        const kmp_closure *closure = &model->closures[i];
        kmp_text_printf(text, "  %s: %s ", closure->name, kmp_closure_word(closure));
        (closure->point[0] < 0 ? show_relation : show_between)(text, model, closure);
        kmp_text_put(text, "\n");
    }
    begin(text, "cuts", model->cut_count);
    for (int i = 0; i < model->cut_count; i++) {
        const kmp_cut *cut = &model->cuts[i];
        kmp_text_printf(text, "  joint %s (%s) is cut: closure %s, %d rows, loop %s; %s\n", cut->joint, cut->kind,
                        cut->closure, cut->rows, cut->loop, cut->why);
    }
    show_ropes(text, model);
    show_forces(text, model);
    show_start(text, model);
    show_run(text, model);
}
