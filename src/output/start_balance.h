/* SPDX-License-Identifier: BSD-3-Clause */
/* The equilibrium at which a motion begins, as text and as JSON. */
#pragma once

#include "base/json.h"
#include "base/text.h"
#include "constraints/closing/assemble.h"

/** Lines below a title; nothing of NULL. */
void kmp_start_balance_show(kmp_text *text, const kmp_start_balance *balance);

/** The member `start` of an open object; nothing of NULL. */
void kmp_start_balance_json(kmp_json *json, const kmp_start_balance *balance);

/** A line below the title of many motions, each from its own start: what each is ("run"); `at` as of a start, nothing
 * of NULL. */
void kmp_starts_show(kmp_text *text, const char *what, const char *at);

/** A copy for print in an arena, also of NULL. False: no memory. */
bool kmp_start_balance_copy(kmp_arena *arena, const kmp_start_balance *from, const kmp_start_balance **to);
