/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/ranges.h"
#include "base/memory.h"
#include "model/dimension.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_VALUES = 1000000 };

/* Where one of ":," or the end is. */
static size_t word_length(const char *s)
{
    return strcspn(s, ":,");
}

/* A number with an optional sign and an optional unit, the whole of `length` characters. */
static bool read_value(const char *s, size_t length, double *x)
{
    size_t sign = *s == '-' || *s == '+', digits = kmp_text_to_number(s + sign, x), at = sign + digits;
    if (digits == 0 || at > length)
        return false;
    while (at < length && s[at] == ' ')
        at++;
    while (length > at && s[length - 1] == ' ')
        length--;
    kmp_unit unit;
    if (at < length) {
        if (!kmp_unit_find(s + at, length - at, &unit))
            return false;
        *x = *x * unit.factor / unit.divisor;
    }
    if (*s == '-')
        *x = -*x;
    return isfinite(*x);
}

static bool read_count(const char *s, size_t length, int *count)
{
    double x;
    if (!read_value(s, length, &x) || x < 2 || x > MOST_VALUES || x != floor(x))
        return false;
    *count = (int)x;
    return true;
}

/* NAME=A[:B[:N]] up to a comma or the end, where *s is left. KEMPE_E_ARGUMENT without a sentence. */
static kempe_status read_range(const char **s, kmp_range *r)
{
    size_t length = strcspn(*s, "=,");
    kmp_text name = {0};
    if (length == 0 || (*s)[length] != '=')
        return KEMPE_E_ARGUMENT;
    kmp_text_printf(&name, "%.*s", (int)length, *s);
    *s += length + 1;
    r->name = kmp_text_take(&name);
    if (!r->name)
        return KEMPE_E_MEMORY;
    r->count = 1;
    bool ok = read_value(*s, length = word_length(*s), &r->from);
    *s += length;
    r->to = r->from;
    if (ok && **s == ':') {
        r->count = 0;
        ok = read_value(*s + 1, length = word_length(*s + 1), &r->to);
        *s += length + 1;
    }
    if (ok && **s == ':') {
        ok = read_count(*s + 1, length = word_length(*s + 1), &r->count);
        *s += length + 1;
    }
    return ok && **s != ':' ? KEMPE_OK : KEMPE_E_ARGUMENT;
}

kempe_status kmp_ranges_read(kempe_context *context, const char *text, kmp_ranges *ranges)
{
    int most = 1;
    kempe_status status = KEMPE_OK;
    for (const char *s = text; *s; s++)
        most += *s == ',';
    kmp_ranges read = {0, KMP_NEW(kmp_range, most)};
    if (!read.range)
        return kmp_fail_memory(context);
    for (const char *s = text; status == KEMPE_OK && read.count < most; s += *s == ',') {
        const char *begin = s;
        status = read_range(&s, &read.range[read.count++]);
        if (status == KEMPE_E_ARGUMENT)
            (void)kmp_fail(context, status,
                           "a range is written NAME=A:B or NAME=A:B:N (N values, 2 or more), with commas between "
                           "several; not '%s'",
                           begin);
        else if (status == KEMPE_E_MEMORY)
            (void)kmp_fail_memory(context);
    }
    if (status == KEMPE_OK)
        *ranges = read;
    else
        kmp_ranges_free(&read);
    return status;
}

void kmp_ranges_free(kmp_ranges *ranges)
{
    for (int k = 0; k < ranges->count; k++)
        kmp_free(ranges->range[k].name);
    kmp_free(ranges->range);
    *ranges = (kmp_ranges){0};
}

double kmp_range_value(const kmp_range *range, int k, int count)
{
    double part = count > 1 ? (double)k / (count - 1) : 0;
    return k == count - 1 && count > 1 ? range->to : range->from + part * (range->to - range->from);
}
