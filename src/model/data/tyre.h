/* SPDX-License-Identifier: BSD-3-Clause */
/* Roads and tyres in the model. The axes of a contact are the axes W of ISO 8855 and TYDEX: x forwards in the plane of
 * the wheel, y to the left, z out of the road. */
#pragma once

#include "base/text.h"
#include "model/data/place.h"
#include "model/language/expression.h"
#include <stdbool.h>

/** A road: a plane through a point, or a height over it along one of its axes. */
typedef struct kmp_road {
    const char *name;
    kmp_place place;
    int point;              /* its axes are the axes of the road */
    int normal, along;      /* of these axes: out of the road; along which `height` changes */
    const kmp_expr *height; /* m, over x and t; NULL: flat */
    kmp_number friction;    /* factor of the friction of all its tyres */
} kmp_road;

typedef enum kmp_tyre_form {
    KMP_TYRE_BRUSH,
    KMP_TYRE_MF52, /* PAC2002 too */
    KMP_TYRE_MF61
} kmp_tyre_form;

/** Coefficients of the Magic Formula: rows of tir_keys.def. */
enum {
#define KMP_TIR(name, ...) KMP_TIR_##name,
#include "model/data/tir_keys.def"
#undef KMP_TIR
    KMP_TIR_COUNT
};

enum { KMP_TYRE_SHOWN = 6 }; /* values of an output contact(NAME) */

/** A tyre on a road. Its wheel turns about y of its point. */
typedef struct kmp_tyre {
    const char *name;
    kmp_place place;
    int road, point, force; /* of the model's */
    int state;              /* of the model's states: slips kappa' and tan(alpha'); -1: slips follow at once */
    kmp_tyre_form form;
    bool tangent;                 /* pure lateral force over tan(alpha) in place of alpha */
    bool along, across, combined; /* its forces: longitudinal, lateral, each less by the other slip */
    bool mirrored;                /* it was measured on the other side */
    bool has_longitudinal_relaxation, has_lateral_relaxation;
    kmp_number radius, vertical_stiffness, vertical_damping, friction, tread_stiffness, half_length, rolling_resistance,
        low_speed, longitudinal_relaxation, lateral_relaxation;
    const double *tir; /* KMP_TIR_COUNT, SI; NULL: brush */
    const char *file;  /* NULL: brush */
} kmp_tyre;

/** Prints the equations that a tyre by a file has, because implementations of the Magic Formula differ. */
void kmp_tyre_put_form(kmp_text *text, const kmp_tyre *tyre);

/** Prints the next line of the tyres by files, from tyre *next on, which it moves. Tyres with the same equations are in
 * one line. False: there are no more. */
bool kmp_tyres_put_forms(kmp_text *text, const kempe_model *model, int *next);
