/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code of x86-64 processors with AVX and FMA: arithmetic on doubles in registers and in memory. Addresses are
 * relative to base 0 (rdi, the first argument of a function), or to further bases, which serve to keep distances short:
 * these fit in a byte within 128 bytes, of eight doubles within 128 of them. Forms: one double, four (ymm), eight (zmm,
 * AVX-512), and two registers of four or of eight, whose chains of operations overlap. The first two have the registers
 * 0 to 15, the third 0 to 31. Of two registers of four, register k is k and k + 8; of eight, k and k + 16. Encodings:
 * Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2, sections 2.3 (VEX) and 2.7 (EVEX). */
#pragma once

#include "backend/encoder/encoder.h"

extern const kmp_encoder kmp_encoder_x86;
