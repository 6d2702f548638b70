/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Position analysis of a mechanism: one or several coordinates, or the time, sweep a range together. All others follow
 * on the branch on which the model assembles. Forces play no part.
 *
 *     kempe_kinematics_options ask = {.sweep = "crank=0 deg:360 deg", .points = 361};
 *     kempe_kinematics *sweep;
 *     kempe_kinematics_new(system, &ask, &sweep);
 *     for (int k = 0; k < kempe_kinematics_row_count(sweep); k++)
 *         show(kempe_kinematics_s(sweep, k), kempe_kinematics_q(sweep, k));
 */
#ifndef KEMPE_KINEMATICS_H
#define KEMPE_KINEMATICS_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** NULL and 0: the default. */
typedef struct kempe_kinematics_options {
    const char *sweep;   /* "NAME=A:B" or "NAME=A:B:N", comma-separated if several: they vary together, each evenly from
                          * its A to its B. NAME=A is fixed at A. NAME is a coordinate, a drive of the model, or t */
    const char *hold;    /* "NAME,..": coordinates fixed at their assembled values */
    const char *release; /* "NAME,..": drives and locks of the model to be ignored; those of swept coordinates always
                          * are */
    int points;          /* rows; default: N of the first range that has one, or 361 */
    double speed;        /* of the first driven coordinate, rad/s or m/s, constant; default: 1. Not with t */
    const char *backend; /* as in kempe_run_options */
} kempe_kinematics_options;

typedef struct kempe_kinematics kempe_kinematics;

/** Sweeps the range. KEMPE_STOPPED: a dead centre or an interrupt ends it early. KEMPE_E_FAILED: the driven coordinates
 * do not determine the others, contradict each other, or no row can be reached. `*kinematics` is then given only if it
 * has results. KEMPE_E_ARGUMENT: a name or a range is wrong. */
KEMPE_API kempe_status kempe_kinematics_new(const kempe_system *system, const kempe_kinematics_options *ask,
                                            kempe_kinematics **kinematics);
KEMPE_API void kempe_kinematics_free(kempe_kinematics *kinematics);

/** "ok", "stopped" or "failed", and the reason as a sentence ("" when ok). */
KEMPE_API const char *kempe_kinematics_status(const kempe_kinematics *kinematics);
KEMPE_API const char *kempe_kinematics_reason(const kempe_kinematics *kinematics);

/** The number of rows; the parameter of row k, 0 at A and 1 at B, and its time. */
KEMPE_API int kempe_kinematics_row_count(const kempe_kinematics *kinematics);
KEMPE_API double kempe_kinematics_s(const kempe_kinematics *kinematics, int k);
KEMPE_API double kempe_kinematics_time(const kempe_kinematics *kinematics, int k);

/** One row, n values, owned by the sweep; rates are NaN in a row at a dead centre. NULL: the row does not exist. */
KEMPE_API const double *kempe_kinematics_q(const kempe_kinematics *kinematics, int k);
KEMPE_API const double *kempe_kinematics_qd(const kempe_kinematics *kinematics, int k);
KEMPE_API const double *kempe_kinematics_qdd(const kempe_kinematics *kinematics, int k);

/** The model's other outputs that need no multipliers: the number of columns, the name of one, and one row of them. */
KEMPE_API int kempe_kinematics_output_count(const kempe_kinematics *kinematics);
KEMPE_API const char *kempe_kinematics_output_name(const kempe_kinematics *kinematics, int column);
KEMPE_API const double *kempe_kinematics_outputs(const kempe_kinematics *kinematics, int k);

/** A dead centre: a limit of the driven coordinates, which no branch continues. */
typedef struct kempe_dead_centre {
    double s;
    const char *coordinate; /* the first driven coordinate */
    double value;           /* its value, rad or m */
    int largest;            /* 1: the value is a local maximum; -1: a local minimum */
    double determined;      /* pivot by which the driven coordinates determine the others, 0 in exact arithmetic */
    double margin;          /* distance from a change point: the last pivot of J over its usual size */
    const char *instead;    /* alternative driving coordinates, the best first */
} kempe_dead_centre;

/** Dead centres in the order of s, and q at one (n values). NULL: there is no k-th. */
KEMPE_API int kempe_kinematics_dead_count(const kempe_kinematics *kinematics);
KEMPE_API const kempe_dead_centre *kempe_kinematics_dead(const kempe_kinematics *kinematics, int k);
KEMPE_API const double *kempe_kinematics_dead_q(const kempe_kinematics *kinematics, int k);

/** Change points that the sweep crossed without changing direction: s of each. */
KEMPE_API int kempe_kinematics_change_count(const kempe_kinematics *kinematics);
KEMPE_API double kempe_kinematics_change(const kempe_kinematics *kinematics, int k);

KEMPE_API kempe_status kempe_kinematics_print(const kempe_kinematics *kinematics, kempe_format format, char **text);

/** Writes the rows as CSV (a comment with the units; s, t, q.NAME, qd.NAME, qdd.NAME, outputs), whole or not at all. */
KEMPE_API kempe_status kempe_kinematics_write_csv(const kempe_kinematics *kinematics, const char *path);

/** Draws an SVG picture: the paths of the model's position outputs in their plane of largest motion, with dead centres.
 * KEMPE_E_FAILED: the model has no position outputs, or there is no row. */
KEMPE_API kempe_status kempe_kinematics_write_svg(const kempe_kinematics *kinematics, const char *path);

#ifdef __cplusplus
}
#endif
#endif
