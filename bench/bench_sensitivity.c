/* SPDX-License-Identifier: BSD-3-Clause */
/* Cost of derivatives by parameters beside the motion alone: processor time of both methods for more and more
 * parameters, over that of a plain run of the same mechanism to the same time at the same tolerance, medians of rounds
 * in which all take turns. Derivation is left out of both. Fails when the adjoint's cost grows with the number of
 * parameters by half or more. */
#include "bench.h"
#include <kempe/kempe.h>
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

enum { ROUNDS = 5, MOST_WAYS = 12, MOST_NAMES = 64 };

typedef struct trial {
    const char *path, *output;
    double t_end;
} trial;

static const trial trials[] = {
    {"examples/four_bar/four_bar.yaml", "q(rocker)", 2},
    {"examples/slider_crank/slider_crank.yaml", "q(slider)", 5},
    {"examples/parallel_robot/parallel_robot.yaml", "q(p)", 2},
    {"examples/stewart/stewart.yaml", "position(platform.P1).z", 2},
    {"examples/suspension/suspension.yaml", "q(z)", 1},
};

typedef struct way {
    const char *method;
    int count;
    double seconds[ROUNDS];
} way;

/* The first `count` names of a list with commas between. */
static void shorten(const char *all, int count, char *names)
{
    const char *end = all;
    while (*end && count > 0) {
        end += strcspn(end, ",");
        count--;
        end += count > 0 && *end;
    }
    memcpy(names, all, (size_t)(end - all));
    names[end - all] = '\0';
}

static void stop(const bench *b)
{
    fprintf(stderr, "%s\n", kempe_context_message(b->context));
    exit(1);
}

static double json_number(const char *json, const char *key)
{
    const char *at = strstr(json, key);
    return at ? strtod(at + strlen(key), NULL) : NAN;
}

static double plain(const bench *b, const trial *x)
{
    kempe_run_options run = {0};
    kempe_trajectory *t = NULL;
    char *json = NULL;
    run.t_end = run.output_step = x->t_end;
    run.rtol = 1e-8;
    run.no_convergence_check = 1;
    if (kempe_simulate(b->system, &run, &t) || kempe_trajectory_print(t, KEMPE_JSON, &json))
        stop(b);
    double seconds = json_number(json, "\"cpu_s\": ");
    kempe_text_free(json);
    kempe_trajectory_free(t);
    return seconds;
}

static kempe_sensitivity *differentiate(const bench *b, const trial *x, const char *parameters, const char *method,
                                        double *seconds)
{
    kempe_run_options run = {0};
    kempe_sensitivity_options options = {.parameters = parameters, .outputs = x->output, .method = method, .run = &run};
    kempe_sensitivity *s = NULL;
    char *json = NULL;
    run.t_end = run.output_step = x->t_end;
    run.no_convergence_check = 1;
    run.rtol = 1e-8;
    if (kempe_sensitivity_new(b->model, &options, &s) || kempe_sensitivity_print(s, KEMPE_JSON, &json))
        stop(b);
    *seconds = json_number(json, "\"cpu_s\": ");
    kempe_text_free(json);
    return s;
}

/* All names, with commas between. */
static int list_names(const bench *b, const trial *x, char *names)
{
    double seconds;
    kempe_sensitivity *s = differentiate(b, x, NULL, "forward", &seconds);
    kempe_table *parameters = NULL;
    if (kempe_sensitivity_table(s, "parameters", &parameters) != KEMPE_OK)
        stop(b);
    int count = kempe_table_row_count(parameters);
    names[0] = '\0';
    for (int k = 0; k < count; k++) {
        strcat(names, k ? "," : "");
        strcat(names, kempe_table_word(parameters, k, 0));
    }
    kempe_table_free(parameters);
    kempe_sensitivity_free(s);
    return count;
}

static void run_way(const bench *b, const trial *x, const char *all, way *w, int round)
{
    char names[64 * MOST_NAMES];
    shorten(all, w->count, names);
    kempe_sensitivity_free(differentiate(b, x, names, w->method, &w->seconds[round]));
}

/* True if the adjoint's cost grows. */
static int run_trial(const trial *x)
{
    bench b = bench_load(x->path);
    char all[64 * MOST_NAMES];
    double alone[ROUNDS];
    way ways[MOST_WAYS];
    int count = list_names(&b, x, all), number = 0;
    for (int side = 0; side < 2; side++)
        for (int k = 1; number < MOST_WAYS; k = 2 * k < count ? 2 * k : count) {
            ways[number++] = (way){.method = side ? "adjoint" : "forward", .count = k};
            if (k == count)
                break;
        }
    for (int round = 0; round < ROUNDS; round++) {
        alone[round] = plain(&b, x);
        for (int k = 0; k < number; k++)
            run_way(&b, x, all, &ways[k], round);
    }
    double base = bench_median(ROUNDS, alone), first = NAN, last = NAN;
    printf("%s, %d parameters, to t = %g s: the motion alone takes %.3f ms\n", x->path, count, x->t_end, 1e3 * base);
    for (int k = 0; k < number; k++) {
        double seconds = bench_median(ROUNDS, ways[k].seconds);
        printf("  %-8s %3d parameters  %9.3f ms  %6.1f times\n", ways[k].method, ways[k].count, 1e3 * seconds,
               seconds / base);
        if (ways[k].method[0] == 'a' && isnan(first))
            first = seconds;
        last = seconds;
    }
    bench_free(&b);
    return !(last < 1.5 * first);
}

int bench_sensitivity(int argc, char **argv)
{
    (void)argc, (void)argv;
    int grows = 0;
    for (size_t k = 0; k < sizeof trials / sizeof *trials; k++)
        grows += run_trial(&trials[k]);
    return grows > 0;
}
