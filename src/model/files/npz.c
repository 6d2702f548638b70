/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/files/npz.h"
#include "base/crc32.h"
#include "model/files/inflate.h"
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Sizes of the parts of archives, and the most bytes of an array, beyond what bodies have. */
enum { HEAD = 30, ENTRY = 46, END = 22, LOCATOR = 20, WIDE_END = 56, COMMENT_MOST = 65535, MOST_BYTES = 1 << 29 };
#define ELSEWHERE 0xffffffffu

typedef struct kmp_npz_member member;

static uint64_t little(const unsigned char *from, int bytes)
{
    uint64_t value = 0;
    for (int k = bytes - 1; k >= 0; k--)
        value = value << 8 | from[k];
    return value;
}

static bool refuse(kmp_text *why, const char *words)
{
    kmp_text_put(why, words);
    return false;
}

/* -- the archive ------------------------------------------------------------------------------------- */

/* The end of the directory: the last place with its signature. -1: none. */
static ptrdiff_t find_end(const kmp_npz *npz)
{
    if (npz->length < END)
        return -1;
    const size_t last = npz->length - END, first = last > COMMENT_MOST ? last - COMMENT_MOST : 0;
    for (size_t at = last + 1; at-- > first;)
        if (little(npz->bytes + at, 4) == 0x06054b50)
            return (ptrdiff_t)at;
    return -1;
}

/* The place of the directory, and the number of its files. */
static bool find_directory(const kmp_npz *npz, uint64_t *at, uint64_t *count)
{
    const ptrdiff_t end = find_end(npz);
    if (end < 0)
        return false;
    *count = little(npz->bytes + end + 10, 2);
    *at = little(npz->bytes + end + 16, 4);
    if ((*count != 0xffff && *at != ELSEWHERE) || end < LOCATOR || little(npz->bytes + end - LOCATOR, 4) != 0x07064b50)
        return true;
    const uint64_t wide = little(npz->bytes + end - LOCATOR + 8, 8);
    if (npz->length < WIDE_END || wide > npz->length - WIDE_END || little(npz->bytes + wide, 4) != 0x06064b50)
        return false;
    *count = little(npz->bytes + wide + 32, 8);
    *at = little(npz->bytes + wide + 48, 8);
    return true;
}

/* Sizes and places of 64 bits, in the order of the ones that are elsewhere. */
static void take_wide(const unsigned char *extra, size_t length, uint64_t value[3])
{
    for (size_t at = 0; length - at >= 4;) {
        const uint64_t kind = little(extra + at, 2), own = little(extra + at + 2, 2);
        at += 4;
        if (length - at < own)
            return;
        for (size_t k = 0, next = at; kind == 1 && k < 3; k++)
            if (value[k] == ELSEWHERE && at + own - next >= 8) {
                value[k] = little(extra + next, 8);
                next += 8;
            }
        at += own;
    }
}

/* A file of the directory at `*at`, which moves to the next one. */
static bool take_member(kmp_npz *npz, uint64_t *at)
{
    if (npz->length < ENTRY || *at > npz->length - ENTRY || little(npz->bytes + *at, 4) != 0x02014b50)
        return false;
    const unsigned char *entry = npz->bytes + *at;
    const size_t name = (size_t)little(entry + 28, 2), extra = (size_t)little(entry + 30, 2),
                 comment = (size_t)little(entry + 32, 2);
    uint64_t value[3] = {little(entry + 24, 4), little(entry + 20, 4), little(entry + 42, 4)};
    if (npz->length - *at - ENTRY < name + extra + comment)
        return false;
    take_wide(entry + ENTRY + name, extra, value);
    char *own = kmp_arena_alloc(npz->arena, name + 1, 1);
    if (!own)
        return false;
    memcpy(own, entry + ENTRY, name);
    if (name > 4 && strcmp(own + name - 4, ".npy") == 0)
        own[name - 4] = '\0';
    npz->members[npz->count++] = (member){.name = own,
                                          .at = (size_t)value[2],
                                          .stored = (size_t)value[1],
                                          .size = (size_t)value[0],
                                          .method = (unsigned)little(entry + 10, 2) | (unsigned)(entry[8] & 1) << 16,
                                          .checksum = (unsigned)little(entry + 16, 4)};
    *at += ENTRY + name + extra + comment;
    return true;
}

bool kmp_npz_open(kmp_arena *arena, const char *bytes, size_t length, kmp_npz *npz, kmp_text *why)
{
    uint64_t at, count;
    *npz = (kmp_npz){.arena = arena, .bytes = (const unsigned char *)bytes, .length = length};
    if (!find_directory(npz, &at, &count))
        return refuse(why, "it is not an .npz, a ZIP archive of arrays, or is incomplete");
    if (count > length / ENTRY)
        return refuse(why, "its directory is damaged: write it again");
    npz->members = KMP_ARENA_NEW(arena, member, count + 1);
    for (uint64_t k = 0; k < count && npz->members; k++)
        if (!take_member(npz, &at))
            return arena->failed ? false : refuse(why, "its directory is damaged: write it again");
    return npz->members;
}

static const member *find(const kmp_npz *npz, const char *name)
{
    for (int k = 0; k < npz->count; k++)
        if (strcmp(npz->members[k].name, name) == 0)
            return &npz->members[k];
    return NULL;
}

bool kmp_npz_has(const kmp_npz *npz, const char *name)
{
    return find(npz, name);
}

/* The bytes of a file, expanded. NULL: `why` says why, or there is no memory. */
static const unsigned char *bytes_of(const kmp_npz *npz, const member *m, kmp_text *why)
{
    enum { STORED = 0, DEFLATED = 8 };
    if (m->method != STORED && m->method != DEFLATED) {
        kmp_text_printf(why, "it is %s: numpy.savez and numpy.savez_compressed write what can be read",
                        m->method >> 16 ? "encrypted" : "compressed by another method than DEFLATE");
        return NULL;
    }
    if (m->size > MOST_BYTES) {
        kmp_text_printf(why, "it has %.3g MiB, the most are %d", (double)m->size / (1 << 20), MOST_BYTES >> 20);
        return NULL;
    }
    bool good = npz->length >= HEAD && m->at <= npz->length - HEAD && little(npz->bytes + m->at, 4) == 0x04034b50;
    const unsigned char *head = good ? npz->bytes + m->at : npz->bytes;
    const size_t skip = good ? HEAD + (size_t)(little(head + 26, 2) + little(head + 28, 2)) : 0;
    good = good && npz->length - m->at >= skip && npz->length - m->at - skip >= m->stored;
    const unsigned char *from = npz->bytes + m->at + skip;
    unsigned char *expanded = good && m->method == DEFLATED ? kmp_arena_alloc(npz->arena, m->size + 1, 1) : NULL;
    if (good && m->method == DEFLATED && !expanded)
        return NULL;
    good = good && (expanded ? kmp_inflate(from, m->stored, expanded, m->size) : m->stored == m->size);
    from = expanded ? expanded : from;
    if (good && kmp_crc32(from, m->size) == m->checksum)
        return from;
    kmp_text_put(why, "its bytes are damaged: write the file again");
    return NULL;
}

/* -- an array ---------------------------------------------------------------------------------------- */

/* The header of an array. */
typedef struct header {
    char kind;
    int width; /* bytes of a number, characters of a word */
    bool by_columns, swapped;
    const unsigned char *data;
    size_t length;
} header;

/* The text behind a key of the dictionary in the header, as Python writes it. NULL: none. */
static const char *value_of(const char *text, const char *key)
{
    const char *at = strstr(text, key);
    at = at ? strchr(at, ':') : NULL;
    return at ? at + 1 + strspn(at + 1, " ") : NULL;
}

static bool take_shape(const char *text, kmp_npz_array *array)
{
    if (*text != '(')
        return false;
    array->rank = 0;
    array->count = 1;
    for (text++; *text != ')';) {
        char *end;
        text += strspn(text, " ,");
        if (*text == ')')
            break;
        const unsigned long long size = strtoull(text, &end, 10);
        if (end == text || *text == '-' || array->rank == KMP_NPZ_RANK_MOST || size > MOST_BYTES)
            return false;
        text = end;
        array->shape[array->rank++] = (size_t)size;
        array->count = size > 0 && array->count > MOST_BYTES / size ? MOST_BYTES : array->count * (size_t)size;
        if (*text != ',' && *text != ')')
            return false;
    }
    return true;
}

/* The type, such as '<f8'. */
static bool take_type(const char *text, header *h, kmp_text *why)
{
    const char quote = *text;
    if (quote != '\'' && quote != '"')
        return refuse(why, "its elements have several parts: write each part as an array");
    h->swapped = text[1] == '>';
    text += strchr("<>|=", text[1]) && text[1] ? 2 : 1;
    h->kind = *text;
    h->width = h->kind ? atoi(text + 1) : 0;
    if (h->kind == 'O')
        return refuse(why, "it has objects, which are not read because they are programs of Python's pickle: write "
                           "numbers, or words of type '<U'");
    const bool number = h->kind == 'f' || h->kind == 'i' || h->kind == 'u' || h->kind == 'b';
    const bool known = h->kind == 'f' ? h->width == 4 || h->width == 8
                       : h->kind == 'i' || h->kind == 'u'
                           ? h->width == 1 || h->width == 2 || h->width == 4 || h->width == 8
                       : h->kind == 'b' ? h->width == 1
                                        : h->kind == 'U' || h->kind == 'S';
    if (!known || h->width < 0 || h->width > 4096)
        return refuse(why, "its type is none of real numbers or words: write it as float64");
    if (h->swapped && (number ? h->width > 1 : h->kind == 'U'))
        return refuse(why, "its bytes are in big-endian order: write it in little-endian order, '<f8'");
    return true;
}

static bool take_header(kmp_npz *npz, const unsigned char *bytes, size_t size, header *h, kmp_npz_array *array,
                        kmp_text *why)
{
    const int wide = size > 8 && bytes[6] > 1 ? 4 : 2;
    if (size < 12 || memcmp(bytes, "\x93NUMPY", 6) != 0 || bytes[6] < 1 || bytes[6] > 3)
        return refuse(why, "it is not an array of NumPy (.npy, version 1, 2 or 3)");
    const size_t length = (size_t)little(bytes + 8, wide), skip = 8 + (size_t)wide;
    char *text = length <= size - skip ? kmp_arena_alloc(npz->arena, length + 1, 1) : NULL;
    if (!text)
        return npz->arena->failed ? false : refuse(why, "its header is damaged");
    memcpy(text, bytes + skip, length);
    const char *type = value_of(text, "'descr'"), *order = value_of(text, "'fortran_order'"),
               *shape = value_of(text, "'shape'");
    if (!type || !order || !shape)
        return refuse(why, "its header is damaged");
    h->by_columns = strncmp(order, "True", 4) == 0;
    h->data = bytes + skip + length;
    h->length = size - skip - length;
    return take_type(type, h, why) &&
           (take_shape(shape, array) || refuse(why, "it has too many dimensions or entries"));
}

static double number_at(const header *h, size_t k)
{
    const uint64_t raw = little(h->data + k * (size_t)h->width, h->width);
    const int64_t sign = h->kind == 'i' && h->width < 8 ? (int64_t)1 << (8 * h->width - 1) : 0;
    double x;
    if (h->kind != 'f')
        return h->kind == 'i' ? (double)(((int64_t)raw ^ sign) - sign) : (double)raw;
    if (h->width == 8) {
        memcpy(&x, &raw, 8);
        return x;
    }
    float small;
    const uint32_t half = (uint32_t)raw;
    memcpy(&small, &half, 4);
    return small;
}

/* The place of entry k, counted by rows, where the array is by columns. */
static size_t place_by_columns(const kmp_npz_array *array, size_t k)
{
    size_t place = 0, stride = array->count;
    for (int d = array->rank - 1; d >= 0; d--) {
        stride /= array->shape[d];
        place += k % array->shape[d] * stride;
        k /= array->shape[d];
    }
    return place;
}

/* Characters beyond ASCII become '?', as where arrays are written. */
static const char *word_at(const kmp_npz *npz, const header *h, size_t k)
{
    const int bytes = h->kind == 'U' ? 4 : 1;
    char *word = kmp_arena_alloc(npz->arena, (size_t)h->width + 1, 1);
    for (int i = 0; word && i < h->width; i++) {
        const uint64_t letter = little(h->data + ((size_t)h->width * k + (size_t)i) * (size_t)bytes, bytes);
        word[i] = letter < 128 ? (char)letter : '?';
    }
    return word;
}

bool kmp_npz_array_read(const kmp_npz *npz, const char *name, kmp_npz_array *array, kmp_text *why)
{
    const member *m = find(npz, name);
    kmp_npz own = *npz;
    header h = {0};
    *array = (kmp_npz_array){0};
    if (!m)
        return refuse(why, "it is missing");
    const unsigned char *bytes = bytes_of(npz, m, why);
    if (!bytes || !take_header(&own, bytes, m->size, &h, array, why))
        return false;
    const bool words = h.kind == 'U' || h.kind == 'S';
    const size_t each = (size_t)h.width * (h.kind == 'U' ? 4 : 1);
    if (each > 0 ? h.length / each < array->count || h.length != each * array->count : array->count > h.length + 4096)
        return refuse(why, "its data do not fill its shape: write the file again");
    if (words)
        array->word = kmp_arena_alloc(npz->arena, array->count + 1, sizeof *array->word);
    else
        array->value = kmp_arena_alloc(npz->arena, array->count + 1, sizeof *array->value);
    for (size_t k = 0; k < array->count && !npz->arena->failed; k++) {
        const size_t from = h.by_columns && array->rank > 1 ? place_by_columns(array, k) : k;
        if (words)
            array->word[k] = word_at(npz, &h, from);
        else
            array->value[k] = number_at(&h, from);
    }
    return !npz->arena->failed;
}
