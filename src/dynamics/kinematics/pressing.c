/* SPDX-License-Identifier: BSD-3-Clause */
/* Compliant contacts: depth, its rate and the slip of two surfaces, or of a journal in its bearing; then the normal
 * force by the law of the contact, zero apart. */
#include "dynamics/kinematics/pressing.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/model.h"
#include "symbolic/function_table.h"
#include <math.h>
#include <string.h>

/* Over lengths. */
#define KMP_CONTACT_LAG 1e-15

/* The slip of two sides. */
static void find_sides(const kmp_tree *tree, const kmp_force *force, kmp_bearing_load *pressing)
{
    const kmp_contact_pair *touch = &force->touch;
    kmp_touching sides;
    if (!force->holding_effort || touch->side[0].point < 0)
        return;
    kmp_touching_find(tree, touch, true, &sides);
    memcpy(pressing->slip, sides.across.x, sizeof pressing->slip);
    pressing->slips = 3;
}

/* A journal with its centre at (x, y), of a ball (x, y, z), in a bearing of radius R with the radial clearance c: e =
 * |(x, y)|, depth e - c, rate (x x' + y y')/e. Its surface slips with (x y' - y x')/e + (R - c) w along the bearing,
 * which is the velocity of the journal's point of contact. The bodies touch where c^2 - e^2 < 0, which is smooth at the
 * centre, too. */
static void find_journal(const kmp_tree *tree, const kmp_force *force, kmp_bearing_load *pressing)
{
    kmp_graph *g = tree->graph;
    const struct kmp_compliant *made = force->compliant;
    kmp_ref x = kmp_tree_expression(tree, force->vector[0]), y = kmp_tree_expression(tree, force->vector[1]);
    kmp_ref z = made->ball ? kmp_tree_expression(tree, force->vector[2]) : KMP_ZERO;
    kmp_vec rate = kmp_vec_rate(tree, (kmp_vec){{x, y, z}});
    kmp_ref c = kmp_tree_expression(tree, made->clearance), xd = rate.x[0], yd = rate.x[1];
    kmp_ref square = kmp_add(g, kmp_add(g, kmp_mul(g, x, x), kmp_mul(g, y, y)), kmp_mul(g, z, z));
    kmp_ref e = kmp_sqrt(g, square), twice = kmp_add(g, c, c);
    pressing->x = x;
    pressing->y = y;
    pressing->z = z;
    pressing->eccentricity = e;
    pressing->open = kmp_div(g, kmp_sub(g, kmp_mul(g, c, c), square), twice);
    pressing->depth = kmp_sub(g, e, c);
    kmp_ref moving = kmp_add(g, kmp_mul(g, x, xd), kmp_mul(g, y, yd));
    pressing->rate = kmp_div(g, kmp_add(g, moving, kmp_mul(g, z, rate.x[2])), e);
    if (made->ball)
        find_sides(tree, force, pressing);
    if (!made->radius || made->ball)
        return;
    kmp_ref turning = kmp_div(g, kmp_sub(g, kmp_mul(g, x, yd), kmp_mul(g, y, xd)), e);
    kmp_ref arm = kmp_sub(g, kmp_tree_expression(tree, made->radius), c);
    pressing->slip[0] = kmp_add(g, turning, kmp_mul(g, arm, kmp_tree_expression(tree, force->vector[2])));
    pressing->slips = 1;
}

void kmp_bearing_load_find(const kmp_tree *tree, const kmp_force *force, kmp_bearing_load *pressing)
{
    *pressing = (kmp_bearing_load){
        .x = KMP_ZERO, .y = KMP_ZERO, .z = KMP_ZERO, .eccentricity = KMP_ZERO, .slip = {KMP_ZERO, KMP_ZERO, KMP_ZERO}};
    if (force->compliant->form == KMP_COMPLIANT_JOURNAL)
        find_journal(tree, force, pressing);
    else {
        pressing->open = kmp_touching_gap(tree, &force->touch);
        pressing->depth = kmp_neg(pressing->open);
        pressing->rate = kmp_neg(kmp_touching_rate(tree, &force->touch));
        /* The expressions of the user, or the slip of two sides. */
        while (pressing->slips < 3 && force->vector[pressing->slips]) {
            pressing->slip[pressing->slips] = kmp_tree_expression(tree, force->vector[pressing->slips]);
            pressing->slips++;
        }
        find_sides(tree, force, pressing);
    }
}

kmp_ref kmp_bearing_load_holds(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing)
{
    double reach = 1;
    for (int k = 0; k < tree->model->point_count; k++)
        for (int i = 0; i < 3; i++)
            reach = fmax(reach, fabs(tree->model->points[k].at[i].value));
    kmp_ref holds = kmp_tree_condition(tree, force, KMP_PRESSING, pressing->open, KMP_CONTACT_LAG * reach, NULL,
                                       "contact of '%s'", force->name);
    int k = tree->events ? kmp_events_find(tree->events, force, KMP_PRESSING) : -1;
    if (k >= 0)
        tree->events->condition[k].measured = true;
    return holds;
}

/* Beyond the end of contact, within a step that is cut there, the law sees the modulus of the depth: powers of it stay
 * defined. */
kmp_ref kmp_bearing_load_law(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing,
                             const kmp_expr *law)
{
    kmp_graph *g = tree->graph;
    const kempe_model *model = tree->model;
    const int state = force->compliant->state;
    kmp_ref place[KMP_LOCAL_END] = {KMP_ZERO, KMP_ZERO, KMP_ZERO};
    kmp_tree within = *tree;
    place[KMP_LOCAL_DEPTH] = kmp_unary(g, KMP_OP_ABS, pressing->depth);
    place[KMP_LOCAL_RATE] = pressing->rate;
    place[KMP_LOCAL_IMPACT] =
        state < 0 ? KMP_ZERO : kmp_input(g, KMP_IN_QD, (uint32_t)(kmp_model_coordinates(model) + state));
    place[KMP_LOCAL_SLIP] = pressing->slip[0];
    within.place = place;
    return kmp_tree_expression(&within, law);
}

kmp_ref kmp_bearing_load_coefficient(const kmp_tree *tree, const kmp_force *force, kmp_ref slip)
{
    kmp_ref place[KMP_LOCAL_END] = {[KMP_LOCAL_SLIP] = slip};
    kmp_tree within = *tree;
    within.place = place;
    return kmp_tree_expression(&within, force->holding_effort);
}

kmp_ref kmp_bearing_load_normal(const kmp_tree *tree, const kmp_force *force, const kmp_bearing_load *pressing)
{
    kmp_graph *g = tree->graph;
    kmp_ref holds = kmp_bearing_load_holds(tree, force, pressing);
    kmp_ref law = kmp_bearing_load_law(tree, force, pressing, force->effort);
    kmp_ref pulls = kmp_tree_condition(tree, force, KMP_PRESSING_PULLS, kmp_select(g, holds, law, KMP_ONE), 0, NULL,
                                       "contact of '%s' without force", force->name);
    return kmp_select(g, holds, kmp_select(g, pulls, KMP_ZERO, law), KMP_ZERO);
}

kmp_ref kmp_bearing_load_measure(const kmp_tree *tree, kmp_measure_kind kind, const char *contact)
{
    const kempe_model *model = tree->model;
    kmp_bearing_load pressing;
    int k = kmp_name_find(KMP_NAMED(model, force), contact);
    if (k < 0)
        return KMP_ZERO;
    kmp_bearing_load_find(tree, &model->forces[k], &pressing);
    return kind == KMP_MEASURE_DEPTH      ? pressing.depth
           : kind == KMP_MEASURE_APPROACH ? pressing.rate
                                          : kmp_bearing_load_normal(tree, &model->forces[k], &pressing);
}
