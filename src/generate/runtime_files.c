/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/runtime_files.h"
#include <string.h>

enum { MOST_PARTS = 7 };

static const struct {
    const char *name;
    const char *const *parts[MOST_PARTS];
} files[KMP_RUNTIME_FILES] = {
    [KMP_RUNTIME_FUNCTIONS] = {"kempe_runtime.h", {kmp_runtime_lines}},
    [KMP_RUNTIME_NEWTON] = {"kempe_newton.h", {kmp_factors_h, kmp_factors_c, kmp_newton_h, kmp_places_h}},
    [KMP_RUNTIME_SIMULATOR_HEADER] = {"kempe_simulator.h", {kmp_kempe_simulator_h}},
    [KMP_RUNTIME_SIMULATOR] = {
        "kempe_simulator.c",
        {kmp_bracket_h, kmp_bracket_c, kmp_explicit_methods_h, kmp_factors_h, kmp_factors_c, kmp_kempe_simulator_c}}};

const char *kmp_runtime_name(kmp_runtime_file file)
{
    return files[file].name;
}

/* An include of another source of the library, which has a folder. */
static bool is_inner_include(const char *line)
{
    static const char include[] = "#include \"";
    return strncmp(line, include, sizeof include - 1) == 0 && strchr(line, '/');
}

void kmp_runtime_put(kmp_text *text, kmp_runtime_file file)
{
    if (files[file].parts[1])
        kmp_text_put(text, "#define KMP_LOCAL static inline\n");
    for (int k = 0; k < MOST_PARTS && files[file].parts[k]; k++)
        for (const char *const *line = files[file].parts[k]; *line; line++)
            if (!is_inner_include(*line))
                kmp_text_put(text, *line);
}
