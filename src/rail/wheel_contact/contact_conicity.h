/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "rail/wheel_contact/contact_sweep.h"

/** Reads the amplitudes and the pair of wheels; then computes their conicities from the rows of the table. */
kempe_status kmp_contact_conicity_request(kempe_contacts *table, const kempe_contact_options *options);
kempe_status kmp_contact_conicity(kempe_contacts *table);

/** The displacement and the difference of that pair, from its patches and the outputs of the wheels' poses. The
 * displacement is measured at the points a radius below the centres, so that an axle that rolls on its rails has the
 * one with which it follows them. */
kmp_displaced kmp_contact_displaced(const kempe_contacts *table, const kempe_contact_patch *patches,
                                    const double *poses);

/** True if a contact of that pair moves so far between the last two rows that it may jump. */
bool kmp_contact_may_jump(const kempe_contacts *table);
