/* SPDX-License-Identifier: BSD-3-Clause */
/* Common interface of all integrators: made for an ODE or a DAE, started at a state, stepped, evaluated between steps.
 * A new integrator is one file with a kmp_solver_kind and a row in integrators.def. */
#pragma once

#include "base/arena.h"
#include "base/context.h"
#include "integrators/steppers/ode.h"

#include <string.h>

typedef struct kmp_solver_setup {
    kempe_context *context;
    const kmp_ode *ode; /* one of ode and dae, by `dae` of the kind */
    const kmp_dae *dae;
    kmp_tolerance tolerance;
    const char *linear; /* row of linear.def, for implicit integrators */
    double fixed_step;  /* length of all steps, without error control; 0: chosen by the error */
} kmp_solver_setup;

/** Work since creation, over all starts. */
typedef struct kmp_solver_work {
    long steps, rejected,
        refused; /* rejected by the error test; refused by the formulation or for lack of convergence */
    long rhs;    /* right-hand sides or residuals */
    long newton, matrices, factorizations;
} kmp_solver_work;

/** First member of every integrator. Its owner reads times, step and work. */
typedef struct kmp_solver {
    double t, t_old; /* ends of the last accepted step; equal before the first one after a start */
    double t_end;
    double fixed; /* length of all steps; 0: chosen by the error */
    double h;     /* the next step, for a start from the same place in other unknowns; 0: the last one */
    int hopeless; /* successive steps near the limit of resolution */
    kmp_solver_work work;
    double cycles; /* about the cycles of all work since creation, as kmp_ode counts them */
    bool stiff;    /* the last step was not limited only by accuracy */
    kempe_context *context;
    kmp_ode ode; /* one of ode and dae, by the kind */
    kmp_dae dae;
    kmp_tolerance tolerance;
    kmp_arena arena; /* of an integrator's arrays */
} kmp_solver;

/** Numbers that are counted, written or read in one order: the same calls do all three. */
typedef struct kmp_number_stream {
    double *at; /* of all; NULL: they are counted */
    size_t count;
    bool back; /* they are read */
} kmp_number_stream;

static inline void kmp_stream_numbers(kmp_number_stream *stream, int n, double *x)
{
    double *at = stream->at ? stream->at + stream->count : NULL;
    if (at && n > 0)
        memcpy(stream->back ? x : at, stream->back ? at : x, (size_t)n * sizeof *x);
    stream->count += (size_t)n;
}

/** Steps with an event that are made again up to it: steps beyond whose end the equations do not continue smoothly;
 * also at ends of compliant contacts; all that do not end the run, where the polynomial of a step is of lower order
 * than the step.
 */
typedef enum kmp_repeated { KMP_REPEATED_ROUGH, KMP_REPEATED_CONTACTS, KMP_REPEATED_ALL } kmp_repeated;

typedef struct kmp_solver_kind {
    const char *name;
    const char *family; /* of integrators with the same formulas for y' = f and F = 0; NULL: its name */
    bool dae;           /* solves F(t, y, y') = 0 instead of y' = f(t, y) */
    bool corrects;      /* `accept` may correct y and reject a step: one-step methods */
    bool implicit;      /* uses the Jacobian of the ODE if there is one */
    bool lanes;         /* uses `lanes` of the ODE if there is one */
    bool standard;      /* compare runs it by default */
    bool sparse;        /* takes a linear solver of linear.def */
    bool constant;      /* makes steps of a given length if wanted */
    const struct kmp_solver_kind
        *stand_in;      /* a multistep method's: continues where restarts are frequent; NULL: none */
    const void *method; /* for `create`, if several kinds have the same functions */

    /** Makes a struct that begins with a kmp_solver; NULL after a message. The pointers in `setup` must outlive the
     * solver. */
    void *(*create)(const struct kmp_solver_kind *kind, const kmp_solver_setup *setup);
    void (*release)(void *solver);

    /** Starts or restarts at (t, y[, yp]) towards t_end; h0 is the first step, 0: an explicit method chooses it. */
    kempe_status (*start)(void *solver, double t, const double *y, const double *yp, double t_end, double h0);

    /** Takes another t_end beyond t between two steps, which continue as they were. NULL: the member t_end is all. */
    kempe_status (*extend)(void *solver, double t_end);

    /** Makes one accepted step, the last one ending exactly at t_end. KEMPE_E_FAILED: no step was possible. Without a
     * message in the context the step became too small or the formulation gave up. */
    kempe_status (*step)(void *solver);

    /** Takes the last step back; the next one begins where it began, with the length h. NULL: it cannot. */
    void (*undo)(void *solver, double h);
    kmp_repeated repeats; /* the steps that are made again up to an event within them */

    /** y (and y' if yp is not NULL, of a DAE) at a time t in [t_old, t] of the solver. */
    kempe_status (*dense)(void *solver, double t, double *y, double *yp);

    /** Transfers what `dense` needs for the last step, from one solver to another of the same problem, which was not
     * started and gives nothing else. */
    void (*transfer)(void *solver, kmp_number_stream *stream);
} kmp_solver_kind;

/** Makes a zeroed struct of `bytes` bytes that begins with a kmp_solver and has the problem of the setup. NULL after a
 * message. kmp_solver_free frees it with its arena. */
void *kmp_solver_new(const kmp_solver_kind *kind, const kmp_solver_setup *setup, size_t bytes);
void kmp_solver_free(void *solver);

/** The solver when all its arrays are made; NULL after a message and kmp_solver_free without memory. */
void *kmp_solver_made(void *solver);

/** Sets times and step of a start. */
void kmp_solver_begin(kmp_solver *solver, double t, double t_end, double h);

/** Takes the last step back: its start, and the length of the next one. False: there is no step. */
bool kmp_solver_take_back(kmp_solver *solver, double h);

/** Transfers the ends of the last step. */
void kmp_solver_transfer_times(kmp_solver *solver, kmp_number_stream *stream);

/** Cycles of a stage of an explicit method besides its evaluation, about: a call, and sums for each unknown. */
#define KMP_CYCLES_OF_STAGE   100
#define KMP_CYCLES_OF_UNKNOWN 4

/** dy = f(t, y) of the ODE, counted. */
int kmp_solver_call(kmp_solver *solver, double t, const double *y, double *dy);

/** f after an Euler step of length *h from y with slope dy, in `y1`, only of a motion where equations follow it; *h is
 * quartered until f can be evaluated. */
int kmp_solver_euler(kmp_solver *solver, double *h, const double *y, const double *dy, double *y1, double *f);

/** First step as for explicit methods (Hairer, Norsett, Wanner, I, II.4), of an error of order `order` in h, into
 * solver->h: weights `scale`, room y1 and f. KMP_GO or KMP_HALT. */
int kmp_solver_first_step(kmp_solver *solver, int order, const double *y, const double *dy, const double *scale,
                          double *y1, double *f);

static inline void kmp_solver_swap(double **a, double **b)
{
    double *t = *a;
    *a = *b;
    *b = t;
}

/** Row k of the table, NULL after the last; the row of a name, NULL if it does not exist. */
const kmp_solver_kind *kmp_solver_get(int k);
const kmp_solver_kind *kmp_solver_find(const char *name);

/** The family of an integrator, or its name where it has none. */
const char *kmp_solver_family(const char *name);

/* Of a step size that has collapsed (kmp_step_collapsed). */
#define KMP_SOLVER_COLLAPSED                                                                                           \
    "the step size is close to the resolution of double precision at this time: the motion is singular "               \
    "there, or too fast"

#define KMP_SOLVER(name) extern const kmp_solver_kind kmp_solver_##name;
#include "integrators/steppers/integrators.def"
#undef KMP_SOLVER
