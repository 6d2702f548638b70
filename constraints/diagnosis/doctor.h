/* SPDX-License-Identifier: BSD-3-Clause */
/* What `check` finds out beyond rank and choice: which rows are redundant always and which only here, who depends on
 * whom, what could be left out, which coordinates could be independent, how far the mechanism moves. All arrays live in
 * the arena of the check. */
#ifndef KMP_CONSTRAINTS_DIAGNOSIS_DOCTOR_H
#define KMP_CONSTRAINTS_DIAGNOSIS_DOCTOR_H

#include "base/arena.h"
#include "constraints/closing/assemble.h"
#include "constraints/diagnosis/doctor_walk.h"
#include "constraints/partition/partition.h"

enum { KMP_DOCTOR_POINTS = 8 };

/** Rows that say the same: one of them follows from the others. */
typedef struct kmp_dependent {
    int *rows, count;
    bool always; /* at the random configurations too */
} kmp_dependent;

/** A closure that may lose rows without any change of the mobility in general: tried out. */
typedef struct kmp_repair {
    int closure;
    int *rows, count; /* a choice of as many as may go together */
    int of;           /* rows that it has */
} kmp_repair;

/** A coordinate that could be independent, in place of `instead` (-1: of none, or it is independent already). */
typedef struct kmp_alternative {
    int coordinate, instead;
    double max_b; /* then, scaled; infinite when Jv would be singular */
    bool independent;
} kmp_alternative;

/** One diagonal block of Jv, in order of solution. */
typedef struct kmp_loop_block {
    int size, *columns, *rows;
    int *closures, closure_count;
} kmp_loop_block;

typedef enum kmp_second_order {
    KMP_SECOND_UNTRIED,
    KMP_SECOND_REAL,      /* every first-order motion goes on at second order */
    KMP_SECOND_BRANCHES,  /* some do: branches cross here */
    KMP_SECOND_NONE,      /* none does: shaky */
    KMP_SECOND_CONDITIONS /* more than two directions: only the number of conditions is known */
} kmp_second_order;

/** The path of one coordinate while a mechanism of one degree of freedom walks through its motion. */
typedef struct kmp_swing {
    double low, high;
    bool moves, low_dead, high_dead; /* it turns back there */
    bool unseen;                     /* an angle that is singular at the start: its path is not told */
    int turns;                       /* full turns in one cycle, signed; 0 for what comes back */
} kmp_swing;

/** A place met on the way. */
typedef struct kmp_landmark {
    int coordinate; /* that turns back; -1: a change point */
    double *q;      /* n */
    double margin;  /* of a change point: last pivot of J over its usual size; 0 when exact */
} kmp_landmark;

enum { KMP_MOST_LANDMARKS = 64 };

typedef struct kmp_limits {
    bool walked;
    const char *why_not; /* a sentence */
    bool cycle;          /* the motion closes in itself */
    const char *ended;   /* why not, when it does not: a sentence */
    double length;       /* of the way, scaled */
    kmp_swing *swing;    /* n */
    kmp_landmark landmark[KMP_MOST_LANDMARKS];
    int landmark_count;
} kmp_limits;

typedef struct kmp_doctor {
    bool ran;
    const char *why_not; /* a sentence, when it did not */
    int declared;        /* rows of all closures, those that vanish identically counted too */
    bool moved;          /* the random configurations could be reached */
    int generic_rank;    /* the most met; that of here when nothing moved */
    double margin;       /* last kept pivot here over the largest at the random configurations */
    kmp_dependent *sets;
    int set_count;
    int *shared_rows, shared_count; /* rows of all sets: their reactions are not unique */
    kmp_second_order second;
    int conditions, branches;
    kmp_repair *repairs;
    int repair_count;
    bool repairs_skipped;          /* too many rows to try */
    kmp_alternative *alternatives; /* n, or none when there are no closures */
    int alternative_count;
    kmp_loop_block *blocks;
    int block_count;
    kmp_limits limits;
} kmp_doctor;

/** A held coordinate that was tried free while the others stay held. */
typedef struct kmp_release {
    int coordinate; /* -1: all of them */
    bool closes;
    double to; /* where it goes then */
} kmp_release;

/** Why a model does not assemble. */
typedef struct kmp_reach {
    int closure;
    double longest, others; /* longest link, the sum of the others, m */
    const char *from, *to;  /* of the longest link, points */
    const char *body;
} kmp_reach;

typedef struct kmp_obstacle {
    kmp_release *releases;
    int release_count;
    kmp_reach *reaches; /* closures whose links are too short for any configuration */
    int reach_count;
} kmp_obstacle;

/* Work shared by the parts of one examination. */
typedef struct kmp_examination {
    const kempe_system *system;
    const double *q;
    const kmp_partition *part;
    kmp_arena *arena;
    kmp_walk *walk;
    kmp_doctor *doctor;
    int point_count;   /* random configurations */
    double *jacobians; /* m x n each, scaled: here, then at the points */
} kmp_examination;

/** All of it, into `doctor`. KEMPE_E_MEMORY. */
kempe_status kmp_doctor_examine(kmp_doctor *doctor, kmp_plant *plant, const double *q, const kmp_partition *part,
                                kmp_arena *arena);

/** Why this assembly stays open. */
kempe_status kmp_obstacle_find(kmp_obstacle *obstacle, const kempe_assembly *assembly, kmp_arena *arena);

/** The longest distance of two joints or closure points on one body around a loop, m; 0 where nothing has any. */
double kmp_loop_longest_side(const kempe_model *model, int closure);

/* Its parts, in order. Memory failures are left to the arena. */
void kmp_doctor_points(kmp_examination *x);
void kmp_doctor_dependents(kmp_examination *x);
void kmp_doctor_second_order(kmp_examination *x);
void kmp_doctor_repairs(kmp_examination *x);
void kmp_doctor_alternatives(kmp_examination *x);
void kmp_doctor_limits(kmp_examination *x);

/** Blocks of Jv with their rows and closures, into `blocks` (arena); their number. -1: no memory or singular. */
int kmp_loop_blocks(kmp_plant *plant, const kmp_partition *part, kmp_arena *arena, kmp_loop_block **blocks);

/** Jacobian k of the examination: 0 here, 1 .. point_count at the points. */
const double *kmp_doctor_jacobian(const kmp_examination *x, int k);

#endif
