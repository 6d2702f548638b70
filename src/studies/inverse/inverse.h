/* SPDX-License-Identifier: BSD-3-Clause */
/* What an inverse dynamics leaves: its rows, and what is to be said of all of them. */
#ifndef KMP_STUDIES_INVERSE_INVERSE_H
#define KMP_STUDIES_INVERSE_INVERSE_H

#include "output/convergence.h"
#include "studies/inverse/reactions.h"
#include <kempe/inverse.h>

typedef enum kmp_inverse_motion { KMP_INVERSE_DRIVES, KMP_INVERSE_TABLE, KMP_INVERSE_START } kmp_inverse_motion;

/** Of one actuator over all rows: the largest effort and power by size, with their signs; the root of the mean square
 * of the effort and the work, by the trapezoidal rule. */
typedef struct kmp_inverse_summary {
    double peak, peak_t, rms, power, power_t, work;
} kmp_inverse_summary;

struct kempe_inverse {
    const kempe_system *system;
    kempe_status status;
    char *reason;   /* "" when ok */
    char *warnings; /* of the computation, one a line */
    kmp_inverse_motion motion;
    char *source; /* the table's path; NULL: none */
    int n, m, loops, a;
    int *loop;      /* closures that are no drives */
    int *actuator;  /* a coordinates */
    double *weight; /* a */
    bool weighted;
    int rows, room;
    double *t;
    double *q, *qd, *qdd; /* rows x n */
    double *tau, *power;  /* rows x a */
    double *lambda;       /* rows x m */
    double *reaction;     /* rows x loops x KMP_REACTION */

    int freedoms, rank;  /* p and the least rank of its equations */
    int singular;        /* rows with more freedoms: the loops are singular there, and what follows is of the others */
    double singular_t;   /* the first of them */
    double hold, hold_t; /* the least singular value that counts, and when */
    double size;         /* of the reduced equations' terms, the largest of all rows, N m */
    double unmet, unmet_t;   /* what the actuators cannot bring about, the largest of all rows, in N m */
    int *left_u, left_count; /* then: by independent coordinate */
    double *left;
    double residual, residual_t;
    double off, off_t; /* of the table against the closures; coordinate -1: nothing to be off */
    int off_coordinate;
    bool *redundant;             /* m: rows that were dropped at some time */
    int *start_u, start_u_count; /* of the start: what is not accelerated */
    kmp_convergence again; /* with every other row of the table; not known where it has all rates and accelerations */
    double build_s, cpu_s;
};

/** Over all rows, of actuator k. */
kmp_inverse_summary kmp_inverse_summarise(const kempe_inverse *inverse, int k);

/** What of the motion the actuators cannot bring about, in parts of what it wants. */
double kmp_inverse_unmet(const kempe_inverse *inverse);

#endif
