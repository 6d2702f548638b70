/* SPDX-License-Identifier: BSD-3-Clause */
/* States that are outputs of transfer functions, (b_1 s^(n-1) + .. + b_n) / (a_0 s^n + a_1 s^(n-1) + .. + a_n) u, by n
 * states in the observable canonical form (Kailath 1980, section 2.1), whose first one is the output:
 *
 *     x_i' = x_(i+1) + (b_i u - a_i x_1) / a_0,     x_(n+1) = 0. */
#include "model/read/reading.h"
#include <math.h>

int kmp_filter_order(const kmp_yaml *map)
{
    const kmp_yaml *a = kmp_yaml_get(map, "denominator");
    return kmp_yaml_get(map, "transfer") && a && a->kind == KMP_YAML_LIST && a->count > 2 ? a->count - 1 : 1;
}

static const kmp_expr *make(kmp_reader *r, kmp_expr expr)
{
    kmp_expr *e = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    if (e)
        *e = expr;
    return e;
}

static const kmp_expr *operation(kmp_reader *r, kmp_expr_kind kind, const kmp_expr *a, const kmp_expr *b)
{
    return make(r, (kmp_expr){.kind = kind, .a = a, .b = b});
}

static const kmp_expr *state(kmp_reader *r, int k)
{
    return make(r, (kmp_expr){.kind = KMP_EXPR_QD, .index = kmp_model_coordinates(r->model) + k});
}

static const kmp_expr *number(kmp_reader *r, const kmp_number *x)
{
    return x->expr ? x->expr : make(r, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = x->value});
}

/* The coefficients of a polynomial in falling powers of s; NULL after an error. */
static kmp_number *read_polynomial(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key, int *count)
{
    const kmp_yaml *list = kmp_read_required(r, map, what, key);
    const char *of = kmp_reader_say(r, "%s of %s", key, what);
    bool good = list && kmp_read_list(r, list, of, -1);
    *count = good ? list->count : 0;
    kmp_number *x = good ? KMP_ARENA_NEW(&r->scratch, kmp_number, *count) : NULL;
    for (int i = 0; x && i < *count; i++)
        good = kmp_read_number(r, list->items[i], of, KMP_DIM_ANY, &x[i]) && good;
    return good ? x : NULL;
}

static bool check(kmp_reader *r, const kmp_yaml *map, const char *what, const kmp_number *a, int order, int zeros)
{
    if (order < 1 || zeros > order || a[0].value == 0)
        kmp_reader_complain(r, map->place,
                            "%s: the denominator of a transfer function has a higher degree than its numerator, with a "
                            "leading coefficient that is not zero",
                            what);
    return order >= 1 && zeros <= order && a[0].value != 0;
}

void kmp_read_filter(kmp_reader *r, const kmp_yaml *map, const char *what, int first, const kmp_expr **rates)
{
    int poles, zeros;
    const kmp_yaml *node = kmp_yaml_get(map, "transfer");
    const kmp_expr *u = kmp_read_expr(r, node, kmp_reader_say(r, "transfer of %s", what), KMP_DIM_ANY, KMP_OF_LOADS);
    kmp_number *a = read_polynomial(r, map, what, "denominator", &poles);
    kmp_number *b = read_polynomial(r, map, what, "numerator", &zeros);
    int n = poles - 1;
    if (!u || !a || !b || !check(r, map, what, a, n, zeros))
        return;
    for (int i = 1; i <= n; i++) {
        const kmp_expr *own = operation(r, KMP_EXPR_MUL, number(r, &a[i]), state(r, first)), *rate = NULL;
        int at = i - 1 - (n - zeros);
        if (at >= 0)
            rate = operation(r, KMP_EXPR_MUL, number(r, &b[at]), u);
        rate = rate ? operation(r, KMP_EXPR_SUB, rate, own) : make(r, (kmp_expr){.kind = KMP_EXPR_NEG, .a = own});
        rate = operation(r, KMP_EXPR_DIV, rate, number(r, &a[0]));
        rates[i - 1] = i < n ? operation(r, KMP_EXPR_ADD, state(r, first + i), rate) : rate;
        double size = fabs(a[i].value / a[0].value);
        if (i < n)
            r->model->states[first + i].scale = r->model->states[first].scale * (size > 0 ? size : 1);
    }
}
