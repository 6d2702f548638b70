/* SPDX-License-Identifier: BSD-3-Clause */
/* Whole files: read at once, and written whole or not at all (a temporary in the same folder, then renamed). A device
 * or a pipe cannot be replaced and is written to directly. */
#include "base/file.h"
#include "base/memory.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The most MiB of a file, whether it may be a pipe that a user names, its words in sentences. The bounds are beyond
 * what the readers take: a million bodies are 300 MiB of YAML, two million triangles 500 MiB of STL, 200000 points 20
 * MiB. */
static const struct {
    int mib;
    bool pipes;
    const char *words;
} kinds[] = {
    [KMP_FILE_MODEL] = {1024, true, "a model"},
    [KMP_FILE_INCLUDED] = {1024, false, "a file of a model"},
    [KMP_FILE_MESH] = {512, false, "a mesh"},
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
    struct stat about = {0};
    /* a pipe waits for its writer, as in every program; nothing else is waited for */
    bool pipes = kinds[kind].pipes && stat(path, &about) == 0 && S_ISFIFO(about.st_mode);
    int fd = open(path, O_RDONLY | O_CLOEXEC | (pipes ? 0 : O_NONBLOCK));
    const char *why = fd < 0 || fstat(fd, &about) != 0    ? strerror(errno)
                      : S_ISDIR(about.st_mode)            ? strerror(EISDIR)
                      : !S_ISREG(about.st_mode) && !pipes ? "it is no regular file"
                                                          : NULL;
    FILE *stream = why ? NULL : fdopen(fd, "rb");
    if (!stream) {
        kempe_status status = kmp_fail(context, KEMPE_E_IO, "cannot read '%s': %s", path, why ? why : strerror(errno));
        if (fd >= 0)
            close(fd);
        return status;
    }
    size_t size = S_ISREG(about.st_mode) ? (size_t)about.st_size : 0;
    kempe_status status = size >> 20 >= (size_t)kinds[kind].mib
                              ? refuse_length(context, kind, path)
                              : read_stream(context, kind, stream, path, size < LEAST ? LEAST : size + 2, text, length);
    fclose(stream);
    return status;
}

char *kmp_folder_find(const char *folder, const char *ending, int *count)
{
    DIR *stream = opendir(folder);
    char *first = NULL;
    *count = 0;
    for (const struct dirent *d = stream ? readdir(stream) : NULL; d; d = readdir(stream)) {
        if (d->d_name[0] == '.' || strcmp(kmp_file_ending(d->d_name), ending) != 0)
            continue;
        *count += 1;
        if (first && strcmp(d->d_name, first) > 0)
            continue;
        kmp_free(first);
        first = kmp_strdup(d->d_name);
    }
    if (stream)
        closedir(stream);
    return first;
}

/* Writes `left` bytes; 0 or an errno. */
static int write_all(int fd, const char *text, size_t left)
{
    while (left > 0) {
        ssize_t n = write(fd, text, left);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return errno;
        text += n;
        left -= (size_t)n;
    }
    return 0;
}

/* Writes `left` bytes, to the disk where they are to last, and closes; 0 or an errno. */
static int write_and_close(int fd, const char *text, size_t left, bool lasting)
{
    int written = write_all(fd, text, left);
    if (written) {
        close(fd);
        return written;
    }
    int error = lasting && fsync(fd) != 0 && errno != EINVAL ? errno : 0;
    int closed = close(fd) == 0 ? 0 : errno;
    return error ? error : closed;
}

static int write_in_place(const char *path, const char *text, size_t length)
{
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    return fd < 0 ? errno : write_and_close(fd, text, length, false);
}

/* A new file in the folder of `path`, with its name in `temporary`; -1 and errno when there is none. */
static int open_temporary(const char *path, kmp_text *temporary)
{
    static atomic_uint counter;
    for (int attempt = 0; attempt < 100; attempt++) {
        kmp_text_free(temporary);
        kmp_text_printf(temporary, "%s.tmp-%ld-%u", path, (long)getpid(), atomic_fetch_add(&counter, 1u));
        if (temporary->failed) {
            errno = ENOMEM;
            return -1;
        }
        int fd = open(temporary->s, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd >= 0 || errno != EEXIST)
            return fd;
    }
    return -1;
}

/* Makes the names in the folder of `path` last through a loss of power. Some file systems cannot; they lose nothing
 * that the file itself has. */
static void keep_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    kmp_text folder = {0};
    kmp_text_append(&folder, slash ? path : ".", slash ? (size_t)(slash - path) + 1 : 1);
    int fd = folder.failed ? -1 : open(folder.s, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        (void)fsync(fd);
        close(fd);
    }
    kmp_text_free(&folder);
}

/* The way in which a whole file gets its name. */
typedef struct placing {
    const struct stat *old; /* the existing file; NULL: none */
    bool lasting;           /* through a loss of power */
    bool exclusive;         /* EEXIST if there is one already */
} placing;

/* A file system without links has renaming alone, which replaces what another process has made in between. */
static int give_name(const char *temporary, const char *path, bool exclusive)
{
    if (!exclusive)
        return rename(temporary, path) == 0 ? 0 : errno;
    int error = link(temporary, path) == 0 ? 0 : errno;
    if (error == EPERM || error == ENOTSUP || error == ENOSYS || error == EMLINK)
        return access(path, F_OK) == 0 ? EEXIST : give_name(temporary, path, false);
    unlink(temporary);
    return error;
}

/* Writes a temporary file; without an error its name is in `temporary`. */
static int write_temporary(const char *path, const placing *place, const char *text, size_t length, kmp_text *temporary)
{
    int fd = open_temporary(path, temporary);
    int error = fd < 0 ? errno : 0;
    if (!error) {
        if (place->old && fchmod(fd, place->old->st_mode & 07777) != 0)
            error = errno;
        int written = write_and_close(fd, text, length, place->lasting);
        if (!error)
            error = written;
        if (error)
            unlink(temporary->s);
    }
    return error;
}

/* Writes a temporary file that then gets its name. */
static int write_by_name(const char *path, const placing *place, const char *text, size_t length)
{
    kmp_text temporary = {0};
    int error = write_temporary(path, place, text, length, &temporary);
    if (!error) {
        error = give_name(temporary.s, path, place->exclusive);
        if (error)
            unlink(temporary.s);
        else if (place->lasting)
            keep_folder(path);
    }
    kmp_text_free(&temporary);
    return error;
}

static kempe_status report_written(kempe_context *context, const char *path, int error)
{
    if (error == ENOMEM)
        return kmp_fail_memory(context);
    if (error)
        return kmp_fail(context, KEMPE_E_IO, "cannot write '%s': %s", path, strerror(error));
    return KEMPE_OK;
}

static kempe_status write_bytes(kempe_context *context, const char *path, const char *text, size_t length)
{
    char target[PATH_MAX];
    struct stat old;
    int error;
    kmp_context_clear(context);
    bool exists = stat(path, &old) == 0;
    /* through a symbolic link, its target is replaced and the link stays */
    const char *real = exists && S_ISREG(old.st_mode) ? realpath(path, target) : NULL;
    if (exists && S_ISDIR(old.st_mode))
        error = EISDIR;
    else if (exists && !S_ISREG(old.st_mode))
        error = write_in_place(path, text, length);
    else
        error = write_by_name(real ? real : path, &(placing){.old = exists ? &old : NULL}, text, length);
    return report_written(context, path, error);
}

kempe_status kempe_write_file(kempe_context *context, const char *path, const char *text)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, path, "path");
    KMP_WANTED(context, text, "text");
    return write_bytes(context, path, text, strlen(text));
}

/* The place of a file and what it replaces: the target of a symbolic link. */
static int stage(const char *folder, const char *name, const char *text, kmp_text *path, kmp_text *temporary)
{
    char target[PATH_MAX];
    struct stat old;
    kmp_text_printf(path, "%s/%s", folder, name);
    const bool exists = !path->failed && stat(path->s, &old) == 0;
    if (exists && !S_ISREG(old.st_mode))
        return S_ISDIR(old.st_mode) ? EISDIR : EINVAL;
    if (exists && realpath(path->s, target)) {
        kmp_text_free(path);
        kmp_text_put(path, target);
    }
    return path->failed
               ? ENOMEM
               : write_temporary(path->s, &(placing){.old = exists ? &old : NULL}, text, strlen(text), temporary);
}

kempe_status kmp_files_write(kempe_context *context, const char *folder, int count, const char *const *names,
                             const char *const *texts)
{
    kmp_text *path = KMP_NEW(kmp_text, count), *temporary = KMP_NEW(kmp_text, count);
    int error = path && temporary ? 0 : ENOMEM, staged = 0, named = 0;
    while (!error && staged < count) {
        error = stage(folder, names[staged], texts[staged], &path[staged], &temporary[staged]);
        staged += !error;
    }
    while (!error && named < count) {
        error = give_name(temporary[named].s, path[named].s, false);
        named += !error;
    }
    const char *wrong = error && error != ENOMEM ? path[staged < count ? staged : named].s : folder;
    kempe_status status = report_written(context, wrong, error);
    for (int k = named; k < staged; k++)
        unlink(temporary[k].s);
    for (int k = 0; path && temporary && k < count; k++) {
        kmp_text_free(&path[k]);
        kmp_text_free(&temporary[k]);
    }
    kmp_free(path);
    kmp_free(temporary);
    return status;
}

const char *kmp_file_ending(const char *path)
{
    const char *folder = strrchr(path, '/'), *ending = strrchr(folder ? folder : path, '.');
    return ending ? ending : "";
}

kempe_status kmp_file_write(kempe_context *context, const char *path, kmp_text *text)
{
    kempe_status status =
        text->failed ? kmp_fail_memory(context) : write_bytes(context, path, text->s ? text->s : "", text->length);
    kmp_text_free(text);
    return status;
}

kempe_status kmp_file_write_lasting(kempe_context *context, const char *path, kmp_text *text)
{
    int error = text->failed ? ENOMEM : write_by_name(path, &(placing){.lasting = true}, text->s, text->length);
    kmp_text_free(text);
    return report_written(context, path, error);
}

/* -- piece by piece ---------------------------------------------------------------------------------- */

struct kmp_file_stream {
    kempe_context *context;
    kmp_text path, temporary; /* temporary empty: a device, written in place */
    int fd;
};

kempe_status kmp_file_stream_new(kempe_context *context, const char *path, kmp_file_stream **stream)
{
    struct stat old;
    KMP_MAKE(context, kmp_file_stream, s);
    s->context = context;
    kmp_text_put(&s->path, path);
    if (stat(path, &old) == 0 && !S_ISREG(old.st_mode))
        s->fd = open(path, O_WRONLY | O_CLOEXEC);
    else
        s->fd = open_temporary(path, &s->temporary);
    int error = s->fd < 0 ? errno : s->path.failed ? ENOMEM : 0;
    kempe_status status = report_written(context, path, error);
    return KMP_GIVE_OR_FREE(status, stream, s, kmp_file_stream_free);
}

kempe_status kmp_file_stream_put(kmp_file_stream *s, kmp_text *text)
{
    int error = text->failed ? ENOMEM : write_all(s->fd, text->s ? text->s : "", text->length);
    kmp_text_free(text);
    return report_written(s->context, s->path.s, error);
}

kempe_status kmp_file_stream_end(kmp_file_stream *s)
{
    int error = close(s->fd) == 0 ? 0 : errno;
    s->fd = -1;
    if (!error && s->temporary.length > 0)
        error = give_name(s->temporary.s, s->path.s, false);
    if (!error)
        kmp_text_free(&s->temporary);
    kempe_status status = report_written(s->context, s->path.s, error);
    kmp_file_stream_free(s);
    return status;
}

void kmp_file_stream_free(kmp_file_stream *s)
{
    if (!s)
        return;
    if (s->fd >= 0)
        close(s->fd);
    if (s->temporary.length > 0)
        unlink(s->temporary.s);
    kmp_text_free(&s->path);
    kmp_text_free(&s->temporary);
    kmp_free(s);
}

kempe_status kmp_file_make(kempe_context *context, const char *path, const char *text, bool lasting, bool *made)
{
    int error = write_by_name(path, &(placing){.lasting = lasting, .exclusive = true}, text, strlen(text));
    *made = error == 0;
    return error == EEXIST ? KEMPE_OK : report_written(context, path, error);
}

kempe_status kmp_folder_make(kempe_context *context, const char *path)
{
    enum { MOST_TRIES = 1000 };
    struct stat here;
    for (int k = 0; k < MOST_TRIES; k++) {
        if (mkdir(path, 0777) == 0)
            return KEMPE_OK;
        if (errno != EEXIST)
            break;
        if (stat(path, &here) == 0) {
            if (S_ISDIR(here.st_mode))
                return KEMPE_OK;
            errno = EEXIST;
            break;
        }
        if (errno != ENOENT) /* otherwise another process has removed it between the two calls */
            break;
    }
    return kmp_fail(context, KEMPE_E_IO, "cannot make the folder '%s': %s", path, strerror(errno));
}
