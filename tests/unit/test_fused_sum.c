/* SPDX-License-Identifier: BSD-3-Clause */
/* fma() of src/platform/rounded_once.c against sums of whole numbers of 126 bits, which the compiler rounds once. On
 * Linux the linker sends calls to it (tests/CMakeLists.txt). */
#include "random.h"
#include "testing.h"
#include <math.h>

__extension__ typedef __int128 wide;

static double (*volatile fused)(double, double, double) = fma;

/* A whole number of at most that many bits, of either sign. */
static double whole(int bits)
{
    return nearbyint(between(-1, 1) * ldexp(1, bits));
}

/* `count` sums x y 2^up + z 2^over, times 2^scale; how many are not those of whole numbers. */
static int wrong_sums(int count, int scale)
{
    int wrong = 0;
    for (int k = 0; k < count; k++) {
        const int up = pick(2) ? pick(20) : 0, bits = 53 - pick(2) * pick(33), over = up > 0 ? 0 : pick(72);
        const double x = whole(bits), y = whole(53), z = whole(53);
        const wide sum = (wide)x * (wide)y * ((wide)1 << up) + (wide)z * ((wide)1 << over);
        wrong += fused(ldexp(x, up), ldexp(y, scale), ldexp(z, over + scale)) != ldexp((double)sum, scale);
    }
    return wrong;
}

static void rounds_once(void)
{
    random_seed(5);
    CHECK(wrong_sums(100000, -100) == 0);
    CHECK(wrong_sums(100000, 300) == 0);
    CHECK(wrong_sums(20000, -700) == 0);
}

/* Halves of a last place, which a sum that is rounded before decides wrongly. */
static void ties(void)
{
    CHECK(fused(1 + 0x1p-52, 1 + 0x1p-52, 0) == 1 + 0x1p-51);
    CHECK(fused(1 + 0x1p-27, 1 + 0x1p-27, -1 - 0x1p-26) == 0x1p-54);
    CHECK(fused(1, 1 + 0x1p-52, 0x1p-53 + 0x1p-105) == 1 + 0x1p-51);
    CHECK(fused(1, 1 + 0x1p-52, 0x1p-53 - 0x1p-106) == 1 + 0x1p-52);
    CHECK(fused(1, 1, 0x1p-53) == 1 && fused(1, 1, 0x1p-53 + 0x1p-100) == 1 + 0x1p-52);
}

static void ends_of_the_range(void)
{
    CHECK(fused(0x1p600, 0x1p600, -INFINITY) == -INFINITY && isnan(fused(INFINITY, 0, 1)) && isnan(fused(1, NAN, 1)));
    CHECK(fused(0x1p1000, 0x1p100, -1) == INFINITY && fused(0, 3, -0x1p-1074) == -0x1p-1074);
    CHECK(fused(0x1p-600, 0x1p-600, 1) == 1 && fused(0x1p-537, 0x1p-537, 0) == 0x1p-1074);
    CHECK(signbit(fused(-1, 0, -0.0)) && !signbit(fused(1, 1, -1.0)));
}

int main(void)
{
    TEST(rounds_once);
    TEST(ties);
    TEST(ends_of_the_range);
    return check_report();
}
