/* SPDX-License-Identifier: BSD-3-Clause */
/* The motion of varied_lanes.h as one program (constraints/programs/reduced_program.h) in the lanes of vector
 * registers: accelerations of u where v is closed. It is written for one choice of coordinates. A pass gives the
 * accelerations at v, and the correction of v that is left there. Value k of lane l is at k KMP_STAGE_LANES + l. */
#pragma once

#include "base/arena.h"
#include "constraints/evaluation/stage_lanes.h"
#include "constraints/programs/reduced_program.h"
#include "integrators/decide/closing.h"

typedef struct kmp_fused_lanes {
    const kmp_reduction *red;
    kmp_arena arena;
    kmp_program *program; /* NULL: there is none */
    kmp_stage_lanes stages;
    int multipliers, tangent; /* number; the first output of Bvu at the end */
    double *bound;            /* of the magnitude of each multiplier */
    double *state;            /* u, ud, v */
    double *chart;            /* where the program was written: it has some as numbers */
    double cycles;            /* of a pass, by counted operations, about */
    const double *rates;      /* of the last pass: qd of v */
    const double *end;        /* the same: Bvu, by columns; the correction of v; its qdd at udd = 0 */
} kmp_fused_lanes;

/** Writes the program for the choice of a reduction, which must outlive it, at the evaluator's last closure, or takes
 * the one that the system keeps. There is none for many degrees of freedom, large blocks and implicit blocks. Zero
 * initially, or freed. KEMPE_E_MEMORY. */
kempe_status kmp_fused_lanes_init(kmp_fused_lanes *fused, const kmp_reduction *red);
void kmp_fused_lanes_free(kmp_fused_lanes *fused);

/** True if there is a program, and the charts are unchanged since it was written. */
bool kmp_fused_lanes_applies(const kmp_fused_lanes *fused);

/** Takes a correction of `count` coordinates of q in all lanes, the last one where it is at most `enough`, scaled, or
 * no longer shrinks. *last: the size of the one before, INFINITY at the beginning. */
kmp_closing_move kmp_fused_lanes_correct(int count, const double *change, const int *coordinate, const double *scale,
                                         double enough, double *last, double *q);

/** Moves v in q (n) along the tangent of the last pass, to u (p). Returns the largest change of u, scaled. */
double kmp_fused_lanes_move(const kmp_fused_lanes *fused, const double *u, double *q);

/** Tangent, drift and curvature of a place from which positions are predicted, of a lane of the last pass. */
void kmp_fused_lanes_place(const kmp_fused_lanes *fused, int lane, double *drift, double *curve, double *tangent);

/** udd (p) at times, u and ud (p), with v in q (n) corrected until the correction is at most `enough`, scaled; that is
 * added. KMP_GO; KMP_RETRY where loops do not close or udd is not finite, KMP_APART where the order of elimination is
 * bad. No allocation. */
int kmp_fused_lanes_run(kmp_fused_lanes *fused, double enough, const double *t, const double *u, const double *ud,
                        double *q, double *udd);
