/* SPDX-License-Identifier: BSD-3-Clause */
#include "kempe_simulator.h"
