/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: analyses */
/* Forces of actuators at a state: forward dynamics with them has the accelerations that were wanted; redundant
 * actuators share them by their weights, the least sum; what cannot be produced is refused by name. Equations of closed
 * motions beside forward dynamics. */
#include "testing.h"
#include <kempe/check.h>
#include <kempe/inverse.h>
#include <stdlib.h>

enum { MOST = 64 };

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kempe_workspace *ws;
    int n, m, p;
    double q[MOST], qd[MOST];
} scene;

static scene scene_new(const char *model)
{
    scene s = {.context = kempe_context_new()};
    char path[4096];
    kempe_assembly *a = NULL;
    snprintf(path, sizeof path, KEMPE_ROOT "/examples/%s/%s.yaml", model, model);
    CHECK(kempe_model_read(s.context, path, &s.model) == KEMPE_OK && kempe_system_new(s.model, &s.system) == KEMPE_OK);
    CHECK(kempe_workspace_new(s.system, &s.ws) == KEMPE_OK && kempe_assembly_new(s.system, &a) == KEMPE_OK);
    s.n = kempe_model_coordinate_count(s.model), s.m = kempe_system_row_count(s.system);
    s.p = kempe_workspace_independent_count(s.ws);
    CHECK(s.n <= MOST && s.m <= MOST);
    for (int i = 0; i < s.n; i++) {
        s.q[i] = kempe_assembly_q(a)[i];
        s.qd[i] = 0.3 * sin(1.0 + i);
    }
    CHECK(kempe_workspace_close(s.ws, 0, s.q, s.qd, NULL) == KEMPE_OK);
    kempe_assembly_free(a);
    return s;
}

static void scene_free(scene *s)
{
    kempe_workspace_free(s->ws);
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

static int coordinate(const scene *s, const char *name)
{
    for (int i = 0; i < s->n; i++)
        if (strcmp(kempe_model_coordinate_name(s->model, i), name) == 0)
            return i;
    CHECK(0);
    return 0;
}

/* Accelerations of all coordinates for these of the independent ones. */
static void complete(const scene *s, const double *udd, double *qdd)
{
    static double X[MOST * MOST], drift[MOST];
    const kempe_closed_equations out = {.X = X, .drift = drift};
    CHECK(kempe_workspace_closed_equations(s->ws, 0, s->q, s->qd, &out) == KEMPE_OK);
    for (int i = 0; i < s->n; i++) {
        qdd[i] = drift[i];
        for (int k = 0; k < s->p; k++)
            qdd[i] += X[i + k * s->n] * udd[k];
    }
}

/* Forces for wanted accelerations; the largest difference of forward dynamics with them. */
static double error_of(const scene *s, int count, const char *const *names, const double *weights, double *tau)
{
    double udd[MOST], qdd[MOST], Q[MOST] = {0}, again[MOST], lambda[MOST], forces[MOST], worst = 0;
    for (int k = 0; k < s->p; k++)
        udd[k] = 2 + 0.7 * k;
    complete(s, udd, qdd);
    CHECK(kempe_workspace_add_actuators(s->ws, count, names, weights) == KEMPE_OK);
    CHECK(kempe_workspace_actuator_count(s->ws) == count);
    CHECK(kempe_workspace_actuator_forces(s->ws, 0, s->q, s->qd, qdd, tau, lambda) == KEMPE_OK);
    for (int k = 0; k < count; k++)
        Q[coordinate(s, names[k])] = tau[k];
    CHECK(kempe_workspace_forward_dynamics(s->ws, 0, s->q, s->qd, Q, again, forces) == KEMPE_OK);
    for (int i = 0; i < s->n; i++)
        worst = fmax(worst, fabs(again[i] - qdd[i]) / fmax(1, fabs(qdd[i])));
    for (int r = 0; r < s->m; r++)
        worst = fmax(worst, fabs(forces[r] - lambda[r]) / fmax(1, fabs(lambda[r])));
    return worst;
}

static void wanted_accelerations(void)
{
    double tau[MOST];
    scene s = scene_new("four_bar");
    CHECK(error_of(&s, 1, (const char *const[]){"crank"}, NULL, tau) < 1e-10);
    scene_free(&s);
    s = scene_new("delta_robot");
    CHECK(error_of(&s, 3, (const char *const[]){"A1", "A2", "A3"}, NULL, tau) < 1e-9);
    scene_free(&s);
}

/* Two actuators on one degree of freedom: by their leverages over their weights. */
static void redundant_actuators(void)
{
    static const char *const names[] = {"crank", "rocker"};
    scene s = scene_new("four_bar");
    double tau[2], heavy[2], one, X[MOST];
    CHECK(error_of(&s, 1, names, NULL, &one) < 1e-10);
    CHECK(error_of(&s, 2, names, NULL, tau) < 1e-10);
    const kempe_closed_equations out = {.X = X};
    CHECK(kempe_workspace_closed_equations(s.ws, 0, s.q, s.qd, &out) == KEMPE_OK);
    const double ratio = X[coordinate(&s, "rocker")] / X[coordinate(&s, "crank")];
    CHECK_NEAR(tau[1] / tau[0], ratio, 1e-10 * fabs(ratio));
    CHECK_NEAR(tau[0] + ratio * tau[1], one, 1e-9 * fabs(one)); /* the same effect */
    CHECK(error_of(&s, 2, names, (const double[]){1, 4}, heavy) < 1e-10);
    CHECK_NEAR(heavy[1] / heavy[0], ratio / 4, 1e-10 * fabs(ratio));
    CHECK(tau[0] * tau[0] + tau[1] * tau[1] < one * one);
    scene_free(&s);
}

/* mass udd + bias = X' Q of forward dynamics with forces. */
static void closed_equations(void)
{
    static const char *const model[] = {"four_bar", "delta_robot", "stewart", "suspension"};
    for (size_t i = 0; i < sizeof model / sizeof *model; i++) {
        static double mass[MOST * MOST], X[MOST * MOST];
        scene s = scene_new(model[i]);
        double bias[MOST], drift[MOST], Q[MOST], qdd[MOST], worst = 0, size = 1;
        for (int k = 0; k < s.n; k++)
            Q[k] = cos(2.0 + k);
        const kempe_closed_equations out = {mass, bias, X, drift};
        CHECK(kempe_workspace_closed_equations(s.ws, 0, s.q, s.qd, &out) == KEMPE_OK);
        CHECK(kempe_workspace_forward_dynamics(s.ws, 0, s.q, s.qd, Q, qdd, NULL) == KEMPE_OK);
        const int *u = kempe_workspace_independent(s.ws);
        for (int k = 0; k < s.p; k++) {
            double sum = bias[k];
            size = fmax(size, fabs(bias[k]));
            for (int j = 0; j < s.p; j++)
                sum += mass[k + j * s.p] * qdd[u[j]];
            for (int j = 0; j < s.n; j++)
                sum -= X[j + k * s.n] * Q[j];
            worst = fmax(worst, fabs(sum));
        }
        for (int j = 0; j < s.n; j++) {
            double sum = drift[j];
            for (int k = 0; k < s.p; k++)
                sum += X[j + k * s.n] * qdd[u[k]];
            CHECK_NEAR(sum, qdd[j], 1e-8 * fmax(1, fabs(qdd[j])));
        }
        printf("%-12s %.1e\n", model[i], worst / size);
        CHECK(worst / size < 1e-9);
        scene_free(&s);
    }
}

static void refused(void)
{
    scene s = scene_new("delta_robot");
    double tau[3], qdd[MOST] = {0}, udd[MOST] = {1, 2, 3};
    static const char *const names[] = {"A1", "A2", "A3"};
    CHECK(kempe_workspace_actuator_count(s.ws) == 0);
    CHECK(kempe_workspace_actuator_forces(s.ws, 0, s.q, s.qd, qdd, tau, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "kempe_workspace_add_actuators"));
    CHECK(kempe_workspace_add_actuators(s.ws, 0, names, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_add_actuators(s.ws, 1, (const char *const[]){"A9"}, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "A9"));
    CHECK(kempe_workspace_add_actuators(s.ws, 2, (const char *const[]){"A1", "A1"}, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "given twice"));
    CHECK(kempe_workspace_add_actuators(s.ws, 1, names, (const double[]){-1}) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), "weight of actuator 'A1'"));
    complete(&s, udd, qdd);
    CHECK(kempe_workspace_add_actuators(s.ws, 2, names, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_actuator_forces(s.ws, 0, s.q, s.qd, qdd, tau, NULL) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(s.ws), "2 of 3 degrees of freedom"));
    CHECK(kempe_workspace_add_actuators(s.ws, 3, names, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_actuator_forces(s.ws, 0, s.q, s.qd, qdd, tau, NULL) == KEMPE_OK);
    const int *u = kempe_workspace_independent(s.ws);
    const double wanted = qdd[u[1]];
    qdd[u[1]] = NAN;
    CHECK(kempe_workspace_actuator_forces(s.ws, 0, s.q, s.qd, qdd, tau, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(s.ws), kempe_model_coordinate_name(s.model, u[1])));
    CHECK(check_says(kempe_workspace_message(s.ws), "is nan: give a finite number"));
    qdd[u[1]] = wanted;
    CHECK(kempe_workspace_actuator_forces(s.ws, NAN, s.q, s.qd, qdd, tau, NULL) == KEMPE_E_ARGUMENT);
    s.q[0] += 0.1;
    CHECK(kempe_workspace_actuator_forces(s.ws, 0, s.q, s.qd, qdd, tau, NULL) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(s.ws), "need closed loops"));
    scene_free(&s);
    s = scene_new("stick_slip");
    kempe_workspace *sticks = NULL;
    CHECK(kempe_workspace_new_with_friction(s.system, "stick", &sticks) == KEMPE_OK);
    CHECK(kempe_workspace_add_actuators(sticks, 1, (const char *const[]){"screw"}, NULL) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(sticks), "friction"));
    kempe_workspace_free(sticks);
    scene_free(&s);
}

/* Equations of closed motions are refused at open loops and rates, and for models that do not have them. */
static void no_closed_equations(void)
{
    scene s = scene_new("four_bar");
    double bias[MOST];
    const kempe_closed_equations out = {.bias = bias};
    CHECK(kempe_workspace_closed_equations(s.ws, 0, s.q, s.qd, NULL) == KEMPE_E_ARGUMENT);
    CHECK(kempe_workspace_closed_equations(s.ws, 0, s.q, s.qd, &out) == KEMPE_OK);
    CHECK_TEXT(kempe_workspace_message(s.ws), "");
    s.qd[0] += 0.1;
    CHECK(kempe_workspace_closed_equations(s.ws, 0, s.q, s.qd, &out) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(s.ws), "equations of closed motions need velocities that keep the loops"));
    CHECK(check_says(kempe_workspace_message(s.ws), "'C.1'") || check_says(kempe_workspace_message(s.ws), "'C.2'"));
    s.q[0] += 0.1;
    CHECK(kempe_workspace_closed_equations(s.ws, 0, s.q, s.qd, &out) == KEMPE_E_FAILED);
    CHECK(check_says(kempe_workspace_message(s.ws), "equations of closed motions need closed loops"));
    scene_free(&s);
    static const char *const model[] = {"jansen_walker", "rolling_wheel"};
    static const char *const says[] = {"contact", "depends on the multiplier of constraint equation"};
    for (int k = 0; k < 2; k++) {
        scene without = scene_new(model[k]);
        CHECK(kempe_workspace_closed_equations(without.ws, 0, without.q, without.qd, &out) == KEMPE_E_ARGUMENT);
        CHECK(check_says(kempe_workspace_message(without.ws), says[k]));
        scene_free(&without);
    }
    s = scene_new("stick_slip");
    kempe_workspace *sticks = NULL;
    CHECK(kempe_workspace_new_with_friction(s.system, "stick", &sticks) == KEMPE_OK);
    CHECK(kempe_workspace_closed_equations(sticks, 0, s.q, s.qd, &out) == KEMPE_E_ARGUMENT);
    CHECK(check_says(kempe_workspace_message(sticks), "while friction may stick: make the workspace with"));
    kempe_workspace_free(sticks);
    scene_free(&s);
}

int main(void)
{
    TEST(wanted_accelerations);
    TEST(redundant_actuators);
    TEST(closed_equations);
    TEST(refused);
    TEST(no_closed_equations);
    return check_report();
}
