/* SPDX-License-Identifier: BSD-3-Clause */
/* Requested outputs as expressions: positions, energies, momenta about points, coordinates of cut joints, and values of
 * forces. Momenta are sums over rigid parts in ground axes. Outputs of wings come from their rows. */
#include "dynamics/outputs.h"
#include "base/context.h"
#include "base/text.h"
#include "base/wings.h"
#include "dynamics/closures.h"
#include "dynamics/equations.h"
#include "dynamics/formalisms/newton_euler.h"
#include "dynamics/joint_loads.h"
#include "dynamics/kinematics/bearing_forces.h"
#include "dynamics/kinematics/cam_contact.h"
#include "dynamics/kinematics/deformation.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/kinematics/rope_path.h"
#include "dynamics/kinematics/touching.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/data/output.h"
#include "model/data/output_table.h"
#include "model/data/run_settings.h"
#include "model/language/expression.h"
#include "model/write/model_print.h"
#include <kempe/kempe.h>
#include <stdbool.h>

bool kmp_outputs_need_forces(const kempe_model *model)
{
    for (int o = 0; o < model->output_count; o++)
        if (model->outputs[o].kind == KMP_OUTPUT_FORCE || model->outputs[o].kind == KMP_OUTPUT_OUTLINE_FORCE ||
            model->outputs[o].kind == KMP_OUTPUT_ENERGY)
            return true;
    return false;
}

/* The kinetic energy, the potential, and their sum. */
static kmp_vec energies(kmp_equations *eq, const kmp_forces *forces)
{
    kmp_graph *g = eq->graph;
    kmp_ref kinetic = kmp_kinetic_energy(&eq->tree);
    return (kmp_vec){{kinetic, forces->potential, kmp_add(g, kinetic, forces->potential)}};
}

/* -- momenta, in ground axes --------------------------------------------------------------------------- */

/* A rigid part in motion: its mass, and in ground axes its centre, its momentum, and its angular momentum about its
 * centre, I w. */
typedef struct part {
    kmp_ref mass;
    kmp_vec centre, momentum, spin;
} part;

/* The parts of a body or of all links: the next one from *at on; false: there are no more. */
static bool next_part(const kmp_tree *tree, int body, int *at, part *p)
{
    int link = body < 0 ? *at + 1 : tree->mounts[body].link;
    if (link >= tree->count - tree->model->state_count || (body >= 0 && *at > 0))
        return false;
    *at = body < 0 ? link : 1; /* a body has one part, on link 0 where it is fixed */
    const kmp_link *l = &tree->links[link];
    const kmp_inertia of = body < 0 ? (kmp_inertia){l->mass, l->com, l->inertia} : kmp_body_inertia(tree, body);
    kmp_graph *g = tree->graph;
    *p = (part){.mass = of.mass, .centre = kmp_link_position(tree, link, of.com, 0)};
    kmp_vec w = kmp_from_ancestor(tree, link, 0, kmp_link_spin(tree, link, 0));
    p->momentum = kmp_vec_scale(g, of.mass, kmp_vec_rate(tree, p->centre));
    kmp_vec spin = kmp_tensor_apply(g, of.about_com, w);
    if (l->deformation)
        spin = kmp_vec_add(g, spin, kmp_deformation_spin(g, l->deformation));
    p->spin = kmp_link_direction(tree, link, spin, 0);
    return true;
}

/* sum m v of a body, of all bodies for -1. */
static kmp_vec momentum(const kmp_tree *tree, int body)
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

/* sum x × m v + I w of a body, of all bodies for -1, with x from a point of the model, or for -1 from their common
 * centre of mass; velocities are relative to the ground in both cases. */
static kmp_vec angular_momentum(const kmp_tree *tree, int body, int point)
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

/* -- outputs ------------------------------------------------------------------------------------------- */

/* A coordinate of a cut joint, its rate or its acceleration. */
static kmp_vec cut_coordinate(const kmp_tree *tree, const kmp_output *output)
{
    kmp_vec x = kmp_vec_axis(kmp_tree_expression(tree, tree->model->cut_coordinates[output->index].value), 0);
    if (output->kind != KMP_OUTPUT_CUT_Q)
        x = kmp_vec_rate(tree, x);
    return output->kind == KMP_OUTPUT_CUT_QDD ? kmp_vec_acceleration(tree, x) : x;
}

/* From the place of a point without deformation, in the axes of its flexible body. */
static kmp_vec deflection(const kmp_tree *tree, int point)
{
    const kmp_point *p = &tree->model->points[point];
    kmp_vec place = kmp_point_position(tree, point, tree->mounts[p->body].link);
    place = kmp_body_vector_back(tree, p->body, place);
    return kmp_vec_sub(tree->graph, place, kmp_tree_vector(tree, p->at));
}

/* Of the pairs of a contact with outlines. */
static kmp_ref least_gap(const kmp_tree *tree, const kmp_outline_contact *outlined)
{
    kmp_ref least = KMP_ZERO;
    for (int k = 0; k < outlined->count; k++) {
        const kmp_force *force = &tree->model->forces[outlined->first + k * outlined->step];
        const kmp_ref gap = kmp_touching_gap(tree, &force->touch);
        least = k == 0 ? gap : kmp_binary(tree->graph, KMP_OP_MIN, least, gap);
    }
    return least;
}

/* The contact of a follower with its cam, by the kind of an output; its body moves along its own coordinate. */
static kmp_ref cam_value(const kmp_tree *tree, const kmp_output *output)
{
    const kempe_model *model = tree->model;
    const bool touches = output->kind == KMP_OUTPUT_TOUCH_PRESSURE_ANGLE || output->kind == KMP_OUTPUT_TOUCH_CURVATURE;
    const kmp_closure *closure = touches ? NULL : &model->closures[output->index];
    const kmp_touch_side *side = touches ? model->forces[output->index].touch.side : NULL;
    const int point[2] = {touches ? side[1].point : closure->point[0], touches ? side[0].point : closure->point[1]};
    double face[3] = {0};
    kmp_cam_contact contact;
    if (touches)
        face[side[0].axis] = side[0].against ? -1 : 1;
    kmp_cam_contact_find(tree, touches ? side[1].cam : closure->cam, point, touches ? face : closure->axis[1],
                         &contact);
    if (output->kind == KMP_OUTPUT_CURVATURE || output->kind == KMP_OUTPUT_TOUCH_CURVATURE)
        return contact.curvature;
    return kmp_cam_pressure_angle(tree, &contact, point[1], model->bodies[model->points[point[1]].body].first_motion);
}

static kmp_vec derive_one(kmp_equations *eq, const kmp_forces *forces, const kmp_output *output)
{
    switch (output->kind) {
    case KMP_OUTPUT_POSITION:
        return kmp_point_measure(&eq->tree, KMP_MEASURE_POSITION, output->index, -1);
    case KMP_OUTPUT_VELOCITY:
        return kmp_point_measure(&eq->tree, KMP_MEASURE_VELOCITY, output->index, -1);
    case KMP_OUTPUT_ACCELERATION:
        return kmp_point_measure(&eq->tree, KMP_MEASURE_ACCELERATION, output->index, -1);
    case KMP_OUTPUT_ANGULAR_VELOCITY:
        return kmp_point_measure(&eq->tree, KMP_MEASURE_ANGULAR_VELOCITY, output->index, -1);
    case KMP_OUTPUT_DEFLECTION:
        return deflection(&eq->tree, output->index);
    case KMP_OUTPUT_STRESS:
        return kmp_vec_axis(kmp_section_stress(&eq->tree, output->index), 0);
    case KMP_OUTPUT_STRAINED:
        return kmp_section_strained(&eq->tree, output->index);
    case KMP_OUTPUT_REACTION:
    case KMP_OUTPUT_MOMENT:
        return kmp_closure_load(&eq->tree, output->index, output->kind == KMP_OUTPUT_MOMENT);
    case KMP_OUTPUT_JOINT_REACTION:
    case KMP_OUTPUT_JOINT_MOMENT:
        return kmp_joint_load(&eq->tree, output->index + 1, output->kind == KMP_OUTPUT_JOINT_MOMENT);
    case KMP_OUTPUT_ENERGY:
        return energies(eq, forces);
    case KMP_OUTPUT_MOMENTUM:
        return momentum(&eq->tree, output->index);
    case KMP_OUTPUT_ANGULAR_MOMENTUM:
        return angular_momentum(&eq->tree, output->index, output->about - 1);
    case KMP_OUTPUT_GAP:
        return kmp_vec_axis(kmp_touching_gap(&eq->tree, &eq->model->forces[output->index].touch), 0);
    case KMP_OUTPUT_OUTLINE_GAP:
        return kmp_vec_axis(least_gap(&eq->tree, &eq->model->outline_contacts[output->index]), 0);
    case KMP_OUTPUT_CAM_FORCE:
        return kmp_vec_axis(kmp_tree_multiplier(&eq->tree, output->index, 0), 0);
    case KMP_OUTPUT_PRESSURE_ANGLE:
    case KMP_OUTPUT_CURVATURE:
    case KMP_OUTPUT_TOUCH_PRESSURE_ANGLE:
    case KMP_OUTPUT_TOUCH_CURVATURE:
        return kmp_vec_axis(cam_value(&eq->tree, output), 0);
    case KMP_OUTPUT_TENSION:
        return kmp_vec_axis(kmp_rope_tension(&eq->tree, &eq->model->ropes[output->index]), 0);
    case KMP_OUTPUT_ROPE_LENGTH:
        return kmp_vec_axis(kmp_rope_length(&eq->tree, &eq->model->ropes[output->index]), 0);
    case KMP_OUTPUT_WRAP:
        return kmp_vec_axis(kmp_rope_wrap(&eq->tree, &eq->model->ropes[output->index], output->about - 1), 0);
    case KMP_OUTPUT_CUT_Q:
    case KMP_OUTPUT_CUT_QD:
    case KMP_OUTPUT_CUT_QDD:
        return cut_coordinate(&eq->tree, output);
    case KMP_OUTPUT_SENSOR:
        return kmp_vec_axis(kmp_tree_expression(&eq->tree, eq->model->sensors[output->index].expr), 0);
    default:
        return kmp_vec_zero();
    }
}

/* Negative where the comparison is true. */
static kmp_ref compared(const kmp_tree *tree, const kmp_expr *e)
{
    kmp_ref a = kmp_tree_expression(tree, e->a), b = kmp_tree_expression(tree, e->b);
    bool less = e->kind == KMP_EXPR_LESS || e->kind == KMP_EXPR_AT_MOST;
    return less ? kmp_sub(tree->graph, a, b) : kmp_sub(tree->graph, b, a);
}

/* Derives the user's end conditions of runs. */
static bool derive_until(const kmp_tree *tree)
{
    const kmp_run_settings *run = &tree->model->run;
    bool ok = true;
    for (int k = 0; ok && k < run->until_count; k++) {
        kmp_text text = {0};
        kmp_model_put_expr(&text, tree->model, run->until[k]);
        ok = !text.failed;
        if (ok)
            kmp_tree_end(tree, run->until[k], 0, compared(tree, run->until[k]), NULL, "the run ends as requested: %s",
                         text.s);
        kmp_text_free(&text);
    }
    return ok;
}

static void show_axes(kmp_equations *eq, int point)
{
    kmp_vec axes[3];
    kmp_point_axes(&eq->tree, point, 0, axes);
    for (int k = 0; k < 9; k++)
        eq->outputs.shown[eq->outputs.shown_count++] = axes[k / 3].x[k % 3];
}

static void show_section(kmp_equations *eq, int point)
{
    const kmp_wrench load = kmp_section_load(&eq->tree, point);
    for (int k = 0; k < 3; k++) {
        eq->outputs.shown[eq->outputs.shown_count + k] = load.force.x[k];
        eq->outputs.shown[eq->outputs.shown_count + 3 + k] = load.moment.x[k];
    }
    eq->outputs.shown_count += 6;
}

static kmp_ref sum_of_forces(const kmp_equations *eq, const kmp_forces *forces, const kmp_outline_contact *outlined)
{
    kmp_ref sum = KMP_ZERO;
    for (int k = 0; k < outlined->count; k++)
        sum =
            kmp_add(eq->graph, sum, forces->value[(ptrdiff_t)KMP_FORCE_WIDTH * (outlined->first + k * outlined->step)]);
    return sum;
}

static void derive_output(kmp_equations *eq, const kmp_forces *forces, const kmp_output *output)
{
    kmp_vec x;
    switch (output->kind) {
    case KMP_OUTPUT_AXES:
        show_axes(eq, output->index);
        return;
    case KMP_OUTPUT_SECTION:
        show_section(eq, output->index);
        return;
    case KMP_OUTPUT_BEARING:
        kmp_bearing_reactions(&eq->tree, &eq->model->bearings[output->index],
                              eq->outputs.shown + eq->outputs.shown_count);
        eq->outputs.shown_count += KMP_BEARING_VALUES;
        return;
    case KMP_OUTPUT_FORCE:
        for (int k = 0; k < kmp_output_width(eq->model, output); k++)
            eq->outputs.shown[eq->outputs.shown_count++] =
                forces->value[(ptrdiff_t)KMP_FORCE_WIDTH * output->index + k];
        return;
    case KMP_OUTPUT_OUTLINE_FORCE:
        x = kmp_vec_axis(sum_of_forces(eq, forces, &eq->model->outline_contacts[output->index]), 0);
        break;
    default:
        x = derive_one(eq, forces, output);
    }
    for (int k = 0; k < 3 && k < kmp_output_width(eq->model, output); k++)
        eq->outputs.shown[eq->outputs.shown_count++] = x.x[k];
    for (int k = 0; output->kind == KMP_OUTPUT_POSITION && k < 3; k++)
        eq->outputs.position[3 * eq->outputs.position_count + k] = x.x[k];
    eq->outputs.position_count += output->kind == KMP_OUTPUT_POSITION;
}

static bool show_by_wing(kmp_equations *eq, const kmp_output *output)
{
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        for (const kmp_output_of_wing *row = (*wing)->outputs; row && row->show; row++)
            if (row->kind == output->kind) {
                row->show(eq, output);
                return true;
            }
    return false;
}

/* Conditions only of outputs are not events: they are evaluated at the state of each row. */
kempe_status kmp_outputs_derive(kmp_equations *eq, const kmp_forces *forces)
{
    bool settled = eq->tree.conditions.settled;
    KMP_TRY(kmp_joint_loads_begin(eq, false));
    KMP_TRY(kmp_made(eq->context, settled || derive_until(&eq->tree)));
    for (int k = 0; !settled && k < eq->model->flexible_count; k++)
        kmp_flexible_watch(&eq->tree, &eq->model->flexibles[k]);
    eq->tree.conditions.settled = true;
    eq->tree.uses = &eq->outputs.uses;
    /* In the order of the model. */
    for (int o = 0; !kmp_graph_failed(eq->graph) && o < eq->model->output_count; o++)
        if (!show_by_wing(eq, &eq->model->outputs[o]))
            derive_output(eq, forces, &eq->model->outputs[o]);
    eq->tree.uses = NULL;
    eq->tree.conditions.settled = settled;
    kmp_joint_loads_end(eq);
    return kmp_made(eq->context, !kmp_graph_failed(eq->graph));
}
