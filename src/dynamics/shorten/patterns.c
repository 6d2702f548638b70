/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/shorten/patterns.h"

/* -- axes that stay ---------------------------------------------------------------------------------- */

static bool is_parallel(const kmp_tree *tree, int i)
{
    const kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    return link->parent > 0 && link->rotation && parent->rotation && link->axis == parent->axis && !link->turned;
}

/* Non-rotating axes for joints that follow one about the same axis. */
static void following(const kmp_tree *tree, kmp_ways *ways)
{
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i))
            ways->stay[i - 1] = true;
}

/* Non-rotating axes for whole runs: such joints and the ones that they follow. */
static void runs(const kmp_tree *tree, kmp_ways *ways)
{
    following(tree, ways);
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i))
            ways->stay[tree->links[i].parent - 1] = true;
}

static bool carries(const kmp_tree *tree, int i)
{
    for (int k = i + 1; k < tree->count; k++)
        if (tree->links[k].parent == i)
            return true;
    return false;
}

/* Joints that carry no other joint, and are carried by one. */
static void leaves(const kmp_tree *tree, kmp_ways *ways)
{
    for (int i = 1; i < tree->count; i++)
        if (tree->links[i].rotation && tree->links[i].parent > 0 && !carries(tree, i))
            ways->stay[i - 1] = true;
}

/* -- reference points of moments --------------------------------------------------------------------- */

/* Bodies whose joint has no acceleration but that of gravity. */
static void on_the_ground(const kmp_tree *tree, kmp_ways *ways)
{
    for (int i = 1; i < tree->count; i++)
        if (tree->links[i].rotation && tree->links[i].parent == 0)
            ways->about[i - 1] = true;
}

static void all_about(const kmp_tree *tree, kmp_ways *ways)
{
    for (int i = 1; i < tree->count; i++)
        ways->about[i - 1] = tree->links[i].mass != KMP_ZERO;
}

/* -- origins ----------------------------------------------------------------------------------------- */

static void set_origins(const kmp_tree *tree, kmp_ways *ways, kmp_origin origin)
{
    for (int i = 1; i < tree->count; i++)
        ways->origin[i - 1] = (uint8_t)origin;
}

static void origins_at_parents(const kmp_tree *tree, kmp_ways *ways)
{
    set_origins(tree, ways, KMP_ORIGIN_PARENT);
}

static void origins_at_masses(const kmp_tree *tree, kmp_ways *ways)
{
    set_origins(tree, ways, KMP_ORIGIN_MASS);
}

static void origins_at_children(const kmp_tree *tree, kmp_ways *ways)
{
    set_origins(tree, ways, KMP_ORIGIN_CHILD);
}

/* -- regrouping -------------------------------------------------------------------------------------- */

/* Sets the gifts of links whose parent has a mass, and of others. */
static void give(const kmp_tree *tree, uint8_t *give, uint8_t to_masses, uint8_t to_others)
{
    for (int i = 1; i < tree->count; i++)
        give[i - 1] = tree->links[tree->links[i].parent].mass != KMP_ZERO ? to_masses : to_others;
}

/* The usual best choice: composite bodies in base parameters, and for the wrenches the gifts that join a mass. */
static void base_parameters(const kmp_tree *tree, kmp_ways *ways)
{
    origins_at_parents(tree, ways);
    give(tree, ways->lump, KMP_GIVE_MASS | KMP_GIVE_INERTIA, KMP_GIVE_MASS | KMP_GIVE_INERTIA);
    give(tree, ways->give, KMP_GIVE_ALL, 0);
}

/* Wrenches about centres of mass, which suits forces that act there. */
static void inertias_alone(const kmp_tree *tree, kmp_ways *ways)
{
    base_parameters(tree, ways);
    give(tree, ways->give, KMP_GIVE_INERTIA, KMP_GIVE_INERTIA);
}

/* Masses are given through massless links, too, to the next link that has a mass. */
static void masses_through(const kmp_tree *tree, kmp_ways *ways)
{
    give(tree, ways->give, KMP_GIVE_ALL, KMP_GIVE_MASS);
}

static void all_lumped(const kmp_tree *tree, kmp_ways *ways)
{
    give(tree, ways->lump, KMP_GIVE_ALL, KMP_GIVE_ALL);
}

static void nothing_lumped(const kmp_tree *tree, kmp_ways *ways)
{
    give(tree, ways->lump, 0, 0);
}

static void nothing_given(const kmp_tree *tree, kmp_ways *ways)
{
    give(tree, ways->give, 0, 0);
}

/* Rotations apart, where there is a sum of angles to replace. */
static void rotations_apart(const kmp_tree *tree, kmp_ways *ways)
{
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i)) {
            *ways->apart = !*ways->apart;
            return;
        }
}

static void spread_out(const kmp_tree *tree, kmp_ways *ways)
{
    (void)tree;
    *ways->spread = !*ways->spread;
}

static const kmp_cost_pattern patterns[] = {
    {base_parameters, KMP_PATTERN_EVER},    {leaves, KMP_PATTERN_EVER},
    {following, KMP_PATTERN_SMALL},         {runs, KMP_PATTERN_SMALL},
    {masses_through, KMP_PATTERN_EVER},     {inertias_alone, KMP_PATTERN_EVER},
    {on_the_ground, KMP_PATTERN_EVER},      {rotations_apart, KMP_PATTERN_EVER},
    {origins_at_masses, KMP_PATTERN_SMALL}, {spread_out, KMP_PATTERN_SMALL},
    {all_about, KMP_PATTERN_SMALL},         {origins_at_children, KMP_PATTERN_OPTIMIZE},
    {all_lumped, KMP_PATTERN_OPTIMIZE},     {nothing_lumped, KMP_PATTERN_OPTIMIZE},
    {nothing_given, KMP_PATTERN_OPTIMIZE},  {origins_at_parents, KMP_PATTERN_OPTIMIZE},
};

const kmp_cost_pattern *kmp_patterns(int *count)
{
    *count = sizeof patterns / sizeof *patterns;
    return patterns;
}
