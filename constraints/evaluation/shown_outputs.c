/* SPDX-License-Identifier: BSD-3-Clause */
/* Values that judge or show a motion and do not make it: energy, power, reactions, outputs. They have a program of
 * their own, so that steps do not pay for them. Its stages build on each other in this order: potential, power,
 * reactions, positions, outputs; each function runs the stages that it needs. */
#include "constraints/evaluation/shown_outputs.h"
#include "constraints/evaluation/condition_modes.h"
#include "model/data/output_table.h"

double kmp_eval_potential(kmp_evaluator *eval, double t, const double *q)
{
    kmp_eval_follow_conditions(eval, &t, q, NULL);
    kmp_machine_set(eval->judge, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, t));
    kmp_machine_set(eval->judge, KMP_IN_Q, q);
    return *kmp_machine_run(eval->judge, KMP_STAGE_POTENTIAL);
}

/* Stages build on each other: the power's needs the potential's. The power uses the multipliers of the last C. */
double kmp_eval_power(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    kmp_eval_follow_conditions(eval, &t, q, qd);
    (void)kmp_eval_potential(eval, t, q);
    kmp_machine_set(eval->judge, KMP_IN_QD, qd);
    if (eval->nu)
        kmp_machine_set(eval->judge, KMP_IN_LAMBDA, eval->nu);
    double power = *kmp_machine_run(eval->judge, KMP_STAGE_POWER);
    const double *effort = kmp_eval_effort(eval, t, q, qd);
    for (int i = 0; effort && i < eval->n; i++)
        power += effort[i] * qd[i];
    return power;
}

double kmp_eval_power_here(kmp_evaluator *eval, const double *qd)
{
    if (eval->weighs_only && !eval->by_bodies)
        return kmp_eval_power(eval, eval->t, eval->q, qd);
    const kmp_program *program = eval->by_bodies ? eval->system->bodies->program : eval->system->motion;
    double power = program->stages > KMP_STAGE_WORKING ? *kmp_machine_run(eval->motion, KMP_STAGE_WORKING) : 0;
    for (int i = 0; eval->system->force && i < eval->n; i++)
        power += eval->effort[i] * qd[i];
    return power;
}

const double *kmp_eval_reactions(kmp_evaluator *eval, double t, const double *q, const double *lambda)
{
    (void)kmp_eval_potential(eval, t, q);
    kmp_machine_set(eval->judge, KMP_IN_LAMBDA, lambda);
    (void)kmp_machine_run(eval->judge, KMP_STAGE_POWER);
    return kmp_machine_run(eval->judge, KMP_STAGE_REACTION);
}

const double *kmp_eval_shown(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                             const double *lambda)
{
    kmp_eval_follow_conditions(eval, &t, q, qd);
    kmp_machine_set(eval->judge, KMP_IN_QD, qd);
    kmp_machine_set(eval->judge, KMP_IN_QDD, qdd);
    (void)kmp_eval_reactions(eval, t, q, lambda);
    (void)kmp_machine_run(eval->judge, KMP_STAGE_POSITION);
    return kmp_machine_run(eval->judge, KMP_STAGE_SHOWN);
}
