/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/wings.h"
#include "exchange/bodies/body_formats.h"
#include "exchange/formats/importing.h"

static const kmp_document_wing documents = {kmp_is_foreign, kmp_foreign_load, kmp_foreign_convert};

const kmp_wing kmp_wing_exchange = {.name = "exchange", .documents = &documents, .bodies = kmp_body_formats};
