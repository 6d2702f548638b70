/* SPDX-License-Identifier: BSD-3-Clause */
/* Chebyshev interpolation in the points of the extremes of T_8 (Trefethen, Approximation Theory and Approximation
 * Practice, 2013, chapters 3, 4 and 19). */
#include "output/quantities/smooth_piece.h"
#include "base/bracket.h"
#include "base/clones.h"
#include <float.h>
#include <math.h>

enum {
    DEGREE = KMP_PIECE_POINTS - 1,
    SCANS = 4 * DEGREE, /* intervals in which the derivative is searched for zeros: closer pairs are not extremes */
    ROUGH = 4,          /* degree of rough bounds */
    ROUGH_MARGIN = 8    /* terms of a kink fall with the square of their number, and sum up to twice the last one */
};

/* cos(pi / 8), cos(pi / 4), cos(3 pi / 8) */
#define P1 0.9238795325112867561281831893967883
#define P2 0.7071067811865475244008443621048490
#define P3 0.3826834323650897717284599840303989

/* cos(j k pi / 8), j, k = 0 .. 8 */
static const double cosine[KMP_PIECE_POINTS][KMP_PIECE_POINTS] = {
    {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0},    {1.0, P1, P2, P3, 0.0, -P3, -P2, -P1, -1.0},
    {1.0, P2, 0.0, -P2, -1.0, -P2, 0.0, P2, 1.0},     {1.0, P3, -P2, -P1, 0.0, P1, P2, -P3, -1.0},
    {1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0},  {1.0, -P3, -P2, P1, 0.0, -P1, P2, P3, -1.0},
    {1.0, -P2, 0.0, P2, -1.0, P2, 0.0, -P2, 1.0},     {1.0, -P1, P2, -P3, 0.0, P3, -P2, P1, -1.0},
    {1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0}};

double kmp_piece_point(int k)
{
    return cosine[1][DEGREE - k];
}

/* Coefficients of the polynomial through values at every `stride`-th point. */
static KMP_INTO_CLONES void coefficients_of(int degree, int stride, const double *values, double *c)
{
    for (int k = 0; k <= degree; k++)
        c[k] = 0;
    for (int j = 0; j <= degree; j++) {
        double value = (j == 0 || j == degree ? 0.5 : 1) * values[DEGREE - j * stride];
        for (int k = 0; k <= degree; k++)
            c[k] += value * cosine[j * stride][k];
    }
    for (int k = 0; k <= degree; k++)
        c[k] *= (k == 0 || k == degree ? 1.0 : 2.0) / degree;
}

KMP_CLONES static void all_coefficients(const double *values, double *c)
{
    coefficients_of(DEGREE, 1, values, c);
}

KMP_CLONES static void rough_coefficients(const double *values, double *c)
{
    coefficients_of(ROUGH, DEGREE / ROUGH, values, c);
}

kmp_smooth_piece kmp_piece_of(double from, double to, const double values[KMP_PIECE_POINTS])
{
    kmp_smooth_piece piece = {.from = from, .to = to, .first = values[0], .last = values[DEGREE]};
    all_coefficients(values, piece.c);
    return piece;
}

void kmp_piece_rough_bounds(const double values[KMP_PIECE_POINTS], double *low, double *high)
{
    double c[ROUGH + 1], reach = 0;
    rough_coefficients(values, c);
    for (int k = 1; k <= ROUGH; k++)
        reach += fabs(c[k]);
    reach += ROUGH_MARGIN * (fabs(c[ROUGH - 1]) + fabs(c[ROUGH])) + 4 * DBL_EPSILON * fabs(c[0]);
    *low = c[0] - reach;
    *high = c[0] + reach;
}

/* Terms of a smooth function fall geometrically: the one before the last counts by a part. */
double kmp_piece_error(const kmp_smooth_piece *piece)
{
    return fmax(fabs(piece->c[DEGREE]), fabs(piece->c[DEGREE - 1]) / 8);
}

double kmp_piece_integral(const kmp_smooth_piece *piece)
{
    double sum = 0;
    for (int k = 0; k <= DEGREE; k += 2)
        sum += 2 * piece->c[k] / (1.0 - k * k);
    return 0.5 * (piece->to - piece->from) * sum;
}

/* Clenshaw's sum of `count` terms. */
static double sum_of(int count, const double *c, double x)
{
    double b1 = 0, b2 = 0;
    for (int k = count; k-- > 1;) {
        double b = c[k] + 2 * x * b1 - b2;
        b2 = b1;
        b1 = b;
    }
    return c[0] + x * b1 - b2;
}

double kmp_piece_value(const kmp_smooth_piece *piece, double x)
{
    if (x <= -1 || x >= 1)
        return x < 0 ? piece->first : piece->last;
    return sum_of(KMP_PIECE_POINTS, piece->c, x);
}

double kmp_piece_time(const kmp_smooth_piece *piece, double x)
{
    if (x <= -1 || x >= 1)
        return x < 0 ? piece->from : piece->to;
    return piece->from + 0.5 * (1 + x) * (piece->to - piece->from);
}

void kmp_piece_extremes(const kmp_smooth_piece *piece, double *low, double *high)
{
    double reach = 0;
    for (int k = 1; k <= DEGREE; k++)
        reach += fabs(piece->c[k]);
    reach += 4 * DBL_EPSILON * fabs(piece->c[0]);
    *low = piece->c[0] - reach;
    *high = piece->c[0] + reach;
}

/* Zero of a sum of terms between two abscissae with values of different signs. */
static double zero_of(int count, const double *c, double low, double f_low, double high, double f_high)
{
    kmp_bracket bracket = kmp_bracket_of(low, f_low, high, f_high);
    double x;
    while (kmp_bracket_next(&bracket, 4 * DBL_EPSILON, &x)) {
        double f = sum_of(count, c, x);
        kmp_bracket_take(&bracket, x, f, (f < 0) != (f_low < 0));
    }
    return 0.5 * (bracket.near + bracket.far);
}

int kmp_piece_turns(const kmp_smooth_piece *piece, double x[KMP_PIECE_POINTS])
{
    double slope[DEGREE + 2] = {0}; /* c'_{k-1} = c'_{k+1} + 2 k c_k */
    int count = 0;
    for (int k = DEGREE; k > 0; k--)
        slope[k - 1] = slope[k + 1] + 2 * k * piece->c[k];
    slope[0] /= 2;
    x[count++] = -1;
    double before = sum_of(DEGREE, slope, -1), at = -1;
    for (int k = 1; k <= SCANS && count < DEGREE; k++) {
        double next = k == SCANS ? 1 : -1 + 2.0 * k / SCANS, f = sum_of(DEGREE, slope, next);
        if ((f < 0) != (before < 0) && f != 0 && before != 0)
            x[count++] = zero_of(DEGREE, slope, at, before, next, f);
        else if (f == 0 && k < SCANS && before != 0)
            x[count++] = next;
        before = f;
        at = next;
    }
    x[count++] = 1;
    return count;
}

double kmp_piece_zero(const kmp_smooth_piece *piece, double low, double high)
{
    double f_low = kmp_piece_value(piece, low), f_high = kmp_piece_value(piece, high);
    return zero_of(KMP_PIECE_POINTS, piece->c, low, f_low, high, f_high);
}
