/* SPDX-License-Identifier: BSD-3-Clause */
/* The derived system: equations of motion of a model, their programs, and the scales that every numeric decision uses.
 */
#ifndef KMP_DYNAMICS_SYSTEM_H
#define KMP_DYNAMICS_SYSTEM_H

#include "dynamics/equations.h"
#include "symbolic/program/program.h"
#include <stdatomic.h>

/** Where the non-zeros of a matrix stand. */
typedef struct kmp_pattern {
    int count;
    int *row, *col;
} kmp_pattern;

/** Collects the non-zero references of a rows x cols matrix (row-major); `values` receives them, count of them.
 *  false: no memory. */
bool kmp_pattern_init(kmp_pattern *pattern, int rows, int cols, const kmp_ref *matrix, kmp_ref *values);
void kmp_pattern_free(kmp_pattern *pattern);

/** What closures that are redundant but for rounding may stay open by where the model does not say, as part of the
 * characteristic length: four hundred lamps and as many linkages in space, to four digits, are open by up to 5.2e-4 of
 * it (bench/rounded digits). */
#define KMP_CLOSURE_TOLERANCE 6e-4

/** What the first assembly found of closures that are redundant but for rounding of the model's numbers
 * (constraints/rounding/rounding.h). Written once. */
typedef struct kmp_rounding {
    atomic_int state; /* 0: nothing is known or there is none, 1: being written, 2: there */
    int rank;         /* of J, however many of its pivots differ from zero */
    double zero;      /* a pivot of the scaled J below this part of the first is one */
    double tolerance; /* scaled |h| that a row may stay open by */
    double misfit;    /* and is open by at most, at the start and on ways from there */
} kmp_rounding;

/* Stages of the motion programs; below: what stands there by articulated bodies. */
enum {
    KMP_STAGE_PARAMETERS, /* once */
    KMP_STAGE_CLOSURE,    /* t, q: h (m), J (jacobian.count), h_t (m, only when rheonomic); likewise */
    KMP_STAGE_MASS,       /* t, q: M, lower triangle (mass.count);
                             M^-1 J' (compliance.count), J M^-1 J', lower triangle (mobility.count) */
    KMP_STAGE_BIAS,       /* qd: C (n), jdqd (m);
                             qd, efforts: accelerations without closure forces (n), J of them and jdqd (m) */
    KMP_STAGE_PRESSING,   /* where C depends on lambda, instead of that: jdqd (m) and what is not told, before;
                             qd, lambda: C (n), dC/dlambda (pressing.count), here */
    KMP_STAGE_WORKING     /* where forces are not conservative: their power, at what C or the accelerations are of */
};

/* Stages of the judging program. */
enum {
    KMP_STAGE_POTENTIAL = 1, /* t, q: potential energy */
    KMP_STAGE_POWER,         /* qd: power of the non-conservative forces */
    KMP_STAGE_REACTION,      /* q, lambda: 3 a closure */
    KMP_STAGE_POSITION,      /* q: 3 a position output */
    KMP_STAGE_SHOWN          /* all: what outputs show beside the table (model/output_table.h) */
};

struct kempe_system {
    const kempe_model *model;
    kempe_context *context;
    int n, m;
    kmp_row *rows;
    char **row_names;
    kmp_pattern jacobian, mass;
    kmp_pattern pressing;             /* coordinate and row: dC/dlambda */
    kmp_pattern compliance, mobility; /* row of J and coordinate; rows of J. Of `articulated` */
    bool rheonomic;                   /* h depends on t */
    bool switches;                    /* h depends on conditions: J may jump where they change, and rates with it */
    bool dissipative;      /* some force is not conservative, or a closure that moves or switches does work */
    bool has_power;        /* so it is without the user's force */
    kmp_dynamics dynamics; /* as asked for */
    kmp_program *motion, *judge;
    kmp_program *articulated; /* motion by articulated bodies; NULL: runs take M and C */
    kmp_events events;        /* conditions: inputs KMP_IN_MODE of all programs */
    kmp_program *changes;     /* stage 1: first - second of each condition at (t, q, qd), zero of late ones; stage 2:
                               * those, at qdd and lambda too; NULL without conditions. Each stage then has what of the
                               * conditions implicit blocks solve for */
    kmp_program *goals;       /* of points that goals are about (dynamics/goals.h); NULL without them */
    bool changes_by_rates;    /* they depend on qd, or on more */
    char **event_text;        /* events.count: "'motor': q(A) < 0.2" */
    int chart_count;          /* joints with inputs KMP_IN_CHART, nine each */
    int *chart_first;         /* their first rotations */
    bool *chart_before;       /* the chart stands before them, otherwise after */
    double length;            /* characteristic length, m */
    double reach;             /* how far from the origin a closed point may lie, m: h rounds with it */
    int *pressed;             /* rows whose multipliers forces depend on, rising: C is a function of those too */
    int pressed_count;        /* 0: M qdd + C = J' lambda is linear in lambda */
    double *scale;            /* n: size of a coordinate: 1 for a rotation, `length` for a translation */
    double *row_scale;        /* m: size of a closure row */
    double *parameters;       /* values */
    double closure_tolerance; /* m: what closures that are redundant may stay open by; 0: nothing */
    kmp_rounding *rounding;
    bool strict; /* rounding of the model's numbers does not explain what redundant closures are open by */
    bool mended; /* points and axes of `model` are those that a rounded drawing means (constraints/rounding/mend.h) */
    struct kmp_variant *own; /* that has it, where it is the system's own; NULL: somebody else's */
    double *misfit;          /* by closures: what they would stay open by as drawn, scaled; 0: nothing */
    double mended_by;        /* and the farthest that a number was moved, characteristic lengths or rad */
    double build_s;          /* CPU time of deriving */
    kempe_force_fn *force;   /* the user's efforts; NULL: none */
    void *force_user;
};

/** kempe_system_new_with_algorithm without a look at rounded numbers. */
kempe_status kmp_system_new_by(const kempe_model *model, const char *word, kempe_system **system);

/** Closures alone, without masses and forces: for assembling, and for walking on closed configurations. */
kempe_status kmp_system_of_closures(const kempe_model *model, kempe_system **system);

/** A length of a mechanism: |to - from|. */
typedef struct kmp_lever {
    kmp_number to[3], from[3];
    double length;
} kmp_lever;

/** The characteristic length, m, and what closures may stay open by, m. */
double kmp_system_length(const kempe_model *model);
double kmp_closure_tolerance(const kempe_model *model);

/** The one that is the characteristic length: the largest of the offsets of joints and closure points in their bodies
 * and lengths of rods, else of start values of translations, else of centres of mass. Its length is 0 where nothing has
 * any: then it is 1 m. */
kmp_lever kmp_system_lever(const kempe_model *model);

/** Scales and values of parameters anew, from a model whose numbers have changed (model/variant.h). false: no memory.
 */
bool kmp_system_rescale(kempe_system *system);

/** The efforts (n) of the user's force, which is there, at (t, q, qd); NaN where it says that they cannot be had. */
void kmp_system_effort(const kempe_system *system, double t, const double *q, const double *qd, double *effort);

#endif
