/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints seen from their second body, and a body's own joint that is turned round. */
#include "base/text.h"
#include "joint_graphs.h"
#include "model/data/model.h"
#include "random_model.h"
#include "testing.h"
#include <kempe/kempe.h>

/* The second point of the joint against the first, for coordinates by name. */
static pose between_points(const kempe_model *model, const double *q, const char *a, const char *b)
{
    pose p[MODEL_MAX_BODIES], at[2], d;
    const char *const names[2] = {a, b};
    plain_poses(model, q, p);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < model->point_count; i++)
            if (strcmp(model->bodies[model->points[i].body].name, names[k]) == 0 &&
                strcmp(model->points[i].name, "P") == 0) {
                at[k] = p[model->points[i].body];
                plain_point(model, p, i, at[k].x);
                if (model->points[i].turned)
                    pose_multiply(&at[k], &model->points[i].axes[0][0]);
            }
    for (int i = 0; i < 3; i++) {
        d.x[i] = 0;
        for (int k = 0; k < 3; k++) {
            d.x[i] += at[0].r[k][i] * (at[1].x[k] - at[0].x[k]);
            d.r[i][k] = 0;
            for (int n = 0; n < 3; n++)
                d.r[i][k] += at[0].r[n][i] * at[1].r[n][k];
        }
    }
    return d;
}

/* A joint from a to b, of which one or the other hangs on the ground. */
static void check_reversed(const joint_kind *kind)
{
    static const char *const bodies[] = {"a", "b"};
    pose found[2];
    for (int k = 0; k < 2; k++) {
        kmp_text text = {0};
        double q[8] = {0};
        kmp_text_printf(&text,
                        "kempe: 1\nbodies:\n"
                        "  a: {%s points: {P: {at: [1, 2, 3], axes: {x: [1, 2, 0.5]}}}}\n"
                        "  b: {%s points: {P: {at: [-0.5, 1, 2], axes: {y: [1, -1, 2]}}}}\n"
                        "joints: {J: {%s: [a.P, b.P]%s}}\n",
                        k ? "" : "joint: {name: G, motions: [T1, R2], at: ground}, ",
                        k ? "joint: {name: G, motions: [T1, R2], at: ground}, " : "", kind->name,
                        strchr(kind->chain, '=')   ? ", axis: [1, 2, 2], pitch: 0.1"
                        : strchr(kind->chain, 'b') ? ", axes: [[1, 2, 2], [0, 1, -1]]"
                        : kind->chain[0]           ? ", axis: [1, 2, 2]"
                                                   : "");
        kempe_model *model = read_text(text.s);
        kmp_text_free(&text);
        if (!model)
            return;
        CHECK(model->bodies[2].reversed == (k == 1));
        CHECK_TEXT(model->bodies[1].name, bodies[k]);
        for (int i = 0; i < model->motion_count; i++) {
            const char *name = model->motions[i].name;
            q[i] = name[0] == 'G' ? 0.3 : name[1] ? 0.2 + 0.3 * (name[2] - '0') : 0.7;
        }
        found[k] = between_points(model, q, "a", "b");
        kempe_model_free(model);
    }
    for (int i = 0; i < 12; i++)
        CHECK_NEAR((&found[1].r[0][0])[i], (&found[0].r[0][0])[i], 1e-14);
}

static void test_reversed(void)
{
    joint_kind kind;
    int count = 0;
    for (int k = 0; joint_kind_at(k, &kind); k++)
        if (strcmp(kind.name, "free") != 0) {
            check_reversed(&kind);
            count++;
        }
    CHECK(count == 8);
}

/* A screw that is counted from its second body advances as it does from its first. */
static void test_reversed_screw(void)
{
    double first[2][MOST_COLUMNS], last[2][MOST_COLUMNS];
    for (int k = 0; k < 2; k++) {
        kmp_text text = {0};
        kmp_text_printf(&text,
                        "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {P: [0, 0, 1]}}\n"
                        "bodies: {a: {mass: 2, com: [0.1, 0, 0.2], inertia: {xx: 0.1, yy: 0.1, zz: 0.15}, "
                        "points: {P: [0, 0.1, -0.3]}}}\n"
                        "joints: {J: {screw: [%s], pitch: 0.2}}\n"
                        "run: {outputs: [position(a.P), velocity(a.P), q(J.1), q(J.2), lambda(J)]}\n",
                        k ? "a.P, ground.P" : "ground.P, a.P");
        CHECK(run_text(text.s, NULL, 0.5, 1e-10, first[k], last[k]) == 9);
        kmp_text_free(&text);
    }
    for (int i = 0; i < 6; i++)
        CHECK_NEAR(last[1][i], last[0][i], 1e-9);
    CHECK_NEAR(last[1][6], -last[0][6], 1e-9);
    CHECK_NEAR(last[1][7], -last[0][7], 1e-9);
    CHECK(last[0][6] < -0.01);
}

/* A body's own joint, with a frame, by which the body carries what it stands on when nothing else does. */
static void test_own_joint_turned(void)
{
    pose found[2];
    for (int k = 0; k < 2; k++) {
        kmp_text text = {0};
        kmp_text_printf(&text,
                        "kempe: 1\nbodies:\n"
                        "  a: {%s points: {P: {at: [1, 2, 3], axes: {x: [1, 2, 0.5]}}}}\n"
                        "  b: {joint: {name: J, spherical: [1, 1, 0], at: a.P, to: P, frame: {y: [1, 2, 3]}}, "
                        "points: {P: {at: [-0.5, 1, 2], axes: {y: [1, -1, 2]}}, Q: [0, 0, 0]}}\n%s",
                        k ? "" : "joint: {name: G, weld: yes, at: ground}, ",
                        k ? "ground: {points: {O: [0, 0, 0]}}\njoints: {G: {weld: [ground.O, b.Q]}}\n" : "");
        kempe_model *model = read_text(text.s);
        kmp_text_free(&text);
        if (!model)
            return;
        double q[3];
        for (int i = 0; i < 3; i++)
            q[i] = 0.3 * (model->motions[i].name[2] - '0');
        CHECK(model->bodies[2].reversed == (k == 1));
        CHECK_TEXT(model->bodies[2].joint, "J");
        found[k] = between_points(model, q, "a", "b");
        kempe_model_free(model);
    }
    for (int i = 0; i < 12; i++)
        CHECK_NEAR((&found[1].r[0][0])[i], (&found[0].r[0][0])[i], 1e-14);
}

int main(void)
{
    context = kempe_context_new();
    TEST(test_reversed);
    TEST(test_reversed_screw);
    TEST(test_own_joint_turned);
    kempe_context_free(context);
    return check_report();
}
