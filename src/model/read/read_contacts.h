/* SPDX-License-Identifier: BSD-3-Clause */
/* The section `contacts` of a model, after loops and forces. */
#pragma once

#include "model/read/reading.h"

/** Reads what touches what; false after an error. */
bool kmp_read_touch(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_contact_pair *touch);

/** The largest number of forces, and of rows, that contacts add. */
int kmp_contacts_count(const kmp_reader *r);

/** Adds them to the forces. */
void kmp_read_contacts(kmp_reader *r);
