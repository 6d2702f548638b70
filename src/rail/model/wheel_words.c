/* SPDX-License-Identifier: BSD-3-Clause */
#include "rail/model/wheel_words.h"

const char *const kmp_contact_form_words[] = {"rigid", "elastic", NULL};
const char *const kmp_creep_law_words[] = {"none", "linear", "shen", "polach", "tanh", NULL};
const char *const kmp_track_side_words[] = {"left", "right", NULL};
const char *const kmp_irregularity_words[] = {"alignment", "level", "cross", "gauge", NULL};
const char *const kmp_course_words[] = {"straight", "transition", "left", "right", NULL};

#define KMP_WORDS(all) ((int)(sizeof(all) / sizeof *(all)) - 1)
_Static_assert(KMP_WORDS(kmp_contact_form_words) == KMP_CONTACT_ELASTIC + 1, "a form of contact without a word");
_Static_assert(KMP_WORDS(kmp_creep_law_words) == KMP_CREEP_LAWS, "a law without a word");
_Static_assert(KMP_WORDS(kmp_track_side_words) == KMP_TRACK_SIDES, "a rail without a word");
_Static_assert(KMP_WORDS(kmp_irregularity_words) == KMP_IRREGULARITIES, "an irregularity without a word");
_Static_assert(KMP_WORDS(kmp_course_words) == KMP_COURSE_KINDS, "a kind of piece without a word");

static const char *const spectra[] = {
#define KMP_SPECTRUM(word, alignment, level) #word,
#include "rail/model/spectra.def"
#undef KMP_SPECTRUM
};
const kmp_name_list kmp_wave_spectrum_words = {spectra, sizeof *spectra, sizeof spectra / sizeof *spectra};
