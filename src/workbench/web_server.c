/* SPDX-License-Identifier: BSD-3-Clause */
/* The server of a workbench: HTTP by libmicrohttpd, which is loaded when a workbench begins, with a thread for each
 * connection. A request is judged by its host, origin, token and length before any of its body is taken. */
#include "base/context.h"
#include "base/file.h"
#include "base/loaded_library.h"
#include "base/memory.h"
#include "language_server/json_value.h"
#include "platform/platform.h"
#include "workbench/message_lines.h"
#include "workbench/served_file.h"
#include "workbench/served_run.h"
#include "workbench/web_parts.h"
#include <errno.h>
#include <kempe/language_server.h>
#include <kempe/settings.h>
#include <kempe/workbench.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum {
    TOKEN_BYTES = 16,
    MOST_BODY = 16 << 20,
    MOST_CONNECTIONS = 200,
    PATIENCE_S = 20, /* a client that sends or takes nothing for so long is left */
    LONGEST_WAIT_S = 25,
    MISSING_S = 1, /* programs that save may remove the file for a moment */
    LOOK_NS = 100000000
};

struct kempe_workbench {
    kempe_context *context; /* not owned */
    kmp_served_file file;
    kmp_served_runs runs;
    char *command, *address;
    char readable[KMP_PATH_MOST]; /* the folder whose files are read, without links */
    char token[2 * TOKEN_BYTES + 1], hosts[2][32];
    pthread_mutex_t drag_lock;
    kempe_context *drag_context;
    kempe_drag *drag;
    struct MHD_Daemon *daemon; /* NULL: it has not begun */
};

const char *kempe_workbench_address(const kempe_workbench *workbench)
{
    return workbench ? workbench->address : NULL;
}

void kempe_workbench_wait(const kempe_workbench *workbench)
{
    while (workbench && !kmp_interrupted(workbench->context))
        kmp_thread_rest(LOOK_NS);
}

#ifdef KEMPE_MICROHTTPD_LIBRARY
#include <microhttpd.h>

/* -- the library ------------------------------------------------------------------------------------- */

#define FUNCTIONS(ONE)                                                                                                 \
    ONE(start_daemon)                                                                                                  \
    ONE(stop_daemon)                                                                                                   \
    ONE(create_response_from_buffer)                                                                                   \
    ONE(add_response_header)                                                                                           \
    ONE(queue_response)                                                                                                \
    ONE(destroy_response)                                                                                              \
    ONE(get_connection_values)                                                                                         \
    ONE(lookup_connection_value)                                                                                       \
    ONE(get_connection_info)                                                                                           \
    ONE(set_connection_option)

static struct {
#define ONE(name) __typeof__(MHD_##name) *name;
    FUNCTIONS(ONE)
#undef ONE
} library;

static const char *missing(void)
{
#define ONE(name) "MHD_" #name,
    static const char *const names[] = {FUNCTIONS(ONE)};
#undef ONE
    static kmp_loaded_library loaded = KMP_LOADED_LIBRARY(KEMPE_MICROHTTPD_LIBRARY, names, &library);
    return kmp_library_missing(&loaded);
}

/* -- answers ----------------------------------------------------------------------------------------- */

/* A request while it comes in, and its answer. */
typedef struct request {
    kempe_workbench *bench;
    struct MHD_Connection *connection;
    const char *method, *name; /* the name behind the token */
    kmp_text body, answer;
    bool too_long, judged;
} request;

static const char *type_of(const char *name)
{
    static const char *const types[][2] = {{".html", "text/html; charset=utf-8"},
                                           {".js", "text/javascript; charset=utf-8"},
                                           {".mjs", "text/javascript; charset=utf-8"},
                                           {".css", "text/css; charset=utf-8"},
                                           {".svg", "image/svg+xml"}};
    const char *ending = kmp_file_ending(name);
    for (size_t k = 0; k < sizeof types / sizeof *types; k++)
        if (strcmp(types[k][0], ending) == 0)
            return types[k][1];
    return "application/json; charset=utf-8";
}

/* Gives the answer's text to the library. */
static enum MHD_Result give(request *r, unsigned code, const char *type)
{
    static const char *const headers[][2] = {
        {"Cache-Control", "no-store"},
        {"Referrer-Policy", "no-referrer"}, /* the address has the token */
        {"X-Content-Type-Options", "nosniff"},
        {"X-Frame-Options", "DENY"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
        {"Cross-Origin-Opener-Policy", "same-origin"},
        {"Content-Security-Policy", "default-src 'self' blob: data: 'unsafe-inline'; connect-src 'self' blob: data:; "
                                    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"}};
    const bool failed = r->answer.failed;
    struct MHD_Response *response = library.create_response_from_buffer(
        failed ? 0 : r->answer.length, failed ? (void *)(uintptr_t) "" : r->answer.s, MHD_RESPMEM_MUST_COPY);
    if (!response)
        return MHD_NO;
    bool good = library.add_response_header(response, "Content-Type", type) == MHD_YES;
    for (size_t k = 0; good && k < sizeof headers / sizeof *headers; k++)
        good = library.add_response_header(response, headers[k][0], headers[k][1]) == MHD_YES;
    const enum MHD_Result queued =
        good ? library.queue_response(r->connection, failed ? MHD_HTTP_INTERNAL_SERVER_ERROR : code, response) : MHD_NO;
    library.destroy_response(response);
    return queued;
}

static enum MHD_Result give_json(request *r, unsigned code)
{
    return give(r, code, type_of(""));
}

static enum MHD_Result refuse(request *r, unsigned code, const char *sentence)
{
    kmp_text_free(&r->answer);
    kmp_text_put(&r->answer, "{\"error\": ");
    kmp_text_quote(&r->answer, sentence);
    kmp_text_put(&r->answer, "}\n");
    return give_json(r, code);
}

/* -- who sends ---------------------------------------------------------------------------------------- */

/* The headers of a request, counted and judged. */
typedef struct headers {
    const kempe_workbench *bench;
    int hosts, origins;
    bool foreign;
} headers;

static bool is_own_host(const kempe_workbench *w, const char *host)
{
    return strcmp(host, w->hosts[0]) == 0 || strcmp(host, w->hosts[1]) == 0;
}

static bool is_header(const char *name, const char *lower)
{
    for (; *name && *lower; name++, lower++)
        if ((*name >= 'A' && *name <= 'Z' ? *name + 'a' - 'A' : *name) != *lower)
            return false;
    return !*name && !*lower;
}

static enum MHD_Result take_header(void *user, enum MHD_ValueKind kind, const char *name, const char *value)
{
    static const char scheme[] = "http://";
    headers *h = user;
    (void)kind;
    if (is_header(name, "host")) {
        h->hosts++;
        h->foreign = h->foreign || !value || !is_own_host(h->bench, value);
    } else if (is_header(name, "origin")) {
        h->origins++;
        h->foreign = h->foreign || !value || strncmp(value, scheme, strlen(scheme)) != 0 ||
                     !is_own_host(h->bench, value + strlen(scheme));
    }
    return MHD_YES;
}

/* The time does not depend on how much of it is right. */
static bool has_token(const kempe_workbench *w, const char *path)
{
    const size_t length = strlen(w->token);
    unsigned differs = 0;
    if (path[0] != '/' || strlen(path) < length + 2 || path[length + 1] != '/')
        return false;
    for (size_t k = 0; k < length; k++)
        differs |= (unsigned)(unsigned char)path[k + 1] ^ (unsigned)(unsigned char)w->token[k];
    return differs == 0;
}

/* -- requests ---------------------------------------------------------------------------------------- */

static enum MHD_Result give_file(request *r)
{
    /* The number of an argument of the address; -1: it has none, or no number. */
    const char *value = library.lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "after");
    char *end = NULL;
    const long number = value && *value ? strtol(value, &end, 10) : -1;
    const long after = end && !*end ? number : -1;
    double now = kmp_wall_now(), there = now; /* the last time when the file was there */
    const double until = now + LONGEST_WAIT_S;
    kmp_text why = {0};
    long version = kmp_served_file_look(&r->bench->file, &why);
    while (after >= 0 && (version == after || (version == 0 && now <= there + MISSING_S))) {
        now = kmp_wall_now();
        there = version > 0 ? now : there;
        if (now > until || atomic_load(&r->bench->runs.closing)) {
            kmp_text_free(&why);
            return give(r, MHD_HTTP_NO_CONTENT, type_of(""));
        }
        kmp_thread_rest(LOOK_NS);
        kmp_text_free(&why);
        version = kmp_served_file_look(&r->bench->file, &why);
    }
    const enum MHD_Result done = version > 0
                                     ? (kmp_served_file_put(&r->bench->file, &r->answer), give_json(r, MHD_HTTP_OK))
                                     : refuse(r, MHD_HTTP_NOT_FOUND, why.s ? why.s : "");
    kmp_text_free(&why);
    return done;
}

static enum MHD_Result put_file(request *r, const kmp_json_value *body)
{
    const char *text = kmp_json_word(body, "text");
    long version = kmp_json_count(body, "version");
    kmp_text why = {0};
    if (!text || version < 0)
        return refuse(r, MHD_HTTP_BAD_REQUEST, "'text' and 'version' are required");
    if (kmp_json_member(body, "text")->replaced)
        return refuse(r, MHD_HTTP_BAD_REQUEST, KMP_SERVED_NO_TEXT);
    if (kmp_served_file_write(&r->bench->file, text, &version, &why)) {
        kmp_text_printf(&r->answer, "{\"version\": %ld}\n", version);
        return give_json(r, MHD_HTTP_OK);
    }
    const enum MHD_Result done =
        why.length > 0 ? refuse(r, MHD_HTTP_INTERNAL_SERVER_ERROR, why.s)
                       : (kmp_served_file_put(&r->bench->file, &r->answer), give_json(r, MHD_HTTP_CONFLICT));
    kmp_text_free(&why);
    return done;
}

static enum MHD_Result run_command(request *r, const kmp_json_value *body)
{
    const union MHD_ConnectionInfo *info =
        library.get_connection_info(r->connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    kmp_text answer = {0};
    const kmp_run_end end = kmp_served_run_command(&r->bench->runs, body, info ? (int)info->connect_fd : -1, &answer);
    enum MHD_Result done = MHD_NO;
    if (end == KMP_RUN_ENDED) {
        r->answer = answer;
        return give_json(r, MHD_HTTP_OK);
    }
    if (end == KMP_RUN_BUSY)
        done = refuse(r, MHD_HTTP_TOO_MANY_REQUESTS, "four commands run already: wait for one, or stop it");
    else if (end != KMP_RUN_GONE)
        done = refuse(r, end == KMP_RUN_REFUSED ? MHD_HTTP_BAD_REQUEST : MHD_HTTP_INTERNAL_SERVER_ERROR,
                      answer.s ? answer.s : "out of memory");
    kmp_text_free(&answer);
    return done;
}

static enum MHD_Result give_progress(request *r)
{
    const char *name = library.lookup_connection_value(r->connection, MHD_GET_ARGUMENT_KIND, "run");
    kmp_served_run_progress(&r->bench->runs, name ? name : "", &r->answer);
    return give_json(r, MHD_HTTP_OK);
}

static enum MHD_Result stop_command(request *r, const kmp_json_value *body)
{
    const bool stopped = kmp_served_run_stop(&r->bench->runs, kmp_json_word(body, "run"));
    kmp_text_printf(&r->answer, "{\"stopped\": %s}\n", stopped ? "true" : "false");
    return give_json(r, MHD_HTTP_OK);
}

static enum MHD_Result drag_body(request *r)
{
    kempe_workbench *w = r->bench;
    char *answer = NULL;
    (void)pthread_mutex_lock(&w->drag_lock);
    const kempe_status status = kempe_drag_take(w->drag, r->body.s ? r->body.s : "", &answer);
    (void)pthread_mutex_unlock(&w->drag_lock);
    if (!answer)
        return refuse(r, MHD_HTTP_INTERNAL_SERVER_ERROR, "out of memory");
    kmp_text_put(&r->answer, answer);
    kempe_text_free(answer);
    return give_json(r, status == KEMPE_OK           ? MHD_HTTP_OK
                        : status == KEMPE_E_ARGUMENT ? MHD_HTTP_BAD_REQUEST
                                                     : MHD_HTTP_UNPROCESSABLE_CONTENT);
}

/* A whole conversation with a separate language server, which reads files where commands do. */
static enum MHD_Result ask_language_server(request *r)
{
    kempe_language_server *server = NULL;
    kempe_context *context = kempe_context_new();
    char *answer = NULL;
    kempe_status status = context ? kempe_context_set_folder(context, r->bench->readable) : KEMPE_E_MEMORY;
    if (status == KEMPE_OK)
        status = kempe_language_server_new(context, &server);
    if (status == KEMPE_OK)
        status = kempe_language_server_take(server, r->body.s ? r->body.s : "", r->body.length, &answer);
    enum MHD_Result done;
    if (status == KEMPE_OK) {
        kmp_text_put(&r->answer, answer);
        done = give(r, MHD_HTTP_OK, "text/plain; charset=utf-8");
    } else {
        const char *reason = status == KEMPE_E_MEMORY ? "out of memory" : kempe_context_message(context);
        done = refuse(r, status == KEMPE_E_INPUT ? MHD_HTTP_BAD_REQUEST : MHD_HTTP_INTERNAL_SERVER_ERROR, reason);
    }
    kempe_text_free(answer);
    kempe_language_server_free(server);
    kempe_context_free(context);
    return done;
}

/* A part of the page; the page itself is "". */
static enum MHD_Result give_part(request *r)
{
    const char *name = *r->name ? r->name : "workbench_layout.html";
    for (const kmp_web_part *part = kmp_web_parts; part->name; part++)
        if (strcmp(part->name, name) == 0) {
            for (const char *const *line = part->lines; *line; line++)
                kmp_text_put(&r->answer, *line);
            return give(r, MHD_HTTP_OK, type_of(name));
        }
    return refuse(r, MHD_HTTP_NOT_FOUND, "there is nothing at this address");
}

/* The addresses in addition to the page's parts, with a method each. */
static const struct {
    const char *method, *name;
    enum MHD_Result (*answer)(request *r);
    enum MHD_Result (*take)(request *r, const kmp_json_value *body);
} addresses[] = {
    {"GET", "file", give_file, NULL},           {"PUT", "file", NULL, put_file},
    {"POST", "command", NULL, run_command},     {"GET", "progress", give_progress, NULL},
    {"POST", "stop", NULL, stop_command},       {"POST", "drag", drag_body, NULL},
    {"POST", "lsp", ask_language_server, NULL},
};
enum { ADDRESSES = sizeof addresses / sizeof *addresses };

/* The address of a request; ADDRESSES: it may be a part of the page; -1: its method is wrong. */
static int find_address(const request *r)
{
    bool known = false;
    for (int k = 0; k < ADDRESSES; k++) {
        if (strcmp(addresses[k].name, r->name) != 0)
            continue;
        if (strcmp(addresses[k].method, r->method) == 0)
            return k;
        known = true;
    }
    return known || strcmp(r->method, "GET") != 0 ? -1 : ADDRESSES;
}

static enum MHD_Result answer_request(request *r)
{
    const int at = find_address(r);
    if (at < 0)
        return refuse(r, MHD_HTTP_METHOD_NOT_ALLOWED, "this address has no such method");
    if (at == ADDRESSES)
        return give_part(r);
    if (addresses[at].answer)
        return addresses[at].answer(r);
    kmp_arena arena = {0};
    const kmp_json_value *body = kmp_json_read(&arena, r->body.s ? r->body.s : "", r->body.length);
    const enum MHD_Result done = body && body->kind == KMP_JSON_OBJECT
                                     ? addresses[at].take(r, body)
                                     : refuse(r, MHD_HTTP_BAD_REQUEST, "the body is not an object of JSON in UTF-8");
    kmp_arena_free(&arena);
    return done;
}

/* Refuses a request by its headers. True: its body may come. */
static bool passes(request *r, const char *url, enum MHD_Result *done)
{
    headers h = {.bench = r->bench};
    const bool changes = strcmp(r->method, "GET") != 0;
    const char *length = library.lookup_connection_value(r->connection, MHD_HEADER_KIND, "Content-Length");
    (void)library.get_connection_values(r->connection, MHD_HEADER_KIND, take_header, &h);
    if (h.foreign || h.hosts != 1 || h.origins > 1 || (changes && h.origins == 0))
        *done = refuse(r, MHD_HTTP_FORBIDDEN, "only the page of this workbench may send requests");
    else if (!has_token(r->bench, url))
        *done = refuse(r, MHD_HTTP_NOT_FOUND, "there is nothing at this address: it needs the token that was printed");
    else if (length && strtod(length, NULL) > MOST_BODY)
        *done = refuse(r, MHD_HTTP_CONTENT_TOO_LARGE, "a request has 16 MiB at most");
    else
        return true;
    return false;
}

static enum MHD_Result on_request(void *user, struct MHD_Connection *connection, const char *url, const char *method,
                                  const char *version, const char *upload, size_t *upload_size, void **state)
{
    request *r = *state;
    enum MHD_Result done;
    (void)version;
    if (!r) {
        *state = r = KMP_NEW(request, 1);
        if (!r)
            return MHD_NO;
        *r = (request){.bench = user, .connection = connection, .method = method};
        return passes(r, url, &done) ? MHD_YES : done;
    }
    if (*upload_size > 0) {
        r->too_long = r->too_long || r->body.length + *upload_size > MOST_BODY;
        if (r->too_long)
            return MHD_NO; /* a body without a length, which has no end */
        kmp_text_append(&r->body, upload, *upload_size);
        *upload_size = 0;
        return r->body.failed ? MHD_NO : MHD_YES;
    }
    r->method = method;
    r->name = url + strlen(r->bench->token) + 2;
    /* The patience is for clients: it does not count the time of the answer. */
    (void)library.set_connection_option(connection, MHD_CONNECTION_OPTION_TIMEOUT, 0U);
    done = answer_request(r);
    (void)library.set_connection_option(connection, MHD_CONNECTION_OPTION_TIMEOUT, (unsigned)PATIENCE_S);
    return done;
}

static void on_end(void *user, struct MHD_Connection *connection, void **state, enum MHD_RequestTerminationCode code)
{
    request *r = *state;
    (void)user, (void)connection, (void)code;
    if (r) {
        kmp_text_free(&r->body);
        kmp_text_free(&r->answer);
        kmp_free(r);
    }
    *state = NULL;
}

static void log_nothing(void *user, const char *format, va_list list)
{
    (void)user, (void)format, (void)list;
}

/* -- its beginning and end --------------------------------------------------------------------------- */

static kempe_status begin_server(kempe_workbench *w, int port)
{
    if (missing())
        return kmp_fail(w->context, KEMPE_E_ARGUMENT, "the workbench needs libmicrohttpd, which is not there: %s",
                        missing());
    const int wished = port, listens = kmp_loopback_listen(&port);
    if (listens < 0)
        return kmp_fail(w->context, KEMPE_E_IO, "cannot listen at port %d of 127.0.0.1: %s", wished, strerror(errno));
    (void)snprintf(w->hosts[0], sizeof w->hosts[0], "127.0.0.1:%d", port);
    (void)snprintf(w->hosts[1], sizeof w->hosts[1], "localhost:%d", port);
    w->address = kmp_calloc(sizeof w->hosts[0] + sizeof w->token + 16, 1);
    KMP_TRY(kmp_made(w->context, w->address));
    (void)sprintf(w->address, "http://%s/%s/", w->hosts[0], w->token);
    w->daemon = library.start_daemon(
        (unsigned)(MHD_USE_THREAD_PER_CONNECTION | MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_POLL | MHD_USE_ITC), 0,
        NULL, NULL, on_request, w, MHD_OPTION_EXTERNAL_LOGGER, log_nothing, (void *)NULL, MHD_OPTION_LISTEN_SOCKET,
        listens, MHD_OPTION_CONNECTION_LIMIT, (unsigned)MOST_CONNECTIONS, MHD_OPTION_CONNECTION_TIMEOUT,
        (unsigned)PATIENCE_S, MHD_OPTION_THREAD_STACK_SIZE, (size_t)4 * KMP_THREAD_STACK, MHD_OPTION_NOTIFY_COMPLETED,
        on_end, (void *)NULL, MHD_OPTION_END);
    if (w->daemon)
        return KEMPE_OK;
    (void)kmp_file_close(listens);
    return kmp_fail(w->context, KEMPE_E_FAILED, "the server of the workbench does not begin");
}

static void end_server(kempe_workbench *w)
{
    if (w->daemon)
        library.stop_daemon(w->daemon);
}

#else

static kempe_status begin_server(kempe_workbench *w, int port)
{
    (void)port;
    return kmp_fail(w->context, KEMPE_E_ARGUMENT,
                    "this build has no workbench: install libmicrohttpd-dev and build Kempe again");
}

static void end_server(kempe_workbench *w)
{
    (void)w;
}

#endif

static bool choose_token(kempe_workbench *w)
{
    unsigned char secret[TOKEN_BYTES];
    if (!kmp_secret(secret, sizeof secret))
        return false;
    for (size_t k = 0; k < sizeof secret; k++)
        (void)snprintf(w->token + 2 * k, 3, "%02x", (unsigned)secret[k]);
    return true;
}

/* Takes the folder that is read, which has the file. */
static kempe_status take_folder(kempe_workbench *w, const char *folder)
{
    if (!folder)
        folder = w->file.folder;
    if (!kmp_path_real(folder, w->readable))
        return kmp_fail(w->context, KEMPE_E_IO, "cannot find the folder '%s': %s", folder, strerror(errno));
    KMP_TRY(kempe_context_set_folder(w->drag_context, w->readable));
    KMP_TRY(kempe_context_set_folder(w->file.context, w->readable));
    if (kmp_context_beyond(w->drag_context, w->file.path))
        return kmp_fail(w->context, KEMPE_E_ARGUMENT, "'%s' is not in the folder '%s'", w->file.name, folder);
    return KEMPE_OK;
}

static kempe_status begin(kempe_workbench *w, const char *file, const char *folder, const char *command, int port)
{
    KMP_TRY(kmp_served_file_init(&w->file, w->context, file));
    w->command = kmp_strdup(command);
    w->drag_context = kempe_context_new();
    KMP_TRY(kmp_made(w->context, w->command && w->drag_context));
    KMP_TRY(take_folder(w, folder));
    KMP_TRY(kempe_drag_new(w->drag_context, w->file.path, &w->drag));
    kmp_served_runs_init(&w->runs, w->command, w->file.folder, w->readable);
    if (!choose_token(w))
        return kmp_fail(w->context, KEMPE_E_FAILED, "this system has no random numbers for the token of the address");
    return begin_server(w, port);
}

kempe_status kempe_workbench_new(kempe_context *context, const char *file, const char *folder, const char *command,
                                 int port, kempe_workbench **workbench)
{
    enum { MOST_PORT = 65535 };
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, file, "file");
    KMP_WANTED(context, command, "command");
    KMP_WANTED(context, workbench, "workbench");
    kmp_context_begin(context);
    if (port < 0 || port > MOST_PORT)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "port %d: give a whole number up to %d, 0 for any free port", port,
                        MOST_PORT);
    KMP_MAKE(context, kempe_workbench, w);
    w->context = context;
    (void)pthread_mutex_init(&w->drag_lock, NULL);
    const kempe_status status = begin(w, file, folder, command, port);
    return KMP_GIVE_OR_FREE(status, workbench, w, kempe_workbench_free);
}

void kempe_workbench_free(kempe_workbench *w)
{
    if (!w)
        return;
    atomic_store(&w->runs.closing, true);
    end_server(w);
    kempe_drag_free(w->drag);
    kempe_context_free(w->drag_context);
    kmp_served_file_free(&w->file);
    (void)pthread_mutex_destroy(&w->drag_lock);
    kmp_free(w->command);
    kmp_free(w->address);
    kmp_free(w);
}
