/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Wheels on their rails over a range: one or several parameters or coordinates go through their values together, and at
 * each the rest is in balance; where each wheel touches, how hard, with what creepages and forces.
 *
 *     kempe_contact_options ask = {.sweep = "y=0:10 mm:21", .hold = "yaw"};
 *     kempe_contact_table *table;
 *     kempe_contact_table_new(system, &ask, &table);
 *     for (int k = 0; k < kempe_contact_table_count(table); k++)
 *         show(kempe_contact_table_value(table, k), kempe_contact_table_patch(table, k, wheel, zone));
 *
 * The laws themselves, without a model, are in contact.h.
 */
#ifndef KEMPE_CONTACT_TABLE_H
#define KEMPE_CONTACT_TABLE_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** NULL and 0: the default. What moves at the start moves on at that rate, everything else stands still. */
typedef struct kempe_contact_options {
    const char
        *sweep; /* "NAME=A:B:N" or "NAME=A:B", with commas between several, which go together, each evenly from its
                 * A to its B; NAME=A stays at A. Parameters of the model, and coordinates, which are held there */
    const char *hold;      /* "NAME,..": coordinates that stay where they assemble */
    const char *solve_for; /* "NAME,..": of what moves, the coordinates that nothing drives: their rates are found;
                            * default: those that turn; "-": none */
    const char *law; /* "linear", "shen", "polach", "tanh", "fastsim", "fastsim1" (contact.h): forces by this law beside
                      * the wheel's own, at the same normal force, creepages and spin */
    int points;      /* values; default: N of the first range that has one, or 21 */
    const char *backend; /* as in kempe_run_options */
} kempe_contact_options;

/** Where a zone of a wheel touches. Of what does not touch the geometry is where it comes nearest, of an elastic wheel
 *  that is well off the rail at one of a few fixed places of the zone, and normal 0. */
typedef struct kempe_contact_patch {
    int touches;
    double s, y;      /* lateral coordinates, outwards: on the wheel's profile; from the track's middle, m */
    double angle;     /* of contact, rad: positive where the rail falls inwards, as under a flange */
    double radius;    /* rolling radius, m */
    double normal;    /* force, N */
    double slip[2];   /* creepages along and across (to the left), 1 */
    double spin;      /* 1/m */
    double force[2];  /* on the wheel, N, by its own law */
    double moment;    /* N m */
    double a, b;      /* semi-axes of Hertz's ellipse along and across, m */
    double by_law[2]; /* the force by the law that was asked for; NaN without one */
    int one_ellipse;  /* 1: the patch is that ellipse, and the largest pressure is 3 normal / (2 pi a b); 0: it is not,
                       * has  two lobes, say, and a and b are good for creep forces alone: pressures may be several times
                       * those of the ellipse; -1: not known, of a rigid wheel or of what does not touch */
} kempe_contact_patch;

typedef struct kempe_contact_table kempe_contact_table;

/** Goes through the values from the assembled start. KEMPE_STOPPED: it came only so far, and why; `*table` is given.
 * The system must outlive it. KEMPE_E_ARGUMENT: the model has no wheels, or a name, range or word. KEMPE_E_FAILED: it
 * does not assemble, or there is no balance at the first value, and why. */
KEMPE_API kempe_status kempe_contact_table_new(const kempe_system *system, const kempe_contact_options *ask,
                                               kempe_contact_table **table);
KEMPE_API void kempe_contact_table_free(kempe_contact_table *table);

/** "ok" or "stopped", and the sentence that goes with it ("" when ok). */
KEMPE_API const char *kempe_contact_table_status(const kempe_contact_table *table);
KEMPE_API const char *kempe_contact_table_reason(const kempe_contact_table *table);

/** Values that were reached; the k-th of what comes first in `over`, SI; q and qd there (n each, owned by the table).
 *  NaN and NULL where there is none. */
KEMPE_API int kempe_contact_table_count(const kempe_contact_table *table);
KEMPE_API double kempe_contact_table_value(const kempe_contact_table *table, int k);
KEMPE_API const double *kempe_contact_table_q(const kempe_contact_table *table, int k);
KEMPE_API const double *kempe_contact_table_qd(const kempe_contact_table *table, int k);

/** The wheels, the zones of one, and a patch: owned by the table, NULL where there is none. */
KEMPE_API int kempe_contact_table_wheel_count(const kempe_contact_table *table);
KEMPE_API const char *kempe_contact_table_wheel(const kempe_contact_table *table, int wheel);
KEMPE_API int kempe_contact_table_zone_count(const kempe_contact_table *table, int wheel);
KEMPE_API const kempe_contact_patch *kempe_contact_table_patch(const kempe_contact_table *table, int k, int wheel,
                                                               int zone);

KEMPE_API kempe_status kempe_contact_table_print(const kempe_contact_table *table, kempe_format format, char **text);

/** A row a value, wheel and zone, a comment with the units before them; whole or not at all. */
KEMPE_API kempe_status kempe_contact_table_write_csv(const kempe_contact_table *table, const char *path);

/** A picture: of each wheel its profile on the rail with the points that touch joined at every value, and over the
 * values rolling radius, contact angle, normal force and forces. */
KEMPE_API kempe_status kempe_contact_table_write_svg(const kempe_contact_table *table, const char *path);

#ifdef __cplusplus
}
#endif
#endif
