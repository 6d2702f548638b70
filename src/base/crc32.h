/* SPDX-License-Identifier: BSD-3-Clause */
/* The checksum of ZIP archives. */
#pragma once

#include <stddef.h>
#include <stdint.h>

/** CRC-32 (ISO 3309). */
uint32_t kmp_crc32(const void *bytes, size_t size);
