/* SPDX-License-Identifier: BSD-3-Clause */
/* The footer is read by Thrift's compact protocol, with the fields that matter taken and all others skipped; then the
 * pages of each column, one after another. */
#include "ensemble/sampling/parquet_reader.h"
#include "base/file.h"
#include "base/memory.h"
#include <limits.h>
#include <stdint.h>
#include <string.h>

/* Types of Thrift's fields. */
enum { STOP, TRUE, FALSE, BYTE, I16, I32, I64, DOUBLE, BINARY, LIST, SET, MAP, STRUCT };
enum { MOST_DEPTH = 16, MOST_COLUMNS = 1 << 16, LEVEL_BYTES = 4 };

/* A place in the bytes of the file. `failed` is sticky. */
typedef struct source {
    const unsigned char *at, *end;
    bool failed;
} source;

typedef struct reader {
    kempe_context *context;
    const char *path;
    const unsigned char *bytes;
    size_t size;
    kmp_parquet_file *file;
    int *type; /* of the columns, in Parquet's numbers */
    bool *optional;
    int done;                 /* rows of the groups before this one */
    const unsigned char *sum; /* place of the sum in the file; NULL: it has none */
} reader;

/* -- compact protocol -------------------------------------------------------------------------------- */

static unsigned take_byte(source *s)
{
    if (s->at >= s->end) {
        s->failed = true;
        return 0;
    }
    return *s->at++;
}

static uint64_t take_varint(source *s)
{
    uint64_t x = 0;
    for (int shift = 0; shift < 64; shift += 7) {
        unsigned byte = take_byte(s);
        x |= (uint64_t)(byte & 0x7f) << shift;
        if (byte < 0x80)
            return x;
    }
    s->failed = true;
    return 0;
}

static int64_t take_signed(source *s)
{
    uint64_t x = take_varint(s);
    return (int64_t)(x >> 1) ^ -(int64_t)(x & 1);
}

static int take_int(source *s, int low, int high)
{
    int64_t x = take_signed(s);
    if (x >= low && x <= high)
        return (int)x;
    s->failed = true;
    return low;
}

static const char *take_bytes(source *s, size_t *length)
{
    uint64_t n = take_varint(s);
    const char *bytes = (const char *)s->at;
    *length = 0;
    if (s->failed || n > (uint64_t)(s->end - s->at)) {
        s->failed = true;
        return "";
    }
    s->at += n;
    *length = (size_t)n;
    return bytes;
}

/* Number of elements of a list, each of which takes at least a byte. */
static int take_list(source *s, int *type)
{
    unsigned head = take_byte(s);
    uint64_t count = head >> 4 < 15 ? head >> 4 : take_varint(s);
    *type = (int)(head & 15);
    if (count > (uint64_t)(s->end - s->at))
        s->failed = true;
    return s->failed ? 0 : (int)(count < INT_MAX ? count : INT_MAX);
}

/* The next field of a struct, each of which has a larger number than the one before it; false: its end, or a failure.
 */
static bool next_field(source *s, int *field, int *type)
{
    unsigned head = take_byte(s);
    *type = (int)(head & 15);
    if (s->failed || head == STOP)
        return false;
    *field = head >> 4 ? *field + (int)(head >> 4) : take_int(s, *field + 1, SHRT_MAX);
    s->failed = s->failed || *field > SHRT_MAX;
    return !s->failed;
}

static void skip(source *s, int type, int depth);

static void skip_elements(source *s, int count, int type, int depth)
{
    for (int k = 0; k < count && !s->failed; k++)
        if (type == TRUE || type == FALSE)
            (void)take_byte(s);
        else
            skip(s, type, depth);
}

static void skip(source *s, int type, int depth)
{
    int field = 0, inner = 0, count;
    size_t length;
    if (depth > MOST_DEPTH) {
        s->failed = true;
        return;
    }
    if (type == BYTE)
        (void)take_byte(s);
    else if (type == I16 || type == I32 || type == I64)
        (void)take_varint(s);
    else if (type == DOUBLE)
        for (int k = 0; k < 8; k++)
            (void)take_byte(s);
    else if (type == BINARY)
        (void)take_bytes(s, &length);
    else if (type == LIST || type == SET)
        count = take_list(s, &inner), skip_elements(s, count, inner, depth + 1);
    else if (type == STRUCT)
        while (next_field(s, &field, &inner))
            skip(s, inner, depth + 1);
    else if (type != TRUE && type != FALSE)
        s->failed = true; /* maps do not occur */
}

/* -- messages ---------------------------------------------------------------------------------------- */

static kempe_status refuse(const reader *r, const char *why)
{
    return kmp_complain(r->context, r->path, 0, 0, "%s", why);
}

static kempe_status refuse_damaged(const reader *r)
{
    return refuse(r, "not a Parquet file, or a damaged one");
}

static kempe_status refuse_column(const reader *r, int column, const char *why)
{
    return kmp_complain(r->context, r->path, 0, 0,
                        "column '%s' %s; columns are read that are flat, plain, without empty cells and uncompressed, "
                        "as pyarrow writes them with compression='none', use_dictionary=False",
                        r->file->column[column].name, why);
}

/* -- the footer -------------------------------------------------------------------------------------- */

/* A copy of a word. A value with a character of code 0 is not a text. */
static char *keep(reader *r, source *s, const char *bytes, size_t length)
{
    s->failed = s->failed || memchr(bytes, '\0', length);
    char *kept = KMP_ARENA_NEW(&r->file->arena, char, length + 1);
    if (kept && length > 0)
        memcpy(kept, bytes, length);
    return kept;
}

/* Parquet's types whose values are numbers, with their bytes; 0: another one. */
static size_t size_of(int type)
{
    static const size_t sizes[] = {0, 4, 8, 0, 4, 8}; /* INT32, INT64, FLOAT, DOUBLE */
    return type >= 0 && type < 6 ? sizes[type] : 0;
}

enum { PARQUET_INT32 = 1, PARQUET_INT64, PARQUET_FLOAT = 4, PARQUET_DOUBLE, PARQUET_BYTES };

/* One element of the schema: the root, or a column. */
static kempe_status read_element(reader *r, source *s, int column)
{
    int field = 0, type, children = 0, values = -1, repetition = 0;
    size_t length = 0;
    const char *name = "";
    while (next_field(s, &field, &type))
        if (field == 1 && type == I32)
            values = take_int(s, 0, SHRT_MAX);
        else if (field == 3 && type == I32)
            repetition = take_int(s, 0, SHRT_MAX);
        else if (field == 4 && type == BINARY)
            name = take_bytes(s, &length);
        else if (field == 5 && type == I32)
            children = take_int(s, 0, INT_MAX);
        else
            skip(s, type, 0);
    if (s->failed)
        return refuse_damaged(r);
    if (column < 0)
        return children == r->file->column_count ? KEMPE_OK : refuse(r, "its columns are nested");
    r->file->column[column].name = keep(r, s, name, length);
    if (s->failed)
        return refuse_damaged(r);
    r->file->column[column].unit = "";
    r->type[column] = values;
    r->optional[column] = repetition == 1;
    KMP_TRY(kmp_made(r->context, !r->file->arena.failed));
    if (children > 0 || repetition > 1)
        return refuse_column(r, column, "is nested or repeated");
    return values == PARQUET_BYTES || size_of(values) > 0
               ? KEMPE_OK
               : refuse_column(r, column, "has another type than numbers and words");
}

static kempe_status read_schema(reader *r, source *s)
{
    int type, count = take_list(s, &type);
    kmp_parquet_file *f = r->file;
    if (s->failed || type != STRUCT || count < 1 || count > MOST_COLUMNS || f->column)
        return refuse_damaged(r);
    f->column_count = count - 1;
    (void)KMP_ARENA_MAKE(&f->arena, KMP_ROOM(kmp_parquet_column, count, &f->column), KMP_ROOM(int, count, &r->type),
                         KMP_ROOM(bool, count, &r->optional));
    KMP_TRY(kmp_made(r->context, !f->arena.failed));
    for (int k = -1; k < f->column_count; k++)
        KMP_TRY(read_element(r, s, k));
    return KEMPE_OK;
}

static kempe_status read_notes(reader *r, source *s)
{
    int type, count = take_list(s, &type);
    kmp_parquet_file *f = r->file;
    if (s->failed || type != STRUCT)
        return refuse_damaged(r);
    f->note = KMP_ARENA_NEW(&f->arena, kmp_parquet_note, count);
    for (int k = 0; f->note && k < count && !s->failed; k++) {
        int field = 0, inner;
        size_t length;
        f->note[k] = (kmp_parquet_note){"", ""};
        while (next_field(s, &field, &inner)) {
            const char *bytes = inner == BINARY ? take_bytes(s, &length) : NULL;
            if (bytes && field == 1) {
                f->note[k].key = keep(r, s, bytes, length);
            } else if (bytes && field == 2) {
                f->note[k].value = keep(r, s, bytes, length);
                r->sum = (const unsigned char *)bytes;
            } else if (!bytes) {
                skip(s, inner, 0);
            }
        }
        f->note_count = k + 1;
    }
    KMP_TRY(kmp_made(r->context, !f->arena.failed));
    return s->failed ? refuse_damaged(r) : KEMPE_OK;
}

/* -- pages ------------------------------------------------------------------------------------------- */

typedef struct page {
    int type, size, whole, values, encoding, version; /* whole: bytes without compression */
    int repetition_bytes, definition_bytes;           /* of version 2 */
    bool plain;                                       /* of version 2: it is not compressed */
} page;

/* Types and encodings of pages. */
enum { DICTIONARY_PAGE = 2, PLAIN = 0, PLAIN_DICTIONARY = 2, INDICES = 8 };

/* The values to which the indices of a column's pages refer. */
typedef struct dictionary {
    int count;
    double *number;
    const char **word;
} dictionary;

static void read_version(source *s, page *p)
{
    int field = 0, type;
    while (next_field(s, &field, &type))
        if (field == 1 && type == I32)
            p->values = take_int(s, 0, INT_MAX);
        else if (type == I32 && field == (p->version == 1 ? 2 : 4))
            p->encoding = take_int(s, 0, SHRT_MAX);
        else if (type == I32 && p->version == 2 && field == 5)
            p->definition_bytes = take_int(s, 0, INT_MAX);
        else if (type == I32 && p->version == 2 && field == 6)
            p->repetition_bytes = take_int(s, 0, INT_MAX);
        else if (type == FALSE && p->version == 2 && field == 7)
            p->plain = true;
        else
            skip(s, type, 0);
}

static page read_page(source *s)
{
    page p = {.type = -1};
    int field = 0, type;
    while (next_field(s, &field, &type))
        if (field == 1 && type == I32)
            p.type = take_int(s, 0, SHRT_MAX);
        else if (field == 2 && type == I32)
            p.whole = take_int(s, 0, INT_MAX);
        else if (field == 3 && type == I32)
            p.size = take_int(s, 0, INT_MAX);
        else if ((field == 5 || field == 7 || field == 8) && type == STRUCT) {
            p.version = field == 8 ? 2 : 1; /* a dictionary begins as version 1 does */
            read_version(s, &p);
        } else {
            skip(s, type, 0);
        }
    return p;
}

/* -- compression ------------------------------------------------------------------------------------- */

/* Part of the output of Snappy's format: bytes that follow, or a copy of earlier ones. False: the input is damaged. */
static bool put_piece(source *s, unsigned char *out, size_t *at, size_t size)
{
    unsigned tag = take_byte(s);
    size_t length = (tag >> 2) + 1, back = 0;
    int more = 0; /* bytes of the length, or of the distance */
    if ((tag & 3) == 0) {
        more = length > 60 ? (int)length - 60 : 0;
        for (int k = 0; k < more; k++)
            length = (k == 0 ? 1 : length) + ((size_t)take_byte(s) << (8 * k));
        if (s->failed || length > (size_t)(s->end - s->at) || length > size - *at)
            return false;
        memcpy(out + *at, s->at, length);
        s->at += length;
        *at += length;
        return true;
    }
    if ((tag & 3) == 1) {
        length = (tag >> 2 & 7) + 4;
        back = (size_t)(tag >> 5) << 8 | take_byte(s);
    } else {
        more = (tag & 3) == 2 ? 2 : 4;
        for (int k = 0; k < more; k++)
            back |= (size_t)take_byte(s) << (8 * k);
    }
    if (s->failed || back == 0 || back > *at || length > size - *at)
        return false;
    for (size_t k = 0; k < length; k++, ++*at) /* they may overlap */
        out[*at] = out[*at - back];
    return true;
}

/* The bytes that Snappy has compressed, to be freed. NULL: damaged, or no memory. Three bytes give 64 at most. */
static unsigned char *expanded(source s, size_t size)
{
    enum { MOST_GROWTH = 32 };
    size_t at = 0;
    if (take_varint(&s) != size || s.failed || size / MOST_GROWTH > (size_t)(s.end - s.at) + 1)
        return NULL;
    unsigned char *out = kmp_calloc(size + 1, 1);
    bool good = out;
    while (good && at < size)
        good = put_piece(&s, out, &at, size);
    if (!good || s.at != s.end) {
        kmp_free(out);
        return NULL;
    }
    return out;
}

/* -- values ------------------------------------------------------------------------------------------ */

/* Index k of a page: bits at a place of a group. */
static unsigned bits_at(const unsigned char *bytes, size_t bit, int width)
{
    unsigned x = 0;
    for (int k = 0; k < width; k++)
        x |= (unsigned)(bytes[(bit + (size_t)k) / 8] >> ((bit + (size_t)k) % 8) & 1) << k;
    return x;
}

/* `count` indices: runs of one, and groups of eight. */
static void take_indices(source *s, int width, int count, int *index)
{
    s->failed = s->failed || width > 31;
    for (int k = 0; k < count && !s->failed;) {
        uint64_t head = take_varint(s), run = head >> 1;
        if (head & 1) {
            size_t bytes = run <= INT_MAX / 32 ? (size_t)run * (size_t)width : SIZE_MAX;
            if (run == 0 || bytes > (size_t)(s->end - s->at)) {
                s->failed = true;
                return;
            }
            for (size_t i = 0; i < (size_t)run * 8 && k < count; i++)
                index[k++] = (int)bits_at(s->at, i * (size_t)width, width);
            s->at += bytes;
        } else {
            unsigned value = 0;
            for (int b = 0; b < (width + 7) / 8; b++)
                value |= take_byte(s) << (8 * b);
            s->failed = s->failed || run == 0 || value > INT_MAX;
            for (uint64_t i = 0; i < run && k < count; i++)
                index[k++] = (int)value;
        }
    }
}

/* True if all `count` levels are 1: runs, and groups of eight bits. */
static bool all_defined(source levels, int count)
{
    while (count > 0 && !levels.failed) {
        uint64_t head = take_varint(&levels), run = head >> 1;
        if (head & 1) {
            for (uint64_t k = 0; k < run && count > 0 && !levels.failed; k++, count -= 8) {
                unsigned wanted = count >= 8 ? 0xffu : (1u << count) - 1;
                if ((take_byte(&levels) & wanted) != wanted)
                    return false;
            }
        } else {
            if (take_byte(&levels) != 1 || run == 0)
                return false;
            count = run < (uint64_t)count ? count - (int)run : 0;
        }
    }
    return !levels.failed;
}

/* Skips the levels in front of the values of a page. */
static bool pass_levels(const reader *r, source *s, const page *p, int column)
{
    size_t length = p->version == 2 ? (size_t)p->definition_bytes : 0;
    if (!r->optional[column])
        return p->version == 1 || (p->definition_bytes == 0 && p->repetition_bytes == 0);
    if (p->version == 1) {
        for (int k = 0; k < LEVEL_BYTES; k++)
            length |= (size_t)take_byte(s) << (8 * k);
    }
    if (s->failed || p->repetition_bytes > 0 || length > (size_t)(s->end - s->at))
        return false;
    bool defined = all_defined((source){.at = s->at, .end = s->at + length}, p->values);
    s->at += length;
    return defined;
}

static double number_at(const unsigned char *at, int type)
{
    uint64_t bits = 0;
    size_t size = size_of(type);
    for (size_t k = 0; k < size; k++)
        bits |= (uint64_t)at[k] << (8 * k);
    if (type == PARQUET_INT32)
        return (double)(int32_t)(uint32_t)bits;
    if (type == PARQUET_INT64)
        return (double)(int64_t)bits;
    uint32_t low = (uint32_t)bits;
    double x;
    float narrow;
    if (type == PARQUET_FLOAT)
        return memcpy(&narrow, &low, sizeof narrow), (double)narrow;
    return memcpy(&x, &bits, sizeof x), x;
}

static const char *take_word(reader *r, source *s)
{
    size_t length = 0;
    for (int k = 0; k < LEVEL_BYTES; k++)
        length |= (size_t)take_byte(s) << (8 * k);
    if (s->failed || length > (size_t)(s->end - s->at)) {
        s->failed = true;
        return "";
    }
    const char *word = length > 0 ? keep(r, s, (const char *)s->at, length) : "";
    s->at += length;
    return word;
}

/* `count` values of a page, to numbers or to words. */
static void take_values(reader *r, source *s, int column, int count, double *number, const char **word)
{
    size_t size = size_of(r->type[column]);
    if (size > 0 && (size_t)(s->end - s->at) / size < (size_t)count) {
        s->failed = true;
        return;
    }
    for (int k = 0; k < count && !s->failed; k++)
        if (size > 0 && number)
            number[k] = number_at(s->at + size * (size_t)k, r->type[column]);
        else if (word)
            word[k] = take_word(r, s);
}

/* The dictionary of a column: its values. */
static bool take_dictionary(reader *r, source *s, int column, int count, dictionary *d)
{
    const size_t size = size_of(r->type[column]), least = size > 0 ? size : LEVEL_BYTES;
    if (d->count > 0 || (size_t)count > (size_t)(s->end - s->at) / least)
        return false;
    *d = (dictionary){.count = count,
                      .number = KMP_ARENA_NEW(&r->file->arena, double, count),
                      .word = KMP_ARENA_NEW(&r->file->arena, const char *, count)};
    if (!r->file->arena.failed)
        take_values(r, s, column, count, d->number, d->word);
    return !s->failed;
}

/* Values of a page by their indices into the dictionary. */
static void look_up(reader *r, source *s, const dictionary *d, int column, int row, int count)
{
    kmp_parquet_column *c = &r->file->column[column];
    int *index = KMP_ARENA_NEW(&r->file->arena, int, count);
    if (!index)
        return;
    take_indices(s, (int)take_byte(s), count, index);
    for (int k = 0; k < count && !s->failed; k++) {
        s->failed = index[k] >= d->count;
        if (s->failed)
            return;
        if (c->number)
            c->number[row + k] = d->number[index[k]];
        else
            c->word[row + k] = d->word[index[k]];
    }
}

/* The content of a page: its values, or a dictionary. */
static kempe_status read_content(reader *r, source *inside, const page *p, int column, int row, dictionary *d)
{
    kmp_parquet_column *c = &r->file->column[column];
    if (p->type == DICTIONARY_PAGE)
        return take_dictionary(r, inside, column, p->values, d) ? KEMPE_OK : refuse_damaged(r);
    if (p->encoding != PLAIN && p->encoding != PLAIN_DICTIONARY && p->encoding != INDICES)
        return refuse_column(r, column, "has an encoding that is not read: plain ones and those with a dictionary are");
    if (p->version == 1 && !pass_levels(r, inside, p, column))
        return refuse_column(r, column, "has empty cells");
    if (p->encoding == PLAIN)
        take_values(r, inside, column, p->values, c->number ? c->number + row : NULL, c->word ? c->word + row : NULL);
    else
        look_up(r, inside, d, column, row, p->values);
    return inside->failed || p->values == 0 ? refuse_damaged(r) : KEMPE_OK;
}

/* A page, which may be compressed; in version 2 its levels are not. */
static kempe_status open_page(reader *r, source inside, const page *p, int column, int row, bool snappy, dictionary *d)
{
    const unsigned char *begin = inside.at;
    bool second = p->type != DICTIONARY_PAGE && p->version == 2;
    if (second && !pass_levels(r, &inside, p, column))
        return refuse_column(r, column, "has empty cells");
    if (!snappy || (second && p->plain))
        return read_content(r, &inside, p, column, row, d);
    size_t levels = (size_t)(inside.at - begin);
    unsigned char *out = (size_t)p->whole >= levels ? expanded(inside, (size_t)p->whole - levels) : NULL;
    if (!out)
        return refuse_damaged(r);
    source whole = {.at = out, .end = out + ((size_t)p->whole - levels)};
    kempe_status status = read_content(r, &whole, p, column, row, d);
    kmp_free(out);
    return status;
}

/* -- groups of rows ---------------------------------------------------------------------------------- */

/* The metadata of a column in a group. */
typedef struct column_place {
    int codec;
    int64_t at, dictionary, size;
} column_place;

static column_place read_place(source *s)
{
    column_place place = {.at = -1, .dictionary = -1};
    int field = 0, type, inner = 0, kind;
    while (next_field(s, &field, &type))
        if (field != 3 || type != STRUCT)
            skip(s, type, 0);
        else
            while (next_field(s, &inner, &kind))
                if (inner == 4 && kind == I32)
                    place.codec = take_int(s, 0, SHRT_MAX);
                else if (inner == 7 && kind == I64)
                    place.size = take_signed(s);
                else if (inner == 9 && kind == I64)
                    place.at = take_signed(s);
                else if (inner == 11 && kind == I64)
                    place.dictionary = take_signed(s);
                else
                    skip(s, kind, 0);
    return place;
}

static kempe_status read_column(reader *r, const column_place *place, int column, int rows)
{
    static const char *const codecs[] = {NULL, "snappy", "gzip", "lzo", "brotli", "lz4", "zstd", "lz4"};
    if (place->codec > 1) {
        kmp_text why = {0};
        bool known = place->codec < (int)(sizeof codecs / sizeof *codecs);
        kmp_text_printf(&why, "is compressed (%s)", known ? codecs[place->codec] : "unknown");
        kempe_status status = why.failed ? kmp_fail_memory(r->context) : refuse_column(r, column, why.s);
        kmp_text_free(&why);
        return status;
    }
    int64_t from = place->dictionary > 0 && place->dictionary < place->at ? place->dictionary : place->at;
    if (from < 4 || place->size < 0 || (uint64_t)from > r->size || (uint64_t)place->size > r->size - (uint64_t)from)
        return refuse_damaged(r);
    const unsigned char *at = r->bytes + from;
    source s = {.at = at, .end = at + place->size};
    dictionary d = {.count = 0};
    for (int row = 0; row < rows;) {
        page p = read_page(&s);
        bool data = p.type != DICTIONARY_PAGE;
        if (s.failed || p.size > s.end - s.at || p.version == 0 || (data && p.values > rows - row))
            return refuse_damaged(r);
        KMP_TRY(
            open_page(r, (source){.at = s.at, .end = s.at + p.size}, &p, column, row + r->done, place->codec == 1, &d));
        s.at += p.size;
        row += data ? p.values : 0;
    }
    return kmp_made(r->context, !r->file->arena.failed);
}

static kempe_status read_group(reader *r, source *s)
{
    int field = 0, type, inner, columns = -1, rows = -1, count = r->file->column_count;
    column_place *places = KMP_NEW(column_place, count);
    kempe_status status = kmp_made(r->context, places);
    while (status == KEMPE_OK && next_field(s, &field, &type))
        if (field == 1 && type == LIST) {
            columns = take_list(s, &inner);
            for (int k = 0; k < columns && k < count && inner == STRUCT; k++)
                places[k] = read_place(s);
            s->failed = s->failed || columns != count || inner != STRUCT;
        } else if (field == 3 && type == I64) {
            rows = take_int(s, 0, r->file->rows - r->done);
        } else {
            skip(s, type, 0);
        }
    if (status == KEMPE_OK && (s->failed || columns != count || rows < 0))
        status = refuse_damaged(r);
    for (int k = 0; k < count && status == KEMPE_OK; k++)
        status = read_column(r, &places[k], k, rows);
    if (status == KEMPE_OK)
        r->done += rows;
    kmp_free(places);
    return status;
}

/* Room for all rows: runs of equal ones take little of the file. MOST: as many numbers as fill the longest file. */
static kempe_status make_room(reader *r)
{
    kmp_parquet_file *f = r->file;
    enum { MOST = 1 << 27, MOST_A_BYTE = 1 << 14 };
    int64_t values = (int64_t)f->rows * f->column_count;
    if (!f->column || f->rows < 0 || (size_t)values / MOST_A_BYTE > r->size)
        return refuse_damaged(r);
    if (values > MOST)
        return kmp_complain(r->context, r->path, 0, 0,
                            "the table has %d rows of %d columns, and at most %d values are read; write several files",
                            f->rows, f->column_count, MOST);
    for (int k = 0; k < f->column_count; k++)
        if (r->type[k] == PARQUET_BYTES)
            f->column[k].word = KMP_ARENA_NEW(&f->arena, const char *, f->rows);
        else
            f->column[k].number = KMP_ARENA_NEW(&f->arena, double, f->rows);
    return kmp_made(r->context, !f->arena.failed);
}

static kempe_status read_groups(reader *r, source *s)
{
    int type, count = take_list(s, &type);
    KMP_TRY(make_room(r));
    if (s->failed || (count > 0 && type != STRUCT))
        return refuse_damaged(r);
    for (int k = 0; k < count; k++)
        KMP_TRY(read_group(r, s));
    return KEMPE_OK;
}

static kempe_status read_footer(reader *r, source s)
{
    int field = 0, type;
    r->file->rows = -1;
    while (next_field(&s, &field, &type))
        if (field == 2 && type == LIST)
            KMP_TRY(read_schema(r, &s));
        else if (field == 3 && type == I64)
            r->file->rows = take_int(&s, 0, INT_MAX);
        else if (field == 4 && type == LIST)
            KMP_TRY(read_groups(r, &s));
        else if (field == 5 && type == LIST)
            KMP_TRY(read_notes(r, &s));
        else
            skip(&s, type, 0);
    return s.failed || !r->file->column || r->done != r->file->rows ? refuse_damaged(r) : KEMPE_OK;
}

static void check_sum(reader *r)
{
    kmp_parquet_file *f = r->file;
    char sum[KMP_PARQUET_SUM + 1];
    if (!r->sum || strcmp(f->note[f->note_count - 1].key, kmp_parquet_sum_key) != 0)
        return;
    /* the sum was made before its own key was complete: behind the key are a field and a length */
    const unsigned char *end = r->sum - 2;
    kmp_parquet_sum((const char *)r->bytes, (size_t)(end - r->bytes), sum);
    f->sum_holds = strcmp(sum, f->note[f->note_count - 1].value) == 0;
}

static kempe_status read_bytes(reader *r)
{
    enum { ENDS = 12, MARK = 4 };
    size_t length = 0;
    if (r->size < ENDS || memcmp(r->bytes, "PAR1", MARK) != 0 || memcmp(r->bytes + r->size - MARK, "PAR1", MARK) != 0)
        return refuse_damaged(r);
    const unsigned char *end = r->bytes + r->size - 8;
    for (int k = 0; k < 4; k++)
        length |= (size_t)end[k] << (8 * k);
    if (length > r->size - ENDS)
        return refuse_damaged(r);
    KMP_TRY(read_footer(r, (source){.at = end - length, .end = end}));
    check_sum(r);
    /* The units of columns are in notes. */
    kmp_parquet_file *f = r->file;
    for (int k = 0; k < f->note_count; k++)
        if (strncmp(f->note[k].key, "unit.", 5) == 0) {
            int column = kmp_parquet_find(f, f->note[k].key + 5);
            if (column >= 0)
                f->column[column].unit = f->note[k].value;
        }
    return KEMPE_OK;
}

kempe_status kmp_parquet_read(kempe_context *context, const char *path, kmp_parquet_file *file)
{
    reader r = {.context = context, .path = path, .file = file};
    char *text;
    KMP_TRY(kmp_file_read(context, KMP_FILE_PARQUET, path, &text, &r.size));
    r.bytes = (const unsigned char *)text;
    kempe_status status = read_bytes(&r);
    kmp_free(text);
    if (status != KEMPE_OK)
        kmp_parquet_file_free(file);
    return status;
}

void kmp_parquet_file_free(kmp_parquet_file *file)
{
    kmp_arena_free(&file->arena);
    *file = (kmp_parquet_file){0};
}

const char *kmp_parquet_value(const kmp_parquet_file *file, const char *key)
{
    for (int k = file->note_count; k-- > 0;)
        if (strcmp(file->note[k].key, key) == 0)
            return file->note[k].value;
    return "";
}

int kmp_parquet_find(const kmp_parquet_file *file, const char *name)
{
    for (int k = 0; k < file->column_count; k++)
        if (strcmp(file->column[k].name, name) == 0)
            return k;
    return -1;
}
