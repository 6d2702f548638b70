/* SPDX-License-Identifier: BSD-3-Clause */
/* A single page without external files, and its parts. three.js and Chart.js are taken from where the system has them.
 */
#pragma once

#include "report/step_record.h"
#include <kempe/compare.h>

/** The files of the same names line by line, newlines included, as embedded by the build; NULL ends each. */
extern const char *const kmp_report_html[], *const kmp_stage_html[], *const kmp_report_css[];
extern const char *const kmp_comparison_html[], *const kmp_modes_view_html[], *const kmp_result_html[];
extern const char *const kmp_phrases_js[], *const kmp_plots_js[], *const kmp_records_js[], *const kmp_animation_js[];
extern const char *const kmp_solids_js[], *const kmp_shapes_js[], *const kmp_scene_webgl_js[];
extern const char *const kmp_scene_canvas_js[], *const kmp_journal_paths_js[], *const kmp_quantities_js[];
extern const char *const kmp_running_vehicle_js[], *const kmp_comparison_plots_js[];
extern const char *const kmp_comparison_js[], *const kmp_modes_view_js[], *const kmp_result_js[];

/** The scripts of the moving picture, in order. */
#define KMP_PICTURE_SCRIPTS kmp_solids_js, kmp_shapes_js, kmp_scene_webgl_js, kmp_scene_canvas_js, kmp_animation_js

/** A complete page: lines of report.html that consist of a mark are replaced by its content. */
typedef struct kmp_sheet {
    const char *const *body;
    const char *model, *subject;       /* its title: "MODEL: SUBJECT" */
    const char *const *const *scripts; /* in order, NULL ends them */
    kmp_text *data;                    /* JSON */
} kmp_sheet;

/** Writes whole or not at all, and frees the data. KEMPE_E_IO with a sentence that names the package of a missing
 * library. */
kempe_status kmp_sheet_write(kempe_context *context, const kmp_sheet *sheet, const char *path);
