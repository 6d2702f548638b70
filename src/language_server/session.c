/* SPDX-License-Identifier: BSD-3-Clause */
/* The protocol: headers, messages of JSON-RPC, requests by their names. */
#include "language_server/session.h"
#include "base/context.h"
#include "base/memory.h"
#include <stdlib.h>
#include <string.h>

enum { MOST_HEADER = 4096, MOST_MESSAGE = 64 << 20 };

/* -- answers ------------------------------------------------------------------------------------------ */

void kmp_answer_refuse(kmp_reply *answer, int code, const char *format, ...)
{
    answer->code = code;
    kmp_text_free(&answer->sentence);
    KMP_TEXT_ARGUMENTS(&answer->sentence, format);
}

void kmp_put_range(const kempe_language_server *s, kmp_json *json, const char *key, const char *text, size_t begin,
                   size_t end)
{
    const kmp_position from = kmp_position_of(text, begin, s->wide), to = kmp_position_of(text, end, s->wide);
    kmp_json_object(json, key);
    kmp_json_put(json, "start { line %ld character %ld } end { line %ld character %ld }", from.line, from.unit, to.line,
                 to.unit);
    kmp_json_end(json);
}

static void send_answer(kempe_language_server *s, const kmp_json_value *id, kmp_text *result, kmp_reply *answer)
{
    kmp_text body = {0};
    kmp_text_put(&body, "{\"jsonrpc\":\"2.0\",\"id\":");
    /* Writes a member as it was read: the number of a request, which may be a word. */
    if (id && id->kind == KMP_JSON_STRING)
        kmp_text_quote(&body, id->text);
    else
        kmp_text_put(&body, id && id->kind == KMP_JSON_NUMBER ? id->text : "null");
    if (answer->code) {
        kmp_text_printf(&body, ",\"error\":{\"code\":%d,\"message\":", answer->code);
        kmp_text_quote(&body, answer->sentence.s ? answer->sentence.s : "");
        kmp_text_put(&body, "}}");
    } else {
        kmp_text_printf(&body, ",\"result\":%s}", result->length > 0 ? result->s : "null");
    }
    kmp_session_send(s, &body);
    kmp_text_free_part(&s->output, result);
    kmp_text_free(&answer->sentence);
}

/* -- the begin and the end ---------------------------------------------------------------------------- */

static void initialize(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer)
{
    const kmp_json_value *general = kmp_json_member(kmp_json_member(parameters, "capabilities"), "general"),
                         *offered = kmp_json_member(general, "positionEncodings");
    s->wide = true;
    for (int k = 0; offered && offered->kind == KMP_JSON_ARRAY && k < offered->count; k++)
        s->wide = s->wide && strcmp(offered->items[k]->text, "utf-8") != 0;
    s->begun = true;
    kmp_json_put(&answer->json,
                 "{ capabilities { positionEncoding %s textDocumentSync { openClose %i change %d } "
                 "completionProvider { triggerCharacters [ %s %s %s ] } hoverProvider %i definitionProvider %i "
                 "referencesProvider %i documentHighlightProvider %i renameProvider { prepareProvider %i } "
                 "documentSymbolProvider %i documentFormattingProvider %i } serverInfo { name %s version %s } }",
                 s->wide ? "utf-16" : "utf-8", 1, 2, ".", "(", ":", 1, 1, 1, 1, 1, 1, 1, "kempe", kempe_version());
}

static void shut_down(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer)
{
    (void)parameters, (void)answer;
    s->shut = true;
}

/* -- requests about files ----------------------------------------------------------------------------- */

/* The open file of a request; NULL after an error. */
static kmp_open_file *file_of(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer)
{
    const char *uri = kmp_json_word(kmp_json_member(parameters, "textDocument"), "uri");
    kmp_open_file *file = kmp_file_of_uri(s, uri);
    if (!uri)
        kmp_answer_refuse(answer, KMP_RPC_PARAMETERS, "the request has no textDocument with a uri");
    else if (!file)
        kmp_answer_refuse(answer, KMP_RPC_PARAMETERS, "'%s' is not open", uri);
    return file;
}

/* The file and the byte of a request with a position; NULL after an error. */
static kmp_open_file *place_of(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer,
                               size_t *offset)
{
    const kmp_json_value *position = kmp_json_member(parameters, "position");
    kmp_open_file *file = file_of(s, parameters, answer);
    const kmp_position at = {kmp_json_count(position, "line"), kmp_json_count(position, "character")};
    if (file && (at.line < 0 || at.unit < 0)) {
        kmp_answer_refuse(answer, KMP_RPC_PARAMETERS,
                          "the position has no line and character, whole numbers from 0 on");
        return NULL;
    }
    *offset = file ? kmp_offset_of(file->text, at, s->wide) : 0;
    return file;
}

#define AT_POSITION(name)                                                                                              \
    static void name(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer)                    \
    {                                                                                                                  \
        size_t offset;                                                                                                 \
        kmp_open_file *file = place_of(s, parameters, answer, &offset);                                                \
        if (file && kmp_file_is_model(file))                                                                           \
            kmp_answer_##name(s, file, offset, answer);                                                                \
    }
AT_POSITION(completion)
AT_POSITION(hover)
AT_POSITION(definition)
AT_POSITION(highlight)
AT_POSITION(prepare_rename)

static void references(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer)
{
    size_t offset;
    kmp_open_file *file = place_of(s, parameters, answer, &offset);
    const kmp_json_value *with = kmp_json_member(kmp_json_member(parameters, "context"), "includeDeclaration");
    if (file && kmp_file_is_model(file))
        kmp_answer_references(s, file, offset, !with || strcmp(with->text, "false") != 0, answer);
}

static void rename_name(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer)
{
    size_t offset;
    kmp_open_file *file = place_of(s, parameters, answer, &offset);
    const char *name = kmp_json_word(parameters, "newName");
    if (file && !name)
        kmp_answer_refuse(answer, KMP_RPC_PARAMETERS, "the new name is missing: newName");
    else if (file)
        kmp_answer_rename(s, file, offset, name, answer);
}

#define OF_FILE(name)                                                                                                  \
    static void name(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer)                    \
    {                                                                                                                  \
        kmp_open_file *file = file_of(s, parameters, answer);                                                          \
        if (file && kmp_file_is_model(file))                                                                           \
            kmp_answer_##name(s, file, answer);                                                                        \
    }
OF_FILE(symbols)
OF_FILE(formatting)

static const struct {
    const char *method;
    void (*answer)(kempe_language_server *s, const kmp_json_value *parameters, kmp_reply *answer);
} requests[] = {
    {"initialize", initialize},
    {"shutdown", shut_down},
    {"textDocument/completion", completion},
    {"textDocument/hover", hover},
    {"textDocument/definition", definition},
    {"textDocument/references", references},
    {"textDocument/documentHighlight", highlight},
    {"textDocument/prepareRename", prepare_rename},
    {"textDocument/rename", rename_name},
    {"textDocument/documentSymbol", symbols},
    {"textDocument/formatting", formatting},
};

static void answer_request(kempe_language_server *s, const char *method, const kmp_json_value *id,
                           const kmp_json_value *parameters)
{
    kmp_text result = {0};
    kmp_reply answer = {.json = kmp_json_begin_as(&result, KMP_JSON_COMPACT)};
    size_t k = 0;
    while (k < sizeof requests / sizeof *requests && strcmp(requests[k].method, method) != 0)
        k++;
    if (s->shut)
        kmp_answer_refuse(&answer, KMP_RPC_NO_REQUEST, "%s: the server is shut down", method);
    else if (!s->begun && k > 0)
        kmp_answer_refuse(&answer, KMP_RPC_NOT_BEGUN, "%s: the first request is initialize", method);
    else if (s->begun && k == 0)
        kmp_answer_refuse(&answer, KMP_RPC_NO_REQUEST, "initialize: the session has begun already");
    else if (k == sizeof requests / sizeof *requests)
        kmp_answer_refuse(&answer, KMP_RPC_UNKNOWN, "this server has no method '%s'", method);
    else
        requests[k].answer(s, parameters, &answer);
    send_answer(s, id, &result, &answer);
}

/* -- notifications ------------------------------------------------------------------------------------ */

/* One change: the whole text, or a part of it. NULL: no memory, or no change. */
static char *changed(const kempe_language_server *s, const kmp_open_file *file, const kmp_json_value *change)
{
    const char *text = kmp_json_word(change, "text");
    const kmp_json_value *range = kmp_json_member(change, "range"), *start = kmp_json_member(range, "start"),
                         *end = kmp_json_member(range, "end");
    if (!text || !range)
        return text ? kmp_strdup(text) : NULL;
    const kmp_position from = {kmp_json_count(start, "line"), kmp_json_count(start, "character")},
                       to = {kmp_json_count(end, "line"), kmp_json_count(end, "character")};
    size_t begin = kmp_offset_of(file->text, from, s->wide), behind = kmp_offset_of(file->text, to, s->wide);
    behind = behind < begin ? begin : behind;
    kmp_text whole = {0};
    kmp_text_append(&whole, file->text, begin);
    kmp_text_put(&whole, text);
    kmp_text_put(&whole, file->text + behind);
    return kmp_text_take(&whole);
}

static void take_changes(kempe_language_server *s, kmp_open_file *file, long version, const kmp_json_value *changes)
{
    for (int k = 0; changes && changes->kind == KMP_JSON_ARRAY && k < changes->count; k++) {
        char *text = changed(s, file, changes->items[k]);
        if (text && !kmp_file_take(s, file, text, version))
            return;
    }
}

/* An empty list takes the marks of a closed file away. */
static void close_file(kempe_language_server *s, kmp_open_file *file)
{
    kmp_text body = {0};
    kmp_json json = kmp_json_begin_as(&body, KMP_JSON_COMPACT);
    kmp_json_put(&json, "{ jsonrpc %s method %s params { uri %s diagnostics [ ] } }", "2.0",
                 "textDocument/publishDiagnostics", file->uri);
    kmp_session_send(s, &body);
    kmp_open_file_remove(s, file);
}

static void take_notification(kempe_language_server *s, const char *method, const kmp_json_value *parameters)
{
    const kmp_json_value *document = kmp_json_member(parameters, "textDocument");
    const char *uri = kmp_json_word(document, "uri"), *text = kmp_json_word(document, "text");
    kmp_open_file *file = kmp_file_of_uri(s, uri);
    if (strcmp(method, "exit") == 0)
        s->ended = s->shut ? 0 : 1;
    else if (!s->begun || s->shut)
        return;
    else if (strcmp(method, "textDocument/didOpen") == 0 && uri && text)
        s->output.failed = !kmp_open_file_add(s, uri, text, kmp_json_count(document, "version")) || s->output.failed;
    else if (strcmp(method, "textDocument/didChange") == 0 && file)
        take_changes(s, file, kmp_json_count(document, "version"), kmp_json_member(parameters, "contentChanges"));
    else if (strcmp(method, "textDocument/didClose") == 0 && file)
        close_file(s, file);
}

/* -- messages ----------------------------------------------------------------------------------------- */

static void refuse_message(kempe_language_server *s, const kmp_json_value *id, int code, const char *sentence)
{
    kmp_text result = {0};
    kmp_reply answer = {0};
    kmp_answer_refuse(&answer, code, "%s", sentence);
    send_answer(s, id, &result, &answer);
}

static void take_message(kempe_language_server *s, const char *body, size_t length)
{
    const kmp_json_value *message = kmp_json_read(&s->work, body, length), *id = kmp_json_member(message, "id");
    const char *method = kmp_json_word(message, "method");
    const bool answers = !method && (kmp_json_member(message, "result") || kmp_json_member(message, "error"));
    if (!message)
        refuse_message(s, NULL, KMP_RPC_NO_JSON, "the message is not in JSON");
    else if (!method && !answers)
        refuse_message(s, id, KMP_RPC_NO_REQUEST, "the message is not a request of JSON-RPC: it has no method");
    else if (method && id)
        answer_request(s, method, id, kmp_json_member(message, "params"));
    else if (method)
        take_notification(s, method, kmp_json_member(message, "params"));
    s->output.failed = s->output.failed || s->work.failed;
    kmp_arena_free(&s->work);
    s->closed = NULL;
    s->closed_count = 0;
}

/* The bytes of the headers and of the body behind them; headers 0: they are not complete; -1: they are none. */
static long read_headers(const char *bytes, size_t length, size_t *body)
{
    static const char name[] = "content-length:";
    const char *end = NULL;
    for (size_t k = 0; k + 4 <= length && k < MOST_HEADER && !end; k++)
        end = memcmp(bytes + k, "\r\n\r\n", 4) == 0 ? bytes + k : NULL;
    if (!end)
        return length < MOST_HEADER ? 0 : -1;
    for (const char *line = bytes; line < end;) {
        size_t same = 0;
        while (name[same] && (line[same] | 32) == (name[same] | 32))
            same++;
        if (!name[same]) {
            char *behind;
            const long count = strtol(line + same, &behind, 10);
            *body = (size_t)count;
            return count >= 0 && count <= MOST_MESSAGE && *behind == '\r' ? end + 4 - bytes : -1;
        }
        while (line < end && *line != '\n')
            line++;
        line++;
    }
    return -1;
}

kempe_status kempe_language_server_take(kempe_language_server *server, const char *bytes, size_t count, char **answer)
{
    KMP_GIVEN(server, KEMPE_E_ARGUMENT);
    kempe_language_server *s = server;
    KMP_WANTED(s->context, bytes, "bytes");
    KMP_WANTED(s->context, answer, "answer");
    size_t done = 0, body;
    long headers = 0;
    kmp_text_append(&s->input, bytes, count);
    while (s->ended < 0 && s->input.length > done &&
           (headers = read_headers(s->input.s + done, s->input.length - done, &body)) > 0 &&
           s->input.length - done - (size_t)headers >= body) {
        take_message(s, s->input.s + done + headers, body);
        done += (size_t)headers + body;
    }
    kmp_text rest = {0};
    if (s->input.length > done)
        kmp_text_append(&rest, s->input.s + done, s->input.length - done);
    kmp_text_free_part(&s->output, &s->input);
    s->input = rest;
    for (int k = 0; k < s->file_count && s->ended < 0; k++)
        if (s->files[k]->stale)
            kmp_file_diagnose(s, s->files[k]);
    s->output.failed = s->output.failed || s->work.failed;
    kmp_arena_free(&s->work);
    s->closed = NULL;
    s->closed_count = 0;
    kmp_text_put(&s->output, "");
    *answer = kmp_text_take(&s->output);
    if (!*answer || rest.failed)
        return kmp_fail_memory(s->context);
    if (headers >= 0 || s->ended >= 0)
        return KEMPE_OK;
    s->ended = 1;
    return kmp_fail(s->context, KEMPE_E_INPUT,
                    "the messages of a client begin with 'Content-Length: N' and an empty line: an editor starts the "
                    "language server");
}

/* -- the session -------------------------------------------------------------------------------------- */

kempe_status kempe_language_server_new(kempe_context *context, kempe_language_server **server)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, server, "server");
    kempe_language_server *s = KMP_NEW(kempe_language_server, 1);
    if (s) {
        s->context = context;
        s->ended = -1;
        s->wide = true;
        s->quiet = kmp_context_new_below(context); /* it reads the same files */
        s->schema = kmp_schema_read(&s->lasting);
    }
    const kempe_status status = kmp_made(context, s && s->quiet && s->schema);
    return KMP_GIVE_OR_FREE(status, server, s, kempe_language_server_free);
}

KMP_GETTER(int kempe_language_server_is_running(const kempe_language_server *server), server, server->ended < 0, 0)
KMP_GETTER(int kempe_language_server_is_finished(const kempe_language_server *server), server, server->ended == 0, 0)

void kempe_language_server_free(kempe_language_server *server)
{
    if (!server)
        return;
    while (server->file_count > 0)
        kmp_open_file_remove(server, server->files[0]);
    kmp_free(server->files);
    kmp_text_free(&server->input);
    kmp_text_free(&server->output);
    kmp_arena_free(&server->lasting);
    kmp_arena_free(&server->work);
    kempe_context_free(server->quiet);
    kmp_free(server);
}
