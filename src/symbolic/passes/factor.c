/* SPDX-License-Identifier: BSD-3-Clause */
/* Each sum is expanded to terms, each term that only the sum needs to factors. The factor of most terms is extracted,
 * and their remainder is treated as a sum of its own, until no factor is common to two terms. */
#include "symbolic/passes/rewrite.h"
#include "symbolic/passes/shorten.h"

enum { MOST_FACTORS = 12 };

/* A term of a sum: a product, or one reference. */
typedef struct term {
    kmp_ref whole, sign; /* its rewritten form, as long as no factor is extracted; the sign of the factors */
    kmp_ref factor[MOST_FACTORS];
    int count;           /* 0: not taken apart */
    uint32_t bits;       /* of all factors: most terms without a factor lack its bit */
    bool reduced, taken; /* a factor is out; it is in the sum already */
} term;

static uint32_t bit_of(kmp_ref factor)
{
    return UINT32_C(1) << (factor * UINT32_C(0x9e3779b1) >> 27);
}

static bool has(const term *t, kmp_ref factor)
{
    for (int k = 0; t->bits & bit_of(factor) && k < t->count; k++)
        if (t->factor[k] == factor)
            return true;
    return false;
}

static void drop(term *t, kmp_ref factor)
{
    int k = 0;
    while (t->factor[k] != factor)
        k++;
    t->factor[k] = t->factor[--t->count];
}

static kmp_ref value_of(kmp_graph *g, const term *t)
{
    if (!t->reduced)
        return t->whole;
    kmp_ref r = KMP_ONE;
    for (int k = t->count; k-- > 0;)
        r = kmp_mul(g, r, t->factor[k]);
    return r ^ t->sign;
}

/* The number of terms with this factor; the factor itself is counted once. */
static int occurrences(const term *terms, int count, kmp_ref factor)
{
    int n = 0;
    for (int i = 0; i < count; i++)
        n += !terms[i].taken && has(&terms[i], factor);
    return n;
}

/* The factor that most terms have, the first of several; KMP_ZERO when none is in two. The terms from a factor's first
 * one on have it; as many as are left must be more than the most. */
static kmp_ref common_factor(const kmp_graph *g, const term *terms, int count)
{
    kmp_ref best = KMP_ZERO;
    int most = 1;
    double number;
    for (int i = 0; i + most < count; i++)
        for (int k = 0; !terms[i].taken && k < terms[i].count; k++) {
            kmp_ref f = terms[i].factor[k];
            int n = occurrences(&terms[i], count - i, f);
            if (n > most && !kmp_is_const(g, f, &number)) {
                most = n;
                best = f;
            }
        }
    return best;
}

/* The sum of the terms, factors taken out while two terms share one, `f` first. */
static kmp_ref sum_of(kmp_graph *g, term *terms, int count, kmp_ref f)
{
    kmp_ref sum = KMP_ZERO;
    for (; f != KMP_ZERO; f = common_factor(g, terms, count)) {
        kmp_ref inner = KMP_ZERO;
        for (int i = 0; i < count; i++)
            if (!terms[i].taken && has(&terms[i], f)) {
                terms[i].taken = true;
                drop(&terms[i], f);
                terms[i].reduced = true;
                inner = kmp_add(g, inner, value_of(g, &terms[i]));
            }
        sum = kmp_add(g, sum, kmp_mul(g, f, inner));
    }
    for (int i = 0; i < count; i++)
        if (!terms[i].taken)
            sum = kmp_add(g, sum, value_of(g, &terms[i]));
    return sum;
}

/* Term x of the sum as it became. */
static void set_term(const kmp_rewrite *r, kmp_ref x, term *t)
{
    kmp_ref list[KMP_MOST_TERMS];
    t->sign = x & 1;
    t->whole = kmp_rewritten(r, x);
    t->count = 0;
    t->bits = 0;
    t->reduced = t->taken = false;
    const kmp_node *n = kmp_graph_node(r->graph, kmp_id(x));
    if (n->op != KMP_OP_MUL || r->uses[kmp_id(x)] != 1)
        return;
    int count = kmp_rewrite_flatten(r, KMP_OP_MUL, x & ~(kmp_ref)1, list, &t->sign);
    for (int k = 0; count <= MOST_FACTORS && k < count; k++) {
        kmp_ref now = kmp_rewritten(r, list[k]);
        t->sign ^= now & 1;
        t->factor[t->count] = now & ~(kmp_ref)1;
        t->bits |= bit_of(t->factor[t->count++]);
    }
}

static kmp_ref rewrite_sum(const kmp_rewrite *r, const void *user, uint32_t id)
{
    term terms[KMP_MOST_TERMS];
    kmp_ref list[KMP_MOST_TERMS], sign = 0;
    (void)user;
    int count = kmp_rewrite_flatten(r, KMP_OP_ADD, id << 1, list, &sign);
    for (int k = 0; k < count; k++)
        set_term(r, list[k], &terms[k]);
    kmp_ref f = common_factor(r->graph, terms, count);
    return f == KMP_ZERO ? kmp_rewrite_node(r, id) : sum_of(r->graph, terms, count, f);
}

bool kmp_factor_sums(kmp_graph *g, int count, kmp_ref *outputs)
{
    return kmp_rewrite_sums(g, rewrite_sum, NULL, 0, count, outputs);
}
