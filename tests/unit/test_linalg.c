/* SPDX-License-Identifier: BSD-3-Clause */
/* Dense factorisations against random matrices, the block solver against dense LU. */
#include "analyses/dense/complex_lu.h"
#include "analyses/modes/locus.h"
#include "base/memory.h"
#include "linalg/block.h"
#include "linalg/dense/dense.h"
#include "testing.h"

#include <complex.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { MAX = 40 };

static uint64_t seed = 1;

/* Knuth's MMIX generator; uniform in [-1, 1). */
static double uniform(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(seed >> 11) * 0x1p-52 - 1.0;
}

static int below(int n)
{
    int k = (int)((uniform() + 1.0) * 0.5 * n);
    return k < n ? k : n - 1;
}

static void randomise(int count, double *a)
{
    for (int i = 0; i < count; i++)
        a[i] = uniform();
}

/* The largest |b - A x| or |b - A' x|. */
static double residual(int n, const double *a, int transposed, const double *x, const double *b)
{
    double worst = 0;
    for (int i = 0; i < n; i++) {
        double s = b[i];
        for (int j = 0; j < n; j++)
            s -= (transposed ? a[j + i * n] : a[i + j * n]) * x[j];
        worst = check_max(worst, fabs(s));
    }
    return worst;
}

static double largest(int n, const double *x)
{
    double m = 1;
    for (int i = 0; i < n; i++)
        m = check_max(m, fabs(x[i]));
    return m;
}

/* A complex system is a real one of twice the size. */
static void test_lu_complex(void)
{
    static double re[MAX * MAX], im[MAX * MAX], a[4 * MAX * MAX];
    static double complex lu[MAX * MAX], z[MAX];
    int pivot[MAX];
    for (int n = 1; n <= 20; n++)
        for (int trial = 0; trial < 20; trial++) {
            double b[2 * MAX], x[2 * MAX];
            randomise(n * n, re);
            randomise(n * n, im);
            randomise(2 * n, b);
            if (trial % 2) { /* pivots to be exchanged */
                memset(re, 0, (size_t)n * sizeof *re);
                memset(im, 0, (size_t)n * sizeof *im);
                re[n - 1] = 1;
            }
            for (int j = 0; j < n; j++)
                for (int i = 0; i < n; i++) {
                    a[i + j * 2 * n] = a[i + n + (j + n) * 2 * n] = re[i + j * n];
                    a[i + n + j * 2 * n] = im[i + j * n];
                    a[i + (j + n) * 2 * n] = -im[i + j * n];
                }
            for (int k = 0; k < n * n; k++)
                lu[k] = re[k] + I * im[k];
            for (int k = 0; k < n; k++)
                z[k] = b[k] + I * b[n + k];
            CHECK(kmp_lu_complex_factor(n, lu, pivot) == 0);
            kmp_lu_complex_solve(n, lu, pivot, z);
            for (int k = 0; k < n; k++) {
                x[k] = creal(z[k]);
                x[n + k] = cimag(z[k]);
            }
            CHECK(residual(2 * n, a, 0, x, b) < 1e-12 * largest(2 * n, x));
        }
    double complex zero[4] = {0}, undefined[1] = {KMP_COMPLEX(NAN, 1)}, ones[4] = {1 + I, 1 + I, 1 + I, 1 + I};
    CHECK(kmp_lu_complex_factor(2, zero, pivot) == 1);
    CHECK(kmp_lu_complex_factor(1, undefined, pivot) == 1);
    CHECK(kmp_lu_complex_factor(2, ones, pivot) == 2);
}

static void test_lu(void)
{
    static double a[MAX * MAX], lu[MAX * MAX], b[2 * MAX], x[2 * MAX];
    int pivot[MAX];
    for (int n = 1; n <= 12; n++)
        for (int trial = 0; trial < 200; trial++) {
            randomise(n * n, a);
            if (n > 1 && trial % 3 == 0)
                a[0] = 0;
            randomise(2 * n, b);
            memcpy(lu, a, sizeof lu);
            CHECK(kmp_lu_factor(n, lu, pivot) == 0);
            for (int t = 0; t < 2; t++) {
                memcpy(x, b, sizeof x);
                if (!t)
                    kmp_lu_solve(n, lu, pivot, 2, x);
                for (int m = 0; m < 2; m++) {
                    if (t)
                        kmp_lu_solve_transposed(n, lu, pivot, x + m * n);
                    CHECK(residual(n, a, t, x + m * n, b + m * n) < 1e-13 * largest(n, x + m * n));
                }
            }
        }
}

static void test_lu_singular(void)
{
    double a[25];
    int pivot[5];
    for (int n = 1; n <= 5; n++) {
        memset(a, 0, sizeof a);
        CHECK(kmp_lu_factor(n, a, pivot) == 1);
        for (int i = 0; i < n; i++)
            a[i + i * n] = 1;
        a[(n - 1) * (n + 1)] = 0;
        CHECK(kmp_lu_factor(n, a, pivot) == n);
        for (int place = 0; place < n * n; place++) {
            randomise(n * n, a);
            a[place] = place % 2 ? NAN : INFINITY;
            CHECK(kmp_lu_factor(n, a, pivot) != 0);
        }
    }
}

static void test_cholesky(void)
{
    double g[100], a[100], l[100], b[10], x[10];
    for (int n = 1; n <= 10; n++)
        for (int trial = 0; trial < 50; trial++) {
            randomise(n * n, g);
            randomise(n, b);
            for (int i = 0; i < n; i++)
                for (int j = 0; j < n; j++) {
                    a[i + j * n] = i == j;
                    for (int k = 0; k < n; k++)
                        a[i + j * n] += g[i + k * n] * g[j + k * n];
                }
            memcpy(l, a, sizeof l);
            for (int j = 1; j < n; j++)
                l[j * n] = NAN; /* the upper triangle is not read */
            CHECK(kmp_cholesky_factor(n, l) == 0);
            memcpy(x, b, sizeof x);
            kmp_cholesky_solve(n, l, x);
            CHECK(residual(n, a, 0, x, b) < 1e-13);
            memcpy(l, a, sizeof l);
            l[(n - 1) * (n + 1)] = -1;
            CHECK(kmp_cholesky_factor(n, l) == n);
        }
}

static void product(int m, int n, int rank, double *a)
{
    double x[MAX * MAX], y[MAX * MAX];
    randomise(m * rank, x);
    randomise(rank * n, y);
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++) {
            a[i + j * m] = 0;
            for (int k = 0; k < rank; k++)
                a[i + j * m] += x[i + k * m] * y[k + j * rank];
        }
}

static void test_complete_pivoting_finds_the_rank(void)
{
    static double a[MAX * MAX];
    int r[MAX], c[MAX];
    double pivots[MAX];
    for (int m = 1; m <= 8; m++)
        for (int n = 1; n <= 8; n++)
            for (int rank = 0; rank <= m && rank <= n; rank++) {
                product(m, n, rank, a);
                kmp_lu_complete(m, n, a, NULL, r, c, pivots);
                int found = 0;
                for (int k = 0; k < m && k < n; k++)
                    found += pivots[k] > 1e-10 * pivots[0];
                CHECK(found == rank);
            }
}

/* L U is the matrix with rows r and columns c, and a fixed column comes last. */
static void test_complete_pivoting_factors(void)
{
    enum { M = 5, N = 8 };
    double a[M * N], lu[M * N], pivots[M];
    int fixed[N] = {0}, r[M], c[N];
    fixed[2] = fixed[5] = 1;
    for (int trial = 0; trial < 100; trial++) {
        randomise(M * N, a);
        a[2 * M] = 50;
        memcpy(lu, a, sizeof a);
        kmp_lu_complete(M, N, lu, fixed, r, c, pivots);
        for (int k = 0; k < M; k++)
            CHECK(!fixed[c[k]] && pivots[k] == fabs(lu[k + k * M]));
        for (int k = 0; k < M; k++) /* none of what is left was larger */
            for (int i = k; i < M; i++)
                CHECK((i == k || fabs(lu[i + k * M]) <= 1) && (fixed[c[i]] || fabs(lu[k + i * M]) <= pivots[k]));
        for (int i = 0; i < M; i++)
            for (int j = 0; j < N; j++) {
                double s = 0;
                for (int k = 0; k <= i && k <= j; k++)
                    s += (k == i ? 1.0 : lu[i + k * M]) * lu[k + j * M];
                CHECK(fabs(s - a[r[i] + c[j] * M]) < 1e-13);
            }
    }
}

/* Pivots alone are those of the factors, to the last bit: with ties, with zeros, with less than full rank. */
static void test_pivots_alone(void)
{
    enum { MOST = 12 };
    double a[MOST * MOST], b[MOST * MOST], largest[MOST], pivots[2][MOST];
    int r[2][MOST], c[2][MOST];
    for (int round = 0; round < 2000; round++) {
        int m = 1 + below(MOST), n = 1 + below(MOST), least = m < n ? m : n;
        double filled = uniform();
        for (int k = 0; k < m * n; k++) {
            double x = uniform() < filled ? 4 * uniform() : 0;
            a[k] = b[k] = round % 3 ? x : floor(x);
        }
        kmp_lu_complete(m, n, a, NULL, r[0], c[0], pivots[0]);
        kmp_pivots_complete(m, n, b, largest, r[1], c[1], pivots[1]);
        CHECK(memcmp(r[0], r[1], (size_t)m * sizeof *r[0]) == 0 && memcmp(c[0], c[1], (size_t)n * sizeof *c[0]) == 0);
        CHECK(memcmp(pivots[0], pivots[1], (size_t)least * sizeof *pivots[0]) == 0);
    }
}

static void test_complete_pivoting_breaks_ties_by_index(void)
{
    double a[6] = {1, 1, 1, -1, 1, 1}, pivots[2];
    int r[2], c[3];
    kmp_lu_complete(2, 3, a, NULL, r, c, pivots);
    CHECK(c[0] == 0 && r[0] == 0);
    double b[6] = {0, 0, 5, 1, 1, 0}; /* rows 1 and 0 are alike, when row 2 has gone before */
    int rows[3];
    kmp_lu_complete(3, 2, b, NULL, rows, c, pivots);
    CHECK(rows[0] == 2 && rows[1] == 0);
}

static void test_complete_pivoting_ends_without_numbers(void)
{
    double a[9] = {1, 2, NAN, 3, NAN, 5, 6, 7, 8}, pivots[3];
    int r[3], c[3];
    kmp_lu_complete(3, 3, a, NULL, r, c, pivots);
    CHECK(r[0] + r[1] + r[2] == 3 && r[0] != r[1] && c[0] + c[1] + c[2] == 3 && c[0] != c[1]);
    CHECK(!(pivots[2] >= 0));
}

/* -- blocks ---------------------------------------------------------------------------------------- */

typedef struct pattern {
    int n, nz, row[MAX * MAX], col[MAX * MAX];
    double value[MAX * MAX], dense[MAX * MAX];
} pattern;

static void add(pattern *s, int i, int j, double value)
{
    s->row[s->nz] = i;
    s->col[s->nz] = j;
    s->value[s->nz++] = value;
    s->dense[i + j * s->n] = value;
}

static void shuffle(int n, int *p)
{
    for (int i = 0; i < n; i++)
        p[i] = i;
    for (int i = n - 1; i > 0; i--) {
        int k = below(i + 1), t = p[i];
        p[i] = p[k];
        p[k] = t;
    }
}

/* Upper block-triangular with blocks of 1 to `largest_block`, rows and columns shuffled. */
static int make_triangular(pattern *s, int n, int largest_block)
{
    int p[MAX], q[MAX], block[MAX], count = 0;
    memset(s, 0, sizeof *s);
    s->n = n;
    shuffle(n, p);
    shuffle(n, q);
    for (int i = 0; i < n; count++)
        for (int size = 1 + below(largest_block); size > 0 && i < n; size--)
            block[i++] = count;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            if (block[i] == block[j] || (block[i] < block[j] && uniform() > 0.4))
                add(s, p[i], q[j], uniform());
    return count;
}

static void make_random(pattern *s, int n, double density)
{
    memset(s, 0, sizeof *s);
    s->n = n;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            if (uniform() < 2 * density - 1)
                add(s, i, j, uniform());
}

/* 0 when the factorisation stops. */
static double smallest_pivot(int n, double *a)
{
    int pivot[MAX];
    if (kmp_lu_factor(n, a, pivot))
        return 0;
    double low = fabs(a[0]);
    for (int i = 1; i < n; i++)
        low = fmin(low, fabs(a[i + i * n]));
    return low;
}

/* A block that has changed its sign is seen, though det A keeps its own when two of them have. */
static void every_block_has_its_sign(void)
{
    const int row[] = {0, 0, 1, 1, 2, 2, 3, 3, 0}, col[] = {0, 1, 0, 1, 2, 3, 2, 3, 3};
    double value[] = {2, 1, 1, 3, 2, -1, 1, 1, 5};
    int signs[2], now[2];
    kmp_block *b = kmp_block_new(4, 9, row, col);
    CHECK(b && kmp_block_count(b) == 2 && kmp_block_factor(b, value) == 0);
    kmp_block_take_signs(b, signs);
    value[0] = value[4] = -4;
    CHECK(kmp_block_factor(b, value) == 0);
    kmp_block_take_signs(b, now);
    CHECK(now[0] == -signs[0] && now[1] == -signs[1]);
    value[4] = 2;
    CHECK(kmp_block_factor(b, value) == 0);
    kmp_block_take_signs(b, now);
    CHECK((now[0] == signs[0]) != (now[1] == signs[1]));
    kmp_block_free(b);
}

static void compare_with_dense(const pattern *s, const kmp_block *b)
{
    static double lu[MAX * MAX];
    double right[3 * MAX], x[3 * MAX], one[MAX];
    int pivot[MAX], n = s->n;
    memcpy(lu, s->dense, sizeof lu);
    CHECK(kmp_lu_factor(n, lu, pivot) == 0);
    randomise(3 * n, right);
    for (int t = 0; t < 2; t++) {
        memcpy(x, right, sizeof x);
        if (!t)
            kmp_block_solve(b, 3, x);
        for (int m = 0; m < 3; m++) {
            if (t)
                kmp_block_solve_transposed(b, x + m * n);
            CHECK(residual(n, s->dense, t, x + m * n, right + m * n) < 1e-11 * largest(n, x + m * n));
            memcpy(one, right + m * n, sizeof one);
            if (!t)
                kmp_block_solve(b, 1, one);
            CHECK(t || memcmp(one, x + m * n, (size_t)n * sizeof *one) == 0);
        }
    }
}

static void test_blocks_of_triangular_matrices(void)
{
    static pattern s;
    for (int n = 1; n <= 20; n++)
        for (int trial = 0; trial < 50; trial++) {
            int count = make_triangular(&s, n, 1 + trial % 5), columns = 0, size;
            kmp_block *b = kmp_block_new(n, s.nz, s.row, s.col);
            CHECK(b && kmp_block_count(b) == count);
            unsigned long before = kmp_memory_count();
            CHECK(kmp_block_factor(b, s.value) == 0);
            compare_with_dense(&s, b);
            CHECK(kmp_memory_count() == before);
            for (int k = 0; k < count; k++, columns += size)
                CHECK(kmp_block_columns(b, k, &size) != NULL);
            CHECK(columns == n);
            CHECK(kmp_block_smallest(b) > 0);
            kmp_block_free(b);
        }
}

static void test_blocks_of_random_patterns(void)
{
    static pattern s;
    int regular = 0, singular = 0;
    for (int trial = 0; trial < 2000; trial++) {
        make_random(&s, 1 + below(14), 0.05 + 0.3 * (uniform() + 1));
        kmp_block *b = kmp_block_new(s.n, s.nz, s.row, s.col);
        if (b && kmp_block_factor(b, s.value) == 0) {
            compare_with_dense(&s, b);
            regular++;
        } else {
            CHECK(smallest_pivot(s.n, s.dense) < 1e-13);
            singular++;
        }
        kmp_block_free(b);
    }
    CHECK(regular > 300 && singular > 300);
}

/* -- transposed solves of few entries ------------------------------------------------------------------ */

/* x <- the entries that are found, zero elsewhere. Returns their number, -1 if a row is named twice or a value is at
 * most `nothing`. */
static int solve_few(const kmp_block *b, int n, double nothing, int count, const int *column, const double *value,
                     double *x)
{
    int row[MAX];
    double entry[MAX];
    bool seen[MAX] = {false}, good = true;
    int found = kmp_block_solve_transposed_few(b, nothing, count, column, value, row, entry);
    memset(x, 0, (size_t)n * sizeof *x);
    for (int e = 0; e < found; e++) {
        good = good && !seen[row[e]] && fabs(entry[e]) > nothing;
        seen[row[e]] = true;
        x[row[e]] = entry[e];
    }
    return good ? found : -1;
}

/* Each right-hand side beside the solve of all entries. The former ones leave no trace. */
static void compare_few(const pattern *s, const kmp_block *b)
{
    int n = s->n, order[MAX];
    for (int count = 0; count <= n && count <= 4; count++) {
        double value[MAX], all[MAX] = {0}, x[MAX];
        shuffle(n, order);
        randomise(count, value);
        for (int e = 0; e < count; e++)
            all[order[e]] = value[e];
        kmp_block_solve_transposed(b, all);
        CHECK(solve_few(b, n, 0, count, order, value, x) >= 0);
        for (int i = 0; i < n; i++)
            CHECK_NEAR(x[i], all[i], 1e-12 * (1 + largest(n, all)));
    }
}

/* Rows of 4, 8 or 16 right-hand sides beside single ones, also of the transposed, to the bit. */
static void compare_wide(const kmp_block *b, int n)
{
    enum { WIDEST = 16 };
    static double right[MAX * WIDEST], rows[MAX * WIDEST], plain[MAX * WIDEST], back[MAX * WIDEST], one[2][MAX];
    for (int width = 4; width <= WIDEST; width *= 2) {
        randomise(n * width, right);
        for (int c = 0; c < width; c++) {
            for (int i = 0; i < n; i++)
                one[0][i] = one[1][i] = right[i * width + c];
            kmp_block_solve(b, 1, one[0]);
            kmp_block_solve_transposed(b, one[1]);
            for (int i = 0; i < n; i++) {
                plain[i * width + c] = one[0][i];
                back[i * width + c] = one[1][i];
            }
        }
        kmp_block_solve_wide(b, width, right, rows);
        CHECK(memcmp(rows, plain, (size_t)(n * width) * sizeof *rows) == 0);
        kmp_block_solve_transposed_wide(b, width, right, rows);
        CHECK(memcmp(rows, back, (size_t)(n * width) * sizeof *rows) == 0);
    }
}

static void few_entries_are_solved_as_all(void)
{
    static pattern s;
    for (int n = 1; n <= 20; n++)
        for (int trial = 0; trial < 50; trial++) {
            (void)make_triangular(&s, n, 1 + trial % 5);
            kmp_block *b = kmp_block_new(n, s.nz, s.row, s.col);
            CHECK(b && kmp_block_factor(b, s.value) == 0);
            unsigned long before = kmp_memory_count();
            compare_few(&s, b);
            compare_wide(b, n);
            CHECK(kmp_memory_count() == before);
            kmp_block_free(b);
        }
}

/* A chain of pairs of which each passes on a millionth of itself, one of them far more: entries of at most `nothing`
 * are not named, a pair of such entries ends the chain, and what lies before the entry is not reached. */
static void few_entries_end_where_they_are_nothing(void)
{
    enum { PAIRS = 6, SIZE = 2 * PAIRS };
    const double tiny = 1e-6;
    static pattern s;
    memset(&s, 0, sizeof s);
    s.n = SIZE;
    for (int k = 0; k < SIZE; k += 2) {
        add(&s, k, k, 1);
        add(&s, k, k + 1, 0.5);
        add(&s, k + 1, k, 1e-9);
        add(&s, k + 1, k + 1, 1);
        if (k + 2 < SIZE)
            add(&s, k, k + 2, k == 6 ? 1e15 : tiny);
    }
    kmp_block *b = kmp_block_new(s.n, s.nz, s.row, s.col);
    CHECK(b && kmp_block_count(b) == PAIRS && kmp_block_factor(b, s.value) == 0);
    const int column = 2;
    const double one = 1;
    double x[SIZE];
    CHECK(solve_few(b, SIZE, 0, 1, &column, &one, x) == SIZE - 2);
    CHECK(x[0] == 0 && x[1] == 0);
    CHECK(solve_few(b, SIZE, 1e-7, 1, &column, &one, x) == 4);
    CHECK_NEAR(x[2], 1, 1e-8);
    CHECK_NEAR(x[3], -0.5, 1e-8);
    CHECK_NEAR(x[4] / tiny, -1, 1e-8);
    CHECK_NEAR(x[5] / tiny, 0.5, 1e-8);
    CHECK(solve_few(b, SIZE, 7e-7, 1, &column, &one, x) == 3 && x[5] == 0);
    CHECK(solve_few(b, SIZE, 2, 1, &column, &one, x) == 0);
    CHECK(solve_few(b, SIZE, 0, 1, &column, &one, x) == SIZE - 2);
    kmp_block_free(b);
}

static void test_block_names_the_singular_column(void)
{
    /* columns 1 and 2 form a block of equal columns; column 0 is alone */
    int row[] = {0, 0, 1, 1, 2, 2}, col[] = {0, 1, 1, 2, 1, 2};
    double value[] = {5, 1, 1, 1, 1, 1};
    kmp_block *b = kmp_block_new(3, 6, row, col);
    CHECK(b && kmp_block_count(b) == 2);
    int fault = kmp_block_factor(b, value);
    CHECK(fault == 2 || fault == 3);
    CHECK(kmp_block_smallest(b) == 0);
    value[5] = 3;
    CHECK(kmp_block_factor(b, value) == 0);
    CHECK_NEAR(kmp_block_smallest(b), 1, 1e-15);
    kmp_block_free(b);
    CHECK((b = kmp_block_new(0, 0, row, col)) != NULL && kmp_block_factor(b, value) == 0);
    kmp_block_free(b);
}

/* Two blocks, {0, 1} and {2}, and one entry beside them. By hand: the 2 x 2 factors take a quotient and a product less,
 * every pivot a reciprocal; a solve two products less within the block, one beside it, a product a pivot. */
static void test_block_counts_its_arithmetic(void)
{
    int row[] = {0, 0, 1, 1, 0, 2}, col[] = {0, 1, 0, 1, 2, 2};
    kmp_block *b = kmp_block_new(3, 6, row, col);
    CHECK(b && kmp_block_count(b) == 2);
    kmp_flops factor = kmp_block_factor_flops(b), solve = kmp_block_solve_flops(b, NULL);
    CHECK(factor.add == 1 && factor.mul == 1 && factor.div == 1 + 3 && factor.root == 0);
    CHECK(solve.add == 2 + 1 && solve.mul == 2 + 1 + 3 && solve.div == 0 && solve.root == 0);
    kmp_block_free(b);
}

static void test_dense_counts_its_arithmetic(void)
{
    const long lu[5][2] = {{0, 0}, {0, 0}, {1, 1}, {5, 3}, {14, 6}}; /* products, quotients */
    for (int n = 0; n < 5; n++) {
        kmp_flops f = kmp_lu_flops(n);
        CHECK(f.add == lu[n][0] && f.mul == lu[n][0] && f.div == lu[n][1] && f.root == 0);
    }
    kmp_flops one = kmp_cholesky_factor_flops(1), three = kmp_cholesky_factor_flops(3);
    CHECK(one.add == 0 && one.mul == 0 && one.div == 0 && one.root == 1);
    CHECK(three.add == 1 + 3 && three.mul == 4 && three.div == 3 && three.root == 3);
    kmp_flops solve = kmp_cholesky_solve_flops(3);
    CHECK(solve.add == 6 && solve.mul == 6 && solve.div == 6 && solve.root == 0);
}

/* Against all permutations. */
static double cheapest(int n, const double *cost, int row, unsigned taken)
{
    double best = row == n ? 0 : INFINITY;
    for (int j = 0; j < n && row < n; j++)
        if (!(taken & 1u << j))
            best = fmin(best, cost[row + j * n] + cheapest(n, cost, row + 1, taken | 1u << j));
    return best;
}

static void test_assign(void)
{
    for (int n = 0; n <= 7; n++)
        for (int trial = 0; trial < 20; trial++) {
            double cost[49], sum = 0;
            int column[7];
            unsigned taken = 0;
            randomise(n * n, cost);
            CHECK(kmp_assign(n, cost, column) == 0);
            for (int i = 0; i < n; i++) {
                sum += cost[i + column[i] * n];
                taken |= 1u << column[i];
            }
            CHECK(taken == (1u << n) - 1);
            CHECK_NEAR(sum, cheapest(n, cost, 0, 0), 1e-14);
        }
}

/* -- sparse blocks ------------------------------------------------------------------------------------- */

/* A ring of n - before unknowns with some chords, before which `before` unknowns follow from it one by one; rows and
 * columns by p and q. The diagonal of the ring may be small. */
static void make_ring(pattern *s, int n, int before, const int *p, const int *q, bool small)
{
    const int size = n - before;
    memset(s, 0, sizeof *s);
    s->n = n;
    for (int i = 0; i < n; i++) {
        const int at = i - before;
        const double scale = pow(10, 0.5 * uniform());
        add(s, p[i], q[i], at >= 0 && small ? 1e-5 * uniform() : scale * (2 + uniform()));
        if (at >= 0)
            add(s, p[i], q[before + (at + 1) % size], scale * (1 + 0.2 * uniform()));
        if (at >= 0 && at % 5 == 0)
            add(s, p[i], q[before + (at + size / 2) % size], 0.3 * scale * uniform());
        if (at < 0)
            add(s, p[i], q[before + i], uniform());
    }
}

/* The same matrix with other values, by a tenth. */
static void change(pattern *s)
{
    for (int e = 0; e < s->nz; e++) {
        s->value[e] *= 1 + 0.1 * uniform();
        s->dense[s->row[e] + s->col[e] * s->n] = s->value[e];
    }
}

/* The sign of det A by the dense factors. */
static int sign_of(const pattern *s)
{
    static double lu[MAX * MAX];
    int pivot[MAX], sign = 1;
    memcpy(lu, s->dense, sizeof lu);
    CHECK(kmp_lu_factor(s->n, lu, pivot) == 0);
    for (int i = 0; i < s->n; i++)
        sign *= (lu[i + i * s->n] < 0 ? -1 : 1) * (pivot[i] != i ? -1 : 1);
    return sign;
}

/* Rows of right-hand sides beside single ones, to the bit. */
static void compare_rows(const kmp_block *b, int n)
{
    enum { STRIDE = 8 };
    static double right[MAX * STRIDE], rows[MAX * STRIDE], one[MAX];
    int start[MAX + 1], run[2 * MAX];
    randomise(n * STRIDE, right);
    for (int k = 0; k < kmp_block_count(b); k++) {
        start[k] = k;
        start[k + 1] = k + 1;
        run[2 * k] = 0;
        run[2 * k + 1] = STRIDE;
    }
    kmp_block_solve_rows(b, STRIDE, start, run, right, rows);
    for (int c = 0; c < STRIDE; c++) {
        for (int i = 0; i < n; i++)
            one[i] = right[i * STRIDE + c];
        kmp_block_solve(b, 1, one);
        for (int i = 0; i < n; i++)
            CHECK(memcmp(&one[i], &rows[i * STRIDE + c], sizeof *one) == 0);
    }
}

/* Blocks large enough to be sparse: pivots stay while they suit, and are chosen anew where they no longer do. */
static void large_blocks_are_sparse(void)
{
    static pattern s;
    int kept = 0, chosen = 0;
    for (int n = 34; n <= MAX; n++)
        for (int trial = 0; trial < 20; trial++) {
            const int before = n - 34 > 3 ? 3 : 0;
            int p[MAX], q[MAX];
            shuffle(n, p);
            shuffle(n, q);
            make_ring(&s, n, before, p, q, false);
            kmp_block *b = kmp_block_new(n, s.nz, s.row, s.col);
            CHECK(b && kmp_block_largest(b) == n - before);
            const kmp_flops f = kmp_block_factor_flops(b);
            CHECK(f.mul < n * n); /* a dense one takes n^3 / 3 */
            int parity = 0;
            for (int turn = 0; turn < 6; turn++) {
                if (turn % 2 == 1)
                    change(&s);
                else
                    make_ring(&s, n, before, p, q, turn == 2);
                unsigned long memory = kmp_memory_count();
                CHECK(kmp_block_factor(b, s.value) == 0);
                kept += kmp_memory_count() == memory;
                chosen += kmp_memory_count() != memory;
                compare_with_dense(&s, b);
                compare_rows(b, n);
                compare_wide(b, n);
                compare_few(&s, b);
                CHECK(kmp_block_smallest(b) > 0);
                int signs[MAX], sign = sign_of(&s);
                kmp_block_take_signs(b, signs);
                for (int k = 0; k < kmp_block_count(b); k++)
                    sign *= signs[k];
                CHECK(turn == 0 || sign == parity);
                parity = sign;
            }
            kmp_block_free(b);
        }
    CHECK(kept > 100 && chosen > 100);
}

/* A block without an inverse is reported with a column of it, and a later one with others is solved. */
static void sparse_blocks_may_be_singular(void)
{
    static pattern s;
    int order[MAX];
    shuffle(MAX, order);
    make_ring(&s, MAX, 0, order, order, false);
    kmp_block *b = kmp_block_new(MAX, s.nz, s.row, s.col);
    CHECK(b && kmp_block_factor(b, s.value) == 0);
    for (int turn = 0; turn < 2; turn++) {
        static double zero[MAX * MAX];
        memcpy(zero, s.value, sizeof zero);
        for (int e = 0; e < s.nz; e++)
            zero[e] = s.col[e] == 7 ? 0 : zero[e];
        CHECK(kmp_block_factor(b, zero) > 0 && !(kmp_block_smallest(b) > 0));
        CHECK(kmp_block_factor(b, s.value) == 0);
        compare_with_dense(&s, b);
    }
    kmp_block_free(b);
}

int main(void)
{
    TEST(every_block_has_its_sign);
    TEST(test_lu);
    TEST(test_lu_complex);
    TEST(test_lu_singular);
    TEST(test_cholesky);
    TEST(test_complete_pivoting_finds_the_rank);
    TEST(test_complete_pivoting_factors);
    TEST(test_pivots_alone);
    TEST(test_complete_pivoting_breaks_ties_by_index);
    TEST(test_complete_pivoting_ends_without_numbers);
    TEST(test_blocks_of_triangular_matrices);
    TEST(test_blocks_of_random_patterns);
    TEST(large_blocks_are_sparse);
    TEST(sparse_blocks_may_be_singular);
    TEST(few_entries_are_solved_as_all);
    TEST(few_entries_end_where_they_are_nothing);
    TEST(test_block_names_the_singular_column);
    TEST(test_block_counts_its_arithmetic);
    TEST(test_dense_counts_its_arithmetic);
    TEST(test_assign);
    return check_report();
}
