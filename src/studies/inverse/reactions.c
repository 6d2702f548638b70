/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/inverse/reactions.h"
#include "base/memory.h"
#include "dynamics/closures.h"

kempe_status kmp_reactions_init(kmp_formulas *reactions, const kempe_system *system)
{
    const kempe_model *model = system->model;
    kmp_equations eq;
    KMP_TRY(kmp_equations_init(&eq, model, KMP_SET_REACTION, KMP_SCHEME_COMPOSITE, false));
    int count = KMP_REACTION * model->closure_count;
    kmp_ref *out = KMP_NEW(kmp_ref, count);
    for (int k = 0; out && k < count; k++)
        out[k] = kmp_closures_reaction(&eq, k / KMP_REACTION, k % KMP_REACTION >= 3).x[k % 3];
    bool ok = out && kmp_formulas_init(reactions, eq.graph, count, out, kmp_backend_find("tape"), system->parameters);
    kmp_free(out);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(system->context);
}
