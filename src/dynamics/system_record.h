/* SPDX-License-Identifier: BSD-3-Clause */
/* A derived system in the context's cache. */
#pragma once

#include "dynamics/system.h"

/** The system of a model and an algorithm's word (NULL: the model's) that an earlier process has kept, NULL if there is
 * none. It is equal to a derived one to the bit, after its assembly at the start has looked for rounded numbers. */
kempe_system *kmp_system_recall(const kempe_model *model, const char *word);

/** Keeps a system for kmp_system_recall. It must be as derived, and its numbers not rounded. */
void kmp_system_keep(kempe_system *system);

/** Keeps articulated bodies as made, if the system has a key. kmp_bodies_recall: the ones that an earlier process
 * has kept, or none. */
void kmp_bodies_keep(const kempe_system *system);
bool kmp_bodies_recall(const kempe_system *system);

/** The same of M and C that waited. NULL: none are kept. */
void kmp_motion_keep(const kempe_system *system);
kmp_program *kmp_motion_recall(const kempe_system *system);
