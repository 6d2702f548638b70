/* SPDX-License-Identifier: BSD-3-Clause */
/* What a formulation offers to a run: a consistent start, an ODE or a DAE, and full rows at any time. A new formulation
 * or form is a file with one kmp_formulation_kind and a row in formulations.def. */
#ifndef KMP_INTEGRATORS_FORMULATIONS_FORMULATION_H
#define KMP_INTEGRATORS_FORMULATIONS_FORMULATION_H

#include "base/arena.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/saddle.h"
#include "constraints/evaluation/plant.h"
#include "constraints/partition/margin.h"
#include "constraints/partition/partition.h"
#include "integrators/formulations/dae.h"
#include "integrators/run/journal.h"
#include "integrators/steppers/ode.h"

typedef struct kmp_formulation kmp_formulation;

/** After a change of a formulation's unknowns evaluations are made one program again only when what was before lasted
 * for as many steps: making the program costs some dozens of them. */
enum { KMP_FORMULATION_BRIEF = 16 };

/** What a formulation is made from; everything outlives it. */
typedef struct kmp_formulation_start {
    const kempe_system *system;
    kmp_plant *plant;
    const kmp_partition *part; /* at the start */
    kmp_margin *margin;        /* of the run */
    double t;
    const double *q, *qd; /* consistent */
    const double *qdd, *lambda;
    double work; /* of non-conservative forces so far */
    double rtol, atol, rate_scale;
    kmp_journal *journal;
    bool brief;    /* the formulation before it lasted for a few steps: what makes many steps cheaper does not pay */
    bool fixed;    /* u stays what it is, and the run ends where it goes bad */
    bool restarts; /* an exchange has the integrator begin anew at a low order */
    bool implicit; /* the integrator wants the Jacobian of an ODE where the formulation has one: of M and C */
    bool dae;      /* it solves F(t, y, y') = 0 */
    void *user;    /* of a caller's own kind of formulation (kmp_run_spec) */
} kmp_formulation_start;

typedef struct kmp_formulation_kind {
    const char *formulation, *form;
    bool dae;
    bool standard;                           /* compare runs it unasked */
    bool corrected;                          /* `accept` corrects y: multistep methods are out */
    bool both;                               /* an ODE that stands as a DAE, too */
    bool jacobian;                           /* it has that of its ODE, for implicit integrators */
    bool by_bodies;                          /* it goes by articulated bodies where the plant may take them */
    const struct kmp_formulation_kind *zone; /* that leads through change points; NULL: kmp_formulation_zone */
    const void *detail;                      /* for `create`, where several kinds share it */

    /** NULL after a message. */
    kmp_formulation *(*create)(const struct kmp_formulation_kind *kind, const kmp_formulation_start *start);
} kmp_formulation_kind;

struct kmp_formulation {
    void (*release)(kmp_formulation *formulation);

    /** Row at (t, y[, yp]). Without accelerations and multipliers where qdd is NULL, without rates where qd is, too:
     * the rest is the same to the bit. 0, or KMP_HALT with the reason in the context. */
    int (*row)(kmp_formulation *formulation, double t, const double *y, const double *yp, double *q, double *qd,
               double *qdd, double *lambda, double *work);

    /** q at (t, y), to the accuracy of the integration. */
    void (*position)(kmp_formulation *formulation, double t, const double *y, double *q);

    /** Asked between steps, at the end of the last one: may give its unknowns another meaning (exchange coordinates).
     * KMP_GO: nothing was changed; KMP_CHANGED: y (and yp) are the new start; KMP_HALT. NULL: it never does. */
    int (*renew)(kmp_formulation *formulation, double t, double *y, double *yp);

    /** Puts a closed state into y (and yp) as a new start; what is no part of it (work) stays. */
    int (*resume)(kmp_formulation *formulation, double t, const double *q, const double *qd, const double *qdd,
                  const double *lambda, double *y, double *yp);

    /** Another formulation of the same kind will begin at (t, y): takes from y what is no part of a state. NULL:
     * nothing. */
    int (*keep)(kmp_formulation *formulation, double t, const double *y);

    /** Puts into `reason` why no step could be made from the last accepted one, when the formulation knows. NULL: it
     * never does. */
    void (*explain)(kmp_formulation *formulation);

    kmp_ode ode; /* one of the two, or both */
    kmp_dae dae;
    kmp_arena arena; /* of y, yp, atol and a formulation's own arrays */
    int n;           /* coordinates */
    int size;        /* unknowns */
    double *y, *yp;  /* consistent start; yp for an integrator of DAEs only */
    double *atol;    /* of each unknown */
    double rtol;     /* 0: that of the run */
    kmp_text reason; /* why it gave up */
    long newton, factorizations, exchanges;
};

/** A zeroed struct of so many bytes that begins with a kmp_formulation, which kmp_formulation_free releases unless told
 * otherwise. NULL after a message. */
void *kmp_formulation_new(const kmp_formulation_start *start, size_t bytes);

/** The reason, the arena and the struct itself. */
void kmp_formulation_free(kmp_formulation *formulation);

/** Room for `size` unknowns, and for their slopes, unless the arena fails. */
void kmp_formulation_make_unknowns(kmp_formulation *formulation, int size, bool slopes);

/** Of formulations whose unknowns begin with q and qd: the state of a start and the tolerances; q. */
void kmp_formulation_begin_with_state(kmp_formulation *formulation, const kmp_formulation_start *start);
void kmp_formulation_position_of_state(kmp_formulation *formulation, double t, const double *y, double *q);

/** Row k of the table, NULL after the last. */
const kmp_formulation_kind *kmp_formulation_get(int k);

/** The kind of a formulation and form (NULL: the formulation's first); NULL when there is none. */
const kmp_formulation_kind *kmp_formulation_find(const char *formulation, const char *form);

/** The formulation through change points: entered and left by a runner, never asked for. */
extern const kmp_formulation_kind kmp_formulation_zone;

#define KMP_FORMULATION(id) extern const kmp_formulation_kind kmp_formulation_##id;
#include "integrators/formulations/formulations.def"
#undef KMP_FORMULATION

#endif
