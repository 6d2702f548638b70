/* SPDX-License-Identifier: BSD-3-Clause */
/* Transfer functions (b_0 s^n + b_1 s^(n-1) + .. + b_n) / (a_0 s^n + a_1 s^(n-1) + .. + a_n) u as states, in the
 * observable canonical form (Kailath 1980, section 2.1):
 *
 *     y = x_1 + b_0 u / a_0,     x_i' = x_(i+1) + (b_i u - a_i y) / a_0,     x_(n+1) = 0.
 *
 * Without b_0 the output is the first state. A sampled one is a function of z in place of s: x_i' is the next value
 * of x_i, and its output is held between samples in a state of its own, before the others. */
#include "model/read/read_filters.h"
#include "model/data/model.h"
#include "model/read/function_block.h"
#include "model/read/read_states.h"
#include "model/read/read_values.h"
#include <math.h>
#include <string.h>

static int length_of(const kmp_function_block *b, const char *key)
{
    const kmp_yaml *list = kmp_yaml_get(b->map, key);
    return list && list->kind == KMP_YAML_LIST ? list->count : 0;
}

static int count_states(kmp_reader *r, kmp_function_block *b)
{
    int poles = length_of(b, "denominator");
    (void)r;
    b->direct = !b->sampled && poles > 1 && length_of(b, "numerator") == poles;
    return b->sampled ? (poles > 1 ? poles : 1) : poles > 2 ? poles - 1 : 1;
}

/* The coefficients of a polynomial in falling powers; NULL after an error. */
static kmp_number *read_polynomial(kmp_reader *r, const kmp_function_block *b, const char *key, int *count)
{
    const kmp_yaml *list = kmp_read_required(r, b->map, b->what, key);
    const char *of = kmp_reader_say(r, "%s of %s", key, b->what);
    bool good = list && kmp_read_list(r, list, of, -1);
    *count = good ? list->count : 0;
    kmp_number *x = good ? KMP_ARENA_NEW(&r->scratch, kmp_number, *count) : NULL;
    for (int i = 0; x && i < *count; i++)
        good = kmp_read_number(r, list->items[i], of, KMP_DIM_ANY, &x[i]) && good;
    return good ? x : NULL;
}

static bool check(kmp_reader *r, const kmp_function_block *b, const kmp_number *a, int order, int zeros)
{
    bool good = order >= 1 && zeros <= order + 1 && a[0].value != 0;
    if (!good)
        kmp_reader_complain(r, b->map->place,
                            "%s: the denominator of a transfer function has at least the degree of its numerator, and "
                            "1, with a leading coefficient that is not zero",
                            b->what);
    return good;
}

/* Input, output and coefficients; of the i-th state its follower too. */
typedef struct filter {
    const kmp_expr *u, *y;
    kmp_number *a, *b;
    int order, zeros;
} filter;

/* The number b_i; NULL: it is zero. */
static const kmp_expr *zero_of(kmp_reader *r, const filter *f, int i)
{
    int at = i - (f->order + 1 - f->zeros);
    return at >= 0 ? kmp_block_number(r, &f->b[at]) : NULL;
}

static const kmp_expr *law_of(kmp_reader *r, const filter *f, int i, const kmp_expr *follower)
{
    kmp_expr_locals locals = {0};
    const kmp_expr *b = zero_of(r, f, i);
    kmp_block_local(&locals, "u", f->u);
    kmp_block_local(&locals, "y", f->y);
    kmp_block_local(&locals, "a", kmp_block_number(r, &f->a[i]));
    kmp_block_local(&locals, "lead", kmp_block_number(r, &f->a[0]));
    kmp_block_local(&locals, "b", b);
    kmp_block_local(&locals, "next", follower);
    return kmp_block_formula(r,
                             follower && b ? "next + (b*u - a*y)/lead"
                             : follower    ? "next + -(a*y)/lead"
                             : b           ? "(b*u - a*y)/lead"
                                           : "-(a*y)/lead",
                             &locals);
}

/* x_1, and what the input adds to it at once. */
static const kmp_expr *output_of(kmp_reader *r, const filter *f, const kmp_expr *first)
{
    kmp_expr_locals locals = {0};
    const kmp_expr *b = zero_of(r, f, 0);
    kmp_block_local(&locals, "u", f->u);
    kmp_block_local(&locals, "first", first);
    kmp_block_local(&locals, "lead", kmp_block_number(r, &f->a[0]));
    kmp_block_local(&locals, "b", b);
    return b ? kmp_block_formula(r, "first + b*u/lead", &locals) : first;
}

static void read_transfer(kmp_reader *r, kmp_function_block *b)
{
    int poles;
    filter f = {.u = kmp_block_input(r, b)};
    f.a = read_polynomial(r, b, "denominator", &poles);
    f.b = read_polynomial(r, b, "numerator", &f.zeros);
    f.order = poles - 1;
    if (!f.u || !f.a || !f.b || !check(r, b, f.a, f.order, f.zeros))
        return;
    int held = b->sampled; /* the state that holds the output comes before the others */
    f.y = output_of(r, &f, kmp_block_state(r, b, held));
    if (b->direct)
        kmp_block_value(r, b, f.y);
    if (held) {
        kmp_block_law(r, b, 0, f.y);
        r->model->states[b->first + held].start = r->model->states[b->first].start;
    }
    for (int i = 1; i <= f.order; i++) {
        kmp_block_law(r, b, held + i - 1, law_of(r, &f, i, i < f.order ? kmp_block_state(r, b, held + i) : NULL));
        if (!held) {
            double size = fabs(f.a[i].value / f.a[0].value);
            kmp_state *states = r->model->states + b->first;
            if (i < f.order)
                states[i].scale = states[0].scale * (size > 0 ? size : 1);
        }
    }
}

const kmp_block_kind kmp_block_transfer = {"transfer", " numerator denominator sample ", count_states, NULL,
                                           read_transfer};
