/* SPDX-License-Identifier: BSD-3-Clause */
/* The command `check`. */
#pragma once

#include "constraints/diagnosis/diagnosis.h"
#include <kempe/check.h>

/** The work of kempe_check_new. */
kempe_status kmp_check(const kempe_system *system, kempe_check **check);
