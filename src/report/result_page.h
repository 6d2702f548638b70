/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of a result: what came out in words, the mechanism moving, curves of its table with their extreme values,
 * the run's accuracy, parameters and the text of the model. Studies differ in what they have of it. */
#pragma once

#include "report/step_record.h"
#include <kempe/comfort.h>
#include <kempe/ensemble.h>
#include <kempe/vehicle.h>

/** A number with a name, in words. */
typedef struct kmp_page_fact {
    const char *name, *value;
} kmp_page_fact;

enum { KMP_PAGE_FACTS = 6, KMP_PAGE_FIRST = 20 };

/** The line from a row to the next one in a diagram. */
typedef enum kmp_page_join { KMP_JOIN_NONE, KMP_JOIN_SOLID, KMP_JOIN_DASHED } kmp_page_join;

typedef struct kmp_result_page {
    const kempe_system *system;
    const char *command, *subject; /* "simulate"; of the title */
    const char *scene;             /* next to the name of the model */
    const char *answer;            /* the result in a few words */
    kempe_outcome outcome;
    bool locked;                   /* rates may grow without bound in the last row: no part of extreme values */
    const char *reason, *warnings; /* "" and NULL: none; one a line */
    const char *sentences;         /* further ones, one a line; NULL: none */
    kmp_page_fact fact[KMP_PAGE_FACTS];
    int fact_count;
    const char *text;           /* the printed result */
    const kempe_table *table;   /* NULL: no curves */
    const char *x;              /* the column that curves are over */
    bool logarithmic;           /* over a logarithmic x */
    bool scattered;             /* rows are points in any order, not a curve */
    const kmp_page_join *joins; /* of scattered rows, how each is joined to the one before; NULL: not at all */
    const char *const *first;   /* columns whose curves are drawn at first */
    int first_count;
    int left_out;                       /* outputs that are not in the table */
    const kmp_samples *frames;          /* NULL: no picture */
    bool separate;                      /* frames are states with no motion between them */
    const double *frame_x;              /* x of each frame; NULL: their times */
    const kmp_record *record;           /* NULL: none */
    const kempe_statistics *statistics; /* of an ensemble; NULL: none */
    const kempe_comfort *comfort;       /* of that run; NULL: none */
    const kempe_trajectory *contacts;   /* the run whose contacts are drawn, by the rows of the record; NULL: none */
} kmp_result_page;

/** Writes whole or not at all. KEMPE_E_IO, KEMPE_E_MEMORY. */
kempe_status kmp_result_page_write(const kmp_result_page *page, const char *path);
