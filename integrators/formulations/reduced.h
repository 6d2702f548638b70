/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of the reduced formulation: states, steps and rows, monitoring of the choice of u and exchanges, programs
 * (reduced_programs.c), prediction of v, the equations as a DAE. */
#pragma once

#include "constraints/evaluation/stage_lanes.h"
#include "constraints/programs/load_passes.h"
#include "constraints/programs/reduced_program.h"
#include "integrators/formulations/formulation.h"
#include "integrators/formulations/reduced_jacobian.h"

/* Earlier choices of u whose programs are kept. */
enum { KMP_REDUCED_KEPT = 8 };

/* The program of one choice of u: by the reduced mass, or by the saddle system with many degrees of freedom. */
typedef struct kmp_reduced_programs {
    kmp_reduced_program *scalar; /* for one stage; NULL: there is none */
    kmp_stage_lanes stages;      /* it for several stages at once */
    kmp_load_passes loads;       /* of these; without room: no force depends on multipliers */
    kmp_arena arena;             /* its room */
} kmp_reduced_programs;

/* The use of programs, from one choice of u to the next. */
typedef struct kmp_program_use {
    bool closed_by_program;        /* newton: the reduced program made the last evaluation */
    struct kmp_reduced_kept *kept; /* of earlier choices; NULL: none yet */
    int kept_next;                 /* record for the next new one */
    bool had_saddle_program;       /* the last choice had a program by the saddle system */
    long
        due_saddle_program; /* the number of evaluations by parts from which on the program by the saddle system pays */
    double of_program;      /* operations of the equations in an evaluation; 0: not counted yet */
    bool by_saddle_program; /* it made the last evaluation */
    bool cancelled;         /* rounding showed in its accelerations */
    bool apart;             /* the order of elimination in either is bad at the end of the last step */
    long steps;             /* since the last exchange, or since the reduced program was made */
    bool made_late;         /* the reduced program is made once it lasts for KMP_FORMULATION_BRIEF steps */
} kmp_program_use;

/* The last accepted step, from which v is predicted. */
typedef struct kmp_step_anchor {
    double *u;    /* p */
    double *w;    /* p: weights of u in the progress since then */
    double *v;    /* r */
    double *b;    /* r x p: tangent */
    double *t;    /* r: part of vd from moving closures */
    double *c;    /* r: vdd without the part of udd */
    bool by_time; /* the progress is the time */
    double noise; /* rounding of closed coordinates */
} kmp_step_anchor;

typedef struct kmp_reduced {
    kmp_formulation formulation; /* first */
    kmp_formulation_start start; /* without the state */
    const kempe_system *s;
    kmp_evaluator *eval;
    kmp_partition part; /* own copy: exchanges change it */
    kmp_reduction red;
    kmp_reduced_programs programs; /* of the present choice of u */
    kmp_program_use use;
    bool by_saddle;    /* accelerations and multipliers come from the saddle system: by articulated bodies, or with many
                        * degrees of freedom */
    kmp_saddle saddle; /* rates of v come from the reduction in any case */
    kmp_reduced_jacobian tangents; /* if the Jacobian is used */
    double *jacobian;              /* size x size: of the residual by y, as a DAE */
    bool integrated, has_work;
    bool has_v; /* v is among the unknowns: integrated; or predicted for the newton form by an explicit one-step method
                 */
    int n, p, r;
    double *q, *qd; /* n */
    double *weight; /* n: error weights of coordinates at the last accepted step */
    kmp_step_anchor anchor;
    double *v;                    /* r: of the present evaluation of the newton form */
    double contraction;           /* of the last evaluation: a scaled correction over the square of the one before */
    double *by_scale, *by_weight; /* r: reciprocal scales and error weights of v */
    double *udd;                  /* p */
    double *state, *slope;        /* 2 p + r each: (u, ud, v) and its derivative, of the newton form */
    double *qdd, *lambda;         /* n, m: for moving closures */
    int *signs;     /* r: signs of the determinants of Jv's blocks, at the start, the last exchange or step */
    int *signs_now; /* r */
    double t;       /* of the last accepted step */
    bool crossed;   /* det Jv had changed its sign at the end of the last attempted step */
    kmp_last_correction corrected; /* of v, in error weights */
    double growth;                 /* scaled |Bvu| at t, and its v and u */
    int growth_v, growth_u;
} kmp_reduced;

/** Sets the unknowns of a state, except the work, with v if it is among them. */
void kmp_reduced_pack(const kmp_partition *part, bool has_v, const double *q, const double *qd, double *y);

/** dy = f(t, y); self is a kmp_reduced. */
int kmp_reduced_rhs(void *self, double t, const double *y, double *dy);

/** True if there is a program by the saddle system. */
static inline bool kmp_reduced_has_saddle_program(const kmp_reduced *d)
{
    return d->programs.scalar && kmp_reduced_program_is_by_saddle(d->programs.scalar);
}
