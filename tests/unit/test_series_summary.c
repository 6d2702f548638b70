/* SPDX-License-Identifier: BSD-3-Clause */
/* Extreme values, mean and root mean square of curves with known ones. */
#include "analyses/parts/series_summary.h"
#include "testing.h"

enum { ROWS = 4001 };

/* Over one period, from x = 3: trapezoids are exact for periodic functions of few harmonics. */
static void a_sine(void)
{
    double x[ROWS], y[2 * ROWS];
    for (int k = 0; k < ROWS; k++) {
        x[k] = 3 + 2.0 * k / (ROWS - 1);
        y[2 * k] = 0.25 + 2 * sin(acos(-1) * (x[k] - 3));
        y[2 * k + 1] = 1000; /* of another curve */
    }
    kmp_series_summary s = kmp_series_summarise(ROWS, x, y, 2);
    CHECK_NEAR(s.high, 2.25, 1e-12);
    CHECK_NEAR(s.high_at, 3.5, 1e-12);
    CHECK_NEAR(s.low, -1.75, 1e-12);
    CHECK_NEAR(s.low_at, 4.5, 1e-12);
    CHECK_NEAR(s.mean, 0.25, 1e-12);
    CHECK_NEAR(s.rms, sqrt(2 + 0.0625), 1e-12);
}

/* Uneven rows and a gap: 1 on [0, 1], 3 on [2, 5]. */
static void a_gap(void)
{
    const double x[] = {0, 1, 1.5, 2, 4, 5}, y[] = {1, 1, NAN, 3, 3, 3};
    kmp_series_summary s = kmp_series_summarise(6, x, y, 1);
    CHECK_NEAR(s.mean, (1 * 1 + 3 * 3) / 4.0, 1e-15);
    CHECK_NEAR(s.rms, sqrt((1 * 1 + 3 * 9) / 4.0), 1e-15);
    CHECK(s.low == 1 && s.low_at == 0 && s.high == 3 && s.high_at == 2);
}

static void descending_rows_have_the_same_summary(void)
{
    const double x[] = {5, 2, 1, 0}, y[] = {4, 1, 0, 2};
    const double back_x[] = {0, 1, 2, 5}, back_y[] = {2, 0, 1, 4};
    kmp_series_summary s = kmp_series_summarise(4, x, y, 1), back = kmp_series_summarise(4, back_x, back_y, 1);
    CHECK_NEAR(s.mean, back.mean, 1e-15);
    CHECK_NEAR(s.rms, back.rms, 1e-15);
    CHECK(s.low_at == 1 && s.high_at == 5);
}

static void few_rows(void)
{
    const double x[] = {7}, y[] = {-2}, unknown[] = {NAN};
    kmp_series_summary one = kmp_series_summarise(1, x, y, 1), none = kmp_series_summarise(0, x, y, 1);
#include "testing.h"
    kmp_series_summary hidden = kmp_series_summarise(1, x, unknown, 1);
    CHECK(one.low == -2 && one.high_at == 7 && one.mean == -2 && one.rms == 2);
    CHECK(isnan(none.low) && isnan(none.mean) && isnan(none.rms));
    CHECK(isnan(hidden.high) && isnan(hidden.rms));
}

int main(void)
{
    TEST(a_sine);
    TEST(a_gap);
    TEST(descending_rows_have_the_same_summary);
    TEST(few_rows);
    return check_report();
}
