/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives must satisfy requirements at an event (forward.h), where the motion has none otherwise: that contacts
 * strike at one time, that a closed contact keeps its distance. They are judged by the sizes of the terms of
 * derivatives there. The columns of a motion with sensitivities are its derivatives by parameters, and one that fails
 * ends the motion. The columns of a map are derivatives by parts of the state, too, by which there may be no
 * derivative: the derivatives by parameters are sums of them, which the adjoint method checks at the end. */
#pragma once

#include "base/arena.h"
#include <stdbool.h>

struct kmp_forward_formulation;

/** The terms of the derivatives of coordinates and rates along an event: those before it, and rates and accelerations
 * times dt_e/dp. */
typedef struct kmp_forward_terms {
    double *dq, *dqd;             /* columns x n: before it */
    double *span, *speed;         /* columns x n: sums of the sizes of all */
    double *pace, *pace_of_rates; /* n: sums of the sizes of rates and accelerations */
} kmp_forward_terms;

/** Makes room, once or again for other columns. False: no memory. */
bool kmp_forward_terms_make(kmp_forward_terms *terms, kmp_arena *arena, int n, int columns);

/** Begins the sums of sizes with the derivatives of the place, and with rounding of coordinates. */
void kmp_forward_begin_terms(struct kmp_forward_formulation *f);

/** Adds rates and accelerations, times `sign` and dt_e/dp, to the derivatives of the place, and the sizes of these
 * terms to the sums of sizes, at least by their rounding. */
void kmp_forward_add_terms(struct kmp_forward_formulation *f, const double *qd, const double *qdd, double sign,
                           const double *swing);

/** True if f->times.swing and f->event.swing are derivatives of one time, up to rounding. */
bool kmp_forward_have_one_time(const struct kmp_forward_formulation *f);

/** A requirement of one row of derivatives at an event. */
typedef struct kmp_forward_check {
    double *off;   /* by columns: what must vanish, */
    double *given; /* and a part of it that the coordinates do not have */
    bool rates;    /* it is one of rates, not of places */
    bool fails;    /* for some column */
} kmp_forward_check;

/** Makes `count` checks for all columns. False: no memory. */
bool kmp_forward_make_checks(const struct kmp_forward_formulation *f, kmp_arena *arena, int count,
                             kmp_forward_check **checks);

/** The part of its size to which a check vanishes. */
double kmp_forward_part(const kmp_forward_check *check);

/** A check fails for some column. Of a motion with sensitivities: ends it. Of a map: it becomes a requirement, whose
 * terms are the coordinates' times `row` (n). `reason` is a sentence of f->arena; NULL: no memory. */
int kmp_forward_require(struct kmp_forward_formulation *f, const kmp_forward_check *check, const double *row,
                        const char *reason);

/** The same of two derivatives of the time of an event, f->times.swing and f->event.swing. */
int kmp_forward_require_one_time(struct kmp_forward_formulation *f, const char *reason);
