/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies: displacements u = sum phi_k z_k in the axes of the body, linear in N coordinates z. The first n of
 * them are coordinates q of the model; the others are quadratic functions of these, z_j = q' E_j q / 2, which have all
 * that is of second order (shortening by bending, for one). Integrals of the fields phi over the mass are all that the
 * equations of motion need (Wallrapp 1994, in another order). */
#pragma once

#include "model/data/body.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** The terms of second order that a body has: all of them; only the shapes of the quadratic functions, without
 * their inertia; none. */
typedef enum kmp_stiffening { KMP_STIFFENING_NONE, KMP_STIFFENING_FIRST, KMP_STIFFENING_FULL } kmp_stiffening;

/** The axes that displacements are measured from: of the end that carries the body's joint; the line between both
 * ends; the mean axes, in which shapes have neither momentum nor angular momentum (Buckens). */
typedef enum kmp_flexible_frame { KMP_FRAME_CLAMPED, KMP_FRAME_CHORD, KMP_FRAME_MEAN } kmp_flexible_frame;

/** A place of a flexible body that joints, closures and forces may use. Its section is turned by small angles about x,
 * y and z: v_own = R_z R_y R_x v_section. Places and angles are a q + q' A q / 2. */
struct kmp_flexible;

typedef struct kmp_station {
    kmp_number *at;              /* 3: where it is without deformation, from the body's origin, m */
    kmp_number *shift;           /* 3 x n: its displacement, by coordinates */
    kmp_number *shift_more;      /* 3 x n x n, symmetric: second derivatives */
    kmp_number *turn;            /* 3 x n: its angles about x, y, z, by coordinates */
    kmp_number *turn_more;       /* 3 x n x n, symmetric: second derivatives */
    kmp_number *section;         /* 3: area, int y^2, int z^2 of its section; zero where they are not given */
    kmp_number *strained;        /* 3 x n: torsion and bending moments about x, y, z of its section by the strain, by
                                    coordinates; zero about axes without shapes */
    struct kmp_flexible *beyond; /* the body's part beyond it, with the same coordinates, only as moments; NULL: of the
                                    first station, or its part of the length depends on parameters */
} kmp_station;

/** The numbers of a beam before its constants are made (model/flexible/beam.h). */
typedef struct kmp_beam kmp_beam;

typedef struct kmp_flexible {
    int body;
    int first, count;    /* its coordinates q: motions of the model; n */
    int quadratic_count; /* N - n */
    kmp_stiffening stiffening;
    kmp_flexible_frame frame;
    const char *file;  /* that its modes are from; NULL: a beam */
    const char *doubt; /* what the file lacks or contradicts, a sentence; NULL: nothing */
    bool averaged;     /* integrals of its deformation are means: it must turn slowly */
    bool turned;       /* all numbers are in the axes of the beam: */
    double axes[3][3]; /* v_body = axes v_own, when turned; otherwise they are the body's */
    int number_count;
    kmp_number *numbers;   /* all that follow, and the numbers of stations, one after the other */
    kmp_number *length;    /* 1, m: of the beam; of a body from a file, its farthest node or place */
    kmp_number *mass;      /* 1, kg */
    kmp_number *moment;    /* 3: int X dm, X from the body's origin without deformation */
    kmp_number *second;    /* 6: int X X' dm; xx yy zz xy xz yz */
    kmp_number *field;     /* N x 3: int phi_k dm */
    kmp_number *by_place;  /* N x 3 x 3: int phi_k X' dm */
    kmp_number *by_field;  /* N x N x 3 x 3: int phi_k phi_l' dm, (l, k) the transpose of (k, l) */
    kmp_number *quadratic; /* (N - n) x n x n: E_j, symmetric */
    kmp_number *stiffness; /* n x n, symmetric */
    kmp_number *damping;   /* n x n, symmetric */
    bool moved;            /* the place of its joint, station 0, moves or turns with q; otherwise its joint holds the
                              origin of its axes */
    int station_count;
    kmp_station *stations;
    const kmp_beam *beam; /* without its stations */
} kmp_flexible;

/** Numbers of a body of these counts, and of its stations: the pointers go to `numbers`, which may be NULL, and
 * number_count is set. */
void kmp_flexible_lay(kmp_flexible *flexible, kmp_number *numbers);

/** True if the joint of the body is at a station 0 that moves or turns with the coordinates: in mean axes it holds
 * these. */
bool kmp_flexible_joint_moves(const kmp_flexible *flexible);

/** A vector of the body's axes in the axes that its numbers are in, and back. */
void kmp_flexible_from_body(const kmp_flexible *flexible, const double v[3], double own[3]);
void kmp_flexible_to_body(const kmp_flexible *flexible, const double own[3], double v[3]);

/** A copy of a body; a flexible one has the mass, centre and inertia that it has without deformation, as values. */
kmp_body kmp_body_undeformed(const kempe_model *model, int body);

/** The words for the parts into which a body that deflects too far is to be divided. */
static inline const char *kmp_flexible_parts(const kmp_flexible *flexible)
{
    return flexible->file ? "several bodies" : "'segments'";
}

extern const char *const kmp_stiffening_words[3], *const kmp_flexible_frame_words[3];

/** Flexible body k of a model, and the number of these. */
const kmp_flexible *kmp_model_flexible(const kempe_model *model, int k);
int kmp_model_flexible_count(const kempe_model *model);
