/* SPDX-License-Identifier: BSD-3-Clause */
/* The equations at many states have the bits of single evaluations, in lanes and one at a time; which models run in
 * lanes; and the state that the workspace keeps. */
#include "base/memory.h"
#include "constraints/workspace/state_workspace.h"
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/extend.h>
#include <stdlib.h>

enum { COUNT = 1003, MOST = 64 };

typedef struct table {
    loaded l;
    int n, m;
    double *t, *q, *qd;
    double *qdd, *lambda;
    kempe_workspace_rows rows;
    kempe_workspace *many, *one;
} table;

static double *room(int width)
{
    double *x = calloc((size_t)(COUNT * width) + 1, sizeof *x);
    CHECK(x != NULL);
    return x;
}

/* States around the start. */
static table table_of(loaded l)
{
    table s = {.l = l, .n = l.system->n, .m = l.system->m};
    kempe_assembly *start = NULL;
    CHECK(s.n <= MOST && kempe_assembly_new(l.system, &start) == KEMPE_OK);
    CHECK(kempe_workspace_new(l.system, &s.many) == KEMPE_OK && kempe_workspace_new(l.system, &s.one) == KEMPE_OK);
    s.t = room(1);
    s.q = room(s.n);
    s.qd = room(s.n);
    s.qdd = room(s.n);
    s.lambda = room(s.m);
    s.rows = (kempe_workspace_rows){room(s.n * s.n), room(s.n), room(s.m), room(s.m * s.n), room(s.m)};
    for (int k = 0; k < COUNT; k++) {
        s.t[k] = 1e-3 * k;
        for (int i = 0; i < s.n; i++) {
            s.q[k * s.n + i] = kempe_assembly_q(start)[i] + 0.05 * sin(0.3 * k + i);
            s.qd[k * s.n + i] = kempe_assembly_qd(start)[i] + cos(0.7 * k - i);
        }
    }
    kempe_assembly_free(start);
    return s;
}

static void table_free(table *s)
{
    double *all[] = {s->t,         s->q,         s->qd,     s->qdd,           s->lambda,
                     s->rows.mass, s->rows.bias, s->rows.h, s->rows.jacobian, s->rows.jdqd};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        free(all[k]);
    kempe_workspace_free(s->many);
    kempe_workspace_free(s->one);
    unload(&s->l);
}

static bool same(const double *rows, int width, int row, const double *values)
{
    return width == 0 || memcmp(rows + row * width, values, (size_t)width * sizeof *rows) == 0;
}

/* True if row k has the bits of a workspace's values. */
static bool agrees(const table *s, int k, const kempe_workspace *ws)
{
    return same(s->rows.mass, s->n * s->n, k, kempe_workspace_mass(ws)) &&
           same(s->rows.bias, s->n, k, kempe_workspace_bias(ws)) && same(s->rows.h, s->m, k, kempe_workspace_h(ws)) &&
           same(s->rows.jacobian, s->m * s->n, k, kempe_workspace_jacobian(ws)) &&
           same(s->rows.jdqd, s->m, k, kempe_workspace_jdqd(ws));
}

/* The number of rows that differ from single evaluations, with qd or at rest, at all times or at the first. */
static int count_differences(table *s, int count, int t_step, bool moving)
{
    int differences = 0, failed = 5;
    CHECK(kempe_workspace_evaluate_states(s->many, count, s->t, t_step, s->q, moving ? s->qd : NULL, &s->rows,
                                          &failed) == KEMPE_OK);
    CHECK(failed == -1);
    for (int k = 0; k < count; k++) {
        CHECK(kempe_workspace_evaluate(s->one, s->t[k * t_step], s->q + k * s->n, moving ? s->qd + k * s->n : NULL) ==
              KEMPE_OK);
        differences += !agrees(s, k, s->one);
    }
    return differences;
}

/* The number of states whose accelerations and multipliers differ from single ones. */
static int count_forward_differences(table *s, int count, const double *Q)
{
    int differences = 0;
    double qdd[MOST], lambda[MOST];
    CHECK(kempe_workspace_forward_states(s->many, count, s->t, 1, s->q, s->qd, Q, s->qdd, s->lambda, NULL) == KEMPE_OK);
    for (int k = 0; k < count; k++) {
        CHECK(kempe_workspace_forward_dynamics(s->one, s->t[k], s->q + k * s->n, s->qd + k * s->n,
                                               Q ? Q + k * s->n : NULL, qdd, lambda) == KEMPE_OK);
        differences += !same(s->qdd, s->n, k, qdd) || !same(s->lambda, s->m, k, lambda);
    }
    return differences;
}

/* The workspace keeps the last state. */
static bool keeps(const table *s, int count)
{
    return agrees(s, count - 1, s->many) && kempe_workspace_kinetic(s->many) == kempe_workspace_kinetic(s->one) &&
           kempe_workspace_potential(s->many) == kempe_workspace_potential(s->one);
}

/* Checks that the model runs in lanes, since the comparison below would pass without them. */
static void all_states(loaded l, bool lanes)
{
    static const int counts[] = {1, 7, 8, COUNT, COUNT - 3, 8, 1};
    table s = table_of(l);
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        CHECK(count_differences(&s, counts[k], 1, true) == 0);
        CHECK(keeps(&s, counts[k]));
        CHECK((s.many->many.stages.lanes != NULL) == (lanes && k >= 3));
    }
    CHECK(count_forward_differences(&s, COUNT, NULL) == 0 && count_forward_differences(&s, COUNT - 3, s.qd) == 0);
    CHECK(memcmp(kempe_workspace_mass(s.many), kempe_workspace_mass(s.one), sizeof(double)) == 0);
    CHECK(kempe_workspace_kinetic(s.many) == kempe_workspace_kinetic(s.one));
    CHECK(count_differences(&s, COUNT, 0, true) == 0 && count_differences(&s, COUNT - 3, 1, false) == 0);
    table_free(&s);
}

static void in_lanes(void)
{
    static const char *const models[] = {
        "examples/four_bar/four_bar.yaml", "examples/andrews/andrews.yaml",       "examples/stewart/stewart.yaml",
        "tests/models/bricard_balls.yaml", "examples/suspension/suspension.yaml", "examples/stewart/driven.yaml",
    };
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        printf("  %s\n", models[k]);
        all_states(load(models[k]), true);
    }
}

static void one_at_a_time(void)
{
    static const char *const models[] = {"tests/models/ramp.yaml", "tests/models/pendulum_stops.yaml",
                                         "tests/models/friction_loop.yaml"};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        printf("  %s\n", models[k]);
        all_states(load(models[k]), false);
    }
}

static int brake(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)user, (void)q;
    effort[0] = -t * qd[0];
    return 0;
}

static void user_force(void)
{
    loaded l = load("examples/four_bar/four_bar.yaml");
    kempe_system_set_force(l.system, brake, NULL);
    all_states(l, false);
}

/* Samples that change within a group of states, and then a value of the caller. */
static void inputs(void)
{
    table s = table_of(load_text("kempe: 1\n"
                                 "inputs: {u: {unit: N, t: [0, 0.1, 0.5, 2], value: [1, 2, -3, 5], method: hold}}\n"
                                 "bodies: {cart: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                                 "forces: {drive: {joint: x, force: u}}\n"));
    CHECK(count_differences(&s, COUNT, 1, true) == 0 && s.rows.bias[99] != s.rows.bias[102]);
    CHECK(s.many->many.stages.lanes);
    CHECK(kempe_workspace_set_input(s.many, 0, 0, 7, 1, 2) == KEMPE_OK);
    CHECK(kempe_workspace_set_input(s.one, 0, 0, 7, 1, 2) == KEMPE_OK);
    CHECK(count_differences(&s, COUNT, 1, true) == 0 && s.rows.bias[0] == -7);
    table_free(&s);
}

/* The first state that fails ends the call; rows before it are complete, also in its group. */
static void failures(void)
{
    table s = table_of(load("examples/andrews/andrews.yaml"));
    int failed = 0;
    s.q[777 * s.n + 2] = NAN;
    CHECK(kempe_workspace_evaluate_states(s.many, COUNT, s.t, 1, s.q, s.qd, &s.rows, &failed) == KEMPE_E_FAILED);
    CHECK(failed == 777 && strlen(kempe_workspace_message(s.many)) > 0);
    for (int k = 760; k < 777; k++) {
        CHECK(kempe_workspace_evaluate(s.one, s.t[k], s.q + k * s.n, s.qd + k * s.n) == KEMPE_OK);
        CHECK(agrees(&s, k, s.one));
    }
    CHECK(kempe_workspace_forward_states(s.many, COUNT, s.t, 1, s.q, s.qd, NULL, s.qdd, NULL, &failed) ==
          KEMPE_E_FAILED);
    CHECK(failed == 777 && count_forward_differences(&s, 777, NULL) == 0);
    CHECK(kempe_workspace_forward_states(s.many, 1, s.t, 1, s.q, NULL, NULL, s.qdd, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_evaluate_states(s.many, 776, s.t, 1, s.q, s.qd, &s.rows, NULL) == KEMPE_OK);
    CHECK_TEXT(kempe_workspace_message(s.many), "");
    CHECK(kempe_workspace_evaluate_states(s.many, 0, s.t, 1, s.q, s.qd, &s.rows, &failed) == KEMPE_OK && failed == -1);
    CHECK(kempe_workspace_evaluate_states(s.many, 1, NULL, 1, s.q, s.qd, &s.rows, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_evaluate_states(s.many, 1, s.t, 1, NULL, s.qd, &s.rows, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_evaluate_states(s.many, 1, s.t, 1, s.q, s.qd, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_evaluate_states(NULL, 1, s.t, 1, s.q, s.qd, &s.rows, NULL) == KEMPE_E_ARGUMENT);
    table_free(&s);
}

/* Only what is wanted is written; the lanes are the only allocation; accelerations afterwards are as before. */
static void memory(void)
{
    table s = table_of(load("examples/four_bar/four_bar.yaml"));
    const kempe_workspace_rows bias = {.bias = s.rows.bias};
    double qdd[2][MOST];
    CHECK(kempe_workspace_forward_dynamics(s.many, 0, s.q, s.qd, NULL, qdd[0], NULL) == KEMPE_OK);
    CHECK(kempe_workspace_evaluate_states(s.many, COUNT, s.t, 1, s.q, s.qd, &bias, NULL) == KEMPE_OK);
    CHECK(s.rows.mass[0] == 0 && s.rows.bias[0] != 0);
    unsigned long before = kmp_memory_count();
    CHECK(count_differences(&s, COUNT, 1, true) == 0);
    CHECK(kempe_workspace_forward_dynamics(s.many, 0, s.q, s.qd, NULL, qdd[1], NULL) == KEMPE_OK);
    CHECK(kmp_memory_count() == before && memcmp(qdd[0], qdd[1], (size_t)s.n * sizeof qdd[0][0]) == 0);
    table_free(&s);
}

int main(void)
{
    TEST(in_lanes);
    TEST(one_at_a_time);
    TEST(user_force);
    TEST(inputs);
    TEST(failures);
    TEST(memory);
    return check_report();
}
