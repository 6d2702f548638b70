/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism for which modes of friction are decided, as functions that evaluate it. A status is 0, `failed` where
 * there is no solution, or another number that ends the decision. Generated simulators have this file too. */
#pragma once

#include <stdbool.h>

/* Linkage; static if one file contains all of a generated simulator. */
#ifndef KMP_LOCAL
#define KMP_LOCAL
#endif

/* Reasons of a decision that fails. */
typedef enum kmp_friction_failure {
    KMP_FRICTION_FORCED,     /* closures force surfaces into each other */
    KMP_FRICTION_UNDECIDED,  /* rounding prevents a decision */
    KMP_FRICTION_IMPOSSIBLE, /* elements can neither slip nor stick */
    KMP_FRICTION_ALTERNATES, /* modes change without an end */
    KMP_FRICTION_LOCKED,     /* an element moves in the direction in which it holds without a limit */
    KMP_FRICTION_JAMMED      /* closures turn an element into that direction, against any force */
} kmp_friction_failure;

/* Why elements can neither slip nor stick. */
typedef enum kmp_friction_cause {
    KMP_FRICTION_LEVELS,   /* levels depend on the friction itself, and do not settle */
    KMP_FRICTION_ROUNDED,  /* rounding prevents forces from being found */
    KMP_FRICTION_REVERSES, /* the friction of slip would reverse the slip that begins */
    KMP_FRICTION_LOADS     /* forces that depend on multipliers have no solution */
} kmp_friction_cause;

/* Facts of a decision for the log. */
typedef enum kmp_friction_fact {
    KMP_FRICTION_FACT_SEVERAL,        /* number: combinations of modes that are possible */
    KMP_FRICTION_FACT_GROWTH,         /* the level of an element grows so much with friction: number */
    KMP_FRICTION_FACT_CHANGE,         /* the mode of an element */
    KMP_FRICTION_FACT_LEFT,           /* an element is no longer regularised */
    KMP_FRICTION_FACT_SHARED,         /* contacts share loads; number: 1 if the motion depends on how, 0 if not */
    KMP_FRICTION_FACT_SHARED_IMPULSES /* contacts share impulses, and the rates depend on how */
} kmp_friction_fact;

/* Numbers of the motion. */
typedef struct kmp_friction_numbers {
    double span; /* of the run, s */
    double rtol;
    double still; /* a rate of friction that counts as none, in sizes of its place and rates of the motion */
} kmp_friction_numbers;

typedef struct kmp_friction_run kmp_friction_run;

typedef struct kmp_friction_site {
    void *self;
    int failed;
    kmp_friction_numbers (*numbers)(const void *self);
    /** 1/s: the rate of the motion at these rates. */
    double (*pace)(const void *self, const double *qd);
    /** Sets the input of a condition. */
    void (*put)(void *self, int condition, double input);
    /** Chooses rows and coordinates with the present inputs. */
    int (*choose)(void *self, double t, const double *q);
    /** True if closures with the present inputs have a row more than the chosen ones, by more than rounding. */
    int (*adds)(void *self, double t, const double *q, bool *adds);
    /** Accelerations and multipliers with the present inputs and rows, and the values of all conditions there. */
    int (*measure)(void *self, double t, const double *q, const double *qd, double *change);
    /** Prepares rows of J for `column`, after a measurement and with the present inputs. *known: false where the
     * inverse inertia does not belong to a linear system, as with forces that depend on multipliers. NULL: it never is
     * known.
     */
    void (*rows)(void *self, double t, const double *q, bool *known);
    /** The inverse inertia of rows of J with the chosen rows: the accelerations of all (count) by a force on row k. */
    int (*column)(void *self, int count, const int *row, int k, double *d);
    /** The values of all conditions at the multipliers before. */
    void (*look)(void *self, double t, const double *q, const double *qd, double *change);
    /** Makes rates consistent with the chosen rows, and evaluates accelerations and multipliers; and the values of all
     * conditions then, NULL: they are not wanted. */
    int (*finish)(void *self, double t, double *q, double *qd, double *change);
    /** After a failure: true where forces that depend on multipliers had no solution. */
    bool (*is_unsettled)(const void *self);
    /** Forgets a failure. */
    void (*forget)(void *self);
    /** Forgets multipliers of other states, from which the multipliers of the next one would begin. NULL: there are
     * none. */
    void (*forget_loads)(void *self);
    /** Returns `failed`, with a sentence. */
    int (*fail)(void *self, kmp_friction_failure failure, double t);
    /** Notes a fact of an element (-1: none). NULL: it is not read. */
    void (*report)(void *self, kmp_friction_fact fact, int element, double t, double number);
} kmp_friction_site;
