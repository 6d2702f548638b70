/* SPDX-License-Identifier: BSD-3-Clause */
/* The place of an evaluation, and programs of expressions evaluated there. */
#pragma once

#include "backend/machine.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/equations.h"
#include "model/data/force.h"

/** Lambda and mu have m entries, mu may be NULL when nothing depends on it. */
typedef struct kmp_instant {
    double t;
    const double *q, *qd, *qdd, *lambda, *mu;
    const double *mode;  /* of the conditions, NULL without conditions */
    const double *chart; /* of the spherical joints, and the number of their changes */
    long chart_version;
    const kmp_present_inputs *inputs; /* NULL: of a model without inputs */
} kmp_instant;

/** The vector KMP_IN_TIME there. */
static inline const double *kmp_instant_times(const kmp_instant *at)
{
    return at->inputs ? kmp_present_inputs_at(at->inputs, at->t) : &at->t;
}

/** A state with the evaluator's present conditions and charts. */
kmp_instant kmp_instant_of(const kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                           const double *lambda);

/** A non-zero of a matrix: output `source` of a program is entry (row, col) of its block. */
typedef struct kmp_tangent {
    int block, row, col, source;
} kmp_tangent;

/** The outputs of a program, and their places in matrices. Zero initially; `failed` is sticky: no memory. */
typedef struct kmp_listing {
    kmp_ref *output;
    kmp_tangent *entry;
    int output_count, count;
    bool failed;
} kmp_listing;

/** Adds an output; returns its number, -1 on failure. */
int kmp_listing_add(kmp_listing *listing, kmp_ref r);

/** Gives an existing output a place in a block; source < 0: does nothing. */
void kmp_listing_place(kmp_listing *listing, int block, int row, int col, int source);

/** Adds an output at a place, unless it is zero. */
void kmp_listing_put(kmp_listing *listing, int block, int row, int col, kmp_ref r);

/** A program of one stage after its constants, and its machine. */
typedef struct kmp_formulas {
    kmp_program *program;
    kmp_machine *machine;
    long charts; /* version of the charts in the constants; -1: none */
} kmp_formulas;

/** Makes the program; false: no memory. */
bool kmp_formulas_init(kmp_formulas *formulas, kmp_graph *graph, int count, const kmp_ref *output,
                       const kmp_backend *backend, const double *parameters);
/** Makes the machine of a program that is there; false: no memory, or no program. */
bool kmp_formulas_prepare(kmp_formulas *formulas, const kmp_backend *backend, const double *parameters);
void kmp_formulas_free(kmp_formulas *formulas);

/** Takes new values of the parameters. */
void kmp_formulas_renew(kmp_formulas *formulas, const double *parameters);

/** Takes an instant; evaluates all outputs there, or with further inputs at the last instant. Valid until the next
 * call; no allocation. */
void kmp_formulas_place(kmp_formulas *formulas, const kmp_instant *at);
const double *kmp_formulas_at(kmp_formulas *formulas, const kmp_instant *at);
