/* SPDX-License-Identifier: BSD-3-Clause */
/* Attributes of MJCF: an element has its own ones, and those of its class of defaults, which has those of its
 * parent. */
#pragma once

#include "exchange/formats/mjcf.h"

/** Reads the classes of the model. */
void kmp_mjcf_read_classes(kmp_mjcf *m);

/** The class of a name; NULL after a complaint. */
const kmp_mjcf_class *kmp_mjcf_class_of(kmp_mjcf *m, const kmp_element *e, const char *name);

/** An element with the defaults for a word, or for several with blanks around, of its own class or else of this one
 * (NULL: main). */
kmp_mjcf_item kmp_mjcf_take(kmp_mjcf *m, const kmp_element *e, const char *word, const kmp_mjcf_class *around);

/** An element without defaults. */
kmp_mjcf_item kmp_mjcf_plain(const kmp_element *e);

/** The text of an attribute; NULL: neither the element nor a default has it. */
const char *kmp_mjcf_text(const kmp_mjcf_item *item, const char *key);

/** Numbers of an attribute over those of the defaults, over `values`; the most that any of them gives, 0: none. */
int kmp_mjcf_numbers(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, int least, int most, double *values);
double kmp_mjcf_number(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, double absent);

/** True where an attribute is "true", false where it is "false"; anything else is a complaint. */
bool kmp_mjcf_flag(kmp_mjcf *m, const kmp_mjcf_item *item, const char *key, bool absent);

/** The frame of `pos` and of the orientation that is given. */
kmp_pose kmp_mjcf_pose(kmp_mjcf *m, const kmp_mjcf_item *item);

/** The rotation whose axis z has this direction, by the smallest angle. False: it has no length. */
bool kmp_mjcf_along(const double z[3], double r[3][3]);
