/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/data/shape.h"
#include <stdlib.h>
#include <string.h>

const char *const kmp_shape_words[KMP_SHAPE_KINDS] = {
#define KMP_SHAPE(kind, word, keys) #word,
#include "model/data/shape_kinds.def"
#undef KMP_SHAPE
};

const char *const kmp_shape_more[KMP_SHAPE_KINDS] = {
#define KMP_SHAPE(kind, word, keys) keys,
#include "model/data/shape_kinds.def"
#undef KMP_SHAPE
};

static const struct colour {
    const char *name;
    int rgb;
} colours[] = {
#define KMP_COLOUR(name, rgb) {#name, rgb},
#include "model/data/colours.def"
#undef KMP_COLOUR
};

const kmp_name_list kmp_colour_names = {colours, sizeof *colours, sizeof colours / sizeof *colours};

int kmp_colour_find(const char *text)
{
    int found = kmp_name_find(kmp_colour_names, text);
    bool digits = text[0] == '#' && strspn(text + 1, "0123456789abcdefABCDEF") == 6 && text[7] == '\0';
    return found >= 0 ? colours[found].rgb : digits ? (int)strtol(text + 1, NULL, 16) : -1;
}
