/* SPDX-License-Identifier: BSD-3-Clause */
/* The film of a journal: its law over the place and the rate of the journal, as rows and steps of film_laws.def. */
#pragma once

#include "model/data/compliant.h"
#include "model/read/reading.h"

/** The film of a journal. NULL after an error. */
const kmp_film *kmp_read_film(kmp_reader *r, const kmp_yaml *map, const char *of, const kmp_expr *clearance,
                              const kmp_expr *radius);
