/* SPDX-License-Identifier: BSD-3-Clause */
/* Units on the library: the mechanism, read from the resources. */
#include "exchange/fmu_library/library_unit.h"
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "exchange/fmu/unit_files.h"
#include "model/data/model.h"
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

kmp_library_unit *kmp_library_unit_of(const kempe_simulator *s)
{
    return (kmp_library_unit *)(void *)((char *)(uintptr_t)s->equations - offsetof(kmp_library_unit, equations));
}

/* -- resources ----------------------------------------------------------------------------------------- */

/* A path of the URI or path of the importer, without an ending slash. */
static char *folder_of(kmp_arena *arena, const char *resources)
{
    static const char scheme[] = "file:";
    kmp_text text = {0};
    const bool uri = strncmp(resources, scheme, sizeof scheme - 1) == 0;
    if (uri) {
        resources += sizeof scheme - 1;
        resources += strncmp(resources, "///", 3) == 0 ? 2 : strncmp(resources, "//localhost/", 12) == 0 ? 11 : 0;
    }
    for (; *resources; resources++) {
        char digits[3] = {0};
        unsigned code = 0;
        if (uri && *resources == '%' && resources[1] && resources[2]) {
            memcpy(digits, resources + 1, 2);
            code = (unsigned)strtoul(digits, NULL, 16);
            resources += 2;
        }
        kmp_text_append(&text, code ? (const char[]){(char)code} : resources, 1);
    }
    while (text.length > 1 && text.s[text.length - 1] == '/')
        text.s[--text.length] = '\0';
    return kmp_text_keep(&text, arena);
}

/* The lines of the list: the path of the model in the resources, then NAME=VALUE for each parameter that was set. */
static kempe_status read_list(kmp_library_unit *unit, const char *folder, char *text)
{
    char *line = text;
    for (char *next = NULL; line && *line; line = next) {
        next = strchr(line, '\n');
        if (next)
            *next++ = '\0';
        char *equals = strchr(line, '=');
        if (!unit->path) {
            unit->path = kmp_arena_printf(&unit->arena, "%s/%s", folder, line);
        } else if (equals) {
            *equals = '\0';
            kempe_setting *list = kmp_arena_room(&unit->arena, unit->settings, unit->setting_count, sizeof *list);
            if (!list)
                break;
            unit->settings = list;
            list[unit->setting_count++] =
                (kempe_setting){kmp_arena_strdup(&unit->arena, line), kmp_arena_strdup(&unit->arena, equals + 1)};
        }
    }
    KMP_TRY(kmp_made(unit->context, !unit->arena.failed));
    return unit->path
               ? KEMPE_OK
               : kmp_fail(unit->context, KEMPE_E_INPUT, "the list of the unit's resources is empty: export it again");
}

static kempe_status read_resources(kmp_library_unit *unit, const char *resources)
{
    char *text = NULL;
    size_t length = 0;
    if (!resources || !*resources)
        return kmp_fail(unit->context, KEMPE_E_ARGUMENT,
                        "the importer does not say where the resources of the unit are, which have the model");
    const char *folder = folder_of(&unit->arena, resources);
    const char *list = folder ? kmp_arena_printf(&unit->arena, "%s/%s", folder, KMP_UNIT_LIST) : NULL;
    KMP_TRY(kmp_made(unit->context, list));
    KMP_TRY(kmp_file_read(unit->context, KMP_FILE_RECORD, list, &text, &length));
    kempe_status status = read_list(unit, folder, text);
    kmp_free(text);
    return status;
}

/* -- the table ----------------------------------------------------------------------------------------- */

static void fill_table(kmp_library_unit *unit)
{
    const kmp_code_source *s = &unit->source;
    const struct kmp_simulated *x = s->simulated;
    unit->equations = (kempe_equations){.name = s->title,
                                        .hash = s->hash,
                                        .coordinates = s->n,
                                        .rows = s->m,
                                        .inputs = s->input_count,
                                        .parameters = s->parameter_count,
                                        .outputs = s->output_count,
                                        .coordinate_names = (const char *const *)s->coordinate_names,
                                        .row_names = (const char *const *)s->row_names,
                                        .input_names = (const char *const *)s->input_names,
                                        .parameter_names = (const char *const *)s->parameter_name,
                                        .output_names = (const char *const *)s->output_names,
                                        .coordinate_kind = x->coordinate_kind,
                                        .parameter_values = s->value,
                                        .parameter_fixed = x->fixed,
                                        .input_values = x->inputs,
                                        .start_q = x->q,
                                        .start_qd = x->qd};
    kmp_unit_token(unit->token, &(const kmp_unit_plan){.source = s, .on_library = true});
    unit->table = (kempe_fmu_model){.equations = &unit->equations,
                                    .token = unit->token,
                                    .kinds = KEMPE_FMU_CO_SIMULATION,
                                    .rtol = kmp_unit_rtol(unit->model),
                                    .atol = kmp_unit_atol(unit->model),
                                    .longest = kmp_unit_longest_step(unit->model)};
}

static kempe_status make(kmp_library_unit *unit, const char *resources)
{
    KMP_TRY(read_resources(unit, resources));
    KMP_TRY(kempe_model_read_set(unit->context, unit->path, unit->settings, unit->setting_count, &unit->model));
    KMP_TRY(kempe_system_new(unit->model, &unit->system));
    KMP_TRY(kmp_source_describe(&unit->source, unit->model, unit->system));
    fill_table(unit);
    const int inputs = unit->source.input_count, parameters = unit->source.parameter_count;
    kempe_setting *room = KMP_ARENA_NEW(&unit->arena, kempe_setting, unit->setting_count + parameters);
    for (int k = 0; room && k < unit->setting_count; k++)
        room[k] = unit->settings[k];
    unit->settings = room;
    KMP_ARENA_MAKE(&unit->arena, KMP_ROOM(double, 3 * inputs, &unit->given),
                   KMP_ROOM(double, parameters, &unit->values));
    return kmp_made(unit->context, !unit->arena.failed);
}

/* -- mechanisms with other parameters ------------------------------------------------------------------ */

void kmp_library_unit_stop(kmp_library_unit *unit)
{
    kempe_stepper_free(unit->stepper);
    kempe_outputs_free(unit->outputs);
    unit->stepper = NULL;
    unit->outputs = NULL;
}

static void forget_other(kmp_library_unit *unit)
{
    kmp_library_unit_stop(unit);
    if (unit->set_up != unit->system)
        kempe_system_free(unit->set_up);
    kempe_model_free(unit->other);
    unit->set_up = NULL;
    unit->other = NULL;
}

kempe_status kmp_library_unit_set_up(kmp_library_unit *unit, const double *parameters)
{
    const kmp_code_source *s = &unit->source;
    const size_t bytes = (size_t)s->parameter_count * sizeof(double);
    int count = unit->setting_count;
    if (unit->set_up && (!bytes || memcmp(parameters, unit->values, bytes) == 0))
        return KEMPE_OK;
    forget_other(unit);
    for (int k = 0; k < s->parameter_count; k++)
        if (memcmp(&parameters[k], &s->value[k], sizeof(double)) != 0)
            unit->settings[count++] =
                (kempe_setting){s->parameter_name[k], kmp_arena_printf(&unit->arena, "%.17g", parameters[k])};
    KMP_TRY(kmp_made(unit->context, !unit->arena.failed));
    if (count > unit->setting_count) {
        KMP_TRY(kempe_model_read_set(unit->context, unit->path, unit->settings, count, &unit->other));
        KMP_TRY(kempe_system_new(unit->other, &unit->set_up));
    } else {
        unit->set_up = unit->system;
    }
    if (bytes)
        memcpy(unit->values, parameters, bytes);
    return KEMPE_OK;
}

/* -- instances ------------------------------------------------------------------------------------------- */

static void close_unit(const kempe_fmu_model *opened)
{
    kmp_library_unit *unit = (kmp_library_unit *)(void *)(uintptr_t)opened;
    forget_other(unit);
    kmp_source_free(&unit->source);
    kempe_system_free(unit->system);
    kempe_model_free(unit->model);
    kempe_context_free(unit->context);
    kmp_arena_free(&unit->arena);
    kmp_free(unit);
}

static const kempe_fmu_model *open_unit(const char *resources, char *sentence, size_t size)
{
    kmp_library_unit *unit = KMP_NEW(kmp_library_unit, 1);
    if (!unit || !(unit->context = kempe_context_new())) {
        kmp_free(unit);
        (void)snprintf(sentence, size, "There is no memory for the instance.");
        return NULL;
    }
    if (make(unit, resources) == KEMPE_OK) {
        return &unit->table;
    }
    (void)snprintf(sentence, size, "%s", kempe_context_message(unit->context));
    close_unit(&unit->table);
    return NULL;
}

const kempe_fmu_model kempe_fmu_exported = {.kinds = KEMPE_FMU_CO_SIMULATION, .open = open_unit, .close = close_unit};
