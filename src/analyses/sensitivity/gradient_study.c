/* SPDX-License-Identifier: BSD-3-Clause */
/* Hides how the mechanism moves from one set of parameters and driven coordinates to another: along the straight line
 * between both, in steps of a tangent predictor and Newton's method. Each step is so short that Newton's correction is
 * small relative to the motion: another assembly mode is then out of reach. */
#include "analyses/derivatives/state_sensitivity.h"
#include "analyses/equilibrium/operating.h"
#include "analyses/parts/substep.h"
#include "base/arena.h"
#include "base/memory.h"
#include "constraints/closing/close.h"
#include "constraints/inexact/nearest_exact.h"
#include "dynamics/load_dependent.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/data/variant.h"
#include "model/read/loads.h"
#include <kempe/gradient.h>
#include <math.h>
#include <string.h>

/* The longest step, in sizes of coordinates (angles: rad); Newton's largest correction relative to the motion; the
 * shortest step, relative to the path. */
#define LONGEST    0.5
#define MENDED     0.25
#define LEAST_STEP 1e-7
#define ROUNDING   1e-9

struct kempe_gradient {
    kempe_context *context;
    kmp_arena arena; /* of all arrays */
    kmp_variant *variant;
    kempe_system *system;
    kmp_linear linear;
    kmp_slopes *slopes;
    int n, m, count, driven, shown; /* parameters, driven coordinates, values */
    int states;                     /* they keep their start values, and are the last ones of u */
    bool deep;                      /* values depend on more than q */
    int *order;                     /* position among u of a driven coordinate */
    char **name;                    /* of the values */
    char **parameter;               /* names */
    double *wanted;                 /* count: parameters set */
    double *value; /* driven + count: the current values, driven coordinates by u, and the parameters */
    double *q;     /* n: closed there */
    double *to, *from, *trial, *predicted; /* of the path */
    double *slope;                         /* n x (driven + count): dq by each of them */
    double *rates, *accelerations;         /* driven and states, by u */
    double *start_q, *start_qd, *start_ud; /* derivatives of the start by one parameter: n, n; by u */
    double *part;                          /* 3 m + n: the change of the equations by one parameter */
    double *dqd, *dqdd, *dlambda, *column;
    double *unit; /* driven and states: zeros */
    double *out, *jacobian, *by_driven, *q_jacobian;
};

/* -- the tangent ------------------------------------------------------------------------------------- */

static double *slope_by(const kempe_gradient *g, int k)
{
    return g->slope + (size_t)k * (size_t)g->n;
}

static kmp_instant instant(const kempe_gradient *g)
{
    kmp_instant at = kmp_linear_instant(&g->linear);
    at.q = g->q;
    return at;
}

/* Closes q on its u; the factors and X there. */
static bool close_loops(kempe_gradient *g, double *q)
{
    kmp_reduction *red = &g->linear.red;
    kmp_evaluator *eval = g->linear.eval;
    if (kmp_reduction_close(red, 0, q, NULL, 0))
        return false;
    kmp_eval_closure(eval, 0, q);
    if (kmp_reduction_factor(red))
        return false;
    kmp_reduction_tangent(red);
    return true;
}

/* At g->q, closed and factored: dq by all that may change. */
static void find_slopes(kempe_gradient *g)
{
    kmp_instant at = instant(g);
    kmp_slopes_at(g->slopes, &at);
    memcpy(g->slope, g->linear.red.x, (size_t)(g->n * g->driven) * sizeof *g->slope);
    for (int k = 0; k < g->count; k++) {
        kmp_change change = kmp_slopes_change(g->slopes, k, g->part);
        kmp_spread(&g->linear.red, NULL, change.h, g->linear.work, slope_by(g, g->driven + k));
    }
}

/* -- the path ---------------------------------------------------------------------------------------- */

/* Sets parameters; values that the model rejects are not on the path. */
static bool set_parameters(kempe_gradient *g, const double *values)
{
    if (kmp_linear_vary(&g->linear, g->system, g->variant, values) != KEMPE_OK) {
        kmp_context_clear(g->context);
        return false;
    }
    kmp_slopes_renew_parameters(g->slopes);
    return true;
}

static double distance(const kempe_gradient *g, const double *a, const double *b)
{
    double most = 0;
    for (int i = 0; i < g->n; i++)
        most = fmax(most, fabs(a[i] - b[i]) / g->system->scale[i]);
    return most;
}

/* Moves from the current values to `value`, in one step; false: it is too long. */
static bool step_to(kempe_gradient *g, const double *value)
{
    memcpy(g->predicted, g->q, (size_t)g->n * sizeof *g->q);
    for (int k = 0; k < g->driven + g->count; k++)
        for (int i = 0; i < g->n; i++)
            g->predicted[i] += slope_by(g, k)[i] * (value[k] - g->value[k]);
    for (int k = 0; k < g->driven; k++)
        g->predicted[g->linear.part.u[k]] = value[k];
    if (distance(g, g->predicted, g->q) > LONGEST)
        return false;
    bool ok = !memcmp(value + g->driven, g->value + g->driven, (size_t)g->count * sizeof *value) ||
              set_parameters(g, value + g->driven);
    memcpy(g->trial, g->predicted, (size_t)g->n * sizeof *g->q);
    ok = ok && close_loops(g, g->trial);
    ok = ok && distance(g, g->trial, g->predicted) <= MENDED * distance(g, g->trial, g->q) + ROUNDING;
    if (!ok) {
        (void)set_parameters(g, g->value + g->driven); /* they were valid before */
        return false;
    }
    memcpy(g->q, g->trial, (size_t)g->n * sizeof *g->q);
    memcpy(g->value, value, (size_t)(g->driven + g->count) * sizeof *value);
    find_slopes(g);
    return true;
}

/* Follows the straight path from `from` to `to`; returns the part reached. */
static double lead(kempe_gradient *g)
{
    kmp_adaptive_substeps parts = KMP_PARTS;
    while (kmp_substeps_next(&parts, LEAST_STEP)) {
        for (int k = 0; k < g->driven + g->count; k++)
            g->column[k] = parts.next < 1 ? g->from[k] + parts.next * (g->to[k] - g->from[k]) : g->to[k];
        kmp_substeps_take(&parts, step_to(g, g->column));
    }
    return parts.done;
}

/* -- values ------------------------------------------------------------------------------------------ */

/* A column of a table that has `columns` a row. */
static void put_column(int rows, int columns, int k, const double *column, double *table)
{
    for (int i = 0; i < rows; i++)
        table[(size_t)i * (size_t)columns + (size_t)k] = column[i];
}

/* The change by a parameter, with the change of the states' start values. */
static kmp_change change_by(kempe_gradient *g, int parameter)
{
    kmp_change change = kmp_slopes_change(g->slopes, parameter, g->part);
    if (g->states == 0)
        return change;
    (void)kmp_slopes_of_start(g->slopes, parameter, g->start_q, g->start_qd);
    for (int k = g->driven; k < g->driven + g->states; k++)
        g->start_ud[k] = g->start_qd[g->linear.part.u[k]];
    change.ud = g->start_ud;
    return change;
}

/* The derivative of the values by variable k, a driven coordinate or after them a parameter. */
static void differentiate(kempe_gradient *g, int k)
{
    int parameter = k - g->driven; /* negative: none */
    kmp_direction along = {.q = slope_by(g, k)};
    if (g->deep) {
        kmp_change change = {.u = g->unit};
        if (parameter < 0)
            g->unit[k] = 1;
        else
            change = change_by(g, parameter);
        kmp_linear_follow(&g->linear, &change, &(kmp_response){along.q, g->dqd, g->dqdd, g->dlambda, NULL});
        memset(g->unit, 0, (size_t)g->driven * sizeof *g->unit);
        along = (kmp_direction){NULL, along.q, g->dqd, g->dqdd, g->dlambda, NULL};
    }
    kmp_slopes_along(g->slopes, &g->slopes->outputs, &along, parameter, g->column);
    for (int d = 0; d < g->driven; d++)
        if (g->order[d] == k)
            put_column(g->shown, g->driven, d, g->column, g->by_driven);
    if (parameter >= 0) {
        put_column(g->n, g->count, parameter, along.q, g->q_jacobian);
        put_column(g->shown, g->count, parameter, g->column, g->jacobian);
    }
}

kempe_status kempe_gradient_set(kempe_gradient *gradient, const double *values)
{
    KMP_WANTED(NULL, gradient, "gradient");
    KMP_WANTED(gradient->context, values || gradient->count == 0, "values");
    kmp_text why = {0};
    kmp_context_clear(gradient->context);
    kempe_status status = kmp_variant_set(gradient->variant, values, &why);
    if (status == KEMPE_OK)
        memcpy(gradient->wanted, values, (size_t)gradient->count * sizeof *values);
    else if (status == KEMPE_E_INPUT)
        status = kmp_fail_text(gradient->context, status, &why);
    kmp_text_free(&why);
    (void)kmp_variant_set(gradient->variant, gradient->value + gradient->driven, &why); /* the path begins there */
    kmp_text_free(&why);
    return status;
}

kempe_status kempe_gradient_eval(kempe_gradient *g, const double *driven, const double *rates,
                                 const double *accelerations)
{
    KMP_WANTED(NULL, g, "gradient");
    KMP_WANTED(g->context, driven || g->driven == 0, "driven");
    kmp_model_begin(g->system->model);
    for (int d = 0; d < g->driven; d++) {
        g->to[g->order[d]] = driven[d];
        g->rates[g->order[d]] = rates ? rates[d] : 0;
        g->accelerations[g->order[d]] = accelerations ? accelerations[d] : 0;
        if (!isfinite(driven[d]))
            return kmp_fail(g->context, KEMPE_E_ARGUMENT, "driven coordinate %d is not finite", d + 1);
    }
    memcpy(g->to + g->driven, g->wanted, (size_t)g->count * sizeof *g->to);
    memcpy(g->from, g->value, (size_t)(g->driven + g->count) * sizeof *g->from);
    double *q = g->to + g->driven + g->count;
    memcpy(q, g->q, (size_t)g->n * sizeof *q);
    double done = lead(g);
    if (done == 1) {
        /* Evaluates at the last state, whose dq are known. */
        for (int k = g->driven; k < g->driven + g->states; k++)
            g->rates[k] = g->system->model->start.qd[g->linear.part.u[k]].value;
        if (g->deep && kmp_linear_at(&g->linear, 0, g->q, g->rates, g->accelerations) != KEMPE_OK)
            return kmp_fail(g->context, KEMPE_E_FAILED, "the closures are singular at the requested coordinates");
        kmp_instant at = instant(g);
        if (g->deep)
            kmp_slopes_at(g->slopes, &at);
        const double *shown = kmp_slopes_values(&g->slopes->outputs, &at);
        if (g->shown)
            memcpy(g->out, shown, (size_t)g->shown * sizeof *shown);
        for (int k = 0; k < g->driven + g->count; k++)
            differentiate(g, k);
        return KEMPE_OK;
    }
    kmp_text sentence = {0};
    kmp_text_printf(&sentence,
                    "the loops can be closed for only %.4g %% of the change to the requested coordinates:", 100 * done);
    for (int k = 0; k < g->driven; k++)
        kmp_text_printf(&sentence, "%s %s from %.6g to %.6g ends at %.6g", k ? "," : "",
                        g->system->model->motions[g->linear.part.u[k]].name, g->from[k], g->to[k], g->value[k]);
    kmp_text_put(&sentence, g->count ? ", parameters likewise; there the driven coordinates no longer determine the "
                                       "others: use other lengths, or drive another coordinate"
                                     : "; there the driven coordinates no longer determine the others");
    kempe_status status = kmp_fail_text(g->context, KEMPE_E_FAILED, &sentence);
    /* Restores the earlier state itself, without a path. */
    memcpy(g->value, g->from, (size_t)(g->driven + g->count) * sizeof *g->value);
    memcpy(g->q, q, (size_t)g->n * sizeof *g->q);
    (void)set_parameters(g, g->value + g->driven);
    if (close_loops(g, g->q))
        find_slopes(g);
    return status;
}

/* -- construction ------------------------------------------------------------------------------------ */

static bool make_room(kempe_gradient *g)
{
    int n = g->n, m = g->m, count = g->count, driven = g->driven, shown = g->shown, all = driven + count;
    int p = driven + g->states, with_states = g->states > 0 ? n : 0;
    return KMP_ARENA_MAKE(&g->arena, KMP_ROOM(double, n, &g->q, &g->trial, &g->predicted, &g->dqd, &g->dqdd),
                          KMP_ROOM(double, m, &g->dlambda), KMP_ROOM(double, 3 * m + n, &g->part),
                          KMP_ROOM(double, p, &g->rates, &g->accelerations, &g->unit, &g->start_ud),
                          KMP_ROOM(double, with_states, &g->start_q, &g->start_qd), KMP_ROOM(double, count, &g->wanted),
                          KMP_ROOM(double, all, &g->value, &g->from), KMP_ROOM(double, all + n, &g->to),
                          KMP_ROOM(double, all + n + shown, &g->column), KMP_ROOM(double, n *all, &g->slope),
                          KMP_ROOM(double, shown, &g->out), KMP_ROOM(double, shown *count, &g->jacobian),
                          KMP_ROOM(double, shown *driven, &g->by_driven), KMP_ROOM(double, n *count, &g->q_jacobian),
                          KMP_ROOM(int, driven, &g->order), KMP_ROOM(char *, shown, &g->name));
}

static bool name_values(kempe_gradient *g)
{
    const kempe_model *m = g->system->model;
    int k = 0;
    for (int o = 0; o < m->output_count; o++)
        for (int i = 0; i < kmp_output_rows[m->outputs[o].kind].width; i++) {
            kmp_text text = {0};
            kmp_output_column(&text, m, &m->outputs[o], i);
            g->name[k++] = kmp_text_keep(&text, &g->arena);
        }
    return !g->arena.failed;
}

/* Takes the model as read: assembled, with the driven coordinates as u. */
static kempe_status stand_at(kempe_gradient *g, const int *driven, const kmp_operating *start)
{
    if (start->chart)
        kmp_eval_set_charts(g->linear.eval, start->chart);
    KMP_TRY(kmp_linear_choose(&g->linear, 0, start->inner_q, driven, g->driven));
    if (g->linear.p != g->driven + g->states) {
        const kmp_partition *part = &g->linear.part;
        const int freedoms = part->p - g->states;
        kmp_text sentence = {0};
        kmp_text_printf(&sentence, "the mechanism has %d degree%s of freedom, and %d coordinate%s driven: %s", freedoms,
                        freedoms == 1 ? "" : "s", g->driven, g->driven == 1 ? " is" : "s are", freedoms ? "" : "none");
        for (int k = 0; k < freedoms; k++)
            kmp_text_printf(&sentence, "%s'%s'", k ? ", " : "", g->system->model->motions[part->u[k]].name);
        kmp_text_put(&sentence, " would do");
        return kmp_fail_text(g->context, KEMPE_E_FAILED, &sentence);
    }
    KMP_TRY(kmp_made(g->context, make_room(g) && name_values(g)));
    memcpy(g->q, start->inner_q, (size_t)g->n * sizeof *g->q);
    for (int k = 0; k < g->driven; k++) {
        g->value[k] = g->q[g->linear.part.u[k]];
        for (int d = 0; d < g->driven; d++)
            if (driven[d] == g->linear.part.u[k])
                g->order[d] = k;
    }
    if (close_loops(g, g->q))
        return KEMPE_OK;
    return kmp_fail(g->context, KEMPE_E_FAILED, "the closures are singular at the model's start");
}

static kempe_status make(kempe_gradient *g, const kempe_model *model, const kempe_gradient_options *options)
{
    const kmp_backend *backend = kmp_backend_choose(g->context, options->backend);
    if (!backend)
        return KEMPE_E_ARGUMENT;
    int *driven = KMP_ARENA_NEW(&g->arena, int, model->motion_count);
    kmp_operating *start = NULL;
    g->count = kmp_text_words(&g->arena, options->parameters, &g->parameter);
    KMP_TRY(kmp_made(g->context, !g->arena.failed));
    KMP_TRY(kmp_variant_new(model, g->count, (const char *const *)g->parameter, &g->variant));
    KMP_TRY(kmp_system_of_variant(g->variant, &g->system));
    KMP_TRY(kmp_coordinates_read(g->system->model, "driven", options->driven, driven, &g->driven));
    g->n = g->system->n;
    g->m = g->system->m;
    g->states = g->system->model->state_count;
    KMP_TRY(kmp_linear_init(&g->linear, g->system, backend->name));
    KMP_TRY(kmp_slopes_new(g->system, backend->name, g->count, (const char *const *)g->parameter, true, &g->slopes));
    g->shown = g->slopes->shown;
    const kmp_slope_matrix *x = &g->slopes->outputs;
    g->deep = x->start && x->start[1 + g->n] < x->start[1 + 3 * g->n + g->m];
    KMP_TRY(kmp_operating_new(g->system, "start", NULL, &start));
    kempe_status status = stand_at(g, driven, start);
    kmp_operating_free(start);
    return status;
}

kempe_status kempe_gradient_new(const kempe_model *model, const kempe_gradient_options *options,
                                kempe_gradient **gradient)
{
    KMP_WANTED_BOTH(model, gradient);
    KMP_OPTIONS(model->context, kempe_gradient_options, options);
    kmp_model_begin_forces(model);
    KMP_TRY(kmp_refuse_contacts(model, "gradients at a position"));
    if (kmp_model_start(model)->at && kmp_model_state_count(model) > 0)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "gradients at a position have states at their start values: these are not at an equilibrium "
                        "(start: at) when the position is another one; leave 'at' out");
    KMP_MAKE(model->context, kempe_gradient, g);
    g->context = model->context;
    kempe_status status = make(g, model, options);
    if (status != KEMPE_OK) {
        kempe_gradient_free(g);
        return status;
    }
    for (int k = 0; k < g->count; k++)
        g->wanted[k] = g->value[g->driven + k] =
            g->system->parameters[kmp_parameter_find(g->system->model, g->parameter[k])];
    find_slopes(g);
    *gradient = g;
    return KEMPE_OK;
}

KMP_FREES(kempe_gradient, g, kmp_slopes_free(g->slopes), kmp_linear_free(&g->linear), kempe_system_free(g->system),
          kmp_variant_free(g->variant), kmp_arena_free(&g->arena))

KMP_GETTER(int kempe_gradient_count(const kempe_gradient *gradient), gradient, gradient->shown, 0)
KMP_GETTER_AT(const char *kempe_gradient_name(const kempe_gradient *gradient, int k), gradient, k, gradient->shown,
              gradient->name[k], "")
KMP_GETTER(const double *kempe_gradient_values(const kempe_gradient *gradient), gradient, gradient->out, NULL)
KMP_GETTER(const double *kempe_gradient_jacobian(const kempe_gradient *gradient), gradient, gradient->jacobian, NULL)
KMP_GETTER(const double *kempe_gradient_by_driven(const kempe_gradient *gradient), gradient, gradient->by_driven, NULL)
KMP_GETTER(const double *kempe_gradient_q(const kempe_gradient *gradient), gradient, gradient->q, NULL)
KMP_GETTER(const double *kempe_gradient_q_jacobian(const kempe_gradient *gradient), gradient, gradient->q_jacobian,
           NULL)
