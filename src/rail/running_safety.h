/* SPDX-License-Identifier: BSD-3-Clause */
/* Running safety of a run whose model has wheels on rails: Y/Q against Nadal's limit, wheel unloading, the sum of the
 * lateral forces of a wheelset against Prud'homme's limit (EN 14363). */
#pragma once

#include "integrators/run/recording.h"
#include "studies/simulate/trajectory.h"
#include <stdbool.h>

/** A value with its time, s. NaN: unknown. */
typedef struct kmp_safety_value {
    double value, t;
} kmp_safety_value;

typedef struct kmp_safety_wheel {
    double load;          /* Q0, N */
    double flange, nadal; /* the steepest slope of the flange, rad; NaN: Nadal's formula gives no limit */
    kmp_safety_value unloading, smooth_unloading; /* the largest (Q0 - Q)/Q0; of filtered loads */
    kmp_safety_value ratio;                       /* the largest Y/Q under a load */
    kmp_safety_value mean; /* the largest mean of Y/Q of filtered forces over KMP_SAFETY_LENGTH of way */
    double wear;           /* the mean of the wear number T gamma over the way, N */
    kmp_safety_value most_wear;
} kmp_safety_wheel;

/** Wheels opposite each other: a wheelset, or two independent wheels. */
typedef struct kmp_safety_axle {
    int left, right;       /* wheels of the model */
    double limit;          /* Prud'homme's: 10 kN and a third of the static axle load; NaN: unknown */
    kmp_safety_value mean; /* the largest |sum of Y| of filtered forces, as a mean over that way, N */
} kmp_safety_axle;

typedef struct kmp_running_safety {
    bool too_long; /* the run has more dense output than is kept: nothing is judged */
    int wheels, axles, samples;
    double way;        /* of the wheel that came farthest, m */
    bool resumed;      /* the run continues from a checkpoint: the samples are of its part */
    bool at_rest;      /* Q0 is taken from the equilibrium; otherwise from the start of the run */
    bool loaded;       /* Q0 is known */
    double carried;    /* sum of Q0 over the weight of the model; NaN: no gravity */
    double difference; /* the largest relative change of the values with every other sample */
    kmp_safety_wheel *wheel;
    kmp_safety_axle *axle;
    /* Samples; of wheel w, or of axle w, number k is at w * samples + k: */
    double *t, *load, *across, *wear; /* time; Q, Y and T gamma */
    double *mean, *sum;    /* means over the way of Y/Q and of the sum of Y, filtered; NaN where it is too short */
    double *along, *aside; /* place of the wheel's centre on the track: arc length, and m to the left in its plane */
} kmp_running_safety;

/** The way over which forces are averaged, m (EN 14363). */
#define KMP_SAFETY_LENGTH 2.0
/** Cutoff frequency of forces, Hz (EN 14363). */
#define KMP_SAFETY_CUTOFF 20.0

/** The state that Q0 is from, in words. */
const char *kmp_safety_loads_from(const kmp_running_safety *safety);

/** The judge of runs of vehicles. */
extern const kmp_run_judge kmp_safety_judge;
