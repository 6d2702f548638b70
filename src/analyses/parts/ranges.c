/* SPDX-License-Identifier: BSD-3-Clause */
/* The reader of ranges: name, ends with their units, count; an error names the place in the text. */
#include "analyses/parts/ranges.h"
#include "base/memory.h"
#include <ctype.h>
#include <math.h>
#include <string.h>

enum { MOST_VALUES = 1000000 };

/* The index of the next ':' or ',' or of the end. */
static size_t word_length(const char *s)
{
    return strcspn(s, ":,");
}

/* The error in a text that is no range. */
typedef struct trouble {
    const char *unit; /* an unknown unit; NULL: another error */
    int length;
    bool differ; /* units of the two ends */
    bool alone;  /* a unit at one end, and none at the other, which is not 0 */
} trouble;

/* The units of both ends must fit; only 0 may have none where the other end has one: "10:30 deg" does not begin at 10
 * rad. */
static bool fit_ends(kmp_range *r, kmp_dimension first, trouble *what)
{
    bool bare = first.kind == KMP_DIMENSION_BARE, bare_last = r->dimension.kind == KMP_DIMENSION_BARE;
    what->differ = !kmp_dimension_fits(first, r->dimension);
    what->alone = bare != bare_last && (bare ? r->from : r->to) != 0;
    if (bare_last)
        r->dimension = first;
    return !what->differ && !what->alone;
}

/* A number with an optional sign and an optional unit, the whole of `length` characters. */
static bool read_value(const char *s, size_t length, double *x, kmp_dimension *dimension, int *angle, trouble *what)
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
        if (!kmp_unit_read(s + at, length - at, &unit)) {
            what->unit = s + at;
            what->length = (int)(length - at);
            return false;
        }
        *dimension = unit.dimension;
        *angle = unit.angle;
        *x = *x * unit.factor / unit.divisor;
    }
    if (*s == '-')
        *x = -*x;
    return isfinite(*x);
}

static bool read_count(const char *s, size_t length, int *count)
{
    double x;
    int angle;
    trouble what;
    kmp_dimension none = {0};
    if (!read_value(s, length, &x, &none, &angle, &what) || none.kind != KMP_DIMENSION_BARE || x < 2 ||
        x > MOST_VALUES || x != floor(x))
        return false;
    *count = (int)x;
    return true;
}

/* NAME=A[:B[:N]] up to a comma or the end, where *s is left. KEMPE_E_ARGUMENT without a sentence. */
static kempe_status read_range(const char **s, kmp_range *r, trouble *what)
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
    bool ok = read_value(*s, length = word_length(*s), &r->from, &r->dimension, &r->angle[0], what);
    *s += length;
    r->to = r->from;
    if (ok && **s == ':') {
        kmp_dimension first = r->dimension;
        r->dimension = (kmp_dimension){0};
        r->count = 0;
        ok = read_value(*s + 1, length = word_length(*s + 1), &r->to, &r->dimension, &r->angle[1], what);
        *s += length + 1;
        ok = ok && fit_ends(r, first, what);
    }
    if (ok && **s == ':') {
        ok = read_count(*s + 1, length = word_length(*s + 1), &r->count);
        *s += length + 1;
    }
    return ok && **s != ':' ? KEMPE_OK : KEMPE_E_ARGUMENT;
}

static kempe_status complain(kempe_context *context, const char *begin, const trouble *what)
{
    int length = (int)strcspn(begin, ",");
    if (what->unit && isalpha((unsigned char)*what->unit))
        return kmp_fail(context, KEMPE_E_ARGUMENT, "'%.*s': unknown unit '%.*s'", length, begin, what->length,
                        what->unit);
    if (what->differ)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "'%.*s': the units of its ends are incompatible", length, begin);
    if (what->alone)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "'%.*s': either both ends have a unit, or none", length, begin);
    return kmp_fail(context, KEMPE_E_ARGUMENT,
                    "a value is written NAME=A, a range NAME=A:B or NAME=A:B:N (N values, 2 to %d), with commas "
                    "between several; not '%s'",
                    MOST_VALUES, begin);
}

kempe_status kmp_ranges_read(kempe_context *context, const char *text, kmp_ranges *ranges)
{
    int most = 1;
    kempe_status status = KEMPE_OK;
    for (const char *s = text; *s; s++)
        most += *s == ',';
    kmp_ranges read = {0, KMP_NEW(kmp_range, most)};
    KMP_TRY(kmp_made(context, read.range));
    for (const char *s = text; status == KEMPE_OK && read.count < most; s += *s == ',') {
        const char *begin = s;
        trouble what = {0};
        status = read_range(&s, &read.range[read.count++], &what);
        if (status == KEMPE_E_ARGUMENT)
            (void)complain(context, begin, &what);
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

kempe_status kmp_range_fits(kempe_context *context, const char *what, const kmp_range *range, kmp_dimension wanted)
{
    if (kmp_dimension_fits(range->dimension, wanted))
        return KEMPE_OK;
    kmp_text sentence = {0};
    kmp_text_printf(&sentence, "%s: '%s': ", what, range->name);
    kmp_dimension_print(&sentence, range->dimension);
    kmp_text_put(&sentence, " is given, but ");
    kmp_dimension_print(&sentence, wanted);
    kmp_text_put(&sentence, " is expected");
    return kmp_fail_text(context, KEMPE_E_ARGUMENT, &sentence);
}

kempe_status kmp_range_fits_motion(kempe_context *context, const char *what, const kmp_range *range, bool rotation,
                                   int order)
{
    kmp_dimension wanted = KMP_DIM(rotation ? 0 : 1, 0, -order);
    wanted.angle = rotation;
    return kmp_range_fits(context, what, range, wanted);
}

kempe_status kmp_range_is_value(kempe_context *context, const char *what, const kmp_range *range)
{
    return range->count == 1
               ? KEMPE_OK
               : kmp_fail(context, KEMPE_E_ARGUMENT, "%s: '%s' takes one value, not a range", what, range->name);
}

double kmp_range_value(const kmp_range *range, int k, int count)
{
    double part = count > 1 ? (double)k / (count - 1) : 0;
    return k == count - 1 && count > 1 ? range->to : range->from + part * (range->to - range->from);
}
