/* SPDX-License-Identifier: BSD-3-Clause */
/* One visit to every number of a model: parameters, variants and sensitivities find their numbers by it. */
#include "model/data/numbers.h"
#include "model/data/bushing_matrix.h"
#include "model/data/closure_table.h"
#include "model/data/gear.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/data/tyre.h"
#include <stddef.h>

const char *const kmp_inertia_names[6] = {"xx", "yy", "zz", "xy", "xz", "yz"};

const kmp_wheel_field kmp_wheel_fields[KMP_WHEEL_FIELDS] = {
#define KMP_WHEEL_NUMBER(member, rule) {#member, offsetof(kmp_wheel, member), KMP_FIELD_##rule},
#include "model/data/wheel_numbers.def"
#undef KMP_WHEEL_NUMBER
};

const kmp_wheel_field kmp_tyre_fields[KMP_TYRE_FIELDS] = {
#define KMP_TYRE_NUMBER(member, rule) {#member, offsetof(kmp_tyre, member), KMP_FIELD_##rule},
#include "model/data/tyre_numbers.def"
#undef KMP_TYRE_NUMBER
};

const kmp_number *kmp_tyre_get(const kmp_tyre *tyre, int field)
{
    return (const kmp_number *)(const void *)((const char *)tyre + kmp_tyre_fields[field].offset);
}

typedef struct walk {
    kmp_number_visit *visit;
    void *user;
    bool on; /* no visit has ended it */
} walk;

static void visit(walk *w, const char *owner, const char *key, int count, const kmp_number *numbers)
{
    static const char *const xyz[] = {"x", "y", "z"};
    for (int k = 0; k < count && w->on; k++) {
        const char *part = count == 1   ? NULL
                           : count == 3 ? xyz[k]
                           : count == 6 ? kmp_inertia_names[k]
                                        : kmp_bushing_entries[k];
        w->on = w->visit(w->user, &numbers[k], owner, key, part);
    }
}

static void visit_closure(walk *w, const kempe_model *model, const kmp_closure *closure)
{
    const kmp_closure_number *own = kmp_closure_number_of(closure->kind);
    if (own)
        visit(w, closure->name, own->key, 1, &closure->number);
    if (closure->constant)
        visit(w, closure->name, "equals", 1, closure->constant);
    for (int k = 0; k < closure->term_count; k++)
        visit(w, closure->name, model->motions[closure->terms[k].motion].name, 1, &closure->terms[k].factor);
}

static void visit_rope(walk *w, const kmp_rope *rope)
{
    for (int k = 0; k < rope->count; k++)
        if (rope->places[k].turn != 0 && !rope->places[k].layers)
            visit(w, rope->name, "radius", 1, &rope->places[k].radius);
    if (rope->kind == KMP_ROPE_ELASTIC)
        visit(w, rope->name, rope->axial ? "axial_stiffness" : "stiffness", 1, &rope->stiffness);
    if (rope->preload.value != 0 || rope->preload.expr)
        visit(w, rope->name, "preload", 1, &rope->preload);
}

static void visit_constants(walk *w, const kempe_model *model, const kmp_flexible *flexible)
{
    for (int i = 0; i < flexible->number_count; i++)
        visit(w, model->bodies[flexible->body].name, "flexible", 1, &flexible->numbers[i]);
}

bool kmp_numbers_visit(const kempe_model *model, kmp_number_visit *each, void *user)
{
    walk w = {each, user, true};
    visit(&w, "gravity", "", 3, model->gravity);
    for (int k = 1; k < model->body_count; k++) {
        const kmp_body *body = &model->bodies[k];
        visit(&w, body->name, "mass", 1, &body->mass);
        visit(&w, body->name, "com", 3, body->com);
        if (body->coupling)
            visit(&w, body->name, kmp_joint_key(body->coupling), 1, &body->number);
        if (kmp_body_has_armature(body))
            visit(&w, body->name, "armature", 1, &body->armature);
        visit(&w, body->name, "inertia", 6, body->inertia);
    }
    for (int k = 0; k < model->point_count; k++) {
        const kmp_point *point = &model->points[k];
        visit(&w, model->bodies[point->body].name, point->name, 3, point->at);
        if (point->station > 0)
            visit(&w, model->bodies[point->body].name, point->name, 3, point->offset);
    }
    for (int k = 0; k < model->flexible_count; k++) {
        const kmp_flexible *flexible = &model->flexibles[k];
        visit_constants(&w, model, flexible);
        for (int s = 0; s < flexible->station_count; s++)
            if (flexible->stations[s].beyond)
                visit_constants(&w, model, flexible->stations[s].beyond);
    }
    for (int k = 0; k < model->closure_count; k++)
        visit_closure(&w, model, &model->closures[k]);
    for (const kmp_closure *c = model->closures; c < model->closures + model->closure_count; c++)
        for (int k = 0; c->gear && k < KMP_GEAR_NUMBERS; k++)
            if (kmp_gear_has(c->gear, (kmp_gear_number)k))
                visit(&w, c->name, kmp_gear_number_keys[k], 1, &c->gear->number[k]);
    for (int k = 0; k < model->rope_count; k++)
        visit_rope(&w, &model->ropes[k]);
    for (int k = 0; k < model->force_count; k++) {
        const kmp_force *force = &model->forces[k];
        for (int i = 0; i < kmp_force_field_count; i++)
            if (kmp_force_fields[i].kind == force->kind)
                visit(&w, force->name, kmp_force_fields[i].key, kmp_force_fields[i].size, kmp_force_get(force, i));
        for (int i = 0; force->matrix && i < KMP_BUSHING_KINDS; i++)
            if (force->matrix->given[i])
                visit(&w, force->name, kmp_bushing_keys[i], KMP_BUSHING_SIZE * KMP_BUSHING_SIZE, force->matrix->of[i]);
    }
    for (int k = 0; k < model->bearing_count; k++)
        for (int i = 0; i < 2; i++)
            visit(&w, model->bearings[k].name, "at", 1, &model->bearings[k].at[i]);
    for (int k = 0; k < model->wheel_count; k++)
        for (int f = 0; f < KMP_WHEEL_FIELDS; f++)
            visit(&w, model->wheels[k].name, kmp_wheel_fields[f].key, 1,
                  (const kmp_number *)(const void *)((const char *)&model->wheels[k] + kmp_wheel_fields[f].offset));
    for (int k = 0; k < model->road_count; k++)
        visit(&w, model->roads[k].name, "friction", 1, &model->roads[k].friction);
    for (int k = 0; k < model->tyre_count; k++)
        for (int f = 0; f < KMP_TYRE_FIELDS; f++)
            visit(&w, model->tyres[k].name, kmp_tyre_fields[f].key, 1, kmp_tyre_get(&model->tyres[k], f));
    for (int k = 0; k < model->state_count; k++)
        if (model->states[k].delay.value > 0)
            visit(&w, model->states[k].name, "time", 1, &model->states[k].delay);
    for (int k = 0; k < model->motion_count; k++) {
        visit(&w, "start.q", model->motions[k].name, 1, &model->start.q[k]);
        visit(&w, "start.qd", model->motions[k].name, 1, &model->start.qd[k]);
    }
    for (int k = 0; k < model->cut_coordinate_count; k++) {
        visit(&w, "start.q", model->cut_coordinates[k].name, 1, &model->cut_coordinates[k].q);
        visit(&w, "start.qd", model->cut_coordinates[k].name, 1, &model->cut_coordinates[k].qd);
    }
    for (int k = 0; k < model->start.goal_count; k++) {
        visit(&w, "start.goals", "value", 3, model->start.goals[k].value);
        visit(&w, "start.goals", "weight", 3, model->start.goals[k].weight);
    }
    return w.on;
}
