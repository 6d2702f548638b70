/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/files/csv_reader.h"
#include "base/file.h"
#include "base/memory.h"
#include "model/language/dimension.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_COMPLAINTS = 20 };

bool kmp_csv_goes_on(const kmp_csv *csv)
{
    return csv->complaints < MOST_COMPLAINTS;
}

/* Columns are characters, not bytes, from the line's beginning. */
void kmp_csv_complain(kmp_csv *csv, const char *at, const char *format, ...)
{
    int column = 1;
    kmp_text sentence = {0};
    if (csv->complaints++ >= MOST_COMPLAINTS)
        return;
    KMP_TEXT_ARGUMENTS(&sentence, format);
    for (const char *s = csv->line_text; s < at; s++)
        column += ((unsigned char)*s & 0xc0) != 0x80;
    (void)kmp_complain(csv->context, csv->path, csv->line, column, "%s",
                       sentence.failed ? "an error is here" : sentence.s);
    kmp_text_free(&sentence);
}

/* -- fields ------------------------------------------------------------------------------------------ */

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

int kmp_csv_count(const char *line)
{
    int count = 1;
    for (const char *s = line; *s; s++)
        count += *s == ',';
    return count;
}

kmp_csv_field kmp_csv_next(const char **s)
{
    size_t length = strcspn(*s, ",");
    kmp_csv_field f = {*s, length};
    *s = (*s)[length] == ',' ? *s + length + 1 : NULL;
    while (f.length > 0 && is_blank(f.s[0])) {
        f.s++;
        f.length--;
    }
    while (f.length > 0 && is_blank(f.s[f.length - 1]))
        f.length--;
    if (f.length > 1 && f.s[0] == '"' && f.s[f.length - 1] == '"') {
        f.s++;
        f.length -= 2;
    }
    return f;
}

/* "q.crank [deg]": *unit is deg, and empty where there is none. */
static kmp_csv_field split_unit(kmp_csv_field f, kmp_csv_field *unit)
{
    size_t name = 0;
    while (name < f.length && f.s[name] != '[')
        name++;
    *unit = (kmp_csv_field){f.s + name, 0};
    if (name == f.length || f.s[f.length - 1] != ']')
        return f;
    *unit = (kmp_csv_field){f.s + name + 1, f.length - name - 2};
    while (name > 0 && is_blank(f.s[name - 1]))
        name--;
    return (kmp_csv_field){f.s, name};
}

kmp_csv_field kmp_csv_name(const char **s)
{
    kmp_csv_field unit;
    return split_unit(kmp_csv_next(s), &unit);
}

bool kmp_csv_is(kmp_csv_field field, const char *word)
{
    return strlen(word) == field.length && memcmp(field.s, word, field.length) == 0;
}

bool kmp_csv_number(const kmp_csv *csv, int column, kmp_csv_field field, double *value)
{
    size_t sign = field.length > 0 && (field.s[0] == '-' || field.s[0] == '+');
    size_t read = kmp_text_to_number(field.s + sign, value);
    if (field.length > 0 && field.s[0] == '-')
        *value = -*value;
    if (column < csv->columns)
        *value = *value * csv->unit[column].factor / csv->unit[column].divisor;
    return read > 0 && sign + read == field.length && isfinite(*value);
}

void kmp_csv_check_row(kmp_csv *csv, const char *line)
{
    int count = kmp_csv_count(line);
    if (count != csv->columns)
        kmp_csv_complain(csv, line, "%d field%s where the header has %d column%s", count, count == 1 ? "" : "s",
                         csv->columns, csv->columns == 1 ? "" : "s");
}

/* -- units ------------------------------------------------------------------------------------------- */

/* "# units: s,rad,N m"; *rest: after the colon. */
static bool is_units(const char *line, const char **rest)
{
    static const char word[] = "units:";
    line += strspn(line, " \t#");
    *rest = line + sizeof word - 1;
    return strncmp(line, word, sizeof word - 1) == 0;
}

static kmp_csv_field next_or_empty(const char **s)
{
    return *s ? kmp_csv_next(s) : (kmp_csv_field){"", 0};
}

static void complain_unit(kmp_csv *csv, const char *at, int column, kmp_csv_field unit)
{
    kmp_csv_complain(csv, at, "column %d: unknown unit '%.*s'", column + 1, (int)unit.length, unit.s);
}

/* Reads the units of the columns, before the header is handed on. False: no memory. */
static bool read_units(kmp_csv *csv, const char *header)
{
    const char *s = csv->units;
    csv->unit = KMP_ARENA_NEW(&csv->arena, kmp_unit, csv->columns);
    if (!csv->unit)
        return false;
    for (int k = 0; k < csv->columns; k++) {
        kmp_csv_field own, f = next_or_empty(&s);
        (void)split_unit(next_or_empty(&header), &own);
        f = own.length > 0 ? own : f;
        f.length = kmp_csv_is(f, "SI") ? 0 : f.length; /* of an unknown unit */
        csv->unit[k] = (kmp_unit){1, 1, KMP_DIM_ANY, 0};
        if (f.length == 0 || kmp_unit_read(f.s, f.length, &csv->unit[k]))
            continue;
        csv->unit[k].divisor = 0;
        if (!csv->form->foreign)
            complain_unit(csv, csv->line_text, k, f);
    }
    return true;
}

bool kmp_csv_has_unit(kmp_csv *csv, int column, const char *at, bool *given)
{
    const kmp_unit *unit = &csv->unit[column];
    *given = unit->dimension.kind != KMP_DIMENSION_FREE;
    if (unit->divisor != 0)
        return true;
    kmp_csv_field own = {at, strlen(at)};
    (void)split_unit(kmp_csv_next(&at), &own);
    complain_unit(csv, own.s, column, own);
    return false;
}

void kmp_csv_check_unit(kmp_csv *csv, int column, const char *at, const char *si)
{
    kmp_unit wanted;
    if (column < csv->columns && kmp_unit_read(si, strlen(si), &wanted) &&
        !kmp_dimension_fits(csv->unit[column].dimension, wanted.dimension))
        kmp_csv_complain(csv, at, "the unit of this column does not fit: %s is expected", si);
}

/* -- lines ------------------------------------------------------------------------------------------- */

static int compare_names(const void *a, const void *b)
{
    const kmp_csv_field *x = a, *y = b;
    int order = x->length == y->length ? memcmp(x->s, y->s, x->length) : x->length < y->length ? -1 : 1;
    return order != 0 ? order : x->s < y->s ? -1 : x->s > y->s;
}

/* Names of columns differ. False: no memory. */
static bool check_names(kmp_csv *csv, const char *header)
{
    kmp_csv_field *names = KMP_ARENA_NEW(&csv->arena, kmp_csv_field, csv->columns);
    int count = 0;
    if (csv->form->foreign)
        return names;
    for (const char *s = header; names && s;)
        names[count++] = kmp_csv_name(&s);
    if (names)
        qsort(names, (size_t)count, sizeof *names, compare_names);
    for (int k = 1; k < count && kmp_csv_goes_on(csv); k++)
        if (names[k].length > 0 && names[k - 1].length == names[k].length &&
            memcmp(names[k - 1].s, names[k].s, names[k].length) == 0)
            kmp_csv_complain(csv, names[k].s, "duplicate column '%.*s'", (int)names[k].length, names[k].s);
    return names;
}

/* Rows are read only under a header without errors. False: no memory. */
static bool read_lines(kmp_csv *csv, char *text, size_t length)
{
    const bool binary = memchr(text, '\0', length) != NULL;
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0)
        text += 3; /* byte order mark */
    for (char *s = text, *line = s; s && kmp_csv_goes_on(csv); line = s) {
        s = strchr(line, '\n');
        if (s)
            *s++ = '\0';
        csv->line++;
        csv->line_text = line;
        const char *units;
        bool header = csv->columns == 0;
        if (header && is_units(line, &units))
            csv->units = units;
        const char *first = line;
        while (is_blank(*first))
            first++;
        if (*first == '#' || *first == '\0')
            continue;
        if (header && kmp_csv_count(line) == 1 && strpbrk(first, ";\t")) {
            kmp_csv_complain(csv, strpbrk(first, ";\t"),
                             "%s stands between the columns: a comma is expected there, and a point in numbers",
                             strpbrk(first, ";\t")[0] == ';' ? "a semicolon" : "a tab");
            csv->columns = 1;
            return true;
        }
        if (header) {
            csv->columns = kmp_csv_count(line);
            if (!check_names(csv, line) || !read_units(csv, line) || !csv->form->header(csv, line))
                return false;
            if (csv->complaints > 0)
                return true;
        } else if (csv->rows++, !csv->form->row(csv, line)) {
            return false;
        }
    }
    if (binary)
        kmp_csv_complain(csv, csv->line_text + strlen(csv->line_text),
                         "a character of code 0 is here, which no text has; write the file as UTF-8");
    csv->line_text = "";
    if (csv->columns == 0)
        kmp_csv_complain(csv, csv->line_text, "%s", csv->form->lacks_header);
    else if (csv->rows == 0 && csv->form->lacks_rows && csv->complaints == 0)
        kmp_csv_complain(csv, csv->line_text, "%s", csv->form->lacks_rows);
    return true;
}

kempe_status kmp_csv_read_text(kempe_context *context, const char *path, char *text, size_t length,
                               const kmp_csv_form *form, void *user)
{
    kmp_csv csv = {.context = context, .path = path, .form = form, .user = user};
    const bool ok = read_lines(&csv, text, length);
    kmp_arena_free(&csv.arena);
    return !ok ? kmp_fail_memory(context) : csv.complaints > 0 ? KEMPE_E_INPUT : KEMPE_OK;
}

kempe_status kmp_csv_read(kempe_context *context, const char *path, const kmp_csv_form *form, void *user)
{
    char *text;
    size_t length;
    KMP_TRY(kmp_file_read(context, KMP_FILE_TABLE, path, &text, &length));
    const kempe_status status = kmp_csv_read_text(context, path, text, length, form, user);
    kmp_free(text);
    return status;
}
