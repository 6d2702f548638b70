/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Kempe: constrained multibody systems, solved along several formulations on the same equations.
 *
 * The header follows the pipeline, one section an arrow:
 *
 *     context   where messages go, what the last complaint was
 *     model     read from a file, frozen, every mistake named
 *     system    equations derived symbolically, programs prepared
 *     check     mobility, redundancy, the choice of independent coordinates
 *     assemble  loops closed from the model's guess
 *     simulate  one formulation, one integrator: a trajectory with its verdict
 *
 * and beside it: compare, and what engineers ask of a mechanism besides its motion (the list of headers below).
 *
 * The law is  M(q) qdd + C(q, qd, t) = Q + J(q, t)' lambda,  h(q, t) = 0, with q the relative joint
 * coordinates of the tree (rad and m), C the bias (Coriolis, centrifugal, gravity, applied forces) and
 * lambda one multiplier a closure row.
 *
 * A function that can fail returns a kempe_status: 0 done, negative an error, positive a normal event.
 * Outputs are untouched on failure. The library never prints, exits or aborts.
 *
 * A struct of options (kempe_run_options, the _ask and _generation of other headers) may be NULL: its defaults. NULL
 * for any other pointer that nothing says may be NULL: KEMPE_E_ARGUMENT, with a message where an object with a context
 * is given. Getters of NULL, or of an index that does not exist, give what their type has for nothing: NULL, a text "",
 * NaN, 0 (-1 where 0 means something). `_free` takes NULL.
 *
 * A model and a system are
 * frozen once made and may be read by several threads; each call below makes its own workspace.
 */
#ifndef KEMPE_KEMPE_H
#define KEMPE_KEMPE_H

#include <stddef.h>

#if defined(__GNUC__)
#define KEMPE_API __attribute__((visibility("default")))
#else
#define KEMPE_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define KEMPE_VERSION "0.1.0"

typedef enum kempe_status {
    KEMPE_OK = 0,
    KEMPE_STOPPED = 1,     /* ended early for a good reason (a lock, an interrupt): see the reason */
    KEMPE_E_MEMORY = -1,   /* out of memory */
    KEMPE_E_INPUT = -2,    /* the model or reference file is wrong: file:line:column said */
    KEMPE_E_FAILED = -3,   /* the computation could not be done as asked: reason said */
    KEMPE_E_IO = -4,       /* a file could not be read or written */
    KEMPE_E_ARGUMENT = -5, /* an option names nothing that exists */
    KEMPE_E_BUG = -6       /* a defect of Kempe: please report it */
} kempe_status;

/** A status in words: "done", "out of memory", ...; never NULL. */
KEMPE_API const char *kempe_status_text(kempe_status status);

typedef enum kempe_format { KEMPE_TEXT, KEMPE_JSON } kempe_format;

/* -- context ------------------------------------------------------------------------------------- */

typedef struct kempe_context kempe_context;

typedef enum kempe_level { KEMPE_LOG_PROGRESS, KEMPE_LOG_NOTE, KEMPE_LOG_WARNING } kempe_level;

/** Receives one line without newline. `user` is what was given with it. */
typedef void kempe_log_fn(void *user, kempe_level level, const char *line);

/** One a thread. Returns NULL when there is no memory. */
KEMPE_API kempe_context *kempe_context_new(void);
KEMPE_API void kempe_context_free(kempe_context *context);
KEMPE_API void kempe_context_set_log(kempe_context *context, kempe_log_fn *log, void *user);

/** What the last failing call complained of: sentences, one a line, never NULL. Owned by the context,
 *  valid until its next call. */
KEMPE_API const char *kempe_context_message(const kempe_context *context);

/** Asks the computation of this context that is running, or the next one where none is, to end at its next step with
 *  KEMPE_STOPPED. That one alone: what is called afterwards runs as if nothing had been asked. May be called from a
 *  signal handler or another thread. */
KEMPE_API void kempe_context_interrupt(kempe_context *context);

/** Frees text made by a `_print` function. */
KEMPE_API void kempe_text_free(char *text);

/* -- model --------------------------------------------------------------------------------------- */

typedef struct kempe_model kempe_model;

/** Reads a model file (docs/model_format.md) and freezes it. The context must outlive the model.
 *  KEMPE_E_INPUT: every mistake found, as file:line:column sentences in the context's message. */
KEMPE_API kempe_status kempe_model_read(kempe_context *context, const char *path, kempe_model **model);

/** The same from memory; `label` stands for the file name in messages. */
KEMPE_API kempe_status kempe_model_read_text(kempe_context *context, const char *text, const char *label,
                                             kempe_model **model);

/** What a parameter of the model is set to instead: an expression as in the file ("0.3", "7800 kg/m^3", "2*L1"). */
typedef struct kempe_setting {
    const char *name, *value;
} kempe_setting;

/** Reads with `count` settings of declared parameters; the last of several for one name counts. */
KEMPE_API kempe_status kempe_model_read_set(kempe_context *context, const char *path, const kempe_setting *settings,
                                            int count, kempe_model **model);
KEMPE_API kempe_status kempe_model_read_text_set(kempe_context *context, const char *text, const char *label,
                                                 const kempe_setting *settings, int count, kempe_model **model);

/** A number as a model file may have it, without parameters: "3", "20 ms", "1/25 s". *value is in `unit`; one without a
 *  unit is so, too. KEMPE_E_ARGUMENT: no such number, or one of something else. */
KEMPE_API kempe_status kempe_number_read(kempe_context *context, const char *text, const char *unit, double *value);
KEMPE_API void kempe_model_free(kempe_model *model);
KEMPE_API const char *kempe_model_name(const kempe_model *model);

/** What closures that say what others say may stay open by, m, in place of the model's closure_tolerance, before a
 * system is made of it: their points and axes are then taken as rounded. 0: no closure stays open. KEMPE_E_ARGUMENT: it
 * is negative or no number. */
KEMPE_API kempe_status kempe_model_set_closure_tolerance(kempe_model *model, double metres);

/** Number n of joint coordinates, and the name of the k-th (`joint` or `joint.k`). */
KEMPE_API int kempe_model_coordinate_count(const kempe_model *model);
KEMPE_API const char *kempe_model_coordinate_name(const kempe_model *model, int k);

/** The model as Kempe understood it. */
KEMPE_API kempe_status kempe_model_print(const kempe_model *model, kempe_format format, char **text);

/* A model may also be built in code: kempe/build.h, which this header includes at its end. */

/* -- system: the derived equations ----------------------------------------------------------------- */

typedef struct kempe_system kempe_system;

/** Derives what the formulations need. The model must outlive the system. KEMPE_E_INPUT: a closure that can never be
 * met, a joint that moves no mass. */
KEMPE_API kempe_status kempe_system_new(const kempe_model *model, kempe_system **system);

/** The same with a word for how the dynamics are written: auto, composite, plain, ner or articulated; NULL: the
 * model's, or auto, which takes what costs less. KEMPE_E_ARGUMENT: there is no such word. KEMPE_E_FAILED: the
 * accelerations cannot be written by articulated bodies, and why. */
KEMPE_API kempe_status kempe_system_new_with_algorithm(const kempe_model *model, const char *dynamics,
                                                       kempe_system **system);
KEMPE_API void kempe_system_free(kempe_system *system);

/** Number of closure rows that do not vanish identically, and the name of row k: `closure.1` ... */
KEMPE_API int kempe_system_row_count(const kempe_system *system);
KEMPE_API const char *kempe_system_row_name(const kempe_system *system, int k);

typedef enum kempe_view {
    KEMPE_VIEW_EQUATIONS, /* M, C, h, J, jdqd as named scalar assignments */
    KEMPE_VIEW_PROGRAM,   /* the staged straight-line program of the reduced formulation */
    KEMPE_VIEW_STATS,     /* operation counts by set and stage; what each simplification gains */
    KEMPE_VIEW_PASSES /* the equations before the passes and after each one that changes them; as text, then stats */
} kempe_view;

KEMPE_API kempe_status kempe_system_print(const kempe_system *system, kempe_view view, kempe_format format,
                                          char **text);

/* What sets of equations cost, and their text in other languages: kempe/generate.h, which this header includes at its
 * end. */

/* The equations at a state of your choice: kempe/workspace.h; forces by a function of yours: kempe/extend.h. This
 * header includes both at its end. */

/* -- check and assemble ---------------------------------------------------------------------------- */

typedef struct kempe_assembly kempe_assembly;

/** Closes the loops from the model's guess: held coordinates stay, rates are made consistent.
 *  KEMPE_E_FAILED: the loop that stays open and its gap are in the context's message; `*assembly` is
 *  then still given, with the best configuration found. */
KEMPE_API kempe_status kempe_assemble(const kempe_system *system, kempe_assembly **assembly);
KEMPE_API void kempe_assembly_free(kempe_assembly *assembly);

/** q and qd of the assembled state, n values, owned by the assembly. */
KEMPE_API const double *kempe_assembly_q(const kempe_assembly *assembly);
KEMPE_API const double *kempe_assembly_qd(const kempe_assembly *assembly);
KEMPE_API kempe_status kempe_assembly_print(const kempe_assembly *assembly, kempe_format format, char **text);

/* Other assembly modes: kempe/branches.h, which this header includes at its end. */

typedef struct kempe_check kempe_check;

/** Mobility, redundant rows (always, or only here) and what may be left out, the independent coordinates that the
 * formulations will use and why, limits of motion. KEMPE_E_FAILED for what does not assemble: `*check` is then still
 * given and says what stands in the way. */
KEMPE_API kempe_status kempe_check_new(const kempe_system *system, kempe_check **check);
KEMPE_API void kempe_check_free(kempe_check *check);
KEMPE_API kempe_status kempe_check_print(const kempe_check *check, kempe_format format, char **text);

/* -- simulate -------------------------------------------------------------------------------------- */

/** What to run. Names are those of the command line; NULL, or 0 for a number, takes the model's or
 *  Kempe's default. */
typedef struct kempe_run_options {
    const char *formulation; /* reduced | dae | projected */
    const char *form;        /* reduced: integrated | newton;  dae: stabilized1;  projected: none */
    const char *integrator;  /* dop853 | dopri5 | adams | bdf | radau5 | radau9 | erk | dirk | ida */
    const char *linear;      /* dae: auto, klu, umfpack, dense */
    const char
        *backend; /* native (default: machine code on x86-64 with AVX, elsewhere the tape), tape: the same bits */
    const char *independent;   /* independent coordinates to begin with, comma-separated */
    int keep_independent;      /* keep them: the run fails where they go bad, instead of exchanging them */
    const char *change_points; /* leap (default): looked for and led through; ignore: neither, for those who know */
    double rtol;               /* relative tolerance, > 0 */
    double atol;               /* absolute tolerance of an angle; lengths and rates scale it. Default rtol */
    double t_end;              /* s */
    double output_step;        /* s between output rows */
    const char *reference;     /* CSV file to measure errors against */
    const char *checkpoint;    /* file that a long run leaves its rows in, every few seconds and at its end */
    const char *resume;        /* such a file to go on from */
    int threads; /* 1 to 64 that share the work of each evaluation of the native back end, in kempe_simulate and
                  * steppers: the same bits; others ignore it, and so do processors without AVX. 0: one */
    int no_convergence_check; /* no other run at another tolerance, which warns when this one has not converged */
    long max_steps; /* the run fails after so many, rejected ones included. 0: the model's, or else where the last
                     * 100,000 steps gained so little time that the rest would take more than 1e8 */
} kempe_run_options;

KEMPE_API kempe_run_options kempe_run_options_default(void);

typedef struct kempe_trajectory kempe_trajectory;

/** Runs one formulation, and when it came to its end once more at another tolerance, unless `once`: a warning is logged
 * when q comes out otherwise by more than errors of steps explain. On KEMPE_E_FAILED and KEMPE_STOPPED `*trajectory` is
 * given too, up to where it came. */
KEMPE_API kempe_status kempe_simulate(const kempe_system *system, const kempe_run_options *run,
                                      kempe_trajectory **trajectory);
KEMPE_API void kempe_trajectory_free(kempe_trajectory *trajectory);

/** Rows of the table; the first is the assembled start. */
KEMPE_API int kempe_trajectory_row_count(const kempe_trajectory *trajectory);
KEMPE_API double kempe_trajectory_time(const kempe_trajectory *trajectory, int row);

/** One row of q, qd, qdd (n values) and lambda (row_count of the system), owned by the trajectory. */
KEMPE_API const double *kempe_trajectory_q(const kempe_trajectory *trajectory, int row);
KEMPE_API const double *kempe_trajectory_qd(const kempe_trajectory *trajectory, int row);
KEMPE_API const double *kempe_trajectory_qdd(const kempe_trajectory *trajectory, int row);
KEMPE_API const double *kempe_trajectory_lambda(const kempe_trajectory *trajectory, int row);

/** "ok", "stopped" or "failed", and the sentence that goes with it ("" when ok). */
KEMPE_API const char *kempe_trajectory_status(const kempe_trajectory *trajectory);
KEMPE_API const char *kempe_trajectory_reason(const kempe_trajectory *trajectory);

/** What happened between steps, in order, the first thousand: coordinates exchanged, other rows taken, change points
 * passed, conditions that changed, restarts. A sentence owned by the trajectory, its time in *t (may be NULL); NULL
 * when there is no k-th. */
KEMPE_API int kempe_trajectory_note_count(const kempe_trajectory *trajectory);
KEMPE_API const char *kempe_trajectory_note(const kempe_trajectory *trajectory, int k, double *t);

KEMPE_API kempe_status kempe_trajectory_print(const kempe_trajectory *trajectory, kempe_format format, char **text);

/** Writes the table as CSV (a comment with the units; t, q.NAME, qd.NAME, qdd.NAME, lambda.CLOSURE.k, outputs), whole
 * or not at all. */
KEMPE_API kempe_status kempe_trajectory_write_csv(const kempe_trajectory *trajectory, const char *path);

/** The same for NumPy: `names`, `units` (a column each) and `values` (rows x columns) in one .npz, whole or not at all.
 */
KEMPE_API kempe_status kempe_trajectory_write_npz(const kempe_trajectory *trajectory, const char *path);

/* The other headers, which this one includes at its end:
 *
 *     stepper.h       the same step by step
 *     compare.h       many formulations and tolerances against a reference
 *     ensemble.h      many instances of one mechanism with different parameters
 *     kinematics.h    coordinates led through a range
 *     equilibrium.h   where a mechanism stays at rest or moves on steadily
 *     contact_table.h wheels on their rails over a range
 *     inverse.h       the efforts that a motion takes
 *     linearize.h     state spaces near a state; response.h: answers to what swings
 *     modes.h         eigenvalues and shapes, and what becomes of them when a parameter varies
 *     contact.h       rolling contact: ellipses and laws of creep, by themselves
 *     sensitivity.h   how results move with parameters; gradient.h: the same for optimisers */

/** Writes text to a file whole or not at all (a temporary beside it, then renamed). */
KEMPE_API kempe_status kempe_write_file(kempe_context *context, const char *path, const char *text);

#ifdef __cplusplus
}
#endif

#include <kempe/branches.h>
#include <kempe/build.h>
#include <kempe/compare.h>
#include <kempe/contact.h>
#include <kempe/contact_table.h>
#include <kempe/ensemble.h>
#include <kempe/equilibrium.h>
#include <kempe/extend.h>
#include <kempe/generate.h>
#include <kempe/gradient.h>
#include <kempe/inverse.h>
#include <kempe/kinematics.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>
#include <kempe/stepper.h>
#include <kempe/workspace.h>

#endif
