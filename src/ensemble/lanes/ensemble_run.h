/* SPDX-License-Identifier: BSD-3-Clause */
/* Many instances of one mechanism, each with its own values of some parameters and start values, by DOP853 on the
 * reduced formulation in its integrated form. Several run at once, one in each lane, with their own steps and error
 * control.
 *
 * Threads share the instances in chunks, each with a separate system. A result depends only on its values: its
 * bits are the same for any number of threads and instances.
 *
 * Lanes make the decisions of a run of one mechanism. If a lane cannot decide, a separate run continues that instance
 * until lanes can take it back: across change points, where steps become too small. A separate run makes an instance
 * from its start where lanes do not support the mechanism: other integrators, large systems. */
#pragma once

#include "backend/time_scales.h"
#include "integrators/run/run.h"
#include "output/quantities/run_quantities.h"

typedef struct kmp_ensemble kmp_ensemble;

/** Options of the execution. */
typedef struct kmp_ensemble_execution {
    int threads;     /* that share the instances: 0 one for each processor, else 1 to KMP_TEAM_MOST */
    int width;       /* number of lanes: 0 the best for this machine and model, else 1 to KMP_LANES_MOST */
    int pools;       /* choices of coordinates that stay while no instance waits for them: 0 KMP_POOLS_KEPT */
    bool plain;      /* no machine code in lanes */
    bool alone;      /* no lanes: a separate run for each instance */
    bool own_pulses; /* functions of time depend on values of the instances (kmp_ensemble_limit_steps), */
    double max_step; /* then the longest step that the user gives, s; 0: none */
    long before;     /* of progress: instances of a longer run that are done, */
    long total;      /* and all of it; 0: this run is the whole, -1: no progress */
    const kmp_run_quantities *quantities; /* measured during each run; NULL: none */
    double *taken;                        /* their values: instances x quantities->values, NaN without a whole run */
    double *starts; /* instances x 2 n: q and qd at the start, where loops are closed; NaN: not known, and then noted,
                     * for the same instances at another tolerance. NULL: not wanted */
} kmp_ensemble_execution;

typedef struct kmp_ensemble_result {
    kempe_status status; /* KEMPE_OK, KEMPE_STOPPED, KEMPE_E_FAILED; KEMPE_E_INPUT: the values are impossible for the
                          * model */
    char *reason;        /* NULL: there is none; freed with kmp_free */
    bool alone;          /* made by a separate run */
    int parts;           /* of its time that separate runs have made between lanes */
    bool rates_changed;  /* its start rates were given and could not be kept */
    bool gaps_changed;   /* closing its loops moves what counts from the start as it is written */
    bool leaves;         /* it starts at an unstable equilibrium */
    bool unstable;       /* its deformations start in a balance that is not stable */
    const char *why;     /* reason for the last separate run; NULL: it ran in a lane, or nothing had to be done */
    double t;
    long steps, rejected, refused, rhs, exchanges;
    bool deflects;         /* a flexible body deflected too far */
    bool shares;           /* its motion depends on how redundant contacts share their loads */
    double h, hdot, drift; /* at the end: max |h| and |hdot|, scaled; energy drift relative to the size of the energy */
} kmp_ensemble_result;

/** Derives the equations with the named values (model/data/variant.h) kept symbolic. Model and names must outlive the
 * ensemble. */
kempe_status kmp_ensemble_new(const kempe_model *model, int count, const char *const *names, kmp_ensemble **ensemble);
void kmp_ensemble_free(kmp_ensemble *ensemble);

/** The system, with the values of the model. */
const kempe_system *kmp_ensemble_system(const kmp_ensemble *ensemble);

/** Runs `instances` rows of values (row-major, in the order of the names) to the end of the spec, which need not be
 * resolved; its times are ignored. Fills results, q and qd (instances x n); an instance without a state has NaN.
 * KEMPE_E_ARGUMENT, KEMPE_E_MEMORY; an interrupt leaves KEMPE_STOPPED in the results. */
kempe_status kmp_ensemble_run(kmp_ensemble *ensemble, const kmp_run_spec *spec, const kmp_ensemble_execution *execution,
                              int instances, const double *values, kmp_ensemble_result *results, double *q, double *qd);

/** Measurements of the last run: machine code, threads, lanes, choices of u and work of the lanes. */
typedef struct kmp_ensemble_work {
    int threads, width, pools, alone;
    double cpu_s, wall_s; /* processor time of all threads; time on the wall */
    bool native;
    bool doubted;    /* no instance can be trusted, for a reason that the context has */
    long sweeps;     /* steps of all lanes together */
    long lane_steps; /* attempted steps of instances in these */
} kmp_ensemble_work;
kmp_ensemble_work kmp_ensemble_get_work(const kmp_ensemble *ensemble);

/** The number of lanes, if a width is not given (0): of two registers only where the vectors of both remain in the
 * first cache, and chunks of that size leave no thread without instances. Results do not depend on it. */
int kmp_ensemble_width(const kempe_system *system, int width, int instances, int threads);

/** True if runs mark what makes instances doubtful, or what they warn of: of condition k of a system, or of use k less
 * the number of conditions of a table, in `left`. Doubts a marked one, or warns of it; false: only a warning. */
bool kmp_ensemble_has_mark(const kempe_system *system, int k);
bool kmp_ensemble_report_mark(const kempe_system *system, kempe_context *context, int k);

/** Intervals of the functions of time in a run of the system, with its present parameters. KEMPE_E_MEMORY. */
kempe_status kmp_ensemble_time_scales(const kempe_system *system, const kmp_run_spec *spec, kmp_arena *arena,
                                      kmp_time_scales *found);

/** Lets no step of a resolved spec be longer than the shortest interval of the functions of time: instances have their
 * pulses at other times. *open: shorter ones may have been missed; *varies: the interval is the one of the model, and
 * each instance may have another one. */
kempe_status kmp_ensemble_limit_steps(const kempe_system *system, kmp_run_spec *spec, bool *open, bool *varies);
