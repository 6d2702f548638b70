/* SPDX-License-Identifier: BSD-3-Clause */
/* The start of joints with clearance, as in the mechanism without it. Lengths l(q) over their clearances are zero
 * where a joint is centred. Rates: J qd + h_t = 0 and G qd = 0, G = dl/dq, by the least change of rates that are not
 * given. A joint whose G qd = 0 contradicts given rates, or joints before it, keeps the rates that it has without this.
 * Positions: only where a joint is farther from its centre than its contact could let it be, h = 0 and l = 0 from
 * there.
 *
 * With z = S^2 G' projected onto J z = 0 by least changes, S the scales of free coordinates, the change is the sum of z
 * mu with G z mu = -G qd. */
#pragma once

#include "backend/machine.h"
#include "base/arena.h"
#include "constraints/closing/close.h"

typedef enum kmp_loose_start {
    KMP_LOOSE_OWN, /* with separate rates in its bearing */
    KMP_LOOSE_REST /* as without clearance */
} kmp_loose_start;

typedef struct kmp_loosening {
    const kempe_system *s;
    kmp_closer *closer; /* not owned: least changes, whose held coordinates the caller sets */
    kmp_machine *machine;
    kmp_arena arena;
    int count;                       /* lengths */
    int *force;                      /* count: the element of each */
    double *length, *slope, *change; /* count; count x n: G over the size of its rows, z */
    double *size;                    /* count: of the rows of G, scaled */
    double *matrix, *right, *mu;     /* for sets of lengths */
    double *trial, *room;            /* n; m */
    int *taken;                      /* count: lengths that are met */
} kmp_loosening;

/** Allocates all; without joints with clearance nothing, and `count` is 0. False: no memory. Later the arena has failed
 * where memory did not suffice. */
bool kmp_loosening_init(kmp_loosening *loose, const kempe_system *system, kmp_closer *closer);
void kmp_loosening_free(kmp_loosening *loose);

/** Moves q (n), closed, to the place at which all joints are centred, if one is outside its bearing, with the
 * coordinates of `hold` fixed, which the closer has too. False: it stays, because none is outside, or there is no such
 * place. */
bool kmp_loosening_center(kmp_loosening *loose, const bool *hold, double *q);

/** Adds to consistent rates qd (n) at q the change that lets joints rest; `fixed` (n) stay, which the closer has too.
 * `start` (by forces): of the loose ones. Returns true if rates of a mechanism that moves follow from this. */
bool kmp_loosening_rest(kmp_loosening *loose, const bool *fixed, const double *q, double *qd, kmp_loose_start *start);
