/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/temporary_file.h"
#include <errno.h>
#include <stdatomic.h>
#include <string.h>

int kmp_temporary_open(const char *path, kmp_text *temporary)
{
    static atomic_uint counter;
    for (int attempt = 0; attempt < 100; attempt++) {
        kmp_text_free(temporary);
        kmp_text_printf(temporary, "%s.tmp-%ld-%u", path, kmp_process_number(), atomic_fetch_add(&counter, 1u));
        if (temporary->failed) {
            errno = ENOMEM;
            return -1;
        }
        int fd = kmp_file_open(temporary->s, KMP_OPEN_WRITE | KMP_OPEN_NEW);
        if (fd >= 0 || errno != EEXIST)
            return fd;
    }
    return -1;
}

int kmp_temporary_end(int fd, const char *text, size_t left)
{
    int error = kmp_file_put(fd, text, left);
    return kmp_file_close(fd) == 0 || error ? error : errno;
}

int kmp_temporary_write(const char *path, const kmp_path_state *old, const char *text, size_t length,
                        kmp_text *temporary)
{
    int fd = kmp_temporary_open(path, temporary);
    if (fd < 0)
        return errno;
    int error = old ? kmp_file_permit(fd, old->permissions) : 0, written = kmp_temporary_end(fd, text, length);
    error = error ? error : written;
    if (error)
        (void)kmp_path_remove(temporary->s);
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
