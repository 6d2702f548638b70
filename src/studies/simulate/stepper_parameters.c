/* SPDX-License-Identifier: BSD-3-Clause */
/* Other values of parameters from the current time on: a system of its own, of a variant of the model. */
#include "base/memory.h"
#include "model/variant.h"
#include "studies/simulate/stepper_inside.h"
#include <string.h>

struct kmp_stepper_parameters {
    kmp_arena arena;
    const kempe_model *model; /* the user's */
    kempe_system *system;
    kmp_variant *variant;
    int count;
    const char **name;
    double *value;
};

typedef struct kmp_stepper_parameters parameters;

void kmp_stepper_parameters_free(parameters *p)
{
    if (!p)
        return;
    kempe_system_free(p->system);
    kmp_variant_free(p->variant);
    kmp_arena_free(&p->arena);
    kmp_free(p);
}

/* A later value of a name replaces an earlier one. */
static void put(parameters *p, const char *name, double value)
{
    int k = 0;
    while (k < p->count && strcmp(p->name[k], name) != 0)
        k++;
    if (k == p->count)
        p->name[p->count++] = kmp_arena_strdup(&p->arena, name);
    p->value[k] = value;
}

static parameters *merge(const kempe_stepper *s, int count, const char *const *names, const double *values)
{
    const parameters *before = s->parameters;
    int had = before ? before->count : 0;
    parameters *p = KMP_NEW(parameters, 1);
    if (!p)
        return NULL;
    p->model = before ? before->model : s->system->model;
    p->name = KMP_ARENA_NEW(&p->arena, const char *, had + count);
    p->value = KMP_ARENA_NEW(&p->arena, double, had + count);
    for (int k = 0; !p->arena.failed && k < had + count; k++)
        put(p, k < had ? before->name[k] : names[k - had], k < had ? before->value[k] : values[k - had]);
    if (!p->arena.failed)
        return p;
    kmp_stepper_parameters_free(p);
    return NULL;
}

static kempe_status derive(parameters *p, const kempe_system *before)
{
    kmp_text why = {0};
    KMP_TRY(kmp_variant_new(p->model, p->count, p->name, &p->variant));
    kempe_status status = kmp_variant_set(p->variant, p->value, &why);
    if (status == KEMPE_E_INPUT)
        status = kmp_fail(before->context, status, "%s", why.s ? why.s : "");
    kmp_text_free(&why);
    if (status == KEMPE_OK)
        status = kempe_system_new(kmp_variant_model(p->variant), &p->system);
    if (status == KEMPE_OK && (p->system->m != before->m || p->system->events.count != before->events.count))
        return kmp_fail(before->context, KEMPE_E_FAILED,
                        "these values change the number of closure rows or of conditions (%d and %d, now %d and %d)",
                        before->m, before->events.count, p->system->m, p->system->events.count);
    if (status == KEMPE_OK)
        kempe_system_set_force(p->system, before->force, before->force_user);
    return status;
}

/* Continues with the system of `p`; after a failure everything is as before. */
static kempe_status take(kempe_stepper *s, parameters *p, kempe_stepper_state *state, double *moved)
{
    const kempe_system *before = s->system;
    kempe_workspace *closer = s->closer;
    s->system = p->system;
    s->closer = NULL;
    kempe_status status = kmp_stepper_continue(s, state, moved);
    if (status == KEMPE_OK) {
        kempe_workspace_free(closer);
        kmp_stepper_parameters_free(s->parameters);
        s->parameters = p;
        return status;
    }
    kempe_workspace_free(s->closer);
    s->closer = closer;
    s->system = before;
    return status;
}

kempe_status kempe_stepper_set_parameters(kempe_stepper *s, int count, const char *const *names, const double *values,
                                          double *moved)
{
    KMP_WANTED(NULL, s, "stepper");
    kempe_context *context = s->system->context;
    KMP_WANTED(context, names, "names");
    KMP_WANTED(context, values, "values");
    KMP_TRY(kmp_stepper_enter(s));
    for (int k = 0; k < count; k++)
        KMP_WANTED(context, names[k], "a name");
    if (count < 1)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "%d parameters: a positive number is expected", count);
    kempe_stepper_state *state = NULL;
    kempe_status status = kmp_stepper_record(s, true, &state);
    if (status == KEMPE_STOPPED) /* an end of the run, which the values may move */
        status = kmp_stepper_record(s, false, &state);
    KMP_TRY(status);
    parameters *p = merge(s, count, names, values);
    status = p ? derive(p, s->system) : kmp_fail_memory(context);
    if (status == KEMPE_OK)
        status = take(s, p, state, moved);
    if (status != KEMPE_OK)
        kmp_stepper_parameters_free(p);
    kempe_stepper_state_free(state);
    return status;
}
