/* SPDX-License-Identifier: BSD-3-Clause */
/* Results of `check` beyond rank and choice: rows that are redundant everywhere or only here, their dependent sets,
 * closures that could be left out, possible independent coordinates, and the range of motion. All arrays are in the
 * arena of the check. */
#pragma once

#include "base/arena.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/random_walk.h"
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/partition/partition.h"
#include <kempe/check.h>

enum { KMP_DOCTOR_POINTS = 8 };

/** A set of dependent rows: one of them follows from the others. */
typedef struct kmp_dependent {
    int *rows, count;
    bool always; /* also at the random configurations */
} kmp_dependent;

/** A closure that may lose rows without a change of the generic mobility, found by trial. */
typedef struct kmp_repair {
    int closure;
    int *rows, count; /* largest choice of rows that may be left out together */
    int of;           /* number of rows of the closure */
} kmp_repair;

/** A coordinate that could be independent, in place of `instead` (-1: none, or it is independent already). */
typedef struct kmp_alternative {
    int coordinate, instead;
    double max_b; /* max |B| with this choice, scaled; infinite when Jv would be singular */
    bool independent;
} kmp_alternative;

typedef enum kmp_second_order {
    KMP_SECOND_UNTRIED,
    KMP_SECOND_REAL,      /* every first-order motion continues at second order */
    KMP_SECOND_BRANCHES,  /* some continue: branches cross here */
    KMP_SECOND_NONE,      /* none continues: infinitesimally mobile */
    KMP_SECOND_CONDITIONS /* more than two directions: only the number of conditions is known */
} kmp_second_order;

/** Range of one coordinate over the motion of a mechanism of one degree of freedom. */
typedef struct kmp_coordinate_range {
    double low, high;
    bool moves, low_dead, high_dead; /* low_dead, high_dead: it turns back there */
    bool unseen;                     /* an angle that is singular at the start: its range is not reported */
    int turns;                       /* full turns in one cycle, signed; 0 without a net turn */
} kmp_coordinate_range;

/** A dead centre or change point of the motion. */
typedef struct kmp_limit_position {
    int coordinate; /* the coordinate that turns back; -1: a change point */
    double *q;      /* n */
    double margin;  /* of a change point: last pivot of J over its usual size; 0 when exact */
} kmp_limit_position;

enum { KMP_MOST_LIMIT_POSITIONS = 64 };

typedef struct kmp_limits {
    bool walked;
    const char *why_not;         /* reason, a sentence */
    bool cycle;                  /* the motion is closed */
    const char *ended;           /* reason why the motion is not closed, a sentence */
    double length;               /* path length, scaled */
    kmp_coordinate_range *range; /* n */
    kmp_limit_position limit_position[KMP_MOST_LIMIT_POSITIONS];
    int limit_position_count;
} kmp_limits;

typedef struct kmp_diagnosis {
    bool ran;
    const char *why_not; /* reason of a skipped examination, a sentence */
    int declared;        /* number of rows of all closures, including rows that hold in every position */
    bool moved;          /* random configurations were reached */
    int generic_rank;    /* the largest rank found; the rank here if no random configuration was reached */
    double margin;       /* last kept pivot here over the largest at the random configurations */
    kmp_dependent *sets;
    int set_count;
    int *shared_rows, shared_count; /* rows of all sets: their reactions are not unique */
    kmp_shared_loads loads;         /* of joints and loops, at the start */
    kmp_second_order second;
    int conditions, branches;
    kmp_repair *repairs;
    int repair_count;
    bool repairs_skipped;          /* too many rows for trials */
    kmp_alternative *alternatives; /* n; none without closures */
    int alternative_count;
    kmp_loop_block *blocks;
    int block_count;
    kmp_limits limits;
} kmp_diagnosis;

/** A held coordinate that was released in a trial while the others stay held. */
typedef struct kmp_release {
    int coordinate; /* -1: all of them */
    bool closes;
    double to; /* its value then */
} kmp_release;

/** A closure with links that are too short. */
typedef struct kmp_short_links {
    int closure;
    double longest, others; /* length of the longest link; total length of the other links, m */
    const char *from, *to;  /* points of the longest link */
    const char *body;
} kmp_short_links;

typedef struct kmp_obstacle {
    kmp_release *releases;
    int release_count;
    kmp_short_links *reaches; /* closures with links that are too short for any configuration */
    int reach_count;
} kmp_obstacle;

struct kempe_check {
    const kempe_system *given; /* the caller's */
    const kempe_system *system;
    kempe_model
        *mechanism;    /* of a model with states or friction that sticks: the model without them and without forces, */
    kempe_system *own; /* and its system, which is examined; NULL: there are none */
    kempe_assembly *assembly;
    bool assembled;          /* false: only `obstacle` is set */
    kmp_partition part;      /* n, m, p (dof), r (rank), u, v, rows, redundant, max_b */
    double condition;        /* of Jv */
    int driven;              /* degrees of freedom of the drives: the decrease of the rank without them */
    char *undetermined;      /* reason of accelerations that are undetermined or not finite; NULL: none */
    bool ended;              /* a run would end at its start, by a condition */
    int body_count;          /* number of bodies without the ground */
    int loop_count;          /* number of closures */
    kmp_diagnosis diagnosis; /* results of the examination */
    kmp_obstacle obstacle;   /* reason of a failed assembly */
    char *reason;            /* message of the failed assembly */
    kmp_arena arena;         /* of obstacle and reason */
    kempe_status status;
    char *warnings; /* of the computation, one per line */
};

/* Work shared by the parts of one examination. */
typedef struct kmp_examination {
    const kempe_system *system;
    const double *q;
    const kmp_partition *part;
    kmp_arena *arena;
    kmp_walk *walk;
    kmp_diagnosis *diagnosis;
    int point_count;   /* random configurations */
    double *jacobians; /* m x n each, scaled: here, then at the points */
} kmp_examination;
