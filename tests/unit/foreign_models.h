/* SPDX-License-Identifier: BSD-3-Clause */
/* Models in other formats: the same as in Kempe's language, refused texts, the log of a reading, changed files. */
#ifndef KEMPE_TESTS_FOREIGN_MODELS_H
#define KEMPE_TESTS_FOREIGN_MODELS_H

#include "base/file.h"
#include "base/memory.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdlib.h>
#include <string.h>

/* The printed model; NULL: it cannot be read. */
static inline char *foreign_shown(kempe_context *context, const char *path, kempe_format format)
{
    kempe_model *model = NULL;
    char *text = NULL;
    if (kempe_model_read(context, path, &model) == KEMPE_OK)
        CHECK(kempe_model_print(model, format, &text) == KEMPE_OK);
    else
        printf("%s\n", kempe_context_message(context));
    kempe_model_free(model);
    return text;
}

/* Checks that two files are one model. */
static inline void foreign_same(kempe_context *context, const char *path, const char *own)
{
    for (int format = KEMPE_TEXT; format <= KEMPE_JSON; format++) {
        char *read = foreign_shown(context, path, (kempe_format)format);
        char *wanted = foreign_shown(context, own, (kempe_format)format);
        CHECK(read && wanted);
        if (read && wanted)
            CHECK_TEXT(read, wanted);
        kempe_text_free(read);
        kempe_text_free(wanted);
    }
}

/* Checks that a text is refused with a message. */
static inline void foreign_refuse(kempe_context *context, const char *label, const char *text, const char *sentence)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, label, &model) == KEMPE_E_INPUT);
    CHECK(model == NULL);
    CHECK_TEXT(kempe_context_message(context), sentence);
}

static char foreign_lines[20000];

static inline void foreign_on_log(void *user, kempe_level level, const char *line)
{
    size_t length = strlen(foreign_lines), root = strlen(KEMPE_ROOT);
    (void)user;
    snprintf(foreign_lines + length, sizeof foreign_lines - length, "%d %s\n", (int)level,
             strncmp(line, KEMPE_ROOT, root) == 0 ? line + root : line);
}

/* The log of reading a text, or the file of this name where there is none: lines "LEVEL WORDS" with files below the
 * project's folder. */
static inline const char *foreign_log(kempe_context *context, const char *text, const char *path)
{
    kempe_model *model = NULL;
    foreign_lines[0] = '\0';
    kempe_context_set_log(context, foreign_on_log, NULL);
    if (text)
        (void)kempe_model_read_text(context, text, path, &model);
    else
        CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
    kempe_context_set_log(context, NULL, NULL);
    kempe_model_free(model);
    return foreign_lines;
}

/* Checks that a strict context refuses a file with the warnings of its log as errors. */
static inline void foreign_strict(kempe_context *context, const char *path, int count)
{
    kempe_model *model = NULL;
    int lines = 1;
    CHECK(kempe_context_set_strict(context, 1) == KEMPE_OK);
    CHECK(kempe_model_read(context, path, &model) == KEMPE_E_INPUT && !model);
    for (const char *at = kempe_context_message(context); *at; at++)
        lines += *at == '\n';
    CHECK(lines == count);
    CHECK(kempe_context_set_strict(context, 0) == KEMPE_OK);
}

/* Reads a text: a model or a complaint. */
static inline void foreign_try(kempe_context *context, const char *label, const char *text)
{
    kempe_model *model = NULL;
    kempe_status status = kempe_model_read_text(context, text, label, &model);
    bool complained = status == KEMPE_E_INPUT && !model && kempe_context_message(context)[0];
    if (!(status == KEMPE_OK && model) && !complained) {
        printf("%s\n", text);
        CHECK(false);
    }
    kempe_model_free(model);
}

/* A file with one character changed, or cut off there at each fifth; with each line left out, and given twice. */
static inline void foreign_changed(kempe_context *context, const char *label, const char *path)
{
    static const char others[] = "<>/&;!\"'=-0x. \n_?";
    size_t length = 0;
    char *text = NULL;
    CHECK(kmp_file_read(context, KMP_FILE_MODEL, path, &text, &length) == KEMPE_OK);
    for (size_t i = 0; text && i < length; i++) {
        char old = text[i];
        text[i] = others[i % (sizeof others - 1)];
        foreign_try(context, label, text);
        text[i] = '\0';
        if (i % 5 == 0)
            foreign_try(context, label, text);
        text[i] = old;
    }
    char *changed = calloc(2 * length + 1, 1);
    for (char *line = text; line && *line && changed;) {
        size_t before = (size_t)(line - text), size = strcspn(line, "\n");
        size += line[size] == '\n';
        for (size_t times = 0; times <= 2; times += 2) {
            char *at = changed;
            memcpy(at, text, before);
            at += before;
            for (size_t k = 0; k < times; k++, at += size)
                memcpy(at, line, size);
            memcpy(at, line + size, length - before - size);
            at[length - before - size] = '\0';
            foreign_try(context, label, changed);
        }
        line += size;
    }
    free(changed);
    kmp_free(text);
}

#endif
