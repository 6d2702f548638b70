/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: not_sanitized */
/* Random graphs of joints in space: the same motion from every tree, and the tree that is chosen among all that there
 * are. */
#include "base/text.h"
#include "distance.h"
#include "joint_graphs.h"
#include "model/data/body.h"
#include "random_model.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <stdbool.h>

enum { GRAPH_BODIES = 5, GRAPH_LOOPS = 3, GRAPH_JOINTS = GRAPH_BODIES + GRAPH_LOOPS };

/* Bodies somewhere in space, and joints between them that fit with all coordinates zero, whatever is cut. */
typedef struct random_links {
    pose body[GRAPH_BODIES + 1];
    int ends[GRAPH_JOINTS][2];
    joint_kind kind[GRAPH_JOINTS];
    pose place[GRAPH_JOINTS];
} random_links;

static pose random_pose(void)
{
    pose p = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {between(-1, 1), between(-1, 1), between(-1, 1)}};
    double e[3] = {between(-1, 1), between(-1, 1), between(0.1, 1)};
    double length = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
    for (int k = 0; k < 3; k++)
        e[k] /= length;
    pose_turn(&p, e, between(-3, 3));
    return p;
}

static joint_kind random_kind(void)
{
    joint_kind kind = {0};
    do
        (void)joint_kind_at(pick(9), &kind);
    while (!kind.closure);
    return kind;
}

/* At least two degrees of freedom. */
static random_links random_links_new(uint64_t seed)
{
    random_links g;
    int rows;
    random_seed(seed);
    g.body[0] = (pose){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
    for (int b = 1; b <= GRAPH_BODIES; b++)
        g.body[b] = random_pose();
    for (int j = 0; j < GRAPH_JOINTS; j++) {
        bool swap = pick(2);
        int a = j < GRAPH_BODIES ? pick(j + 1) : pick(GRAPH_BODIES), b = j < GRAPH_BODIES ? j + 1 : GRAPH_BODIES;
        g.ends[j][swap] = a;
        g.ends[j][!swap] = b == a ? 0 : b;
        g.place[j] = random_pose();
    }
    do {
        rows = 0;
        for (int j = 0; j < GRAPH_JOINTS; j++) {
            g.kind[j] = random_kind();
            rows += g.kind[j].rows;
        }
    } while (rows > 6 * GRAPH_BODIES - 2);
    return g;
}

/* A joint's point in the axes of one of its bodies. */
static void put_place(kmp_text *text, const pose *body, const pose *place, int joint)
{
    double at[3] = {0}, axes[3][3] = {{0}};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            at[i] += body->r[k][i] * (place->x[k] - body->x[k]);
            for (int n = 0; n < 3; n++)
                axes[i][n] += body->r[k][i] * place->r[k][n];
        }
    kmp_text_printf(text,
                    "J%d: {at: [%.17g, %.17g, %.17g], axes: {x: [%.17g, %.17g, %.17g], z: [%.17g, %.17g, %.17g]}}",
                    joint, at[0], at[1], at[2], axes[0][0], axes[1][0], axes[2][0], axes[0][2], axes[1][2], axes[2][2]);
}

static void put_links(kmp_text *text, const random_links *g, const bool *cut)
{
    kmp_text_put(text, "kempe: 1\ngravity: [1, -9, 2]\n");
    for (int b = 0; b <= GRAPH_BODIES; b++) {
        if (b == 0)
            kmp_text_put(text, "ground: {points: {G: [1, 1, 1]");
        else
            kmp_text_printf(text,
                            "%s  b%d: {mass: %d.5, com: [0.1, 0.%d, -0.2], inertia: {xx: 0.3, yy: 0.4, zz: 0.5, xy: "
                            "0.05}, points: {G: [0.2, 0.1, 0.3]",
                            b == 1 ? "bodies:\n" : "", b, b, b);
        for (int j = 0; j < GRAPH_JOINTS; j++)
            if (g->ends[j][0] == b || g->ends[j][1] == b) {
                kmp_text_put(text, ", ");
                put_place(text, &g->body[b], &g->place[j], j);
            }
        kmp_text_put(text, "}}\n");
    }
    kmp_text_put(text, "joints:\n");
    for (int j = 0; j < GRAPH_JOINTS; j++) {
        kmp_text_printf(text, "  j%d: {%s: [", j, g->kind[j].name);
        for (int k = 0; k < 2; k++)
            if (g->ends[j][k])
                kmp_text_printf(text, "%sb%d.J%d", k ? ", " : "", g->ends[j][k], j);
            else
                kmp_text_printf(text, "%sground.J%d", k ? ", " : "", j);
        kmp_text_printf(text, "]%s%s}\n", g->kind[j].chain[0] && j % 3 ? ", axis: [1, 2, -1]" : "",
                        !cut     ? ""
                        : cut[j] ? ", cut: yes"
                                 : ", cut: no");
    }
    kmp_text_put(text, "forces: {s: {spring: [ground.G, b1.G], stiffness: 50, damping: 2}}\nrun: {outputs: [");
    for (int b = 1; b <= GRAPH_BODIES; b++)
        kmp_text_printf(text, "%sposition(b%d.G), acceleration(b%d.G)", b > 1 ? ", " : "", b, b);
    kmp_text_put(text, "]}\n");
}

/* Joints taken in a random order, those that close a loop are cut. */
static void random_cuts(const random_links *g, bool *cut)
{
    int order[GRAPH_JOINTS], group[GRAPH_BODIES + 1];
    for (int b = 0; b <= GRAPH_BODIES; b++)
        group[b] = b;
    for (int j = 0; j < GRAPH_JOINTS; j++) {
        int at = pick(j + 1);
        for (int k = j; k > at; k--)
            order[k] = order[k - 1];
        order[at] = j;
    }
    for (int k = 0; k < GRAPH_JOINTS; k++) {
        int a = group[g->ends[order[k]][0]], b = group[g->ends[order[k]][1]];
        cut[order[k]] = a == b;
        for (int i = 0; i <= GRAPH_BODIES; i++)
            if (group[i] == a)
                group[i] = b;
    }
}

/* At rest with all joints closed, and a while later: the same accelerations and places from every tree. */
static void test_random_graphs(void)
{
    for (uint64_t seed = 1; seed <= 24; seed++) {
        random_links g = random_links_new(seed);
        double first[4][MOST_COLUMNS], last[4][MOST_COLUMNS];
        for (int trial = 0; trial < 4; trial++) {
            kmp_text text = {0};
            bool cut[GRAPH_JOINTS];
            random_cuts(&g, cut);
            put_links(&text, &g, trial ? cut : NULL);
            CHECK(run_text(text.s, "projected", 0.1, 1e-11, first[trial], last[trial]) == 6 * GRAPH_BODIES);
            kmp_text_free(&text);
            if (trial == 0)
                continue;
            double start = distance(6 * GRAPH_BODIES, first[trial], first[0]);
            double end = distance(6 * GRAPH_BODIES, last[trial], last[0]);
            if (!(start <= 1e-9 && end <= 1e-7))
                printf("graph %d, tree %d: off by %.3g and %.3g\n", (int)seed, trial, start, end);
            CHECK(start <= 1e-9 && end <= 1e-7);
        }
    }
}

/* Sum over the bodies of the coordinates between the ground and the body, for a set of joints; -1 when it is no tree.
 */
static int depth_of(const random_links *g, unsigned tree)
{
    int depth[GRAPH_BODIES + 1], reached = 1, sum = 0;
    for (int b = 1; b <= GRAPH_BODIES; b++)
        depth[b] = -1;
    depth[0] = 0;
    for (int before = 0; before < reached;) {
        before = reached;
        for (int j = 0; j < GRAPH_JOINTS; j++) {
            int a = g->ends[j][0], b = g->ends[j][1];
            if (!(tree & 1u << j) || (depth[a] < 0) == (depth[b] < 0))
                continue;
            depth[depth[a] < 0 ? a : b] = depth[depth[a] < 0 ? b : a] + (int)strlen(g->kind[j].chain) / 2;
            reached++;
        }
    }
    for (int b = 1; b <= GRAPH_BODIES; b++)
        sum += depth[b];
    return reached == GRAPH_BODIES + 1 ? sum : -1;
}

static int rows_of(const random_links *g, unsigned tree)
{
    int rows = 0;
    for (int j = 0; j < GRAPH_JOINTS; j++)
        rows += tree & 1u << j ? 0 : g->kind[j].rows;
    return rows;
}

static unsigned chosen_tree(const random_links *g)
{
    kmp_text text = {0};
    unsigned tree = 0;
    put_links(&text, g, NULL);
    kempe_model *model = read_text(text.s);
    for (int b = 1; model && b < kmp_model_body_count(model); b++)
        tree |= 1u << (kmp_model_body(model, b)->joint[1] - '0');
    kempe_model_free(model);
    kmp_text_free(&text);
    return tree;
}

/* No tree has cuts of fewer rows; of those with as few, few have shorter chains. */
static void test_choice_is_best(void)
{
    enum { GRAPHS = 300 };
    int shortest = 0;
    double worst = 1;
    for (uint64_t seed = 1; seed <= GRAPHS; seed++) {
        random_links g = random_links_new(seed);
        unsigned chosen = chosen_tree(&g);
        int rows = rows_of(&g, chosen), depth = depth_of(&g, chosen), least = depth;
        CHECK(depth >= 0);
        for (unsigned tree = 0; tree < 1u << GRAPH_JOINTS; tree++) {
            int count = 0;
            for (int j = 0; j < GRAPH_JOINTS; j++)
                count += (tree & 1u << j) != 0;
            int other = count == GRAPH_BODIES ? depth_of(&g, tree) : -1;
            if (other < 0)
                continue;
            CHECK(rows_of(&g, tree) >= rows);
            if (rows_of(&g, tree) == rows && other < least)
                least = other;
        }
        shortest += depth == least;
        if (least > 0)
            worst = check_max(worst, (double)depth / least);
    }
    printf("  of %d graphs %d have the shortest chains too, at worst %.2f times as long\n", GRAPHS, shortest, worst);
    CHECK(10 * shortest >= 9 * GRAPHS);
}

int main(void)
{
    context = kempe_context_new();
    TEST(test_random_graphs);
    TEST(test_choice_is_best);
    kempe_context_free(context);
    return check_report();
}
