/* SPDX-License-Identifier: BSD-3-Clause */
/* The constants of a beam as a flexible body: shapes that are polynomials of xi = x/length, their integrals, the terms
 * of second order of an axis that keeps its length and of sections that turn with it. */
#pragma once

#include "model/data/flexible.h"
#include "model/flexible/taper.h"

/** Shapes by what they move: the axis along y and z, the sections about x, the axis along x. Coordinates are in this
 * order. */
typedef enum kmp_beam_family {
    KMP_BEAM_Y,
    KMP_BEAM_Z,
    KMP_BEAM_TORSION,
    KMP_BEAM_AXIAL,
    KMP_BEAM_FAMILIES
} kmp_beam_family;

enum { KMP_BEAM_MOST = 12 }; /* shapes of a family */

/** A beam along x of its axes from the body's origin, with y and z along the principal axes of its sections. */
struct kmp_beam {
    bool turned;       /* its axes are not the body's: */
    double axes[3][3]; /* v_body = axes v_beam */
    kmp_number length;
    kmp_taper line_mass;       /* kg/m */
    kmp_taper section_mass[2]; /* kg m: the second moments rho int y^2 and rho int z^2 of a section; without rotary
                                  inertia zero */
    kmp_taper stiffness[KMP_BEAM_FAMILIES]; /* E Iz, E Iy, G J, E A; of families with shapes */
    kmp_number shear[2];                    /* k G A along y and z, where `sheared` */
    bool sheared;                           /* Timoshenko, with the shear force of the bending moment's slope; its
                                               sections are the same everywhere */
    bool reshaped;                          /* how the sections change along it follows parameters */
    bool raw;                               /* shapes are monomials; otherwise modes of their span */
    int count[KMP_BEAM_FAMILIES];
    kmp_flexible_frame frame;
    kmp_stiffening stiffening;
    kmp_number ratio;       /* of damping, of each mode */
    kmp_number rayleigh[2]; /* damping = [0] mass + [1] stiffness */
    kmp_taper section[3];   /* its area, int y^2, int z^2; 0 where they are not given */
    kmp_taper edge[2];      /* of its section along y and z, the outer diameter where it is round; 0: not known */
    bool round;
    int station_count;
    const kmp_number *stations; /* their x; the first is 0 */
    const bool *fixed;          /* of each: x is a part of the length that does not depend on parameters */
};

/** Makes the numbers and stations of a flexible body in the arena, for coordinates in the order of the families; body,
 * first and names are the caller's. False: no memory, which the arena has, or numbers that are not finite. */
bool kmp_beam_make(kmp_arena *arena, const kmp_beam *beam, kmp_flexible *flexible);

/** Component k, in the axes of the body, of a vector of the length x along the beam. */
kmp_number kmp_beam_part(kmp_arena *arena, const kmp_beam *beam, int k, kmp_number x);

/** Stations of a body that is a beam, evenly spaced from end to end, in the arena: for pictures. `parameters`: values
 * of all parameters of the model. NULL: no memory. */
kmp_station *kmp_beam_stations(kmp_arena *arena, const kmp_flexible *flexible, const double *parameters, int count);
