/* SPDX-License-Identifier: BSD-3-Clause */
/* Texts: what XML and JSON want escaped; a text that is written is freed, whatever comes. */
#include "base/file.h"
#include "base/memory.h"
#include "testing.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void test_escapes(void)
{
    kmp_text text = {0};
    kmp_text_escape(&text, "a<b>&c \"d\"");
    CHECK_TEXT(text.s, "a&lt;b&gt;&amp;c \"d\"");
    kmp_text_free(&text);
    kmp_text_quote(&text, "a<\"\\\n");
    CHECK_TEXT(text.s, "\"a<\\\"\\\\\\u000a\"");
    kmp_text_free(&text);
}

static void test_written(void)
{
    kempe_context *context = kempe_context_new();
    char path[] = "/tmp/kempe_text_XXXXXX", *back = NULL;
    int file = mkstemp(path);
    size_t length = 0;
    kmp_text text = {0};
    CHECK(context && file >= 0);
    if (file >= 0)
        close(file);
    kmp_text_put(&text, "two\nlines\n");
    CHECK(kmp_file_write(context, path, &text) == KEMPE_OK && !text.s && text.length == 0);
    CHECK(kmp_file_read(context, KMP_FILE_RECORD, path, &back, &length) == KEMPE_OK);
    CHECK_TEXT(back ? back : "", "two\nlines\n");
    kmp_free(back);
    CHECK(kmp_file_write(context, path, &text) == KEMPE_OK); /* nothing */
    CHECK(kmp_file_read(context, KMP_FILE_RECORD, path, &back, &length) == KEMPE_OK && length == 0);
    kmp_free(back);
    kmp_text_put(&text, "kept?");
    text.failed = true;
    CHECK(kmp_file_write(context, path, &text) == KEMPE_E_MEMORY && !text.s);
    CHECK(kmp_file_read(context, KMP_FILE_RECORD, path, &back, &length) == KEMPE_OK && length == 0);
    kmp_free(back);
    unlink(path);
    kmp_text_put(&text, "nowhere");
    CHECK(kmp_file_write(context, "/no such folder/file", &text) == KEMPE_E_IO && !text.s);
    kempe_context_free(context);
}

/* The fewest of 15 to 17 digits that read as x, by the C library. */
static void check_number(double x)
{
    char digits[64] = "";
    kmp_text text = {0};
    for (int precision = 15; precision <= 17 && !(strtod(digits, NULL) == x); precision++)
        snprintf(digits, sizeof digits, "%.*g", precision, x);
    kmp_text_number(&text, x);
    CHECK(text.s && strcmp(text.s, digits) == 0);
    kmp_text_free(&text);
}

/* Numbers of all sizes, and those beside powers of ten, two and short decimals. */
static void numbers_are_the_fewest_digits_that_read_back(void)
{
    uint64_t state = 88172645463325252u;
    for (int k = 0; k < 100000; k++) {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        const double part = (double)(state >> 11) / 9007199254740992.0 - 0.5;
        const double tens = pow(10, (double)(state % 29) - 9);
        check_number(part * tens);
        check_number(nextafter(tens, part) + 0.5 / 1024);
        check_number(nextafter(ldexp(1, (int)(state % 60) - 70), part));
        check_number(((double)(state % 100000) + 0.5) / 1000);
    }
    check_number(0.1);
    check_number(-1e-6);
    check_number(123456789012345.6);
    check_number(999999999999999.9);
    check_number(5e-324);
}

int main(void)
{
    TEST(test_escapes);
    TEST(test_written);
    TEST(numbers_are_the_fewest_digits_that_read_back);
    return check_report();
}
