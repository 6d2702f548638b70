/* SPDX-License-Identifier: BSD-3-Clause */
/* A ROBOTRAN model, converted to an equivalent YAML document; its nodes have the places of the elements that they
 * come from. Values common to both languages are passed on unread: the reader checks them. */
#pragma once

#include "exchange/formats/formats.h"

/** A conversion of formats.def. Errors are in import->status. */
void kmp_mbs_convert(kmp_import *import);
