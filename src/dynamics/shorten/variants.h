/* SPDX-License-Identifier: BSD-3-Clause */
/* Ways to the same values, by which operations are saved: each says at which motions (links, closures) it is taken. */
#ifndef KMP_DYNAMICS_SHORTEN_VARIANTS_H
#define KMP_DYNAMICS_SHORTEN_VARIANTS_H

#include "model/model.h"
#include <stdint.h>

/** How derivatives of the inverse dynamics are made (tangents.h). */
typedef enum kmp_tangent_way { KMP_TANGENT_SHORTER, KMP_TANGENT_FORWARD, KMP_TANGENT_COMPOSITE } kmp_tangent_way;

typedef struct kmp_ways {
    bool *stay;      /* a motion: the link's axes do not turn with it (staying.h; dynamics alone, as all but `way`) */
    bool *about;     /* a motion: its link's moments are taken about the joint instead of the centre of mass */
    uint8_t *origin; /* a motion: where its link's origin is, a kmp_origin (origins.h) */
    uint8_t *give;   /* a motion: what of its link's mass counts as its parent's, bits of kmp_give (regroup.h) */
    uint8_t *lump;   /* a motion: the same for composite bodies */
    uint8_t *way;    /* four a closure: how its two points are followed, for h and J, and for their rates (gap.h) */
    bool spread;     /* composite bodies have sum m x x' instead of the inertia (spread.h) */
    kmp_tangent_way by_q, by_qd; /* SHORTER: both are chosen together */
    bool apart; /* rotations about parallel axes one after the other are not made one, but back to the source */
} kmp_ways;

/** None taken anywhere. false: no memory. To be freed in any case. */
bool kmp_ways_init(kmp_ways *ways, const kempe_model *model);
void kmp_ways_free(kmp_ways *ways);

/** Both of the same model. */
void kmp_ways_copy(kmp_ways *to, const kmp_ways *from, const kempe_model *model);

bool kmp_ways_same(const kmp_ways *a, const kmp_ways *b, const kempe_model *model);

/** Whether the links of the dynamics are as the model has them. */
bool kmp_ways_plain(const kmp_ways *ways, const kempe_model *model);

#endif
