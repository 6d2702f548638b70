/* SPDX-License-Identifier: BSD-3-Clause */
/* The equations of one scene: the sets that were asked for, in one graph.
 *
 *     M qdd + C = J' lambda      h = 0      J qd + h_t = 0      J qdd + jdqd = 0
 */
#ifndef KMP_DYNAMICS_EQUATIONS_H
#define KMP_DYNAMICS_EQUATIONS_H

#include "dynamics/kinematics.h"

/** What to derive. */
enum {
    KMP_SET_MASS = 1,    /* M */
    KMP_SET_BIAS = 2,    /* C, applied forces and efforts included */
    KMP_SET_CLOSURE = 4, /* h, J, h_t */
    KMP_SET_JDQD = 8,    /* gamma */
    KMP_SET_RESIDUAL =
        16, /* implicit dynamics of the dae road: R = Newton/Euler(q, qd, qdd) - J' lambda, J' mu, J qd + h_t */
    KMP_SET_ENERGY = 32,   /* potential energy and the power of non-conservative forces */
    KMP_SET_REACTION = 64, /* closure forces from lambda */
    KMP_SET_OUTPUT = 128,  /* what the model asks for beside the table */
    KMP_SET_INVERSE = 512  /* inverse dynamics: the efforts that give qdd, those of the model's forces left out */
};

typedef enum kmp_scheme { KMP_SCHEME_COMPOSITE, KMP_SCHEME_NER } kmp_scheme;

/** What of a model to derive, and how. */
typedef struct kmp_scene {
    unsigned sets;
    kmp_scheme scheme;
    kmp_keep keep;
    bool body_inputs;   /* forces and torques on the bodies as inputs */
    bool loops_alone;   /* no rows of drives */
    bool charted;       /* spherical joints have charts as inputs (model/spherical.h) */
    kmp_events *events; /* conditions as inputs, added to what is there; NULL: evaluated where they stand */
} kmp_scene;

/** A closure row that is kept. */
typedef struct kmp_row {
    int closure, component; /* component: of the declared rows, from 0 */
    int number;             /* among the closure's kept rows, from 0: the k of lambda.CLOSURE.k, less one */
    int length_power;
} kmp_row;

typedef struct kmp_equations {
    kempe_context *context;
    const kempe_model *model;
    kmp_graph *graph;
    kmp_tree tree;
    int n, m;
    kmp_row *rows;     /* m */
    kmp_ref *mass;     /* n x n, entry (i, k) at i n + k for k <= i */
    kmp_ref *bias;     /* n */
    kmp_ref *h, *h_t;  /* m */
    kmp_ref *jacobian; /* m x n, entry (r, k) at r n + k */
    kmp_ref *jdqd;     /* m */
    kmp_ref *residual; /* n */
    kmp_ref *inverse;  /* n */
    kmp_ref *jt_mu;    /* n */
    kmp_ref *hdot;     /* m */
    kmp_ref potential, power;
    kmp_ref *reaction; /* 3 a closure */
    kmp_ref *position; /* 3 a position output, in order */
    int position_count;
    kmp_ref *shown; /* all outputs beside the table, in order */
    int shown_count;
} kmp_equations;

/** KEMPE_E_INPUT when a closure can never be met (a row that no coordinate moves), KEMPE_E_MEMORY. */
kempe_status kmp_equations_derive(kmp_equations *eq, const kempe_model *model, const kmp_scene *scene);
/** The same for scenes that say no more. */
kempe_status kmp_equations_init(kmp_equations *eq, const kempe_model *model, unsigned sets, kmp_scheme scheme,
                                bool keep_parameters);
/** The same for programs that integrate: with conditions as inputs (`events` is added to; NULL: as above), and with the
 *  charts of spherical joints (model/spherical.h). */
kempe_status kmp_equations_init_smooth(kmp_equations *eq, const kempe_model *model, unsigned sets, kmp_scheme scheme,
                                       kmp_events *events);
void kmp_equations_free(kmp_equations *eq);

#endif
