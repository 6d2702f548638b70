/* SPDX-License-Identifier: BSD-3-Clause */
#include "analysis/reactions.h"
#include "base/memory.h"
#include "dynamics/closures.h"

static kmp_program *derive(const kempe_model *model, kmp_equations *eq)
{
    int count = KMP_REACTION * model->closure_count;
    kmp_ref *out = KMP_NEW(kmp_ref, count);
    const kmp_ref *group = out;
    for (int c = 0; out && c < model->closure_count; c++)
        for (int k = 0; k < KMP_REACTION; k++)
            out[KMP_REACTION * c + k] = kmp_closures_reaction(eq, c, k >= 3).x[k % 3];
    kmp_program *program = out ? kmp_program_new(eq->graph, 1, &count, &group) : NULL;
    kmp_free(out);
    return program;
}

kempe_status kmp_reactions_init(kmp_reactions *reactions, const kempe_system *system)
{
    kmp_equations eq;
    *reactions = (kmp_reactions){.system = system};
    kempe_status status = kmp_equations_init(&eq, system->model, KMP_SET_REACTION, KMP_SCHEME_COMPOSITE, false);
    if (status != KEMPE_OK)
        return status;
    reactions->program = derive(system->model, &eq);
    kmp_equations_free(&eq);
    if (reactions->program)
        reactions->machine = kmp_machine_new(reactions->program, kmp_backend_find("tape"));
    if (!reactions->machine) {
        kmp_reactions_free(reactions);
        return kmp_fail_memory(system->context);
    }
    kmp_machine_set(reactions->machine, KMP_IN_PARAMETER, system->parameters);
    (void)kmp_machine_run(reactions->machine, 0);
    return KEMPE_OK;
}

void kmp_reactions_free(kmp_reactions *reactions)
{
    kmp_machine_free(reactions->machine);
    kmp_program_free(reactions->program);
    *reactions = (kmp_reactions){0};
}

const double *kmp_reactions_at(kmp_reactions *reactions, double t, const double *q, const double *lambda)
{
    kmp_machine_set(reactions->machine, KMP_IN_TIME, &t);
    kmp_machine_set(reactions->machine, KMP_IN_Q, q);
    kmp_machine_set(reactions->machine, KMP_IN_LAMBDA, lambda);
    return kmp_machine_run(reactions->machine, 1);
}
