/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Kempe: constrained multibody systems, solved by several formulations of the same equations.
 *
 * The header follows the pipeline, one section for each step:
 *
 *     context   receives messages, keeps the last error
 *     model     read from a file and frozen, with every error reported
 *     system    equations derived symbolically, programs prepared
 *     simulate  one formulation, one integrator: a trajectory with accuracy checks
 *
 * This is the core. A program includes a further header for each study that it uses:
 *
 *     check.h         mobility, redundancy, the assembled state, assembly modes
 *     settings.h      models with other parameters, tolerances and algorithms; build.h: models made in code
 *     table.h         results of all studies as tables: read by name, printed, written as CSV, JSON, NPZ
 *     stepper.h       a run advanced step by step; extend.h: user-defined forces
 *     output_handles.h outputs at any state, and their Jacobians
 *     workspace.h     M, C, h, J at a given state; forward and inverse dynamics
 *     compare.h       many formulations and tolerances against a reference
 *     ensemble.h      many instances of one mechanism with different parameters
 *     kinematics.h    position analysis over a range of coordinates
 *     equilibrium.h   static and steady-state equilibria
 *     inverse.h       actuator forces of a prescribed motion
 *     linearize.h     state spaces about a state; response.h: frequency response
 *     modes.h         eigenvalues and mode shapes, also over the values of a parameter; limit_cycles.h: limit cycles
 *     sensitivity.h   sensitivities of results to parameters; gradient.h, flow.h: for optimisers
 *     fit.h           parameters from measured motions; optimize.h: best parameters under limits
 *     vehicle.h       wheels on their rails over a range; rolling_contact.h: laws of rolling contact
 *     comfort.h       ride comfort; reduce.h: flexible bodies from meshes of finite elements
 *     generate.h      operation counts, equations in other languages, functional mock-up units
 *     cache.h         a folder that keeps derived equations for the next time
 *
 * The equations of motion are M(q) qdd + C(q, qd, t) = Q + J(q, t)' lambda, h(q, t) = 0. q are the relative joint
 * coordinates of the tree (rad and m), and C is the bias (Coriolis, centrifugal, gravity, applied forces). lambda has
 * one Lagrange multiplier for each closure row. A model with states has an entry for each of them at the end
 * of q, qd and qdd: in qd the value of the state, in qdd its rate, in q its integral, which no equation contains.
 *
 * A function that can fail returns a kempe_status: 0 done, negative an error, positive a normal event.
 * Outputs are untouched on failure. The library never prints, exits or aborts.
 *
 * A struct of options (kempe_run_options, the _options of other headers) may be NULL or zero: its defaults. A member
 * that is 0 or NULL is not given: where a caller can leave a value out in another way, as the command and Python can, a
 * zero is passed on as a mistake. The member `size` keeps programs compatible with later libraries: 0 means the members
 * of version 0.1, the size of the struct all of them. Options that the library does not know give KEMPE_E_ARGUMENT. Any
 * other NULL pointer gives KEMPE_E_ARGUMENT unless its comment allows it, with a message if an object with a context is
 * given. Getters of NULL, or of an index that does not exist, return the empty value of their type: NULL, a text "",
 * NaN, 0
 * (-1 if 0 has a meaning). `_free` accepts NULL.
 *
 * A model and a system are frozen once made and may be read by several threads; each call below makes its own
 * workspace.
 */
#ifndef KEMPE_KEMPE_H
#define KEMPE_KEMPE_H

#include <stddef.h>

#if defined(__GNUC__)
#define KEMPE_API __attribute__((visibility("default")))
#else
#define KEMPE_API
#endif

/* Declarations between these are C, also for C++. */
#ifdef __cplusplus
#define KEMPE_BEGIN extern "C" {
#define KEMPE_END   }
#else
#define KEMPE_BEGIN
#define KEMPE_END
#endif

KEMPE_BEGIN

#define KEMPE_VERSION       "0.2.0"
#define KEMPE_VERSION_MAJOR 0
#define KEMPE_VERSION_MINOR 2
#define KEMPE_VERSION_PATCH 0

/** The version of the library that runs, as KEMPE_VERSION is the version of the header; never NULL. */
KEMPE_API const char *kempe_version(void);

typedef enum kempe_status {
    KEMPE_OK = 0,
    KEMPE_STOPPED = 1,   /* stopped early by an event (a lock, an interrupt): see the reason */
    KEMPE_UNTRUSTED = 2, /* complete, but a check of the result failed: the warnings say which */
    KEMPE_E_MEMORY = -1, /* out of memory */
    KEMPE_E_INPUT = -2,  /* the model, a reference, a quantity or a limit is wrong: the message has file:line:column */
    KEMPE_E_FAILED = -3, /* the computation is impossible as requested: the message has the reason */
    KEMPE_E_IO = -4,     /* a file could not be read or written */
    KEMPE_E_ARGUMENT = -5, /* the name or value of an option does not exist */
    KEMPE_E_BUG = -6       /* a defect of Kempe: please report it */
} kempe_status;

/** A status as text: "done", "out of memory", ...; never NULL. */
KEMPE_API const char *kempe_status_text(kempe_status status);

/** The end of a result. A kempe_status is the end of a call. */
typedef enum kempe_outcome {
    KEMPE_OUTCOME_NONE,            /* of no result */
    KEMPE_OUTCOME_COMPLETE,        /* it is whole, and no check of it failed */
    KEMPE_OUTCOME_NOT_CHECKED,     /* complete, but not repeated to compare */
    KEMPE_OUTCOME_NOT_TRUSTWORTHY, /* complete, but a check of it failed: the warnings say which */
    KEMPE_OUTCOME_STOPPED,         /* it ends early, by an event: see the reason */
    KEMPE_OUTCOME_FAILED           /* it ends where the computation became impossible: see the reason */
} kempe_outcome;

/** An outcome as text: "", "complete", "complete, not checked", "not trustworthy", "stopped", "failed", as `status` in
 * JSON and tables; never NULL. */
KEMPE_API const char *kempe_outcome_text(kempe_outcome outcome);

/** KEMPE_FULL_TEXT: the text with all details, where KEMPE_TEXT is a short form, as of kempe_check_print. */
typedef enum kempe_format { KEMPE_TEXT, KEMPE_JSON, KEMPE_FULL_TEXT } kempe_format;

/* -- context ------------------------------------------------------------------------------------- */

typedef struct kempe_context kempe_context;

typedef enum kempe_level { KEMPE_LOG_PROGRESS, KEMPE_LOG_INFO, KEMPE_LOG_WARNING } kempe_level;

/** Receives one line without newline. `user` is the pointer given with the function. */
typedef void kempe_log_fn(void *user, kempe_level level, const char *line);

/** Makes a context, one per thread. Returns NULL when memory is exhausted. */
KEMPE_API kempe_context *kempe_context_new(void);
KEMPE_API void kempe_context_free(kempe_context *context);
KEMPE_API void kempe_context_set_log(kempe_context *context, kempe_log_fn *log, void *user);

/** The progress of a long computation: `done` of `total`. `unit` is "s" for the simulated time of a run, which may be
 * a part of another computation; otherwise a plural: "rows", "runs", "instances", "frequencies", "values", "starts". */
typedef struct kempe_progress {
    double done, total;
    const char *unit;
    double elapsed_s; /* on the wall, since the count of this unit began */
    double left_s;    /* estimate at the pace so far; -1 while there is none */
} kempe_progress;

/** Receives the progress of a computation, in the thread that called it. It may interrupt the context. */
typedef void kempe_progress_fn(void *user, const kempe_progress *progress);

/** Calls a function about every `interval` seconds on the wall during long computations, not before `interval` seconds
 * have passed, and at the end of what was reported. Interval 0: after every step. Results do not depend on it. NULL: no
 * more calls. */
KEMPE_API void kempe_context_set_progress(kempe_context *context, double interval, kempe_progress_fn *progress,
                                          void *user);

/** Unit of angles in texts, tables, pictures and pages that are made from now on, also of their rates and
 * accelerations: "rad" (default) or "deg". JSON of results and all other numbers of this interface remain in SI.
 * KEMPE_E_ARGUMENT: another unit. */
KEMPE_API kempe_status kempe_context_set_angle_unit(kempe_context *context, const char *unit);

/** System of units in texts, tables, pictures and pages that are made from now on: "si" (default); "mm" (mm, kg, s, N,
 * N mm, MPa; J, W) or "us" (in, lb, s, lbf, lbf in, psi; hp). Angles are as kempe_context_set_angle_unit has them. JSON
 * of results and all other numbers of this interface remain in SI. KEMPE_E_ARGUMENT: another system. */
KEMPE_API kempe_status kempe_context_set_units(kempe_context *context, const char *system);

/** Message of the last failing call: sentences, one per line, never NULL. Owned by the context, valid until its next
 * call. */
KEMPE_API const char *kempe_context_message(const kempe_context *context);

/** Asks the running computation of this context to end at its next step with KEMPE_STOPPED; without one, the next
 * computation. Later computations are not affected. May be called from a signal handler or another thread. */
KEMPE_API void kempe_context_interrupt(kempe_context *context);

/** Withdraws an interrupt that no computation has seen, so that the next one is not ended. */
KEMPE_API void kempe_context_clear_interrupt(kempe_context *context);

/** Frees text made by a `_print` function. */
KEMPE_API void kempe_text_free(char *text);

/* -- model --------------------------------------------------------------------------------------- */

typedef struct kempe_model kempe_model;

/** Reads a model file (docs/model/README.md) and freezes it. The context must outlive the model. KEMPE_E_INPUT: the
 * context's message has every error, as file:line:column sentences. */
KEMPE_API kempe_status kempe_model_read(kempe_context *context, const char *path, kempe_model **model);

/** Reads a model from memory, as kempe_model_read from a file; `label` replaces the file name in messages. */
KEMPE_API kempe_status kempe_model_read_text(kempe_context *context, const char *text, const char *label,
                                             kempe_model **model);

/** The library of machine elements, models with ports that others include (docs/elements.md): their number, and the
 * name of the k-th, such as "kempe:gas_spring.yaml". */
KEMPE_API int kempe_element_count(void);
KEMPE_API const char *kempe_element_name(int k);

/** The text of an element of this name (free with kempe_text_free). KEMPE_E_IO: there is none of it. */
KEMPE_API kempe_status kempe_element_text(kempe_context *context, const char *name, char **text);

KEMPE_API void kempe_model_free(kempe_model *model);
KEMPE_API const char *kempe_model_name(const kempe_model *model);

/** Number n of joint coordinates, and the name of the k-th (`joint` or `joint.k`). */
KEMPE_API int kempe_model_coordinate_count(const kempe_model *model);
KEMPE_API const char *kempe_model_coordinate_name(const kempe_model *model, int k);

/** Prints the model as parsed. */
KEMPE_API kempe_status kempe_model_print(const kempe_model *model, kempe_format format, char **text);

/** Writes the model in another format, "urdf+", "sdf" or "mjcf". A part that the format cannot say is named in the log;
 * in a strict context (kempe/settings.h) it is an error, KEMPE_E_INPUT. "yaml": Kempe's language, of a model that was
 * read from another format or built in code. KEMPE_E_ARGUMENT: an unknown format, or a file in that language already.
 * In libraries built with KEMPE_EXCHANGE, the default. */
KEMPE_API kempe_status kempe_model_export(const kempe_model *model, const char *format, char **text);

/* -- system: the derived equations ----------------------------------------------------------------- */

typedef struct kempe_system kempe_system;

/** Derives the equations that the formulations need. The model must outlive the system. KEMPE_E_INPUT: a closure that
 * can never be met, or a joint that moves no mass. */
KEMPE_API kempe_status kempe_system_new(const kempe_model *model, kempe_system **system);

KEMPE_API void kempe_system_free(kempe_system *system);

/** Number of constraint equations, without equations that always hold, and the name of row k: `closure.1` ... */
KEMPE_API int kempe_system_row_count(const kempe_system *system);
KEMPE_API const char *kempe_system_row_name(const kempe_system *system, int k);

typedef enum kempe_view {
    KEMPE_VIEW_EQUATIONS, /* M, C, h, J, jdqd as named scalar assignments */
    KEMPE_VIEW_PROGRAM,   /* the staged straight-line program of the reduced formulation */
    KEMPE_VIEW_STATS,     /* operation counts by set and stage; gain of each simplification */
    KEMPE_VIEW_PASSES /* the equations before the passes and after each one that changes them; as text, then stats */
} kempe_view;

KEMPE_API kempe_status kempe_system_print(const kempe_system *system, kempe_view view, kempe_format format,
                                          char **text);

/* -- simulate -------------------------------------------------------------------------------------- */

/** Options of a run. Names are as on the command line; NULL, or 0 for a number, takes the model's value where it has
 * one, or else the default. */
typedef struct kempe_run_options {
    size_t size; /* sizeof this struct; 0: its size in version 0.1 */
    /* end of the run, s (default: 1) */
    double t_end;
    /* time between two rows of the result, s (default: t_end / 200) */
    double output_step;
    /* relative tolerance (default: 1e-8) */
    double rtol;
    /* absolute tolerance of an angle, rad; lengths have atol times the characteristic length; another rtol than the
     * model's keeps the ratio to rtol (default: rtol) */
    double atol;
    /* longest step of the integrator, s; with it no step passes a short disturbance unseen, such as a fault of a track
     * (default: by the tolerances) */
    double max_step;
    /* largest number of steps, rejected ones included; beyond it the run fails (default: until the rest would take
     * 1e8) */
    long max_steps;
    /* length of all steps of dop853 and dopri5, without error control, s (default: by the tolerances) */
    double fixed_step;
    /* formulation: reduced, projected, dae (default: reduced) */
    const char *formulation;
    /* form of the formulation's equations (reduced: integrated, newton); dae: index1, stabilized1, ..; projected: none
     * (default: chosen) */
    const char *form;
    /* integrator: dop853, dopri5, adams, bdf, radau, radau5, radau9, erk, dirk, ida (default: dop853 or radau, the
     * faster one; dae: radau or ida) */
    const char *integrator;
    /* change points (bifurcations): cross detects and crosses them, ignore does neither (default: cross) */
    const char *change_points;
    /* independent coordinates at the start (default: chosen automatically) */
    const char *independent;
    /* 1: keep the given independent coordinates; fail if they become singular */
    int keep_independent;
    /* linear solver of IDA: klu, umfpack, dense; with one of them dae has IDA as its integrator (default: auto) */
    const char *linear;
    /* evaluator of the equations: native machine code, or tape, an interpreter; both give the same bits (default:
     * native, where machine code runs) */
    const char *backend;
    /* threads that share each evaluation of the equations, 1 to 64; for large models; in kempe_simulate and steppers,
     * with the same bits. Other back ends than native, and processors without machine code, ignore it.
     * kempe_ensemble_run: threads that share the instances (default: 1) */
    int threads;
    /* 1: do not repeat the run at another tolerance, which would warn of missing convergence */
    int no_convergence_check;
    /* 1: repeat the whole run of a vehicle on rails, of which otherwise parts are repeated, if these are clearly
     * accurate (docs/theory.md) */
    int full_convergence_check;
    /* reference solution for measuring errors, a CSV file (default: none) */
    const char *reference;
    /* loads of joints that redundant constraints share: least-norm, in outputs and reactions of kempe_simulate
     * (default: one solution) */
    const char *loads;
    /* largest reactions of joints: of the rows of the result, or of the whole motion, from the dense output of each
     * step; with bearings in the model they are always of the motion (default: rows) */
    const char *reaction_peaks;
    /* write the rows to this file every 10 s and at the end (default: none) */
    const char *checkpoint;
    /* continue from a checkpoint (default: none) */
    const char *resume;
    /* 1: the trajectory keeps the dense output of every step, for kempe_trajectory_at_time (output_handles.h) */
    int keep_dense;
    /* 1: kempe_simulate evaluates the running safety of wheels on rails, from the dense output and the static loads of
     * an equilibrium (docs/model/wheels.md) */
    int judge_safety;
} kempe_run_options;

typedef struct kempe_trajectory kempe_trajectory;
typedef struct kempe_table kempe_table; /* table.h */

/** Runs one formulation. A run that reaches its end is repeated at another tolerance, unless no_convergence_check is
 * set: a warning is logged when q differs by more than step errors explain. On KEMPE_E_FAILED and KEMPE_STOPPED
 * `*trajectory` is given too, up to the last step. */
KEMPE_API kempe_status kempe_simulate(const kempe_system *system, const kempe_run_options *run,
                                      kempe_trajectory **trajectory);
KEMPE_API void kempe_trajectory_free(kempe_trajectory *trajectory);

/** Rows of the table; the first is the assembled start. */
KEMPE_API int kempe_trajectory_row_count(const kempe_trajectory *trajectory);
KEMPE_API double kempe_trajectory_time(const kempe_trajectory *trajectory, int row);

/** One row of q, qd, qdd (n values) and lambda (row_count of the system), owned by the trajectory. Rows of a quantity
 * follow each other in memory: row 0 begins a row-major matrix. */
KEMPE_API const double *kempe_trajectory_q(const kempe_trajectory *trajectory, int row);
KEMPE_API const double *kempe_trajectory_qd(const kempe_trajectory *trajectory, int row);
KEMPE_API const double *kempe_trajectory_qdd(const kempe_trajectory *trajectory, int row);
KEMPE_API const double *kempe_trajectory_lambda(const kempe_trajectory *trajectory, int row);

/** Its outcome, and the reason as a sentence ("" when complete). */
KEMPE_API kempe_outcome kempe_trajectory_outcome(const kempe_trajectory *trajectory);
KEMPE_API const char *kempe_trajectory_reason(const kempe_trajectory *trajectory);

KEMPE_API kempe_status kempe_trajectory_print(const kempe_trajectory *trajectory, kempe_format format, char **text);

/** Tables: "rows": t and the outputs (q.NAME, qd.NAME, qdd.NAME, lambda.CLOSURE.k, ..). "log": events between steps,
 * the first thousand (independent coordinates changed, other rows taken, change points crossed, conditions that
 * changed, restarts): t, kind (one word), text (a sentence), and the numbers before and after if a number is measured.
 * "contacts": each contact of a compliant contact, its name, its beginning (NaN: before the run), its end (NaN: it has
 * not ended) and its largest depth in m or rad. "reactions": a row for each joint of the tree, each closure, each
 * drive and each tyre: joint, kind ("joint": of the tree; "tyre"; otherwise the kind of the closure), force, the
 * largest size over the rows (N), force.t, when it is reached first, force.x .. force.z, the vector then, on the second
 * body of the joint in ground axes; moment .. moment.z likewise, about the joint's point of that body (N m); unique, 0:
 * redundant constraints share it; note, why it is not known. NaN: the joint has none. Drives and other rows between
 * coordinates have one number, as force.x or moment.x. Vectors of a tyre are along the axes of its contact. It is
 * computed at each call. KEMPE_E_ARGUMENT: another name. */
KEMPE_API kempe_status kempe_trajectory_table(const kempe_trajectory *trajectory, const char *name,
                                              kempe_table **table);

/** A table "outputs": t and the outputs that a list names, "q(A),force(spring),position(b.P).x", at the rows of the
 * trajectory, whether or not the model requests them. KEMPE_E_ARGUMENT: a name is wrong. */
KEMPE_API kempe_status kempe_trajectory_outputs(const kempe_trajectory *trajectory, const char *names,
                                                kempe_table **table);

/** Writes a self-contained HTML page: the mechanism moving up to the end of the run, all outputs over time with their
 * extreme values, events, energies, residuals, parameters and the text of the model. The run is repeated with
 * monitoring. KEMPE_E_IO: the path cannot be written. As all functions ..._write_report it is in libraries built with
 * KEMPE_REPORT, the default. */
KEMPE_API kempe_status kempe_trajectory_write_report(const kempe_trajectory *trajectory, const char *path);

/** The same page, with dotted curves of an earlier run behind the curves of this one: columns of `earlier` over its
 * column t that have names of this run's outputs (kempe_trajectory_table, kempe_table_read). KEMPE_E_INPUT: it has no
 * t, no such column, no rows, no time of this run, or a column in a unit of another dimension. A warning says where
 * only a part of the times is in both. */
KEMPE_API kempe_status kempe_trajectory_write_report_against(const kempe_trajectory *trajectory,
                                                             const kempe_table *earlier, const char *path);

/** Writes the moving mechanism. `path` ends with .glb: one binary file of glTF 2.0, a node for each body with its
 * shape, and an animation by the rows of the run; m, y up, against gravity. It ends with .json: the data of the picture
 * of a result page, in SI: drawn parts of each body, its poses by the rows of the run, the largest forces between
 * bodies. KEMPE_E_ARGUMENT: another ending, or .glb for a model with flexible bodies, one of which is named.
 * KEMPE_E_FAILED: the run has no rows. KEMPE_E_IO: the path cannot be written. Libraries with KEMPE_PICTURE have it. */
KEMPE_API kempe_status kempe_trajectory_write_animation(const kempe_trajectory *trajectory, const char *path);

/** 1: a model or a mesh was read from this file with the context, also as a part of another one; 0: none was. Functions
 * that write files refuse such a file with KEMPE_E_ARGUMENT, so that no result destroys what it was made from. */
KEMPE_API int kempe_context_is_source(const kempe_context *context, const char *path);

/** Writes text to a file whole or not at all (through a temporary file in the same folder, then renamed). */
KEMPE_API kempe_status kempe_write_file(kempe_context *context, const char *path, const char *text);

KEMPE_END

#endif
