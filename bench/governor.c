/* SPDX-License-Identifier: BSD-3-Clause */
/* The stiff flyball governor (IFToMM A05) over 10 s with stiffness and damping as given, a hundredfold, ten
 * thousandfold: steps, evaluations and times of the implicit integrators; errors against reference.csv where the
 * stiffness is the model's own. */
#include "judged.h"

static const char path[] = "examples/governor/governor.yaml";

static char *model_text(const char *stiffness)
{
    static char text[8192], changed[8192];
    static const char given[] = "K: 8e5, c: 4e4";
    FILE *file = fopen(path, "r");
    size_t length = file ? fread(text, 1, sizeof text - 1, file) : 0;
    char *at = strstr(text, given);
    if (file)
        fclose(file);
    if (length == 0 || !at)
        exit(1);
    snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, stiffness, at + sizeof given - 1);
    return changed;
}

static void one(const judged *with, const kempe_assembly *start, const char *road, const char *integrator, double rtol,
                bool own)
{
    judged j = *with;
    kmp_run_spec spec = {.road = road,
                         .integrator = integrator,
                         .rtol = rtol,
                         .t_end = 10,
                         .time_count = j.reference->rows,
                         .times = j.reference->t};
    bool good = judged_run(&j, &spec, start, rtol < 1e-9 && strcmp(integrator, "dirk") == 0 ? 1 : 5);
    const kmp_run_report *r = &j.report;
    printf("  %-8s %-5s %.0e | ", road, integrator, rtol);
    if (!good)
        printf("fails at t = %.3g\n", r->t);
    else if (own)
        printf("%7.1e | %7ld %7ld %7ld %6ld | %9.2f\n", j.q, r->steps, r->rhs, r->newton, r->factorizations,
               1e3 * j.cpu);
    else
        printf("%7s | %7ld %7ld %7ld %6ld | %9.2f\n", "", r->steps, r->rhs, r->newton, r->factorizations, 1e3 * j.cpu);
}

static void scene(const char *stiffness, bool own)
{
    static const char *const ways[3][2] = {{"reduced", "bdf"}, {"dae", "ida"}, {"reduced", "dirk"}};
    bench b = {kempe_context_new(), NULL, NULL};
    kempe_assembly *start = NULL;
    kmp_reference reference;
    if (kempe_model_read_text(b.context, model_text(stiffness), "governor", &b.model) ||
        kempe_system_new(b.model, &b.system) || kempe_assemble(b.system, &start) ||
        kmp_reference_read(b.system, "examples/governor/reference.csv", &reference))
        exit(1);
    judged with = {.b = &b, .reference = &reference};
    printf("%s\n", stiffness);
    for (int w = 0; w < 3; w++)
        for (int e = -6; e >= -12; e -= 2)
            if (w < 2 || e >= -8)
                one(&with, start, ways[w][0], ways[w][1], pow(10, e), own);
    kmp_reference_free(&reference);
    kempe_assembly_free(start);
    bench_free(&b);
}

int main(void)
{
    printf("  %-8s %-5s %-5s | %-7s | %7s %7s %7s %6s | %9s\n", "road", "", "rtol", "error q", "steps", "rhs", "Newton",
           "factor", "cpu ms");
    scene("K: 8e5, c: 4e4", true);
    scene("K: 8e7, c: 4e6", false);
    scene("K: 8e9, c: 4e8", false);
    return 0;
}
