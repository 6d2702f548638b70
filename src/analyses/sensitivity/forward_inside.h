/* SPDX-License-Identifier: BSD-3-Clause */
/* The formulation of a motion with sensitivities, for forward.c and its parts.
 *
 * Unknowns: u and its sensitivities, p each, then ud and its, then the integral and its; near a rank loss of J, in a
 * zone, all n coordinates in place of u. Its parts are what the motion carries over a change of the unknowns' meaning:
 * the place, the times of events, next values of states, the event of the run, delayed signals.
 *
 * A motion without sensitivities has columns of them only while it passes an event or a change of unknowns:
 * by the parameters and by the state before, in further unknowns (forward_map.c). */
#pragma once

#include "analyses/derivatives/varied_lanes.h"
#include "analyses/sensitivity/forward.h"
#include "analyses/sensitivity/forward_events.h"
#include "analyses/sensitivity/forward_place.h"
#include "analyses/sensitivity/forward_requirements.h"
#include "analyses/sensitivity/forward_resets.h"
#include "analyses/sensitivity/forward_times.h"
#include "base/arena.h"
#include "constraints/tolerances.h"
#include "integrators/formulations/formulation.h"

typedef struct kmp_forward_delays kmp_forward_delays;
typedef struct kmp_forward_changes kmp_forward_changes;
typedef struct kmp_forward_mapping kmp_forward_mapping;

/** This judges the choice of u: it is good while it is well conditioned, and no step has jumped over a dead centre. */
typedef struct kmp_forward_choice {
    int *signs;    /* of the blocks of Jv at the last step */
    bool crossed;  /* a step has been refused since, because they differ */
    double growth; /* of dv/du */
    bool due;      /* other coordinates are taken before the next step */
} kmp_forward_choice;

/** All coordinates as unknowns. */
typedef struct kmp_forward_zone {
    bool now;
    int *every;            /* 0 .. n - 1 */
    double *su, *sud, *ud; /* p: the rows of u among the unknowns */
} kmp_forward_zone;

typedef struct kmp_forward_formulation {
    kmp_formulation formulation; /* first */
    kmp_arena arena;
    kmp_sensitivity_equations *v;
    kmp_evaluator *own; /* of v, while the runner's is lent */
    const kmp_forward *options;
    const kempe_system *system;
    const double *sizes;
    kmp_formulation_start start; /* of the current formulation */
    int n, m, p;
    int count, most; /* columns of sensitivities now; with room */
    int integrals;   /* the last of the unknowns */
    int width;       /* of the coordinates that are unknowns */
    int redundant;   /* rows */
    bool begun, own_angles;
    bool *watched;                   /* coordinates that events may depend on */
    bool in_lanes;                   /* the last state is the last lane's, without accelerations */
    double *mode;                    /* conditions at the end of the last step */
    double *matrix;                  /* 2 p x 2 p */
    double *held;                    /* columns x m: v->held */
    double *own_chart;               /* of the user's coordinates */
    const double *row_y;             /* unknowns of the last whole row */
    double *dqdd, *dlambda, *dshown; /* a row's, by all columns */
    kmp_forward_zone zone;
    kmp_forward_choice choice;
    kmp_forward_place place;
    kmp_event_times times;
    kmp_forward_resets resets;
    kmp_forward_event event;
    kmp_forward_terms terms;
    kmp_forward_changes *changes;
    kmp_forward_delays *delays;   /* NULL without delayed signals or derivatives */
    kmp_forward_mapping *mapping; /* NULL: the motion has sensitivities, or has not begun */
} kmp_forward_formulation;

static inline int kmp_forward_blocks(const kmp_forward_formulation *f)
{
    return f->width * (1 + f->count);
}

static inline kmp_evaluator *kmp_forward_eval(const kmp_forward_formulation *f)
{
    return f->v->linear.eval;
}

/** Rounding of a derivative of coordinate i in the sizes of its terms at an event, over the size of a parameter. */
static inline double kmp_forward_rounding(const kmp_forward_formulation *f, int i)
{
    return KMP_SLOPE_ROUNDED / KMP_SLOPE_LOOSE * f->system->scale[i];
}

/** The coordinates that are unknowns. */
static inline const int *kmp_forward_unknowns(const kmp_forward_formulation *f)
{
    return f->zone.now ? f->zone.every : f->v->linear.part.u;
}

static inline size_t kmp_forward_chart_bytes(const kmp_forward_formulation *f)
{
    return (size_t)(KMP_CHART_SIZE * f->system->chart_count) * sizeof(double);
}

static inline size_t kmp_forward_mode_bytes(const kmp_forward_formulation *f)
{
    return (size_t)f->system->events.count * sizeof(double);
}

/** True if condition k differs there. The branch of a kink is none: nothing jumps with it. */
static inline bool kmp_forward_mode_differs(const kmp_forward_formulation *f, int k, const double *mode)
{
    return !f->system->events.condition[k].kink && (f->mode[k] != 0) != (mode[k] != 0);
}

/* -- forward.c ------------------------------------------------------------------------------------------ */

/** Makes room for columns. False: no memory. */
bool kmp_forward_make_columns(kmp_forward_formulation *f, int most);

/** The first condition that differs there; -1: none. */
int kmp_forward_first_other_mode(const kmp_forward_formulation *f, const double *mode);

/** Takes the state at (t, y), with the data of small changes unless linear.plain. KMP_GO or KMP_RETRY. */
int kmp_forward_come_to(kmp_forward_formulation *f, double t, const double *y);

/** Takes the state at (t, y), `whole` with the data of small changes. KMP_HALT: the reason is reported. */
int kmp_forward_stand_at(kmp_forward_formulation *f, double t, const double *y, bool whole);

/** The response at the last state to parameter k, with sensitivities from unknowns y: kmp_sensitivity_equations_follow.
 */
void kmp_forward_follow(kmp_forward_formulation *f, const double *y, int k, double *dq, double *dqd, double *dqdd,
                        double *dlambda);

/** Chooses other independent coordinates at the place, in the evaluator's state: as many, again, which may be the same:
 * `others`. */
int kmp_forward_choose_anew(kmp_forward_formulation *f, double *y, bool *others);
