/* SPDX-License-Identifier: BSD-3-Clause */
/* The expression is derived as tyres have it, with a number in place of x each time; the graph gives the value. */
#include "picture/road_heights.h"
#include "base/arena.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/parameter.h"
#include "model/read/loads.h"
#include <math.h>
#include <string.h>

/* Values of expressions at t = 0; the other inputs are unknown, but the parameters are numbers of the graph. */
static bool value_of(const kempe_model *model, const kmp_graph *g, int count, const kmp_ref *of, double *value)
{
    kmp_arena room = {0};
    double *all = NULL, *times = NULL;
    bool good = KMP_ARENA_MAKE(&room, KMP_ROOM(double, kmp_graph_count(g), &all),
                               KMP_ROOM(double, 1 + KMP_TIME_NUMBERS * kmp_model_all_inputs(model), &times));
    if (good) {
        const double *inputs[KMP_IN_COUNT] = {[KMP_IN_TIME] = times};
        kmp_model_times(model, 0, times);
        kmp_graph_eval(g, inputs, all);
    }
    for (int k = 0; good && k < count; k++) {
        value[k] = kmp_is_negative(of[k]) ? -all[kmp_id(of[k])] : all[kmp_id(of[k])];
        good = isfinite(value[k]);
    }
    kmp_arena_free(&room);
    return good;
}

bool kmp_road_heights(const kempe_model *model, const kmp_road *road, int count, const double *x, double *height)
{
    kmp_graph *g = kmp_graph_new();
    kmp_tree tree;
    kmp_arena room = {0};
    kmp_ref *of = KMP_ARENA_NEW(&room, kmp_ref, count + 1);
    bool good = false;
    memset(&tree, 0, sizeof tree);
    if (g && of && kmp_tree_init(&tree, g, model, KMP_KEEP_NOTHING, false)) {
        unsigned depends = 0;
        for (int k = 0; k < count; k++) {
            kmp_ref place[3] = {kmp_const(g, x[k]), KMP_ZERO, KMP_ZERO};
            kmp_tree within = tree;
            within.place = place;
            of[k] = kmp_tree_expression(&within, road->height);
            depends |= kmp_graph_node(g, kmp_id(of[k]))->depends;
        }
        good = !kmp_graph_failed(g) && !(depends & ~(1u << KMP_IN_TIME)) && value_of(model, g, count, of, height);
    }
    if (g) {
        kmp_tree_free(&tree);
        kmp_graph_free(g);
    }
    kmp_arena_free(&room);
    return good;
}
