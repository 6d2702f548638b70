/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/zip_archive.h"
#include "base/crc32.h"
#include "base/memory.h"
#include "output/named_arrays.h"
#include <string.h>

/* The places of the format, and the value in places of 32 bits where a field of 64 follows. */
enum { VERSION = 20, VERSION_WIDE = 45, DATE = 0x21, LONG = 1, CHECKSUM_AT = 14, SIZES_AT = 18 };
#define ELSEWHERE 0xffffffffu

static int version(const kmp_zip *zip)
{
    return zip->wide ? VERSION_WIDE : VERSION;
}

/* The local and the central header have these fields after their signatures, up to the length of the name. */
static void put_facts(kmp_zip *zip, const kmp_zip_member *m)
{
    kmp_put_integer(&zip->text, (uint64_t)version(zip), 2);
    kmp_put_integer(&zip->text, 0, 6); /* flags, no compression, no time */
    kmp_put_integer(&zip->text, DATE, 2);
    kmp_put_integer(&zip->text, m->checksum, 4);
    kmp_put_integer(&zip->text, zip->wide ? ELSEWHERE : m->size, 4);
    kmp_put_integer(&zip->text, zip->wide ? ELSEWHERE : m->size, 4);
    kmp_put_integer(&zip->text, strlen(m->name), 2);
}

/* The field of 64-bit sizes, `more` bytes longer than for them. */
static void put_sizes(kmp_zip *zip, const kmp_zip_member *m, int more)
{
    if (!zip->wide)
        return;
    kmp_put_integer(&zip->text, LONG, 2);
    kmp_put_integer(&zip->text, 16 + (uint64_t)more, 2);
    kmp_put_integer(&zip->text, m->size, 8);
    kmp_put_integer(&zip->text, m->size, 8);
}

void kmp_zip_begin(kmp_zip *zip, const char *name)
{
    size_t length = name ? strlen(name) : 0;
    kmp_zip_member *members = kmp_realloc(zip->member, (size_t)zip->count + 1, sizeof *members);
    char *own = KMP_NEW(char, length + 1);
    zip->member = members ? members : zip->member;
    if (!members || !own || !name) {
        kmp_free(own);
        zip->text.failed = true;
        return;
    }
    memcpy(own, name, length + 1);
    members[zip->count] = (kmp_zip_member){.name = own, .at = zip->text.length};
    /* The local header. */
    const kmp_zip_member *m = &members[zip->count++];
    kmp_put_integer(&zip->text, 0x04034b50, 4);
    put_facts(zip, m);
    kmp_put_integer(&zip->text, zip->wide ? 20 : 0, 2);
    kmp_text_put(&zip->text, m->name);
    put_sizes(zip, m, 0);
}

void kmp_zip_end_member(kmp_zip *zip)
{
    if (zip->text.failed)
        return;
    kmp_zip_member *m = &zip->member[zip->count - 1];
    size_t data = m->at + 30 + strlen(m->name) + (zip->wide ? 20 : 0);
    char *bytes = zip->text.s;
    m->size = zip->text.length - data;
    m->checksum = kmp_crc32(bytes + data, m->size);
    kmp_put_little(bytes + m->at + CHECKSUM_AT, m->checksum, 4);
    for (int k = 0; k < 2; k++)
        if (zip->wide)
            kmp_put_little(bytes + data - 16 + 8 * k, m->size, 8);
        else
            kmp_put_little(bytes + m->at + SIZES_AT + 4 * k, m->size, 4);
}

void kmp_zip_add(kmp_zip *zip, const char *name, const char *bytes, size_t size)
{
    kmp_zip_begin(zip, name);
    kmp_text_append(&zip->text, bytes, size);
    kmp_zip_end_member(zip);
}

static void put_wide_end(kmp_text *text, size_t directory, size_t end, int count)
{
    kmp_put_integer(text, 0x06064b50, 4);
    kmp_put_integer(text, 44, 8); /* of what follows in this record */
    kmp_put_integer(text, VERSION_WIDE, 2);
    kmp_put_integer(text, VERSION_WIDE, 2);
    kmp_put_integer(text, 0, 8); /* the first disk */
    kmp_put_integer(text, (uint64_t)count, 8);
    kmp_put_integer(text, (uint64_t)count, 8);
    kmp_put_integer(text, end - directory, 8);
    kmp_put_integer(text, directory, 8);
    kmp_put_integer(text, 0x07064b50, 4);
    kmp_put_integer(text, 0, 4);
    kmp_put_integer(text, end, 8);
    kmp_put_integer(text, 1, 4); /* disks */
}

static void put_end(kmp_zip *zip, size_t directory)
{
    kmp_text *text = &zip->text;
    size_t end = text->length;
    if (zip->wide)
        put_wide_end(text, directory, end, zip->count);
    kmp_put_integer(text, 0x06054b50, 4);
    kmp_put_integer(text, 0, 4);
    for (int k = 0; k < 2; k++)
        kmp_put_integer(text, zip->wide ? 0xffff : (uint64_t)zip->count, 2);
    kmp_put_integer(text, zip->wide ? ELSEWHERE : end - directory, 4);
    kmp_put_integer(text, zip->wide ? ELSEWHERE : directory, 4);
    kmp_put_integer(text, 0, 2); /* no comment */
}

kmp_text kmp_zip_end(kmp_zip *zip)
{
    size_t directory = zip->text.length;
    for (int k = 0; k < zip->count; k++) {
        /* The central header. */
        const kmp_zip_member *m = &zip->member[k];
        kmp_put_integer(&zip->text, 0x02014b50, 4);
        kmp_put_integer(&zip->text, (uint64_t)version(zip), 2);
        put_facts(zip, m);
        kmp_put_integer(&zip->text, zip->wide ? 28 : 0, 2);
        kmp_put_integer(&zip->text, 0, 8); /* no comment, the first disk, no attributes of a text */
        kmp_put_integer(&zip->text, 0, 2);
        kmp_put_integer(&zip->text, zip->wide ? ELSEWHERE : m->at, 4);
        kmp_text_put(&zip->text, m->name);
        put_sizes(zip, m, 8);
        if (zip->wide)
            kmp_put_integer(&zip->text, m->at, 8);
    }
    put_end(zip, directory);
    for (int k = 0; k < zip->count; k++)
        kmp_free(zip->member[k].name);
    kmp_free(zip->member);
    kmp_text text = zip->text;
    *zip = (kmp_zip){0};
    return text;
}
