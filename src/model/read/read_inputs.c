/* SPDX-License-Identifier: BSD-3-Clause */
/* Inputs: their defaults and samples, and values given by settings: a number, or FILE:COLUMN:METHOD. */
#include "model/read/read_inputs.h"
#include "model/data/model.h"
#include "model/files/nodes.h"
#include "model/read/files.h"
#include "model/read/read_include.h"
#include "model/read/read_points.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include "symbolic/table_function.h"
#include <string.h>

static const kmp_key keys[] = {
#include "model/keys/input_keys.def"
    {0}};

bool kmp_is_input_setting(const kmp_reader *r, const char *name)
{
    return kmp_yaml_get(kmp_yaml_get(r->root, "inputs"), name);
}

/* -- units ----------------------------------------------------------------------------------------- */

static void read_unit(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_model_input *input)
{
    kmp_unit unit;
    const char *text = node ? kmp_read_word(r, node, kmp_reader_say(r, "unit of %s", what)) : NULL;
    if (text && kmp_unit_read(text, strlen(text), &unit)) {
        input->unit = kmp_arena_strdup(&r->model->arena, text);
        input->dimension = unit.dimension;
        input->si = unit.factor / unit.divisor;
    } else if (text) {
        kmp_reader_complain(r, node->place, "unit of %s: '%s' is no unit", what, text);
    }
}

/* -- samples --------------------------------------------------------------------------------------- */

/* Times must increase; one sample is enough. */
static bool check_samples(const kmp_points *p)
{
    int bad = p->count < 2 ? -1 : kmp_table_check(p->count, p->x, p->y);
    if (p->count < 1)
        kmp_reader_complain(p->r, p->map->place, "%s has no samples", p->what);
    else if (bad > 0)
        kmp_reader_complain(p->r, p->place[bad], "%s: times must increase: %.9g comes after %.9g", p->what, p->x[bad],
                            p->x[bad - 1]);
    else if (bad == 0)
        kmp_reader_complain(p->r, p->place[0], "%s: the first sample is not finite", p->what);
    return p->count >= 1 && bad < 0;
}

static void read_samples(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_model_input *input)
{
    kmp_points p = {.r = r, .map = map, .what = what, .key = {"t", "value"}, .dimension = KMP_DIM_NUMBER};
    const kmp_yaml *method = kmp_read_required(r, map, what, "method");
    int word = method ? kmp_read_choice(r, method, what, kmp_signal_words, "the method is", " or ") : -1;
    if (word < 0 || !kmp_read_points(&p) || !check_samples(&p))
        return;
    for (int k = 0; k < p.count; k++)
        p.y[k] *= input->si;
    (void)kmp_signal_init(&input->signal, &r->model->arena, (kmp_signal_method)word, p.count, p.x, p.y);
}

/* Columns without a name are those of the time, and of the input's own name. */
static const kmp_yaml *with_columns(kmp_reader *r, const kmp_yaml *map, const char *name)
{
    kmp_yaml *full = kmp_yaml_copy(&r->scratch, map);
    if (full && !kmp_yaml_get(map, "t"))
        kmp_yaml_put(&r->scratch, full, map->place, "t", kmp_yaml_word(&r->scratch, map->place, "t"));
    if (full && !kmp_yaml_get(map, "value"))
        kmp_yaml_put(&r->scratch, full, map->place, "value", kmp_yaml_word(&r->scratch, map->place, name));
    return full ? full : map;
}

/* -- settings -------------------------------------------------------------------------------------- */

static const char *setting_of(const kmp_reader *r, const char *name)
{
    for (int k = r->setting_count; k-- > 0;)
        if (strcmp(r->settings[k].name, name) == 0)
            return r->settings[k].value;
    return NULL;
}

/* FILE:COLUMN:METHOD as the mapping that the model's file would have. */
static const kmp_yaml *samples_of(kmp_reader *r, kmp_place place, const char *text)
{
    static const char *const parts[] = {"csv", "value", "method"};
    const char *method = strrchr(text, ':'), *column = method;
    while (column > text && *--column != ':')
        ;
    const char *begin[] = {text, column + 1, method + 1}, *end[] = {column, method, method + strlen(method)};
    kmp_yaml *map = kmp_yaml_new(&r->scratch, KMP_YAML_MAP, place);
    if (column == text) {
        kmp_reader_complain(r, place, "a number or FILE:COLUMN:METHOD is expected here, not '%s'", text);
        return NULL;
    }
    for (int k = 0; k < 3; k++) {
        const char *part = kmp_reader_say(r, "%.*s", (int)(end[k] - begin[k]), begin[k]);
        kmp_yaml_put(&r->scratch, map, place, parts[k], kmp_yaml_word(&r->scratch, place, part));
    }
    kmp_yaml_put(&r->scratch, map, place, "t", kmp_yaml_word(&r->scratch, place, "t"));
    return map;
}

/* A given value, in place of the default and of the samples of the file. */
static void read_setting(kmp_reader *r, const char *text, const char *what, kmp_model_input *input)
{
    int file = kmp_reader_add_file(r, kmp_reader_say(r, "--input %s", input->name));
    kmp_place place = {.line = 1, .column = 1, .file = file};
    const kmp_yaml *node = file < 0 ? NULL : kmp_yaml_word(&r->scratch, place, text);
    if (node && !strchr(text, ':')) {
        (void)kmp_read_quantity(r, node, what, input->dimension, input->si, &input->value);
        return;
    }
    const kmp_yaml *map = node ? samples_of(r, place, text) : NULL;
    if (map)
        read_samples(r, map, what, input);
}

/* -- the section ----------------------------------------------------------------------------------- */

static void read_input(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_model_input *input)
{
    const char *given = setting_of(r, input->name);
    if (!kmp_read_map(r, map, what, keys))
        return;
    const kmp_yaml *value = kmp_yaml_get(map, "default"), *csv = kmp_yaml_get(map, "csv");
    bool sampled = csv || kmp_yaml_get(map, "t") || kmp_yaml_get(map, "value") || kmp_yaml_get(map, "method");
    read_unit(r, kmp_yaml_get(map, "unit"), what, input);
    if (value)
        (void)kmp_read_quantity(r, value, kmp_reader_say(r, "default of %s", what), input->dimension, input->si,
                                &input->value);
    if (given)
        read_setting(r, given, what, input);
    else if (sampled)
        read_samples(r, csv ? with_columns(r, map, input->name) : map, what, input);
    static const double start = 0;
    if (input->signal.count == 0)
        (void)kmp_signal_init(&input->signal, &r->model->arena, KMP_SIGNAL_HOLD, 1, &start, &input->value);
}

void kmp_read_inputs(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "inputs", "input");
    model->inputs = KMP_ARENA_NEW(&model->arena, kmp_model_input, s.count);
    while (model->inputs && kmp_section_next(&s)) {
        if (kmp_name_means_something(r, s.name))
            kmp_reader_complain(r, s.key->place, "an input cannot have the name '%s', which is already defined",
                                s.name);
        kmp_model_input *input = &model->inputs[model->input_count++];
        *input = (kmp_model_input){.name = s.name, .place = s.key->place, .unit = "", .si = 1};
        read_input(r, s.node, s.what, input);
    }
}

void kmp_settle_inputs(const kmp_reader *r)
{
    const kempe_model *model = r->model;
    for (int k = 0; !r->wrong && k < model->input_count; k++)
        if (!model->inputs[k].used && !kmp_reader_instance(r, model->inputs[k].place.file))
            kmp_log(r->context, KEMPE_LOG_WARNING, "%s:%d:%d: input '%s' is not used",
                    model->files[model->inputs[k].place.file], model->inputs[k].place.line,
                    model->inputs[k].place.column, model->inputs[k].name);
}
