/* SPDX-License-Identifier: BSD-3-Clause */
/* Shapes: kinds, colours, and their mass properties in closed form, as numbers that follow the parameters. A shape has
 * its radii of gyration squared about its centre, times its mass; several are added by the theorem of parallel axes. */
#pragma once

#include "model/data/mesh.h"
#include "model/language/expression.h"

/* The rows of shape_kinds.def. */
typedef enum kmp_shape_kind {
#define KMP_SHAPE(kind, word, keys) KMP_SHAPE_##kind,
#include "model/data/shape_kinds.def"
#undef KMP_SHAPE
    KMP_SHAPE_KINDS
} kmp_shape_kind;

/** The words of the kinds, and of each the further keys that it may have. */
extern const char *const kmp_shape_words[KMP_SHAPE_KINDS], *const kmp_shape_more[KMP_SHAPE_KINDS];

/** In body axes, from the body's origin; members that a kind does not use stay zero. */
typedef struct kmp_shape {
    kmp_shape_kind kind;
    int body;
    kmp_number at[3];               /* the centre; of a mesh its origin, of a line zero */
    bool turned;                    /* the axes of a box, ellipsoid or mesh differ from the axes of the body: */
    double axes[3][3];              /* v_body = axes v_shape */
    kmp_number edge[3];             /* of a box; of an ellipsoid its radii */
    kmp_number radius, length;      /* length: between the centres of both ends */
    kmp_number along[3];            /* unit vector of a cylinder or capsule */
    const kmp_number (*through)[3]; /* the places of a line */
    int through_count;
    const kmp_mesh *mesh;
    kmp_mesh_volume enclosed; /* of a mesh with a mass */
    kmp_number scale;         /* of a mesh: m by a unit of its file */
    bool heavy;               /* it has a mass: */
    bool by_density;          /* matter is its density, else its mass */
    kmp_number matter;        /* positive, also of a hole */
    bool hole;                /* its mass counts negative */
    int colour;               /* 0xrrggbb, -1: the colour of the body */
    double opacity;
} kmp_shape;

/** The colour of a name or of "#rrggbb"; -1: it is none. */
int kmp_colour_find(const char *text);
extern const kmp_name_list kmp_colour_names;

/** Mass, centre of mass, inertia about it as in kmp_body. */
typedef struct kmp_mass_part {
    kmp_number mass, com[3], inertia[6];
} kmp_mass_part;

/** The sum of all shapes with a mass; expressions are in the arena. */
void kmp_shapes_mass(kmp_arena *arena, int count, const kmp_shape *shapes, kmp_mass_part *sum);
