/* SPDX-License-Identifier: BSD-3-Clause */
/* The models of examples and of tests, for what has to hold of all of them. */
#ifndef KEMPE_TESTS_MODELS_H
#define KEMPE_TESTS_MODELS_H

#include "base/memory.h"
#include "base/text.h"
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_MODELS = 300 };

static inline int models_by_name(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Models of a folder, and of the folders in it. */
static inline int models_in(const char *where, int depth, char **paths, int count)
{
    DIR *dir = opendir(where);
    struct dirent *entry;
    while (dir && (entry = readdir(dir)) && count < MOST_MODELS) {
        kmp_text path = {0};
        size_t length = strlen(entry->d_name);
        kmp_text_printf(&path, "%s/%s", where, entry->d_name);
        if (entry->d_name[0] != '.' && !strchr(entry->d_name, '.') && depth > 0)
            count = models_in(path.s, depth - 1, paths, count);
        else if (length > 5 && strcmp(entry->d_name + length - 5, ".yaml") == 0)
            paths[count++] = kmp_strdup(path.s);
        kmp_text_free(&path);
    }
    if (dir)
        closedir(dir);
    return count;
}

/** Paths in the order of their names, each to be freed (kmp_free); how many. */
static inline int models_list(char *paths[MOST_MODELS])
{
    int count = models_in("examples", 1, paths, 0);
    count = models_in("tests/models", 0, paths, count);
    qsort(paths, (size_t)count, sizeof *paths, models_by_name);
    return count;
}

#endif
