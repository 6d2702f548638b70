/* SPDX-License-Identifier: BSD-3-Clause */
/* Gauss-Newton for h = 0 and x = x_0 of all given coordinates, including the tree's, by steps of least norm, cut to a
 * length and halved until the sum of squares falls. So the guess does not depend on what is cut. Values may contradict
 * the loops: the guess is a compromise, and closing the loops is left to the assembly. */
#include "constraints/closing/cut_start.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "dynamics/goal_equations.h"
#include "linalg/dense/dot.h"
#include "linalg/dense/lapack.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

enum { MOST_STEPS = 60, MOST_HALVINGS = 8 };
#define LONGEST 0.3  /* largest scaled change of a coordinate in one step */
#define ENOUGH  1e-8 /* shorter steps end the search */

typedef struct search {
    const kempe_system *s;
    kmp_evaluator *eval;
    kmp_machine *machine;
    bool rates;
    int n, m, rows;
    double *jacobian, *matrix, *right, *dx, *trial;
    kmp_arena arena;
} search;

static bool is_given(const kmp_cut_coordinate *c, bool rate)
{
    return rate ? c->qd_given : c->q_given;
}

static int count_given(const kempe_model *model, bool rate)
{
    int count = 0;
    for (int k = 0; k < model->cut_coordinate_count; k++)
        count += is_given(&model->cut_coordinates[k], rate);
    return count;
}

static bool begin_search(search *x, const kempe_system *s, kmp_evaluator *eval, bool rates)
{
    const size_t n = (size_t)s->n, rows = (size_t)(s->m + s->model->cut_coordinate_count) + n;
    *x = (search){.s = s, .eval = eval, .rates = rates, .n = s->n, .m = s->m};
    x->rows = x->m + count_given(s->model, rates);
    for (int k = 0; k < x->n; k++)
        x->rows += !rates && s->model->start.q_given[k];
    x->machine = kmp_machine_new(s->goals, kmp_backend_find("tape"));
    KMP_ARENA_MAKE(&x->arena, KMP_ROOM(double, (size_t)s->m *n + 1, &x->jacobian),
                   KMP_ROOM(double, rows *n, &x->matrix), KMP_ROOM(double, rows, &x->right),
                   KMP_ROOM(double, n, &x->dx, &x->trial));
    if (!x->machine || x->arena.failed)
        return false;
    kmp_machine_set(x->machine, KMP_IN_CHART, eval->chart);
    kmp_machine_set(x->machine, KMP_IN_PARAMETER, s->parameters);
    (void)kmp_machine_run(x->machine, 0);
    return true;
}

static void free_search(search *x)
{
    kmp_machine_free(x->machine);
    kmp_arena_free(&x->arena);
}

/* Values of all cut coordinates, then their derivatives along the n coordinates. */
static const double *coordinates_at(search *x, const double *q)
{
    const kempe_model *model = x->s->model;
    const int before = kmp_goals_place_count(model) + kmp_goals_centred_count(model);
    kmp_machine_set(x->machine, KMP_IN_Q, q);
    return kmp_machine_run(x->machine, KMP_STAGE_PLACE) + (size_t)before * (size_t)(1 + x->n);
}

static double error_of(const kmp_cut_coordinate *c, double value)
{
    return c->rotation ? remainder(value - c->q.value, 4 * acos(0)) : value - c->q.value;
}

/* The scaled rows without columns of fixed coordinates, and minus their values, at q, or of rates qd there (else NULL);
 * the norm of the latter. */
static double fill_equations(search *x, const bool *fixed, const double *q, const double *qd)
{
    const kempe_system *s = x->s;
    const double *value = coordinates_at(x, q), *slope = value + s->model->cut_coordinate_count;
    if (!x->rates)
        kmp_eval_closure(x->eval, 0, q);
    kmp_eval_dense_jacobian(x->eval, x->jacobian);
    for (int r = 0; r < x->m; r++) {
        double open = x->rates ? (x->eval->h_t ? x->eval->h_t[r] : 0) : x->eval->h[r];
        for (int k = 0; k < x->n; k++) {
            double entry = x->jacobian[r + k * x->m];
            open += qd ? entry * qd[k] : 0;
            x->matrix[r + k * x->rows] = fixed[k] ? 0 : entry * s->scale[k] / s->row_scale[r];
        }
        x->right[r] = -open / s->row_scale[r];
    }
    int at = x->m;
    for (int i = 0; !x->rates && i < x->n; i++) {
        if (!s->model->start.q_given[i])
            continue;
        for (int k = 0; k < x->n; k++)
            x->matrix[at + k * x->rows] = k == i && !fixed[k];
        x->right[at++] = (s->model->start.q[i].value - q[i]) / s->scale[i];
    }
    for (int i = 0; i < s->model->cut_coordinate_count; i++) {
        const kmp_cut_coordinate *c = &s->model->cut_coordinates[i];
        double size = c->rotation ? 1 : s->length, error = x->rates ? -c->qd.value : error_of(c, value[i]);
        if (!is_given(c, x->rates))
            continue;
        for (int k = 0; k < x->n; k++) {
            error += qd ? slope[i * x->n + k] * qd[k] : 0;
            x->matrix[at + k * x->rows] = fixed[k] ? 0 : slope[i * x->n + k] * s->scale[k] / size;
        }
        x->right[at++] = -error / size;
    }
    return sqrt(kmp_dot(x->rows, x->right, x->right));
}

/* The step of least norm; its largest component, NaN: there is none. */
static double find_step(search *x)
{
    double most = 0;
    if (kmp_least_squares(x->rows, x->n, x->matrix, x->right, KMP_RANK, x->dx) < 0)
        x->arena.failed = true;
    for (int k = 0; k < x->n; k++)
        most = fmax(most, fabs(x->dx[k]));
    return x->arena.failed || !isfinite(most) ? NAN : most;
}

static bool step(search *x, const bool *hold, double *q)
{
    double before = fill_equations(x, hold, q, NULL), size = find_step(x), part = size > LONGEST ? LONGEST / size : 1;
    for (int k = 0; size > ENOUGH && k < MOST_HALVINGS; k++, part /= 2) {
        for (int i = 0; i < x->n; i++)
            x->trial[i] = q[i] + part * x->dx[i] * x->s->scale[i];
        if (fill_equations(x, hold, x->trial, NULL) < before) {
            memcpy(q, x->trial, (size_t)x->n * sizeof *q);
            return true;
        }
    }
    return false;
}

bool kmp_cut_start_guess(const kempe_system *system, const bool *hold, double *q)
{
    search x;
    if (count_given(system->model, false) == 0)
        return true;
    kmp_evaluator *eval = kmp_eval_new_of_closures(system);
    bool ok = eval && begin_search(&x, system, eval, false);
    for (int k = 0; ok && k < MOST_STEPS && step(&x, hold, q); k++)
        ok = !x.arena.failed;
    if (eval)
        free_search(&x);
    kmp_eval_free(eval);
    return ok;
}

bool kmp_cut_start_rates(kmp_evaluator *eval, const bool *fixed, const double *q, double *qd)
{
    search x;
    if (count_given(eval->system->model, true) == 0)
        return true;
    bool ok = begin_search(&x, eval->system, eval, true);
    if (ok && fill_equations(&x, fixed, q, qd) > 0 && find_step(&x) > 0)
        for (int k = 0; k < x.n; k++)
            qd[k] += x.dx[k] * x.s->scale[k];
    ok = ok && !x.arena.failed;
    free_search(&x);
    return ok;
}

int kmp_cut_start_missed(const kempe_system *system, const double *q, const double *qd, bool *rate, double *value)
{
    const kempe_model *model = system->model;
    search x;
    int worst = -1;
    if (count_given(model, false) + count_given(model, true) == 0)
        return -1;
    kmp_evaluator *eval = kmp_eval_new_of_closures(system);
    bool ok = eval && begin_search(&x, system, eval, false);
    const double fastest = eval ? kmp_eval_size(eval, qd) : 0, *at = ok ? coordinates_at(&x, q) : NULL,
                 *slope = at ? at + model->cut_coordinate_count : NULL;
    for (int i = 0; ok && i < model->cut_coordinate_count; i++) {
        const kmp_cut_coordinate *c = &model->cut_coordinates[i];
        double speed = kmp_dot(x.n, slope + i * x.n, qd);
        bool far = c->q_given && c->rotation && fabs(error_of(c, at[i])) > acos(0);
        double size = fmax(fastest * (c->rotation ? 1 : system->length), fabs(c->qd.value));
        bool other = c->qd_given && fabs(speed - c->qd.value) > KMP_CLOSED_RATES * size;
        if (!far && !other)
            continue;
        worst = i;
        *rate = !far;
        *value = far ? at[i] : speed;
    }
    if (eval)
        free_search(&x);
    kmp_eval_free(eval);
    return ok ? worst : -2;
}
