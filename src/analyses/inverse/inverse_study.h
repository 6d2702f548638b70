/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of an inverse dynamics study: its rows, and their summary. */
#pragma once

#include "analyses/inverse/actuators.h"
#include "analyses/inverse/inverse_balance.h"
#include "analyses/inverse/prescribed_motion.h"
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

/** The loads of rows: of loops, then of joints of the tree. */
typedef struct kmp_inverse_loads {
    int loops, *loop;   /* closures that are not drives */
    int joints, *joint; /* bodies whose joints of the tree have a load */
} kmp_inverse_loads;

struct kempe_inverse {
    const kempe_system *system;
    kmp_arena arena; /* of all but warnings */
    kempe_status status;
    char *reason;   /* "" when ok */
    char *warnings; /* of the computation, one per line */
    const char *backend;
    kmp_inverse_motion motion;
    char *source; /* the table's path; NULL: none */
    kmp_actuators actuators;
    kmp_inverse_loads loads;
    int rows;
    double *t;
    int width;
    double *value; /* rows x width, with these parts at: */
    struct kmp_inverse_places {
        int tau, power;    /* actuators */
        int q, qd, qdd;    /* n */
        int lambda;        /* rows of loops */
        int force, moment; /* 3 a load */
    } at;

    kmp_inverse_balance balance;
    kmp_off_table off;           /* of the table from the closures */
    int *start_u, start_u_count; /* of the start: coordinates that are not accelerated */
    bool unchecked;              /* without the repeat, as requested */
    kmp_convergence again;  /* with every other row of the table; unknown where it has all rates and accelerations */
    bool least_norm;        /* shared loads */
    const char *not_unique; /* their names; "": none */
    kmp_reactions reactions;
    double build_s, cpu_s;
};

/** The number of loads; of one its name, and its place among the loads of all closures and joints. */
int kmp_inverse_load_count(const kempe_inverse *inverse);
const char *kmp_inverse_load_name(const kempe_inverse *inverse, int load);
int kmp_inverse_load_place(const kempe_inverse *inverse, int load);

/** A part of a row. */
static inline double *kmp_inverse_part(const kempe_inverse *inverse, int row, int at)
{
    return inverse->value + (ptrdiff_t)row * inverse->width + at;
}

/** Over all rows, of actuator k. */
kmp_inverse_summary kmp_inverse_summarise(const kempe_inverse *inverse, int k);
