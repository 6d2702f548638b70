/* SPDX-License-Identifier: BSD-3-Clause */
/* Texts: what XML and JSON want escaped; a text that is written is freed, whatever comes. */
#include "base/file.h"
#include "base/memory.h"
#include "testing.h"
#include <stdlib.h>
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
    CHECK(kmp_file_read(context, path, &back, &length) == KEMPE_OK);
    CHECK_TEXT(back ? back : "", "two\nlines\n");
    kmp_free(back);
    CHECK(kmp_file_write(context, path, &text) == KEMPE_OK); /* nothing */
    CHECK(kmp_file_read(context, path, &back, &length) == KEMPE_OK && length == 0);
    kmp_free(back);
    kmp_text_put(&text, "kept?");
    text.failed = true;
    CHECK(kmp_file_write(context, path, &text) == KEMPE_E_MEMORY && !text.s);
    CHECK(kmp_file_read(context, path, &back, &length) == KEMPE_OK && length == 0);
    kmp_free(back);
    unlink(path);
    kmp_text_put(&text, "nowhere");
    CHECK(kmp_file_write(context, "/no such folder/file", &text) == KEMPE_E_IO && !text.s);
    kempe_context_free(context);
}

int main(void)
{
    TEST(test_escapes);
    TEST(test_written);
    return check_report();
}
