/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations of the equations of ROBOTRAN's models in the folder KEMPE_MBS, beside those that ROBOTRAN's generated code
 * states in its header or that a recount of its text gives (for the last four): numbers kept as symbols, three forces
 * and three torques on every body as inputs, each set alone, what depends on numbers alone counted. (ROBOTRAN's code
 * for suspension5 has no inputs on its body without mass.) */
#include "results/sets.h"

#include "bench.h"
#include <math.h>
#include <string.h>

enum { SETS = 4 };

/* By ROBOTRAN's rule and by the paper's; 0: there are no loops. */
typedef struct gold {
    const char *file;
    int robotran[SETS], paper[SETS];
} gold;

static const gold models[] = {
    {"suspension6", {157, 132, 29, 36}, {131, 110, 21, 29}},
    {"ankle7", {197, 166, 86, 117}, {174, 147, 69, 102}},
    {"offroad14", {2571, 843, 0, 0}, {2416, 776, 0, 0}},
    {"humanoid29", {17414, 4106, 0, 0}, {16935, 3873, 0, 0}},
    {"car44", {6120, 2172, 632, 955}, {5733, 1946, 504, 836}},
    {"walkman55", {37669, 6989, 0, 0}, {36699, 6609, 0, 0}},
    {"limousine63", {21193, 4929, 2269, 2392}, {20064, 4571, 2034, 2210}},
    {"piston4", {125, 83, 24, 30}, {104, 69, 15, 21}},
    {"suspension5", {174, 116, 35, 42}, {138, 91, 21, 29}},
    {"bus24", {5762, 1759, 384, 610}, {5413, 1601, 310, 517}},
    {"roadster52", {17509, 4891, 1095, 1726}, {16481, 4508, 842, 1480}},
};

enum { MODELS = sizeof models / sizeof *models };

static const char *const set_names[SETS] = {"M_C", "invdyn", "h_J", "jdqd"};

static unsigned set_bits(int set)
{
    return kmp_sets_find(set_names[set], strlen(set_names[set]));
}

static kmp_counts count(const kempe_model *model, unsigned sets, kmp_scheme scheme)
{
    const kmp_scene scene = {.scheme = scheme, .keep = KMP_KEEP_NUMBERS, .body_inputs = true, .loops_alone = true};
    kmp_tally tally;
    if (kmp_tally_sets(model, &scene, sets, &tally))
        exit(1);
    return tally.counts;
}

static void put(const char *name, kmp_counts ours, int robotran, int paper)
{
    printf("  %-16s %7ld %7ld | %7d ", name, ours.paper, ours.robotran, paper);
    if (robotran)
        printf("%7d | %6.2f\n", robotran, (double)ours.paper / paper);
    else
        printf("%7s | %6.2f\n", "", (double)ours.paper / paper);
}

/* Operations of M, C, h, J and jdqd as one program, and ROBOTRAN's one by one. */
static void compare(const gold *g, const kempe_model *model, double *log_ratio, long together[2])
{
    long single = 0;
    bool loops = g->paper[2] > 0;
    for (int k = 0; k < SETS; k++) {
        if (!g->paper[k])
            continue;
        kmp_counts ours = count(model, set_bits(k), KMP_SCHEME_COMPOSITE);
        put(set_names[k], ours, g->robotran[k], g->paper[k]);
        if (k == 0)
            put("M_C, scheme ner", count(model, set_bits(k), KMP_SCHEME_NER), g->robotran[k], g->paper[k]);
        log_ratio[k] += log((double)ours.paper / g->paper[k]);
        single += k == 1 ? 0 : g->paper[k];
    }
    if (!loops)
        return;
    kmp_counts one = count(model, set_bits(0) | set_bits(2) | set_bits(3), KMP_SCHEME_COMPOSITE);
    put("all but invdyn", one, 0, (int)single);
    together[0] += one.paper;
    together[1] += single;
}

int main(void)
{
    const char *folder = getenv("KEMPE_MBS");
    kempe_context *context = kempe_context_new();
    double log_ratio[SETS] = {0};
    long together[2] = {0};
    int loops = 0;
    if (!folder || !context) {
        fputs("KEMPE_MBS names no folder of .mbs files\n", stderr);
        return 1;
    }
    printf("  %-16s %7s %7s | %7s %7s |\n", "", "paper", "robotr.", "paper", "robotr.");
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
    printf("all but invdyn as one program, summed over the files with loops: %ld of %ld, %.3f\n", together[0],
           together[1], (double)together[0] / (double)together[1]);
    kempe_context_free(context);
    return 0;
}
