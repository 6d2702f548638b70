/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as one JSON object. */
#include "model/write/model_json.h"
#include "base/text.h"
#include "model/data/body.h"
#include "model/data/bushing_matrix.h"
#include "model/data/cam.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/compliant.h"
#include "model/data/force.h"
#include "model/data/gear.h"
#include "model/data/joint_table.h"
#include "model/data/model.h"
#include "model/data/outline.h"
#include "model/data/output_table.h"
#include "model/data/rope.h"
#include "model/data/run_settings.h"
#include "model/data/signal.h"
#include "model/data/start.h"
#include "model/language/expression.h"
#include "model/language/nearest.h"
#include "model/read/loads.h"
#include "model/write/model_print.h"
#include "symbolic/table_function.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>

/* -- pieces -------------------------------------------------------------------------------------- */

void kmp_model_json_begin(kmp_json *json, const char *key)
{
    kmp_json_line(json, "\n");
    kmp_json_object(json, key);
}

void kmp_model_json_cut(kmp_json *json, const kmp_cut *cut)
{
    kmp_json_put(json, "joint %s kind %s closure %s rows %d loop %s reason %s start_given %d", cut->joint, cut->kind,
                 cut->closure, cut->rows, cut->loop, cut->why, cut->start_given);
}

void kmp_model_json_item(kmp_json *json, const char *key)
{
    kmp_json_line(json, "\n  ");
    kmp_json_object(json, key);
}

static void begin_list(kmp_json *json, const char *key)
{
    kmp_json_line(json, "\n");
    kmp_json_array(json, key);
}

static void put_vector(kmp_json *json, const char *key, const kmp_number v[3])
{
    kmp_json_numbers(json, key, 3, (const double[]){v[0].value, v[1].value, v[2].value});
}

static void put_expr(kmp_json *json, const char *key, const kempe_model *model, const kmp_expr *expr)
{
    kmp_text text = {0};
    kmp_model_put_expr(&text, model, expr);
    kmp_json_text(json, key, &text);
}

static void put_exprs(kmp_json *json, const char *key, const kempe_model *model, int count, const kmp_expr *const *e)
{
    kmp_json_array(json, key);
    for (int k = 0; k < count; k++)
        put_expr(json, NULL, model, e[k]);
    kmp_json_end(json);
}

void kmp_model_json_point(kmp_json *json, const char *key, const kempe_model *model, int point)
{
    kmp_text text = {0};
    kmp_model_put_point(&text, model, point);
    kmp_json_text(json, key, &text);
}

static void put_axes(kmp_json *json, const char *key, double m[3][3])
{
    kmp_json_object(json, key);
    kmp_json_numbers(json, "x", 3, (const double[]){m[0][0], m[1][0], m[2][0]});
    kmp_json_numbers(json, "z", 3, (const double[]){m[0][2], m[1][2], m[2][2]});
    kmp_json_end(json);
}

/* -- names and their values ---------------------------------------------------------------------- */

static void put_states(kmp_json *json, const kempe_model *model)
{
    kmp_model_json_begin(json, "states");
    for (int i = 0; i < model->state_count; i++) {
        kmp_json_object(json, model->states[i].name);
        if (!model->states[i].delayed || model->states[i].began)
            kmp_json_number(json, "start", model->start.qd[kmp_model_coordinates(model) + i].value);
        if (model->states[i].next) {
            put_expr(json, "next", model, model->states[i].next);
            if (kmp_state_rate(model, i)->a)
                put_expr(json, "when", model, kmp_state_rate(model, i)->a);
            else
                kmp_json_number(json, "sample", model->states[i].period);
        } else if (model->states[i].delayed) {
            put_expr(json, "delay", model, model->states[i].delayed);
            kmp_json_number(json, "time", model->states[i].delay.value);
            if (model->states[i].before)
                put_expr(json, "before", model, model->states[i].before);
        } else {
            put_expr(json, "rate", model, kmp_state_rate(model, i));
        }
        kmp_json_put(json, "scale %g }", model->states[i].scale);
    }
    kmp_json_end(json);
}

static void put_surface(kmp_json *json, const char *name, const kmp_surface *s)
{
    kmp_json_put(json, "%s { method %s", name, kmp_table_method_word(s->one[0]->method));
    kmp_json_numbers(json, "x", s->count[0], s->knot[0]);
    kmp_json_numbers(json, "y", s->count[1], s->knot[1]);
    kmp_json_array(json, "z");
    for (int k = 0; k < s->count[0]; k++)
        kmp_json_numbers(json, NULL, s->count[1], s->z + (ptrdiff_t)k * s->count[1]);
    kmp_json_put(json, "] }");
}

static void put_unknowns(kmp_json *json, const kempe_model *model)
{
    kmp_model_json_begin(json, "unknowns");
    for (int i = 0; i < model->unknowns_count; i++) {
        const kmp_unknowns *u = &model->unknowns[i];
        if (u->count == 0) {
            put_expr(json, u->name, model, u->zero[0]);
            continue;
        }
        kmp_json_put(json, "%s { of {", u->name);
        for (int k = 0; k < u->count; k++)
            kmp_json_number(json, u->unknown[k], u->guess[k].value);
        kmp_json_end(json);
        put_exprs(json, "zero", model, u->count, u->zero);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

/* -- bodies -------------------------------------------------------------------------------------- */

static void put_points(kmp_json *json, const kempe_model *model, int body)
{
    bool turned = false;
    kmp_json_object(json, "points");
    for (int i = 0; i < model->point_count; i++)
        if (model->points[i].body == body) {
            put_vector(json, model->points[i].name, model->points[i].at);
            turned = turned || model->points[i].turned;
        }
    kmp_json_end(json);
    if (!turned)
        return;
    kmp_json_object(json, "point_axes");
    for (int i = 0; i < model->point_count; i++)
        if (model->points[i].body == body && model->points[i].turned)
            put_axes(json, model->points[i].name, model->points[i].axes);
    kmp_json_end(json);
}

static void put_matrix(kmp_json *json, const char *key, int n, const kmp_number *entries)
{
    kmp_json_array(json, key);
    for (int i = 0; i < n; i++) {
        kmp_json_array(json, NULL);
        for (int k = 0; k < n; k++)
            kmp_json_number(json, NULL, entries[n * i + k].value);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void put_flexible(kmp_json *json, const kempe_model *model, kmp_flexible *flexible)
{
    kmp_json_object(json, "flexible");
    if (flexible->file)
        kmp_json_string(json, "file", flexible->file);
    kmp_json_put(json, "length %g frame %s stiffening %s", flexible->length->value,
                 kmp_flexible_frame_words[flexible->frame], kmp_stiffening_words[flexible->stiffening]);
    if (flexible->turned)
        put_axes(json, "axes", flexible->axes);
    kmp_json_array(json, "coordinates");
    for (int k = flexible->first; k < flexible->first + flexible->count; k++)
        kmp_json_string(json, NULL, model->motions[k].name);
    kmp_json_end(json);
    put_matrix(json, "stiffness", flexible->count, flexible->stiffness);
    put_matrix(json, "damping", flexible->count, flexible->damping);
    kmp_json_object(json, "stations"); /* by their distances along the beam */
    for (int k = 0; k < model->point_count && !flexible->file; k++)
        if (model->points[k].body == flexible->body && model->points[k].station > 0)
            kmp_json_number(json, model->points[k].name, flexible->stations[model->points[k].station - 1].at[0].value);
    kmp_json_put(json, "} }");
}

static void put_body(kmp_json *json, const kempe_model *model, int i)
{
    kmp_body *body = &model->bodies[i];
    kmp_model_json_item(json, NULL);
    kmp_json_put(json, "name %s parent %s at %s", body->name, model->bodies[body->parent].name,
                 body->at >= 0 ? model->points[body->at].name : "");
    if (body->to >= 0)
        kmp_json_string(json, "to", model->points[body->to].name);
    kmp_json_string(json, "joint", body->joint);
    if (body->reversed)
        kmp_json_whole(json, "reversed", 1);
    kmp_json_array(json, "motions");
    for (int k = 0; k < body->motion_count; k++) {
        const kmp_motion *motion = &model->motions[body->first_motion + k];
        kmp_json_put(json, "{ coordinate %s kind %s", motion->name, motion->rotation ? "R" : "T");
        kmp_json_numbers(json, "axis", 3, motion->axis);
        kmp_json_end(json);
    }
    kmp_json_end(json);
    if (body->turned)
        put_axes(json, "frame", body->frame);
    if (body->coupling)
        kmp_json_number(json, kmp_joint_key(body->coupling), body->number.value);
    if (kmp_body_has_armature(body))
        kmp_json_number(json, "armature", body->armature.value);
    kmp_model_json_mass(json, model, i);
    if (body->flexible > 0)
        put_flexible(json, model, &model->flexibles[body->flexible - 1]);
    put_points(json, model, i);
    kmp_json_end(json);
}

static void put_bodies(kmp_json *json, const kempe_model *model)
{
    kmp_model_json_begin(json, "ground");
    put_points(json, model, 0);
    kmp_json_end(json);
    begin_list(json, "bodies");
    for (int i = 1; i < model->body_count; i++)
        put_body(json, model, i);
    kmp_json_end(json);
    begin_list(json, "coordinates");
    for (int i = 0; i < kmp_model_coordinates(model); i++)
        kmp_json_string(json, NULL, model->motions[i].name);
    kmp_json_end(json);
}

/* -- closures ------------------------------------------------------------------------------------ */

static void put_curve(kmp_json *json, const kempe_model *model, const kmp_closure *closure)
{
    static const char *const keys[] = {"curve", "y", "z"};
    if (closure->curve_side[0] == 0) {
        put_exprs(json, "curve", model, closure->curve_count, closure->curve);
        kmp_json_whole(json, "power", closure->power);
        return;
    }
    for (int k = 0; k < closure->curve_count; k++)
        put_expr(json, keys[closure->curve_side[k]], model, closure->curve[k]);
}

static void put_gear(kmp_json *json, const kempe_model *model, const kmp_gear *gear)
{
    kmp_json_array(json, "between");
    for (int side = 0; side < 2; side++)
        kmp_json_string(json, NULL, model->bodies[gear->wheel[side]].name);
    kmp_json_end(json);
    kmp_json_string(json, "carrier", model->bodies[gear->carrier].name);
    if (gear->teeth[0] > 0)
        kmp_json_numbers(json, "teeth", gear->teeth[1] > 0 ? 2 : 1, gear->teeth);
    if (gear->internal)
        kmp_json_boolean(json, "internal", true);
    if (gear->efficiency[0] < 1 || gear->efficiency[1] < 1)
        kmp_json_numbers(json, "efficiency", 2, gear->efficiency);
    for (int k = 0; k < KMP_GEAR_NUMBERS; k++)
        if (kmp_gear_has(gear, (kmp_gear_number)k) && k != KMP_GEAR_RADIUS_2)
            kmp_json_number(json, kmp_gear_number_keys[k], gear->number[k].value);
}

static void put_closure(kmp_json *json, const kempe_model *model, const kmp_closure *closure)
{
    kmp_json_put(json, "name %s kind %s", closure->name, kmp_closure_word(closure));
    if (closure->motion >= 0)
        kmp_json_string(json, "coordinate", model->motions[closure->motion].name);
    else if (closure->point[0] >= 0) {
        kmp_json_array(json, "points");
        kmp_model_json_point(json, NULL, model, closure->point[0]);
        kmp_model_json_point(json, NULL, model, closure->point[1]);
        kmp_json_end(json);
    }
    if (closure->gear)
        put_gear(json, model, closure->gear);
    if (closure->cam) {
        if (closure->cam->form == KMP_FOLLOWER_ROLLER)
            kmp_json_number(json, "roller", closure->cam->radius);
        else if (closure->cam->form == KMP_FOLLOWER_KNIFE)
            kmp_json_string(json, "knife", "yes");
        else
            kmp_json_numbers(json, "flat", 3, closure->axis[1]);
        kmp_json_string(json, "outline", closure->cam->outline->name);
    }
    if (closure->term_count > 0) {
        kmp_json_object(json, "terms");
        for (int k = 0; k < closure->term_count; k++)
            kmp_json_number(json, model->motions[closure->terms[k].motion].name, closure->terms[k].factor.value);
        kmp_json_end(json);
    }
    if (closure->constant)
        kmp_json_number(json, "equals", closure->constant->value);
    if (kmp_closure_has_axes(closure)) {
        kmp_json_array(json, "axes");
        kmp_json_numbers(json, NULL, 3, closure->axis[0]);
        kmp_json_numbers(json, NULL, 3, closure->axis[1]);
        kmp_json_end(json);
    }
    if (closure->table)
        kmp_json_string(json, "table", closure->table->name);
    else if (closure->curve_count > 0)
        put_curve(json, model, closure);
    const kmp_closure_number *own = kmp_closure_number_of(closure->kind);
    if (closure->function)
        put_expr(json, own ? own->key : "function", model, closure->function);
    else if (own)
        kmp_json_number(json, own->key, closure->number.value);
}

static void put_closures(kmp_json *json, const kempe_model *model)
{
    begin_list(json, "closures");
    for (int i = 0; i < model->closure_count - kmp_model_friction_count(model); i++) {
        kmp_model_json_item(json, NULL);
        put_closure(json, model, &model->closures[i]);
        kmp_json_end(json);
    }
    kmp_json_end(json);
    begin_list(json, "cuts");
    for (int i = 0; i < model->cut_count; i++) {
        const kmp_cut *cut = &model->cuts[i];
        kmp_model_json_item(json, NULL);
        kmp_model_json_cut(json, cut);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

/* -- forces and sensors -------------------------------------------------------------------------- */

static void put_square(kmp_json *json, const char *key, const kmp_number *of)
{
    kmp_json_array(json, key);
    for (int i = 0; i < KMP_BUSHING_SIZE; i++) {
        double row[KMP_BUSHING_SIZE];
        for (int j = 0; j < KMP_BUSHING_SIZE; j++)
            row[j] = of[KMP_BUSHING_SIZE * i + j].value;
        kmp_json_numbers(json, NULL, KMP_BUSHING_SIZE, row);
    }
    kmp_json_end(json);
}

void kmp_model_json_fields(kmp_json *json, const kempe_model *model, const kmp_force *force)
{
    for (int k = 0; k < kmp_force_field_count; k++) {
        const kmp_force_field *field = &kmp_force_fields[k];
        if (field->kind != force->kind || !kmp_force_has(force, k))
            continue;
        const char *key = kmp_force_key(model, force, field->key);
        if (field->size == 1)
            kmp_json_number(json, key, kmp_force_get(force, k)->value);
        else
            put_vector(json, key, kmp_force_get(force, k));
    }
    for (int k = 0; force->matrix && k < KMP_BUSHING_KINDS; k++)
        if (force->matrix->given[k])
            put_square(json, kmp_bushing_keys[k], force->matrix->of[k]);
    if (force->matrix && force->matrix->nonsymmetric)
        kmp_json_string(json, "nonsymmetric", "yes");
}

static void put_force(kmp_json *json, const kempe_model *model, const kmp_force *force)
{
    const kmp_force_row *row = &kmp_force_rows[force->kind];
    bool place = !row->word || kmp_force_is_between(force->kind);
    kmp_json_put(json, "name %s kind %s", force->name, place ? row->place : kmp_force_key(model, force, row->word));
    if (force->kind == KMP_FORCE_COMPLIANT) {
        const struct kmp_compliant *contact = force->compliant;
        const char *const keys[] = {"gap", "normal", "coefficient", "clearance", "radius", "speed"};
        const kmp_expr *const exprs[] = {force->touch.gap,   force->effort,   force->holding_effort,
                                         contact->clearance, contact->radius, contact->speed};
        if (contact->law)
            kmp_json_string(json, "law", contact->law);
        if (contact->film)
            kmp_json_string(json, "film", contact->film->law);
        for (int k = 0; k < 6; k++)
            if (exprs[k])
                put_expr(json, keys[k], model, exprs[k]);
        return;
    }
    if (force->kind == KMP_FORCE_TOUCH)
        kmp_pair_json(json, model, &force->touch);
    else if (force->contact > 0)
        kmp_json_string(json, "contact", model->forces[force->contact - 1].name);
    else if (force->kind == KMP_FORCE_WHEEL)
        kmp_json_string(json, "wheel", model->wheels[force->wheel].name);
    else if (force->kind == KMP_FORCE_TYRE)
        kmp_json_string(json, "tyre", force->name);
    else if (force->motion >= 0)
        kmp_json_string(json, "coordinate", model->motions[force->motion].name);
    else if (force->sliding)
        put_expr(json, "sliding", model, force->sliding);
    else if (force->kind == KMP_FORCE_BODY)
        kmp_json_string(json, "body", model->bodies[force->body].name);
    else if (kmp_force_is_between(force->kind)) {
        kmp_json_array(json, "points");
        for (int k = 0; k < force->through_count + 2; k++)
            kmp_model_json_point(json, NULL, model, kmp_force_point(force, k));
        kmp_json_end(json);
    } else {
        kmp_model_json_point(json, "point", model, force->point[0]);
    }
    kmp_model_json_fields(json, model, force);
    if (force->effort)
        put_expr(json, "effort", model, force->effort);
    if (force->kind == KMP_FORCE_TORSION)
        kmp_json_put(json, "axis %s", kmp_axis_names[force->axis]);
    if (force->holding_effort)
        put_expr(json, "static", model, force->holding_effort);
    if (force->kind == KMP_FORCE_TYRE && force->vector[0])
        put_expr(json, "height", model, force->vector[0]);
    else if (force->vector[0] && force->kind != KMP_FORCE_TOUCH)
        put_exprs(json, force->kind == KMP_FORCE_CYLINDER ? "pressures" : "components", model,
                  force->kind == KMP_FORCE_CYLINDER ? 1 + (force->vector[1] != NULL) : 3, force->vector);
}

/* Models without bearings have no such list. */
static void put_bearings(kmp_json *json, const kempe_model *model)
{
    if (model->bearing_count == 0)
        return;
    begin_list(json, "bearings");
    for (int i = 0; i < model->bearing_count; i++) {
        const kmp_bearing_pair *pair = &model->bearings[i];
        kmp_model_json_item(json, NULL);
        kmp_json_put(json, "name %s joint %s at [ %g %g ] thrust %d life [ %g %g ]", pair->name, pair->joint,
                     pair->at[0].value, pair->at[1].value, pair->thrust, pair->life[0], pair->life[1]);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void put_ropes(kmp_json *json, const kempe_model *model)
{
    static const char *const kinds[] = {"taut", "pulls", "elastic", "force"}, *const ways[] = {"right", "point",
                                                                                               "left"};
    if (model->rope_count == 0)
        return;
    begin_list(json, "ropes");
    for (const kmp_rope *rope = model->ropes; rope < model->ropes + model->rope_count; rope++) {
        kmp_model_json_item(json, NULL);
        kmp_json_put(json, "name %s kind %s closed %i", rope->name, kinds[rope->kind], rope->closed);
        if (rope->length)
            put_expr(json, "length", model, rope->length);
        if (rope->kind == KMP_ROPE_ELASTIC)
            kmp_json_number(json, rope->axial ? "axial_stiffness" : "stiffness", rope->stiffness.value);
        if (rope->preload.value != 0)
            kmp_json_number(json, "preload", rope->preload.value);
        kmp_json_array(json, "along");
        for (const kmp_rope_place *place = rope->places; place < rope->places + rope->count; place++) {
            kmp_json_object(json, NULL);
            kmp_model_json_point(json, "point", model, place->point);
            kmp_json_put(json, "turn %s", place->ball ? "sphere" : ways[place->turn + 1]);
            if (place->turn != 0)
                kmp_json_put(json, "radius %g drum %i", place->radius.value, place->drum);
            if (place->layers)
                kmp_json_put(json, "layers %s wound %g", place->layers->name, place->wound);
            kmp_json_end(json);
        }
        kmp_json_end(json);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void put_forces(kmp_json *json, const kempe_model *model)
{
    begin_list(json, "forces");
    for (int i = 0; i < model->force_count - model->state_count; i++) {
        kmp_model_json_item(json, NULL);
        put_force(json, model, &model->forces[i]);
        kmp_json_end(json);
    }
    kmp_json_end(json);
    put_bearings(json, model);
    kmp_model_json_begin(json, "sensors");
    for (int i = 0; i < model->sensor_count; i++)
        put_expr(json, model->sensors[i].name, model, model->sensors[i].expr);
    kmp_json_end(json);
}

/* -- start and run ------------------------------------------------------------------------------- */

static void put_values(kmp_json *json, const kempe_model *model, const char *key, const kmp_number *values)
{
    kmp_json_object(json, key);
    for (int i = 0; i < kmp_model_coordinates(model); i++)
        kmp_json_number(json, model->motions[i].name, values[i].value);
    kmp_json_end(json);
}

static bool has_deformations(const kempe_model *model)
{
    bool any = false;
    for (int i = 0; i < model->motion_count; i++)
        any = any || model->motions[i].elastic;
    return any;
}

static void put_start(kmp_json *json, const kempe_model *model)
{
    kmp_model_json_begin(json, "start");
    if (model->start.at)
        kmp_json_string(json, "at", model->start.at);
    if (has_deformations(model) || model->start.undeformed)
        kmp_json_string(json, "elastic", !model->start.undeformed ? "free" : model->start.statics ? "static" : "held");
    put_values(json, model, "q", model->start.q);
    put_values(json, model, "qd", model->start.qd);
    kmp_json_array(json, "hold");
    for (int i = 0; i < model->motion_count; i++)
        if (model->start.hold[i])
            kmp_json_string(json, NULL, model->motions[i].name);
    kmp_json_put(json, "] goals {");
    for (int i = 0; i < model->start.goal_count; i++) {
        const kmp_goal *goal = &model->start.goals[i];
        kmp_text name = {0};
        kmp_model_put_goal(&name, model, goal);
        kmp_json_object(json, name.s);
        kmp_text_free_part(json->text, &name);
        if (goal->width == 3) {
            put_vector(json, "value", goal->value);
            put_vector(json, "weight", goal->weight);
        } else {
            kmp_json_put(json, "value %g weight %g", goal->value[0].value, goal->weight[0].value);
        }
        kmp_json_end(json);
    }
    kmp_json_put(json, "} }");
}

/* -- the whole ----------------------------------------------------------------------------------- */

static kmp_json put_mechanism(kmp_text *text, const kempe_model *model)
{
    kmp_json json = kmp_json_begin_as(text, KMP_JSON_DENSE);
    kmp_json_put(&json, "{ name %s", model->name);
    put_vector(&json, "gravity", model->gravity);
    kmp_model_json_begin(&json, "parameters");
    for (int i = 0; i < model->parameter_count; i++)
        kmp_json_number(&json, model->parameters[i].name, model->parameters[i].number.value);
    kmp_json_end(&json);
    if (kmp_model_given_inputs(model) > 0) {
        /* Values and samples in SI, without a unit. */
        kmp_model_json_begin(&json, "inputs");
        for (int i = 0; i < kmp_model_given_inputs(model); i++) {
            const kmp_signal *s = &model->inputs[i].signal;
            kmp_json_put(&json, "%s { default %g", model->inputs[i].name, model->inputs[i].value);
            if (s->count > 1) {
                kmp_json_string(&json, "method", kmp_name_at(kmp_signal_words, (int)s->method));
                kmp_json_numbers(&json, "t", s->count, s->t);
                kmp_json_numbers(&json, "value", s->count, s->u);
            }
            kmp_json_end(&json);
        }
        kmp_json_end(&json);
    }
    if (model->state_count > 0)
        put_states(&json, model);
    kmp_model_json_begin(&json, "tables");
    for (int i = 0; i < model->table_count; i++) {
        const kmp_table *table = model->tables[i].table;
        if (model->tables[i].surface) {
            put_surface(&json, model->tables[i].name, model->tables[i].surface);
            continue;
        }
        kmp_json_put(&json, "%s { method %s", model->tables[i].name, kmp_table_method_word(table->method));
        kmp_json_numbers(&json, "x", table->count, table->x);
        kmp_json_numbers(&json, "y", table->count, table->y);
        if (model->tables[i].periodic)
            kmp_json_number(&json, "rise", model->tables[i].rise);
        if (model->tables[i].outside != KMP_OUTSIDE_NOT_SAID)
            kmp_json_put(&json, "outside %s", kmp_outside_word(model->tables[i].outside));
        kmp_json_end(&json);
    }
    kmp_json_end(&json);
    kmp_model_put_wings(&json, model, false);
    if (model->unknowns_count > 0)
        put_unknowns(&json, model);
    put_bodies(&json, model);
    kmp_model_put_wings(&json, model, true);
    put_closures(&json, model);
    put_ropes(&json, model);
    put_forces(&json, model);
    put_start(&json, model);
    return json;
}

void kmp_model_json_mechanism(kmp_text *text, const kempe_model *model)
{
    (void)put_mechanism(text, model);
}

void kmp_model_json(kmp_text *text, const kempe_model *model)
{
    kmp_json json = put_mechanism(text, model);
    kmp_model_json_shapes(&json, model);
    const kmp_run_settings *run = &model->run;
    kmp_shown_setting list[KMP_SETTINGS];
    kmp_model_settings(run, list);
    kmp_model_json_begin(&json, "run");
    for (int k = 0; k < KMP_SETTINGS; k++)
        if (list[k].is_word)
            kmp_json_string(&json, list[k].key, list[k].word);
        else
            kmp_json_number(&json, list[k].key, list[k].number > 0 ? list[k].number : NAN);
    kmp_json_array(&json, "independent");
    for (int i = 0; i < run->independent_count; i++)
        kmp_json_string(&json, NULL, model->motions[run->independent[i]].name);
    kmp_json_end(&json);
    put_exprs(&json, "until", model, run->until_count, run->until);
    kmp_json_array(&json, "outputs");
    for (int i = 0; i < model->output_count; i++) {
        kmp_text name = {0};
        kmp_output_print(&name, model, &model->outputs[i]);
        kmp_json_text(&json, NULL, &name);
    }
    kmp_json_put(&json, "] } }");
}
