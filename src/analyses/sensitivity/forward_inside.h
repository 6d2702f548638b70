/* SPDX-License-Identifier: BSD-3-Clause */
/* The formulation of a motion with sensitivities, for forward.c and its parts.
 *
 * Unknowns: u and its sensitivities, p each, then ud and its, then the integral and its. The place is a state with all
 * of its sensitivities, stored before the unknowns change their meaning.
 *
 * A motion without sensitivities has columns of them only while it passes an event or a change of unknowns:
 * by the parameters and by the state before, in further unknowns (forward_map.c). */
#pragma once

#include "analyses/derivatives/varied_lanes.h"
#include "analyses/sensitivity/forward.h"
#include "base/arena.h"
#include "constraints/tolerances.h"
#include "integrators/formulations/formulation.h"

typedef struct kmp_forward_delays kmp_forward_delays;

typedef struct kmp_forward_formulation {
    kmp_formulation formulation; /* first */
    kmp_arena arena;
    kmp_sensitivity_equations *v;
    kmp_evaluator *own; /* of v, while the runner's is lent */
    const kmp_forward *options;
    const kempe_system *system;
    const double *sizes;
    kmp_formulation_start start;   /* of the current formulation */
    int n, m, p, count, integrals; /* columns of sensitivities now; the last of the unknowns */
    int most;                      /* columns at most */
    int redundant;                 /* rows */
    int width, *every;             /* of the coordinates that are unknowns: p, in a zone n; 0 .. n - 1 */
    double growth;
    bool begun, due, crossed, zone, own_angles;
    bool in_lanes;                   /* the last state is the last lane's, without accelerations */
    double t;                        /* of the place that is kept between two formulations or charts: */
    double *chart, *q, *qd;          /* all charts; n */
    double *dq, *dqd;                /* count x n */
    double *tail;                    /* integrals */
    double *dqdd, *dlambda, *dshown; /* a row's, by all columns */
    const double *row_y;             /* unknowns of the last whole row */
    double *matrix;                  /* 2 p x 2 p */
    int *signs, *signs_now, *old_u;
    double *mode, *new_mode; /* conditions: before, and after */
    double *next_mode;
    bool *cause;
    double *su, *sud, *ud;               /* p: rows of u of a zone's unknowns */
    double *before, *swing, *kept;       /* p; count: dt_e/dp; p */
    double *changes, *along, *new_chart; /* conditions; charts */
    double *swings, *swung_t;            /* conditions x most: dt_e/dp of each where it changed last, and that time */
    double *jerk, *lambda_rate;          /* n, m: rates of accelerations and multipliers along the motion */
    double *common;                      /* count: dt_e/dp of the event that is passed */
    double integrand_before;             /* the integrand before it, and accelerations: n */
    double *qdd_before;
    double *last, last_t;           /* count: dt_e/dp of the event that was passed last, and its time */
    bool *near;                     /* conditions: the motion crosses them where an input jumps */
    double distance;                /* of the last swing: the time by which its condition is beyond zero */
    double *held;                   /* columns x m: v->held */
    double *rows, *row;             /* m; n: a row of J */
    double *span, *speed;           /* count x n: sizes of the terms of dq and dqd at an event */
    double *dq_before, *dqd_before; /* count x n: before the event, along which */
    double *pace, *pace_of_rates;   /* n: sums of sizes of rates and accelerations */
    int cause_before;               /* its condition; -1: none that depends on parameters */
    bool passing;                   /* the place is the one before an event of the run, with derivatives along it */
    int *swung_by;                  /* by conditions: the one whose change took it along; -1: an input's jump */
    int samples, resets;            /* states with next values; times that some took them since the last start */
    bool *taken, missed;            /* of each time, by states; there was no room for a time */
    int *cause_of;                  /* of each time, by states: the condition; -1: a sample */
    double sampled_t;               /* when states last took next values at a sample; `sampled`: one of them */
    int sampled;
    int reset_cause;            /* the condition at whose time states change; -1: a time that depends on no parameter */
    double *next;               /* by states: derivatives of next values */
    kmp_forward_delays *delays; /* NULL without delayed signals or derivatives */
    kmp_forward_map map;        /* of a motion without sensitivities, since the last step */
    struct kmp_forward_before *before_event; /* of it (forward_map.c) */
    double *wide;                            /* its unknowns with the columns of the map */
    double *column_size;                     /* of the quantity by which a column differentiates */
    bool mapped;                             /* the map has begun, and no step has ended since */
    bool follows;                            /* an event with states came just before it */
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
    return f->zone ? f->every : f->v->linear.part.u;
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

/** y, except integrals, from the place. */
void kmp_forward_pack(kmp_forward_formulation *f, double *y);

/** Puts the whole mechanism at (t, y) into the place. */
int kmp_forward_spread(kmp_forward_formulation *f, double t, const double *y);

/** Converts the place to the evaluator's charts, in which it is (q, qd). */
void kmp_forward_enter_charts(kmp_forward_formulation *f, const double *q, const double *qd);

bool kmp_forward_charts_differ(const kmp_forward_formulation *f, const double *chart);

/** Chooses other independent coordinates at the place, in the evaluator's state: as many, again. */
int kmp_forward_choose_anew(kmp_forward_formulation *f, double *y);
