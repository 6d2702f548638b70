/* SPDX-License-Identifier: BSD-3-Clause */
/* Files in memory: the linker gives calls of the reader of whole files, of fopen, access, stat and opendir to the
 * functions below (--wrap). */
#include "base/file.h"
#include "base/memory.h"
#include "fuzz.h"
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <sys/stat.h>

enum { MOST_FILES = 16 };

typedef struct file {
    const char *name, *text;
    size_t name_length, length;
} file;

static file files[MOST_FILES];
static int count;
static const char mark[] = "\n#== ";

/* The mark in the n characters at s, NULL when it is not there. */
static const char *find_mark(const char *s, size_t n)
{
    size_t length = strlen(mark);
    for (const char *at = s; (size_t)(at - s) + length <= n; at++) {
        at = memchr(at, '\n', n - (size_t)(at - s));
        if (!at || n - (size_t)(at - s) < length)
            return NULL;
        if (memcmp(at, mark, length) == 0)
            return at;
    }
    return NULL;
}

void fuzz_files_set(const char *name, const uint8_t *data, size_t size)
{
    const char *at = (const char *)data, *end = at + size;
    count = 0;
    files[count++] = (file){.name = name, .name_length = strlen(name), .text = at, .length = size};
    while (count < MOST_FILES) {
        const char *next = find_mark(at, (size_t)(end - at));
        if (!next)
            return;
        files[count - 1].length = (size_t)(next + 1 - files[count - 1].text);
        next += strlen(mark);
        const char *line_end = memchr(next, '\n', (size_t)(end - next));
        at = line_end ? line_end : end;
        files[count++] =
            (file){next, line_end ? at + 1 : end, (size_t)(at - next), line_end ? (size_t)(end - at - 1) : 0};
    }
}

void fuzz_files_clear(void)
{
    count = 0;
}

/* The file of a path; NULL: there is none. */
static const file *find_file(const char *path)
{
    for (int k = 0; k < count; k++)
        if (strlen(path) == files[k].name_length && memcmp(path, files[k].name, files[k].name_length) == 0)
            return &files[k];
    errno = ENOENT;
    return NULL;
}

/* The content as a copy, which sanitizers guard. */
static kempe_status read_memory(kempe_context *context, const char *path, char **text, size_t *length)
{
    const file *f = find_file(path);
    if (!f)
        return kmp_fail(context, KEMPE_E_IO, "cannot read '%s': %s", path, strerror(errno));
    *text = kmp_calloc(f->length + 1, 1);
    if (*text && f->length > 0)
        memcpy(*text, f->text, f->length);
    *length = f->length;
    return kmp_made(context, *text);
}

kempe_status __real_kmp_file_read(kempe_context *context, kmp_file_kind kind, const char *path, char **text,
                                  size_t *length);
kempe_status __wrap_kmp_file_read(kempe_context *context, kmp_file_kind kind, const char *path, char **text,
                                  size_t *length);

kempe_status __wrap_kmp_file_read(kempe_context *context, kmp_file_kind kind, const char *path, char **text,
                                  size_t *length)
{
    return count == 0 ? __real_kmp_file_read(context, kind, path, text, length)
                      : read_memory(context, path, text, length);
}

int __real_stat(const char *path, struct stat *about);
int __wrap_stat(const char *path, struct stat *about);

int __wrap_stat(const char *path, struct stat *about)
{
    if (count == 0)
        return __real_stat(path, about);
    const file *f = find_file(path);
    *about = (struct stat){.st_mode = S_IFREG, .st_size = f ? (off_t)f->length : 0};
    return f ? 0 : -1;
}

FILE *__real_fopen(const char *path, const char *mode);
FILE *__wrap_fopen(const char *path, const char *mode);

FILE *__wrap_fopen(const char *path, const char *mode)
{
    static char nothing[1];
    if (count == 0 || mode[0] != 'r')
        return __real_fopen(path, mode);
    const file *f = find_file(path);
    FILE *stream =
        f ? fmemopen(f->length ? (void *)(uintptr_t)f->text : nothing, f->length ? f->length : 1, "rb") : NULL;
    if (stream && f->length == 0)
        (void)fgetc(stream);
    return stream;
}

int __real_access(const char *path, int how);
int __wrap_access(const char *path, int how);

int __wrap_access(const char *path, int how)
{
    return count == 0 ? __real_access(path, how) : find_file(path) ? 0 : -1;
}

DIR *__real_opendir(const char *path);
DIR *__wrap_opendir(const char *path);

DIR *__wrap_opendir(const char *path)
{
    if (count == 0)
        return __real_opendir(path);
    errno = ENOENT;
    return NULL;
}
