/* SPDX-License-Identifier: BSD-3-Clause */
/* Wheels as the reader understood them, in both forms. */
#pragma once

#include "base/json.h"
#include <kempe/kempe.h>

/** Wheels in either form: nothing where there are none. */
void kmp_model_show_wheels(kmp_text *text, const kempe_model *model);
void kmp_model_json_wheels(kmp_json *json, const kempe_model *model);

/** Profiles and tracks in either form: nothing where there are none. */
void kmp_model_show_tracks(kmp_text *text, const kempe_model *model);
void kmp_model_json_tracks(kmp_json *json, const kempe_model *model);
