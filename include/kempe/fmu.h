/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Functional mock-up units: a model as a part of other simulation programs, by the Functional Mock-up Interface (FMI),
 * version 2.0 or 3.0. The unit has the equations as C99 with a simulator (docs/simulator.md), and no library behind it.
 */
#ifndef KEMPE_FMU_FILE_H
#define KEMPE_FMU_FILE_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** NULL and 0 take the default. */
typedef struct kempe_fmu_options {
    size_t size;          /* sizeof this struct, or 0: that of version 0.1 */
    int fmi;              /* version: 2 or 3 (default) */
    const char *kind;     /* me (model exchange), cs (co-simulation), me,cs (default: both) */
    int no_binary;        /* sources alone, which importers can compile */
    const char *compiler; /* C compiler of the binary (default: cc) */
} kempe_fmu_options;

typedef struct kempe_fmu_export kempe_fmu_export;

/** Derives the equations, describes the variables, and compiles the binary of this platform. KEMPE_E_ARGUMENT: an option
 * that does not exist, or a model with a part that generated simulators lack; KEMPE_E_FAILED: loops that do not close at
 * the start, or a compiler that fails. Without the binary the same model gives the same bytes. */
KEMPE_API kempe_status kempe_fmu_export_new(const kempe_model *model, const kempe_fmu_options *options,
                                            kempe_fmu_export **made);
KEMPE_API void kempe_fmu_export_free(kempe_fmu_export *made);

/** The files inside: their names. */
KEMPE_API int kempe_fmu_export_file_count(const kempe_fmu_export *made);
KEMPE_API const char *kempe_fmu_export_file_name(const kempe_fmu_export *made, int k);

/** Writes the unit, whole or not at all. */
KEMPE_API kempe_status kempe_fmu_export_write(const kempe_fmu_export *made, const char *path);

/** Prints a summary: identity, numbers of variables, files. */
KEMPE_API kempe_status kempe_fmu_export_print(const kempe_fmu_export *made, kempe_format format, char **text);

KEMPE_END
#endif
