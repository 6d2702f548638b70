/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * A model built in code instead of read from a file:
 *
 *     kempe_model *model;
 *     kempe_model_new(context, "pendulum", &model);
 *     kempe_model_set_gravity(model, kempe_value(0), kempe_value(-9.81), kempe_value(0));
 *     kempe_model_add_parameter(model, "L", kempe_value(2));
 *     kempe_body_def arm = kempe_body_default("arm");
 *     arm.mass = kempe_value(3);
 *     arm.com[0] = kempe_expression("L/2");
 *     kempe_model_add_body(model, &arm);
 *     kempe_model_set_q(model, "arm", kempe_value(0.5), 0);
 *     if (kempe_model_finish(model) != KEMPE_OK) puts(kempe_context_message(context));
 *
 * Adders copy their arguments and may be called in any order: a body may be attached to one that is added later. They
 * fail with KEMPE_E_MEMORY, or KEMPE_E_ARGUMENT when a name is missing or already in use, or the model is finished.
 * kempe_model_finish checks everything else. Its messages are as in the model file reader, with the element's name
 * in place of file, line and column. Units are SI (kg, m, rad, s).
 */
#ifndef KEMPE_BUILD_H
#define KEMPE_BUILD_H

#include <kempe/kempe.h>

KEMPE_BEGIN

/** A number, or an expression of the model's parameters in its place. */
typedef struct kempe_number {
    double value;
    const char *text; /* NULL: the value is used */
} kempe_number;

static inline kempe_number kempe_value(double value)
{
    kempe_number number = {value, NULL};
    return number;
}

static inline kempe_number kempe_expression(const char *text)
{
    kempe_number number = {0, text};
    return number;
}

/** A body and the joint that attaches it to its parent. */
typedef struct kempe_body_def {
    const char *name;
    const char *at;          /* "ground", "BODY" or "BODY.POINT": attachment point of the joint; NULL: the body is
                              * attached by joints of kempe_model_add_joint, and the fields of
                              * its joint are ignored */
    const char *joint;       /* name of the joint; NULL: name of the body */
    const char *kind;        /* a named joint with `axis`: "revolute", "spherical", ...; see the model format */
    double axis[3];          /* in the parent's axes, of any length but 0 */
    const char *motions;     /* alternative with kind NULL: motions in order, "T1 T2 -R3" */
    kempe_number mass;       /* kg */
    kempe_number com[3];     /* m, centre of mass in the body's axes */
    kempe_number inertia[6]; /* kg m^2 about com: xx yy zz xy xz yz (xy is the tensor's entry); zeros are left out */
} kempe_body_def;

/** A joint between two bodies. It may close a loop: Kempe chooses the joints to cut. */
typedef struct kempe_joint_def {
    const char *name;
    const char *kind;     /* "revolute", "spherical", ...; see the model format */
    const char *point[2]; /* "BODY.POINT": coordinates of the second body relative to the first */
    double axis[3];       /* in the axes of both points, of any length but 0 */
    kempe_number pitch;   /* m per turn, of a screw */
    int cut;              /* 1: the joint is a closure; -1: it is in the tree; 0: Kempe chooses */
} kempe_joint_def;

/** A loop closure between points "BODY.POINT" of two bodies. */
typedef struct kempe_closure_def {
    const char *name;
    const char *kind; /* "ball": the points coincide; "rod": their distance is `length`; ... */
    const char *point[2];
    kempe_number length; /* m */
} kempe_closure_def;

/** Either a generalized force on a coordinate (joint, and torque or force) or a spring between two points. */
typedef struct kempe_force_def {
    const char *name;
    const char *joint;                            /* coordinate on which the generalized force acts; NULL: a spring */
    const char *torque;                           /* N m, expression of parameters, t, q(JOINT), qd(JOINT) */
    const char *force;                            /* N, an expression as for torque, when the coordinate is a
                                                   * translation */
    const char *spring[2];                        /* the two points "BODY.POINT" */
    kempe_number stiffness, damping, free_length; /* N/m, N s/m, m */
} kempe_force_def;

/** A shape of a body (docs/model/shapes.md): a picture; with a density or a mass it gives the body its mass, centre and
 * inertia, which the body then does not have as well. Members that are 0 or NULL are left out. */
typedef struct kempe_shape_def {
    const char *body;           /* or "ground" */
    const char *kind;           /* "box", "sphere", "ellipsoid", "cylinder", "capsule", "mesh" */
    kempe_number dimensions[3]; /* m: edges of a box; radii of an ellipsoid; else the first: radius of a sphere, length
                                   of a cylinder */
    const char *between[2];     /* in place of a length: points of the body at the centres of both ends */
    const char *file;           /* of a mesh, in the working folder unless it is a whole path */
    kempe_number scale;         /* m: the length that 1 means in it; 0: 1 m */
    kempe_number radius;        /* m, of a cylinder or capsule */
    const char *point;          /* of the body: the centre, and the axes; or */
    kempe_number at[3];         /* m: the centre, in the body's axes */
    double axis[3];             /* direction of a cylinder or capsule; 0: z */
    kempe_number density;       /* kg/m^3 */
    kempe_number mass;          /* kg, in place of the density */
    int hole;                   /* 1: its mass is taken away from the other shapes */
    const char *colour;         /* a name, or "#rrggbb" */
    double opacity;             /* more than 0, at most 1 */
    const char *text;           /* the shape as model file text, in place of all but the body; NULL: none */
} kempe_shape_def;

/** Default values. Body: no mass, a revolute joint about z at the ground's origin. Joint: revolute about z. Closure: a
 * ball. Force: none. Shape: a box. */
KEMPE_API kempe_body_def kempe_body_default(const char *name);
KEMPE_API kempe_joint_def kempe_joint_default(const char *name);
KEMPE_API kempe_closure_def kempe_closure_default(const char *name);
KEMPE_API kempe_force_def kempe_force_default(const char *name);
KEMPE_API kempe_shape_def kempe_shape_default(const char *body);

/** Makes an empty model under construction; kempe_model_free frees it. The context must outlive it. */
KEMPE_API kempe_status kempe_model_new(kempe_context *context, const char *name, kempe_model **model);

/** Gravity in m/s^2, in the ground's axes. Without a call there is none. */
KEMPE_API kempe_status kempe_model_set_gravity(kempe_model *model, kempe_number x, kempe_number y, kempe_number z);

KEMPE_API kempe_status kempe_model_add_parameter(kempe_model *model, const char *name, kempe_number value);
KEMPE_API kempe_status kempe_model_add_body(kempe_model *model, const kempe_body_def *def);

/** Adds a point to a body that exists already, or to "ground": m, in the body's axes. */
KEMPE_API kempe_status kempe_model_add_point(kempe_model *model, const char *body, const char *name, kempe_number x,
                                             kempe_number y, kempe_number z);
KEMPE_API kempe_status kempe_model_add_joint(kempe_model *model, const kempe_joint_def *def);
KEMPE_API kempe_status kempe_model_add_closure(kempe_model *model, const kempe_closure_def *def);
KEMPE_API kempe_status kempe_model_add_force(kempe_model *model, const kempe_force_def *def);

/** Adds a shape to a body that exists already, or to "ground"; a body may have several. */
KEMPE_API kempe_status kempe_model_add_shape(kempe_model *model, const kempe_shape_def *def);

/** Adds any other entry of the model language (docs/model/README.md) as model file text: entry `name` of a section,
 * kempe_model_add_text(model, "forces", "stop", "{stops: A, ...}"), or ("run", "t_end", "5"). KEMPE_E_INPUT: the text
 * is not YAML. */
KEMPE_API kempe_status kempe_model_add_text(kempe_model *model, const char *section, const char *name,
                                            const char *text);

/** Sets the guess of a coordinate for the assembly: rad or m. If `hold` is not 0, the coordinate keeps this value. */
KEMPE_API kempe_status kempe_model_set_q(kempe_model *model, const char *coordinate, kempe_number value, int hold);

/** Sets the rate of a coordinate at the start: rad/s or m/s. */
KEMPE_API kempe_status kempe_model_set_qd(kempe_model *model, const char *coordinate, kempe_number value);

/** Checks and freezes the model. KEMPE_E_INPUT: the message has every error, one sentence per line. The model is then
 * still under construction: missing elements may be added and kempe_model_finish called again. */
KEMPE_API kempe_status kempe_model_finish(kempe_model *model);

KEMPE_END
#endif
