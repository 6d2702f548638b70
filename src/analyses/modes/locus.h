/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes as functions of a parameter. Eigenvalues are followed from value to value by their distance and the similarity
 * of their shapes, so that crossing curves continue correctly. The study also finds the values at which one of them
 * begins to grow. If a step is too long to identify them, intermediate values are computed. */
#pragma once

#include "analyses/derivatives/averaged.h"
#include "analyses/equilibrium/operating.h"
#include "analyses/modes/eigenmodes.h"
#include "model/data/force.h"
#include "model/data/variant.h"

/* A family of states for modes while a parameter varies: the equations are derived once, and an equilibrium is searched
 * from the last one. */

/** The options; nothing is owned. */
typedef struct kmp_operating_family_options {
    const char *name; /* a parameter, or `q.NAME`, `qd.NAME` of the start, that varies; NULL: none does */
    const char *word; /* the state (kmp_operating_new) */
    const int *wish;  /* coordinates requested as independent */
    int wish_count;
    bool spare;              /* with delays: eigenvalues beyond the shown ones are kept */
    const kmp_steady *rates; /* constant rates of an equilibrium */
    int rate_count;
    const kmp_steady *varies;     /* the one that varies; NULL: none */
    bool slides;                  /* friction that sticks has no force */
    bool warned;                  /* warnings of a steady motion were given before */
    const kmp_averaged *averaged; /* whose system it is; NULL: the system is not an averaged one */
} kmp_operating_family_options;

typedef struct kmp_operating_family {
    const kempe_system *base;
    kmp_operating_family_options options;
    kmp_variant *variant; /* NULL: nothing varies */
    kempe_system *own;    /* of the variant */
    kmp_linear linear;    /* at the last state */
    kmp_operating *state; /* the last one */
    kmp_arena arena;      /* of rates */
    kmp_steady *rates;    /* the current ones, also of a steady motion that was found; room for n */
    int rate_count;
    double *begun; /* rates of the start at the last value (n), where an equilibrium is searched from it */
    bool brief;    /* set by the caller: with delays the next modes need no bound */
} kmp_operating_family;

/** KEMPE_E_ARGUMENT: the quantity cannot be varied. */
kempe_status kmp_operating_family_new(const kempe_system *system, const kmp_operating_family_options *options,
                                      kmp_operating_family **family);
void kmp_operating_family_free(kmp_operating_family *family);

/** Goes to the state at a value of the parameter, and computes its modes. Errors as kmp_operating_new, and
 * KEMPE_E_FAILED where the model rejects the value. */
kempe_status kmp_operating_family_go(kmp_operating_family *family, double value, kmp_modes *modes);

/** q (n, in the charts of linear.eval) of the last state displaced along eigenvalue c of its modes, by `amplitude`
 * times Re(shape e^{i angle}), and closed again. 0; 1 where the loops do not close. */
int kmp_operating_family_move(kmp_operating_family *family, const kmp_modes *modes, int c, double amplitude,
                              double angle, double *q);

/** The assignment problem: the assignment of least sum, by shortest augmenting paths (Kuhn 1955, Munkres 1957; Jonker
 * and Volgenant 1987). cost[i + j*n], finite, is the cost of giving column j to row i; column[i] becomes the column of
 * row i. Among equal sums the choice is deterministic. 0; -1: no memory. */
int kmp_assign(int n, const double *cost, int *column);

/** A value at which a mode begins to grow, or ceases to. */
typedef struct kmp_critical {
    double value, re, im; /* the eigenvalue there; im >= 0 */
    int branch;
    bool grows_above;
} kmp_critical;

typedef struct kmp_locus {
    kmp_arena arena;   /* of all arrays but critical */
    int values, count; /* numbers of them */
    double *value;
    double *re, *im; /* count x values: branch b at value k is [b + k*count] */
    double *q;       /* n x values: the states, in the user's coordinates */
    double *load;    /* n x values: the loads that hold rates at these states, N or N m; NaN: none */
    double *doubt;   /* values: the doubt of the least certain step to it; above 1: uncertain */
    kmp_critical *critical;
    int critical_count;
    int reached; /* values that were reached; fewer when one failed */
} kmp_locus;

/** Computes the locus at `count` values (2 or more) of the parameter. KEMPE_E_FAILED: none could be reached.
 * KEMPE_STOPPED: some could not, or an interrupt; the locus then has the values so far, and the context the reason. */
kempe_status kmp_locus_make(kmp_operating_family *family, int count, const double *values, kmp_locus *locus);

/** True if a load holds the rate of coordinate i at one of the values. */
bool kmp_locus_has_load(const kmp_locus *locus, int n, int i);
void kmp_locus_free(kmp_locus *locus);
