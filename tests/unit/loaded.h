/* SPDX-License-Identifier: BSD-3-Clause */
/* A model read, with its system: what most tests begin with. Reading that fails is a failed check, and said. */
#ifndef KEMPE_TESTS_LOADED_H
#define KEMPE_TESTS_LOADED_H

#include "check.h"
#include <kempe/kempe.h>

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

/** A file by its path from the root of the sources. */
static inline loaded load(const char *path)
{
    char full[1024];
    loaded l = {.context = kempe_context_new()};
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    (void)kempe_model_read(l.context, full, &l.model);
    return load_finish(l);
}

/** A text; complaints of it begin with model.yaml. */
static inline loaded load_text(const char *text)
{
    loaded l = {.context = kempe_context_new()};
    (void)kempe_model_read_text(l.context, text, "model.yaml", &l.model);
    return load_finish(l);
}

static inline void unload(loaded *l)
{
    kempe_system_free(l->system);
    kempe_model_free(l->model);
    kempe_context_free(l->context);
}

#endif
