/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables: functions of one variable by points, in the file or in columns of a CSV file in its folder. */
#include "model/read/reading.h"
#include "symbolic/table.h"
#include <string.h>

/* -- tables -------------------------------------------------------------------------------------- */

static bool check_points(const kmp_points *p, kmp_place place)
{
    if (p->count < 2) {
        kmp_reader_complain(p->r, place, "%s: a table needs at least two points, not %d", p->what, p->count);
        return false;
    }
    int bad = kmp_table_check(p->count, p->x, p->y);
    if (bad > 0)
        kmp_reader_complain(p->r, p->place[bad], "%s: x must increase: %.9g comes after %.9g", p->what, p->x[bad],
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
    kmp_points p = {.r = r,
                    .map = map,
                    .what = kmp_reader_say(r, "table '%s'", table->name),
                    .key = {"x", "y"},
                    .dimension = KMP_DIM_ANY};
    if (!kmp_read_map(r, map, p.what, keys))
        return;
    bool linear = is_linear(r, kmp_yaml_get(map, "method"), p.what);
    if (!kmp_read_points(&p) || !check_points(&p, map->place))
        return;
    table->table = kmp_table_new(linear ? KMP_TABLE_LINEAR : KMP_TABLE_CUBIC, p.count, p.x, p.y);
    if (!table->table)
        r->scratch.failed = true;
}

bool kmp_name_means_something(const kmp_reader *r, const char *name)
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
        if (name && kmp_name_means_something(r, name))
            kmp_reader_complain(r, map->keys[i]->place, "a table cannot have the name '%s', which is already defined",
                                name);
        table->name = kmp_arena_strdup(&model->arena, map->keys[i]->text);
        if (!table->name)
            return;
        model->table_count++;
        read_table(r, map->items[i], table);
    }
}

const kmp_named_table *kmp_read_table_name(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const char *name = kmp_read_word(r, node, what);
    if (!name)
        return NULL;
    kmp_nearest nearest = kmp_nearest_begin(name);
    name = kmp_reader_name(r, node->place.file, name);
    for (int k = 0; k < r->model->table_count; k++) {
        kmp_nearest_offer(&nearest, r->model->tables[k].name);
        if (strcmp(r->model->tables[k].name, name) == 0)
            return &r->model->tables[k];
    }
    kmp_reader_complain_near(r, node->place, &nearest, "%s: unknown table '%s'", what, name);
    return NULL;
}
