/* SPDX-License-Identifier: BSD-3-Clause */
/* A weighting is a chain of sections p(s)/d(s) of second degree. Each is a system of two states, advanced from sample
 * to sample by its matrix exponential together with the derivatives of the polynomial that its input is between the
 * samples (Van Loan 1978). */
#include "analyses/comfort/weighting.h"
#include "analyses/dense/exponential.h"
#include "base/memory.h"
#include <complex.h>
#include <math.h>
#include <string.h>

enum { ORDER = 2, POINTS = 4, SIZE = ORDER + POINTS, MOST_SECTIONS = 4 };

static const double two_pi = 6.283185307179586476925286766559, root_two = 1.4142135623730950488016887242097;

/* p[0] + p[1] s + p[2] s^2 over d[0] + d[1] s + s^2. */
typedef struct section {
    double p[ORDER + 1], d[ORDER];
} section;

typedef struct weighting_row {
    const char *name;
    double f1, f2, f3, f4, q2, k, f5, f6, q3, q4;
} weighting_row;

static const weighting_row rows[] = {
#define KMP_WEIGHTING(word, ...) {__VA_ARGS__},
#include "analyses/comfort/weightings.def"
#undef KMP_WEIGHTING
};

const char *kmp_weighting_name(kmp_weighting weighting)
{
    return rows[weighting].name;
}

static int sections_of(kmp_weighting weighting, section out[MOST_SECTIONS])
{
    const weighting_row *r = &rows[weighting];
    double w1 = two_pi * r->f1, w2 = two_pi * r->f2, w3 = two_pi * r->f3, w4 = two_pi * r->f4;
    double w5 = two_pi * r->f5, w6 = two_pi * r->f6;
    out[0] = (section){{0, 0, 1}, {w1 * w1, root_two * w1}};
    out[1] = (section){{w2 * w2, 0, 0}, {w2 * w2, root_two * w2}};
    out[2] = (section){{w4 * w4, w4 * w4 / w3, 0}, {w4 * w4, w4 / r->q2}};
    if (!(r->k > 0))
        return 3;
    double gain = r->k * w6 * w6;
    out[3] = (section){{gain, gain / (r->q3 * w5), gain / (w5 * w5)}, {w6 * w6, w6 / r->q4}};
    return 4;
}

/* -- filtering ---------------------------------------------------------------------------------------- */

/* x of the next sample = state x + input (the four samples), the input by the number of samples before the present
 * one. */
typedef struct stepping {
    double state[ORDER][ORDER], input[POINTS - 1][ORDER][POINTS];
} stepping;

/* With time in steps, z' = a z for z = (x, u, u', u'', u'''). */
static bool make_stepping(const section *s, double h, stepping *out)
{
    double a[SIZE * SIZE] = {0}, e[SIZE * SIZE], derivative[POINTS][POINTS];
    a[0 + 1 * SIZE] = 1;
    a[1 + 0 * SIZE] = -s->d[0] * h * h; /* the second state is a rate per step */
    a[1 + 1 * SIZE] = -s->d[1] * h;
    a[1 + 2 * SIZE] = h * h;
    for (int k = ORDER; k + 1 < SIZE; k++)
        a[k + (k + 1) * SIZE] = 1;
    if (kmp_exponential(SIZE, a, 1, e) != 0)
        return false;
    memset(out, 0, sizeof *out);
    for (int i = 0; i < ORDER; i++)
        for (int j = 0; j < ORDER; j++)
            out->state[i][j] = e[i + j * SIZE];
    for (int before = 0; before < POINTS - 1; before++) {
        /* derivative (POINTS x POINTS, row-major): derivatives 0, 1, .. at 0 of the polynomial through samples at
         * -before, 1 - before, .., as sums of these samples. */
        for (int j = 0; j < POINTS; j++) {
            double c[POINTS] = {1}, factorial = 1; /* Lagrange's polynomial of sample j */
            int degree = 0;
            for (int m = 0; m < POINTS; m++) {
                if (m == j)
                    continue;
                const double at = m - before, span = j - m;
                for (int k = ++degree; k >= 0; k--)
                    c[k] = ((k > 0 ? c[k - 1] : 0) - at * (k < degree ? c[k] : 0)) / span;
            }
            for (int k = 0; k < POINTS; k++) {
                derivative[k][j] = factorial * c[k];
                factorial *= k + 1;
            }
        }
        for (int i = 0; i < ORDER; i++)
            for (int j = 0; j < POINTS; j++)
                for (int k = 0; k < POINTS; k++)
                    out->input[before][i][j] += e[i + (ORDER + k) * SIZE] * derivative[k][j];
    }
    return true;
}

/* In controllable form: y = p0 x + p1 x' + p2 x'', x'' = u - d0 x - d1 x'. */
static void filter(const section *s, const stepping *step, double h, int count, const double *in, double *out)
{
    double x[ORDER] = {0}, next[ORDER], near[POINTS];
    for (int k = 0; k < count; k++) {
        int first = k < 1 ? 0 : k + POINTS - 1 > count ? count - POINTS : k - 1, before = k - first;
        if (before < POINTS - 1)
            memcpy(near, in + first, sizeof near);
        for (int i = 0; before < POINTS - 1 && i < ORDER; i++) {
            next[i] = step->state[i][0] * x[0] + step->state[i][1] * x[1];
            for (int j = 0; j < POINTS; j++)
                next[i] += step->input[before][i][j] * near[j];
        }
        double rate = x[1] / h;
        out[k] = s->p[0] * x[0] + s->p[1] * rate + s->p[2] * (in[k] - s->d[0] * x[0] - s->d[1] * rate);
        memcpy(x, next, sizeof x);
    }
}

bool kmp_weight(kmp_weighting weighting, double rate, int count, const double *in, double *out)
{
    section chain[MOST_SECTIONS];
    stepping step;
    int sections = sections_of(weighting, chain);
    double *room = KMP_NEW(double, count);
    bool good = room;
    memmove(out, in, (size_t)count * sizeof *out);
    for (int k = 0; good && k < sections; k++) {
        memcpy(room, out, (size_t)count * sizeof *room);
        good = make_stepping(&chain[k], 1 / rate, &step);
        if (good)
            filter(&chain[k], &step, 1 / rate, count, room, out);
    }
    kmp_free(room);
    return good;
}

/* -- numbers of a signal ------------------------------------------------------------------------------ */

double kmp_root_mean_square(int steps, const double *x)
{
    double sum = (x[0] * x[0] + x[steps] * x[steps]) / 2;
    for (int k = 1; k < steps; k++)
        sum += x[k] * x[k];
    return sqrt(sum / steps);
}

/* Sperling's factor at a frequency, Hz: B = c sqrt((1.911 f^2 + (.25 f^2)^2) / ((1 - .277 f^2)^2 + (1.563 f - .0368
 * f^3)^2)), c = .588 of vertical, .737 of lateral accelerations. */
static double sperling_factor(bool vertical, double f)
{
    double f2 = f * f, quarter = 0.25 * f2, real = 1 - 0.277 * f2, imaginary = f * (1.563 - 0.0368 * f2);
    return (vertical ? 0.588 : 0.737) * sqrt((1.911 * f2 + quarter * quarter) / (real * real + imaginary * imaginary));
}

/* Twice the square of the modulus of a component of Fourier, the mean square at its frequency. */
static double component(int count, const double *x, int turns)
{
    double complex sum = 0, at = 1, turn = cexp(-I * two_pi * turns / count);
    for (int k = 0; k < count; k++) {
        if (k % 256 == 0) /* rounding of the product would grow */
            at = cexp(-I * two_pi * (double)((long)turns * k % count) / count);
        sum += x[k] * at;
        at *= turn;
    }
    double modulus = cabs(sum) / count;
    return 2 * modulus * modulus;
}

double kmp_sperling(bool vertical, double rate, int count, const double *x)
{
    int section_size = count < 10 * rate ? count : (int)(10 * rate), sections = count / section_size;
    double sum = 0, span = section_size / rate;
    for (int turns = (int)ceil(0.5 * span - 1e-9); turns <= (int)(30 * span + 1e-9) && 2 * turns < section_size;
         turns++) {
        double factor = 100 * sperling_factor(vertical, turns / span);
        for (int s = 0; s < sections; s++)
            sum += factor * factor * component(section_size, x + (long)s * section_size, turns) / sections;
    }
    return pow(sum, 1 / 6.67);
}
