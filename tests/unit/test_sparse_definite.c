/* SPDX-License-Identifier: BSD-3-Clause */
/* Factors of symmetric matrices: springs in a row, one at the ground, have a closed form; others have none. */
#include "exchange/finite_elements/sparse_definite.h"
#include "testing.h"

enum { N = 200 };

/* Unit springs between masses in a row and, of stiffness `ground`, at its beginning. */
static kmp_sparse_outcome chain(double ground, kmp_sparse_definite **factors)
{
    static int row[3 * N], col[3 * N];
    static double value[3 * N];
    int count = 0;
    for (int i = 0; i < N; i++)
        for (int j = i > 0 ? i - 1 : 0; j < N && j <= i + 1; j++) {
            row[count] = i;
            col[count] = j;
            value[count++] = i != j ? -1 : (i > 0 ? 1 : ground) + (i < N - 1);
        }
    return kmp_sparse_definite_new(N, count, row, col, value, factors);
}

static void springs_in_a_row(void)
{
    kmp_sparse_definite *factors = NULL;
    static double x[2 * N];
    CHECK(chain(4, &factors) == KMP_SPARSE_FACTORED);
    x[N - 1] = 1; /* a force at the end, and one in the middle */
    x[N + N / 2] = 2;
    CHECK(kmp_sparse_definite_solve(factors, 2, x));
    for (int i = 0; i < N; i++) {
        CHECK_NEAR(x[i], 0.25 + i, 1e-10);
        CHECK_NEAR(x[N + i], 2 * (0.25 + (i < N / 2 ? i : N / 2)), 1e-10);
    }
    printf("by %s\n", kmp_sparse_definite_library(factors));
    kmp_sparse_definite_free(factors);
}

static void without_support(void)
{
    kmp_sparse_definite *factors = NULL;
    CHECK(chain(-1, &factors) != KMP_SPARSE_FACTORED || strcmp(kmp_sparse_definite_library(factors), "KLU") == 0);
    kmp_sparse_definite_free(factors);
}

int main(void)
{
    TEST(springs_in_a_row);
    TEST(without_support);
    return check_report();
}
