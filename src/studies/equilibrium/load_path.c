/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces along a coordinate: the virtual work of gravity, of each force element and of the motion itself on a small
 * change of one independent coordinate. The others are fixed and the closures satisfied. Closures do no work. Each
 * force is evaluated from equations of its own, which have that element alone. */
#include "base/arena.h"
#include "linalg/dot.h"
#include "studies/equilibrium/equilibrium_study.h"
#include <math.h>
#include <string.h>

#define NOTHING 1e-14 /* in parts of the largest */

enum { GRAVITY = -1, MOTION = -2, USER = -3 };

typedef struct pull {
    int force;     /* of the model, or one of those above */
    double effort; /* N m or N, in the direction of the coordinate */
} pull;

typedef struct load_path {
    pull *pull; /* the nonzero ones, largest first */
    int count;
    double sum;
} load_path;

/* C (n) of a model with one of its forces alone (NULL: all of them), at the state of `l` and in its modes. */
static kempe_status evaluate(const kmp_linear *l, const kempe_model *model, const kmp_force *alone, double *bias)
{
    kmp_equations eq;
    kmp_formulas force = {0};
    kmp_instant at = kmp_linear_instant(l);
    kmp_events events = l->system->events; /* the system has recorded all conditions: none is added */
    const kmp_scene scene = {
        .sets = KMP_SET_BIAS, .scheme = KMP_SCHEME_COMPOSITE, .events = &events, .charted = true, .alone = alone};
    KMP_TRY(kmp_equations_derive(&eq, model, &scene));
    bool ok = kmp_formulas_init(&force, eq.graph, l->n, eq.bias, kmp_backend_find("tape"), l->system->parameters);
    if (ok)
        memcpy(bias, kmp_formulas_at(&force, &at), (size_t)l->n * sizeof *bias);
    kmp_formulas_free(&force);
    kmp_equations_free(&eq);
    return kmp_made(l->system->context, ok);
}

/* The model without forces. */
static kempe_model bare(const kempe_model *model)
{
    kempe_model part = *model;
    for (int i = 0; i < 3; i++)
        part.gravity[i] = (kmp_number){0};
    part.force_count = part.output_count = 0;
    return part;
}

static void add(load_path *path, int force, double effort)
{
    int k = path->count++;
    for (; k > 0 && fabs(path->pull[k - 1].effort) < fabs(effort); k--)
        path->pull[k] = path->pull[k - 1];
    path->pull[k] = (pull){force, effort};
    path->sum += effort;
}

/* The difference of `with` and `without`, along the column x of N. */
static double difference(int n, const double *x, const double *with, const double *without)
{
    return kmp_dot(n, x, without) - kmp_dot(n, x, with);
}

static kempe_status find(const kmp_linear *l, const double *x, load_path *path, double *with, double *without)
{
    const kempe_model *model = l->system->model;
    kempe_model part = bare(model);
    KMP_TRY(evaluate(l, &part, NULL, without));
    add(path, MOTION, -kmp_dot(l->n, x, without));
    memcpy(part.gravity, model->gravity, sizeof part.gravity);
    KMP_TRY(evaluate(l, &part, NULL, with));
    add(path, GRAVITY, difference(l->n, x, with, without));
    part = bare(model);
    part.force_count = model->force_count;
    for (int k = 0; k < model->force_count; k++) {
        KMP_TRY(evaluate(l, &part, &model->forces[k], with));
        add(path, k, difference(l->n, x, with, without));
    }
    const double *effort = kmp_eval_effort(l->eval, l->t, l->q, l->qd);
    if (effort)
        add(path, USER, kmp_dot(l->n, x, effort));
    while (path->count > 0 && fabs(path->pull[path->count - 1].effort) <= NOTHING * fabs(path->pull[0].effort))
        path->count--;
    return KEMPE_OK;
}

kempe_status kmp_load_path_report(kmp_text *text, const kmp_linear *linear, int k)
{
    int n = linear->n;
    const kempe_model *model = linear->system->model;
    kmp_arena arena = {0};
    load_path path = {.pull = KMP_ARENA_NEW(&arena, pull, model->force_count + 3)};
    double *with = KMP_ARENA_NEW(&arena, double, n), *without = KMP_ARENA_NEW(&arena, double, n);
    kempe_status status = kmp_made(linear->system->context, !arena.failed);
    if (status == KEMPE_OK)
        status = find(linear, linear->red.x + k * n, &path, with, without);
    if (status == KEMPE_OK) {
        int coordinate = linear->part.u[k];
        const char *unit = model->motions[coordinate].rotation ? "N m" : "N";
        for (int i = 0; i < path.count; i++) {
            int force = path.pull[i].force;
            kmp_text_put(text, i ? ", " : "");
            if (force >= 0)
                kmp_text_printf(text, "'%s'", model->forces[force].name);
            else
                kmp_text_put(text, force == GRAVITY  ? "gravity"
                                   : force == MOTION ? "its motion"
                                                     : "the force of the caller");
            kmp_text_printf(text, " %.6g %s", path.pull[i].effort, unit);
        }
        if (path.count > 1)
            kmp_text_printf(text, ", together %.6g %s", path.sum, unit);
    }
    kmp_arena_free(&arena);
    return status;
}
