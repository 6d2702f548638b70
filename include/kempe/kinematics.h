/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Position analysis of a mechanism: one or several coordinates, or the time, sweep a range together. All others follow
 * on the branch on which the model assembles. Forces play no part, except that they may deform flexible bodies.
 *
 *     kempe_kinematics_options ask = {.sweep = "crank=0 deg:360 deg", .points = 361};
 *     kempe_kinematics *sweep;
 *     kempe_kinematics_new(system, &ask, &sweep);
 *     kempe_table *rows;
 *     kempe_kinematics_table(sweep, "rows", &rows);
 *     kempe_table_write(rows, "sweep.csv");
 */
#ifndef KEMPE_KINEMATICS_H
#define KEMPE_KINEMATICS_H

#include <kempe/table.h>

KEMPE_BEGIN

/** NULL and 0: the default. */
typedef struct kempe_kinematics_options {
    size_t size;         /* sizeof this struct; 0: its size in version 0.1 */
    const char *sweep;   /* "NAME=A:B" or "NAME=A:B:N", comma-separated if several: they vary together, each evenly from
                          * its A to its B. NAME=A is fixed at A. NAME is a coordinate, a drive of the model, or t */
    const char *hold;    /* "NAME,..": coordinates fixed at their assembled values */
    const char *release; /* "NAME,..": drives and locks of the model to be ignored; for swept coordinates always
                          * are */
    int points;          /* rows; default: N of the first range that has one, or 361 */
    const char *speed;   /* constant rate of the first swept coordinate, "2" (rad/s or m/s), "90 deg/s", "30 rpm",
                          * "5 mm/s"; default: 1. Not with t */
    const char *backend; /* as in kempe_run_options */
    const char *elastic; /* deformations of flexible bodies: "held", as assembled (the default), or "static", in balance
                          * with the loads at rest at each position */
} kempe_kinematics_options;

typedef struct kempe_kinematics kempe_kinematics;

/** Sweeps the range. KEMPE_STOPPED: a dead centre or an interrupt ends it early. KEMPE_E_FAILED: the driven coordinates
 * do not determine the others, contradict each other, or no row can be reached. `*kinematics` is then given only if it
 * has results. KEMPE_E_ARGUMENT: a name or a range is wrong. */
KEMPE_API kempe_status kempe_kinematics_new(const kempe_system *system, const kempe_kinematics_options *options,
                                            kempe_kinematics **kinematics);
KEMPE_API void kempe_kinematics_free(kempe_kinematics *kinematics);

/** Its outcome, and the reason as a sentence ("" when complete). */
KEMPE_API kempe_outcome kempe_kinematics_outcome(const kempe_kinematics *kinematics);
KEMPE_API const char *kempe_kinematics_reason(const kempe_kinematics *kinematics);

KEMPE_API kempe_status kempe_kinematics_print(const kempe_kinematics *kinematics, kempe_format format, char **text);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "rows": s, 0 at A and 1 at B; t; q.NAME, qd.NAME and qdd.NAME, rates unknown in a row at a dead centre; the model's
 * other outputs that need no multipliers.
 * "dead_centres", limits of the driven coordinates, which no branch continues: s; coordinate, the first driven one, and
 * its value; extreme, "greatest" or "least"; determined; margin; instead; q.NAME. The column determined is the pivot by
 * which the driven coordinates determine the others, 0 in exact arithmetic. The margin is the distance from a change
 * point, the last pivot of J over its usual size. The column instead has alternative driving coordinates, the best
 * first.
 * "change_points", crossed without changing direction: s, value and margin as above, q.NAME. */
KEMPE_API kempe_status kempe_kinematics_table(const kempe_kinematics *kinematics, const char *name,
                                              kempe_table **table);

/** Draws a picture, .svg or .png (table.h): the paths of the model's position outputs in their plane of largest motion,
 * with dead centres. KEMPE_E_FAILED: the model has no position outputs, or there is no row. */
KEMPE_API kempe_status kempe_kinematics_write_picture(const kempe_kinematics *kinematics, const char *path);

/** Writes a self-contained HTML page: the positions moving, all columns of "rows" as curves. KEMPE_E_IO: the path
 * cannot be written. */
KEMPE_API kempe_status kempe_kinematics_write_report(const kempe_kinematics *kinematics, const char *path);

KEMPE_END
#endif
