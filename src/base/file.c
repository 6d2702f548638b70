/* SPDX-License-Identifier: BSD-3-Clause */
/* Whole files: read at once, and written whole or not at all (a temporary in the same folder, then renamed). A device
 * or a pipe cannot be replaced and is written to directly. */
#include "base/file.h"
#include "base/memory.h"
#include "base/temporary_file.h"
#include "platform/platform.h"
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The most MiB of a file, whether it may be a pipe that a user names, its words in sentences. The bounds are beyond
 * what the readers take: a million bodies are 300 MiB of YAML, two million triangles 500 MiB of STL, 200000 points 20
 * MiB; matrices of 300000 displacements of a solid are 2000 MiB of text. */
static const struct {
    int mib;
    bool pipes;
    const char *words;
} kinds[] = {
    [KMP_FILE_MODEL] = {1024, true, "a model"},
    [KMP_FILE_INCLUDED] = {1024, false, "a file of a model"},
    [KMP_FILE_MESH] = {512, false, "a mesh"},
    [KMP_FILE_MODES] = {512, false, "a file of modes"},
    [KMP_FILE_MATRIX] = {4096, false, "a matrix"},
    [KMP_FILE_POINTS] = {64, false, "a table of points"},
    [KMP_FILE_TABLE] = {1024, true, "a table in CSV"},
    [KMP_FILE_PARQUET] = {1024, false, "a Parquet file"},
    [KMP_FILE_CHECKPOINT] = {1024, false, "a checkpoint"},
    [KMP_FILE_RECORD] = {64, false, "a file that Kempe keeps"},
    [KMP_FILE_SCRIPT] = {64, false, "a script library"},
    [KMP_FILE_BINARY] = {1024, false, "a binary of a unit"},
};

static kempe_status refuse_length(kempe_context *context, kmp_file_kind kind, const char *path)
{
    return kmp_fail(context, KEMPE_E_IO, "cannot read '%s': it is longer than %d MiB, the most of %s", path,
                    kinds[kind].mib, kinds[kind].words);
}

/* `capacity`: of the first buffer, one more than the file is expected to fill. */
static kempe_status read_stream(kempe_context *context, kmp_file_kind kind, FILE *stream, const char *path,
                                size_t capacity, char **text, size_t *length)
{
    size_t n = 0;
    char *s = kmp_calloc(capacity, 1);
    while (s) {
        n += fread(s + n, 1, capacity - 1 - n, stream);
        if (n < capacity - 1)
            break;
        if (n >> 20 >= (size_t)kinds[kind].mib) {
            kmp_free(s);
            return refuse_length(context, kind, path);
        }
        capacity *= 2;
        char *grown = kmp_realloc(s, capacity, 1);
        if (!grown)
            kmp_free(s);
        s = grown;
    }
    KMP_TRY(kmp_made(context, s));
    if (ferror(stream)) {
        kempe_status status = kmp_fail(context, KEMPE_E_IO, "cannot read '%s': %s", path, strerror(errno));
        kmp_free(s);
        return status;
    }
    s[n] = '\0';
    *text = s;
    *length = n;
    return KEMPE_OK;
}

kempe_status kmp_file_read(kempe_context *context, kmp_file_kind kind, const char *path, char **text, size_t *length)
{
    enum { LEAST = 4096 };
    kmp_path_state about = {0};
    const char *given = kmp_context_text(context, path);
    if (given) {
        *text = kmp_strdup(given);
        *length = strlen(given);
        return kmp_made(context, *text);
    }
    const char *folder = kind == KMP_FILE_RECORD ? NULL : kmp_context_beyond(context, path);
    if (folder)
        return kmp_fail(context, KEMPE_E_IO, "cannot read '%s': only files in the folder '%s' may be read here", path,
                        folder);
    /* a pipe waits for its writer, as in every program, but for a server that reads one folder */
    bool pipes = kinds[kind].pipes && !kmp_context_is_confined(context) && kmp_path_look(path, &about) &&
                 about.kind == KMP_PATH_PIPE;
    int fd = kmp_file_open(path, pipes ? KMP_OPEN_READ : KMP_OPEN_READ | KMP_OPEN_AT_ONCE);
    const char *why = fd < 0 || !kmp_file_look(fd, &about)    ? strerror(errno)
                      : about.kind == KMP_PATH_FOLDER         ? strerror(EISDIR)
                      : about.kind != KMP_PATH_FILE && !pipes ? "it is not a regular file"
                                                              : NULL;
    FILE *stream = why ? NULL : kmp_file_stream_of(fd);
    if (!stream) {
        kempe_status status = kmp_fail(context, KEMPE_E_IO, "cannot read '%s': %s", path, why ? why : strerror(errno));
        if (fd >= 0)
            (void)kmp_file_close(fd);
        return status;
    }
    size_t size = about.kind == KMP_PATH_FILE ? (size_t)about.size : 0;
    kempe_status status = size >> 20 >= (size_t)kinds[kind].mib
                              ? refuse_length(context, kind, path)
                              : read_stream(context, kind, stream, path, size < LEAST ? LEAST : size + 2, text, length);
    fclose(stream);
    return status;
}

/* Writes a temporary file that then gets its name. */
static int write_by_name(const char *path, const kmp_path_state *old, const char *text, size_t length)
{
    kmp_text temporary = {0};
    int error = kmp_temporary_write(path, old, text, length, &temporary);
    if (!error && (error = kmp_path_rename(temporary.s, path)) != 0)
        (void)kmp_path_remove(temporary.s);
    kmp_text_free(&temporary);
    return error;
}

static kempe_status write_bytes(kempe_context *context, const char *path, const char *text, size_t length)
{
    char target[KMP_PATH_MOST];
    kmp_path_state old;
    int error;
    kmp_context_clear(context);
    bool exists = kmp_path_look(path, &old);
    if (exists && kempe_context_is_source(context, path))
        return kmp_fail(context, KEMPE_E_ARGUMENT, "%s is read for this result: write to another file", path);
    /* through a symbolic link, its target is replaced and the link stays */
    const bool real = exists && old.kind == KMP_PATH_FILE && kmp_path_real(path, target);
    if (exists && old.kind == KMP_PATH_FOLDER) {
        error = EISDIR;
    } else if (exists && old.kind != KMP_PATH_FILE) {
        int fd = kmp_file_open(path, KMP_OPEN_WRITE);
        error = fd < 0 ? errno : kmp_temporary_end(fd, text, length);
    } else {
        error = write_by_name(real ? target : path, exists ? &old : NULL, text, length);
    }
    return kmp_temporary_report(context, path, error);
}

kempe_status kempe_write_file(kempe_context *context, const char *path, const char *text)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, text, "text");
    return write_bytes(context, path, text, strlen(text));
}

const char *kmp_file_ending(const char *path)
{
    const char *ending = strrchr(kmp_path_name(path), '.');
    return ending ? ending : "";
}

kempe_status kmp_file_write(kempe_context *context, const char *path, kmp_text *text)
{
    kempe_status status =
        text->failed ? kmp_fail_memory(context) : write_bytes(context, path, text->s ? text->s : "", text->length);
    kmp_text_free(text);
    return status;
}

kempe_status kmp_folder_make(kempe_context *context, const char *path)
{
    enum { MOST_TRIES = 1000 };
    kmp_path_state here;
    for (int k = 0; k < MOST_TRIES; k++) {
        if (kmp_folder_create(path, false))
            return KEMPE_OK;
        if (errno != EEXIST)
            break;
        if (kmp_path_look(path, &here)) {
            if (here.kind == KMP_PATH_FOLDER)
                return KEMPE_OK;
            errno = EEXIST;
            break;
        }
        if (errno != ENOENT) /* otherwise another process has removed it between the two calls */
            break;
    }
    return kmp_fail(context, KEMPE_E_IO, "cannot make the folder '%s': %s", path, strerror(errno));
}
