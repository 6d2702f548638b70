/* SPDX-License-Identifier: BSD-3-Clause */
/* Models in SDFormat, and files that they include. */
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_files_set("model.sdf", data, size);
    fuzz_walk_file("model.sdf", 64);
    fuzz_files_clear();
    return 0;
}
