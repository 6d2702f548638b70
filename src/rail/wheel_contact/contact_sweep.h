/* SPDX-License-Identifier: BSD-3-Clause */
/* A table of contacts (kempe/vehicle.h): its values, and the states and patches at each. */
#pragma once

#include "analyses/equilibrium/operating.h"
#include "analyses/parts/ranges.h"
#include "model/data/variant.h"
#include "model/data/wheels.h"
#include <kempe/rolling_contact.h>
#include <kempe/vehicle.h>

/** A range of `over`: a parameter of the variant, or a coordinate with fixed value. */
typedef struct kmp_swept_parameter {
    int parameter, hold; /* one of them is -1 */
} kmp_swept_parameter;

/** The equivalent conicity of a pair of wheels at one amplitude; NaN: unknown. */
typedef struct kmp_conicity {
    double amplitude, conicity;
    double error;      /* the difference from the conicity of every second row, with the same points between rows */
    double wavelength; /* of the kinematic motion */
    double low, high;  /* its ends */
} kmp_conicity;

/** The displacement of the pair to the left, and the difference of its rolling radii there; NaN: one wheel does not
 * touch. */
typedef struct kmp_displaced {
    double aside, difference;
} kmp_displaced;

/** The places between two rows where the contact jumps or the difference is not linear, in the order of the rows. */
enum { KMP_BETWEEN_MOST = 64 };
typedef struct kmp_conicity_points {
    int count;
    kmp_displaced *at; /* KMP_BETWEEN_MOST; NULL: none is needed */
    bool cut;          /* more of them would be needed */
} kmp_conicity_points;

/** The conicities of all amplitudes, and the difference of the rolling radii that they follow from. */
typedef struct kmp_conicities {
    int count; /* 0: not requested */
    kmp_conicity *at;
    int wheel[2];                 /* left, right */
    kmp_displaced *row;           /* of each row */
    kmp_conicity_points *between; /* between each row and the next */
    int points;                   /* of rows in which both wheels touch, and between them, by ascending displacement */
    double *y, *difference;
    double base, radius; /* the distance of the contacts in the middle, and the mean radius */
    double nonlinearity;
} kmp_conicities;

/** A strip of a patch, along the direction of rolling. */
typedef struct kmp_outline_strip {
    int lobe;        /* from 1 */
    double y;        /* lateral place on the track, outwards */
    double from, to; /* its ends, forwards from the wheel's centre */
    double pressure; /* largest in it */
} kmp_outline_strip;

typedef struct kmp_patch_outline {
    int count;
    kmp_outline_strip *strip;
} kmp_patch_outline;

typedef enum kmp_pressure_method {
    KMP_PRESSURE_NONE,
    KMP_PRESSURE_KP,
    KMP_PRESSURE_ANALYN,
    KMP_PRESSURE_HALF_SPACE
} kmp_pressure_method;

struct kempe_contacts {
    kmp_arena arena; /* of all arrays */
    const kempe_system *given;
    kmp_variant *variant; /* the varied parameters, and the outputs of wheels */
    kempe_system *system; /* of the variant */
    kempe_status status;
    char *reason;   /* NULL: none */
    char *warnings; /* of the computation, one per line */
    const char *backend;
    kmp_ranges over;
    kmp_swept_parameter *swept;
    int parameter_count;
    kmp_steady *hold; /* coordinates with swept or steady values */
    int hold_count;
    bool has_law;
    bool rolls; /* the second law is the solution on the grid of the pressures */
    kempe_creep_law law;
    int requested, count;
    double *value; /* of the first range */
    double *q, *qd;
    double residual; /* the largest, relative */
    int iterations;
    int wheel_count;
    int *first; /* wheel_count + 1: patches of a value, before each wheel's */
    kempe_contact_patch *patch;
    kmp_pressure_method pressure;
    int finer;                             /* rectangles of the grid are divided by this number in both directions */
    kmp_patch_outline *outline;            /* of each patch; NULL: not requested */
    int unknown_pressures, unknown_forces; /* patches without, numbers of the table */
    kmp_conicities conicities;
    double cpu_s;
};

/** The word of the second law; NULL: there is none. */
const char *kmp_contact_law_word(const kempe_contacts *table);
