/* SPDX-License-Identifier: BSD-3-Clause */
/* The equations at a state: held against differences, against each other, against a run, and on four threads at once.
 */
#include "four_bar.h"
#include <kempe/check.h>
#include <kempe/workspace.h>
#include <pthread.h>

enum { N = 3, M = 2 };

typedef struct scene {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kempe_workspace *ws;
    double q[N], qd[N];
} scene;

static scene scene_new(void)
{
    scene s = {0};
    kempe_assembly *assembly = NULL;
    s.context = kempe_context_new();
    s.model = four_bar_new(s.context, FOUR_BAR_TORQUE);
    CHECK(kempe_system_new(s.model, &s.system) == KEMPE_OK);
    CHECK(kempe_model_coordinate_count(s.model) == N && kempe_system_row_count(s.system) == M);
    CHECK(kempe_workspace_new(s.system, &s.ws) == KEMPE_OK);
    CHECK(kempe_assembly_new(s.system, &assembly) == KEMPE_OK);
    memcpy(s.q, kempe_assembly_q(assembly), sizeof s.q);
    memcpy(s.qd, kempe_assembly_qd(assembly), sizeof s.qd);
    kempe_assembly_free(assembly);
    return s;
}

static void scene_free(scene *s)
{
    kempe_workspace_free(s->ws);
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    kempe_context_free(s->context);
}

/* h of the closed four-bar is the difference of two chains of bars, in the ground's axes. */
static void closure_by_hand(void)
{
    scene s = scene_new();
    double q[N] = {0.3, 0.5, -0.7}, crank = 0.3, coupler = 0.8, rocker = 0.7;
    CHECK(kempe_workspace_evaluate(s.ws, 0, q, NULL) == KEMPE_OK);
    const double *h = kempe_workspace_h(s.ws), *J = kempe_workspace_jacobian(s.ws);
    double x = 0.9 + rocker * cos(q[2]) - crank * cos(q[0]) - coupler * cos(q[0] + q[1]);
    double y = rocker * sin(q[2]) - crank * sin(q[0]) - coupler * sin(q[0] + q[1]);
    CHECK_NEAR(h[0] * h[0] + h[1] * h[1], x * x + y * y, 1e-14);
    CHECK_NEAR(J[0] * J[0] + J[1] * J[1], pow(crank, 2) + pow(coupler, 2) + 2 * crank * coupler * cos(q[1]), 1e-14);
    CHECK_NEAR(J[4] * J[4] + J[5] * J[5], rocker * rocker, 1e-14);
    scene_free(&s);
}

/* J and jdqd by central differences of h along the motion q(t) = q + qd t. */
static void derivatives(void)
{
    scene s = scene_new();
    const double q[N] = {0.3, 0.5, -0.7}, qd[N] = {1.5, -0.4, 0.9}, step = 1e-4;
    double h[3][M];
    for (int k = 0; k < 3; k++) {
        double at[N];
        for (int i = 0; i < N; i++)
            at[i] = q[i] + (k - 1) * step * qd[i];
        CHECK(kempe_workspace_evaluate(s.ws, 0, at, qd) == KEMPE_OK);
        memcpy(h[k], kempe_workspace_h(s.ws), sizeof h[k]);
    }
    CHECK(kempe_workspace_evaluate(s.ws, 0, q, qd) == KEMPE_OK);
    const double *J = kempe_workspace_jacobian(s.ws), *jdqd = kempe_workspace_jdqd(s.ws);
    for (int r = 0; r < M; r++) {
        double rate = 0;
        for (int k = 0; k < N; k++)
            rate += J[r + k * M] * qd[k];
        CHECK_NEAR(rate, (h[2][r] - h[0][r]) / (2 * step), 1e-7);
        CHECK_NEAR(jdqd[r], (h[2][r] - 2 * h[1][r] + h[0][r]) / (step * step), 1e-6);
    }
    scene_free(&s);
}

/* The law itself, and the first row of a run. */
static void dynamics(void)
{
    scene s = scene_new();
    double qdd[N], lambda[M], Q[N], back[N];
    CHECK(kempe_workspace_forward_dynamics(s.ws, 0, s.q, s.qd, NULL, qdd, lambda) == KEMPE_OK);
    CHECK(kempe_workspace_inverse_dynamics(s.ws, 0, s.q, s.qd, qdd, Q) == KEMPE_OK);
    const double *J = kempe_workspace_jacobian(s.ws), *mass = kempe_workspace_mass(s.ws);
    const double *jdqd = kempe_workspace_jdqd(s.ws);
    double kinetic = 0;
    for (int i = 0; i < N; i++) {
        CHECK_NEAR(Q[i], J[i * M] * lambda[0] + J[1 + i * M] * lambda[1], 1e-10);
        for (int k = 0; k < N; k++) {
            CHECK(mass[i + k * N] == mass[k + i * N]);
            kinetic += 0.5 * s.qd[i] * mass[i + k * N] * s.qd[k];
        }
    }
    for (int r = 0; r < M; r++)
        CHECK_NEAR(J[r] * qdd[0] + J[r + M] * qdd[1] + J[r + 2 * M] * qdd[2] + jdqd[r], 0, 1e-10);
    CHECK_NEAR(kempe_workspace_kinetic(s.ws), kinetic, 1e-14);

    /* efforts J' lambda on top leave the accelerations as they are */
    CHECK(kempe_workspace_forward_dynamics(s.ws, 0, s.q, s.qd, Q, back, lambda) == KEMPE_OK);
    for (int i = 0; i < N; i++)
        CHECK_NEAR(back[i], qdd[i], 1e-10);
    CHECK_NEAR(lambda[0], 0, 1e-9);

    kempe_trajectory *trajectory = NULL;
    kempe_run_options settings = {0};
    settings.t_end = 1e-3;
    CHECK(kempe_simulate(s.system, &settings, &trajectory) == KEMPE_OK);
    for (int i = 0; i < N; i++)
        CHECK_NEAR(qdd[i], kempe_trajectory_qdd(trajectory, 0)[i], 1e-10);
    kempe_trajectory_free(trajectory);
    scene_free(&s);
}

/* Without the motor's term in qd the energy is lost and gained by its torque alone: dE/dt = torque * qd. */
static void energy(void)
{
    scene s = scene_new();
    double qdd[N], e[2];
    const double step = 1e-5;
    CHECK(kempe_workspace_forward_dynamics(s.ws, 0, s.q, s.qd, NULL, qdd, NULL) == KEMPE_OK);
    for (int k = 0; k < 2; k++) {
        double dt = k == 0 ? -step : step, q[N], qd[N];
        for (int i = 0; i < N; i++) {
            q[i] = s.q[i] + dt * s.qd[i] + 0.5 * dt * dt * qdd[i];
            qd[i] = s.qd[i] + dt * qdd[i];
        }
        CHECK(kempe_workspace_evaluate(s.ws, 0, q, qd) == KEMPE_OK);
        e[k] = kempe_workspace_kinetic(s.ws) + kempe_workspace_potential(s.ws);
    }
    double torque = 0.2 - 0.01 * s.qd[0];
    CHECK_NEAR((e[1] - e[0]) / (2 * step), torque * s.qd[0], 1e-4);
    scene_free(&s);
}

static void closing(void)
{
    scene s = scene_new();
    double q[N] = {s.q[0] + 0.2, s.q[1], s.q[2]}, qd[N] = {7, 0, 0}, kept[N];
    const int hold[N] = {1, 0, 0}, hold_all[N] = {1, 1, 1};
    memcpy(kept, q, sizeof q);
    CHECK(kempe_workspace_close(s.ws, 0, q, qd, hold_all) == KEMPE_E_FAILED);
    CHECK(strlen(kempe_workspace_message(s.ws)) > 0);
    CHECK(memcmp(kept, q, sizeof q) == 0 && qd[0] == 7 && qd[1] == 0);
    CHECK(kempe_workspace_close(s.ws, 0, q, qd, hold) == KEMPE_OK);
    CHECK(q[0] == kept[0] && qd[0] == 7);
    CHECK(kempe_workspace_evaluate(s.ws, 0, q, qd) == KEMPE_OK);
    const double *h = kempe_workspace_h(s.ws), *J = kempe_workspace_jacobian(s.ws);
    for (int r = 0; r < M; r++) {
        CHECK_NEAR(h[r], 0, 1e-13);
        CHECK_NEAR(J[r] * qd[0] + J[r + M] * qd[1] + J[r + 2 * M] * qd[2], 0, 1e-12);
    }
    /* without a hold everything moves a little */
    q[0] += 0.1;
    double before = q[0];
    CHECK(kempe_workspace_close(s.ws, 0, q, NULL, NULL) == KEMPE_OK && q[0] != before && fabs(q[0] - before) < 0.1);
    scene_free(&s);
}

/* -- threads --------------------------------------------------------------------------------------- */

enum { THREADS = 4, STATES = 2000 };

typedef struct job {
    const scene *s;
    kempe_workspace *ws;
    double sum[2 * N + M];
    int failures;
} job;

/* Bits of many evaluations, added in order. */
static void *work(void *user)
{
    job *j = user;
    for (int k = 0; k < STATES; k++) {
        double q[N], qd[N], qdd[N], lambda[M];
        for (int i = 0; i < N; i++) {
            q[i] = j->s->q[i] + 1e-4 * k;
            qd[i] = j->s->qd[i] - 1e-3 * k;
        }
        j->failures += kempe_workspace_close(j->ws, 0, q, qd, NULL) != KEMPE_OK;
        j->failures += kempe_workspace_forward_dynamics(j->ws, 0, q, qd, NULL, qdd, lambda) != KEMPE_OK;
        for (int i = 0; i < N; i++) {
            j->sum[i] += qdd[i];
            j->sum[N + i] += q[i];
        }
        for (int r = 0; r < M; r++)
            j->sum[2 * N + r] += lambda[r];
    }
    return NULL;
}

static void threads(void)
{
    scene s = scene_new();
    job jobs[THREADS] = {{0}};
    pthread_t thread[THREADS];
    int started = 0;
    for (int k = 0; k < THREADS; k++) {
        jobs[k].s = &s;
        CHECK(kempe_workspace_new(s.system, &jobs[k].ws) == KEMPE_OK);
    }
    while (started < THREADS && pthread_create(&thread[started], NULL, work, &jobs[started]) == 0)
        started++;
    CHECK(started == THREADS);
    for (int k = 0; k < started; k++)
        CHECK(pthread_join(thread[k], NULL) == 0);
    for (int k = 0; k < THREADS; k++) {
        CHECK(jobs[k].failures == 0);
        CHECK(memcmp(jobs[k].sum, jobs[0].sum, sizeof jobs[0].sum) == 0);
        kempe_workspace_free(jobs[k].ws);
    }
    CHECK(isfinite(jobs[0].sum[0]));
    scene_free(&s);
}

static void statuses(void)
{
    CHECK_TEXT(kempe_status_text(KEMPE_OK), "done");
    CHECK_TEXT(kempe_status_text(KEMPE_E_MEMORY), "out of memory");
    for (int s = KEMPE_E_BUG; s <= KEMPE_UNTRUSTED; s++)
        CHECK(strlen(kempe_status_text((kempe_status)s)) > 3);
    CHECK_TEXT(kempe_outcome_text(KEMPE_OUTCOME_NOT_CHECKED), "complete, not checked");
    CHECK_TEXT(kempe_outcome_text(KEMPE_OUTCOME_NOT_TRUSTWORTHY), "not trustworthy");
    CHECK_TEXT(kempe_outcome_text((kempe_outcome)99), "");
    CHECK_TEXT(kempe_outcome_text(kempe_trajectory_outcome(NULL)), "");
}

int main(void)
{
    TEST(closure_by_hand);
    TEST(derivatives);
    TEST(dynamics);
    TEST(energy);
    TEST(closing);
    TEST(threads);
    TEST(statuses);
    return check_report();
}
