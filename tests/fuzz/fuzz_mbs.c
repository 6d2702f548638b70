/* SPDX-License-Identifier: BSD-3-Clause */
/* ROBOTRAN models. */
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_files_set("model.mbs", data, size);
    fuzz_walk_file("model.mbs", 64);
    fuzz_files_clear();
    return 0;
}
