/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Examples whose reference digits come from equations of their own: every formulation reaches them. */
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "output/reference.h"
#include <kempe/kempe.h>
#include <math.h>

enum { MOST_TIMES = 8, MOST = 64 };

typedef struct rows {
    int count, n;
    double q[MOST_TIMES][MOST], qd[MOST_TIMES][MOST];
} rows;

static int keep(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                double work)
{
    rows *r = user;
    (void)t, (void)qdd, (void)lambda, (void)work;
    for (int i = 0; i < r->n; i++)
        r->q[r->count][i] = q[i], r->qd[r->count][i] = qd[i];
    r->count++;
    return 0;
}

/* The worst deviation of a quantity, relative to values above 1. */
static double off(const kmp_reference *reference, kmp_quantity quantity, const rows *r)
{
    double worst = 0;
    int seen = 0;
    for (int k = 0; k < reference->rows; k++)
        for (int i = 0; i < r->n; i++) {
            double ref = reference->value[quantity][k * r->n + i];
            if (isnan(ref))
                continue;
            worst =
                check_max(worst, fabs((quantity == KMP_QUANTITY_Q ? r->q : r->qd)[k][i] - ref) / fmax(fabs(ref), 1));
            seen++;
        }
    CHECK(seen >= 4 * reference->rows);
    return worst;
}

/* integrator: NULL for the default of the formulation */
static void follow(const char *model, const char *digits, const char *formulation, const char *integrator, double rtol,
                   double near_q, double near_qd)
{
    loaded l = load(model);
    char path[1024];
    kmp_reference reference;
    kmp_run_report report;
    rows r = {.n = l.system->n};
    (void)snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, digits);
    CHECK(kmp_reference_read(l.system, path, &reference) == KEMPE_OK && reference.rows <= MOST_TIMES && r.n <= MOST);
    kmp_run_spec spec = {.formulation = formulation,
                         .integrator = integrator,
                         .rtol = rtol,
                         .t_end = reference.t[reference.rows - 1],
                         .time_count = reference.rows,
                         .times = reference.t};
    CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
    CHECK(kmp_run(l.system, &spec, NULL, keep, &r, &report) == KEMPE_OK && r.count == reference.rows);
    double q = off(&reference, KMP_QUANTITY_Q, &r), qd = off(&reference, KMP_QUANTITY_QD, &r);
    printf("   %-42s %-9s q %.1e  qd %.1e\n", model, formulation, q, qd);
    CHECK(q <= near_q);
    CHECK(qd <= near_qd);
    kmp_samples_free(&reference);
    unload(&l);
}

static void test_car_axis(void)
{
    static const char model[] = "examples/car_axis/car_axis.yaml", digits[] = "examples/car_axis/reference.csv";
    follow(model, digits, "reduced", NULL, 1e-12, 1e-11, 1e-9);
    follow(model, digits, "projected", NULL, 1e-12, 1e-11, 1e-9);
    follow(model, digits, "dae", "ida", 1e-9, 1e-6, 1e-4);
    follow(model, digits, "dae", NULL, 1e-9, 1e-6, 1e-4);
}

static void test_suspension(void)
{
    static const char model[] = "examples/suspension/suspension.yaml", digits[] = "examples/suspension/reference.csv";
    follow(model, digits, "reduced", "dop853", 1e-12, 1e-11, 1e-10);
    follow(model, digits, "reduced", NULL, 1e-12, 1e-11, 1e-9);
    follow(model, digits, "projected", NULL, 1e-12, 1e-11, 1e-10);
    follow(model, digits, "dae", "ida", 1e-9, 1e-7, 1e-5);
    follow(model, digits, "dae", NULL, 1e-9, 1e-7, 1e-5);
}

static void test_limousine(void)
{
    static const char model[] = "examples/limousine/limousine.yaml", digits[] = "examples/limousine/reference.csv";
    follow(model, digits, "reduced", NULL, 1e-12, 1e-10, 1e-8);
    follow(model, digits, "projected", NULL, 1e-12, 1e-10, 1e-8);
}

static void test_bogie(void)
{
    static const char model[] = "examples/bogie/shake.yaml", digits[] = "examples/bogie/reference.csv";
    follow(model, digits, "reduced", NULL, 1e-12, 1e-11, 1e-9);
    follow(model, digits, "projected", NULL, 1e-12, 1e-11, 1e-9);
    follow(model, digits, "dae", "ida", 1e-9, 1e-7, 1e-5);
    follow(model, digits, "dae", NULL, 1e-9, 1e-7, 1e-5);
}

static void test_hydraulics(void)
{
    static const char model[] = "examples/hydraulic_excavator/hydraulic_excavator.yaml",
                      digits[] = "examples/hydraulic_excavator/reference.csv";
    follow(model, digits, "reduced", "dop853", 1e-11, 1e-11, 1e-9);
    follow(model, digits, "reduced", "radau", 1e-11, 1e-11, 1e-9);
    follow(model, digits, "projected", NULL, 1e-11, 1e-11, 1e-9);
    follow(model, digits, "dae", "ida", 1e-9, 1e-6, 1e-4);
    follow(model, digits, "dae", NULL, 1e-9, 1e-6, 1e-4);
}

static void test_robot_leg(void)
{
    static const char model[] = "examples/robot_leg/robot_leg.yaml", digits[] = "examples/robot_leg/reference.csv";
    follow(model, digits, "reduced", "dop853", 1e-12, 1e-12, 1e-10);
    follow(model, digits, "reduced", NULL, 1e-12, 1e-11, 1e-9);
    follow(model, digits, "projected", NULL, 1e-12, 1e-11, 1e-9);
    follow(model, digits, "dae", "ida", 1e-9, 1e-6, 1e-4);
    follow(model, digits, "dae", NULL, 1e-9, 1e-6, 1e-4);
}

static void test_flexible_robot(void)
{
    static const char model[] = "examples/flexible_robot/flexible_robot.yaml",
                      digits[] = "examples/flexible_robot/reference.csv";
    follow(model, digits, "reduced", NULL, 1e-12, 1e-12, 1e-10);
    follow(model, digits, "projected", NULL, 1e-12, 1e-12, 1e-10);
    follow(model, digits, "dae", NULL, 1e-9, 1e-8, 1e-5);
}

/* Rounding of the stiffness of the mesh, by two programs, is 1e-9 of its first value. */
static void test_flexible_blade(void)
{
    static const char model[] = "examples/flexible_blade/flexible_blade.yaml",
                      digits[] = "examples/flexible_blade/reference.csv";
    follow(model, digits, "reduced", NULL, 1e-12, 1e-9, 1e-8);
    follow(model, digits, "projected", NULL, 1e-10, 1e-9, 1e-8);
}

static void test_flexible_slider_crank(void)
{
    static const char model[] = "examples/flexible_slider_crank/flexible_slider_crank.yaml",
                      digits[] = "examples/flexible_slider_crank/reference.csv";
    follow(model, digits, "reduced", NULL, 1e-12, 1e-12, 1e-10);
    follow(model, digits, "projected", NULL, 1e-12, 1e-12, 1e-10);
    follow(model, digits, "dae", NULL, 1e-9, 1e-8, 1e-5);
}

int main(void)
{
    TEST(test_car_axis);
    TEST(test_suspension);
    TEST(test_limousine);
    TEST(test_bogie);
    TEST(test_hydraulics);
    TEST(test_robot_leg);
    TEST(test_flexible_robot);
    TEST(test_flexible_blade);
    TEST(test_flexible_slider_crank);
    return check_report();
}
