/* SPDX-License-Identifier: BSD-3-Clause */
/* The low-pass filter of irregular samples against its transfer function and its step response. */
#include "rail/low_pass.h"
#include "testing.h"
#include <complex.h>
#include <stdlib.h>

enum { SAMPLES = 40001 };
static const double pi = 3.14159265358979323846, cutoff = 20;

/* Times at distances that differ by up to ten times. */
static void spread(int count, double to, double *t)
{
    double sum = 0;
    for (int k = 0; k < count; k++) {
        t[k] = sum;
        sum += 0.1 + 0.9 * fabs(sin(1.7 * k));
    }
    for (int k = 0; k < count; k++)
        t[k] *= to / t[count - 1];
}

/* The transfer function by its polynomials of second degree, in s over the cutoff. */
static double complex transfer(double frequency)
{
    const double complex s = I * frequency / cutoff;
    return 1 / ((s * s + 2 * sin(pi / 8) * s + 1) * (s * s + 2 * cos(pi / 8) * s + 1));
}

/* Two signals together: sines, after their start has decayed. */
static void sines(void)
{
    static const double frequencies[] = {1, 20, 60};
    double *t = calloc(SAMPLES, sizeof *t), *in = calloc(2 * SAMPLES, sizeof *in),
           *out = calloc(2 * SAMPLES, sizeof *out);
    spread(SAMPLES, 2, t);
    for (int f = 0; f < 3; f++) {
        const double w = 2 * pi * frequencies[f];
        const double complex gain = transfer(frequencies[f]);
        for (int k = 0; k < SAMPLES; k++) {
            in[k] = 5 + cos(w * t[k]);
            in[SAMPLES + k] = 3 * sin(w * t[k]);
        }
        CHECK(kmp_low_pass(cutoff, SAMPLES, 1, t, 2, in, out));
        for (int k = SAMPLES / 2; k < SAMPLES; k += 97) {
            const double complex turned = gain * cexp(I * w * t[k]);
            CHECK_NEAR(out[k], 5 + creal(turned), 2e-6);
            CHECK_NEAR(out[SAMPLES + k], 3 * cimag(turned), 6e-6);
        }
    }
    CHECK_NEAR(cabs(transfer(cutoff)), sqrt(0.5), 1e-12);
    free(t);
    free(in);
    free(out);
}

/* A ramp is followed exactly from any samples: the same values from all samples and from every other one. */
static void ramp(void)
{
    double t[41], in[41], all[41], other[41];
    spread(41, 0.8, t);
    for (int k = 0; k < 41; k++)
        in[k] = 7 - 30 * t[k];
    CHECK(kmp_low_pass(cutoff, 41, 1, t, 1, in, all));
    CHECK(kmp_low_pass(cutoff, 41, 2, t, 1, in, other));
    CHECK(all[0] == 7);
    for (int k = 0; k < 41; k += 2)
        CHECK_NEAR(all[k], other[k], 1e-12);
    CHECK_NEAR(all[40], 7 - 30 * (0.8 - 2 * (sin(pi / 8) + cos(pi / 8)) / (2 * pi * cutoff)), 1e-12);
}

/* Samples at one time: a jump. */
static void jump(void)
{
    const double t[] = {0, 0.1, 0.1, 1}, in[] = {0, 0, 1, 1};
    double out[4];
    CHECK(kmp_low_pass(cutoff, 4, 1, t, 1, in, out));
    CHECK_NEAR(out[2], 0, 1e-12);
    CHECK_NEAR(out[3], 1, 1e-12);
}

int main(void)
{
    TEST(sines);
    TEST(ramp);
    TEST(jump);
    return check_report();
}
