/* SPDX-License-Identifier: BSD-3-Clause */
/* The normal contact of two bodies, by Hertz, in strips, and as half-spaces, which may roll.
 *
 * Half-spaces: pressures p >= 0 with the sum N, for which deflection plus gap is the approach where p > 0 and not less
 * elsewhere: a convex problem (Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, chapter 4). It is
 * solved by conjugate gradients in which pressures are cut at zero and rectangles return where bodies would overlap
 * (Polonsky and Keer, A numerical method for solving rough contact problems, Wear 231 (1999) 206). The deflection by a
 * rectangle of constant pressure is Love's (Phil. Trans. A 228 (1929) 377): for both bodies
 *
 *     1/(pi E*) [x asinh(y/|x|) + y asinh(x/|y|)],  E* = G/(1 - poisson),
 *
 * taken between the corners. It depends only on the distance, so that there is one table of it.
 *
 * In each row the pressure is nearly a semi-ellipse, since its gap is a parabola. Half lengths therefore follow from
 * the load and the largest pressure of the row; counting rectangles would give steps. */
#include "rail/contact/half_space.h"
#include "base/bracket.h"
#include "base/context.h"
#include <float.h>
#include <math.h>
#include <string.h>

/* -- Hertz's ellipse ------------------------------------------------------------------------------------- */

/* Hertz 1882, after Johnson, Contact Mechanics, 1985, section 4.2, and Kalker 1990, appendix E. g is the lesser over
 * the greater semi-axis, B, D, E are the elliptic integrals of g, c = sqrt(a b), S = along + across:
 *
 *     lesser / greater curvature = g^2 D / B,  c^3 = 3 N E / (pi G* S sqrt(g)),  approach = c^2 S g K / (2 E). */

static const double pi = 3.14159265358979323846;

/* Arithmetic-geometric means (Abramowitz and Stegun 17.6): K = pi / (2 m), m the common limit of a and b from 1 and g.
 * D / K = (1 + sum 2^n c_n^2 / k^2)/2 over n >= 1, k^2 = 1 - g^2. The terms c_n^2 / k^2 follow each other without k, so
 * that the circle, g = 1, is not a special case. */
void kmp_elliptic(double g, double *B, double *D)
{
    double a = 1, b = g, c = 0, term = 0, sum = 1, weight = 1;
    do {
        double mean = 0.5 * (a + b);
        /* c_1^2 / k^2 = (1 - g) / (4 (1 + g)), and c_(n+1) = c_n^2 / (4 a_(n+1)) */
        term = weight == 1 ? 0.25 * (1 - g) / (1 + g) : term * c * c / (16 * mean * mean);
        c = 0.5 * (a - b);
        b = sqrt(a * b);
        a = mean;
        weight *= 2;
        sum += weight * term;
    } while (c > 1e-8 * a); /* the next one is below its square: quadratic */
    double K = 0.5 * pi / a;
    *D = 0.5 * K * sum;
    *B = K - *D;
}

/* The derivative d log(g^2 D / B) / d log g, from dB/dm = (D - B) / (2 m) and dD/dm = (B / g^2 - D) / (2 m). Here m = 1
 * - g^2. */
static double slope(double g, double B, double D)
{
    double m = 1 - g * g;
    if (m < 1e-5)
        return 1.5; /* the limit at a circle */
    return 2 - (B - g * g * D) / (m * D) + g * g * (D - B) / (m * B);
}

/* log g of the ellipse whose curvatures are in the ratio e^-t, t >= 0, by Newton's method. It starts from the
 * derivative 1.5 of a circle or, farther on, from the derivative of a line, 2. The function is concave between both:
 * the iterates approach from one side. */
static double axes_of(double t, double *B, double *D)
{
    double log_g = -t / (t < 2 ? 1.5 : 1.9);
    for (int k = 0; k < 40; k++) {
        double g = exp(log_g);
        kmp_elliptic(g, B, D);
        double miss = 2 * log_g + log(*D / *B) + t, step = -miss / slope(g, *B, *D);
        log_g = fmin(log_g + step, 0);
        if (fabs(step) <= 4e-16 * fmax(1, -log_g))
            break;
    }
    kmp_elliptic(exp(log_g), B, D);
    return log_g;
}

kmp_hertz kmp_hertz_of(double t)
{
    double B, D, log_g = axes_of(fabs(t), &B, &D), g = exp(log_g), E = B + g * g * D, K = B + D;
    double sum = 2 * cosh(0.5 * t);                     /* S / k */
    double cube = 3 * E / (pi * sum * sqrt(g));         /* c^3 G* k / N */
    double c = cbrt(cube), curvature = sum * g * K / E; /* approach = c^2 k bend / 2 */
    kmp_hertz h = {.ratio = t > 0 ? log_g : -log_g, .approach = 0.5 * c * c * curvature};
    h.axis = c * exp(0.5 * h.ratio);
    h.stiffness = 1 / (h.approach * sqrt(h.approach)); /* at N = G* / k^2: delta k = approach */
    return h;
}

kempe_status kempe_contact_hertz(const kempe_touch *touch, double normal, kempe_ellipse *ellipse)
{
    KMP_WANTED(NULL, touch, "touch");
    KMP_WANTED(NULL, ellipse, "ellipse");
    bool possible = isfinite(touch->along) && touch->along > 0 && isfinite(touch->across) && touch->across > 0 &&
                    isfinite(touch->shear_modulus) && touch->shear_modulus > 0 && touch->poisson >= 0 &&
                    touch->poisson <= 0.5 && isfinite(normal) && normal >= 0;
    if (!possible)
        return KEMPE_E_ARGUMENT;
    double t = log(touch->along / touch->across), k = sqrt(touch->along) * sqrt(touch->across);
    double modulus = touch->shear_modulus / (1 - touch->poisson), size = cbrt(normal / (modulus * k));
    kmp_hertz h = kmp_hertz_of(t);
    kempe_ellipse found = {.a = size * h.axis,
                           .b = size * kmp_hertz_of(-t).axis,
                           .approach = size * size * k * h.approach,
                           .stiffness = modulus / sqrt(k) * h.stiffness};
    if (normal > 0)
        found.pressure = 1.5 * normal / (pi * found.a * found.b);
    *ellipse = found;
    return KEMPE_OK;
}

/* -- strips ---------------------------------------------------------------------------------------------- */

/* With A and B, half of the relative curvatures in a strip along and across, and its gap g:
 *
 * ANALYN (Sichani, Enblom, Berg, A novel method to model wheel-rail normal contact in vehicle dynamics simulation,
 * Veh. Syst. Dyn. 52 (2014) 1752). For an approach d Hertz's ellipse of A and B has the semi-axes a, b. The strip is
 * pressed by d' = d - d/(B b^2) g where that is positive. Its half length is a sqrt(d'/d), and its largest pressure is
 * Hertz's for A, B and d'. Both d/(B b^2) and d/a^2 are independent of d. Hence the load of a strip is linear in d'.
 *
 * Kik and Piotrowski (A fast, approximate method to calculate normal load at contact between wheel and rail and creep
 * forces during rolling, 2nd mini-conference on contact mechanics, Budapest 1996): half lengths l = sqrt((0.55 d -
 * g)/A), the pressure p0/l0 sqrt(l^2 - x^2), l0 the half length at the point of first contact. At that distance
 * Boussinesq's deflection is d:
 *
 *     load = pi E* d I1/I3,   I1 = integral of sqrt(l^2 - x^2),   I3 = integral of sqrt(l^2 - x^2)/distance.
 *
 * In a strip at the distance e the integral over x of I3 is 2 l^2/r D(e/r), r^2 = l^2 + e^2, D the elliptic integral of
 * half_space.h; the mean over the middle strip, of width h, is 2 l log(8 l/h). */

/* Least curvature across over that along: a strip that is flatter, or hollow, is not Hertz's. It is 1e-4/mm for a wheel
 * of 0.46 m, as in CONTACT. */
#define LEAST_ACROSS 0.092

/* The part of the approach by which undeformed bodies overlap in the patch of Kik and Piotrowski. */
#define OVERLAP 0.55

/* The approach is found to this part of itself. */
#define RESOLVED 1e-12

/* ANALYN in a strip: d' = d - loss g, half length = half sqrt(d'), largest pressure = pressure sqrt(d'). */
typedef struct hertz_strip {
    double loss, half, pressure;
} hertz_strip;

typedef struct press {
    const kmp_strip_gap *gap;
    double modulus;
    hertz_strip *hertz; /* of each strip */
    kmp_strip *strip;
} press;

/* -- ANALYN ------------------------------------------------------------------------------------------ */

static hertz_strip hertz_of(const press *p, int k)
{
    double along = p->gap->along[k], across = fmax(p->gap->bend[k], LEAST_ACROSS * along), root = sqrt(along * across);
    kmp_hertz h = kmp_hertz_of(log(along / across));
    double other = kmp_hertz_of(log(across / along)).axis, flat = root * h.approach;
    return (hertz_strip){.loss = 2 * flat / (other * other * across),
                         .half = h.axis / sqrt(flat),
                         .pressure = 1.5 * p->modulus * root / (pi * h.axis * other * sqrt(flat))};
}

static double analyn(const press *p, double approach)
{
    for (int k = 0; k < p->gap->count; k++) {
        const hertz_strip *h = &p->hertz[k];
        double root = sqrt(fmax(approach - h->loss * p->gap->gap[k], 0)), half = root * h->half;
        double x = p->gap->centre[k], pressure = root * h->pressure;
        p->strip[k] =
            root > 0 ? (kmp_strip){x - half, x + half, pressure, pi / 2 * pressure * half} : (kmp_strip){.load = 0};
    }
    double sum = 0;
    for (int k = 0; k < p->gap->count; k++)
        sum += p->strip[k].load;
    return sum * p->gap->step;
}

/* -- Kik and Piotrowski ------------------------------------------------------------------------------ */

/* The integral of sqrt(l^2 - x^2)/distance over a strip `away` from the point. */
static double pull(double half, double away, double step)
{
    double B, D, far = hypot(half, away);
    if (fabs(away) < 0.5 * step)
        return 2 * half * fmax(log(8 * half / step), 0) * step;
    kmp_elliptic(fabs(away) / far, &B, &D);
    return 2 * half * half / far * D * step;
}

static double overlap(const press *p, double approach)
{
    const kmp_strip_gap *gap = p->gap;
    int point = 0;
    for (int k = 1; k < gap->count; k++)
        point = gap->gap[k] < gap->gap[point] ? k : point;
    double sum = 0, pulled = 0;
    for (int k = 0; k < gap->count; k++) {
        double deep = OVERLAP * approach - gap->gap[k], half = deep > 0 ? sqrt(2 * deep / gap->along[k]) : 0;
        double x = gap->centre[k];
        p->strip[k] = deep > 0 ? (kmp_strip){x - half, x + half, half, pi / 2 * half * half} : (kmp_strip){.load = 0};
        if (half > 0) {
            sum += p->strip[k].load * gap->step;
            pulled += pull(half, (k - point) * gap->step, gap->step);
        }
    }
    double scale = pulled > 0 ? pi * p->modulus * approach / pulled : 0; /* of pressures: p0/l0 */
    for (int k = 0; k < gap->count; k++) {
        p->strip[k].pressure *= scale;
        p->strip[k].load *= scale;
    }
    return scale * sum;
}

/* All of `pressed` but the approach, from the strips. Returns the sum of their loads, N. */
static double strips_sum(const kmp_strip_gap *gap, const kmp_strip *strip, kmp_normal_load_patch *pressed)
{
    double load = 0, moment = 0;
    pressed->area = pressed->pressure = 0;
    pressed->lobes = 0;
    for (int k = 0; k < gap->count; k++) {
        load += strip[k].load;
        moment += strip[k].load * (gap->first + k * gap->step);
        pressed->area += (strip[k].to - strip[k].from) * gap->step;
        pressed->pressure = fmax(pressed->pressure, strip[k].pressure);
        pressed->lobes += strip[k].load > 0 && (k == 0 || !(strip[k - 1].load > 0));
    }
    pressed->place = load > 0 ? moment / load : 0;
    return load * gap->step;
}

/* The approach at which strip k begins to touch. */
static double reaches(kmp_strip_method method, const press *p, int k)
{
    return method == KMP_STRIPS_KP ? p->gap->gap[k] / OVERLAP : p->gap->gap[k] * p->hertz[k].loss;
}

bool kmp_strips_press(kmp_strip_method method, const kmp_strip_gap *gap, double modulus, double normal,
                      kmp_arena *arena, kmp_strip *strip, kmp_normal_load_patch *pressed)
{
    double (*const load)(const press *, double) = method == KMP_STRIPS_KP ? overlap : analyn;
    const press p = {gap, modulus, KMP_ARENA_NEW(arena, hertz_strip, gap->count), strip};
    if (!p.hertz)
        return false;
    for (int k = 0; k < gap->count; k++)
        p.hertz[k] = hertz_of(&p, k);
    double high = fmin(reaches(method, &p, 0), reaches(method, &p, gap->count - 1)), x;
    double at_high = high > 0 ? load(&p, high) - normal : -normal;
    if (!(at_high > 0))
        return false;
    kmp_bracket b = kmp_bracket_of(0, -normal, high, at_high);
    while (kmp_bracket_next(&b, RESOLVED * b.far, &x)) {
        double f = load(&p, x) - normal;
        kmp_bracket_take(&b, x, f, f > 0);
    }
    load(&p, b.far);
    pressed->approach = b.far;
    strips_sum(gap, strip, pressed);
    return true;
}

/* The approach and the extent of the contact exceed the values of the approximation by less than these parts. */
#define DEEPER 1.6

/* Changes of the pressures below this part of their sum end the search: far below the error of the grid. */
#define SETTLED 1e-6
enum { MOST_ITERATIONS = 500 };

typedef struct grid {
    const kmp_strip_gap *gap;
    int rows, columns;
    double cell, normal; /* area of a rectangle; force */
    double *love;        /* deflection at a distance of rows (0..) and columns (-columns + 1..), 2 columns - 1 a row */
    double *free;        /* undeformed gap */
    double *p, *turn, *way, *deflection;
} grid;

/* -- the grid ---------------------------------------------------------------------------------------------- */

static double corner(double x, double y)
{
    return x * asinh(y / fabs(x)) + y * asinh(x / fabs(y));
}

static double love(double x, double y, double dx, double dy)
{
    return corner(x + 0.5 * dx, y + 0.5 * dy) - corner(x + 0.5 * dx, y - 0.5 * dy) -
           corner(x - 0.5 * dx, y + 0.5 * dy) + corner(x - 0.5 * dx, y - 0.5 * dy);
}

/* The range of x within which bodies may touch at an approach, and the longest strip there. */
static double range_of(const kmp_strip_gap *gap, double approach, double *low, double *high)
{
    double longest = 0;
    *low = INFINITY;
    *high = -INFINITY;
    for (int k = 0; k < gap->count; k++) {
        double deep = approach - gap->gap[k], half = deep > 0 ? sqrt(2 * deep / gap->along[k]) : 0;
        if (half > 0) {
            *low = fmin(*low, gap->centre[k] - half);
            *high = fmax(*high, gap->centre[k] + half);
            longest = fmax(longest, 2 * half);
        }
    }
    return longest;
}

static bool make_grid(grid *g, double modulus, kmp_arena *arena, kmp_half_space *s)
{
    size_t cells = (size_t)g->rows * (size_t)g->columns;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(double, cells, &g->free, &g->p, &g->turn, &g->way, &g->deflection),
                        KMP_ROOM(double, (size_t)g->rows *(size_t)(2 * g->columns - 1), &g->love)))
        return false;
    double step = g->gap->step;
    for (int j = 0; j < g->rows; j++)
        for (int i = 1 - g->columns; i < g->columns; i++)
            g->love[(ptrdiff_t)j * (2 * g->columns - 1) + i + g->columns - 1] =
                love(i * s->dx, j * step, s->dx, step) / (pi * modulus);
    for (int j = 0; j < g->rows; j++)
        for (int i = 0; i < g->columns; i++) {
            double x = s->first + i * s->dx - g->gap->centre[j];
            g->free[(ptrdiff_t)j * g->columns + i] = g->gap->gap[j] + 0.5 * g->gap->along[j] * x * x;
        }
    s->pressure = g->p;
    return true;
}

/* -- conjugate gradients ------------------------------------------------------------------------------- */

/* The deflections by pressures. */
static void deflect(const grid *g, const double *p, double *u)
{
    int n = g->columns;
    memset(u, 0, (size_t)g->rows * (size_t)n * sizeof *u);
    for (int from = 0; from < g->rows; from++)
        for (int k = 0; k < n; k++) {
            double pressed = p[(ptrdiff_t)from * n + k];
            for (int to = 0; pressed != 0 && to < g->rows; to++) {
                const double *row = g->love + (ptrdiff_t)(to > from ? to - from : from - to) * (2 * n - 1) + n - 1 - k;
                double *out = u + (ptrdiff_t)to * n;
                for (int i = 0; i < n; i++)
                    out[i] += pressed * row[i];
            }
        }
}

/* The mean of values over the rectangles in contact. */
static double mean_of(const grid *g, const double *value)
{
    double sum = 0;
    int count = 0;
    for (int k = 0; k < g->rows * g->columns; k++)
        if (g->p[k] > 0) {
            sum += value[k];
            count++;
        }
    return sum / count;
}

static double product(const grid *g, const double *a, const double *b)
{
    double sum = 0;
    for (int k = 0; k < g->rows * g->columns; k++)
        sum += g->p[k] > 0 ? a[k] * b[k] : 0;
    return sum;
}

/* Moves the pressures along `way`, cuts them at zero, and lets rectangles in where bodies overlap. Returns the change,
 * as a part of the sum; *joined: some came in. */
static double move(grid *g, double length, bool *joined)
{
    double sum = 0, changed = 0;
    int cells = g->rows * g->columns;
    double *before = g->deflection;
    *joined = false;
    memcpy(before, g->p, (size_t)cells * sizeof *before);
    for (int k = 0; k < cells; k++) {
        double p = g->p[k] > 0 ? fmax(g->p[k] - length * g->way[k], 0) : 0;
        if (!(p > 0) && g->turn[k] < 0) {
            p = -length * g->turn[k];
            *joined = true;
        }
        g->p[k] = p;
        sum += p;
    }
    for (int k = 0; k < cells; k++) {
        g->p[k] *= g->normal / (sum * g->cell);
        changed += fabs(g->p[k] - before[k]);
    }
    return changed * g->cell / g->normal;
}

/* Returns the approach; NaN: not converged. */
static double solve(grid *g, int *iterations)
{
    double last = 1, changed = 1, approach = NAN;
    bool joined = true;
    int cells = g->rows * g->columns;
    for (*iterations = 0; *iterations < MOST_ITERATIONS && changed > SETTLED; ++*iterations) {
        deflect(g, g->p, g->turn);
        for (int k = 0; k < cells; k++)
            g->turn[k] += g->free[k];
        approach = mean_of(g, g->turn);
        for (int k = 0; k < cells; k++)
            g->turn[k] -= approach;
        double now = product(g, g->turn, g->turn), keep = joined ? 0 : now / last;
        for (int k = 0; k < cells; k++)
            g->way[k] = g->p[k] > 0 ? g->turn[k] + keep * g->way[k] : 0;
        last = now;
        deflect(g, g->way, g->deflection);
        double mean = mean_of(g, g->deflection);
        for (int k = 0; k < cells; k++)
            g->deflection[k] -= mean;
        double slope = product(g, g->turn, g->way), bend = product(g, g->deflection, g->way);
        if (!(bend > 0))
            break; /* the residual is zero */
        changed = move(g, slope / bend, &joined);
    }
    return changed <= SETTLED || last == 0 ? approach : NAN;
}

static kmp_strip strip_of(const grid *g, const kmp_half_space *s, int j)
{
    double sum = 0, moment = 0, most = 0;
    for (int i = 0; i < g->columns; i++) {
        double p = g->p[(ptrdiff_t)j * g->columns + i];
        sum += p;
        moment += p * (s->first + i * s->dx);
        most = fmax(most, p);
    }
    if (!(sum > 0))
        return (kmp_strip){.load = 0};
    double half = 2 / pi * sum * s->dx / most, middle = moment / sum;
    return (kmp_strip){middle - half, middle + half, most, sum * s->dx};
}

kmp_half_space_result kmp_half_space_press(const kmp_strip_gap *gap, double modulus, double normal, int cells,
                                           kmp_arena *arena, kmp_strip *strip, kmp_normal_load_patch *pressed,
                                           kmp_half_space *s)
{
    double low, high, longest = range_of(gap, DEEPER * pressed->approach, &low, &high);
    *s = (kmp_half_space){.dx = longest / cells};
    s->columns = (int)ceil((high - low) / s->dx) + 1;
    s->first = low;
    grid g = {.gap = gap, .rows = gap->count, .columns = s->columns, .cell = s->dx * gap->step, .normal = normal};
    if (!make_grid(&g, modulus, arena, s))
        return KMP_HALF_SPACE_MEMORY;
    /* Semi-ellipses of the approximation, with the right sum. */
    double sum = 0;
    for (int j = 0; j < g.rows; j++)
        for (int i = 0; i < g.columns; i++) {
            double half = 0.5 * (strip[j].to - strip[j].from), x = s->first + i * s->dx - strip[j].from - half;
            double p = half > 0 ? strip[j].pressure * sqrt(fmax(1 - x * x / (half * half), 0)) : 0;
            g.p[(ptrdiff_t)j * g.columns + i] = p;
            sum += p;
        }
    for (int k = 0; k < g.rows * g.columns; k++)
        g.p[k] *= g.normal / (sum * g.cell);
    double approach = solve(&g, &s->iterations);
    if (isnan(approach))
        return KMP_HALF_SPACE_UNSOLVED;
    bool at_border = false;
    for (int i = 0; i < g.columns; i++)
        at_border = at_border || g.p[i] > 0 || g.p[(ptrdiff_t)(g.rows - 1) * g.columns + i] > 0;
    for (int j = 0; j < g.rows; j++)
        at_border = at_border || g.p[(ptrdiff_t)j * g.columns] > 0 || g.p[(ptrdiff_t)(j + 1) * g.columns - 1] > 0;
    if (at_border)
        return KMP_HALF_SPACE_LARGE;
    for (int j = 0; j < g.rows; j++)
        strip[j] = strip_of(&g, s, j);
    pressed->approach = approach;
    strips_sum(gap, strip, pressed);
    return KMP_HALF_SPACE_SOLVED;
}

/* -- steady rolling ----------------------------------------------------------------------------------- */

/* Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, chapters 2 to 4. While the bodies roll by the
 * width dx of a rectangle, a particle moves to the next one backwards. Its slip is
 *
 *     w dx + u(x) - u'(x + dx),   w = (slip_x - spin y, slip_y + spin x),
 *
 * u the tangential displacement of wheel minus rail, u' that before the step. Tractions p are at most friction times
 * the pressure, and opposite to the slip where they reach that: they minimise p A p / 2 + p (w dx - u'(x + dx)) for
 * u = A p. Steps are taken from no traction until it is steady. Each minimum is found by projected gradients with
 * extrapolation (Beck and Teboulle, SIAM J. Imaging Sciences 2 (2009) 183), which start again where that overshoots
 * (O'Donoghue and Candes, Found. Comput. Math. 15 (2015) 715).
 *
 * A of a rectangle of constant traction, both bodies together (Cerruti; Johnson, Contact Mechanics, 1985, section 3.6):
 * with the integrals I over the rectangle, r the distance,
 *
 *     xx: ((1 - poisson) I(1/r) + poisson I(x^2/r^3)) / (pi G),   xy: poisson I(x y/r^3) / (pi G),   yy likewise.
 *
 * The integrals of x^2/r^3, y^2/r^3, x y/r^3 are y asinh(x/|y|), x asinh(y/|x|), -r between the corners.
 * With equal materials tractions do not change the pressure. */

/* A minimum is found, and rolling is steady, if tractions change by less than these parts of their sum. */
#define MINIMAL 1e-4
#define STEADY  1e-3

/* The gradient's bound is estimated from below by the power method: this much is added. */
#define BEYOND 1.05
enum { POWERS = 15, MOST_STEPS = 60, MOST_PASSES = 6 };

typedef struct field {
    double *x, *y;
} field;

typedef struct roller {
    int rows, columns;
    double dx, dy;
    double *xx, *xy, *yy; /* A at distances of rows and columns, 2 columns - 1 a row, for rows >= 0 */
    int *first, *end;     /* of the rectangles in contact, in each row */
    double *bound;        /* of the tractions */
    field p, last, ahead, u, rigid, fixed;
} roller;

/* -- influence ----------------------------------------------------------------------------------------- */

typedef enum integral { XX, YY, XY } integral;

static double corner_of(integral kind, double x, double y)
{
    return kind == XX ? y * asinh(x / fabs(y)) : kind == YY ? x * asinh(y / fabs(x)) : -hypot(x, y);
}

static double over(integral kind, double x, double y, double dx, double dy)
{
    return corner_of(kind, x + 0.5 * dx, y + 0.5 * dy) - corner_of(kind, x + 0.5 * dx, y - 0.5 * dy) -
           corner_of(kind, x - 0.5 * dx, y + 0.5 * dy) + corner_of(kind, x - 0.5 * dx, y - 0.5 * dy);
}

/* Adds the displacements by the traction of one rectangle, in the contact and one rectangle ahead of it. */
static void displace_by(const roller *r, int row, int column, double px, double py, const field *u)
{
    int n = r->columns;
    for (int to = 0; to < r->rows; to++) {
        ptrdiff_t at = (ptrdiff_t)(to > row ? to - row : row - to) * (2 * n - 1) + n - 1 - column;
        const double *xx = r->xx + at, *xy = r->xy + at, *yy = r->yy + at;
        double *ux = u->x + (ptrdiff_t)to * n, *uy = u->y + (ptrdiff_t)to * n, odd = to < row ? -1 : 1;
        for (int i = r->first[to]; i < r->end[to] + (r->end[to] > r->first[to]); i++) {
            ux[i] += px * xx[i] + odd * py * xy[i];
            uy[i] += py * yy[i] + odd * px * xy[i];
        }
    }
}

static void displace(const roller *r, const field *p, const field *u)
{
    size_t bytes = (size_t)r->rows * (size_t)r->columns * sizeof(double);
    memset(u->x, 0, bytes);
    memset(u->y, 0, bytes);
    for (int j = 0; j < r->rows; j++)
        for (int i = r->first[j]; i < r->end[j]; i++) {
            ptrdiff_t k = (ptrdiff_t)j * r->columns + i;
            if (p->x[k] != 0 || p->y[k] != 0)
                displace_by(r, j, i, p->x[k], p->y[k], u);
        }
}

/* The greatest eigenvalue of A, by the power method. */
static double greatest(const roller *r, const field *v, const field *u)
{
    double size = 0;
    int cells = r->rows * r->columns;
    for (int k = 0; k < cells; k++)
        v->x[k] = v->y[k] = r->bound[k] > 0 ? 1 : 0;
    for (int power = 0; power < POWERS; power++) {
        double sum = 0;
        displace(r, v, u);
        for (int k = 0; k < cells; k++)
            sum += r->bound[k] > 0 ? u->x[k] * u->x[k] + u->y[k] * u->y[k] : 0;
        size = sqrt(sum);
        for (int k = 0; k < cells; k++) {
            v->x[k] = r->bound[k] > 0 ? u->x[k] / size : 0;
            v->y[k] = r->bound[k] > 0 ? u->y[k] / size : 0;
        }
    }
    return BEYOND * size;
}

/* -- a step ------------------------------------------------------------------------------------------------ */

/* One projected gradient from `ahead` to p; p before it is `last`. Returns the change as a part of the sum; *back: it
 * goes against the extrapolation. */
static double descend(const roller *r, double steepness, bool *back)
{
    double changed = 0, against = 0, sum = 0;
    displace(r, &r->ahead, &r->u);
    for (int k = 0; k < r->rows * r->columns; k++) {
        if (!(r->bound[k] > 0))
            continue;
        double x = r->ahead.x[k] - (r->u.x[k] + r->fixed.x[k]) / steepness;
        double y = r->ahead.y[k] - (r->u.y[k] + r->fixed.y[k]) / steepness;
        double size = hypot(x, y), part = size > r->bound[k] ? r->bound[k] / size : 1;
        r->last.x[k] = r->p.x[k];
        r->last.y[k] = r->p.y[k];
        r->p.x[k] = part * x;
        r->p.y[k] = part * y;
        double dx = r->p.x[k] - r->last.x[k], dy = r->p.y[k] - r->last.y[k];
        changed += hypot(dx, dy);
        sum += part * size;
        against += (r->ahead.x[k] - r->p.x[k]) * dx + (r->ahead.y[k] - r->p.y[k]) * dy;
    }
    *back = against > 0;
    return sum > 0 ? changed / sum : 0;
}

static void extrapolate(const roller *r, double part)
{
    for (int k = 0; k < r->rows * r->columns; k++) {
        r->ahead.x[k] = r->p.x[k] + part * (r->p.x[k] - r->last.x[k]);
        r->ahead.y[k] = r->p.y[k] + part * (r->p.y[k] - r->last.y[k]);
    }
}

/* The tractions after a step. */
static void minimise(const roller *r, double steepness)
{
    double weight = 1;
    extrapolate(r, 0);
    for (int k = 0; k < MOST_STEPS; k++) {
        bool back;
        double changed = descend(r, steepness, &back), next = back ? 1 : 0.5 * (1 + sqrt(1 + 4 * weight * weight));
        extrapolate(r, back ? 0 : (weight - 1) / next);
        weight = next;
        if (changed <= MINIMAL)
            return;
    }
}

/* Rolls by one rectangle. Returns the change of the tractions as a part of their sum. */
static double roll(const roller *r, double steepness, double *before)
{
    int cells = r->rows * r->columns;
    double changed = 0, sum = 0;
    displace(r, &r->p, &r->u);
    for (int k = 0; k < cells; k++) {
        before[2 * k] = r->p.x[k];
        before[2 * k + 1] = r->p.y[k];
        r->fixed.x[k] = r->bound[k] > 0 ? r->rigid.x[k] - r->u.x[k + 1] : 0;
        r->fixed.y[k] = r->bound[k] > 0 ? r->rigid.y[k] - r->u.y[k + 1] : 0;
    }
    minimise(r, steepness);
    for (int k = 0; k < cells; k++) {
        changed += hypot(r->p.x[k] - before[2 * k], r->p.y[k] - before[2 * k + 1]);
        sum += hypot(r->p.x[k], r->p.y[k]);
    }
    return sum > 0 ? changed / sum : 0;
}

static kempe_creep_force sum_of(const roller *r, const kmp_rolling *s, double x0, double y0)
{
    kempe_creep_force f = {{0, 0}, 0, 0};
    int slides = 0, touches = 0;
    for (int j = 0; j < r->rows; j++)
        for (int i = r->first[j]; i < r->end[j]; i++) {
            ptrdiff_t k = (ptrdiff_t)j * r->columns + i;
            double area = r->dx * r->dy, x = x0 + i * r->dx - s->origin[0], y = y0 + j * r->dy - s->origin[1];
            f.force[0] += area * r->p.x[k];
            f.force[1] += area * r->p.y[k];
            f.moment += area * (x * r->p.y[k] - y * r->p.x[k]);
            touches += r->bound[k] > 0;
            slides += r->bound[k] > 0 && hypot(r->p.x[k], r->p.y[k]) >= (1 - 16 * DBL_EPSILON) * r->bound[k];
        }
    f.sticking = touches > 0 ? 1 - (double)slides / touches : 0;
    return f;
}

kmp_half_space_result kmp_half_space_roll(const kmp_strip_gap *gap, const kmp_half_space *normal, const kmp_rolling *s,
                                          kmp_arena *arena, kempe_creep_force *force)
{
    roller r = {.rows = gap->count, .columns = normal->columns, .dx = normal->dx, .dy = gap->step};
    double *before;
    ptrdiff_t cells = (ptrdiff_t)r.rows * r.columns;
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(double, (ptrdiff_t)r.rows *(2 * r.columns - 1), &r.xx, &r.xy, &r.yy),
                        KMP_ROOM(int, r.rows, &r.first, &r.end),
                        KMP_ROOM(double, cells, &r.bound, &r.p.x, &r.p.y, &r.last.x, &r.last.y, &r.ahead.x, &r.ahead.y,
                                 &r.u.x, &r.u.y, &r.rigid.x, &r.rigid.y, &r.fixed.x, &r.fixed.y),
                        KMP_ROOM(double, 2 * cells, &before)))
        return KMP_HALF_SPACE_MEMORY;
    /* Bounds of the tractions, rigid slips of a step, and the ends of each row of cells in contact. */
    for (int j = 0; j < r.rows; j++)
        for (int i = 0; i < r.columns; i++) {
            ptrdiff_t k = (ptrdiff_t)j * r.columns + i;
            r.bound[k] = s->friction * normal->pressure[k];
            r.rigid.x[k] = r.dx * (s->slip[0] - s->spin * (gap->first + j * r.dy - s->origin[1]));
            r.rigid.y[k] = r.dx * (s->slip[1] + s->spin * (normal->first + i * r.dx - s->origin[0]));
            if (normal->pressure[k] > 0) {
                r.first[j] = r.end[j] ? r.first[j] : i;
                r.end[j] = i + 1;
            }
        }
    /* The displacements under a unit traction of one cell, by distance. */
    int width = 2 * r.columns - 1;
    double scale = 1 / (pi * s->shear_modulus);
    for (int j = 0; j < r.rows; j++)
        for (int i = 0; i < width; i++) {
            double x = (i - r.columns + 1) * r.dx, y = j * r.dy;
            double along = over(XX, x, y, r.dx, r.dy), across = over(YY, x, y, r.dx, r.dy);
            ptrdiff_t at = (ptrdiff_t)j * width + i;
            r.xx[at] = scale * (along + (1 - s->poisson) * across);
            r.yy[at] = scale * (across + (1 - s->poisson) * along);
            r.xy[at] = scale * s->poisson * over(XY, x, y, r.dx, r.dy);
        }
    double steepness = greatest(&r, &r.last, &r.u), changed = 1;
    for (int k = 0; changed > STEADY && k < MOST_PASSES * r.columns; k++)
        changed = roll(&r, steepness, before);
    if (changed > STEADY)
        return KMP_HALF_SPACE_UNSOLVED;
    *force = sum_of(&r, s, normal->first, gap->first);
    return KMP_HALF_SPACE_SOLVED;
}
