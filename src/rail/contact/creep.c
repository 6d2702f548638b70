/* SPDX-License-Identifier: BSD-3-Clause */
/* Creep laws in closed form. All begin with the linear force over the greatest one, f = F / (friction N):
 *
 *     f = -G a b (C11 x, C22 y + sqrt(a b) C23 spin) / (friction N). */
#include "rail/contact/creep.h"
#include "base/context.h"
#include "base/spline.h"
#include <math.h>
#include <stddef.h>

/* -- Kalker's coefficients ------------------------------------------------------------------------------- */

/* Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, table E.3: coefficients at g = 0.1 to 1, the
 * lesser over the greater semi-axis, for Poisson's ratios 0, 1/4, 1/2; and their asymptotes for slender ellipses.
 *
 * Over Poisson's ratio 1/C is a parabola through the three. Over log(a/b) log C is a cubic spline through the rows.
 * Beyond the rows it follows the asymptotes, times the last row's ratio to its asymptote, which fades with g. */

enum { ROWS = KMP_KALKER_ROWS, POINTS = KMP_KALKER_POINTS, COEFFICIENTS = KMP_KALKER_COEFFICIENTS, RATIOS = 3 };

/* [long across, long along][g = (row + 1)/10][coefficient][Poisson's ratio] */
static const double table[2][ROWS][COEFFICIENTS][RATIOS] = {
    {{{2.51, 3.31, 4.85}, {2.51, 2.52, 2.53}, {0.334, 0.473, 0.731}, {6.42, 8.28, 11.7}},
     {{2.59, 3.37, 4.81}, {2.59, 2.63, 2.66}, {0.483, 0.603, 0.809}, {3.46, 4.27, 5.66}},
     {{2.68, 3.44, 4.80}, {2.68, 2.75, 2.81}, {0.607, 0.715, 0.889}, {2.49, 2.96, 3.72}},
     {{2.78, 3.53, 4.82}, {2.78, 2.88, 2.98}, {0.720, 0.823, 0.977}, {2.02, 2.32, 2.77}},
     {{2.88, 3.62, 4.83}, {2.88, 3.01, 3.14}, {0.827, 0.929, 1.07}, {1.74, 1.93, 2.22}},
     {{2.98, 3.72, 4.91}, {2.98, 3.14, 3.31}, {0.930, 1.03, 1.18}, {1.56, 1.68, 1.86}},
     {{3.09, 3.81, 4.97}, {3.09, 3.28, 3.48}, {1.03, 1.14, 1.29}, {1.43, 1.50, 1.60}},
     {{3.19, 3.91, 5.05}, {3.19, 3.41, 3.65}, {1.13, 1.25, 1.40}, {1.34, 1.37, 1.42}},
     {{3.29, 4.01, 5.12}, {3.29, 3.54, 3.82}, {1.23, 1.36, 1.51}, {1.27, 1.27, 1.27}},
     {{3.40, 4.12, 5.20}, {3.40, 3.67, 3.98}, {1.33, 1.47, 1.63}, {1.21, 1.19, 1.16}}},
    {{{10.7, 11.7, 12.9}, {10.7, 12.8, 16.0}, {12.2, 14.6, 18.0}, {0.795, 0.526, 0.228}},
     {{6.96, 7.78, 8.82}, {6.96, 8.14, 9.79}, {5.72, 6.63, 7.89}, {0.828, 0.601, 0.341}},
     {{5.57, 6.34, 7.34}, {5.57, 6.40, 7.51}, {3.79, 4.32, 5.01}, {0.868, 0.674, 0.446}},
     {{4.84, 5.57, 6.57}, {4.84, 5.48, 6.31}, {2.88, 3.24, 3.70}, {0.912, 0.747, 0.549}},
     {{4.37, 5.10, 6.11}, {4.37, 4.90, 5.56}, {2.35, 2.62, 2.96}, {0.958, 0.819, 0.650}},
     {{4.06, 4.78, 5.80}, {4.06, 4.50, 5.04}, {2.01, 2.23, 2.50}, {1.01, 0.892, 0.751}},
     {{3.82, 4.54, 5.58}, {3.82, 4.21, 4.67}, {1.76, 1.95, 2.18}, {1.05, 0.965, 0.852}},
     {{3.65, 4.36, 5.42}, {3.65, 3.99, 4.39}, {1.58, 1.75, 1.94}, {1.10, 1.04, 0.954}},
     {{3.51, 4.22, 5.30}, {3.51, 3.81, 4.16}, {1.44, 1.59, 1.77}, {1.16, 1.11, 1.06}},
     {{3.40, 4.12, 5.20}, {3.40, 3.67, 3.98}, {1.33, 1.47, 1.63}, {1.21, 1.19, 1.16}}}};

/* g -> 0, the ellipse long across the direction of rolling. */
static void long_across(double g, double nu, double c[COEFFICIENTS])
{
    const double pi = 3.14159265358979323846;
    c[0] = pi * pi / (4 * (1 - nu));
    c[1] = pi * pi / 4;
    c[2] = pi * sqrt(g) / (3 * (1 - nu)) * (1 + nu * (log(16 / g) - 5));
    c[3] = pi * pi / (16 * (1 - nu) * g);
}

/* Long in the direction of rolling. */
static void long_along(double g, double nu, double c[COEFFICIENTS])
{
    const double pi = 3.14159265358979323846;
    double l = log(16 / (g * g)), x = l - 2 * nu, y = (1 - nu) * l + 2 * nu, spin = (1 - nu) * l - 2 + 4 * nu;
    c[0] = 2 * pi / (x * g) * (1 + (3 - log(4)) / x);
    c[1] = 2 * pi / (y * g) * (1 + (1 - nu) * (3 - log(4)) / y);
    c[2] = 2 * pi / (3 * g * sqrt(g) * spin);
    c[3] = 0.25 * pi * (1 - nu * (l - 2) / spin);
}

/* The table's row at nu. */
static void row_at(int side, int row, double nu, double c[COEFFICIENTS])
{
    double weight[RATIOS] = {(1 - 4 * nu) * (1 - 2 * nu), 8 * nu * (1 - 2 * nu), -2 * nu * (1 - 4 * nu)};
    for (int k = 0; k < COEFFICIENTS; k++) {
        double inverse = 0;
        for (int i = 0; i < RATIOS; i++)
            inverse += weight[i] / table[side][row][k][i];
        c[k] = 1 / inverse;
    }
}

/* Coefficients number `step` beyond the circle: a row, then the asymptote. Gives log g. */
static double point(int side, int step, double nu, double c[COEFFICIENTS])
{
    if (step < ROWS) {
        row_at(side, ROWS - 1 - step, nu, c);
        return step == 0 ? 0 : log(0.1 * (ROWS - step));
    }
    double last[COEFFICIENTS], there[COEFFICIENTS], log_g = log(0.1) - 0.4 * (step - ROWS + 1), g = exp(log_g);
    void (*asymptote)(double, double, double *) = side == 0 ? long_across : long_along;
    row_at(side, 0, nu, last);
    asymptote(0.1, nu, there);
    asymptote(g, nu, c);
    for (int k = 0; k < COEFFICIENTS; k++)
        c[k] *= 1 + (last[k] / there[k] - 1) * g / 0.1;
    return log_g;
}

void kmp_kalker_points(double poisson, double x[POINTS], double y[COEFFICIENTS][POINTS])
{
    enum { MIDDLE = ROWS + KMP_KALKER_BEYOND - 1 };
    for (int k = 0; k < POINTS; k++) {
        double c[COEFFICIENTS];
        int side = k > MIDDLE, step = side ? k - MIDDLE : MIDDLE - k;
        double log_g = point(side, step, poisson, c);
        x[k] = side ? -log_g : log_g;
        for (int i = 0; i < COEFFICIENTS; i++)
            y[i][k] = log(c[i]);
    }
}

/* The spline through `count` points at `at`, straight beyond its ends. */
static double spline_at(int count, const double *x, const double *y, double at)
{
    double slope[POINTS], work[2 * POINTS], piece[4];
    kmp_spline_slopes(count, x, y, slope, work);
    if (at < x[0])
        return y[0] + slope[0] * (at - x[0]);
    if (at > x[count - 1])
        return y[count - 1] + slope[count - 1] * (at - x[count - 1]);
    int k = 0;
    while (k < count - 2 && at >= x[k + 1])
        k++;
    kmp_spline_piece(x[k + 1] - x[k], y[k], y[k + 1], slope[k], slope[k + 1], piece);
    double d = at - x[k];
    return piece[0] + d * (piece[1] + d * (piece[2] + d * piece[3]));
}

kempe_status kempe_contact_kalker(double ratio, double poisson, kempe_kalker *coefficients)
{
    KMP_WANTED(NULL, coefficients, "coefficients");
    if (!isfinite(ratio) || ratio <= 0 || !(poisson >= 0 && poisson <= 0.5))
        return KEMPE_E_ARGUMENT;
    double x[POINTS], y[COEFFICIENTS][POINTS], c[COEFFICIENTS], at = log(ratio);
    kmp_kalker_points(poisson, x, y);
    for (int k = 0; k < COEFFICIENTS; k++)
        c[k] = exp(spline_at(POINTS, x, y[k], at));
    *coefficients = (kempe_kalker){.c11 = c[0], .c22 = c[1], .c23 = c[2], .c33 = c[3]};
    return KEMPE_OK;
}

/* -- FASTSIM --------------------------------------------------------------------------------------------- */

/* Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11, 1982: displacement
 * is flexibility times traction. In a strip along the direction of rolling traction grows, from the leading edge
 * backwards, by the slip of the bodies. It is cut to friction times pressure where it exceeds that. The pressure is a
 * paraboloid, which gives the correct slip.
 *
 * Strips lie at y = b sin(angle), angles in even steps: the summands are then smooth to the ends of the ellipse. In a
 * strip steps are even, and tractions are taken in the middle of each. */

static const double pi = 3.14159265358979323846;

enum { STRIPS = 50 };

static void fastsim_flexibilities(const kempe_creep *c, const kempe_kalker *k, double flexibility[3])
{
    double ratio = c->a / c->b;
    flexibility[0] = 8 * c->a / (3 * c->shear_modulus * k->c11);
    flexibility[1] = 8 * c->a / (3 * c->shear_modulus * k->c22);
    flexibility[2] = pi * c->a * sqrt(ratio) / (4 * c->shear_modulus * k->c23);
}

/* The one flexibility that replaces the three of Kalker's theory. Kalker 1982:
 *
 *     L = (|x| L1 + |y| L2 + c |spin| L3) / sqrt(x^2 + y^2 + c^2 spin^2), c = sqrt(a b). */
static double fastsim_flexibility(const kempe_creep *c, const kempe_kalker *k)
{
    double each[3], weight[3] = {fabs(c->slip[0]), fabs(c->slip[1]), fabs(c->spin) * sqrt(c->a * c->b)};
    double size = hypot(hypot(weight[0], weight[1]), weight[2]), mean = 0;
    fastsim_flexibilities(c, k, each);
    for (int i = 0; i < 3; i++)
        mean += size > 0 ? weight[i] / size * each[i] : 0;
    return size > 0 ? mean : each[0];
}

/* A strip's contribution to the sums over x of traction and its moment, and the part of it that sticks. */
typedef struct strip_sum {
    double traction[2], turn, sticking;
} strip_sum;

/* The strip at y, `half` long to either side; `room` is the bound in its middle over half^2. */
static strip_sum strip(const kempe_creep *c, const double flexibility[3], int steps, double y, double half, double room)
{
    strip_sum sum = {.turn = 0};
    double dx = 2 * half / steps, before = half, p[2] = {0};
    for (int k = 0; k < steps; k++) {
        double x = half - (k + 0.5) * dx, length = before - x, middle = 0.5 * (before + x);
        p[0] -= length * (c->slip[0] / flexibility[0] - c->spin * y / flexibility[2]);
        p[1] -= length * (c->slip[1] / flexibility[1] + c->spin * middle / flexibility[2]);
        double size = hypot(p[0], p[1]), bound = room * (half * half - x * x);
        if (size > bound) {
            p[0] *= bound / size;
            p[1] *= bound / size;
        } else {
            sum.sticking += dx;
        }
        for (int i = 0; i < 2; i++)
            sum.traction[i] += dx * p[i];
        sum.turn += dx * (x * p[1] - y * p[0]);
        before = x;
    }
    return sum;
}

/* *force is zero before. */
static void fastsim_force(const kempe_creep *c, const double flexibility[3], kempe_creep_force *force)
{
    int strips = c->strips > 0 ? c->strips : STRIPS;
    double room = 2 * c->friction * c->normal / (pi * c->a * c->b) / (c->a * c->a), step = pi / strips;
    for (int k = 0; k < strips; k++) {
        double angle = (k + 0.5) * step - 0.5 * pi, width = c->b * cos(angle) * step;
        strip_sum sum = strip(c, flexibility, strips, c->b * sin(angle), c->a * cos(angle), room);
        for (int i = 0; i < 2; i++)
            force->force[i] += width * sum.traction[i];
        force->moment += width * sum.turn;
        force->sticking += width * sum.sticking / (pi * c->a * c->b);
    }
}

static int is_creep(const kempe_creep *c)
{
    const double finite[] = {c->a, c->b, c->shear_modulus, c->normal, c->friction, c->slip[0], c->slip[1], c->spin};
    for (size_t k = 0; k < sizeof finite / sizeof *finite; k++)
        if (!isfinite(finite[k]))
            return 0;
    return c->a > 0 && c->b > 0 && c->shear_modulus > 0 && c->poisson >= 0 && c->poisson <= 0.5 && c->normal >= 0 &&
           c->friction >= 0 && c->strips >= 0;
}

/* Kalker 1967 (1990, eq. 5.1): without a bound. */
static void linear(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    double area = c->a * c->b, g = c->shear_modulus * area, root = sqrt(area);
    out->force[0] = -g * k->c11 * c->slip[0];
    out->force[1] = -g * (k->c22 * c->slip[1] + root * k->c23 * c->spin);
    out->moment = g * root * (k->c23 * c->slip[1] - root * k->c33 * c->spin);
}

static void scale(kempe_creep_force *f, double by)
{
    f->force[0] *= by;
    f->force[1] *= by;
    f->moment *= by;
}

/* Vermeulen and Johnson 1964; for ellipses and spin Shen, Hedrick and Elkins 1983: |F| = bound (t - t^2/3 + t^3/27) up
 * to t = |linear F| / bound = 3. The moment is reduced by the same factor as the force. */
static void shen(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    linear(c, k, out);
    double size = hypot(out->force[0], out->force[1]), bound = c->friction * c->normal, t = size / bound;
    if (bound == 0)
        scale(out, 0);
    else if (t < 3)
        scale(out, 1 + t * (t / 27 - 1.0 / 3));
    else
        scale(out, bound / size);
}

static double over_tanh(double x)
{
    return fabs(x) < 1e-8 ? 1 : tanh(x) / x;
}

/* Jaschinski 1990: each component is saturated separately; the moment with the magnitude of the force. */
static void by_tanh(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    linear(c, k, out);
    double bound = c->friction * c->normal;
    if (bound == 0) {
        scale(out, 0);
        return;
    }
    out->moment *= over_tanh(hypot(out->force[0], out->force[1]) / bound);
    for (int i = 0; i < 2; i++)
        out->force[i] *= over_tanh(out->force[i] / bound);
}

/* Polach 1999 (A fast wheel-rail forces calculation computer code). With y' = the greater in size of y and y + a spin,
 * s = |(x, y')|, and C = |(C11 x, C22 y)| / |(x, y)|:
 *
 *     e = pi G a b C s / (4 bound),  F = -bound (2/pi) (e / (1 + e^2) + atan e) (x, y) / s,
 *     d = (8/3) G b sqrt(a b) C23 |y'| / (bound k),  k = 1 + 6.3 (1 - exp(-a/b)),
 *     of spin: F_y = -(9/16) a bound k K spin / s,
 *
 * where his K of delta = (d^2 - 1)/(d^2 + 1) is 2/3 d / (1 + d^2)^2: put in and multiplied out.
 *
 * C of small creep depends only on the direction, so that the law as printed has no derivatives without creep. Within
 * n = KMP_POLACH_NEAR, C^2 is ((C11 x)^2 + (C22 y)^2 + (Cii n)^2) / (x^2 + y^2 + n^2) with C11 for F_x and C22 for F_y:
 * the derivatives without creep agree with the linear theory. */
static void polach(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    double x = c->slip[0], y = c->slip[1], turned = y + c->a * c->spin, bound = c->friction * c->normal;
    double reach = fmax(fabs(y), fabs(turned)), s = hypot(x, reach), near = KMP_POLACH_NEAR;
    *out = (kempe_creep_force){0};
    if (s == 0 || bound == 0)
        return;
    double g = c->shear_modulus * c->b / bound, weighted = hypot(k->c11 * x, k->c22 * y);
    double of_x = hypot(weighted, k->c11 * near), of_y = hypot(weighted, k->c22 * near);
    double slope = of_y / hypot(hypot(x, y), near);
    double e = 0.25 * pi * g * c->a * slope * s, along = bound * 2 / pi * (e / (1 + e * e) + atan(e)) / s;
    double far = 1 + 6.3 * -expm1(-c->a / c->b), d = 8.0 / 3 * g * sqrt(c->a * c->b) * k->c23 * reach / far;
    double spin = 9.0 / 16 * c->a * bound * far * (2.0 / 3) * d / ((1 + d * d) * (1 + d * d)) / s;
    out->force[0] = -along * x * of_x / of_y;
    out->force[1] = -along * y - spin * c->spin;
}

static void none(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    (void)c, (void)k;
    *out = (kempe_creep_force){0};
}

static void fastsim(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    double flexibility[3];
    fastsim_flexibilities(c, k, flexibility);
    fastsim_force(c, flexibility, out);
}

static void fastsim_of_one(const kempe_creep *c, const kempe_kalker *k, kempe_creep_force *out)
{
    double one = fastsim_flexibility(c, k);
    fastsim_force(c, (const double[]){one, one, one}, out);
}

static const struct {
    const char *name;
    void (*force)(const kempe_creep *, const kempe_kalker *, kempe_creep_force *);
} laws[] = {{"none", none},       {"linear", linear},          {"shen", shen}, {"polach", polach}, {"tanh", by_tanh},
            {"fastsim", fastsim}, {"fastsim1", fastsim_of_one}};

enum { LAWS = sizeof laws / sizeof *laws };

const char *kempe_contact_law_name(kempe_creep_law law)
{
    return (unsigned)law < LAWS ? laws[law].name : NULL;
}

kempe_status kempe_contact_creep(kempe_creep_law law, const kempe_creep *creep, kempe_creep_force *force)
{
    KMP_WANTED(NULL, creep, "creep");
    KMP_WANTED(NULL, force, "force");
    kempe_kalker coefficients;
    if ((unsigned)law >= LAWS || !is_creep(creep))
        return KEMPE_E_ARGUMENT;
    KMP_TRY(kempe_contact_kalker(creep->a / creep->b, creep->poisson, &coefficients));
    kempe_creep_force found = {0};
    laws[law].force(creep, &coefficients, &found);
    *force = found;
    return KEMPE_OK;
}

kempe_status kempe_contact_flexibilities(const kempe_creep *creep, double flexibility[3])
{
    KMP_WANTED(NULL, creep, "creep");
    KMP_WANTED(NULL, flexibility, "flexibility");
    kempe_kalker coefficients;
    if (!is_creep(creep) || kempe_contact_kalker(creep->a / creep->b, creep->poisson, &coefficients) != KEMPE_OK)
        return KEMPE_E_ARGUMENT;
    fastsim_flexibilities(creep, &coefficients, flexibility);
    return KEMPE_OK;
}

kempe_status kempe_contact_flexibility(const kempe_creep *creep, double *flexibility)
{
    KMP_WANTED(NULL, creep, "creep");
    KMP_WANTED(NULL, flexibility, "flexibility");
    kempe_kalker coefficients;
    if (!is_creep(creep) || kempe_contact_kalker(creep->a / creep->b, creep->poisson, &coefficients) != KEMPE_OK)
        return KEMPE_E_ARGUMENT;
    *flexibility = fastsim_flexibility(creep, &coefficients);
    return KEMPE_OK;
}

kempe_status kempe_contact_fastsim(const kempe_creep *creep, const double flexibility[3], kempe_creep_force *force)
{
    KMP_WANTED(NULL, creep, "creep");
    KMP_WANTED(NULL, flexibility, "flexibility");
    KMP_WANTED(NULL, force, "force");
    if (!is_creep(creep))
        return KEMPE_E_ARGUMENT;
    for (int k = 0; k < 3; k++)
        if (!isfinite(flexibility[k]) || flexibility[k] <= 0)
            return KEMPE_E_ARGUMENT;
    kempe_creep_force found = {0};
    fastsim_force(creep, flexibility, &found);
    *force = found;
    return KEMPE_OK;
}
