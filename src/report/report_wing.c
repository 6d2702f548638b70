/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/wings.h"
#include "report/drawing.h"

const kmp_wing kmp_wing_report = {.name = "report", .picture = kmp_mechanism_picture};
