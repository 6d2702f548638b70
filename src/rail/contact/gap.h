/* SPDX-License-Identifier: BSD-3-Clause */
/* Two bodies before they are pressed together, in strips along the direction of rolling, and what their contact is
 * afterwards. */
#pragma once

/** The undeformed gap along the common normal. Strips lie at even distances `step` across the direction of rolling, the
 * first one at `first`. In a strip the gap is gap + along/2 (x - centre)^2. Each array has `count` members. */
typedef struct kmp_strip_gap {
    int count;
    double first, step;
    double *gap;    /* m, 0 at the least one */
    double *bend;   /* its second derivative across, 1/m */
    double *centre; /* x where the strip's gap is least, m */
    double *along;  /* relative curvature in the strip, 1/m, > 0 */
} kmp_strip_gap;

/** The contact in the strips, zero where there is none. */
typedef struct kmp_strip {
    double from, to; /* its ends along x, m */
    double pressure; /* largest in the strip, Pa */
    double load;     /* integral of the pressure over x, N/m */
} kmp_strip;

/** The whole contact. */
typedef struct kmp_normal_load_patch {
    double approach; /* of the bodies, m */
    double pressure; /* largest, Pa */
    double area;     /* m^2 */
    double place;    /* of the resultant, across, from the same origin as the strips */
    int lobes;       /* runs of strips in contact */
} kmp_normal_load_patch;
