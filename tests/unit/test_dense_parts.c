/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense factors in parts that share no entry, against those of the whole matrix: matrices of random parts, their
 * unknowns in random order. */
#include "linalg/dense/dense_parts.h"
#include "linalg/dense/factors.h"
#include "random.h"
#include "testing.h"
#include <math.h>
#include <string.h>

enum { MOST = 24 };

static void check_matrix(int n, int parts)
{
    int row[MOST * MOST], col[MOST * MOST], of[MOST], pivot[MOST], entries = 0, used = 0;
    double value[MOST * MOST], whole[MOST * MOST] = {0}, x[MOST], y[MOST];
    for (int i = 0; i < n; i++)
        of[i] = pick(parts);
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            if (of[i] == of[j]) {
                row[entries] = i;
                col[entries] = j;
                value[entries++] = whole[i + j * n] = between(-1, 1);
            }
    for (int k = 0; k < parts; k++) {
        bool any = false;
        for (int i = 0; i < n; i++)
            any = any || of[i] == k;
        used += any;
    }
    for (int i = 0; i < n; i++)
        x[i] = y[i] = of[i] == 0 && parts > 1 ? 0 : between(-1, 1);
    kmp_arena arena = {0};
    kmp_dense_parts p;
    CHECK(kmp_dense_parts_init(&p, &arena, n, entries, row, col));
    CHECK(p.count == used && (used == 1 || p.numbers < (size_t)(n * n)));
    for (int pass = 0; pass < 2; pass++) {
        kmp_dense_parts_clear(&p);
        for (int e = 0; e < entries; e++)
            p.matrix[p.at[e]] = value[e];
        CHECK(kmp_dense_parts_factor(&p) == 0);
    }
    kmp_dense_parts_solve(&p, x);
    CHECK(kmp_lu_factor(n, whole, pivot) == 0);
    kmp_lu_solve(n, whole, pivot, 1, y);
    for (int i = 0; i < n; i++)
        CHECK_NEAR(x[i], y[i], 1e-9 * (1 + fabs(y[i])));
    kmp_dense_parts_clear(&p); /* a part without numbers is singular */
    CHECK(kmp_dense_parts_factor(&p) != 0);
    kmp_arena_free(&arena);
}

static void random_parts(void)
{
    random_seed(11);
    for (int trial = 0; trial < 300; trial++)
        check_matrix(1 + pick(MOST), 1 + pick(6));
}

int main(void)
{
    TEST(random_parts);
    return check_report();
}
