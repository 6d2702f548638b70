/* SPDX-License-Identifier: BSD-3-Clause */
/* The parts of a report's page. */
#ifndef KMP_REPORT_PAGE_H
#define KMP_REPORT_PAGE_H

#include "report/record.h"
#include <kempe/compare.h>

/** The files of the same names line by line, newlines included, as embedded by the build; NULL ends each.
 */
extern const char *const kmp_comparison_html[], *const kmp_modes_view_html[], *const kmp_notice_html[],
                                                                                  *const kmp_comparison_css[];
extern const char *const kmp_phrases_js[], *const kmp_shapes_js[], *const kmp_animation_js[], *const kmp_plots_js[];
extern const char *const kmp_comparison_js[], *const kmp_modes_view_js[];

/** JavaScript of others, as read from the system. */
typedef struct kmp_page_libraries {
    char *three, *chart;
} kmp_page_libraries;

/** KEMPE_E_IO with a sentence that names the package of a missing file. */
kempe_status kmp_page_libraries_read(kempe_context *context, kmp_page_libraries *libraries);
void kmp_page_libraries_free(kmp_page_libraries *libraries);

/** A complete page: lines of `html` that consist of a mark are replaced by its content. */
typedef struct kmp_sheet {
    const char *const *html;
    const char *model, *subject;       /* its title: "MODEL: SUBJECT" */
    const char *const *const *scripts; /* in order, NULL ends them */
    const kmp_page_libraries *libraries;
    const char *data; /* JSON */
} kmp_sheet;

/** Whole or not at all. */
kempe_status kmp_sheet_write(kempe_context *context, const kmp_sheet *sheet, const char *path);

/** The runs of a comparison that the page shows in detail: the advised one first, then the best of each other
 * formulation. `shown` has room for way_count; returns their number. */
int kmp_page_choose(const kempe_comparison *comparison, int *shown);

/** All data of the page, as one JSON object. `picture`: the record whose rows are the frames, NULL: none. */
bool kmp_page_data(kmp_text *text, const kempe_comparison *comparison, int count, const kmp_record *records,
                   const kmp_record *picture);

#endif
