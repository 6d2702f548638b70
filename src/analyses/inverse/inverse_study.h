/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of an inverse dynamics study: its rows, and their summary. */
#pragma once

#include "constraints/evaluation/evaluation_point.h"
#include "model/data/force.h"
#include "output/convergence.h"
#include "output/reactions.h"
#include <kempe/inverse.h>

typedef enum kmp_inverse_motion { KMP_INVERSE_DRIVES, KMP_INVERSE_TABLE, KMP_INVERSE_START } kmp_inverse_motion;

/** Summary of one actuator over all rows: the largest generalized force and power by modulus, with their signs; the
 * root mean square of the force and the work, by the trapezoidal rule. */
typedef struct kmp_inverse_summary {
    double peak, peak_t, rms, power, power_t, work;
} kmp_inverse_summary;

struct kempe_inverse {
    const kempe_system *system;
    kmp_arena arena; /* of all but warnings */
    kempe_status status;
    char *reason;   /* "" when ok */
    char *warnings; /* of the computation, one per line */
    const char *backend;
    kmp_inverse_motion motion;
    char *source; /* the table's path; NULL: none */
    int n, m, loops, a;
    int *loop;          /* closures that are not drives */
    int joints, *joint; /* bodies whose joints of the tree have a load; loads of loops, then of these */
    int *actuator;      /* a coordinates */
    double *weight;     /* a */
    bool weighted;
    int rows;
    double *t;
    int width;
    double *value; /* rows x width, with these parts at: */
    struct kmp_inverse_places {
        int tau, power;    /* a */
        int q, qd, qdd;    /* n */
        int lambda;        /* rows of loops */
        int force, moment; /* 3 a load */
    } at;

    int freedoms, rank; /* p and the least rank of its equations */
    int singular; /* rows with additional degrees of freedom: the loops are singular there, and the summary is of the
                     others */
    double singular_t;       /* the first of them */
    double hold, hold_t;     /* the least singular value that counts, and when */
    double size;             /* of the reduced equations' terms, the largest of all rows, N m */
    double unmet, unmet_t;   /* forces that the actuators cannot provide, the largest of all rows, in N m */
    int *left_u, left_count; /* then: by independent coordinate */
    double *left;
    double residual, residual_t;
    double off, off_t; /* of the table from the closures; coordinate -1: no difference is possible */
    int off_coordinate;
    bool *redundant;             /* m: rows that were dropped at some time */
    int *start_u, start_u_count; /* of the start: coordinates that are not accelerated */
    bool unchecked;              /* without the repeat, as requested */
    kmp_convergence again;  /* with every other row of the table; unknown where it has all rates and accelerations */
    bool least_norm;        /* shared loads */
    const char *not_unique; /* their names; "": none */
    kmp_reactions reactions;
    double build_s, cpu_s;
};

/** The name of a loop or a joint by the number of its load. */
const char *kmp_inverse_load_name(const kempe_inverse *r, int load);

/** A part of a row. */
static inline double *kmp_inverse_part(const kempe_inverse *inverse, int row, int at)
{
    return inverse->value + (ptrdiff_t)row * inverse->width + at;
}

/** Over all rows, of actuator k. */
kmp_inverse_summary kmp_inverse_summarise(const kempe_inverse *inverse, int k);

/** The unbalanced part of the motion, relative to the required generalized forces. */
double kmp_inverse_unmet(const kempe_inverse *inverse);
