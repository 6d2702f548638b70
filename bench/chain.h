/* SPDX-License-Identifier: BSD-3-Clause */
/* Chains of N windows (IFToMM A02): N + 1 uprights on the ground, each with a bar that a loop ties to the next. */
#ifndef KEMPE_BENCH_CHAIN_H
#define KEMPE_BENCH_CHAIN_H

#include "base/text.h"
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

/* All but the start. Unequal: each window a little wider and the bars of different masses, so that nothing is alike. */
static inline void chain_put(kmp_text *t, const char *name, int n, bool unequal)
{
    kmp_text_printf(t, "kempe: 1\nname: %s\ngravity: [0, -9.81, 0]\nground: {points: {", name);
    for (int i = 0; i <= n; i++)
        kmp_text_printf(t, "%sG%d: [%.17g, 0, 0]", i ? ", " : "", i, unequal ? i * (1 + 0.001 * i) : i);
    kmp_text_put(t, "}}\nbodies:\n");
    for (int i = 0; i <= 2 * n; i++) {
        bool upright = i <= n;
        int k = upright ? i : i - n - 1;
        double l = upright || !unequal ? 1 : (k + 1) * (1 + 0.001 * (k + 1)) - k * (1 + 0.001 * k);
        kmp_text_printf(t, "  %c%d: {joint: {name: %c%d, revolute: z, at: ", upright ? 'v' : 'h', k,
                        upright ? 'a' : 'b', k);
        kmp_text_printf(t, upright ? "ground.G%d" : "v%d.T", k);
        kmp_text_printf(t, "}, mass: %.17g, com: [%.17g, 0, 0], inertia: {zz: %.17g}, points: {T: [%.17g, 0, 0]}}\n",
                        unequal ? 1 + 0.01 * (i % 7) : 1, l / 2, l * l / 12, l);
    }
    kmp_text_put(t, "loops:\n");
    for (int i = 0; i < n; i++)
        kmp_text_printf(t, "  C%d: {ball: [h%d.T, v%d.T]}\n", i, i, i + 1);
}

/* The model upright, at 1 rad/s, to be freed with kmp_free. Apart: the guesses of the start are off by up to so many
 * degrees, alternately, and nothing moves. */
static inline char *chain_text(int n, bool unequal, double apart)
{
    kmp_text t = {0};
    chain_put(&t, "chain", n, unequal);
    kmp_text_put(&t, "start:\n  q: {");
    for (int i = 0; i <= 2 * n; i++)
        kmp_text_printf(&t, "%s%c%d: %.17g deg", i ? ", " : "", i <= n ? 'a' : 'b', i <= n ? i : i - n - 1,
                        (i <= n ? 90 : -90) + apart * (i % 7 - 3) / 3);
    if (apart > 0) {
        kmp_text_put(&t, "}\n");
        return kmp_text_take(&t);
    }
    kmp_text_put(&t, "}\n  qd: {");
    for (int i = 0; i <= 2 * n; i++)
        kmp_text_printf(&t, "%s%c%d: %d", i ? ", " : "", i <= n ? 'a' : 'b', i <= n ? i : i - n - 1, i <= n ? -1 : 1);
    kmp_text_put(&t, "}\n");
    return kmp_text_take(&t);
}

/* The lengths of upright i and of the next one, and of the bar between their ends. */
static inline double chain_length(int i)
{
    return 1 + 0.05 * (7 * i % 5);
}

static inline double chain_bar(int i)
{
    return hypot(1, chain_length(i + 1) - chain_length(i));
}

/* The start of uprights of those lengths that hang and swing at 1 rad/s. */
static inline void chain_put_hanging_start(kmp_text *t, int n)
{
    kmp_text_put(t, "start: {q: {");
    for (int k = 0; k <= 2 * n; k++) {
        bool upright = k <= n;
        int i = upright ? k : k - n - 1;
        kmp_text_printf(t, "%s%c%d: %.17g", k ? ", " : "", upright ? 'a' : 'b', i,
                        upright ? -acos(0) : acos(0) + atan2(chain_length(i) - chain_length(i + 1), 1));
    }
    kmp_text_put(t, "}, qd: {a0: -1}}\n");
}

/* The ground of windows hinged in space about a tilted axis, and the beginning of body k up to its joint. */
static inline void chain_put_ground_in_space(kmp_text *t, const char *name, int n)
{
    kmp_text_printf(t, "kempe: 1\nname: %s\ngravity: [2*9.81/3, -9.81/3, -2*9.81/3]\nground: {points: {", name);
    for (int i = 0; i <= n; i++)
        kmp_text_printf(t, "%sG%d: [%d/3, %d/3, %d/3]", i ? ", " : "", i, 2 * i, 2 * i, i);
    kmp_text_put(t, "}}\nbodies:\n");
}

static inline void chain_put_joint_in_space(kmp_text *t, bool upright, int i)
{
    kmp_text_printf(t, "  %c%d: {joint: {name: %c%d, revolute: [1, -2, 2], at: ", upright ? 'v' : 'h', i,
                    upright ? 'a' : 'b', i);
    kmp_text_printf(t, upright ? "ground.G%d" : "v%d.T", i);
}

static inline void chain_put_loops_in_space(kmp_text *t, int n)
{
    kmp_text_put(t, "loops:\n");
    for (int i = 0; i < n; i++)
        kmp_text_printf(t, "  C%d: {revolute: [h%d.T, v%d.T], axis: [1, -2, 2]}\n", i, i, i + 1);
}

/* Uprights of different lengths that hang and swing at 1 rad/s: no window is a parallelogram, none comes to lie flat.
 * To be freed with kmp_free. */
static inline char *chain_hanging(int n)
{
    kmp_text t = {0};
    kmp_text_put(&t, "kempe: 1\nname: hanging\ngravity: [0, -9.81, 0]\nground: {points: {");
    for (int i = 0; i <= n; i++)
        kmp_text_printf(&t, "%sG%d: [%d, 0, 0]", i ? ", " : "", i, i);
    kmp_text_put(&t, "}}\nbodies:\n");
    for (int k = 0; k <= 2 * n; k++) {
        bool upright = k <= n;
        int i = upright ? k : k - n - 1;
        kmp_text_printf(&t, "  %c%d: {joint: {name: %c%d, revolute: z, at: ", upright ? 'v' : 'h', i,
                        upright ? 'a' : 'b', i);
        kmp_text_printf(&t, upright ? "ground.G%d" : "v%d.T", i);
        kmp_text_printf(&t, "}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}, points: {T: [%.17g, 0, 0]}}\n",
                        upright ? chain_length(i) : chain_bar(i));
    }
    kmp_text_put(&t, "loops:\n");
    for (int i = 0; i < n; i++)
        kmp_text_printf(&t, "  C%d: {ball: [h%d.T, v%d.T]}\n", i, i, i + 1);
    chain_put_hanging_start(&t, n);
    return kmp_text_take(&t);
}

/* Windows that hang, hinged in space about a tilted axis: five rows a loop, two of them independent. To be freed with
 * kmp_free. */
static inline char *chain_hanging_in_space(int n)
{
    kmp_text t = {0};
    chain_put_ground_in_space(&t, "hanging in space", n);
    for (int k = 0; k <= 2 * n; k++) {
        bool upright = k <= n;
        int i = upright ? k : k - n - 1;
        double bar = upright ? chain_length(i) : chain_bar(i);
        chain_put_joint_in_space(&t, upright, i);
        kmp_text_put(&t, "}, mass: 1, com: [1/3, 1/3, 1/6], inertia: {xx: 0.1, yy: 0.1, zz: 0.1}, ");
        kmp_text_printf(&t, "points: {T: [2*%.17g/3, 2*%.17g/3, %.17g/3]}}\n", bar, bar, bar);
    }
    chain_put_loops_in_space(&t, n);
    chain_put_hanging_start(&t, n);
    return kmp_text_take(&t);
}

/* Windows hinged in space about a tilted axis: five rows a loop, two of them independent. To be freed with kmp_free. */
static inline char *chain_in_space(int n)
{
    kmp_text t = {0};
    chain_put_ground_in_space(&t, "in space", n);
    for (int k = 0; k <= 2 * n; k++) {
        bool upright = k <= n;
        int i = upright ? k : k - n - 1;
        chain_put_joint_in_space(&t, upright, i);
        kmp_text_put(&t, "}, mass: 1, com: [1/3, 1/3, 1/6], points: {T: [2/3, 2/3, 1/3]}, inertia: {xx: 5/108, yy: "
                         "5/108, zz: 8/108, xy: -4/108, xz: -2/108, yz: -2/108}}\n");
    }
    chain_put_loops_in_space(&t, n);
    kmp_text_put(&t, "start:\n  q: {");
    for (int i = 0; i <= 2 * n; i++)
        kmp_text_printf(&t, "%s%c%d: %d deg", i ? ", " : "", i <= n ? 'a' : 'b', i <= n ? i : i - n - 1,
                        i <= n ? 90 : -90);
    kmp_text_put(&t, "}\n  qd: {a0: -1}\n");
    return kmp_text_take(&t);
}

/* Windows that hang, at rest but for pendulums on their bars and a push: N + 1 freedoms, N of which are the pendulums'.
 * To be freed with kmp_free. */
static inline char *chain_of_pendulums(int n)
{
    kmp_text t = {0};
    kmp_text_put(&t, "kempe: 1\nname: pendulums\ngravity: [0, -9.81, 0]\nground: {points: {");
    for (int i = 0; i <= n; i++)
        kmp_text_printf(&t, "%sG%d: [%d, 0, 0]", i ? ", " : "", i, i);
    kmp_text_put(&t, "}}\nbodies:\n");
    for (int k = 0; k <= 3 * n; k++) {
        int kind = k <= n ? 0 : k <= 2 * n ? 1 : 2, i = kind == 0 ? k : (k - 1) % n;
        kmp_text_printf(&t, "  %c%d: {joint: {name: %c%d, revolute: z, at: ", "vhp"[kind], i, "abc"[kind], i);
        kmp_text_printf(&t, kind == 0 ? "ground.G%d" : kind == 1 ? "v%d.T" : "h%d.C", i);
        kmp_text_put(&t, "}, mass: 1, com: [0.5, 0, 0], inertia: {zz: 0.1}, points: {T: [1, 0, 0], C: [0.5, 0, 0]}}\n");
    }
    kmp_text_put(&t, "loops:\n");
    for (int i = 0; i < n; i++)
        kmp_text_printf(&t, "  C%d: {ball: [h%d.T, v%d.T]}\n", i, i, i + 1);
    kmp_text_put(&t, "start:\n  q: {");
    for (int i = 0; i <= n; i++)
        kmp_text_printf(&t, "%sa%d: -90 deg", i ? ", " : "", i);
    for (int i = 0; i < n; i++)
        kmp_text_printf(&t, ", b%d: 90 deg, c%d: %d deg", i, i, i % 7 - 90);
    kmp_text_put(&t, "}\n  qd: {a0: -1}\n");
    return kmp_text_take(&t);
}

#endif
