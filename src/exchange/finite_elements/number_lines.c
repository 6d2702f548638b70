/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/finite_elements/number_lines.h"
#include "base/memory.h"
#include <math.h>
#include <string.h>

kempe_status kmp_number_lines_open(kempe_context *context, kmp_file_kind kind, const char *path,
                                   kmp_number_lines *lines)
{
    *lines = (kmp_number_lines){.context = context, .path = path};
    return kmp_file_read(context, kind, path, &lines->text, &lines->length);
}

void kmp_number_lines_close(kmp_number_lines *lines)
{
    kmp_free(lines->text);
    lines->text = NULL;
}

bool kmp_number_lines_next(kmp_number_lines *lines)
{
    while (lines->next < lines->length) {
        char *line = lines->text + lines->next, *end = memchr(line, '\n', lines->length - lines->next);
        end = end ? end : lines->text + lines->length; /* the text ends with a zero */
        lines->next = (size_t)(end - lines->text) + 1;
        lines->line++;
        *end = '\0';
        lines->now = line;
        if (line[strspn(line, " \t\r")])
            return true;
    }
    return false;
}

static const char *skip(const char *at)
{
    at += strspn(at, " \t\r");
    at += *at == ',';
    return at + strspn(at, " \t\r");
}

bool kmp_number_line_ends(const char *at)
{
    return !*skip(at);
}

bool kmp_number_take(const char **at, double *value)
{
    enum { LONGEST = 64 };
    const char *from = skip(*at);
    char word[LONGEST + 2];
    size_t n = 0;
    const bool negative = *from == '-';
    *at = from;
    from += negative || *from == '+';
    for (; n < LONGEST && *from && !strchr(" \t\r,", *from); from++) {
        const bool exponent = strchr("dDeE", *from), sign = *from == '-' || *from == '+';
        if (sign && n > 0 && word[n - 1] != 'e') /* an exponent of three digits has no letter in Fortran */
            word[n++] = 'e';
        word[n++] = exponent ? 'e' : *from;
    }
    word[n] = '\0';
    if (n == 0 || n >= LONGEST || kmp_text_to_number(word, value) != n)
        return false;
    *value = negative ? -*value : *value;
    *at = from;
    return true;
}

kempe_status kmp_number_lines_refuse(const kmp_number_lines *lines, const char *at, const char *format, ...)
{
    kmp_text sentence = {0};
    KMP_TEXT_ARGUMENTS(&sentence, format);
    kempe_status status = sentence.failed ? kmp_fail_memory(lines->context)
                                          : kmp_complain(lines->context, lines->path, lines->line,
                                                         at ? (int)(at - lines->now) + 1 : 1, "%s", sentence.s);
    kmp_text_free(&sentence);
    return status;
}

kempe_status kmp_number_lines_take(const kmp_number_lines *lines, int count, double *values, const char *what)
{
    const char *at = lines->now;
    for (int k = 0; k < count; k++)
        if (!kmp_number_take(&at, &values[k]))
            return kmp_number_lines_refuse(lines, at, "%s expected", what);
    return kmp_number_line_ends(at) ? KEMPE_OK
                                    : kmp_number_lines_refuse(lines, skip(at), "%s expected and no more", what);
}
