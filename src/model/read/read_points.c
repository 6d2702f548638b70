/* SPDX-License-Identifier: BSD-3-Clause */
/* Points of a curve: two lists in the file, or two columns of a CSV file in its folder. */
#include "model/read/read_points.h"
#include "base/file.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/read/files.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <string.h>

typedef kmp_points points;

static bool make_room(points *p, int count)
{
    KMP_ARENA_MAKE(&p->r->scratch, KMP_ROOM(double, count, &p->x, &p->y), KMP_ROOM(kmp_place, count, &p->place));
    return p->x && p->y && p->place;
}

/* -- points in the file -------------------------------------------------------------------------- */

static bool read_numbers(points *p, const kmp_yaml *list, const char *key, double *values)
{
    bool good = true;
    for (int i = 0; i < list->count; i++) {
        const char *what = kmp_reader_say(p->r, "%s, %s %d,", p->what, key, i + 1);
        good = kmp_read_fixed(p->r, list->items[i], what, p->dimension, &values[i]) && good;
    }
    return good;
}

static bool read_lists(points *p)
{
    const kmp_yaml *x = kmp_read_required(p->r, p->map, p->what, p->key[0]),
                   *y = kmp_read_required(p->r, p->map, p->what, p->key[1]);
    if (!x || !y || !kmp_read_list(p->r, x, kmp_reader_say(p->r, "%s of %s", p->key[0], p->what), -1) ||
        !kmp_read_list(p->r, y, kmp_reader_say(p->r, "%s of %s", p->key[1], p->what), -1))
        return false;
    if (x->count != y->count)
        return kmp_reader_complain(p->r, y->place, "%s: %s has %d numbers, %s has %d", p->what, p->key[0], x->count,
                                   p->key[1], y->count);
    if (!make_room(p, x->count))
        return false;
    p->count = x->count;
    for (int i = 0; i < x->count; i++)
        p->place[i] = x->items[i]->place;
    bool good = read_numbers(p, x, p->key[0], p->x);
    return read_numbers(p, y, p->key[1], p->y) && good;
}

/* -- points in a CSV file ------------------------------------------------------------------------ */

typedef struct sheet {
    points *p;
    const kmp_yaml *column[2]; /* the names of both */
    int index[2];              /* their columns */
    int file;
    int width; /* columns of the header */
} sheet;

/* The k-th field of a line, without spaces around it; NULL when there are fewer. */
static const char *field_of(const char *line, int k, size_t *length)
{
    for (; k > 0; k--) {
        line += strcspn(line, ",\n");
        if (*line != ',')
            return NULL;
        line++;
    }
    line += strspn(line, " \t\"");
    *length = strcspn(line, ",\n");
    while (*length > 0 && strchr(" \t\r\"", line[*length - 1]))
        --*length;
    return line;
}

static bool is_comment(const char *line)
{
    line += strspn(line, " \t\r");
    return *line == '#' || *line == '\n' || *line == '\0';
}

static int count_fields(const char *line)
{
    int count = 1;
    for (; *line && *line != '\n'; line++)
        count += *line == ',';
    return count;
}

/* Cells beyond the header shift a column, as decimal commas do. */
static bool check_width(sheet *s, const char *line, int number)
{
    int count = count_fields(line);
    kmp_place place = {.line = number, .column = 1, .file = s->file};
    return count <= s->width || kmp_reader_complain(s->p->r, place, "%d cells where the header has %d column%s", count,
                                                    s->width, s->width == 1 ? "" : "s");
}

static bool find_columns(sheet *s, const char *header, int line)
{
    bool good = true;
    for (int c = 0; c < 2; c++) {
        const char *field, *wanted = s->column[c]->text;
        size_t length = 0;
        kmp_nearest nearest = kmp_nearest_begin(wanted);
        s->index[c] = -1;
        for (int k = 0; (field = field_of(header, k, &length)); k++) {
            kmp_nearest_offer(&nearest, kmp_reader_say(s->p->r, "%.*s", (int)length, field));
            if (strlen(wanted) != length || strncmp(field, wanted, length) != 0)
                continue;
            if (s->index[c] >= 0)
                good = kmp_reader_complain(s->p->r, s->column[c]->place, "%s: line %d of '%s' has two columns '%s'",
                                           s->p->what, line, s->p->r->model->files[s->file], wanted);
            s->index[c] = k;
        }
        good = good && s->index[c] >= 0;
        if (s->index[c] < 0)
            kmp_reader_complain_near(s->p->r, s->column[c]->place, &nearest, "%s: line %d of '%s' has no column '%s'",
                                     s->p->what, line, s->p->r->model->files[s->file], wanted);
    }
    return good;
}

static bool read_cell(sheet *s, const char *line, int number, int column, double *value)
{
    size_t length = 0;
    const char *field = field_of(line, column, &length);
    kmp_place place = {.line = number, .column = field ? (int)(field - line) + 1 : 1, .file = s->file};
    bool negative = field && length > 0 && *field == '-';
    size_t sign = field && length > 0 && (*field == '-' || *field == '+');
    size_t taken = field ? kmp_text_to_number(field + sign, value) : 0;
    if (field && taken > 0 && taken + sign == length) {
        *value = negative ? -*value : *value;
        return true;
    }
    if (field)
        kmp_reader_complain(s->p->r, place, "a number is expected here, not '%.*s'", (int)length, field);
    else
        kmp_reader_complain(s->p->r, place, "column %d is missing in this line", column + 1);
    return false;
}

static int count_lines(const char *text)
{
    int n = 1;
    for (; *text; text++)
        n += *text == '\n';
    return n;
}

static bool read_sheet(sheet *s, const char *text)
{
    points *p = s->p;
    bool header = true, good = true;
    if (!make_room(p, count_lines(text)))
        return false;
    text += strncmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0; /* the mark of UTF-8 */
    for (int line = 1; *text; line++) {
        if (!is_comment(text) && header) {
            header = false;
            s->width = count_fields(text);
            if (!find_columns(s, text, line))
                return false;
        } else if (!is_comment(text)) {
            good = check_width(s, text, line) && good;
            bool x = read_cell(s, text, line, s->index[0], &p->x[p->count]);
            good = read_cell(s, text, line, s->index[1], &p->y[p->count]) && x && good;
            p->place[p->count++] = (kmp_place){.line = line, .column = 1, .file = s->file};
        }
        text += strcspn(text, "\n");
        text += *text == '\n';
    }
    return good;
}

const char *kmp_path_beside(kmp_reader *r, int file, const char *name)
{
    const char *from = r->model->files[file], *slash = strrchr(from, '/');
    return name[0] == '/' || !slash ? name : kmp_reader_say(r, "%.*s%s", (int)(slash - from) + 1, from, name);
}

char *kmp_read_file(kmp_reader *r, kmp_file_kind kind, const kmp_yaml *node, const char *what, const char *path,
                    size_t *length)
{
    kempe_context *aside = kempe_context_new(); /* its message becomes part of the reader's */
    char *text = NULL;
    kempe_status status = aside ? kmp_file_read(aside, kind, path, &text, length) : KEMPE_E_MEMORY;
    if (status == KEMPE_E_MEMORY)
        r->scratch.failed = true;
    else if (status != KEMPE_OK)
        kmp_reader_complain(r, node->place, "%s: %s", what, kempe_context_message(aside));
    kempe_context_free(aside);
    if (text)
        kmp_reader_digest(r, path, text, *length);
    return text;
}

static bool read_csv(points *p)
{
    sheet s = {.p = p};
    const kmp_yaml *csv = kmp_yaml_get(p->map, "csv");
    size_t length;
    bool good = true;
    for (int k = 0; k < 2; k++)
        good = (s.column[k] = kmp_read_required(p->r, p->map, p->what, p->key[k])) && good;
    good = good && kmp_read_word(p->r, csv, p->what);
    for (int k = 0; k < 2 && good; k++)
        good = kmp_read_word(p->r, s.column[k], kmp_reader_say(p->r, "%s of %s", p->key[k], p->what));
    if (!good)
        return false;
    const char *path = kmp_path_beside(p->r, csv->place.file, csv->text);
    s.file = kmp_reader_add_file(p->r, path);
    char *text = s.file < 0 ? NULL : kmp_read_file(p->r, KMP_FILE_POINTS, csv, p->what, path, &length);
    good = text && read_sheet(&s, text);
    kmp_free(text);
    return good;
}

void kmp_points_reverse(kmp_points *p)
{
    for (int i = 0, k = p->count - 1; i < k; i++, k--) {
        double x = p->x[i], y = p->y[i];
        kmp_place place = p->place[i];
        p->x[i] = p->x[k];
        p->y[i] = p->y[k];
        p->place[i] = p->place[k];
        p->x[k] = x;
        p->y[k] = y;
        p->place[k] = place;
    }
}

bool kmp_read_column_unit(const kmp_points *p, kmp_dimension dimension, const char *so, kmp_unit *unit)
{
    kmp_reader *r = p->r;
    const kmp_yaml *node = kmp_yaml_get(p->map, "unit");
    *unit = (kmp_unit){1, 1, dimension, 0};
    if (!node)
        return true;
    const char *word = kmp_read_word(r, node, kmp_reader_say(r, "unit of %s", p->what));
    if (word && !kmp_yaml_get(p->map, "csv"))
        return kmp_reader_complain(
            r, node->place,
            "%s: a unit applies to the columns of a CSV file; numbers of the model file have their own units", p->what);
    if (word && (!kmp_unit_find(word, strlen(word), unit) || !kmp_dimension_fits(unit->dimension, dimension)))
        return kmp_reader_complain(r, node->place, "%s: the unit must be %s, not '%s'", p->what, so, word);
    return word;
}

bool kmp_read_points(kmp_points *p)
{
    return kmp_yaml_get(p->map, "csv") ? read_csv(p) : read_lists(p);
}
