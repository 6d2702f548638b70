/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers shared by laws of numbers and laws of expressions; FASTSIM for arguments that are already checked. */
#pragma once

#include <kempe/rolling_contact.h>

/** Creepage within which Polach's law has Kalker's coefficient of each axis for itself: above the creepages that
 * rounding leaves in a steady motion, 1e-16 to 1e-12, and far below those at which forces matter. */
#define KMP_POLACH_NEAR 1e-9
