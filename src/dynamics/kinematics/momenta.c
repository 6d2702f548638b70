/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/kinematics/momenta.h"

/* A rigid part in motion: its mass, and in ground axes its centre, its momentum, and its angular momentum about its
 * centre, I w. */
typedef struct part {
    kmp_ref mass;
    kmp_vec centre, momentum, spin;
} part;

static part in_motion(const kmp_tree *tree, int link, const kmp_inertia *of)
{
    kmp_graph *g = tree->graph;
    part p = {.mass = of->mass, .centre = kmp_link_position(tree, link, of->com, 0)};
    kmp_vec w = kmp_from_ancestor(tree, link, 0, kmp_link_spin(tree, link, 0));
    p.momentum = kmp_vec_scale(g, of->mass, kmp_vec_rate(tree, p.centre));
    p.spin = kmp_link_direction(tree, link, kmp_tensor_apply(g, of->about_com, w), 0);
    return p;
}

/* The parts of a body or of all links: the next one from *at on; false: there are no more. */
static bool next_part(const kmp_tree *tree, int body, int *at, part *p)
{
    int link = body < 0 ? *at + 1 : tree->mounts[body].link;
    if (link > kmp_model_coordinates(tree->model) || (body >= 0 && *at > 0))
        return false;
    *at = link;
    const kmp_link *l = &tree->links[link];
    const kmp_inertia of = body < 0 ? (kmp_inertia){l->mass, l->com, l->inertia} : kmp_body_inertia(tree, body);
    *p = in_motion(tree, link, &of);
    return true;
}

kmp_vec kmp_momentum(const kmp_tree *tree, int body)
{
    kmp_vec sum = kmp_vec_zero();
    part p;
    for (int at = 0; next_part(tree, body, &at, &p);)
        sum = kmp_vec_add(tree->graph, sum, p.momentum);
    return sum;
}

/* The common centre of mass; the origin of the ground where nothing has a mass. */
static kmp_vec find_centre(const kmp_tree *tree, int body)
{
    kmp_graph *g = tree->graph;
    kmp_ref mass = KMP_ZERO;
    kmp_vec moment = kmp_vec_zero();
    part p;
    for (int at = 0; next_part(tree, body, &at, &p);) {
        mass = kmp_add(g, mass, p.mass);
        moment = kmp_vec_add(g, moment, kmp_vec_scale(g, p.mass, p.centre));
    }
    return mass == KMP_ZERO ? moment : kmp_vec_scale(g, kmp_div(g, KMP_ONE, mass), moment);
}

kmp_vec kmp_angular_momentum(const kmp_tree *tree, int body, int point)
{
    kmp_graph *g = tree->graph;
    bool own = body >= 0 && point < 0; /* about the centre of its only part */
    kmp_vec sum = kmp_vec_zero(), about = own         ? sum
                                          : point < 0 ? find_centre(tree, body)
                                                      : kmp_point_position(tree, point, 0);
    part p;
    for (int at = 0; next_part(tree, body, &at, &p);) {
        sum = kmp_vec_add(g, sum, p.spin);
        if (!own)
            sum = kmp_vec_add(g, sum, kmp_vec_cross(g, kmp_vec_sub(g, p.centre, about), p.momentum));
    }
    return sum;
}
