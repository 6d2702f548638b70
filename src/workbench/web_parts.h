/* SPDX-License-Identifier: BSD-3-Clause */
/* Files of the page, line by line, as embedded by the build: the files of src/workbench/web, scripts of src/report/web
 * that draw mechanisms, the schema of models, and libraries of third_party. */
#pragma once

typedef struct kmp_web_part {
    const char *name;
    const char *const *lines; /* newlines included; NULL ends them */
} kmp_web_part;

/** A row without a name ends them. */
extern const kmp_web_part kmp_web_parts[];
