/* SPDX-License-Identifier: BSD-3-Clause */
/* The film of a journal: its laws against the quadrature of Reynolds' equation, a squeezed film against its integral of
 * momentum, a loaded journal against Ocvirk's load and attitude. */
#include "ways.h"
#include <kempe/table.h>
#include <math.h>

#define PI 3.14159265358979323846

static const way precise[] = {{"reduced", NULL, "dop853", 1e-9, 1e-14}, {"projected", NULL, "radau", 1e-9, 1e-14}};

/* A bearing of 20 mm radius and length, a clearance of 0.1 mm, an oil of 0.02 Pa s. */
enum { NODES = 20000 };
static const double radius = 0.02, length = 0.02, clearance = 1e-4, viscosity = 0.02, mass = 0.5;

static loaded journal(const char *law, const char *more, const char *start)
{
    char text[1500];
    (void)snprintf(
        text, sizeof text,
        "kempe: 1\n"
        "gravity: [%s]\n"
        "bodies:\n"
        "  pin: {joint: {name: J, revolute: z, at: ground, clearance: 0.1 mm, contact: {radius: 20 mm, law: hertz, "
        "stiffness: 1e9, film: {law: %s, viscosity: 0.02 Pa*s, length: 20 mm, least: 1 um}}}, mass: 0.5, "
        "inertia: {zz: 1e-4}}\n"
        "%s\n"
        "run: {outputs: [q, qd, force(J)]}\n",
        more, law, start);
    return load_text(text);
}

static kempe_table *outputs(const kempe_trajectory *run)
{
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, "q,qd,force(J)", &table) == KEMPE_OK);
    return table;
}

static double number(const kempe_table *table, int row, const char *name)
{
    return table ? kempe_table_number(table, row, kempe_table_find(table, name)) : NAN;
}

/* -- laws --------------------------------------------------------------------------------------------------- */

/* The force of the film over its scale, by midpoints: with H = 1 - x cos - y sin the pressure of a short one is (u cos
 * + v sin)/H^3, of a long one H^3 p' = 12 (v cos - u sin) + C, the same at both ends. The film is around the bearing;
 * of `long` on the half where u cos + v sin > 0, with a pressure that is nowhere below zero. */
static void quadrature(const char *law, double x, double y, double u, double v, double force[2])
{
    const bool along = strncmp(law, "long", 4) == 0, half = strcmp(law, "long") == 0;
    const double step = (half ? PI : 2 * PI) / NODES, first = half ? atan2(v, u) - PI / 2 : 0;
    double sum = 0, cubes = 0, pressure = 0, most = 0, least = 0;
    for (int k = 0; along && k < NODES; k++) {
        double a = first + (k + 0.5) * step, h = 1 - x * cos(a) - y * sin(a), cube = 1 / (h * h * h);
        sum += 12 * (v * cos(a) - u * sin(a)) * cube;
        cubes += cube;
    }
    force[0] = force[1] = 0;
    for (int k = 0; k < NODES; k++) {
        double a = first + (k + 0.5) * step, h = 1 - x * cos(a) - y * sin(a), cube = 1 / (h * h * h);
        double p = (u * cos(a) + v * sin(a)) * cube, slope = (12 * (v * cos(a) - u * sin(a)) - sum / cubes) * cube;
        p = strcmp(law, "short") == 0 ? fmax(p, 0) : p;
        force[0] -= step * (along ? -slope * sin(a) : p * cos(a));
        force[1] -= step * (along ? slope * cos(a) : p * sin(a));
        pressure += step * slope;
        most = fmax(most, pressure);
        least = fmin(least, pressure);
    }
    CHECK(!half || (least > -1e-6 * most && most > 0));
}

static void laws(void)
{
    static const char *const words[] = {"short", "short_full", "long_full", "long"};
    static const double states[][5] = {/* x, y over the clearance, their rates in 1/s, spin */
                                       {0.3, -0.2, 40, 70, 100},
                                       {-0.6, 0.5, -20, 10, -300},
                                       {0.1, 0.85, 0, 30, 0},
                                       {-0.7, 0, 0, 0, 200},
                                       {0, 0, 25, -15, 0}};
    for (int w = 0; w < 4; w++)
        for (int k = 0; k < 5; k++) {
            const double *s = states[k], c = clearance;
            char start[300];
            (void)snprintf(start, sizeof start,
                           "start: {q: {J_x: %.17g, J_y: %.17g}, qd: {J_x: %.17g, J_y: %.17g, J: %g}}", c * s[0],
                           c * s[1], c * s[2], c * s[3], s[4]);
            loaded l = journal(words[w], "0, 0, 0", start);
            kempe_trajectory *run = simulate(&l, &precise[0], 1e-9);
            kempe_table *table = outputs(run);
            double ratio = w >= 2 ? radius * radius : length * length, expected[2];
            double scale = viscosity * radius * length * ratio / (c * c);
            quadrature(words[w], s[0], s[1], s[2] + 0.5 * s[4] * s[1], s[3] - 0.5 * s[4] * s[0], expected);
            double size = scale * hypot(expected[0], expected[1]);
            CHECK_NEAR(number(table, 0, "force.J.film_x"), scale * expected[0], 1e-7 * size);
            CHECK_NEAR(number(table, 0, "force.J.film_y"), scale * expected[1], 1e-7 * size);
            kempe_table_free(table);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* -- motions ------------------------------------------------------------------------------------------------ */

/* A journal that is thrown from the centre of a film at rest: m c (e'(0) - e') is the scale times the integral of the
 * film's factor, pi e/(1 - e^2)^1.5 of a short complete film and 12 pi e/(1 - e^2)^0.5 of a long one. */
static void squeezed(void)
{
    static const char *const words[] = {"short_full", "long_full"};
    for (int k = 0; k < 4; k++) {
        bool along = k / 2 == 1;
        const double rate = along ? 1e5 : 2e4, c = clearance;
        char start[200];
        (void)snprintf(start, sizeof start, "start: {qd: {J_x: %.17g, J_y: %.17g}}", 0.6 * c * rate, 0.8 * c * rate);
        loaded l = journal(words[k / 2], "0, 0, 0", start);
        kempe_trajectory *run = simulate(&l, &precise[k % 2], along ? 2e-5 : 1e-4);
        kempe_table *table = outputs(run);
        int rows = table ? kempe_table_row_count(table) : 0;
        const double scale = viscosity * radius * length * (along ? radius * radius : length * length) / (c * c);
        double e = 0, now = rate;
        for (int row = 0; row < rows; row++) {
            e = number(table, row, "force.J.eccentricity") / c;
            now = hypot(number(table, row, "qd.J_x"), number(table, row, "qd.J_y")) / c;
            double root = sqrt(1 - e * e), integral = along ? 12 * PI * e / root : PI * e / (root * root * root);
            CHECK_NEAR(mass * c * (rate - now), scale * integral, 1e-8 * mass * c * rate);
        }
        CHECK(e > 0.1 && e < 0.99 && now < 0.5 * rate);
        CHECK(run && run->verdict.drift_rel < 1e-8);
        kempe_table_free(table);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* A loaded journal comes to rest where the bearing has its load, at its attitude angle. Ocvirk's short one has the load
 * e sqrt(16 e^2 + pi^2 r^2)/(4 r^4) at tan = pi r/(4 e), the half solution of the long one 6 e sqrt(4 e^2 + pi^2
 * r^2)/((2
 * + e^2) r^2) at tan = pi r/(2 e), where r^2 = 1 - e^2. */
static void loaded_journal(void)
{
    for (int along = 0; along < 2; along++) {
        const double e = 0.75, spin = 100, r = sqrt(1 - e * e), c = clearance;
        const double scale = viscosity * radius * length * (along ? radius * radius : length * length) / (c * c);
        const double number_of_load = along ? 6 * e * sqrt(4 * e * e + PI * PI * r * r) / ((2 + e * e) * r * r)
                                            : e * sqrt(16 * e * e + PI * PI * r * r) / (4 * r * r * r * r);
        const double attitude = atan(PI * r / ((along ? 2 : 4) * e));
        char gravity[100], start[300];
        (void)snprintf(gravity, sizeof gravity, "0, %.17g, 0", -scale * spin * number_of_load / mass);
        (void)snprintf(start, sizeof start,
                       "drives: {motor: {joint: J, angle: 100*t}}\n"
                       "start: {q: {J_y: -0.05 mm}, qd: {J: 100, J_x: 0, J_y: 0}}");
        loaded l = journal(along ? "long" : "short", gravity, start);
        kempe_trajectory *run = simulate(&l, &precise[0], 1);
        kempe_table *table = outputs(run);
        int last = table ? kempe_table_row_count(table) - 1 : 0;
        double x = number(table, last, "q.J_x") / c, y = number(table, last, "q.J_y") / c;
        CHECK_NEAR(hypot(x, y), e, 1e-8);
        CHECK_NEAR(fabs(atan2(x, -y)), attitude, 1e-8);
        CHECK(x > 0); /* it turns against the clock, and climbs towards +x from its lowest place */
        kempe_table_free(table);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

int main(void)
{
    TEST(laws);
    TEST(squeezed);
    TEST(loaded_journal);
    return check_report();
}
