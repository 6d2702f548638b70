/* SPDX-License-Identifier: BSD-3-Clause */
/* Vectors of implicit integrators: every operation of ours against plain loops, at lengths around those of lanes, on
 * clones, and where the result takes the place of an operand. */
#include "integrators/sundials/sundials_host.h"
#include "testing.h"

#include <stdbool.h>

enum { VECTORS = 20, LONGEST = 100 };

static SUNContext sun;
static N_Vector x[VECTORS], z;
static double was[VECTORS][LONGEST], factor[VECTORS];

static double number(int k, int i)
{
    return sin(1 + 17 * k + 3.7 * i) * exp(cos(5 * k + i));
}

static void fill(int n)
{
    for (int k = 0; k < VECTORS; k++) {
        factor[k] = number(k, -1);
        for (int i = 0; i < n; i++)
            kmp_sun_data(x[k])[i] = was[k][i] = number(k, i);
    }
}

static void make(int n)
{
    x[0] = kmp_vector_new(n, sun);
    for (int k = 1; k < VECTORS; k++)
        x[k] = N_VClone(x[k - 1]);
    z = N_VClone(x[0]);
    fill(n);
}

static void unmake(void)
{
    for (int k = 0; k < VECTORS; k++)
        N_VDestroy(x[k]);
    N_VDestroy(z);
}

static bool is(N_Vector v, int i, double expected)
{
    double got = kmp_sun_data(v)[i];
    return memcmp(&got, &expected, sizeof got) == 0;
}

static void sums_and_multiples(void)
{
    for (int n = 1; n <= LONGEST; n = n < 40 ? n + 1 : n + 60) {
        make(n);
        N_VConst(0.25, z);
        CHECK(is(z, 0, 0.25) && is(z, n - 1, 0.25));
        N_VLinearSum(factor[0], x[0], factor[1], x[1], z);
        N_VLinearSum(factor[2], x[2], 1, x[3], x[3]);
        N_VScale(factor[4], x[4], x[4]);
        N_VScale(1, x[5], x[6]);
        N_VScale(1, x[7], x[7]);
        for (int i = 0; i < n; i++) {
            CHECK(is(z, i, factor[0] * was[0][i] + factor[1] * was[1][i]));
            CHECK(is(x[3], i, factor[2] * was[2][i] + was[3][i]));
            CHECK(is(x[4], i, factor[4] * was[4][i]));
            CHECK(is(x[6], i, was[5][i]) && is(x[7], i, was[7][i]));
        }
        fill(n);
        CHECK(N_VLinearSumVectorArray(3, 2, x, -1, x + 3, x + 6) == 0);
        CHECK(N_VScaleVectorArray(3, factor, x + 9, x + 9) == 0);
        for (int i = 0; i < n; i++)
            for (int k = 0; k < 3; k++) {
                CHECK(is(x[6 + k], i, 2 * was[k][i] - was[3 + k][i]));
                CHECK(is(x[9 + k], i, factor[k] * was[9 + k][i]));
            }
        unmake();
    }
}

/* More than are taken at once, too; the result may be the first of them. */
static void combinations(void)
{
    for (int n = 1; n <= 33; n++) {
        make(n);
        for (int count = 1; count <= VECTORS; count++)
            for (int in_place = 0; in_place < 2; in_place++) {
                N_Vector to = in_place ? x[0] : z;
                fill(n);
                CHECK(N_VLinearCombination(count, factor, x, to) == 0);
                for (int i = 0; i < n; i++) {
                    double sum = factor[0] * was[0][i];
                    for (int k = 1; k < count; k++)
                        sum += factor[k] * was[k][i];
                    CHECK(is(to, i, sum));
                }
            }
        unmake();
    }
}

/* Weighted norm of x[0] with the weights x[1], where the mask (NULL: everywhere) is positive: in eight parts, whatever
 * the processor takes at once; and, in `plain`, one after the other. */
static double norm_of(int n, const double *mask, double *plain)
{
    double part[8] = {0}, sum = 0;
    for (int i = 0; i < n; i++) {
        double product = mask && !(mask[i] > 0) ? 0 : was[0][i] * was[1][i];
        part[i % 8] += product * product;
        sum += product * product;
    }
    *plain = sqrt(sum / n);
    return sqrt((((part[0] + part[4]) + (part[2] + part[6])) + ((part[1] + part[5]) + (part[3] + part[7]))) / n);
}

static void norms(void)
{
    for (int n = 1; n <= LONGEST; n++) {
        double plain, expected, got;
        make(n);
        expected = norm_of(n, NULL, &plain);
        got = N_VWrmsNorm(x[0], x[1]);
        CHECK(memcmp(&got, &expected, sizeof got) == 0);
        CHECK_NEAR(got / plain, 1, 1e-14);
        kmp_sun_data(x[2])[0] = was[2][0] = 1;
        expected = norm_of(n, was[2], &plain);
        got = N_VWrmsNormMask(x[0], x[1], x[2]);
        CHECK(memcmp(&got, &expected, sizeof got) == 0);
        CHECK_NEAR(got / plain, 1, 1e-14);
        unmake();
    }
}

int main(void)
{
    sun = kmp_sun_context();
    TEST(sums_and_multiples);
    TEST(combinations);
    TEST(norms);
    SUNContext_Free(&sun);
    return check_report();
}
