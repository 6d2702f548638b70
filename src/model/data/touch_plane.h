/* SPDX-License-Identifier: BSD-3-Clause */
/* Plane motion of two surfaces that touch. */
#pragma once

#include "model/data/model.h"

/** The axis of the second side's point across which the first side's body moves, so that its slip has one direction
 * alone; -1: there is none, and it has two. */
int kmp_touch_plane(const kempe_model *model, const kmp_contact_pair *touch);
