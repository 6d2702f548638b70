/* SPDX-License-Identifier: BSD-3-Clause */
/* The model: the user's input, with every reference resolved and every number valued; frozen by the reader. Bodies form
 * a tree (a parent precedes its children), body 0 is the ground. */
#pragma once

#include "base/arena.h"
#include "base/cache/digest.h"
#include "model/data/joint_table.h"
#include "model/data/run_settings.h"
#include "model/data/shape.h"
#include "model/data/signal.h"
#include "model/data/touch.h"
#include "model/data/wheels.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdbool.h>

typedef struct kmp_parameter {
    const char *name;
    kmp_number number;
    kmp_dimension dimension; /* of its value, as far as it is known */
    kmp_extent extent;
    bool fixed;      /* a value outside the equations depends on it */
    bool shapes;     /* and such a value is part of them: axes, tables, sections of the model */
    bool used;       /* something other than parameters depends on it */
    bool unused;     /* nothing of the model depends on it, and the user was warned */
    bool varies;     /* of a variant (model/data/variant.h): an input of its equations */
    int marked_next; /* while flags are set: the next one to be followed, from 1 */
} kmp_parameter;

/** A function of time that is given to a run: a constant, or samples. Expressions use it by its name. */
typedef struct kmp_model_input {
    const char *name;
    kmp_place place;
    const char *unit;        /* as written, "" without one */
    kmp_dimension dimension; /* of its values */
    double si;               /* a number in its unit, times this, is in SI */
    double value;            /* the default, in SI; a given constant takes its place */
    kmp_signal signal;       /* in SI; of a constant one sample */
    bool used;               /* some expression has it */
} kmp_model_input;

/** A variable with a differential equation of first order, y' = rate. It is the rate of a motion of its own, on which
 * no body and no closure depends and which moves a unit inertia: the equation of that motion is y' = rate. Its
 * coordinate, the integral of y, occurs nowhere. */
typedef struct kmp_state {
    const char *name;
    kmp_place place;
    kmp_number start;
    double scale;         /* size of its values */
    const kmp_expr *next; /* of a sampled state, whose rate is zero: its value from a sample on; NULL: it has a rate */
    double period;        /* s, between samples; the first is at t = 0; INFINITY: it has none */
    bool held;    /* of an averaged system (analyses/derivatives/averaged.h): changes at events alone, is constant */
    bool settles; /* changes at the start too, where its comparison holds there */
    int contact;  /* 1 + the force whose contact changes it where it begins; 0: none */
    const kmp_expr *delayed; /* of a delay: the signal that it is, by `delay` later; NULL: it is none */
    kmp_number delay;        /* s, positive */
    const kmp_expr *before;  /* the signal before the start, over t; NULL: constant */
    bool began;              /* `start` is that constant; otherwise it is the signal at the start */
    int signal;              /* of a delay: the input of its rate, which a run gives by the past of the signal */
} kmp_state;

/** A point fixed to a body, in the body's axes, from the body's origin. */
typedef struct kmp_point {
    const char *name; /* without the body's name */
    int body;
    kmp_number at[3];
    bool turned;       /* its axes are not those of the body */
    double axes[3][3]; /* v_body = axes v_point, when turned */
} kmp_point;

/** One elementary motion: a rotation about (or translation along) a unit axis, which is fixed in the axes reached by
 * the motions before it. Motion k of the model has coordinate q[k]. */
typedef struct kmp_motion {
    const char *name; /* of the coordinate: `joint`, `joint.1` ... when the joint has several, or one of its own */
    int number;       /* of the joint's coordinates, from 1: joint.k denotes it */
    int body;
    bool rotation;
    double axis[3];
} kmp_motion;

typedef struct kmp_body {
    const char *name;
    const char *joint; /* its joint's name */
    kmp_place place;
    int parent;         /* body */
    int at;             /* point of the parent where the joint's chain begins, -1: its origin */
    int to;             /* its own point where the chain ends, -1: its origin */
    bool turned;        /* with all coordinates zero the axes at `to` are not those at `at` */
    double frame[3][3]; /* then v_at = frame v_to, when turned; when reversed v_to = frame v_at */
    bool reversed; /* its joint's coordinates are those of the parent relative to the body: the chain has the inverse
                      motions, and a frame is at its end */
    bool loads_parent;              /* the second body of its joint, which the joint's reaction loads, is its parent */
    int first_motion, motion_count; /* its chain; no motion: it is welded to its parent */
    int load_count;   /* of its first motions: translations that are locked, for the reaction of its joint */
    int load_closure; /* the first one of their locks */
    const kmp_joint_row *coupling; /* its row if that couples the two motions by a number; NULL: it does not */
    kmp_number number;             /* of the coupling */
    kmp_number armature;           /* of a joint with one motion: a mass of this coordinate alone */
    kmp_number mass;
    kmp_number com[3];
    kmp_number inertia[6]; /* xx yy zz xy xz yz about the com, body axes; xy is the tensor's entry, -sum m x y */
    bool by_shape;         /* these three follow from its shapes */
    bool partial;          /* some moments are given, and others left out: */
    bool left_out[3];
} kmp_body;

/** True for a body without moments of inertia. */
static inline bool kmp_body_is_bare(const kmp_body *body)
{
    bool bare = true;
    for (int k = 0; k < 6; k++)
        bare = bare && body->inertia[k].value == 0;
    return bare;
}

/** Not a constant zero. */
static inline bool kmp_body_has_armature(const kmp_body *body)
{
    return body->armature.value != 0 || body->armature.expr;
}

/** A coordinate times a factor. */
typedef struct kmp_term {
    int motion;
    kmp_number factor;
} kmp_term;

/* The rows of closure_kinds.def: KMP_CLOSURE_ball, KMP_CLOSURE_drive, .. */
typedef enum kmp_closure_kind {
    KMP_CLOSURE_NONE,
#define KMP_CLOSURE(name, ...) KMP_CLOSURE_##name,
#define KMP_INNER_CLOSURE      KMP_CLOSURE
#include "model/data/closure_kinds.def"
#undef KMP_CLOSURE
    KMP_CLOSURE_KINDS
} kmp_closure_kind;

/** A loop closure, mostly between two points, or a drive. Members that a kind does not use stay zero. */
typedef struct kmp_closure {
    const char *name;
    kmp_closure_kind kind;
    kmp_place place;
    int point[2];                 /* -1 when it is not between points */
    double axis[2][3];            /* in the axes of either point */
    kmp_number number;            /* of its row of closure_numbers.def; at t = 0 when it is a function of time */
    int motion;                   /* of a drive; of a coupling the first one, which determines its unit; else -1 */
    const kmp_expr *function;     /* a drive's coordinate and its number over t (NULL when constant); a constraint */
    kmp_term *terms;              /* of a coupling */
    int term_count;               /* 0: it couples nothing */
    const kmp_number *constant;   /* of a coupling; NULL: its value at the start */
    const kmp_named_table *table; /* of a curve from a table */
    int wheel;                    /* of a wheel's contact; meaningless otherwise */
    int force;                    /* of the kinds friction and touch: the element; meaningless otherwise */
    const kmp_expr *curve[2];     /* of a curve: over x, y, z of the first point's axes */
    int curve_side[2];            /* 1: y equals it, 2: z does; 0: it is zero on the curve */
    int curve_count;              /* number of curve expressions: rows */
    int power;                    /* of a constraint, and of a curve: its unit is m^power */
} kmp_closure;

/** A joint between two bodies that became a closure of the same name, and the reason. */
typedef struct kmp_cut {
    const char *joint, *kind, *closure; /* its name, its kind, the kind of the closure */
    int rows;                           /* declared */
    const char *loop, *why;             /* the bodies of its loop; words */
    bool start_given;                   /* of one of its coordinates */
} kmp_cut;

/** A coordinate of a cut joint, which no equation has: a function of those of the tree. */
typedef struct kmp_cut_coordinate {
    const char *name, *joint; /* as kmp_motion has it */
    int number;               /* of the joint's coordinates, from 1 */
    bool rotation;
    const kmp_expr *value; /* KMP_EXPR_CUT */
    kmp_number q, qd;      /* of the start, where it gives them */
    bool q_given, qd_given;
} kmp_cut_coordinate;

/* The rows of force_kinds.def. */
typedef enum kmp_force_kind {
#define KMP_FORCE(kind, name, place, word, width) KMP_FORCE_##kind,
#define KMP_FIELD(...)
#include "model/data/force_kinds.def"
#undef KMP_FORCE
#undef KMP_FIELD
    KMP_FORCE_KINDS
} kmp_force_kind;

/** A force element; members that a kind does not use stay zero. */
typedef struct kmp_force {
    const char *name;
    kmp_force_kind kind;
    kmp_place place;
    int motion;                /* -1 when it acts on no joint */
    const kmp_expr *effort;    /* JOINT, LINE, TORSION: N m or N */
    const kmp_expr *vector[3]; /* POINT, BODY: ground axes; CYLINDER: two pressures */
    int point[2], body;
    const int *through; /* LINE: the points between its ends, through which it runs */
    int through_count;
    int axis; /* TORSION: of the first point, 0 to 2 */
    kmp_number stiffness, damping, free_length, rest, lower, upper, width, level, speed, bore, rod, mu, mu_static,
        radius;
    kmp_number along[3], along_damping[3], about[3], about_damping[3],
        preload[3]; /* BUSHING: axes of the first point */
    bool has_lower, has_upper;
    bool has_speed, has_static; /* FRICTION: regularised; a static level */
    bool has_regularise;        /* FRICTION that sticks: it is regularised where no modes or several are possible */
    kmp_number regularise;      /* its speed then */
    kmp_number holding;         /* FRICTION: the static level */
    const kmp_expr *sliding;    /* FRICTION without a coordinate: a length or an angle, against whose rate it acts */
    bool turns;                 /* an angle */
    const kmp_expr *holding_effort; /* as an expression, like `effort` for the level; NULL: a number */
    int closure;                    /* FRICTION that sticks, TOUCH: of its row */
    kmp_contact_pair touch;         /* TOUCH: what touches what */
    kmp_number restitution;         /* TOUCH */
    int contact; /* FRICTION: 1 + the contact whose surfaces rub, `level` being the coefficient; 0: none */
    int across;  /* of these: 1 or 2, along the first or the second axis of a plane on which the slip has both
                  * components,  whose forces follow each other; 0: the slip has one */
    int wheel;   /* of a wheel's contact; meaningless otherwise */
    const struct kmp_compliant *compliant; /* COMPLIANT: model/data/compliant.h */
    const kmp_expr *centred[3]; /* of a joint with clearance: lengths over the clearance that are zero where it is
                                 * centred; NULL: none further */
} kmp_force;

/** A goal of assembly, approached as far as the closures permit: a coordinate, or the position of a point. */
typedef struct kmp_goal {
    int motion, point; /* -1: not used */
    int width;         /* 1, or 3: x, y, z in ground axes */
    kmp_number value[3], weight[3];
} kmp_goal;

typedef struct kmp_start {
    kmp_number *q, *qd; /* n each, 0 where not given */
    bool *q_given, *qd_given;
    bool *hold;
    kmp_goal *goals;
    int goal_count;
} kmp_start;

/** A named expression of the state, for outputs. */
typedef struct kmp_sensor {
    const char *name;
    const kmp_expr *expr;
    kmp_place place;
} kmp_sensor;

/* The rows of output_kinds.def. */
typedef enum kmp_output_kind {
#define KMP_OUTPUT(kind, ...) KMP_OUTPUT_##kind,
#include "model/data/output_kinds.def"
#undef KMP_OUTPUT
    KMP_OUTPUT_KINDS
} kmp_output_kind;

/** `index`: of its point, loop, force, sensor, body or coordinate; -1 for all of them or none. */
typedef struct kmp_output {
    kmp_output_kind kind;
    int index;
    int about; /* 1 + the point about which an angular momentum is; 0: the centre of mass */
} kmp_output;

/* The rows of run_options.def that are keys, 0 or NULL where not given: double t_end, long max_steps, const char *form,
 * kmp_change_points change_points, int *independent and its independent_count, .. */
typedef struct kmp_run_settings {
#define KMP_SETTING_KEY(name, type)    KMP_RUN_TYPE_##type name;
#define KMP_SETTING_NAMES(name, type)  int *name, name##_count;
#define KMP_SETTING_CHOICE(name, type) kmp_##name name;
#define KMP_SETTING_NO(name, type)
#define KMP_RUN_OPTION(name, type, key, ...) KMP_SETTING_##key(name, type)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
#undef KMP_SETTING_KEY
#undef KMP_SETTING_NAMES
#undef KMP_SETTING_CHOICE
#undef KMP_SETTING_NO
    kmp_place every_place; /* of output_step */
    kmp_dynamics dynamics;
    const kmp_expr **until; /* comparisons: a run ends where one becomes true */
    int until_count;
    kmp_place until_place;
} kmp_run_settings;

/* The names of a part of the model: KMP_NAMED(model, force). */
#define KMP_NAMED(model, part) KMP_NAMES((model)->part##s, (model)->part##_count)
#define KMP_COORDINATES(model) KMP_NAMES((model)->motions, kmp_model_coordinates(model))
#define KMP_BODY_NAMES(model)  KMP_NAMES((model)->bodies, (model)->body_count)

struct kempe_model {
    kempe_context *context;
    struct kmp_builder *builder; /* while it is built in code; NULL when frozen */
    struct kmp_variant *variant; /* that it belongs to, an instance of another model; NULL: it is no such instance */
    kmp_arena arena;
    const char *file, *name;
    bool from_file;  /* `file` is its path */
    bool has_digest; /* all that was read to make it is known: */
    unsigned char digest[KMP_DIGEST_SIZE];
    const char *document; /* of a model in another format or built in code: in Kempe's language; otherwise NULL */
    const char **files;   /* the file itself, then settings and included files */
    int file_count;
    const char *
        *paths; /* of all files that were read, each once, the first one that of the model; with tables, meshes */
    int path_count;
    const char **notes; /* warnings of its reading that its results keep: parts of foreign files that are not used */
    int note_count;
    bool altered;                  /* some of them are mechanics that was left out by name */
    const kempe_setting *settings; /* with which it was read */
    int setting_count;
    int symbol_count; /* of numbers */
    kmp_number gravity[3];
    bool pressed_plane; /* all rotations share one axis, translations are across it, and gravity or a force acts along
                           it */
    kmp_number closure_tolerance; /* m, where it is given */
    bool closure_tolerance_given;
    kmp_parameter *parameters;
    int parameter_count;
    int *led; /* dependent variable parameters, each after those that it needs; of a variant (model/data/variant.h) */
    int led_count;
    kmp_model_input *inputs;
    int input_count; /* with those of delays, which are the last ones */
    int delay_count;
    kmp_named_table *tables;
    int table_count;
    kmp_unknowns *unknowns;
    int unknowns_count;
    kmp_profile *profiles;
    int profile_count;
    kmp_track *tracks;
    int track_count;
    kmp_wheel *wheels;
    int wheel_count;
    kmp_body *bodies; /* bodies[0] is "ground" */
    int body_count;   /* ground included */
    kmp_point *points;
    int point_count;
    kmp_shape *shapes; /* those of a body are next to each other, but for those of grounds put on it */
    int shape_count;
    kmp_motion *motions;
    int motion_count; /* n, with those of states, which are the last ones */
    kmp_state *states;
    int state_count;
    kmp_closure *closures;
    int closure_count;
    kmp_cut *cuts;
    int cut_count;
    kmp_cut_coordinate *cut_coordinates;
    int cut_coordinate_count;
    kmp_force *forces;
    int force_count;
    kmp_sensor *sensors;
    int sensor_count;
    kmp_start start;
    kmp_run_settings run;
    kmp_output *outputs; /* when none are given: q, qd, qdd, lambda */
    int output_count;
};

/** The nearest common ancestor of two bodies. Bodies follow their parents. */
static inline int kmp_model_common_body(const kempe_model *model, int a, int b)
{
    while (a != b)
        if (a > b)
            a = model->bodies[a].parent;
        else
            b = model->bodies[b].parent;
    return a;
}

/** The number of coordinates of bodies; the motions of states follow them. */
static inline int kmp_model_coordinates(const kempe_model *model)
{
    return model->motion_count - model->state_count;
}

/** The state whose motion it is; NULL: it is a motion of a body. */
static inline const kmp_state *kmp_state_of(const kempe_model *model, int k)
{
    int first = kmp_model_coordinates(model);
    return k >= first ? &model->states[k - first] : NULL;
}

/** The number of inputs that are given by a user. */
static inline int kmp_model_given_inputs(const kempe_model *model)
{
    return model->input_count - model->delay_count;
}

/** True if some state is sampled. */
static inline bool kmp_model_has_samples(const kempe_model *model)
{
    bool found = false;
    for (int k = 0; k < model->state_count; k++)
        found = found || model->states[k].next;
    return found;
}

/** The rate of state k. Rates are the last forces. */
static inline const kmp_expr *kmp_state_rate(const kempe_model *model, int k)
{
    return model->forces[model->force_count - model->state_count + k].effort;
}

/** True for friction that sticks. */
static inline bool kmp_force_sticks(const kmp_force *force)
{
    return force->kind == KMP_FORCE_FRICTION && !force->has_speed;
}

/** True if some friction of the model sticks. */
static inline bool kmp_model_sticks(const kempe_model *model)
{
    bool sticks = false;
    for (int k = 0; k < model->force_count; k++)
        sticks = sticks || kmp_force_sticks(&model->forces[k]);
    return sticks;
}

/** True for friction that sticks and for rigid contacts: elements with modes and a row, which runs decide on. */
static inline bool kmp_force_has_modes(const kmp_force *force)
{
    return kmp_force_sticks(force) || force->kind == KMP_FORCE_TOUCH;
}

/** KEMPE_E_ARGUMENT with its sentence when the model is still under construction. */
kempe_status kmp_model_check_finished(const kempe_model *model);
