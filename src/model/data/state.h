/* SPDX-License-Identifier: BSD-3-Clause */
/* States: variables with differential equations of first order. */
#pragma once

#include "model/data/place.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** A variable with a differential equation of first order, y' = rate. It is the rate of an additional motion, on which
 * no body and no closure depends and which moves a unit inertia: the equation of that motion is y' = rate. Its
 * coordinate, the integral of y, occurs nowhere. */
typedef struct kmp_state {
    const char *name;
    kmp_place place;
    kmp_number start;
    double scale;         /* size of its values */
    const kmp_expr *next; /* of a sampled state, whose rate is zero: its value from a sample on; NULL: it has a rate */
    double period;        /* s, between samples; the first is at t = 0; INFINITY: it has none */
    bool held;    /* of an averaged system (analyses/derivatives/averaged.h): changes only at events, is constant */
    bool settles; /* changes at the start too, where its comparison holds there */
    int contact;  /* 1 + the force whose contact changes it where it begins; 0: none */
    const kmp_expr *delayed; /* of a delay: the signal that it is, by `delay` later; NULL: it is none */
    kmp_number delay;        /* s, positive */
    const kmp_expr *before;  /* the signal before the start, over t; NULL: constant */
    bool began;              /* `start` is that constant; otherwise it is the signal at the start */
    int signal;              /* of a delay: the input of its rate, which a run gives by the past of the signal */
} kmp_state;

/** The number of coordinates of bodies; the motions of states follow them. */
int kmp_model_coordinates(const kempe_model *model);

/** The state whose motion it is; NULL: it is a motion of a body. */
const kmp_state *kmp_state_of(const kempe_model *model, int k);

/** True if some state is sampled. */
bool kmp_model_has_samples(const kempe_model *model);

/** The rate of state k. Rates are the last forces. */
const kmp_expr *kmp_state_rate(const kempe_model *model, int k);

/** State k of a model, and the number of states. */
const kmp_state *kmp_model_state(const kempe_model *model, int k);
int kmp_model_state_count(const kempe_model *model);
