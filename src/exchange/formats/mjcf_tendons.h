/* SPDX-License-Identifier: BSD-3-Clause */
/* Paths of spatial tendons of MJCF over geoms and pulleys. */
#pragma once

#include "exchange/formats/mjcf.h"

/** The site of a name; NULL after a complaint. */
const kmp_mjcf_site *kmp_mjcf_site_of(kmp_mjcf *m, const kmp_element *from, const char *name);

/** True for a tendon with geoms or pulleys. */
bool kmp_mjcf_is_wrapped(const kmp_element *tendon);

/** Adds the ropes of such a tendon, NAME_path or NAME_path_1 and so on between its pulleys, where they are not yet.
 * Returns its length as an expression, NULL after a complaint; `reference`: its length at the references of joints. */
const char *kmp_mjcf_add_path(kmp_mjcf *m, const kmp_element *tendon, const char *name, double *reference);
