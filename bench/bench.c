/* SPDX-License-Identifier: BSD-3-Clause */
/* One program for the studies of bench.def, which is linked once:
 *
 *     bench NAME [ARGUMENT ..]
 *
 * Without arguments it lists them. Studies that wrap functions of the library or replace those of C are programs of
 * their own. */
#include "bench.h"
#include <string.h>

typedef struct study {
    const char *name, *about;
    int (*run)(int argc, char **argv);
} study;

static const study studies[] = {
#define BENCH_STUDY(name, about) {#name, about, bench_##name},
#include "bench.def"
#undef BENCH_STUDY
};

enum { STUDIES = sizeof studies / sizeof *studies };

int main(int argc, char **argv)
{
    for (int k = 0; argc > 1 && k < STUDIES; k++)
        if (strcmp(argv[1], studies[k].name) == 0)
            return studies[k].run(argc - 1, argv + 1);
    if (argc > 1)
        fprintf(stderr, "no study '%s'\n", argv[1]);
    fprintf(argc > 1 ? stderr : stdout, "usage: bench NAME [ARGUMENT ..]\n");
    for (int k = 0; k < STUDIES; k++)
        fprintf(argc > 1 ? stderr : stdout, "  %-15s %s\n", studies[k].name, studies[k].about);
    return argc > 1;
}
