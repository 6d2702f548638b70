/* SPDX-License-Identifier: BSD-3-Clause */
/* Adjoint method: the derivative of one scalar, at the end of a motion or integrated over it, by all parameters at
 * once, for any number of them. */
#pragma once

#include "analyses/sensitivity/forward.h"

typedef struct kmp_adjoint_report {
    kmp_forward_report forward;
    long steps, rhs; /* backwards */
    double cpu_s;    /* of them */
    size_t kept;     /* bytes of the motion */
    double value;
} kmp_adjoint_report;

/** The scalar is `target`, at ask->t_end or, `integral`, integrated from 0 to there; gradient: count values. Rows and
 * watch of `options` are ignored. `known`: another scalar has shown that the motion has derivatives by the parameters
 * at its events. Errors as kmp_forward_run. */
kempe_status kmp_adjoint_run(kmp_sensitivity_equations *varied, const kmp_forward *options,
                             const kmp_forward_target *target, bool integral, bool known, const double *sizes,
                             double *gradient, kmp_adjoint_report *report);
