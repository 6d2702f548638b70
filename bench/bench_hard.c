/* SPDX-License-Identifier: BSD-3-Clause */
/* The hard battery: every case on every formulation, one line each with its verdict, then sweeps over 61 tolerances
 * through exact change points and a few properties that are not errors.
 *
 *     bench hard [WORD]      only the cases with WORD in their names
 */
#include "bench.h"
#include "bench/battery.h"
#include "bench/inconsistent.h"

static int failed;

static const char *mark(bool passed)
{
    failed += !passed;
    return passed ? "pass" : "FAIL";
}

static void print_one(const hard_case *c, const hard_formulation *formulation, hard_result *r)
{
    char name[64];
    bool dae = hard_by_ida(formulation);
    snprintf(name, sizeof name, "%s/%s %s", formulation->formulation, formulation->form,
             formulation->integrator ? formulation->integrator : "");
    printf("%-28s %-24s %.0e  %-7s %8.1e %8.1e %8.1e %7ld %8.3f  %s%s", c->name, name, hard_rtol(c, dae),
           r->status == KEMPE_OK        ? "ok"
           : r->status == KEMPE_STOPPED ? "stopped"
                                        : "failed",
           r->error, r->residual, r->drift, r->report.steps, r->report.cpu_s, mark(r->passed),
           !r->passed && hard_is_known(c, r) ? ", known" : "");
    if (r->passages)
        printf(" %d passages", r->passages);
    printf("\n");
    if (r->status != KEMPE_OK)
        printf("    %s\n", r->report.reason ? r->report.reason : "no reason");
    kmp_free(r->report.reason);
    fflush(stdout);
}

static void run_case(const hard_case *c)
{
    hard_scene s;
    if (!hard_load(&s, ".", c))
        printf("%-28s %s: %s\n", c->name, kempe_context_message(s.context), mark(c->end == HARD_STOPS));
    for (int k = 0; s.system && k < HARD_METHODS; k++) {
        hard_result r = hard_run(&s, ".", c, &hard_formulations[k], 0);
        print_one(c, &hard_formulations[k], &r);
    }
    hard_unload(&s);
}

/* Conservative cases that pass no change point keep their energy to 1e-9 at rtol 1e-13. */
static void keep_energy(const hard_case *c)
{
    hard_scene s;
    if (c->end == HARD_STOPS || c->energy == HARD_ANY || !hard_load(&s, ".", c))
        return;
    for (int k = 0; k < HARD_FORMULATIONS - 1; k++) {
        hard_result r = hard_run(&s, ".", c, &hard_formulations[k], 1e-13);
        bool kept = r.status == KEMPE_OK && r.drift <= 1e-9;
        if (r.passages == 0)
            printf("%-28s %s/%s: energy %.1e at rtol 1e-13  %s\n", c->name, hard_formulations[k].formulation,
                   hard_formulations[k].form, r.drift, mark(kept));
        kmp_free(r.report.reason);
    }
    fflush(stdout);
    hard_unload(&s);
}

/* Through exact change points at tolerances 1e-6 to 1e-12: the right branch in every run, right at the tight end. */
static void sweep(const char *name, const char *model, hard_rule *rule, double t_end, int count)
{
    hard_case c = {.name = name, .model = model, .rule = rule, .t_end = t_end, .rtol = 1e-6, .bar = INFINITY};
    hard_scene s;
    (void)hard_load(&s, ".", &c);
    for (int k = 0; s.system && k < HARD_FORMULATIONS - 1; k++) {
        int right = 0;
        double worst = 0, last = NAN;
        for (int i = 0; i < count; i++) {
            hard_result r = hard_run(&s, ".", &c, &hard_formulations[k], pow(10, -6 - 6.0 * i / (count - 1)));
            right += r.status == KEMPE_OK && r.error < 0.1; /* the other branch is radians away */
            worst = fmax(worst, r.error);
            last = r.error;
            if (r.status != KEMPE_OK)
                printf("%-28s at %.1e: %s\n", name, pow(10, -6 - 6.0 * i / (count - 1)), r.report.reason);
            kmp_free(r.report.reason);
        }
        printf("%-28s %s/%s: right branch in %d of %d, worst %.1e, at 1e-12 %.1e  %s\n", name,
               hard_formulations[k].formulation, hard_formulations[k].form, right, count, worst, last,
               mark(right == count && last <= 1e-6));
        fflush(stdout);
    }
    hard_unload(&s);
}

static char *read_text(const char *path)
{
    static char text[1 << 14];
    FILE *file = fopen(path, "r");
    size_t length = file ? fread(text, 1, sizeof text - 1, file) : 0;
    text[length] = 0;
    if (file)
        fclose(file);
    return text;
}

static void replace(char *text, const char *what, const char *by)
{
    char *at = strstr(text, what);
    if (!at)
        return;
    memmove(at + strlen(by), at + strlen(what), strlen(at + strlen(what)) + 1);
    memcpy(at, by, strlen(by));
}

/* In millimetres everything must take the same steps. */
static void units(void)
{
    long steps[2] = {0};
    for (int k = 0; k < 2; k++) {
        char *text = read_text("examples/slider_crank/slider_crank.yaml");
        if (k) {
            replace(text, "-9.81", "-9810");
            replace(text, "r: 0.2, l: 0.5", "r: 200, l: 500");
        }
        hard_case c = {.name = "units", .model = text, .t_end = 10, .rtol = 1e-9};
        hard_scene s;
        (void)hard_load(&s, ".", &c);
        hard_result r = hard_run(&s, ".", &c, &hard_formulations[0], 0);
        steps[k] = r.report.steps;
        kmp_free(r.report.reason);
        hard_unload(&s);
    }
    printf("%-28s slider-crank in m and in mm: %ld and %ld steps  %s\n", "units", steps[0], steps[1],
           mark(steps[0] > 0 && steps[0] == steps[1]));
}

/* Starts off the closures. */
static void inconsistent(void)
{
    for (int k = 0; k < PUSH_CASES; k++)
        failed += !push_run(".", &push_cases[k]);
}

/* Crank and rod of one length: at 90 degrees two branches meet, and the run must say that it passed there. */
static void equal_lengths(void)
{
    hard_case c = {.name = "two branches meeting",
                   .model = "examples/slider_crank/slider_crank.yaml",
                   .t_end = 1,
                   .rtol = 1e-9,
                   .set = {"l", "0.2"}};
    hard_scene s;
    (void)hard_load(&s, ".", &c);
    for (int k = 0; s.system && k < HARD_FORMULATIONS; k++) {
        hard_result r = hard_run(&s, ".", &c, &hard_formulations[k], 0);
        printf("%-28s %s/%s: %s, %d passages named  %s\n", c.name, hard_formulations[k].formulation,
               hard_formulations[k].form, r.status == KEMPE_OK ? "ok" : r.report.reason, r.passages,
               mark(r.passages > 0 || r.status != KEMPE_OK));
        kmp_free(r.report.reason);
    }
    hard_unload(&s);
}

int bench_hard(int argc, char **argv)
{
    printf("%-28s %-24s %-6s %-7s %8s %8s %8s %7s %8s  %s\n", "case", "formulation", "rtol", "status", "error",
           "residual", "energy", "steps", "CPU s", "verdict");
    for (int k = 0; k < HARD_CASES; k++)
        if (argc < 2 || strstr(hard_cases[k].name, argv[1]))
            run_case(&hard_cases[k]);
    for (int k = 0; k < HARD_CASES; k++)
        if (argc < 2 || strstr(hard_cases[k].name, argv[1]))
            keep_energy(&hard_cases[k]);
    if (argc > 1)
        return failed > 0;
    sweep("A02 N = 1, sweep", "windows 1", hard_windows_rule, 10, 61);
    sweep("A02 N = 2, sweep", "windows 2", hard_windows_rule, 10, 61);
    sweep("A02 N = 6, sweep", "windows 6", hard_windows_rule, 10, 61);
    sweep("A02 N = 40, sweep", "windows 40", hard_windows_rule, 10, 3);
    sweep("antiparallelogram, sweep", "tests/models/antiparallelogram.yaml", hard_antiparallelogram, 10, 61);
    units();
    inconsistent();
    equal_lengths();
    printf("%d failed\n", failed);
    return failed > 0;
}
