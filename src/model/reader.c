/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading a model: the parts of the file in the order in which they refer to each other. No mistake ends the
 * reading; what depends on something wrong is passed over, and the complaints are sorted by place at the end.
 * The language: docs/model_format.md. */
#include "base/file.h"
#include "base/memory.h"
#include "model/build.h"
#include "model/reading.h"
#include <stdlib.h>
#include <string.h>

static const char *const model_keys[] = {"kempe", "name",   "gravity", "parameters", "ground", "bodies",
                                         "loops", "forces", "start",   "run",        NULL};

/* -- the file's own keys --------------------------------------------------------------------------- */

/* False when the rest means something else in this version. */
static bool read_version(kmp_reader *r)
{
    const kmp_node *version = kmp_read_required(r, r->root, "the model", "kempe");
    if (!version || strcmp(version->text, "1") == 0)
        return true;
    kmp_reader_complain(r, version->place, "kempe: this program reads version 1 of the model language, not '%s'",
                        version->text);
    return false;
}

/* The file's name without folders and ending. */
static const char *name_of_file(kmp_reader *r)
{
    const char *slash = strrchr(r->file, '/');
    const char *base = slash ? slash + 1 : r->file;
    const char *dot = strrchr(base, '.');
    size_t length = dot && dot != base ? (size_t)(dot - base) : strlen(base);
    return kmp_reader_say(r, "%.*s", (int)length, base);
}

static void read_head(kmp_reader *r)
{
    const kmp_node *name = kmp_node_get(r->root, "name");
    const kmp_node *gravity = kmp_node_get(r->root, "gravity");
    const char *given = name ? kmp_read_word(r, name, "name") : name_of_file(r);
    r->model->name = given ? kmp_arena_strdup(&r->model->arena, given) : "";
    if (gravity)
        kmp_read_vector(r, gravity, "gravity", r->model->gravity);
}

static void read_parts(kmp_reader *r)
{
    if (r->root->kind != KMP_NODE_MAP) {
        kmp_reader_complain(r, r->root->place, "a model is a mapping that begins with 'kempe: 1'");
        return;
    }
    if (!read_version(r))
        return;
    kmp_read_map(r, r->root, "the model", model_keys);
    kmp_read_parameters(r);
    read_head(r);
    kmp_read_bodies(r);
    kmp_read_closures(r);
    kmp_read_forces(r);
    kmp_read_start(r);
    kmp_read_run(r);
}

/* -- complaints in the order of the file ------------------------------------------------------------- */

typedef struct complaint {
    int line, column, order;
    const char *text;
} complaint;

static int compare(const void *a, const void *b)
{
    const complaint *x = a, *y = b;
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

/* Cuts `text` into its lines: `head` bytes, then line:column: sentence. */
static void split(char *text, size_t head, complaint *list, int count)
{
    for (int i = 0; i < count; i++) {
        char *end = text + strcspn(text, "\n"), *rest = text;
        bool last = *end == '\0';
        *end = '\0';
        list[i] = (complaint){.order = i, .text = text};
        if (strlen(text) > head)
            list[i].line = (int)strtol(text + head, &rest, 10);
        if (*rest == ':')
            list[i].column = (int)strtol(rest + 1, &rest, 10);
        list[i].text = strncmp(rest, ": ", 2) == 0 ? rest + 2 : rest;
        text = last ? end : end + 1;
    }
}

/* In a model built in code the thing that was called stands for the place. */
static kempe_status say_again(kmp_reader *r, const complaint *c)
{
    if (!r->calls)
        return kmp_complain(r->context, r->file, c->line, c->column, "%s", c->text);
    const char *call = c->line > 0 ? r->calls[c->line - 1] : r->file;
    if (strstr(c->text, call))
        return kmp_fail(r->context, KEMPE_E_INPUT, "%s", c->text);
    return kmp_fail(r->context, KEMPE_E_INPUT, "%s: %s", call, c->text);
}

static kempe_status sort_complaints(kmp_reader *r)
{
    kempe_status status = KEMPE_E_INPUT;
    char *text = kmp_arena_strdup(&r->scratch, kempe_context_message(r->context));
    int count = text ? count_lines(text) : 0;
    complaint *list = KMP_ARENA_NEW(&r->scratch, complaint, count);
    if (!text || !list)
        return KEMPE_E_MEMORY;
    split(text, strlen(r->file) + 1, list, count);
    qsort(list, (size_t)count, sizeof *list, compare);
    kmp_context_clear(r->context);
    for (int i = 0; i < count && status == KEMPE_E_INPUT; i++)
        status = say_again(r, &list[i]);
    return status;
}

/* -- reading ------------------------------------------------------------------------------------- */

static kempe_model *new_model(kempe_context *context, const char *label)
{
    kempe_model *model = KMP_NEW(kempe_model, 1);
    if (!model)
        return NULL;
    model->context = context;
    model->file = kmp_arena_strdup(&model->arena, label);
    if (model->file)
        return model;
    kempe_model_free(model);
    return NULL;
}

static kempe_status fail_memory(kempe_context *context)
{
    kmp_context_clear(context);
    return kmp_fail_memory(context);
}

/* `status`: of loading the document. */
static kempe_status read_document(kmp_reader *r, kempe_status status)
{
    if (r->root && status != KEMPE_E_MEMORY)
        read_parts(r);
    bool memory = status != KEMPE_E_MEMORY && !r->scratch.failed && !r->model->arena.failed;
    if (memory && (status != KEMPE_OK || r->wrong)) {
        status = sort_complaints(r);
        memory = status != KEMPE_E_MEMORY;
    }
    return memory ? status : fail_memory(r->context);
}

static kempe_status finish_reading(kmp_reader *r, kempe_status loaded, kempe_model **model)
{
    kempe_status status = read_document(r, loaded);
    kmp_arena_free(&r->scratch);
    if (status == KEMPE_OK)
        *model = r->model;
    else
        kempe_model_free(r->model);
    return status;
}

static kempe_status read_model(kempe_context *context, const char *text, size_t length, const char *label,
                               kempe_model **model)
{
    kmp_reader r = {.context = context, .model = new_model(context, label)};
    if (!r.model)
        return kmp_fail_memory(context);
    r.file = r.model->file;
    return finish_reading(&r, kmp_yaml_load(context, &r.scratch, r.file, text, length, &r.root), model);
}

kempe_status kmp_builder_read(kempe_context *context, const kmp_builder *builder, const char *label,
                              kempe_model **model)
{
    kmp_reader r = {
        .context = context, .model = new_model(context, label), .root = builder->root, .calls = builder->calls};
    if (!r.model)
        return kmp_fail_memory(context);
    r.file = r.model->file;
    return finish_reading(&r, KEMPE_OK, model);
}

kempe_status kempe_model_read(kempe_context *context, const char *path, kempe_model **model)
{
    char *text;
    size_t length;
    kmp_context_clear(context);
    kempe_status status = kmp_file_read(context, path, &text, &length);
    if (status != KEMPE_OK)
        return status;
    status = read_model(context, text, length, path, model);
    kmp_free(text);
    return status;
}

kempe_status kempe_model_read_text(kempe_context *context, const char *text, const char *label, kempe_model **model)
{
    kmp_context_clear(context);
    return read_model(context, text, strlen(text), label, model);
}

/* -- the frozen model ---------------------------------------------------------------------------- */

void kempe_model_free(kempe_model *model)
{
    if (!model)
        return;
    kmp_builder_free(model->builder);
    kmp_arena_free(&model->arena);
    kmp_free(model);
}

const char *kempe_model_name(const kempe_model *model)
{
    return model->name;
}

int kempe_model_coordinate_count(const kempe_model *model)
{
    return model->motion_count;
}

const char *kempe_model_coordinate_name(const kempe_model *model, int k)
{
    return model->motions[k].name;
}
