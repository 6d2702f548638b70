/* SPDX-License-Identifier: BSD-3-Clause */
/* One run: assembles, combines a formulation and an integrator by name, advances, delivers rows. */
#pragma once

#include "base/text.h"
#include "constraints/closing/assemble.h"
#include "constraints/evaluation/present_inputs.h"
#include "dynamics/system.h"
#include "integrators/formulations/run_log.h"
#include <kempe/check.h>
#include <stdbool.h>

struct kmp_recording;
struct kmp_formulation_kind;

typedef struct kmp_runner kmp_runner;

/** Callback for an accepted step between two times, cut where a condition changes. Nonzero ends the run: no memory, or
 * no state. */
typedef int kmp_step_fn(void *user, kmp_runner *runner, double from, double to);

/** The one-step method that continues a multistep method while restarts are frequent (runner_change.c). */
typedef struct kmp_stand_in {
    bool active;
    long returns; /* times that the multistep method has continued */
} kmp_stand_in;

/** Why a run has its integrator, where neither the user nor a count of work chose it. The texts are static. */
typedef struct kmp_integrator_reason {
    const char *integrator; /* NULL: none of these reasons */
    const char *because;    /* a sentence */
    const char *obstacle;   /* its continuation: what prevents another integrator; NULL: nothing */
} kmp_integrator_reason;

/** Callback where states take the values of samples or events, before they have them: `taken` are the ones of the
 * states with a next value, in order, and `condition` the one that has become true; -1: a sample. */
typedef void kmp_sample_fn(void *user, int count, const bool *taken, const int *condition);

/** A part of what a run knows of its past, where it lies in the run. */
typedef struct kmp_memory_piece {
    void *at;
    size_t size;
} kmp_memory_piece;

/** The past of delayed signals that a run keeps for checkpoints at `since` or later. */
typedef struct kmp_program_cache_past {
    kmp_past *past; /* the run's own while it lasts, at its end the caller's copy until then; NULL: none */
    double since;   /* the caller moves it on */
} kmp_program_cache_past;

/** Times, s. */
typedef struct kmp_time_span {
    double since, until;
} kmp_time_span;

typedef struct kmp_run_spec {
/* The rows of run_options.def that all runs obey. Names are static ones when resolved; max_steps is attempted steps, 0:
 * by progress, -1: no bound. */
#define KMP_RUN_OPTION(name, type, key, engine, ...) KMP_RUN_IF_RUN_##engine(KMP_RUN_TYPE_##type name;)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    double t_start;    /* 0, except for a run that continues from a state given as `start` */
    double work_start; /* of non-conservative forces until then */
    bool continues;    /* the start is the end of an earlier run: rates jump there where closures switch */
    int time_count;    /* times of rows: ascending, within [t_start, t_end] */
    const double *times;
    const int *u; /* independent coordinates chosen by the user */
    int u_count;
    bool closely;                            /* the run checks another run: conditions are evaluated at more places */
    double limit_s;                          /* processor time after which a run is given up; 0: none */
    kmp_run_log *log;                        /* events of the run; NULL: only logged */
    struct kmp_recording *recording;         /* of dense output; it takes the runner in the end; NULL: none */
    const struct kmp_formulation_kind *kind; /* a formulation of the caller in place of the named one; NULL: none */
    void *user;                              /* argument of that formulation and of `step` */
    kmp_step_fn *step;                       /* callback at accepted steps; NULL: none */
    kmp_sample_fn *sample;                   /* with the argument `user`; NULL: none */
    bool slopes;                             /* the unknowns have derivatives of the motion */
    bool own_angles;                         /* spherical joints are not centred */
    const double *mode_start;                /* conditions at the start; NULL: by the state */
    const void *memory_start;                /* of a run that continues (kmp_runner_keep_memory); NULL: none */
    bool elsewhere;                          /* it continues from another state than its memory has */
    bool due; /* what happens at t_start is still to come: samples, states that change at events, given inputs */
    const kmp_present_inputs *inputs_start; /* NULL: the inputs of the model */
    const kmp_past *past_start; /* of delayed signals until t_start; NULL: begun there, or the past of inputs_start */
    kmp_program_cache_past *kept_past; /* NULL: not wanted */
    double rate_scale;                 /* 0: by the start */
    double first_step;                 /* of a one-step method; 0: chosen by itself */
    kmp_stand_in stand_in;             /* zero: the integrator itself begins */
    int part, parts;                   /* of a run by parts: its number, and how many there are; 0: it is whole */
    kmp_time_span all;                 /* of the motion of which this run is a piece; zero: it is all of it */
    bool open; /* the user chose no formulation, form or u: another formulation may continue where this one
                * stops */
    bool
        open_integrator; /* the user chose no integrator: `integrator` may be exchanged where another takes less time */
    kmp_integrator_reason reason;
} kmp_run_spec;

/** The end of the motion of which a run is a piece, and how long it lasts. */
static inline double kmp_run_until(const kmp_run_spec *spec)
{
    return spec->all.until > 0 ? spec->all.until : spec->t_end;
}
static inline double kmp_run_span(const kmp_run_spec *spec)
{
    return kmp_run_until(spec) - (spec->all.until > 0 ? spec->all.since : spec->t_start);
}

/** Callback for a row: time, q, qd, qdd (n), lambda (m) and the work done so far by non-conservative forces (J).
 * Nonzero ends the run with KEMPE_E_MEMORY. */
typedef int kmp_row_fn(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                       double work);

typedef struct kmp_run_report {
    char *reason;      /* sentence, NULL when all went well; the caller frees it (kmp_free) */
    double t;          /* reached */
    double rate_scale; /* 1/s: absolute tolerance of rates over the tolerance of coordinates */
    long steps, rejected, refused, rhs, newton, jacobians, factorizations, exchanges, centrings, events;
    long impacts;           /* of rigid contacts; -1: there are none */
    long changes;           /* of modes of friction that sticks and of rigid contacts; -1: there are none */
    bool cut;               /* given up for limit_s */
    bool prescribed;        /* no degree of freedom: all motion follows from the closures */
    bool ended, requested;  /* ended by a condition; by one of the model's `until`, so that the run is complete */
    double least, most;     /* work of non-conservative forces at ends of steps: the energy that is exchanged, J */
    bool by_bodies;         /* used articulated bodies, if the formulation does not require M and C */
    double cpu_s, build_s;  /* only integration; preparation of this run (derivation for the dae formulation
                             * included) */
    size_t heap;            /* bytes of the heap that the run holds at its end; 0: unknown */
    const char *integrator; /* the last one in use; static */
    const char *continued;  /* the formulation that took the place of the default one, static; NULL: none did */
    double continued_t;     /* since then */
    double chosen_ratio;    /* counted time of radau over the time of dop853, expected at the start; 0: not compared */
    double wall_s;          /* of the integration, if threads share it; 0: one thread */
} kmp_run_report;

/** Makes a run. If a condition ends it, the last row is there. KEMPE_OK, KEMPE_STOPPED or KEMPE_E_FAILED with
 * report->reason; other errors by message. `start`: an assembly made before; NULL: the model is assembled here. */
kempe_status kmp_run(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start, kmp_row_fn *row,
                     void *user, kmp_run_report *report);

/** *apart: kmp_run makes it in parts or pieces, with separate steps (island_runs.h, near_runs.h). */
kempe_status kmp_run_goes_apart(const kempe_system *system, const kmp_run_spec *spec, bool *apart);

/** The same as one mechanism, where kmp_run runs parts that share nothing one by one (island_runs.h). */
kempe_status kmp_run_whole(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                           kmp_row_fn *row, void *user, kmp_run_report *report);

/* Stepwise runs: a runner is at an accepted step of its integrator and gives rows within it. */

/** Makes a runner. *runner is given on KEMPE_E_FAILED and KEMPE_STOPPED too, for its report; spec (resolved) and its
 * pointers must outlive it. */
kempe_status kmp_runner_new(const kempe_system *system, const kmp_run_spec *spec, const kempe_assembly *start,
                            kmp_runner **runner);
void kmp_runner_free(kmp_runner *runner);

/** Makes one accepted step towards t_end. KEMPE_E_FAILED and KEMPE_STOPPED: the report has the reason. */
kempe_status kmp_runner_step(kmp_runner *runner);

/** Cuts the last step at t, because external inputs of the equations (kempe_system_set_force) may have changed. The
 * rest of the step is discarded, the integrator restarts there, and no step goes beyond `stop`. */
kempe_status kmp_runner_cut(kmp_runner *runner, double t, double stop);

/** Ends of the last step; equal at the start. */
double kmp_runner_t(const kmp_runner *runner);
double kmp_runner_t_old(const kmp_runner *runner);

/** True if a condition has ended the run, at the end of the last step. */
bool kmp_runner_ended(const kmp_runner *runner);

/** Row at a time within the last step, rows of one step in ascending order: q, qd, qdd (n each), lambda (m); work. */
kempe_status kmp_runner_row(kmp_runner *runner, double t, double *row, double *work);

/** The same without accelerations and multipliers, whose places have no meaning; q and qd have the same bits. */
kempe_status kmp_runner_motion(kmp_runner *runner, double t, double *row);

/** kmp_runner_row at any time within the last step, in any order, without the work: what the run keeps of its rows does
 * not change. */
kempe_status kmp_runner_look(kmp_runner *runner, double t, double *row);

/** The same in the coordinates of the present charts; `whole`: with accelerations and multipliers. */
kempe_status kmp_runner_look_inside(kmp_runner *runner, double t, bool whole, double *row);

/** The unknowns of the formulation at a time within the last step, valid until the next call; NULL: not available. */
const double *kmp_runner_unknowns(kmp_runner *runner, double t);

/** Fills the report; the caller frees reason, which may be NULL. */
void kmp_runner_report(const kmp_runner *runner, kmp_run_report *report);

/** Fills the report without its reason. No allocation. */
void kmp_runner_count(const kmp_runner *runner, kmp_run_report *report);

/** Methods of a run: the k-th valid combination of formulation, form and integrator; false after the last. */
typedef struct kmp_method {
    const char *formulation, *form, *integrator;
    bool standard_form, standard_integrator; /* compare runs it by default */
    const char *linear;                      /* linear solver of an integrator that takes one; NULL: auto */
} kmp_method;

/* Rows and polynomials leave these as they were, so that no digit of a motion depends on the rows. */
typedef struct kmp_kept_loads {
    double *nu;    /* m: the multipliers from which the next evaluations of the integrator begin */
    long by_parts; /* the number of evaluations by which programs are found to pay */
} kmp_kept_loads;

/** Before and after rows that are read: keeps and gives back the multipliers from which the next evaluations of the
 * integrator begin, and the number of evaluations by which programs are found to pay. No digit of the motion then
 * depends on the rows. Returns `status`. */
void kmp_runner_keep(kmp_runner *run);
kempe_status kmp_runner_give_back(kmp_runner *run, kempe_status status);

/** kmp_runner_row in the coordinates of the present charts; `whole`: with accelerations and multipliers. */
kempe_status kmp_runner_inner_row(kmp_runner *run, double t, bool whole, double *row, double *work);

/** Adds the work of the present formulation and integrator. */
void kmp_runner_add_report(const kmp_runner *run, kmp_run_report *report);

/** Number of attempted steps, rejected and refused ones included. */
long kmp_runner_tried(const kmp_runner *run);

/* Bound on the work of a run: a given number of steps, or else one by its progress. */

typedef struct kmp_work_bound {
    long most;       /* attempted steps, rejected and refused ones included; 0: by progress; -1: no bound */
    long seen;       /* attempted steps at the last look at progress */
    double seen_t;   /* time of the run then */
    bool has_looked; /* a look was taken */
    const char *end; /* the word for the end of the run; NULL: t_end */
} kmp_work_bound;

/** After a step: `tried` attempts so far, the run is at t and ends at t_end. True when it must stop, with the sentence
 * in `why` (NULL: not wanted). A default bound judges steps in long windows; it ends a run whose last window would have
 * to be repeated hundreds of times. */
bool kmp_work_bound_passed(kmp_work_bound *bound, long tried, double t, double t_end, kmp_text *why);

/** The number of further steps for which a bound that was asked at `tried` steps need not be asked. */
long kmp_work_bound_spare(const kmp_work_bound *bound, long tried);

/** Computes the row at t within the last step by another formulation after its own has failed, and notes it in the
 * log; arguments as for kmp_runner_inner_row. false: not available, and nothing is changed. */
bool kmp_runner_bridge(kmp_runner *run, double t, double *row, double *work);
