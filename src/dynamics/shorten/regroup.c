/* SPDX-License-Identifier: BSD-3-Clause */
/* Masses on the axis of a rotation move as if they were fixed to its parent; so does the whole inertia of bodies
 * carried along a translation. Counted there they join the parent's own mass: the base parameters of identification
 * (Gautier and Khalil, IEEE Trans. Robotics and Automation 6, 1990; Niemeyer and Slotine, Int. J. Robotics Research 10,
 * 1991).
 *
 * From the leaves inwards, so that a link passes on the mass that it received with its own. Links whose equations use
 * the centre of mass can give and receive inertia alone. */
#include "dynamics/shorten/variants.h"

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
