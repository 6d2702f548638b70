/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/flexible/modal_file.h"
#include "base/wings.h"
#include "model/flexible/npz_modes.h"
#include "model/language/dimension.h"
#include <stdarg.h>
#include <string.h>
#include <strings.h>

/* That of the library itself. */
static const kmp_modal_format arrays[] = {{".npz", "arrays of kempe-flexible-1", kmp_npz_modes_read, false, ""},
                                          {.ending = NULL}};

/* -- mistakes ---------------------------------------------------------------------------------------- */

static bool say(const kmp_modal_source *s, int line, int column, const char *format, va_list arguments)
{
    if (s->why->length > 0 || s->arena->failed)
        return false;
    s->to->line = line;
    s->to->column = column;
    kmp_text_vprintf(s->why, format, arguments);
    return false;
}

bool kmp_modal_refuse(const kmp_modal_source *s, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(s, 0, 0, format, arguments);
    va_end(arguments);
    return false;
}

bool kmp_modal_refuse_at(const kmp_modal_source *s, int line, int column, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(s, line, column, format, arguments);
    va_end(arguments);
    return false;
}

bool kmp_modal_is_text(const kmp_modal_source *s)
{
    const char *zero = memchr(s->bytes, 0, s->length);
    return !zero || kmp_modal_refuse(s, "it is not a text file: its byte %td is zero", zero - s->bytes);
}

/* -- units ------------------------------------------------------------------------------------------- */

bool kmp_modal_scaled(const kmp_modal_source *s)
{
    return s->units->length > 0 ||
           kmp_modal_refuse(s, "it does not say its units: give them by 'scale: {length: 1, mass: 1}'");
}

static void scale(double *value, ptrdiff_t count, double factor)
{
    for (ptrdiff_t k = 0; k < count && value; k++)
        value[k] *= factor;
}

/* To SI: coordinates are lengths, modes are numbers. */
void kmp_modal_convert(kmp_modal_body *b, const double unit[3])
{
    const ptrdiff_t n = b->count;
    const double length = unit[0], mass = unit[1], time = unit[2];
    b->mass *= mass;
    scale(b->moment, 3, mass * length);
    scale(b->second, 9, mass * length * length);
    scale(b->field, 3 * n, mass);
    scale(b->by_place, 9 * n, mass * length);
    scale(b->by_field, 9 * n * n, mass);
    scale(b->stiffness, n * n, mass / (time * time));
    scale(b->damping, n * n, mass / time);
    scale(b->moment_more, 3 * n * n, mass / length);
    scale(b->second_more, 9 * n * n, mass);
    scale(b->node, 3 * (ptrdiff_t)b->node_count, length);
    for (int p = 0; p < b->place_count; p++) {
        scale(b->places[p].at, 3, length);
        scale(b->places[p].turn, 3 * n, 1 / length);
        scale(b->places[p].more, 3 * n * n, 1 / length);
    }
}

/* -- formats ----------------------------------------------------------------------------------------- */

/* The formats of wing `w`, counted from 1; 0: the own one; NULL: wing w has none, or is not there (*end). */
static const kmp_modal_format *formats_of(int w, bool *end)
{
    *end = w > 0 && !kmp_wings[w - 1];
    return w == 0 ? arrays : *end ? NULL : kmp_wings[w - 1]->bodies;
}

static bool refuse_ending(const kmp_modal_source *source)
{
    kmp_text known = {0};
    bool end = false, others = false;
    for (int w = 0; !end; w++)
        for (const kmp_modal_format *f = formats_of(w, &end); f && f->ending; f++) {
            others = others || w > 0;
            if (f->read)
                kmp_text_printf(&known, "%s%s (%s)", known.length > 0 ? ", " : "", f->ending, f->what);
        }
    kmp_modal_refuse(source, "its ending is of no format that is read: %s%s", known.s ? known.s : "",
                     others ? "" : "; this build of Kempe is without KEMPE_EXCHANGE, which reads others");
    kmp_text_free_part(source->why, &known);
    return false;
}

bool kmp_modal_units_find(const char *words, double units[3])
{
    const char *at = words;
    bool good = true;
    for (int k = 0; k < 3 && good; k++) {
        static const double power[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        kmp_unit unit;
        at += strspn(at, " ");
        const size_t length = strcspn(at, " ");
        if (k == 1 && length == 1 && *at == 't') { /* a tonne, which has no word in models: there t is the time */
            units[k] = 1000;
            at += length;
            continue;
        }
        good = kmp_unit_find(at, length, &unit) && memcmp(unit.dimension.power, power[k], sizeof power[k]) == 0;
        units[k] = good ? unit.factor / unit.divisor : 1;
        at += length;
    }
    return good && !at[strspn(at, " ")];
}

static bool read_as(const kmp_modal_format *format, const kmp_modal_source *source)
{
    if (!format->read)
        return kmp_modal_refuse(source, "it is %s, which is not read: %s", format->what, format->instead);
    if (!format->beside && (source->nodes->count > 0 || source->nodes->text))
        return kmp_modal_refuse(source, "its nodes are in it: remove 'nodes'");
    return format->read(source);
}

bool kmp_modal_file_read(const char *name, const kmp_modal_source *source)
{
    const size_t length = strlen(name);
    bool end = false;
    *source->to = (kmp_modal_file){.body = {.arena = source->arena}};
    for (int w = 0; !end; w++)
        for (const kmp_modal_format *f = formats_of(w, &end); f && f->ending; f++)
            if (length > strlen(f->ending) && strcasecmp(name + length - strlen(f->ending), f->ending) == 0)
                return read_as(f, source);
    return refuse_ending(source);
}
