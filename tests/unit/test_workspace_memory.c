/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: analyses */
/* A workspace allocates only when it is made. Steps allocate at their first call; where there is no memory then, the
 * next call tries again. */
#include "base/memory.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/check.h>
#include <kempe/derivatives.h>
#include <kempe/kempe.h>
#include <kempe/workspace.h>

static void no_allocation(const char *path)
{
    loaded l = load(path);
    kempe_workspace *ws = NULL;
    double q[16] = {0}, qd[16] = {0}, qdd[16], Q[16], lambda[16];
    CHECK(kempe_workspace_new(l.system, &ws) == KEMPE_OK);
    kempe_assembly *assembly = NULL;
    CHECK(kempe_assembly_new(l.system, &assembly) == KEMPE_OK);
    memcpy(q, kempe_assembly_q(assembly), (size_t)kempe_model_coordinate_count(l.model) * sizeof *q);
    kempe_assembly_free(assembly);
    unsigned long before = kmp_memory_count();
    CHECK(kempe_workspace_evaluate(ws, 0, q, qd) == KEMPE_OK);
    CHECK(kempe_workspace_close(ws, 0, q, qd, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_forward_dynamics(ws, 0, q, qd, NULL, qdd, lambda) == KEMPE_OK);
    CHECK(kempe_workspace_inverse_dynamics(ws, 0, q, qd, qdd, Q) == KEMPE_OK);
    CHECK(kmp_memory_count() == before);
    kempe_workspace_free(ws);
    unload(&l);
}

static void four_bar(void)
{
    no_allocation("examples/four_bar/four_bar.yaml");
}

/* Redundant rows. */
static void bricard(void)
{
    no_allocation("tests/models/bricard_balls.yaml");
}

static void steps_try_again(void)
{
    loaded l = load("examples/four_bar/four_bar.yaml");
    kempe_workspace *ws = NULL;
    double q[3] = {0}, qd[3] = {0}, x_x[4];
    const kempe_step_derivatives out = {.x_x = x_x};
    CHECK(kempe_workspace_new(l.system, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_add_derivatives(ws, 0, NULL, NULL) == KEMPE_OK);
    int failed = 0;
    for (bool done = false; !done && failed < 100; failed += !done) {
        kmp_memory_fail_at((unsigned long)failed + 1);
        const kempe_status status = kempe_workspace_step(ws, 0, 1e-3, 1, q, qd, NULL, &out);
        kmp_memory_fail_at(0);
        done = status == KEMPE_OK;
        CHECK(done || (status == KEMPE_E_MEMORY && q[0] == 0));
        if (!done && failed % 2 == 0) /* at once, and after the next failure */
            CHECK(kempe_workspace_step(ws, 0, 1e-3, 1, q, qd, NULL, &out) == KEMPE_OK);
        if (!done && failed % 2 == 0) { /* a workspace without the arrays of steps */
            kempe_workspace_free(ws);
            memset(q, 0, sizeof q), memset(qd, 0, sizeof qd);
            CHECK(kempe_workspace_new(l.system, &ws) == KEMPE_OK);
            CHECK(kempe_workspace_add_derivatives(ws, 0, NULL, NULL) == KEMPE_OK);
        }
    }
    CHECK(failed > 1);
    const unsigned long before = kmp_memory_count();
    CHECK(kempe_workspace_step(ws, 0, 1e-3, 9, q, qd, NULL, &out) == KEMPE_OK && kmp_memory_count() == before);
    kempe_workspace_free(ws);
    unload(&l);
}

/* Hessians and the determinant of the loops are prepared again after a failure; the calls themselves allocate at the
 * first one at most. */
static void hessians_try_again(void)
{
    loaded l = load("examples/four_bar/four_bar.yaml");
    kempe_workspace *ws = NULL;
    double q[3] = {0.3, 0, 0}, qd[3] = {0}, H[4], w[3] = {1, 2, 3}, unit[] = {1, 0};
    const double t = 0;
    const kempe_state_direction direction[] = {{.u = unit}, {.ud = unit}};
    const kempe_forward_values weight = {.qdd = w, .y = w};
    CHECK(kempe_workspace_new(l.system, &ws) == KEMPE_OK);
    CHECK(kempe_workspace_close(ws, 0, q, qd, NULL) == KEMPE_OK);
    CHECK(kempe_workspace_add_derivatives(ws, 0, NULL, "acceleration(coupler.C)") == KEMPE_OK);
    for (int kind = 0; kind < 3; kind++) {
        unsigned long failed = 0;
        for (bool done = false; !done && failed < 5000; failed += !done) {
            kmp_memory_fail_at(failed + 1);
            const kempe_status status =
                kind == 0   ? kempe_workspace_add_hessians(ws)
                : kind == 1 ? kempe_workspace_add_determinant(ws)
                            : kempe_workspace_forward_hessian(ws, 0, q, qd, NULL, &weight, 2, direction, H);
            kmp_memory_fail_at(0);
            done = status == KEMPE_OK;
            CHECK(done || status == KEMPE_E_MEMORY);
        }
        CHECK(failed > (kind < 2 ? 10 : 0) && failed < 5000);
    }
    const unsigned long before = kmp_memory_count();
    CHECK(kempe_workspace_forward_hessian(ws, 0, q, qd, NULL, &weight, 2, direction, H) == KEMPE_OK);
    CHECK(kempe_workspace_determinant_states(ws, 1, &t, 0, q, H, H + 1, H + 2, NULL) == KEMPE_OK);
    CHECK(kmp_memory_count() == before);
    kempe_workspace_free(ws);
    unload(&l);
}

int main(void)
{
    TEST(four_bar);
    TEST(bricard);
    TEST(steps_try_again);
    TEST(hessians_try_again);
    return check_report();
}
