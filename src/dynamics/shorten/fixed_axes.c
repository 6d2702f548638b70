/* SPDX-License-Identifier: BSD-3-Clause */
/* Non-rotating axes: link axes that do not turn with the joint. Vectors need not be rotated forth and back, but all
 * vectors fixed to the body are, by the joint's angle. If the parent's axes do not turn about the same axis either, the
 * angle is the sum. */
#include "dynamics/shorten/variants.h"
#include "symbolic/rotation.h"

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
    for (int b = 1; b < tree->model->body_count; b++)
        turn(g, &tree->links[tree->mounts[b].link], &tree->mounts[b].p);
}
