/* SPDX-License-Identifier: BSD-3-Clause */
/* The passes: what each one makes of a small example, and that values stay on random graphs. */
#include "base/memory.h"
#include "random.h"
#include "symbolic/cost.h"
#include "symbolic/function_table.h"
#include "symbolic/shorten.h"
#include "testing.h"
#include <math.h>

static kmp_ref q(kmp_graph *g, uint32_t k)
{
    return kmp_input(g, KMP_IN_Q, k);
}

static long operations(kmp_graph *g, int count, const kmp_ref *outputs)
{
    kmp_cost cost;
    CHECK(kmp_cost_init(&cost, g, 0));
    kmp_cost_add(&cost, count, outputs);
    long n = cost.operations;
    kmp_cost_free(&cost);
    return n;
}

static kmp_ref product(kmp_graph *g, int count, const kmp_ref *factor)
{
    kmp_ref r = KMP_ONE;
    for (int k = 0; k < count; k++)
        r = kmp_mul(g, r, factor[k]);
    return r;
}

static double value(kmp_graph *g, kmp_ref r, const double *at)
{
    double *all = KMP_NEW(double, kmp_graph_count(g));
    const double *inputs[KMP_IN_COUNT] = {[KMP_IN_Q] = at, [KMP_IN_QD] = at, [KMP_IN_PARAMETER] = at};
    kmp_graph_eval(g, inputs, all);
    double v = kmp_is_negative(r) ? -all[kmp_id(r)] : all[kmp_id(r)];
    kmp_free(all);
    return v;
}

/* -- trigonometry -------------------------------------------------------------------------------------- */

/* C2 C4 C56^2 S8 + C2 C4 S56^2 S8 - S2 S4 C56^2 S8 - S2 S4 S56^2 S8 + S2 C4 S56 C8 + C2 S4 S56 C8, the example of
 * Fisette and Samin 1996, section 3.1. */
static kmp_ref paper_example(kmp_graph *g)
{
    kmp_ref s2 = kmp_sin(g, q(g, 2)), c2 = kmp_cos(g, q(g, 2)), s4 = kmp_sin(g, q(g, 4)), c4 = kmp_cos(g, q(g, 4));
    kmp_ref q56 = kmp_add(g, q(g, 5), q(g, 6)), s56 = kmp_sin(g, q56), c56 = kmp_cos(g, q56);
    kmp_ref s8 = kmp_sin(g, q(g, 8)), c8 = kmp_cos(g, q(g, 8));
    const kmp_ref term[6][5] = {{c2, c4, c56, c56, s8}, {c2, c4, s56, s56, s8},     {s2, s4, c56, c56, s8},
                                {s2, s4, s56, s56, s8}, {s2, c4, s56, c8, KMP_ONE}, {c2, s4, s56, c8, KMP_ONE}};
    kmp_ref sum = KMP_ZERO;
    for (int k = 0; k < 6; k++) {
        kmp_ref t = product(g, 5, term[k]);
        sum = kmp_add(g, sum, k == 2 || k == 3 ? kmp_neg(t) : t);
    }
    return sum;
}

static const int runs[9] = {-1, -1, 2, -1, 2, 5, 5, -1, 8};

/* C24 S8 + S24 S56 C8 */
static void example_of_the_paper(void)
{
    static const double at[9] = {0, 0, 0.3, 0, 1.1, 0.7, -0.4, 0, 2.1};
    const kmp_parallel parallel = {runs, 9};
    kmp_graph *g = kmp_graph_new();
    kmp_ref out = paper_example(g);
    double before = value(g, out, at);
    CHECK(kmp_rewrite_alone(g, kmp_collapse_trig, &parallel, 1, &out));
    kmp_ref q24 = kmp_add(g, q(g, 2), q(g, 4)), s56 = kmp_sin(g, kmp_add(g, q(g, 5), q(g, 6)));
    kmp_ref first = kmp_mul(g, kmp_cos(g, q24), kmp_sin(g, q(g, 8)));
    CHECK(operations(g, 1, &out) == 6); /* C24 S8, two more products, their sum, two angles */
    uint32_t nodes = kmp_graph_count(g);
    kmp_ref rest = kmp_sub(g, out, first), s24 = kmp_sin(g, q24), c8 = kmp_cos(g, q(g, 8));
    kmp_ref left[3] = {kmp_mul(g, kmp_mul(g, s24, s56), c8), kmp_mul(g, kmp_mul(g, s24, c8), s56),
                       kmp_mul(g, kmp_mul(g, s56, c8), s24)};
    CHECK(rest == left[0] || rest == left[1] || rest == left[2]);
    CHECK(nodes > 0);
    CHECK_NEAR(value(g, out, at), before, 1e-14);
    kmp_graph_free(g);
}

/* Axes that are not parallel keep their angles; squares go nevertheless. */
static void unrelated_axes(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref out = paper_example(g), sum = kmp_add(g, q(g, 2), q(g, 4));
    uint32_t known = kmp_id(kmp_sin(g, sum)), known_too = kmp_id(kmp_cos(g, sum));
    CHECK(kmp_rewrite_alone(g, kmp_collapse_trig, NULL, 1, &out));
    kmp_cost cost;
    CHECK(kmp_cost_init(&cost, g, 0));
    kmp_cost_add(&cost, 1, &out);
    CHECK(cost.uses[known] == 0 && cost.uses[known_too] == 0);
    CHECK(cost.operations < 15);
    kmp_cost_free(&cost);
    kmp_graph_free(g);
}

/* A product of rotations about one axis, written out, and back: all four identities with either sign. */
static void all_identities(void)
{
    static const int together[2] = {0, 0};
    static const double at[2] = {0.4, 1.7};
    const kmp_parallel parallel = {together, 2};
    for (int k = 0; k < 32; k++) {
        kmp_graph *g = kmp_graph_new();
        kmp_ref a = q(g, 0), b = q(g, 1), x = kmp_input(g, KMP_IN_QD, 0), y = kmp_input(g, KMP_IN_QD, 1);
        kmp_ref f = k & 1 ? kmp_sin(g, a) : kmp_cos(g, a), h = k & 2 ? kmp_sin(g, b) : kmp_cos(g, b);
        kmp_ref f_ = k & 1 ? kmp_cos(g, a) : kmp_sin(g, a), h_ = k & 2 ? kmp_cos(g, b) : kmp_sin(g, b);
        kmp_ref one = kmp_mul(g, kmp_mul(g, kmp_mul(g, f, h), x), y);
        kmp_ref two = kmp_mul(g, kmp_mul(g, kmp_mul(g, f_, h_), x), y);
        one = k & 4 ? kmp_neg(one) : one;
        two = k & 8 ? kmp_neg(two) : two;
        kmp_ref out = k & 16 ? kmp_add(g, two, one) : kmp_add(g, one, two);
        double before = value(g, out, at);
        CHECK(kmp_rewrite_alone(g, kmp_collapse_trig, &parallel, 1, &out));
        CHECK_NEAR(value(g, out, at), before, 1e-15);
        CHECK(operations(g, 1, &out) == 3); /* the angle, and times x y */
        kmp_graph_free(g);
    }
}

/* -- factors and common parts -------------------------------------------------------------------------- */

static void factors(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref a = q(g, 0), b = q(g, 1), c = q(g, 2), d = q(g, 3), e = q(g, 4);
    kmp_ref ab = kmp_mul(g, a, b), ac = kmp_mul(g, a, c), de = kmp_mul(g, d, e), ad = kmp_mul(g, a, d);
    kmp_ref out = kmp_sub(g, kmp_add(g, kmp_add(g, ab, de), ac), ad);
    static const double at[5] = {1.25, 2.5, -3, 0.75, 5};
    double before = value(g, out, at);
    CHECK(operations(g, 1, &out) == 7);
    CHECK(kmp_rewrite_alone(g, kmp_factor_sums, NULL, 1, &out));
    CHECK_NEAR(value(g, out, at), before, 1e-15);
    CHECK(operations(g, 1, &out) == 5); /* a (b + c - d) + d e */
    kmp_ref shared[2] = {kmp_add(g, kmp_mul(g, b, c), kmp_mul(g, b, d)), kmp_mul(g, b, c)};
    CHECK(kmp_rewrite_alone(g, kmp_factor_sums, NULL, 2, shared)); /* b c is needed anyway */
    CHECK(operations(g, 2, shared) == 3);
    kmp_graph_free(g);
}

static void common_parts(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref a = q(g, 0), b = q(g, 1), c = q(g, 2), d = q(g, 3);
    kmp_ref sums[2] = {kmp_add(g, kmp_add(g, a, b), c), kmp_sub(g, kmp_sub(g, kmp_neg(d), a), c)};
    CHECK(kmp_rewrite_alone(g, kmp_share_sums, NULL, 2, sums));
    CHECK(operations(g, 2, sums) == 3);
    kmp_ref products[2] = {kmp_mul(g, kmp_mul(g, a, b), c), kmp_mul(g, kmp_mul(g, d, a), c)};
    CHECK(kmp_rewrite_alone(g, kmp_share_products, NULL, 2, products));
    CHECK(operations(g, 2, products) == 3);
    kmp_graph_free(g);
}

/* -- long sums and products ---------------------------------------------------------------------------- */

enum { LONG = 300 };

/* One after the other, or half and half. */
static kmp_ref join(kmp_graph *g, kmp_op op, int count, const kmp_ref *part, bool halves)
{
    if (count == 1)
        return part[0];
    int first = halves ? count / 2 : count - 1;
    kmp_ref a = join(g, op, first, part, halves), b = join(g, op, count - first, part + first, halves);
    return op == KMP_OP_ADD ? kmp_add(g, a, b) : kmp_mul(g, a, b);
}

/* More terms and factors than a pass lays out at once: none is lost. */
static void long_sums(void)
{
    const kmp_parallel parallel = {runs, 9};
    double at[LONG + 1];
    for (int k = 0; k <= LONG; k++)
        at[k] = 1 + 0.001 * k;
    for (int k = 0; k < 4; k++) {
        kmp_graph *g = kmp_graph_new();
        kmp_op op = k & 1 ? KMP_OP_ADD : KMP_OP_MUL;
        kmp_ref part[LONG];
        for (uint32_t i = 0; i < LONG; i++)
            part[i] = k & 1 ? kmp_mul(g, q(g, 0), q(g, i + 1)) : q(g, i + 1);
        kmp_ref whole = join(g, op, LONG, part, k & 2), out[2] = {whole, kmp_mul(g, q(g, 0), q(g, 1))};
        double before = value(g, whole, at);
        CHECK(kmp_shorten(g, &parallel, 2, out));
        CHECK(fabs(value(g, out[0], at) - before) <= 1e-13 * before);
        kmp_graph_free(g);
    }
}

/* -- all passes on random graphs ----------------------------------------------------------------------- */

static void values_stay(void)
{
    enum { GRAPHS = 200, OUTPUTS = 12 };
    const kmp_parallel parallel = {runs, 9};
    long before = 0, after = 0;
    for (int k = 0; k < GRAPHS; k++) {
        random_seed((uint64_t)(k + 1));
        kmp_graph *g = kmp_graph_new();
        kmp_ref pool[64], out[OUTPUTS], old[OUTPUTS];
        int count = 0;
        double at[9];
        for (uint32_t i = 0; i < 9; i++) {
            at[i] = between(0.5, 1.5);
            pool[count++] = q(g, i);
            pool[count++] = kmp_sin(g, q(g, i));
            pool[count++] = kmp_cos(g, q(g, i));
        }
        while (count < 64) {
            kmp_ref a = pool[pick(count)], b = pool[pick(count)];
            pool[count++] = pick(2) ? kmp_mul(g, a, b) : pick(2) ? kmp_add(g, a, b) : kmp_sub(g, a, b);
        }
        for (int i = 0; i < OUTPUTS; i++)
            old[i] = out[i] = pool[63 - i];
        before += operations(g, OUTPUTS, out);
        CHECK(kmp_shorten(g, &parallel, OUTPUTS, out));
        after += operations(g, OUTPUTS, out);
        for (int i = 0; i < OUTPUTS; i++)
            CHECK_NEAR(value(g, out[i], at), value(g, old[i], at), 1e-12);
        kmp_graph_free(g);
    }
    printf("   %ld operations became %ld\n", before, after);
    CHECK(after < before);
}

int main(void)
{
    TEST(example_of_the_paper);
    TEST(unrelated_axes);
    TEST(all_identities);
    TEST(factors);
    TEST(common_parts);
    TEST(long_sums);
    TEST(values_stay);
    return check_report();
}
