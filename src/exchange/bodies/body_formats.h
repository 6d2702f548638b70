/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies in the formats of other programs. A format is a row of body_formats.def and a reader. */
#pragma once

#include "model/flexible/modal_file.h"

/** One without an ending ends them. */
extern const kmp_modal_format kmp_body_formats[];
