/* SPDX-License-Identifier: BSD-3-Clause */
/* Chains of N windows (IFToMM A02): N + 1 uprights on the ground, each with a bar that a loop ties to the next. */
#ifndef KEMPE_BENCH_CHAIN_H
#define KEMPE_BENCH_CHAIN_H

#include "base/text.h"
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
 * degrees, by turns, and nothing moves. */
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
