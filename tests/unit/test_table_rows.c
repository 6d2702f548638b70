/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables at several places at once: the bits of each place for itself, turned round as well. */
#include "rail/places/table_rows.h"
#include "table_points.h"
#include <string.h>

static void same_bits(double a, double b)
{
    CHECK(memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b)));
}

static void check_rows(const kmp_table *t)
{
    double x[TABLE_POINTS], back[TABLE_POINTS], y[TABLE_POINTS], turned[TABLE_POINTS], slope[TABLE_POINTS];
    int piece[8], same[8];
    table_points(t, x);
    for (int k = 0; k < TABLE_POINTS; k++)
        back[k] = -x[k];
    for (int derivative = 0; derivative <= 4; derivative++) {
        for (int k = 0, n = 4; k < TABLE_POINTS; k += n, n = k % 100 == 0 ? 8 : 4) {
            kmp_table_find(t, n, 1, x + k, piece);
            kmp_table_values(t, derivative, n, 1, x + k, piece, y + k);
            kmp_table_find(t, n, -1, back + k, same);
            kmp_table_values(t, derivative, n, -1, back + k, same, turned + k);
        }
        for (int k = 0; k < TABLE_POINTS; k++) {
            same_bits(y[k], kmp_table_value(t, derivative, x[k]));
            same_bits(turned[k], y[k]);
        }
    }
    for (int k = 0; k < TABLE_POINTS; k += 8) {
        kmp_table_find(t, 8, 1, x + k, piece);
        kmp_table_both(t, 8, 1, x + k, piece, y + k, slope + k);
        for (int i = k; i < k + 8; i++) {
            same_bits(y[i], kmp_table_value(t, 0, x[i]));
            same_bits(slope[i], kmp_table_value(t, 1, x[i]));
        }
    }
}

static void places_together(void)
{
    with_tables(check_rows);
}

int main(void)
{
    TEST(places_together);
    return check_report();
}
