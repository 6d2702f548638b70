/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * A mechanism led through its positions: one or several coordinates, or the time, go through a range together, and
 * everything else follows on the branch that the model assembles on. Forces play no part.
 *
 *     kempe_kinematics_options ask = {.sweep = "crank=0 deg:360 deg", .points = 361};
 *     kempe_kinematics *sweep;
 *     kempe_kinematics_new(system, &ask, &sweep);
 *     for (int k = 0; k < kempe_kinematics_count(sweep); k++)
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
    const char *sweep;   /* "NAME=A:B" or "NAME=A:B:N", with commas between several, which go together, each evenly from
                          * its A to its B; NAME=A stays at A. A coordinate, a drive of the model, or t */
    const char *hold;    /* "NAME,..": coordinates that stay where they assemble */
    const char *release; /* "NAME,..": drives and locks of the model that are left aside; those of what is driven always
                          * are */
    int points;          /* rows; default: N of the first range that has one, or 361 */
    double speed;        /* of the first coordinate that is driven, rad/s or m/s, constant; default: 1. None with t */
    const char *backend; /* as in kempe_run_options */
} kempe_kinematics_options;

typedef struct kempe_kinematics kempe_kinematics;

/** Goes through the range. KEMPE_STOPPED when a dead centre, or an interrupt, ends it early; KEMPE_E_FAILED when what
 *  is driven does not determine the rest, contradicts itself, or no row can be reached: `*kinematics` is then given
 *  only if there is something to tell. KEMPE_E_ARGUMENT: a name or a range. */
KEMPE_API kempe_status kempe_kinematics_new(const kempe_system *system, const kempe_kinematics_options *ask,
                                            kempe_kinematics **kinematics);
KEMPE_API void kempe_kinematics_free(kempe_kinematics *kinematics);

/** "ok", "stopped" or "failed", and the sentence that goes with it ("" when ok). */
KEMPE_API const char *kempe_kinematics_status(const kempe_kinematics *kinematics);
KEMPE_API const char *kempe_kinematics_reason(const kempe_kinematics *kinematics);

/** Rows; of row k the parameter, 0 at A and 1 at B, and the time. */
KEMPE_API int kempe_kinematics_count(const kempe_kinematics *kinematics);
KEMPE_API double kempe_kinematics_s(const kempe_kinematics *kinematics, int k);
KEMPE_API double kempe_kinematics_t(const kempe_kinematics *kinematics, int k);

/** One row, n values, owned by the sweep; rates are NaN in a row that is a dead centre. NULL: no such row. */
KEMPE_API const double *kempe_kinematics_q(const kempe_kinematics *kinematics, int k);
KEMPE_API const double *kempe_kinematics_qd(const kempe_kinematics *kinematics, int k);
KEMPE_API const double *kempe_kinematics_qdd(const kempe_kinematics *kinematics, int k);

/** The model's other outputs that need no multipliers: how many columns, the name of one, and one row of them. */
KEMPE_API int kempe_kinematics_output_count(const kempe_kinematics *kinematics);
KEMPE_API const char *kempe_kinematics_output_name(const kempe_kinematics *kinematics, int column);
KEMPE_API const double *kempe_kinematics_outputs(const kempe_kinematics *kinematics, int k);

/** Where what is driven turns back: it cannot go on, on any branch. */
typedef struct kempe_dead_centre {
    double s;
    const char *coordinate; /* the first that is driven */
    double value;           /* of it: rad or m */
    int largest;            /* 1: it is nowhere larger near by, -1: nowhere smaller */
    double determined;      /* how well the rest is determined by what is driven: a pivot, 0 in exact numbers */
    double margin;          /* how far from a change point: the last pivot of J over its usual size */
    const char *instead;    /* coordinates that could drive on, the best first */
} kempe_dead_centre;

/** In the order of s. NULL: there is no k-th; q there (n). */
KEMPE_API int kempe_kinematics_dead_count(const kempe_kinematics *kinematics);
KEMPE_API const kempe_dead_centre *kempe_kinematics_dead(const kempe_kinematics *kinematics, int k);
KEMPE_API const double *kempe_kinematics_dead_q(const kempe_kinematics *kinematics, int k);

/** Change points that the sweep went through, straight on: s of each. */
KEMPE_API int kempe_kinematics_change_count(const kempe_kinematics *kinematics);
KEMPE_API double kempe_kinematics_change(const kempe_kinematics *kinematics, int k);

KEMPE_API kempe_status kempe_kinematics_print(const kempe_kinematics *kinematics, kempe_format format, char **text);

/** Writes the rows as CSV (a comment with the units; s, t, q.NAME, qd.NAME, qdd.NAME, outputs), whole or not at all. */
KEMPE_API kempe_status kempe_kinematics_write_csv(const kempe_kinematics *kinematics, const char *path);

/** Draws the paths of the model's position outputs in the plane in which they move most, dead centres marked, as SVG.
 *  KEMPE_E_FAILED: the model has no position outputs, or there is no row. */
KEMPE_API kempe_status kempe_kinematics_write_svg(const kempe_kinematics *kinematics, const char *path);

#ifdef __cplusplus
}
#endif
#endif
