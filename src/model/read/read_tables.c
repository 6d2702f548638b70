/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables: functions of one variable by points, in the file or in columns of a CSV file in its folder. */
#include "model/read/reading.h"
#include "symbolic/table_function.h"
#include <string.h>

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
    static const char *const methods[] = {"spline", "linear"};
    return node && kmp_read_choice(r, node, what, KMP_NAMES_OF(methods), "the method is", " or ") != 0;
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
    return found < 0 ? NULL : &r->model->tables[found];
}
