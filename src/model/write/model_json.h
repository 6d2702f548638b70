/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as one JSON object. */
#pragma once

#include "base/json.h"
#include "base/text.h"
#include "model/data/closure.h"
#include "model/data/force.h"
#include <kempe/kempe.h>

/** One JSON object. */
void kmp_model_json(kmp_text *text, const kempe_model *model);
/** The JSON object of the mechanism without its run settings and its end: the input of the equations. */
void kmp_model_json_mechanism(kmp_text *text, const kempe_model *model);

/** Opens an object that begins a line: a member of the model, an item of a member. */
void kmp_model_json_begin(kmp_json *json, const char *key);
void kmp_model_json_item(kmp_json *json, const char *key);

/** The members of a joint that the reader cut. */
void kmp_model_json_cut(kmp_json *json, const kmp_cut *cut);
void kmp_model_json_point(kmp_json *json, const char *key, const kempe_model *model, int point);
void kmp_model_json_fields(kmp_json *json, const kempe_model *model, const kmp_force *force);
