/* SPDX-License-Identifier: BSD-3-Clause */
/* Sentences of `check`, and its JSON. */
#pragma once

#include "constraints/diagnosis/diagnosis.h"
#include "output/print.h"
#include <kempe/check.h>

/** Writes the check as one JSON object. */
kmp_put_fn kmp_check_json;

/** The answer in a few words: "can be simulated", or the reason why not. */
void kmp_check_verdict(kmp_text *text, const kempe_check *check);

/** The explanation of degrees of freedom that differ from the count; "" when they agree. */
void kmp_check_mobility(kmp_text *text, const kempe_check *check);
