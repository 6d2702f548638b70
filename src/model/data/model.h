/* SPDX-License-Identifier: BSD-3-Clause */
/* The model: the user's input, with every reference resolved and every number valued; frozen by the reader. Bodies form
 * a tree (a parent precedes its children), body 0 is the ground. */
#pragma once

#include "base/arena.h"
#include "base/cache/digest.h"
#include "model/data/bearing_pair.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/flexible.h"
#include "model/data/force.h"
#include "model/data/model_context.h"
#include "model/data/output.h"
#include "model/data/parameter.h"
#include "model/data/run_settings.h"
#include "model/data/shape.h"
#include "model/data/start.h"
#include "model/data/state.h"
#include "model/data/wheels.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdbool.h>

/* The names of a part of the model: KMP_NAMED(model, force). */
#define KMP_NAMED(model, part) KMP_NAMES((model)->part##s, (model)->part##_count)
#define KMP_COORDINATES(model) KMP_NAMES((model)->motions, kmp_model_coordinates(model))
#define KMP_BODY_NAMES(model)  KMP_NAMES((model)->bodies, (model)->body_count)

/* The files and texts that a model was read from. */
typedef struct kmp_model_source {
    const char *file;
    bool from_file;  /* `file` is its path */
    bool has_digest; /* all that was read to make it is known: */
    unsigned char digest[KMP_DIGEST_SIZE];
    const char *document; /* of a model in another format or built in code: in Kempe's language; otherwise NULL */
    const char **files;   /* the file itself, then settings and included files */
    int file_count;
    const char **paths; /* of all files that were read, each once, the first one the model's; with tables, meshes */
    int path_count;
    const char **notes; /* warnings of its reading that its results keep: parts of foreign files that are not used */
    int note_count;
    bool altered;                  /* some of them are mechanics that was left out by name */
    bool degrees;                  /* a number of its file is in deg */
    const kempe_setting *settings; /* with which it was read */
    int setting_count;
} kmp_model_source;

struct kempe_model {
    kempe_context *context;
    struct kmp_builder *builder; /* while it is built in code; NULL when frozen */
    struct kmp_variant
        *variant; /* that it belongs to, an instance of another model; NULL: it is not such an instance */
    kmp_arena arena;
    const char *name;
    kmp_model_source source;
    int symbol_count; /* of numbers */
    kmp_number gravity[3];
    bool pressed_plane; /* all rotations share one axis, translations are across it, and gravity or a force acts along
                           it */
    kmp_number closure_tolerance; /* m, where it is given */
    bool closure_tolerance_given;
    kmp_parameter *parameters;
    int parameter_count;
    int *led; /* dependent variable parameters, each after the parameters that it needs; of a variant
                 (model/data/variant.h) */
    int led_count;
    kmp_model_input *inputs;
    int input_count; /* with the states of delays, which are the last ones */
    int *constants;  /* of a variant, by inputs: 1 + the number of the parameter in its place, or 0; NULL: none */
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
    struct kmp_road *roads; /* (tyre.h) */
    int road_count;
    struct kmp_tyre *tyres;
    int tyre_count;
    kmp_body *bodies; /* bodies[0] is "ground" */
    int body_count;   /* ground included */
    kmp_flexible *flexibles;
    int flexible_count;
    kmp_point *points;
    int point_count;
    kmp_shape *shapes; /* shapes of a body are next to each other, but for shapes of grounds put on it */
    int shape_count;
    kmp_motion *motions;
    int motion_count; /* n: of joints, of flexible bodies, of states */
    kmp_state *states;
    int state_count;
    struct kmp_outline *outlines; /* (outline.h) */
    int outline_count;
    kmp_outline_contact *outline_contacts;
    int outline_contact_count;
    struct kmp_rope *ropes; /* (rope.h) */
    int rope_count;
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
    kmp_bearing_pair *bearings;
    int bearing_count;
    kmp_start start;
    kmp_run_settings run;
    kmp_output *outputs; /* when none are given: q, qd, qdd, lambda */
    int output_count;
};

/** The number of inputs that are given by a user. */
static inline int kmp_model_given_inputs(const kempe_model *model)
{
    return model->input_count - model->delay_count;
}

/** True if some friction of the model sticks. */
static inline bool kmp_model_sticks(const kempe_model *model)
{
    bool sticks = false;
    for (int k = 0; k < model->force_count; k++)
        sticks = sticks || kmp_force_sticks(&model->forces[k]);
    return sticks;
}

/** True if friction that sticks, or a rigid contact, may hold a part at rest. */
static inline bool kmp_model_rests(const kempe_model *model)
{
    bool rests = kmp_model_sticks(model);
    for (int k = 0; k < model->force_count; k++)
        rests = rests || model->forces[k].kind == KMP_FORCE_TOUCH;
    return rests;
}
