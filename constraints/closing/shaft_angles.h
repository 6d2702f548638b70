/* SPDX-License-Identifier: BSD-3-Clause */
/* Angles between the shafts of joints of constant velocity. */
#pragma once

#include <kempe/kempe.h>

/** KEMPE_E_FAILED if two shafts are folded onto each other, where such a joint transmits nothing; q: the user's
 * coordinates. */
kempe_status kmp_shafts_refuse(const kempe_system *system, const double *q);

/** Warns of angles that no such joint has. */
kempe_status kmp_shafts_warn(const kempe_system *system, const double *q);
