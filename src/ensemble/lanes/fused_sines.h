/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of lanes by fused multiply-adds, with half the operations, or by rotation from angles nearby, with
 * fewer still. They have other roundings than a single run; the bits of a lane do not depend on the width. */
#pragma once

#include "backend/lanes.h"
#include "base/arena.h"

/** As kmp_sincos_lanes, within 1.5 ulp; the sine of -0 is 0. */
void kmp_fused_sincos(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);

/** The same by rotation from angles nearby, in 0.6 of the time: `base` has for each of the n values `width` angles,
 * their fused sines and their cosines, as kmp_fused_keep takes them. Lanes whose differences have a norm above
 * KMP_FUSED_NEAR have fused results. Errors are below 3 units of 2^-53. */
#define KMP_FUSED_NEAR 0.375
void kmp_fused_near(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                    const double *base);

/** Takes angles with their sines and cosines into a base, in the lanes that are not 0. */
void kmp_fused_keep(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                    const int64_t *lanes, double *base);

/** Three ways in which stages find sines: each separately; by rotation from the base; separately, with a base that is
 * renewed in the lanes that are not 0. */
typedef enum kmp_sines_way { KMP_SINES_ALONE, KMP_SINES_NEAR, KMP_SINES_RENEW } kmp_sines_way;

/** The sines of all stages of a program in lanes. */
typedef struct kmp_fused_sines {
    int width;
    size_t size;  /* of the base of a lane */
    double *base; /* size x width */
    kmp_sines_way way;
    const int64_t *renewed;
    kmp_arena arena; /* of the base */
} kmp_fused_sines;

/** Gives lanes these sines, which stay where they are: each separately at first. false: no memory; the arena is freed
 * in any case. */
bool kmp_fused_sines_init(kmp_fused_sines *sines, kmp_lanes *lanes, int width);

/** The way from now on. */
void kmp_fused_sines_take(kmp_fused_sines *sines, kmp_sines_way way, const int64_t *renewed);

/** The base of a lane: `size` numbers. */
void kmp_fused_sines_get(const kmp_fused_sines *sines, int lane, double *base);
void kmp_fused_sines_put(kmp_fused_sines *sines, int lane, const double *base);
