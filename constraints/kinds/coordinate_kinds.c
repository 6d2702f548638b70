/* SPDX-License-Identifier: BSD-3-Clause */
/* Closures of coordinates: h is an expression of coordinates and time, lambda the generalized force. */
#include "constraints/kinds/kind.h"
#include "dynamics/kinematics/gear_mesh.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/start.h"
#include <math.h>

/* An expression stays zero. */
static void constraint(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    h[0] = kmp_tree_bent(tree, closure->function);
}

const kmp_part kmp_part_constraint = {1, KMP_KIND_POWER_GIVEN, constraint, kmp_part_effort, NULL};

/* A sum of coordinates times factors keeps its value (gears, rack and pinion, a differential). lambda times a factor is
 * the generalized force on its coordinate. */
static void coupler(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    const kmp_number *start = kmp_model_start(tree->model)->q;
    h[0] = closure->constant ? kmp_neg(kmp_tree_number(tree, closure->constant)) : KMP_ZERO;
    for (int k = 0; k < closure->term_count; k++) {
        const kmp_term *term = &closure->terms[k];
        kmp_ref q = kmp_input(g, KMP_IN_Q, (uint32_t)term->motion);
        if (!closure->constant)
            q = kmp_sub(g, q, kmp_tree_number(tree, &start[term->motion]));
        h[0] = kmp_add(g, h[0], kmp_mul(g, kmp_tree_number(tree, &term->factor), q));
    }
}

const kmp_part kmp_part_coupler = {1, KMP_KIND_POWER_OF_COORDINATE, coupler, kmp_part_effort, NULL};

/* The pitch points of two gear wheels have the same path: h = s r2 phi2 - r1 phi1, less its value at the start. lambda
 * is the force along the path on the second wheel. */
static void gear(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    h[0] = kmp_neg(kmp_gear_error(tree, closure));
}

/* On the second wheel, in the axes of the ground. */
static kmp_vec force_of_teeth(const kmp_tree *tree, const kmp_closure *closure, const kmp_ref *lambda)
{
    kmp_vec force, place;
    kmp_gear_force(tree, closure, lambda[0], 0, &force, &place);
    return force;
}

const kmp_part kmp_part_gear = {1, 1, gear, force_of_teeth, NULL};

/* A coordinate is a given function of time: h = q - f(t). */
static void drive(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    h[0] = kmp_sub(g, kmp_input(g, KMP_IN_Q, (uint32_t)closure->motion), kmp_tree_bent(tree, closure->function));
}

const kmp_part kmp_part_drive = {1, KMP_KIND_POWER_OF_COORDINATE, drive, kmp_part_effort, NULL};

/* A coordinate keeps its start value. */
static void lock(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    kmp_ref start = kmp_tree_number(tree, &kmp_model_start(tree->model)->q[closure->motion]);
    h[0] = kmp_sub(g, kmp_input(g, KMP_IN_Q, (uint32_t)closure->motion), start);
}

const kmp_part kmp_part_lock = {1, KMP_KIND_POWER_OF_COORDINATE, lock, kmp_part_effort, NULL};

/* The slide and the rotation of a screw joint are coupled: h = slide - pitch turn/(2 pi). */
static void screw(const kmp_tree *tree, const kmp_closure *closure, kmp_ref *h)
{
    kmp_graph *g = tree->graph;
    uint32_t slide = (uint32_t)closure->motion;
    kmp_ref rate = kmp_mul(g, kmp_const(g, 1 / (8 * atan(1))), kmp_tree_number(tree, &closure->number));
    h[0] = kmp_sub(g, kmp_input(g, KMP_IN_Q, slide), kmp_mul(g, rate, kmp_input(g, KMP_IN_Q, slide + 1)));
}

const kmp_part kmp_part_screw = {1, KMP_KIND_POWER_OF_COORDINATE, screw, kmp_part_effort, NULL};
