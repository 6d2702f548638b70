/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/shorten/patterns.h"
#include <stddef.h>

/* -- axes that stay ---------------------------------------------------------------------------------- */

static bool is_parallel(const kmp_tree *tree, int i)
{
    const kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    return link->parent > 0 && link->rotation && parent->rotation && link->axis == parent->axis && !link->turned;
}

/* Non-rotating axes for joints that follow one about the same axis. */
static void following(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i))
            savings->stay[i - 1] = true;
}

/* Non-rotating axes for whole runs: such joints and the ones that they follow. */
static void runs(const kmp_tree *tree, kmp_savings *savings)
{
    following(tree, savings);
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i))
            savings->stay[tree->links[i].parent - 1] = true;
}

static bool carries(const kmp_tree *tree, int i)
{
    for (int k = i + 1; k < tree->count; k++)
        if (tree->links[k].parent == i)
            return true;
    return false;
}

/* Joints that carry no other joint, and are carried by one. */
static void leaves(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        if (tree->links[i].rotation && tree->links[i].parent > 0 && !carries(tree, i))
            savings->stay[i - 1] = true;
}

/* -- reference points of moments --------------------------------------------------------------------- */

/* Bodies whose joint has no acceleration but that of gravity. */
static void on_the_ground(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        if (tree->links[i].rotation && tree->links[i].parent == 0)
            savings->about[i - 1] = true;
}

static void all_about(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        savings->about[i - 1] = tree->links[i].mass != KMP_ZERO;
}

/* Rotations apart, where there is a sum of angles to replace. */
static void rotations_apart(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i)) {
            *savings->apart = !*savings->apart;
            return;
        }
}

/* Masses on the axes, and inertia: what a composite body can always pass on. */
enum { MASS_AND_INERTIA = KMP_GIVE_MASS | KMP_GIVE_INERTIA };

#define ORIGINS offsetof(kmp_savings, origin)
#define GIVE    offsetof(kmp_savings, give)
#define LUMP    offsetof(kmp_savings, lump)

static const kmp_cost_pattern patterns[] = {
    /* The usual best choice: base parameters, and for the wrenches the gifts that join a mass. */
    {KMP_PATTERN_EVER, .set = {{ORIGINS, KMP_ORIGIN_PARENT, KMP_ORIGIN_PARENT},
                               {LUMP, MASS_AND_INERTIA, MASS_AND_INERTIA},
                               {GIVE, KMP_GIVE_ALL, 0}}},
    {KMP_PATTERN_EVER, .apply = leaves},
    {KMP_PATTERN_SMALL, .apply = following},
    {KMP_PATTERN_SMALL, .apply = runs},
    /* Masses are given through massless links, too, to the next link that has a mass. */
    {KMP_PATTERN_EVER, .set = {{GIVE, KMP_GIVE_ALL, KMP_GIVE_MASS}}},
    /* Wrenches about centres of mass, which suits forces that act there. */
    {KMP_PATTERN_EVER, .instead = true,
     .set = {{ORIGINS, KMP_ORIGIN_PARENT, KMP_ORIGIN_PARENT},
             {LUMP, MASS_AND_INERTIA, MASS_AND_INERTIA},
             {GIVE, KMP_GIVE_INERTIA, KMP_GIVE_INERTIA}}},
    {KMP_PATTERN_EVER, .apply = on_the_ground},
    {KMP_PATTERN_EVER, .apply = rotations_apart},
    {KMP_PATTERN_SMALL, .set = {{ORIGINS, KMP_ORIGIN_MASS, KMP_ORIGIN_MASS}}},
    {KMP_PATTERN_SMALL, .apply = all_about},
    {KMP_PATTERN_OPTIMIZE, .set = {{ORIGINS, KMP_ORIGIN_CHILD, KMP_ORIGIN_CHILD}}},
    {KMP_PATTERN_OPTIMIZE, .set = {{LUMP, KMP_GIVE_ALL, KMP_GIVE_ALL}}},
    {KMP_PATTERN_OPTIMIZE, .set = {{LUMP, 0, 0}}},
    {KMP_PATTERN_OPTIMIZE, .set = {{GIVE, 0, 0}}},
    {KMP_PATTERN_OPTIMIZE, .set = {{ORIGINS, KMP_ORIGIN_PARENT, KMP_ORIGIN_PARENT}}},
};

const kmp_cost_pattern *kmp_patterns(int *count)
{
    *count = sizeof patterns / sizeof *patterns;
    return patterns;
}

void kmp_pattern_apply(const kmp_cost_pattern *pattern, const kmp_tree *tree, kmp_savings *savings)
{
    if (pattern->apply)
        pattern->apply(tree, savings);
    for (const kmp_pattern_set *set = pattern->set; set->member; set++)
        for (int i = 1; i < tree->count; i++) {
            uint8_t *member = *(uint8_t **)((char *)savings + set->member);
            bool joins = tree->links[tree->links[i].parent].mass != KMP_ZERO;
            member[i - 1] = joins ? set->to_masses : set->to_others;
        }
}
