/* SPDX-License-Identifier: BSD-3-Clause */
/* Zero elimination: zeros and ones vanish, numbers are computed at once and come first in a product. */
#include "symbolic/rules/rules.h"

bool kmp_zeros_add(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref *result)
{
    double x, y;
    if (a == KMP_ZERO)
        *result = b;
    else if (b == KMP_ZERO)
        *result = a;
    else if (kmp_is_const(g, a, &x) && kmp_is_const(g, b, &y))
        *result = kmp_const(g, x + y);
    else
        return false;
    return true;
}

bool kmp_zeros_mul(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result)
{
    double x, y;
    if (a == KMP_ZERO || b == KMP_ZERO) {
        *result = KMP_ZERO;
        return true;
    }
    if (a == KMP_ONE || b == KMP_ONE) {
        *result = (a == KMP_ONE ? b : a) ^ sign;
        return true;
    }
    if (!kmp_is_const(g, a, &x))
        return false;
    if (kmp_is_const(g, b, &y)) {
        *result = kmp_const(g, sign ? -x * y : x * y);
        return true;
    }
    kmp_ref base = kmp_split_coefficient(g, b, &y);
    if (base == b)
        return false;
    *result = kmp_mul(g, kmp_const(g, sign ? -x * y : x * y), base);
    return true;
}

bool kmp_zeros_div(kmp_graph *g, kmp_ref a, kmp_ref b, kmp_ref sign, kmp_ref *result)
{
    double x, y;
    if (kmp_is_const(g, b, &y)) {
        bool number = kmp_is_const(g, a, &x);
        *result = number ? kmp_const(g, sign ? -x / y : x / y) : kmp_mul(g, a, kmp_const(g, sign ? -1 / y : 1 / y));
        return true;
    }
    *result = KMP_ZERO;
    return a == KMP_ZERO;
}
