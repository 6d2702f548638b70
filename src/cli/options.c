/* SPDX-License-Identifier: BSD-3-Clause */
/* Option parsing. A new option is one row of `options`; help text, parser and suggestions follow from it. Options of
 * runs are rows of model/data/run_options.def. Accepted: --name value, --name=value, -o value, and `--` before a file
 * name that begins with a dash. */
#include "options.h"
#include "command.h"
#include "platform/platform.h"
#include "terminal.h"

#include <kempe/settings.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* Types of option values. The last ones are files, whose type follows from the ending of their names. */
typedef enum option_kind {
    OPTION_FLAG,
    OPTION_TEXT,
    OPTION_NUMBER,
    OPTION_TIME,
    OPTION_LENGTH,
    OPTION_ANGLE,
    OPTION_WHOLE,
    OPTION_AMOUNT, /* a whole number, or auto: 0 */
    OPTION_LONG,
    OPTION_SETTING,
    OPTION_SYSTEM, /* a system of units, which may be left out */
    OPTION_LIST,   /* given several times: joined by commas */
    OPTION_TABLE,
    OPTION_ARRAYS,
    OPTION_PICTURE,
    OPTION_PAGE,
    OPTION_SCENE,
    OPTION_UNIT,
    OPTION_MODES,
    OPTION_KINDS
} option_kind;

/* Endings of files. Units of quantities: a plain number is in these, "20 ms" or "0.1 mm" in its own. */
static const struct {
    const char *ending, *unit, *example;
} kinds[OPTION_KINDS] = {[OPTION_TIME] = {NULL, "s", "positive time in s, as 3 or '20 ms'"},
                         [OPTION_LENGTH] = {NULL, "m", "length in m, 0 or more, as 1e-5 or '10 um'"},
                         [OPTION_ANGLE] = {NULL, "rad", "positive angle in rad, as 1e-6 or '0.001 deg'"},
                         [OPTION_TABLE] = {.ending = ".csv, .parquet, .npz, .mat, .json"},
                         [OPTION_ARRAYS] = {.ending = ".npz, .mat"},
                         [OPTION_PICTURE] = {.ending = ".svg, .png"},
                         [OPTION_PAGE] = {.ending = ".html, .htm"},
                         [OPTION_SCENE] = {.ending = ".glb, .json"},
                         [OPTION_UNIT] = {.ending = ".fmu"},
                         [OPTION_MODES] = {.ending = ".npz"}};

/* The help prints the options of a command group by group. */
typedef enum option_group { IN_MODEL, IN_RUN, IN_OUTPUT, IN_EXPERT, IN_FOREIGN, OPTION_GROUPS } option_group;

static const char *const groups[OPTION_GROUPS] = {"model values", "run", "output", "expert",
                                                  "models in the formats of other programs"};

typedef struct option {
    unsigned commands;
    option_group group;
    const char *name;
    option_kind kind;
    size_t offset; /* of the value in cli_settings */
    const char *value, *help;
} option;

/* The kind and the place of a value; a flag has none to be written. */
#define VALUE(kind, member) OPTION_##kind, offsetof(cli_settings, member)
#define TEXT(member)        VALUE(TEXT, member)
#define FLAG(member)        VALUE(FLAG, member), NULL
#define PAGE(words)         IN_OUTPUT, "report", VALUE(PAGE, report), "FILE", "write an HTML page: " words
#define DRAWING(words)      IN_OUTPUT, "svg", VALUE(PICTURE, svg), "FILE", "draw " words
#define LOADS               "loads of joints that redundant constraints share: least-norm (default: one solution)"
#define BACKENDS            "evaluator of the equations: native machine code (default), or tape, an interpreter"

static const option options[] = {
    {CLI_MODELS, IN_MODEL, "set", OPTION_SETTING, 0, "NAME=VALUE",
     "set a parameter of the model to another value; may be repeated"},
    {CLI_MODELS, IN_MODEL, "input", OPTION_SETTING, 0, "NAME=VALUE",
     "value of an input of the model, or FILE:COLUMN:METHOD: samples of a CSV file over its column t, with the method "
     "hold, linear or cubic; may be repeated"},
    {CLI_MODELS & ~(CLI_SHOW | CLI_GENERATE | CLI_FMU | CLI_CONTACT), IN_EXPERT, "closure-tolerance",
     VALUE(LENGTH, closure_tolerance), "X",
     "largest gap of a redundant closure that is accepted as rounding of the model, m (0: none)"},
    {CLI_MODELS, IN_FOREIGN, "base", TEXT(base), "NAME",
     "root of a robot in another format: fixed (to the ground) or free (default: as the format has it)"},
    {CLI_MODELS, IN_FOREIGN, "joint-limits", FLAG(joint_limits),
     "limits of joints in a file in another format are stops, without rebound (default: they are left out)"},
    {CLI_MODELS, IN_FOREIGN, "strict", FLAG(strict),
     "surfaces that touch, limits and controllers of a file in another format are errors where they are not used"},
    {CLI_MODELS, IN_FOREIGN, "leave-out", TEXT(left_out), "NAME,..",
     "elements and attributes of a file in another format that are mechanics and may be left out: results are not "
     "trustworthy"},
    {CLI_SIMULATE | CLI_COMPARE | CLI_SHOW | CLI_COMFORT, IN_EXPERT, "algorithm", TEXT(algorithm), "NAME",
     "algorithm of the dynamics: auto (default), composite (CRBA), plain, ner (recursive Newton-Euler), articulated "
     "(ABA)"},
    {CLI_GATHER, IN_MODEL, "model", TEXT(model), "FILE",
     "model of the page, with the --set of its run (default: the file of the run)"},
    {CLI_ASSEMBLE, IN_RUN, "branches", FLAG(branches), "search for the other assembly modes from random starts"},
    {CLI_ASSEMBLE, IN_RUN, "seed", VALUE(WHOLE, seed), "N", "seed of the random starts of --branches (default: 1)"},
    {CLI_EQUILIBRIUM, IN_MODEL, "rates", TEXT(equilibrium.rates), "NAME=V,..",
     "coordinates with constant rates, rad/s or m/s: a steady motion instead of rest"},
    {CLI_EQUILIBRIUM, IN_MODEL, "solve-for", TEXT(equilibrium.solve_for), "NAME,..",
     "unknown parameters, or unknown rates as qd(NAME)"},
    {CLI_EQUILIBRIUM, IN_MODEL, "hold", TEXT(equilibrium.hold), "NAME=V,..",
     "coordinates with prescribed values, rad or m"},
    {CLI_EQUILIBRIUM, IN_MODEL, "target", TEXT(equilibrium.target), "OUTPUT=V,..",
     "prescribed values of outputs: 'position(BODY.POINT).x=0.3'"},
    {CLI_EQUILIBRIUM, IN_RUN, "newton", FLAG(equilibrium.newton),
     "Newton's method: the nearest equilibrium, stable or unstable (default: descent to a stable one)"},
    {CLI_EQUILIBRIUM, IN_RUN, "stick", FLAG(equilibrium.stick),
     "dry friction holds its surfaces at their start positions (default: it has no force at rest)"},
    {CLI_EQUILIBRIUM, IN_RUN, "global", FLAG(equilibrium.global), "search for several equilibria from random starts"},
    {CLI_EQUILIBRIUM, IN_RUN, "seed", VALUE(WHOLE, seed), "N", "seed of the random starts of --global (default: 1)"},
    {CLI_KINEMATICS, IN_MODEL, "sweep", TEXT(kinematics.sweep), "NAME=A:B:N,..",
     "coordinates, drives or t, swept together from A to B in N rows (default: 361)"},
    {CLI_KINEMATICS, IN_MODEL, "hold", TEXT(kinematics.hold), "NAME,..",
     "coordinates that keep their assembled values"},
    {CLI_KINEMATICS, IN_MODEL, "release", TEXT(kinematics.release), "NAME,..",
     "drives and locks of the model to deactivate"},
    {CLI_KINEMATICS, IN_MODEL, "speed", TEXT(kinematics.speed), "X",
     "rate of the first swept coordinate, as 2 (rad/s or m/s), '90 deg/s', '30 rpm', '5 mm/s' (default: 1)"},
    {CLI_KINEMATICS, IN_MODEL, "elastic", TEXT(kinematics.elastic), "WORD",
     "deformations of flexible bodies: held (default), as assembled, or static, in balance with the loads at rest"},
    {CLI_CONTACT, IN_MODEL, "sweep", TEXT(contact.sweep), "NAME=A:B:N,..",
     "coordinates or parameters, swept together from A to B in N values (default: 21)"},
    {CLI_CONTACT, IN_MODEL, "hold", TEXT(contact.hold), "NAME,..", "coordinates that keep their assembled values"},
    {CLI_CONTACT, IN_MODEL, "solve-for", TEXT(contact.solve_for), "NAME,..",
     "coordinates whose rate is found so that no torque is needed (default: rotating wheels; -: none)"},
    {CLI_CONTACT, IN_RUN, "law", TEXT(contact.law), "NAME",
     "also compute the creep forces by this law: linear, shen, polach, tanh, fastsim, fastsim1, half-space"},
    {CLI_CONTACT, IN_RUN, "pressure", TEXT(contact.pressure), "NAME",
     "also compute the pressures of each patch: half-space, analyn, kik-piotrowski (default: none)"},
    {CLI_CONTACT, IN_RUN, "conicity", TEXT(contact.conicity), "A:B:N",
     "also compute the equivalent conicity of a wheelset (EN 15302) at N amplitudes from A to B (default: 13); -o "
     "writes it"},
    {CLI_CONTACT, IN_RUN, "pair", TEXT(contact.pair), "LEFT,RIGHT",
     "wheels of that wheelset (default: the only left and right ones)"},
    {CLI_INVERSE, IN_MODEL, "actuators", TEXT(inverse.actuators), "NAME,..",
     "actuated coordinates (default: the driven ones)"},
    {CLI_INVERSE, IN_MODEL, "motion", TEXT(inverse.motion), "CSV",
     "prescribed motion: t, q.NAME, qd.NAME, qdd.NAME (default: the drives, or else the start)"},
    {CLI_INVERSE, IN_MODEL, "weights", TEXT(inverse.weights), "NAME=W,..",
     "weights of the actuators of a redundantly actuated mechanism (default: 1)"},
    {CLI_INVERSE, IN_RUN, "loads", TEXT(inverse.loads), "NAME", LOADS},
    {CLI_EQUILIBRIUM, IN_RUN, "loads", TEXT(equilibrium.loads), "NAME", LOADS},
    {CLI_INVERSE, IN_MODEL, "independent", TEXT(inverse.independent), "NAME,..",
     "without a motion: coordinates that have no acceleration at the start"},
    {CLI_INVERSE, IN_RUN, "t-end", VALUE(TIME, inverse.t_end), "T", "end of the motion, s"},
    {CLI_INVERSE, IN_OUTPUT, "output-step", VALUE(TIME, inverse.output_step), "T",
     "time between rows, s (default: the table's rows)"},
    {CLI_ENSEMBLE, IN_MODEL, "values", TEXT(values), "FILE",
     "CSV or Parquet file, one row per instance; columns are parameters, q.NAME and qd.NAME"},
    {CLI_ENSEMBLE, IN_MODEL, "sample", TEXT(sample.ranges), "NAME=A:B,..",
     "draw the instances instead: NAME=A:B (uniform), normal(MEAN,DEVIATION[,LEAST,MOST]), "
     "triangular(LEAST,MODE,MOST), "
     "IT7 (grade of ISO 286), A:B:N (grid)"},
    {CLI_ENSEMBLE, IN_MODEL, "correlate", TEXT(sample.correlations), "A:B=R,..",
     "correlations of sampled quantities, as crank:coupler=0.8"},
    {CLI_ENSEMBLE, IN_MODEL, "design", TEXT(sample.design), "NAME",
     "design of the sample: random (default), latin (hypercube), sobol (sequence), saltelli (for Sobol indices), grid "
     "(all combinations)"},
    {CLI_ENSEMBLE, IN_MODEL, "instances", VALUE(WHOLE, sample.count), "N",
     "number of sampled instances (default: 1000)"},
    {CLI_ENSEMBLE, IN_MODEL, "quantity", VALUE(LIST, quantities), "[NAME=]WORDS,..",
     "quantities of each instance, or of the model itself without --values and --sample: an expression at the end, "
     "at(EXPRESSION, TIME), max(..), min(..), range(..), "
     "mean(..), rms(..), integral(..), first(A < B), count(A < B), duration(A < B); all but the first two also with "
     "from TIME, to TIME or both behind"},
    {CLI_ENSEMBLE, IN_MODEL, "limit", VALUE(LIST, limits), "QUANTITY<VALUE,..",
     "limits on quantities: each instance passes or fails"},
    {CLI_ENSEMBLE, IN_MODEL, "seed", VALUE(WHOLE, seed), "N", "seed of the random instances (default: 1)"},
    {CLI_FIT | CLI_OPTIMIZE, IN_MODEL, "parameter", VALUE(LIST, fitted), "NAME[:LOW:HIGH],..",
     "parameters to be found, start values among them as q.NAME and qd.NAME, with bounds; may be repeated"},
    {CLI_FIT, IN_MODEL, "own", VALUE(LIST, own), "NAME@K=VALUE,..",
     "parameters and start values with another value in the run of data file K (1: the first); may be repeated"},
    {CLI_FIT, IN_MODEL, "columns", TEXT(fit.columns), "NAME,..", "columns of the data that count (default: all)"},
    {CLI_FIT, IN_MODEL, "deviations", TEXT(fit.deviations), "COLUMN=X,..",
     "standard deviations of the noise, which weight the columns (default: from the residuals)"},
    {CLI_FIT, IN_MODEL, "start", TEXT(fit.start), "FILE",
     "CSV file that --output of another fit wrote: the search begins there (default: the model's values)"},
    {CLI_FIT, IN_RUN, "confidence", VALUE(NUMBER, fit.confidence), "X", "confidence of the intervals (default: 0.95)"},
    {CLI_FIT, IN_RUN, "most", VALUE(WHOLE, fit.most), "N", "largest number of runs in a search (default: 200)"},
    {CLI_FIT, IN_RUN, "starts", VALUE(WHOLE, fit.starts), "N",
     "searches, all but the first from a Sobol sequence between the bounds (default: 8; 1 without bounds)"},
    {CLI_OPTIMIZE, IN_MODEL, "minimize", TEXT(optimize.minimize), "QUANTITY",
     "quantity to minimize: an expression at the end, at(EXPRESSION, TIME), max(..), min(..), rms(..), as "
     "for ensembles"},
    {CLI_OPTIMIZE, IN_MODEL, "maximize", TEXT(optimize.maximize), "QUANTITY", "quantity to maximize"},
    {CLI_OPTIMIZE, IN_MODEL, "limit", VALUE(LIST, limits), "QUANTITY<VALUE,..",
     "limits on quantities, which the result keeps; may be repeated"},
    {CLI_OPTIMIZE, IN_MODEL, "start", TEXT(optimize.start), "FILE",
     "CSV file that --output of another search wrote: the first search begins there (default: the model's values)"},
    {CLI_OPTIMIZE, IN_RUN, "starts", VALUE(WHOLE, optimize.starts), "N",
     "searches, all but the first from a Sobol sequence between the bounds (default: 1)"},
    {CLI_OPTIMIZE, IN_RUN, "pool", VALUE(WHOLE, optimize.pool), "N",
     "points that are tried for each of these starts, of which the best are taken (default: 8)"},
    {CLI_OPTIMIZE, IN_RUN, "method", TEXT(optimize.method), "NAME",
     "slopes (exact derivatives) or values (default: slopes where they exist)"},
    {CLI_OPTIMIZE, IN_RUN, "tolerance", VALUE(NUMBER, optimize.tolerance), "X",
     "relative tolerance of the quantity and the parameters (default: 1e-8)"},
    {CLI_OPTIMIZE, IN_RUN, "most", VALUE(WHOLE, optimize.most), "N",
     "largest number of evaluations in a search (default: 500)"},
    {CLI_SENSITIVITY, IN_MODEL, "of", TEXT(sensitivity.of), "WORD",
     "object of the derivatives: trajectory (default), equilibrium, modes, reactions"},
    {CLI_SENSITIVITY, IN_MODEL, "parameters", TEXT(sensitivity.parameters), "NAME,..",
     "parameters; q.NAME and qd.NAME are start values (default: all parameters that can vary)"},
    {CLI_SENSITIVITY, IN_MODEL, "at", TEXT(sensitivity.at), "STATE",
     "state, except for trajectories: equilibrium (default), 'equilibrium NAME=RATE,..', start"},
    {CLI_SENSITIVITY, IN_MODEL, "outputs", TEXT(sensitivity.outputs), "OUTPUT,..",
     "outputs: q(A), position(b.P).x, a sensor, .. (default: the model's)"},
    {CLI_SENSITIVITY, IN_RUN, "method", TEXT(sensitivity.method), "NAME",
     "forward: rows over time (default); adjoint: the end only, for many parameters"},
    {CLI_SENSITIVITY, IN_RUN, "integral", FLAG(sensitivity.integral),
     "differentiate the time integrals of the outputs"},
    {CLI_SIMULATE | CLI_COMPARE | CLI_ASSEMBLE | CLI_COMFORT | CLI_ENSEMBLE | CLI_GATHER | CLI_GENERATE | CLI_FMU,
     IN_MODEL, "at", TEXT(at), "STATE",
     "state at the start: start (default), equilibrium, to which the start leads, 'equilibrium NAME=RATE,..' (a steady "
     "motion)"},
    {CLI_LINEARIZE | CLI_RESPONSE, IN_MODEL, "at", TEXT(response.at), "STATE",
     "state: equilibrium (default), 'equilibrium NAME=RATE,..' (a steady motion), start"},
    {CLI_LINEARIZE | CLI_RESPONSE, IN_MODEL, "inputs", TEXT(response.inputs), "NAME,..",
     "inputs: effort(JOINT), force(BODY.POINT.x), drive(DRIVE), names of inputs and parameters"},
    {CLI_LINEARIZE | CLI_RESPONSE, IN_MODEL, "outputs", TEXT(response.outputs), "NAME,..",
     "outputs of the model, or a component: 'position(BODY.POINT).x'"},
    {CLI_LINEARIZE | CLI_RESPONSE, IN_MODEL, "independent", TEXT(response.independent), "NAME,..",
     "independent coordinates (default: chosen automatically)"},
    {CLI_LINEARIZE | CLI_RESPONSE, IN_RUN, "slide", FLAG(response.slide),
     "dry friction that sticks at the state has no force, and its surfaces slide (default: they stay in place)"},
    {CLI_RESPONSE, IN_RUN, "frequencies", TEXT(response.frequencies), "A:B[:N]",
     "range and number of frequencies, Hz; also rad/s, rpm (default: decades around the natural frequencies)"},
    {CLI_RESPONSE, IN_RUN, "linear", FLAG(response.linear), "linear spacing of the frequencies (default: logarithmic)"},
    {CLI_COMFORT, IN_MODEL, "vertical", TEXT(comfort.vertical), "NAME,..",
     "vertical accelerations, weighted by Wb: 'acceleration(BODY.POINT).z' (default: the model's)"},
    {CLI_COMFORT, IN_MODEL, "seat", TEXT(comfort.seat), "NAME,..",
     "vertical accelerations on a seat, as of road vehicles, weighted by Wk (ISO 2631-1)"},
    {CLI_COMFORT, IN_MODEL, "lateral", TEXT(comfort.lateral), "NAME,..", "lateral accelerations, weighted by Wd"},
    {CLI_COMFORT, IN_MODEL, "longitudinal", TEXT(comfort.longitudinal), "NAME,..",
     "longitudinal accelerations, weighted by Wd"},
    {CLI_COMFORT, IN_MODEL, "seat-back", TEXT(comfort.seat_back), "NAME,..",
     "longitudinal accelerations at the back of a seat, weighted by Wc"},
    {CLI_COMFORT, IN_RUN, "from", VALUE(TIME, comfort.from), "T",
     "start of the first window, s (default: the start of the run)"},
    {CLI_COMFORT, IN_RUN, "rate", VALUE(NUMBER, comfort.rate), "X", "samples per second, at least 400 (default: 1000)"},
    {CLI_MODES, IN_MODEL, "at", TEXT(modes.at), "STATE",
     "state: equilibrium (default), 'equilibrium NAME=RATE,..' (a steady motion), start"},
    {CLI_MODES, IN_MODEL, "rates", TEXT(modes.rates), "NAME=V,..",
     "constant rates of a steady motion, rad/s or m/s; one may be swept: NAME=A:B:N"},
    {CLI_MODES, IN_MODEL, "independent", TEXT(modes.independent), "NAME,..",
     "independent coordinates (default: chosen automatically)"},
    {CLI_MODES, IN_MODEL, "sweep", TEXT(modes.sweep), "NAME=A:B:N",
     "parameter, or start value q.NAME or qd.NAME, swept from A to B: the modes are tracked"},
    {CLI_MODES, IN_RUN, "slide", FLAG(modes.slide),
     "dry friction that sticks at the state has no force, and its surfaces slide (default: they stay in place)"},
    {CLI_MODES, IN_OUTPUT, "orders", TEXT(modes.orders), "X,..",
     "order lines of the diagram: frequency = X * swept value / (2 pi)"},
    {CLI_MODES, IN_OUTPUT, "highest", VALUE(NUMBER, modes.highest), "X",
     "draw eigenvalues up to this frequency, Hz: in size at most 2 pi X (default: all)"},
    {CLI_CYCLES, IN_MODEL, "sweep", TEXT(cycles.sweep), "NAME=A:B:N",
     "parameter from A to B: branches of cycles are followed, and pass N values (default: 31)"},
    {CLI_CYCLES, IN_MODEL, "outputs", TEXT(cycles.outputs), "OUTPUT,..",
     "outputs whose extremes are found: q(A), 'position(b.P).y' (default: all coordinates)"},
    {CLI_CYCLES, IN_RUN, "settle", VALUE(TIME, cycles.settle), "T",
     "simulate for T at each value, from A to B and back: motions that are reached, of any model (default: Newton's "
     "method)"},
    {CLI_CYCLES, IN_RUN, "most", VALUE(WHOLE, cycles.most), "N",
     "largest number of cycles of a branch (default: 1000)"},
#define ABSENT_KEY(absent)       " (default: the model's, or " absent ")"
#define ABSENT_NAMES             ABSENT_KEY
#define ABSENT_CHOICE            ABSENT_KEY
#define ABSENT_NO(absent)        " (default: " absent ")"
#define HELP_NUMBER(key, absent) ABSENT_##key(absent)
#define HELP_LONG                HELP_NUMBER
#define HELP_WHOLE               HELP_NUMBER
#define HELP_TEXT                HELP_NUMBER
#define HELP_TIME(key, absent)   ", s" ABSENT_##key(absent)
#define HELP_ANGLE(key, absent)  ", rad" ABSENT_##key(absent)
#define HELP_FLAG(key, absent)   ""
#define KMP_RUN_OPTION(name, type, key, engine, folder, studies, commands, group, option, value, absent, words, ...)   \
    {commands, group, option, VALUE(type, run.name), value, words HELP_##type(key, absent)},
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    {CLI_SENSITIVITY | CLI_FIT | CLI_OPTIMIZE | CLI_CYCLES, IN_RUN, "integrator", TEXT(run.integrator), "NAME",
     "integrator: radau, dop853, dopri5, radau5, radau9, erk (default: the model's, or radau where its stages "
     "share vector registers, dop853 elsewhere)"},
    {CLI_CYCLES, IN_RUN, "rtol", VALUE(NUMBER, run.rtol), "X", "relative tolerance of runs (default: 1e-10)"},
    {CLI_INVERSE, IN_RUN, "no-convergence-check", FLAG(inverse.no_convergence_check),
     "do not repeat the run with every other row of the table"},
    {CLI_SIMULATE, IN_MODEL, "from", TEXT(from), "FOLDER",
     "run an instance of an ensemble again, with the options of its run; FILE may be omitted"},
    {CLI_SIMULATE, IN_MODEL, "instance", VALUE(WHOLE, instance), "K", "the instance of --from, 1 the first one"},
    {CLI_ENSEMBLE, IN_RUN, "threads", VALUE(AMOUNT, run.threads), "N",
     "threads that share the instances, 1 to 64, or auto (default): one for each processor; results have the same "
     "bits"},
    {CLI_FIT | CLI_OPTIMIZE, IN_RUN, "threads", VALUE(AMOUNT, run.threads), "N",
     "threads that share the searches, 1 to 64, or auto (default): one for each processor; results have the same bits"},
    {CLI_ENSEMBLE, IN_EXPERT, "lanes", VALUE(AMOUNT, lanes), "N",
     "instances per vector evaluation, 1 to 16, or auto (default): the fastest"},
    {CLI_ENSEMBLE, IN_RUN, "resume", FLAG(folder.resume), "run the parts that --out does not have yet"},
    {CLI_ENSEMBLE, IN_RUN, "shard", TEXT(folder.shard), "I/N",
     "run every N-th part of --out from the I-th on, or auto: I and N from Slurm, Open MPI, PMI or GNU parallel"},
    {CLI_ENSEMBLE, IN_RUN, "chunk", VALUE(WHOLE, folder.chunk), "N",
     "instances of a part of --out (default: 256 to 4096)"},
    {CLI_ENSEMBLE, IN_EXPERT, "alone", FLAG(alone), "run every instance separately"},
    {CLI_COMPARE, IN_RUN, "rtol", TEXT(compare.rtols), "X,..", "relative tolerances (default: 1e-3 to 1e-13)"},
    {CLI_COMPARE, IN_RUN, "formulations", TEXT(compare.formulations), "NAME,..", "formulations (default: all)"},
    {CLI_COMPARE, IN_RUN, "forms", TEXT(compare.forms), "NAME,..",
     "forms of the formulations (default: the standard ones)"},
    {CLI_COMPARE, IN_RUN, "integrators", TEXT(compare.integrators), "NAME,..",
     "integrators (default: the standard ones, and all implicit ones for a stiff model)"},
    {CLI_COMPARE, IN_EXPERT, "linear", TEXT(compare.linear), "NAME,..",
     "linear solvers of IDA, each as a method of its own: auto (default), klu, umfpack, dense"},
    {CLI_COMPARE, IN_RUN, "reference", TEXT(compare.reference), "CSV",
     "reference solution (default: computed by several formulations and integrators)"},
    {CLI_COMPARE, IN_RUN, "bodies", TEXT(compare.bodies), "NAME,..",
     "models of the flexible bodies: rigid, none, first, full, segments:N; each is compared with the last one"},
    {CLI_COMPARE, IN_RUN, "t-end", VALUE(TIME, compare.t_end), "T", "end of every run, s (default: the model's)"},
    {CLI_COMPARE, IN_RUN, "budget", VALUE(TIME, compare.budget_s), "S",
     "processor time for all runs together, s (default: 60)"},
    {CLI_KINEMATICS, IN_EXPERT, "backend", TEXT(kinematics.backend), "NAME", BACKENDS},
    {CLI_CONTACT, IN_EXPERT, "backend", TEXT(contact.backend), "NAME", BACKENDS},
    {CLI_INVERSE, IN_EXPERT, "backend", TEXT(inverse.backend), "NAME", BACKENDS},
    {CLI_GENERATE, IN_MODEL, "sets", TEXT(generation.sets), "NAME,..",
     "sets of equations: M_C, invdyn, h_J, jdqd (default: these four), M, C, qdd, h, J, h_t, tangents, R, R_tangents, "
     "invdyn_q, invdyn_qd, R_q, friction, contact, impact, discrete, outputs; + joins sets in one program"},
    {CLI_GENERATE, IN_MODEL, "scheme", TEXT(generation.scheme), "NAME",
     "scheme of the mass matrix: composite (default), ner"},
    {CLI_GENERATE, IN_MODEL, "keep-parameters", FLAG(generation.keep_parameters),
     "keep every nonzero number as a symbol"},
    {CLI_GENERATE, IN_MODEL, "body-inputs", FLAG(generation.body_inputs),
     "external forces and torques (three each) on every body as inputs"},
    {CLI_GENERATE, IN_MODEL, "no-inputs", TEXT(generation.no_inputs), "BODY,..", "bodies without these inputs"},
    {CLI_GENERATE, IN_MODEL, "drives", FLAG(generation.drives), "include the rows of drives and locks in the closures"},
    {CLI_GENERATE, IN_RUN, "optimize", FLAG(generation.optimize),
     "minimise the number of operations, joint by joint; generation takes longer"},
    {CLI_NEW, IN_OUTPUT, "elements", FLAG(elements),
     "list the machine elements kempe:NAME.yaml that models may include"},
    {CLI_SHOW, IN_OUTPUT, "model", FLAG(show_model),
     "the model: bodies, joints, closures, forces, numbers in SI units (default)"},
    {CLI_SHOW, IN_OUTPUT, "as", TEXT(show_as), "NAME",
     "the model in another format: urdf+, sdf, mjcf, yaml; a warning names each part that the format cannot say"},
    {CLI_SHOW, IN_OUTPUT, "equations", FLAG(show_equations), "M, C, h, J, jdqd (Jdot qd) as assignments"},
    {CLI_SHOW, IN_OUTPUT, "program", FLAG(show_program), "the staged program of the reduced formulation"},
    {CLI_SHOW, IN_OUTPUT, "stats", FLAG(show_stats), "operation counts; with --equations also after each pass"},
    {CLI_GENERATE, IN_OUTPUT, "count", FLAG(count),
     "operation counts of every set, derived separately, and of all sets as one program"},
    {CLI_GENERATE, IN_OUTPUT, "lang", TEXT(generation.language), "NAME",
     "language of the generated files: c, casadi, jax, octave, python, torch"},
    {CLI_GENERATE, IN_OUTPUT, "form", TEXT(generation.form), "NAME", "names of variables: legible (default), compact"},
    {CLI_GENERATE, IN_OUTPUT, "simulator", FLAG(generation.simulator),
     "a simulator in C99 with the equations: closing of loops, integration and events"},
    {CLI_GENERATE, IN_OUTPUT, "vectorised", FLAG(generation.vectorised),
     "array languages: one statement for all operations that are possible at once"},
    {CLI_GENERATE, IN_OUTPUT, "output", TEXT(output), "DIR", "folder of the files (default: the current one)"},
    {CLI_REDUCE, IN_MODEL, "interface", VALUE(LIST, interfaces), "NAME=NODES",
     "nodes that move as a rigid body: numbers and ranges, root=1,2,5-9, a set of the mesh, root=SET, or those within "
     "ranges of places in units of the mesh, root=x=0 or root=x=0:2,z=1; may be repeated: the joint of the body holds "
     "the first one"},
    {CLI_REDUCE, IN_MODEL, "modes", VALUE(WHOLE, reduce.modes), "N",
     "modes with all interfaces held, in addition to six static modes of each interface but the first (default: none)"},
    {CLI_REDUCE, IN_MODEL, "frame", TEXT(reduce.frame), "NAME",
     "frame of the modes: clamped at the first interface (default), chord to the second one"},
    {CLI_REDUCE, IN_MODEL, "units", TEXT(reduce.units), "WORDS",
     "units of length, mass and time of a mesh that does not say them: 'm kg s', 'mm t s'"},
    {CLI_REDUCE, IN_MODEL, "mass", TEXT(reduce.mass), "FILE", "mass matrix, where the stiffness is a .mtx"},
    {CLI_REDUCE, IN_MODEL, "nodes", TEXT(reduce.nodes), "FILE",
     "places of the nodes: for .mtx a text with x, y and z in each line, for .sti the input with *NODE (default: "
     "JOB.inp)"},
    {CLI_REDUCE, IN_OUTPUT, "output", VALUE(MODES, output), "FILE",
     "write the body, kempe-flexible-1, that a model names under `flexible`"},
    {CLI_FMU, IN_OUTPUT, "output", VALUE(UNIT, output), "FILE", "file of the unit"},
    {CLI_FMU, IN_OUTPUT, "fmi", VALUE(WHOLE, fmu.fmi), "N", "version of the FMI: 2 or 3 (default)"},
    {CLI_FMU, IN_OUTPUT, "kind", TEXT(fmu.kind), "NAME,..",
     "me (model exchange), cs (co-simulation), or me,cs (default)"},
    {CLI_FMU, IN_OUTPUT, "binary", FLAG(unit_on_library),
     "co-simulation with the library inside instead of sources: for all models"},
    {CLI_FMU, IN_OUTPUT, "compiler", TEXT(fmu.compiler), "NAME",
     "C compiler of the binary (default: cc, and for other platforms a cross-compiler)"},
    {CLI_FMU, IN_OUTPUT, "platforms", TEXT(fmu.platforms), "NAME,..",
     "platforms of the binaries: x86_64-linux, x86_64-windows, aarch64-linux (default: this one)"},
    {CLI_FMU, IN_OUTPUT, "no-binary", FLAG(fmu.no_binary), "only sources, which importers can compile"},
    {CLI_TABLES | CLI_GATHER, IN_OUTPUT, "output", VALUE(TABLE, output), "FILE",
     "write the table: .csv, .parquet, .npz for NumPy, .mat for MATLAB and Octave, or .json"},
    {CLI_COMPARE, IN_OUTPUT, "csv", VALUE(TABLE, output), "FILE", "another name of --output"},
    {CLI_SYSTEMS, IN_OUTPUT, "units", VALUE(SYSTEM, units), "[SYSTEM]",
     "system of units, which columns of CSV then name, 'q.crank [rad]': si (default), mm (mm, N, N mm, kg), us (in, "
     "lbf, lbf in, lb); --json stays in SI"},
    {CLI_TABLES, IN_OUTPUT, "plot", VALUE(PICTURE, plot), "FILE",
     "draw columns of the table, .svg or .png (default: all columns)"},
    {CLI_TABLES, IN_OUTPUT, "y", TEXT(y), "OUTPUT,..",
     "columns that --plot draws: 'q(A), force(spring), position(b.P).x'"},
    {CLI_TABLES, IN_OUTPUT, "x", TEXT(x), "OUTPUT", "horizontal axis of --plot (default: the first column)"},
    {CLI_ENSEMBLE, IN_OUTPUT, "history", TEXT(folder.history), "K,A:B,..",
     "also write the time histories of these instances, 1 the first one: into --out, or to --history-output"},
    {CLI_ENSEMBLE | CLI_GATHER, IN_OUTPUT, "history-output", VALUE(TABLE, history_output), "FILE",
     "write the histories as one table: instance, t, and the outputs of each row"},
    {CLI_ENSEMBLE, IN_OUTPUT, "output-step", VALUE(TIME, run.output_step), "T",
     "time between rows of histories, s (default: the model's, or a fraction of the time)"},
    {CLI_ENSEMBLE, IN_OUTPUT, "out", TEXT(out), "FOLDER",
     "write the rows into a folder, RUN.kempe, part by part: any number of instances, --resume after an interruption"},
    {CLI_VIEW, IN_OUTPUT, "report", VALUE(PAGE, report), "FILE",
     "write the page of a model to this file (default: one in the folder of temporary files)"},
    {CLI_ASSEMBLE | CLI_KINEMATICS | CLI_EQUILIBRIUM | CLI_INVERSE | CLI_RESPONSE | CLI_ENSEMBLE | CLI_GATHER,
     PAGE("the mechanism, and the result as curves and text")},
    {CLI_FIT, PAGE("the mechanism moving, the data as points on the fitted motion, residuals below")},
    {CLI_OPTIMIZE, PAGE("the mechanism moving at the optimum, its outputs over time, the searches")},
    {CLI_SIMULATE, PAGE("the mechanism moving, time histories of all outputs, accuracy of the run")},
    {CLI_SIMULATE, IN_OUTPUT, "against", TEXT(against), "FILE",
     "curves of an earlier run, a CSV file of -o: dotted on the page of --report, dashed in the picture of --plot"},
    {CLI_KINEMATICS | CLI_INVERSE | CLI_RESPONSE | CLI_MODES, IN_OUTPUT, "against", TEXT(against), "FILE",
     "dashed curves of an earlier result, a CSV file of -o, in the picture of --plot"},
    {CLI_SIMULATE, IN_OUTPUT, "animation", VALUE(SCENE, animation), "FILE",
     "write the mechanism moving: .glb, glTF for Blender and other programs; .json, the data of the picture"},
    {CLI_KINEMATICS, DRAWING("the paths of the position outputs")},
    {CLI_CONTACT, DRAWING("the contact positions, creepages and forces")},
    {CLI_LINEARIZE, IN_OUTPUT, "output", VALUE(ARRAYS, output), "FILE",
     "write matrices and names: .npz for NumPy, .mat for MATLAB and Octave"},
    {CLI_RESPONSE, DRAWING("amplitudes and phases")},
    {CLI_MODES, DRAWING("the sweep: root locus and frequencies over the swept value")},
    {CLI_CYCLES, DRAWING("the bifurcation diagram: amplitudes over the parameter, .svg or .png")},
    {CLI_CYCLES, PAGE("the diagram and the result")},
    {CLI_MODES, PAGE("the mode shapes as animations")},
    {CLI_COMPARE, PAGE("recommendation, diagrams, animation of the mechanism")},
    {CLI_SIMULATE, IN_OUTPUT, "all", FLAG(all),
     "also the choice of the integrator and the counts of steps, evaluations and changes"},
    {CLI_CHECK, IN_OUTPUT, "all", FLAG(all),
     "also dependent sets, removable closures, alternative coordinates, the order of solution, all ranges"},
    {CLI_COMPARE, IN_OUTPUT, "all", FLAG(all),
     "also every run, and times split into steps, evaluations and time of each"},
    {CLI_LINEARIZE, IN_OUTPUT, "all", FLAG(all), "also the matrices N and Nd of all coordinates, and large matrices"},
    {CLI_MODES, IN_OUTPUT, "all", FLAG(all), "also eigenvalues, and every coordinate that moves"},
    {CLI_RESPONSE, IN_OUTPUT, "all", FLAG(all), "every peak"},
    {CLI_CYCLES, IN_OUTPUT, "all", FLAG(all), "every cycle of the branches"},
    {CLI_CONTACT, IN_OUTPUT, "all", FLAG(all), "every value of the sweep"},
    {CLI_MODELS & ~(CLI_SHOW | CLI_GENERATE | CLI_COMPARE | CLI_FMU), IN_OUTPUT, "angle-unit", TEXT(angle_unit), "UNIT",
     "unit of angles, their rates and accelerations in text, tables, pictures and pages: rad (default), deg; --json "
     "stays in SI"},
    {CLI_LANGUAGE_SERVER, IN_OUTPUT, "stdio", FLAG(stdio),
     "messages on standard input and output: the default, which many editors request by name"},
    {CLI_WORKBENCH, IN_MODEL, "folder", TEXT(readable), "DIR",
     "folder whose files the model may read, with the model in it (default: the folder of the model)"},
    {CLI_WORKBENCH, IN_RUN, "port", VALUE(WHOLE, port), "N",
     "port of the page on this machine (default: any free one)"},
    {CLI_WORKBENCH, IN_RUN, "no-browser", FLAG(no_browser), "print the address, and open no browser"},
    {CLI_ALL & ~(CLI_LANGUAGE_SERVER | CLI_WORKBENCH), IN_OUTPUT, "json", TEXT(json), "PATH|-",
     "write one JSON object; - writes it to stdout instead of the text"},
    {CLI_ALL, IN_OUTPUT, "quiet", FLAG(quiet), "no progress and no log on stderr; warnings stay"},
    {CLI_ALL, IN_OUTPUT, "help", FLAG(help), "print this text"},
    {CLI_MODELS, IN_EXPERT, "no-cache", FLAG(no_cache),
     "derive the equations again and store nothing in the cache (~/.cache/kempe)"},
};

enum { OPTION_COUNT = sizeof options / sizeof *options, WORD_MAX = 64 };

/* -- error messages ---------------------------------------------------------------------------------- */

static char last_complaint[512];

bool cli_complain(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(last_complaint, sizeof last_complaint, format, list);
    va_end(list);
    cli_terminal_error("kempe: ", last_complaint);
    return false;
}

const char *cli_complaint(void)
{
    return last_complaint;
}

/* -- names that are nearly right --------------------------------------------------------------------- */

/* Levenshtein distance, one row at a time. Words longer than WORD_MAX are never near. */
static size_t distance(const char *a, const char *b)
{
    size_t row[WORD_MAX + 1], n = strlen(b);
    if (strlen(a) > WORD_MAX || n > WORD_MAX)
        return WORD_MAX;
    for (size_t j = 0; j <= n; j++)
        row[j] = j;
    for (size_t i = 0; a[i]; i++) {
        size_t diagonal = row[0];
        row[0] = i + 1;
        for (size_t j = 0; j < n; j++) {
            size_t change = diagonal + (a[i] != b[j]), drop = row[j + 1] + 1, insert = row[j] + 1;
            diagonal = row[j + 1];
            size_t best = change < drop ? change : drop;
            row[j + 1] = best < insert ? best : insert;
        }
    }
    return row[n];
}

const char *cli_nearest(const char *word, const char *const *words)
{
    const char *best = NULL;
    size_t least = strlen(word) / 2 + 1; /* more than half of the word wrong is another word */
    for (; *words; words++) {
        size_t d = distance(word, *words);
        if (d < least) {
            least = d;
            best = *words;
        }
    }
    return best;
}

const char *const cli_unit_systems[] = {"si", "mm", "us", NULL};

/* Commands without a system of units, and why. */
static const struct {
    unsigned commands;
    const char *why;
} in_si[] = {
    {CLI_LINEARIZE, "its matrices are one set of equations with states, inputs and outputs in SI"},
    {CLI_GENERATE, "the generated code computes in SI"},
    {CLI_FMU, "the variables of the unit are in SI, with their units in its description"},
    {CLI_SHOW, "it shows the model as it is computed, in SI"},
    {CLI_VIEW, "the page shows the model as it is computed, in SI"},
    {CLI_NEW, "the new model has the units that it is written with"},
};

static bool complain_unknown(unsigned command, const char *command_name, const char *word)
{
    const bool units = strcspn(word, "=") == strlen("--units") && strncmp(word, "--units", strlen("--units")) == 0;
    for (size_t k = 0; units && k < sizeof in_si / sizeof *in_si; k++)
        if (in_si[k].commands & command)
            return cli_complain("--units: %s has no choice of units: %s", command_name, in_si[k].why);
    const char *names[OPTION_COUNT + 1];
    int count = 0;
    for (int k = 0; k < OPTION_COUNT; k++)
        if (options[k].commands & command)
            names[count++] = options[k].name;
    names[count] = NULL;
    const char *near = cli_nearest(word + strspn(word, "-"), names);
    unsigned others = 0;
    for (int k = 0; k < OPTION_COUNT; k++)
        if (strncmp(word, "--", 2) == 0 && strlen(options[k].name) == strcspn(word + 2, "=") &&
            strncmp(word + 2, options[k].name, strlen(options[k].name)) == 0)
            others = options[k].commands;
    for (const cli_command *c = cli_commands; c->name; c++)
        if (c->bit & others)
            return cli_complain("unknown option '%s': 'kempe %s' has it%s%s%s", word, c->name,
                                near ? ", or did you mean '--" : "", near ? near : "", near ? "'?" : "");
    if (near)
        return cli_complain("unknown option '%s', did you mean '--%s'?", word, near);
    return cli_complain("unknown option '%s'; 'kempe %s --help' lists the options", word, command_name);
}

/* The short form of an option, its first letter; 0 for none. */
static char letter_of(const option *o)
{
    static const char *const lettered[] = {"help", "output", "quiet"};
    for (size_t k = 0; k < sizeof lettered / sizeof *lettered; k++)
        if (strcmp(o->name, lettered[k]) == 0)
            return *o->name;
    return 0;
}

static const option *find(unsigned command, const char *word, size_t length)
{
    for (const option *o = options; o < options + OPTION_COUNT; o++) {
        if (!(o->commands & command))
            continue;
        if (length == 2 && letter_of(o) && word[1] == letter_of(o))
            return o;
        if (length > 2 && strlen(o->name) == length - 2 && strncmp(word, "--", 2) == 0 &&
            strncmp(word + 2, o->name, length - 2) == 0)
            return o;
    }
    return NULL;
}

/* Whole numbers beyond the range of an int are its largest one. */
static bool store_number(const option *o, const char *text, void *place)
{
    char *end;
    double x = strtod(text, &end);
    if (end == text || *end || !isfinite(x) || x <= 0)
        return cli_complain("--%s needs a positive number%s, not '%s'", o->name,
                            o->kind == OPTION_AMOUNT ? " or auto" : "", text);
    if (o->kind != OPTION_NUMBER && (x > 1e15 || x != (double)(long long)x))
        return cli_complain("--%s needs a whole number, not '%s'", o->name, text);
    if (o->kind == OPTION_NUMBER)
        *(double *)place = x;
    else if (o->kind == OPTION_LONG)
        *(long *)place = (long)x;
    else
        *(int *)place = x < INT_MAX ? (int)x : INT_MAX;
    return true;
}

/* "3", "20 ms". Zero is a value only of lengths. */
static bool store_quantity(const option *o, const char *text, double *value)
{
    kempe_context *context = kempe_context_new();
    double x = 0;
    bool good = context && kempe_number_read(context, text, kinds[o->kind].unit, &x) == KEMPE_OK &&
                (x > 0 || (x == 0 && o->kind == OPTION_LENGTH));
    if (!context)
        cli_complain("out of memory");
    else if (!good)
        cli_complain("--%s needs a %s, not '%s'", o->name, kinds[o->kind].example, text);
    kempe_context_free(context);
    if (good)
        *value = x;
    return good;
}

/* True: the value of the option is a file that the command writes. */
static bool writes(const option *o, unsigned command)
{
    return (o->commands & command) && o->group == IN_OUTPUT && o->value && strcmp(o->name, "against") != 0;
}

/* The file that an option names; NULL: none. */
static const char *file_of(const option *o, const cli_settings *settings)
{
    const char *const path = *(const char *const *)(const void *)((const char *)settings + o->offset);
    const bool names = strcmp(o->value, "FILE") == 0 || strcmp(o->value, "CSV") == 0 || strcmp(o->value, "PATH|-") == 0;
    return names && path && strcmp(path, "-") != 0 ? path : NULL;
}

static bool is_same_file(const char *a, const char *b)
{
    kmp_path_state one, other;
    const bool exist = kmp_path_look(a, &one) && kmp_path_look(b, &other);
    return exist ? one.kind == KMP_PATH_FILE && one.device == other.device && one.number == other.number
                 : strcmp(a, b) == 0;
}

static bool check_apart(const option *written, const char *path, const char *read)
{
    return !read || !is_same_file(path, read) ||
           cli_complain("--%s would write over '%s', which is read: name another file", written->name, read);
}

bool cli_written_apart(unsigned command, const cli_settings *s)
{
    for (const option *o = options; o < options + OPTION_COUNT; o++) {
        const char *path = writes(o, command) ? file_of(o, s) : NULL, *other;
        if (!path)
            continue;
        for (const option *p = options; p < options + OPTION_COUNT; p++) {
            if (!(p->commands & command) || !p->value || p->offset == o->offset || !(other = file_of(p, s)))
                continue;
            const bool goes_on = strcmp(o->name, "checkpoint") == 0 && strcmp(p->name, "resume") == 0;
            if (!writes(p, command) && !goes_on && !check_apart(o, path, other))
                return false;
            if (p < o && writes(p, command) && is_same_file(path, other))
                return cli_complain("--%s and --%s write the same file '%s': name two", p->name, o->name, path);
        }
        if (!check_apart(o, path, s->file) || !check_apart(o, path, s->fit.data))
            return false;
        for (int k = 0; k < s->fit.file_count; k++)
            if (!check_apart(o, path, s->data_files[k]))
                return false;
    }
    return true;
}

const char *cli_written(unsigned command, const cli_settings *settings, int *k)
{
    for (; *k < (int)OPTION_COUNT; ++*k) {
        const option *o = &options[*k];
        const char *path = writes(o, command) ? file_of(o, settings) : NULL;
        if (path) {
            ++*k;
            return path;
        }
    }
    return NULL;
}

bool cli_written_into(unsigned command, cli_settings *settings, const char *folder, char kept[CLI_LIST_SIZE])
{
    size_t used = 0;
    for (const option *o = options; o < options + OPTION_COUNT; o++) {
        const char *name = writes(o, command) ? file_of(o, settings) : NULL;
        if (!name || (used > 0 && name > kept && name < kept + used)) /* two rows of one option */
            continue;
        if (strcspn(name, "/\\:") < strlen(name) || name[0] == '.' || !*name)
            return cli_complain("--%s '%s': only a plain name may be written here, without a folder", o->name, name);
        const int length = snprintf(kept + used, CLI_LIST_SIZE - used, "%s/%s", folder, name);
        if (length < 0 || (size_t)length >= CLI_LIST_SIZE - used)
            return cli_complain("--%s: its name is too long", o->name);
        *(const char **)(void *)((char *)settings + o->offset) = kept + used;
        used += (size_t)length + 1;
    }
    return true;
}

/* A name without an ending is taken as the first kind of file, a device by it. */
static bool has_ending(const option *o, const char *path)
{
    const char *dot = strrchr(kmp_path_name(path), '.'), *at = kinds[o->kind].ending;
    while (dot && at && *at) {
        size_t length = strcspn(at, ",");
        if (strlen(dot) == length && strncmp(dot, at, length) == 0)
            return true;
        at += length + (at[length] ? 2 : 0);
    }
    return !dot || !kinds[o->kind].ending;
}

static bool store(const option *o, char *text, cli_settings *settings)
{
    void *place = (char *)settings + o->offset;
    if (o->kind == OPTION_AMOUNT && strcmp(text, "auto") == 0) {
        *(int *)place = 0;
        return true;
    }
    if (o->kind == OPTION_NUMBER || o->kind == OPTION_WHOLE || o->kind == OPTION_AMOUNT || o->kind == OPTION_LONG)
        return store_number(o, text, place);
    if (kinds[o->kind].unit)
        return store_quantity(o, text, place);
    if (o->kind == OPTION_SETTING) {
        /* Splits NAME=VALUE at the sign, in place. */
        size_t length = strcspn(text, "=");
        if (length == 0 || !text[length] || !text[length + 1])
            return cli_complain("--%s needs NAME=VALUE, not '%s'", o->name, text);
        if (settings->set_count == CLI_MOST_SETS)
            return cli_complain("--%s: at most %d values can be set", o->name, CLI_MOST_SETS);
        text[length] = '\0';
        settings->sets[settings->set_count++] = (kempe_setting){text, text + length + 1};
        return true;
    }
    if (o->kind == OPTION_LIST) {
        char *list = place;
        size_t used = strlen(list);
        int size = snprintf(list + used, CLI_LIST_SIZE - used, "%s%s", used > 0 ? "," : "", text);
        return (size >= 0 && (size_t)size < CLI_LIST_SIZE - used) ||
               cli_complain("--%s: the text is too long", o->name);
    }
    if (!has_ending(o, text))
        return cli_complain("--%s writes %s files; '%s' has another ending", o->name, kinds[o->kind].ending, text);
    *(const char **)place = text;
    return true;
}

/* A system of units behind --units, or behind its `=`; without one only the names of columns have units. Returns the
 * number of words consumed. */
static int read_system(const char *attached, const char *next, cli_settings *settings)
{
    const char *given = attached;
    for (const char *const *s = cli_unit_systems; *s && !given; s++)
        given = next && strcmp(next, *s) == 0 ? next : NULL;
    settings->units = given ? given : "";
    return given && !attached ? 2 : 1;
}

/* Reads one option at words[0]; returns the number of words consumed, 0 after an error message. */
static int read_option(unsigned command, const char *name, int count, char **words, cli_settings *settings)
{
    size_t length = strcspn(words[0], "=");
    const option *o = find(command, words[0], length);
    if (!o)
        return complain_unknown(command, name, words[0]);
    char *attached = words[0][length] ? words[0] + length + 1 : NULL;
    if (o->kind == OPTION_FLAG) {
        if (attached)
            return cli_complain("--%s takes no value", o->name);
        *(int *)(void *)((char *)settings + o->offset) = 1;
        return 1;
    }
    if (o->kind == OPTION_SYSTEM)
        return read_system(attached, count > 1 ? words[1] : NULL, settings);
    if (!attached && count < 2)
        return cli_complain("--%s needs a value: %s", o->name, o->value);
    return store(o, attached ? attached : words[1], settings) ? 2 - (attached != NULL) : 0;
}

static bool read_file_name(unsigned command, const char *word, cli_settings *settings)
{
    if (settings->file && command == CLI_FIT && !settings->fit.data) {
        settings->fit.data = word;
        return true;
    }
    if (settings->file && command == CLI_FIT && settings->fit.file_count < CLI_MOST_SETS) {
        settings->data_files[settings->fit.file_count++] = word;
        return true;
    }
    if (command == CLI_LANGUAGE_SERVER)
        return cli_complain("language-server takes no file, not '%s': an editor opens files in it", word);
    if (settings->file)
        return cli_complain("one %s is expected, but '%s' and '%s' are given",
                            command == CLI_REDUCE ? "mesh" : "model file", settings->file, word);
    settings->file = word;
    return true;
}

const char *cli_json_word(int count, char **words)
{
    const char *path = NULL;
    for (int k = 0; k < count && strcmp(words[k], "--") != 0; k++)
        if (strcmp(words[k], "--json") == 0 && k + 1 < count)
            path = words[++k];
        else if (strncmp(words[k], "--json=", 7) == 0)
            path = words[k] + 7;
    for (int k = 0; k < count && path; k++) /* nor a file that the command reads */
        if (words[k][0] != '-' && words[k] != path && is_same_file(words[k], path))
            return NULL;
    return path;
}

bool cli_options_read(unsigned command, const char *command_name, int count, char **words, cli_settings *settings)
{
    *settings = (cli_settings){.closure_tolerance = -1};
    bool names_only = false;
    for (int k = 0; k < count;) {
        if (!names_only && strcmp(words[k], "--") == 0) {
            names_only = true;
            k++;
        } else if (!names_only && words[k][0] == '-' && words[k][1]) {
            int taken = read_option(command, command_name, count - k, words + k, settings);
            if (taken == 0)
                return false;
            k += taken;
        } else if (!read_file_name(command, words[k++], settings)) {
            return false;
        }
    }
    /* Options that a study takes from others. */
    cli_settings *s = settings;
    s->seed = s->seed > 0 && s->seed < 1000000000 ? s->seed : 1;
    s->equilibrium.seed = s->sample.seed = s->seed;
    s->comfort.run = s->sensitivity.run = s->cycles.run = s->fit.run = s->optimize.run = &s->run;
    s->cycles.size = sizeof s->cycles;
    s->fit.parameters = s->optimize.parameters = s->fitted;
    s->fit.own = s->own;
    s->fit.files = s->data_files;
    s->optimize.limits = s->limits;
    s->reduce.interfaces = s->interfaces;
    if (!settings->file && !settings->help && !settings->from && !settings->elements && command != CLI_LANGUAGE_SERVER)
        return cli_complain(command == CLI_GATHER   ? "the folder is missing: kempe %s FOLDER"
                            : command == CLI_REDUCE ? "the mesh is missing: kempe %s MESH"
                                                    : "the model file is missing: kempe %s FILE",
                            command_name);
    return true;
}

bool cli_option_look(unsigned command, int k, cli_option_view *view)
{
    for (const option *o = options; o < options + OPTION_COUNT; o++)
        if ((o->commands & command) && k-- == 0) {
            *view = (cli_option_view){o->name, o->value, kinds[o->kind].ending, letter_of(o)};
            return true;
        }
    return false;
}

/* The columns at which the text of an option begins, and its lines end. */
enum { HELP_COLUMN = 31, HELP_END = 100 };

/* A text from HELP_COLUMN on, without the marks of words in pages. */
static void put_help(const char *text, FILE *out)
{
    int column = HELP_COLUMN;
    for (const char *word = text; *word;) {
        const int length = (int)strcspn(word, " ");
        int shown = length;
        for (int k = 0; k < length; k++)
            shown -= word[k] == '`';
        if (word > text && column + 1 + shown > HELP_END) {
            fprintf(out, "\n%*s", HELP_COLUMN, "");
            column = HELP_COLUMN;
        } else if (word > text) {
            fputc(' ', out);
            column++;
        }
        for (int k = 0; k < length; k++)
            if (word[k] != '`')
                fputc(word[k], out);
        column += shown;
        word += length;
        word += strspn(word, " ");
    }
    fputc('\n', out);
}

void cli_options_print(unsigned command, FILE *out)
{
    for (option_group group = 0; group < OPTION_GROUPS; group++) {
        bool any = false;
        for (const option *o = options; o < options + OPTION_COUNT; o++) {
            if (!(o->commands & command) || o->group != group)
                continue;
            if (!any)
                fprintf(out, "\n%s:\n", groups[group]);
            any = true;
            char left[40];
            snprintf(left, sizeof left, "--%s%s%s", o->name, o->value ? " " : "", o->value ? o->value : "");
            if (letter_of(o))
                fprintf(out, "  -%c, %-25s", letter_of(o), left);
            else
                fprintf(out, "      %-25s", left);
            if (strlen(left) >= HELP_COLUMN - 6)
                fprintf(out, "\n%*s", HELP_COLUMN, "");
            put_help(o->help, out);
        }
    }
}
