/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations (+ - * /) of exact derivatives. First of the inverse dynamics of ROBOTRAN's models in the folder
 * KEMPE_MBS, numbers kept as symbols, no inputs on bodies, each figure of one program: Q alone; with its derivatives by
 * q and qd, by recursion with composite bodies or by differentiation as they are chosen, and by differentiation alone;
 * with M beside; and all of them of Q - J' lambda, in units of Q alone. Then of the program of all derivatives that the
 * Jacobian of the reduced formulation takes (of R, hdot and J qdd + jdqd; J and M), numbers folded, with R by
 * differentiation and as chosen. */
#include "constraints/evaluation/tangent.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "studies/show/sets.h"

#include "bench.h"
#include <string.h>

static const char *const tree_models[] = {"humanoid29", "limousine63", "car44", "bus24", "roadster52", "walkman55"};
static const char *const examples[] = {"andrews",        "stewart", "double_wishbone",      "governor",
                                       "parallel_robot", "bricard", "slider_crank_spatial", "four_bar"};

static unsigned bits(const char *names)
{
    unsigned sets = 0;
    for (const char *s = names; *s; s += strcspn(s, "+"), s += *s == '+')
        sets |= kmp_sets_find(s, strcspn(s, "+"));
    return sets;
}

static long count(const kempe_model *model, const char *names, kmp_tangent_method way)
{
    const kmp_derivation_request scene = {.keep = KMP_KEEP_NUMBERS, .loops_alone = true, .tangents = way};
    kmp_tally tally;
    if (kmp_tally_sets(model, &scene, bits(names), &tally))
        exit(1);
    return tally.counts.paper;
}

static void put_ratio(long operations, long of)
{
    printf(" %7ld %5.2f", operations, (double)operations / (double)of);
}

static void put_model(const kempe_model *model, const char *name)
{
    static const char *const sets[4] = {"invdyn+invdyn_q+invdyn_qd", "invdyn+tangents", "R+R_q+invdyn_qd",
                                        "R+R_tangents"};
    long residual = count(model, "invdyn", KMP_TANGENT_SHORTER);
    printf("%-12s %6ld |", name, residual);
    for (int k = 0; k < 4; k++) {
        put_ratio(count(model, sets[k], KMP_TANGENT_SHORTER), residual);
        if (k == 0 || k == 2)
            put_ratio(count(model, sets[k], KMP_TANGENT_FORWARD), residual);
        printf("%s", k == 1 ? " |" : "");
    }
    printf("\n");
}

static kempe_model *read(kempe_context *context, const char *path)
{
    kempe_model *model = NULL;
    if (kempe_model_read(context, path, &model)) {
        fprintf(stderr, "%s\n", kempe_context_message(context));
        exit(1);
    }
    return model;
}

static void trees(kempe_context *context, const char *folder)
{
    printf("numbers kept      Q |  with d/dq, d/dqd   by differentiation  and M |  with lambda: d/dq, d/dqd   by "
           "differentiation  and M\n");
    for (size_t k = 0; k < sizeof tree_models / sizeof *tree_models; k++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/%s.mbs", folder, tree_models[k]);
        kempe_model *model = read(context, path);
        put_model(model, tree_models[k]);
        kempe_model_free(model);
    }
    printf("\n");
}

static void formulation(kempe_context *context, const char *path, const char *name)
{
    static const unsigned values = 1u << KMP_VALUE_R | 1u << KMP_VALUE_RATE | 1u << KMP_VALUE_CURVE;
    static const char *const methods[2] = {"composite", "differentiated"};
    kempe_model *model = read(context, path);
    kempe_system *system = NULL;
    kmp_tangents t;
    if (kempe_system_new(model, &system) || kmp_tangents_init(&t, system, kmp_backend_find("tape"), values)) {
        fprintf(stderr, "%s\n", kempe_context_message(context));
        exit(1);
    }
    long chosen = kmp_program_count(t.tangent.program, 0, 1).paper;
    long differentiated = t.choice.second ? t.choice.second : chosen;
    printf("%-22s %3d %3d | %7ld %7ld  %.2f | %-14s %s\n", name, t.n, t.m, differentiated, chosen,
           (double)chosen / (double)differentiated, methods[t.choice.by_q], methods[t.choice.by_qd]);
    kmp_tangents_free(&t);
    kempe_system_free(system);
    kempe_model_free(model);
}

int bench_tangents(int argc, char **argv)
{
    (void)argc, (void)argv;
    const char *folder = getenv("KEMPE_MBS");
    kempe_context *context = kempe_context_new();
    char path[1024];
    if (!folder || !context) {
        fputs("KEMPE_MBS names no folder of .mbs files\n", stderr);
        return 1;
    }
    trees(context, folder);
    printf("%-22s %3s %3s | %7s %7s        | %-14s %s\n", "formulation", "n", "m", "diff.", "chosen", "R by q",
           "R by qd");
    for (size_t k = 0; k < sizeof examples / sizeof *examples; k++) {
        snprintf(path, sizeof path, "examples/%s/%s.yaml", examples[k], examples[k]);
        formulation(context, path, examples[k]);
    }
    for (size_t k = 0; k < sizeof tree_models / sizeof *tree_models; k++) {
        snprintf(path, sizeof path, "%s/%s.mbs", folder, tree_models[k]);
        formulation(context, path, tree_models[k]);
    }
    kempe_context_free(context);
    return 0;
}
