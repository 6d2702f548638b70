/* SPDX-License-Identifier: BSD-3-Clause */
/* SUNDIALS IDA behind the DAE socket, with the linear solvers of linear.def. */
#ifndef KMP_INTEGRATORS_IDA_H
#define KMP_INTEGRATORS_IDA_H

#include "base/context.h"
#include "integrators/dae.h"

typedef struct kmp_ida kmp_ida;

/** `linear` names a row of linear.def, or "auto". NULL after a message. */
kmp_ida *kmp_ida_new(kempe_context *context, const kmp_dae *dae, kmp_tolerance tolerance, const char *linear);
void kmp_ida_free(kmp_ida *s);

/** Consistent (y, yp) at t; h0 > 0 is the first step. */
kempe_status kmp_ida_start(kmp_ida *s, double t, const double *y, const double *yp, double t_end, double h0);

/** One internal step, not beyond t_end. KEMPE_E_FAILED: the message says what IDA said and what it means. */
kempe_status kmp_ida_step(kmp_ida *s);

double kmp_ida_t(const kmp_ida *s);
double kmp_ida_t_old(const kmp_ida *s);

/** y and yp at t_old <= t <= t of the last step. */
kempe_status kmp_ida_dense(kmp_ida *s, double t, double *y, double *yp);
kmp_dae_work kmp_ida_work(const kmp_ida *s);

#endif
