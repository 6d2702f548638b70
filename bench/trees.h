/* SPDX-License-Identifier: BSD-3-Clause */
/* The trees that Fisette and Samin 1996 compare formalisms on (section 2.3, Fig. 4): N bodies by joints alternately
 * revolute and prismatic, one behind the other, or each with two children. The paper tells neither axes nor data: here
 * the axes of each branch turn, R z, P x, R x, P y, R y, P z and so on (with axes that do not, the linear tree stays in
 * a plane), every body has a full inertia, and points and centres of mass have three components. */
#ifndef KEMPE_BENCH_TREES_H
#define KEMPE_BENCH_TREES_H

#include "base/text.h"

typedef enum tree_shape { TREE_LINEAR, TREE_BINARY, TREE_SHAPES } tree_shape;

static const char *const tree_names[TREE_SHAPES] = {"linear", "binary"};

/* Parent of body b = 1, 2, .. ; 0: the ground. */
static inline int tree_parent(tree_shape shape, int b)
{
    return shape == TREE_LINEAR ? b - 1 : b / 2;
}

/* Bodies between b and the ground. */
static inline int tree_depth(tree_shape shape, int b)
{
    int depth = 0;
    for (int h = tree_parent(shape, b); h > 0; h = tree_parent(shape, h))
        depth++;
    return depth;
}

/* The model, to be freed with kmp_free. No two bodies are alike, no branch is long enough to fold up. */
static inline char *tree_text(tree_shape shape, int n)
{
    static const char *const joints[] = {"revolute: z",  "prismatic: x", "revolute: x",
                                         "prismatic: y", "revolute: y",  "prismatic: z"};
    kmp_text t = {0};
    kmp_text_printf(&t, "kempe: 1\nname: %s_%d\ngravity: [0.3, -0.2, -9.81]\nbodies:\n", tree_names[shape], n);
    for (int b = 1; b <= n; b++) {
        double x = 0.01 * (b % 11), y = 0.01 * (b % 7), z = 0.01 * (b % 5);
        int h = tree_parent(shape, b);
        kmp_text_printf(&t, "  b%d: {joint: {name: q%d, %s, at: ", b, b, joints[tree_depth(shape, b) % 6]);
        kmp_text_printf(&t, h ? "b%d.P%d" : "ground", h, b);
        kmp_text_printf(&t, "}, mass: %.17g, com: [%.17g, %.17g, %.17g],\n", 1 + x + y, 0.1 + x, 0.2 - y, 0.15 + z);
        kmp_text_printf(&t, "    inertia: {xx: %.17g, yy: %.17g, zz: %.17g, xy: %.17g, xz: %.17g, yz: %.17g},\n",
                        0.5 + x, 0.6 + y, 0.7 + z, 0.02 + x / 3, 0.03 - y / 3, 0.04 + z / 3);
        kmp_text_put(&t, "    points: {");
        for (int k = 0; k < 2; k++) {
            int child = shape == TREE_LINEAR ? b + 1 : 2 * b + k;
            if (child <= n && (shape == TREE_BINARY || k == 0))
                kmp_text_printf(&t, "%sP%d: [%.17g, %.17g, %.17g]", k ? ", " : "", child, (k ? -0.3 : 0.3) + x, 0.1 + y,
                                0.2 - z);
        }
        kmp_text_put(&t, "}}\n");
    }
    return kmp_text_take(&t);
}

#endif
