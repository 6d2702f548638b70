/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Sets of equations of a model: their operation counts, each derived separately, and their text in other languages.
 * Functional mock-up units.
 */
#ifndef KEMPE_GENERATE_H
#define KEMPE_GENERATE_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** Selection of the sets and of their form. NULL and 0 take the default. */
typedef struct kempe_generate_options {
    size_t size;           /* sizeof this struct; 0: its size in version 0.1 */
    const char *sets;      /* comma-separated: M_C, invdyn, h_J, jdqd (the default is all four), M, C, h, J, h_t. qdd:
                            * the accelerations without closure forces, in O(N). invdyn_q, invdyn_qd: derivatives of
                            * invdyn; tangents: these and M. R: invdyn less J' lambda; R_q: derivatives of R by q;
                            * R_tangents: R_q, invdyn_qd and M. friction, contact, impact: elements with modes;
                            * discrete: states with samples or events; outputs: as in the model. With + between
                            * several they are one program: M_C+h_J+jdqd */
    const char *scheme;    /* algorithm for M: composite (default), ner */
    int keep_parameters;   /* every nonzero number of the model stays a symbol instead of being folded in */
    int body_inputs;       /* three forces and three torques on every body are inputs */
    const char *no_inputs; /* comma-separated: bodies without these inputs */
    int drives;            /* the closures include rows of drives and locks: coordinates less functions of time */
    int optimize;          /* search for the fewest operations at run time, joint by joint: slower */
    /* only for kempe_code */
    const char *language; /* c (default), casadi, jax, octave, python, torch */
    const char *form;     /* names of variables: legible (default), compact */
    int vectorised;       /* array languages: operations that can be done at once are one statement */
    int simulator;        /* the files of a simulator in C99 (docs/simulator.md), in place of `sets` */
} kempe_generate_options;

typedef struct kempe_count kempe_count;

/** Derives each set by itself, and all sets in the options as one program. KEMPE_E_ARGUMENT: a set, scheme or body
 * does not exist. KEMPE_E_INPUT: a closure can never be met. */
KEMPE_API kempe_status kempe_count_new(const kempe_model *model, const kempe_generate_options *generation,
                                       kempe_count **count);
KEMPE_API void kempe_count_free(kempe_count *count);

/** Prints operation counts by two rules: `paper` counts + - * /; `robotran` counts those, unary minus, and one for each
 * sine, cosine or other function. */
KEMPE_API kempe_status kempe_count_print(const kempe_count *count, kempe_format format, char **text);

typedef struct kempe_code kempe_code;

/** Derives each set in the options by itself and writes it in a language: one self-contained function per set, with all
 * digits of the constants. The same model gives the same bytes. KEMPE_E_ARGUMENT: a set, scheme, body, language or form
 * does not exist, or the language lacks an operation. KEMPE_E_INPUT: a closure can never be met. */
KEMPE_API kempe_status kempe_code_new(const kempe_model *model, const kempe_generate_options *generation,
                                      kempe_code **code);
KEMPE_API void kempe_code_free(kempe_code *code);

/** The files: their names and contents. */
KEMPE_API int kempe_code_file_count(const kempe_code *code);
KEMPE_API const char *kempe_code_file_name(const kempe_code *code, int k);
KEMPE_API const char *kempe_code_file_text(const kempe_code *code, int k);

/** Writes all files into a folder, which is made if it does not exist; each file whole or not at all. */
KEMPE_API kempe_status kempe_code_write(kempe_code *code, const char *folder);

/** Prints a summary: the folder of the last write, routines with their operations, and files. */
KEMPE_API kempe_status kempe_code_print(const kempe_code *code, kempe_format format, char **text);

/** Options of functional mock-up units: models as parts of other simulation programs, by the Functional Mock-up
 * Interface (docs/fmu.md). NULL and 0 take the default. */
typedef struct kempe_fmu_options {
    size_t size;           /* sizeof this struct; 0: its size in version 0.1 */
    int fmi;               /* version: 2 or 3 (default) */
    const char *kind;      /* me (model exchange), cs (co-simulation), me,cs (default: both) */
    int no_binary;         /* only sources, which importers can compile */
    const char *compiler;  /* C compiler of the binary (default: cc, gcc on Windows, a cross-compiler for platforms) */
    const char *unit_file; /* the file kempe_unit.so: a unit of co-simulation on the library, with all formulations and
                            * integrators and the files of the model; without sources (default: a unit of sources) */
    const char *platforms; /* of the binaries: x86_64-linux, x86_64-windows, aarch64-linux, x86_64-darwin,
                            * aarch64-darwin, with commas (default: this one). With unit_file the files of other
                            * platforms are in its folder: kempe_unit-x86_64-windows.dll */
} kempe_fmu_options;

typedef struct kempe_fmu_export kempe_fmu_export;

/** Derives the equations, describes the variables, and compiles the binaries. KEMPE_E_ARGUMENT: an option does
 * not exist, or the model has a part that generated simulators lack. KEMPE_E_FAILED: the loops do not close
 * at the start, or a compiler is missing or fails. Without a binary the same model gives the same bytes. */
KEMPE_API kempe_status kempe_fmu_export_new(const kempe_model *model, const kempe_fmu_options *options,
                                            kempe_fmu_export **made);
KEMPE_API void kempe_fmu_export_free(kempe_fmu_export *made);

/** The files inside: their names. */
KEMPE_API int kempe_fmu_export_file_count(const kempe_fmu_export *made);
KEMPE_API const char *kempe_fmu_export_file_name(const kempe_fmu_export *made, int k);

/** Writes the unit, whole or not at all. */
KEMPE_API kempe_status kempe_fmu_export_write(kempe_fmu_export *made, const char *path);

/** Prints a summary: the file of the last write, numbers of variables; as JSON also identity and files. */
KEMPE_API kempe_status kempe_fmu_export_print(const kempe_fmu_export *made, kempe_format format, char **text);

KEMPE_END
#endif
