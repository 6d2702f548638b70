/* SPDX-License-Identifier: BSD-3-Clause */
/* A mechanism follows a point of a body that is dragged: its loops stay closed at t = 0, locked coordinates stay,
 * drives are released, and the distance from the point to the target falls. Steps are damped least squares (Levenberg,
 * Marquardt) on the closed positions,
 *
 *     dq = -P G' (G P G' + mu 1)^-1 r      r = point - target, G = dr/dq, P onto the null space of J,
 *
 * in scaled coordinates; least changes project and close the loops again. A step is taken if the distance falls,
 * closing moves little in comparison, and the tangent has turned little: so the branch is kept. Nothing is allocated
 * after kmp_dragging_new. */
#pragma once

#include "constraints/closing/mode_watch.h"
#include "constraints/closing/random_walk.h"
#include "model/data/pose.h"

typedef struct kmp_dragging {
    const kempe_system *system;
    kmp_arena arena;
    kmp_walk *walk;
    kmp_mode_watch *watch; /* NULL: the assembly modes of this mechanism are not watched */
    int freedoms;
    bool *hold;           /* n: deflections, which stay as in the start */
    bool *released;       /* m: rows of drives, which do not hold while a point is dragged */
    double *start;        /* n: the assembled start */
    double *q;            /* n: closed */
    kmp_pose *poses;      /* of all bodies at q */
    double (*axes)[3];    /* n */
    double (*places)[3];  /* n */
    double *trial, *step; /* n */
    double *slope, *free; /* 3 x n each, row by row, scaled: G, and G P */
    double damping;       /* mu over the largest diagonal of G P G' */
} kmp_dragging;

typedef struct kmp_drag_report {
    double closure;  /* max |h| / row scale */
    double distance; /* from the point to the target, m */
    int mode;        /* 1: another assembly mode than at the last report; 0: the same; -1: not known */
} kmp_drag_report;

/** Prepares, and assembles the start. KEMPE_E_FAILED: its loops cannot be closed; KEMPE_E_MEMORY. */
kempe_status kmp_dragging_new(const kempe_system *system, kmp_dragging **dragging);
void kmp_dragging_free(kmp_dragging *dragging);

/** Goes to the closed state next to q (n). False: there is none, and it stays where it was. */
bool kmp_dragging_place(kmp_dragging *dragging, const double *q, kmp_drag_report *report);

/** The present state, whose distance counts as 0. */
void kmp_dragging_look(kmp_dragging *dragging, kmp_drag_report *report);

/** Moves the point of a body (in its frame, m) towards the target (in the ground's, m), by no more than
 * KMP_LONGEST_CORRECTION of any scaled coordinate. */
void kmp_dragging_move(kmp_dragging *dragging, int body, const double point[3], const double target[3],
                       kmp_drag_report *report);
