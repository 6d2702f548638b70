/* SPDX-License-Identifier: BSD-3-Clause */
/* Compliant contact: contacts with a law, and joints with clearance, which become such contacts. The members of
 * kmp_force of this kind are touch: its geometry, of the form gap; vector: the slip of an expression, up to three
 * components that are linear in the rates; of the form journal: two coordinates of the journal's centre in the bearing,
 * and its angular velocity there effort: the law over KMP_LOCAL_..; holding_effort: the coefficient of friction, NULL:
 * none */
#pragma once

#include "model/data/force.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

typedef enum kmp_compliant_form { KMP_COMPLIANT_GAP, KMP_COMPLIANT_JOURNAL } kmp_compliant_form;

/** Quantities of the contact in its law: places of KMP_EXPR_PLACE after x, y and z. */
enum {
    KMP_LOCAL_DEPTH = 3,
    KMP_LOCAL_RATE,
    KMP_LOCAL_IMPACT,
    KMP_LOCAL_SLIP,
    KMP_LOCAL_FILM_X,
    KMP_LOCAL_FILM_Y,
    KMP_LOCAL_FILM_U,
    KMP_LOCAL_FILM_V,
    KMP_LOCAL_END
};

/** The film between a journal and its bearing. */
typedef struct kmp_film {
    const char *law;
    const kmp_expr *force[2];            /* minus the force on the journal over `scale`, over KMP_LOCAL_FILM_.. */
    const kmp_expr *scale, *drag, *most; /* `drag`: torque over the spin at the centre; largest eccentricity over c */
} kmp_film;

struct kmp_compliant {
    kmp_compliant_form form;
    bool ball;       /* a journal that moves in space: its third coordinate is in the place of its angular velocity */
    const char *law; /* its word; NULL: by expression */
    int state;       /* that keeps the rate at the beginning of contact; -1: the law has none */
    const kmp_expr *clearance, *radius; /* of a journal: radial clearance, radius of the bearing */
    bool limited;          /* the law has no force beyond a depth of 0.95 times 4/e^2 clearances: johnson */
    const kmp_expr *store; /* its elastic energy, NULL: all is work */
    const kmp_film *film;  /* NULL: none */
    const kmp_expr *speed; /* of friction: below it the friction is viscous, NULL: by an expression of slip */
};

/** The radial clearance of a journal, m; NaN of any other element. */
double kmp_force_clearance(const kempe_model *model, const kmp_force *force);

/** The depth at a value of the condition that the bodies touch: of a journal with the clearance c that value is
 * (e^2 - c^2)/(2 c), of any other contact the depth. */
double kmp_compliant_depth(const kempe_model *model, const kmp_force *force, double value);
