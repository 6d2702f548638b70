/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as one JSON object. */
#include "model/print/model_print.h"
#include "model/tables/force_table.h"
#include "model/tables/output_table.h"
#include "symbolic/table.h"

static void put_key(kmp_text *text, bool first, const char *key)
{
    kmp_text_put(text, first ? "" : ", ");
    kmp_text_quote(text, key);
    kmp_text_put(text, ": ");
}

static void put_string(kmp_text *text, bool first, const char *key, const char *value)
{
    put_key(text, first, key);
    kmp_text_quote(text, value);
}

static void put_number(kmp_text *text, bool first, const char *key, double value)
{
    put_key(text, first, key);
    kmp_text_number(text, value);
}

static void put_point_key(kmp_text *text, const char *key, const kempe_model *model, const int point[2])
{
    put_key(text, false, key);
    kmp_text_put(text, "[\"");
    kmp_model_put_point(text, model, point[0]);
    kmp_text_put(text, "\", \"");
    kmp_model_put_point(text, model, point[1]);
    kmp_text_put(text, "\"]");
}

static void put_one_point(kmp_text *text, const kempe_model *model, int point)
{
    put_key(text, false, "point");
    kmp_text_put(text, "\"");
    kmp_model_put_point(text, model, point);
    kmp_text_put(text, "\"");
}

static void json_parameters(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, ",\n\"parameters\": {");
    for (int i = 0; i < model->parameter_count; i++)
        put_number(text, i == 0, model->parameters[i].name, model->parameters[i].number.value);
    kmp_text_put(text, "}");
}

static void json_list(kmp_text *text, const char *key, int count, const double *x)
{
    put_key(text, false, key);
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k ? ", " : "[");
        kmp_text_number(text, x[k]);
    }
    kmp_text_put(text, "]");
}

static void json_tables(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, ",\n\"tables\": {");
    for (int i = 0; i < model->table_count; i++) {
        const kmp_table *table = model->tables[i].table;
        put_key(text, i == 0, model->tables[i].name);
        kmp_text_put(text, "{");
        put_string(text, true, "method", table->method == KMP_TABLE_LINEAR ? "linear" : "spline");
        json_list(text, "x", table->count, table->x);
        json_list(text, "y", table->count, table->y);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "}");
}

static void json_unknowns(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, ",\n\"unknowns\": {");
    for (int i = 0; i < model->unknowns_count; i++) {
        const kmp_unknowns *u = &model->unknowns[i];
        put_key(text, i == 0, u->name);
        if (u->count == 0) {
            kmp_model_put_quoted_expr(text, model, u->zero[0]);
            continue;
        }
        kmp_text_put(text, "{\"of\": {");
        for (int k = 0; k < u->count; k++)
            put_number(text, k == 0, u->unknown[k], u->guess[k].value);
        kmp_text_put(text, "}, \"zero\": [");
        for (int k = 0; k < u->count; k++) {
            kmp_text_put(text, k ? ", " : "");
            kmp_model_put_quoted_expr(text, model, u->zero[k]);
        }
        kmp_text_put(text, "]}");
    }
    kmp_text_put(text, "}");
}

static void json_axes(kmp_text *text, bool first, const char *key, double m[3][3])
{
    put_key(text, first, key);
    for (int k = 0; k < 3; k += 2) {
        const double axis[3] = {m[0][k], m[1][k], m[2][k]};
        kmp_text_put(text, k ? ", \"z\": " : "{\"x\": ");
        kmp_model_put_axis(text, axis);
    }
    kmp_text_put(text, "}");
}

/* The axes of points that are rotated against the body. */
static void json_point_axes(kmp_text *text, const kempe_model *model, int body)
{
    bool first = true;
    for (int i = 0; i < model->point_count; i++) {
        if (model->points[i].body != body || !model->points[i].turned)
            continue;
        kmp_text_put(text, first ? ", \"point_axes\": {" : "");
        json_axes(text, first, model->points[i].name, model->points[i].axes);
        first = false;
    }
    kmp_text_put(text, first ? "" : "}");
}

static void json_points(kmp_text *text, const kempe_model *model, int body)
{
    bool first = true;
    kmp_text_put(text, "\"points\": {");
    for (int i = 0; i < model->point_count; i++) {
        if (model->points[i].body != body)
            continue;
        put_key(text, first, model->points[i].name);
        kmp_model_put_vector(text, model->points[i].at);
        first = false;
    }
    kmp_text_put(text, "}");
    json_point_axes(text, model, body);
}

static void json_motions(kmp_text *text, const kempe_model *model, const kmp_body *body)
{
    put_key(text, false, "motions");
    kmp_text_put(text, "[");
    for (int k = 0; k < body->motion_count; k++) {
        const kmp_motion *motion = &model->motions[body->first_motion + k];
        kmp_text_put(text, k > 0 ? ", {" : "{");
        put_string(text, true, "coordinate", motion->name);
        put_string(text, false, "kind", motion->rotation ? "R" : "T");
        put_key(text, false, "axis");
        kmp_model_put_axis(text, motion->axis);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]");
}

static void json_body(kmp_text *text, const kempe_model *model, int i)
{
    kmp_body *body = &model->bodies[i];
    kmp_text_put(text, i > 1 ? ",\n  {" : "\n  {");
    put_string(text, true, "name", body->name);
    put_string(text, false, "parent", model->bodies[body->parent].name);
    put_string(text, false, "at", body->at >= 0 ? model->points[body->at].name : "");
    if (body->to >= 0)
        put_string(text, false, "to", model->points[body->to].name);
    put_string(text, false, "joint", body->joint);
    if (body->reversed)
        put_number(text, false, "reversed", 1);
    json_motions(text, model, body);
    if (body->turned)
        json_axes(text, false, "frame", body->frame);
    if (body->screw)
        put_number(text, false, "pitch", body->pitch.value);
    put_number(text, false, "mass", body->mass.value);
    put_key(text, false, "com");
    kmp_model_put_vector(text, body->com);
    put_key(text, false, "inertia");
    kmp_text_put(text, "{");
    for (int k = 0; k < 6; k++)
        put_number(text, k == 0, kmp_inertia_names[k], body->inertia[k].value);
    kmp_text_put(text, "}, ");
    json_points(text, model, i);
    kmp_text_put(text, "}");
}

static void json_bodies(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, ",\n\"ground\": {");
    json_points(text, model, 0);
    kmp_text_put(text, "},\n\"bodies\": [");
    for (int i = 1; i < model->body_count; i++)
        json_body(text, model, i);
    kmp_text_put(text, "],\n\"coordinates\": [");
    for (int i = 0; i < model->motion_count; i++) {
        kmp_text_put(text, i > 0 ? ", " : "");
        kmp_text_quote(text, model->motions[i].name);
    }
    kmp_text_put(text, "]");
}

static void json_closure_axes(kmp_text *text, const kmp_closure *closure)
{
    put_key(text, false, "axes");
    kmp_text_put(text, "[");
    kmp_model_put_axis(text, closure->axis[0]);
    kmp_text_put(text, ", ");
    kmp_model_put_axis(text, closure->axis[1]);
    kmp_text_put(text, "]");
}

static void json_terms(kmp_text *text, const kempe_model *model, const kmp_closure *closure)
{
    put_key(text, false, "terms");
    kmp_text_put(text, "{");
    for (int k = 0; k < closure->term_count; k++)
        put_number(text, k == 0, model->motions[closure->terms[k].motion].name, closure->terms[k].factor.value);
    kmp_text_put(text, "}");
}

static void json_curve(kmp_text *text, const kempe_model *model, const kmp_closure *closure)
{
    static const char *const keys[] = {"curve", "y", "z"};
    bool list = closure->curve_side[0] == 0;
    for (int k = 0; k < closure->curve_count; k++) {
        if (!list || k == 0)
            put_key(text, false, keys[closure->curve_side[k]]);
        kmp_text_put(text, !list ? "" : k == 0 ? "[" : ", ");
        kmp_model_put_quoted_expr(text, model, closure->curve[k]);
    }
    kmp_text_put(text, list ? "]" : "");
    if (list)
        put_number(text, false, "power", closure->power);
}

static void json_closures(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, ",\n\"closures\": [");
    for (int i = 0; i < model->closure_count; i++) {
        const kmp_closure *closure = &model->closures[i];
        kmp_text_put(text, i > 0 ? ",\n  {" : "\n  {");
        put_string(text, true, "name", closure->name);
        put_string(text, false, "kind", closure->kind);
        if (closure->motion >= 0)
            put_string(text, false, "coordinate", model->motions[closure->motion].name);
        else if (closure->point[0] >= 0)
            put_point_key(text, "points", model, closure->point);
        if (closure->term_count > 0)
            json_terms(text, model, closure);
        if (closure->constant)
            put_number(text, false, "equals", closure->constant->value);
        if (kmp_closure_has_axes(closure))
            json_closure_axes(text, closure);
        if (closure->table)
            put_string(text, false, "table", closure->table->name);
        else if (closure->curve_count > 0)
            json_curve(text, model, closure);
        if (closure->function) {
            put_key(text, false, closure->point[0] < 0 ? "function" : "length");
            kmp_model_put_quoted_expr(text, model, closure->function);
        } else if (closure->length.value > 0)
            put_number(text, false, "length", closure->length.value);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]");
}

static void json_cuts(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, ",\n\"cuts\": [");
    for (int i = 0; i < model->cut_count; i++) {
        const kmp_cut *cut = &model->cuts[i];
        kmp_text_put(text, i > 0 ? ",\n  {" : "\n  {");
        put_string(text, true, "joint", cut->joint);
        put_string(text, false, "kind", cut->kind);
        put_string(text, false, "closure", cut->closure);
        put_number(text, false, "rows", cut->rows);
        put_string(text, false, "loop", cut->loop);
        put_string(text, false, "reason", cut->why);
        put_number(text, false, "start_unused", cut->start_unused);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]");
}

static void json_components(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    put_key(text, false, "components");
    for (int k = 0; k < 3; k++) {
        kmp_text_put(text, k > 0 ? ", " : "[");
        kmp_model_put_quoted_expr(text, model, force->vector[k]);
    }
    kmp_text_put(text, "]");
}

static void put_field(kmp_text *text, const char *key, int size, const kmp_number *number)
{
    if (size == 1) {
        put_number(text, false, key, number->value);
        return;
    }
    put_key(text, false, key);
    kmp_model_put_vector(text, number);
}

static void json_force(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    const char *word = kmp_force_rows[force->kind].word;
    put_string(text, true, "name", force->name);
    put_string(text, false, "kind",
               word ? kmp_force_key(model, force->motion, word) : kmp_force_rows[force->kind].place);
    if (force->kind == KMP_FORCE_WHEEL)
        put_string(text, false, "wheel", model->wheels[force->wheel].name);
    else if (force->motion >= 0)
        put_string(text, false, "coordinate", model->motions[force->motion].name);
    else if (force->kind == KMP_FORCE_BODY)
        put_string(text, false, "body", model->bodies[force->body].name);
    else if (!word)
        put_point_key(text, "points", model, force->point);
    else
        put_one_point(text, model, force->point[0]);
    for (int k = 0; k < kmp_force_field_count; k++)
        if (kmp_force_fields[k].kind == force->kind && kmp_force_has(force, k))
            put_field(text, kmp_force_key(model, force->motion, kmp_force_fields[k].key), kmp_force_fields[k].size,
                      kmp_force_get(force, k));
    if (force->effort) {
        put_key(text, false, "effort");
        kmp_model_put_quoted_expr(text, model, force->effort);
    }
    if (force->vector[0])
        json_components(text, model, force);
}

static void json_forces(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, ",\n\"forces\": [");
    for (int i = 0; i < model->force_count; i++) {
        kmp_text_put(text, i > 0 ? ",\n  {" : "\n  {");
        json_force(text, model, &model->forces[i]);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]");
}

static void json_sensors(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, ",\n\"sensors\": {");
    for (int i = 0; i < model->sensor_count; i++) {
        put_key(text, i == 0, model->sensors[i].name);
        kmp_model_put_quoted_expr(text, model, model->sensors[i].expr);
    }
    kmp_text_put(text, "}");
}

static void json_values(kmp_text *text, const kempe_model *model, const char *key, const kmp_number *values)
{
    put_key(text, key[1] == '\0', key);
    kmp_text_put(text, "{");
    for (int i = 0; i < model->motion_count; i++)
        put_number(text, i == 0, model->motions[i].name, values[i].value);
    kmp_text_put(text, "}");
}

static void json_goals(kmp_text *text, const kempe_model *model)
{
    put_key(text, false, "goals");
    kmp_text_put(text, "{");
    for (int i = 0; i < model->start.goal_count; i++) {
        const kmp_goal *goal = &model->start.goals[i];
        kmp_text_put(text, i > 0 ? ", \"" : "\"");
        kmp_model_put_goal(text, model, goal);
        kmp_text_put(text, "\": {");
        if (goal->width == 3) {
            put_key(text, true, "value");
            kmp_model_put_vector(text, goal->value);
            put_key(text, false, "weight");
            kmp_model_put_vector(text, goal->weight);
        } else {
            put_number(text, true, "value", goal->value[0].value);
            put_number(text, false, "weight", goal->weight[0].value);
        }
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "}");
}

static void json_start(kmp_text *text, const kempe_model *model)
{
    bool first = true;
    kmp_text_put(text, ",\n\"start\": {");
    json_values(text, model, "q", model->start.q);
    json_values(text, model, "qd", model->start.qd);
    put_key(text, false, "hold");
    kmp_text_put(text, "[");
    for (int i = 0; i < model->motion_count; i++)
        if (model->start.hold[i]) {
            kmp_text_put(text, first ? "" : ", ");
            kmp_text_quote(text, model->motions[i].name);
            first = false;
        }
    kmp_text_put(text, "]");
    json_goals(text, model);
    kmp_text_put(text, "}");
}

/* A setting that is not given is null. */
static void put_setting(kmp_text *text, bool first, const char *key, double value)
{
    put_key(text, first, key);
    if (value > 0)
        kmp_text_number(text, value);
    else
        kmp_text_put(text, "null");
}

static void put_choice(kmp_text *text, const char *key, const char *choice)
{
    put_key(text, false, key);
    if (choice)
        kmp_text_quote(text, choice);
    else
        kmp_text_put(text, "null");
}

static void json_run(kmp_text *text, const kempe_model *model)
{
    const kmp_run_settings *run = &model->run;
    kmp_text_put(text, ",\n\"run\": {");
    put_setting(text, true, "t_end", run->t_end);
    put_setting(text, false, "output_step", run->output_step);
    put_setting(text, false, "rtol", run->rtol);
    put_setting(text, false, "atol", run->atol);
    put_setting(text, false, "max_steps", (double)run->max_steps);
    put_choice(text, "formulation", run->formulation);
    put_choice(text, "form", run->form);
    put_choice(text, "integrator", run->integrator);
    put_choice(text, "algorithm", run->dynamics == KMP_DYNAMICS_AUTO ? NULL : kmp_dynamics_word(run->dynamics));
    put_choice(text, "change_points",
               run->change_points == KMP_CHANGE_POINTS_CROSS ? NULL : kmp_change_points_word(run->change_points));
    put_key(text, false, "independent");
    kmp_text_put(text, "[");
    for (int i = 0; i < run->independent_count; i++) {
        kmp_text_put(text, i > 0 ? ", " : "");
        kmp_text_quote(text, model->motions[run->independent[i]].name);
    }
    kmp_text_put(text, "], \"until\": [");
    for (int i = 0; i < run->until_count; i++) {
        kmp_text_put(text, i > 0 ? ", " : "");
        kmp_model_put_quoted_expr(text, model, run->until[i]);
    }
    kmp_text_put(text, "], \"outputs\": [");
    for (int i = 0; i < model->output_count; i++) {
        kmp_text_put(text, i > 0 ? ", \"" : "\"");
        kmp_output_print(text, model, &model->outputs[i]);
        kmp_text_put(text, "\"");
    }
    kmp_text_put(text, "]}");
}

void kmp_model_json_mechanism(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, "{");
    put_string(text, true, "name", model->name);
    put_key(text, false, "gravity");
    kmp_model_put_vector(text, model->gravity);
    json_parameters(text, model);
    json_tables(text, model);
    kmp_model_json_tracks(text, model);
    if (model->unknowns_count > 0)
        json_unknowns(text, model);
    json_bodies(text, model);
    kmp_model_json_wheels(text, model);
    json_closures(text, model);
    json_cuts(text, model);
    json_forces(text, model);
    json_sensors(text, model);
    json_start(text, model);
}

void kmp_model_json(kmp_text *text, const kempe_model *model)
{
    kmp_model_json_mechanism(text, model);
    json_run(text, model);
    kmp_text_put(text, "}\n");
}
