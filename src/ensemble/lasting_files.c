/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of result folders, which several processes write at a time. */
#include "ensemble/lasting_files.h"
#include "base/memory.h"
#include "base/temporary_file.h"
#include "platform/platform.h"
#include <errno.h>
#include <string.h>

/* Makes the names in the folder of `path` last through a loss of power. Some file systems cannot; they lose nothing
 * that the file itself has. */
static void keep_folder(const char *path)
{
    const size_t length = kmp_path_folder(path);
    kmp_text folder = {0};
    kmp_text_append(&folder, length > 0 ? path : ".", length > 0 ? length : 1);
    if (!folder.failed)
        kmp_folder_sync(folder.s);
    kmp_text_free(&folder);
}

/* A file system without links has only renaming, which replaces what another process has made in between. */
static int give_name(const char *temporary, const char *path, bool exclusive)
{
    if (!exclusive)
        return kmp_path_rename(temporary, path);
    int error = kmp_path_link(temporary, path);
    if (error == EPERM || error == ENOTSUP || error == ENOSYS || error == EMLINK)
        return kmp_path_exists(path) ? EEXIST : give_name(temporary, path, false);
    (void)kmp_path_remove(temporary);
    return error;
}

/* exclusive: EEXIST if there is one already; lasting: through a loss of power. 0 or an errno. */
static int write_new(const char *path, const char *text, size_t length, bool exclusive, bool lasting)
{
    kmp_text temporary = {0};
    int fd = kmp_temporary_open(path, &temporary), error = fd < 0 ? errno : kmp_file_put(fd, text, length);
    if (!error && lasting)
        error = kmp_file_sync(fd);
    if (fd >= 0 && kmp_file_close(fd) != 0 && !error)
        error = errno;
    if (!error)
        error = give_name(temporary.s, path, exclusive);
    if (error && fd >= 0)
        (void)kmp_path_remove(temporary.s);
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
    kmp_path_state old;
    KMP_MAKE(context, kmp_file_stream, s);
    s->context = context;
    kmp_text_put(&s->path, path);
    if (kmp_path_look(path, &old) && old.kind != KMP_PATH_FILE)
        s->fd = kmp_file_open(path, KMP_OPEN_WRITE);
    else
        s->fd = kmp_temporary_open(path, &s->temporary);
    int error = s->fd < 0 ? errno : s->path.failed ? ENOMEM : 0;
    kempe_status status = kmp_temporary_report(context, path, error);
    return KMP_GIVE_OR_FREE(status, stream, s, kmp_file_stream_free);
}

kempe_status kmp_file_stream_put(kmp_file_stream *s, kmp_text *text)
{
    int error = text->failed ? ENOMEM : kmp_file_put(s->fd, text->s ? text->s : "", text->length);
    kmp_text_free(text);
    return kmp_temporary_report(s->context, s->path.s, error);
}

kempe_status kmp_file_stream_end(kmp_file_stream *s)
{
    int error = kmp_file_close(s->fd) == 0 ? 0 : errno;
    s->fd = -1;
    if (!error && s->temporary.length > 0)
        error = kmp_path_rename(s->temporary.s, s->path.s);
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
        (void)kmp_file_close(s->fd);
    if (s->temporary.length > 0)
        (void)kmp_path_remove(s->temporary.s);
    kmp_text_free(&s->path);
    kmp_text_free(&s->temporary);
    kmp_free(s);
}
