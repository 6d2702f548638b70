/* SPDX-License-Identifier: BSD-3-Clause */
/* Data of a generated simulator in addition to its equations: a closed start, the choice of coordinates there, sizes,
 * and the conditions. */
#pragma once

#include "exchange/code/source.h"

/** Routines of slopes at most. */
enum { KMP_SLOPES_MOST = 4 };

struct kmp_simulated {
    int freedom;      /* n less the rank of J */
    double *q, *qd;   /* n: a closed start */
    double *given;    /* n x 2: start values of q and qd, as given */
    int *keeps;       /* n: which of these the start keeps: kempe_simulator.h */
    bool starts;      /* they depend on parameters */
    int *independent; /* freedom */
    int slopes_count; /* routines of slopes, the last ones of the source */
    struct kmp_slopes_choice {
        int *independent, *dependent, *rows; /* freedom; n - freedom each */
    } * slopes;
    double *scale, *row_scale;       /* n; m */
    double rank_tolerance;           /* of a pivot over the largest one */
    double *inputs;                  /* three an input: at the start */
    int condition_count;             /* in the order of `modes` */
    char **condition_name, **advice; /* advice: "" without one */
    int *condition_kind;             /* of kempe_simulator.h */
    struct kmp_bounds *watch;        /* bounds of the conditions; NULL: there are none */
    int watch_first;                 /* the first output that they have */
    int watch_solved;                /* unknowns of implicit blocks in conditions */
    int *watch_input;                /* what each input is, and its place: kempe_watch */
    int *watch_traits;               /* conditions */
    int *event, *sense, *settles;    /* of states with next values: kempe_simulator.h */
    int *coordinate_kind;            /* n */
    int *symbol;                     /* by position in p: the parameter of the model */
    int *fixed;                      /* by position in p: 1 where the closures depend on it */
    char **moved;                    /* inputs: the closure that each moves, "" without one */
    bool loaded;                     /* C depends on multipliers */
    bool switches;                   /* closures depend on conditions */
    bool early;                      /* conditions depend on neither accelerations nor multipliers */
    int friction_count;              /* elements of friction that sticks and of contacts: kempe_simulator.h */
    struct kmp_simulated_friction {
        int *slot, *row, *base, *across, *twin, *loaded, *sides, *unlimited, *contact;
        double *size, *regularise;
        int contacts, rolls; /* rigid contacts; rows between rates */
        bool loads, driven;
    } friction;
    int chart_count; /* spherical joints whose angles may count from another orientation */
    int *chart_first, *chart_before;
    double *chart_axes;                  /* three unit vectors each */
    char **jacobian_zeros, **mass_zeros; /* m and n strings of n characters: '0' where an entry of J or M is zero */
};

/** Prepends the routines of a simulator to a choice. */
void kmp_simulated_choose(const kempe_model *model, kmp_set_choice *choice);

/** Sets source->simulated, when all routines of a choice have been derived, and adds the routine of slopes where there
 * is one. KEMPE_E_FAILED: the loops do not close at the start. */
kempe_status kmp_simulated_find(kmp_code_source *source, const kmp_set_choice *choice);
/** Sets members that depend on the places of the parameters in p. */
kempe_status kmp_simulated_place(kmp_code_source *source);

/** The start of a system without separate equations: coordinates and their kinds, inputs. */
kempe_status kmp_simulated_start(kmp_code_source *source, const kempe_system *system);

/** A routine by name; NULL: there is none. */
const kmp_code_routine *kmp_simulated_routine(const kmp_code_source *source, const char *name);
