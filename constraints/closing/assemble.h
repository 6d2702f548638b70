/* SPDX-License-Identifier: BSD-3-Clause */
/* Assembly: closes the loops from the model's guess and makes rates consistent. Goals: the sum of weight ((x - goal) /
 * scale)^2 is minimised along the closed positions, starting from the position assembled from the guess. */
#pragma once

#include "base/arena.h"
#include "constraints/closing/loose_start.h"
#include "dynamics/system.h"
#include <kempe/check.h>

typedef enum kmp_goals_end {
    KMP_GOALS_NONE,    /* no goals, or open loops */
    KMP_GOALS_MINIMUM, /* a local minimum along the closed positions */
    KMP_GOALS_SINGULAR /* ended before a minimum: at a position where the closures lose rank, or after too many steps */
} kmp_goals_end;

typedef struct kmp_goals_verdict {
    kmp_goals_end end;
    int count;       /* number of values with a goal: one per coordinate, three per point, in the order of the model */
    double *value;   /* count: the value reached, rad or m */
    double distance; /* root of the weighted sum of squares */
    double slope;    /* gradient of half the squared distance along the closed positions, over the gradient of all
                        directions */
    int steps;
} kmp_goals_verdict;

/** The equilibrium at which a start is (base/wings.h); its texts belong to the assembly. */
typedef struct kmp_start_balance {
    const char *stability; /* stable, neutral, unstable, undecided */
    const char *title;     /* "at the equilibrium that its start leads to: stable" */
    const char *remarks;   /* sentences, one per line: what of the given start does not count, and what moves on */
    int growing;           /* motions that grow */
    bool moves;            /* some coordinate has a rate */
    int idle_count, *idle; /* coordinates that nothing depends on: they are where the loops were closed */
    double rate;           /* the largest real part of an eigenvalue, 1/s; NaN: none is known */
    double residual;       /* relative */
} kmp_start_balance;

struct kempe_assembly {
    const kempe_system *system;
    kmp_arena arena;
    double *q, *qd;  /* n */
    double residual; /* max |h| / row scale */
    double gap;      /* widest gap of a closure, m */
    double turn;     /* widest angle of one, rad */
    bool closed;
    bool turned;    /* not closed: axes that should be parallel are turned by more than a right angle */
    bool *dropped;  /* m: if closed: rows that stay open, redundant but for rounding */
    double *open;   /* m: scaled |h| */
    double *pivots; /* m + n: pivots of J at q */
    int drives;     /* not closed: rows of drives, and the motions that the other rows leave to them */
    int freedoms;
    double misfit;      /* the widest of the dropped rows, scaled */
    bool deformed;      /* deformations that hold at the start took part: the loops do not close only by joints */
    bool unstable;      /* deformations are in balance with loads at which a body buckles */
    bool rates_changed; /* the given rates contradict the closures: they were corrected */
    double rates_left;  /* part of the prescribed rates that the closures do not allow, over the fastest scaled rate */
    bool centred;       /* a joint with clearance was outside its bearing: all were centred */
    bool rested;        /* rates follow from joints with clearance that start as without it */
    kmp_loose_start *loose; /* by forces: start of the rows that are joints with clearance */
    int iterations;
    double *gaps;  /* gap of each closure, m, in the order of the model */
    double *turns; /* its angle, rad: where it aligns axes, of the rotation between them; otherwise of its rows without
                    * a length */
    int *culprits; /* closures that remain open, the largest extent first */
    int culprit_count;
    double *moved;            /* n: displacement of each coordinate from the guess */
    double *held_q, *held_qd; /* n: the closed state from which deformations moved into balance; NULL: none has moved */
    bool *stays;              /* n: then, the independent coordinates that stayed */
    int searched; /* a coordinate, from 1, of loops without a start value that wide random starts have closed; 0: none
                   */
    double *inner_q, *inner_qd, *chart; /* the state in the charts in which it was found; NULL: in the user's own */
    kmp_goals_verdict goals;
    const kmp_start_balance *balance; /* NULL: it is where the loops were closed */
    const char *ended; /* of kempe_assembly_new: the condition by which a run would end there; NULL: none */
};

/* kempe_assembly_new and kempe_assembly_free are public (kempe.h). */

/** Start of an assembly and the fixed coordinates. */
typedef struct kmp_guess {
    const double *q;  /* n */
    const bool *hold; /* n */
    int pushes;       /* number of random perturbations if it stalls with h open */
    bool goals;       /* the model's goals are sought after closing */
    int rank; /* rank of J if its other rows stay open by rounding of the model's numbers; 0: the system's own */
} kmp_guess;

/** Assembles from any guess without a message; the assembly says if it closed. Errors: only memory. */
kempe_status kmp_assemble_from(const kempe_system *system, const kmp_guess *guess, kempe_assembly **assembly);
