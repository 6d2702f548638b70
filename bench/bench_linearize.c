/* SPDX-License-Identifier: BSD-3-Clause */
/* Cost of the linear equations about the start, beside a forward dynamics of the public workspace there: processor time
 * of the first linearization of a system and the least of many, in forward dynamics, and for each column of A; and of
 * the derivatives of the workspace, by which the same columns are found (`state`). Fails where a column of the
 * workspace takes more than BOUND of them, or a column of the object with more than FEW columns: with fewer the object,
 * which also has names and matrices of second order, costs more. */
#include "bench.h"
#include <kempe/derivatives.h>
#include <kempe/kempe.h>
#include <kempe/linearize.h>
#include <math.h>

enum { TIMES = 60, CALLS = 200, FEW = 4 };
#define BOUND 8

static const char *const models[] = {"examples/four_bar/four_bar.yaml", "examples/parallel_robot/parallel_robot.yaml",
                                     "examples/stewart/stewart.yaml", "examples/suspension/suspension.yaml",
                                     "examples/limousine/limousine.yaml"};

static kempe_linearization *linearize(const bench *b, double *seconds)
{
    kempe_linearization *l = NULL;
    double begin = bench_now();
    if (kempe_linearization_new(b->system, &(kempe_linearize_options){.at = "start"}, &l)) {
        fprintf(stderr, "%s\n", kempe_context_message(b->context));
        exit(1);
    }
    *seconds = bench_now() - begin;
    return l;
}

/* The least time of a forward dynamics at the state, or of its derivatives along closed motions. */
static double accelerate(const bench *b, const kempe_linearization *l, bool derivatives)
{
    kempe_workspace *ws = NULL;
    const size_t n = (size_t)kempe_model_coordinate_count(b->model);
    double *qdd = calloc(n, sizeof *qdd), *udd = calloc(2 * n * n, sizeof *udd), least = INFINITY;
    const kempe_workspace_derivatives out = {.udd_u = udd, .udd_ud = udd + n * n};
    if (!qdd || !udd || kempe_workspace_new(b->system, &ws) || kempe_workspace_add_derivatives(ws, 0, NULL, NULL))
        exit(1);
    for (int k = 0; k < TIMES; k++) {
        double begin = bench_now();
        for (int i = 0; i < CALLS; i++) {
            const double *q = kempe_linearization_q(l), *qd = kempe_linearization_qd(l);
            if (derivatives ? kempe_workspace_forward_derivatives(ws, 0, q, qd, NULL, qdd, NULL, &out)
                            : kempe_workspace_forward_dynamics(ws, 0, q, qd, NULL, qdd, NULL))
                exit(1);
        }
        least = fmin(least, (bench_now() - begin) / CALLS);
    }
    kempe_workspace_free(ws);
    free(qdd);
    free(udd);
    return least;
}

/* True if it takes too long. */
static int run_model(const char *path)
{
    bench b = bench_load(path);
    double first = 0, least = INFINITY, seconds;
    kempe_linearization *l = linearize(&b, &first);
    int columns = kempe_linearization_count(l, KEMPE_CHANNEL_STATE);
    const double dynamics = accelerate(&b, l, false), state = accelerate(&b, l, true);
    kempe_linearization_free(l);
    for (int k = 0; k < TIMES; k++) {
        kempe_linearization_free(linearize(&b, &seconds));
        least = fmin(least, seconds);
    }
    printf("%-44s %3d %9.3f %9.3f %9.4f %8.0f %8.1f %8.1f %8.1f\n", path, columns, 1e3 * first, 1e3 * least,
           1e3 * dynamics, least / dynamics, least / dynamics / columns, state / dynamics, state / dynamics / columns);
    bench_free(&b);
    return state > BOUND * columns * dynamics || (columns > FEW && least > BOUND * columns * dynamics);
}

int bench_linearize(int argc, char **argv)
{
    (void)argc, (void)argv;
    int slow = 0;
    printf("%-44s %3s %9s %9s %9s %8s %8s %8s %8s\n", "", "A", "first, ms", "later, ms", "dyn., ms", "dynamics",
           "a column", "state", "a column");
    for (size_t k = 0; k < sizeof models / sizeof *models; k++)
        slow += run_model(models[k]);
    return slow > 0;
}
