/* SPDX-License-Identifier: BSD-3-Clause */
/* The linker gives each executable and library an identity, a digest of its content (NT_GNU_BUILD_ID). */
#include "base/cache/build_identity.h"
#include <elf.h>
#include <link.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#if defined(__x86_64__)
#include <cpuid.h>
#endif

typedef struct search {
    kmp_digest *digest;
    bool own; /* the object with this code has an identity */
} search;

/* True if a segment of the object has the address. */
static bool has(const struct dl_phdr_info *object, uintptr_t address)
{
    for (int k = 0; k < object->dlpi_phnum; k++) {
        const ElfW(Phdr) *p = &object->dlpi_phdr[k];
        uintptr_t first = (uintptr_t)object->dlpi_addr + p->p_vaddr;
        if (p->p_type == PT_LOAD && address >= first && address - first < p->p_memsz)
            return true;
    }
    return false;
}

/* Finds the identity among the notes of a segment; NULL: it is not there. */
static const unsigned char *identity_in(const unsigned char *at, size_t size, size_t *length)
{
    ElfW(Nhdr) note;
    while (size >= sizeof note) {
        memcpy(&note, at, sizeof note);
        size_t name = (note.n_namesz + 3u) / 4 * 4, content = (note.n_descsz + 3u) / 4 * 4;
        if (sizeof note + name + content > size)
            return NULL;
        if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && memcmp(at + sizeof note, "GNU", 4) == 0) {
            *length = note.n_descsz;
            return at + sizeof note + name;
        }
        at += sizeof note + name + content;
        size -= sizeof note + name + content;
    }
    return NULL;
}

static int add_object(struct dl_phdr_info *object, size_t info, void *user)
{
    search *s = user;
    (void)info;
    for (int k = 0; k < object->dlpi_phnum; k++) {
        const ElfW(Phdr) *p = &object->dlpi_phdr[k];
        size_t length;
        const unsigned char *notes = (const unsigned char *)(uintptr_t)(object->dlpi_addr + p->p_vaddr);
        const unsigned char *identity = p->p_type == PT_NOTE ? identity_in(notes, p->p_memsz, &length) : NULL;
        if (!identity)
            continue;
        kmp_digest_add_part(s->digest, identity, length);
        s->own = s->own || has(object, (uintptr_t)&add_object);
        return 0;
    }
    kmp_digest_add_text(s->digest, object->dlpi_name);
    return 0;
}

/* The features that decide which code of the C library and of Kempe runs. */
static void add_processor(kmp_digest *digest)
{
    uint32_t features[6] = {0};
#if defined(__x86_64__)
    uint32_t rest;
    (void)__get_cpuid(1, &rest, &rest, &features[0], &features[1]);
    (void)__get_cpuid_count(7, 0, &rest, &features[2], &features[3], &features[4]);
    (void)__get_cpuid_count(7, 1, &features[5], &rest, &rest, &rest);
#endif
    kmp_digest_add_part(digest, features, sizeof features);
    kmp_digest_add_text(digest, getenv("GLIBC_TUNABLES"));
}

bool kmp_cache_add_build(kmp_digest *digest)
{
    search s = {.digest = digest};
    (void)dl_iterate_phdr(add_object, &s);
    add_processor(digest);
    return s.own;
}
