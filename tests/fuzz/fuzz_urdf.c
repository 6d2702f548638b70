/* SPDX-License-Identifier: BSD-3-Clause */
/* Robots in URDF. */
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_files_set("model.urdf", data, size);
    fuzz_walk_file("model.urdf", 64);
    fuzz_files_clear();
    return 0;
}
