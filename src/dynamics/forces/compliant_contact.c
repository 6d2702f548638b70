/* SPDX-License-Identifier: BSD-3-Clause */
/* Compliant contact. The normal force N works against the depth d, the friction T against the slip v. By virtual power
 * they give coordinate k the generalized force
 *
 *     -N d d'/d qd_k - sum_i T_i d v_i/d qd_k,     T = mu N v / sqrt(v.v + s^2), or N mu(v) by an expression of the
 * slip
 *
 * A law of the table has an elastic energy as its potential; what else it takes is work.
 *
 * The film between a journal and its bearing. Over the clearance c the journal is at (x, y) in the bearing and turns
 * there with the angular velocity w. Reynolds' equation depends only on
 *
 *     u = x' + w y/2,     v = y' - w x/2
 *
 * because a film that rotates with half the speed of its journal presses nowhere. If it would be thinner than
 * its least thickness, (x, y) is the place of the least thickness in the same direction. Its shear is Petroff's, 2 pi
 * viscosity R^3 L w/(c sqrt(1 - x^2 - y^2)), of DuBois and Ocvirk, NACA Report 1157, 1953. */
#include "dynamics/forces/forces.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/body.h"
#include "model/data/force.h"
#include "model/language/expression.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include <string.h>

enum { WORKS = 4, FILM = 3 }; /* rate of depth, slips */
_Static_assert(WORKS + FILM == KMP_COMPLIANT_FORCES, "room of callers");

/* The forces along the slip. */
static void find_friction(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *at, kmp_ref normal,
                          kmp_ref *friction)
{
    kmp_graph *g = tree->graph;
    const kmp_expr *speed = force->compliant->speed;
    kmp_ref square = KMP_ZERO, factor = normal;
    for (int i = 0; i < at->slips; i++)
        square = kmp_add(g, square, kmp_mul(g, at->slip[i], at->slip[i]));
    if (speed) {
        kmp_ref s = kmp_tree_expression(tree, speed), root = kmp_sqrt(g, kmp_add(g, square, kmp_mul(g, s, s)));
        factor = kmp_div(g, kmp_mul(g, normal, kmp_bearing_load_coefficient(tree, force, at->slip[0])), root);
    }
    for (int i = 0; i < at->slips; i++)
        friction[i] = kmp_mul(g, factor, speed ? at->slip[i] : kmp_bearing_load_coefficient(tree, force, at->slip[i]));
}

/* -- the film of a journal ----------------------------------------------------------------------------- */

/* Rates, and the forces against them: on the journal's centre along the bearing's axes, and the torque of shear. */
typedef struct film_load {
    kmp_ref against[3], size[3];
} film_load;

/* The film's place at its least thickness, and the condition that it is there. */
static void limit_film(const kmp_tree *tree, const kmp_force *force, kmp_ref place[2])
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

static void film_find(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *at, film_load *load)
{
    kmp_graph *g = tree->graph;
    const kmp_film *film = force->compliant->film;
    kmp_ref c = kmp_tree_expression(tree, force->compliant->clearance), half = kmp_const(g, 0.5);
    kmp_ref spin = kmp_tree_expression(tree, force->vector[2]), turned = kmp_mul(g, half, spin);
    kmp_ref place[2] = {kmp_div(g, at->x, c), kmp_div(g, at->y, c)}, values[KMP_LOCAL_END] = {KMP_ZERO};
    kmp_vec rate = kmp_vec_rate(tree, (kmp_vec){{at->x, at->y, KMP_ZERO}});
    limit_film(tree, force, place);
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

/* -- all forces ----------------------------------------------------------------------------------------- */

/* The generalized forces of `count` forces against rates, zero where the bodies do not touch. */
static void apply(kmp_forces *forces, const kmp_tree *tree, kmp_ref holds, int count, const kmp_ref *against,
                  const kmp_ref *size)
{
    kmp_graph *g = tree->graph;
    int n = kmp_model_motion_count(tree->model);
    kmp_ref *slope = KMP_GRAPH_NEW(g, kmp_ref, count * n);
    if (slope)
        kmp_partials_all(g, count, against, KMP_IN_QD, n, slope);
    for (int k = 0; slope && k < n; k++) {
        kmp_ref sum = KMP_ZERO;
        for (int i = 0; i < count; i++)
            sum = kmp_add(g, sum, kmp_mul(g, size[i], slope[i * n + k]));
        if (sum != KMP_ZERO)
            kmp_apply_effort(forces, tree, k, kmp_select(g, holds, kmp_neg(sum), KMP_ZERO));
    }
}

static void add_energy(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *at,
                       int count, const kmp_ref *against, const kmp_ref *size, unsigned energy)
{
    kmp_graph *g = tree->graph;
    const kmp_expr *store = force->compliant->store;
    kmp_ref holds = kmp_bearing_load_holds(tree, force, at), lost = KMP_ZERO;
    /* A depth that a function of t changes takes work from outside. */
    kmp_derivative *by_time = kmp_partial_time_derivative(tree);
    const kmp_ref driven = kmp_derivative_of(by_time, at->depth);
    kmp_derivative_free(by_time);
    for (int i = 0; i < count; i++)
        lost = kmp_add(g, lost, kmp_mul(g, size[i], i == 0 ? kmp_sub(g, against[i], driven) : against[i]));
    if (store) {
        kmp_ref stored = kmp_bearing_load_law(tree, force, at, store);
        kmp_derivative *d = kmp_time_derivative(tree);
        kmp_ref rate = kmp_derivative_of(d, stored);
        kmp_derivative_free(d);
        lost = kmp_sub(g, lost, rate);
        if (energy & KMP_ENERGY_POTENTIAL)
            forces->potential = kmp_add(g, forces->potential, kmp_select(g, holds, stored, KMP_ZERO));
    }
    if (energy & KMP_ENERGY_POWER)
        forces->power = kmp_sub(g, forces->power, kmp_select(g, holds, lost, KMP_ZERO));
}

static void show(const kmp_tree *tree, const kmp_bearing_load *at, kmp_ref holds, const kmp_ref *size,
                 const film_load *film, kmp_ref *value)
{
    kmp_graph *g = tree->graph;
    const kmp_ref shown[] = {at->depth, at->rate, at->slip[0]};
    value[0] = size[0];
    value[1] = kmp_select(g, holds, size[1], KMP_ZERO);
    for (int k = 0; k < 3; k++)
        value[2 + k] = kmp_select(g, holds, shown[k], KMP_ZERO);
    value[5] = at->x;
    value[6] = at->y;
    value[7] = at->eccentricity;
    value[8] = at->z;
    for (int k = 0; film && k < 2; k++)
        value[8 + k] = kmp_neg(film->size[k]);
}

/* Runs end where the journal's centre is farther from the centre of the bearing than ten clearances and half a radius.
 */
static void end_outside(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *at)
{
    kmp_graph *g = tree->graph;
    const struct kmp_compliant *made = force->compliant;
    if (made->form != KMP_COMPLIANT_JOURNAL)
        return;
    kmp_ref most = kmp_mul(g, kmp_const(g, 10), kmp_tree_expression(tree, made->clearance));
    if (made->radius)
        most = kmp_add(g, most, kmp_mul(g, kmp_const(g, 0.5), kmp_tree_expression(tree, made->radius)));
    kmp_ref square =
        kmp_add(g, kmp_add(g, kmp_mul(g, at->x, at->x), kmp_mul(g, at->y, at->y)), kmp_mul(g, at->z, at->z));
    kmp_tree_end(tree, force, KMP_PRESSING_OUT, kmp_sub(g, kmp_mul(g, most, most), square),
                 "give start values that place it there, or a stiffer contact",
                 "the journal of '%s' is not in its bearing", force->name);
}

int kmp_compliant_forces(const kmp_tree *tree, const kmp_force *force, kmp_ref *against, kmp_ref *size)
{
    kmp_graph *g = tree->graph;
    kmp_bearing_load at;
    film_load film;
    kmp_bearing_load_find(tree, force, &at);
    const kmp_ref holds = kmp_bearing_load_holds(tree, force, &at);
    int count = force->holding_effort ? 1 + at.slips : 1;
    against[0] = at.rate;
    memcpy(against + 1, at.slip, (size_t)at.slips * sizeof *against);
    size[0] = kmp_bearing_load_normal(tree, force, &at);
    if (count > 1)
        find_friction(tree, force, &at, size[0], size + 1);
    for (int k = 0; k < count; k++)
        size[k] = kmp_select(g, holds, size[k], KMP_ZERO);
    if (!force->compliant->film)
        return count;
    film_find(tree, force, &at, &film);
    memcpy(against + count, film.against, sizeof film.against);
    memcpy(size + count, film.size, sizeof film.size);
    return count + FILM;
}

void kmp_law_compliant(kmp_forces *forces, const kmp_tree *tree, const kmp_force *force, unsigned energy,
                       kmp_ref *value)
{
    kmp_bearing_load at;
    film_load film;
    kmp_bearing_load_find(tree, force, &at);
    kmp_ref holds = kmp_bearing_load_holds(tree, force, &at);
    kmp_ref against[WORKS] = {at.rate, at.slip[0], at.slip[1], at.slip[2]};
    kmp_ref size[WORKS] = {kmp_bearing_load_normal(tree, force, &at), KMP_ZERO, KMP_ZERO, KMP_ZERO};
    int count = force->holding_effort ? 1 + at.slips : 1;
    if (count > 1)
        find_friction(tree, force, &at, size[0], size + 1);
    apply(forces, tree, holds, count, against, size);
    if (force->compliant->film) {
        film_find(tree, force, &at, &film);
        apply(forces, tree, KMP_ONE, FILM, film.against, film.size);
        if (energy & KMP_ENERGY_POWER) {
            /* The power of forces that always act. */
            kmp_graph *g = tree->graph;
            for (int i = 0; i < FILM; i++)
                forces->power = kmp_sub(g, forces->power, kmp_mul(g, film.size[i], film.against[i]));
        }
    }
    show(tree, &at, holds, size, force->compliant->film ? &film : NULL, value);
    end_outside(tree, force, &at);
    /* Beyond 4/e^2 clearances Johnson's force would fall with the depth. */
    kmp_graph *g = tree->graph;
    if (force->compliant->limited) {
        kmp_ref most = kmp_mul(g, kmp_const(g, 0.95 * 0.54134113294645081),
                               kmp_tree_expression(tree, force->compliant->clearance));
        kmp_tree_end(tree, force, KMP_PRESSING_DEEP, kmp_select(g, holds, kmp_sub(g, most, at.depth), KMP_ONE),
                     "beyond it the force of this law would fall with the depth",
                     "the depth of '%s' reaches 0.51 clearances, the limit of the law johnson", force->name);
    }
    if (energy)
        add_energy(forces, tree, force, &at, count, against, size, energy);
}
