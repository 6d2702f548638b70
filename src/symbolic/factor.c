/* SPDX-License-Identifier: BSD-3-Clause */
/* Each sum is expanded to terms, each term that only the sum needs to factors. The factor of most terms is extracted,
 * and their remainder is treated as a separate sum, until no factor is common to two terms. */
#include "symbolic/shorten.h"
#include <string.h>

enum { MOST_FACTORS = 12, MOST_TALLIED = KMP_MOST_TERMS * MOST_FACTORS, MOST_SLOTS = 4096 /* over twice as many */ };
enum { ALONE = UINT16_MAX }; /* of a factor that is in no other term */

/* A term of a sum: a product, or one reference. */
typedef struct term {
    kmp_ref whole, sign; /* its rewritten form, as long as no factor is extracted; the sign of the factors */
    kmp_ref factor[MOST_FACTORS];
    uint16_t number[MOST_FACTORS]; /* of each factor in the tally, before one is extracted; or ALONE */
    int count;                     /* 0: not taken apart */
    uint32_t bits;                 /* of all factors: most terms without a factor lack its bit */
    bool reduced, taken;           /* a factor is out; it is in the sum already */
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

static kmp_ref value_of(kmp_graph *g, const term *t)
{
    if (!t->reduced)
        return t->whole;
    kmp_ref r = KMP_ONE;
    for (int k = t->count; k-- > 0;)
        r = kmp_mul(g, r, t->factor[k]);
    return r ^ t->sign;
}

/* The factors of a sum, by numbers. */
typedef struct tally {
    kmp_ref factor[MOST_TALLIED];
    uint8_t terms[MOST_TALLIED]; /* that have it and are not yet in the sum */
    uint16_t slot[MOST_SLOTS];   /* number + 1, 0: free */
    uint32_t slots;              /* a power of two */
    int count;
} tally;

static uint16_t number_of(tally *y, kmp_ref factor)
{
    uint32_t k = (factor * UINT32_C(0x9e3779b1) >> 15) & (y->slots - 1);
    for (; y->slot[k]; k = (k + 1) & (y->slots - 1))
        if (y->factor[y->slot[k] - 1] == factor)
            return (uint16_t)(y->slot[k] - 1);
    y->factor[y->count] = factor;
    y->terms[y->count++] = 0;
    y->slot[k] = (uint16_t)y->count;
    return (uint16_t)(y->count - 1);
}

/* Counts a term more or less for each of its factors, once for one that it has twice. */
static void count_term(tally *y, const term *t, int change)
{
    for (int k = 0; k < t->count; k++) {
        bool again = t->number[k] == ALONE;
        for (int j = 0; j < k && !again; j++)
            again = t->number[j] == t->number[k];
        if (!again)
            y->terms[t->number[k]] = (uint8_t)(y->terms[t->number[k]] + change);
    }
}

/* Numbers the factors. False: no two terms have a common one, by their bits. */
static bool count_factors(tally *y, term *terms, int count)
{
    uint32_t once = 0, twice = 0, all = 0;
    for (int i = 0; i < count; i++) {
        twice |= once & terms[i].bits;
        once |= terms[i].bits;
        all += (uint32_t)terms[i].count;
    }
    if (!twice)
        return false;
    for (y->slots = 16; y->slots < 2 * all;)
        y->slots *= 2;
    memset(y->slot, 0, y->slots * sizeof *y->slot);
    y->count = 0;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < terms[i].count; k++)
            terms[i].number[k] = twice & bit_of(terms[i].factor[k]) ? number_of(y, terms[i].factor[k]) : ALONE;
        count_term(y, &terms[i], 1);
    }
    return true;
}

/* The factor that most terms have, the first of several; KMP_ZERO when none is in two. */
static kmp_ref common_factor(const kmp_graph *g, const tally *y, const term *terms, int count)
{
    kmp_ref best = KMP_ZERO;
    int most = 1;
    double number;
    for (int i = 0; i + most < count; i++)
        for (int k = 0; !terms[i].taken && k < terms[i].count; k++) {
            uint16_t f = terms[i].number[k];
            if (f != ALONE && y->terms[f] > most && !kmp_is_const(g, y->factor[f], &number)) {
                most = y->terms[f];
                best = y->factor[f];
            }
        }
    return best;
}

/* The sum of the terms, factors taken out while two terms share one, `f` first. */
static kmp_ref sum_of(kmp_graph *g, tally *y, term *terms, int count, kmp_ref f)
{
    kmp_ref sum = KMP_ZERO;
    for (; f != KMP_ZERO; f = common_factor(g, y, terms, count)) {
        kmp_ref inner = KMP_ZERO;
        for (int i = 0; i < count; i++)
            if (!terms[i].taken && has(&terms[i], f)) {
                terms[i].taken = true;
                count_term(y, &terms[i], -1);
                term *t = &terms[i];
                int k = 0;
                while (t->factor[k] != f)
                    k++;
                t->factor[k] = t->factor[--t->count];
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

/* True if a term is taken apart: no other node needs the product. */
static bool comes_apart(const kmp_rewrite *r, kmp_ref x)
{
    return kmp_graph_node(r->graph, kmp_id(x))->op == KMP_OP_MUL && r->uses[kmp_id(x)] == 1;
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
    if (!comes_apart(r, x))
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
    tally y;
    kmp_ref list[KMP_MOST_TERMS], sign = 0;
    (void)user;
    int count = kmp_rewrite_flatten(r, KMP_OP_ADD, id << 1, list, &sign);
    int products = 0;
    for (int k = 0; k < count; k++)
        products += comes_apart(r, list[k]);
    if (products < 2)
        return kmp_rewrite_node(r, id);
    for (int k = 0; k < count; k++)
        set_term(r, list[k], &terms[k]);
    kmp_ref f = count_factors(&y, terms, count) ? common_factor(r->graph, &y, terms, count) : KMP_ZERO;
    return f == KMP_ZERO ? kmp_rewrite_node(r, id) : sum_of(r->graph, &y, terms, count, f);
}

bool kmp_factor_sums(kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    (void)parallel;
    return kmp_rewrite_sums(r, rewrite_sum, NULL, 0, count, outputs);
}
