/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels on rails in the model. For either rail of a track, and for a wheel on it, the lateral coordinate counts
 * outwards, away from the middle of the track. Left and right differ only by the sign. */
#pragma once

#include "base/arena.h"
#include "model/data/place.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

struct kmp_table;

enum { KMP_TRACK_SIDES = 2, KMP_WHEEL_ZONES = 8, KMP_CONTACT_SHOWN = 13, KMP_POSE_SHOWN = 5, KMP_WHEEL_PLACES = 800 };

typedef enum kmp_track_side { KMP_TRACK_LEFT, KMP_TRACK_RIGHT } kmp_track_side;

/** A cross-section: the height of a surface over its lateral coordinate, m, upwards and outwards. Of a wheel, both from
 * the point where the radius is the nominal one, the wheel standing: the flange has negative lateral coordinates and
 * heights. Of a rail, both from the middle of its top, the rail upright. */
typedef struct kmp_profile {
    const char *name;
    struct kmp_table *height; /* a cubic spline; NULL while something is wrong with it */
} kmp_profile;

/** Displacements of the rails from the ideal track, m, over the arc length. */
typedef enum kmp_irregularity {
    KMP_IRREGULARITY_ALIGNMENT, /* leftwards, of both rails */
    KMP_IRREGULARITY_LEVEL,     /* upwards, of both rails */
    KMP_IRREGULARITY_CROSS,     /* left rail above the right one */
    KMP_IRREGULARITY_GAUGE,     /* wider */
    KMP_IRREGULARITIES
} kmp_irregularity;

/** Irregularities from a spectral density (rail/model/read_tracks.c). */
typedef struct kmp_wave_spectrum {
    int kind; /* row of rail/model/spectra.def; -1: there is none */
    double seed, from, to, shortest, longest, scale;
} kmp_wave_spectrum;

typedef struct kmp_irregularities {
    const kmp_named_table *named[KMP_IRREGULARITIES]; /* of the model; NULL: none */
    kmp_wave_spectrum spectrum;
    struct kmp_table *made[KMP_IRREGULARITIES]; /* from the spectrum where no table is named; NULL: none */
} kmp_irregularities;

typedef enum kmp_course_kind {
    KMP_COURSE_STRAIGHT,
    KMP_COURSE_TRANSITION, /* curvature and cant change from the values of the piece before to the values of the piece
                              after it */
    KMP_COURSE_LEFT,
    KMP_COURSE_RIGHT,
    KMP_COURSE_KINDS
} kmp_course_kind;

typedef struct kmp_course_piece {
    kmp_course_kind kind;
    double length, radius, cant; /* m; of a curve: cant is the height of the outer rail above the inner one */
} kmp_course_piece;

/** A track. Its axes, x forwards, y left and z up, begin at a point of the ground and are the axes of the point; z = 0
 * is the plane on top of both rails. */
typedef struct kmp_track {
    const char *name;
    int point;
    const kmp_profile *profile; /* of the rails, upright */
    double gauge, gauge_depth, inclination;
    struct kmp_table *rail; /* height of an inclined rail over the lateral coordinate from the track's middle */
    double rail_at;         /* the lateral position of the profile's origin */
    bool curved;            /* otherwise it is straight, level, and the members below are NULL */
    kmp_course_piece *course;
    int course_count;
    struct kmp_table *x, *y; /* of the middle line over its arc length; its direction is their derivative */
    struct kmp_table *cant;  /* angle about that direction; NULL: none */
    double *candidate;       /* arc lengths, ascending: for any point near the track one of them is nearest, and the
                                projection is between its neighbours */
    int candidate_count;
    kmp_irregularities irregularities;
    double length; /* of the course; beyond it the track is straight */
} kmp_track;

typedef enum kmp_contact_form {
    KMP_CONTACT_RIGID,  /* a closure of one row, whose multiplier is the normal force */
    KMP_CONTACT_ELASTIC /* a normal force in each zone, from its penetration */
} kmp_contact_form;

typedef enum kmp_creep_law {
    KMP_CREEP_NONE,
    KMP_CREEP_LINEAR, /* Kalker's */
    KMP_CREEP_SHEN,   /* Shen, Hedrick and Elkins */
    KMP_CREEP_POLACH,
    KMP_CREEP_TANH, /* each component saturated separately (Jaschinski) */
    KMP_CREEP_LAWS
} kmp_creep_law;

/** A wheel on a rail. */
typedef struct kmp_wheel {
    const char *name;
    kmp_place place;
    int track; /* of the model's */
    kmp_track_side side;
    int point; /* its centre; y of the point's axes is the axle, leftwards; the body turns with the wheel */
    const kmp_profile *profile;
    kmp_number radius;
    double scale;  /* of the lengths in the search for contact: zones_scale (read_wheels.c) of the radius as read */
    double stands; /* neutral position on the track: the rail's slope equals the profile's slope at 0 */
    int zone_count;
    double zone[KMP_WHEEL_ZONES][2];      /* pieces of the profile that can touch the rail, one contact in each */
    bool zones_given;                     /* in the file; otherwise found */
    double node[KMP_WHEEL_PLACES];        /* on the profile, the nodes of an elastic wheel's averages */
    int nodes_end[KMP_WHEEL_ZONES];       /* of each zone */
    double least_spread[KMP_WHEEL_ZONES]; /* m, of the gap: the spread that the nodes resolve except at edges
                                             (rail/model/read_tracks.c) */
    kmp_contact_form form;
    int closure, force; /* of the model's; closure -1: elastic */
    kmp_creep_law law;
    double poisson;
    kmp_number shear_modulus, friction;
    kmp_number stiffness; /* N/m^1.5; with has_stiffness, otherwise from Hertz' theory */
    bool has_stiffness;
    kmp_number damping; /* s/m: N (1 + damping * rate of penetration) */
    kmp_number speed;   /* below it creepages are regularised, m/s */
} kmp_wheel;

/** The number of contacts of a wheel: one per zone if elastic, a single one if rigid. */
int kmp_wheel_contacts(const kmp_wheel *wheel);

/** Frees the tables owned by a profile; the named tables it refers to remain. */
void kmp_profile_free(kmp_profile *profile);
void kmp_track_free(kmp_track *track);

/** True if one of the tracks has irregularities. */
bool kmp_tracks_are_irregular(int count, const kmp_track *tracks);

/** The tracks without irregularities, with the parts of the given ones; NULL: no memory. */
kmp_track *kmp_tracks_ideal(int count, const kmp_track *tracks, kmp_arena *arena);

/** Wheel k of a model, and the number of wheels. */
const kmp_wheel *kmp_model_wheel(const kempe_model *model, int k);
int kmp_model_wheel_count(const kempe_model *model);

/** Track k of a model. */
const kmp_track *kmp_model_track(const kempe_model *model, int k);
