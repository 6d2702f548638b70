/* SPDX-License-Identifier: BSD-3-Clause */
/* Models in MJCF. */
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_files_set("model.mjcf", data, size);
    fuzz_walk_file("model.mjcf", 64);
    fuzz_files_clear();
    return 0;
}
