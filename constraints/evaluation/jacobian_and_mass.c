/* SPDX-License-Identifier: BSD-3-Clause */
/* Products with J and M, and dense copies of them, from the entries that the last evaluation gave. Entries are stored
 * by the patterns of the system: J in row-major order, M by its lower triangle. */
#include "constraints/evaluation/jacobian_and_mass.h"
#include "model/data/model.h"
#include <string.h>

void kmp_eval_mask(const kmp_evaluator *eval, const bool *left_out, double *masked)
{
    const kmp_pattern *j = &eval->system->jacobian;
    for (int e = 0; e < j->count; e++)
        masked[e] = left_out[j->row[e]] ? 0 : eval->jacobian[e];
}

void kmp_eval_dense_jacobian(const kmp_evaluator *eval, double *jacobian)
{
    const kmp_pattern *p = &eval->system->jacobian;
    memset(jacobian, 0, (size_t)(eval->m * eval->n) * sizeof *jacobian);
    for (int k = 0; k < p->count; k++)
        jacobian[p->row[k] + p->col[k] * eval->m] = eval->jacobian[k];
}

void kmp_eval_rates(const kmp_evaluator *eval, const double *qd, double *rates)
{
    const kmp_pattern *p = &eval->system->jacobian;
    for (int r = 0; r < eval->m; r++)
        rates[r] = eval->h_t ? eval->h_t[r] : 0;
    for (int k = 0; k < p->count; k++)
        rates[p->row[k]] += eval->jacobian[k] * qd[p->col[k]];
}

double kmp_eval_drive_power(const kmp_evaluator *eval, const double *lambda)
{
    double power = 0;
    for (int r = 0; eval->h_t && r < eval->m; r++)
        power -= lambda[r] * eval->h_t[r];
    return power;
}

void kmp_eval_dense_mass(const kmp_evaluator *eval, double *mass)
{
    const kmp_pattern *p = &eval->system->mass;
    int n = eval->n;
    memset(mass, 0, (size_t)(n * n) * sizeof *mass);
    for (int k = 0; k < p->count; k++)
        mass[p->row[k] + p->col[k] * n] = mass[p->col[k] + p->row[k] * n] = eval->mass[k];
}

void kmp_eval_add_mass_times(const kmp_evaluator *eval, const double *x, double *out)
{
    const kmp_pattern *m = &eval->system->mass;
    for (int k = 0; k < m->count; k++) {
        int i = m->row[k], j = m->col[k];
        out[i] += eval->mass[k] * x[j];
        if (i != j)
            out[j] += eval->mass[k] * x[i];
    }
}

double kmp_eval_kinetic(const kmp_evaluator *eval, const double *qd)
{
    const kmp_pattern *p = &eval->system->mass;
    int coordinates = kmp_model_coordinates(eval->system->model);
    double sum = 0;
    for (int k = 0; k < p->count && p->row[k] < coordinates; k++)
        sum += eval->mass[k] * qd[p->row[k]] * qd[p->col[k]] * (p->row[k] == p->col[k] ? 0.5 : 1);
    return sum;
}
