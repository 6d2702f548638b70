/* SPDX-License-Identifier: BSD-3-Clause */
/* The open files of a session, other files that they name, and diagnostics: the sentences of the reader. */
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "language_server/session.h"
#include "model/files/element_library.h"
#include "model/read/reading.h"
#include <stdlib.h>
#include <string.h>

/* -- names of files ----------------------------------------------------------------------------------- */

static const char scheme[] = "file://";

static int hex_digit(char c)
{
    const char *digits = "0123456789abcdef0123456789ABCDEF", *found = c ? strchr(digits, c) : NULL;
    return found ? (int)((found - digits) % 16) : -1;
}

/* The path of a file://; the URI itself of another scheme, as of a text that is not saved. */
static char *path_of_uri(const char *uri)
{
    if (strncmp(uri, scheme, sizeof scheme - 1) != 0)
        return kmp_strdup(uri);
    const char *from = uri + sizeof scheme - 1;
    from += *from == '/' ? 0 : strcspn(from, "/"); /* a host */
    char *path = kmp_strdup(from), *to = path;
    for (; path && *from; from++) {
        const int high = *from == '%' ? hex_digit(from[1]) : -1, low = high >= 0 ? hex_digit(from[2]) : -1;
        const int code = low >= 0 ? 16 * high + low : 0;
        *to++ = code > 0 ? (char)code : *from;
        from += code > 0 ? 2 : 0;
    }
    if (path)
        *to = '\0';
    return path;
}

char *kmp_session_uri(kempe_language_server *s, const char *path)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.~/";
    const kmp_open_file *open = kmp_file_of_path(s, path);
    kmp_text uri = {0};
    if (open)
        kmp_text_put(&uri, open->uri);
    else
        kmp_text_put(&uri, scheme);
    for (const char *c = open ? "" : path; *c; c++)
        if (strchr(plain, *c))
            kmp_text_append(&uri, c, 1);
        else
            kmp_text_printf(&uri, "%%%02X", (unsigned char)*c);
    return kmp_text_keep(&uri, &s->work);
}

kmp_open_file *kmp_file_of_uri(kempe_language_server *s, const char *uri)
{
    for (int k = 0; uri && k < s->file_count; k++)
        if (strcmp(s->files[k]->uri, uri) == 0)
            return s->files[k];
    return NULL;
}

kmp_open_file *kmp_file_of_path(kempe_language_server *s, const char *path)
{
    for (int k = 0; k < s->file_count; k++)
        if (strcmp(s->files[k]->path, path) == 0)
            return s->files[k];
    return NULL;
}

/* -- documents ---------------------------------------------------------------------------------------- */

const kmp_yaml *kmp_session_parse(kempe_language_server *s, kmp_arena *arena, const char *text)
{
    const kmp_yaml *root = NULL;
    kmp_context_clear(s->quiet);
    const kempe_status status = kmp_yaml_load(s->quiet, arena, "", 0, text, strlen(text), &root);
    kmp_context_clear(s->quiet);
    return status == KEMPE_OK || (status == KEMPE_E_INPUT && root) ? root : NULL;
}

/* Keeps the document of the present text, if it has one. */
static void keep_document(kempe_language_server *s, kmp_open_file *file)
{
    kmp_arena arena = {0};
    const char *text = kmp_arena_strdup(&arena, file->text);
    const kmp_yaml *root = text ? kmp_session_parse(s, &arena, text) : NULL;
    file->is_good = root && !arena.failed;
    if (!file->is_good) {
        kmp_arena_free(&arena);
        return;
    }
    kmp_arena_free(&file->arena);
    file->arena = arena;
    file->good = (kmp_text_source){file->path, text, root};
}

bool kmp_file_take(kempe_language_server *s, kmp_open_file *file, char *text, long version)
{
    if (!text)
        return false;
    kmp_free(file->text);
    file->text = text;
    file->version = version;
    file->stale = true;
    keep_document(s, file);
    for (int k = 0; k < s->file_count; k++) /* which may include it */
        s->files[k]->stale = s->files[k]->stale || kmp_yaml_get(s->files[k]->good.root, "include");
    return true;
}

static void free_file(kmp_open_file *file)
{
    if (!file)
        return;
    kempe_model_free(file->model);
    kempe_context_free(file->context);
    kmp_arena_free(&file->arena);
    kmp_free(file->uri);
    kmp_free(file->path);
    kmp_free(file->text);
    kmp_free(file);
}

bool kmp_open_file_add(kempe_language_server *s, const char *uri, const char *text, long version)
{
    kmp_open_file *file = kmp_file_of_uri(s, uri), **files;
    if (file)
        return kmp_file_take(s, file, kmp_strdup(text), version);
    file = KMP_NEW(kmp_open_file, 1);
    files = kmp_list_room(s->files, (size_t)s->file_count, sizeof(kmp_open_file *));
    if (files)
        s->files = files;
    if (file) {
        file->uri = kmp_strdup(uri);
        file->path = path_of_uri(uri);
    }
    if (!files || !file || !file->uri || !file->path || !kmp_file_take(s, file, kmp_strdup(text), version)) {
        free_file(file);
        return false;
    }
    s->files[s->file_count++] = file;
    return true;
}

void kmp_open_file_remove(kempe_language_server *s, kmp_open_file *file)
{
    for (int k = 0; k < s->file_count; k++)
        if (s->files[k] == file) {
            s->files[k] = s->files[--s->file_count];
            free_file(file);
            return;
        }
}

/* True if a line begins with the key `kempe`, in a document of brackets, too. */
static bool has_version(const char *line)
{
    line += strchr("{\"'", *line) ? strspn(line, "{\"' \t") : 0;
    return strncmp(line, "kempe", 5) == 0 && line[5 + strspn(line + 5, " \t\"'")] == ':';
}

bool kmp_file_is_model(const kmp_open_file *file)
{
    const char *line = file->text;
    bool found = has_version(line);
    while (!found && (line = strchr(line, '\n')) != NULL)
        found = has_version(++line);
    return found || !strchr(file->text, ':');
}

/* -- other files -------------------------------------------------------------------------------------- */

const kmp_text_source *kmp_session_source(kempe_language_server *s, const char *path)
{
    const kmp_open_file *open = kmp_file_of_path(s, path);
    if (open && open->good.root)
        return &open->good;
    for (int k = 0; k < s->closed_count; k++)
        if (strcmp(s->closed[k]->path, path) == 0)
            return s->closed[k];
    char *text = NULL;
    size_t length = 0;
    const kempe_status status = kmp_is_element(path) ? kmp_element_read(s->quiet, path, &text, &length)
                                                     : kmp_file_read(s->quiet, KMP_FILE_INCLUDED, path, &text, &length);
    kmp_context_clear(s->quiet);
    if (status != KEMPE_OK)
        return NULL;
    kmp_text_source *source = KMP_ARENA_NEW(&s->work, kmp_text_source, 1);
    const kmp_text_source **closed = kmp_arena_room(&s->work, s->closed, s->closed_count, sizeof *closed);
    const char *own = kmp_arena_strdup(&s->work, text), *own_path = kmp_arena_strdup(&s->work, path);
    kmp_free(text);
    if (!source || !closed || !own || !own_path)
        return NULL;
    *source = (kmp_text_source){own_path, own, kmp_session_parse(s, &s->work, own)};
    s->closed = closed;
    closed[s->closed_count++] = source;
    return source;
}

const kmp_text_source *kmp_session_beside(void *session, const kmp_text_source *from, const char *name)
{
    kempe_language_server *s = session;
    const char *slash = strrchr(from->path, '/');
    const int folder = !slash || *name == '/' || kmp_is_element(name) ? 0 : (int)(slash + 1 - from->path);
    const char *path = kmp_arena_printf(&s->work, "%.*s%s", folder, from->path, name);
    return path ? kmp_session_source(s, path) : NULL;
}

/* -- diagnostics -------------------------------------------------------------------------------------- */

/* Warnings of a reading, a line each. */
static void keep_warning(void *user, kempe_level level, const char *line)
{
    if (level == KEMPE_LOG_WARNING)
        kmp_text_printf(user, "%s\n", line);
}

static kempe_status read_model(kempe_language_server *s, const char *path, kempe_context *context, kempe_model **model)
{
    kempe_status status = KEMPE_OK;
    for (int k = 0; k < s->file_count && status == KEMPE_OK; k++)
        status = kempe_context_set_text(context, s->files[k]->path, s->files[k]->text);
    return status == KEMPE_OK ? kempe_model_read(context, path, model) : status;
}

char *kmp_file_objection(kempe_language_server *s, const char *path, int count, const char *const *paths,
                         char *const *texts)
{
    kempe_context *context = kmp_context_new_below(s->context);
    kempe_model *model = NULL;
    char *message = NULL;
    kempe_status status = KEMPE_OK;
    for (int k = 0; context && k < s->file_count && status == KEMPE_OK; k++)
        status = kempe_context_set_text(context, s->files[k]->path, s->files[k]->text);
    for (int k = 0; context && k < count && status == KEMPE_OK; k++)
        status = kempe_context_set_text(context, paths[k], texts[k]);
    if (context && status == KEMPE_OK && kempe_model_read(context, path, &model) != KEMPE_OK)
        message = kmp_strdup(kempe_context_message(context));
    kempe_model_free(model);
    kempe_context_free(context);
    return message;
}

/* A sentence of the reader with its place. */
typedef struct reported_place {
    const char *file, *sentence;
    size_t file_length;
    kmp_place place;
} reported_place;

/* `file:line:column: sentence`; without a place the line is the sentence. */
static reported_place split_line(const char *line)
{
    for (const char *at = strchr(line, ':'); at; at = strchr(at + 1, ':')) {
        char *end;
        const long number = strtol(at + 1, &end, 10);
        if (end == at + 1 || *end != ':' || number < 1)
            continue;
        const char *second = end + 1;
        const long column = strtol(second, &end, 10);
        if (end == second || strncmp(end, ": ", 2) != 0 || column < 1 || number > 100000000 || column > 100000000)
            continue;
        return (reported_place){.file = line,
                                .file_length = (size_t)(at - line),
                                .sentence = end + 2,
                                .place = {.line = (int)number, .column = (int)column}};
    }
    return (reported_place){.file = line, .sentence = line, .place = {.line = 1, .column = 1}};
}

/* The end of the word at a byte, at least one character where the line has one. */
static size_t word_end(const char *text, size_t begin)
{
    size_t end = begin + strcspn(text + begin, " \t\r\n,]}:#\"'");
    if (end == begin && text[end] && !strchr("\r\n", text[end]))
        do
            end++;
        while (((unsigned char)text[end] & 0xC0) == 0x80);
    return end;
}

/* The key `file` of the include by which an error comes from another file. */
static kmp_place include_of(const kmp_open_file *file, const reported_place *said)
{
    const kmp_yaml *include = kmp_yaml_get(file->good.root, "include");
    const char *name = said->file;
    for (size_t k = 0; k + 1 < said->file_length; k++)
        name = said->file[k] == '/' ? said->file + k + 1 : name;
    const size_t length = said->file_length - (size_t)(name - said->file);
    for (int k = 0; include && include->kind == KMP_YAML_LIST && k < include->count; k++) {
        const kmp_yaml *path = kmp_yaml_get(include->items[k], "file");
        const char *slash = path ? strrchr(path->text, '/') : NULL, *own = slash ? slash + 1 : path ? path->text : "";
        if (path && strlen(own) == length && strncmp(own, name, length) == 0)
            return path->text_place;
    }
    return include ? include->place : (kmp_place){.line = 1, .column = 1};
}

static void put_diagnostic(kempe_language_server *s, kmp_json *json, const kmp_open_file *file, const char *line,
                           int severity)
{
    const reported_place said = split_line(line);
    const bool own = said.file_length == 0 ||
                     (strlen(file->path) == said.file_length && strncmp(file->path, said.file, said.file_length) == 0);
    const size_t begin = kmp_offset_of_place(file->text, own ? said.place : include_of(file, &said));
    kmp_json_object(json, NULL);
    kmp_put_range(s, json, "range", file->text, begin, word_end(file->text, begin));
    kmp_json_put(json, "severity %d source %s message %s", severity, "kempe", own ? said.sentence : line);
    const char *path = own ? NULL : kmp_arena_printf(&s->work, "%.*s", (int)said.file_length, said.file);
    const kmp_text_source *source = path ? kmp_session_source(s, path) : NULL;
    if (source && !kmp_is_element(path)) {
        const size_t there = kmp_offset_of_place(source->text, said.place);
        kmp_json_array(json, "relatedInformation");
        kmp_json_object(json, NULL);
        kmp_json_object(json, "location");
        kmp_json_string(json, "uri", kmp_session_uri(s, path));
        kmp_put_range(s, json, "range", source->text, there, word_end(source->text, there));
        kmp_json_end(json);
        kmp_json_string(json, "message", said.sentence);
        kmp_json_end(json);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

/* A diagnostic for each line. */
static void put_lines(kempe_language_server *s, kmp_json *json, const kmp_open_file *file, const char *lines,
                      int severity)
{
    char *copy = kmp_arena_strdup(&s->work, lines);
    for (char *line = copy; line && *line;) {
        char *end = line + strcspn(line, "\n");
        const bool last = !*end;
        *end = '\0';
        if (*line)
            put_diagnostic(s, json, file, line, severity);
        line = last ? NULL : end + 1;
    }
}

void kmp_session_send(kempe_language_server *s, kmp_text *body)
{
    kmp_text_printf(&s->output, "Content-Length: %zu\r\n\r\n", body->length);
    kmp_text_append(&s->output, body->s ? body->s : "", body->length);
    kmp_text_free_part(&s->output, body);
}

void kmp_file_diagnose(kempe_language_server *s, kmp_open_file *file)
{
    enum { ERROR = 1, WARNING = 2, INFORMATION = 3 };
    kmp_text body = {0}, warnings = {0};
    kmp_json json = kmp_json_begin_as(&body, KMP_JSON_COMPACT);
    kempe_context *context = kmp_context_new_below(s->context);
    kempe_model *model = NULL;
    file->stale = false;
    kmp_json_put(&json, "{ jsonrpc %s method %s params { uri %s version %ld diagnostics [", "2.0",
                 "textDocument/publishDiagnostics", file->uri, file->version);
    const bool shown = kmp_file_is_model(file) && strchr(file->text, ':');
    if (context && shown) {
        kempe_context_set_log(context, keep_warning, &warnings);
        const kempe_status status = read_model(s, file->path, context, &model);
        const bool part = kmp_yaml_get(file->good.root, "ports"); /* of other models, which read it */
        if (status != KEMPE_OK)
            put_lines(s, &json, file, kempe_context_message(context), part && file->is_good ? INFORMATION : ERROR);
        put_lines(s, &json, file, warnings.s ? warnings.s : "", WARNING);
    }
    kmp_json_put(&json, "] } }");
    if (model) {
        kempe_model_free(file->model);
        kempe_context_free(file->context);
        file->model = model;
        file->context = context;
        kempe_context_set_log(context, NULL, NULL);
    } else {
        kempe_context_free(context);
    }
    kmp_text_free(&warnings);
    kmp_session_send(s, &body);
}
