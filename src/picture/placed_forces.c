/* SPDX-License-Identifier: BSD-3-Clause */
/* A contact presses along its normal n with N. Its friction f against the rate of a slip v.t is f t, because the
 * virtual power f v.t is the power of that force. A contact with a law has the vector of its friction. */
#include "picture/placed_forces.h"
#include "dynamics/closures.h"
#include "dynamics/kinematics/cam_contact.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/rope_path.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/closure.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/data/tyre.h"

/* The forces so far; `list` NULL: only their number. */
typedef struct listing {
    kmp_placed_force *list;
    int count, row;
    const char *kind; /* of what is added */
} listing;

static void add(listing *l, kmp_placed_force placed)
{
    placed.row = l->row;
    placed.kind = l->kind;
    if (l->list)
        l->list[l->count] = placed;
    l->count++;
}

static void put(kmp_vec place, kmp_vec force, kmp_ref *out)
{
    for (int i = 0; i < 3; i++) {
        out[i] = place.x[i];
        out[3 + i] = force.x[i];
    }
}

/* The body of the first point; of the ground the other one, which has the opposite force. */
static int body_of(const kempe_model *model, const int point[2])
{
    const int first = model->points[point[0]].body;
    return first > 0 ? first : model->points[point[1]].body;
}

/* -- contacts -------------------------------------------------------------------------------------------- */

static bool has_sides(const kmp_force *force)
{
    const kmp_contact_pair *touch = &force->touch;
    return (force->kind == KMP_FORCE_TOUCH || force->kind == KMP_FORCE_COMPLIANT) && touch->motion < 0 &&
           touch->side[0].point >= 0 && touch->side[1].point >= 0 && (!touch->gap || touch->clearance);
}

/* True for a pair of a contact with outlines, which has its own row. */
static bool is_pair(const kempe_model *model, int force)
{
    for (int c = 0; c < model->outline_contact_count; c++) {
        const kmp_outline_contact *of = &model->outline_contacts[c];
        if (force >= of->first && force < of->first + of->count * of->step && (force - of->first) % of->step == 0)
            return true;
    }
    return false;
}

static void list_contacts(const kempe_model *model, listing *l)
{
    for (int f = 0; f < model->force_count; f++) {
        const kmp_force *force = &model->forces[f];
        if (has_sides(force) && !is_pair(model, f)) {
            const int point[2] = {force->touch.side[0].point, force->touch.side[1].point};
            add(l,
                (kmp_placed_force){
                    .name = force->name, .label = "", .of = f, .part = 0, .body = body_of(model, point), .pairs = 1});
        }
    }
}

/* Friction of outlines has a list, too, without outlines. */
static void list_outlines(const kempe_model *model, listing *l)
{
    for (int c = 0; c < model->outline_contact_count; c++) {
        const kmp_outline_contact *contact = &model->outline_contacts[c];
        if (contact->outline[0] || contact->outline[1])
            add(l, (kmp_placed_force){.name = contact->name,
                                      .label = "",
                                      .of = c,
                                      .part = 0,
                                      .body = body_of(model, contact->point),
                                      .pairs = contact->count});
    }
}

/* The sum of the forces of friction that belong to a rigid contact. */
static kmp_vec add_friction(const kmp_tree *tree, int contact, kmp_vec normal, kmp_vec sum)
{
    const kempe_model *model = tree->model;
    kmp_forces forces;
    for (int f = 0; f < model->force_count; f++) {
        const kmp_force *friction = &model->forces[f];
        if (friction->contact != 1 + contact || friction->kind != KMP_FORCE_FRICTION)
            continue;
        kmp_forces_init(&forces, tree, 0, friction);
        if (!forces.value)
            return sum;
        const kmp_vec along = kmp_touching_direction(tree, &model->forces[contact].touch, normal, friction->across);
        const kmp_ref size = forces.value[(ptrdiff_t)KMP_FORCE_WIDTH * f];
        sum = kmp_vec_add(tree->graph, sum, kmp_vec_scale(tree->graph, size, along));
    }
    return sum;
}

/* Of one contact of two sides, on the first body or, where that is the ground, on the second one. */
static void find_sides(const kmp_tree *tree, int contact, bool first, kmp_ref *out)
{
    kmp_graph *g = tree->graph;
    const kmp_force *force = &tree->model->forces[contact];
    const bool rigid = force->kind == KMP_FORCE_TOUCH;
    kmp_ref against[KMP_COMPLIANT_FORCES], size[KMP_COMPLIANT_FORCES];
    kmp_touching touching;
    kmp_touching_find(tree, &force->touch, false, &touching);
    const int count = rigid ? 0 : kmp_compliant_forces(tree, force, against, size);
    const kmp_ref push = rigid ? kmp_tree_multiplier(tree, force->closure, 0) : size[0];
    kmp_vec sum = kmp_vec_scale(g, push, touching.normal);
    if (rigid)
        sum = add_friction(tree, contact, touching.normal, sum);
    else if (count == 2)
        sum = kmp_vec_sub(g, sum,
                          kmp_vec_scale(g, size[1], kmp_touching_direction(tree, &force->touch, touching.normal, 0)));
    for (int i = 0; !rigid && count == 4 && i < 3; i++)
        sum.x[i] = kmp_sub(g, sum.x[i], size[1 + i]);
    sum = kmp_link_direction(tree, touching.frame, first ? sum : kmp_vec_sub(g, kmp_vec_zero(), sum), 0);
    put(kmp_vec_add(g, kmp_point_position(tree, force->touch.side[1].point, 0),
                    kmp_link_direction(tree, touching.frame, touching.arm[1], 0)),
        sum, out);
}

static void find_contact(const kmp_tree *tree, const kmp_placed_force *placed, kmp_ref *out)
{
    const kmp_contact_pair *touch = &tree->model->forces[placed->of].touch;
    find_sides(tree, placed->of, tree->model->points[touch->side[0].point].body > 0, out);
}

/* Pairs have circles of the one outline and pieces of the other in turn: the body of the arrow has a side of each. */
static void find_outlines(const kmp_tree *tree, const kmp_placed_force *placed, kmp_ref *out)
{
    const kempe_model *model = tree->model;
    const kmp_outline_contact *contact = &model->outline_contacts[placed->of];
    for (int k = 0; k < contact->count; k++) {
        const int of = contact->first + k * contact->step;
        const kmp_touch_side *side = &model->forces[of].touch.side[0];
        find_sides(tree, of, model->points[side->point].body == placed->body, out + (ptrdiff_t)KMP_PLACED_VALUES * k);
    }
}

/* -- tyres ----------------------------------------------------------------------------------------------- */

static void list_tyres(const kempe_model *model, listing *l)
{
    static const char *const labels[3] = {"Fx", "Fy", "Fz"};
    for (int k = 0; k < model->tyre_count; k++)
        for (int i = 0; i < 3; i++)
            add(l, (kmp_placed_force){.name = model->tyres[k].name,
                                      .label = labels[i],
                                      .of = model->tyres[k].force,
                                      .part = i,
                                      .body = model->points[model->tyres[k].point].body,
                                      .pairs = 1});
}

static void find_tyre(const kmp_tree *tree, const kmp_placed_force *placed, kmp_ref *out)
{
    const kmp_force *force = &tree->model->forces[placed->of];
    kmp_force_place *place_of = kmp_force_place_of(force->kind);
    kmp_forces forces;
    kmp_vec place, axes[3];
    kmp_forces_init(&forces, tree, 0, force);
    if (!forces.value || !place_of)
        return;
    place_of(tree, force, &place, axes);
    const kmp_ref size = forces.value[(ptrdiff_t)KMP_FORCE_WIDTH * placed->of + placed->part];
    put(place, kmp_vec_scale(tree->graph, size, axes[placed->part]), out);
}

/* -- ropes ----------------------------------------------------------------------------------------------- */

static void list_ropes(const kempe_model *model, listing *l)
{
    for (int k = 0; k < model->rope_count; k++) {
        const kmp_rope *rope = &model->ropes[k];
        for (int last = 0; last < 2 && !rope->closed; last++)
            add(l, (kmp_placed_force){.name = rope->name,
                                      .label = "",
                                      .of = k,
                                      .part = last,
                                      .body = model->points[rope->places[last ? rope->count - 1 : 0].point].body,
                                      .pairs = 1});
    }
}

static void find_rope(const kmp_tree *tree, const kmp_placed_force *placed, kmp_ref *out)
{
    const kmp_rope *rope = &tree->model->ropes[placed->of];
    kmp_vec place, along;
    kmp_rope_end(tree, rope, placed->part, &place, &along);
    put(place, kmp_vec_scale(tree->graph, kmp_rope_end_tension(tree, rope, placed->part), along), out);
}

/* -- followers of cams ------------------------------------------------------------------------------------- */

static void list_followers(const kempe_model *model, listing *l)
{
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure *closure = &model->closures[c];
        const int point[2] = {closure->point[1], closure->point[0]};
        if (closure->cam)
            add(l,
                (kmp_placed_force){
                    .name = closure->name, .label = "", .of = c, .part = 0, .body = body_of(model, point), .pairs = 1});
    }
}

static void find_follower(const kmp_tree *tree, const kmp_placed_force *placed, kmp_ref *out)
{
    kmp_graph *g = tree->graph;
    const kmp_closure *closure = &tree->model->closures[placed->of];
    kmp_cam_contact contact;
    kmp_cam_contact_find(tree, closure->cam, closure->point, closure->axis[1], &contact);
    const kmp_vec force = kmp_closure_load(tree, placed->of, false);
    const kmp_vec arm = kmp_link_direction(tree, contact.frame, contact.arm, 0);
    const kmp_vec place = kmp_vec_add(g, kmp_point_position(tree, closure->point[1], 0), arm);
    const bool own = tree->model->points[closure->point[1]].body > 0;
    put(place, own ? force : kmp_vec_sub(g, kmp_vec_zero(), force), out);
}

/* -- all kinds --------------------------------------------------------------------------------------------- */

static const struct {
    const char *kind;
    void (*list)(const kempe_model *model, listing *l);
    void (*find)(const kmp_tree *tree, const kmp_placed_force *placed, kmp_ref *out);
} kinds[] = {
    {"contacts", list_contacts, find_contact},
    {"contacts", list_outlines, find_outlines},
    {"contacts", list_followers, find_follower},
    {"tyres", list_tyres, find_tyre},
    {"ropes", list_ropes, find_rope},
};

int kmp_placed_forces(const kempe_model *model, kmp_placed_force *list)
{
    listing l = {.list = list};
    for (; l.row < (int)(sizeof kinds / sizeof *kinds); l.row++) {
        l.kind = kinds[l.row].kind;
        kinds[l.row].list(model, &l);
    }
    return l.count;
}

void kmp_placed_force_find(const kmp_tree *tree, const kmp_placed_force *placed, kmp_ref *out)
{
    kinds[placed->row].find(tree, placed, out);
}
