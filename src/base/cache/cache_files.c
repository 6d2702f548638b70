/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of the cache: written under a temporary name and renamed; read only if whole, of this key, and the user's own;
 * the oldest removed when the folder has become too large. */
#include "base/cache/cache_files.h"
#include "base/memory.h"
#include "base/text.h"
#include <dirent.h>
#include <elf.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* -- the identity of the build --------------------------------------------------------------------------- */

/* The linker gives each executable and library an identity, a digest of its content (NT_GNU_BUILD_ID). */

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

/* Temporary files that are older, in seconds, belong to processes that have ended. */
enum { STALE = 3600, NAME = 2 * KMP_DIGEST_SIZE };

static const char ending[] = ".kempe", temporary[] = "new.";

typedef struct head {
    char mark[8];
    kmp_cache_key key;
    uint64_t size, sum;
} head;

static head head_of(const kmp_cache_key *key, const void *bytes, size_t size)
{
    return (head){{'k', 'e', 'm', 'p', 'e', ' ', '0', '1'}, *key, size, kmp_checksum(bytes, size)};
}

static void put_path(kmp_text *path, const char *folder, const kmp_cache_key *key)
{
    kmp_text_printf(path, "%s/", folder);
    for (int k = 0; k < KMP_DIGEST_SIZE; k++)
        kmp_text_printf(path, "%02x", key->digest[k]);
    kmp_text_put(path, ending);
}

/* -- reading ----------------------------------------------------------------------------------------- */

/* Exactly `size` bytes, and no more. */
static bool read_whole(int fd, unsigned char *to, size_t size)
{
    size_t done = 0;
    while (done < size) {
        ssize_t n = read(fd, to + done, size - done);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        done += (size_t)n;
    }
    return true;
}

/* True if no other user can have written it: some files have machine code. */
static bool is_own(const struct stat *about)
{
    return S_ISREG(about->st_mode) && about->st_uid == geteuid() && !(about->st_mode & (S_IWGRP | S_IWOTH));
}

/* The file if it is whole and of this key. */
static kmp_cached read_file(int fd, const kmp_cache_key *key)
{
    struct stat about;
    kmp_cached file = {0};
    if (fstat(fd, &about) != 0 || !is_own(&about) || about.st_size < (off_t)sizeof(head) ||
        about.st_size > KMP_CACHE_BYTES)
        return file;
    size_t size = (size_t)about.st_size - sizeof(head);
    file.whole = KMP_NEW(unsigned char, about.st_size);
    if (file.whole && read_whole(fd, file.whole, (size_t)about.st_size)) {
        file.bytes = file.whole + sizeof(head);
        file.size = size;
        head expected = head_of(key, file.bytes, size);
        if (memcmp(&expected, file.whole, sizeof expected) == 0)
            return file;
    }
    kmp_free(file.whole);
    return (kmp_cached){0};
}

kmp_cached kmp_cache_read(const char *folder, const kmp_cache_key *key)
{
    kmp_text path = {0};
    put_path(&path, folder, key);
    int fd = path.failed ? -1 : open(path.s, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    kmp_text_free(&path);
    if (fd < 0)
        return (kmp_cached){0};
    kmp_cached file = read_file(fd, key);
    if (file.whole)
        (void)futimens(fd, NULL); /* the time of its last use */
    close(fd);
    return file;
}

/* -- the bound --------------------------------------------------------------------------------------- */

/* The folder is looked through only when its files may exceed the bound. Until then their size is known from the length
 * of one more file, which grows by a byte for each begun unit that is written: appending needs no lock. Files that are
 * replaced count twice, until the folder is looked through. */
enum { UNIT = 4096 };
static const char counted[] = "counted";

static uint64_t units_of(uint64_t bytes)
{
    return (bytes + UNIT - 1) / UNIT;
}

static bool write_whole(int fd, const void *bytes, size_t size)
{
    const unsigned char *from = bytes;
    while (size > 0) {
        ssize_t n = write(fd, from, size);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        from += n;
        size -= (size_t)n;
    }
    return true;
}

/* Counts what has been added. False: the bound may be exceeded, or the size is not known. */
static bool fits(const char *folder, size_t added, uint64_t most)
{
    static const unsigned char nothing[UNIT];
    kmp_text path = {0};
    kmp_text_printf(&path, "%s/%s", folder, counted);
    int fd = path.failed ? -1 : open(path.s, O_WRONLY | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW);
    kmp_text_free(&path);
    struct stat about;
    bool known = fd >= 0 && fstat(fd, &about) == 0 && is_own(&about) && about.st_size > 0;
    uint64_t more = units_of(added), all = known ? (uint64_t)about.st_size + more : 0;
    for (; known && more > 0; more -= more < UNIT ? more : UNIT)
        known = write_whole(fd, nothing, more < UNIT ? more : UNIT);
    if (fd >= 0)
        close(fd);
    return known && all <= most / UNIT;
}

/* Keeps the size found by looking through the folder. */
static void keep_count(int folder, uint64_t units)
{
    int fd = openat(folder, counted, O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW, 0600);
    if (fd < 0)
        return;
    if (ftruncate(fd, (off_t)units) != 0)
        (void)unlinkat(folder, counted, 0);
    close(fd);
}

typedef struct entry {
    char name[NAME + sizeof ending];
    struct timespec used;
    uint64_t size;
} entry;

typedef struct entries {
    entry *list;
    size_t count;
    uint64_t bytes;
} entries;

static bool is_result(const char *name)
{
    return strlen(name) == NAME + sizeof ending - 1 && strspn(name, "0123456789abcdef") == NAME &&
           strcmp(name + NAME, ending) == 0;
}

static void add_entry(entries *all, const char *name, const struct stat *about)
{
    entry *list = kmp_list_room(all->list, all->count, sizeof *list);
    if (!list)
        return;
    all->list = list;
    entry *e = &all->list[all->count++];
    memcpy(e->name, name, sizeof e->name);
    e->used = about->st_mtim;
    e->size = (uint64_t)about->st_size;
    all->bytes += e->size;
}

static int by_use(const void *a, const void *b)
{
    const entry *x = a, *y = b;
    if (x->used.tv_sec != y->used.tv_sec)
        return x->used.tv_sec < y->used.tv_sec ? -1 : 1;
    if (x->used.tv_nsec != y->used.tv_nsec)
        return x->used.tv_nsec < y->used.tv_nsec ? -1 : 1;
    return strcmp(x->name, y->name);
}

/* Removes the results used longest ago until seven eighths of the bound are left. */
static void shrink(const char *path, uint64_t most)
{
    entries all = {0};
    DIR *folder = opendir(path);
    if (!folder)
        return;
    /* Lists the results; removes temporary files without an owner. */
    time_t now = time(NULL);
    struct stat about;
    for (const struct dirent *d = readdir(folder); d; d = readdir(folder)) {
        bool new = strncmp(d->d_name, temporary, sizeof temporary - 1) == 0;
        if ((!new && !is_result(d->d_name)) || fstatat(dirfd(folder), d->d_name, &about, AT_SYMLINK_NOFOLLOW) != 0 ||
            !S_ISREG(about.st_mode))
            continue;
        if (!new)
            add_entry(&all, d->d_name, &about);
        else if (now - about.st_mtime > STALE)
            (void)unlinkat(dirfd(folder), d->d_name, 0);
    }
    bool full = all.bytes > most;
    if (full)
        qsort(all.list, all.count, sizeof *all.list, by_use);
    size_t removed = 0;
    for (; full && removed < all.count && all.bytes > most - most / 8; removed++)
        if (unlinkat(dirfd(folder), all.list[removed].name, 0) == 0)
            all.bytes -= all.list[removed].size;
    uint64_t units = 0;
    for (size_t k = removed; k < all.count; k++)
        units += units_of(all.list[k].size);
    keep_count(dirfd(folder), units);
    closedir(folder);
    kmp_free(all.list);
}

/* -- writing ----------------------------------------------------------------------------------------- */

/* Makes the folder and the folders above it, readable only by the user. */
static bool make_folders(const char *folder)
{
    struct stat about;
    char *path = stat(folder, &about) == 0 ? NULL : kmp_strdup(folder);
    for (char *at = path; at && *at; at++)
        if (*at == '/' && at > path) {
            *at = '\0';
            (void)mkdir(path, 0700);
            *at = '/';
        }
    bool made = path && mkdir(path, 0700) == 0;
    kmp_free(path);
    return made || (stat(folder, &about) == 0 && S_ISDIR(about.st_mode));
}

void kmp_cache_write(const char *folder, const kmp_cache_key *key, const void *bytes, size_t size, uint64_t most)
{
    size_t whole = size + sizeof(head);
    struct rlimit limit; /* a process that exceeds its limit is ended by a signal */
    bool may = getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || whole <= limit.rlim_cur;
    if (whole > most || whole > KMP_CACHE_BYTES || !may || !make_folders(folder))
        return;
    const head first = head_of(key, bytes, size);
    kmp_text path = {0}, new = {0};
    put_path(&path, folder, key);
    kmp_text_printf(&new, "%s/%sXXXXXX", folder, temporary);
    int fd = path.failed || new.failed ? -1 : mkstemp(new.s);
    if (fd >= 0) {
        bool written = write_whole(fd, &first, sizeof first) && write_whole(fd, bytes, size);
        written = close(fd) == 0 && written;
        if (!written || rename(new.s, path.s) != 0)
            (void)unlink(new.s);
        if (!fits(folder, whole, most))
            shrink(folder, most);
    }
    kmp_text_free(&path);
    kmp_text_free(&new);
}
