/* SPDX-License-Identifier: BSD-3-Clause */
/* A model read, with its system: what most tests begin with. Reading that fails is a failed check, and said. */
#ifndef KEMPE_TESTS_LOADED_H
#define KEMPE_TESTS_LOADED_H

#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdbool.h>

typedef struct loaded {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system; /* NULL: it failed */
} loaded;

static inline loaded load_finish(loaded l)
{
    if (!l.model || kempe_system_new(l.model, &l.system) != KEMPE_OK)
        printf("%s\n", kempe_context_message(l.context));
    CHECK(l.system != NULL);
    return l;
}

/** A file by its path from the root of the sources, with parameters set. */
static inline loaded load_set(const char *path, const kempe_setting *settings, int count)
{
    char full[1024];
    loaded l = {.context = kempe_context_new()};
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    (void)kempe_model_read_set(l.context, full, settings, count, &l.model);
    return load_finish(l);
}

static inline loaded load(const char *path)
{
    return load_set(path, NULL, 0);
}

/** A text as if it stood in this file, from which it names others. */
static inline loaded load_text_as(const char *text, const char *path)
{
    loaded l = {.context = kempe_context_new()};
    (void)kempe_model_read_text(l.context, text, path, &l.model);
    return load_finish(l);
}

static inline loaded load_text(const char *text)
{
    return load_text_as(text, "model.yaml");
}

/** A text that the reader must reject, with these words in its message. */
static inline void load_rejected(const char *text, const char *words)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "model.yaml", &model) == KEMPE_E_INPUT);
    if (!strstr(kempe_context_message(context), words))
        CHECK_TEXT(kempe_context_message(context), words);
    kempe_model_free(model);
    kempe_context_free(context);
}

/** The integrator of tests that run all formulations: IDA on `dae`, so that one integrator shares no step with the
 * others; NULL, the default, elsewhere. */
static inline const char *independent_integrator(const char *formulation)
{
    return formulation && strcmp(formulation, "dae") == 0 ? "ida" : NULL;
}

/** The place of a coordinate in q. A missing one is a failed check, and is reported; 0 then. */
static inline int coordinate_named(const loaded *l, const char *name)
{
    int count = l->model ? kempe_model_coordinate_count(l->model) : 0;
    for (int k = 0; k < count; k++)
        if (strcmp(kempe_model_coordinate_name(l->model, k), name) == 0)
            return k;
    printf("no coordinate '%s'\n", name);
    CHECK(false);
    return 0;
}

static inline void unload(loaded *l)
{
    kempe_system_free(l->system);
    kempe_model_free(l->model);
    kempe_context_free(l->context);
}

#endif
