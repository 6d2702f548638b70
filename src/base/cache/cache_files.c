/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of the cache: written under a temporary name and renamed; read only if whole, of this key, and the user's own;
 * the oldest removed when the folder has become too large. */
#include "base/cache/cache_files.h"
#include "base/memory.h"
#include "base/text.h"
#include "platform/platform.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* -- the identity of the build --------------------------------------------------------------------------- */

#if defined(__x86_64__)
#include <cpuid.h>
#endif

static void add_identity(void *digest, const char *name, const void *bytes, size_t size)
{
    if (name)
        kmp_digest_add_text(digest, name);
    else
        kmp_digest_add_part(digest, bytes, size);
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
    const bool known = kmp_build_identity(add_identity, digest);
    add_processor(digest);
    return known;
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
static bool read_whole(int file, unsigned char *to, size_t size)
{
    size_t done = 0;
    while (done < size) {
        ptrdiff_t n = kmp_file_get(file, to + done, size - done);
        if (n <= 0)
            return false;
        done += (size_t)n;
    }
    return true;
}

/* The file if it is whole, of this key, and no other user can have written it: some files have machine code. */
static kmp_cached read_file(int fd, const kmp_cache_key *key)
{
    kmp_path_state about;
    kmp_cached file = {0};
    if (!kmp_file_look(fd, &about) || !about.own || about.size < sizeof(head) || about.size > KMP_CACHE_BYTES)
        return file;
    size_t size = (size_t)about.size - sizeof(head);
    file.whole = KMP_NEW(unsigned char, about.size);
    if (file.whole && read_whole(fd, file.whole, (size_t)about.size)) {
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
    int fd = path.failed ? -1 : kmp_file_open(path.s, KMP_OPEN_READ | KMP_OPEN_AT_ONCE | KMP_OPEN_NO_LINK);
    kmp_text_free(&path);
    if (fd < 0)
        return (kmp_cached){0};
    kmp_cached file = read_file(fd, key);
    if (file.whole)
        kmp_file_touch(fd); /* the time of its last use */
    (void)kmp_file_close(fd);
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

/* Counts what has been added. False: the bound may be exceeded, or the size is not known. */
static bool fits(const char *folder, size_t added, uint64_t most)
{
    static const unsigned char nothing[UNIT];
    kmp_text path = {0};
    kmp_text_printf(&path, "%s/%s", folder, counted);
    int fd = path.failed ? -1 : kmp_file_open(path.s, KMP_OPEN_APPEND | KMP_OPEN_AT_ONCE | KMP_OPEN_NO_LINK);
    kmp_text_free(&path);
    kmp_path_state about;
    bool known = fd >= 0 && kmp_file_look(fd, &about) && about.own && about.size > 0;
    uint64_t more = units_of(added), all = known ? about.size + more : 0;
    for (; known && more > 0; more -= more < UNIT ? more : UNIT)
        known = kmp_file_put(fd, nothing, (size_t)(more < UNIT ? more : UNIT)) == 0;
    if (fd >= 0)
        (void)kmp_file_close(fd);
    return known && all <= most / UNIT;
}

/* Keeps the size found by looking through the folder. */
static void keep_count(const char *folder, uint64_t units)
{
    kmp_text path = {0};
    kmp_text_printf(&path, "%s/%s", folder, counted);
    int fd = path.failed ? -1
                         : kmp_file_open(path.s, KMP_OPEN_WRITE | KMP_OPEN_CREATE | KMP_OPEN_PRIVATE |
                                                     KMP_OPEN_AT_ONCE | KMP_OPEN_NO_LINK);
    if (fd >= 0) {
        bool kept = kmp_file_cut(fd, units) == 0;
        (void)kmp_file_close(fd);
        if (!kept)
            (void)kmp_path_remove(path.s);
    }
    kmp_text_free(&path);
}

typedef struct entry {
    char name[NAME + sizeof ending];
    int64_t used; /* s */
    long used_ns;
    uint64_t size;
} entry;

typedef struct entries {
    entry *list;
    size_t count;
    uint64_t bytes;
} entries;

/* The path of a name in the folder, in place of the text before; false: no memory. */
static bool put_name(kmp_text *path, const char *folder, const char *name)
{
    kmp_text_free(path);
    kmp_text_printf(path, "%s/%s", folder, name);
    return !path->failed;
}

static bool is_result(const char *name)
{
    return strlen(name) == NAME + sizeof ending - 1 && strspn(name, "0123456789abcdef") == NAME &&
           strcmp(name + NAME, ending) == 0;
}

static void add_entry(entries *all, const char *name, const kmp_path_state *about)
{
    entry *list = kmp_list_room(all->list, all->count, sizeof *list);
    if (!list)
        return;
    all->list = list;
    entry *e = &all->list[all->count++];
    memcpy(e->name, name, sizeof e->name);
    e->used = about->changed;
    e->used_ns = about->changed_ns;
    e->size = about->size;
    all->bytes += e->size;
}

static int by_use(const void *a, const void *b)
{
    const entry *x = a, *y = b;
    if (x->used != y->used)
        return x->used < y->used ? -1 : 1;
    if (x->used_ns != y->used_ns)
        return x->used_ns < y->used_ns ? -1 : 1;
    return strcmp(x->name, y->name);
}

/* Removes the results used longest ago until seven eighths of the bound are left. */
static void shrink(const char *folder, uint64_t most)
{
    entries all = {0};
    kmp_folder_names *names = kmp_folder_names_begin(folder);
    if (!names)
        return;
    /* Lists the results; removes temporary files without an owner. */
    int64_t now = (int64_t)time(NULL);
    kmp_text path = {0};
    kmp_path_state about;
    for (const char *name = kmp_folder_names_next(names); name; name = kmp_folder_names_next(names)) {
        bool new = strncmp(name, temporary, sizeof temporary - 1) == 0;
        if ((!new && !is_result(name)) || !put_name(&path, folder, name) || !kmp_path_look_here(path.s, &about) ||
            about.kind != KMP_PATH_FILE)
            continue;
        if (!new)
            add_entry(&all, name, &about);
        else if (now - about.changed > STALE)
            (void)kmp_path_remove(path.s);
    }
    kmp_folder_names_end(names);
    bool full = all.bytes > most;
    if (full)
        qsort(all.list, all.count, sizeof *all.list, by_use);
    size_t removed = 0;
    for (; full && removed < all.count && all.bytes > most - most / 8; removed++)
        if (put_name(&path, folder, all.list[removed].name) && kmp_path_remove(path.s))
            all.bytes -= all.list[removed].size;
    uint64_t units = 0;
    for (size_t k = removed; k < all.count; k++)
        units += units_of(all.list[k].size);
    keep_count(folder, units);
    kmp_text_free(&path);
    kmp_free(all.list);
}

/* -- writing ----------------------------------------------------------------------------------------- */

/* Makes the folder and the folders above it, readable only by the user. */
static bool make_folders(const char *folder)
{
    kmp_path_state about;
    char *path = kmp_path_look(folder, &about) ? NULL : kmp_strdup(folder);
    for (char *at = path; at && *at; at++)
        if (kmp_is_separator(*at) && at > path) {
            const char separator = *at;
            *at = '\0';
            (void)kmp_folder_create(path, true);
            *at = separator;
        }
    bool made = path && kmp_folder_create(path, true);
    kmp_free(path);
    return made || (kmp_path_look(folder, &about) && about.kind == KMP_PATH_FOLDER);
}

void kmp_cache_write(const char *folder, const kmp_cache_key *key, const void *bytes, size_t size, uint64_t most)
{
    size_t whole = size + sizeof(head);
    const bool may = whole <= kmp_file_limit(); /* a process that exceeds its limit is ended by a signal */
    if (whole > most || whole > KMP_CACHE_BYTES || !may || !make_folders(folder))
        return;
    const head first = head_of(key, bytes, size);
    kmp_text path = {0}, new = {0};
    put_path(&path, folder, key);
    kmp_text_printf(&new, "%s/%sXXXXXX", folder, temporary);
    int fd = path.failed || new.failed ? -1 : kmp_file_temporary(new.s);
    if (fd >= 0) {
        bool written = kmp_file_put(fd, &first, sizeof first) == 0 && kmp_file_put(fd, bytes, size) == 0;
        written = kmp_file_close(fd) == 0 && written;
        if (!written || kmp_path_rename(new.s, path.s) != 0)
            (void)kmp_path_remove(new.s);
        if (!fits(folder, whole, most))
            shrink(folder, most);
    }
    kmp_text_free(&path);
    kmp_text_free(&new);
}
