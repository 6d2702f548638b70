/* SPDX-License-Identifier: BSD-3-Clause */
/* Names of the entries of bushings' matrices, and whether they are symmetric. */
#include "model/data/bushing_matrix.h"

const char *const kmp_bushing_keys[KMP_BUSHING_KINDS] = {"matrix", "damping_matrix"};

#define ROW(i) i "1", i "2", i "3", i "4", i "5", i "6"
const char *const kmp_bushing_entries[KMP_BUSHING_SIZE * KMP_BUSHING_SIZE] = {ROW("1"), ROW("2"), ROW("3"),
                                                                              ROW("4"), ROW("5"), ROW("6")};

int kmp_bushing_opposite(int entry)
{
    return entry % KMP_BUSHING_SIZE * KMP_BUSHING_SIZE + entry / KMP_BUSHING_SIZE;
}

int kmp_bushing_uneven(const kmp_bushing_matrix *matrix, kmp_bushing_kind kind)
{
    const kmp_number *of = matrix->of[kind];
    for (int i = 0; i < KMP_BUSHING_SIZE && !matrix->nonsymmetric; i++)
        for (int j = i + 1; j < KMP_BUSHING_SIZE; j++) {
            const int entry = KMP_BUSHING_SIZE * i + j;
            if (of[entry].value != of[kmp_bushing_opposite(entry)].value)
                return entry;
        }
    return -1;
}
