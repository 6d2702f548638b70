/* SPDX-License-Identifier: BSD-3-Clause */
/* Contacts of a run as a page draws them: the path of each journal in its bearing, and how deep contacts were. */
#pragma once

#include "base/json.h"
#include "studies/simulate/trajectory.h"

/** True if the model has a joint with clearance. */
bool kmp_contact_drawing_has_paths(const kempe_model *model);

/** Puts a list of the contacts under the key `contacts`; paths are those of the rows. */
void kmp_contact_drawing(kmp_json *json, const kempe_trajectory *trajectory, const kmp_samples *rows);
