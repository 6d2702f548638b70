/* SPDX-License-Identifier: BSD-3-Clause */
/* Tendons and actuators of MJCF as forces. A fixed tendon is a linear form of coordinates, a spatial one a rope
 * through sites. */
#pragma once

#include "exchange/formats/mjcf.h"

/** Adds to a form: a coordinate of Kempe; a joint of the file; the joints of the fixed tendon of a name. */
void kmp_mjcf_add_term(kmp_mjcf *m, kmp_mjcf_form *f, const char *joint, double factor);
void kmp_mjcf_add_joint(kmp_mjcf *m, kmp_mjcf_form *f, const kmp_element *from, const char *name, double factor);
void kmp_mjcf_add_tendon(kmp_mjcf *m, kmp_mjcf_form *f, const kmp_element *from, const char *name);

/** Prints a form, "1*q(a) + -0.5*q(b)"; `word`: q, or qd for its rate. */
void kmp_mjcf_put_form(kmp_text *text, const kmp_mjcf_form *f, const char *word);

/** Adds the springs, dampers and friction of tendons, and actuators as forces of inputs. */
void kmp_mjcf_add_tendons(kmp_mjcf *m);
void kmp_mjcf_add_actuators(kmp_mjcf *m);
