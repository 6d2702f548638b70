/* SPDX-License-Identifier: BSD-3-Clause */
/* The Magic Formula as expressions: Pacejka, Tire and Vehicle Dynamics, 3rd edition 2012, equations 4.E1 to 4.E78,
 * without pressure and turn slip (MF 6.1), and the form of PAC2002 and MF 5.2, whose camber terms contain gamma in
 * place of its sine and whose lateral shift is PHY3 gamma. The axes are ISO-W: a positive slip angle gives a
 * negative force. */
#pragma once

#include "model/data/tyre.h"
#include "symbolic/graph.h"

typedef struct kmp_magic_slip {
    kmp_ref load;     /* N, positive */
    kmp_ref kappa;    /* longitudinal slip */
    kmp_ref tangent;  /* of the slip angle, of the side on which the tyre was measured */
    kmp_ref gamma;    /* inclination, rad, likewise */
    kmp_ref friction; /* factor of both coefficients of friction */
    kmp_ref radius;   /* without load */
    kmp_ref forwards; /* V_x, m/s */
    kmp_ref low_speed;
} kmp_magic_slip;

typedef struct kmp_magic_force {
    kmp_ref along, across; /* N */
    kmp_ref moment[3];     /* N m */
    kmp_ref friction;      /* peak coefficient of the longitudinal force */
    kmp_ref stiffness[2];  /* K_x kappa, K_y alpha */
} kmp_magic_force;

void kmp_magic_formula(kmp_graph *g, const kmp_tyre *tyre, const kmp_magic_slip *slip, kmp_magic_force *force);

/** Relaxation lengths along and across by PTX1 .. and PTY1 .., m. */
void kmp_magic_relaxation(kmp_graph *g, const kmp_tyre *tyre, const kmp_magic_slip *slip, kmp_ref length[2]);
