/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of two variables: bicubic and bilinear functions are themselves, in either order of the variables and in the
 * equations with their derivatives; straight continuation beyond the grid; mistakes in files. */
#include "loaded.h"
#include "symbolic/derivative.h"
#include "symbolic/table_function.h"

static const double xs[] = {-1, 0, 0.5, 1.2, 2, 3}, ys[] = {0, 0.4, 1, 2.5};
enum { NX = 6, NY = 4 };

static double bicubic(double x, double y)
{
    return (1 + x - x * x * x) * (2 - y * y + 0.5 * y * y * y) + x * y;
}

static double bilinear(double x, double y)
{
    return 2 + 3 * x - y + 0.7 * x * y;
}

/* On the grid, with its variables in this order or exchanged. */
static kmp_surface *made(kmp_table_method method, double (*f)(double, double), bool exchanged)
{
    const int count[2] = {exchanged ? NY : NX, exchanged ? NX : NY};
    double z[NX * NY];
    for (int i = 0; i < NX; i++)
        for (int j = 0; j < NY; j++)
            z[exchanged ? j * NX + i : i * NY + j] = f(xs[i], ys[j]);
    return kmp_surface_new(method, count, exchanged ? ys : xs, exchanged ? xs : ys, z);
}

static void polynomials_are_exact(void)
{
    kmp_surface *cubic = made(KMP_TABLE_CUBIC, bicubic, false), *back = made(KMP_TABLE_CUBIC, bicubic, true);
    kmp_surface *flat = made(KMP_TABLE_LINEAR, bilinear, false);
    CHECK(cubic && back && flat);
    for (double x = -1; cubic && back && flat && x <= 3; x += 0.13)
        for (double y = 0; y <= 2.5; y += 0.17) {
            CHECK_NEAR(kmp_surface_value(cubic, x, y), bicubic(x, y), 1e-13);
            CHECK_NEAR(kmp_surface_value(back, y, x), bicubic(x, y), 1e-13);
            CHECK_NEAR(kmp_surface_value(flat, x, y), bilinear(x, y), 1e-14);
        }
    kmp_surface_free(cubic);
    kmp_surface_free(back);
    kmp_surface_free(flat);
}

/* At the ends value and slope are continued. */
static void beyond_the_grid(void)
{
    const double h = 1e-6;
    kmp_surface *s = made(KMP_TABLE_CUBIC, bicubic, false);
    double slope = (bicubic(3, 1.3) - bicubic(3 - h, 1.3)) / h;
    CHECK_NEAR(kmp_surface_value(s, 4, 1.3), bicubic(3, 1.3) + slope, 1e-4);
    CHECK_NEAR(kmp_surface_value(s, 5, 1.3) - kmp_surface_value(s, 4, 1.3),
               kmp_surface_value(s, 4, 1.3) - kmp_surface_value(s, 3, 1.3), 1e-12);
    CHECK(isnan(kmp_surface_value(s, NAN, 1)) && isnan(kmp_surface_value(s, 1, NAN)));
    kmp_surface_free(s);
}

/* Mixed derivatives in the graph. */
static void derivatives_are_exact(void)
{
    const double q[2] = {0.83, 1.9}, *inputs[KMP_IN_COUNT] = {[KMP_IN_Q] = q};
    kmp_surface *s = made(KMP_TABLE_CUBIC, bicubic, false);
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_Q, 0), y = kmp_input(g, KMP_IN_Q, 1), z = kmp_surface_at(g, s, x, y), by_x, both;
    kmp_derivatives_by(g, x, 1, &z, &by_x);
    kmp_derivatives_by(g, y, 1, &by_x, &both);
    double value[4096];
    CHECK(!kmp_graph_failed(g) && kmp_graph_count(g) < 4096);
    kmp_graph_eval(g, inputs, value);
    const double X = q[0], Y = q[1], px = 1 - 3 * X * X, py = 2 - Y * Y + 0.5 * Y * Y * Y, dpy = -2 * Y + 1.5 * Y * Y;
    CHECK_NEAR((kmp_is_negative(z) ? -1 : 1) * value[kmp_id(z)], bicubic(X, Y), 1e-13);
    CHECK_NEAR((kmp_is_negative(by_x) ? -1 : 1) * value[kmp_id(by_x)], px * py + Y, 1e-12);
    CHECK_NEAR((kmp_is_negative(both) ? -1 : 1) * value[kmp_id(both)], px * dpy + 1, 1e-12);
    kmp_graph_free(g);
    kmp_surface_free(s);
}

/* A force of position and rate, (x + x^3)(1 + v) as a table of x and v, in a run. */
static void in_a_model(void)
{
    loaded l = load_text("kempe: 1\n"
                         "tables: {f: {x: [-1, -0.5, 0, 0.5, 1], y: [-2, 0, 1, 3],\n"
                         "             z: [[2, -2, -4, -8], [0.625, -0.625, -1.25, -2.5], [0, 0, 0, 0],\n"
                         "                 [-0.625, 0.625, 1.25, 2.5], [-2, 2, 4, 8]]}}\n"
                         "bodies: {m: {joint: {name: S, prismatic: x, at: ground}, mass: 2}}\n"
                         "forces: {s: {joint: S, force: '-f(distance, rate)'}}\n"
                         "start: {q: {S: 0.3}, qd: {S: 0.4}}\n");
    kempe_trajectory *run = NULL;
    const kempe_run_options options = {.rtol = 1e-11, .t_end = 1, .no_convergence_check = 1};
    CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_OK);
    /* x'' = -(x + x^3)(1 + x')/2, by 20,000 steps of Runge-Kutta's method of order four */
    double x = 0.3, v = 0.4, h = 1.0 / 20000;
    for (int k = 0; k < 20000; k++) {
        double d[4][2], a = x, b = v;
        for (int i = 0; i < 4; i++) {
            d[i][0] = b;
            d[i][1] = -(a + a * a * a) * (1 + b) / 2;
            double c = i < 2 ? h / 2 : h;
            a = x + c * d[i][0];
            b = v + c * d[i][1];
        }
        x += h / 6 * (d[0][0] + 2 * d[1][0] + 2 * d[2][0] + d[3][0]);
        v += h / 6 * (d[0][1] + 2 * d[1][1] + 2 * d[2][1] + d[3][1]);
    }
    if (run) {
        int last = kempe_trajectory_row_count(run) - 1;
        CHECK_NEAR(kempe_trajectory_q(run, last)[0], x, 1e-10);
        CHECK_NEAR(kempe_trajectory_qd(run, last)[0], v, 1e-10);
    }
    kempe_trajectory_free(run);
    unload(&l);
}

int main(void)
{
    TEST(polynomials_are_exact);
    TEST(beyond_the_grid);
    TEST(derivatives_are_exact);
    TEST(in_a_model);
    return check_report();
}
