/* SPDX-License-Identifier: BSD-3-Clause */
/* Wings: parts of the library that a build may leave out, by the options KEMPE_RAIL, KEMPE_ROAD, KEMPE_EXCHANGE,
 * KEMPE_ANALYSES, KEMPE_ENSEMBLE, KEMPE_PICTURE, KEMPE_REPORT and KEMPE_LANGUAGE_SERVER of CMake. The core never names
 * a wing. At each place that a wing may add to, the core runs through kmp_wings: the rows of the wings of this build,
 * which CMake lists in wings.c. */
#pragma once

#include <kempe/kempe.h>
#include <stdbool.h>

struct kempe_assembly;
struct kmp_text;

typedef struct kmp_wing {
    const char *name;
    const struct kmp_document_wing *documents;  /* model files of other programs (model/files/document.h) */
    const struct kmp_modal_format *bodies;      /* files of flexible bodies (model/flexible/modal_file.h) */
    const struct kmp_reader_wing *reader;       /* sections of a model file (model/read/reading.h) */
    const struct kmp_writer_wing *writer;       /* one without a section ends them (model/write/model_print.h) */
    const struct kmp_closure_of_wing *closures; /* one without parts ends them (constraints/kinds/kind.h) */
    const struct kmp_law_row *laws;             /* one without a law ends them (dynamics/forces/law.h) */
    const struct kmp_output_of_wing *outputs;   /* one without a function ends them (dynamics/outputs.h) */
    const struct kmp_run_judge *judge;          /* of results of a run (studies/simulate/trajectory.h) */
    const struct kmp_places_wing *places;       /* of blocks over places (symbolic/implicit.h) */
    /** Moves an assembled start to the equilibrium that the model asks for (model/data/start.h), with
     * assembly->balance. KEMPE_E_FAILED: there is none, or it is not found; KEMPE_E_ARGUMENT: a rate is wrong. */
    kempe_status (*balance)(const struct kempe_system *system, struct kempe_assembly *assembly);
    /** Draws a mechanism: a square picture of `size` pixels at the user's coordinates q. false: no memory. */
    bool (*picture)(struct kmp_text *svg, const struct kempe_model *model, const double *q, double size);
} kmp_wing;

/** NULL ends them. */
extern const kmp_wing *const kmp_wings[];
