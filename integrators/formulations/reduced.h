/* SPDX-License-Identifier: BSD-3-Clause */
/* The inside of the reduced formulation: states, steps and rows (reduced.c), the watch over the choice of u and
 * exchanges (reduced_choice.c), the same equations as a DAE (reduced_dae.c). */
#ifndef KMP_INTEGRATORS_FORMULATIONS_REDUCED_H
#define KMP_INTEGRATORS_FORMULATIONS_REDUCED_H

#include "constraints/evaluation/fused.h"
#include "integrators/formulations/formulation.h"
#include "integrators/formulations/reduced_jacobian.h"

typedef struct kmp_reduced {
    kmp_formulation formulation; /* first */
    const kempe_system *s;
    kmp_plant *plant;
    kmp_margin *margin;
    kmp_partition part; /* its own: exchanges change it */
    kmp_reduction red;
    kmp_fused *fused;  /* integrated; NULL: there is none */
    bool apart;        /* its order of elimination is bad where the last step ended */
    long steps;        /* since the last exchange */
    bool by_saddle;    /* accelerations and multipliers come from there: by articulated bodies, or with many freedoms */
    kmp_saddle saddle; /* v's rates are the reduction's all the same */
    kmp_reduced_jacobian tangents; /* when asked for */
    double *jacobian;              /* size x size: of the residual by y, as a DAE */
    bool integrated, has_work, fixed, restarts;
    bool due; /* an exchange, before the next step */
    kmp_journal *journal;
    int n, p, r;
    double *q, *qd;       /* n */
    double *weight;       /* n: error weights of coordinates at the last accepted step */
    double *anchor_u;     /* p, of the last accepted step */
    double *anchor_v;     /* r */
    double *anchor_b;     /* r x p: tangent there */
    double *anchor_t;     /* r: what moving closures add to vd there */
    double *anchor_c;     /* r: vdd there less what udd makes */
    double *udd;          /* p */
    double *qdd, *lambda; /* n, m: where closures move */
    int *signs;           /* r: of the determinants of Jv's blocks, at the start, the last exchange or step */
    int *signs_now;       /* r */
    double rtol, atol, rate_scale;
    double t;                      /* of the last accepted step */
    bool crossed;                  /* det Jv had changed its sign at the end of the last step tried */
    double corrected, corrected_t; /* the last correction of v in error weights, of a step from there */
    double growth;                 /* |Bvu| there, scaled, and where */
    int growth_v, growth_u;
} kmp_reduced;

/* reduced.c */

/** Where the work stands among the unknowns. */
int kmp_reduced_work(const kmp_reduced *d);

/** The unknowns of a state, all but the work; their tolerances. */
void kmp_reduced_pack(kmp_reduced *d, const double *q, const double *qd, double *y);
void kmp_reduced_set_tolerances(kmp_reduced *d);

/** Factors, tangent, signs and anchor of d->q with the partition at hand. */
int kmp_reduced_settle(kmp_reduced *d, double t, const double *y);

/** d->q and d->qd at (t, y), factors of Jv and the tangent; then d->udd, too. KMP_GO or KMP_RETRY. */
int kmp_reduced_place(kmp_reduced *d, double t, const double *y);
int kmp_reduced_evaluate(kmp_reduced *d, double t, const double *y);

/** Of closures that move, after any accelerations. */
double kmp_reduced_drive_power(kmp_reduced *d);

/** dy = f(t, y); self is a kmp_reduced. */
int kmp_reduced_rhs(void *self, double t, const double *y, double *dy);

/** h, J, Bvu and the correction of v at the step's end, which was evaluated last. `end`: what the one program says,
 * when it was that. */
int kmp_reduced_come_to_end(kmp_reduced *d, double t, const double *y, kmp_fused_end *end);

/** Whether the step may end at y, where it has been come to; it is remembered then. */
int kmp_reduced_may_end(kmp_reduced *d, double t, const double *y, const kmp_fused_end *end);

/* reduced_choice.c */

/** |Bvu| of the tangent at hand, and whether it asks for an exchange. */
void kmp_reduced_judge(kmp_reduced *d);

/** The same at the step's end, with the signs of Jv's blocks there: KMP_GO, KMP_RETRY, KMP_HALT. */
int kmp_reduced_watch(kmp_reduced *d, double t, const int *signs);

/** Why steps have shrunk to nothing: at a dead centre that evaluations cannot pass, or where det Jv keeps changing its
 * sign. */
void kmp_reduced_explain(kmp_formulation *formulation);

/** An exchange that is due, at d->q and d->qd, where the plant is; y becomes the state in the new unknowns. */
int kmp_reduced_exchange(kmp_reduced *d, double t, double *y);

/** The one program for the choice of u at hand, whose factors are, too, if it is `worth` while. */
int kmp_reduced_fuse(kmp_reduced *d, bool worth);

/** The saddle system of the rows that the partition has, where it is used; whether it is. false: no memory. */
bool kmp_reduced_renew_saddle(kmp_reduced *d);
bool kmp_reduced_try_saddle(kmp_reduced *d);

/* reduced_dae.c */

/** The formulation as a DAE, begun at t. false after a message. */
bool kmp_reduced_describe(kmp_reduced *d, double t);

#endif
