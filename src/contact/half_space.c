/* SPDX-License-Identifier: BSD-3-Clause */
/* Pressures p >= 0 with the sum N, for which deflection plus gap is the approach where p > 0 and not less elsewhere: a
 * convex problem (Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, chapter 4). It is solved by
 * conjugate gradients in which pressures are cut at zero and rectangles return where bodies would overlap (Polonsky
 * and Keer, A numerical method for solving rough contact problems, Wear 231 (1999) 206). The deflection by a rectangle
 * of constant pressure is Love's (Phil. Trans. A 228 (1929) 377): for both bodies
 *
 *     1/(pi E*) [x asinh(y/|x|) + y asinh(x/|y|)],  E* = G/(1 - poisson),
 *
 * taken between the corners. It depends on the distance alone, so that there is one table of it.
 *
 * In each row the pressure is nearly a semi-ellipse, since its gap is a parabola. Half lengths therefore follow from
 * the load and the largest pressure of the row; counting rectangles would give steps. */
#include "contact/half_space.h"
#include "contact/strips.h"
#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* The approach and the extent of the contact exceed those of the approximation by less than these parts. */
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

/* -- in and out ---------------------------------------------------------------------------------------- */

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

static bool reaches_border(const grid *g)
{
    bool any = false;
    for (int i = 0; i < g->columns; i++)
        any = any || g->p[i] > 0 || g->p[(ptrdiff_t)(g->rows - 1) * g->columns + i] > 0;
    for (int j = 0; j < g->rows; j++)
        any = any || g->p[(ptrdiff_t)j * g->columns] > 0 || g->p[(ptrdiff_t)(j + 1) * g->columns - 1] > 0;
    return any;
}

kmp_half_space_result kmp_half_space_press(const kmp_strip_gap *gap, double modulus, double normal, int cells,
                                           kmp_arena *arena, kmp_strip *strip, kmp_pressed_patch *pressed,
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
    if (reaches_border(&g))
        return KMP_HALF_SPACE_LARGE;
    for (int j = 0; j < g.rows; j++)
        strip[j] = strip_of(&g, s, j);
    pressed->approach = approach;
    kmp_strips_sum(gap, strip, pressed);
    return KMP_HALF_SPACE_SOLVED;
}
