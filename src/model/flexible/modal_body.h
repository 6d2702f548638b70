/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies of modes that another program has computed: displacements u = sum phi_k q_k, known by their integrals
 * over the mass, and at places. Numbers in SI; modes have no unit, coordinates are in metres. */
#pragma once

#include "base/text.h"
#include "model/data/flexible.h"

/** A place that moves and turns with the modes. */
typedef struct kmp_modal_place {
    double at[3];         /* without deformation */
    double *shift, *turn; /* 3 x n: displacement, and rotation in rad/m, by coordinates */
    double *more;         /* 3 x n x n: second derivatives of its displacement; NULL: not known */
} kmp_modal_place;

/** A file may give all of the integrals int phi_k X' dm and int phi_k phi_l' dm; of the second ones only their traces
 * and axial vectors; of the first ones their axial vectors, and of the second ones their traces. */
typedef enum kmp_modal_known { KMP_MODAL_ALL, KMP_MODAL_TRACES, KMP_MODAL_AXIAL } kmp_modal_known;

/** All matrices by rows. Integrals dm over the body; X the place without deformation. */
typedef struct kmp_modal_body {
    kmp_arena *arena;
    int count; /* of modes, n */
    kmp_modal_known known;
    double mass, moment[3], second[9];   /* int dm, int X dm, int X X' dm */
    double *field, *by_place, *by_field; /* n x 3: int phi_k dm; n x 3 x 3: int phi_k X' dm;
                                            n x n x 3 x 3: int phi_k phi_l' dm */
    double *stiffness, *damping;         /* n x n; damping NULL: none is given */
    double *moment_more, *second_more;   /* 3 x n x n and 3 x 3 x n x n: second derivatives of int u dm and
                                            int u X' dm by terms of second order; NULL: not known */
    int node_count;
    double *node, *mode; /* node_count x 3, node_count x 3 x n */
    double *number;      /* of nodes, in ascending order; NULL: from 0 on */
    int place_count;
    kmp_modal_place *places;
} kmp_modal_body;

/** Values x' K x = value x' M x of n x n matrices, ascending, with x' M x = 1; x by rows: mode k is at x + n k. False:
 * M is not positive, or no memory. */
bool kmp_modal_values(kmp_arena *arena, int n, const double *stiffness, const double *mass, double *values, double *x);

/** Makes the integrals from a mass matrix between the nodes that is the same for x, y and z: `count` entries (row, col,
 * value), of which several at one place add up. False: no memory. */
bool kmp_modal_integrate(kmp_modal_body *body, ptrdiff_t count, const int *row, const int *col, const double *value);

/** The trace of int phi_k phi_l' dm: n x n. */
void kmp_modal_mass(const kmp_modal_body *body, double *mass);

/** The number of rigid motions that the modes can make up, by their integrals; combinations of the modes without them
 * are the rows of `elastic` (n x n), that number less. -1: `why` says what is wrong with mass or stiffness, or there is
 * no memory. */
int kmp_modal_rigid(const kmp_modal_body *body, double *elastic, kmp_text *why);

/** Converts the integrals to places from `origin`. */
void kmp_modal_move_origin(kmp_modal_body *body, const double origin[3]);

/** The rigid motion c + w x X that each mode has in a frame, whose origin is the first place, or in the mean frame by
 * its momentum and angular momentum: n x 6 (c, w). False: in the mean frame the body has no inertia about an axis. */
bool kmp_modal_frame(const kmp_modal_body *body, kmp_flexible_frame frame, double *rigid);

/** Subtracts from mode k the rigid motion c + w x X of row k of `rigid` (n x 6: c, w). */
void kmp_modal_subtract(kmp_modal_body *body, const double *rigid);

/** Gives integrals that are not known their means: displacements are taken as equal in all directions. */
void kmp_modal_average(kmp_modal_body *body);

/** Replaces the modes by `count` combinations of them, the rows of `v` (count x n). False: no memory. */
bool kmp_modal_combine(kmp_modal_body *body, int count, const double *v);

/** A node by its number; -1: there is none. */
int kmp_modal_find_node(const kmp_modal_body *body, double number);

/** Adds a place at the mean of nodes that moves and turns as they do by least squares; a single node moves by itself,
 * and turns as the nodes about it do. Its number; -1: no rotation follows from the nodes, because they are in a line,
 * or there is no memory. */
int kmp_modal_add_nodes(kmp_modal_body *body, int count, const int *nodes);

/** Makes the numbers and stations of a flexible body, one for each place, of terms `none` or `first`, in the arena; its
 * stiffening is known. Numbers of `body` that are zero but for rounding become zero. Damping is taken from the file,
 * or else from a ratio of each mode and of mass and stiffness. False: no memory. */
bool kmp_modal_make(kmp_arena *arena, kmp_modal_body *body, bool damped, kmp_number ratio, const kmp_number rayleigh[2],
                    kmp_flexible *flexible);
