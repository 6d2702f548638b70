/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts that foreign models of robots have in common: numbers of attributes, frames of numbers, and what is written
 * from them into the document. Errors are in import->status, as in formats.h. */
#pragma once

#include "exchange/formats/formats.h"
#include "model/data/mesh.h"
#include "model/data/pose.h"
#include "model/data/shape.h"

/** The text of an attribute, which must be there; NULL after a complaint. The same as a name of Kempe. */
const char *kmp_import_attribute(kmp_import *im, const kmp_element *e, const char *key);
const char *kmp_import_name(kmp_import *im, const kmp_element *e, const char *key);

/** Reads the numbers of a text, from `least` to `most` (16) of them, which must be all of it, and returns how many. An
 * attribute that is absent leaves the values as they are: 0. After a complaint the result is 0, too. */
int kmp_import_read_numbers(kmp_import *im, const kmp_element *e, const char *key, int least, int most, double *values);

/** The only number of an attribute. */
double kmp_import_read_number(kmp_import *im, const kmp_element *e, const char *key, double absent);

/** The mapping of a body that has been added; NULL: there is none. */
kmp_yaml *kmp_import_body(kmp_import *im, const char *name);

/** Adds an empty body with the point `origin`. NULL: no memory, or a complaint that the name exists. */
kmp_yaml *kmp_import_add_body(kmp_import *im, const kmp_element *from, const char *name);

/** Adds a point to a body, or to the ground, at a frame. Its name gets `_` at its end while the body has such a point.
 * Returns BODY.POINT, NULL: there is no body. */
const char *kmp_import_point(kmp_import *im, kmp_place place, const char *body, const char *name, const kmp_pose *at);

/** A direction as a list; a complaint that "the axis of 'NAME' is zero" when it has no length. */
kmp_yaml *kmp_import_direction(kmp_import *im, kmp_place place, const char *name, const double axis[3]);

/** Reads a tensor from ixx .. izz; an absent moment is `moment`, an absent product zero. */
void kmp_import_read_tensor(kmp_import *im, const kmp_element *inertia, double moment, double tensor[3][3]);

/** The mass of a body, and its tensor about the centre of mass, which is given in the axes of a frame there. A tensor
 * that no distribution of mass can have is accepted with a warning: published models have such tensors. NULL for the
 * tensor: none. */
void kmp_import_mass(kmp_import *im, kmp_yaml *body, kmp_place place, double mass, const kmp_pose *centre,
                     const double tensor[3][3]);

/** The joint of a body: `at` names a point. `kind` is a word of Kempe's joints; the axis is NULL where it has none. */
void kmp_import_joint(kmp_import *im, kmp_yaml *body, kmp_place place, const char *name, const char *at,
                      const char *kind, const kmp_yaml *axis);

/** A spring and damper of a joint with one coordinate, as the force JOINT_WORD: nothing when both are zero. */
void kmp_import_spring(kmp_import *im, const kmp_element *from, const char *joint, const char *word, double stiffness,
                       double rest, double damping);

/** Dry friction that sticks, of a joint with one coordinate, as the force JOINT_friction: nothing when it is zero. */
void kmp_import_friction(kmp_import *im, const kmp_element *from, const char *joint, bool slides, double level);

/** The limits of a joint with one coordinate, or of a length as an expression: stops NAME_lower and NAME_upper where
 * limits of joints are asked for, otherwise they are named as not used. Infinite ones, and a range without width, are
 * none. */
void kmp_import_limits(kmp_import *im, const kmp_element *from, const char *name, const char *length, double lower,
                       double upper);

/** A coupler: the sum of factor[k] q(joint[k]) equals a number. */
void kmp_import_coupler(kmp_import *im, const kmp_element *from, const char *name, int count, const char *const *joint,
                        const double *factor, double equals);

/** A coordinate that is held while the loops are closed. */
void kmp_import_hold(kmp_import *im, kmp_place place, const char *coordinate);

/** The entry {KIND: [POINT, POINT]} of a section, to which the caller adds keys. */
kmp_yaml *kmp_import_between(kmp_import *im, const kmp_element *from, const char *section, const char *name,
                             const char *kind, const char *const points[2]);

/** A loop between two points, by a word of Kempe's closures; the axis is in the first point's frame, NULL: none. */
void kmp_import_loop(kmp_import *im, const kmp_element *from, const char *name, const char *kind,
                     const char *const points[2], const kmp_yaml *axis);

/** A colour of red, green and blue from 0 to 1 as "#rrggbb". */
const char *kmp_import_colour(kmp_import *im, const double rgb[3]);

/** Cylinders and capsules have the axis z of their frame. */
typedef enum kmp_import_solid {
    KMP_SOLID_BOX,
    KMP_SOLID_SPHERE,
    KMP_SOLID_CYLINDER,
    KMP_SOLID_CAPSULE,
    KMP_SOLID_ELLIPSOID,
    KMP_SOLID_MESH
} kmp_import_solid;

/** Adds a shape to a body and returns its mapping: a picture without mass, unless the caller gives it a mass or a
 * density. `size`: the three lengths of a box or radii of an ellipsoid; the radius, and the length of a cylinder or
 * the distance between the centres of a capsule's ends. The colour is NULL where it has none. */
kmp_yaml *kmp_import_shape(kmp_import *im, kmp_yaml *body, kmp_place place, kmp_import_solid solid,
                           const double size[3], const kmp_pose *at, const char *colour);

/** A solid as a shape that gives its body a mass, of this value or this density; of a mesh the caller sets the volume.
 */
kmp_shape kmp_import_heavy(kmp_import_solid solid, const double size[3], const kmp_pose *at, double matter,
                           bool by_density);

/** The mass of shapes, its centre, with the axes of the body, and the tensor about it. */
double kmp_import_weigh(kmp_import *im, int count, const kmp_shape *shapes, kmp_pose *centre, double tensor[3][3]);

/** Adds the picture of a mesh to a body: a path from the model's file, or in a package of ROS, "package://NAME/PATH".
 * It is named as left out where there is no such file, or it cannot be drawn. */
void kmp_import_mesh(kmp_import *im, kmp_yaml *body, kmp_place place, const char *uri, const double scale[3],
                     const kmp_pose *at, const char *colour);

/** Reads a mesh whose path is found in the same way, into the arena. False: `why` (empty before) has the reason, or the
 * arena has failed. */
bool kmp_import_read_mesh(kmp_import *im, const char *uri, kmp_mesh *mesh, kmp_text *why);

/** An index of names: in alphabetical order, equal ones in the order of their numbers. */
typedef struct kmp_import_index {
    struct kmp_import_entry {
        const char *name;
        int number;
    } * entry;
    int count;
} kmp_import_index;

/** Makes the index of names 0 to count - 1 of a list; NULL is none. Without memory it is empty. */
kmp_import_index kmp_import_index_of(kmp_import *im, int count, const char *(*name)(const void *list, int k),
                                     const void *list);

/** The first number of a name; -1: there is none. */
int kmp_import_index_find(const kmp_import_index *index, const char *name);
