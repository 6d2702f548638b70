/* SPDX-License-Identifier: BSD-3-Clause */
/* Shapes of bodies for the picture of a page, as JSON. */
#pragma once

#include "base/json.h"
#include "model/model.h"

/** Members of an open object: `solids` of a body, and `meshes` that solids name by their file; nothing where there are
 * none. */
void kmp_drawn_shapes(kmp_json *json, const kempe_model *model, int body);
void kmp_drawn_shapes_meshes(kmp_json *json, const kempe_model *model);
