/* SPDX-License-Identifier: BSD-3-Clause */
/* The parts that a page of a report is put together from. */
#ifndef KMP_REPORT_PAGE_H
#define KMP_REPORT_PAGE_H

#include "report/record.h"

/** The files of the same names line by line, newlines included, as the build put them into the library; NULL ends each.
 */
extern const char *const kmp_comparison_html[], *const kmp_modes_view_html[], *const kmp_notice_html[],
                                                                                  *const kmp_comparison_css[];
extern const char *const kmp_phrases_js[], *const kmp_shapes_js[], *const kmp_animation_js[], *const kmp_plots_js[];
extern const char *const kmp_comparison_js[], *const kmp_modes_view_js[];

/** JavaScript of others, as read from the system. */
typedef struct kmp_page_libraries {
    char *three, *chart;
} kmp_page_libraries;

/** KEMPE_E_IO with a sentence that says which package has what is missing. */
kempe_status kmp_page_libraries_read(kempe_context *context, kmp_page_libraries *libraries);
void kmp_page_libraries_free(kmp_page_libraries *libraries);

/** A page put together: lines of `html` that are a mark alone are replaced by what they name. */
typedef struct kmp_sheet {
    const char *const *html;
    const char *model, *subject;       /* its title: "MODEL: SUBJECT" */
    const char *const *const *scripts; /* in order, NULL ends them */
    const kmp_page_libraries *libraries;
    const char *data; /* JSON */
} kmp_sheet;

/** Whole or not at all. */
kempe_status kmp_sheet_write(kempe_context *context, const kmp_sheet *sheet, const char *path);

/** The runs of a comparison that the page shows in detail: the one advised first, then the best of each other
 * formulation. `shown` has room for way_count; how many. */
int kmp_page_choose(const kempe_comparison *comparison, int *shown);

/** All that the page says, as one JSON object. `picture`: the record whose rows are the frames, NULL: none. */
bool kmp_page_data(kmp_text *text, const kempe_comparison *comparison, int count, const kmp_record *records,
                   const kmp_record *picture);

#endif
