/* SPDX-License-Identifier: BSD-3-Clause */
/* Where equations are evaluated, and programs of expressions that are evaluated there. */
#ifndef KMP_INTEGRATORS_RUN_INSTANT_H
#define KMP_INTEGRATORS_RUN_INSTANT_H

#include "backend/x86/machine.h"
#include "constraints/evaluation/plant.h"
#include "dynamics/equations.h"

/** Lambda and mu have m entries, mu may be NULL when nothing depends on it. */
typedef struct kmp_instant {
    double t;
    const double *q, *qd, *qdd, *lambda, *mu;
    const double *mode;  /* of the conditions, NULL when there are none */
    const double *chart; /* of the spherical joints, and how often they have changed */
    long chart_version;
} kmp_instant;

/** A state of the plant, whose conditions and charts are as they are now. */
kmp_instant kmp_instant_of(const kmp_plant *plant, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda);

/** A non-zero of a matrix: output `source` of a program stands at (row, col) of its block. */
typedef struct kmp_tangent {
    int block, row, col, source;
} kmp_tangent;

/** The outputs of a program, and where they stand in matrices. Zeroed at first; `failed` is sticky: no memory. */
typedef struct kmp_listing {
    kmp_ref *output;
    kmp_tangent *entry;
    int output_count, output_room, count, room;
    bool failed;
} kmp_listing;

/** A further output; its number, -1 on failure. */
int kmp_listing_add(kmp_listing *listing, kmp_ref r);

/** An output that is there stands at a place; source < 0: none does. */
void kmp_listing_place(kmp_listing *listing, int block, int row, int col, int source);

/** A further output at a place, unless it is zero. */
void kmp_listing_put(kmp_listing *listing, int block, int row, int col, kmp_ref r);

/** J qdd + jdqd of a row. */
kmp_ref kmp_equations_curve(const kmp_equations *eq, int row);

/** A program of one stage behind its constants, and what runs it. */
typedef struct kmp_formulas {
    kmp_program *program;
    kmp_machine *machine;
    long charts; /* version of the charts that it has; -1: none */
} kmp_formulas;

/** false: no memory. */
bool kmp_formulas_init(kmp_formulas *formulas, kmp_graph *graph, int count, const kmp_ref *output,
                       const kmp_backend *backend, const double *parameters);
void kmp_formulas_free(kmp_formulas *formulas);

/** Parameters have these values now. */
void kmp_formulas_renew(kmp_formulas *formulas, const double *parameters);

/** Takes an instant; all outputs there, and with further inputs at the last one. Valid until the next call; no
 * allocation. */
void kmp_formulas_place(kmp_formulas *formulas, const kmp_instant *at);
const double *kmp_formulas_at(kmp_formulas *formulas, const kmp_instant *at);

#endif
