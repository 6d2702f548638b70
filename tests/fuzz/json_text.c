/* SPDX-License-Identifier: BSD-3-Clause */
/* Decides if a text is JSON (RFC 8259): recursive descent, each rule returns the place behind the text it has read, or
 * NULL.
 */
#include "fuzz.h"

enum { MOST_LEVELS = 64 };

static const char *read_value(const char *s, int level);

static const char *skip(const char *s)
{
    return s + strspn(s, " \t\r\n");
}

static const char *read_string(const char *s)
{
    if (*s != '"')
        return NULL;
    for (s++; *s != '"'; s++) {
        if ((unsigned char)*s < 0x20)
            return NULL; /* the end too */
        if (*s != '\\')
            continue;
        s++;
        if (*s == 'u' && strspn(s + 1, "0123456789abcdefABCDEF") < 4)
            return NULL;
        if (!*s || !strchr("\"\\/bfnrtu", *s))
            return NULL;
    }
    return s + 1;
}

static const char *read_digits(const char *s)
{
    size_t n = strspn(s, "0123456789");
    return n > 0 ? s + n : NULL;
}

static const char *read_number(const char *s)
{
    const char *first = s + (*s == '-');
    s = read_digits(first);
    if (!s || (*first == '0' && s > first + 1))
        return NULL;
    if (*s == '.' && !(s = read_digits(s + 1)))
        return NULL;
    if (*s == 'e' || *s == 'E')
        s = read_digits(s + 1 + (s[1] == '+' || s[1] == '-'));
    return s;
}

/* A list, or an object whose values have names. */
static const char *read_many(const char *s, int level, bool named, char end)
{
    s = skip(s + 1);
    if (*s == end)
        return s + 1;
    for (;; s = skip(s + 1)) {
        if (named) {
            s = read_string(s);
            s = s ? skip(s) : NULL;
            if (!s || *s != ':')
                return NULL;
            s = skip(s + 1);
        }
        s = read_value(s, level + 1);
        s = s ? skip(s) : NULL;
        if (!s || *s == end)
            return s ? s + 1 : NULL;
        if (*s != ',')
            return NULL;
    }
}

static const char *read_word(const char *s, const char *word)
{
    size_t n = strlen(word);
    return strncmp(s, word, n) == 0 ? s + n : NULL;
}

static const char *read_value(const char *s, int level)
{
    if (level > MOST_LEVELS)
        return NULL;
    switch (*s) {
    case '{':
        return read_many(s, level, true, '}');
    case '[':
        return read_many(s, level, false, ']');
    case '"':
        return read_string(s);
    case 't':
        return read_word(s, "true");
    case 'f':
        return read_word(s, "false");
    case 'n':
        return read_word(s, "null");
    default:
        return read_number(s);
    }
}

bool fuzz_is_json(const char *text)
{
    const char *end = read_value(skip(text), 0);
    return end && *skip(end) == '\0';
}
