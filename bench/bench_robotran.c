/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations of the equations of ROBOTRAN's models in the folder KEMPE_MBS, beside those that ROBOTRAN's generated code
 * states in its header or that a recount of its text gives (for the last four): numbers kept as symbols, three forces
 * and three torques on every body as inputs, but for bodies where ROBOTRAN's code has none, each set alone. Bars are on
 * all operations by the paper's rule; beside them what is left at run time, without what depends on numbers alone, and
 * that with `optimize`. The exit code is 1 when a bar is missed. */
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "studies/show/sets.h"

#include "bench.h"
#include <math.h>
#include <string.h>

enum { SETS = 4 };

/* By ROBOTRAN's rule and by the paper's; 0: there are no loops. */
typedef struct gold {
    const char *file;
    int robotran[SETS], paper[SETS];
    const char *no_inputs; /* bodies without; NULL: none */
} gold;

static const gold models[] = {
    {"suspension6", {157, 132, 29, 36}, {131, 110, 21, 29}, NULL},
    {"ankle7", {197, 166, 86, 117}, {174, 147, 69, 102}, NULL},
    {"offroad14", {2571, 843, 0, 0}, {2416, 776, 0, 0}, NULL},
    {"humanoid29", {17414, 4106, 0, 0}, {16935, 3873, 0, 0}, NULL},
    {"car44", {6120, 2172, 632, 955}, {5733, 1946, 504, 836}, NULL},
    {"walkman55", {37669, 6989, 0, 0}, {36699, 6609, 0, 0}, NULL},
    {"limousine63", {21193, 4929, 2269, 2392}, {20064, 4571, 2034, 2210}, NULL},
    {"piston4", {125, 83, 24, 30}, {104, 69, 15, 21}, NULL},
    {"suspension5", {174, 116, 35, 42}, {138, 91, 21, 29}, "Roue"},
    {"bus24", {5762, 1759, 384, 610}, {5413, 1601, 310, 517}, NULL},
    {"roadster52", {17509, 4891, 1095, 1726}, {16481, 4508, 842, 1480}, NULL},
};

enum { MODELS = sizeof models / sizeof *models };

static const char *const set_names[SETS] = {"M_C", "invdyn", "h_J", "jdqd"};

static unsigned set_bits(int set)
{
    return kmp_sets_find(set_names[set], strlen(set_names[set]));
}

/* The largest ratio to ROBOTRAN's that is allowed. */
enum { FEW = 12 };
#define BAR_TOGETHER 0.5

static double bar_of(const gold *g, const kempe_model *model, int set)
{
    static const double bars[SETS] = {0.5, 0.9, 0.8, 0.9};
    if (set == 0 && kempe_model_coordinate_count(model) < FEW)
        return 0.95;
    return set == 1 && g->no_inputs ? 0.92 : bars[set];
}

static kmp_tally count(const gold *g, const kempe_model *model, unsigned sets, kmp_scheme scheme, bool optimize)
{
    const kmp_derivation_request scene = {.scheme = scheme,
                                          .keep = KMP_KEEP_NUMBERS,
                                          .body_inputs = true,
                                          .no_inputs = g->no_inputs,
                                          .optimize = optimize,
                                          .loops_alone = true};
    kmp_tally tally;
    if (kmp_tally_sets(model, &scene, sets, &tally))
        exit(1);
    return tally;
}

static int missed;

static void put_number(long x)
{
    if (x > 0)
        printf(" %7ld", x);
    else
        printf(" %7s", "");
}

/* A line; without a bar when that is 0. */
static void put(const char *name, const kmp_tally *ours, long optimized, int robotran, int paper, double bar)
{
    double ratio = (double)ours->counts.paper / paper;
    bool miss = bar > 0 && ratio > bar;
    printf("  %-16s %7ld %7ld | %7d", name, ours->counts.paper, ours->counts.robotran, paper);
    put_number(robotran);
    printf(" | %7ld", ours->runtime.paper);
    put_number(optimized);
    if (bar > 0)
        printf(" | %4.2f %s", bar, miss ? "MISS" : "pass");
    else
        printf(" | %9s", "");
    printf(" | %6.2f\n", ratio);
    missed += miss;
}

/* Operations of M, C, h, J and jdqd as one program, and ROBOTRAN's one by one. */
static void compare(const gold *g, const kempe_model *model, double *log_ratio, long together[2])
{
    long single = 0;
    bool loops = g->paper[2] > 0;
    for (int k = 0; k < SETS; k++) {
        if (!g->paper[k])
            continue;
        kmp_tally ours = count(g, model, set_bits(k), KMP_SCHEME_COMPOSITE, false);
        kmp_tally best = count(g, model, set_bits(k), KMP_SCHEME_COMPOSITE, true);
        put(set_names[k], &ours, best.runtime.paper, g->robotran[k], g->paper[k], bar_of(g, model, k));
        if (k == 0) {
            kmp_tally ner = count(g, model, set_bits(k), KMP_SCHEME_NER, false);
            put("M_C, scheme ner", &ner, -1, g->robotran[k], g->paper[k], 0);
        }
        log_ratio[k] += log((double)ours.counts.paper / g->paper[k]);
        single += k == 1 ? 0 : g->paper[k];
    }
    if (!loops)
        return;
    unsigned sets = set_bits(0) | set_bits(2) | set_bits(3);
    kmp_tally one = count(g, model, sets, KMP_SCHEME_COMPOSITE, false);
    put("all but invdyn", &one, -1, 0, (int)single, 0);
    together[0] += one.counts.paper;
    together[1] += single;
}

int bench_robotran(int argc, char **argv)
{
    (void)argc, (void)argv;
    const char *folder = getenv("KEMPE_MBS");
    kempe_context *context = kempe_context_new();
    double log_ratio[SETS] = {0};
    long together[2] = {0};
    int loops = 0;
    if (!folder || !context) {
        fputs("KEMPE_MBS names no folder of .mbs files\n", stderr);
        return 1;
    }
    printf("  %-16s %7s %7s | %7s %7s | %7s %7s | %9s |  ratio\n", "", "paper", "robotr.", "paper", "robotr.",
           "runtime", "optim.", "bar");
    for (int k = 0; k < MODELS; k++) {
        char path[1024];
        kempe_model *model = NULL;
        snprintf(path, sizeof path, "%s/%s.mbs", folder, models[k].file);
        if (kempe_model_read(context, path, &model)) {
            fprintf(stderr, "%s\n", kempe_context_message(context));
            return 1;
        }
        printf("%s\n", models[k].file);
        compare(&models[k], model, log_ratio, together);
        loops += models[k].paper[2] > 0;
        kempe_model_free(model);
    }
    printf("\ngeometric means of the ratios\n");
    for (int k = 0; k < SETS; k++)
        printf("  %-16s %6.3f\n", set_names[k], exp(log_ratio[k] / (k < 2 ? MODELS : loops)));
    double ratio = (double)together[0] / (double)together[1];
    missed += ratio > BAR_TOGETHER;
    printf("all but invdyn as one program, summed over the files with loops: %ld of %ld, %.3f, bar %.2f %s\n",
           together[0], together[1], ratio, BAR_TOGETHER, ratio <= BAR_TOGETHER ? "pass" : "MISS");
    printf("%d of the bars are missed\n", missed);
    kempe_context_free(context);
    return missed > 0;
}
