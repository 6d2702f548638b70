/* SPDX-License-Identifier: BSD-3-Clause */
/* Assembly: the loops closed from the model's guess, rates made consistent. */
#ifndef KMP_CONSTRAINTS_ASSEMBLE_H
#define KMP_CONSTRAINTS_ASSEMBLE_H

#include "dynamics/system.h"

struct kempe_assembly {
    const kempe_system *system;
    double *q, *qd;  /* n */
    double residual; /* max |h| / row scale */
    double gap;      /* widest gap of a closure, m */
    bool closed;
    bool rates_changed; /* the given rates contradict the closures: they were corrected */
    int iterations;     /* of Gauss-Newton and Newton */
    int newton;         /* of these, by KINSOL */
    double *gaps;       /* gap of each closure, m, in the order of the model */
    int *culprits;      /* closures that stay open, widest first */
    int culprit_count;
    double *moved; /* n: how far each coordinate went from the guess */
};

/* kempe_assemble and kempe_assembly_free are the way in (kempe.h). */

#endif
