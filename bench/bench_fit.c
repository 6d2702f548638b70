/* SPDX-License-Identifier: BSD-3-Clause */
/* Coverage of the intervals of fits: masses and friction of a slider-crank from noisy angles and strokes, again and
 * again with other noise. Of each parameter it counts the 95 % intervals with the true value, beside the band that 99 %
 * of such counts are in; and compares the scatter of the estimates with the mean standard error. Fails when a count is
 * outside the band. */
#include "bench.h"
#include "ensemble/statistics/statistics.h"
#include <kempe/fit.h>
#include <kempe/settings.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <unistd.h>

enum { REPETITIONS = 200, COUNT = 4, MOST_ROWS = 400 };

static const char *const model_file = "tests/models/measured_crank.yaml";
static const char *const names[COUNT] = {"rod_mass", "slider_mass", "guide", "bearing"};
static const double truth[COUNT] = {2, 3, 1.5, 0.05};
static const double noise[2] = {0.01, 0.001}; /* rad, m */

typedef struct motion {
    int rows;
    double t[MOST_ROWS], value[MOST_ROWS][2];
} motion;

static uint64_t state = 20;

/* Knuth's MMIX generator, and the normal distribution by Box and Muller. */
static double uniform(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return ((double)(state >> 11) + 0.5) * 0x1p-53;
}

static double normal(void)
{
    double a = uniform(), b = uniform();
    return sqrt(-2 * log(a)) * cos(2 * acos(-1) * b);
}

static void give_up(kempe_context *context, const char *what)
{
    fprintf(stderr, "%s: %s\n", what, kempe_context_message(context));
    exit(1);
}

static void find_motion(kempe_context *context, motion *m)
{
    const kempe_run_options run = {.rtol = 1e-11, .no_convergence_check = 1};
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *trajectory = NULL;
    if (kempe_model_read(context, model_file, &model) != KEMPE_OK || kempe_system_new(model, &system) != KEMPE_OK ||
        kempe_simulate(system, &run, &trajectory) != KEMPE_OK)
        give_up(context, "the true motion");
    m->rows = kempe_trajectory_row_count(trajectory);
    for (int k = 0; k < m->rows && k < MOST_ROWS; k++) {
        m->t[k] = kempe_trajectory_time(trajectory, k);
        m->value[k][0] = kempe_trajectory_q(trajectory, k)[0];
        m->value[k][1] = kempe_trajectory_q(trajectory, k)[2];
    }
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    kempe_model_free(model);
}

static void write_noisy(const motion *m, const char *path)
{
    FILE *file = fopen(path, "w");
    if (!file) {
        perror(path);
        exit(1);
    }
    fputs("t,q.crank,q.slider\n", file);
    for (int k = 0; k < m->rows; k++) {
        double angle = m->value[k][0] + noise[0] * normal(), stroke = m->value[k][1] + noise[1] * normal();
        fprintf(file, "%.17g,%.17g,%.17g\n", m->t[k], angle, stroke);
    }
    if (fclose(file) != 0) {
        perror(path);
        exit(1);
    }
}

/* The counts that 99 % of binomial numbers are within. */
static void find_band(int *low, int *high)
{
    *low = *high = 0;
    while (kmp_binomial_share(*low, REPETITIONS, 0.95) < 0.005)
        ++*low;
    while (kmp_binomial_share(*high, REPETITIONS, 0.95) < 0.995)
        ++*high;
}

int bench_fit(int argc, char **argv)
{
    (void)argc, (void)argv;
    static motion m;
    int covered[COUNT] = {0}, low, high, bad = 0;
    double sum[COUNT] = {0}, squares[COUNT] = {0}, errors[COUNT] = {0}, seconds = 0;
    char path[] = "/tmp/bench_fit_XXXXXX";
    int file = mkstemp(path);
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    const kempe_setting start[COUNT] = {{"rod_mass", "1.4"}, {"slider_mass", "4"}, {"guide", "1"}, {"bearing", "0.1"}};
    const kempe_run_options run = {.rtol = 1e-8};
    const kempe_fit_options ask = {
        .data = path, .parameters = "rod_mass:0.1:10,slider_mass:0.1:10,guide:0:20,bearing:0:", .run = &run};
    if (file < 0 || close(file) != 0)
        return 1;
    find_motion(context, &m);
    if (kempe_model_read_set(context, model_file, start, COUNT, &model) != KEMPE_OK)
        give_up(context, model_file);
    for (int k = 0; k < REPETITIONS; k++) {
        kempe_fit *fit = NULL;
        write_noisy(&m, path);
        double begin = bench_now();
        if (kempe_fit_new(model, &ask, &fit) != KEMPE_OK)
            give_up(context, "a fit");
        seconds += bench_now() - begin;
        for (int p = 0; p < COUNT; p++) {
            double away = kempe_fit_value(fit, p) - truth[p];
            covered[p] += kempe_fit_low(fit, p) <= truth[p] && truth[p] <= kempe_fit_high(fit, p);
            sum[p] += away / REPETITIONS;
            squares[p] += away * away / REPETITIONS;
            errors[p] += kempe_fit_error(fit, p) / REPETITIONS;
        }
        kempe_fit_free(fit);
    }
    find_band(&low, &high);
    printf("%s: %d parameters from %d angles (noise %g rad) and strokes (noise %g m), %d repetitions, %.1f ms each\n",
           model_file, COUNT, m.rows, noise[0], noise[1], REPETITIONS, 1e3 * seconds / REPETITIONS);
    printf("%-12s %12s %12s %12s %12s   95 %% intervals with the true value; 99 %% of such counts: %d to %d\n",
           "parameter", "true", "mean error", "scatter", "standard", low, high);
    for (int p = 0; p < COUNT; p++) {
        bool out = covered[p] < low || covered[p] > high;
        bad += out;
        printf("%-12s %12g %12.2e %12.4e %12.4e   %d of %d = %.1f %%%s\n", names[p], truth[p], sum[p],
               sqrt(squares[p] - sum[p] * sum[p]), errors[p], covered[p], REPETITIONS, 100.0 * covered[p] / REPETITIONS,
               out ? "  OUTSIDE" : "");
    }
    kempe_model_free(model);
    kempe_context_free(context);
    (void)remove(path);
    return bad > 0;
}
