/* SPDX-License-Identifier: BSD-3-Clause */
/* Claims on the parts of a folder: files that are made exclusively, so that processes on several hosts share the work.
 * A claim has the name of its process. Another process takes it over when that process has ended: on the same host by
 * its process number and start time, on another one when nobody has touched the claim for KMP_CLAIM_STALE seconds. A
 * thread of the owner touches it. A part that two processes make nevertheless has the same bytes from both. */
#pragma once

#include "base/context.h"

enum { KMP_CLAIM_STALE = 300, KMP_CLAIM_BEAT = 15 }; /* s */

typedef struct kmp_claims kmp_claims;

/** Makes the subfolder of the claims. KEMPE_E_IO: it cannot be made. */
kempe_status kmp_claims_new(kempe_context *context, const char *folder, kmp_claims **claims);
/** Releases a claim that is still held. */
void kmp_claims_free(kmp_claims *claims);

/** Claims a part, one at a time; *taken is false where another living process has it. KEMPE_E_IO. */
kempe_status kmp_claims_take(kmp_claims *claims, int part, bool *taken);
void kmp_claims_release(kmp_claims *claims);

/** Removes all claims, their folder, and unfinished files of parts, when every part is whole. */
void kmp_claims_clear(const char *folder);
