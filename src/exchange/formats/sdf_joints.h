/* SPDX-License-Identifier: BSD-3-Clause */
/* Joints of SDFormat as a graph, whose tree the reader of the document chooses; their springs, dampers and friction;
 * what couples their coordinates; the attachment of models to the world. */
#pragma once

#include "exchange/formats/sdf_parts.h"

/** Writes all joints, and attaches the models that no joint connects to the world. */
void kmp_sdf_add_joints(kmp_sdf *s);
