/* SPDX-License-Identifier: BSD-3-Clause */
/* Common definitions of the parts of a motion with sensitivities. forward.c makes the formulation, gives its rows and
 * runs it, forward_ode.c has its unknowns and their ODE, forward_change.c changes unknowns, conditions and charts.
 *
 * Unknowns: u and its sensitivities, p each, then ud and its, then the integral and its. The place is a state with all
 * of its sensitivities, stored before the unknowns change their meaning. */
#pragma once

#include "base/arena.h"
#include "integrators/formulations/formulation.h"
#include "studies/sensitivity/forward.h"

typedef struct kmp_forward_delays kmp_forward_delays;

typedef struct kmp_forward_formulation {
    kmp_formulation formulation; /* first */
    kmp_arena arena;
    kmp_varied *v;
    kmp_evaluator *own; /* of v, while the runner's is lent */
    const kmp_forward *options;
    const kempe_system *system;
    const double *sizes;
    kmp_formulation_start start;   /* of the current formulation */
    int n, m, p, count, integrals; /* the last of the unknowns */
    int redundant;                 /* rows */
    int width, *every;             /* of the coordinates that are unknowns: p, in a zone n; 0 .. n - 1 */
    double growth;
    bool begun, due, crossed, zone, own_angles;
    double t;                        /* of the place that is kept between two formulations or charts: */
    double *chart, *q, *qd;          /* all charts; n */
    double *dq, *dqd;                /* count x n */
    double *tail;                    /* integrals */
    double *dqdd, *dlambda, *dshown; /* a row's, by all parameters */
    const double *row_y;             /* unknowns of the last whole row */
    double *matrix;                  /* 2 p x 2 p */
    int *signs, *signs_now, *old_u;
    double *old_q, *old_y, *old_chart; /* n; 2 p; charts: before a mark */
    double *mode, *new_mode;           /* conditions: before, and after */
    double *next_mode;
    bool *cause;
    double *su, *sud, *ud;               /* p: rows of u of a zone's unknowns */
    int swing_size;                      /* count; in a run alone 2 n + parameters: how t_e depends on q, qd and them */
    double *before, *swing;              /* p; swing_size: dt_e/dp */
    double *changes, *along, *new_chart; /* conditions; charts */
    double *swings, *swung_t;   /* conditions x swing_size: dt_e/dp of each where it changed last, and that time */
    int *swung_by;              /* by conditions: the one whose change took it along; -1: an input's jump */
    int samples, resets;        /* states with next values; times that some took them since the last start */
    bool *taken, missed;        /* of each time, by states; there was no room for a time */
    int *cause_of;              /* of each time, by states: the condition; -1: a sample */
    int reset_cause;            /* as in kmp_varied_reset */
    double *next, *next_y;      /* by states: derivatives of next values; 2 p: of kmp_varied_reset */
    kmp_forward_delays *delays; /* NULL without delayed signals or derivatives */
} kmp_forward_formulation;

static inline int kmp_forward_blocks(const kmp_forward_formulation *f)
{
    return f->width * (1 + f->count);
}

/* A run takes next values once more than it has states at a time, and twice at its start. */
static inline int kmp_forward_most_resets(const kmp_forward_formulation *f)
{
    return f->samples + 4;
}

/* The coordinates that are unknowns. */
static inline const int *kmp_forward_unknowns(const kmp_forward_formulation *f)
{
    return f->zone ? f->every : f->v->linear.part.u;
}

static inline kmp_evaluator *kmp_forward_eval(const kmp_forward_formulation *f)
{
    return f->v->linear.eval;
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

/** The first condition that differs there; -1: none. */
static inline int kmp_forward_first_other(const kmp_forward_formulation *f, const double *mode)
{
    for (int k = 0; k < f->system->events.count; k++)
        if (kmp_forward_mode_differs(f, k, mode))
            return k;
    return -1;
}

/* -- unknowns (forward_ode.c) ------------------------------------------------------------------------ */

/** Makes y, weights and the ODE of the formulation for the current p or n unknowns. False: no memory. */
bool kmp_forward_make_unknowns(kmp_forward_formulation *f);

/** Takes the state at (t, y), with the data of small changes unless linear.plain. KMP_GO or KMP_RETRY. */
int kmp_forward_come_to(kmp_forward_formulation *f, double t, const double *y);

/** Takes the state at (t, y), `whole` with the data of small changes. KMP_HALT: the reason is reported. */
int kmp_forward_stand_at(kmp_forward_formulation *f, double t, const double *y, bool whole);

/** The response at the last state to parameter k, with sensitivities from unknowns y: kmp_varied_follow. */
void kmp_forward_follow(kmp_forward_formulation *f, const double *y, int k, double *dq, double *dqd, double *dqdd,
                        double *dlambda);

/** y, except integrals, from the place. */
void kmp_forward_pack(kmp_forward_formulation *f, double *y);

/** Stores signs of Jv's blocks, predictions and conditions of the last state; checks that u is still well conditioned.
 */
void kmp_forward_settle(kmp_forward_formulation *f);

/** Continues from the place at t with other unknowns: y, weights and the state. */
int kmp_forward_take_up(kmp_forward_formulation *f, double t, double *y);

void kmp_forward_explain(kmp_formulation *formulation);

/* -- changes (forward_change.c) ---------------------------------------------------------------------- */

/** Puts the whole mechanism at (t, y) into the place. */
int kmp_forward_spread(kmp_forward_formulation *f, double t, const double *y);

/** Converts the place to the evaluator's charts, in which it is (q, qd). */
void kmp_forward_enter_charts(kmp_forward_formulation *f, const double *q, const double *qd);

bool kmp_forward_charts_differ(const kmp_forward_formulation *f, const double *chart);

/** The place is that before a mark; the other function: that after it. */
void kmp_forward_keep_old(kmp_forward_formulation *f);
int kmp_forward_report_mark(kmp_forward_formulation *f, double t, int condition);

/** Derivatives across next values of states that the run has noted (kmp_sample_fn): of the place, at a time that
 * depends on no parameter. */
int kmp_forward_reset_place(kmp_forward_formulation *f, double t);

int kmp_forward_renew(kmp_formulation *formulation, double t, double *y, double *yp);
int kmp_forward_resume(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y,
                       double *yp);

/** True if derivatives of two times are equal up to rounding. */
bool kmp_forward_same_swing(int count, const double *a, const double *b);

/* -- delayed signals (forward_delays.c) -------------------------------------------------------------- */

/** Makes room, where there are any. False: no memory. */
bool kmp_forward_delays_make(kmp_forward_formulation *f);
void kmp_forward_delays_free(kmp_forward_formulation *f);

/** Begins their past at the place, which has the values of the start at t; sets the derivatives of their states there.
 */
kempe_status kmp_forward_delays_begin(kmp_forward_formulation *f, double t);

/** Records the last step up to `to`. False: it cannot be evaluated. */
bool kmp_forward_delays_record(kmp_forward_formulation *f, kmp_runner *runner, double to);

/** The rates of their states' derivatives by parameter p at the last state, which is that of y, among sudd. */
void kmp_forward_delays_rates(const kmp_forward_formulation *f, const double *y, int p, double *sudd);

/** Sets the derivatives of their states in y at t. */
void kmp_forward_delays_set(kmp_forward_formulation *f, double t, double *y);

/** Notes dt/dp of a restart at t. */
void kmp_forward_delays_note(kmp_forward_formulation *f, double t, const double *swing);

/** dt/dp where delayed signals jump at t; NULL: none does. KMP_HALT: several do, at different times. */
int kmp_forward_delays_jump(kmp_forward_formulation *f, double t, const double **swing);

/** Puts their states (of qd) and derivatives along a time with f->swing into the place. */
void kmp_forward_delays_pass(kmp_forward_formulation *f, double t, const double *qd);
