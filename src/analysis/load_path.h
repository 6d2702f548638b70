/* SPDX-License-Identifier: BSD-3-Clause */
/* Who pulls along a coordinate: the virtual work of gravity, of each force element and of the motion itself on a small
 * change of one independent coordinate, the others held and the closures met. Closures do none. Each is evaluated from
 * equations of its own, which have that element alone. */
#ifndef KMP_ANALYSIS_LOAD_PATH_H
#define KMP_ANALYSIS_LOAD_PATH_H

#include "analysis/linear.h"

enum { KMP_PULL_GRAVITY = -1, KMP_PULL_MOTION = -2, KMP_PULL_USER = -3 };

typedef struct kmp_pull {
    int force;     /* of the model, or one of those above */
    double effort; /* N m or N, in the direction of the coordinate */
} kmp_pull;

typedef struct kmp_load_path {
    kmp_pull *pull; /* those that are not zero, largest first */
    int count;
    double sum;
} kmp_load_path;

/** Along u[k] of the last state. KEMPE_E_MEMORY. */
kempe_status kmp_load_path_find(const kmp_linear *linear, int k, kmp_load_path *path);
void kmp_load_path_free(kmp_load_path *path);

/** "gravity -9.81 N, 'k' 2 N, together -7.81 N". */
void kmp_load_path_tell(kmp_text *text, const kmp_linear *linear, int k, const kmp_load_path *path);

#endif
