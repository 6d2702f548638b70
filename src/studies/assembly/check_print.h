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

/** The result of the second-order test, "" when it was not needed. */
void kmp_check_second(kmp_text *text, const kempe_check *check);

/** The parts of a closure that may be left out. */
void kmp_check_repair(kmp_text *text, const kempe_check *check, const kmp_repair *repair);

/** The reason why a loop is too short for every configuration; the effect of a release. */
void kmp_check_reach(kmp_text *text, const kempe_check *check, const kmp_reach *reach);
void kmp_check_release(kmp_text *text, const kempe_check *check, const kmp_release *release);

/** The motion of coordinate k: "turns fully", "swings between .. and ..". */
void kmp_check_swing(kmp_text *text, const kempe_check *check, int k);

/** Names with commas between, the first ones of many. */
void kmp_list_rows(kmp_text *text, const kempe_system *system, int count, const int *rows);
