/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of a result: a single file that needs no others, with the result in words, the mechanism moving, and
 * curves, runs over time or tables as the kind of result has them. three.js and Chart.js come from third_party. */
#pragma once

#include "base/json.h"
#include "picture/picture_forces.h"
#include "report/step_record.h"
#include <kempe/comfort.h>
#include <kempe/ensemble.h>
#include <kempe/kempe.h>

/** The files of the same names line by line, newlines included, as embedded by the build; NULL ends each. */
extern const char *const kmp_report_html[],
    *const kmp_stage_html[], *const kmp_records_html[], *const kmp_report_css[], *const kmp_shared_look_css[];
extern const char *const kmp_comparison_html[], *const kmp_modes_view_html[], *const kmp_result_html[];
extern const char *const kmp_phrases_js[],
    *const kmp_plots_js[], *const kmp_records_js[], *const kmp_animation_js[], *const kmp_stage_views_js[];
extern const char *const kmp_solids_js[], *const kmp_shapes_js[], *const kmp_scene_webgl_js[];
extern const char *const kmp_scene_canvas_js[], *const kmp_journal_paths_js[], *const kmp_quantities_js[];
extern const char *const kmp_running_vehicle_js[], *const kmp_comparison_js[], *const kmp_modes_view_js[];
extern const char *const kmp_result_js[], *const kmp_scene_flexible_js[], *const kmp_joint_reactions_js[];
extern const char *const kmp_force_arrows_js[], *const kmp_range_strip_js[];

/** Libraries of others, in pieces of lines; neither contains what would end a script of a page (third_party/renew). */
extern const char *const kmp_three_min_js[], *const kmp_chart_min_js[];

/** A number with a name, in words; beyond its limit it takes the trust from the result. */
typedef struct kmp_page_fact {
    const char *name, *value, *limit; /* limit: NULL, none */
    bool beyond;
} kmp_page_fact;

enum { KMP_PAGE_FACTS = 6, KMP_PAGE_FIRST = 20 };

/** The line from a row to the next one in a diagram. */
typedef enum kmp_page_join { KMP_JOIN_NONE, KMP_JOIN_SOLID, KMP_JOIN_DASHED } kmp_page_join;

/** The result in a few words, and the printed one. */
typedef struct kmp_page_head {
    const char *scene;             /* next to the name of the model */
    const char *answer;            /* the result in a few words */
    kempe_outcome outcome;         /* of the result */
    const char *reason, *warnings; /* "" and NULL: none; one a line */
    kmp_page_fact fact[KMP_PAGE_FACTS];
    int fact_count;
    char *text; /* the printed result */
} kmp_page_head;

/** The columns of a table over one of them. */
typedef struct kmp_page_curves {
    kempe_table *table;                /* NULL: no curves */
    const kempe_table *earlier;        /* of another run, whose curves are behind; NULL: none */
    const char *x;                     /* the column that curves are over */
    bool logarithmic;                  /* over a logarithmic x */
    bool scattered;                    /* rows are points in any order, not a curve */
    bool locked;                       /* rates may grow without bound in the last row: no part of extreme values */
    const kmp_page_join *joins;        /* of scattered rows, how each is joined to the one before; NULL: not at all */
    const char *first[KMP_PAGE_FIRST]; /* columns whose curves are drawn at first */
    int requested;                     /* columns of a run that its model requests */
    int first_count;
    int left_out; /* outputs that are not in the table */
} kmp_page_curves;

/** The loads of joints and of their bearings; NULL: none. */
typedef struct kmp_page_loads {
    kempe_table *reactions, *bearings;
    double peaks[2]; /* the times between which reactions are the largest of the motion; equal: of rows */
} kmp_page_loads;

/** Runs over time; tables without rows are not shown. */
typedef struct kmp_page_motion {
    int record_count;
    kmp_record *records;
    const kempe_trajectory *run; /* the run of the first record, whose contacts and wheels are drawn; NULL: none */
    kempe_comfort *comfort;      /* of that run; NULL: none */
} kmp_page_motion;

typedef struct kmp_page_picture {
    const kmp_samples *frames; /* NULL: no picture */
    const double *x;           /* of each frame; NULL: their times */
    kmp_picture_forces arrows;
    bool separate;      /* frames are states with no motion between them */
    kmp_samples states; /* the frames of kmp_page_add_frames */
    double *zero;       /* n + m: their rates and multipliers, which pictures do not use */
    kmp_record start;   /* a run only for the frames, or its start */
} kmp_page_picture;

/** A page while it is made, with all that it refers to. */
typedef struct kmp_result_page {
    const kempe_system *system;
    kempe_system *own; /* the same, made for the page; NULL: the result has it */
    kempe_context *context;
    kmp_arena arena;
    kmp_json data;        /* an open object */
    kempe_status verdict; /* of the function that has written the page */
    kmp_page_head head;
    kmp_page_curves curves;
    kempe_statistics *statistics; /* of an ensemble; NULL: none */
    kmp_page_loads loads;
    kmp_page_motion motion;
    kmp_page_picture picture;
} kmp_result_page;

/** Its sections, and the scripts after the scripts of all pages. */
typedef struct kmp_page_view {
    const char *const *sections;
    const char *const *const *scripts;  /* in order, NULL ends them */
    void (*put)(kmp_result_page *page); /* puts the data that the page was filled with; NULL: none */
} kmp_page_view;

/** A row of the table of pages. */
typedef struct kmp_page_kind {
    const char *command, *title; /* "simulate"; of the title: "MODEL: TITLE" */
    const kmp_page_view *view;
    kempe_status (*fill)(kmp_result_page *page, const void *result);
} kmp_page_kind;

/** Writes a page whole or not at all. system NULL: `fill` makes a separate one. KEMPE_E_IO: the path cannot be
 * written; KEMPE_E_MEMORY; errors of `fill`. */
kempe_status kmp_page_write(const kmp_page_kind *kind, kempe_context *context, const kempe_system *system,
                            const void *result, const char *path);

/** The page belongs to a system, which may be its own. */
kempe_status kmp_page_take(kmp_result_page *page, const kempe_system *system);

/** Sets the end of the study, and the line above the answer: these words and the size of the system. */
void kmp_page_set_outcome(kmp_result_page *page, kempe_outcome outcome, const char *reason, const char *warnings,
                          const char *words);

/** Frames at x, or by their number (NULL). */
kempe_status kmp_page_add_frames(kmp_result_page *page, int count, const double *q, ptrdiff_t stride, const double *x);
