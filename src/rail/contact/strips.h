/* SPDX-License-Identifier: BSD-3-Clause */
/* Contact patches that are no ellipse, strip by strip: approximations without the interaction of the strips. */
#pragma once

#include "base/arena.h"
#include "rail/contact/gap.h"

typedef enum kmp_strip_method {
    KMP_STRIPS_ANALYN, /* Sichani, Enblom, Berg 2014: Hertz's ellipse of the curvatures in each strip */
    KMP_STRIPS_KP      /* Kik, Piotrowski 1996: the region where undeformed bodies overlap by 0.55 of the approach */
} kmp_strip_method;

/** The contact under a normal force (N, > 0); modulus = G / (1 - poisson), Pa. `strip` has gap->count members, and is
 * overwritten in any case. False: no memory, or the contact would reach the first or the last strip. `pressed` is then
 * unchanged. */
bool kmp_strips_press(kmp_strip_method method, const kmp_strip_gap *gap, double modulus, double normal,
                      kmp_arena *arena, kmp_strip *strip, kmp_normal_load_patch *pressed);

/** All of `pressed` but the approach, from the strips. Returns the sum of their loads, N. */
double kmp_strips_sum(const kmp_strip_gap *gap, const kmp_strip *strip, kmp_normal_load_patch *pressed);
