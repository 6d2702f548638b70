/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: analyses rail */
/* Derivatives of accelerations and multipliers at a state: beside central differences of forward dynamics, whose error
 * decreases with the square of the step; along closed motions beside differences of closed states, and beside the state
 * space of the linearisation, which is made in another way. */
#include "testing.h"
#include <kempe/check.h>
#include <kempe/derivatives.h>
#include <kempe/linearize.h>
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
    CHECK(kempe_workspace_add_derivatives(s.ws, 0, NULL) == KEMPE_OK &&
          kempe_workspace_add_derivatives(s.ws, 0, NULL) == KEMPE_OK);
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
 * order is removed (Richardson), relative to the largest value. */
static double column_error(const probe *p, const double *exact)
{
    const double step[] = {2 * p->step, p->step};
    double *at[4], error = 0, size = 1;
    for (int i = 0; i < 4; i++) {
        at[i] = room(p->count);
        p->values(p, (i % 2 ? -1 : 1) * step[i / 2], at[i]);
    }
    for (int i = 0; i < p->count; i++) {
        const double coarse = (at[0][i] - at[1][i]) / (2 * step[0]), fine = (at[2][i] - at[3][i]) / (2 * step[1]);
        size = fmax(size, fmax(fabs(exact[i]), fabs(at[0][i])));
        error = fmax(error, fabs((4 * fine - coarse) / 3 - exact[i]));
    }
    for (int i = 0; i < 4; i++)
        free(at[i]);
    return error / size;
}

/* -- all coordinates --------------------------------------------------------------------------------- */

static void accelerations(const probe *p, double change, double *out)
{
    const scene *s = p->s;
    const double kept = p->changed[p->k];
    p->changed[p->k] += change;
    CHECK(kempe_workspace_forward_dynamics(s->ws, T, s->q, s->qd, s->Q, out, out + s->n) == KEMPE_OK);
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
    accelerations(&(probe){.s = s, .changed = s->q}, 0, column);
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
    CHECK(kempe_workspace_add_derivatives(s.ws, count, names) == KEMPE_OK);
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
    const kempe_workspace_derivatives closed = {.udd_u = by_q};
    CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, s.Q, qdd, NULL, &closed) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(s.ws), "independent coordinates"));
    free(qdd), free(lambda), free(by_q), free(by_Q), free(force_q), free(force_Q), free(column);
    scene_free(&s);
}

static void refuse(const char *path, const char *word)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_workspace *ws = NULL;
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK && kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_workspace_new(system, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_add_derivatives(ws, 0, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(ws), word));
    kempe_workspace_free(ws);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

static void refused(void)
{
    refuse(KEMPE_ROOT "/examples/jansen_walker/jansen_walker.yaml", "contact");
    refuse(KEMPE_ROOT "/examples/rolling_wheel/rolling_wheel.yaml", "multiplier");
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
        CHECK(kempe_workspace_add_derivatives(s.ws, 2, wrong[k]) == KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(s.ws), k ? "crnk" : "given twice"));
        CHECK(kempe_workspace_name_count(s.ws) == 0);
        CHECK(kempe_workspace_forward_derivatives(s.ws, T, s.q, s.qd, NULL, qdd, NULL, &none) == KEMPE_OK);
    }
    CHECK(kempe_workspace_inverse_derivatives(other, T, s.q, s.qd, s.Q, qdd, &(kempe_inverse_derivatives){0}) ==
          KEMPE_E_ARGUMENT);
    kempe_workspace_free(other);
    scene_free(&s);
}

int main(void)
{
    TEST(random_states);
    TEST(named);
    TEST(inverse);
    TEST(sticking);
    TEST(refused);
    return check_report();
}
