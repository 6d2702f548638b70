/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * A model with other values of its parameters and inputs, another start, another closure tolerance, or another
 * algorithm of its equations.
 */
#ifndef KEMPE_SETTINGS_H
#define KEMPE_SETTINGS_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** A new value of a model parameter: an expression as in the file ("0.3", "7800 kg/m^3", "2*L1"). Of an input: such a
 * constant, or samples as "FILE:COLUMN:METHOD" from a CSV file with a column t, METHOD being hold, linear or cubic. */
typedef struct kempe_setting {
    const char *name, *value;
} kempe_setting;

/** Reads a model with `count` settings of declared parameters and inputs; for repeated names the last one counts. */
KEMPE_API kempe_status kempe_model_read_set(kempe_context *context, const char *path, const kempe_setting *settings,
                                            int count, kempe_model **model);
KEMPE_API kempe_status kempe_model_read_text_set(kempe_context *context, const char *text, const char *label,
                                                 const kempe_setting *settings, int count, kempe_model **model);

/** Support of the root of robots that this context reads from now on from files in another format (URDF, ..):
 * "fixed": the ground; "free": nothing, it has six coordinates; NULL: as the format says. The `base` of an included
 * file comes first. KEMPE_E_ARGUMENT: another word. */
KEMPE_API kempe_status kempe_context_set_base(kempe_context *context, const char *base);

/** Names of elements and attributes of files in other formats that may be left out, separated by commas: "joint,wind";
 * NULL: none. They are mechanics that Kempe does not read and that is an error otherwise. Results of a model without
 * them have a warning and are not trustworthy. The `leave_out` of an included file adds names, and says that the
 * model is meant without them: its results are trustworthy. */
KEMPE_API kempe_status kempe_context_set_left_out(kempe_context *context, const char *names);

/** Makes parts of files in other formats that act only at times errors (1) or warnings (0, the default), each with its
 * line and column: surfaces that touch, limits and controllers that Kempe does not use. */
KEMPE_API kempe_status kempe_context_set_strict(kempe_context *context, int strict);

/** Gives a text that this context reads from now on in place of a file of this name, without looking for such a file:
 * data of fits, motions, samples of inputs ("NAME:COLUMN:METHOD" in a setting), tables. NULL: no longer. Names in
 * messages are of the text. */
KEMPE_API kempe_status kempe_context_set_text(kempe_context *context, const char *name, const char *text);

/** Files of models, their meshes and tables are read from now on only in this folder and its folders, links followed:
 * for programs that read models of others. No pipe is read then: it would be waited for. Texts that are given, and what
 * Kempe keeps in its cache, are read in any case. NULL: everywhere (initially). A file beyond it is KEMPE_E_IO.
 * KEMPE_E_IO: the folder does not exist. */
KEMPE_API kempe_status kempe_context_set_folder(kempe_context *context, const char *folder);

/** Makes limits of joints in files in other formats stops of their coordinates, without rebound (1), or leaves them out
 * (0, the default). The `joint_limits` of an included file comes first. */
KEMPE_API kempe_status kempe_context_set_joint_limits(kempe_context *context, int limits);

/** Makes a model that starts at q with the rates qd (n values each; NaN: not given; NULL: none is), in place of the
 * former start. Independent coordinates keep the given values; other given ones may be off by rounding of their third
 * digit. Coordinates without a value start as in the model and follow where the loops need it; without q the position
 * is the model's. Goals of the model do not count when q is given, and its rates give way where they contradict qd.
 * Values of states are in qd. The model must outlive it. KEMPE_E_FAILED: the loops cannot be closed there, or the
 * values contradict each other; the message has the gap and the coordinates. KEMPE_E_ARGUMENT: a value is infinite. */
KEMPE_API kempe_status kempe_model_start_at(const kempe_model *model, const double *q, const double *qd,
                                            kempe_model **started);

/** Makes a model that starts in a state by its word, as the key `at` of its `start` (docs/model/start.md): "start" is
 * the assembled start; "equilibrium" is the equilibrium to which that leads, also of an instance with other parameters;
 * "equilibrium NAME=RATE,.." is the steady motion with these rates. It is searched by every computation that begins at
 * the start. The model must outlive it. KEMPE_E_ARGUMENT: another word, or this build has no equilibria. */
KEMPE_API kempe_status kempe_model_start_in(const kempe_model *model, const char *state, kempe_model **started);

/* Inputs of a model: functions of time that are given to a run (docs/model/inputs.md). A stepper (kempe/stepper.h) or a
 * workspace (kempe/workspace.h) takes other values. Values here are in SI. */

/** Number of inputs; number of the input with a name, -1: there is none. */
KEMPE_API int kempe_model_input_count(const kempe_model *model);
KEMPE_API int kempe_model_input_find(const kempe_model *model, const char *name);

/** Name of an input, and its unit as written in the model ("" without one). */
KEMPE_API const char *kempe_model_input_name(const kempe_model *model, int input);
KEMPE_API const char *kempe_model_input_unit(const kempe_model *model, int input);

/** Value at t by the model's own samples or default, in SI. */
KEMPE_API double kempe_model_input_value(const kempe_model *model, int input, double t);

/** Reads a number as in a model file, without parameters: "3", "20 ms", "1/25 s". *value is in `unit`; so is a number
 * without a unit. KEMPE_E_ARGUMENT: the text is not a number, or its unit has another dimension. */
KEMPE_API kempe_status kempe_number_read(kempe_context *context, const char *text, const char *unit, double *value);

/** Sets the largest gap in m that redundant closures may keep, in place of the model's closure_tolerance. Call it
 * before a system is made of the model; points and axes of these closures then count as rounded. 0: every closure is
 * closed. KEMPE_E_ARGUMENT: the value is negative or NaN. */
KEMPE_API kempe_status kempe_model_set_closure_tolerance(kempe_model *model, double metres);

/** Derives the equations as kempe_system_new, by a chosen algorithm: auto, composite, plain, ner or articulated. NULL
 * takes the model's, or auto, which takes the cheaper one. KEMPE_E_ARGUMENT: the algorithm does not exist.
 * KEMPE_E_FAILED: the articulated-body algorithm cannot give the accelerations; the message has the reason. */
KEMPE_API kempe_status kempe_system_new_with_algorithm(const kempe_model *model, const char *dynamics,
                                                       kempe_system **system);

KEMPE_END
#endif
