/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies, their order and their points. The tree comes from the joints' `at`; parents are put before their children,
 * the file's order kept otherwise. */
#pragma once

#include "model/read/reading.h"

extern const kmp_key kmp_body_keys[];

void kmp_read_bodies(kmp_reader *r);
