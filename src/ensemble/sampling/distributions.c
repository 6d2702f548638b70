/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/sampling/distributions.h"
#include <float.h>
#include <math.h>
#include <stddef.h>

double kmp_normal_share(double z)
{
    return 0.5 * erfc(-z * 0.70710678118654752440);
}

/* Halley's iteration on the share of the nearer tail, from a fit of 4e-4 (Abramowitz, Stegun, 26.2.23). */
double kmp_normal_quantile(double part)
{
    double tail = part < 0.5 ? part : 1 - part, r = sqrt(-2 * log(tail));
    double z = r - (2.515517 + r * (0.802853 + r * 0.010328)) / (1 + r * (1.432788 + r * (0.189269 + r * 0.001308)));
    for (int k = 0; k < 3; k++) {
        double density = 0.39894228040143267794 * exp(-0.5 * z * z);
        double step = (kmp_normal_share(-z) - tail) / density;
        z += step / (1 - 0.5 * z * step);
    }
    return part < 0.5 ? -z : z;
}

static double normal(const kmp_distribution *d, double part)
{
    double below = kmp_normal_share((d->least - d->centre) / d->width);
    double above = kmp_normal_share((d->centre - d->most) / d->width);
    double z = kmp_normal_quantile(below + part * (1 - below - above));
    return fmin(fmax(d->centre + d->width * z, d->least), d->most);
}

static double triangular(const kmp_distribution *d, double part)
{
    double size = d->most - d->least, rise = d->centre - d->least;
    return part * size < rise ? d->least + sqrt(part * size * rise)
                              : d->most - sqrt((1 - part) * size * (d->most - d->centre));
}

double kmp_distribution_quantile(const kmp_distribution *d, double part)
{
    switch (d->kind) {
    case KMP_NORMAL:
        return normal(d, part);
    case KMP_TRIANGULAR:
        return triangular(d, part);
    case KMP_UNIFORM:
        break;
    }
    return d->least + part * (d->most - d->least);
}

/* -- ISO 286-1 --------------------------------------------------------------------------------------- */

/* Standard tolerances in micrometres of IT5 to IT18, up to and including a size in mm (ISO 286-1:2010, table 1). */
static const struct {
    double size;
    int tolerance[KMP_GRADE_MOST - KMP_GRADE_LEAST + 1];
} grades[] = {
    {3, {4, 6, 10, 14, 25, 40, 60, 100, 140, 250, 400, 600, 1000, 1400}},
    {6, {5, 8, 12, 18, 30, 48, 75, 120, 180, 300, 480, 750, 1200, 1800}},
    {10, {6, 9, 15, 22, 36, 58, 90, 150, 220, 360, 580, 900, 1500, 2200}},
    {18, {8, 11, 18, 27, 43, 70, 110, 180, 270, 430, 700, 1100, 1800, 2700}},
    {30, {9, 13, 21, 33, 52, 84, 130, 210, 330, 520, 840, 1300, 2100, 3300}},
    {50, {11, 16, 25, 39, 62, 100, 160, 250, 390, 620, 1000, 1600, 2500, 3900}},
    {80, {13, 19, 30, 46, 74, 120, 190, 300, 460, 740, 1200, 1900, 3000, 4600}},
    {120, {15, 22, 35, 54, 87, 140, 220, 350, 540, 870, 1400, 2200, 3500, 5400}},
    {180, {18, 25, 40, 63, 100, 160, 250, 400, 630, 1000, 1600, 2500, 4000, 6300}},
    {250, {20, 29, 46, 72, 115, 185, 290, 460, 720, 1150, 1850, 2900, 4600, 7200}},
    {315, {23, 32, 52, 81, 130, 210, 320, 520, 810, 1300, 2100, 3200, 5200, 8100}},
    {400, {25, 36, 57, 89, 140, 230, 360, 570, 890, 1400, 2300, 3600, 5700, 8900}},
    {500, {27, 40, 63, 97, 155, 250, 400, 630, 970, 1550, 2500, 4000, 6300, 9700}},
    {630, {32, 44, 70, 110, 175, 280, 440, 700, 1100, 1750, 2800, 4400, 7000, 11000}},
    {800, {36, 50, 80, 125, 200, 320, 500, 800, 1250, 2000, 3200, 5000, 8000, 12500}},
    {1000, {40, 56, 90, 140, 230, 360, 560, 900, 1400, 2300, 3600, 5600, 9000, 14000}},
    {1250, {47, 66, 105, 165, 260, 420, 660, 1050, 1650, 2600, 4200, 6600, 10500, 16500}},
    {1600, {55, 78, 125, 195, 310, 500, 780, 1250, 1950, 3100, 5000, 7800, 12500, 19500}},
    {2000, {65, 92, 150, 230, 370, 600, 920, 1500, 2300, 3700, 6000, 9200, 15000, 23000}},
    {2500, {78, 110, 175, 280, 440, 700, 1100, 1750, 2800, 4400, 7000, 11000, 17500, 28000}},
    {3150, {96, 135, 210, 330, 540, 860, 1350, 2100, 3300, 5400, 8600, 13500, 21000, 33000}},
};

double kmp_tolerance_grade(int grade, double size)
{
    for (size_t k = 0; size > 0 && k < sizeof grades / sizeof *grades; k++)
        if (size * 1e3 <= grades[k].size * (1 + 4 * DBL_EPSILON))
            return grades[k].tolerance[grade - KMP_GRADE_LEAST] * 1e-6;
    return 0;
}
