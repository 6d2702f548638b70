/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/x86/pages.h"
#include <string.h>

#if defined(__unix__)
#include <sys/mman.h>

void *kmp_pages_new(const void *code, size_t size)
{
    void *pages = size > 0 ? mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) : MAP_FAILED;
    if (pages == MAP_FAILED)
        return NULL;
    memcpy(pages, code, size);
    if (mprotect(pages, size, PROT_READ | PROT_EXEC) == 0)
        return pages;
    (void)munmap(pages, size);
    return NULL;
}

void kmp_pages_free(void *pages, size_t size)
{
    if (pages)
        (void)munmap(pages, size);
}

#else

void *kmp_pages_new(const void *code, size_t size)
{
    (void)code;
    (void)size;
    return NULL;
}

void kmp_pages_free(void *pages, size_t size)
{
    (void)pages;
    (void)size;
}

#endif
