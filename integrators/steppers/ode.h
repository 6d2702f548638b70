/* SPDX-License-Identifier: BSD-3-Clause */
/* Interface between a formulation and an integrator: an initial value problem y' = f(t, y) or F(t, y, y') = 0, with a
 * callback at every accepted step. Integrators are independent of mechanisms, formulations of integration methods. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* Results of a callback. */
enum {
    KMP_GO = 0,
    KMP_RETRY = 1,   /* this state cannot be evaluated, or this step is rejected: try a smaller one */
    KMP_HALT = -1,   /* give up; the formulation keeps the reason */
    KMP_CHANGED = 2, /* the unknowns have changed their meaning: restart from them */
    KMP_APART = 3    /* several places cannot be evaluated at once now: evaluate one by one */
};

typedef struct kmp_ode {
    int n;
    void *self;

    /** dy = f(t, y). */
    int (*rhs)(void *self, double t, const double *y, double *dy);

    /** Called with a step that passed the error test: the new t, y and dy = f(t, y) (rhs was evaluated there last), and
     * the error weights `w` (an error of w[i] in y[i] is at the tolerance). May correct y slightly in place; KMP_RETRY
     * rejects the step. NULL: none. */
    int (*accept)(void *self, double t, double *y, const double *dy, const double *w);

    /** j = df/dy (n x n, column-major, zeroed before), exact. NULL: there is none. For implicit integrators. */
    int (*jacobian)(void *self, double t, const double *y, double *j);

    /** For an integrator that chooses where to evaluate (singular_step.h). Closes y, unless `as_it_is`; then computes
     * dy = f(t, y) with nothing left out, and the distance from a singularity of f over its usual value. dy or distance
     * may be NULL. NULL: none. */
    int (*closed)(void *self, double t, double *y, bool as_it_is, double *dy, double *distance);

    /** dy = f(t, y) at `width` places at once: of t, y and dy, value k of lane l is at k width + l. Slopes of positions
     * are left out. For integrators that evaluate several stages together. NULL: none, or KMP_APART: only by rhs. */
    int (*lanes)(void *self, const double *t, const double *y, double *dy);

    /** Improves dy, which `lanes` and further calls of this have given at places nearby, to the derivative at t and y:
     * what it leaves is in proportion to the distance from the place of `lanes`. Dearer parts of f remain as they are
     * there. NULL: none. KMP_APART: not now, only by `lanes`. */
    int (*improve)(void *self, const double *t, const double *y, double *dy);
    int width;       /* 4 or 8; 0: no lanes */
    int positions;   /* y[positions + i] is the derivative of y[i] for i < positions */
    int quadratures; /* the last of y, on which f does not depend */
    bool results;    /* quadratures are results: their errors limit steps, too */

    /** Slopes of the quadratures at the places of the last `lanes`, which leaves them out, into dy as there. Called
     * once a step, when the stages are found. NULL: `lanes` has them. */
    int (*integrands)(void *self, const double *t, const double *y, double *dy);

    /* Linear equations that follow a motion. Positions and rates then belong to the motion, n_m = positions /
     * (1 + followers) each, and after them to each of these columns x, with x'' = A (x, x') + b along the motion.
     * `lanes` gives only slopes of the motion, never KMP_APART. 0: none. */
    int followers;
    /** A (n_m x 2 n_m) and b (n_m x followers), column-major, at the places of the last `lanes`, in lanes like these.
     */
    int (*follow)(void *self, double *a, double *b);
    /** Only the slopes of the motion, of dy = f(t, y). */
    int (*alone)(void *self, double t, const double *y, double *dy);
    /** The same at the end of a step, which is the last lane of the last `lanes`, also without followers: dy has the
     * slopes of that, which may remain. NULL: by rhs. For y without quadratures. */
    int (*end)(void *self, double t, const double *y, double *dy);

    /** Makes `lanes` ready at t, where cycles_of_lanes is not 0 and the formulation was made without them. NULL: none.
     * KMP_GO or KMP_HALT. */
    int (*make_lanes)(void *self, double t);

    /* About the processor cycles of an evaluation, and of one at `width` places, by counted operations: integrators
     * compare costs by them. 0: unknown, or one by one. */
    double cycles, cycles_of_lanes;
    double cycles_of_step;           /* of what the evaluations of a step share, and of `follow` */
    double cycles_to_make;           /* the cycles of making `lanes` where a formulation begins; 0: unknown */
    bool drops_rows;                 /* the rows that are in force may change during a run */
    const double *cycles_of_improve; /* the same of `improve` now, 0: it is KMP_APART */
} kmp_ode;

/** F(t, y, y') = 0 with an analytic sparse iteration matrix. */
typedef struct kmp_dae {
    int n, nz;                  /* unknowns; entries of dF/dy + cj dF/dy' */
    const int64_t *col_start;   /* n + 1, compressed columns, rows ascending in each */
    const int64_t *row;         /* nz */
    const double *differential; /* n: 1 for a differential unknown, 0 for an algebraic one */
    const double *factor;       /* n: multiplies the error weight (1e8 excludes an unknown from every test) */
    void *self;

    /** r = F(t, y, yp). KMP_GO, KMP_RETRY or KMP_HALT. */
    int (*residual)(void *self, double t, const double *y, const double *yp, double *r);

    /** values[nz] = dF/dy + cj dF/dy'. */
    int (*matrix)(void *self, double t, double cj, const double *y, const double *yp, double *values);

    /** Called after every step that the integrator accepts. KMP_RETRY: the integrator restarts with a shorter step.
     * KMP_HALT ends the run. NULL: none. */
    int (*accept)(void *self, double t, const double *y, const double *yp);
} kmp_dae;

/** Error control: weight of y[i] is atol[i] + rtol max(|y_old|, |y_new|). */
typedef struct kmp_tolerance {
    double rtol;
    const double *atol;
} kmp_tolerance;
