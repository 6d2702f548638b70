/* SPDX-License-Identifier: BSD-3-Clause */
/* Random spatial mechanisms as text of the model language: bodies, points, joints of every kind. */
#ifndef KEMPE_TESTS_RANDOM_TEXT_H
#define KEMPE_TESTS_RANDOM_TEXT_H

#include "base/text.h"
#include "random.h"
#include <stdbool.h>
#include <string.h>

enum { MODEL_MAX_N = 96, MODEL_MAX_BODIES = 80 };

/* Parts of a random model. */
enum {
    MODEL_LOOPS = 1,
    MODEL_FORCES = 2,    /* springs and efforts, conservative */
    MODEL_DAMPING = 4,   /* and not: damping of springs, efforts over t, q and qd */
    MODEL_SYMBOLS = 8,   /* numbers as expressions of parameters */
    MODEL_PLAIN = 16,    /* joints of plain motions, loops of balls and rods: many assemble and move */
    MODEL_BUSHINGS = 32, /* two, beside other forces */
    MODEL_DRIVES = 64    /* a motion led over time, by parameters as well with MODEL_SYMBOLS */
};

/* -- writing ----------------------------------------------------------------------------------------- */

/* A number, or an expression of about that size. */
static inline void put_number(kmp_text *text, double x, unsigned flags)
{
    kmp_text_printf(text, "\"");
    if (flags & MODEL_SYMBOLS)
        switch (pick(5)) {
        case 0:
            kmp_text_printf(text, "a*(%.17g)", x);
            break;
        case 1:
            kmp_text_printf(text, "(%.17g)/b", x);
            break;
        case 2:
            kmp_text_printf(text, "(%.17g)*sqrt(a*b)", x);
            break;
        case 3:
            kmp_text_printf(text, "(%.17g)*b^-1.5", x);
            break;
        default:
            kmp_text_printf(text, "%.17g", x);
        }
    else
        kmp_text_printf(text, "%.17g", x);
    kmp_text_printf(text, "\"");
}

/* [x, y, z]; sometimes with zeros. */
static inline void put_vector(kmp_text *text, double size, unsigned flags)
{
    int zeros = pick(4);
    for (int k = 0; k < 3; k++) {
        kmp_text_put(text, k ? ", " : "[");
        put_number(text, zeros == 0 && k != 1 ? 0 : between(-size, size), flags);
    }
    kmp_text_put(text, "]");
}

/* No coordinate axis twice in a joint: two motions along one line would be one too many. */
static inline void put_motion(kmp_text *text, bool used[2][3])
{
    int translation = pick(3) == 0, axis = pick(3);
    const char *letter = translation ? "T" : "R";
    if (pick(3) && !used[translation][axis]) {
        used[translation][axis] = true;
        kmp_text_printf(text, "%s%s%d", pick(3) ? "" : "-", letter, 1 + axis);
        return;
    }
    kmp_text_printf(text, "{%s: [%.17g, %.17g, %.17g]}", letter, between(-1, 1), between(-1, 1), between(-1, 1));
}

static const char *const random_axes[] = {"x", "y", "z", "-x", "-y", "-z", "[1, 2, -3]", "[-1, 0.5, 0]"};

/* Half of them turned. */
static inline void put_axes(kmp_text *text, const char *key)
{
    static const char *const some[] = {"{z: x}", "{x: -y, z: [1, 0, 2]}", "{y: [1, 2, 3]}",
                                       "{z: [1, -1, 0], x: [0, 0, -1]}"};
    if (pick(2))
        kmp_text_printf(text, ", %s: %s", key, some[pick(4)]);
}

/* A row of joints.def; the first body is not welded. */
static inline void put_named_joint(kmp_text *text, int body)
{
    static const struct {
        const char *name, *chain;
    } kinds[] = {
#define KMP_JOINT(name, chain) {#name, chain},
#include "model/data/joints.def"
#undef KMP_JOINT
    };
    size_t kind;
    do
        kind = (size_t)pick((int)(sizeof kinds / sizeof *kinds));
    while (body == 1 && !kinds[kind].chain[0]);
    kmp_text_printf(text, "%s: %s", kinds[kind].name, kinds[kind].chain[0] ? random_axes[pick(8)] : "yes");
    if (strchr(kinds[kind].chain, '='))
        kmp_text_put(text, ", pitch: 0.2");
}

static inline void put_joint(kmp_text *text, int body, unsigned flags)
{
    int parent = body == 1 || pick(5) == 0 ? 0 : pick(3) ? body - 1 : 1 + pick(body - 1), motions = 1 + pick(3);
    bool used[2][3] = {{false}};
    kmp_text_printf(text, "    joint: {");
    if (pick(2)) {
        kmp_text_printf(text, "%s: %s", pick(3) ? "revolute" : "prismatic", random_axes[pick(8)]);
    } else if (!(flags & MODEL_PLAIN) && pick(2)) {
        put_named_joint(text, body);
    } else {
        for (int k = 0; k < motions; k++) {
            kmp_text_put(text, k ? ", " : "motions: [");
            put_motion(text, used);
        }
        kmp_text_put(text, "]");
    }
    put_axes(text, "frame");
    if (!(flags & MODEL_PLAIN) && pick(3) == 0)
        kmp_text_printf(text, ", to: %s", pick(2) ? "P" : "Q");
    if (!(flags & MODEL_PLAIN) && pick(3) == 0)
        kmp_text_put(text, ", reversed: yes");
    if (parent)
        kmp_text_printf(text, ", at: b%d%s}\n", parent, pick(4) ? pick(2) ? ".P" : ".Q" : "");
    else
        kmp_text_printf(text, ", at: ground%s}\n", pick(2) ? ".P" : "");
}

/* Inertia of six point masses about their middle: some body has it. */
static inline void put_inertia(kmp_text *text, unsigned flags)
{
    static const char *const names[] = {"xx", "yy", "zz", "xy", "xz", "yz"};
    static const int row[] = {0, 1, 2, 0, 0, 1}, column[] = {0, 1, 2, 1, 2, 2};
    double t[6] = {0};
    for (int p = 0; p < 6; p++) {
        double x[3] = {between(-1, 1), between(-1, 1), between(-1, 1)}, m = between(0.05, 0.5);
        for (int k = 0; k < 6; k++)
            t[k] -= m * x[row[k]] * x[column[k]];
        for (int k = 0; k < 3; k++)
            t[k] += m * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    }
    /* one factor for all six, so that the tensor stays possible */
    bool symbols = flags & MODEL_SYMBOLS && pick(2);
    for (int k = 0; k < 6; k++)
        kmp_text_printf(text, "%s%s: %s%.17g%s", k ? ", " : "    inertia: {", names[k], symbols ? "(" : "", t[k],
                        symbols ? ")*a^2" : "");
    kmp_text_put(text, "}\n");
}

static inline void put_points(kmp_text *text, unsigned flags)
{
    kmp_text_put(text, "{P: {at: ");
    put_vector(text, 1, flags);
    put_axes(text, "axes");
    kmp_text_put(text, "}, Q: ");
    put_vector(text, 1, flags);
    kmp_text_put(text, "}\n");
}

static inline void put_body(kmp_text *text, int body, unsigned flags)
{
    kmp_text_printf(text, "  b%d:\n", body);
    put_joint(text, body, flags);
    kmp_text_put(text, "    mass: ");
    put_number(text, between(0.2, 3), flags);
    kmp_text_put(text, "\n    com: ");
    put_vector(text, 0.5, flags);
    kmp_text_put(text, "\n");
    put_inertia(text, flags);
    kmp_text_put(text, "    points: ");
    put_points(text, flags);
}

/* Two points of different bodies, one of which may be the ground. */
static inline void put_pair(kmp_text *text, int bodies)
{
    int a = 1 + pick(bodies), b;
    do
        b = pick(bodies + 1);
    while (a == b);
    bool swap = pick(2);
    for (int k = 0; k < 2; k++) {
        int body = (k == 0) != swap ? a : b;
        kmp_text_put(text, k ? ", " : "[");
        if (body)
            kmp_text_printf(text, "b%d.%s", body, pick(2) ? "P" : "Q");
        else
            kmp_text_printf(text, "ground.%s", pick(2) ? "P" : "Q");
    }
    kmp_text_put(text, "]");
}

static inline void put_springs(kmp_text *text, int bodies, unsigned flags)
{
    for (int k = 0; k < 2; k++) {
        kmp_text_printf(text, "  s%d: {spring: ", k);
        put_pair(text, bodies);
        kmp_text_put(text, ", stiffness: ");
        put_number(text, between(5, 50), flags);
        kmp_text_put(text, ", free_length: ");
        put_number(text, between(0.2, 1), flags);
        if (flags & MODEL_DAMPING) {
            kmp_text_put(text, ", damping: ");
            put_number(text, between(0.5, 3), flags);
        }
        kmp_text_put(text, "}\n");
    }
}

/* The first with one number for all axes, the other with three. */
static inline void put_bushings(kmp_text *text, int bodies, unsigned flags)
{
    static const char *const keys[] = {"stiffness", "rotational_stiffness", "preload", "damping", "rotational_damping"};
    for (int k = 0; k < 2; k++) {
        kmp_text_printf(text, "  u%d: {bushing: ", k);
        put_pair(text, bodies);
        for (int i = 0; i < (flags & MODEL_DAMPING ? 5 : 3); i++) {
            kmp_text_printf(text, ", %s: ", keys[i]);
            if (k == 0)
                put_number(text, between(1, 20), flags);
            else
                put_vector(text, 20, flags);
        }
        kmp_text_put(text, "}\n");
    }
}

static inline void put_frame(kmp_text *text, uint64_t seed, int bodies, unsigned flags)
{
    random_seed(seed);
    kmp_text_put(text, "kempe: 1\nname: random\nparameters: {a: 1.25, b: 0.875}\ngravity: ");
    put_vector(text, 9, flags);
    kmp_text_put(
        text, "\ntables: {f: {x: [-50, -20, 0, 20, 50], y: [-149.8, -21.8, 0.2, 14.2, 125.2]}}\nground:\n  points: ");
    put_points(text, flags);
    kmp_text_put(text, "bodies:\n");
    for (int b = 1; b <= bodies; b++)
        put_body(text, b, flags);
}

static inline void put_run(kmp_text *text, int bodies, bool loops)
{
    kmp_text_put(text, "run: {outputs: [q");
    for (int b = 1; b <= bodies; b++)
        kmp_text_printf(text, ", position(b%d.P), position(b%d.Q)", b, b);
    kmp_text_put(text, loops ? ", moment(L0), moment(L1)]}\n" : "]}\n");
}

#endif
