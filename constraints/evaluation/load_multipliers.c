/* SPDX-License-Identifier: BSD-3-Clause */
/* Multipliers in forces, by Newton's method with halved steps. Lambda is linear in C, so that its derivative by the few
 * multipliers nu is one solution of the factored system for each. A second solution is looked for from other starts,
 * since friction that grows with a reaction may have two. */
#include "constraints/evaluation/load_multipliers.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "linalg/dense/dense.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { MAX_NEWTON = 30, MAX_HALVINGS = 12 };
/* Least relative decrease of the residual; otherwise the step is halved. */
#define DESCENT 0.1

struct kmp_load_work {
    int count;                /* number of unknowns */
    double *lambda, *changed; /* m */
    double *column;           /* n */
    double *matrix;           /* count x count: dLambda/dnu - 1 */
    double *residual, *step;  /* count: Lambda(nu) - nu */
    double *from;             /* m: nu before the step */
    double *first;            /* m: a solution, while another one is searched */
    int *pivot;
    int worst; /* row of the largest residual when Newton's method failed; -1: it did not */
};

kmp_load_work *kmp_load_work_new(const kempe_system *s, kmp_arena *arena)
{
    kmp_load_work *w = KMP_ARENA_NEW(arena, kmp_load_work, 1);
    size_t count = (size_t)s->load_row_count;
    if (!w)
        return NULL;
    w->count = s->load_row_count;
    w->worst = -1;
    KMP_ARENA_MAKE(arena, KMP_ROOM(double, s->n, &w->column), KMP_ROOM(double, count *count, &w->matrix),
                   KMP_ROOM(int, count, &w->pivot),
                   KMP_ROOM(double, s->m, &w->lambda, &w->changed, &w->from, &w->first));
    return KMP_ARENA_EACH(arena, double, count, &w->residual, &w->step) ? w : NULL;
}

/* -- Newton ------------------------------------------------------------------------------------------ */

/* Distance of nu from Lambda(nu): the largest difference times the scale of its row, an energy; and its part of the
 * terms of the multipliers. Not finite if a value is not. */
typedef struct distance {
    double energy, part;
} distance;

/* Measures at the evaluator's bias. Steps are judged only by the energy: the terms of the part change with nu. */
static distance measure_distance(const kmp_evaluator *eval, const kmp_answer *answer)
{
    const kempe_system *s = eval->system;
    kmp_load_work *w = eval->load;
    double size = 0, worst = 0;
    answer->multipliers(answer->self, eval->bias, false, w->lambda);
    for (int r = 0; r < s->m; r++)
        size = fmax(size, fmax(fabs(w->lambda[r]), fabs(eval->nu[r])) * s->row_scale[r]);
    for (int i = 0; i < s->n; i++)
        size = fmax(size, fabs(eval->bias[i]) * s->scale[i]);
    w->worst = s->load_rows[0];
    for (int k = 0; k < w->count; k++) {
        int r = s->load_rows[k];
        w->residual[k] = w->lambda[r] - eval->nu[r];
        double part = fabs(w->residual[k]) * s->row_scale[r];
        if (!isfinite(part))
            return (distance){INFINITY, INFINITY};
        w->worst = part > worst ? r : w->worst;
        worst = fmax(worst, part);
    }
    return (distance){worst, worst > 0 ? worst / size : 0};
}

bool kmp_load_factor(kmp_evaluator *eval, const kmp_answer *answer)
{
    kmp_load_work *w = eval->load;
    if (!w)
        return true;
    /* dLambda/dnu - 1. */
    const kempe_system *s = eval->system;
    const kmp_pattern *load = &s->load_jacobian;
    for (int k = 0; k < w->count; k++) {
        memset(w->column, 0, (size_t)s->n * sizeof *w->column);
        for (int e = 0; e < load->count; e++)
            if (load->col[e] == s->load_rows[k])
                w->column[load->row[e]] = eval->load_jacobian[e];
        answer->multipliers(answer->self, w->column, true, w->changed);
        for (int i = 0; i < w->count; i++)
            w->matrix[i + k * w->count] = w->changed[s->load_rows[i]] - (i == k);
    }
    return kmp_lu_factor(w->count, w->matrix, w->pivot) == 0;
}

/* step = -(dLambda/dnu - 1)^-1 rhs */
static void solve(kmp_load_work *w)
{
    for (int k = 0; k < w->count; k++)
        w->step[k] = -w->step[k];
    kmp_lu_solve(w->count, w->matrix, w->pivot, 1, w->step);
}

void kmp_load_change(const kmp_evaluator *eval, const kmp_answer *answer, double *bias)
{
    kmp_load_work *w = eval->load;
    if (!w)
        return;
    memcpy(w->column, bias, (size_t)eval->n * sizeof *bias); /* bias may be scratch of the answer */
    answer->multipliers(answer->self, w->column, true, w->changed);
    memcpy(bias, w->column, (size_t)eval->n * sizeof *bias);
    (void)kmp_load_change_with(eval, w->changed, bias);
}

bool kmp_load_change_with(const kmp_evaluator *eval, const double *multipliers, double *bias)
{
    const kempe_system *s = eval->system;
    const kmp_pattern *load = &s->load_jacobian;
    kmp_load_work *w = eval->load;
    if (!w)
        return false;
    for (int k = 0; k < w->count; k++)
        w->step[k] = multipliers[s->load_rows[k]];
    solve(w);
    for (int k = 0; k < w->count; k++)
        w->changed[s->load_rows[k]] = w->step[k];
    for (int e = 0; e < load->count; e++)
        bias[load->row[e]] += eval->load_jacobian[e] * w->changed[load->col[e]];
    return true;
}

bool kmp_load_change_back(const kmp_evaluator *eval, const double *bias, double *multipliers)
{
    const kempe_system *s = eval->system;
    const kmp_pattern *load = &s->load_jacobian;
    const kmp_load_work *w = eval->load;
    bool some = false;
    if (!w)
        return false;
    memset(multipliers, 0, (size_t)s->m * sizeof *multipliers);
    for (int e = 0; e < load->count; e++)
        if (bias[load->row[e]] != 0) { /* a derivative without weight may be none */
            multipliers[load->col[e]] += eval->load_jacobian[e] * bias[load->row[e]];
            some = true;
        }
    if (!some)
        return false;
    for (int k = 0; k < w->count; k++)
        w->step[k] = -multipliers[s->load_rows[k]];
    kmp_lu_solve_transposed(w->count, w->matrix, w->pivot, w->step);
    for (int k = 0; k < w->count; k++)
        multipliers[s->load_rows[k]] = w->step[k];
    return true;
}

/* Takes the step, or the part of it that reduces the residual; false: no part does. */
static bool take_step(kmp_evaluator *eval, const kmp_answer *answer, distance *now)
{
    const kempe_system *s = eval->system;
    kmp_load_work *w = eval->load;
    double part = 1, before = now->energy;
    memcpy(w->from, eval->nu, (size_t)s->m * sizeof *w->from);
    for (int half = 0; half <= MAX_HALVINGS; half++, part /= 2) {
        memset(w->changed, 0, (size_t)s->m * sizeof *w->changed);
        for (int k = 0; k < w->count; k++)
            w->changed[s->load_rows[k]] = w->from[s->load_rows[k]] + part * w->step[k];
        kmp_eval_bias_with(eval, w->changed);
        *now = measure_distance(eval, answer);
        if (now->energy <= (1 - DESCENT * part) * before || (half == 0 && now->part <= KMP_LOAD_ROUNDED))
            return true;
    }
    return false;
}

/* Iterates from the present nu. */
static bool iterate(kmp_evaluator *eval, const kmp_answer *answer)
{
    distance now = measure_distance(eval, answer);
    for (int k = 0; k < MAX_NEWTON; k++) {
        if (now.part <= KMP_LOAD_ROUNDING)
            return true;
        double before = now.energy;
        if (!(before < INFINITY) || !kmp_load_factor(eval, answer))
            return false;
        memcpy(eval->load->step, eval->load->residual, (size_t)eval->load->count * sizeof(double));
        solve(eval->load);
        if (!take_step(eval, answer, &now))
            return false;
        if (now.part <= KMP_LOAD_ROUNDED && !(now.energy < 0.5 * before))
            return true;
    }
    return false;
}

/* Iterates from other multipliers: with the load of no such force, or from zero where C may have no derivative (a root
 * of squares) from the multipliers that follow from C there. */
static bool iterate_from(kmp_evaluator *eval, const kmp_answer *answer, bool loaded)
{
    kmp_load_work *w = eval->load;
    memset(w->changed, 0, (size_t)eval->m * sizeof *w->changed);
    kmp_eval_bias_with(eval, w->changed);
    if (!loaded)
        return iterate(eval, answer);
    answer->multipliers(answer->self, eval->bias, false, w->lambda);
    for (int k = 0; k < w->count; k++)
        w->changed[eval->system->load_rows[k]] = w->lambda[eval->system->load_rows[k]];
    kmp_eval_bias_with(eval, w->changed);
    return iterate(eval, answer);
}

bool kmp_load_settle(kmp_evaluator *eval, const kmp_answer *answer)
{
    kmp_load_work *w = eval->load;
    if (!w)
        return true;
    /* the last solution may be far away */
    bool settled = iterate(eval, answer) || iterate_from(eval, answer, false) || iterate_from(eval, answer, true);
    if (!settled) {
        memset(eval->nu, 0, (size_t)eval->m * sizeof *eval->nu);
        return false;
    }
    w->worst = -1;
    return true;
}

/* True if nu differs from the first solution; the row where it does most. */
static bool is_other(const kmp_evaluator *eval, int *row)
{
    const kempe_system *s = eval->system;
    double size = 0, most = 0;
    for (int k = 0; k < eval->load->count; k++) {
        int r = s->load_rows[k];
        double part = fabs(eval->nu[r] - eval->load->first[r]) * s->row_scale[r];
        size = fmax(size, fmax(fabs(eval->nu[r]), fabs(eval->load->first[r])) * s->row_scale[r]);
        *row = part > most ? r : *row;
        most = fmax(most, part);
    }
    return most > KMP_OTHER_LOAD * size;
}

bool kmp_load_find_other(kmp_evaluator *eval, const kmp_answer *answer, int *row, double *value)
{
    static const double parts[] = {-1, 0, -100, 100};
    kmp_load_work *w = eval->load;
    bool found = false;
    if (!w)
        return false;
    memcpy(w->first, eval->nu, (size_t)eval->m * sizeof *w->first);
    for (size_t k = 0; k < sizeof parts / sizeof *parts && !found; k++) {
        for (int r = 0; r < eval->m; r++)
            w->changed[r] = parts[k] * w->first[r];
        kmp_eval_bias_with(eval, w->changed);
        found = iterate(eval, answer) && is_other(eval, row);
    }
    *value = found ? eval->nu[*row] : 0;
    kmp_eval_bias_with(eval, w->first);
    w->worst = -1;
    return found;
}

void kmp_load_forget(kmp_evaluator *eval)
{
    if (eval->nu)
        memset(eval->nu, 0, (size_t)eval->m * sizeof *eval->nu);
}

/* -- sentences --------------------------------------------------------------------------------------- */

bool kmp_is_unsettled(const kmp_evaluator *eval)
{
    return eval->load && eval->load->worst >= 0;
}

void kmp_put_unsettled(const kmp_evaluator *eval, kmp_text *text)
{
    const kempe_system *s = eval->system;
    int row = eval->load->worst;
    kmp_text_printf(text,
                    "force '%s' depends on the multiplier of constraint equation '%s', and at t = %.9g s no consistent "
                    "value of both is found: reduce the friction, or increase its 'speed'",
                    kmp_load_dependent_force(s, row), s->row_names[row], eval->t);
}

kempe_status kmp_fail_unsettled(const kmp_evaluator *eval)
{
    kmp_text text = {0};
    kmp_put_unsettled(eval, &text);
    return kmp_fail_text(eval->system->context, KEMPE_E_FAILED, &text);
}
