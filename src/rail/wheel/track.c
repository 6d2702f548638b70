/* SPDX-License-Identifier: BSD-3-Clause */
/* On a straight track a place is a projection. On a curved track its arc length s is that of the least horizontal
 * distance to the middle line r: (p - r(s)) . r'(s) = 0. */
#include "rail/wheel/track.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "symbolic/function_table.h"
#include "symbolic/graph.h"
#include "symbolic/implicit.h"
#include "symbolic/table_function.h"
#include <string.h>

/* The track's own point and axes. */
typedef struct ground {
    kmp_vec begin, axis[3];
} ground;

/* -- curved ---------------------------------------------------------------------------------------- */

enum { PLANE = 2 };

/* The block of a track that the graph has already; -1: none. The graph itself would find an equal block, but building
 * one takes some milliseconds, for each wheel. */
static int find_block(const kmp_graph *g, const kmp_track *track)
{
    const kmp_implicit *implicit;
    size_t size = (size_t)track->candidate_count * sizeof(double);
    for (int k = 0; (implicit = kmp_graph_implicit(g, k)); k++) {
        const kmp_program_block *block = kmp_implicit_block(implicit);
        if (block->candidates == track->candidate_count && memcmp(block->candidate, track->candidate, size) == 0 &&
            block->program->table_count == PLANE && kmp_table_equal(block->program->table[0], track->x) &&
            kmp_table_equal(block->program->table[1], track->y))
            return k;
    }
    return -1;
}

/* The arc length for a point in the plane. */
static int add_block(kmp_graph *g, const kmp_track *track)
{
    kmp_graph *local = kmp_graph_new();
    if (!local)
        return kmp_graph_add_implicit(g, NULL);
    kmp_table *line[PLANE] = {track->x, track->y};
    kmp_ref s = kmp_input(local, KMP_IN_Q, 0), residual = KMP_ZERO, merit = KMP_ZERO, guess = KMP_ZERO;
    for (unsigned k = 0; k < PLANE; k++) {
        int table = kmp_graph_add_table(local, line[k]);
        kmp_ref off = kmp_sub(local, kmp_input(local, KMP_IN_PARAMETER, k), kmp_table_at(local, table, s));
        residual = kmp_add(local, residual, kmp_mul(local, off, kmp_table_derivative_at(local, table, 1, s)));
        merit = kmp_add(local, merit, kmp_mul(local, off, off));
    }
    kmp_implicit *block =
        kmp_implicit_new_among(local, 1, PLANE, &residual, &guess, track->candidate_count, track->candidate, merit);
    return kmp_graph_add_implicit(g, block);
}

/* Turned about the track's direction: the left rail goes up. */
static void cant(const kmp_tree *tree, const kmp_track *track, kmp_track_place *place)
{
    kmp_graph *g = tree->graph;
    kmp_ref angle = kmp_table_at(g, kmp_graph_add_table(g, track->cant), place->along);
    kmp_ref c = kmp_cos(g, angle), s = kmp_sin(g, angle);
    kmp_vec left = place->axis[1], up = place->axis[2];
    place->axis[1] = kmp_vec_add(g, kmp_vec_scale(g, c, left), kmp_vec_scale(g, s, up));
    place->axis[2] = kmp_vec_sub(g, kmp_vec_scale(g, c, up), kmp_vec_scale(g, s, left));
}

static void curved(const kmp_tree *tree, const kmp_track *track, const ground *at, kmp_vec point,
                   kmp_track_place *place)
{
    kmp_graph *g = tree->graph;
    kmp_vec off = kmp_vec_sub(g, point, at->begin);
    kmp_ref plane[PLANE] = {kmp_vec_dot(g, off, at->axis[0]), kmp_vec_dot(g, off, at->axis[1])};
    int block = find_block(g, track);
    if (block < 0)
        block = add_block(g, track);
    place->along = KMP_ZERO;
    kmp_implicit_at(g, block, plane, &place->along);
    /* The cross-section at place->along. */
    int x = kmp_graph_add_table(g, track->x), y = kmp_graph_add_table(g, track->y);
    kmp_ref dx = kmp_table_derivative_at(g, x, 1, place->along), dy = kmp_table_derivative_at(g, y, 1, place->along);
    kmp_ref length = kmp_sqrt(g, kmp_add(g, kmp_mul(g, dx, dx), kmp_mul(g, dy, dy)));
    kmp_ref c = kmp_div(g, dx, length), s = kmp_div(g, dy, length);
    kmp_vec ahead = kmp_vec_scale(g, kmp_table_at(g, x, place->along), at->axis[0]),
            aside = kmp_vec_scale(g, kmp_table_at(g, y, place->along), at->axis[1]);
    place->origin = kmp_vec_add(g, at->begin, kmp_vec_add(g, ahead, aside));
    place->axis[0] = kmp_vec_add(g, kmp_vec_scale(g, c, at->axis[0]), kmp_vec_scale(g, s, at->axis[1]));
    place->axis[1] = kmp_vec_sub(g, kmp_vec_scale(g, c, at->axis[1]), kmp_vec_scale(g, s, at->axis[0]));
    place->axis[2] = at->axis[2];
    if (track->cant)
        cant(tree, track, place);
}

/* -- irregularities -------------------------------------------------------------------------------- */

static kmp_ref irregularity(const kmp_tree *tree, const kmp_track *track, kmp_irregularity kind, kmp_ref along)
{
    const kmp_irregularities *all = &track->irregularities;
    kmp_table *table = all->named[kind] ? all->named[kind]->table : all->made[kind];
    return table ? kmp_table_at(tree->graph, kmp_graph_add_table(tree->graph, table), along) : KMP_ZERO;
}

/* -- the track ------------------------------------------------------------------------------------- */

void kmp_track_at(const kmp_tree *tree, const kmp_track *track, kmp_vec point, kmp_track_place *place)
{
    kmp_graph *g = tree->graph;
    ground at = {.begin = kmp_point_position(tree, track->point, 0)};
    kmp_point_axes(tree, track->point, 0, at.axis);
    if (track->curved) {
        curved(tree, track, &at, point, place);
    } else {
        memcpy(place->axis, at.axis, sizeof at.axis);
        place->along = kmp_vec_dot(g, kmp_vec_sub(g, point, at.begin), at.axis[0]);
        place->origin = kmp_vec_add(g, at.begin, kmp_vec_scale(g, place->along, at.axis[0]));
    }
    /* Irregularities move the rails. */
    kmp_ref moved[KMP_IRREGULARITIES], half = kmp_const(g, 0.5);
    for (int k = 0; k < KMP_IRREGULARITIES; k++)
        moved[k] = irregularity(tree, track, (kmp_irregularity)k, place->along);
    kmp_ref wider = kmp_mul(g, half, moved[KMP_IRREGULARITY_GAUGE]),
            apart = kmp_mul(g, half, moved[KMP_IRREGULARITY_CROSS]);
    for (int side = 0; side < KMP_TRACK_SIDES; side++) {
        bool left = side == KMP_TRACK_LEFT;
        kmp_ref aside = moved[KMP_IRREGULARITY_ALIGNMENT];
        place->outwards[side] = kmp_add(g, wider, left ? aside : kmp_neg(aside));
        place->upwards[side] = kmp_add(g, moved[KMP_IRREGULARITY_LEVEL], left ? apart : kmp_neg(apart));
    }
}
