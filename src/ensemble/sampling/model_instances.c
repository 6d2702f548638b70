/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/sampling/model_instances.h"
#include "base/context.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "model/read/reader.h"
#include <string.h>

bool kmp_instance_reads(const kempe_model *model, const char *name)
{
    const int k = kmp_parameter_find(model, name);
    return k >= 0 && model->parameters[k].shapes;
}

bool kmp_instance_may(const kempe_model *model, const char *name, kmp_text *why)
{
    if (!kmp_instance_reads(model, name))
        return kmp_variant_may(model, name, why);
    if (!model->source.from_file)
        kmp_text_printf(why,
                        "an axis, table or track depends on parameter '%s', and the model has no file that could be "
                        "read again with its values; use one model for each value",
                        name);
    return why->length == 0;
}

/* -- the file ----------------------------------------------------------------------------------------- */

/* The settings with which the model was read, then the values. */
static kempe_setting *settings_of(const kempe_model *model, int count, const char *const *names, const double *values,
                                  kmp_arena *arena)
{
    kempe_setting *list = KMP_ARENA_NEW(arena, kempe_setting, model->source.setting_count + count);
    for (int k = 0; list && k < model->source.setting_count; k++)
        list[k] = model->source.settings[k];
    for (int k = 0; list && k < count; k++) {
        kmp_text value = {0};
        kmp_text_printf(&value, "%.17g", values[k]);
        list[model->source.setting_count + k] = (kempe_setting){names[k], kmp_text_keep(&value, arena)};
    }
    return arena->failed ? NULL : list;
}

/* The files are the files of the model: other ones would give results of another mechanism. */
static kempe_status check_files(const kempe_model *model)
{
    kempe_model *same = NULL;
    kempe_status status = kmp_model_read_file(model->context, model->source.file, model->source.settings,
                                              model->source.setting_count, &same);
    bool changed =
        status == KEMPE_E_INPUT || status == KEMPE_E_IO ||
        (status == KEMPE_OK && memcmp(same->source.digest, model->source.digest, sizeof model->source.digest) != 0);
    kempe_model_free(same);
    if (!changed)
        return status;
    kmp_context_clear(model->context);
    return kmp_fail(model->context, KEMPE_E_INPUT,
                    "%s: the file, or one that it includes, has changed since it was read; run the command again",
                    model->source.file);
}

kempe_status kmp_model_read_again(const kempe_model *model, int count, const char *const *names, const double *values,
                                  kempe_model **again)
{
    kempe_context *context = model->context;
    kmp_arena arena = {0};
    const bool quiet = kmp_context_quiet(context, true);
    kempe_status status = check_files(model);
    kempe_setting *list = settings_of(model, count, names, values, &arena);
    if (status == KEMPE_OK)
        status = kmp_made(context, list);
    if (status == KEMPE_OK) {
        status = kmp_model_read_file(context, model->source.file, list, model->source.setting_count + count, again);
        status = status == KEMPE_E_INPUT ? KEMPE_E_FAILED : status;
    }
    (void)kmp_context_quiet(context, quiet);
    kmp_arena_free(&arena);
    return status;
}

/* -- an instance -------------------------------------------------------------------------------------- */

static kempe_status check_names(const kempe_model *model, int count, const char *const *names)
{
    for (int k = 0; k < count; k++) {
        kmp_text why = {0};
        if (!kmp_instance_may(model, names[k], &why))
            return kmp_fail_text(model->context, KEMPE_E_ARGUMENT, &why);
        for (int i = 0; i < k; i++)
            if (strcmp(names[i], names[k]) == 0)
                return kmp_fail(model->context, KEMPE_E_ARGUMENT, "'%s' is given twice", names[k]);
    }
    return KEMPE_OK;
}

kempe_status kmp_model_instance(const kempe_model *model, int count, const char *const *names, const double *values,
                                kempe_model **instance)
{
    kmp_arena arena = {0};
    const char **name = KMP_ARENA_NEW(&arena, const char *, count);
    double *value = KMP_ARENA_NEW(&arena, double, count);
    kempe_model *again = NULL;
    int shapes = 0, others = count;
    kempe_status status = kmp_made(model->context, name && value);
    if (status == KEMPE_OK)
        status = check_names(model, count, names);
    for (int k = 0; status == KEMPE_OK && k < count; k++) {
        const int at = kmp_instance_reads(model, names[k]) ? shapes++ : --others;
        name[at] = names[k];
        value[at] = values[k];
    }
    if (status == KEMPE_OK && shapes > 0)
        status = kmp_model_read_again(model, shapes, name, value, &again);
    if (status == KEMPE_OK)
        status = kmp_variant_instance(again ? again : model, count - shapes, name + shapes, value + shapes, instance);
    if (status == KEMPE_OK && again)
        kmp_variant_own((*instance)->variant, again);
    else
        kempe_model_free(again);
    kmp_arena_free(&arena);
    return status;
}
