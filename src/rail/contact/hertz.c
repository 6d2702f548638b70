/* SPDX-License-Identifier: BSD-3-Clause */
/* Hertz 1882, after Johnson, Contact Mechanics, 1985, section 4.2, and Kalker 1990, appendix E. g is the lesser over
 * the greater semi-axis, B, D, E are the elliptic integrals of g, c = sqrt(a b), S = along + across:
 *
 *     lesser / greater curvature = g^2 D / B,  c^3 = 3 N E / (pi G* S sqrt(g)),  approach = c^2 S g K / (2 E). */
#include "rail/contact/hertz.h"
#include "base/context.h"
#include <kempe/rolling_contact.h>
#include <math.h>

static const double pi = 3.14159265358979323846;

/* Arithmetic-geometric means (Abramowitz and Stegun 17.6): K = pi / (2 m), m the common limit of a and b from 1 and g.
 * D / K = (1 + sum 2^n c_n^2 / k^2)/2 over n >= 1, k^2 = 1 - g^2. The terms c_n^2 / k^2 follow each other without k, so
 * that the circle, g = 1, is no special case. */
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
 * derivative 1.5 of a circle or, farther on, from that of a line, 2. The function is concave between both: the iterates
 * approach from one side. */
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

static int is_touch(const kempe_touch *touch)
{
    return isfinite(touch->along) && touch->along > 0 && isfinite(touch->across) && touch->across > 0 &&
           isfinite(touch->shear_modulus) && touch->shear_modulus > 0 && touch->poisson >= 0 && touch->poisson <= 0.5;
}

kempe_status kempe_contact_hertz(const kempe_touch *touch, double normal, kempe_ellipse *ellipse)
{
    KMP_WANTED(NULL, touch, "touch");
    KMP_WANTED(NULL, ellipse, "ellipse");
    if (!is_touch(touch) || !isfinite(normal) || normal < 0)
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
