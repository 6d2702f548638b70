/* SPDX-License-Identifier: BSD-3-Clause */
/* One run: assembles, sets a formulation and an integrator together by name, advances, delivers rows. */
#ifndef KMP_INTEGRATORS_RUN_RUN_H
#define KMP_INTEGRATORS_RUN_RUN_H

#include "constraints/closing/assemble.h"
#include "dynamics/system.h"
#include "integrators/run/journal.h"

typedef struct kmp_runner kmp_runner;

/** An accepted step between two times, cut where a condition changes. Nonzero ends the run: there is no memory, or the
 * state cannot be had. */
typedef int kmp_step_fn(void *user, kmp_runner *runner, double from, double to);

typedef struct kmp_run_spec {
    const char *formulation, *form, *integrator, *linear, *backend; /* names; all given, see kmp_run_resolve */
    double rtol, atol;                                              /* atol: of an angle */
    double t_start;    /* 0 but for a run that goes on from a state given as `start` */
    double work_start; /* of non-conservative forces until then */
    double t_end;
    int time_count; /* when to deliver rows: ascending, within [t_start, t_end] */
    const double *times;
    const int *u; /* wished independent coordinates */
    int u_count;
    bool keep_independent;     /* no exchanges: the run ends where u goes bad */
    const char *change_points; /* a word of change_points.def */
    bool closely;              /* it checks another run: conditions are looked at in more places */
    double limit_s;            /* of the processor: a run that needs more is given up; 0: none */
    long max_steps;            /* tried, rejected ones too; 0: as work_bound.h says; -1: no bound */
    kmp_journal *journal;      /* what happens on the way; NULL: told to the log alone */
    int threads;               /* that share the work of an evaluation by a back end that can; 0: one */
    const struct kmp_formulation_kind
        *kind;         /* a formulation of the caller's own in place of the one named; NULL: none */
    void *user;        /* given to that formulation, and to: */
    kmp_step_fn *step; /* who looks on at accepted steps; NULL: nobody */
    bool own_angles;   /* spherical joints are not centred */
    bool open;         /* nobody asked for a formulation, a form or u: another may go on where this one stops */
} kmp_run_spec;

/** A row delivered at a time: q, qd, qdd (n), lambda (m) and the work done so far by non-conservative forces (J).
 * Nonzero ends the run with KEMPE_E_MEMORY. */
typedef int kmp_row_fn(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                       double work);

typedef struct kmp_run_report {
    char *reason;      /* sentence, NULL when all went well; the caller frees it (kmp_free) */
    double t;          /* reached */
    double rate_scale; /* 1/s: how the absolute tolerance of rates follows from that of coordinates */
    long steps, rejected, refused, rhs, newton, jacobians, factorizations, exchanges, centrings, events;
    bool cut;              /* given up for limit_s */
    bool ended;            /* a condition has ended it */
    bool by_bodies;        /* it went by articulated bodies, where the formulation was not M and C's own */
    double cpu_s, build_s; /* integration alone; preparing this run (deriving for the dae formulation included) */
    double wall_s;         /* of the integration, where threads share it; 0: there is one */
} kmp_run_report;

/** Fills what is NULL or 0 from the model and from Kempe's defaults and checks the names against the tables of
 * formulations and integrators. KEMPE_E_ARGUMENT: which name is unknown, and what there is. */
kempe_status kmp_run_resolve(const kempe_system *system, kmp_run_spec *spec);

/** Runs. Where a condition ends it, the last row is there. KEMPE_OK, KEMPE_STOPPED or KEMPE_E_FAILED with
 * report->reason; other errors by message. `start` may be given (an assembly made before), else the model is assembled
 * here. */
kempe_status kmp_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, kmp_row_fn *row,
                     void *user, kmp_run_report *report);

/* The same by hand: a runner stands at an accepted step of its integrator and gives rows within it. */

/** *runner is given on KEMPE_E_FAILED and KEMPE_STOPPED too, for its report; spec (resolved) and what it points to
 * outlive it. */
kempe_status kmp_runner_new(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                            kmp_runner **runner);
void kmp_runner_free(kmp_runner *runner);

/** One accepted step towards t_end. KEMPE_E_FAILED and KEMPE_STOPPED: the report says why. */
kempe_status kmp_runner_step(kmp_runner *runner);

/** What the equations read from outside (kempe_system_set_force) may have changed at t, within the last step: what lies
 * beyond t is forgotten, the integrator begins anew there, and no step goes beyond `stop`. */
kempe_status kmp_runner_cut(kmp_runner *runner, double t, double stop);

/** Ends of the last step; equal at the start. */
double kmp_runner_t(const kmp_runner *runner);
double kmp_runner_t_old(const kmp_runner *runner);

/** Whether a condition has ended the run, where the last step ends. */
bool kmp_runner_ended(const kmp_runner *runner);

/** Row at a time within the last step, rows of one step in ascending order: q, qd, qdd (n), lambda (m), work. */
kempe_status kmp_runner_row(kmp_runner *runner, double t, double *q, double *qd, double *qdd, double *lambda,
                            double *work);

/** The unknowns of the formulation at a time within the last step, valid until the next call; NULL: they cannot be had.
 */
const double *kmp_runner_unknowns(kmp_runner *runner, double t);

/** The state of affairs; reason (may be NULL) is to be freed by the caller. */
void kmp_runner_report(const kmp_runner *runner, kmp_run_report *report);

/** The ways to run: combination k of formulation, form and integrator that go together; false after the last. */
typedef struct kmp_method {
    const char *formulation, *form, *integrator;
    bool standard_form, standard_integrator; /* compare runs it when neither is asked for */
} kmp_method;
bool kmp_way_get(int k, kmp_method *way);

#endif
