/* SPDX-License-Identifier: BSD-3-Clause */
/* The identity of the build, as a part of the cache's keys. */
#pragma once

#include "base/cache/digest.h"
#include <stdbool.h>

/** Adds what the results of this process depend on beside their inputs: the build of Kempe, those of the libraries that
 * it has loaded, and the processor's features. False if a build has no identity: nothing can be kept then. */
bool kmp_cache_add_build(kmp_digest *digest);
