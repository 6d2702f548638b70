/* SPDX-License-Identifier: BSD-3-Clause */
/* The program of places that a start aims at. All places are coordinates of points or lengths of joints, so that one
 * list of expressions and its derivatives by q serves goals, clearances and cut joints. */
#include "dynamics/goal_equations.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "model/data/model.h"
#include "symbolic/derivative.h"
#include <string.h>

int kmp_goals_place_count(const kempe_model *model)
{
    int count = 0;
    for (int k = 0; k < model->start.goal_count; k++)
        count += model->start.goals[k].point >= 0 ? 3 : 0;
    return count;
}

int kmp_goals_centred_of(const kmp_force *force)
{
    int count = 0;
    while (count < 3 && force->centred[count])
        count++;
    return count;
}

int kmp_goals_centred_count(const kempe_model *model)
{
    int count = 0;
    for (int k = 0; k < model->force_count; k++)
        count += kmp_goals_centred_of(&model->forces[k]);
    return count;
}

static void cut_coordinates(const kmp_equations *eq, kmp_ref *x)
{
    for (int k = 0; k < eq->model->cut_coordinate_count; k++)
        x[k] = kmp_tree_expression(&eq->tree, eq->model->cut_coordinates[k].value);
}

bool kmp_goals_program(kmp_equations *eq, kmp_program **program)
{
    int count = kmp_goals_place_count(eq->model), loose = kmp_goals_centred_count(eq->model);
    bool given = false;
    for (int k = 0; k < eq->model->cut_coordinate_count; k++)
        given = given || eq->model->cut_coordinates[k].q_given || eq->model->cut_coordinates[k].qd_given;
    int cut = given ? eq->model->cut_coordinate_count : 0, own = count * (1 + eq->n), both = own + loose * (1 + eq->n);
    int counts[2] = {both + cut * (1 + eq->n), count};
    if (count + loose + cut == 0)
        return true;
    kmp_ref *place = KMP_GRAPH_NEW(eq->graph, kmp_ref, counts[0]),
            *curvature = KMP_GRAPH_NEW(eq->graph, kmp_ref, count);
    if (!place || !curvature)
        return false;
    /* Places of the points of goals. */
    const kmp_start *start = &eq->model->start;
    for (int k = 0, at = 0; k < start->goal_count; k++) {
        if (start->goals[k].point < 0)
            continue;
        kmp_vec x = kmp_point_position(&eq->tree, start->goals[k].point, 0);
        for (int i = 0; i < 3; i++)
            place[at++] = x.x[i];
    }
    /* Lengths that forces centre. */
    kmp_ref *length = place + own;
    for (int k = 0, at = 0; k < eq->model->force_count; k++)
        for (int i = 0; i < kmp_goals_centred_of(&eq->model->forces[k]); i++)
            length[at++] = kmp_tree_expression(&eq->tree, eq->model->forces[k].centred[i]);
    kmp_partials_all(eq->graph, count, place, KMP_IN_Q, eq->n, place + count);
    kmp_partials_all(eq->graph, loose, place + own, KMP_IN_Q, eq->n, place + own + loose);
    if (cut > 0)
        cut_coordinates(eq, place + both);
    kmp_partials_all(eq->graph, cut, place + both, KMP_IN_Q, eq->n, place + both + cut);
    /* The second derivative along qd at constant qd. */
    memcpy(curvature, place, (size_t)count * sizeof *curvature);
    for (int order = 0; order < 2; order++) {
        kmp_derivative *d = kmp_time_derivative(&eq->tree);
        for (int i = 0; i < count; i++)
            curvature[i] = kmp_derivative_of(d, curvature[i]);
        kmp_derivative_free(d);
    }
    const kmp_ref *groups[2] = {place, curvature};
    *program = kmp_graph_failed(eq->graph) ? NULL : kmp_program_new(eq->graph, 2, counts, groups);
    return *program;
}
