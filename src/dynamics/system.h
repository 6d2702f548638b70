/* SPDX-License-Identifier: BSD-3-Clause */
/* The derived system: equations of motion of a model, their programs, and the scales that every numeric decision uses.
 */
#pragma once

#include "base/cache/digest.h"
#include "base/context.h"
#include "dynamics/closure_row.h"
#include "dynamics/kinematics/model_conditions.h"
#include "dynamics/variants.h"
#include "model/data/run_settings.h"
#include "symbolic/program.h"
#include <kempe/extend.h>
#include <pthread.h>
#include <stdatomic.h>

/** The positions of a matrix's non-zeros. */
typedef struct kmp_pattern {
    int count;
    int *row, *col;
} kmp_pattern;

/** Collects the non-zero references of a rows x cols matrix (row-major); `values` receives them, count of them. None
 * where the arena has failed. */
void kmp_pattern_init(kmp_pattern *pattern, kmp_arena *arena, int rows, int cols, const kmp_ref *matrix,
                      kmp_ref *values);

/* States of kmp_rounding. */
enum {
    KMP_ROUNDING_UNKNOWN, /* no assembly at the start has looked yet */
    KMP_ROUNDING_WRITING,
    KMP_ROUNDING_PRESENT,
    KMP_ROUNDING_NONE /* the assembly at the start has found none */
};

/** Closures found by the first assembly to be redundant up to rounding of the model's numbers
 * (constraints/closing/rounding.h). Written once. */
typedef struct kmp_rounding {
    atomic_int state; /* the other members count when it is KMP_ROUNDING_PRESENT */
    int rank;         /* of J, independent of the number of its nonzero pivots */
    double zero;      /* a pivot of the scaled J below this part of the first is one */
    double tolerance; /* scaled |h| that a row may stay open by */
    double misfit;    /* the largest remaining error, at the start and on paths from there */
} kmp_rounding;

/* Stages of the motion programs; on the second line the outputs by articulated bodies. */
enum {
    KMP_STAGE_PARAMETERS, /* once */
    KMP_STAGE_CLOSURE, /* t, q: h (m), J (jacobian.count), h_t (m, only when rheonomic); by articulated bodies the same
                        */
    KMP_STAGE_MASS,    /* t, q: M, lower triangle (mass.count);
                          pivots of the rows (m), and their diagonals (m) */
    KMP_STAGE_BIAS, /* qd: C (n), jdqd (m); qd, efforts: accelerations (n), multipliers (m; 0 where not KMP_IN_KEPT) */
    KMP_STAGE_PRODUCT, /* of late->weighing where it goes by products: M x (n), with x as accelerations; KMP_STAGE_MASS
                          has what all products share */
    KMP_STAGE_LOAD = KMP_STAGE_PRODUCT, /* where C depends on lambda, KMP_STAGE_BIAS has jdqd (m) and operands that do
                           not depend on it; here qd, lambda: C (n), dC/dlambda (load_jacobian.count) */
    KMP_STAGE_OPEN = KMP_STAGE_PRODUCT, /* by articulated bodies, at the arguments of the accelerations: what no
                           multiplier makes of them (n), jdqd (m) */
    KMP_STAGE_WORKING, /* where forces are not conservative: their power, at the arguments of C or of the accelerations
                        */
    KMP_STAGE_CORRECT  /* by articulated bodies: t, q, KMP_IN_MU: the mass-orthogonal change x (n) with J x = -mu */
};

/* Stages of the judging program. */
enum {
    KMP_STAGE_POTENTIAL = 1, /* t, q: potential energy */
    KMP_STAGE_POWER, /* qd: power of the non-conservative forces; of late->by_links and by_products: kinetic energy */
    KMP_STAGE_REACTION, /* q, lambda: 3 a closure */
    KMP_STAGE_POSITION, /* q: 3 a position output */
    KMP_STAGE_SHOWN     /* all: outputs in addition to the table (model/data/output_table.h) */
};

typedef struct kmp_program_cache kmp_program_cache; /* dynamics/program_cache.h */

/** Motion by articulated bodies, derived when it is first asked for (kmp_motion_need_bodies): many uses of a system
 * need only M and C. Written once. */
typedef struct kmp_bodies {
    pthread_mutex_t lock;
    atomic_bool made;     /* the next one counts when it is true */
    kmp_program *program; /* NULL: runs take M and C */
    kmp_savings first;    /* variants that M and C have; empty: without a search */
} kmp_bodies;

/** M and C that wait for their first use (kmp_motion_need): runs of large mechanisms by articulated bodies evaluate
 * only M, at the start and for energies; runs of large trees do without, and have the kinetic energy link by link. Runs
 * of large mechanisms with few independent coordinates take products M x and C, never M.
 * `motion` is written once, under the lock; so is the pattern of M where `weighing` does not have it. */
typedef struct kmp_lazy_equations {
    pthread_mutex_t lock;
    atomic_bool made;      /* `motion` of the system counts when it is true */
    bool by_links;         /* no program evaluates M before `motion` is made; */
    bool by_products;      /* nor here: `weighing` has products M x, C and jdqd */
    kmp_program *weighing; /* closures and M, which by_links leaves out */
    kmp_savings chosen;    /* the variants of M and C */
    struct kempe_system *system;
} kmp_lazy_equations;

struct kempe_system {
    const kempe_model *model;
    kempe_context *context;
    kmp_arena arena; /* of all arrays except the arrays of the events */
    int n, m;
    kmp_row *rows;
    char **row_names;
    kmp_pattern jacobian, mass;
    kmp_pattern load_jacobian; /* coordinate and row: dC/dlambda */
    bool rheonomic;            /* h depends on t */
    bool switches;             /* h depends on conditions: J may jump where they change, and rates with it */
    bool dissipative;          /* some force is not conservative, or a closure that moves or switches does work */
    bool frictionless;         /* it has no rows of friction that sticks */
    bool has_power;            /* so it is without the user's force */
    kmp_dynamics dynamics;     /* as requested */
    bool brief;                /* derived for few evaluations: without search for the fewest operations */
    kmp_program *motion, *judge;
    kmp_lazy_equations *late; /* NULL: `motion` is made with the system */
    kmp_program *closing;     /* the stages to KMP_STAGE_CLOSURE of `motion`, or of late->weighing */
    kmp_bodies *bodies;
    kmp_events events;     /* conditions: inputs KMP_IN_MODE of all programs */
    kmp_program *changes;  /* stage 1: first - second of each condition at (t, q, qd), zero of late ones; stage 2: late
                              ones, at qdd and lambda too; NULL without conditions. Each stage then has the unknowns of
                              implicit blocks in the conditions */
    kmp_program *goals;    /* of points with goals (dynamics/goal_equations.h); NULL without them */
    bool changes_by_rates; /* the conditions depend on qd, or on more */
    char **event_text;     /* events.count: "'motor': q(A) < 0.2" */
    int use_count;
    kmp_table_use *use; /* of tables in outputs: the arguments follow the outputs in their stage */
    atomic_bool *left;  /* of a condition: its table was left, or it held where a run warns of it, in some run; then of
                         * both ends of a use. Runs are parallel */
    int chart_count;    /* joints with inputs KMP_IN_CHART, nine each */
    int *chart_first;   /* their first rotations */
    bool *chart_before; /* the chart comes before them, otherwise after */
    double length;      /* characteristic length, m */
    double kept_length; /* of a run whose start values are not lengths of the model; 0: none */
    double reach;   /* the largest distance of a closed point from the origin, m: the rounding of h is relative to it */
    int *load_rows; /* rows whose multipliers forces depend on, ascending: C is a function of those too */
    int load_row_count;       /* 0: M qdd + C = J' lambda is linear in lambda */
    double *scale;            /* n: size of a coordinate: 1 for a rotation, `length` for a translation */
    double *row_scale;        /* m: size of a closure row */
    double *parameters;       /* values */
    double closure_tolerance; /* m: the tolerance of redundant closures; 0: none */
    kmp_rounding *rounding;
    bool strict;             /* rounding of the model's numbers does not explain the error of redundant closures */
    bool mended;             /* points and axes of `model` have the values that a rounded drawing means
                                (constraints/inexact/nearest_exact.h) */
    struct kmp_variant *own; /* owner of the mended model, where it belongs to the system; NULL: not owned */
    double *misfit;          /* by closures: their error as drawn, scaled; 0: none */
    double mended_by;        /* the largest change of a number, characteristic lengths or rad */
    kmp_program_cache *kept; /* what has been derived for runs of the system */
    bool has_key;            /* it is cached, by `key` and a name for each part: its model is as read from files */
    unsigned char key[KMP_DIGEST_SIZE];
    double build_s;        /* CPU time of deriving */
    kempe_force_fn *force; /* the user's efforts; NULL: none */
    void *force_user;
};

/** kempe_system_new_with_algorithm without a look at rounded numbers. */
kempe_status kmp_system_new_by(const kempe_model *model, const char *word, kempe_system **system);

/** A system that is evaluated a few hundred times: as derived, since a search for fewer operations costs more than
 * these save. */
kempe_status kmp_system_new_brief(const kempe_model *model, kmp_dynamics dynamics, kempe_system **system);

/** A system of only closures, without masses and forces: for assembling, and for following closed configurations. */
kempe_status kmp_system_of_closures(const kempe_model *model, kempe_system **system);

/** The size of gravity, m/s^2. */
double kmp_system_gravity(const kempe_system *system);

/** A length of a mechanism: |to - from|. */
typedef struct kmp_length_scale {
    kmp_number to[3], from[3];
    double length;
    int body, axis; /* above 0: the radius of gyration of this body about this axis, in place of |to - from| */
} kmp_length_scale;

/** The characteristic length, m, and the tolerance of closures, m. */
double kmp_system_length(const kempe_model *model);
double kmp_closure_tolerance(const kempe_model *model);

/** The characteristic length's source: the largest of the offsets of joints and closure points in their bodies and
 * lengths of rods. Without these the largest start value of translations, or the largest radius of gyration where that
 * is much longer; else the largest offset of centres of mass or the largest length of flexible bodies. The largest
 * radius of gyration counts after these where all coordinates are rotations.
 * The length is 0 where all are 0: then it is 1 m. */
kmp_length_scale kmp_system_length_scale(const kempe_model *model);

/** A system of the model without rows and programs; NULL: no memory. */
kempe_system *kmp_system_start(const kempe_model *model);

/** Sets the rows (m) of a new system with n coordinates, and what follows from them and the model: names, scales,
 * charts. `misfit`: by closures. False: no memory. */
bool kmp_system_set_rows(kempe_system *system, int n, int m, const kmp_row *rows, const double *misfit);

/** True if events depend on accelerations or multipliers, which loads change at once: friction that sticks, closed
 * contacts, ends of runs. */
bool kmp_system_watches_loads(const kempe_system *system);

/** Sets watched[i] (n) where events may come and go while coordinate i moves on: a condition is nonlinear in it, the
 * derivatives of closures depend on it, or masses and forces do, where events depend on loads. The angle of a wheel or
 * a gear is not watched, nor is the way on a straight track. KEMPE_E_MEMORY. */
kempe_status kmp_system_watched_coordinates(const kempe_system *system, bool *watched);

/** The highest derivative by time of an input that the equations or the outputs read, 0 to 2: of a system whose
 * `motion` is made. Closures read all, forces the first one, as a damper to a place that the input moves. */
int kmp_system_input_order(const kempe_system *system, int input);

/** "'motor': q(A) < 0.2", with the name of the force that the condition belongs to, in the system's arena. NULL: no
 * memory. */
char *kmp_system_event_text(kempe_system *system, const kmp_condition *condition);

/** Recomputes scales and values of parameters from a model whose numbers have changed (model/data/variant.h). False: no
 * memory.
 */
bool kmp_system_rescale(kempe_system *system);

/** The generalized forces (n) of the user's force, which must exist, at (t, q, qd); NaN where it reports failure. */
void kmp_system_effort(const kempe_system *system, double t, const double *q, const double *qd, double *effort);
