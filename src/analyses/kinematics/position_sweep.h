/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of a sweep (analyses/kinematics/sweep.h): rows, dead centres, change points. */
#pragma once

#include "analyses/kinematics/sweep.h"
#include <kempe/kinematics.h>

enum { KMP_MOST_DEAD = 2 }; /* one at either end */

/** A limit of the driven coordinates, which no branch continues. */
typedef struct kmp_dead_centre {
    double s, value;   /* of the first driven coordinate */
    bool largest;      /* the value is a local maximum; false: a local minimum */
    double determined; /* pivot by which the driven coordinates determine the others, 0 in exact arithmetic */
    double margin;     /* distance from a change point: the last pivot of J over its usual size */
    char *instead;     /* alternative driving coordinates, the best first */
    double *q, *shown; /* n; width */
} kmp_dead_centre;

/** A change point that was crossed without changing direction. */
typedef struct kmp_change_point {
    double s, margin;
    double *q; /* n */
} kmp_change_point;

/** A column of outputs: the model's output, its component, its index among all computed values. */
typedef struct kmp_shown_column {
    int output, component, at;
    char *name;
} kmp_shown_column;

struct kempe_kinematics {
    const kempe_system *system;
    kmp_arena arena; /* of all but warnings and change points */
    kempe_status status;
    const char *backend;
    char *reason;   /* NULL: none */
    char *warnings; /* of the computation, one per line */
    int parameter_count, driven;
    kmp_sweep_parameter *parameter; /* driven coordinates, then fixed ones */
    int first;                      /* the first that moves */
    int time;                       /* the time's, -1 */
    double speed;                   /* of the first, NaN with the time */
    double rate;                    /* ds/dt */
    bool *released;                 /* closures of the model that were */
    bool statics, *moves;           /* deformations are in balance with their loads; n: which coordinates these are */
    int requested;                  /* rows */
    double *requested_s;
    int begin, count;         /* the first row that was reached, and the number of rows */
    double *s, *q, *qd, *qdd; /* `requested` rows; n each */
    int width;
    kmp_shown_column *column;            /* width */
    double *shown;                       /* width a row */
    kmp_dead_centre dead[KMP_MOST_DEAD]; /* in the order of s */
    int dead_count;
    kmp_change_point *change;
    int change_count;
    kmp_sweep_effort effort;
    double cpu_s;
};

/** "crank", or "t"; and its unit. */
const char *kmp_kinematics_name(const kempe_kinematics *k, const kmp_sweep_parameter *parameter);
const char *kmp_kinematics_unit(const kempe_kinematics *k, const kmp_sweep_parameter *parameter);
