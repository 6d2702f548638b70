/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/bodies/body_formats.h"
#include "exchange/bodies/dmig_modes.h"
#include "exchange/bodies/sid_modes.h"

#define KMP_BODY_FORMAT(ending, what, read, beside, instead) {ending, what, read, beside, instead},
const kmp_modal_format kmp_body_formats[] = {
#include "exchange/bodies/body_formats.def"
    {.ending = NULL}};
