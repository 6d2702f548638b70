/* SPDX-License-Identifier: BSD-3-Clause */
/* The text of a model that bench programs make:
 *
 *     bench model_text windows N | windows_in_space N | tree N
 */
#include "base/memory.h"
#include "bench.h"
#include "chain.h"
#include "trees.h"
#include <stdio.h>
#include <string.h>

static char *tree(int n)
{
    return tree_text(TREE_BINARY, n);
}

int bench_model_text(int argc, char **argv)
{
    static const struct {
        const char *name;
        char *(*text)(int n);
    } models[] = {{"windows", chain_hanging}, {"windows_in_space", chain_hanging_in_space}, {"tree", tree}};
    for (size_t k = 0; argc == 3 && k < sizeof models / sizeof *models; k++)
        if (strcmp(models[k].name, argv[1]) == 0) {
            char *text = models[k].text(atoi(argv[2]));
            fputs(text, stdout);
            kmp_free(text);
            return 0;
        }
    fprintf(stderr, "usage: bench model_text windows|windows_in_space|tree N\n");
    return 1;
}
