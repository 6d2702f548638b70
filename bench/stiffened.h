/* SPDX-License-Identifier: BSD-3-Clause */
/* The text of a model with one of its words replaced: its stiffness and damping. */
#ifndef KEMPE_BENCH_STIFFENED_H
#define KEMPE_BENCH_STIFFENED_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Valid until the next call. */
static inline char *stiffened(const char *path, const char *given, const char *stiffness)
{
    static char text[8192], changed[8192];
    FILE *file = fopen(path, "r");
    size_t length = file ? fread(text, 1, sizeof text - 1, file) : 0;
    text[length] = '\0';
    char *at = strstr(text, given);
    if (file)
        fclose(file);
    if (length == 0 || !at)
        exit(1);
    snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, stiffness, at + strlen(given));
    return changed;
}

#endif
