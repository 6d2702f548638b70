/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as it was understood: a summary to read, or one JSON object. */
#include "base/text.h"
#include "model/force_table.h"
#include "model/output_table.h"
#include "symbolic/table.h"

/* -- pieces ---------------------------------------------------------------------------------------- */

static const char *parameter_name(const void *user, int index)
{
    const kempe_model *model = user;
    return model->parameters[index].name;
}

static const char *coordinate_name(const void *user, int index)
{
    const kempe_model *model = user;
    return model->motions[index].name;
}

static void put_expr(kmp_text *text, const kempe_model *model, const kmp_expr *expr)
{
    const kmp_expr_names names = {model, parameter_name, coordinate_name};
    kmp_expr_print(text, expr, &names);
}

static void put_quoted_expr(kmp_text *text, const kempe_model *model, const kmp_expr *expr)
{
    kmp_text inner = {0};
    put_expr(&inner, model, expr);
    if (inner.failed)
        text->failed = true;
    else
        kmp_text_quote(text, inner.s);
    kmp_text_free(&inner);
}

static void put_vector(kmp_text *text, const kmp_number vector[3])
{
    kmp_text_put(text, "[");
    for (int i = 0; i < 3; i++) {
        kmp_text_put(text, i > 0 ? ", " : "");
        kmp_text_number(text, vector[i].value);
    }
    kmp_text_put(text, "]");
}

/* BODY.POINT */
static void put_point(kmp_text *text, const kempe_model *model, int index)
{
    const kmp_point *point = &model->points[index];
    kmp_text_printf(text, "%s.%s", model->bodies[point->body].name, point->name);
}

static void put_axis(kmp_text *text, const double axis[3])
{
    kmp_text_put(text, "[");
    for (int i = 0; i < 3; i++) {
        kmp_text_put(text, i > 0 ? ", " : "");
        kmp_text_number(text, axis[i]);
    }
    kmp_text_put(text, "]");
}

/* x [..], z [..] */
static void show_axes(kmp_text *text, double m[3][3])
{
    for (int k = 0; k < 3; k += 2) {
        const double axis[3] = {m[0][k], m[1][k], m[2][k]};
        kmp_text_put(text, k ? ", z " : "x ");
        put_axis(text, axis);
    }
}

static const char *const inertia_names[] = {"xx", "yy", "zz", "xy", "xz", "yz"};

/* -- summary --------------------------------------------------------------------------------------- */

static void show_named(kmp_text *text, const char *name, const kempe_model *model, const kmp_number *number)
{
    kmp_text_printf(text, "%s = ", name);
    kmp_text_number(text, number->value);
    if (number->expr) {
        kmp_text_put(text, "  (");
        put_expr(text, model, number->expr);
        kmp_text_put(text, ")");
    }
    kmp_text_put(text, "\n");
}

static void show_parameters(kmp_text *text, const kempe_model *model)
{
    if (model->parameter_count > 0)
        kmp_text_put(text, "parameters\n");
    for (int i = 0; i < model->parameter_count; i++) {
        kmp_text_put(text, "  ");
        show_named(text, model->parameters[i].name, model, &model->parameters[i].number);
    }
}

static void show_tables(kmp_text *text, const kempe_model *model)
{
    if (model->table_count > 0)
        kmp_text_put(text, "tables\n");
    for (int i = 0; i < model->table_count; i++) {
        const kmp_table *table = model->tables[i].table;
        kmp_text_printf(text, "  %s: %s, %d points, x from %.9g to %.9g\n", model->tables[i].name,
                        table->method == KMP_TABLE_LINEAR ? "linear" : "spline", table->count, table->x[0],
                        table->x[table->count - 1]);
    }
}

/* R3, -T1, or R[0, 0.6, 0.8] */
static void show_motion(kmp_text *text, const kmp_motion *motion)
{
    const char *letter = motion->rotation ? "R" : "T";
    for (int i = 0; i < 3; i++)
        if (motion->axis[i] == 1 || motion->axis[i] == -1) {
            kmp_text_printf(text, "%s%s%d", motion->axis[i] < 0 ? "-" : "", letter, i + 1);
            return;
        }
    kmp_text_put(text, letter);
    put_axis(text, motion->axis);
}

static void show_points(kmp_text *text, const kempe_model *model, int body)
{
    for (int i = 0; i < model->point_count; i++) {
        if (model->points[i].body != body)
            continue;
        kmp_text_printf(text, "    point %s ", model->points[i].name);
        put_vector(text, model->points[i].at);
        if (model->points[i].turned) {
            kmp_text_put(text, ", axes ");
            show_axes(text, model->points[i].axes);
        }
        kmp_text_put(text, "\n");
    }
}

static void show_inertia(kmp_text *text, const kmp_body *body)
{
    kmp_text_put(text, "    mass ");
    kmp_text_number(text, body->mass.value);
    kmp_text_put(text, ", com ");
    put_vector(text, body->com);
    kmp_text_put(text, ", inertia");
    for (int i = 0; i < 6; i++)
        if (i < 3 || body->inertia[i].value != 0) {
            kmp_text_printf(text, " %s ", inertia_names[i]);
            kmp_text_number(text, body->inertia[i].value);
        }
    kmp_text_put(text, "\n");
}

static void show_body(kmp_text *text, const kempe_model *model, int i)
{
    kmp_body *body = &model->bodies[i];
    kmp_text_printf(text, "  %d %s: joint %s at ", i, body->name, body->joint);
    if (body->at >= 0)
        put_point(text, model, body->at);
    else
        kmp_text_put(text, model->bodies[body->parent].name);
    kmp_text_put(text, ":");
    for (int k = 0; k < body->motion_count; k++) {
        kmp_text_put(text, " ");
        show_motion(text, &model->motions[body->first_motion + k]);
    }
    kmp_text_put(text, body->motion_count ? "" : " weld");
    if (body->screw) {
        kmp_text_put(text, ", pitch ");
        kmp_text_number(text, body->pitch.value);
    }
    if (body->turned) {
        kmp_text_put(text, ", frame ");
        show_axes(text, body->frame);
    }
    kmp_text_put(text, "\n");
    show_inertia(text, body);
    show_points(text, model, i);
}

static void show_bodies(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, "bodies\n  0 ground\n");
    show_points(text, model, 0);
    for (int i = 1; i < model->body_count; i++)
        show_body(text, model, i);
}

static bool has_axes(const kmp_closure *closure)
{
    const double *a = closure->axis[0];
    return a[0] != 0 || a[1] != 0 || a[2] != 0;
}

/* Of what is not between points. */
static void show_relation(kmp_text *text, const kempe_model *model, const kmp_closure *closure)
{
    for (int k = 0; k < closure->term_count; k++) {
        kmp_text_put(text, k > 0 ? " + " : "");
        kmp_text_number(text, closure->terms[k].factor.value);
        kmp_text_printf(text, " %s", model->motions[closure->terms[k].motion].name);
    }
    if (closure->term_count == 0 && closure->motion >= 0)
        kmp_text_put(text, model->motions[closure->motion].name);
    if (closure->function) {
        kmp_text_put(text, closure->motion >= 0 ? " = " : "0 = ");
        put_expr(text, model, closure->function);
    }
    kmp_text_put(text, "\n");
}

static void show_closures(kmp_text *text, const kempe_model *model)
{
    if (model->closure_count > 0)
        kmp_text_put(text, "loops\n");
    for (int i = 0; i < model->closure_count; i++) {
        const kmp_closure *closure = &model->closures[i];
        kmp_text_printf(text, "  %s: %s ", closure->name, closure->kind);
        if (closure->point[0] < 0) {
            show_relation(text, model, closure);
            continue;
        }
        put_point(text, model, closure->point[0]);
        kmp_text_put(text, " - ");
        put_point(text, model, closure->point[1]);
        if (closure->function) {
            kmp_text_put(text, ", length ");
            put_expr(text, model, closure->function);
        } else if (closure->length.value > 0) {
            kmp_text_put(text, ", length ");
            kmp_text_number(text, closure->length.value);
        }
        if (has_axes(closure)) {
            kmp_text_put(text, ", axes ");
            put_axis(text, closure->axis[0]);
            kmp_text_put(text, " and ");
            put_axis(text, closure->axis[1]);
        }
        if (closure->table)
            kmp_text_printf(text, ", table %s", closure->table->name);
        kmp_text_put(text, "\n");
    }
}

static void show_fields(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    for (int k = 0; k < kmp_force_field_count; k++) {
        if (kmp_force_fields[k].kind != force->kind || !kmp_force_has(force, k))
            continue;
        kmp_text_printf(text, ", %s ", kmp_force_key(model, force->motion, kmp_force_fields[k].key));
        kmp_text_number(text, kmp_force_get(force, k)->value);
    }
}

static void put_components(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    for (int k = 0; k < 3; k++) {
        kmp_text_put(text, k > 0 ? ", " : "[");
        put_expr(text, model, force->vector[k]);
    }
    kmp_text_put(text, "]");
}

static void show_force(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    const char *word = kmp_force_rows[force->kind].word;
    kmp_text_printf(text, "  %s: ", force->name);
    if (force->kind == KMP_FORCE_SPRING) {
        kmp_text_put(text, "spring ");
        put_point(text, model, force->point[0]);
        kmp_text_put(text, " - ");
        put_point(text, model, force->point[1]);
    } else if (force->motion >= 0) {
        kmp_text_printf(text, "%s on %s", kmp_force_key(model, force->motion, word),
                        model->motions[force->motion].name);
    } else if (force->kind == KMP_FORCE_BODY) {
        kmp_text_printf(text, "torque on %s", model->bodies[force->body].name);
    } else {
        kmp_text_put(text, "force at ");
        put_point(text, model, force->point[0]);
    }
    show_fields(text, model, force);
    if (force->effort) {
        kmp_text_put(text, " = ");
        put_expr(text, model, force->effort);
    } else if (force->vector[0]) {
        kmp_text_put(text, " = ");
        put_components(text, model, force);
    }
    kmp_text_put(text, "\n");
}

static void show_forces(kmp_text *text, const kempe_model *model)
{
    if (model->force_count > 0)
        kmp_text_put(text, "forces\n");
    for (int i = 0; i < model->force_count; i++)
        show_force(text, model, &model->forces[i]);
}

static void show_sensors(kmp_text *text, const kempe_model *model)
{
    if (model->sensor_count > 0)
        kmp_text_put(text, "sensors\n");
    for (int i = 0; i < model->sensor_count; i++) {
        kmp_text_printf(text, "  %s = ", model->sensors[i].name);
        put_expr(text, model, model->sensors[i].expr);
        kmp_text_put(text, "\n");
    }
}

static void show_start(kmp_text *text, const kempe_model *model)
{
    const kmp_start *start = &model->start;
    kmp_text_printf(text, "coordinates (%d): start q, qd\n", model->motion_count);
    for (int i = 0; i < model->motion_count; i++) {
        kmp_text_printf(text, "  %s: ", model->motions[i].name);
        kmp_text_number(text, start->q[i].value);
        kmp_text_put(text, ", ");
        kmp_text_number(text, start->qd[i].value);
        kmp_text_put(text, start->hold[i] ? ", held\n" : "\n");
    }
}

static void show_setting(kmp_text *text, const char *name, double value)
{
    if (value > 0) {
        kmp_text_printf(text, " %s ", name);
        kmp_text_number(text, value);
    }
}

static void show_run(kmp_text *text, const kempe_model *model)
{
    const kmp_run_settings *run = &model->run;
    kmp_text_put(text, "run:");
    show_setting(text, "t_end", run->t_end);
    show_setting(text, "every", run->every);
    show_setting(text, "rtol", run->rtol);
    show_setting(text, "atol", run->atol);
    if (run->road)
        kmp_text_printf(text, " road %s", run->road);
    if (run->form)
        kmp_text_printf(text, " form %s", run->form);
    if (run->integrator)
        kmp_text_printf(text, " integrator %s", run->integrator);
    for (int i = 0; i < run->u_count; i++)
        kmp_text_printf(text, "%s%s", i == 0 ? " u " : ", ", model->motions[run->u[i]].name);
    kmp_text_put(text, "\noutputs:");
    for (int i = 0; i < model->output_count; i++) {
        kmp_text_put(text, " ");
        kmp_output_print(text, model, &model->outputs[i]);
    }
    kmp_text_put(text, "\n");
}

static void show(kmp_text *text, const kempe_model *model)
{
    kmp_text_printf(text, "%s\ngravity ", model->name);
    put_vector(text, model->gravity);
    kmp_text_put(text, "\n");
    show_parameters(text, model);
    show_tables(text, model);
    show_bodies(text, model);
    show_closures(text, model);
    show_forces(text, model);
    show_sensors(text, model);
    show_start(text, model);
    show_run(text, model);
}

/* -- JSON ------------------------------------------------------------------------------------------ */

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
    put_point(text, model, point[0]);
    kmp_text_put(text, "\", \"");
    put_point(text, model, point[1]);
    kmp_text_put(text, "\"]");
}

static void put_one_point(kmp_text *text, const kempe_model *model, int point)
{
    put_key(text, false, "point");
    kmp_text_put(text, "\"");
    put_point(text, model, point);
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

static void json_axes(kmp_text *text, bool first, const char *key, double m[3][3])
{
    put_key(text, first, key);
    for (int k = 0; k < 3; k += 2) {
        const double axis[3] = {m[0][k], m[1][k], m[2][k]};
        kmp_text_put(text, k ? ", \"z\": " : "{\"x\": ");
        put_axis(text, axis);
    }
    kmp_text_put(text, "}");
}

/* Of the turned ones. */
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
        put_vector(text, model->points[i].at);
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
        put_axis(text, motion->axis);
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
    put_string(text, false, "joint", body->joint);
    json_motions(text, model, body);
    if (body->turned)
        json_axes(text, false, "frame", body->frame);
    if (body->screw)
        put_number(text, false, "pitch", body->pitch.value);
    put_number(text, false, "mass", body->mass.value);
    put_key(text, false, "com");
    put_vector(text, body->com);
    put_key(text, false, "inertia");
    kmp_text_put(text, "{");
    for (int k = 0; k < 6; k++)
        put_number(text, k == 0, inertia_names[k], body->inertia[k].value);
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
    put_axis(text, closure->axis[0]);
    kmp_text_put(text, ", ");
    put_axis(text, closure->axis[1]);
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
        if (has_axes(closure))
            json_closure_axes(text, closure);
        if (closure->table)
            put_string(text, false, "table", closure->table->name);
        if (closure->function) {
            put_key(text, false, closure->point[0] < 0 ? "function" : "length");
            put_quoted_expr(text, model, closure->function);
        } else if (closure->length.value > 0)
            put_number(text, false, "length", closure->length.value);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, "]");
}

static void json_components(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    put_key(text, false, "components");
    for (int k = 0; k < 3; k++) {
        kmp_text_put(text, k > 0 ? ", " : "[");
        put_quoted_expr(text, model, force->vector[k]);
    }
    kmp_text_put(text, "]");
}

static void json_force(kmp_text *text, const kempe_model *model, const kmp_force *force)
{
    const char *word = kmp_force_rows[force->kind].word;
    put_string(text, true, "name", force->name);
    put_string(text, false, "kind", word ? kmp_force_key(model, force->motion, word) : "spring");
    if (force->motion >= 0)
        put_string(text, false, "coordinate", model->motions[force->motion].name);
    else if (force->kind == KMP_FORCE_BODY)
        put_string(text, false, "body", model->bodies[force->body].name);
    else if (force->kind == KMP_FORCE_SPRING)
        put_point_key(text, "points", model, force->point);
    else
        put_one_point(text, model, force->point[0]);
    for (int k = 0; k < kmp_force_field_count; k++)
        if (kmp_force_fields[k].kind == force->kind && kmp_force_has(force, k))
            put_number(text, false, kmp_force_key(model, force->motion, kmp_force_fields[k].key),
                       kmp_force_get(force, k)->value);
    if (force->effort) {
        put_key(text, false, "effort");
        put_quoted_expr(text, model, force->effort);
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
        put_quoted_expr(text, model, model->sensors[i].expr);
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
    kmp_text_put(text, "]}");
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
    put_setting(text, false, "every", run->every);
    put_setting(text, false, "rtol", run->rtol);
    put_setting(text, false, "atol", run->atol);
    put_choice(text, "road", run->road);
    put_choice(text, "form", run->form);
    put_choice(text, "integrator", run->integrator);
    put_key(text, false, "u");
    kmp_text_put(text, "[");
    for (int i = 0; i < run->u_count; i++) {
        kmp_text_put(text, i > 0 ? ", " : "");
        kmp_text_quote(text, model->motions[run->u[i]].name);
    }
    kmp_text_put(text, "], \"outputs\": [");
    for (int i = 0; i < model->output_count; i++) {
        kmp_text_put(text, i > 0 ? ", \"" : "\"");
        kmp_output_print(text, model, &model->outputs[i]);
        kmp_text_put(text, "\"");
    }
    kmp_text_put(text, "]}");
}

static void json(kmp_text *text, const kempe_model *model)
{
    kmp_text_put(text, "{");
    put_string(text, true, "name", model->name);
    put_key(text, false, "gravity");
    put_vector(text, model->gravity);
    json_parameters(text, model);
    json_tables(text, model);
    json_bodies(text, model);
    json_closures(text, model);
    json_forces(text, model);
    json_sensors(text, model);
    json_start(text, model);
    json_run(text, model);
    kmp_text_put(text, "}\n");
}

kempe_status kempe_model_print(const kempe_model *model, kempe_format format, char **text)
{
    kmp_text out = {0};
    kmp_context_clear(model->context);
    kempe_status status = kmp_model_check_finished(model);
    if (status != KEMPE_OK)
        return status;
    if (format == KEMPE_JSON)
        json(&out, model);
    else
        show(&out, model);
    char *s = kmp_text_take(&out);
    if (!s)
        return kmp_fail_memory(model->context);
    *text = s;
    return KEMPE_OK;
}
