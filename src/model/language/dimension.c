/* SPDX-License-Identifier: BSD-3-Clause */
/* Dimensions as three exponents, which may be fractions, and units as a factor with a dimension, read from text and
 * printed with the fewest words. */
#include "model/language/dimension.h"
#include <math.h>
#include <string.h>

static const struct {
    const char *name;
    kmp_unit unit;
} units[] = {
#define KMP_UNIT(name, factor, divisor, m, kg, s, angle)                                                               \
    {#name, {factor, divisor, {KMP_DIMENSION_KNOWN, {m, kg, s}, false}, angle}},
#include "model/language/units.def"
};

static const struct {
    const char *word, *unit;
} words[] = {
#define KMP_UNIT_WORD(word, unit) {#word, unit},
#include "model/language/units.def"
};

/* -- dimensions ---------------------------------------------------------------------------------- */

kmp_dimension kmp_dimension_times(kmp_dimension a, kmp_dimension b, double sign)
{
    if (a.kind == KMP_DIMENSION_FREE || b.kind == KMP_DIMENSION_FREE)
        return KMP_DIM_ANY;
    for (int i = 0; i < 3; i++)
        a.power[i] += sign * b.power[i];
    if (b.kind == KMP_DIMENSION_KNOWN)
        a.kind = KMP_DIMENSION_KNOWN;
    return a;
}

kmp_dimension kmp_dimension_power(kmp_dimension a, double exponent)
{
    for (int i = 0; i < 3; i++)
        a.power[i] *= exponent;
    return a;
}

/* Compares powers as numbers, not to the bit: they may come from roots. */
static bool same_powers(const double a[3], const double b[3])
{
    return fabs(a[0] - b[0]) < 1e-6 && fabs(a[1] - b[1]) < 1e-6 && fabs(a[2] - b[2]) < 1e-6;
}

bool kmp_dimension_fits(kmp_dimension a, kmp_dimension b)
{
    return a.kind != KMP_DIMENSION_KNOWN || b.kind != KMP_DIMENSION_KNOWN || same_powers(a.power, b.power);
}

bool kmp_dimension_is_physical(kmp_dimension a)
{
    return !kmp_dimension_fits(a, KMP_DIM_NUMBER);
}

/* The units of a rotation and of its rate; NULL: another dimension. */
static const char *angle_words(kmp_dimension a)
{
    return !a.angle                                      ? NULL
           : same_powers(a.power, (double[3]){0})        ? "an angle (rad, deg, rev)"
           : same_powers(a.power, (double[3]){0, 0, -1}) ? "rad/s, deg/s or rpm"
                                                         : NULL;
}

void kmp_dimension_print(kmp_text *text, kmp_dimension a)
{
    static const struct {
        const char *name;
        double power[3];
    } known[] = {{"a number without unit", {0, 0, 0}},
                 {"1/s", {0, 0, -1}},
                 {"m/s", {1, 0, -1}},
                 {"m/s^2", {1, 0, -2}},
                 {"kg*m^2", {2, 1, 0}},
                 {"N", {1, 1, -2}},
                 {"N*m", {2, 1, -2}},
                 {"N/m", {0, 1, -2}},
                 {"N*s/m", {0, 1, -1}},
                 {"N*m*s", {2, 1, -1}},
                 {"Pa", {-1, 1, -2}},
                 {"W", {2, 1, -3}},
                 {"kg/m", {-1, 1, 0}},
                 {"kg/m^3", {-3, 1, 0}},
                 {"m^2/s^2", {2, 0, -2}}};
    static const char *const base[3] = {"m", "kg", "s"};
    static const int order[3] = {1, 0, 2};
    bool first = true;
    if (angle_words(a)) {
        kmp_text_put(text, angle_words(a));
        return;
    }
    for (size_t k = 0; k < sizeof known / sizeof known[0]; k++)
        if (same_powers(a.power, known[k].power)) {
            kmp_text_put(text, known[k].name);
            return;
        }
    for (int k = 0; k < 3; k++) {
        double power = a.power[order[k]];
        if (fabs(power) < 1e-6)
            continue;
        kmp_text_printf(text, "%s%s", first ? "" : "*", base[order[k]]);
        if (power != 1)
            kmp_text_printf(text, "^%.6g", power);
        first = false;
    }
}

void kmp_dimension_put_unit(kmp_text *text, kmp_dimension a)
{
    const size_t before = text->length;
    kmp_text_put(text, "");
    if (kmp_dimension_is_physical(a))
        kmp_dimension_print(text, a);
    for (size_t k = before; k < text->length; k++)
        if (text->s[k] == '*')
            text->s[k] = ' ';
}

void kmp_dimension_hint(kmp_text *text, kmp_dimension wanted, kmp_dimension found)
{
    static const double mass[3] = {0, 1, 0}, force[3] = {1, 1, -2}, acceleration[3] = {1, 0, -2};
    if (found.kind != KMP_DIMENSION_KNOWN || wanted.kind != KMP_DIMENSION_KNOWN || !same_powers(found.power, mass))
        return;
    if (same_powers(wanted.power, force))
        kmp_text_put(text, "; the weight of a mass is in lbf, ozf, kgf or N");
    else if (same_powers(wanted.power, acceleration))
        kmp_text_put(text, "; g is the gram, and standard gravity is gn");
}

/* -- units --------------------------------------------------------------------------------------- */

bool kmp_unit_find(const char *name, size_t length, kmp_unit *unit)
{
    for (int i = 0; i < kmp_unit_names.count; i++)
        if (strlen(units[i].name) == length && strncmp(units[i].name, name, length) == 0) {
            *unit = units[i].unit;
            return true;
        }
    return false;
}

void kmp_unit_suggest(const char *name, size_t length, kmp_text *sentence)
{
    kmp_text unknown = {0};
    kmp_text_printf(&unknown, "%.*s", (int)length, name);
    if (unknown.failed)
        return;
    const int k = kmp_name_find(KMP_NAMES_OF(words), unknown.s);
    const kmp_nearest nearest = kmp_nearest_of(unknown.s, kmp_unit_names);
    if (k >= 0)
        kmp_text_printf(sentence, ": its unit is written '%s'", words[k].unit);
    else if (nearest.best)
        kmp_nearest_suggest(&nearest, sentence);
    else
        kmp_text_put(sentence, "; units are such as m, mm, in, kg, lb, N, kN, lbf, deg, rpm");
    kmp_text_free(&unknown);
}

kmp_dimension kmp_dimension_of(const char *unit)
{
    kmp_dimension d = KMP_DIM_NUMBER;
    for (double sign = 1; *unit; sign = *unit == '/' ? -1 : 1, unit += *unit != '\0') {
        size_t name = strcspn(unit, "^/ ");
        kmp_unit factor = {.dimension = KMP_DIM_NUMBER}; /* 1 in "1/s" */
        double power = 1;
        (void)kmp_unit_find(unit, name, &factor);
        unit += name;
        if (*unit == '^')
            unit += 1 + kmp_text_to_number(unit + 1, &power);
        d = kmp_dimension_times(d, factor.dimension, sign * power);
    }
    return d;
}

void kmp_unit_multiply(kmp_unit *unit, const kmp_unit *other, int power)
{
    for (int k = 0; k < (power < 0 ? -power : power); k++) {
        unit->factor *= power < 0 ? other->divisor : other->factor;
        unit->divisor *= power < 0 ? other->factor : other->divisor;
    }
    unit->dimension = kmp_dimension_times(unit->dimension, other->dimension, power);
    unit->angle += power * other->angle;
}

bool kmp_unit_read(const char *s, size_t length, kmp_unit *unit)
{
    bool over = length > 2 && strncmp(s, "1/", 2) == 0;
    *unit = (kmp_unit){1, 1, KMP_DIM_NUMBER, 0};
    s += over ? 2 : 0;
    length -= over ? 2 : 0;
    for (int sign = over ? -1 : 1;;) {
        size_t name = 0, power = 1;
        kmp_unit next;
        while (name < length && !strchr("*/^ ", s[name]))
            name++;
        if (!kmp_unit_find(s, name, &next))
            return false;
        s += name;
        length -= name;
        if (length > 0 && *s == '^') {
            bool negative = length > 1 && s[1] == '-';
            size_t digit = 1 + (size_t)negative;
            if (digit >= length || s[digit] < '0' || s[digit] > '9')
                return false;
            power = (size_t)(s[digit] - '0');
            sign = negative ? -sign : sign;
            s += digit + 1;
            length -= digit + 1;
        }
        kmp_unit_multiply(unit, &next, sign * (int)power);
        if (length == 0)
            return true;
        if (!strchr("*/ ", *s))
            return false;
        sign = *s == '/' ? -1 : 1;
        s++;
        length--;
    }
}

const kmp_name_list kmp_unit_names = {units, sizeof *units, sizeof units / sizeof *units};
