/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of values from CSV files: a header of names, then a row an instance. */
#include "base/file.h"
#include "base/memory.h"
#include "model/variant.h"
#include "output/values.h"
#include <kempe/ensemble.h>
#include <math.h>
#include <string.h>

enum { MOST_COMPLAINTS = 20 };

typedef struct reader {
    const kempe_model *model;
    const char *path;
    int line, complaints;
    const char *line_text;
    kempe_values *values;
} reader;

/* Characters, not bytes, from the line's beginning. */
static void complain(reader *r, const char *at, const char *sentence)
{
    int column = 1;
    for (const char *s = r->line_text; s < at; s++)
        column += ((unsigned char)*s & 0xc0) != 0x80;
    if (r->complaints++ < MOST_COMPLAINTS)
        (void)kmp_complain(r->model->context, r->path, r->line, column, "%s", sentence);
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

/* Removes the field at *s from its line, without surrounding blanks; *s moves past the comma, to NULL after the last
 * one. */
static char *next_field(char **s)
{
    char *begin = *s, *end = begin + strcspn(begin, ",");
    *s = *end == ',' ? end + 1 : NULL;
    while (begin < end && is_blank(*begin))
        begin++;
    while (end > begin && is_blank(end[-1]))
        end--;
    *end = '\0';
    return begin;
}

/* false: no memory. */
static bool check_name(reader *r, const char *name, int column, char *const *names)
{
    kmp_text why = {0};
    if (!*name)
        kmp_text_put(&why, "a name is expected here: a parameter, or q.NAME or qd.NAME of a coordinate");
    else
        (void)kmp_variant_may(r->model, name, &why);
    for (int k = 0; !why.length && k < column; k++)
        if (strcmp(names[k], name) == 0)
            kmp_text_put(&why, "duplicate column");
    bool ok = !why.failed;
    if (ok && why.length)
        complain(r, name, why.s);
    kmp_text_free(&why);
    return ok;
}

/* false: no memory. */
static bool read_header(reader *r, char *line)
{
    int columns = 1, k = 0;
    for (const char *s = line; *s; s++)
        columns += *s == ',';
    char **names = KMP_NEW(char *, columns);
    bool ok = names;
    for (char *s = line; ok && s; k++) {
        names[k] = next_field(&s);
        ok = check_name(r, names[k], k, names);
    }
    if (ok)
        ok = (r->values = kmp_values_new(columns, (const char *const *)names));
    kmp_free(names);
    return ok;
}

static void read_field(reader *r, const char *field, double *value)
{
    size_t sign = *field == '-' || *field == '+', length = kmp_text_to_number(field + sign, value);
    if (length == 0 || field[sign + length] || !isfinite(*value))
        complain(r, field, "a finite number in SI units is expected here");
    else if (*field == '-')
        *value = -*value;
}

/* false: no memory. */
static bool read_row(reader *r, char *line)
{
    double *row = kmp_values_add(r->values);
    int k = 0;
    if (!row)
        return false;
    for (char *s = line; s; k++) {
        const char *field = next_field(&s);
        if (k < r->values->columns)
            read_field(r, field, &row[k]);
    }
    if (k != r->values->columns) {
        kmp_text sentence = {0};
        kmp_text_printf(&sentence, "%d field%s where the header has %d column%s", k, k == 1 ? "" : "s",
                        r->values->columns, r->values->columns == 1 ? "" : "s");
        complain(r, r->line_text, sentence.failed ? "wrong number of fields" : sentence.s);
        kmp_text_free(&sentence);
    }
    return true;
}

static bool is_passed_over(const char *line)
{
    while (is_blank(*line))
        line++;
    return *line == '#' || *line == '\0';
}

/* false: no memory. */
static bool read_lines(reader *r, char *text)
{
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0)
        text += 3; /* byte order mark */
    for (char *s = text, *line = NULL; s && r->complaints < MOST_COMPLAINTS;) {
        line = s;
        s = strchr(line, '\n');
        if (s)
            *s++ = '\0';
        r->line++;
        r->line_text = line;
        if (is_passed_over(line))
            continue;
        if (!(r->values ? read_row(r, line) : read_header(r, line)))
            return false;
    }
    r->line_text = "";
    if (!r->values)
        complain(r, r->line_text, "the header line with names of parameters is missing");
    else if (r->values->count == 0 && r->complaints == 0)
        complain(r, r->line_text, "there are no rows below the header line");
    return true;
}

kempe_status kempe_values_read(const kempe_model *model, const char *path, kempe_values **values)
{
    KMP_WANTED(NULL, model, "model");
    KMP_WANTED(model->context, path, "path");
    KMP_WANTED(model->context, values, "values");
    char *text;
    size_t length;
    kmp_context_clear(model->context);
    kempe_status status = kmp_model_check_finished(model);
    if (status == KEMPE_OK)
        status = kmp_file_read(model->context, path, &text, &length);
    if (status != KEMPE_OK)
        return status;
    reader r = {.model = model, .path = path};
    if (!read_lines(&r, text))
        status = kmp_fail_memory(model->context);
    else if (r.complaints > 0)
        status = KEMPE_E_INPUT;
    kmp_free(text);
    if (status == KEMPE_OK)
        *values = r.values;
    else
        kempe_values_free(r.values);
    return status;
}
