/* SPDX-License-Identifier: BSD-3-Clause */
#include "dynamics/goal_equations.h"
#include "base/memory.h"
#include "dynamics/forces.h"
#include "symbolic/derivative.h"

int kmp_goals_place_count(const kempe_model *model)
{
    int count = 0;
    for (int k = 0; k < model->start.goal_count; k++)
        count += model->start.goals[k].point >= 0 ? 3 : 0;
    return count;
}

static void places(const kmp_equations *eq, kmp_ref *place)
{
    const kmp_start *start = &eq->model->start;
    for (int k = 0, at = 0; k < start->goal_count; k++) {
        if (start->goals[k].point < 0)
            continue;
        kmp_vec x = kmp_point_position(&eq->tree, start->goals[k].point, 0);
        for (int i = 0; i < 3; i++)
            place[at++] = x.x[i];
    }
}

/* Derivatives along each coordinate, for one value after the other. */
static bool slopes(const kmp_equations *eq, int count, const kmp_ref *place, kmp_ref *slope)
{
    static const kmp_ref one = KMP_ONE;
    for (int k = 0; k < eq->n; k++) {
        kmp_ref leaf = kmp_input(eq->graph, KMP_IN_Q, (uint32_t)k);
        kmp_derivative *d = kmp_derivative_new(eq->graph, 1, &leaf, &one);
        for (int i = 0; d && i < count; i++)
            slope[i * eq->n + k] = kmp_derivative_of(d, place[i]);
        kmp_derivative_free(d);
        if (!d)
            return false;
    }
    return true;
}

/* The second derivative along qd at constant qd. */
static bool bends(const kmp_equations *eq, int count, const kmp_ref *place, kmp_ref *bend)
{
    for (int i = 0; i < count; i++)
        bend[i] = place[i];
    for (int order = 0; order < 2; order++) {
        kmp_derivative *d = kmp_time_derivative(&eq->tree);
        for (int i = 0; d && i < count; i++)
            bend[i] = kmp_derivative_of(d, bend[i]);
        kmp_derivative_free(d);
        if (!d)
            return false;
    }
    return true;
}

bool kmp_goals_program(kmp_equations *eq, kmp_program **program)
{
    int count = kmp_goals_place_count(eq->model), counts[2] = {count * (1 + eq->n), count};
    if (count == 0)
        return true;
    kmp_ref *place = KMP_NEW(kmp_ref, counts[0]), *bend = KMP_NEW(kmp_ref, count);
    bool ok = place && bend;
    if (ok) {
        places(eq, place);
        ok = slopes(eq, count, place, place + count) && bends(eq, count, place, bend);
    }
    if (ok) {
        const kmp_ref *groups[2] = {place, bend};
        *program = kmp_program_new(eq->graph, 2, counts, groups);
    }
    kmp_free(place);
    kmp_free(bend);
    return ok && *program;
}
