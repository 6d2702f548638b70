/* SPDX-License-Identifier: BSD-3-Clause */
/* Data of a run for its page. Of wheels on rails: the track below the vehicle, forces of wheels with their limits,
 * lateral positions, ride comfort. Of contacts: the path of each journal in its bearing, and how deep contacts were. */
#pragma once

#include "base/json.h"
#include "studies/simulate/trajectory.h"
#include <kempe/comfort.h>

/** Puts `running_safety` and its samples, `vehicle`, of a run (NULL: none) with wheels. comfort: NULL for none. */
void kmp_vehicle_drawing(kmp_json *json, const kempe_trajectory *run, const kempe_comfort *comfort);

/** Ride comfort of the accelerations that the model requests, by a run of the same settings; NULL where it has none, or
 * is too short for a window. KEMPE_E_MEMORY, KEMPE_STOPPED. */
kempe_status kmp_vehicle_comfort(const kempe_trajectory *run, kempe_comfort **comfort);

/** True if the model has a joint with clearance. */
bool kmp_contact_drawing_has_paths(const kempe_model *model);

/** Puts a list of the contacts under the key `contacts`; paths are drawn from the rows. */
void kmp_contact_drawing(kmp_json *json, const kempe_trajectory *trajectory, const kmp_samples *rows);
