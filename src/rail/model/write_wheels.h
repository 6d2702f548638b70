/* SPDX-License-Identifier: BSD-3-Clause */
/* Profiles, tracks and wheels as the reader understood them, in both forms. */
#pragma once

#include "model/write/model_print.h"

extern const kmp_writer_wing kmp_wheel_writer[];
