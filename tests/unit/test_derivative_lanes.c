/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives at many states have the bits of single ones, in lanes and one at a time, with names and outputs; which
 * models run in lanes; the columns of the matrices are the products with unit directions; the state that the workspace
 * keeps. */
/* wings: analyses */
#include "analyses/derivatives/state_derivatives.h"
#include "base/memory.h"
#include "loaded.h"
#include <kempe/check.h>
#include <kempe/extend.h>
#include <stdlib.h>

enum { COUNT = 525, MOST = 64, MEMBERS = sizeof(kempe_workspace_derivatives) / sizeof(double *) };

typedef struct table {
    loaded l;
    int n, m, p, names, outputs;
    double *t, *q, *qd, *Q, *qdd, *lambda;
    kempe_workspace *many, *one;
    int width[MEMBERS];                     /* of the matrices, in their order */
    double *all[MEMBERS], *single[MEMBERS]; /* at all states, at one */
} table;

static double *room(int count, int width)
{
    double *x = calloc((size_t)count * (size_t)width + 1, sizeof *x);
    CHECK(x != NULL);
    return x;
}

/* The matrices wanted: in all coordinates, along closed motions, or both; NULL: not wanted. */
static kempe_workspace_derivatives wanted(double *const *from, bool all, bool closed)
{
    const bool wants[MEMBERS] = {all,    all,    all,    all, all, all,    closed, closed,
                                 closed, closed, closed, all, all, closed, closed, closed,
                                 true,   all,    all,    all, all, closed, closed, closed};
    double *member[MEMBERS];
    kempe_workspace_derivatives out;
    for (int k = 0; k < MEMBERS; k++)
        member[k] = wants[k] ? from[k] : NULL;
    memcpy(&out, member, sizeof out);
    return out;
}

/* Closed states around the start. */
static table table_of(loaded l, int names, const char *const *name, const char *outputs)
{
    table s = {.l = l, .n = l.system->n, .m = l.system->m, .names = names};
    kempe_assembly *start = NULL;
    int hold[MOST] = {0};
    CHECK(s.n <= MOST && kempe_assembly_new(l.system, &start) == KEMPE_OK);
    kempe_workspace **const made[] = {&s.many, &s.one};
    for (int k = 0; k < 2; k++) {
        CHECK(kempe_workspace_new(l.system, made[k]) == KEMPE_OK);
        CHECK(kempe_workspace_add_derivatives(*made[k], names, name, outputs) == KEMPE_OK);
    }
    const int n = s.n, m = s.m, p = s.p = kempe_workspace_independent_count(s.one), k = names,
              y = s.outputs = kempe_workspace_output_count(s.one);
    const int width[MEMBERS] = {n * n, n * n, n * n, m * n, m * n, m * n, p * p, p * p, p * n, n * p, n * p, n * k,
                                m * k, p * k, n * k, n * k, y,     y * n, y * n, y * n, y * k, y * p, y * p, y * k};
    memcpy(s.width, width, sizeof width);
    for (int i = 0; i < MEMBERS; i++) {
        s.all[i] = room(COUNT, width[i]);
        s.single[i] = room(1, width[i]);
    }
    s.t = room(COUNT, 1);
    double **const rows[] = {&s.q, &s.qd, &s.Q, &s.qdd};
    for (int i = 0; i < 4; i++)
        *rows[i] = room(COUNT, n);
    s.lambda = room(COUNT, m);
    for (int i = 0; i < p; i++)
        hold[kempe_workspace_independent(s.one)[i]] = 1;
    for (int at = 0; at < COUNT; at++) {
        double *q = s.q + at * n, *qd = s.qd + at * n;
        s.t[at] = 1e-3 * at;
        for (int i = 0; i < n; i++) {
            q[i] = kempe_assembly_q(start)[i] + 0.02 * sin(0.3 * at + i);
            qd[i] = kempe_assembly_qd(start)[i] + cos(0.7 * at - i);
            s.Q[at * n + i] = sin(0.9 * at + 2 * i);
        }
        CHECK(kempe_workspace_close(s.one, s.t[at], q, qd, hold) == KEMPE_OK);
    }
    kempe_assembly_free(start);
    return s;
}

static void table_free(table *s)
{
    double *all[] = {s->t, s->q, s->qd, s->Q, s->qdd, s->lambda};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++)
        free(all[k]);
    for (int k = 0; k < MEMBERS; k++) {
        free(s->all[k]);
        free(s->single[k]);
    }
    kempe_workspace_free(s->many);
    kempe_workspace_free(s->one);
    unload(&s->l);
}

static bool same(const double *rows, int width, int row, const double *values)
{
    return width == 0 || memcmp(rows + (ptrdiff_t)row * width, values, (size_t)width * sizeof *rows) == 0;
}

/* The number of the first `count` states at which something differs from a single call. */
static int count_differences(table *s, int count, const double *Q, bool all, bool closed)
{
    const kempe_workspace_derivatives rows = wanted(s->all, all, closed), out = wanted(s->single, all, closed);
    double qdd[MOST], lambda[MOST];
    int differences = 0, failed = 5;
    CHECK(kempe_workspace_derivative_states(s->many, count, s->t, 1, s->q, s->qd, Q, s->qdd, s->lambda, &rows,
                                            &failed) == KEMPE_OK);
    CHECK(failed == -1);
    for (int k = 0; k < count; k++) {
        const ptrdiff_t at = (ptrdiff_t)k * s->n;
        double *member[MEMBERS];
        CHECK(kempe_workspace_forward_derivatives(s->one, s->t[k], s->q + at, s->qd + at, Q ? Q + at : NULL, qdd,
                                                  lambda, &out) == KEMPE_OK);
        memcpy(member, &out, sizeof out);
        bool agree = same(s->qdd, s->n, k, qdd) && same(s->lambda, s->m, k, lambda);
        for (int i = 0; i < MEMBERS; i++)
            agree = agree && (!member[i] || same(s->all[i], s->width[i], k, member[i]));
        differences += !agree;
    }
    return differences;
}

static bool in_lanes(const table *s)
{
    const kmp_state_derivatives *d = s->many->derivatives.self;
    return d->many.ready && d->many.names_ready;
}

/* The workspaces keep the same last state. */
static bool keep(const table *s)
{
    return memcmp(kempe_workspace_mass(s->many), kempe_workspace_mass(s->one),
                  (size_t)(s->n * s->n) * sizeof(double)) == 0 &&
           memcmp(kempe_workspace_jacobian(s->many), kempe_workspace_jacobian(s->one),
                  (size_t)(s->m * s->n) * sizeof(double)) == 0 &&
           memcmp(kempe_workspace_bias(s->many), kempe_workspace_bias(s->one), (size_t)s->n * sizeof(double)) == 0 &&
           kempe_workspace_kinetic(s->many) == kempe_workspace_kinetic(s->one) &&
           kempe_workspace_potential(s->many) == kempe_workspace_potential(s->one);
}

/* Checks that the model runs in lanes, since the comparison would pass without them. */
static void all_states(table s, bool lanes)
{
    CHECK(count_differences(&s, 9, s.Q, true, true) == 0 && !in_lanes(&s));
    CHECK(count_differences(&s, COUNT - 2, s.Q, true, true) == 0 && in_lanes(&s) == lanes);
    CHECK(keep(&s));
    CHECK(count_differences(&s, 16, NULL, true, false) == 0 && keep(&s));
    CHECK(count_differences(&s, 24, s.Q, false, true) == 0 && keep(&s));
    table_free(&s);
}

static void in_groups(void)
{
    static const char *const models[] = {"examples/andrews/andrews.yaml", "tests/models/bricard_balls.yaml",
                                         "examples/stewart/stewart.yaml", "examples/suspension/suspension.yaml",
                                         "examples/stewart/driven.yaml"};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        printf("  %s\n", models[k]);
        all_states(table_of(load(models[k]), 0, NULL, NULL), true);
    }
}

static void names_and_outputs(void)
{
    static const char *const names[] = {"crank", "coupler_mass", "rocker_mass"};
    static const char words[] = "position(coupler.C), velocity(coupler.C), acceleration(coupler.C), reaction(crank)";
    all_states(table_of(load("examples/four_bar/four_bar.yaml"), 3, names, words), true);
    all_states(table_of(load("examples/four_bar/four_bar.yaml"), 0, NULL, words), true);
    /* Other names after lanes were made. */
    table s = table_of(load("examples/four_bar/four_bar.yaml"), 3, names, words);
    CHECK(count_differences(&s, COUNT, s.Q, true, true) == 0 && in_lanes(&s));
    static const char *const others[] = {"coupler", "crank_mass", "rocker"};
    CHECK(kempe_workspace_add_derivatives(s.many, 3, others, words) == KEMPE_OK && !in_lanes(&s));
    CHECK(kempe_workspace_add_derivatives(s.one, 3, others, words) == KEMPE_OK);
    CHECK(count_differences(&s, 32, s.Q, true, true) == 0 && in_lanes(&s));
    table_free(&s);
}

static int brake(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)user, (void)q;
    effort[0] = -t * qd[0];
    return 0;
}

static void one_at_a_time(void)
{
    all_states(table_of(load("tests/models/pendulum_stops.yaml"), 0, NULL, NULL), false);
    loaded l = load("examples/four_bar/four_bar.yaml");
    kempe_system_set_force(l.system, brake, NULL);
    all_states(table_of(l, 0, NULL, NULL), false);
}

/* The value of an input, of samples and of the caller, by which derivatives are taken, too. */
static void inputs(void)
{
    static const char *const names[] = {"u"};
    table s = table_of(load_text("kempe: 1\n"
                                 "inputs: {u: {unit: N, t: [0, 0.1, 0.5, 2], value: [1, 2, -3, 5], method: hold}}\n"
                                 "bodies: {cart: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                                 "forces: {drive: {joint: x, force: u*(1 + q(x))}}\n"),
                       1, names, NULL);
    CHECK(count_differences(&s, COUNT, s.Q, true, true) == 0 && in_lanes(&s));
    kempe_workspace *const both[] = {s.many, s.one};
    for (int k = 0; k < 2; k++)
        CHECK(kempe_workspace_set_input(both[k], 0, 0, 7, 1, 2) == KEMPE_OK);
    CHECK(count_differences(&s, 64, s.Q, true, true) == 0);
    CHECK(fabs(s.all[0][0] - 3.5) < 1e-14);
    table_free(&s);
}

/* The first state that fails ends the call; what lies before it is complete, also in its group. */
static void failures(void)
{
    table s = table_of(load("examples/andrews/andrews.yaml"), 0, NULL, NULL);
    const kempe_workspace_derivatives rows = wanted(s.all, false, true);
    CHECK(count_differences(&s, COUNT, s.Q, true, true) == 0 && in_lanes(&s));
    for (int bad = 0; bad < 2; bad++) { /* no number, and open loops */
        double *q = s.q + (ptrdiff_t)333 * s.n + 2, kept = *q;
        int failed = 0;
        *q = bad == 0 ? NAN : kept + 0.1;
        memset(s.all[6], 0, (size_t)COUNT * (size_t)s.width[6] * sizeof *s.all[6]);
        CHECK(kempe_workspace_derivative_states(s.many, COUNT, s.t, 1, s.q, s.qd, s.Q, s.qdd, s.lambda, &rows,
                                                &failed) == KEMPE_E_FAILED);
        CHECK(failed == 333 && strlen(kempe_workspace_message(s.many)) > 0);
        CHECK(s.all[6][332] != 0 && s.all[6][333] == 0 && s.width[6] == 1);
        CHECK(count_differences(&s, 333, s.Q, false, true) == 0);
        *q = kept;
    }
    CHECK(count_differences(&s, COUNT, s.Q, false, true) == 0);
    CHECK_TEXT(kempe_workspace_message(s.many), "");
    table_free(&s);
}

/* The lanes are the only allocation. */
static void memory(void)
{
    table s = table_of(load("examples/four_bar/four_bar.yaml"), 0, NULL, NULL);
    CHECK(count_differences(&s, COUNT, s.Q, true, true) == 0 && in_lanes(&s));
    unsigned long before = kmp_memory_count();
    CHECK(count_differences(&s, COUNT, s.Q, true, true) == 0);
    CHECK(kmp_memory_count() == before);
    table_free(&s);
}

/* True if `rows` numbers equal a column of a matrix. */
static bool is_column(const double *matrix, int rows, int column, const double *values)
{
    bool equal = true;
    for (int i = 0; i < rows; i++)
        equal = equal && matrix[i + (ptrdiff_t)column * rows] == values[i];
    return equal;
}

/* Columns of the matrices beside products with unit directions, which have loops of their own, to the bit. */
static void columns(void)
{
    static const char *const models[] = {"examples/four_bar/four_bar.yaml", "examples/stewart/stewart.yaml",
                                         "examples/suspension/suspension.yaml", "examples/limousine/limousine.yaml"};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        printf("  %s\n", models[k]);
        table s = table_of(load(models[k]), 0, NULL, NULL);
        const kempe_workspace_derivatives out = wanted(s.single, true, true);
        double unit[MOST] = {0}, qdd[MOST], lambda[MOST];
        double change[MOST], pull[MOST], dqd[MOST];
        const double *q = s.q + 5 * s.n, *qd = s.qd + 5 * s.n, *Q = s.Q + 5 * s.n;
        const int *u = kempe_workspace_independent(s.one);
        CHECK(kempe_workspace_forward_derivatives(s.one, s.t[5], q, qd, Q, qdd, lambda, &out) == KEMPE_OK);
        const kempe_state_direction along[] = {{.q = unit}, {.qd = unit}, {.Q = unit}, {.u = unit}, {.ud = unit}};
        double *const by[] = {out.qdd_q, out.qdd_qd, out.qdd_Q, out.udd_u, out.udd_ud};
        double *const pulls[] = {out.lambda_q, out.lambda_qd, out.lambda_Q};
        for (int kind = 0; kind < 5; kind++)
            for (int j = 0; j < (kind < 3 ? s.n : s.p); j++) {
                unit[j] = 1;
                CHECK(kempe_workspace_forward_jvp(s.one, s.t[5], q, qd, Q, &along[kind], NULL,
                                                  &(kempe_forward_values){.qdd = change, .lambda = pull, .qd = dqd}) ==
                      KEMPE_OK);
                unit[j] = 0;
                if (kind < 3) {
                    CHECK(is_column(by[kind], s.n, j, change) && is_column(pulls[kind], s.m, j, pull));
                    continue;
                }
                double udd[MOST];
                for (int i = 0; i < s.p; i++)
                    udd[i] = change[u[i]];
                CHECK(is_column(by[kind], s.p, j, udd));
                CHECK(kind == 4 || is_column(out.qd_u, s.n, j, dqd));
            }
        table_free(&s);
    }
}

/* A derivative without a limit is no number along directions that move its coordinate, and counts in no other one, also
 * where directions share registers. */
static void no_limit(void)
{
    loaded l = load_text("kempe: 1\n"
                         "bodies:\n"
                         "  a: {joint: {prismatic: x, at: ground}, mass: 1}\n"
                         "  b: {joint: {prismatic: x, at: ground}, mass: 2}\n"
                         "  c: {joint: {prismatic: x, at: ground}, mass: 3}\n"
                         "  d: {joint: {prismatic: x, at: ground}, mass: 4}\n"
                         "loops:\n"
                         "  first: {coupler: {a: 1, b: -2}}\n"
                         "  other: {coupler: {c: 1, d: -3}}\n"
                         "forces: {one: {joint: a, force: \"-sqrt(q(a))\"}, root: {joint: b, force: \"-sqrt(q(b))\"}, "
                         "pull: {joint: d, force: \"-5*q(d)\"}}\n");
    kempe_workspace *ws = NULL;
    CHECK(kempe_workspace_new(l.system, &ws) == KEMPE_OK &&
          kempe_workspace_add_derivatives(ws, 0, NULL, NULL) == KEMPE_OK);
    const double q[4] = {0}, qd[4] = {0};
    double qdd[4], udd_u[4];
    const int *u = kempe_workspace_independent(ws);
    CHECK(kempe_workspace_independent_count(ws) == 2 && u[0] / 2 == 0 && u[1] / 2 == 1);
    const kempe_workspace_derivatives out = {.udd_u = udd_u};
    CHECK(kempe_workspace_forward_derivatives(ws, 0, q, qd, NULL, qdd, NULL, &out) == KEMPE_OK);
    CHECK(!isfinite(udd_u[0]) && udd_u[2] == 0 && udd_u[3] < 0 && isfinite(udd_u[3]));
    kempe_workspace_free(ws);
    unload(&l);
}

int main(void)
{
    TEST(in_groups);
    TEST(names_and_outputs);
    TEST(one_at_a_time);
    TEST(inputs);
    TEST(failures);
    TEST(memory);
    TEST(columns);
    TEST(no_limit);
    return check_report();
}
