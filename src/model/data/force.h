/* SPDX-License-Identifier: BSD-3-Clause */
/* Force elements, of every kind. */
#pragma once

#include "model/data/place.h"
#include "model/data/touch.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>

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
    const kmp_expr *effort;    /* JOINT, LINE, TORSION, ALONG: N m or N */
    const kmp_expr *vector[3]; /* POINT, BODY: ground axes; CYLINDER: two pressures */
    int point[2], body;
    const int *through; /* LINE: the points between its ends, through which it runs */
    int through_count;
    int axis; /* TORSION: of the first point, 0 to 2 */
    kmp_number stiffness, damping, free_length, rest, lower, upper, width, level, speed, bore, rod, mu, mu_static,
        radius, flank;
    kmp_number along[3], along_damping[3], about[3], about_damping[3],
        preload[3];                    /* BUSHING: axes of the first point */
    struct kmp_bushing_matrix *matrix; /* BUSHING: in place of the numbers but the preload; NULL: none */
    bool has_lower, has_upper;
    bool has_speed, has_static;     /* FRICTION: regularised; a static level */
    bool has_regularise;            /* FRICTION that sticks: it is regularised where no modes or several are possible */
    kmp_number regularise;          /* its speed then */
    kmp_number holding;             /* FRICTION: the static level */
    const kmp_expr *sliding;        /* ALONG, FRICTION without a coordinate: a length or an angle along which it acts */
    bool turns;                     /* an angle */
    const kmp_expr *holding_effort; /* as an expression, like `effort` for the level; NULL: a number */
    int closure;                    /* FRICTION that sticks, TOUCH: of its row */
    kmp_contact_pair touch;         /* TOUCH: what touches what */
    kmp_number restitution;         /* TOUCH */
    bool thread;                    /* FRICTION: of a screw; its levels follow the load of its coupling */
    double lead_angle, friction_angle; /* of it, rad; the second at rest, NaN unless it is constant */
    int contact; /* FRICTION: 1 + the contact whose surfaces rub, `level` being the coefficient; 0: none */
    int rubbing; /* TOUCH: 1 + the first friction of its surfaces; 0: none */
    int across;  /* of friction: 1 or 2, along the first or the second axis of a plane on which the slip has both
                  * components,  whose forces follow each other; 0: the slip has one */
    int wheel;   /* of a wheel's contact; meaningless otherwise */
    int tyre;    /* of a tyre's contact, likewise; vector[0]: the height of its road over x and t, or NULL */
    const struct kmp_compliant *compliant; /* COMPLIANT: model/data/compliant.h */
    const kmp_expr *centred[3]; /* of a joint with clearance: lengths over the clearance that are zero where it is
                                 * centred; NULL: none further */
} kmp_force;

/** True for friction that sticks. */
static inline bool kmp_force_sticks(const kmp_force *force)
{
    return force->kind == KMP_FORCE_FRICTION && !force->has_speed;
}

/** True for a level of friction without limit. */
static inline bool kmp_expr_is_unlimited(const kmp_expr *level)
{
    return level && level->kind == KMP_EXPR_NUMBER && isinf(level->value);
}

/** True for friction whose levels depend on the direction; and where its level is without limit: 1 against positive
 * rates, -1 against negative ones, 0 nowhere. */
static inline bool kmp_force_has_sides(const kmp_force *force)
{
    const kmp_expr *level = force->effort, *holding = force->holding_effort;
    return (level && level->kind == KMP_EXPR_SIDES) || (holding && holding->kind == KMP_EXPR_SIDES);
}

static inline int kmp_force_unlimited(const kmp_force *force)
{
    const kmp_expr *level = force->effort;
    const bool sides = level && level->kind == KMP_EXPR_SIDES;
    return sides ? kmp_expr_is_unlimited(level->a) - kmp_expr_is_unlimited(level->b) : 0;
}

/** True for friction that sticks and for rigid contacts: elements with modes and a row, which runs decide on. */
static inline bool kmp_force_has_modes(const kmp_force *force)
{
    return kmp_force_sticks(force) || force->kind == KMP_FORCE_TOUCH;
}

/** Force k of a model, and the number of forces. The last ones belong to states (model/data/state.h). */
const kmp_force *kmp_model_force(const kempe_model *model, int k);
int kmp_model_force_count(const kempe_model *model);
