/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows of balls and rods by the shortest way: the values that differentiation gives, and fewer operations; and the
 * counting and the exchange of nodes that the choice rests on. */
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "random_model.h"
#include "symbolic/cost.h"
#include "symbolic/derivative.h"
#include "symbolic/function_table.h"
#include "symbolic/program.h"
#include "symbolic/substitute.h"
#include "testing.h"

enum { MODELS = 60, SETS = KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_RESIDUAL };

static void check_close(int number, const char *what, double a, double b)
{
    if (!(fabs(a - b) <= 1e-11 * fmax(1, fabs(b)))) {
        check_failures++;
        printf("model %d: %s = %.17g, differentiated %.17g\n", number, what, a, b);
    }
}

static double value_of(const double *value, kmp_ref r)
{
    return kmp_is_negative(r) ? -value[kmp_id(r)] : value[kmp_id(r)];
}

/* h differentiated once more: J, then hdot and jdqd. */
static void differentiate(kmp_equations *eq, kmp_ref *out)
{
    for (int k = 0; k < eq->n; k++) {
        kmp_ref leaf = kmp_input(eq->graph, KMP_IN_Q, (uint32_t)k), one = KMP_ONE;
        kmp_derivative *d = kmp_derivative_new(eq->graph, 1, &leaf, &one);
        for (int r = 0; r < eq->m; r++)
            out[k * eq->m + r] = kmp_derivative_of(d, eq->closures.h[r]);
        kmp_derivative_free(d);
    }
    out += eq->n * eq->m;
    for (int pass = 0; pass < 2; pass++, out += eq->m) {
        kmp_derivative *d = kmp_time_derivative(&eq->tree);
        for (int r = 0; r < eq->m; r++)
            out[r] = kmp_derivative_of(d, pass ? out[r - eq->m] : eq->closures.h[r]);
        kmp_derivative_free(d);
    }
}

static void check_rows(int number, kmp_equations *eq)
{
    static double q[MODEL_MAX_N], qd[MODEL_MAX_N], parameter[8] = {1.25, 0.875};
    static const double t = 0.3;
    for (int k = 0; k < eq->n; k++) {
        q[k] = between(-2, 2);
        qd[k] = between(-1, 1);
    }
    int n = eq->n, m = eq->m;
    kmp_ref *plain = KMP_NEW(kmp_ref, m * (n + 2));
    differentiate(eq, plain);
    double *value = KMP_NEW(double, kmp_graph_count(eq->graph));
    const double *inputs[KMP_IN_COUNT] = {[KMP_IN_PARAMETER] = parameter,
                                          [KMP_IN_TIME] = &t,
                                          [KMP_IN_Q] = q,
                                          [KMP_IN_QD] = qd,
                                          [KMP_IN_LAMBDA] = q,
                                          [KMP_IN_MU] = q,
                                          [KMP_IN_QDD] = q};
    kmp_graph_eval(eq->graph, inputs, value);
    for (int r = 0; r < m; r++) {
        for (int k = 0; k < n; k++)
            check_close(number, "J", value_of(value, eq->closures.jacobian[r * n + k]),
                        value_of(value, plain[k * m + r]));
        check_close(number, "hdot", value_of(value, eq->closures.hdot[r]), value_of(value, plain[n * m + r]));
        check_close(number, "jdqd", value_of(value, eq->closures.jdqd[r]), value_of(value, plain[n * m + m + r]));
    }
    kmp_free(plain);
    kmp_free(value);
}

static void rows_are_derivatives(void)
{
    int rows = 0;
    for (int number = 0; number < MODELS; number++) {
        unsigned flags = MODEL_LOOPS | (number % 3 ? MODEL_PLAIN : 0) | (number % 2 ? MODEL_SYMBOLS : 0);
        random_model r = random_model_new((uint64_t)(500 + number), 2 + number % 7, flags);
        kmp_equations eq;
        CHECK(r.model != NULL);
        if (r.model && kmp_equations_init(&eq, r.model, SETS, KMP_SCHEME_COMPOSITE, number % 4 == 1) == KEMPE_OK) {
            check_rows(number, &eq);
            rows += eq.m;
            kmp_equations_free(&eq);
        }
        random_model_free(&r);
    }
    printf("   %d rows\n", rows);
    CHECK(rows > 100);
}

/* -- counts -------------------------------------------------------------------------------------------- */

/* Two balls and two rods on one body behind six joints, whose other ends hang by two joints each. */
static const char carrier[] = "kempe: 1\nname: carrier\ngravity: [0, 0, -9.81]\nbodies:\n"
                              "  a: {joint: {motions: [R3, R2, R1], at: ground}, mass: 1, points: {P: [1, 2, 3]}}\n"
                              "  b: {joint: {motions: [R1, R2, R3], at: a.P}, mass: 1, points: {P: [1, 2, 4], "
                              "Q: [2, 3, 1], R: [4, 1, 2], S: [5, 6, 1]}}\n"
                              "  c: {joint: {motions: [R3, R1], at: ground}, mass: 1, points: {P: [1, 7, 3]}}\n"
                              "  d: {joint: {motions: [R3, R1], at: ground}, mass: 1, points: {P: [1, 2, 8]}}\n"
                              "  e: {joint: {revolute: y, at: ground}, mass: 1, points: {P: [3, 2, 8]}}\n"
                              "loops:\n  A: {ball: [c.P, b.P]}\n  B: {ball: [d.P, b.Q]}\n"
                              "  C: {rod: [e.P, b.R], length: 1.5}\n  D: {rod: [c.P, b.S], length: 2.5}\n";

static long operations(kmp_equations *eq, const kmp_ref *h, const kmp_ref *jacobian, const kmp_ref *jdqd)
{
    int n = eq->n, m = eq->m, count = m * (n + 2);
    kmp_ref *out = KMP_NEW(kmp_ref, count);
    memcpy(out, h, (size_t)m * sizeof *out);
    memcpy(out + m, jdqd, (size_t)m * sizeof *out);
    for (int i = 0; i < m * n; i++)
        out[2 * m + i] = jacobian[i];
    const kmp_ref *group = out;
    kmp_program *p = kmp_program_new(eq->graph, 1, &count, &group);
    long paper = kmp_program_count(p, 0, 1).paper;
    kmp_program_free(p);
    kmp_free(out);
    return paper;
}

static void points_on_one_body_share(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kmp_equations eq;
    CHECK(kempe_model_read_text(context, carrier, "carrier.yaml", &model) == KEMPE_OK);
    if (model && kmp_equations_init(&eq, model, SETS, KMP_SCHEME_COMPOSITE, false) == KEMPE_OK) {
        kmp_ref *plain = KMP_NEW(kmp_ref, eq.m * (eq.n + 2)), *jacobian = KMP_NEW(kmp_ref, eq.m * eq.n);
        long chosen = operations(&eq, eq.closures.h, eq.closures.jacobian, eq.closures.jdqd);
        differentiate(&eq, plain);
        for (int r = 0; r < eq.m; r++)
            for (int k = 0; k < eq.n; k++)
                jacobian[r * eq.n + k] = plain[k * eq.m + r];
        long derived = operations(&eq, eq.closures.h, jacobian, plain + (eq.n + 1) * eq.m);
        printf("   %ld operations, %ld by differentiation\n", chosen, derived);
        CHECK(4 * chosen < 3 * derived);
        kmp_free(plain);
        kmp_free(jacobian);
        kmp_equations_free(&eq);
    }
    kempe_model_free(model);
    kempe_context_free(context);
}

/* -- cost and exchange --------------------------------------------------------------------------------- */

static void costs_come_and_go(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_cost cost;
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), y = kmp_input(g, KMP_IN_Q, 1), z = kmp_input(g, KMP_IN_Q, 2);
    kmp_ref sum = kmp_add(g, x, y), product = kmp_mul(g, sum, z);
    CHECK(kmp_cost_init(&cost, g, KMP_COST_ADDITION));
    kmp_cost_add(&cost, 1, &product);
    CHECK(cost.operations == 2);
    kmp_ref more = kmp_mul(g, sum, sum); /* the graph grows meanwhile */
    kmp_cost_add(&cost, 1, &more);
    CHECK(cost.operations == 3);
    kmp_cost_remove(&cost, 1, &product);
    CHECK(cost.operations == 2);
    kmp_ref turned = kmp_sin(g, sum);
    kmp_cost_add(&cost, 1, &turned);
    CHECK(cost.operations == 5);
    kmp_cost_remove(&cost, 1, &turned);
    kmp_cost_remove(&cost, 1, &more);
    CHECK(cost.operations == 0);
    kmp_cost_free(&cost);
    kmp_graph_free(g);
}

static void nodes_are_exchanged(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), y = kmp_input(g, KMP_IN_QD, 1), p = kmp_input(g, KMP_IN_PARAMETER, 0);
    kmp_ref inner = kmp_mul(g, x, x), out[2] = {kmp_add(g, kmp_sin(g, inner), kmp_mul(g, p, y)), kmp_neg(inner)};
    uint16_t through;
    kmp_ref to = kmp_neg(y);
    CHECK(kmp_substitute(g, 1, &inner, &to, 2, out, &through));
    CHECK(out[0] == kmp_add(g, kmp_neg(kmp_sin(g, y)), kmp_mul(g, p, y)));
    CHECK(out[1] == y);
    CHECK(through == (1u << KMP_IN_PARAMETER | 1u << KMP_IN_QD));
    kmp_graph_free(g);
}

int main(void)
{
    TEST(rows_are_derivatives);
    TEST(points_on_one_body_share);
    TEST(costs_come_and_go);
    TEST(nodes_are_exchanged);
    return check_report();
}
