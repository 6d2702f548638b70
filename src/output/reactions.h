/* SPDX-License-Identifier: BSD-3-Clause */
/* The reactions of a mechanism: the forces and moments of the constraints of all its joints, of the tree and cut, of
 * its loops, and the efforts of drives, each with its largest value over the rows of a result. simulate, inverse and
 * equilibrium have them from here, as text, JSON and table. */
#pragma once

#include "base/json.h"
#include "constraints/diagnosis/shared_loads.h"
#include "output/samples.h"
#include <kempe/table.h>

/** The largest value of a force or a moment: its size, and when it is reached first, with the vector there. */
typedef struct kmp_reaction_peak {
    double size, t, x[3]; /* NaN: the joint has none */
} kmp_reaction_peak;

/** Takes a size with its vector of `count` numbers, 1 or 3, if it is larger. */
void kmp_reaction_peak_take(kmp_reaction_peak *peak, double t, double size, const double *x, int count);

typedef struct kmp_reaction {
    const char *name, *kind; /* "joint": of the tree; otherwise the word of a closure */
    int body, closure;       /* whose it is; -1: of the other, or of a tyre */
    int place;               /* of its load in kmp_all_loads; -1: it is not known */
    bool has[2], effort;     /* a force, a moment; effort: one number along coordinates, x[0] */
    kmp_reaction_peak peak[2];
    unsigned shared;  /* components that are not unique, a bit each */
    const char *note; /* why it is not known, or what it is without; NULL: nothing */
} kmp_reaction;

typedef struct kmp_reactions {
    const kempe_system *system;
    kmp_reaction *of;
    int count, rows, loads; /* loads: numbers of kmp_all_loads */
    bool unexamined;        /* which of them are unique, because that takes too long */
    bool least_norm;        /* of the reactions that are not unique */
    const char *instead;    /* why they belong to one solution, although the loads of least norm were requested; NULL */
    bool whole;             /* the largest ones are of the motion from `from` to `until`, not only of rows */
    double from, until;
    double *last;           /* the loads of the last row */
    double *kept;           /* of all rows, `loads` each; NULL: they are not kept */
    const char *not_unique; /* "A: z, mx; C: mx"; "": all are unique */
    kmp_arena arena;
} kmp_reactions;

/** Lists the joints; `drives`: with the efforts of drives. KEMPE_E_MEMORY. */
kempe_status kmp_reactions_init(kmp_reactions *reactions, const kempe_system *system, const kmp_all_loads *loads,
                                bool drives);
void kmp_reactions_free(kmp_reactions *reactions);

/** Names the joints of a model that have a force or a moment which its equations give, without efforts of drives; room
 * for body_count + closure_count. Their number. */
int kmp_reactions_name(const kempe_model *model, bool moment, const char **names);

/** Takes the loads of a row, as kmp_all_loads_at gives them. */
void kmp_reactions_add(kmp_reactions *reactions, double t, const double *loads);

/** The size of the force (k = 0) or the moment (k = 1) of a joint with a known place, in the loads of an instant. */
double kmp_reaction_size(const kmp_reaction *of, int k, const double *loads);

/** Takes the loads of an instant between rows. */
void kmp_reactions_meet(kmp_reactions *reactions, double t, const double *loads);

/** Shares loads of an instant, KMP_LOAD_VALUES of each closure and joint, by least norm if that is requested and
 * possible; otherwise keeps the reason. KEMPE_E_MEMORY. */
kempe_status kmp_reactions_share(kmp_reactions *reactions, kmp_evaluator *eval, const kmp_all_loads *loads,
                                 const kmp_instant *at, double *values);

/** The largest ones of the whole motion between two times take the place of the ones of rows. */
void kmp_reactions_take_whole(kmp_reactions *reactions, const kmp_reactions *whole);

/** Marks what redundant constraints share. KEMPE_E_MEMORY. */
kempe_status kmp_reactions_mark(kmp_reactions *reactions, const kmp_shared_loads *shared);

/** The reactions of the rows of a run, with these steps. KEMPE_E_MEMORY. */
kempe_status kmp_reactions_of_rows(kmp_reactions *reactions, const kempe_system *system, const kmp_samples *rows,
                                   bool least_norm);

/** Likewise with the loads of each row kept, and without a search for shared ones. */
kempe_status kmp_reactions_keep_rows(kmp_reactions *reactions, const kempe_system *system, const kmp_samples *rows,
                                     bool least_norm);

/** Keeps the loads of this number of rows that are added. KEMPE_E_MEMORY. */
kempe_status kmp_reactions_keep(kmp_reactions *reactions, int rows);

/** Puts loads, KMP_LOAD_VALUES of each closure and joint, and `bearings` (NULL: none), in place of the loads among the
 * values of a model's outputs. False: one of these differs from its value in `before`, which the equations have. */
bool kmp_loads_in_outputs(const kmp_all_loads *loads, const kempe_model *model, const double *before,
                          const double *values, const double *bearings, double *shown);

/** A table of the largest ones, or of the vectors of a single row; of many joints the ones with the largest. `others`:
 * the option that shows the others; NULL: all are shown. */
void kmp_reactions_show(kmp_text *text, const kmp_reactions *reactions, const char *others);

/** The array `reactions`, as a member of an open object. */
void kmp_reactions_json(kmp_json *json, const kmp_reactions *reactions);

/** The columns of the table "reactions", and its rows; `number` >= 0: the number of the equilibrium begins each. */
void kmp_reactions_columns(kempe_table *table);
void kmp_reactions_tabulate(kempe_table *table, const kmp_reactions *reactions, int number);
