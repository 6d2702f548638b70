/* SPDX-License-Identifier: BSD-3-Clause */
/* The section `outlines` of a model, before contacts. */
#pragma once

#include "model/data/outline.h"
#include "model/read/reading.h"

/** Adds the outlines to the model. */
void kmp_read_outlines(kmp_reader *r);

/** The outline of a name at a node; NULL after an error. */
const kmp_outline *kmp_read_outline_name(kmp_reader *r, const kmp_yaml *node, const char *what);
