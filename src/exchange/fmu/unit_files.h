/* SPDX-License-Identifier: BSD-3-Clause */
/* The plan of a functional mock-up unit, its table in C, and its page. */
#pragma once

#include "exchange/code/simulated.h"
#include <kempe/generate.h>

enum { KMP_UNIT_TOKEN = 128 };

/** Units on the library: the list of their resources, with the path of the model, then parameters that were set. */
#define KMP_UNIT_LIST "model.txt"

/** The request, and what all parts say of the unit. */
typedef struct kmp_unit_plan {
    const kmp_code_source *source;
    int fmi; /* 2, 3 */
    bool exchange, simulation;
    bool on_library;            /* the binary is on the library; there are no sources */
    char token[KMP_UNIT_TOKEN]; /* guid, instantiation token */
    char **sources;             /* names of C files */
    int source_count;
} kmp_unit_plan;

/** The size of the icon, pixels. */
enum { KMP_UNIT_ICON = 256 };

/** Writes the token, which a unit on the library makes again from its resources. */
void kmp_unit_token(char token[KMP_UNIT_TOKEN], const kmp_unit_plan *plan);

/** Tolerances of co-simulation: the tolerances of the model's runs, otherwise 1e-8. */
double kmp_unit_rtol(const kempe_model *model);
double kmp_unit_atol(const kempe_model *model);
double kmp_unit_longest_step(const kempe_model *model); /* s; 0: any */

/** NAME_fmu.c, documentation/index.html. */
void kmp_unit_table(kmp_text *text, const kmp_unit_plan *plan);
void kmp_unit_page(kmp_text *html, const kmp_unit_plan *plan);
