/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of the study of limit cycles. */
#pragma once

#include "analyses/limit_cycles/cycle_branch.h"
#include "analyses/modes/locus.h"
#include "analyses/parts/study_print.h"
#include "model/data/force.h"
#include <kempe/limit_cycles.h>

struct kempe_limit_cycles {
    const kempe_system *system;
    kmp_arena arena; /* of cycles, names and sentences */
    kempe_status status;
    char *reason;   /* of KEMPE_STOPPED; NULL: none */
    char *warnings; /* one per line */
    char *name;     /* of the parameter */
    double from, to;
    int values;
    kmp_operating_family *family;
    kmp_locus locus; /* of the equilibria; empty from a start */
    int held;        /* coordinates that a load keeps at the rate of the start */
    int *held_motion;
    kempe_model *copy;    /* with their drives; NULL: it is the given one */
    kempe_system *driven; /* likewise */
    int outputs;          /* their names and SI units */
    char **output, **unit;
    double settle;  /* s: cycles are the ones that simulations of this length reach; 0: by Newton's method */
    kmp_flow *flow; /* NULL: no branch was followed by Newton's method */
    kmp_shooting shooting;
    int branches;
    kmp_cycle_branch *branch;
    int *branch_of; /* of each critical value, from 1 on; 0: none */
    double cpu_s;
};

/** The form in which results show values of the parameter. */
static inline kmp_shown kmp_limit_cycles_shown(const kempe_limit_cycles *c)
{
    return kmp_shown_of(c->system, c->name);
}

/** Half the range of output k of a cycle, NaN where it is not periodic; 0 of a Hopf point. */
static inline double kmp_cycle_amplitude(const kmp_cycle *cycle, int k)
{
    return (cycle->high[k] - cycle->low[k]) / 2;
}

/** The growth of the equilibrium at value k of the locus, and whether it is above rounding. */
double kmp_limit_cycles_growth(const kempe_limit_cycles *cycles, int k);

/** The equations of equilibria and cycles: they belong to the caller's system, or to the copy. */
static inline const kempe_system *kmp_cycles_equations(const kempe_limit_cycles *c)
{
    return c->driven ? c->driven : c->system;
}

/** "N" or "N m": the unit of load k. */
const char *kmp_cycles_load_unit(const kempe_limit_cycles *c, int k);
