/* SPDX-License-Identifier: BSD-3-Clause */
/* STL (3D Systems, StereoLithography Interface Specification, 1989), as text or binary: a text begins with `solid` and
 * does not have the length that its bytes 80 to 83 would mean in a binary file. */
#include "model/data/mesh_stl.h"
#include "model/data/mesh.h"
#include "model/language/limits.h"
#include <math.h>
#include <stdint.h>
#include <string.h>
#include <strings.h>

enum { HEAD = 84, FACET = 50 };

/* -- binary ------------------------------------------------------------------------------------------ */

static uint32_t little_endian(const char *s)
{
    const unsigned char *b = (const unsigned char *)s;
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static double number_at(const char *s)
{
    uint32_t bits = little_endian(s);
    float x;
    memcpy(&x, &bits, sizeof x);
    return (double)x;
}

/* Three vertices of three numbers after the normal, which is not used. */
static bool read_facet(kmp_mesh_maker *m, const char *s, uint32_t number, kmp_text *why)
{
    int vertex[3];
    for (int k = 0; k < 3; k++) {
        double at[3];
        for (int i = 0; i < 3; i++)
            at[i] = number_at(s + 12 + 12 * k + 4 * i);
        if (!isfinite(at[0]) || !isfinite(at[1]) || !isfinite(at[2])) {
            kmp_text_printf(why, "triangle %u has a coordinate that is not finite", number + 1);
            return false;
        }
        vertex[k] = kmp_mesh_vertex(m, at);
        if (vertex[k] < 0)
            return false;
    }
    return kmp_mesh_triangle(m, vertex[0], vertex[1], vertex[2]);
}

static bool read_binary(kmp_mesh_maker *m, const char *text, size_t length, kmp_text *why)
{
    uint32_t count = length >= HEAD ? little_endian(text + 80) : 0;
    if (length < HEAD || length < HEAD + (size_t)count * FACET) {
        kmp_text_printf(
            why, "it is no text that begins with 'solid', and for a binary file of %u triangle%s it is too short",
            count, count == 1 ? "" : "s");
        return false;
    }
    if (count > KMP_MOST_TRIANGLES) {
        kmp_text_printf(why, "it has %u triangles: at most %d are possible", count, KMP_MOST_TRIANGLES);
        return false;
    }
    for (uint32_t k = 0; k < count; k++)
        if (!read_facet(m, text + HEAD + (size_t)k * FACET, k, why))
            return false;
    return true;
}

/* -- text -------------------------------------------------------------------------------------------- */

static bool is_word(const char *word, size_t length, const char *wanted)
{
    return strlen(wanted) == length && strncasecmp(word, wanted, length) == 0;
}

static bool expect(kmp_token_reader *words, const char *wanted, kmp_text *why)
{
    const char *word;
    size_t length = kmp_token_next(words, true, &word);
    if (is_word(word, length, wanted))
        return true;
    if (length == 0)
        kmp_text_printf(why, "line %d: '%s' is expected, but the file ends", words->line, wanted);
    else
        kmp_text_printf(why, "line %d: '%s' is expected, not '%.*s'", words->line, wanted,
                        length > 40 ? 40 : (int)length, word);
    return false;
}

static bool read_three(kmp_token_reader *words, double at[3], kmp_text *why)
{
    return kmp_token_number(words, true, &at[0], why) && kmp_token_number(words, true, &at[1], why) &&
           kmp_token_number(words, true, &at[2], why);
}

/* From the word after `facet` on. The normal may be anything: many programs write nan. */
static bool read_written_facet(kmp_mesh_maker *m, kmp_token_reader *words, kmp_text *why)
{
    int vertex[3];
    double at[3];
    const char *word;
    bool good = expect(words, "normal", why);
    for (int k = 0; k < 3; k++)
        (void)kmp_token_next(words, true, &word);
    good = good && expect(words, "outer", why) && expect(words, "loop", why);
    for (int k = 0; k < 3 && good; k++) {
        good = expect(words, "vertex", why) && read_three(words, at, why);
        vertex[k] = good ? kmp_mesh_vertex(m, at) : -1;
        good = vertex[k] >= 0;
    }
    return good && expect(words, "endloop", why) && expect(words, "endfacet", why) &&
           kmp_mesh_triangle(m, vertex[0], vertex[1], vertex[2]);
}

static bool read_written(kmp_mesh_maker *m, const char *text, kmp_text *why)
{
    kmp_token_reader words = {text, 1};
    const char *word;
    size_t length;
    bool open = false;
    while ((length = kmp_token_next(&words, true, &word)) > 0) {
        bool begins = is_word(word, length, "solid"), ends = is_word(word, length, "endsolid");
        if (begins || ends) {
            open = begins;
            words.s += strcspn(words.s, "\n"); /* its name */
        } else if (!open || !is_word(word, length, "facet")) {
            kmp_text_printf(why, "line %d: '%s' is expected, not '%.*s'", words.line, open ? "facet" : "solid",
                            length > 40 ? 40 : (int)length, word);
            return false;
        } else if (!read_written_facet(m, &words, why)) {
            return false;
        }
    }
    if (open)
        kmp_text_printf(why, "line %d: 'endsolid' is expected, but the file ends", words.line);
    return !open;
}

bool kmp_stl_read(kmp_mesh_maker *m, const char *text, size_t length, kmp_text *why)
{
    bool solid = strncasecmp(text + strspn(text, " \t\r\n"), "solid", 5) == 0;
    bool exact = length >= HEAD && length == HEAD + (size_t)little_endian(text + 80) * FACET;
    return solid && !exact ? read_written(m, text, why) : read_binary(m, text, length, why);
}
