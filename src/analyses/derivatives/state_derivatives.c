/* SPDX-License-Identifier: BSD-3-Clause */
/* Exact derivatives of accelerations and multipliers at a state of the public workspace, by the implicit-function
 * theorem on M qdd + C = Q + J' lambda and J qdd + jdqd = 0: each direction is one more solution with the factors of
 * the state. Along closed motions the change of all coordinates follows the change of the independent ones first
 * (constraints/partition/small_change.h). */
#include "analyses/derivatives/state_derivatives.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/partition/small_change.h"
#include "linalg/dense/dot.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/requests.h"
#include <string.h>

/* -- preparation ------------------------------------------------------------------------------------- */

static void release_names(kmp_state_derivatives *d)
{
    kmp_derivatives_release_hessians(d);
    kmp_derivative_lanes_forget(&d->many);
    kmp_slopes_free(d->slopes);
    kempe_system_free(d->varied);
    kmp_variant_free(d->variant);
    kmp_arena_free(&d->output_arena);
    d->slopes = NULL, d->varied = NULL, d->variant = NULL, d->names = 0, d->name = NULL, d->outputs = 0;
}

static void free_derivatives(void *self)
{
    kmp_state_derivatives *d = self;
    release_names(d);
    kmp_derivative_lanes_free(&d->many);
    kmp_direction_lanes_free(&d->lanes);
    kmp_tangents_free(&d->tangents);
    kmp_second_derivatives_free(&d->second);
    kmp_arena_free(&d->arena);
    kmp_free(d);
}

static kempe_status add_tangents(kempe_workspace *ws)
{
    const kempe_system *s = ws->system;
    const int n = ws->n, m = ws->m;
    KMP_MAKE(s->context, kmp_state_derivatives, d);
    ws->derivatives = (kmp_workspace_part){d, free_derivatives};
    KMP_TRY(kmp_made(s->context,
                     KMP_ARENA_MAKE(&d->arena,
                                    KMP_ROOM(double, n, &d->unit, &d->force, &d->x, &d->dq, &d->dqd, &d->x_before),
                                    KMP_ROOM(double, m, &d->curve, &d->a, &d->a_before),
                                    KMP_ROOM(double, KMP_FOLLOW_ROOM(n, m), &d->room),
                                    KMP_ROOM(double, 3 * m + n, &d->part, &d->sum)) &&
                         kmp_direction_lanes_init(&d->lanes, n, m, ws->chosen ? &ws->red : NULL)));
    return kmp_tangents_init(&d->tangents, s, ws->eval->backend, kmp_tangents_of_runs(s));
}

static bool is_input(const kempe_model *model, const char *name)
{
    for (int k = 0; k < model->input_count; k++)
        if (strcmp(model->inputs[k].name, name) == 0)
            return true;
    return false;
}

/* Coordinates, their rates and accelerations, and multipliers are columns of a result, but no outputs here. */
static kempe_status refuse_column(kempe_workspace *ws, const kempe_model *copy, const kmp_output *output)
{
    kmp_text name = {0};
    kmp_output_print(&name, copy, output);
    if (output->kind != KMP_OUTPUT_LAMBDA)
        (void)kmp_workspace_fail(ws,
                                 "output '%s': values of coordinates have their derivatives in q_u, qd_u and qdd_q; "
                                 "request other outputs",
                                 name.s);
    else if (copy->closure_count == 0)
        (void)kmp_workspace_fail(ws, "output '%s': the model has no closures, and no multipliers", name.s);
    else {
        const char *closure = copy->closures[output->index < 0 ? 0 : output->index].name;
        (void)kmp_workspace_fail(ws,
                                 "output '%s': multipliers have their derivatives in lambda_q, lambda_qd, lambda_Q and "
                                 "lambda_p; along closed motions, add a sensor to the model whose value is "
                                 "lambda(%s.1), and request sensor(NAME)",
                                 name.s, closure);
    }
    kmp_text_free(&name);
    return KEMPE_E_ARGUMENT;
}

/* Lists the values of the outputs that the words request, in the order of the model's copy, and names them. */
static kempe_status list_outputs(kempe_workspace *ws, kmp_state_derivatives *d, kempe_model *copy, const char *words)
{
    unsigned *parts = NULL;
    copy->output_count = 0;
    KMP_TRY(kmp_requested_outputs(copy, words, &parts));
    int all = 0;
    for (int k = 0; k < copy->output_count; k++)
        all += kmp_output_width(copy, &copy->outputs[k]);
    d->shown = KMP_ARENA_NEW(&d->output_arena, int, all);
    d->output_name = KMP_ARENA_NEW(&d->output_arena, const char *, all);
    d->values = KMP_ARENA_NEW(&d->output_arena, double, all);
    for (int k = 0, first = 0; k < copy->output_count && !d->output_arena.failed; k++) {
        const int width = kmp_output_width(copy, &copy->outputs[k]);
        for (int i = 0; i < width; i++) {
            kmp_text name = {0};
            if (!(parts[k] & 1u << i))
                continue;
            kmp_output_column(&name, copy, &copy->outputs[k], i);
            d->output_name[d->outputs] = kmp_text_keep(&name, &d->output_arena);
            d->shown[d->outputs++] = first + i;
        }
        first += width;
        if (width == 0)
            return refuse_column(ws, copy, &copy->outputs[k]);
    }
    return kmp_made(ws->system->context, !d->output_arena.failed);
}

/* A system in which the parameters among the names vary, with the coordinates, rows and conditions of the workspace,
 * and with the outputs. */
static kempe_status vary(kempe_workspace *ws, kmp_state_derivatives *d, int count, const char *const *names,
                         const char *outputs)
{
    const kempe_system *s = ws->system;
    const char **parameter = KMP_NEW(const char *, count + 1);
    kempe_status status = kmp_made(s->context, parameter);
    int parameters = 0;
    for (int k = 0; parameter && k < count; k++)
        if (!is_input(s->model, names[k]))
            parameter[parameters++] = names[k];
    const bool copies = parameters > 0 || outputs;
    if (status == KEMPE_OK && copies)
        status = kmp_variant_new(s->model, parameters, parameter, &d->variant);
    if (status == KEMPE_OK && outputs)
        status = list_outputs(ws, d, kmp_variant_model(d->variant), outputs);
    if (status == KEMPE_OK && copies)
        status = kmp_system_of_variant(d->variant, &d->varied);
    if (status == KEMPE_OK && d->varied &&
        (d->varied->n != s->n || d->varied->m != s->m || d->varied->events.count != s->events.count))
        status = parameters > 0 ? kmp_fail(s->context, KEMPE_E_ARGUMENT,
                                           "derivatives by '%s' do not exist: conditions or constraint equations of "
                                           "the model depend on its value",
                                           parameter[0])
                                : kmp_fail(s->context, KEMPE_E_ARGUMENT,
                                           "derivatives of '%s' do not exist: these outputs have conditions of their "
                                           "own, which the equations of motion do not have",
                                           outputs);
    kmp_free(parameter);
    return status;
}

static kempe_status add_names(kempe_workspace *ws, int count, const char *const *names, const char *outputs)
{
    const kempe_system *s = ws->system;
    kmp_state_derivatives *d = ws->derivatives.self;
    release_names(d);
    for (int k = 0; k < count; k++)
        for (int before = 0; before <= k; before++)
            if (!names[k] || (before < k && strcmp(names[before], names[k]) == 0))
                return KMP_WORKSPACE_REFUSE(ws, names[k] ? "'%s' is given twice" : "a name is NULL", names[k]);
    const bool more = count > 0 || outputs;
    d->name = KMP_ARENA_NEW(&d->output_arena, const char *, count);
    for (int k = 0; d->name && k < count; k++)
        d->name[k] = kmp_arena_strdup(&d->output_arena, names[k]);
    kempe_status status = kmp_made(s->context, !d->output_arena.failed);
    if (status == KEMPE_OK && more)
        status = vary(ws, d, count, names, outputs);
    if (status == KEMPE_OK && more)
        status = kmp_slopes_new(d->varied ? d->varied : s, ws->eval->backend->name, count, names, outputs != NULL,
                                &d->slopes);
    if (status != KEMPE_OK) {
        release_names(d);
        if (ws->message[0] == '\0')
            (void)kmp_workspace_fail(ws, "%s", kempe_context_message(s->context));
        return status;
    }
    d->names = count;
    return KEMPE_OK;
}

kempe_status kempe_workspace_add_derivatives(kempe_workspace *ws, int count, const char *const *names,
                                             const char *outputs)
{
    KMP_WANTED(NULL, ws, "workspace");
    ws->message[0] = '\0';
    kmp_context_clear(ws->system->context);
    if (count < 0 || (count > 0 && !kmp_workspace_given(ws, "names", names)))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_require_decisions(ws, "derivatives of the equations of motion"));
    if (!ws->derivatives.self) {
        const kempe_status status = add_tangents(ws);
        if (status != KEMPE_OK && ws->derivatives.self) {
            free_derivatives(ws->derivatives.self);
            ws->derivatives.self = NULL;
        }
        KMP_TRY(status);
    }
    return add_names(ws, count, names, outputs);
}

kempe_status kmp_derivatives_prepared(kempe_workspace *ws)
{
    if (ws->derivatives.self)
        return KEMPE_OK;
    return KMP_WORKSPACE_REFUSE(ws, "derivatives are not prepared: call kempe_workspace_add_derivatives first");
}

int kempe_workspace_name_count(const kempe_workspace *ws)
{
    const kmp_state_derivatives *d = ws ? ws->derivatives.self : NULL;
    return d ? d->names : 0;
}

int kempe_workspace_output_count(const kempe_workspace *ws)
{
    const kmp_state_derivatives *d = ws ? ws->derivatives.self : NULL;
    return d ? d->outputs : 0;
}

const char *kempe_workspace_output_name(const kempe_workspace *ws, int k)
{
    const kmp_state_derivatives *d = ws ? ws->derivatives.self : NULL;
    return d && k >= 0 && k < d->outputs ? d->output_name[k] : NULL;
}

/* -- the response to a small change ---------------------------------------------------------------- */

/* The change of the equations by all names, one after another as kmp_slopes_change has it. */
static kmp_change change_by_names(kmp_state_derivatives *d, const kmp_state_change *change)
{
    const int m = d->tangents.m, size = 3 * m + d->tangents.n;
    memset(d->sum, 0, (size_t)size * sizeof *d->sum);
    for (int k = 0; k < d->names; k++) {
        const double by = change->names ? change->names[k] : k == change->name;
        if (by == 0)
            continue;
        (void)kmp_slopes_change(d->slopes, k, d->part);
        for (int i = 0; i < size; i++)
            d->sum[i] += by * d->part[i];
    }
    return (kmp_change){.h = d->sum, .rate = d->sum + m, .curve = d->sum + 2 * m, .force = d->sum + 3 * m};
}

void kmp_derivatives_respond(kempe_workspace *ws, const kmp_derivative_point *point, const kmp_state_change *change)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    const kmp_change by_names = change_by_names(d, change);
    memcpy(d->force, by_names.force, (size_t)ws->n * sizeof *d->force);
    memcpy(d->curve, by_names.curve, (size_t)ws->m * sizeof *d->curve);
    if (change->q) {
        kmp_tangents_add(&d->tangents, KMP_R_Q, point->tangents, 1, change->q, d->force);
        kmp_tangents_add(&d->tangents, KMP_CURVE_Q, point->tangents, 1, change->q, d->curve);
    }
    if (change->qd) {
        kmp_tangents_add(&d->tangents, KMP_R_QD, point->tangents, 1, change->qd, d->force);
        kmp_tangents_add(&d->tangents, KMP_CURVE_QD, point->tangents, 1, change->qd, d->curve);
    }
    for (int i = 0; change->Q && i < ws->n; i++)
        d->force[i] -= change->Q[i];
    kmp_derivatives_answer(ws, point);
}

void kmp_derivatives_answer(kempe_workspace *ws, const kmp_derivative_point *point)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    kmp_derivatives_solve(ws, point);
    if (kmp_load_change_with(ws->eval, d->a, d->force))
        kmp_derivatives_solve(ws, point);
}

void kmp_derivatives_solve(kempe_workspace *ws, const kmp_derivative_point *point)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    if (point->reduced)
        kmp_reduction_solve_saddle(&ws->red, d->force, d->curve, d->x, d->a);
    else
        kmp_saddle_solve(&ws->saddle, d->force, d->curve, d->x, d->a);
}

void kmp_derivatives_of_outputs(kempe_workspace *ws, const kmp_state_change *change, double *y)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    if (!y || d->outputs == 0)
        return;
    kmp_slopes_along(d->slopes, &d->slopes->outputs,
                     &(kmp_direction){.q = (double *)change->q,
                                      .qd = (double *)change->qd,
                                      .qdd = d->x,
                                      .lambda = d->a,
                                      .parameters = (double *)change->names},
                     change->name, d->values);
    for (int k = 0; k < d->outputs; k++)
        y[k] = d->values[d->shown[k]];
}

void kmp_derivatives_outputs(const kempe_workspace *ws, const kmp_derivative_point *point, double *y)
{
    const kmp_state_derivatives *d = ws->derivatives.self;
    for (int k = 0; y && k < d->outputs; k++)
        y[k] = point->shown[d->shown[k]];
}

static void take_independent(const kempe_workspace *ws, double *udd)
{
    const kmp_state_derivatives *d = ws->derivatives.self;
    for (int k = 0; k < ws->part.p; k++)
        udd[k] = d->x[ws->part.u[k]];
}

void kmp_derivatives_follow(kempe_workspace *ws, const kmp_derivative_point *point, const double *u, const double *ud,
                            const kmp_state_change *names, double *udd)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    kmp_change change = change_by_names(d, names);
    change.u = u;
    change.ud = ud;
    kmp_follow(&ws->red, &d->tangents, point->tangents, false, &change,
               &(kmp_response){.q = d->dq, .qd = d->dqd, .residual = point->reduced ? udd : NULL}, d->room);
    if (!udd)
        return;
    if (!point->reduced) { /* rows of friction and contacts hold, too, or forces depend on multipliers */
        kmp_derivatives_respond(ws, point, &(kmp_state_change){d->dq, d->dqd, NULL, names->names, names->name});
        take_independent(ws, udd);
        return;
    }
    /* udd from the change of the reduced residual in it. */
    for (int k = 0; k < ws->part.p; k++)
        udd[k] = -udd[k];
    kmp_reduction_solve_mass(&ws->red, udd);
}

/* -- matrices ---------------------------------------------------------------------------------------- */

/* Kinds of changes: of all coordinates, of their rates, of forces, of the names; along closed motions, of the
 * independent coordinates, of their rates, and of the names. */
enum { BY_Q, BY_QD, BY_EFFORT, BY_NAME, BY_U, BY_UD, BY_NAME_CLOSED, KINDS };

/* Matrices of accelerations, multipliers and outputs by one kind of change, of `count` columns. Along closed motions
 * accelerations are the independent ones, and qd is the change of the rates. NULL: not wanted. */
typedef struct columns_by {
    int kind, count;
    double *accelerations, *lambda, *y, *q, *qd;
} columns_by;

/* Lanes [lane, end) of a group belong to columns of one kind, the first of them number `column`. */
typedef struct lanes_of {
    const columns_by *by;
    int lane, end, column;
} lanes_of;

static void add_to_lane(int count, const double *values, ptrdiff_t width, int lane, double *rows)
{
    for (int i = 0; i < count; i++)
        rows[i * width + lane] += values[i];
}

/* The change of the equations along the column of a lane. */
static void change_lane(kempe_workspace *ws, const kmp_derivative_point *point, int kind, int column, int lane)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    kmp_direction_lanes *x = &d->lanes;
    if (kind == BY_Q || kind == BY_QD) {
        const bool rates = kind == BY_QD;
        kmp_direction_lanes_add_column(x, &d->tangents, rates ? KMP_R_QD : KMP_R_Q, point->tangents, column, lane,
                                       x->force);
        kmp_direction_lanes_add_column(x, &d->tangents, rates ? KMP_CURVE_QD : KMP_CURVE_Q, point->tangents, column,
                                       lane, x->curve);
    } else if (kind == BY_EFFORT)
        x->force[column * x->width + lane] -= 1;
    else if (kind == BY_U)
        x->u[lane] = column;
    else if (kind == BY_UD)
        x->ud[lane] = column;
    else {
        const kmp_change change = kmp_slopes_change(d->slopes, column, d->part);
        add_to_lane(ws->n, change.force, x->width, lane, x->force);
        add_to_lane(ws->m, change.curve, x->width, lane, x->curve);
        if (kind == BY_NAME_CLOSED) {
            add_to_lane(ws->m, change.h, x->width, lane, x->h);
            add_to_lane(ws->m, change.rate, x->width, lane, x->rate);
        }
    }
}

/* Solves with the factors of the saddle system, one direction after another. */
static void solve_saddles(kempe_workspace *ws, const kmp_derivative_point *point, int count)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    kmp_direction_lanes *x = &d->lanes;
    for (int l = 0; l < count; l++) {
        for (int i = 0; i < ws->n; i++)
            d->force[i] = x->force[i * x->width + l];
        for (int i = 0; i < ws->m; i++)
            d->curve[i] = x->curve[i * x->width + l];
        kmp_derivatives_answer(ws, point);
        for (int i = 0; i < ws->n; i++)
            x->qdd[i * x->width + l] = d->x[i];
        for (int k = 0; k < x->p; k++)
            x->udd[k * x->width + l] = d->x[ws->part.u[x->order[k]]];
        for (int i = 0; i < ws->m; i++)
            x->lambda[i * x->width + l] = d->a[i];
    }
}

/* Changes of the outputs along the columns of some lanes. */
static void put_outputs(kempe_workspace *ws, const lanes_of *of, bool closed)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    const kmp_direction_lanes *x = &d->lanes;
    const int n = ws->n, kind = of->by->kind;
    const bool named = kind == BY_NAME || kind == BY_NAME_CLOSED;
    for (int l = of->lane; l < of->end; l++) {
        const int column = of->column + l - of->lane;
        const kmp_state_change change = {.q = closed         ? kind == BY_UD ? NULL : d->dq
                                              : kind == BY_Q ? d->unit
                                                             : NULL,
                                         .qd = closed          ? d->dqd
                                               : kind == BY_QD ? d->unit
                                                               : NULL,
                                         .name = named ? column : -1};
        if (closed) {
            kmp_direction_lanes_put(x, n, NULL, x->dq, l, 1, d->dq);
            kmp_direction_lanes_put(x, n, NULL, x->dqd, l, 1, d->dqd);
        }
        kmp_direction_lanes_put(x, n, NULL, x->qdd, l, 1, d->x);
        kmp_direction_lanes_put(x, ws->m, NULL, x->lambda, l, 1, d->a);
        d->unit[named ? 0 : column] = 1;
        kmp_derivatives_of_outputs(ws, &change, kmp_row_at(of->by->y, d->outputs, column));
        d->unit[named ? 0 : column] = 0;
    }
}

static void put_lanes(kempe_workspace *ws, const lanes_of *of, bool closed)
{
    const kmp_state_derivatives *d = ws->derivatives.self;
    const kmp_direction_lanes *x = &d->lanes;
    const columns_by *by = of->by;
    const int n = ws->n, m = ws->m, p = ws->part.p, count = of->end - of->lane, column = of->column;
    if (by->accelerations && closed)
        kmp_direction_lanes_put(x, p, x->place, x->udd, of->lane, count, kmp_row_at(by->accelerations, p, column));
    else if (by->accelerations)
        kmp_direction_lanes_put(x, n, NULL, x->qdd, of->lane, count, kmp_row_at(by->accelerations, n, column));
    if (by->lambda && m > 0)
        kmp_direction_lanes_put(x, m, NULL, x->lambda, of->lane, count, kmp_row_at(by->lambda, m, column));
    if (by->q)
        kmp_direction_lanes_put(x, n, NULL, x->dq, of->lane, count, kmp_row_at(by->q, n, column));
    if (by->qd)
        kmp_direction_lanes_put(x, n, NULL, x->dqd, of->lane, count, kmp_row_at(by->qd, n, column));
    if (by->y)
        put_outputs(ws, of, closed);
}

/* Derives the columns of some kinds, in groups of lanes. */
static void derive_columns(kempe_workspace *ws, const kmp_derivative_point *point, int kinds, const columns_by *by,
                           bool closed)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    int left = 0, kind = 0, column = 0;
    bool pulls = !point->reduced;
    for (int k = 0; k < kinds; k++) {
        left += by[k].count;
        pulls = pulls || by[k].lambda || by[k].y;
    }
    while (left > 0) {
        const int count = left < KMP_DIRECTIONS ? left : KMP_DIRECTIONS;
        lanes_of of[KINDS];
        int parts = 0;
        bool bends = closed;
        kmp_direction_lanes_begin(&d->lanes, count, closed);
        for (int l = 0; l < count; l++) {
            while (column == by[kind].count) {
                kind++;
                column = 0;
            }
            if (l == 0 || column == 0)
                of[parts++] = (lanes_of){&by[kind], l, l, column};
            of[parts - 1].end = l + 1;
            bends = bends || by[kind].kind != BY_EFFORT;
            change_lane(ws, point, by[kind].kind, column++, l);
        }
        if (closed)
            kmp_direction_lanes_follow(&d->lanes, &d->tangents, point->tangents);
        if (point->reduced)
            kmp_direction_lanes_solve(&d->lanes, bends, pulls);
        else
            solve_saddles(ws, point, count);
        for (int k = 0; k < parts; k++)
            put_lanes(ws, &of[k], closed);
        left -= count;
    }
}

static void derive_all(kempe_workspace *ws, const kmp_derivative_point *point, const kempe_workspace_derivatives *out)
{
    const kmp_state_derivatives *d = ws->derivatives.self;
    columns_by by[] = {{BY_Q, ws->n, out->qdd_q, out->lambda_q, out->y_q, NULL, NULL},
                       {BY_QD, ws->n, out->qdd_qd, out->lambda_qd, out->y_qd, NULL, NULL},
                       {BY_EFFORT, ws->n, out->qdd_Q, out->lambda_Q, out->y_Q, NULL, NULL},
                       {BY_NAME, d->names, out->qdd_p, out->lambda_p, out->y_p, NULL, NULL}};
    for (int k = 0; k < 4; k++) {
        by[k].y = d->outputs > 0 ? by[k].y : NULL;
        if (!by[k].accelerations && !by[k].lambda && !by[k].y)
            by[k].count = 0;
    }
    derive_columns(ws, point, 4, by, false);
}

static void derive_closed(kempe_workspace *ws, const kmp_derivative_point *point,
                          const kempe_workspace_derivatives *out)
{
    kmp_state_derivatives *d = ws->derivatives.self;
    const int n = ws->n, p = ws->part.p;
    if (out->q_u && p > 0)
        memcpy(out->q_u, ws->red.x, (size_t)n * (size_t)p * sizeof *out->q_u);
    columns_by by[] = {{BY_U, p, out->udd_u, NULL, out->y_u, NULL, out->qd_u},
                       {BY_UD, p, out->udd_ud, NULL, out->y_ud, NULL, NULL},
                       {BY_NAME_CLOSED, d->names, out->udd_p, NULL, out->y_up, out->q_p, out->qd_p}};
    for (int k = 0; k < 3; k++) {
        by[k].y = d->outputs > 0 ? by[k].y : NULL;
        if (!by[k].accelerations && !by[k].q && !by[k].qd && !by[k].y)
            by[k].count = 0;
    }
    derive_columns(ws, point, 3, by, true);
    for (int j = 0; out->udd_Q && !point->reduced && j < n; j++) {
        d->unit[j] = 1;
        kmp_derivatives_respond(ws, point, &(kmp_state_change){.Q = d->unit, .name = -1});
        take_independent(ws, kmp_row_at(out->udd_Q, p, j));
        d->unit[j] = 0;
    }
    for (int j = 0; out->udd_Q && point->reduced && j < n; j += KMP_DIRECTIONS) {
        const int count = n - j < KMP_DIRECTIONS ? n - j : KMP_DIRECTIONS;
        kmp_direction_lanes_begin(&d->lanes, count, false);
        kmp_direction_lanes_press(&d->lanes, j, count);
        kmp_direction_lanes_put(&d->lanes, p, d->lanes.place, d->lanes.udd, 0, count, kmp_row_at(out->udd_Q, p, j));
    }
}

/* -- the calls --------------------------------------------------------------------------------------- */

kempe_status kmp_derivative_point_take(kempe_workspace *ws, double t, const double *q, const double *qd,
                                       const double *Q, bool closed, kmp_derivative_point *point)
{
    KMP_TRY(kmp_derivatives_prepared(ws));
    KMP_TRY(kmp_workspace_check_time(ws, t));
    kmp_state_derivatives *d = ws->derivatives.self;
    *point = (kmp_derivative_point){.shown = NULL};
    KMP_TRY(kmp_workspace_solve(ws, t, q, qd, Q, &point->reduced));
    if (!point->reduced && !kmp_saddle_load_factor(&ws->saddle))
        return kmp_workspace_fail(ws,
                                  "derivatives do not exist at t = %.9g s: forces that depend on multipliers have no "
                                  "derivative there, or no unique one",
                                  t);
    if (closed && !point->reduced && !kmp_workspace_follows_loops(ws))
        return kmp_workspace_fail(
            ws,
            "derivatives by the independent coordinates do not exist at t = %.9g s, because these coordinates "
            "do not describe the motion there: take the derivatives by all coordinates",
            t);
    if (closed)
        KMP_TRY(kmp_workspace_require_closed(ws, "derivatives along closed motions", t));
    const kmp_instant at = kmp_instant_of(ws->eval, t, ws->q, ws->qd, ws->answer, ws->answer + ws->n);
    point->tangents = kmp_tangents_derivatives(&d->tangents, &at);
    if (d->names > 0)
        kmp_slopes_at(d->slopes, &at);
    if (d->outputs > 0)
        point->shown = kmp_slopes_values(&d->slopes->outputs, &at);
    return KEMPE_OK;
}

static bool wants_closed(const kempe_workspace_derivatives *out)
{
    return out->udd_u || out->udd_ud || out->udd_Q || out->q_u || out->qd_u || out->udd_p || out->q_p || out->qd_p ||
           out->y_u || out->y_ud || out->y_up;
}

/* All that is wanted at a point that was taken. */
static void put_derivatives(kempe_workspace *ws, const kmp_derivative_point *point, double *qdd, double *lambda,
                            const kempe_workspace_derivatives *out)
{
    derive_all(ws, point, out);
    if (wants_closed(out))
        derive_closed(ws, point, out);
    kmp_derivatives_outputs(ws, point, out->y);
    kmp_workspace_put_answer(ws, qdd, lambda);
}

kempe_status kempe_workspace_forward_derivatives(kempe_workspace *ws, double t, const double *q, const double *qd,
                                                 const double *Q, double *qdd, double *lambda,
                                                 const kempe_workspace_derivatives *out)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd) || !kmp_workspace_given(ws, "out", out))
        return KEMPE_E_ARGUMENT;
    kmp_derivative_point point;
    KMP_TRY(kmp_derivative_point_take(ws, t, q, qd, Q, wants_closed(out), &point));
    put_derivatives(ws, &point, qdd, lambda, out);
    return KEMPE_OK;
}

static kempe_workspace_derivatives places_of(const kempe_workspace *ws, const kempe_workspace_derivatives *rows, int k)
{
    const int n = ws->n, m = ws->m, p = kempe_workspace_independent_count(ws), names = kempe_workspace_name_count(ws),
              outputs = kempe_workspace_output_count(ws);
    return (kempe_workspace_derivatives){
        kmp_row_at(rows->qdd_q, n * n, k),         kmp_row_at(rows->qdd_qd, n * n, k),
        kmp_row_at(rows->qdd_Q, n * n, k),         kmp_row_at(rows->lambda_q, m * n, k),
        kmp_row_at(rows->lambda_qd, m * n, k),     kmp_row_at(rows->lambda_Q, m * n, k),
        kmp_row_at(rows->udd_u, p * p, k),         kmp_row_at(rows->udd_ud, p * p, k),
        kmp_row_at(rows->udd_Q, p * n, k),         kmp_row_at(rows->q_u, n * p, k),
        kmp_row_at(rows->qd_u, n * p, k),          kmp_row_at(rows->qdd_p, n * names, k),
        kmp_row_at(rows->lambda_p, m * names, k),  kmp_row_at(rows->udd_p, p * names, k),
        kmp_row_at(rows->q_p, n * names, k),       kmp_row_at(rows->qd_p, n * names, k),
        kmp_row_at(rows->y, outputs, k),           kmp_row_at(rows->y_q, outputs * n, k),
        kmp_row_at(rows->y_qd, outputs * n, k),    kmp_row_at(rows->y_Q, outputs * n, k),
        kmp_row_at(rows->y_p, outputs * names, k), kmp_row_at(rows->y_u, outputs * p, k),
        kmp_row_at(rows->y_ud, outputs * p, k),    kmp_row_at(rows->y_up, outputs * names, k)};
}

/* Arguments of a call for many states. */
typedef struct derived_rows {
    const double *t, *q, *qd, *Q;
    int step; /* of t */
    double *qdd, *lambda;
    const kempe_workspace_derivatives *out;
    bool lanes;
} derived_rows;

/* Derivatives at a group of states from number k on, in lanes. false: nothing was done. */
static bool derive_group(kempe_workspace *ws, const derived_rows *in, int k, int count)
{
    const ptrdiff_t at = (ptrdiff_t)k * ws->n;
    if (!kmp_derivative_lanes_run(ws, in->t + (in->step ? k : 0), in->step, in->q + at, in->qd + at,
                                  in->Q ? in->Q + at : NULL, wants_closed(in->out)))
        return false;
    for (int l = 0; l < KMP_STAGE_LANES; l++) {
        kmp_derivative_point point;
        const kempe_workspace_derivatives out = places_of(ws, in->out, k + l);
        kmp_derivative_lanes_take(ws, in->q + at, in->qd + at, l, k + l + 1 == count, &point);
        put_derivatives(ws, &point, in->qdd + at + (ptrdiff_t)l * ws->n, kmp_row_at(in->lambda, ws->m, k + l), &out);
        kmp_derivative_lanes_give_back(ws, l);
    }
    return true;
}

static kempe_status visit_state(kempe_workspace *ws, const void *self, int k, int count, int *done)
{
    const derived_rows *in = self;
    if (in->lanes && count - k >= KMP_STAGE_LANES && derive_group(ws, in, k, count)) {
        *done = KMP_STAGE_LANES;
        return KEMPE_OK;
    }
    const int n = ws->n;
    const kempe_workspace_derivatives out = places_of(ws, in->out, k);
    return kempe_workspace_forward_derivatives(ws, in->t[in->step ? k : 0], kmp_row_at(in->q, n, k),
                                               kmp_row_at(in->qd, n, k), kmp_row_at(in->Q, n, k),
                                               kmp_row_at(in->qdd, n, k), kmp_row_at(in->lambda, ws->m, k), &out);
}

kempe_status kempe_workspace_derivative_states(kempe_workspace *ws, int count, const double *t, int t_step,
                                               const double *q, const double *qd, const double *Q, double *qdd,
                                               double *lambda, const kempe_workspace_derivatives *rows, int *failed)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "t", t) || !kmp_workspace_given(ws, "q", q) || !kmp_workspace_given(ws, "qd", qd) ||
        !kmp_workspace_given(ws, "qdd", qdd) || !kmp_workspace_given(ws, "rows", rows))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_workspace_check_count(ws, count));
    const derived_rows in = {t, q, qd, Q, t_step, qdd, lambda, rows, kmp_derivative_lanes_by(ws, count)};
    return kmp_workspace_visit(ws, count, visit_state, &in, failed);
}

/* -- inverse dynamics -------------------------------------------------------------------------------- */

kempe_status kempe_workspace_inverse_derivatives(kempe_workspace *ws, double t, const double *q, const double *qd,
                                                 const double *qdd, double *Q, const kempe_inverse_derivatives *out)
{
    KMP_WANTED(NULL, ws, "workspace");
    if (!kmp_workspace_given(ws, "out", out))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kmp_derivatives_prepared(ws));
    KMP_TRY(kmp_workspace_check_time(ws, t));
    KMP_TRY(kmp_workspace_check_finite(ws, "the acceleration of", kmp_workspace_coordinate_name, ws->n, qdd));
    KMP_TRY(kempe_workspace_inverse_dynamics(ws, t, q, qd, qdd, Q));
    kmp_state_derivatives *d = ws->derivatives.self;
    const int n = ws->n;
    memset(d->a, 0, (size_t)ws->m * sizeof *d->a); /* the loops are open: no multipliers */
    memcpy(d->x, qdd, (size_t)n * sizeof *d->x);
    const kmp_instant at = kmp_instant_of(ws->eval, t, ws->q, ws->qd, d->x, d->a);
    const double *tangents = kmp_tangents_derivatives(&d->tangents, &at);
    double *const by[] = {out->Q_q, out->Q_qd, out->Q_qdd};
    static const kmp_tangent_block block[] = {KMP_R_Q, KMP_R_QD, KMP_M};
    for (int k = 0; k < 3; k++)
        for (int j = 0; by[k] && j < n; j++) {
            memset(by[k] + (ptrdiff_t)j * n, 0, (size_t)n * sizeof **by);
            d->unit[j] = 1;
            kmp_tangents_add(&d->tangents, block[k], tangents, 1, d->unit, by[k] + (ptrdiff_t)j * n);
            d->unit[j] = 0;
        }
    if (out->Q_p && d->names > 0)
        kmp_slopes_at(d->slopes, &at);
    for (int k = 0; out->Q_p && k < d->names; k++)
        memcpy(out->Q_p + (ptrdiff_t)k * n, kmp_slopes_change(d->slopes, k, d->part).force,
               (size_t)n * sizeof *out->Q_p);
    return KEMPE_OK;
}
