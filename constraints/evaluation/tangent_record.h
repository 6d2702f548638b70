/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs of tangents, kept in the system's cache and recalled from it. */
#pragma once

#include "constraints/evaluation/tangent.h"
#include "model/data/force.h"

/** False: there are none, and the tangents are unchanged. */
bool kmp_tangents_recall(kmp_tangents *tangents, const kempe_system *system, unsigned values);
void kmp_tangents_keep(const kmp_tangents *tangents, const kempe_system *system, unsigned values);
