/* SPDX-License-Identifier: BSD-3-Clause */
/* A workspace allocates when it is made and never again. */
#include "base/memory.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/check.h>
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

int main(void)
{
    TEST(four_bar);
    TEST(bricard);
    return check_report();
}
