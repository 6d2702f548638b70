/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables: functions of one variable by points, in the file or in columns of a CSV file in its folder, and of two
 * variables by a grid of points. */
#include "model/read/read_tables.h"
#include "base/file.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/files/csv_reader.h"
#include "model/files/element_library.h"
#include "model/language/expression.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include "platform/platform.h"
#include "symbolic/table_function.h"
#include <math.h>
#include <string.h>

/* -- points of a curve ------------------------------------------------------------------------------- */

/* Points of a curve: two lists in the file, or two columns of a CSV file in its folder. */

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
        const char *what = kmp_reader_say(p->r, "%s %d of %s", key, i + 1, p->what);
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
        return KMP_COMPLAIN(p, y, "%s has %d numbers, %s has %d", p->key[0], x->count, p->key[1], y->count);
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
    int index[2];              /* their columns; -1: there is none */
    int file;
} sheet;

/* Finds a column by its name, with or without its unit. False: no memory. */
static bool find_column(kmp_csv *csv, sheet *s, int c, const char *header)
{
    kmp_reader *r = s->p->r;
    const char *wanted = s->column[c]->text, *file = r->model->source.files[s->file];
    kmp_nearest nearest = kmp_nearest_begin(wanted);
    kmp_text names = {0};
    s->index[c] = -1;
    for (int k = 0; header; k++) {
        const char *at = header, *again = header;
        const kmp_csv_field whole = kmp_csv_next(&header), name = kmp_csv_name(&again);
        kmp_nearest_offer(&nearest, kmp_reader_say(r, "%.*s", (int)name.length, name.s));
        kmp_text_printf(&names, "%s%.*s", k > 0 ? ", " : "", (int)name.length, name.s);
        if (!kmp_csv_is(name, wanted) && !kmp_csv_is(whole, wanted))
            continue;
        if (s->index[c] >= 0)
            kmp_reader_complain(r, s->column[c]->place, "%s: line %d of '%s' has two columns '%s'", s->p->what,
                                csv->line, file, wanted);
        else if (!kmp_csv_has_unit(csv, k, at, &s->p->has_unit[c]))
            r->wrong = true;
        s->index[c] = k;
        s->p->unit[c] = csv->unit[k];
    }
    if (s->index[c] < 0 && nearest.best)
        kmp_reader_complain_near(r, s->column[c]->place, &nearest, "%s: line %d of '%s' has no column '%s'", s->p->what,
                                 csv->line, file, wanted);
    else if (s->index[c] < 0)
        kmp_reader_complain(r, s->column[c]->place, "%s: line %d of '%s' has no column '%s': its columns are %s",
                            s->p->what, csv->line, file, wanted, names.s ? names.s : "none");
    const bool good = !names.failed;
    kmp_text_free(&names);
    return good;
}

static bool take_header(kmp_csv *csv, const char *line)
{
    sheet *s = csv->user;
    return find_column(csv, s, 0, line) && find_column(csv, s, 1, line);
}

static bool take_row(kmp_csv *csv, const char *line)
{
    sheet *s = csv->user;
    points *p = s->p;
    double value[2] = {0, 0};
    const int cells = kmp_csv_count(line);
    if (s->index[0] < 0 || s->index[1] < 0)
        return true;
    /* Cells beyond the header shift a column, as decimal commas do. */
    if (cells > csv->columns)
        kmp_csv_complain(csv, line, "%d cells where the header has %d column%s", cells, csv->columns,
                         csv->columns == 1 ? "" : "s");
    for (int c = 0; c < 2; c++) {
        const char *rest = line;
        kmp_csv_field field = {line, 0};
        for (int k = 0; k <= s->index[c] && rest; k++)
            field = kmp_csv_next(&rest);
        if (s->index[c] >= cells)
            kmp_csv_complain(csv, line, "column %d is missing in this line", s->index[c] + 1);
        else if (!kmp_csv_number(csv, s->index[c], field, &value[c]))
            kmp_csv_complain(csv, field.s, "a number is expected here, not '%.*s'", (int)field.length, field.s);
    }
    p->x[p->count] = value[0];
    p->y[p->count] = value[1];
    p->place[p->count++] = (kmp_place){.line = csv->line, .column = 1, .file = s->file};
    return true;
}

static bool read_sheet(sheet *s, const char *path, char *text, size_t length)
{
    static const kmp_csv_form form = {"the header line is missing; it has the names of the columns", NULL, take_header,
                                      take_row, .foreign = true};
    kmp_reader *r = s->p->r;
    int lines = 1;
    for (const char *at = text; *at; at++)
        lines += *at == '\n';
    if (!make_room(s->p, lines))
        return false;
    const kempe_status status = kmp_csv_read_text(r->context, path, text, length, &form, s);
    r->wrong = r->wrong || status != KEMPE_OK;
    r->scratch.failed = r->scratch.failed || status == KEMPE_E_MEMORY;
    return status == KEMPE_OK && s->index[0] >= 0 && s->index[1] >= 0;
}

const char *kmp_path_beside(kmp_reader *r, int file, const char *name)
{
    const char *from = r->model->source.files[file];
    const size_t folder = kmp_path_folder(from);
    return kmp_path_is_whole(name) || folder == 0 ? name : kmp_reader_say(r, "%.*s%s", (int)folder, from, name);
}

char *kmp_read_file(kmp_reader *r, kmp_file_kind kind, const kmp_yaml *node, const char *what, const char *path,
                    size_t *length)
{
    kempe_context *aside = kmp_context_new_below(r->model->context); /* its message becomes part of the reader's */
    char *text = NULL;
    kempe_status status = !aside                 ? KEMPE_E_MEMORY
                          : kmp_is_element(path) ? kmp_element_read(aside, path, &text, length)
                                                 : kmp_file_read(aside, kind, path, &text, length);
    if (status == KEMPE_E_MEMORY)
        r->scratch.failed = true;
    else if (status != KEMPE_OK)
        kmp_complain_of(r, node, what, "%s", kempe_context_message(aside));
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
    good = text && read_sheet(&s, path, text, length);
    kmp_free(text);
    return good;
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
        return kmp_complain_of(
            r, node, p->what,
            "a unit applies to the columns of a CSV file; numbers of the model file have their own units");
    if (word && (!kmp_unit_read(word, strlen(word), unit) || !kmp_dimension_fits(unit->dimension, dimension)))
        return kmp_complain_of(r, node, p->what, "the unit must be %s, not '%s'", so, word);
    return word;
}

bool kmp_read_points(kmp_points *p)
{
    return kmp_yaml_get(p->map, "csv") ? read_csv(p) : read_lists(p);
}

bool kmp_points_increase(const kmp_points *p, const char *places, const char *one)
{
    int bad = kmp_table_check(p->count, p->x, p->y);
    if (bad > 0)
        kmp_reader_complain(p->r, p->place[bad], "%s: %s must increase: %.9g comes after %.9g", p->what, places,
                            p->x[bad], p->x[bad - 1]);
    else if (bad == 0)
        kmp_reader_complain(p->r, p->place[0], "%s: the first %s is not finite", p->what, one);
    return bad < 0;
}

/* Part of the range of a table by which its spline may pass the points of a piece without a word. */
#define OVERSHOOT 0.02

/* -- one variable ------------------------------------------------------------------------------------ */

static double height_of(const kmp_table *t)
{
    double low = t->y[0], high = t->y[0];
    for (int k = 1; k < t->count; k++) {
        low = fmin(low, t->y[k]);
        high = fmax(high, t->y[k]);
    }
    return high - low;
}

/* The first and the last point of a periodic table are one, but for its rise. */
static void check_period(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_named_table *table)
{
    const kmp_yaml *node = kmp_yaml_get(map, "periodic"), *outside = kmp_yaml_get(map, "outside");
    const kmp_table *t = table->table;
    const double rise = t->y[t->count - 1] - t->y[0];
    if (outside)
        kmp_complain_of(r, outside, what, "a periodic table has no points outside");
    if (fabs(rise - table->rise) > 1e-9 * height_of(t))
        kmp_complain_of(r, node, what, "the last value of a periodic table is the first one%s; they are %.9g and %.9g",
                        table->rise != 0 ? " and its rise" : "", t->y[t->count - 1], t->y[0]);
}

/* `periodic: yes`, or the rise of each period. */
static void read_period(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_named_table *table)
{
    const kmp_yaml *node = kmp_yaml_get(map, "periodic");
    table->periodic = node && !kmp_is_word(node, "no");
    if (table->periodic && !kmp_is_word(node, "yes"))
        (void)kmp_read_fixed(r, node, kmp_reader_say(r, "periodic of %s", what), KMP_DIM_ANY, &table->rise);
}

/* True if the points have an extreme value at an end of piece k, which a curve may pass beyond the piece's points. */
static bool is_at_turn(const kmp_table *t, int k)
{
    double rise = t->y[k + 1] - t->y[k];
    return (k > 0 && (t->y[k] - t->y[k - 1]) * rise < 0) ||
           (k + 2 < t->count && (t->y[k + 2] - t->y[k + 1]) * rise < 0);
}

/* Names the piece where a spline goes farthest beyond its points although they rise or fall there. */
static void note_overshoot(kmp_reader *r, const kmp_yaml *map, const char *what, const kmp_table *t)
{
    enum { PIECES = 16 };
    double most = 0, value = 0;
    int at = -1;
    for (int k = 0; k + 1 < t->count; k++)
        for (int i = 1; i < PIECES && !is_at_turn(t, k); i++) {
            double y = kmp_table_value(t, 0, t->x[k] + (t->x[k + 1] - t->x[k]) * i / PIECES);
            double beyond = fmax(y - fmax(t->y[k], t->y[k + 1]), fmin(t->y[k], t->y[k + 1]) - y);
            if (beyond > most) {
                most = beyond;
                value = y;
                at = k;
            }
        }
    if (at >= 0 && most > OVERSHOOT * height_of(t))
        kmp_reader_warn(r, map->place,
                        "%s: its spline reaches %.6g between x = %.6g and %.6g, where the points have %.6g and %.6g: "
                        "method: monotone keeps their shape",
                        what, value, t->x[at], t->x[at + 1], t->y[at], t->y[at + 1]);
}

/* -- two variables --------------------------------------------------------------------------------- */

/* A list of numbers in ascending order, the knots of a variable. */
static double *read_knots(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key, int *count)
{
    const kmp_yaml *list = kmp_read_required(r, map, what, key);
    const char *of = kmp_reader_say(r, "%s of %s", key, what);
    if (!list || !kmp_read_list(r, list, of, -1))
        return NULL;
    double *knots = KMP_ARENA_NEW(&r->scratch, double, list->count);
    bool good = knots;
    for (int k = 0; good && k < list->count; k++)
        good = kmp_read_fixed(r, list->items[k], of, KMP_DIM_ANY, &knots[k]);
    if (!good)
        return NULL;
    *count = list->count;
    int bad = kmp_table_check(list->count, knots, knots);
    if (list->count < 2)
        kmp_reader_complain(r, list->place, "%s: a table needs at least two points, not %d", of, list->count);
    else if (bad >= 0)
        kmp_reader_complain(r, list->items[bad]->place, "%s: the numbers must increase: %.9g comes after %.9g", of,
                            knots[bad], knots[bad > 0 ? bad - 1 : 0]);
    return list->count < 2 || bad >= 0 ? NULL : knots;
}

static bool read_rows(kmp_reader *r, const kmp_yaml *z, const char *what, const int count[2], double *values)
{
    bool good = kmp_read_list(r, z, kmp_reader_say(r, "z of %s", what), count[0]);
    for (int i = 0; good && i < count[0]; i++) {
        const char *row = kmp_reader_say(r, "row %d of z of %s", i + 1, what);
        good = kmp_read_list(r, z->items[i], row, count[1]);
        for (int j = 0; good && j < count[1]; j++)
            good = kmp_read_fixed(r, z->items[i]->items[j], row, KMP_DIM_ANY, &values[i * count[1] + j]);
    }
    return good;
}

/* A table of two variables is a sum over the knots of one of them. */
static void read_surface(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_table_method method,
                         kmp_named_table *table)
{
    enum { MOST_TERMS = 64 };
    int count[2];
    const kmp_yaml *z = kmp_yaml_get(map, "z");
    double *x = read_knots(r, map, what, "x", &count[0]), *y = read_knots(r, map, what, "y", &count[1]);
    if (kmp_yaml_get(map, "csv"))
        kmp_complain_of(r, map, what, "a table of two variables is given by lists, not by a file");
    if (!x || !y)
        return;
    if (count[0] > MOST_TERMS && count[1] > MOST_TERMS) {
        kmp_complain_of(r, z, what, "x has %d numbers and y %d: one of them may have %d at most", count[0], count[1],
                        MOST_TERMS);
        return;
    }
    double *values = KMP_ARENA_NEW(&r->scratch, double, count[0] * count[1]);
    if (!values || !read_rows(r, z, what, count, values))
        return;
    table->surface = kmp_surface_new(method, count, x, y, values);
    if (!table->surface)
        r->scratch.failed = true;
}

static void read_table(kmp_reader *r, const kmp_yaml *map, kmp_named_table *table)
{
    static const kmp_key keys[] = {
#include "model/keys/table_keys.def"
        {0}};
    kmp_points p = {.r = r,
                    .map = map,
                    .what = kmp_reader_say(r, "table '%s'", table->name),
                    .key = {"x", "y"},
                    .dimension = KMP_DIM_ANY};
    if (!kmp_read_map(r, map, p.what, keys))
        return;
    table->of_two = map->kind == KMP_YAML_MAP && kmp_yaml_get(map, "z");
    read_period(r, map, p.what, table);
    static const char *const words[] = {"linear", "hold", "error"}, *const methods[] = {"spline", "linear", "monotone"};
    table->outside =
        (kmp_outside)(1 + kmp_read_choice_of(r, map, "outside", p.what, KMP_NAMES_OF(words), "outside is", -1));
    const int word = kmp_read_choice_of(r, map, "method", p.what, KMP_NAMES_OF(methods), "the method is", 0);
    const kmp_table_method method = word == 1         ? KMP_TABLE_LINEAR
                                    : table->periodic ? word == 2 ? KMP_TABLE_PERIODIC_SHAPE : KMP_TABLE_PERIODIC
                                    : word == 2       ? KMP_TABLE_MONOTONE
                                                      : KMP_TABLE_CUBIC;
    if (table->of_two && (table->periodic || method == KMP_TABLE_MONOTONE)) {
        kmp_complain_of(r, map, p.what, "a table of two variables is not %s",
                        table->periodic ? "periodic" : "monotone");
        return;
    }
    if (table->of_two) {
        read_surface(r, map, p.what, method, table);
        return;
    }
    kmp_unit unit;
    bool good = kmp_read_column_unit(&p, KMP_DIM_ANY, "one of the units of the model language", &unit);
    if (!kmp_read_points(&p) || !good)
        return;
    if (p.count < 2) {
        kmp_complain_of(r, map, p.what, "a table needs at least two points, not %d", p.count);
        return;
    }
    if (!kmp_points_increase(&p, "x", "point"))
        return;
    if (p.has_unit[1] && !kmp_dimension_fits(p.unit[1].dimension, unit.dimension))
        kmp_complain_of(r, kmp_yaml_get(map, "unit"), p.what, "the unit in the head of its column is of another kind");
    for (int k = 0; k < p.count && !p.has_unit[1]; k++)
        p.y[k] = p.y[k] * unit.factor / unit.divisor;
    table->table = kmp_table_new(method, p.count, p.x, p.y);
    if (!table->table)
        r->scratch.failed = true;
    else if (table->periodic)
        check_period(r, map, p.what, table);
    else if (method == KMP_TABLE_CUBIC)
        note_overshoot(r, map, p.what, table->table);
}

bool kmp_name_means_something(const kmp_reader *r, const char *name)
{
    for (int k = 0; k < (int)KMP_FUNCTION_COUNT; k++)
        if (strcmp(kmp_function_name((kmp_function)k), name) == 0 && !kmp_function_yields(name))
            return true;
    static const char *const symbols[] = {"t", "q", "qd", "pi"};
    return kmp_name_find(KMP_NAMED(r->model, parameter), name) >= 0 ||
           kmp_name_find(KMP_NAMED(r->model, input), name) >= 0 ||
           kmp_name_find(KMP_NAMED(r->model, state), name) >= 0 || kmp_name_find(KMP_NAMES_OF(symbols), name) >= 0;
}

void kmp_read_tables(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "tables", "table");
    model->tables = KMP_ARENA_NEW(&model->arena, kmp_named_table, s.count);
    while (model->tables && kmp_section_next(&s)) {
        if (kmp_name_means_something(r, s.name))
            kmp_reader_complain(r, s.key->place, "a table cannot have the name '%s', which is already defined", s.name);
        kmp_named_table *table = &model->tables[model->table_count++];
        table->name = s.name;
        read_table(r, s.node, table);
    }
}

const kmp_named_table *kmp_read_table_name(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    int found = kmp_read_reference(r, node, what, "table", KMP_NAMED(r->model, table));
    if (found >= 0 && r->model->tables[found].of_two)
        kmp_complain_of(r, node, what, "the table '%s' has two variables", node->text);
    const kmp_named_table *table = found < 0 || r->model->tables[found].of_two ? NULL : &r->model->tables[found];
    if (table && (table->periodic || table->outside > KMP_OUTSIDE_LINEAR))
        kmp_complain_of(r, node, what, "the table '%s' is %s, which only expressions can use", node->text,
                        table->periodic ? "periodic" : "not continued outside");
    return table;
}
