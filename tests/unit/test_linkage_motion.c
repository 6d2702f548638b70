/* SPDX-License-Identifier: BSD-3-Clause */
/* Graphs of joints move the same whatever is cut: examples against digits that Kempe did not make. */
#include "base/file.h"
#include "base/memory.h"
#include "joint_graphs.h"
#include "testing.h"

static void put_four_bar(kmp_text *text, int cut)
{
    static const char *const names[] = {"A", "B", "C", "D"};
    static const char *const points[] = {"ground.O, crank.O", "crank.B, coupler.O", "rocker.C, coupler.C",
                                         "rocker.O, ground.D"};
    kmp_text_printf(text, "%sjoints:\n", four_bar);
    for (int k = 0; k < 4; k++)
        kmp_text_printf(text, "  %s: {revolute: [%s]%s}\n", names[k], points[k], k == cut ? ", cut: yes" : "");
}

/* The rates of all four hinges at the start, at 20 rad/s of the crank. */
static void start_rates(double rates[4])
{
    kmp_text text = {0};
    double first[MOST_COLUMNS], last[MOST_COLUMNS];
    put_four_bar(&text, 2);
    kmp_text_put(&text, "start: {qd: {A: 20}, hold: [A]}\nrun: {outputs: [qd(A), qd(B), qd(D)]}\n");
    CHECK(run_text(text.s, NULL, 1e-3, 1e-12, first, last) == 3);
    rates[0] = first[0];
    rates[1] = first[1];
    rates[2] = first[0] + first[1] + first[2]; /* coupler against rocker, which turns by -D */
    rates[3] = first[2];
    CHECK_NEAR(rates[0], 20, 1e-14);
    kmp_text_free(&text);
}

/* The example's reference, an integral in 40 digits: the angles of crank and rocker at t = 2; here the points that they
 * carry, whatever is cut. */
static void test_every_cut_of_the_four_bar(void)
{
    const double crank = 48.0361818028095015, rocker = 0.333951832272976144;
    double rates[4];
    start_rates(rates);
    for (int cut = 0; cut < 4; cut++) {
        kmp_text text = {0};
        double first[MOST_COLUMNS], last[MOST_COLUMNS];
        put_four_bar(&text, cut);
        kmp_text_put(&text, "start: {qd: {");
        for (int k = 0, written = 0; k < 4; k++)
            if (k != cut)
                kmp_text_printf(&text, "%s%c: %.17g", written++ ? ", " : "", 'A' + k, rates[k]);
        kmp_text_put(&text, "}}\nrun: {outputs: [position(crank.B), position(rocker.C)]}\n");
        CHECK(run_text(text.s, cut % 2 ? "projected" : NULL, 2, 1e-12, first, last) == 6);
        double x = first[3] - 0.9, y = first[4];
        CHECK_NEAR(last[0], -0.3 * sin(crank), 1e-8);
        CHECK_NEAR(last[1], 0.3 * cos(crank), 1e-8);
        CHECK_NEAR(last[3], 0.9 + x * cos(rocker) - y * sin(rocker), 1e-8);
        CHECK_NEAR(last[4], x * sin(rocker) + y * cos(rocker), 1e-8);
        kmp_text_free(&text);
    }
}

/* The example's reference, an integral over the crank's angle in 40 digits: where the crank's and the coupler's ends
 * are at t = 2, for pairs of hinges that are cut. All hinges have a start value, for there is more than one way to
 * close. */
static void test_cuts_of_the_six_bar(void)
{
    static const char *const cuts[] = {"BQ", "AE", "DP", "DE", "BE", "AQ", "BP"};
    static const char *const hinges[] = {"O: {revolute: [ground.O, crank.O]",   "A: {revolute: [coupler.A, crank.A]",
                                         "B: {revolute: [coupler.B, rocker.B]", "D: {revolute: [ground.D, rocker.D]",
                                         "P: {revolute: [coupler.P, rod.P]",    "Q: {revolute: [rod.Q, lever.Q]",
                                         "E: {revolute: [lever.E, ground.E]"};
    char *model = NULL;
    size_t length;
    CHECK(kmp_file_read(context, KMP_FILE_MODEL, KEMPE_ROOT "/examples/stephenson/stephenson.yaml", &model, &length) ==
          KEMPE_OK);
    char *joints = model ? strstr(model, "\njoints:") : NULL;
    CHECK(joints != NULL);
    for (size_t k = 0; joints && k < sizeof cuts / sizeof *cuts; k++) {
        double first[MOST_COLUMNS], last[MOST_COLUMNS];
        kmp_text text = {0};
        kmp_text_printf(&text, "%.*s\njoints:\n", (int)(joints - model), model);
        for (int j = 0; j < 7; j++)
            kmp_text_printf(&text, "  %s%s}\n", hinges[j], strchr(cuts[k], hinges[j][0]) ? ", cut: yes" : "");
        kmp_text_put(&text,
                     "start: {q: {O: 90 deg, A: 65 deg, B: 80 deg, D: 105 deg, P: -27 deg, Q: 82 deg, E: -79 deg},"
                     " hold: [O], qd: {O: 15}}\nrun: {outputs: [position(crank.A), position(coupler.P)]}\n");
        CHECK(run_text(text.s, k % 2 ? "projected" : NULL, 2, 1e-12, first, last) == 6);
        CHECK_NEAR(last[0], 0.3 * cos(37.71152463158547582), 1e-9);
        CHECK_NEAR(last[1], 0.3 * sin(37.71152463158547582), 1e-9);
        CHECK_NEAR(last[3], 0.31264018736112810811, 1e-9);
        CHECK_NEAR(last[4], 0.71424442385362478444, 1e-9);
        kmp_text_free(&text);
    }
    kmp_free(model);
}

/* A body on an arm: by a joint of the tree, or free with that joint cut. The coordinates of the joint, their rates and
 * their accelerations are the same: those of the tree are integrated. */
static void put_arm(kmp_text *text, const joint_kind *kind, bool cut)
{
    const char *axes = strchr(kind->chain, 'b') ? "axes: [[1, 2, 2], [2, 1, -2]]" : "axis: [1, 2, 2]";
    int count = (int)strlen(kind->chain) / 2;
    kmp_text_printf(text,
                    "kempe: 1\ngravity: [1, -9, 2]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                    "  a: {mass: 2, com: [0.1, 0.05, 0.02], inertia: {xx: 0.1, yy: 0.2, zz: 0.3},\n"
                    "      points: {O: [0, 0, 0], P: {at: [0.4, 0, 0], axes: {z: [1, 2, 3], x: [3, 0, -1]}}}}\n"
                    "  b: {mass: 1, com: [0.6, 0.1, -0.2], inertia: {xx: 0.3, yy: 0.2, zz: 0.25, xy: 0.02},\n"
                    "      points: {P: {at: [0.4, 0, 0], axes: {z: [1, 2, 3], x: [3, 0, -1]}}}%s}\n"
                    "joints:\n  A: {revolute: [ground.O, a.O], axis: y}\n  J: {%s: [a.P, b.P], %s%s}\n"
                    "run: {outputs: [",
                    cut ? ", joint: {name: F, free: x, at: ground}" : "", kind->name, axes, cut ? ", cut: yes" : "");
    for (int k = 0; k < 3 * count; k++)
        kmp_text_printf(text, "%s%s(J.%d)", k ? ", " : "",
                        k < count       ? "q"
                        : k < 2 * count ? "qd"
                                        : "qdd",
                        k % count + 1);
    kmp_text_put(text, "]}\n");
}

static void test_coordinates_of_cut_joints(void)
{
    joint_kind kind;
    for (int k = 0; joint_kind_at(k, &kind); k++) {
        double first[MOST_COLUMNS], tree[MOST_COLUMNS], cut[MOST_COLUMNS];
        kmp_text text[2] = {{0}, {0}};
        int count = (int)strlen(kind.chain) / 2 * 3;
        if (!kind.closure || count == 0)
            continue;
        put_arm(&text[0], &kind, false);
        put_arm(&text[1], &kind, true);
        CHECK(run_text(text[0].s, NULL, 0.3, 1e-11, first, tree) == count);
        CHECK(run_text(text[1].s, NULL, 0.3, 1e-11, first, cut) == count);
        for (int i = 0; i < count; i++) {
            CHECK(fabs(tree[i]) > 1e-4);
            CHECK_NEAR(cut[i], tree[i], 1e-8);
        }
        kmp_text_free(&text[0]);
        kmp_text_free(&text[1]);
    }
}

int main(void)
{
    context = kempe_context_new();
    TEST(test_every_cut_of_the_four_bar);
    TEST(test_cuts_of_the_six_bar);
    TEST(test_coordinates_of_cut_joints);
    kempe_context_free(context);
    return check_report();
}
