/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/variants.h"
#include "base/memory.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "symbolic/trig.h"
#include <limits.h>
#include <string.h>

/* The bytes of all motions, then the bytes of all closures. */
static size_t motion_savings(const kempe_model *model)
{
    return 5 * (size_t)kmp_model_motion_count(model);
}

static size_t savings_size(const kempe_model *model)
{
    return motion_savings(model) + 4 * (size_t)kmp_model_closure_count(model);
}

bool kmp_savings_init(kmp_savings *savings, const kempe_model *model)
{
    size_t n = (size_t)kmp_model_motion_count(model);
    uint8_t *all = KMP_NEW(uint8_t, savings_size(model));
    *savings = (kmp_savings){0};
    if (all)
        *savings = (kmp_savings){.stay = all,
                                 .about = all + n,
                                 .origin = all + 2 * n,
                                 .give = all + 3 * n,
                                 .lump = all + 4 * n,
                                 .point = all + motion_savings(model)};
    return all;
}

void kmp_savings_clear(kmp_savings *savings, const kempe_model *model)
{
    memset(savings->stay, 0, savings_size(model));
    savings->by_q = savings->by_qd = (kmp_tangent_method)0;
    savings->patterns = 0;
}

KMP_CLEARS(kmp_savings, savings, kmp_free(savings->stay))

void kmp_savings_put(kmp_bytes *bytes, const kmp_savings *savings, const kempe_model *model)
{
    size_t size = savings->stay ? savings_size(model) : 0;
    kmp_bytes_put_int(bytes, (int64_t)size);
    kmp_bytes_put(bytes, savings->stay, size);
    kmp_bytes_put_int(bytes, savings->by_q);
    kmp_bytes_put_int(bytes, savings->by_qd);
    kmp_bytes_put_int(bytes, savings->patterns);
}

void kmp_savings_take(kmp_byte_source *source, kmp_savings *savings, const kempe_model *model)
{
    int size = kmp_bytes_take_count(source, 1);
    *savings = (kmp_savings){0};
    if (size > 0)
        source->failed = source->failed || (size_t)size != savings_size(model) || !kmp_savings_init(savings, model);
    if (savings->stay)
        kmp_bytes_take(source, savings->stay, (size_t)size);
    savings->by_q = (kmp_tangent_method)kmp_bytes_take_int(source, 0, KMP_TANGENT_COMPOSITE);
    savings->by_qd = (kmp_tangent_method)kmp_bytes_take_int(source, 0, KMP_TANGENT_COMPOSITE);
    savings->patterns = (unsigned)kmp_bytes_take_int(source, 0, INT_MAX);
}

void kmp_savings_copy(kmp_savings *to, const kmp_savings *from, const kempe_model *model)
{
    memcpy(to->stay, from->stay, savings_size(model));
    to->by_q = from->by_q;
    to->by_qd = from->by_qd;
    to->patterns = from->patterns;
}

void kmp_savings_copy_dynamics(kmp_savings *to, const kmp_savings *from, const kempe_model *model)
{
    memcpy(to->stay, from->stay, motion_savings(model));
    to->patterns = from->patterns;
}

bool kmp_savings_same(const kmp_savings *a, const kmp_savings *b, const kempe_model *model)
{
    return memcmp(a->stay, b->stay, savings_size(model)) == 0;
}

bool kmp_savings_plain(const kmp_savings *savings, const kempe_model *model)
{
    for (size_t k = 0; k < motion_savings(model); k++)
        if (savings->stay[k])
            return false;
    return true;
}

/* -- origins along axes ----------------------------------------------------------------------------- */

/* The origin of link i moves by d, fixed to it: p of i grows by d; vectors fixed to i (its centre of mass, its
 * children's p, points) decrease by d. A component is moved by the same symbol, so that the difference is a symbolic
 * zero. */

/* The part of v that the joint lets its origin move by; none if that depended on anything but numbers. */
static kmp_vec along(const kmp_tree *tree, int i, kmp_vec v)
{
    const kmp_link *link = &tree->links[i];
    for (int k = 0; k < 3; k++) {
        if (link->rotation && k != link->axis)
            v.x[k] = KMP_ZERO;
        if (kmp_graph_node(tree->graph, kmp_id(v.x[k]))->depends & ~(1u << KMP_IN_PARAMETER))
            return kmp_vec_zero();
    }
    return v;
}

static kmp_vec target(const kmp_tree *tree, int i, kmp_origin to)
{
    const kmp_link *link = &tree->links[i];
    int child = to == KMP_ORIGIN_CHILD ? kmp_tree_first_child(tree, i) : 0;
    if (to == KMP_ORIGIN_PARENT)
        return kmp_vec_sub(tree->graph, kmp_vec_zero(), kmp_link_to_child(tree, i, link->p));
    if (to == KMP_ORIGIN_MASS && link->mass != KMP_ZERO)
        return link->com;
    return child ? tree->links[child].p : kmp_vec_zero();
}

void kmp_move_origins(kmp_tree *tree, const uint8_t *origin)
{
    for (int i = 1; i < tree->count; i++) {
        kmp_vec d = origin[i - 1] ? along(tree, i, target(tree, i, (kmp_origin)origin[i - 1])) : kmp_vec_zero();
        if (!kmp_vec_is_zero(d)) {
            kmp_graph *g = tree->graph;
            kmp_link *link = &tree->links[i];
            link->p = kmp_vec_add(g, link->p, kmp_link_to_parent(tree, i, d));
            if (link->body >= 0 || link->mass != KMP_ZERO)
                link->com = kmp_vec_sub(g, link->com, d);
            for (int k = i + 1; k < tree->count; k++)
                if (tree->links[k].parent == i)
                    tree->links[k].p = kmp_vec_sub(g, tree->links[k].p, d);
            for (int b = 1; b < kmp_model_body_count(tree->model); b++)
                if (tree->mounts[b].link == i)
                    tree->mounts[b].p = kmp_vec_sub(g, tree->mounts[b].p, d);
        }
    }
}

/* -- regrouped masses ------------------------------------------------------------------------------- */

/* Masses on the axis of a rotation move as if they were fixed to its parent; so does the whole inertia of bodies
 * carried along a translation. Counted there they join the parent's own mass: the base parameters of identification
 * (Gautier and Khalil, IEEE Trans. Robotics and Automation 6, 1990; Niemeyer and Slotine, Int. J. Robotics Research 10,
 * 1991).
 *
 * From the leaves inwards, so that a link passes on the mass that it received with its own. Links whose equations use
 * the centre of mass can give and receive only inertia. */

static kmp_composite nothing(void)
{
    kmp_composite c = {.mass = KMP_ZERO, .moment = kmp_vec_zero()};
    for (int k = 0; k < 6; k++)
        c.inertia.x[k] = KMP_ZERO;
    return c;
}

static kmp_tensor tensor_sub(kmp_graph *g, kmp_tensor a, kmp_tensor b)
{
    for (int k = 0; k < 6; k++)
        a.x[k] = kmp_sub(g, a.x[k], b.x[k]);
    return a;
}

/* The part of an inertia that moves with the parent. A rotation's is symmetric about its axis, so that one diagonal
 * entry across the axis vanishes; in the plane there is none. */
static kmp_tensor inertia_of(const kmp_link *link, kmp_tensor t)
{
    int p = (link->axis + 1) % 3, q = (link->axis + 2) % 3;
    kmp_tensor gift = nothing().inertia;
    if (!link->rotation)
        return t;
    if (t.x[p] != KMP_ZERO && t.x[q] != KMP_ZERO)
        gift.x[p] = gift.x[q] = t.x[p];
    return gift;
}

static kmp_vec moment_of(const kmp_link *link, kmp_vec b)
{
    return link->rotation ? kmp_vec_axis(b.x[link->axis], link->axis) : kmp_vec_zero();
}

/* About the parent's origin, in its axes. The angle falls out of a rotation's. */
static kmp_composite to_parent(const kmp_tree *tree, int i, kmp_composite gift)
{
    gift.moment = kmp_link_to_parent(tree, i, gift.moment);
    gift.inertia = kmp_link_tensor_to_parent(tree, i, gift.inertia);
    return kmp_composite_shifted(tree->graph, gift, tree->links[i].p);
}

static void give_wrench(kmp_tree *tree, int i, uint8_t give)
{
    kmp_graph *g = tree->graph;
    kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    kmp_composite gift = nothing();
    if (give & KMP_GIVE_MASS && link->rotation)
        gift.mass = link->own.mass;
    if (give & KMP_GIVE_MOMENT)
        gift.moment = moment_of(link, link->own.moment);
    if (gift.mass != KMP_ZERO || !kmp_vec_is_zero(gift.moment))
        link->about = parent->about = true;
    if (give & KMP_GIVE_INERTIA)
        gift.inertia = inertia_of(link, link->about ? link->own.inertia : link->inertia);
    link->own.mass = kmp_sub(g, link->own.mass, gift.mass);
    link->own.moment = kmp_vec_sub(g, link->own.moment, gift.moment);
    link->own.inertia = tensor_sub(g, link->own.inertia, gift.inertia);
    link->inertia = tensor_sub(g, link->inertia, gift.inertia);
    gift = to_parent(tree, i, gift);
    parent->own = kmp_composite_add(g, parent->own, gift);
    parent->inertia = kmp_tensor_add(g, parent->inertia, gift.inertia);
}

void kmp_regroup(kmp_tree *tree, const uint8_t *give)
{
    for (int i = tree->count - 1; i > 0; i--)
        if (give[i - 1] && tree->links[i].parent > 0)
            give_wrench(tree, i, give[i - 1]);
}

static void give_composite(kmp_tree *tree, int i, uint8_t give, kmp_ref mass)
{
    kmp_graph *g = tree->graph;
    kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    kmp_composite gift = nothing();
    if (give & KMP_GIVE_MOMENT)
        gift.moment = moment_of(link, link->base.moment);
    if (give & KMP_GIVE_INERTIA)
        gift.inertia = inertia_of(link, link->base.inertia);
    link->base.moment = kmp_vec_sub(g, link->base.moment, gift.moment);
    link->base.inertia = tensor_sub(g, link->base.inertia, gift.inertia);
    link->lumped = give & KMP_GIVE_MASS;
    if (link->lumped)
        gift.mass = mass;
    gift = to_parent(tree, i, gift);
    gift.mass = KMP_ZERO; /* is summed up with the rest */
    parent->base = kmp_composite_add(g, parent->base, gift);
}

void kmp_lump(kmp_tree *tree, const uint8_t *give)
{
    kmp_ref *mass = KMP_GRAPH_NEW(tree->graph, kmp_ref, tree->count); /* of all that a link carries, and its own */
    for (int i = tree->count - 1; mass && i > 0; i--) {
        int h = tree->links[i].parent;
        mass[i] = kmp_add(tree->graph, mass[i], tree->links[i].mass);
        mass[h] = kmp_add(tree->graph, mass[h], mass[i]);
        if (give[i - 1] && h > 0)
            give_composite(tree, i, give[i - 1], mass[i]);
    }
}

/* -- axes that do not turn -------------------------------------------------------------------------- */

/* Non-rotating axes: link axes that do not turn with the joint. Vectors need not be rotated forth and back, but all
 * vectors fixed to the body are, by the joint's angle. If the parent's axes do not turn about the same axis either, the
 * angle is the sum. */

static void turn(kmp_graph *g, const kmp_link *link, kmp_vec *v)
{
    kmp_rotate(g, link->lag, &v->x[(link->axis + 1) % 3], &v->x[(link->axis + 2) % 3]);
}

static void turn_composite(kmp_graph *g, const kmp_link *link, kmp_composite *c)
{
    turn(g, link, &c->moment);
    c->inertia = kmp_tensor_turn(g, link->axis, link->lag, c->inertia);
}

void kmp_let_stay(kmp_tree *tree, const uint8_t *stay)
{
    kmp_graph *g = tree->graph;
    for (int i = 1; i < tree->count; i++) {
        kmp_link *link = &tree->links[i];
        const kmp_link *parent = &tree->links[link->parent];
        turn(g, parent, &link->p);
        link->stays = stay[i - 1] && link->rotation;
        if (!link->stays)
            continue;
        link->follows = parent->stays && parent->axis == link->axis && !link->turned;
        link->lag = link->follows ? kmp_angle_add(g, parent->lag, link->q) : link->q;
        turn(g, link, &link->com);
        link->inertia = kmp_tensor_turn(g, link->axis, link->lag, link->inertia);
        turn_composite(g, link, &link->own);
        turn_composite(g, link, &link->base);
    }
    for (int b = 1; b < kmp_model_body_count(tree->model); b++)
        turn(g, &tree->links[tree->mounts[b].link], &tree->mounts[b].p);
}
