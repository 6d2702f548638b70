/* SPDX-License-Identifier: BSD-3-Clause */
/* Model files, with what they include and tables they read; `#== NAME` begins another file. */
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_files_set("model.yaml", data, size);
    fuzz_walk_file("model.yaml", 64);
    fuzz_files_clear();
    return 0;
}
