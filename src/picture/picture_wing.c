/* SPDX-License-Identifier: BSD-3-Clause */
#include "base/wings.h"
#include "picture/drawing.h"

const kmp_wing kmp_wing_picture = {.name = "picture", .picture = kmp_mechanism_picture};
