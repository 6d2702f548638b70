/* SPDX-License-Identifier: BSD-3-Clause */
/* Chains of N loops, 10 s at rtol 1e-8 by the default formulation: what reading, deriving and preparing cost, and
 * integrating with change points ignored and crossed; and how each grows from N = 100 on, as the exponent of N.
 * Seconds are the least of some runs.
 *
 *     bench windows [LARGEST N, 1000 if absent]
 */
#include "bench.h"
#include "chain.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static char *windows(int n)
{
    return chain_text(n, false, 0);
}

static const struct {
    const char *title;
    char *(*text)(int n);
} kinds[] = {{"A02, square windows: parallelograms with exact change points", windows},
             {"hanging windows of different lengths: general loops without change points", chain_hanging},
             {"square windows hinged in space: five rows a loop, two independent", chain_in_space},
             {"hanging windows with a pendulum each: N + 1 freedoms", chain_of_pendulums}};

/* Costs of one size; growth is measured in these. */
enum { READ, DERIVE, PREPARE, IGNORED, LED, COSTS };

typedef struct measured {
    double s[COSTS];
    long steps[2], rhs[2];
    int coordinates, freedoms, passages;
    char *reason;
} measured;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    (void)user, (void)t, (void)q, (void)qd, (void)qdd, (void)lambda, (void)work;
    return 0;
}

static void least(double *of, double seconds)
{
    *of = *of > 0 ? fmin(*of, seconds) : seconds;
}

static void run(const kempe_system *system, measured *m, bool led)
{
    const double end = 10;
    kmp_run_report report;
    kmp_run_log log = {.context = system->context};
    kmp_run_spec spec = {.rtol = 1e-8,
                         .t_end = end,
                         .time_count = 1,
                         .times = &end,
                         .log = &log,
                         .change_points = led ? "cross" : "ignore"};
    if (kmp_run_resolve(system, &spec) == KEMPE_OK)
        (void)kmp_run(system, &spec, NULL, take_row, NULL, &report);
    free(m->reason);
    m->reason = report.reason;
    least(&m->s[led ? LED : IGNORED], report.cpu_s);
    if (!led)
        least(&m->s[PREPARE], report.build_s);
    m->steps[led] = report.steps;
    m->rhs[led] = report.rhs;
    m->passages = 0;
    for (int k = 0; k < log.kept; k++)
        m->passages += strcmp(log.entries[k].kind, "change point") == 0;
    kmp_run_log_free(&log);
}

static void once(const char *text, measured *m)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    double begin = bench_now();
    if (kempe_model_read_text(context, text, "chain", &model) == KEMPE_OK) {
        least(&m->s[READ], bench_now() - begin);
        begin = bench_now();
        if (kempe_system_new(model, &system) == KEMPE_OK) {
            least(&m->s[DERIVE], bench_now() - begin);
            m->coordinates = system->n;
            for (int led = 0; led < 2; led++)
                run(system, m, led);
        }
    }
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

static measured measure(int n, char *(*text_of)(int n))
{
    measured m = {.reason = NULL};
    char *text = text_of(n);
    for (int k = 0; text && k < (n <= 100 ? 5 : 2); k++)
        once(text, &m);
    free(text);
    return m;
}

static void print_run(const measured *m, int led)
{
    double s = m->s[led ? LED : IGNORED], rhs = fmax(1, (double)m->rhs[led]);
    printf(" | %9.2f %5ld %5ld %7.1f", 1e3 * s, m->steps[led], m->rhs[led], 1e9 * s / rhs / m->coordinates);
}

static void print(int n, const measured *m)
{
    printf("%6d %6d | %8.2f %8.2f %8.2f", n, m->coordinates, 1e3 * m->s[READ], 1e3 * m->s[DERIVE], 1e3 * m->s[PREPARE]);
    print_run(m, 0);
    print_run(m, 1);
    printf(" %5d%s%s\n", m->passages, m->reason ? "  " : "", m->reason ? m->reason : "");
    fflush(stdout);
}

/* Least squares through the logarithms. */
static double slope(int count, const double *x, const double *y)
{
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int k = 0; k < count; k++) {
        sx += log(x[k]);
        sy += log(y[k]);
        sxx += log(x[k]) * log(x[k]);
        sxy += log(x[k]) * log(y[k]);
    }
    return (count * sxy - sx * sy) / (count * sxx - sx * sx);
}

int bench_windows(int argc, char **argv)
{
    enum { SIZES = 6, GROWING = 2 };
    static const int sizes[SIZES] = {10, 40, 100, 200, 400, 1000};
    int largest = argc > 1 ? atoi(argv[1]) : 1000;
    for (size_t kind = 0; kind < sizeof kinds / sizeof *kinds; kind++) {
        double n[SIZES], costs[COSTS][SIZES];
        int count = 0;
        printf("%s%s\n%13s | %-26s | %-29s | crossed\n", kind ? "\n" : "", kinds[kind].title, "", "ms",
               "change points ignored");
        printf("%6s %6s | %8s %8s %8s", "N", "coord.", "read", "derive", "prepare");
        for (int led = 0; led < 2; led++)
            printf(" | %9s %5s %5s %7s", "ms", "steps", "rhs", "ns each");
        printf(" %5s\n", "passed");
        for (int k = 0; k < SIZES && sizes[k] <= largest; k++) {
            measured m = measure(sizes[k], kinds[kind].text);
            print(sizes[k], &m);
            if (k >= GROWING) {
                n[count] = sizes[k];
                for (int c = 0; c < COSTS; c++)
                    costs[c][count] = m.s[c];
                count++;
            }
            free(m.reason);
        }
        if (count > 1) {
            printf("%13s | %8.2f %8.2f %8.2f", "growth", slope(count, n, costs[READ]), slope(count, n, costs[DERIVE]),
                   slope(count, n, costs[PREPARE]));
            printf(" | %9.2f %19s | %9.2f\n", slope(count, n, costs[IGNORED]), "", slope(count, n, costs[LED]));
        }
    }
    return 0;
}
