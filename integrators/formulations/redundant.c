/* SPDX-License-Identifier: BSD-3-Clause */
#include "integrators/formulations/redundant.h"
#include "constraints/rounding/rounding.h"
#include "constraints/tolerances.h"
#include "integrators/steppers/ode.h"
#include <math.h>

int kmp_redundant_check(const kmp_evaluator *eval, const kmp_partition *part, double t, double tolerance,
                        kmp_text *reason)
{
    const kmp_rounding *rounding = kmp_rounding_of(eval->system);
    double allowed = fmax(KMP_DROPPED_WEIGHTS * tolerance, rounding ? KMP_DROPPED_TOLERANCES * rounding->tolerance : 0);
    for (int k = 0; part->m > part->r && k < part->r; k++)
        allowed = fmax(allowed, KMP_DROPPED_OVER_KEPT * kmp_eval_opening(eval, part->rows[k]));
    for (int k = 0; k < part->m - part->r; k++) {
        int row = part->redundant[k];
        double h = kmp_eval_opening(eval, row);
        if (h <= allowed)
            continue;
        kmp_text_printf(
            reason,
            "closure row '%s', redundant at the start, has the residual %.3g (scaled) at t = %.9g: the run began at a "
            "change point, where the closures have a lower rank; start near it, on the intended branch",
            eval->system->row_names[row], h, t);
        return KMP_HALT;
    }
    return KMP_GO;
}
