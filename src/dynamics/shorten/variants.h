/* SPDX-License-Identifier: BSD-3-Clause */
/* Variants that save operations with equal values: each member selects the motions (links, closures) that use it. */
#ifndef KMP_DYNAMICS_SHORTEN_VARIANTS_H
#define KMP_DYNAMICS_SHORTEN_VARIANTS_H

#include "model/model.h"
#include <stdint.h>

/** Methods for derivatives of the inverse dynamics (formalisms/tangents.h). */
typedef enum kmp_tangent_way { KMP_TANGENT_SHORTER, KMP_TANGENT_FORWARD, KMP_TANGENT_COMPOSITE } kmp_tangent_way;

/* The arrays are one block, which begins with `stay`. */
typedef struct kmp_ways {
    uint8_t *stay;  /* a motion: the link's axes do not turn with it (fixed_axes.h; dynamics alone, as all but `way`) */
    uint8_t *about; /* a motion: its link's moments are taken about the joint instead of the centre of mass */
    uint8_t *origin; /* a motion: where its link's origin is, a kmp_origin (origins.h) */
    uint8_t *give; /* a motion: the part of its link's mass that counts as its parent's, bits of kmp_give (regroup.h) */
    uint8_t *lump; /* a motion: the part for composite bodies, bits of kmp_give */
    uint8_t *way;  /* four a closure: the variants of its two points, for h and J, and for their rates (point_gap.h) */
    uint8_t *spread; /* one: composite bodies have sum m x x' instead of the inertia (kinematics/composite.h) */
    uint8_t *apart;  /* one: consecutive rotations about parallel axes are not merged, except back to the source */
    kmp_tangent_way by_q, by_qd; /* SHORTER: both are chosen together */
} kmp_ways;

/** None taken anywhere. false: no memory. To be freed in any case. */
bool kmp_ways_init(kmp_ways *ways, const kempe_model *model);
void kmp_ways_free(kmp_ways *ways);

/** Copies variants of the same model. */
void kmp_ways_copy(kmp_ways *to, const kmp_ways *from, const kempe_model *model);

/** True if all but the methods for derivatives are equal. */
bool kmp_ways_same(const kmp_ways *a, const kmp_ways *b, const kempe_model *model);

/** True if the links of the dynamics are those of the model. */
bool kmp_ways_plain(const kmp_ways *ways, const kempe_model *model);

#endif
