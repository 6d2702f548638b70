/* SPDX-License-Identifier: BSD-3-Clause */
/* The shared library of this platform, by a C compiler in a folder that is removed afterwards. */
#include "exchange/fmu/unit_binary.h"
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "exchange/fmu/unit_parts.h"
#include <fcntl.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

enum { MOST_WORDS = 64, MOST_SHOWN = 160 };

const char *kmp_unit_binary_folder(int fmi)
{
#if defined(__linux__) && defined(__x86_64__)
    return fmi == 2 ? "linux64" : "x86_64-linux";
#elif defined(__linux__) && defined(__aarch64__)
    return fmi == 2 ? "aarch64-linux" : "aarch64-linux";
#elif defined(__APPLE__) && defined(__x86_64__)
    return fmi == 2 ? "darwin64" : "x86_64-darwin";
#elif defined(__APPLE__)
    return fmi == 2 ? "darwin64" : "aarch64-darwin";
#else
    (void)fmi;
    return "";
#endif
}

static char *path_in(kmp_arena *arena, const char *folder, const char *name)
{
    return kmp_arena_printf(arena, "%s/%s", folder, name);
}

/* Runs the words in the folder, output in the file `said`; the exit status, -1: it did not run. */
static int run_words(char *const *words, const char *said)
{
    posix_spawn_file_actions_t actions;
    pid_t child = 0;
    int state = -1;
    if (posix_spawn_file_actions_init(&actions) != 0)
        return -1;
    bool ok =
        posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, said, O_WRONLY | O_CREAT | O_TRUNC, 0600) == 0 &&
        posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO) == 0 &&
        posix_spawnp(&child, words[0], &actions, NULL, words, environ) == 0;
    posix_spawn_file_actions_destroy(&actions);
    if (!ok || waitpid(child, &state, 0) != child || !WIFEXITED(state))
        return -1;
    return WEXITSTATUS(state);
}

/* The first line of the compiler's output that says error, otherwise the first one. */
static kempe_status tell_failure(kempe_context *context, const char *compiler, int code, const char *said)
{
    char *text = NULL;
    size_t length = 0;
    if (code < 0 || code == 127)
        return kmp_fail(
            context, KEMPE_E_FAILED,
            "the C compiler '%s' does not run: install one, name another with --compiler, or write the unit "
            "without a binary with --no-binary",
            compiler);
    if (kmp_file_read(context, KMP_FILE_RECORD, said, &text, &length) != KEMPE_OK)
        text = NULL;
    const char *line = text ? strstr(text, "error") : NULL;
    while (line && line > text && line[-1] != '\n')
        line--;
    line = line ? line : text ? text : "";
    kempe_status status = kmp_fail(
        context, KEMPE_E_FAILED, "the C compiler '%s' fails with exit code %d: %.*s; --no-binary does without it",
        compiler, code, (int)(strcspn(line, "\n") < MOST_SHOWN ? strcspn(line, "\n") : MOST_SHOWN), line);
    kmp_free(text);
    return status;
}

static kempe_status build(kempe_context *context, kmp_arena *arena, const char *folder, const kmp_unit_plan *plan,
                          const char *compiler, kmp_text *bytes)
{
    char *words[MOST_WORDS], *text = NULL;
    static char *const options[] = {"-std=gnu99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden",
                                    "-s",         "-o"};
    int count = 0;
    size_t length = 0;
    char *out = path_in(arena, folder, "unit.so"), *said = path_in(arena, folder, "said.txt");
    words[count++] = kmp_arena_strdup(arena, compiler);
    for (size_t k = 0; k < sizeof options / sizeof *options; k++)
        words[count++] = options[k];
    words[count++] = out;
    for (int k = 0; k < plan->source_count && count < MOST_WORDS - 2; k++)
        words[count++] = path_in(arena, folder, plan->sources[k]);
    words[count++] = kmp_arena_strdup(arena, "-lm");
    words[count] = NULL;
    if (arena->failed)
        return kmp_fail_memory(context);
    int code = run_words(words, said);
    if (code != 0)
        return tell_failure(context, compiler, code, said);
    KMP_TRY(kmp_file_read(context, KMP_FILE_BINARY, out, &text, &length));
    kmp_text_append(bytes, text, length);
    kmp_free(text);
    return kmp_made(context, !bytes->failed);
}

static void remove_folder(kmp_arena *arena, const kmp_code_files *files, const char *folder)
{
    static const char *const made[] = {"unit.so", "said.txt"};
    for (int k = 0; k < files->count; k++) {
        char *path = path_in(arena, folder, files->file[k].name);
        if (path)
            (void)unlink(path);
    }
    for (size_t k = 0; k < sizeof made / sizeof *made; k++) {
        char *path = path_in(arena, folder, made[k]);
        if (path)
            (void)unlink(path);
    }
    (void)rmdir(folder);
}

kempe_status kmp_unit_compile(kempe_context *context, const kmp_code_files *files, const kmp_unit_plan *plan,
                              const char *compiler, kmp_text *bytes)
{
    kmp_arena arena = {0};
    const char *given = getenv("TMPDIR");
    char *folder = kmp_arena_printf(&arena, "%s/kempe-XXXXXX", given && *given ? given : "/tmp");
    kempe_status status = folder ? KEMPE_OK : kmp_fail_memory(context);
    if (status == KEMPE_OK && !mkdtemp(folder)) {
        status = kmp_fail(context, KEMPE_E_IO, "cannot make a folder in '%s' for the compiler",
                          given && *given ? given : "/tmp");
    } else if (status == KEMPE_OK) {
        for (int k = 0; k < files->count && status == KEMPE_OK; k++) {
            char *path = path_in(&arena, folder, files->file[k].name);
            status = path ? kempe_write_file(context, path, files->file[k].text.s) : kmp_fail_memory(context);
        }
        if (status == KEMPE_OK)
            status = build(context, &arena, folder, plan, compiler, bytes);
        remove_folder(&arena, files, folder);
    }
    kmp_arena_free(&arena);
    return status == KEMPE_E_IO ? KEMPE_E_FAILED : status; /* files that the caller has not named */
}
