/* SPDX-License-Identifier: BSD-3-Clause */
/* The part of a functional mock-up unit that both versions of the FMI share: kempe_fmu.h explains it. An instance knows
 * what the importer has set since the simulator was evaluated, and evaluates it when values are read.
 *
 * fmu_communication.h is the last part; each part includes the one before it. */
#include "kempe_fmu.h"
#include "exchange/simulator/fmu_communication.h"
