/* SPDX-License-Identifier: BSD-3-Clause */
/* Parameters without influence on the model: most are misspelt, or left over. The user is warned of those of the file
 * itself, and of any that is set in vain: by --set, or by the file that includes theirs. */
#include "model/read/unused.h"
#include "base/context.h"
#include "model/data/model.h"
#include "model/read/read_include.h"
#include "model/read/read_values.h"
#include "model/read/reading.h"
#include <stdio.h>
#include <string.h>

static bool is_set(const kmp_reader *r, const char *name)
{
    for (int k = 0; k < r->setting_count; k++)
        if (strcmp(r->settings[k].name, name) == 0)
            return true;
    return false;
}

static void warn(const kmp_reader *r, kmp_place place, const char *name, const char *vain)
{
    char where[48] = "";
    if (place.line > 0) /* a call has none */
        (void)snprintf(where, sizeof where, ":%d:%d", place.line, place.column);
    kmp_log(r->context, KEMPE_LOG_WARNING, "%s%s: parameter '%s' is not used%s", r->model->files[place.file], where,
            name, vain);
}

/* Displaced values use parameters of the file, too: those are not unused. */
static void spare_displaced(kmp_reader *r, const kmp_yaml *map)
{
    for (int i = 0; i < map->count; i++)
        if (r->model->parameters[i].used && is_set(r, r->model->parameters[i].name))
            kmp_reader_use(r, kmp_read_constant(r, map->items[i], r->model->parameters[i].name));
}

/* For parameters of included files, warns of those that the including file has set alone. */
static void warn_of_file(const kmp_reader *r, const kmp_yaml *map, int i)
{
    kmp_parameter *parameter = &r->model->parameters[i];
    kmp_place own = map->keys[i]->place, item = map->items[i]->place;
    parameter->unused = item.file != own.file || !kmp_reader_instance(r, own.file);
    if (item.file != own.file)
        warn(r, item, parameter->name, ": setting it where its file is included has no effect");
    else if (parameter->unused)
        warn(r, own, parameter->name, "");
}

static void settle(kmp_reader *r, const kmp_yaml *map)
{
    kempe_model *model = r->model;
    for (int i = 0; i < model->parameter_count; i++) {
        bool set = is_set(r, model->parameters[i].name);
        model->parameters[i].unused = set && !r->model->parameters[i].used;
        if (model->parameters[i].unused)
            warn(r, map->keys[i]->place, model->parameters[i].name, ": setting it has no effect");
    }
    spare_displaced(r, map);
    for (int i = 0; i < model->parameter_count; i++)
        if (!r->model->parameters[i].used && !is_set(r, model->parameters[i].name))
            warn_of_file(r, map, i);
}

void kmp_settle_parameters(kmp_reader *r)
{
    if (!r->wrong && !r->scratch.failed && r->model->parameter_count > 0)
        settle(r, kmp_yaml_get(r->root, "parameters"));
}
