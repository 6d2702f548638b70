/* SPDX-License-Identifier: BSD-3-Clause */
/* The public stepper: a runner, and its current row; its inputs; its state, set, saved, restored, copied; other
 * values of parameters. A restored stepper makes its runner anew from the saved numbers alone, so that nothing of
 * what happened in between remains. */
#pragma once

#include <kempe/stepper.h>

/** Takes the row here again, with inputs that were set since. */
kempe_status kmp_stepper_stand_with_inputs(kempe_stepper *stepper);

/** A state as bytes, for another process with the same system: their number; 0 where delayed signals have a past, whose
 * length changes. Bytes of a state of the same system come back as it; NULL: no memory. */
size_t kmp_stepper_packed_size(const kempe_system *system);
void kmp_stepper_pack(kempe_stepper_state *state, unsigned char *to);
kempe_stepper_state *kmp_stepper_unpack(const kempe_system *system, const unsigned char *from);
