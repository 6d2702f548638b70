/* SPDX-License-Identifier: BSD-3-Clause */
#include "workbench/served_run.h"
#include "base/base64.h"
#include "base/file.h"
#include "base/json.h"
#include "base/memory.h"
#include "workbench/message_lines.h"
#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { REST_NS = 4000000, MOST_WORDS = 1000, MOST_FILES = 200 };
enum { FAILED = 1, BUG = 4 }; /* exit codes of the command, where it has none itself */

/* One command while it runs. */
typedef struct job {
    kmp_served_runs *runs;
    kmp_served_run *run;
    kempe_context *context;
    kmp_arena arena;
    const kmp_json_value *request, *words, *files;
    kmp_text *answer; /* or the sentence of a refusal */
} job;

void kmp_served_runs_init(kmp_served_runs *runs, const char *command, const char *folder, const char *readable)
{
    *runs = (kmp_served_runs){.command = command, .folder = folder, .readable = readable};
    (void)pthread_mutex_init(&runs->lock, NULL);
    atomic_init(&runs->closing, false);
    for (int k = 0; k < KMP_MOST_RUNS; k++)
        atomic_init(&runs->run[k].stopped, false);
}

/* -- the scratch folder ------------------------------------------------------------------------------ */

static const char *in_scratch(job *j, const char *name)
{
    return kmp_arena_printf(&j->arena, "%s/%s", j->run->scratch, name);
}

/* Removes the files of a folder, and the folder. */
static void remove_folder(const char *folder)
{
    char path[KMP_PATH_MOST];
    kmp_folder_names *names = kmp_folder_names_begin(folder);
    for (const char *name; names && (name = kmp_folder_names_next(names));)
        if (strcmp(name, ".") != 0 && strcmp(name, "..") != 0 &&
            snprintf(path, sizeof path, "%s/%s", folder, name) < KMP_PATH_MOST)
            (void)kmp_path_remove(path);
    kmp_folder_names_end(names);
    (void)kmp_folder_remove(folder);
}

static bool fail(job *j, const char *what)
{
    kmp_text_printf(j->answer, "%s: %s", what, strerror(errno));
    return false;
}

static bool make_scratch(job *j)
{
    char temporary[KMP_PATH_MOST], path[KMP_PATH_MOST];
    kmp_path_temporary(temporary);
    if (snprintf(path, sizeof path, "%s/kempe-XXXXXX", temporary) >= KMP_PATH_MOST || !kmp_folder_temporary(path))
        return fail(j, "cannot make a folder for the command");
    (void)pthread_mutex_lock(&j->runs->lock); /* others may ask where it is */
    (void)snprintf(j->run->scratch, sizeof j->run->scratch, "%s", path);
    (void)pthread_mutex_unlock(&j->runs->lock);
    const char *out = in_scratch(j, "out");
    return (out && kmp_folder_create(out, true)) || fail(j, "cannot make a folder for the command");
}

/* The files of the request, which are read in place of the files of their names. */
static bool put_texts(job *j)
{
    for (int k = 0; j->files && k < j->files->count; k++) {
        const char *path = kmp_arena_printf(&j->arena, "%s/text%d", j->run->scratch, k);
        if (!path || kempe_write_file(j->context, path, j->files->items[k]->text) != KEMPE_OK) {
            kmp_text_put(j->answer, kempe_context_message(j->context));
            return false;
        }
    }
    return true;
}

/* -- the request ------------------------------------------------------------------------------------- */

/* A name within the folder of the model: no part of it leads out. */
static bool is_within(const char *name)
{
    if (!*name || kmp_path_is_whole(name) || strchr(name, '\\') || strchr(name, ':'))
        return false;
    for (const char *part = name; part; part = strchr(part, '/') ? strchr(part, '/') + 1 : NULL)
        if (strncmp(part, "..", 2) == 0 && (part[2] == '/' || !part[2]))
            return false;
    return true;
}

static const char *plain_name(const char *name)
{
    return strncmp(name, "/model/", 7) == 0 ? name + 7 : name;
}

/* A sentence about what is wrong; NULL: nothing. */
static const char *judge(const job *j)
{
    if (!j->words || j->words->kind != KMP_JSON_ARRAY || j->words->count < 1 || j->words->count > MOST_WORDS)
        return "'words' is the list of the command's words";
    for (int k = 0; k < j->words->count; k++)
        if (j->words->items[k]->kind != KMP_JSON_STRING)
            return "each of 'words' is a text";
    if (j->files && (j->files->kind != KMP_JSON_OBJECT || j->files->count > MOST_FILES))
        return "'files' has texts by their names";
    for (int k = 0; j->files && k < j->files->count; k++)
        if (j->files->items[k]->kind != KMP_JSON_STRING || !is_within(plain_name(j->files->keys[k])))
            return "each of 'files' is a text, and its name is one in the folder of the model";
        else if (j->files->items[k]->replaced)
            return KMP_SERVED_NO_TEXT;
    const char *run = kmp_json_word(j->request, "run");
    return run && strlen(run) >= KMP_RUN_NAME ? "'run' is a short name" : NULL;
}

/* The words of the process; NULL: no memory. */
static char **list_words(job *j)
{
    const int given = j->files ? j->files->count : 0;
    char **words = KMP_ARENA_NEW(&j->arena, char *, given + j->words->count + 6);
    int count = 0;
    if (!words)
        return NULL;
    words[count++] = kmp_arena_printf(&j->arena, "%s", j->runs->command);
    words[count++] = kmp_arena_printf(&j->arena, "confined");
    words[count++] = kmp_arena_printf(&j->arena, "%s", j->runs->readable);
    words[count++] = kmp_arena_printf(&j->arena, "%s", j->run->scratch);
    words[count++] = kmp_arena_printf(&j->arena, "%d", given);
    for (int k = 0; k < given; k++)
        words[count++] = kmp_arena_printf(&j->arena, "%s", plain_name(j->files->keys[k]));
    for (int k = 0; k < j->words->count; k++)
        words[count++] = kmp_arena_printf(&j->arena, "%s", j->words->items[k]->text);
    return j->arena.failed ? NULL : words;
}

/* -- the answer -------------------------------------------------------------------------------------- */

/* A file of the scratch folder without the path of the folder for results; NULL: no memory. */
static char *read_said(job *j, const char *name)
{
    const char *path = in_scratch(j, name), *prefix = in_scratch(j, "out/");
    char *text = NULL;
    size_t length;
    if (!path || !prefix || kmp_file_read(j->context, KMP_FILE_TABLE, path, &text, &length) != KEMPE_OK)
        return NULL;
    const size_t cut = strlen(prefix);
    char *to = text;
    for (const char *from = text; *from;) {
        from += strncmp(from, prefix, cut) == 0 ? cut : 0;
        if (!*from)
            break;
        *to++ = *from++;
    }
    *to = '\0';
    return text;
}

static void put_files(job *j, kmp_json *json)
{
    const char *out = in_scratch(j, "out");
    kmp_folder_names *names = out ? kmp_folder_names_begin(out) : NULL;
    kmp_json_object(json, "files");
    for (const char *name; names && (name = kmp_folder_names_next(names));) {
        const char *path = kmp_arena_printf(&j->arena, "%s/%s", out, name);
        kmp_path_state state;
        char *bytes;
        size_t length;
        if (!path || !kmp_path_look_here(path, &state) || state.kind != KMP_PATH_FILE ||
            kmp_file_read(j->context, KMP_FILE_TABLE, path, &bytes, &length) != KEMPE_OK)
            continue;
        kmp_json_bytes(json, name, length, bytes);
        kmp_free(bytes);
    }
    kmp_json_end(json);
    kmp_folder_names_end(names);
}

static void put_answer(job *j, int code)
{
    static const char stopped[] = "interrupted before a result was available", ended[] = "the command ended by force";
    const bool was_stopped = code < 0 && atomic_load(&j->run->stopped);
    char *text = read_said(j, "said"), *complaints = read_said(j, "complaints");
    kmp_json json = kmp_json_begin_as(j->answer, KMP_JSON_DENSE);
    const size_t length = text ? strlen(text) : 0;
    if (length > 0 && text[length - 1] == '\n') /* lines are joined, as by kempe.mjs */
        text[length - 1] = '\0';
    kmp_json_object(&json, NULL);
    kmp_json_whole(&json, "code", code >= 0 ? code : was_stopped ? FAILED : BUG);
    kmp_json_string(&json, "text", text ? text : "");
    kmp_put_messages(&json, code < 0 ? (was_stopped ? stopped : ended) : complaints ? complaints : "", j->runs->folder);
    put_files(j, &json);
    kmp_json_end(&json);
    kmp_free(text);
    kmp_free(complaints);
}

/* -- a run ------------------------------------------------------------------------------------------- */

static kmp_run_end wait(job *j, kmp_process *process, int socket)
{
    int code = 0;
    while (!kmp_process_has_ended(process, &code)) {
        if (atomic_load(&j->runs->closing) || kmp_connection_is_closed(socket))
            return KMP_RUN_GONE;
        if (atomic_load(&j->run->stopped))
            kmp_process_interrupt(process);
        kmp_thread_rest(REST_NS);
    }
    put_answer(j, code);
    return KMP_RUN_ENDED;
}

static kmp_run_end run_job(job *j, int socket)
{
    const char *wrong = judge(j);
    if (wrong) {
        kmp_text_put(j->answer, wrong);
        return KMP_RUN_REFUSED;
    }
    char **words = make_scratch(j) && put_texts(j) ? list_words(j) : NULL;
    const char *said = words ? in_scratch(j, "said") : NULL, *complaints = words ? in_scratch(j, "complaints") : NULL;
    kmp_process *process = complaints ? kmp_process_begin(words, j->runs->folder, said, complaints) : NULL;
    if (process) {
        const kmp_run_end end = wait(j, process, socket);
        kmp_process_end(process);
        return end;
    }
    if (j->answer->length == 0)
        kmp_text_printf(j->answer, "the command '%s' does not run", j->runs->command);
    return KMP_RUN_FAILED;
}

/* A free place, which is then taken; NULL: there is none. */
static kmp_served_run *take_place(kmp_served_runs *runs, const char *name)
{
    kmp_served_run *run = NULL;
    (void)pthread_mutex_lock(&runs->lock);
    for (int k = 0; k < KMP_MOST_RUNS && !run; k++)
        if (!runs->run[k].taken)
            run = &runs->run[k];
    if (run) {
        run->taken = true;
        run->scratch[0] = '\0';
        (void)snprintf(run->name, sizeof run->name, "%s", name ? name : "");
        atomic_store(&run->stopped, false);
    }
    (void)pthread_mutex_unlock(&runs->lock);
    return run;
}

kmp_run_end kmp_served_run_command(kmp_served_runs *runs, const kmp_json_value *request, int socket, kmp_text *answer)
{
    job j = {.runs = runs,
             .request = request,
             .words = kmp_json_member(request, "words"),
             .files = kmp_json_member(request, "files")};
    j.answer = answer;
    j.run = take_place(runs, kmp_json_word(request, "run"));
    if (j.files && j.files->kind == KMP_JSON_NULL)
        j.files = NULL;
    if (!j.run)
        return KMP_RUN_BUSY;
    j.context = kempe_context_new();
    kmp_run_end end = KMP_RUN_FAILED;
    if (j.context)
        end = run_job(&j, socket);
    (void)pthread_mutex_lock(&j.runs->lock);
    const char *out = in_scratch(&j, "out");
    if (j.run->scratch[0] && out) {
        remove_folder(out);
        remove_folder(j.run->scratch);
    }
    j.run->taken = false;
    (void)pthread_mutex_unlock(&j.runs->lock);
    kempe_context_free(j.context);
    kmp_arena_free(&j.arena);
    return end;
}

/* -- runs by name ------------------------------------------------------------------------------------ */

/* The last whole line of a file of lines; NULL: there is none yet. The caller frees it. */
static char *read_last_line(const char *path)
{
    kempe_context *context = kempe_context_new();
    char *text = NULL, *line = NULL;
    size_t length;
    if (context && kmp_file_read(context, KMP_FILE_TABLE, path, &text, &length) == KEMPE_OK) {
        char *end = strrchr(text, '\n');
        if (end) {
            *end = '\0';
            char *before = strrchr(text, '\n');
            line = kmp_strdup(before ? before + 1 : text);
        }
    }
    kmp_free(text);
    kempe_context_free(context);
    return line;
}

void kmp_served_run_progress(kmp_served_runs *runs, const char *name, kmp_text *json)
{
    char path[KMP_PATH_MOST + 16] = "";
    bool running = false;
    (void)pthread_mutex_lock(&runs->lock);
    for (int k = 0; k < KMP_MOST_RUNS && !running; k++) {
        const kmp_served_run *run = &runs->run[k];
        running = run->taken && strcmp(run->name, name) == 0;
        if (running && run->scratch[0])
            (void)snprintf(path, sizeof path, "%s/progress", run->scratch);
    }
    (void)pthread_mutex_unlock(&runs->lock);
    char *line = *path ? read_last_line(path) : NULL;
    kmp_text_printf(json, "{\"running\": %s, \"progress\": %s}\n", running ? "true" : "false", line ? line : "null");
    kmp_free(line);
}

bool kmp_served_run_stop(kmp_served_runs *runs, const char *name)
{
    bool found = false;
    (void)pthread_mutex_lock(&runs->lock);
    for (int k = 0; k < KMP_MOST_RUNS; k++) {
        kmp_served_run *run = &runs->run[k];
        if (run->taken && (!name || strcmp(run->name, name) == 0)) {
            atomic_store(&run->stopped, true);
            found = true;
        }
    }
    (void)pthread_mutex_unlock(&runs->lock);
    return found;
}
