/* SPDX-License-Identifier: BSD-3-Clause */
/* Sines and cosines of lanes: with the bits of kempe_sincos, by fused multiply-adds, with half the operations, or by
 * rotation from angles nearby, with fewer still. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/** Sines and cosines of `width` lanes, at most 16, of n values in slots: values of slot x[k] at v + width x[k], results
 * in slots s[k] and c[k]. No slot is both read and written. The bits of a lane do not depend on the width. They are
 * those of kempe_sincos, or else `fused` ones within 1.5 ulp, in half the time; the fused sine of -0 is 0. */
void kmp_sincos_lanes(bool fused, int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c);
void kmp_sincos_near(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                     const double *base);

/** Takes angles with their sines and cosines into a base, in the lanes that are not 0. */
void kmp_sincos_keep(int n, int width, double *v, const uint32_t *x, const uint32_t *s, const uint32_t *c,
                     const int64_t *lanes, double *base);
