/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include <kempe/check.h>

/** The work of kempe_check_new. */
kempe_status kmp_check(const kempe_system *system, kempe_check **check);
