/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Rolling contact of two bodies that touch in one point: Hertz's ellipse and the laws of creep. Plain functions of
 * numbers, without a model, a context or an allocation.
 *
 *     kempe_touch touch = {.along = 1 / 0.46, .across = 1 / 0.3, .shear_modulus = 82e9, .poisson = 0.28};
 *     kempe_ellipse ellipse;
 *     kempe_contact_hertz(&touch, 80e3, &ellipse);
 *     kempe_creep creep = {.a = ellipse.a, .b = ellipse.b, .shear_modulus = 82e9, .poisson = 0.28,
 *                          .normal = 80e3, .friction = 0.3, .slip = {1e-3, 0}};
 *     kempe_creep_force force;
 *     kempe_contact_creep(KEMPE_CREEP_POLACH, &creep, &force);
 *
 * Axes: x in the direction of rolling, y across, z along the normal, right-handed. All signs follow these axes. Slip
 * and spin are the velocity and the rotation about z of one body (the wheel) relative to the other (the rail), divided
 * by the rolling speed. Force and moment act on the wheel. So a wheel that turns too fast has negative slip[0], and
 * force[0] drives it forwards.
 *
 * Both bodies have the same material. Two different materials are represented by one with 1/G = (1/G1 + 1/G2)/2 and
 * poisson/G = (poisson1/G1 + poisson2/G2)/2 (Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990).
 *
 * SI units: m, N, Pa. A function returns KEMPE_OK, or KEMPE_E_ARGUMENT if a number is not finite or outside its
 * documented range. Outputs are then unchanged.
 */
#ifndef KEMPE_ROLLING_CONTACT_H
#define KEMPE_ROLLING_CONTACT_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/* -- the normal problem --------------------------------------------------------------------------- */

/** Geometry and material of two touching bodies. Curvatures are sums over both bodies, 1/R1 + 1/R2, a concave one
 * negative; the sums are positive. */
typedef struct kempe_touch {
    double along, across; /* 1/m, > 0: in the direction of rolling, and across */
    double shear_modulus; /* Pa, > 0 */
    double poisson;       /* 0 to 0.5 */
} kempe_touch;

typedef struct kempe_ellipse {
    double a, b;      /* semi-axes along and across, m */
    double approach;  /* approach of the bodies, m */
    double pressure;  /* largest pressure, at the centre, Pa */
    double stiffness; /* K of N = K approach^1.5, N/m^1.5 */
} kempe_ellipse;

/** The contact ellipse of a normal force (N, >= 0): Hertz 1882, with complete elliptic integrals, for any ratio of
 * curvatures, accurate to rounding. */
KEMPE_API kempe_status kempe_contact_hertz(const kempe_touch *touch, double normal, kempe_ellipse *ellipse);

/* -- creep ---------------------------------------------------------------------------------------- */

/** Kalker's creepage coefficients of an ellipse a/b (> 0), poisson 0 to 0.5: his table (1990, E.3) for a/b or b/a from
 *  0.1 to 1, his asymptotes beyond, blended; docs/contact_laws.md. */
typedef struct kempe_kalker {
    double c11, c22, c23, c33;
} kempe_kalker;

KEMPE_API kempe_status kempe_contact_kalker(double ratio, double poisson, kempe_kalker *coefficients);

typedef enum kempe_creep_law {
    KEMPE_CREEP_NONE,    /* no force */
    KEMPE_CREEP_LINEAR,  /* Kalker 1967: no bound */
    KEMPE_CREEP_SHEN,    /* Shen, Hedrick, Elkins 1983: the linear force, bounded as by Johnson and Vermeulen */
    KEMPE_CREEP_POLACH,  /* Polach 1999, with spin; gives no moment */
    KEMPE_CREEP_TANH,    /* Jaschinski 1990: each component of the linear force bounded by itself */
    KEMPE_CREEP_FASTSIM, /* Kalker 1982: strips, three flexibilities, parabolic bound */
    KEMPE_CREEP_FASTSIM1 /* FASTSIM with one flexibility: in full slip the traction opposes the slip */
} kempe_creep_law;

/** "none", "linear", "shen", "polach", "tanh", "fastsim", "fastsim1"; NULL: the law does not exist. */
KEMPE_API const char *kempe_contact_law_name(kempe_creep_law law);

typedef struct kempe_creep {
    double a, b;          /* semi-axes of the ellipse along and across, m, > 0 */
    double shear_modulus; /* Pa, > 0 */
    double poisson;       /* 0 to 0.5 */
    double normal;        /* force, N, >= 0 */
    double friction;      /* coefficient, >= 0 */
    double slip[2];       /* creepage along and across, 1 */
    double spin;          /* 1/m */
    int strips;           /* strips of FASTSIM, and steps in each; 0: 50 */
} kempe_creep;

typedef struct kempe_creep_force {
    double force[2]; /* on the wheel, along and across, N */
    double moment;   /* on the wheel about the normal, N m */
    double sticking; /* share of the ellipse that does not slip: only FASTSIM, otherwise 0 */
} kempe_creep_force;

KEMPE_API kempe_status kempe_contact_creep(kempe_creep_law law, const kempe_creep *creep, kempe_creep_force *force);

/** The flexibilities L1, L2, L3 (m^3/N) with which FASTSIM gives the forces of the linear theory in the absence of
 * slip. */
KEMPE_API kempe_status kempe_contact_flexibilities(const kempe_creep *creep, double flexibility[3]);

/** The single flexibility (m^3/N) in place of the three (Kalker 1982): their mean, each weighted by its creepage x, y
 * and spin sqrt(a b), over the length of the creepage vector. With only one creepage it gives the linear force.
 * Without creepage it is L1. */
KEMPE_API kempe_status kempe_contact_flexibility(const kempe_creep *creep, double *flexibility);

/** FASTSIM with given flexibilities, each > 0. */
KEMPE_API kempe_status kempe_contact_fastsim(const kempe_creep *creep, const double flexibility[3],
                                             kempe_creep_force *force);

/* -- the kinematic motion of a wheelset ------------------------------------------------------------ */

typedef struct kempe_conicity {
    double conicity;  /* tan gamma_e; 0: the wheelset does not oscillate, its radii are equal */
    double low, high; /* ends of the motion, m: twice the amplitude apart, around the place of equal radii */
} kempe_conicity;

/** Equivalent conicity of a wheelset (EN 15302): the slope of the cone whose kinematic motion has the same wavelength,
 * at an amplitude (m, > 0). `difference` is the rolling radius of the left wheel less the right one, in m. It
 * is given at `count` (>= 2) ascending lateral places y of the wheelset, positive to the left, and linear between them.
 * The motion is integrated without further error. The wavelength is 2 pi sqrt(e r / (2 conicity)), with the distance e
 * of the contacts and the mean radius r. Of several motions the one whose middle is nearest to y = 0 is taken.
 * KEMPE_E_FAILED: no motion of the amplitude is inside the places. */
KEMPE_API kempe_status kempe_contact_conicity(int count, const double *y, const double *difference, double amplitude,
                                              kempe_conicity *conicity);

KEMPE_END

#endif
