/* SPDX-License-Identifier: BSD-3-Clause */
/* The reader of ranges: name, ends with their units, count; an error names the place in the text. */
#include "analyses/parts/ranges.h"
#include "base/arena.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "model/language/expression.h"
#include "model/language/expression_dimension.h"
#include "model/language/expression_value.h"
#include "model/read/reader.h"
#include <ctype.h>
#include <math.h>
#include <string.h>

enum { MOST_VALUES = 1000000 };

/* The index of the next ':' or ',' or of the end. */
static size_t word_length(const char *s)
{
    return strcspn(s, ":,");
}

/* The error in a text that is not a range. */
typedef struct trouble {
    const char *unit; /* an unknown unit; NULL: another error */
    int length;
    bool differ; /* units of the two ends */
    bool alone;  /* a unit at one end, and none at the other, which is not 0 */
    bool expression, memory;
    kempe_context *context;
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

/* An expression of numbers without units. */
static bool read_expression(const char *s, size_t length, double *x, trouble *what)
{
    kmp_arena arena = {0};
    const kmp_expr_scope scope = {.context = what->context, .arena = &arena, .file = "", .line = 1, .column = 1};
    const char *text = kmp_arena_printf(&arena, "%.*s", (int)length, s);
    const kmp_expr *expr = text ? kmp_expr_parse(&scope, text) : NULL;
    kmp_expr_fault fault = {0};
    const bool bare = expr && kmp_expr_dimension(expr, NULL, NULL, &fault).kind == KMP_DIMENSION_BARE;
    *x = bare ? kmp_expr_value(expr, NULL) : NAN;
    what->expression = what->expression || bare;
    what->memory = what->memory || arena.failed;
    kmp_arena_free(&arena);
    kmp_context_clear(what->context); /* the message is the one for ranges */
    return bare && isfinite(*x);
}

/* A number with an optional sign and an optional unit, or an expression, the whole of `length` characters. */
static bool read_value(const char *s, size_t length, double *x, kmp_dimension *dimension, int *angle, trouble *what)
{
    size_t sign = *s == '-' || *s == '+', digits = kmp_text_to_number(s + sign, x), at = sign + digits;
    if (digits == 0 || at > length)
        return read_expression(s, length, x, what);
    while (at < length && s[at] == ' ')
        at++;
    while (length > at && s[length - 1] == ' ')
        length--;
    kmp_unit unit;
    if (at < length) {
        if (!kmp_unit_read(s + at, length - at, &unit)) {
            const bool good = read_expression(s, length, x, what);
            what->unit = good ? NULL : s + at;
            what->length = (int)(length - at);
            return good;
        }
        *dimension = unit.dimension;
        *angle = unit.angle;
        *x = *x * unit.factor / unit.divisor;
    }
    if (*s == '-')
        *x = -*x;
    return isfinite(*x);
}

static bool read_count(const char *s, size_t length, int *count, kempe_context *context)
{
    double x;
    int angle;
    trouble what = {.context = context};
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
        ok = read_count(*s + 1, length = word_length(*s + 1), &r->count, what->context);
        *s += length + 1;
    }
    r->expression = what->expression;
    return what->memory ? KEMPE_E_MEMORY : ok && **s != ':' ? KEMPE_OK : KEMPE_E_ARGUMENT;
}

static kempe_status complain(kempe_context *context, const char *begin, const trouble *what)
{
    int length = (int)strcspn(begin, ",");
    if (what->unit && isalpha((unsigned char)*what->unit)) {
        kmp_text sentence = {0};
        kmp_text_printf(&sentence, "'%.*s': unknown unit '%.*s'", length, begin, what->length, what->unit);
        kmp_unit_suggest(what->unit, (size_t)what->length, &sentence);
        return kmp_fail_text(context, KEMPE_E_ARGUMENT, &sentence);
    }
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
        trouble what = {.context = context};
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
    kmp_dimension_hint(&sentence, wanted, range->dimension);
    return kmp_fail_text(context, KEMPE_E_ARGUMENT, &sentence);
}

/* Warns of turns that were probably meant as degrees: beyond one where degrees are in the model or asked for, beyond
 * many elsewhere. */
static void warn_of_turns(const kempe_model *model, const char *what, const kmp_range *range)
{
    const double most = fmax(fabs(range->from), fabs(range->to));
    const bool degrees = model->source.degrees || kmp_shown_as(model->context, "rad").factor != 1;
    if (range->dimension.kind != KMP_DIMENSION_BARE || range->expression ||
        !(degrees ? most > KMP_MORE_TURN : most >= KMP_MANY_TURNS))
        return;
    const double given = fabs(range->from) > fabs(range->to) ? range->from : range->to;
    if (!range->column)
        kmp_log(model->context, KEMPE_LOG_WARNING,
                "%s: '%s' is %g without a unit and is taken in rad, %.3g turns: for degrees write '%g deg'", what,
                range->name, given, most / KMP_TURN, given);
    else
        kmp_log(model->context, KEMPE_LOG_WARNING,
                "%s: '%s' has %g without a unit and is taken in rad, %.3g turns: for degrees name the column '%s "
                "[deg]'",
                what, range->name, given, most / KMP_TURN, range->name);
}

kempe_status kmp_range_fits_motion(const kempe_model *model, const char *what, const kmp_range *range, int coordinate,
                                   int order)
{
    const bool rotation = model->motions[coordinate].rotation;
    kmp_dimension wanted = KMP_DIM(rotation ? 0 : 1, 0, -order);
    wanted.angle = rotation;
    KMP_TRY(kmp_range_fits(model->context, what, range, wanted));
    if (rotation && order == 0)
        warn_of_turns(model, what, range);
    return KEMPE_OK;
}

kempe_status kmp_range_fits_unit(const kempe_model *model, const char *what, const kmp_range *range, const char *unit)
{
    const bool angle = strcmp(unit, "rad") == 0;
    kmp_dimension wanted = *unit ? kmp_dimension_of(unit) : KMP_DIM_ANY;
    wanted.angle = angle;
    KMP_TRY(kmp_range_fits(model->context, what, range, wanted));
    if (angle)
        warn_of_turns(model, what, range);
    return KEMPE_OK;
}

/* A parameter without a unit in its file fits any; its expressions may not: the file is read with the range's begin. */
static kempe_status check_by_file(const kempe_model *model, const kmp_range *range)
{
    kempe_context *context = model->context;
    kempe_model *read = NULL;
    kmp_text value = {0};
    kempe_setting *list = KMP_NEW(kempe_setting, model->source.setting_count + 1);
    const double *power = range->dimension.power;
    kmp_text_printf(&value, "%.17g m^%.0f*kg^%.0f*s^%.0f", range->from, power[0], power[1], power[2]);
    kempe_status status = kmp_made(context, list && !value.failed);
    if (status == KEMPE_OK) {
        for (int k = 0; k < model->source.setting_count; k++)
            list[k] = model->source.settings[k];
        list[model->source.setting_count] = (kempe_setting){range->name, value.s};
        const bool quiet = kmp_context_quiet(context, true);
        status = kmp_model_read_file(context, model->source.file, list, model->source.setting_count + 1, &read);
        (void)kmp_context_quiet(context, quiet);
    }
    kempe_model_free(read);
    kmp_text_free(&value);
    kmp_free(list);
    return status;
}

kempe_status kmp_range_fits_variable(const kempe_model *model, const char *what, const kmp_range *range)
{
    const kmp_dimension wanted = kmp_variant_dimension(model, range->name);
    KMP_TRY(kmp_range_fits(model->context, what, range, wanted));
    if (wanted.kind == KMP_DIMENSION_KNOWN && !kmp_dimension_is_physical(wanted))
        warn_of_turns(model, what, range);
    if (wanted.kind == KMP_DIMENSION_BARE && kmp_dimension_is_physical(range->dimension) && model->source.from_file)
        return check_by_file(model, range);
    return KEMPE_OK;
}

/* "NAME=TEXT" as one number. */
static kempe_status read_one(kempe_context *context, const char *what, const char *name, const char *text,
                             size_t length, kmp_ranges *one)
{
    kmp_text entry = {0};
    kmp_text_printf(&entry, "%s=%.*s", name, (int)length, text);
    kempe_status status = entry.failed ? kmp_fail_memory(context) : kmp_ranges_read(context, entry.s, one);
    if (status == KEMPE_OK && (one->count != 1 || one->range[0].count != 1))
        status = kmp_fail(context, KEMPE_E_ARGUMENT, "%s: '%s' is not one number", what, entry.s);
    kmp_text_free(&entry);
    return status;
}

static kempe_status take_one(kempe_status status, kmp_ranges *one, double *value)
{
    if (status == KEMPE_OK)
        *value = one->range[0].from;
    kmp_ranges_free(one);
    return status;
}

kempe_status kmp_range_of_unit(const kempe_model *model, const char *what, const char *name, const char *text,
                               const char *unit, double *value)
{
    kmp_ranges one = {0};
    kempe_status status = read_one(model->context, what, name, text, strlen(text), &one);
    if (status == KEMPE_OK)
        status = kmp_range_fits_unit(model, what, &one.range[0], unit);
    return take_one(status, &one, value);
}

kempe_status kmp_range_of_variable(const kempe_model *model, const char *what, const char *name, const char *text,
                                   size_t length, double *value)
{
    kmp_ranges one = {0};
    kempe_status status = read_one(model->context, what, name, text, length, &one);
    if (status == KEMPE_OK)
        status = kmp_range_fits_variable(model, what, &one.range[0]);
    return take_one(status, &one, value);
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
