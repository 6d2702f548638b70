/* SPDX-License-Identifier: BSD-3-Clause */
/* A sum is expanded to monomials, factors in order of their numbers. The partner that a rule needs is found by its
 * factors; every rule removes a term, so that the pass ends. Squares are first: they leave less work. */
#include "symbolic/cost.h"
#include "symbolic/function_table.h"
#include "symbolic/shorten.h"
#include "symbolic/trig.h"
#include <string.h>

enum { MOST_TERMS = 64, MOST_FACTORS = 16 };

typedef struct monomial {
    double coefficient;
    kmp_ref factor[MOST_FACTORS]; /* without sign, in order */
    int count;
} monomial;

typedef struct sum {
    kmp_graph *g;
    const kmp_parallel *parallel;
    monomial term[MOST_TERMS];
    int count;
} sum;

static kmp_op op_of(const kmp_graph *g, kmp_ref r)
{
    return (kmp_op)kmp_graph_node(g, kmp_id(r))->op;
}

static bool is_trig(const kmp_graph *g, kmp_ref r)
{
    return op_of(g, r) == KMP_OP_SIN || op_of(g, r) == KMP_OP_COS;
}

static kmp_ref angle_of(const kmp_graph *g, kmp_ref r)
{
    return kmp_graph_node(g, kmp_id(r))->a;
}

/* -- monomials --------------------------------------------------------------------------------------- */

static bool put_factor(monomial *m, kmp_ref f)
{
    int k = m->count;
    if (k == MOST_FACTORS)
        return false;
    for (; k > 0 && m->factor[k - 1] > f; k--)
        m->factor[k] = m->factor[k - 1];
    m->factor[k] = f;
    m->count++;
    return true;
}

static void remove_factor(monomial *m, int k)
{
    memmove(m->factor + k, m->factor + k + 1, (size_t)(--m->count - k) * sizeof *m->factor);
}

/* The factors of x, shared products too; numbers go to the coefficient. */
static bool add_factors(const kmp_graph *g, kmp_ref x, monomial *m)
{
    double number;
    const kmp_node *n = kmp_graph_node(g, kmp_id(x));
    m->coefficient *= kmp_is_negative(x) ? -1 : 1;
    x &= ~(kmp_ref)1;
    if (kmp_is_const(g, x, &number)) {
        m->coefficient *= number;
        return true;
    }
    if (n->op != KMP_OP_MUL)
        return put_factor(m, x);
    kmp_ref a = n->a, b = n->b;
    return add_factors(g, a, m) && add_factors(g, b, m);
}

/* Another term with these factors, -1: none. */
static int find(const sum *s, const monomial *m, int except)
{
    for (int k = 0; k < s->count; k++)
        if (k != except && s->term[k].count == m->count &&
            memcmp(s->term[k].factor, m->factor, (size_t)m->count * sizeof *m->factor) == 0)
            return k;
    return -1;
}

static void remove_term(sum *s, int k)
{
    memmove(s->term + k, s->term + k + 1, (size_t)(--s->count - k) * sizeof *s->term);
}

/* Adds m to the term with the same factors. */
static bool put_term(sum *s, const monomial *m)
{
    int k = find(s, m, -1);
    if (k < 0 && s->count == MOST_TERMS)
        return false;
    if (k < 0) {
        s->term[s->count++] = *m;
        return true;
    }
    s->term[k].coefficient += m->coefficient;
    if (s->term[k].coefficient == 0)
        remove_term(s, k);
    return true;
}

/* -- rules ------------------------------------------------------------------------------------------- */

/* sin for cos of the same angle and the reverse; the node may be new. */
static kmp_ref other(kmp_graph *g, kmp_ref f)
{
    kmp_ref angle = angle_of(g, f);
    return op_of(g, f) == KMP_OP_SIN ? kmp_cos(g, angle) : kmp_sin(g, angle);
}

/* Replaces two terms by one that equals their sum. */
static void replace(sum *s, int i, int j, const monomial *by)
{
    remove_term(s, i > j ? i : j);
    remove_term(s, i > j ? j : i);
    (void)put_term(s, by);
}

/* x cos^2 a + x sin^2 a */
static bool drop_square(sum *s, int i)
{
    for (int k = 0; k + 1 < s->term[i].count; k++) {
        kmp_ref f = s->term[i].factor[k];
        if (s->term[i].factor[k + 1] != f || !is_trig(s->g, f))
            continue;
        monomial rest = s->term[i], partner;
        remove_factor(&rest, k);
        remove_factor(&rest, k);
        partner = rest;
        (void)put_factor(&partner, other(s->g, f));
        (void)put_factor(&partner, other(s->g, f));
        int j = find(s, &partner, i);
        if (j < 0 || s->term[j].coefficient != s->term[i].coefficient)
            continue;
        replace(s, i, j, &rest);
        return true;
    }
    return false;
}

/* The run that an angle's coordinates belong to, -1 when they do not belong together. */
static int run_of(const sum *s, kmp_ref angle)
{
    const kmp_node *n = kmp_graph_node(s->g, kmp_id(angle));
    if (n->op == KMP_OP_INPUT)
        return n->a == KMP_IN_Q && s->parallel && (int)n->b < s->parallel->count ? s->parallel->run[n->b] : -1;
    if (n->op != KMP_OP_ADD)
        return -1;
    int a = run_of(s, n->a), b = run_of(s, n->b);
    return a == b ? a : -1;
}

/* k f(a) g(b) + l f'(a) g'(b) with cosines and sines exchanged, |k| = |l|. */
static bool add_angles(sum *s, int i, int p, int q)
{
    kmp_graph *g = s->g;
    kmp_ref f = s->term[i].factor[p], h = s->term[i].factor[q], a = angle_of(g, f), b = angle_of(g, h);
    if (a == b || run_of(s, a) < 0 || run_of(s, a) != run_of(s, b))
        return false;
    monomial rest = s->term[i], partner;
    remove_factor(&rest, q);
    remove_factor(&rest, p);
    partner = rest;
    (void)put_factor(&partner, other(g, f));
    (void)put_factor(&partner, other(g, h));
    int j = find(s, &partner, i);
    double k = s->term[i].coefficient, l = j < 0 ? 0 : s->term[j].coefficient;
    if (l != k && l != -k)
        return false;
    bool alike = op_of(g, f) == op_of(g, h);
    if (op_of(g, f) != KMP_OP_COS && alike) { /* from the cosines' side */
        rest.coefficient = l;
        double swap = k;
        k = l;
        l = swap;
    }
    if (!alike && op_of(g, f) == KMP_OP_COS) { /* sin a cos b first */
        kmp_ref swap = a;
        a = b;
        b = swap;
    }
    bool plus = alike ? l == -k : l == k;
    kmp_ref angle = kmp_angle_add(g, a, plus ? b : kmp_neg(b)), made = alike ? kmp_cos(g, angle) : kmp_sin(g, angle);
    if (!add_factors(g, made, &rest))
        return false;
    replace(s, i, j, &rest);
    return true;
}

static bool apply_rules(sum *s)
{
    for (int i = 0; i < s->count; i++)
        if (drop_square(s, i))
            return true;
    for (int i = 0; i < s->count; i++)
        for (int q = 0; q < s->term[i].count; q++)
            for (int p = 0; p < q; p++)
                if (is_trig(s->g, s->term[i].factor[p]) && is_trig(s->g, s->term[i].factor[q]) &&
                    add_angles(s, i, p, q))
                    return true;
    return false;
}

/* -- sums -------------------------------------------------------------------------------------------- */

/* Sines and cosines among the factors of x, of which `left` may still be visited. */
static int count_trig(const kmp_graph *g, kmp_ref x, int *left)
{
    const kmp_node *n = kmp_graph_node(g, kmp_id(x));
    if (n->op != KMP_OP_MUL)
        return (*left)-- > 0 && is_trig(g, x);
    int first = count_trig(g, n->a, left);
    return *left > 0 ? first + count_trig(g, n->b, left) : first;
}

/* Two squares, or a product of each angle's, are the least that a rule applies to. */
enum { FEWEST_TRIG = 4 };

/* The axes, and the sines and cosines among the factors of each needed node before the pass, at most FEWEST_TRIG. The
 * coefficients of a sum are the sum of its terms'. */
typedef struct axes_and_trig {
    const kmp_parallel *parallel;
    uint8_t *trig, *of_terms;
} axes_and_trig;

static uint8_t trig_of(const kmp_graph *g, const uint8_t *trig, uint32_t id)
{
    const kmp_node *n = kmp_graph_node(g, id);
    if (n->op != KMP_OP_MUL)
        return n->op == KMP_OP_SIN || n->op == KMP_OP_COS;
    int found = trig[kmp_id(n->a)] + trig[kmp_id(n->b)];
    return (uint8_t)(found < FEWEST_TRIG ? found : FEWEST_TRIG);
}

/* False if the terms have too few sines and cosines, as most have; a term that has changed may have any number. */
static bool may_apply(const kmp_rewrite *r, const uint8_t *trig, int count, const kmp_ref *list)
{
    int found = 0;
    for (int k = 0; k < count; k++)
        found += kmp_rewritten(r, list[k]) == list[k] ? trig[kmp_id(list[k])] : FEWEST_TRIG;
    if (found < FEWEST_TRIG)
        return false;
    found = 0;
    for (int k = 0; k < count && found < FEWEST_TRIG; k++) {
        int left = MOST_FACTORS;
        found += count_trig(r->graph, kmp_rewritten(r, list[k]), &left);
    }
    return found >= FEWEST_TRIG;
}

static bool lay_out(const kmp_rewrite *r, int count, const kmp_ref *list, sum *s)
{
    bool ok = true;
    for (int k = 0; ok && k < count; k++) {
        monomial m;
        m.coefficient = 1;
        m.count = 0;
        ok = add_factors(r->graph, kmp_rewritten(r, list[k]), &m) && put_term(s, &m);
    }
    return ok;
}

static kmp_ref rewrite_sum(const kmp_rewrite *r, const void *user, uint32_t id)
{
    const axes_and_trig *known = user;
    /* Sines and cosines of all terms of a sum, at most FEWEST_TRIG; a term that has changed may have any number. */
    const kmp_node *n = kmp_graph_node(r->graph, id);
    int found = 0;
    for (int k = 0; k < 2; k++) {
        uint32_t below = kmp_id(kmp_operand(n, k));
        if (kmp_rewrite_expands(r, KMP_OP_ADD, below << 1))
            found += known->of_terms[below];
        else
            found += r->now[below] == below << 1 ? known->trig[below] : FEWEST_TRIG;
    }
    known->of_terms[id] = (uint8_t)(found < FEWEST_TRIG ? found : FEWEST_TRIG);
    if (known->of_terms[id] < FEWEST_TRIG)
        return kmp_rewrite_node(r, id);
    kmp_ref list[KMP_MOST_TERMS], sign = 0;
    sum s;
    s.g = r->graph;
    s.parallel = known->parallel;
    s.count = 0;
    int count = kmp_rewrite_flatten(r, KMP_OP_ADD, id << 1, list, &sign);
    if (count > MOST_TERMS || !may_apply(r, known->trig, count, list) || !lay_out(r, count, list, &s) ||
        !apply_rules(&s))
        return kmp_rewrite_node(r, id);
    while (apply_rules(&s))
        ;
    kmp_ref value = KMP_ZERO;
    for (int k = 0; k < s.count; k++) {
        kmp_ref product = KMP_ONE;
        for (int i = 0; i < s.term[k].count; i++)
            product = kmp_mul(s.g, product, s.term[k].factor[i]);
        value = kmp_add(s.g, value, kmp_mul(s.g, kmp_const(s.g, s.term[k].coefficient), product));
    }
    return value;
}

bool kmp_collapse_trig(kmp_rewrite *r, const kmp_parallel *parallel, int count, kmp_ref *outputs)
{
    axes_and_trig known = {parallel, KMP_NEW(uint8_t, r->count), kmp_realloc(NULL, r->count, 1)};
    bool made = known.trig && known.of_terms;
    for (uint32_t k = 0; made && k < r->live.top; k++) {
        uint32_t id = kmp_rewrite_live(r, k);
        known.trig[id] = trig_of(r->graph, known.trig, id);
    }
    bool ok = made && kmp_rewrite_sums(r, rewrite_sum, &known, KMP_COST_ADDITION, count, outputs);
    kmp_free(known.trig);
    kmp_free(known.of_terms);
    return ok;
}
