/* SPDX-License-Identifier: BSD-3-Clause */
/* The film between a journal and its bearing. Over the clearance c the journal is at (x, y) in the bearing and turns
 * there with the angular velocity w. Reynolds' equation depends on
 *
 *     u = x' + w y/2,     v = y' - w x/2
 *
 * alone, because a film that rotates with half the speed of its journal presses nowhere. If it would be thinner than
 * its least thickness, (x, y) is that of the least thickness in the same direction. Its shear is that of Petroff, 2 pi
 * viscosity R^3 L w/(c sqrt(1 - x^2 - y^2)), of DuBois and Ocvirk, NACA Report 1157, 1953. */
#include "dynamics/forces/journal_film.h"

/* The film's place at its least thickness, and the condition that it is there. */
static void limit(const kmp_tree *tree, const kmp_force *force, kmp_ref place[2])
{
    kmp_graph *g = tree->graph;
    kmp_ref most = kmp_tree_expression(tree, force->compliant->film->most);
    kmp_ref square = kmp_add(g, kmp_mul(g, place[0], place[0]), kmp_mul(g, place[1], place[1]));
    kmp_ref thin = kmp_tree_condition(tree, force, KMP_PRESSING_THIN, kmp_sub(g, kmp_mul(g, most, most), square), 0,
                                      NULL, "least film of '%s'", force->name);
    kmp_ref factor = kmp_select(g, thin, kmp_div(g, most, kmp_sqrt(g, square)), KMP_ONE);
    for (int k = 0; k < 2; k++)
        place[k] = kmp_mul(g, factor, place[k]);
}

void kmp_film_find(const kmp_tree *tree, const kmp_force *force, const kmp_pressing *at, kmp_film_load *load)
{
    kmp_graph *g = tree->graph;
    const kmp_film *film = force->compliant->film;
    kmp_ref c = kmp_tree_expression(tree, force->compliant->clearance), half = kmp_const(g, 0.5);
    kmp_ref spin = kmp_tree_expression(tree, force->vector[2]), turned = kmp_mul(g, half, spin);
    kmp_ref place[2] = {kmp_div(g, at->x, c), kmp_div(g, at->y, c)}, values[KMP_LOCAL_END] = {KMP_ZERO};
    kmp_vec rate = kmp_vec_rate(tree, (kmp_vec){{at->x, at->y, KMP_ZERO}});
    limit(tree, force, place);
    values[KMP_LOCAL_FILM_X] = place[0];
    values[KMP_LOCAL_FILM_Y] = place[1];
    kmp_ref u = kmp_div(g, rate.x[0], c), v = kmp_div(g, rate.x[1], c);
    values[KMP_LOCAL_FILM_U] = kmp_add(g, u, kmp_mul(g, turned, place[1]));
    values[KMP_LOCAL_FILM_V] = kmp_sub(g, v, kmp_mul(g, turned, place[0]));
    kmp_tree within = *tree;
    within.place = values;
    kmp_ref scale = kmp_tree_expression(tree, film->scale);
    for (int k = 0; k < 2; k++) {
        load->against[k] = rate.x[k];
        load->size[k] = kmp_mul(g, scale, kmp_tree_expression(&within, film->force[k]));
    }
    kmp_ref square = kmp_add(g, kmp_mul(g, place[0], place[0]), kmp_mul(g, place[1], place[1]));
    kmp_ref root = kmp_sqrt(g, kmp_sub(g, KMP_ONE, square)), drag = kmp_tree_expression(tree, film->drag);
    load->against[2] = spin;
    load->size[2] = kmp_div(g, kmp_mul(g, drag, spin), root);
}
