/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Costs of the formalisms on the trees that Fisette and Samin 1996 compare them on: the shorter one, and the number of
 * bodies from which on it is. */
#include "bench/formalisms.h"
#include "dynamics/equations.h"
#include "testing.h"
#include <math.h>
#include <stdlib.h>

enum { MOST = 48 };

static long counts[TREE_SHAPES][FORMALISMS][MOST + 1];

static void count_all(void)
{
    for (tree_shape s = TREE_LINEAR; s < TREE_SHAPES; s++)
        for (int n = 1; n <= MOST; n++) {
            kempe_context *context = kempe_context_new();
            kempe_model *model = NULL;
            char *text = tree_text(s, n);
            CHECK(text && kempe_model_read_text(context, text, "tree", &model) == KEMPE_OK);
            for (formalism f = FORMALISM_NER; model && f < FORMALISMS; f++)
                counts[s][f][n] = f == FORMALISM_CLASSICAL && n > 12 ? 0 : formalism_count(model, f);
            kmp_free(text);
            kempe_model_free(model);
            kempe_context_free(context);
        }
}

/* The axes come again after six bodies, and so does what one more costs, from the seventh on. */
static void order_n_is_linear(void)
{
    static const formalism order_n[] = {FORMALISM_ORDER_N, FORMALISM_PLAIN_N};
    for (int k = 0; k < 2; k++) {
        const long *c = counts[TREE_LINEAR][order_n[k]];
        for (int n = 7; n + 12 <= MOST; n++)
            CHECK(c[n + 12] - c[n + 6] == c[n + 6] - c[n]);
        printf("   %s: %ld operations a body\n", formalism_names[order_n[k]], (c[MOST] - c[MOST - 6]) / 6);
    }
    CHECK(counts[TREE_LINEAR][FORMALISM_ORDER_N][MOST] > 0);
}

/* Bytes asked for while accelerations of n bodies are generated, passes and all. */
static double bytes_to_generate(tree_shape s, int n)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    char *text = tree_text(s, n);
    CHECK(text && kempe_model_read_text(context, text, "tree", &model) == KEMPE_OK);
    double before = (double)kmp_memory_bytes();
    kmp_equations eq;
    const kmp_derivation_request scene = {.sets = KMP_SET_ACCELERATION};
    CHECK(kmp_equations_derive_once(&eq, model, &scene) == KEMPE_OK);
    kmp_program *p = kmp_sets_program(&eq, 1u << KMP_EQ_QDD);
    double bytes = (double)kmp_memory_bytes() - before;
    kmp_program_free(p);
    kmp_equations_free(&eq);
    kmp_free(text);
    kempe_model_free(model);
    kempe_context_free(context);
    return bytes;
}

static void memory_is_linear(void)
{
    for (tree_shape s = TREE_LINEAR; s < TREE_SHAPES; s++) {
        double half = bytes_to_generate(s, 128), whole = bytes_to_generate(s, 256), twice = bytes_to_generate(s, 512);
        printf("   %s tree: %.0f, %.0f, %.0f kB asked for\n", tree_names[s], half / 1024, whole / 1024, twice / 1024);
        CHECK(whole < 2.4 * half && twice < 2.4 * whole);
    }
}

/* Symmetric inertias take fewer than full matrices, composite bodies fewer than columns, those than virtual power. */
static void shorter_ones(void)
{
    for (tree_shape s = TREE_LINEAR; s < TREE_SHAPES; s++)
        for (int n = 2; n <= MOST; n++) {
            const long ner = counts[s][FORMALISM_NER][n], classical = counts[s][FORMALISM_CLASSICAL][n];
            CHECK(counts[s][FORMALISM_COMPOSITE][n] < ner);
            CHECK(classical == 0 || classical > ner);
            CHECK(n < 4 || counts[s][FORMALISM_ORDER_N][n] < counts[s][FORMALISM_PLAIN_N][n]);
        }
    const long *columns = counts[TREE_LINEAR][FORMALISM_NER], *bodies = counts[TREE_LINEAR][FORMALISM_COMPOSITE];
    CHECK(10 * bodies[MOST] < 4 * columns[MOST]);
}

/* The paper has 12 for the linear tree and 31 for the binary one. */
static void break_even_as_in_the_paper(void)
{
    static const int paper[TREE_SHAPES] = {12, 31}, off[TREE_SHAPES] = {4, 10};
    for (tree_shape s = TREE_LINEAR; s < TREE_SHAPES; s++) {
        long solve[MOST + 1] = {0};
        for (int n = 1; n <= MOST; n++)
            solve[n] = formalism_sparse_solve(s, n);
        int star = formalism_break_even(MOST, counts[s][FORMALISM_NER], solve, counts[s][FORMALISM_PLAIN_N]);
        int other = formalism_break_even(MOST, counts[s][FORMALISM_COMPOSITE], solve, counts[s][FORMALISM_PLAIN_N]);
        printf("   %s tree: N* = %d, with composite bodies %d\n", tree_names[s], star, other);
        CHECK(abs(star - paper[s]) <= off[s]);
        CHECK(other > star);
    }
}

/* -- the solves, done and counted --------------------------------------------------------------------- */

/* M x = b by Cholesky, x in b; returns + - * /. */
static long cholesky(int n, double *m, double *b)
{
    long count = 0;
    for (int j = 0; j < n; j++)
        for (int i = j; i < n; i++) {
            for (int k = 0; k < j; k++, count += 2)
                m[i * n + j] -= m[i * n + k] * m[j * n + k];
            count += i > j;
            m[i * n + j] = i > j ? m[i * n + j] / m[j * n + j] : sqrt(m[j * n + j]);
        }
    for (int i = 0; i < n; i++, count++) {
        for (int k = 0; k < i; k++, count += 2)
            b[i] -= m[i * n + k] * b[k];
        b[i] /= m[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--, count++) {
        for (int k = i + 1; k < n; k++, count += 2)
            b[i] -= m[k * n + i] * b[k];
        b[i] /= m[i * n + i];
    }
    return count;
}

/* Operations by L' D L along the tree; rows are bodies less one. */
static long along_the_tree(tree_shape s, int n, double *m, double *b)
{
    long count = 0;
    for (int k = n; k > 0; k--)
        for (int i = tree_parent(s, k); i > 0; i = tree_parent(s, i), count++) {
            double a = m[(k - 1) * n + i - 1] / m[(k - 1) * n + k - 1];
            for (int j = i; j > 0; j = tree_parent(s, j), count += 2)
                m[(i - 1) * n + j - 1] -= a * m[(k - 1) * n + j - 1];
            m[(k - 1) * n + i - 1] = a;
        }
    for (int k = n; k > 0; k--)
        for (int i = tree_parent(s, k); i > 0; i = tree_parent(s, i), count += 2)
            b[i - 1] -= m[(k - 1) * n + i - 1] * b[k - 1];
    for (int k = 1; k <= n; k++, count++) {
        b[k - 1] /= m[(k - 1) * n + k - 1];
        for (int i = tree_parent(s, k); i > 0; i = tree_parent(s, i), count += 2)
            b[k - 1] -= m[(k - 1) * n + i - 1] * b[i - 1];
    }
    return count;
}

static bool is_above(tree_shape s, int a, int b)
{
    while (b > a)
        b = tree_parent(s, b);
    return a == b;
}

static void check_solves(tree_shape s, int n)
{
    double dense[MOST * MOST] = {0}, sparse[MOST * MOST] = {0}, x[MOST], y[MOST];
    for (int i = 1; i <= n; i++) {
        x[i - 1] = y[i - 1] = 1 + i % 5;
        for (int k = 1; k <= i; k++)
            if (is_above(s, k, i))
                dense[(i - 1) * n + k - 1] = sparse[(i - 1) * n + k - 1] = i == k ? n + 2 : 1.0 / (1 + i + k);
    }
    CHECK(cholesky(n, dense, x) == formalism_dense_solve(n));
    CHECK(along_the_tree(s, n, sparse, y) == formalism_sparse_solve(s, n));
    for (int i = 0; i < n; i++)
        CHECK(fabs(x[i] - y[i]) <= 1e-14 * fabs(x[i]) + 1e-15);
}

static void solves(void)
{
    for (tree_shape s = TREE_LINEAR; s < TREE_SHAPES; s++)
        for (int n = 1; n <= MOST; n += 1 + n / 3)
            check_solves(s, n);
}

int main(void)
{
    count_all();
    TEST(order_n_is_linear);
    TEST(memory_is_linear);
    TEST(shorter_ones);
    TEST(break_even_as_in_the_paper);
    TEST(solves);
    return check_report();
}
