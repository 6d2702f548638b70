/* SPDX-License-Identifier: BSD-3-Clause */
/* Variants that save operations with equal values: each member selects the motions (links, closures) that use it. */
#pragma once

#include "base/cache/bytes.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <stdint.h>

struct kmp_tree;

/** Methods for derivatives of the inverse dynamics (tangents.h). */
typedef enum kmp_tangent_method { KMP_TANGENT_SHORTER, KMP_TANGENT_FORWARD, KMP_TANGENT_COMPOSITE } kmp_tangent_method;

/** Targets of an origin, as far as the joint permits: a rotation's may be anywhere along its axis, a
 * translation's anywhere. This creates zeros of the data. */
typedef enum kmp_origin {
    KMP_ORIGIN_KEPT,
    KMP_ORIGIN_PARENT, /* to its parent's */
    KMP_ORIGIN_MASS,   /* to the centre of mass */
    KMP_ORIGIN_CHILD,  /* to the point of the first link that it carries */
    KMP_ORIGINS
} kmp_origin;

/** The parts of a link's mass m, first moment b and inertia K about its origin that the parent receives; e is the
 * joint's axis. */
enum {
    KMP_GIVE_MASS = 1,    /* rotation: m at the origin */
    KMP_GIVE_MOMENT = 2,  /* rotation: the component of b along e, by masses on the axis */
    KMP_GIVE_INERTIA = 4, /* rotation: s (1 - e e'), of masses along the axis, s = K across it; translation: K */
    KMP_GIVE_ALL = 7
};

/* The arrays are one block, which begins with `stay`. */
typedef struct kmp_savings {
    uint8_t *stay;   /* a motion: the link's axes do not turn with it (only dynamics, as all but `point`) */
    uint8_t *about;  /* a motion: its link's moments are taken about the joint instead of the centre of mass */
    uint8_t *origin; /* a motion: where its link's origin is, a kmp_origin */
    uint8_t *give;   /* a motion: the part of its link's mass that counts as its parent's, bits KMP_GIVE */
    uint8_t *lump;   /* a motion: the part for composite bodies, bits KMP_GIVE */
    uint8_t *point; /* four a closure: the variants of its two points, for h and J, and for their rates (point_gap.h) */
    kmp_tangent_method by_q, by_qd; /* SHORTER: both are chosen together */
    unsigned patterns;              /* bits of the patterns that a search has taken (choose_variants.c) */
} kmp_savings;

/** None taken anywhere. false: no memory. To be freed in any case. */
bool kmp_savings_init(kmp_savings *savings, const kempe_model *model);
/** None taken anywhere, as new. */
void kmp_savings_clear(kmp_savings *savings, const kempe_model *model);
void kmp_savings_free(kmp_savings *savings);

/** Copies variants of the same model. */
void kmp_savings_copy(kmp_savings *to, const kmp_savings *from, const kempe_model *model);

/** Copies all variants except the ones of closures. */
void kmp_savings_copy_dynamics(kmp_savings *to, const kmp_savings *from, const kempe_model *model);

/** Variants as bytes; also none, without room. */
void kmp_savings_put(kmp_bytes *bytes, const kmp_savings *savings, const kempe_model *model);
/** Takes written variants; the source fails where there is no memory. To be freed. */
void kmp_savings_take(kmp_byte_source *source, kmp_savings *savings, const kempe_model *model);

/** True if all but the methods for derivatives are equal. */
bool kmp_savings_same(const kmp_savings *a, const kmp_savings *b, const kempe_model *model);

/** True if the links of the dynamics are the links of the model. */
bool kmp_savings_plain(const kmp_savings *savings, const kempe_model *model);

/* The steps from the model's links to the links of the dynamics, in this order. The first three require axes that turn
 * with their links. */

/** Moves the origin of each motion, from the ground outwards, each after those before it. Points, and thus all results,
 * are unchanged. The links have inertias only about centres of mass. */
void kmp_move_origins(struct kmp_tree *tree, const uint8_t *origin);

/** Regroups masses by `give` of each motion; links carried by the ground give nothing. Changes only kmp_link.own,
 * whose links use moments about their joints from then on. */
void kmp_regroup(struct kmp_tree *tree, const uint8_t *give);

/** Regroups composite bodies, changing kmp_link.base. The mass they receive is the mass of all carried bodies at the
 * joint's current position: it then moves with the parent, through a translation too. */
void kmp_lump(struct kmp_tree *tree, const uint8_t *give);

/** Sets `stay` of each motion, only of rotations. */
void kmp_let_stay(struct kmp_tree *tree, const uint8_t *stay);
