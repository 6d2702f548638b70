/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/all_loads.h"
#include "dynamics/closures.h"
#include "dynamics/equations.h"
#include "dynamics/joint_loads.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"

static kempe_status derive(kmp_all_loads *loads, kmp_equations *eq, const kempe_system *system)
{
    const kempe_model *model = system->model;
    const int closures = KMP_LOAD_VALUES * model->closure_count;
    kmp_ref *out = KMP_ARENA_NEW(&loads->arena, kmp_ref, closures + KMP_LOAD_VALUES * model->body_count);
    KMP_TRY(kmp_made(system->context, out && loads->joint));
    KMP_TRY(kmp_joint_loads_begin(eq, true));
    for (int k = 0; k < closures; k++)
        out[k] = kmp_closure_load(&eq->tree, k / KMP_LOAD_VALUES, k % KMP_LOAD_VALUES >= 3).x[k % 3];
    for (int k = 0; k < KMP_LOAD_VALUES * loads->joints; k++)
        out[closures + k] =
            kmp_joint_load(&eq->tree, loads->joint[k / KMP_LOAD_VALUES], k % KMP_LOAD_VALUES >= 3).x[k % 3];
    if (kmp_joint_loads_end(eq) != KEMPE_OK) {
        kmp_context_clear(system->context);
        loads->joints = 0;
    }
    bool ok = kmp_formulas_init(&loads->formulas, eq->graph, closures + KMP_LOAD_VALUES * loads->joints, out,
                                kmp_backend_find("tape"), system->parameters);
    return kmp_made(system->context, ok);
}

kempe_status kmp_all_loads_init(kmp_all_loads *loads, const kempe_system *system)
{
    const kempe_model *model = system->model;
    kmp_equations eq;
    *loads = (kmp_all_loads){0};
    loads->joint = KMP_ARENA_NEW(&loads->arena, int, model->body_count);
    for (int b = 1; loads->joint && b < model->body_count; b++)
        if (!kmp_joint_obstacle(model, b) && !model->bodies[b].coupling &&
            kmp_name_find(KMP_NAMED(model, closure), model->bodies[b].joint) < 0)
            loads->joint[loads->joints++] = b;
    KMP_TRY(kmp_equations_init(&eq, model, KMP_SET_REACTION, KMP_SCHEME_COMPOSITE, false));
    kempe_status status = derive(loads, &eq, system);
    kmp_equations_free(&eq);
    return status;
}

void kmp_all_loads_free(kmp_all_loads *loads)
{
    kmp_formulas_free(&loads->formulas);
    kmp_arena_free(&loads->arena);
}

const double *kmp_all_loads_at(kmp_all_loads *loads, const kmp_instant *at)
{
    return kmp_formulas_at(&loads->formulas, at);
}
