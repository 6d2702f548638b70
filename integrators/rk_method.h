/* SPDX-License-Identifier: BSD-3-Clause */
/* What a Runge-Kutta method tells the driver (rk.c), and the driver's inside for its stages. A new method is one file
 * with a kmp_rk_method, a KMP_RK_SOLVER line and a row in integrators.def. */
#ifndef KMP_INTEGRATORS_RK_METHOD_H
#define KMP_INTEGRATORS_RK_METHOD_H

#include "integrators/rk.h"
#include "integrators/solver.h"

#include <float.h>
#include <math.h>

enum { KMP_RK_MAX_STAGES = 16, KMP_RK_MAX_INTERPOLANTS = 8 };

/* Stabilising exponent of the step-size control (Gustafsson's PI). */
#define KMP_RK_BETA 0.04
/* Against 0.9, at a given tolerance: half the error for 4 % more evaluations with DOP853, for 10 % more with DOPRI5; at
 * equal error 2 to 4 % fewer (docs/decisions/safety.md). */
#define KMP_RK_SAFETY 0.8
/* The error of the last step counts as no less. */
#define KMP_RK_ERROR_FLOOR 1e-4

struct kmp_rk_method {
    int stages;                /* derivatives k[1] .. k[stages], numbered as published */
    int end;                   /* k[end] is the one at the step's end */
    bool ends_with_derivative; /* run computes it; else the driver does, after the error test */
    int interpolants;          /* vectors of the dense output */
    int order;
    double exponent; /* of the error in the next step's size */
    double shrink, grow;

    /* Stages of a step h from (t, y) with k[1] given, ending at t_new. KMP_GO, or what the right-hand side said. */
    int (*run)(kmp_rk *s, double h, double t_new);

    /* The new y in y_old (for the time being), the weights w, and the error: 1 is at the tolerance. */
    double (*error)(kmp_rk *s, double h);

    /* The interpolant of the last step, and its value at t_old + x taken. */
    int (*prepare_dense)(kmp_rk *s);
    void (*interpolate)(const kmp_rk *s, double x, double *y);
};

struct kmp_rk {
    const kmp_rk_method *method;
    kmp_ode ode;
    kmp_tolerance tolerance;
    double t, t_old, t_end;
    double h;         /* the next step */
    double taken;     /* the last one */
    double error_old; /* of the last accepted step */
    bool rejected;    /* the last attempt was: no growth */
    int hopeless;     /* consecutive hopeless steps */
    bool collapsed;
    bool dense_ready;
    double *y, *y_old, *dy; /* dy is k[end] after a step, k[1] within one */
    double *stage, *w;
    double *k[KMP_RK_MAX_STAGES + 1];
    double *interpolant[KMP_RK_MAX_INTERPOLANTS];
    double *memory;
    kmp_ode_work work;
};

/** dy = f(t, y), counted. */
int kmp_rk_call(kmp_rk *s, double t, const double *y, double *dy);

#define KMP_INLINE static inline __attribute__((always_inline))

/* -- step-size control ------------------------------------------------------------------------------- */

/* The next step after an accepted one (Hairer, Wanner, II, IV.2, with the published bounds); none grows after a
 * rejection. */
KMP_INLINE double kmp_rk_after_accepted(const kmp_rk_method *method, double h, double error, double error_old,
                                        bool rejected)
{
    double factor = pow(error, method->exponent) / pow(error_old, KMP_RK_BETA) / KMP_RK_SAFETY;
    double next = h / fmax(1.0 / method->grow, fmin(method->shrink, factor));
    return rejected ? fmin(next, h) : next;
}

KMP_INLINE double kmp_rk_after_rejected(const kmp_rk_method *method, double h, double error)
{
    if (!(error <= DBL_MAX))
        return h / method->shrink;
    return h / fmin(method->shrink, pow(error, method->exponent) / KMP_RK_SAFETY);
}

/* The step to try, and where it ends: at t_end exactly when it would come near, half way when little more
 * than one step is left. */
KMP_INLINE double kmp_rk_next_step(double t, double t_end, double next, double *t_new)
{
    double left = t_end - t;
    double h = left < 1.01 * next ? left : left < 2.0 * next ? 0.5 * left : next;
    *t_new = h == left ? t_end : t + h;
    return h;
}

/* -- stages ------------------------------------------------------------------------------------------ */

/* out = y + h sum a[j] k[j]; unrolled over the terms, of which there are a fixed number at each use. */
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
        int said = kmp_rk_call(s, t + C[stage_number] * h, s->stage, k[stage_number]);                                 \
        if (said != KMP_GO)                                                                                            \
            return said;                                                                                               \
    } while (0)

/* -- behind the socket ----------------------------------------------------------------------------- */

void *kmp_rk_solver_create(const kmp_solver_setup *setup, const kmp_rk_method *method);
void kmp_rk_solver_release(void *solver);
kempe_status kmp_rk_solver_start(void *solver, double t, const double *y, const double *yp, double t_end, double h0);
kempe_status kmp_rk_solver_step(void *solver);
double kmp_rk_solver_t(const void *solver);
double kmp_rk_solver_t_old(const void *solver);
kempe_status kmp_rk_solver_dense(void *solver, double t, double *y, double *yp);
kmp_solver_work kmp_rk_solver_work(const void *solver);
double kmp_rk_solver_next(const void *solver);

#define KMP_RK_SOLVER(id, is_standard)                                                                                 \
    static void *create(const kmp_solver_setup *setup)                                                                 \
    {                                                                                                                  \
        return kmp_rk_solver_create(setup, &kmp_##id);                                                                 \
    }                                                                                                                  \
    const kmp_solver_kind kmp_solver_##id = {.name = #id,                                                              \
                                             .corrects = true,                                                         \
                                             .standard = is_standard,                                                  \
                                             .create = create,                                                         \
                                             .release = kmp_rk_solver_release,                                         \
                                             .start = kmp_rk_solver_start,                                             \
                                             .step = kmp_rk_solver_step,                                               \
                                             .t = kmp_rk_solver_t,                                                     \
                                             .t_old = kmp_rk_solver_t_old,                                             \
                                             .dense = kmp_rk_solver_dense,                                             \
                                             .work = kmp_rk_solver_work,                                               \
                                             .next = kmp_rk_solver_next}

#endif
