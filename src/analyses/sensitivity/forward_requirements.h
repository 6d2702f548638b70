/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives must satisfy requirements at an event, where the motion has none otherwise: that contacts strike at one
 * time, that a closed contact keeps its distance. The columns of a motion with sensitivities are its derivatives by
 * parameters, and one that fails ends the motion. The columns of a map are derivatives by parts of the state, too, by
 * which there may be no derivative: the derivatives by parameters are sums of them, which the adjoint method checks at
 * the end. */
#pragma once

#include "analyses/sensitivity/forward_inside.h"

/** A requirement of one row of derivatives at an event. */
typedef struct kmp_forward_check {
    double *off;   /* by columns: what must vanish, */
    double *given; /* and a part of it that the coordinates do not have */
    bool rates;    /* it is one of rates, not of places */
    bool fails;    /* for some column */
} kmp_forward_check;

/** Makes `count` checks for all columns. False: no memory. */
bool kmp_forward_make_checks(const kmp_forward_formulation *f, kmp_arena *arena, int count, kmp_forward_check **checks);

/** The part of its size to which a check vanishes. */
double kmp_forward_part(const kmp_forward_check *check);

/** A check fails for some column. Of a motion with sensitivities: ends it. Of a map: it becomes a requirement, whose
 * terms are the coordinates' times `row` (n). `reason` is a sentence of f->arena; NULL: no memory. */
int kmp_forward_require(kmp_forward_formulation *f, const kmp_forward_check *check, const double *row,
                        const char *reason);

/** The same of two derivatives of the time of an event, f->swing and f->common. */
int kmp_forward_require_one_time(kmp_forward_formulation *f, const char *reason);
