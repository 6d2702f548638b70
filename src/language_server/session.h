/* SPDX-License-Identifier: BSD-3-Clause */
/* A session of the language server: its open files, and what answers requests about them. */
#pragma once

#include "base/json.h"
#include "language_server/json_value.h"
#include "language_server/model_names.h"
#include "language_server/text_places.h"
#include <kempe/language_server.h>

/** A file that the client has open. */
typedef struct kmp_open_file {
    char *uri, *path, *text;
    long version;
    bool stale; /* its diagnostics are to be sent */
    /* The document as it was when YAML could be read last. */
    kmp_arena arena;
    kmp_text_source good; /* no document: root is NULL */
    bool is_good;         /* it is the one of the present text */
    /* The model as it was when it could be read last. */
    kempe_context *context;
    kempe_model *model;
} kmp_open_file;

struct kempe_language_server {
    kempe_context *context; /* the caller's */
    kempe_context *quiet;   /* of documents: its messages are not read */
    kmp_arena lasting;
    const kmp_json_value *schema;
    kmp_text input, output;
    kmp_open_file **files;
    int file_count;
    kmp_arena work;                 /* of a message */
    const kmp_text_source **closed; /* other files that it needed */
    int closed_count;
    bool wide; /* positions count UTF-16 */
    bool begun, shut;
    int ended;
};

/** An answer: a result, or an error with its code of JSON-RPC. */
typedef struct kmp_reply {
    kmp_json json; /* of the result */
    int code;      /* 0: no error */
    kmp_text sentence;
} kmp_reply;

enum {
    KMP_RPC_NO_JSON = -32700,
    KMP_RPC_NO_REQUEST = -32600,
    KMP_RPC_UNKNOWN = -32601,
    KMP_RPC_PARAMETERS = -32602,
    KMP_RPC_NOT_BEGUN = -32002,
    KMP_RPC_FAILED = -32803
};

/** Ends an answer with an error. */
void kmp_answer_refuse(kmp_reply *answer, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** An open file, by the URI of the client or by its path; NULL: it is not open. */
kmp_open_file *kmp_file_of_uri(kempe_language_server *s, const char *uri);
kmp_open_file *kmp_file_of_path(kempe_language_server *s, const char *path);

/** Takes the text of a file as its present one, which is then the server's. False: no memory. */
bool kmp_open_file_add(kempe_language_server *s, const char *uri, const char *text, long version);
bool kmp_file_take(kempe_language_server *s, kmp_open_file *file, char *text, long version);
void kmp_open_file_remove(kempe_language_server *s, kmp_open_file *file);

/** True if the text is a model of Kempe, or has no key yet. */
bool kmp_file_is_model(const kmp_open_file *file);

/** Sends a message, and frees its text. */
void kmp_session_send(kempe_language_server *s, kmp_text *body);

/** Sends the diagnostics of a file. */
void kmp_file_diagnose(kempe_language_server *s, kmp_open_file *file);

/** The message of reading a file with other texts of files; NULL: it can be read, or there is no memory. The caller
 * frees it by kmp_free. */
char *kmp_file_objection(kempe_language_server *s, const char *path, int count, const char *const *paths,
                         char *const *texts);

/** A source in the folder of another one, or of the library (kmp_source_beside); the document of a file by its path. */
const kmp_text_source *kmp_session_beside(void *session, const kmp_text_source *from, const char *name);
const kmp_text_source *kmp_session_source(kempe_language_server *s, const char *path);
char *kmp_session_uri(kempe_language_server *s, const char *path); /* in the work arena */

/** The document of a text, in an arena; NULL: YAML has an error. */
const kmp_yaml *kmp_session_parse(kempe_language_server *s, kmp_arena *arena, const char *text);

/** Writes a range of bytes of a text. */
void kmp_put_range(const kempe_language_server *s, kmp_json *json, const char *key, const char *text, size_t begin,
                   size_t end);

/* Requests. `offset`: the byte of the position in the present text of the file. */
void kmp_answer_completion(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer);
void kmp_answer_hover(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer);
void kmp_answer_definition(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer);
void kmp_answer_references(kempe_language_server *s, kmp_open_file *file, size_t offset, bool with_declaration,
                           kmp_reply *answer);
void kmp_answer_highlight(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer);
void kmp_answer_prepare_rename(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer);
void kmp_answer_rename(kempe_language_server *s, kmp_open_file *file, size_t offset, const char *name,
                       kmp_reply *answer);
void kmp_answer_symbols(kempe_language_server *s, kmp_open_file *file, kmp_reply *answer);
void kmp_answer_formatting(kempe_language_server *s, kmp_open_file *file, kmp_reply *answer);
