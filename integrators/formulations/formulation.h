/* SPDX-License-Identifier: BSD-3-Clause */
/* Interface of a formulation to a run: a consistent start, an ODE or a DAE, and full rows at any time. A new
 * formulation or form is a file with one kmp_formulation_kind and a row in formulations.def. */
#pragma once

#include "base/arena.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/saddle.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/rank_margin.h"
#include "integrators/formulations/run_log.h"
#include "integrators/steppers/ode.h"

typedef struct kmp_formulation kmp_formulation;

/** After a change of unknowns, evaluations use a fused program only if the unknowns before lasted for this many steps:
 * making the program costs some dozens of steps. */
enum { KMP_FORMULATION_BRIEF = 16 };

/** The event that a run passes while it leaves a formulation and begins another one, for formulations with derivatives
 * of the motion. Its arrays belong to the run. */
typedef struct kmp_passed_event {
    bool now;                                /* an event is passed */
    const bool *caused;                      /* of each condition: it is an event of this one */
    const struct kmp_impact_run *impact;     /* with the elements that take part and their impulses; NULL: no impact */
    bool switched;                           /* closures have switched, and rates are the nearest that they allow */
    const struct kmp_friction_run *friction; /* elements that stick and contacts; NULL: none */
} kmp_passed_event;

/** Inputs of a formulation, which must not outlive them. */
typedef struct kmp_formulation_start {
    const kempe_system *system;
    kmp_evaluator *eval;
    const kmp_partition *part; /* at the start */
    kmp_rank_margin *margin;   /* of the run */
    double t;
    const double *q, *qd; /* consistent */
    const double *qdd, *lambda;
    double work; /* of non-conservative forces so far */
    double rtol, atol, rate_scale;
    double length; /* of the rest of the run, in units of the reciprocal of rate_scale */
    kmp_run_log *log;
    bool brief;      /* the formulation before lasted for a few steps: preparations that pay only over many steps are
                      * skipped */
    bool early;      /* preparations are made at the start, not between steps */
    bool fixed;      /* u is fixed, and the run ends where it becomes singular */
    bool restarts;   /* an exchange restarts the integrator at a low order */
    bool implicit;   /* the integrator uses the Jacobian of an ODE, which needs M and C */
    bool lanes;      /* the integrator evaluates several stages at once (kmp_ode.lanes) */
    bool may_change; /* the integrator may be exchanged for one that does, if that is worth while */
    bool dae;        /* the integrator solves F(t, y, y') = 0 */
    void *user;      /* of a caller's own formulation (kmp_run_spec) */
    const kmp_passed_event *passed; /* by the run at t; NULL: the formulation needs no derivatives */
} kmp_formulation_start;

/* The ways to a row of results on the reduced formulation: the program by the reduced mass, the program by the saddle
 * system, or parts that are evaluated one after the other. */
typedef enum kmp_rows_by { KMP_ROWS_BY_PROGRAM, KMP_ROWS_BY_SADDLE_PROGRAM, KMP_ROWS_BY_PARTS } kmp_rows_by;

typedef struct kmp_formulation_kind {
    const char *formulation, *form;
    bool dae;
    bool standard;    /* compare runs it by default */
    bool corrected;   /* `accept` corrects y: multistep methods are excluded */
    bool both;        /* the ODE is also available as a DAE */
    bool solved;      /* a DAE that integrators of several stages at once may solve for the accelerations */
    bool jacobian;    /* the Jacobian of the ODE is available, for implicit integrators */
    bool by_bodies;   /* uses articulated bodies if the evaluator has them */
    bool by_products; /* needs only products M x, unless the integrator is implicit */
    bool in_lanes;    /* evaluates several stages at once, if the integrator does (kmp_ode.lanes) */
    bool lanes_first; /* such an integrator is its default, where the stages have lanes */
    const struct kmp_formulation_kind
        *near_singular; /* formulation across change points; NULL: kmp_formulation_near_singular */
    const void *detail; /* for `create`, if several kinds share it */

    /** Makes a formulation; NULL after a message. */
    kmp_formulation *(*create)(const struct kmp_formulation_kind *kind, const kmp_formulation_start *start);
} kmp_formulation_kind;

struct kmp_formulation {
    void (*release)(kmp_formulation *formulation);

    /** Row at (t, y). If qdd is NULL, accelerations and multipliers are left out; if qd is NULL too, so are
     * rates. The remaining values have the same bits. 0, or KMP_HALT with the reason in the context. */
    int (*row)(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
               double *lambda, double *work);

    /** q at (t, y), to the accuracy of the integration. */
    void (*position)(kmp_formulation *formulation, double t, const double *y, double *q);

    /** Called between steps, at the end of the last one: may change the meaning of its unknowns (exchange coordinates).
     * KMP_GO: nothing was changed; KMP_CHANGED: y (and yp) are the new start; KMP_HALT. NULL: none. */
    int (*renew)(kmp_formulation *formulation, double t, double *y, double *yp);

    /** Puts a closed state into y (and yp) as a new start; other unknowns (work) are unchanged. */
    int (*resume)(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y, double *yp);

    /** Takes from y the unknowns that are not part of a state, before another formulation of the same kind starts at
     * (t, y). NULL: none. */
    int (*keep)(kmp_formulation *formulation, double t, const double *y);

    /** Takes the place where a step of another formulation with the same unknowns ended, at (t, y) with q closed: rows
     * within that step are predicted from there, and from the other's `curve`. NULL: nothing is predicted. */
    int (*stand)(kmp_formulation *formulation, double t, const double *y, const double *q);

    /** Appends to `reason` why no step was possible from the last accepted one, if the formulation knows. NULL:
     * none. */
    void (*explain)(kmp_formulation *formulation);

    const kmp_partition *part; /* the present rows and coordinates */
    kmp_ode ode;               /* one of ode and dae, or both */
    kmp_dae dae;
    kmp_arena arena; /* of y, yp, atol and a formulation's own arrays */
    int n;           /* coordinates */
    int size;        /* unknowns */
    double *y, *yp;  /* consistent start; yp for integrators of DAEs only */
    double *curve;   /* curves: what predictions take from accelerations at the end of the last step */
    int curves;
    double *atol;    /* of each unknown */
    double rtol;     /* 0: the tolerance of the run */
    kmp_text reason; /* reason of a failure */
    long newton, factorizations, exchanges;
    long by_parts;       /* evaluations of the integrator without a program, by which programs are found to pay */
    kmp_rows_by rows_by; /* of the last step */
    bool rests; /* it may be put aside after a step, and resumed at another state with the same rows and coordinates, of
                 * which `part` is its own copy; its last unknown is the work, if the system is dissipative */
    bool by_bodies, by_products; /* the dynamics of its evaluator */
    bool rested;                 /* it has been put aside: cleared by `resume` */
    bool due;         /* `renew` will change the unknowns before the next step, because these near their dead centre */
    bool spares;      /* where `renew` changes the unknowns it makes no lanes for them: those before were brief */
    bool lacks_lanes; /* it has made none */
    bool one_by_one; /* many of its stages cannot be evaluated in lanes, because the saddle system loses digits there */
};

/** Makes a zeroed struct of `bytes` bytes that begins with a kmp_formulation; kmp_formulation_free frees it unless the
 * kind has its own function. NULL after a message. */
void *kmp_formulation_new(const kmp_formulation_start *start, size_t bytes);

/** Frees the reason, the arena and the struct itself. */
void kmp_formulation_free(kmp_formulation *formulation);

/** The whole row at (t, y) in one array: q, qd, qdd, lambda. Results as of the member `row`. */
int kmp_formulation_row(kmp_formulation *formulation, double t, const double *y, double *row, double *work);

/** Allocates `size` unknowns, and their slopes if wanted; failures are recorded in the arena. */
void kmp_formulation_make_unknowns(kmp_formulation *formulation, int size, bool slopes);

/** For formulations whose unknowns begin with q and qd: the state of a start and the tolerances; q. */
void kmp_formulation_begin_with_state(kmp_formulation *formulation, const kmp_formulation_start *start);
void kmp_formulation_position_of_state(kmp_formulation *formulation, double t, const double *y, double *q);

/** Checks that the dropped rows close, too, at the evaluator's last closure (at t): not wider than many tolerances
 * (scaled), nor than a multiple of the kept rows. KMP_GO, or KMP_HALT with the reason. */
int kmp_redundant_check(const kmp_evaluator *eval, const kmp_partition *part, double t, double tolerance,
                        kmp_text *reason);

/** The name of a row between rates that are not the rates of any h (kmp_row.of_rates); NULL: the system has none. */
const char *kmp_formulation_row_of_rates(const kempe_system *system);

#define KMP_FORMULATION(id) extern const kmp_formulation_kind kmp_formulation_##id;
#include "integrators/formulations/formulations.def"
#undef KMP_FORMULATION
