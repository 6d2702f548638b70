/* SPDX-License-Identifier: BSD-3-Clause */
/* The stiff flyball governor (IFToMM A05): BDF, Radau IIA and IDA on the reduced formulation and IDA on the dae one
 * reach its digits, recomputed in quadruple precision, and their steps hardly grow when stiffness and damping grow a
 * hundredfold.
 */
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "testing.h"
#include <stdlib.h>

/* t, slider, rods, shaft, rate of the shaft */
static const double digits[][5] = {
    {0.1, 0.523836475569575694, 0.496173869075900256, 0.622106681402687571, 6.10371780883086276},
    {0.5, 0.743249424786325721, 0.259491381543413122, 2.80767948836790160, 5.10341542197153530},
    {1, 0.501420922379567651, 0.521833301625546231, 5.58634696586900543, 6.27112574187655480},
    {2, 0.505909294296703707, 0.516663797364598739, 11.1732670756612499, 6.23622361443597147},
    {5, 0.535563103721643485, 0.482874576586939815, 27.9425319910429575, 6.02249649975845904},
    {10, 0.619622917061365659, 0.390073701844645081, 55.9354099091023788, 5.54820362265492658}};
enum { ROWS = sizeof digits / sizeof *digits };

/* The model's text with other stiffness and damping. */
static char *governor(const char *stiffness)
{
    static char text[8192], changed[8192];
    char path[512];
    snprintf(path, sizeof path, "%s/examples/governor/governor.yaml", KEMPE_ROOT);
    FILE *file = fopen(path, "r");
    CHECK(file != NULL);
    size_t length = file ? fread(text, 1, sizeof text - 1, file) : 0;
    if (file)
        fclose(file);
    text[length] = '\0';
    static const char given[] = "K: 8e5, c: 4e4";
    char *at = strstr(text, given);
    CHECK(at != NULL);
    if (at)
        snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, stiffness, at + sizeof given - 1);
    return changed;
}

typedef struct judge {
    int row;
    double worst;
} judge;

static int take(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                double work)
{
    judge *j = user;
    (void)qdd;
    (void)lambda;
    (void)work;
    const double *d = digits[j->row++];
    CHECK(d[0] == t);
    const double got[5] = {q[1], q[2], q[0], qd[0], q[3]}, right[5] = {d[1], d[2], d[3], d[4], d[2]};
    for (int k = 0; k < 5; k++)
        j->worst = fmax(j->worst, fabs(got[k] - right[k]) / fmax(fabs(right[k]), 1));
    return 0;
}

typedef struct method {
    const char *formulation, *integrator;
    double rtol;
} method;

/* Steps taken; the worst difference to the digits of the model as it is in *worst. */
static long run(const char *stiffness, method w, double *worst)
{
    loaded l = load_text(governor(stiffness));
    judge j = {0};
    double times[ROWS];
    kmp_run_report report = {0};
    for (int k = 0; k < ROWS; k++)
        times[k] = digits[k][0];
    kmp_run_spec spec = {.formulation = w.formulation,
                         .integrator = w.integrator,
                         .rtol = w.rtol,
                         .t_end = 10,
                         .time_count = ROWS,
                         .times = times};
    if (l.system && kmp_run_resolve(l.system, &spec) == KEMPE_OK)
        CHECK(kmp_run(l.system, &spec, NULL, take, &j, &report) == KEMPE_OK);
    CHECK(j.row == ROWS);
    *worst = j.worst;
    kmp_free(report.reason);
    unload(&l);
    return report.steps;
}

static void check_way(method w, double most)
{
    double worst, other;
    long steps = run("K: 8e5, c: 4e4", w, &worst), stiffer = run("K: 8e7, c: 4e6", w, &other);
    printf("  %-8s %-6s rtol %.0e: off %.1e, %ld steps; K and c a hundredfold: %ld steps\n", w.formulation,
           w.integrator, w.rtol, worst, steps, stiffer);
    CHECK(worst <= most);
    CHECK((double)stiffer <= 1.4 * (double)steps);
}

static void test_governor(void)
{
    for (int k = 0; k < 2; k++) {
        double rtol = k ? 1e-12 : 1e-10;
        check_way((method){"reduced", "bdf", rtol}, 1e-7);
        check_way((method){"dae", "ida", rtol}, 1e-7);
        check_way((method){"reduced", "ida", rtol}, 1e-7);
        check_way((method){"reduced", "radau5", rtol}, 100 * rtol);
        check_way((method){"reduced", "radau9", rtol}, 1000 * rtol);
    }
}

/* A loop: digits of explicit runs at rtol 1e-13 on the reduced and the projected formulation, which share them. */
static int take_rod(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    static const double right[4] = {10.98811816151, -10.57661106120, -2.7332639612e-6, 0.45676580214};
    judge *j = user;
    (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    for (int k = 0; k < 4; k++)
        j->worst = fmax(j->worst, fabs(q[k] - right[k]));
    j->row++;
    return 0;
}

static void test_elastic_rod(void)
{
    static const method methods[] = {{"reduced", "bdf", 1e-10},
                                     {"reduced", "ida", 1e-10},
                                     {"dae", "ida", 1e-10},
                                     {"reduced", "radau5", 1e-10},
                                     {"reduced", "radau9", 1e-10}};
    static const double most[] = {1e-5, 1e-5, 1e-5, 2e-6, 1e-7}, end = 1;
    for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
        loaded l = load("tests/models/elastic_rod.yaml");
        judge j = {0};
        kmp_run_report report = {0};
        kmp_run_spec spec = {.formulation = methods[k].formulation,
                             .integrator = methods[k].integrator,
                             .rtol = methods[k].rtol,
                             .t_end = 1,
                             .time_count = 1,
                             .times = &end};
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(l.system, &spec, NULL, take_rod, &j, &report) == KEMPE_OK);
        printf("  elastic rod, %-9s %-6s rtol %.0e: off %.1e, %ld steps, %ld exchanges\n", spec.form,
               methods[k].integrator, methods[k].rtol, j.worst, report.steps, report.exchanges);
        CHECK(j.row == 1 && j.worst <= most[k]);
        CHECK(strcmp(methods[k].formulation, "reduced") != 0 || report.exchanges > 0);
        kmp_free(report.reason);
        unload(&l);
    }
}

int main(void)
{
    TEST(test_governor);
    TEST(test_elastic_rod);
    return check_report();
}
