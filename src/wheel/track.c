/* SPDX-License-Identifier: BSD-3-Clause */
#include "wheel/track.h"
#include "symbolic/table.h"

/* Nothing but the ground's own point and axes: its cross-section is where the point is along x. */
static void straight(const kmp_tree *tree, const kmp_track *track, kmp_vec point, kmp_track_place *place)
{
    kmp_graph *g = tree->graph;
    kmp_vec begin = kmp_point_position(tree, track->point, 0);
    kmp_point_axes(tree, track->point, 0, place->axis);
    place->along = kmp_vec_dot(g, kmp_vec_sub(g, point, begin), place->axis[0]);
    place->origin = kmp_vec_add(g, begin, kmp_vec_scale(g, place->along, place->axis[0]));
    for (int side = 0; side < KMP_TRACK_SIDES; side++)
        place->outwards[side] = place->upwards[side] = KMP_ZERO;
}

bool kmp_track_at(const kmp_tree *tree, const kmp_track *track, kmp_vec point, kmp_track_place *place)
{
    straight(tree, track, point, place);
    return !kmp_graph_failed(tree->graph);
}

int kmp_track_rail_table(const kmp_tree *tree, const kmp_track *track)
{
    return kmp_graph_add_table(tree->graph, track->rail);
}
