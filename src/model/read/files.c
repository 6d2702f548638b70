/* SPDX-License-Identifier: BSD-3-Clause */
/* The files of a model, and errors in their order: each message is `label:line:column: sentence`, which is parsed again
 * for sorting. */
#include "model/read/files.h"
#include "model/data/model.h"
#include "model/files/document.h"
#include "model/read/read_points.h"
#include "model/read/reading.h"
#include <stdlib.h>
#include <string.h>

int kmp_reader_add_file(kmp_reader *r, const char *label)
{
    kempe_model *model = r->model;
    int count = model->file_count;
    const char **files = kmp_arena_room(&model->arena, model->files, count, sizeof *files);
    const char *kept = kmp_arena_strdup(&model->arena, label);
    if (!files || !kept)
        return -1;
    files[count] = kept;
    model->files = files;
    return model->file_count++;
}

static char *read_beside(void *user, kmp_place place, int from, const char *name, int *number, size_t *length)
{
    kmp_reader *r = user;
    const char *path = kmp_path_beside(r, from, name);
    *number = path ? kmp_reader_add_file(r, path) : -1;
    return *number < 0 ? NULL
                       : kmp_read_file(r, KMP_FILE_INCLUDED, &(kmp_yaml){.place = place}, "include", path, length);
}

static const char *name_of(void *user, int number)
{
    const kmp_reader *r = user;
    return r->model->files[number];
}

static void note(void *user, const char *line, bool altered)
{
    kempe_model *model = ((kmp_reader *)user)->model;
    const char **notes = kmp_arena_room(&model->arena, model->notes, model->note_count, sizeof *notes);
    const char *kept = kmp_arena_strdup(&model->arena, line);
    model->altered = model->altered || altered;
    if (!notes || !kept)
        return; /* the arena has failed */
    model->notes = notes;
    notes[model->note_count++] = kept;
}

void kmp_reader_warn(kmp_reader *r, kmp_place place, const char *format, ...)
{
    kmp_text words = {0}, line = {0};
    KMP_TEXT_ARGUMENTS(&words, format);
    kmp_text_printf(&line, "%s:%d:%d: %s", r->model->files[place.file], place.line, place.column,
                    words.failed ? "" : words.s);
    const char *kept = kmp_text_keep(&line, &r->scratch);
    kmp_text_free(&words);
    if (kept) {
        kmp_log(r->context, KEMPE_LOG_WARNING, "%s", kept);
        note(r, kept, false);
    }
}

kempe_status kmp_reader_load(kmp_reader *r, int number, const char *text, size_t length, kmp_base base,
                             const kmp_yaml **root)
{
    const kmp_include_files beside = {.user = r, .read = read_beside, .name = name_of, .note = note};
    return kmp_document_load(r->context, &r->scratch, r->model->files[number], number, text, length, base, &beside,
                             root);
}

static void note_path(kempe_model *model, const char *path)
{
    for (int k = 0; k < model->path_count; k++)
        if (strcmp(model->paths[k], path) == 0)
            return;
    const char **paths = kmp_arena_room(&model->arena, model->paths, model->path_count, sizeof *paths);
    const char *kept = kmp_arena_strdup(&model->arena, path);
    if (!paths || !kept)
        return; /* the arena has failed */
    model->paths = paths;
    paths[model->path_count++] = kept;
}

void kmp_reader_digest(kmp_reader *r, const char *path, const char *text, size_t length)
{
    if (!r->digests)
        return;
    note_path(r->model, path);
    kmp_digest_add_text(&r->digest, strrchr(path, '.'));
    kmp_digest_add_part(&r->digest, text, length);
}

typedef struct complaint {
    int file, line, column, order;
    const char *text;
} complaint;

static int compare(const void *a, const void *b)
{
    const complaint *x = a, *y = b;
    if (x->file != y->file)
        return x->file < y->file ? -1 : 1;
    if (x->line != y->line)
        return x->line < y->line ? -1 : 1;
    if (x->column != y->column)
        return x->column < y->column ? -1 : 1;
    return x->order < y->order ? -1 : x->order > y->order;
}

static int count_lines(const char *s)
{
    int n = 1;
    for (; *s; s++)
        n += *s == '\n';
    return n;
}

/* The first file whose label and a colon begin `text`: files with equal labels count as one. */
static int find_file(const kempe_model *model, const char *text)
{
    for (int k = 0; k < model->file_count; k++) {
        size_t length = strlen(model->files[k]);
        if (strncmp(text, model->files[k], length) == 0 && text[length] == ':')
            return k;
    }
    return -1;
}

static complaint take_apart(const kempe_model *model, char *text, int order)
{
    complaint c = {.file = find_file(model, text), .order = order, .text = text};
    char *rest = text;
    if (c.file < 0)
        return c;
    rest += strlen(model->files[c.file]) + 1;
    if (*rest == ' ') { /* no line: of a model built in code */
        c.text = rest + 1;
        return c;
    }
    c.line = (int)strtol(rest, &rest, 10);
    if (*rest == ':')
        c.column = (int)strtol(rest + 1, &rest, 10);
    c.text = strncmp(rest, ": ", 2) == 0 ? rest + 2 : rest;
    return c;
}

static void split(const kempe_model *model, char *text, complaint *list, int count)
{
    for (int i = 0; i < count; i++) {
        char *end = text + strcspn(text, "\n");
        bool last = *end == '\0';
        *end = '\0';
        list[i] = take_apart(model, text, i);
        text = last ? end : end + 1;
    }
}

static bool is_repeated(const complaint *list, int i)
{
    for (int k = i - 1; k >= 0 && list[k].file == list[i].file && list[k].line == list[i].line; k--)
        if (list[k].column == list[i].column && strcmp(list[k].text, list[i].text) == 0)
            return true;
    return false;
}

/* Reports an error again. In a model built in code a file is one call, without lines; its name is printed once. */
static kempe_status say_again(kmp_reader *r, const complaint *c)
{
    if (c->file < 0 || (c->line == 0 && strstr(c->text, r->model->files[c->file])))
        return kmp_fail(r->context, KEMPE_E_INPUT, "%s", c->text);
    return kmp_complain(r->context, r->model->files[c->file], c->line, c->column, "%s", c->text);
}

/* Reports the number of errors that were not kept, at the last place of those kept. */
static kempe_status say_rest(kmp_reader *r, const complaint *last, int rest)
{
    const char *file = last->file >= 0 ? r->model->files[last->file] : r->file;
    kmp_text sentence = {0};
    kmp_text_put(&sentence, file);
    if (last->line > 0)
        kmp_text_printf(&sentence, ":%d:%d", last->line, last->column);
    kmp_text_printf(&sentence, ": at least %d more errors: the first %d are listed", rest, KMP_MOST_COMPLAINTS);
    return kmp_fail_text(r->context, KEMPE_E_INPUT, &sentence);
}

kempe_status kmp_reader_sort_complaints(kmp_reader *r)
{
    kempe_status status = KEMPE_E_INPUT;
    char *text = kmp_arena_strdup(&r->scratch, kempe_context_message(r->context));
    int count = text ? count_lines(text) : 0, rest = kmp_context_complaints(r->context) - KMP_MOST_COMPLAINTS;
    complaint *list = KMP_ARENA_NEW(&r->scratch, complaint, count);
    if (!text || !list)
        return KEMPE_E_MEMORY;
    split(r->model, text, list, count);
    qsort(list, (size_t)count, sizeof *list, compare);
    kmp_context_clear(r->context);
    for (int i = 0; i < count && status == KEMPE_E_INPUT; i++)
        if (!is_repeated(list, i))
            status = say_again(r, &list[i]);
    if (rest > 0 && status == KEMPE_E_INPUT)
        status = say_rest(r, &list[count - 1], rest);
    return status;
}
