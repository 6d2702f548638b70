/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: analyses rail */
/* Derivatives of accelerations and multipliers at a state: beside central differences of forward dynamics, whose error
 * decreases with the square of the step; along closed motions beside differences of closed states, and beside the state
 * space of the linearisation, which is made in another way. */
#include "testing.h"
#include <kempe/check.h>
#include <kempe/derivatives.h>
#include <kempe/extend.h>
#include <kempe/linearize.h>
#include <kempe/output_handles.h>
#include <kempe/settings.h>
#include <stdlib.h>

#define T 0.1 /* s */

enum { MOST = 4096 };

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kempe_workspace *ws;
    int n, m, p;
    const int *u;
    double *q, *qd, *Q;
} scene;

static double next_random(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed / 4294967296.0 - 0.5;
}

/* A closed state near the start, with other rates, and forces. */
static scene scene_new(const char *path, const char *friction)
{
    scene s = {.context = kempe_context_new()};
    unsigned seed = 7;
    kempe_assembly *a = NULL;
    CHECK(kempe_model_read(s.context, path, &s.model) == KEMPE_OK);
    CHECK(kempe_system_new(s.model, &s.system) == KEMPE_OK);
    CHECK(kempe_workspace_new_with_friction(s.system, friction, &s.ws) == KEMPE_OK);
    CHECK(kempe_assembly_new(s.system, &a) == KEMPE_OK);
    s.n = kempe_model_coordinate_count(s.model), s.m = kempe_system_row_count(s.system);
    s.p = kempe_workspace_independent_count(s.ws), s.u = kempe_workspace_independent(s.ws);
    s.q = calloc((size_t)s.n, sizeof(double)), s.qd = calloc((size_t)s.n, sizeof(double));
    s.Q = calloc((size_t)s.n, sizeof(double));
    for (int i = 0; i < s.n; i++) {
        s.q[i] = kempe_assembly_q(a)[i];
        s.qd[i] = kempe_assembly_qd(a)[i] + next_random(&seed);
        s.Q[i] = 10 * next_random(&seed);
    }
    CHECK(kempe_workspace_close(s.ws, 0.1, s.q, s.qd, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_add_derivatives(s.ws, 0, NULL, NULL) == KEMPE_OK &&
          kempe_workspace_add_derivatives(s.ws, 0, NULL, NULL) == KEMPE_OK);
    kempe_assembly_free(a);
    return s;
}

static void scene_free(scene *s)
{
    free(s->q), free(s->qd), free(s->Q);
    kempe_workspace_free(s->ws);
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

static double *room(int count)
{
    double *made = calloc((size_t)count + 1, sizeof *made);
    CHECK(made);
    return made;
}

/* -- differences ------------------------------------------------------------------------------------- */

/* A function of one change, with `count` values. */
typedef struct probe {
    const scene *s;
    int count;
    void (*values)(const struct probe *probe, double change, double *out);
    double *changed; /* all coordinates: q, qd or Q, */
    int k;           /* and which of its values; closed motions: which independent coordinate, */
    bool rates;      /* and whether its rate is changed */
    const int *hold;
    double step;
} probe;

/* The largest difference of a column of derivatives from central differences of two steps, whose error of the second
 * order is removed (Richardson). *size becomes the largest value, at least one. */
static double column_difference(const probe *p, const double *exact, double *size)
{
    const double step[] = {2 * p->step, p->step};
    double *at[4], error = 0;
    *size = 1;
    for (int i = 0; i < 4; i++) {
        at[i] = room(p->count);
        p->values(p, (i % 2 ? -1 : 1) * step[i / 2], at[i]);
    }
    for (int i = 0; i < p->count; i++) {
        const double coarse = (at[0][i] - at[1][i]) / (2 * step[0]), fine = (at[2][i] - at[3][i]) / (2 * step[1]);
        *size = fmax(*size, fmax(fabs(exact[i]), fabs(at[0][i])));
        error = fmax(error, fabs((4 * fine - coarse) / 3 - exact[i]));
    }
    for (int i = 0; i < 4; i++)
        free(at[i]);
    return error;
}

/* The same, relative to that size. */
static double column_error(const probe *p, const double *exact)
{
    double size;
    const double difference = column_difference(p, exact, &size);
    return difference / size;
}

/* -- all coordinates --------------------------------------------------------------------------------- */

static void accelerations(const probe *p, double change, double *out)
{
    const scene *s = p->s;
    const double kept = p->changed[p->k];
    const kempe_workspace_derivatives none = {.y = NULL};
    p->changed[p->k] += change;
    CHECK(kempe_workspace_forward_derivatives(s->ws, T, s->q, s->qd, s->Q, out, out + s->n, &none) == KEMPE_OK);
    p->changed[p->k] = kept;
}

static void all_coordinates(const scene *s, const char *name, double step)
{
    const int n = s->n, m = s->m;
    double *by[6], *qdd = room(n), *lambda = room(m), *column = room(n + m), worst = 0;
    for (int k = 0; k < 6; k++)
        by[k] = room(n * (k % 2 ? m : n));
    const kempe_workspace_derivatives out = {
        .qdd_q = by[0], .lambda_q = by[1], .qdd_qd = by[2], .lambda_qd = by[3], .qdd_Q = by[4], .lambda_Q = by[5]};
    CHECK(kempe_workspace_forward_derivatives(s->ws, T, s->q, s->qd, s->Q, qdd, lambda, &out) == KEMPE_OK);
    CHECK(kempe_workspace_forward_dynamics(s->ws, T, s->q, s->qd, s->Q, column, column + n) == KEMPE_OK);
    for (int i = 0; i < n; i++)
        CHECK_NEAR(qdd[i], column[i], 1e-8 * fmax(1, fabs(column[i])));
    double *const changed[] = {s->q, s->qd, s->Q};
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < n; j++) {
            memcpy(column, by[2 * k] + j * n, (size_t)n * sizeof *column);
            memcpy(column + n, by[2 * k + 1] + j * m, (size_t)m * sizeof *column);
            const probe p = {
                .s = s, .count = n + m, .values = accelerations, .changed = changed[k], .k = j, .step = step};
            worst = fmax(worst, column_error(&p, column));
        }
    printf("%-24s all coordinates %.1e\n", name, worst);
    CHECK(worst < 1e-7);
    for (int k = 0; k < 6; k++)
        free(by[k]);
    free(qdd), free(lambda), free(column);
}

/* -- closed motions ---------------------------------------------------------------------------------- */

/* Independent accelerations, then q and qd of all, at a closed state with another independent coordinate or rate. */
static void closed_state(const probe *at, double change, double *out)
{
    const scene *s = at->s;
    double *q = out + s->p, *qd = q + s->n, *qdd = room(s->n);
    memcpy(q, s->q, (size_t)s->n * sizeof *q);
    memcpy(qd, s->qd, (size_t)s->n * sizeof *qd);
    (at->rates ? qd : q)[s->u[at->k]] += change;
    CHECK(kempe_workspace_close(s->ws, T, q, qd, at->hold) == KEMPE_OK);
    CHECK(kempe_workspace_forward_dynamics(s->ws, T, q, qd, s->Q, qdd, NULL) == KEMPE_OK);
    for (int i = 0; i < s->p; i++)
        out[i] = qdd[s->u[i]];
    free(qdd);
}

static void closed_motions(const scene *s, const char *name, double step)
{
    const int n = s->n, p = s->p;
    double *udd_u = room(p * p), *udd_ud = room(p * p), *q_u = room(n * p), *qd_u = room(n * p), *qdd = room(n);
    double *column = room(p + 2 * n), worst = 0;
    int *hold = calloc((size_t)n + 1, sizeof *hold);
    for (int k = 0; k < p; k++)
        hold[s->u[k]] = 1;
    const kempe_workspace_derivatives out = {.udd_u = udd_u, .udd_ud = udd_ud, .q_u = q_u, .qd_u = qd_u};
    CHECK(kempe_workspace_forward_derivatives(s->ws, T, s->q, s->qd, s->Q, qdd, NULL, &out) == KEMPE_OK);
    for (int k = 0; k < p; k++)
        for (int rates = 0; rates < 2; rates++) {
            memcpy(column, (rates ? udd_ud : udd_u) + k * p, (size_t)p * sizeof *column);
            for (int i = 0; i < n; i++) {
                column[p + i] = rates ? 0 : q_u[i + k * n];
                column[p + n + i] = (rates ? q_u : qd_u)[i + k * n];
            }
            const probe at = {
                .s = s, .count = p + 2 * n, .values = closed_state, .k = k, .rates = rates, .hold = hold, .step = step};
            worst = fmax(worst, column_error(&at, column));
        }
    printf("%-24s closed motions  %.1e\n", name, worst);
    CHECK(worst < 1e-7);
    free(udd_u), free(udd_ud), free(q_u), free(qd_u), free(qdd), free(column), free(hold);
}

/* -- inputs and parameters --------------------------------------------------------------------------- */

/* Values of a model with another value of one parameter, or of one input. */
typedef struct named_probe {
    probe probe;
    const char *path, *const *names;
    const double *values; /* of the model */
    int count;
} named_probe;

static void set_inputs(const scene *s, const char *const *names, const double *values, int count)
{
    for (int k = 0; k < count; k++) {
        const int input = kempe_model_input_find(s->model, names[k]);
        CHECK(input < 0 || kempe_workspace_set_input(s->ws, input, T, values[k], 0, 0) == KEMPE_OK);
    }
}

/* A scene of the model with another value: at the same state, and prepared for nothing. */
static scene changed_scene(const scene *s, const named_probe *at, double change)
{
    scene c = *s;
    char value[64];
    snprintf(value, sizeof value, "%.17g", at->values[at->probe.k] + change);
    const kempe_setting setting = {.name = at->names[at->probe.k], .value = value};
    const int is_parameter = kempe_model_input_find(s->model, setting.name) < 0;
    c.context = kempe_context_new();
    CHECK(kempe_model_read_set(c.context, at->path, &setting, is_parameter, &c.model) == KEMPE_OK);
    CHECK(kempe_system_new(c.model, &c.system) == KEMPE_OK && kempe_workspace_new(c.system, &c.ws) == KEMPE_OK);
    set_inputs(&c, at->names, at->values, at->count);
    const int input = kempe_model_input_find(s->model, setting.name);
    if (input >= 0)
        CHECK(kempe_workspace_set_input(c.ws, input, T, at->values[at->probe.k] + change, 0, 0) == KEMPE_OK);
    return c;
}

static void changed_free(scene *c)
{
    kempe_workspace_free(c->ws);
    kempe_system_free(c->system);
    kempe_model_free(c->model);
    kempe_context_free(c->context);
}

/* Accelerations and multipliers at the state; then udd, q and qd of closed motions, whose u and ud are kept; and the
 * generalized forces of inverse dynamics. */
static void named_values(const probe *p, double change, double *out)
{
    const named_probe *at = (const named_probe *)p;
    const scene *s = p->s;
    scene c = changed_scene(s, at, change);
    const int n = s->n, m = s->m;
    double *q = out + n + m + s->p, *qd = q + n, *qdd = room(n);
    CHECK(kempe_workspace_forward_dynamics(c.ws, T, s->q, s->qd, s->Q, out, out + n) == KEMPE_OK);
    memcpy(q, s->q, (size_t)n * sizeof *q);
    memcpy(qd, s->qd, (size_t)n * sizeof *qd);
    CHECK(kempe_workspace_close(c.ws, T, q, qd, p->hold) == KEMPE_OK);
    CHECK(kempe_workspace_forward_dynamics(c.ws, T, q, qd, s->Q, qdd, NULL) == KEMPE_OK);
    for (int i = 0; i < s->p; i++)
        out[n + m + i] = qdd[s->u[i]];
    CHECK(kempe_workspace_inverse_dynamics(c.ws, T, s->q, s->qd, s->Q, qd + n) == KEMPE_OK);
    free(qdd);
    changed_free(&c);
}

static void by_names(const char *model, const char *const *names, const double *values, int count, double step)
{
    char path[MOST];
    snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", model, model);
    scene s = scene_new(path, "slip");
    const int n = s.n, m = s.m, p = s.p, all = 4 * n + m + p;
    double *qdd = room(n), *lambda = room(m), *Q = room(n), *column = room(all), worst = 0, *by[6];
    const int rows[] = {n, m, p, n, n, n};
    for (int k = 0; k < 6; k++)
        by[k] = room(rows[k] * count);
    int *hold = calloc((size_t)n + 1, sizeof *hold);
    for (int k = 0; k < p; k++)
        hold[s.u[k]] = 1;
    set_inputs(&s, names, values, count);
    CHECK(kempe_workspace_name_count(s.ws) == 0);
    CHECK(kempe_workspace_add_derivatives(s.ws, count, names, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_name_count(s.ws) == count);
    const kempe_workspace_derivatives out = {
        .qdd_p = by[0], .lambda_p = by[1], .udd_p = by[2], .q_p = by[3], .qd_p = by[4]};
    CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, s.Q, qdd, lambda, &out) == KEMPE_OK);
    CHECK(kempe_workspace_inverse_derivatives(s.ws, T, s.q, s.qd, s.Q, Q, &(kempe_inverse_derivatives){.Q_p = by[5]}) ==
          KEMPE_OK);
    for (int k = 0; k < count; k++) {
        for (int part = 0, at = 0; part < 6; at += rows[part++])
            memcpy(column + at, by[part] + k * rows[part], (size_t)rows[part] * sizeof *column);
        const named_probe at = {{.s = &s, .count = all, .values = named_values, .k = k, .hold = hold, .step = step},
                                path,
                                names,
                                values,
                                count};
        worst = fmax(worst, column_error(&at.probe, column));
    }
    printf("%-24s names           %.1e\n", model, worst);
    CHECK(worst < 1e-7);
    for (int k = 0; k < 6; k++)
        free(by[k]);
    free(qdd), free(lambda), free(Q), free(column), free(hold);
    scene_free(&s);
}

static void named(void)
{
    by_names("four_bar", (const char *const[]){"crank_mass", "base", "coupler"}, (const double[]){1, 0.9, 0.8}, 3,
             1e-4);
    by_names("cart_pole", (const char *const[]){"u", "l"}, (const double[]){2, 0.4}, 2, 1e-4);
    by_names("delta_robot", (const char *const[]){"tau2", "rod", "m_platform"}, (const double[]){0.5, 0.7, 1}, 3, 1e-4);
    by_names("suspension", (const char *const[]){"tyre", "track"}, (const double[]){2e5, 0.75}, 2, 1e-4);
}

/* Inverse dynamics compared with differences; Q_qdd is M. */
static void inverse_values(const probe *p, double change, double *out)
{
    const scene *s = p->s;
    const double kept = p->changed[p->k];
    p->changed[p->k] += change;
    CHECK(kempe_workspace_inverse_dynamics(s->ws, T, s->q, s->qd, s->Q, out) == KEMPE_OK);
    p->changed[p->k] = kept;
}

static void inverse(void)
{
    static const char *const model[] = {"four_bar", "stewart", "suspension", "flexible_slider_crank"};
    for (size_t i = 0; i < sizeof model / sizeof *model; i++) {
        char path[MOST];
        snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", model[i], model[i]);
        scene s = scene_new(path, "slip");
        const int n = s.n;
        double *by[3], *Q = room(n), *again = room(n), worst = 0;
        for (int k = 0; k < 3; k++)
            by[k] = room(n * n);
        const kempe_inverse_derivatives out = {.Q_q = by[0], .Q_qd = by[1], .Q_qdd = by[2]};
        CHECK(kempe_workspace_inverse_derivatives(s.ws, T, s.q, s.qd, s.Q, Q, &out) == KEMPE_OK);
        CHECK(kempe_workspace_inverse_dynamics(s.ws, T, s.q, s.qd, s.Q, again) == KEMPE_OK);
        CHECK(memcmp(Q, again, (size_t)n * sizeof *Q) == 0);
        for (int k = 0; k < n * n; k++)
            CHECK_NEAR(by[2][k], kempe_workspace_mass(s.ws)[k], 1e-12 * fmax(1, fabs(by[2][k])));
        double *const changed[] = {s.q, s.qd, s.Q};
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < n; j++) {
                const probe p = {.s = &s,
                                 .count = n,
                                 .values = inverse_values,
                                 .changed = changed[k],
                                 .k = j,
                                 .step = i == 3 ? 1e-6 : 1e-3};
                worst = fmax(worst, column_error(&p, by[k] + j * n));
            }
        printf("%-24s inverse         %.1e\n", model[i], worst);
        CHECK(worst < 1e-7);
        for (int k = 0; k < 3; k++)
            free(by[k]);
        free(Q), free(again);
        scene_free(&s);
    }
}

/* -- outputs and products ---------------------------------------------------------------------------- */

/* Values of outputs by their own object, at the accelerations and multipliers of a state. */
static void output_values(const scene *s, const char *words, const double *q, const double *qd, double *y)
{
    kempe_outputs *o = NULL;
    double *qdd = room(s->n), *lambda = room(s->m);
    CHECK(kempe_outputs_new(s->system, words, &o) == KEMPE_OK);
    CHECK(kempe_workspace_forward_dynamics(s->ws, T, q, qd, s->Q, qdd, lambda) == KEMPE_OK);
    CHECK(kempe_outputs_at_state(o, T, q, qd, qdd, lambda, y) == KEMPE_OK);
    kempe_outputs_free(o);
    free(qdd), free(lambda);
}

typedef struct output_probe {
    named_probe named;
    const char *words;
    int kind; /* 0 to 2: q, qd, Q; 3: a name; 4, 5: u, ud; 6: a name with closed loops */
} output_probe;

static void changed_outputs(const probe *p, double change, double *y)
{
    const output_probe *at = (const output_probe *)p;
    const scene *s = p->s;
    const int n = s->n;
    double *q = room(n), *qd = room(n);
    double *const changed[] = {q, qd, s->Q};
    scene c = *s;
    memcpy(q, s->q, (size_t)n * sizeof *q);
    memcpy(qd, s->qd, (size_t)n * sizeof *qd);
    if (at->kind < 3)
        changed[at->kind][p->k] += change;
    else if (at->kind == 4 || at->kind == 5)
        changed[at->kind - 4][s->u[p->k]] += change;
    else
        c = changed_scene(s, &at->named, change);
    if (at->kind > 3)
        CHECK(kempe_workspace_close(c.ws, T, q, qd, p->hold) == KEMPE_OK);
    output_values(&c, at->words, q, qd, y);
    if (at->kind == 2)
        s->Q[p->k] -= change;
    if (at->kind == 3 || at->kind == 6)
        changed_free(&c);
    free(q), free(qd);
}

/* Weights times a matrix times a vector. */
static double between(int rows, int columns, const double *w, const double *matrix, const double *x)
{
    double sum = 0;
    for (int j = 0; j < columns; j++)
        for (int i = 0; i < rows; i++)
            sum += w[i] * matrix[i + (ptrdiff_t)j * rows] * x[j];
    return sum;
}

static void fill(double *x, int count, unsigned *seed)
{
    for (int i = 0; i < count; i++)
        x[i] = next_random(seed);
}

static double dot(int n, const double *a, const double *b)
{
    return between(n, 1, a, b, &(double){1});
}

/* Products along a direction and of weights beside the matrices. `by`: qdd, lambda and y (rows) by q, qd, Q and names;
 * then y, q and qd by u, ud and names. */
static void products(const scene *s, const char *name, int names, int l, double *by[4][3], double *closed[3][3])
{
    const int n = s->n, m = s->m, p = s->p, rows[] = {n, m, l}, columns[] = {n, n, n, names};
    unsigned seed = 3;
    double *w[3], *change[3], *x[4], *gradient[4], worst = 0;
    for (int i = 0; i < 3; i++)
        w[i] = room(rows[i]), change[i] = room(rows[i]), fill(w[i], rows[i], &seed);
    for (int j = 0; j < 4; j++)
        x[j] = room(columns[j]), gradient[j] = room(columns[j]), fill(x[j], columns[j], &seed);
    const kempe_forward_values weight = {.qdd = w[0], .lambda = w[1], .y = w[2]};
    const kempe_forward_values along = {.qdd = change[0], .lambda = change[1], .y = change[2]};
    const kempe_state_direction direction = {.q = x[0], .qd = x[1], .Q = x[2], .p = x[3]};
    const kempe_state_gradient of = {.q = gradient[0], .qd = gradient[1], .Q = gradient[2], .p = gradient[3]};
    CHECK(kempe_workspace_forward_jvp(s->ws, T, s->q, s->qd, s->Q, &direction, NULL, &along) == KEMPE_OK);
    CHECK(kempe_workspace_forward_vjp(s->ws, T, s->q, s->qd, s->Q, &weight, NULL, &of) == KEMPE_OK);
    double forward = 0, size = 1;
    for (int i = 0; i < 3; i++)
        forward += dot(rows[i], w[i], change[i]);
    for (int j = 0; j < 4; j++) {
        double column = 0;
        for (int i = 0; i < 3; i++)
            column += between(rows[i], columns[j], w[i], by[j][i], x[j]);
        size = fmax(size, fabs(column));
        worst = fmax(worst, fabs(dot(columns[j], gradient[j], x[j]) - column));
        forward -= column;
    }
    worst = fmax(worst, fabs(forward)) / size;
    /* Along closed motions, the outputs only. */
    const int by_closed[] = {p, p, names};
    double *z[3], *g[3];
    for (int j = 0; j < 3; j++)
        z[j] = room(by_closed[j]), g[j] = room(by_closed[j]), fill(z[j], by_closed[j], &seed);
    CHECK(kempe_workspace_forward_jvp(s->ws, T, s->q, s->qd, s->Q,
                                      &(kempe_state_direction){.u = z[0], .ud = z[1], .p = z[2]}, NULL,
                                      &along) == KEMPE_OK);
    CHECK(kempe_workspace_forward_vjp(s->ws, T, s->q, s->qd, s->Q, &(kempe_forward_values){.y = w[2]}, NULL,
                                      &(kempe_state_gradient){.u = g[0], .ud = g[1], .p = g[2]}) == KEMPE_OK);
    /* Coordinates and rates change as they do along the direction, and a weighted sum of them as its gradient says. */
    double *q_change = room(2 * n), *w_q = room(2 * n), *g_q[2] = {room(p), room(p)}, by_q = 0;
    fill(w_q, 2 * n, &seed);
    CHECK(kempe_workspace_forward_jvp(s->ws, T, s->q, s->qd, s->Q, &(kempe_state_direction){.u = z[0], .ud = z[1]},
                                      NULL, &(kempe_forward_values){.q = q_change, .qd = q_change + n}) == KEMPE_OK);
    CHECK(kempe_workspace_forward_vjp(s->ws, T, s->q, s->qd, s->Q, &(kempe_forward_values){.q = w_q, .qd = w_q + n},
                                      NULL, &(kempe_state_gradient){.u = g_q[0], .ud = g_q[1]}) == KEMPE_OK);
    for (int k = 0; k < p; k++)
        CHECK(q_change[s->u[k]] == z[0][k] && q_change[n + s->u[k]] == z[1][k]);
    by_q = dot(2 * n, w_q, q_change);
    CHECK_NEAR(dot(p, g_q[0], z[0]) + dot(p, g_q[1], z[1]), by_q, 1e-12 * fmax(1, fabs(by_q)));
    free(q_change), free(w_q), free(g_q[0]), free(g_q[1]);
    double closed_worst = 0, closed_size = 1;
    forward = dot(l, w[2], change[2]);
    for (int j = 0; j < 3; j++) {
        const double column = between(l, by_closed[j], w[2], closed[j][0], z[j]);
        closed_size = fmax(closed_size, fabs(column));
        closed_worst = fmax(closed_worst, fabs(dot(by_closed[j], g[j], z[j]) - column));
        forward -= column;
    }
    closed_worst = fmax(closed_worst, fabs(forward)) / closed_size;
    printf("%-24s products        %.1e, closed %.1e\n", name, worst, closed_worst);
    CHECK(worst < 1e-11 && closed_worst < 1e-11);
    for (int i = 0; i < 3; i++)
        free(w[i]), free(change[i]), free(z[i]), free(g[i]);
    for (int j = 0; j < 4; j++)
        free(x[j]), free(gradient[j]);
}

/* The derivative along a direction at a state that is moved along another one. */
typedef struct moved_probe {
    probe probe;
    const kempe_state_direction *along, *moves;
} moved_probe;

static void moved_change(const probe *p, double change, double *out)
{
    const moved_probe *at = (const moved_probe *)p;
    const scene *s = p->s;
    const double *const from[] = {s->q, s->qd, s->Q}, *const by[] = {at->moves->q, at->moves->qd, at->moves->Q};
    double *to[3];
    for (int k = 0; k < 3; k++) {
        to[k] = room(s->n);
        for (int i = 0; i < s->n; i++)
            to[k][i] = from[k][i] + change * by[k][i];
    }
    CHECK(kempe_workspace_forward_jvp(s->ws, T, to[0], to[1], to[2], at->along, NULL,
                                      &(kempe_forward_values){.qdd = out, .lambda = out + s->n}) == KEMPE_OK);
    for (int k = 0; k < 3; k++)
        free(to[k]);
}

/* Second derivatives beside differences of first ones, and the same in the other order of the directions. */
static void second_derivatives(void)
{
    static const char *const model[] = {"four_bar", "stewart", "quarter_car", "suspension"};
    for (size_t i = 0; i < sizeof model / sizeof *model; i++) {
        char path[MOST];
        snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", model[i], model[i]);
        scene s = scene_new(path, "slip");
        const int n = s.n, m = s.m;
        unsigned seed = 5;
        double *x[6], *exact = room(n + m), *other = room(n + m);
        for (int k = 0; k < 6; k++)
            x[k] = room(n), fill(x[k], n, &seed);
        const kempe_state_direction a = {x[0], x[1], x[2], NULL, NULL, NULL}, b = {x[3], x[4], x[5], NULL, NULL, NULL};
        const kempe_forward_values change = {.qdd = exact, .lambda = exact + n};
        const kempe_forward_values again = {.qdd = other, .lambda = other + n};
        CHECK(kempe_workspace_forward_second(s.ws, T, s.q, s.qd, s.Q, &a, &b, &change) == KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(s.ws), "kempe_workspace_add_second_derivatives"));
        CHECK(kempe_workspace_add_second_derivatives(s.ws) == KEMPE_OK &&
              kempe_workspace_add_second_derivatives(s.ws) == KEMPE_OK);
        CHECK(kempe_workspace_forward_second(s.ws, T, s.q, s.qd, s.Q, &a, &b, &change) == KEMPE_OK);
        CHECK(kempe_workspace_forward_second(s.ws, T, s.q, s.qd, s.Q, &b, &a, &again) == KEMPE_OK);
        double size = 1, apart = 0;
        for (int k = 0; k < n + m; k++)
            size = fmax(size, fabs(exact[k])), apart = fmax(apart, fabs(exact[k] - other[k]));
        const moved_probe at = {
            {.s = &s, .count = n + m, .values = moved_change, .step = i == 3 ? 1e-4 : 1e-3}, &a, &b};
        const double worst = column_error(&at.probe, exact);
        printf("%-24s second          %.1e, order %.1e\n", model[i], worst, apart / size);
        CHECK(worst < 1e-7 && apart / size < 1e-11);
        const kempe_state_direction names = {.p = x[0]};
        CHECK(kempe_workspace_forward_second(s.ws, T, s.q, s.qd, s.Q, &names, &b, &change) == KEMPE_E_ARGUMENT);
        for (int k = 0; k < 6; k++)
            free(x[k]);
        free(exact), free(other);
        scene_free(&s);
    }
}

/* -- Hessians ---------------------------------------------------------------------------------------- */

/* The gradient of a weighted sum by (q, qd, Q), or along closed motions by (u, ud, Q), at a state of which one of these
 * is changed. */
typedef struct gradient_probe {
    probe probe;
    const kempe_forward_values *weight;
    int first; /* q, qd or u, ud: so many each */
    bool closed;
} gradient_probe;

static void changed_gradient(const probe *p, double change, double *out)
{
    const gradient_probe *at = (const gradient_probe *)p;
    const scene *s = p->s;
    const int n = s->n, kind = p->k < at->first ? 0 : p->k < 2 * at->first ? 1 : 2, k = p->k - kind * at->first;
    double *state[3];
    const double *const from[] = {s->q, s->qd, s->Q};
    for (int i = 0; i < 3; i++) {
        state[i] = room(n);
        memcpy(state[i], from[i], (size_t)n * sizeof(double));
    }
    state[kind][at->closed && kind < 2 ? s->u[k] : k] += change;
    if (at->closed)
        CHECK(kempe_workspace_close(s->ws, T, state[0], state[1], p->hold) == KEMPE_OK);
    const kempe_state_gradient gradient =
        at->closed ? (kempe_state_gradient){.u = out, .ud = out + at->first, .Q = out + 2 * at->first}
                   : (kempe_state_gradient){.q = out, .qd = out + n, .Q = out + 2 * n};
    CHECK(kempe_workspace_forward_vjp(s->ws, T, state[0], state[1], state[2], at->weight, NULL, &gradient) == KEMPE_OK);
    for (int i = 0; i < 3; i++)
        free(state[i]);
}

/* The Hessian by all coordinates or along closed motions beside differences of the exact gradient; the same bits in a
 * call for several states; and along two other directions as the matrix has it. */
static void hessian_of(const scene *s, const char *name, bool closed, double step, double most)
{
    enum { STATES = 3 };
    const int n = s->n, m = s->m, p = s->p, l = kempe_workspace_output_count(s->ws), first = closed ? p : n;
    const int size = 2 * first + n;
    unsigned seed = 11;
    double *w[5] = {room(STATES * n), room(STATES * m), room(STATES * l), room(STATES * n), room(STATES * n)},
           *unit = room(size * size), worst = 0;
    double *H = room(size * size), *states[3], *rows = room(STATES * size * size), *x = room(2 * size), other[4];
    kempe_state_direction *direction = calloc((size_t)size, sizeof *direction), two[2];
    int *hold = calloc((size_t)n + 1, sizeof *hold), failed = 0;
    for (int k = 0; k < p; k++)
        hold[s->u[k]] = 1;
    fill(w[0], STATES * n, &seed), fill(w[1], STATES * m, &seed), fill(w[2], STATES * l, &seed);
    fill(w[3], STATES * n, &seed), fill(w[4], STATES * n, &seed);
    const kempe_forward_values weight = {w[0], w[1], w[2], w[3], w[4]};
    for (int k = 0; k < size; k++) {
        double *e = unit + k * size;
        e[k] = 1;
        direction[k] = closed ? (kempe_state_direction){.u = e, .ud = e + p, .Q = e + 2 * p}
                              : (kempe_state_direction){.q = e, .qd = e + n, .Q = e + 2 * n};
    }
    CHECK(kempe_workspace_forward_hessian(s->ws, T, s->q, s->qd, s->Q, &weight, size, direction, H) == KEMPE_OK);
    gradient_probe at = {
        {.s = s, .count = size, .values = changed_gradient, .hold = hold, .step = step}, &weight, first, closed};
    for (double most_of_column; at.probe.k < size; at.probe.k++)
        worst = fmax(worst, column_difference(&at.probe, H + at.probe.k * size, &most_of_column));
    const double *const from[] = {s->q, s->qd, s->Q};
    for (int i = 0; i < 3; i++) {
        states[i] = room(STATES * n);
        for (int k = 0; k < STATES; k++)
            memcpy(states[i] + k * n, from[i], (size_t)n * sizeof(double));
    }
    const double t = T;
    CHECK(kempe_workspace_hessian_states(s->ws, STATES, &t, 0, states[0], states[1], states[2], &weight, size,
                                         direction, rows, &failed) == KEMPE_OK &&
          failed == -1);
    CHECK(memcmp(rows, H, (size_t)(size * size) * sizeof *H) == 0);
    fill(x, 2 * size, &seed);
    for (int k = 0; k < 2; k++)
        two[k] = closed ? (kempe_state_direction){.u = x + k * size, .ud = x + k * size + p, .Q = x + k * size + 2 * p}
                        : (kempe_state_direction){.q = x + k * size, .qd = x + k * size + n, .Q = x + k * size + 2 * n};
    CHECK(kempe_workspace_forward_hessian(s->ws, T, s->q, s->qd, s->Q, &weight, 2, two, other) == KEMPE_OK);
    double apart = 0, large = 0;
    for (int k = 0; k < 4; k++) {
        const double expected = between(size, size, x + k % 2 * size, H, x + k / 2 * size);
        apart = fmax(apart, fabs(other[k] - expected));
    }
    for (int k = 0; k < size * size; k++)
        large = fmax(large, fabs(H[k]));
    printf("%-24s hessian, %s %.1e, directions %.1e\n", name, closed ? "closed" : "all   ", worst / large,
           apart / large);
    CHECK(large > 1e-3 && worst / large < most && apart / large < 1e-11);
    for (int i = 0; i < 5; i++)
        free(w[i]);
    for (int i = 0; i < 3; i++)
        free(states[i]);
    free(unit), free(H), free(rows), free(x), free(direction), free(hold);
}

static void hessians(void)
{
    static const struct {
        const char *model, *outputs;
        double step, most;
        bool moves; /* the closed motion is not just a wheel that turns */
    } of[] = {{"four_bar", "velocity(coupler.C),acceleration(coupler.C),reaction(crank),energy", 1e-3, 1e-9, true},
              {"cart_pole", NULL, 1e-3, 1e-9, true},
              {"delta_robot", "position(platform.C1),acceleration(platform.C1)", 1e-3, 1e-9, true},
              {"stewart", NULL, 1e-3, 1e-9, true},
              {"andrews", NULL, 1e-3, 1e-9, true},
              {"parallel_robot", NULL, 1e-4, 1e-9, true},
              {"suspension", "acceleration(left_arm.W),force(RL),reaction(right_link)", 1e-4, 1e-9, true},
              {"double_wishbone", NULL, 1e-3, 1e-9, false},
              {"flexible_slider_crank", NULL, 1e-6, 1e-8, true}};
    for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
        char path[MOST];
        snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", of[k].model, of[k].model);
        scene s = scene_new(path, "slip");
        CHECK(kempe_workspace_add_derivatives(s.ws, 0, NULL, of[k].outputs) == KEMPE_OK);
        CHECK(kempe_workspace_add_hessians(s.ws) == KEMPE_OK && kempe_workspace_add_hessians(s.ws) == KEMPE_OK);
        if (of[k].moves)
            hessian_of(&s, of[k].model, true, of[k].step, of[k].most);
        hessian_of(&s, of[k].model, false, of[k].step, of[k].most);
        scene_free(&s);
    }
}

/* -- the determinant of the loops ------------------------------------------------------------------------- */

/* The logarithm of the determinant and its derivatives at a closed state with another independent coordinate. */
static void determinant_values(const probe *p, double change, double *out)
{
    const scene *s = p->s;
    double *q = room(s->n);
    const double t = T;
    memcpy(q, s->q, (size_t)s->n * sizeof *q);
    q[s->u[p->k]] += change;
    CHECK(kempe_workspace_close(s->ws, T, q, NULL, p->hold) == KEMPE_OK);
    CHECK(kempe_workspace_determinant_states(s->ws, 1, &t, 0, q, out, out + 1, NULL, NULL) == KEMPE_OK);
    free(q);
}

static void determinants(void)
{
    static const char *const model[] = {"four_bar", "delta_robot", "stewart", "andrews", "parallel_robot", "bricard"};
    for (size_t i = 0; i < sizeof model / sizeof *model; i++) {
        char path[MOST];
        snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", model[i], model[i]);
        scene s = scene_new(path, "slip");
        const int p = s.p;
        const double t = T;
        double *by_u = room(p), *by_uu = room(p * p), *column = room(1 + p), value = 0, worst = 0, large = 0, size;
        double states[3 * 64], values[3];
        int *hold = calloc((size_t)s.n + 1, sizeof *hold), failed = -2;
        CHECK(kempe_workspace_determinant_states(s.ws, 1, &t, 0, s.q, &value, by_u, by_uu, &failed) ==
              KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(s.ws), "kempe_workspace_add_determinant"));
        CHECK(kempe_workspace_add_determinant(s.ws) == KEMPE_OK && kempe_workspace_add_determinant(s.ws) == KEMPE_OK);
        for (int k = 0; k < p; k++)
            hold[s.u[k]] = 1;
        CHECK(kempe_workspace_determinant_states(s.ws, 1, &t, 0, s.q, &value, by_u, by_uu, &failed) == KEMPE_OK);
        CHECK(failed == -1);
        for (int k = 0; k < p; k++) {
            const probe at = {
                .s = &s, .count = 1 + p, .values = determinant_values, .k = k, .hold = hold, .step = 1e-3};
            column[0] = by_u[k];
            memcpy(column + 1, by_uu + k * p, (size_t)p * sizeof *column);
            worst = fmax(worst, column_difference(&at, column, &size));
            for (int j = 0; j <= p; j++)
                large = fmax(large, fabs(column[j]));
        }
        printf("%-24s determinant     %.1e of %.1e\n", model[i], worst, large);
        CHECK(large > 1e-3 && worst < 1e-9 * fmax(1, large));
        for (int k = 0; k < 3; k++)
            memcpy(states + k * s.n, s.q, (size_t)s.n * sizeof *states);
        CHECK(kempe_workspace_determinant_states(s.ws, 3, &t, 0, states, values, NULL, NULL, &failed) == KEMPE_OK);
        CHECK(values[0] == value && values[2] == value && failed == -1);
        if (i == 0) { /* two columns of J */
            const double *J = kempe_workspace_jacobian(s.ws);
            const int a = s.u[0] == 0 ? 1 : 0, b = s.u[0] == 2 ? 1 : 2;
            CHECK_NEAR(value, log(fabs(J[2 * a] * J[1 + 2 * b] - J[1 + 2 * a] * J[2 * b])), 1e-12);
            states[s.n] += 0.1;
            CHECK(kempe_workspace_determinant_states(s.ws, 3, &t, 0, states, values, by_u, by_uu, &failed) ==
                  KEMPE_E_FAILED);
            CHECK(failed == 1 && check_says(kempe_workspace_message(s.ws), "close the state first"));
        }
        free(by_u), free(by_uu), free(column), free(hold);
        scene_free(&s);
    }
}

/* Hessians beside second derivatives along two directions, which are derived in another way: of models with choices,
 * tables, and wheels on rails, whose contacts are blocks. */
static void hessians_beside_second_derivatives(void)
{
    static const char *const model[] = {"limousine", "bogie_track", "tram"};
    for (size_t i = 0; i < sizeof model / sizeof *model; i++) {
        char path[MOST];
        snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", model[i], model[i]);
        scene s = scene_new(path, "slip");
        const int n = s.n, m = s.m;
        unsigned seed = 17;
        double *x = room(6 * n), *w = room(n + m), *second = room(n + m), H[4], worst = 0, most = 0;
        fill(x, 6 * n, &seed), fill(w, n + m, &seed);
        const kempe_state_direction direction[] = {{.q = x, .qd = x + n, .Q = x + 2 * n},
                                                   {.q = x + 3 * n, .qd = x + 4 * n, .Q = x + 5 * n}};
        const kempe_forward_values weight = {.qdd = w, .lambda = w + n};
        CHECK(kempe_workspace_add_second_derivatives(s.ws) == KEMPE_OK &&
              kempe_workspace_add_hessians(s.ws) == KEMPE_OK);
        CHECK(kempe_workspace_forward_hessian(s.ws, T, s.q, s.qd, s.Q, &weight, 2, direction, H) == KEMPE_OK);
        for (int k = 0; k < 3; k++) { /* 0 0, 0 1, 1 1: of some contacts the order of the directions counts */
            const int first = k / 2, second_one = (k + 1) / 2;
            CHECK(kempe_workspace_forward_second(s.ws, T, s.q, s.qd, s.Q, &direction[first], &direction[second_one],
                                                 &(kempe_forward_values){.qdd = second, .lambda = second + n}) ==
                  KEMPE_OK);
            const double difference = fabs(dot(n + m, w, second) - H[first + 2 * second_one]);
            worst = difference <= worst ? worst : difference; /* also if it is NaN */
            most = fmax(most, fabs(H[first + 2 * second_one]));
        }
        printf("%-24s hessian beside second derivatives %.1e\n", model[i], worst / most);
        CHECK(most > 1 && worst < 1e-9 * most);
        free(x), free(w), free(second);
        scene_free(&s);
    }
}

/* A user-defined force that is nonlinear in coordinates and rates. */
static int magnet(void *user, double t, const double *q, const double *qd, double *effort)
{
    const double *strength = user;
    (void)t;
    effort[0] = *strength * sin(q[0]) * qd[1];
    effort[1] = -*strength * q[1] * q[1] * qd[1];
    return 0;
}

/* Its Hessian, by differences, beside the same force of the model. */
static void hessian_with_force(void)
{
    static const char mechanism[] =
        "kempe: 1\nbodies:\n"
        "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.3, 0, 0], points: {E: [0.5, 0, 0]}}\n"
        "  b: {joint: {revolute: z, at: a.E}, mass: 1, com: [0.2, 0, 0]}\n";
    static const char forces[] = "forces:\n  x: {joint: a, torque: \"3*sin(q(a))*qd(b)\"}\n"
                                 "  y: {joint: b, torque: \"-3*q(b)^2*qd(b)\"}\n";
    static const double q[] = {0.7, -0.4}, qd[] = {1.3, -2.1}, unit[6][6] = {{1}, {0, 1}, {0, 0, 1}, {0, 0, 0, 1}};
    double H[2][16], w[] = {0.4, 0.9}, strength = 3;
    for (int k = 0; k < 2; k++) {
        char text[MOST];
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        kempe_system *system = NULL;
        kempe_workspace *ws = NULL;
        kempe_state_direction direction[4];
        snprintf(text, sizeof text, "%s%s", mechanism, k ? "" : forces);
        CHECK(kempe_model_read_text(context, text, "force", &model) == KEMPE_OK);
        CHECK(kempe_system_new(model, &system) == KEMPE_OK);
        if (k)
            kempe_system_set_force(system, magnet, &strength);
        CHECK(kempe_workspace_new(system, &ws) == KEMPE_OK);
        CHECK(kempe_workspace_add_derivatives(ws, 0, NULL, NULL) == KEMPE_OK &&
              kempe_workspace_add_hessians(ws) == KEMPE_OK);
        for (int i = 0; i < 4; i++)
            direction[i] = (kempe_state_direction){.q = unit[i], .qd = unit[i] + 2};
        CHECK(kempe_workspace_forward_hessian(ws, T, q, qd, NULL, &(kempe_forward_values){.qdd = w}, 4, direction,
                                              H[k]) == KEMPE_OK);
        kempe_workspace_free(ws);
        kempe_system_free(system);
        kempe_model_free(model);
        kempe_context_free(context);
    }
    double worst = 0, most = 0;
    for (int k = 0; k < 16; k++)
        worst = fmax(worst, fabs(H[1][k] - H[0][k])), most = fmax(most, fabs(H[0][k]));
    printf("%-24s hessian         %.1e\n", "user-defined force", worst / most);
    CHECK(most > 10 && worst < 1e-6 * most);
}

/* -- steps -------------------------------------------------------------------------------------------- */

/* Independent coordinates and rates after steps, at another state, force or name before them. */
typedef struct step_probe {
    named_probe named;
    int kind; /* 0: u, ud; 1: Q; 2: a name */
} step_probe;

enum { STEPS = 3 };

static void after_steps(const probe *p, double change, double *x)
{
    const step_probe *at = (const step_probe *)p;
    const scene *s = p->s;
    const int n = s->n;
    double *q = room(n), *qd = room(n), *Q = room(n);
    memcpy(q, s->q, (size_t)n * sizeof *q);
    memcpy(qd, s->qd, (size_t)n * sizeof *qd);
    memcpy(Q, s->Q, (size_t)n * sizeof *Q);
    if (at->kind == 0)
        (p->k < s->p ? q : qd)[s->u[p->k % s->p]] += change;
    if (at->kind == 1)
        Q[p->k] += change;
    scene c = *s;
    if (at->kind == 2) {
        c = changed_scene(s, &at->named, change);
        CHECK(kempe_workspace_add_derivatives(c.ws, 0, NULL, NULL) == KEMPE_OK);
    }
    CHECK(kempe_workspace_step(c.ws, T, 1e-3, STEPS, q, qd, Q, NULL) == KEMPE_OK);
    for (int k = 0; k < s->p; k++)
        x[k] = q[s->u[k]], x[s->p + k] = qd[s->u[k]];
    if (at->kind == 2)
        changed_free(&c);
    free(q), free(qd), free(Q);
}

static void steps_of(const char *model, const char *const *names, const double *values, int count, double step)
{
    char path[MOST];
    snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", model, model);
    scene s = scene_new(path, "slip");
    set_inputs(&s, names, values, count);
    CHECK(kempe_workspace_add_derivatives(s.ws, count, names, NULL) == KEMPE_OK);
    const int n = s.n, p = s.p, x = 2 * p, columns[] = {x, n, count};
    double *by[3], *q = room(n), *qd = room(n), worst = 0;
    for (int k = 0; k < 3; k++)
        by[k] = room(x * columns[k]);
    memcpy(q, s.q, (size_t)n * sizeof *q);
    memcpy(qd, s.qd, (size_t)n * sizeof *qd);
    CHECK(kempe_workspace_step(s.ws, T, 1e-3, STEPS, q, qd, s.Q, &(kempe_step_derivatives){by[0], by[1], by[2]}) ==
          KEMPE_OK);
    for (int kind = 0; kind < 3; kind++)
        for (int k = 0; k < columns[kind]; k++) {
            const step_probe at = {
                {{.s = &s, .count = x, .values = after_steps, .k = k, .step = step}, path, names, values, count}, kind};
            worst = fmax(worst, column_error(&at.named.probe, by[kind] + k * x));
        }
    /* The order of the method: errors of steps of h and h / 2 against many short ones. */
    double *exact = room(n), *ends[2], rates[2][MOST], error[2] = {0, 0};
    memcpy(exact, s.q, (size_t)n * sizeof *exact);
    memcpy(qd, s.qd, (size_t)n * sizeof *qd);
    CHECK(kempe_workspace_step(s.ws, T, 1e-4, 160, exact, qd, s.Q, NULL) == KEMPE_OK);
    for (int k = 0; k < 2; k++) {
        ends[k] = room(n);
        memcpy(ends[k], s.q, (size_t)n * sizeof *exact);
        memcpy(rates[k], s.qd, (size_t)n * sizeof *exact);
        CHECK(kempe_workspace_step(s.ws, T, 8e-3 / (1 + k), 2 * (1 + k), ends[k], rates[k], s.Q, NULL) == KEMPE_OK);
        for (int i = 0; i < n; i++)
            error[k] = fmax(error[k], fabs(ends[k][i] - exact[i]));
        free(ends[k]);
    }
    printf("%-24s steps           %.1e, order %.1f\n", model, worst, log2(error[0] / error[1]));
    CHECK(worst < 1e-9 && (error[1] < 1e-13 || (error[0] > 10 * error[1] && error[0] < 30 * error[1])));
    for (int k = 0; k < 3; k++)
        free(by[k]);
    free(q), free(qd), free(exact);
    scene_free(&s);
}

static void steps(void)
{
    steps_of("four_bar", (const char *const[]){"crank_mass", "base"}, (const double[]){1, 0.9}, 2, 1e-3);
    steps_of("delta_robot", (const char *const[]){"tau2", "rod"}, (const double[]){0.5, 0.7}, 2, 1e-3);
    steps_of("cart_pole", (const char *const[]){"u"}, (const double[]){2}, 1, 1e-2);
    scene s = scene_new(KEMPE_ROOT "/examples/four_bar/four_bar.yaml", "slip");
    const double q = s.q[0];
    CHECK(kempe_workspace_step(s.ws, T, 0, 1, s.q, s.qd, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_step(s.ws, T, 1e-3, 0, s.q, s.qd, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_step(s.ws, T, 10, 1, s.q, s.qd, NULL, NULL) == KEMPE_E_FAILED && s.q[0] == q);
    scene_free(&s);
}

static void outputs_of(const char *model, const char *words, const char *const *names, const double *values, int count,
                       double step)
{
    char path[MOST];
    snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", model, model);
    scene s = scene_new(path, "slip");
    set_inputs(&s, names, values, count);
    CHECK(kempe_workspace_add_derivatives(s.ws, count, names, words) == KEMPE_OK);
    const int n = s.n, m = s.m, p = s.p, l = kempe_workspace_output_count(s.ws), rows[] = {n, m, l};
    const int columns[] = {n, n, n, count}, by_closed[] = {p, p, count};
    double *by[4][3], *closed[3][3], *y = room(l), *expected = room(l), *qdd = room(n), worst = 0;
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 3; i++)
            by[j][i] = room(rows[i] * columns[j]);
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 3; i++)
            closed[j][i] = room((i ? n : l) * by_closed[j]);
    const kempe_workspace_derivatives out = {.qdd_q = by[0][0],
                                             .qdd_qd = by[1][0],
                                             .qdd_Q = by[2][0],
                                             .qdd_p = by[3][0],
                                             .lambda_q = by[0][1],
                                             .lambda_qd = by[1][1],
                                             .lambda_Q = by[2][1],
                                             .lambda_p = by[3][1],
                                             .y = y,
                                             .y_q = by[0][2],
                                             .y_qd = by[1][2],
                                             .y_Q = by[2][2],
                                             .y_p = by[3][2],
                                             .y_u = closed[0][0],
                                             .y_ud = closed[1][0],
                                             .y_up = closed[2][0]};
    CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, s.Q, qdd, NULL, &out) == KEMPE_OK);
    output_values(&s, words, s.q, s.qd, expected);
    for (int i = 0; i < l; i++)
        CHECK_NEAR(y[i], expected[i], 1e-11 * fmax(1, fabs(expected[i])));
    int *hold = calloc((size_t)n + 1, sizeof *hold);
    for (int k = 0; k < p; k++)
        hold[s.u[k]] = 1;
    for (int kind = 0; kind < 7; kind++)
        for (int k = 0; k < (kind < 4 ? columns[kind] : by_closed[kind - 4]); k++) {
            const output_probe at = {
                {{.s = &s, .count = l, .values = changed_outputs, .k = k, .hold = hold, .step = step},
                 path,
                 names,
                 values,
                 count},
                words,
                kind};
            const double *matrix = kind < 4 ? by[kind][2] : closed[kind - 4][0];
            worst = fmax(worst, column_error(&at.named.probe, matrix + k * l));
        }
    printf("%-24s %2d outputs      %.1e\n", model, l, worst);
    CHECK(worst < 1e-7);
    CHECK(kempe_workspace_output_name(s.ws, l - 1) && !kempe_workspace_output_name(s.ws, l));
    products(&s, model, count, l, by, closed);
    for (int k = 0; k < 12; k++)
        free(by[k / 3][k % 3]);
    for (int k = 0; k < 9; k++)
        free(closed[k / 3][k % 3]);
    free(y), free(expected), free(qdd), free(hold);
    scene_free(&s);
}

static void outputs_and_products(void)
{
    outputs_of("four_bar", "position(coupler.C).x,velocity(coupler.C),acceleration(coupler.C),reaction(crank),energy",
               (const char *const[]){"crank_mass", "base"}, (const double[]){1, 0.9}, 2, 1e-4);
    outputs_of("delta_robot", "position(platform.C1),acceleration(platform.C1)",
               (const char *const[]){"tau2", "rod", "m_platform"}, (const double[]){0.5, 0.7, 1}, 3, 1e-4);
    outputs_of("suspension", "acceleration(left_arm.W),force(RL),reaction(right_link)",
               (const char *const[]){"tyre", "track"}, (const double[]){2e5, 0.75}, 2, 1e-4);
}

/* -- state space ------------------------------------------------------------------------------------- */

/* The state space about the start: A = (0 1; udd_u udd_ud) in the same independent coordinates. */
static void state_space(const scene *s, const char *name)
{
    const int n = s->n, p = s->p;
    int rows, columns;
    double *udd_u = room(p * p), *udd_ud = room(p * p), *udd_Q = room(p * n), *qdd = room(n), *all = room(n * n),
           worst = 0;
    char u[MOST] = "";
    kempe_linearization *l = NULL;
    for (int k = 0; k < p; k++)
        snprintf(u + strlen(u), sizeof u - strlen(u), "%s%s", k ? "," : "",
                 kempe_model_coordinate_name(s->model, s->u[k]));
    CHECK(kempe_linearization_new(s->system, &(kempe_linearize_options){.at = "start", .independent = u}, &l) ==
          KEMPE_OK);
    const kempe_workspace_derivatives out = {.udd_u = udd_u, .udd_ud = udd_ud, .udd_Q = udd_Q, .qdd_Q = all};
    CHECK(kempe_workspace_forward_derivatives(s->ws, 0, kempe_linearization_q(l), kempe_linearization_qd(l), NULL, qdd,
                                              NULL, &out) == KEMPE_OK);
    const double *A = kempe_linearization_matrix(l, KEMPE_MATRIX_A, &rows, &columns);
    CHECK(rows == 2 * p && columns == 2 * p);
    for (int j = 0; j < p; j++)
        for (int i = 0; i < p; i++) {
            const double a = A[p + i + j * 2 * p], g = A[p + i + (p + j) * 2 * p];
            worst = fmax(worst, fabs(udd_u[i + j * p] - a) / fmax(1, fabs(a)));
            worst = fmax(worst, fabs(udd_ud[i + j * p] - g) / fmax(1, fabs(g)));
        }
    for (int j = 0; j < n; j++) /* a force acts in the same way on closed motions and on others */
        for (int i = 0; i < p; i++)
            worst = fmax(worst, fabs(udd_Q[i + j * p] - all[s->u[i] + j * n]) / fmax(1, fabs(udd_Q[i + j * p])));
    printf("%-24s state space     %.1e\n", name, worst);
    CHECK(worst < 1e-9);
    kempe_linearization_free(l);
    free(udd_u), free(udd_ud), free(udd_Q), free(qdd), free(all);
}

/* -- models ------------------------------------------------------------------------------------------ */

/* Model, the step of the differences, and whether its state space has the same states. */
static const struct {
    const char *name;
    double step;
    bool has_space;
} models[] = {{"four_bar", 1e-3, true},
              {"slider_crank", 1e-3, true},
              {"delta_robot", 1e-3, true},
              {"stewart", 1e-3, true},
              {"andrews", 1e-3, true},
              {"suspension", 1e-3, true},
              {"bricard", 1e-3, true},
              {"parallel_robot", 1e-3, true},
              {"double_wishbone", 1e-3, true},
              {"flexible_slider_crank", 1e-6, true},
              {"hydraulic_excavator", 1e-3, false}};

static void random_states(void)
{
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        char path[MOST];
        snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", models[k].name, models[k].name);
        scene s = scene_new(path, "slip");
        all_coordinates(&s, models[k].name, models[k].step);
        closed_motions(&s, models[k].name, models[k].step);
        if (models[k].has_space)
            state_space(&s, models[k].name);
        scene_free(&s);
    }
}

/* Friction that sticks: the accelerations of its rows are zero, for any force that it holds. */
static void sticking(void)
{
    scene s = scene_new(KEMPE_ROOT "/examples/stick_slip/stick_slip.yaml", "stick");
    const int n = s.n, m = s.m;
    double *qdd = room(n), *lambda = room(m), *by_q = room(n * n), *by_Q = room(n * n), *force_q = room(m * n),
           worst = 0;
    double *force_Q = room(m * n), *column = room(n + m);
    memset(s.q, 0, (size_t)n * sizeof *s.q);
    memset(s.qd, 0, (size_t)n * sizeof *s.qd);
    memset(s.Q, 0, (size_t)n * sizeof *s.Q);
    const kempe_workspace_derivatives out = {.qdd_q = by_q, .qdd_Q = by_Q, .lambda_q = force_q, .lambda_Q = force_Q};
    CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, s.Q, qdd, lambda, &out) == KEMPE_OK);
    int x = 0;
    while (x < n - 1 && strcmp(kempe_model_coordinate_name(s.model, x), "x") != 0)
        x++;
    CHECK(by_Q[x + x * n] == 0 && m == 1);
    CHECK_NEAR(force_Q[x], -1, 1e-12);
    for (int k = 0; k < 2; k++)
        for (int j = 0; j < n; j++) {
            memcpy(column, (k ? by_Q : by_q) + j * n, (size_t)n * sizeof *column);
            memcpy(column + n, (k ? force_Q : force_q) + j * m, (size_t)m * sizeof *column);
            const probe p = {
                .s = &s, .count = n + m, .values = accelerations, .changed = k ? s.Q : s.q, .k = j, .step = 5e-4};
            worst = fmax(worst, column_error(&p, column));
        }
    printf("%-24s sticking        %.1e\n", "stick_slip", worst);
    CHECK(worst < 1e-9);
    CHECK(kempe_workspace_keep_modes(s.ws, s.ws) == KEMPE_OK);
    closed_motions(&s, "stick_slip", 5e-4);
    free(qdd), free(lambda), free(by_q), free(by_Q), free(force_q), free(force_Q), free(column);
    scene_free(&s);
}

/* The start of a model with contacts: in the modes of this state derivatives stand beside differences, also of forces
 * that depend on multipliers. */
static void touching(void)
{
    static const char *const names[] = {"bowling_ball", "toggle_press", "jansen_walker"};
    for (int k = 0; k < 3; k++) {
        char path[512];
        snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", names[k], names[k]);
        scene s = scene_new(path, "stick");
        kempe_assembly *a = NULL;
        CHECK(kempe_assembly_new(s.system, &a) == KEMPE_OK);
        memcpy(s.q, kempe_assembly_q(a), (size_t)s.n * sizeof *s.q);
        memcpy(s.qd, kempe_assembly_qd(a), (size_t)s.n * sizeof *s.qd);
        kempe_assembly_free(a);
        CHECK(kempe_workspace_mode_count(s.ws) > 0 && !kempe_workspace_mode(s.ws, 0));
        CHECK(kempe_workspace_keep_modes(s.ws, s.ws) == KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(s.ws), "evaluate a state first"));
        CHECK(kempe_workspace_close(s.ws, T, s.q, s.qd, NULL) == KEMPE_OK);
        CHECK(kempe_workspace_evaluate(s.ws, T, s.q, s.qd) == KEMPE_OK);
        CHECK(kempe_workspace_keep_modes(s.ws, s.ws) == KEMPE_OK);
        if (k == 0) {
            CHECK_TEXT(kempe_workspace_mode_name(s.ws, 0), "lane");
            CHECK_TEXT(kempe_workspace_mode(s.ws, 0), "closed");
            CHECK_TEXT(kempe_workspace_mode(s.ws, 1), "slips");
        }
        all_coordinates(&s, names[k], 5e-4);
        closed_motions(&s, names[k], 5e-4);
        scene_free(&s);
    }
}

/* A block on a floor that a force draws along and presses: m = 2, mu = 0.5, g = 10. */
#define BLOCK                                                                                                          \
    "kempe: 1\ngravity: [0, -10, 0]\nground: {points: {O: [0, 0, 0]}}\nparameters: {mu: 0.5}\n"                        \
    "bodies: {block: {joint: {at: ground, name: J, motions: [T1, T2]}, mass: 2, "                                      \
    "points: {P: [0, 0, 0]}}}\n"                                                                                       \
    "contacts: {floor: {point: block.P, on: {plane: ground.O, normal: y}, restitution: 0, friction: mu}}\n"

/* Accelerations of the block, its force on the floor, and the derivative of qdd.x by the force Q.y, beside closed
 * forms. */
static void check_block(kempe_workspace *ws, double rate, double Qx, const char *floor, const char *rub, double qdd_x,
                        double by_press, double by_mu)
{
    const double q[2] = {0.2, 0}, qd[2] = {rate, 0}, Q[2] = {Qx, -6};
    double qdd[2], lambda[2], by_Q[4], udd_Q[4], by_p[2];
    const kempe_workspace_derivatives out = {.qdd_Q = by_Q, .qdd_p = by_p, .udd_Q = udd_Q};
    CHECK(kempe_workspace_forward_derivatives(ws, 0, q, qd, Q, qdd, lambda, &out) == KEMPE_OK);
    CHECK_TEXT(kempe_workspace_mode(ws, 0), floor);
    CHECK_TEXT(kempe_workspace_mode(ws, 1), rub);
    CHECK_NEAR(qdd[0], qdd_x, 1e-12);
    CHECK_NEAR(qdd[1], 0, 1e-12);
    CHECK_NEAR(by_Q[0 + 1 * 2], by_press, 1e-12);
    CHECK_NEAR(by_p[0], by_mu, 1e-12);
    CHECK(kempe_workspace_independent_count(ws) == 2);
    for (int k = 0; k < 2; k++)
        CHECK_NEAR(udd_Q[k + 1 * 2], by_Q[kempe_workspace_independent(ws)[k] + 1 * 2], 1e-14);
}

static void block_on_floor(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL, *other_system = NULL;
    kempe_workspace *ws = NULL, *other = NULL;
    const double q[2] = {0.2, 0}, under[3] = {0.2, -0.01, 0}, still[3] = {0}, down[3] = {0, -1, 0};
    double qdd[2];
    CHECK(kempe_model_read_text(context, BLOCK, "block", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK && kempe_system_new(model, &other_system) == KEMPE_OK);
    CHECK(kempe_workspace_new_with_friction(system, "stick", &ws) == KEMPE_OK);
    CHECK(kempe_workspace_add_derivatives(ws, 1, (const char *const[]){"mu"}, NULL) == KEMPE_OK);
    check_block(ws, 3, 0, "closed", "slips", -0.5 * 26 / 2, 0.5 / 2, -13);
    check_block(ws, -3, 0, "closed", "slips", 0.5 * 26 / 2, -0.5 / 2, 13);
    check_block(ws, 0, 5, "closed", "sticks", 0, 0, 0);
    check_block(ws, 0, 15, "closed", "slips", (15 - 13) / 2.0, 0.5 / 2, -13);
    /* Modes that are kept are those of the last state, also in another workspace; then they are decided on again. */
    CHECK(kempe_workspace_new_with_friction(system, "stick", &other) == KEMPE_OK);
    CHECK(kempe_workspace_keep_modes(ws, ws) == KEMPE_OK && kempe_workspace_keep_modes(other, ws) == KEMPE_OK);
    CHECK(kempe_workspace_forward_dynamics(ws, 0, q, still, NULL, qdd, NULL) == KEMPE_OK);
    CHECK_NEAR(qdd[0], -5, 1e-12);
    CHECK(kempe_workspace_forward_dynamics(other, 0, under, down, NULL, qdd, NULL) == KEMPE_OK);
    CHECK_NEAR(qdd[0], -5, 1e-12);
    CHECK(kempe_workspace_keep_modes(ws, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_forward_dynamics(ws, 0, q, still, NULL, qdd, NULL) == KEMPE_OK && qdd[0] == 0);
    CHECK(kempe_workspace_forward_dynamics(ws, 0, under, still, NULL, qdd, NULL) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(ws), "contact 'floor' overlaps by 0.01 m"));
    CHECK(kempe_workspace_forward_dynamics(ws, 0, q, down, NULL, qdd, NULL) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(ws), "contact 'floor' strikes with 1 m/s"));
    /* Without decisions there are no accelerations. */
    kempe_workspace_free(other);
    CHECK(kempe_workspace_new_with_friction(other_system, "slip", &other) == KEMPE_OK);
    CHECK(kempe_workspace_mode_count(other) == 0 && !kempe_workspace_mode_name(other, 0));
    CHECK(kempe_workspace_forward_dynamics(other, 0, q, still, NULL, qdd, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(other), "contact 'floor' opens and closes"));
    CHECK(check_says(kempe_workspace_message(other), "(stick)"));
    CHECK(kempe_workspace_keep_modes(ws, other) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(ws), "other workspace"));
    kempe_workspace_free(other);
    kempe_workspace_free(ws);
    kempe_system_free(system), kempe_system_free(other_system);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void refuse(const char *path, const char *word)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_workspace *ws = NULL;
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK && kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_workspace_new(system, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_add_derivatives(ws, 0, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(ws), word));
    kempe_workspace_free(ws);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void refused(void)
{
    refuse(KEMPE_ROOT "/examples/jansen_walker/jansen_walker.yaml", "contact");
    scene s = scene_new(KEMPE_ROOT "/examples/four_bar/four_bar.yaml", "slip");
    kempe_workspace *other = NULL;
    double qdd[3];
    const kempe_workspace_derivatives none = {0};
    CHECK(kempe_workspace_new(s.system, &other) == KEMPE_OK);
    CHECK(kempe_workspace_forward_derivatives(other, T, s.q, s.qd, NULL, qdd, NULL, &none) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(other), "kempe_workspace_add_derivatives"));
    CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, NULL, qdd, NULL, &none) == KEMPE_OK);
    CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, NULL, qdd, NULL, NULL) == KEMPE_E_ARGUMENT);
    double udd = 0;
    const kempe_workspace_derivatives closed = {.udd_u = &udd};
    s.q[0] += 0.3;
    CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, NULL, qdd, NULL, &closed) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(s.ws), "close the state first"));
    CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, NULL, qdd, NULL, &none) == KEMPE_OK);
    static const char *const wrong[][2] = {{"crank_mass", "crank_mass"}, {"crank_mass", "crnk"}};
    for (int k = 0; k < 2; k++) {
        CHECK(kempe_workspace_add_derivatives(s.ws, 2, wrong[k], NULL) == KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(s.ws), k ? "crnk" : "given twice"));
        CHECK(kempe_workspace_name_count(s.ws) == 0);
        CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, NULL, qdd, NULL, &none) == KEMPE_OK);
    }
    CHECK(kempe_workspace_add_derivatives(s.ws, 0, NULL, "q(crank)") == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "q_u"));
    static const char *const multipliers[] = {"lambda", "lambda(C)"};
    for (int k = 0; k < 2; k++) {
        CHECK(kempe_workspace_add_derivatives(s.ws, 0, NULL, multipliers[k]) == KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(s.ws), "lambda_q, lambda_qd"));
        CHECK(check_says(kempe_workspace_message(s.ws), "lambda(C.1)"));
    }
    CHECK(kempe_workspace_add_derivatives(s.ws, 0, NULL, "position(coupler.Z)") == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "coupler"));
    CHECK(kempe_workspace_output_count(s.ws) == 0 && !kempe_workspace_output_name(s.ws, 0));
    const kempe_state_direction both = {.q = s.q, .u = &udd};
    CHECK(kempe_workspace_forward_jvp(s.ws, T, s.q, s.qd, NULL, &both, NULL, &(kempe_forward_values){.qdd = qdd}) ==
          KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "of all coordinates, or"));
    CHECK(kempe_workspace_forward_vjp(other, T, s.q, s.qd, NULL, &(kempe_forward_values){.qdd = qdd}, NULL,
                                      &(kempe_state_gradient){.q = qdd}) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_inverse_derivatives(other, T, s.q, s.qd, s.Q, qdd, &(kempe_inverse_derivatives){0}) ==
          KEMPE_E_ARGUMENT);
    const kempe_forward_values weight = {.qdd = qdd};
    const kempe_state_direction direction = {.q = s.q}, pair[] = {{.q = s.q}, {.u = &udd}}, names = {.p = &udd};
    double H[4];
    CHECK(kempe_workspace_add_hessians(other) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(other), "kempe_workspace_add_derivatives"));
    CHECK(kempe_workspace_forward_hessian(s.ws, T, s.q, s.qd, NULL, &weight, 1, &direction, H) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "kempe_workspace_add_hessians"));
    CHECK(kempe_workspace_add_hessians(s.ws) == KEMPE_OK);
    CHECK(kempe_workspace_forward_hessian(s.ws, T, s.q, s.qd, NULL, &weight, 1, &direction, H) == KEMPE_OK);
    CHECK(kempe_workspace_forward_hessian(s.ws, T, s.q, s.qd, NULL, &weight, 2, pair, H) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "of all coordinates, or"));
    CHECK(kempe_workspace_forward_hessian(s.ws, T, s.q, s.qd, NULL, &weight, 1, &names, H) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "leave out p"));
    CHECK(kempe_workspace_forward_hessian(s.ws, T, s.q, s.qd, NULL, &weight, -1, &direction, H) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_forward_hessian(s.ws, T, s.q, s.qd, NULL, &weight, 1, pair + 1, H) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(s.ws), "close the state first"));
    kempe_workspace_free(other);
    scene_free(&s);
}

/* -- numbers that are not finite, interrupts, and models without steps ---------------------------------- */

static void not_finite(void)
{
    scene s = scene_new(KEMPE_ROOT "/examples/four_bar/four_bar.yaml", "slip");
    CHECK(kempe_workspace_add_derivatives(s.ws, 1, (const char *const[]){"crank_mass"}, "position(coupler.C)") ==
          KEMPE_OK);
    CHECK(kempe_workspace_add_second_derivatives(s.ws) == KEMPE_OK);
    double bad[3] = {0, NAN, INFINITY}, one[3] = {1, 0, 0}, qdd[3], q[3], qd[3];
    const kempe_forward_values change = {.qdd = qdd};
    const kempe_state_gradient gradient = {.Q = qdd};
    const struct {
        kempe_state_direction direction;
        const char *says;
    } wrong[] = {{{.q = bad}, "the change of q of 'coupler' is nan: give a finite number"},
                 {{.qd = bad}, "the change of qd of 'coupler' is nan"},
                 {{.Q = bad + 2}, "the change of Q of 'crank' is inf"},
                 {{.p = bad + 1}, "the change of 'crank_mass' is nan"},
                 {{.u = bad + 1}, "the change of u of 'coupler' is nan"},
                 {{.ud = bad + 1}, "the change of ud of 'coupler' is nan"}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        CHECK(kempe_workspace_forward_jvp(s.ws, T, s.q, s.qd, NULL, &wrong[k].direction, NULL, &change) ==
              KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(s.ws), wrong[k].says));
        const kempe_state_direction good = {.q = one};
        for (int second = 0; second < 2 && k < 3; second++) {
            CHECK(kempe_workspace_forward_second(s.ws, T, s.q, s.qd, NULL, second ? &good : &wrong[k].direction,
                                                 second ? &wrong[k].direction : &good, &change) == KEMPE_E_ARGUMENT);
            CHECK(check_says(kempe_workspace_message(s.ws), wrong[k].says));
        }
    }
    const kempe_forward_values weight[] = {{.qdd = bad}, {.lambda = bad}, {.y = bad}};
    static const char *const says[] = {"the weight of qdd of 'coupler' is nan", "the weight of lambda of 'C.2' is nan",
                                       "the weight of output 'position.coupler.C.y' is nan"};
    for (int k = 0; k < 3; k++) {
        CHECK(kempe_workspace_forward_vjp(s.ws, T, s.q, s.qd, NULL, &weight[k], NULL, &gradient) == KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(s.ws), says[k]));
    }
    const kempe_state_direction good = {.q = one};
    const kempe_forward_values by_one = {.qdd = one};
    const kempe_workspace_derivatives none = {0};
    memcpy(q, s.q, sizeof q);
    memcpy(qd, s.qd, sizeof qd);
    for (int k = 0; k < 6; k++) {
        const kempe_status status[] = {
            kempe_workspace_forward_jvp(s.ws, NAN, q, qd, NULL, &good, NULL, &change),
            kempe_workspace_forward_vjp(s.ws, NAN, q, qd, NULL, &by_one, NULL, &gradient),
            kempe_workspace_forward_second(s.ws, NAN, q, qd, NULL, &good, &good, &change),
            kempe_workspace_forward_derivatives(s.ws, NAN, q, qd, NULL, qdd, NULL, &none),
            kempe_workspace_inverse_derivatives(s.ws, NAN, q, qd, one, qdd, &(kempe_inverse_derivatives){0}),
            kempe_workspace_step(s.ws, NAN, 1e-3, 1, q, qd, NULL, NULL)};
        CHECK(status[k] == KEMPE_E_ARGUMENT && check_says(kempe_workspace_message(s.ws), "the time t is nan"));
    }
    CHECK(kempe_workspace_step(s.ws, T, NAN, 1, q, qd, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_step(s.ws, T, 1e-3, 1, bad, qd, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "q of 'coupler' is nan"));
    CHECK(kempe_workspace_step(s.ws, T, 1e-3, 1, q, bad, NULL, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_step(s.ws, T, 1e-3, 1, q, qd, bad, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "Q of 'coupler' is nan"));
    CHECK(memcmp(q, s.q, sizeof q) == 0 && memcmp(qd, s.qd, sizeof qd) == 0);
    scene_free(&s);
}

/* An interrupt ends steps and states between two of them, and only one call; one step or state is never ended. */
static void interrupts(void)
{
    enum { COUNT = 3 };
    scene s = scene_new(KEMPE_ROOT "/examples/four_bar/four_bar.yaml", "slip");
    double q[3 * COUNT], qd[3 * COUNT], qdd[3 * COUNT], M[9 * COUNT];
    const double t = T;
    const kempe_workspace_derivatives none = {0};
    const kempe_workspace_rows rows = {.mass = M};
    const kempe_forward_values weights = {.qdd = q};
    const kempe_state_direction direction = {.q = s.q};
    for (int k = 0; k < COUNT; k++) {
        memcpy(q + 3 * k, s.q, 3 * sizeof *q);
        memcpy(qd + 3 * k, s.qd, 3 * sizeof *q);
    }
    CHECK(kempe_workspace_add_hessians(s.ws) == KEMPE_OK);
    for (int kind = 0; kind < 5; kind++)
        for (int count = 1; count <= COUNT; count += COUNT - 1)
            for (int again = 0; again < 2; again++) {
                int failed = -2;
                if (!again)
                    kempe_context_interrupt(s.context);
                const kempe_status status =
                    kind == 0 ? kempe_workspace_step(s.ws, T, 1e-3, count, q, qd, NULL, NULL)
                    : kind == 1
                        ? kempe_workspace_derivative_states(s.ws, count, &t, 0, q, qd, NULL, qdd, NULL, &none, &failed)
                    : kind == 2 ? kempe_workspace_forward_states(s.ws, count, &t, 0, q, qd, NULL, qdd, NULL, &failed)
                    : kind == 3 ? kempe_workspace_hessian_states(s.ws, count, &t, 0, q, qd, NULL, &weights, 1,
                                                                 &direction, M, &failed)
                                : kempe_workspace_evaluate_states(s.ws, count, &t, 0, q, qd, &rows, &failed);
                const bool ends = count > 1 && !again;
                CHECK(status == (ends ? KEMPE_STOPPED : KEMPE_OK));
                CHECK(!ends || check_says(kempe_workspace_message(s.ws),
                                          kind ? "interrupted after 1 of 3 states" : "interrupted after 1 of 3 steps"));
                CHECK(kind == 0 || failed == (ends ? 1 : -1));
                kempe_context_clear_interrupt(s.context);
            }
    scene_free(&s);
}

/* The message of many states is of the first that leaves a table. */
static void table_left(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_workspace *ws = NULL;
    const double t = 0, q[] = {0.5, 3, 0.2}, qd[] = {0, 0, 0};
    double qdd[3];
    CHECK(kempe_model_read_text(context,
                                "kempe: 1\ntables: {pull: {x: [0, 1, 2], y: [0, 1, 3]}}\n"
                                "bodies: {a: {joint: {prismatic: x, at: ground}, mass: 2}}\n"
                                "forces: {f: {joint: a, force: \"-pull(q(a))\"}}\n",
                                "table", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK && kempe_workspace_new(system, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_add_derivatives(ws, 0, NULL, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_derivative_states(ws, 3, &t, 0, q, qd, NULL, qdd, NULL, &(kempe_workspace_derivatives){0},
                                            NULL) == KEMPE_OK);
    CHECK(check_says(kempe_workspace_message(ws), "pull") && check_says(kempe_workspace_message(ws), "3"));
    CHECK(kempe_workspace_derivative_states(ws, 1, &t, 0, q, qd, NULL, qdd, NULL, &(kempe_workspace_derivatives){0},
                                            NULL) == KEMPE_OK);
    CHECK_TEXT(kempe_workspace_message(ws), "");
    kempe_workspace_free(ws);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void refuse_steps(const char *text, const char *friction, kempe_status expected, const char *word)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_workspace *ws = NULL;
    double q[8] = {0.4}, qd[8] = {0};
    CHECK(kempe_model_read_text(context, text, "steps", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_workspace_new_with_friction(system, friction, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_step(ws, 0, 1e-3, 1, q, qd, NULL, NULL) == KEMPE_E_ARGUMENT); /* not prepared */
    CHECK(kempe_workspace_add_derivatives(ws, 0, NULL, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_step(ws, 0, 1e-3, 1, q, qd, NULL, NULL) == expected && q[0] == 0.4);
    CHECK(check_says(kempe_workspace_message(ws), word));
    kempe_workspace_free(ws);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

#define ARM "kempe: 1\nbodies: {arm: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 0, 0], inertia: {zz: 1}}}\n"

static void no_steps(void)
{
    refuse_steps(ARM "states: {i: {start: 4, sample: 0.1, next: i + 1}}\n", "slip", KEMPE_E_ARGUMENT, "state 'i'");
    refuse_steps(ARM "states: {seen: {delay: q(arm), time: 0.1}}\n", "slip", KEMPE_E_ARGUMENT, "state 'seen'");
    refuse_steps(ARM "states: {n: {start: 0, when: q(arm) > 9, next: n + 1}}\n", "slip", KEMPE_E_ARGUMENT, "state 'n'");
    refuse_steps(ARM "forces: {f: {joint: arm, friction: {torque: 2}}}\n", "stick", KEMPE_E_ARGUMENT, "use a flow");
    /* A mechanism whose loops cannot be assembled has no independent coordinates. */
    refuse_steps("kempe: 1\nground: {points: {D: [5, 0, 0]}}\nbodies:\n"
                 "  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {B: [1, 0, 0]}}\n"
                 "  b: {joint: {revolute: z, at: a.B}, mass: 1, inertia: {zz: 1}, points: {C: [1, 0, 0]}}\n"
                 "loops: {C: {ball: [b.C, ground.D]}}\n",
                 "slip", KEMPE_E_FAILED, "independent coordinates");
}

int main(void)
{
    TEST(random_states);
    TEST(named);
    TEST(inverse);
    TEST(outputs_and_products);
    TEST(second_derivatives);
    TEST(hessians);
    TEST(hessians_beside_second_derivatives);
    TEST(hessian_with_force);
    TEST(determinants);
    TEST(steps);
    TEST(sticking);
    TEST(touching);
    TEST(block_on_floor);
    TEST(refused);
    TEST(not_finite);
    TEST(interrupts);
    TEST(table_left);
    TEST(no_steps);
    return check_report();
}
