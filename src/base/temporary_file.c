/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/temporary_file.h"
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int kmp_temporary_open(const char *path, kmp_text *temporary)
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

int kmp_temporary_put(int fd, const char *text, size_t left)
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

int kmp_temporary_end(int fd, const char *text, size_t left)
{
    int error = kmp_temporary_put(fd, text, left);
    return close(fd) == 0 || error ? error : errno;
}

int kmp_temporary_write(const char *path, const struct stat *old, const char *text, size_t length, kmp_text *temporary)
{
    int fd = kmp_temporary_open(path, temporary);
    if (fd < 0)
        return errno;
    int error = old && fchmod(fd, old->st_mode & 07777) != 0 ? errno : 0, written = kmp_temporary_end(fd, text, length);
    error = error ? error : written;
    if (error)
        unlink(temporary->s);
    return error;
}

kempe_status kmp_temporary_report(kempe_context *context, const char *path, int error)
{
    if (error == ENOMEM)
        return kmp_fail_memory(context);
    if (error)
        return kmp_fail(context, KEMPE_E_IO, "cannot write '%s': %s", path, strerror(error));
    return KEMPE_OK;
}
