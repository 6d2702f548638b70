/* SPDX-License-Identifier: BSD-3-Clause */
/* Explicit Runge-Kutta methods with error control, dense output and acceptance of every step by the formulation: the
 * interface of a method to the driver (rk.c), and the driver's internals for its stages. A new method is one file with
 * a kmp_rk_method, a KMP_RK_SOLVER line and a row in integrators.def. */
#pragma once

#include "integrators/steppers/solver.h"

#include <float.h>
#include <math.h>

enum { KMP_RK_MAX_STAGES = 16, KMP_RK_MAX_INTERPOLANTS = 8 };

/* Stabilising exponent of the step-size control (Gustafsson's PI). */
#define KMP_RK_BETA 0.04
/* Compared with 0.9 at a given tolerance: half the error for 4 % more evaluations with DOP853, for 10 % more with
 * DOPRI5; at equal error 2 to 4 % fewer (docs/decisions/safety.md). */
#define KMP_RK_SAFETY 0.8
/* Least error of the last step in the control. */
#define KMP_RK_ERROR_FLOOR 1e-4

typedef struct kmp_rk kmp_rk;

typedef struct kmp_rk_method {
    int stages;                /* derivatives k[1] .. k[stages], numbered as published */
    int end;                   /* k[end] is the derivative at the step's end */
    bool ends_with_derivative; /* run computes k[end]; otherwise the driver does, after the error test */
    int interpolants;          /* vectors of the dense output */
    int order;
    double exponent; /* of the error in the next step's size */
    double shrink, grow;

    /* Computes the stages of a step h from (t, y) with k[1] given, ending at t_new. KMP_GO, or the result of the
     * right-hand side. */
    int (*run)(kmp_rk *s, double h, double t_new);

    /* Puts the new y into y_old (temporarily), sets the weights w, and returns the error: 1 is at the tolerance. */
    double (*error)(kmp_rk *s, double h);

    /* Prepares the interpolant of the last step: vectors r of the polynomial r0 + x (r1 + z (r2 + x (r3 + ...))), with
     * z = 1 - x, at t_old + x taken. */
    int (*prepare_dense)(kmp_rk *s);
} kmp_rk_method;

extern const kmp_rk_method kmp_dop853; /* order 8, dense output of order 7 */
extern const kmp_rk_method kmp_dopri5; /* order 5, dense output of order 4 */

struct kmp_rk {
    kmp_solver base; /* first */
    const kmp_rk_method *method;
    double taken;     /* the last step */
    double error_old; /* of the last accepted one */
    bool rejected;    /* the last attempt was rejected: no growth */
    bool collapsed;
    bool dense_ready;
    bool received;          /* the last step is another solver's */
    bool coarse;            /* the interpolant of the last step is less exact than the step */
    kmp_rk *finer;          /* integrates from the beginning of such a step to where the solution is wanted */
    double *y, *y_old, *dy; /* dy is k[end] after a step, k[1] within one */
    double *stage, *w;
    double *k[KMP_RK_MAX_STAGES + 1];
    double *interpolant[KMP_RK_MAX_INTERPOLANTS];
};

/** Sets the first four vectors of the interpolant: a cubic by the values and slopes at both ends of the last step. */
void kmp_rk_begin_dense(kmp_rk *s);

#define KMP_INLINE static inline __attribute__((always_inline))

/* -- step-size control ------------------------------------------------------------------------------- */

/* The next step after an accepted one (Hairer, Wanner, II, IV.2, with the published bounds), without growth after a
 * rejection. */
KMP_INLINE double kmp_rk_after_accepted(const kmp_rk_method *method, double h, double error, double error_old,
                                        bool rejected)
{
    double factor = pow(error, method->exponent) / pow(error_old, KMP_RK_BETA) / KMP_RK_SAFETY;
    double next = h / fmax(1.0 / method->grow, fmin(method->shrink, factor));
    return rejected ? fmin(next, h) : next;
}

/* The largest part of a rejected step over the next attempt. An error far above the tolerance is still one of the order
 * of the method. The estimate vanishes at single step sizes that are too long: a rejected step that was shortened by
 * less than its error requires met one, and was accepted with an error of 200 tolerances. */
#define KMP_RK_SHORTEST 100

KMP_INLINE double kmp_rk_after_rejected(const kmp_rk_method *method, double h, double error)
{
    if (!(error <= DBL_MAX))
        return h / method->shrink;
    return h / fmin(KMP_RK_SHORTEST, pow(error, method->exponent) / KMP_RK_SAFETY);
}

/* -- dense output ------------------------------------------------------------------------------------ */

/* The largest term of highest order of an interpolant that is taken, in tolerances. It is 5 to 200 where the solution
 * is resolved. A method at the bound of its stability damps fast motions at the ends of steps but not between them: the
 * term was 9e4 where the interpolant was wrong by 1e4 tolerances, the step by one. */
#define KMP_RK_COARSE 3e2

/* The first four vectors of the interpolant of a component: a cubic by the values and slopes at both ends. */
KMP_INLINE void kmp_rk_cubic(double h, double y_old, double y, double begin, double end, double r[4])
{
    double rise = y - y_old, curvature = h * begin - rise;
    r[0] = y_old;
    r[1] = rise;
    r[2] = curvature;
    r[3] = rise - h * end - curvature;
}

/* The value at x, 0 to 1, of vectors r of n components: r0 + x (r1 + z (r2 + x (r3 + ...))), z = 1 - x. */
KMP_INLINE void kmp_rk_interpolate(int n, int vectors, double *const *r, double x, double *y)
{
    for (int i = 0; i < n; i++)
        y[i] = r[vectors - 1][i];
    for (int j = vectors - 1; j-- > 0;) {
        double factor = j % 2 ? 1.0 - x : x;
        for (int i = 0; i < n; i++)
            y[i] = r[j][i] + factor * y[i];
    }
}

/* -- stages ------------------------------------------------------------------------------------------ */

/* out = y + h sum a[j] k[j]; unrolled over the terms, whose number is constant at each call. */
KMP_INLINE void kmp_rk_combine(int n, const double *y, double h, int terms, const double *a, const double *const *k,
                               double *restrict out)
{
    for (int i = 0; i < n; i++) {
        double sum = a[0] * k[0][i];
        for (int j = 1; j < terms; j++)
            sum += a[j] * k[j][i];
        out[i] = y[i] + h * sum;
    }
}

#define KMP_TERMS(a) ((int)(sizeof(a) / sizeof *(a)))

/* k[stage] = f(t + c h, y + h sum a k), within a function that has n, y, h, t, k and C. */
#define KMP_STAGE(stage_number, a, ...)                                                                                \
    do {                                                                                                               \
        kmp_rk_combine(n, y, h, KMP_TERMS(a), a, (const double *const[]){__VA_ARGS__}, s->stage);                      \
        int said = kmp_solver_call(&s->base, t + C[stage_number] * h, s->stage, k[stage_number]);                      \
        if (said != KMP_GO)                                                                                            \
            return said;                                                                                               \
    } while (0)

/* -- interface ---------------------------------------------------------------------------------------- */

void *kmp_rk_create(const kmp_solver_kind *kind, const kmp_solver_setup *setup);
kempe_status kmp_rk_start(void *solver, double t, const double *y, const double *yp, double t_end, double h0);
kempe_status kmp_rk_step(void *solver);

/** Dense output. The first call within a step may evaluate the right-hand side: a formulation with a stored evaluation
 * must then not take it for the step's end. */
kempe_status kmp_rk_dense(void *solver, double t, double *y, double *yp);
void kmp_rk_transfer(void *solver, kmp_number_stream *stream);

#define KMP_RK_SOLVER(id, is_standard)                                                                                 \
    const kmp_solver_kind kmp_solver_##id = {.name = #id,                                                              \
                                             .corrects = true,                                                         \
                                             .constant = true,                                                         \
                                             .standard = is_standard,                                                  \
                                             .method = &kmp_##id,                                                      \
                                             .create = kmp_rk_create,                                                  \
                                             .release = kmp_solver_free,                                               \
                                             .start = kmp_rk_start,                                                    \
                                             .step = kmp_rk_step,                                                      \
                                             .dense = kmp_rk_dense,                                                    \
                                             .transfer = kmp_rk_transfer}
