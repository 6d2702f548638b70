/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Wheels on their rails over a range. One or several parameters or coordinates take their values together, and at each
 * the other coordinates are in balance. The table has the contact points, normal forces, creepages and creep forces of
 * each wheel.
 *
 *     kempe_contact_options ask = {.sweep = "y=0:10 mm:21", .hold = "yaw"};
 *     kempe_contacts *table;
 *     kempe_contacts_new(system, &ask, &table);
 *     kempe_table *rows;
 *     kempe_contacts_table(table, "rows", &rows);
 *     for (int k = 0; k < kempe_table_row_count(rows); k++)
 *         show(kempe_table_word(rows, k, 1), kempe_table_number(rows, k, kempe_table_find(rows, "normal")));
 *
 * The laws themselves, without a model, are in rolling_contact.h.
 */
#ifndef KEMPE_VEHICLE_H
#define KEMPE_VEHICLE_H

#include <kempe/table.h>

KEMPE_BEGIN

/** NULL and 0: the default. Coordinates that move at the start keep their rates; all others are at rest.
 *
 * `pressure`: pressure, area, approach and outline of each patch, for any shape of the gap. Two methods approximate in
 * strips (Kik and Piotrowski 1996; Sichani, Enblom and Berg 2014), "half-space" solves on a grid. "half-space:2" and
 * "half-space:3" divide its rectangles by that number both ways. docs/contact.md has errors and costs.
 *
 * `law` "half-space" solves for the creep forces of steady rolling on such a grid (Kalker 1990). The pressures are then
 * from "half-space". */
typedef struct kempe_contact_options {
    size_t size;       /* sizeof this struct; 0: its size in version 0.1 */
    const char *sweep; /* "NAME=A:B:N" or "NAME=A:B", comma-separated if several: they vary together, each evenly from
                        * its A to its B. NAME=A is fixed at A. NAME is a parameter of the model or a coordinate, which
                        * is held at the value */
    const char *hold;  /* "NAME,..": coordinates fixed at their assembled values */
    const char *solve_for; /* "NAME,..": moving coordinates without a drive: their rates are solved for; default: wheels
                            * that turn; "-": none */
    const char *law; /* "linear", "shen", "polach", "tanh", "fastsim", "fastsim1" (rolling_contact.h) or "half-space": a
                      * second law for the forces, in addition to the wheel's own, at the same normal force,
                      * creepages and spin */
    int points;      /* number of values; default: N of the first range that has one, or 21 */
    const char *backend;  /* as in kempe_run_options */
    const char *conicity; /* "A:B:N" or "A", as "1 mm:7 mm:13" (13 when N is absent): amplitudes at which the equivalent
                           * conicity is computed. The first swept quantity then moves the wheels of a wheelset
                           * laterally */
    const char *pair;     /* "LEFT,RIGHT": the wheels of that wheelset; default: the only left and the only right one */
    const char *pressure; /* "kik-piotrowski", "analyn", "half-space": a method for the pressures of each patch */
} kempe_contact_options;

/** The contact patch of a zone of a wheel. Without contact, normal is 0 and the geometry belongs to the closest
 * approach. For an elastic wheel that is well off the rail it is one of a few fixed places of the zone. */
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
    double by_law[2]; /* the force by the law in the options; NaN without one, or if "half-space" does not converge */
    int one_ellipse;  /* 1: the patch is that ellipse, and the largest pressure is 3 normal / (2 pi a b). 0: the patch
                       * is not an ellipse (for example it has two lobes), and a and b are valid only for creep forces:
                       * pressures may be several times the values of the ellipse. -1: unknown (a rigid wheel, or no
                       * contact) */
    double pressure;  /* largest pressure, Pa, by the method in the options; NaN without one, without contact, or if the
                       * contact reaches the end of its zone. The same for the two below */
    double area;      /* of all lobes, m^2 */
    double approach;  /* of wheel and rail along the normal, m */
    int lobes;        /* separate parts of the contact; 0: unknown */
} kempe_contact_patch;

typedef struct kempe_contacts kempe_contacts;

/** Computes the table from the assembled start. The system must outlive it. KEMPE_STOPPED: the table ends early, with a
 * reason; `*table` is given. KEMPE_E_ARGUMENT: the model has no wheels, or a name, range or word is wrong.
 * KEMPE_E_FAILED: the model does not assemble, or has no balance at the first value; the message has the reason. */
KEMPE_API kempe_status kempe_contacts_new(const kempe_system *system, const kempe_contact_options *options,
                                          kempe_contacts **table);
KEMPE_API void kempe_contacts_free(kempe_contacts *table);

/** Its outcome, and the reason as a sentence ("" when complete). */
KEMPE_API kempe_outcome kempe_contacts_outcome(const kempe_contacts *table);
KEMPE_API const char *kempe_contacts_reason(const kempe_contacts *table);

/** The zones of a wheel, and a patch at the k-th value: owned by the table, NULL for an index that does not exist. */
KEMPE_API int kempe_contacts_zone_count(const kempe_contacts *table, int wheel);
KEMPE_API const kempe_contact_patch *kempe_contacts_patch(const kempe_contacts *table, int k, int wheel, int zone);

KEMPE_API kempe_status kempe_contacts_print(const kempe_contacts *table, kempe_format format, char **text);

/** Nonlinearity parameter of the pair, 1/m: half the increase of its equivalent conicity from an amplitude of 2 mm to
 * one of 4 mm, over 1 mm. NaN: a conicity is not requested, or unknown at one of them. */
KEMPE_API double kempe_contacts_nonlinearity(const kempe_contacts *table);

/** The tables "rows", a row for each value, wheel and zone with the numbers of its patch, and "states", a row for each
 * value with q and qd, SI. With conicity also "conicity", a row for each amplitude, and "radii", the
 * differences of the rolling radii, a row for each value and for each point between two of them. With pressures also
 * "outline", a row for each strip of a patch: its lobe, its lateral place on the track, its ends forwards from the
 * wheel's centre, its largest pressure. Free a table with kempe_table_free. KEMPE_E_ARGUMENT: another name. */
KEMPE_API kempe_status kempe_contacts_table(const kempe_contacts *contacts, const char *name, kempe_table **table);

/** Writes a picture, .svg or .png (table.h). It shows the profile of each wheel on the rail, with the points that touch
 * joined at every value. Rolling radius, contact angle, normal force and forces are plotted over the values, the
 * difference of the rolling radii and the conicity below them. */
KEMPE_API kempe_status kempe_contacts_write_picture(const kempe_contacts *table, const char *path);

KEMPE_END
#endif
