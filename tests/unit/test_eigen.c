/* SPDX-License-Identifier: BSD-3-Clause */
/* Quadratic pencils: right and left vectors against the equations that they solve, both ways against each other, zeros
 * that are exact and their chains. */
#include "analyses/derivatives/spectrum.h"
#include "base/memory.h"
#include "linalg/dense/dense_parts.h"
#include "linalg/dense/lapack.h"
#include "testing.h"
#include <math.h>
#include <stdlib.h>

enum { MOST = 12 };

static double random_entry(void)
{
    static double state = 0.37; /* the logistic map */
    state = 3.9999 * state * (1 - state);
    return 2 * state - 1;
}

/* b' b + shift */
static void positive(int p, int rank, double shift, double *out)
{
    double b[MOST * MOST];
    for (int i = 0; i < p * p; i++)
        b[i] = random_entry();
    for (int i = 0; i < p; i++)
        for (int j = 0; j < p; j++) {
            out[i + j * p] = shift * (i == j);
            for (int k = 0; k < rank; k++)
                out[i + j * p] += b[k + i * p] * b[k + j * p];
        }
}

/* The largest part of (s^2 M + s G + K) x, or of its conjugate transpose with y, beside the terms' sizes. */
static double residual(const kmp_spectrum *s, int c, const double *m, const double *g, const double *k, bool left)
{
    int p = s->p;
    double re = s->re[c], im = left ? -s->im[c] : s->im[c], square_re = re * re - im * im, square_im = 2 * re * im;
    const double *x_re = (left ? s->y_re : s->x_re) + c * p, *x_im = (left ? s->y_im : s->x_im) + c * p;
    double worst = 0, size = 0;
    for (int i = 0; i < p; i++) {
        double sum_re = 0, sum_im = 0;
        for (int j = 0; j < p; j++) {
            int at = left ? j + i * p : i + j * p;
            double q_re = square_re * m[at] + re * g[at] + k[at], q_im = square_im * m[at] + im * g[at];
            sum_re += q_re * x_re[j] - q_im * x_im[j];
            sum_im += q_re * x_im[j] + q_im * x_re[j];
            size = check_max(size,
                             (hypot(square_re, square_im) * fabs(m[at]) + hypot(re, im) * fabs(g[at]) + fabs(k[at])) *
                                 hypot(x_re[j], x_im[j]));
        }
        worst = check_max(worst, hypot(sum_re, sum_im));
    }
    return size > 0 ? worst / size : 0;
}

static void check_vectors(const kmp_spectrum *s, const double *m, const double *g, const double *k)
{
    for (int c = 0; c < s->count; c++) {
        CHECK(residual(s, c, m, g, k, false) < 1e-11);
        CHECK(residual(s, c, m, g, k, true) < 1e-11);
        int other = kmp_spectrum_conjugate(s, c);
        CHECK(s->re[other] == s->re[c] && s->im[other] == -s->im[c]);
        CHECK(c < s->zeros ? s->re[c] == 0 && s->im[c] == 0 : hypot(s->re[c], s->im[c]) > 0);
        CHECK(c <= s->zeros || hypot(s->re[c], s->im[c]) >= hypot(s->re[c - 1], s->im[c - 1]) * (1 - 1e-15));
    }
}

static double largest(const kmp_spectrum *s)
{
    double most = 0;
    for (int c = 0; c < s->count; c++)
        most = check_max(most, hypot(s->re[c], s->im[c]));
    return most;
}

/* Equal masses in a row between equal springs: 2 sin(k pi/(2 p + 2)), on both sides of the size from which on matrices
 * are divided. */
static void rows_of_masses_have_their_frequencies(void)
{
    enum { LARGE = 150 };
    static double m[LARGE * LARGE], g[LARGE * LARGE], k[LARGE * LARGE], vectors[LARGE * LARGE], values[LARGE];
    static const int sizes[] = {KMP_EIGEN_DIVIDED - 1, KMP_EIGEN_DIVIDED, LARGE};
    for (int n = 0; n < 3; n++) {
        const int p = sizes[n];
        kmp_spectrum s;
        for (int i = 0; i < p * p; i++) {
            m[i] = i / p == i % p;
            k[i] = i / p == i % p ? 2 : abs(i / p - i % p) == 1 ? -1 : 0;
            g[i] = 0;
            vectors[i] = k[i];
        }
        CHECK(kmp_spectrum_init(&s, p, m, NULL, g, k, false) == 0 && s.conservative && s.zeros == 0);
        CHECK(kmp_symmetric_eigen(p, vectors, values) == 0);
        for (int i = 0; i < p; i++) {
            const double right = 2 * sin((i + 1) * acos(-1) / (2 * p + 2));
            CHECK_NEAR(s.im[2 * i], right, 1e-12);
            CHECK(s.re[2 * i] == 0);
            CHECK_NEAR(values[i], right * right, 1e-13);
            CHECK(residual(&s, 2 * i, m, g, k, false) < 1e-11);
            double off = 0;
            for (int row = 0; row < p; row++) {
                const double *v = vectors + (size_t)i * (size_t)p;
                off = check_max(off, fabs(2 * v[row] - (row > 0 ? v[row - 1] : 0) - (row < p - 1 ? v[row + 1] : 0) -
                                          values[i] * v[row]));
            }
            CHECK(off < 1e-13);
        }
        kmp_spectrum_free(&s);
    }
}

/* K of lower rank: as many double zeros; the companion gives the same. */
static void conservative_ones_are_on_the_axes(void)
{
    for (int p = 1; p <= 10; p++)
        for (int lost = 0; lost < 3 && lost < p; lost++) {
            double m[MOST * MOST], g[MOST * MOST] = {0}, k[MOST * MOST];
            kmp_spectrum a, b;
            positive(p, p, 0.5, m);
            positive(p, p - lost, 0, k);
            CHECK(kmp_spectrum_init(&a, p, m, NULL, g, k, false) == 0 &&
                  kmp_spectrum_init(&b, p, m, NULL, g, k, true) == 0);
            CHECK(a.conservative && b.conservative && a.still == lost && b.still == lost);
            CHECK(a.zeros == 2 * lost && b.zeros == 2 * lost);
            check_vectors(&a, m, g, k);
            check_vectors(&b, m, g, k);
            for (int c = 0; c < a.count; c++) {
                CHECK(a.re[c] == 0);
                CHECK(fabs(b.re[c]) <= 1e-10 * largest(&a));
                CHECK(fabs(a.im[c] - b.im[c]) <= 1e-9 * largest(&a));
            }
            for (int c = 0; c < lost; c++) /* a basis with the identity in it: the same both ways */
                for (int i = 0; i < p; i++)
                    CHECK_NEAR(a.x_re[i + c * p], b.x_re[i + c * p], 1e-9);
            kmp_spectrum_free(&a);
            kmp_spectrum_free(&b);
        }
}

/* Motions without frequency depend on M and on the null space of K alone, whatever the rest of K and the basis found.
 */
static void still_ones_depend_on_no_basis(void)
{
    for (int p = 3; p <= 10; p++)
        for (int rank = 1; rank < p; rank++) {
            double m[MOST * MOST], g[MOST * MOST] = {0}, rows[MOST * MOST], first[MOST * MOST];
            positive(p, p, 0.5, m);
            for (int i = 0; i < p * rank; i++)
                rows[i] = random_entry();
            for (int k = 0; k < 6; k++) {
                double core[MOST * MOST], stiffness[MOST * MOST] = {0};
                kmp_spectrum s;
                positive(rank, rank, 0.5, core);
                for (int i = 0; i < p; i++)
                    for (int j = 0; j <= i; j++) {
                        for (int a = 0; a < rank; a++)
                            for (int b = 0; b < rank; b++)
                                stiffness[i + j * p] += rows[a + i * rank] * core[a + b * rank] * rows[b + j * rank];
                        stiffness[j + i * p] = stiffness[i + j * p];
                    }
                CHECK(kmp_spectrum_init(&s, p, m, NULL, g, stiffness, k % 2 == 1) == 0);
                CHECK(s.still == p - rank && s.zeros == 2 * s.still);
                for (int i = 0; i < p * s.still; i++) {
                    first[i] = k == 0 ? s.x_re[i] : first[i];
                    CHECK(fabs(s.x_re[i] - first[i]) <= 1e-9);
                }
                kmp_spectrum_free(&s);
            }
        }
}

/* If all coordinates move alike, the first ones are chosen. */
static void the_first_of_equals_are_chosen(void)
{
    for (int p = 2; p <= 8; p++)
        for (int companion = 0; companion < 2; companion++) {
            double m[MOST * MOST] = {0}, g[MOST * MOST] = {0}, k[MOST * MOST];
            kmp_spectrum s;
            for (int i = 0; i < p * p; i++) {
                m[i] = i % (p + 1) == 0 ? 3 : 0;
                k[i] = 7;
            }
            CHECK(kmp_spectrum_init(&s, p, m, NULL, g, k, companion) == 0 && s.still == p - 1);
            for (int c = 0; c < p - 1; c++)
                for (int i = 0; i < p; i++)
                    CHECK(fabs(s.x_re[i + c * p] - (i == c) + (i == p - 1)) <= 1e-12);
            kmp_spectrum_free(&s);
        }
}

static void saddles_grow_and_decay(void)
{
    double m[] = {2, 0.5, 0.5, 1}, g[4] = {0}, k[] = {-3, 1, 1, 5};
    kmp_spectrum s;
    CHECK(kmp_spectrum_init(&s, 2, m, NULL, g, k, false) == 0);
    CHECK(s.im[0] == 0 && s.re[0] > 0 && s.re[1] == -s.re[0] && s.re[2] == 0 && s.im[2] > 0);
    check_vectors(&s, m, g, k);
    kmp_spectrum_free(&s);
}

/* Sizes from 1e-4 to 1e6, as metres beside angles and slow beside quick: the vectors still solve. */
static void general_ones_solve_their_equations(void)
{
    for (int p = 1; p <= 10; p++) {
        double m[MOST * MOST], g[MOST * MOST], k[MOST * MOST];
        kmp_spectrum s;
        positive(p, p, 0.5, m);
        positive(p, p, 0, k);
        for (int i = 0; i < p * p; i++)
            g[i] = random_entry();
        for (int i = 0; i < p; i++)
            for (int j = 0; j < p; j++) {
                double scale = pow(10, i % 3 - 1) * pow(10, j % 3 - 1);
                m[i + j * p] *= scale;
                g[i + j * p] *= scale * 30;
                k[i + j * p] = scale * 1e3 * (k[i + j * p] + 0.1 * random_entry());
            }
        CHECK(kmp_spectrum_init(&s, p, m, NULL, g, k, false) == 0);
        CHECK(!s.conservative && s.zeros == 0);
        check_vectors(&s, m, g, k);
        double sum = 0, trace = 0; /* of -M^-1 G, by hand for one */
        for (int c = 0; c < s.count; c++)
            sum += s.re[c];
        trace = -g[0] / m[0];
        CHECK(p > 1 || fabs(sum - trace) <= 1e-12 * fabs(trace));
        kmp_spectrum_free(&s);
    }
}

/* One freedom drifts (0, 0), another is braked (0, -2), a third one swings with damping, all mixed by a congruence. */
static void zeros_have_the_chains_that_they_have(void)
{
    double d[] = {1, 1, 1}, brake[] = {0, 2, 0.2}, spring[] = {0, 0, 4}, t[9], m[9] = {0}, g[9] = {0}, k[9] = {0};
    kmp_spectrum s;
    for (int i = 0; i < 9; i++)
        t[i] = random_entry() + (i % 4 == 0);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int l = 0; l < 3; l++) {
                m[i + 3 * j] += t[l + 3 * i] * d[l] * t[l + 3 * j];
                g[i + 3 * j] += t[l + 3 * i] * brake[l] * t[l + 3 * j];
                k[i + 3 * j] += t[l + 3 * i] * spring[l] * t[l + 3 * j];
            }
    CHECK(kmp_spectrum_init(&s, 3, m, NULL, g, k, false) == 0);
    CHECK(s.still == 2 && s.zeros == 3 && !s.conservative);
    check_vectors(&s, m, g, k);
    CHECK(s.im[3] + s.im[4] + s.im[5] == 0);
    int real = s.im[3] == 0 ? 3 : 5, pair = s.im[3] == 0 ? 4 : 3;
    CHECK_NEAR(s.re[real], -2, 1e-12);
    CHECK_NEAR(s.re[pair], -0.1, 1e-12);
    CHECK_NEAR(s.im[pair], sqrt(4 - 0.01), 1e-12);
    kmp_spectrum_free(&s);
}

/* A light part that friction ties to another one: what brakes this one is small beside that friction, and not zero. */
static void light_parts_hide_no_root(void)
{
    double m[] = {1, 0, 0, 1e-8}, k[4] = {0};
    for (int braked = 0; braked < 2; braked++) {
        double brake = 0.01 * braked, g[] = {1e4 + brake, -1e4, -1e4, 1e4};
        kmp_spectrum s;
        CHECK(kmp_spectrum_init(&s, 2, m, NULL, g, k, false) == 0);
        CHECK(s.still == 2 && s.zeros == 3 - braked);
        CHECK(s.im[2] == 0 && s.im[3] == 0);
        CHECK_NEAR(s.re[2], -brake, 5e-4); /* rounding beside 1e12 is 2e-4 */
        CHECK_NEAR(s.re[3], -1e12, 1e-7);
        kmp_spectrum_free(&s);
    }
}

/* A rotating system: gyroscopic and conservative, on the axis though no symmetric solver is at work. */
static void gyroscopes_stay_on_the_axis(void)
{
    double m[] = {1, 0, 0, 1}, g[] = {0, -20, 20, 0}, k[] = {-9, 0, 0, -4};
    kmp_spectrum s;
    CHECK(kmp_spectrum_init(&s, 2, m, NULL, g, k, false) == 0);
    CHECK(!s.conservative);
    check_vectors(&s, m, g, k);
    /* s^4 + (400 - 13) s^2 + 36 */
    double slow = (387 - sqrt(387.0 * 387 - 144)) / 2, quick = (387 + sqrt(387.0 * 387 - 144)) / 2;
    CHECK_NEAR(s.im[0], sqrt(slow), 1e-12);
    CHECK_NEAR(s.im[2], sqrt(quick), 1e-13);
    for (int c = 0; c < 4; c++)
        CHECK(fabs(s.re[c]) <= 1e-10 * sqrt(quick));
    kmp_spectrum_free(&s);
}

static void a_mass_that_is_none_is_reported(void)
{
    double m[] = {1, 1, 1, 1}, zero[4] = {0};
    kmp_spectrum s = {.p = 7};
    CHECK(kmp_spectrum_init(&s, 2, m, NULL, zero, m, false) == 2 && s.p == 7);
    CHECK(kmp_spectrum_init(&s, 0, m, NULL, zero, m, false) == 0 && s.count == 0);
    kmp_spectrum_free(&s);
    double still[] = {2};
    CHECK(kmp_spectrum_init(&s, 1, still, NULL, zero, zero, false) == 0);
    CHECK(s.zeros == 2 && s.still == 1 && s.x_re[0] == 1 && s.conservative);
    kmp_spectrum_free(&s);
}

/* Left and right vectors are biorthogonal, and scaled so that a change dK moves s by -y^H dK x. */
static void left_vectors_give_derivatives(void)
{
    double m[] = {1.5, 0.2, 0.2, 1}, g[] = {0.1, 0.3, -0.2, 0.4}, k[] = {8, 1, -1, 30}, dk[] = {0.3, -0.7, 0.5, 1.1};
    double plus[4], minus[4], step = 1e-4;
    kmp_spectrum s, a, b;
    for (int i = 0; i < 4; i++) {
        plus[i] = k[i] + step * dk[i];
        minus[i] = k[i] - step * dk[i];
    }
    CHECK(kmp_spectrum_init(&s, 2, m, NULL, g, k, false) == 0 &&
          kmp_spectrum_init(&a, 2, m, NULL, g, plus, false) == 0 &&
          kmp_spectrum_init(&b, 2, m, NULL, g, minus, false) == 0);
    for (int c = 0; c < 4; c++) {
        double re = 0, im = 0;
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++) {
                double e = -dk[i + 2 * j];
                re += e * (s.y_re[i + 2 * c] * s.x_re[j + 2 * c] + s.y_im[i + 2 * c] * s.x_im[j + 2 * c]);
                im += e * (s.y_re[i + 2 * c] * s.x_im[j + 2 * c] - s.y_im[i + 2 * c] * s.x_re[j + 2 * c]);
            }
        CHECK_NEAR(re, (a.re[c] - b.re[c]) / (2 * step), 1e-8);
        CHECK_NEAR(im, (a.im[c] - b.im[c]) / (2 * step), 1e-8);
    }
    kmp_spectrum_free(&s);
    kmp_spectrum_free(&a);
    kmp_spectrum_free(&b);
}

/* Bytes that the spectrum of pairs of masses takes, with springs of `link` between them. */
static unsigned long bytes_of(int pairs, double link)
{
    enum { LARGEST = 60 };
    static double m[LARGEST * LARGEST], g[LARGEST * LARGEST], k[LARGEST * LARGEST];
    const int p = 2 * pairs;
    kmp_spectrum s;
    for (int i = 0; i < p * p; i++)
        m[i] = g[i] = k[i] = 0;
    for (int i = 0; i < p; i++) {
        m[i + i * p] = 1;
        k[i + i * p] = g[i + i * p] = 3 + i;
        if (i + 1 < p)
            k[i + 1 + i * p] = k[i + (i + 1) * p] = i % 2 == 0 ? -1 : link;
    }
    const unsigned long before = kmp_memory_bytes();
    CHECK(kmp_spectrum_init(&s, p, m, NULL, g, k, false) == 0);
    kmp_spectrum_free(&s);
    return kmp_memory_bytes() - before;
}

/* Pencils that share no entry have their eigenvalues, zeros and vectors as one pencil, in less room. */
static void pencils_apart_are_solved_apart(void)
{
    enum { GROUPS = 4, OF_ONE = MOST / GROUPS };
    for (int damped = 0; damped < 2; damped++) {
        double m[MOST * MOST] = {0}, g[MOST * MOST] = {0}, k[MOST * MOST] = {0}, re[2 * MOST], im[2 * MOST];
        int zeros = 0, still = 0, found = 0;
        kmp_spectrum s, own;
        for (int b = 0; b < GROUPS; b++) {
            double m1[MOST * MOST], g1[MOST * MOST], k1[MOST * MOST];
            positive(OF_ONE, OF_ONE, 0.5, m1);
            positive(OF_ONE, b == 1 ? 1 : OF_ONE, 0, k1); /* one has two still shapes */
            positive(OF_ONE, damped && b != 1 ? 1 : 0, 0, g1);
            CHECK(kmp_spectrum_init(&own, OF_ONE, m1, NULL, g1, k1, damped) == 0);
            zeros += own.zeros;
            still += own.still;
            for (int c = own.zeros; c < own.count; c++) {
                re[found] = own.re[c];
                im[found++] = own.im[c];
            }
            kmp_spectrum_free(&own);
            for (int j = 0; j < OF_ONE; j++)
                for (int i = 0; i < OF_ONE; i++) {
                    const int to = i * GROUPS + b + (j * GROUPS + b) * MOST;
                    m[to] = m1[i + j * OF_ONE];
                    g[to] = g1[i + j * OF_ONE];
                    k[to] = k1[i + j * OF_ONE];
                }
        }
        CHECK(kmp_spectrum_init(&s, MOST, m, NULL, g, k, false) == 0);
        CHECK(s.conservative == !damped && s.zeros == zeros && s.still == still && still == 2);
        check_vectors(&s, m, g, k);
        for (int c = s.zeros; c < s.count; c++) {
            double nearest = INFINITY;
            int in = 0; /* groups in which the vector is not zero */
            for (int e = 0; e < found; e++)
                nearest = fmin(nearest, hypot(re[e] - s.re[c], im[e] - s.im[c]));
            CHECK(nearest <= 1e-10 * hypot(s.re[c], s.im[c]));
            CHECK(c == s.zeros || hypot(s.re[c], s.im[c]) >= hypot(s.re[c - 1], s.im[c - 1]) * (1 - 1e-12));
            CHECK(s.im[c] <= 0 || (s.re[c + 1] == s.re[c] && s.im[c + 1] == -s.im[c]));
            for (int b = 0; b < GROUPS; b++) {
                bool any = false;
                for (int i = 0; i < OF_ONE; i++)
                    any = any || s.x_re[i * GROUPS + b + c * MOST] != 0;
                in += any;
            }
            CHECK(in == 1);
        }
        kmp_spectrum_free(&s);
    }
    double m[] = {1, 0, 0, 1}, g[4] = {0}, k[] = {2, 0, 0, 1}; /* a minor that is not positive keeps its place */
    kmp_spectrum s;
    m[3] = -1;
    CHECK(kmp_spectrum_init(&s, 2, m, NULL, g, k, false) == 2);
    CHECK(3 * bytes_of(30, 0) < bytes_of(30, 0.1));
}

/* A large matrix of groups without common entries, in any order: as the same matrix whole. */
static void groups_of_large_matrices_are_solved_apart(void)
{
    enum { N = 70, GROUPS = 7 };
    static double a[N * N], vectors[N * N], values[N];
    kmp_arena arena = {0};
    kmp_dense_groups groups;
    for (int j = 0; j < N; j++)
        for (int i = 0; i <= j; i++)
            a[i + j * N] = a[j + i * N] = i % GROUPS == j % GROUPS ? random_entry() : 0;
    for (int i = 0; i < N * N; i++)
        vectors[i] = i % N >= i / N ? a[i] : NAN; /* the upper triangle is not read */
    CHECK(kmp_dense_groups_init(&groups, &arena, N, 1, &(const double *){a}) && groups.count == GROUPS);
    for (int b = 0; b < GROUPS; b++)
        for (int e = groups.start[b]; e < groups.start[b + 1]; e++)
            CHECK(groups.order[e] == b + GROUPS * (e - groups.start[b]) && groups.of[groups.order[e]] == b);
    CHECK(kmp_symmetric_eigen(N, vectors, values) == 0);
    for (int c = 0; c < N; c++) {
        CHECK(c == 0 || values[c] >= values[c - 1]);
        for (int i = 0; i < N; i++) {
            double sum = -values[c] * vectors[i + c * N];
            for (int j = 0; j < N; j++)
                sum += a[i + j * N] * vectors[j + c * N];
            CHECK(fabs(sum) < 1e-12);
        }
        for (int d = 0; d <= c; d++) {
            double dot = 0;
            for (int i = 0; i < N; i++)
                dot += vectors[i + c * N] * vectors[i + d * N];
            CHECK_NEAR(dot, c == d, 1e-12);
        }
    }
    kmp_arena_free(&arena);
}

/* Least squares of a large matrix whose columns are groups without common rows, two of its columns equal: the residual
 * is across all columns, the equal ones share, and the rank is one less. */
static void groups_of_least_squares(void)
{
    enum { M = 90, N = 70, GROUPS = 7, RIGHT = 2 };
    static double a[M * N], b[M * RIGHT], x[N * RIGHT];
    for (int j = 0; j < N; j++)
        for (int i = 0; i < M; i++)
            a[i + j * M] = i % GROUPS == j % GROUPS ? pow(10, j % GROUPS) * random_entry() : 0;
    for (int i = 0; i < M; i++)
        a[i + (N - 1) * M] = a[i + (N - 1 - GROUPS) * M];
    for (int i = 0; i < M * RIGHT; i++)
        b[i] = random_entry();
    CHECK(kmp_least_squares_of(M, N, a, RIGHT, b, 1e-12, x) == N - 1);
    for (int k = 0; k < RIGHT; k++) {
        CHECK_NEAR(x[N - 1 + k * N], x[N - 1 - GROUPS + k * N], 1e-12);
        for (int j = 0; j < N; j++) {
            double across = 0, size = 0;
            for (int i = 0; i < M; i++) {
                double rest = b[i + k * M];
                for (int c = 0; c < N; c++)
                    rest -= a[i + c * M] * x[c + k * N];
                across += a[i + j * M] * rest;
                size += fabs(a[i + j * M]);
            }
            CHECK(fabs(across) <= 1e-12 * size);
        }
    }
    /* A group that is nothing beside the others counts as zero. */
    CHECK(kmp_least_squares_of(M, N, a, RIGHT, b, 1e-3, x) < N - 3);
    CHECK(x[0] == 0 && x[N - 1] != 0);
}

int main(void)
{
    TEST(rows_of_masses_have_their_frequencies);
    TEST(conservative_ones_are_on_the_axes);
    TEST(still_ones_depend_on_no_basis);
    TEST(the_first_of_equals_are_chosen);
    TEST(saddles_grow_and_decay);
    TEST(general_ones_solve_their_equations);
    TEST(zeros_have_the_chains_that_they_have);
    TEST(light_parts_hide_no_root);
    TEST(gyroscopes_stay_on_the_axis);
    TEST(a_mass_that_is_none_is_reported);
    TEST(left_vectors_give_derivatives);
    TEST(pencils_apart_are_solved_apart);
    TEST(groups_of_large_matrices_are_solved_apart);
    TEST(groups_of_least_squares);
    return check_report();
}
