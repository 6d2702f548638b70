/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code of 64-bit ARM processors, all of which have two lanes of double and fused multiply-add (Advanced SIMD):
 * arithmetic on doubles in the registers d0 to d31 or v0.2d to v31.2d, loads and stores. Forms: one double; and two
 * registers of two, for slots of four doubles, or for four lanes of slots of eight and sixteen. Base 0 is x0, the first
 * argument of a function, further ones x1 to x6. A distance beyond an instruction's reach is counted from a place in
 * the same 32 KiB, whose address one of x8 to x15 has. Encodings: Arm Architecture Reference Manual for A-profile, C4.1
 * and C7.2; which registers a function may overwrite: Procedure Call Standard for the Arm 64-bit Architecture, 6.1. */
#pragma once

#include "backend/encoder/encoder.h"

extern const kmp_encoder kmp_encoder_arm64;
