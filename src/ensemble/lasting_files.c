/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of result folders, which several processes write at a time. */
#include "ensemble/lasting_files.h"
#include "base/memory.h"
#include "base/temporary_file.h"
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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

/* A file system without links has only renaming, which replaces what another process has made in between. */
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

/* exclusive: EEXIST if there is one already; lasting: through a loss of power. 0 or an errno. */
static int write_new(const char *path, const char *text, size_t length, bool exclusive, bool lasting)
{
    kmp_text temporary = {0};
    int fd = kmp_temporary_open(path, &temporary), error = fd < 0 ? errno : kmp_temporary_put(fd, text, length);
    if (!error && lasting && fsync(fd) != 0 && errno != EINVAL)
        error = errno;
    if (fd >= 0 && close(fd) != 0 && !error)
        error = errno;
    if (!error)
        error = give_name(temporary.s, path, exclusive);
    if (error && fd >= 0)
        unlink(temporary.s);
    else if (!error && lasting)
        keep_folder(path);
    kmp_text_free(&temporary);
    return error;
}

kempe_status kmp_lasting_file_write(kempe_context *context, const char *path, kmp_text *text)
{
    int error = text->failed ? ENOMEM : write_new(path, text->s, text->length, false, true);
    kmp_text_free(text);
    return kmp_temporary_report(context, path, error);
}

kempe_status kmp_file_make(kempe_context *context, const char *path, const char *text, bool lasting, bool *made)
{
    int error = write_new(path, text, strlen(text), true, lasting);
    *made = error == 0;
    return error == EEXIST ? KEMPE_OK : kmp_temporary_report(context, path, error);
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
        s->fd = kmp_temporary_open(path, &s->temporary);
    int error = s->fd < 0 ? errno : s->path.failed ? ENOMEM : 0;
    kempe_status status = kmp_temporary_report(context, path, error);
    return KMP_GIVE_OR_FREE(status, stream, s, kmp_file_stream_free);
}

kempe_status kmp_file_stream_put(kmp_file_stream *s, kmp_text *text)
{
    int error = text->failed ? ENOMEM : kmp_temporary_put(s->fd, text->s ? text->s : "", text->length);
    kmp_text_free(text);
    return kmp_temporary_report(s->context, s->path.s, error);
}

kempe_status kmp_file_stream_end(kmp_file_stream *s)
{
    int error = close(s->fd) == 0 ? 0 : errno;
    s->fd = -1;
    if (!error && s->temporary.length > 0 && rename(s->temporary.s, s->path.s) != 0)
        error = errno;
    if (!error)
        kmp_text_free(&s->temporary);
    kempe_status status = kmp_temporary_report(s->context, s->path.s, error);
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
