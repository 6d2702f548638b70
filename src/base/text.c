/* SPDX-License-Identifier: BSD-3-Clause */
/* Growing text, and numbers as text in both directions, independent of the locale. */
#include "base/text.h"
#include "base/memory.h"
#include <ctype.h>
#include <kempe/kempe.h>
#include <locale.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Room for `more` characters and the final zero. */
static bool reserve(kmp_text *text, size_t more)
{
    if (text->failed)
        return false;
    size_t need = text->length + more + 1;
    if (text->s && need <= text->capacity)
        return true;
    size_t capacity = text->capacity < 64 ? 64 : 2 * text->capacity;
    if (capacity < need)
        capacity = need;
    char *s = kmp_realloc(text->s, capacity, 1);
    if (!s) {
        text->failed = true;
        return false;
    }
    text->s = s;
    text->capacity = capacity;
    return true;
}

/* All or nothing: a text without its end could be taken for another one. */
static void put_words(kmp_text *text, const char *format, va_list words)
{
    size_t length = strlen(format);
    va_list again;
    va_copy(again, words);
    for (const char *at = format; (at = strchr(at, '%')); at += 2)
        length += strlen(va_arg(again, const char *));
    va_end(again);
    if (!reserve(text, length))
        return;
    for (const char *at; (at = strchr(format, '%')); format = at + 2) {
        kmp_text_append(text, format, (size_t)(at - format));
        kmp_text_put(text, va_arg(words, const char *));
    }
    kmp_text_put(text, format);
}

void kmp_text_vprintf(kmp_text *text, const char *format, va_list arguments)
{
    char brief[256];            /* most texts are written once */
    const char *other = format; /* the first conversion that is not %s */
    while ((other = strchr(other, '%')) && other[1] == 's')
        other += 2;
    if (!other) {
        put_words(text, format, arguments);
        return;
    }
    va_list again;
    va_copy(again, arguments);
    int length = vsnprintf(brief, sizeof brief, format, arguments);
    if (length < 0)
        text->failed = true;
    if (reserve(text, (size_t)(length < 0 ? 0 : length))) {
        char *to = text->s + text->length;
        if ((size_t)length < sizeof brief)
            memcpy(to, brief, (size_t)length + 1);
        else
            vsnprintf(to, (size_t)length + 1, format, again);
        text->length += (size_t)length;
    }
    va_end(again);
}

void kmp_text_printf(kmp_text *text, const char *format, ...)
{
    KMP_TEXT_ARGUMENTS(text, format);
}

void kmp_text_append(kmp_text *text, const char *bytes, size_t length)
{
    if (!reserve(text, length))
        return;
    memcpy(text->s + text->length, bytes, length);
    text->length += length;
    text->s[text->length] = '\0';
}

void kmp_text_put(kmp_text *text, const char *s)
{
    kmp_text_append(text, s, strlen(s));
}

void kmp_text_quote(kmp_text *text, const char *s)
{
    kmp_text_put(text, "\"");
    for (; *s; s++) {
        unsigned char c = (unsigned char)*s;
        if (c == '"' || c == '\\')
            kmp_text_printf(text, "\\%c", c);
        else if (c < 0x20 || c == 0x7f)
            kmp_text_printf(text, "\\u%04x", c);
        else
            kmp_text_append(text, s, 1);
    }
    kmp_text_put(text, "\"");
}

void kmp_text_shell(kmp_text *text, const char *s)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,.%@/";
    if (*s && strspn(s, plain) == strlen(s)) {
        kmp_text_put(text, s);
        return;
    }
    kmp_text_put(text, "'");
    for (; *s; s++)
        kmp_text_append(text, *s == '\'' ? "'\\''" : s, *s == '\'' ? 4 : 1);
    kmp_text_put(text, "'");
}

/* The character at `s`, and its bytes; a byte that begins no character in UTF-8 is a separate one: false. */
static bool decode(const char *s, int *length, unsigned *code)
{
    const unsigned char *b = (const unsigned char *)s;
    static const unsigned least[] = {0, 0, 0x80, 0x800, 0x10000};
    const int bytes = b[0] < 0x80 ? 1 : b[0] >> 5 == 6 ? 2 : b[0] >> 4 == 14 ? 3 : b[0] >> 3 == 30 ? 4 : 0;
    unsigned value = bytes > 1 ? b[0] & (0x7fu >> bytes) : b[0];
    bool good = bytes > 0;
    for (int k = 1; good && k < bytes; k++) {
        good = b[k] >> 6 == 2;
        value = value << 6 | (b[k] & 0x3fu);
    }
    good = good && value >= least[bytes] && value <= 0x10ffff && !(value >= 0xd800 && value <= 0xdfff);
    *length = good ? bytes : 1;
    *code = good ? value : b[0];
    return good;
}

const char *kmp_text_unfit(const char *s, int *length, unsigned *code)
{
    for (; *s; s += *length) {
        const bool good = decode(s, length, code);
        const unsigned c = *code;
        const bool controls = c < 0x20 || (c >= 0x7f && c < 0xa0) || c == 0xfeff || (c & 0xfffe) == 0xfffe;
        const bool turns = (c >= 0x202a && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069) || c == 0x2028 || c == 0x2029;
        if (!good || controls || turns)
            return s;
    }
    return NULL;
}

void kmp_text_clean(char *s, char by)
{
    int length = 0;
    unsigned code;
    for (const char *at; (at = kmp_text_unfit(s, &length, &code)); s += at - s + length)
        memset(s + (at - s), by, (size_t)length);
}

void kmp_text_escape(kmp_text *text, const char *s)
{
    for (; *s; s++) {
        const char one[2] = {*s, 0};
        kmp_text_put(text, *s == '<' ? "&lt;" : *s == '>' ? "&gt;" : *s == '&' ? "&amp;" : one);
    }
}

/* Writes '.' where the locale has its own decimal point. */
static void use_point(char *digits)
{
    const char *point = localeconv()->decimal_point;
    char *at = strcmp(point, ".") != 0 ? strstr(digits, point) : NULL;
    if (!at)
        return;
    size_t length = strlen(point);
    *at = '.';
    memmove(at + 1, at + length, strlen(at + length) + 1);
}

/* Writes a whole number of few digits; false for others, and for the negative zero. */
static bool put_whole(kmp_text *text, double x)
{
    char digits[24];
    size_t first = sizeof digits;
    if (!(fabs(x) < 1e15) || (x == 0 && signbit(x)))
        return false;
    int64_t whole = (int64_t)x, left = whole < 0 ? -whole : whole;
    if ((double)whole < x || (double)whole > x)
        return false;
    do
        digits[--first] = (char)('0' + left % 10);
    while ((left /= 10) > 0);
    if (whole < 0)
        digits[--first] = '-';
    kmp_text_append(text, digits + first, sizeof digits - first);
    return true;
}

/* DIGITS: of a double that any other differs in. 10^TEN is the largest power of ten that is a double. */
enum { DIGITS = 17, TEN = 22 };

/* The integer of `places` fewer digits nearest to whole + part, and its distance; -1: they are as far from two. */
static int64_t shorter(int64_t whole, double part, int64_t unit, double *distance)
{
    double rest = (double)(whole % unit) + part, half = (double)unit / 2;
    int64_t down = whole - whole % unit;
    *distance = rest < half ? rest : (double)unit - rest;
    return rest < half ? down : rest > half ? down + unit : -1;
}

/* Writes `count` digits of |x| as "%.*g" does, without zeros at the end; 10^power is the value of the first one. */
static void put_digits(kmp_text *text, bool minus, int64_t number, int count, int power)
{
    char digit[DIGITS], written[2 * DIGITS + 8], *to = written;
    const bool fixed = power >= -4 && power < count;
    for (int k = count; k-- > 0; number /= 10)
        digit[k] = (char)('0' + number % 10);
    while (count > 1 && digit[count - 1] == '0')
        count--;
    if (minus)
        *to++ = '-';
    if (fixed && power < 0) {
        *to++ = '0';
        *to++ = '.';
        for (int k = -1; k > power; k--)
            *to++ = '0';
    }
    const int point = !fixed ? 0 : power < 0 ? count : power;
    for (int k = 0; k < count || (fixed && k <= power); k++) {
        *to++ = k < count ? digit[k] : '0';
        if (k == point && k + 1 < count)
            *to++ = '.';
    }
    if (!fixed) {
        int size = power < 0 ? -power : power;
        *to++ = 'e';
        *to++ = power < 0 ? '-' : '+';
        *to++ = (char)('0' + size / 10);
        *to++ = (char)('0' + size % 10);
    }
    kmp_text_append(text, written, (size_t)(to - written));
}

/* The digits of a number of usual size by exact arithmetic: x 10^power is a sum of two doubles, the first an integer.
 * Rounded digits read as x if they are within half of the distance of doubles there. false, and nothing is written,
 * beyond these sizes and wherever two numbers of digits are about as near. */
static bool put_usual(kmp_text *text, double x)
{
    static const double ten[TEN + 1] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                        1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    const double size = fabs(x);
    int exponent, power = -(TEN - DIGITS + 1);
    if (!(size >= 1e-6 && size < 1e15) || frexp(size, &exponent) == 0.5)
        return false;
    while (power < 0 ? size * ten[-power - 1] >= 1 : size >= ten[power + 1])
        power++;
    const double by = ten[DIGITS - 1 - power], high = size * by, low = fma(size, by, -high), down = floor(low);
    const int64_t whole = (int64_t)high + (int64_t)down;
    const double half = ldexp(by, exponent - 54);
    if (whole < (int64_t)1e16)
        return false;
    int64_t unit = 100;
    for (int count = DIGITS - 2; count <= DIGITS; count++, unit /= 10) {
        double distance;
        int64_t number = shorter(whole, low - down, unit, &distance);
        if (number < 0 || number >= (int64_t)1e17 || fabs(distance - half) < 1e-6 * half)
            return false;
        if (distance > half)
            continue;
        put_digits(text, x < 0, number / unit, count, power);
        return true;
    }
    return false;
}

void kmp_text_number(kmp_text *text, double x)
{
    char digits[64];
    if (!isfinite(x)) {
        kmp_text_put(text, "null");
        return;
    }
    if (put_whole(text, x) || put_usual(text, x))
        return;
    for (int precision = 15; precision <= 17; precision++) {
        snprintf(digits, sizeof digits, "%.*g", precision, x);
        double back = strtod(digits, NULL);
        if (!(back < x || back > x))
            break;
    }
    use_point(digits);
    kmp_text_put(text, digits);
}

void kmp_text_rounded(kmp_text *text, double x, int digits)
{
    char written[64];
    snprintf(written, sizeof written, "%.*g", digits, x + 0.0); /* no negative zero */
    use_point(written);
    kmp_text_put(text, isfinite(x) ? written : "null");
}

static size_t count_digits(const char *s)
{
    return strspn(s, "0123456789");
}

/* Length of the plain number at s. */
static size_t scan_number(const char *s)
{
    size_t length = count_digits(s), digits = length;
    if (s[length] == '.') {
        size_t fraction = count_digits(s + length + 1);
        digits += fraction;
        length += 1 + fraction;
    }
    if (digits == 0)
        return 0;
    if (s[length] == 'e' || s[length] == 'E') {
        size_t sign = s[length + 1] == '+' || s[length + 1] == '-';
        size_t exponent = count_digits(s + length + 1 + sign);
        if (exponent > 0)
            length += 1 + sign + exponent;
    }
    return length;
}

size_t kmp_text_to_number(const char *s, double *value)
{
    char digits[256];
    const char *point = localeconv()->decimal_point;
    size_t length = scan_number(s), n = 0;
    if (length == 0 || length + strlen(point) >= sizeof digits)
        return 0;
    for (size_t i = 0; i < length; i++) {
        if (s[i] != '.') {
            digits[n++] = s[i];
            continue;
        }
        memcpy(digits + n, point, strlen(point));
        n += strlen(point);
    }
    digits[n] = '\0';
    *value = strtod(digits, NULL);
    return length;
}

int kmp_text_words(kmp_arena *arena, const char *list, char ***words)
{
    int most = 1, count = 0;
    for (const char *s = list; s && *s; s++)
        most += *s == ',';
    char *own = kmp_arena_strdup(arena, list ? list : "");
    *words = KMP_ARENA_NEW(arena, char *, most);
    for (char *s = own, *next; s && *words; s = next) {
        next = strchr(s, ',');
        if (next)
            *next++ = '\0';
        s += strspn(s, " \t");
        size_t length = strlen(s);
        while (length > 0 && strchr(" \t", s[length - 1]))
            s[--length] = '\0';
        (*words)[count] = s;
        count += length > 0;
    }
    return count;
}

static bool is_of_word(char c)
{
    return isalnum((unsigned char)c) || c == '_' || (unsigned char)c >= 0x80;
}

const char *kmp_text_behind_word(const char *text, const char *word)
{
    const size_t length = strlen(word);
    for (const char *at = strstr(text, word); at; at = strstr(at + 1, word))
        if ((at == text || !is_of_word(at[-1])) && !is_of_word(at[length]))
            return at + length;
    return NULL;
}

char *kmp_arena_printf(kmp_arena *arena, const char *format, ...)
{
    kmp_text text = {0};
    KMP_TEXT_ARGUMENTS(&text, format);
    return kmp_text_keep(&text, arena);
}

char *kmp_text_take(kmp_text *text)
{
    char *s = reserve(text, 0) ? text->s : NULL;
    if (s) {
        s[text->length] = '\0';
        *text = (kmp_text){0};
    } else {
        kmp_text_free(text);
    }
    return s;
}

char *kmp_text_keep(kmp_text *text, kmp_arena *arena)
{
    char *kept = text->failed ? NULL : kmp_arena_strdup(arena, text->s ? text->s : "");
    arena->failed = arena->failed || text->failed;
    kmp_text_free(text);
    return kept;
}

void kmp_text_free(kmp_text *text)
{
    kmp_free(text->s);
    *text = (kmp_text){0};
}

void kmp_text_free_part(kmp_text *text, kmp_text *part)
{
    text->failed = text->failed || part->failed;
    kmp_text_free(part);
}

void kempe_text_free(char *text)
{
    kmp_free(text);
}

uint32_t kmp_text_hash(const char *text)
{
    uint32_t hash = 0x811c9dc5u; /* FNV-1a (Fowler, Noll, Vo) */
    for (; *text; text++)
        hash = (hash ^ (unsigned char)*text) * 0x01000193u;
    return hash ^ hash >> 15;
}
