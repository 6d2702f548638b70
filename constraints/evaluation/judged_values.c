/* SPDX-License-Identifier: BSD-3-Clause */
/* Values that judge or show a motion and do not make it: energy, power, reactions, outputs. They have a separate
 * program, so that steps do not pay for them. Its stages build on each other in this order: potential, power,
 * reactions, positions, outputs; each function runs the stages that it needs. */
#include "constraints/evaluation/judged_values.h"
#include "constraints/evaluation/evaluator_inside.h"
#include "model/data/model.h"

double kmp_eval_potential(kmp_evaluator *eval, double t, const double *q)
{
    kmp_eval_follow_conditions(eval, &t, q, NULL);
    kmp_machine_set(eval->judge, KMP_IN_TIME, kmp_present_inputs_at(&eval->inputs, t));
    kmp_machine_set(eval->judge, KMP_IN_Q, q);
    return *kmp_eval_run(eval, eval->judge, KMP_STAGE_POTENTIAL);
}

bool kmp_eval_goes_by_links(const kmp_evaluator *eval)
{
    return eval->weighs_only && eval->system->late->by_links;
}

/* True if the judging program has the kinetic energy. */
static bool has_links(const kmp_evaluator *eval)
{
    return eval->by_products || kmp_eval_goes_by_links(eval);
}

/* qd' M qd / 2 of the last M; or link by link, after the potential at the same place. */
static double kinetic_here(kmp_evaluator *eval, const double *qd)
{
    const kmp_pattern *p = &eval->system->mass;
    int coordinates = kmp_model_coordinates(eval->system->model);
    double sum = 0;
    if (has_links(eval)) {
        kmp_machine_set(eval->judge, KMP_IN_QD, qd);
        return kmp_eval_run(eval, eval->judge, KMP_STAGE_POWER)[1];
    }
    for (int k = 0; k < p->count && p->row[k] < coordinates; k++)
        sum += eval->mass[k] * qd[p->row[k]] * qd[p->col[k]] * (p->row[k] == p->col[k] ? 0.5 : 1);
    return sum;
}

double kmp_eval_kinetic(kmp_evaluator *eval, const double *qd)
{
    if (has_links(eval))
        (void)kmp_eval_potential(eval, eval->t, eval->q);
    return kinetic_here(eval, qd);
}

void kmp_eval_energies(kmp_evaluator *eval, const double *qd, double *kinetic, double *potential)
{
    *potential = kmp_eval_potential(eval, eval->t, eval->q);
    *kinetic = kinetic_here(eval, qd);
}

/* Stages build on each other: the power's needs the potential's. The power uses the multipliers of the last C. */
double kmp_eval_power(kmp_evaluator *eval, double t, const double *q, const double *qd)
{
    kmp_eval_follow_conditions(eval, &t, q, qd);
    (void)kmp_eval_potential(eval, t, q);
    kmp_machine_set(eval->judge, KMP_IN_QD, qd);
    if (eval->nu)
        kmp_machine_set(eval->judge, KMP_IN_LAMBDA, eval->nu);
    double power = *kmp_eval_run(eval, eval->judge, KMP_STAGE_POWER);
    const double *effort = kmp_eval_effort(eval, t, q, qd);
    for (int i = 0; effort && i < eval->n; i++)
        power += effort[i] * qd[i];
    return power;
}

double kmp_eval_power_here(kmp_evaluator *eval, const double *qd)
{
    if (eval->weighs_only && !eval->by_bodies)
        return kmp_eval_power(eval, eval->t, eval->q, qd);
    const kmp_program *program = kmp_eval_program(eval, eval->by_bodies);
    double power = program->stages > KMP_STAGE_WORKING ? *kmp_eval_run(eval, eval->motion, KMP_STAGE_WORKING) : 0;
    for (int i = 0; eval->system->force && i < eval->n; i++)
        power += eval->outer.effort[i] * qd[i];
    return power;
}

const double *kmp_eval_reactions(kmp_evaluator *eval, double t, const double *q, const double *lambda)
{
    (void)kmp_eval_potential(eval, t, q);
    kmp_machine_set(eval->judge, KMP_IN_LAMBDA, lambda);
    (void)kmp_eval_run(eval, eval->judge, KMP_STAGE_POWER);
    return kmp_eval_run(eval, eval->judge, KMP_STAGE_REACTION);
}

const double *kmp_eval_shown(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                             const double *lambda)
{
    kmp_eval_follow_conditions(eval, &t, q, qd);
    kmp_machine_set(eval->judge, KMP_IN_QD, qd);
    kmp_machine_set(eval->judge, KMP_IN_QDD, qdd);
    (void)kmp_eval_reactions(eval, t, q, lambda);
    (void)kmp_eval_run(eval, eval->judge, KMP_STAGE_POSITION);
    return kmp_eval_run(eval, eval->judge, KMP_STAGE_SHOWN);
}
