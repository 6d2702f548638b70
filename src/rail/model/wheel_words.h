/* SPDX-License-Identifier: BSD-3-Clause */
/* The words of the language for wheels and tracks. */
#pragma once

#include "model/data/wheels.h"

/** The words of the language in order; NULL ends each list. */
extern const char *const kmp_track_side_words[], *const kmp_contact_form_words[], *const kmp_creep_law_words[];
extern const char *const kmp_irregularity_words[], *const kmp_course_words[];

/** The words of spectra.def. */
extern const kmp_name_list kmp_wave_spectrum_words;
