/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/loaded_library.h"
#include "platform/platform.h"
#include <stdio.h>
#include <string.h>

/* A library without one of the functions is closed again. */
static void load(kmp_loaded_library *l)
{
    void *handle = kmp_library_open(l->name), *found = handle;
    for (size_t k = 0; found && k < l->count; k++) {
        found = kmp_library_find(handle, l->functions[k]);
        memcpy((char *)l->addresses + k * sizeof found, &found, sizeof found);
    }
    if (found)
        return;
    (void)snprintf(l->missing, sizeof l->missing, "%s", kmp_library_reason());
    if (handle)
        kmp_library_close(handle);
}

const char *kmp_library_missing(kmp_loaded_library *library)
{
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    (void)pthread_mutex_lock(&lock);
    if (!library->tried)
        load(library);
    library->tried = true;
    (void)pthread_mutex_unlock(&lock);
    return *library->missing ? library->missing : NULL;
}
