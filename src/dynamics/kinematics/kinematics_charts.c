/* SPDX-License-Identifier: BSD-3-Clause */
/* Positions of the charts of spherical joints in the chain of links. */
#include "dynamics/kinematics/kinematics_charts.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/data/spherical.h"

/* True if a body moves with b: b itself, or welded to one that does. */
static bool moves_with(const kempe_model *model, int body, int b)
{
    while (body != b && body > 0 && model->bodies[body].motion_count == 0)
        body = model->bodies[body].parent;
    return body == b;
}

/* True if no rotation is between the ground and motion k. */
static bool is_upright(const kempe_model *model, int k)
{
    for (int b = model->motions[k].body; b > 0; b = model->bodies[b].parent)
        for (int i = model->bodies[b].first_motion; i < model->bodies[b].first_motion + model->bodies[b].motion_count;
             i++)
            if (i < k && model->motions[i].rotation)
                return false;
    return true;
}

/* The number of points that move with body b and whose positions closures and forces use. */
static int requested_points(const kempe_model *model, int b)
{
    int count = 0;
    for (int k = 0; k < 2; k++) {
        for (int c = 0; c < model->closure_count; c++) {
            int point = model->closures[c].point[k];
            count += point >= 0 && moves_with(model, model->points[point].body, b);
        }
        for (int f = 0; f < model->force_count; f++) {
            const kmp_force *force = &model->forces[f];
            bool requests = kmp_force_is_line(force->kind) || force->kind == KMP_FORCE_BUSHING ||
                            (force->kind == KMP_FORCE_POINT && k == 0);
            count += requests && moves_with(model, model->points[force->point[k]].body, b);
        }
    }
    return count;
}

bool kmp_tree_chart_before(const kempe_model *model, int first)
{
    enum { POINT = 80, TURNING_BASE = 150, OWN_DATA = 90, CARRIED = 70 }; /* operations added, about, as counted */
    int b = model->motions[first].body;
    if (first + 3 < model->bodies[b].first_motion + model->bodies[b].motion_count)
        return true; /* motions follow them */
    int before = POINT * requested_points(model, b) + (is_upright(model, first) ? 0 : TURNING_BASE);
    int count = 0;
    for (int c = b + 1; c < model->body_count; c++)
        count += model->bodies[c].motion_count > 0 && moves_with(model, model->bodies[c].parent, b);
    return before <= OWN_DATA + CARRIED * count;
}

bool kmp_tree_place_charts(kmp_tree *tree)
{
    int *first = KMP_ARENA_NEW(&tree->arena, int, tree->count), count = 0;
    if (first && tree->charted)
        count = kmp_spherical_find(tree->model, first);
    for (int i = 0; i < tree->count; i++)
        tree->links[i].before = tree->links[i].after = -1;
    for (int c = 0; c < count; c++)
        if (kmp_tree_chart_before(tree->model, first[c]))
            tree->links[first[c] + 1].before = c;
        else
            tree->links[first[c] + 3].after = c;
    return first && count >= 0;
}
