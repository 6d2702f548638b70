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

/** Writes the token, which a unit on the library makes again from its resources. */
void kmp_unit_token(char token[KMP_UNIT_TOKEN], const kmp_unit_plan *plan);

/** Adds the files of the model to the archive, below resources/. */
kempe_status kmp_unit_add_resources(kmp_code_files *files, kmp_arena *arena, const kempe_model *model);

/** Tolerances of co-simulation: those of the model's runs, otherwise 1e-8. */
double kmp_unit_rtol(const kempe_model *model);
double kmp_unit_atol(const kempe_model *model);
double kmp_unit_longest_step(const kempe_model *model); /* s; 0: any */

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
kmp_unit_structure *kmp_unit_structure_new(kmp_arena *arena, const kmp_code_source *source);

/** True for a variable whose dependencies are known, by its reference. */
bool kmp_unit_has_dependencies(unsigned reference);

/** True where the computed variable may depend on a known one, a state or an input. */
bool kmp_unit_depends(const kmp_unit_structure *structure, unsigned reference, unsigned known);

/** Writes modelDescription.xml, and the terminals of version 3. False: no memory. */
bool kmp_unit_describe(kmp_text *xml, kmp_text *terminals, const kmp_unit_plan *plan);

/** An attribute whose value is escaped. */
void kmp_unit_attribute(kmp_text *xml, const char *name, const char *value);

/** terminalsAndIcons.xml: terminals for variables that belong together, and the place of the icon. */
void kmp_unit_terminals(kmp_text *xml, const kmp_unit_variable *variables, int count);

/** The size of the icon, pixels. */
enum { KMP_UNIT_ICON = 256 };

/** sources/buildDescription.xml (FMI 3), NAME_fmu.c, documentation/index.html. */
void kmp_unit_build_description(kmp_text *xml, const kmp_unit_plan *plan);
void kmp_unit_table(kmp_text *text, const kmp_unit_plan *plan);
void kmp_unit_page(kmp_text *html, const kmp_unit_plan *plan);

/** The name of the binary in the archive, "" on a platform without one. */
const char *kmp_unit_binary_folder(int fmi);
/** Compiles the files with `compiler`; the bytes of the shared library are appended. */
kempe_status kmp_unit_compile(kempe_context *context, const kmp_code_files *files, const kmp_unit_plan *plan,
                              const char *compiler, kmp_text *bytes);
