/* SPDX-License-Identifier: BSD-3-Clause */
/* The parts of a functional mock-up unit: variables, texts, binary. */
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

/** A variable as modelDescription.xml has it. */
typedef struct kmp_unit_variable {
    const char *name, *description;
    unsigned reference;
    const char *causality, *variability, *initial; /* initial NULL: none */
    bool whole, has_start;                         /* an integer */
    double start;
    int unit;       /* 1 + its place in the units; 0: none */
    unsigned state; /* of a derivative: the reference of its state; 0: none */
} kmp_unit_variable;

/** Dependencies of computed variables of a unit of sources; NULL: no memory. */
typedef struct kmp_unit_structure kmp_unit_structure;

/** The size of the icon, pixels. */
enum { KMP_UNIT_ICON = 256 };
