/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies of MJCF. Several joints of a body act one after the other: each but the last one moves a body without mass. */
#pragma once

#include "exchange/formats/mjcf.h"

/** Adds the bodies of all elements `worldbody`, with their joints, masses, shapes and sites. */
void kmp_mjcf_add_bodies(kmp_mjcf *m);

/** By a name in the file; NULL after a complaint. */
const kmp_mjcf_body *kmp_mjcf_body_of(kmp_mjcf *m, const kmp_element *from, const char *name);
const kmp_mjcf_joint *kmp_mjcf_joint_of(kmp_mjcf *m, const kmp_element *from, const char *name);

/** True if a name is taken; takes it. */
bool kmp_mjcf_is_taken(kmp_mjcf_names *names, kmp_arena *arena, const char *name);
void kmp_mjcf_take_name(kmp_mjcf_names *names, kmp_arena *arena, const char *name);
