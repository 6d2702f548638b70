/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/crc32.h"

/* A byte at a time. */
uint32_t kmp_crc32(const void *bytes, size_t size)
{
    const unsigned char *byte = bytes;
    uint32_t table[256], sum = 0xffffffffu;
    for (uint32_t k = 0; k < 256; k++) {
        table[k] = k;
        for (int i = 0; i < 8; i++)
            table[k] = table[k] & 1 ? table[k] >> 1 ^ 0xedb88320u : table[k] >> 1;
    }
    for (size_t k = 0; k < size; k++)
        sum = table[(sum ^ byte[k]) & 0xff] ^ sum >> 8;
    return ~sum;
}
