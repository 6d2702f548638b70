/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as a summary to read. */
#pragma once

#include "base/text.h"
#include "model/data/closure.h"
#include <kempe/kempe.h>

/** A summary to read. */
void kmp_model_show(kmp_text *text, const kempe_model *model);
