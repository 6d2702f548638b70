/* SPDX-License-Identifier: BSD-3-Clause */
/* The equations of motion of deformations, with other independent coordinates held and dependent ones following: rows
 * X' (M qdd + C) at given accelerations, and their derivatives by the deformations. */
#pragma once

#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/tangent.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/reduction.h"

/** The wished independent coordinates, and the closed state at which they are chosen. */
typedef struct kmp_deformation_choice {
    const bool *moves; /* n: the deformations */
    const bool
        *liked; /* n: others that are independent if possible; NULL: coordinates that hold or have a given start */
    const bool *left_out; /* m: rows of h that count as none; NULL: none */
    bool rests;           /* loads are taken at rest: without rates, except of states, and without accelerations */
    double t;
    const double *q, *qd; /* n */
} kmp_deformation_choice;

typedef struct kmp_deformation_rows {
    const kempe_system *s;
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_reduction red;
    kmp_tangents tangents;
    kmp_arena arena;
    bool rests;                  /* as chosen */
    int count;                   /* deformations that are independent */
    int *in_u;                   /* count: their places in u */
    double t;                    /* 0, unless it is set */
    double *q;                   /* n: the state; its dependent coordinates are closed where rows are taken */
    double *qd;                  /* n: of the last rows */
    double *ud, *udd;            /* p: rates, and accelerations, zero unless they are set */
    double *rest;                /* count: the rows at q */
    double *slope;               /* count x count, by columns */
    const double *d;             /* values of the tangents since kmp_deformation_rows_slope */
    double *all, *unit;          /* room: p; p, zeros */
    double *qdd, *lambda, *room; /* room: n, m; of small changes */
} kmp_deformation_rows;

/** Chooses u with an evaluator. KEMPE_E_FAILED, KEMPE_E_MEMORY, with the message. */
kempe_status kmp_deformation_rows_choose(kmp_partition *part, kmp_evaluator *eval,
                                         const kmp_deformation_choice *choice);

/** KEMPE_E_FAILED, KEMPE_E_MEMORY, with the message; free it also then. */
kempe_status kmp_deformation_rows_init(kmp_deformation_rows *x, const kempe_system *system,
                                       const kmp_deformation_choice *choice);

/** Rows of the shapes of all flexible bodies, together with independent coordinates that hold or have a given start.
 * KEMPE_E_FAILED, without a message: there are none, or no such coordinates; KEMPE_E_MEMORY. Then there is nothing to
 * free. */
kempe_status kmp_deformation_rows_of_shapes(kmp_deformation_rows *x, const kempe_system *system, const double *q,
                                            const double *qd);
void kmp_deformation_rows_free(kmp_deformation_rows *x);

/** The k-th deformation, as a coordinate. */
int kmp_deformation_rows_coordinate(const kmp_deformation_rows *x, int k);

/** The rows at q. False: it does not close, or a number is not finite. */
bool kmp_deformation_rows_at(kmp_deformation_rows *x, double *q, double *rows);

/** Accelerations (n) and multipliers (m) of the last rows. */
void kmp_deformation_rows_loads(kmp_deformation_rows *x, double *qdd, double *lambda);

/** Derivatives of the rows at x->q, where the last rows come from kmp_deformation_rows_at. False: a number is not
 * finite. */
bool kmp_deformation_rows_slope(kmp_deformation_rows *x);
