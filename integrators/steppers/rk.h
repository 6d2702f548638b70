/* SPDX-License-Identifier: BSD-3-Clause */
/* Explicit Runge-Kutta methods with error control, dense output and acceptance of every step by the formulation: the
 * interface of a method to the driver (rk.c), and the driver's internals for its stages. A new method is one file with
 * a kmp_rk_method, a KMP_RK_SOLVER line and a row in integrators.def. */
#pragma once

#include "integrators/steppers/explicit_methods.h"
#include "integrators/steppers/solver.h"

typedef struct kmp_rk kmp_rk;

typedef struct kmp_rk_method {
    kmp_rk_numbers numbers;
    bool ends_with_derivative; /* run computes k[end]; otherwise the driver does, after the error test */

    /* Computes the stages of a step h from (t, y) with k[1] given, ending at t_new. KMP_GO, or the result of the
     * right-hand side. */
    int (*run)(kmp_rk *s, double h, double t_new);

    /* Puts the new y into y_old (temporarily), sets the weights w, and returns the error: 1 is at the tolerance. */
    double (*error)(kmp_rk *s, double h);

    /* Prepares the interpolant of the last step: vectors r of the polynomial r0 + x (r1 + z (r2 + x (r3 + ...))), with
     * z = 1 - x, at t_old + x taken. */
    int (*prepare_dense)(kmp_rk *s);
} kmp_rk_method;

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
void kmp_rk_undo(void *solver, double h);

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
                                             .undo = kmp_rk_undo,                                                      \
                                             .dense = kmp_rk_dense,                                                    \
                                             .transfer = kmp_rk_transfer}
