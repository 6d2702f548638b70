/* SPDX-License-Identifier: BSD-3-Clause */
/* The text of include/kempe/runtime.h, line by line, as the build put it into the library; NULL ends it. */
#pragma once

extern const char *const kmp_runtime_lines[];
