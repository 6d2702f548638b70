/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations + - * / of the accelerations of the linear and of the binary tree of bench/trees.h, N = 1 .. 100, by each
 * formalism, and from which N on the O(N) scheme takes fewer: Fisette and Samin 1996, section 2.3, Fig. 5. There N* is
 * 12 for the linear tree and 31 for the binary one.
 *
 *     bench opcounts [csv]
 */
#include "bench.h"
#include "bench/formalisms.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 100 };

/* Sizes in the tables; the classical form, which grows with the cube of N, is counted up to 32 only. */
static const int sizes[] = {2, 5, 8, 10, 12, 15, 20, 31, 50, 63, 100};

enum { SIZES = sizeof sizes / sizeof *sizes };

static bool is_shown(int n)
{
    for (int k = 0; k < SIZES; k++)
        if (sizes[k] == n)
            return true;
    return false;
}

/* Counts of each tree: formalisms as they are written down, three of them as Kempe generates them. */
typedef enum curve {
    CURVE_NER,
    CURVE_COMPOSITE,
    CURVE_CLASSICAL,
    CURVE_ORDER_N,
    CURVE_PLAIN_N,
    CURVE_GENERATED_NER,
    CURVE_GENERATED_COMPOSITE,
    CURVE_GENERATED_N,
    CURVE_DENSE, /* Cholesky */
    CURVE_SPARSE,
    CURVES
} curve;

static const char *const curve_names[CURVES] = {"ner",         "composite",     "classical",           "O(N)",
                                                "O(N) 6x6",    "generated ner", "generated composite", "generated O(N)",
                                                "dense solve", "sparse solve"};

static const struct {
    formalism f;
    bool generated;
} curves[] = {{FORMALISM_NER, false},      {FORMALISM_COMPOSITE, false}, {FORMALISM_CLASSICAL, false},
              {FORMALISM_ORDER_N, false},  {FORMALISM_PLAIN_N, false},   {FORMALISM_NER, true},
              {FORMALISM_COMPOSITE, true}, {FORMALISM_ORDER_N, true}};

static long counts[TREE_SHAPES][CURVES][MOST + 1];

static void count_tree(tree_shape shape, int n)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    char *text = tree_text(shape, n);
    if (!text || kempe_model_read_text(context, text, "tree", &model)) {
        fprintf(stderr, "%s\n", kempe_context_message(context));
        exit(1);
    }
    for (size_t k = 0; k < sizeof curves / sizeof *curves; k++) {
        long *to = &counts[shape][k][n];
        if (k == CURVE_CLASSICAL && n > 32 && !is_shown(n))
            continue;
        *to = curves[k].generated ? formalism_generated(model, curves[k].f) : formalism_count(model, curves[k].f);
        if (*to < 0) {
            fprintf(stderr, "%s, N = %d: %s\n", curve_names[k], n, kempe_context_message(context));
            exit(1);
        }
    }
    counts[shape][CURVE_DENSE][n] = formalism_dense_solve(n);
    counts[shape][CURVE_SPARSE][n] = formalism_sparse_solve(shape, n);
    kmp_free(text);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* -- printing ---------------------------------------------------------------------------------------- */

static void put_csv(void)
{
    printf("tree,N");
    for (int k = 0; k < CURVES; k++)
        printf(",%s", curve_names[k]);
    printf("\n");
    for (tree_shape s = 0; s < TREE_SHAPES; s++)
        for (int n = 1; n <= MOST; n++) {
            printf("%s,%d", tree_names[s], n);
            for (int k = 0; k < CURVES; k++)
                printf(k == CURVE_CLASSICAL && counts[s][k][n] == 0 && n > 1 ? "," : ",%ld", counts[s][k][n]);
            printf("\n");
        }
}

static void put_tree(tree_shape shape)
{
    printf("%s tree\n%5s | %25s | %16s | %16s | %25s\n", tree_names[shape], "", "M and C", "M x = -C      ",
           "O(N)      ", "as generated       ");
    printf("%5s | %7s %7s %9s | %8s %7s | %8s %7s | %8s %8s %7s\n", "N", "ner", "compos.", "classical", "dense",
           "sparse", "6x6", "", "ner", "compos.", "O(N)");
    for (int k = 0; k < SIZES; k++) {
        const int n = sizes[k];
        long c[CURVES];
        for (int i = 0; i < CURVES; i++)
            c[i] = counts[shape][i][n];
        printf("%5d | %7ld %7ld %9ld | %8ld %7ld | %8ld %7ld | %8ld %8ld %7ld\n", n, c[CURVE_NER], c[CURVE_COMPOSITE],
               c[CURVE_CLASSICAL], c[CURVE_DENSE], c[CURVE_SPARSE], c[CURVE_PLAIN_N], c[CURVE_ORDER_N],
               c[CURVE_GENERATED_NER], c[CURVE_GENERATED_COMPOSITE], c[CURVE_GENERATED_N]);
    }
    printf("\n");
}

static void put_star(const char *assumptions, curve matrix, curve order_n)
{
    printf("  %-56s", assumptions);
    for (curve solve = CURVE_DENSE; solve <= CURVE_SPARSE; solve++)
        for (tree_shape s = 0; s < TREE_SHAPES; s++) {
            int n = formalism_break_even(MOST, counts[s][matrix], counts[s][solve], counts[s][order_n]);
            printf(n > MOST ? "    > %d" : "  %7d", n > MOST ? MOST : n);
        }
    printf("\n");
}

static void put_stars(void)
{
    printf("N*, from which on O(N) takes fewer operations, up to N = %d (the paper: linear 12, binary 31)\n", MOST);
    printf("  %-56s  %16s  %16s\n  %-56s  %7s  %7s  %7s  %7s\n", "", "dense solve", "sparse solve", "", "linear",
           "binary", "linear", "binary");
    put_star("ner, O(N) 6x6: as the paper's programs may have been", CURVE_NER, CURVE_PLAIN_N);
    put_star("ner, O(N)", CURVE_NER, CURVE_ORDER_N);
    put_star("composite bodies, O(N) 6x6", CURVE_COMPOSITE, CURVE_PLAIN_N);
    put_star("composite bodies, O(N)", CURVE_COMPOSITE, CURVE_ORDER_N);
    put_star("as generated: ner, O(N)", CURVE_GENERATED_NER, CURVE_GENERATED_N);
    put_star("as generated: composite bodies, O(N)", CURVE_GENERATED_COMPOSITE, CURVE_GENERATED_N);
}

int bench_opcounts(int argc, char **argv)
{
    for (tree_shape s = 0; s < TREE_SHAPES; s++)
        for (int n = 1; n <= MOST; n++)
            count_tree(s, n);
    if (argc > 1 && strcmp(argv[1], "csv") == 0) {
        put_csv();
        return 0;
    }
    for (tree_shape s = 0; s < TREE_SHAPES; s++)
        put_tree(s);
    put_stars();
    return 0;
}
