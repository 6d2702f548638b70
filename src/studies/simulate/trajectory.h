/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of one run: its table, its verdict, its work; a simulation in its stages, which src/pipeline.c calls in
 * order. */
#pragma once

#include "base/json.h"
#include "base/text.h"
#include "dynamics/system.h"
#include "integrators/run/recording.h"
#include "model/data/past_signals.h"
#include "output/convergence.h"
#include "output/reference.h"
#include "output/samples.h"
#include "output/verdict.h"
#include <kempe/kempe.h>

/** A judgement of runs that a wing (base/wings.h) adds to the judgements of the core. */
typedef struct kmp_run_judge {
    /** Before the run, whose messages remain: *before is what the judgement needs, in the arena; NULL: the run is not
     * judged. */
    kempe_status (*prepare)(const kempe_system *system, const kempe_run_options *run, kmp_arena *arena, void **before);
    /** Judges a recorded run; *verdict is in the arena. */
    kempe_status (*judge)(const kempe_system *system, kmp_recording *recording, const void *before, kmp_arena *arena,
                          void **verdict);
    /** *lost: a contact of the rows is lost in a later one, which amplifies errors: no part of the run shows the error
     * of the whole. */
    kempe_status (*loses_contact)(const kempe_system *system, const kmp_samples *rows, bool *lost);
    /** Puts a paragraph, and a member of an open object. */
    void (*show)(kmp_text *text, const kempe_model *model, const void *verdict);
    void (*json)(kmp_json *json, const kempe_model *model, const void *verdict);
} kmp_run_judge;

/** Appends the lines that a checkpoint of this system begins with. */
kempe_status kmp_checkpoint_head(const kempe_system *system, kmp_text *text);

/** Appends the last line: the checksum of the `length` bytes before it. */
void kmp_checkpoint_end(kmp_text *text, const char *s, size_t length);

/** Replaces the samples by the rows of the file, and the past (NULL of a model without continuous delays), which
 * reaches the last of them. KEMPE_E_IO; KEMPE_E_INPUT when it is of another model or spoilt, with file:line:column;
 * both are then as they were. */
kempe_status kmp_checkpoint_read(const kempe_system *system, const char *path, kmp_samples *samples, kmp_past **past);

/** All that a simulation needs until it is done. */
typedef struct kmp_simulation {
    const kempe_system *system;
    kempe_context *context;
    const kempe_run_options *run;
    kmp_arena arena;
    kmp_run_spec spec;
    kmp_reference reference;
    bool has_reference;
    kmp_times times;
    kmp_samples before;          /* rows of the checkpoint to continue from */
    kmp_past *past;              /* of delayed signals in it; NULL: none */
    kmp_program_cache_past kept; /* for the checkpoint of this run */
    size_t doubts;               /* length of the doubts of the context before the run */
    kempe_assembly resumed;      /* the last row of that checkpoint */
    kempe_assembly *assembled;   /* a start at an equilibrium, which is searched once; NULL: none */
    const kempe_assembly *start; /* one of both; NULL: the run assembles its start */
    void *judge_needs;           /* what the judge of a wing needs; NULL: it does not judge */
    kmp_step_counts counts;
    bool least_norm;              /* loads that redundant constraints share */
    bool watches;                 /* the largest reactions are of the motion */
    kempe_trajectory *trajectory; /* the result; NULL: there is none yet */
} kmp_simulation;

struct kempe_trajectory {
    const kempe_system *system;
    kmp_arena arena;
    kempe_status status;
    char *reason;           /* "" when complete; at the end that the model requests its condition */
    char *warnings;         /* of the computation, one per line */
    kmp_text remarks;       /* of these, the ones that a result begins with although it is trusted */
    const char *integrator; /* the last one of the run, which may have changed it */
    const char *source;     /* the reference's path, NULL when none was given */
    kmp_samples table;
    kmp_verdict verdict;
    kmp_convergence again;
    kmp_run_report report;                   /* its reason has moved to `reason` */
    kmp_run_log log;                         /* of events */
    bool watches_modes;                      /* the held coordinates of the start determine all others */
    int mode_changes;                        /* of the assembly mode for these; the first one: */
    double mode_t[2];                        /* between these rows */
    int mode_coordinate;                     /* a coordinate of the loops that pass to it */
    double *reaction;                        /* 3 a closure, at the last row; NaN when there is none */
    double *shown;                           /* values of outputs in addition to the table, per row */
    bool least_norm;                         /* loads that redundant constraints share */
    kmp_run_spec spec;                       /* as it was run, without its times and log; it points into the arena */
    bool interrupted;                        /* by the user */
    kmp_recording *recording;                /* NULL: none is kept */
    void *judged;                            /* by kmp_run_judge_find(); NULL: not */
    struct kmp_reaction_watch *watch;        /* of the largest reactions of the motion; NULL: they are of the rows */
    const struct kmp_start_balance *balance; /* at which it began; NULL: at none */
    double *at;                              /* 3 n + m: a row between the rows of the table */
};

/** Unit of the number that differs most in the repeat run; "": a state; NULL: there is none. */
const char *kmp_trajectory_unit(const kempe_trajectory *t);

/** The largest scaled residual of closures of a run that is trusted; whether the energy balance exceeds its limit, a
 * part KMP_VISIBLE of the energy exchanged. */
double kmp_trajectory_trusted_gap(const kempe_trajectory *t);
bool kmp_trajectory_loses_energy(const kempe_trajectory *t);

/** The outputs in addition to the table (model/data/output_table.h) at a row; owned by the evaluator. */
const double *kmp_samples_shown(const kmp_samples *table, kmp_evaluator *eval, int row);

/** Studies that make runs, whose options are rows of model/data/run_options.def. */
typedef enum kmp_run_study {
    KMP_STUDY_SIMULATION = 1,
    KMP_STUDY_COMFORT = 2,
    KMP_STUDY_STEPPER = 4,
    KMP_STUDY_ENSEMBLE = 8,
    KMP_STUDY_HISTORY = 16, /* of instances */
    KMP_STUDY_SENSITIVITY = 32,
    KMP_STUDY_STATE = 64, /* a sensitivity of a state */
    KMP_STUDY_FLOW = 128,
    KMP_STUDY_FIT = 256,
    KMP_STUDY_OPTIMUM = 512,
    KMP_STUDY_CYCLES = 1024
} kmp_run_study;

/** Refuses options that are given and that the study, or none of several, takes. */
kempe_status kmp_run_options_check(kempe_context *context, const kempe_run_options *run, unsigned studies);

/** The run of the options, with names and defaults resolved. `spec` points into the arena and to the strings of `run`.
 */
kempe_status kmp_spec_of(const kempe_system *system, const kempe_run_options *run, kmp_arena *arena,
                         kmp_run_spec *spec);

/** Sets the numbers and the integrator of `run` to the resolved ones: the same run again. */
void kmp_spec_numbers(const kmp_run_spec *spec, kempe_run_options *run);

/* The compliant contacts of a run: how often and how long their bodies touched, and how deep each contact was. */
enum { KMP_DEPTHS = 5 }; /* least, quartiles, largest */

typedef struct kmp_contact_times {
    int force;
    int begun;                /* contacts that began during the run */
    int ended;                /* contacts with a depth: the contacts that ended */
    double depth[KMP_DEPTHS]; /* least one, quartiles and largest one of their largest depths; NaN without contacts */
    double touching;          /* part of the time */
    const char *turning;      /* the driven coordinate that turned farthest, NULL: none turned once */
    double turns;
} kmp_contact_times;

/** The judge of this build; NULL: there is none. */
const kmp_run_judge *kmp_run_judge_find(void);

/** Reads the options; the reference, the times of rows and the state to continue from. */
kempe_status kmp_simulation_begin(struct kmp_simulation *simulation, const kempe_system *system,
                                  const kempe_run_options *options);

/** Integrates. The trajectory then has its rows and its status with a reason. */
kempe_status kmp_simulation_run(struct kmp_simulation *simulation);

/** Judges a trajectory with the status of its run: residuals, energy, differences from a reference, and what a wing
 * judges; then, unless the options leave it out, the same motion at another tolerance. */
kempe_status kmp_simulation_judge(struct kmp_simulation *simulation, kempe_status status);

/** Gives the trajectory to the caller where there is one, and frees the rest. Returns the status. */
kempe_status kmp_simulation_end(struct kmp_simulation *simulation, kempe_status status, kempe_trajectory **trajectory);
