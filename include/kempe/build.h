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
 * Adders keep copies of what they are given, in any order: a body may hang on one that comes later. They fail
 * with KEMPE_E_MEMORY, or KEMPE_E_ARGUMENT when a name is missing, stands already, or the model is finished.
 * Everything else is judged by kempe_model_finish, which says what the reader of model files would say, with
 * the thing's name in the place of file, line and column. Units are SI (kg, m, rad, s).
 */
#ifndef KEMPE_BUILD_H
#define KEMPE_BUILD_H

#include <kempe/kempe.h>

#ifdef __cplusplus
extern "C" {
#endif

/** A number, or an expression of the model's parameters that stands for one. */
typedef struct kempe_number {
    double value;
    const char *text; /* NULL: the value */
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

/** A body and the joint by which it hangs on its parent. */
typedef struct kempe_body_def {
    const char *name;
    const char *at;          /* "ground", "BODY" or "BODY.POINT": where the joint begins; NULL: the body hangs by joints
                                of kempe_model_add_joint, and what says how it hangs is not used */
    const char *joint;       /* the joint's name; NULL: the body's */
    const char *kind;        /* a named joint with `axis`: "revolute", "spherical", ...; see the model format */
    double axis[3];          /* in the parent's axes, of any length but 0 */
    const char *motions;     /* or, with kind NULL, motions in order: "T1 T2 -R3" */
    kempe_number mass;       /* kg */
    kempe_number com[3];     /* m, centre of mass in the body's axes */
    kempe_number inertia[6]; /* kg m^2 about it: xx yy zz xy xz yz (xy is the tensor's entry); 0 is left out */
} kempe_body_def;

/** A joint between two bodies, which may close a loop: Kempe chooses which of them are cut. */
typedef struct kempe_joint_def {
    const char *name;
    const char *kind;     /* "revolute", "spherical", ...; see the model format */
    const char *point[2]; /* "BODY.POINT": coordinates are those of the second body against the first */
    double axis[3];       /* in the axes of both points, of any length but 0 */
    kempe_number pitch;   /* m a turn, of a screw */
    int cut;              /* 1: it is a closure; -1: it is in the tree; 0: Kempe chooses */
} kempe_joint_def;

/** A loop closure between points "BODY.POINT" of two bodies. */
typedef struct kempe_closure_def {
    const char *name;
    const char *kind; /* "ball": the points coincide; "rod": they keep the distance `length`; ... */
    const char *point[2];
    kempe_number length; /* m */
} kempe_closure_def;

/** Either an effort on a coordinate (joint, and torque or force) or a spring between two points. */
typedef struct kempe_force_def {
    const char *name;
    const char *joint;                            /* coordinate on which the effort acts; NULL: a spring */
    const char *torque;                           /* N m, expression of parameters, t, q(JOINT), qd(JOINT) */
    const char *force;                            /* N, likewise, when the coordinate is a translation */
    const char *spring[2];                        /* the two points "BODY.POINT" */
    kempe_number stiffness, damping, free_length; /* N/m, N s/m, m */
} kempe_force_def;

/** Defaults: a body without mass on a revolute joint about z at the ground's origin, a revolute joint about z, a ball,
 *  no force. */
KEMPE_API kempe_body_def kempe_body_default(const char *name);
KEMPE_API kempe_joint_def kempe_joint_default(const char *name);
KEMPE_API kempe_closure_def kempe_closure_default(const char *name);
KEMPE_API kempe_force_def kempe_force_default(const char *name);

/** An empty model under construction, to be freed by kempe_model_free. The context must outlive it. */
KEMPE_API kempe_status kempe_model_new(kempe_context *context, const char *name, kempe_model **model);

/** m/s^2, in the ground's axes; none when not called. */
KEMPE_API kempe_status kempe_model_set_gravity(kempe_model *model, kempe_number x, kempe_number y, kempe_number z);

KEMPE_API kempe_status kempe_model_add_parameter(kempe_model *model, const char *name, kempe_number value);
KEMPE_API kempe_status kempe_model_add_body(kempe_model *model, const kempe_body_def *def);

/** A point of a body that is there already, or of "ground": m, in the body's axes. */
KEMPE_API kempe_status kempe_model_add_point(kempe_model *model, const char *body, const char *name, kempe_number x,
                                             kempe_number y, kempe_number z);
KEMPE_API kempe_status kempe_model_add_joint(kempe_model *model, const kempe_joint_def *def);
KEMPE_API kempe_status kempe_model_add_closure(kempe_model *model, const kempe_closure_def *def);
KEMPE_API kempe_status kempe_model_add_force(kempe_model *model, const kempe_force_def *def);

/** Whatever else the model language has (docs/model_format.md), as it would stand in a file: entry `name` of a section,
 *  kempe_model_add_text(model, "forces", "stop", "{stops: A, ...}"), or ("run", "t_end", "5"). KEMPE_E_INPUT: not YAML.
 */
KEMPE_API kempe_status kempe_model_add_text(kempe_model *model, const char *section, const char *name,
                                            const char *text);

/** The guess from which the model is assembled: rad or m; `hold` not 0 keeps the coordinate as it is given. */
KEMPE_API kempe_status kempe_model_set_q(kempe_model *model, const char *coordinate, kempe_number value, int hold);

/** Its rate at the start: rad/s or m/s. */
KEMPE_API kempe_status kempe_model_set_qd(kempe_model *model, const char *coordinate, kempe_number value);

/** Judges and freezes. KEMPE_E_INPUT: every mistake found, one sentence a line; the model is then still under
 *  construction: what was missing may be added and kempe_model_finish called again. */
KEMPE_API kempe_status kempe_model_finish(kempe_model *model);

#ifdef __cplusplus
}
#endif
#endif
