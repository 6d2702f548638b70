/* SPDX-License-Identifier: BSD-3-Clause */
/* Simulating: options to a run, a run to a trajectory. */
#include "studies/simulate/trajectory.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/wings.h"
#include "constraints/closing/assembly_modes.h"
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/left_tables.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/evaluation/present_inputs.h"
