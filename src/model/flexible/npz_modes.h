/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies of the format kempe-flexible-1: arrays in an .npz. */
#pragma once

#include "model/flexible/modal_file.h"

bool kmp_npz_modes_read(const kmp_modal_source *source);
