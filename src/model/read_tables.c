/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables: functions of one variable given by points, in the file or in columns of a CSV file beside it. */
#include "base/file.h"
#include "base/memory.h"
#include "model/named_table.h"
#include "model/reading.h"
#include <string.h>

/* The points of one table, and where each stands. */
typedef struct points {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    int count;
    double *x, *y;
    kmp_place *place;
} points;

static bool make_room(points *p, int count)
{
    p->x = KMP_ARENA_NEW(&p->r->scratch, double, count);
    p->y = KMP_ARENA_NEW(&p->r->scratch, double, count);
    p->place = KMP_ARENA_NEW(&p->r->scratch, kmp_place, count);
    return p->x && p->y && p->place;
}

/* -- points in the file -------------------------------------------------------------------------- */

static bool read_numbers(points *p, const kmp_yaml *list, const char *key, double *values)
{
    bool good = true;
    for (int i = 0; i < list->count; i++) {
        kmp_number number;
        const char *what = kmp_reader_say(p->r, "%s, %s %d,", p->what, key, i + 1);
        if (kmp_read_number(p->r, list->items[i], what, KMP_DIM_ANY, &number)) {
            values[i] = number.value;
            kmp_reader_fix(p->r, &number);
        } else {
            good = false;
        }
    }
    return good;
}

static bool read_lists(points *p)
{
    const kmp_yaml *x = kmp_read_required(p->r, p->map, p->what, "x"),
                   *y = kmp_read_required(p->r, p->map, p->what, "y");
    if (!x || !y || !kmp_read_list(p->r, x, kmp_reader_say(p->r, "x of %s", p->what), -1) ||
        !kmp_read_list(p->r, y, kmp_reader_say(p->r, "y of %s", p->what), -1))
        return false;
    if (x->count != y->count) {
        kmp_reader_complain(p->r, y->place, "%s: x has %d numbers, y has %d", p->what, x->count, y->count);
        return false;
    }
    if (!make_room(p, x->count))
        return false;
    p->count = x->count;
    for (int i = 0; i < x->count; i++)
        p->place[i] = x->items[i]->place;
    bool good = read_numbers(p, x, "x", p->x);
    return read_numbers(p, y, "y", p->y) && good;
}

/* -- points in a CSV file ------------------------------------------------------------------------ */

typedef struct sheet {
    points *p;
    const kmp_yaml *column[2]; /* the names of x and y */
    int index[2];              /* their columns */
    int file;
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
            if (strlen(wanted) == length && strncmp(field, wanted, length) == 0)
                s->index[c] = k;
        }
        good = good && s->index[c] >= 0;
        if (s->index[c] < 0)
            kmp_reader_complain_near(s->p->r, s->column[c]->place, &nearest, "%s: line %d of '%s' names no column '%s'",
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
        kmp_reader_complain(s->p->r, place, "a number is wanted here, not '%.*s'", (int)length, field);
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
    for (int line = 1; *text; line++) {
        if (!is_comment(text) && header) {
            header = false;
            if (!find_columns(s, text, line))
                return false;
        } else if (!is_comment(text)) {
            bool x = read_cell(s, text, line, s->index[0], &p->x[p->count]);
            good = read_cell(s, text, line, s->index[1], &p->y[p->count]) && x && good;
            p->place[p->count++] = (kmp_place){.line = line, .column = 1, .file = s->file};
        }
        text += strcspn(text, "\n");
        text += *text == '\n';
    }
    return good;
}

/* Beside the file that names it. */
static const char *path_beside(const points *p, const kmp_yaml *csv)
{
    const char *from = p->r->model->files[csv->place.file], *slash = strrchr(from, '/');
    if (csv->text[0] == '/' || !slash)
        return csv->text;
    return kmp_reader_say(p->r, "%.*s%s", (int)(slash - from) + 1, from, csv->text);
}

static bool read_csv(points *p)
{
    sheet s = {.p = p};
    const kmp_yaml *csv = kmp_yaml_get(p->map, "csv");
    s.column[0] = kmp_read_required(p->r, p->map, p->what, "x");
    s.column[1] = kmp_read_required(p->r, p->map, p->what, "y");
    if (!s.column[0] || !s.column[1] || !kmp_read_word(p->r, csv, p->what) ||
        !kmp_read_word(p->r, s.column[0], kmp_reader_say(p->r, "x of %s", p->what)) ||
        !kmp_read_word(p->r, s.column[1], kmp_reader_say(p->r, "y of %s", p->what)))
        return false;
    const char *path = path_beside(p, csv);
    kempe_context *aside = kempe_context_new(); /* its message becomes part of ours */
    char *text = NULL;
    size_t length;
    bool good = false;
    s.file = kmp_reader_add_file(p->r, path);
    if (aside && s.file >= 0 && kmp_file_read(aside, path, &text, &length) == KEMPE_OK)
        good = read_sheet(&s, text);
    else if (aside)
        kmp_reader_complain(p->r, csv->place, "%s: %s", p->what, kempe_context_message(aside));
    else
        p->r->scratch.failed = true;
    kmp_free(text);
    kempe_context_free(aside);
    return good;
}

/* -- tables -------------------------------------------------------------------------------------- */

static bool check_points(const points *p, kmp_place place)
{
    if (p->count < 2) {
        kmp_reader_complain(p->r, place, "%s: a table has at least two points, not %d", p->what, p->count);
        return false;
    }
    int bad = kmp_named_table_check(p->count, p->x, p->y);
    if (bad > 0)
        kmp_reader_complain(p->r, p->place[bad], "%s: x must ascend: %.9g comes after %.9g", p->what, p->x[bad],
                            p->x[bad - 1]);
    else if (bad == 0)
        kmp_reader_complain(p->r, p->place[0], "%s: the first point is not finite", p->what);
    return bad < 0;
}

static bool is_linear(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    if (!node || strcmp(node->text, "spline") == 0)
        return false;
    if (strcmp(node->text, "linear") != 0) {
        kmp_nearest nearest = kmp_nearest_begin(node->text);
        kmp_nearest_offer(&nearest, "spline");
        kmp_nearest_offer(&nearest, "linear");
        kmp_reader_complain_near(r, node->place, &nearest, "%s: the method is spline or linear, not '%s'", what,
                                 node->text);
    }
    return true;
}

static void read_table(kmp_reader *r, const kmp_yaml *map, kmp_named_table *table)
{
    static const char *const keys[] = {"x", "y", "csv", "method", NULL};
    points p = {.r = r, .map = map, .what = kmp_reader_say(r, "table '%s'", table->name)};
    if (!kmp_read_map(r, map, p.what, keys))
        return;
    bool linear = is_linear(r, kmp_yaml_get(map, "method"), p.what);
    bool good = kmp_yaml_get(map, "csv") ? read_csv(&p) : read_lists(&p);
    if (!good || !check_points(&p, map->place))
        return;
    if (!kmp_named_table_make(table, linear, p.count, p.x, p.y))
        r->scratch.failed = true;
}

static bool is_taken(const kmp_reader *r, const char *name)
{
    for (int k = 0; k < (int)KMP_FUNCTION_COUNT; k++)
        if (strcmp(kmp_function_name((kmp_function)k), name) == 0)
            return true;
    for (int k = 0; k < r->model->parameter_count; k++)
        if (strcmp(r->model->parameters[k].name, name) == 0)
            return true;
    return strcmp(name, "t") == 0 || strcmp(name, "q") == 0 || strcmp(name, "qd") == 0 || strcmp(name, "pi") == 0;
}

void kmp_read_tables(kmp_reader *r)
{
    kempe_model *model = r->model;
    const kmp_yaml *map = kmp_yaml_get(r->root, "tables");
    if (!map || !kmp_read_map(r, map, "tables", NULL))
        return;
    model->tables = KMP_ARENA_NEW(&model->arena, kmp_named_table, map->count);
    for (int i = 0; model->tables && i < map->count; i++) {
        kmp_named_table *table = &model->tables[i];
        const char *name = kmp_read_name(r, map->keys[i], "a table");
        if (name && is_taken(r, name))
            kmp_reader_complain(r, map->keys[i]->place, "a table cannot be called '%s', which has a meaning already",
                                name);
        table->name = kmp_arena_strdup(&model->arena, map->keys[i]->text);
        if (!table->name)
            return;
        model->table_count++;
        read_table(r, map->items[i], table);
    }
}
